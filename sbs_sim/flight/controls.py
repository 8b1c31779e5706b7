"""Pilot controls of a flight: a constant, rows, or a function of time."""

from __future__ import annotations  # `help` then shows types by their names

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sbs_sim import checks
from sbs_sim.aircraft import Aircraft
from sbs_sim.errors import SimulationError
from sbs_sim.flight.mixer import check_controls

Array = NDArray[np.float64]
Commands = ArrayLike | Callable[[float], ArrayLike]
Command = Callable[[int, float], Array]  # of a tick, and its time [s]


def command(aircraft: Aircraft, controls: Commands) -> Command:
    """Controls of tick i at a time, whatever way they were given."""
    if callable(controls):
        function = controls

        def by_time(_: int, time: float) -> Array:
            return _checked(aircraft, function(time))

        return by_time
    rows = np.atleast_2d(checks.array("controls", controls, SimulationError))
    count = len(aircraft.controls)
    if rows.ndim != 2 or rows.shape[1] != count or len(rows) == 0:
        raise SimulationError(f"controls have shape {np.shape(controls)}: allowed are ({count},) and (n, {count})")
    for row in rows:
        check_controls(aircraft, row)
    return lambda i, _: rows[min(i, len(rows) - 1)]


def check_rows(controls: Commands, ticks: int, tick: float) -> None:
    """Raise SimulationError for rows of controls that would not be flown."""
    if not callable(controls) and np.ndim(controls) == 2 and len(np.asarray(controls)) > ticks + 1:
        rows = len(np.asarray(controls))
        raise SimulationError(
            f"controls have {rows} rows: allowed are up to {ticks + 1}, one for each tick of {tick:g} s and the end"
        )


def _checked(aircraft: Aircraft, values: ArrayLike) -> Array:
    array = checks.array("controls", values, SimulationError)
    check_controls(aircraft, array)
    return array
