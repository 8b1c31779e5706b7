"""A real simulator whose blades have circulation that follows the flow; its log flies again, to the last bit."""

import json

import numpy as np
import pytest
from helpers import aircraft_data

rclpy = pytest.importorskip("rclpy")

from recorded_flights import assert_identical, fly  # noqa: E402

from sbs_msgs.msg import Controls, InflowArray  # noqa: E402
from sbs_sim.recording import read  # noqa: E402
from sbs_sim.recording.recorded_flight import flight_of  # noqa: E402


def test_the_parts_of_the_circulation_are_recorded_and_come_again(tmp_path):
    late = {"unsteady_airfoil": "jones", "dynamic_stall": "leishman_beddoes"}
    data = aircraft_data(options={"elements": 8}, rotors=[{}, late])
    path = tmp_path / "late.yaml"
    path.write_text(json.dumps(data))

    def act(made):
        client = made.client
        client.watch("inflow", InflowArray)
        assert len(client.next("inflow").sections) == 64
        inflow = client.next("inflow", lambda message: message.header.stamp.nanosec > 200_000_000)
        assert [len(rotor.wake) for rotor in inflow.rotors] == [0, 3]
        assert inflow.rotors[1].wake[0].slow == pytest.approx(inflow.rotors[1].wake[0].fast, rel=0.01)
        client.publish("controls", Controls())
        client.next("inflow", lambda message: message.rotors[1].wake[0].slow < 0.03)

    log = fly(tmp_path, act, aircraft=path)
    assert_identical(log)
    recorded = read(log)
    states = flight_of(recorded).states
    parts = [recorded["inflow"][f"rotors[1].wake[0].{name}"] for name in ("slow", "fast")]
    assert states.shape[1] == 13 + 24 + 6 + 6 + 4 * 8 * 8
    assert np.isin(states[:, 43], parts[0]).all(), "the slow one of the collective coordinate"
    tip = recorded["inflow"]["sections[60].attached_share"]  # of the first blade of the second rotor
    assert tip.min() < tip.max() <= 1.0
    assert np.isin(states[:, 49 + 60], tip).all()
    pressure = recorded["inflow"]["sections[60].pressure_lift"]
    assert pressure.max() > 0.2
    assert np.isin(states[:, 49 + 64 + 60], pressure).all()
    first = np.flatnonzero(parts[1] < 0.03)[0]
    assert parts[1][first] < parts[0][first], "the fast one is ahead"
