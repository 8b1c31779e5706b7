"""What every executable does alike: start ROS, run nodes, end cleanly; declare parameters; report health."""

import array
import os
import re
import sys
import threading
import traceback
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import rclpy
import rclpy.utilities
from diagnostic_msgs.msg import DiagnosticStatus, KeyValue
from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor
from rclpy.exceptions import NameValidationException, ParameterException
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.parameter import Parameter as ROSParameter
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.serialization import serialize_message
from rclpy.signals import SignalHandlerOptions

from sbs_sim.errors import SbsError
from sbs_sim.nodes.confinement import check_confinement, keep_to_this_machine
from sbs_sim.nodes.executables import ignore_interruptions, when_interrupted
from sbs_sim.nodes.number_fields import check_numbers, hint
from sbs_sim.terminal.command_line import suggestion

STATE_QOS = QoSProfile(depth=10, reliability=ReliabilityPolicy.RELIABLE)
# What ROS raises where a name, a parameter or a setting of the environment makes a node impossible.
ROS_REFUSALS = (rclpy_implementation.RCLError, NameValidationException, ParameterException)
HEALTH_PERIOD = 1.0  # s of wall time between diagnostics
COMPLAINT_PERIOD = 1.0  # s between complaints about bad input
STOP_PERIOD = 0.2  # s, longest time that a thread takes to see the end
LOOK_PERIOD = 0.1  # s between looks whether there was an interruption
DISCOVERY = 1.5  # s in which others that run already are found
END_PATIENCE = 3.0  # s that a thread may take to end
COMMAND_QOS = QoSProfile(depth=1, reliability=ReliabilityPolicy.RELIABLE)
EVENT_QOS = QoSProfile(depth=100, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL)
# Requests wait while one before them is answered. In DDS every client gets the answers to all, and one that is slow to
# look loses its own when so many others have come: ROS keeps ten unless it is told otherwise.
SERVICE_QOS = QoSProfile(depth=1000, reliability=ReliabilityPolicy.RELIABLE)
# the last message is kept for whoever comes later
LATCHED_QOS = QoSProfile(depth=1, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL)


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


class Log(Protocol):
    """Where messages are recorded; see `sbs_sim.nodes.recording.Recording`."""

    def channel(self, topic: str, kind: Any, qos: QoSProfile, role: str) -> int:
        """Channel for the messages of a topic, by its full name and by its name in the flight."""

    def write(self, channel: int, time: float, data: bytes, wait: bool = False, essential: bool = False) -> None:
        """Record a serialised message of a simulation time [s]."""


class Topic:
    """A publisher that also writes what it publishes into the log: messages are serialised once, for both.

    Parameters
    ----------
    node : Node
    kind : type
        Of the messages.
    name : str
    qos : QoSProfile
    log : Log, optional
    """

    def __init__(self, node: Node, kind: Any, name: str, qos: QoSProfile, log: Log | None = None) -> None:
        self._publisher = node.create_publisher(kind, name, qos)
        self._log = log
        self._channel = log.channel(self._publisher.topic_name, kind, qos, name.lstrip("/")) if log else 0

    def publish(self, message: Any, time: float, wait: bool = False, essential: bool = False) -> None:
        """Publish a message of a simulation time [s]; for `wait` and `essential` see `LogWriter.write`."""
        self.publish_bytes(serialize_message(message), time, wait, essential)

    def publish_bytes(self, data: bytes, time: float, wait: bool = False, essential: bool = False) -> None:
        """Publish a message that is serialised."""
        self._publisher.publish(data)
        self.record_bytes(data, time, wait, essential)

    def publish_again(self, data: bytes) -> None:
        """Publish a serialised message that is in the log already."""
        self._publisher.publish(data)

    @property
    def name(self) -> str:
        """Full name of the topic."""
        return str(self._publisher.topic_name)

    @property
    def subscribers(self) -> int:
        """How many listen."""
        return int(self._publisher.get_subscription_count())

    def record(self, message: Any, time: float, wait: bool = False, essential: bool = False) -> None:
        """Write a message into the log alone."""
        self.record_bytes(serialize_message(message), time, wait, essential)

    def record_bytes(self, data: bytes, time: float, wait: bool = False, essential: bool = False) -> None:
        """Write a serialised message into the log alone."""
        if self._log is not None:
            self._log.write(self._channel, time, data, wait, essential)


class Component(Node):
    """A node of this package.

    Attributes
    ----------
    workers : list of Thread
        Threads of its own that `stop` lets end.
    """

    def __init__(self, name: str, **options: Any) -> None:
        super().__init__(name, **options)
        check_confinement()
        self.workers: list[threading.Thread] = []

    def stop(self) -> None:
        """Let go of what a callback may be waiting for; called once, before the node's thread is joined."""

    def finish(self) -> None:
        """Bring to an end what must not be lost; called once, after `stop` and after the node's thread."""

    def answer(self, response: Any, act: Callable[[], Any], done: str, request: Any) -> Any:
        """Carry out a request and say how it went; an error changes nothing and is told."""
        try:
            check_numbers(request)
            act()
        except SbsError as error:
            response.success, response.message = False, f"{error}{hint(request)}"
        except Exception as error:  # an error of ours must not end the flight of others
            self.get_logger().error(f"internal error: {traceback.format_exc()}")
            response.success, response.message = False, f"internal error, see the log: {error!r}"
        else:
            response.success, response.message = True, done
        return response


