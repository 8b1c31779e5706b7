"""`gusts`: the hover hold, and how it holds its position in turbulence and gusts."""

import argparse
import math
from typing import TYPE_CHECKING, Any

from sbs_sim.commands.air_arguments import add_air_arguments, air_fields
from sbs_sim.commands.common import (
    DEGREES,
    OUTSIDE,
    UsageError,
    add_aircraft_arguments,
    aircraft,
    execute,
    fixed,
    print_table,
)
from sbs_sim.terminal.command_line import Parser

if TYPE_CHECKING:
    from sbs_sim.aircraft import Aircraft
    from sbs_sim.analysis.linear_model import LinearModel
    from sbs_sim.model.gust_table import GustTable
    from sbs_sim.model.wind import Wind
    from sbs_sim.pilot.hover_hold import HoverHoldDesign

GUST_DELAY, AFTER_GUST = 1.0, 12.0  # s before a gust, and after it
SETTLING = 10.0  # s, in which the integrals learn the steady wind; not in the figures
POSITION = ("north", "east", "down")
MAX_DURATION = 3600.0  # s


def main() -> int:
    """Executable `gusts`."""
    return execute(make_parser(), _work)


def make_parser() -> Parser:
    """Command line of `gusts`."""
    parser = Parser(
        "gusts",
        example="gusts --limit forward=0.3 --limit heading_deg=5",
        description="Design the hover hold, print its gains, poles and margins, and fly it in turbulence and in"
        " 1-cosine gusts, with the nonlinear model.",
    )
    add_aircraft_arguments(parser)
    group = parser.add_argument_group("air")
    for name, default, meaning in (
        ("--wind", 4.0, "steady wind from ahead [m/s]"),
        ("--turbulence", 1.5, "standard deviation of the Dryden turbulence, of each component [m/s]"),
        ("--length", 50.0, "its scale length [m]"),
        ("--gust", 5.0, "peak of the gusts: from ahead, from the left, from above [m/s]"),
        ("--gust-duration", 2.0, "their length [s]"),
    ):
        group.add_argument(name, type=float, default=default, metavar="X", help=f"{meaning} (default: {default:g})")
    add_air_arguments(group)
    group.add_argument(
        "--rule",
        choices=("cs25", "cs27", "cs29"),
        help="gusts of this rule in place of --gust, which drift over the aircraft with the steady wind",
    )
    group.add_argument("--gradient", type=float, metavar="X", help="gradient distance of --rule [m]")
    group.add_argument("--seed", type=int, default=0, metavar="N", help="seed of the turbulence (default: 0)")
    group = parser.add_argument_group("flight")
    group.add_argument(
        "--duration", type=float, default=60.0, metavar="T", help="flight in turbulence [s] (default: 60)"
    )
    group.add_argument("--delay", type=int, default=0, metavar="N", help="delay of the controls [ticks] (default: 0)")
    group.add_argument(
        "--limit",
        action="append",
        default=[],
        type=_limit,
        metavar="NAME=VALUE",
        help="deviation with unit cost, such as forward=0.3 [m, m/s] or heading_deg=5; may be repeated",
    )
    parser.add_argument("--json", metavar="FILE", help="write the results")
    return parser


def _limit(text: str) -> tuple[str, float]:
    name, _, value = text.partition("=")
    plain = name.removesuffix("_deg")
    try:
        return plain, float(value) if plain == name else math.radians(float(value))
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r}: allowed is NAME=VALUE, for example forward=0.3") from None


def _work(arguments: argparse.Namespace) -> None:
    from sbs_sim.analysis.linearize import linearize
    from sbs_sim.output.files import check_target, write
    from sbs_sim.output.json_text import to_json
    from sbs_sim.output.warnings_text import joined
    from sbs_sim.pilot.hover_hold import HoverModel, design
    from sbs_sim.pilot.piloted_flight import MAX_DELAY

    if not 0 <= arguments.delay <= MAX_DELAY:
        raise UsageError(f"--delay {arguments.delay}: allowed are 0 to {MAX_DELAY} ticks")
    if not 1.0 <= arguments.duration <= MAX_DURATION:
        raise UsageError(f"--duration {arguments.duration:g}: allowed are 1 to {MAX_DURATION:g} s")
    check_target(arguments.json)
    craft = aircraft(arguments)
    airs = _airs(arguments, craft)
    model = linearize(craft)
    found = design(HoverModel.of(model), dict(arguments.limit))
    print(f"hover hold of {craft.name}")
    print("\n".join(found.describe()))
    results, warnings = {}, {}
    for name, (air, settling, duration) in airs.items():
        flight = _flown(craft, model, found, air, settling + duration, arguments.delay)
        results[name], warnings[name] = _figures(craft, flight, settling), joined(flight.warnings)
    _print(results)
    for name, lines in warnings.items():
        for line in lines:
            print(f"{name}: {line if line.startswith('clipped') else f'{OUTSIDE}: {line}'}")
    if arguments.json:
        results_with_warnings = {name: {**figures, "warnings": warnings[name]} for name, figures in results.items()}
        write(arguments.json, to_json(results_with_warnings))


