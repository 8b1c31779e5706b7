r"""How a value of an aircraft file is declared, and all that follows from a declaration.

Each value is one field of a dataclass in `sbs_sim.aircraft.description`. To add a value, declare it there,

    lag_stop: float = number("Lag angle at which the stop begins", 0, 90, "deg", symbol=r"\xi_s", default=90)

and use it: `rotor.lag_stop` is in radians, since the unit of the file is "deg"; the key of the file is `lag_stop_deg`.
Files may leave it out, since it has a default; aircraft that have the default keep their `parameter_hash`. The schema
(`./run python tools/make_schema.py`), the checks of files and of `--set`, the units of tables and the page
docs/reference/aircraft.md (`./run python tools/update_reference.py`) follow from the declaration. Where the compiled
model takes the value as it is, `model_field` names the field of `sbs_sim.model.records` that holds it.
"""

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cache
from types import MappingProxyType
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

Function = TypeVar("Function", bound=Callable[..., Any])

METADATA_KEY = "declaration"
NAME_PATTERN, MAX_NAME_LENGTH = "^[a-z][a-z0-9_]*$", 64  # of what a file names
REQUIRED = object()  # instead of a default
# From the unit of the file to radians, and the end that this unit gives to the key.
CONVERSIONS: dict[str, tuple[str, str, Callable[[float], float]]] = {
    "deg": ("_deg", "rad", math.radians),
    "deg/s": ("_deg", "rad/s", math.radians),
    "rpm": ("_rpm", "rad/s", lambda value: value * math.pi / 30),
}


@dataclass(frozen=True)
class Declaration:
    """What is known of one value of an aircraft file.

    Attributes
    ----------
    text : str
        One sentence without a full stop.
    schema : mapping
        JSON schema of the value in the file, without its description.
    read : callable
        Makes the internal value of that in the file.
    unit : str
        In the file; "1" for a plain number, empty for what is no number.
    key : str
        In the file, with dots where it is nested; made of the field's name and the unit where it is empty.
    symbol : str
        LaTeX, as in the table of symbols of docs/theory.md; several with ", " between them.
    default : object
        What counts where the file leaves the key out, in the unit of the file; REQUIRED for a key that each file needs,
        None for one without which there is nothing.
    is_physics : bool
        The value counts in `Aircraft.parameter_hash`.
    model_field : str
        Field of the compiled model's records with the same value; empty if there is none.
    record : type or None
        Dataclass of the part, or of each of the parts, that the value consists of.
    is_derivable : bool
        The key may be left out without a default, since the schema of the part allows others in its place.
    """

    text: str
    schema: Mapping[str, Any]
    read: Callable[[Any], Any]
    unit: str = ""
    key: str = ""
    symbol: str = ""
    default: Any = REQUIRED
    is_physics: bool = True
    model_field: str = ""
    record: type | None = None
    is_derivable: bool = False

    @property
    def is_required(self) -> bool:
        """A value without a default."""
        return self.default is REQUIRED

    @property
    def keys(self) -> tuple[str, ...]:
        """Keys from the mapping of the part to the value."""
        return tuple(self.key.split("."))

    @property
    def internal_unit(self) -> str:
        """Unit of the value in the package."""
        return CONVERSIONS[self.unit][1] if self.unit in CONVERSIONS else self.unit

    @property
    def full_schema(self) -> dict[str, Any]:
        """JSON schema with the default and the description, which ends with the unit."""
        unit = f" [{self.unit}]" if self.unit not in ("", "1") else ""
        default = {} if self.is_required or self.default is None else {"default": self.default}
        return {**self.schema, **default, "description": f"{self.text}{unit}"}

    @property
    def internal_default(self) -> Any:
        """Internal value of the default; REQUIRED for a key that each file needs."""
        return self.default if self.is_required or self.default is None else self.read(self.default)

    def read_from(self, data: Mapping[str, Any]) -> Any:
        """Internal value from the checked mapping of the part."""
        value: Any = data
        for key in self.keys:
            if key not in value:
                return self.internal_default
            value = value[key]
        return self.read(value)


# -- kinds of values: each makes a field of a dataclass ------------------------------------------------


