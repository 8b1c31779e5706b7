"""Take-off and landing around a hover hold, for an aircraft that stands on contact points.

On the ground the feedback of position and attitude would work against friction: it acts in the air only. What lifts off
and sets down is the collective, at a steady rate; the other controls are at their trims meanwhile.
"""

from __future__ import annotations  # `help` then shows types by their names

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sbs_sim.model import state as S
from sbs_sim.model.frames import quaternion_to_euler
from sbs_sim.pilot.hover_hold import MAX_STATE_INTERVAL, HoverHold, checked_body

Array = NDArray[np.float64]

STANDING, LIFTING, FLYING, SETTLING = PHASES = ("standing", "lifting", "flying", "settling")
COLLECTIVE_RATE = math.radians(3.0)  # rad/s, on the ground
REST_COLLECTIVE = 0.0  # rad
VERTICAL_RATE = 0.4  # m/s, of the target's height: of the climb, and of the sink before it touches
CLEARANCE = 0.1  # m; a target at least this high above where it stands is one to take off for
CLOSE = 0.3  # m, horizontal distance from the target beyond which it does not come down
FIRM = 0.2  # s for which half of the points must touch before the collective goes down


class Landing:
    """A hover hold that takes off, and lands where its target is on the ground or below it.

    Parameters
    ----------
    pilot : HoverHold
    trim : ndarray, shape (n_controls,)
        Controls in hover.
    axes : ndarray of int64, shape (4,)
        Of them those that heave, roll, pitch and yaw.

    Attributes
    ----------
    phase : str
        One of `PHASES`; empty before the first state.
    """

    def __init__(self, pilot: HoverHold, trim: Array, axes: NDArray[np.int64]) -> None:
        self._pilot, self._trim, self._collective = pilot, trim, int(axes[0])
        self.restart()

    def restart(self, target: tuple[Array, float] | None = None) -> None:
        """Begin anew: on the ground where the next state is, else at a target, or where that state is."""
        self._pilot.restart(target)
        self.phase = ""
        self._wanted: tuple[Array, float] | None = target
        self._height = 0.0  # of the target that the hold has now, down [m]
        self._controls = self._trim.copy()
        self._firm = 0.0
        self._time: float | None = None

    def hold(self, position: ArrayLike, heading: float) -> None:
        """Go to a position, NED [m], and a heading [rad]; see `HoverHold.hold`."""
        self._pilot.hold(position, heading)  # checks them
        self._wanted = np.array(position, dtype=float), heading

    def controls(self, time: float, body: ArrayLike, touching: float | None) -> Array:
        """Pilot controls, shape (n_controls,), of a state.

        Parameters
        ----------
        time, body : see `HoverHold.controls`
        touching : float or None
            Share of the contact points that touch the ground, 0 to 1; None for an aircraft without such points, which
            the hover hold flies alone.

        Raises
        ------
        PilotError
            See `HoverHold.controls`.
        """
        if touching is None:
            self.phase = FLYING
            return self._pilot.controls(time, body)
        values = checked_body(time, body)
        if self._time is not None and time < self._time:
            self.restart()
        elapsed = 0.0 if self._time is None else min(time - self._time, MAX_STATE_INTERVAL)
        self._time = time
        self._enter(values, touching, elapsed)
        if self.phase == FLYING:
            self._lead(values, elapsed)
            self._controls = self._pilot.controls(time, values)
        else:
            self._on_ground(elapsed)
        return self._controls.copy()

    def _enter(self, body: Array, touching: float, elapsed: float) -> None:
        """Take the phase that follows from a state."""
        if not self.phase:
            self.phase = STANDING if touching > 0.0 else FLYING
            self._height = float(body[S.DOWN])
        wanted = float(body[S.DOWN]) if self._wanted is None else float(self._wanted[0][2])
        # a soft touch rebounds: what it has lasted is forgotten half as fast
        self._firm = self._firm + elapsed if touching >= 0.5 else max(0.0, self._firm - 0.5 * elapsed)
        if self.phase == STANDING and wanted < body[S.DOWN] - CLEARANCE:
            self.phase = LIFTING
        elif self.phase == LIFTING and touching == 0.0:
            self.phase, self._firm = FLYING, 0.0
            heading = quaternion_to_euler(body[S.ATTITUDE : S.VELOCITY])[0]
            self._height = float(body[S.DOWN])
            self._pilot.take_over((body[: S.ATTITUDE].copy(), heading), heading, self._controls)
        elif self.phase == FLYING and touching >= 0.5 and self._firm > FIRM and wanted > body[S.DOWN] - CLEARANCE:
            self.phase = SETTLING
        elif self.phase == SETTLING and self._controls[self._collective] <= REST_COLLECTIVE:
            self.phase = STANDING

    def _lead(self, body: Array, elapsed: float) -> None:
        """Move the height of the target at a steady rate; down only where it is over its place."""
        if self._wanted is None:
            return
        position, heading = self._wanted
        step = VERTICAL_RATE * elapsed
        far = math.hypot(*(body[:2] - position[:2])) > CLOSE
        change = min(max(position[2] - self._height, -step), 0.0 if far else step)
        self._height += change
        self._pilot.hold(np.array([position[0], position[1], self._height]), heading)

    def _on_ground(self, elapsed: float) -> None:
        """Move the collective, and the others to their trims."""
        step = COLLECTIVE_RATE * elapsed
        goal = self._trim.copy()
        goal[self._collective] = np.inf if self.phase == LIFTING else REST_COLLECTIVE
        if self.phase == STANDING:
            self._controls = goal
        else:
            self._controls = self._controls + np.clip(goal - self._controls, -step, step)
