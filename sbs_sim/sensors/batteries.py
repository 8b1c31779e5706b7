"""The batteries of an aircraft: what a monitor shows of them, without errors."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sbs_sim.aircraft import Aircraft

Array = NDArray[np.float64]

SECONDS_PER_HOUR = 3600.0


class Batteries:
    """The batteries of an aircraft, in the order of their drives; none where no drive is electric.

    Attributes
    ----------
    numbers : ndarray
        Of their drives, of which the first is 1.
    capacity : ndarray
        Charge when full [A h].
    """

    def __init__(self, aircraft: Aircraft) -> None:
        drives = [(i, drive) for i, drive in enumerate(aircraft.drives) if drive.engine == "electric"]
        self.numbers = np.array([float(i + 1) for i, _ in drives])
        self._places = np.array([aircraft.layout.drive(i)["discharge"] for i, _ in drives], dtype=np.int64)
        self._full, self._empty, self.capacity = (
            np.array([getattr(drive, name) for _, drive in drives])
            for name in ("full_voltage", "empty_voltage", "capacity")
        )

    def __len__(self) -> int:
        return len(self.numbers)

    def voltage(self, state: Array) -> Array:
        """Without load [V]."""
        return np.asarray(self._full - state[self._places] * (self._full - self._empty))

    def current(self, derivative: Array) -> Array:
        """That they give [A], of the time derivative of the state."""
        return np.asarray(derivative[self._places] * self.capacity * SECONDS_PER_HOUR)

    def charge(self, state: Array) -> Array:
        """That is left [A h]."""
        return np.asarray((1.0 - state[self._places]) * self.capacity)
