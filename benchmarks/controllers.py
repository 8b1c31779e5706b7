"""Times flights with a controller in the loop: `./run python benchmarks/controllers.py --help`.

The same turbulence in five ways: a pool of processes around `simulate_with_pilot`, as a user would write it, with the
hover hold and with the law of the envelope controller; the same pool around `simulate`; a batch whose law is asked from
Python; and a batch. The last four fly the same, to the last bit. Time of the processor is what other programs disturb
least.
"""

import argparse
import functools
import os
import resource
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from multiprocessing import get_context

import numpy as np

from sbs_sim import Aircraft, Case, Controller, LinearModel, TrimPoint, linearize, simulate, simulate_batch, trim
from sbs_sim.model.wind import Wind
from sbs_sim.pilot.envelope import design_envelope
from sbs_sim.pilot.hover_hold import HoverHold, HoverModel, design
from sbs_sim.pilot.law_pilot import LawPilot
from sbs_sim.pilot.piloted_flight import simulate_with_pilot

Row = tuple[str, float, float, float, str]
HERE = [0.0, 1.0, 0.0, 0.0, 0.0, 0.0]  # command: stay at the origin


def air(seed: int) -> Wind:
    """Turbulence of a flight."""
    return Wind(turbulence_intensity=(1.5, 1.5, 1.5), turbulence_seed=seed)


@functools.cache
def start() -> tuple[Aircraft, TrimPoint, LinearModel]:
    """Aircraft, its hover and the linear model of it, once in a process."""
    aircraft = Aircraft.load("sbs")
    return aircraft, trim(aircraft), linearize(aircraft)


def held(seed: int, duration: float, which: str) -> float:
    """Fly one hover hold in a process of a pool; the height at its end [m]."""
    aircraft, point, model = start()
    if which == "hover_hold":
        pilot = HoverHold(design(HoverModel.of(model)))
        pilot.hold(np.zeros(3), 0.0)
        return float(simulate_with_pilot(aircraft, point, pilot.controls, duration, wind=air(seed))["down"][-1])
    own = design_envelope(aircraft, [model]).controller(HERE, delay=0.01)
    if which == "pilot":
        flight = simulate_with_pilot(aircraft, point, LawPilot(own, point.controls), duration, delay=1, wind=air(seed))
        return float(flight["down"][-1])
    return float(simulate(aircraft, point, own, duration, wind=air(seed))["down"][-1])


def by_pool(flights: int, duration: float, which: str, workers: int) -> list[float]:
    """One flight after the other in a pool of processes."""
    with ProcessPoolExecutor(workers, get_context("spawn")) as pool:
        return list(pool.map(held, range(flights), [duration] * flights, [which] * flights))


def by_batch(flights: int, duration: float, workers: int, in_python: bool = False) -> list[float]:
    """All at once."""
    aircraft, point, model = start()
    own: Controller = design_envelope(aircraft, [model]).controller(HERE, delay=0.01)
    if in_python:
        law = own.law
        own = replace(own, law=lambda *arguments: law(*arguments))  # what is called from Python, is of Python
    cases = [Case(aircraft, point, own, air(seed)) for seed in range(flights)]
    batch = simulate_batch(cases, duration, every=10, outputs=["state"], workers=workers)
    return [float(value) for value in batch["down"][:, -1]]


def spent() -> float:
    """Time of the processor so far, of this process and those that have ended [s]."""
    kinds = (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)
    return sum(usage.ru_utime + usage.ru_stime for usage in map(resource.getrusage, kinds))


def main() -> None:
    """Print flights per second of every way."""
    cores = len(os.sched_getaffinity(0))
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--flights", type=int, default=200, help="of the batch (default: 200)")
    parser.add_argument("--few", type=int, default=16, help="of the slower ways (default: 16)")
    parser.add_argument("--duration", type=float, default=20.0, help="of a flight [s] (default: 20)")
    parser.add_argument("--workers", type=int, default=cores, help=f"processes or threads (default: {cores})")
    given = parser.parse_args()
    print(f"load {os.getloadavg()[0]:.2f}")
    print(f"{'':44}{'flights':>8}{'wall s':>8}{'per s':>8}{'CPU s each':>12}")
    rows = controller_rows(given.flights, given.few, given.duration, given.workers)
    for name, count, wall, processor, note in rows:
        print(f"{name:44}{count:8.0f}{wall:8.1f}{count / wall:8.2f}{processor / count:12.3f}  {note}")
    slowest, fastest = rows[0], rows[-1]
    ratio = (fastest[1] / fastest[2]) / (slowest[1] / slowest[2])
    by_processor = (slowest[3] / slowest[1]) / (fastest[3] / fastest[1])
    print(f"batch over pool around simulate_with_pilot: {ratio:.1f} x, by time of the processor {by_processor:.1f} x")


def controller_rows(flights: int, few: int, duration: float, workers: int) -> list[Row]:
    """Name, flights, seconds, seconds of the processor and a remark of every way."""
    ways: list[tuple[str, int, Callable[[int], list[float]]]] = [
        ("pool, simulate_with_pilot, hover hold", few, lambda n: by_pool(n, duration, "hover_hold", workers)),
        ("pool, simulate_with_pilot, compiled law", few, lambda n: by_pool(n, duration, "pilot", workers)),
        ("pool, simulate, compiled law", few, lambda n: by_pool(n, duration, "law", workers)),
        ("batch, law of Python", few, lambda n: by_batch(n, duration, workers, in_python=True)),
        ("batch, compiled law", flights, lambda n: by_batch(n, duration, workers)),
    ]
    by_batch(2 * workers, 0.1, workers)  # loads and compiles
    rows: list[Row] = []
    ends: dict[str, list[float]] = {}
    for name, count, fly in ways:
        before, begin = spent(), time.perf_counter()
        ends[name] = fly(count)
        rows.append((name, float(count), time.perf_counter() - begin, spent() - before, ""))
    last = ends[ways[-1][0]]
    marks = {name: "the same bits as the batch" if ends[name] == last[: len(ends[name])] else "" for name in ends}
    return [(*row[:4], marks[row[0]]) if row[0] != ways[-1][0] else row for row in rows]


if __name__ == "__main__":
    main()
