"""Section lift and drag over Reynolds or Mach number and angle of attack (theory.md section 4).

A table holds cl and cd on a full grid of Reynolds or Mach numbers and angles from -180 to 180 deg. Compiled code
reads it as an array of cells, two cache lines per cell with the coefficients of the interpolation, laid out over three
turns of the angle so that nothing has to be wrapped.
"""

from __future__ import annotations  # `help` then shows types by their names

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sbs_sim.content import ByContent
from sbs_sim.errors import AirfoilError
from sbs_sim.model.cubics import bounded_slopes
from sbs_sim.model.elementary import cosine_and_sine

Array = NDArray[np.float64]

POLAR_COLUMNS = ("alpha_deg", "cl", "cd")
AXES = ("reynolds", "mach")  # what a table may be over, besides the angle
COLUMNS = (*((axis, *POLAR_COLUMNS) for axis in AXES), POLAR_COLUMNS)
HEADERS = " or ".join(",".join(columns) for columns in COLUMNS)
PLATE_DRAG, PLATE_DRAG_SLOPE = 1.11, 0.018  # of a blade broadside on: at no aspect ratio, and by aspect ratio
INFINITE_BLADE = 50.0  # aspect ratio from which it is that of an infinite plate, 2.01
REFLECTED_LIFT = -0.7  # cl of the reversed airfoil over cl of the airfoil at the mirrored angle
TURNS = 3  # turns of the angle that the cells cover: -540..540 deg
MIN_STEP_DEG, MAX_STEP_DEG = 0.01, 10.0
MAX_FAR_STEP_DEG, FAR_DEG = 45.0, 30.0  # between angles of which one is beyond FAR_DEG
STEP_TOLERANCE = 0.01  # of a step, for angles that were rounded in the file
FINEST_DEG, ROUNDING_DEG = 0.05, 0.001  # of the common step of uneven angles
MAX_HALF = round(180 / FINEST_DEG)
MAX_BYTES = 20_000_000  # of a file: a table of 0.05 deg has a quarter of a megabyte for each number
ATTACHED = math.radians(5.0)  # from the angle of no lift: so far the flow is taken to be attached
SEPARATED = 0.5  # of the lift of attached flow: below, the flow has left the section


