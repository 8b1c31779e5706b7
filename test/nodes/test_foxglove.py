"""The Foxglove server of a real simulator, with a client that speaks the protocol from its description."""

import contextlib
import json
import math
import struct
import sys
import time

import pytest
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

pytest.importorskip("rclpy")

from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Odometry
from rclpy.serialization import deserialize_message, serialize_message
from ros_harness import DOMAINS, PATIENCE, controls_message, world
from std_srvs.srv import SetBool

from sbs_msgs.msg import BodyState, Controls, FlightEvent
from sbs_msgs.srv import Step
from sbs_sim.errors import SbsError
from sbs_sim.nodes.conversions import to_time
from sbs_sim.nodes.odometry_views import PathOf
from sbs_sim.nodes.simulator import PARAMETERS, foxglove_server

MESSAGE, TIME, RESPONSE = 1, 2, 3  # binary opcodes of the server
CLIENT_MESSAGE, CLIENT_CALL = 1, 2  # and of the client
BODY = struct.Struct("<II")


class Viewer:
    """A client: what the server has advertised, and the messages of its subscriptions."""

    def __init__(self, port):
        self._socket = connect(f"ws://127.0.0.1:{port}", subprotocols=["foxglove.sdk.v1"], close_timeout=0.1)
        self.info, self.channels, self.services = {}, {}, {}
        self.messages, self.answers, self.status = {}, {}, []
        self._topics, self._count = {}, 0
        self._wanted = {}  # subscriptions by what the server says to one that comes too early

    def close(self):
        self._socket.close()

    def send(self, data):
        self._socket.send(data if isinstance(data, bytes | str) else json.dumps(data))

    def take(self, timeout=0.05):
        """Take one thing that the server says; False if it says nothing."""
        try:
            data = self._socket.recv(timeout)
        except TimeoutError:
            return False
        if isinstance(data, bytes):
            self._take_binary(data)
            return True
        said = json.loads(data)
        if said["op"] == "serverInfo":
            self.info = said
        elif said["op"] == "advertise":
            self.channels |= {channel["topic"]: channel for channel in said["channels"]}
        elif said["op"] == "advertiseServices":
            self.services |= {service["name"]: service for service in said["services"]}
        elif said["op"] == "serviceCallFailure":
            self.answers[said["callId"]] = said["message"]
        elif said["op"] == "status" and (wanted := self._wanted.get(said["message"])) is not None:
            self.send(wanted)  # the server tells of a channel a moment before it can be subscribed
        elif said["op"] == "status":
            self.status.append(said["message"])
        return True

    def _take_binary(self, data):
        if data[0] == MESSAGE:
            number, stamp = struct.unpack_from("<IQ", data, 1)
            self.messages[self._topics[number]].append((stamp, data[13:]))
        elif data[0] == RESPONSE:
            _, call, length = struct.unpack_from("<III", data, 1)
            self.answers[call] = data[13 + length :]

    def until(self, condition, what):
        end = time.monotonic() + PATIENCE
        while not condition():
            assert time.monotonic() < end, f"waited in vain for {what}; {self.status}"
            self.take()

    def subscribe(self, *topics):
        for topic in topics:
            self.until(lambda topic=topic: topic in self.channels, topic)
            self._count += 1
            self._topics[self._count], self.messages[topic] = topic, []
            channel = self.channels[topic]["id"]
            wanted = {"op": "subscribe", "subscriptions": [{"id": self._count, "channelId": channel}]}
            self._wanted[f"Unknown channel ID: {channel}"] = wanted
            self.send(wanted)

    def next(self, topic, count=1):
        """Messages from now on: stamp [ns] and bytes."""
        before = len(self.messages[topic])
        self.until(lambda: len(self.messages[topic]) >= before + count, topic)
        return self.messages[topic][before:]

    def reader(self, topic):
        """Decoder of another program, by what the server says of the topic."""
        channel = self.channels[topic]
        assert (channel["encoding"], channel["schemaEncoding"]) == ("cdr", "ros2msg")
        store = get_typestore(Stores.EMPTY)
        store.register(get_types_from_msg(channel["schema"], channel["schemaName"]))
        return lambda data: store.deserialize_cdr(data, channel["schemaName"])

    def call(self, name, data, encoding=b"cdr"):
        """Answer to a request: bytes, or why it failed."""
        self._count += 1
        head = BODY.pack(self.services[name]["id"], self._count) + struct.pack("<I", len(encoding)) + encoding
        self.send(bytes([CLIENT_CALL]) + head + data)
        self.until(lambda: self._count in self.answers, f"an answer of {name}")
        return self.answers[self._count]

    def advertise(self, topic, schema, encoding="cdr"):
        self._count += 1
        channel = {"id": self._count, "topic": topic, "encoding": encoding, "schemaName": schema}
        self.send({"op": "advertise", "channels": [channel]})
        return self._count

    def publish(self, number, data):
        self.send(bytes([CLIENT_MESSAGE]) + struct.pack("<I", number) + data)


