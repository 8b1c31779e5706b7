"""Blade elements with the tip loss of a finite number of blades and with drag along the span (theory.md section 4.8).

L. Prandtl, appendix to A. Betz: Schraubenpropeller mit geringstem Energieverlust, Goettinger Nachrichten, 1919, gives
the circulation of a few blades over that of very many in the same wake. Drag along the local flow: W. Johnson:
Helicopter Theory, section 5-12.
"""

import math
from typing import Any, NamedTuple

from sbs_sim.lanes import Vector, any_lane, cross, dot, minimum, rounded, seldom, select, sqrt, table_row, zeros_like
from sbs_sim.model.blade import to_blade
from sbs_sim.model.element_gusts import free_gust_at, gust_at
from sbs_sim.model.kernel import kernel
from sbs_sim.model.section import DEGREE, AirLoads, SectionFlow, SpanFlow, find_section
from sbs_sim.model.separation import late_coefficients
from sbs_sim.model.trigonometry import TINY, angle_of, small_arcsine

GAUSS = 0.5 / math.sqrt(3.0)  # of an element from its middle: points of the mean with two values
SINE_EIGHTH = 0.38  # less than sin 22.5 deg
DEEP = 40.0  # exponent whose decay is below the last bit
NO_LOSS = 1000.0  # over an element of a rotor without this loss
NEAR_TIP = 0.05  # decay up to which five terms of the series are enough
INVERSE_PI = 1.0 / math.pi
SERIES = tuple(INVERSE_PI * share for share in (1.0 / 6.0, 3.0 / 40.0, 5.0 / 112.0, 35.0 / 1152.0))  # arcsine's, z^3 on
NO_TIP_LOSS, TIP_LOSS = 1, 2  # of the switch `section_options`
HALVINGS = 6
F0, F1, F2, F3, F4, F5, F6, F7, F8, F9, F10, F11, F12, F13, F14 = ((-1.0) ** k / math.factorial(k) for k in range(15))


@kernel
def span_flow(blade, basis, motion, hub_velocity, induced, gradient):
    """Flow along the span; see `sbs_sim.model.blade.section_flow`. A turn about a hinge moves no section along it."""
    hinge = (
        to_blade(blade, basis, hub_velocity) + cross(motion.hub, basis.lag_hinge) + cross(motion.arm, basis.flap_hinge)
    )
    up = basis.span.z
    return SpanFlow(
        dot(basis.span, hinge) + up * (induced + blade.hinge_offset * gradient),
        rounded(up * gradient),
    )


@kernel
def decay(x):
    """e^-x for 0 <= x <= DEEP, beyond which it is that of DEEP."""
    small = minimum(x, DEEP) * (1.0 / 2.0**HALVINGS)
    q = small * small + 0.0
    q2 = q * q + 0.0
    q4 = q2 * q2 + 0.0
    # Estrin's order: fewer operations wait for each other than in Horner's
    low = (F0 + F1 * small + (F2 + F3 * small) * q) + (F4 + F5 * small + (F6 + F7 * small) * q) * q2
    high = (F8 + F9 * small + (F10 + F11 * small) * q) + (F12 + F13 * small + F14 * q) * q2
    found = low + high * q4
    for _ in range(HALVINGS):
        found = found * found + 0.0
    return found


class TipSeries(NamedTuple):
    """Powers of a decay in 1 less the factor of an element: 1, 3, 5, 7 and 9."""

    first: Any
    third: Any
    fifth: Any
    seventh: Any
    ninth: Any


@kernel
def tip_series(ratio):
    """Series of the arcsine for two decays together, the inner one `ratio` times the outer one."""
    square = ratio * ratio + 0.0
    cube = square * ratio + 0.0
    fifth = cube * square + 0.0
    seventh = fifth * square + 0.0
    return TipSeries(
        INVERSE_PI * ratio + INVERSE_PI,
        SERIES[0] * cube + SERIES[0],
        SERIES[1] * fifth + SERIES[1],
        SERIES[2] * seventh + SERIES[2],
        SERIES[3] * rounded(seventh * square) + SERIES[3],
    )


@kernel
def mean_factor(outer, ratio, series):
    """Mean of Prandtl's factor (2 / pi) arccos e at the decay e = `outer` and at `ratio` times that.

    Near the tip by the angle whose cosine and sine are those of the sum. Where both decays are small, which is nearly
    everywhere, by the series: what it leaves out is below the last bit.
    """
    if seldom(any_lane(outer > NEAR_TIP)):
        inner = outer * ratio + 0.0
        if any_lane(outer > SINE_EIGHTH):
            outer_sine, inner_sine = sqrt((1.0 - outer) * (1.0 + outer)), sqrt((1.0 - inner) * (1.0 + inner))
            sine = outer_sine * inner + rounded(inner_sine * outer)
            cosine = outer * inner - rounded(outer_sine * inner_sine)
            return rounded(INVERSE_PI * angle_of(sine, cosine, 1.0))
        return 1.0 - INVERSE_PI * (small_arcsine(outer) + small_arcsine(inner))
    p = outer * outer + 0.0
    share = series.first + p * (series.third + p * (series.fifth + p * (series.seventh + p * series.ninth)))
    return 1.0 - outer * share