def _airs(arguments: argparse.Namespace, craft: "Aircraft") -> dict[str, tuple["Wind", float, float]]:
    """What is flown in, for how long before figures are taken, and for how long with them [s]."""
    from sbs_sim.model.wind import MIN_TURBULENCE_AIRSPEED, Wind

    fields = {
        "velocity": (-arguments.wind, 0.0, 0.0),
        "turbulence_intensity": (arguments.turbulence,) * 3,
        "turbulence_length": arguments.length,
        "turbulence_airspeed": max(abs(arguments.wind), MIN_TURBULENCE_AIRSPEED),
        "turbulence_seed": arguments.seed,
    }
    name = (
        f"turbulence {arguments.turbulence:g} m/s" if arguments.severity is None else f"{arguments.severity} turbulence"
    )
    fields |= air_fields(arguments, craft)
    own_gust = fields.pop("own_gust", None)
    airs = {name: (Wind(**fields), SETTLING, arguments.duration)}
    if own_gust is not None:
        airs["own gust"] = _own_gust(arguments, own_gust)
    if (arguments.rule is None) != (arguments.gradient is None):
        raise UsageError("--rule, --gradient: allowed are both or neither")
    if arguments.rule is not None:
        return airs | _rule_gusts(arguments)
    size = arguments.gust
    for name, peak in (("ahead", (-size, 0.0, 0.0)), ("left", (0.0, size, 0.0)), ("above", (0.0, 0.0, size))):
        gust = Wind(gust=peak, gust_delay=GUST_DELAY, gust_duration=arguments.gust_duration)
        airs[f"gust {size:g} m/s, {name}"] = (gust, 0.0, GUST_DELAY + arguments.gust_duration + AFTER_GUST)
    return airs


def _own_gust(arguments: argparse.Namespace, table: "GustTable") -> tuple["Wind", float, float]:
    """A gust of --gust-file in the steady wind, after the integrals have settled."""
    from sbs_sim.model.gust_table import DISTANCE
    from sbs_sim.model.wind import Wind

    begin, wind, passing = SETTLING + GUST_DELAY, arguments.wind, max(float(table.positions[-1]), 0.0)
    if table.over == DISTANCE:
        _check_passing(arguments, "the gust of --gust-file")
        passing /= wind
    air = Wind(velocity=(-wind, 0.0, 0.0), own_gust=table, gust_delay=begin, gust_distance=wind * begin)
    return air, SETTLING, GUST_DELAY + passing + AFTER_GUST


def _check_passing(arguments: argparse.Namespace, what: str) -> None:
    """Raise UsageError for a steady wind that does not take gusts over an aircraft which holds its position."""
    from sbs_sim.model.wind import MIN_TURBULENCE_AIRSPEED

    if not arguments.wind >= MIN_TURBULENCE_AIRSPEED:
        allowed = f"at least {MIN_TURBULENCE_AIRSPEED:g} m/s, which takes {what} over the aircraft"
        raise UsageError(f"--wind {arguments.wind:g}: allowed is {allowed}")


def _rule_gusts(arguments: argparse.Namespace) -> dict[str, tuple["Wind", float, float]]:
    """Gusts of a rule that arrive after the integrals have settled."""
    from sbs_sim.flight.gust_standards import certification_gust
    from sbs_sim.model.wind import Wind

    _check_passing(arguments, "the gusts of --rule")
    airs = {}
    for name, to in (("ahead", "back"), ("left", "right"), ("above", "down"))[2 if arguments.rule == "cs27" else 0 :]:
        gust = certification_gust(arguments.rule, to=to, gradient=arguments.gradient)
        distance = arguments.wind * (SETTLING + GUST_DELAY)
        air = Wind(velocity=(-arguments.wind, 0.0, 0.0), gust_distance=distance, **gust)
        passing = gust["gust_length"] / arguments.wind
        airs[f"{arguments.rule}, {name}"] = (air, SETTLING, GUST_DELAY + passing + AFTER_GUST)
    return airs


def _flown(
    craft: "Aircraft", model: "LinearModel", found: "HoverHoldDesign", air: "Wind", duration: float, delay: int
) -> Any:
    from sbs_sim.pilot.hover_hold import HoverHold
    from sbs_sim.pilot.piloted_flight import simulate_with_pilot

    return simulate_with_pilot(craft, model.trim, HoverHold(found).controls, duration, wind=air, delay=delay)


def _figures(craft: "Aircraft", flight: Any, settling: float) -> dict[str, float]:
    """Errors of position [m] and heading [rad], and motion of the controls of the axes [rad], from a time [s] on."""
    import numpy as np

    used = flight["time"] >= settling
    error = np.stack([flight[name][used] for name in POSITION])
    distance = np.linalg.norm(error, axis=0)
    w, x, y, z = (flight[name][used] for name in ("qw", "qx", "qy", "qz"))
    heading = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))  # as quaternion_to_euler
    figures = {f"rms_{name}": _rms(row) for name, row in zip(POSITION, error, strict=True)}
    figures |= {"rms_distance": _rms(distance), "largest_distance": float(distance.max())}
    figures |= {"rms_heading": _rms(heading)}
    spread = flight["controls"][used].std(axis=0)
    return figures | {f"std_{craft.control_names[i]}": float(spread[i]) for i in craft.axis_controls}


def _rms(values: Any) -> float:
    return math.sqrt(float((values**2).mean()))


def _print(results: dict[str, dict[str, float]]) -> None:
    print("\nerror of position [m], RMS, and of heading [deg], RMS; standard deviation of the controls [deg]")
    headings = ["", *POSITION, "all", "largest", "heading", "coll.", "lat.", "long.", "diff."]
    rows = []
    for name, figures in results.items():
        values = list(figures.values())
        in_degrees = [DEGREES * value for value in values[5:]]
        rows.append([name, *(fixed(value, 3) for value in values[:5]), *(fixed(value, 2) for value in in_degrees)])
    print_table(headings, rows)
