"""Records of a flight: instants, rows of instants, and the events that acted on it."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from sbs_sim.content import ByContent
from sbs_sim.model.wind import Wind

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Snapshot(ByContent):
    """State and loads of a flight at one instant.

    Attributes
    ----------
    step : int
        Number of the integration step.
    time : float
        Simulation time [s].
    state : ndarray, shape (size,)
        Simulation state, see `sbs_sim.model.state`.
    acceleration : ndarray, shape (3,)
        Inertial acceleration of the c.g. in body axes [m/s^2].
    swashplate : ndarray, shape (n_rows, 3)
        Angles in force [rad].
    azimuth : ndarray, shape (n_rotors,)
        [rad], 0 to 2 pi.
    loads : ndarray, shape (n_rotors, LOAD_SIZE)
        Thrust, torque, hub force and moment, see `sbs_sim.model.records`.
    wind : ndarray, shape (3,)
        Velocity of the air, NED [m/s].
    working : ndarray, shape (n_rotors, WORKING_SIZE), or None
        Working states of the rotors, see `sbs_sim.model.working_state`; None where nobody knows them.
    """

    step: int
    time: float
    state: Array
    acceleration: Array
    swashplate: Array
    azimuth: Array
    loads: Array
    wind: Array
    working: Array | None = None


@dataclass(frozen=True, eq=False)
class Rows(ByContent):
    """Instants of a flight one below the other: what `Snapshot` tells, with one more axis in front of each.

    Attributes
    ----------
    step, time, state, acceleration, swashplate, azimuth, loads, wind : ndarray
        See `Snapshot`; acceleration and loads are zero where they were not asked for.
    """

    step: NDArray[np.int64]
    time: Array
    state: Array
    acceleration: Array
    swashplate: Array
    azimuth: Array
    loads: Array
    wind: Array

    def first(self, count: int) -> Rows:
        """The first instants."""
        return Rows(*(getattr(self, part.name)[:count] for part in fields(self)))


@dataclass(frozen=True, eq=False)
class Event(ByContent):
    """Something that acts on a flight between two ticks: all events together repeat it bit for bit, see `refly`.

    Attributes
    ----------
    step : int
        Integration steps before it.
    kind : str
        "start" (state, swashplate, wind), "swashplate", "reset" (state, swashplate), "wind" or "engine_failure" (drive,
        failure).
    swashplate : ndarray, shape (n_rows, 3), or None
        [rad]
    state : ndarray, shape (size,), or None
    wind : Wind or None
    wind_step : int
        Of a start: integration steps before its wind was set, which is earlier than the start where a log begins in
        mid-flight.
    wind_ticks : int
        Of a start: ticks of its wind that have started; 0 for one that is new.
    drive : int
        Of the failure of an engine: the number of its drive, of which the first is 1; else 0.
    failure : float
        There the share of its torque that it has lost.
    """

    step: int
    kind: str
    swashplate: Array | None = None
    state: Array | None = None
    wind: Wind | None = None
    wind_step: int = 0
    wind_ticks: int = 0
    drive: int = 0
    failure: float = 0.0
