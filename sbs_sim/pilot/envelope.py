"""Envelope controller: gains over the airspeed from linear models, with margins at every one (theory.md section 11).

At each airspeed the rotors are taken to have settled. The inner loop is found by LQR with Bryson's weights; the outer
loops have the bandwidth of a share of it. The more the controls may cost, the slower all of it: the fastest is taken
that keeps the margins, with all states of the rotors, sampled and late. What is checked is the law itself that flies,
differentiated numerically.
"""

from __future__ import annotations  # `help` then shows types by their names

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sbs_sim import checks
from sbs_sim.aircraft import Aircraft
from sbs_sim.analysis.linear_model import LinearModel, settle
from sbs_sim.content import ByContent
from sbs_sim.errors import PilotError
from sbs_sim.flight import measured as M
from sbs_sim.flight.controller import Controller
from sbs_sim.model import state as S
from sbs_sim.model.frames import euler_to_quaternion, rotation_matrix
from sbs_sim.pilot import envelope_law as L
from sbs_sim.pilot.envelope_law import envelope_law
from sbs_sim.pilot.feedback import Compensator, Margin, Plant, lqr
from sbs_sim.pilot.hover_hold import pilot_axes
from sbs_sim.pilot.loops import ModalPlant, closed_poles, quick_margins

Array = NDArray[np.float64]

SPAN = 2.3  # m, of the aircraft for which the numbers below are; others have theirs by Froude's scaling
PERIOD = 0.01  # s
SHARE = 0.05  # of a control's range, that costs as much as the errors below
ERRORS = {  # m/s, rad/s, rad: what costs alike in the inner loop
    "down": 1.0,
    "q": math.radians(40.0),
    "theta": math.radians(10.0),
    "p": math.radians(40.0),
    "phi": math.radians(10.0),
    "r": math.radians(40.0),
    "psi": math.radians(10.0),
    "theta integral": math.radians(12.0),
    "phi integral": math.radians(12.0),
    "down integral": 1.0,
    "psi integral": math.radians(20.0),
}
POWERS = {"down": 1, "q": -1, "p": -1, "r": -1, "theta integral": 1, "phi integral": 1, "down integral": 2}
POWERS["psi integral"] = 1  # of the square root of the length, by which an error scales
FILTER_TIME, OUTER_RATE, HEIGHT_RATE = 0.05, 0.8, 0.8  # s, 1/s, 1/s
INTEGRAL_SHARE = 0.2  # of the outer rate: the integral of the velocity error over the error itself
LEAST_COST, COST_STEP = 0.2, 1.3  # of the controls over the share above
FIRST_COSTS = (1.0, 0.6, 0.35, 1.7, 2.8)  # to begin with
PACES = (1.0, 0.6)  # of the outer loops
MAX_ROUNDS = 8
TRIAL_SHARE = 2.0 / 3.0  # of the margins, that is left where the aircraft differs
SHORTEST_LAG = 1e-3  # s, beside actuators with a lag
DELAY = 1  # ticks between a state and the controls that it gives


@dataclass(frozen=True)
class Limits:
    """What the controller asks of the aircraft at most.

    Parameters
    ----------
    acceleration : float
        Horizontal [m/s^2].
    climb_acceleration : float
        [m/s^2]
    climb_speed, approach_speed : float
        On the way to a target [m/s].
    turn_rate_deg, turn_acceleration_deg : float
        [deg/s], [deg/s^2]
    tilt_deg : float
        Of pitch and roll from those of the trim [deg].
    """

    acceleration: float = 1.5
    climb_acceleration: float = 1.5
    climb_speed: float = 2.0
    approach_speed: float = 4.0
    turn_rate_deg: float = 20.0
    turn_acceleration_deg: float = 20.0
    tilt_deg: float = 25.0


