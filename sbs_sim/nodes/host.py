"""What every executable does alike: start ROS, run nodes, end cleanly; declare parameters; report health."""

import signal
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import rclpy
from diagnostic_msgs.msg import DiagnosticStatus, KeyValue
from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor
from rclpy.exceptions import InvalidParameterTypeException, InvalidParameterValueException, ParameterException
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.signals import SignalHandlerOptions

from sbs_sim.errors import SbsError

STATE_QOS = QoSProfile(depth=10, reliability=ReliabilityPolicy.RELIABLE)
COMMAND_QOS = QoSProfile(depth=1, reliability=ReliabilityPolicy.RELIABLE)


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


def declare(node: Node, parameters: dict[str, Parameter]) -> dict[str, Any]:
    """Declare parameters and return their values.

    Raises
    ------
    SbsError
        A value of a wrong type or out of range: parameter, value and what is allowed in one line.
    """
    values = {}
    for name, parameter in parameters.items():
        descriptor = ParameterDescriptor(description=parameter.description, read_only=parameter.fixed)
        if parameter.least is not None and parameter.most is not None:
            span = FloatingPointRange(from_value=float(parameter.least), to_value=float(parameter.most), step=0.0)
            descriptor.floating_point_range = [span]
        try:
            values[name] = node.declare_parameter(name, parameter.default, descriptor).value
        except InvalidParameterTypeException:
            given = node._parameter_overrides[name].value
            kind = type(parameter.default).__name__
            raise SbsError(f"parameter {name} = {given!r}: allowed is a value of type {kind}") from None
        except (InvalidParameterValueException, ParameterException):
            given = node._parameter_overrides[name].value
            raise SbsError(
                f"parameter {name} = {given!r}: allowed are {parameter.least:g} to {parameter.most:g}"
            ) from None
    return values


def diagnostic(name: str, problems: Sequence[tuple[bytes, str]], values: dict[str, Any]) -> DiagnosticStatus:
    """One diagnostic status: the worst of the problems gives the level, all of them the message."""
    level = max((level for level, _ in problems), default=DiagnosticStatus.OK)
    return DiagnosticStatus(
        level=level,
        name=name,
        hardware_id="",
        message="; ".join(text for _, text in problems) or "running",
        values=[KeyValue(key=key, value=str(value)) for key, value in values.items()],
    )


def run(make_nodes: Callable[[], list[Node]], args: list[str] | None = None) -> int:
    """Run nodes until they are interrupted; the exit code of the process.

    Parameters
    ----------
    make_nodes : callable
        Makes the nodes; an SbsError ends the process with its one line and exit code 1.
    args : list of str, optional
        Command line, sys.argv if not given.

    Returns
    -------
    int
        0 after an interruption (Ctrl-C, SIGTERM), 1 if the nodes could not start.
    """
    try:
        rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
    except Exception as error:
        print(f"cannot start ROS: {_one_line(error)}", file=sys.stderr)
        return 1
    nodes: list[Node] = []
    try:
        _interrupt_on(signal.SIGTERM)
        nodes = make_nodes()
        executor = MultiThreadedExecutor(num_threads=2)
        for node in nodes:
            executor.add_node(node)
        executor.spin()
    except SbsError as error:
        print(_one_line(error), file=sys.stderr)
        return 1
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # a second Ctrl-C must not tear the clean end apart
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
        for node in reversed(nodes):
            node.destroy_node()
        rclpy.try_shutdown()
    return 0


def _interrupt_on(number: int) -> None:
    """Treat a signal as Ctrl-C."""

    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    signal.signal(number, interrupt)


def _one_line(error: Exception) -> str:
    return " ".join(str(error).split())
