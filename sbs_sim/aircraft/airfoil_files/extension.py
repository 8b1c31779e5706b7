"""Polars that end near stall, extended to the full circle by methods of others (theory.md section 4.6)."""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from sbs_sim.errors import AirfoilError
from sbs_sim.model.airfoil import (
    ATTACHED,
    INFINITE_BLADE,
    PLATE_DRAG,
    PLATE_DRAG_SLOPE,
    Array,
    circle_of,
    extend_polar,
)

Method = Callable[[Array, Array, Array, float], tuple[Array, Array, Array]]

BROADSIDE_LIFT = 0.08  # of Montgomerie's plate at 90 deg, over its drag
FRICTION = 0.006  # drag of a plate along the flow
SETTLING = math.radians(15.0)  # past the last point: there the plate is reached, or nearly
ON_THE_LINE = 0.999  # of lift above the plate's: so much of it is that of attached flow
REMAINDER = 0.03  # of lift above that of Montgomerie's plate there


def broadside_drag(aspect_ratio: float) -> float:
    """Drag coefficient of a blade broadside on, 1.11 + 0.018 of the aspect ratio up to 50: Viterna and Corrigan's."""
    return PLATE_DRAG + PLATE_DRAG_SLOPE * min(aspect_ratio, INFINITE_BLADE)


class Side(NamedTuple):
    """One end of a polar, as if it were that of positive angles: for the other all angles and lift are reversed.

    Attributes
    ----------
    alpha, cl, cd : float
        Last point [rad].
    zero_lift : float
        Lift coefficient at zero angle of attack.
    slope : float
        Slope of lift where the flow is attached [1/rad].
    broadside : float
        Drag coefficient of the blade broadside on.
    """

    alpha: float
    cl: float
    cd: float
    zero_lift: float
    slope: float
    broadside: float


def by_montgomerie(alpha: Array, cl: Array, cd: Array, aspect_ratio: float) -> tuple[Array, Array, Array]:
    """Extend a polar by Montgomerie's method: from attached flow it passes to that of a plate.

    With t the straight lift curve and s that of the plate, lift is f t + (1 - f) s with f = 1 / (1 + k (alpha_M -
    alpha)^4). Both constants follow from two points: the last one of the polar, and lift of 0.03 above the plate's 15
    deg later. The plate has the normal force of its angle, turned by camber and by lift at 90 deg. Drag passes in the
    same way from the last point to that of the plate. Near 180 deg the section is the plate, too.

    Parameters and values are those of `sbs_sim.model.airfoil.extend_polar`.

    Raises
    ------
    AirfoilError
        Lift at an end is not between that of the plate and the straight line, from one to the other of which it is to
        pass: the polar ends before stall, or long after it.

    References
    ----------
    B. Montgomerie: Methods for root effects, tip effects and extending the angle of attack range to +-180 deg,
    FOI-R--1305--SE, Swedish Defence Research Agency, 2004; lift at 90 deg as in QBlade.
    """
    return _extended(alpha, cl, cd, aspect_ratio, _montgomerie)


def _montgomerie(side: Side, alpha: Array) -> tuple[Array, Array]:
    first, second = side.alpha, side.alpha + SETTLING
    above = side.cl - _plate_lift(side, first)
    shares = above / _headroom(side, first), REMAINDER / _headroom(side, second)
    if not 0.0 < shares[1] < shares[0] < ON_THE_LINE:
        low, high = _plate_lift(side, first), side.zero_lift + side.slope * first
        raise AirfoilError(
            f"lift {side.cl:.4g} at {math.degrees(first):.4g} deg must be between that of a plate, {low:.4g}, and of"
            f" attached flow, {high:.4g}, for Montgomerie's extension (signs of the other side reversed)"
        )
    roots = [(1.0 / share - 1.0) ** 0.25 for share in shares]
    ratio = roots[0] / roots[1]
    middle = (first - second * ratio) / (1.0 - ratio)
    k = (roots[0] / (first - middle)) ** 4
    share = 1.0 / (1.0 + k * (alpha - middle) ** 4)
    lift = _plate_lift(side, alpha) + share * (side.zero_lift + side.slope * alpha - _plate_lift(side, alpha))
    drag = _plate_drag(side, alpha) + share / shares[0] * (side.cd - float(_plate_drag(side, first)))
    return lift, drag


