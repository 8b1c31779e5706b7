"""A flight can be flown again, bit for bit, from the events that acted on it."""

import math
import threading
import time

import numpy as np
import pytest
from test_flight_loop import AS_FAST_AS_READ, flying, wait_until

from sbs_sim import Simulation
from sbs_sim.errors import SimulationError
from sbs_sim.flight.records import Event
from sbs_sim.flight.refly import refly
from sbs_sim.flight.trimmed_state import trimmed_state
from sbs_sim.model.wind import Wind

TURBULENCE = Wind(velocity=(3.0, 1.0, 0.0), turbulence_intensity=(1.0, 1.0, 0.5), turbulence_seed=7)


def simulation(aircraft, point, **options):
    return Simulation(aircraft, trimmed_state(aircraft, point), point.swashplate, **options)


def all_events(reader):
    return [event for report in reader.reports for event in report.events]


def assert_flown_again(aircraft, reader, **options):
    """Every snapshot that was handed out is met again, in order and bit for bit."""
    expected = reader.snapshots()
    again = refly(aircraft, all_events(reader), expected[-1].step, **options)
    met = 0
    for snapshot in again:
        if met < len(expected) and snapshot.step == expected[met].step:
            same = snapshot.state.tobytes() == expected[met].state.tobytes()
            met += same and snapshot.loads.tobytes() == expected[met].loads.tobytes()
    assert met == len(expected)


def commands(point, count, seed):
    rng = np.random.default_rng(seed)
    for _ in range(count):
        yield point.swashplate + rng.uniform(-0.02, 0.02, point.swashplate.shape)


def test_commands_wind_and_resets_are_flown_again(sbs, hover):
    flight = simulation(sbs, hover, wind=TURBULENCE)
    with flying(flight, real_time_factor=AS_FAST_AS_READ) as (loop, reader):
        for i, command in enumerate(commands(hover, 40, 1)):
            loop.command(command)
            before = loop.time
            wait_until(lambda before=before: loop.time > before + 0.02)
            if i % 13 == 5:
                loop.set_wind(lambda _, i=i: Wind(gust=(0.0, 2.0, 1.0), gust_duration=0.3, turbulence_seed=i))
            if i % 17 == 9:
                loop.reset(trimmed_state(sbs, hover, heading=0.1 * i), hover.swashplate)
    kinds = {event.kind for event in all_events(reader)}
    assert kinds == {"start", "swashplate", "wind", "reset"}
    assert_flown_again(sbs, reader)


def test_pause_and_single_ticks_are_flown_again(sbs, hover):
    with flying(simulation(sbs, hover), real_time_factor=AS_FAST_AS_READ) as (loop, reader):
        wait_until(lambda: loop.time > 0.05)
        loop.pause(True)
        for command in commands(hover, 5, 2):
            loop.command(command)
            loop.step(3)
        loop.pause(False)
        now = loop.time
        wait_until(lambda: loop.time > now + 0.05)
    assert_flown_again(sbs, reader)


def test_a_fault_and_its_cure_are_flown_again(sbs, hover):
    """The tick of the fault ends in its middle; everything after it is off the grid of ticks, there and here."""
    with flying(simulation(sbs, hover), real_time_factor=AS_FAST_AS_READ) as (loop, reader):
        wild = trimmed_state(sbs, hover)
        wild[sbs.layout.flap_rate(0)] = 900.0
        loop.reset(wild, hover.swashplate)
        wait_until(lambda: reader.newest().fault)
        loop.set_wind(lambda _: TURBULENCE)
        loop.reset(trimmed_state(sbs, hover), hover.swashplate)
        loop.pause(False)
        now = loop.time
        wait_until(lambda: loop.time > now + 0.1)
    assert_flown_again(sbs, reader)


def test_no_event_is_lost_with_dropped_reports(sbs, hover):
    """A reader that sleeps loses states, not commands."""
    with flying(simulation(sbs, hover), reading=False, real_time_factor=1000.0) as (loop, reader):
        sent = 0
        for command in commands(hover, 20, 3):
            before = loop.time
            loop.command(command)
            wait_until(lambda before=before: loop.time > before + 0.1)
            sent += 1
        reader.start()
        wait_until(lambda: reader.reports and reader.newest().dropped > 0)
        before = loop.time
        wait_until(lambda: loop.time > before + 0.1)
    reader.join(20.0)
    assert reader.newest().dropped > 0
    assert [event.kind for event in all_events(reader)].count("swashplate") == sent
    assert_flown_again(sbs, reader)


def test_nothing_is_lost_at_the_end_of_a_flight_that_is_faster_than_its_reader(sbs, hover):
    """Reports wait when the loop is stopped, and the reader is still there."""
    with flying(simulation(sbs, hover), delay=0.005, real_time_factor=AS_FAST_AS_READ) as (loop, reader):
        for command in commands(hover, 20, 6):
            loop.command(command)
            before = loop.time
            wait_until(lambda before=before: loop.time > before + 0.02)
        wait_until(loop.reports.qsize)
    steps = [snapshot.step for snapshot in reader.snapshots()]
    assert set(np.diff(steps)) == {steps[-1] - steps[-2]}
    assert_flown_again(sbs, reader)


OPTIONS = [
    {"azimuth_step": math.radians(2.0)},
    {"method": "partitioned", "azimuth_step": math.radians(5.0)},
    {"lead_lag": False},
]


@pytest.mark.parametrize("options", OPTIONS)
def test_options_decide_the_result(sbs, hover, options):
    with flying(simulation(sbs, hover, **options), real_time_factor=AS_FAST_AS_READ) as (loop, reader):
        for command in commands(hover, 5, 4):
            loop.command(command)
            before = loop.time
            wait_until(lambda before=before: loop.time > before + 0.03)
    assert_flown_again(sbs, reader, **options)


def test_load_on_the_machine_decides_nothing(sbs, hover):
    """Commands that come when they come take effect at ticks, and the ticks are in the events."""
    stop = threading.Event()

    def burn():
        while not stop.is_set():
            math.factorial(500)

    burners = [threading.Thread(target=burn, daemon=True) for _ in range(4)]
    for burner in burners:
        burner.start()
    try:
        with flying(simulation(sbs, hover, wind=TURBULENCE), real_time_factor=3.0) as (loop, reader):
            for command in commands(hover, 20, 5):
                loop.command(command)
                time.sleep(0.01)
    finally:
        stop.set()
        for burner in burners:
            burner.join()
    assert_flown_again(sbs, reader)


def test_what_was_normalised_stays_as_it_is(sbs, hover):
    """Else a state that went through a log would come back with other bits."""
    rng = np.random.default_rng(6)
    flight = simulation(sbs, hover)
    for _ in range(200):
        state = trimmed_state(sbs, hover, heading=rng.uniform(-3, 3))
        state[3:7] += rng.normal(size=4) * 0.1
        once = flight.checked_state(state)
        assert flight.checked_state(once).tobytes() == once.tobytes()


def test_events_must_begin_with_the_start(sbs, hover):
    with pytest.raises(SimulationError, match="the first must be the start"):
        next(refly(sbs, [Event(0, "swashplate", swashplate=hover.swashplate)], 10))


def test_a_fault_without_cure_is_reported(sbs, hover):
    wild = trimmed_state(sbs, hover)
    wild[sbs.layout.flap_rate(0)] = 900.0
    with pytest.raises(SimulationError, match="would take"):
        list(refly(sbs, [Event(0, "start", hover.swashplate, wild, Wind())], 100))
