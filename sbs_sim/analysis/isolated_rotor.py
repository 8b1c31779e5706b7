"""One rotor on a hub that moves steadily, or on a stand that gives way (theory.md section 8.4).

Its speed is given, or follows from the torque where it turns freely.
"""

from __future__ import annotations  # `help` then shows types by their names

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sbs_sim import checks
from sbs_sim.aircraft import Aircraft
from sbs_sim.analysis.floquet import transition
from sbs_sim.analysis.newton import newton
from sbs_sim.analysis.periodic import DEFLECTIONS, Period, Standing
from sbs_sim.content import ByContent
from sbs_sim.errors import TrimError
from sbs_sim.flight.engine import Engine, points_engine
from sbs_sim.flight.trim_point import Fidelity, TrimCondition
from sbs_sim.flight.two_blades import at_azimuths, has_two_blades, of_substitute, substitute
from sbs_sim.model import records as R
from sbs_sim.model import state as S
from sbs_sim.model.average import azimuths
from sbs_sim.model.frames import euler_to_quaternion
from sbs_sim.model.steady import steady_balance

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]
ComplexArray = NDArray[np.complex128]

ANGLE_STEP, RATE_STEP = 1e-5, 1e-3  # of the differences: rad or inflow ratio, rad/s
MIN_INSTANTS = 8
START_INFLOW = 0.02  # of the tip speed
LIMITS = {"airspeed": (-400.0, 400.0, "m/s"), "climb_rate": (-400.0, 400.0, "m/s"), "pitch": (-1.5, 1.5, "rad")}


@dataclass(frozen=True, eq=False)
class RotorPoint(ByContent):
    """Steady motion of a rotor.

    Attributes
    ----------
    swashplate : ndarray, shape (3,)
        Collective, lateral and longitudinal cyclic pitch [rad].
    state : ndarray, shape (size,)
        Simulation state, with the hub's velocity and attitude in its body part; of two blades with the first one aft.
    places : ndarray of int64, shape (n,)
        Indices in it of the unknowns: deflections of a stand, flap, lag where it moves, inflow, speed where it turns
        freely.
    speed : float
        Of the rotor [rad/s].
    thrust, torque : float
        Mean thrust [N] and shaft torque [N m], which drives where it is positive.
    force, moment : ndarray, shape (3,)
        Mean load on the hub, body axes [N, N m].
    thrust_coefficient, torque_coefficient : float
        C_T = T / (rho A (Omega R)^2), C_Q = Q / (rho A (Omega R)^2 R); NaN in vacuum.
    residual : float
        Largest of the equations, scaled as those of a trim.
    """

    swashplate: Array
    state: Array
    places: IntArray
    speed: float
    thrust: float
    torque: float
    force: Array
    moment: Array
    thrust_coefficient: float
    torque_coefficient: float
    residual: float


