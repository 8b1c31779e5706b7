"""Recordings: written with real messages, read by other people's readers, killed, cut and damaged."""

import importlib.util
import itertools
import math
import os
import random
import re
import resource
import struct
import subprocess
import sys
import textwrap
import threading
import time
import types
from pathlib import Path

import numpy as np
import pytest
import zstandard
from foreign_logs import merge
from hypothesis import given, settings
from hypothesis import strategies as st
from matplotlib.figure import Figure
from mcap.reader import make_reader
from mcap.records import Channel, Schema
from mcap.stream_reader import StreamReader
from mcap.writer import CompressionType, IndexType, Writer
from ruamel.yaml import YAML

from sbs_sim.errors import RecordingError
from sbs_sim.flight.simulation import Simulation
from sbs_sim.flight.trimmed_state import trimmed_state
from sbs_sim.recording import LogWriter, message_definition, qos_profiles, read, recover
from sbs_sim.recording.cdr import Fit, Layout, decode, decode_one_by_one
from sbs_sim.recording.checked_records import MAX_RECORD_SIZE
from sbs_sim.recording.definitions import SEQUENCE, Units, fields_of, parse, short_name
from sbs_sim.recording.log_writer import CHUNK_SIZE
from sbs_sim.recording.mcap_file import NewFile, metadata_checksum
from sbs_sim.recording.playback import Playback
from sbs_sim.recording.plot import _draw
from sbs_sim.recording.recorded_flight import flight_of
from sbs_sim.recording.scan import scan
from sbs_sim.recording.source import Source
from sbs_sim.recording.summary import read_summary

TOOL = Path(__file__).resolve().parents[2] / "tools" / "robustness" / "crash_recording.py"
NUMBER = "float64 value  # [m]\n"
TICKS = 250


def load_tool():
    """tools/robustness/crash_recording.py, which has the damages and what must hold after them."""
    spec = importlib.util.spec_from_file_location("crash_recording", TOOL)
    module = importlib.util.module_from_spec(spec)
    sys.modules["crash_recording"] = module
    spec.loader.exec_module(module)
    return module


crash = load_tool()


def number_message(value):
    return struct.pack("<4Bd", 0, 1, 0, 0, value)


def new_log(path, **options):
    return LogWriter(path, library="test 1", wall_start=1_700_000_000_123_456_789, **options)


def add_number(log, topic="/number", **options):
    return log.add_channel(topic, "test_msgs/msg/Number", NUMBER, qos_profiles(), **options)


def wait_until(condition):
    end = time.monotonic() + 30
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.01)


# -- real messages -----------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def ros():
    """What of ROS these tests use."""
    pytest.importorskip("rclpy")
    from ament_index_python.packages import get_package_share_directory
    from rclpy.serialization import deserialize_message, serialize_message
    from rosidl_parser.definition import NamespacedType  # noqa: F401

    def find_file(package, name):
        return Path(get_package_share_directory(package)) / name

    def kind(type_name):
        package, _, name = type_name.split("/")
        return getattr(importlib.import_module(f"{package}.msg"), name)

    return types.SimpleNamespace(
        serialize=serialize_message,
        deserialize=lambda data, type_name: deserialize_message(data, kind(type_name)),
        find_file=find_file,
        kind=kind,
        definition=lambda type_name: message_definition(type_name, find_file),
    )


TYPES = {
    "/state": "sbs_msgs/msg/BodyState",
    "/rotors": "sbs_msgs/msg/RotorStateArray",
    "/inflow": "sbs_msgs/msg/InflowArray",
    "/odom": "nav_msgs/msg/Odometry",
    "/clock": "rosgraph_msgs/msg/Clock",
    "/status": "sbs_msgs/msg/SimulationStatus",
    "/diagnostics": "diagnostic_msgs/msg/DiagnosticArray",
    "/never": "sbs_msgs/msg/Controls",
}


