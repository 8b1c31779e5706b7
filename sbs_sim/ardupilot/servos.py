"""Servos: from the lengths of ArduPilot's pulses to the angles of swashplates, and to commands of drives.

A servo travels from 0 at 1000 us to 1 at 2000 us. ArduPilot's mixers (libraries/AP_Motors/AP_MotorsHeli_Swash.cpp) give
the travel of servo i as  c_i collective + 0.45 (r_i roll + p_i pitch),  with factors that each type of swashplate has;
its servos stand at azimuths from the nose. What is done here is the inverse: a plate that three or four servos hold.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sbs_sim import checks, config_file, validation
from sbs_sim.aircraft import Aircraft
from sbs_sim.aircraft.commands import Row
from sbs_sim.config_file import config_folder
from sbs_sim.errors import ArduPilotError
from sbs_sim.model.state import SWASHPLATE_NAMES

Array = NDArray[np.float64]

FIRST_PULSE, LAST_PULSE = 1000.0, 2000.0  # us, of the travel of a servo
CYCLIC_TRAVEL = 0.45  # of a servo, for a full roll or pitch of ArduPilot
MIDDLE = 0.5  # travel of the cyclic servos of a plate without mixing, at rest
SIDEWAYS = math.pi / 2
DIGITS = 12  # of the factors, beyond which rounding begins


def _on_circle(*azimuths_deg: float) -> tuple[tuple[float, float, float], ...]:
    """Factors of servos at azimuths from the nose, to the right positive."""
    angles = [math.radians(one) for one in azimuths_deg]
    return tuple((1.0, math.cos(angle + SIDEWAYS), math.cos(angle)) for angle in angles)


# Of each servo the factors of collective, roll and pitch.
SWASHPLATES = {
    "h1": ((0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0)),
    "h3_120": _on_circle(-60.0, 60.0, 180.0),
    "h3_140": ((1.0, 1.0, 1.0), (1.0, -1.0, 1.0), (1.0, 0.0, -1.0)),
    "h4_90": _on_circle(-90.0, 90.0, 180.0, 0.0),
    "h4_45": _on_circle(-45.0, 45.0, -135.0, 135.0),
}


class Head(NamedTuple):
    """A swashplate and its servos.

    Attributes
    ----------
    rotor : str
    channels : tuple of int
        Of its servos, the first channel is 1.
    swashplate : str
        One of `SWASHPLATES`.
    blade_pitch : (float, float)
        Collective with all servos at 1000 and at 2000 us [rad].
    lateral_sign, longitudinal_sign : int
        Of the cyclic angles for a roll to the right and for the nose up.
    """

    rotor: str
    channels: tuple[int, ...]
    swashplate: str
    blade_pitch: tuple[float, float]
    lateral_sign: int
    longitudinal_sign: int

    @property
    def gain(self) -> float:
        """Blade pitch over travel [rad]."""
        return self.blade_pitch[1] - self.blade_pitch[0]

    def angles_of_travel(self) -> tuple[Array, Array]:
        """Swashplate angles [rad] of the travel of the servos: factors, shape (3, n_servos), and offset, shape (3,)."""
        factors = np.linalg.pinv(np.array(SWASHPLATES[self.swashplate])).round(DIGITS)
        signs = np.array([1.0, self.lateral_sign, self.longitudinal_sign])
        matrix = self.gain * signs[:, None] * factors
        offset = np.array([self.blade_pitch[0], 0.0, 0.0])
        if self.swashplate == "h1":
            offset[1:] = -MIDDLE * self.gain * signs[1:]
        return matrix, offset


class Output(NamedTuple):
    """A single number that a channel commands.

    Attributes
    ----------
    owner, name : str
        Of the number in `Aircraft.rows`.
    channel : int
        The first is 1.
    range : (float, float)
        That the number has over the travel, in the unit of its row.
    """

    owner: str
    name: str
    channel: int
    range: tuple[float, float]


class Servos:
    """What the pulses of ArduPilot command in an aircraft.

    Parameters
    ----------
    aircraft : Aircraft
    heads : sequence of Head
    outputs : sequence of Output
    frame : str

    Attributes
    ----------
    channel_count : int
        Channels that a packet must have.

    Raises
    ------
    ArduPilotError
        A name that the aircraft does not have, or one number commanded twice.
    """

    def __init__(
        self, aircraft: Aircraft, heads: Sequence[Head], outputs: Sequence[Output] = (), frame: str = "other"
    ) -> None:
        self.aircraft, self.heads, self.frame = aircraft, tuple(heads), frame
        rows = aircraft.rows
        self._rest = aircraft.mix(aircraft.resting_controls).ravel()
        self._limits = np.array([limits for row in rows for limits in row.ranges]).T
        size = len(self._rest)
        channels = sorted({one for head in heads for one in head.channels} | {one.channel for one in outputs})
        self._channels = np.array(channels, dtype=np.int64) - 1
        self.channel_count = max(channels, default=0)
        self._factors, self._offset = np.zeros((size, len(channels))), self._rest.copy()
        self._commanded: set[int] = set()
        for head in heads:
            places = [_place(rows, head.rotor, name) for name in SWASHPLATE_NAMES]
            self._command(places, [channels.index(one) for one in head.channels], *head.angles_of_travel())
        for one in outputs:
            low, high = one.range
            place, column = _place(rows, one.owner, one.name), channels.index(one.channel)
            self._command([place], [column], np.array([[high - low]]), np.array([low]))

    def angles(self, pulses: Sequence[int]) -> Array:
        """Rows of `Aircraft.mix` that pulses [us] command, within their ranges.

        What a servo without a pulse moves is at rest.

        Raises
        ------
        ArduPilotError
            There are fewer channels than servos.
        """
        if len(pulses) < self.channel_count:
            raise ArduPilotError(
                f"packet with {len(pulses)} channels: allowed are at least {self.channel_count}, see SERVO_32_ENABLE"
            )
        used = np.array(pulses, dtype=float)[self._channels]
        travel = (np.minimum(np.maximum(used, FIRST_PULSE), LAST_PULSE) - FIRST_PULSE) / (LAST_PULSE - FIRST_PULSE)
        values = self._offset + self._factors @ travel
        if not used.all():
            still = (self._factors[:, used == 0.0] != 0.0).any(axis=1)
            values[still] = self._rest[still]
        low, high = self._limits  # `np.clip` takes four times as long
        return np.asarray(np.minimum(np.maximum(values, low), high)).reshape(-1, 3)

    def _command(self, places: list[int], columns: list[int], factors: Array, offset: Array) -> None:
        """Let channels command numbers of the rows."""
        for place in places:
            if place in self._commanded:
                row = self.aircraft.rows[place // 3]
                raise ArduPilotError(f"{row.owner} {row.names[place % 3]}: commanded twice, allowed is once")
        self._commanded.update(places)
        self._offset[places] = offset
        self._factors[np.ix_(places, columns)] = factors

    @classmethod
    def load(cls, aircraft: Aircraft, path: str = "") -> Servos:
        """Read a servo file; the one of the package for this aircraft if the path is empty.

        Raises
        ------
        ArduPilotError
            One line that names the file and each wrong key with its value and what is allowed.
        """
        file = checks.path("servos", path, ArduPilotError) if path else _own_file(aircraft)
        try:
            if not os.path.isfile(file):  # no too for names that no file can have
                raise ArduPilotError("there is no such file")
            data = config_file.read_yaml(file)
            if found := validation.problems(data, _validator()):
                raise ArduPilotError("; ".join(found))
            return cls(aircraft, *_parts(data), data["frame"])
        except (ArduPilotError, config_file.UnreadableError) as error:
            raise ArduPilotError(f"{file}: {error}") from None


def _own_file(aircraft: Aircraft) -> Path:
    folder = config_folder() / "ardupilot"
    file = folder / f"{aircraft.name}.yaml"
    if file.parent != folder or not file.is_file():
        known = ", ".join(sorted(path.stem for path in folder.glob("*.yaml")))
        raise ArduPilotError(f"no servo file of {aircraft.name}: allowed are {known}, or name one with `servos`")
    return file


def _parts(data: dict[str, Any]) -> tuple[list[Head], list[Output]]:
    heads = []
    for entry in data["heads"]:
        low, high = (math.radians(value) for value in entry["blade_pitch_deg"])
        wanted = len(SWASHPLATES[entry["swashplate"]])
        if len(entry["channels"]) != wanted:
            raise ArduPilotError(
                f"heads: {entry['rotor']} has {len(entry['channels'])} channels: allowed for {entry['swashplate']} are"
                f" {wanted}"
            )
        given = {key: entry[key] for key in ("rotor", "swashplate", "lateral_sign", "longitudinal_sign")}
        heads.append(Head(channels=tuple(entry["channels"]), blade_pitch=(low, high), **given))
    outputs = []
    for entry in data["outputs"]:
        low, high = entry["range"] if "range" in entry else map(math.radians, entry["range_deg"])
        outputs.append(Output(entry["owner"], entry["name"], entry["channel"], (low, high)))
    return heads, outputs


def _place(rows: Sequence[Row], owner: str, name: str) -> int:
    """Index of a number in the flattened rows."""
    found = [3 * i + row.names.index(name) for i, row in enumerate(rows) if row.owner == owner and name in row.names]
    if not found:
        known = ", ".join(f"{row.owner} {one}" for row in rows for one in row.names if one)
        raise ArduPilotError(f"{owner} {name}: unknown, allowed are {known}")
    return found[0]


def _validator() -> Any:
    return validation.validator_of(json.loads((config_folder() / "ardupilot.schema.json").read_text(encoding="utf-8")))
