"""Many flights at once, on all cores or on a cluster: other aircraft, starts, controls and winds in one call.

Every flight is what `simulate` would give, to the last bit, whatever number of threads or workers fly them.
"""

from __future__ import annotations  # `help` then shows types by their names

import inspect
import itertools
import math
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sbs_sim import checks
from sbs_sim.aircraft import Aircraft
from sbs_sim.analysis.trim import solve_trim, trim
from sbs_sim.concurrency.parallel import Execution, compute
from sbs_sim.content import ByContent
from sbs_sim.errors import BatchError, SbsError
from sbs_sim.flight.controller import Controller
from sbs_sim.flight.controls import Commands
from sbs_sim.flight.power_balance import POWER_BALANCE
from sbs_sim.flight.sortie import Sortie, fly_together
from sbs_sim.flight.trim_point import Fidelity, TrimCondition, TrimPoint
from sbs_sim.model import state as S
from sbs_sim.model.frames import euler_angles
from sbs_sim.model.packing import lane_count
from sbs_sim.model.power import POWER_TERMS
from sbs_sim.model.wind import Wind

if TYPE_CHECKING:
    import distributed

Array = NDArray[np.float64]
Start = TrimPoint | ArrayLike | TrimCondition | Mapping[str, Any]
Result = tuple[dict[str, Array], str | None, tuple[str, ...]]  # histories, error, warnings of a flight

LOADED = ("acceleration", "thrust", "torque", "power")  # which take a derivative at every row
GROUPS = ("state", "controls", "swashplate", *LOADED)
ALL_GROUPS = (*GROUPS, POWER_BALANCE)
OPTIONS = ("tick", "azimuth_step", "method", "ground_altitude", "actuators")
TRIM_ARGUMENTS = tuple(list(inspect.signature(trim).parameters)[1:])  # but the aircraft
CANCELLED = "cancelled"
MEMORY = 4e9  # bytes
MAX_TICKS = 10**10  # of the longest flight with the shortest tick


@dataclass(frozen=True, eq=False)
class Case(ByContent):
    """One flight of a batch.

    Parameters
    ----------
    aircraft : Aircraft
    start : TrimPoint, ndarray of shape (size,), TrimCondition or mapping
        See `sbs_sim.simulate`. In a TrimCondition the aircraft of this flight is trimmed, with the fidelity of the
        batch; a mapping holds arguments of `sbs_sim.trim`, {"airspeed": 15.0}.
    controls : array_like, callable or Controller, optional
        See `sbs_sim.simulate`; those of the trim if not given.
    wind : Wind
    changes : mapping
        Values for `Aircraft.with_values` by path, with which this aircraft differs: {"body.mass": 22.0}. They are
        made where the flight is flown. They must leave the number of rotors and blades alone.
    """

    aircraft: Aircraft
    start: Start
    controls: Commands | Controller | None = None
    wind: Wind = field(default_factory=Wind)
    changes: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Batch(ByContent):
    """Flights of a batch.

    Attributes
    ----------
    cases : tuple of Case
    time : ndarray, shape (n_rows,)
        [s]
    state_names : tuple of str
        Of the columns of "state": those of all aircraft, in the order in which they appear.
    histories : dict of str to ndarray
        What was asked for, by name, each with the shape (n_flights, n_rows, ...); see `simulate_batch`.
    errors : tuple of str or None
        Of each flight, why it ended early or did not begin, in one line; None for a complete flight. "cancelled" for
        what was not started.
    warnings : tuple of tuple of str
        Of each flight, where the model does not hold and what actuators would not do, see
        `sbs_sim.flight.history.History`.
    """

    cases: tuple[Case, ...]
    time: Array
    state_names: tuple[str, ...]
    histories: dict[str, Array] = field(repr=False)
    errors: tuple[str | None, ...]
    warnings: tuple[tuple[str, ...], ...]

    @cached_property
    def failed(self) -> tuple[int, ...]:
        """Numbers of the flights with an error."""
        return tuple(i for i, error in enumerate(self.errors) if error is not None)

    def __getitem__(self, name: str) -> Array:
        """History of a name, shape (n_flights, n_rows, ...); NaN after the end of a flight.

        With "state" also those of single states, and of "psi", "theta", "phi" [rad].

        Raises
        ------
        KeyError
            It was not asked for; the message lists what there is.
        """
        if name in self.histories:
            return self.histories[name]
        if "state" in self.histories and name in self.state_names:
            return self.histories["state"][:, :, self.state_names.index(name)]
        if "state" in self.histories and name in S.EULER_NAMES:
            attitude = self.histories["state"][:, :, S.ATTITUDE : S.VELOCITY]
            angles = euler_angles(attitude.reshape(-1, 4))[:, S.EULER_NAMES.index(name)]
            return angles.reshape(attitude.shape[:2])
        known = [*self.histories, *((*self.state_names, *S.EULER_NAMES) if "state" in self.histories else ())]
        raise KeyError(f"no {name!r}: there are {', '.join(known)}")

    def percentiles(self, name: str, shares: Sequence[float] = (5.0, 25.0, 50.0, 75.0, 95.0)) -> Array:
        """Percentiles over the flights that are in the air, shape (n_shares, n_rows, ...); NaN where there is none."""
        return percentiles(self[name], shares)


