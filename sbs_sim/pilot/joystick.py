"""A joystick: what its axes and buttons mean, from config/joystick.yaml."""

import json
import math
import os
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sbs_sim import checks, config_file, validation
from sbs_sim.config_file import config_folder
from sbs_sim.content import ByContent
from sbs_sim.errors import PilotError
from sbs_sim.model.state import CONTROL_NAMES
from sbs_sim.pilot.sticks import shaped

Array = NDArray[np.float64]

PRESSED = 0.5  # of an axis that stands for two buttons
ACTIONS = ("augmentation", "take_trim", "first_trim")


@dataclass(frozen=True, eq=False)
class JoystickFile(ByContent):
    """Checked content of a joystick file.

    Attributes
    ----------
    dead_zone, expo : float
    deflections : tuple of 4 floats
        Departure of each control from its trim at full stick [rad].
    trim_step : float
        [rad]
    timeout : float
        [s]
    pad : dict
        Axes, trims and buttons of the pad that was chosen.
    """

    dead_zone: float
    expo: float
    deflections: tuple[float, ...]
    trim_step: float
    timeout: float
    pad: dict[str, Any]

    @classmethod
    def load(cls, path: str, pad: str) -> "JoystickFile":
        """Read a file; the one that comes with the package if the path is empty.

        Raises
        ------
        PilotError
            One line that names the file and every wrong key with its value and what is allowed, or the pads there are.
        """
        file = checks.path("config", path, PilotError) if path else config_folder() / "joystick.yaml"
        try:
            if not os.path.isfile(file):  # no too for names that no file can have
                raise PilotError("there is no such file")
            data = config_file.read_yaml(file)
            if found := validation.problems(data, _validator()):
                raise PilotError("; ".join(found))
            checks.choice("pad", pad, data["pads"], PilotError)
        except (PilotError, config_file.UnreadableError) as error:
            raise PilotError(f"{file}: {error}") from None
        return cls(
            float(data["dead_zone"]),
            float(data["expo"]),
            tuple(math.radians(data["deflection_deg"][name]) for name in CONTROL_NAMES),
            math.radians(data["trim_step_deg"]),
            float(data["timeout"]),
            data["pads"][pad],
        )


def _validator() -> Any:
    return validation.validator_of(json.loads((config_folder() / "joystick.schema.json").read_text(encoding="utf-8")))


@dataclass(frozen=True, eq=False)
class Reading(ByContent):
    """What one message of a joystick says.

    Attributes
    ----------
    sticks : ndarray, shape (4,)
        -1 to 1, positive for up, roll to the right, a push, nose to the left.
    trim : ndarray, shape (4,)
        Presses of the trim buttons since the message before, -1, 0 or 1, in the same senses.
    actions : tuple of str
        Buttons of `ACTIONS` that have been pressed since then.
    """

    sticks: Array
    trim: Array
    actions: tuple[str, ...]


class Joystick:
    """Reads messages one after the other.

    Parameters
    ----------
    file : JoystickFile
    """

    def __init__(self, file: JoystickFile) -> None:
        self._file = file
        self._held: set[tuple[str, float]] | None = None

    def read(self, axes: Sequence[float], buttons: Sequence[int]) -> Reading:
        """Reading of a message; what is held down in the first one counts as held before.

        Raises
        ------
        PilotError
            It has not the axes and buttons of the pad, or a value that is not finite; nothing has changed then.
        """
        sticks = np.zeros(len(CONTROL_NAMES))
        for i, name in enumerate(CONTROL_NAMES):
            entry = self._file.pad["axes"][name]
            value = entry["sign"] * _at(axes, entry["axis"], "axes")
            sticks[i] = shaped(value, self._file.dead_zone, self._file.expo)
        held = self._now_held(axes, buttons)
        new = set() if self._held is None else held - self._held
        self._held = held
        trim = np.array([sum(sense for what, sense in new if what == name) for name in CONTROL_NAMES])
        return Reading(sticks, trim, tuple(action for action in ACTIONS if (action, 0.0) in new))

    def _now_held(self, axes: Sequence[float], buttons: Sequence[int]) -> set[tuple[str, float]]:
        """Buttons that are down: names of actions with 0, of controls to be trimmed with the sense."""
        held = {
            (name, 0.0) for name, index in self._file.pad.get("buttons", {}).items() if _at(buttons, index, "buttons")
        }
        for name, entry in self._file.pad.get("trims", {}).items():
            if "axis" in entry:
                value = entry["sign"] * _at(axes, entry["axis"], "axes")
                if abs(value) > PRESSED:
                    held.add((name, math.copysign(1.0, value)))
                continue
            for key, sense in (("plus", 1.0), ("minus", -1.0)):
                if _at(buttons, entry[key], "buttons"):
                    held.add((name, sense))
        return held


def _at(values: Sequence[float], index: int, what: str) -> float:
    if index >= len(values):
        raise PilotError(f"{what} has {len(values)} values: the pad needs {what}[{index}]")
    value = float(values[index])
    if not math.isfinite(value):
        raise PilotError(f"{what}[{index}] = {value}: allowed are finite numbers")
    return value
