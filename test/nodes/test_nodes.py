"""The nodes as a user meets them: real processes, real DDS on loopback."""

import json
import math
import re
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

rclpy = pytest.importorskip("rclpy")

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus  # noqa: E402
from geometry_msgs.msg import Point, Vector3  # noqa: E402
from helpers import renamed_data  # noqa: E402
from nav_msgs.msg import Odometry  # noqa: E402
from rcl_interfaces.srv import GetParameters, SetParametersAtomically  # noqa: E402
from rclpy.parameter import Parameter  # noqa: E402
from ros_harness import (  # noqa: E402
    DOMAINS,
    EXECUTABLES,
    PATIENCE,
    Client,
    controls_message,
    environment,
    swashplate_message,
    world,
)
from rosgraph_msgs.msg import Clock  # noqa: E402
from scipy.spatial.transform import Rotation  # noqa: E402
from std_srvs.srv import SetBool  # noqa: E402

from sbs_msgs.msg import (  # noqa: E402
    BodyState,
    Controls,
    ControlValues,
    InflowArray,
    RotorStateArray,
    SimulationStatus,
    SwashplateArray,
    WorkingState,
)
from sbs_msgs.srv import Reset, SetWind, Step, Trim  # noqa: E402
from sbs_sim import Aircraft, trim  # noqa: E402
from sbs_sim.nodes.qos import SERVICE_QOS  # noqa: E402
from sbs_sim.recording import read  # noqa: E402

TOPICS = {
    "state": BodyState,
    "rotors": RotorStateArray,
    "inflow": InflowArray,
    "odom": Odometry,
    "/clock": Clock,
    "status": SimulationStatus,
    "diagnostics": DiagnosticArray,
    "swashplate": SwashplateArray,
}
DEGREE = math.radians(1.0)


@pytest.fixture(scope="module")
def hover():
    return trim(Aircraft.load("sbs"))


@pytest.fixture(scope="module")
def flight(tmp_path_factory):
    """A simulator with its mixer, in flight, and a client that watches every topic."""
    with world(next(DOMAINS), tmp_path_factory.mktemp("flight")) as made:
        for topic, kind in TOPICS.items():
            made.client.watch(topic, kind)
        made.simulator = made.start("simulator")
        made.client.next("state")
        yield made


@pytest.fixture
def client(flight):
    """The client, with the aircraft playing in trimmed hover at the origin."""
    call = flight.client.call
    assert call(SetBool, "pause", data=True).success
    assert call(SetWind, "set_wind").success
    assert call(Reset, "reset").success
    _, hovering = stepped(flight.client, 1)  # what was published before that has come now
    assert np.abs([*vector(hovering.velocity), *body_rates(hovering)]).max() < 1e-3
    assert call(SetBool, "pause", data=False).success
    return flight.client


@pytest.fixture
def own_world(tmp_path):
    with world(next(DOMAINS), tmp_path) as made:
        yield made


def vector(message):
    return np.array([message.x, message.y, message.z])


def body_rates(state):
    return vector(state.angular_velocity)


def stamp(message):
    return message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec


def stepped(client, ticks):
    """Time [s] and state after so many ticks of a flight that is paused."""
    answer = client.call(Step, "step", ticks=ticks)
    assert answer.success
    states = client.messages["state"]  # the last tick may have come before the answer
    client.until(lambda: stamp(states[-1]) == pytest.approx(answer.sim_time, abs=2e-9), "the last tick")
    return answer.sim_time, states[-1]


def status_of(array, name):
    return next((status for status in array.status if status.name == name), None)


# --- in flight --------------------------------------------------------------------------------------------------


def test_hovers_and_publishes_everything(client):
    messages = {topic: client.next(topic) for topic in TOPICS if topic != "swashplate"}
    state, rotors = messages["state"], messages["rotors"]
    assert state.header.frame_id == "ned"
    np.testing.assert_allclose(vector(state.velocity), 0.0, atol=1e-6)
    np.testing.assert_allclose(vector(state.acceleration), 0.0, atol=1e-6)
    weight = 20.62 * 9.80665
    assert sum(rotor.thrust for rotor in rotors.rotors) == pytest.approx(weight, rel=1e-3)
    assert len(rotors.rotors) == 2
    for rotor in rotors.rotors:
        assert rotor.speed == pytest.approx(2400 * math.pi / 30)
        assert rotor.power == pytest.approx(rotor.torque * rotor.speed)
        assert 0 <= rotor.azimuth < 2 * math.pi
        for name in ("flap", "flap_rate", "lag", "lag_rate", "blade_flap", "blade_lag"):
            assert len(getattr(rotor, name)) == 3
        # the blades of a hovering rotor all cone alike, and lag behind their hinges under drag
        np.testing.assert_allclose(rotor.blade_flap, rotor.flap[0], atol=1e-6)
        assert rotor.flap[0] > 0
        assert rotor.lag[0] > 0
        # the rotor hangs the aircraft: the hub force is thrust minus the blades' weight, upwards
        assert rotor.hub.force.z == pytest.approx(-rotor.thrust + 3 * 0.1613 * 9.80665, rel=1e-3)
    for inflow in messages["inflow"].rotors:
        # momentum theory: lambda0 = sqrt(C_T / 2)
        thrust_coefficient = weight / 2 / (1.225 * math.pi * 0.505**2 * (251.327 * 0.505) ** 2)
        assert inflow.uniform == pytest.approx(math.sqrt(thrust_coefficient / 2), rel=1e-3)
    assert messages["status"].state == SimulationStatus.PLAYING
    assert messages["status"].fault == ""
    client.next("diagnostics", lambda m: (s := status_of(m, "simulator")) and s.level == DiagnosticStatus.OK)
    client.next("diagnostics", lambda m: status_of(m, "control_mixer"))


