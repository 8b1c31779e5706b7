"""The flight loop with its real thread: pace, requests from other threads, reports, faults, and the end.

Nothing here depends on how fast the machine is, but for bounds that are orders wide.
"""

import contextlib
import dataclasses
import math
import queue
import sys
import threading
import time

import numpy as np
import pytest

from sbs_sim import Simulation, simulate
from sbs_sim.errors import SimulationError
from sbs_sim.flight.trimmed_state import trimmed_state
from sbs_sim.flight_loop import FAST_LENGTH, QUEUE_LENGTH, FlightLoop
from sbs_sim.model.state import ATTITUDE, VELOCITY
from sbs_sim.model.wind import Wind

PATIENCE = 20.0  # s until something that must happen is given up
AS_FAST_AS_READ = 0.0
HURRIED = 1000.0  # faster than any machine flies


class Reader(threading.Thread):
    """Takes reports until the last, as a publisher does."""

    def __init__(self, loop, delay=0.0):
        super().__init__(daemon=True)
        self.loop, self.delay = loop, delay
        self.reports = []
        self.ended = False

    def run(self):
        while (report := self.loop.reports.get()) is not None:
            self.reports.append(report)
            if self.delay:
                time.sleep(self.delay)
        self.ended = True

    def newest(self):
        return self.reports[-1]

    def state(self):
        """The newest state."""
        return self.snapshots()[-1].state

    def snapshots(self):
        return [report.snapshot for report in self.reports if report.snapshot is not None]


@contextlib.contextmanager
def flying(simulation, reading=True, delay=0.0, **options):
    """A loop in flight, and the reader of its reports."""
    loop = FlightLoop(simulation, **options)
    reader = Reader(loop, delay)
    loop.start()
    try:
        if reading:
            reader.start()
            wait_until(lambda: reader.reports)
        yield loop, reader
    finally:
        loop.stop()
        if reading:
            reader.join(PATIENCE)
            assert reader.ended


def wait_until(condition):
    """Wait for something that must happen."""
    end = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < end, "it did not happen"
        time.sleep(0.002)


def refusal(function, *arguments):
    with pytest.raises(SimulationError) as caught:
        function(*arguments)
    assert "\n" not in str(caught.value)
    return str(caught.value)


@pytest.fixture(scope="module", autouse=True)
def compiled(sbs, hover):
    """Fly once, so that no flight below waits for the compiler."""
    simulate(sbs, hover, hover.controls, 0.01)


@pytest.fixture
def simulation(sbs, hover):
    return Simulation(sbs, trimmed_state(sbs, hover), hover.swashplate)


@pytest.fixture
def falling(sbs):
    """Falls at 100 m/s^2 in vacuum and passes the largest plausible velocity within 0.1 s."""
    air = dataclasses.replace(sbs.environment, air_density=0.0, gravity=100.0)
    aircraft = dataclasses.replace(sbs, environment=air)
    state = np.zeros(aircraft.layout.size)
    state[ATTITUDE] = 1.0
    state[VELOCITY + 2] = 345.0
    return Simulation(aircraft, state, np.zeros((2, 3)))


# -- pace --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("pace", [0.5, 1.0])
def test_flight_keeps_pace_with_the_clock(simulation, pace):
    """Never faster; on a busy machine it is slower for a while."""
    with flying(simulation, real_time_factor=pace) as (_, reader):
        wait_until(lambda: len(reader.reports) > 2)

        def kept():
            started, first = time.monotonic(), reader.newest().time
            time.sleep(1.2)
            flown = (reader.newest().time - first) / (time.monotonic() - started)
            measured = reader.newest().real_time_factor
            assert max(flown, measured) < 1.5 * pace
            return min(flown, measured) > 0.5 * pace

        wait_until(kept)


def test_a_change_of_pace_acts_at_once(simulation):
    with flying(simulation, real_time_factor=1e-5) as (loop, reader):  # a tick every 1000 s
        wait_until(lambda: len(reader.reports) >= 2)
        time.sleep(0.05)
        before = reader.newest().step
        loop.set_pace(HURRIED)
        wait_until(lambda: reader.newest().step > before + 10 * simulation.steps_per_tick)
        loop.set_pace(1e-5)
        loop.set_pace(AS_FAST_AS_READ)
        before = reader.newest().step
        wait_until(lambda: reader.newest().step > before + 10 * simulation.steps_per_tick)