def percentiles(values: Array, shares: Sequence[float]) -> Array:
    """Percentiles of histories (n_flights, n_rows, ...) over the flights in the air, shape (n_shares, n_rows, ...)."""
    result = np.full((len(shares), *values.shape[1:]), math.nan)
    flying = ~np.isnan(values).all(axis=0)
    result[:, flying] = np.nanpercentile(values[:, flying], shares, axis=0)
    return result


@dataclass(frozen=True)
class Plan:
    """What all flights of a batch have in common."""

    duration: float
    fidelity: Fidelity
    every: int
    outputs: tuple[str, ...]
    options: dict[str, Any]


def simulate_batch(
    cases: Sequence[Case],
    duration: float,
    *,
    every: int = 1,
    outputs: Sequence[str] = GROUPS,
    lead_lag: bool = True,
    cyclic_inflow: bool = True,
    azimuth_count: int = 12,
    workers: int | None = None,
    progress: Callable[[int, int, int], None] | None = None,
    cancelled: Callable[[], bool] | None = None,
    dask: str | distributed.Client | None = None,
    memory: float = MEMORY,
    **options: Any,
) -> Batch:
    """Fly many flights at once.

    Parameters
    ----------
    cases : sequence of Case, length n_flights
    duration : float
        Of each flight [s], rounded to whole ticks.
    every : int
        Ticks from one row of the histories to the next: n_rows = n_ticks // every + 1. The rows are every so many of
        those of `sbs_sim.simulate`.
    outputs : sequence of str
        What to keep of "state" (n_flights, n_rows, n_states), "controls" (..., n_controls), "swashplate"
        (..., n_rotors, 3), "acceleration" (..., 3), "thrust", "torque", "power" (..., n_rotors), and of single states
        by their names (n_flights, n_rows). The four loads and accelerations take a derivative for every row. Aircraft
        with fewer rotors or other states have NaN there. Not by default there is "power_balance" (..., n_terms), where
        the power goes in the order of `sbs_sim.model.power.POWER_TERMS`, for one more derivative.
    lead_lag, cyclic_inflow, azimuth_count :
        Fidelity of the flights, and of the trims from which they start; see `sbs_sim.trim`.
    workers : int, optional
        Number of threads, one for each core if not given. The results are the same for any number.
    progress : callable, optional
        Called with the number of a flight, the number of flights done and that of all, in the calling thread, as
        each ends.
    cancelled : callable, optional
        Asked several times a second; after a True no further flight is started, and the rest has the error "cancelled".
    dask : str or distributed.Client, optional
        See `sbs_sim.sweep`.
    memory : float
        What the histories may take [bytes]. They are all that grows with the number of flights.
    **options
        tick, azimuth_step, method, ground_altitude, actuators: see `sbs_sim.simulate`.

    Returns
    -------
    Batch
        Also of flights that fail, with their errors; they disturb no others.

    Raises
    ------
    BatchError
        No flights, an unknown output, a value that is out of range, histories that need more memory: naming it.
    TrimError
        Fidelity out of range.
    ClusterError
        See `sbs_sim.sweep`.
    """
    fidelity = Fidelity(lead_lag, cyclic_inflow, azimuth_count)
    return simulate_cases(
        cases,
        duration,
        fidelity,
        Execution(workers, progress, cancelled, dask),
        every=every,
        outputs=outputs,
        memory=memory,
        **options,
    )


