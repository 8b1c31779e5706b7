"""Times the derivative against a plain numba one of the same equations: `./run python benchmarks/plain_ratio.py`.

The plain one is test/support/plain_kernel.py. Both are called in turn in one run, so that whatever else the machine
does meets both, and the figure is the median of the ratios of neighbours.
"""

import statistics
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from sbs_sim import Aircraft, trim
from sbs_sim.flight.engine import Engine
from sbs_sim.flight.trimmed_state import trimmed_state
from sbs_sim.model.average import averaged_derivative, azimuths
from sbs_sim.model.records import LOAD_SIZE

TEST_FOLDER = Path(__file__).resolve().parent.parent / "test" / "support"
PAIRS, SLICE = 101, 0.004  # [s] of one side of a pair
Row = tuple[str, float, str, str]
Call = Callable[[int], Any]


def main() -> None:
    """Print the rows of `sbs` in hover and at 10 m/s."""
    aircraft = Aircraft.load("sbs")
    for name, speed in (("hover", 0.0), ("10 m/s", 10.0)):
        for title, value, unit, note in plain_rows(aircraft, trim(aircraft, airspeed=speed), name):
            print(f"{title:<32}  {value:>8.4g} {unit:<4} {note}")


def plain_rows(aircraft: Aircraft, point: Any, name: str) -> list[Row]:
    """Time of one plain derivative, and its ratio to that of the package.

    Raises
    ------
    ValueError
        The two are not equal.
    """
    x = trimmed_state(aircraft, point)
    fast, fast_rates = package_calls(aircraft, x, point.swashplate)
    plain, plain_rates = plain_calls(aircraft, x, point.swashplate)
    fast(12)
    plain(12)
    difference = np.abs(fast_rates - plain_rates).max()
    if not difference < 1e-8:
        raise ValueError(f"the two derivatives differ by {difference:.1e}")
    times, ratios = timed_in_turn(plain, fast)
    low, median, high = statistics.quantiles(ratios, n=4)
    return [
        (f"plain derivative, {name}", 1e6 * times, "us", "test/support/plain_kernel.py, without the loads of the hubs"),
        (
            f"  over the derivative, {name}",
            median,
            "x",
            f"median of {len(ratios)} pairs, middle half within {100 * (high - low) / median:.0f} %",
        ),
    ]


def package_calls(aircraft: Aircraft, x: Any, swash: Any) -> tuple[Call, Any]:
    """The package's derivative, called a number of times by compiled code, and the array of the mean rates."""
    engine = Engine(aircraft.arranged(True, True, "blades"))
    code, angles, still_air = engine.code.derivative, np.ravel(swash), np.zeros(3)
    rates, loads = np.zeros(len(x) + 3), np.zeros(len(aircraft.rotors) * LOAD_SIZE)

    def call(calls: int) -> None:
        psi = azimuths(aircraft.layout.blades, calls)
        averaged_derivative(code, engine.model, x, angles, psi, still_air, engine.work, engine.tick, rates, loads)

    return call, rates[: len(x)]


def plain_calls(aircraft: Aircraft, x: Any, swash: Any) -> tuple[Call, Any]:
    """The same of the plain kernel."""
    sys.path.append(str(TEST_FOLDER))
    from plain_kernel import make_params, make_work, mean_rates

    p, work, rates = make_params(aircraft), make_work(aircraft), np.zeros_like(x)
    slope, psi = np.zeros_like(x), np.zeros(len(aircraft.rotors))
    return lambda calls: mean_rates(p, x, swash, calls, np.zeros(3), True, True, work, psi, slope, rates), rates


def timed_in_turn(first: Call, second: Call) -> tuple[float, list[float]]:
    """Median time of one call of the first [s], and the ratio of the first to the second in every pair.

    What a thread has computed is counted, and both sides of a pair take as long: on a busy machine the one that takes
    longer would be interrupted more often.
    """
    counts = [max(1, round(200 * SLICE / seconds(call, 200))) for call in (first, second)]
    times, ratios = [], []
    for _ in range(PAIRS):
        one, other = (seconds(call, count) / count for call, count in zip((first, second), counts, strict=True))
        times.append(one)
        ratios.append(one / other)
    return statistics.median(times), ratios


def seconds(call: Call, count: int) -> float:
    """Time of the processor that one run takes [s]."""
    start = time.thread_time()
    call(count)
    return time.thread_time() - start


if __name__ == "__main__":
    main()
