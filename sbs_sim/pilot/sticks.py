"""From fingers to sticks: dead zone and exponential of an axis, and the sticks that keys move."""

import math

import numpy as np
from numpy.typing import NDArray

from sbs_sim.model.state import CONTROL_NAMES

Array = NDArray[np.float64]

KEY_STEP = 0.1  # of full stick that one key moves
RETURN_TIME = 0.7  # s in which a stick that no key holds goes back to the middle by a factor e
COLLECTIVE = CONTROL_NAMES.index("collective")
KEYS = {  # stick and sense of a key: up, roll to the right, a push and the nose to the left are positive
    "w": ("collective", 1.0),
    "s": ("collective", -1.0),
    "a": ("differential_longitudinal_cyclic", 1.0),
    "d": ("differential_longitudinal_cyclic", -1.0),
    **dict.fromkeys(("up", "i"), ("longitudinal_cyclic", 1.0)),
    **dict.fromkeys(("down", "k"), ("longitudinal_cyclic", -1.0)),
    **dict.fromkeys(("left", "j"), ("lateral_cyclic", -1.0)),
    **dict.fromkeys(("right", "l"), ("lateral_cyclic", 1.0)),
}
ARROWS = {b"A": "up", b"B": "down", b"C": "right", b"D": "left"}


def shaped(value: float, dead_zone: float, expo: float) -> float:
    """Stick of an axis: nothing within the dead zone, from its edge to the end (1 - expo) x + expo x^3.

    Parameters
    ----------
    value : float
        -1 to 1; beyond, it is cut.
    dead_zone : float
        0 to less than 1.
    expo : float
        0 is linear, 1 is cubic: no slope in the middle.
    """
    size = min(1.0, max(0.0, (abs(value) - dead_zone) / (1.0 - dead_zone)))
    return math.copysign((1.0 - expo) * size + expo * size**3, value)


def keys_of(data: bytes) -> list[str]:
    """Names of the keys that a terminal has sent: characters, and up, down, left, right for the arrows."""
    keys = []
    i = 0
    while i < len(data):
        if data[i : i + 2] in (b"\x1b[", b"\x1bO"):
            keys.append(ARROWS.get(data[i + 2 : i + 3], ""))
            i += 3
            continue
        keys.append(chr(data[i]))
        i += 1
    return [key for key in keys if key]


class KeySticks:
    """Sticks that keys move by steps; all but the collective go back to the middle by themselves.

    Attributes
    ----------
    position : ndarray, shape (4,)
        Of the sticks in the order of the controls, -1 to 1, before dead zone and exponential.
    """

    def __init__(self) -> None:
        self.position = np.zeros(len(CONTROL_NAMES))

    def press(self, key: str) -> bool:
        """Move a stick by a step; false if the key moves none."""
        if key not in KEYS:
            return False
        name, sense = KEYS[key]
        index = CONTROL_NAMES.index(name)
        self.position[index] = float(np.clip(self.position[index] + sense * KEY_STEP, -1.0, 1.0))
        return True

    def centre(self) -> None:
        """All sticks to the middle."""
        self.position[:] = 0.0

    def relax(self, elapsed: float) -> None:
        """Let time pass [s]."""
        share = math.exp(-elapsed / RETURN_TIME)
        self.position *= np.where(np.arange(len(CONTROL_NAMES)) == COLLECTIVE, 1.0, share)