def test_deadlines_that_cannot_be_kept_are_counted_and_time_does_not_jump(simulation):
    with flying(simulation, real_time_factor=HURRIED) as (_, reader):
        wait_until(lambda: reader.newest().missed_deadlines > 20)
        wait_until(lambda: len(reader.snapshots()) > 50)
        reports = list(reader.reports)
    missed = [report.missed_deadlines for report in reports]
    assert missed == sorted(missed)
    dropped = np.diff([report.dropped for report in reports])
    ticks = np.diff([report.step for report in reports]) / simulation.steps_per_tick
    # one tick per report, and one more for each that was dropped before the next
    np.testing.assert_array_equal(ticks, 1 + dropped)


@pytest.mark.parametrize("value", [-0.1, 1000.1, math.nan, math.inf])
def test_a_bad_pace_is_refused(simulation, value):
    line = f"real_time_factor = {value}: allowed are 0 to 1000"
    assert refusal(FlightLoop, simulation, value) == line
    assert refusal(FlightLoop(simulation).set_pace, value) == line


@pytest.mark.parametrize("value", [-0.1, 1e7, math.nan])
def test_a_bad_timeout_is_refused(simulation, value):
    line = f"command_timeout = {value}: allowed are 0 to 1e+06 s"
    assert refusal(FlightLoop, simulation, 1.0, value) == line
    loop = FlightLoop(simulation, command_timeout=0.7)
    assert refusal(loop.set_command_timeout, value) == line
    assert loop.command_timeout == 0.7


# -- reports -----------------------------------------------------------------------------------------


def test_the_first_report_is_of_the_start(simulation):
    with flying(simulation) as (_, reader):
        wait_until(lambda: len(reader.reports) > 3)
        first, second = reader.reports[:2]
    assert (first.step, first.time, first.playing, first.fault) == (0, 0.0, True, "")
    assert first.snapshot is not None
    assert first.snapshot.step == 0
    assert second.step == simulation.steps_per_tick
    assert second.snapshot.time == second.time


@pytest.mark.parametrize("delay", [0.0, 0.002])
def test_as_fast_as_read_loses_no_report(simulation, delay):
    with flying(simulation, delay=delay, real_time_factor=AS_FAST_AS_READ) as (loop, reader):
        wait_until(lambda: len(reader.reports) > 120)
        loop.pause(True)
        loop.pause(False)
        wait_until(lambda: len(reader.reports) > 250)
        reports = list(reader.reports)
    steps = [report.snapshot.step for report in reports if report.snapshot is not None]
    assert steps == list(range(0, len(steps) * simulation.steps_per_tick, simulation.steps_per_tick))
    assert {report.dropped for report in reports} == {0}
    assert {report.missed_deadlines for report in reports} == {0}


def test_the_flight_is_that_of_the_simulation_alone(sbs, hover, simulation):
    with flying(simulation, real_time_factor=AS_FAST_AS_READ) as (_, reader):
        wait_until(lambda: len(reader.reports) > 60)
        snapshots = reader.snapshots()[:61]
    alone = Simulation(sbs, trimmed_state(sbs, hover), hover.swashplate)
    for snapshot in snapshots:
        assert snapshot.step == alone.step
        np.testing.assert_array_equal(snapshot.state, alone.state)
        alone.advance()


def test_without_a_reader_reports_are_dropped_and_counted_and_the_flight_goes_on(simulation):
    with flying(simulation, reading=False, real_time_factor=HURRIED) as (loop, _):
        wait_until(lambda: loop.call(lambda: simulation.step) > 150 * simulation.steps_per_tick)
        assert loop.reports.qsize() == QUEUE_LENGTH
        kept = [loop.reports.get() for _ in range(QUEUE_LENGTH)]
        assert [report.step for report in kept] == [i * simulation.steps_per_tick for i in range(QUEUE_LENGTH)]
        assert {report.dropped for report in kept} == {0}
        later = loop.reports.get(timeout=PATIENCE)
        assert later.dropped >= 50
        assert later.step == (QUEUE_LENGTH + later.dropped) * simulation.steps_per_tick


