"""Blade elements with the tip loss of a finite number of blades and with drag along the span (theory.md section 4.8).

L. Prandtl, appendix to A. Betz: Schraubenpropeller mit geringstem Energieverlust, Goettinger Nachrichten, 1919, gives
the circulation of a few blades over that of very many in the same wake. Drag along the local flow: W. Johnson:
Helicopter Theory, section 5-12.
"""

import math
from typing import Any, NamedTuple

from sbs_sim.lanes import cross, dot, minimum, rounded, select, sqrt, table_row, zeros_like
from sbs_sim.model.blade import to_blade
from sbs_sim.model.kernel import kernel
from sbs_sim.model.section import DEGREE, AirLoads, find_section
from sbs_sim.model.trigonometry import TINY, angle_of

GAUSS = 0.5 / math.sqrt(3.0)  # of an element from its middle: points of the mean with two values
QUARTER_CIRCLE = 2.0 / math.pi  # over it
DEEP = 40.0  # exponent whose decay is below the last bit
HALVINGS, TERMS = 6, 14
FACTORS = tuple((-1.0) ** k / math.factorial(k) for k in range(TERMS + 1))


class SpanFlow(NamedTuple):
    """Velocity of the sections along the span, outwards, linear along it: u_R = hinge + slope s [m/s, 1/s]."""

    hinge: Any
    slope: Any


@kernel
def span_flow(blade, basis, motion, hub_velocity, induced, gradient):
    """Flow along the span; see `sbs_sim.model.blade.section_flow`. A turn about a hinge moves no section along it."""
    hinge = (
        to_blade(blade, basis, hub_velocity) + cross(motion.hub, basis.lag_hinge) + cross(motion.arm, basis.flap_hinge)
    )
    up = basis.span.z
    return SpanFlow(
        dot(basis.span, hinge) + up * (induced + blade.hinge_offset * gradient),
        up * gradient,
    )


@kernel
def decay(x):
    """e^-x for 0 <= x <= DEEP, beyond which it is that of DEEP."""
    small = minimum(x, DEEP) * (1.0 / 2.0**HALVINGS)
    found = zeros_like(small) + FACTORS[TERMS]
    for k in range(TERMS - 1, -1, -1):
        found = found * small + FACTORS[k]
    for _ in range(HALVINGS):
        found = found * found + 0.0
    return found


@kernel
def prandtl(e):
    """Prandtl's factor (2 / pi) arccos e of a decay e = e^-f."""
    return QUARTER_CIRCLE * angle_of(sqrt((1.0 - e) * (1.0 + e)), e, 1.0)


@kernel
def set_tip_factors(blade, strip, through):
    """Set the share of the lift that is left of every element, eq. (4.14), from the tip inwards.

    `through` is the flow through the disc [m/s].
    """
    tip = blade.rotor_speed * blade.radius
    rate = 0.5 * blade.tip_blades * sqrt(tip * tip + through * through) / (abs(through) + TINY)
    over_element = rate * blade.element_width
    outer, inner = decay(over_element * (0.5 - GAUSS)), decay(over_element * (0.5 + GAUSS))
    step = decay(over_element)
    for k in range(strip.shape[0]):
        section = strip[strip.shape[0] - 1 - k]
        mean = 0.5 * (prandtl(outer) + prandtl(inner))
        section.tip_factor = select(blade.tip_blades > 0.0, mean, 1.0)
        outer, inner = outer * step + 0.0, inner * step + 0.0


@kernel
def optional_loads(air, blade, elements, knots, table, strip, flow, along, pitch, through):
    """Air loads of blades as those of `sbs_sim.model.section.section_loads`; Int dF and Int s dF along the span.

    Parameters
    ----------
    along : SpanFlow
    through : lanes
        Flow through the disc [m/s].
    """
    set_tip_factors(blade, strip, through)
    for i in range(elements.shape[0]):
        find_section(blade, elements[i], knots, strip[i], flow, pitch)
    normal_force = forward_force = normal_moment = forward_moment = zeros_like(pitch)
    outward_force = outward_moment = zeros_like(pitch)
    for i in range(elements.shape[0]):
        element, section = elements[i], strip[i]
        s = element.span
        u_t, u_p = flow.u_t_hinge + flow.u_t_slope * s, flow.u_p_hinge + flow.u_p_slope * s
        u_r = blade.oblique_drag * (along.hinge + along.slope * s)
        lift, lift_slope, drag, drag_slope = table_row(table, section.row, section.fraction, DEGREE)
        pressure = air.density * element.half_area
        share = section.tip_factor * element.lift_factor
        lift_gain = (lift + lift_slope * section.number) * (pressure * section.airspeed * share)
        speed = sqrt(section.airspeed * section.airspeed + u_r * u_r)
        drag_gain = (drag + drag_slope * section.number) * (pressure * speed)
        up = lift_gain * u_t - drag_gain * u_p
        rearward = lift_gain * u_p + drag_gain * u_t
        normal_force, forward_force = normal_force + up, forward_force - rearward
        normal_moment, forward_moment = normal_moment + s * up, forward_moment - s * rearward
        outward_force = outward_force - drag_gain * u_r
        outward_moment = outward_moment - s * rounded(drag_gain * u_r)
    return AirLoads(normal_force, forward_force, normal_moment, forward_moment), outward_force, outward_moment
