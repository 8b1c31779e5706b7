"""Load, deadlines, regularity and latency of the simulator in a process of its own."""

import math
import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np
import psutil

from sbs_sim import Aircraft, trim

SIMULATOR = Path(__file__).resolve().parent.parent / "install" / "sbs_sim" / "lib" / "sbs_sim" / "simulator"
Row = tuple[str, float, str, str]


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
    with tempfile.TemporaryDirectory() as bags:
        return _rows(watch, seconds, memory_minutes, {**os.environ, "SBS_SIM_BAGS": bags})


def _rows(watch: Watch, seconds: float, memory_minutes: float, environment: dict[str, str]) -> list[Row]:
    """From the start of the process to its end."""
    begin = time.perf_counter()
    silent = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    process = subprocess.Popen([sys.executable, str(SIMULATOR)], env=environment, **silent)
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
        ("node: log begun in flight p50", float(np.median(begins)), "ms", f"longest {max(begins):.0f} ms"),
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
