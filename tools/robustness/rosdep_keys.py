"""Every key of our package.xml files, against the lists of rosdep and of each distribution.

    git clone https://github.com/ros/rosdistro
    ./run python tools/robustness/rosdep_keys.py rosdistro

Prints for each distribution its platforms and the keys that neither it nor rosdep knows. The exit code is 1 if there
are any.
"""

import argparse
import sys
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from ruamel.yaml import YAML

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = (ROOT / "package.xml", ROOT / "msg_defs" / "package.xml")
DISTRIBUTIONS = ("humble", "jazzy", "kilted", "lyrical", "rolling")
LISTS = ("rosdep/python.yaml", "rosdep/base.yaml")


def main() -> int:
    """Print what is missing."""
    parser = argparse.ArgumentParser(description="Check the keys of package.xml against rosdep and the distributions.")
    parser.add_argument("folder", type=Path, help="a checkout of github.com/ros/rosdistro")
    folder = parser.parse_args().folder
    keys, own = _keys()
    known = {key for name in LISTS for key in _read(folder / name)}
    wrong = False
    for name in DISTRIBUTIONS:
        content = _read(folder / name / "distribution.yaml")
        missing = sorted(keys - own - known - _released(content))
        platforms = ", ".join(
            f"{system} {release}" for system, found in content["release_platforms"].items() for release in found
        )
        verdict = f"missing: {', '.join(missing)}" if missing else "all known"
        print(f"{name} ({platforms}): {len(keys - own)} keys, {verdict}")
        wrong = wrong or bool(missing)
    return int(wrong)


def _keys() -> tuple[set[str], set[str]]:
    """Keys of all dependencies, and names of our packages."""
    roots = [ElementTree.parse(path).getroot() for path in PACKAGES]
    found = {part.text or "" for root in roots for part in root if part.tag.endswith("depend")}
    return found, {root.findtext("name", "") for root in roots}


def _read(path: Path) -> Any:
    return YAML(typ="safe").load(path)


def _released(content: Any) -> set[str]:
    """Packages of a distribution."""
    releases = {name: part.get("release") or {} for name, part in content["repositories"].items()}
    return {package for name, release in releases.items() for package in release.get("packages", [name])}


if __name__ == "__main__":
    sys.exit(main())
