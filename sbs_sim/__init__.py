"""Flight dynamics of a ducted side-by-side helicopter: blade-element model, trim, simulation.

Works without ROS; the ROS 2 nodes are in `sbs_sim.nodes`.

>>> from sbs_sim import Aircraft, trim, simulate
>>> aircraft = Aircraft.load("sbs")
>>> hover = trim(aircraft)
>>> flight = simulate(aircraft, hover, hover.controls, duration=1.0)
"""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sbs_sim.aircraft import Aircraft
    from sbs_sim.analysis.batch import Batch, Case, simulate_batch
    from sbs_sim.analysis.linear_model import LinearModel
    from sbs_sim.analysis.linearize import linearize
    from sbs_sim.analysis.qualities import Qualities, qualities
    from sbs_sim.analysis.sweep import Sweep, sweep
    from sbs_sim.analysis.trim import trim
    from sbs_sim.flight.controller import Controller, Sensors
    from sbs_sim.flight.engine_failure import EngineFailure
    from sbs_sim.flight.simulate import simulate
    from sbs_sim.flight.simulation import Simulation
    from sbs_sim.flight.trim_point import TrimPoint

_HOME = {
    "Aircraft": "sbs_sim.aircraft",
    "Batch": "sbs_sim.analysis.batch",
    "Case": "sbs_sim.analysis.batch",
    "simulate_batch": "sbs_sim.analysis.batch",
    "Controller": "sbs_sim.flight.controller",
    "Sensors": "sbs_sim.flight.controller",
    "EngineFailure": "sbs_sim.flight.engine_failure",
    "LinearModel": "sbs_sim.analysis.linear_model",
    "linearize": "sbs_sim.analysis.linearize",
    "Qualities": "sbs_sim.analysis.qualities",
    "qualities": "sbs_sim.analysis.qualities",
    "Sweep": "sbs_sim.analysis.sweep",
    "sweep": "sbs_sim.analysis.sweep",
    "TrimPoint": "sbs_sim.flight.trim_point",
    "trim": "sbs_sim.analysis.trim",
    "Simulation": "sbs_sim.flight.simulation",
    "simulate": "sbs_sim.flight.simulate",
}
__all__ = [
    "Aircraft",
    "Batch",
    "Case",
    "Controller",
    "EngineFailure",
    "LinearModel",
    "Qualities",
    "Sensors",
    "Simulation",
    "Sweep",
    "TrimPoint",
    "linearize",
    "qualities",
    "simulate",
    "simulate_batch",
    "sweep",
    "trim",
]


def __getattr__(name: str) -> Any:
    """Import the public names when they are first used: the compiler behind them takes its time."""
    if name == "__version__":
        return _version()
    if name in _HOME:
        return getattr(importlib.import_module(_HOME[name]), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def _version() -> str:
    """Version of these sources: of package.xml beside them, which is that of a checkout, else of what was installed."""
    from importlib.metadata import version
    from pathlib import Path
    from xml.etree import ElementTree

    manifest = Path(__file__).resolve().parents[1] / "package.xml"
    found = ElementTree.parse(manifest).findtext("version") if manifest.is_file() else None
    return found or version("sbs_sim")
