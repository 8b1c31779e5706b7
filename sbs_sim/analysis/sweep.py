"""Sweeps: trims and linear models along one parameter, on all cores or on a cluster.

Every point is solved for itself, from hover, so that neither the number of workers nor the other points change it.
"""

from __future__ import annotations  # `help` then shows types by their names

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sbs_sim import checks
from sbs_sim.aircraft import Aircraft
from sbs_sim.aircraft.paths import unit_of
from sbs_sim.analysis.export import model_to_dict
from sbs_sim.analysis.linear_model import LinearModel
from sbs_sim.analysis.linearize import linearize_trim
from sbs_sim.analysis.modes import Mode
from sbs_sim.analysis.trim import Guess, checked_guess, solve_trim
from sbs_sim.concurrency.parallel import Execution, compute
from sbs_sim.errors import AircraftError, SbsError, SweepError
from sbs_sim.flight.trim_point import Fidelity, TrimCondition, TrimPoint
from sbs_sim.flight.two_blades import has_two_blades
from sbs_sim.model import state as S
from sbs_sim.output.notebook import sweep_html
from sbs_sim.output.units import shown

if TYPE_CHECKING:
    import distributed

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

CONDITIONS = {"airspeed": "m/s", "climb_rate": "m/s", "sideslip": "rad", "turn_rate": "rad/s"}
ROTOR_LOADS = {"thrust": "N", "torque": "N m", "power": "W", "rotor_speed": "rad/s"}
ATTITUDE = dict.fromkeys(("pitch", "roll"), "rad")
QUANTITIES = {  # of a trim, beside attitude, controls and states
    **ROTOR_LOADS,
    **dict.fromkeys(("residual", "iterations"), "1"),
}
ALSO = {"psi": "rad", S.AIRSPEED: "m/s"}  # not among the columns of a table
CANCELLED = "cancelled"


@dataclass(frozen=True)
class SweepPoint:
    """One point of a sweep.

    Attributes
    ----------
    value : float
        Of the parameter.
    trim : TrimPoint or None
        None where there is no trim.
    model : LinearModel or None
        None where there is no trim, where linear models were not asked for, and of rotors with two blades.
    error : str or None
        Why something is missing, in one line; "cancelled" for what was not started.
    """

    value: float
    trim: TrimPoint | None
    model: LinearModel | None
    error: str | None

    @property
    def warnings(self) -> tuple[str, ...]:
        """Where the model does not hold in this flight, a line each, see `TrimPoint`; empty without a trim."""
        return () if self.trim is None else self.trim.warnings


