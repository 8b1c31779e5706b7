"""Node `foxglove`: serves a flight to Foxglove, Lichtblick and other clients of their WebSocket protocol.

What the simulator publishes every tick goes to clients from the thread that publishes it, in the bytes that ROS gets.
All other topics, of this process and of others, are subscribed while a client wants them. See docs/howto/foxglove.md.
"""

import logging
from collections.abc import Sequence
from typing import Any

import foxglove
from foxglove.websocket import Capability
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from sbs_sim.errors import SbsError
from sbs_sim.nodes.component import Component
from sbs_sim.nodes.foxglove_clients import FoxgloveClients
from sbs_sim.nodes.message_types import installed_class
from sbs_sim.nodes.qos import EVENT_QOS
from sbs_sim.nodes.viewer_topic import ViewerTopic

HOST = "127.0.0.1"
TRANSFORMS = "/tf"
OWN_TO_ROS = ("/rosout", "/parameter_events")
DISCOVERY_PERIOD = 1.0  # s of wall time between looks for topics of other processes
LISTEN_QOS = QoSProfile(depth=100, reliability=ReliabilityPolicy.BEST_EFFORT)  # which is given to everybody


class FoxgloveServer(Component):
    """See the module.

    Parameters
    ----------
    port : int
        On this machine alone; 0 takes a free one.
    control : bool
        Whether clients may publish what the nodes of the process subscribe, and call their services.

    Raises
    ------
    SbsError
        Nothing can be served there.
    """

    def __init__(self, port: int, control: bool) -> None:
        super().__init__("foxglove")
        self._shown = foxglove.Context()
        self._topics: dict[str, ViewerTopic] = {}
        self._by_channel: dict[int, ViewerTopic] = {}
        self._heard: dict[str, tuple[Any, QoSProfile]] = {}  # topics that are subscribed while somebody looks
        self._subscriptions_of: dict[str, Any] = {}
        self._time = 0  # ns of simulation time
        self._visitors = FoxgloveClients(self) if control else None
        self._changed = self.create_guard_condition(self._follow_clients)
        self._server = self._start(port, control)
        shown = "clients may publish and call services" if control else "clients may look"
        self.get_logger().info(f"Foxglove: ws://{HOST}:{self._server.port}, {shown}")

    def _start(self, port: int, control: bool) -> Any:
        for name in ("foxglove", "foxglove_py", "tungstenite"):  # whatever a client sends must not fill the terminal
            logging.getLogger(name).setLevel(logging.CRITICAL)
        may = [Capability.Time, *([Capability.ClientPublish, Capability.Services] if control else [])]
        try:
            return foxglove.start_server(
                name="sbs_sim",
                host=HOST,
                port=port,
                capabilities=may,
                server_listener=self,
                supported_encodings=["cdr"],
                context=self._shown,
            )
        except RuntimeError as error:
            raise SbsError(f"parameter foxglove_port = {port}: cannot serve on {HOST}:{port}: {error}") from None

    # ----------------------------------------------------------------------------------------- what the nodes publish

    def topic(self, name: str, kind: Any, qos: QoSProfile) -> ViewerTopic:
        """Channel of a topic that is sent by its publisher.

        Parameters
        ----------
        name : str
            Full name.
        kind : type
            Of the messages.
        qos : QoSProfile
        """
        made = self._topics[name] = ViewerTopic(self._shown, name, kind, qos)
        self._by_channel |= dict.fromkeys(made.channels, made)
        return made

    def set_time(self, time: int) -> None:
        """Say what the simulation time is [ns]."""
        self._time = time
        self._server.broadcast_time(time)

    def serve(self, nodes: Sequence[Node]) -> None:
        """Serve all else that nodes of this process publish and subscribe, and their services if clients may call."""
        ends = [end for node in nodes for end in (*node.publishers, *node.subscriptions)]
        for end in ends:
            if end.topic_name not in (*OWN_TO_ROS, *self._topics):
                self._heard[end.topic_name] = end.msg_type, end.qos_profile
                self.topic(end.topic_name, end.msg_type, end.qos_profile)
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(DISCOVERY_PERIOD, self._discover, clock=steady)
        if TRANSFORMS not in self._topics:
            for topic in self._topics.values():
                topic.add_transform(self._shown)
                self._by_channel |= dict.fromkeys(topic.channels, topic)
        if self._visitors is not None:
            taken = {end.topic_name: end.msg_type for node in nodes for end in node.subscriptions}
            self._server.add_services(self._visitors.allow(nodes, taken))

    def _discover(self) -> None:
        """Serve what other processes publish, such as the frames of ROS tools and the targets of a pilot.

        Clients are followed again, too: the server may tell of a subscription before its channel has it.
        """
        self._follow_clients()
        for name, kinds in self.get_topic_names_and_types():
            if name in (*OWN_TO_ROS, *self._topics) or not (found := self.get_publishers_info_by_topic(name)):
                continue
            if (kind := installed_class(kinds[0])) is not None:
                latched = any(one.qos_profile.durability == DurabilityPolicy.TRANSIENT_LOCAL for one in found)
                self._heard[name] = kind, EVENT_QOS if latched else LISTEN_QOS
                self.topic(name, *self._heard[name])

    def _follow_clients(self) -> None:
        """Subscribe what clients want, in the thread of the node, and no longer."""
        for name, (kind, qos) in self._heard.items():
            topic, heard = self._topics[name], name in self._subscriptions_of
            if topic.is_watched and not heard:
                latched = qos.durability == DurabilityPolicy.TRANSIENT_LOCAL

                def send(data: bytes, to: ViewerTopic = topic) -> None:
                    to.send(data, self._time)

                made = self.create_subscription(kind, name, send, qos if latched else LISTEN_QOS, raw=True)
                self._subscriptions_of[name] = made
            elif heard and not topic.is_watched:
                self.destroy_subscription(self._subscriptions_of.pop(name))

    # ------------------------------------------------------------------ what clients do: called in the server's threads

    def on_subscribe(self, client: Any, channel: Any) -> None:
        """Send what was there before; see `foxglove.websocket.ServerListener`."""
        if (topic := self._by_channel.get(channel.id)) is not None:
            if topic.topic not in self._heard or topic.topic in self._subscriptions_of:
                topic.send_kept(channel.id, client.id)
            self._changed.trigger()

    def on_unsubscribe(self, client: Any, channel: Any) -> None:
        """See `foxglove.websocket.ServerListener`."""
        self._changed.trigger()

    def on_client_advertise(self, client: Any, channel: Any) -> None:
        """See `foxglove.websocket.ServerListener`."""
        if self._visitors is not None:
            self._visitors.advertise(client.id, channel)

    def on_client_unadvertise(self, client: Any, client_channel_id: int) -> None:
        """See `foxglove.websocket.ServerListener`."""
        if self._visitors is not None:
            self._visitors.unadvertise(client.id, client_channel_id)

    def on_message_data(self, client: Any, client_channel_id: int, data: bytes) -> None:
        """See `foxglove.websocket.ServerListener`."""
        if self._visitors is not None:
            self._told(self._visitors.publish(client.id, client_channel_id, data))

    def _told(self, refusal: str) -> None:
        """Show clients why something was refused."""
        if refusal:
            self._server.publish_status(refusal, foxglove.StatusLevel.Warning, "refused")

    def stop(self) -> None:
        """Let clients go."""
        if self._visitors is not None:
            self._visitors.stop()
        self._server.stop()
