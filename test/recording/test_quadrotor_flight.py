"""The quadrotor over ROS: sticks act on throttles through the mixer node, and the log comes again bit for bit."""

import numpy as np
import pytest

rclpy = pytest.importorskip("rclpy")

from recorded_flights import assert_identical, fly, wiggle  # noqa: E402

from sbs_msgs.msg import RotorStateArray, SwashplateArray  # noqa: E402
from sbs_sim import Aircraft, trim  # noqa: E402
from sbs_sim.recording import read  # noqa: E402
from sbs_sim.recording.recorded_flight import flight_of  # noqa: E402


def test_sticks_act_on_throttles_and_the_log_comes_again(tmp_path):
    """The mixer's throttles are those of the library to the last bit, and the speeds follow them."""
    aircraft = Aircraft.load("quadrotor")
    hover = trim(aircraft)

    def act(made):
        client = made.client
        client.watch("rotors", RotorStateArray)
        swashplates = client.watch("swashplate", SwashplateArray)
        wiggle(made, hover, 0.3)
        message = swashplates[-1]
        assert [len(message.rotors), len(message.drives)] == [4, 4]
        speeds = [drive.speed for drive in client.next("rotors").drives]
        assert np.ptp(speeds) > 1.0
        np.testing.assert_allclose(speeds, hover["Omega(1)"], rtol=0.3)

    log = fly(tmp_path, act, aircraft="quadrotor")
    assert_identical(log)
    flight = flight_of(read(log))
    assert read(log).metadata["simulation"]["method"] == "tsit5"  # the default with drives
    commands = {event.step: event.swashplate for event in flight.events if event.kind == "swashplate"}
    assert len(commands) > 10
    mixed = {aircraft.mix(row).tobytes() for row in controls_of(read(log))}
    assert {angles.tobytes() for angles in commands.values()} <= mixed


def controls_of(log):
    """Recorded pilot controls, shape (n, 4)."""
    names = ("collective", "lateral_cyclic", "longitudinal_cyclic", "differential_longitudinal_cyclic")
    return np.stack([log["controls"][name] for name in names], axis=1)