@dataclass(frozen=True, eq=False)
class Condition(ByContent):
    """What the design takes of a linear model: a steady level flight.

    Attributes
    ----------
    airspeed : float
        [m/s]
    a, b : ndarray, shapes (n, n), (n, 4)
        By the controls of the four axes.
    state_names : tuple of str
    controls : ndarray, shape (n_controls,)
    pitch, roll : float
        [rad]
    velocity : ndarray, shape (3,)
        Body axes [m/s].
    """

    airspeed: float
    a: Array
    b: Array
    state_names: tuple[str, ...]
    controls: Array
    pitch: float
    roll: float
    velocity: Array

    @classmethod
    def of(cls, model: LinearModel) -> Condition:
        """Take it from a linear model.

        Raises
        ------
        PilotError
            The model has no control for one of the axes, or is not one of level flight straight ahead.
        """
        axes = pilot_axes(model.control_axes, model.control_units)
        point = model.trim
        if missing := [name for name in S.LINEAR_BODY_NAMES if name not in model.state_names]:
            raise PilotError(f"no state {missing[0]}: allowed is an aircraft in free flight")
        for name in ("climb_rate", "turn_rate", "sideslip"):
            if abs(getattr(point.condition, name)) > 1e-9:
                raise PilotError(f"{name} = {getattr(point.condition, name):g}: allowed is level flight, 0")
        speed = point.condition.airspeed
        earth = np.array([speed, 0.0, 0.0])
        velocity = rotation_matrix(euler_to_quaternion(0.0, point.pitch, point.roll)).T @ earth
        return cls(
            speed, model.a, model.b[:, axes], model.state_names, point.controls, point.pitch, point.roll, velocity
        )

    def measured(self) -> Array:
        """What the law measures in this flight, at the origin, heading north, in still air."""
        found = np.zeros(M.COUNT)
        found[M.ROLL], found[M.PITCH] = self.roll, self.pitch
        found[M.U : M.W + 1] = found[M.U_AIR :] = self.velocity
        return found

    def plant(self) -> Plant:
        """All states, then north, east, down and heading; its outputs are all that a law measures."""
        n, names = len(self.state_names), self.state_names
        a = np.zeros((n + 4, n + 4))
        a[:n, :n] = self.a
        body = {name: names.index(name) for name in S.LINEAR_BODY_NAMES}
        turned = rotation_matrix(euler_to_quaternion(0.0, self.pitch, self.roll))
        a[n : n + 3, [body["u"], body["v"], body["w"]]] = turned
        for name, angles in (("theta", (0.0, 1.0, 0.0)), ("phi", (0.0, 0.0, 1.0))):
            a[n : n + 3, body[name]] = self._turn(angles)
        a[n + 1, n + 3] = self.airspeed  # level flight goes where the nose points
        a[n + 3, body["q"]] = math.sin(self.roll) / math.cos(self.pitch)
        a[n + 3, body["r"]] = math.cos(self.roll) / math.cos(self.pitch)
        c = np.zeros((M.COUNT, n + 4))
        c[M.NORTH : M.DOWN + 1, n : n + 3] = np.eye(3)
        c[M.HEADING, n + 3] = 1.0
        places = {"phi": M.ROLL, "theta": M.PITCH, "u": M.U, "v": M.V, "w": M.W, "p": M.P, "q": M.Q, "r": M.R}
        for name, place in places.items():
            c[place, body[name]] = 1.0
        c[M.U_AIR :] = c[M.U : M.W + 1]
        return Plant(a, np.vstack([self.b, np.zeros((4, 4))]), c)

    def _turn(self, angles: Sequence[float]) -> Array:
        """Change of the velocity over ground with yaw, pitch or roll [m/s per rad]."""
        step = 1e-6

        def earth(sign: float) -> Array:
            yaw, pitch, roll = (sign * step * angle for angle in angles)
            attitude = euler_to_quaternion(yaw, self.pitch + pitch, self.roll + roll)
            return np.asarray(rotation_matrix(attitude) @ self.velocity)

        return (earth(1.0) - earth(-1.0)) / (2.0 * step)

    def level(self) -> tuple[Array, Array]:
        """Settled model, (8, 8) and (8, 4): velocity along and across the heading and down, q, pitch, p, roll, r."""
        body = [self.state_names.index(name) for name in S.LINEAR_BODY_NAMES]
        a, b, _, _ = settle(self.a, self.b, body)
        transform = np.zeros((8, 8))
        for k, (place, name) in enumerate(_PLACES):
            step = 1e-6
            high, low = self.measured(), self.measured()
            high[place] += step
            low[place] -= step
            column = S.LINEAR_BODY_NAMES.index(name)
            transform[:3, column] = (_horizontal(high) - _horizontal(low)) / (2.0 * step)
            if k >= 3:
                transform[k, column] = 1.0
        back = np.linalg.inv(transform)
        return transform @ a @ back, transform @ b


