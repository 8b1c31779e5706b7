"""Control laws in the loop of flights that go on side by side."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sbs_sim import checks
from sbs_sim.aircraft import Aircraft
from sbs_sim.errors import SimulationError
from sbs_sim.flight import measured as M
from sbs_sim.flight.controlled import WRONG_CONTROL, Loop, fly_controlled, sense
from sbs_sim.flight.controller import Controller, SensorErrors
from sbs_sim.flight.engine import Engine
from sbs_sim.flight.mixer import check_controls, limit_texts
from sbs_sim.model.fly import fly
from sbs_sim.model.integrate import FLYING
from sbs_sim.model.kernel import address

Array = NDArray[np.float64]


class OwnLoop:
    """The controller of one flight, and what becomes of it.

    Parameters
    ----------
    aircraft : Aircraft
    controller : Controller
    trimmed : tuple of ndarray, or None
        Controls and swashplate angles of the trim point from which the flight starts; None if it starts elsewhere.

    Raises
    ------
    SimulationError
        The controls to start with are missing, or cannot be.
    """

    def __init__(self, aircraft: Aircraft, controller: Controller, trimmed: tuple[Array, Array] | None) -> None:
        self.aircraft, self.controller = aircraft, controller
        if controller.initial is None and trimmed is None:
            raise SimulationError("initial: a flight from a state needs the controls before the first call of the law")
        self.initial = trimmed[0] if trimmed is not None else np.empty(0)
        if controller.initial is not None:
            self.initial = checks.array("initial", controller.initial, SimulationError)
        check_controls(aircraft, self.initial)
        ranges = np.array([control.range for control in aircraft.controls])
        self.position = aircraft.mix(np.clip(self.initial, *ranges.T)) if trimmed is None else trimmed[1]
        self.knows_position = trimmed is not None
        self.errors: SensorErrors = controller.sensors.errors()
        self.saturated = np.zeros((2, len(aircraft.controls) + 3 * len(aircraft.rows)), dtype=np.int64)

    def structure(self, tick: float) -> Any:
        """What flights that are flown side by side have in common."""
        own = self.controller
        sizes = len(np.asarray(own.memory)), len(np.asarray(own.parameters)), len(self.initial)
        return own.law, own.ticks("period", tick), own.ticks("delay", tick), *sizes

    def warnings(self) -> list[str]:
        """What was clipped."""
        return [f"clipped: {text}" for text in limit_texts(self.aircraft, self.saturated)]


class ClosedLoop:
    """Control laws of flights side by side.

    Parameters
    ----------
    loops : sequence of OwnLoop
        With `structure` in common.
    engine : Engine
        What flies them.
    tick : float
        [s]
    """

    def __init__(self, loops: Sequence[OwnLoop], engine: Engine, tick: float) -> None:
        self._loops, self._engine, self._tick = loops, engine, tick
        first = loops[0].controller
        self._period, self._law = first.ticks("period", tick), None if first.is_compiled else first.law
        self._code = first.code()
        self._loop = _joined(loops, engine, tick)
        self._number = 0
        self._given = np.empty(0)
        self._raised: dict[int, Exception] = {}

    def way(self, *arguments: Any) -> None:
        """Fly as `sbs_sim.model.fly.fly` does, under the laws."""
        count, first = len(arguments[14]), int(arguments[6].max())
        ticks = np.arange(self._number, self._number + count)
        calls = int(np.count_nonzero(ticks % self._period == 0))
        noise = self._engine.lanes([own.errors.next(calls) for own in self._loops])
        self._given = self._engine.memory(count, len(self._loops[0].initial))
        place = np.zeros(3, dtype=np.int64)
        fly_code = _fly_code(self._engine, arguments)
        begins = [0, count] if self._law is None else range(count + 1)
        for begin, end in itertools.pairwise(begins):
            if self._law is not None and (self._number + begin) % self._period == 0:
                self._ask(arguments, begin, first, noise[place[2]])
            fly_controlled(
                *(self._code, fly_code, self._loop, self._number, place, begin, end, first, noise, self._given),
                *arguments,
            )
        self._number += arguments[16]

    def _ask(self, arguments: tuple[Any, ...], i: int, first: int, noise: Array) -> None:
        """Ask laws of Python for their controls at tick i of those that are flown."""
        model, x, steps, h, failed, winds = (arguments[k] for k in (3, 4, 7, 8, 13, 15))
        time, loop = float((first + i * steps) * h), self._loop
        sense(model, x, winds[i], time, self._engine.tick, loop, noise)
        for lane, own in enumerate(self._loops):
            if failed[lane] != FLYING:
                continue
            try:
                own.controller.law(
                    time, loop.measured[lane], loop.memory[lane], loop.parameters[lane], loop.controls[lane]
                )
            except Exception as error:  # of whatever kind: it ends this flight only
                self._raised[lane] = error
                failed[lane], loop.wrong[lane] = WRONG_CONTROL, self._number + i

    def given(self, lane: int, begin: int) -> tuple[Array, SimulationError | None]:
        """Controls that acted in the ticks from `begin` on, up to the first that were wrong, and what was."""
        wrong = int(self._loop.wrong[lane])
        self._loops[lane].saturated[:] = self._loop.saturated[..., lane]
        given = np.ascontiguousarray(self._given[..., lane])
        if wrong < 0:
            return given, None
        return given[: max(0, wrong - begin)], self._fault(lane, wrong)

    def _fault(self, lane: int, tick: int) -> SimulationError:
        """What was wrong with the controls at a tick."""
        where = f"controls at {tick * self._tick:g} s: "
        if lane in self._raised:
            error = self._raised[lane]
            return SimulationError(f"{where}the law raised {type(error).__name__}: {' '.join(str(error).split())}")
        try:
            check_controls(self._loops[lane].aircraft, self._loop.controls[lane])
        except SimulationError as error:
            return SimulationError(f"{where}{error}")
        return SimulationError(f"{where}not finite")


def _fly_code(engine: Engine, arguments: tuple[Any, ...]) -> Any:
    """Address of `fly`, for the lanes of an engine."""
    key = engine.code
    if key not in _codes:
        _codes[key] = address(fly, *arguments)
    return _codes[key]


_codes: dict[Any, Any] = {}


def _joined(loops: Sequence[OwnLoop], engine: Engine, tick: float) -> Loop:
    """Numbers and memory of the loops, side by side; what is missing are copies of the last."""
    filled = [*loops, *[loops[-1]] * (engine.n - len(loops))]
    first, n = loops[0], engine.n
    period, delay = (first.controller.ticks(name, tick) for name in ("period", "delay"))
    controls, rows = len(first.initial), first.position.size

    def flights_first(values: Sequence[Array]) -> Array:
        return np.array(values, dtype=float).reshape(n, -1)

    def of_rows(values: Sequence[Any]) -> Array:
        return engine.lanes([np.array(one, dtype=float).reshape(rows) for one in values])

    crafts = [one.aircraft for one in filled]
    ranges = [np.array([control.range for control in craft.controls]) for craft in crafts]
    row_ranges = [np.array([row.ranges for row in craft.rows]) for craft in crafts]
    shares = [np.array([one.controller.lag_share(tick)]) for one in filled]
    initial = engine.lanes([one.initial for one in filled])
    return Loop(
        period=period,
        delay=delay,
        bias=flights_first([one.errors.bias for one in filled]),
        measured=np.zeros((n, M.COUNT)),
        memory=flights_first([np.asarray(one.controller.memory) for one in filled]),
        parameters=flights_first([np.asarray(one.controller.parameters) for one in filled]),
        controls=flights_first([one.initial for one in filled]),
        waiting=engine.lanes([np.tile(one.initial, (delay + 1, 1)) for one in filled]),
        lag=engine.lanes(shares),
        lagged=initial,
        limits=engine.lanes([np.array([control.limit for control in craft.controls]) for craft in crafts]),
        low=engine.lanes([own[:, 0] for own in ranges]),
        high=engine.lanes([own[:, 1] for own in ranges]),
        clipped=engine.memory(controls),
        rigging=engine.lanes([craft.rigging for craft in crafts]),
        row_low=of_rows([own[..., 0] for own in row_ranges]),
        row_high=of_rows([own[..., 1] for own in row_ranges]),
        reach=of_rows([np.array([[row.rate * tick] * 3 for row in craft.rows]) for craft in crafts]),
        first_reach=engine.lanes([np.array([0.0 if one.knows_position else np.inf]) for one in filled]),
        wanted=engine.memory(rows),
        position=of_rows([one.position for one in filled]),
        saturated=np.zeros((2, controls + rows, n), dtype=np.int64),
        wrong=np.full(n, -1, dtype=np.int64),
        now=np.zeros(n, dtype=np.int64),
        rows=engine.memory(M.COUNT),
    )
