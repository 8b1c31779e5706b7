"""Command `plot`: recorded flights over time, over one another, flown again, and beside a linear model."""

import argparse
import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sbs_sim.commands.common import UsageError, add_set_argument, execute, print_table
from sbs_sim.terminal.command_line import Parser

if TYPE_CHECKING:
    from sbs_sim.recording import Log
    from sbs_sim.recording.overlay import Flown

AIR = ("velocity", "gust", "turbulence_intensity")  # of a wind


def main() -> None:
    """Draw what the command line names."""
    sys.exit(execute(make_parser(), _work))


def make_parser() -> Parser:
    """Command line of `plot`."""
    parser = Parser(
        "plot",
        example="plot bags/hover_step.mcap --resimulate --set body.mass=22 --out hover_step.html",
        description="Draw recorded flights over time: one, several over one another, one flown again from its events,"
        " and the linear model of its start for its inputs.",
    )
    parser.add_argument(
        "file", type=Path, nargs="+", help="MCAP log; the next ones are drawn over the first, at most four flights"
    )
    parser.add_argument(
        "--out",
        type=Path,
        action="append",
        metavar="FILE",
        help=".png, .svg or .html; may be repeated (default: the log's name with .png)",
    )
    parser.add_argument(
        "--flight", type=int, metavar="NUMBER", help="which flight of a file with several flights, from 1"
    )
    group = parser.add_argument_group("over the first log")
    group.add_argument("--resimulate", action="store_true", help="fly it again, from its start with its events")
    add_set_argument(group, "there with another value of the aircraft file; may be repeated")
    group.add_argument(
        "--azimuth-step-deg",
        type=float,
        metavar="X",
        help="there with steps of so much azimuth of the fastest rotor [deg] (default: those of the log)",
    )
    group.add_argument(
        "--linear",
        action="store_true",
        help="the linear model of the trim that is nearest to its start, for its inputs, in still air",
    )
    return parser


def _work(arguments: argparse.Namespace) -> None:
    from sbs_sim.output.files import check_target
    from sbs_sim.recording.plot import SUFFIXES, flown_of, plot

    if (arguments.set or arguments.azimuth_step_deg is not None) and not arguments.resimulate:
        raise UsageError("--set, --azimuth-step-deg: allowed with --resimulate")
    targets = arguments.out or [Path(f"{arguments.file[0].stem or 'log'}.png")]  # "." has no name
    for path in targets:
        check_target(path, SUFFIXES)
    log, *others = [_read(path, arguments.flight) for path in arguments.file]
    beside = [flown_of(other) for other in others]
    if arguments.resimulate:
        beside.append(_again(log, dict(arguments.set), arguments.azimuth_step_deg))
    if arguments.linear:
        beside.append(linear_beside(log))
    for path in targets:
        print(f"written: {plot(log, path, beside)}")
    for other in beside:
        _print_apart(flown_of(log), other)


def _read(path: Path, number: int | None) -> "Log":
    from sbs_sim.recording import read

    log = read(path).flight(number)
    if not log.complete:
        print(f"{path} is not complete: {'; '.join(log.reasons)}", file=sys.stderr)
    return log


def _again(log: "Log", changes: dict[str, Any], step_deg: float | None) -> "Flown":
    from sbs_sim.recording.overlay import flown_again
    from sbs_sim.recording.recorded_flight import flight_of

    return flown_again(flight_of(log), changes, math.radians(step_deg or 0.0))


def linear_beside(log: "Log") -> "Flown":
    """The linear model about the steady flight at the start of a log, flown with the controls of the log.

    Raises
    ------
    SbsError
        A log without a whole flight at equal intervals, in wind, with a reset or a failure on the way; an aircraft
        without a linear model.
    """
    import numpy as np

    from sbs_sim.analysis.linear_flight import linear_flight
    from sbs_sim.analysis.linearize import linearize_trim
    from sbs_sim.analysis.trim import solve_trim
    from sbs_sim.errors import LinearizationError
    from sbs_sim.flight.trim_point import Fidelity
    from sbs_sim.recording.flight_signals import signals_of_log
    from sbs_sim.recording.overlay import Flown, state_panels, without_place
    from sbs_sim.versions import versions

    signals, flown = signals_of_log(log)
    winds = [event.wind for event in flown.events if event.wind is not None]
    if any(wind.own_gust is not None or any(map(any, (getattr(wind, name) for name in AIR))) for wind in winds):
        raise LinearizationError(f"{log.path} has wind: --linear flies in still air")
    craft, first = flown.aircraft, flown.states[0]
    condition = condition_of(first)
    point = solve_trim(craft, condition, Fidelity(flown.options["lead_lag"], flown.options["cyclic_inflow"]))
    model = linearize_trim(craft, point)
    controls = signals.rows(craft.control_names).T
    states = linear_flight(model, craft.layout.to_linear(first), controls, signals.tick)
    known = np.isfinite(states).all(axis=1)
    states = states[: len(states) if known.all() else int(np.argmin(known))]
    time = signals.begin + signals.tick * np.arange(len(states), dtype=np.float64)
    rows = np.array([craft.layout.from_linear(row) for row in states])
    name = f"linear model at {condition.airspeed:.3g} m/s, climb {condition.climb_rate:.3g} m/s"
    facts = {"aircraft": craft.name, "parameter_hash": craft.parameter_hash, "step_size": repr(signals.tick)}
    return Flown(name, without_place(state_panels(craft, time, rows)), facts | versions())


def condition_of(state: Any) -> Any:
    """The steady flight that is nearest to a simulation state in still air: speeds along and across the heading, climb.

    Speeds of less than 1 mm/s are none.
    """
    from sbs_sim.flight.trim_point import TrimCondition
    from sbs_sim.model import state as S
    from sbs_sim.model.frames import quaternion_to_euler, rotation_matrix

    quaternion = state[S.ATTITUDE : S.VELOCITY]
    north, east, down = rotation_matrix(quaternion) @ state[S.VELOCITY : S.RATES]
    yaw = quaternion_to_euler(quaternion)[0]
    ahead = north * math.cos(yaw) + east * math.sin(yaw)
    right = east * math.cos(yaw) - north * math.sin(yaw)
    ahead, right, climb = (0.0 if abs(value) < 1e-3 else float(value) for value in (ahead, right, -down))
    if right == 0.0:
        return TrimCondition(ahead, climb)
    return TrimCondition(math.hypot(ahead, right), climb, math.atan2(right, ahead))


def _print_apart(one: "Flown", other: "Flown") -> None:
    """Largest differences, a row for each panel."""
    from sbs_sim.recording.overlay import apart

    rows = [[label, name, f"{most:.3g}", f"{when:.2f}"] for label, (name, most, when) in apart(one, other).items()]
    print(f"\n{other.name}: largest difference from {one.name}")
    print_table(["", "", "difference", "at [s]"], rows, left=(0, 1))