_PLACES = (  # what is measured, and its name, in the order of `Condition.level`
    *((M.U, "u"), (M.V, "v"), (M.W, "w"), (M.Q, "q"), (M.PITCH, "theta"), (M.P, "p"), (M.ROLL, "phi"), (M.R, "r")),
)


def _horizontal(m: Array) -> Array:
    """`sbs_sim.pilot.envelope_law.horizontal` of what is measured."""
    turned = rotation_matrix(euler_to_quaternion(0.0, m[M.PITCH], m[M.ROLL]))
    return np.asarray(turned @ m[M.U : M.W + 1])


@dataclass(frozen=True, eq=False)
class Gains(ByContent):
    """Gains at one airspeed, and what they give.

    Attributes
    ----------
    airspeed : float
        [m/s]
    controls : ndarray, shape (n_controls,)
        Trimmed [rad, or their units].
    pitch, roll : float
        Trimmed [rad].
    fed_back, integrals, lagged : ndarray, shapes (4, 7), (4, 4), (4, 4)
        Of the inner loop.
    outer : ndarray, shape (3,)
        Of the velocity error and its integral [1/s, 1/s^2], and of the height error [1/s].
    """

    airspeed: float
    controls: Array
    pitch: float
    roll: float
    fed_back: Array
    integrals: Array
    lagged: Array
    outer: Array

    def block(self) -> Array:
        """Numbers of the law."""
        head = [self.airspeed, *self.controls, self.pitch, self.roll]
        return np.concatenate([head, self.fed_back.ravel(), self.integrals.ravel(), self.lagged.ravel(), self.outer])


def gains_of(condition: Condition, costs: Array, pace: float, ranges: Array, length: float) -> Gains:
    """Gains at an airspeed.

    Parameters
    ----------
    condition : Condition
    costs : ndarray, shape (4,)
        Of the controls of heave, roll, pitch and yaw: more is slower.
    pace : float
        Of the outer loops.
    ranges : ndarray, shape (4,)
        Of the controls of the axes [rad].
    length : float
        Square root of the aircraft's length over that of the numbers above.
    """
    level_a, level_b = condition.level()
    kept = [2, 3, 4, 5, 6, 7]  # down, q, theta, p, phi, r
    held, m = L.FED_BACK, L.AXIS_COUNT
    size = held + L.INTEGRALS + m
    lag = FILTER_TIME * length
    a, b = np.zeros((size, size)), np.zeros((size, m))
    a[: held - 1, : held - 1] = level_a[np.ix_(kept, kept)]
    a[: held - 1, held + L.INTEGRALS :] = level_b[kept]
    a[6, 1] = math.sin(condition.roll) / math.cos(condition.pitch)
    a[6, 5] = math.cos(condition.roll) / math.cos(condition.pitch)
    for i, of in enumerate((2, 4, 0, 6)):
        a[held + i, of] = 1.0
    a[held + L.INTEGRALS :, held + L.INTEGRALS :] = -np.eye(m) / lag
    b[held + L.INTEGRALS :] = np.eye(m) / lag
    limits = [value * length ** POWERS.get(name, 0) for name, value in ERRORS.items()]
    gains, _, _ = lqr(a, b, np.array(limits + [math.inf] * m), SHARE * ranges / costs)
    by_error, by_integral, by_lag = np.split(gains, [held, held + L.INTEGRALS], axis=1)
    rate = pace * OUTER_RATE / length / math.sqrt(max(costs[1], costs[2]))
    outer = np.array([rate, INTEGRAL_SHARE * rate * rate, pace * HEIGHT_RATE / length / math.sqrt(costs[0])])
    return Gains(
        condition.airspeed, condition.controls, condition.pitch, condition.roll, by_error, by_integral, by_lag, outer
    )