class Refusals:
    """Counts the messages that a node has refused, and says why, at most once a second.

    Parameters
    ----------
    node : Node
    what : str
        Name of the messages.

    Attributes
    ----------
    count : int
    """

    def __init__(self, node: Node, what: str) -> None:
        self._node, self._what = node, what
        self.count = 0
        self._last = "none"

    def add(self, reason: Exception) -> None:
        """Count one."""
        self.count += 1
        self._last = str(reason)
        log = self._node.get_logger()
        log.warning(f"{self._what} rejected: {reason}", throttle_duration_sec=COMPLAINT_PERIOD)

    def values(self) -> dict[str, Any]:
        """What diagnostics tell of them."""
        return {"rejected_messages": self.count, "last_rejection": self._last}


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
    """Whole numbers where numbers are wanted, 15 is as good as 15.0; and the word that YAML takes for a false."""
    if isinstance(default, str) and value is False:
        return "off"
    if isinstance(default, float) and type(value) is int:
        return float(value)
    if isinstance(default, list) and isinstance(default[0], float) and isinstance(value, array.array | list | tuple):
        return [float(item) if type(item) is int else item for item in value]
    return value


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


def run(
    make_nodes: Callable[[], list[Component]],
    args: list[str] | None = None,
    end: threading.Event | None = None,
    first: str = "",
    asked: list[int] | None = None,
) -> int:
    """Run nodes until they are interrupted or have done their work; the exit code of the process.

    Every node has a thread and an executor of its own, so that a long service of one does not delay the messages of
    another. (rclpy's multi-threaded executor would do the same at many times the load, and callbacks that compute side
    by side keep the flight from its cores.)

    Parameters
    ----------
    make_nodes : callable
        Makes the nodes; an SbsError ends the process with its one line and exit code 1.
    args : list of str, optional
        Command line, sys.argv if not given.
    end : threading.Event, optional
        Set by a node that has done its work.
    first : str, optional
        Of a process with several nodes the one that a new name (`__node:=x`, `name=` of a launch file) is for.
    asked : list of int, optional
        Of a caller that heeds interruptions before its nodes are there: what it gave `heed`.

    Returns
    -------
    int
        0 after an interruption (Ctrl-C, SIGTERM, SIGHUP) or the end, 1 if the nodes could not start.
    """
    stop = end or threading.Event()
    try:
        leftover = own_arguments(args)
    except SbsError as error:
        print(error, file=sys.stderr)
        return 2
    if leftover:
        print(f"unknown argument {leftover[0]}: parameters are given as --ros-args -p name:=value", file=sys.stderr)
        return 2
    keep_to_this_machine()
    try:
        given = named_alone(sys.argv if args is None else args, first)
        rclpy.init(args=given, signal_handler_options=SignalHandlerOptions.NO)
    except Exception as error:
        print(f"cannot start ROS: {_one_line(error)}", file=sys.stderr)
        return 1
    nodes: list[Component] = []
    threads: list[threading.Thread] = []
    noted = [] if asked is None else asked
    try:
        nodes = make_nodes()
        heed(noted)
        threads = [threading.Thread(target=_spin, args=(node, stop), name=node.get_name()) for node in nodes]
        for thread in threads:
            thread.start()
        while not noted and not stop.wait(LOOK_PERIOD):
            pass
    except (SbsError, *ROS_REFUSALS) as error:
        print(_one_line(error), file=sys.stderr)
        return 1
    finally:
        stop.set()
        for node in nodes:
            node.stop()
            threads += node.workers
        for thread in threads:
            thread.join(END_PATIENCE)
        for node in nodes:
            node.finish()
        if any(thread.is_alive() for thread in threads):
            os._exit(0)  # deep in a computation, which cannot be interrupted and whose result nobody wants any more
        for node in reversed(nodes):
            node.destroy_node()
        rclpy.try_shutdown()
        ignore_interruptions()  # a second one must not tear the end of the interpreter apart
    return 0


def heed(asked: list[int]) -> None:
    """Have interruptions take a note, and do nothing else.

    What a handler does happens inside of whatever this thread does: an event could be locked then, for good.
    """
    when_interrupted(lambda number, _: asked.append(number))


def own_arguments(args: list[str] | None) -> list[str]:
    """Arguments of a command line that are not for ROS.

    Raises
    ------
    SbsError
        Those for ROS are wrong.
    """
    try:
        return list(rclpy.utilities.remove_ros_args(args)[1:])
    except rclpy_implementation.RCLError as error:
        raise SbsError(f"wrong --ros-args: {_one_line(error)}") from None


def named_alone(args: Sequence[str], first: str) -> list[str]:
    """Command line in which a new name for every node of the process (`__node:=x`) is one for the first of them alone.

    Else all of them would have it: no parameter service could tell them apart.
    """
    changed, of_ros, is_rule = [], False, False
    for arg in args:
        of_ros = arg != "--" if of_ros else arg == "--ros-args"
        renames = first and of_ros and is_rule and re.match("__(node|name):=", arg)
        changed.append(f"{first}:{arg}" if renames else arg)
        is_rule = arg in ("-r", "--remap")
    return changed


def _spin(node: Node, stop: threading.Event) -> None:
    """Serve a node until the end; an error in a callback is told and does not end the node."""
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    while not stop.is_set() and rclpy.ok():
        try:
            executor.spin_once(timeout_sec=STOP_PERIOD)
        except ExternalShutdownException:
            break
        except Exception:
            node.get_logger().error(f"internal error: {traceback.format_exc()}")
    executor.shutdown()
    stop.set()


def _one_line(error: Exception) -> str:
    return " ".join(str(error).split())
