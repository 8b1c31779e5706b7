"""Load, deadlines, regularity and latency of the simulator in a process of its own.

    ./run python benchmarks/node_rows.py [--seconds 10]

prints the rows of a thousand ticks per second, of lock-step and of discovery alone.
"""

import argparse
import contextlib
import math
import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import psutil

from sbs_sim import Aircraft, trim

SIMULATOR = Path(__file__).resolve().parent.parent / "install" / "sbs_sim" / "lib" / "sbs_sim" / "simulator"
Row = tuple[str, float, str, str]
SILENT = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
FAST = 1000.0  # ticks per second
DISCOVERIES = 20
LEFT_ALONE = 2000  # ticks that nobody steers: in a hundred seconds it comes down to the ground
# What another process does: from its node to the first state that it gets, and whatever it prints.
NEWCOMER = """
import time
import rclpy
from sbs_msgs.msg import BodyState
rclpy.init()
begin = time.perf_counter()
node, came = rclpy.create_node("newcomer"), []
node.create_subscription(BodyState, "state", came.append, 10)
while not came:
    rclpy.spin_once(node, timeout_sec=0.01)
print(time.perf_counter() - begin)
"""


class Watch:
    """Counts what a running simulator publishes.

    Parameters
    ----------
    light : bool
        Neither rotors nor inflow, and states are not read: so that the watch does not need a core of its own.
    """

    def __init__(self, light: bool = False) -> None:
        import rclpy
        from rclpy.executors import SingleThreadedExecutor

        from sbs_msgs.msg import BodyState, Controls, InflowArray, RotorStateArray, SimulationStatus

        rclpy.init()
        self.node = rclpy.create_node("benchmark")
        self.arrivals: list[float] = []
        self.status: Any = None
        self.acceleration = 0.0
        self.counts = {} if light else {"rotors": 0, "inflow": 0}
        self.node.create_subscription(BodyState, "state", self._on_bytes if light else self._on_state, 10, raw=light)
        self.node.create_subscription(SimulationStatus, "status", self._on_status, 10)
        for topic, kind in () if light else (("rotors", RotorStateArray), ("inflow", InflowArray)):
            self.node.create_subscription(kind, topic, lambda _, topic=topic: self._count(topic), 10)
        self.pilot = self.node.create_publisher(Controls, "controls", 1)
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self.node)
        self._thread = threading.Thread(target=self._executor.spin, daemon=True)
        self._thread.start()

    def _on_state(self, message: Any) -> None:
        self.arrivals.append(time.perf_counter())
        self.acceleration = message.acceleration.z

    def _on_bytes(self, _: bytes) -> None:
        self.arrivals.append(time.perf_counter())

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
    with tempfile.TemporaryDirectory() as bags:
        try:
            rows = _rows(watch, seconds, memory_minutes, {**os.environ, "SBS_SIM_BAGS": bags})
        finally:
            watch.close()
    return [*rows, *fast_rows(min(seconds, 10.0))]


def fast_rows(seconds: float) -> list[Row]:
    """A thousand ticks per second, lock-step and discovery."""
    os.environ.setdefault("ROS_DOMAIN_ID", str(1 + os.getpid() % 100))
    os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
    watch = Watch(light=True)
    with tempfile.TemporaryDirectory() as bags:
        environment = {**os.environ, "SBS_SIM_BAGS": bags}
        try:
            with flying(watch, environment, publish_rate=FAST) as process:
                steady = steady_rows(watch, process, seconds)
            with flying(watch, environment) as process:
                others = [*discovery_rows(environment), *step_rows(watch, process, seconds)]
        finally:
            watch.close()
    return [*((name.replace("node", "node at 1 kHz"), *rest) for name, *rest in steady), *others]


@contextlib.contextmanager
def flying(watch: Watch, environment: dict[str, str], **parameters: float) -> Iterator[psutil.Process]:
    """A simulator whose states arrive."""
    given = [part for name, value in parameters.items() for part in ("-p", f"{name}:={value}")]
    watch.arrivals.clear()
    command = [sys.executable, str(SIMULATOR), "--ros-args", *given]
    process = subprocess.Popen(command, env=environment, **SILENT)
    try:
        while not watch.arrivals:
            if process.poll() is not None:
                raise RuntimeError(f"the simulator has ended with {process.returncode}")
            time.sleep(0.01)
        time.sleep(3.0)
        yield psutil.Process(process.pid)
    finally:
        process.send_signal(signal.SIGINT)
        process.wait(20)


