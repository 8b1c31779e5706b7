"""What clients of the Foxglove server send: messages and calls, both checked before ROS gets them.

They go the way of all messages and calls, through DDS to the node that they are for, which checks their values.
"""

import threading
from collections.abc import Mapping, Sequence
from typing import Any

import foxglove
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.serialization import deserialize_message, serialize_message

from sbs_sim import checks
from sbs_sim.errors import RecordingError, SbsError
from sbs_sim.nodes.message_types import definition_file
from sbs_sim.nodes.qos import SERVICE_QOS
from sbs_sim.nodes.rejections import Rejections
from sbs_sim.nodes.viewer_topic import type_and_definition
from sbs_sim.recording import service_definitions
from sbs_sim.recording.cdr import Fit
from sbs_sim.recording.definitions import parse, short_name

PUBLISH_QOS = QoSProfile(depth=10)
OWN_TO_ROS = ("rcl_interfaces", "type_description_interfaces")  # packages with services that every node has
ANSWER_TIMEOUT = 120.0  # s
POLL_PERIOD = 0.2  # s between looks whether the process ends
MAX_PUBLICATIONS = 100  # of all clients together


class FoxgloveClients:
    """Publishes for clients, and calls for them.

    Parameters
    ----------
    node : Node
        In whose name.
    """

    def __init__(self, node: Node) -> None:
        self._node = node
        self._types: dict[str, Any] = {}  # of the topics that may be published
        self._publications: dict[tuple[int, int], tuple[Any, Fit]] = {}
        self._refusals: dict[tuple[int, int], SbsError] = {}  # of channels, until a message comes on them
        self._calls: dict[str, Any] = {}
        self._refused = Rejections(node, "message of a Foxglove client")
        self._end = threading.Event()

    def allow(self, nodes: Sequence[Node], topics: Mapping[str, Any]) -> list[foxglove.Service]:
        """Let clients publish topics of types, and call the services of nodes, which are returned."""
        self._types = {name: kind for name, kind in topics.items() if name not in ("/parameter_events", "/clock")}
        services = [service for node in nodes for service in node.services]
        found = {node_service.srv_name: node_service.srv_type for node_service in services}
        return [
            self._service(self._node.resolve_service_name(name), kind)
            for name, kind in found.items()
            if kind.__module__.split(".")[0] not in OWN_TO_ROS
        ]

    def _service(self, name: str, kind: Any) -> foxglove.Service:
        type_name = f"{kind.__module__.split('.')[0]}/srv/{kind.__name__}"
        texts = service_definitions(type_name, definition_file)
        schemas = [
            foxglove.MessageSchema(
                encoding="cdr",
                schema=foxglove.Schema(name=f"{type_name}_{part}", encoding="ros2msg", data=text.encode()),
            )
            for part, text in zip(("Request", "Response"), texts, strict=True)
        ]
        request = f"{type_name.replace('/srv/', '/')}_Request"
        fit = Fit(parse(request, texts[0]), request)
        client = self._node.create_client(kind, name, qos_profile=SERVICE_QOS)

        def answer(call: foxglove.ServiceRequest) -> bytes:
            fit.check(call.payload)
            return self._answer(client, name, deserialize_message(call.payload, kind.Request))

        schema = foxglove.ServiceSchema(type_name, request=schemas[0], response=schemas[1])
        return foxglove.Service(name, schema=schema, handler=answer)

    def _answer(self, client: Any, name: str, request: Any) -> bytes:
        """Response of a service; each call waits in a thread of its own."""
        answered = threading.Event()
        future = client.call_async(request)
        future.add_done_callback(lambda _: answered.set())
        for _ in range(round(ANSWER_TIMEOUT / POLL_PERIOD)):
            if answered.wait(POLL_PERIOD):
                return bytes(serialize_message(future.result()))
            if self._end.is_set():
                break
        client.remove_pending_request(future)
        raise SbsError(f"no answer of {name}")

    def advertise(self, client: int, channel: Any) -> None:
        """Prepare what a client wants to publish.

        Why not is told with its first message: 3D panels advertise goals and points that nobody may ever send.
        """
        try:
            wanted = self._types.get(channel.topic)
            if wanted is None:
                allowed = ", ".join(sorted(self._types))
                raise SbsError(f"topic {checks.shown(channel.topic)}: allowed are {allowed}")
            name, definition = type_and_definition(wanted)
            if channel.encoding != "cdr" or short_name(channel.schema_name) != short_name(name):
                given = f"{channel.schema_name} in {channel.encoding}"
                raise SbsError(f"topic {channel.topic} of {checks.shown(given)}: allowed is {name} in cdr")
            if len(self._publications) >= MAX_PUBLICATIONS:
                raise SbsError(f"topic {channel.topic}: {MAX_PUBLICATIONS} are published already")
            publisher = self._node.create_publisher(wanted, channel.topic, PUBLISH_QOS)
            fit = Fit(parse(name, definition), short_name(name))
            self._publications[client, channel.id] = publisher, fit
        except SbsError as error:
            if sum(owner == client for owner, _ in self._refusals) < MAX_PUBLICATIONS:
                self._refusals[client, channel.id] = error

    def unadvertise(self, client: int, channel: int) -> None:
        """A client has left, or publishes this no longer."""
        self._refusals.pop((client, channel), None)
        if (publication := self._publications.pop((client, channel), None)) is not None:
            self._node.destroy_publisher(publication[0])

    def publish(self, client: int, channel: int, data: bytes) -> str:
        """Publish a message of a client; why not, or nothing."""
        if (publication := self._publications.get((client, channel))) is None:
            refused = self._refusals.pop((client, channel), None)
            return "" if refused is None else self._refusal(refused)
        publisher, fit = publication
        try:
            fit.check(data)
            deserialize_message(data, publisher.msg_type)
        except RecordingError as error:
            return self._refusal(error)
        except Exception as error:  # whatever rclpy finds in it
            return self._refusal(SbsError(f"topic {publisher.topic_name}: {error!r}"))
        publisher.publish(data)
        return ""

    def _refusal(self, error: Exception) -> str:
        self._refused.add(error)
        return str(error)

    def stop(self) -> None:
        """Calls that wait get an error."""
        self._end.set()
