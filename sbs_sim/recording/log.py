"""Reading a recording into arrays: `log["state"]["position.x"]`."""

import importlib
from collections.abc import Collection, Iterator, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from mcap.records import Schema
from numpy.typing import NDArray

from sbs_sim.errors import RecordingError
from sbs_sim.recording.cdr import Columns, decode
from sbs_sim.recording.checked_records import Content
from sbs_sim.recording.definitions import Definitions, Units, parse, short_name
from sbs_sim.recording.flight_topics import FlightTopics, alike, check_flight, flights, several, unclaimed
from sbs_sim.recording.mcap_file import RECORDING_ID, START
from sbs_sim.recording.scan import Scan, scan
from sbs_sim.recording.source import Source

Row = tuple[int, int, bytes]  # log time [ns], number, data


class Topic(Mapping[str, NDArray[Any]]):
    """The messages of a topic as arrays by the names of their fields, in the order in which they were recorded.

    Fields of fields are joined by dots (`position.x`), indices of lists of messages are in brackets
    (`rotors[0].flap`). See `sbs_sim.recording.cdr.decode` for the shapes. Numbers keep their types.

    Attributes
    ----------
    name : str
    type : str
        package/msg/Type
    time_ns : ndarray of int64, shape (n,)
        Time of each message [ns].
    sequence : ndarray of int64, shape (n,)
        Number of each message; in logs of this package a gap means lost ones.
    """

    def __init__(self, name: str, schema: Schema, rows: Sequence[Row]) -> None:
        self.name, self.type = name, schema.name
        self.time_ns = np.array([row[0] for row in rows], np.uint64).view(np.int64)
        self.sequence = np.array([row[1] for row in rows], np.int64)
        self._schema = schema
        self._messages = [row[2] for row in rows]

    @property
    def time(self) -> NDArray[np.float64]:
        """Time of each message [s], shape (n,)."""
        return self.time_ns.astype(np.float64) / 1e9

    @property
    def stamp(self) -> NDArray[np.float64] | None:
        """Time in the header of each message [s], shape (n,); None where the type has no header."""
        if "header.stamp.sec" not in self:
            return None
        seconds: NDArray[np.float64] = self["header.stamp.sec"] + 1e-9 * self["header.stamp.nanosec"]
        return seconds

    @cached_property
    def units(self) -> Mapping[str, str]:
        """Units by the names of the fields, as far as the definition says them; empty where it does not."""
        units = Units(self._definitions, short_name(self.type))
        return {name: units[name] for name in self}

    def to_pandas(self) -> Any:
        """A pandas.DataFrame over time [s]; of lists each index is a column, such as `rotors[0].flap[2]`.

        Raises
        ------
        RecordingError
            There is no pandas.
        """
        try:
            pandas = importlib.import_module("pandas")
        except ImportError:
            raise RecordingError("to_pandas needs pandas: python3 -m pip install pandas") from None
        columns: dict[str, NDArray[Any]] = {}
        for name, values in self.items():
            if values.ndim == 1:
                columns[name] = values
            else:
                columns.update({f"{name}[{i}]": values[:, i] for i in range(values.shape[1])})
        return pandas.DataFrame(columns, index=pandas.Index(self.time, name="time"))

    @cached_property
    def _definitions(self) -> Definitions:
        return parse(self.type, self._schema.data.decode(errors="replace"))

    @cached_property
    def _columns(self) -> Columns:
        """Decoded when it is first asked for."""
        try:
            columns = decode(self._schema, self._definitions, short_name(self.type), self._messages)
        except (RecordingError, UnicodeDecodeError) as error:
            raise RecordingError(f"topic {self.name}: {error}") from None
        self._messages = []  # not before: what could not be decoded once must not look like no messages afterwards
        return columns

    def __getitem__(self, name: str) -> NDArray[Any]:
        if name not in self._columns:
            raise KeyError(f"topic {self.name} has no field {name!r}; there are {', '.join(self._columns)}")
        return self._columns[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._columns)

    def __len__(self) -> int:
        return len(self._columns)

    def __repr__(self) -> str:
        return f"<topic {self.name}: {len(self.time_ns)} messages of type {self.type}>"