@dataclass(frozen=True, eq=False)
class Envelope(ByContent):
    """An envelope controller: gains over airspeed, and what it asks of the aircraft.

    Attributes
    ----------
    aircraft, parameter_hash : str
        It was designed for.
    control_names : tuple of str
    axes : ndarray of int64, shape (4,)
        Indices of the controls that heave, roll, pitch and yaw.
    ranges : ndarray, shape (n_controls, 2)
    gravity : float
        [m/s^2]
    length : float
        Square root of the aircraft's span over 2.3 m, by which its times are longer.
    limits : Limits
    gains : tuple of Gains
        By rising airspeed.
    delay : int
        Ticks between a state and the controls that it gives, for which the gains are.
    lag : float
        Time constant of the actuators, likewise [s].
    """

    aircraft: str
    parameter_hash: str
    control_names: tuple[str, ...]
    axes: NDArray[np.int64]
    ranges: Array
    gravity: float
    length: float
    limits: Limits
    gains: tuple[Gains, ...]
    delay: int = DELAY
    lag: float = 0.0

    def parameters(self, commands: ArrayLike = ()) -> Array:
        """Numbers of the law, see `sbs_sim.pilot.envelope_law`, with commands, shape (n, 6)."""
        rows = checks.array("commands", commands, PilotError).reshape(-1, L.COMMAND_SIZE)
        own, header = self.limits, np.zeros(L.HEADER)
        header[[L.SPEEDS, L.CONTROLS, L.PERIOD]] = len(self.gains), len(self.ranges), PERIOD
        header[L.GRAVITY], header[L.COMMANDS] = self.gravity, len(rows)
        header[L.AXES : L.AXES + L.AXIS_COUNT] = self.axes
        header[L.FILTER] = FILTER_TIME * self.length
        header[[L.ACCELERATION, L.CLIMB_ACCELERATION]] = own.acceleration, own.climb_acceleration
        header[L.TURN_ACCELERATION], header[L.TILT] = np.radians([own.turn_acceleration_deg, own.tilt_deg])
        header[[L.BLEND_FROM, L.BLEND_TO]] = BLEND_FROM * self.length, BLEND_TO * self.length
        header[[L.APPROACH, L.APPROACH_SPEED]] = APPROACH_RATE / self.length, own.approach_speed
        header[[L.CLIMB_SPEED, L.TURN_RATE]] = own.climb_speed, math.radians(own.turn_rate_deg)
        header[[L.HASTE, L.WIND_TIME]] = HASTE / self.length, WIND_TIME * self.length
        blocks = [gains.block() for gains in self.gains]
        return np.concatenate([header, *self.ranges.T, *blocks, rows.ravel()])

    def controller(self, commands: ArrayLike = (), **options: Any) -> Controller:
        """The controller for flights.

        Parameters
        ----------
        commands : array_like, shape (n, 6)
            Each from a time on [s]: time, mode, and four numbers. Mode 0: velocity along and across the heading, down
            [m/s], turn rate [rad/s]; 1: north, east, down [m], heading [rad]; 2: roll and pitch from the trim [rad],
            velocity down [m/s], turn rate. Without commands it hovers where it is, or brakes to a hover.
        **options
            delay, lag, sensors: see `Controller`.
        """
        return Controller(envelope_law, self.parameters(commands), np.zeros(L.MEMORY), PERIOD, **options)

    def steady(self, airspeed: float) -> Array:
        """What is measured in level flight at the trimmed attitude, in still air."""
        speeds = [gains.airspeed for gains in self.gains]
        found = np.zeros(M.COUNT)
        found[M.PITCH] = np.interp(airspeed, speeds, [gains.pitch for gains in self.gains])
        found[M.ROLL] = np.interp(airspeed, speeds, [gains.roll for gains in self.gains])
        turned = rotation_matrix(euler_to_quaternion(0.0, found[M.PITCH], found[M.ROLL]))
        found[M.U : M.W + 1] = found[M.U_AIR :] = airspeed * turned[0]
        return found

    def compensator(self, airspeed: float, is_attitude: bool = False) -> Compensator:
        """The law near level flight, once a tick, from measurements to the controls of the axes.

        It is differentiated numerically.

        Parameters
        ----------
        airspeed : float
            [m/s]
        is_attitude : bool
            True: with the attitude commanded, not the velocity.
        """
        return _near(self, airspeed, is_attitude, False)

    def command_response(self, airspeed: float) -> Compensator:
        """The same from commands of pitch and roll [rad] to the controls of the axes."""
        return _near(self, airspeed, True, True)