@dataclass(frozen=True)
class Sweep:
    """Trims and linear models along one parameter.

    Attributes
    ----------
    parameter : str
        "airspeed" [m/s], "climb_rate" [m/s], "sideslip" [rad], "turn_rate" [rad/s], or the path of a value of the
        aircraft file, in its unit.
    points : tuple of SweepPoint
        In the order of the values.
    controls : mapping of str to str
        Units of the pilot controls by their names.
    """

    parameter: str
    points: tuple[SweepPoint, ...]
    controls: Mapping[str, str] = field(hash=False)

    @cached_property
    def values(self) -> Array:
        """Of the parameter, shape (n_points,)."""
        return np.array([point.value for point in self.points])

    @cached_property
    def shown(self) -> tuple[Array, str]:
        """Values of the parameter as a person reads them, and their unit: angles of the flight in degrees."""
        unit = self.unit(self.parameter)
        return shown(self.values, unit) if self.parameter in CONDITIONS else (self.values, unit)

    @property
    def has_free_speeds(self) -> bool:
        """Whether the speed of a rotor is a state, of a drive."""
        return any(f"{S.SPEED}(1)" in point.trim.state_names for point in self.points if point.trim is not None)

    @cached_property
    def failed(self) -> tuple[SweepPoint, ...]:
        """Points with an error."""
        return tuple(point for point in self.points if point.error is not None)

    @cached_property
    def warnings(self) -> tuple[tuple[str, ...], ...]:
        """Of each point, where the model does not hold."""
        return tuple(point.warnings for point in self.points)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """What `sweep[name]` knows beside "psi" and "V": attitude, controls, loads, residual, iterations, states."""
        states: dict[str, None] = {}
        for point in self.points:
            if point.trim is not None:
                states |= dict.fromkeys(point.trim.state_names)
        return (*ATTITUDE, *self.controls, *QUANTITIES, *states)

    def unit(self, name: str) -> str:
        """Unit of what `sweep[name]` has, and of the parameter; "1" for a plain number, empty where it is not known."""
        body = dict(zip(S.LINEAR_BODY_NAMES, S.LINEAR_BODY_UNITS, strict=True))
        known = CONDITIONS | ATTITUDE | dict(self.controls) | QUANTITIES | ALSO | body
        if name in known:
            return known[name]
        if name not in self.names:
            return unit_of(name)
        part = S.part_of(name)
        if part.family == "drive":
            return S.DRIVE_UNITS[name.partition("(")[0]]
        return "1" if part.family in ("inflow", "wake") else "rad/s" if part.is_rate else "rad"

    def __getitem__(self, name: str) -> Array:
        """Values of a name along the sweep, NaN where there is no trim.

        Parameters
        ----------
        name : str
            "pitch", "roll" [rad]; "residual", "iterations"; a linear state in its unit, "theta" and "phi" among them;
            a control, "psi", "V", "thrust", "torque", "power", "rotor_speed" as in `TrimPoint`.

        Returns
        -------
        ndarray, shape (n_points,), of thrust, torque, power and rotor speed (n_points, n_rotors)

        Raises
        ------
        KeyError
            There is none; the message lists those that there are.
        """
        if name not in (*self.names, *ALSO):
            raise KeyError(f"no {name!r}: there are {', '.join((*self.names, *ALSO))}")
        rows = [_quantity(point.trim, name) for point in self.points]
        if name in ROTOR_LOADS:
            return _filled(rows, max(len(row) for row in rows))
        return _filled(rows, 1)[:, 0]

    @cached_property
    def poles(self) -> ComplexArray:
        """All poles [rad/s], slowest first, shape (n_points, most states of a point); NaN where there are none."""
        poles = [np.empty(0, complex) if point.model is None else point.model.poles for point in self.points]
        return _filled(poles, max(len(row) for row in poles))

    @cached_property
    def modes(self) -> dict[str, tuple[Mode | None, ...]]:
        """Every mode along the sweep by its name: one for each point, None where there is none of that name.

        The names come from the states that take part in a mode, so they follow it where poles cross. The slowest first,
        by the median of the frequency.
        """
        named = [
            {} if point.model is None else {mode.name: mode for mode in point.model.modes} for point in self.points
        ]
        names = dict.fromkeys(name for point in named for name in point)
        tracks = {name: tuple(point.get(name) for point in named) for name in names}
        return dict(sorted(tracks.items(), key=lambda track: _median_frequency(track[1])))

    @cached_property
    def loci(self) -> dict[str, ComplexArray]:
        """Pole of every mode along the sweep by its name [rad/s], shape (n_points,); NaN where there is none."""
        missing = complex(math.nan, math.nan)
        return {
            name: np.array([mode.pole if mode else missing for mode in track]) for name, track in self.modes.items()
        }

    def to_dict(self) -> dict[str, Any]:
        """Everything as plain lists and numbers, for JSON; what there is none of is None."""
        points = [
            {
                "value": point.value,
                "error": point.error,
                "warnings": list(point.warnings),
                "trim": point.trim.to_dict() if point.trim else None,
                "model": model_to_dict(point.model, with_trim=False) if point.model else None,
            }
            for point in self.points
        ]
        return {"parameter": self.parameter, "points": points}

    def _repr_html_(self) -> str:
        return sweep_html(self)


Progress = Callable[[SweepPoint, int, int], None]


