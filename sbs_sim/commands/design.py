"""`design`: an envelope controller of an aircraft, with its margins, levels and what uncertainty leaves of them."""

import argparse
import math
import time
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from sbs_sim.commands.common import add_aircraft_arguments, aircraft, execute, fixed, print_table
from sbs_sim.terminal.command_line import Parser, assignment
from sbs_sim.terminal.progress import progress_bar

if TYPE_CHECKING:
    from sbs_sim.pilot.envelope_check import Checked, Sampled, Uncertainty

AXES = ("heave", "roll", "pitch", "yaw")


def main() -> int:
    """Executable `design`."""
    return execute(make_parser(), _work)


def make_parser() -> Parser:
    """Command line of `design`."""
    parser = Parser(
        "design",
        example="design uh60a_tm85890 --airspeeds 0 10 20 30 40 --out uh60a_gains.yaml",
        description="Design a controller that flies from hover to cruise and back: attitude, speed, height, heading,"
        " coordinated turns. Gains by LQR at each airspeed, the fastest that keep the margins; uncertain aircraft.",
    )
    parser.add_argument("name", nargs="?", metavar="AIRCRAFT", help="name or file, as --aircraft")
    add_aircraft_arguments(parser)
    group = parser.add_argument_group("design")
    group.add_argument(
        "--airspeeds",
        nargs="+",
        type=float,
        metavar="V",
        help="rising, in m/s (default: five from hover, to 20 m/s for a lateral span of 2.3 m, by Froude's scaling)",
    )
    for name, value, unit, meaning in (
        ("gain-margin", 6.0, "dB", "least gain margin at every control, up and down"),
        ("phase-margin", 45.0, "deg", "least phase margin at every control"),
        ("delay", 0.01, "s", "between a state and its controls, in ticks of 0.01 s"),
        ("lag", 0.02, "s", "time constant of the actuators"),
    ):
        group.add_argument(
            f"--{name}", type=float, default=value, metavar="X", help=f"{meaning} [{unit}] (default: {value:g})"
        )
    group.add_argument(
        "--limit",
        action="append",
        default=[],
        type=assignment,
        metavar="NAME=X",
        help="what is asked of the aircraft at most: acceleration, climb_acceleration [m/s^2], climb_speed,"
        " approach_speed [m/s], turn_rate_deg, turn_acceleration_deg, tilt_deg; may be repeated",
    )
    group = parser.add_argument_group("uncertainty")
    group.add_argument("--samples", type=int, default=1000, metavar="N", help="uncertain aircraft (default: 1000)")
    group.add_argument("--seed", type=int, default=0, metavar="N", help="seed of their values (default: 0)")
    group.add_argument(
        "--uncertain",
        action="append",
        default=[],
        type=assignment,
        metavar="NAME=X",
        help="standard deviations of mass (default: 0.05), inertia (0.1), springs of the hinges (0.1), density (0.05),"
        " relative; largest delay and lag more [s] (0.02, 0.02); may be repeated",
    )
    group.add_argument("--workers", type=int, metavar="N", help="processes (default: one for each core)")
    group = parser.add_argument_group("output")
    group.add_argument("--out", metavar="FILE", help="write the gains to this file (.yaml), for batch and the node")
    group.add_argument("--json", metavar="FILE", help="also write all numbers to this file")
    return parser


def _work(arguments: argparse.Namespace) -> None:
    from sbs_sim.analysis.quality_limits import scales
    from sbs_sim.concurrency.parallel import Execution
    from sbs_sim.errors import PilotError
    from sbs_sim.output.files import check_target, write
    from sbs_sim.output.json_text import to_json
    from sbs_sim.pilot.envelope import Requirement
    from sbs_sim.pilot.envelope_check import design, nominal, sample
    from sbs_sim.pilot.envelope_file import SUFFIXES, save_envelope

    check_target(arguments.out, SUFFIXES)
    check_target(arguments.json)
    begin = time.perf_counter()
    if arguments.name is not None:
        arguments.aircraft = arguments.name
    craft = aircraft(arguments)
    scale = scales(craft)[0]
    limits, spread = _limits(arguments.limit), _uncertainty(arguments.uncertain)
    workers = Execution(arguments.workers).threads(PilotError)
    speeds = arguments.airspeeds or default_speeds(craft)
    found = design(
        craft,
        speeds,
        limits=limits,
        requirement=Requirement(arguments.gain_margin, arguments.phase_margin),
        delay=arguments.delay,
        lag=arguments.lag,
        spread=spread,
    )
    checked = nominal(found, craft, speeds)
    print(
        f"envelope controller of {craft.name}: {len(speeds)} airspeeds, {PERIOD_TEXT}, delay {found.delay * 10:g} ms,"
    )
    print(f"actuators {1e3 * found.lag:g} ms; levels of ADS-33E-PRF by {scale.text}")
    print_nominal(checked)
    if arguments.out:
        save_envelope(found, arguments.out)
        print(f"written: {arguments.out}")
    designed = time.perf_counter()
    sampled = None
    if arguments.samples:
        with progress_bar(" aircraft", arguments.samples) as progress:
            sampled = sample(found, craft, speeds, spread, arguments.samples, arguments.seed, workers, progress)
        print_sampled(sampled, spread)
    if arguments.json:
        content: dict[str, Any] = {"airspeeds": list(speeds), "nominal": [asdict(one) for one in checked]}
        if sampled is not None:
            content |= {name: sampled.values(name) for name in ("growth", "gain_up", "gain_down", "phase", "bandwidth")}
        write(arguments.json, to_json(content))
    end = time.perf_counter()
    print(f"designed in {designed - begin:.1f} s, {arguments.samples} uncertain aircraft in {end - designed:.1f} s")


