"""Parameters of nodes: their declaration and the check of the values that were given."""

import array
from dataclasses import dataclass
from typing import Any

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.exceptions import ParameterException
from rclpy.node import Node
from rclpy.parameter import Parameter as ROSParameter

from sbs_sim.aircraft import Aircraft
from sbs_sim.errors import SbsError
from sbs_sim.terminal.command_line import suggestion

DEFAULT_GROUND = -100.0  # m
MAX_PORT = 65535


@dataclass(frozen=True)
class Parameter:
    """A parameter of a node: default, meaning, and range where it is a number.

    Attributes
    ----------
    default : object
        Its type is the parameter's type.
    description : str
    least, most : float, optional
        Range, ends included.
    fixed : bool
        True if it can be set at the start only.
    """

    default: Any
    description: str
    least: float | None = None
    most: float | None = None
    fixed: bool = True


def ground_altitude(aircraft: Aircraft, value: float) -> float:
    """Height of the ground above the origin [m]: that of a parameter, or for its default that of the aircraft file."""
    own = aircraft.ground.altitude
    return value if value != DEFAULT_GROUND or own is None else own


def declare(node: Node, parameters: dict[str, Parameter]) -> dict[str, Any]:
    """Declare parameters and return their values.

    Raises
    ------
    SbsError
        A value of a wrong type or out of range: parameter, value and what is allowed in one line.
    """
    given = node._parameter_overrides
    known = {*parameters, "use_sim_time", "start_type_description_service"}
    for name in given:
        if name not in known and not name.startswith("qos_overrides"):
            near = suggestion(name, parameters)
            raise SbsError(f"parameter {name}: unknown, allowed are {', '.join(parameters)}{near}")
    return {name: _declare_one(node, name, parameter, given) for name, parameter in parameters.items()}


def _declare_one(node: Node, name: str, parameter: Parameter, given: dict[str, ROSParameter]) -> Any:
    descriptor = ParameterDescriptor(description=parameter.description, read_only=parameter.fixed)
    allowed = f"allowed is a value like {parameter.default!r}"
    if parameter.least is not None and parameter.most is not None:
        if isinstance(parameter.default, int):
            descriptor.integer_range = [IntegerRange(from_value=int(parameter.least), to_value=int(parameter.most))]
        else:
            span = FloatingPointRange(from_value=float(parameter.least), to_value=float(parameter.most), step=0.0)
            descriptor.floating_point_range = [span]
        allowed = f"allowed are {parameter.least:g} to {parameter.most:g}"
    if name in given:
        given[name] = ROSParameter(name, value=_as_wanted(given[name].value, parameter.default))
    try:
        value = node.declare_parameter(name, parameter.default, descriptor).value
    except ParameterException:
        raise SbsError(f"parameter {name} = {given[name].value!r}: {allowed}") from None
    if value is None:  # an empty list on the command line has no type
        raise SbsError(f"parameter {name} is empty: {allowed}")
    return value


def _as_wanted(value: Any, default: Any) -> Any:
    """Integers where numbers are wanted, 15 is as good as 15.0; and the word that YAML takes for a false."""
    if isinstance(default, str) and value is False:
        return "off"
    if isinstance(default, float) and type(value) is int:
        return float(value)
    if isinstance(default, list) and isinstance(default[0], float) and isinstance(value, array.array | list | tuple):
        return [float(item) if type(item) is int else item for item in value]
    return value
