"""Message definitions: their text as recordings carry it, and what the text says of fields and units."""

import json
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from sbs_sim.errors import RecordingError

# The types of numbers and what numpy calls them; `char` is a byte in ROS 2.
NUMBERS = {
    "bool": "?",
    "byte": "u1",
    "char": "u1",
    "int8": "i1",
    "uint8": "u1",
    "int16": "i2",
    "uint16": "u2",
    "int32": "i4",
    "uint32": "u4",
    "int64": "i8",
    "uint64": "u8",
    "float32": "f4",
    "float64": "f8",
}
PRIMITIVES = frozenset([*NUMBERS, "string", "wstring"])
MAX_NESTING = 32  # levels of types in a type
SEQUENCE = -1  # count of a field whose length is in the message
SEPARATOR = "=" * 80

_FIELD = re.compile(
    r"\s*(?P<type>[A-Za-z][\w/]*)(?:<=\d+)?(?P<array>\[(?:<=\d+|\d*)\])?\s+(?P<name>[A-Za-z]\w*)\s*(?P<constant>=)?"
)
_UNIT = re.compile(r"\[(?!\d+\])([^\[\]]+)\]")
_INDEX = re.compile(r"\[\d+\]")
# What the standard definitions leave unsaid in a form that could be read.
_KNOWN_UNITS = {
    ("builtin_interfaces/Time", "sec"): "s",
    ("builtin_interfaces/Time", "nanosec"): "ns",
    ("builtin_interfaces/Duration", "sec"): "s",
    ("builtin_interfaces/Duration", "nanosec"): "ns",
}


@dataclass(frozen=True)
class Field:
    """One field of a message.

    Attributes
    ----------
    name : str
    type : str
        A primitive, or package/Type.
    count : int or None
        None for a single value, the length of a fixed array, SEQUENCE for one of any length.
    units : tuple of str
        The text in brackets in the comment right above the field or behind it.
    """

    name: str
    type: str
    count: int | None
    units: tuple[str, ...]


Definitions = dict[str, tuple[Field, ...]]  # by package/Type


def short_name(type_name: str) -> str:
    """package/Type of package/msg/Type."""
    return re.sub(r"/msg/", "/", type_name)


def message_definition(type_name: str, find_file: Callable[[str, str], Path]) -> str:
    """Text of a message type and of all types in it, joined as rosbag2 does.

    Parameters
    ----------
    type_name : str
        package/msg/Type
    find_file : callable
        Path of a file in the share folder of a package: `find_file("sbs_msgs", "msg/Controls.msg")`.

    Returns
    -------
    str
        The definition, then each other type once, led in by a line of 80 `=` and a line `MSG: package/Type`.

    Raises
    ------
    RecordingError
        A file cannot be read.
    """
    if short_name(type_name).count("/") != 1:
        raise RecordingError(f"message type {type_name!r}: allowed is package/msg/Type")
    package, kind = short_name(type_name).split("/")
    return _with_types(_read(find_file, package, "msg", kind), package, {short_name(type_name)}, find_file)


def service_definitions(type_name: str, find_file: Callable[[str, str], Path]) -> tuple[str, str]:
    """Texts of the request and of the response of a service, each as `message_definition` has that of a message.

    Parameters
    ----------
    type_name : str
        package/srv/Type
    find_file : callable
        See `message_definition`.

    Raises
    ------
    RecordingError
        A file cannot be read.
    """
    if not re.fullmatch(r"\w+/srv/\w+", type_name):
        raise RecordingError(f"service type {type_name!r}: allowed is package/srv/Type")
    package, _, kind = type_name.split("/")
    request, _, response = _read(find_file, package, "srv", kind).partition("---\n")
    return _with_types(request, package, set(), find_file), _with_types(response, package, set(), find_file)


def _with_types(text: str, package: str, seen: set[str], find_file: Callable[[str, str], Path]) -> str:
    """A definition, and behind it each type in it that has not been seen."""
    joined = [text]
    for other in sorted({field.type for field in fields_of(text, package)} - PRIMITIVES - seen):
        if other not in seen:
            seen.add(other)
            inner, kind = other.split("/")
            joined += ["\n", SEPARATOR, f"\nMSG: {other}\n"]
            joined.append(_with_types(_read(find_file, inner, "msg", kind), inner, seen, find_file))
    return "".join(joined)


def _read(find_file: Callable[[str, str], Path], package: str, folder: str, kind: str) -> str:
    try:
        return find_file(package, f"{folder}/{kind}.{folder}").read_text(encoding="utf-8")
    except (OSError, LookupError, UnicodeDecodeError) as error:
        what = {"msg": "message", "srv": "service"}[folder]
        raise RecordingError(f"no definition of {what} type {package}/{kind}: {error}") from None


