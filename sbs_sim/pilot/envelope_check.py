"""What an envelope controller gives: margins, attitude bandwidth, disturbance rejection, damping, and how uncertain.

All with the law itself near each steady flight and all states of the rotors, sampled and late. Uncertain aircraft are
trimmed and linearized anew, each with other mass, inertia, springs, air, delay and actuators.
"""

from __future__ import annotations  # `help` then shows types by their names

import math
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, fields
from multiprocessing import get_context
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sbs_sim import checks
from sbs_sim.aircraft import Aircraft
from sbs_sim.analysis.linearize import linearize
from sbs_sim.analysis.quality_limits import Scale, limits, scales
from sbs_sim.analysis.rejection import rejection
from sbs_sim.content import ByContent
from sbs_sim.errors import PilotError, SbsError
from sbs_sim.flight import measured as M
from sbs_sim.model.noise import normal
from sbs_sim.pilot import envelope_law as L
from sbs_sim.pilot.envelope import (
    PERIOD,
    Condition,
    Envelope,
    Limits,
    Requirement,
    Trial,
    actuated,
    decibels,
    design_envelope,
    level_plant,
)
from sbs_sim.pilot.feedback import ComplexArray
from sbs_sim.pilot.loops import (
    ModalPlant,
    close_grid,
    closed_poles,
    even_grid,
    lateness,
    loop_margins,
    sampled_response,
)

Array = NDArray[np.float64]

AXES = {"pitch": (M.PITCH, 3), "roll": (M.ROLL, 2)}  # what is measured, and the number of a command that moves it
REJECTED = {"pitch": M.PITCH, "roll": M.ROLL, "yaw": M.HEADING}
OSCILLATING = 0.999  # damping ratio below which a pole is looked at
DENSITY_HEIGHT = 9600.0  # m, over which the density of the standard atmosphere falls by a factor of e, near the ground
CHUNK = 10


@dataclass(frozen=True)
class Uncertainty:
    """What an aircraft and its controller may differ by.

    Parameters
    ----------
    mass, inertia, springs, density : float
        Standard deviations relative to the value: of the mass, of the matrix of inertia, of the springs of the flap and
        lag hinges of each rotor, of the air.
    delay : float
        Largest delay more [s], evenly distributed, in ticks.
    lag : float
        Largest lag of the actuators more [s], evenly distributed, of each control its own.
    """

    mass: float = 0.05
    inertia: float = 0.1
    springs: float = 0.1
    density: float = 0.05
    delay: float = 0.02
    lag: float = 0.02

    def __post_init__(self) -> None:
        for part in fields(self):
            checks.number(part.name, getattr(self, part.name), 0.0, 1.0, "", PilotError)


@dataclass(frozen=True, eq=False)
class Checked(ByContent):
    """What the controller gives at an airspeed; not a number where there is none.

    Attributes
    ----------
    airspeed : float
        [m/s]
    growth, growth_frequency : float
        Largest real part of the poles, and the magnitude of that pole [rad/s].
    gain_down, gain_up : ndarray, shape (4,)
        Gain margins at the controls of heave, roll, pitch and yaw [dB].
    phase : ndarray, shape (4,)
        Phase margins [rad].
    disk : float
        Disk margin for errors at all controls at once.
    bandwidth, phase_delay : ndarray, shape (2,)
        Of pitch and roll to their commands [rad/s], [s].
    rejection, peak : ndarray, shape (3,)
        Bandwidth [rad/s] and peak [dB] of the rejection of disturbances of pitch, roll and heading, with the attitude
        commanded.
    damping : float
        Least damping ratio of the oscillations up to twice the bandwidth.
    levels : dict of str to int
        By name of what is judged; 0 where nothing is asked for.
    """

    airspeed: float
    growth: float
    growth_frequency: float
    gain_down: Array
    gain_up: Array
    phase: Array
    disk: float
    bandwidth: Array
    phase_delay: Array
    rejection: Array
    peak: Array
    damping: float
    levels: dict[str, int]


class NearLaw:
    """The law near level flight at an airspeed, for many aircraft.

    Attributes
    ----------
    feedback, attitude : Compensator
        With the velocity and with the attitude commanded.
    commanded : Compensator
        From commands of pitch and roll.
    w : ndarray
        Frequencies [rad/s], at which `own`, `own_attitude` and `asked` are the responses of these three.
    """

    def __init__(self, found: Envelope, airspeed: float) -> None:
        self.envelope = found
        self.feedback, self.attitude = found.compensator(airspeed), found.compensator(airspeed, is_attitude=True)
        self.commanded = found.command_response(airspeed)
        self.w = even_grid(PERIOD)
        self.own, self.own_attitude = self.feedback.at(self.w, PERIOD), self.attitude.at(self.w, PERIOD)
        self.asked = self.commanded.at(self.w, PERIOD)


