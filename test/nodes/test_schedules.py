"""Events at the borders of ticks: what the flight loop hands out, what is recorded of it, and what comes again."""

import collections
import sys
from pathlib import Path

import numpy as np
import pytest

rclpy = pytest.importorskip("rclpy")

from foreign_logs import edit  # noqa: E402
from rclpy.signals import SignalHandlerOptions  # noqa: E402
from ros_harness import DOMAINS  # noqa: E402
from test_flight_loop import AS_FAST_AS_READ, flying, wait_until  # noqa: E402

from sbs_sim import Simulation  # noqa: E402
from sbs_sim.errors import SimulationError  # noqa: E402
from sbs_sim.recording import read  # noqa: E402
from sbs_sim.recording.recorded_flight import flight_of  # noqa: E402
from sbs_sim.recording.verification import verify  # noqa: E402

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tools" / "robustness"))
import schedules  # noqa: E402

OF_SNAPSHOTS = ("/state", "/rotors", "/inflow", "/odom")


def test_random_schedules_come_again(capsys):
    """A sample of tools/robustness/schedules.py; docs/robustness.md has thousands."""
    assert schedules.main(["--flights", "10", "--first", "5", "--domain", str(next(DOMAINS))]) == 0, capsys.readouterr()
    shown = capsys.readouterr().out
    assert "10 flights in" in shown
    assert "contacts at the border of a tick" in shown


def test_a_fault_before_the_first_step_of_a_tick_hands_out_no_state_again(sbs, hover):
    """The ground is touched in the first step after a tick: the state of that instant is known already."""
    state = schedules.state("sink", 1e-6)
    flight = Simulation(sbs, state, hover.swashplate, ground_altitude=schedules.GROUND)
    with flying(flight, real_time_factor=AS_FAST_AS_READ) as (_, reader):
        wait_until(lambda: reader.newest().fault)
        assert "ground contact after step 0 " in reader.newest().fault
    assert len(reader.snapshots()) == 1


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """Log of a flight that touched the ground at the border of a tick, was reset twenty times there, and flew on."""
    folder = tmp_path_factory.mktemp("recorded")
    rclpy.init(domain_id=next(DOMAINS), signal_handler_options=SignalHandlerOptions.NO)
    flight = schedules.Flight(0, 0, folder, collections.Counter())
    loop = flight.loop
    with flight.flying(recorded=True):
        loop.reset(schedules.state("sink", 1e-6), schedules.TRIMS["sink"].swashplate)
        with pytest.raises(SimulationError, match="ground contact"):
            loop.step(1)
        for i in range(20):
            loop.reset(schedules.state("fast", 30.0 + i), schedules.TRIMS["fast"].swashplate)
        for _ in range(3):
            loop.step(1)
    rclpy.shutdown()
    return folder / "1.mcap"


def instants(path):
    """Steps of the recorded states, and the place of the first one that was reset to."""
    flight = flight_of(read(path))
    found = verify(flight)
    assert found.identical, found
    _, places, counts = np.unique(flight.steps, return_index=True, return_counts=True)
    return flight.steps, places[counts.argmax()]


def test_twenty_resets_of_one_instant_come_again(recorded):
    steps, place = instants(recorded)
    # the tick before, the reset to the ground, and the others; then three more
    assert (steps[place : place + 22] == steps[place]).all()
    assert len(steps) == place + 22 + 3


def test_a_state_that_was_recorded_twice_comes_again(recorded, tmp_path):
    """As by older versions: once more when the ground was touched."""
    steps, place = instants(recorded)

    def copies(topic, number):
        return 2 if topic in OF_SNAPSHOTS and number == place + 2 else 1

    path = edit(tmp_path / "double.mcap", recorded, copies, lambda count, own: count)
    assert len(instants(path)[0]) == len(steps) + 1


@pytest.mark.parametrize("numbers", ["own", "none"])
@pytest.mark.parametrize("lost", ["/state", "/inflow"])
def test_a_message_that_is_missing_at_a_reset_mixes_no_others(recorded, tmp_path, numbers, lost):
    """What belongs together is known by the numbers; where there are none, the instant is left out."""
    steps, place = instants(recorded)

    def copies(topic, number):
        return 0 if topic == lost and number == place + 5 else 1

    number = (lambda count, own: own) if numbers == "own" else (lambda count, own: 0)
    path = edit(tmp_path / "less.mcap", recorded, copies, number)
    assert len(instants(path)[0]) == len(steps) - (1 if numbers == "own" else 22)
