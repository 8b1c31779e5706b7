"""Performance of an aircraft in steady flight: power, speeds, climb, ceilings, and the limits of all that.

What stops a flight is the first of: no trim, a control or swashplate beyond its range, stall on more than a tenth of a
disc, and more shaft power than there is (theory.md section 8.7).
"""

from __future__ import annotations  # `help` then shows types by their names

import csv
import io
import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sbs_sim import checks
from sbs_sim.aircraft import Aircraft
from sbs_sim.analysis.trim import solve_trim
from sbs_sim.concurrency.parallel import Execution, compute
from sbs_sim.content import ByContent
from sbs_sim.errors import SbsError, SweepError
from sbs_sim.flight.trim_point import Fidelity, TrimCondition
from sbs_sim.flight.validity import STALL

Array = NDArray[np.float64]

MASS, ALTITUDE = "body.mass", "environment.altitude"
NO_TRIM, CONTROLS, STALLED, POWER = LIMITS = ("no trim", "controls", "stall", "power")
HIGHEST = 11_000.0  # m, top of the troposphere
FASTEST, STEEPEST = 100.0, 50.0  # m/s, of what is looked for
ALTITUDE_STEP, SPEED_STEP = 5.0, 0.02  # m, m/s, to which boundaries are found
MAX_VALUES = 1000
COLUMNS = ("chart", "mass_kg", "altitude_m", "airspeed_m_s", "climb_rate_m_s", "power_W", "limit")


class State(NamedTuple):
    """A steady flight, or why there is none.

    Attributes
    ----------
    power : float
        Shaft power of all rotors [W]; not a number without a trim.
    limit : str
        One of `LIMITS`, empty where it can be flown.
    """

    power: float
    limit: str


class Boundary(NamedTuple):
    """The last value that can be flown, and what stops the next; not a number where none can."""

    value: float
    limit: str
    power: float


@dataclass(frozen=True, eq=False)
class Performance(ByContent):
    """Charts of an aircraft.

    Attributes
    ----------
    name : str
        Of the aircraft.
    available : float
        Shaft power that there is [W]; infinite where it does not count.
    airspeeds, masses, altitudes : ndarray, shapes (n,), (m,), (k,)
        [m/s, kg, m]
    level : tuple of State, length n
        Level flight of the aircraft as it is.
    map : tuple of tuple of State, m of length n
        Level flight at every mass.
    climbs : tuple of Boundary, length n
        Highest climb rate at every airspeed [m/s].
    ceilings : tuple of Boundary, length m
        Highest altitude of hover at every mass [m].
    fastest : tuple of Boundary, length k
        Highest airspeed at every altitude [m/s].
    endurance, range : tuple of float, or None
        Airspeed [m/s] and power [W] of least power, and of least power over airspeed; None where the ends of the
        airspeeds have it.
    """

    name: str
    available: float
    airspeeds: Array
    masses: Array
    altitudes: Array
    level: tuple[State, ...]
    map: tuple[tuple[State, ...], ...]
    climbs: tuple[Boundary, ...]
    ceilings: tuple[Boundary, ...]
    fastest: tuple[Boundary, ...]
    endurance: tuple[float, float] | None
    range: tuple[float, float] | None

    def to_csv(self) -> str:
        """Everything as one table, a row for each point of a chart."""
        file = io.StringIO()
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(COLUMNS)
        for v, state in zip(self.airspeeds, self.level, strict=True):
            writer.writerow(["level", "", "", v, 0.0, _plain(state.power), state.limit])
        for mass, states in zip(self.masses, self.map, strict=True):
            for v, state in zip(self.airspeeds, states, strict=True):
                writer.writerow(["map", mass, "", v, 0.0, _plain(state.power), state.limit])
        for v, end in zip(self.airspeeds, self.climbs, strict=True):
            writer.writerow(["climb", "", "", v, _plain(end.value), _plain(end.power), end.limit])
        for mass, end in zip(self.masses, self.ceilings, strict=True):
            writer.writerow(["ceiling", mass, _plain(end.value), 0.0, 0.0, _plain(end.power), end.limit])
        for altitude, end in zip(self.altitudes, self.fastest, strict=True):
            writer.writerow(["fastest", "", altitude, _plain(end.value), 0.0, _plain(end.power), end.limit])
        for name, found in (("endurance", self.endurance), ("range", self.range)):
            if found is not None:
                writer.writerow([name, "", "", found[0], 0.0, found[1], ""])
        return file.getvalue()


