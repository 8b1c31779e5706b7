"""The control mixer: pilot controls to the swashplates of all rotors, with ranges and rates.

Swashplate angles are `Aircraft.mixing` times the pilot controls, and a constant (paper section 2.1.1; theory.md section
4). Pilot controls are clipped to their ranges, swashplate angles to theirs, and each angle moves no faster than its
actuator.
"""

from __future__ import annotations  # `help` then shows types by their names

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sbs_sim import checks
from sbs_sim.aircraft import Aircraft
from sbs_sim.aircraft.commands import Row
from sbs_sim.errors import SimulationError

Array = NDArray[np.float64]

# s; swashplates that rest at their target may use this much time at once when a new one comes: what an output is held
# for at 100 Hz. More, and a rest would be a leave to jump; nothing, and every command would come one period late.
REST_CREDIT = 0.01
ROUNDING = 1e-12  # rad, that an angle may be beyond its limit


class Mixer:
    """Mixer of an aircraft with the memory that its rate limits need.

    Parameters
    ----------
    aircraft : Aircraft

    Attributes
    ----------
    saturated : tuple of str
        Controls and swashplate angles that the last target has clipped, with their limit; rates are not among them.
    """

    def __init__(self, aircraft: Aircraft) -> None:
        self.aircraft = aircraft
        ranges = np.array([control.range for control in aircraft.controls])
        self._low, self._high = ranges.T
        swash = np.array([row.ranges for row in aircraft.rows])
        self._swash_low, self._swash_high = swash[:, :, 0], swash[:, :, 1]
        self._rates = np.array([[row.rate] for row in aircraft.rows])
        self._target: Array | None = None
        self._rests = True  # at its target since the last `move`
        self._angles: Array | None = None
        self._time = 0.0
        self.saturated: tuple[str, ...] = ()

    def set_target(self, controls: ArrayLike) -> None:
        """Set the pilot controls [rad, or their units], shape (n_controls,), for the next `move`.

        Raises
        ------
        SimulationError
            Another number of controls, or one that is not finite or beyond a right angle; the target before stays.
        """
        values = checks.array("controls", controls, SimulationError)
        check_controls(self.aircraft, values)
        clipped = np.clip(values, self._low, self._high)
        wanted = self.aircraft.mix(clipped)
        self._target = np.clip(wanted, self._swash_low, self._swash_high)
        texts = [
            f"{control.name} at its limit of {control.shown(limit):.6g} {control.shown_unit}"
            for control, value, limit in zip(self.aircraft.controls, values.tolist(), clipped.tolist(), strict=True)
            if abs(value - limit) > ROUNDING
        ]
        for row, values_wanted, limited in zip(self.aircraft.rows, wanted, self._target, strict=True):
            texts += _clipped(row, values_wanted, limited)
        self.saturated = tuple(texts)

    def set_position(self, angles: ArrayLike) -> None:
        """Set the angles at which the swashplates rest now [rad], shape (n_rows, 3)."""
        self._angles = np.array(angles, dtype=float)
        self._rests = True

    def forget(self) -> None:
        """Drop the target, as if there had been no controls yet."""
        self._target = self._angles = None
        self._rests = True
        self.saturated = ()

    @property
    def rests(self) -> bool:
        """True if the swashplates were at their target at the last `move`."""
        return self._rests

    def move(self, time: float) -> Array:
        """Swashplate angles [rad], shape (n_rows, 3), at a time [s].

        They move towards the target at their actuators' rates. The first target is reached at once
        unless `set_position` has set where the swashplates are.

        Raises
        ------
        SimulationError
            There is no target yet.
        """
        if self._target is None:
            raise SimulationError("the mixer has no controls yet")
        if self._angles is None:
            self._angles = self._target.copy()
        else:
            elapsed = max(0.0, time - self._time)
            reach = self._rates * (min(elapsed, REST_CREDIT) if self._rests else elapsed)
            self._angles = _moved(self._angles, self._target, reach)
        self._rests = self.arrived
        self._time = time
        return self._angles.copy()

    @property
    def position(self) -> Array | None:
        """Swashplate angles [rad], shape (n_rows, 3); None if they are not known."""
        return None if self._angles is None else self._angles.copy()

    @property
    def arrived(self) -> bool:
        """True when the angles are those of the target."""
        if self._target is None:
            return True
        return self._angles is not None and np.array_equal(self._angles, self._target)