def flight_messages(ros, aircraft, hover):
    """Messages of a short flight: topic, time [ns], message."""
    from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
    from rosgraph_msgs.msg import Clock

    from sbs_msgs.msg import SimulationStatus
    from sbs_sim.nodes.conversions import StateMessages, to_time

    simulation = Simulation(aircraft, trimmed_state(aircraft, hover), hover.swashplate)
    messages = StateMessages(aircraft)
    for tick in range(TICKS):
        simulation.swashplate = hover.swashplate + 0.001 * math.sin(0.1 * tick)
        simulation.advance()
        messages.fill(simulation.snapshot())
        time_ns = round(simulation.time * 1e9)
        yield "/clock", time_ns, Clock(clock=to_time(simulation.time))
        for topic in ("/state", "/rotors", "/inflow", "/odom"):
            yield topic, time_ns, getattr(messages, topic[1:])
        fault = "" if tick < TICKS - 3 else "step 7: höher als plausibel"  # its length changes: no constant layout
        yield "/status", time_ns, SimulationStatus(steps=tick, sim_time=simulation.time, fault=fault)
        if tick % 50 == 0:
            values = [KeyValue(key=str(number), value="x" * number) for number in range(tick // 50)]
            yield "/diagnostics", time_ns, DiagnosticArray(status=[DiagnosticStatus(name="a", values=values)])


@pytest.fixture(scope="module")
def flight(ros, sbs, hover, tmp_path_factory):
    """A recording of a short flight and all that went into it: path, [(topic, time [ns], bytes)]."""
    path = tmp_path_factory.mktemp("flight") / "flight.mcap"
    attachments = {"sbs.yaml": b"mass: 1\n", "empty": b""}
    sent = []
    metadata = {"aircraft": {"name": "sbs", "städte": "ü"}}
    with new_log(path, metadata=metadata, attachments=attachments, ros_distro="rolling") as log:
        channels = {
            topic: log.add_channel(topic, name, ros.definition(name), qos_profiles()) for topic, name in TYPES.items()
        }
        for topic, time_ns, message in flight_messages(ros, sbs, hover):
            data = ros.serialize(message)
            assert log.write(channels[topic], time_ns, data)
            sent.append((topic, time_ns, data))
            if len(sent) % 400 == 0:
                time.sleep(0.25)  # several chunks
    assert (log.failed, log.dropped, log.written) == ("", 0, len(sent))
    return path, sent


def flattened(message, prefix=""):
    """Values of a ROS message by the names that a log gives them."""
    for name, kind in message.get_fields_and_field_types().items():
        value, full = getattr(message, name), prefix + name
        if hasattr(value, "get_fields_and_field_types"):
            yield from flattened(value, f"{full}.")
        elif kind.startswith("sequence") and "/" in kind:
            for index, item in enumerate(value):
                yield from flattened(item, f"{full}[{index}].")
        elif isinstance(value, bytes):  # what rclpy makes of the type byte
            yield full, value[0]
        else:
            yield full, value


# -- definitions -------------------------------------------------------------------------------------


def test_the_definition_of_a_type_holds_all_types_in_it_once(ros):
    text = ros.definition("sbs_msgs/msg/BodyState")
    first, *others = text.split("\n" + "=" * 80 + "\n")
    assert first == ros.find_file("sbs_msgs", "msg/BodyState.msg").read_text()
    names = [other.partition("\n")[0] for other in others]
    assert names == [
        "MSG: geometry_msgs/Point",
        "MSG: geometry_msgs/Quaternion",
        "MSG: geometry_msgs/Vector3",
        "MSG: sbs_msgs/ContactState",
        "MSG: std_msgs/Header",
        "MSG: builtin_interfaces/Time",
    ]
    assert others[0].partition("\n")[2] == ros.find_file("geometry_msgs", "msg/Point.msg").read_text()


@pytest.mark.parametrize("name", [*TYPES.values(), "sbs_msgs/msg/SwashplateArray"])
def test_definitions_are_read_as_ros_reads_them(ros, name):
    definitions = parse(name, ros.definition(name))
    for short, fields in definitions.items():
        package, kind = short.split("/")
        expected = ros.kind(f"{package}/msg/{kind}").get_fields_and_field_types()
        assert [field.name for field in fields] == list(expected)
        for field, said in zip(fields, expected.values(), strict=True):
            base = {"float64": "double", "float32": "float", "bool": "boolean", "byte": "octet"}.get(
                field.type, field.type
            )
            count = {None: base, SEQUENCE: f"sequence<{base}>"}.get(field.count, f"{base}[{field.count}]")
            assert said == count


def test_what_is_not_a_message_type_is_refused_in_one_line(ros, tmp_path):
    with pytest.raises(RecordingError, match=r"message type 'Controls': allowed is package/msg/Type"):
        ros.definition("Controls")
    with pytest.raises(RecordingError, match=r"no definition of message type sbs_msgs/Nothing: .*No such file"):
        ros.definition("sbs_msgs/msg/Nothing")
    with pytest.raises(RecordingError, match="no definition of message type no_msgs/Nothing: "):
        ros.definition("no_msgs/msg/Nothing")


def test_fields_and_units_of_a_definition():
    text = textwrap.dedent("""\
        # About it all [not a unit of what follows].

        uint8 ON=1  # [s]
        string NAME="# [kg]"
        # Several lines [m/s],
        # of which the first unit counts [ft/s].
        float64 speed
        int32 count 3   # [-]
        string<=5 text
        float32[<=4] some  # [N m], in [0, 1)
        other_msgs/Pair[2] pairs
        # An index as in c[36].
        Own[] own
        """)
    fields = fields_of(text, "a_msgs")
    assert [(field.name, field.type, field.count, field.units[:1]) for field in fields] == [
        ("speed", "float64", None, ("m/s",)),
        ("count", "int32", None, ("-",)),
        ("text", "string", None, ()),
        ("some", "float32", SEQUENCE, ("N m",)),
        ("pairs", "other_msgs/Pair", 2, ()),
        ("own", "a_msgs/Own", SEQUENCE, ()),
    ]


def test_units_come_from_the_field_or_from_the_field_that_holds_it(ros):
    def units(name):
        return Units(parse(name, ros.definition(name)), short_name(name))

    state, rotors = units(TYPES["/state"]), units(TYPES["/rotors"])
    assert [
        state[name] for name in ("position.x", "attitude.w", "velocity.z", "acceleration.y", "header.frame_id")
    ] == [
        "m",
        "-",
        "m/s",
        "m/s^2",
        "",
    ]
    assert (state["header.stamp.sec"], state["header.stamp.nanosec"]) == ("s", "ns")
    assert [rotors[f"rotors[1].{name}"] for name in ("flap", "lag_rate", "thrust", "hub.force.x", "hub.torque.z")] == [
        "rad",
        "rad/s",
        "N",
        "N",
        "N m",
    ]
    assert units(TYPES["/inflow"])["rotors[0].uniform"] == "-"
    assert units("sbs_msgs/msg/SwashplateArray")["rotors[0].collective"] == "rad"
    assert units(TYPES["/odom"])["pose.pose.position.x"] == ""


# -- other people's readers --------------------------------------------------------------------------


def test_rosbags_reads_every_message(flight, ros):
    highlevel = pytest.importorskip("rosbags.highlevel")
    path, sent = flight
    with highlevel.AnyReader([path]) as reader:
        assert {topic: info.msgtype for topic, info in reader.topics.items()} == TYPES
        qos = reader.topics["/state"].connections[0].ext.offered_qos_profiles
        assert [(item.reliability.name, item.durability.name, item.depth) for item in qos] == [
            ("RELIABLE", "VOLATILE", 10)
        ]
        found = [
            (connection.topic, time_ns, data, reader.deserialize(data, connection.msgtype))
            for connection, time_ns, data in reader.messages()
        ]
    # equal times come in any order
    assert sorted(item[:3] for item in found) == sorted(sent)
    for topic, _, data, message in found:
        for name, value in flattened(ros.deserialize(data, TYPES[topic])):
            other = eval(f"message.{name}", {"message": message})
            np.testing.assert_array_equal(other, value, err_msg=f"{topic} {name}")


def test_mcap_reads_every_message(flight, ros):
    from mcap_ros2.decoder import DecoderFactory

    path, sent = flight
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        found = list(reader.iter_decoded_messages())
        assert (reader.get_header().profile, reader.get_header().library) == ("ros2", "test 1")
        assert [(item.name, item.data) for item in reader.iter_attachments()] == [
            ("sbs.yaml", b"mass: 1\n"),
            ("empty", b""),
        ]
        statistics = reader.get_summary().statistics
    assert statistics.message_count == len(sent)
    assert (statistics.message_start_time, statistics.message_end_time) == (10_000_000, TICKS * 10_000_000)
    assert sorted((item.channel.topic, item.message.log_time, item.message.data) for item in found) == sorted(sent)
    for item in found:
        for name, value in flattened(ros.deserialize(item.message.data, item.schema.name)):
            other = eval(f"message.{name}", {"message": item.decoded_message})
            np.testing.assert_array_equal(other, value, err_msg=f"{item.channel.topic} {name}")


def test_the_package_that_reads_from_start_to_end_agrees_with_every_checksum(flight):
    path, sent = flight
    with path.open("rb") as file:
        records = list(StreamReader(file, validate_crcs=True).records)
    assert sum(type(record).__name__ == "Message" for record in records) == len(sent)


def test_rosbag2_finds_its_metadata(flight):
    path, sent = flight
    with path.open("rb") as file:
        records = {record.name: record.metadata for record in make_reader(file).iter_metadata()}
    bag = YAML(typ="safe").load(records["rosbag2"]["serialized_metadata"])
    keys = "version storage_identifier duration starting_time message_count topics_with_message_count"
    keys += " compression_format compression_mode relative_file_paths files custom_data ros_distro"
    assert list(bag) == keys.split()
    assert (bag["version"], bag["storage_identifier"], bag["ros_distro"]) == (9, "mcap", "rolling")
    assert bag["message_count"] == len(sent)
    assert bag["files"][0]["path"] == bag["relative_file_paths"][0] == path.name
    topics = {item["topic_metadata"]["name"]: item for item in bag["topics_with_message_count"]}
    assert {name: item["topic_metadata"]["type"] for name, item in topics.items()} == TYPES
    profile = topics["/state"]["topic_metadata"]["offered_qos_profiles"][0]
    assert profile["deadline"] == {"sec": 9223372036, "nsec": 854775807}
    assert topics["/state"]["message_count"] == TICKS
    assert topics["/never"]["message_count"] == 0


def test_what_the_summary_names_is_before_it(tmp_path):
    """A topic that came after the last message too; only topics with messages have a number of them."""
    path = tmp_path / "late.mcap"
    with new_log(path) as log:
        first = add_number(log, "/first")
        log.write(first, 0, number_message(1))
        wait_until(lambda: log.written == 1)
        add_number(log, "/late")
        log.add_channel("/other", "test_msgs/msg/Other", "int8 value", "", type_hash="RIHS01_00", role="other")
    with path.open("rb") as file:
        records = list(StreamReader(file, validate_crcs=True).records)
    names = [type(record).__name__ for record in records]
    data = records[: names.index("DataEnd")]
    schemas = [record.id for record in data if isinstance(record, Schema)]
    topics = [record.topic for record in data if isinstance(record, Channel)]
    assert (schemas, topics) == ([1, 2], ["/first", "/late", "/other"])
    with path.open("rb") as file:
        summary = make_reader(file).get_summary()
    assert {channel.topic for channel in summary.channels.values()} == set(topics)
    assert summary.statistics.channel_message_counts == {first: 1}
    assert (summary.statistics.channel_count, summary.statistics.schema_count) == (3, 2)
    other = next(channel for channel in summary.channels.values() if channel.topic == "/other")
    assert (other.metadata["topic_type_hash"], other.metadata["role"]) == ("RIHS01_00", "other")
    assert read(path).topics == ("/first", "/late", "/other")
    assert read(path).complete


def test_a_recovered_file_keeps_the_name_of_the_distribution(tmp_path, flight):
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(flight[0].read_bytes()[:-2000])
    recover(cut, tmp_path / "new.mcap")
    with (tmp_path / "new.mcap").open("rb") as file:
        records = {record.name: record.metadata for record in make_reader(file).iter_metadata()}
    assert YAML(typ="safe").load(records["rosbag2"]["serialized_metadata"])["ros_distro"] == "rolling"


# -- reading -----------------------------------------------------------------------------------------


def test_a_log_has_every_value(flight, ros):
    path, sent = flight
    log = read(path)
    assert (log.complete, log.reasons) == (True, ())
    assert log.topics == tuple(TYPES)
    for topic in TYPES:
        messages = [(time_ns, ros.deserialize(data, TYPES[topic])) for name, time_ns, data in sent if name == topic]
        assert log[topic].type == TYPES[topic]
        assert log[topic].time_ns.tolist() == [time_ns for time_ns, _ in messages]
        np.testing.assert_allclose(log[topic].time, [time_ns / 1e9 for time_ns, _ in messages])
        seen = set()
        for row, (_, message) in enumerate(messages):
            for name, value in flattened(message):
                np.testing.assert_array_equal(log[topic][name][row], value, err_msg=f"{topic} {name}")
                seen.add(name)
        assert seen == set(log[topic]) or not messages


def test_a_log_has_the_shapes_and_types_of_the_fields(flight):
    log = read(flight[0])
    assert log["rotors"]["rotors[0].flap"].shape == (TICKS, 3)
    assert log["odom"]["pose.covariance"].shape == (TICKS, 36)
    assert log["state"]["position.x"].dtype == np.float64
    assert log["status"]["steps"].dtype == np.uint64
    assert log["status"]["fault"].tolist() == [""] * (TICKS - 3) + ["step 7: höher als plausibel"] * 3
    assert list(log["state"])[:4] == ["header.stamp.sec", "header.stamp.nanosec", "header.frame_id", "position.x"]
    assert log["state"].units["position.x"] == "m"
    assert set(log["rotors"].units) == set(log["rotors"])
    # what was never sent has no values, but the fields that it must have
    assert log["never"]["collective"].shape == (0,)
    assert "/state" in log
    assert "state" in log
    assert "speed" not in log


def test_a_log_has_metadata_and_attachments(flight):
    log = read(flight[0])
    assert log.metadata["aircraft"] == {"name": "sbs", "städte": "ü"}
    assert log.metadata["recording"]["library"] == "test 1"
    assert log.metadata["recording"]["wall_start"] == "2023-11-14T22:13:20.123+00:00"
    assert log.wall_start_ns == 1_700_000_000_123_456_789
    assert log.metadata["recording_end"]["dropped"] == "0"
    assert log.attachments == {"sbs.yaml": b"mass: 1\n", "empty": b""}


def test_a_missing_topic_is_reported_with_those_that_there_are(flight):
    log = read(flight[0])
    with pytest.raises(KeyError, match=r"no topic 'speed'; there are /state, /rotors"):
        log["speed"]
    with pytest.raises(KeyError, match=r"topic /state has no field 'x'; there are header.stamp.sec, "):
        log["state"]["x"]
    assert repr(log["state"]) == "<topic /state: 250 messages of type sbs_msgs/msg/BodyState>"
    assert repr(log).startswith("<complete recording ")


@pytest.mark.parametrize("topic", [topic for topic in TYPES if topic != "/never"])
def test_both_ways_of_decoding_agree(flight, ros, topic):
    """Message by message with mcap_ros2, and all at once where the layout is constant."""
    name = TYPES[topic]
    text = ros.definition(name)
    messages = [data for other, _, data in flight[1] if other == topic]
    definitions, schema = parse(name, text), Schema(1, text.encode(), "ros2msg", name)
    slow = decode_one_by_one(schema, definitions, short_name(name), messages)
    fast = Layout(definitions, short_name(name), messages[0]).decode(messages)
    if topic in ("/status", "/diagnostics"):
        assert fast is None
        fast = decode(schema, definitions, short_name(name), messages)
    assert list(fast) == list(slow)
    for field, values in fast.items():
        assert values.dtype == slow[field].dtype, field
        np.testing.assert_array_equal(values, slow[field], err_msg=field)


MIXED = textwrap.dedent("""\
    bool flag
    float64 first
    uint8 small
    int16[3] fixed
    string text
    float64[] many
    bool[] flags
    Pair[] pairs
    Pair pair
    string[] texts
    uint8[] bytes
    int8 tiny
    uint64 last
    ================================================================================
    MSG: test_msgs/Pair
    int8 a
    float32 b
    """)
MIXED_TYPE = "test_msgs/msg/Mixed"


def mixed_values(chance, lengths):
    """A message with lists and texts of the given lengths."""
    text, many, flags, pairs, texts, data = lengths
    pair = {"a": chance.randrange(-128, 128), "b": float(np.float32(chance.random()))}
    return {
        "flag": chance.random() < 0.5,
        "first": chance.random(),
        "small": chance.randrange(256),
        "fixed": [chance.randrange(-9, 9) for _ in range(3)],
        "text": "".join(chance.choices("abc", k=text)),
        "many": [chance.random() for _ in range(many)],
        "flags": [chance.random() < 0.5 for _ in range(flags)],
        "pairs": [dict(pair) for _ in range(pairs)],
        "pair": pair,
        "texts": ["".join(chance.choices("xyz", k=number)) for number in range(texts)],
        "bytes": list(chance.randbytes(data)),
        "tiny": chance.randrange(-128, 128),
        "last": chance.randrange(2**64),
    }


@given(
    st.lists(st.integers(0, 4), min_size=6, max_size=6),
    st.lists(st.integers(0, 4), min_size=6, max_size=6),
    st.booleans(),
    st.integers(0, 2**32),
)
@settings(max_examples=150, deadline=None)
def test_messages_of_any_lengths_are_decoded_alike(lengths, others, constant, seed):
    from mcap_ros2._dynamic import serialize_dynamic

    chance = random.Random(seed)
    encode = serialize_dynamic(MIXED_TYPE, MIXED)[MIXED_TYPE]
    rows = [mixed_values(chance, lengths if constant or chance.random() < 0.5 else others) for _ in range(4)]
    messages = [encode(row) for row in rows]
    definitions, schema = parse(MIXED_TYPE, MIXED), Schema(1, MIXED.encode(), "ros2msg", MIXED_TYPE)
    columns = decode(schema, definitions, "test_msgs/Mixed", messages)
    slow = decode_one_by_one(schema, definitions, "test_msgs/Mixed", messages)
    assert list(columns) == list(slow)
    for row, values in enumerate(rows):
        for name in ("flag", "first", "small", "fixed", "text", "many", "flags", "texts", "bytes", "tiny", "last"):
            assert np.array_equal(columns[name][row], values[name]), name
            assert np.array_equal(slow[name][row], values[name]), name
        for number, pair in enumerate(values["pairs"]):
            assert columns[f"pairs[{number}].a"][row] == pair["a"]
            assert columns[f"pairs[{number}].b"][row] == np.float32(pair["b"])
    if constant:
        assert Layout(definitions, "test_msgs/Mixed", messages[0]).decode(messages) is not None


def test_the_layout_is_that_of_fast_dds(ros):
    """Alignment, lists without values and messages without fields, written by rclpy."""
    from diagnostic_msgs.msg import KeyValue
    from geometry_msgs.msg import Inertia, PolygonStamped
    from std_msgs.msg import Bool, ByteMultiArray, Empty, Float64MultiArray, MultiArrayDimension, MultiArrayLayout

    dimension = MultiArrayDimension(label="abc", size=2, stride=3)
    samples = [
        Bool(data=True),
        Empty(),
        KeyValue(key="a", value=""),
        Inertia(m=2.0, ixx=5.0),
        PolygonStamped(),
        Float64MultiArray(data=[1.0, 2.0, 3.0], layout=MultiArrayLayout(dim=[dimension, dimension], data_offset=7)),
        Float64MultiArray(),
        ByteMultiArray(data=[b"\x01", b"\xff"]),
    ]
    for sample in samples:
        name = f"{type(sample).__module__.split('.')[0]}/msg/{type(sample).__name__}"
        definitions = parse(name, ros.definition(name))
        messages = [ros.serialize(sample)] * 2
        columns = Layout(definitions, short_name(name), messages[0]).decode(messages)
        assert columns is not None
        expected = dict(flattened(sample))
        if name == "std_msgs/msg/ByteMultiArray":
            expected["data"] = [1, 255]
        expected.pop("structure_needs_at_least_one_member", None)
        for field, values in columns.items():
            np.testing.assert_array_equal(values[1], expected.get(field, []), err_msg=field)
        assert {field for field, value in expected.items() if np.size(value)} <= set(columns)


def test_the_other_byte_order_is_read_too():
    definitions = parse("test_msgs/msg/Number", NUMBER)
    message = struct.pack(">4Bd", 0, 0, 0, 0, 2.5)
    columns = Layout(definitions, "test_msgs/Number", message).decode([message])
    assert columns["value"].tolist() == [2.5]
    assert columns["value"].dtype == np.dtype(np.float64)
    assert Layout(definitions, "test_msgs/Number", message).decode([message, number_message(2.5)]) is None


def chain(count):
    """Definitions of that many types, each in the one before it."""
    parts = ["T0 first", *(f"MSG: test_msgs/T{i}\nT{i + 1} next" for i in range(count))]
    return f"\n{'=' * 80}\n".join(parts)


@pytest.mark.parametrize(
    ("data", "text", "complaint"),
    [
        (number_message(1.0) + bytes(8), NUMBER, "a message of 20 bytes does not agree with the definition"),
        (number_message(0.1), "float64[] values", "cannot hold 2576980378 values"),
        (number_message(1.0), "string a\nstring b", "cannot hold 1072693248 values"),
        (b"\0\1\0\0" + bytes(4), "string a\nstring b", "a message ends before its field b"),
        (number_message(1.0), "wstring text", "text: values of type wstring cannot be read"),
        (number_message(1.0), "Other text", "there is no definition of test_msgs/Other"),
        (number_message(1.0), "Strange itself", "message type test_msgs/Strange contains itself"),
        (number_message(1.0), chain(500), "message type test_msgs/Strange has more than 32 levels of types in it"),
        (b"\0\7\0\0" + bytes(8), NUMBER, "messages in plain CDR can be read, this one begins 00 07 00 00"),
        (b"", NUMBER, "this one begins $"),
    ],
)
def test_messages_that_are_not_what_they_should_be(tmp_path, data, text, complaint):
    path = tmp_path / "log.mcap"
    with new_log(path) as log:
        log.write(log.add_channel("/strange", "test_msgs/msg/Strange", text, ""), 0, data)
    topic = read(path)["strange"]
    with pytest.raises(RecordingError, match=f"^topic /strange: .*({complaint})"):
        topic["value"]


def test_pandas_is_asked_for_politely(flight, monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(RecordingError, match="to_pandas needs pandas: python3 -m pip install pandas"):
        read(flight[0])["state"].to_pandas()


def test_a_pandas_frame_has_a_column_for_every_index_of_a_list(flight, monkeypatch):
    """With a stand-in for pandas, which is no part of the environment."""
    stand_in = types.ModuleType("pandas")
    stand_in.Index = lambda values, name: (name, values)
    stand_in.DataFrame = lambda columns, index: (columns, index)
    monkeypatch.setitem(sys.modules, "pandas", stand_in)
    topic = read(flight[0])["rotors"]
    columns, (name, index) = topic.to_pandas()
    assert name == "time"
    np.testing.assert_array_equal(index, topic.time)
    np.testing.assert_array_equal(columns["rotors[0].flap[2]"], topic["rotors[0].flap"][:, 2])
    np.testing.assert_array_equal(columns["rotors[1].thrust"], topic["rotors[1].thrust"])
    assert all(values.shape == (TICKS,) for values in columns.values())


def foreign_log(path, messages=200, metadata=False, **options):
    """File of the package's own writer."""
    with path.open("wb") as file:
        writer = Writer(file, chunk_size=1000, **options)
        writer.start(profile="ros2", library="other")
        if metadata:
            writer.add_metadata("notes", {"pilot": "somebody"})
            writer.add_attachment(1, 1, "notes.txt", "text/plain", b"content")
        schema = writer.register_schema("test_msgs/msg/Number", "ros2msg", NUMBER.encode())
        channel = writer.register_channel("/number", "cdr", schema)
        for number in range(messages):
            writer.add_message(channel, number, number_message(number), number)
        writer.finish()
    return path


WITHOUT = {"index_types": IndexType.NONE, "repeat_channels": False, "repeat_schemas": False, "use_statistics": False}
WITHOUT["use_summary_offsets"] = False
OTHER_WRITERS = {
    "as it comes": ({}, ""),
    "lz4": ({"compression": CompressionType.LZ4}, ""),
    "no summary": (WITHOUT, ""),
    "metadata": ({"metadata": True}, "metadata"),
    "metadata, checksum of all": ({"metadata": True, "enable_data_crcs": True}, ""),
    "no checksums": ({"enable_crcs": False}, "messages"),
    "no checksums, metadata": ({"enable_crcs": False, "metadata": True}, "messages, metadata"),
    "no checksums, lz4": ({"enable_crcs": False, "compression": CompressionType.LZ4}, "messages"),
    "no checksums, not packed": ({"enable_crcs": False, "compression": CompressionType.NONE}, "messages"),
    "no chunks": ({"use_chunking": False}, "messages"),
    "no chunks, no summary": ({"use_chunking": False, "enable_crcs": False, **WITHOUT}, "messages"),
}


@pytest.mark.parametrize("case", OTHER_WRITERS)
def test_files_of_other_writers_are_read(tmp_path, case):
    """What has no checksum is taken as it is, and said; in the recovered file everything has one."""
    options, unchecked = OTHER_WRITERS[case]
    path = foreign_log(tmp_path / "other.mcap", **options)
    log = read(path)
    assert log.complete
    assert log.reasons == ((f"no checksums, so that damage cannot be found: {unchecked}",) if unchecked else ())
    assert log["number"]["value"].tolist() == list(range(200))
    assert log.metadata == ({"notes": {"pilot": "somebody"}} if "metadata" in options else {})
    assert log.attachments == ({"notes.txt": b"content"} if "metadata" in options else {})
    recovery = recover(path, tmp_path / "new.mcap")
    assert (recovery.messages, recovery.complete, recovery.reasons) == (200, True, log.reasons)
    assert read(tmp_path / "new.mcap").reasons == ()


def test_what_rosbags_writes_is_read(tmp_path):
    rosbag2 = pytest.importorskip("rosbags.rosbag2")
    typesys = pytest.importorskip("rosbags.typesys")
    store = typesys.get_typestore(typesys.Stores.ROS2_JAZZY)
    kind = store.types["std_msgs/msg/String"]
    with rosbag2.Writer(tmp_path / "bag", version=9, storage_plugin=rosbag2.StoragePlugin.MCAP) as writer:
        connection = writer.add_connection("/text", kind.__msgtype__, typestore=store)
        for number in range(50):
            writer.write(connection, number, store.serialize_cdr(kind(data="x" * number), kind.__msgtype__))
    log = read(tmp_path / "bag" / "bag.mcap")
    assert log.complete
    assert log["text"]["data"].tolist() == ["x" * number for number in range(50)]


def test_topics_without_type_and_with_several_publishers(tmp_path):
    path = tmp_path / "other.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(profile="ros2", library="other")
        schema = writer.register_schema("test_msgs/msg/Number", "ros2msg", NUMBER.encode())
        strange_metadata = {"offered_qos_profiles": "[: no YAML"}
        channels = [writer.register_channel("/number", "cdr", schema, metadata) for metadata in ({}, strange_metadata)]
        text = writer.register_channel("/text", "json", 0)
        for number in range(10):
            writer.add_message(channels[number % 2], number, number_message(number), number)
            writer.add_message(text, number, b"{}", number)
        writer.finish()
    log = read(path)
    assert (log.complete, log.reasons) == (True, ("topic /text has no type and is left out",))
    assert log.topics == ("/number",)
    assert log["number"]["value"].tolist() == list(range(10))
    assert recover(path, tmp_path / "new.mcap").messages == 20


@pytest.mark.parametrize("options", [{"enable_crcs": False}, {"use_chunking": False}])
def test_a_cut_file_without_checksums_is_read_up_to_there(tmp_path, options):
    path = foreign_log(tmp_path / "other.mcap", compression=CompressionType.NONE, **options)
    path.write_bytes(path.read_bytes()[:5000])
    log = read(path)
    values = log["number"]["value"].tolist()
    assert not log.complete
    assert "the recording was not closed: it has no end" in log.reasons
    assert 50 < len(values) < 200
    assert values == list(range(len(values)))


@pytest.mark.parametrize("which", [0, 1, -1])
def test_a_chunk_that_lost_its_checksum_is_not_trusted(tmp_path, original, which):
    """In a file whose other chunks have one; of ours not even if no chunk has."""
    path = foreign_log(tmp_path / "other.mcap")
    with Source(path) as source:
        places = sorted(read_summary(source).chunks)
    damaged = bytearray(path.read_bytes())
    damaged[places[which] + 33 : places[which] + 37] = bytes(4)
    (tmp_path / "damaged.mcap").write_bytes(damaged)
    log = read(tmp_path / "damaged.mcap")
    assert not log.complete
    assert any("no checksum to trust" in reason for reason in log.reasons)
    assert 0 < len(log["number"].time) < 200
    damaged = bytearray(original.data)
    for start, _ in original.chunks:
        damaged[start + 33 : start + 37] = bytes(4)
    (tmp_path / "damaged.mcap").write_bytes(damaged)
    with pytest.raises(RecordingError, match=r"nothing in .* can be read"):
        read(tmp_path / "damaged.mcap")


def test_a_long_list_of_damages_is_cut(tmp_path):
    path = foreign_log(tmp_path / "other.mcap", messages=8000)
    data = bytearray(path.read_bytes())
    with Source(path) as source:
        places = sorted(read_summary(source).chunks)
    for place in places:
        data[place + 33] ^= 1
    path.write_bytes(data)
    with Source(path) as source:
        found = scan(source, lambda content: None)
    assert not found.complete
    assert len(places) > 150
    assert len(found.reasons) == 101
    assert found.reasons[-1] == f"{len(places) - 100} more reasons like these"


@pytest.mark.parametrize("content", [b"", b"\x89MCAP0\r\n", b"no recording\n" * 1000, bytes(5000)])
def test_what_is_no_recording_is_refused_in_one_line(tmp_path, content):
    path, output = tmp_path / "file.mcap", tmp_path / "output.mcap"
    path.write_bytes(content)
    for use in (lambda: read(path), lambda: recover(path, output)):
        with pytest.raises(RecordingError, match=rf"^nothing in {path} can be read: it has no intact chunk: [^\n]+$"):
            use()
    assert not output.exists()


def test_what_cannot_be_opened_is_refused_in_one_line(tmp_path):
    with pytest.raises(RecordingError, match=r"cannot read .*nothing.mcap: No such file or directory$"):
        read(tmp_path / "nothing.mcap")


def bags(folder):
    """Bags of all kinds that rosbags writes, by name."""
    rosbag2 = pytest.importorskip("rosbags.rosbag2")
    typesys = pytest.importorskip("rosbags.typesys")
    store = typesys.get_typestore(typesys.Stores.ROS2_JAZZY)
    kinds = {name: store.types[f"std_msgs/msg/{name}"] for name in ("String", "Float64")}
    mode, storage = rosbag2.CompressionMode, rosbag2.StoragePlugin
    for name, plugin, compression in (
        ("mcap", storage.MCAP, None),
        ("sqlite", storage.SQLITE3, None),
        ("packed", storage.MCAP, mode.FILE),
        ("packed_sqlite", storage.SQLITE3, mode.FILE),
        ("each", storage.MCAP, mode.MESSAGE),
    ):
        writer = rosbag2.Writer(folder / name, version=9, storage_plugin=plugin)
        if compression is not None:
            writer.set_compression(compression, rosbag2.CompressionFormat.ZSTD)
        with writer:
            connections = {
                key: writer.add_connection(f"/{key}", kind.__msgtype__, typestore=store) for key, kind in kinds.items()
            }
            for i in range(20):
                for key, value in (("String", "x" * i), ("Float64", float(i))):
                    data = store.serialize_cdr(kinds[key](data=value), kinds[key].__msgtype__)
                    writer.write(connections[key], i * 10_000_000, data)
    return folder


@pytest.fixture(scope="module")
def all_bags(tmp_path_factory):
    return bags(tmp_path_factory.mktemp("bags"))


CONVERT = (
    "`rosbags-convert --src {} --dst NEW --dst-storage mcap` of the Python package rosbags makes one in MCAP of it"
)
OTHER_KINDS = {
    "mcap": "a folder, name the log in it: {0}/mcap.mcap",
    "sqlite": f"a folder with a bag in SQLite: {CONVERT}",
    "packed": "a folder whose log is compressed as a whole: `zstd -d {0}/packed.mcap.zstd` unpacks it",
    "packed_sqlite": f"a folder with a bag in SQLite: {CONVERT}",
    "sqlite/sqlite.db3": f"a bag in SQLite: {CONVERT}",
    "packed/packed.mcap.zstd": "compressed as a whole: `zstd -d {1}` unpacks it",
    "mcap/metadata.yaml": "the description of a bag, which is a folder, name the log in it: {0}/mcap.mcap",
    ".": "a folder without a log (.mcap)",
}


@pytest.mark.parametrize("name", OTHER_KINDS)
def test_for_bags_of_other_kinds_the_message_says_what_to_do(all_bags, name):
    path = all_bags / name
    folder = path if path.is_dir() else path.parent
    expected = OTHER_KINDS[name].format(folder, path).replace("--src {}", f"--src {folder}")
    for use in (read, Playback, lambda path: recover(path, all_bags / "new.mcap")):
        with pytest.raises(RecordingError) as caught:
            use(path)
        assert str(caught.value) == f"cannot read {path}: {expected}"
    assert not (all_bags / "new.mcap").exists()


def test_many_logs_in_a_folder_are_not_all_listed(tmp_path):
    for i in range(5):
        (tmp_path / f"{i}.mcap").touch()
    with pytest.raises(RecordingError, match=r"name the log in it: \S+/0.mcap, \S+/1.mcap, \S+/2.mcap, \.\.\.$"):
        read(tmp_path)


def test_messages_that_are_compressed_one_by_one_are_unpacked(all_bags):
    log = read(all_bags / "each" / "each.mcap")
    assert log["Float64"]["data"].tolist() == list(range(20))
    assert log["String"]["data"].tolist() == ["x" * i for i in range(20)]


@pytest.mark.parametrize("damage", ["cut", "no end", "too large"])
def test_a_compressed_message_that_cannot_be_unpacked_is_one_line(tmp_path, damage):
    data = zstandard.compress(number_message(1))
    if damage == "too large":  # says that it holds 2^62 bytes
        data = data[:4] + b"\xe0" + struct.pack("<Q", 2**62) + data[-8:]
    path = tmp_path / "a.mcap"
    with new_log(path) as log:
        log.write(add_number(log), 0, {"cut": data[:6], "no end": data[:-3]}.get(damage, data))
    with pytest.raises(RecordingError, match=r"^topic /number: a compressed message [^\n]+$"):
        dict(read(path)["number"])


def test_what_is_no_message_of_its_type_is_found_out():
    fit = Fit(parse("a/msg/B", "float64 value\nstring name\nint16[] numbers"), "a/B")
    good = struct.pack("<4BdI4sIhh", 0, 1, 0, 0, 1.0, 4, b"abc\0", 2, 3, 4)
    for message in (good, good, good[:-4] + b"\5\0\6\0", struct.pack("<4BdI2s2xI", 0, 1, 0, 0, 1.0, 2, b"a\0", 0)):
        fit.check(message)
    wrong = (good[:-2], good + b"\0\0\0\0", good[:12] + b"\xff\0\0\0" + good[16:], b"", b"\0\1", b"\0\7\0\0" + good[4:])
    for message in wrong:
        with pytest.raises(RecordingError):
            fit.check(message)
    fit.check(good)


# -- whose topics are which --------------------------------------------------------------------------------------


ROLES = ("state", "events")


def flight_log(path, namespace, value, begin, roles=ROLES):
    """Log of a flight in a namespace whose every value is the same."""
    metadata, attachments = {"simulation": {"aircraft": f"craft {value}"}}, {"aircraft.yaml": f"{value}".encode()}
    with LogWriter(path, library="test", wall_start=begin, metadata=metadata, attachments=attachments) as log:
        for role in roles:
            channel = add_number(log, f"{namespace}/{role}", role=role)
            for i in range(3):
                log.write(channel, i, number_message(value))
    return path


def test_a_role_finds_its_topic_however_it_is_called(tmp_path):
    path = tmp_path / "a.mcap"
    with new_log(path) as log:
        for topic, role, value in (("/x/y", "state", 1), ("/state", "rotors", 2), ("/d", "a", 3), ("/e", "a", 4)):
            log.write(add_number(log, topic, role=role), 0, number_message(value))
    log = read(path)
    assert [log[name]["value"][0] for name in ("state", "/state", "rotors", "/x/y", "x/y")] == [1, 2, 2, 1, 1]
    assert log.roles == {"state": "/x/y", "rotors": "/state"}  # the two others cannot be distinguished
    assert log.flights == (log,)
    assert log.flight() is log
    assert log.flight(1) is log
    assert "a" not in log
    with pytest.raises(RecordingError, match="flight 2: allowed are 1 to 1"):
        log.flight(2)
    recover(path, tmp_path / "new.mcap")
    assert read(tmp_path / "new.mcap").roles == log.roles


@pytest.mark.parametrize("names", [("/h1", "/h2"), ("", "")])
def test_flights_in_one_file_are_distinguished(tmp_path, names):
    """By their numbers, in the order in which they began; what belongs to none belongs to each."""
    late = flight_log(tmp_path / "late.mcap", names[0], 2, 2_000_000_000)
    early = flight_log(tmp_path / "early.mcap", names[1], 1, 1_000_000_000)
    other = foreign_log(tmp_path / "other.mcap", messages=3)
    path = merge(tmp_path / "both.mcap", late, early, other)
    log = read(path)
    assert [flight["state"]["value"].tolist() for flight in log.flights] == [[1, 1, 1], [2, 2, 2]]
    assert [flight.metadata["simulation"]["aircraft"] for flight in log.flights] == ["craft 1", "craft 2"]
    assert [flight.attachments["aircraft.yaml"] for flight in log.flights] == [b"1", b"2"]
    assert [len(flight["number"].time) for flight in log.flights] == [3, 3]
    assert log.flight(2) is log.flights[1]
    both = f"{path} holds 2 flights, choose one by --flight NUMBER (in Python of log.flights): 1 is craft 1 on "
    for use in (log.flight, lambda: log["state"]):
        with pytest.raises((RecordingError, KeyError), match=re.escape(both)) as caught:
            use()
        assert f"{names[1]}/state started 1970-01-01T00:00:01.000+00:00; 2 is craft 2 on {names[0]}/state" in str(
            caught
        )
    assert "state" not in log
    assert len(log[f"{names[0]}/state"].time) == (6 if names[0] == names[1] else 3)  # by its name all that there is
    assert recover(path, tmp_path / "new.mcap").complete
    again = read(tmp_path / "new.mcap")
    assert [flight.attachments["aircraft.yaml"] for flight in again.flights] == [b"1", b"2"]
    assert [flight["state"]["value"].tolist() for flight in again.flights] == [[1, 1, 1], [2, 2, 2]]
    for number, flight in enumerate(log.flights, 1):
        with Playback(path, number) as playback:
            topics = {channel.topic for channel in playback.channels.values()}
            assert topics == {*flight.topics, "/number"}
    with pytest.raises(RecordingError, match="flight 3: allowed are 1 to 2"):
        Playback(path, 3)


def test_a_topic_of_two_types_in_two_flights_is_found_in_each(tmp_path):
    paths = [tmp_path / "0.mcap", tmp_path / "1.mcap"]
    for i, path in enumerate(paths):
        with LogWriter(path, library="test", wall_start=i) as log:
            text = ("float64 value", "float64 value\nint8 more")[i]
            channel = log.add_channel("/state", "test_msgs/msg/Number", text, "", role="state")
            log.write(channel, 0, number_message(i) + bytes(i))
    log = read(merge(tmp_path / "both.mcap", *paths))
    assert [flight["state"]["value"].tolist() for flight in log.flights] == [[0], [1]]
    assert any("/state has another type in another flight" in reason for reason in log.reasons)


def test_topics_of_logs_that_do_not_say_what_they_are_are_found_by_type(tmp_path):
    """Of older versions, or recorded by others: each flight has the topics beside its states, and time is of all."""
    kinds = {"state": "BodyState", "rotors": "RotorStateArray", "events": "FlightEvent"}
    path = tmp_path / "other.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(profile="ros2", library="other")

        def add(topic, kind):
            schema = writer.register_schema(kind, "ros2msg", NUMBER.encode())
            channel = writer.register_channel(topic, "cdr", schema)
            writer.add_message(channel, 0, number_message(0), 0)

        for namespace in ("/a", "/b/c"):
            for role, kind in kinds.items():
                add(f"{namespace}/{role}", f"sbs_msgs/msg/{kind}")
        add("/b/c/odom", "nav_msgs/msg/Odometry")
        add("/b/c/wheels", "nav_msgs/msg/Odometry")
        add("/clock", "rosgraph_msgs/msg/Clock")
        writer.finish()
    found = [flight.roles for flight in read(path).flights]
    first = {**{role: f"/a/{role}" for role in kinds}, "clock": "/clock"}
    assert found == [first, {**{role: f"/b/c/{role}" for role in kinds}, "odom": "/b/c/odom", "clock": "/clock"}]


@pytest.mark.parametrize("names", [("/h1", "/h2"), ("", "")])
def test_older_logs_in_one_file_are_reported(tmp_path, names):
    """They had no identity: it is not known to which flight metadata and messages of one topic belong."""
    paths = [tmp_path / "0.mcap", tmp_path / "1.mcap"]
    for i, path in enumerate(paths):
        start = {"library": "sbs_sim 0", "wall_start_ns": str(i)}
        with path.open("wb") as file:
            writer = Writer(file)
            writer.start(profile="ros2", library="sbs_sim 0")
            writer.add_metadata("recording", {**start, "crc32": metadata_checksum("recording", start)})
            schema = writer.register_schema("sbs_msgs/msg/BodyState", "ros2msg", NUMBER.encode())
            channel = writer.register_channel(f"{names[i]}/state", "cdr", schema)
            writer.add_message(channel, i, number_message(i), 0)
            writer.finish()
    path = merge(tmp_path / "both.mcap", *paths)
    log = read(path)
    alike = f"{path} holds 2 flights that cannot be distinguished: their logs have no identity"
    if names[0] == names[1]:
        with pytest.raises(RecordingError, match=re.escape(alike)):
            log.flight()
    else:
        assert [flight["state"]["value"].tolist() for flight in log.flights] == [[0], [1]]
        with pytest.raises(RecordingError, match="choose one by --flight"):
            log.flight()
    for flight in log.flights:
        with pytest.raises(RecordingError, match=re.escape(alike)):
            flight_of(flight)


# -- reading to play ---------------------------------------------------------------------------------


def played(path, *part):
    with Playback(path) as playback:
        return [(log_time, data) for log_time, _, data in playback.messages(*part)]


@pytest.mark.parametrize("case", OTHER_WRITERS)
def test_what_is_played_is_what_is_read(tmp_path, case):
    options, unchecked = OTHER_WRITERS[case]
    path = foreign_log(tmp_path / "other.mcap", **options)
    assert played(path) == [(number, number_message(number)) for number in range(200)]
    with Playback(path) as playback:
        assert bool(playback.warning) == ("messages" in unchecked)


@pytest.mark.parametrize("chunked", [True, False])
def test_messages_are_played_in_the_order_of_their_time(tmp_path, chunked):
    """Of several chunks that overlap, and messages of equal time as they were written."""
    path = tmp_path / "other.mcap"
    times = [number + random.Random(number).randrange(-150, 150) * (number % 3) for number in range(1000, 2000)]
    with path.open("wb") as file:
        writer = Writer(file, chunk_size=1000, use_chunking=chunked)
        writer.start(profile="ros2", library="other")
        schema = writer.register_schema("test_msgs/msg/Number", "ros2msg", NUMBER.encode())
        channel = writer.register_channel("/number", "cdr", schema)
        for number, log_time in enumerate(times):
            writer.add_message(channel, log_time * 10**6, number_message(number), 0)
        writer.finish()
    expected = sorted((log_time * 10**6, number) for number, log_time in enumerate(times))
    assert played(path) == [(log_time, number_message(number)) for log_time, number in expected]
    begin = expected[0][0]
    part = [item for item in expected if 300 * 10**6 <= item[0] - begin <= 500 * 10**6]
    assert played(path, 0.3, 0.5) == [(log_time, number_message(number)) for log_time, number in part]


def test_playing_begins_at_once_and_ends_before_a_damage(original, tmp_path):
    """What is played later is not read before; a damage before the part that is played does no harm."""
    path = tmp_path / "whole.mcap"
    path.write_bytes(original.data)
    whole = played(path)
    assert {data for _, data in whole} == set(original.messages.values())
    (start, end), keys = sorted(original.chunks.items())[3]
    data = bytearray(original.data)
    data[end - 5] ^= 1
    path = tmp_path / "damaged.mcap"
    path.write_bytes(data)
    found = []

    def play():
        with Playback(path) as playback:
            found.extend((log_time, content) for log_time, _, content in playback.messages())

    with pytest.raises(RecordingError, match=rf"is damaged \(byte {start}: .*--recover"):
        play()
    assert found == whole[: len(found)]
    assert len(found) >= sum(len(item) for place, item in original.chunks.items() if place < (start, end)) - 6
    last = max(log_time for log_time, content in whole if content in {original.messages[key] for key in keys})
    later = played(path, (last - whole[0][0]) / 1e9 + 0.005)
    assert later
    assert later == whole[-len(later) :]


def test_an_incomplete_log_is_not_played(original, tmp_path):
    path = tmp_path / "cut.mcap"
    path.write_bytes(original.data[:-30_000])
    with pytest.raises(RecordingError, match=r"cut.mcap is incomplete \(.*: `replay --recover"):
        Playback(path)


# -- writing -----------------------------------------------------------------------------------------


def test_few_messages_reach_the_file_in_time(tmp_path):
    """A slow flight fills no chunks: they are closed by time."""
    path = tmp_path / "log.mcap"
    log = new_log(path)
    channel = add_number(log)
    for number in range(5):
        log.write(channel, number, number_message(number))
        time.sleep(0.45)
        found = read(path)
        assert found["number"]["value"].tolist() == list(range(number + 1))
        assert not found.complete
        assert found.reasons == ("the recording was not closed: it has no end",)
    assert log.close()
    assert read(path).complete


def test_many_messages_are_put_into_chunks_of_a_handy_size(tmp_path):
    path = tmp_path / "log.mcap"
    with new_log(path) as log:
        channel = log.add_channel("/noise", "test_msgs/msg/Noise", "uint8[] data", "")
        for number in range(3000):
            log.write(channel, number, struct.pack("<4BI", 0, 1, 0, 0, 1000) + os.urandom(1000), wait=True)
    with path.open("rb") as file:
        chunks = make_reader(file).get_summary().chunk_indexes
    assert len(chunks) >= 10
    assert max(chunk.uncompressed_size for chunk in chunks) < CHUNK_SIZE * 1.2
    assert read(path)["noise"]["data"].shape == (3000, 1000)


class SlowDisk:
    """Makes every write after the first wait until it may go on."""

    def __init__(self, monkeypatch):
        self.go_on = threading.Event()
        self.waiting = threading.Event()
        write = NewFile.write

        def slow(file, data):
            if file._size:
                self.waiting.set()
                self.go_on.wait(60)
            write(file, data)

        monkeypatch.setattr(NewFile, "write", slow)


def test_a_slow_disk_never_blocks_and_what_is_dropped_is_counted(tmp_path, monkeypatch):
    disk = SlowDisk(monkeypatch)
    log = new_log(tmp_path / "log.mcap", queue_length=100)
    channel = add_number(log)
    assert log.write(channel, 0, number_message(0))
    assert disk.waiting.wait(10)
    begin = time.monotonic()
    taken = [log.write(channel, number, number_message(number)) for number in range(1, 301)]
    assert time.monotonic() - begin < 1.0
    assert taken == [True] * 100 + [False] * 200
    assert (log.dropped, log.written) == (200, 0)
    disk.go_on.set()
    assert log.close()
    assert (log.dropped, log.written) == (200, 101)
    found = read(log.path)
    assert found["number"]["value"].tolist() == list(range(101))
    assert found.metadata["recording_end"] == {"written": "101", "dropped": "200"}


def test_there_is_room_for_what_is_essential(tmp_path, monkeypatch):
    """It is neither waited for nor dropped when the rest is."""
    disk = SlowDisk(monkeypatch)
    log = new_log(tmp_path / "log.mcap", queue_length=10)
    channel = add_number(log)
    log.write(channel, 0, number_message(0))
    assert disk.waiting.wait(10)
    taken = [log.write(channel, number, number_message(number)) for number in range(1, 13)]
    taken += [log.write(channel, number, number_message(number), essential=True) for number in range(13, 25)]
    assert taken == [True] * 10 + [False] * 2 + [True] * 10 + [False] * 2
    disk.go_on.set()
    assert log.close()
    assert read(log.path)["number"]["value"].tolist() == [*range(11), *range(13, 23)]
    assert log.dropped == 4


def test_a_patient_writer_waits_for_room(tmp_path, monkeypatch):
    disk = SlowDisk(monkeypatch)
    log = new_log(tmp_path / "log.mcap", queue_length=10)
    channel = add_number(log)
    results = []

    def write_many():
        results.extend(log.write(channel, number, number_message(number), wait=True) for number in range(200))

    thread = threading.Thread(target=write_many)
    thread.start()
    assert disk.waiting.wait(10)
    time.sleep(0.2)
    assert thread.is_alive()
    assert len(results) <= 20  # ten in the queue, up to ten in the hands of the disk
    disk.go_on.set()
    thread.join(30)
    assert log.close()
    assert results == [True] * 200
    assert read(log.path)["number"]["value"].tolist() == list(range(200))


def test_a_patient_writer_is_let_go_at_the_end(tmp_path, monkeypatch):
    disk = SlowDisk(monkeypatch)
    log = new_log(tmp_path / "log.mcap", queue_length=1)
    channel = add_number(log)
    results = []

    def write_many():
        results.extend(log.write(channel, number, number_message(number), wait=True) for number in range(5))

    thread = threading.Thread(target=write_many)
    thread.start()
    assert disk.waiting.wait(10)
    time.sleep(0.1)
    assert not log.close(timeout=0.1)
    thread.join(10)
    assert not thread.is_alive()
    assert results.count(True) == 2
    assert log.dropped == 3
    assert "the disk did not take the rest within 0.1 s" in log.failed
    disk.go_on.set()
    assert not log.close()  # but it did in the end
    assert read(log.path).complete


def test_a_gap_in_the_sequence_shows_dropped_messages(tmp_path, monkeypatch):
    disk = SlowDisk(monkeypatch)
    log = new_log(tmp_path / "log.mcap", queue_length=5)
    channel = add_number(log)
    log.write(channel, 0, number_message(0))
    assert disk.waiting.wait(10)
    for number in range(1, 9):
        log.write(channel, number, number_message(number))
    disk.go_on.set()
    wait_until(lambda: log.written == 6)
    log.write(channel, 9, number_message(9))
    assert log.close()
    assert sorted(sequence for _, sequence in crash.messages_of(log.path)) == [1, 2, 3, 4, 5, 6, 10]


def test_several_threads_write(tmp_path):
    log = new_log(tmp_path / "log.mcap")
    channels = [add_number(log, f"/number{index}") for index in range(4)]

    def write_many(channel):
        for number in range(2000):
            log.write(channel, number, number_message(number), wait=True)

    threads = [threading.Thread(target=write_many, args=(channel,)) for channel in channels]
    for thread in threads:
        thread.start()
    added = [add_number(log, f"/late{index}") for index in range(20)]
    for thread in threads:
        thread.join()
    for channel in added:
        log.write(channel, 1, number_message(1))
    assert log.close()
    found = read(log.path)
    assert found.complete
    for index in range(4):
        assert found[f"number{index}"]["value"].tolist() == list(range(2000))
    assert all(found[f"late{index}"]["value"].tolist() == [1] for index in range(20))


def test_after_the_end_everything_is_dropped(tmp_path):
    log = new_log(tmp_path / "log.mcap")
    channel = add_number(log)
    assert log.close()
    assert log.close()
    assert not log.write(channel, 0, number_message(0))
    assert not log.write(channel, 0, number_message(0), wait=True)
    assert (log.written, log.dropped, log.failed) == (0, 2, "")
    found = read(log.path)
    assert found.complete
    assert found["number"].time.shape == (0,)


def test_what_cannot_be_recorded_is_refused(tmp_path):
    with new_log(tmp_path / "log.mcap") as log:
        channel = add_number(log)
        with pytest.raises(RecordingError, match="topic /number is recorded already"):
            add_number(log)
        with pytest.raises(
            RecordingError, match="topic /other: test_msgs/msg/Number is recorded with another definition"
        ):
            log.add_channel("/other", "test_msgs/msg/Number", "int8 value", "")
        with pytest.raises(RecordingError, match="topic /other: the QoS profiles are not a YAML list: 'depth: 1'"):
            log.add_channel("/other", "test_msgs/msg/Number", NUMBER, "depth: 1")
        with pytest.raises(RecordingError, match="channel 7: allowed are those that add_channel gave"):
            log.write(7, 0, b"")
        with pytest.raises(RecordingError, match="log time -1 ns: allowed are 0 to"):
            log.write(channel, -1, b"")
        assert log.write(channel, 2**63 - 1, number_message(1))
    assert (log.written, log.dropped) == (1, 0)
    for data in ({"rosbag2": {}}, {"recording": {}}, {"mine": {"crc32": ""}}):
        with pytest.raises(RecordingError, match=r"metadata '\w+': reserved are recording, "):
            new_log(tmp_path / "other.mcap", metadata=data)
    assert not (tmp_path / "other.mcap").exists()


def test_a_deleted_log_is_reported_at_once(tmp_path):
    """Though nothing is written any more."""
    log = new_log(tmp_path / "a.mcap")
    number = add_number(log)
    log.write(number, 0, number_message(1))
    wait_until(lambda: log.written == 1)
    log.path.unlink()
    begin = time.monotonic()
    wait_until(lambda: log.failed)
    assert time.monotonic() - begin < 1.0
    assert log.failed == f"{tmp_path / 'a.mcap'} was deleted while it was written: what was in it is lost"
    assert not log.write(number, 1, number_message(2))
    assert not log.close()
    assert log.dropped == 1


@pytest.mark.parametrize("how", ["replaced", "overwritten", "cut", "its folder deleted"])
def test_a_log_that_is_replaced_is_reported_and_the_other_file_stays(tmp_path, how):
    folder = tmp_path / "folder"
    folder.mkdir()
    path, other = folder / "a.mcap", tmp_path / "other"
    log = new_log(path)
    add_number(log)
    if how == "replaced":
        other.write_bytes(b"other")
        other.replace(path)
    elif how == "overwritten":
        path.write_bytes(b"other")
    elif how == "cut":
        os.truncate(path, 20)
    else:
        path.unlink()
        folder.rmdir()
    assert not log.close()
    assert log.failed.startswith(f"{path} was ")
    left = path.read_bytes() if path.exists() else None
    log.discard()
    if how == "replaced":
        assert path.read_bytes() == left == b"other"  # which is none of ours


def test_a_log_that_is_moved_is_followed(tmp_path):
    log = new_log(tmp_path / "a.mcap")
    number = add_number(log)
    (tmp_path / "a.mcap").rename(tmp_path / "b.mcap")
    (tmp_path / "a.mcap").write_bytes(b"other")
    log.write(number, 0, number_message(1))
    wait_until(lambda: log.written)
    assert log.path == tmp_path / "b.mcap"
    tmp_path.joinpath("c").mkdir()
    log.path.rename(tmp_path / "c" / "d.mcap")
    assert log.close()
    assert log.path == tmp_path / "c" / "d.mcap"
    assert read(log.path)["number"]["value"].tolist() == [1]
    log.discard()
    assert (tmp_path / "a.mcap").read_bytes() == b"other"
    assert not list(tmp_path.rglob("d.mcap"))


def test_an_error_of_ours_ends_the_recording_and_not_the_flight(tmp_path):
    log = new_log(tmp_path / "log.mcap")
    channel = add_number(log)
    log.write(channel, 0, number_message(0))
    wait_until(lambda: log.written)
    log.write(channel, 1, ["no bytes"])
    wait_until(lambda: log.failed)
    assert "internal error: TypeError" in log.failed
    assert not log.write(channel, 2, number_message(2))
    assert not log.close()
    assert (log.written, log.dropped) == (1, 2)
    assert read(log.path)["number"]["value"].tolist() == [0]


def test_where_no_file_can_be_made_one_line_says_why(tmp_path):
    with pytest.raises(RecordingError, match=r"cannot write .*/no/log.mcap: the folder .*/no does not exist$"):
        new_log(tmp_path / "no" / "log.mcap")
    (tmp_path / "log.mcap").write_text("mine")
    with pytest.raises(RecordingError, match=r"cannot write .*log.mcap: File exists$"):
        new_log(tmp_path / "log.mcap")
    assert (tmp_path / "log.mcap").read_text() == "mine"
    with pytest.raises(RecordingError, match=r"cannot write .*: Not a directory$"):
        new_log(tmp_path / "log.mcap" / "log.mcap")
    with pytest.raises(RecordingError, match=r"cannot write .*: embedded null byte$"):
        new_log(tmp_path / "a\0b")


def test_a_folder_that_must_not_be_written(tmp_path):
    tmp_path.chmod(0o555)
    user = os.geteuid()
    try:
        if user == 0:  # who may write everywhere
            os.seteuid(65534)
        with pytest.raises(RecordingError, match=r"cannot write .*log.mcap: Permission denied$"):
            new_log(tmp_path / "log.mcap")
    finally:
        os.seteuid(user)
        tmp_path.chmod(0o755)


FULL_DISK = """
    import os, resource, struct, sys, time
    from sbs_sim.recording import LogWriter
    limit = int(sys.argv[2])
    resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))
    log = LogWriter(sys.argv[1], library="test", wall_start=0, attachments={"file": b"x" * 1000})
    channel = log.add_channel("/noise", "test_msgs/msg/Noise", "uint8[] data", "")
    message = struct.pack("<4BI", 0, 1, 0, 0, 1000)
    for number in range(1000):
        log.write(channel, number, message + os.urandom(1000))
        time.sleep(0.001)
    last = log.write(channel, 1000, message)
    closed = log.close()
    print(log.written, log.dropped, last, closed, log.failed)
"""


def test_a_full_disk_ends_the_recording_and_not_the_flight(tmp_path):
    path = tmp_path / "log.mcap"
    code = [sys.executable, "-c", textwrap.dedent(FULL_DISK), str(path)]
    result = subprocess.run([*code, "500000"], capture_output=True, text=True, timeout=60, check=True)
    written, dropped, last, closed, failed = result.stdout.strip().split(maxsplit=4)
    assert int(written) + int(dropped) == 1001
    assert 100 < int(written) < 500
    assert (last, closed) == ("False", "False")
    assert failed == f"cannot write {path}: File too large"
    found = read(path)
    assert found["noise"]["data"].shape == (int(written), 1000)
    assert found.reasons == ("the recording was not closed: it has no end",)


def test_a_disk_that_is_full_already(tmp_path):
    path = tmp_path / "log.mcap"
    code = [sys.executable, "-c", textwrap.dedent(FULL_DISK), str(path), "500"]
    result = subprocess.run(code, capture_output=True, text=True, timeout=60, check=False)
    assert f"RecordingError: cannot write {path}: File too large" in result.stderr
    assert not path.exists()


def test_the_summary_of_a_full_disk(tmp_path, monkeypatch):
    """Room for every chunk, but not for the end."""
    log = new_log(tmp_path / "log.mcap")
    log.write(add_number(log), 0, number_message(0))
    wait_until(lambda: log.written)
    size = log.path.stat().st_size
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size + 50, limits[1]))
    try:
        assert not log.close()
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert log.failed.endswith("File too large")
    assert log.path.stat().st_size == size
    assert read(log.path)["number"]["value"].tolist() == [0]


def test_a_writer_needs_neither_numpy_nor_ros():
    code = "import sys; from sbs_sim.recording import LogWriter; print({'numpy', 'rclpy'} & set(sys.modules))"
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True)
    assert result.stdout.strip() == "set()"


