"""Flight in time: a stateful `Simulation` that advances tick by tick, and `simulate` for whole flights.

A tick is the period at which states are handed out and commands taken in; it holds a whole number of integration
steps. Steps are counted in integers from the start, and time is step x dt, so that the same commands at the same steps
give the same flight to the last bit.
"""

from __future__ import annotations  # `help` then shows types by their names

import collections
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sbs_sim import checks, interruption
from sbs_sim.aircraft import Aircraft
from sbs_sim.analysis.trim import TrimPoint
from sbs_sim.content import ByContent
from sbs_sim.errors import SimulationError
from sbs_sim.mixer import ROUNDING, Mixer, check_controls, check_ranges
from sbs_sim.model import params as P
from sbs_sim.model import state as S
from sbs_sim.model.dynamics import derivative
from sbs_sim.model.fly import fly
from sbs_sim.model.frames import euler_angles, euler_to_quaternion, rotation_matrix, to_body
from sbs_sim.model.ground import lowest_point
from sbs_sim.model.integrate import PARTITIONED, RK4, TSIT5, advance
from sbs_sim.model.kernel import address
from sbs_sim.model.multiblade import blade_matrix
from sbs_sim.model.wind import Wind, WindField, wind_at
from sbs_sim.model.working_state import WORKING_SIZE, working_state
from sbs_sim.validity import flight_warnings

Array = NDArray[np.float64]
Commands = ArrayLike | Callable[[float], ArrayLike]
Command = Callable[[int, float], Array]  # of a tick, and its time [s]

UNIT = 1e-9  # a quaternion whose norm is this near to one is a unit quaternion
METHODS = {"rk4": RK4, "tsit5": TSIT5, "partitioned": PARTITIONED}
TICKS = (1e-4, 1.0)  # s, shortest and longest
AZIMUTH_STEPS = (math.radians(0.01), math.radians(45.0))  # rad

# A tick is one uninterrupted call of compiled code; this many steps take it a tenth of a second.
MOST_STEPS_PER_TICK = 10_000
MOST_WIND_TICKS = 1_000_000_000  # that turbulence is brought forward by for a log that begins in mid-flight: minutes
# Ticks that whole flights take in one call, and elements of blades in all steps of these: a tenth of a second, in which
# no interruption is heard.
BLOCK, BLOCK_ELEMENTS = 1000, 3_500_000
WATCH_PERIOD = 0.1  # s of flight between looks whether the model holds

# Beyond these magnitudes a state is not plausible and the simulation stops. The angles and the inflow are far outside
# the validity of the model; the velocity is beyond the speed of sound.
PLAUSIBLE_POSITION = 1e8  # m
PLAUSIBLE_VELOCITY = 350.0  # m/s
PLAUSIBLE_RATE = 100.0  # rad/s
PLAUSIBLE_ANGLE = 1.5  # rad, multiblade coordinates of flap and lag
PLAUSIBLE_INFLOW = 1.0


@dataclass(frozen=True, eq=False)
class Snapshot(ByContent):
    """Everything that can be told of one instant.

    Attributes
    ----------
    step : int
        Number of the integration step.
    time : float
        Simulation time [s].
    state : ndarray, shape (size,)
        Simulation state, see `sbs_sim.model.state`.
    acceleration : ndarray, shape (3,)
        Inertial acceleration of the c.g. in body axes [m/s^2].
    swashplate : ndarray, shape (n_rotors, 3)
        Angles in force [rad].
    azimuth : ndarray, shape (n_rotors,)
        [rad], 0 to 2 pi.
    loads : ndarray, shape (n_rotors, LOAD_SIZE)
        Thrust, torque, hub force and moment, see `sbs_sim.model.params`.
    wind : ndarray, shape (3,)
        Velocity of the air, NED [m/s].
    working : ndarray, shape (n_rotors, WORKING_SIZE), or None
        Working states of the rotors, see `sbs_sim.model.working_state`; None where nobody knows them.
    """

    step: int
    time: float
    state: Array
    acceleration: Array
    swashplate: Array
    azimuth: Array
    loads: Array
    wind: Array
    working: Array | None = None


@dataclass(frozen=True, eq=False)
class Rows(ByContent):
    """Instants of a flight one below the other: what `Snapshot` tells, with one more axis in front of each.

    Attributes
    ----------
    step, time, state, acceleration, swashplate, azimuth, loads, wind : ndarray
        See `Snapshot`; acceleration and loads are zero where they were not asked for.
    """

    step: NDArray[np.int64]
    time: Array
    state: Array
    acceleration: Array
    swashplate: Array
    azimuth: Array
    loads: Array
    wind: Array

    def first(self, count: int) -> Rows:
        """The first instants."""
        return Rows(*(getattr(self, part.name)[:count] for part in fields(self)))


