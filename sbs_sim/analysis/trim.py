"""Trim: the steady flight in which the averaged derivative vanishes (MODEL.md section 8).

Unknowns are pitch and roll, the four controls, and of every rotor flap, lag and inflow; equations are the averages of
the six body accelerations, of the flap and lag accelerations and of the inflow rates. Newton's method solves them,
from hover or along a path of conditions from hover.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sbs_sim.aircraft import Aircraft
from sbs_sim.errors import TrimError
from sbs_sim.model import params as P
from sbs_sim.model import state as S
from sbs_sim.model.average import averaged_derivative
from sbs_sim.model.frames import euler_to_quaternion, hub_axes, rotation_matrix

Array = NDArray[np.float64]

TOLERANCE = 1e-11  # of the scaled residual: accelerations over gravity, rotor rates over those of a revolution
MOST_ITERATIONS = 30
IDLE_LOADINGS = (0.01, 0.1, 1.0)  # disc loadings to try on rotors that do not lift, as shares of that of those that do
SMALLEST_PATH_STEP = 1.0 / 64.0
ATTITUDE_UNKNOWNS, CONTROL_UNKNOWNS = 2, 4
BODY_UNKNOWNS = ATTITUDE_UNKNOWNS + CONTROL_UNKNOWNS


@dataclass(frozen=True)
class TrimCondition:
    """The flight to be trimmed, relative to the air.

    Parameters
    ----------
    airspeed : float
        Horizontal component of the velocity [m/s]; negative is backwards.
    climb_rate : float
        Vertical component, positive up [m/s].
    sideslip : float
        Angle from the heading to the horizontal track, positive to the right [rad]: pi/2 is sideways to the right.
    turn_rate : float
        Rate of the heading, positive to the right [rad/s].

    Raises
    ------
    TrimError
        For a value that is not finite or out of range.
    """

    airspeed: float = 0.0
    climb_rate: float = 0.0
    sideslip: float = 0.0
    turn_rate: float = 0.0

    def __post_init__(self) -> None:
        """Check the ranges."""
        limits = {"airspeed": (100.0, "m/s"), "climb_rate": (50.0, "m/s")}
        limits |= {"sideslip": (math.pi, "rad"), "turn_rate": (3.0, "rad/s")}
        for name, (most, unit) in limits.items():
            value = getattr(self, name)
            if not abs(value) <= most:  # true for a NaN as well
                raise TrimError(f"{name} = {value}: allowed are {-most:g} to {most:g} {unit}")

    def scaled(self, share: float) -> "TrimCondition":
        """Condition on the way from hover (0) to this one (1)."""
        return TrimCondition(share * self.airspeed, share * self.climb_rate, self.sideslip, share * self.turn_rate)

    def motion(self, pitch: float, roll: float) -> tuple[Array, Array]:
        """Velocity [m/s] and angular velocity [rad/s] in body axes at an attitude [rad], each shape (3,)."""
        along, across = math.cos(self.sideslip), math.sin(self.sideslip)
        heading_axes = np.array([self.airspeed * along, self.airspeed * across, -self.climb_rate])
        to_body = rotation_matrix(euler_to_quaternion(0.0, pitch, roll)).T
        return to_body @ heading_axes, to_body @ np.array([0.0, 0.0, self.turn_rate])


@dataclass(frozen=True)
class TrimPoint:
    """A trimmed flight.

    Attributes
    ----------
    condition : TrimCondition
    lead_lag, cyclic_inflow : bool
        Fidelity.
    azimuth_count : int
        N_c of the averages.
    controls : ndarray, shape (4,)
        Collective, lateral, longitudinal, differential longitudinal cyclic [rad].
    swashplate : ndarray, shape (n_rotors, 3)
        Angles of each rotor [rad].
    pitch, roll : float
        [rad]
    state : ndarray, shape (n,)
        Linear state, 38 for two three-bladed rotors; names in `state_names`.
    state_names : tuple of str
    thrust, torque, power : ndarray, shape (n_rotors,)
        Mean aerodynamic thrust along the shaft [N], shaft torque [N m], shaft power [W].
    residual : float
        Largest scaled residual: accelerations over gravity, rotor and inflow rates over those of one revolution.
    iterations : int
        Newton iterations in all.
    beyond_limits : tuple of str
        Controls and swashplate angles that the trim needs beyond their range; empty if it can be flown.
    """

    condition: TrimCondition
    lead_lag: bool
    cyclic_inflow: bool
    azimuth_count: int
    controls: Array
    swashplate: Array
    pitch: float
    roll: float
    state: Array
    state_names: tuple[str, ...]
    thrust: Array
    torque: Array
    power: Array
    residual: float
    iterations: int
    beyond_limits: tuple[str, ...]


def trim(
    aircraft: Aircraft,
    airspeed: float = 0.0,
    climb_rate: float = 0.0,
    sideslip: float = 0.0,
    turn_rate: float = 0.0,
    *,
    lead_lag: bool = True,
    cyclic_inflow: bool = True,
    azimuth_count: int = 12,
) -> TrimPoint:
    """Trim an aircraft.

    Parameters
    ----------
    aircraft : Aircraft
    airspeed, climb_rate, sideslip, turn_rate : float
        See `TrimCondition` [m/s, m/s, rad, rad/s].
    lead_lag, cyclic_inflow : bool
        Fidelity of the model.
    azimuth_count : int
        N_c, number of azimuths of the averages, 1 to 1000.

    Returns
    -------
    TrimPoint

    Raises
    ------
    TrimError
        A value out of range, or no solution: the message holds the last residual and its worst equation.
    """
    condition = TrimCondition(airspeed, climb_rate, sideslip, turn_rate)
    if not 1 <= azimuth_count <= 1000:
        raise TrimError(f"azimuth_count = {azimuth_count}: allowed are 1 to 1000")
    problem = _TrimProblem(aircraft, lead_lag, cyclic_inflow, azimuth_count)
    unknowns, iterations = _follow_path(problem, condition)
    return problem.point(condition, unknowns, iterations)


class _TrimProblem:
    """The equations of trim for one aircraft and fidelity."""

    def __init__(self, aircraft: Aircraft, lead_lag: bool, cyclic_inflow: bool, azimuth_count: int) -> None:
        self.aircraft = aircraft
        self.lead_lag, self.cyclic_inflow, self.azimuth_count = lead_lag, cyclic_inflow, azimuth_count
        self.layout = aircraft.layout
        self._params = aircraft.params(lead_lag, cyclic_inflow)
        self._work = P.make_work(self._params)
        self._mixing = np.stack([rotor.mixing for rotor in aircraft.rotors])
        self._places, equations = self._rotor_unknowns()
        self._equations = np.concatenate([np.arange(S.VELOCITY, S.BODY_SIZE), equations])
        self._scales = self._equation_scales()
        self._dx = np.zeros(self.layout.size)
        self.loads = np.zeros((len(aircraft.rotors), P.LOAD_SIZE))

    def _rotor_unknowns(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Places of the unknown rotor states in the simulation state, and of their equations in its rate."""
        places: list[int] = []
        equations: list[int] = []
        index = np.arange(self.layout.size)
        for j in range(len(self.aircraft.rotors)):
            places += list(index[self.layout.flap(j)])
            equations += list(index[self.layout.flap_rate(j)])
            if self.lead_lag:
                places += list(index[self.layout.lag(j)])
                equations += list(index[self.layout.lag_rate(j)])
            inflow = index[self.layout.inflow(j)][: 3 if self.cyclic_inflow else 1]
            places += list(inflow)
            equations += list(inflow)
        return np.array(places), np.array(equations)

    def _equation_scales(self) -> Array:
        gravity = max(self.aircraft.environment.gravity, 1.0)
        scales = np.full(self.layout.size, gravity)
        for j, rotor in enumerate(self.aircraft.rotors):
            scales[self.layout.flap_rate(j)] = scales[self.layout.lag_rate(j)] = rotor.speed**2
            scales[self.layout.inflow(j)] = rotor.speed
        return scales[self._equations]

    def first_guess(self, idle: float) -> Array:
        """Hover by momentum theory: the weight on the rotors that point up, a collective right to a few degrees.

        A rotor that does not point up gets the inflow of a share `idle` of that disc loading: where it has none at
        all, its flow through the disc vanishes and so does Newton's sense of direction.
        """
        aircraft, air = self.aircraft, self.aircraft.environment
        x = np.zeros(self.layout.size)
        upward = [max(0.0, hub_axes(rotor.shaft_direction)[2, 2]) for rotor in aircraft.rotors]
        lifting = sum(math.pi * rotor.radius**2 * up for rotor, up in zip(aircraft.rotors, upward, strict=True))
        loading = aircraft.body.mass * air.gravity / max(lifting, 1e-6)
        for j, (rotor, up) in enumerate(zip(aircraft.rotors, upward, strict=True)):
            induced = math.sqrt(max(up, idle) * loading / (2 * max(air.air_density, 1e-3)))
            x[self.layout.inflow(j).start] = induced / (rotor.speed * rotor.radius)
        return np.concatenate([[0.0, 0.0, math.radians(9.0), 0.0, 0.0, 0.0], x[self._places]])

    def state(self, condition: TrimCondition, unknowns: Array) -> tuple[Array, Array]:
        """Simulation state at the origin, heading north, and swashplate angles of a vector of unknowns."""
        pitch, roll = unknowns[:ATTITUDE_UNKNOWNS]
        x = np.zeros(self.layout.size)
        x[S.ATTITUDE : S.ATTITUDE + 4] = euler_to_quaternion(0.0, pitch, roll)
        x[S.VELOCITY : S.RATES], x[S.RATES : S.BODY_SIZE] = condition.motion(pitch, roll)
        x[self._places] = unknowns[BODY_UNKNOWNS:]
        return x, self._mixing @ unknowns[ATTITUDE_UNKNOWNS:BODY_UNKNOWNS]

    def residual(self, condition: TrimCondition, unknowns: Array) -> Array:
        """Scaled residuals of the equations; the mean loads are left in `loads`."""
        x, swash = self.state(condition, unknowns)
        averaged_derivative(self._params, x, swash, self.azimuth_count, np.zeros(3), self._work, self._dx, self.loads)
        return self._dx[self._equations] / self._scales

    def jacobian(self, condition: TrimCondition, unknowns: Array, step: float = 1e-6) -> Array:
        """Derivative of the residuals by central differences."""
        columns = []
        for i in range(len(unknowns)):
            forward, backward = unknowns.copy(), unknowns.copy()
            forward[i] += step
            backward[i] -= step
            columns.append((self.residual(condition, forward) - self.residual(condition, backward)) / (2 * step))
        return np.stack(columns, axis=1)

    def worst_equation(self, residual: Array) -> str:
        """Name of the equation with the largest residual, as "d(state)/dt"."""
        worst = int(np.argmax(np.abs(residual)))
        return f"d({self.layout.names[self._equations[worst]]})/dt"

    def point(self, condition: TrimCondition, unknowns: Array, iterations: int) -> TrimPoint:
        """Result of a solution."""
        residual = self.residual(condition, unknowns)
        x, swash = self.state(condition, unknowns)
        controls = unknowns[ATTITUDE_UNKNOWNS:BODY_UNKNOWNS].copy()
        speeds = np.array([rotor.speed for rotor in self.aircraft.rotors])
        torque = self.loads[:, P.TORQUE].copy()
        return TrimPoint(
            condition=condition,
            lead_lag=self.lead_lag,
            cyclic_inflow=self.cyclic_inflow,
            azimuth_count=self.azimuth_count,
            controls=controls,
            swashplate=swash,
            pitch=float(unknowns[0]),
            roll=float(unknowns[1]),
            state=self.layout.to_linear(x),
            state_names=self.layout.linear_names,
            thrust=self.loads[:, P.THRUST].copy(),
            torque=torque,
            power=torque * speeds,
            residual=float(np.abs(residual).max()),
            iterations=iterations,
            beyond_limits=_beyond_limits(self.aircraft, controls, swash),
        )