def number(
    text: str, minimum: float, maximum: float, unit: str = "1", *, above_minimum: bool = False, **more: Any
) -> Any:
    """Declare a number; angles and speeds are in radians internally. With `above_minimum` the minimum is excluded."""
    convert = converter(unit)
    schema = number_schema(minimum, maximum, above_minimum)
    return declared(text, schema, lambda value: convert(float(value)), unit=unit, **more)


def integer(text: str, minimum: int, maximum: int, **more: Any) -> Any:
    """Declare a count."""
    return declared(text, {"type": "integer", "minimum": minimum, "maximum": maximum}, int, unit="1", **more)


def array(text: str, minimum: float, maximum: float, unit: str, *, shape: tuple[int, ...], **more: Any) -> Any:
    """Declare a vector or a matrix, a list of lists in the file; it becomes an array that cannot be written to."""
    schema = number_schema(minimum, maximum)
    for size in reversed(shape):
        schema = list_schema(schema, size, size)
    return declared(text, schema, frozen, unit=unit, **more)


def series(text: str, minimum: float, maximum: float, unit: str, **more: Any) -> Any:
    """Declare a list of up to 100 numbers, an array that cannot be written to; empty where the file has none."""
    convert = converter(unit)
    schema = list_schema(number_schema(minimum, maximum), 0, 100)
    return declared(
        text,
        schema,
        lambda values: frozen([convert(float(value)) for value in values]),
        **{"unit": unit, "default": [], **more},
    )


def interval(text: str, minimum: float, maximum: float, unit: str, **more: Any) -> Any:
    """Declare a pair of a lower and an upper end."""
    schema = list_schema(number_schema(minimum, maximum), 2, 2)
    return declared(text, schema, interval_reader(unit), unit=unit, **more)


def choice(text: str, allowed: tuple[str, ...] | tuple[int, ...], **more: Any) -> Any:
    """Declare one of several words or integers."""
    kind = type(allowed[0])
    return declared(text, {"enum": list(allowed)}, kind, unit="" if kind is str else "1", **more)


def string(text: str, *, may_be_empty: bool = False, **more: Any) -> Any:
    """Declare a text of one line."""
    return declared(text, {"type": "string"} if may_be_empty else {"type": "string", "minLength": 1}, str, **more)


def part(
    text: str,
    record: type,
    rules: Mapping[str, Any] = MappingProxyType({}),
    complete: Callable[[Any], Any] = lambda data: data,
    **more: Any,
) -> Any:
    """Declare a mapping whose keys are the declared fields of a dataclass.

    `rules` are further keywords of its schema; `complete` adds values that follow from others to the mapping.
    """
    return declared(
        text, {**schema_of(record), **rules}, lambda data: read(record, complete(data)), record=record, **more
    )


def parts(
    text: str,
    record: type,
    minimum: int,
    maximum: int,
    *,
    rules: Mapping[str, Any] = MappingProxyType({}),
    complete: Callable[[Any], Any] = lambda data: data,
    **more: Any,
) -> Any:
    """Declare a list of such mappings, with the rules and the completion of each."""
    schema = list_schema({**schema_of(record), **rules}, minimum, maximum)

    def read_all(items: list[Any]) -> tuple[Any, ...]:
        return tuple(read(record, complete(data)) for data in items)

    return declared(text, schema, read_all, record=record, **more)


def declared(text: str, schema: Mapping[str, Any], reader: Callable[[Any], Any], **more: Any) -> Any:
    """Field of a dataclass with a declaration; `more` are further attributes of `Declaration`."""
    declaration = Declaration(text, schema, reader, **more)
    metadata = {METADATA_KEY: declaration}
    if declaration.is_required:
        return field(kw_only=True, metadata=metadata)
    default = declaration.internal_default
    return field(kw_only=True, metadata=metadata, default_factory=lambda: default)  # for arrays, too


# -- building blocks -----------------------------------------------------------------------------------


def converter(unit: str) -> Callable[[float], float]:
    """Function from a number in a unit of the file to the internal one."""
    return CONVERSIONS[unit][2] if unit in CONVERSIONS else float


def interval_reader(unit: str) -> Callable[[list[float]], tuple[float, float]]:
    """Function from a list of two numbers in a unit of the file to a pair of internal ones."""
    convert = converter(unit)
    return lambda ends: (convert(ends[0]), convert(ends[1]))


