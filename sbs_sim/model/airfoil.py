"""Section lift and drag over Reynolds number and angle of attack (theory.md section 4).

A table holds cl and cd on a full grid of Reynolds numbers and angles from -180 to 180 deg. Compiled code
reads it as an array of cells, two cache lines per cell with the coefficients of the interpolation, laid out over three
turns of the angle so that nothing has to be wrapped.
"""

from __future__ import annotations  # `help` then shows types by their names

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sbs_sim.content import ByContent
from sbs_sim.errors import AirfoilError
from sbs_sim.model.elementary import cosine_and_sine

Array = NDArray[np.float64]

COLUMNS = ("reynolds", "alpha_deg", "cl", "cd")
HEADER = ",".join(COLUMNS)
PLATE_DRAG, PLATE_DRAG_SLOPE = 1.11, 0.018  # of a blade broadside on: at no aspect ratio, and by aspect ratio
INFINITE_BLADE = 50.0  # aspect ratio from which it is that of an infinite plate, 2.01
REFLECTED_LIFT = -0.7  # cl of the reversed airfoil over cl of the airfoil at the mirrored angle
TURNS = 3  # turns of the angle that the cells cover: -540..540 deg
MIN_STEP_DEG, MAX_STEP_DEG = 0.01, 10.0
STEP_TOLERANCE = 0.01  # of a step, for angles that were rounded in the file
ATTACHED = math.radians(5.0)  # from the angle of no lift: so far the flow is taken to be attached
SEPARATED = 0.5  # of the lift of attached flow: below, the flow has left the section


@dataclass(frozen=True, eq=False)
class AirfoilTable(ByContent):
    """Lift and drag coefficients of one airfoil over the full circle.

    Attributes
    ----------
    name : str
    reynolds : ndarray, shape (n_re,)
        Reynolds numbers, increasing, at least two.
    alpha : ndarray, shape (n_alpha,)
        Angles of attack [rad] from -pi to pi with one step.
    cl, cd : ndarray, shape (n_re, n_alpha)
        Lift and drag coefficient; the values at -pi and pi are equal.
    given : (float, float)
        Lowest and highest angle that was not made by `extend_polar` [rad].
    """

    name: str
    reynolds: Array
    alpha: Array
    cl: Array
    cd: Array
    given: tuple[float, float] = (-math.pi, math.pi)


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
    highest, lowest : ndarray, shape (n_re,)
        For each Reynolds number of the table [rad]. Of several angles of equal lift the one nearest to zero.

    References
    ----------
    theory.md section 6.1. A plate whose flow is attached up to a share f of its chord has, after Kirchhoff, the lift of
    attached flow times ((1 + sqrt f) / 2)^2, half of it at f = 0.17: J. G. Leishman, T. S. Beddoes, A semi-empirical
    model for dynamic stall, Journal of the American Helicopter Society 34 (3), 1989.
    """
    lowest, highest = table.given
    above = [_max_lift_angle(table.alpha, cl) for cl in table.cl]
    below = [_max_lift_angle(table.alpha, -cl[::-1]) for cl in table.cl]
    return np.minimum(above, highest), -np.minimum(below, -lowest)


def _max_lift_angle(alpha: Array, cl: Array) -> float:
    """Angle of maximum lift of attached flow, upwards from 0 [rad]; pi where there is no lift."""
    attached = max(ATTACHED, 1.5 * (alpha[1] - alpha[0]))
    near = np.abs(alpha) < attached
    slope, at_zero = np.polyfit(alpha[near], cl[near], 1)
    if slope <= 0.0:
        return math.pi
    angles, lift = alpha[len(alpha) // 2 :], cl[len(alpha) // 2 :]
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
        excluded).
    cl, cd : array_like, shape (n,)
        Lift and drag coefficient.
    aspect_ratio : float
        Blade length over chord.

    Returns
    -------
    alpha, cl, cd : ndarray, shape (2 pi / step + 1,)
        From -pi to pi with the same step; cl and cd are equal at both ends.
    """
    alpha, cl, cd = (np.asarray(values, dtype=np.float64) for values in (alpha, cl, cd))
    step = (alpha[-1] - alpha[0]) / (len(alpha) - 1)
    half = round(np.pi / step)
    circle = np.arange(-half, half + 1) * (np.pi / half)
    first = half + round(alpha[0] / step)
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
    return circle, circle_cl, circle_cd


