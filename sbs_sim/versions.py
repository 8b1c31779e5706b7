"""What decides the bits of a result, beside the aircraft and the commands."""

import importlib.metadata
import platform

from numba import config

from sbs_sim.model.kernel import target
from sbs_sim.model.kernel_cache import source_digest

TARGET = "target"
FEATURES = "target_features"
# Logs of earlier versions name what the host was, which was the target too where the environment did not say otherwise.
EARLIER_NAMES = {"cpu": TARGET, "cpu_features": FEATURES}
SHOWN = 3  # of the names of many features
INTERPRETER = "interpreter"  # NUMBA_DISABLE_JIT: nothing is compiled


def versions() -> dict[str, str]:
    """Versions of everything that decides the bits of a result.

    Returns
    -------
    dict of str to str
        Packages by name; "python", "machine", "libc", "model_sources" (a digest); "target" and "target_features", what
        numba compiles for, which the environment may set (NUMBA_CPU_NAME, NUMBA_CPU_FEATURES), with "optimisation".
    """
    packages = ("sbs_sim", "numpy", "numba", "llvmlite")
    return {
        **{name: importlib.metadata.version(name) for name in packages},
        "python": platform.python_version(),
        "machine": f"{platform.system()} {platform.machine()}",
        "libc": " ".join(platform.libc_ver()),
        **compilation_target(),
        "model_sources": source_digest(),
    }


def compilation_target() -> dict[str, str]:
    """What the compiled kernels are made for: "target", "target_features", "optimisation"."""
    if config.DISABLE_JIT:
        return {TARGET: INTERPRETER, FEATURES: "", "optimisation": ""}
    name, features = target()
    passes = "".join(" vectorized " + kind for kind, on in _vectorizers() if on)
    return {TARGET: name, FEATURES: ",".join(sorted(features)), "optimisation": f"O{int(config.OPT)}{passes}"}


def _vectorizers() -> tuple[tuple[str, bool], ...]:
    return ("loops", bool(config.LOOP_VECTORIZE)), ("straight lines", bool(config.SLP_VECTORIZE))


def differences(recorded: dict[str, str]) -> dict[str, tuple[str, str]]:
    """What is other here than it was where something was recorded: recorded, here; by name.

    Parameters
    ----------
    recorded : dict of str to str
        `versions` of that time, perhaps of an earlier version of this package, which did not know all names.
    """
    known = {EARLIER_NAMES.get(name, name): version for name, version in recorded.items()}
    if TARGET in known:
        known.setdefault("optimisation", compilation_target()["optimisation"])  # was never said
    return {name: (known.get(name, ""), own) for name, own in versions().items() if known.get(name) != own}


def in_words(name: str, there: str, here: str, where: str = "recorded") -> str:
    """A difference of versions in one short line; `where` says what `there` is."""
    if name != FEATURES:
        return f"other {name}: {there or 'unknown'} {where}, {here or 'none'} here"
    other, own = ({feature for feature in text.split(",") if feature} for text in (there, here))
    return f"other {name}: {_some(other - own)} only {where}, {_some(own - other)} only here"


def _some(names: set[str]) -> str:
    """A few of many names."""
    shown = ", ".join(sorted(names)[:SHOWN]) or "none"
    return f"{shown} and {len(names) - SHOWN} more" if len(names) > SHOWN else shown
