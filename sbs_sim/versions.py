"""What decides the bits of a result, beside the aircraft and the commands, and what only surrounded it.

The model's arithmetic is written out to the last rounding (`sbs_sim.lanes`), so its bits are the same for every
processor, compilation target and level of optimisation, and whether anything is compiled or not.
"""

import ast
import functools
import hashlib
import importlib.metadata
import platform
from collections.abc import Iterable, Iterator
from pathlib import Path

from numba import config

import sbs_sim
from sbs_sim.model.kernel import target

PACKAGE = Path(__file__).parent
SOURCES = ("model/*.py", "lanes/*.py")
# Packages that could round otherwise in another version. numba and llvmlite translate: lanes are explicit instructions,
# numbers beside them plain ones without fast math, so only other instructions for the same Python, or a fault, would
# change a bit. numpy decides in which order its sums go.
PACKAGES = ("numpy", "numba", "llvmlite")
INTERPRETER = "interpreter"  # NUMBA_DISABLE_JIT: nothing is compiled


def versions() -> dict[str, str]:
    """Versions of everything that decides the bits of a result.

    Returns
    -------
    dict of str to str
        Packages by name, and "model_sources": a digest of what the model's sources say, without comments.
    """
    return {
        "sbs_sim": sbs_sim.__version__,
        **{name: importlib.metadata.version(name) for name in PACKAGES},
        "model_sources": source_digest(path for pattern in SOURCES for path in PACKAGE.glob(pattern)),
    }


def surroundings() -> dict[str, str]:
    """Where something was recorded: what is worth knowing, but decides no bit.

    Returns
    -------
    dict of str to str
        "python", "machine", "libc", and "target", what numba compiles for, which the environment may set
        (NUMBA_CPU_NAME), with the level of "optimisation".
    """
    return {
        "python": platform.python_version(),
        "machine": f"{platform.system()} {platform.machine()}",
        "libc": " ".join(platform.libc_ver()),
        "target": INTERPRETER if config.DISABLE_JIT else target()[0],
        "optimisation": "" if config.DISABLE_JIT else f"O{int(config.OPT)}",
    }


def differences(recorded: dict[str, str]) -> dict[str, tuple[str, str]]:
    """What is other here than it was where something was recorded: recorded, here; by name.

    Parameters
    ----------
    recorded : dict of str to str
        `versions` of that time, perhaps with more that decides nothing.
    """
    return {name: (recorded.get(name, ""), own) for name, own in versions().items() if recorded.get(name) != own}


def in_words(name: str, there: str, here: str, where: str = "recorded") -> str:
    """A difference of versions in one short line; `where` says what `there` is."""
    return f"other {name}: {there or 'unknown'} {where}, {here or 'none'} here"


# --- what sources say -------------------------------------------------------------------------------------------


def source_digest(files: Iterable[Path]) -> str:
    """Digest of what sources say, in the order of their paths, 16 hexadecimal digits.

    Comments, docstrings and the layout do not count.
    """
    return _digest_of(tuple(sorted(files)))


@functools.cache
def _digest_of(files: tuple[Path, ...]) -> str:
    digest = hashlib.sha256()
    for path in files:
        for part in _said(ast.parse(path.read_bytes())):
            digest.update(part.encode() + b"\0")
    return digest.hexdigest()[:16]


def _said(node: ast.AST) -> Iterator[str]:
    """A tree of syntax as texts. What is empty is left out: other versions of Python have other fields of that kind."""
    yield f"({type(node).__name__}"
    for name, value in ast.iter_fields(node):
        if isinstance(node, ast.Constant):
            if name == "value":
                yield repr(value)
        elif isinstance(value, list):
            for item in value:
                if isinstance(item, ast.AST) and not _is_docstring(item):
                    yield name
                    yield from _said(item)
                elif isinstance(item, str):
                    yield f"{name} {item}"
        elif isinstance(value, ast.AST):
            yield name
            yield from _said(value)
        elif value is not None:
            yield f"{name} {value!r}"
    yield ")"


def _is_docstring(node: ast.AST) -> bool:
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)
