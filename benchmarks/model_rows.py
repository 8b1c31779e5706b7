"""Times of the derivative and of flights in time, the error of each step, and how the cost grows with the aircraft."""

import copy
import math
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from plain_ratio import package_calls, plain_rows

from sbs_sim import Aircraft, simulate, trim
from sbs_sim.analysis.trim import TrimPoint
from sbs_sim.model import state as S
from sbs_sim.simulation import trimmed_state

Row = tuple[str, float, str, str]
Timed = Callable[..., tuple[float, str]]

CALLS = 1000
DURATION, TICK = 10.0, 0.01  # s
DOUBLETS = ((0, 0.0), (1, 2.0), (2, 4.0))  # control, start [s]: a degree up for half a second, then down
STEPS = (
    ("rk4", 1.0),
    ("rk4", 2.5),
    ("rk4", 5.0),
    ("rk4", 10.0),
    ("tsit5", 7.2),
    ("tsit5", 14.4),
    ("tsit5", 28.8),
    ("tsit5", 36.0),
)
REFERENCE = ("rk4", 0.5)


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
    return [*rows, *integration_rows(aircraft, points["hover"]), *growth_rows(aircraft, timed)]


def derivatives(aircraft: Aircraft, x: Any, swash: Any) -> Callable[[], None]:
    """Many complete derivatives, all over the azimuth."""
    call, _ = package_calls(aircraft, x, swash)
    return lambda: call(CALLS)


# --- flights ----------------------------------------------------------------------------------------------------


def integration_rows(aircraft: Aircraft, hover: TrimPoint) -> list[Row]:
    """Real-time factor of ten seconds of manoeuvre and the largest error on the way, for several steps."""
    controls = np.tile(hover.controls, (round(DURATION / TICK) + 1, 1))
    at = TICK * np.arange(len(controls))
    for control, start in DOUBLETS:
        since = at - start + 0.5 * TICK
        controls[:, control] += math.radians(1.0) * (
            ((since > 0) & (since < 0.5)) * 1.0 - ((since > 0.5) & (since < 1))
        )
    reference, _ = flown(aircraft, hover, controls, *REFERENCE)
    rows: list[Row] = []
    for method, degrees in STEPS:
        flown(aircraft, hover, controls[:2], method, degrees)
        runs = [flown(aircraft, hover, controls, method, degrees) for _ in range(3)]
        error = np.abs(runs[0][0] - reference)
        body, every = error[:, S.VELOCITY : S.BODY_SIZE].max(), error[:, S.VELOCITY :].max()
        note = f"{DURATION:g} s of doublets, largest error on the way: body {body:.1e}, all states {every:.1e}"
        factor = (len(controls) - 1) * TICK / float(np.median([seconds for _, seconds in runs]))
        rows.append((f"simulate, {method} {degrees:g} deg", factor, "x real", note))
    return rows


def flown(aircraft: Aircraft, hover: TrimPoint, controls: Any, method: str, degrees: float) -> tuple[Any, float]:
    """States of a flight and the time of the processor that it took [s]."""
    start, duration = time.thread_time(), TICK * (len(controls) - 1)
    flight = simulate(aircraft, hover, controls, duration, tick=TICK, azimuth_step=math.radians(degrees), method=method)
    return flight["state"], time.thread_time() - start


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
