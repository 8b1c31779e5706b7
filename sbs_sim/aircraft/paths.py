"""Single values of an aircraft file by path: "body.mass", "rotors.radius", "rotors[0].hub[2]", "rotors.MR1.radius"."""

import numbers
import re
from collections.abc import Mapping, Sequence
from typing import Any

from sbs_sim import checks
from sbs_sim.aircraft.declaration import units
from sbs_sim.aircraft.description import BLADE_MASS, DERIVED_FROM, GIVEN_AIR, Description
from sbs_sim.errors import AircraftError

Location = tuple[str | int, ...]

SYMMETRIC: Location = ("body", "inertia")
PATH = re.compile(r"[^.\[\]]+(\.[^.\[\]]+|\[\d{1,6}\])*")
STEP = re.compile(r"\[(?P<index>\d+)\]|(?P<key>[^.\[\]]+)")


def locations(data: Mapping[str, Any], schema: Mapping[str, Any], path: str) -> list[Location]:
    """Locations in the mapping of an aircraft file that a path means: several for "rotors.key", which is every rotor's.

    Parameters
    ----------
    data : mapping
        Accepted by the schema.
    schema : mapping
        The JSON schema of aircraft files.
    path : str
        Keys with dots between them, indices of lists in brackets; a rotor may be given by its name.

    Raises
    ------
    AircraftError
        The path does not exist: the message names the part that is wrong and what is allowed.
    """
    check_path(path)
    steps = [int(step["index"]) if step["index"] else step["key"] for step in STEP.finditer(path)]
    return _walk(data, schema, steps, "")


def check_path(path: Any) -> None:
    """Raise AircraftError for anything but a path of keys and indices."""
    if not (isinstance(path, str) and path.isprintable() and PATH.fullmatch(path)):
        allowed = "allowed are keys like body.mass, rotors.radius, rotors[0].hub[2]"
        raise AircraftError(f"path = {checks.shown(path)}: {allowed}")


def _walk(node: Any, schema: Mapping[str, Any], steps: Sequence[str | int], done: str) -> list[Location]:
    """Locations below a node; `done` is the path to that node."""
    if not steps:
        return [()]
    step, rest = steps[0], steps[1:]
    if "properties" in schema:
        if step not in schema["properties"]:
            raise _unknown(done, step, "unknown key, ", ", ".join(schema["properties"]))
        inner = _walk((node or {}).get(step), schema["properties"][step], rest, _joined(done, step))
        return [(step, *location) for location in inner]
    if isinstance(named := schema.get("additionalProperties"), Mapping):  # names of the file's own
        inner = _walk((node or {}).get(step), named, rest, _joined(done, step))
        return [(step, *location) for location in inner]
    if "items" not in schema:
        raise AircraftError(f"{_joined(done, step)}: {done} is a single value")
    if node is None:
        raise AircraftError(f"{_joined(done, step)}: {done} is left out, allowed is to set the whole list")
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
    return [(i, *location) for i in chosen for location in _walk(node[i], schema["items"], rest, f"{done}[{i}]")]


def _names(items: Sequence[Any]) -> list[str]:
    """Names of the items of a list that have one."""
    return [item["name"] for item in items if isinstance(item, Mapping) and "name" in item]


def _joined(done: str, step: str | int) -> str:
    return f"{done}[{step}]" if isinstance(step, int) else f"{done}.{step}".lstrip(".")


def _unknown(done: str, step: str | int, what: str, allowed: str) -> AircraftError:
    return AircraftError(f"{_joined(done, step)}: {what}allowed are {allowed}")


def path_of(location: Location) -> str:
    """Path of a location: "rotors[0].radius"."""
    path = ""
    for step in location:
        path = _joined(path, step)
    return path


def value_at(data: Any, location: Location) -> Any:
    """Value at a location; None where an optional key is left out."""
    for step in location:
        if data is None:
            return None
        data = data.get(step) if isinstance(data, dict) else data[step]
    return data


def replaced(data: Any, location: Location, value: Any) -> Any:
    """Copy of nested mappings and lists with another value at one location; it shares all unchanged parts."""
    if not location:
        return value
    first, rest = location[0], location[1:]
    copy = {} if data is None else data.copy()
    copy[first] = replaced(value_at(data, (first,)), rest, value)
    return copy


def mirrored(location: Location) -> Location:
    """Location with the same value by symmetry: of an element of the inertia that across the diagonal, else itself."""
    if location[:-2] == SYMMETRIC and len(location) == len(SYMMETRIC) + 2:
        return (*SYMMETRIC, location[-1], location[-2])
    return location


def instead_of(location: Location) -> list[Location]:
    """Locations of values that the one at a location replaces, since they follow from it.

    An altitude replaces the air; a distribution of mass replaces mass, c.g. and inertia of a blade.
    """
    if location == ("environment", "altitude"):
        return [("environment", key) for key in GIVEN_AIR]
    if location[:1] == ("rotors",) and location[2:3] == DERIVED_FROM:
        return [(*location[:2], key) for key in BLADE_MASS]
    return []


def without(data: Any, location: Location) -> Any:
    """Copy of nested mappings and lists without the value at a location, if there is one."""
    *steps, last = location
    inner = value_at(data, tuple(steps))
    return replaced(data, tuple(steps), {key: value for key, value in inner.items() if key != last})


def separate(data: Any) -> Any:
    """Copy of nested mappings and lists in which none is shared, as YAML's anchors do; numbers become int or float."""
    if isinstance(data, dict):
        return {key: separate(value) for key, value in data.items()}
    if isinstance(data, list):
        return [separate(value) for value in data]
    if isinstance(data, numbers.Number) and not isinstance(data, bool | int | float):
        return int(data) if isinstance(data, numbers.Integral) else float(data)  # type: ignore[arg-type]
    return data


def unit_of(path: str, record: type = Description) -> str:
    """Unit of the value at a path, "1" for a plain number, empty for what is no number or not known.

    Parameters
    ----------
    path : str
        As for `locations`.
    record : type
        Dataclass with the declarations of the file.
    """
    keys = tuple(step["key"] for step in STEP.finditer(path) if step["key"])
    known = units(record)
    if keys[:1] == ("controls",) and keys[-1].endswith("_deg"):
        return "deg"
    for chosen in (keys, keys[:1] + keys[2:], keys[:2] + keys[3:]):  # one may be the name of a rotor or surface
        for count in range(len(chosen), 0, -1):
            if chosen[:count] in known:
                return known[chosen[:count]]
    return ""
