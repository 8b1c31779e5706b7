"""Process with nodes: start ROS, run the nodes, end them in good order."""

import os
import re
import sys
import threading
import traceback
from collections.abc import Callable, Sequence

import rclpy
import rclpy.utilities
from rclpy.exceptions import NameValidationException, ParameterException
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from sbs_sim.errors import SbsError
from sbs_sim.nodes.component import Component
from sbs_sim.nodes.confinement import keep_to_this_machine
from sbs_sim.nodes.signals import ignore_interruptions, note_interruptions
from sbs_sim.terminal.progress import show_compiling

# What ROS raises where a name, a parameter or a setting of the environment makes a node impossible.
ROS_ERRORS = (rclpy_implementation.RCLError, NameValidationException, ParameterException)
SHUTDOWN_POLL_PERIOD = 0.2  # s, longest time that a thread takes to see the end
INTERRUPTION_POLL_PERIOD = 0.1  # s between looks whether there was an interruption
SHUTDOWN_TIMEOUT = 3.0  # s that a thread may take to end
MIDDLEWARE_TIMEOUT = 15.0  # s that ROS may take to end


def run(
    make_nodes: Callable[[], list[Component]],
    args: list[str] | None = None,
    end: threading.Event | None = None,
    first: str = "",
    interruptions: list[int] | None = None,
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
    interruptions : list of int, optional
        Interruptions that the caller has collected with `note_interruptions` before it called this.

    Returns
    -------
    int
        0 after an interruption (Ctrl-C, SIGTERM, SIGHUP) or the end, 1 if the nodes could not start.
    """
    stop = end or threading.Event()
    show_compiling()
    if code := _start_ros(args, first):
        return code
    nodes: list[Component] = []
    threads: list[threading.Thread] = []
    interruptions = [] if interruptions is None else interruptions
    try:
        nodes = make_nodes()
        note_interruptions(interruptions)
        threads = [threading.Thread(target=_spin, args=(node, stop), name=node.get_name()) for node in nodes]
        for thread in threads:
            thread.start()
        while not interruptions and not stop.wait(INTERRUPTION_POLL_PERIOD):
            pass
    except (SbsError, *ROS_ERRORS) as error:
        print(_one_line(error), file=sys.stderr)
        return 1
    finally:
        stop.set()
        _shut_down(nodes, threads)
    return 0


def _start_ros(args: list[str] | None, first: str) -> int:
    """Start ROS with a command line; 0, or the exit code after an error, which is printed."""
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
    return 0


def _shut_down(nodes: list[Component], threads: list[threading.Thread]) -> None:
    """Stop nodes, wait for their threads, and shut ROS down."""
    for node in nodes:
        node.stop()
        threads += node.workers
    for thread in threads:
        thread.join(SHUTDOWN_TIMEOUT)
    for node in nodes:
        node.finish()
    if any(thread.is_alive() for thread in threads):
        os._exit(0)  # a long computation cannot be interrupted
    # Logs are closed: a middleware that does not let go must not keep the process.
    let_go = threading.Timer(MIDDLEWARE_TIMEOUT, os._exit, (0,))
    let_go.daemon = True
    let_go.start()
    for node in reversed(nodes):
        node.destroy_node()
    rclpy.try_shutdown()
    let_go.cancel()
    ignore_interruptions()  # a second one must not disturb the end of the interpreter


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

    Else all of them would have it: no parameter service could distinguish them.
    """
    changed, of_ros, is_rule = [], False, False
    for arg in args:
        of_ros = arg != "--" if of_ros else arg == "--ros-args"
        renames = first and of_ros and is_rule and re.match("__(node|name):=", arg)
        changed.append(f"{first}:{arg}" if renames else arg)
        is_rule = arg in ("-r", "--remap")
    return changed


def _spin(node: Node, stop: threading.Event) -> None:
    """Serve a node until the end; an error in a callback is logged and does not end the node."""
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    while not stop.is_set() and rclpy.ok():
        try:
            executor.spin_once(timeout_sec=SHUTDOWN_POLL_PERIOD)
        except ExternalShutdownException:
            break
        except Exception:
            node.get_logger().error(f"internal error: {traceback.format_exc()}")
    executor.shutdown()
    stop.set()


def _one_line(error: Exception) -> str:
    return " ".join(str(error).split())
