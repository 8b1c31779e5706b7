"""Folder for the machine code of the kernels, which only the user and the owners of the sources can write to.

numba unpickles what it finds there and executes it. Anyone who can write to such a folder, or replace it,
can execute code with the rights of the user.
"""

import contextlib
import functools
import hashlib
import logging
import os
import stat
import tempfile
from collections.abc import Iterable, Iterator
from pathlib import Path

HERE = Path(os.path.realpath(__file__)).parent
BESIDE = HERE / "__pycache__"
EVERYBODY = "everybody"
CLOSED = 0o077  # bits of a mode that are off where nobody but the owner gets in


@functools.cache
def cache_folder() -> Path | None:
    """Folder of the machine code of these very sources; None where there is none to be trusted.

    numba asks only whether the file of the function itself has changed, not the files of what it calls.
    A folder named after the content of all of them can never hold stale physics.
    """
    name = f"kernels-{source_digest()}"
    folder, refusals = _first_trusted([(base / name, judged) for base, judged in _candidates()])
    beside = BESIDE / name
    if folder not in (None, beside) and "NUMBA_CACHE_DIR" not in os.environ:
        _take_over(beside, folder)
    if refusals or folder is None:
        kept = f"kept in {folder}" if folder else "compiled anew by every process, which takes up to a minute"
        why = "; ".join(refusals) or "no folder for them can be written"
        logging.getLogger(__name__).warning(
            f"sbs_sim: kernels are {kept}: {why};"
            " remedy: NUMBA_CACHE_DIR names a folder of your own that no other user may write into"
        )
    return folder


def _candidates() -> Iterator[tuple[Path, bool]]:
    """Folders to try, in order, each with whether all that holds it is judged.

    Beside the sources it is not: whoever may change the sources needs no other way.
    """
    if chosen := os.environ.get("NUMBA_CACHE_DIR"):
        yield Path(chosen) / "sbs_sim", True
    yield BESIDE, False
    home = os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")
    if os.path.isabs(home):  # others are to be ignored, XDG Base Directory Specification
        yield Path(home) / "sbs_sim", True


def _first_trusted(candidates: Iterable[tuple[Path, bool]]) -> tuple[Path | None, list[str]]:
    """The first folder that is trusted and can be written, and why others before it are not trusted."""
    refusals = []
    for candidate, judged in candidates:
        folder = Path(os.path.realpath(candidate))  # links may be turned to somewhere else later
        try:
            _make(folder)
            reason = refusal(folder, [*folder.parents] if judged else [folder.parent], () if judged else (HERE,))
        except OSError:
            continue
        if reason:
            refusals.append(reason)
        elif os.access(folder, os.W_OK | os.X_OK):
            return folder, refusals
    return None, refusals


def _take_over(finished: Path, folder: Path) -> None:
    """Copy machine code that is kept where nobody may write: numba takes nothing from such a folder.

    What cannot be copied, or is not to be trusted, is compiled.
    """
    with contextlib.suppress(OSError):
        if refusal(finished, [finished.parent], (HERE,)):
            return
        for index in finished.glob("*/*.nbi"):
            target = folder / index.parent.name
            if (target / index.name).exists():
                continue
            target.mkdir(mode=0o700, exist_ok=True)
            # the index last, and each file atomically: the files that an index names are complete
            for path in (*index.parent.glob(f"{index.stem}.*.nbc"), index):
                with tempfile.NamedTemporaryFile(dir=target, delete=False) as copy:
                    copy.write(path.read_bytes())
                os.replace(copy.name, target / path.name)


def _make(folder: Path) -> None:
    """Make a folder, and those that hold it, for this user alone."""
    for part in (*reversed(folder.parents), folder):
        if not part.is_dir():
            part.mkdir(mode=0o700, exist_ok=True)


def refusal(folder: Path, holding: Iterable[Path], like: Iterable[Path] = ()) -> str:
    """Why a folder and what is in it are not to be trusted, in words; empty if they are.

    Parameters
    ----------
    folder : Path
    holding : iterable of Path
        Folders above it that are judged too.
    like : iterable of Path
        Who may write there may write here.

    Raises
    ------
    OSError
        It cannot be looked at.
    """
    trusted = {"user 0", f"user {os.geteuid()}"}.union(*(_writers(path.stat()) for path in like))
    for path in holding:
        found = path.stat()
        sticky = bool(found.st_mode & stat.S_ISVTX)  # there, others cannot rename or delete what is ours
        if strange := _writers(found, owner_alone=sticky) - trusted:
            return _words(path, strange)
    own = folder.stat()
    if strange := _writers(own) - trusted:
        return _words(folder, strange)
    for parent, folders, files in os.walk(folder):
        for name in (*folders, *files):
            path = Path(parent, name)
            if strange := _writers(path.lstat(), owner_alone=not own.st_mode & CLOSED) - trusted:
                return _words(path, strange)
    return ""


def _writers(found: os.stat_result, owner_alone: bool = False) -> set[str]:
    """Who may write, in words."""
    writers = {f"user {found.st_uid}"}  # an owner can give himself the right
    if found.st_mode & stat.S_IWGRP and not owner_alone:
        writers.add(f"group {found.st_gid}")
    if found.st_mode & stat.S_IWOTH and not owner_alone:
        writers.add(EVERYBODY)
    return writers


def _words(path: Path, strange: set[str]) -> str:
    who = "everybody" if EVERYBODY in strange else " and ".join(sorted(strange))
    return f"{path}: {who} may write there"


def source_digest() -> str:
    """Digest of the very bytes of all sources of the compiled model and of its lanes, 16 hexadecimal digits.

    `sbs_sim.versions` has one of what they say, which takes longer.
    """
    files = sorted([*HERE.glob("*.py"), *(HERE.parent / "lanes").glob("*.py")])
    return hashlib.sha256(b"\0".join(path.read_bytes() for path in files)).hexdigest()[:16]
