"""Flights that go on together, each as it would on its own to the last bit."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sbs_sim.content import ByContent
from sbs_sim.errors import SimulationError
from sbs_sim.flight.contact import ground_forces
from sbs_sim.flight.engine import Engine
from sbs_sim.flight.records import Rows
from sbs_sim.flight.rotor_matrices import arranged
from sbs_sim.model import state as S
from sbs_sim.model.air_rows import CG_ROWS
from sbs_sim.model.fly import fly
from sbs_sim.model.frames import down_of
from sbs_sim.model.integrate import FLYING, advance
from sbs_sim.model.packing import lane_count, side_by_side
from sbs_sim.model.records import LOAD_SIZE
from sbs_sim.model.wind_columns import WIND_SIZE
from sbs_sim.model.working_state import WORKING_SIZE

if TYPE_CHECKING:
    from sbs_sim.flight.simulation import Simulation

Array = NDArray[np.float64]

RETIRED = -2  # in place of the index of the state that ended the flight


class Flown(NamedTuple):
    """What many ticks of a flight have given.

    Attributes
    ----------
    rows : Rows
    working : ndarray, shape (n, n_rotors, WORKING_SIZE)
        Working states of the rotors, see `Snapshot`, once every tenth of a second.
    watched : ndarray of int64, shape (n,)
        Ticks, from the first that was flown here, at which that was.
    ticks : int
        Complete ticks that were flown.
    fault : SimulationError or None
        Why the flight ended before its last tick; it cannot go on then.
    air : ndarray, shape (n, WIND_SIZE)
        Air of the ticks that begin with the rows; without them where the model has no rotors.
    """

    rows: Rows
    working: Array
    watched: NDArray[np.int64]
    ticks: int
    fault: SimulationError | None
    air: Array = np.zeros((0, WIND_SIZE))


@dataclass(frozen=True, eq=False)
class _Plan(ByContent):
    """Ticks of a flight that are recorded, and the air of all.

    Attributes
    ----------
    recorded, watched : ndarray of int64
        Ticks from now on: whose instants become rows, and whose working states are looked at.
    steps, looks : ndarray of int64
        Steps at which those begin.
    air : ndarray, shape (ticks + 1, WIND_SIZE)
    azimuth, wind : ndarray, shapes (len(recorded), n_rotors) [rad], (len(recorded), 3) [m/s]
    watched_azimuth, watched_wind : ndarray
        The same of the ticks that are watched.
    """

    recorded: NDArray[np.int64]
    watched: NDArray[np.int64]
    steps: NDArray[np.int64]
    looks: NDArray[np.int64]
    air: Array
    azimuth: Array
    wind: Array
    watched_azimuth: Array
    watched_wind: Array


class Formation:
    """Flights side by side.

    Parameters
    ----------
    simulations : sequence of Simulation
        One, or several, up to `sbs_sim.model.packing.lane_count()`, of aircraft with the same numbers of rotors, blades
        and elements, the same airfoils and options, at the same step.
    """

    def __init__(self, simulations: Sequence[Simulation]) -> None:
        self.simulations, first = tuple(simulations), simulations[0]
        self._engine = first.engine if len(simulations) == 1 else _engine(simulations)
        self._failed = np.full(self._engine.n, FLYING, dtype=np.int64)
        self._bounds = self._engine.lanes([one.bounds for one in simulations])
        self._start = self._engine.lanes([one.azimuth0 for one in simulations])

    def fly(self, swashplates: Sequence[Array], ticks: int, every: int, loaded: bool) -> list[Flown]:
        """Fly many ticks in one call of compiled code, during which other threads go on.

        Parameters
        ----------
        swashplates : sequence of ndarray, shape (m, n_rows, 3) each
            Angles of each tick of each flight [rad], m = ticks or one more, which is then in force at the end.
        ticks, every, loaded :
            See `fly_by`.
        """
        count = len(swashplates[0])
        angles = self._engine.lanes([own.reshape(count, -1) for own in swashplates])
        return self.fly_by(fly, angles, ticks, every, loaded)

    def fly_by(self, way: Callable[..., None], angles: Array, ticks: int, every: int, loaded: bool) -> list[Flown]:
        """Fly many ticks in some way.

        Parameters
        ----------
        way : callable
            Takes the arguments of `sbs_sim.model.fly.fly` and does what that does.
        angles : ndarray, shape (m, 3 n_rows, n)
            Of each tick of each flight [rad], m = ticks or one more, which is then in force at the end; also memory for
            them, where it is the way that finds them.
        ticks : int
        every : int
            Ticks from one row of the result to the next, counted from the start of the flight.
        loaded : bool
            False leaves accelerations and loads out.

        Returns
        -------
        list of Flown
            Of each flight. Flights that ended in a call before have no rows.
        """
        engine, count, flew = self._engine, len(angles), (self._failed == FLYING).tolist()
        code = engine.code
        # one that still flies: those that have ended stay where and when that was
        lead = flew.index(True) if any(flew[: len(self.simulations)]) else 0
        first = self.simulations[lead]
        plan = _plan(first, count, ticks, every, loaded)
        plans = [
            _plan(one, count, ticks, every, loaded) if flew[lane] and lane != lead else plan
            for lane, one in enumerate(self.simulations)
        ]
        recorded, watched = plan.recorded, plan.watched
        x, step = engine.lanes([one.state for one in self.simulations]), np.full(engine.n, first.step)
        states, forces = engine.memory(len(recorded), engine.size), engine.memory(len(recorded), 3)
        loads = engine.memory(len(recorded), LOAD_SIZE * engine.rotors)
        working = engine.memory(len(watched), engine.rotors, WORKING_SIZE)
        air = self._air([plan.wind for plan in plans])
        way(
            *(code.advance, code.derivative, code.working_state, engine.model, x, self._start, step),
            *(first.steps_per_tick, first.step_size, first.method, self._bounds, engine.work, engine.tick),
            *(self._failed, angles),
            *(engine.lanes([plan.air for plan in plans]), ticks, _first(recorded, count), every, loaded),
            *(engine.lanes([plan.azimuth for plan in plans]), air),
            *(states, forces, loads, _first(watched, count), first.watch),
            *(
                engine.lanes([plan.watched_azimuth for plan in plans]),
                self._air([plan.watched_wind for plan in plans]),
            ),
            working,
        )
        found = []
        for lane, (one, plan) in enumerate(zip(self.simulations, plans, strict=True)):
            own = np.ascontiguousarray(angles[..., lane]).reshape(count, -1, S.ROW)
            end, ticks_flown = (int(step[lane]), int(step[lane]) // one.steps_per_tick) if flew[lane] else (-1, -1)
            ticks_flown -= one.step // one.steps_per_tick
            if flew[lane]:
                one.take_over(end, x[:, lane].copy(), plan.air[ticks], own[-1].copy())
            if engine.air_rows > CG_ROWS and loaded:
                plan = replace(plan, wind=air[:, :CG_ROWS, lane].copy())
            rows = _rows(one, plan, own, states[..., lane], forces[..., lane], loads[..., lane])
            rows = replace(rows, acceleration=rows.acceleration + _gravity(one, rows.state)) if loaded else rows
            found.append(
                Flown(
                    rows.first(int(np.count_nonzero(plan.steps <= end))),
                    working[plan.looks <= end, ..., lane],
                    plan.watched[plan.looks <= end],
                    ticks_flown,
                    self._fault(lane),
                    plan.air[plan.recorded],
                )
            )
        return found

    def advance(self, swashplates: Array) -> NDArray[np.bool_]:
        """Fly one tick without records; the states are those that `fly` gives.

        Parameters
        ----------
        swashplates : ndarray, shape (n_flights, n_rows, 3)
            Angles of each flight [rad].

        Returns
        -------
        ndarray of bool, shape (n_flights,)
            True for flights that could not go on: they have their last good state, and the time of the others.
        """
        engine, first, count = self._engine, self.simulations[0], len(self.simulations)
        x, failed = engine.lanes([one.state for one in self.simulations]), np.full(engine.n, FLYING)
        angles = engine.lanes(list(swashplates.reshape(count, -1)))
        end = first.step + first.steps_per_tick
        advance(
            *(engine.code.derivative, engine.model, x, angles, self._start, first.step, first.steps_per_tick),
            *(first.step_size, engine.lanes([one.air for one in self.simulations]), first.method, self._bounds),
            *(engine.work, engine.tick, engine.tick.done, failed),
        )
        for one, state, own in zip(self.simulations, x.T[:count].copy(), swashplates, strict=True):
            one.take_over(end, state, one.next_air(end), own)
        return failed[:count] != FLYING

    def _air(self, winds: Sequence[Array]) -> Array:
        """Velocity of the air at the c.g., (k, 3) of each flight, with the rows that depend on its place behind it."""
        rows = self._engine.memory(len(winds[0]), self._engine.air_rows)
        rows[:, :CG_ROWS] = self._engine.lanes(winds)
        return rows

    @property
    def engine(self) -> Engine:
        """What flies the flights."""
        return self._engine

    def retire(self, lane: int) -> None:
        """Fly one of the flights no further."""
        self._failed[lane] = RETIRED

    def _fault(self, lane: int) -> SimulationError | None:
        """Why a flight has ended."""
        failed = int(self._failed[lane])
        if failed < 0:  # it goes on, or it was ended for another reason
            return None
        value = self._engine.tick.last[min(failed, self._engine.size - 1), lane]
        return self.simulations[lane].failure(failed, float(value))


def _engine(simulations: Sequence[Simulation]) -> Engine:
    """What flies flights in the lanes; what is missing are copies of the last."""
    filled = [*simulations, *[simulations[-1]] * (lane_count() - len(simulations))]
    model, matrices = side_by_side([one.model for one in filled]), arranged([one.rotor_matrices for one in filled])
    engine = Engine(model, filled[0].method, matrices)
    engine.set_space([one.space for one in filled])
    return engine


def _first(ticks: NDArray[np.int64], otherwise: int) -> int:
    return int(ticks[0]) if len(ticks) else otherwise


def _plan(one: Simulation, count: int, ticks: int, every: int, loaded: bool) -> _Plan:
    """What is recorded of so many ticks of a flight."""
    air = one.air_ahead(ticks)
    begin = one.step // one.steps_per_tick
    recorded, watched = (np.arange(-(-begin // n) * n - begin, count, n) for n in (every, one.watch))
    steps, looks = (begin + recorded) * one.steps_per_tick, (begin + watched) * one.steps_per_tick
    wind = one.air_at(steps, air[recorded]) if loaded else np.zeros((len(recorded), 3))
    seen = one.azimuths(looks), one.air_at(looks, air[watched])
    return _Plan(recorded, watched, steps, looks, air, one.azimuths(steps), wind, *seen)


def _rows(one: Simulation, plan: _Plan, angles: Array, states: Array, forces: Array, loads: Array) -> Rows:
    """Instants of a flight; accelerations are specific forces here."""
    return Rows(
        step=plan.steps,
        time=np.multiply(plan.steps, one.step_size, dtype=float),
        state=np.ascontiguousarray(states),
        acceleration=np.ascontiguousarray(forces),
        swashplate=angles[plan.recorded],
        azimuth=one.aircraft.turned(plan.azimuth, states),
        loads=np.ascontiguousarray(loads).reshape(len(plan.steps), -1, LOAD_SIZE),
        wind=plan.wind,
        contact=ground_forces(one.model, states),
    )


def _gravity(one: Simulation, states: Array) -> Array:
    """Gravity in body axes [m/s^2], shape (n, 3), of states (n, size): what a specific force lacks."""
    return down_of(states[:, S.ATTITUDE : S.VELOCITY]) * one.aircraft.environment.gravity
