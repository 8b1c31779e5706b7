"""Executable `replay`: a log as topics again, checked, repaired, or flown again.

Without an option it publishes the recorded topics with the recorded timing, `/clock` included, and serves `pause`. It
reads logs of other writers too, as long as their message types are installed.
"""

import argparse
import contextlib
import importlib
import itertools
import re
import struct
import sys
import threading
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from mcap.exceptions import McapError
from mcap.reader import make_reader
from mcap.records import Channel, Message
from nav_msgs.msg import Odometry
from rclpy.exceptions import InvalidTopicNameException
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from rclpy.serialization import serialize_message
from rosgraph_msgs.msg import Clock
from ruamel.yaml import YAML
from std_srvs.srv import SetBool

from sbs_msgs.msg import BodyState, FlightEvent, InflowArray, RotorStateArray
from sbs_sim.aircraft import Aircraft
from sbs_sim.errors import RecordingError, SbsError
from sbs_sim.nodes.conversions import StateMessages, event_message, to_time
from sbs_sim.nodes.host import EVENT_QOS, STATE_QOS, Component, own_arguments, run
from sbs_sim.nodes.recorder import Recorder
from sbs_sim.recording import read, recover
from sbs_sim.recording.flight import TOLERANCE, Flight, flight_of, verify
from sbs_sim.simulation import Simulation, refly

LARGEST_RATE = 1000.0
LONGEST_DELAY = 3600.0  # s
RECOVERED = ".recovered.mcap"
DEEPEST = 10_000  # messages that a publisher keeps, whatever a log asks for
MESSAGE_TYPE = re.compile(r"(?P<package>[a-z][a-z0-9_]*)/(msg/)?(?P<name>[A-Z][A-Za-z0-9]*)")


