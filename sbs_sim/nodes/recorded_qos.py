"""Quality of service of a topic as a log holds it, written and read."""

from typing import Any

from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from ruamel.yaml import YAML

from sbs_sim.nodes.qos import STATE_QOS
from sbs_sim.recording import qos_profiles

MAX_DEPTH = 10_000  # messages that a publisher keeps, whatever a log asks for


def recorded_qos(profiles: str) -> QoSProfile:
    """Quality of service that a topic was offered with; that of state topics where the log does not say."""
    try:
        profile = YAML(typ="safe", pure=True).load(profiles)[0]
        keep_all = profile["history"] in ("keep_all", 2)
        # `ros2 bag record` writes 0: DDS does not tell others how many messages a publisher keeps
        depth = int(profile["depth"]) or STATE_QOS.depth
        return QoSProfile(
            history=HistoryPolicy.KEEP_ALL if keep_all else HistoryPolicy.KEEP_LAST,
            depth=min(max(1, depth), MAX_DEPTH),
            reliability=_one_of(ReliabilityPolicy, profile["reliability"], ("reliable", 1)),
            durability=_one_of(DurabilityPolicy, profile["durability"], ("transient_local", 1)),
        )
    except Exception:  # whatever another writer put there
        return STATE_QOS


def _one_of(policy: Any, value: Any, first: tuple[str, int]) -> Any:
    """RELIABLE or BEST_EFFORT, TRANSIENT_LOCAL or VOLATILE: words since Jazzy, numbers before."""
    others = {ReliabilityPolicy: ReliabilityPolicy.BEST_EFFORT, DurabilityPolicy: DurabilityPolicy.VOLATILE}
    return getattr(policy, first[0].upper()) if value in first else others[policy]


def offered(qos: QoSProfile) -> str:
    """Quality of service as a log holds it."""
    return qos_profiles(
        "reliable" if qos.reliability == ReliabilityPolicy.RELIABLE else "best_effort",
        "transient_local" if qos.durability == DurabilityPolicy.TRANSIENT_LOCAL else "volatile",
        "keep_all" if qos.history == HistoryPolicy.KEEP_ALL else "keep_last",
        qos.depth,
    )
