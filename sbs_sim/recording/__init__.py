"""Recordings of flights: MCAP files that need no ROS to be written, read or recovered.

>>> from sbs_sim.recording import read
>>> log = read("flight.mcap")
>>> height = -log["state"]["position.z"]
"""

import importlib
from typing import TYPE_CHECKING, Any

from sbs_sim.errors import RecordingError

if TYPE_CHECKING:
    from sbs_sim.recording.definitions import message_definition, qos_profiles, service_definitions, type_hash
    from sbs_sim.recording.log import Log, Topic, read
    from sbs_sim.recording.log_writer import LogWriter
    from sbs_sim.recording.recovery import Recovery, recover

_HOME = {
    "Log": "log",
    "LogWriter": "log_writer",
    "Recovery": "recovery",
    "Topic": "log",
    "message_definition": "definitions",
    "qos_profiles": "definitions",
    "read": "log",
    "recover": "recovery",
    "service_definitions": "definitions",
    "type_hash": "definitions",
}
__all__ = [
    "Log",
    "LogWriter",
    "Recovery",
    "Topic",
    "message_definition",
    "qos_profiles",
    "read",
    "recover",
    "service_definitions",
    "type_hash",
]


def __getattr__(name: str) -> Any:
    """Import what is used when it is used: a writer needs no numpy, and a missing package is named with its remedy."""
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    try:
        return getattr(importlib.import_module(f"{__name__}.{_HOME[name]}"), name)
    except ModuleNotFoundError as error:
        package = (error.name or "").split(".")[0]
        if package not in ("mcap", "mcap_ros2", "zstandard"):
            raise
        raise RecordingError(
            f"the Python package {package} is missing: python3 -m pip install mcap mcap-ros2-support"
        ) from None
