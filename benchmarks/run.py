"""Times the model and the simulator and prints a table: `./run python benchmarks/run.py --help`.

Machines are noisy: every figure is a median, with the spread beside it where there are enough runs.
"""

import argparse
import json
import math
import os
import platform
import signal
import statistics
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import psutil
from analysis_rows import analysis_rows
from plain_ratio import plain_rows

from sbs_sim import Aircraft, simulate, trim
from sbs_sim.model import params as P
from sbs_sim.model.average import averaged_derivative
from sbs_sim.model.integrate import RK4, advance
from sbs_sim.model.wind import WIND_SIZE
from sbs_sim.simulation import plausible_bounds, trimmed_state

ROOT = Path(__file__).resolve().parent.parent
SIMULATOR = ROOT / "install" / "sbs_sim" / "lib" / "sbs_sim" / "simulator"
Row = tuple[str, float, str, str]


def main() -> None:
    """Run what the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--json", type=Path, help="also write the figures to this file")
    parser.add_argument(
        "--node", type=float, default=60.0, help="seconds to watch the simulator node, 0 to leave it out"
    )
    parser.add_argument(
        "--memory", type=float, default=0.0, help="minutes to watch the node's memory, 0 to leave it out"
    )
    arguments = parser.parse_args()
    rows: list[Row] = [*kernel_rows(), *analysis_rows(timed), *start_rows()]
    if arguments.node > 0:
        rows += node_rows(arguments.node, arguments.memory)
    print_table(rows)
    if arguments.json:
        figures = {name: {"value": value, "unit": unit, "note": note} for name, value, unit, note in rows}
        arguments.json.write_text(json.dumps({"machine": machine(), "figures": figures}, indent=2) + "\n")


def machine() -> dict[str, str]:
    """What the figures belong to."""
    lines = Path("/proc/cpuinfo").read_text().splitlines()
    model = next((line.split(":")[1].strip() for line in lines if line.startswith("model name")), "?")
    packages = {name: version(name) for name in ("numba", "llvmlite", "numpy")}
    load = f"{os.getloadavg()[0]:.2f}"
    return {"cpu": model, "cores": str(os.cpu_count()), "python": platform.python_version(), "load": load, **packages}


def print_table(rows: list[Row]) -> None:
    """Figures in columns, the machine above."""
    print(", ".join(f"{key} {value}" for key, value in machine().items()))
    width = max(len(name) for name, *_ in rows)
    for name, value, unit, note in rows:
        print(f"{name:<{width}}  {value:>10.4g} {unit:<6} {note}")


def timed(work: Callable[[], Any], repeats: int) -> tuple[float, str]:
    """Median time of a call [s], and the spread of the middle half in per cent."""
    work()
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    low, median, high = statistics.quantiles(times, n=4)
    return median, f"median of {repeats}, middle half within {100 * (high - low) / median:.0f} %"


# --- model ------------------------------------------------------------------------------------------------------


def kernel_rows() -> list[Row]:
    """Derivative and integration, one thread."""
    aircraft = Aircraft.load("sbs")
    forward = trim(aircraft, airspeed=10.0)
    hover = trim(aircraft)
    elements = 3 * aircraft.options.elements * len(aircraft.rotors)
    rows = [derivative_row(aircraft, hover, "hover"), derivative_row(aircraft, forward, "10 m/s")]
    rows += [*plain_rows(aircraft, hover, "hover"), *plain_rows(aircraft, forward, "10 m/s")]
    rows += [integration_row(aircraft, forward, degrees) for degrees in (1.0, 2.5, 5.0, 10.0)]
    seconds, note = timed(lambda: simulate(aircraft, forward, forward.controls, 1.0), 11)
    rows.append(("simulate() at 5 deg, 100 Hz", 1.0 / seconds, "x real", note))
    rows.insert(0, ("blade elements", elements, "", "with a look-up of cl and cd (Re, alpha) each"))
    return rows


def derivative_row(aircraft: Aircraft, point: Any, name: str) -> Row:
    """Time of one complete derivative."""
    p = aircraft.params()
    work = P.make_work(p)
    x = trimmed_state(aircraft, point)
    dx, loads, calls = np.zeros_like(x), np.zeros((len(aircraft.rotors), P.LOAD_SIZE)), 10_000
    seconds, note = timed(lambda: averaged_derivative(p, x, point.swashplate, calls, np.zeros(3), work, dx, loads), 21)
    return f"derivative, {name}", 1e6 * seconds / calls, "us", note


def integration_row(aircraft: Aircraft, point: Any, degrees: float) -> Row:
    """Real-time factor of the compiled Runge-Kutta loop, and its error after half a second of a manoeuvre."""
    speed = aircraft.rotors[0].speed
    steps = math.ceil(speed * 0.01 / math.radians(degrees))
    p = aircraft.params()
    work, bounds = P.make_work(p), plausible_bounds(aircraft)
    air, start = np.zeros(WIND_SIZE), trimmed_state(aircraft, point)
    azimuth = np.zeros(len(aircraft.rotors))

    def second() -> None:
        advance(p, start.copy(), point.swashplate, azimuth, 0, 100 * steps, 0.01 / steps, air, RK4, bounds, work)

    seconds, note = timed(second, 7)
    controls = point.controls + np.radians([1.0, 1.0, 1.0, 0.0])
    ends = [
        simulate(aircraft, point, controls, 0.5, azimuth_step=math.radians(step))["state"][-1]
        for step in (degrees, 0.5)
    ]
    error = np.abs(ends[0] - ends[1])
    return (
        f"RK4 loop, {degrees:g} deg",
        1.0 / seconds,
        "x real",
        f"error after 0.5 s of control steps: body {error[7:13].max():.1e}, all states {error[7:].max():.1e}; {note}",
    )


def start_rows() -> list[Row]:
    """Time to start, with warm caches."""
    rows = []
    for name, code in (
        ("import sbs_sim", "import sbs_sim"),
        ("import, load, trim", "from sbs_sim import *; trim(Aircraft.load('sbs'))"),
    ):
        seconds, note = timed(lambda code=code: subprocess.run([sys.executable, "-c", code], check=True), 5)
        rows.append((f"process: {name}", seconds, "s", note))
    return rows


# --- node -------------------------------------------------------------------------------------------------------


class Watch:
    """Counts what a running simulator publishes."""

    def __init__(self) -> None:
        import rclpy
        from rclpy.executors import SingleThreadedExecutor

        from sbs_msgs.msg import BodyState, Controls, InflowArray, RotorStateArray, SimulationStatus

        rclpy.init()
        self.node = rclpy.create_node("benchmark")
        self.arrivals: list[float] = []
        self.status: Any = None
        self.acceleration = 0.0
        self.counts = {"rotors": 0, "inflow": 0}
        self.node.create_subscription(BodyState, "state", self._on_state, 10)
        self.node.create_subscription(SimulationStatus, "status", self._on_status, 10)
        for topic, kind in (("rotors", RotorStateArray), ("inflow", InflowArray)):
            self.node.create_subscription(kind, topic, lambda _, topic=topic: self._count(topic), 10)
        self.pilot = self.node.create_publisher(Controls, "controls", 1)
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self.node)
        self._thread = threading.Thread(target=self._executor.spin, daemon=True)
        self._thread.start()

    def _on_state(self, message: Any) -> None:
        self.arrivals.append(time.perf_counter())
        self.acceleration = message.acceleration.z

    def _on_status(self, message: Any) -> None:
        self.status = message

    def _count(self, topic: str) -> None:
        self.counts[topic] += 1

    def close(self) -> None:
        """Leave."""
        import rclpy

        self._executor.shutdown()
        self._thread.join()
        self.node.destroy_node()
        rclpy.shutdown()


def node_rows(seconds: float, memory_minutes: float) -> list[Row]:
    """The simulator with its mixer in a process of its own, everything published at 100 Hz."""
    os.environ.setdefault("ROS_DOMAIN_ID", str(1 + os.getpid() % 100))
    os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
    watch = Watch()
    begin = time.perf_counter()
    process = subprocess.Popen([sys.executable, str(SIMULATOR)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        while not watch.arrivals:
            time.sleep(0.002)
        rows: list[Row] = [("node: start to first state", watch.arrivals[0] - begin, "s", "with a warm cache")]
        time.sleep(3.0)
        rows += steady_rows(watch, psutil.Process(process.pid), seconds)
        rows += latency_rows(watch)
        if memory_minutes > 0:
            rows += memory_rows(psutil.Process(process.pid), memory_minutes, time.perf_counter() - begin)
    finally:
        process.send_signal(signal.SIGINT)
        process.wait(20)
        watch.close()
    return rows


def steady_rows(watch: Watch, process: psutil.Process, seconds: float) -> list[Row]:
    """Load, deadlines and regularity over a while."""
    first, before, missed = len(watch.arrivals), process.cpu_times(), watch.status.missed_deadlines
    counted, start, sim_start = dict(watch.counts), time.perf_counter(), watch.status.sim_time
    time.sleep(seconds)
    after, wall = process.cpu_times(), time.perf_counter() - start
    flown = watch.status.sim_time - sim_start
    gaps = np.diff(watch.arrivals[first:]) * 1e3
    load = 100 * (after.user + after.system - before.user - before.system) / wall
    rates = ", ".join(f"{topic} {(watch.counts[topic] - counted[topic]) / wall:.1f} Hz" for topic in watch.counts)
    return [
        ("node: real-time factor", flown / wall, "", f"over {wall:.0f} s"),
        ("node: state rate", len(gaps) / wall, "Hz", rates),
        ("node: CPU", load, "%", "of one core, simulator and mixer in one process"),
        (
            "node: missed deadlines",
            watch.status.missed_deadlines - missed,
            "",
            f"dropped {watch.status.dropped_messages}",
        ),
        ("node: period p50", float(np.percentile(gaps, 50)), "ms", "between states as received"),
        ("node: period p99", float(np.percentile(gaps, 99)), "ms", ""),
        ("node: period max", float(gaps.max()), "ms", ""),
    ]


def latency_rows(watch: Watch) -> list[Row]:
    """From `controls` to the first `state` whose acceleration shows it."""
    from sbs_msgs.msg import Controls

    collective = trim(Aircraft.load("sbs")).controls[0]
    delays = []
    for i in range(101):
        before = watch.acceleration
        start = time.perf_counter()
        watch.pilot.publish(Controls(collective=collective + math.radians(0.3 * (-1) ** i)))
        while abs(watch.acceleration - before) < 0.05 and time.perf_counter() - start < 1.0:
            time.sleep(0.0002)
        delays.append(1e3 * (time.perf_counter() - start))
        time.sleep(0.05 + 0.001 * (i % 10))
    delays = delays[1:]  # the first one may still be discovering
    return [
        ("node: controls to state p50", float(np.percentile(delays, 50)), "ms", "100 steps of collective"),
        ("node: controls to state p99", float(np.percentile(delays, 99)), "ms", ""),
    ]


def memory_rows(process: psutil.Process, minutes: float, age: float) -> list[Row]:
    """Resident memory one minute after the start and at the end."""
    time.sleep(max(0.0, 60.0 - age))
    early = process.memory_info().rss / 2**20
    time.sleep(60.0 * (minutes - 1.0))
    late = process.memory_info().rss / 2**20
    return [
        ("node: memory early", early, "MiB", "after 1 minute or the figures above"),
        ("node: memory late", late, "MiB", f"{minutes - 1.0:g} minutes later, {late - early:+.2f} MiB"),
    ]


if __name__ == "__main__":
    main()
