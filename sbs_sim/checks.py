"""Checks of input: each returns the value with the wanted type, or raises an exception of one line.

The line names the field, its value and the allowed range; the caller chooses the class of the exception.
"""

import numbers
import os
import reprlib
from collections.abc import Collection
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sbs_sim.errors import SbsError

Kind = type[SbsError]

MAX_SHOWN = 60  # characters of a value in a message


def number(name: str, value: Any, minimum: float, maximum: float, unit: str, error: Kind, zero: str = "") -> float:
    """A number from `minimum` to `maximum`, ends included, or a 0 that means `zero`; no strings and no booleans."""
    plain = value.item() if isinstance(value, np.ndarray) and value.ndim == 0 else value
    is_number = isinstance(plain, numbers.Real) and not isinstance(plain, bool)
    if not (is_number and (minimum <= plain <= maximum or (zero and plain == 0))):  # false for a NaN as well
        allowed = f"{minimum:g} to {maximum:g}{f' {unit}' if unit else ''}"
        raise error(f"{name} = {shown(value)}: allowed are {f'0, which is {zero}, and ' if zero else ''}{allowed}")
    return float(plain)


def integer(name: str, value: Any, minimum: int, maximum: int, error: Kind) -> int:
    """An integer from `minimum` to `maximum`, ends included."""
    is_integer = isinstance(value, numbers.Integral) and not isinstance(value, bool)
    if not (is_integer and minimum <= value <= maximum):
        raise error(f"{name} = {shown(value)}: allowed are integers from {minimum} to {maximum}")
    return int(value)


def flag(name: str, value: Any, error: Kind) -> bool:
    """True or False, also as 1 or 0; strings are refused, since "no" would count as true."""
    if not (isinstance(value, bool | np.bool_ | numbers.Integral) and value in (0, 1)):
        raise error(f"{name} = {shown(value)}: allowed are True and False")
    return bool(value)


def choice(name: str, value: Any, allowed: Collection[str], error: Kind) -> str:
    """One of some words."""
    if not (isinstance(value, str) and value in allowed):
        raise error(f"{name} = {shown(value)}: allowed are {', '.join(allowed)}")
    return value


def instance(name: str, value: Any, kind: type, error: Kind) -> None:
    """An object of a class."""
    if not isinstance(value, kind):
        raise error(f"{name} = {shown(value)}: allowed are objects of the class {kind.__name__}")


def path(name: str, value: Any, error: Kind) -> Path:
    """A path as a string or a path object."""
    if not isinstance(value, str | os.PathLike):
        raise error(f"{name} = {shown(value)}: allowed are paths")
    return Path(value)


def array(name: str, value: Any, error: Kind) -> NDArray[np.float64]:
    """A copy of numbers in any shape; NaN and infinity are allowed, strings are not."""
    try:
        found = np.array(value)
    except (TypeError, ValueError, OverflowError, RecursionError):  # lists of unequal lengths, objects of any kind
        found = np.array(None)
    if found.dtype.kind not in "biuf":
        raise error(f"{name} = {shown(value)}: allowed are numbers")
    return found.astype(np.float64)


def shown(value: Any) -> str:
    """A value on one line of at most `MAX_SHOWN` characters."""
    if isinstance(value, np.generic):
        value = value.item()
    try:
        text = _SHORT.repr(value)
    except Exception:  # `repr` of a foreign object may raise anything
        text = f"<{type(value).__name__}>"
    text = " ".join(text.split())
    return text if len(text) <= MAX_SHOWN else text[: MAX_SHOWN - 3] + "..."


_SHORT = reprlib.Repr()
_SHORT.maxstring = _SHORT.maxother = _SHORT.maxlong = 10 * MAX_SHOWN  # beyond, they cut in the middle
