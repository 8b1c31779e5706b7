"""Writing a recording: an MCAP file as rosbag2 of Jazzy writes it, without ROS, in a thread of its own.

Every FLUSH_PERIOD of wall time what has come since is compressed into a chunk and handed to the operating system, so
that the end of the process, by whatever signal, costs no more than that. (A power failure may cost what the operating
system had not yet brought to the disk: some 30 s with the usual settings of Linux.) It is also looked then whether the
file is still there.
"""

import contextlib
import functools
import secrets
import threading
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import TracebackType

from mcap.records import Attachment, Channel, Schema
from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError

from sbs_sim.errors import RecordingError
from sbs_sim.recording.flight_topics import wall_clock
from sbs_sim.recording.mcap_file import (
    CHECKSUM,
    DISTRO,
    MAGIC,
    RECORDING_ID,
    RECOVERY,
    ROLE,
    ROSBAG2,
    START,
    FileBuilder,
    Message,
    NewFile,
)

FLUSH_PERIOD = 0.2  # s of wall time between chunks
CHUNK_SIZE = 256 * 1024  # bytes of messages at which a chunk is closed before that
QUEUE_LENGTH = 10_000  # messages that wait for the disk: 15 s of flight
MAX_ATTACHMENT_SIZE = 1 << 27  # bytes
MAX_TIME = 2**63  # ns; MCAP could hold twice that, most readers cannot
END = "recording_end"  # metadata records of our own
RESERVED = (START, END, RECOVERY, ROSBAG2)
RESERVED_KEYS = (CHECKSUM, RECORDING_ID)


