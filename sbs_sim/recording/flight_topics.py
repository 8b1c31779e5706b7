"""Which flights a file holds, and which topic plays which role in each of them.

Topics can be called anything: a flight in the namespace `h1` publishes its states on `/h1/state`. The logs of this
package say of each topic what it is (`role`) and which recording it belongs to (`recording_id`), which programs that
merge files keep. In other files, and in older logs, topics are found by their types.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime, timezone
from itertools import groupby
from pathlib import Path

from mcap.records import Channel, Schema

from sbs_sim.errors import RecordingError
from sbs_sim.recording.definitions import short_name
from sbs_sim.recording.mcap_file import RECORDING_ID, ROLE

BODY = "state"  # the role without which there is no flight
TYPES = {  # of the roles that are found by them
    BODY: "sbs_msgs/BodyState",
    "rotors": "sbs_msgs/RotorStateArray",
    "inflow": "sbs_msgs/InflowArray",
    "events": "sbs_msgs/FlightEvent",
    "controls": "sbs_msgs/Controls",
    "control_values": "sbs_msgs/ControlValues",
    "swashplate": "sbs_msgs/SwashplateArray",
    "status": "sbs_msgs/SimulationStatus",
    "odom": "nav_msgs/Odometry",
    "clock": "rosgraph_msgs/Clock",
    "diagnostics": "diagnostic_msgs/DiagnosticArray",
    "trim_point": "sbs_msgs/TrimPoint",
    "linear_model": "sbs_msgs/LinearModel",
}
MAX_WALL_TIME = 2**62  # ns since 1970
SHARED = ("clock",)  # may be one topic of several flights


@dataclass(frozen=True)
class FlightTopics:
    """The channels of one flight of a file.

    Attributes
    ----------
    recording_id : str
        See `LogWriter`; empty where the file does not say.
    channels : frozenset of int
        Their numbers.
    roles : dict of str to tuple of str
        Names of the topics that play each role; several where that cannot be decided.
    stated : bool
        The file says the roles; else they follow from types.
    """

    recording_id: str
    channels: frozenset[int]
    roles: dict[str, tuple[str, ...]]
    stated: bool

    @property
    def title(self) -> str:
        """What distinguishes it: the topic of its states, and when it began."""
        begin = self.recording_id.partition("-")[0]
        wall = f" started {wall_clock(int(begin))}" if begin.isdecimal() and int(begin) < MAX_WALL_TIME else ""
        return f"{self.roles[BODY][0]}{wall}"


def wall_clock(nanoseconds: int) -> str:
    """Time of day of a time since 1970 [ns]."""
    return datetime.fromtimestamp(nanoseconds / 1e9, tz=timezone.utc).isoformat(timespec="milliseconds")


def several(path: Path, titles: Sequence[str]) -> str:
    """What is said of a file with several flights."""
    listed = "; ".join(f"{number} is {title}" for number, title in enumerate(titles, 1))
    return f"{path} holds {len(titles)} flights, choose one by --flight NUMBER (in Python of log.flights): {listed}"


def alike(path: Path, count: int) -> str:
    """What is said of a file that others made of several older logs."""
    return f"{path} holds {count} flights that cannot be distinguished: their logs have no identity"


def check_flight(path: Path, number: int, count: int) -> None:
    """Raise RecordingError if a file has no flight of that number."""
    if not count:
        raise RecordingError(f"{path} holds no flight")
    if not 1 <= number <= count:
        raise RecordingError(f"{path}: flight {number}: allowed are 1 to {count}")


def unclaimed(channels: Iterable[int], parts: Sequence[FlightTopics]) -> frozenset[int]:
    """Channels that belong to no flight, and so to each."""
    return frozenset(channels) - {number for part in parts for number in part.channels}


def mixed(channels: Iterable[Channel], parts: Sequence[FlightTopics]) -> set[str]:
    """Topics of some channels that several flights have in common, but for the one of the time."""
    owners: dict[str, set[int]] = {}
    for channel in channels:
        for number, part in enumerate(parts):
            shared = any(channel.topic in part.roles.get(role, ()) for role in SHARED)
            if channel.id in part.channels and not shared:
                owners.setdefault(channel.topic, set()).add(number)
    return {topic for topic, numbers in owners.items() if len(numbers) > 1}


def flights(channels: Mapping[int, Channel], schemas: Mapping[int, Schema]) -> tuple[FlightTopics, ...]:
    """Flights of a file: those that have an identity in the order in which they began, then the others by topic."""
    ordered = sorted(channels.values(), key=lambda channel: (channel.metadata.get(RECORDING_ID, ""), channel.id))
    groups = {
        identity: list(group)
        for identity, group in groupby(ordered, key=lambda channel: channel.metadata.get(RECORDING_ID, ""))
    }
    unnamed = groups.pop("", [])
    found: list[FlightTopics] = []
    for identity, group in [*groups.items(), ("", unnamed)]:
        if any(ROLE in channel.metadata for channel in group):
            found.append(_by_role(identity, group))
        else:
            found += _by_type(identity, group, schemas)
    return tuple(part for part in found if BODY in part.roles)


def _by_role(identity: str, channels: list[Channel]) -> FlightTopics:
    """A recording whose topics say what they are."""
    roles: dict[str, tuple[str, ...]] = {}
    for channel in channels:
        if (role := channel.metadata.get(ROLE)) is not None:
            roles[role] = (*roles.get(role, ()), channel.topic)
    return FlightTopics(identity, frozenset(channel.id for channel in channels), roles, True)


def _by_type(identity: str, channels: list[Channel], schemas: Mapping[int, Schema]) -> Iterator[FlightTopics]:
    """One flight for each topic with states, and for each the topics of the other types in its namespace."""
    topics: dict[str, dict[str, list[int]]] = {role: {} for role in TYPES}
    for channel in channels:
        kind = schemas.get(channel.schema_id)
        for role, wanted in TYPES.items():
            if kind is not None and short_name(kind.name) == wanted:
                topics[role].setdefault(channel.topic, []).append(channel.id)
    for body in sorted(topics[BODY]):
        chosen = {role: _beside(body, role, topics) for role in TYPES}
        numbers = [number for role, names in chosen.items() for name in names for number in topics[role][name]]
        yield FlightTopics(
            identity, frozenset(numbers), {role: names for role, names in chosen.items() if names}, False
        )


def _beside(body: str, role: str, topics: Mapping[str, Mapping[str, list[int]]]) -> tuple[str, ...]:
    """Topics of a role that belong to the states of a topic."""
    if role == BODY:
        return (body,)
    namespace = body.rpartition("/")[0]
    found = [name for name in topics[role] if name.rpartition("/")[0] == namespace]
    if len(found) > 1 and f"{namespace}/{role}" in found:  # odometry of another program
        return (f"{namespace}/{role}",)
    if not found and (len(topics[BODY]) == 1 or role in SHARED):
        return tuple(topics[role])
    return tuple(found)
