"""A recorded flight as snapshots over time."""

import bisect
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sbs_sim.aircraft.model_records import ground_record
from sbs_sim.errors import RecordingError
from sbs_sim.flight.contact import ground_forces
from sbs_sim.flight.records import Event, Snapshot
from sbs_sim.model import records as R
from sbs_sim.recording import Log, read
from sbs_sim.recording.recorded_flight import flight_of

Array = NDArray[np.float64]


class RecordedSnapshots:
    """A log in memory.

    Parameters
    ----------
    path : Path

    Attributes
    ----------
    aircraft : Aircraft
        The one that was flown.
    times : ndarray, shape (n,)
        Of the recorded states [s].
    ground : float or None
        Height of the ground above the origin [m]; None if the log does not have it.
    complete : bool
        False if the file is incomplete; the states then are those that it has.

    Raises
    ------
    RecordingError
        It cannot be read, or holds no flight of sbs_sim.
    """

    def __init__(self, path: Path) -> None:
        log = read(path)
        flight = flight_of(log)
        if not len(flight.states):
            raise RecordingError(f"{path}: no state was recorded")
        self.path, self.aircraft, self.complete = path, flight.aircraft, log.complete
        self._flight = flight
        self._step_size = float(log.metadata["simulation"]["step_size"])
        self.times: Array = np.asarray(flight.steps * self._step_size, dtype=np.float64)
        self.ground = _finite(log.metadata["simulation"].get("ground_altitude", ""))
        self._model = flight.aircraft.model()._replace(ground=ground_record(flight.aircraft, self.ground))
        self._azimuths, self._loads = _rotors(log, len(self.aircraft.rotors))
        indices = np.searchsorted(log["rotors"].time, self.times - 0.5 * self._step_size)
        self._indices = np.minimum(indices, len(self._loads) - 1)
        self._event_steps = [event.step for event in flight.events]

    @property
    def beginning(self) -> float:
        """Time of the first state [s]."""
        return float(self.times[0])

    @property
    def end(self) -> float:
        """Time of the last state [s]."""
        return float(self.times[-1])

    def at(self, time: float) -> Snapshot:
        """The last instant that was recorded before or at a time [s]; the first one before the beginning."""
        i = max(0, int(np.searchsorted(self.times, time + 0.5 * self._step_size, side="right")) - 1)
        step = int(self._flight.steps[i])
        contact = ground_forces(self._model, self._flight.states[i : i + 1])
        return Snapshot(
            step=step,
            time=float(self.times[i]),
            state=self._flight.states[i],
            acceleration=np.zeros(3),
            swashplate=self._latest(step, lambda event: event.swashplate),
            azimuth=self._azimuths[self._indices[i]],
            loads=self._loads[self._indices[i]],
            wind=self._latest(step, lambda event: None if event.wind is None else np.array(event.wind.velocity)),
            contact=None if contact is None else contact[0],
        )

    def _latest(self, step: int, value: Callable[[Event], Array | None]) -> Array:
        """What the last event up to a step that has a value says."""
        for event in reversed(self._flight.events[: bisect.bisect_right(self._event_steps, step)]):
            if (found := value(event)) is not None:
                return found
        raise RecordingError(f"{self.path}: the log lacks the start of its flight")


def _finite(text: str) -> float | None:
    """A number of a text, None if it is none or not finite."""
    try:
        value = float(text)
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def _rotors(log: Log, rotors: int) -> tuple[Array, Array]:
    """Azimuths [rad], shape (messages, rotors), and loads, shape (messages, rotors, LOAD_SIZE), of all messages."""
    topic = log["rotors"]
    azimuths = np.stack([topic[f"rotors[{j}].azimuth"] for j in range(rotors)], axis=1)
    loads = np.zeros((len(topic.time), rotors, R.LOAD_SIZE))
    for j in range(rotors):
        loads[:, j, R.THRUST] = topic[f"rotors[{j}].thrust"]
        loads[:, j, R.TORQUE] = topic[f"rotors[{j}].torque"]
        for i, axis in enumerate("xyz"):
            loads[:, j, R.FORCE + i] = topic[f"rotors[{j}].hub.force.{axis}"]
            loads[:, j, R.MOMENT + i] = topic[f"rotors[{j}].hub.torque.{axis}"]
    return azimuths, loads


def list_logs(folder: Path) -> list[Path]:
    """Logs in a folder, latest first; none where there is no folder."""
    try:
        return sorted(folder.glob("*.mcap"), key=lambda path: path.stat().st_mtime, reverse=True)
    except OSError:
        return []
