"""Stitched models against the full one: times real time on one core."""

import time
from collections.abc import Callable
from typing import Any

import numpy as np

from sbs_sim import Aircraft, simulate, trim
from sbs_sim.analysis.stitched import stitch
from sbs_sim.flight.stitched_simulation import StitchedSimulation, simulate_stitched

Row = tuple[str, float, str, str]
Timed = Callable[[Callable[[], Any], int], tuple[float, str]]

AIRSPEEDS, FLIGHT, TICK, EVERY = np.linspace(-4.0, 20.0, 13), 60.0, 0.02, 50
FULL_FLIGHT = 5.0  # s; the full model does not hold its trim for ever


def stitched_rows(timed: Timed) -> list[Row]:
    """Rows of the table; `timed` gives the median time of a call [s] and a note."""
    aircraft = Aircraft.load("sbs")
    point = trim(aircraft, 10.0)
    seconds, note = timed(lambda: simulate(aircraft, point, point.controls, FULL_FLIGHT, tick=TICK), 5)
    full = FULL_FLIGHT / seconds
    rows: list[Row] = [("full model, one core", full, "x", f"times real time; {note}")]
    for states, name in (("body", "8 states"), ("all", "38 states")):
        start = time.perf_counter()
        model = stitch(aircraft, AIRSPEEDS, states=states, workers=1)
        rows.append((f"stitch 13 airspeeds, {name}", time.perf_counter() - start, "s", "one core, trims included"))
        state, swash = model.trim(10.0)
        angles = np.tile(swash, (round(FLIGHT / TICK), 1, 1))

        def fly(model: Any = model, state: Any = state, swash: Any = swash, angles: Any = angles) -> Any:
            simulation = StitchedSimulation(model, state, swash, tick=TICK)
            return simulation.fly(angles, len(angles), EVERY)

        controls = aircraft.unmix(swash)

        def history(model: Any = model, controls: Any = controls) -> Any:
            return simulate_stitched(model, 10.0, controls, FLIGHT, tick=TICK, every=EVERY)

        for work, what in ((fly, "rows once a second"), (history, "with its histories")):
            seconds, note = timed(work, 9)
            speed = FLIGHT / seconds
            text = f"times real time, {what}; {speed / full:.0f} x the full model; {note}"
            rows.append((f"stitched model, {name}", speed, "x", text))
    return rows


if __name__ == "__main__":
    from run import print_table, timed

    print_table(stitched_rows(timed))