def frozen(values: Any) -> NDArray[np.float64]:
    """Array that cannot be written to."""
    made = np.array(values, dtype=float)
    made.flags.writeable = False
    return made


def number_schema(minimum: float, maximum: float, above_minimum: bool = False) -> dict[str, Any]:
    """JSON schema of a number in a range."""
    return {"type": "number", "exclusiveMinimum" if above_minimum else "minimum": minimum, "maximum": maximum}


def list_schema(items: Mapping[str, Any], minimum: int, maximum: int) -> dict[str, Any]:
    """JSON schema of a list."""
    return {"type": "array", "items": items, "minItems": minimum, "maxItems": maximum}


def mapping_schema(properties: Mapping[str, Any], required: list[str]) -> dict[str, Any]:
    """JSON schema of a mapping with known keys."""
    return {"type": "object", "properties": properties, "required": sorted(required), "additionalProperties": False}


def named_schema(values: Mapping[str, Any], **more: Any) -> dict[str, Any]:
    """JSON schema of a mapping with names of the file's own as keys."""
    names = {"pattern": NAME_PATTERN, "maxLength": MAX_NAME_LENGTH}
    return {"type": "object", "propertyNames": names, "additionalProperties": values, **more}


def left_out(where: str) -> dict[str, Any]:
    """JSON schema of a key that may not be there; `where` says when."""
    return {"not": {}, "description": f"to leave the key out {where}"}


# -- what follows from the declarations ----------------------------------------------------------------


def cached_by_class(function: Function) -> Function:
    """`functools.cache` for functions of a class, which mypy does not take for hashable."""
    return cache(function)  # type: ignore[return-value]


@cached_by_class
def declarations(record: type) -> dict[str, Declaration]:
    """Declarations of a dataclass by the names of its fields; fields without a declaration are left out."""
    found = {}
    for item in fields(record):
        if METADATA_KEY in item.metadata:
            declaration: Declaration = item.metadata[METADATA_KEY]
            end = CONVERSIONS[declaration.unit][0] if declaration.unit in CONVERSIONS else ""
            found[item.name] = replace(declaration, key=declaration.key or item.name + end)
    return found


@cached_by_class
def schema_of(record: type) -> dict[str, Any]:
    """JSON schema of the mapping that a dataclass is read from."""
    properties: dict[str, Any] = {}
    required: list[str] = []
    for declaration in declarations(record).values():
        first, *nested = declaration.keys
        if not nested:
            properties[first] = declaration.full_schema
        else:  # one more key of a mapping such as "chord"
            inner = properties.setdefault(first, mapping_schema({}, []))
            inner["properties"][nested[0]] = declaration.full_schema
            if declaration.is_required:
                inner["required"] = sorted({*inner["required"], nested[0]})
        if declaration.is_required and not declaration.is_derivable and first not in required:
            required.append(first)
    return mapping_schema(properties, required)


def read(record: type, data: Mapping[str, Any]) -> Any:
    """Dataclass of a mapping that its schema accepts."""
    return record(**values_of(record, data))


def values_of(record: type, data: Mapping[str, Any]) -> dict[str, Any]:
    """Internal values of the declared fields of a dataclass from a mapping that its schema accepts."""
    return {name: declaration.read_from(data) for name, declaration in declarations(record).items()}


def model_values(part: object, names: Mapping[str, Any]) -> dict[str, Any]:
    """Values of a part that the compiled model takes as they are, by the fields of one of its records.

    Parameters
    ----------
    part : object
        Dataclass with declared fields.
    names : mapping
        Fields of the record: of all others nothing is returned.
    """
    known = declarations(type(part)).items()
    return {item.model_field: getattr(part, name) for name, item in known if item.model_field in names}


def leaves(record: type, before: str = "") -> Iterator[tuple[str, str, Declaration]]:
    """Path in the file, name of the field and declaration of each value, those of parts included."""
    for name, declaration in declarations(record).items():
        path = f"{before}{declaration.key}"
        if declaration.record is None:
            yield path, name, declaration
        else:
            yield from leaves(declaration.record, f"{path}.")


@cached_by_class
def units(record: type) -> dict[tuple[str, ...], str]:
    """Units of all values in the file by the keys of their paths."""
    return {tuple(path.split(".")): declaration.unit for path, _, declaration in leaves(record)}
