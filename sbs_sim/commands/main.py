"""`sbs-sim NAME`, or `python -m sbs_sim NAME`: every executable under one name, for those who have no `ros2 run`."""

import importlib
import sys
from collections.abc import Sequence

from sbs_sim.terminal import command_line

# Names, what is called, and what it is for; setup.py has the same for `ros2 run`.
EXECUTABLES = {
    "trim": ("sbs_sim.commands.trim:main", "trim an aircraft"),
    "linearize": ("sbs_sim.commands.linearize:main", "linear model of a steady flight, with its modes"),
    "sweep": ("sbs_sim.commands.sweep:main", "trims and modes along one parameter"),
    "qualities": ("sbs_sim.commands.qualities:main", "flying qualities over airspeed, with levels"),
    "identify": ("sbs_sim.commands.identify:main", "frequency responses from a recorded flight"),
    "performance": ("sbs_sim.commands.performance:main", "power, climb, ceiling and envelope in steady flight"),
    "stitch": ("sbs_sim.commands.stitch:main", "one nonlinear model of many linear ones"),
    "design": ("sbs_sim.commands.design:main", "a controller from hover to cruise, with margins and uncertainty"),
    "batch": ("sbs_sim.commands.batch:main", "Monte Carlo: many flights through turbulence"),
    "reproduce": ("sbs_sim.commands.reproduce:main", "the paper's results beside ours"),
    "validate": ("sbs_sim.commands.validate:main", "published results of others beside ours"),
    "gusts": ("sbs_sim.commands.gusts:main", "design the hover hold, and test it in turbulence and gusts"),
    "plot": ("sbs_sim.commands.plot:main", "draw a log over time"),
    "airfoil": ("sbs_sim.commands.airfoil:main", "airfoil data of other programs as a table"),
    "aircraft": ("sbs_sim.commands.aircraft:main", "write an aircraft as a commented file"),
    "simulator": ("sbs_sim.nodes.executables:simulator", "fly in real time (ROS 2)"),
    "control_mixer": ("sbs_sim.nodes.executables:control_mixer", "pilot controls to swashplates (ROS 2)"),
    "analysis": ("sbs_sim.nodes.executables:analysis", "trims, linear models and sweeps as services (ROS 2)"),
    "hover_hold": ("sbs_sim.nodes.executables:hover_hold", "hold position and heading (ROS 2)"),
    "excite": ("sbs_sim.nodes.executables:excite", "chirps and multisines on the controls (ROS 2)"),
    "frames": (
        "sbs_sim.nodes.executables:frames",
        "tf, robot_description and joint states, for RViz and others (ROS 2)",
    ),
    "teleop": ("sbs_sim.nodes.executables:teleop", "fly by the keyboard (ROS 2)"),
    "joystick": ("sbs_sim.nodes.executables:joystick", "fly by a gamepad or transmitter (ROS 2)"),
    "replay": ("sbs_sim.nodes.executables:replay", "publish, verify, repair or re-fly a log (ROS 2)"),
    "cockpit": ("sbs_sim.nodes.executables:cockpit", "fly in the browser (ROS 2)"),
    "ardupilot": ("sbs_sim.nodes.executables:ardupilot", "let ArduPilot fly (ROS 2)"),
}
COMPLETION = "completion"
# What brings modules that a wheel does not need for everything, see setup.py.
EXTRAS = {
    "matplotlib": "plots",
    "mcap": "logs",
    "mcap_ros2": "logs",
    "zstandard": "logs",
    "distributed": "dask",
    "control": "control",
}
USAGE = """usage: sbs-sim NAME [arguments]
       sbs-sim --version
       eval "$(sbs-sim completion)"     completes names, options and paths in bash
"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Executable `sbs-sim`."""
    name, *rest = [*(sys.argv[1:] if arguments is None else arguments), ""]
    if name in ("-h", "--help", "help"):
        print(f"{USAGE}\n{_listed()}\n\n`sbs-sim NAME --help` has the rest.")
        return 0
    if name == "--version":
        print(command_line.version_line())
        return 0
    if name == COMPLETION:
        return _print_completion()
    if name not in EXECUTABLES:
        known = [*EXECUTABLES, COMPLETION]
        print(USAGE if not name else f"sbs-sim: no {name!r}{command_line.suggestion(name, known)}", file=sys.stderr)
        print(f"there are: {', '.join(known)}", file=sys.stderr)
        return 2
    command_line.prefix = "sbs-sim "
    sys.argv[1:] = rest[:-1]
    module, _, function = EXECUTABLES[name][0].partition(":")
    try:
        return getattr(importlib.import_module(module), function)() or 0
    except ModuleNotFoundError as error:
        missing = (error.name or "").partition(".")[0]
        if missing not in EXTRAS:
            raise
        remedy = f"python3 -m pip install 'sbs-sim[{EXTRAS[missing]}]'"
        print(f"{name} needs {missing}, which is not installed; remedy: {remedy}", file=sys.stderr)
        return 1


def _listed() -> str:
    width = max(map(len, EXECUTABLES))
    return "\n".join(f"  {name.ljust(width)}  {meaning}" for name, (_, meaning) in EXECUTABLES.items())


def _print_completion() -> int:
    """What a shell evaluates to complete: the file may be anywhere."""
    import shlex

    from sbs_sim.config_file import config_folder

    print(f"source {shlex.quote(str(config_folder() / 'completion.bash'))}")
    return 0
