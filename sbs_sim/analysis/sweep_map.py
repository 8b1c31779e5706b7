"""Maps: trims and linear models over two parameters, each a condition of flight or a value of the aircraft file."""

from __future__ import annotations  # `help` then shows types by their names

import csv
import io
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sbs_sim import checks
from sbs_sim.aircraft import Aircraft
from sbs_sim.analysis.sweep import (
    CONDITIONS,
    Sweep,
    SweepPoint,
    check_parameter,
    checked_values,
    control_units,
    solve_points,
)
from sbs_sim.concurrency.parallel import Execution
from sbs_sim.errors import SweepError
from sbs_sim.flight.trim_point import Fidelity, TrimCondition
from sbs_sim.output.units import shown

Array = NDArray[np.float64]

POWER, MARGIN, GROWTH = "power", "control margin", "growth"


@dataclass(frozen=True)
class SweepMap:
    """Trims and linear models over two parameters.

    Attributes
    ----------
    other : str
        The second parameter; `sweeps[0].parameter` is the first.
    others : tuple of float
        Its values.
    rows : tuple of Sweep
        Along the first parameter, one for each value of the second.
    ranges : mapping of str to (float, float)
        Of the pilot controls by their names [rad, or their units].
    """

    other: str
    others: tuple[float, ...]
    rows: tuple[Sweep, ...]
    ranges: Mapping[str, tuple[float, float]] = field(hash=False)

    @property
    def parameter(self) -> str:
        """The first parameter."""
        return self.rows[0].parameter

    @property
    def points(self) -> tuple[SweepPoint, ...]:
        """Of all rows."""
        return tuple(point for row in self.rows for point in row.points)

    @cached_property
    def axes(self) -> tuple[tuple[Array, str], tuple[Array, str]]:
        """Values of both parameters as a person reads them, and their units."""
        unit = self.rows[0].unit(self.other)
        second = np.array(self.others)
        return self.rows[0].shown, shown(second, unit) if self.other in CONDITIONS else (second, unit)

    @cached_property
    def quantities(self) -> dict[str, tuple[Array, str]]:
        """What is mapped, by name, shape (n_others, n_values) with its unit; NaN where there is none.

        "power" of all rotors [W], "control margin", the least distance of a control to an end of its range over the
        range [%], pitch and roll [deg], the controls [deg, or their units], and where there are linear models "growth",
        the largest real part of a pole [1/s].
        """
        power = np.where(self.missing, math.nan, [row["power"].sum(axis=1) for row in self.rows])
        found = {POWER: (power, "W"), MARGIN: (self._margins(), "%")}
        for name in ("pitch", "roll", *self.ranges):
            found[name] = shown(np.array([row[name] for row in self.rows]), self.rows[0].unit(name))
        models = [[point.model for point in row.points] for row in self.rows]
        growth = np.array([[math.nan if one is None else one.poles.real.max() for one in row] for row in models])
        return found if np.isnan(growth).all() else found | {GROWTH: (growth, "1/s")}

    def _margins(self) -> Array:
        ends = [(row, name, low, high) for row in self.rows for name, (low, high) in self.ranges.items()]
        each = [np.minimum(row[name] - low, high - row[name]) / (high - low) for row, name, low, high in ends]
        parts = np.array(each).reshape(len(self.rows), len(self.ranges), -1)
        return np.asarray(100.0 * parts.min(axis=1))

    @cached_property
    def doubtful(self) -> NDArray[np.bool_]:
        """Where the model does not hold, or the flight is beyond a limit, shape (n_others, n_values)."""
        return np.array(
            [
                [p.trim is not None and bool(p.trim.warnings or p.trim.beyond_limits) for p in row.points]
                for row in self.rows
            ]
        )

    @cached_property
    def missing(self) -> NDArray[np.bool_]:
        """Where there is no trim, shape (n_others, n_values)."""
        return np.array([[point.trim is None for point in row.points] for row in self.rows])

    def to_csv(self) -> str:
        """A row for each point: both parameters, what is mapped, where the model does not hold, the error."""
        (_, first), (_, second) = self.axes
        names = [f"{name} [{unit}]" for name, (_, unit) in self.quantities.items()]
        file = io.StringIO()
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow([f"{self.parameter} [{first}]", f"{self.other} [{second}]", *names, "warnings", "error"])
        for (i, j), point in zip(np.ndindex(self.missing.shape), self.points, strict=True):
            values = (self.axes[0][0][j], self.axes[1][0][i], *(values[i, j] for values, _ in self.quantities.values()))
            cells = ["" if math.isnan(value) else repr(float(value)) for value in values]
            lines = () if point.trim is None else (*point.trim.warnings, *point.trim.beyond_limits)
            writer.writerow([*cells, "; ".join(lines), point.error or ""])
        return file.getvalue()


def sweep_map(
    aircraft: Aircraft,
    first: tuple[str, ArrayLike],
    second: tuple[str, ArrayLike],
    condition: TrimCondition | None = None,
    fidelity: Fidelity | None = None,
    execution: Execution | None = None,
    *,
    linear: bool = False,
) -> SweepMap:
    """Trim, and linearize, over two parameters.

    Parameters
    ----------
    aircraft : Aircraft
    first, second : (str, array_like)
        A parameter, see `sbs_sim.analysis.sweep.sweep`, and its values, rising or falling.
    condition : TrimCondition, optional
        Zero in what is swept.
    fidelity : Fidelity, optional
    execution : Execution, optional
        Threads or cluster.
    linear : bool
        Also the linear models.

    Raises
    ------
    SweepError
        See `sweep`; twice the same parameter.
    """
    checks.instance("aircraft", aircraft, Aircraft, SweepError)
    condition, fidelity, execution = condition or TrimCondition(), fidelity or Fidelity(), execution or Execution()
    (parameter, values), (other, others) = ((name, checked_values(given)) for name, given in (first, second))
    for name, numbers in ((parameter, values), (other, others)):
        check_parameter(aircraft, name, condition)
        if len(numbers) < 2 or not (np.all(np.diff(numbers) > 0.0) or np.all(np.diff(numbers) < 0.0)):
            raise SweepError(f"{name} = {checks.shown(numbers)}: allowed are two or more rising or falling numbers")
    if parameter == other:
        raise SweepError(f"parameter {other!r}: allowed is another one than the first")
    chosen = [{parameter: value, other: own} for own in others for value in values]
    points = solve_points(aircraft, chosen, condition, fidelity, execution, linear=linear)
    controls = control_units(aircraft)
    count = len(values)
    rows = [Sweep(parameter, tuple(points[i : i + count]), controls) for i in range(0, len(points), count)]
    ranges = {one.name: one.range for one in aircraft.controls if one.held is None}
    return SweepMap(other, tuple(others), tuple(rows), ranges)
