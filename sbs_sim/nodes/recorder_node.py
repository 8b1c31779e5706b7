"""Node `recorder`: one log after the other of a flight.

Serves `record`, which begins and ends logs while the simulator flies. The nodes of the process write whatever they
publish or accept through it, at any time; where no log is open, that costs nothing.
"""

import contextlib
import threading
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from rclpy.qos import QoSProfile
from rclpy.serialization import deserialize_message

from sbs_msgs.srv import Record
from sbs_sim import checks
from sbs_sim.errors import RecordingError, SbsError
from sbs_sim.flight.simulation import Simulation
from sbs_sim.flight_loop import FlightLoop
from sbs_sim.nodes.component import Component
from sbs_sim.nodes.qos import SERVICE_QOS

if TYPE_CHECKING:
    from sbs_sim.nodes.flight_log import FlightLog

STATE_TOPICS = ("state", "rotors", "inflow", "odom")  # recorded together, matched by sequence number
INSTANT_TIMEOUT = 1.0  # s to finish an instant: a blocked disk must not block the end
START_TIMEOUT = 10.0  # s until a requested start is recorded


class RecorderNode(Component):
    """See the module. A log begins with the start that the flight hands out for it, and not before.

    Parameters
    ----------
    simulation : Simulation
        Whose aircraft and options a log holds.
    loop : FlightLoop
    parameters : dict of str to object
        Of the simulator, for the record.
    """

    def __init__(self, simulation: Simulation, loop: FlightLoop, parameters: dict[str, Any]) -> None:
        super().__init__("recorder")
        self._simulation, self._loop, self._flown_with = simulation, loop, parameters
        self._topics: list[tuple[str, Any, QoSProfile, str]] = []
        self._lock = threading.Lock()  # topics may be added while a log begins
        self._log: FlightLog | None = None
        # Starts are counted from the flight's own, 0: the start of a log that has ended is not that of the next log.
        self._start_count, self._awaited_start = 0, 0
        self._open = False  # the start of the flight is in the log
        self._start_recorded = threading.Event()  # and all of that instant
        self._instant = threading.Lock()
        self._channels: list[int] = []  # of the log, by our own numbers
        self._latest: dict[int, tuple[float, bytes]] = {}  # what was written last, by the same
        self.create_service(Record, "record", self._on_record, qos_profile=SERVICE_QOS)

    # ------------------------------------------------------------------------------------- what the nodes write into

    def channel(self, topic: str, kind: Any, qos: QoSProfile, role: str) -> int:
        """Channel for the messages of a topic that has a role in the flight, in this log and in all that follow."""
        with self._lock:
            self._topics.append((topic, kind, qos, role))
            if self._log is not None:
                self._channels.append(self._log.channel(topic, kind, qos, role))
            return len(self._topics) - 1

    def write(self, channel: int, time: float, data: bytes, wait: bool = False, essential: bool = False) -> None:
        """Record a serialised message of a simulation time [s], see `LogWriter.write`; nothing without a log.

        Repeated messages of a paused flight are recorded once: its time does not change.
        """
        log, channels = self._log, self._channels
        if not self._open or log is None:
            return
        if essential or self._topics[channel][3] in STATE_TOPICS or not self._repeats(channel, time, data):
            self._latest[channel] = time, data
            log.write(channels[channel], time, data, wait, essential)

    def _repeats(self, channel: int, time: float, data: bytes) -> bool:
        """True if the last message of the channel has the same time and content."""
        then, before = self._latest.get(channel, (-1.0, b""))
        if time != then or len(data) != len(before):
            return False
        kind = self._topics[channel][1]  # compare values: padding bytes are arbitrary
        return data == before or bool(deserialize_message(data, kind) == deserialize_message(before, kind))

    def open_at_start(self) -> None:
        """Open the log for messages if this is the start of the flight that it waits for."""
        if self._start_count == self._awaited_start:
            self._open = self._log is not None
        self._start_count += 1

    @contextlib.contextmanager
    def instant(self) -> Iterator[None]:
        """Context in which all messages of one instant are written: a log does not end in the middle of it."""
        with self._instant:
            yield
            if self._open:
                self._start_recorded.set()

    @property
    def has_room(self) -> bool:
        """True if what belongs to an instant can be written without waiting, or there is no log."""
        return (log := self._log) is None or log.has_room

    @property
    def path(self) -> str:
        """The present log; empty if there is none."""
        return "" if (log := self._log) is None else str(log.path)

    @property
    def dropped(self) -> int:
        """Messages that did not get into the present log."""
        return 0 if (log := self._log) is None else log.dropped

    @property
    def fault(self) -> str:
        """Why the present log cannot go on; empty if it can."""
        return "" if (log := self._log) is None else log.fault

    # --------------------------------------------------------------------------------------------- beginning and end

    def begin(self, record: str, start: int = 0) -> None:
        """Make a log, which waits for that start of the flight; `record` is as for `FlightLog`.

        Raises
        ------
        RecordingError
            There is one already, the file cannot be made, or a package is missing.
        """
        from sbs_sim.nodes.flight_log import FlightLog  # here: its packages are needed for recording only

        if self._log is not None:
            raise RecordingError(f"recording {self.path} already: record = false ends it")
        log = FlightLog(record, self._simulation, self._flown_with)
        with self._lock:
            try:
                self._channels = [log.channel(*topic) for topic in self._topics]
            except SbsError:
                log.discard()
                raise
            self._latest = {}
            self._awaited_start, self._log = start, log
            self._start_recorded.clear()

    def end(self) -> str:
        """End the log; its path, empty if there is none.

        Raises
        ------
        RecordingError
            It is incomplete.
        """
        log = self._log
        if log is None:
            return ""
        complete = self._instant.acquire(timeout=INSTANT_TIMEOUT)
        self._open = False
        if complete:
            self._instant.release()
        log.close()  # first: once `path` is empty, the file may be read
        self._log = None
        if log.fault:
            raise RecordingError(f"the log ends before the flight: {log.fault}")
        return str(log.path)

    def _on_record(self, request: Record.Request, response: Record.Response) -> Record.Response:
        response.path = "" if request.record else self.path
        self.answer(response, lambda: self._act(request, response), "", request)
        if response.success:
            response.message = f"recording {response.path}" if request.record else f"recorded {response.path}"
        return response

    def _act(self, request: Record.Request, response: Record.Response) -> None:
        if not request.record:
            if request.path:
                raise RecordingError(f"path = {checks.shown(request.path)}: allowed where a log begins, record = true")
            if self._log is not None:
                self._start_recorded.wait(START_TIMEOUT)  # a log without its start would be of no use
            response.path = self.end()
            if not response.path:
                raise RecordingError("record = false: nothing is recorded")
            return
        self.begin(request.path, start=self._awaited_start + 1)
        try:
            self._loop.begin_log()
            if not self._start_recorded.wait(START_TIMEOUT):
                raise RecordingError(f"the flight has not handed out its start within {START_TIMEOUT:g} s")
            response.path = self.path
        except SbsError:
            self._open = False
            log, self._log = self._log, None
            if log is not None:
                log.discard()
            raise