# -- pause and step ----------------------------------------------------------------------------------


def test_pause_step_and_play(simulation):
    tick = simulation.steps_per_tick
    with flying(simulation) as (loop, reader):
        wait_until(lambda: reader.newest().step > 0)
        loop.pause(True)
        wait_until(lambda: not reader.newest().playing)
        at = loop.call(lambda: simulation.step)
        count = len(reader.reports)
        wait_until(lambda: len(reader.reports) > count + 3)  # it shows that it lives
        idle = reader.reports[count + 1 :]
        assert {report.step for report in idle} == {at}
        assert {report.snapshot for report in idle} == {None}
        assert {report.real_time_factor for report in idle} == {0.0}
        assert loop.step(5) == pytest.approx(simulation.time)
        assert loop.call(lambda: simulation.step) == at + 5 * tick
        wait_until(lambda: reader.newest().step == at + 5 * tick)
        reported = [snapshot.step for snapshot in reader.snapshots()]
        assert reported[-5:] == [at + i * tick for i in range(1, 6)]
        assert not reader.newest().playing
        loop.pause(True)  # once more changes nothing
        assert loop.call(lambda: simulation.step) == at + 5 * tick
        loop.pause(False)
        wait_until(lambda: reader.newest().step > at + 7 * tick)
        assert reader.newest().playing


def test_real_time_starts_anew_after_a_pause(simulation):
    """The time that passed while paused is not caught up."""
    with flying(simulation) as (loop, reader):
        loop.pause(True)
        missed = loop.call(lambda: simulation.step)
        time.sleep(0.5)
        assert loop.call(lambda: simulation.step) == missed
        started, before = time.monotonic(), simulation.time
        loop.pause(False)
        wait_until(lambda: reader.newest().time > before + 0.05)
        assert reader.newest().time - before < 1.5 * (time.monotonic() - started) + 0.15


def test_step_is_refused_while_playing_and_for_bad_numbers(simulation):
    with flying(simulation) as (loop, _):
        assert refusal(loop.step, 1) == "the simulation is playing: step is allowed while it is paused"
        loop.pause(True)
        at = loop.call(lambda: simulation.step)
        for ticks in (0, -1, 10_001):
            assert refusal(loop.step, ticks) == f"ticks = {ticks}: allowed are integers from 1 to 1000"
        assert loop.call(lambda: simulation.step) == at


# -- commands ----------------------------------------------------------------------------------------


def test_a_command_acts_from_the_next_tick_on(simulation, hover):
    angles = hover.swashplate + 0.01
    with flying(simulation) as (loop, reader):
        wait_until(lambda: reader.newest().step > 0)
        loop.command(angles)
        wait_until(lambda: np.array_equal(loop.swashplate(), angles))
        wait_until(lambda: reader.state()[VELOCITY + 2] < -0.01)  # it climbs
        angles[:] = math.nan  # the loop has its own copy
        assert np.isfinite(loop.swashplate()).all()


def test_a_bad_command_is_refused_and_changes_nothing(simulation, hover):
    with flying(simulation) as (loop, reader):
        good = hover.swashplate + 0.01
        loop.command(good)
        line = refusal(loop.command, np.full((2, 3), math.nan))
        assert line == "MR1 collective = nan: allowed are 0 to 0.349066 rad"
        assert refusal(loop.command, np.zeros((3, 3))).startswith("swashplate has 3 rotors")
        at = reader.newest().step
        wait_until(lambda: reader.newest().step > at + 3 * simulation.steps_per_tick)
        np.testing.assert_array_equal(loop.swashplate(), good)


def test_no_command_is_lost_between_two_threads(simulation, hover):
    """The last of the commands is in force in the end, whenever it came."""
    before = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    try:
        with flying(simulation, real_time_factor=AS_FAST_AS_READ) as (loop, _):
            for i in range(200):
                angles = hover.swashplate + 1e-5 * (i + 1)
                loop.command(angles)
                wait_until(lambda angles=angles: np.array_equal(loop.swashplate(), angles))
    finally:
        sys.setswitchinterval(before)