class IsolatedRotor:
    """The equations of the only rotor of an aircraft, its hub in steady straight flight.

    Parameters
    ----------
    aircraft : Aircraft
        With one rotor. Its body has no part in it, unless it is a stand: then its free axes move. With a drive that
        has no engine the rotor turns freely, and its speed is an unknown.
    fidelity : Fidelity, optional

    Raises
    ------
    TrimError
        The aircraft has several rotors, an engine, or a schedule of its swashplate.
    """

    def __init__(self, aircraft: Aircraft, fidelity: Fidelity | None = None) -> None:
        checks.instance("aircraft", aircraft, Aircraft, TrimError)
        if len(aircraft.rotors) != 1:
            raise TrimError(f"rotors: {len(aircraft.rotors)} of them; allowed is one that stands alone")
        if aircraft.rotors[0].schedule:
            raise TrimError(
                "rotors[0].schedule: allowed is none for a rotor that stands alone, its swashplate is given"
            )
        self.is_driven = len(aircraft.drives) > 0
        if self.is_driven:
            checks.choice("drives[0].engine.kind", aircraft.drives[0].engine, ("none",), TrimError)
        if self.is_driven and not aircraft.body.is_stand:
            aircraft = aircraft.with_value("body.stand.free", [])  # the equations of drives hold the hub on a stand
        self.aircraft, self.fidelity = aircraft, fidelity or Fidelity()
        self.rotor, self.layout = aircraft.rotors[0], aircraft.layout
        self._free = np.flatnonzero(aircraft.body.stand_free) if aircraft.body.is_stand else np.zeros(0, dtype=np.int64)
        # of two blades, which have no constant coordinates
        self._mean_rotor = IsolatedRotor(substitute(aircraft), self.fidelity) if has_two_blades(aircraft) else None
        self._azimuths = azimuths(aircraft.passages, self.fidelity.azimuth_count)
        self.places, self.rate_places = self._unknowns()
        is_inflow, is_speed = self._is_inflow(self.rate_places), self.rate_places >= self.layout.drives_start
        self._scales = np.where(is_inflow, self.rotor.speed, self.rotor.speed**2)
        self._scales[self.rate_places < S.BODY_SIZE] = max(aircraft.environment.gravity, 1.0)
        self._units = np.where(is_speed, self.rotor.speed, 1.0)  # of the unknowns, which are to be of order one

    def _unknowns(self) -> tuple[IntArray, IntArray]:
        """Indices of the unknowns, and of their equations in the rate of the state: accelerations, inflow rates."""
        index, layout = np.arange(self.layout.size), self.layout
        inflow = index[layout.inflow(0)][: 3 if self.fidelity.cyclic_inflow else 1]
        lag = (index[layout.lag(0)], index[layout.lag_rate(0)]) if self.fidelity.lead_lag else (index[:0], index[:0])
        sprung = self._free[self.aircraft.body.stand_spring[self._free] > 0.0]
        speed = [layout.drive(0)[S.SPEED]] if self.is_driven else index[:0]
        first_order = np.concatenate([inflow, index[layout.wake(0)], speed])
        places = np.concatenate([DEFLECTIONS[sprung], index[layout.flap(0)], lag[0], first_order])
        return places, np.concatenate([S.VELOCITY + sprung, index[layout.flap_rate(0)], lag[1], first_order])

    def _is_inflow(self, places: IntArray) -> NDArray[np.bool_]:
        """Which indices in the state are those of inflow."""
        return np.asarray((places >= self.layout.inflow(0).start) & (places < self.layout.drives_start))

    def steady(
        self,
        swashplate: Sequence[float],
        airspeed: float = 0.0,
        climb_rate: float = 0.0,
        pitch: float = 0.0,
        *,
        start: RotorPoint | None = None,
    ) -> RotorPoint:
        """Flap, lag, inflow and the speed of a free rotor whose mean rates vanish.

        Parameters
        ----------
        swashplate : sequence of 3 floats
            Collective, lateral and longitudinal cyclic pitch [rad].
        airspeed, climb_rate : float
            Of the hub: horizontal ahead, and up [m/s].
        pitch : float
            Of the body, nose up [rad]: with the shaft along -z it is the angle by which the disc is tilted aft.
        start : RotorPoint, optional
            Where to begin.

        Raises
        ------
        TrimError
            A value out of range, or no steady motion is found.
        """
        given = {"airspeed": airspeed, "climb_rate": climb_rate, "pitch": pitch}
        for name, value in given.items():
            low, high, unit = LIMITS[name]
            checks.number(name, value, low, high, unit, TrimError)
        if len(self._free) and pitch:
            raise TrimError(f"pitch = {pitch:g} rad: allowed is 0 on a stand that gives way, whose rest is level")
        if self._mean_rotor is not None:
            return self._periodic(self._mean_rotor, swashplate, given, start)
        x, swash = self._flight(airspeed, climb_rate, pitch), np.array(swashplate, dtype=float)
        x = x if start is None else _with(x, self.places, start.state[start.places])

        def residual(values: Array) -> Array:
            state = _with(x, self.places, values * self._units)
            return np.asarray(self._mean(state, swash)[0][self.rate_places] / self._scales)

        found = newton(residual, x[self.places] / self._units)
        if not found.converged:
            raise TrimError(
                f"no steady motion of {self.rotor.name}: largest residual {np.abs(found.residual).max():.3g}"
            )
        state = _with(x, self.places, found.values * self._units)
        return self._point(state, swash, float(np.abs(found.residual).max()))

    def _periodic(
        self, mean_rotor: IsolatedRotor, swashplate: Sequence[float], given: dict[str, float], start: RotorPoint | None
    ) -> RotorPoint:
        """Periodic motion of two blades near the steady motion of their substitute."""
        speeds = self.aircraft.rotor_speeds(self._flight(0.0, 0.0, 0.0) if start is None else start.state)
        if start is not None:
            start = replace(start, state=of_substitute(self.aircraft, start.state, speeds), places=mean_rotor.places)
        found = mean_rotor.steady(swashplate, **given, start=start)
        begin = at_azimuths(self.aircraft, found.state, np.zeros((1, 1)), np.array([found.speed]))[0]
        period, commands = self._period(), self._commands(found.swashplate)
        motion = Standing(self.aircraft, period, begin, commands)
        x, time, residual = motion.solved(self.rotor.name)
        motion.check(x, time)
        loads = period.flown(x[np.newaxis], commands[np.newaxis], np.array([time]))[2][0, 0]
        return replace(self._result(x, found.swashplate, loads, residual), speed=float(period.mean_speeds(time)[0]))

    def _period(self, instants: int = 1) -> Period:
        """A revolution of two blades; a stand or a drive lets the hub or the speed follow the loads."""
        gives_way = self.is_driven or len(self._free) > 0
        return Period(self.aircraft, self.fidelity, None if gives_way else _held, instants)

    def _along(self, point: RotorPoint, psi: Array) -> list[Array]:
        """States of a steady motion at equal steps of the azimuth over a revolution, shape (m, 1)."""
        if self._mean_rotor is None:
            return [point.state] * len(psi)
        return list(self._period(len(psi)).orbit(point.state, self._commands(point.swashplate)))

    def _flight(self, airspeed: float, climb_rate: float, pitch: float) -> Array:
        """State of the hub with the rotor's states where the search begins."""
        x = np.zeros(self.layout.size)
        x[self.layout.inflow(0).start] = START_INFLOW
        if self.is_driven:
            x[self.layout.drive(0)[S.SPEED]] = self.rotor.speed
        x[S.ATTITUDE : S.ATTITUDE + 4] = euler_to_quaternion(0.0, pitch, 0.0)
        x[S.VELOCITY : S.RATES], _ = TrimCondition(airspeed, climb_rate).motion(pitch, 0.0)
        return x

    def _point(self, x: Array, swash: Array, residual: float) -> RotorPoint:
        return self._result(x, swash, self._mean(x, swash)[1], residual)

    def _result(self, x: Array, swash: Array, loads: Array, residual: float) -> RotorPoint:
        rotor, density = self.rotor, self.aircraft.environment.air_density
        speed = float(self.aircraft.rotor_speeds(x)[0])
        tip_speed = speed * rotor.radius
        pressure = density * np.pi * rotor.radius**2 * tip_speed**2
        thrust, torque = float(loads[R.THRUST]), float(loads[R.TORQUE])
        return RotorPoint(
            swashplate=swash,
            state=x,
            places=self.places,
            speed=speed,
            thrust=thrust,
            torque=torque,
            force=loads[R.FORCE : R.FORCE + 3].copy(),
            moment=loads[R.MOMENT : R.MOMENT + 3].copy(),
            thrust_coefficient=thrust / pressure if pressure else np.nan,
            torque_coefficient=torque / (pressure * rotor.radius) if pressure else np.nan,
            residual=residual,
        )

    def _mean(self, x: Array, swash: Array) -> tuple[Array, Array]:
        """Mean rate of a state over the azimuth, and mean loads."""
        rates, loads = self._rates([x] * len(self._azimuths), swash, self._azimuths)
        return rates.mean(axis=0), loads.mean(axis=0)

    def _commands(self, swash: Array) -> Array:
        """All commands of the aircraft, with a swashplate; those to surfaces are zero."""
        commands = np.zeros(S.ROW * len(self.aircraft.rows))
        commands[: len(swash)] = swash
        return commands

    def _rates(self, states: Sequence[Array], swash: Array, psi: Array) -> tuple[Array, Array]:
        """Rates (m, size) and loads (m, 8) of states at as many azimuths; the hub accelerates on a stand alone."""
        engine = points_engine(self.aircraft.arranged(self.fidelity.lead_lag, self.fidelity.cyclic_inflow, "points"))
        rates, loads = np.empty((len(states), self.layout.size)), np.empty((len(states), R.LOAD_SIZE))
        commands = self._commands(swash)
        angles, still_air, left = engine.lanes([commands]), engine.memory(3), engine.memory(6)
        for first in range(0, len(states), engine.n):
            part = slice(first, min(first + engine.n, len(states)))
            count, slopes = part.stop - part.start, engine.tick.slopes[0]
            given, places = engine.lanes(list(states[part])), engine.lanes(list(psi[part]))
            if self.is_driven or len(self._free):
                engine.derivative(engine.model, given, angles, places, still_air, engine.work, slopes, True)
            else:
                steady_balance(engine.model, given, angles, places, still_air, engine.work, slopes, left)
            rates[part], loads[part] = slopes[:, :count].T, engine.work.load_rows[:, :count].T
        return rates, loads

    def matrix(self, point: RotorPoint, *, inflow: bool = True) -> tuple[Array, tuple[str, ...]]:
        """System matrix of the rotor with its hub held, or on its stand, averaged over the azimuth.

        Parameters
        ----------
        point : RotorPoint
            Of this rotor.
        inflow : bool
            False holds the inflow.

        Returns
        -------
        a : ndarray, shape (n, n)
        names : tuple of str
            Of its n states, those of the simulation state: deflections of a stand (in rotation half the angles),
            angles, velocities of the stand, rates of the angles, inflow, speed of a rotor that turns freely.

        Raises
        ------
        TrimError
            A rotor with two blades.
        """
        if self._mean_rotor is not None:
            raise TrimError(
                f"{self.rotor.name} has 2 blades: no constant matrix describes them; `exponents` are theirs"
            )
        used = self._used(inflow)
        return self._matrices(point, used, self._azimuths).mean(axis=0), tuple(self.layout.names[i] for i in used)

    def exponents(self, point: RotorPoint, azimuth_count: int = 240, *, inflow: bool = True) -> ComplexArray:
        """Characteristic exponents of the rotor with its hub held, or on its stand, by Floquet's method.

        They hold for blades that differ and for stands that are not alike along x and y, whose matrix is periodic in
        the coordinates of this program.

        Parameters
        ----------
        point : RotorPoint
            Of this rotor.
        azimuth_count : int
            Instants of a revolution at which the rotor is linearized, even; two make a step.
        inflow : bool
            False holds the inflow.

        Returns
        -------
        ndarray of complex, shape (n,)
            log(multiplier) / period of a revolution [1/s], the fastest growing first; imaginary parts are known but for
            multiples of the rotor's speed.

        Raises
        ------
        TrimError
            A count that is odd or less than 8, or a rotor whose speed is not constant.
        """
        if self.is_driven:
            raise TrimError("drives: allowed is none, Floquet's method needs a constant speed")
        if azimuth_count < MIN_INSTANTS or azimuth_count % 2:
            raise TrimError(f"azimuth_count = {azimuth_count}: allowed are even numbers from {MIN_INSTANTS}")
        period = 2.0 * np.pi / self.rotor.speed
        a = self._matrices(point, self._used(inflow), azimuths((1,), azimuth_count))
        found = np.log(np.linalg.eigvals(transition(a, period)).astype(complex)) / period
        return np.asarray(found[np.argsort(-found.real)])

    def _used(self, inflow: bool) -> IntArray:
        """Indices of the states of the system matrix in the simulation state."""
        layout, index = self.layout, np.arange(self.layout.size)
        is_inflow, is_speed = self._is_inflow(self.places), self.places >= layout.drives_start
        deflections = DEFLECTIONS[self._free]
        angles = self.places[~is_inflow & ~is_speed & (self.places >= S.BODY_SIZE)]
        flap, lag = index[layout.flap_rate(0)], index[layout.lag_rate(0)]
        rates = np.concatenate([flap, lag]) if self.fidelity.lead_lag else flap
        velocities, inflows = S.VELOCITY + self._free, self.places[is_inflow] if inflow else index[:0]
        used = np.concatenate([deflections, angles, velocities, rates, inflows, self.places[is_speed]])
        return np.array([i for i in used.tolist() if layout.names[i] not in self.aircraft.locked_names])

    def _matrices(self, point: RotorPoint, used: IntArray, psi: Array) -> Array:
        """System matrix at every azimuth, shape (m, n, n)."""
        index, layout, columns, states = np.arange(self.layout.size), self.layout, [], self._along(point, psi)
        rates = {*index[layout.flap_rate(0)].tolist(), *index[layout.lag_rate(0)].tolist()}
        rates |= set(self.places[self.places >= layout.drives_start].tolist())
        for i in used.tolist():
            step = RATE_STEP * self.rotor.speed if i in rates else ANGLE_STEP
            after, before = (
                self._rates([_moved(state, i, change) for state in states], point.swashplate, psi)[0]
                for change in (step, -step)
            )
            columns.append((after - before)[:, used] / (2.0 * step))
        return np.stack(columns, axis=-1)


def _with(x: Array, places: IntArray, values: Array) -> Array:
    """A state with some of its values changed."""
    changed = x.copy()
    changed[places] = values
    turn = changed[S.ATTITUDE + 1 : S.ATTITUDE + 4]
    changed[S.ATTITUDE] = np.sqrt(1.0 - turn @ turn)
    return changed


def _held(engine: Engine, x: Array, swashplate: Array, psi: Array) -> Array:
    """Rates and loads of a rotor whose hub moves steadily."""
    slopes = engine.tick.slopes[0]
    steady_balance(engine.model, x, swashplate, psi, engine.memory(3), engine.work, slopes, engine.memory(6))
    return np.asarray(slopes)


def _moved(x: Array, place: int, step: float) -> Array:
    return _with(x, np.array([place]), x[place] + step)