@dataclass(frozen=True, eq=False)
class AirfoilTable(ByContent):
    """Lift and drag coefficients of one airfoil over the full circle.

    Attributes
    ----------
    name : str
    numbers : ndarray, shape (n,)
        Reynolds or Mach numbers, increasing; a table with one number holds for all.
    alpha : ndarray, shape (n_alpha,)
        Angles of attack [rad] from -pi to pi, multiples of one step that divides pi.
    cl, cd : ndarray, shape (n, n_alpha)
        Lift and drag coefficient; the values at -pi and pi are equal.
    given : (float, float)
        Lowest and highest angle that was not made by `extend_polar` [rad].
    axis : str
        One of `AXES`: what `numbers` are.
    """

    name: str
    numbers: Array
    alpha: Array
    cl: Array
    cd: Array
    given: tuple[float, float] = (-math.pi, math.pi)
    axis: str = "reynolds"

    @cached_property
    def half(self) -> int:
        """Steps in 180 deg of the coarsest even grid that has all angles."""
        return half_turn(self.alpha)

    @property
    def intervals(self) -> Array:
        """Steps between an angle and the next."""
        return np.rint(np.diff(self.alpha) / (np.pi / self.half))

    @cached_property
    def zero_lift_angle(self) -> float:
        """Angle of attack without lift [rad] at the middle one of its numbers, that nearest to zero."""
        lift = self.cl[len(self.numbers) // 2]
        rises = np.flatnonzero((lift[:-1] <= 0.0) & (lift[1:] > 0.0))
        if not len(rises):
            return 0.0
        share = lift[rises] / (lift[rises] - lift[rises + 1])
        angles = self.alpha[rises] + share * (self.alpha[rises + 1] - self.alpha[rises])
        return float(angles[np.argmin(np.abs(angles))])

    @cached_property
    def stall(self) -> Array:
        """What `sbs_sim.Aircraft.stall_table` has of it, shape (10, n)."""
        ends, (highest, lowest) = (np.full(len(self.numbers), end) for end in self.range), stall_angles(self)
        limits = [
            [np.interp(angle, self.alpha, cl) for angle, cl in zip(angles, self.cl, strict=True)]
            for angles in (lowest, highest)
        ]
        widths = np.concatenate([[0.0], 1.0 / np.diff(self.numbers)])
        return np.array([self.numbers, highest, lowest, *ends, *attached_lift(self), *limits, widths])

    @property
    def knots(self) -> Array:
        """Numbers between which the compiled model interpolates, at least two."""
        return self.numbers if len(self.numbers) > 1 else np.array([0.0, 1.0])

    @property
    def range(self) -> tuple[float, float]:
        """Least and largest number for which the table holds."""
        return (float(self.numbers[0]), float(self.numbers[-1])) if len(self.numbers) > 1 else (0.0, math.inf)


def half_turn(alpha: Array) -> int:
    """Steps in 180 deg of the coarsest even grid that has all angles [rad]; 0 if there is none.

    Uneven angles must be multiples of `FINEST_DEG`. Even ones that were rounded may be off by a hundredth of their
    step, uneven ones by a thousandth of a degree.
    """
    angles = np.degrees(alpha)
    step = (angles[-1] - angles[0]) / (len(angles) - 1)
    half = max(1, round(float(180 / step)))
    if np.all(np.abs(np.diff(angles) - step) <= STEP_TOLERANCE * step) and _are_multiples(angles, half, STEP_TOLERANCE):
        return half
    for half in (number for number in range(1, MAX_HALF + 1) if MAX_HALF % number == 0):
        if _are_multiples(angles, half, ROUNDING_DEG / 180 * half):
            return half
    return 0


def _are_multiples(angles: Array, half: int, tolerance: float) -> bool:
    """True if all angles [deg] are multiples of 180 deg / half within a tolerance in steps, and no two are the same."""
    steps = angles / 180 * half
    return bool(np.all(np.abs(steps - np.rint(steps)) <= tolerance) and np.all(np.diff(np.rint(steps)) > 0))


def stall_angles(table: AirfoilTable) -> tuple[Array, Array]:
    """Angles of attack of maximum and minimum lift of attached flow: beyond them a section is stalled.

    The flow is attached from the angle of no lift on as long as there is more than half of the lift that the slope
    there gives; so neither dents and plateaus of the curve are stall, nor is the second rise of lift that a plate has
    towards 45 deg its maximum lift. Angles that `extend_polar` has added are stalled. A section without
    lift never stalls.

    Parameters
    ----------
    table : AirfoilTable

    Returns
    -------
    highest, lowest : ndarray, shape (n,)
        For each Reynolds or Mach number of the table [rad]. Of several angles of equal lift the one nearest to zero.

    References
    ----------
    theory.md section 6.1. A plate whose flow is attached up to a share f of its chord has, after Kirchhoff, the lift of
    attached flow times ((1 + sqrt f) / 2)^2, half of it at f = 0.17: J. G. Leishman, T. S. Beddoes, A semi-empirical
    model for dynamic stall, Journal of the American Helicopter Society 34 (3), 1989.
    """
    lowest, highest = table.given
    above = [_max_lift_angle(table.alpha, cl) for cl in table.cl]
    below = [_max_lift_angle(0.0 - table.alpha[::-1], -cl[::-1]) for cl in table.cl]
    return np.minimum(above, highest), -np.minimum(below, -lowest)


def attached_lift(table: AirfoilTable) -> tuple[Array, Array]:
    """Slope [1/rad] and angle without lift [rad] of attached flow, each of shape (n,), by the curve around zero."""
    lines = [_attached_line(table.alpha, cl) for cl in table.cl]
    slopes = np.array([max(slope, 0.0) for slope, _, _ in lines])
    angles = np.array([-at_zero / slope if slope > 0.0 else 0.0 for slope, at_zero, _ in lines])
    return slopes, angles


def _attached_line(alpha: Array, cl: Array) -> tuple[float, float, float]:
    """Slope of the lift around zero [1/rad], lift there, and the angle up to which they are fitted [rad]."""
    middle = int(np.argmin(np.abs(alpha)))
    attached = max(ATTACHED, 1.5 * (alpha[middle + 1] - alpha[middle]), 1.5 * (alpha[middle] - alpha[middle - 1]))
    near = np.abs(alpha) < attached
    slope, at_zero = np.polyfit(alpha[near], cl[near], 1)
    return float(slope), float(at_zero), float(attached)


def _max_lift_angle(alpha: Array, cl: Array) -> float:
    """Angle of maximum lift of attached flow, upwards from 0 [rad]; pi where there is no lift."""
    middle = int(np.argmin(np.abs(alpha)))
    slope, at_zero, attached = _attached_line(alpha, cl)
    if slope <= 0.0:
        return math.pi
    angles, lift = alpha[middle:], cl[middle:]
    linear = at_zero + slope * angles
    is_attached = (linear < slope * attached) | (lift >= SEPARATED * linear)
    end = int(np.argmin(np.append(is_attached, False)))
    return float(angles[np.argmax(lift[:end])])


def viterna(
    alpha: ArrayLike, alpha_stall: float, cl_stall: float, cd_stall: float, aspect_ratio: float
) -> tuple[Array, Array]:
    """Lift and drag of a stalled airfoil.

    Up to 90 deg the formulas of Viterna and Corrigan, which pass through the given stall point. Past 90 deg
    the airfoil is reversed: the curves are reflected, lift with the factor -0.7. Within alpha_stall of 180
    deg the reversed airfoil is not stalled: lift is linear through zero at 180 deg, and drag keeps its
    stall value, for the formula would fall below zero there. cl is odd and cd even in alpha; both are
    continuous, and cd is positive.

    Parameters
    ----------
    alpha : array_like
        Angles of attack [rad] in -pi..pi, beyond stall; nearer to zero the stall values are returned.
    alpha_stall : float
        Angle [rad] of the stall point, between 0 and pi/2.
    cl_stall, cd_stall : float
        Coefficients at the stall point.
    aspect_ratio : float
        Blade length over chord, which sets the drag of the blade broadside on: 1.11 + 0.018 of it up to 50, 2.01 above.

    Returns
    -------
    cl, cd : ndarray, same shape as alpha

    References
    ----------
    theory.md section 4. L. A. Viterna, R. D. Corrigan: Fixed pitch rotor performance of large horizontal axis
    wind turbines, NASA CP-2230, 1982. Reflection as in AirfoilPrep (National Renewable Energy Laboratory).
    """
    magnitude = np.abs(np.asarray(alpha, dtype=np.float64))
    is_reversed = magnitude > np.pi / 2
    folded = np.where(is_reversed, np.pi - magnitude, magnitude)
    stalled = np.maximum(folded, alpha_stall)
    # rounded right: the aircraft is the same on every machine, and known again by its hash
    cosine, sine = (
        np.reshape(part, stalled.shape) for part in zip(*map(cosine_and_sine, stalled.ravel()), strict=True)
    )
    cosine_s, sine_s = cosine_and_sine(alpha_stall)
    cd_max = PLATE_DRAG + PLATE_DRAG_SLOPE * min(aspect_ratio, INFINITE_BLADE)
    a2 = (cl_stall - cd_max * sine_s * cosine_s) * sine_s / (cosine_s * cosine_s)
    b2 = (cd_stall - cd_max * (sine_s * sine_s)) / cosine_s
    cl = cd_max * sine * cosine + a2 * (cosine * cosine) / sine
    cd = cd_max * (sine * sine) + b2 * cosine
    cl = np.where(is_reversed, REFLECTED_LIFT * cl * folded / stalled, cl)
    return np.sign(alpha) * cl, cd


def extend_polar(alpha: ArrayLike, cl: ArrayLike, cd: ArrayLike, aspect_ratio: float) -> tuple[Array, Array, Array]:
    """Extend a polar to the full circle by `viterna` from its last point on either side.

    Parameters
    ----------
    alpha : array_like, shape (n,)
        Angles of attack [rad], multiples of one step that divides pi, from -pi/2..0 to 0..pi/2 (ends
        excluded); they need not be even.
    cl, cd : array_like, shape (n,)
        Lift and drag coefficient.
    aspect_ratio : float
        Blade length over chord.

    Returns
    -------
    alpha, cl, cd : ndarray, shape (n_alpha,)
        From -pi to pi, beyond the given angles with the common step of these; cl and cd are equal at both ends.
    """
    alpha, cl, cd = (np.asarray(values, dtype=np.float64) for values in (alpha, cl, cd))
    circle, first = circle_of(alpha)
    last = first + len(alpha) - 1
    low, high = -circle[first], circle[last]
    below = viterna(circle[:first], low, -cl[0], cd[0], aspect_ratio)
    above = viterna(circle[last + 1 :], high, cl[-1], cd[-1], aspect_ratio)
    circle_cl = np.concatenate([below[0], cl, above[0]])
    circle_cd = np.concatenate([below[1], cd, above[1]])
    # The two sides of a cambered airfoil would meet at 180 deg with unequal drag: pass from one to the other.
    past_180 = np.where(circle > 0, circle - np.pi, circle + np.pi)
    unstalled = (np.abs(circle) > np.pi / 2) & (past_180 > -high) & (past_180 < low)
    circle_cd[unstalled] = cd[-1] + (past_180[unstalled] + high) * ((cd[0] - cd[-1]) / (low + high))
    return np.asarray(circle, np.float64), circle_cl, circle_cd


def circle_of(alpha: Array) -> tuple[Array, int]:
    """Angles from -pi to pi [rad], beyond given ones with their common step, and the index of the first given one."""
    half = half_turn(alpha)
    circle = np.arange(-half, half + 1) * (np.pi / half)
    kept = half + np.rint(alpha / np.pi * half).astype(np.int64)
    return np.concatenate([circle[: kept[0]], circle[kept], circle[kept[-1] + 1 :]]), int(kept[0])


def read_table(path: str | Path, aspect_ratio: float) -> AirfoilTable:
    """Read an airfoil table from a CSV file.

    The file has the header `reynolds,alpha_deg,cl,cd` or `mach,alpha_deg,cl,cd` and a full grid: one block of rows for
    each Reynolds or Mach number, in increasing order, each with the same angles; or the header `alpha_deg,cl,cd` and
    one block, for all numbers. Lines that begin with '#' are comments. The angles run from -180 to 180 deg, or over an
    attached range around zero that `extend_polar` completes. They are even in a step that divides 180 deg, or multiples
    of 0.05 deg.

    Parameters
    ----------
    path : str or Path
    aspect_ratio : float
        Blade length over chord, used where the table has to be extended.

    Returns
    -------
    AirfoilTable
        Named after the file.

    Raises
    ------
    AirfoilError
        With one line: file, line, column, the value and what is allowed.
    """
    path = Path(path)
    return parse_table(path, read_text(path), aspect_ratio)


def parse_table(path: Path, text: str, aspect_ratio: float) -> AirfoilTable:
    """Airfoil table of the text of a file, see `read_table`; the path is for its name and for messages."""
    columns, values, lines = _parse_rows(path, text)
    axis = columns[0] if columns[0] in AXES else AXES[0]
    blocks = _split_blocks(path, axis, values, lines)
    half = _check_angles(path, axis, values, lines, blocks)
    numbers = values[[block.start for block in blocks], 0]
    step = np.pi / half
    alpha = np.rint(values[blocks[0], 1] / math.degrees(step)) * step
    cl = np.array([values[block, 2] for block in blocks])
    cd = np.array([values[block, 3] for block in blocks])
    if values[0, 1] == -180:
        _check_ends(path, lines, blocks, cl, cd)
        return AirfoilTable(path.stem, numbers, alpha, cl, cd, axis=axis)
    extended = [extend_polar(alpha, *polar, aspect_ratio) for polar in zip(cl, cd, strict=True)]
    circle, circle_cl, circle_cd = (np.array(rows) for rows in zip(*extended, strict=True))
    return AirfoilTable(path.stem, numbers, circle[0], circle_cl, circle_cd, (float(alpha[0]), float(alpha[-1])), axis)


def read_text(path: Path, errors: str = "strict") -> str:
    """Text of a file of at most `MAX_BYTES`; bytes that are no UTF-8 are treated as `bytes.decode` does with `errors`.

    Raises
    ------
    AirfoilError
        It cannot be read, is too long, or is no text.
    """
    try:
        with path.open("rb") as file:
            content = file.read(MAX_BYTES + 1)
        if len(content) > MAX_BYTES:
            raise AirfoilError(f"{path}: the file has more than {MAX_BYTES} bytes, allowed for airfoil tables")
        return content.decode("utf-8-sig", errors)
    except OSError as error:
        raise AirfoilError(f"{path}: cannot be read: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise AirfoilError(f"{path}: byte {error.start} is not UTF-8 text") from error


def _parse_rows(path: Path, text: str) -> tuple[tuple[str, ...], Array, list[int]]:
    """Columns of a CSV file, all rows as numbers, shape (n, 4), and the line number of each."""
    content = [(i, line.strip()) for i, line in enumerate(text.splitlines(), 1)]
    content = [(i, line) for i, line in content if line and not line.startswith("#")]
    if not content:
        raise AirfoilError(f"{path}: holds no table, must begin with the header {HEADERS}")
    number, header = content[0]
    columns = tuple(header.replace(" ", "").split(","))
    if columns not in COLUMNS:
        both = "; a table over both Reynolds and Mach number is not read" if set(AXES) <= set(columns) else ""
        other = "" if "," in header else "; the command airfoil makes tables of C81, XFOIL and AeroDyn files"
        raise AirfoilError(f"{path}:{number}: header {header[:60]!r} must be {HEADERS}{both}{other}")
    rows = [_parse_row(path, i, line, columns) for i, line in content[1:]]
    if not rows:
        raise AirfoilError(f"{path}:{number}: no rows follow the header")
    return columns, np.array(rows), [i for i, _ in content[1:]]


def _parse_row(path: Path, line: int, text: str, columns: tuple[str, ...]) -> list[float]:
    """Number of the axis, 0 where the file has none, angle, cl and cd."""
    fields = text.split(",")
    if len(fields) != len(columns):
        raise AirfoilError(f"{path}:{line}: {len(fields)} values, must be {len(columns)}: {','.join(columns)}")
    row = {"reynolds": 0.0, "mach": 0.0}
    row |= {column: _parse_number(path, line, column, field) for column, field in zip(columns, fields, strict=True)}
    for column in set(columns) & {"reynolds", "cd"}:
        if row[column] <= 0:
            raise _bad(path, line, column, row[column], "greater than 0")
    if row["mach"] < 0:
        raise _bad(path, line, "mach", row["mach"], "0 or greater")
    axis = columns[0] if columns[0] in AXES else AXES[0]
    return [row[column] for column in (axis, *POLAR_COLUMNS)]


def _parse_number(path: Path, line: int, column: str, field: str) -> float:
    try:
        value = float(field)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise AirfoilError(f"{path}:{line}: {column} {field.strip()[:40]!r} must be a finite number")
    return value


def _bad(path: Path, line: int, column: str, value: float, allowed: str) -> AirfoilError:
    return AirfoilError(f"{path}:{line}: {column} {value:.10g} must be {allowed}")


NUMBER_NAMES = {"reynolds": "Reynolds number", "mach": "Mach number"}


def _split_blocks(path: Path, axis: str, values: Array, lines: list[int]) -> list[slice]:
    """Rows of each Reynolds or Mach number; every block must repeat the angles of the first."""
    numbers = values[:, 0]
    for row in np.flatnonzero(np.diff(numbers) < 0) + 1:
        allowed = f"at least {numbers[row - 1]:.10g}, the one above"
        raise _bad(path, lines[row], axis, numbers[row], allowed)
    starts = [0, *(np.flatnonzero(np.diff(numbers)) + 1)]
    blocks = [slice(*ends) for ends in zip(starts, [*starts[1:], len(values)], strict=True)]
    for block in blocks[1:]:
        _check_same_angles(path, NUMBER_NAMES[axis], values[blocks[0], 1], values[block, 1], lines[block])
    return blocks


def _check_same_angles(path: Path, number: str, first: Array, angles: Array, lines: list[int]) -> None:
    for expected, angle, line in zip(first, angles, lines, strict=False):
        if angle != expected:
            raise _bad(path, line, "alpha_deg", angle, f"{expected:.10g} as for the first {number}")
    if len(angles) != len(first):
        allowed = f"the last of {len(first)} angles as for the first {number}, not of {len(angles)}"
        raise _bad(path, lines[-1], "alpha_deg", angles[-1], allowed)


def _check_angles(path: Path, axis: str, values: Array, lines: list[int], blocks: list[slice]) -> int:
    """Check the angles of the first block and return the number of steps in 180 deg."""
    angles = values[blocks[0], 1]
    if len(angles) < 3:
        raise _bad(path, lines[0], "alpha_deg", angles[0], f"one of at least 3 angles per {NUMBER_NAMES[axis]}")
    _check_steps(path, angles, lines)
    _check_span(path, angles, lines)
    if half := half_turn(np.radians(angles)):
        return half
    found = [half_turn(np.radians(angles[:i])) for i in range(2, len(angles) + 1)]
    i = found.index(0) + 1  # the first that does not fit to those above
    allowed = f"a multiple of {FINEST_DEG:g}, as angles that are uneven or whose step does not divide 180"
    raise _bad(path, lines[i], "alpha_deg", angles[i], allowed)


def _check_steps(path: Path, angles: Array, lines: list[int]) -> None:
    """Angles increase, in steps that are not too wide for the curves."""
    for i in range(1, len(angles)):
        before, angle = angles[i - 1], angles[i]
        widest = MAX_FAR_STEP_DEG if max(abs(before), abs(angle)) > FAR_DEG else MAX_STEP_DEG
        if not MIN_STEP_DEG * (1 - STEP_TOLERANCE) <= angle - before <= widest * (1 + STEP_TOLERANCE):
            allowed = f"{MIN_STEP_DEG:g} to {widest:g} above {before:.10g}"
            raise _bad(path, lines[i], "alpha_deg", angle, allowed)


def _check_span(path: Path, angles: Array, lines: list[int]) -> None:
    first, last = angles[0], angles[-1]
    if not (first == -180 or -90 < first < 0):
        raise _bad(path, lines[0], "alpha_deg", first, "-180, or between -90 and 0")
    if first == -180 and last != 180:
        raise _bad(path, lines[len(angles) - 1], "alpha_deg", last, "180 where the first angle is -180")
    if first > -180 and not 0 < last < 90:
        allowed = "between 0 and 90 where the first angle is above -180"
        raise _bad(path, lines[len(angles) - 1], "alpha_deg", last, allowed)


def _check_ends(path: Path, lines: list[int], blocks: list[slice], cl: Array, cd: Array) -> None:
    """Angles of -180 and 180 deg are one angle and must have one value."""
    for column, values in (("cl", cl), ("cd", cd)):
        for block, polar in zip(blocks, values, strict=True):
            if abs(polar[-1] - polar[0]) > 1e-9:
                allowed = f"{polar[0]:.10g} as at -180 deg"
                raise _bad(path, lines[block.stop - 1], column, polar[-1], allowed)


def write_table(path: str | Path, table: AirfoilTable, comments: Sequence[str] = ()) -> None:
    """Write a table in the format of `read_table`, coefficients rounded to six decimals."""
    Path(path).write_text(table_text(table, comments), encoding="utf-8")


def table_text(table: AirfoilTable, comments: Sequence[str] = ()) -> str:
    """Text of a table in the format of `read_table`, coefficients rounded to six decimals.

    Parameters
    ----------
    table : AirfoilTable
        One that ends at stall may have the given angles only.
    comments : sequence of str
        Lines on the table's origin, written on top behind '# '.
    """
    angles = np.rint(table.alpha / np.pi * table.half) * 180 / table.half
    is_for_all = len(table.numbers) == 1 and table.numbers[0] == 0.0
    columns = POLAR_COLUMNS if is_for_all else (table.axis, *POLAR_COLUMNS)
    lines = [f"# {comment}".rstrip() for comment in comments] + [",".join(columns)]
    for i, number in enumerate(table.numbers):
        for j, angle in enumerate(angles):
            # Adding zero turns a rounded -0 into 0.
            cl, cd = round(table.cl[i, j], 6) + 0.0, round(table.cd[i, j], 6)
            lines.append(f"{'' if is_for_all else f'{number:.10g},'}{angle:.10g},{cl:.6f},{cd:.6f}")
    return "\n".join(lines) + "\n"


INTERPOLATIONS = ("smooth", "linear")
DEGREE = 3  # of the polynomials along the angle


class Grid(NamedTuple):
    """Grid of cells of one or several tables.

    Attributes
    ----------
    half : int
        Cells in 180 deg.
    knots : tuple of float
        Reynolds or Mach numbers, at least two.
    range : (float, float)
        Least and largest number for which any of the tables holds.
    """

    half: int
    knots: tuple[float, ...]
    range: tuple[float, float]


def common_half(tables: Sequence[AirfoilTable]) -> int:
    """Steps in 180 deg of the coarsest even grid that has all angles of some tables."""
    return math.lcm(*(table.half for table in tables))


def common_grid(tables: Sequence[AirfoilTable]) -> Grid:
    """Grid that has all angles and all Reynolds or Mach numbers of some tables."""
    several = [table for table in tables if len(table.numbers) > 1]
    if not several:
        return Grid(common_half(tables), tuple(tables[0].knots), tables[0].range)
    knots = np.unique(np.concatenate([table.numbers for table in several]))
    return Grid(common_half(tables), tuple(knots), (float(knots[0]), float(knots[-1])))


def cells(table: AirfoilTable, interpolation: str, grid: Grid | None = None) -> Array:
    """Coefficients of the interpolation in every cell of a table, for `sbs_sim.model.section`.

    Along the angle "smooth" is the monotone cubic of Fritsch and Carlson: its slope is continuous, and it rises or
    falls wherever the data do; "linear" joins the points by lines. Between Reynolds or Mach numbers both are linear.

    Within a cell, with x in 0..1 the fraction along the angle and z the Reynolds or Mach number,
    cl = sum_k (c_k0 + c_k1 z) x^k and cd = sum_k (c_k2 + c_k3 z) x^k, k = 0 to 3. Between angles that are several steps
    apart the polynomial is cut into cells of one step, which changes no value.

    Parameters
    ----------
    table : AirfoilTable
    interpolation : str
        One of `INTERPOLATIONS`.
    grid : Grid, optional
        One that has all points of the table; its own if not given. Beyond its own numbers a table is constant.

    Returns
    -------
    ndarray, shape ((len(grid.knots) - 1) * cell_grid(grid)[0], 16)
        c_00, c_01, c_02, c_03, c_10 ... of each cell. The angle runs fastest and covers -540..540 deg, so that a
        section angle minus an arctangent, -3 pi..3 pi, needs no wrapping.

    References
    ----------
    F. N. Fritsch, R. E. Carlson: Monotone piecewise cubic interpolation, SIAM J. Numer. Anal. 17 (2), 1980.
    """
    grid = common_grid([table]) if grid is None else grid
    lower, width, steps = table.knots[:-1, None], np.diff(table.knots)[:, None], table.intervals
    finer = steps * (grid.half // table.half)
    parts = []
    for values in (table.cl, table.cd):
        powers = _polynomials(np.repeat(values, 2, axis=0) if len(values) == 1 else values, steps, interpolation)
        if finer.max() > 1.0:
            powers = _cut(powers, finer.astype(np.int64))
        slope = np.diff(powers, axis=1) / width
        parts += _between(table, np.array(grid.knots), powers, powers[:, :-1] - lower * slope, slope)
    rows = np.stack(parts, axis=-1).transpose(1, 2, 0, 3)
    return np.ascontiguousarray(np.tile(rows, (1, TURNS, 1, 1)).reshape(-1, 4 * (DEGREE + 1)))


def _between(table: AirfoilTable, knots: Array, powers: Array, level: Array, slope: Array) -> list[Array]:
    """Lines over the table's numbers as lines between other knots, which have all of them; constant beyond the ends."""
    if np.array_equal(knots, table.knots) or len(table.numbers) == 1:
        rows = np.zeros(len(knots) - 1, np.int64) if len(table.numbers) == 1 else slice(None)
        return [level[:, rows], slope[:, rows]]
    middles = 0.5 * (knots[1:] + knots[:-1])
    rows = np.clip(np.searchsorted(table.numbers, middles) - 1, 0, len(table.numbers) - 2)
    level, slope = level[:, rows], slope[:, rows]
    for beyond, row in ((middles < table.numbers[0], 0), (middles > table.numbers[-1], -1)):
        level[:, beyond], slope[:, beyond] = powers[:, row : row + 1 or None], 0.0
    return [level, slope]


def _polynomials(values: Array, steps: Array, interpolation: str) -> Array:
    """Coefficients of x^0 to x^3 in every interval of the angle of some steps, shape (4, n, n_alpha - 1)."""
    start, rise = values[:, :-1], np.diff(values, axis=1)
    if interpolation == "linear":
        return np.stack([start, rise, np.zeros_like(rise), np.zeros_like(rise)])
    slopes = _monotone_slopes(rise / steps, steps)
    left, right = slopes * steps, np.roll(slopes, -1, axis=1) * steps
    return np.stack([start, left, 3.0 * rise - 2.0 * left - right, left + right - 2.0 * rise])


def periodic_cubics(values: Array) -> Array:
    """Coefficients of x^0 to x^3 of the smooth interpolation, see `cells`, of periodic values at equal steps.

    Parameters
    ----------
    values : ndarray, shape (rows, points)
        The last of a row equals the first.

    Returns
    -------
    ndarray, shape (4, rows, points - 1)
        x is the fraction of a step.
    """
    return _polynomials(values, np.ones(values.shape[1] - 1), "smooth")


def _cut(powers: Array, steps: NDArray[np.int64]) -> Array:
    """Polynomials of intervals of some steps cut into those of single steps: p((k + x) / m), k = 0 to m - 1."""
    first = np.concatenate([[0], np.cumsum(steps)[:-1]])
    k = (np.arange(steps.sum()) - np.repeat(first, steps)).astype(np.float64)
    whole = np.repeat(powers / np.stack([steps.astype(float) ** i for i in range(DEGREE + 1)])[:, None], steps, axis=-1)
    return np.stack(
        [
            sum((math.comb(i, j) * whole[i] * k ** (i - j) for i in range(j, DEGREE + 1)), np.zeros_like(whole[0]))
            for j in range(DEGREE + 1)
        ]
    )


def _monotone_slopes(rise: Array, steps: Array) -> Array:
    """Monotone slopes at the beginning of every interval, per step; the intervals go round the circle."""
    return bounded_slopes(np.roll(rise, 1, axis=1), np.roll(steps, 1), rise, steps)


def cell_grid(table: AirfoilTable | Grid) -> tuple[int, float, float]:
    """Angle grid of `cells`.

    Returns
    -------
    n_alpha : int
        Cells along the angle between two Reynolds or Mach numbers.
    alpha0 : float
        First angle [rad].
    inverse_step : float
        Cells per radian.
    """
    per_turn = 2 * table.half
    return TURNS * per_turn, -TURNS * np.pi, per_turn / (2 * np.pi)


def interpolate(
    table: AirfoilTable, number: ArrayLike, alpha: ArrayLike, interpolation: str = "smooth"
) -> tuple[Array, Array]:
    """Lift and drag coefficients at arrays of Reynolds or Mach numbers and angles, for plots and checks.

    Parameters
    ----------
    table : AirfoilTable
    number : array_like
        Reynolds or Mach number, whichever the table is over; clamped to the table's range.
    alpha : array_like
        Angles of attack [rad] of any turn; broadcast against `number`.
    interpolation : str
        See `cells`.

    Returns
    -------
    cl, cd : ndarray
        The broadcast shape.
    """
    knots, step = table.knots, np.pi / table.half
    clamped = np.clip(number, knots[0], knots[-1])
    i = np.clip(np.searchsorted(knots, clamped, side="right") - 1, 0, len(knots) - 2)
    position = np.mod(np.asarray(alpha, dtype=np.float64) + np.pi, 2 * np.pi) / step
    j = np.clip(position.astype(np.int64), 0, 2 * table.half - 1)
    rows = cells(table, interpolation).reshape(len(knots) - 1, -1, DEGREE + 1, 4)[i, j]
    powers = (position - j)[..., None] ** np.arange(DEGREE + 1)
    lift, lift_slope, drag, drag_slope = np.moveaxis(np.einsum("...k,...kc->...c", powers, rows), -1, 0)
    return lift + lift_slope * clamped, drag + drag_slope * clamped
