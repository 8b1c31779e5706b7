"""Times of the derivative and of flights, and how the cost grows with the aircraft."""

import copy
import math
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from plain_ratio import package_calls, plain_rows
from step_errors import step_rows

from sbs_sim import Aircraft, trim
from sbs_sim.flight.trimmed_state import trimmed_state
from sbs_sim.model import state as S

Row = tuple[str, float, str, str]
Timed = Callable[..., tuple[float, str]]

CALLS = 1000


def model_rows(timed: Timed) -> list[Row]:
    """Rows of the table; `timed` gives the median time of a call [s] and a note."""
    aircraft = Aircraft.load("sbs")
    points = {"hover": trim(aircraft), "10 m/s": trim(aircraft, airspeed=10.0)}
    elements = sum(rotor.blades for rotor in aircraft.rotors) * aircraft.options.elements
    rows: list[Row] = [("blade elements", elements, "", "with a look-up of cl and cd (Re, alpha) each")]
    for name, point in points.items():
        seconds, note = timed(
            derivatives(aircraft, trimmed_state(aircraft, point), point.swashplate), 21, time.thread_time
        )
        rows += [(f"derivative, {name}", 1e6 * seconds / CALLS, "us", note), *plain_rows(aircraft, point, name)]
    return [*rows, *step_rows(aircraft), *growth_rows(aircraft, timed)]


def derivatives(aircraft: Aircraft, x: Any, swash: Any) -> Callable[[], None]:
    """Many complete derivatives, all over the azimuth."""
    call, _ = package_calls(aircraft, x, swash)
    return lambda: call(CALLS)


# --- growth -----------------------------------------------------------------------------------------------------


def growth_rows(aircraft: Aircraft, timed: Timed) -> list[Row]:
    """Time of a derivative over the number of elements and of rotors."""
    rows: list[Row] = []
    for rotors in (1, 2, 4):
        for elements in (10, 20, 40):
            grown = with_size(aircraft, rotors, elements)
            x = np.zeros(grown.layout.size)
            x[S.ATTITUDE] = 1.0
            for j in range(rotors):
                x[grown.layout.inflow(j)] = 0.05, 0.0, 0.0
            swash = np.full((rotors, 3), [math.radians(9.0), 0.0, 0.0])
            seconds, note = timed(derivatives(grown, x, swash), 21, time.thread_time)
            each = 1e9 * seconds / CALLS / (rotors * grown.rotors[0].blades * elements)
            note = f"{each:.1f} ns per blade element; {note}"
            rows.append((f"derivative, {rotors} rotors x {elements} elements", 1e6 * seconds / CALLS, "us", note))
    return rows


def with_size(aircraft: Aircraft, rotors: int, elements: int) -> Aircraft:
    """Aircraft with so many rotors and elements along a blade; rotors beyond the given ones lie behind these."""
    data = copy.deepcopy(aircraft.data)
    data["options"]["elements"] = elements
    given = data["rotors"]
    data["rotors"] = [copy.deepcopy(given[j % len(given)]) for j in range(rotors)]
    for j, rotor in enumerate(data["rotors"]):
        rotor["name"] = f"MR{j + 1}"
        rotor["hub"][0] -= 1.0 * (j // len(given))
    return Aircraft.from_dict(data, aircraft.folder)
