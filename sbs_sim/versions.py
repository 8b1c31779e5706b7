"""What decides the bits of a result, beside the aircraft and the commands."""

import importlib.metadata
import platform

import llvmlite.binding

from sbs_sim.model.kernel import source_digest


def versions() -> dict[str, str]:
    """Versions of everything that decides the bits of a result."""
    packages = ("sbs_sim", "numpy", "numba", "llvmlite")
    found = {name: importlib.metadata.version(name) for name in packages}
    features = sorted(name for name, there in llvmlite.binding.get_host_cpu_features().items() if there)
    return {
        **found,
        "python": platform.python_version(),
        "machine": f"{platform.system()} {platform.machine()}",
        "libc": " ".join(platform.libc_ver()),
        "cpu": llvmlite.binding.get_host_cpu_name(),
        "cpu_features": ",".join(features),
        "model_sources": source_digest(),
    }
