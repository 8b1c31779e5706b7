"""Steady motion of rotors with two blades, which repeats with their common period (theory.md section 8.6).

Newton's method by shooting: of what a period begins with, states and controls, those are found with which it ends as it
began, on the wanted path or on a stand. It starts from the trim of the substitute (`sbs_sim.flight.two_blades`). Where
a drive turns the rotors, the period is that of their speed, and one more unknown.
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
from sbs_sim.flight.trim_point import Fidelity, StandPoint, TrimPoint
from sbs_sim.model import records as R
from sbs_sim.model import state as S
from sbs_sim.model.frames import euler_to_quaternion, quaternion_to_euler

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]
Rates = Callable[[Engine, Array, Array, Array], Array]

STEP = 0.13  # rad, of the fastest rotor, and of the fastest free vibration of a blade
STABLE = 1.5  # of a step times what decays at once: Runge-Kutta's method holds it up to 2.8
FAST_FLIGHT = 2.3  # of the velocity of a section in hover: on the advancing side at an advance ratio of 1
MAX_STEPS = 20000
MAX_PASSAGES = 60  # of any rotor in one common period
LOOSE = 1e-9  # of a residual: what differences over a period leave
GRAVITY = 9.80665  # m/s^2
# in the state, along and about x, y, z: position, and the vector part of the attitude, half the angle
DEFLECTIONS = np.array([S.POSITION, S.POSITION + 1, S.POSITION + 2, S.ATTITUDE + 1, S.ATTITUDE + 2, S.ATTITUDE + 3])
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
        There is none of at most 60 passages, or rotors turn at speeds of their own.
    """
    if aircraft.drives and (len(aircraft.drives) > 1 or len(aircraft.drives[0].rotors) < len(aircraft.rotors)):
        raise LinearizationError(
            "rotors whose speeds are their own have no common period: allowed are all rotors on one drive, or no drives"
        )
    blades = np.array([rotor.blades for rotor in aircraft.rotors])
    each = blades // np.array(aircraft.passages)
    passage = each * 2.0 * math.pi / (blades * np.array([rotor.speed for rotor in aircraft.rotors]))
    for count in range(1, MAX_PASSAGES + 1):
        period = count * float(passage.max())
        numbers = np.round(period / passage)
        if np.all(np.abs(numbers * passage - period) < 1e-9 * period):
            return period, [int(number) for number in numbers * each]
    raise LinearizationError(f"the blade passages of the rotors have no common period of up to {MAX_PASSAGES} of them")


def in_place_of_a_model(aircraft: Aircraft) -> str:
    """What there is of rotors with two blades in place of a constant linear model, in words for an error."""
    if aircraft.body.is_stand:
        return "stability of a rotor alone on a stand is sbs_sim.analysis.isolated_rotor.IsolatedRotor.exponents"
    try:
        common_period(aircraft)
    except LinearizationError as error:
        return f"{error}, so that Floquet's method does not apply either; there are `trim` in the mean and `simulate`"
    return "stability is that of Floquet's method, linearize --floquet or sbs_sim.analysis.floquet"


