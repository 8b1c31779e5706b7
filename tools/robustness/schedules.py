"""Fly random schedules of events into logs, and fly every log again.

    ./run python tools/robustness/schedules.py [--flights 3000] [--seed 1]

Each flight is one of the real flight loop, publisher and recorder: it is stepped and let go as fast as it can be
published, commanded, reset (in the air, just above the ground, into states that cannot last, where it is), given winds,
paused, and its log is started and ended, all in any order, many between the same two ticks, after faults and ground
contacts too. Every log must be whole, have one start, no state twice but where there was a reset, and come again bit
for bit. What happened is counted; the exit code is 1 if something is wrong, and the number of the flight is printed:
`--first NUMBER --flights 1` flies it alone, though a flight that is let go does not do the same each time.
"""

import argparse
import collections
import contextlib
import math
import os
import sys
import tempfile
import time
import traceback
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import rclpy
from rclpy.signals import SignalHandlerOptions

from sbs_msgs.msg import SwashplateArray
from sbs_msgs.srv import Record
from sbs_sim import Aircraft, trim
from sbs_sim.errors import SbsError
from sbs_sim.flight.simulation import Simulation
from sbs_sim.flight.trimmed_state import trimmed_state
from sbs_sim.flight_loop import FlightLoop
from sbs_sim.model.ground import lowest_point
from sbs_sim.model.wind import Wind
from sbs_sim.nodes.command_monitor import CommandMonitor
from sbs_sim.nodes.component import Component
from sbs_sim.nodes.confinement import keep_to_this_machine
from sbs_sim.nodes.conversions import swashplate_messages
from sbs_sim.nodes.qos import COMMAND_QOS
from sbs_sim.nodes.recorder_node import RecorderNode
from sbs_sim.nodes.simulator_outputs import SimulatorOutputs
from sbs_sim.recording import read
from sbs_sim.recording.recorded_flight import flight_of
from sbs_sim.recording.verification import verify
from sbs_sim.terminal.progress import progress_bar

GROUND = -4.0  # m
# tick [s] and largest step [deg]: one, four and 29 steps to a tick, so that a contact comes at its border or within it
STEPS = ((0.002, 45.0), (0.01, 45.0), (0.01, 5.0))
LONGEST = 30  # events of a flight
AIRCRAFT = Aircraft.load("sbs")
TRIMS = {"hover": trim(AIRCRAFT), "sink": trim(AIRCRAFT, climb_rate=-2.0), "fast": trim(AIRCRAFT, airspeed=15.0)}


class Flight:
    """One flight of a schedule that follows from its number.

    Parameters
    ----------
    number, seed : int
    folder : Path
        Of its logs.
    counts : Counter
        Of what happened.
    """

    def __init__(self, number: int, seed: int, folder: Path, counts: collections.Counter[str]) -> None:
        self._chance = np.random.default_rng((seed, number))
        self._counts, self._folder, self.logs = counts, folder, 0
        tick, azimuth_step = STEPS[self._chance.integers(len(STEPS))]
        self._simulation = Simulation(
            AIRCRAFT,
            state("hover", 50.0),
            TRIMS["hover"].swashplate,
            tick=tick,
            azimuth_step=math.radians(azimuth_step),
            lead_lag=bool(self._chance.random() < 0.8),
            wind=self._wind(),
            ground_altitude=GROUND,
        )
        self.loop = FlightLoop(self._simulation, real_time_factor=0.0)
        self._node = Component(f"simulator_{number}")
        self._log = RecorderNode(self._simulation, self.loop, {"number": number})
        self._arrivals = CommandMonitor(self._node, SwashplateArray, "swashplate", COMMAND_QOS, self._log)
        self._outputs = SimulatorOutputs(self._node, self.loop, self._arrivals, self._log)

    @contextlib.contextmanager
    def flying(self, recorded: bool) -> Iterator[None]:
        """In flight, paused, and afterwards at its end; with a log from the beginning on or without."""
        if recorded:
            self._log.begin(str(self._path()))
        self.loop.start()
        self.loop.pause(True)
        try:
            yield
        finally:
            self.loop.stop()
            self._outputs.join()
            self._log.end()
            for node in (self._node, self._log):
                node.destroy_node()

    def fly(self) -> None:
        """Fly the schedule to its end."""
        acts: list[Callable[[], None]] = [self._step, self._step, self._step, self._command, self._reset, self._reset]
        acts += [self._set_wind, self._play, self._record]
        with self.flying(self._chance.random() < 0.5):
            for _ in range(self._chance.integers(3, LONGEST)):
                act = acts[self._chance.integers(len(acts))]
                for _ in range(1 if self._chance.random() < 0.8 else self._chance.integers(2, 20)):
                    act()

    # ---------------------------------------------------------------------------------------------- what may happen

    def _step(self) -> None:
        for _ in range(self._chance.integers(1, 7)):
            before, ended = self._simulation.step, self.loop._fault
            try:
                self.loop.step(1)
            except SbsError as error:
                if not ended:
                    kind = "contacts" if "ground contact" in str(error) else "faults"
                    place = "at the border of a tick" if self._simulation.step == before else "within a tick"
                    self._counts[f"{kind} {place}"] += 1
                return
            self._counts["ticks"] += 1

    def _command(self) -> None:
        angles = TRIMS["hover"].swashplate + self._chance.uniform(-0.02, 0.02, (2, 3))
        self.loop.command(angles)
        self._arrivals.accept(SwashplateArray(rotors=swashplate_messages(angles)), self.loop.time)
        self._counts["commands"] += 1

    def _reset(self) -> None:
        kind = ("hover", "fast", "sink", "low", "wild", "same")[self._chance.integers(6)]
        height = self._chance.uniform(0.0, 0.15) if kind == "sink" else 50.0
        values = state("hover" if kind in ("low", "wild", "same") else kind, height)
        if kind == "low":  # touches the ground in its first step
            values = state("sink", 1e-6)
        elif kind == "wild":
            values[AIRCRAFT.layout.flap_rate(0)] = 900.0
        elif kind == "same":
            values = self._simulation.state.copy()
        self.loop.reset(values, TRIMS["sink" if kind in ("sink", "low") else "hover"].swashplate)
        self._counts["resets"] += 1

    def _set_wind(self) -> None:
        wind = self._wind()
        self.loop.set_wind(lambda _: wind)
        self._counts["winds"] += 1

    def _play(self) -> None:
        try:
            self.loop.pause(False)
        except SbsError:  # a fault lasts
            return
        time.sleep(self._chance.uniform(0.0, 0.02))
        self.loop.pause(True)
        self._counts["pauses"] += 1

    def _record(self) -> None:
        wanted = not self._log.path
        request = Record.Request(record=wanted, path=str(self._path()) if wanted else "")
        answer = self._log._on_record(request, Record.Response())
        assert answer.success, answer.message
        self._counts["logs started in flight"] += wanted

    # ---------------------------------------------------------------------------------------------------- and in what

    def _path(self) -> Path:
        self.logs += 1
        return self._folder / f"{self.logs}.mcap"

    def _wind(self) -> Wind:
        chance = self._chance
        kind = chance.integers(4)
        if kind == 0:
            return Wind()
        if kind == 1:
            return Wind(velocity=tuple(chance.uniform(-5.0, 5.0, 3)))
        if kind == 2:
            gust = tuple(chance.uniform(-3.0, 3.0, 3))
            return Wind(gust=gust, gust_delay=chance.uniform(0.0, 0.05), gust_duration=chance.uniform(0.01, 0.2))
        return Wind(turbulence_intensity=tuple(chance.uniform(0.0, 1.5, 3)), turbulence_seed=int(chance.integers(1000)))


