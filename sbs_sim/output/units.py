"""Numbers as a person reads them: degrees for angles, other units as they are; counts with their word."""

from typing import Any

import numpy as np

RPM = 30.0 / np.pi  # revolutions per minute in one rad/s


def shown(values: Any, unit: str) -> tuple[Any, str]:
    """Values and their unit, with degrees in place of radians."""
    if unit.startswith("rad"):
        return np.degrees(values), unit.replace("rad", "deg", 1)
    return values, unit


def counted(number: int, word: str) -> str:
    """Number of things in words: "1 state", "2 states"."""
    return f"{number} {word}" if number == 1 else f"{number} {word}s"


def label(name: str, unit: str) -> str:
    """Heading of a column: the name with the unit in which it is shown."""
    unit = shown(0.0, unit)[1]
    return f"{name} [{unit}]" if unit else name
