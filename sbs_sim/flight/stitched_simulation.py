"""Flight of a stitched model: a `Simulation` with other equations."""

from __future__ import annotations  # `help` then shows types by their names

import math
from collections.abc import Sequence
from typing import Any, NoReturn

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sbs_sim import checks
from sbs_sim.aircraft import Aircraft
from sbs_sim.errors import SimulationError
from sbs_sim.flight.actuation import Direct, Mixed, commanded_angles
from sbs_sim.flight.controls import Commands, check_rows, command
from sbs_sim.flight.formation import Flown
from sbs_sim.flight.history import History, named_histories
from sbs_sim.flight.records import Motion, Rows, Snapshot
from sbs_sim.flight.simulation import Simulation
from sbs_sim.flight.stitched import StitchedModel
from sbs_sim.flight.trim_point import TrimPoint
from sbs_sim.flight.trimmed_state import trimmed_state
from sbs_sim.model import state as S
from sbs_sim.model.frames import down_of, to_body
from sbs_sim.model.ground import lowest_point
from sbs_sim.model.records import LOAD_SIZE
from sbs_sim.model.stitched import UNBROKEN, fly_stitched
from sbs_sim.model.wind import POINT, Wind, winds_at
from sbs_sim.model.wind_columns import TURBULENCE_FROM, TURBULENCE_TO

Array = NDArray[np.float64]

FULL, STITCHED = MODELS = ("full", "stitched")
# Radians of the fastest pole in a step of the classical Runge-Kutta method, which is stable up to 2.78; and the longest
# step [s].
STEP, LONGEST_STEP = 1.25, 0.02
BLOCK = 1000  # ticks in one call of compiled code


