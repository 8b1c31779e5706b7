"""Messages whose numbers are written into bytes are those that ROS serialises, and nothing is guessed."""

import copy
import dataclasses
from pathlib import Path

import numpy as np
import pytest
from ament_index_python.packages import get_package_share_directory
from geometry_msgs.msg import Vector3
from helpers import build
from nav_msgs.msg import Odometry
from random_aircraft import random_data
from rclpy.serialization import deserialize_message, serialize_message

from sbs_msgs.msg import BodyState, InflowArray, RotorStateArray, SimulationStatus, WorkingState
from sbs_sim import Aircraft
from sbs_sim.flight.blade_angles import blade_angles
from sbs_sim.flight.records import Snapshot
from sbs_sim.model.records import LOAD_SIZE
from sbs_sim.nodes import templates
from sbs_sim.nodes.conversions import StateMessages
from sbs_sim.nodes.state_bytes import TOPICS, StateBytes, StatusBytes, states_of
from sbs_sim.nodes.templates import DOUBLE, LayoutError, Template
from sbs_sim.recording import message_definition
from sbs_sim.recording.cdr import Layout
from sbs_sim.recording.definitions import parse

DATA = Path(__file__).resolve().parents[1] / "data"
KINDS = {"state": BodyState, "rotors": RotorStateArray, "inflow": InflowArray, "odom": Odometry}
UNUSUAL = (0.0, -0.0, 5e-324, -1.7976931348623157e308, 1.0 + 2**-52)  # every bit must come through


def quadrotor():
    return Aircraft.from_dict(random_data("quadrotor", np.random.default_rng(3)))


AIRCRAFT = {
    "2 rotors of 3 blades": lambda: build(),
    "2 rotors of 4 blades": lambda: build(every_rotor={"blades": 4}),
    "2 rotors of 5 blades": lambda: build(every_rotor={"blades": 5}),
    "1 rotor": lambda: build(rotors=[{}]),
    "1 rotor of 4 blades and a tail rotor": lambda: Aircraft.load(DATA / "tail_rotor.yaml"),
    "rotors of 3 and of 6 blades": lambda: build(rotors=[{}, {"blades": 6}]),
    "4 rotors": quadrotor,
}


def snapshot(aircraft, chance):
    """An instant with numbers that no flight has."""
    count, size = len(aircraft.rotors), aircraft.layout.size
    state = chance.uniform(-1e3, 1e3, size)
    state[: len(UNUSUAL)] = UNUSUAL
    return Snapshot(
        step=7,
        time=float(chance.uniform(0.0, 2e9)),
        state=state,
        acceleration=chance.normal(size=3),
        swashplate=np.zeros((count, 3)),
        azimuth=chance.uniform(0.0, 2 * np.pi, count),
        loads=chance.normal(size=(count, LOAD_SIZE)) * 1e4,
        wind=np.zeros(3),
    )


def is_told(kind, data):
    """Of every byte whether the definition of the message gives it a meaning; what stands in gaps is left to chance."""
    name = f"{kind.__module__.split('.')[0]}/msg/{kind.__name__}"
    root = name.replace("/msg/", "/")
    text = message_definition(name, lambda package, place: Path(get_package_share_directory(package)) / place)
    layout = Layout(parse(root, text), root, data)
    reported = np.zeros(len(data), bool)
    for form, offset in layout._formats.values():
        reported[offset : offset + np.dtype(form).itemsize] = True
    return reported


def assert_same_bytes(data, message):
    own, ros = np.frombuffer(data, np.uint8), np.frombuffer(serialize_message(message), np.uint8)
    assert len(own) == len(ros)
    reported = is_told(type(message), data)
    assert reported.mean() > 0.8
    np.testing.assert_array_equal(own[reported], ros[reported])
    assert deserialize_message(data, type(message)) == message


@pytest.mark.parametrize("name", AIRCRAFT)
def test_states_are_those_that_ros_serialises(name):
    aircraft, chance = AIRCRAFT[name](), np.random.default_rng(1)
    messages, states = StateMessages(aircraft), StateBytes(aircraft)
    for _ in range(3):
        now = snapshot(aircraft, chance)
        messages.fill(now)
        states.fill(now)
        for topic, kind in KINDS.items():
            message = getattr(messages, topic)
            assert type(message) is kind
            assert_same_bytes(states.data(topic), message)


def test_what_was_given_away_stays_when_the_next_instant_comes():
    aircraft, chance = build(), np.random.default_rng(1)
    states = StateBytes(aircraft)
    states.fill(snapshot(aircraft, chance))
    given = states.data("state")
    before = bytearray(given)
    states.fill(snapshot(aircraft, chance))
    assert given == before
    assert states.data("state") != before


