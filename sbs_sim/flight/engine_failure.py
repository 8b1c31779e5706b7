"""Engines that fail on the way."""

from __future__ import annotations  # `help` then shows types by their names

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from sbs_sim import checks
from sbs_sim.errors import SimulationError

if TYPE_CHECKING:
    from sbs_sim.flight.simulation import Simulation


@dataclass(frozen=True)
class EngineFailure:
    """An engine that gives less torque than its throttle asks for, from a time on.

    Parameters
    ----------
    time : float
        When it happens, rounded to whole ticks [s].
    drive : int
        Number of the drive in the aircraft file, the first is 1.
    share : float
        Of the torque that is lost: 1 is a failure, 0 an engine that runs again.

    Raises
    ------
    SimulationError
        A value out of range.
    """

    time: float
    drive: int = 1
    share: float = 1.0

    def __post_init__(self) -> None:
        """Check the values."""
        object.__setattr__(self, "time", checks.number("time", self.time, 0.0, 1e6, "s", SimulationError))
        object.__setattr__(self, "drive", checks.integer("drive", self.drive, 1, 1000, SimulationError))
        object.__setattr__(self, "share", checks.number("share", self.share, 0.0, 1.0, "", SimulationError))


def failures_by_tick(simulation: Simulation, events: Sequence[EngineFailure]) -> Mapping[int, list[EngineFailure]]:
    """Events of a flight by the numbers of the ticks before which they act.

    Raises
    ------
    SimulationError
        An event of another kind, or of a drive that has no engine.
    """
    found = dict[int, list[EngineFailure]]()
    for event in events:
        checks.instance("event", event, EngineFailure, SimulationError)
        simulation.checked_engine(event.drive)
        found.setdefault(round(event.time / simulation.tick), []).append(event)
    return found
