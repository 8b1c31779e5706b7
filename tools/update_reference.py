"""Write the generated pages of docs/reference anew: topics, services, parameters, commands, aircraft files, modules.

    ./run python tools/update_reference.py

takes what they say from msg_defs, from the parameters that the nodes declare, from the command lines, from the
declared values of aircraft files and from the docstrings: what is wrong on a page is wrong there. The pages of single
modules are made with the site (make_docs.py).
"""

import argparse
import ast
import importlib
import itertools
import re
import textwrap
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from sbs_sim.aircraft.declaration import Declaration, declarations, leaves
from sbs_sim.aircraft.description import Description
from sbs_sim.nodes.endpoints import Endpoint, endpoints, quality
from sbs_sim.nodes.parameters import Parameter

ROOT = Path(__file__).resolve().parent.parent
REFERENCE = ROOT / "docs" / "reference"
INTERFACES = ROOT / "msg_defs"
NOTE = "<!-- Made by tools/update_reference.py: do not edit. -->"

PARAMETERS = ("simulator", "control_mixer", "analysis", "hover_hold", "excite", "frames", "teleop", "joystick")
# What the definitions of others leave unsaid.
MEANINGS = {
    "clock": "Simulation time: `/clock`, but `/left/clock` in the namespace `/left`.",
    "diagnostics": "Health of the nodes: time-outs, clipped controls, refused messages.",
    "excitation": "What is added to the controls, whoever commands them; see the node `excite`.",
    "joint_states": "Azimuth, lag, flap and pitch of every blade [rad], named as in `robot_description`.",
    "joy": "Axes and buttons of a pad or transmitter.",
    "odom": "The motion of `state` in the axes of ROS: earth ENU, body FLU.",
    "cmd_vel": "Velocity along the heading in the axes of `base_link`: forward, left, up, and turn rate to the left.",
    "robot_description": "URDF made from the aircraft file, for RViz and others.",
    "target": "Where to go: position and heading, in the frame `ned` or `odom`.",
    "pause": "Pauses the flight (true) or lets it go on (false).",
}


# --- Markdown ---------------------------------------------------------------------------------------------------


def escaped(text: str) -> str:
    """Text in which nothing is taken for Markdown or HTML, outside of code."""
    parts = re.split(r"(`[^`]*`)", text)
    marks = r"([<*|\\]|(?<!\w)_|_(?!\w))"
    return "".join(part if part.startswith("`") else re.sub(marks, r"\\\1", part) for part in parts)


def cell(text: str) -> str:
    """Text for a cell of a table."""
    return " ".join(escaped(text).split())