def discovery_rows(environment: dict[str, str]) -> list[Row]:
    """From the node of another process to the first state that it receives."""
    times = []
    for _ in range(DISCOVERIES):
        done = subprocess.run([sys.executable, "-c", NEWCOMER], env=environment, capture_output=True, timeout=60)
        times.append(float(done.stdout))
    return [
        ("node: discovered p50", float(np.median(times)), "s", "from another process's node to its first state"),
        ("node: discovered max", max(times), "s", f"of {DISCOVERIES}"),
    ]


def step_rows(watch: Watch, process: psutil.Process, seconds: float) -> list[Row]:
    """Lock-step: a client that pauses the flight and has it fly ticks, one or many with every request."""
    from std_srvs.srv import SetBool

    from sbs_msgs.srv import Reset, Step

    kinds = {"pause": SetBool, "step": Step, "reset": Reset}
    pause, step, reset = (watch.node.create_client(kind, name) for name, kind in kinds.items())
    for client in (pause, step, reset):
        client.wait_for_service(10.0)
    pause.call(SetBool.Request(data=True), timeout_sec=10.0)
    rows: list[Row] = []
    for ticks in (1, 1000):
        flown, begin, before = 0, time.perf_counter(), process.cpu_times()
        while (wall := time.perf_counter() - begin) < seconds:
            if flown % LEFT_ALONE == 0:
                reset.call(Reset.Request(), timeout_sec=10.0)
            answer = step.call(Step.Request(ticks=ticks), timeout_sec=60.0)
            if answer is None or not answer.success:
                raise RuntimeError(f"step: {answer.message if answer else 'no answer'}")
            flown += ticks
        after = process.cpu_times()
        busy = 1e6 * (after.user + after.system - before.user - before.system) / flown
        rows.append((f"node: stepped by {ticks}", flown / wall, "ticks/s", f"{busy:.0f} us of a core per tick"))
    return rows


def _rows(watch: Watch, seconds: float, memory_minutes: float, environment: dict[str, str]) -> list[Row]:
    """From the start of the process to its end."""
    begin = time.perf_counter()
    process = subprocess.Popen([sys.executable, str(SIMULATOR)], env=environment, **SILENT)
    try:
        while not watch.arrivals:
            time.sleep(0.002)
        rows: list[Row] = [("node: start to first state", watch.arrivals[0] - begin, "s", "with a warm cache")]
        time.sleep(3.0)
        rows += steady_rows(watch, psutil.Process(process.pid), seconds)
        rows += latency_rows(watch)
        rows += log_rows(watch)
        if memory_minutes > 0:
            rows += memory_rows(psutil.Process(process.pid), memory_minutes, time.perf_counter() - begin)
    finally:
        process.send_signal(signal.SIGINT)
        process.wait(20)
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


def log_rows(watch: Watch, count: int = 20) -> list[Row]:
    """What it costs to end a log and begin another in flight."""
    from sbs_msgs.srv import Record

    service = watch.node.create_client(Record, "record")

    def asked(record: bool) -> float:
        """Wall time until it is done [ms]."""
        start = time.perf_counter()
        answer = service.call(Record.Request(record=record), timeout_sec=10.0)
        if answer is None or not answer.success:
            raise RuntimeError(f"record = {record}: {answer.message if answer else 'no answer'}")
        return 1e3 * (time.perf_counter() - start)

    service.wait_for_service(10.0)
    missed, begins = watch.status.missed_deadlines, []
    for _ in range(count):
        asked(False)
        begins.append(asked(True))
        time.sleep(1.0)
    return [
        ("node: log started in flight p50", float(np.median(begins)), "ms", f"longest {max(begins):.0f} ms"),
        ("node: deadlines missed meanwhile", watch.status.missed_deadlines - missed, "", f"{count} ends and begins"),
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


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=10.0, help="of wall time for every row")
    for name, value, unit, note in fast_rows(parser.parse_args().seconds):
        print(f"{name:34} {value:10.4g} {unit:8} {note}")


if __name__ == "__main__":
    main()
