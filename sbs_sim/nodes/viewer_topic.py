"""A topic as clients of the Foxglove server see it."""

import threading
from collections import deque
from collections.abc import Callable
from typing import Any, NamedTuple

import foxglove
from geometry_msgs.msg import PoseStamped, TransformStamped
from nav_msgs.msg import Odometry, Path
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.serialization import deserialize_message, serialize_message

from sbs_sim.errors import RecordingError
from sbs_sim.nodes.message_types import definition_file
from sbs_sim.nodes.odometry_views import PathOf, pose_of, transform_of
from sbs_sim.recording import message_definition
from sbs_sim.recording.degrees import Degrees

Convert = Callable[[bytes], bytes | None]
Make = Callable[[Odometry], Any]


class View(NamedTuple):
    """A channel of what is made of a message: for who looks already, and for who comes late."""

    channel: foxglove.Channel
    convert: Convert
    convert_late: Convert


class ViewerTopic:
    """Channel of a topic, and channels of what is made of it while somebody looks: angles in degrees, pose, path.

    Parameters
    ----------
    context : foxglove.Context
        Of the server.
    topic : str
        Full name.
    kind : type
        Of the messages.
    qos : QoSProfile
        Of its publisher: what that keeps for late subscribers is kept for late clients too, the last message at least.
    """

    def __init__(self, context: Any, topic: str, kind: Any, qos: QoSProfile) -> None:
        self.topic, self.kind = topic, kind
        latched = qos.durability == DurabilityPolicy.TRANSIENT_LOCAL
        self._kept: deque[tuple[bytes, int]] = deque(maxlen=max(1, qos.depth) if latched else 1)
        self._lock = threading.Lock()  # converters keep what they have seen
        name, definition = type_and_definition(kind)
        self._channel = self._made(context, topic, name, definition)
        self._views: list[View] = []
        degrees = Degrees(name, definition)
        if degrees.angles:
            made = self._made(context, f"{topic}_deg", degrees.type_name, degrees.definition)
            self._views.append(View(made, degrees.convert, degrees.convert))
        if kind is Odometry:
            path = PathOf()
            self._add_view(context, "pose", PoseStamped, pose_of)
            self._add_view(context, "path", Path, path, path.late)

    def add_transform(self, context: Any) -> None:
        """Have a transform made of an odometry, where nobody publishes any."""
        if self.kind is Odometry:
            self._add_view(context, "tf", TransformStamped, transform_of)

    def _made(self, context: Any, topic: str, name: str, definition: str) -> foxglove.Channel:
        schema = foxglove.Schema(name=name, encoding="ros2msg", data=definition.encode())
        return foxglove.Channel(topic, schema=schema, message_encoding="cdr", context=context)

    def _add_view(self, context: Any, suffix: str, kind: Any, make: Make, make_late: Make | None = None) -> None:
        """A channel of what is made of an odometry; who comes late gets the same unless there is another for that."""
        channel = self._made(context, f"{self.topic}_{suffix}", *type_and_definition(kind))
        self._views.append(View(channel, _converter(make), _converter(make_late or make)))

    @property
    def channels(self) -> list[int]:
        """Numbers of its channels, that of the topic itself first."""
        return [self._channel.id(), *(view.channel.id() for view in self._views)]

    @property
    def is_watched(self) -> bool:
        """True while a client has subscribed to one of its channels."""
        return self._channel.has_sinks() or any(view.channel.has_sinks() for view in self._views)

    def send(self, data: bytes, time: int) -> None:
        """Send a serialised message of a simulation time [ns] to whom it may concern."""
        self._kept.append((data, time))
        self._channel.log(data, log_time=time)
        for view in self._views:
            if view.channel.has_sinks():
                self._send_view(view.channel, view.convert, data, time)

    def send_kept(self, number: int, client: int) -> None:
        """Send what is kept to a client that has subscribed to one of the channels."""
        for data, time in list(self._kept):
            if number == self._channel.id():
                self._channel.log(data, log_time=time, sink_id=client)
            for view in self._views:
                if number == view.channel.id():
                    self._send_view(view.channel, view.convert_late, data, time, client)

    def _send_view(
        self, channel: foxglove.Channel, convert: Convert, data: bytes, time: int, client: int | None = None
    ) -> None:
        try:
            with self._lock:
                made = convert(data)
        except RecordingError:  # a text that cannot be read, for example
            return
        if made is not None:
            channel.log(made, log_time=time, sink_id=client)


def _converter(make: Make) -> Convert:
    def convert(data: bytes) -> bytes | None:
        made = make(deserialize_message(data, Odometry))
        return None if made is None else bytes(serialize_message(made))

    return convert


def type_and_definition(kind: Any) -> tuple[str, str]:
    """Name and definition of a class of messages."""
    name = f"{kind.__module__.split('.')[0]}/msg/{kind.__name__}"
    return name, message_definition(name, definition_file)