def test_a_missing_package_is_named_with_its_remedy():
    code = "import sys; sys.modules['mcap'] = None; import sbs_sim.recording; sbs_sim.recording.read"
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=False)
    assert "RecordingError: the Python package mcap is missing: python3 -m pip install mcap" in result.stderr


# -- killing, cutting, damaging ----------------------------------------------------------------------


@pytest.mark.parametrize("tick", crash.TICKS[1:])
def test_a_killed_recorder_loses_half_a_second_at_most(tmp_path, tick):
    loss = crash.kill_one(tmp_path / "log.mcap", tick, random.Random().uniform(0.6, 1.5))
    assert loss is not None
    assert loss < crash.ALLOWED_LOSS


@pytest.fixture(scope="module")
def original(tmp_path_factory):
    return crash.make_original(tmp_path_factory.mktemp("original"), seconds=2.0)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("damaged")


@given(st.sampled_from(crash.KINDS), st.integers(0, 2**32))
@settings(max_examples=80, deadline=None)
def test_damage_costs_no_more_than_what_it_touches(original, folder, kind, seed):
    crash.damage_one(folder, original, kind(original.data, random.Random(seed)))


@given(st.data(), st.integers(2, 6))
@settings(max_examples=40, deadline=None)
def test_several_damages_never_yield_what_was_not_recorded(original, folder, data, count):
    damaged = original.data
    for _ in range(count):
        damaged = data.draw(st.sampled_from(crash.KINDS[1:]))(damaged, random.Random(data.draw(st.integers(0, 99999))))[
            0
        ]
    crash.damage_one(folder, original, (damaged, 0, len(original.data), 0))


