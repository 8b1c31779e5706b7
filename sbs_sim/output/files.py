"""Files of results: written completely or not at all."""

import errno
import os
import shutil
import uuid
from collections.abc import Collection
from contextlib import suppress
from pathlib import Path

from sbs_sim.errors import ExportError


def write(path: str | Path, content: bytes | str) -> None:
    """Write a complete file, or none; a text in UTF-8. An older one is replaced, devices and pipes are written to.

    Raises
    ------
    ExportError
        It cannot be written: the message says why, and what was there before is still there.
    """
    path = Path(path)
    data = content.encode() if isinstance(content, str) else content
    try:
        if path.is_file() or not path.exists():
            _replace(path, data)
        else:
            path.write_bytes(data)
    except (OSError, ValueError) as error:  # the latter for names that no file can have
        reason = f"there is no folder {_named(path.parent)}" if _no_folder(path.parent) else _reason(error)
        raise ExportError(f"{_named(path)}: cannot be written: {reason}") from None


def _replace(path: Path, data: bytes) -> None:
    """Write beside the file, and put that into its place."""
    with suppress(FileNotFoundError), path.open("r+b"):  # a protected file, or a name that cannot be, ends here
        pass
    path = path.resolve()  # a link stays one
    beside = path.with_name(f".{uuid.uuid4().hex}")
    try:
        beside.write_bytes(data)
        if path.exists():
            shutil.copymode(path, beside)
        beside.replace(path)
    except BaseException:
        with suppress(OSError):
            beside.unlink()
        raise


def check_target(path: str | Path | None, suffixes: Collection[str] = ()) -> None:
    """Raise what `write` would, as far as it can be known before the work of which it is to keep the result.

    Parameters
    ----------
    path : str or Path, optional
        None is fine.
    suffixes : collection of str
        Those that are allowed; all if empty.

    Raises
    ------
    ExportError
        Another suffix, or no folder to write in.
    """
    if path is None:
        return
    path = Path(path)
    if suffixes and path.suffix.lower() not in suffixes:
        raise ExportError(f"{_named(path)}: allowed are names that end in {', '.join(suffixes)}")
    if _no_folder(path.parent):
        raise ExportError(f"{_named(path)}: cannot be written: there is no folder {_named(path.parent)}")
    if os.path.isfile(path.parent):  # pathlib's raises for names that cannot be
        raise ExportError(f"{_named(path)}: cannot be written: {os.strerror(errno.ENOTDIR)}")


def _named(path: Path) -> str:
    """A path with its control characters as Python writes them: a refusal is one line."""
    return "".join(letter if letter.isprintable() else repr(letter)[1:-1] for letter in str(path))


def _no_folder(folder: Path) -> bool:
    try:
        return not folder.exists()
    except (OSError, ValueError):
        return False


def _reason(error: Exception) -> str:
    return str(getattr(error, "strerror", None) or error)
