"""Names of our nodes that rclpy's own base classes use as well: python tools/robustness/rclpy_names.py [RCLPY ...].

A node that says `self._services = ...` replaces what rclpy keeps there, and fails far away from that line. Each
argument is a folder of the package rclpy (with node.py), of any version; without one the installed package is read.
Nothing is imported, so that versions which do not run here can be looked at.
"""

import ast
import importlib.util
import sys
from collections.abc import Iterable, Mapping
from pathlib import Path

OURS = Path(__file__).resolve().parents[2] / "sbs_sim" / "nodes"
THEIRS = ("node.py", "action/server.py")
BASES = frozenset(("Node", "BaseNode", "ActionServer"))
# what we override on purpose, with a call of rclpy's own
MEANT = {"ThreadedActionServer": frozenset(("notify_execute",)), "Component": frozenset(("destroy_node",))}


def names_of(found: ast.ClassDef) -> frozenset[str]:
    """Names that a class defines in its body or sets on `self`; without those with two underscores."""
    body = {node.name for node in found.body if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)}
    for statement in found.body:
        targets = [statement.target] if isinstance(statement, ast.AnnAssign) else getattr(statement, "targets", [])
        body |= {target.id for target in targets if isinstance(target, ast.Name)}
    body |= {
        node.attr
        for node in ast.walk(found)
        if isinstance(node, ast.Attribute)
        and isinstance(node.ctx, ast.Store)
        and isinstance(node.value, ast.Name)
        and node.value.id == "self"
    }
    return frozenset(name for name in body if not name.startswith("__"))


def classes(paths: Iterable[Path]) -> dict[str, ast.ClassDef]:
    """The classes of some files, by name."""
    trees = [ast.parse(path.read_text("utf-8")) for path in paths]
    return {node.name: node for tree in trees for node in ast.walk(tree) if isinstance(node, ast.ClassDef)}


def roots(name: str, known: Mapping[str, ast.ClassDef]) -> frozenset[str]:
    """Classes outside `known` from which a class comes in the end."""
    if name not in known:
        return frozenset((name,))
    bases = (base.id for base in known[name].bases if isinstance(base, ast.Name))
    return frozenset().union(*(roots(base, known) for base in bases))


def clashes(package: Path, ours: Path = OURS) -> list[str]:
    """Lines that name the class of ours and the name that rclpy's base class has too."""
    theirs = classes(package / name for name in THEIRS)
    taken = {name: names_of(theirs[name]) for name in BASES & theirs.keys()}
    taken["Node"] |= taken.get("BaseNode", frozenset())
    own = classes(sorted(ours.glob("*.py")))
    return [
        f"{name}.{clash} is a name of rclpy's {base}"
        for name, found in own.items()
        for base in sorted(roots(name, own) & taken.keys())
        for clash in sorted(names_of(found) & taken[base] - MEANT.get(name, frozenset()))
    ]


def installed() -> Path:
    """Folder of the installed rclpy."""
    found = importlib.util.find_spec("rclpy")
    if found is None or found.origin is None:
        raise SystemExit("rclpy is not installed: name a folder of it")
    return Path(found.origin).parent


def main() -> int:
    """Print the clashes with every package."""
    packages = [Path(name) for name in sys.argv[1:]] or [installed()]
    found = [f"{package}: {line}" for package in packages for line in clashes(package)]
    print("\n".join(found) or f"no clash with {', '.join(map(str, packages))}")
    return bool(found)


if __name__ == "__main__":
    sys.exit(main())
