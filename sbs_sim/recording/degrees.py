"""Messages with their angles in degrees, for viewers that cannot convert them.

The bytes are those of the message, with other numbers in the fields of angles. Such a field has the unit rad, rad/s or
rad/s^2 in its definition; its name gets the ending `_deg`, and the type that of `Deg`. Behind a message with the
quaternion `attitude` come its roll, pitch and heading as `attitude_deg`.
"""

import math
import re

import numpy as np
from numpy.typing import NDArray

from sbs_sim.errors import RecordingError
from sbs_sim.model.frames import quaternion_to_euler
from sbs_sim.recording.cdr import HEAD, Layout
from sbs_sim.recording.definitions import PRIMITIVES, SEPARATOR, SEQUENCE, Definitions, Field, parse, parts, short_name

UNITS = {"rad": "deg", "rad/s": "deg/s", "rad/s^2": "deg/s^2"}
ATTITUDE, QUATERNION = "attitude", "geometry_msgs/Quaternion"
EULER = "sbs_msgs/AttitudeDeg"
EULER_ANGLES = ("roll", "pitch", "heading")  # [deg]; turned by heading, pitch, roll, in this order, NED becomes FRD
_CONSTANT = re.compile(r"^\s*(\w+\s+\w+\s*=[^#\n]*)", re.MULTILINE)
_INDEX = re.compile(r"\[\d+\]")


class Degrees:
    """Converter of the messages of a type.

    Parameters
    ----------
    type_name : str
        package/msg/Type
    definition : str
        See `sbs_sim.recording.definitions.message_definition`.

    Attributes
    ----------
    angles : frozenset of str
        Names of the float64 fields that are converted, without indices; empty for a type without angles.
    """

    def __init__(self, type_name: str, definition: str) -> None:
        self._root = short_name(type_name)
        self._definitions = parse(type_name, definition)
        self._texts = dict(parts(type_name, definition))
        self.angles = frozenset(_angles(self._definitions, self._root, "", False))
        fields = self._definitions.get(self._root, ())
        self._has_attitude = any((field.name, field.type) == (ATTITUDE, QUATERNION) for field in fields)
        self._layout: Layout | None = None  # of the last message
        self._indices: NDArray[np.int64] = np.zeros(0, np.int64)
        self._quaternion: list[int] = []  # indices of w, x, y, z

    @property
    def type_name(self) -> str:
        """Name of the type of what `convert` gives."""
        return f"{self._changed(self._root).replace('/', '/msg/')}"

    @property
    def definition(self) -> str:
        """Definition of that type."""
        made: list[str] = []
        for kind, text in self._texts.items():
            name = self._changed(kind)
            head = [SEPARATOR, f"MSG: {name}"] if made else []
            fields = map(self._line, self._definitions[kind])
            made += [*head, *([text.rstrip("\n")] if name == kind else [*_CONSTANT.findall(text), *fields])]
            if kind == self._root and self._has_attitude:
                made.append(f"{EULER} {ATTITUDE}_deg # [deg]")
        if self._has_attitude:
            made += [SEPARATOR, f"MSG: {EULER}", *(f"float64 {name} # [deg]" for name in EULER_ANGLES)]
        return "\n".join([*made, ""])

    def convert(self, message: bytes) -> bytes:
        """A message with its angles in degrees.

        Raises
        ------
        RecordingError
            It is none of the type, or has the most significant byte first.
        """
        if message[1:2] == b"\0":
            raise RecordingError(f"{self._root}: only messages with the least significant byte first can be converted")
        if self._layout is None or not self._layout.fits(message):
            self._layout = layout = Layout(self._definitions, self._root, message)
            spans = [span for name, span in layout.doubles.items() if _INDEX.sub("", name) in self.angles]
            starts = [np.arange(count) + (offset - HEAD) // 8 for offset, count in spans]
            self._indices = np.concatenate(starts) if starts else np.zeros(0, np.int64)
            if self._has_attitude:
                self._quaternion = [(layout.doubles[f"{ATTITUDE}.{axis}"][0] - HEAD) // 8 for axis in "wxyz"]
        data = bytearray(message)
        values = np.frombuffer(data, "<f8", (len(data) - HEAD) // 8, HEAD)
        values[self._indices] *= 180.0 / math.pi
        if not self._has_attitude:
            return bytes(data)
        heading, pitch, roll = quaternion_to_euler(values[self._quaternion])
        end = self._layout.size
        gap = bytes(-(end - HEAD) % 8)  # in front of a float64
        return bytes(data[:end]) + gap + np.degrees((roll, pitch, heading)).tobytes()

    def _changed(self, kind: str) -> str:
        """Name of a type, another one if its fields have other names."""
        return f"{kind}Deg" if kind == self._root or _has_angles(self._definitions, kind) else kind

    def _line(self, field: Field) -> str:
        kind = field.type if field.type in PRIMITIVES else self._changed(field.type)
        array = "" if field.count is None else "[]" if field.count == SEQUENCE else f"[{field.count}]"
        if not _is_angle(field):
            return f"{kind}{array} {field.name}"
        return f"{kind}{array} {field.name}_deg # [{UNITS[field.units[0]]}]"


def _is_angle(field: Field) -> bool:
    """True if all that a field holds are angles, or rates of angles."""
    return len(field.units) == 1 and field.units[0] in UNITS and field.type in ("float64", "geometry_msgs/Vector3")


def _has_angles(definitions: Definitions, kind: str) -> bool:
    fields = definitions.get(kind, ())
    return any(_is_angle(field) or _has_angles(definitions, field.type) for field in fields)


def _angles(definitions: Definitions, kind: str, prefix: str, held: bool) -> list[str]:
    """Names of the float64 fields that are angles, or in a field that holds angles."""
    found = []
    for field in definitions.get(kind, ()):
        name, angle = prefix + field.name, held or _is_angle(field)
        if field.type == "float64":
            found += [name] if angle else []
        elif field.type not in PRIMITIVES:
            found += _angles(definitions, field.type, f"{name}.", angle)
    return found