@pytest.mark.parametrize("name", AIRCRAFT)
def test_angles_of_blades_are_those_of_the_multiblade_coordinates(name):
    aircraft = AIRCRAFT[name]()
    now, messages = snapshot(aircraft, np.random.default_rng(2)), StateMessages(aircraft)
    now = dataclasses.replace(now, state=np.random.default_rng(2).normal(size=aircraft.layout.size))
    messages.fill(now)
    for rotor, (flap, lag) in zip(messages.rotors.rotors, blade_angles(aircraft, now), strict=True):
        np.testing.assert_allclose(rotor.blade_flap, flap, rtol=0, atol=1e-14)
        np.testing.assert_allclose(rotor.blade_lag, lag, rtol=0, atol=1e-14)


def status(chance, rotors, fault="", log="bags/ü.mcap", warnings=()):
    message = SimulationStatus(fault=fault, log=log, warnings=list(warnings))
    message.header.stamp.sec, message.header.stamp.nanosec = 2**31 - 1, 999_999_999
    message.state = int(chance.integers(2))
    message.sim_time, message.real_time_factor = chance.uniform(0.0, 1e6, 2).tolist()
    for name in ("missed_deadlines", "steps", "dropped_messages", "rejected_messages", "log_dropped"):
        setattr(message, name, int(chance.integers(2**64 - 1, dtype=np.uint64)))
    for _ in range(rotors):
        numbers = zip(("advance_ratio", "descent_ratio", "tip_mach"), chance.normal(size=3).tolist(), strict=True)
        shares = zip(("stalled_share", "reversed_share", "outside_share"), chance.uniform(size=3).tolist(), strict=True)
        message.working_states.append(WorkingState(inflow_state=int(chance.integers(5)), **dict([*numbers, *shares])))
    return message


def test_a_status_is_the_one_that_ros_serialises_whatever_its_texts():
    chance, refusals = np.random.default_rng(1), []
    made = StatusBytes(refusals.append)
    for turn in range(30):  # more texts than are kept
        for rotors in (1, 2, 4):
            for warnings in ((), ("MR1: stall",), ("MR1: stall", "x" * (turn % 80))):
                message = status(chance, rotors, fault="f" * (turn % 7), warnings=warnings)
                data = made.data(message)
                assert deserialize_message(data, SimulationStatus) == message
                assert len(data) == len(serialize_message(message))
    assert_same_bytes(made.data(message), message)
    assert refusals == []


def big_endian(message):
    """As a ROS on another processor writes it; the numbers need not be right for it to be refused."""
    return b"\x00\x00" + serialize_message(message)[2:]


def four_more(message):
    """Numbers at other offsets than multiples of their size."""
    data = serialize_message(message)
    return data[:4] + bytes(4) + data[4:]


@pytest.mark.parametrize(
    ("other", "reason"),
    [
        (big_endian, "BodyState: messages begin 00 00 00 00, 00 01 00 00 is understood"),
        (four_more, "is at 0 offsets of the serialised message, 1 is understood"),
    ],
)
def test_messages_with_another_layout_are_serialised_by_ros_and_reported(monkeypatch, other, reason):
    aircraft = build()
    chance = np.random.default_rng(1)
    now, messages, lines = snapshot(aircraft, chance), StateMessages(aircraft), []
    messages.fill(now)
    known = {type(message): copy.deepcopy(message) for message in (StateMessages(aircraft).state, status(chance, 2))}
    with monkeypatch.context() as patch:
        patch.setattr(templates, "serialize_message", other)
        patch.setattr(templates, "deserialize_message", lambda _, kind: known[kind])
        states, made = states_of(aircraft, lines.append), StatusBytes(lines.append)
        message = status(chance, 2)
        for _ in range(2):
            assert_same_bytes(made.data(message), message)
    assert len(lines) == 2
    assert reason in lines[0]
    assert all("\n" not in line for line in lines)
    states.fill(now)
    for topic in TOPICS:
        assert_same_bytes(states.data(topic), getattr(messages, topic))


def test_a_number_that_is_there_twice_is_refused(monkeypatch):
    def twice(message):
        data = serialize_message(message)
        return data + data[4:]

    monkeypatch.setattr(templates, "serialize_message", twice)
    monkeypatch.setattr(templates, "deserialize_message", lambda data, kind: kind())
    with pytest.raises(LayoutError, match=r"^Vector3: x is at 2 offsets"):
        Template(Vector3(), {"x": DOUBLE})


def test_an_offset_that_ros_does_not_read_is_refused(monkeypatch):
    monkeypatch.setattr(templates, "deserialize_message", lambda data, kind: kind())
    with pytest.raises(LayoutError, match=r"^Vector3: ROS does not read what was written into its bytes$"):
        Template(Vector3(), {"x": DOUBLE})