def test_every_tick_is_published_once_with_its_time(client):
    client.next("state")
    first = len(client.messages["state"])
    client.until(lambda: len(client.messages["state"]) > first + 100, "a hundred states")
    times = [stamp(message) for message in client.messages["state"][first:]]
    np.testing.assert_allclose(np.diff(times), 0.01, atol=2e-9)


def test_odom_is_the_same_motion_in_ros_axes(client):
    request = {"airspeed": 8.0, "heading": 0.7, "position": Point(x=3.0, y=5.0, z=-20.0), "turn_rate": 0.2}
    assert client.call(Reset, "reset", **request).success
    state = client.next("state", lambda m: m.position.z < -19)
    # Of a later time: at that of the reset there are two, one of before it.
    odom = client.next("odom", lambda m: stamp(m) > stamp(state))
    states = client.messages["state"]
    client.until(lambda: stamp(states[-1]) >= stamp(odom), "the state of the odometry")
    state = next(m for m in reversed(states) if stamp(m) == stamp(odom))
    assert (odom.header.frame_id, odom.child_frame_id) == ("odom", "base_link")
    to_enu = np.array([[0.0, 1, 0], [1, 0, 0], [0, 0, -1]])  # north east down to east north up
    to_flu = np.diag([1.0, -1, -1])
    q = state.attitude
    ned_frd = Rotation.from_quat([q.x, q.y, q.z, q.w]).as_matrix()
    q = odom.pose.pose.orientation
    enu_flu = Rotation.from_quat([q.x, q.y, q.z, q.w]).as_matrix()
    np.testing.assert_allclose(enu_flu, to_enu @ ned_frd @ to_flu, atol=1e-12)
    np.testing.assert_allclose(vector(odom.pose.pose.position), to_enu @ vector(state.position), atol=1e-12)
    np.testing.assert_allclose(vector(odom.twist.twist.linear), to_flu @ vector(state.velocity), atol=1e-12)
    np.testing.assert_allclose(vector(odom.twist.twist.angular), to_flu @ body_rates(state), atol=1e-12)
    # 8 m/s on heading 0.7: north and east, as commanded
    np.testing.assert_allclose((ned_frd @ vector(state.velocity))[2], 0.0, atol=0.05)


# Signs from the definitions, not from a run. Collective: up is -z. Longitudinal cyclic: positive is push, nose down and
# forward (paper, section 2.2). Lateral cyclic: pitch falls by A1s G cos(psi + phase), so with the rigging of sbs.yaml
# (phase near -72 deg) the outer side of the right rotor and the inner side of the left one lose lift: roll to
# the right. Differential: the right rotor tilts forward, the left one back: the nose goes left.
@pytest.mark.parametrize(
    ("control", "read", "sign"),
    [
        (0, lambda m: m.velocity.z, -1),
        (1, lambda m: m.angular_velocity.x, +1),
        (2, lambda m: m.angular_velocity.y, -1),
        (3, lambda m: m.angular_velocity.z, -1),
    ],
)
def test_a_step_of_each_control_moves_its_axis(client, hover, control, read, sign):
    wanted = hover.controls.copy()
    wanted[control] += DEGREE
    state = client.publish_until("controls", controls_message(wanted), "state", lambda m: abs(read(m)) > 0.05)
    values = np.array([state.velocity.z, *body_rates(state)])
    assert sign * read(state) > 0
    assert np.argmax(np.abs(values)) == control


def test_pause_step_and_play(client):
    assert client.call(SetBool, "pause", data=True).success
    paused = client.next("status", lambda m: m.state == SimulationStatus.PAUSED)
    seventh, _ = stepped(client, 7)
    assert seventh == pytest.approx(paused.sim_time + 0.07, abs=1e-9)
    assert not client.call(Step, "step", ticks=0).success
    eighth, _ = stepped(client, 1)
    assert eighth == pytest.approx(seventh + 0.01, abs=1e-9)  # the refusal has moved nothing
    client.next("status", lambda m: m.sim_time == pytest.approx(eighth))
    assert client.call(SetBool, "pause", data=False).success
    client.next("state", lambda m: stamp(m) > eighth + 0.05)
    refused = client.call(Step, "step", ticks=1)
    assert not refused.success
    assert "paused" in refused.message


