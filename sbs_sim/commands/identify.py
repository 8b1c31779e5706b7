"""`identify`: frequency responses from a recorded flight."""

import argparse
import math
import textwrap
from pathlib import Path
from typing import TYPE_CHECKING

from sbs_sim.commands.common import UsageError, execute, print_table
from sbs_sim.terminal.command_line import Parser
from sbs_sim.terminal.progress import progress_bar

if TYPE_CHECKING:
    from sbs_sim.aircraft import Aircraft
    from sbs_sim.analysis.identification import IdentifiedResponse
    from sbs_sim.analysis.identification_plots import Identified
    from sbs_sim.flight.signals import Signals

WIDTH = 130
PRIMARY = {"heave": "w", "roll": "p", "pitch": "q", "yaw": "r"}  # outputs by the axis of a control
METHODS = ("chirp_z", "welch")
AUTO, DIRECT, JOINT = "auto", "direct", "joint"


def main() -> int:
    """Executable `identify`."""
    return execute(make_parser(), _work)


def make_parser() -> Parser:
    """Command line of `identify`."""
    parser = Parser(
        "identify",
        example="identify flight.mcap --response longitudinal_cyclic:q --low 1 --high 20 --linear --out identified",
        description="Identify frequency responses from a log of this simulator or a CSV file with the signals of a"
        " flight: gain and phase with coherence and random error, beside a linear model and fits on request.",
    )
    parser.add_argument("file", type=Path, help="MCAP log, or CSV file: time [s], signals with units in brackets")
    parser.add_argument("--flight", type=int, metavar="NUMBER", help="which flight of a file with several, from 1")
    group = parser.add_argument_group("what is identified")
    group.add_argument(
        "--response",
        action="append",
        default=[],
        metavar="INPUT:OUTPUT",
        help="control and output as `linearize` names them; may be repeated (default: w, p, q, r by the controls of"
        " their axes)",
    )
    group.add_argument(
        "--inputs",
        nargs="+",
        metavar="NAME",
        help="controls whose effects are separated (default: those that were excited, else all that move; of a CSV"
        " file those of --response)",
    )
    group.add_argument("--from", dest="begin", type=float, metavar="T", help="begin of the part that is used [s]")
    group.add_argument("--to", dest="end", type=float, metavar="T", help="end of the part that is used [s]")
    group.add_argument(
        "--feedback",
        choices=(AUTO, DIRECT, JOINT),
        default=AUTO,
        help="joint: by the recorded excitations, which is right with a controller in the loop; direct: by the inputs"
        " (default: joint if all inputs have a recorded excitation)",
    )
    group.add_argument(
        "--references", nargs="+", metavar="NAME", help="of a CSV file: excitations of the inputs, for joint"
    )
    group.add_argument(
        "--held",
        nargs="+",
        default=[],
        metavar="NAME",
        help="of a CSV file: signals that keep each value until the next sample",
    )
    group = parser.add_argument_group("estimate")
    group.add_argument("--low", type=float, metavar="W", help="lowest frequency [rad/s] (default: two cycles fit)")
    group.add_argument(
        "--high", type=float, metavar="W", help="highest [rad/s] (default: 0.4 of the most there can be)"
    )
    group.add_argument("--points", type=int, default=30, metavar="N", help="frequencies between (default: 30)")
    group.add_argument(
        "--windows",
        nargs="+",
        type=float,
        metavar="T",
        help="lengths of the segments [s] (default: five by themselves)",
    )
    group.add_argument(
        "--period",
        type=float,
        metavar="T",
        help="the excitation is a multisine of this period [s]: whole periods, at its own frequencies, without windows",
    )
    group.add_argument("--method", choices=METHODS, default=METHODS[0], help="transform (default: chirp_z)")
    group = parser.add_argument_group("beside it")
    group.add_argument(
        "--linear",
        action="store_true",
        help="the linear model of the aircraft in the log, at the mean airspeed of the flight",
    )
    group.add_argument("--airspeed", type=float, metavar="V", help="airspeed of that model instead [m/s]")
    group.add_argument(
        "--fit",
        action="append",
        default=[],
        type=_orders,
        metavar="ZEROS/POLES",
        help="a transfer function of these orders with a delay, such as 1/2; may be repeated",
    )
    group.add_argument("--fit-delay", type=float, metavar="T", help="its delay [s] (default: found)")
    group.add_argument("--integrators", type=int, default=0, metavar="N", help="its poles at the origin (default: 0)")
    group = parser.add_argument_group("output")
    group.add_argument("--csv", metavar="FILE", help="also write all responses to this file, SI units")
    group.add_argument("--json", metavar="FILE", help="also write everything to this file")
    group.add_argument("--out", metavar="DIR", help="also write plots (PNG, SVG), CSV, JSON and a page (index.html)")
    return parser