def check(near: NearLaw, condition: Condition, scale: Scale, delay: int | None = None, lag: Any = None) -> Checked:
    """What a controller gives in a steady flight.

    Parameters
    ----------
    near : NearLaw
    condition : Condition
    scale : Scale
        By which levels are judged.
    delay : int, optional
        Ticks; those of the design if not given.
    lag : array_like, shape (4,), optional
        Of the actuators [s]; that of the design if not given.
    """
    found, feedback = near.envelope, near.feedback
    late = found.delay if delay is None else delay
    plant = ModalPlant.of(actuated(level_plant(condition), found.lag if lag is None else lag))
    poles = closed_poles(plant, feedback, PERIOD, late)
    stable = bool(np.all(poles.real < 0.0))
    w, close = near.w, close_grid(plant, PERIOD)
    response, delayed = sampled_response(plant, PERIOD, w), lateness(w, PERIOD, late)
    own, unit = near.own * delayed, np.eye(L.AXIS_COUNT)
    closely = feedback.at(close, PERIOD) @ sampled_response(plant, PERIOD, close) * lateness(close, PERIOD, late)
    order = np.argsort(np.concatenate([w, close]))
    loops = -np.concatenate([own @ response, closely])[order]
    margins = loop_margins(loops, np.concatenate([w, close])[order], stable)
    attitude = near.own_attitude * delayed
    inverse = np.linalg.inv(unit - attitude @ response)  # with the attitude commanded: no outer loop moves it
    answers = response @ inverse @ (near.asked * delayed)
    bandwidths = [attitude_bandwidth(w, answers[:, place, k]) for k, (place, _) in enumerate(AXES.values())]
    answered = response @ inverse @ attitude
    rejected = [rejection(name, w, np.abs(1.0 + answered[:, k, k])) for name, k in REJECTED.items()]
    bandwidth, phase_delay = np.array(bandwidths).T
    slow = poles[(poles.imag > 0.0) & (np.abs(poles) < 2.0 * np.nanmax([*bandwidth, 1.0 / found.length]))]
    ratios = -slow.real / np.abs(slow)
    levels = _levels(condition, scale, dict(zip(AXES, bandwidth, strict=True)), slow)
    return Checked(
        condition.airspeed,
        float(poles.real.max()),
        float(abs(poles[np.argmax(poles.real)])),
        np.array([-decibels(margin.gain_low) for margin in margins[: L.AXIS_COUNT]]),
        np.array([decibels(margin.gain_high) for margin in margins[: L.AXIS_COUNT]]),
        np.array([margin.phase for margin in margins[: L.AXIS_COUNT]]),
        margins[-1].disk,
        bandwidth,
        phase_delay,
        np.array([one.bandwidth for one in rejected]),
        np.array([one.peak for one in rejected]),
        float(ratios.min(initial=1.0)),
        levels,
    )


def attitude_bandwidth(w: Array, response: ComplexArray) -> tuple[float, float]:
    """Bandwidth of an attitude response [rad/s], where its phase falls through -135 deg, and phase delay [s].

    ADS-33E-PRF, figure 4, for attitude command.
    """
    phase = np.asarray(np.unwrap(np.angle(response)), float)
    phase -= 2.0 * math.pi * round(phase[0] / (2.0 * math.pi))
    bandwidth, crossing = _falls(w, phase, -0.75 * math.pi), _falls(w, phase, -math.pi)
    double = 2.0 * crossing
    if not double <= w[-1]:
        return bandwidth, math.nan
    return bandwidth, float((-math.pi - np.interp(double, w, phase)) / double)


def _falls(w: Array, values: Array, level: float) -> float:
    """First frequency at which values fall through a level; not a number without any."""
    below = np.flatnonzero((values[:-1] > level) & (values[1:] <= level))
    if not len(below):
        return math.nan
    i = below[0]
    share = (values[i] - level) / (values[i] - values[i + 1])
    return float(w[i] * (w[i + 1] / w[i]) ** share)


def _levels(condition: Condition, scale: Scale, bandwidths: dict[str, float], slow: ComplexArray) -> dict[str, int]:
    """Levels of the bandwidths and of the oscillations."""
    known = limits()
    flight = known.flight(condition.airspeed, scale)
    found = {}
    for axis, value in bandwidths.items():
        limit = known.find(f"{axis}_bandwidth", flight)
        found[f"{axis} bandwidth"] = 0 if limit is None else limit.level_of(value / scale.speed_up)
    limit = known.find("oscillation", flight) or known.find("oscillation", "any")
    worst = 1
    for pole in slow:
        if limit is not None and -pole.real < OSCILLATING * abs(pole):
            mode: Any = SimpleNamespace(frequency=float(abs(pole)), pole=complex(pole))
            worst = max(worst, limit.level_of_mode(mode, scale.speed_up))
    found["oscillations"] = 0 if limit is None else worst
    return found