def sweep(
    aircraft: Aircraft,
    parameter: str,
    values: ArrayLike,
    *,
    airspeed: float | None = None,
    climb_rate: float | None = None,
    sideslip: float | None = None,
    turn_rate: float | None = None,
    lead_lag: bool = True,
    cyclic_inflow: bool = True,
    azimuth_count: int = 12,
    guess: Guess | None = None,
    linear: bool = True,
    workers: int | None = None,
    progress: Progress | None = None,
    cancelled: Callable[[], bool] | None = None,
    dask: str | distributed.Client | None = None,
) -> Sweep:
    """Trim, and linearize, along one parameter.

    Parameters
    ----------
    aircraft : Aircraft
    parameter : str
        "airspeed", "climb_rate", "sideslip", "turn_rate", or a path for `Aircraft.with_value`.
    values : array_like, shape (n_points,)
        Of the parameter, in any order; in the unit of `sbs_sim.trim` or of the aircraft file.
    airspeed, climb_rate, sideslip, turn_rate, lead_lag, cyclic_inflow, azimuth_count :
        See `sbs_sim.trim`, which has the defaults; the one that is the parameter must not be given.
    guess : TrimPoint, array_like or tuple, optional
        Where every point begins, see `sbs_sim.trim`.
    linear : bool
        False leaves the linear models out.
    workers : int, optional
        Number of threads, one for each core if not given. The results are the same for any number.
    progress : callable, optional
        Called with the point, the number of points done and that of all, in the calling thread, as each ends.
    cancelled : callable, optional
        Asked several times a second; after a True no further point is started, and the rest has the error "cancelled".
    dask : str or distributed.Client, optional
        Address of the scheduler of a dask cluster, "tcp://HOST:PORT", or a client: its workers solve the points in
        place of threads. The results are the same; workers with other versions are refused, and what a lost worker
        had to do is done again.

    Returns
    -------
    Sweep
        Also of points that fail, with their errors.

    Raises
    ------
    SweepError
        No values, one that is not finite, an unknown parameter, or one that is given a single value too; a number of
        workers that is no integer.
    TrimError
        A condition or fidelity out of range, or a guess that is none.
    ClusterError
        A cluster that cannot be reached, or that would not give the same.
    """
    parts = {"airspeed": airspeed, "climb_rate": climb_rate, "sideslip": sideslip, "turn_rate": turn_rate}
    given = {name: value for name, value in parts.items() if value is not None}
    if isinstance(parameter, str) and parameter in given:
        raise SweepError(f"{parameter} = {checks.shown(given[parameter])}: not allowed where {parameter} is swept")
    return sweep_flights(
        aircraft,
        parameter,
        values,
        TrimCondition(**given),
        Fidelity(lead_lag, cyclic_inflow, azimuth_count),
        Execution(workers, progress, cancelled, dask),
        guess=guess,
        linear=linear,
    )


def sweep_flights(
    aircraft: Aircraft,
    parameter: str,
    values: ArrayLike,
    condition: TrimCondition,
    fidelity: Fidelity,
    execution: Execution | None = None,
    *,
    guess: Guess | None = None,
    linear: bool = True,
) -> Sweep:
    """Trim, and linearize, along one parameter; see `sweep`. The condition is zero in what is swept."""
    checks.instance("aircraft", aircraft, Aircraft, SweepError)
    if guess is not None:
        checked_guess(aircraft, guess)
    numbers = checked_values(values)
    linear = checks.flag("linear", linear, SweepError)
    check_parameter(aircraft, parameter, condition)
    chosen = [{parameter: value} for value in numbers]
    points = solve_points(aircraft, chosen, condition, fidelity, execution or Execution(), guess=guess, linear=linear)
    return Sweep(parameter, tuple(points), control_units(aircraft))