def read_table(path: str | Path, aspect_ratio: float) -> AirfoilTable:
    """Read an airfoil table from a CSV file.

    The file has the header `reynolds,alpha_deg,cl,cd` and a full grid: one block of rows for each Reynolds
    number, in increasing order, each with the same angles in one step. Lines that begin with '#' are
    comments. The angles run from -180 to 180 deg, or over an attached range around zero that `extend_polar`
    completes.

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
    values, lines = _read_rows(path)
    blocks = _split_blocks(path, values, lines)
    half = _check_angles(path, values, lines, blocks)
    reynolds = values[[block.start for block in blocks], 0]
    step = np.pi / half
    alpha = np.rint(values[blocks[0], 1] / math.degrees(step)) * step
    cl = np.array([values[block, 2] for block in blocks])
    cd = np.array([values[block, 3] for block in blocks])
    if len(alpha) == 2 * half + 1:
        _check_ends(path, lines, blocks, cl, cd)
        return AirfoilTable(path.stem, reynolds, alpha, cl, cd)
    extended = [extend_polar(alpha, *polar, aspect_ratio) for polar in zip(cl, cd, strict=True)]
    circle, circle_cl, circle_cd = (np.array(rows) for rows in zip(*extended, strict=True))
    return AirfoilTable(path.stem, reynolds, circle[0], circle_cl, circle_cd, (float(alpha[0]), float(alpha[-1])))


def _read_rows(path: Path) -> tuple[Array, list[int]]:
    """All rows as numbers, shape (n, 4), and the line number of each."""
    try:
        text = path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise AirfoilError(f"{path}: cannot be read: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise AirfoilError(f"{path}: byte {error.start} is not UTF-8 text") from error
    content = [(i, line.strip()) for i, line in enumerate(text.splitlines(), 1)]
    content = [(i, line) for i, line in content if line and not line.startswith("#")]
    if not content:
        raise AirfoilError(f"{path}: holds no table, must begin with the header {HEADER}")
    number, header = content[0]
    if header.replace(" ", "") != HEADER:
        raise AirfoilError(f"{path}:{number}: header {header[:60]!r} must be {HEADER}")
    rows = [_parse_row(path, i, line) for i, line in content[1:]]
    if not rows:
        raise AirfoilError(f"{path}:{number}: no rows follow the header")
    return np.array(rows), [i for i, _ in content[1:]]


def _parse_row(path: Path, line: int, text: str) -> list[float]:
    fields = text.split(",")
    if len(fields) != len(COLUMNS):
        raise AirfoilError(f"{path}:{line}: {len(fields)} values, must be {len(COLUMNS)}: {HEADER}")
    row = [_parse_number(path, line, *item) for item in zip(COLUMNS, fields, strict=True)]
    for column in ("reynolds", "cd"):
        value = row[COLUMNS.index(column)]
        if value <= 0:
            raise _bad(path, line, column, value, "greater than 0")
    return row


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


def _split_blocks(path: Path, values: Array, lines: list[int]) -> list[slice]:
    """Rows of each Reynolds number; every block must repeat the angles of the first."""
    reynolds = values[:, 0]
    for row in np.flatnonzero(np.diff(reynolds) < 0) + 1:
        allowed = f"at least {reynolds[row - 1]:.10g}, the one above"
        raise _bad(path, lines[row], "reynolds", reynolds[row], allowed)
    starts = [0, *(np.flatnonzero(np.diff(reynolds)) + 1)]
    blocks = [slice(*ends) for ends in zip(starts, [*starts[1:], len(values)], strict=True)]
    if len(blocks) < 2:
        raise _bad(path, lines[0], "reynolds", reynolds[0], "one of at least 2 different values in the table")
    for block in blocks[1:]:
        _check_same_angles(path, values[blocks[0], 1], values[block, 1], lines[block])
    return blocks


def _check_same_angles(path: Path, first: Array, angles: Array, lines: list[int]) -> None:
    for expected, angle, line in zip(first, angles, lines, strict=False):
        if angle != expected:
            raise _bad(path, line, "alpha_deg", angle, f"{expected:.10g} as for the first Reynolds number")
    if len(angles) != len(first):
        allowed = f"the last of {len(first)} angles as for the first Reynolds number, not of {len(angles)}"
        raise _bad(path, lines[-1], "alpha_deg", angles[-1], allowed)


def _check_angles(path: Path, values: Array, lines: list[int], blocks: list[slice]) -> int:
    """Check the angles of the first block and return the number of steps in 180 deg."""
    angles = values[blocks[0], 1]
    if len(angles) < 3:
        raise _bad(path, lines[0], "alpha_deg", angles[0], "one of at least 3 angles per Reynolds number")
    _check_step(path, angles, lines)
    _check_span(path, angles, lines)
    step = (angles[-1] - angles[0]) / (len(angles) - 1)
    half = round(float(180 / step))
    steps = angles / 180 * half
    for i in np.flatnonzero(np.abs(steps - np.rint(steps)) > STEP_TOLERANCE):
        allowed = f"a multiple of a step that divides 180, not of {step:.10g}"
        raise _bad(path, lines[i], "alpha_deg", angles[i], allowed)
    return half


def _check_step(path: Path, angles: Array, lines: list[int]) -> None:
    step = angles[1] - angles[0]
    if not MIN_STEP_DEG <= step <= MAX_STEP_DEG:
        allowed = f"{MIN_STEP_DEG:g} to {MAX_STEP_DEG:g} above {angles[0]:.10g}"
        raise _bad(path, lines[1], "alpha_deg", angles[1], allowed)
    for i in np.flatnonzero(np.abs(np.diff(angles) - step) > STEP_TOLERANCE * step) + 1:
        allowed = f"{angles[i - 1] + step:.10g}, one step of {step:.10g} after the angle above"
        raise _bad(path, lines[i], "alpha_deg", angles[i], allowed)


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
    """Write a table in the format of `read_table`, coefficients rounded to six decimals.

    Parameters
    ----------
    path : str or Path
    table : AirfoilTable
    comments : sequence of str
        Lines on the table's origin, written on top behind '# '.
    """
    half = round(np.pi / (table.alpha[1] - table.alpha[0]))
    angles = np.rint(table.alpha / np.pi * half) * 180 / half
    lines = [f"# {comment}".rstrip() for comment in comments] + [HEADER]
    for i, reynolds in enumerate(table.reynolds):
        for j, angle in enumerate(angles):
            # Adding zero turns a rounded -0 into 0.
            cl, cd = round(table.cl[i, j], 6) + 0.0, round(table.cd[i, j], 6)
            lines.append(f"{reynolds:.10g},{angle:.10g},{cl:.6f},{cd:.6f}")
    Path(path).write_text("\n".join(lines) + "\n", encoding="utf-8")


INTERPOLATIONS = ("smooth", "linear")
DEGREE = 3  # of the polynomials along the angle


def cells(table: AirfoilTable, interpolation: str) -> Array:
    """Coefficients of the interpolation in every cell of a table, for `sbs_sim.model.section`.

    Along the angle "smooth" is the monotone cubic of Fritsch and Carlson: its slope is continuous, and it rises or
    falls wherever the data do; "linear" joins the points by lines. Between Reynolds numbers both are linear.

    Within a cell, with x in 0..1 the fraction along the angle, cl = sum_k (c_k0 + c_k1 Re) x^k and
    cd = sum_k (c_k2 + c_k3 Re) x^k, k = 0 to 3.

    Parameters
    ----------
    table : AirfoilTable
    interpolation : str
        One of `INTERPOLATIONS`.

    Returns
    -------
    ndarray, shape ((n_re - 1) * cell_grid(table)[0], 16)
        c_00, c_01, c_02, c_03, c_10 ... of each cell. The angle runs fastest and covers -540..540 deg, so that a
        section angle minus an arctangent, -3 pi..3 pi, needs no wrapping.

    References
    ----------
    F. N. Fritsch, R. E. Carlson: Monotone piecewise cubic interpolation, SIAM J. Numer. Anal. 17 (2), 1980.
    """
    lower, width = table.reynolds[:-1, None], np.diff(table.reynolds)[:, None]
    parts = []
    for values in (table.cl, table.cd):
        powers = _polynomials(values, interpolation)  # (4, n_re, n_alpha - 1)
        slope = np.diff(powers, axis=1) / width
        parts += [powers[:, :-1] - lower * slope, slope]
    rows = np.stack(parts, axis=-1).transpose(1, 2, 0, 3)
    return np.ascontiguousarray(np.tile(rows, (1, TURNS, 1, 1)).reshape(-1, 4 * (DEGREE + 1)))


def _polynomials(values: Array, interpolation: str) -> Array:
    """Coefficients of x^0 to x^3 in every interval of the angle, shape (4, n_re, n_alpha - 1)."""
    start, rise = values[:, :-1], np.diff(values, axis=1)
    if interpolation == "linear":
        return np.stack([start, rise, np.zeros_like(rise), np.zeros_like(rise)])
    left = _monotone_slopes(rise)
    right = np.roll(left, -1, axis=1)
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
    return _polynomials(values, "smooth")


def _monotone_slopes(rise: Array) -> Array:
    """Slopes at the beginning of every interval, per interval; the intervals go round the circle.

    The mean of the rises on both sides, not more than three times the smaller: section 4 of Fritsch and Carlson. Zero
    at a maximum or minimum.
    """
    before = np.roll(rise, 1, axis=1)
    limit = 3.0 * np.minimum(np.abs(before), np.abs(rise))
    mean = 0.5 * (before + rise)
    limited = np.where(np.abs(mean) > limit, np.copysign(limit, mean), mean)
    return np.where(before * rise > 0.0, limited, 0.0)


def cell_grid(table: AirfoilTable) -> tuple[int, float, float]:
    """Angle grid of `cells`.

    Returns
    -------
    n_alpha : int
        Cells along the angle for each Reynolds cell.
    alpha0 : float
        First angle [rad].
    inverse_step : float
        Cells per radian.
    """
    per_turn = len(table.alpha) - 1
    return TURNS * per_turn, -TURNS * np.pi, per_turn / (2 * np.pi)


def interpolate(
    table: AirfoilTable, reynolds: ArrayLike, alpha: ArrayLike, interpolation: str = "smooth"
) -> tuple[Array, Array]:
    """Lift and drag coefficients at arrays of Reynolds numbers and angles, for plots and checks.

    Parameters
    ----------
    table : AirfoilTable
    reynolds : array_like
        Clamped to the table's range.
    alpha : array_like
        Angles of attack [rad] of any turn; broadcast against `reynolds`.
    interpolation : str
        See `cells`.

    Returns
    -------
    cl, cd : ndarray
        The broadcast shape.
    """
    knots, step = table.reynolds, table.alpha[1] - table.alpha[0]
    clamped = np.clip(reynolds, knots[0], knots[-1])
    i = np.clip(np.searchsorted(knots, clamped, side="right") - 1, 0, len(knots) - 2)
    position = np.mod(np.asarray(alpha, dtype=np.float64) + np.pi, 2 * np.pi) / step
    j = np.clip(position.astype(np.int64), 0, len(table.alpha) - 2)
    rows = cells(table, interpolation).reshape(len(knots) - 1, -1, DEGREE + 1, 4)[i, j]
    powers = (position - j)[..., None] ** np.arange(DEGREE + 1)
    lift, lift_slope, drag, drag_slope = np.moveaxis(np.einsum("...k,...kc->...c", powers, rows), -1, 0)
    return lift + lift_slope * clamped, drag + drag_slope * clamped
