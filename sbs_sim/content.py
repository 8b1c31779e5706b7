"""Equality and hash by content for dataclasses with arrays, for which those of Python fail."""

from collections.abc import Mapping
from dataclasses import fields
from typing import Any

import numpy as np


class ByContent:
    """Base of dataclasses with `eq=False`: two objects of one class are equal if all their fields are equal.

    Arrays are equal if they have the same shape and equal elements; NaN equals NaN. Fields with `compare=False` do not
    count. Equal objects have equal hashes, as long as nobody writes into their arrays.
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
    """True for equal values, arrays included; a list equals a tuple with equal items."""
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
    """A hashable object that is equal for values that `same` finds equal."""
    if isinstance(value, np.ndarray):
        return (value.shape, _bytes(value) if value.dtype.kind in "biufc" else _hashable(value.ravel().tolist()))
    if isinstance(value, Mapping):
        return frozenset((key, _hashable(item)) for key, item in value.items())
    if isinstance(value, list | tuple):
        return tuple(map(_hashable, value))
    return "nan" if _is_nan(value) else value


def _bytes(numbers: np.ndarray[Any, Any]) -> bytes:
    """Bytes that are equal for equal numbers of any type; both zeros are equal, and all NaN."""
    values = numbers.astype(np.complex128) + 0.0
    values[np.isnan(values)] = np.nan
    return values.tobytes()