class Mixers:
    """Mixers of flights side by side, each of which moves as `Mixer` does, bit for bit.

    Parameters
    ----------
    aircraft : Aircraft
    count : int
        Of flights, whose swashplates rest at zero at time 0, or where and when `set_position` says.
    """

    def __init__(self, aircraft: Aircraft, count: int) -> None:
        self._mix = aircraft.mix
        self._low, self._high = np.array([control.range for control in aircraft.controls]).T
        self._swash_low, self._swash_high = np.moveaxis(np.array([row.ranges for row in aircraft.rows]), -1, 0)
        self._rates = np.array([[row.rate] for row in aircraft.rows])
        self._angles = np.zeros((count, *self._swash_low.shape))
        self._rest, self._time = np.ones((count, 1, 1), dtype=bool), np.zeros((count, 1, 1))

    def set_position(self, i: int, angles: ArrayLike, time: float) -> None:
        """Set the angles at which the swashplates of a flight rest [rad], shape (n_rows, 3), at a time [s]."""
        self._angles[i], self._rest[i], self._time[i] = angles, True, time

    def move(self, controls: Array, time: float) -> Array:
        """Swashplate angles [rad], shape (count, n_rows, 3), at a time [s], on the way to what finite controls want.

        The controls have the shape (count, n_controls).
        """
        elapsed = np.maximum(0.0, time - self._time)
        wanted = np.array([self._mix(own) for own in np.clip(controls, self._low, self._high)])
        target = np.clip(wanted, self._swash_low, self._swash_high)
        reach = self._rates * np.where(self._rest, np.minimum(elapsed, REST_CREDIT), elapsed)
        self._angles = _moved(self._angles, target, reach)
        self._rest, self._time[:] = (self._angles == target).all(axis=(1, 2), keepdims=True), time
        return self._angles.copy()


def _moved(angles: Array, target: Array, reach: Array) -> Array:
    """Angles that have gone towards a target as far as they reach."""
    gap = target - angles
    # where the target is in reach it is taken itself: a sum would miss it by rounding
    return np.where(np.abs(gap) <= reach, target, angles + np.sign(gap) * reach)


def limit_texts(aircraft: Aircraft, reached: NDArray[np.int64]) -> list[str]:
    """Ranges that were exceeded, in words.

    Parameters
    ----------
    aircraft : Aircraft
    reached : ndarray, shape (2, n_controls + 3 n_rows)
        Not zero where a control, or what it moves, has been beyond the lower and the upper end of its range.
    """
    below, above = reached.tolist()
    texts, count = [], len(aircraft.controls)
    for control, *flags in zip(aircraft.controls, below, above, strict=False):
        for limit, is_reached in zip(control.range, flags, strict=True):
            if is_reached:
                texts.append(f"{control.name} at its limit of {control.shown(limit):.6g} {control.shown_unit}")
    parts = [(row, *part) for row in aircraft.rows for part in zip(row.names, row.ranges, strict=True)]
    for (row, name, limits), *flags in zip(parts, below[count:], above[count:], strict=True):
        for limit, is_reached in zip(limits, flags, strict=True):
            if is_reached:
                texts.append(f"{row.owner} {name} at its limit of {row.shown(limit)}")
    return texts


def check_controls(aircraft: Aircraft, values: Array) -> None:
    """Raise SimulationError for another number of controls, and for what is not finite or beyond a right angle."""
    if values.shape != (len(aircraft.controls),):
        raise SimulationError(f"controls have shape {values.shape}: allowed is ({len(aircraft.controls)},)")
    for control, value in zip(aircraft.controls, values.tolist(), strict=True):
        if not abs(value) <= control.limit:  # true for a NaN as well
            checks.number(control.name, value, -control.limit, control.limit, control.unit, SimulationError)


def check_ranges(aircraft: Aircraft, values: Array, where: str = "") -> None:
    """Raise SimulationError for pilot controls, shape (n_controls,), beyond their ranges, which `Mixer` would clip.

    Parameters
    ----------
    aircraft : Aircraft
    values : ndarray, shape (n_controls,)
    where : str
        What the message begins with.
    """
    for control, value in zip(aircraft.controls, values.tolist(), strict=True):
        low, high = control.range
        if not low - ROUNDING <= value <= high + ROUNDING:  # true for a NaN as well
            degrees = f" ({math.degrees(low):g} to {math.degrees(high):g} deg)" if control.is_angle else ""
            limits = f"{low:.6g} to {high:.6g} {control.unit}{degrees}"
            raise SimulationError(f"{where}{control.name} = {value:.6g}: allowed are {limits}")


def _clipped(row: Row, wanted: Array, limited: Array) -> list[str]:
    return [
        f"{row.owner} {name} at its limit of {row.shown(limit)}"
        for name, value, limit in zip(row.names, wanted.tolist(), limited.tolist(), strict=True)
        if abs(value - limit) > ROUNDING
    ]
