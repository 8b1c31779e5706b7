"""`trim`: attitude, controls and loads of a steady flight."""

import argparse
from typing import TYPE_CHECKING

from sbs_sim.commands.common import (
    DEGREES,
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

MAIN_SHARES = ("induced", "interference", "profile", "fuselage", "surfaces", "duct", "gravity")  # of the power
ALWAYS = ("induced", "profile", "fuselage")
LEAST_SHARE = 1e-3  # of the power, of those that are shown

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sbs_sim.aircraft import Aircraft
    from sbs_sim.analysis.control_effects import ControlEffect
    from sbs_sim.flight.trim_point import TrimPoint


def main() -> int:
    """Executable `trim`."""
    return execute(make_parser(), _work)


def make_parser() -> Parser:
    """Command line of `trim`."""
    parser = Parser(
        "trim",
        example="trim --airspeed 15 --set body.mass=22",
        description="Trim an aircraft and print the steady flight.",
    )
    add_flight_arguments(parser)
    add_guess_argument(parser)
    parser.add_argument(
        "--method",
        choices=("newton", "two_loop"),
        default="newton",
        help="newton (default), or the nested loops of the paper",
    )
    parser.add_argument("--json", metavar="FILE", help="also write the trim to this file, in SI units and radians")
    return parser


def _work(arguments: argparse.Namespace) -> None:
    from sbs_sim.analysis.linearize import trim_effects
    from sbs_sim.analysis.trim import solve_trim
    from sbs_sim.output.files import check_target, write
    from sbs_sim.output.json_text import to_json

    check_target(arguments.json)
    craft = aircraft(arguments)
    point = solve_trim(craft, *flight(arguments), method=arguments.method, guess=guess(arguments, craft))
    print_trim(craft, point, trim_effects(craft, point))
    if arguments.json:
        write(arguments.json, to_json(point.to_dict()))


def print_trim(craft: "Aircraft", point: "TrimPoint", effects: "Sequence[ControlEffect]") -> None:
    """Print a trim, and which way more of each control moves the aircraft."""
    print_heading("trim", craft, point)
    print()
    rows = [
        ["pitch [deg]", fixed(point.pitch * DEGREES, 4), "", "nose up"],
        ["roll [deg]", fixed(point.roll * DEGREES, 4), "", "right side down"],
        *_deflection_rows(point),
    ]
    moves = {effect.control: f"{effect.axis}: {effect.words}" for effect in effects}
    for control, value in zip(craft.controls, point.controls.tolist(), strict=True):
        low, high = (control.shown(limit) for limit in control.range)
        heading = f"{control.name} [{control.shown_unit}]"
        rows.append([heading, fixed(control.shown(value), 4), f"{low:g} to {high:g}", moves.get(control.name, "held")])
    print_table(["body and controls", "", "range", "effect of an increase"], rows, left=(0, 3))
    print()
    print_table(["rotors", *(rotor.name for rotor in craft.rotors)], _rotor_rows(craft, point))
    print()
    print(f"power of all rotors {point.power.sum():.2f} W")
    if shares := _shares(craft, point):
        print(f"goes into [W] {shares}")
    print_limits(point)


def _shares(craft: "Aircraft", point: "TrimPoint") -> str:
    """Where the power goes, in words; nothing for aircraft without a balance of power."""
    from sbs_sim.analysis.power import power_shares
    from sbs_sim.errors import SimulationError
    from sbs_sim.model.power import SUPPLY

    try:
        powers = power_shares(craft, point)
    except SimulationError:
        return ""
    taken = {name: power for name, power in powers.items() if name not in SUPPLY}
    main = {"climb" if name == "gravity" else name: taken.pop(name) for name in MAIN_SHARES}
    least = LEAST_SHARE * max(map(abs, powers.values()))
    shown = {name: power for name, power in main.items() if name in ALWAYS or abs(power) > least}
    rest = sum(taken.values()) + sum(power for name, power in main.items() if name not in shown)
    return ", ".join(f"{name} {power:.1f}" for name, power in (*shown.items(), ("other", rest)))


def _deflection_rows(point: "TrimPoint") -> list[list[str]]:
    """Heading and position of a stand that gives way."""
    from sbs_sim.flight.trim_point import StandPoint

    if not isinstance(point, StandPoint):
        return []
    rows = [["yaw [deg]", fixed(point.heading * DEGREES, 4), "", "nose right"]]
    return rows + [[f"{axis} [m]", fixed(value, 6), "", ""] for axis, value in zip("xyz", point.position, strict=True)]


def _rotor_rows(craft: "Aircraft", point: "TrimPoint") -> list[list[str]]:
    """Loads, swashplate, flap, lag and inflow; one column for each rotor."""
    from sbs_sim.model.state import SWASHPLATE_NAMES, part_of
    from sbs_sim.output.units import RPM

    rows = [
        ["thrust [N]", *(fixed(value, 3) for value in point.thrust)],
        ["torque [N m]", *(fixed(value, 4) for value in point.torque)],
        ["power [W]", *(fixed(value, 2) for value in point.power)],
    ]
    if craft.drives:
        rows.append(["speed [rpm]", *(fixed(speed * RPM, 2) for speed in point.rotor_speed.tolist())])
    for name, angles in zip(SWASHPLATE_NAMES, point.swashplate[: len(craft.rotors)].T, strict=True):
        rows.append([f"{name} [deg]", *(fixed(angle * DEGREES, 4) for angle in angles)])
    families: dict[str, dict[str, list[str]]] = {"flap": {}, "lag": {}, "inflow": {}, "wake": {}}
    for name, value in zip(point.state_names, point.state, strict=True):
        part = part_of(name)
        if part.family in families and not part.is_rate:
            is_angle = part.family not in ("inflow", "wake")
            own = name.partition("(")[0].removeprefix("wake_")
            label = f"{part.family} {own} {'[deg]' if is_angle else '[1]'}"
            # rotors may have unequal numbers of blades, and so of coordinates
            row = families[part.family].setdefault(label, [""] * len(craft.rotors))
            row[part.rotor] = fixed(value * DEGREES, 4) if is_angle else fixed(value, 6)
    return rows + [[label, *cells] for family in families.values() for label, cells in family.items()]