def test_reset_to_a_condition_and_to_a_state(client):
    assert client.call(Reset, "reset", airspeed=12.0, climb_rate=1.0).success
    state = client.next("state", lambda m: m.velocity.x > 10)
    assert np.linalg.norm(vector(state.velocity)) == pytest.approx(math.hypot(12, 1), abs=0.05)
    layout = Aircraft.load("sbs").layout
    values = np.zeros(layout.size)
    values[:13] = [1, 2, -30, 2, 0, 0, 0, 0.5, 0, 0, 0, 0, 0]  # a quaternion of norm 2 is normalised
    assert client.call(Reset, "reset", from_state=True, state=values.tolist()).success
    state = client.next("state", lambda m: m.position.z < -29)
    assert state.attitude.w == pytest.approx(1.0, abs=1e-3)


def test_wind_moves_the_aircraft_and_a_gust_passes(client):
    assert client.call(SetBool, "pause", data=True).success
    answer = client.call(SetWind, "set_wind", gust=Vector3(z=-4.0), gust_duration=0.5)
    assert (answer.success, answer.message) == (True, "wind set: a gust of 4 m/s")
    _, risen = stepped(client, 60)
    assert risen.velocity.z < -0.1  # air that goes up takes the aircraft along
    answer = client.call(
        SetWind, "set_wind", velocity=Vector3(x=5.0), turbulence_intensity=Vector3(x=1.0, y=1.0, z=0.5)
    )
    assert answer.success
    said = r"wind set: 5 m/s, turbulence \(dryden, point\) of up to 1 m/s, passing at (4\.9\d*|5\S*) m/s"
    assert re.fullmatch(said, answer.message), answer.message
    _, state = stepped(client, 100)
    assert state.velocity.x > 0.05
    forgotten = client.call(SetWind, "set_wind", turbulence_length=20.0)
    assert (forgotten.success, forgotten.message) == (True, "wind set: still air")


@pytest.mark.parametrize(
    ("name", "kind", "request_fields", "said"),
    [
        ("reset", Reset, {"airspeed": math.nan}, "airspeed = nan"),
        ("reset", Reset, {"airspeed": 1e9}, "airspeed = 1000000000.0: allowed are -100 to 100 m/s"),
        ("reset", Reset, {"airspeed": 95.0}, "no trim"),
        ("reset", Reset, {"heading": math.inf}, "heading"),
        ("reset", Reset, {"position": Point(x=math.nan)}, "north = nan"),
        ("reset", Reset, {"from_state": True, "state": [0.0] * 3}, "3 values"),
        ("reset", Reset, {"state": [0.0] * 43}, "state: 43 values, allowed with from_state = true only"),
        (
            "reset",
            Reset,
            {"from_state": True, "state": [0.0] * 43, "turn_rate": 0.1},
            "turn_rate = 0.1: not allowed with from_state = true, the state has its own",
        ),
        (
            "reset",
            Reset,
            {"from_state": True, "position": Point(z=-5.0)},
            "position.z = -5: not allowed with from_state",
        ),
        ("set_wind", SetWind, {"gust": Vector3(z=-4.0)}, "gust_duration = 0, gust_length = 0: allowed is one of them"),
        ("reset", Reset, {"from_state": True, "state": [0.0] * 43}, "attitude has a norm of 0"),
        (
            "reset",
            Reset,
            {"from_state": True, "state": [0.0, 0, 0, 1] + [0.0] * 5 + [math.nan] + [0.0] * 33},
            "w = nan",
        ),
        ("set_wind", SetWind, {"velocity": Vector3(x=math.nan)}, "velocity.x = nan"),
        (
            "set_wind",
            SetWind,
            {"velocity": Vector3(y=500.0)},
            "velocity.y = 500.0: allowed are -100 to 100 m/s",
        ),
        ("set_wind", SetWind, {"gust_duration": -1.0}, "gust_duration = -1.0"),
        (
            "set_wind",
            SetWind,
            {"turbulence_extent": "field", "turbulence_length": 0.01},
            "turbulence_length = 0.01: allowed are 0, which is 50 m, and 0.1 to 10000 m",
        ),
        (
            "set_wind",
            SetWind,
            {"own_gust_csv": "time [s],north [m/s],east [m/s],down [m/s]\n0,0,0,0\n\n1,0,200,0"},
            "own_gust_csv, line 4: east [m/s] = 200.0: allowed are -100 to 100",
        ),
        ("set_wind", SetWind, {"turbulence_intensity": Vector3(z=-1.0)}, "turbulence_intensity.z = -1.0"),
        ("step", Step, {"ticks": 1001}, "ticks = 1001: allowed are integers from 1 to 1000"),
        ("step", Step, {"ticks": 4294967295}, "ticks = 4294967295: allowed are integers from 1 to"),
    ],
)
def test_bad_requests_are_refused_and_change_nothing(client, name, kind, request_fields, said):
    answer = client.call(kind, name, **request_fields)
    assert not answer.success
    assert said in answer.message
    assert "\n" not in answer.message
    state = client.next("state")
    np.testing.assert_allclose(vector(state.velocity), 0.0, atol=1e-3)