BLEND_FROM, BLEND_TO = 5.0, 10.0  # m/s, between which the air counts for what is across
APPROACH_RATE, HASTE, WIND_TIME = 0.3, 1.5, 3.0  # 1/s, 1/s, s
MOVING = tuple(range(L.DEPARTURE, L.VELOCITY_ERROR + 2))  # of the memory, what answers measurements
STEP = 1e-6  # of differences


@dataclass(frozen=True)
class Requirement:
    """Margins that every loop must have, broken at each control with the others closed.

    Parameters
    ----------
    gain_db : float
        Up and down [dB].
    phase_deg : float
        [deg]
    """

    gain_db: float = 6.0
    phase_deg: float = 45.0

    def of_trials(self) -> Requirement:
        """What is asked for of aircraft that differ."""
        return Requirement(TRIAL_SHARE * self.gain_db, TRIAL_SHARE * self.phase_deg)

    def lack(self, found: Margin) -> float:
        """What a margin lacks, as a share of what is asked for; 0 where it is large enough."""
        up, down = decibels(found.gain_high), -decibels(found.gain_low)
        gain, phase = min(up, down) / max(self.gain_db, 1e-9), math.degrees(found.phase) / max(self.phase_deg, 1e-9)
        return max(0.0, 1.0 - min(gain, phase))


def decibels(factor: float) -> float:
    """Gain in dB; minus infinity for zero."""
    return 20.0 * math.log10(factor) if factor > 0.0 else -math.inf


def design_envelope(
    aircraft: Aircraft,
    models: Sequence[LinearModel],
    limits: Limits | None = None,
    requirement: Requirement | None = None,
    *,
    delay: float = 0.01,
    lag: float = 0.02,
    trials: Sequence[Sequence[Trial]] = (),
) -> Envelope:
    """Design an envelope controller.

    Parameters
    ----------
    aircraft : Aircraft
    models : sequence of LinearModel
        Of level flight, by rising airspeed.
    limits : Limits, optional
    requirement : Requirement, optional
        Margins at each airspeed: the gains are the highest that keep them.
    delay : float
        Between a state and the controls that it gives [s], 0 to 0.5, in ticks of 0.01 s.
    lag : float
        Time constant of the actuators [s], 0 to 1.
    trials : sequence of sequence of Trial
        For each airspeed aircraft that differ: two thirds of the margins are asked for with these.

    Raises
    ------
    PilotError
        No control for one of the axes; or no gains that keep the margins: naming airspeed and control.
    """
    requirement = Requirement() if requirement is None else requirement
    axes = pilot_axes(tuple(control.axis for control in aircraft.controls), aircraft.control_units)
    ranges = np.array([control.range for control in aircraft.controls])
    length = math.sqrt(aircraft.rotor_span / SPAN)
    empty = Envelope(
        aircraft.name,
        aircraft.parameter_hash,
        tuple(aircraft.control_names),
        axes,
        ranges,
        aircraft.environment.gravity,
        length,
        Limits() if limits is None else limits,
        (),
        round(checks.number("delay", delay, 0.0, 0.5, "s", PilotError) / PERIOD),
        checks.number("lag", lag, 0.0, 1.0, "s", PilotError),
    )
    conditions = [Condition.of(model) for model in models]
    speeds = [condition.airspeed for condition in conditions]
    if not speeds or sorted(set(speeds)) != speeds:
        raise PilotError(f"airspeeds {speeds}: allowed are one or more rising ones")
    others = [list(own) for own in trials] or [[] for _ in conditions]
    found = [_Search(empty, own, requirement, near).found() for own, near in zip(conditions, others, strict=True)]
    return replace(empty, gains=tuple(found))


