"""Take-off and landing in real processes: simulator and hover hold, targets as other tools publish them."""

import json

import pytest
from helpers import aircraft_data

rclpy = pytest.importorskip("rclpy")

from geometry_msgs.msg import PoseStamped  # noqa: E402
from ros_harness import DOMAINS, world  # noqa: E402

from sbs_msgs.msg import BodyState, Controls  # noqa: E402

WEIGHT = 20.62 * 9.80665


def target(down):
    message = PoseStamped()
    message.header.frame_id = "ned"
    message.pose.position.z = down
    message.pose.orientation.w = 1.0
    return message


def carried(state):
    """Force of the ground against body z [N]."""
    return -sum(point.force.z for point in state.contacts)


def test_a_target_above_lifts_it_off_and_one_on_the_ground_sets_it_down(tmp_path):
    data = aircraft_data(options={"elements": 8})
    data["ground"] = {"contact": "contact", "effect": "measured", "altitude": -1.5}
    path = tmp_path / "standing.yaml"
    path.write_text(json.dumps(data))
    with world(next(DOMAINS), tmp_path) as made:
        client = made.client
        client.watch("state", BodyState)
        client.watch("controls", Controls)
        made.start("simulator", record="off", aircraft=path, on_ground=True)
        hold = made.start("hover_hold")
        client.next("controls", lambda message: message.collective == 0.0)
        assert carried(client.next("state")) == pytest.approx(WEIGHT, rel=1e-3)
        client.publish_until("target", target(0.9), "state", lambda state: carried(state) < 0.5 * WEIGHT)
        client.next("state", lambda state: carried(state) == 0.0 and state.position.z < 1.1)
        client.publish("target", target(1.5))
        client.next("state", lambda state: carried(state) > 0.98 * WEIGHT)
        client.next("controls", lambda message: message.collective == 0.0)
        client.until(lambda: "settling" in hold.output and hold.output.count("standing") == 2, "it stands again")