def test_every_field_of_a_small_file(tmp_path):
    """Every third byte wrong, some of each field whose length is not one, and the file cut at many places."""
    path = tmp_path / "log.mcap"
    with new_log(path, metadata={"mine": {"key": "value"}}, attachments={"file": b"content"}) as log:
        channel = log.add_channel("/number", "test_msgs/msg/Number", NUMBER, "")
        for number in range(3):
            log.write(channel, number, number_message(number))
    data = path.read_bytes()
    messages = crash.messages_of(path)
    whole = read(path)
    place = data.index(b"\x04\0\0\0zstd") - 37
    span = (place, place + 9 + struct.unpack_from("<Q", data, place + 1)[0])
    original = crash.Original(data, messages, {span: set(messages)}, whole.metadata, whole.attachments)
    for offset in range(0, len(data), 3):
        damaged = data[:offset] + bytes([data[offset] ^ 0xFF]) + data[offset + 1 :]
        crash.damage_one(tmp_path, original, (damaged, offset, offset + 1, 0))
        if offset % 9 == 0:
            crash.damage_one(tmp_path, original, (data[:offset], offset, len(data), 0))


def test_lengths_beyond_all_bounds_do_not_take_all_memory(tmp_path, original):
    """Every length field of the first chunk, claiming gigabytes."""
    place = min(original.chunks)[0]
    limits = resource.getrlimit(resource.RLIMIT_AS)
    present = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (present + 8 * MAX_RECORD_SIZE, limits[1]))
    try:
        for field, claim in itertools.product((1, 25, 33, 45), (2**31, 2**40, 2**63, 2**64 - 1)):
            data = bytearray(original.data)
            struct.pack_into("<Q", data, place + field, claim)
            crash.damage_one(tmp_path, original, (bytes(data), place, place + 60, 0))
    finally:
        resource.setrlimit(resource.RLIMIT_AS, limits)


