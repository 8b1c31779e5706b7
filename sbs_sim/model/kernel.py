"""How this package compiles its numerical functions.

Two decorators: `kernel` for the pieces, which vanish into their callers, and `entry` for the few
functions that Python calls, whose machine code is kept on disk. Where one entry needs another, it is
given the other's `Address` as an argument.
"""

import contextlib
import hashlib
import os
import tempfile
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

import numba
from numba.types import WrapperAddressProtocol

# Everything that `fastmath` means except "there is no NaN" and "there is no infinity": the checks that
# keep such numbers out of the state must survive the optimiser.
FASTMATH = {"reassoc", "contract", "arcp", "nsz", "afn"}
# Without numba's reference counting (`_nrt`) a kernel that allocates does not compile, and every look at a row of an
# array saves two atomic operations: a third of the time of a derivative.
OPTIONS = {"nogil": True, "error_model": "numpy", "fastmath": FASTMATH, "_nrt": False}


def kernel(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a piece of the model; it is inlined where it is called and leaves nothing on disk."""
    return numba.njit(forceinline=True, **OPTIONS)(function)


def entry(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a function that Python calls, releasing the GIL, and keep its machine code on disk."""
    return _kept(function, OPTIONS)


def exact_entry(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile an `entry` that does every operation as it is written: for what must not hang on where a loop ends."""
    return _kept(function, {**OPTIONS, "fastmath": False})


def _kept(function: Callable[..., Any], options: dict[str, Any]) -> Callable[..., Any]:
    # numba names caches after the path of the source, and colcon's symlink install gives one file two paths
    real = os.path.realpath(function.__code__.co_filename)
    function.__code__ = function.__code__.replace(co_filename=real)
    with _cache_in(cache_folder()):
        return numba.njit(cache=True, **options)(function)


class Address(WrapperAddressProtocol):
    """The machine code of an entry, as an argument with which another entry calls it.

    An entry that named another one would hold its machine code a second time, optimised otherwise. By its address it
    executes the very instructions that Python does, to the same last bit.

    Parameters
    ----------
    function : callable
        An entry.
    *arguments :
        A call's, which select among the machine codes of different types of arguments.
    """

    def __init__(self, function: Any, *arguments: Any) -> None:
        types = tuple(numba.typeof(argument) for argument in arguments)
        function.compile(types)  # takes it from the cache; does nothing where it is there
        self._code = function.overloads[types]

    def __wrapper_address__(self) -> int:
        """Where the code is; numba asks for it."""
        return int(self._code.library.get_pointer_to_function(self._code.fndesc.llvm_cfunc_wrapper_name))

    def signature(self) -> Any:
        """Types of arguments and result; numba asks for them."""
        return self._code.signature


def address(function: Any, *arguments: Any) -> Any:
    """`Address` of an entry; the entry itself where numba compiles nothing (NUMBA_DISABLE_JIT)."""
    return function if numba.config.DISABLE_JIT else Address(function, *arguments)


def cache_folder() -> Path:
    """Where the machine code of these very sources is kept.

    numba asks only whether the file of the function itself has changed, not the files of what it calls.
    A folder named after the content of all of them can never hold stale physics.
    """
    here, digest = Path(__file__).parent, source_digest()
    chosen = os.environ.get("NUMBA_CACHE_DIR")
    if chosen:
        return Path(chosen) / "sbs_sim" / f"kernels-{digest}"
    beside = here / "__pycache__" / f"kernels-{digest}"
    if _writable(beside):
        return beside
    home = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    kept = home / "sbs_sim" / f"kernels-{digest}"
    return kept if _writable(kept) else Path(tempfile.gettempdir()) / f"sbs_sim-{os.getuid()}-{digest}"


def source_digest() -> str:
    """Digest of all sources of the compiled model, 16 hexadecimal digits."""
    return digest_of(Path(__file__).parent.glob("*.py"))


def digest_of(files: Iterable[Path]) -> str:
    """Digest of the contents of files in the order of their paths, 16 hexadecimal digits."""
    return hashlib.sha256(b"\0".join(path.read_bytes() for path in sorted(files))).hexdigest()[:16]


def _writable(folder: Path) -> bool:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return False
    return os.access(folder, os.W_OK)


@contextlib.contextmanager
def _cache_in(folder: Path) -> Iterator[None]:
    """Let numba place caches in a folder for the functions decorated meanwhile, and nowhere else."""
    before = numba.config.CACHE_DIR
    numba.config.CACHE_DIR = str(folder)
    try:
        yield
    finally:
        numba.config.CACHE_DIR = before
