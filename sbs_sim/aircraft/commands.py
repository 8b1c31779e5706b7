"""What pilot controls command, in rows: the swashplates of all rotors, and drives and surfaces that controls act on."""

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sbs_sim.aircraft.description import INCIDENCE, Drive, Range
from sbs_sim.model.state import COMMAND_NAMES, ROW, SWASHPLATE_NAMES

if TYPE_CHECKING:
    from sbs_sim.aircraft import Aircraft

Array = NDArray[np.float64]

THROTTLE_RANGE, SET_POINT_RANGE = (0.0, 1.0), (0.0, 2.0)  # of a command to a drive
NONE = (0.0, 0.0)  # of what is not used
ROUNDING = 1e-12  # that a command may be beyond its range
LEAST_FACTOR = 1e-3  # of a control, below which it may move as if it had this one
AT_ONCE = 1e9  # 1/s; a command to a drive has no actuator: the lag of its engine follows


class Row(NamedTuple):
    """Three numbers that are commanded together, of a swashplate, a drive or a surface; those not used are zero.

    Attributes
    ----------
    owner : str
        Name of the rotor or surface, "drive 1", or "control" whose factors change with the airspeed.
    names : tuple of str
        Of the numbers; empty for what is not used.
    ranges : tuple of (float, float)
    unit : str
        "rad" for a swashplate and a surface, "1" for a drive, that of the control.
    rate : float
        Fastest motion of each [unit/s].
    """

    owner: str
    names: tuple[str, ...]
    ranges: tuple[Range, ...]
    unit: str
    rate: float

    def shown(self, value: float) -> str:
        """A value with its unit, as a person reads it."""
        if self.unit == "rad":
            return f"{math.degrees(value):.6g} deg"
        return f"{value:.6g}" if self.unit == "1" else f"{value:.6g} {self.unit}"


def rows_of(aircraft: "Aircraft") -> tuple[Row, ...]:
    """Rows of an aircraft, in the order of `Aircraft.mix`."""
    plates = [
        Row(
            rotor.name,
            SWASHPLATE_NAMES,
            (rotor.collective_range, rotor.cyclic_range, rotor.cyclic_range),
            "rad",
            rotor.swashplate_rate,
        )
        for rotor in aircraft.rotors
    ]
    names, ranges = (*COMMAND_NAMES, ""), (THROTTLE_RANGE, SET_POINT_RANGE, NONE)
    drives = (Row(f"drive {i + 1}", names, ranges, "1", AT_ONCE) for i in aircraft.commanded_drives)
    moving = (aircraft.body.surfaces[i] for i in aircraft.commanded_surfaces)
    surfaces = (
        Row(one.name, (INCIDENCE, "", ""), (one.incidence_range, NONE, NONE), "rad", one.incidence_rate)
        for one in moving
    )
    return (*plates, *drives, *surfaces, *(_control_row(aircraft, name) for name in scheduled_controls(aircraft)))


def scheduled_controls(aircraft: "Aircraft") -> tuple[str, ...]:
    """Names of the pilot controls whose factors change with the airspeed: the aircraft gets them as they are."""
    used = {entry.control for rotor in aircraft.rotors for entry in rotor.schedule}
    return tuple(name for name in aircraft.control_names if name in used)


def _control_row(aircraft: "Aircraft", name: str) -> Row:
    """Row of a control, which moves no faster than the actuators that its factors move."""
    control = aircraft.controls[aircraft.control_names.index(name)]
    rates = [
        rotor.swashplate_rate / max(float(np.abs(entry.factor).max()), LEAST_FACTOR)
        for rotor in aircraft.rotors
        for entry in rotor.schedule
        if entry.control == name
    ]
    return Row("control", (name, "", ""), (control.range, NONE, NONE), control.unit, min(rates))


def drive_offset(drive: Drive) -> Array:
    """Row of a drive where all controls are zero, shape (3,)."""
    return np.array([drive.throttle, drive.set_point, 0.0])


def padded(factors: Array) -> Array:
    """Factors of a drive or surface, shape (1 or 2, n_controls), as a row of three numbers has them."""
    return np.concatenate([factors, np.zeros((ROW - len(factors), factors.shape[1]))])


def row_problems(rows: Sequence[Row], values: Array) -> list[tuple[str, float, Range, str]]:
    """Name, value, range and unit of each command, of shape (n_rows, 3), that is beyond its range."""
    return [
        (f"{row.owner} {name}", value, limits, row.unit)
        for row, numbers in zip(rows, values.tolist(), strict=True)
        for name, value, limits in zip(row.names, numbers, row.ranges, strict=True)
        if not limits[0] - ROUNDING <= value <= limits[1] + ROUNDING  # true for a NaN as well
    ]