def _headroom(side: Side, alpha: float) -> float:
    return side.zero_lift + side.slope * alpha - float(_plate_lift(side, alpha))


def _plate_lift(side: Side, alpha: Array | float) -> Array:
    angle = alpha - BROADSIDE_LIFT * np.sin(alpha) + side.zero_lift / side.slope * np.cos(alpha)
    gain = 1.0 + side.zero_lift / math.sin(math.pi / 4) * np.sin(alpha)
    return np.asarray(gain * side.broadside * np.sin(angle) * np.cos(angle))


def _plate_drag(side: Side, alpha: Array | float) -> Array:
    return np.asarray(side.broadside * np.sin(alpha) ** 2 + FRICTION)


def by_plate(alpha: Array, cl: Array, cd: Array, aspect_ratio: float) -> tuple[Array, Array, Array]:
    """Extend a polar by the normal force of a flat plate, c_n = c_d,max sin alpha, and a drag of 0.006 along it.

    It is reached 15 deg past the last points; from there to here the difference falls in a straight line.

    References
    ----------
    S. F. Hoerner: Fluid-dynamic drag, 1965, section 3: the force on a stalled plate is normal to it.
    """
    return _extended(alpha, cl, cd, aspect_ratio, _plate)


def _plate(side: Side, alpha: Array) -> tuple[Array, Array]:
    rest = np.clip(1.0 - (alpha - side.alpha) / SETTLING, 0.0, 1.0)
    lift, drag = side.broadside * np.sin(alpha) * np.cos(alpha), _plate_drag(side, alpha)
    first_lift = side.broadside * math.sin(side.alpha) * math.cos(side.alpha)
    first_drag = float(_plate_drag(side, side.alpha))
    return lift + rest * (side.cl - first_lift), drag + rest * (side.cd - first_drag)


def by_holding(alpha: Array, cl: Array, cd: Array, aspect_ratio: float) -> tuple[Array, Array, Array]:
    """Hold the last values up to 90 deg, from where they pass in a straight line to the mean of both at 180 deg."""
    circle, _, _ = _extended(alpha, cl, cd, aspect_ratio, _plate)
    quarter, half = math.pi / 2, math.pi
    points = np.array([-half, -quarter, *alpha, quarter, half])
    held = [
        np.interp(circle, points, [*(0.5 * (v[0] + v[-1]), v[0]), *v, *(v[-1], 0.5 * (v[0] + v[-1]))]) for v in (cl, cd)
    ]
    return circle, held[0], held[1]


def _extended(
    alpha: Array, cl: Array, cd: Array, aspect_ratio: float, method: Callable[[Side, Array], tuple[Array, Array]]
) -> tuple[Array, Array, Array]:
    """Circle with the given points and both sides by a method; both ends have the mean of what the sides give there."""
    circle, first = circle_of(alpha)
    last = first + len(alpha) - 1
    attached = np.abs(alpha) < max(ATTACHED, 1.5 * float(np.diff(alpha).max()))
    slope, zero_lift = np.polyfit(alpha[attached], cl[attached], 1)
    broadside = broadside_drag(aspect_ratio)
    if slope <= 0.0:
        raise AirfoilError(f"the slope of lift about 0 deg, {slope:.4g} /rad, must be greater than 0 for an extension")
    above = Side(alpha[-1], cl[-1], cd[-1], zero_lift, slope, broadside)
    below = Side(-alpha[0], -cl[0], cd[0], -zero_lift, slope, broadside)
    lift_above, drag_above = method(above, circle[last + 1 :])
    lift_below, drag_below = method(below, -circle[:first])
    lift, drag = np.concatenate([-lift_below, cl, lift_above]), np.concatenate([drag_below, cd, drag_above])
    for values in (lift, drag):
        values[0] = values[-1] = 0.5 * (values[0] + values[-1])
    return circle, lift, drag


METHODS: dict[str, Method] = {
    "viterna": extend_polar,
    "montgomerie": by_montgomerie,
    "plate": by_plate,
    "hold": by_holding,
}
