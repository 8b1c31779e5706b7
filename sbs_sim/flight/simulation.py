"""Flight in time: a stateful `Simulation` that advances tick by tick.

A tick is the period at which states are handed out and commands taken in; it holds an integer number of integration
steps. Steps are counted in integers from the start, and time is step x dt, so that the same commands at the same steps
give the same flight to the last bit.
"""

from __future__ import annotations  # `help` then shows types by their names

import math
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sbs_sim import checks
from sbs_sim.aircraft import Aircraft
from sbs_sim.aircraft.commands import row_problems
from sbs_sim.aircraft.model_records import ground_record
from sbs_sim.errors import SimulationError
from sbs_sim.flight.contact import amplification, check_step, ground_forces
from sbs_sim.flight.engine import Engine
from sbs_sim.flight.formation import Flown, Formation
from sbs_sim.flight.records import Event, Motion, Snapshot
from sbs_sim.flight.rotor_matrices import RotorMatrices, arranged, rotor_matrices
from sbs_sim.model import state as S
from sbs_sim.model.air import air_in_space
from sbs_sim.model.frames import down_of
from sbs_sim.model.ground import lowest_point
from sbs_sim.model.integrate import ETD, FLYING, PARTITIONED, RK4, TSIT5, azimuths_at
from sbs_sim.model.records import NOISE, Space
from sbs_sim.model.ring_noise import RingNoise
from sbs_sim.model.solve import length
from sbs_sim.model.wind import Wind, WindField, winds_at
from sbs_sim.model.working_state import WORKING_SIZE

if TYPE_CHECKING:
    from sbs_sim.flight.stitched import StitchedModel

Array = NDArray[np.float64]

UNIT = 1e-9  # a quaternion whose norm is this near to one is a unit quaternion
FREE_METHODS = ("rk4", "tsit5")  # for rotors whose speed is a state
METHODS = {"etd": ETD, "rk4": RK4, "tsit5": TSIT5, "partitioned": PARTITIONED}
METHOD, FREE_METHOD = "etd", "tsit5"  # by default, without drives and with them
AUTO = "auto"  # one of these two
TICKS = (1e-4, 1.0)  # s, shortest and longest
AZIMUTH_STEPS = (math.radians(0.01), math.radians(45.0))  # rad
AZIMUTH_STEP_DEG = 14.4  # by default: docs/speed.md has its errors
AZIMUTH_STEP = math.radians(AZIMUTH_STEP_DEG)

STALL_STEPS = 0.6  # steps in the shortest lag of stall in hover: half again the airspeed is stable by every method
# A tick is one uninterrupted call of compiled code; this many steps take it a tenth of a second.
MAX_STEPS_PER_TICK = 10_000
MAX_WIND_TICKS = 1_000_000_000  # that turbulence is brought forward by for a log that begins in mid-flight: minutes
WATCH_PERIOD = 0.1  # s of flight between looks whether the model holds

# Beyond these magnitudes a state is not plausible and the simulation stops. The angles and the inflow are far outside
# the validity of the model; the velocity is beyond the speed of sound.
PLAUSIBLE_POSITION = 1e8  # m
PLAUSIBLE_VELOCITY = 350.0  # m/s
PLAUSIBLE_RATE = 100.0  # rad/s
PLAUSIBLE_ANGLE = 1.5  # rad, multiblade coordinates of flap and lag
PLAUSIBLE_SHARE = 2.0  # of the chord that is attached, or flow across the chord over the tip speed
PLAUSIBLE_LIFT = 200.0  # of pressure and vortex, and age of the vortex in semi-chords
PLAUSIBLE_INFLOW = 1.0
PLAUSIBLE_SPEED = 3.0  # of rotors, over that of the file
PLAUSIBLE_TURNS = 1e9  # rad


