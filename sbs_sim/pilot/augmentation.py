"""Stability augmentation: rates and attitude fed back around trimmed controls, the sticks of a pilot added.

Designed like the hover hold from the linear model (rotors settled, a lag of every control, LQR), but with speeds held:
what it does not feed back it does not see. So speeds and position are the pilot's, and attitude follows the sticks.
"""

from __future__ import annotations  # `help` then shows types by their names

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sbs_sim.analysis.linear_model import LinearModel, settle
from sbs_sim.content import ByContent
from sbs_sim.errors import PilotError
from sbs_sim.model import state as S
from sbs_sim.model.frames import quaternion_to_euler
from sbs_sim.pilot.feedback import Compensator, ComplexArray, Margin, Plant, closed_loop_poles, lqr, margins
from sbs_sim.pilot.hover_hold import (
    AUTHORITY,
    DELAY,
    FILTER_TIME,
    LIMITS,
    MAX_STATE_INTERVAL,
    TICK,
    checked_body,
    pilot_axes,
)

Array = NDArray[np.float64]

MIN_DOUBLING_TIME = 10.0  # s, of what is left to the pilot: speed or spiral may diverge slowly
FED_BACK = ("q", "theta", "p", "phi", "r")


@dataclass(frozen=True, eq=False)
class Augmentation(ByContent):
    """Gains of the augmentation, and what they give.

    Attributes
    ----------
    gains : ndarray, shape (4, 5)
        K of u = u_pilot - K x - K_lag u_lag before the lag; x as `FED_BACK`, departures from the trim [rad/s, rad].
    lag_gains : ndarray, shape (4, 4)
    poles : ndarray of complex
        Of all states of the linear model with it, sampled, `DELAY` ticks late [rad/s].
    margins : tuple of Margin, length 5
        There, at each control, and at all of them at once.
    senses : ndarray, shape (4,)
        1 for a control whose growth does what its stick is to do: up, roll to the right, nose down, nose left; -1 for
        one that does the opposite. The mixing of the aircraft decides.
    """

    gains: Array
    lag_gains: Array
    poles: ComplexArray
    margins: tuple[Margin, ...]
    senses: Array


def augmentation(model: LinearModel) -> Augmentation:
    """Design the augmentation for the flight of a linear model.

    Raises
    ------
    PilotError
        The model has no control for one of the axes heave, roll, pitch, yaw; or with all its states it doubles a
        departure in less than `MIN_DOUBLING_TIME`.
    """
    body = [model.state_names.index(name) for name in S.LINEAR_BODY_NAMES]
    axes = pilot_axes(model.control_axes, model.control_units)
    settled_a, settled_b, _, _ = settle(model.a, model.b[:, axes], body)
    used = [S.LINEAR_BODY_NAMES.index(name) for name in FED_BACK]
    n, m = len(used), len(S.CONTROL_NAMES)
    a = np.zeros((n + m,) * 2)
    a[:n, :n] = settled_a[np.ix_(used, used)]
    a[:n, n:] = settled_b[used]
    a[n:, n:] = -np.eye(m) / FILTER_TIME
    b = np.vstack([np.zeros((n, m)), np.eye(m) / FILTER_TIME])
    limits = np.array([LIMITS[name] for name in FED_BACK] + [math.inf] * m)
    gains, _, _ = lqr(a, b, limits, np.array([LIMITS[name] for name in S.CONTROL_NAMES]))
    plant = Plant(model.a, model.b[:, axes], np.eye(len(model.a))[[body[i] for i in used]])
    feedback = _compensator(gains[:, :n], gains[:, n:])
    poles = closed_loop_poles(plant, feedback, TICK, DELAY)
    worst = poles[np.argmax(poles.real)]
    if worst.real > math.log(2.0) / MIN_DOUBLING_TIME:
        raise PilotError(f"augmented, the complete model has a pole at {worst:.3g} rad/s: fly another condition")
    found = margins(plant, feedback, TICK, DELAY)
    senses = np.array([model.control_effects[i].sense for i in axes])
    return Augmentation(gains[:, :n], gains[:, n:], poles, found, senses)


def _compensator(gains: Array, lag_gains: Array) -> Compensator:
    new = -math.expm1(-TICK / FILTER_TIME)
    onto_controls = (1.0 - new) * np.eye(len(lag_gains)) - new * lag_gains
    return Compensator(onto_controls, -new * gains, onto_controls, -new * gains)


class StickPilot:
    """Sticks, trim and augmentation to the controls of the axes heave, roll, pitch and yaw, in this order.

    `Aircraft.with_axes` gives all controls of these four.

    Parameters
    ----------
    found : Augmentation
    deflections : array_like, shape (4,)
        Departure of each control from its trim at full stick [rad].

    Attributes
    ----------
    sticks : ndarray, shape (4,)
        -1 to 1, on any aircraft positive for up, roll to the right, a push (nose down), nose to the left.
    augmented : bool
    trim : ndarray, shape (4,)
        Controls with the sticks in the middle [rad].
    """

    def __init__(self, found: Augmentation, deflections: ArrayLike) -> None:
        self._found = found
        self._deflections = np.array(deflections, dtype=float)
        self.sticks = np.zeros(len(S.CONTROL_NAMES))
        self.augmented = True
        self.take_over(np.zeros(len(S.CONTROL_NAMES)), 0.0, 0.0)

    def take_over(self, controls: ArrayLike, pitch: float, roll: float) -> None:
        """From here on these controls [rad] and this attitude [rad] are the trim."""
        self.trim = np.array(controls, dtype=float)
        self._attitude = (pitch, roll)
        self._lagged = np.zeros(len(S.CONTROL_NAMES))
        self._time: float | None = None

    def move_trim(self, change: ArrayLike) -> None:
        """Move the trim [rad], shape (4,), in the senses of the sticks."""
        self.trim = self.trim + self._found.senses * np.asarray(change, dtype=float)

    def controls(self, time: float, body: ArrayLike) -> Array:
        """Pilot controls [rad], shape (4,), of a time [s] and a simulation state, or its first 13 values.

        Raises
        ------
        PilotError
            A value that is not finite; nothing has changed then.
        """
        values = checked_body(time, body)
        elapsed = TICK if self._time is None else min(max(time - self._time, 0.0), MAX_STATE_INTERVAL)
        self._time = time
        wanted = np.zeros(len(self.trim))
        if self.augmented:
            _, pitch, roll = quaternion_to_euler(values[S.ATTITUDE : S.VELOCITY])
            p, q, r = values[S.RATES : S.BODY_SIZE]
            departure = np.array([q, pitch - self._attitude[0], p, roll - self._attitude[1], r])
            wanted = -self._found.gains @ departure - self._found.lag_gains @ self._lagged
        new = -math.expm1(-elapsed / FILTER_TIME)
        self._lagged = self._lagged + new * (np.clip(wanted, -AUTHORITY, AUTHORITY) - self._lagged)
        return self.trim + self._found.senses * self._deflections * self.sticks + self._lagged
