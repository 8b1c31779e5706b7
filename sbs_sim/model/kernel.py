"""How this package compiles its numerical functions.

Two decorators: `kernel` for the pieces, which vanish into their callers, and `entry` for the few
functions that Python calls, whose machine code is kept on disk. Where one entry needs another, it is
given the other's `Address` as an argument.
"""

import contextlib
import fcntl
import functools
import gc
import hashlib
import logging
import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numba
from llvmlite.binding import executionengine
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler
from numba.core.registry import cpu_target
from numba.experimental import function_type as _function_type  # noqa: F401  (registers the type of an `Address` with numba)
from numba.extending import typeof_impl
from numba.types import WrapperAddressProtocol

from sbs_sim.concurrency.interruption import raised_outside
from sbs_sim.model.kernel_cache import cache_folder

# Without numba's reference counting (`_nrt`) a kernel that allocates does not compile, and every look at a row of an
# array saves two atomic operations: a third of the time of a derivative.
OPTIONS = {"nogil": True, "error_model": "numpy", "fastmath": False, "_nrt": False}


def kernel(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a piece of the model; it is inlined where it is called and leaves nothing on disk."""
    if numba.config.DISABLE_JIT:
        return function
    compiled = numba.njit(
        forceinline=True, no_cpython_wrapper=True, no_cfunc_wrapper=True, pipeline_class=_Piece, **OPTIONS
    )(function)

    def add(made: Any) -> None:
        # callers find it by what Python could call, which it does not have
        made = made._replace(entry_point=object())
        made.target_context.insert_user_function(made.entry_point, made.fndesc, [made.library])
        compiled.overloads[tuple(made.signature.args)] = made

    compiled.add_overload = add

    def refuse(*_: Any, **__: Any) -> None:
        raise TypeError(f"{function.__qualname__} is for compiled code: call it from a function that numba compiles")

    compiled._compile_for_args = refuse
    return compiled


class _PieceLibrary(JITCodeLibrary):
    """Code of a piece as it was written down: it is optimised, and made machine code, where it is inlined."""

    def _optimize_functions(self, ll_module: Any) -> None:
        ll_module.data_layout = self._codegen._data_layout

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        self._finalized = True


class _Piece(Compiler):
    """numba's compiler for a piece."""

    def __init__(self, typing: Any, target: Any, library: Any, args: Any, result: Any, flags: Any, names: Any) -> None:
        flags.no_compile = True
        super().__init__(typing, target, _PieceLibrary(target.codegen(), "piece"), args, result, flags, names)


class _EntryLibrary(JITCodeLibrary):
    """Code of an entry with all its pieces, optimised once.

    Once more before that is what numba does for the sake of reference counts, which there are none of. It takes its
    time, and makes flights slower.
    """

    def _optimize_final_module(self) -> None:
        if hasattr(self._codegen, "_mpm_full"):  # until numba 0.61
            self._codegen._mpm_full.run(self._final_module)
        else:
            passes, options = self._codegen._module_pass_manager()
            passes.run(self._final_module, options)


class _Entry(Compiler):
    """numba's compiler for an entry."""

    def __init__(self, typing: Any, target: Any, library: Any, *others: Any) -> None:
        library = _EntryLibrary(target.codegen(), "entry")
        library.enable_object_caching()
        _say_that_it_takes_time()
        super().__init__(typing, target, library, *others)


@functools.cache
def _say_that_it_takes_time() -> None:
    """Say once why nothing happens for a while; `sbs_sim.terminal.progress.show_compiling` shows it to a person."""
    logging.getLogger(__name__).info("compiling for this kind of aircraft, once: some seconds, up to a minute")


def entry(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a function that Python calls, releasing the GIL, and keep its machine code on disk."""
    # numba names caches after the path of the source, and colcon's symlink install gives one file two paths
    real = os.path.realpath(function.__code__.co_filename)
    function.__code__ = function.__code__.replace(co_filename=real)
    folder = cache_folder()
    if folder is None:
        return _prepared(numba.njit(pipeline_class=_Entry, **OPTIONS)(function))
    with _cache_in(folder):
        dispatcher = numba.njit(cache=True, pipeline_class=_Entry, **OPTIONS)(function)
    if not numba.config.DISABLE_JIT:
        kept = dispatcher._cache._cache_file
        kept.save = _alone(kept.save, folder)
        _compile_once(dispatcher, folder)
    return _prepared(dispatcher)


def _alone(save: Callable[..., None], folder: Path) -> Callable[..., None]:
    """Save for one process at a time: two at once would give one name to machine code for different types."""

    def save_alone(*arguments: Any) -> None:
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX)
            save(*arguments)
        finally:
            os.close(descriptor)

    return save_alone


def _compile_once(dispatcher: Any, folder: Path) -> None:
    """Let a process that needs what another one compiles wait for its machine code, and not compile it as well."""
    cache, compile_one = dispatcher._cache, dispatcher.compile
    held: list[int] = []  # the lock of what is being compiled; numba compiles in one thread at a time

    def look_and_wait(signature: Any, target: Any) -> Any:
        # `load_overload` would load first all that numba could need to compile, scipy.linalg included, for a quarter
        # of a second
        found = cache._load_overload(signature, target)
        if found is None:
            wanted = f"{cache._cache_file._index_path} {signature} {target.codegen().magic_tuple()}"
            name = f"{hashlib.sha256(wanted.encode()).hexdigest()[:16]}.lock"
            with contextlib.suppress(OSError):  # where there are no locks everybody compiles
                held.append(os.open(folder / name, os.O_CREAT | os.O_RDWR, 0o600))
                _wait_for(held[-1])
            found = cache._load_overload(signature, target)
        return found

    def compile_once(signature: Any) -> Any:
        try:
            return compile_one(signature)
        finally:
            if held:
                os.close(held.pop())

    cache.load_overload, dispatcher.compile = look_and_wait, compile_once


def _wait_for(lock: int) -> None:
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        _say_that_it_takes_time()
        fcntl.flock(lock, fcntl.LOCK_EX)


def _prepared(dispatcher: Any) -> Any:
    """Let no Ctrl-C be lost, and no time, while the machine code of a function is compiled or loaded.

    LLVM calls back into Python meanwhile, and an exception that is raised in such a callback is lost.
    """
    if not numba.config.DISABLE_JIT:
        for name in ("_compile_for_args", "compile"):
            work = _without_collection(getattr(dispatcher, name))
            setattr(dispatcher, name, raised_outside(executionengine.__file__, work))
    return dispatcher


def _without_collection(function: Callable[..., Any]) -> Callable[..., Any]:
    """Function that runs without garbage collection: the compiler makes millions of objects, hardly any in cycles."""

    @functools.wraps(function)
    def call(*arguments: Any, **names: Any) -> Any:
        if not gc.isenabled():
            return function(*arguments, **names)
        gc.disable()
        try:
            return function(*arguments, **names)
        finally:
            gc.enable()

    return call


class Address(WrapperAddressProtocol):
    """The machine code of an entry, as an argument with which another entry calls it.

    An entry that named another one would hold its machine code a second time, optimised otherwise. By its address it
    executes the very instructions that Python does, to the same last bit.

    Python may call it as well, always with arguments of the types that it was made for: that is not checked. An entry
    itself looks at the types of all arguments at every call, and at a model's hundred arrays for longer than a
    derivative takes.

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
        code = function.overloads[types]
        self._code = code  # must live as long as its address is in use
        self._pointer = int(code.library.get_pointer_to_function(code.fndesc.llvm_cfunc_wrapper_name))
        self.type = numba.types.FunctionType(code.signature)
        self._call = code.entry_point

    def __call__(self, *arguments: Any) -> Any:
        """Call it from Python, which releases the GIL meanwhile."""
        return self._call(*arguments)

    def __wrapper_address__(self) -> int:
        """Address of the code, which numba asks for."""
        return self._pointer

    def signature(self) -> Any:
        """Types of arguments and result; numba asks for them."""
        return self._code.signature


@typeof_impl.register(Address)
def _type_of_address(address: Address, _: Any) -> Any:
    """At every call; numba's own answer makes a new type each time."""
    return address.type


def address(function: Any, *arguments: Any) -> Any:
    """`Address` of an entry; the entry itself where numba compiles nothing (NUMBA_DISABLE_JIT)."""
    return function if numba.config.DISABLE_JIT else Address(function, *arguments)


def target() -> tuple[str, frozenset[str]]:
    """Processor that is compiled for and its features, which the environment may set; "" and none where nothing is."""
    if numba.config.DISABLE_JIT:
        return "", frozenset()
    _, name, features = cpu_target.target_context.codegen().magic_tuple()
    return name, frozenset(feature[1:] for feature in features.split(",") if feature.startswith("+"))


@contextlib.contextmanager
def _cache_in(folder: Path) -> Iterator[None]:
    """Let numba put caches into a folder for the functions decorated meanwhile, and nowhere else."""
    before = numba.config.CACHE_DIR
    numba.config.CACHE_DIR = str(folder)
    try:
        yield
    finally:
        numba.config.CACHE_DIR = before
