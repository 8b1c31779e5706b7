"""Flight in time: a stateful `Simulation` that advances tick by tick, and `simulate` for whole flights.

A tick is the period at which states are handed out and commands taken in; it holds a whole number of integration
steps. Steps are counted in integers from the start, and time is step x dt, so that the same commands at the same steps
give the same flight to the last bit.
"""

from __future__ import annotations  # `help` then shows types by their names

import collections
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import fields
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sbs_sim import checks, interruption
from sbs_sim.aircraft import Aircraft
from sbs_sim.analysis.trim import TrimPoint
from sbs_sim.engine import Engine
from sbs_sim.errors import SimulationError
from sbs_sim.flight_records import Event, Rows, Snapshot
from sbs_sim.formation import Flown, Formation
from sbs_sim.mixer import ROUNDING, Mixer, check_controls, check_ranges
from sbs_sim.model import records as R
from sbs_sim.model import state as S
from sbs_sim.model.dynamics import derivative
from sbs_sim.model.frames import down_of, euler_angles, euler_to_quaternion, rotation_matrix, to_body
from sbs_sim.model.ground import lowest_point
from sbs_sim.model.integrate import ETD, FLYING, PARTITIONED, RK4, TSIT5, advance, azimuths_at
from sbs_sim.model.multiblade import blade_matrix
from sbs_sim.model.solve import length
from sbs_sim.model.wind import Wind, WindField, winds_at
from sbs_sim.model.working_state import WORKING_SIZE, working_state
from sbs_sim.rotor_matrices import RotorMatrices, arranged, rotor_matrices
from sbs_sim.validity import flight_warnings

Array = NDArray[np.float64]
Commands = ArrayLike | Callable[[float], ArrayLike]
Command = Callable[[int, float], Array]  # of a tick, and its time [s]

