"""What nodes publish, subscribe and serve, read from their sources: for `--help` and the reference."""

import ast
import importlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

# Which nodes a file of this folder makes publishers, subscriptions and services for.
PILOTS = ("hover_hold", "teleop", "joystick")
NODES = {
    "simulator": ("simulator",),
    "simulator_outputs": ("simulator",),
    "control_mixer": ("control_mixer",),
    "analysis": ("analysis",),
    "recorder_node": ("recorder",),
    "pilot_node": PILOTS,
    "hover_hold": ("hover_hold",),
    "excite": ("excite",),
    "frames": ("frames",),
    "joystick": ("joystick",),
    "ardupilot": ("ardupilot",),
}
ROLES = {
    "RecordedPublisher": "publisher",
    "create_publisher": "publisher",
    "create_subscription": "subscription",
    "create_service": "service",
    "ThreadedActionServer": "action",
}


@dataclass
class Endpoint:
    """A publisher, subscription, service or action in the source of a node."""

    role: str
    type: str
    name: str
    qos: QoSProfile | None
    nodes: tuple[str, ...]


def endpoints() -> Iterator[Endpoint]:
    """All that the nodes make under a fixed name."""
    for file, nodes in NODES.items():
        module = importlib.import_module(f"sbs_sim.nodes.{file}")
        tree = ast.parse(Path(str(module.__file__)).read_text(encoding="utf-8"))
        for call in ast.walk(tree):
            if not isinstance(call, ast.Call):
                continue
            called = call.func.attr if isinstance(call.func, ast.Attribute) else getattr(call.func, "id", "")
            names = [item.value for item in call.args if isinstance(item, ast.Constant) and isinstance(item.value, str)]
            if called not in ROLES or not names:
                continue
            values = [getattr(module, item.id, None) for item in call.args if isinstance(item, ast.Name)]
            kind = next(value for value in values if isinstance(value, type))
            qos = next((value for value in values if isinstance(value, QoSProfile)), None)
            yield Endpoint(ROLES[called], f"{kind.__module__.split('.')[0]}/{kind.__name__}", names[0], qos, nodes)


def quality(qos: QoSProfile) -> str:
    """A QoS profile in words."""
    reliable = "reliable" if qos.reliability == ReliabilityPolicy.RELIABLE else "best effort"
    latched = ", latched (transient local)" if qos.durability == DurabilityPolicy.TRANSIENT_LOCAL else ""
    return f"{reliable}, keep last {qos.depth}{latched}"