def _follow_path(problem: _TrimProblem, condition: TrimCondition) -> tuple[Array, int]:
    """Solve directly from hover, else along conditions between hover and the one wanted.

    A direct solution beyond the limits of the controls may lie on another branch (a stalled rotor can carry the
    aircraft too), so it counts only where the path, which keeps to the branch of hover, ends.
    """
    hover, iterations = _hover(problem, condition.scaled(0.0))
    direct = None
    try:
        direct, more = _newton(problem, condition, hover)
        iterations += more
        if not problem.point(condition, direct, 0).beyond_limits:
            return direct, iterations
    except TrimError:
        pass
    try:
        solution, more = _walk(problem, condition, hover)
    except TrimError:
        if direct is None:
            raise
        return direct, iterations
    return solution, iterations + more


def _hover(problem: _TrimProblem, condition: TrimCondition) -> tuple[Array, int]:
    """Solve hover from several guesses until one leads to a flight within the limits; else the first that was found."""
    found: list[tuple[Array, int]] = []
    failure: TrimError | None = None
    for idle in IDLE_LOADINGS:
        try:
            found.append(_newton(problem, condition, problem.first_guess(idle)))
        except TrimError as error:
            failure = failure or error
            continue
        if not problem.point(condition, found[-1][0], 0).beyond_limits:
            return found[-1]
    if found:
        return found[0]
    raise failure or TrimError("no guess for hover")


