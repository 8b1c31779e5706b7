"""Executable `replay`: publishes a log, verifies it, repairs it, or flies its commands again.

Without an option it publishes the recorded topics with the recorded timing, `/clock` included, and serves `pause`. It
also reads logs of other writers if their message types are installed. Only this and flying commands again need ROS,
which is imported where they begin.
"""

import argparse
import math
import os
import sys
import threading
from pathlib import Path
from typing import Any

from sbs_sim.errors import RecordingError, SbsError
from sbs_sim.nodes.signals import (
    DISCOVERY_TIME,
    INTERRUPTED,
    disregard_interruptions,
    ignore_interruptions,
    note_interruptions,
    when_interrupted,
)
from sbs_sim.output.units import counted
from sbs_sim.recording import Log, read, recover
from sbs_sim.recording.playback import Playback, Progress
from sbs_sim.recording.recorded_flight import RecordedFlight, complete_until, flight_of
from sbs_sim.recording.verification import TOLERANCE, Verification, verify
from sbs_sim.terminal.command_line import Parser
from sbs_sim.terminal.progress import progress_bar
from sbs_sim.versions import in_words

MAX_RATE = 1000.0
MAX_DELAY = 3600.0  # s
OPTION_NAMES, OLD_OPTION_NAMES = ("--set", "--out"), ("--with", "--output")  # names of the same options
PLAYBACK_OPTIONS = ("rate", "start", "end", "loop", "topics", "delay")
TIME_TOLERANCE = 1e-6  # s
RECOVERED_SUFFIX = ".recovered.mcap"


def main(args: list[str] | None = None) -> None:
    """Do with a log what the command line asks for."""
    try:
        options = _parse(_own_arguments(args))
        if options.recover:
            when_interrupted(_interrupt)  # a partly written file is deleted
            sys.exit(_recover(options.file, options.out))
        if options.verify:
            sys.exit(_verify(options.file, options.flight))
        if options.changes:
            sys.exit(_fly_with(options))
        sys.exit(_replay(options))
    except KeyboardInterrupt:
        ignore_interruptions()  # a second one must not disturb the end of the interpreter
        sys.exit(INTERRUPTED)
    except SbsError as error:
        print(" ".join(str(error).split()), file=sys.stderr)
        sys.exit(1)


def _own_arguments(args: list[str] | None) -> list[str]:
    words = sys.argv if args is None else args
    if "--ros-args" not in words:
        return words[1:]
    from sbs_sim.nodes.process import own_arguments

    return own_arguments(args)


def _interrupt(*_: Any) -> None:
    """End what is done, once: the end is not to be disturbed."""
    disregard_interruptions()
    raise KeyboardInterrupt


def make_parser() -> Parser:
    """Command line of `replay`."""
    parser = Parser(
        "replay",
        example="replay bags/hover_step.mcap --rate 0.5",
        description="Publish, verify, repair or re-fly a log.",
    )
    parser.add_argument("file", type=Path, help="MCAP log")
    parser.add_argument("--rate", type=float, default=1.0, help="recorded time over elapsed time, 0.001 to 1000")
    parser.add_argument("--start", type=float, default=0.0, help="start time [s after the first message]")
    parser.add_argument(
        "--end", type=float, default=float("inf"), help="end time [s after the first message]; also with --set"
    )
    parser.add_argument(
        "--flight", type=int, metavar="NUMBER", help="which flight of a file with several flights, from 1"
    )
    parser.add_argument("--loop", action="store_true", help="start again at the end")
    parser.add_argument(
        "--topics", nargs="+", default=[], help="topics to publish (default: all); give them after FILE"
    )
    parser.add_argument(
        "--delay",
        type=float,
        default=DISCOVERY_TIME,
        help=f"longest wait for a subscriber on every topic before the first message [s]; at least {DISCOVERY_TIME:g}",
    )
    one = parser.add_mutually_exclusive_group()
    one.add_argument("--verify", action="store_true", help="repeat the flight and compare every state bit for bit")
    one.add_argument("--recover", action="store_true", help="rewrite a truncated or damaged log")
    one.add_argument(
        "--set",
        dest="changes",
        action="append",
        metavar="PATH=VALUE",
        help="fly the recorded commands with a changed aircraft: body.mass=25; may be repeated, all values are checked"
        " together",
    )
    parser.hidden(one, OLD_OPTION_NAMES[0], OPTION_NAMES[0])
    parser.add_argument(
        "--out",
        default="",
        metavar="FILE",
        help="log to write: a file or a folder (default: FILE.recovered.mcap, or a name with the time)",
    )
    parser.hidden(parser, OLD_OPTION_NAMES[1], OPTION_NAMES[1])
    return parser


def _parse(arguments: list[str]) -> argparse.Namespace:
    parser = make_parser()
    options = parser.parse_args(arguments)
    _check(parser, options, OLD_OPTION_NAMES if set(OLD_OPTION_NAMES) & set(arguments) else OPTION_NAMES)
    return options


