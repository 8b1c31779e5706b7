"""Steady flight of rotors with two blades: motion that repeats with their common period (theory.md section 8.6).

Newton's method by shooting: of what a period begins with, states and controls, those are found with which it ends as it
began, on the wanted path. It starts from the trim of the substitute (`sbs_sim.flight.two_blades`).
"""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sbs_sim.aircraft import Aircraft
from sbs_sim.aircraft.description import Rotor
from sbs_sim.analysis.newton import DIFFERENCE_STEP, newton
from sbs_sim.errors import LinearizationError, TrimError
from sbs_sim.flight.engine import Engine, points_engine
from sbs_sim.flight.trim_point import Fidelity, TrimPoint
from sbs_sim.model import records as R
from sbs_sim.model import state as S
from sbs_sim.model.frames import euler_to_quaternion, quaternion_to_euler

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]
Rates = Callable[[Engine, Array, Array, Array], Array]

STEP = 0.13  # rad, of the fastest rotor, and of the fastest free vibration of a blade
MAX_STEPS = 20000
MAX_PASSAGES = 60  # of any rotor in one common period
LOOSE = 1e-9  # of a residual: what differences over a period leave
POSITIONS, BODY = slice(S.POSITION, S.POSITION + 3), slice(S.VELOCITY, S.BODY_SIZE)
ATTITUDES, CONTROLS = slice(0, 2), slice(2, 6)  # of the unknowns; those of the body follow, then those of the rotors
FIRST_BODY, FIRST_ROTOR = 6, 12


def common_period(aircraft: Aircraft) -> tuple[float, list[int]]:
    """Shortest time in which every rotor passes an integer number of blades [s], and those numbers.

    The differential coordinate of an even number of blades changes its sign with every blade: such a rotor passes an
    even number. One whose blades differ passes all of them.

    Raises
    ------
    LinearizationError
        There is none of at most 60 passages.
    """
    blades = np.array([rotor.blades for rotor in aircraft.rotors])
    each = blades // np.array(aircraft.passages)
    passage = each * 2.0 * math.pi / (blades * np.array([rotor.speed for rotor in aircraft.rotors]))
    for count in range(1, MAX_PASSAGES + 1):
        period = count * float(passage.max())
        numbers = np.round(period / passage)
        if np.all(np.abs(numbers * passage - period) < 1e-9 * period):
            return period, [int(number) for number in numbers * each]
    raise LinearizationError(f"the blade passages of the rotors have no common period of up to {MAX_PASSAGES} of them")


