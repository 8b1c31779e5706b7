"""Errors and times of all methods and steps over flight conditions: `./run python benchmarks/step_errors.py`.

Five seconds from a trim with doublets on collective and both cyclics, in still air and in turbulence. Errors are the
largest on the way against a step of half a degree.
"""

import math
import time
from typing import Any

import numpy as np

from sbs_sim import Aircraft, simulate, trim
from sbs_sim.flight.trim_point import TrimPoint
from sbs_sim.model import state as S
from sbs_sim.model.wind import Wind

Row = tuple[str, float, str, str]

DURATION, TICK = 5.0, 0.01  # s
DOUBLETS = ((0, 0.5), (1, 1.7), (2, 2.9))  # control, start [s]: a degree up for half a second, then down
AIR = Wind(turbulence_intensity=(1.5, 1.5, 1.5), turbulence_seed=3)
CONDITIONS: dict[str, tuple[float, Wind | None]] = {
    "hover": (0.0, None),
    "10 m/s": (10.0, None),
    "15 m/s": (15.0, None),
    "20 m/s": (20.0, None),
    "15 m/s, turbulence": (15.0, AIR),
}
STEPS = (
    *(("rk4", degrees) for degrees in (2.5, 5.0, 10.0)),
    *(("tsit5", degrees) for degrees in (7.2, 14.4, 28.8)),
    *(("etd", degrees) for degrees in (7.2, 14.4, 20.6, 28.8, 36.0)),
)
REFERENCE = ("rk4", 0.5)
SHORT = ("hover", "15 m/s")  # in the table of `run.py`


def step_rows(aircraft: Aircraft, conditions: tuple[str, ...] = SHORT) -> list[Row]:
    """Real-time factor of a manoeuvre and the largest errors on the way, for all steps."""
    rows: list[Row] = []
    for name in conditions:
        airspeed, wind = CONDITIONS[name]
        point = trim(aircraft, airspeed)
        reference, _ = flown(aircraft, point, wind, *REFERENCE)
        for method, degrees in STEPS:
            runs = [flown(aircraft, point, wind, method, degrees) for _ in range(3)]
            body, every = errors(runs[0][0], reference)
            note = f"{DURATION:g} s of doublets, largest error on the way: body {body:.1e}, all states {every:.1e}"
            factor = DURATION / float(np.median([seconds for _, seconds in runs]))
            rows.append((f"simulate, {name}, {method} {degrees:g} deg", factor, "x real", note))
    return rows


def errors(states: Any, reference: Any) -> tuple[float, float]:
    """Largest error of the body's velocities [m/s, rad/s], and of all states but position and attitude."""
    error = np.abs(states - reference)
    return float(error[:, S.VELOCITY : S.BODY_SIZE].max()), float(error[:, S.VELOCITY :].max())


def flown(aircraft: Aircraft, point: TrimPoint, wind: Wind | None, method: str, degrees: float) -> tuple[Any, float]:
    """States of a flight and the time of the processor that it took [s]."""
    controls, start = doublets(point), time.thread_time()
    options: dict[str, Any] = {"azimuth_step": math.radians(degrees), "method": method, "wind": wind}
    flight = simulate(aircraft, point, controls, DURATION, tick=TICK, **options)
    return flight["state"], time.thread_time() - start


def doublets(point: TrimPoint) -> Any:
    """Controls of every tick [rad], shape (ticks + 1, 4)."""
    controls = np.tile(point.controls, (round(DURATION / TICK) + 1, 1))
    at = TICK * (np.arange(len(controls)) + 0.5)
    for control, start in DOUBLETS:
        since = at - start
        up, down = (since > 0.0) & (since < 0.5), (since > 0.5) & (since < 1.0)
        controls[:, control] += math.radians(1.0) * (up * 1.0 - down * 1.0)
    return controls


def main() -> None:
    """Print a table."""
    aircraft = Aircraft.load("sbs")
    found = {name: step_rows(aircraft, (name,)) for name in CONDITIONS}
    print(f"{'':14}" + "".join(f"{name:>28}" for name in found))
    for i, (method, degrees) in enumerate(STEPS):
        cells = [rows[i] for rows in found.values()]
        texts = [f"{note.split('body ')[1].replace(' all states', '')} x{factor:.0f}" for _, factor, _, note in cells]
        print(f"{method:6}{degrees:5g} deg" + "".join(f"{text:>28}" for text in texts))


if __name__ == "__main__":
    main()
