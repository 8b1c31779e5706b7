"""Messages as bytes in which numbers are written, without ROS's own way through Python objects.

The messages of every tick of a simulator have the same layout: texts and lengths of lists stay, and numbers change. So
ROS serialises such a message once, and then only its numbers are written.

ROS itself shows where they are: the message is filled with random numbers and serialised several times, and the offset
of a number is the only one at which it was found each time. Finally new numbers are written there, and ROS must read
these and nothing else. So a ROS with another layout of messages is either understood or refused.
"""

import random
import re
import struct
import sys
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rclpy.serialization import deserialize_message, serialize_message

from sbs_sim.errors import SbsError

Array = NDArray[np.float64]

HEAD = 4  # bytes in front of a message in CDR: the kind of encoding; numbers are aligned from there on
LITTLE = (b"\x00\x01\x00\x00", "little")  # plain CDR, least byte first, as this processor has it
DOUBLE, COUNT, INT, UINT, BYTE = "d", "Q", "i", "I", "B"
ROUNDS = (3, 16)  # of random numbers: always, and at most


class LayoutError(SbsError):
    """A message is not laid out as it can be understood."""


class Template:
    """A message whose numbers are written into its bytes.

    Parameters
    ----------
    message : ROS message
        Its texts, the lengths of its lists and all numbers that are not named stay.
    fields : mapping of str to str
        Names of the numbers that change, such as `rotors[0].flap[2]`, and of each the kind: `DOUBLE`, `COUNT` (uint64),
        `INT`, `UINT` (32 bits) or `BYTE`.

    Raises
    ------
    LayoutError
        A number is at no offset or at several, or ROS does not read what was written.
    """

    def __init__(self, message: Any, fields: Mapping[str, str]) -> None:
        first = serialize_message(message)
        if (first[:HEAD], sys.byteorder) != LITTLE:
            raise LayoutError(f"{_name(message)}: messages begin {first[:HEAD].hex(' ')}, 00 01 00 00 is understood")
        own = deserialize_message(first, type(message))
        offsets = _offsets(own, fields)
        size = len(first)
        memory = np.zeros(size + 16, np.uint8)
        start = (HEAD - memory.ctypes.data) % 8  # behind the head, numbers are aligned for the processor too
        self._bytes = memory[start : start + size]
        self._bytes[:] = np.frombuffer(first, np.uint8)
        body = self._bytes[HEAD:]
        self._views = {kind: body[: len(body) // width * width].view(f"u{width}") for kind, width in _WIDTHS.items()}
        self._views[DOUBLE] = self._views[COUNT].view(np.float64)
        self._views[INT] = self._views[UINT].view(np.int32)
        self._indices = {name: (offsets[name] - HEAD) // _WIDTHS[kind] for name, kind in fields.items()}
        self._verify(own, fields)
        self._bytes[:] = np.frombuffer(first, np.uint8)

    def view(self, kind: str) -> NDArray[Any]:
        """All of the message as numbers of a kind; those at `indices` are written."""
        return self._views[kind]

    def indices(self, names: Sequence[str]) -> NDArray[np.int64]:
        """Where numbers of one kind are in its view."""
        return np.array([self._indices[name] for name in names], dtype=np.int64)

    def data(self) -> bytes:
        """The message as it is now."""
        return self._bytes.tobytes()

    def _verify(self, message: Any, fields: Mapping[str, str]) -> None:
        chance = random.Random(-1)
        for name, kind in fields.items():
            number = _some_number(kind, chance)
            _set(message, name, number)
            self._views[kind][self._indices[name]] = number
        if deserialize_message(self.data(), type(message)) != message:
            raise LayoutError(f"{_name(message)}: ROS does not read what was written into its bytes")


_WIDTHS = {DOUBLE: 8, COUNT: 8, INT: 4, UINT: 4, BYTE: 1}


def _offsets(message: Any, fields: Mapping[str, str]) -> dict[str, int]:
    """Of every number the only offset that holds it whatever it is, in bytes from the beginning of the message."""
    least, most = ROUNDS
    found: dict[str, set[int]] = {}
    for turn in range(most):
        chance = random.Random(turn)
        numbers = {name: _some_number(kind, chance) for name, kind in fields.items()}
        for name, number in numbers.items():
            _set(message, name, number)
        data = serialize_message(message)
        for name, kind in fields.items():
            seen = _offsets_of(struct.pack(f"<{kind}", numbers[name]), data)
            found[name] = found[name] & seen if turn else seen
        if any(not offsets for offsets in found.values()):
            break
        if turn + 1 >= least and all(len(offsets) == 1 for offsets in found.values()):
            return {name: offsets.pop() for name, offsets in found.items()}
    name, offsets = next((name, offsets) for name, offsets in found.items() if len(offsets) != 1)
    raise LayoutError(
        f"{_name(message)}: {name} is at {len(offsets)} offsets of the serialised message, 1 is understood"
    )


def _offsets_of(pattern: bytes, data: bytes) -> set[int]:
    """Where a number can be: at multiples of its size behind the head."""
    offsets, width = set(), len(pattern)
    offset = data.find(pattern, HEAD)
    while offset >= 0:
        if (offset - HEAD) % width == 0:
            offsets.add(offset)
        offset = data.find(pattern, offset + 1)
    return offsets


def _some_number(kind: str, chance: random.Random) -> Any:
    """A number that hardly anything else is: all of its bits are random as far as the kind lets them."""
    return chance.uniform(1.0, 2.0) if kind == DOUBLE else chance.getrandbits(8 * _WIDTHS[kind] - (kind == INT))


def _set(message: Any, name: str, value: Any) -> None:
    *path, last = re.findall(r"\w+", name)
    for part in path:
        message = message[int(part)] if part.isdigit() else getattr(message, part)
    if last.isdigit():
        message[int(last)] = value
    else:
        setattr(message, last, value)


def _name(message: Any) -> str:
    return type(message).__name__
