"""Faults of configuration data against a JSON schema, in words."""

import math
from collections.abc import Iterator, Mapping, Set
from contextvars import ContextVar
from typing import Any

import numpy as np

from sbs_sim import checks

MAX_VALUES = 10_000  # of a file; nested aliases expand a few lines to billions of values
TYPE_WORDS = {
    "number": "a number",
    "integer": "an integer",
    "string": "a text",
    "array": "a list",
    "object": "a mapping of keys to values",
}


# Identities of values and of the schemas that accepted them: what is checked now leaves them out.
_accepted: ContextVar[Set[tuple[int, int]]] = ContextVar("_accepted", default=frozenset())


def validator_of(schema: Mapping[str, Any]) -> Any:
    """Validator for `problems`, which leaves out what was accepted."""
    from jsonschema import Draft202012Validator, validators  # here, because it is slow to import and needed once

    def properties(validator: Any, schemas: Mapping[str, Any], instance: Any, _: Any) -> Iterator[Any]:
        known = _accepted.get()
        if validator.is_type(instance, "object"):
            for key, inner in schemas.items():
                if key in instance and (id(instance[key]), id(inner)) not in known:
                    yield from validator.descend(instance[key], inner, path=key, schema_path=key)

    def items(validator: Any, inner: Mapping[str, Any], instance: Any, _: Any) -> Iterator[Any]:
        known = _accepted.get()
        if validator.is_type(instance, "array"):
            for i, item in enumerate(instance):
                if (id(item), id(inner)) not in known:
                    yield from validator.descend(item, inner, path=i)

    return validators.extend(Draft202012Validator, {"properties": properties, "items": items})(schema)


def _identities(value: Any, schema: Mapping[str, Any]) -> Iterator[tuple[int, int]]:
    """Identities of all values that a schema has accepted, and of its parts for them."""
    yield id(value), id(schema)
    if isinstance(value, dict):
        for key, inner in schema.get("properties", {}).items():
            if key in value:
                yield from _identities(value[key], inner)
    elif isinstance(value, list) and "items" in schema:
        for item in value:
            yield from _identities(item, schema["items"])


def problems(data: Any, validator: Any, accepted: Any = None) -> list[str]:
    """All faults of size, keys, types and ranges, each as "path = value: what is allowed".

    Parameters
    ----------
    data : object
        As read from YAML.
    validator : jsonschema validator
        See `validator_of`.
    accepted : object, optional
        Data without faults. Values of `data` that are the same objects in the same places are not checked again.
    """
    if fault := _size_fault(data):  # first: the checks below visit every value
        return [fault]
    token = _accepted.set(frozenset() if accepted is None else set(_identities(accepted, validator.schema)))
    try:
        errors = sorted(validator.iter_errors(data), key=lambda error: list(map(str, error.path)))
    finally:
        _accepted.reset(token)
    # only in data that the schema accepts is the search for numbers that are not finite sure to end
    found = [_explain(error) for error in errors] or [
        f"{path} = {value}: allowed is a finite number" for path, value in _not_finite(data, "")
    ]
    return list(dict.fromkeys(found))


def _size_fault(data: Any) -> str:
    """The fault of data with too many values, or with values that the schema cannot compare; empty if there is none."""
    try:
        size = _size(data, {})
    except RecursionError:
        return "the file is nested too deeply"
    except TypeError as error:
        return str(error)
    if size <= MAX_VALUES:
        return ""
    return f"the file has {size} values, aliases counted as what they stand for: allowed are {MAX_VALUES}"


def _size(node: Any, known: dict[int, int]) -> int:
    """Number of values in nested mappings and lists with aliases expanded; a value within itself counts once."""
    if isinstance(node, Mapping):
        parts = [*node.keys(), *node.values()]
    elif isinstance(node, list | tuple | set | frozenset):
        parts = list(node)
    elif isinstance(node, complex | np.ndarray):
        raise TypeError(f"{checks.shown(node)}: allowed are numbers, texts, lists and mappings")
    else:  # an integer counts its bits: Python refuses to print one of thousands of digits
        return 1 + node.bit_length() if isinstance(node, int) else 1
    if id(node) not in known:
        known[id(node)] = 0
        known[id(node)] = 1 + sum(_size(part, known) for part in parts)
    return known[id(node)]


def _not_finite(data: Any, path: str) -> list[tuple[str, float]]:
    if isinstance(data, dict):
        return [item for key, value in data.items() for item in _not_finite(value, f"{path}.{key}".lstrip("."))]
    if isinstance(data, list):
        return [item for i, value in enumerate(data) for item in _not_finite(value, f"{path}[{i}]")]
    return [(path, data)] if isinstance(data, float) and not math.isfinite(data) else []


def _explain(error: Any) -> str:
    """One schema error as "path = value: what is allowed"."""
    path = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in error.absolute_path)
    path = path.lstrip(".")
    rule, limit, value = error.validator, error.validator_value, error.instance
    if rule == "additionalProperties":
        known = error.schema["properties"]
        unknown = [_key(key) for key in value if key not in known]
        where = ", ".join(f"{path}.{key}".lstrip(".") for key in unknown)
        return f"{where}: unknown key, allowed are {', '.join(known)}"
    if rule == "dependentRequired":
        missing = sorted({name for key, names in limit.items() if key in value for name in names if name not in value})
        return f"{', '.join(f'{path}.{key}'.lstrip('.') for key in missing)}: missing key"
    if rule == "required":
        missing = [key for key in limit if key not in value]
        return f"{', '.join(f'{path}.{key}'.lstrip('.') for key in missing)}: missing key"
    allowed = {
        "type": TYPE_WORDS.get(str(limit), f"of type {limit}"),
        "enum": "one of " + ", ".join(map(str, limit)) if rule == "enum" else "",
        "minimum": f">= {limit}",
        "maximum": f"<= {limit}",
        "exclusiveMinimum": f"> {limit}",
        "minItems": f"a list of at least {limit}",
        "minProperties": f"a mapping with at least {limit}",
        "maxProperties": f"a mapping with at most {limit}",
        "maxItems": f"a list of at most {limit}",
        "minLength": "a text that is not empty",
        "pattern": "a name of lower-case letters, digits and underscores that begins with a letter",
        "maxLength": f"a name of at most {limit} characters",
        "not": error.schema["description"] if rule == "not" else "",
    }.get(rule, error.message)
    return f"{path or 'file'} = {checks.shown(value)}: allowed is {allowed}"


def _key(key: Any) -> str:
    return key if isinstance(key, str) and key.isprintable() else checks.shown(key)
