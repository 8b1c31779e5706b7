"""`linearize`: linear model about a steady flight, its modes, and the options on which they depend."""

import argparse
import math
from typing import TYPE_CHECKING

from sbs_sim.commands.common import (
    UsageError,
    actuator,
    add_actuator_argument,
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
    from sbs_sim.analysis.frequency_response import Actuator
    from sbs_sim.analysis.harmonic import HarmonicModel
    from sbs_sim.analysis.linear_model import LinearModel
    from sbs_sim.analysis.modes import Mode
    from sbs_sim.flight.trim_point import TrimPoint

LEADING = 3  # states named beside a mode
MIN_SHARE = 0.005  # of the participations that are listed
ROUNDING = 1e-13  # of a multiplier: what decays further in a period leaves no exponent
COLUMNS = 10  # of a matrix side by side
SHOWN = 20  # frequencies of a response


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
    group = parser.add_argument_group("frequency responses")
    group.add_argument(
        "--bode",
        action="append",
        default=[],
        metavar="CONTROL:OUTPUT",
        help="print gain and phase from a control to an output or state, such as longitudinal_cyclic:theta; may be"
        " repeated",
    )
    group.add_argument("--delay", type=float, default=0.0, metavar="X", help="of sensors and the like [s] (default: 0)")
    add_actuator_argument(group)
    group.add_argument(
        "--bode-out", metavar="DIR", help="write Bode and Nichols plots (PNG, SVG), CSV and JSON of them"
    )
    group = parser.add_argument_group("periodic model")
    group.add_argument(
        "--harmonics",
        type=int,
        metavar="N",
        help="print hub loads and vibrations of the steady flight from a model of N harmonics of the blades' passage,"
        " and with --bode its responses",
    )
    group.add_argument(
        "--at",
        nargs=3,
        type=float,
        action="append",
        default=[],
        metavar=("X", "Y", "Z"),
        help="with --harmonics: also what an accelerometer measures there, from the c.g. in body axes [m]; may be"
        " repeated",
    )
    group.add_argument(
        "--harmonics-out", metavar="FILE", help="write the model of the harmonics to a .mat, .npz, .json or .h file"
    )
    group = parser.add_argument_group("reduced models")
    group.add_argument(
        "--reduce",
        action="store_true",
        help="print what models with fewer states cost over frequency and in time, and which order is suggested",
    )
    group.add_argument(
        "--reduced-out",
        metavar="FILE",
        help="with --reduce: write the suggested model to a .mat, .npz, .json or .h file",
    )
    group = parser.add_argument_group("output")
    for name, meaning in (
        ("--matrices", "print A and B"),
        ("--derivatives", "print stability and control derivatives, rotors and inflow settled"),
        ("--participation", "print what takes part in each mode"),
        ("--floquet", "print the characteristic exponents of the periodic model beside the averaged poles"),
    ):
        group.add_argument(name, action="store_true", help=meaning)
    group.add_argument("--out", metavar="FILE", help="write the model to a .npz, .mat, .json or .h file")
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
    pairs = _pairs(arguments)
    if arguments.reduced_out:
        from sbs_sim.analysis.export import STATE_SPACE_ENCODERS

        check_target(arguments.reduced_out, STATE_SPACE_ENCODERS)
    lag = actuator(arguments)
    if arguments.harmonics_out:
        from sbs_sim.analysis.export import STATE_SPACE_ENCODERS

        check_target(arguments.harmonics_out, STATE_SPACE_ENCODERS)
    craft = aircraft(arguments)
    is_periodic = arguments.floquet or arguments.harmonics is not None
    if is_periodic:
        from sbs_sim.analysis.floquet import checked_period

        checked_period(craft)  # before the work
    point = solve_trim(craft, *flight(arguments), guess=guess(arguments, craft))
    wants_matrices = arguments.participation or arguments.derivatives or arguments.matrices
    wants_model = arguments.out or arguments.json or wants_matrices or pairs or arguments.reduce
    if is_periodic and has_two_blades(craft) and not wants_model:  # there is no other linear model
        if arguments.floquet:
            _print_exponents(craft, point)
        _print_harmonics(craft, point, arguments)
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

        _print_floquet(full, floquet(craft, full.trim))
    periodic = _print_harmonics(craft, full.trim, arguments)
    if arguments.derivatives:
        _print_derivatives(full)
    if pairs:
        _print_responses(model, pairs, lag, periodic, arguments)
    if arguments.reduce:
        _print_reductions(craft, full, arguments.reduced_out)
    if arguments.matrices:
        _print_matrix("A", model.a, model.state_names, model.state_names)
        _print_matrix("B", model.b, model.state_names, model.control_names)


def _pairs(arguments: argparse.Namespace) -> list[tuple[str, str]]:
    """Controls and outputs of the frequency responses.

    Raises
    ------
    UsageError
        An argument without a colon, or one that needs another.
    """
    if arguments.bode_out and not arguments.bode:
        raise UsageError("--bode-out needs --bode CONTROL:OUTPUT")
    for name in ("at", "harmonics_out"):
        if getattr(arguments, name) and arguments.harmonics is None:
            raise UsageError(f"--{name.replace('_', '-')} needs --harmonics N")
    if arguments.reduced_out and not arguments.reduce:
        raise UsageError("--reduced-out needs --reduce")
    for text in arguments.bode:
        if not all(text.partition(":")[::2]):
            raise UsageError(f"--bode {text!r}: allowed is CONTROL:OUTPUT, such as longitudinal_cyclic:theta")
    return [(text.partition(":")[0], text.partition(":")[2]) for text in arguments.bode]


def _print_harmonics(craft: "Aircraft", point: "TrimPoint", arguments: argparse.Namespace) -> "HarmonicModel | None":
    """Hub loads and vibrations of the steady flight, if they are asked for; the model may go to a file."""
    if arguments.harmonics is None:
        return None
    from sbs_sim.analysis.harmonic import periodic_model
    from sbs_sim.commands.harmonic_tables import print_vibrations

    points = {f"point {i}": position for i, position in enumerate(arguments.at, 1)}
    periodic = periodic_model(craft, point).with_points(points)
    model = periodic.harmonic(arguments.harmonics)
    print_vibrations(model, periodic, float(point.rotor_speed[0]), points)
    if arguments.harmonics_out:
        model.state_space.save(arguments.harmonics_out)
    return model


def _print_responses(
    model: "LinearModel",
    pairs: list[tuple[str, str]],
    lag: "Actuator | None",
    periodic: "HarmonicModel | None",
    arguments: argparse.Namespace,
) -> None:
    """Some frequencies of each response; all of them go to the files."""
    responses = [model.frequency_response(*pair, delay=arguments.delay, actuator=lag) for pair in pairs]
    for response in responses:
        print(f"\n{response.output_name} [{response.output_unit}] by {response.input_name} [{response.input_unit}]")
        chosen = range(0, len(response.frequencies), max(1, len(response.frequencies) // SHOWN))
        rows = [
            [f"{response.frequencies[i]:.4g}", f"{response.gain_db[i]:.2f}", f"{response.phase_deg[i]:.1f}"]
            for i in chosen
        ]
        headings = ["frequency [rad/s]", "gain [dB]", "phase [deg]"]
        if periodic is not None:
            from sbs_sim.commands.harmonic_tables import sidebands

            names, columns = sidebands(periodic, response)
            headings += names
            rows = [[*row, *(column[i] for column in columns)] for row, i in zip(rows, chosen, strict=True)]
        print_table(headings, rows, left=())
    if arguments.bode_out:
        from sbs_sim.analysis.bode_plots import save_responses

        written = save_responses(responses, arguments.bode_out)
        print(f"\nwritten: {', '.join(str(path) for path in written)}")


def _print_reductions(craft: "Aircraft", full: "LinearModel", out: str | None) -> None:
    """What each reduced model costs; the suggested one goes to a file."""
    from sbs_sim.analysis.quality_limits import scales
    from sbs_sim.analysis.reduced import reductions, suggested
    from sbs_sim.errors import LinearizationError

    scale = scales(craft)[0]
    found = reductions(full, scale.speed_up)
    best = suggested(found)
    low, high = (frequency * scale.speed_up for frequency in found[0].band)
    print(f"\nreduced models: largest errors of the rates by their controls, {low:.3g} to {high:.3g} rad/s")
    rows = [
        [
            own.model.name,
            str(own.model.order),
            f"{own.worst_gain:.2f}",
            f"{own.worst_phase:.1f}",
            f"{own.cost:.4g}",
            "yes" if own.is_unnoticed else "no",
            f"{own.step_error:.2%}",
            "suggested" if own is best else "",
        ]
        for own in found
    ]
    print_table(["kept", "states", "gain [dB]", "phase [deg]", "cost", "unnoticed", "step", ""], rows, left=(0, 7))
    if best is None:
        print("none stays within the envelopes of unnoticeable dynamics: keep all states")
    if out:
        if best is None:
            raise LinearizationError("reduced_out: no reduced model stays within the envelopes")
        best.model.save(out)


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

    found = floquet(craft, point)
    print_heading("periodic flight", craft, point)
    print(f"\nFloquet: period {found.period * 1e3:.4g} ms, no constant model; exponents are known but for multiples of")
    print(f"{2.0 * math.pi / found.period:.5g} rad/s [rad/s]")
    print(_accuracy(found))
    rows = [
        [*pole_cells(exponent), f"{abs(multiplier):.6g}"]
        for exponent, multiplier in zip(found.exponents, found.multipliers, strict=True)
        if exponent.imag >= 0.0
    ]
    print_table(["exponent", "", "|multiplier|"], rows)
    print_limits(point)


def _accuracy(found: "Floquet") -> str:
    """Number of instants, and the largest estimated error of an exponent."""
    import numpy as np

    left = [error for error in (() if found.error is None else found.error) if not np.isnan(error)]
    return f"{found.azimuth_count} instants, estimated error {max(left, default=math.nan):.1e} rad/s at most"


def _print_floquet(model: "LinearModel", found: "Floquet") -> None:
    """One row for each real pole or pair."""
    print(f"\nFloquet: period {found.period * 1e3:.4g} ms, exponents beside the poles of the averaged model [rad/s]")
    print(_accuracy(found))
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
