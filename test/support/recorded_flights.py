"""Flights of real processes that leave a log."""

import itertools
import math
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
from nav_msgs.msg import Odometry
from ros_harness import (
    DOMAINS,
    EXECUTABLES,
    PATIENCE,
    controls_message,
    environment,
    world,
)
from rosgraph_msgs.msg import Clock

from sbs_msgs.msg import (
    BodyState,
    InflowArray,
    RotorStateArray,
    SimulationStatus,
)
from sbs_sim.recording import read
from sbs_sim.recording.recorded_flight import flight_of
from sbs_sim.recording.verification import verify

DEGREE = math.radians(1.0)
HOVER_STEP = Path(__file__).resolve().parents[2] / "bags" / "hover_step.mcap"
STATE_TOPICS = {"state": BodyState, "rotors": RotorStateArray, "inflow": InflowArray, "odom": Odometry, "/clock": Clock}


def replay(*arguments, domain=1, **variables):
    """Run the executable to its end, with further variables of the environment: it may have to compile."""
    command = [sys.executable, str(EXECUTABLES / "replay"), *map(str, arguments)]
    found = {**environment(domain), **variables}
    return subprocess.run(command, capture_output=True, text=True, timeout=600, check=False, env=found)


def fly(tmp_path, act, **parameters):
    """Path of the log of a flight during which something was done."""
    path = tmp_path / "flight.mcap"
    with world(next(DOMAINS), tmp_path) as made:
        made.client.watch("state", BodyState)
        made.client.watch("status", SimulationStatus)
        simulator = made.start("simulator", record=path, **parameters)
        made.client.next("status")
        act(made)
        assert simulator.interrupt() == 0, simulator.output
    return path


def wiggle(made, hover, seconds=0.5):
    """Fly with moving controls, that long on the clock of the wall and that of the simulation: machines are busy."""
    if "status" not in made.client.messages:
        made.client.watch("status", SimulationStatus)
    flown = made.client.next("status").sim_time + seconds
    end = time.monotonic() + seconds
    for i in itertools.count():
        if time.monotonic() > end and made.client.messages["status"][-1].sim_time >= flown:
            return
        assert time.monotonic() < end + PATIENCE, "the simulation stands"
        change = DEGREE * np.sin(0.3 * i + np.arange(4))
        made.client.publish("controls", controls_message(hover.controls + change))
        made.client.spin(0.01)


def assert_identical(path):
    found = verify(flight_of(read(path)))
    assert found.identical, found
    assert found.states > 20