@dataclass(frozen=True, eq=False)
class Event(ByContent):
    """Something that acts on a flight between two ticks: all events together repeat it bit for bit, see `refly`.

    Attributes
    ----------
    step : int
        Integration steps before it.
    kind : str
        "start" (state, swashplate, wind), "swashplate", "reset" (state, swashplate) or "wind".
    swashplate : ndarray, shape (n_rotors, 3), or None
        [rad]
    state : ndarray, shape (size,), or None
    wind : Wind or None
    wind_step : int
        Of a start: integration steps before its wind was set, which is earlier than the start where a log begins in
        mid-flight.
    wind_ticks : int
        Of a start: ticks of its wind that have begun; 0 for one that is new.
    """

    step: int
    kind: str
    swashplate: Array | None = None
    state: Array | None = None
    wind: Wind | None = None
    wind_step: int = 0
    wind_ticks: int = 0


class Simulation:
    """An aircraft in flight.

    Parameters
    ----------
    aircraft : Aircraft
    state : ndarray, shape (size,)
        Simulation state at the start.
    swashplate : ndarray, shape (n_rotors, 3)
        Angles until others are set [rad].
    tick : float
        Length of a tick [s], 1e-4 to 1.
    azimuth_step : float
        Largest step of the fastest rotor's azimuth [rad]; the step is the tick divided by the smallest whole number
        that keeps to it.
    lead_lag, cyclic_inflow : bool
        Fidelity.
    method : str
        "rk4"; "tsit5", of fifth order, whose steps may be three times as long; or "partitioned": the paper's scheme,
        whose error is of first order in the step.
    wind : Wind
    ground_altitude : float
        Height of level ground above the origin [m]; touching it ends the flight. -inf is no ground.

    Raises
    ------
    SimulationError
        A value out of range or a state that is not plausible, naming it.
    """

    def __init__(
        self,
        aircraft: Aircraft,
        state: ArrayLike,
        swashplate: ArrayLike,
        *,
        tick: float = 0.01,
        azimuth_step: float = math.radians(5.0),
        lead_lag: bool = True,
        cyclic_inflow: bool = True,
        method: str = "rk4",
        wind: Wind | None = None,
        ground_altitude: float = -math.inf,
    ) -> None:
        checks.instance("aircraft", aircraft, Aircraft, SimulationError)
        tick = checks.number("tick", tick, *TICKS, "s", SimulationError)
        azimuth_step = checks.number("azimuth_step", azimuth_step, *AZIMUTH_STEPS, "rad", SimulationError)
        lead_lag = checks.flag("lead_lag", lead_lag, SimulationError)
        cyclic_inflow = checks.flag("cyclic_inflow", cyclic_inflow, SimulationError)
        checks.choice("method", method, tuple(METHODS), SimulationError)
        ground = checks.number("ground_altitude", ground_altitude, -math.inf, PLAUSIBLE_POSITION, "m", SimulationError)
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
        self.steps_per_tick = max(1, math.ceil(fastest * tick / azimuth_step * (1 - 1e-12)))
        if self.steps_per_tick > MOST_STEPS_PER_TICK:
            raise SimulationError(
                f"azimuth_step = {math.degrees(azimuth_step):g} deg takes {self.steps_per_tick} steps in a tick of"
                f" {tick:g} s: allowed are up to {MOST_STEPS_PER_TICK}"
            )
        self.step_size = tick / self.steps_per_tick
        self._method = METHODS[method]
        self._held = held_states(aircraft, lead_lag, cyclic_inflow)
        self._params = aircraft.params(lead_lag, cyclic_inflow)
        self._work = P.make_work(self._params)
        self._bounds = np.append(plausible_bounds(aircraft), -ground)
        self._stall = aircraft.stall_table
        self._watch = max(1, round(WATCH_PERIOD / tick))
        self._azimuth0 = np.zeros(len(aircraft.rotors))
        self._slope = np.zeros(self.layout.size)
        self.step = 0
        self.set_wind(Wind() if wind is None else wind)
        self.state = self.checked_state(state)
        self.swashplate = self.checked_swashplate(swashplate)

    @property
    def time(self) -> float:
        """Simulation time [s]."""
        return self.step * self.step_size

    @property
    def wind(self) -> Wind:
        """The wind in force."""
        return self._field.wind

    def beginning(self) -> Event:
        """The present as the start of a flight."""
        swashplate, state = self.swashplate.copy(), self.state.copy()
        return Event(self.step, "start", swashplate, state, self.wind, self._wind_step, self._field.ticks)

    def go_on_from(self, start: Event) -> None:
        """Take step, and with it time and azimuths, and the age of the wind from the start of a log.

        Raises
        ------
        SimulationError
            The start is before its wind, or long after it.
        """
        checks.whole("wind_step", start.wind_step, 0, start.step, SimulationError)
        checks.whole("wind_ticks", start.wind_ticks, 0, MOST_WIND_TICKS, SimulationError)
        self.step, self._wind_step = start.step, start.wind_step
        self._field = WindField(self.wind, start.wind_step * self.step_size, self.tick)
        self._air = self._field.tick_number(max(1, start.wind_ticks))

    def act(self, event: Event) -> None:
        """Let an event act; one with a state resets.

        Raises
        ------
        SimulationError
            See `reset`, `set_swashplate`.
        """
        if event.state is not None and event.swashplate is not None:
            self.reset(event.state, event.swashplate)
        elif event.swashplate is not None:
            self.set_swashplate(event.swashplate)
        if event.wind is not None:
            self.set_wind(event.wind)

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
        for name, value, bound in zip(self.layout.names, values, self._bounds[:-1], strict=True):
            if not abs(value) <= bound:  # true for a NaN as well
                raise SimulationError(f"state {name} = {value}: allowed are {-bound:g} to {bound:g}")
        quaternion = values[S.ATTITUDE : S.ATTITUDE + 4]
        norm = np.linalg.norm(quaternion)
        if not 0.5 <= norm <= 2.0:
            raise SimulationError(f"state attitude has a norm of {norm:g}: allowed are 0.5 to 2, a unit quaternion")
        if abs(norm - 1.0) > UNIT:  # what has been normalised once stays as it is, bit for bit
            values[S.ATTITUDE : S.ATTITUDE + 4] = quaternion / norm
        values[self._held] = 0.0
        lowest, ground = -lowest_point(self._params, values), -self._bounds[-1]
        if lowest <= ground:
            raise SimulationError(
                f"state position: the aircraft reaches down to {lowest:g} m: allowed is above {ground:g} m, the ground"
            )
        return values

    def checked_swashplate(self, angles: ArrayLike) -> Array:
        """Copy of the swashplate angles of all rotors [rad], shape (n_rotors, 3), if each is within its range.

        Raises
        ------
        SimulationError
            Naming rotor, angle, value and range.
        """
        values = checks.array("swashplate", angles, SimulationError)
        rotors = self.aircraft.rotors
        if values.shape != (len(rotors), 3):
            if values.ndim == 2 and values.shape[1] == 3:
                allowed = f"{len(rotors)}, those of the aircraft"
                raise SimulationError(f"swashplate has {len(values)} rotors: allowed are {allowed}")
            raise SimulationError(f"swashplate has shape {values.shape}: allowed is {(len(rotors), 3)}")
        for rotor, row in zip(rotors, values, strict=True):
            ranges = (rotor.collective_range, rotor.cyclic_range, rotor.cyclic_range)
            for name, value, (low, high) in zip(S.SWASHPLATE_NAMES, row, ranges, strict=True):
                if not low - 1e-12 <= value <= high + 1e-12:
                    raise SimulationError(f"{rotor.name} {name} = {value}: allowed are {low:.6g} to {high:.6g} rad")
        return values

    def set_swashplate(self, angles: ArrayLike) -> None:
        """Set the swashplate angles from the next tick on; see `checked_swashplate`."""
        self.swashplate = self.checked_swashplate(angles)

    def set_wind(self, wind: Wind) -> None:
        """Set the wind from the next tick on; gust delays count from now."""
        checks.instance("wind", wind, Wind, SimulationError)
        self._wind_step = self.step
        self._field = WindField(wind, self.time, self.tick)
        self._air = self._field.next_tick()

    def reset(self, state: ArrayLike, swashplate: ArrayLike) -> None:
        """Put the aircraft elsewhere; time, azimuths and wind go on."""
        new_state, new_angles = self.checked_state(state), self.checked_swashplate(swashplate)
        self.state, self.swashplate = new_state, new_angles

    def advance(self) -> None:
        """Fly one tick.

        Raises
        ------
        SimulationError
            The next step would leave the finite or the plausible: the message names step, time and state. The state
            is that of the last good step.
        """
        done, culprit = advance(
            self._params,
            self.state,
            self.swashplate,
            self._azimuth0,
            self.step,
            self.steps_per_tick,
            self.step_size,
            self._air,
            self._method,
            self._bounds,
            self._work,
        )
        self.step += done
        if culprit >= 0:
            raise self._end(culprit)
        self._air = self._field.next_tick()

    def _end(self, culprit: int) -> SimulationError:
        """Why the flight cannot go on: a state that the next step would take beyond the plausible."""
        if culprit == self.layout.size:
            speed = float(np.linalg.norm(self.state[S.VELOCITY : S.RATES]))
            return SimulationError(
                f"ground contact after step {self.step} (t = {self.time:.4f} s) at {speed:.3g} m/s:"
                f" the ground is at {-self._bounds[-1]:g} m"
            )
        value = self._work.stages[0][culprit]
        return SimulationError(
            f"step {self.step + 1} (t = {(self.step + 1) * self.step_size:.4f} s) would take"
            f" {self.layout.names[culprit]} to {value:g}: plausible are magnitudes"
            f" up to {self._bounds[culprit]:g}"
        )

    def fly(
        self, swashplates: Array, ticks: int, every: int = 1, loaded: bool = True
    ) -> tuple[Rows, Array, SimulationError | None]:
        """Fly many ticks in one call of compiled code, during which other threads go on.

        To the last bit it is what `set_swashplate`, `snapshot` and `advance` give tick by tick.

        Parameters
        ----------
        swashplates : ndarray, shape (ticks, n_rotors, 3) or (ticks + 1, n_rotors, 3)
            Angles of each tick [rad], see `checked_swashplate`. One more is in force at the end of the flight, which
            then is told of as well.
        ticks : int
        every : int
            Ticks from one row of the result to the next, counted from the start of the flight.
        loaded : bool
            False leaves accelerations and loads out.

        Returns
        -------
        rows : Rows
        working : ndarray, shape (n, n_rotors, WORKING_SIZE)
            Working states of the rotors, see `Snapshot`, once every tenth of a second.
        fault : SimulationError or None
            Why the flight ended before its last tick, see `advance`; it cannot go on then.
        """
        air = np.concatenate([self._air[np.newaxis], self._field.next_ticks(ticks)])
        begin = self.step // self.steps_per_tick
        told, watched = (np.arange(-(-begin // n) * n - begin, len(swashplates), n) for n in (every, self._watch))
        rows = self._rows((begin + told) * self.steps_per_tick, swashplates[told], air[told], loaded)
        x, first, options = self.state, swashplates[0], (self._method, self._bounds, self._work)
        start = (self._azimuth0, self.step, self.steps_per_tick, self.step_size)
        row = np.zeros((len(self._azimuth0), WORKING_SIZE))
        working = np.zeros((len(watched), *row.shape))
        machine_code = (
            address(advance, self._params, x, first, *start, air[0], *options),
            address(derivative, self._params, x, first, self._azimuth0, self._slope[:3], self._work, self._slope),
            address(working_state, self._params, x, self._stall, self._work, row),
        )
        offset, look = (int(places[0]) if len(places) else len(swashplates) for places in (told, watched))
        outputs = (rows.azimuth, rows.wind, rows.state, rows.acceleration, rows.loads, self._slope)
        steps = (begin + watched) * self.steps_per_tick
        looks = (
            self._stall,
            look,
            self._watch,
            self._azimuths(steps[:, np.newaxis]),
            self._air_at(steps, air[watched]),
        )
        self.step, culprit = fly(
            *(*machine_code, self._params, x, *start, *options),
            *(swashplates, air, ticks, offset, every, loaded, *outputs, *looks, working),
        )
        working = working[steps <= self.step]
        self._air, self.swashplate = air[ticks], swashplates[-1].copy()
        rows = rows.first(int(np.count_nonzero(rows.step <= self.step)))
        if loaded:
            for state, acceleration in zip(rows.state, rows.acceleration, strict=True):
                acceleration += self._gravity(state)
        return rows, working, self._end(culprit) if culprit >= 0 else None

    def _rows(self, steps: NDArray[np.int64], swashplates: Array, air: Array, loaded: bool) -> Rows:
        """Rows of which the flight fills in state, force and loads."""
        count, rotors = len(steps), len(self._azimuth0)
        return Rows(
            step=steps,
            time=np.multiply(steps, self.step_size, dtype=float),
            state=np.zeros((count, self.layout.size)),
            acceleration=np.zeros((count, 3)),
            swashplate=swashplates,
            azimuth=np.array([self._azimuths(step) for step in steps]).reshape(count, rotors),
            loads=np.zeros((count, rotors, P.LOAD_SIZE)),
            wind=self._air_at(steps, air) if loaded else np.zeros((count, 3)),
        )

    def _air_at(self, steps: NDArray[np.int64], air: Array) -> Array:
        """Velocity of the air at the beginnings of ticks, NED [m/s], shape (n, 3)."""
        velocities = np.zeros((len(steps), 3))
        for row, step, velocity in zip(air, steps, velocities, strict=True):
            wind_at(row, step * self.step_size, 0.0, velocity)
        return velocities

    def _gravity(self, state: Array) -> Array:
        """Gravity in body axes [m/s^2], shape (3,)."""
        down: Array = rotation_matrix(state[S.ATTITUDE : S.ATTITUDE + 4])[2]
        return down * self._params.air[P.GRAVITY]

    def _azimuths(self, step: int | NDArray[np.int64]) -> Array:
        """Azimuth of every rotor at a step, shape (n_rotors,) [rad], 0 to 2 pi; of steps (n, 1) shape (n, n_rotors)."""
        turned: Array = self._azimuth0 + self._params.rotor[:, P.SPEED] * self.step_size * step
        return turned % (2 * math.pi)

    def snapshot(self) -> Snapshot:
        """The present instant, with loads and accelerations under the swashplate angles now in force."""
        azimuth = self._azimuths(self.step)
        air = np.zeros(3)
        wind_at(self._air, self.time, 0.0, air)
        derivative(self._params, self.state, self.swashplate, azimuth, air, self._work, self._slope)
        return Snapshot(
            step=self.step,
            time=self.time,
            state=self.state.copy(),
            acceleration=self._work.vector[:3] + self._gravity(self.state),
            swashplate=self.swashplate.copy(),
            azimuth=azimuth,
            loads=self._work.loads.copy(),
            wind=air,
            working=self._working(),
        )

    def _working(self) -> Array:
        """Working states at the instant of the last derivative."""
        rows = np.empty((len(self._azimuth0), WORKING_SIZE))
        working_state(self._params, self.state, self._stall, self._work, rows)
        return rows


def begun(aircraft: Aircraft, events: Sequence[Event], **options: Any) -> Simulation:
    """Simulation at the start of a flight, also of one that had flown before its log began.

    Parameters
    ----------
    aircraft : Aircraft
    events : sequence of Event
        The first is the start.
    **options :
        Those of `Simulation` but for the wind.

    Raises
    ------
    SimulationError
        The events do not begin with a start, or one that is not possible.
    """
    start = events[0] if events else None
    if start is None or start.kind != "start" or start.state is None or start.swashplate is None:
        raise SimulationError("events: the first must be the start of the flight")
    simulation = Simulation(aircraft, start.state, start.swashplate, wind=start.wind, **options)
    simulation.go_on_from(start)
    return simulation


def refly(aircraft: Aircraft, events: Sequence[Event], last_step: int, **options: Any) -> Iterator[Snapshot]:
    """Fly a flight again from the events of the first one.

    Parameters
    ----------
    aircraft : Aircraft
    events : sequence of Event
        In the order in which they acted; the first is the start.
    last_step : int
        Where to end.
    **options :
        Those of `Simulation` but for the wind.

    Yields
    ------
    Snapshot
        At the start, after every tick and after every reset.

    Raises
    ------
    SimulationError
        The events do not begin with a start, or the flight cannot go on and no reset follows.
    """
    simulation, waiting = begun(aircraft, events, **options), collections.deque(events[1:])
    yield simulation.snapshot()
    fault: SimulationError | None = None
    while simulation.step < last_step or (waiting and waiting[0].step <= simulation.step):
        while waiting and waiting[0].step <= simulation.step:
            event = waiting.popleft()
            simulation.act(event)
            if event.kind == "reset":
                fault = None
                yield simulation.snapshot()
        if fault is not None:
            raise fault
        if simulation.step >= last_step:
            return
        try:
            simulation.advance()
        except SimulationError as error:
            fault = error
        yield simulation.snapshot()


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
    return bounds


def held_states(aircraft: Aircraft, lead_lag: bool, cyclic_inflow: bool) -> NDArray[np.int64]:
    """Places of the states that stay zero without lag or without cyclic inflow."""
    layout = aircraft.layout
    index = np.arange(layout.size)
    held: list[int] = []
    for j in range(len(aircraft.rotors)):
        if not lead_lag:
            held += [*index[layout.lag(j)], *index[layout.lag_rate(j)]]
        if not cyclic_inflow:
            held += [*index[layout.inflow(j)][1:]]
    return np.array(held, dtype=np.int64)


def trimmed_state(
    aircraft: Aircraft,
    point: TrimPoint,
    position: ArrayLike = (0.0, 0.0, 0.0),
    heading: float = 0.0,
    wind: ArrayLike = (0.0, 0.0, 0.0),
) -> Array:
    """Simulation state of a trim point.

    Parameters
    ----------
    aircraft : Aircraft
    point : TrimPoint
    position : array_like, shape (3,)
        NED [m].
    heading : float
        From north to east [rad].
    wind : array_like, shape (3,)
        Steady wind, NED [m/s]; the aircraft is trimmed relative to the air and drifts with it.

    Returns
    -------
    ndarray, shape (size,)

    Raises
    ------
    SimulationError
        A trim of an aircraft with other rotors; a heading that is not finite or far from a turn. Position and velocity
        are checked by `Simulation`.
    """
    if point.state_names != aircraft.layout.linear_names:
        own = ", ".join(str(rotor.blades) for rotor in aircraft.rotors)
        raise SimulationError(
            f"start: a trim with {len(point.state_names)} states: allowed is one of an aircraft with {own} blades, with"
            f" {aircraft.layout.linear_size}"
        )
    heading = checks.number("heading", heading, -4 * math.pi, 4 * math.pi, "rad", SimulationError)
    state = aircraft.layout.from_linear(point.state, heading)
    state[: S.ATTITUDE] = position
    to_earth = rotation_matrix(euler_to_quaternion(heading, point.pitch, point.roll))
    state[S.VELOCITY : S.RATES] += to_earth.T @ np.asarray(wind, dtype=float)
    return state


def blade_angles(aircraft: Aircraft, snapshot: Snapshot) -> list[tuple[Array, Array]]:
    """Flap and lag angle of every blade [rad] as one pair of arrays, each shape (blades,), per rotor."""
    layout = aircraft.layout
    pairs = []
    for j, rotor in enumerate(aircraft.rotors):
        matrix = blade_matrix(rotor.blades, snapshot.azimuth[j])
        pairs.append((matrix @ snapshot.state[layout.flap(j)], matrix @ snapshot.state[layout.lag(j)]))
    return pairs


class History(dict[str, Array]):
    """Histories of a flight by name, see `simulate`.

    Attributes
    ----------
    warnings : tuple of str
        Where the model does not hold, and what the aircraft's actuators would not do, a line each; as `status` has
        them of a live flight. Looked for ten times a second.
    """

    def __init__(self, histories: Mapping[str, Array], warnings: Iterable[str] = ()) -> None:
        super().__init__(histories)
        self.warnings = tuple(warnings)

    def __missing__(self, name: str) -> Array:
        raise KeyError(f"no {name!r}: there are {', '.join(self)}")

    def __repr__(self) -> str:
        time = self["time"]
        told = f", {len(self.warnings)} warnings" if self.warnings else ""
        return f"<flight of {time[-1] - time[0]:g} s, {len(time)} rows of {', '.join(self)}{told}>"


def simulate(
    aircraft: Aircraft,
    start: TrimPoint | ArrayLike,
    controls: Commands,
    duration: float,
    *,
    tick: float = 0.01,
    azimuth_step: float = math.radians(5.0),
    lead_lag: bool = True,
    cyclic_inflow: bool = True,
    method: str = "rk4",
    wind: Wind | None = None,
    ground_altitude: float = -math.inf,
    actuators: bool = False,
) -> History:
    """Fly for a while and return what happened.

    Parameters
    ----------
    aircraft : Aircraft
    start : TrimPoint or ndarray, shape (size,)
        A trim point, flown from the origin heading north, or a simulation state.
    controls : array_like or callable
        Pilot controls [rad]: shape (4,) for the whole flight, shape (n, 4) one row per tick (the last is held), or a
        function of time [s] that gives shape (4,).
    duration : float
        [s], rounded to whole ticks.
    tick, azimuth_step, lead_lag, cyclic_inflow, method, wind, ground_altitude
        See `Simulation`. A trim point is flown with the velocity of the steady wind added.
    actuators : bool
        False: controls must be within their ranges, and the swashplates follow them at once, as linear models have it;
        steps that their actuators would not follow are told in `warnings`. True: the mixer of the live flight is
        between them. It clips controls and angles to their ranges, which is told, and moves the swashplates at the
        rates of their actuators.

    Returns
    -------
    History
        Mapping of names to arrays, over the n instants between and at the ends of n - 1 ticks: "time" (n,) [s],
        "controls" (n, 4), "swashplate" (n, n_rotors, 3) [rad], "acceleration" (n, 3) [m/s^2], "thrust" [N], "torque"
        [N m], "power" [W] (n, n_rotors), "state" (n, size) and every name of the simulation state (n,), "phi", "theta",
        "psi" (n,) [rad], roll, pitch and heading, and "V" (n,), the speed relative to the air [m/s]. `warnings` tells
        where the model does not hold.

    Raises
    ------
    SimulationError
        See `Simulation`; controls beyond their ranges, naming control, time, value and range, or more rows of them than
        ticks; the flight cannot go on.
    """
    flown, fault = fly_commands(
        aircraft,
        start,
        controls,
        duration,
        wind=wind,
        actuators=actuators,
        tick=tick,
        azimuth_step=azimuth_step,
        lead_lag=lead_lag,
        cyclic_inflow=cyclic_inflow,
        method=method,
        ground_altitude=ground_altitude,
    )
    if fault is not None:
        raise fault
    return flown


def fly_commands(
    aircraft: Aircraft,
    start: TrimPoint | ArrayLike,
    controls: Commands,
    duration: float,
    *,
    every: int = 1,
    loaded: bool = True,
    wind: Wind | None = None,
    actuators: bool = False,
    **options: Any,
) -> tuple[History, SimulationError | None]:
    """Fly as `simulate` does, as far as it goes.

    Parameters
    ----------
    aircraft, start, controls, duration, wind, actuators
        See `simulate`.
    every : int
        Ticks from one row of the histories to the next.
    loaded : bool
        False leaves "acceleration", "thrust", "torque", "power" and "V" out.
    **options :
        The others of `Simulation`.

    Returns
    -------
    histories : History
        See `simulate`; up to the last good tick.
    fault : SimulationError or None
        Why the flight ended early.

    Raises
    ------
    SimulationError
        The flight cannot begin.
    """
    checks.instance("aircraft", aircraft, Aircraft, SimulationError)
    duration = checks.number("duration", duration, 0.0, 1e6, "s", SimulationError)
    actuators = checks.flag("actuators", actuators, SimulationError)
    air = Wind() if wind is None else wind
    checks.instance("wind", air, Wind, SimulationError)
    state = trimmed_state(aircraft, start, wind=air.velocity) if isinstance(start, TrimPoint) else start
    stand = start.swashplate if isinstance(start, TrimPoint) else None
    command = _command(controls)
    pilot = (_Mixed if actuators else _Direct)(aircraft, command, stand)
    simulation = Simulation(aircraft, state, pilot.angles(command(0, 0.0), 0.0), wind=air, **options)
    ticks = round(duration / simulation.tick)
    _check_rows(controls, ticks, simulation.tick)
    blocks: list[tuple[Rows, Array]] = []
    looks: list[Array] = []
    fault: SimulationError | None = None
    size = _block(simulation)
    for begin in range(0, ticks + 1, size):
        interruption.look()
        end = min(begin + size, ticks + 1)
        given, angles, wrong = _angles(simulation, pilot, begin, end)
        if len(angles):
            rows, working, fault = simulation.fly(angles, min(len(angles), ticks - begin), every, loaded)
            blocks.append((rows, given[rows.step // simulation.steps_per_tick - begin]))
            looks.append(working)
        fault = fault or wrong
        if fault is not None:
            break
    if not blocks and fault is not None:
        raise fault
    told = (*flight_warnings(aircraft, np.concatenate(looks)), *pilot.told(simulation.tick))
    return History(_histories(aircraft, blocks, loaded), told), fault


def _block(simulation: Simulation) -> int:
    """Ticks of a call that takes no longer than an interruption may wait."""
    elements = simulation.aircraft.layout.blade_count * simulation.aircraft.options.elements
    return max(1, min(BLOCK, BLOCK_ELEMENTS // (simulation.steps_per_tick * elements)))


class _Direct:
    """Swashplates that follow the controls at once.

    Parameters
    ----------
    aircraft : Aircraft
    command : callable
        Controls of tick i at a time.
    stand : ndarray, shape (n_rotors, 3), or None
        Where the swashplates stand before; None where nobody knows.
    """

    def __init__(self, aircraft: Aircraft, command: Command, stand: Array | None) -> None:
        self.command, self._aircraft = command, aircraft
        self._before, self._largest = stand, np.zeros((len(aircraft.rotors), len(S.SWASHPLATE_NAMES)))
        self._given, self._angles = b"", np.empty(0)

    def angles(self, controls: Array, time: float) -> Array:
        """Swashplate angles [rad] that controls [rad] give at a time [s], shape (n_rotors, 3)."""
        if controls.tobytes() == self._given:
            return self._angles
        check_ranges(self._aircraft, controls, f"controls at {time:g} s: ")
        angles = self._aircraft.mix(controls)
        if self._before is not None:
            self._largest = np.maximum(self._largest, np.abs(angles - self._before))
        self._given, self._angles, self._before = controls.tobytes(), angles, angles
        return angles

    def told(self, tick: float) -> Iterator[str]:
        """What the actuators would not have done, with ticks of this length [s]."""
        for rotor, row in zip(self._aircraft.rotors, self._largest, strict=True):
            for name, step in zip(S.SWASHPLATE_NAMES, row, strict=True):
                if step > rotor.swashplate_rate * tick + ROUNDING:
                    rate = f"{math.degrees(rotor.swashplate_rate):g} deg/s"
                    yield f"{rotor.name}: {name} is moved faster than its actuator moves, {rate}"


class _Mixed:
    """Swashplates that the mixer moves; see `_Direct`."""

    def __init__(self, aircraft: Aircraft, command: Command, stand: Array | None) -> None:
        self.command, self._mixer = command, Mixer(aircraft)
        self._clipped: dict[str, None] = {}
        if stand is not None:
            self._mixer.stand(stand)

    def angles(self, controls: Array, time: float) -> Array:
        """Swashplate angles [rad] at a time [s], shape (n_rotors, 3), on the way to what controls [rad] want."""
        self._mixer.set_target(controls)
        self._clipped |= dict.fromkeys(self._mixer.saturated)
        return self._mixer.move(time)

    def told(self, _: float) -> Iterator[str]:
        """What was clipped."""
        return (f"clipped: {text}" for text in self._clipped)


def _angles(
    simulation: Simulation, pilot: _Direct | _Mixed, begin: int, end: int
) -> tuple[Array, Array, SimulationError | None]:
    """Controls and swashplate angles of ticks, up to the first that are out of range, and what is wrong with those."""
    given: list[Array] = []
    angles: list[Array] = []
    wrong: SimulationError | None = None
    last: Array | None = None
    for i in range(begin, end):
        time = i * simulation.steps_per_tick * simulation.step_size
        try:
            controls = pilot.command(i, time)
            wanted = pilot.angles(controls, time)
            checked = angles[-1] if wanted is last else simulation.checked_swashplate(wanted)
        except SimulationError as error:
            wrong = error
            break
        last = wanted
        given.append(controls)
        angles.append(checked)
    return np.array(given), np.array(angles), wrong


def _command(controls: Commands) -> Command:
    """Controls of tick i at a time, whatever way they were given."""
    if callable(controls):
        function = controls

        def by_time(_: int, time: float) -> Array:
            return _four(function(time))

        return by_time
    rows = np.atleast_2d(checks.array("controls", controls, SimulationError))
    if rows.ndim != 2 or rows.shape[1] != len(S.CONTROL_NAMES) or len(rows) == 0:
        raise SimulationError(f"controls have shape {np.shape(controls)}: allowed are (4,) and (n, 4)")
    for row in rows:
        check_controls(row)
    return lambda i, _: rows[min(i, len(rows) - 1)]


def _check_rows(controls: Commands, ticks: int, tick: float) -> None:
    """Raise SimulationError for rows of controls that would not be flown."""
    if not callable(controls) and np.ndim(controls) == 2 and len(np.asarray(controls)) > ticks + 1:
        rows = len(np.asarray(controls))
        raise SimulationError(
            f"controls have {rows} rows: allowed are up to {ticks + 1}, one for each tick of {tick:g} s and the end"
        )


def _four(values: ArrayLike) -> Array:
    array = checks.array("controls", values, SimulationError)
    if array.shape != (len(S.CONTROL_NAMES),):
        raise SimulationError(f"controls have shape {array.shape}: allowed is (4,)")
    check_controls(array)
    return array


def history(
    aircraft: Aircraft, snapshots: Sequence[Snapshot], given: Sequence[Array], warnings: Iterable[str] = ()
) -> History:
    """History, see `simulate`, of as many snapshots as pilot controls [rad], each shape (4,), with further warnings."""
    rows = Rows(**{field.name: np.array([getattr(one, field.name) for one in snapshots]) for field in fields(Rows)})
    working = np.array([one.working for one in snapshots if one.working is not None])
    told = (*flight_warnings(aircraft, working), *warnings)
    return History(_histories(aircraft, [(rows, np.array(given))], True), told)


def _histories(aircraft: Aircraft, blocks: Sequence[tuple[Rows, Array]], loaded: bool) -> dict[str, Array]:
    states = np.concatenate([rows.state for rows, _ in blocks])
    named = {name: states[:, i] for i, name in enumerate(aircraft.layout.names)}
    named |= dict(zip(S.EULER_NAMES, euler_angles(states[:, S.ATTITUDE : S.VELOCITY]).T, strict=True))
    flown = named | {
        "time": np.concatenate([rows.time for rows, _ in blocks]),
        "state": states,
        "controls": np.concatenate([given for _, given in blocks]),
        "swashplate": np.concatenate([rows.swashplate for rows, _ in blocks]),
    }
    if not loaded:
        return flown
    loads = np.concatenate([rows.loads for rows, _ in blocks])
    wind = np.concatenate([rows.wind for rows, _ in blocks])
    attitude, velocity = states[:, S.ATTITUDE : S.VELOCITY], states[:, S.VELOCITY : S.RATES]
    speeds = np.array([rotor.speed for rotor in aircraft.rotors])
    return flown | {
        "acceleration": np.concatenate([rows.acceleration for rows, _ in blocks]),
        "thrust": loads[:, :, P.THRUST],
        "torque": loads[:, :, P.TORQUE],
        "power": loads[:, :, P.TORQUE] * speeds,
        S.AIRSPEED: np.linalg.norm(velocity - to_body(attitude, wind), axis=1),
    }
