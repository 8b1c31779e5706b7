"""`sweep`: trims and modes along one parameter, as a table, plots and files."""

import argparse
import math
from typing import TYPE_CHECKING

from sbs_sim.commands.common import (
    OUTSIDE,
    UsageError,
    add_flight_arguments,
    add_guess_argument,
    add_worker_arguments,
    aircraft,
    execute,
    execution,
    fixed,
    flight,
    guess,
    print_table,
    radians,
)
from sbs_sim.errors import AircraftError, SbsError, SweepError
from sbs_sim.terminal.command_line import Parser, suggestion
from sbs_sim.terminal.progress import progress_bar

if TYPE_CHECKING:
    from sbs_sim.aircraft import Aircraft
    from sbs_sim.analysis.sweep import Sweep, SweepPoint
    from sbs_sim.analysis.sweep_map import SweepMap

# As they are typed, and the names of `sbs_sim.analysis.sweep`; all other parameters are paths.
TYPED = {
    "airspeed": "airspeed",
    "climb_rate": "climb_rate",
    "sideslip_deg": "sideslip",
    "turn_rate_deg": "turn_rate",
}
MAX_POINTS = 100_000
MAX_REMARKS = 5  # of a map


def main() -> int:
    """Executable `sweep`."""
    return execute(make_parser(), _work)


def make_parser() -> Parser:
    """Command line of `sweep`."""
    parser = Parser(
        "sweep",
        example="sweep airspeed -5 20 41 --out plots --csv sweep.csv",
        usage="%(prog)s PARAMETER (START STOP COUNT | --values X [X ...]) [--over PARAMETER START STOP COUNT]"
        " [options]",
        description="Trim and linearize an aircraft along one parameter, or over two as a map, on all cores or on a"
        " cluster.",
    )
    parser.add_argument(
        "parameter",
        metavar="PARAMETER",
        help=f"{', '.join(TYPED)}, or the path of a value of the aircraft file: body.mass, rotors.blade_mass (of every"
        " rotor), rotors[0].radius",
    )
    parser.add_argument(
        "range", nargs="*", type=float, metavar="START STOP COUNT", help="COUNT evenly spaced values from START to STOP"
    )
    parser.add_argument("--values", nargs="+", type=float, metavar="X", help="values instead of a range")
    parser.add_argument(
        "--over",
        nargs=4,
        metavar=("PARAMETER", "START", "STOP", "COUNT"),
        help="a second parameter, for a map over both: power, distance of the controls from their ends, attitude,"
        " controls, fastest growth of a mode",
    )
    add_flight_arguments(parser)
    add_guess_argument(parser)
    group = parser.add_argument_group("work and output")
    group.add_argument("--trims-only", dest="linear", action="store_false", help="compute trims without linear models")
    add_worker_arguments(group)
    group.add_argument("--out", metavar="DIR", help="write plots as PNG and SVG into this folder")
    group.add_argument("--csv", metavar="FILE", help="write a table of trims and poles, in SI units and radians")
    group.add_argument("--json", metavar="FILE", help="write all trims and models, in SI units and radians")
    return parser


def _work(arguments: argparse.Namespace) -> None:
    parameter, values = _parameter(arguments, arguments.parameter, _values(arguments))
    from sbs_sim.output.files import check_target

    check_target(arguments.csv)
    check_target(arguments.json)
    craft = aircraft(arguments)
    _check_parameter(craft, arguments.parameter, parameter)
    if arguments.over is not None:
        _map(arguments, craft, (parameter, values))
    else:
        _sweep(arguments, craft, parameter, values)