def _plain(value: float) -> float | str:
    return value if math.isfinite(value) else ""


def performance(
    aircraft: Aircraft,
    airspeeds: ArrayLike,
    masses: ArrayLike = (),
    altitudes: ArrayLike = (),
    *,
    available: float = math.inf,
    fidelity: Fidelity | None = None,
    workers: int | None = None,
    progress: Callable[..., None] | None = None,
) -> Performance:
    """Charts of an aircraft in steady flight.

    Parameters
    ----------
    aircraft : Aircraft
    airspeeds : array_like, shape (n,)
        Rising [m/s].
    masses : array_like, shape (m,)
        Of the hover ceiling and the map [kg]; none leave these out.
    altitudes : array_like, shape (k,)
        Of the highest airspeed, in the standard atmosphere [m].
    available : float
        Shaft power of all rotors together [W].
    fidelity : Fidelity, optional
    workers : int, optional
        Number of threads, one for each core if not given.
    progress : callable, optional
        Called with the numbers of points done and of all, as each ends.

    Raises
    ------
    SweepError
        A value out of range, or an aircraft on a stand.
    """
    checks.instance("aircraft", aircraft, Aircraft, SweepError)
    if aircraft.body.is_stand:
        raise SweepError("body.stand: allowed is an aircraft in flight")
    speeds, loads, heights = (
        _rising(name, values, least)
        for name, values, least in (("airspeeds", airspeeds, 2), ("masses", masses, 0), ("altitudes", altitudes, 0))
    )
    available = checks.number("available", available, 1.0, math.inf, "W", SweepError)
    pilot = _Pilot(available, fidelity or Fidelity())
    calls: list[tuple[Any, ...]] = [(aircraft, pilot, "level", v, {}) for v in speeds]
    calls += [(aircraft, pilot, "level", v, {MASS: mass}) for mass in loads for v in speeds]
    calls += [(aircraft, pilot, "climb", v, {}) for v in speeds]
    calls += [(aircraft, pilot, "ceiling", mass, {}) for mass in loads]
    calls += [(aircraft, pilot, "fastest", height, {}) for height in heights]
    found: list[Any] = [None] * len(calls)
    done = itertools.count(1)

    def keep(i: int, result: Any) -> None:
        found[i] = result
        if progress is not None:
            progress(next(done), len(calls))

    execution = Execution(workers)
    compute(_solve, calls, keep, execution, execution.threads(SweepError))
    results = iter(found)
    level = tuple(itertools.islice(results, len(speeds)))
    mapped = tuple(tuple(itertools.islice(results, len(speeds))) for _ in loads)
    climbs, ceilings, fastest = (
        tuple(itertools.islice(results, count)) for count in (len(speeds), len(loads), len(heights))
    )
    power = np.array([math.nan if state.limit in (NO_TRIM, CONTROLS) else state.power for state in level])
    return Performance(
        *(aircraft.name, available, speeds, loads, heights, level, mapped, climbs, ceilings, fastest),
        *(least_power(speeds, power), least_power_over_speed(speeds, power)),
    )


def _rising(name: str, values: ArrayLike, least: int) -> Array:
    numbers = checks.array(name, values, SweepError)
    if numbers.ndim != 1 or not least <= len(numbers) <= MAX_VALUES:
        raise SweepError(f"{name} has shape {numbers.shape}: allowed are {least} to {MAX_VALUES} numbers")
    if not (np.isfinite(numbers).all() and (np.diff(numbers) > 0.0).all()):
        raise SweepError(f"{name} = {checks.shown(numbers.tolist())}: allowed are rising numbers")
    return numbers


# --- points and boundaries --------------------------------------------------------------------------------------


class _Pilot(NamedTuple):
    """What decides whether a flight can be flown."""

    available: float
    fidelity: Fidelity

    def state(self, aircraft: Aircraft, airspeed: float, climb_rate: float = 0.0) -> State:
        """A steady flight, or why there is none."""
        try:
            point = solve_trim(aircraft, TrimCondition(airspeed, climb_rate), self.fidelity)
        except SbsError:
            return State(math.nan, NO_TRIM)
        power = float(point.power.sum())
        if point.beyond_limits:
            return State(power, CONTROLS)
        if any(STALL in line for line in point.warnings):
            return State(power, STALLED)
        return State(power, POWER if power > self.available else "")


