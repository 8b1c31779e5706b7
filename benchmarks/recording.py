"""Times writing, reading and recovering recordings and prints a table: `./run python benchmarks/recording.py`.

The messages are those of a real flight, six topics at 100 Hz.
"""

import argparse
import statistics
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from rclpy.serialization import serialize_message
from rosgraph_msgs.msg import Clock

from sbs_msgs.msg import SimulationStatus
from sbs_sim import Aircraft, trim
from sbs_sim.flight.simulation import Simulation
from sbs_sim.flight.trimmed_state import trimmed_state
from sbs_sim.nodes.conversions import StateMessages, to_time
from sbs_sim.recording import LogWriter, message_definition, qos_profiles, read, recover

TYPES = {
    "/state": "sbs_msgs/msg/BodyState",
    "/rotors": "sbs_msgs/msg/RotorStateArray",
    "/inflow": "sbs_msgs/msg/InflowArray",
    "/odom": "nav_msgs/msg/Odometry",
    "/status": "sbs_msgs/msg/SimulationStatus",
    "/clock": "rosgraph_msgs/msg/Clock",
}
Row = tuple[str, float, str, str]
TICK = 0.01  # s
NANOSECONDS = 10_000_000


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--minutes", type=float, default=10.0, help="flight time of the file to read")
    parser.add_argument("--seconds", type=float, default=20.0, help="wall time to record in real time")
    arguments = parser.parse_args()
    for name, value, unit, note in recording_rows(arguments.seconds, arguments.minutes):
        print(f"{name:32} {value:10.3g} {unit:12} {note}")


def recording_rows(seconds: float, minutes: float) -> list[Row]:
    """Rows of the table: wall time to record in real time, flight time of the file to read."""
    flown = fly(1000)
    with tempfile.TemporaryDirectory() as folder:
        return [*write_rows(Path(folder), flown, seconds), *read_rows(Path(folder), flown, round(minutes * 60 / TICK))]


def fly(ticks: int) -> list[list[bytes]]:
    """Messages of every tick, in the order of TYPES."""
    aircraft = Aircraft.load("sbs")
    hover = trim(aircraft)
    simulation = Simulation(aircraft, trimmed_state(aircraft, hover), hover.swashplate, tick=TICK)
    messages = StateMessages(aircraft)
    flown = []
    for _ in range(ticks):
        simulation.advance()
        messages.fill(simulation.snapshot())
        status = SimulationStatus(sim_time=simulation.time, steps=simulation.step)
        parts = (messages.state, messages.rotors, messages.inflow, messages.odom, status)
        flown.append([serialize_message(part) for part in (*parts, Clock(clock=to_time(simulation.time)))])
    return flown


def new_log(path: Path) -> tuple[LogWriter, list[int]]:
    """A recording with its channels."""

    def find_file(package: str, name: str) -> Path:
        return Path(get_package_share_directory(package)) / name

    log = LogWriter(path, library="benchmark", wall_start=time.time_ns())
    return log, [
        log.add_channel(topic, name, message_definition(name, find_file), qos_profiles())
        for topic, name in TYPES.items()
    ]


def write_rows(folder: Path, flown: list[list[bytes]], seconds: float) -> list[Row]:
    """Price of a message, share of a core in real time, and how much goes through."""
    log, channels = new_log(folder / "calls.mcap")
    prices = []
    for number in range(200):
        start = time.perf_counter()
        for tick in flown[number % 990 : number % 990 + 10]:
            for channel, data in zip(channels, tick, strict=True):
                log.write(channel, number, data)
        prices.append((time.perf_counter() - start) / 60)
        time.sleep(0.01)
    log.close()
    high = statistics.quantiles(prices, n=20)[-1]
    note = f"95 % of all below {high * 1e6:.1f} us"
    rows: list[Row] = [("log: write, in the calling thread", statistics.median(prices) * 1e6, "us", note)]

    idle = cpu_of(lambda tick, number: None, flown, seconds)
    log, channels = new_log(folder / "real_time.mcap")

    def write_tick(tick: list[bytes], number: int) -> None:
        for channel, data in zip(channels, tick, strict=True):
            log.write(channel, number * NANOSECONDS, data)

    busy = cpu_of(write_tick, flown, seconds)
    log.close()
    note = f"of a core; {busy * 100:.2f} % less {idle * 100:.2f} % idle"
    rows.append(("log: 600 messages/s", (busy - idle) * 100, "%", note))

    log, channels = new_log(folder / "throughput.mcap")
    count, size, start = 50_000, 0, time.perf_counter()
    for number in range(count):
        for channel, data in zip(channels, flown[number % len(flown)], strict=True):
            log.write(channel, number * NANOSECONDS, data, wait=True)
            size += len(data)
    log.close(60.0)
    took = time.perf_counter() - start
    note = f"messages/s, {size / took / 1e6:.0f} MB/s, {log.dropped} dropped"
    return [*rows, ("log: throughput", count * len(TYPES) / took, "/s", note)]


def cpu_of(act: Callable[[list[bytes], int], None], flown: list[list[bytes]], seconds: float) -> float:
    """Share of a core that this process takes while it acts at every tick in real time."""
    start, cpu = time.monotonic(), time.process_time()
    number = 0
    while (now := time.monotonic() - start) < seconds:
        if number * TICK > now:
            time.sleep(number * TICK - now)
        act(flown[number % len(flown)], number)
        number += 1
    return (time.process_time() - cpu) / (time.monotonic() - start)


def read_rows(folder: Path, flown: list[list[bytes]], ticks: int) -> list[Row]:
    """Time to read and to recover a long flight."""
    path = folder / "flight.mcap"
    log, channels = new_log(path)
    for number in range(ticks):
        for channel, data in zip(channels, flown[number % len(flown)], strict=True):
            log.write(channel, number * NANOSECONDS, data, wait=True)
    log.close(60.0)
    size = path.stat().st_size / 1e6
    start = time.perf_counter()
    found = read(path)
    scanned = time.perf_counter()
    for topic in found.values():
        len(topic)
    decoded = time.perf_counter()
    note = f"{ticks * len(TYPES)} messages, {size:.0f} MB; {scanned - start:.2f} s of it the file, the rest all fields"
    rows: list[Row] = [(f"log: reading {ticks * TICK / 60:g} min", decoded - start, "s", note)]
    start = time.perf_counter()
    recover(path, folder / "recovered.mcap")
    note = "read, written, read again"
    return [*rows, (f"log: recovering {ticks * TICK / 60:g} min", time.perf_counter() - start, "s", note)]


if __name__ == "__main__":
    main()