def test_damage_to_what_is_not_needed_is_reported_and_costs_nothing(tmp_path, original):
    """The name of the program in the header, and times in a message index."""
    (_, end), *_ = sorted(original.chunks)
    for place in (original.data.index(b"crash_recording"), end + 9 + 6 + 3):
        data = bytearray(original.data)
        data[place] ^= 1
        path = tmp_path / "damaged.mcap"
        path.write_bytes(data)
        log = read(path)
        assert log.complete
        assert log.reasons == ("the checksum of the data is wrong, those of their parts are right",)
        assert log.metadata == original.metadata
        crash.damage_one(tmp_path, original, (bytes(data), place, place + 1, 0))


def test_the_definitions_survive_the_first_chunk(tmp_path, original):
    (start, end), *_ = sorted(original.chunks)
    data = original.data[:start] + bytes(end - start) + original.data[end:-100]
    path = tmp_path / "damaged.mcap"
    path.write_bytes(data)
    assert crash.damage_one(tmp_path, original, (data, start, len(data), 0))[0] == "in part"
    assert "values" in read(path)["t16"]


def test_a_recovered_file_is_complete_and_says_what_was_wrong(tmp_path, flight):
    path, sent = flight
    broken, output = tmp_path / "broken.mcap", tmp_path / "output.mcap"
    broken.write_bytes(path.read_bytes()[:-50_000])
    recovery = recover(broken, output)
    assert not recovery.complete
    assert 0 < recovery.messages < len(sent)
    assert recovery.reasons[-1] == "the recording was not closed: it has no end"
    log = read(output)
    assert log.complete
    assert log.metadata["recovery"]["complete"] == "false"
    assert log.metadata["recovery"]["lost_bytes"] == str(recovery.lost_bytes)
    assert log.metadata["aircraft"] == {"name": "sbs", "städte": "ü"}
    assert log.metadata["recording"]["library"] == "test 1"
    assert recovery.last_time == max(topic.time.max(initial=0.0) for topic in log.values())
    highlevel = pytest.importorskip("rosbags.highlevel")
    with highlevel.AnyReader([output]) as reader:
        assert reader.message_count == recovery.messages
        found = sorted((connection.topic, time_ns, data) for connection, time_ns, data in reader.messages())
    assert set(found) <= set(sent)


