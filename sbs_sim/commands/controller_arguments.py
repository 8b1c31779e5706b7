"""Options of commands that fly with a controller in the loop."""

import argparse
import importlib.util
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sbs_sim.commands.common import UsageError
from sbs_sim.terminal.command_line import assignment

if TYPE_CHECKING:
    from sbs_sim.aircraft import Aircraft
    from sbs_sim.flight.controller import Controller
    from sbs_sim.flight.trim_point import Fidelity, TrimCondition

DESIGN = "design"


def add_controller_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    group = parser.add_argument_group("controller")
    group.add_argument(
        "--controller",
        metavar="WHICH",
        help=f"{DESIGN}: designed here for the flight condition, it holds speed, height and heading, and the place in"
        " hover; FILE.yaml: a file of such gains; FILE.py:NAME: a sbs_sim.Controller, or a function that makes one of"
        " an aircraft (default: none, the controls of the trim are held)",
    )
    group.add_argument(
        "--delay", type=float, metavar="X", help="from a measurement to its controls [s] (default: 0.01)"
    )
    group.add_argument("--lag", type=float, metavar="X", help="time constant of the actuators [s] (default: 0)")
    for name, meaning in (("noise", "from one measurement to the next"), ("bias", "for a whole flight")):
        group.add_argument(
            f"--{name}",
            action="append",
            default=[],
            type=assignment,
            metavar="SENSOR=X",
            help=f"standard deviation of an error {meaning}, in SI units and rad: p=0.01, theta=0.002; may be repeated",
        )


def controller(
    arguments: argparse.Namespace, craft: "Aircraft", condition: "TrimCondition", fidelity: "Fidelity"
) -> "Controller | None":
    """The controller that the options select; None without one."""
    own = arguments.delay is not None or arguments.lag is not None or arguments.noise or arguments.bias
    if arguments.controller is None:
        if own:
            raise UsageError("--delay, --lag, --noise, --bias: allowed with --controller")
        return None
    from sbs_sim.flight.controller import Sensors

    options: dict[str, Any] = {"sensors": Sensors(dict(arguments.noise), dict(arguments.bias))}
    options |= {"delay": 0.01 if arguments.delay is None else arguments.delay, "lag": arguments.lag or 0.0}
    name = arguments.controller
    if name == DESIGN:
        return _designed(craft, condition, fidelity, options)
    if Path(name).suffix in (".yaml", ".yml"):
        from sbs_sim.pilot.envelope_file import check_aircraft, load_envelope

        found = load_envelope(name)
        check_aircraft(found, craft)
        return found.controller(holding(condition), **options)
    return _own(name, craft, arguments, options)


def _designed(
    craft: "Aircraft", condition: "TrimCondition", fidelity: "Fidelity", options: dict[str, Any]
) -> "Controller":
    """Controller for one airspeed."""
    from sbs_sim.analysis.linearize import linearize_trim
    from sbs_sim.analysis.trim import solve_trim
    from sbs_sim.flight.trim_point import TrimCondition
    from sbs_sim.pilot.envelope import design_envelope

    level = TrimCondition(airspeed=condition.airspeed)
    model = linearize_trim(craft, solve_trim(craft, level, fidelity))
    return design_envelope(craft, [model]).controller(holding(condition), **options)


def holding(condition: "TrimCondition") -> list[float]:
    """Command to go on as in a flight condition; in hover, to stay at the origin, heading north."""
    from sbs_sim.pilot.envelope_law import POSITION, VELOCITY

    if condition.airspeed == condition.climb_rate == condition.turn_rate == 0.0:
        return [0.0, POSITION, 0.0, 0.0, 0.0, 0.0]
    return [0.0, VELOCITY, condition.airspeed, 0.0, -condition.climb_rate, condition.turn_rate]


def _own(name: str, craft: "Aircraft", arguments: argparse.Namespace, options: dict[str, Any]) -> "Controller":
    """Controller from a file of Python."""
    from dataclasses import replace

    from sbs_sim.errors import PilotError
    from sbs_sim.flight.controller import Controller

    file, _, item = name.rpartition(":")
    if not file.endswith(".py") or not item:
        raise PilotError(f"controller = {name!r}: allowed are {DESIGN}, FILE.yaml and FILE.py:NAME")
    spec = importlib.util.spec_from_file_location(Path(file).stem, file)
    try:
        if spec is None or spec.loader is None:
            raise ImportError("no module")
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        found = getattr(module, item)
        found = found if isinstance(found, Controller) else found(craft)
    except Exception as error:  # whatever a file of the user's does
        text = " ".join(str(error).split())
        raise PilotError(f"controller = {name!r}: {type(error).__name__}: {text}") from error
    if not isinstance(found, Controller):
        raise PilotError(f"controller = {name!r}: allowed is a sbs_sim.Controller, or a function that returns one")
    given = {key: options[key] for key in ("delay", "lag") if getattr(arguments, key) is not None}
    if arguments.noise or arguments.bias:
        given["sensors"] = options["sensors"]
    return replace(found, **given)