PERIOD_TEXT = "100 Hz"


def default_speeds(craft: Any) -> list[float]:
    """Airspeeds of a design [m/s]."""
    from sbs_sim.analysis.qualities import default_airspeeds
    from sbs_sim.analysis.quality_limits import scales

    return default_airspeeds(scales(craft)[0])


def _limits(given: list[tuple[str, Any]]) -> Any:
    """What is asked of the aircraft at most."""
    from sbs_sim.pilot.envelope import Limits

    return _record(Limits, "limit", given)


def _uncertainty(given: list[tuple[str, Any]]) -> Any:
    """What is uncertain."""
    from sbs_sim.pilot.envelope_check import Uncertainty

    return _record(Uncertainty, "uncertain", given)


def _record(kind: Any, option: str, given: list[tuple[str, Any]]) -> Any:
    """A dataclass of numbers, with those that were given.

    Raises
    ------
    PilotError
        A name that it does not have.
    """
    from sbs_sim.errors import PilotError

    names = list(kind.__dataclass_fields__)
    for name, _ in given:
        if name not in names:
            raise PilotError(f"{option} {name}: unknown, allowed are {', '.join(names)}")
    return kind(**dict(given))


def print_nominal(checked: "list[Checked]") -> None:
    """Margins, bandwidths and levels at each airspeed."""
    print("\nmargins with one loop broken, the others closed: gain down / up [dB], phase [deg]")
    rows = []
    for one in checked:
        margins = zip(one.gain_down, one.gain_up, one.phase, strict=True)
        cells = [f"{_short(low)} / {_short(high)}, {_degrees(phase)}" for low, high, phase in margins]
        rows.append([f"{one.airspeed:g} m/s", *cells, fixed(one.disk, 2)])
    print_table(["", *AXES, "all, disk"], rows)
    print(
        "\nattitude commanded: bandwidth [rad/s] (level), phase delay [s]; disturbances: bandwidth [rad/s], peak [dB]"
    )
    rows = []
    for one in checked:
        cells = [f"{one.airspeed:g} m/s"]
        for k, axis in enumerate(("pitch", "roll")):
            level = one.levels[f"{axis} bandwidth"]
            cells.append(f"{_number(one.bandwidth[k])} ({level or '-'}), {_number(one.phase_delay[k])}")
        cells += [f"{_number(w)}, {fixed(peak, 1)}" for w, peak in zip(one.rejection, one.peak, strict=True)]
        rows.append([*cells, f"{fixed(one.damping, 2)} ({one.levels['oscillations'] or '-'})"])
    print_table(
        ["", "pitch", "roll", "pitch disturbed", "roll disturbed", "heading disturbed", "least damping (level)"], rows
    )


def print_sampled(sampled: "Sampled", spread: "Uncertainty") -> None:
    """What uncertainty leaves."""
    import numpy as np

    count = len(sampled.found)
    said = ", ".join(f"{name} {value:g}" for name, value in asdict(spread).items())
    print(f"\n{count} uncertain aircraft at each airspeed ({said}): worst of 95 %")
    gain = np.minimum(sampled.values("gain_up"), sampled.values("gain_down"))
    phase, bandwidth = np.degrees(sampled.values("phase")), sampled.values("bandwidth")
    growth, turning = sampled.values("growth"), sampled.values("growth_frequency")
    rows = []
    for k, airspeed in enumerate(sampled.airspeeds):
        low_gain, low_phase = (np.nanpercentile(values[:, k], 5.0, axis=0) for values in (gain, phase))
        cells = [f"{_short(a)} dB, {b:.0f} deg" for a, b in zip(low_gain, low_phase, strict=True)]
        widths = [_number(value) for value in np.nanpercentile(bandwidth[:, k], 5.0, axis=0)]
        level = max(sampled.worst_levels(k, 0.95).values())
        unstable, known = growth[:, k] >= 0.0, ~np.isnan(growth[:, k])
        remark = ""
        if unstable.any():
            worst = int(np.nanargmax(growth[:, k]))
            remark = f"{growth[worst, k]:.2g} 1/s at {turning[worst, k]:.3g} rad/s"
        stable = 100.0 * (known.sum() - unstable.sum()) / max(1, known.sum())
        rows.append([f"{airspeed:g} m/s", f"{stable:.1f} %", *cells, ", ".join(widths), f"{level or '-'}", remark])
    print_table(["", "stable", *AXES, "bandwidth pitch, roll", "level", "fastest growth"], rows)
    missing = int(np.isnan(growth).any(axis=1).sum())
    if missing:
        print(f"without a result, and not counted: {missing} of {count}; the first: {sampled.errors[0]}")


def _short(decibels: float) -> str:
    return "inf" if math.isinf(decibels) else fixed(decibels, 1)


def _degrees(angle: float) -> str:
    return "inf" if math.isinf(angle) else f"{math.degrees(angle):.0f}"


def _number(value: float) -> str:
    return "-" if math.isnan(value) else fixed(value, 2)
