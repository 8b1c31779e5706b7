"""Time of a point of a frequency response, by the harmonic model and by flights.

The flights have a control that swings with an amplitude of 0.001 rad, and none; the difference of both over the last
two of three periods is the response. Hub loads at 3/rev and accelerations cost nothing more, neither here nor there.
"""

import math
import statistics
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from sbs_sim import Aircraft, simulate, trim
from sbs_sim.analysis.harmonic import periodic_model

HARMONICS, POINTS = 2, 200
SWING, PERIODS = 1e-3, 3  # rad
FREQUENCIES = (3.0, 10.0, 100.0)  # rad/s; without a controller slower swings end in a tumble


def main() -> None:
    """Print the table."""
    aircraft = Aircraft.load("sbs")
    point = trim(aircraft, airspeed=20.0)
    periodic = periodic_model(aircraft, point).with_points({"seat": (0.3, 0.0, -0.2)})
    asked = np.geomspace(0.1, 1000.0, POINTS)
    made = timed(lambda: periodic_model(aircraft, point))
    model = periodic.harmonic(HARMONICS)

    def fresh() -> None:
        periodic.harmonic(HARMONICS).response("collective", "specific_force_z(seat)", 1, asked)

    def again() -> None:
        model.response("collective", "specific_force_z(seat)", 1, asked)

    again()
    alone, each = timed(fresh) / POINTS, timed(again) / POINTS
    print(f"periodic model of {len(periodic.a)} instants: {1e3 * made:.3g} ms, {len(model.hill)} states of harmonics")
    print(f"a point of {POINTS}: {1e6 * each:.3g} us, with the model from its harmonics {1e6 * alone:.3g} us")
    for frequency in FREQUENCIES:
        seconds = 2.0 * timed(lambda frequency=frequency: swing(aircraft, point, frequency))
        print(
            f"by two flights of {PERIODS} periods at {frequency:g} rad/s: {1e3 * seconds:.3g} ms,"
            f" {seconds / each:.2g} times as long, with the model from its harmonics {seconds / alone:.2g} times"
        )


def swing(aircraft: Aircraft, point: Any, frequency: float) -> None:
    """Fly with a control that swings."""
    duration = PERIODS * 2.0 * math.pi / frequency
    tick = min(0.01, duration / PERIODS / 16.0)
    times = np.arange(round(duration / tick)) * tick
    controls = np.repeat(point.controls[np.newaxis], len(times), axis=0)
    controls[:, 0] += SWING * np.sin(frequency * times)
    simulate(aircraft, point, controls, len(times) * tick, tick=tick)


def timed(work: Callable[[], Any]) -> float:
    """Median time of five calls [s]."""
    found = []
    for _ in range(5):
        start = time.perf_counter()
        work()
        found.append(time.perf_counter() - start)
    return statistics.median(found)


if __name__ == "__main__":
    main()