# --- uncertainty ------------------------------------------------------------------------------------------------


def changes_of(aircraft: Aircraft, spread: Uncertainty, numbers: Sequence[float]) -> dict[str, Any]:
    """Values by path of an aircraft that differs, by normal numbers: as many as `number_count` says."""
    left = iter(numbers)
    found: dict[str, Any] = {
        "body.mass": aircraft.body.mass * (1.0 + spread.mass * next(left)),
        "body.inertia": (np.array(aircraft.body.inertia) * (1.0 + spread.inertia * next(left))).tolist(),
    }
    share = spread.density * next(left)
    if aircraft.environment.altitude is None:
        found["environment.air_density"] = aircraft.environment.air_density * (1.0 + share)
    else:
        found["environment.altitude"] = aircraft.environment.altitude - DENSITY_HEIGHT * share
    for rotor in aircraft.rotors:
        for name in ("flap_spring", "lag_spring"):
            factor = 1.0 + spread.springs * next(left)
            if getattr(rotor, name):
                found[f"rotors.{rotor.name}.{name}"] = getattr(rotor, name) * factor
    return found


def number_count(aircraft: Aircraft) -> int:
    """Normal numbers of an uncertain aircraft."""
    return 3 + 2 * len(aircraft.rotors)


@dataclass(frozen=True, eq=False)
class Sampled(ByContent):
    """What a controller gives of uncertain aircraft.

    Attributes
    ----------
    airspeeds : tuple of float
    found : tuple of tuple of Checked or None
        Of each sample at each airspeed; None where there is no trim or no linear model.
    errors : tuple of str
        Why, each once.
    """

    airspeeds: tuple[float, ...]
    found: tuple[tuple[Checked | None, ...], ...]
    errors: tuple[str, ...]

    def values(self, name: str) -> Array:
        """A number of `Checked`, shape (n_samples, n_airspeeds) or with one axis more; not a number without one."""
        some = next(one for row in self.found for one in row if one is not None)
        empty = np.full(np.shape(getattr(some, name)), math.nan)
        return np.array([[empty if one is None else getattr(one, name) for one in row] for row in self.found])

    def worst_levels(self, k: int, share: float) -> dict[str, int]:
        """Levels that a share of the samples keeps at an airspeed, by name of what is judged."""
        found = [row[k] for row in self.found]
        flown = [one.levels for one in found if one is not None]
        names = flown[0] if flown else {}
        return {name: int(np.quantile([own[name] for own in flown], share, method="lower")) for name in names}

    @property
    def stable(self) -> Array:
        """Share of the samples that are stable, at each airspeed, shape (n_airspeeds,)."""
        return np.asarray((self.values("growth") < 0.0).mean(axis=0))


def nominal(found: Envelope, aircraft: Aircraft, airspeeds: Sequence[float]) -> list[Checked]:
    """Check a controller with the aircraft of its file at airspeeds [m/s]."""
    scale = scales(aircraft)[0]
    models = [linearize(aircraft, airspeed=airspeed) for airspeed in airspeeds]
    return [check(NearLaw(found, own.trim.condition.airspeed), Condition.of(own), scale) for own in models]


def sample(
    found: Envelope,
    aircraft: Aircraft,
    airspeeds: Sequence[float],
    spread: Uncertainty,
    samples: int,
    seed: int = 0,
    workers: int = 1,
    progress: Callable[[int, int], None] | None = None,
) -> Sampled:
    """Check a controller with uncertain aircraft, each trimmed and linearized at every airspeed.

    Parameters
    ----------
    found : Envelope
    aircraft : Aircraft
    airspeeds : sequence of float
        [m/s]
    spread : Uncertainty
    samples : int
        Aircraft.
    seed : int
        Sample i is the same for the same seed.
    workers : int
        Processes; 1 works in this one.
    progress : callable, optional
        Called with the number of samples done and that of all.

    Raises
    ------
    PilotError
        A number out of range.
    """
    samples = checks.integer("samples", samples, 1, 1_000_000, PilotError)
    seed = checks.integer("seed", seed, 0, 2**63 - 1, PilotError)
    starts = range(0, samples, CHUNK)
    jobs = [(found, aircraft, tuple(airspeeds), spread, seed, i, min(i + CHUNK, samples)) for i in starts]
    rows: list[tuple[Checked | None, ...]] = []
    errors: dict[str, None] = {}

    def keep(part: tuple[list[tuple[Checked | None, ...]], list[str]]) -> None:
        rows.extend(part[0])
        errors.update(dict.fromkeys(part[1]))
        if progress is not None:
            progress(len(rows), samples)

    if workers == 1:
        for job in jobs:
            keep(_sampled(job))
    else:
        with ProcessPoolExecutor(workers, get_context("spawn")) as pool:
            for part in pool.map(_sampled, jobs):
                keep(part)
    return Sampled(tuple(airspeeds), tuple(rows), tuple(errors))


