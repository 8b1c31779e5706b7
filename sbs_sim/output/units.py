"""Units in which a person reads numbers: degrees for angles, as they are for all others."""

from typing import Any

import numpy as np

RPM = 30.0 / np.pi  # revolutions per minute in one rad/s


def shown(values: Any, unit: str) -> tuple[Any, str]:
    """Values and their unit, with degrees in place of radians."""
    if unit.startswith("rad"):
        return np.degrees(values), unit.replace("rad", "deg", 1)
    return values, unit


def label(name: str, unit: str) -> str:
    """Heading of a column: the name with the unit in which it is shown."""
    unit = shown(0.0, unit)[1]
    return f"{name} [{unit}]" if unit else name
