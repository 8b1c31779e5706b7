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
from sbs_sim.nodes.host import SERVICE_QOS, Component

if TYPE_CHECKING:
    from sbs_sim.nodes.recorder import Recorder

STATES = ("state", "rotors", "inflow", "odom")  # are written together, and read together by their numbers
INSTANT_PATIENCE = 1.0  # s until an instant is written: a disk that takes nothing must not hold up the end
START_PATIENCE = 10.0  # s until a start that was asked for is written


class Recording(Component):
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
        self._log: Recorder | None = None
        # Starts are counted as the flight hands them out, its own is 0: that of a log which has ended already is not
        # taken for the start of the next one.
        self._handed_out, self._awaited = 0, 0
        self._open = False  # the start of the flight is in the log
        self._has_begun = threading.Event()  # and all of that instant
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

        What a flight at rest says or is told again and again is recorded once: time stands still, and there is no news.
        """
        log, channels = self._log, self._channels
        if not self._open or log is None:
            return
        if essential or self._topics[channel][3] in STATES or not self._repeats(channel, time, data):
            self._latest[channel] = time, data
            log.write(channels[channel], time, data, wait, essential)

    def _repeats(self, channel: int, time: float, data: bytes) -> bool:
        """True if a message says what the last one of the channel has said, at the same time."""
        then, before = self._latest.get(channel, (-1.0, b""))
        if time != then or len(data) != len(before):
            return False
        kind = self._topics[channel][1]  # by its values, for what stands between them is left to chance
        return data == before or bool(deserialize_message(data, kind) == deserialize_message(before, kind))

    def take_start(self) -> None:
        """From now on what is written gets into the log, if this is the start of the flight that it waits for."""
        if self._handed_out == self._awaited:
            self._open = self._log is not None
        self._handed_out += 1

    @contextlib.contextmanager
    def instant(self) -> Iterator[None]:
        """While all that belongs to an instant of the flight is written: a log does not end in the middle of it."""
        with self._instant:
            yield
            if self._open:
                self._has_begun.set()

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
        """Make a log, which waits for that start of the flight; `record` is as for `Recorder`.

        Raises
        ------
        RecordingError
            There is one already, the file cannot be made, or a package is missing.
        """
        from sbs_sim.nodes.recorder import Recorder  # here, because who does not record need not have its packages

        if self._log is not None:
            raise RecordingError(f"recording {self.path} already: record = false ends it")
        log = Recorder(record, self._simulation, self._flown_with)
        with self._lock:
            try:
                self._channels = [log.channel(*topic) for topic in self._topics]
            except SbsError:
                log.discard()
                raise
            self._latest = {}
            self._awaited, self._log = start, log
            self._has_begun.clear()

    def end(self) -> str:
        """End the log; its path, empty if there is none.

        Raises
        ------
        RecordingError
            It is not whole.
        """
        log = self._log
        if log is None:
            return ""
        whole = self._instant.acquire(timeout=INSTANT_PATIENCE)
        self._open = False
        if whole:
            self._instant.release()
        log.close()  # before it is no longer the present one: who sees that there is none may read it
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
                self._has_begun.wait(START_PATIENCE)  # a log without its start would be of no use
            response.path = self.end()
            if not response.path:
                raise RecordingError("record = false: nothing is recorded")
            return
        self.begin(request.path, start=self._awaited + 1)
        try:
            self._loop.begin_log()
            if not self._has_begun.wait(START_PATIENCE):
                raise RecordingError(f"the flight has not handed out its start within {START_PATIENCE:g} s")
            response.path = self.path
        except SbsError:
            self._open = False
            log, self._log = self._log, None
            if log is not None:
                log.discard()
            raise
