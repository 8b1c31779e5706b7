"""One table of polars: mirrored, cut or extended, moved to common angles and joined, with words on what was done."""

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from sbs_sim.aircraft.airfoil_files.extension import METHODS
from sbs_sim.aircraft.airfoil_files.polar import SAME_DEG, Polar
from sbs_sim.errors import AirfoilError
from sbs_sim.model.airfoil import (
    AXES,
    FAR_DEG,
    MAX_FAR_STEP_DEG,
    MAX_HALF,
    MAX_STEP_DEG,
    NUMBER_NAMES,
    AirfoilTable,
    Array,
    half_turn,
)

GRID_DEG = 0.1  # to which angles without a common step are moved
BROADSIDE_DEG = 90.0
CLOSED = 1e-3  # of lift and drag at -180 and 180 deg: larger differences are reported
NO_LIFT = 1e-3  # so much lift at 0 deg a symmetric section may have, for programs do not iterate to zero
MAX_POLARS = 200


def table_of(
    name: str, polars: Sequence[Polar], extension: str | None, aspect_ratio: float, axis: str | None = None
) -> tuple[AirfoilTable, list[str]]:
    """One table of polars at several Reynolds numbers or at several Mach numbers.

    A polar of angles from 0 on without lift at 0 is mirrored. Those that do not go round the circle are extended, each
    from its own ends; without an extension all are cut to the angles that all have. Angles without a common step are
    moved to multiples of 0.1 deg, with the values on the lines between the points; gaps between angles that are too
    wide for curves are filled from those lines. All then get the angles of all.

    Parameters
    ----------
    name : str
    polars : sequence of Polar
        1 to 200.
    extension : str, optional
        One of `sbs_sim.aircraft.airfoil_files.extension.METHODS`; none if not given.
    aspect_ratio : float
        Blade length over chord, for the extension.
    axis : str, optional
        One of `sbs_sim.model.airfoil.AXES`, where both numbers vary from polar to polar; the one that varies if not
        given.

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
    axis, ordered = _ordered(polars, axis)
    remarks = list[str]()
    ordered = [_on_common_step(_filled(_mirrored(polar, remarks), remarks), remarks) for polar in ordered]
    if extension is None:
        ordered = _cut(ordered, remarks)
    else:
        ordered = [_extended(polar, extension, aspect_ratio, remarks) for polar in ordered]
    ordered = _at_common_angles([_closed(polar, remarks) for polar in ordered], remarks)
    numbers = np.array([polar.numbers.get(axis, 0.0) for polar in ordered])
    angles = ordered[0].alpha
    half = half_turn(np.radians(angles))
    alpha = np.rint(angles / 180 * half) * (np.pi / half)
    cl, cd = np.array([polar.cl for polar in ordered]), np.array([polar.cd for polar in ordered])
    return AirfoilTable(name, numbers, alpha, cl, cd, axis=axis), _shared(remarks, [polar.number for polar in ordered])


def _shared(remarks: list[str], numbers: list[str]) -> list[str]:
    """Remarks without repetition: one that every polar has is said once."""
    found = dict[str, None]()
    for remark in remarks:
        start, _, text = remark.partition(": ")
        is_of_all = len(numbers) > 1 and all(f"{number}: {text}" in remarks for number in numbers)
        found[f"all polars: {text}" if is_of_all and start in numbers else remark] = None
    return list(found)


def _ordered(polars: Sequence[Polar], axis: str | None) -> tuple[str, list[Polar]]:
    """What the polars are over, and the polars by that number."""
    if len(polars) > MAX_POLARS:
        raise AirfoilError(f"{polars[0].where}: {len(polars)} polars, allowed are {MAX_POLARS}")
    varying = [axis for axis in AXES if len({polar.numbers.get(axis) for polar in polars}) > 1]
    if axis is None and len(varying) > 1:
        raise AirfoilError(
            f"{polars[0].where}: the polars are at several Reynolds and several Mach numbers, allowed is one of the"
            " two, or both if it is chosen what the table is over (--over)"
        )
    known = [axis for axis in AXES if axis in polars[0].numbers]
    axis = axis or (varying or known or AXES)[0]
    for polar in polars:
        if len(polars) > 1 and axis not in polar.numbers:
            raise AirfoilError(f"{polar.where}: the polar has no {NUMBER_NAMES[axis]}, must have one beside others")
    ordered = sorted(polars, key=lambda polar: polar.numbers.get(axis, 0.0))
    for one, other in pairwise(ordered):
        if one.numbers[axis] == other.numbers[axis]:
            same = f"{NUMBER_NAMES[axis]} {one.numbers[axis]:.10g}"
            raise AirfoilError(f"{other.where}: a second polar with {same} beside {one.where}, allowed is one")
    return axis, ordered


def _mirrored(polar: Polar, remarks: list[str]) -> Polar:
    if polar.alpha[0] != 0.0 or abs(polar.cl[0]) > NO_LIFT:
        return polar
    remarks.append("symmetric: mirrored to negative angles")
    lift = np.append(0.0, polar.cl[1:])
    alpha, cl, cd = (
        np.concatenate([sign * values[:0:-1], values])
        for sign, values in ((-1, polar.alpha), (-1, lift), (1, polar.cd))
    )
    return replace(polar, alpha=alpha, cl=cl, cd=cd)


def _filled(polar: Polar, remarks: list[str]) -> Polar:
    """Polar without gaps that are too wide for the curves of a table."""
    added = list[float]()
    for low, high in pairwise(polar.alpha):
        if high - low > _widest(low, high):
            parts = math.ceil((high - low) / MAX_STEP_DEG)
            added += [round(low + (high - low) * k / parts, 1) for k in range(1, parts)]
    if not added:
        return polar
    remarks.append(f"{polar.number}: gaps between angles filled on the lines between the points")
    return polar.at(np.union1d(polar.alpha, added))


def _widest(low: float, high: float) -> float:
    return MAX_FAR_STEP_DEG if max(abs(low), abs(high)) > FAR_DEG else MAX_STEP_DEG


def _on_common_step(polar: Polar, remarks: list[str]) -> Polar:
    if 0 < half_turn(np.radians(polar.alpha)) <= MAX_HALF:
        return polar
    first, last = math.ceil(polar.alpha[0] / GRID_DEG - 1e-6), math.floor(polar.alpha[-1] / GRID_DEG + 1e-6)
    wanted = np.clip(np.rint(polar.alpha / GRID_DEG), first, last)
    angles = np.asarray(np.unique(wanted) / round(1 / GRID_DEG), dtype=np.float64)
    if len(angles) < 3:
        raise AirfoilError(f"{polar.where}: the angles are less than {GRID_DEG:g} deg apart, must be more")
    shift = float(np.abs(wanted * GRID_DEG - polar.alpha).max())
    moved = polar.at(angles)
    back = moved.at(polar.alpha)
    changes = [float(np.abs(one - other).max()) for one, other in ((back.cl, polar.cl), (back.cd, polar.cd))]
    remarks.append(
        f"{polar.number}: angles without a common step moved to multiples of {GRID_DEG:g} deg by at most {shift:.2g}"
        f" deg, which changes lift by at most {changes[0]:.1g} and drag by at most {changes[1]:.1g} where they were"
    )
    return moved


def _cut(polars: list[Polar], remarks: list[str]) -> list[Polar]:
    low, high = max(polar.alpha[0] for polar in polars), min(polar.alpha[-1] for polar in polars)
    kept = [polar.at(polar.alpha[(polar.alpha >= low) & (polar.alpha <= high)]) for polar in polars]
    if any(len(one.alpha) < 3 for one in kept):
        raise AirfoilError(f"{polars[0].where}: the polars have fewer than 3 angles in common, must have 3")
    if any(len(one.alpha) < len(other.alpha) for one, other in zip(kept, polars, strict=True)):
        remarks.append(f"cut to {low:g} to {high:g} deg, which all polars have")
    return kept


def _extended(polar: Polar, extension: str, aspect_ratio: float, remarks: list[str]) -> Polar:
    if polar.is_full:
        return polar
    polar = _cut_below_broadside(polar, remarks)
    low, high = float(polar.alpha[0]), float(polar.alpha[-1])
    if not low < 0 < high:
        raise AirfoilError(f"{polar.where}: angles {low:g} to {high:g} deg must begin below 0 and end above 0")
    try:
        alpha, cl, cd = METHODS[extension](np.radians(polar.alpha), polar.cl, polar.cd, aspect_ratio)
    except AirfoilError as error:
        raise AirfoilError(f"{polar.where}: {error}") from None
    if cd.min() <= 0:
        raise AirfoilError(f"{polar.where}: {extension} gives a drag of {cd.min():.4g}, must be greater than 0")
    remarks.append(f"{polar.number}: extended below {low:g} and above {high:g} deg by {extension}")
    return replace(polar, alpha=np.asarray(np.round(np.degrees(alpha), 6), np.float64), cl=cl, cd=cd)


def _cut_below_broadside(polar: Polar, remarks: list[str]) -> Polar:
    """Polar without angles of 90 deg and more, at which no extension can begin."""
    kept = np.abs(polar.alpha) < BROADSIDE_DEG - SAME_DEG
    if kept.all():
        return polar
    if kept.sum() < 3:
        raise AirfoilError(f"{polar.where}: the polar has {kept.sum()} angles between -90 and 90 deg, must have 3")
    alpha = polar.alpha[kept]
    remarks.append(f"{polar.number}: cut to {alpha[0]:g} to {alpha[-1]:g} deg, below 90 deg, where extensions begin")
    return polar.at(alpha)


def _closed(polar: Polar, remarks: list[str]) -> Polar:
    """Polar with equal values at -180 and 180 deg."""
    if not polar.is_full:
        return polar
    differences = abs(polar.cl[-1] - polar.cl[0]), abs(polar.cd[-1] - polar.cd[0])
    if max(differences) > CLOSED:
        remarks.append(
            f"{polar.number}: values at -180 and 180 deg differ by up to {max(differences):.3g}: the mean is taken"
        )
    cl, cd = polar.cl.copy(), polar.cd.copy()
    for values in (cl, cd):
        values[0] = values[-1] = 0.5 * (values[0] + values[-1])
    return replace(polar, cl=cl, cd=cd)


def _at_common_angles(polars: list[Polar], remarks: list[str]) -> list[Polar]:
    """Polars with the angles of all."""
    angles: Array = np.unique(np.round(np.concatenate([polar.alpha for polar in polars]), 6))
    if any(len(polar.alpha) < len(angles) for polar in polars):
        remarks.append(f"all polars given the {len(angles)} angles of all, on the lines between their own points")
    return [_on_common_step(polar.at(angles), remarks) for polar in polars]


def at_reynolds(table: AirfoilTable, reynolds: float) -> AirfoilTable:
    """Table at one Reynolds number, linear between those of the table; one for all numbers is that at any.

    Raises
    ------
    AirfoilError
        The table is not over the Reynolds number, or does not have it.
    """
    low, high = table.numbers[0], table.numbers[-1]
    if table.axis == "reynolds" and low == high == 0.0:
        return table
    if table.axis != "reynolds" or not low <= reynolds <= high:
        span = f"{low:g}" if low == high else f"{low:g} to {high:g}"
        allowed = span if table.axis == "reynolds" else "none, the table is over the Mach number"
        raise AirfoilError(f"Reynolds number {reynolds:g}: allowed is {allowed}")
    cl, cd = (
        np.array([[np.interp(reynolds, table.numbers, column) for column in values.T]])
        for values in (table.cl, table.cd)
    )
    return replace(table, numbers=np.array([reynolds]), cl=cl, cd=cd)
