"""Equality and hash by content for dataclasses that hold arrays, which Python's own cannot compare."""

from collections.abc import Mapping
from dataclasses import fields
from typing import Any

import numpy as np


class ByContent:
    """Base of dataclasses with `eq=False`: equal are two of one class whose fields hold the same.

    Arrays are the same with one shape and equal elements, a NaN being equal to a NaN; fields with `compare=False` do
    not count. Equal objects have equal hashes, as long as nobody writes into their arrays.
    """

    def __eq__(self, other: object) -> bool:
        if self is other:
            return True
        if other.__class__ is not self.__class__:
            return NotImplemented
        return all(same(getattr(self, name), getattr(other, name)) for name in _compared(self))

    def __hash__(self) -> int:
        return hash((type(self).__name__, *(_hashable(getattr(self, name)) for name in _compared(self))))


def _compared(record: Any) -> list[str]:
    return [field.name for field in fields(record) if field.compare]


def same(one: Any, other: Any) -> bool:
    """True for equal values, arrays among them; lists and tuples of equal items are equal."""
    if one is other:
        return True
    if isinstance(one, np.ndarray) or isinstance(other, np.ndarray):
        return _same_arrays(one, other)
    if isinstance(one, Mapping) and isinstance(other, Mapping):
        return one.keys() == other.keys() and all(same(one[key], other[key]) for key in one)
    if isinstance(one, list | tuple) and isinstance(other, list | tuple):
        return len(one) == len(other) and all(map(same, one, other))
    return bool(one == other) or (_is_nan(one) and _is_nan(other))


def _same_arrays(one: Any, other: Any) -> bool:
    if not (isinstance(one, np.ndarray) and isinstance(other, np.ndarray)) or one.shape != other.shape:
        return False
    return np.array_equal(one, other, equal_nan=one.dtype.kind in "fc" and other.dtype.kind in "fc")


def _is_nan(value: Any) -> bool:
    return isinstance(value, float) and value != value


def _hashable(value: Any) -> Any:
    """What has the same hash for values that `same` finds equal."""
    if isinstance(value, np.ndarray):
        return (value.shape, _bytes(value) if value.dtype.kind in "biufc" else _hashable(value.ravel().tolist()))
    if isinstance(value, Mapping):
        return frozenset((key, _hashable(item)) for key, item in value.items())
    if isinstance(value, list | tuple):
        return tuple(map(_hashable, value))
    return "nan" if _is_nan(value) else value


def _bytes(numbers: np.ndarray[Any, Any]) -> bytes:
    """The same for equal numbers of any type: there is one zero, and one NaN."""
    values = numbers.astype(np.complex128) + 0.0
    values[np.isnan(values)] = np.nan
    return values.tobytes()