@pytest.mark.parametrize(
    ("topic", "message", "node"),
    [
        ("controls", controls_message([math.nan, 0, 0, 0]), "control_mixer"),
        ("controls", controls_message([0.1, math.inf, 0, 0]), "control_mixer"),
        ("controls", controls_message([0.1, 0, 1e6, 0]), "control_mixer"),
        ("swashplate", swashplate_message([[math.nan, 0, 0]] * 2), "simulator"),
        ("swashplate", swashplate_message([[0.1, 0, 0]] * 3), "simulator"),
        ("swashplate", swashplate_message([[0.1, 2.0, 0]] * 2), "simulator"),
        ("swashplate", swashplate_message([]), "simulator"),
    ],
)
def test_bad_commands_are_refused_and_change_nothing(client, topic, message, node):
    def rejected(array):
        status = status_of(array, node)
        return status and next(int(v.value) for v in status.values if v.key == "rejected_messages")

    before = rejected(client.next("diagnostics", lambda m: status_of(m, node)))
    client.publish(topic, message)
    client.next("diagnostics", lambda m: (rejected(m) or 0) > before)
    np.testing.assert_allclose(vector(client.next("state").velocity), 0.0, atol=1e-3)


def test_parameters_are_set_together_or_not_at_all(client):
    request = [Parameter("real_time_factor", value=0.2), Parameter("command_timeout", value=math.nan)]
    answer = client.call(
        SetParametersAtomically,
        "simulator/set_parameters_atomically",
        parameters=[parameter.to_parameter_msg() for parameter in request],
    )
    assert not answer.result.successful
    assert answer.result.reason == "Parameter command_timeout out of range Min: 0.0, Max: 1000000.0, value: nan"
    client.spin(1.5)
    client.next("status", lambda m: m.real_time_factor > 0.5)  # and not the 0.2 that came along


def test_an_old_command_is_held_and_reported(flight, client, hover):
    def warned(array):
        status = status_of(array, "simulator")
        return status and status.level == DiagnosticStatus.WARN and "timed out" in status.message

    climb = controls_message(hover.controls + [DEGREE, 0, 0, 0])
    moved = client.publish_until("controls", climb, "state", lambda m: m.velocity.z < -0.05)
    client.next("diagnostics", warned)
    assert "holding the last one" in flight.simulator.output
    assert client.next("state", lambda m: stamp(m) > stamp(moved) + 0.5).velocity.z < -0.1
    client.publish_until("controls", climb, "diagnostics", lambda m: status_of(m, "simulator") and not warned(m))


def test_the_mixer_clips_says_so_once_and_follows_the_paper(flight, client):
    for _ in range(3):
        client.publish("controls", controls_message([1.0, 0.0, 0.02, 0.01]))
        client.spin(0.05)
    limit = "collective at its limit of 20 deg"
    array = client.next("diagnostics", lambda m: (s := status_of(m, "control_mixer")) and limit in s.message)
    assert status_of(array, "control_mixer").level == DiagnosticStatus.WARN
    assert flight.simulator.output.count(f"clipped: {limit}") == 1
    # section 2.1.1: B1s(1) = B1s - dB1s, B1s(2) = B1s + dB1s; it takes a moment, for the collective the longest
    moved = client.publish_until(
        "controls",
        controls_message([1.0, 0.0, 0.02, 0.01]),
        "swashplate",
        lambda m: m.rotors[0].collective == pytest.approx(math.radians(20.0)),
    )
    assert moved.rotors[0].longitudinal_cyclic == pytest.approx(0.01)
    assert moved.rotors[1].longitudinal_cyclic == pytest.approx(0.03)


def test_a_burst_of_requests_is_answered_to_the_last(flight, client):
    """They wait while others are answered, and the answers wait for who is slow to look."""
    service = client.node.create_client(SetWind, "set_wind", qos_profile=SERVICE_QOS)
    client.until(service.service_is_ready, "set_wind")
    calm = client.next("status")
    answers = [service.call_async(SetWind.Request(velocity=Vector3(x=0.01 * i))) for i in range(200)]
    time.sleep(0.5)
    client.until(lambda: all(answer.done() for answer in answers), "200 answers")
    assert all(answer.result().success for answer in answers)
    assert client.next("status").steps > calm.steps


def test_a_fault_pauses_and_a_reset_cures_it(flight, client):
    values = np.zeros(43)
    values[3], values[0], values[7] = 1.0, 1e8 - 0.01, 300.0  # about to leave the plausible, whatever the rotors do
    assert client.call(Reset, "reset", from_state=True, state=values.tolist()).success
    faulty = client.next("status", lambda m: m.fault)
    assert faulty.state == SimulationStatus.PAUSED
    step, name = re.match(r"step (\d+) \(t = [\d.]+ s\) would take (\S+) to ", faulty.fault).groups()
    assert int(step) == faulty.steps + 1
    assert name == Aircraft.load("sbs").layout.names[0]
    assert np.isfinite(vector(client.messages["state"][-1].velocity)).all()
    refused = client.call(SetBool, "pause", data=False)
    assert not refused.success
    assert "reset" in refused.message
    assert client.call(Reset, "reset").success
    assert client.call(SetBool, "pause", data=False).success
    assert client.next("status", lambda m: m.state == SimulationStatus.PLAYING).fault == ""
    assert flight.simulator.running