def test_a_complete_file_is_recovered_completely(tmp_path, flight):
    path, sent = flight
    before = path.read_bytes()
    recovery = recover(path, tmp_path / "output.mcap")
    assert (recovery.messages, recovery.lost_bytes, recovery.complete, recovery.reasons) == (len(sent), 0, True, ())
    assert recovery.last_time == TICKS * 0.01
    assert path.read_bytes() == before
    again = recover(tmp_path / "output.mcap", tmp_path / "again.mcap")
    assert again == recovery


def test_an_output_that_exists_is_left_alone(tmp_path, flight):
    path, _ = flight
    with pytest.raises(RecordingError, match=r"cannot write .*: File exists"):
        recover(path, path)
    with pytest.raises(RecordingError, match=r"cannot write .*: the folder .* does not exist"):
        recover(path, tmp_path / "no" / "output.mcap")


def test_an_output_that_is_not_what_was_written_is_not_left(tmp_path, flight, monkeypatch):
    write = NewFile.write
    monkeypatch.setattr(NewFile, "write", lambda file, data: write(file, data.replace(b"zstd", b"zzzz", 1)))
    with pytest.raises(RecordingError, match=r"cannot write .*: what was read back is not what was written"):
        recover(flight[0], tmp_path / "output.mcap")
    assert not (tmp_path / "output.mcap").exists()


def test_a_scan_hands_out_nothing_without_a_checksum(original, tmp_path):
    """The content of a chunk that still decompresses, with its checksum wrong."""
    data = bytearray(original.data)
    for start, _ in original.chunks:
        data[start + 33] ^= 1
    path = tmp_path / "damaged.mcap"
    path.write_bytes(data)
    contents = []
    with Source(path) as source:
        found = scan(source, contents.append)
    assert contents == []
    assert not found.complete
    assert len(found.chunks) == 0


@pytest.mark.parametrize("strange", [np.inf, -np.inf, np.nan, 1.7e308])
def test_values_that_are_no_numbers_are_drawn_around(strange):
    axes = Figure().subplots()
    _draw(axes, "anything", {"value": (np.arange(4.0), np.array([1.0, strange, 1.0, 1.0]))})
    assert np.isfinite(axes.get_ylim()).all()