def _sweep(arguments: argparse.Namespace, craft: "Aircraft", parameter: str, values: list[float]) -> None:
    """Along one parameter."""
    from sbs_sim.analysis.export import sweep_to_csv
    from sbs_sim.analysis.sweep import sweep_flights
    from sbs_sim.output.files import write
    from sbs_sim.output.json_text import to_json

    with progress_bar(" points", len(values)) as progress:
        found = sweep_flights(
            craft,
            parameter,
            values,
            *flight(arguments),
            execution(arguments, progress),
            guess=guess(arguments, craft),
            linear=arguments.linear,
        )
    _print_sweep(found)
    if arguments.csv:
        write(arguments.csv, sweep_to_csv(found))
    if arguments.json:
        write(arguments.json, to_json(found.to_dict()))
    if arguments.out:
        from sbs_sim.analysis.sweep_plots import save_plots

        for path in save_plots(found, arguments.out):
            print(f"written: {path}")
    if len(found.failed) == len(found.points):
        raise SweepError("no point of the sweep has a trim")


def _map(arguments: argparse.Namespace, craft: "Aircraft", first: tuple[str, list[float]]) -> None:
    """Over two parameters."""
    if arguments.guess_deg is not None or arguments.json:
        raise UsageError("--guess-deg, --json: not allowed with --over")
    from sbs_sim.analysis.sweep_map import sweep_map
    from sbs_sim.output.files import write

    given, *numbers = arguments.over
    try:
        start, stop, count = map(float, numbers)
    except ValueError:
        raise UsageError(f"--over {' '.join(arguments.over)}: START, STOP and COUNT are numbers") from None
    second = _parameter(arguments, given, _spaced(start, stop, count))
    _check_parameter(craft, given, second[0])
    with progress_bar(" points", len(first[1]) * len(second[1])) as progress:
        found = sweep_map(
            craft, first, second, *flight(arguments), execution(arguments, progress), linear=arguments.linear
        )
    _print_map(found)
    if arguments.csv:
        write(arguments.csv, found.to_csv())
    if found.missing.all():
        raise SweepError("no point of the map has a trim")
    if arguments.out:
        from sbs_sim.analysis.sweep_map_plots import save_map

        for path in save_map(found, arguments.out):
            print(f"written: {path}")


def _parameter(arguments: argparse.Namespace, given: str, values: list[float]) -> tuple[str, list[float]]:
    """Parameter as it was typed, as the library calls it, with its values in SI units and radians."""
    typed = given.replace("-", "_")
    if f"{typed}_deg" in TYPED:
        raise UsageError(f"parameter {typed}: angles are typed in degrees, as {typed}_deg")
    if getattr(arguments, typed, None) is not None and typed in TYPED:
        raise UsageError(f"--{typed.replace('_', '-')}: not allowed where {typed} is swept")
    if typed.endswith("_deg") and typed in TYPED:
        values = [math.radians(value) for value in values]
    return TYPED.get(typed, given), values


def _check_parameter(craft: "Aircraft", given: str, parameter: str) -> None:
    """Raise SweepError for what is no parameter, with those that can be typed."""
    typed = given.replace("-", "_")
    if typed in TYPED or parameter in TYPED.values():
        return
    try:
        craft.value(given)
    except AircraftError as error:
        near = suggestion(typed, [*TYPED, *(f"{part}.{key}" for part, key in _keys(craft))])
        allowed = f"allowed are {', '.join(TYPED)} or a path{near}"
        raise SweepError(f"parameter {given!r}: {allowed}; {error}") from None


def _keys(craft: "Aircraft") -> list[tuple[str, str]]:
    """Parts of the aircraft file with their keys."""
    parts = {name: part for name, part in craft.data.items() if isinstance(part, dict)}
    return [(name, key) for name, part in {**parts, "rotors": craft.data["rotors"][0]}.items() for key in part]


def _values(arguments: argparse.Namespace) -> list[float]:
    if arguments.values is not None:
        if arguments.range:
            raise UsageError("allowed are START STOP COUNT or --values, not both")
        return list(arguments.values)
    if len(arguments.range) != 3:
        raise UsageError("needed are START STOP COUNT, or --values")
    return _spaced(*arguments.range)


def _spaced(start: float, stop: float, count: float) -> list[float]:
    if not (1 <= count <= MAX_POINTS and count == int(count)):
        raise UsageError(f"COUNT = {count:g}: allowed are integers from 1 to {MAX_POINTS}")
    steps = max(int(count) - 1, 1)
    return [start + (stop - start) * i / steps for i in range(int(count))]