def test_the_status_says_where_the_model_does_not_hold_and_when_it_does_again(flight, client):
    assert client.call(Reset, "reset").success
    calm = client.next("status", lambda m: len(m.working_states) == 2 and not m.warnings)
    assert [state.inflow_state for state in calm.working_states] == [WorkingState.NORMAL] * 2
    assert client.call(SetWind, "set_wind", velocity=Vector3(z=-7.0)).success
    reported = client.next("status", lambda m: m.warnings)
    assert reported.warnings == [
        f"{name}: vortex ring state, where momentum theory does not hold" for name in ("MR1", "MR2")
    ]
    assert [state.inflow_state for state in reported.working_states] == [WorkingState.VORTEX_RING] * 2
    assert all(0.45 < state.descent_ratio < 1.5 for state in reported.working_states)
    assert all(state.tip_mach == pytest.approx(0.373, abs=0.01) for state in reported.working_states)
    assert all(state.outside_share == 0.0 for state in reported.working_states)
    health = client.next("diagnostics", lambda m: any("vortex ring" in status.message for status in m.status))
    assert health.status[0].level == DiagnosticStatus.WARN
    assert client.call(SetWind, "set_wind").success
    assert client.call(Reset, "reset").success
    client.next("status", lambda m: not m.warnings)


def test_the_ground_ends_a_flight_and_a_reset_flies_on(flight, client):
    assert not client.call(Reset, "reset", position=Point(z=200.0)).success
    assert client.call(Reset, "reset", position=Point(z=99.5)).success
    values = list(Aircraft.load("sbs").layout.names)
    state = np.zeros(len(values))
    state[2], state[3], state[9] = 99.5, 1.0, 5.0  # 5 m/s down, half a metre above it
    assert client.call(Reset, "reset", from_state=True, state=state.tolist()).success
    ended = client.next("status", lambda m: m.fault)
    assert ended.state == SimulationStatus.PAUSED
    assert ended.fault.startswith("ground contact after step ")
    assert ended.fault.endswith("the ground is at -100 m")
    assert client.call(Reset, "reset").success
    assert client.call(SetBool, "pause", data=False).success
    client.next("status", lambda m: m.state == SimulationStatus.PLAYING and m.fault == "")


def test_parameters_can_be_changed_in_flight_and_bad_ones_are_refused(flight, client):
    assert flight.set_parameter("simulator", "real_time_factor", 0.5).successful
    client.next("status", lambda m: 0.3 < m.real_time_factor < 0.7)
    refused = flight.set_parameter("simulator", "real_time_factor", -1.0)
    assert not refused.successful
    assert not flight.set_parameter("simulator", "publish_rate", 50.0).successful  # fixed at the start
    assert flight.set_parameter("simulator", "real_time_factor", 1.0).successful


# --- processes of their own --------------------------------------------------------------------------------------


def test_simulator_and_mixer_in_two_processes(own_world, hover):
    simulator = own_world.start("simulator", components="[simulator]")
    client = own_world.client
    client.watch("state", BodyState)
    client.next("state")
    assert client.node.count_subscribers("controls") == 0
    mixer = own_world.start("control_mixer")
    wanted = hover.controls + [DEGREE, 0, 0, 0]
    client.publish_until("controls", controls_message(wanted), "state", lambda m: m.velocity.z < -0.1)
    assert mixer.interrupt() == 0
    assert simulator.running
    assert simulator.interrupt() == 0


