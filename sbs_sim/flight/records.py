"""Records of a flight: instants, rows of instants, and the events that acted on it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from typing import Any, Generic, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from sbs_sim.content import ByContent
from sbs_sim.model.wind import Wind

Array = NDArray[np.float64]
Step = TypeVar("Step", int, NDArray[np.int64])
Time = TypeVar("Time", float, Array)


@dataclass(frozen=True, eq=False)
class Instants(ByContent, Generic[Step, Time]):
    """State and loads of a flight at one instant (`Snapshot`) or at n instants (`Rows`).

    Attributes
    ----------
    step : int, or ndarray of int64 of shape (n,)
        Number of the integration step.
    time : float, or ndarray of shape (n,)
        Simulation time [s].
    state : ndarray, shape (size,) or (n, size)
        Simulation state, see `sbs_sim.model.state`.
    acceleration : ndarray, shape (3,) or (n, 3)
        Inertial acceleration of the c.g. in body axes [m/s^2].
    swashplate : ndarray, shape (n_rows, 3) or (n, n_rows, 3)
        Angles in force [rad].
    azimuth : ndarray, shape (n_rotors,) or (n, n_rotors)
        [rad], 0 to 2 pi.
    loads : ndarray, shape (n_rotors, LOAD_SIZE) or (n, n_rotors, LOAD_SIZE)
        Thrust, torque, hub force and moment, see `sbs_sim.model.records`.
    wind : ndarray, shape (3,) or (n, 3)
        Velocity of the air, NED [m/s].
    working : ndarray, shape (n_rotors, WORKING_SIZE) or (n, n_rotors, WORKING_SIZE), or None
        Working states of the rotors, see `sbs_sim.model.working_state`; None where they are not known.
    contact : ndarray, shape (n_points, CONTACT_SIZE) or (n, n_points, CONTACT_SIZE), or None
        Of each contact point the force of the ground, body axes [N], and the depth below it [m].
    """

    step: Step
    time: Time
    state: Array
    acceleration: Array
    swashplate: Array
    azimuth: Array
    loads: Array
    wind: Array
    working: Array | None = None
    contact: Array | None = None


@dataclass(frozen=True, eq=False)
class Snapshot(Instants[int, float]):
    """One instant of a flight.

    Attributes
    ----------
    derivative : ndarray, shape (size,)
        Of the state with respect to time. That of a stitched model is of the states that the model keeps, of which
        those of the body come first; it is empty where it is not known.
    """

    derivative: Array = field(default_factory=lambda: np.empty(0))


class Motion(NamedTuple):
    """What sensors on board see of an instant.

    Attributes
    ----------
    state : ndarray, shape (size,)
        Simulation state.
    specific_force : ndarray, shape (3,)
        Of the c.g. in body axes [m/s^2]: the inertial acceleration without gravity.
    wind : ndarray, shape (3,)
        Velocity of the air, NED [m/s].
    derivative : ndarray
        See `Snapshot`.
    """

    state: Array
    specific_force: Array
    wind: Array
    derivative: Array


class Rows(Instants[NDArray[np.int64], Array]):
    """Instants of a flight in order. Acceleration and loads are zero where they were not asked for."""

    @classmethod
    def of(cls, snapshots: Sequence[Snapshot]) -> Rows:
        """Rows of snapshots, of which all or none have working states."""
        columns = ([getattr(one, part.name) for one in snapshots] for part in fields(cls))
        return cls(*(_column(values) for values in columns))

    def first(self, count: int) -> Rows:
        """The first instants."""
        columns: list[Any] = [getattr(self, part.name) for part in fields(self)]
        parts: list[Any] = [None if column is None else column[:count] for column in columns]
        return Rows(*parts)


def _column(values: list[Any]) -> Any:
    """Values of instants as one array; None where they are not known."""
    return None if any(value is None for value in values) else np.array(values)


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
