"""The envelope controller state by state: targets and velocity commands while it flies, as a node needs it."""

from __future__ import annotations  # `help` then shows types by their names

import math
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sbs_sim import checks
from sbs_sim.errors import PilotError
from sbs_sim.model import state as S
from sbs_sim.model.frames import quaternion_to_euler
from sbs_sim.pilot import envelope_law as L
from sbs_sim.pilot.envelope import PERIOD, Envelope
from sbs_sim.pilot.hover_hold import MAX_STATE_INTERVAL, MAX_STATE_VALUE, checked_body, checked_target
from sbs_sim.pilot.law_pilot import LawPilot

Array = NDArray[np.float64]

AT_REST = 0.5  # m/s, from which on a position is held
MAX_SPEED, MAX_TURN = 200.0, math.radians(180.0)  # m/s, rad/s, of a command


class EnvelopePilot:
    """An envelope controller in flight. It begins by holding the place and heading of the first state.

    Parameters
    ----------
    found : Envelope

    Attributes
    ----------
    position_hold : bool
        True while it holds, or goes to, a place; false while it follows a velocity.
    """

    def __init__(self, found: Envelope) -> None:
        self._found = found
        hover = found.gains[0].controls
        self._law = LawPilot(replace(found.controller(np.zeros(L.COMMAND_SIZE)), period=0.0), hover)
        self.restart()

    def restart(self, target: tuple[Array, float] | None = None) -> None:
        """Begin anew: at a target, NED [m] and heading [rad], or where the next state is."""
        self._law.restart()
        self._time: float | None = None
        self._target = target
        self.position_hold, self._brakes = True, False
        if target is not None:
            self._set(L.POSITION, *target[0], target[1])

    def hold(self, position: ArrayLike, heading: float) -> None:
        """Go to a position, NED [m], shape (3,), and a heading [rad].

        Raises
        ------
        PilotError
            A number that is not finite.
        """
        target, heading = checked_target(position, heading)
        self._target, self.position_hold, self._brakes = (target, heading), True, False
        self._set(L.POSITION, *target, heading)

    def fly(self, forward: float, right: float, down: float, turn_rate: float) -> None:
        """Follow a velocity along and across the heading and down [m/s], and a turn rate [rad/s].

        The forward speed is cut to the airspeeds for which there are gains.

        Raises
        ------
        PilotError
            A number out of range.
        """
        values = {"forward": forward, "right": right, "down": down}
        given = [checks.number(name, value, -MAX_SPEED, MAX_SPEED, "m/s", PilotError) for name, value in values.items()]
        turn = checks.number("turn_rate", turn_rate, -MAX_TURN, MAX_TURN, "rad/s", PilotError)
        given[0] = min(given[0], max(gains.airspeed for gains in self._found.gains))
        self._target, self.position_hold, self._brakes = (np.zeros(3), 0.0), False, False
        self._set(L.VELOCITY, *given, turn)

    def stay(self) -> None:
        """Brake, and hold the position and the heading at which it has come to rest."""
        self.fly(0.0, 0.0, 0.0, 0.0)
        self.position_hold, self._brakes = True, True

    def controls(self, time: float, body: ArrayLike) -> Array:
        """Pilot controls, shape (n_controls,), of a time [s] and a state, or its first 13 values.

        Raises
        ------
        PilotError
            A value that is not finite; nothing has changed then.
        """
        values = checked_body(time, body)
        if self._time is not None and time < self._time:
            self.restart()
        if self._brakes and float(np.linalg.norm(values[S.VELOCITY : S.RATES])) < AT_REST:
            self._target, self._brakes = None, False
        if self._target is None:
            position = values[: S.ATTITUDE].copy()
            self._target = position, quaternion_to_euler(values[S.ATTITUDE : S.VELOCITY])[0]
            self._set(L.POSITION, *position, self._target[1])
        elapsed = PERIOD if self._time is None else min(time - self._time, MAX_STATE_INTERVAL)
        if elapsed <= 0.0:
            return self._law.latest.copy()
        self._law.parameters[L.PERIOD] = elapsed  # states may come at another rate
        self._time = time
        return self._law.controls(time, values)

    def _set(self, mode: float, *values: float) -> None:
        """Give the law another command."""
        self._law.parameters[-L.COMMAND_SIZE :] = [-MAX_STATE_VALUE, mode, *values]