UNIT = 1e-9  # a quaternion whose norm is this near to one is a unit quaternion
METHODS = {"etd": ETD, "rk4": RK4, "tsit5": TSIT5, "partitioned": PARTITIONED}
METHOD = "etd"  # by default
TICKS = (1e-4, 1.0)  # s, shortest and longest
AZIMUTH_STEPS = (math.radians(0.01), math.radians(45.0))  # rad
AZIMUTH_STEP_DEG = 14.4  # by default: docs/speed.md has its errors
AZIMUTH_STEP = math.radians(AZIMUTH_STEP_DEG)

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
        "etd", of fourth order, which solves what is stiff in the rotors exactly; "rk4", the classical one; "tsit5", of
        fifth order; or "partitioned": the paper's scheme,
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
        azimuth_step: float = AZIMUTH_STEP,
        lead_lag: bool = True,
        cyclic_inflow: bool = True,
        method: str = METHOD,
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
        self.method = METHODS[method]
        self.model = aircraft.model(lead_lag, cyclic_inflow)
        self.bounds = np.append(plausible_bounds(aircraft), -ground)
        self.watch = max(1, round(WATCH_PERIOD / tick))
        self.azimuth0 = np.zeros(len(aircraft.rotors))
        self._held = held_states(aircraft, lead_lag, cyclic_inflow)
        self.step = 0
        self.set_wind(Wind() if wind is None else wind)
        self.state = self.checked_state(state)
        self.swashplate = self.checked_swashplate(swashplate)

    @cached_property
    def engine(self) -> Engine:
        """What flies this aircraft alone."""
        options = self.options["lead_lag"], self.options["cyclic_inflow"]
        return Engine(self.aircraft.arranged(*options, "blades"), self.method, arranged([self.rotor_matrices]))

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
        deepest = np.zeros((1, 1))
        lowest_point(self.model.rotors, values[:, np.newaxis], deepest)
        lowest, ground = -float(deepest[0, 0]), -self.bounds[-1]
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
        engine, culprit = self.engine, np.full(1, FLYING)
        advance(
            *(
                engine.code.derivative,
                engine.model,
                _single(self.state),
                _single(self.swashplate),
                _single(self.azimuth0),
            ),
            *(self.step, self.steps_per_tick, self.step_size, _single(self._air), self.method, _single(self.bounds)),
            *(engine.work, engine.tick, engine.tick.done, culprit),
        )
        self.step += int(engine.tick.done[0])
        if culprit[0] != FLYING:
            raise self.end(int(culprit[0]), float(engine.tick.last[min(culprit[0], engine.size - 1), 0]))
        self._air = self._field.next_tick()

    def end(self, culprit: int, value: float) -> SimulationError:
        """Why the flight cannot go on: a state that the next step would take to a value beyond the plausible."""
        if culprit == self.layout.size:
            speed = math.sqrt(sum(float(part) ** 2 for part in self.state[S.VELOCITY : S.RATES]))
            return SimulationError(
                f"ground contact after step {self.step} (t = {self.time:.4f} s) at {speed:.3g} m/s:"
                f" the ground is at {-self.bounds[-1]:g} m"
            )
        return SimulationError(
            f"step {self.step + 1} (t = {(self.step + 1) * self.step_size:.4f} s) would take"
            f" {self.layout.names[culprit]} to {value:g}: plausible are magnitudes"
            f" up to {self.bounds[culprit]:g}"
        )

    def fly(self, swashplates: Array, ticks: int, every: int = 1, loaded: bool = True) -> Flown:
        """Fly many ticks in one call of compiled code, see `Formation.fly`.

        To the last bit it is what `set_swashplate`, `snapshot` and `advance` give tick by tick.
        """
        return Formation([self]).fly([swashplates], ticks, every, loaded)[0]

    def go_on(self, step: int, state: Array, air: Array, swashplate: Array) -> None:
        """Take over what a flight in a formation has come to, with the air of its next tick."""
        self.step, self.state, self._air, self.swashplate = step, state, air, swashplate

    def air_ahead(self, ticks: int) -> Array:
        """Air of this tick and of so many that follow, shape (ticks + 1, WIND_SIZE)."""
        return np.concatenate([self._air[np.newaxis], self._field.next_ticks(ticks)])

    def air_at(self, steps: NDArray[np.int64], air: Array) -> Array:
        """Velocity of the air at the beginnings of ticks, NED [m/s], shape (n, 3)."""
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

    def snapshot(self) -> Snapshot:
        """The present instant, with loads and accelerations under the swashplate angles now in force."""
        engine, now = self.engine, np.array([self.step])
        azimuth, air = self.azimuths(now)[0], self.air_at(now, self._air[np.newaxis])[0]
        working = engine.memory(engine.rotors, WORKING_SIZE)
        derivative(
            *(engine.model, _single(self.state), _single(self.swashplate), _single(azimuth), _single(air)),
            *(engine.work, engine.tick.slopes[0], True),
        )
        working_state(engine.model, engine.work, working)
        down = down_of(self.state[np.newaxis, S.ATTITUDE : S.VELOCITY])[0]
        return Snapshot(
            step=self.step,
            time=self.time,
            state=self.state.copy(),
            acceleration=engine.work.vector[:3, 0] + down * self.aircraft.environment.gravity,
            swashplate=self.swashplate.copy(),
            azimuth=azimuth,
            loads=engine.work.load_rows.reshape(engine.rotors, -1).copy(),
            wind=air,
            working=working[..., 0],
        )


