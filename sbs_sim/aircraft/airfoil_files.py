"""Airfoil data of other programs: read C81, XFOIL, XFLR5, AeroDyn and CSV files, make one table of them, write C81.

Each reader gives polars as they are in the file. `table_of` makes a table of polars: it mirrors, extends, moves and
joins them, and says in words what it did.
"""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from sbs_sim.aircraft.airfoil_extension import METHODS
from sbs_sim.errors import AirfoilError
from sbs_sim.model.airfoil import (
    AXES,
    NUMBER_NAMES,
    POLAR_COLUMNS,
    AirfoilTable,
    Array,
    half_turn,
    parse_rows,
    read_text,
)

GRID_DEG = 0.1  # to which angles without a common step are moved
SAME_DEG = 1e-6
NAME_LENGTH = 60
MAX_NUMBERS = 99  # Mach numbers and angles of a C81 table: their counts have two digits
C81_ROW, C81_WIDTH = 9, 7  # values in a line behind the angle, and characters of each
CLOSED = 1e-3  # of lift and drag at -180 and 180 deg: larger differences are told


@dataclass(frozen=True)
class Polar:
    """Lift and drag over the angle of attack as a file has them.

    Attributes
    ----------
    alpha : ndarray, shape (n,)
        Angles of attack [deg], increasing.
    cl, cd : ndarray, shape (n,)
    numbers : dict of str to float
        Reynolds and Mach number by the names in `AXES`; what the file does not have is left out.
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


@dataclass(frozen=True)
class AirfoilData:
    """Content of a file: what kind of file it is, the name of the airfoil in it, the polars, and remarks."""

    kind: str
    name: str
    polars: tuple[Polar, ...]
    remarks: tuple[str, ...] = ()


def read_airfoil(path: str | Path) -> AirfoilData:
    """Read a file of a kind that its content tells.

    C81: lift and drag over Mach numbers, which need not be the same for both; moments are left out. XFOIL, XFLR5: one
    polar at a fixed Reynolds number. AeroDyn 15: tables of an airfoil file. CSV: as `sbs_sim.model.airfoil.read_table`,
    except that each block may have its own angles.

    Parameters
    ----------
    path : str or Path

    Raises
    ------
    AirfoilError
        One line: file, line, the value and what is allowed.
    """
    path = Path(path)
    text = read_text(path)
    lines = text.splitlines()
    content = next((line for line in lines if line.strip() and not line.lstrip().startswith("#")), "")
    if "alpha_deg" in content:
        return _read_csv(path, text)
    if any(re.search(r"\bNumAlf\b", line) for line in lines):
        return _read_aerodyn(path, lines)
    if any("Calculated polar for" in line for line in lines):
        return _read_xfoil(path, lines)
    if _c81_counts(lines[0] if lines else "") is not None:
        return _read_c81(path, lines)
    raise AirfoilError(
        f"{path}:1: {plain(content)!r} begins no airfoil file, allowed are C81, XFOIL or XFLR5 polars, AeroDyn 15"
        " airfoil files, and CSV with alpha_deg, cl and cd"
    )


def plain(text: str) -> str:
    """A text of a file in one line without control characters."""
    return "".join(c if c.isprintable() else "?" for c in " ".join(text.split()))[:NAME_LENGTH]


def _number(path: Path, line: int, what: str, text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value) or "_" in text:
        raise AirfoilError(f"{path}:{line}: {what} {plain(text)!r} must be a finite number")
    return value


def _polar(path: Path, line: int, rows: Sequence[Sequence[float]], numbers: dict[str, float]) -> Polar:
    """Polar of rows of angle, lift and drag in any order, of which an angle may be repeated."""
    if len(rows) < 3:
        raise AirfoilError(f"{path}:{line}: {len(rows)} angles must be at least 3")
    alpha, cl, cd = np.array(sorted(rows, key=lambda row: row[0]), dtype=np.float64).T
    kept = np.append(True, np.diff(alpha) > SAME_DEG)
    for name, number in numbers.items():
        if number < 0 or (name == "reynolds" and number == 0):
            least = "greater than 0" if name == "reynolds" else "0 or greater"
            raise AirfoilError(f"{path}:{line}: {NUMBER_NAMES[name]} {number:.10g} must be {least}")
    if np.abs(alpha).max() > 180 + SAME_DEG:
        raise AirfoilError(
            f"{path}:{line}: angle {alpha[np.abs(alpha).argmax()]:.10g} must be between -180 and 180 deg"
        )
    if cd.min() <= 0:
        i = int(cd.argmin())
        raise AirfoilError(f"{path}:{line}: cd {cd[i]:.10g} at {alpha[i]:.10g} deg must be greater than 0")
    return Polar(alpha[kept], cl[kept], cd[kept], numbers, f"{path}:{line}")


def _read_csv(path: Path, text: str) -> AirfoilData:
    columns, values, lines = parse_rows(path, text)
    starts = [0, *(np.flatnonzero(np.diff(values[:, 0])) + 1), len(values)]
    polars = []
    for first, end in pairwise(starts):
        numbers = {columns[0]: float(values[first, 0])} if columns[0] in AXES else {}
        polars.append(_polar(path, lines[first], values[first:end, 1:].tolist(), numbers))
    return AirfoilData("CSV", path.stem, tuple(polars))


# -- XFOIL, XFLR5 --------------------------------------------------------------------------------------


def _read_xfoil(path: Path, lines: Sequence[str]) -> AirfoilData:
    name, numbers, rows, begun = path.stem, dict[str, float](), list[list[float]](), 0
    for i, line in enumerate(lines, 1):
        if "Calculated polar for" in line:
            name = plain(line.partition(":")[2]) or name
        elif "Reynolds number" in line and "Reynolds number fixed" not in line:
            raise AirfoilError(f"{path}:{i}: {plain(line)!r} must be a polar at a fixed Reynolds number")
        elif found := re.search(r"Mach\s*=\s*(\S+)\s+Re\s*=\s*(\S+)\s*e\s*(\S+)", line):
            mach, mantissa, exponent = (_number(path, i, "Mach or Re", part) for part in found.groups())
            numbers = {"reynolds": mantissa * 10.0**exponent, "mach": mach}
        elif re.match(r"\s*alpha[\s,]+CL[\s,]+CD\b", line, re.IGNORECASE):
            begun = i
        elif begun and line.strip() and not set(line.strip()) <= set("- ,"):
            fields = line.replace(",", " ").split()
            if len(fields) < len(POLAR_COLUMNS):
                raise AirfoilError(f"{path}:{i}: {len(fields)} values must be at least 3: alpha, CL, CD")
            pairs = zip(POLAR_COLUMNS, fields, strict=False)
            rows.append([_number(path, i, what, field) for what, field in pairs])
    if not begun:
        raise AirfoilError(f"{path}:{len(lines)}: the file must have a line with alpha, CL and CD")
    if not numbers:
        raise AirfoilError(f"{path}:{begun}: a line with Mach = and Re = must stand above the polar")
    polar = _polar(path, begun, rows, numbers)
    repeated = len(rows) - len(polar.alpha)
    remarks = (f"{repeated} repeated angles left out",) if repeated else ()
    return AirfoilData("XFOIL polar", name, (polar,), remarks)


# -- AeroDyn -------------------------------------------------------------------------------------------


def _read_aerodyn(path: Path, lines: Sequence[str]) -> AirfoilData:
    """Tables behind the lines with NumAlf; values stand before their names, and Re is in millions."""
    polars, reynolds, ctrl, i = list[Polar](), math.nan, set[str](), 0
    while i < len(lines):
        fields = lines[i].split()
        label = fields[1] if len(fields) > 1 and not fields[0].startswith("!") else ""
        if label == "Re":
            reynolds = 1e6 * _number(path, i + 1, "Re", fields[0])
        elif label in ("UserProp", "Ctrl"):
            ctrl.add(fields[0])
        elif label == "NumAlf":
            count = int(_number(path, i + 1, "NumAlf", fields[0]))
            rows, end = _aerodyn_rows(path, lines, i + 1, count)
            numbers = {} if math.isnan(reynolds) else {"reynolds": reynolds}
            polars.append(_polar(path, i + 1, rows, numbers))
            i = end - 1
        i += 1
    if len(ctrl) > 1:
        raise AirfoilError(f"{path}:1: the tables have {len(ctrl)} control settings, allowed is one")
    return AirfoilData("AeroDyn airfoil file", path.stem, tuple(polars))


def _aerodyn_rows(path: Path, lines: Sequence[str], first: int, count: int) -> tuple[list[list[float]], int]:
    """Rows of a table, and the index of the line behind it."""
    rows, i = list[list[float]](), first
    while len(rows) < count:
        if i == len(lines):
            raise AirfoilError(f"{path}:{i}: the table ends after {len(rows)} of {count} lines")
        fields = lines[i].split()
        i += 1
        if not fields or fields[0].startswith("!"):
            continue
        if len(fields) < len(POLAR_COLUMNS):
            raise AirfoilError(f"{path}:{i}: {len(fields)} values must be at least 3: Alpha, Cl, Cd")
        pairs = zip(POLAR_COLUMNS, fields, strict=False)
        rows.append([_number(path, i, what, field) for what, field in pairs])
    return rows, i


# -- C81 -----------------------------------------------------------------------------------------------


def _c81_counts(line: str) -> list[int] | None:
    """Numbers of Mach numbers and angles of lift, drag and moment in the first line (A30, 6I2); None if it has none."""
    fixed = [line[30 + 2 * k : 32 + 2 * k].strip() for k in range(6)]
    for fields in (fixed, line.split()[-6:]):
        if len(fields) == 6 and all(field.isdecimal() for field in fields) and min(map(int, fields[:4])) > 0:
            return [int(field) for field in fields]
    return None


class _C81Lines:
    """Lines of a C81 file, read number by number: fields of seven characters, or any with blanks between them."""

    def __init__(self, path: Path, lines: Sequence[str]):
        self.path, self.lines, self.next = path, lines, 1

    def row(self, count: int, has_angle: bool) -> list[float]:
        """A row with `count` values behind an angle or without one, over as many lines as it takes."""
        found = list[float]()
        total = count + has_angle
        while len(found) < total:
            head = 1 if has_angle and not found else 0
            wanted = head + min(C81_ROW, total - len(found) - head)
            found += self._line(wanted, bool(head))
        return found

    def _line(self, wanted: int, has_angle: bool) -> list[float]:
        if self.next == len(self.lines):
            raise AirfoilError(f"{self.path}:{self.next}: the file ends where {wanted} numbers must follow")
        line, number = self.lines[self.next], self.next + 1
        self.next += 1
        fields = line.split()
        if len(fields) != wanted:
            begin = 0 if has_angle else C81_WIDTH
            fields = [line[begin + C81_WIDTH * k : begin + C81_WIDTH * (k + 1)].strip() for k in range(wanted)]
        return [_number(self.path, number, f"field {k}", field) for k, field in enumerate(fields, 1)]

    def block(self, mach_count: int, angle_count: int, what: str) -> tuple[Array, Array, Array]:
        """Mach numbers, angles [deg], and the coefficient, shape (Mach numbers, angles)."""
        line = self.next + 1
        mach = np.array(self.row(mach_count, has_angle=False))
        rows = np.array([self.row(mach_count, has_angle=True) for _ in range(angle_count)])
        for name, values in (("Mach numbers", mach), ("angles", rows[:, 0])):
            if np.any(np.diff(values) <= 0):
                wrong = values[int(np.flatnonzero(np.diff(values) <= 0)[0]) + 1]
                raise AirfoilError(f"{self.path}:{line}: the {name} of {what} must increase, not fall to {wrong:.10g}")
        return mach, rows[:, 0], rows[:, 1:].T


def _read_c81(path: Path, lines: Sequence[str]) -> AirfoilData:
    """Lift and drag on the Mach numbers and angles of both, between which the format is linear."""
    counts = _c81_counts(lines[0]) or []
    reader = _C81Lines(path, lines)
    lift_mach, lift_angles, lift = reader.block(counts[0], counts[1], "cl")
    drag_mach, drag_angles, drag = reader.block(counts[2], counts[3], "cd")
    mach, angles = np.union1d(lift_mach, drag_mach), np.union1d(lift_angles, drag_angles)
    angles = angles[(angles >= max(lift_angles[0], drag_angles[0])) & (angles <= min(lift_angles[-1], drag_angles[-1]))]
    lift = _on_grid(lift, (lift_mach, lift_angles), (mach, angles))
    drag = _on_grid(drag, (drag_mach, drag_angles), (mach, angles))
    polars = [
        _polar(path, 2, list(zip(angles, lift[i], drag[i], strict=True)), {"mach": float(number)})
        for i, number in enumerate(mach)
    ]
    remarks = ["moments left out"] if counts[5] else []
    if len(mach) > max(len(lift_mach), len(drag_mach)) or len(angles) > max(len(lift_angles), len(drag_angles)):
        remarks.append("lift and drag joined on the Mach numbers and angles of both, linear between them")
    return AirfoilData("C81 table", plain(lines[0][:30]) or path.stem, tuple(polars), tuple(remarks))


def _on_grid(values: Array, own: tuple[Array, Array], grid: tuple[Array, Array]) -> Array:
    along = np.array([np.interp(grid[1], own[1], row) for row in values])
    return np.array([np.interp(grid[0], own[0], column) for column in along.T]).T


def c81_text(table: AirfoilTable, name: str) -> tuple[str, float]:
    """Text of a C81 table, and the largest error of lift between its angles.

    A C81 table has at most 99 angles: of more, those are chosen with which linear interpolation is the nearest to the
    table. Coefficients have four decimals, three below -1. Moments are zero.

    Parameters
    ----------
    table : AirfoilTable
        Over the Mach number, or with a single number, which is written for Mach 0 and 1.
    name : str
        Name of the airfoil, of which 30 characters are written.

    Raises
    ------
    AirfoilError
        A table over several Reynolds numbers, or over more than 99 Mach numbers.
    """
    if table.axis != "mach" and len(table.numbers) > 1:
        raise AirfoilError(f"{table.name}: a C81 table is over the Mach number, must have one Reynolds number")
    single = len(table.numbers) == 1
    mach = np.array([0.0, 1.0]) if single else table.numbers
    cl, cd = (np.repeat(values, 2, axis=0) if single else values for values in (table.cl, table.cd))
    if len(mach) > MAX_NUMBERS:
        raise AirfoilError(f"{table.name}: {len(mach)} Mach numbers must be at most {MAX_NUMBERS}")
    angles = np.rint(table.alpha / np.pi * table.half) * 180 / table.half
    kept, errors = zip(*(_chosen(angles, values) for values in (cl, 5.0 * cd)), strict=True)
    moment = np.array([-180.0, 180.0])
    counts = [len(mach), len(kept[0]), len(mach), len(kept[1]), len(mach), len(moment)]
    lines = [plain(name).encode("ascii", "replace").decode()[:30].ljust(30) + "".join(f"{n:2d}" for n in counts)]
    for own, values in ((angles[kept[0]], cl[:, kept[0]]), (angles[kept[1]], cd[:, kept[1]])):
        lines += _c81_block(mach, own, values)
    lines += _c81_block(mach, moment, np.zeros((len(mach), 2)))
    return "\n".join(lines) + "\n", errors[0]


def _c81_block(mach: Array, angles: Array, values: Array) -> list[str]:
    lines = _c81_lines(" " * C81_WIDTH, mach)
    for angle, column in zip(angles, values.T, strict=True):
        lines += _c81_lines(f"{angle:7.2f}", column)
    return lines


def _c81_lines(head: str, values: Array) -> list[str]:
    fields = [_c81_field(float(value)) for value in values]
    lines = ["".join(fields[k : k + C81_ROW]) for k in range(0, len(fields), C81_ROW)]
    return [f"{head if k == 0 else ' ' * C81_WIDTH}{line}" for k, line in enumerate(lines)]


def _c81_field(value: float) -> str:
    """Number of seven characters that begins with a blank, so that programs that look for blanks read it, too."""
    for decimals in range(4, -1, -1):
        text = f"{value + 0.0:.{decimals}f}".replace("-0.", "-.")
        if len(text) < C81_WIDTH:
            return text.rjust(C81_WIDTH)
    raise AirfoilError(f"coefficient {value:.10g} must have at most 6 characters")


def _chosen(angles: Array, values: Array) -> tuple[list[int], float]:
    """At most 99 of the angles, by adding the one with the largest error until there is none, and what is left."""
    kept = [0, int(np.argmin(np.abs(angles))), len(angles) - 1]
    while True:
        guess = np.array([np.interp(angles, angles[kept], row[kept]) for row in values])
        errors = np.abs(guess - values).max(axis=0)
        if len(kept) == min(MAX_NUMBERS, len(angles)) or errors.max() < 1e-9:
            return kept, float(errors.max())
        kept = sorted({*kept, int(errors.argmax())})


# -- one table -----------------------------------------------------------------------------------------


def table_of(
    name: str, polars: Sequence[Polar], extension: str | None, aspect_ratio: float
) -> tuple[AirfoilTable, list[str]]:
    """One table of polars at several Reynolds numbers or at several Mach numbers.

    A polar of angles from 0 on without lift at 0 is mirrored. Those that do not go round the circle are extended, each
    from its own ends; without an extension all are cut to the angles that all have. Angles without a common step are
    moved to multiples of 0.1 deg, with the values on the lines between the points. All then get the angles of all.

    Parameters
    ----------
    name : str
    polars : sequence of Polar
    extension : str, optional
        One of `METHODS`; none if not given.
    aspect_ratio : float
        Blade length over chord, for the extension.

    Returns
    -------
    table : AirfoilTable
        Its angles end where the polars do if there is no extension.
    remarks : list of str
        What was done.

    Raises
    ------
    AirfoilError
        Polars that do not fit together, or cannot be extended.
    """
    axis, ordered = _ordered(polars)
    remarks = list[str]()
    ordered = [_on_common_step(_mirrored(polar, remarks), remarks) for polar in ordered]
    if extension is None:
        ordered = _cut(ordered, remarks)
    else:
        ordered = [_extended(polar, extension, aspect_ratio, remarks) for polar in ordered]
    ordered = [_closed(polar, remarks) for polar in ordered]
    angles = ordered[0].alpha
    for polar in ordered[1:]:
        angles = np.unique(np.round(np.concatenate([angles, polar.alpha]), 6))
    if any(len(polar.alpha) < len(angles) for polar in ordered):
        remarks.append(f"all polars given the {len(angles)} angles of all, on the lines between their own points")
    ordered = [_on_common_step(polar.at(angles), remarks) for polar in ordered]
    angles = ordered[0].alpha
    numbers = np.array([polar.numbers.get(axis, 0.0) for polar in ordered])
    half = half_turn(np.radians(angles))
    alpha = np.rint(angles / 180 * half) * (np.pi / half)
    cl, cd = np.array([polar.cl for polar in ordered]), np.array([polar.cd for polar in ordered])
    return AirfoilTable(name, numbers, alpha, cl, cd, axis=axis), list(dict.fromkeys(remarks))


def _ordered(polars: Sequence[Polar]) -> tuple[str, list[Polar]]:
    """What the polars are over, and the polars by that number."""
    varying = [axis for axis in AXES if len({polar.numbers.get(axis) for polar in polars}) > 1]
    if len(varying) > 1:
        raise AirfoilError(
            f"{polars[0].where}, {polars[1].where}: polars at several Reynolds and several Mach numbers, allowed is one"
            " of the two"
        )
    known = [axis for axis in AXES if axis in polars[0].numbers]
    axis = varying[0] if varying else (known or AXES)[0]
    for polar in polars:
        if varying and axis not in polar.numbers:
            raise AirfoilError(f"{polar.where}: has no {NUMBER_NAMES[axis]}, which other polars have")
    ordered = sorted(polars, key=lambda polar: polar.numbers.get(axis, 0.0))
    for one, other in pairwise(ordered):
        if one.numbers.get(axis) == other.numbers.get(axis):
            same = f"{NUMBER_NAMES[axis]} {one.numbers[axis]:.10g}" if axis in one.numbers else "no number"
            raise AirfoilError(f"{one.where}, {other.where}: two polars with {same}, allowed is one")
    return axis, ordered


def _mirrored(polar: Polar, remarks: list[str]) -> Polar:
    if polar.alpha[0] != 0.0 or polar.cl[0] != 0.0:
        return polar
    remarks.append("symmetric: mirrored to negative angles")
    alpha, cl, cd = (
        np.concatenate([sign * values[:0:-1], values])
        for sign, values in ((-1, polar.alpha), (-1, polar.cl), (1, polar.cd))
    )
    return replace(polar, alpha=alpha, cl=cl, cd=cd)


def _on_common_step(polar: Polar, remarks: list[str]) -> Polar:
    if half_turn(np.radians(polar.alpha)):
        return polar
    first, last = math.ceil(polar.alpha[0] / GRID_DEG - 1e-6), math.floor(polar.alpha[-1] / GRID_DEG + 1e-6)
    wanted = np.clip(np.rint(polar.alpha / GRID_DEG), first, last)
    angles = np.asarray(np.unique(wanted) / round(1 / GRID_DEG), dtype=np.float64)
    shift = float(np.abs(wanted * GRID_DEG - polar.alpha).max())
    moved = polar.at(angles)
    change = max(float(np.abs(moved.at(polar.alpha).cl - polar.cl).max()), 0.0)
    remarks.append(
        f"angles have no common step: moved to multiples of {GRID_DEG:g} deg by at most {shift:.2g} deg, which changes"
        f" lift by at most {change:.1g} where they were"
    )
    return moved


def _cut(polars: list[Polar], remarks: list[str]) -> list[Polar]:
    low, high = max(polar.alpha[0] for polar in polars), min(polar.alpha[-1] for polar in polars)
    kept = [polar.at(polar.alpha[(polar.alpha >= low) & (polar.alpha <= high)]) for polar in polars]
    if any(len(one.alpha) < len(other.alpha) for one, other in zip(kept, polars, strict=True)):
        remarks.append(f"cut to {low:g} to {high:g} deg, which all polars have")
    return kept


def _extended(polar: Polar, extension: str, aspect_ratio: float, remarks: list[str]) -> Polar:
    if polar.is_full:
        return polar
    low, high = float(polar.alpha[0]), float(polar.alpha[-1])
    if not -90 < low < 0 < high < 90:
        raise AirfoilError(
            f"{polar.where}: angles {low:g} to {high:g} deg must begin between -90 and 0 and end before 90"
        )
    try:
        alpha, cl, cd = METHODS[extension](np.radians(polar.alpha), polar.cl, polar.cd, aspect_ratio)
    except AirfoilError as error:
        raise AirfoilError(f"{polar.where}: {error}") from None
    if cd.min() <= 0:
        raise AirfoilError(f"{polar.where}: {extension} gives a drag of {cd.min():.4g}, must be greater than 0")
    number = ", ".join(f"{NUMBER_NAMES[axis]} {value:g}" for axis, value in polar.numbers.items())
    remarks.append(f"{number or 'polar'}: extended below {low:g} and above {high:g} deg by {extension}")
    return replace(polar, alpha=np.asarray(np.round(np.degrees(alpha), 6), np.float64), cl=cl, cd=cd)


def _closed(polar: Polar, remarks: list[str]) -> Polar:
    """Polar with equal values at -180 and 180 deg."""
    if not polar.is_full:
        return polar
    differences = abs(polar.cl[-1] - polar.cl[0]), abs(polar.cd[-1] - polar.cd[0])
    if max(differences) > CLOSED:
        remarks.append(f"values at -180 and 180 deg differed by up to {max(differences):.3g}: the mean is taken")
    cl, cd = polar.cl.copy(), polar.cd.copy()
    for values in (cl, cd):
        values[0] = values[-1] = 0.5 * (values[0] + values[-1])
    return replace(polar, cl=cl, cd=cd)


def at_reynolds(table: AirfoilTable, reynolds: float) -> AirfoilTable:
    """Table at one Reynolds number, linear between those of the table.

    Raises
    ------
    AirfoilError
        The table is not over the Reynolds number, or does not have it.
    """
    low, high = table.numbers[0], table.numbers[-1]
    if table.axis != "reynolds" or not low <= reynolds <= high:
        allowed = f"{low:g} to {high:g}" if table.axis == "reynolds" else "none, the table is over the Mach number"
        raise AirfoilError(f"Reynolds number {reynolds:g}: allowed is {allowed}")
    cl, cd = (
        np.array([[np.interp(reynolds, table.numbers, column) for column in values.T]])
        for values in (table.cl, table.cd)
    )
    return replace(table, numbers=np.array([reynolds]), cl=cl, cd=cd)
