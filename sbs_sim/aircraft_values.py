"""Single values of an aircraft file by path: "body.mass", "rotors.radius", "rotors[0].hub[2]", "rotors.MR1.radius"."""

import numbers
import re
from collections.abc import Mapping, Sequence
from typing import Any

from sbs_sim import checks
from sbs_sim.errors import AircraftError

Place = tuple[str | int, ...]

SYMMETRIC: Place = ("body", "inertia")
PATH = re.compile(r"[^.\[\]]+(\.[^.\[\]]+|\[\d{1,6}\])*")
STEP = re.compile(r"\[(?P<index>\d+)\]|(?P<key>[^.\[\]]+)")
# Of every number of a file by its last key; keys in _deg and _rpm say theirs.
UNITS = {
    **dict.fromkeys(("mass", "blade_mass"), "kg"),
    **dict.fromkeys(("hub", "radius", "blade_cg", "hinge_offset", "flap_hinge_offset", "root_cutout"), "m"),
    **dict.fromkeys(("flap_spring", "lag_spring"), "N m/rad"),
    **dict.fromkeys(("pitch_flap_coupling", "pitch_lag_coupling", "mixing"), "rad/rad"),
    "air_density": "kg/m^3",
    "kinematic_viscosity": "m^2/s",
    "speed_of_sound": "m/s",
    "gravity": "m/s²",
    "inertia": "kg m^2",
    "flat_plate_areas": "m^2",
    "lag_damping": "N m s/rad",
    "chord": "m",
    "twist_deg": "deg",
    "swashplate_rate_deg": "deg/s",
    **dict.fromkeys(("elements", "rotation", "blades", "shaft_direction", "tip_loss", "duct_expansion"), "1"),
}


def places(data: Mapping[str, Any], schema: Mapping[str, Any], path: str) -> list[Place]:
    """Places in the mapping of an aircraft file that a path means: several for "rotors.key", which is every rotor's.

    Parameters
    ----------
    data : mapping
        As the schema wants it.
    schema : mapping
        The JSON schema of aircraft files.
    path : str
        Keys with dots between them, indices of lists in brackets; a rotor may be given by its name.

    Raises
    ------
    AircraftError
        There is no such place: the message names the part of the path and what is allowed.
    """
    check_path(path)
    steps = [int(step["index"]) if step["index"] else step["key"] for step in STEP.finditer(path)]
    return _walk(data, schema, steps, "")


def check_path(path: Any) -> None:
    """Raise AircraftError for what is no path of keys and indices."""
    if not (isinstance(path, str) and path.isprintable() and PATH.fullmatch(path)):
        allowed = "allowed are keys like body.mass, rotors.radius, rotors[0].hub[2]"
        raise AircraftError(f"path = {checks.shown(path)}: {allowed}")


def _walk(node: Any, schema: Mapping[str, Any], steps: Sequence[str | int], done: str) -> list[Place]:
    """Places below a node, which the steps before have led to."""
    if not steps:
        return [()]
    step, rest = steps[0], steps[1:]
    if "properties" in schema:
        if step not in schema["properties"]:
            raise _unknown(done, step, "unknown key, ", ", ".join(schema["properties"]))
        inner = _walk(node.get(step), schema["properties"][step], rest, _joined(done, step))
        return [(step, *place) for place in inner]
    if "items" not in schema:
        raise AircraftError(f"{_joined(done, step)}: {done} is a single value")
    keys, names = schema["items"].get("properties", {}), _names(node)
    if step in keys:  # of every item
        chosen, rest = list(range(len(node))), steps
    elif step in names:
        chosen = [names.index(step)]
    elif isinstance(step, int) and step < len(node):
        chosen = [step]
    else:
        others = [] if isinstance(step, int) else [*names, *keys]
        raise _unknown(done, step, "", ", ".join([f"[0] to [{len(node) - 1}]", *others]))
    return [(i, *place) for i in chosen for place in _walk(node[i], schema["items"], rest, f"{done}[{i}]")]


def _names(items: Sequence[Any]) -> list[str]:
    """What the items of a list are called, if they are."""
    return [item["name"] for item in items if isinstance(item, Mapping) and "name" in item]


def _joined(done: str, step: str | int) -> str:
    return f"{done}[{step}]" if isinstance(step, int) else f"{done}.{step}".lstrip(".")


def _unknown(done: str, step: str | int, what: str, allowed: str) -> AircraftError:
    return AircraftError(f"{_joined(done, step)}: {what}allowed are {allowed}")


def value_at(data: Any, place: Place) -> Any:
    """Value at a place; None where an optional key is left out."""
    for step in place:
        data = data.get(step) if isinstance(data, dict) else data[step]
    return data


def replaced(data: Any, place: Place, value: Any) -> Any:
    """Copy of nested mappings and lists with another value at one place; all that is not on the way there is shared."""
    if not place:
        return value
    copy = data.copy()
    copy[place[0]] = replaced(data[place[0]], place[1:], value) if len(place) > 1 else value
    return copy


def mirrored(place: Place) -> Place:
    """Place with the same value by symmetry, that of an element of the inertia across its diagonal; else the same."""
    if place[:-2] == SYMMETRIC and len(place) == len(SYMMETRIC) + 2:
        return (*SYMMETRIC, place[-1], place[-2])
    return place


def separate(data: Any) -> Any:
    """Copy of nested mappings and lists that shares none of them, where YAML's anchors do; numbers are Python's own."""
    if isinstance(data, dict):
        return {key: separate(value) for key, value in data.items()}
    if isinstance(data, list):
        return [separate(value) for value in data]
    if isinstance(data, numbers.Number) and not isinstance(data, bool | int | float):
        return int(data) if isinstance(data, numbers.Integral) else float(data)  # type: ignore[arg-type]
    return data


def unit_of(path: str) -> str:
    """Unit of the value at a path, "1" for a plain number, empty for what is none or not known."""
    keys = [step["key"] for step in STEP.finditer(path) if step["key"]]
    for key in reversed(keys):
        if key in UNITS:
            return UNITS[key]
        if key.endswith("_deg"):
            return "deg"
        if key.endswith("_rpm"):
            return "rpm"
    return ""