def _orders(text: str) -> tuple[int, int]:
    zeros, mark, poles = text.partition("/")
    if not (mark and zeros.isdecimal() and poles.isdecimal()):
        raise argparse.ArgumentTypeError(f"{text!r}: allowed is ZEROS/POLES, such as 1/2")
    return int(zeros), int(poles)


def _work(arguments: argparse.Namespace) -> None:
    from sbs_sim.analysis import identification_plots as p
    from sbs_sim.output.files import check_target, write
    from sbs_sim.output.json_text import to_json

    check_target(arguments.csv)
    check_target(arguments.json)
    if arguments.out:  # a bad path is refused before the work, not after it
        from sbs_sim.analysis.page import make_folder

        make_folder(arguments.out)
    signals, craft = _signals(arguments)
    pairs = _pairs(arguments, signals, craft)
    inputs = _inputs(arguments, signals, pairs)
    every = _identified(arguments, signals, craft, pairs, inputs)
    statement = f"{arguments.file.name}, {signals.begin:g} to {signals.begin + signals.duration:g} s"
    print(statement)
    for one in every:
        print(f"\n{one.name}")
        print(textwrap.fill(p.summary(one), WIDTH))
        print_table(p.headings(one), p.rows(one), left=())
        for fit in one.fits:
            print(textwrap.fill(p.fit_text(fit), WIDTH))
    if arguments.csv:
        write(arguments.csv, p.to_csv(every))
    if arguments.json:
        write(arguments.json, to_json({"responses": [one.to_dict() for one in every]}))
    if arguments.out:
        with progress_bar("figure") as progress:
            written = p.save_identified(
                every, arguments.out, "Identified frequency responses", statement, progress=progress
            )
        print(f"\nwritten: {written[-1]} and {len(written) - 1} files")


def _signals(arguments: argparse.Namespace) -> "tuple[Signals, Aircraft | None]":
    """Signals of the file, and the aircraft of a log."""
    if arguments.file.suffix.lower() == ".csv":
        from sbs_sim.flight.signal_file import read_signals

        if arguments.linear or arguments.airspeed is not None or arguments.flight is not None:
            raise UsageError("--linear, --airspeed, --flight: a CSV file has no aircraft and one flight")
        whole = read_signals(arguments.file, arguments.held)
        return whole.between(arguments.begin, arguments.end), None
    if arguments.held or arguments.references:
        raise UsageError("--held, --references: for CSV files, a log says it itself")
    from sbs_sim.recording import read
    from sbs_sim.recording.flight_signals import signals_of_log

    log = read(arguments.file).flight(arguments.flight)
    signals, flown = signals_of_log(log, arguments.begin, arguments.end)
    return signals, flown.aircraft


def _pairs(arguments: argparse.Namespace, signals: "Signals", craft: "Aircraft | None") -> list[tuple[str, str]]:
    """Inputs and outputs of the responses.

    Raises
    ------
    UsageError
        An argument without a colon, or none where there is no default.
    """
    for text in arguments.response:
        if not all(text.partition(":")[::2]):
            raise UsageError(f"--response {text!r}: allowed is INPUT:OUTPUT, such as longitudinal_cyclic:q")
    if arguments.response:
        return [(text.partition(":")[0], text.partition(":")[2]) for text in arguments.response]
    if craft is None:
        raise UsageError("--response INPUT:OUTPUT is needed for a CSV file")
    excited = _excited(signals) or signals.moving_controls
    axes = {control.name: control.axis for control in craft.controls}
    found = [(name, PRIMARY[axes[name]]) for name in excited if axes.get(name) in PRIMARY]
    if not found:
        raise UsageError("--response INPUT:OUTPUT is needed: no control of an axis moves")
    return found