def test_a_command_that_is_too_old_is_reported_until_the_next(simulation, hover):
    """In simulation time: half a second are 50 ticks, whatever the clock says."""
    with flying(simulation) as (loop, reader):
        loop.pause(True)

        def after(ticks):
            step = loop.call(lambda: simulation.step) + ticks * simulation.steps_per_tick
            loop.step(ticks)
            wait_until(lambda: reader.newest().step == step)
            return reader.newest()

        assert not after(60).command_timed_out  # there was no command that could be old
        loop.command(hover.swashplate + 0.001)
        assert not after(50).command_timed_out
        late = after(1)
        assert late.command_timed_out
        np.testing.assert_array_equal(loop.swashplate(), hover.swashplate + 0.001)  # held
        loop.command(hover.swashplate)
        assert not after(1).command_timed_out
        loop.set_command_timeout(0.02)
        assert not after(1).command_timed_out
        assert after(1).command_timed_out
        loop.set_command_timeout(0.0)
        assert not after(100).command_timed_out


# -- reset and wind ----------------------------------------------------------------------------------


def test_reset_while_flying(sbs, hover, simulation):
    state = trimmed_state(sbs, hover, position=(100.0, 200.0, -300.0), heading=1.0)
    with flying(simulation) as (loop, reader):
        wait_until(lambda: reader.newest().step > 0)
        loop.command(hover.swashplate + 0.01)
        loop.reset(state, hover.swashplate)
        wait_until(lambda: reader.state()[0] > 99.0)
        reports = [report for report in reader.reports if report.snapshot is not None]
        np.testing.assert_array_equal(loop.swashplate(), hover.swashplate)
    place = next(i for i, report in enumerate(reports) if report.snapshot.state[0] > 99.0)
    np.testing.assert_array_equal(reports[place].snapshot.state, state)
    steps = [report.step for report in reports]
    assert steps == sorted(steps)  # time goes on


def test_a_reset_clears_commands_that_have_not_acted_yet(simulation, hover):
    with flying(simulation) as (loop, reader):
        loop.pause(True)
        loop.command(hover.swashplate + 0.001)
        loop.step(60)
        wait_until(lambda: reader.newest().command_timed_out)
        state = loop.call(simulation.snapshot).state
        loop.command(hover.swashplate + 0.01)
        loop.reset(state, hover.swashplate + 0.002)
        loop.step(1)
        np.testing.assert_array_equal(loop.swashplate(), hover.swashplate + 0.002)
        wait_until(lambda: not reader.newest().command_timed_out)


def test_a_bad_reset_is_refused_and_changes_nothing(sbs, hover, simulation):
    with flying(simulation) as (loop, _):
        loop.pause(True)
        before = loop.call(simulation.snapshot)
        bad = trimmed_state(sbs, hover, position=(math.nan, 0.0, 0.0))
        assert refusal(loop.reset, bad, hover.swashplate).startswith("state north = nan: ")
        good = trimmed_state(sbs, hover, position=(5.0, 0.0, 0.0))
        assert refusal(loop.reset, good, hover.swashplate + 1.0).startswith("MR1 collective = ")
        after = loop.call(simulation.snapshot)
        for field in dataclasses.fields(before):
            np.testing.assert_array_equal(getattr(after, field.name), getattr(before, field.name))


def test_wind_is_set_for_the_present_instant(simulation):
    seen = []

    def make(now):
        seen.append(now)
        return Wind(velocity=(now.step + 1.0, 2.0, 3.0), gust_delay=1.0)

    with flying(simulation) as (loop, reader):
        wait_until(lambda: reader.newest().step > 0)
        loop.pause(True)
        step = loop.call(lambda: simulation.step)
        loop.set_wind(make)
        assert [now.step for now in seen] == [step]
        assert loop.wind().velocity == (step + 1.0, 2.0, 3.0)
        np.testing.assert_array_equal(loop.call(simulation.snapshot).wind, (step + 1.0, 2.0, 3.0))
        loop.pause(False)
        wait_until(lambda: abs(reader.state()[VELOCITY]) > 0.01)