def port_of(process):
    """Port of its server, which it prints."""
    end = time.monotonic() + PATIENCE
    while "ws://127.0.0.1:" not in process.output:
        assert process.running, process.output
        assert time.monotonic() < end, process.output
        time.sleep(0.05)
    return int(process.output.split("ws://127.0.0.1:")[1].split(",")[0])


@pytest.fixture(scope="module")
def flight(tmp_path_factory):
    folder = tmp_path_factory.mktemp("foxglove")
    with world(next(DOMAINS), folder) as made, world(next(DOMAINS), folder) as other:
        serve = {"foxglove": "true", "foxglove_port": 0, "foxglove_control": "true", "ground_altitude": -1e4}
        made.simulator = made.start("simulator", **serve, record="off")
        watch = {"foxglove": "true", "foxglove_port": 0, "components": "[simulator]", "record": "off"}
        watch |= {"ground_altitude": -1e4}  # nobody holds them, and at the ground they would pause
        made.watched = other.start("simulator", **watch)
        made.port = port_of(made.simulator)
        yield made


@pytest.fixture
def viewer(flight):
    with contextlib.closing(Viewer(flight.port)) as made:
        made.until(lambda: made.services and "/state" in made.channels, "what the server has")
        yield made


def test_topics_arrive_in_the_bytes_of_ros_with_their_definitions(flight, viewer):
    assert {"time", "clientPublish", "services"} == set(viewer.info["capabilities"])
    flight.client.watch("/state", BodyState)
    viewer.subscribe("/state", "/state_deg", "/events", "/diagnostics", "/odom_path", "/odom_tf", "/odom_pose")
    got = dict(viewer.next("/state", 5))
    seen = flight.client.next("/state", lambda message: stamp_of(message) > max(got))
    viewer.until(lambda: stamp_of(seen) in dict(viewer.messages["/state_deg"]), "the same message")
    data = dict(viewer.messages["/state"])[stamp_of(seen)]
    assert deserialize_message(data, BodyState) == seen
    read = viewer.reader("/state")(data)
    assert read.position.z == seen.position.z
    turned = viewer.reader("/state_deg")(dict(viewer.messages["/state_deg"])[stamp_of(seen)])
    assert turned.angular_velocity_deg.x == pytest.approx(math.degrees(seen.angular_velocity.x), rel=1e-15)
    assert turned.attitude.w == seen.attitude.w
    start = viewer.reader("/events")(viewer.messages["/events"][0][1])
    assert start.kind == FlightEvent.START  # it was published before this client came
    viewer.until(lambda: viewer.messages["/odom_path"] and viewer.messages["/diagnostics"], "slow topics")
    pose, moved = (viewer.reader(name)(viewer.next(name)[0][1]) for name in ("/odom_pose", "/odom_tf"))
    assert pose.header.frame_id == moved.header.frame_id == "odom"
    assert moved.child_frame_id == "base_link"
    path = viewer.reader("/odom_path")(viewer.messages["/odom_path"][-1][1])
    assert {one.header.frame_id for one in path.poses} == {"odom"}  # with another one viewers show nothing of it
    assert path.poses[-1].pose.position.z == pytest.approx(pose.pose.position.z, abs=0.1)


