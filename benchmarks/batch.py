"""Times a batch of flights on one and on all cores: `./run python benchmarks/batch.py --help`.

One thread, several threads, and as many processes of one thread each, which share nothing, take turns: the processes
show what perfect scaling is while other programs are at work, and the threads are compared with both.
"""

import argparse
import os
import resource
import statistics
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

from sbs_sim import Aircraft, Case, simulate_batch, trim
from sbs_sim.model.wind import Wind

Row = tuple[str, float, str, str]


def fly(first: int, count: int, duration: float, threads: int) -> int:
    """Fly gust flights with the seeds from `first` on; how many there were."""
    aircraft = Aircraft.load("sbs")
    point = trim(aircraft, airspeed=15.0)
    cases = [
        Case(aircraft, point, wind=Wind(turbulence_intensity=(1.5, 1.5, 1.5), turbulence_seed=first + i))
        for i in range(count)
    ]
    batch = simulate_batch(cases, duration, every=10, outputs=["state"], workers=threads)
    return len(batch.cases)


def memory(flights: int, duration: float) -> tuple[float, float]:
    """Peak memory that flights take in this process, with all outputs of every tick, and that of the histories [MB]."""
    aircraft = Aircraft.load("sbs")
    point = trim(aircraft)
    simulate_batch([Case(aircraft, point)] * 16, 0.1)
    before = int(Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize()
    batch = simulate_batch([Case(aircraft, point)] * flights, duration)
    peak = 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
    return peak / 1e6, sum(values.nbytes for values in batch.histories.values()) / 1e6


def main() -> None:
    """Print flights per second and how near the scaling comes to the number of cores."""
    cores = len(os.sched_getaffinity(0))
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--flights", type=int, default=8, help="of each thread (default: 8)")
    parser.add_argument("--duration", type=float, default=5.0, help="of a flight [s] (default: 5)")
    parser.add_argument("--rounds", type=int, default=9, help="of which medians are taken (default: 9)")
    parser.add_argument("--threads", type=int, default=cores, help=f"beside one (default: {cores}, the cores)")
    given = parser.parse_args()
    print(f"load {os.getloadavg()[0]:.2f}")
    for name, value, unit, note in batch_rows(given.flights, given.duration, given.rounds, given.threads):
        print(f"{name:40} {value:8.4g} {unit:9} {note}")


def batch_rows(flights: int, duration: float, rounds: int, many: int) -> list[Row]:
    """Rows of the table: flights per second one by one and side by side, and the share of perfect scaling."""
    with ProcessPoolExecutor(many, get_context("spawn")) as pool:

        def processes() -> int:
            parts = [pool.submit(fly, i * flights, flights, duration, 1) for i in range(many)]
            return sum(part.result() for part in parts)

        ways: dict[str, Callable[[], int]] = {
            "1 thread": lambda: fly(0, flights, duration, 1),
            f"{many} threads": lambda: fly(0, many * flights, duration, many),
            f"{many} processes": processes,
        }
        rates = measured(ways, rounds)
    with ProcessPoolExecutor(1, get_context("spawn")) as pool:
        peak, held = pool.submit(memory, 200, 10.0).result()
    rows: list[Row] = []
    for name, found in rates.items():
        rate = statistics.median(found)
        rows.append((f"batch, {name}", rate, "flights/s", f"of {duration:g} s: {rate * duration:.0f} x real time"))
    one, threads, apart = rates.values()
    for name, perfect in ((f"{many} x 1 thread", [many * rate for rate in one]), (f"{many} processes", apart)):
        shares = [100 * rate / best for rate, best in zip(threads, perfect, strict=True)]
        note = f"median of {rounds} rounds, best {max(shares):.0f} %"
        rows.append((f"  {many} threads, of {name}", statistics.median(shares), "%", note))
    rows.append(("batch of 200 flights of 10 s, memory", peak, "MB", f"at its peak; {held:.0f} MB are the histories"))
    return rows


def measured(ways: dict[str, Callable[[], int]], rounds: int) -> dict[str, list[float]]:
    """Flights per second of every way, round by round."""
    rates: dict[str, list[float]] = {name: [] for name in ways}
    for i in range(rounds + 1):
        for name, work in ways.items():
            start = time.perf_counter()
            count = work()
            if i > 0:  # the first round loads and compiles
                rates[name].append(count / (time.perf_counter() - start))
    return rates


if __name__ == "__main__":
    main()
