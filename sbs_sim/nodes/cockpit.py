"""Executable `cockpit`: a flight in the browser.

Starts a simulator in a process of its own, so that drawing does not delay the flight, or joins a running one.
"""

import argparse
import ctypes
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import TYPE_CHECKING

import rclpy.utilities

from sbs_sim.errors import SbsError
from sbs_sim.nodes.component import Component
from sbs_sim.nodes.confinement import alone_in_domain
from sbs_sim.nodes.process import run
from sbs_sim.nodes.signals import DISCOVERY_TIME
from sbs_sim.terminal.command_line import Parser

if TYPE_CHECKING:
    from sbs_sim.nodes.cockpit_node import Cockpit

HOST, PORT = "127.0.0.1", 8080
SHUTDOWN_TIMEOUT = 15.0  # s that a simulator may take to close its log
START_HEIGHT = 10.0  # m above the origin, of a flight that the cockpit starts
DIE_WITH_PARENT = 1  # PR_SET_PDEATHSIG


class SimulatorProcess:
    """A simulator in a process of its own, which ends with this one.

    Parameters
    ----------
    ros_arguments : list of str
        --ros-args and what follows; empty for none.
    end : threading.Event
        Set when the simulator has ended.
    """

    def __init__(self, ros_arguments: list[str], end: threading.Event) -> None:
        program = Path(sys.argv[0]).resolve()
        beside = program.with_name("simulator")
        path = [str(beside)] if beside.exists() else [str(program), "simulator"]  # as `sbs-sim cockpit` there is one
        height = ["--ros-args", "-p", f"altitude:={START_HEIGHT}"]  # first: what the user says comes after
        command = [sys.executable, *path, *height, *ros_arguments[1:]]
        # a session of its own: Ctrl-C comes to the cockpit, which ends the simulator when it has let go of it
        self._process = subprocess.Popen(command, start_new_session=True, preexec_fn=_end_with_parent)
        self._end = end
        threading.Thread(target=self._watch, name="simulator", daemon=True).start()

    def _watch(self) -> None:
        self._process.wait()
        self._end.set()

    def stop(self) -> int:
        """End it in good order; its exit code."""
        if self._process.poll() is None:
            self._process.send_signal(signal.SIGINT)
        try:
            return self._process.wait(SHUTDOWN_TIMEOUT)
        except subprocess.TimeoutExpired:
            self._process.kill()
            return self._process.wait()


def _end_with_parent() -> None:
    """Have the kernel end this process when its parent has ended, however that came."""
    ctypes.CDLL(None).prctl(DIE_WITH_PARENT, signal.SIGINT)


class CockpitStartup:
    """Starts the cockpit, and a simulator unless it joins one that runs already.

    Parameters
    ----------
    options : argparse.Namespace
    ros_arguments : list of str
    end : threading.Event
        Set when there is nothing to show any more.
    """

    def __init__(self, options: argparse.Namespace, ros_arguments: list[str], end: threading.Event) -> None:
        self._options, self._ros_arguments, self._end = options, ros_arguments, end
        self._cockpit: Cockpit | None = None
        self._simulator: SimulatorProcess | None = None

    def nodes(self) -> list[Component]:
        """Make everything.

        Raises
        ------
        SbsError
            The address is taken, there is no such folder, or a simulator flies already.
        """
        host, port, alone = self._options.host, self._options.port, self._options.attach or self._options.logs
        check_address(host, port)
        folder = checked_folder(self._options.logs)
        observer, since = Component("cockpit_observer"), time.monotonic()
        try:
            certain = not alone and alone_in_domain(observer.context.get_domain_id())
            if certain:
                self._simulator = SimulatorProcess(self._ros_arguments, self._end)
            # meanwhile the flight begins, or the observer discovers others
            from sbs_sim.nodes.cockpit_node import Cockpit

            if not alone and not certain:
                _refuse_second_simulator(observer, since + 2 * DISCOVERY_TIME)  # half of it goes by importing
                self._simulator = SimulatorProcess(self._ros_arguments, self._end)
        finally:
            observer.destroy_node()
        self._cockpit = Cockpit(host, port, self._end, not alone, folder)
        return [self._cockpit]

    def finish(self) -> int:
        """End the simulator; the worst exit code."""
        codes = [0 if self._simulator is None else self._simulator.stop()]
        codes.append(int(self._cockpit is not None and self._cockpit.failed))
        return max(codes, key=abs)