def simulate_cases(
    cases: Sequence[Case],
    duration: float,
    fidelity: Fidelity,
    execution: Execution | None = None,
    *,
    every: int = 1,
    outputs: Sequence[str] = GROUPS,
    memory: float = MEMORY,
    **options: Any,
) -> Batch:
    """Fly many flights at once; see `simulate_batch`."""
    plan = _plan(cases, duration, fidelity, every, outputs, options)
    execution = execution or Execution()
    threads, progress = execution.threads(BatchError), execution.progress
    rows = round(plan.duration / plan.options["tick"]) // plan.every + 1
    names = tuple(dict.fromkeys(name for case in cases for name in case.aircraft.layout.names))
    memory = checks.number("memory", memory, 0.0, 1e15, "bytes", BatchError)
    histories = _memory(cases, plan.outputs, rows, names, memory)
    errors: list[str | None] = [CANCELLED] * len(cases)
    warnings: list[tuple[str, ...]] = [()] * len(cases)
    done = itertools.count(1)

    def keep(i: int, result: Result) -> None:
        flown, errors[i], warnings[i] = result
        _fill(histories, i, flown, cases[i].aircraft.layout.names, names)
        if progress is not None:
            progress(i, next(done), len(cases))

    groups = _groups(cases, threads)
    calls = [(cases[group[0]].aircraft, [_flight(cases[i]) for i in group], plan) for group in groups]

    def keep_all(number: int, results: list[Result]) -> None:
        for i, result in zip(groups[number], results, strict=True):
            keep(i, result)

    compute(_fly, calls, keep_all, execution, threads)
    time = np.multiply(np.arange(rows) * plan.every, plan.options["tick"], dtype=float)
    return Batch(tuple(cases), time, names, histories, tuple(errors), tuple(warnings))


def _plan(
    cases: Sequence[Case],
    duration: float,
    fidelity: Fidelity,
    every: int,
    outputs: Sequence[str],
    options: dict[str, Any],
) -> Plan:
    """What the flights have in common, checked as far as it can be without an aircraft."""
    _check_cases(cases)
    duration = checks.number("duration", duration, 0.0, 1e6, "s", BatchError)
    checks.instance("fidelity", fidelity, Fidelity, BatchError)
    options["tick"] = checks.number("tick", options.get("tick", 0.01), 1e-4, 1.0, "s", BatchError)
    every = checks.integer("every", every, 1, MAX_TICKS, BatchError)
    unknown = [name for name in options if name not in OPTIONS]
    if unknown:
        raise BatchError(f"{unknown[0]}: unknown option, allowed are {', '.join((*OPTIONS, *asdict(fidelity)))}")
    known = {*ALL_GROUPS, *(name for case in cases for name in case.aircraft.layout.names)}
    checks.instance("outputs", outputs, Sequence, BatchError)
    for name in outputs:
        if not (isinstance(name, str) and name in known):
            raise BatchError(f"outputs: {checks.shown(name)}: allowed are {', '.join(ALL_GROUPS)} and names of states")
    return Plan(duration, fidelity, every, tuple(dict.fromkeys(outputs)), options)


def _check_cases(cases: Any) -> None:
    """Raise BatchError for what is no sequence of flights, and for what no flight can be made of."""
    checks.instance("cases", cases, Sequence, BatchError)
    if not len(cases):
        raise BatchError("cases: allowed is at least one flight")
    for i, case in enumerate(cases):
        checks.instance(f"cases[{i}]", case, Case, BatchError)
        for name, kind in (("aircraft", Aircraft), ("wind", Wind), ("changes", Mapping)):
            checks.instance(f"cases[{i}].{name}", getattr(case, name), kind, BatchError)


def _memory(
    cases: Sequence[Case], outputs: Sequence[str], rows: int, names: tuple[str, ...], memory: float
) -> dict[str, Array]:
    """Histories of nothing but NaN."""
    rotors = max(len(case.aircraft.rotors) for case in cases)
    sizes = {
        "state": (len(names),),
        "controls": (max(len(case.aircraft.controls) for case in cases),),
        "swashplate": (max(len(case.aircraft.rows) for case in cases), 3),
        "acceleration": (3,),
        **dict.fromkeys(("thrust", "torque", "power"), (rotors,)),
        POWER_BALANCE: (len(POWER_TERMS),),
    }
    shapes = {name: (len(cases), rows, *sizes.get(name, ())) for name in outputs}
    need = 8.0 * sum(math.prod(shape) for shape in shapes.values())
    if need > memory:
        raise BatchError(
            f"the histories of {len(cases)} flights with {rows} rows take {need / 1e9:.3g} GB: allowed by memory are"
            f" {memory / 1e9:.3g} GB; choose fewer outputs or a larger every"
        )
    return {name: np.full(shape, np.nan) for name, shape in shapes.items()}


