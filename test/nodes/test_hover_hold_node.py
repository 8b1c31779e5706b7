"""The hover hold as a node: real processes, a real simulator, targets as other tools publish them."""

import math
import re

import numpy as np
import pytest

rclpy = pytest.importorskip("rclpy")

from diagnostic_msgs.msg import DiagnosticArray  # noqa: E402
from geometry_msgs.msg import PoseStamped  # noqa: E402
from ros_harness import DOMAINS, world  # noqa: E402
from std_srvs.srv import SetBool  # noqa: E402

from sbs_msgs.msg import BodyState, Controls, FlightEvent, SimulationStatus  # noqa: E402
from sbs_msgs.srv import Reset, SetWind  # noqa: E402
from sbs_sim.errors import PilotError  # noqa: E402
from sbs_sim.model.frames import euler_to_quaternion, quaternion_to_euler  # noqa: E402
from sbs_sim.nodes.pilot_conversions import check_event, to_target  # noqa: E402


@pytest.fixture(scope="module")
def flight(tmp_path_factory):
    """A simulator with a hover hold, and a client."""
    with world(next(DOMAINS), tmp_path_factory.mktemp("hover_hold")) as made:
        made.client.watch("state", BodyState)
        made.client.watch("controls", Controls)
        made.client.watch("status", SimulationStatus)
        made.simulator = start_simulator(made)
        made.hold = made.start("hover_hold")
        made.client.next("controls")
        yield made


def start_simulator(made):
    return made.start("simulator", record="off")


@pytest.fixture
def client(flight):
    """The client; whatever it does, the hover hold goes on."""
    yield flight.client
    flight.client.next("controls")


def pose(frame, place, quaternion):
    message = PoseStamped()
    message.header.frame_id = frame
    message.pose.position.x, message.pose.position.y, message.pose.position.z = (float(value) for value in place)
    q = message.pose.orientation
    q.w, q.x, q.y, q.z = (float(value) for value in quaternion)
    return message


def place_of(state):
    return np.array([state.position.x, state.position.y, state.position.z])


def heading_of(state):
    q = state.attitude
    return quaternion_to_euler((q.w, q.x, q.y, q.z))[0]


def at(place, heading=0.0, within=0.1):
    """Condition of a state: at rest at a place."""

    def check(state):
        v = state.velocity
        return (
            np.linalg.norm(place_of(state) - place) < within
            and math.hypot(v.x, v.y, v.z) < 0.1
            and abs(math.remainder(heading_of(state) - heading, 2.0 * math.pi)) < 0.05
        )

    return check


def test_its_diagnostics_have_the_time_of_the_flight(client):
    client.watch("diagnostics", DiagnosticArray)
    health = client.next("diagnostics", lambda array: array.status[0].name == "hover_hold" and stamp(array) > 0.0)
    assert stamp(health) <= stamp(client.next("state"))  # without a stamp viewers find them stale


def stamp(message):
    return message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec


def test_it_prints_its_design(flight):
    for part in ("gains, u = u_trim - K x", "poles of the design", "with all 38 states", "all at once"):
        assert part in flight.hold.output


def test_it_goes_to_a_target_in_the_axes_of_ros_and_holds_it_in_wind(client):
    """1 m east, 2 m north, 1 m up, looking east: in ENU that is no turn at all."""
    wind = SetWind.Request().velocity
    wind.x, wind.y = -3.0, 2.0
    assert client.call(SetWind, "set_wind", velocity=wind).success
    client.publish("target", pose("odom", (1.0, 2.0, 1.0), (1.0, 0.0, 0.0, 0.0)))
    client.next("state", at((2.0, 1.0, -1.0), math.pi / 2))
    assert client.call(SetWind, "set_wind").success


def test_a_pose_in_ned_is_the_target_itself():
    place, heading = to_target(pose("ned", (1.0, 2.0, -3.0), euler_to_quaternion(2.5, 0.05, -0.05)))
    np.testing.assert_array_equal(place, [1.0, 2.0, -3.0])
    assert heading == pytest.approx(2.5, abs=1e-12)


def test_a_pose_in_enu_is_turned():
    """A yaw of REP 103 grows from east to north."""
    place, heading = to_target(pose("odom", (1.0, 2.0, 3.0), (math.cos(0.1), 0.0, 0.0, math.sin(0.1))))
    np.testing.assert_array_equal(place, [2.0, 1.0, -3.0])
    assert heading == pytest.approx(math.pi / 2 - 0.2, abs=1e-12)


@pytest.mark.parametrize(
    ("message", "text"),
    [
        (pose("", (0, 0, 0), (1, 0, 0, 0)), "frame_id = '': allowed are 'ned', 'odom'"),
        (pose("odom", (0, math.nan, 0), (1, 0, 0, 0)), "position.y = nan: allowed are finite numbers"),
        (pose("ned", (0, 0, 0), (math.inf, 0, 0, 0)), "orientation.w = inf: allowed are finite numbers"),
        (pose("ned", (0, 0, 0), (0, 0, 0, 0)), "orientation has a norm of 0: allowed is a unit quaternion"),
        (pose("ned", (0, 0, 0), euler_to_quaternion(0, 0.5, 0)), "orientation is tilted by 28.6 deg"),
    ],
)
def test_what_is_no_target_is_refused_by_name(message, text):
    with pytest.raises(PilotError, match=re.escape(text)):
        to_target(message)


