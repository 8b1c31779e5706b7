"""A file that is read at given offsets, with one-line errors."""

import os
import zlib
from collections.abc import Iterator
from pathlib import Path
from types import TracebackType

from sbs_sim.errors import RecordingError
from sbs_sim.recording.mcap_file import reason
from sbs_sim.recording.other_formats import describe_file, describe_folder

BLOCK = 1 << 20
HEAD_SIZE = 64  # bytes that show what kind of file it is


class DamageError(Exception):
    """Invalid data at an offset of the file; the text gives the reason."""


class Source:
    """A file that is read at given offsets; a context that closes it.

    Raises
    ------
    RecordingError
        The file cannot be read: path and reason in one line. So do the methods.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._descriptor = -1
        try:
            self._descriptor = os.open(path, os.O_RDONLY | os.O_CLOEXEC)
            self.size = os.lseek(self._descriptor, 0, os.SEEK_END)
            head = os.pread(self._descriptor, HEAD_SIZE, 0)
        except IsADirectoryError:  # a folder can be opened, but not read
            self.close()
            raise RecordingError(f"cannot read {path}: {describe_folder(path)}") from None
        except (OSError, ValueError) as error:
            self.close()
            raise RecordingError(f"cannot read {path}: {reason(error)}") from None
        if other := describe_file(path, head):
            self.close()
            raise RecordingError(f"cannot read {path}: {other}")

    def at(self, offset: int, length: int) -> bytes:
        """Bytes at an offset.

        Raises
        ------
        DamageError
            The file ends before.
        """
        if not 0 <= length <= self.size - offset:
            raise DamageError("the file ends in the middle of a record")
        parts = []
        while length:
            try:
                part = os.pread(self._descriptor, length, offset)
            except OSError as error:
                raise RecordingError(f"cannot read {self.path}: {reason(error)}") from None
            if not part:
                raise DamageError("the file ends in the middle of a record")
            parts.append(part)
            offset += len(part)
            length -= len(part)
        return parts[0] if len(parts) == 1 else b"".join(parts)

    def blocks(self, start: int, end: int) -> Iterator[tuple[int, bytes]]:
        """Everything between two offsets in blocks, each with its offset."""
        for offset in range(start, end, BLOCK):
            yield offset, self.at(offset, min(BLOCK, end - offset))

    def checksum(self, end: int) -> int:
        """Checksum of everything before an offset."""
        crc = 0
        for _, block in self.blocks(0, end):
            crc = zlib.crc32(block, crc)
        return crc

    def close(self) -> None:
        """Close the file."""
        if self._descriptor >= 0:
            os.close(self._descriptor)
        self._descriptor = -1

    def __enter__(self) -> "Source":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