def _fill(
    histories: dict[str, Array], i: int, flown: dict[str, Array], own: tuple[str, ...], names: tuple[str, ...]
) -> None:
    """Write down a flight, as far as it went."""
    places = [names.index(name) for name in own]
    for name, values in flown.items():
        target = histories[name][i, : len(values)]
        if name == "state":
            target[:, places] = values
        else:
            target[(slice(None), *map(slice, values.shape[1:]))] = values


def _groups(cases: Sequence[Case], workers: int) -> list[list[int]]:
    """Numbers of the cases that a worker takes at a time, of one aircraft: as many as lanes if all get some."""
    size = max(1, min(lane_count(), -(-len(cases) // workers)))
    groups: list[list[int]] = []
    for _, alike in itertools.groupby(range(len(cases)), key=lambda i: id(cases[i].aircraft)):
        numbers = list(alike)
        groups += [numbers[k : k + size] for k in range(0, len(numbers), size)]
    return groups


def _flight(case: Case) -> tuple[Any, ...]:
    """What a worker needs to know of a case beside its aircraft."""
    return case.start, case.controls, case.wind, dict(case.changes)


def _fly(aircraft: Aircraft, flights: Sequence[tuple[Any, ...]], plan: Plan) -> list[Result]:
    """What is asked for of some flights, their errors, and their warnings."""
    results: list[Result] = [({}, None, ())] * len(flights)
    sorties: dict[int, Sortie] = {}
    for i, flight in enumerate(flights):
        try:
            start, controls, wind, changes = flight
            sorties[i] = _sortie(aircraft, start, controls, wind, changes, plan)
        except SbsError as error:
            results[i] = {}, str(error), ()
    for numbers in _side_by_side(sorties):
        fly_together([sorties[i] for i in numbers])
        for i in numbers:
            results[i] = _result(sorties[i], plan)
    return results


def _side_by_side(sorties: Mapping[int, Sortie]) -> Iterator[list[int]]:
    """Flights of one structure together; few of them are faster one after the other."""
    alike: dict[Any, list[int]] = defaultdict(list)
    for i, sortie in sorties.items():
        alike[sortie.structure].append(i)
    for numbers in alike.values():
        if 2 * len(numbers) > lane_count():
            yield numbers
        else:
            yield from ([i] for i in numbers)


def _sortie(
    aircraft: Aircraft,
    start: Start,
    controls: Commands | Controller | None,
    wind: Wind,
    changes: dict[str, Any],
    plan: Plan,
) -> Sortie:
    """A flight that is ready to begin.

    Raises
    ------
    SbsError
        It cannot begin.
    """
    layout = aircraft.layout
    if changes:
        aircraft = aircraft.with_values(changes)
    if aircraft.layout != layout:
        raise BatchError(f"changes = {changes}: allowed are those that leave the states as they are")
    fidelity = plan.fidelity
    if isinstance(start, TrimCondition):
        start = solve_trim(aircraft, start, fidelity)
    elif isinstance(start, Mapping):
        if unknown := [name for name in start if name not in TRIM_ARGUMENTS]:
            name = checks.shown(unknown[0])
            raise BatchError(f"start: {name}: unknown, allowed are {', '.join(TRIM_ARGUMENTS)}")
        start = trim(aircraft, **{**asdict(fidelity), **start})
    if controls is None:
        if not isinstance(start, TrimPoint):
            raise BatchError("controls: needed where the start is a state")
        controls = start.controls
    balanced = POWER_BALANCE in plan.outputs
    loaded = balanced or any(name in LOADED for name in plan.outputs)
    return Sortie(
        aircraft,
        start,
        controls,
        plan.duration,
        every=plan.every,
        loaded=loaded,
        balanced=balanced,
        wind=wind,
        lead_lag=fidelity.lead_lag,
        cyclic_inflow=fidelity.cyclic_inflow,
        **plan.options,
    )


def _result(sortie: Sortie, plan: Plan) -> Result:
    """What is asked for of a flight that has ended, its error, and its warnings."""
    try:
        flown, fault = sortie.result()
    except SbsError as error:
        return {}, str(error), ()
    kept = {name: flown[name] for name in plan.outputs if name in flown}
    return kept, str(fault) if fault else None, flown.warnings