def _walk(problem: _TrimProblem, condition: TrimCondition, hover: Array) -> tuple[Array, int]:
    """Solve conditions between hover and the one wanted, each from the line through the two before."""
    done, last, step = 0.0, 0.0, 0.25
    before = solution = hover
    iterations = 0
    while done < 1.0:
        share = min(1.0, done + step)
        guess = solution if done == last else solution + (solution - before) * (share - done) / (done - last)
        try:
            found, more = _newton(problem, condition.scaled(share), guess)
        except TrimError as error:
            step /= 2
            if step < SMALLEST_PATH_STEP:
                reached = condition.scaled(done)
                raise TrimError(
                    f"{error}; the path from hover ends at airspeed {reached.airspeed:.3g} m/s,"
                    f" climb_rate {reached.climb_rate:.3g} m/s, turn_rate {reached.turn_rate:.3g} rad/s"
                ) from None
            continue
        before, solution, last, done = solution, found, done, share
        iterations += more
        step *= 1.5
    return solution, iterations


def _newton(problem: _TrimProblem, condition: TrimCondition, unknowns: Array) -> tuple[Array, int]:
    """Newton's method with halved steps where a full one does not lessen the residual."""

    def equations(values: Array) -> Array:
        return problem.residual(condition, values)

    residual = equations(unknowns)
    for iteration in range(MOST_ITERATIONS):
        size = float(np.abs(residual).max())
        if size < TOLERANCE:
            return unknowns, iteration
        try:
            step = np.asarray(np.linalg.solve(problem.jacobian(condition, unknowns), residual), dtype=np.float64)
        except np.linalg.LinAlgError:
            break
        unknowns, better = _descend(equations, unknowns, step, residual)
        if better is None:
            if size < 100 * TOLERANCE:  # rounding has stopped it, not the equations
                return unknowns, iteration
            break
        residual = better
    raise TrimError(
        f"no trim after {iteration + 1} Newton iterations: residual {np.abs(residual).max():.3g}"
        f" in {problem.worst_equation(residual)}"
    )