@pytest.mark.parametrize(
    ("message", "text"),
    [
        (pose("map", (20, 0, 0), (1, 0, 0, 0)), "target rejected: frame_id = 'map': allowed are 'ned', 'odom'"),
        (pose("ned", (150, 0, 0), (1, 0, 0, 0)), "m: allowed are 0 to 100 m"),
    ],
)
def test_a_refused_target_is_reported_and_moves_nothing(flight, client, message, text):
    before = place_of(client.next("state"))
    client.spin(1.1)  # such warnings come once a second
    client.publish("target", message)
    client.until(lambda: text in flight.hold.output, text)
    assert np.linalg.norm(place_of(client.next("state")) - before) < 2.0


BAD_EVENTS = {
    "a NaN in a state": {"kind": "reset", "state": [math.nan] * 43},
    "half a state": {"kind": "start", "state": [0.0, 0.0, 0.0, 1.0]},
    "no attitude": {"kind": "reset", "state": [0.0] * 43},
    "an infinite angle": {"kind": "swashplate", "swashplate": [math.inf] * 6},
}


@pytest.mark.parametrize("given", BAD_EVENTS.values(), ids=BAD_EVENTS)
def test_no_pilot_begins_from_an_event_that_is_none(given):
    with pytest.raises(PilotError, match="allowed"):
        check_event(FlightEvent(**given))


def test_after_a_reset_it_stays_where_it_was_put(client):
    request = Reset.Request(heading=-1.0)
    request.position.x, request.position.z = 50.0, -20.0
    assert client.call(Reset, "reset", position=request.position, heading=-1.0).success
    arrived = client.next("state", lambda state: state.position.x > 40.0)
    late = arrived.header.stamp.sec + 2
    state = client.next("state", lambda state: state.header.stamp.sec >= late)
    assert at((50.0, 0.0, -20.0), -1.0)(state)


def test_a_pause_changes_nothing(client):
    assert client.call(SetBool, "pause", data=True).success
    client.spin(0.8)  # longer than states may be missing
    assert client.call(SetBool, "pause", data=False).success
    end = client.messages["state"][-1].header.stamp.sec + 1
    seen = len(client.messages["state"])
    client.next("state", lambda state: state.header.stamp.sec > end)
    assert all(at((50.0, 0.0, -20.0), -1.0)(state) for state in client.messages["state"][seen:])


def test_it_says_that_states_are_missing_and_takes_the_next_flight(flight):
    """The simulator goes and comes again: the place is another, time begins anew."""
    warning = "no state for 0.5 s: the last controls stay"
    earlier = flight.hold.output.count(warning)  # on a busy machine
    flight.simulator.interrupt()
    flight.client.until(lambda: flight.hold.output.count(warning) > earlier, "a warning")
    flight.simulator = start_simulator(flight)
    state = flight.client.next("state", lambda state: 2 <= state.header.stamp.sec < 5)  # the old flight was longer
    assert at((0.0, 0.0, 0.0))(state)


def test_ctrl_c_ends_it(flight):
    assert flight.hold.interrupt() == 0
    assert "Traceback" not in flight.hold.output


def test_while_there_is_no_simulator_it_says_what_it_waits_for(tmp_path):
    with world(next(DOMAINS), tmp_path) as made:
        process = made.start("hover_hold", remaps=["__ns:=/left"])
        line = f"waiting for /left/linearize in ROS_DOMAIN_ID {made.domain}: is a simulator running there?"
        made.client.until(lambda: process.output.count(line) == 2, "two lines")
        assert process.interrupt() == 0, process.output


def test_without_a_simulator_it_ends_with_one_line(tmp_path):
    with world(next(DOMAINS), tmp_path) as made:
        process = made.start("hover_hold", patience=1.0)
        assert process.wait() == 1
        assert process.output.splitlines()[-1] == "no service linearize within 1 s: is a simulator running?"


@pytest.mark.parametrize(
    ("name", "value", "allowed"),
    [
        ("patience", 0.0, "1 to 3600"),
        ("position_limit", "nan", "0.05 to 10"),
        ("largest_distance", 1e6, "0.1 to 100000"),
    ],
)
def test_a_parameter_out_of_range_is_one_line(tmp_path, name, value, allowed):
    with world(next(DOMAINS), tmp_path) as made:
        process = made.start("hover_hold", **{name: f".{value}" if value == "nan" else value})
        assert process.wait() == 1
        assert process.output.splitlines() == [f"parameter {name} = {value}: allowed are {allowed}"]
