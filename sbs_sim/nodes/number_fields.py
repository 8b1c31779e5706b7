"""Numbers in messages that were none of the kind that their field takes.

Since Jazzy, rclpy looks at no type unless ROS_PYTHON_CHECK_FIELDS is 1: it takes the bytes of whatever object is in
a float64 field. Those of an integer make a number next to zero (`Vector3(x=5)` arrives as 5e-324), or, of a negative
one before Python 3.12, none at all. Arrays are converted, whatever they are made from.
"""

import math
import sys
from collections.abc import Collection, Iterator
from typing import Any

from sbs_sim.errors import SbsError, SimulationError

MIN_NORMAL = sys.float_info.min  # in size: below, a float64 has lost digits already, and no unit makes that of use
CAUSE = "an integer in a float field? write 5.0 in place of 5; ROS_PYTHON_CHECK_FIELDS=1 finds it"


def check_numbers(message: Any, decaying: Collection[str] = (), error: type[SbsError] = SimulationError) -> None:
    """Raise an error for a scalar that no number of the field's type has become.

    Parameters
    ----------
    message : message, request or goal
    decaying : collection of str, optional
        Fields that come near zero by themselves, as what a filter gives does.
    error : type, optional
        Of the error.
    """
    for name, value in scalars(message):
        if 0.0 < abs(value) < MIN_NORMAL and name not in decaying:
            raise error(f"{name} = {value}: allowed are 0 and what is at least {MIN_NORMAL:.3g} in size; {CAUSE}")


def hint(message: Any) -> str:
    """What to add to the words that refuse a message: where a scalar is no number, that may be the cause."""
    return f"; {CAUSE}" if any(math.isnan(value) for _, value in scalars(message)) else ""


def scalars(message: Any, prefix: str = "") -> Iterator[tuple[str, float]]:
    """Names and values of all float64 fields of a message and of the messages in it, but for arrays of numbers."""
    for name, kind in _fields(type(message)):
        value = getattr(message, name)
        if kind == "double":
            yield f"{prefix}{name}", value
        elif kind == "message":
            yield from scalars(value, f"{prefix}{name}.")
        else:
            for i, item in enumerate(value):
                yield from scalars(item, f"{prefix}{name}[{i}].")


def _fields(kind: Any) -> list[tuple[str, str]]:
    """Names of the fields of a class of messages that hold float64 scalars: "double", "message" or "messages" each."""
    if kind in _known:
        return _known[kind]
    found = []
    for name, text in kind.get_fields_and_field_types().items():
        if text == "double":
            found.append((name, "double"))
        elif "/" in text:
            found.append((name, "messages" if text.endswith(("]", ">")) else "message"))
    _known[kind] = found
    return found


_known: dict[Any, list[tuple[str, str]]] = {}
