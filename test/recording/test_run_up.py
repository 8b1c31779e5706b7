"""Rotors that begin at rest, in a real simulator: a run-up on a stand, once more by the service, and the log of it."""

import json

import numpy as np
import pytest
from helpers import aircraft_data

rclpy = pytest.importorskip("rclpy")

from recorded_flights import assert_identical, fly  # noqa: E402
from ros_harness import DOMAINS, world  # noqa: E402

from sbs_msgs.msg import RotorStateArray, SimulationStatus  # noqa: E402
from sbs_msgs.srv import Reset  # noqa: E402
from sbs_sim import Aircraft, trim  # noqa: E402
from sbs_sim.errors import SimulationError  # noqa: E402
from sbs_sim.flight.trimmed_state import trimmed_state  # noqa: E402
from sbs_sim.recording import read  # noqa: E402
from sbs_sim.recording.recorded_flight import flight_of  # noqa: E402

DRIVE = {
    "rotors": ["R1", "R2"],
    "inertia": 0.02,
    "engine": {"kind": "engine", "max_torque": 16.0, "lag": 0.05},
    "governor": {"proportional_gain": 5.0, "integral_gain": 2.0},
}


STOP = {"range_deg": [-15.0, 15.0], "stiffness": 400.0, "damping": 1.0}


def standing(tmp_path):
    """Path of an aircraft file: two rotors on a locked hub, with a drive, their lag hinges free between stops."""
    data = aircraft_data(options={"elements": 8}, every_rotor={"lag_stop": STOP})
    data["body"]["stand"] = {"free": []}
    path = tmp_path / "standing.yaml"
    path.write_text(json.dumps(data | {"drives": [DRIVE]}))
    return path


def test_a_run_up_on_a_stand_and_once_more_by_the_service(tmp_path):
    """From rest to the set point of the governor, without a move of the hub; then from half the speed; bit for bit."""
    path = standing(tmp_path)
    aircraft = Aircraft.load(path)
    speed = aircraft.drive_speed(0)

    def act(made):
        client = made.client
        client.watch("rotors", RotorStateArray)
        client.next("rotors", lambda message: message.drives[0].speed > 0.97 * speed)
        refused = client.call(Reset, "reset", turn_rate=1.0)
        said = "turn_rate = 1: allowed is 0 on a stand that is free in no axis"
        assert (refused.success, refused.message) == (False, said)
        refused = client.call(Reset, "reset", rotor_speed=2.0)
        assert refused.message == "rotor_speed = 2.0: allowed are 0 to 1.5"
        assert client.call(Reset, "reset", rotor_speed=0.5).success
        client.next("rotors", lambda message: 0.45 * speed < message.drives[0].speed < 0.6 * speed)

    log = fly(tmp_path, act, aircraft=path, rotor_speed=0.0, real_time_factor=3.0)
    assert_identical(log)
    flight = flight_of(read(log))
    places = aircraft.layout.drive(0)
    begun = [event.state for event in flight.events if event.state is not None]
    np.testing.assert_allclose([state[places["Omega"]] for state in begun], [0.0, 0.5 * speed], rtol=1e-9)
    rest = trim(aircraft)  # where stands begin
    for state, share in zip(begun, (0.0, 0.5), strict=True):
        np.testing.assert_allclose(state, trimmed_state(aircraft, rest, rotor_speed=share), rtol=1e-6, atol=1e-9)
    np.testing.assert_array_equal(flight.states[:, :13], flight.states[0, :13] * np.ones((len(flight.states), 1)))
    lag = np.degrees(flight.states[:, aircraft.layout.lag(0).start])
    assert 15.0 < lag.max() < 18.0  # against the stop while the torque is large
    assert abs(lag[-1]) < 10.0  # and off it by the speed


def test_rotors_of_constant_speed_do_not_start_at_rest(tmp_path, sbs):
    """One line, and no flight."""
    with pytest.raises(SimulationError, match="rotor_speed = 0: allowed is 1 for rotors without drives"):
        trimmed_state(sbs, trim(sbs), rotor_speed=0.0)
    with world(next(DOMAINS), tmp_path) as made:
        made.client.watch("status", SimulationStatus)
        refused = made.start("simulator", record="off", rotor_speed=0.0)
        assert refused.wait() != 0
        assert "rotor_speed = 0: allowed is 1 for rotors without drives" in refused.output
