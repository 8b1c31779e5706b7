"""A real simulator whose aircraft stands on the ground, takes off, and is put there again; its log flies again."""

import json

import numpy as np
import pytest
from helpers import aircraft_data

rclpy = pytest.importorskip("rclpy")

from recorded_flights import assert_identical, fly  # noqa: E402

from sbs_msgs.msg import BodyState, Controls  # noqa: E402
from sbs_msgs.srv import Reset  # noqa: E402
from sbs_sim import Aircraft  # noqa: E402
from sbs_sim.recording import read  # noqa: E402
from sbs_sim.recording.recorded_flight import flight_of  # noqa: E402

WEIGHT = 20.62 * 9.80665
HIGH = 0.18  # rad, collective that lifts it off the ground


def standing(tmp_path):
    """Path of the side-by-side helicopter on its skids, on ground 1 m above the origin."""
    data = aircraft_data(options={"elements": 8})
    data["ground"] = {"contact": "contact", "altitude": 1.0}
    path = tmp_path / "standing.yaml"
    path.write_text(json.dumps(data))
    return path


def test_an_aircraft_stands_lifts_off_and_stands_again(tmp_path):
    """Forces in `state` carry the weight; `reset` puts it elsewhere on the ground; every bit comes again."""
    path = standing(tmp_path)

    def act(made):
        client = made.client
        client.watch("state", BodyState)
        state = client.next("state", lambda message: message.header.stamp.nanosec > 300_000_000)
        assert sum(point.force.z for point in state.contacts) == pytest.approx(-WEIGHT, rel=1e-3)
        assert all(point.depth == pytest.approx(0.0101, abs=2e-4) for point in state.contacts)
        refused = client.call(Reset, "reset", on_ground=True, airspeed=5.0)
        assert refused.message == "airspeed = 5: allowed is 0 for an aircraft on the ground"
        client.publish("controls", Controls(collective=HIGH))
        client.next("state", lambda message: message.position.z < -1.33)
        assert client.call(Reset, "reset", on_ground=True, heading=0.5).success
        client.publish("controls", Controls())
        client.next("state", lambda message: message.position.z > -1.295)

    log = fly(tmp_path, act, aircraft=path, on_ground=True)
    assert_identical(log)
    recorded = read(log)
    flight = flight_of(recorded)
    first = flight.states[0]
    np.testing.assert_allclose(first[:3], [0.0, 0.0, -1.0 - 0.3 + WEIGHT / 20000.0], atol=1e-6)
    force = recorded["state"]["contacts[3].force.z"]
    assert force.min() < -40.0
    assert (force == 0.0).any(), "it has left the ground"
    assert Aircraft.load(path).layout.names[-1] == "contact_y(4)"
