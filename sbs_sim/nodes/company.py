"""Who else is on the topics of a node: others that publish the same, and subscribers that come late."""

from collections import Counter
from collections.abc import Callable, Sequence

from rclpy.node import Node

from sbs_sim.nodes.host import Topic

ALSO = "what is heard is a mixture; a namespace of its own (-r __ns:=/left) or another ROS_DOMAIN_ID keeps apart"
AGAIN = 10  # looks after the first: a subscriber is told a second time, for what is best effort may have missed one


class Rivals:
    """Others that publish what only one simulator should: a second one, or a replay.

    Parameters
    ----------
    node : Node
        That publishes the topics.
    topics : sequence of str
        Full names.
    """

    def __init__(self, node: Node, topics: Sequence[str]) -> None:
        self._node, self._topics = node, topics

    def look(self) -> str:
        """Who publishes which of the topics too, in one line; empty if nobody does."""
        shared: dict[str, list[str]] = {}
        for topic in self._topics:
            if self._node.count_publishers(topic) > 1:
                for name in self._others(topic):
                    shared.setdefault(name, []).append(topic)
        if not shared:
            return ""
        told = "; ".join(f"{name} publishes {', '.join(topics)} too" for name, topics in sorted(shared.items()))
        return f"{told}: {ALSO}"

    def _others(self, topic: str) -> Counter[str]:
        """Full names of the nodes that publish a topic, without this one: another may be called the same."""
        infos = self._node.get_publishers_info_by_topic(topic)
        names = Counter(f"{info.node_namespace.rstrip('/')}/{info.node_name}" for info in infos)
        names.subtract([self._node.get_fully_qualified_name()])
        return +names


class Latecomers:
    """Publishes the present once more when somebody begins to listen to a flight that stands still.

    DDS brings nobody what was published before he came, and a paused flight publishes no state. Those who listen
    already get the same message, with the same stamp, once more. Nothing of it is recorded again.

    Parameters
    ----------
    topics : sequence of (Topic, callable)
        Publishers, and what gives the bytes that were published last.
    """

    def __init__(self, topics: Sequence[tuple[Topic, Callable[[], bytes]]]) -> None:
        self._topics = topics
        self._known: list[int] = []  # how many listened at the last look
        self._looks = [0] * len(topics)  # that are left until all who came have been told for good

    def look(self, paused: bool) -> None:
        """Serve who has come since the last look; to be called before whatever is published, by the same thread."""
        listening = [topic.subscribers for topic, _ in self._topics]
        if paused and self._known:
            for i, (topic, last) in enumerate(self._topics):
                if listening[i] > self._known[i]:
                    self._looks[i] = AGAIN + 1
                if self._looks[i] in (AGAIN + 1, 1):
                    topic.publish_again(last())
                self._looks[i] = max(self._looks[i] - 1, 0)
        self._known = listening