def _single(values: Array) -> Array:
    """Numbers of a flight as the only lane: the same memory."""
    return values.reshape(-1, 1)


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
    north, east, down = np.asarray(wind, dtype=float).tolist()
    to_earth = rotation_matrix(euler_to_quaternion(heading, point.pitch, point.roll))
    state[S.VELOCITY : S.RATES] += to_earth[0] * north + to_earth[1] * east + to_earth[2] * down
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
    azimuth_step: float = AZIMUTH_STEP,
    lead_lag: bool = True,
    cyclic_inflow: bool = True,
    method: str = METHOD,
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
    sortie = Sortie(
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
    fly_together([sortie])
    flown, fault = sortie.result()
    if fault is not None:
        raise fault
    return flown


class Sortie:
    """A flight under commands: what it is to be, and what became of it.

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

    Raises
    ------
    SimulationError
        The flight cannot begin.

    Attributes
    ----------
    simulation : Simulation
    ticks : int
        Of the whole flight.
    fault : SimulationError or None
        Why it has ended early.
    """

    def __init__(
        self,
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
    ) -> None:
        checks.instance("aircraft", aircraft, Aircraft, SimulationError)
        duration = checks.number("duration", duration, 0.0, 1e6, "s", SimulationError)
        actuators = checks.flag("actuators", actuators, SimulationError)
        air = Wind() if wind is None else wind
        checks.instance("wind", air, Wind, SimulationError)
        state = trimmed_state(aircraft, start, wind=air.velocity) if isinstance(start, TrimPoint) else start
        stand = start.swashplate if isinstance(start, TrimPoint) else None
        command = _command(controls)
        self._pilot = (_Mixed if actuators else _Direct)(aircraft, command, stand)
        angles = self._pilot.angles(command(0, 0.0), 0.0)
        self.simulation = Simulation(aircraft, state, angles, wind=air, **options)
        self.ticks = round(duration / self.simulation.tick)
        _check_rows(controls, self.ticks, self.simulation.tick)
        self.every, self.loaded = every, loaded
        self.fault: SimulationError | None = None
        self._blocks: list[tuple[Rows, Array]] = []
        self._looks: list[Array] = []
        self._given, self._begin = np.empty(0), 0
        self._wrong: SimulationError | None = None

    def commanded(self, begin: int, end: int) -> Array:
        """Swashplate angles [rad] of ticks, as many as there are right commands for."""
        self._given, angles, self._wrong = _angles(self.simulation, self._pilot, begin, end)
        self._begin = begin
        return angles

    def take(self, flown: Flown) -> None:
        """Take over what the ticks that were commanded have given."""
        ticks = flown.rows.step // self.simulation.steps_per_tick - self._begin
        count = int(np.count_nonzero(ticks < len(self._given)))
        self._blocks.append((flown.rows.first(count), self._given[ticks[:count]]))
        self._looks.append(flown.working[flown.watched < len(self._given)])
        self.fault = flown.fault if flown.ticks < len(self._given) else None
        self.fault = self.fault or self._wrong

    def end(self) -> None:
        """End where not even the first tick has a right command."""
        self.fault = self._wrong

    def result(self) -> tuple[History, SimulationError | None]:
        """Histories up to the last good tick, see `simulate`, and why the flight ended early, or None.

        Raises
        ------
        SimulationError
            Not even the first tick was flown.
        """
        if not self._blocks and self.fault is not None:
            raise self.fault
        aircraft = self.simulation.aircraft
        working = np.concatenate(self._looks)
        told = (*flight_warnings(aircraft, working), *self._pilot.told(self.simulation.tick))
        return History(_histories(aircraft, self._blocks, self.loaded), told), self.fault


def fly_together(sorties: Sequence[Sortie]) -> None:
    """Fly one flight, or several side by side, to their ends: each as it would on its own to the last bit.

    Parameters
    ----------
    sorties : sequence of Sortie
        One, or up to `sbs_sim.model.packing.lane_count()` with `structure` and ticks in common.
    """
    formation, first = Formation([sortie.simulation for sortie in sorties]), sorties[0]
    size = _block(first.simulation, len(sorties))
    for begin in range(0, first.ticks + 1, size):
        interruption.look()
        end = min(begin + size, first.ticks + 1)
        flying = [sortie.fault is None for sortie in sorties]
        angles = [
            sortie.commanded(begin, end) if one else np.empty(0) for sortie, one in zip(sorties, flying, strict=True)
        ]
        most = max(map(len, angles))
        if most:
            padded = [_padded(own, most, sortie.simulation) for own, sortie in zip(angles, sorties, strict=True)]
            flown = formation.fly(padded, min(most, first.ticks - begin), first.every, first.loaded)
        for lane, (sortie, own) in enumerate(zip(sorties, angles, strict=True)):
            if flying[lane] and len(own):
                sortie.take(flown[lane])
            elif flying[lane]:
                sortie.end()
            if sortie.fault is not None:
                formation.retire(lane)
        if all(sortie.fault is not None for sortie in sorties):
            return


def _padded(angles: Array, count: int, simulation: Simulation) -> Array:
    """Angles of as many ticks; what is missing is of no meaning."""
    last = angles[-1] if len(angles) else simulation.swashplate
    return np.concatenate([angles.reshape(-1, *last.shape), np.tile(last, (count - len(angles), 1, 1))])


def structure(simulation: Simulation) -> Any:
    """What flights that are flown side by side have in common."""
    aircraft, model = simulation.aircraft, simulation.model
    blades = tuple(rotor.blades for rotor in aircraft.rotors)
    return (
        *(blades, aircraft.options, tuple(map(id, aircraft.tables)), simulation.steps_per_tick, simulation.method),
        *(simulation.tick, simulation.step, model.switches.tobytes()),
    )


def _block(simulation: Simulation, flights: int) -> int:
    """Ticks of a call that takes no longer than an interruption may wait."""
    elements = flights * simulation.aircraft.layout.blade_count * simulation.aircraft.options.elements
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
        "thrust": loads[:, :, R.THRUST],
        "torque": loads[:, :, R.TORQUE],
        "power": loads[:, :, R.TORQUE] * speeds,
        S.AIRSPEED: np.linalg.norm(velocity - to_body(attitude, wind), axis=1),
    }