def _print_sweep(found: "Sweep") -> None:
    """One row for each point, and below the errors."""
    import numpy as np

    from sbs_sim.output.units import RPM, label
    from sbs_sim.output.units import shown as shown_values
    from sbs_sim.output.warnings_text import joined

    shown, unit = found.shown
    columns = {"pitch": "rad", "roll": "rad", **found.controls}
    angles = [shown_values(found[name], unit)[0] for name, unit in columns.items()]
    power = found["power"].sum(axis=1)
    speeds = found["rotor_speed"] * RPM if found.has_free_speeds else np.empty((len(power), 0))
    rows = []
    for i, point in enumerate(found.points):
        row = [f"{shown[i]:.6g}"]
        if point.trim is None:
            row += ["-"] * (len(angles) + speeds.shape[1] + 1) + ["no trim, see below"]
        else:
            row += [fixed(angle[i], 3) for angle in angles]
            row += [fixed(speed, 1) for speed in speeds[i].tolist()]
            row += [fixed(power[i], 1), _growing(point)]
        rows.append(row)
    short = (label(name.removesuffix("_cyclic").removesuffix("_longitudinal"), unit) for name, unit in columns.items())
    headings = [f"{found.parameter} [{unit}]" if unit else found.parameter, *short]
    headings += [f"rotor {j + 1} [rpm]" for j in range(speeds.shape[1])]
    print_table([*headings, "power [W]", "growing modes"], rows, left=(len(headings) + 1,))
    for value, point in zip(shown, found.points, strict=True):
        if point.error is not None:
            print(f"{found.parameter} {value:g}: {_error(found, value, point)}")
        elif point.trim is not None and point.trim.beyond_limits:
            print(f"{found.parameter} {value:g}: beyond its limits: {'; '.join(point.trim.beyond_limits)}")
        if point.warnings:
            print(f"{found.parameter} {value:g}: {OUTSIDE}: {'; '.join(joined(point.warnings))}")


def _print_map(found: "SweepMap") -> None:
    """A table of each quantity, rows over the second parameter, and where the model does not hold."""
    from sbs_sim.output.units import label
    from sbs_sim.output.warnings_text import joined

    (x, first), (y, second) = found.axes
    heading = [f"{label(found.other, second)} \\ {label(found.parameter, first)}", *(f"{value:.6g}" for value in x)]
    for name, (values, unit) in found.quantities.items():
        print(label(name.replace("_", " "), unit))
        digits = 0 if name == "power" else 2
        rows = []
        for value, row, doubt in zip(y, values, found.doubtful, strict=True):
            cells = [
                "-" if math.isnan(one) else fixed(one, digits) + "*" * bool(d)
                for one, d in zip(row, doubt, strict=True)
            ]
            rows.append([f"{value:.6g}", *cells])
        print_table(heading, rows)
        print()
    lines = dict.fromkeys(text for point in found.points if point.trim for text in joined(point.trim.warnings))
    limits = dict.fromkeys(text for point in found.points if point.trim for text in point.trim.beyond_limits)
    for mark, texts in ((OUTSIDE, lines), ("beyond its limits", limits)):
        for text in list(texts)[:MAX_REMARKS]:
            print(f"* {mark}: {text}")
        if len(texts) > MAX_REMARKS:
            print(f"* {mark}: and {len(texts) - MAX_REMARKS} more, see --csv")
    for text in list(dict.fromkeys(point.error for point in found.points if point.error))[:MAX_REMARKS]:
        print(f"- {text}")


def _error(found: "Sweep", shown: float, point: "SweepPoint") -> str:
    """What is wrong with a point; with an angle that was typed in degrees, in degrees."""
    try:
        if f"{found.parameter}_deg" in TYPED:
            radians(found.parameter, shown)
    except SbsError as error:
        return str(error)
    return point.error or ""


def _growing(point: "SweepPoint") -> str:
    """Modes that grow, or why they are not known."""
    if point.model is None:
        return "" if point.error else "two blades: no linear model"
    return "; ".join(mode.name for mode in point.model.modes if mode.is_growing)
