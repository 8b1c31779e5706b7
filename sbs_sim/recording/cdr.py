"""Messages in CDR to arrays.

The texts and lists in the messages of a topic mostly keep their lengths, and so the values keep their offsets. Then one
numpy structured type describes all messages, and they are decoded at once; `Layout` makes it. Where the lengths vary,
`decode_one_by_one` does the same message by message with the package `mcap_ros2`.

CDR as ROS 2 writes it (XCDR1): 4 bytes say the byte order. Behind them the offset of every number is a multiple of its
size. A text is its length, with a closing zero, and its bytes; a list is its length and its values.
The bytes in the gaps are undefined. So are some bytes at the end: Fast DDS counts a gap in front of the values of an
empty list and then writes none.
"""

import struct
from collections import OrderedDict
from collections.abc import Callable, Iterator, Sequence
from functools import cached_property
from typing import Any

import numpy as np
import zstandard
from mcap.records import Schema
from mcap_ros2.decoder import DecoderFactory
from numpy.typing import NDArray

from sbs_sim.errors import RecordingError
from sbs_sim.recording.definitions import NUMBERS, PRIMITIVES, SEQUENCE, Definitions, Field

Columns = dict[str, NDArray[Any]]

HEAD = 4  # bytes in front of the message
PADDING = 3  # bytes that may follow it
MAX_LAYOUTS = 64  # that are kept to compare messages with
ZSTD = b"\x28\xb5\x2f\xfd"
MAX_MESSAGE_SIZE = 1 << 28  # bytes of one that was compressed


