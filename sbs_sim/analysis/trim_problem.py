"""The equations of trim (theory.md section 8).

Unknowns are pitch and roll, the four controls that are not held, and of every rotor flap, lag and inflow; equations are
the averages of the six body accelerations, of the flap and lag accelerations and of the inflow rates.
"""

import copy
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from sbs_sim.aircraft import Aircraft
from sbs_sim.aircraft.commands import row_problems
from sbs_sim.aircraft.description import Drive
from sbs_sim.flight.engine import Engine, inflow_owner, points_engine
from sbs_sim.flight.trim_point import Fidelity, TrimCondition, TrimPoint
from sbs_sim.flight.validity import slow_rotors, warnings
from sbs_sim.model import records as R
from sbs_sim.model import state as S
from sbs_sim.model.average import azimuths
from sbs_sim.model.balance import trim_residuals, trim_sides
from sbs_sim.model.frames import euler_to_quaternion
from sbs_sim.model.working_state import WORKING_SIZE, working_state
from sbs_sim.output.units import RPM, shown

Array = NDArray[np.float64]

ATTITUDE_UNKNOWNS, CONTROL_UNKNOWNS = 2, 4
BODY_UNKNOWNS = ATTITUDE_UNKNOWNS + CONTROL_UNKNOWNS
BODY_STEP, ROTOR_STEP = 1e-5, 1e-6  # of the differences: m/s, rad/s, rad; rad, inflow ratio
ROUNDING = 1e-12  # rad, or another unit, that a value may be beyond its limit
UNEQUAL_BLADES = "blades with unequal lag dampers: this is a mean over a revolution, stability needs Floquet's method"
JACOBIAN_AZIMUTHS = 4  # enough to say where to go, the residual says where to stop
BODY_BALANCES = (
    "force ahead",
    "force to the right",
    "vertical force",
    "rolling moment",
    "pitching moment",
    "yawing moment",
)
DRIVE_BALANCES = {S.SPEED: "torque of a drive", S.ENGINE_TORQUE: "throttle", S.GOVERNOR: "speed of a governor"}
DROOP = 1e-6  # share of the speed that a governor may lack
HALF = 0.5  # of torque and throttle: where trims begin