def test_controls_of_other_names_are_commanded_by_name_and_by_axis(own_world, tmp_path):
    """An aircraft with a lever, pedals and a trimmer: what is not named stays, and `controls` moves the four axes."""
    data = renamed_data()
    data["controls"]["lever"] = {"range_deg": [0.0, 20.0], "axis": "heave"}
    for rotor in data["rotors"]:
        rotor["mixing"]["collective"] = {"lever": 1.0}
    path = tmp_path / "renamed.yaml"
    path.write_text(json.dumps(data))
    own_world.start("simulator", aircraft=str(path), record=tmp_path / "a.mcap")
    client = own_world.client
    for topic, kind in (("state", BodyState), ("swashplate", SwashplateArray), ("diagnostics", DiagnosticArray)):
        client.watch(topic, kind)
    client.next("state")
    found = client.call(Trim, "trim")
    values = dict(zip(found.control_names, found.control_values, strict=True))
    assert list(values) == ["pedal", "stick_forward", "stick_right", "lever", "trimmer"]
    assert values["trimmer"] == math.radians(0.5)
    assert found.trim.controls.collective == values["lever"]
    assert found.trim.controls.differential_longitudinal_cyclic == values["pedal"]
    lever = values["lever"] + DEGREE
    message = ControlValues(names=["lever"], values=[lever])
    moved = client.publish_until("control_values", message, "swashplate", lambda m: m.rotors[0].collective > lever)
    np.testing.assert_allclose(moved.rotors[0].lateral_cyclic, found.trim.swashplate[0].lateral_cyclic, atol=1e-9)
    higher = Controls(collective=lever + DEGREE)
    top = lever + 2 * DEGREE - 1e-6  # the constant is one degree
    moved = client.publish_until("controls", higher, "swashplate", lambda m: m.rotors[0].collective > top)
    trimmer = moved.rotors[0].lateral_cyclic - found.trim.swashplate[0].lateral_cyclic + values["stick_right"]
    np.testing.assert_allclose(trimmer, 0.0, atol=1e-9)  # the stick is in the middle, the trimmer where it was
    added = ControlValues(names=["lever"], values=[DEGREE])  # to what is commanded, until it is not renewed
    client.publish_until("excitation", added, "swashplate", lambda m: m.rotors[0].collective > top + 0.9 * DEGREE)
    client.next("swashplate", lambda m: m.rotors[0].collective < top + 0.1 * DEGREE)
    for wrong in (ControlValues(names=["throttle"], values=[0.1]), ControlValues(names=["lever"], values=[0.1, 0.2])):
        before = rejected_messages(client)
        client.publish("control_values", wrong)
        client.next("diagnostics", lambda m, count=before: (rejected_in(m) or 0) > count)
    for topic in ("control_values", "excitation"):
        wrong = ControlValues(names=["lever"], values=[math.nan])
        before = rejected_messages(client)
        client.publish(topic, wrong)
        reported = client.next("diagnostics", lambda m, count=before: (rejected_in(m) or 0) > count)
        reasons = [v.value for v in status_of(reported, "control_mixer").values if v.key == "last_rejection"]
        assert reasons[0].startswith("lever = nan: allowed are")


def rejected_in(message):
    status = status_of(message, "control_mixer")
    return status and next(int(v.value) for v in status.values if v.key == "rejected_messages")


def rejected_messages(client):
    return rejected_in(client.next("diagnostics", lambda m: status_of(m, "control_mixer")))


def test_namespaces_remaps_and_a_name_of_its_own(own_world):
    """Two beside each other: each with its names, its clock and its commands; a new name is that of the first node."""
    left = own_world.start("simulator", remaps=["__ns:=/left", "odom:=truth", "__node:=drone"])
    own_world.start("simulator", remaps=["__ns:=/right"], components="[simulator]", record="off")
    mixer = own_world.start("control_mixer", remaps=["__ns:=/right"])
    client = own_world.client
    kinds = {"/left/state": BodyState, "/left/truth": Odometry, "/left/clock": Clock, "/right/clock": Clock}
    for name, kind in {**kinds, "/right/state": BodyState, "/right/diagnostics": DiagnosticArray}.items():
        client.watch(name, kind)
    for name in kinds:
        client.next(name)
    assert client.node.count_publishers("/clock") == 0
    nodes = sorted(f"{space}/{name}" for name, space in client.node.get_node_names_and_namespaces())
    others = [name for name in nodes if name.startswith("/left/")]
    assert others == ["/left/analysis", "/left/control_mixer", "/left/drone", "/left/recorder"]
    client.call(GetParameters, "/left/drone/get_parameters", names=["airspeed"])
    # a mixer in a process of its own follows the clock of its namespace
    wanted = trim(Aircraft.load("sbs")).controls + [DEGREE, 0, 0, 0]
    client.publish_until("/right/controls", controls_message(wanted), "/right/state", lambda m: m.velocity.z < -0.1)
    reported = client.next("/right/diagnostics", lambda m: stamp(m) > 0.0 and status_of(m, "control_mixer"))
    assert "nobody" not in reported.status[0].message
    assert mixer.running
    assert "too" not in left.output
    assert "same name" not in left.output  # as ROS complains of two nodes of one name


def test_a_second_simulator_on_the_same_names_is_reported(own_world):
    client = own_world.client
    client.watch("diagnostics", DiagnosticArray)
    first = own_world.start("simulator", components="[simulator]", record="off")

    def reported(array, name="simulator"):
        status = status_of(array, name)
        return status and "/simulator publishes /clock, " in status.message

    client.next("diagnostics", lambda m: (s := status_of(m, "simulator")) and s.level == DiagnosticStatus.OK)
    second = own_world.start("simulator", components="[simulator]", record="off")
    array = client.next("diagnostics", reported)
    assert status_of(array, "simulator").level == DiagnosticStatus.WARN
    assert "/state, " in array.status[0].message
    assert "-r __ns:=" in array.status[0].message
    for process in (first, second):  # and each says so once
        client.until(lambda process=process: "/simulator publishes" in process.output, "a line in the log")
        assert process.output.count("/simulator publishes") <= 2  # once more where discovery finds a topic later
    assert second.interrupt() == 0
    client.next("diagnostics", lambda m: (s := status_of(m, "simulator")) and s.level == DiagnosticStatus.OK)


