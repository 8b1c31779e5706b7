"""How the package is put together: the library works without ROS, and imports run one way, without circles."""

import ast
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

import sbs_sim

PACKAGE = Path(sbs_sim.__file__).resolve().parent
ROS = ("rclpy", "rcl", "rosidl", "rmw", "ament", "launch", "tf2", "std_srvs", "builtin_interfaces")


def module_name(path):
    parts = path.relative_to(PACKAGE.parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


MODULES = {module_name(path): path for path in sorted(PACKAGE.rglob("*.py"))}
LIBRARY = [name for name in MODULES if not name.startswith("sbs_sim.nodes")]
COMMANDS = [name for name in MODULES if name.startswith("sbs_sim.commands")]
TREES = {name: ast.parse(path.read_text(encoding="utf-8")) for name, path in MODULES.items()}


def imports_of(name):
    """Full names of all that a module imports, anywhere in it."""
    found = set()
    for node in ast.walk(TREES[name]):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{name} imports relatively"
            # what is imported may be a module itself
            full = {f"{node.module}.{alias.name}" for alias in node.names}
            found |= {item if item in MODULES else node.module for item in full}
    return found


def is_type_checking(node):
    return isinstance(node, ast.If) and ast.unparse(node.test).endswith("TYPE_CHECKING")


def at_run_time(node):
    """All nodes of a tree but those that only annotations need."""
    yield node
    for child in ast.iter_child_nodes(node):
        if is_type_checking(child):
            for part in child.orelse:
                yield from at_run_time(part)
        else:
            yield from at_run_time(child)


def is_ros(name):
    top = name.split(".")[0]
    return top.startswith(ROS) or top.endswith(("_msgs", "_interfaces"))


def own_imports(name):
    return {item for item in imports_of(name) if item.split(".")[0] == "sbs_sim"}


def within(item, allowed):
    return any(item == layer or item.startswith(f"{layer}.") for layer in allowed)


def run_time_imports(name):
    """Modules of the package that a module imports when it runs, at its beginning or in its functions."""
    found = set()
    for node in at_run_time(TREES[name]):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            full = {f"{node.module}.{alias.name}" for alias in node.names}
            found |= {item if item in MODULES else node.module for item in full}
    return (found & set(MODULES)) - {name}


def circles(graph):
    """Sets of nodes that reach each other."""
    reached = {}
    for start in graph:
        seen, waiting = set(), list(graph[start])
        while waiting:
            node = waiting.pop()
            if node not in seen:
                seen.add(node)
                waiting += graph[node]
        reached[start] = seen
    return {frozenset(n for n in reached[node] if node in reached[n]) for node in graph if node in reached[node]}


def test_no_modules_import_each_other():
    assert circles({name: run_time_imports(name) for name in MODULES}) == set()


def test_a_circle_is_found():
    graph = {"a": {"b"}, "b": {"c"}, "c": {"a", "d"}, "d": set()}
    assert circles(graph) == {frozenset("abc")}


def test_the_search_finds_what_there_is():
    assert {"sbs_sim", "sbs_sim.aircraft", "sbs_sim.model.state", "sbs_sim.nodes.simulator"} <= set(MODULES)
    assert any(is_ros(item) for item in imports_of("sbs_sim.nodes.simulator"))
    assert "sbs_sim.model.records" in imports_of("sbs_sim.aircraft")
    assert {"sbs_sim.commands.trim", "sbs_sim.commands.linearize", "sbs_sim.commands.sweep"} <= set(COMMANDS)


@pytest.mark.parametrize("name", LIBRARY)
def test_only_nodes_import_ros(name):
    assert [item for item in imports_of(name) if is_ros(item)] == []


ALLOWED = {
    "sbs_sim.errors": [],
    "sbs_sim.checks": ["sbs_sim.errors"],
    "sbs_sim.content": [],
    "sbs_sim.concurrency.interruption": [],
    "sbs_sim.lanes": ["sbs_sim.lanes"],
    "sbs_sim.model": [
        "sbs_sim.lanes",
        "sbs_sim.model",
        "sbs_sim.checks",
        "sbs_sim.content",
        "sbs_sim.errors",
        "sbs_sim.concurrency.interruption",
    ],
    "sbs_sim.config_file": ["sbs_sim.errors"],
    "sbs_sim.validation": ["sbs_sim.checks"],
    "sbs_sim.aircraft.declaration": [],
    "sbs_sim.aircraft.atmosphere": ["sbs_sim.model"],
    "sbs_sim.aircraft.blade_mass": [],
    "sbs_sim.aircraft.description": [
        "sbs_sim.aircraft.atmosphere",
        "sbs_sim.aircraft.blade_mass",
        "sbs_sim.aircraft.declaration",
        "sbs_sim.content",
        "sbs_sim.model",
    ],
    "sbs_sim.aircraft": [
        "sbs_sim.aircraft",
        "sbs_sim.checks",
        "sbs_sim.config_file",
        "sbs_sim.content",
        "sbs_sim.errors",
        "sbs_sim.model",
        "sbs_sim.validation",
    ],
    "sbs_sim.flight": [
        "sbs_sim.aircraft",
        "sbs_sim.checks",
        "sbs_sim.concurrency.interruption",
        "sbs_sim.content",
        "sbs_sim.errors",
        "sbs_sim.flight",
        "sbs_sim.lanes",
        "sbs_sim.model",
        "sbs_sim.output",
    ],
    "sbs_sim.sensors": [
        "sbs_sim.aircraft",
        "sbs_sim.checks",
        "sbs_sim.errors",
        "sbs_sim.flight",
        "sbs_sim.model",
        "sbs_sim.sensors",
    ],
    "sbs_sim.flight.mixer": ["sbs_sim.aircraft", "sbs_sim.model", "sbs_sim.checks", "sbs_sim.errors"],
}
FORBIDDEN = {
    "sbs_sim.analysis": ["sbs_sim.nodes", "sbs_sim.recording", "sbs_sim.flight_loop"],
    "sbs_sim.recording": ["sbs_sim.nodes"],
    "sbs_sim.pilot": ["sbs_sim.nodes", "sbs_sim.recording", "sbs_sim.flight_loop"],
    "sbs_sim.ardupilot": ["sbs_sim.nodes", "sbs_sim.recording", "sbs_sim.flight_loop"],
    "sbs_sim.flight": [
        "sbs_sim.analysis",
        "sbs_sim.nodes",
        "sbs_sim.pilot",
        "sbs_sim.recording",
        "sbs_sim.flight_loop",
    ],
    "sbs_sim": ["sbs_sim.nodes"],  # everything, where the rule begins with a module's own package
}


@pytest.mark.parametrize("layer", ALLOWED)
def test_the_lower_layers_import_nothing_from_above(layer):
    members = [name for name in MODULES if within(name, [layer])]
    assert members
    for name in members:
        beyond = [item for item in own_imports(name) if not within(item, ALLOWED[layer])]
        assert beyond == [], f"{name} imports {beyond}"


@pytest.mark.parametrize("name", LIBRARY)
def test_imports_run_one_way(name):
    for layer, above in FORBIDDEN.items():
        if within(name, [layer]):
            assert [item for item in own_imports(name) if within(item, above)] == []


WITHOUT_CIRCLES = ["sbs_sim.nodes", "sbs_sim.recording", "sbs_sim.cockpit", "sbs_sim.pilot", "sbs_sim.flight_loop"]


def late_imports_of(name):
    """Full names of the modules that a module imports by name when it needs them."""
    calls = [node for node in ast.walk(TREES[name]) if isinstance(node, ast.Call)]
    names = {item.value for call in calls for item in call.args if isinstance(item, ast.Constant)}
    return {item for item in names if item in MODULES}


@pytest.mark.parametrize("package", WITHOUT_CIRCLES)
def test_no_file_imports_itself_by_way_of_others(package):
    graph = {name: (imports_of(name) | late_imports_of(name)) & set(MODULES) for name in MODULES}
    members = [name for name in MODULES if within(name, [package])]
    assert members
    assert [circle for circle in circles(graph) if circle & set(members)] == []


@pytest.mark.parametrize("name", [name for name in MODULES if within(name, ["sbs_sim.model"])])
def test_the_model_knows_nothing_of_the_time_of_day(name):
    assert not imports_of(name) & {"time", "datetime", "threading", "asyncio"}


@pytest.mark.parametrize("name", [name for name in MODULES if name not in COMMANDS and name != "sbs_sim.__main__"])
def test_nothing_imports_the_commands(name):
    assert [item for item in own_imports(name) if within(item, ["sbs_sim.commands"])] == []


@pytest.mark.parametrize("name", [name for name in LIBRARY if name not in COMMANDS])
def test_the_library_does_not_print(name):
    calls = [node for node in ast.walk(TREES[name]) if isinstance(node, ast.Call)]
    printing = [call.lineno for call in calls if isinstance(call.func, ast.Name) and call.func.id == "print"]
    assert printing == []
    assert "sys.stdout" not in ast.unparse(TREES[name])


WITHOUT_ROS = """
    import importlib, importlib.abc, pkgutil, sys

    class NoROS(importlib.abc.MetaPathFinder):
        def find_spec(self, name, path=None, target=None):
            top = name.split(".")[0]
            if top.startswith({ros!r}) or top.endswith(("_msgs", "_interfaces")):
                raise ImportError(f"no {{name}} here")

    sys.meta_path.insert(0, NoROS())
    for name in ("rclpy", "sbs_msgs.msg"):
        try:
            importlib.import_module(name)
        except ImportError:
            continue
        raise SystemExit(f"{{name}} can be imported")

    import sbs_sim

    count = 0
    for module in pkgutil.walk_packages(sbs_sim.__path__, "sbs_sim.", onerror=print):
        if not module.name.startswith("sbs_sim.nodes"):
            importlib.import_module(module.name)
            count += 1
    for name in sbs_sim.__all__:
        getattr(sbs_sim, name)
    point = sbs_sim.trim(sbs_sim.Aircraft.load("sbs"))
    print(count, point.residual < 1e-9, point.controls[0])
"""


def test_the_library_works_where_there_is_no_ros():
    code = textwrap.dedent(WITHOUT_ROS.format(ros=ROS))
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120, check=False)
    assert result.returncode == 0, result.stderr
    count, trimmed, collective = result.stdout.splitlines()[-1].split()
    assert int(count) >= len(LIBRARY) - 1
    assert trimmed == "True"
    assert 0.1 < float(collective) < 0.2


def test_what_is_not_there_is_an_attribute_error():
    with pytest.raises(AttributeError, match="module 'sbs_sim' has no attribute 'fly'"):
        sbs_sim.fly  # noqa: B018