def solve_points(
    aircraft: Aircraft,
    chosen: Sequence[Mapping[str, float]],
    condition: TrimCondition,
    fidelity: Fidelity,
    execution: Execution,
    *,
    guess: Guess | None = None,
    linear: bool,
) -> list[SweepPoint]:
    """Points side by side, each with what is chosen there; see `solve_point`."""
    threads, progress = execution.threads(SweepError), execution.progress
    points = [SweepPoint(next(iter(one.values())), None, None, CANCELLED) for one in chosen]
    done = itertools.count(1)

    def keep(i: int, point: SweepPoint) -> None:
        points[i] = point
        if progress is not None:
            progress(point, next(done), len(points))

    calls = [(aircraft, one, condition, fidelity, guess, linear) for one in chosen]
    compute(solve_point, calls, keep, execution, threads)
    return points


def control_units(aircraft: Aircraft) -> dict[str, str]:
    """Units of the controls by name."""
    return dict(zip(aircraft.control_names, aircraft.control_units, strict=True))


def checked_values(values: ArrayLike) -> list[float]:
    """Values of a parameter; SweepError where there are none, or one is not finite."""
    numbers = checks.array("values", values, SweepError)
    if numbers.ndim != 1 or numbers.size == 0:
        raise SweepError(f"values have the shape {numbers.shape}: allowed is a list of at least one number")
    if not np.isfinite(numbers).all():
        index = int(np.flatnonzero(~np.isfinite(numbers))[0])
        raise SweepError(f"values[{index}] = {numbers[index]}: allowed are finite numbers")
    return [float(value) for value in numbers]


def check_parameter(aircraft: Aircraft, parameter: str, condition: TrimCondition) -> None:
    """Raise SweepError for an unknown parameter, and one of which the condition has a value too."""
    checks.instance("parameter", parameter, str, SweepError)
    if parameter in CONDITIONS:
        if getattr(condition, parameter) != 0.0:
            value = checks.shown(getattr(condition, parameter))
            raise SweepError(f"{parameter} = {value}: not allowed where {parameter} is swept")
        return
    try:
        aircraft.value(parameter)
    except AircraftError as error:
        raise SweepError(f"parameter {parameter!r}: allowed are {', '.join(CONDITIONS)} or a path; {error}") from None


def solve_point(
    aircraft: Aircraft,
    chosen: Mapping[str, float],
    condition: TrimCondition,
    fidelity: Fidelity,
    guess: Guess | None,
    linear: bool,
) -> SweepPoint:
    """One point, with its error if there is one; its value is the first one chosen, and all are checked together."""
    value, point = next(iter(chosen.values())), None
    flown = {name: number for name, number in chosen.items() if name in CONDITIONS}
    changes = {name: number for name, number in chosen.items() if name not in CONDITIONS}
    try:
        condition = replace(condition, **flown)
        if changes:
            aircraft = aircraft.with_values(changes)
        point = solve_trim(aircraft, condition, fidelity, guess=guess)
        has_model = linear and not has_two_blades(aircraft)  # two blades have no constant one
        return SweepPoint(value, point, linearize_trim(aircraft, point) if has_model else None, None)
    except SbsError as error:
        return SweepPoint(value, point, None, str(error))


def _quantity(point: TrimPoint | None, name: str) -> Array:
    """Values of a name in a trim, shape (n,) with n = 1 for what is not of a rotor; empty without a trim."""
    if point is None:
        return np.empty(0)
    if name in point:
        return np.atleast_1d(np.asarray(point[name], dtype=float))
    return np.atleast_1d(np.asarray(getattr(point, name, []), dtype=float))


def _filled(rows: Sequence[NDArray[Any]], width: int) -> NDArray[Any]:
    """Rows of unequal lengths as one array, filled up with NaN."""
    result = np.full((len(rows), width), math.nan, dtype=rows[0].dtype)
    for target, row in zip(result, rows, strict=True):
        target[: len(row)] = row
    return result


def _median_frequency(track: Sequence[Mode | None]) -> float:
    return float(np.median([mode.frequency for mode in track if mode]))