def test_wind_that_cannot_be_made_changes_nothing(simulation):
    class UnforeseenError(Exception):
        pass

    def fail(_):
        raise UnforeseenError("no wind today")

    with flying(simulation) as (loop, reader):
        before = loop.wind()
        with pytest.raises(UnforeseenError, match="no wind today"):
            loop.set_wind(fail)
        assert refusal(loop.set_wind, lambda _: Wind(velocity=(math.nan, 0, 0))).startswith("velocity.x = nan: ")
        assert loop.wind() is before
        at = reader.newest().step
        wait_until(lambda: reader.newest().step > at)  # and the flight goes on


# -- faults ------------------------------------------------------------------------------------------


def test_a_fault_pauses_until_a_reset(falling):
    start = falling.state.copy()
    with flying(falling) as (loop, reader):
        wait_until(lambda: reader.newest().fault)
        fault = reader.newest().fault
        assert "would take w to 350" in fault
        assert not reader.newest().playing
        assert np.isfinite(reader.snapshots()[-1].state).all()
        line = f"the simulation has stopped, reset it first: {fault}"
        assert refusal(loop.pause, False) == line
        assert refusal(loop.step, 1) == line
        loop.pause(True)  # it is
        at = loop.call(lambda: falling.step)
        assert loop.call(lambda: falling.step) == at
        start[VELOCITY + 2] = math.nan
        assert refusal(loop.reset, start, np.zeros((2, 3))).startswith("state w = nan: ")
        assert refusal(loop.pause, False) == line
        start[VELOCITY + 2] = 0.0
        loop.reset(start, np.zeros((2, 3)))
        wait_until(lambda: not reader.newest().fault)
        assert not reader.newest().playing
        loop.step(2)
        loop.pause(False)
        wait_until(lambda: reader.newest().step > at + 5 * falling.steps_per_tick)
        assert reader.newest().playing


def test_a_fault_while_stepping_is_reported_to_the_caller(falling):
    with flying(falling, real_time_factor=1e-5) as (loop, reader):
        loop.pause(True)
        line = refusal(loop.step, 100)
        assert "would take w to 350" in line
        wait_until(lambda: reader.newest().fault != "")
        assert reader.newest().fault in line
        assert loop.call(lambda: falling.time) < 0.1


# -- calls -------------------------------------------------------------------------------------------