def main(args: list[str] | None = None) -> None:
    """Serve the page until interrupted."""
    arguments = sys.argv if args is None else args
    own = rclpy.utilities.remove_ros_args(arguments)[1:]
    options = _parse(own)
    ros_arguments = arguments[1 + len(own) :]
    given = {"-p", "--param", "--params-file"} & set(ros_arguments) | ({"--foxglove"} if options.foxglove else set())
    if (options.attach or options.logs) and given:
        make_parser().error(
            f"{min(given)}: parameters go to a simulator that the cockpit starts: not allowed with --attach and --logs"
        )
    if options.foxglove:
        ros_arguments = ["--ros-args", "-p", "foxglove:=true", *ros_arguments[1:]]
    end = threading.Event()
    start = CockpitStartup(options, ros_arguments, end)
    code = run(start.nodes, [arguments[0], *ros_arguments], end, first="cockpit")
    sys.exit(start.finish() or code)


def check_address(host: str, port: int) -> None:
    """Raise SbsError if nothing can be served there."""
    try:
        with socket.create_server((host, port)):
            return
    except OSError as error:
        raise SbsError(f"cannot serve on {host}:{port}: {error.strerror or error}; see --host and --port") from None


def checked_folder(name: str) -> Path:
    """Folder of the logs: one that was named, or the default, which need not be there yet.

    Raises
    ------
    SbsError
        There is no such folder.
    """
    folder = Path(name or os.environ.get("SBS_SIM_BAGS") or "bags")
    if name and not os.path.isdir(folder):
        raise SbsError(f"--logs {name}: allowed is a folder with logs")
    return folder


def make_parser() -> Parser:
    """Command line of `cockpit`."""
    parser = Parser(
        "cockpit",
        description="Fly in the browser: start a simulator and serve a page that shows and controls the flight.",
        epilog="Arguments after --ros-args go to the simulator too: ./run cockpit --ros-args -p airspeed:=15.0",
    )
    parser.add_argument("--host", default=HOST, help=f"address to serve on (default: {HOST}, this machine only)")
    parser.add_argument("--port", type=int, default=PORT, help=f"port to serve on, 1 to 65535 (default: {PORT})")
    parser.add_argument(
        "--attach", action="store_true", help="join a simulator that is running or is started later; start none"
    )
    parser.add_argument(
        "--foxglove", action="store_true", help="have the simulator serve Foxglove and Lichtblick too, on port 8765"
    )
    parser.add_argument("--logs", default="", metavar="FOLDER", help="show the logs of this folder; start no simulator")
    return parser


def _parse(arguments: list[str]) -> argparse.Namespace:
    parser = make_parser()
    options = parser.parse_args(arguments)
    if not 1 <= options.port <= 65535:
        parser.error(f"--port {options.port}: allowed are 1 to 65535")
    if not options.host:
        parser.error("--host is empty: allowed are names and addresses of this machine, 0.0.0.0 for all of them")
    return options


def _refuse_second_simulator(observer: Component, until: float) -> None:
    """Raise SbsError if a simulator is discovered whose topics this one would publish too."""
    inflow = observer.resolve_topic_name("inflow")  # where it is remapped, too
    while not observer.count_publishers(inflow):
        if (left := until - time.monotonic()) <= 0.0:
            return
        time.sleep(min(left, 0.05))
    raise SbsError("a simulator is already running: join it with --attach, or use another ROS_DOMAIN_ID")
