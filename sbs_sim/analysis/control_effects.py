"""Which way each pilot control moves an aircraft, from its linear model: the mixing of its file decides, not a name.

What a control does at once, rotors and inflow settled, is its column of the quasi-static B (theory.md eq. 9.3). The
control is named after the axis that a pilot expects it to move, unless it hardly does.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sbs_sim.model.state import CONTROL_AXES, CONTROL_NAMES

Array = NDArray[np.float64]

NEGLIGIBLE = 0.02  # of the largest effect of a control on an axis
STICKS = {  # state that a pilot moves with a control of each axis, and the sense of more stick: up, right, down, left
    "heave": ("w", -1.0),
    "roll": ("p", 1.0),
    "pitch": ("q", -1.0),
    "yaw": ("r", -1.0),
}
AXES = {  # of a state: what it is called, and what positive and negative accelerations do
    "u": ("surge", "forward", "backward"),
    "v": ("sway", "to the right", "to the left"),
    "w": ("heave", "down", "up"),
    "p": ("roll", "rolls right", "rolls left"),
    "q": ("pitch", "nose up", "nose down"),
    "r": ("yaw", "nose right", "nose left"),
}
TURNING = ("p", "q", "r")


@dataclass(frozen=True)
class ControlEffect:
    """What a positive change of one control does at once.

    Attributes
    ----------
    control : str
    axis : str
        "heave", "roll", "pitch" or "yaw", whichever is expected of it; another one only if it hardly moves that.
    acceleration : float
        Along that axis, in body axes [m/s^2 or rad/s^2 per rad of the control, or per unit of one that is no angle].
    sense : float
        1 where more of the control is what more of its stick is to do: up, roll to the right, nose down, nose left;
        else -1.
    words : str
        "nose left" and so on, with other axes that it turns the aircraft about no less.
    """

    control: str
    axis: str
    acceleration: float
    sense: float
    words: str


def control_effects(
    b: Array,
    state_names: Sequence[str],
    control_names: Sequence[str] = CONTROL_NAMES,
    control_axes: Sequence[str] = CONTROL_AXES,
) -> tuple[ControlEffect, ...]:
    """Effects of all controls.

    Parameters
    ----------
    b : ndarray, shape (n, m)
        Of a linear model whose rotors and inflow have settled.
    state_names : sequence of str, length n
        With u, v, w, p, q, r.
    control_names : sequence of str, length m
    control_axes : sequence of str, length m
        Axis that a pilot expects each to move, or an empty text.

    Returns
    -------
    tuple of ControlEffect, length m
    """
    rows = {name: b[state_names.index(name)] for name in AXES}
    largest = {name: float(np.abs(row).max()) for name, row in rows.items()}
    return tuple(
        _effect(name, expected, {axis: float(row[i]) for axis, row in rows.items()}, largest)
        for i, (name, expected) in enumerate(zip(control_names, control_axes, strict=True))
    )


def _effect(control: str, expected: str, found: dict[str, float], largest: dict[str, float]) -> ControlEffect:
    """Effect of one control that gives these accelerations, of which these are the largest of all controls."""
    axis, wanted = STICKS.get(expected, ("w", -1.0))
    if not expected or abs(found[axis]) <= NEGLIGIBLE * largest[axis]:
        shares = {name: abs(value) / largest[name] for name, value in found.items() if value}
        axis = max(shares, key=lambda name: shares[name], default=axis)
        wanted = math.copysign(1.0, found[axis])  # nobody expects anything of it
    words = [_words(axis, found[axis])]
    if axis in TURNING:
        words += [f"also {_words(name, found[name])}" for name in TURNING if _is_more(found, name, axis)]
    sense = -1.0 if found[axis] * wanted < 0.0 else 1.0
    return ControlEffect(control, AXES[axis][0], found[axis], sense, ", ".join(words))


def _is_more(found: dict[str, float], name: str, axis: str) -> bool:
    return name != axis and abs(found[name]) >= abs(found[axis]) > 0.0


def _words(axis: str, acceleration: float) -> str:
    _, positive, negative = AXES[axis]
    return "nothing" if acceleration == 0.0 else positive if acceleration > 0.0 else negative