def test_who_comes_late_gets_the_path_between_two_poses_of_it():
    def odometry(seconds):
        message = Odometry()
        message.header.stamp = to_time(seconds)
        message.pose.pose.position.x = seconds
        return message

    def way(path):
        return path and [pose.pose.position.x for pose in path.poses]

    path = PathOf()
    assert way(path.late(odometry(1.0))) == [1.0]
    assert way(path(odometry(1.0))) == [1.0]
    assert path(odometry(1.25)) is None
    assert way(path.late(odometry(1.25))) == [1.0, 1.25]
    assert way(path(odometry(1.5))) == [1.0, 1.5]
    assert way(path.late(odometry(0.0))) == way(path(odometry(0.0))) == [0.0]  # of another flight


def stamp_of(message):
    return message.header.stamp.sec * 10**9 + message.header.stamp.nanosec


def test_services_are_called_and_a_late_client_of_a_paused_flight_sees_it(viewer, flight):
    paused = viewer.call("/pause", serialize_message(SetBool.Request(data=True)))
    assert deserialize_message(paused, SetBool.Response).message == "paused"
    with contextlib.closing(Viewer(flight.port)) as late:
        shown = "/state", "/rotors_deg", "/odom_path"
        late.subscribe(*shown)
        late.until(lambda: all(late.messages[topic] for topic in shown), "the state of a paused flight")
        with contextlib.closing(Viewer(flight.port)) as later:  # no pose of the path is due since
            later.subscribe("/odom_path")
            later.until(lambda: later.messages["/odom_path"], "the path of a paused flight")
        before = late.messages["/state"][-1][0]
        stepped = viewer.call("/step", serialize_message(Step.Request(ticks=1)))
        assert deserialize_message(stepped, Step.Response).success
        late.until(lambda: late.messages["/state"][-1][0] > before, "the step")
    refused = deserialize_message(viewer.call("/step", serialize_message(Step.Request(ticks=0))), Step.Response)
    assert not refused.success
    viewer.call("/pause", serialize_message(SetBool.Request(data=False)))


def test_requests_and_responses_have_the_fields_of_their_service(viewer):
    for name, kind in (("/pause", SetBool), ("/step", Step)):
        for part in ("request", "response"):
            schema = viewer.services[name][part]
            made = get_types_from_msg(schema["schema"], f"x/msg/{schema['schemaName'].rpartition('/')[2]}")
            fields = next(iter(made.values()))[1]
            wanted = getattr(kind, part.capitalize()).get_fields_and_field_types()
            assert [field for field, _ in fields] == list(wanted)
    assert not any("parameters" in name for name in viewer.services)


def test_controls_fly_the_aircraft(flight, viewer):
    flight.client.watch("/controls", Controls)
    target = flight.client.node.create_publisher(PoseStamped, "/target", 10)
    viewer.subscribe("/controls_deg", "/target")  # which another process publishes
    number = viewer.advertise("/controls", "sbs_msgs/msg/Controls")
    sent = controls_message([0.2, 0.01, 0.0, 0.0])
    end = time.monotonic() + PATIENCE
    wanted = viewer.messages["/controls_deg"], viewer.messages["/target"], flight.client.messages["/controls"]
    while not all(wanted):
        assert time.monotonic() < end, (list(map(len, wanted)), viewer.status, flight.simulator.output)
        viewer.publish(number, serialize_message(sent))
        target.publish(PoseStamped())
        while viewer.take(0.0):
            pass
        flight.client.spin(0.02)
    assert flight.client.messages["/controls"][-1].collective == 0.2
    shown = viewer.reader("/controls_deg")(viewer.messages["/controls_deg"][-1][1])
    assert shown.collective_deg == pytest.approx(math.degrees(0.2), rel=1e-15)


