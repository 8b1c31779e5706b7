"""`linearize`: linear model about a steady flight, its modes, and the options on which they depend."""

import argparse
import math
from typing import TYPE_CHECKING

from sbs_sim.commands.common import (
    add_flight_arguments,
    add_guess_argument,
    aircraft,
    execute,
    fixed,
    flight,
    guess,
    print_heading,
    print_limits,
    print_table,
)
from sbs_sim.terminal.command_line import Parser

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from sbs_sim.aircraft import Aircraft
    from sbs_sim.analysis.floquet import Floquet
    from sbs_sim.analysis.linear_model import LinearModel
    from sbs_sim.analysis.modes import Mode
    from sbs_sim.flight.trim_point import TrimPoint

LEADING = 3  # states named beside a mode
MIN_SHARE = 0.005  # of the participations that are listed
MIN_INSTANTS = 48  # of a period for the characteristic exponents
MAX_STEP = 0.25  # rad of the fastest mode
ROUNDING = 1e-13  # of a multiplier: what decays further in a period leaves no exponent
COLUMNS = 10  # of a matrix side by side


def main() -> int:
    """Executable `linearize`."""
    return execute(make_parser(), _work)


def make_parser() -> Parser:
    """Command line of `linearize`."""
    parser = Parser(
        "linearize",
        example="linearize --airspeed 10 --floquet --out model.npz",
        description="Linearize an aircraft and print its modes.",
    )
    add_flight_arguments(parser)
    add_guess_argument(parser)
    group = parser.add_argument_group("linear model")
    group.add_argument(
        "--method",
        choices=("averaged", "paper"),
        default="averaged",
        help="finite differences of the averaged model (default), or term by term as in the paper",
    )
    group.add_argument(
        "--quasi-static",
        action="store_true",
        help="reduce to the eight body states, with quasi-static rotors and inflow",
    )
    group = parser.add_argument_group("output")
    for name, meaning in (
        ("--matrices", "print A and B"),
        ("--derivatives", "print stability and control derivatives, rotors and inflow settled"),
        ("--participation", "print what takes part in each mode"),
        ("--floquet", "print the characteristic exponents of the periodic model beside the averaged poles"),
    ):
        group.add_argument(name, action="store_true", help=meaning)
    group.add_argument("--out", metavar="FILE", help="write the model to a .npz, .mat or .json file")
    parser.hidden(group, "--export", "--out")
    group.add_argument("--json", metavar="FILE", help="write the model to this file as JSON, in SI units and radians")
    return parser


def _work(arguments: argparse.Namespace) -> None:
    from sbs_sim.analysis.export import ENCODERS
    from sbs_sim.analysis.linear_model import growing_rotor_modes_text
    from sbs_sim.analysis.linearize import linearize_trim
    from sbs_sim.analysis.trim import solve_trim
    from sbs_sim.flight.two_blades import has_two_blades
    from sbs_sim.output.files import check_target, write
    from sbs_sim.output.json_text import to_json

    check_target(arguments.out, ENCODERS)
    check_target(arguments.json)
    craft = aircraft(arguments)
    if arguments.floquet:
        from sbs_sim.analysis.floquet import checked_period

        checked_period(craft)  # before the work
    point = solve_trim(craft, *flight(arguments), guess=guess(arguments, craft))
    wants_model = (
        arguments.out or arguments.json or arguments.participation or arguments.derivatives or arguments.matrices
    )
    if arguments.floquet and has_two_blades(craft) and not wants_model:  # there is no other linear model
        _print_exponents(craft, point)
        return
    full = linearize_trim(craft, point, method=arguments.method)
    model = full.quasi_static() if arguments.quasi_static else full
    _print_model(craft, model)
    print(f"growing rotor modes: {growing_rotor_modes_text(full, craft)}")
    if arguments.out:
        model.save(arguments.out)
    if arguments.json:
        write(arguments.json, to_json(model.to_dict()))
    if arguments.participation:
        _print_participation(model)
    if arguments.floquet:
        from sbs_sim.analysis.floquet import floquet

        _print_floquet(full, floquet(craft, full.trim, _azimuth_count(craft, full)))
    if arguments.derivatives:
        _print_derivatives(full)
    if arguments.matrices:
        _print_matrix("A", model.a, model.state_names, model.state_names)
        _print_matrix("B", model.b, model.state_names, model.control_names)


def _print_model(craft: "Aircraft", model: "LinearModel") -> None:
    """Modes, azimuth spread, hash."""
    print_heading("linear model", craft, model.trim)
    states = len(model.state_names)
    settled = ", rotors and inflow settled" if states == 8 else ""
    print(f"method {model.method}, {states} states{settled}, {len(model.control_names)} controls")
    print()
    rows = [
        [
            mode.name,
            *pole_cells(mode.pole),
            fixed(mode.frequency, 4),
            fixed(mode.damping, 4),
            _seconds(mode.time_to_half),
            _seconds(mode.time_to_double),
            ", ".join(f"{name} {share:.0%}" for name, share in _shares(model, mode)[:LEADING]),
        ]
        for mode in model.modes
    ]
    headings = ["mode", "real [rad/s]", "imaginary", "frequency", "damping", "half [s]", "double [s]", "leading states"]
    print_table(headings, rows, left=(0, 7))
    print()
    spread = model.azimuth_spread
    print("azimuth spread unknown from one azimuth" if spread != spread else f"azimuth spread {spread:.3g}")
    print(f"parameters {model.parameter_hash}")
    print_limits(model.trim)


