"""Aircraft as a commented YAML file: each key with its unit and meaning, as `description.py` declares them."""

import io
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sbs_sim.aircraft.declaration import schema_of
from sbs_sim.aircraft.description import Description

if TYPE_CHECKING:
    from sbs_sim.aircraft import Aircraft

HEADER = """\
# SI units; angles in degrees where a key ends in _deg, rotor speeds in revolutions per minute where it ends in _rpm.
# Body axes: x forward, y right, z down, origin at the c.g. Keys that are left out have their default.
"""
COMMENT_COLUMN = 44


def commented_yaml(aircraft: "Aircraft") -> str:
    """Text of a file that describes an aircraft, with a comment behind each key that is declared.

    Airfoils that are files beside the aircraft's own keep their place: they are named by absolute paths.

    Parameters
    ----------
    aircraft : Aircraft

    Returns
    -------
    str
        `Aircraft.load` of it gives an equal aircraft.
    """
    from ruamel.yaml import YAML  # here, because it is slow to import

    rotors = [_with_absolute_airfoil(rotor, aircraft.folder) for rotor in aircraft.data["rotors"]]
    text, yaml = io.StringIO(), YAML()
    yaml.width = 2**16
    yaml.indent(mapping=2, sequence=4, offset=2)
    yaml.dump(_commented({**aircraft.data, "rotors": rotors}, schema_of(Description)), text)
    return HEADER + text.getvalue()


def _with_absolute_airfoil(rotor: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    made = {**rotor, "airfoil": _absolute(rotor["airfoil"], folder)}
    if outboard := rotor.get("outboard_airfoils"):
        made["outboard_airfoils"] = {**outboard, "values": [_absolute(name, folder) for name in outboard["values"]]}
    return made


def _absolute(name: str, folder: Path) -> str:
    return str(folder / name) if (folder / name).is_file() else name


def _commented(node: Any, schema: Mapping[str, Any]) -> Any:
    """Mappings and lists of ruamel with the comments of a schema; lists of numbers in one line."""
    from ruamel.yaml.comments import CommentedMap, CommentedSeq

    if isinstance(node, Mapping):
        made = CommentedMap()
        for key, value in node.items():
            part = schema.get("properties", {}).get(key) or schema.get("additionalProperties") or {}
            made[key] = _commented(value, part if isinstance(part, Mapping) else {})
            if comment := part.get("description") if isinstance(part, Mapping) else None:
                made.yaml_add_eol_comment(comment, key, column=COMMENT_COLUMN)
        return made
    if isinstance(node, list):
        items = CommentedSeq(_commented(item, schema.get("items", {})) for item in node)
        if not any(isinstance(item, Mapping) for item in node):
            items.fa.set_flow_style()
        return items
    return node
