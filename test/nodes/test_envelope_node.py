"""The envelope controller as a node: velocity commands and targets, in a real simulator."""

import math
import re

import pytest

rclpy = pytest.importorskip("rclpy")

from geometry_msgs.msg import PoseStamped, TwistStamped  # noqa: E402
from ros_harness import DOMAINS, world  # noqa: E402

from sbs_msgs.msg import BodyState, Controls  # noqa: E402
from sbs_sim import linearize  # noqa: E402
from sbs_sim.errors import PilotError  # noqa: E402
from sbs_sim.nodes.pilot_conversions import to_velocity  # noqa: E402
from sbs_sim.pilot.envelope import design_envelope  # noqa: E402
from sbs_sim.pilot.envelope_file import save_envelope  # noqa: E402


def twist(frame="base_link", linear=(0.0, 0.0, 0.0), turn=0.0, roll=0.0):
    message = TwistStamped()
    message.header.frame_id = frame
    message.twist.linear.x, message.twist.linear.y, message.twist.linear.z = linear
    message.twist.angular.x, message.twist.angular.z = roll, turn
    return message


def test_a_twist_has_the_axes_of_ros():
    assert to_velocity(twist(linear=(1.0, 2.0, 3.0), turn=0.5)) == (1.0, -2.0, -3.0, -0.5)


@pytest.mark.parametrize(
    ("message", "text"),
    [
        (twist("odom"), "frame_id = 'odom': allowed is 'base_link'"),
        (twist(linear=(math.nan, 0.0, 0.0)), "linear.x = nan: allowed are finite numbers"),
        (twist(roll=0.1), "angular.x = 0.1: allowed is 0"),
    ],
)
def test_what_is_no_velocity_is_refused_by_name(message, text):
    with pytest.raises(PilotError, match=re.escape(text)):
        to_velocity(message)


def test_it_follows_velocities_and_targets(sbs, tmp_path):
    """Forward; what is refused moves nothing; it brakes when the commands end, and goes to a target."""
    gains = tmp_path / "gains.yaml"
    save_envelope(design_envelope(sbs, [linearize(sbs, airspeed=speed) for speed in (0.0, 10.0)]), gains)
    with world(next(DOMAINS), tmp_path) as made:
        client = made.client
        client.watch("state", BodyState)
        client.watch("controls", Controls)
        made.start("simulator", record="off")
        node = made.start("hover_hold", gains=str(gains))
        client.next("controls")
        client.publish("cmd_vel", twist("map"))
        client.until(lambda: "cmd_vel rejected: frame_id = 'map'" in node.output, "a warning")
        for _ in range(40):
            client.publish("cmd_vel", twist(linear=(3.0, 0.0, 0.0)))
            client.spin(0.2)
            if client.messages["state"][-1].velocity.x > 2.0:
                break
        client.next("state", lambda state: state.velocity.x > 2.0)
        client.next("state", lambda state: abs(state.velocity.x) < 0.2)
        assert "no cmd_vel for 1 s: holding the present position" in node.output
        north = client.messages["state"][-1].position.x
        goal = PoseStamped()
        goal.header.frame_id = "ned"
        goal.pose.position.x, goal.pose.position.z, goal.pose.orientation.w = north, -1.0, 1.0
        client.publish("target", goal)
        client.next("state", lambda state: abs(state.position.z + 1.0) < 0.1 and abs(state.velocity.z) < 0.1)
        assert node.interrupt() == 0, node.output
