"""Own gusts: velocities of the air over time, or over the distance that is flown into them."""

from __future__ import annotations  # `help` then shows types by their names

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sbs_sim import checks
from sbs_sim.content import ByContent
from sbs_sim.errors import SimulationError

Array = NDArray[np.float64]

MAX_GUST = 100.0  # m/s
MAX_POSITION = 1e6  # s or m
MAX_ROWS = 10_000
TIME, DISTANCE = "time", "distance"
UNITS = {TIME: "s", DISTANCE: "m"}


@dataclass(frozen=True, eq=False)
class GustTable(ByContent):
    """A gust by its velocities, linear between them, and constant before the first and behind the last.

    Parameters
    ----------
    over : str
        "time": positions are times after the start of the gust [s]. "distance": they are distances into it [m].
    positions : array_like, shape (m,)
        Growing.
    velocities : array_like, shape (m, 3)
        Of the air, NED [m/s].

    Raises
    ------
    SimulationError
        For positions that do not grow, shapes that do not match, and numbers out of range, naming them.
    """

    over: str
    positions: Array
    velocities: Array

    def __post_init__(self) -> None:
        """Check every number."""
        checks.choice("own_gust.over", self.over, tuple(UNITS), SimulationError)
        positions = checks.array("own_gust.positions", self.positions, SimulationError)
        velocities = checks.array("own_gust.velocities", self.velocities, SimulationError)
        if positions.ndim != 1 or not 1 <= len(positions) <= MAX_ROWS:
            shape = positions.shape
            raise SimulationError(f"own_gust.positions has shape {shape}: allowed are 1 to {MAX_ROWS} numbers")
        if velocities.shape != (len(positions), 3):
            allowed = f"({len(positions)}, 3), north, east, down at each position"
            raise SimulationError(f"own_gust.velocities has shape {velocities.shape}: allowed is {allowed}")
        for i, position in enumerate(positions.tolist()):
            name = f"own_gust.positions[{i}]"
            checks.number(name, position, -MAX_POSITION, MAX_POSITION, UNITS[self.over], SimulationError)
            if i and not position > positions[i - 1]:
                raise SimulationError(
                    f"{name} = {position:g}: allowed is more than {positions[i - 1]:g}, the one before"
                )
        wrong = np.argwhere(~(np.abs(velocities) <= MAX_GUST))
        if len(wrong):
            i, axis = wrong[0].tolist()
            name = f"own_gust.velocities[{i}].{'xyz'[axis]}"
            checks.number(name, float(velocities[i, axis]), -MAX_GUST, MAX_GUST, "m/s", SimulationError)
        for name, values in (("positions", positions), ("velocities", velocities)):
            values.setflags(write=False)
            object.__setattr__(self, name, values)

    @classmethod
    def of(cls, function: Callable[[float], ArrayLike], end: float, step: float, over: str = TIME) -> GustTable:
        """Gust of a function of the time [s] or distance [m], which gives the velocity, NED [m/s], shape (3,).

        It is asked at 0, step, ... to `end`, and linear between these.

        Raises
        ------
        SimulationError
            See the class; a length or step out of range, or a value that is no velocity.
        """
        checks.choice("over", over, tuple(UNITS), SimulationError)
        end = checks.number("end", end, 0.0, 1e6, UNITS[over], SimulationError)
        step = checks.number("step", step, 1e-4, 1e6, UNITS[over], SimulationError)
        count = math.floor(end / step * (1.0 + 1e-12)) + 1
        if count > MAX_ROWS:
            raise SimulationError(f"step = {step:g}: allowed are up to {MAX_ROWS} rows, which are {count}")
        positions = [i * step for i in range(count)]
        velocities = [checks.array(f"velocity at {at:g}", function(at), SimulationError).ravel() for at in positions]
        for at, velocity in zip(positions, velocities, strict=True):
            if velocity.shape != (3,):
                raise SimulationError(f"velocity at {at:g} has {len(velocity)} values: allowed are north, east, down")
        return cls(over, np.array(positions), np.array(velocities))

    def at(self, positions: Array) -> Array:
        """Velocities at positions, shape (n, 3), by operations that are rounded alike everywhere."""
        last = len(self.positions) - 1
        if last == 0:
            return np.tile(self.velocities, (len(positions), 1))
        held = np.minimum(np.maximum(positions, self.positions[0]), self.positions[-1])
        low = np.clip(np.searchsorted(self.positions, held, side="right") - 1, 0, last - 1)
        start, width = self.positions[low], self.positions[low + 1] - self.positions[low]
        share = ((held - start) / width)[:, np.newaxis]
        return np.asarray(self.velocities[low] + share * (self.velocities[low + 1] - self.velocities[low]))

    @property
    def rows(self) -> Array:
        """Positions and velocities side by side, shape (m, 4)."""
        return np.column_stack([self.positions, self.velocities])