def test_who_comes_to_a_paused_flight_gets_its_present_state(own_world):
    simulator, client = own_world.start("simulator"), own_world.client
    states = client.watch("state", BodyState)
    client.next("state")
    assert client.call(SetBool, "pause", data=True).success
    _, present = stepped(client, 1)
    client.spin(0.3)
    seen = len(states)
    latecomer = Client(own_world.domain, "latecomer")
    try:
        kinds = {"state": BodyState, "rotors": RotorStateArray, "inflow": InflowArray, "odom": Odometry}
        heard = {name: latecomer.watch(name, kind) for name, kind in kinds.items()}
        latecomer.until(lambda: all(heard.values()), "the present state")
        assert {stamp(messages[0]) for messages in heard.values()} == {stamp(present)}
        assert heard["state"][0] == present
        client.spin(2.5)
        again = states[seen:]  # a second time, for who may have missed the first, and that is all
        assert 1 <= len(again) <= 2
        assert all(message == present for message in again)
    finally:
        latecomer.close()
    assert simulator.interrupt() == 0
    (path,) = (own_world.folder / "bags").glob("*.mcap")
    assert (np.diff(read(path)["state"].time_ns) > 0).all()  # it is recorded once


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("pace", [1.0, 0.0])
def test_ends_cleanly(own_world, number, pace):
    process = own_world.start("simulator", real_time_factor=pace)
    own_world.client.watch("state", BodyState)
    own_world.client.next("state")
    assert process.interrupt(number) == 0
    assert "Traceback" not in process.output
    assert "Error" not in process.output


def test_as_fast_as_possible_is_faster_than_real_time(own_world):
    own_world.start("simulator", real_time_factor=0.0)
    client = own_world.client
    states = client.watch("state", BodyState)
    client.watch("status", SimulationStatus)
    status = client.next("status", lambda m: m.sim_time > 5.0 and m.real_time_factor > 1.2)  # however busy the machine
    assert status.dropped_messages == 0
    assert status.missed_deadlines == 0
    client.until(lambda: len(states) > 10, "states")


def test_starts_in_trimmed_forward_flight_with_wind(own_world):
    own_world.start("simulator", airspeed=15, climb_rate=1.0, turn_rate=0.1, wind="[3, 0, 0]", altitude=50)
    client = own_world.client
    client.watch("state", BodyState)
    state = client.next("state")
    q = state.attitude
    ground = Rotation.from_quat([q.x, q.y, q.z, q.w]).apply(vector(state.velocity))
    air = ground - [3.0, 0.0, 0.0]
    assert np.hypot(*air[:2]) == pytest.approx(15.0, abs=0.1)
    assert -air[2] == pytest.approx(1.0, abs=0.1)
    assert state.position.z < -49.0
    assert np.linalg.norm(body_rates(state)) == pytest.approx(0.1, abs=0.02)


@pytest.mark.parametrize(
    ("parameters", "said"),
    [
        ({"aircraft": "nothing"}, "aircraft = 'nothing': allowed are"),
        ({"airspeed": "fast"}, "parameter airspeed = 'fast'"),
        ({"airspeed": 1000.0}, "parameter airspeed = 1000.0: allowed are -100 to 100"),
        ({"publish_rate": 0.0}, "parameter publish_rate = 0.0: allowed are 1 to 10000"),
        ({"components": "[autopilot]"}, "parameter components"),
        ({"components": "[control_mixer]"}, "parameter components"),
        ({"components": "[]"}, "parameter components"),
        (
            {"components": "[simulator]", "record": "a.mcap"},
            "record = 'a.mcap': not allowed without the component recorder",
        ),
        ({"airsped": 3.0}, "parameter airsped: unknown"),
        ({"publish_rate": 1.0, "azimuth_step_deg": 0.01}, "1440000 steps in a tick"),
        ({"wind": "[1.0, 2.0]"}, "parameter wind"),
        ({"wind": "[1, 2, 300]"}, "wind = [1.0, 2.0, 300.0]: allowed are 3 numbers, north, east, down, -100 to 100 "),
        ({"wind": "[1.0, 2.0, .nan]"}, "parameter wind = [1.0, 2.0, nan]"),
        ({"turbulence": "heavy"}, "parameter turbulence = 'heavy': allowed are off, light, moderate, severe"),
        ({"turbulence": "light", "turbulence_model": "gauss"}, "parameter turbulence_model = 'gauss': allowed are"),
        ({"turbulence_extent": "planes"}, "parameter turbulence_extent = 'planes': allowed are point, rates"),
        ({"turbulence_seed": -1}, "parameter turbulence_seed = -1"),
        ({"airspeed": 95.0}, "no trim"),
    ],
)
def test_a_wrong_parameter_stops_the_node_with_one_line(own_world, parameters, said):
    process = own_world.start("simulator", **parameters)
    assert process.wait() == 1
    lines = process.output.strip().splitlines()
    assert len(lines) == 1, process.output
    assert said in lines[0]


