"""Blade elements: flow, coefficients and forces of sections (theory.md section 4)."""

from typing import Any, NamedTuple

from sbs_sim.lanes import floor, maximum, minimum, select, table_row, zeros_like
from sbs_sim.model.kernel import kernel
from sbs_sim.model.trigonometry import TINY, angle_of, inverse_root

DEGREE = 3  # of the interpolation along the angle


class SectionFlow(NamedTuple):
    """Velocities of the sections in the air, linear along the span, eq. (4.2).

    Attributes
    ----------
    u_t_hinge, u_t_slope : lanes
        u_T = u_t_hinge + u_t_slope s along the motion [m/s, 1/s].
    u_p_hinge, u_p_slope : lanes
        u_P = u_p_hinge + u_p_slope s along n, up through the disc [m/s, 1/s].
    """

    u_t_hinge: Any
    u_t_slope: Any
    u_p_hinge: Any
    u_p_slope: Any


class SpanFlow(NamedTuple):
    """Velocity of the sections along the span, outwards, linear along it: u_R = hinge + slope s [m/s, 1/s]."""

    hinge: Any
    slope: Any


class AirLoads(NamedTuple):
    """Sums along a blade, section 4.3.

    Attributes
    ----------
    normal_force, forward_force : lanes
        Int dF_n (up) and Int dF_t (along the motion) [N].
    normal_moment, forward_moment : lanes
        Int s dF_n and Int s dF_t, about the flap hinge [N m].
    """

    normal_force: Any
    forward_force: Any
    normal_moment: Any
    forward_moment: Any


@kernel
def section_loads(air, blade, elements, knots, table, strip, flow, pitch):
    """Air loads of blades, eq. (4.5).

    Two loops over the elements, so that the values of each fit into the registers of the processor.

    Parameters
    ----------
    air, blade : records AIR, BLADE
    elements : records ELEMENT, shape (elements,)
    knots : lanes, shape (knots,)
        Inner Reynolds or Mach numbers of the airfoil table.
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
        find_section(blade, elements[i], knots, strip[i], flow, pitch)
    normal_force = forward_force = normal_moment = forward_moment = zeros_like(pitch)
    for i in range(elements.shape[0]):
        element, section = elements[i], strip[i]
        s = element.span
        u_t = flow.u_t_hinge + flow.u_t_slope * s
        u_p = flow.u_p_hinge + flow.u_p_slope * s
        lift, lift_slope, drag, drag_slope = table_row(table, section.row, section.fraction, DEGREE)
        scale = (air.density * element.half_area) * section.airspeed
        lift_gain = (lift + lift_slope * section.number) * (scale * element.lift_factor)  # lift over airspeed
        drag_gain = (drag + drag_slope * section.number) * scale
        up = lift_gain * u_t - drag_gain * u_p
        rearward = lift_gain * u_p + drag_gain * u_t
        normal_force = normal_force + up
        forward_force = forward_force - rearward
        normal_moment = normal_moment + s * up
        forward_moment = forward_moment - s * rearward
    return AirLoads(normal_force, forward_force, normal_moment, forward_moment)


@kernel
def find_section(blade, element, knots, section, flow, pitch):
    """Set airspeed, Reynolds or Mach number and cell of the airfoil table of one element, eq. (4.4)."""
    u_t = flow.u_t_hinge + flow.u_t_slope * element.span
    u_p = flow.u_p_hinge + flow.u_p_slope * element.span
    squared = u_t * u_t + u_p * u_p + TINY
    inverse_airspeed = inverse_root(squared)
    airspeed = squared * inverse_airspeed
    alpha = pitch + element.twist - angle_of(u_p, u_t, inverse_airspeed)
    cell = table_cell(blade, element.first_row, knots, airspeed * element.number_scale, alpha)
    section.airspeed, section.number = airspeed, cell.number
    section.fraction, section.row = cell.fraction, cell.row


class TableCell(NamedTuple):
    """Cell of the airfoil table: its row, fraction of its width in alpha, Reynolds or Mach number within the table."""

    row: Any
    fraction: Any
    number: Any


@kernel
def table_cell(blade, first_row, knots, number, alpha):
    """Cell at a Reynolds or Mach number and an angle of attack [rad]; a row for any values, NaN included."""
    number = minimum(maximum(number, blade.min_number), blade.max_number)
    position = (alpha - blade.first_alpha) * blade.inverse_alpha_step
    cells = blade.alpha_cells
    position = select(position < 0.0, 0.0, position)
    position = select(position > cells, cells, position)  # NaN stays NaN ...
    column = select(position < cells, floor(position), cells - 1.0)  # ... in a cell of the table
    row = first_row + column
    for k in range(knots.shape[0]):
        row = row + select(number >= knots[k], cells, 0.0)
    return TableCell(row, position - column, number)