@kernel
def set_tip_factors(blade, strip, through):
    """Set the share of the lift that is left of every element, eq. (4.14), from the tip inwards.

    `through` is the flow through the disc [m/s].
    """
    tip = blade.rotor_speed * blade.radius
    rate = 0.5 * blade.tip_blades * sqrt(tip * tip + through * through) / (abs(through) + TINY)
    over_element = select(blade.tip_blades > 0.0, rate * blade.element_width, NO_LOSS)
    outer, ratio = decay(over_element * (0.5 - GAUSS)), decay(over_element * (2.0 * GAUSS))
    step = rounded(outer * outer) * ratio + 0.0
    series = tip_series(ratio)
    for k in range(strip.shape[0]):
        strip[strip.shape[0] - 1 - k].tip_factor = mean_factor(outer, ratio, series)
        outer = outer * step + 0.0


class GustPowers(NamedTuple):
    """Forces on elements times the velocity of the air there less that at the hub [W]: within a duct, and without."""

    met: Any
    free: Any


@kernel
def flow_at(flow, gusts, i):
    """Flow of blades as an element meets it."""
    if gusts is None:
        return flow
    gust = gust_at(gusts, i)
    return SectionFlow(flow.u_t_hinge - gust.y, flow.u_t_slope, flow.u_p_hinge - gust.z, flow.u_p_slope)


@kernel
def along_at(blade, along, gusts, i, s):
    """Velocity of an element along the span that its drag feels [m/s]; `along` is that without gusts."""
    if gusts is None:
        return along.hinge + along.slope * s
    return (along.hinge + along.slope * s) - blade.oblique_drag * gust_at(gusts, i).x


@kernel
def optional_loads(air, blade, elements, knots, table, strip, flow, along, pitch, through, switches, separation, gusts):
    """Air loads of blades as those of `sbs_sim.model.section.section_loads`; Int dF and Int s dF along the span.

    Parameters
    ----------
    along : SpanFlow
    through : lanes
        Flow through the disc [m/s].
    switches : record SWITCHES
    separation : Separation
    gusts : ElementGusts or None
        What the air at the elements differs by from that at the hub.
    """
    if switches.section_options == TIP_LOSS:
        set_tip_factors(blade, strip, through)
    else:
        for i in range(elements.shape[0]):
            strip[i].tip_factor = zeros_like(pitch) + 1.0
    for i in range(elements.shape[0]):
        find_section(blade, elements[i], knots, strip[i], flow_at(flow, gusts, i), pitch)
    felt = SpanFlow(rounded(blade.oblique_drag * along.hinge), rounded(blade.oblique_drag * along.slope))
    normal_force = forward_force = normal_moment = forward_moment = zeros_like(pitch)
    outward_force = outward_moment = given = given_free = zeros_like(pitch)
    for i in range(elements.shape[0]):
        element, section = elements[i], strip[i]
        s = element.span
        own = flow_at(flow, gusts, i)
        u_t, u_p = own.u_t_hinge + own.u_t_slope * s, own.u_p_hinge + own.u_p_slope * s
        u_r = along_at(blade, felt, gusts, i, s)
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
        if gusts is not None:
            load = Vector(-rounded(drag_gain * u_r), -rearward, up)
            given = given + dot(load, gust_at(gusts, i))
            given_free = given_free + dot(load, free_gust_at(gusts, i))
    loads = AirLoads(normal_force, forward_force, normal_moment, forward_moment)
    if seldom(switches.late_stall == 1):
        late = late_loads(air, blade, elements, table, strip, flow, pitch, separation, gusts)
        added = late.loads
        loads = AirLoads(
            normal_force + added.normal_force,
            forward_force + added.forward_force,
            normal_moment + added.normal_moment,
            forward_moment + added.forward_moment,
        )
        given, given_free = given + late.powers.met, given_free + late.powers.free
    return loads, outward_force, outward_moment, GustPowers(given, given_free)


class LateLoads(NamedTuple):
    """Loads of blades beside those of steady sections, and what they take of gusts."""

    loads: Any
    powers: Any


@kernel
def late_loads(air, blade, elements, table, strip, flow, pitch, separation, gusts):
    """What the stall of sections in motion adds to the air loads of steady ones; sets the rates of its states.

    A loop of its own: in that of all sections it would cost those without it a tenth of the derivative.
    """
    normal_force = forward_force = normal_moment = forward_moment = given = given_free = zeros_like(pitch)
    for i in range(elements.shape[0]):
        element, section, own = elements[i], strip[i], flow_at(flow, gusts, i)
        s = element.span
        u_t, u_p = own.u_t_hinge + own.u_t_slope * s, own.u_p_hinge + own.u_p_slope * s
        lift, lift_slope, _, _ = table_row(table, section.row, section.fraction, DEGREE)
        alpha = pitch + element.twist - angle_of(u_p, u_t, 1.0 / section.airspeed)
        steady = lift + lift_slope * section.number
        late = late_coefficients(blade, element, separation, i, section, alpha, steady)
        scale = (air.density * element.half_area) * section.airspeed
        lift_gain = late.lift * (scale * rounded(section.tip_factor * element.lift_factor))
        drag_gain = rounded(late.drag * scale)
        up = lift_gain * u_t - drag_gain * u_p
        rearward = lift_gain * u_p + drag_gain * u_t
        normal_force, forward_force = normal_force + up, forward_force - rearward
        normal_moment, forward_moment = normal_moment + s * up, forward_moment - s * rearward
        if gusts is not None:
            load = Vector(zeros_like(pitch), -rearward, up)
            given = given + dot(load, gust_at(gusts, i))
            given_free = given_free + dot(load, free_gust_at(gusts, i))
    loads = AirLoads(normal_force, forward_force, normal_moment, forward_moment)
    return LateLoads(loads, GustPowers(given, given_free))
