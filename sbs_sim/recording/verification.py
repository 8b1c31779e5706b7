"""A recorded flight flown again and compared, state by state."""

import itertools
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from sbs_sim.errors import RecordingError
from sbs_sim.flight.records import Snapshot
from sbs_sim.flight.refly import refly
from sbs_sim.recording.recorded_flight import RecordedFlight
from sbs_sim.versions import differences

Array = NDArray[np.float64]

# Another version of the model may round otherwise, and the rotors' fast modes carry that along: what may then differ,
# relative to the largest magnitude of each state in the flight. Another processor or compilation rounds alike.
TOLERANCE = 1e-6


@dataclass(frozen=True)
class Difference:
    """One state of one step that did not come again."""

    step: int
    time: float
    state: str
    logged: float
    flown: float
    relative: float  # to the largest magnitude of this state in the flight


@dataclass(frozen=True)
class Verification:
    """Result of flying a log again.

    Attributes
    ----------
    states : int
        Recorded states that were compared.
    first, largest : Difference or None
        None if every bit is the same.
    other_versions : dict of str to (str, str)
        What differs between the log and this machine: recorded, here.
    """

    states: int
    first: Difference | None
    largest: Difference | None
    other_versions: dict[str, tuple[str, str]] = field(default_factory=dict)

    @property
    def within_tolerance(self) -> bool:
        """True if no state differs by more than what other rounding may do."""
        return self.largest is None or self.largest.relative <= TOLERANCE

    @property
    def identical(self) -> bool:
        """True if every bit of every state is the same."""
        return self.first is None

    @property
    def passed(self) -> bool:
        """True if it is as it should be: identical, or within the tolerance where versions are other ones."""
        return self.identical or (bool(self.other_versions) and self.within_tolerance)


def verify(flight: RecordedFlight, progress: Callable[[float, float], None] | None = None) -> Verification:
    """Fly a recorded flight again and compare every recorded state, bit for bit.

    Parameters
    ----------
    flight : RecordedFlight
    progress : callable, optional
        Called with the number of states that have been compared and of all of them.

    Raises
    ------
    SbsError
        The flight cannot be flown from what the log holds.
    """
    first: Difference | None = None
    largest: Difference | None = None
    scale = np.maximum(np.abs(flight.states).max(axis=0), 1e-12)
    again = refly(flight.aircraft, flight.events, int(flight.steps[-1]), **flight.options)
    for i, flown in _beside(flight, again, scale):
        if progress is not None:
            progress(i + 1, len(flight.states))
        logged = flight.states[i]
        if logged.tobytes() == flown.state.tobytes():
            continue
        distance = np.abs(logged - flown.state) / scale
        index = int(np.argmax(distance))
        found = Difference(
            flown.step,
            flown.time,
            flight.aircraft.layout.names[index],
            float(logged[index]),
            float(flown.state[index]),
            float(distance[index]),
        )
        first = first or found
        largest = found if largest is None or found.relative > largest.relative else largest
    return Verification(len(flight.states), first, largest, differences(flight.versions))


def _beside(flight: RecordedFlight, flown: Iterable[Snapshot], scale: Array) -> Iterator[tuple[int, Snapshot]]:
    """Index of each recorded state with the snapshot that was flown at its step.

    Around a reset a step has several, in their order, and the nearest one is meant. A state may have been recorded
    twice: older logs have that where a fault has ended the flight before the first step of a tick.
    """
    indices: dict[int, list[int]] = {}
    for i, step in enumerate(flight.steps.tolist()):
        indices.setdefault(step, []).append(i)
    for step, group in itertools.groupby(flown, key=lambda snapshot: snapshot.step):
        snapshots = list(group)
        for i in indices.pop(step, []):
            if len(snapshots) > 1:
                distances = [np.abs((found.state - flight.states[i]) / scale).max() for found in snapshots]
                snapshots = snapshots[int(np.argmin(distances)) :]
            yield i, snapshots[0]
    if indices:
        raise RecordingError(f"step {min(indices)} was recorded but is not flown by the events of the log")