def test_calls_are_carried_out_one_at_a_time_in_the_flights_thread(simulation):
    names, count = set(), [0]

    def add():
        names.add(threading.current_thread().name)
        value = count[0]
        time.sleep(0)  # let others in, if they could
        count[0] = value + 1
        return count[0]

    with flying(simulation) as (loop, _):
        results = []

        def caller():
            results.extend([loop.call(add) for _ in range(25)])

        threads = [threading.Thread(target=caller) for _ in range(8)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join(PATIENCE)
    assert sorted(results) == list(range(1, 201))
    assert names == {"flight"}


def test_all_requests_at_once_from_many_threads(sbs, hover, simulation):
    """Whatever the order, every request is answered, and the flight is whole afterwards."""
    failures = []
    state = trimmed_state(sbs, hover)

    def repeat(request):
        for _ in range(15):
            try:
                request()
            except SimulationError as error:
                if "is playing" not in str(error):
                    failures.append(error)
            except BaseException as error:
                failures.append(error)

    with flying(simulation) as (loop, reader):
        requests = [
            lambda: loop.pause(True),
            lambda: loop.pause(False),
            lambda: loop.step(1),
            lambda: loop.reset(state, hover.swashplate),
            lambda: loop.set_wind(lambda now: Wind(velocity=(now.time, 0.0, 0.0))),
            lambda: loop.command(hover.swashplate + 0.001),
            lambda: loop.set_pace(50.0),
            loop.wind,
        ]
        threads = [threading.Thread(target=repeat, args=(request,)) for request in requests]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join(PATIENCE)
            assert not thread.is_alive()
        assert failures == []
        loop.pause(False)
        at = reader.newest().step
        wait_until(lambda: reader.newest().step > at)
        steps = [report.step for report in reader.reports]
        assert steps == sorted(steps)
        assert all(step % simulation.steps_per_tick == 0 for step in steps)


@contextlib.contextmanager
def held_up(loop):
    """A flight that is busy with the request of somebody else."""
    started, end = threading.Event(), threading.Event()

    def hold():
        started.set()
        assert end.wait(PATIENCE)

    holder = threading.Thread(target=lambda: loop.call(hold, PATIENCE), daemon=True)
    holder.start()
    assert started.wait(PATIENCE)
    yield
    end.set()
    holder.join(PATIENCE)


def test_a_call_without_an_answer_is_given_up_and_not_carried_out_later(simulation):
    done = []
    with flying(simulation) as (loop, _):
        with held_up(loop):
            line = refusal(loop.call, lambda: done.append("late"), 0.2)
            assert line == "the flight did not answer within 0.2 s"
        loop.call(lambda: done.append("in time"))
        assert done == ["in time"]


def test_as_fast_as_read_a_flight_without_a_reader_waits_and_answers(simulation):
    """It is at most two ticks ahead of what its controller has seen, and nothing is dropped."""
    with flying(simulation, reading=False, real_time_factor=AS_FAST_AS_READ) as (loop, reader):
        wait_until(lambda: loop.reports.qsize() >= FAST_LENGTH)
        time.sleep(0.2)
        assert loop.call(lambda: simulation.step) <= FAST_LENGTH * simulation.steps_per_tick
        loop.pause(True)
        loop.pause(False)
        reader.start()
        wait_until(lambda: len(reader.snapshots()) > 10)
    steps = [snapshot.step for snapshot in reader.snapshots()]
    assert steps == [i * simulation.steps_per_tick for i in range(len(steps))]
    assert reader.newest().dropped == 0


# -- a reader in the flight's own thread -------------------------------------------------------------


class Taker(Reader):
    """Reads as a publisher does: from the queue, and in the flight's thread where that would wait for it."""

    def __init__(self, loop):
        super().__init__(loop)
        self.threads, self.refuses = [], False
        loop.read_by(self.take)

    def run(self):
        while (report := self.loop.reports.get()) is not None:
            time.sleep(0.001)  # what comes now must not overtake
            self.add(report)
            self.loop.reports.task_done()
        self.ended = True

    def take(self, report):
        if not self.refuses:
            self.add(report)
        return not self.refuses

    def add(self, report):
        self.reports.append(report)
        self.threads.append(threading.current_thread().name)


@contextlib.contextmanager
def taken(simulation, **options):
    loop = FlightLoop(simulation, **options)
    reader = Taker(loop)
    loop.start()
    reader.start()
    try:
        yield loop, reader
    finally:
        loop.stop()
        reader.join(PATIENCE)
        assert reader.ended


def assert_all_ticks(reader, tick):
    """Every tick was reported once, in order, with nothing lost."""
    steps = [snapshot.step for snapshot in reader.snapshots()]
    assert steps == [i * tick for i in range(len(steps))]
    assert reader.newest().dropped == 0


def test_as_fast_as_read_the_flight_hands_out_reports_in_its_own_thread_and_in_order(simulation):
    with taken(simulation, real_time_factor=AS_FAST_AS_READ) as (loop, reader):
        wait_until(lambda: len(reader.reports) > 200)
        loop.pause(True)
        wait_until(lambda: not reader.newest().playing)
        loop.pause(False)
        before = len(reader.reports)
        wait_until(lambda: len(reader.reports) > before + 50)
    assert reader.threads.count("flight") > 200
    assert_all_ticks(reader, simulation.steps_per_tick)


def test_reports_that_a_reader_cannot_take_now_wait_in_the_queue(simulation):
    with taken(simulation, real_time_factor=AS_FAST_AS_READ) as (loop, reader):
        wait_until(lambda: "flight" in reader.threads)
        reader.refuses = True
        loop.call(lambda: None)
        before = len(reader.reports)
        wait_until(lambda: len(reader.reports) > before + 20)
        assert "flight" not in reader.threads[before + 1 :]
        reader.refuses = False
        before = len(reader.reports)
        wait_until(lambda: "flight" in reader.threads[before:])
    assert_all_ticks(reader, simulation.steps_per_tick)


def test_in_real_time_the_flight_does_not_wait_for_its_reader(simulation):
    with taken(simulation, real_time_factor=1.0) as (_, reader):
        wait_until(lambda: len(reader.reports) > 20)
        assert "flight" not in reader.threads
    assert_all_ticks(reader, simulation.steps_per_tick)


def test_many_steps_are_reported_one_by_one_and_let_others_in(simulation):
    with taken(simulation, real_time_factor=1e-5) as (loop, reader):
        loop.pause(True)
        first, tick = loop.call(lambda: simulation.step), simulation.steps_per_tick
        started, met = threading.Event(), []
        take = reader.take

        def watch(report):
            if report.step > first + 5 * tick:
                started.set()
                time.sleep(0.001)  # steps on a slow machine
            return take(report)

        loop.read_by(watch)
        stepper = threading.Thread(target=lambda: loop.step(400), daemon=True)
        stepper.start()
        assert started.wait(PATIENCE)
        loop.call(lambda: met.append(simulation.step))
        stepper.join(PATIENCE)
        assert not stepper.is_alive()
        assert loop.call(lambda: simulation.step) == first + 400 * tick
        assert first + 5 * tick < met[0] < first + 400 * tick
    assert_all_ticks(reader, tick)


def test_stop_in_the_middle_of_many_steps(simulation):
    with taken(simulation, real_time_factor=1e-5) as (loop, reader):
        loop.pause(True)
        lines = []
        stepper = threading.Thread(target=lambda: lines.append(refusal(loop.step, 1000)), daemon=True)
        take = reader.take
        loop.read_by(lambda report: time.sleep(0.002) or take(report))
        stepper.start()
        wait_until(lambda: simulation.step > 10 * simulation.steps_per_tick)
        stop_in_time(loop)
        stepper.join(PATIENCE)
        assert lines == ["the flight has ended"]


# -- the end -----------------------------------------------------------------------------------------


def stop_in_time(loop):
    """Stop from another thread, so that a loop that does not end cannot hold the tests."""
    thread = threading.Thread(target=loop.stop, daemon=True)
    thread.start()
    thread.join(PATIENCE)
    assert not thread.is_alive()


def last_of(loop):
    last = "nothing"
    with contextlib.suppress(queue.Empty):
        while True:
            last = loop.reports.get_nowait()
    return last


@pytest.mark.parametrize("pace", [AS_FAST_AS_READ, 1e-5, 1.0, HURRIED])
@pytest.mark.parametrize("paused", [False, True])
def test_stop_always_ends_with_none_as_the_last_report(simulation, pace, paused):
    loop = FlightLoop(simulation, real_time_factor=pace)
    loop.start()
    if paused:
        loop.pause(True)
    time.sleep(0.05)
    stop_in_time(loop)
    step = simulation.step
    assert last_of(loop) is None
    time.sleep(0.05)
    assert simulation.step == step
    stop_in_time(loop)  # twice does no harm


def test_stop_while_the_queue_is_full_and_nobody_reads(simulation):
    loop = FlightLoop(simulation, real_time_factor=HURRIED)
    loop.start()
    wait_until(loop.reports.full)
    stop_in_time(loop)
    assert last_of(loop) is None


def test_stop_before_the_start(simulation):
    loop = FlightLoop(simulation)
    stop_in_time(loop)
    assert last_of(loop) is None


def test_after_the_end_requests_are_refused_at_once(simulation):
    with flying(simulation) as (loop, _):
        pass
    started = time.monotonic()
    for request in (lambda: loop.pause(True), lambda: loop.set_wind(lambda _: Wind()), lambda: loop.call(int)):
        assert refusal(request) == "the flight has ended"
    assert time.monotonic() - started < 5.0


def test_requests_under_way_at_the_end_are_answered(simulation):
    """A caller that waits gets an answer."""
    loop = FlightLoop(simulation)
    loop.start()
    lines = []
    threads = [
        threading.Thread(target=lambda: lines.append(refusal(loop.call, int, PATIENCE)), daemon=True) for _ in range(3)
    ]
    with held_up(loop):
        for thread in threads:
            thread.start()
        time.sleep(0.05)
        stopper = threading.Thread(target=loop.stop, daemon=True)
        stopper.start()
        time.sleep(0.05)
    for thread in (stopper, *threads):
        thread.join(PATIENCE / 2)
    assert lines == ["the flight has ended"] * 3
