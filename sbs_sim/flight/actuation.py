"""From pilot controls to swashplate angles: at once, or as fast as the actuators move."""

from __future__ import annotations  # `help` then shows types by their names

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from sbs_sim.aircraft import Aircraft
from sbs_sim.errors import SimulationError
from sbs_sim.flight.controls import Command
from sbs_sim.flight.mixer import ROUNDING, Mixer, check_ranges
from sbs_sim.flight.simulation import Simulation
from sbs_sim.model import state as S

Array = NDArray[np.float64]


class Direct:
    """Swashplates that follow the controls at once.

    Parameters
    ----------
    aircraft : Aircraft
    command : callable
        Controls of tick i at a time.
    initial : ndarray, shape (n_rows, 3), or None
        Swashplate angles before the flight [rad]; None if unknown.
    """

    def __init__(self, aircraft: Aircraft, command: Command, initial: Array | None) -> None:
        self.command, self._aircraft = command, aircraft
        self._before, self._largest = initial, np.zeros((len(aircraft.rows), S.ROW))
        self._given, self._angles = b"", np.empty(0)

    def angles(self, controls: Array, time: float) -> Array:
        """Swashplate angles [rad] that controls [rad] give at a time [s], shape (n_rotors, 3)."""
        if controls.tobytes() == self._given:
            return self._angles
        check_ranges(self._aircraft, controls, f"controls at {time:g} s: ")
        angles = self._aircraft.mix(controls)
        if self._before is not None:
            self._largest = np.maximum(self._largest, np.abs(angles - self._before))
        self._given, self._angles, self._before = controls.tobytes(), angles, angles
        return angles

    def warnings(self, tick: float) -> Iterator[str]:
        """What the actuators would not have done, with ticks of this length [s]."""
        for row, steps in zip(self._aircraft.rows, self._largest, strict=True):
            for name, step in zip(row.names, steps, strict=True):
                if step > row.rate * tick + ROUNDING:
                    rate = f"{math.degrees(row.rate):g} deg/s"
                    yield f"{row.owner}: {name} is moved faster than its actuator moves, {rate}"


class Mixed:
    """Swashplates that the mixer moves; see `Direct`."""

    def __init__(self, aircraft: Aircraft, command: Command, initial: Array | None) -> None:
        self.command, self._mixer = command, Mixer(aircraft)
        self._clipped: dict[str, None] = {}
        if initial is not None:
            self._mixer.set_position(initial)

    def angles(self, controls: Array, time: float) -> Array:
        """Swashplate angles [rad] at a time [s], shape (n_rotors, 3), on the way to what controls [rad] want."""
        self._mixer.set_target(controls)
        self._clipped |= dict.fromkeys(self._mixer.saturated)
        return self._mixer.move(time)

    def warnings(self, _: float) -> Iterator[str]:
        """What was clipped."""
        return (f"clipped: {text}" for text in self._clipped)


def commanded_angles(
    simulation: Simulation, pilot: Direct | Mixed, begin: int, end: int
) -> tuple[Array, Array, SimulationError | None]:
    """Controls and swashplate angles of ticks, up to the first that are out of range, and what is wrong with those."""
    given: list[Array] = []
    angles: list[Array] = []
    wrong: SimulationError | None = None
    last: Array | None = None
    for i in range(begin, end):
        time = i * simulation.steps_per_tick * simulation.step_size
        try:
            controls = pilot.command(i, time)
            wanted = pilot.angles(controls, time)
            checked = angles[-1] if wanted is last else simulation.checked_swashplate(wanted)
        except SimulationError as error:
            wrong = error
            break
        last = wanted
        given.append(controls)
        angles.append(checked)
    return np.array(given), np.array(angles), wrong