class Log(Mapping[str, Topic]):
    """A recording in memory: topics by name, with or without the leading slash, or by their role in the flight.

    `log["state"]` is the topic with the states, whatever a namespace or a remap has made of its name; `log["/state"]`
    is the topic of that name.

    Attributes
    ----------
    path : Path
    metadata : dict of str to dict of str to str
        Metadata records by name; `recording` has the program, and the wall time of the start.
    attachments : dict of str to bytes
        Files by name.
    complete : bool
        True if all that was recorded is here.
    reasons : tuple of str
        What is wrong with the file, one line each.
    flights : tuple of Log
        Those of a file that was made of several, each with its own topics, metadata and attachments; the log itself if
        it holds one; empty if it holds none.
    recordings : int
        How many have left their metadata in it.
    """

    def __init__(
        self, path: Path, found: Scan, topics: Sequence[Topic], part: FlightTopics | None, alone: bool = True
    ) -> None:
        self.path = path
        self.complete = found.complete
        self.reasons = tuple(found.reasons)
        self._part = part
        belongings = Belongings(found, None if part is None or alone else part.recording_id)
        self.metadata, self.attachments = belongings.metadata, belongings.attachments
        self.recordings = belongings.recordings
        self._topics = {topic.name: topic for topic in topics}
        self.flights: tuple[Log, ...] = () if part is None else (self,)

    @property
    def topics(self) -> tuple[str, ...]:
        """Names of the topics."""
        return tuple(self._topics)

    @property
    def roles(self) -> dict[str, str]:
        """Names of the topics by their role in the flight: `state`, `rotors`, `events`, ..."""
        roles = {} if self._part is None else self._part.roles
        return {role: names[0] for role, names in roles.items() if len(names) == 1}

    @property
    def title(self) -> str:
        """What distinguishes the flight: aircraft, topic of its states, and when it began."""
        aircraft = self.metadata.get("simulation", {}).get("aircraft", "")
        return " on ".join(filter(None, (aircraft, "" if self._part is None else self._part.title)))

    @property
    def wall_start_ns(self) -> int | None:
        """Wall time of the start [ns since 1970], if the recording says it."""
        text = self.metadata.get(START, {}).get("wall_start_ns")
        return None if text is None else int(text)

    def flight(self, number: int | None = None) -> "Log":
        """One flight of the file, counted from 1; without a number the log itself, if it does not hold several.

        Raises
        ------
        RecordingError
            There is no such flight, or there are several and no number says which.
        """
        if number is None:
            if len(self.flights) > 1:
                raise RecordingError(several(self.path, [flight.title for flight in self.flights]))
            if self.recordings > 1 and self.flights:
                raise RecordingError(alike(self.path, self.recordings))
            return self
        check_flight(self.path, number, len(self.flights))
        return self.flights[number - 1]

    def __getitem__(self, name: str) -> Topic:
        if name not in self._topics and any(name in flight.roles for flight in self.flights if flight is not self):
            raise KeyError(several(self.path, [flight.title for flight in self.flights]))
        role = self.roles.get(name, name)
        stated = self._part is not None and self._part.stated
        for key in (name, *((role, f"/{name}") if stated else (f"/{name}", role))):
            if key in self._topics:
                return self._topics[key]
        raise KeyError(f"{self.path} has no topic {name!r}; there are {', '.join(self._topics) or 'none'}")

    def __iter__(self) -> Iterator[str]:
        return iter(self._topics)

    def __len__(self) -> int:
        return len(self._topics)

    def __repr__(self) -> str:
        state = "complete" if self.complete else "incomplete"
        return f"<{state} recording {self.path} of {', '.join(self._topics) or 'nothing'}>"