class Layout:
    """Offsets and types of all values in a message; they are the same in all messages with the same lengths.

    Parameters
    ----------
    definitions : dict
        See `sbs_sim.recording.definitions.parse`.
    root : str
        Type of the message, package/Type.
    sample : bytes
        A message.

    Raises
    ------
    RecordingError
        The message is not of that type, or of a kind that cannot be read.
    """

    def __init__(self, definitions: Definitions, root: str, sample: bytes) -> None:
        if len(sample) < HEAD or sample[0] != 0 or sample[1] > 1:
            raise RecordingError(f"{root}: messages in plain CDR can be read, this one begins {sample[:HEAD].hex(' ')}")
        self._order = "<" if sample[1] else ">"
        self._definitions, self._sample = definitions, sample
        self._offset = HEAD
        self._padding = PADDING
        self._formats: dict[str, tuple[str | tuple[str, tuple[int]], int]] = {"#order": ("u2", 0)}
        self._constants = {"#order": int.from_bytes(sample[:2], "little")}  # what must be alike in all messages
        self._columns: dict[str, list[str] | None] = {}  # names of the texts of a column that is a list of texts
        self._texts: set[str] = set()  # columns that are single texts
        self._message(root, "")
        if not 0 <= len(sample) - self._offset <= self._padding:
            raise RecordingError(f"a message of {len(sample)} bytes does not agree with the definition of {root}")

    def fits(self, message: bytes) -> bool:
        """True if a message has its values at the same offsets."""
        return len(message) == len(self._sample) and all(
            message[offset : offset + len(constant)] == constant for offset, constant in self._marks
        )

    @property
    def size(self) -> int:
        """Bytes up to the end of its last value; up to PADDING may follow."""
        return self._offset

    @cached_property
    def doubles(self) -> dict[str, tuple[int, int]]:
        """Offset [bytes] and number of values of every float64 field, by name; least byte first alone."""
        found = {}
        for name in self._columns.keys() & self._formats.keys():
            kind, offset = self._formats[name]
            code, shape = (kind, (1,)) if isinstance(kind, str) else kind
            if code == "<f8":
                found[name] = offset, shape[0]
        return found

    @cached_property
    def _marks(self) -> list[tuple[int, bytes]]:
        """Bytes that are alike in all messages of the layout, with their offsets."""
        sizes = ((self._formats[name][1], np.dtype(self._formats[name][0]).itemsize) for name in self._constants)
        return [(offset, self._sample[offset : offset + size]) for offset, size in sizes]

    def decode(self, messages: Sequence[bytes]) -> Columns | None:
        """Values of many messages by flattened names, if all have this layout."""
        size = len(self._sample)
        if any(len(message) != size for message in messages):
            return None
        names = list(self._formats)
        formats, offsets = zip(*self._formats.values(), strict=True)
        dtype = np.dtype({"names": names, "formats": formats, "offsets": offsets, "itemsize": size})
        values = np.frombuffer(b"".join(messages), dtype)
        if any((values[name] != value).any() for name, value in self._constants.items()):
            return None
        return {name: self._column(values, name, texts) for name, texts in self._columns.items()}

    def _column(self, values: NDArray[Any], name: str, texts: list[str] | None) -> NDArray[Any]:
        if texts is not None:
            columns = [self._text(values, text) for text in texts]
            return np.stack(columns, axis=1) if texts else np.empty((len(values), 0), "U1")
        if name in self._texts:
            return self._text(values, name)
        return np.ascontiguousarray(values[name], values[name].dtype.newbyteorder("="))

    def _text(self, values: NDArray[Any], name: str) -> NDArray[np.str_]:
        if name not in self._formats:
            return np.full(len(values), "")
        raw = values[name]
        if (raw == raw[0]).all():  # as the names of frames
            return np.full(len(values), raw[0].decode())
        return np.char.decode(raw, "utf-8")

    def _message(self, kind: str, prefix: str) -> None:
        if kind not in self._definitions:
            raise RecordingError(f"there is no definition of {kind}")
        for field in self._definitions[kind]:
            self._field(field, prefix + field.name)
        if not self._definitions[kind]:
            self._offset += 1  # a message must not be empty, so an empty one has a byte

    def _field(self, field: Field, name: str) -> None:
        count = self._length(name) if field.count == SEQUENCE else field.count
        if field.type in PRIMITIVES:
            self._columns[name] = None
        if field.type in NUMBERS:
            self._number(name, NUMBERS[field.type], count)
        elif field.type == "string":
            if count is None:
                self._string(name)
                self._texts.add(name)
            else:
                self._columns[name] = texts = [f"{name}[{index}]" for index in range(self._possible(count))]
                for text in texts:
                    self._string(text)
        elif field.type in PRIMITIVES:
            raise RecordingError(f"{name}: values of type {field.type} cannot be read")
        elif count is None:
            self._message(field.type, f"{name}.")
        else:
            for index in range(self._possible(count)):
                self._message(field.type, f"{name}[{index}].")

    def _number(self, name: str, code: str, count: int | None) -> None:
        size = np.dtype(code).itemsize
        if count == 0:
            self._padding += size - 1
        else:
            self._align(size)
        kind = self._order + code
        self._formats[name] = (kind if count is None else (kind, (self._possible(count),)), self._offset)
        self._offset += size * (1 if count is None else count)

    def _string(self, name: str) -> None:
        length = self._length(name)
        if length > 1:
            self._formats[name] = (f"S{length - 1}", self._offset)
        self._offset += self._possible(length)

    def _length(self, name: str) -> int:
        """A length in the sample, which must be the same in all messages."""
        self._align(4)
        try:
            (length,) = struct.unpack_from(f"{self._order}I", self._sample, self._offset)
        except struct.error:
            raise RecordingError(f"a message ends before its field {name}") from None
        self._formats[f"#{name}"] = (f"{self._order}u4", self._offset)
        self._constants[f"#{name}"] = length
        self._offset += 4
        return int(length)

    def _possible(self, count: int) -> int:
        """A number of things that cannot be more than there are bytes."""
        if count > len(self._sample):
            raise RecordingError(f"a message of {len(self._sample)} bytes cannot hold {count} values")
        return count

    def _align(self, size: int) -> None:
        self._offset += -(self._offset - HEAD) % size


class Fit:
    """Whether messages are what their type says, to be checked before they are published.

    Parameters
    ----------
    definitions, root
        See `Layout`.
    """

    def __init__(self, definitions: Definitions, root: str) -> None:
        self._definitions, self._root = definitions, root
        self._known: OrderedDict[int, Layout] = OrderedDict()  # by the size of the messages
        # which cannot be distinguished
        self._blind = any(field.type == "wstring" for fields in definitions.values() for field in fields)

    def check(self, message: bytes) -> None:
        """Raise RecordingError if a message is not what it should be."""
        known = self._known.get(len(message))
        if self._blind or (known is not None and known.fits(message)):
            return
        self._known[len(message)] = Layout(self._definitions, self._root, message)
        if len(self._known) > MAX_LAYOUTS:
            self._known.popitem(last=False)


