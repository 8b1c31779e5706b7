"""Executable `replay`: a log as topics again, checked, repaired, or flown again.

Without an option it publishes the recorded topics with the recorded timing, `/clock` included, and serves `pause`. It
reads logs of other writers too, as long as their message types are installed.
"""

import argparse
import importlib
import itertools
import math
import os
import re
import sys
import threading
import time
import traceback
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from ament_index_python.packages import get_packages_with_prefixes
from mcap.records import Channel, Schema
from nav_msgs.msg import Odometry
from rclpy.exceptions import NameValidationException
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from rclpy.serialization import serialize_message
from rosgraph_msgs.msg import Clock
from ruamel.yaml import YAML
from std_srvs.srv import SetBool

from sbs_msgs.msg import BodyState, FlightEvent, InflowArray, RotorStateArray
from sbs_sim.aircraft import Aircraft
from sbs_sim.errors import RecordingError, SbsError
from sbs_sim.flight.refly import refly, started
from sbs_sim.nodes.conversions import StateMessages, event_message, to_time
from sbs_sim.nodes.executables import INTERRUPTED, ignore_interruptions, when_interrupted
from sbs_sim.nodes.host import (
    DISCOVERY,
    EVENT_QOS,
    ROS_REFUSALS,
    SERVICE_QOS,
    STATE_QOS,
    Component,
    heed,
    own_arguments,
    run,
)
from sbs_sim.nodes.recorder import Recorder, definition_file
from sbs_sim.recording import Log, message_definition, read, recover
from sbs_sim.recording.cdr import Fit, plain
from sbs_sim.recording.definitions import parse, short_name
from sbs_sim.recording.flight import TOLERANCE, Flight, Verification, flight_of, verify, whole_until
from sbs_sim.recording.playback import Playback
from sbs_sim.recording.roles import mixed, several
from sbs_sim.terminal.command_line import Parser, assignment
from sbs_sim.terminal.progress import progress_bar
from sbs_sim.versions import in_words

Progress = Callable[[float, float], None]  # takes what is done and the total

LARGEST_RATE = 1000.0
LONGEST_DELAY = 3600.0  # s
EMPTY = "structure_needs_at_least_one_member"
# of which every node may be a publisher, in any namespace
SHARED = frozenset(("rosout", "parameter_events", "diagnostics", "tf", "tf_static"))
NEWER, OLDER = ("--set", "--out"), ("--with", "--output")  # names of the same options
PLAYING = ("rate", "start", "end", "loop", "topics", "delay")
ROUNDING = 1e-6  # s
LOOK_PERIOD = 0.05  # s between looks at who else is there
LOOKOUT = 10.0  # s of playing in which somebody may still be discovered: most are at once, but not on a busy machine
SHORTEST_PASS = 0.05  # s of wall time: a loop over an instant is no flood
RECOVERED = ".recovered.mcap"
DEEPEST = 10_000  # messages that a publisher keeps, whatever a log asks for
MESSAGE_TYPE = re.compile(r"(?P<package>[a-z][a-z0-9_]*)/(msg/)?(?P<name>[A-Z][A-Za-z0-9]*)")