class Replay(Component):
    """Publishes a log.

    Parameters
    ----------
    path : Path
    rate : float
        Recorded time over wall time.
    start, end : float
        Part of the log, from its first message on [s].
    loop : bool
        Begin again at the end.
    topics : sequence of str
        Those to publish; all if empty.
    delay : float
        Longest time to wait until somebody listens to every topic [s].
    ended : threading.Event
        Set at the end of the log.
    """

    def __init__(
        self,
        path: Path,
        rate: float,
        start: float,
        end: float,
        loop: bool,
        topics: Sequence[str],
        delay: float,
        ended: threading.Event,
    ) -> None:
        super().__init__("replay")
        self._delay = delay
        self._path, self._rate, self._start, self._end, self._loop = path, rate, start, end, loop
        self._outputs = self._make_publishers(topics)
        self._wake = threading.Condition()
        self._paused = self._stopping = False
        self._ended = ended
        self.create_service(SetBool, "pause", self._on_pause)
        self._thread = threading.Thread(target=self._play, name="replay", daemon=True)
        self._thread.start()

    def _make_publishers(self, topics: Sequence[str]) -> dict[int, Any]:
        """Publisher of each channel that is wanted and whose type is installed."""
        found: dict[int, Any] = {}
        by_topic: dict[str, Any] = {}
        there = _channels(self._path)
        known = {name for channel, _ in there for name in (channel.topic, channel.topic.lstrip("/"))}
        if unknown := set(topics) - known:
            names = ", ".join(sorted(channel.topic for channel, _ in there))
            raise SbsError(f"--topics {min(unknown)}: the log has {names}")
        for channel, type_name in there:
            if topics and not {channel.topic, channel.topic.lstrip("/")} & set(topics):
                continue
            kind = message_class(type_name)
            if kind is None:
                self.get_logger().warning(f"{channel.topic}: left out, {type_name} is not installed")
                continue
            if channel.topic not in by_topic:
                qos = recorded_qos(channel.metadata.get("offered_qos_profiles", ""))
                try:
                    by_topic[channel.topic] = self.create_publisher(kind, channel.topic, qos)
                except InvalidTopicNameException:
                    raise RecordingError(f"{self._path}: no topic can be called {channel.topic[:60]!r}") from None
            found[channel.id] = by_topic[channel.topic]
        return found

    def _on_pause(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        with self._wake:
            self._paused = request.data
            self._wake.notify()
        response.success, response.message = True, "paused" if request.data else "playing"
        return response

    def _play(self) -> None:
        self._await_listeners()
        try:
            for _ in itertools.count() if self._loop else range(1):
                if not self._play_once():
                    return
        except SbsError as error:
            self.get_logger().error(str(error))
        finally:
            self._ended.set()

    def _await_listeners(self) -> None:
        """Give those who listen already the time to be discovered, so that they get the beginning."""
        end = time.monotonic() + self._delay
        with self._wake:
            while not self._stopping and (left := end - time.monotonic()) > 0:
                self._wake.wait(min(left, 0.05))
                if all(output.get_subscription_count() for output in self._outputs.values()):
                    return

    def _play_once(self) -> bool:
        """Publish the log from start to end; false if that was broken off or there was nothing."""
        anchor: float | None = None
        begin = 0
        for message in self._wanted():
            if anchor is None:
                anchor, begin = time.monotonic(), message.log_time
            held = self._wait_until(anchor + (message.log_time - begin) * 1e-9 / self._rate)
            if held is None:
                return False
            anchor += held
            self._outputs[message.channel_id].publish(message.data)
        return anchor is not None

    def _wanted(self) -> Iterator[Message]:
        """Messages of the wanted topics and time, in the order of their time."""
        first: int | None = None
        for message in _messages(self._path):
            first = message.log_time if first is None else first
            since = (message.log_time - first) * 1e-9
            if since > self._end:
                return
            if since >= self._start and message.channel_id in self._outputs:
                yield message

    def _wait_until(self, due: float) -> float | None:
        """Sleep until a wall time; how long a pause held it up [s], None at the end."""
        held = 0.0
        with self._wake:
            while not self._stopping:
                now = time.monotonic()
                if self._paused:
                    self._wake.wait()
                    held += time.monotonic() - now
                elif due + held > now:
                    self._wake.wait(due + held - now)
                else:
                    return held
        return None

    def stop(self) -> None:
        """End the playing."""
        with self._wake:
            self._stopping = True
            self._wake.notify()
        self._thread.join()


def _channels(path: Path) -> list[tuple[Channel, str]]:
    """Channels of a log with their types.

    Raises
    ------
    RecordingError
        The file cannot be read.
    """
    found: dict[int, tuple[Channel, str]] = {}
    with _reading(path) as reader:
        summary = reader.get_summary()
        if summary is not None and summary.channels:
            return [(channel, summary.schemas[channel.schema_id].name) for channel in summary.channels.values()]
        for schema, channel, _ in reader.iter_messages():
            found[channel.id] = (channel, schema.name if schema else "")
    return list(found.values())


def _messages(path: Path) -> Iterator[Message]:
    """Messages in the order of their time; see `_channels`."""
    with _reading(path) as reader:
        for _, _, message in reader.iter_messages(log_time_order=True):
            yield message


@contextlib.contextmanager
def _reading(path: Path) -> Iterator[Any]:
    """A reader that checks all checksums; what goes wrong with the file is told in one line."""
    try:
        with path.open("rb") as stream:
            yield make_reader(stream, validate_crcs=True)
    except OSError as error:
        raise RecordingError(f"{path}: {error.strerror or error}") from None
    except (McapError, struct.error, ValueError, EOFError) as error:
        hint = f"`replay --recover {path}` saves what is whole"
        raise RecordingError(f"{path} is damaged ({' '.join(str(error).split())}): {hint}") from None


def message_class(type_name: str) -> Any:
    """Class of a message type, None if it is not installed."""
    found = MESSAGE_TYPE.fullmatch(type_name)
    try:
        kind = getattr(importlib.import_module(f"{found['package']}.msg"), found["name"]) if found else None
    except (ImportError, AttributeError):
        return None
    return kind if hasattr(kind, "get_fields_and_field_types") else None


def recorded_qos(profiles: str) -> QoSProfile:
    """Quality of service that a topic was offered with; that of state topics where the log does not say."""
    try:
        profile = YAML(typ="safe", pure=True).load(profiles)[0]
        keep_all = profile["history"] in ("keep_all", 2)
        return QoSProfile(
            history=HistoryPolicy.KEEP_ALL if keep_all else HistoryPolicy.KEEP_LAST,
            depth=min(max(1, int(profile["depth"])), DEEPEST),
            reliability=_one_of(ReliabilityPolicy, profile["reliability"], ("reliable", 1)),
            durability=_one_of(DurabilityPolicy, profile["durability"], ("transient_local", 1)),
        )
    except Exception:  # whatever another writer put there
        return STATE_QOS


def _one_of(policy: Any, value: Any, first: tuple[str, int]) -> Any:
    """RELIABLE or BEST_EFFORT, TRANSIENT_LOCAL or VOLATILE: words since Jazzy, numbers before."""
    others = {ReliabilityPolicy: ReliabilityPolicy.BEST_EFFORT, DurabilityPolicy: DurabilityPolicy.VOLATILE}
    return getattr(policy, first[0].upper()) if value in first else others[policy]


# --- other aircraft, same commands ------------------------------------------------------------------------------


def fly_with(flight: Flight, changes: Sequence[str], output: Path) -> tuple[Path, int]:
    """Fly the events of a flight with a changed aircraft into a new log.

    Parameters
    ----------
    flight : Flight
    changes : sequence of str
        "PATH=VALUE" each, see `Aircraft.with_value`.
    output : Path

    Returns
    -------
    path : Path
    steps : int
        Flown; fewer than recorded if the changed aircraft ended in a fault.

    Raises
    ------
    SbsError
        A change that is not possible, a log that cannot be written.
    """
    aircraft = flight.aircraft
    for change in changes:
        aircraft = changed(aircraft, change)
    start = flight.events[0]
    if start.state is None or start.swashplate is None:
        raise RecordingError("the log lacks the start of its flight")
    simulation = Simulation(aircraft, start.state, start.swashplate, wind=start.wind, **flight.options)
    log = Recorder(str(output), simulation, {"with": list(changes)})
    try:
        return log.path, _write_flight(flight, aircraft, simulation.step_size, log)
    finally:
        log.close()


def changed(aircraft: Aircraft, change: str) -> Aircraft:
    """Aircraft with a change "PATH=VALUE".

    Raises
    ------
    SbsError
        It is not of that form, or not possible.
    """
    path, equals, text = change.partition("=")
    if not equals:
        raise SbsError(f"--with {change}: allowed is KEY=VALUE, such as body.mass=22.5")
    try:
        value = YAML(typ="safe", pure=True).load(text)
    except Exception:
        raise SbsError(f"--with {change}: the value is not readable") from None
    return aircraft.with_value(path, value)


def _write_flight(flight: Flight, aircraft: Aircraft, step_size: float, log: Recorder) -> int:
    """Fly and record; the number of the last step."""
    made = StateMessages(aircraft)
    kinds = {
        "/clock": (Clock, STATE_QOS),
        "/events": (FlightEvent, EVENT_QOS),
        "/state": (BodyState, STATE_QOS),
        "/rotors": (RotorStateArray, STATE_QOS),
        "/inflow": (InflowArray, STATE_QOS),
        "/odom": (Odometry, STATE_QOS),
    }
    places = {topic: log.channel(topic, kind, qos) for topic, (kind, qos) in kinds.items()}

    def keep(topic: str, message: Any, now: float) -> None:
        log.write(places[topic], now, serialize_message(message), wait=True)

    for event in flight.events:
        keep("/events", event_message(event, step_size), event.step * step_size)
    last = 0
    try:
        for snapshot in refly(aircraft, flight.events, int(flight.steps[-1]), **flight.options):
            made.fill(snapshot)
            keep("/clock", Clock(clock=to_time(snapshot.time)), snapshot.time)
            for topic, message in (("/state", made.state), ("/rotors", made.rotors), ("/inflow", made.inflow)):
                keep(topic, message, snapshot.time)
            keep("/odom", made.odom, snapshot.time)
            last = snapshot.step
    except SbsError as error:
        print(f"the flight ended early: {error}", file=sys.stderr)
    return last


# --- command line -----------------------------------------------------------------------------------------------


def main(args: list[str] | None = None) -> None:
    """Do with a log what the command line asks for."""
    try:
        options = _parse(own_arguments(args))
        if options.recover:
            sys.exit(_recover(options.file, options.output))
        if options.verify:
            sys.exit(_verify(options.file))
        if options.changes:
            sys.exit(_fly_with(options))
        sys.exit(_replay(options))
    except SbsError as error:
        print(" ".join(str(error).split()), file=sys.stderr)
        sys.exit(1)


def _parse(arguments: list[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="replay", description="Publish, check, repair or fly again a log.")
    parser.add_argument("file", type=Path, help="MCAP log")
    parser.add_argument("--rate", type=float, default=1.0, help="recorded time over wall time, 0.001 to 1000")
    parser.add_argument("--start", type=float, default=0.0, help="where to begin [s after the first message]")
    parser.add_argument("--end", type=float, default=float("inf"), help="where to end [s after the first message]")
    parser.add_argument("--loop", action="store_true", help="begin again at the end")
    parser.add_argument("--topics", nargs="+", default=[], help="topics to publish, all if not given")
    parser.add_argument(
        "--delay", type=float, default=1.0, help="longest wait before the first message until every topic is heard [s]"
    )
    one = parser.add_mutually_exclusive_group()
    one.add_argument("--verify", action="store_true", help="fly the log again and compare every state bit for bit")
    one.add_argument("--recover", action="store_true", help="rewrite a truncated or damaged log")
    one.add_argument(
        "--with", dest="changes", action="append", metavar="KEY=VALUE", help="fly the commands with a changed aircraft"
    )
    parser.add_argument(
        "--output", default="", help="log to write, a file or a folder (default of --recover: FILE.recovered.mcap)"
    )
    options = parser.parse_args(arguments)
    if not 1.0 / LARGEST_RATE <= options.rate <= LARGEST_RATE:
        parser.error(f"--rate {options.rate}: allowed are {1 / LARGEST_RATE:g} to {LARGEST_RATE:g}")
    if not 0.0 <= options.delay <= LONGEST_DELAY:
        parser.error(f"--delay {options.delay}: allowed are 0 to {LONGEST_DELAY:g}")
    if not 0.0 <= options.start <= options.end:
        parser.error(f"--start {options.start}: allowed are 0 to --end")
    return options


def _replay(options: argparse.Namespace) -> int:
    """Play until the end of the log or an interruption."""
    _refuse_damaged(options.file)
    ended = threading.Event()
    part = (options.start, options.end)
    return run(
        lambda: [Replay(options.file, options.rate, *part, options.loop, options.topics, options.delay, ended)],
        sys.argv[:1],
        ended,
    )


def _refuse_damaged(path: Path) -> None:
    """Raise RecordingError for a log that is not whole; one of another writer, without checksums, is taken as it is."""
    try:
        log = read(path)
    except RecordingError:
        return
    if not log.complete:
        raise RecordingError(f"{path} is not whole ({log.reasons[0]}): `replay --recover {path}` saves what is")


def _recover(path: Path, output: str) -> int:
    """0 if nothing was lost, 3 if something was; a log that cannot be recovered is an error."""
    target = Path(output) if output else path.with_name(f"{path.stem}{RECOVERED}")
    if target.is_dir():
        target /= f"{path.stem}{RECOVERED}"
    found = recover(path, target)
    until = "" if found.last_time is None else f" until {found.last_time:.3f} s"
    print(f"{target}: {found.messages} messages{until}")
    if found.complete:
        print("nothing was lost")
        return 0
    print(f"lost: {found.lost_bytes} bytes of {path}; " + "; ".join(found.reasons))
    return 3


def _verify(path: Path) -> int:
    """0 if every state came again as it should."""
    flight = flight_of(read(path))
    found = verify(flight)
    for name, (recorded, here) in found.other_versions.items():
        print(f"other {name}: {recorded or 'unknown'} recorded, {here} here")
    if found.identical:
        print(f"identical, {found.states} states")
        return 0
    for title, difference in (("first", found.first), ("largest", found.largest)):
        if difference is None:
            continue
        print(
            f"{title} difference: step {difference.step} (t = {difference.time:.4f} s), {difference.state}:"
            f" {difference.logged!r} recorded, {difference.flown!r} flown"
        )
    if found.other_versions:
        within = "within" if found.within_tolerance else "beyond"
        print(f"with other versions {found.states} states are compared by a tolerance: {within} {TOLERANCE:g}")
        return 0 if found.within_tolerance else 1
    return 1


def _fly_with(options: argparse.Namespace) -> int:
    flight = flight_of(read(options.file))
    path, steps = fly_with(flight, options.changes, Path(options.output) if options.output else Path())
    print(f"{path}: {steps} of {flight.steps[-1]} steps")
    return 0


if __name__ == "__main__":
    main()