class TrimProblem:
    """The equations of trim for one aircraft and fidelity.

    Unknowns, shape (n,): pitch, roll, the four controls that are not held [rad, or over `Aircraft.trim_scales`]; then
    rotor by rotor flap, lag [rad] and inflow; then drive by drive the share by which its speed is off that of the file,
    its torque over the largest one, and what its governor has integrated.
    Equations, shape (n,): the rates of u, v, w, p, q, r; then those of the rotor states in the unknowns' order, flap
    and lag by their accelerations; then those of the drives.

    Attributes
    ----------
    equations : ndarray of int64, shape (n,)
        Indices of the equations in the rate of the simulation state.
    scales : ndarray, shape (n,)
        What each is divided by: gravity [m/s^2], Omega^2 [1/s^2], Omega [1/s].
    coordinates, inflow : ndarray of int64
        Indices of flap and lag, and of inflow, among the unknowns and among the equations.
    loads : ndarray, shape (n_rotors, records.LOAD_SIZE)
        Mean loads of the last residual.
    """

    def __init__(self, aircraft: Aircraft, fidelity: Fidelity) -> None:
        self.aircraft = aircraft
        self.fidelity = fidelity
        self.layout = aircraft.layout
        self.engine = points_engine(aircraft.arranged(fidelity.lead_lag, fidelity.cyclic_inflow, "points"))
        self._psi = azimuths(self.aircraft.passages, fidelity.azimuth_count)
        self._places, equations, owners = self._rotor_unknowns()
        driven = np.arange(self.layout.drives_start, self.layout.linear_size - S.LINEAR_BODY_SIZE + S.BODY_SIZE)
        self._places, equations = np.append(self._places, driven), np.append(equations, driven)
        owners = np.append(owners, np.full(len(driven), len(aircraft.rotors)))
        self._owners = np.concatenate([np.full(BODY_UNKNOWNS, len(aircraft.rotors)), owners])
        self.equations = np.concatenate([np.arange(S.VELOCITY, S.BODY_SIZE), equations])
        self.scales = self._equation_scales()
        is_inflow = (self._places >= self.layout.inflow(0).start) & (self._places < self.layout.drives_start)
        self.coordinates = BODY_UNKNOWNS + np.flatnonzero(self._places < self.layout.inflow(0).start)
        self.inflow = BODY_UNKNOWNS + np.flatnonzero(is_inflow)
        self.loads = np.zeros((len(aircraft.rotors), R.LOAD_SIZE))

    def _rotor_unknowns(self) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
        """Indices of the unknown rotor states in the simulation state, of their equations in its rate; their rotors."""
        places: list[int] = []
        equations: list[int] = []
        owners: list[int] = []
        index = np.arange(self.layout.size)
        for j in range(len(self.aircraft.rotors)):
            places += list(index[self.layout.flap(j)])
            equations += list(index[self.layout.flap_rate(j)])
            if self.fidelity.lead_lag:
                places += list(index[self.layout.lag(j)])
                equations += list(index[self.layout.lag_rate(j)])
            inflow = index[self.layout.inflow(j)][: 3 if self.fidelity.cyclic_inflow else 1]
            places += list(inflow)
            equations += list(inflow)
            owners += [j] * (len(places) - len(inflow) - len(owners))
            owners += [inflow_owner(self.engine.model, j)] * len(inflow)
            wake = list(index[self.layout.wake(j)])
            places, equations, owners = places + wake, equations + wake, owners + [j] * len(wake)
        return np.array(places), np.array(equations), np.array(owners)

    def _equation_scales(self) -> Array:
        gravity = max(self.aircraft.environment.gravity, 1.0)
        scales = np.full(self.layout.size, gravity)
        for j, rotor in enumerate(self.aircraft.rotors):
            scales[self.layout.flap_rate(j)] = scales[self.layout.lag_rate(j)] = rotor.speed * rotor.speed
            scales[self.layout.inflow(j)] = scales[self.layout.wake(j)] = rotor.speed
        for i, drive in enumerate(self.aircraft.drives):
            own = {S.SPEED: self.aircraft.drive_speed(i) ** 2, S.ENGINE_TORQUE: drive.max_torque / drive.lag}
            own[S.GOVERNOR] = drive.integral_gain
            for name in drive.state_names:
                scales[self.layout.drive(i)[name]] = own[name]
        return scales[self.equations]

    def lighter(self, share: float) -> "TrimProblem":
        """The same with a share of gravity and of the fuselage's drag; the scales stay."""
        problem = copy.copy(self)
        air = self.engine.model.air.copy()
        air["gravity"] *= share
        air["plate_areas"] *= share
        problem.engine = Engine(self.engine.model._replace(air=air))
        return problem

    def unknowns(self, pitch: float, roll: float, controls: Array, x: Array) -> Array:
        """Vector of unknowns of attitude and controls [rad] and of the rotors' part of a simulation state."""
        return np.concatenate([[pitch, roll], controls, self._with_drives(x, _drive_unknowns)[self._places]])

    def _with_drives(self, x: Array, change: Callable[[Drive, float, dict[str, float]], dict[str, float]]) -> Array:
        """Copy of a state with changed states of the drives."""
        changed = x.copy()
        for i, drive in enumerate(self.aircraft.drives):
            places = self.layout.drive(i)
            own = change(drive, self.aircraft.drive_speed(i), {name: x[places[name]] for name in drive.state_names})
            for name, value in own.items():
                changed[places[name]] = value
        return changed

    def state(self, condition: TrimCondition, unknowns: Array) -> tuple[Array, Array]:
        """Simulation state at the origin, heading north, and swashplate angles of a vector of unknowns."""
        pitch, roll = unknowns[:ATTITUDE_UNKNOWNS]
        x = np.zeros(self.layout.size)
        x[S.ATTITUDE : S.ATTITUDE + 4] = euler_to_quaternion(0.0, pitch, roll)
        x[S.VELOCITY : S.RATES], x[S.RATES : S.BODY_SIZE] = condition.motion(pitch, roll)
        x[self._places] = unknowns[BODY_UNKNOWNS:]
        x = self._with_drives(x, _drive_states)
        return x, self.aircraft.mix(self.controls(unknowns))

    def controls(self, unknowns: Array) -> Array:
        """All controls of a vector of unknowns, shape (n_controls,)."""
        return self.aircraft.with_held(unknowns[ATTITUDE_UNKNOWNS:BODY_UNKNOWNS])

    def residual(self, condition: TrimCondition, unknowns: Array) -> Array:
        """Scaled residuals of the equations; the mean loads are left in `loads`."""
        residuals, loads = self._residuals(condition, unknowns[np.newaxis], self._psi)
        self.loads = loads.reshape(self.loads.shape)
        return residuals[0]

    def jacobian(self, condition: TrimCondition, unknowns: Array) -> Array:
        """Derivative of `residual` by the unknowns, shape (n, n), averaged over a few azimuths.

        Central differences in one call of compiled code, so that trims in several threads hardly wait for each other.
        """
        steps = np.full(len(unknowns), ROTOR_STEP)
        steps[:ATTITUDE_UNKNOWNS] = BODY_STEP
        psi = azimuths(self.aircraft.passages, min(self.fidelity.azimuth_count, JACOBIAN_AZIMUTHS))
        engine, (forward, backward) = self.engine, (sides := np.empty((2, len(unknowns), len(self.equations))))
        trim_sides(
            *(engine.code.derivative, engine.model, unknowns, steps, self._owners, condition.along_heading()),
            *(self._places, self.equations, self.scales, self.aircraft.trim_rigging, psi, engine.work, engine.tick),
            *(engine.memory(len(unknowns)), np.empty(engine.n, dtype=np.int64), sides),
        )
        return ((forward - backward) / (2.0 * steps[:, np.newaxis])).T

    def _residuals(self, condition: TrimCondition, unknowns: Array, psi: Array) -> tuple[Array, Array]:
        """Scaled residuals (m, n) and mean loads (m, 8 n_rotors) of vectors of unknowns (m, n)."""
        engine = self.engine
        residuals, loads = np.empty((len(unknowns), len(self.equations))), np.empty((len(unknowns), self.loads.size))
        trim_residuals(
            *(engine.code.derivative, engine.model, unknowns, condition.along_heading(), self._places, self.equations),
            *(self.scales, self.aircraft.trim_rigging, psi, engine.work, engine.tick, engine.memory(unknowns.shape[1])),
            *(residuals, loads),
        )
        return residuals, loads

    def worst_equation(self, residual: Array) -> str:
        """Name of the equation with the largest residual, as "d(state)/dt"."""
        worst = int(np.argmax(np.abs(residual)))
        return f"d({self.layout.names[self.equations[worst]]})/dt"

    def balance(self, residual: Array) -> str:
        """What the largest residual is about, in words."""
        place = int(self.equations[int(np.argmax(np.abs(residual)))])
        if place < S.BODY_SIZE:
            return BODY_BALANCES[place - S.VELOCITY]
        part = S.part_of(self.layout.names[place])
        if part.family == "drive":
            return DRIVE_BALANCES[self.layout.names[place].partition("(")[0]]
        return f"{part.family} of {self.aircraft.rotors[part.rotor].name}"

    def beyond_limits(self, unknowns: Array) -> tuple[str, ...]:
        """What lies beyond its range, as "name = value deg: allowed are low to high deg"."""
        controls = self.controls(unknowns)
        return _beyond_limits(self.aircraft, controls, self.aircraft.mix(controls))

    def _beyond(self, condition: TrimCondition, unknowns: Array, swash: Array) -> tuple[str, ...]:
        """`beyond_limits` at the airspeed of a flight."""
        speed = float(np.linalg.norm(condition.along_heading()[:3]))
        return _beyond_limits(self.aircraft, self.controls(unknowns), self.aircraft.scheduled(swash, speed))

    def point(
        self, condition: TrimCondition, unknowns: Array, method: str, iterations: int, inner_iterations: int = 0
    ) -> TrimPoint:
        """Result of a solution."""
        residual = self.residual(condition, unknowns)
        x, swash = self.state(condition, unknowns)
        speeds = self.aircraft.rotor_speeds(x)
        torque = self.loads[:, R.TORQUE].copy()
        return TrimPoint(
            condition=condition,
            lead_lag=self.fidelity.lead_lag,
            cyclic_inflow=self.fidelity.cyclic_inflow,
            azimuth_count=self.fidelity.azimuth_count,
            controls=self.controls(unknowns),
            control_names=self.aircraft.control_names,
            control_units=self.aircraft.control_units,
            swashplate=swash,
            pitch=float(unknowns[0]),
            roll=float(unknowns[1]),
            state=self._linear_state(x, unknowns),
            state_names=self.layout.linear_names,
            thrust=self.loads[:, R.THRUST].copy(),
            torque=torque,
            power=torque * speeds,
            rotor_speed=np.array(speeds),
            residual=float(np.abs(residual).max()),
            method=method,
            iterations=iterations,
            inner_iterations=inner_iterations,
            beyond_limits=self._beyond(condition, unknowns, swash),
            warnings=self._warnings(x, swash),
            parameter_hash=self.aircraft.parameter_hash,
        )

    def _linear_state(self, x: Array, unknowns: Array) -> Array:
        """Linear state of a simulation state whose attitude is known."""
        u, v, w, p, q, r = x[S.VELOCITY : S.BODY_SIZE]
        pitch, roll = unknowns[:ATTITUDE_UNKNOWNS]
        end = self.layout.linear_size - S.LINEAR_BODY_SIZE + S.BODY_SIZE
        return np.concatenate(([u, w, q, pitch, v, p, roll, r], x[S.BODY_SIZE : end]))

    def _warnings(self, x: Array, swash: Array) -> tuple[str, ...]:
        """Where the model does not hold, by the mean of the working states over a few azimuths."""
        engine, count = self.engine, min(self.fidelity.azimuth_count, JACOBIAN_AZIMUTHS)
        psi = azimuths(self.aircraft.passages, count)
        states, angles = engine.lanes([x]), engine.lanes([swash.ravel()])
        places, still_air = engine.lanes(list(psi)), engine.memory(3)
        engine.derivative(engine.model, states, angles, places, still_air, engine.work, engine.tick.slopes[0], False)
        rows = engine.memory(engine.rotors, WORKING_SIZE)
        working_state(engine.model, engine.work, rows)
        unequal = (f"{rotor.name}: {UNEQUAL_BLADES}" for rotor in self.aircraft.rotors if not rotor.has_equal_blades)
        lines = warnings(self.aircraft, rows[..., :count].mean(axis=-1))
        return (*lines, *unequal, *self._slow_rotors(x), *self._droops(x, swash))

    def _slow_rotors(self, x: Array) -> list[str]:
        """Rotors with drives that hardly turn, a line each."""
        found = []
        for rotor, speed in slow_rotors(self.aircraft, self.aircraft.rotor_speeds(x)):
            rpm, full = (value * RPM for value in (speed, rotor.speed))
            found.append(f"{rotor.name}: turns at {rpm:.3g} of {full:.4g} rpm, too slowly to hold its blades")
        return found

    def _droops(self, x: Array, swash: Array) -> list[str]:
        """Governors that cannot hold their speed, a line each."""
        found = []
        for i, drive in enumerate(self.aircraft.drives):
            places, speed = self.layout.drive(i), self.aircraft.drive_speed(i)
            if drive.has_governor:
                throttle, set_point = self._commands(i, swash)
                missing = set_point - x[places[S.SPEED]] / speed
                wanted = throttle + x[places[S.GOVERNOR]] + drive.proportional_gain * missing
                if abs(missing) > DROOP and not 0.0 <= wanted <= 1.0:
                    found.append(f"drive {i + 1}: throttle at its end, speed {missing:.1%} below its set point")
        return found

    def _commands(self, drive: int, swash: Array) -> tuple[float, float]:
        """Throttle and set point of a drive: those of the file, or those that pilot controls command."""
        if drive not in self.aircraft.commanded_drives:
            own = self.aircraft.drives[drive]
            return own.throttle, own.set_point
        row = swash[len(self.aircraft.rotors) + self.aircraft.commanded_drives.index(drive)]
        return float(row[S.THROTTLE]), float(row[S.SET_POINT])