def table(headings: list[str], rows: list[list[str]]) -> str:
    """A table of ready cells."""
    lines = [headings, ["---"] * len(headings), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def page(title: str, *parts: str) -> str:
    """A complete page."""
    return "\n\n".join([f"# {title}", NOTE, *(part.strip("\n") for part in parts if part.strip())]) + "\n"


def sentence(text: str) -> str:
    """The first sentence of a text, without what only makes sense in a longer one."""
    return re.split(r"(?<=[.])\s", " ".join(text.split()))[0]


# --- messages ---------------------------------------------------------------------------------------------------


@dataclass
class Entry:
    """A field or a constant of an interface, with its comment."""

    type: str
    name: str
    default: str
    comment: list[str]


@dataclass
class Part:
    """The comment above a field or between two lines of dashes: a message, request, answer ..."""

    comment: list[str] = field(default_factory=list)
    entries: list[Entry] = field(default_factory=list)


def parts_of(path: Path) -> list[Part]:
    """Read a .msg, .srv or .action file."""
    return [_part(text.splitlines()) for text in re.split(r"^---$", path.read_text(encoding="utf-8"), flags=re.M)]


def _part(lines: list[str]) -> Part:
    part, comment = Part(), []
    for line in lines:
        if line.startswith("#"):
            comment.append(line.removeprefix("#").removeprefix(" "))
        elif line.strip():
            kind, name, default = re.fullmatch(r"(\S+)\s+(\w+)\s*=?\s*(.*)", line.strip()).groups()
            part.entries.append(Entry(kind, name, default, comment))
            comment = []
        elif comment and not part.entries and not part.comment:
            part.comment, comment = comment, []
    return part


def prose(comment: list[str], indent: str = "") -> str:
    """A comment as Markdown: what is indented in it stays as it is."""
    blocks = []
    for is_code, lines in itertools.groupby(comment, lambda line: line.startswith("  ") if line.strip() else None):
        if is_code is not None:
            blocks.append("\n".join(f"    {line}" if is_code else escaped(line) for line in lines))
    return textwrap.indent("\n\n".join(blocks), indent).strip()


def typed(kind: str, place: str) -> str:
    """A type, as a link where it is described; `place` is the page of the messages."""
    plain = kind.partition("[")[0]
    if (INTERFACES / "msg" / f"{plain}.msg").exists():
        return f"[`{kind}`]({place}#{plain.lower()})"
    return f"`{kind}`"


def entries(part: Part, place: str) -> str:
    """Fields as a list."""
    lines = []
    for entry in part.entries:
        is_constant = entry.name.isupper()
        default = f" = `{entry.default}`" if entry.default else ""
        label = f"- {'constant ' if is_constant else ''}**`{entry.name}`** {typed(entry.type, place)}{default}"
        text = prose(entry.comment, "  ")
        lines.append(f"{label}: {text}" if text else label)
    return "\n".join(lines) or "Nothing."


# --- topics and services ----------------------------------------------------------------------------------------


def nodes_of(found: list[Endpoint], role: str) -> str:
    """The nodes with a role, each once."""
    names = dict.fromkeys(node for item in found if item.role == role for node in item.nodes)
    return ", ".join(f"`{name}`" for name in names)


def meaning(name: str, kind: str, folder: str) -> str:
    """What a topic or service is for, in one sentence."""
    path = INTERFACES / folder / f"{kind.partition('/')[2]}.{folder}"
    if name in MEANINGS or not kind.startswith("sbs_msgs/"):
        return escaped(MEANINGS[name])
    return cell(sentence(" ".join(parts_of(path)[0].comment)))


def topic_rows() -> list[list[str]]:
    """The table of the topics."""
    by_name: dict[str, list[Endpoint]] = {}
    for item in endpoints():
        if item.role in ("publisher", "subscription"):
            by_name.setdefault(item.name, []).append(item)
    rows = []
    for name, found in sorted(by_name.items(), key=lambda pair: pair[0].strip("/")):
        qos = next(item.qos for item in sorted(found, key=lambda item: item.role) if item.qos is not None)
        package, _, plain = found[0].type.partition("/")
        kind = f"[`{found[0].type}`](#{plain.lower()})" if package == "sbs_msgs" else f"`{found[0].type}`"
        ends = " to ".join(nodes_of(found, role) or "anybody" for role in ("publisher", "subscription"))
        rows.append([f"`{name}`", kind, meaning(name, found[0].type, "msg"), ends, quality(qos)])
    return rows


TOPICS = """
Units are SI, angles radians. Names are relative, so namespaces and remaps work. Nodes of others with `use_sim_time`
listen to `/clock` wherever they are: in a namespace they need `-r /clock:=/left/clock`. Besides the nodes of this
table, `cockpit` listens to what it draws and steers by `controls`, `replay` publishes what its log holds, and everybody
may publish `controls` or, without the mixer, `swashplate`.
"""


def topics() -> str:
    """docs/reference/topics.md."""
    parts = [TOPICS, table(["topic", "type", "holds", "from, to", "quality of service"], topic_rows()), "## Messages"]
    for path in sorted((INTERFACES / "msg").glob("*.msg")):
        (part,) = parts_of(path)
        parts += [f"### {path.stem}", prose(part.comment), entries(part, "")]
    return page("Topics", *parts)


SERVICES = """
What is wrong with a request is answered with `success` false and a `message` that names field, value and allowed range,
and changes nothing. The defaults of a request are those of the interface: what is left out has them. `replay` serves
`pause` too.

A thousand requests wait for their turn. A client among many needs as long a history, or loses answers while it is busy:
[why](../robustness.md#services-and-the-action).
"""
LABELS = {"srv": ("Request", "Answer"), "action": ("Goal", "Result", "Feedback")}


def services() -> str:
    """docs/reference/services.md."""
    found = [item for item in endpoints() if item.role in ("service", "action")]
    rows = []
    for item in found:
        package, _, plain = item.type.partition("/")
        folder = "srv" if item.role == "service" else "action"
        kind = f"[`{item.type}`](#{plain.lower()})" if package == "sbs_msgs" else f"`{item.type}`"
        text = meaning(item.name, item.type, folder)
        rows.append([f"`{item.name}`", item.role, kind, nodes_of([item], item.role), text])
    parts = [SERVICES, table(["name", "", "type", "node", "does"], rows)]
    for folder, labels in LABELS.items():
        for path in sorted((INTERFACES / folder).glob(f"*.{folder}")):
            sections = parts_of(path)
            parts += [f"## {path.stem}", prose(sections[0].comment)]
            for label, section in zip(labels, sections, strict=True):
                parts += [f"{label}:", entries(section, "topics.md")]
    return page("Services and actions", *parts)


# --- parameters -------------------------------------------------------------------------------------------------

PARAMETERS_TEXT = """
A parameter is given at the start, `./run simulator --ros-args -p airspeed:=15.0`, or from a file,
`--ros-args --params-file my.yaml`; [config/nodes.yaml](../../config/nodes.yaml) holds all of them for copying. One that
is unknown, of a wrong type or out of its range ends the node with one line. Those that say so can be set in flight.
"""


def shown(value: object) -> str:
    """A default as YAML has it."""
    if isinstance(value, bool):
        return f"`{str(value).lower()}`"
    if isinstance(value, list):
        return f"`[{', '.join(str(item) for item in value)}]`"
    return f"`{value}`" if value != "" else '`""`'


def parameter_row(name: str, parameter: Parameter) -> list[str]:
    """One line of a table."""
    span = "" if parameter.least is None else f"{parameter.least:.6g} to {parameter.most:.6g}"
    return [f"`{name}`", shown(parameter.default), span, "" if parameter.fixed else "yes", cell(parameter.description)]


def parameters() -> str:
    """docs/reference/parameters.md."""
    parts = [PARAMETERS_TEXT]
    for name in PARAMETERS:
        module = importlib.import_module(f"sbs_sim.nodes.{name}")
        rows = [parameter_row(key, parameter) for key, parameter in module.PARAMETERS.items()]
        parts += [f"## {name}", table(["parameter", "default", "range", "in flight", "meaning"], rows)]
    return page("Parameters", *parts)


# --- commands ---------------------------------------------------------------------------------------------------

ALL, SUPPRESSED = ("help", "version"), argparse.SUPPRESS
COMMANDS_TEXT = """
`./run NAME` is the same as `ros2 run sbs_sim NAME`. Errors are one line and exit code 1, a wrong command line is 2,
Ctrl-C 130 where there is something to be cut short. Each has `--version`, and `--help`, which of nodes lists topics,
services and parameters. Executables without a command line of their own take ROS arguments: their parameters are in
[Parameters](parameters.md). Outside of ROS the package brings one command for all of them, `sbs-sim NAME`.

The same options mean the same everywhere: `--set PATH=VALUE` changes the aircraft, `--out` is where the main
result goes, `--csv` and `--json` hold it all in SI units and radians. Angles are typed in degrees, their names end in
`deg`; parameters, messages and services of ROS are in radians, as REP 103 has it, but for those that end in `_deg`.
"""


def executables() -> dict[str, str]:
    """Names of the executables and the modules that are behind them, in the order of setup.py."""
    found = re.findall(r'"(\w+) = ([\w.]+):\w+"', (ROOT / "setup.py").read_text(encoding="utf-8"))
    return {name: module.replace("nodes.executables", f"nodes.{name}") for name, module in found}


def parser_of(module: str) -> argparse.ArgumentParser | None:
    """The command line of an executable, None if it has none of its own."""
    make = getattr(importlib.import_module(module), "make_parser", None)
    return make() if make else None


def option_row(parser: argparse.ArgumentParser, action: argparse.Action) -> list[str]:
    """One line of a table."""
    text = (action.help or "") % {"prog": parser.prog, **vars(action)}
    names = action.option_strings or [""]
    metavar = action.metavar or ("|".join(map(str, action.choices)) if action.choices else action.dest.upper())
    metavar = " ".join(metavar) if isinstance(metavar, tuple) else metavar
    value = f" {metavar}" if action.nargs != 0 else ""
    code = ", ".join(f"{name}{value}".strip() for name in names)
    more = " (several)" if action.nargs in ("+", "*") else ""
    return [f"`{code}`{more}".replace("|", "\\|"), cell(text)]


def options(parser: argparse.ArgumentParser) -> str:
    """Arguments and options, group by group."""
    rows = []
    for group in parser._action_groups:
        chosen = [action for action in group._group_actions if action.dest not in ALL and action.help != SUPPRESSED]
        rows += [option_row(parser, action) for action in chosen]
    return table(["argument", "meaning"], rows)


def commands() -> str:
    """docs/reference/commands.md."""
    parts = [COMMANDS_TEXT]
    for name, module in executables().items():
        parser = parser_of(module)
        parts.append(f"## {name}")
        if parser is None:
            text = sentence(importlib.import_module(module).__doc__ or "").partition(": ")[2]
            parts.append(f"{escaped(text[:1].upper() + text[1:])} Node: [parameters](parameters.md#{name}).")
        else:
            parts += [escaped(parser.description or ""), options(parser), escaped(parser.epilog or "")]
    return page("Commands", *parts)


# --- modules ----------------------------------------------------------------------------------------------------

API_TEXT = """
`import sbs_sim` needs no ROS. What most need is at hand there: `Aircraft`, `trim`, `linearize`, `sweep`, `simulate`,
`simulate_batch`, and what they return; the rest is imported from its module. Each name links to the source, or, on the
site that `tools/make_docs.py` makes, to the documentation of all that is in the module, with the shapes, units and
frames of its arguments.
"""
LAYERS = {
    "Library": ("sbs_sim",),
    "Aircraft": ("sbs_sim.aircraft", "sbs_sim.aircraft.airfoil_files"),
    "Flights": ("sbs_sim.flight",),
    "Analysis": ("sbs_sim.analysis",),
    "Recordings": ("sbs_sim.recording",),
    "Pilots": ("sbs_sim.pilot",),
    "Model": ("sbs_sim.model",),
    "Concurrency, terminal, output": ("sbs_sim.concurrency", "sbs_sim.terminal", "sbs_sim.output"),
}


def modules(layer: str) -> dict[str, Path]:
    """Modules right in a package, by name, the package first."""
    folder = ROOT.joinpath(*layer.split("."))
    paths = [folder / "__init__.py", *(path for path in sorted(folder.glob("*.py")) if path.name != "__init__.py")]
    return {layer if path.name == "__init__.py" else f"{layer}.{path.stem}": path for path in paths}


def api() -> str:
    """docs/reference/api.md."""
    parts = [API_TEXT]
    for heading, layers in LAYERS.items():
        rows = []
        for layer in layers:
            for name, path in modules(layer).items():
                text = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or ""
                summary = " ".join(text.partition("\n\n")[0].split())
                rows.append([f"[`{name}`](../../{path.relative_to(ROOT).as_posix()})", cell(summary)])
        parts += [f"## {heading}", table(["module", "what is in it"], rows)]
    return page("Python API", *parts)


# --- aircraft files ---------------------------------------------------------------------------------------------

AIRCRAFT_TEXT = """
Every key of an aircraft file, as `sbs_sim/aircraft/description.py` declares it. Range, unit and default are those of
the file; the unit behind an arrow is that of the attribute in Python. Keys without a default are required. `--set` and
`Aircraft.with_value` take the same paths; `rotors[0].radius` or `rotors.MR1.radius` is the value of one rotor. The
symbols are those of the [theory](../theory.md#symbols). [The schema](../../config/aircraft.schema.json) has the same
ranges for editors. [Make an aircraft file of your own](../howto/own_aircraft.md) shows where to start.
"""
HEADINGS = ("key", "symbol", "range", "unit", "default", "in Python", "meaning")


def allowed(schema: Mapping[str, Any]) -> str:
    """What a schema allows, in words."""
    kind = schema.get("type")
    if "enum" in schema:
        return ", ".join(f"`{item}`" for item in schema["enum"])
    if kind == "string":
        return "text"
    if kind == "boolean":
        return "`true`, `false`"
    if kind == "array" and schema["items"].get("type") == "string":
        return f"list of {schema['minItems']} to {schema['maxItems']} texts"
    if kind == "object":
        if "properties" not in schema:
            return f"by name: {allowed(schema['additionalProperties'])}"
        names, inner = list(schema["properties"]), next(iter(schema["properties"].values()))
        if any(part != inner for part in schema["properties"].values()):
            return "; ".join(f"`{name}` {allowed(part)}" for name, part in schema["properties"].items())
        many = "for each of " if len(names) > 1 else ""
        return f"{many}{', '.join(f'`{name}`' for name in names)}: {allowed(inner)}"
    if kind == "array" and "enum" in schema["items"]:
        return f"any of {allowed(schema['items'])}"
    if kind == "array":
        sizes = []
        while schema["type"] == "array":
            least, most = schema["minItems"], schema["maxItems"]
            sizes.append(str(least) if least == most else f"{least} to {most}")
            schema = schema["items"]
        return f"{' × '.join(sizes)} numbers, each {allowed(schema)}"
    low = f"{schema['minimum']:g}" if "minimum" in schema else f"above {schema['exclusiveMinimum']:g}"
    return f"{low} to {schema['maximum']:g}{', integer' if kind == 'integer' else ''}"


def _default(declaration: Declaration) -> str:
    if declaration.is_required:
        return ""
    return "optional" if declaration.default is None else shown(declaration.default)


def aircraft_row(path: str, name: str, declaration: Declaration) -> list[str]:
    """One line of a table."""
    converted = f" → {declaration.internal_unit}" if declaration.internal_unit != declaration.unit else ""
    return [
        f"`{path}`",
        ", ".join(f"${symbol}$" for symbol in declaration.symbol.split(", ") if symbol),
        allowed(declaration.schema),
        f"{declaration.unit}{converted}",
        _default(declaration),
        f"`{name}`",
        cell(declaration.text),
    ]


def aircraft(record: type = Description) -> str:
    """docs/reference/aircraft.md."""
    parts = [AIRCRAFT_TEXT]
    rows: dict[str, list[list[str]]] = {}
    for path, name, declaration in leaves(record):
        rows.setdefault(path.partition(".")[0] if "." in path else "", []).append(aircraft_row(path, name, declaration))
    for part, declaration in declarations(record).items():
        if declaration.record:
            parts += [f"## {part}", f"{declaration.text}.", table(list(HEADINGS), rows[part])]
    return page("Aircraft files", *parts[:1], table(list(HEADINGS), rows[""]), *parts[1:])


PAGES: dict[str, Callable[[], str]] = {
    "topics": topics,
    "services": services,
    "parameters": parameters,
    "commands": commands,
    "aircraft": aircraft,
    "api": api,
}


def main() -> None:
    """Write all pages."""
    REFERENCE.mkdir(parents=True, exist_ok=True)
    for name, make in PAGES.items():
        (REFERENCE / f"{name}.md").write_text(make(), encoding="utf-8")


if __name__ == "__main__":
    main()