class Simulation:
    """An aircraft in flight.

    Parameters
    ----------
    aircraft : Aircraft
    state : ndarray, shape (size,)
        Simulation state at the start.
    swashplate : ndarray, shape (n_rows, 3)
        Angles until others are set [rad], see `Aircraft.mix`.
    tick : float
        Length of a tick [s], 1e-4 to 1.
    azimuth_step : float
        Largest step of the fastest rotor's azimuth [rad]; the step is the tick divided by the smallest integer
        that keeps to it.
    lead_lag, cyclic_inflow : bool
        Fidelity.
    method : str
        "etd", of fourth order, which solves what is stiff in the rotors exactly; "rk4", the classical one; "tsit5", of
        fifth order; or "partitioned": the paper's scheme,
        whose error is of first order in the step. Aircraft with drives fly by "rk4" or "tsit5". "auto" is "tsit5" for
        these, and "etd" for others; `options` has which.
    wind : Wind
    ground_altitude : float, optional
        Height of the ground above the origin [m], and none for -inf; that of the aircraft file if not given. A c.g. or
        rotor that touches it ends the flight; contact points carry an aircraft whose file has `ground.contact`.

    Raises
    ------
    SimulationError
        A value out of range or a state that is not plausible, naming it.
    """

    stitched: StitchedModel | None = None  # that flies in place of the full model

    def __init__(
        self,
        aircraft: Aircraft,
        state: ArrayLike,
        swashplate: ArrayLike,
        *,
        tick: float = 0.01,
        azimuth_step: float = AZIMUTH_STEP,
        lead_lag: bool = True,
        cyclic_inflow: bool = True,
        method: str = AUTO,
        wind: Wind | None = None,
        ground_altitude: float | None = None,
    ) -> None:
        checks.instance("aircraft", aircraft, Aircraft, SimulationError)
        tick = checks.number("tick", tick, *TICKS, "s", SimulationError)
        azimuth_step = checks.number("azimuth_step", azimuth_step, *AZIMUTH_STEPS, "rad", SimulationError)
        lead_lag = checks.flag("lead_lag", lead_lag, SimulationError)
        cyclic_inflow = checks.flag("cyclic_inflow", cyclic_inflow, SimulationError)
        method = chosen_method(aircraft, method)
        ground = ground_of(aircraft, ground_altitude)
        self.options: dict[str, Any] = {
            "tick": tick,
            "azimuth_step": azimuth_step,
            "lead_lag": lead_lag,
            "cyclic_inflow": cyclic_inflow,
            "method": method,
            "ground_altitude": ground,
        }
        self.aircraft = aircraft
        self.layout = aircraft.layout
        self.tick = tick
        fastest = max(rotor.speed for rotor in aircraft.rotors)
        # the margin keeps a step that is right but for rounding from being cut once more
        rates = [fastest / azimuth_step, *(STALL_STEPS * rotor.stall_rate for rotor in aircraft.rotors)]
        self.steps_per_tick = max(1, math.ceil(max(rates) * tick * (1 - 1e-12)))
        if self.steps_per_tick > MAX_STEPS_PER_TICK:
            raise SimulationError(
                f"azimuth_step = {math.degrees(azimuth_step):g} deg takes {self.steps_per_tick} steps in a tick of"
                f" {tick:g} s: allowed are up to {MAX_STEPS_PER_TICK}"
            )
        self.step_size = tick / self.steps_per_tick
        self.method = METHODS[method]
        self.ground = ground_record(aircraft, ground)
        self.model = aircraft.model(lead_lag, cyclic_inflow)._replace(ground=self.ground)
        if aircraft.has_contact:
            check_step(aircraft, self.method, self.step_size)
        self._check_wakes(method)
        depth = float(self.ground["depth"][0, 0])
        self.bounds = np.append(plausible_bounds(aircraft), math.inf if math.isinf(ground) else depth)
        self.watch = max(1, round(WATCH_PERIOD / tick))
        self.azimuth0 = np.zeros(len(aircraft.rotors))
        self._held = held_states(aircraft, lead_lag, cyclic_inflow)
        self.step = 0
        self._ring: RingNoise | None = None
        self.set_wind(Wind() if wind is None else wind)
        self.state = self.checked_state(state)
        self.swashplate = self.checked_swashplate(swashplate)

    def _check_wakes(self, method: str) -> None:
        """Raise SimulationError where the circulation of blades follows faster than a step can hold."""
        for rotor in self.aircraft.rotors:
            change = rotor.wake_rate * self.step_size
            if method in FREE_METHODS and abs(amplification(self.method, complex(-change))) > 1.0:
                raise SimulationError(
                    f"{rotor.name}: unsteady_airfoil = {rotor.unsteady_airfoil}, whose circulation follows at"
                    f" {rotor.wake_rate:.4g} 1/s, is not stable at a step of {1e3 * self.step_size:.4g} ms with method"
                    f" = {method}: allowed are a smaller azimuth_step, or a longer chord"
                )

    @cached_property
    def engine(self) -> Engine:
        """What flies this aircraft alone."""
        options = self.options["lead_lag"], self.options["cyclic_inflow"]
        model = self.aircraft.arranged(*options, "blades")._replace(ground=self.ground)
        engine = Engine(model, self.method, arranged([self.rotor_matrices]))
        engine.set_space([self.space])
        return engine

    @property
    def rotor_matrices(self) -> RotorMatrices | None:
        """What the exponential method needs; None for other methods."""
        if self.method != ETD:
            return None
        return rotor_matrices(self.aircraft, self.options["lead_lag"], self.options["cyclic_inflow"], self.step_size)

    @property
    def time(self) -> float:
        """Simulation time [s]."""
        return self.step * self.step_size

    @property
    def wind(self) -> Wind:
        """The wind in force."""
        return self._field.wind

    @property
    def space(self) -> Space | None:
        """What of the air in force is not the same everywhere."""
        return self._field.space

    def beginning(self) -> Event:
        """The present as the start of a flight."""
        swashplate, state = self.swashplate.copy(), self.state.copy()
        return Event(self.step, "start", swashplate, state, self.wind, self._wind_step, self._field.ticks)

    def resume_from(self, start: Event) -> None:
        """Take step, and with it time and azimuths, and the age of the wind from the start of a log.

        Raises
        ------
        SimulationError
            The start is before its wind, or long after it.
        """
        checks.integer("wind_step", start.wind_step, 0, start.step, SimulationError)
        checks.integer("wind_ticks", start.wind_ticks, 0, MAX_WIND_TICKS, SimulationError)
        self.step, self._wind_step = start.step, start.wind_step
        self._set_field(WindField(self.wind, start.wind_step * self.step_size, self.tick, self._level))
        if self._ring is not None:
            checks.integer("step", start.step, 0, MAX_WIND_TICKS * self.steps_per_tick, SimulationError)
        self._air = self._with_rings(self._field.tick_number(max(1, start.wind_ticks))[np.newaxis], self.step)[0]

    def act(self, event: Event) -> None:
        """Let an event act; one with a state resets.

        Raises
        ------
        SimulationError
            See `reset`, `set_swashplate`, `fail_engine`.
        """
        if event.state is not None and event.swashplate is not None:
            self.reset(event.state, event.swashplate)
        elif event.swashplate is not None:
            self.set_swashplate(event.swashplate)
        if event.wind is not None:
            self.set_wind(event.wind)
        if event.drive:
            self.fail_engine(event.drive, event.failure)

    def checked_state(self, state: ArrayLike) -> Array:
        """Copy of a simulation state that is complete, finite and plausible.

        Its quaternion is normalised, and what the fidelity holds at zero is zero.

        Raises
        ------
        SimulationError
            Naming the state, its value and what is allowed.
        """
        values = checks.array("state", state, SimulationError).ravel()
        if len(values) != self.layout.size:
            raise SimulationError(f"state has {len(values)} values: allowed are {self.layout.size}")
        for name, value, bound in zip(self.layout.names, values, self.bounds[:-1], strict=True):
            if not abs(value) <= bound:  # true for a NaN as well
                raise SimulationError(f"state {name} = {value}: allowed are {-bound:g} to {bound:g}")
        quaternion = values[S.ATTITUDE : S.ATTITUDE + 4]
        norm = length(quaternion)
        if not 0.5 <= norm <= 2.0:
            raise SimulationError(f"state attitude has a norm of {norm:g}: allowed are 0.5 to 2, a unit quaternion")
        if abs(norm - 1.0) > UNIT:  # what has been normalised once stays as it is, bit for bit
            values[S.ATTITUDE : S.ATTITUDE + 4] = quaternion / norm
        values[self._held] = 0.0
        down = np.zeros((1, 1))
        lowest_point(self.ground, self.model.rotors, values[:, np.newaxis], down)
        lowest, ground = -float(down[0, 0]), -self.bounds[-1]
        if lowest <= ground:
            raise SimulationError(
                f"state position: the aircraft reaches down to {lowest:g} m: allowed is above {ground:g} m, the ground"
            )
        return values

    def checked_swashplate(self, angles: ArrayLike) -> Array:
        """Copy of the swashplate angles of all rotors [rad], shape (n_rows, 3), if each is within its range.

        The rows are those of `Aircraft.mix`.

        Raises
        ------
        SimulationError
            Naming rotor, angle, value and range.
        """
        values = checks.array("swashplate", angles, SimulationError)
        rows = self.aircraft.rows
        if values.shape != (len(rows), 3):
            if values.ndim == 2 and values.shape[1] == 3:
                drives = " and drives that controls act on" if self.aircraft.commanded_drives else ""
                allowed = f"{len(rows)}, those of the aircraft{drives}"
                raise SimulationError(f"swashplate has {len(values)} rotors{drives}: allowed are {allowed}")
            raise SimulationError(f"swashplate has shape {values.shape}: allowed is {(len(rows), 3)}")
        for name, value, (low, high), unit in row_problems(rows, values):
            raise SimulationError(f"{name} = {value}: allowed are {low:.6g} to {high:.6g} {unit}".removesuffix(" 1"))
        return values

    def set_swashplate(self, angles: ArrayLike) -> None:
        """Set the swashplate angles from the next tick on; see `checked_swashplate`."""
        self.swashplate = self.checked_swashplate(angles)

    def set_wind(self, wind: Wind) -> None:
        """Set the wind from the next tick on; gust delays count from now."""
        checks.instance("wind", wind, Wind, SimulationError)
        self._wind_step = self.step
        self._set_field(WindField(wind, self.time, self.tick, self._level))
        self._air = self.next_air(self.step)

    def _set_field(self, field: WindField) -> None:
        """Fly through the air of a wind from now on, with the noise of its seed."""
        self._field = field
        if self.model.switches["ring"][0] and (self._ring is None or self._ring.seed != self.wind.turbulence_seed):
            speeds = [rotor.speed for rotor in self.aircraft.rotors]
            self._ring = RingNoise(speeds, self.wind.turbulence_seed, self.tick)
        if "engine" in self.__dict__:  # it has been made
            self.engine.set_space([self.space])

    @property
    def _level(self) -> float:
        """Height of the ground above the origin [m], from which heights count; that of the origin without a ground."""
        return ground_level(self.options["ground_altitude"])

    def reset(self, state: ArrayLike, swashplate: ArrayLike) -> None:
        """Put the aircraft elsewhere; time, azimuths and wind go on."""
        new_state, new_angles = self.checked_state(state), self.checked_swashplate(swashplate)
        self.state, self.swashplate = new_state, new_angles

    def checked_engine(self, drive: int) -> int:
        """Place in the state of what has failed of the engine of a drive, of which the first is 1.

        Raises
        ------
        SimulationError
            There is no such drive, or it has no engine.
        """
        engines = [i + 1 for i, own in enumerate(self.aircraft.drives) if own.engine != "none"]
        if drive not in engines:
            allowed = f"allowed are {', '.join(map(str, engines))}" if engines else "the aircraft has none"
            raise SimulationError(f"engine of drive {checks.shown(drive)}: {allowed}")
        return self.layout.drive(drive - 1)["engine_failure"]

    def fail_engine(self, drive: int = 1, share: float = 1.0) -> None:
        """Let the engine of a drive lose a share of its torque from now on; 0 lets it run again.

        Raises
        ------
        SimulationError
            See `checked_engine`; a share out of range.
        """
        place, share = self.checked_engine(drive), checks.number("share", share, 0.0, 1.0, "", SimulationError)
        state = self.state.copy()
        state[place] = share
        self.state = state

    def advance(self) -> None:
        """Fly one tick.

        Raises
        ------
        SimulationError
            The next step would leave the finite or the plausible: the message names step, time and state. The state
            is that of the last good step.
        """
        engine, failed = self.engine, np.array([FLYING])
        code = engine.code
        code.advance(
            *(
                code.derivative,
                engine.model,
                _single(self.state),
                _single(self.swashplate),
                _single(self.azimuth0),
            ),
            *(self.step, self.steps_per_tick, self.step_size, _single(self._air), self.method, _single(self.bounds)),
            *(engine.work, engine.tick, engine.tick.done, failed),
        )
        self.step += int(engine.tick.done[0])
        if failed[0] != FLYING:
            raise self.failure(int(failed[0]), float(engine.tick.last[min(failed[0], engine.size - 1), 0]))
        self._air = self.next_air(self.step)

    def failure(self, failed: int, value: float) -> SimulationError:
        """Why the flight cannot go on: a state that the next step would take to a value beyond the plausible."""
        if failed == self.layout.size:
            speed = math.sqrt(sum(float(part) ** 2 for part in self.state[S.VELOCITY : S.RATES]))
            return SimulationError(
                f"ground contact after step {self.step} (t = {self.time:.4f} s) at {speed:.3g} m/s:"
                f" the ground is at {self.options['ground_altitude']:g} m"
            )
        return SimulationError(
            f"step {self.step + 1} (t = {(self.step + 1) * self.step_size:.4f} s) would take"
            f" {self.layout.names[failed]} to {value:g}: plausible are magnitudes"
            f" up to {self.bounds[failed]:g}"
        )

    def fly(self, swashplates: Array, ticks: int, every: int = 1, loaded: bool = True) -> Flown:
        """Fly many ticks in one call of compiled code, see `Formation.fly`.

        To the last bit it is what `set_swashplate`, `snapshot` and `advance` give tick by tick.
        """
        return Formation([self]).fly([swashplates], ticks, every, loaded)[0]

    def take_over(self, step: int, state: Array, air: Array, swashplate: Array) -> None:
        """Take over what a flight in a formation has come to, with the air of its next tick."""
        self.step, self.state, self._air, self.swashplate = step, state, air, swashplate

    @property
    def air(self) -> Array:
        """Air of the next tick, a row of `air_ahead`."""
        return self._air

    def next_air(self, step: int) -> Array:
        """Air of the tick after those that were asked for, which begins at a step; the next call may overwrite it."""
        return self._with_rings(self._field.next_tick()[np.newaxis], step)[0]

    def air_ahead(self, ticks: int) -> Array:
        """Air of this tick and of so many that follow, shape (ticks + 1, WIND_SIZE).

        Where the thrust of rotors fluctuates, the noise of every rotor at the beginning of the tick and at its end is
        behind it, shape (ticks + 1, WIND_SIZE + 2 n_rotors).
        """
        following = self._with_rings(self._field.next_ticks(ticks), self.step + self.steps_per_tick)
        return np.concatenate([self._air[np.newaxis], following])

    def _with_rings(self, air: Array, step: int) -> Array:
        """Air of ticks from that of a step on with the noise of vortex rings behind it."""
        if self._ring is None:
            return air
        ends = self._ring.ends(step // self.steps_per_tick, len(air))
        return np.concatenate([air, ends[:-1], ends[1:]], axis=1)

    def ring_noise(self, steps: NDArray[np.int64]) -> Array | None:
        """Noise of vortex rings at the beginnings of ticks, shape (n, n_rotors); None where no thrust fluctuates."""
        if self._ring is None or not len(steps):
            return None
        ticks = steps // self.steps_per_tick
        return self._ring.ends(int(ticks[0]), int(ticks[-1] - ticks[0]))[ticks - ticks[0]]

    def air_at(self, steps: NDArray[np.int64], air: Array) -> Array:
        """Velocity of the air at the beginnings of ticks, NED [m/s], shape (n, 3), but for what depends on a place."""
        velocities = np.zeros((len(steps), 3, 1))
        times = np.multiply(steps, self.step_size, dtype=float)
        winds_at(np.ascontiguousarray(air)[..., np.newaxis], times, self.model.rotors, velocities)
        return velocities[..., 0]

    def azimuths(self, steps: NDArray[np.int64]) -> Array:
        """Azimuth of every rotor at steps, shape (n, n_rotors) [rad], 0 to 2 pi."""
        angles = np.empty((len(steps), len(self.azimuth0), 1))
        times = np.multiply(steps, self.step_size, dtype=float)
        azimuths_at(self.model.rotors, _single(self.azimuth0), times, angles)
        return angles[..., 0]

    def motion(self) -> Motion:
        """What sensors on board see of the present instant: less than a snapshot, for a third of its time."""
        return self._evaluated()[1]

    def snapshot(self) -> Snapshot:
        """The present instant, with loads and accelerations under the swashplate angles now in force."""
        azimuth, now = self._evaluated()
        engine = self.engine
        working = engine.memory(engine.rotors, WORKING_SIZE)
        engine.code.working_state(engine.model, engine.work, working)
        contact = ground_forces(self.model, self.state[np.newaxis])
        down = down_of(self.state[np.newaxis, S.ATTITUDE : S.VELOCITY])[0]
        return Snapshot(
            step=self.step,
            time=self.time,
            state=now.state,
            acceleration=now.specific_force + down * self.aircraft.environment.gravity,
            swashplate=self.swashplate.copy(),
            azimuth=self.aircraft.turned(azimuth, self.state),
            loads=engine.work.load_rows.reshape(engine.rotors, -1).copy(),
            wind=now.wind,
            working=working[..., 0],
            contact=None if contact is None else contact[0],
            derivative=now.derivative,
        )

    def _evaluated(self) -> tuple[Array, Motion]:
        """Azimuths of the rotors against their drives, and the instant; the rest is left in the engine's memory."""
        engine, now = self.engine, np.array([self.step])
        azimuth, air = self.azimuths(now)[0], engine.tick.wind  # a step writes there too
        air[:3, 0] = self.air_at(now, self._air[np.newaxis])[0]
        if self.space is not None:
            wind = _single(self._air)
            air_in_space(
                *(engine.model, _single(self.state), _single(azimuth), wind, self.time, engine.tick.space, air)
            )
        noise = self.ring_noise(now)
        if noise is not None:
            engine.work.ring[NOISE] = noise.T
        engine.code.derivative(
            *(engine.model, _single(self.state), _single(self.swashplate), _single(azimuth), air),
            *(engine.work, engine.tick.slopes[0], True),
        )
        return azimuth, Motion(
            state=self.state.copy(),
            specific_force=engine.work.acceleration_rows[:3, 0].copy(),
            wind=air[:3, 0].copy(),
            derivative=engine.tick.slopes[0, : self.layout.size, 0].copy(),
        )


def ground_of(aircraft: Aircraft, ground_altitude: float | None) -> float:
    """Height of the ground above the origin [m]: what is given, or that of the aircraft file; -inf is none.

    Raises
    ------
    SimulationError
        It is out of range.
    """
    if ground_altitude is None:
        ground_altitude = -math.inf if aircraft.ground.altitude is None else aircraft.ground.altitude
    return checks.number("ground_altitude", ground_altitude, -math.inf, PLAUSIBLE_POSITION, "m", SimulationError)


def ground_level(ground_altitude: float) -> float:
    """Height above the origin from which heights count [m]: that of the ground, 0 where there is none."""
    return ground_altitude if math.isfinite(ground_altitude) else 0.0


def chosen_method(aircraft: Aircraft, method: str) -> str:
    """Method of integration, the default of an aircraft for "auto".

    Raises
    ------
    SimulationError
        There is none of this name, or not for rotors whose speed is a state.
    """
    checks.choice("method", method, (AUTO, *METHODS), SimulationError)
    if method == AUTO:
        return FREE_METHOD if aircraft.drives else METHOD
    if aircraft.drives:
        checks.choice("method of an aircraft with drives", method, FREE_METHODS, SimulationError)
    return method


def _single(values: Array) -> Array:
    """Numbers of a flight as the only lane: the same memory."""
    return values.reshape(-1, 1)


def plausible_bounds(aircraft: Aircraft) -> Array:
    """Largest plausible magnitude of every state, shape (size,)."""
    layout = aircraft.layout
    bounds = np.full(layout.size, PLAUSIBLE_INFLOW)
    bounds[: S.ATTITUDE] = PLAUSIBLE_POSITION
    bounds[S.ATTITUDE : S.VELOCITY] = 2.0
    bounds[S.VELOCITY : S.RATES] = PLAUSIBLE_VELOCITY
    bounds[S.RATES : S.BODY_SIZE] = PLAUSIBLE_RATE
    for j, rotor in enumerate(aircraft.rotors):
        bounds[layout.flap(j)] = bounds[layout.lag(j)] = PLAUSIBLE_ANGLE
        bounds[layout.flap_rate(j)] = bounds[layout.lag_rate(j)] = PLAUSIBLE_ANGLE * 10 * rotor.speed
        bounds[layout.wake(j)] = PLAUSIBLE_SHARE
    bounds[layout.section("attached_share")] = PLAUSIBLE_SHARE
    bounds[layout.section("pressure_lift").start :] = PLAUSIBLE_LIFT
    for i in range(len(layout.drives)):
        speed, places = aircraft.drive_speed(i), layout.drive(i)
        bounds[list(places.values())] = 1e9
        bounds[places[S.SPEED]] = PLAUSIBLE_SPEED * speed
        bounds[places["azimuth"]] = PLAUSIBLE_TURNS
        bounds[places["discharge"]], bounds[places["engine_failure"]] = 2.0, 1.0
    return bounds


def held_states(aircraft: Aircraft, lead_lag: bool, cyclic_inflow: bool) -> NDArray[np.int64]:
    """Indices of the states that stay zero without lag or without cyclic inflow."""
    layout = aircraft.layout
    index = np.arange(layout.size)
    held: list[int] = []
    for j in range(len(aircraft.rotors)):
        if not lead_lag:
            held += [*index[layout.lag(j)], *index[layout.lag_rate(j)]]
        if not cyclic_inflow:
            held += [*index[layout.inflow(j)][1:]]
    return np.array(held, dtype=np.int64)