def test_what_is_malformed_is_refused_and_the_flight_goes_on(flight, viewer):
    viewer.advertise("/initialpose", "geometry_msgs/PoseWithCovarianceStamped")  # as every 3D panel does
    wrong = [
        viewer.advertise("/state", "sbs_msgs/msg/BodyState"),
        viewer.advertise("/controls", "sbs_msgs/msg/Wind"),
        viewer.advertise("/controls", "sbs_msgs/msg/Controls", encoding="json"),
    ]
    number = viewer.advertise("/controls", "sbs_msgs/msg/Controls")
    for refused in wrong * 2:
        viewer.publish(refused, b"")
    whole = serialize_message(controls_message([0.2, 0.0, 0.0, 0.0]))
    for data in (b"", whole[:-9], whole + bytes(8), b"\0\7\0\0" + whole[4:], b"\0\1\0\0" + b"\xff" * 60):
        viewer.publish(number, data)
    viewer.publish(number + 99, whole)
    for data in ("{", '{"op": "subscribe"}', "[]", b"\1", b"\2" + bytes(3), b"\xee"):
        viewer.send(data)
    viewer.until(lambda: len(viewer.status) >= 12, "what is refused")
    said = "\n".join(viewer.status)
    assert said.count("topic '/state': allowed are ") == 1
    assert "initialpose" not in said + flight.simulator.output
    assert "allowed is sbs_msgs/msg/Controls in cdr" in said
    assert "does not agree with the definition of sbs_msgs/Controls" in said
    assert viewer.call("/pause", b"{}", b"json") == "Unsupported encoding"
    for data in (b"", b"\0\1\0\0", b"\0\1\0\0\1" + bytes(40)):
        assert "std_srvs/SetBool_Request" in viewer.call("/pause", data)
    viewer.subscribe("/status")
    viewer.next("/status")
    assert flight.simulator.running
    assert "Traceback" not in flight.simulator.output


def test_clients_only_look_unless_they_are_allowed_to_fly(flight):
    busy = flight.start("simulator", foxglove="true", foxglove_port=flight.port, record="off")
    wrong = flight.start("simulator", foxglove="true", foxglove_port=70000, record="off")
    with contextlib.closing(Viewer(port_of(flight.watched))) as viewer:
        viewer.subscribe("/state")
        viewer.advertise("/swashplate", "sbs_msgs/msg/SwashplateArray")
        viewer.send(bytes([CLIENT_CALL]) + BODY.pack(1, 1) + struct.pack("<I", 3) + b"cdr")
        viewer.until(lambda: len(viewer.status) + len(viewer.answers) >= 2, "refusals")
        assert viewer.info["capabilities"] == ["time"]
        assert not viewer.services
        viewer.next("/state")
        flight.watched.interrupt()
        with pytest.raises(ConnectionClosed):
            viewer.until(lambda: False, "the end")
    assert busy.wait() == wrong.wait() == 1
    assert f"parameter foxglove_port = {flight.port}: cannot serve on 127.0.0.1:{flight.port}" in busy.output
    assert "parameter foxglove_port = 70000: allowed are 0 to 65535" in wrong.output


def test_without_the_package_the_parameter_says_what_is_missing(monkeypatch):
    values = {name: parameter.default for name, parameter in PARAMETERS.items()}
    assert foxglove_server(values) is None
    monkeypatch.setitem(sys.modules, "foxglove", None)
    for name in ("foxglove_server", "foxglove_clients", "viewer_topic"):
        monkeypatch.delitem(sys.modules, f"sbs_sim.nodes.{name}", raising=False)
    with pytest.raises(SbsError, match="foxglove = true: needs the package foxglove-sdk: pip install foxglove-sdk"):
        foxglove_server(values | {"foxglove": True})