def _descend(
    equations: Callable[[Array], Array], unknowns: Array, step: Array, residual: Array
) -> tuple[Array, Array | None]:
    """Longest of the steps 1, 1/2, 1/4 ... that lessens the residual; None if none does."""
    size = np.linalg.norm(residual)
    for halvings in range(8):
        candidate = unknowns - step / 2**halvings
        if np.abs(candidate[:BODY_UNKNOWNS]).max() < math.pi / 2:
            new = equations(candidate)
            if np.linalg.norm(new) < size:  # false for a NaN as well
                return candidate, new
    return unknowns, None


def _beyond_limits(aircraft: Aircraft, controls: Array, swash: Array) -> tuple[str, ...]:
    """What lies beyond its range, as "name = value deg: allowed are low to high deg"."""
    found = [
        _outside(name, value, aircraft.control_ranges[name])
        for name, value in zip(S.CONTROL_NAMES, controls, strict=True)
    ]
    for rotor, angles in zip(aircraft.rotors, swash, strict=True):
        ranges = (rotor.collective_range, rotor.cyclic_range, rotor.cyclic_range)
        found += [
            _outside(f"{rotor.name} {name}", value, limits)
            for name, value, limits in zip(S.SWASHPLATE_NAMES, angles, ranges, strict=True)
        ]
    return tuple(text for text in found if text)


def _outside(name: str, value: float, limits: tuple[float, float]) -> str:
    low, high = limits
    if low - 1e-12 <= value <= high + 1e-12:
        return ""
    low, high, value = (math.degrees(angle) for angle in (low, high, value))
    return f"{name} = {value:.3f} deg: allowed are {low:g} to {high:g} deg"