def type_hash(type_name: str, find_file: Callable[[str, str], Path]) -> str:
    """Hash by which ROS 2 distinguishes types of one name (REP 2016), as the installed description of the type has it.

    Parameters
    ----------
    type_name, find_file
        See `message_definition`.

    Returns
    -------
    str
        RIHS01_ and 64 hexadecimal digits; empty where there is no description, as before ROS 2 Iron.
    """
    package, kind = short_name(type_name).split("/")
    try:
        description = json.loads(find_file(package, f"msg/{kind}.json").read_text(encoding="utf-8"))
        hashes = {item["type_name"]: str(item["hash_string"]) for item in description["type_hashes"]}
    except (OSError, LookupError, TypeError, ValueError):
        return ""
    return hashes.get(f"{package}/msg/{kind}", "")


def parse(type_name: str, text: str) -> Definitions:
    """Fields of a message type and of all types in it, from the joined text of `message_definition`.

    Raises
    ------
    RecordingError
        A type contains itself, or types are nested deeper than MAX_NESTING.
    """
    definitions = {name: fields_of(part, name.split("/")[0]) for name, part in parts(type_name, text)}
    _check_nesting(definitions, short_name(type_name), [], set())
    return definitions


def parts(type_name: str, text: str) -> Iterator[tuple[str, str]]:
    """Of a joined text the name of each type, package/Type, and its own text."""
    name = short_name(type_name)
    for part in re.split(r"^={3,}\s*$", text, flags=re.MULTILINE):
        head = re.match(r"\s*MSG:\s+(\S+)[^\n]*\n?", part)
        if head:
            name, part = short_name(head[1]), part[head.end() :]
        yield name, part


def _check_nesting(definitions: Definitions, kind: str, outer: list[str], checked: set[str]) -> None:
    """Raise RecordingError for a type that contains itself, or is nested too deep in the outer ones."""
    if kind in outer:
        raise RecordingError(f"message type {kind} contains itself")
    if len(outer) > MAX_NESTING:
        raise RecordingError(f"message type {outer[0]} has more than {MAX_NESTING} levels of types in it")
    for inner in {field.type for field in definitions.get(kind, ())} - PRIMITIVES - checked:
        _check_nesting(definitions, inner, [*outer, kind], checked)
    checked.add(kind)


def fields_of(text: str, package: str) -> tuple[Field, ...]:
    """Fields of one definition; constants are not fields."""
    fields = []
    above: list[str] = []  # the comment lines right above
    for line in text.splitlines():
        code, _, comment = line.partition("#")
        if not code.strip():
            above = [*above, comment] if line.strip() else []
            continue
        found = _FIELD.match(code)
        if found and not found["constant"]:
            kind = found["type"]
            if kind not in PRIMITIVES and "/" not in kind:
                kind = f"{package}/{kind}"
            units = tuple(_UNIT.findall(" ".join([*above, comment])))
            fields.append(Field(found["name"], short_name(kind), _count(found["array"]), units))
        above = []
    return tuple(fields)


def _count(array: str | None) -> int | None:
    if array is None:
        return None
    length = array.strip("[]")
    return int(length) if length.isdigit() else SEQUENCE


class Units:
    """Units of the fields of a message type by their flattened names.

    A field of a nested message that has no unit of its own has that of the field that holds it: the unit in the comment
    there, or the one at its index if there are as many as the nested message has fields (force [N] and torque [N m]).
    """

    def __init__(self, definitions: Definitions, root: str) -> None:
        self._units: dict[str, str] = {}
        self._definitions = definitions
        self._collect(root, "", ())

    def __getitem__(self, name: str) -> str:
        """Unit of a field such as `rotors[0].flap`; empty where none is said."""
        return self._units.get(_INDEX.sub("", name), "")

    def _collect(self, kind: str, prefix: str, inherited: tuple[str, ...]) -> None:
        fields = self._definitions.get(kind, ())
        for index, field in enumerate(fields):
            units = field.units or (inherited[index : index + 1] if len(inherited) == len(fields) else inherited[:1])
            if field.type in PRIMITIVES:
                unit = units[0] if units else ""
                self._units[prefix + field.name] = _KNOWN_UNITS.get((kind, field.name), unit)
            else:
                self._collect(field.type, f"{prefix}{field.name}.", units)


def qos_profiles(
    reliability: str = "reliable", durability: str = "volatile", history: str = "keep_last", depth: int = 10
) -> str:
    """What publishers offer, as the YAML that rosbag2 of Jazzy writes; `ros2 bag play` publishes accordingly."""
    forever = "sec: 9223372036\n    nsec: 854775807"
    return (
        f"- history: {history}\n  depth: {depth}\n  reliability: {reliability}\n  durability: {durability}\n"
        f"  deadline:\n    {forever}\n  lifespan:\n    {forever}\n"
        f"  liveliness: automatic\n  liveliness_lease_duration:\n    {forever}\n"
        "  avoid_ros_namespace_conventions: false"
    )
