"""Entry points of the executables.

They import next to nothing, so that Ctrl-C is obeyed at once while the compiled model is still being loaded.
"""

import importlib
import os
import sys

from sbs_sim.nodes.signals import INTERRUPTED, when_interrupted
from sbs_sim.nodes.standard_streams import make_standard_streams_non_blocking
from sbs_sim.terminal import command_line

OWN_COMMAND_LINE = ("replay", "cockpit", "ardupilot")
ROS = ("rclpy", "_msgs", "_srvs", "_interfaces", "ament_index_python")
# The matrices are small: threads of numpy and scipy would gain nothing, and take the cores that the flight needs.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


def simulator() -> None:
    """Run the executable `simulator`."""
    _run("simulator")


def control_mixer() -> None:
    """Run the executable `control_mixer`."""
    _run("control_mixer")


def analysis() -> None:
    """Run the executable `analysis`."""
    _run("analysis")


def hover_hold() -> None:
    """Run the executable `hover_hold`."""
    _run("hover_hold")


def excite() -> None:
    """Run the executable `excite`."""
    _run("excite", INTERRUPTED)


def frames() -> None:
    """Run the executable `frames`."""
    _run("frames")


def teleop() -> None:
    """Run the executable `teleop`."""
    _run("teleop")


def joystick() -> None:
    """Run the executable `joystick`."""
    _run("joystick")


def replay() -> None:
    """Run the executable `replay`."""
    _run("replay", INTERRUPTED)


def cockpit() -> None:
    """Run the executable `cockpit`."""
    _run("cockpit")


def ardupilot() -> None:
    """Run the executable `ardupilot`."""
    _run("ardupilot")


def _run(name: str, interrupted: int = 0) -> None:
    _end_at_once_when_interrupted(interrupted)
    words = sys.argv[1:]
    own = words[: words.index("--ros-args")] if "--ros-args" in words else words
    if "--version" in own:
        print(command_line.version_line())
        return
    try:
        if {"-h", "--help"} & set(own):
            print(importlib.import_module("sbs_sim.nodes.usage").text(name), end="")
            return
        make_standard_streams_non_blocking()  # before anything takes hold of the standard output
        module = importlib.import_module(f"sbs_sim.nodes.{name}")
        if own and name not in OWN_COMMAND_LINE:
            print(importlib.import_module("sbs_sim.nodes.usage").unknown_argument(name, own), file=sys.stderr)
            sys.exit(2)
        module.main()
    except ModuleNotFoundError as error:
        if not (error.name or "").partition(".")[0].endswith(ROS):
            raise
        print(
            f"{name} needs ROS 2 and the package sbs_msgs: {error}; remedy: source them, or use ./run", file=sys.stderr
        )
        sys.exit(1)


def _end_at_once_when_interrupted(code: int = 0) -> None:
    """Until the nodes run there is nothing to be ended in good order: `sbs_sim.nodes.process.run` takes over then."""
    when_interrupted(lambda *_: os._exit(code))