class Belongings:
    """Metadata and attachments of one recording of a file, or of all of them.

    Parameters
    ----------
    found : Scan
    recording_id : str or None
        See `LogWriter`; empty for what has none, None for all.

    Attributes
    ----------
    metadata, attachments : dict
        See `Log`.
    recordings : int
        How many different ones they come from.
    """

    def __init__(self, found: Scan, recording_id: str | None) -> None:
        records = [(name, data.get(RECORDING_ID, ""), data) for name, data in found.metadata]
        records.sort(key=lambda record: record[1] != "")  # what is said of all of them comes first
        starts = [(identity, data.get("wall_start_ns", "")) for name, identity, data in records if name == START]
        own = {begin for identity, begin in starts if recording_id in (None, identity)}
        others = {begin for _, begin in starts} - own  # the attachments of each were made when it began
        self.metadata = {
            name: {key: value for key, value in data.items() if key != RECORDING_ID}
            for name, identity, data in records
            if recording_id is None or identity in ("", recording_id)
        }
        self.attachments = {
            attachment.name: attachment.data
            for attachment in found.attachments
            if str(attachment.create_time) not in others
        }
        self.recordings = len(own)


def read(path: str | Path) -> Log:
    """Read a recording, as far as it is intact.

    Every byte that is used is covered by a checksum that is right, but in files of other writers that made none, which
    `reasons` says. `complete` and `reasons` say what is missing.

    Parameters
    ----------
    path : path-like
        An MCAP file with ROS 2 messages.

    Raises
    ------
    RecordingError
        The file cannot be read, or no part of it is intact.
    """
    messages: dict[int, list[Row]] = {}

    def take(content: Content) -> None:
        data = content.data
        for channel, sequence, log_time, _, start, end in content.messages:
            messages.setdefault(channel, []).append((log_time, sequence, data[start:end]))

    with Source(Path(path)) as source:
        found = scan(source, take)
    require_something(source, found)
    for number in messages.keys() - found.channels.keys():
        found.reasons.append(f"{len(messages[number])} messages of a topic whose definition is lost")
        found.complete = False
    for channel in found.channels.values():
        if not channel.schema_id:
            found.reasons.append(f"topic {channel.topic} has no type and is left out")
    parts = flights(found.channels, found.schemas)
    if len(parts) < 2:
        return Log(source.path, found, _topics(source, found, messages, found.channels), *parts or (None,))
    others = unclaimed(found.channels, parts)
    log = Log(source.path, found, _topics(source, found, messages, found.channels), None)
    log.flights = tuple(
        Log(source.path, found, _topics(source, found, messages, part.channels | others), part, alone=False)
        for part in parts
    )
    return log


def _topics(source: Source, found: Scan, messages: Mapping[int, Sequence[Row]], wanted: Collection[int]) -> list[Topic]:
    """Topics with all their messages, those of the channels that are wanted."""
    topics = []
    for topic, schema, numbers in _by_topic(source, found, wanted):
        rows = [row for number in numbers for row in messages.get(number, ())]
        if len(numbers) > 1:
            rows.sort(key=lambda row: row[0])
        topics.append(Topic(topic, schema, rows))
    return topics


def _by_topic(source: Source, found: Scan, wanted: Collection[int]) -> list[tuple[str, Schema, list[int]]]:
    """Topics with their type and channels; other writers have a channel for each publisher, and topics without type."""
    topics: dict[str, tuple[str, Schema, list[int]]] = {}
    for number, channel in sorted(found.channels.items()):
        if number not in wanted or not channel.schema_id:
            continue
        schema = found.schemas[channel.schema_id]
        _, first, numbers = topics.setdefault(channel.topic, (channel.topic, schema, []))
        if (first.name, first.data) == (schema.name, schema.data):
            numbers.append(number)
        elif channel.metadata.get(RECORDING_ID) == found.channels[numbers[0]].metadata.get(RECORDING_ID):
            raise RecordingError(f"cannot read {source.path}: topic {channel.topic} is recorded with two types")
        else:
            found.reasons.append(f"topic {channel.topic} has another type in another flight, and is found there alone")
    return list(topics.values())


def require_something(source: Source, found: Scan) -> None:
    """Raise the error of a file that is of no use; one without messages is, if it is complete.

    Raises
    ------
    RecordingError
    """
    if not found.messages and not found.complete:
        why = "; ".join(found.reasons[:3])
        raise RecordingError(f"nothing in {source.path} can be read: it has no intact chunk: {why}")