def state(name: str, height: float) -> np.ndarray:
    """Trimmed state whose lowest point is at a height above the ground [m]."""
    values = trimmed_state(AIRCRAFT, TRIMS[name])
    deepest = np.zeros((1, 1))
    lowest_point(AIRCRAFT.model().ground, AIRCRAFT.model().rotors, values[:, np.newaxis], deepest)
    values[2] = -GROUND - height - deepest[0, 0]
    return values


def check(path: Path, counts: collections.Counter[str]) -> None:
    """Raise what is wrong with a log."""
    log = read(path)
    assert log.complete, log.reasons
    flight = flight_of(log)
    found = verify(flight)
    assert found.identical, found
    resets = collections.Counter(event.step for event in flight.events if event.kind == "reset")
    for step, times in collections.Counter(flight.steps.tolist()).items():
        assert times <= 1 + resets[step], f"step {step} is there {times} times"
    numbers = [log[role].sequence for role in ("state", "rotors", "inflow", "odom")]
    assert all(np.array_equal(own, np.arange(1, len(own) + 1)) for own in numbers), "messages are missing"
    assert len({len(own) for own in numbers}) == 1
    counts["logs"] += 1
    counts["states"] += found.states


def main(arguments: list[str] | None = None) -> int:
    """Do what the command line asks for; the exit code."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--flights", type=int, default=3000)
    parser.add_argument("--first", type=int, default=0, help="number of the first flight")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--domain", type=int, default=100, help="of DDS")
    options = parser.parse_args(arguments)
    os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    keep_to_this_machine()
    rclpy.init(domain_id=options.domain, signal_handler_options=SignalHandlerOptions.NO)
    counts: collections.Counter[str] = collections.Counter()
    wrong, begin = 0, time.monotonic()
    with progress_bar("flight") as progress, contextlib.suppress(KeyboardInterrupt):  # what has been flown is printed
        for number in range(options.first, options.first + options.flights):
            with tempfile.TemporaryDirectory() as name:
                folder = Path(name)
                try:
                    flight = Flight(number, options.seed, folder, counts)
                    flight.fly()
                    for log in range(1, flight.logs + 1):
                        check(folder / f"{log}.mcap", counts)
                except Exception as error:
                    wrong += 1
                    place = traceback.extract_tb(error.__traceback__)[-1]
                    print(f"flight {number}: {error!r} in {place.name}, line {place.lineno}", flush=True)
            counts["flights"] += 1
            if progress is not None:
                progress(number - options.first + 1, options.flights)
    rclpy.shutdown()
    print(f"{counts.pop('flights', 0)} flights in {time.monotonic() - begin:.0f} s, {wrong} wrong")
    print(", ".join(f"{count} {name}" for name, count in sorted(counts.items())))
    return min(wrong, 1)


if __name__ == "__main__":
    sys.exit(main())
