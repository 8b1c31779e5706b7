"""Checks of what comes from outside: each returns the value as it is wanted, or raises one line that refuses it.

The line names the field, its value and what is allowed; the caller chooses the exception.
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

LONGEST = 60  # characters of a value that are shown


def number(name: str, value: Any, least: float, most: float, unit: str, error: Kind) -> float:
    """A number from `least` to `most`, ends included; neither a text that looks like one nor a truth value."""
    plain = value.item() if isinstance(value, np.ndarray) and value.ndim == 0 else value
    is_number = isinstance(plain, numbers.Real) and not isinstance(plain, bool)
    if not (is_number and least <= plain <= most):  # false for a NaN as well
        raise error(f"{name} = {shown(value)}: allowed are {least:g} to {most:g}{f' {unit}' if unit else ''}")
    return float(plain)


def whole(name: str, value: Any, least: int, most: int, error: Kind) -> int:
    """A whole number from `least` to `most`, ends included."""
    is_whole = isinstance(value, numbers.Integral) and not isinstance(value, bool)
    if not (is_whole and least <= value <= most):
        raise error(f"{name} = {shown(value)}: allowed are whole numbers from {least} to {most}")
    return int(value)


def flag(name: str, value: Any, error: Kind) -> bool:
    """True or False, also as 1 or 0; no text, of which "no" would be true."""
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
    """A path as text or as an object."""
    if not isinstance(value, str | os.PathLike):
        raise error(f"{name} = {shown(value)}: allowed are paths")
    return Path(value)


def array(name: str, value: Any, error: Kind) -> NDArray[np.float64]:
    """A copy of numbers in any shape; NaN and infinity are numbers too, texts are not."""
    try:
        found = np.array(value)
    except (TypeError, ValueError, OverflowError, RecursionError):  # lists of unequal lengths, objects of any kind
        found = np.array(None)
    if found.dtype.kind not in "biuf":
        raise error(f"{name} = {shown(value)}: allowed are numbers")
    return found.astype(np.float64)


def shown(value: Any) -> str:
    """A value as a line can hold it: on one line, and not too long, however large it is."""
    if isinstance(value, np.generic):
        value = value.item()
    try:
        text = _SHORT.repr(value)
    except Exception:  # what is foreign may fail to describe itself
        text = f"<{type(value).__name__}>"
    text = " ".join(text.split())
    return text if len(text) <= LONGEST else text[: LONGEST - 3] + "..."


_SHORT = reprlib.Repr()
_SHORT.maxstring = _SHORT.maxother = _SHORT.maxlong = 10 * LONGEST  # beyond, they cut in the middle
