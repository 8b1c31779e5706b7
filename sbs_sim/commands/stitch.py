"""`stitch`: one nonlinear model of the linear models of a sweep, as a file, with its errors."""

import argparse
import math
from typing import TYPE_CHECKING

from sbs_sim.commands.common import (
    OUTSIDE,
    UsageError,
    add_aircraft_arguments,
    aircraft,
    execute,
    fixed,
    print_table,
)
from sbs_sim.output.warnings_text import joined
from sbs_sim.terminal.command_line import Parser
from sbs_sim.terminal.progress import progress_bar

if TYPE_CHECKING:
    from sbs_sim.flight.stitched import StitchedModel

MAX_ANCHORS = 200
AXES = ("heave", "roll", "pitch", "yaw")
SUFFIXES = (".npz",)


def main() -> int:
    """Executable `stitch`."""
    return execute(make_parser(), _work)


def make_parser() -> Parser:
    """Command line of `stitch`."""
    parser = Parser(
        "stitch",
        example="stitch -4 20 13 --states body --out sbs.npz",
        usage="%(prog)s (START STOP COUNT | --airspeeds X [X ...]) [options]",
        description="Stitch trims and linear models at airspeeds to one nonlinear model, and compare it with the full"
        " one halfway between them and in manoeuvres: acceleration, quick stop, turn.",
    )
    parser.add_argument(
        "range", nargs="*", type=float, metavar="START STOP COUNT", help="COUNT evenly spaced airspeeds [m/s]"
    )
    parser.add_argument("--airspeeds", nargs="+", type=float, metavar="X", help="airspeeds instead of a range [m/s]")
    parser.add_argument(
        "--climb-rates", nargs="+", type=float, default=[0.0], metavar="X", help="climb rates [m/s] (default: 0)"
    )
    add_aircraft_arguments(parser)
    group = parser.add_argument_group("fidelity")
    group.add_argument(
        "--states",
        nargs="+",
        default=["all"],
        metavar="STATE",
        help="what is kept besides the body: all, body for nothing, or names of states; the others have settled"
        " (default: all)",
    )
    group.add_argument("--no-lead-lag", dest="lead_lag", action="store_false", help="hold the blades at zero lag")
    group.add_argument(
        "--no-cyclic-inflow", dest="cyclic_inflow", action="store_false", help="hold the cyclic inflow at zero"
    )
    group.add_argument(
        "--azimuth-count", type=int, default=12, metavar="N", help="number of azimuths to average over (default: 12)"
    )
    group = parser.add_argument_group("work and output")
    group.add_argument("--workers", type=int, metavar="N", help="threads (default: one for each core)")
    group.add_argument("--no-check", dest="check", action="store_false", help="leave the comparison out")
    group.add_argument("--out", metavar="FILE", help="write the model to this file: .npz")
    return parser


def _work(arguments: argparse.Namespace) -> None:
    """Stitch, print and write."""
    from sbs_sim.analysis.stitched import errors_between, stitch
    from sbs_sim.flight.stitched_file import save
    from sbs_sim.output.files import check_target

    airspeeds = _airspeeds(arguments)
    if arguments.out is not None:
        check_target(arguments.out, SUFFIXES)
    craft = aircraft(arguments)
    states = arguments.states[0] if arguments.states in (["all"], ["body"]) else arguments.states
    fidelity = {name: getattr(arguments, name) for name in ("lead_lag", "cyclic_inflow", "azimuth_count")}
    count = len(airspeeds) * len(arguments.climb_rates)
    with progress_bar(" anchors", count) as progress:
        model = stitch(
            craft,
            airspeeds,
            climb_rates=arguments.climb_rates,
            states=states,
            workers=arguments.workers,
            progress=progress,
            **fidelity,
        )
    _print_model(model)
    if arguments.check:
        print()
        _print_errors(errors_between(model))
        print()
        _print_manoeuvres(model)
    if arguments.out is not None:
        save(model, arguments.out)
        print(f"written: {arguments.out}")


def _airspeeds(arguments: argparse.Namespace) -> list[float]:
    if arguments.airspeeds is not None:
        if arguments.range:
            raise UsageError("allowed are START STOP COUNT or --airspeeds, not both")
        return list(arguments.airspeeds)
    if len(arguments.range) != 3:
        raise UsageError("needed are START STOP COUNT, or --airspeeds")
    start, stop, count = arguments.range
    if not (2 <= count <= MAX_ANCHORS and count == int(count)):
        raise UsageError(f"COUNT = {count:g}: allowed are integers from 2 to {MAX_ANCHORS}")
    return [start + (stop - start) * i / (int(count) - 1) for i in range(int(count))]


def _print_model(model: "StitchedModel") -> None:
    """What was stitched."""
    rows, anchors = model.residuals.shape
    climbs = "" if rows == 1 else f" and {rows} climb rates, {model.climb_rates[0]:g} to {model.climb_rates[-1]:g} m/s"
    print(
        f"stitched model of {model.aircraft.name}: {anchors} airspeeds, {model.airspeeds[0]:g} to"
        f" {model.airspeeds[-1]:g} m/s{climbs}"
    )
    print(
        f"{len(model.state_names)} states, {len(model.inputs)} swashplate angles; residual of the trims"
        f" {model.residuals.max():.1e}; fastest pole {model.fastest:.1f} rad/s"
    )
    for text in joined(model.warnings):
        print(f"{OUTSIDE}: {text}")


def _print_manoeuvres(model: "StitchedModel") -> None:
    """Errors in manoeuvres, a row each."""
    from sbs_sim.pilot.stitched_check import manoeuvre_differences

    print("manoeuvres under the same pilot, largest differences from the full model:")
    rows = [
        [
            one.name,
            fixed(one.duration, 1),
            fixed(math.degrees(one.pitch), 0),
            fixed(math.degrees(one.roll), 0),
            fixed(one.velocity, 3),
            fixed(math.degrees(one.attitude), 3),
            fixed(math.degrees(one.controls), 3),
            fixed(100.0 * one.power, 1),
        ]
        for one in manoeuvre_differences(model)
    ]
    headings = (
        *("", "time [s]", "pitches [deg]", "rolls [deg]", "velocity [m/s]", "attitude [deg]", "controls [deg]"),
        "power [%]",
    )
    print_table(headings, rows)


def _print_errors(errors: "list[dict[str, float]]") -> None:
    """Errors halfway between anchors, a row each."""
    print("against the full model, halfway between the airspeeds:")
    rows = [
        [
            f"{row['airspeed']:g}",
            f"{row['climb_rate']:g}",
            f"{row['acceleration']:.1e}",
            f"{row['angular_acceleration']:.1e}",
            fixed(row["attitude_deg"], 4),
            fixed(row["control_deg"], 4),
            f"{row['derivatives']:.1e}",
            *(fixed(100.0 * row.get(f"{axis}_response", math.nan), 1) for axis in AXES),
        ]
        for row in errors
    ]
    headings = [
        *("airspeed [m/s]", "climb [m/s]", "trim [m/s²]", "trim [rad/s²]", "attitude [deg]", "controls [deg]", "A, B"),
        *(f"{axis} [%]" for axis in AXES),
    ]
    print_table(headings, rows, left=())
