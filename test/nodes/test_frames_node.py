"""The node `frames` beside a real simulator: its joints are those of the messages of the flight."""

import importlib.util
import math

import numpy as np
import pytest

rclpy = pytest.importorskip("rclpy")

from builtin_interfaces.msg import Time  # noqa: E402
from ros_harness import DOMAINS, nanoseconds, world  # noqa: E402
from sensor_msgs.msg import JointState  # noqa: E402
from std_msgs.msg import String  # noqa: E402

from sbs_msgs.msg import RotorStateArray  # noqa: E402
from sbs_sim import Aircraft  # noqa: E402
from sbs_sim.nodes.frames import NO_TF, frame_of, quaternion_of  # noqa: E402
from sbs_sim.output.robot import Joint, joint_angles, sensor_joints, urdf  # noqa: E402

AIRCRAFT = Aircraft.load("sbs")


@pytest.fixture(scope="module")
def flight(tmp_path_factory):
    with world(next(DOMAINS), tmp_path_factory.mktemp("frames")) as made:
        made.client.watch("joint_states", JointState)
        made.client.watch("rotors", RotorStateArray)
        made.client.watch("robot_description", String, latched=True)
        made.start("simulator", record="off", components="[simulator, control_mixer]")
        frames = made.start("frames", rate=20.0, **{"imu.position": "[0.1, 0.2, 0.3]"})
        made.client.next("joint_states")
        yield made, frames


def test_joints_are_those_of_the_flight(flight):
    made, _ = flight
    client = made.client
    client.until(lambda: len(client.messages["joint_states"]) > 10, "joint states")
    rotors = {nanoseconds(message): message for message in client.messages["rotors"]}
    pairs = [(one, rotors[nanoseconds(one)]) for one in client.messages["joint_states"] if nanoseconds(one) in rotors]
    assert len(pairs) > 3
    for seen, message in pairs:
        found = dict(zip(seen.name, seen.position, strict=True))
        assert len(found) == 2 * (1 + 3 * 3)
        for rotor, state in zip(AIRCRAFT.rotors, message.rotors, strict=True):
            assert found[f"{rotor.name}_azimuth"] == state.azimuth
            for k in range(rotor.blades):
                assert found[f"{rotor.name}_blade_{k + 1}_flap"] == state.blade_flap[k]
                assert found[f"{rotor.name}_blade_{k + 1}_lag"] == state.blade_lag[k]
    # the mean pitch over a turn is the collective: that of three blades at any instant, without couplings
    pitches = [value for name, value in found.items() if name.endswith("_pitch")]
    assert 3.0 < np.degrees(np.mean(pitches)) < 15.0
    times = np.diff([nanoseconds(one) for one, _ in pairs]) * 1e-9
    assert times.min() > 0.049


def test_the_description_is_there_for_who_comes_late(flight):
    made, frames = flight
    made.client.until(lambda: made.client.messages["robot_description"], "the description")
    assert made.client.messages["robot_description"][0].data == urdf(AIRCRAFT, sensor_joints([0.1, 0.2, 0.3]))
    if importlib.util.find_spec("tf2_msgs") is None:
        assert NO_TF in frames.output


def test_a_flight_of_another_aircraft_is_reported_and_the_node_lives(flight):
    made, _ = flight
    other = made.start("frames", ["joint_states:=other", "robot_description:=other_description"], aircraft="quadrotor")
    made.client.until(lambda: "rotors rejected: the flight has rotors with [3, 3] blades" in other.output, "a warning")
    assert other.interrupt() == 0, other.output


def test_bad_parameters_end_it_with_one_line(flight):
    made, _ = flight
    for name, value in (("rate", 0.0), ("aircraft", "nothing"), ("imu.position", "[0.0, 1.0]")):
        process = made.start("frames", **{name: value})
        assert process.wait() == 1
        assert name in process.output or str(value) in process.output
        assert "Traceback" not in process.output


def test_quaternions_are_those_of_the_axes():
    rng = np.random.default_rng(2)
    for _ in range(200):
        w, x, y, z = given = (lambda q: q / np.linalg.norm(q))(rng.normal(size=4) * rng.choice([1.0, 1e-8], size=4))
        axes = np.array([
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ])  # fmt: skip
        assert abs(np.dot(quaternion_of(axes), given)) == pytest.approx(1.0, abs=1e-12)


def test_a_joint_is_a_frame():
    joint = Joint("j", "continuous", "a", "b", np.array([1.0, 2.0, 3.0]), np.eye(3), np.array([0.0, 0.0, -1.0]))
    made = frame_of(joint, math.pi / 2, Time(sec=3), "left/")
    assert (made.header.frame_id, made.child_frame_id, made.header.stamp.sec) == ("left/a", "left/b", 3)
    at, turn = made.transform.translation, made.transform.rotation
    assert (at.x, at.y, at.z) == (1.0, 2.0, 3.0)
    assert (turn.w, turn.z) == (pytest.approx(math.sqrt(0.5)), pytest.approx(-math.sqrt(0.5)))
    assert joint_angles(AIRCRAFT.rotors[0], 0.5, [0.0] * 3, [0.0] * 3, np.zeros(3))[0] == 0.5