def _check(parser: Parser, options: argparse.Namespace, spelled: tuple[str, str]) -> None:
    """End with a usage error where options are out of range or do not go together, by the names that were typed."""
    change, out = spelled
    modes = {"--verify": options.verify, "--recover": options.recover, change: options.changes}
    for mode in (mode for mode, wanted in modes.items() if wanted):
        for name in PLAYBACK_OPTIONS:
            if getattr(options, name) != parser.get_default(name) and (mode, name) != (change, "end"):
                parser.error(f"--{name}: not allowed with {mode}")
    if not 1.0 / MAX_RATE <= options.rate <= MAX_RATE:
        parser.error(f"--rate {options.rate}: allowed are {1 / MAX_RATE:g} to {MAX_RATE:g}")
    if not 0.0 <= options.delay <= MAX_DELAY:
        parser.error(f"--delay {options.delay}: allowed are 0 to {MAX_DELAY:g}")
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
    from sbs_sim.nodes.component import Component
    from sbs_sim.nodes.log_player import LogPlayer, PlayOptions
    from sbs_sim.nodes.process import run

    ended = threading.Event()
    players: list[LogPlayer] = []
    with Playback(options.file, options.flight) as playback, progress_bar("s") as progress:

        def make() -> list[Component]:
            how = PlayOptions(**{name: getattr(options, name) for name in PLAYBACK_OPTIONS})
            players.append(LogPlayer(playback, how, ended, progress))
            return list(players)

        code = run(make, sys.argv[:1], ended)
    if players and players[0].failure:
        raise RecordingError(players[0].failure)
    return code


def _recover(path: Path, output: str) -> int:
    """0 if nothing was lost, 3 if something was; a log that cannot be recovered is an error."""
    target = Path(output) if output else path.parent / f"{path.stem}{RECOVERED_SUFFIX}"
    if os.path.isdir(target):  # which says no to names that no file can have
        target /= f"{path.stem}{RECOVERED_SUFFIX}"
    with progress_bar("chunk") as progress:
        found = recover(path, target, progress)
    until = "" if found.last_time is None else f" until {found.last_time:.3f} s"
    print(f"{target}: {counted(found.messages, 'message')}{until}")
    if found.complete:
        print("nothing was lost")
        return 0
    print(f"lost: {found.lost_bytes} bytes of {path}; " + "; ".join(found.reasons))
    return 3


def _warn_if_incomplete(log: Log) -> None:
    if not log.complete:
        print(f"{log.path} is incomplete: {log.reasons[0]}", file=sys.stderr)


def _verify(path: Path, number: int | None) -> int:
    """0 if every state came again as it should."""
    flight = _flight(path, number)
    with progress_bar("state") as show:
        found = verify(flight, _interruptible(show))
    model = " of a stitched model" if "model" in flight.options else ""
    print(f"{_verdict(found)}{model}")
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
    states = counted(found.states, "state")
    if found.identical:
        return f"identical, {states}"
    if not found.other_versions:
        return f"different, though the versions are the same: {states}"
    within = "within" if found.within_tolerance else "beyond"
    return f"{within} the tolerance of {TOLERANCE:g} for other versions, {states}"


def _flight(path: Path, number: int | None) -> RecordedFlight:
    """Flight of a log; the log itself, several times as large, is not kept while it is flown again."""
    log = read(path).flight(number)
    _warn_if_incomplete(log)
    return flight_of(log)


def _interruptible(show: Progress | None) -> Progress:
    """Progress that raises KeyboardInterrupt after an interruption.

    Raised by the signal's handler it would be lost in the callbacks of the compiler.
    """
    asked: list[int] = []
    note_interruptions(asked)

    def progress(done: float, total: float) -> None:
        if asked:
            raise KeyboardInterrupt
        if show is not None:
            show(done, total)

    return progress


def _fly_with(options: argparse.Namespace) -> int:
    """Fly the commands again, if they are all there."""
    from sbs_sim.nodes.what_if import fly_with

    log = read(options.file).flight(options.flight)
    flight = flight_of(log)
    first = flight.events[0].step  # 0 unless the log was started in mid-flight
    wanted = flight.steps[(flight.steps - first) * flight.step_size <= options.end + TIME_TOLERANCE]
    last = int(wanted[-1]) if len(wanted) else first
    complete_time = complete_until(log)
    if last * flight.step_size > complete_time + TIME_TOLERANCE:
        end = math.floor((complete_time - first * flight.step_size + TIME_TOLERANCE) * 1e3) * 1e-3
        raise RecordingError(f"{log.path} lacks commands after {end:.3f} s: --end {end:.3f} flies those before")
    _warn_if_incomplete(log)
    with progress_bar("step") as show:
        path, steps = fly_with(flight, options.changes, last, Path(options.out), _interruptible(show))
    print(f"{path}: {steps} of {last - first} steps")
    return 0


if __name__ == "__main__":
    main()
