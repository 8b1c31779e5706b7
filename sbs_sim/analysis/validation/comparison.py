"""Rows and cases of a comparison with published results, and what is said of them."""

import math
import statistics
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

MET, MISSED, COMPARED = "met", "missed", "compared"


@dataclass(frozen=True)
class Aim:
    """How near ours shall be to what is published: within the larger of the two.

    Attributes
    ----------
    share : float
        Of the published value.
    absolute : float
        In the unit of the row.
    why : str
        Where the aim comes from: accuracy of the reading, scatter of the test, exactness of the equations.
    """

    share: float = 0.0
    absolute: float = 0.0
    why: str = ""

    def of(self, published: float) -> float:
        """Largest difference that meets the aim, in the unit of the row."""
        return max(self.share * abs(published), self.absolute)


@dataclass(frozen=True)
class Row:
    """One published value beside ours.

    Attributes
    ----------
    quantity, condition, unit : str
        What it is, at which point; "1" has no unit.
    published, ours : float
        Ours is NaN where the model has no solution.
    aim : Aim or None
        None where the value is compared, but not judged.
    remark : str
        What is said of this row alone.
    """

    quantity: str
    condition: str
    published: float
    ours: float
    unit: str
    aim: Aim | None = None
    remark: str = ""

    @property
    def difference(self) -> float:
        """Ours less published."""
        return self.ours - self.published

    @property
    def relative_difference(self) -> float:
        """Share of the published value; NaN where that is zero."""
        return self.difference / abs(self.published) if self.published else math.nan

    @property
    def allowed(self) -> float:
        """Largest difference that meets the aim; NaN without one."""
        return self.aim.of(self.published) if self.aim else math.nan

    @property
    def verdict(self) -> str:
        """MET, MISSED, or COMPARED where there is no aim."""
        if self.aim is None:
            return COMPARED
        return MET if abs(self.difference) <= self.allowed else MISSED


@dataclass(frozen=True)
class Table:
    """Values of this program without published ones beside them.

    Attributes
    ----------
    title : str
    conditions : tuple of str
        One of each column.
    rows : tuple of (str, str, tuple of float)
        Quantity, unit, and a value for each condition.
    """

    title: str
    conditions: tuple[str, ...]
    rows: tuple[tuple[str, str, tuple[float, ...]], ...]


@dataclass(frozen=True)
class Case:
    """What one source has published beside ours.

    Attributes
    ----------
    name, title, source : str
    statement : str
        Options of the model, and the way to the numbers.
    substitutes : tuple of str
        What the source does not give, and what stands for it: stated before the numbers.
    rows : tuple of Row
    remarks : tuple of str
        Why aims are not met, in physics, and what would move it.
    tables : tuple of Table
        What is computed without published values.
    """

    name: str
    title: str
    source: str
    statement: str
    substitutes: tuple[str, ...]
    rows: tuple[Row, ...]
    remarks: tuple[str, ...] = ()
    tables: tuple[Table, ...] = ()

    @property
    def verdict(self) -> str:
        """MISSED if one row is; MET if one is and none is missed."""
        return _verdict(self.rows)

    def count(self, verdict: str) -> int:
        """Number of rows with a verdict."""
        return sum(row.verdict == verdict for row in self.rows)


@dataclass(frozen=True)
class Report:
    """All cases that were computed, under one model."""

    model: str
    cases: tuple[Case, ...]

    @property
    def verdict(self) -> str:
        """MISSED if one case is."""
        return _verdict(row for case in self.cases for row in case.rows)

    def to_dict(self) -> dict[str, Any]:
        """Everything as numbers and texts; for JSON."""
        return {
            "model": self.model,
            "verdict": self.verdict,
            **_spread_entry(row for case in self.cases for row in case.rows),
            "cases": [_case_entry(case) for case in self.cases],
        }


def _verdict(rows: Iterable[Row]) -> str:
    """MISSED if one of the rows is; MET if one is and none is missed."""
    verdicts = {row.verdict for row in rows}
    return next((verdict for verdict in (MISSED, MET) if verdict in verdicts), COMPARED)


def compared(
    quantity: str, condition: str, published: float, ours: float, unit: str, aim: Aim | None = None, remark: str = ""
) -> Row:
    """A row, of numbers of any kind."""
    return Row(quantity, condition, float(published), float(ours), unit, aim, remark)


def spread(rows: Iterable[Row]) -> tuple[float, float]:
    """Median and worst of the relative differences, without sign; NaN where there are none.

    A row without a solution is farther off than any other: the worst is NaN then.
    """
    found = [abs(row.relative_difference) for row in rows if row.published]
    far = [math.inf if math.isnan(value) else value for value in found]
    return (_finite(statistics.median(far)), _finite(max(far))) if far else (math.nan, math.nan)


def _finite(value: float) -> float:
    return value if math.isfinite(value) else math.nan


def _spread_entry(rows: Iterable[Row]) -> dict[str, float]:
    median, worst = spread(rows)
    return {"median_relative_difference": median, "worst_relative_difference": worst}


def _case_entry(case: Case) -> dict[str, Any]:
    return {
        "name": case.name,
        "title": case.title,
        "source": case.source,
        "statement": case.statement,
        "substitutes": list(case.substitutes),
        "verdict": case.verdict,
        **_spread_entry(case.rows),
        "rows": [_row_entry(row) for row in case.rows],
        "remarks": list(case.remarks),
        "tables": [_table_entry(table) for table in case.tables],
    }


def _table_entry(table: Table) -> dict[str, Any]:
    rows = [{"quantity": name, "unit": unit, "values": list(values)} for name, unit, values in table.rows]
    return {"title": table.title, "conditions": list(table.conditions), "rows": rows}


def _row_entry(row: Row) -> dict[str, Any]:
    return {
        "quantity": row.quantity,
        "condition": row.condition,
        "published": row.published,
        "ours": row.ours,
        "unit": row.unit,
        "difference": row.difference,
        "relative_difference": row.relative_difference,
        "allowed": row.allowed,
        "aim": row.aim.why if row.aim else "",
        "verdict": row.verdict,
        "remark": row.remark,
    }