class StitchedSimulation(Simulation):
    """A stitched model in flight, see `Simulation`.

    Parameters
    ----------
    model : StitchedModel
    state, swashplate, tick, wind, ground_altitude :
        See `Simulation`. States of rotors and inflow that the model does not keep follow from the others, whatever is
        given. The fidelity is the model's.

    Raises
    ------
    SimulationError
        See `Simulation`; air that is not the same everywhere.
    """

    def __init__(
        self,
        model: StitchedModel,
        state: ArrayLike,
        swashplate: ArrayLike,
        *,
        tick: float = 0.01,
        wind: Wind | None = None,
        ground_altitude: float | None = None,
    ) -> None:
        checks.instance("model", model, StitchedModel, SimulationError)
        self.stitched: StitchedModel = model
        options: dict[str, Any] = {"lead_lag": model.lead_lag, "cyclic_inflow": model.cyclic_inflow}
        super().__init__(
            model.aircraft,
            state,
            swashplate,
            tick=tick,
            method="rk4",
            wind=wind,
            ground_altitude=ground_altitude,
            **options,
        )
        longest = min(LONGEST_STEP, STEP / model.fastest)
        self.steps_per_tick = max(1, math.ceil(self.tick / longest * (1 - 1e-12)))
        self.step_size = self.tick / self.steps_per_tick
        self.options["model"] = STITCHED
        self._memory = model.memory()
        self._settle()

    def set_wind(self, wind: Wind) -> None:
        """Set the wind from the next tick on, see `Simulation`; air that is not the same everywhere is refused."""
        checks.instance("wind", wind, Wind, SimulationError)
        refuse_wind(wind)
        super().set_wind(wind)

    def fail_engine(self, drive: int = 1, share: float = 1.0) -> NoReturn:
        """Raise SimulationError: a stitched model has no engines."""
        raise SimulationError("engine failures: not allowed with a stitched model, which has no engines")

    def reset(self, state: ArrayLike, swashplate: ArrayLike) -> None:
        """Put the aircraft elsewhere; time and wind go on."""
        super().reset(state, swashplate)
        self._settle()

    def advance(self) -> None:
        """Fly one tick, see `Simulation`."""
        flown = self.fly(self.swashplate[np.newaxis], 1, 1, False)
        if flown.fault is not None:
            raise flown.fault

    def fly(self, swashplates: Array, ticks: int, every: int = 1, loaded: bool = True) -> Flown:
        """Fly many ticks, see `Simulation`; near a ground one by one."""
        if math.isinf(self.bounds[-1]):
            return self._fly(swashplates, ticks, every)
        parts = list[Flown]()
        for i in range(len(swashplates)):
            part = self._fly(swashplates[i : i + 1], min(1, ticks - i), every)
            if part.fault is None and self._is_on_ground():
                part = part._replace(fault=self.failure(self.layout.size, 0.0))
            parts.append(part)
            if part.fault is not None:
                break
        rows = Rows(*map(_joined, zip(*(_columns(part.rows) for part in parts), strict=True)))
        return parts[-1]._replace(rows=rows, ticks=sum(part.ticks for part in parts))

    def _fly(self, swashplates: Array, ticks: int, every: int) -> Flown:
        model, begin, count = self.stitched, self.step // self.steps_per_tick, len(swashplates)
        inputs = np.ascontiguousarray(swashplates.reshape(count, -1)[:, model.inputs])
        x = np.ascontiguousarray(self.state[model.places])
        recorded = np.arange(-(-begin // every) * every - begin, count, every)
        states, forces = np.zeros((len(recorded), len(x))), np.zeros((len(recorded), 3))
        outputs = np.zeros((len(recorded), model.output_trims.shape[-1]))
        air, done = self._air_samples(ticks), np.zeros(3, dtype=np.int64)
        fly_stitched(
            *(model.stitches, x, inputs, air, begin, ticks, self.steps_per_tick, self.step_size, every),
            *(self.bounds[model.places], self._memory, states, forces, outputs, done),
        )
        made, written, failed = done.tolist()
        winds = air[np.minimum(2 * self.steps_per_tick * recorded[:written], len(air) - 1)]
        rows = self._rows(recorded[:written], states[:written], forces[:written], outputs[:written], winds, swashplates)
        before, self.step = self.step, self.step + made
        fault = None
        if failed != UNBROKEN:
            place = int(model.places[failed])
            fault = self.failure(place, float(self._memory.stage[failed]))
        state = self.state.copy()
        state[model.places] = x
        self.state, self.swashplate = state, swashplates[-1].copy()
        self._settle()
        flown_ticks = self.step // self.steps_per_tick - before // self.steps_per_tick
        return Flown(rows, np.empty((0, 0)), np.empty(0, dtype=np.int64), flown_ticks, fault)

    def _air_samples(self, ticks: int) -> Array:
        """Velocity of the air at every half step of ticks from now on, NED [m/s], shape (n, 3); one if it is steady."""
        wind = self.wind
        if not (any(wind.gust) or any(wind.turbulence_intensity) or wind.own_gust is not None):
            if ticks:
                self._air = self._field.next_ticks(ticks)[-1].copy()
            return np.array([wind.velocity])
        air = self.air_ahead(ticks) if ticks else self._air[np.newaxis]
        halves, of_tick = np.arange(2 * self.steps_per_tick * ticks + 1), 2 * self.steps_per_tick
        owners = halves // of_tick
        own, velocities = air[owners], np.zeros((len(halves), 3, 1))
        times = (self.step + 0.5 * halves) * self.step_size
        winds_at(np.ascontiguousarray(own)[..., np.newaxis], times, self.model.rotors, velocities)
        change = own[:, TURBULENCE_TO : TURBULENCE_TO + 3] - own[:, TURBULENCE_FROM : TURBULENCE_FROM + 3]
        if ticks:
            self._air = air[-1].copy()
        return velocities[..., 0] + (halves % of_tick / of_tick)[:, np.newaxis] * change

    def _settle(self) -> None:
        """Give states that have settled the values that follow from the others."""
        if len(self.stitched.settled):
            state = self.state.copy()
            state[self.stitched.settled_places] = self._now()[1][-len(self.stitched.settled) :]
            self.state = state

    def _now(self) -> tuple[Array, Array]:
        """Rates and outputs at the present."""
        wind = self.air_at(np.array([self.step]), self._air[np.newaxis])[0]
        return self.stitched.rates(self.state, self.swashplate, wind)

    def _rows(
        self, recorded: NDArray[np.int64], states: Array, forces: Array, outputs: Array, winds: Array, angles: Array
    ) -> Rows:
        """Instants of what was flown."""
        model, layout = self.stitched, self.layout
        steps = (self.step // self.steps_per_tick + recorded) * self.steps_per_tick
        full = np.zeros((len(recorded), layout.size))
        full[:, model.places] = states
        loads = outputs.shape[1] - len(model.settled)
        full[:, model.settled_places] = outputs[:, loads:]
        down = down_of(states[:, S.ATTITUDE : S.VELOCITY])
        return Rows(
            step=steps,
            time=np.multiply(steps, self.step_size, dtype=float),
            state=full,
            acceleration=forces + down * self.aircraft.environment.gravity,
            swashplate=angles[recorded],
            azimuth=self.aircraft.turned(self.azimuths(steps), full),
            loads=outputs[:, :loads].reshape(len(recorded), -1, LOAD_SIZE),
            wind=winds,
        )

    def _is_on_ground(self) -> bool:
        """Whether the c.g. or a rotor touches the ground."""
        down = np.zeros((1, 1))
        lowest_point(self.ground, self.model.rotors, np.ascontiguousarray(self.state)[:, np.newaxis], down)
        return float(down[0, 0]) >= self.bounds[-1]

    def motion(self) -> Motion:
        """See `Simulation`."""
        now = self.snapshot()
        down = down_of(now.state[np.newaxis, S.ATTITUDE : S.VELOCITY])[0]
        force = now.acceleration - down * self.aircraft.environment.gravity
        return Motion(now.state, force, now.wind, now.derivative)

    def snapshot(self) -> Snapshot:
        """The present instant, see `Simulation`; without the working states of the rotors."""
        wind = self.air_at(np.array([self.step]), self._air[np.newaxis])
        rates, outputs = self.stitched.rates(self.state, self.swashplate, wind[0])
        velocity, turning = self.state[S.VELOCITY : S.RATES], self.state[S.RATES : S.BODY_SIZE]
        loads = len(outputs) - len(self.stitched.settled)
        state = self.state.copy()
        state[self.stitched.settled_places] = outputs[loads:]
        return Snapshot(
            step=self.step,
            time=self.time,
            state=state,
            acceleration=rates[S.VELOCITY : S.RATES] + np.cross(turning, velocity),
            swashplate=self.swashplate.copy(),
            azimuth=self.aircraft.turned(self.azimuths(np.array([self.step]))[0], state),
            loads=outputs[:loads].reshape(-1, LOAD_SIZE),
            wind=wind[0],
            derivative=rates,
        )


def begun(
    aircraft: Aircraft, model: StitchedModel | None, state: ArrayLike, swashplate: ArrayLike, **options: Any
) -> Simulation:
    """Simulation of an aircraft, by its full model or by a stitched one.

    Raises
    ------
    SimulationError
        See `Simulation`; a stitched model of another aircraft.
    """
    if model is None:
        return Simulation(aircraft, state, swashplate, **options)
    checks.instance("model", model, StitchedModel, SimulationError)
    check_aircraft(model, aircraft)
    return StitchedSimulation(model, state, swashplate, **options)


def check_aircraft(model: StitchedModel, aircraft: Aircraft) -> None:
    """Raise SimulationError for a stitched model of another aircraft."""
    if model.parameter_hash != aircraft.parameter_hash:
        raise SimulationError(
            f"the stitched model is one of another aircraft: allowed is one of {aircraft.name} as it is"
        )


def refuse_wind(wind: Wind) -> None:
    """Raise SimulationError for air that is not the same everywhere."""
    if wind.is_local or (any(wind.turbulence_intensity) and wind.turbulence_extent != POINT):
        raise SimulationError(
            "wind: allowed for a stitched model is air that is the same everywhere: a uniform profile, turbulence at a"
            " point, gusts over time"
        )


def simulate_stitched(
    model: StitchedModel,
    start: TrimPoint | ArrayLike | float,
    controls: Commands | None,
    duration: float,
    *,
    tick: float = 0.01,
    every: int = 1,
    wind: Wind | None = None,
    ground_altitude: float | None = None,
    actuators: bool = False,
) -> History:
    """Fly a stitched model for a while and return what happened.

    Parameters
    ----------
    model : StitchedModel
    start : TrimPoint, ndarray of shape (size,), or float
        A trim point, a simulation state, or the airspeed [m/s] of a trim of the model itself.
    controls : see `simulate`
        None holds those of the trim.
    every : int
        Ticks from one row of the histories to the next.
    duration, tick, wind, ground_altitude, actuators : see `simulate`

    Returns
    -------
    History
        See `simulate`. Flap, lag and inflow that the model does not keep are those to which they settle; loads are
        means over a revolution.

    Raises
    ------
    SimulationError
        See `simulate`; air that is not the same everywhere.
    """
    checks.instance("model", model, StitchedModel, SimulationError)
    duration = checks.number("duration", duration, 0.0, 1e6, "s", SimulationError)
    every = checks.integer("every", every, 1, 10**9, SimulationError)
    air, aircraft = Wind() if wind is None else wind, model.aircraft
    checks.instance("wind", air, Wind, SimulationError)
    state, initial = _start(model, start, air)
    if controls is None:
        if initial is None:
            raise SimulationError("controls = None: allowed with a start from a trim")
        controls = aircraft.unmix(initial)
    pilot_command = command(aircraft, controls)
    pilot = (Mixed if actuators else Direct)(aircraft, pilot_command, initial)
    first = pilot_command(0, 0.0)
    angles = pilot.angles(first, 0.0)
    is_constant = not (actuators or callable(controls) or np.ndim(controls) == 2)
    simulation = StitchedSimulation(model, state, angles, tick=tick, wind=air, ground_altitude=ground_altitude)
    ticks = round(duration / simulation.tick)
    check_rows(controls, ticks, simulation.tick)
    blocks = list[tuple[Rows, Array]]()
    for begin in range(0, ticks + 1, BLOCK):
        end = min(begin + BLOCK, ticks + 1)
        if is_constant:
            given, wanted = (np.tile(one, (end - begin, *[1] * one.ndim)) for one in (first, angles))
        else:
            given, wanted, wrong = commanded_angles(simulation, pilot, begin, end)
            if wrong is not None:
                raise wrong
        flown = simulation.fly(wanted, min(end, ticks) - begin, every)
        if flown.fault is not None:
            raise flown.fault
        recorded = flown.rows.step // simulation.steps_per_tick - begin
        blocks.append((flown.rows, given[recorded]))
    lines = (*model.warnings, *pilot.warnings(simulation.tick))
    return History(named_histories(aircraft, blocks, True), lines)


def _start(model: StitchedModel, start: TrimPoint | ArrayLike | float, wind: Wind) -> tuple[Array, Array | None]:
    """State at the start, and swashplate angles if they are known."""
    if isinstance(start, TrimPoint):
        return trimmed_state(model.aircraft, start, wind=wind.velocity), start.swashplate
    given = checks.array("start", start, SimulationError)
    if given.ndim:
        return given, None
    state, swash = model.trim(float(given))
    return drifting(state, wind.velocity), swash


def drifting(state: Array, wind: Sequence[float]) -> Array:
    """State of an aircraft that drifts with a steady wind."""
    moved = state.copy()
    moved[S.VELOCITY : S.RATES] += to_body(state[np.newaxis, S.ATTITUDE : S.VELOCITY], np.array([wind]))[0]
    return moved


def _columns(rows: Rows) -> list[Any]:
    return [getattr(rows, name) for name in rows.__dataclass_fields__]


def _joined(columns: tuple[Any, ...]) -> Any:
    return None if columns[0] is None else np.concatenate(columns)
