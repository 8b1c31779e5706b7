"""`--help` of the nodes: what they do, their topics, services and parameters, an example."""

import ast
import importlib
import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from sbs_sim.nodes.endpoints import Endpoint, endpoints
from sbs_sim.nodes.parameters import Parameter
from sbs_sim.terminal import command_line

WIDTH = 100
# Nodes that an executable starts in its process.
WITH = {
    "simulator": ("simulator", "control_mixer", "analysis", "recorder"),
    "ardupilot": ("simulator", "analysis", "recorder", "ardupilot"),
}
EXAMPLES = {
    "simulator": "simulator --ros-args -p airspeed:=15.0 -p record:=off",
    "control_mixer": "control_mixer --ros-args -p aircraft:=/path/to/my.yaml",
    "analysis": "analysis --ros-args -p aircraft:=sbs_paper",
    "hover_hold": "hover_hold --ros-args -p position_limit:=0.25",
    "excite": "excite --ros-args -p controls:=[longitudinal_cyclic] -p amplitude_deg:=0.5 -p low:=1.0 -p high:=20.0",
    "frames": "frames --ros-args -p aircraft:=uh60a_tm85890 -p rate:=30.0",
    "teleop": "teleop --ros-args -p cyclic_deg:=1.5",
    "joystick": "joystick --ros-args -p pad:=xbox",
    "cockpit": "cockpit --port 8081 --ros-args -p airspeed:=15.0",
    "ardupilot": "ardupilot --ros-args -p wind:=[4.0,0.0,0.0]",
    "replay": "replay bags/hover_step.mcap --rate 0.5",
}
TITLES = {"publisher": "publishes", "subscription": "subscribes", "service": "serves", "action": "serves, as an action"}


def text(name: str) -> str:
    """Help of an executable.

    Parameters
    ----------
    name : str
        Of a module of this package with a `main`.
    """
    module = importlib.import_module(f"sbs_sim.nodes.{name}")
    call = f"{command_line.prefix or './run '}{name}"
    if hasattr(module, "make_parser"):
        parts = [module.make_parser().format_help().rstrip()]
    else:
        parts = [f"usage: {call} [--help] [--version] [--ros-args -p NAME:=VALUE ...]"]
    parts.append(_docstring(name).rstrip())
    if name in WITH:
        nodes = f"{', '.join(WITH[name][:-1])} and {WITH[name][-1]}"
        parts.append(
            f"The executable starts the nodes {nodes} in one process; the parameter `components` selects them."
        )
    parts += _endpoints([item for item in endpoints() if set(WITH.get(name, (name,))) & set(item.nodes)])
    if parameters := getattr(module, "PARAMETERS", None):
        parts.append(
            _section("parameters, with --ros-args -p NAME:=VALUE", [_parameter(*one) for one in parameters.items()])
        )
    if not hasattr(module, "make_parser"):
        parts.append(f"example: {call.removesuffix(name)}{EXAMPLES[name]}")
    return "\n\n".join(parts) + "\n"


def _docstring(name: str) -> str:
    """What the sources say of an executable; not all of them can be imported where something is not installed."""
    files = (name, f"{name}_node") if name == "cockpit" else (name,)
    sources = (Path(__file__).with_name(f"{file}.py").read_text(encoding="utf-8") for file in files)
    return "\n\n".join(ast.get_docstring(ast.parse(source)) or "" for source in sources)


def unknown_argument(name: str, words: Sequence[str]) -> str:
    """What is wrong with the arguments of an executable that takes none of its own; empty if there are none."""
    if not words:
        return ""
    parameters = importlib.import_module(f"sbs_sim.nodes.{name}").PARAMETERS
    word = words[0].lstrip("-").partition("=")[0].replace("-", "_")
    near = word if word in parameters else command_line.suggestion(word, parameters)[len("; did you mean ") : -1]
    return f"unknown argument {words[0]}: parameters are given as --ros-args -p {near or 'name'}:=value"


def _endpoints(found: Sequence[Endpoint]) -> list[str]:
    """A section for each role, names once each."""
    sections = []
    for role, title in TITLES.items():
        rows = dict.fromkeys((item.name, item.type) for item in found if item.role == role)
        if rows:
            width = max(len(name) for name, _ in rows)
            sections.append(_section(title, [f"{name.ljust(width)}  {kind}" for name, kind in rows]))
    return sections


def _parameter(name: str, parameter: Parameter) -> str:
    span = "" if parameter.least is None else f", {parameter.least:g} to {parameter.most:g}"
    flight = "" if parameter.fixed else ", can be set in flight"
    lines = textwrap.wrap(parameter.description, WIDTH - 6)
    return "\n      ".join([f"{name} (default: {_yaml(parameter.default)}{span}{flight})", *lines])


def _yaml(value: Any) -> str:
    """A default as --ros-args takes it."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, list):
        return f"[{', '.join(map(_yaml, value))}]"
    return str(value) if value != "" else '""'


def _section(title: str, lines: Sequence[str]) -> str:
    return "\n".join([f"{title}:", *(f"  {line}" for line in lines)])