def plain(message: bytes) -> bytes:
    """Message as it was before a recorder compressed it: rosbag2 can do that with each on its own.

    Raises
    ------
    RecordingError
        It cannot be unpacked.
    """
    if not message.startswith(ZSTD):  # no CDR begins like that
        return message
    try:
        if zstandard.frame_content_size(message) > MAX_MESSAGE_SIZE:
            raise RecordingError(f"a compressed message is larger than {MAX_MESSAGE_SIZE} bytes")
        return zstandard.ZstdDecompressor().decompress(message, max_output_size=MAX_MESSAGE_SIZE)
    except (zstandard.ZstdError, MemoryError) as error:
        raise RecordingError(f"a compressed message cannot be unpacked: {' '.join(str(error).split())}") from None


def decode(schema: Schema, definitions: Definitions, root: str, messages: Sequence[bytes]) -> Columns:
    """Values of the messages of a topic by flattened names.

    Parameters
    ----------
    schema : Schema
        The type as the recording has it, and taken apart:
    definitions, root
        See `Layout`.
    messages : sequence of bytes

    Returns
    -------
    dict of str to ndarray
        By names such as `position.x` or `rotors[0].flap`. Numbers and texts have shape (n,), lists of them (n, length);
        where the length of a list varies, an array of n arrays. Of a list of messages each index is a column; a
        message that has fewer leaves NaN, or None where there is no NaN.

    Raises
    ------
    RecordingError
        The messages do not agree with their definition.
    """
    if not messages:
        return dict(_empty(definitions, root, ""))
    messages = [plain(message) for message in messages]
    columns = Layout(definitions, root, messages[0]).decode(messages)
    return decode_one_by_one(schema, definitions, root, messages) if columns is None else columns


def decode_one_by_one(schema: Schema, definitions: Definitions, root: str, messages: Sequence[bytes]) -> Columns:
    """The same as `decode`, for messages of any lengths."""
    rows: list[dict[str, Any]] = []
    fields: dict[str, Field] = {}
    try:
        read: Callable[[bytes], Any] | None = DecoderFactory().decoder_for("cdr", schema)
        if read is None:
            raise RecordingError(f"{root}: definitions of kind {schema.encoding!r} cannot be read")
        for message in messages:
            rows.append({})
            _flatten(read(message), definitions, root, "", rows[-1], fields)
    except RecordingError:
        raise
    except Exception as error:  # whatever a foreign definition leads to
        raise RecordingError(f"a message does not agree with the definition of {root}: {error!r}") from None
    return {name: _column(field, [row.get(name) for row in rows]) for name, field in fields.items()}


def _flatten(
    message: Any,
    definitions: Definitions,
    kind: str,
    prefix: str,
    row: dict[str, Any],
    fields: dict[str, Field],
) -> None:
    for field in definitions[kind]:
        name, value = prefix + field.name, getattr(message, field.name)
        if field.type in PRIMITIVES:
            row[name], fields[name] = value, field
        elif field.count is None:
            _flatten(value, definitions, field.type, f"{name}.", row, fields)
        else:
            for index, item in enumerate(value):
                _flatten(item, definitions, field.type, f"{name}[{index}].", row, fields)


def _empty(definitions: Definitions, kind: str, prefix: str) -> Iterator[tuple[str, NDArray[Any]]]:
    """Columns of no messages, as far as they can be known."""
    for field in definitions.get(kind, ()):
        if field.type in PRIMITIVES:
            shape = (0,) if field.count is None else (0, max(0, field.count))
            yield prefix + field.name, np.empty(shape, NUMBERS.get(field.type, "U1"))
        elif field.count is None:
            yield from _empty(definitions, field.type, f"{prefix}{field.name}.")


def _column(field: Field, values: list[Any]) -> NDArray[Any]:
    code = NUMBERS.get(field.type, "U")
    if field.count is not None:
        lists = [None if value is None else np.array(list(value), code) for value in values]
        shapes = {None if item is None else item.shape for item in lists}
        if len(shapes) == 1 and None not in shapes:
            return np.stack([item for item in lists if item is not None])
        return _objects(lists)
    if None not in values:
        return np.array(values, code)
    if code in ("f4", "f8"):
        return np.array([np.nan if value is None else value for value in values], code)
    return _objects(values)


def _objects(values: list[Any]) -> NDArray[np.object_]:
    column = np.empty(len(values), object)
    column[:] = values
    return column