class Replay(Component):
    """Publishes a log.

    Parameters
    ----------
    playback : Playback
    rate : float
        Recorded time over wall time.
    start, end : float
        Part of the log, from its first message on [s].
    loop : bool
        Begin again at the end.
    topics : sequence of str
        Those to publish; all if empty.
    delay : float
        Longest time to wait until somebody listens to every topic [s]; that in which others are found is waited anyway.
    ended : threading.Event
        Set at the end of the log.
    progress : callable, optional
        Called with the recorded time that has been played and that will be [s].

    Attributes
    ----------
    failure : str
        Why the log could not be played to its end, in one line; empty if it was.
    """

    def __init__(
        self,
        playback: Playback,
        rate: float,
        start: float,
        end: float,
        loop: bool,
        topics: Sequence[str],
        delay: float,
        ended: threading.Event,
        progress: Progress | None = None,
    ) -> None:
        super().__init__("replay")
        self._delay = delay
        self._playback, self._rate, self._start, self._end, self._loop = playback, rate, start, end, loop
        self.failure = ""
        if playback.warning:
            self.get_logger().warning(playback.warning)
        self._left_out: dict[str, int] = {}  # messages that are none of their topic's type
        self._fits: dict[int, Fit] = {}
        self._outputs = self._make_publishers(topics)
        self._wake = threading.Condition()
        self._paused = self._stopping = False
        self._ended, self._progress = ended, progress
        self._next_look, self._lookout_end = 0.0, math.inf
        self.create_service(SetBool, "pause", self._on_pause, qos_profile=SERVICE_QOS)
        self._thread = threading.Thread(target=self._play, name="replay", daemon=True)
        self._thread.start()

    def _make_publishers(self, topics: Sequence[str]) -> dict[int, Any]:
        """Publisher of each channel that is wanted and whose type is installed."""
        channels = self._playback.channels
        if unknown := set(topics) - {name for channel in channels.values() for name in _names(channel)}:
            names = ", ".join(sorted({channel.topic for channel in channels.values()}))
            raise SbsError(f"--topics {min(unknown)}: the log has {names or 'none'}")
        self._refuse_mixture([channel for channel in channels.values() if not topics or _names(channel) & set(topics)])
        found: dict[int, Any] = {}
        by_topic: dict[str, tuple[Any, Any]] = {}
        for channel in channels.values():
            if topics and not _names(channel) & set(topics):
                continue
            try:
                kind = installed_type(channel, self._playback.schema(channel))
                if channel.topic not in by_topic:
                    qos = recorded_qos(channel.metadata.get("offered_qos_profiles", ""))
                    by_topic[channel.topic] = kind, self.create_publisher(kind, channel.topic, qos)
            except NameValidationException:
                self.get_logger().warning(f"{channel.topic}: left out, ROS does not allow this name")
            except SbsError as error:
                self.get_logger().warning(f"{channel.topic}: left out, {error}")
            else:
                first, found[channel.id] = by_topic[channel.topic]
                self._fits[channel.id] = fit_of(self._playback.schema(channel))
                if kind is not first:
                    self.get_logger().warning(f"{channel.topic}: partly left out, it was recorded with two types")
                    del found[channel.id]
        return found

    def _refuse_mixture(self, wanted: Sequence[Channel]) -> None:
        """Raise SbsError if a topic would have the messages of several flights."""
        parts = self._playback.flights
        if mixed(wanted, parts):
            raise SbsError(several(self._playback.path, [part.title for part in parts]))

    def _on_pause(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        with self._wake:
            self._paused = request.data
            self._wake.notify()
        response.success, response.message = True, "paused" if request.data else "playing"
        return response

    def _play(self) -> None:
        try:
            self._await_others()
            for _ in itertools.count() if self._loop else range(1):
                started = time.monotonic()
                if not self._play_once() or self._wait_until(started + SHORTEST_PASS) is None:
                    break
            if self._left_out:
                listed = ", ".join(f"{count} of {topic}" for topic, count in sorted(self._left_out.items()))
                self.failure = f"{self._playback.path}: messages that are not of their type were left out: {listed}"
        except SbsError as error:
            self.failure = str(error)
        except Exception as error:  # of ours
            self.get_logger().error(f"internal error: {traceback.format_exc()}")
            self.failure = f"internal error, see above: {error!r}"
        finally:
            self._ended.set()

    def _await_others(self) -> None:
        """Give others the time to be discovered: who publishes the same, and who is to get the beginning."""
        begin = time.monotonic()
        patience = DISCOVERY
        with self._wake:
            while not self._stopping and (left := begin + patience - time.monotonic()) > 0:
                self._wake.wait(min(left, LOOK_PERIOD))
                self._look_out()
                heard = all(output.get_subscription_count() for output in self._outputs.values())
                patience = DISCOVERY if heard else max(DISCOVERY, self._delay)
        self._lookout_end = time.monotonic() + LOOKOUT

    def _look_out(self) -> None:
        """Raise SbsError if somebody else publishes a topic too: recorded commands would fly a simulator."""
        now = time.monotonic()
        if not self._next_look <= now < self._lookout_end:
            return
        self._next_look = now + LOOK_PERIOD
        for name in sorted({output.topic_name for output in self._outputs.values()}):
            if not is_shared(name) and self.count_publishers(name) > 1:
                remedy = "--topics chooses others, another ROS_DOMAIN_ID keeps apart"
                raise SbsError(f"somebody else publishes {name} already: {remedy}")

    def _play_once(self) -> bool:
        """Publish the log from start to end; false if that was broken off."""
        anchor: float | None = None
        begin = 0
        length = min(self._end, self._playback.duration) - self._start
        for log_time, channel, data in self._playback.messages(self._start, self._end):
            if channel not in self._outputs:
                continue
            if anchor is None:
                anchor, begin = time.monotonic(), log_time
            held = self._wait_until(anchor + (log_time - begin) * 1e-9 / self._rate)
            if held is None:
                return False
            anchor += held
            self._look_out()
            self._publish(channel, (log_time - begin) * 1e-9, data)
            if self._progress is not None:
                self._progress(min((log_time - begin) * 1e-9, length), length)
        if anchor is None:
            raise RecordingError(f"{self._playback.path}: there is nothing to play in this part or on these topics")
        return True

    def _publish(self, channel: int, time: float, data: bytes) -> None:
        """Publish a message; what is none is left out, for it would end whoever takes it."""
        output = self._outputs[channel]
        try:
            data = plain(data)
            self._fits[channel].check(data)
            output.publish(data)
        except (RecordingError, *ROS_REFUSALS) as error:
            topic = output.topic_name
            if topic not in self._left_out:
                refused = f"ROS does not publish these {len(data)} bytes"  # it says no more itself
                why = str(error) if isinstance(error, RecordingError) else refused
                self.get_logger().warning(f"{topic}: messages are left out, the first at {time:.3f} s: {why}")
            self._left_out[topic] = self._left_out.get(topic, 0) + 1

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


def _names(channel: Channel) -> set[str]:
    """What a topic may be called on the command line."""
    return {channel.topic, channel.topic.lstrip("/")}


def is_shared(topic: str) -> bool:
    """True for topics of which every node may be a publisher."""
    return topic.rpartition("/")[2] in SHARED


def installed_type(channel: Channel, schema: Schema | None) -> Any:
    """Class of a channel's messages.

    Raises
    ------
    SbsError
        They are no ROS 2 messages, or their type is not installed or not the one that was recorded.
    """
    if schema is None or channel.message_encoding != "cdr":
        raise SbsError(f"its messages are no ROS 2 messages but {channel.message_encoding or 'of no known kind'}")
    kind = _installed(schema.name)
    if kind is None:
        raise SbsError(f"{schema.name} is not installed")
    if schema.encoding == "ros2msg" and schema.data:
        recorded = _fields(schema.name, schema.data.decode(errors="replace"))
        installed = _fields(schema.name, message_definition(schema.name, definition_file))
        if any(recorded.get(name) != fields for name, fields in installed.items()):
            raise SbsError(f"{schema.name} is installed with other fields than were recorded")
    return kind


def fit_of(schema: Schema | None) -> Fit:
    """What tells whether messages are of an installed type."""
    name = "" if schema is None else schema.name
    return Fit(parse(name, message_definition(name, definition_file)), short_name(name))


def _installed(type_name: str) -> Any:
    """Class of a message type, None if ROS has none of that name: to import is to execute, so nothing else is."""
    found = MESSAGE_TYPE.fullmatch(type_name)
    if found is None or found["package"] not in get_packages_with_prefixes():
        return None
    try:
        kind = getattr(importlib.import_module(f"{found['package']}.msg"), found["name"])
    except (ImportError, AttributeError):
        return None
    return kind if hasattr(kind, "get_fields_and_field_types") else None


def _fields(type_name: str, text: str) -> dict[str, list[tuple[str, str, int | None]]]:
    """What decides how a message is written, by type; some writers name the byte that an empty message has."""
    return {
        kind: [(field.name, field.type, field.count) for field in fields if field.name != EMPTY]
        for kind, fields in parse(type_name, text).items()
    }


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


def fly_with(
    flight: Flight,
    changes: Sequence[str],
    last: int,
    output: Path,
    progress: Progress | None = None,
) -> tuple[Path, int]:
    """Fly the events of a flight with a changed aircraft into a new log.

    Parameters
    ----------
    flight : Flight
    changes : sequence of str
        "PATH=VALUE" each, see `Aircraft.with_values`.
    last : int
        Step to end at.
    output : Path
    progress : callable, optional
        Called with the number of steps that have been flown and of all of them; what it raises ends the flight.

    Returns
    -------
    path : Path
    steps : int
        Flown, in those of the recorded flight; fewer than wanted if the changed aircraft ended in a fault.

    Raises
    ------
    SbsError
        A change that is not possible, a log that cannot be written.
    """
    aircraft = changed(flight.aircraft, changes)
    # rotors of another speed have another step: what acted acts at the same time
    step_size = started(aircraft, flight.events, **flight.options).step_size
    shorter = flight.step_size / step_size
    events = tuple(
        replace(event, step=round(event.step * shorter), wind_step=round(event.wind_step * shorter))
        for event in flight.events
    )
    simulation = started(aircraft, events, **flight.options)
    log = Recorder(str(output), simulation, {"with": list(changes)})
    try:
        changed_flight = replace(flight, aircraft=aircraft, events=events)
        steps = _write_flight(changed_flight, round(last * shorter), step_size, log, progress)
    except BaseException:  # an interruption too: half a flight looks like a whole one
        log.discard()
        raise
    log.close()
    if log.fault:
        raise RecordingError(log.fault)
    return log.path, round(steps / shorter)


def changed(aircraft: Aircraft, changes: Sequence[str]) -> Aircraft:
    """Aircraft with changes "PATH=VALUE".

    Raises
    ------
    SbsError
        One is not of that form, or all together are not possible.
    """
    try:
        return aircraft.with_values(dict(map(assignment, changes)))
    except argparse.ArgumentTypeError as error:
        raise SbsError(f"--set {error}") from None


def _write_flight(
    flight: Flight,
    last: int,
    step_size: float,
    log: Recorder,
    progress: Progress | None,
) -> int:
    """Fly to a step and record; the number of steps that were flown."""
    made = StateMessages(flight.aircraft)
    kinds = {
        "clock": (Clock, STATE_QOS),
        "events": (FlightEvent, EVENT_QOS),
        "state": (BodyState, STATE_QOS),
        "rotors": (RotorStateArray, STATE_QOS),
        "inflow": (InflowArray, STATE_QOS),
        "odom": (Odometry, STATE_QOS),
    }
    names = {role: flight.topics.get(role, f"/{role}") for role in kinds}  # as the recorded flight has them
    places = {role: log.channel(names[role], kind, qos, role) for role, (kind, qos) in kinds.items()}

    def keep(role: str, message: Any, now: float) -> None:
        log.write(places[role], now, serialize_message(message), wait=True)

    events = [event for event in flight.events if event.step <= last]
    for event in events:
        keep("events", event_message(event, step_size), event.step * step_size)
    first = flown = flight.events[0].step
    try:
        for snapshot in refly(flight.aircraft, events, last, **flight.options):
            made.fill(snapshot)
            keep("clock", Clock(clock=to_time(snapshot.time)), snapshot.time)
            for role, message in (("state", made.state), ("rotors", made.rotors), ("inflow", made.inflow)):
                keep(role, message, snapshot.time)
            keep("odom", made.odom, snapshot.time)
            flown = snapshot.step
            if progress is not None:
                progress(flown - first, last - first)
    except SbsError as error:
        print(f"the flight ended early: {error}", file=sys.stderr)
    return flown - first


# --- command line -----------------------------------------------------------------------------------------------


def main(args: list[str] | None = None) -> None:
    """Do with a log what the command line asks for."""
    try:
        options = _parse(own_arguments(args))
        if options.recover:
            when_interrupted(_interrupt)  # what is half written is to be taken away
            sys.exit(_recover(options.file, options.out))
        if options.verify:
            sys.exit(_verify(options.file, options.flight))
        if options.changes:
            sys.exit(_fly_with(options))
        sys.exit(_replay(options))
    except KeyboardInterrupt:
        sys.exit(INTERRUPTED)
    except SbsError as error:
        print(" ".join(str(error).split()), file=sys.stderr)
        sys.exit(1)


def _interrupt(*_: Any) -> None:
    """End what is done, once: the end is not to be disturbed."""
    ignore_interruptions()
    raise KeyboardInterrupt


def make_parser() -> Parser:
    """Command line of `replay`."""
    parser = Parser(
        "replay",
        example="replay bags/hover_step.mcap --rate 0.5",
        description="Publish, check, repair or fly again a log.",
    )
    parser.add_argument("file", type=Path, help="MCAP log")
    parser.add_argument("--rate", type=float, default=1.0, help="recorded time over wall time, 0.001 to 1000")
    parser.add_argument("--start", type=float, default=0.0, help="where to begin [s after the first message]")
    parser.add_argument(
        "--end", type=float, default=float("inf"), help="where to end [s after the first message]; with --set too"
    )
    parser.add_argument(
        "--flight", type=int, metavar="NUMBER", help="which flight of a file that was made of several, from 1"
    )
    parser.add_argument("--loop", action="store_true", help="begin again at the end")
    parser.add_argument("--topics", nargs="+", default=[], help="topics to publish, all if not given; after FILE")
    parser.add_argument(
        "--delay",
        type=float,
        default=DISCOVERY,
        help=f"longest wait before the first message until every topic is heard [s]; {DISCOVERY:g} are waited anyway",
    )
    one = parser.add_mutually_exclusive_group()
    one.add_argument("--verify", action="store_true", help="fly the log again and compare every state bit for bit")
    one.add_argument("--recover", action="store_true", help="rewrite a truncated or damaged log")
    one.add_argument(
        "--set",
        dest="changes",
        action="append",
        metavar="PATH=VALUE",
        help="fly the commands with a changed aircraft: body.mass=25; may be given several times, and is then checked"
        " together",
    )
    parser.hidden(one, OLDER[0], NEWER[0])
    parser.add_argument(
        "--out",
        default="",
        metavar="FILE",
        help="log to write, a file or a folder (default: FILE.recovered.mcap, or one named after the time)",
    )
    parser.hidden(parser, OLDER[1], NEWER[1])
    return parser


def _parse(arguments: list[str]) -> argparse.Namespace:
    parser = make_parser()
    options = parser.parse_args(arguments)
    _check(parser, options, OLDER if set(OLDER) & set(arguments) else NEWER)
    return options


def _check(parser: Parser, options: argparse.Namespace, spelled: tuple[str, str]) -> None:
    """End with a usage error where options are out of range or do not go together, by the names that were typed."""
    change, out = spelled
    modes = {"--verify": options.verify, "--recover": options.recover, change: options.changes}
    for mode in (mode for mode, wanted in modes.items() if wanted):
        for name in PLAYING:
            if getattr(options, name) != parser.get_default(name) and (mode, name) != (change, "end"):
                parser.error(f"--{name}: not allowed with {mode}")
    if not 1.0 / LARGEST_RATE <= options.rate <= LARGEST_RATE:
        parser.error(f"--rate {options.rate}: allowed are {1 / LARGEST_RATE:g} to {LARGEST_RATE:g}")
    if not 0.0 <= options.delay <= LONGEST_DELAY:
        parser.error(f"--delay {options.delay}: allowed are 0 to {LONGEST_DELAY:g}")
    if not 0.0 <= options.end <= float("inf"):
        parser.error(f"--end {options.end}: allowed is 0 or more")
    if options.flight is not None and options.recover:
        parser.error("--flight: not allowed with --recover, which keeps them all")
    if options.out and not (options.recover or options.changes):
        parser.error(f"{out}: allowed with --recover and {change}")
    if not 0.0 <= options.start <= options.end:
        parser.error(f"--start {options.start}: allowed are 0 to --end")


def _replay(options: argparse.Namespace) -> int:
    """Play until the end of the log or an interruption."""
    ended = threading.Event()
    players: list[Replay] = []
    with Playback(options.file, options.flight) as playback, progress_bar("s") as progress:

        def make() -> list[Component]:
            how = (options.rate, options.start, options.end, options.loop, options.topics, options.delay)
            players.append(Replay(playback, *how, ended, progress))
            return list(players)

        code = run(make, sys.argv[:1], ended)
    if players and players[0].failure:
        raise RecordingError(players[0].failure)
    return code


def _recover(path: Path, output: str) -> int:
    """0 if nothing was lost, 3 if something was; a log that cannot be recovered is an error."""
    target = Path(output) if output else path.parent / f"{path.stem}{RECOVERED}"
    if os.path.isdir(target):  # which says no to names that no file can have
        target /= f"{path.stem}{RECOVERED}"
    with progress_bar("chunk") as progress:
        found = recover(path, target, progress)
    until = "" if found.last_time is None else f" until {found.last_time:.3f} s"
    print(f"{target}: {found.messages} messages{until}")
    if found.complete:
        print("nothing was lost")
        return 0
    print(f"lost: {found.lost_bytes} bytes of {path}; " + "; ".join(found.reasons))
    return 3


def _tell_if_broken(log: Log) -> None:
    if not log.complete:
        print(f"{log.path} is not whole: {log.reasons[0]}", file=sys.stderr)


def _verify(path: Path, number: int | None) -> int:
    """0 if every state came again as it should."""
    flight = _flight(path, number)
    with progress_bar("state") as show:
        found = verify(flight, _interruptible(show))
    print(_verdict(found))
    for title, difference in (("first", found.first), ("largest", found.largest)):
        if difference is not None:
            print(
                f"{title} difference: step {difference.step} (t = {difference.time:.4f} s), {difference.state}:"
                f" {difference.logged!r} recorded, {difference.flown!r} flown"
            )
    for name, (recorded, here) in found.other_versions.items():
        print(in_words(name, recorded, here))
    return 0 if found.passed else 1


def _verdict(found: Verification) -> str:
    """What became of a log that was flown again, in one line."""
    if found.identical:
        return f"identical, {found.states} states"
    if not found.other_versions:
        return f"different, though the versions are the same: {found.states} states"
    within = "within" if found.within_tolerance else "beyond"
    return f"{within} the tolerance of {TOLERANCE:g} for other versions, {found.states} states"


def _flight(path: Path, number: int | None) -> Flight:
    """Flight of a log; the log itself, several times as large, is not kept while it is flown again."""
    log = read(path).flight(number)
    _tell_if_broken(log)
    return flight_of(log)


def _interruptible(show: Progress | None) -> Progress:
    """Progress that raises KeyboardInterrupt after an interruption.

    Raised by the signal's handler it would be lost in the callbacks of the compiler.
    """
    asked: list[int] = []
    heed(asked)

    def progress(done: float, total: float) -> None:
        if asked:
            raise KeyboardInterrupt
        if show is not None:
            show(done, total)

    return progress


def _fly_with(options: argparse.Namespace) -> int:
    """Fly the commands again, if they are all there."""
    log = read(options.file).flight(options.flight)
    flight = flight_of(log)
    first = flight.events[0].step  # 0 but for a log that was started in mid-flight
    wanted = flight.steps[(flight.steps - first) * flight.step_size <= options.end + ROUNDING]
    last = int(wanted[-1]) if len(wanted) else first
    whole = whole_until(log)
    if last * flight.step_size > whole + ROUNDING:
        end = math.floor((whole - first * flight.step_size + ROUNDING) * 1e3) * 1e-3
        raise RecordingError(f"{log.path} lacks commands after {end:.3f} s: --end {end:.3f} flies those before")
    _tell_if_broken(log)
    with progress_bar("step") as show:
        path, steps = fly_with(flight, options.changes, last, Path(options.out), _interruptible(show))
    print(f"{path}: {steps} of {last - first} steps")
    return 0


if __name__ == "__main__":
    main()