def _excited(signals: "Signals") -> tuple[str, ...]:
    """Controls with a recorded excitation."""
    from sbs_sim.flight.signals import EXCITATION

    return tuple(name.removeprefix(EXCITATION) for name in signals.excitations)


def _inputs(arguments: argparse.Namespace, signals: "Signals", pairs: list[tuple[str, str]]) -> list[str]:
    """All inputs that are taken together."""
    asked = list(dict.fromkeys(name for name, _ in pairs))
    others = arguments.inputs or _excited(signals)
    if not others and arguments.file.suffix.lower() != ".csv":
        others = signals.moving_controls
    return list(dict.fromkeys([*asked, *others]))


def _references(arguments: argparse.Namespace, signals: "Signals", inputs: list[str]) -> list[str]:
    """Excitations of the inputs, if they are to be the references."""
    from sbs_sim.flight.signals import EXCITATION

    named = arguments.references or [EXCITATION + name for name in inputs]
    if arguments.feedback == DIRECT:
        return []
    if arguments.feedback == AUTO and not arguments.references and not set(named) <= set(signals.values):
        return []
    return list(named)


def _identified(
    arguments: argparse.Namespace,
    signals: "Signals",
    craft: "Aircraft | None",
    pairs: list[tuple[str, str]],
    inputs: list[str],
) -> "list[Identified]":
    """All responses with what is shown beside them."""
    from sbs_sim.analysis.identification_plots import Identified
    from sbs_sim.analysis.transfer_fit import fit_transfer

    found = _estimated(arguments, signals, pairs, inputs)
    model = None
    if craft is not None and (arguments.linear or arguments.airspeed is not None):
        from sbs_sim.analysis.linearize import linearize

        speed = arguments.airspeed
        model = linearize(craft, airspeed=_mean_airspeed(signals) if speed is None else speed)
    every = []
    for pair in pairs:
        own = found[pair]
        beside = None if model is None else model.frequency_response(*pair, own.frequencies)
        orders = {"delay": arguments.fit_delay, "integrators": arguments.integrators}
        fits = tuple(fit_transfer(own, zeros, poles, **orders) for zeros, poles in arguments.fit)
        every.append(Identified(own, beside, fits))
    return every


def _estimated(
    arguments: argparse.Namespace, signals: "Signals", pairs: list[tuple[str, str]], inputs: list[str]
) -> "dict[tuple[str, str], IdentifiedResponse]":
    """Responses by input and output."""
    import numpy as np

    from sbs_sim.analysis.identification import identify, usual_range

    outputs, references = list(dict.fromkeys(output for _, output in pairs)), _references(arguments, signals, inputs)
    if arguments.period is not None:
        from sbs_sim.analysis.identification_periods import identify_periods

        if arguments.windows or arguments.low is not None or arguments.high is not None:
            raise UsageError("--windows, --low, --high: not with --period, which has its own frequencies")
        return identify_periods(signals, inputs, outputs, arguments.period, references=references)
    low, high = usual_range(signals)
    low = low if arguments.low is None else arguments.low
    high = high if arguments.high is None else arguments.high
    if not (0.0 < low < high and 2 <= arguments.points <= 10_000):
        raise UsageError(
            f"--low {low:g}, --high {high:g}, --points {arguments.points}: allowed are 0 < low < high, 2 on"
        )
    return identify(
        signals,
        inputs,
        outputs,
        references=references,
        frequencies=np.geomspace(low, high, arguments.points),
        windows=arguments.windows,
        method=arguments.method,
    )


def _mean_airspeed(signals: "Signals") -> float:
    """Horizontal velocity along the heading [m/s], to 0.1 m/s: the airspeed in still air."""
    pitch, u, w = (float(signals.values[name].mean()) for name in ("theta", "u", "w"))
    return round(u * math.cos(pitch) + w * math.sin(pitch), 1) + 0.0