class Period:
    """The common period of the rotors of an aircraft, flown from many states at once with Runge-Kutta's method.

    Parameters
    ----------
    aircraft : Aircraft
    fidelity : Fidelity
    rates : callable, optional
        Sets the rates of states in lanes, and the loads of `Work`: (engine, states, swashplate angles, azimuths);
        those of free flight if not given.
    instants : int
        The number of steps is a multiple of it.

    Attributes
    ----------
    period : float
        [s]
    steps : int
        Of equal length.
    places : ndarray of int64, shape (k,)
        Indices in the simulation state of the rotors' states that the fidelity has.
    scales : ndarray, shape (k,)
        Their unit: 1, and the rotor's speed for the rates of angles [rad/s].

    Raises
    ------
    TrimError
        The rotors have no common period, or drives.
    """

    def __init__(self, aircraft: Aircraft, fidelity: Fidelity, rates: Rates | None = None, instants: int = 1) -> None:
        if aircraft.drives:
            raise TrimError("drives: allowed with two blades are none in a steady flight: the period follows the speed")
        self.aircraft, self.layout = aircraft, aircraft.layout
        self._rates = rates or _in_flight
        try:
            self.period, _ = common_period(aircraft)
        except LinearizationError as error:
            raise TrimError(f"rotors with two blades: {error}") from None
        fastest = max(_fastest(rotor) for rotor in aircraft.rotors)
        self._instants = instants
        self.steps = math.ceil(self.period * fastest / STEP / instants) * instants
        if self.steps > MAX_STEPS:
            raise TrimError(f"a blade vibrates at {fastest:.0f} rad/s: allowed with two blades are softer springs")
        self._engine = lambda: points_engine(aircraft.arranged(fidelity.lead_lag, fidelity.cyclic_inflow, "points"))
        self.places, self.scales = _rotor_states(aircraft, fidelity)

    def ends(self, states: Array, swashplates: Array) -> Array:
        """States after a period, shape (m, size), of states (m, size) and commands (m, 3 n_rows)."""
        return self.flown(states, swashplates)[0]

    def flown(self, states: Array, swashplates: Array) -> tuple[Array, Array, Array]:
        """States after a period, those at the beginning of every step (steps, m, size), mean loads (m, n_rotors, 8)."""
        engine, ends, ways, means = self._engine(), [], [], []
        for first in range(0, len(states), engine.n):
            part = slice(first, first + engine.n)
            count = len(states[part])
            end, way, loads = self._side_by_side(engine, list(states[part]), list(swashplates[part]))
            ends.append(end.T[:count])
            ways.append(way[:, :, :count].transpose(0, 2, 1))
            means.append(loads.T[:count])
        shape = len(states), len(self.aircraft.rotors), R.LOAD_SIZE
        return np.concatenate(ends), np.concatenate(ways, axis=1), np.concatenate(means).reshape(shape)

    def _side_by_side(
        self, engine: Engine, states: list[Array], swashplates: list[Array]
    ) -> tuple[Array, Array, Array]:
        """`flown` in lanes."""
        x, angles = engine.lanes(states), engine.lanes(swashplates)
        h, speeds = self.period / self.steps, np.array([[rotor.speed] for rotor in self.aircraft.rotors])
        way, loads = np.empty((self.steps, *x.shape)), np.zeros_like(engine.work.load_rows)
        stage, psi = engine.memory(len(x)), engine.memory(len(speeds))

        def rates(at: Array, time: float) -> Array:
            stage[:], psi[:] = at, speeds * time
            return self._rates(engine, stage, angles, psi).copy()

        for i in range(self.steps):
            way[i], time = x, i * h
            k1 = rates(x, time)
            loads += engine.work.load_rows / self.steps
            k2 = rates(x + 0.5 * h * k1, time + 0.5 * h)
            k3 = rates(x + 0.5 * h * k2, time + 0.5 * h)
            x = x + h / 6.0 * (k1 + 2.0 * (k2 + k3) + rates(x + h * k3, time + h))
        return x, way, loads

    def orbit(self, state: Array, swashplate: Array) -> Array:
        """States at the instants of a motion, shape (instants, size), of that at its beginning."""
        way = self.flown(state[np.newaxis], swashplate.reshape(1, -1))[1][:, 0]
        return way[:: self.steps // self._instants]

    def rotor_balance(self, starts: Array, ends: Array) -> Array:
        """What the rotors' states lack to be periodic, scaled, shape (m, k)."""
        speed = max(rotor.speed for rotor in self.aircraft.rotors)
        return np.asarray((ends - starts)[:, self.places] / (self.scales * self.period * speed))


def _in_flight(engine: Engine, x: Array, swashplate: Array, psi: Array) -> Array:
    slopes = engine.tick.slopes[0]
    engine.derivative(engine.model, x, swashplate, psi, engine.memory(3), engine.work, slopes, True)
    return np.asarray(slopes)


def _fastest(rotor: Rotor) -> float:
    """Frequency or decay of the fastest motion of a blade, about [rad/s]."""
    second, lag_inertia = rotor.second_moment, rotor.lag_inertia
    offset = 1.0 + rotor.hinge_offset * rotor.first_moment / second
    flap = math.sqrt(rotor.speed**2 * offset + rotor.flap_spring / second)
    lag = math.sqrt(rotor.speed**2 * offset + (rotor.lag_spring + rotor.lag_stop_spring) / lag_inertia)
    damping = rotor.lag_damping * float(rotor.lag_damping_factors.max()) + rotor.lag_stop_damping
    return max(flap, lag, damping / lag_inertia)


def _rotor_states(aircraft: Aircraft, fidelity: Fidelity) -> tuple[IntArray, Array]:
    """Indices of the rotors' states in the simulation state, and their units."""
    places: list[int] = []
    scales: list[float] = []
    index = np.arange(aircraft.layout.size)
    for j, rotor in enumerate(aircraft.rotors):
        parts = [(aircraft.layout.flap, 1.0), (aircraft.layout.flap_rate, rotor.speed)]
        if fidelity.lead_lag:
            parts += [(aircraft.layout.lag, 1.0), (aircraft.layout.lag_rate, rotor.speed)]
        for part, scale in parts:
            places += index[part(j)].tolist()
            scales += [scale] * rotor.blades
        inflow = index[aircraft.layout.inflow(j)][: 3 if fidelity.cyclic_inflow else 1].tolist()
        places, scales = places + inflow, scales + [1.0] * len(inflow)
    return np.array(places), np.array(scales)


def solved(residuals: Callable[[Array], Array], size: int, what: str) -> Array:
    """Unknowns, shape (size,), from zero, with which the residuals (m, size) of sets of unknowns (m, size) vanish."""

    def slopes(values: Array) -> Array:
        steps = DIFFERENCE_STEP * np.eye(size)
        sides = residuals(np.concatenate([values + steps, values - steps]))
        return np.asarray((sides[:size] - sides[size:]).T / (2.0 * DIFFERENCE_STEP))

    found = newton(lambda values: residuals(values[np.newaxis])[0], np.zeros(size), slopes)
    left = float(np.abs(found.residual).max())
    if not (found.converged or left < LOOSE):
        raise TrimError(f"no periodic motion of {what}: largest residual {left:.3g}")
    return found.values


class _Flight:
    """The equations of a periodic flight near a trim whose state is that of the azimuth 0."""

    def __init__(self, aircraft: Aircraft, point: TrimPoint) -> None:
        self.aircraft, self.condition = aircraft, point.condition
        self.period = Period(aircraft, Fidelity(point.lead_lag, point.cyclic_inflow, point.azimuth_count))
        self._begin, self._point = aircraft.layout.from_linear(point.state), point
        self.size = FIRST_ROTOR + len(self.period.places)

    def begin(self, values: Array) -> tuple[Array, Array]:
        """States and controls of sets of unknowns, which are departures."""
        states, place = np.repeat(self._begin[np.newaxis], len(values), axis=0), self.period.places
        states[:, BODY] += values[:, FIRST_BODY:FIRST_ROTOR]
        states[:, place] += values[:, FIRST_ROTOR:] * self.period.scales
        angles = values[:, ATTITUDES] + [self._point.pitch, self._point.roll]
        states[:, S.ATTITUDE : S.VELOCITY] = [euler_to_quaternion(0.0, *angle) for angle in angles.tolist()]
        craft, start = self.aircraft, self.aircraft.trim_unknowns(self._point.controls)
        return states, np.array([craft.with_held(start + change) for change in values[:, CONTROLS]])

    def residuals(self, values: Array) -> Array:
        """Path, attitude, body and rotors: what sets of unknowns lack to be periodic."""
        states, controls = self.begin(values)
        ends = self.period.ends(states, np.array([self.aircraft.mix(one).ravel() for one in controls]))
        time, gravity = self.period.period, max(self.aircraft.environment.gravity, 1.0)
        turned = self.condition.turn_rate * time
        path = ends[:, POSITIONS] - self._displacement(turned, time)
        before = np.column_stack([np.zeros(len(values)), values[:, ATTITUDES] + [self._point.pitch, self._point.roll]])
        after = np.array([quaternion_to_euler(end[S.ATTITUDE : S.VELOCITY]) for end in ends])
        attitude = after - before - [turned, 0.0, 0.0]
        body = (ends - states)[:, BODY] / gravity
        return np.column_stack(
            [np.column_stack([path, attitude, body]) / time, self.period.rotor_balance(states, ends)]
        )

    def _displacement(self, turned: float, time: float) -> Array:
        """Earth components of the way with a velocity that is constant in axes of the heading [m]."""
        forward, right, down, _ = self.condition.along_heading().tolist()
        sine = np.sinc(turned / np.pi)  # sin(x) / x
        half = np.sinc(turned / (2.0 * np.pi))
        versine = 0.5 * turned * half * half  # (1 - cos x) / x
        return time * np.array([sine * forward - versine * right, versine * forward + sine * right, down])


def periodic(aircraft: Aircraft, point: TrimPoint) -> TrimPoint:
    """Periodic flight near a trim, which is that of the substitute with the motion of two blades.

    Raises
    ------
    TrimError
        None is found; drives, or rotors without a common period.
    """
    flight = _Flight(aircraft, point)
    values = solved(flight.residuals, flight.size, aircraft.name)[np.newaxis]
    states, controls = flight.begin(values)
    swashplate = aircraft.mix(controls[0])
    loads = flight.period.flown(states, swashplate.reshape(1, -1))[2][0]
    torque = loads[:, R.TORQUE].copy()
    u, v, w, p, q, r = states[0, BODY]
    pitch, roll = (values[0, ATTITUDES] + [point.pitch, point.roll]).tolist()
    return replace(
        point,
        controls=controls[0],
        swashplate=swashplate,
        pitch=pitch,
        roll=roll,
        state=np.concatenate([[u, w, q, pitch, v, p, roll, r], states[0, S.BODY_SIZE :]]),
        thrust=loads[:, R.THRUST].copy(),
        torque=torque,
        power=torque * np.array([rotor.speed for rotor in aircraft.rotors]),
        residual=float(np.abs(flight.residuals(values)).max()),
    )
