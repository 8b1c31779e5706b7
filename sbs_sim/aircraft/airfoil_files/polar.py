"""Polars as files of other programs have them, and the numbers and texts in such files."""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from sbs_sim.content import ByContent
from sbs_sim.errors import AirfoilError
from sbs_sim.model.airfoil import NUMBER_NAMES, POLAR_COLUMNS, Array

SAME_DEG = 1e-6
MAX_COEFFICIENT = 100.0  # lift and drag of an airfoil are far below
TEXT_LENGTH = 60
NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([ed][+-]?\d+)?", re.IGNORECASE | re.ASCII)


@dataclass(frozen=True, eq=False)
class Polar(ByContent):
    """Lift and drag over the angle of attack as a file has them.

    Attributes
    ----------
    alpha : ndarray, shape (n,)
        Angles of attack [deg], increasing.
    cl, cd : ndarray, shape (n,)
    numbers : dict of str to float
        Reynolds and Mach number by the names in `sbs_sim.model.airfoil.AXES`; those that the file lacks are left out.
    where : str
        File and line, for messages.
    """

    alpha: Array
    cl: Array
    cd: Array
    numbers: dict[str, float]
    where: str

    def at(self, alpha: Array) -> "Polar":
        """Polar at other angles [deg], on the lines between the points."""
        cl, cd = np.interp(alpha, self.alpha, self.cl), np.interp(alpha, self.alpha, self.cd)
        return replace(self, alpha=alpha, cl=cl, cd=cd)

    @property
    def is_full(self) -> bool:
        """It has all angles from -180 to 180 deg."""
        return bool(self.alpha[0] <= -180 + SAME_DEG and self.alpha[-1] >= 180 - SAME_DEG)

    @property
    def number(self) -> str:
        """Reynolds and Mach number in words."""
        return ", ".join(f"{NUMBER_NAMES[axis]} {value:g}" for axis, value in self.numbers.items()) or "polar"


@dataclass(frozen=True)
class AirfoilData:
    """Content of a file: the kind of the file, the name of the airfoil in it, the polars, and remarks."""

    kind: str
    name: str
    polars: tuple[Polar, ...]
    remarks: tuple[str, ...] = ()


class Row(NamedTuple):
    """Line of a polar: its number in the file, angle of attack [deg], lift, drag."""

    line: int
    alpha: float
    cl: float
    cd: float


def make_polar(path: Path, line: int, rows: Sequence[Row], numbers: dict[str, float]) -> tuple[Polar, int]:
    """Polar of rows in any order, and how many of them were left out, since their angle is repeated.

    Parameters
    ----------
    path : Path
    line : int
        Where the polar begins.
    rows : sequence of Row
    numbers : dict of str to float
        See `Polar`.

    Raises
    ------
    AirfoilError
        Fewer than three angles, or a value out of range: file, line, value, allowed range.
    """
    for axis, number in numbers.items():
        if number < 0 or (axis == "reynolds" and number == 0):
            least = "greater than 0" if axis == "reynolds" else "0 or greater"
            raise AirfoilError(f"{path}:{line}: {NUMBER_NAMES[axis]} {number:.10g} must be {least}")
    for row in rows:
        check_values(path, row.line, row.alpha, cl=row.cl, cd=row.cd)
    ordered = sorted(rows, key=lambda row: row.alpha)
    if not ordered or ordered[-1].alpha - ordered[0].alpha <= 2 * SAME_DEG:
        raise AirfoilError(f"{path}:{line}: the polar has {len(rows)} angles, must have at least 3")
    alpha, cl, cd = np.array([row[1:] for row in ordered], dtype=np.float64).T
    kept = np.append(True, np.diff(alpha) > SAME_DEG)
    if kept.sum() < 3:
        raise AirfoilError(f"{path}:{line}: the polar has {kept.sum()} angles, must have at least 3")
    return Polar(alpha[kept], cl[kept], cd[kept], numbers, f"{path}:{line}"), int(len(rows) - kept.sum())


def check_values(path: Path, line: int, alpha: float, *, cl: float = 0.0, cd: float = 1.0) -> None:
    """Raise an `AirfoilError` for an angle or a coefficient that is out of range."""
    if abs(alpha) > 180 + SAME_DEG:
        raise AirfoilError(f"{path}:{line}: angle {alpha:.10g} must be between -180 and 180 deg")
    if abs(cl) > MAX_COEFFICIENT:
        limits = f"between {-MAX_COEFFICIENT:g} and {MAX_COEFFICIENT:g}"
        raise AirfoilError(f"{path}:{line}: cl {cl:.10g} at {alpha:.10g} deg must be {limits}")
    if not 0 < cd <= MAX_COEFFICIENT:
        limits = f"greater than 0 and at most {MAX_COEFFICIENT:g}"
        raise AirfoilError(f"{path}:{line}: cd {cd:.10g} at {alpha:.10g} deg must be {limits}")


def parse_row(path: Path, line: int, fields: Sequence[str]) -> Row:
    """Row of a line, the first three fields of which are angle, lift and drag."""
    if len(fields) < len(POLAR_COLUMNS):
        raise AirfoilError(f"{path}:{line}: {len(fields)} values must be at least 3: angle, lift, drag")
    pairs = zip(POLAR_COLUMNS, fields, strict=False)
    return Row(line, *(parse_number(f"{path}:{line}", what, field) for what, field in pairs))


def parse_number(where: str, what: str, text: str) -> float:
    """Number of a field, of which the exponent may be that of Fortran's double precision, as in 1.2D-3."""
    value = to_number(text)
    if value is None:
        raise AirfoilError(f"{where}: {what} {plain(text)!r} must be a finite number")
    return value


def to_number(text: str) -> float | None:
    """Number of a text, none if it is not a finite one."""
    text = text.strip()
    if not NUMBER.fullmatch(text):
        return None
    value = float(text.lower().replace("d", "e"))
    return value if math.isfinite(value) else None


def plain(text: str) -> str:
    """A text of a file in one line without control characters, cut to a length for messages."""
    return "".join(c if c.isprintable() else "?" for c in " ".join(text.split()))[:TEXT_LENGTH]
