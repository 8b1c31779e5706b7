"""A flight with drives over ROS: speeds are published, an engine fails, and the log comes again bit for bit."""

import json

import numpy as np
import pytest
from helpers import aircraft_data

rclpy = pytest.importorskip("rclpy")

from recorded_flights import assert_identical, fly, wiggle  # noqa: E402

from sbs_msgs.msg import FlightEvent, RotorStateArray  # noqa: E402
from sbs_msgs.srv import EngineFailure, Reset  # noqa: E402
from sbs_sim import Aircraft, trim  # noqa: E402
from sbs_sim.recording import read  # noqa: E402
from sbs_sim.recording.recorded_flight import flight_of  # noqa: E402

DRIVES = [
    {
        "rotors": ["R1", "R2"],
        "inertia": 0.02,
        "engine": {"kind": "engine", "max_torque": 16.0, "lag": 0.05},
        "governor": {"proportional_gain": 5.0, "integral_gain": 2.0},
    }
]


def test_an_engine_failure_comes_again_bit_for_bit(tmp_path):
    """The service slows the rotors down, refuses what is not there, and is an event of the log."""
    path = tmp_path / "driven.yaml"
    path.write_text(json.dumps(aircraft_data() | {"drives": DRIVES}))
    aircraft = Aircraft.load(path)
    point = trim(aircraft)
    seen = {}

    def act(made):
        client = made.client
        client.watch("rotors", RotorStateArray)
        events = client.watch("events", FlightEvent, latched=True)
        wiggle(made, point, 0.3)
        seen["before"] = client.next("rotors").rotors[0].speed
        refused = client.call(EngineFailure, "engine_failure", drive=2)
        assert (refused.success, refused.message) == (False, "engine of drive 2: allowed are 1")
        refused = client.call(EngineFailure, "engine_failure", failure=-0.5)
        assert not refused.success
        assert refused.message.startswith("failure = -0.5: allowed are 0 to 1")
        assert client.call(EngineFailure, "engine_failure", failure=0.5).success
        assert client.call(EngineFailure, "engine_failure").success
        slower = client.next("rotors", lambda message: message.rotors[0].speed < 0.9 * point["Omega(1)"])
        assert slower.rotors[1].speed == pytest.approx(slower.drives[0].speed)
        assert slower.drives[0].engine_failure == 1.0
        failures = [(event.drive, event.failure) for event in events if event.kind == FlightEvent.ENGINE_FAILURE]
        assert failures == [(1, 0.5), (1, 1.0)]
        assert client.call(Reset, "reset").success
        client.next(
            "rotors", lambda message: message.drives[0].engine_failure == 0.0 and message.drives[0].speed > 250.0
        )

    log = fly(tmp_path, act, aircraft=path, method="rk4")
    assert seen["before"] == pytest.approx(point["Omega(1)"], rel=0.02)
    assert_identical(log)
    flight = flight_of(read(log))
    speeds = flight.states[:, flight.aircraft.layout.drive(0)["Omega"]]
    assert speeds.min() < 0.9 * point["Omega(1)"] < speeds[0]
    assert [event.failure for event in flight.events if event.kind == "engine_failure"] == [0.5, 1.0]
    rotors = read(log)["rotors"]
    np.testing.assert_array_equal(rotors["rotors[0].power"], rotors["rotors[0].torque"] * rotors["rotors[0].speed"])