def _drive_unknowns(drive: Drive, speed: float, own: dict[str, float]) -> dict[str, float]:
    """Unknowns of the states of a drive; of one that stands still those with which a trim begins."""
    if own[S.SPEED] == 0.0:
        begin = {S.SPEED: drive.set_point - 1.0 if drive.has_governor else 0.0, S.ENGINE_TORQUE: HALF}
        begin[S.GOVERNOR] = _throttle(drive, speed) - drive.throttle
        return {name: begin[name] for name in own}
    scaled = {S.SPEED: own[S.SPEED] / speed - 1.0, S.ENGINE_TORQUE: own.get(S.ENGINE_TORQUE, 0.0)}
    scaled[S.ENGINE_TORQUE] /= drive.max_torque or 1.0
    return {name: scaled.get(name, value) for name, value in own.items()}


def _throttle(drive: Drive, speed: float) -> float:
    """Throttle that gives about half the largest torque at a speed [rad/s]: there no limit is in the way of a trim."""
    if drive.engine != "electric":
        return HALF
    current = HALF * drive.max_torque / drive.torque_constant
    voltage = drive.torque_constant * speed + drive.resistance * current
    return min(voltage / drive.full_voltage, 1.0) if drive.full_voltage > 0.0 else HALF


def largest_torque(drive: Drive, speed: float) -> float:
    """Largest steady torque that a drive gives to its rotors at a speed [rad/s], with a full battery [N m]."""
    if drive.engine == "none":
        return 0.0
    throttle = 1.0 if drive.has_governor or drive.mixing else drive.throttle
    most = min(drive.max_torque, drive.max_power / speed)
    if drive.engine == "electric":
        voltage = throttle * drive.full_voltage - drive.torque_constant * speed
        most = min(most, drive.torque_constant * voltage / drive.resistance)
    else:
        most *= throttle
    given = max(most, 0.0) - drive.drag
    return max(given, 0.0) if drive.free_wheel else given


def _drive_states(drive: Drive, speed: float, own: dict[str, float]) -> dict[str, float]:
    """States of a drive of its unknowns, as `sbs_sim.model.balance.set_drives` has them."""
    scaled = {S.SPEED: speed * (1.0 + own[S.SPEED]), S.ENGINE_TORQUE: drive.max_torque * own.get(S.ENGINE_TORQUE, 0.0)}
    return {name: scaled.get(name, value) for name, value in own.items()}


def _beyond_limits(aircraft: Aircraft, controls: Array, swash: Array) -> tuple[str, ...]:
    """What lies beyond its range, as "name = value deg: allowed are low to high deg"."""
    found = [
        _outside(control.name, value, control.range, control.unit)
        for control, value in zip(aircraft.controls, controls.tolist(), strict=True)
    ]
    found += [_outside(*problem) for problem in row_problems(aircraft.rows, swash)]
    return tuple(text for text in found if text)


def _outside(name: str, value: float, limits: tuple[float, float], unit: str) -> str:
    low, high = limits
    if low - ROUNDING <= value <= high + ROUNDING:
        return ""
    (value, low, high), unit = shown([value, low, high], unit)
    return f"{name} = {value:.3f} {unit}: allowed are {low:g} to {high:g} {unit}"