def pole_cells(pole: complex) -> list[str]:
    """Real part, and imaginary part of a pair."""
    return [fixed(pole.real, 5), f"± {fixed(abs(pole.imag), 5)}" if pole.imag else ""]


def _seconds(time: float) -> str:
    return f"{time:.4f}" if math.isfinite(time) else ""


def _shares(model: "LinearModel", mode: "Mode") -> list[tuple[str, float]]:
    """States and their shares in a mode, the largest first, without those of next to nothing."""
    shares = zip(model.state_names, map(float, mode.participation), strict=True)
    return sorted(((name, share) for name, share in shares if share >= MIN_SHARE), key=lambda item: -item[1])


def _print_participation(model: "LinearModel") -> None:
    print(f"\nparticipation of the states, from {MIN_SHARE:.1%}")
    width = max(len(mode.name) for mode in model.modes)
    for mode in model.modes:
        print(f"{mode.name.ljust(width)}  {', '.join(f'{name} {share:.1%}' for name, share in _shares(model, mode))}")


def _print_exponents(craft: "Aircraft", point: "TrimPoint") -> None:
    """Characteristic exponents of a periodic flight with two blades."""
    from sbs_sim.analysis.floquet import floquet

    found = floquet(craft, point, MIN_INSTANTS)
    found = floquet(craft, point, _instants(found.period, found.poles))
    print_heading("periodic flight", craft, point)
    print(f"\nFloquet: period {found.period * 1e3:.4g} ms, no constant model; exponents are known but for multiples of")
    print(f"{2.0 * math.pi / found.period:.5g} rad/s [rad/s]")
    rows = [
        [*pole_cells(exponent), f"{abs(multiplier):.6g}"]
        for exponent, multiplier in zip(found.exponents, found.multipliers, strict=True)
        if exponent.imag >= 0.0
    ]
    print_table(["exponent", "", "|multiplier|"], rows)
    print_limits(point)


def _azimuth_count(craft: "Aircraft", model: "LinearModel") -> int:
    """Instants of a period that the fastest mode needs: rotors of unequal speeds may have a long common period."""
    from sbs_sim.analysis.periodic import flown_period

    return _instants(flown_period(craft, model.trim), model.poles)


def _instants(period: float, poles: "NDArray[np.complex128]") -> int:
    from sbs_sim.analysis.floquet import AZIMUTH_COUNTS

    steps = math.ceil(period * abs(poles[-1]) / MAX_STEP)
    return min(max(MIN_INSTANTS, 2 * steps), AZIMUTH_COUNTS[1])  # two instants make a step


def _print_floquet(model: "LinearModel", found: "Floquet") -> None:
    """One row for each real pole or pair."""
    print(f"\nFloquet: period {found.period * 1e3:.4g} ms, exponents beside the poles of the averaged model [rad/s]")
    rows = []
    for pole, exponent, multiplier in zip(found.poles, found.exponents, found.multipliers, strict=True):
        if pole.imag < 0.0:
            continue
        name = min(model.modes, key=lambda mode: abs(mode.pole - pole)).name
        cells = [name, *pole_cells(pole)]
        if abs(multiplier) > ROUNDING:
            gap = abs(exponent - pole)
            cells += [*pole_cells(exponent), f"{gap:.2e}", f"{gap / abs(pole) if pole else 0.0:.2e}"]
        else:
            cells += ["gone", "", "", ""]
        rows.append([*cells, f"{abs(multiplier):.6g}"])
    print_table(["mode", "averaged", "pole", "exponent", "", "difference", "relative", "|multiplier|"], rows)


def _print_derivatives(model: "LinearModel") -> None:
    """One row for each force and moment; over mass and inertia, so accelerations."""
    from sbs_sim.analysis.linear_model import FORCES, MOMENTS, MOTIONS

    values = model.derivatives()
    symbols = (*FORCES.values(), *MOMENTS.values())
    print("\nderivatives over mass and inertia, rotors and inflow settled [m/s^2 and rad/s^2 by m/s, rad/s, rad]")
    rows = [
        [f"by {name}", *(f"{values[f'{symbol}_{name}']:.5g}" for symbol in symbols)]
        for name in (*MOTIONS, *model.control_names)
    ]
    print_table(["", *symbols], rows)


def _print_matrix(
    name: str, matrix: "NDArray[np.float64]", row_names: tuple[str, ...], column_names: tuple[str, ...]
) -> None:
    """Matrix with the names of rows and columns, some columns at a time."""
    for first in range(0, len(column_names), COLUMNS):
        chosen = slice(first, first + COLUMNS)
        print()
        headings = [f"{name} [SI, rad]", *column_names[chosen]]
        rows = [
            [row_name, *(f"{value:.6g}" for value in row[chosen])]
            for row_name, row in zip(row_names, matrix, strict=True)
        ]
        print_table(headings, rows)