def _solve(aircraft: Aircraft, pilot: _Pilot, chart: str, value: float, changes: dict[str, float]) -> Any:
    """A state, or a boundary, of a chart at a value of its axis."""
    try:
        changed = aircraft.with_values(changes) if changes else aircraft
        if chart == "level":
            return pilot.state(changed, value)
        if chart == "climb":
            return boundary(lambda rate: pilot.state(changed, value, rate), 0.0, STEEPEST, SPEED_STEP)
        if chart == "fastest":
            high = changed.with_value(ALTITUDE, value)
            return boundary(lambda speed: pilot.state(high, speed), 0.0, FASTEST, SPEED_STEP)

        def hover(altitude: float) -> State:
            return pilot.state(changed.with_values({MASS: value, ALTITUDE: altitude}), 0.0)

        return boundary(hover, 0.0, HIGHEST, ALTITUDE_STEP)
    except SbsError as error:
        return State(math.nan, str(error)) if chart == "level" else Boundary(math.nan, str(error), math.nan)


def boundary(state: Callable[[float], State], inside: float, outside: float, step: float) -> Boundary:
    """Last value between two that can be flown, by widening steps from the first and halving.

    Parameters
    ----------
    state : callable
        Flight at a value.
    inside, outside : float
        Where to begin, and the farthest value to look at.
    step : float
        To which the boundary is found.

    Returns
    -------
    Boundary
        Not a number where not even the first can be flown; without a limit where the farthest can.
    """
    now = state(inside)
    if now.limit:
        return Boundary(math.nan, now.limit, math.nan)
    good, power, stride = inside, now.power, (outside - inside) / 32.0
    while good < outside:
        wanted = min(good + stride, outside)
        then = state(wanted)
        if then.limit:
            bad, limit = wanted, then.limit
            break
        good, power, stride = wanted, then.power, 2.0 * stride
    else:
        return Boundary(outside, "", power)
    while bad - good > step:
        middle = 0.5 * (good + bad)
        then = state(middle)
        if then.limit:
            bad, limit = middle, then.limit
        else:
            good, power = middle, then.power
    return Boundary(good, limit, power)


def least_power(airspeeds: ArrayLike, power: ArrayLike) -> tuple[float, float] | None:
    """Airspeed of best endurance, and its power: the least; None where an end has it.

    Parameters
    ----------
    airspeeds : array_like, shape (n,)
        Rising [m/s].
    power : array_like, shape (n,)
        [W]; what is not a number does not count.
    """
    return _least(airspeeds, power, lambda v, p: p)


def least_power_over_speed(airspeeds: ArrayLike, power: ArrayLike) -> tuple[float, float] | None:
    """Airspeed of best range, and its power: where the tangent from the origin touches; None where an end has it."""
    return _least(airspeeds, power, lambda v, p: p / v)


def _least(airspeeds: ArrayLike, power: ArrayLike, cost: Callable[[Array, Array], Array]) -> tuple[float, float] | None:
    """Where a cost of a cubic spline through the powers is least, for speeds ahead."""
    from scipy.interpolate import CubicSpline  # here: it takes a quarter of a second, and few need it

    v, p = np.asarray(airspeeds, dtype=float), np.asarray(power, dtype=float)
    known = np.isfinite(p)
    v, p = v[known], p[known]
    if len(v) < 3:
        return None
    spline, fine = CubicSpline(v, p), np.linspace(max(v[0], 0.0), v[-1], 20_001)[1:]
    values = cost(fine, spline(fine))
    i = int(np.argmin(values))
    if i in (0, len(fine) - 1):
        return None
    return float(fine[i]), float(spline(fine[i]))


def ideal_ceiling_density(weight: float, area: float, power: float) -> float:
    """Air density at which a hover takes all power, by momentum theory: T^3 / (2 A P^2) [kg/m^3].

    Parameters
    ----------
    weight, area, power : float
        [N], of all discs [m^2], [W]
    """
    return weight**3 / (2.0 * area * power * power)


def limits_of(ends: Sequence[Boundary]) -> tuple[str, ...]:
    """What stops the flights of a chart, each once."""
    return tuple(dict.fromkeys(end.limit for end in ends if end.limit))