@dataclass(frozen=True, eq=False)
class Trial(ByContent):
    """An aircraft that differs, at an airspeed, with which gains must be stable too, with smaller margins.

    Attributes
    ----------
    plant : ModalPlant
        With its actuators.
    delay : int
        Ticks.
    """

    plant: ModalPlant
    delay: int


class _Search:
    """Search for the fastest gains at an airspeed that keep the margins."""

    def __init__(
        self, empty: Envelope, condition: Condition, requirement: Requirement, trials: Sequence[Trial]
    ) -> None:
        self._empty, self._condition = empty, condition
        self._ranges = np.ptp(empty.ranges, axis=1)[empty.axes]
        own = Trial(ModalPlant.of(actuated(level_plant(condition), empty.lag)), empty.delay)
        self._trials = [(own, requirement), *((trial, requirement.of_trials()) for trial in trials)]

    def found(self) -> Gains:
        """Gains that keep the margins, made faster one control after the other.

        Raises
        ------
        PilotError
            There are none.
        """
        point = self._nearest()
        lack, said, gains = self._tried(point, 0.0)
        if lack > 0.0 or gains is None:
            raise PilotError(f"no gains at {self._condition.airspeed:g} m/s keep the margins: the nearest have {said}")
        is_better = True
        while is_better:
            is_better = False
            for axis in range(L.AXIS_COUNT):
                tried = point.copy()
                tried[axis] /= COST_STEP
                lack, _, faster = self._tried(tried, 0.0) if tried[axis] >= LEAST_COST else (1.0, "", None)
                if lack <= 0.0 and faster is not None:
                    point, gains, is_better = tried, faster, True
        return gains

    def _nearest(self) -> Array:
        """Costs and, behind them, pace of the outer loops that lack least of the margins, shape (5,)."""
        starts = [np.array([*[cost] * L.AXIS_COUNT, pace]) for pace in PACES for cost in FIRST_COSTS]
        best, lack = starts[0], math.inf
        for start in starts:
            if lack > 0.0 and (own := self._tried(start, lack)[0]) < lack:
                best, lack = start, own
        for _ in range(MAX_ROUNDS):
            if lack <= 0.0:
                break
            before = lack
            for i in range(len(best)):
                for factor in (COST_STEP, 1.0 / COST_STEP):
                    tried = best.copy()
                    tried[i] *= factor
                    if lack > 0.0 and (own := self._tried(tried, lack)[0]) < lack:
                        best, lack = tried, own
            if lack == before:
                break
        return best

    def _tried(self, point: Array, most: float) -> tuple[float, str, Gains | None]:
        """How much costs and a pace lack of the margins, as a share of these, in words, and the gains.

        The search ends where it is more than `most`.
        """
        try:
            gains = gains_of(self._condition, point[:-1], float(point[-1]), self._ranges, self._empty.length)
        except PilotError as error:
            return math.inf, str(error), None
        feedback = replace(self._empty, gains=(gains,)).compensator(self._condition.airspeed)
        lack, said = 0.0, ""
        for trial, asked in self._trials:
            poles = closed_poles(trial.plant, feedback, PERIOD, trial.delay)
            growth = float(poles.real.max())
            if growth >= 0.0:
                if 1.0 + growth > lack:
                    lack, said = 1.0 + growth, f"a motion that grows with {growth:.2g} 1/s"
            else:
                margins = quick_margins(trial.plant, feedback, PERIOD, trial.delay, True)
                for i in range(L.AXIS_COUNT):
                    if (own := asked.lack(margins[i])) > lack:
                        name = self._empty.control_names[self._empty.axes[i]]
                        lack, said = own, f"{name}: {margin_text(margins[i])}"
            if lack > most:
                break
        return lack, said, gains


