"""Other publishers of topics that only one node should publish."""

from collections import Counter
from collections.abc import Sequence

from rclpy.node import Node

REMEDY = "subscribers get a mixture; use a namespace (-r __ns:=/left) or another ROS_DOMAIN_ID"


class OtherPublishers:
    """Finds other publishers of the simulator's topics: a second simulator, or a replay.

    Parameters
    ----------
    node : Node
        That publishes the topics.
    topics : sequence of str
        Full names.
    """

    def __init__(self, node: Node, topics: Sequence[str]) -> None:
        self._node, self._topics = node, topics

    def describe(self) -> str:
        """Other publishers and their topics, in one line; empty if there are none."""
        shared: dict[str, list[str]] = {}
        for topic in self._topics:
            if self._node.count_publishers(topic) > 1:
                for name in self._others(topic):
                    shared.setdefault(name, []).append(topic)
        if not shared:
            return ""
        listed = "; ".join(f"{name} publishes {', '.join(topics)} too" for name, topics in sorted(shared.items()))
        return f"{listed}: {REMEDY}"

    def _others(self, topic: str) -> Counter[str]:
        """Full names of the other nodes that publish a topic; one of them may have the name of this node."""
        infos = self._node.get_publishers_info_by_topic(topic)
        names = Counter(f"{info.node_namespace.rstrip('/')}/{info.node_name}" for info in infos)
        names.subtract([self._node.get_fully_qualified_name()])
        return +names
