"""Publisher whose messages are also recorded."""

from typing import Any, Protocol

from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.serialization import serialize_message


class MessageLog(Protocol):
    """Where messages are recorded; see `sbs_sim.nodes.recorder_node.RecorderNode`."""

    def channel(self, topic: str, kind: Any, qos: QoSProfile, role: str) -> int:
        """Channel for the messages of a topic, by its full name and by its name in the flight."""

    def write(self, channel: int, time: float, data: bytes, wait: bool = False, essential: bool = False) -> None:
        """Record a serialised message of a simulation time [s]."""


class Viewer(Protocol):
    """A topic that viewers look at; see `sbs_sim.nodes.viewer_topic.ViewerTopic`."""

    def send(self, data: bytes, time: int) -> None:
        """Send a serialised message of a simulation time [ns]."""


class Viewers(Protocol):
    """Who shows topics; see `sbs_sim.nodes.foxglove_server.FoxgloveServer`."""

    def topic(self, name: str, kind: Any, qos: QoSProfile) -> Viewer:
        """A topic of a full name, for its publisher to send."""

    def set_time(self, time: int) -> None:
        """Take the simulation time [ns]."""


class RecordedPublisher:
    """A publisher that also writes what it publishes into the log: messages are serialised once, for all.

    Parameters
    ----------
    node : Node
    kind : type
        Of the messages.
    name : str
    qos : QoSProfile
    log : MessageLog, optional
    viewers : Viewers, optional
    """

    def __init__(
        self,
        node: Node,
        kind: Any,
        name: str,
        qos: QoSProfile,
        log: MessageLog | None = None,
        viewers: Viewers | None = None,
    ) -> None:
        self._publisher = node.create_publisher(kind, name, qos)
        self._log = log
        self._channel = log.channel(self._publisher.topic_name, kind, qos, name.lstrip("/")) if log else 0
        self._viewer = viewers.topic(self._publisher.topic_name, kind, qos) if viewers else None

    def publish(self, message: Any, time: float, wait: bool = False, essential: bool = False) -> None:
        """Publish a message of a simulation time [s]; for `wait` and `essential` see `LogWriter.write`."""
        self.publish_bytes(serialize_message(message), time, wait, essential)

    def publish_bytes(self, data: bytes, time: float, wait: bool = False, essential: bool = False) -> None:
        """Publish a message that is serialised."""
        self._publisher.publish(data)
        if self._viewer is not None:
            self._viewer.send(data, round(time * 1e9))
        self.record_bytes(data, time, wait, essential)

    def publish_again(self, data: bytes) -> None:
        """Publish a serialised message that is in the log already."""
        self._publisher.publish(data)

    @property
    def name(self) -> str:
        """Full name of the topic."""
        return str(self._publisher.topic_name)

    @property
    def subscribers(self) -> int:
        """How many listen."""
        return int(self._publisher.get_subscription_count())

    def record(self, message: Any, time: float, wait: bool = False, essential: bool = False) -> None:
        """Write a message into the log alone."""
        self.record_bytes(serialize_message(message), time, wait, essential)

    def record_bytes(self, data: bytes, time: float, wait: bool = False, essential: bool = False) -> None:
        """Write a serialised message into the log alone."""
        if self._log is not None:
            self._log.write(self._channel, time, data, wait, essential)