def _sampled(job: Any) -> tuple[list[tuple[Checked | None, ...]], list[str]]:
    """Some samples, and what went wrong."""
    found, aircraft, airspeeds, spread, seed, first, end = job
    scale = scales(aircraft)[0]
    nears = [NearLaw(found, airspeed) for airspeed in airspeeds]
    rows: list[tuple[Checked | None, ...]] = []
    errors: list[str] = []
    for i in range(first, end):
        drawn = Drawn(aircraft, spread, seed, i)
        row: list[Checked | None] = []
        try:
            craft = drawn.aircraft()
        except SbsError as error:
            errors.append(f"no such aircraft: {error}")
            rows.append((None,) * len(airspeeds))
            continue
        for airspeed, near in zip(airspeeds, nears, strict=True):
            try:
                model = linearize(craft, airspeed=airspeed)
                more = found.delay + drawn.delay, found.lag + drawn.lag
                row.append(check(near, Condition.of(model), scale, *more))
            except SbsError as error:
                errors.append(f"{airspeed:g} m/s: {error}")
                row.append(None)
        rows.append(tuple(row))
    return rows, errors


class Drawn:
    """An aircraft that differs, number i of a seed.

    Attributes
    ----------
    delay : int
        More [ticks].
    lag : ndarray, shape (4,)
        More of each control [s].
    """

    def __init__(self, aircraft: Aircraft, spread: Uncertainty, seed: int, i: int) -> None:
        source = np.random.PCG64(np.random.SeedSequence([seed, i]))
        count = number_count(aircraft)
        numbers = np.clip(normal(source, -(-count // 2)).ravel()[:count], -3.0, 3.0)
        delay_more, *lag_more = np.random.Generator(source).random(1 + L.AXIS_COUNT)
        self.delay = int(delay_more * (spread.delay / PERIOD + 1.0))
        self.lag = spread.lag * np.array(lag_more)
        self._of, self._changes = aircraft, changes_of(aircraft, spread, numbers.tolist())
        self._made: Aircraft | None = None

    def aircraft(self) -> Aircraft:
        """The aircraft itself, made once; AircraftError where its values do not go together."""
        if self._made is None:
            self._made = self._of.with_values(self._changes)
        return self._made


TRIALS, TRIAL_SEED = 8, 2**62  # aircraft that gains are tried with, other ones than those of `sample`


def design(
    aircraft: Aircraft,
    airspeeds: Sequence[float],
    *,
    limits: Limits | None = None,
    requirement: Requirement | None = None,
    delay: float = 0.01,
    lag: float = 0.02,
    spread: Uncertainty | None = None,
) -> Envelope:
    """Design an envelope controller of an aircraft, see `design_envelope`.

    Parameters
    ----------
    aircraft : Aircraft
    airspeeds : sequence of float
        Rising [m/s].
    limits, requirement, delay, lag
        See `design_envelope`.
    spread : Uncertainty, optional
        The margins are asked for with some aircraft that differ so, too.

    Raises
    ------
    PilotError
        See `design_envelope`.
    TrimError, LinearizationError
        No trim or linear model at one of the airspeeds.
    """
    models = [linearize(aircraft, airspeed=airspeed) for airspeed in airspeeds]
    trials: list[list[Trial]] = []
    if spread is not None:
        drawn = [Drawn(aircraft, spread, TRIAL_SEED, i) for i in range(TRIALS)]
        ticks = round(delay / PERIOD)
        trials = [[part for one in drawn for part in _trial(one, airspeed, ticks, lag)] for airspeed in airspeeds]
    return design_envelope(aircraft, models, limits, requirement, delay=delay, lag=lag, trials=trials)


def _trial(drawn: Drawn, airspeed: float, ticks: int, lag: float) -> Iterator[Trial]:
    """The trial of an aircraft that differs at an airspeed; none where that has no trim."""
    try:
        condition = Condition.of(linearize(drawn.aircraft(), airspeed=airspeed))
    except SbsError:
        return
    yield Trial(ModalPlant.of(actuated(level_plant(condition), lag + drawn.lag)), ticks + drawn.delay)
