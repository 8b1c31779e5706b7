"""Reading a recording message by message in the order of time, started at once and checked chunk by chunk."""

import heapq
import math
from collections.abc import Callable, Iterator
from pathlib import Path
from types import TracebackType

from mcap.opcode import Opcode
from mcap.records import Channel, Schema

from sbs_sim.errors import RecordingError
from sbs_sim.recording.checked_records import Content, Extent, chunk_at, loose_records_at
from sbs_sim.recording.checksum_policy import open_recording
from sbs_sim.recording.flight_topics import FlightTopics, check_flight, flights, unclaimed
from sbs_sim.recording.log import require_something
from sbs_sim.recording.scan import Scan, scan
from sbs_sim.recording.source import DamageError, Source

Progress = Callable[[float, float], None]  # arguments: done, total
Entry = tuple[int, int, int, int, bytes]  # log time [ns], offset of the chunk and in it, channel, data


class Playback:
    """A recording to be played; a context that closes it.

    Only the summary is read in advance, or the entire file if it has none.

    Parameters
    ----------
    path : Path
    flight : int, optional
        Of a file with several flights the one to play, from 1; all of them if it is not given.

    Attributes
    ----------
    schemas, channels : dict
        Records by number; of a flight that was chosen its channels and those that belong to none.
    flights : tuple of FlightTopics
        Those that may be played.
    warning : str
        What is wrong with the file all the same; empty if nothing is.

    Raises
    ------
    RecordingError
        The file cannot be read, or is incomplete.
    """

    def __init__(self, path: Path, flight: int | None = None) -> None:
        self.path = path
        self._source = Source(path)
        try:
            self._optional, summary = open_recording(self._source)
            if summary is not None and summary.channels and summary.chunks:
                self.schemas, self.channels, self._chunks = summary.schemas, summary.channels, summary.chunks
            else:
                found = self._all()
                self.schemas, self.channels, self._chunks = found.schemas, found.channels, found.chunks
            self.flights = flights(self.channels, self.schemas)
            if flight is not None:
                check_flight(path, flight, len(self.flights))
                self._choose(self.flights[flight - 1])
        except BaseException:
            self.close()
            raise
        unchecked = self._optional.chunks and bool(self._chunks)
        self.warning = f"{path} has no checksums: damage cannot be found" if unchecked else ""

    def _choose(self, flight: FlightTopics) -> None:
        wanted = flight.channels | unclaimed(self.channels, self.flights)
        self.channels = {number: self.channels[number] for number in self.channels if number in wanted}
        self.flights = (flight,)

    def _all(self) -> Scan:
        found = scan(self._source, lambda content: None)
        if not found.complete:
            require_something(self._source, found)  # else nothing could be saved
            raise RecordingError(
                f"{self.path} is incomplete ({found.reasons[0]}): `replay --recover {self.path}` saves what is intact"
            )
        return found

    @property
    def duration(self) -> float:
        """Time from the first message to the last [s]."""
        times = [(earliest, latest) for _, earliest, latest in self._chunks.values()]
        return (max(last for _, last in times) - min(first for first, _ in times)) * 1e-9 if times else 0.0

    def messages(self, start: float = 0.0, end: float = math.inf) -> Iterator[tuple[int, int, bytes]]:
        """Log time [ns], channel and data of the messages of a part of the recording.

        Parameters
        ----------
        start, end : float
            From the first message on [s].

        Raises
        ------
        RecordingError
            A chunk is damaged; everything before it has been given.
        """
        first: int | None = None
        for log_time, _, _, channel, data in self._in_order(start, end):
            first = log_time if first is None else first
            since = (log_time - first) * 1e-9
            if since > end:
                return
            if since >= start:
                yield log_time, channel, data

    def _in_order(self, start: float, end: float) -> Iterator[Entry]:
        """All messages in the order of their time, but for chunks that lie between the first message and the start."""
        waiting: list[Entry] = []
        first: int | None = None
        for offset, (_, earliest, latest) in sorted(self._chunks.items(), key=lambda item: (item[1][1], item[0])):
            while waiting and waiting[0][0] < earliest:
                yield heapq.heappop(waiting)
            if first is not None and (earliest - first) * 1e-9 > end:
                break
            if first is not None and (latest - first) * 1e-9 < start:
                continue
            content = self._content(offset)
            for channel, _, log_time, _, begin, behind in content.messages:
                heapq.heappush(waiting, (log_time, offset, begin, channel, content.data[begin:behind]))
            if first is None and waiting:
                first = waiting[0][0]
        while waiting:
            yield heapq.heappop(waiting)

    def _content(self, offset: int) -> Content:
        """Content at an offset, as the summary or the scan announced it."""
        source, expected = self._source, self._chunks[offset]
        try:
            if source.at(offset, 1)[0] == Opcode.CHUNK or not self._optional.chunks:
                content, _ = chunk_at(source, offset, source.size, self._optional.chunks)
            else:
                content, _ = loose_records_at(source, offset, source.size)
            _check_extent(content, expected)
        except DamageError as damage:
            hint = f"`replay --recover {self.path}` saves what is intact"
            raise RecordingError(f"{self.path} is damaged (byte {offset}: {damage}): {hint}") from None
        return content

    def schema(self, channel: Channel) -> Schema | None:
        """Type of a channel, if it has one."""
        return self.schemas.get(channel.schema_id)

    def close(self) -> None:
        """Close the file."""
        self._source.close()

    def __enter__(self) -> "Playback":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def _check_extent(content: Content, expected: Extent) -> None:
    if content.extent() != expected:
        raise DamageError("the chunk is not the one that was recorded here")