class LogWriter:
    """Writes one recording.

    Parameters
    ----------
    path : path-like
        Must not exist; its folder must.
    library : str
        Name and version of the program that records.
    wall_start : int
        Wall time of the start [ns since 1970], as `time.time_ns()` gives it. Messages may have another clock.
    metadata : mapping of str to mapping of str to str
        Metadata records by name.
    attachments : mapping of str to bytes
        Files that belong to the flight by name.
    ros_distro : str
        Distribution of ROS 2 that records; empty where there is none.
    queue_length : int
        Messages that may wait for the disk.

    Attributes
    ----------
    path : Path
        Where it is: a file that is given another name meanwhile is followed.
    recording_id : str
        Of this recording alone; its topics and metadata have it, so that they differ from those of others in a file
        that was made of several.
    written : int
        Messages that are safe with the operating system.
    dropped : int
        Messages that are lost: no room in the queue, or after a failure or the end.
    failed : str
        Why nothing is written any more, in one line; empty while all is well. What was written stays readable.

    Raises
    ------
    RecordingError
        The file cannot be made: path and reason in one line.
    """

    def __init__(
        self,
        path: str | Path,
        *,
        library: str,
        wall_start: int,
        metadata: Mapping[str, Mapping[str, str]] | None = None,
        attachments: Mapping[str, bytes] | None = None,
        ros_distro: str = "",
        queue_length: int = QUEUE_LENGTH,
    ) -> None:
        self.recording_id = f"{wall_start}-{secrets.token_hex(4)}"  # in the order of time
        self._distro = ros_distro
        self.written = self.dropped = 0
        self.failed = ""
        self._builder = FileBuilder()
        self._queue_length, self._half_full = queue_length, (queue_length + 1) // 2
        self._queue: list[Message] = []
        self._queued_bytes = 0
        self._in_hand = 0  # messages that the thread has taken out of the queue and not yet written
        self._sequence: dict[int, int] = {}  # by channel; dropped messages count, so that a gap shows them
        self._closing = False
        self._lock = threading.Lock()
        self._work = threading.Condition(self._lock)
        self._room = threading.Condition(self._lock)
        pieces = self._first_pieces(library, wall_start, metadata or {}, attachments or {})
        self._file = NewFile(Path(path))
        try:
            self._file.write(pieces)
        except RecordingError:
            self._file.discard()
            raise
        self._thread = threading.Thread(target=self._run, name="recorder", daemon=True)
        self._thread.start()

    def _first_pieces(
        self,
        library: str,
        wall_start: int,
        metadata: Mapping[str, Mapping[str, str]],
        attachments: Mapping[str, bytes],
    ) -> bytes:
        for name, data in metadata.items():
            if name in RESERVED or any(key in data for key in RESERVED_KEYS):
                keys = " and ".join(RESERVED_KEYS)
                raise RecordingError(f"metadata {name!r}: reserved are {', '.join(RESERVED)} and the keys {keys}")
        wall = wall_clock(wall_start)
        start = {"library": library, "wall_start": wall, "wall_start_ns": str(wall_start), DISTRO: self._distro}
        pieces = [self._builder.start(library), self._metadata(START, start)]
        pieces += [self._metadata(name, data) for name, data in metadata.items()]
        for name, content in attachments.items():
            if MAGIC in content:  # in a damaged file its chunks could not be distinguished from its own
                raise RecordingError(f"attachment {name!r} is a recording itself, which cannot be attached")
            if len(content) > MAX_ATTACHMENT_SIZE:
                raise RecordingError(f"attachment {name!r} has {len(content)} bytes: allowed are {MAX_ATTACHMENT_SIZE}")
            attachment = Attachment(
                create_time=wall_start, log_time=0, name=name, media_type="application/octet-stream", data=content
            )
            pieces.append(self._builder.attachment(attachment))
        return b"".join(pieces)

    @property
    def path(self) -> Path:
        """See the class."""
        return self._file.path

    @property
    def has_room(self) -> bool:
        """True while the queue is at most half full: a hundred messages find room without waiting."""
        return len(self._queue) <= self._half_full

    def _metadata(self, name: str, data: Mapping[str, str]) -> bytes:
        return self._builder.metadata(name, {RECORDING_ID: self.recording_id, **data})

    def add_channel(
        self,
        topic: str,
        type_name: str,
        schema_text: str,
        qos_profiles_yaml: str,
        type_hash: str = "",
        role: str = "",
    ) -> int:
        """Announce a topic and return the number to write its messages with; at any time, from any thread.

        Parameters
        ----------
        topic : str
            Full name.
        type_name : str
            package/msg/Type
        schema_text : str
            See `sbs_sim.recording.message_definition`.
        qos_profiles_yaml : str
            See `sbs_sim.recording.qos_profiles`.
        type_hash : str
            RIHS01_..., where it is known.
        role : str
            What the topic is in the recording, however it is called: "state" for one that was remapped to "/h1/body".

        Raises
        ------
        RecordingError
            The topic is there already, the type with another definition, or the profiles are no YAML list.
        """
        _check_profiles(topic, qos_profiles_yaml)
        with self._lock:
            builder = self._builder
            if any(channel.topic == topic for channel in builder.channels.values()):
                raise RecordingError(f"topic {topic} is recorded already")
            schema = Schema(len(builder.schemas) + 1, schema_text.encode(), "ros2msg", type_name)
            for other in builder.schemas.values():
                if other.name == type_name:
                    if other.data != schema.data:
                        raise RecordingError(f"topic {topic}: {type_name} is recorded with another definition")
                    schema = other
            details = {"offered_qos_profiles": qos_profiles_yaml, "topic_type_hash": type_hash}
            details |= {RECORDING_ID: self.recording_id, **({ROLE: role} if role else {})}
            number = len(self._sequence) + 1
            self._sequence[number] = 0
            if not self._closing:  # the end is being written: what comes now is dropped anyway
                builder.schemas = {**builder.schemas, schema.id: schema}
                builder.channels = {**builder.channels, number: Channel(number, topic, "cdr", details, schema.id)}
        return number

    def write(self, channel: int, log_time_ns: int, data: bytes, wait: bool = False, essential: bool = False) -> bool:
        """Take a message; false if it is dropped. Costs about a microsecond and never waits, unless `wait`.

        Parameters
        ----------
        channel : int
            See `add_channel`.
        log_time_ns : int
            Time of the message [ns].
        data : bytes
            The message in CDR.
        wait : bool
            Wait for room in the queue rather than drop the message.
        essential : bool
            Use the room that is kept for such messages, as much again as the queue has.

        Raises
        ------
        RecordingError
            An unknown channel, or a time that no recording can hold.
        """
        if not 0 <= log_time_ns < MAX_TIME:
            raise RecordingError(f"log time {log_time_ns} ns: allowed are 0 to 2^63 - 1")
        limit = self._queue_length * (2 if essential else 1)
        with self._lock:
            if wait and len(self._queue) >= limit:
                self._room.wait_for(lambda: self._closing or len(self._queue) < limit)
            try:
                sequence = self._sequence[channel] = self._sequence[channel] + 1 & 0xFFFFFFFF
            except KeyError:
                raise RecordingError(f"channel {channel}: allowed are those that add_channel gave") from None
            if self._closing or len(self._queue) >= limit:
                self.dropped += 1
                return False
            self._queue.append((channel, sequence, log_time_ns, log_time_ns, data))
            self._queued_bytes += len(data)
            if self._queued_bytes >= CHUNK_SIZE or len(self._queue) >= self._half_full:
                self._work.notify()
        return True

    def close(self, timeout: float = 10.0) -> bool:
        """Write what is left and the summary, and return whether the recording is complete.

        Parameters
        ----------
        timeout : float
            Longest time that a slow disk may take [s].
        """
        with self._lock:
            self._closing = True
            self._work.notify()
            self._room.notify_all()
        self._thread.join(timeout)
        if self._thread.is_alive() and not self.failed:
            self.failed = f"cannot write {self.path}: the disk did not take the rest within {timeout:g} s"
        return not self.failed

    def discard(self, timeout: float = 10.0) -> None:
        """End the recording and delete it."""
        self.close(timeout)
        self._file.discard()

    def __enter__(self) -> "LogWriter":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    # ---------------------------------------------------------------------------------------- in the writer's thread

    def _run(self) -> None:
        try:
            while (batch := self._next_batch()) is not None:
                self._file.check_file()
                for part in _parts(batch):
                    self._file.write(self._builder.chunk(part))
                    self._in_hand -= len(part)
                    self.written += len(part)
            counts = {"written": str(self.written), "dropped": str(self.dropped)}
            end = self._metadata(END, counts)
            self._file.write(end + self._builder.finish(self.path.name, counts, self._distro))
            self._file.check_file()
            self._file.close()
        except RecordingError as error:
            self._fail(str(error))
        except Exception as error:  # an internal error must not end the flight, nor go unnoticed
            self._fail(f"cannot write {self.path}: internal error: {error!r}")

    def _next_batch(self) -> list[Message] | None:
        """What has come since the last call, when a chunk is due, or nothing; None when there will be no more."""
        with self._lock:
            if self._closing and not self._queue:
                return None
            self._work.wait_for(self._in_haste, FLUSH_PERIOD)
            batch, self._queue, self._queued_bytes = self._queue, [], 0
            self._in_hand = len(batch)
            self._room.notify_all()
            return batch

    def _in_haste(self) -> bool:
        return self._closing or self._queued_bytes >= CHUNK_SIZE or len(self._queue) >= self._half_full

    def _fail(self, why: str) -> None:
        with contextlib.suppress(RecordingError):
            self._file.close()
        with self._lock:
            self._closing = True
            self.failed = self.failed or why
            self.dropped += self._in_hand + len(self._queue)
            self._queue.clear()
            self._room.notify_all()


def _parts(batch: list[Message]) -> Iterator[list[Message]]:
    """A batch in parts of about CHUNK_SIZE."""
    part: list[Message] = []
    size = 0
    for message in batch:
        part.append(message)
        size += len(message[4])
        if size >= CHUNK_SIZE:
            yield part
            part, size = [], 0
    if part:
        yield part


def _check_profiles(topic: str, text: str) -> None:
    """What cannot be read back must not be found out at the end of a flight."""
    if not _is_list(text):
        raise RecordingError(f"topic {topic}: the QoS profiles are not a YAML list: {text!r}")


@functools.cache
def _is_list(text: str) -> bool:
    """True for YAML that is a list, or nothing; topics have few different profiles."""
    try:
        return isinstance(YAML(typ="safe").load(text) or [], list)
    except YAMLError:
        return False
