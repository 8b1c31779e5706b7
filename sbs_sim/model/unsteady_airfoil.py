"""Circulation of blades that follows the flow late, by the wake that they shed (theory.md section 4.9).

The indicial function of a thin airfoil by R. T. Jones: The unsteady lift of a wing of finite aspect ratio, NACA report
681, 1940; in time by two states. T. Beddoes takes compressibility into account by the time scale, see J. G. Leishman:
Principles of Helicopter Aerodynamics, chapter 8.
"""

from sbs_sim.lanes import ZERO, Vector, maximum, rounded
from sbs_sim.model.kernel import kernel
from sbs_sim.model.multiblade import add_first_rotation_terms, add_values, blade_value, set_coordinates
from sbs_sim.model.offset import Flow
from sbs_sim.model.section import SectionFlow
from sbs_sim.model.section_options import SpanFlow
from sbs_sim.model.trigonometry import TINY, cosine_sine, inverse_root

SHARES, RATES = (0.165, 0.335), (0.0455, 0.3)  # A_1, A_2, and b_1, b_2 per semi-chord that the section has gone
STATION = 0.75  # radius of the section, over R
LEAST_COMPRESSION = 0.19  # 1 - M^2 that the time scale has at least: that of M = 0.9


@kernel
def set_circulation(indices, memory, blade, terms, pose, flow, pitch):
    """Set the rates of the two parts of the circulation of blades, eq. (4.16), and the wash of the wake, eq. (4.17)."""
    s, x = blade.wake_span, memory.state
    u_t, u_p = flow.u_t_hinge + flow.u_t_slope * s, flow.u_p_hinge + flow.u_p_slope * s
    cosine, sine = cosine_sine(pitch + blade.wake_pitch)
    across = rounded((u_t * sine - u_p * cosine) * blade.inverse_wake_speed)
    squared = u_t * u_t + u_p * u_p + TINY
    airspeed = squared * inverse_root(squared)
    mach = rounded(airspeed * blade.inverse_sound_speed)
    along = rounded(airspeed * maximum(1.0 - mach * mach, LEAST_COMPRESSION))
    slow = across - blade_value(x, indices.wake_slow, blade, pose.cosine, pose.sine)
    fast = across - blade_value(x, indices.wake_fast, blade, pose.cosine, pose.sine)
    terms.slow_rate = rounded(along * blade.wake_slow_rate) * slow
    terms.fast_rate = rounded(along * blade.wake_fast_rate) * fast
    missing = blade.wake_slow_share * slow + blade.wake_fast_share * fast
    terms.wake_gradient = rounded(missing * blade.tip_speed) * blade.inverse_wake_radius


@kernel
def with_wake_gradient(blade, basis, flow, gradient):
    """Flow along blades with a wash that grows along the radius [1/s], down along the shaft as that of the inflow."""
    across = rounded(basis.cos_flap * gradient)
    return SectionFlow(
        flow.u_t_hinge,
        flow.u_t_slope,
        flow.u_p_hinge + blade.hinge_offset * across,
        flow.u_p_slope + across,
    )


@kernel
def offset_with_wake_gradient(blade, basis, flow, gradient):
    """The same of blades with offsets."""
    d, n = basis.span, basis.normal
    at_hinge = rounded(blade.hinge_offset * gradient)
    return Flow(
        start=flow.start + Vector(d.z * at_hinge, ZERO, n.z * at_hinge),
        slope=flow.slope + Vector(d.z * gradient, ZERO, n.z * gradient),
        turn=flow.turn,
    )


@kernel
def span_with_wake_gradient(blade, basis, along, gradient):
    """Flow along the span with it."""
    up = rounded(basis.span.z * gradient)
    return SpanFlow(along.hinge + blade.hinge_offset * up, along.slope + up)


@kernel
def set_circulation_rates(aircraft, memory, dx):
    """Set the rates of the coordinates of both parts."""
    for r in range(aircraft.blades.shape[0]):
        terms = memory.terms[r]
        add_values(aircraft.blades[r], terms, terms.slow_rate, terms.fast_rate, memory.means, memory.harmonics)
    for j in range(aircraft.rotors.shape[0]):
        rotor = aircraft.rotors[j]
        if rotor.wake >= 0:
            set_coordinates(rotor, memory.means, memory.harmonics, dx, rotor.wake, rotor.wake + rotor.blades)
            add_first_rotation_terms(rotor, memory.state, dx, rotor.wake)
            add_first_rotation_terms(rotor, memory.state, dx, rotor.wake + rotor.blades)