def actuated(plant: Plant, lag: ArrayLike) -> Plant:
    """A plant behind actuators, lags of first order of the controls [s]; zero is none."""
    times = np.broadcast_to(np.asarray(lag, dtype=float), (plant.b.shape[1],))
    if not times.any():
        return plant
    rates = 1.0 / np.maximum(times, SHORTEST_LAG)
    n, m = plant.b.shape
    a = np.block([[plant.a, plant.b], [np.zeros((m, n)), -np.diag(rates)]])
    return Plant(a, np.vstack([np.zeros((n, m)), np.diag(rates)]), np.hstack([plant.c, np.zeros((len(plant.c), m))]))


def margin_text(margin: Margin) -> str:
    """Gain and phase margin in words."""
    up, down = decibels(margin.gain_high), decibels(margin.gain_low)
    return f"{down:.1f} to {up:.1f} dB, {math.degrees(margin.phase):.0f} deg"


def level_plant(condition: Condition) -> Plant:
    """`Condition.plant` without the position north and east, which no gain feeds back."""
    plant = condition.plant()
    n = len(plant.a)
    kept = [i for i in range(n) if i not in (n - 4, n - 3)]
    return Plant(plant.a[np.ix_(kept, kept)], plant.b[kept], plant.c[:, kept])


def _near(found: Envelope, airspeed: float, is_attitude: bool, is_commanded: bool) -> Compensator:
    """`Envelope.compensator` and `Envelope.command_response`."""
    mode, asked = (L.ATTITUDE, 0.0) if is_attitude else (L.VELOCITY, airspeed)
    parameters = found.parameters([0.0, mode, asked, 0.0, 0.0, 0.0])
    steady, start, controls = found.steady(airspeed), np.zeros(L.MEMORY), np.zeros(len(found.ranges))
    envelope_law(0.0, steady, start, parameters, controls)  # sets the references
    moving = [*MOVING, L.PITCH_COMMAND, L.ROLL_COMMAND] if is_commanded else list(MOVING)
    pitch_command, roll_command = len(parameters) - 3, len(parameters) - 4
    inputs = [pitch_command, roll_command] if is_commanded else list(range(M.U_AIR))

    def answer(state: int | None, place: int | None, sign: float) -> Array:
        memory, measured, numbers, given = start.copy(), steady.copy(), parameters.copy(), controls.copy()
        if state is not None:
            memory[state] += sign * STEP
        elif place is not None and is_commanded:
            numbers[place] += sign * STEP
        elif place is not None:
            measured[place] += sign * STEP
            if M.U <= place <= M.W:
                measured[place + M.U_AIR - M.U] += sign * STEP
        envelope_law(0.0, measured, memory, numbers, given)
        return np.concatenate([memory[moving], given[found.axes]])

    def slope(state: int | None, place: int | None) -> Array:
        return (answer(state, place, 1.0) - answer(state, place, -1.0)) / (2.0 * STEP)

    n = len(moving)
    by_memory = np.array([slope(state, None) for state in moving]).T
    by_input = np.array([slope(None, place) for place in inputs]).T
    if not is_commanded:
        by_input = np.hstack([by_input, np.zeros((len(by_input), M.COUNT - M.U_AIR))])
    return Compensator(by_memory[:n], by_input[:n], by_memory[n:], by_input[n:])
