"""Blade elements: flow, coefficients and forces of sections (theory.md section 4)."""

from typing import Any, NamedTuple

from sbs_sim.lanes import floor, greatest, least, select, table_row, zeros_like
from sbs_sim.model.kernel import kernel
from sbs_sim.model.trigonometry import TINY, angle_of, inverse_root

DEGREE = 3  # of the interpolation along the angle


class SectionFlow(NamedTuple):
    """Velocities of the sections in the air: u_T = t0 + t1 s along the motion, u_P = p0 + p1 s along n [m/s]."""

    t0: Any
    t1: Any
    p0: Any
    p1: Any


class AirLoads(NamedTuple):
    """Sums along a blade: forces along n (up) and t (forward) [N], their first moments about the flap hinge [N m]."""

    normal: Any
    forward: Any
    normal_moment: Any
    forward_moment: Any


@kernel
def section_loads(air, blade, elements, knots, table, strip, flow, pitch):
    """Air loads of blades.

    The elements go by twice, so that both passes fit into the registers.

    Parameters
    ----------
    air, blade : records AIR, BLADE
    elements : records ELEMENT, shape (elements,)
    knots : lanes, shape (knots,)
        Reynolds numbers of the airfoil table.
    table : ndarray, shape (cells, 16)
    strip : records STRIP, shape (elements,)
        Memory.
    flow : SectionFlow
    pitch : lanes
        Angle of the blade's root [rad].

    Returns
    -------
    AirLoads
    """
    for i in range(elements.shape[0]):
        _look_up(air, blade, elements[i], knots, strip[i], flow, pitch)
    normal = forward = normal_moment = forward_moment = zeros_like(pitch)
    for i in range(elements.shape[0]):
        element, found = elements[i], strip[i]
        s = element.span
        ut = flow.t0 + flow.t1 * s
        up = flow.p0 + flow.p1 * s
        lift, lift_slope, drag, drag_slope = table_row(table, found.row, found.fraction, DEGREE)
        scale = (air.density * element.half_area) * found.speed
        cl = (lift + lift_slope * found.reynolds) * (scale * element.lift_share)
        cd = (drag + drag_slope * found.reynolds) * scale
        dn = cl * ut - cd * up
        dt = cl * up + cd * ut
        normal = normal + dn
        forward = forward - dt
        normal_moment = normal_moment + s * dn
        forward_moment = forward_moment - s * dt
    return AirLoads(normal, forward, normal_moment, forward_moment)


@kernel
def _look_up(air, blade, element, knots, found, flow, pitch):
    """Speed, Reynolds number, and place in the airfoil table of one element."""
    ut = flow.t0 + flow.t1 * element.span
    up = flow.p0 + flow.p1 * element.span
    squared = ut * ut + up * up + TINY
    inverse_speed = inverse_root(squared)
    speed = squared * inverse_speed
    alpha = pitch + element.twist - angle_of(up, ut, inverse_speed)
    place = table_place(blade, knots, speed * (element.chord * air.inverse_viscosity), alpha)
    found.speed, found.reynolds, found.fraction, found.row = speed, place.reynolds, place.fraction, place.row


class TablePlace(NamedTuple):
    """Row of a cell of the airfoil table, fraction of the way through it along the angle, Reynolds number."""

    row: Any
    fraction: Any
    reynolds: Any


@kernel
def table_place(blade, knots, reynolds, alpha):
    """Place of a Reynolds number and an angle of attack [rad] in the table; a cell of it, whatever they are."""
    reynolds = least(greatest(reynolds, blade.least_reynolds), blade.largest_reynolds)
    along = (alpha - blade.first_angle) * blade.inverse_step
    columns = blade.columns
    along = select(along < 0.0, 0.0, along)
    along = select(along > columns, columns, along)  # NaN stays NaN ...
    column = select(along < columns, floor(along), columns - 1.0)  # ... in a cell of the table
    row = blade.first_row + column
    for k in range(knots.shape[0]):
        row = row + select(reynolds >= knots[k], columns, 0.0)
    return TablePlace(row, along - column, reynolds)