def flown_period(aircraft: Aircraft, point: TrimPoint) -> float:
    """Common period with the speed that the rotors have in a trim [s]; see `common_period`."""
    return common_period(aircraft)[0] * aircraft.rotors[0].speed / float(point.rotor_speed[0])


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
        [s], of rotors with a drive at the speed in the file.
    is_unknown : bool
        A drive turns the rotors.
    steps : int
        Of equal length.
    places : ndarray of int64, shape (k,)
        Indices in the simulation state of the states of rotors and drives that the fidelity has.
    scales : ndarray, shape (k,)
        Their unit: 1, the rotor's speed for the rates of angles [rad/s], a drive's speed and largest torque.
    size : int
        Number of these, and of the period where it is an unknown.

    Raises
    ------
    TrimError
        The rotors have no common period.
    """

    def __init__(self, aircraft: Aircraft, fidelity: Fidelity, rates: Rates | None = None, instants: int = 1) -> None:
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
        self.is_unknown = bool(aircraft.drives)
        self.size = len(self.places) + self.is_unknown
        # psi of rotors with a drive is where they are when its azimuth is 0
        self._speeds = np.array([[0.0 if self.is_unknown else rotor.speed] for rotor in aircraft.rotors])
        self._azimuth = self.layout.drive(0)[S.UNSEEN_NAMES[S.AZIMUTH]] if self.is_unknown else 0

    def moved(self, states: Array, values: Array) -> tuple[Array, Array]:
        """States (m, size) with scaled departures (m, `size`) of rotors and drives added, and the periods (m,) [s]."""
        changed, count = states.copy(), len(self.places)
        changed[:, self.places] += values[:, :count] * self.scales
        shares = values[:, count] if self.is_unknown else np.zeros(len(values))
        return changed, self.period * (1.0 + shares)

    def ends(self, states: Array, swashplates: Array, periods: Array) -> Array:
        """States after a period, shape (m, size), of states (m, size), commands (m, 3 n_rows) and periods (m,)."""
        return self.flown(states, swashplates, periods)[0]

    def flown(self, states: Array, swashplates: Array, periods: Array) -> tuple[Array, Array, Array]:
        """States after a period, those at the beginning of every step (steps, m, size), mean loads (m, n_rotors, 8)."""
        engine, ends, ways, means = self._engine(), [], [], []
        for first in range(0, len(states), engine.n):
            part = slice(first, first + engine.n)
            count = len(states[part])
            given = list(states[part]), list(swashplates[part]), list(periods[part, np.newaxis])
            end, way, loads = self._side_by_side(engine, *given)
            ends.append(end.T[:count])
            ways.append(way[:, :, :count].transpose(0, 2, 1))
            means.append(loads.T[:count])
        shape = len(states), len(self.aircraft.rotors), R.LOAD_SIZE
        return np.concatenate(ends), np.concatenate(ways, axis=1), np.concatenate(means).reshape(shape)

    def _side_by_side(
        self, engine: Engine, states: list[Array], swashplates: list[Array], periods: list[Array]
    ) -> tuple[Array, Array, Array]:
        """`flown` in lanes."""
        x, angles = engine.lanes(states), engine.lanes(swashplates)
        h = engine.lanes(periods)[0] / self.steps
        way, loads = np.empty((self.steps, *x.shape)), np.zeros_like(engine.work.load_rows)
        stage, psi = engine.memory(len(x)), engine.memory(len(self._speeds))

        def rates(at: Array, time: Array) -> Array:
            stage[:], psi[:] = at, self._speeds * time
            return self._rates(engine, stage, angles, psi).copy()

        for i in range(self.steps):
            way[i], time = x, i * h
            k1 = rates(x, time)
            loads += engine.work.load_rows / self.steps
            k2 = rates(x + 0.5 * h * k1, time + 0.5 * h)
            k3 = rates(x + 0.5 * h * k2, time + 0.5 * h)
            x = x + h / 6.0 * (k1 + 2.0 * (k2 + k3) + rates(x + h * k3, time + h))
        return x, way, loads

    def orbit(self, state: Array, swashplate: Array, time: float | None = None) -> Array:
        """States at the instants of a motion, shape (instants, size), of that at its beginning and its period [s]."""
        way = self.flown(state[np.newaxis], swashplate.reshape(1, -1), np.array([time or self.period]))[1][:, 0]
        return way[:: self.steps // self._instants]

    def rotor_balance(self, starts: Array, ends: Array) -> Array:
        """What the states of rotors and drives lack to be periodic, scaled, shape (m, `size`).

        The last is what a drive lacks of the turns in which all its rotors pass a number of blades.
        """
        speed = max(rotor.speed for rotor in self.aircraft.rotors)
        left = (ends - starts)[:, self.places] / (self.scales * self.period * speed)
        if not self.is_unknown:
            return np.asarray(left)
        angle = self.period * self.aircraft.drive_speed(0)
        return np.column_stack([left, (ends - starts)[:, self._azimuth] / angle - 1.0])

    def mean_speeds(self, period: float) -> Array:
        """Mean speeds of the rotors over a period [rad/s]."""
        speeds = np.array([rotor.speed for rotor in self.aircraft.rotors])
        return speeds * (self.period / period)


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
    return max(flap, lag, damping / lag_inertia, FAST_FLIGHT * rotor.wake_rate * STEP / STABLE)


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
        inflow += index[aircraft.layout.wake(j)].tolist()
        places, scales = places + inflow, scales + [1.0] * len(inflow)
    for i, drive in enumerate(aircraft.drives):
        own = {S.SPEED: aircraft.drive_speed(i), S.ENGINE_TORQUE: drive.max_torque, S.GOVERNOR: 1.0}
        places += [aircraft.layout.drive(i)[name] for name in drive.state_names]
        scales += [own[name] for name in drive.state_names]
    return np.array(places), np.array(scales)


def solved(residuals: Callable[[Array], Array], size: int, what: str) -> Array:
    """Unknowns, shape (size,), from zero, with which the residuals (m, size) of sets of unknowns (m, size) vanish."""

    def slopes(values: Array) -> Array:
        steps = DIFFERENCE_STEP * np.eye(size)
        sides = residuals(np.concatenate([values + steps, values - steps]))
        return np.asarray((sides[:size] - sides[size:]).T / (2.0 * DIFFERENCE_STEP))

    found = newton(lambda values: residuals(values[np.newaxis])[0], np.zeros(size), slopes)
    left = float(np.abs(found.residual).max())
    if not math.isfinite(left):
        raise TrimError(f"no periodic motion of {what}: it leaves what is plausible within a period")
    if not (found.converged or left < LOOSE):
        raise TrimError(f"no periodic motion of {what}: largest residual {left:.3g}")
    return found.values


class _Flight:
    """The equations of a periodic flight near a trim whose state is that of the azimuth 0."""

    def __init__(self, aircraft: Aircraft, point: TrimPoint) -> None:
        self.aircraft, self.condition = aircraft, point.condition
        self.period = Period(aircraft, Fidelity(point.lead_lag, point.cyclic_inflow, point.azimuth_count))
        self._begin, self._point = aircraft.layout.from_linear(point.state), point
        self.size = FIRST_ROTOR + self.period.size

    def begin(self, values: Array) -> tuple[Array, Array, Array]:
        """States, controls and periods of sets of unknowns, which are departures."""
        states = np.repeat(self._begin[np.newaxis], len(values), axis=0)
        states, periods = self.period.moved(states, values[:, FIRST_ROTOR:])
        states[:, BODY] += values[:, FIRST_BODY:FIRST_ROTOR]
        angles = values[:, ATTITUDES] + [self._point.pitch, self._point.roll]
        states[:, S.ATTITUDE : S.VELOCITY] = [euler_to_quaternion(0.0, *angle) for angle in angles.tolist()]
        craft, start = self.aircraft, self.aircraft.trim_unknowns(self._point.controls)
        return states, np.array([craft.with_held(start + change) for change in values[:, CONTROLS]]), periods

    def residuals(self, values: Array) -> Array:
        """Path, attitude, body and rotors: what sets of unknowns lack to be periodic."""
        states, controls, periods = self.begin(values)
        ends = self.period.ends(states, np.array([self.aircraft.mix(one).ravel() for one in controls]), periods)
        time, gravity = self.period.period, max(self.aircraft.environment.gravity, 1.0)
        turned = self.condition.turn_rate * periods
        path = ends[:, POSITIONS] - self._displacement(turned, periods)
        before = np.column_stack([np.zeros(len(values)), values[:, ATTITUDES] + [self._point.pitch, self._point.roll]])
        after = np.array([quaternion_to_euler(end[S.ATTITUDE : S.VELOCITY]) for end in ends])
        attitude = after - before - turned[:, np.newaxis] * [1.0, 0.0, 0.0]
        body = (ends - states)[:, BODY] / gravity
        return np.column_stack(
            [np.column_stack([path, attitude, body]) / time, self.period.rotor_balance(states, ends)]
        )

    def _displacement(self, turned: Array, time: Array) -> Array:
        """Earth components, shape (m, 3), of ways with a velocity that is constant in axes of the heading [m]."""
        forward, right, down, _ = self.condition.along_heading().tolist()
        sine = np.sinc(turned / np.pi)  # sin(x) / x
        half = np.sinc(turned / (2.0 * np.pi))
        versine = 0.5 * turned * half * half  # (1 - cos x) / x
        ways = [sine * forward - versine * right, versine * forward + sine * right, down + 0.0 * turned]
        return np.asarray((time * np.array(ways)).T)


def _linear_end(aircraft: Aircraft) -> int:
    """End in the simulation state of what the linear state has of rotors and drives."""
    return aircraft.layout.linear_size - S.LINEAR_BODY_SIZE + S.BODY_SIZE


def periodic(aircraft: Aircraft, point: TrimPoint) -> TrimPoint:
    """Periodic flight near a trim, which is that of the substitute with the motion of two blades.

    Raises
    ------
    TrimError
        None is found, or rotors without a common period.
    """
    flight = _Flight(aircraft, point)
    values = solved(flight.residuals, flight.size, aircraft.name)[np.newaxis]
    states, controls, periods = flight.begin(values)
    swashplate, speeds = aircraft.mix(controls[0]), flight.period.mean_speeds(periods[0])
    loads = flight.period.flown(states, swashplate.reshape(1, -1), periods)[2][0]
    torque = loads[:, R.TORQUE].copy()
    u, v, w, p, q, r = states[0, BODY]
    pitch, roll = (values[0, ATTITUDES] + [point.pitch, point.roll]).tolist()
    return replace(
        point,
        controls=controls[0],
        swashplate=swashplate,
        pitch=pitch,
        roll=roll,
        state=np.concatenate([[u, w, q, pitch, v, p, roll, r], states[0, S.BODY_SIZE : _linear_end(aircraft)]]),
        thrust=loads[:, R.THRUST].copy(),
        torque=torque,
        power=torque * speeds,
        rotor_speed=speeds,
        residual=float(np.abs(flight.residuals(values)).max()),
    )


class Standing:
    """Periodic motion of rotors whose hubs stand, under given commands, near a state at the azimuth 0.

    Unknowns, shape (m, size), are departures: of the stand's sprung axes the deflections, of its free axes the
    velocities, then those of `Period`. An axis without spring begins with the velocity with which it comes back.

    Parameters
    ----------
    aircraft : Aircraft
    period : Period
    begin : ndarray, shape (size,)
        Simulation state.
    commands : ndarray, shape (3 n_rows,)
    """

    def __init__(self, aircraft: Aircraft, period: Period, begin: Array, commands: Array) -> None:
        body, radius = aircraft.body, aircraft.rotors[0].radius
        self._free = np.flatnonzero(body.stand_free) if body.is_stand else np.zeros(0, dtype=np.int64)
        self._sprung = self._free[body.stand_spring[self._free] > 0.0]
        units = np.array([radius] * 3 + [1.0] * 3)
        self._places, self._scales = DEFLECTIONS[self._sprung], units[self._sprung]
        speed = max(rotor.speed for rotor in aircraft.rotors)
        self._rates, self._rate_scales = S.VELOCITY + self._free, units[self._free] * speed
        self.period, self._begin, self._commands, self._speed = period, begin, commands, speed
        self.size = len(self._sprung) + len(self._free) + period.size

    def begin(self, values: Array) -> tuple[Array, Array]:
        """States and periods of sets of unknowns."""
        angles, rates = len(self._sprung), len(self._sprung) + len(self._free)
        states = np.repeat(self._begin[np.newaxis], len(values), axis=0)
        states, periods = self.period.moved(states, values[:, rates:])
        states[:, self._places] += values[:, :angles] * self._scales
        states[:, self._rates] += values[:, angles:rates] * self._rate_scales
        turn = states[:, S.ATTITUDE + 1 : S.VELOCITY]
        states[:, S.ATTITUDE] = np.sqrt(1.0 - (turn * turn).sum(axis=1))
        return states, periods

    def residuals(self, values: Array) -> Array:
        """What sets of unknowns lack to repeat."""
        states, periods = self.begin(values)
        ends = self.period.ends(states, np.repeat([self._commands], len(values), axis=0), periods)
        angle = self.period.period * self._speed
        units = np.ones(6)
        units[self._sprung] = self._scales
        moved = (ends - states)[:, DEFLECTIONS[self._free]] / (units[self._free] * angle)
        sprung = self._free_index()
        turned = (ends - states)[:, S.VELOCITY + self._sprung] / (self._rate_scales[sprung] * angle)
        return np.column_stack([moved, turned, self.period.rotor_balance(states, ends)])

    def _free_index(self) -> IntArray:
        """Which of the free axes have a spring."""
        return np.flatnonzero(np.isin(self._free, self._sprung))

    def solved(self, what: str) -> tuple[Array, float, float]:
        """State at the azimuth 0, period [s] and residual of the motion that repeats."""
        values = solved(self.residuals, self.size, what)[np.newaxis]
        states, periods = self.begin(values)
        return states[0], float(periods[0]), float(np.abs(self.residuals(values)).max())

    def check(self, state: Array, period: float) -> None:
        """Raise TrimError where an axis without a spring goes faster from period to period."""
        end = self.period.ends(state[np.newaxis], self._commands[np.newaxis], np.array([period]))[0]
        for axis in sorted(set(self._free.tolist()) - set(self._sprung.tolist())):
            if abs(end - state)[S.VELOCITY + axis] / period > LOOSE * GRAVITY:
                name = tuple(S.DEFLECTIONS)[axis]
                raise TrimError(f"no rest on the stand: {name} is free without a spring, and has an acceleration")


def periodic_rest(aircraft: Aircraft, point: StandPoint) -> StandPoint:
    """Periodic motion of rotors on a stand near a rest, which is that of the substitute with the motion of two blades.

    Raises
    ------
    TrimError
        None is found, rotors without a common period, or a load along a free axis without a spring.
    """
    fidelity = Fidelity(point.lead_lag, point.cyclic_inflow, point.azimuth_count)
    period = Period(aircraft, fidelity)
    motion = Standing(aircraft, period, point.simulation_state(aircraft.layout), point.swashplate.ravel())
    x, time, residual = motion.solved(aircraft.name)
    motion.check(x, time)
    loads = period.flown(x[np.newaxis], point.swashplate.reshape(1, -1), np.array([time]))[2][0]
    heading, pitch, roll = quaternion_to_euler(x[S.ATTITUDE : S.VELOCITY])
    torque, speeds = loads[:, R.TORQUE].copy(), period.mean_speeds(time)
    return replace(
        point,
        pitch=float(pitch),
        roll=float(roll),
        heading=float(heading),
        position=x[S.POSITION : S.ATTITUDE].copy(),
        state=aircraft.layout.to_linear(x),
        thrust=loads[:, R.THRUST].copy(),
        torque=torque,
        power=torque * speeds,
        rotor_speed=speeds,
        residual=residual,
    )