def test_a_broken_aircraft_file_stops_every_node_with_one_line(own_world):
    path = own_world.folder / "broken.yaml"
    path.write_text("name: broken\nrotors: []\n")
    for name in ("simulator", "control_mixer", "analysis"):
        process = own_world.start(name, aircraft=str(path))
        assert process.wait() == 1
        assert len(process.output.strip().splitlines()) == 1
        assert "environment" in process.output


def test_controls_message_names_the_pilot_controls():
    assert Controls.get_fields_and_field_types().keys() - {"header"} == {
        "collective",
        "lateral_cyclic",
        "longitudinal_cyclic",
        "differential_longitudinal_cyclic",
    }


def test_nodes_yaml_holds_the_defaults_of_every_parameter():
    from ruamel.yaml import YAML

    from sbs_sim.config_file import config_folder
    from sbs_sim.nodes import analysis, control_mixer, hover_hold, joystick, simulator, teleop

    written = YAML(typ="safe").load((config_folder() / "nodes.yaml").read_text())
    modules = (simulator, control_mixer, analysis, hover_hold, teleop, joystick)
    for module in modules:
        name = module.__name__.rpartition(".")[2]
        declared = {key: parameter.default for key, parameter in module.PARAMETERS.items()}
        assert written[name]["ros__parameters"] == declared


def test_a_command_from_before_a_reset_is_void(client, hover):
    """Paused half way to a new position: the reset's trim is held, whatever was still on its way."""
    assert client.call(SetBool, "pause", data=True).success
    for _ in range(3):
        client.publish("controls", controls_message(hover.controls + [8 * DEGREE, 0, 0, 0]))
        client.spin(0.1)
    assert client.call(Reset, "reset").success
    client.spin(0.3)
    _, state = stepped(client, 20)
    np.testing.assert_allclose(vector(state.velocity), 0.0, atol=1e-6)


def test_the_first_command_after_a_reset_moves_at_the_rate_of_the_actuators(client, hover):
    """120 deg/s; an output may be some milliseconds late, and the next one makes up for it."""
    target = hover.controls + [8 * DEGREE, 0, 0, 0]

    def outputs_to_the_target():
        seen = len(client.messages["swashplate"])
        client.publish_until(
            "controls",
            controls_message(target),
            "swashplate",
            lambda m: m.rotors[0].collective == pytest.approx(target[0]),
        )
        moved = [m.rotors[0].collective for m in client.messages["swashplate"][seen:]]
        return np.diff([hover.controls[0], *moved])

    for _ in range(5):  # on a busy machine outputs are lost: their topic keeps the last one
        steps = outputs_to_the_target()
        if steps[0] == pytest.approx(1.2 * DEGREE, rel=1e-6) and steps.max() < 6 * DEGREE:
            break
        assert client.call(Reset, "reset").success
    else:
        raise AssertionError(f"moved in steps of {np.degrees(steps)} deg")


@pytest.mark.parametrize("delay", [0.0, 0.2, 0.4, 0.7, 1.0])
def test_an_interruption_during_the_start_is_quiet(own_world, delay):
    """From the moment at which our first line runs; before that, the start is Python's own."""
    process = own_world.start("simulator")
    own_world.client.until(lambda: process.catches(signal.SIGTERM), "the first line of the simulator")
    own_world.client.spin(delay)
    assert process.interrupt() == 0
    assert "Traceback" not in process.output


def test_an_interruption_during_a_long_service_does_not_wait_for_it(own_world):
    process = own_world.start("simulator", azimuth_step_deg=0.05)
    client = own_world.client
    client.watch("state", BodyState)
    client.next("state")
    assert client.call(SetBool, "pause", data=True).success
    stepping = client.node.create_client(Step, "step")
    client.until(stepping.service_is_ready, "step")
    stepping.call_async(Step.Request(ticks=1000))  # half a minute of arithmetic
    client.spin(0.5)
    begin = time.monotonic()
    assert process.interrupt() == 0
    assert time.monotonic() - begin < 20.0
    assert "Traceback" not in process.output


INTERRUPTED_IN_THE_LOCK = """
import os, signal, sys, threading
from sbs_sim.nodes.process import run

class Busy(threading.Event):
    def wait(self, timeout=None):
        with self._cond:  # as every wait does for an instant
            os.kill(os.getpid(), signal.SIGINT)
        return super().wait(timeout)

sys.exit(run(lambda: [], ["nothing"], Busy()))
"""


def test_an_interruption_at_any_instant_ends_a_process():
    """A handler that sets the event that is waited for hangs where that one is locked just then."""
    started = subprocess.Popen([sys.executable, "-c", INTERRUPTED_IN_THE_LOCK], env=environment(next(DOMAINS)))
    try:
        assert started.wait(PATIENCE / 2) == 0
    finally:
        started.kill()


def test_an_argument_that_is_not_ours_is_refused():
    command = [sys.executable, str(EXECUTABLES / "simulator"), "--bogus"]
    ended = subprocess.run(command, env=environment(next(DOMAINS)), capture_output=True, text=True, timeout=60)
    assert ended.returncode == 2
    assert ended.stderr.strip() == "unknown argument --bogus: parameters are given as --ros-args -p name:=value"
