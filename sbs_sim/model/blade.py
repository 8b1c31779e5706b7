"""Blades: kinematics, and the terms of their flap and lag equations (theory.md sections 2 to 5).

A blade is worked out in its own basis (y, t, u): y along the line from lag to flap hinge, t along the motion, u up
along the shaft. For a counter-clockwise rotor this basis is right-handed; for a clockwise one it is left-handed, and
angular velocities and moments are stored with the factor G = -1. In that convention every formula below is the one
of a counter-clockwise rotor, and mirrored aircraft are mirrored exactly.
"""

from typing import Any, NamedTuple

from sbs_sim.lanes import ZERO, Vector, cross, dot, maximum, rounded, select
from sbs_sim.model.kernel import kernel
from sbs_sim.model.section import SectionFlow
from sbs_sim.model.trigonometry import TINY, cosine_sine, inverse_root


class Pose(NamedTuple):
    """Azimuth of a blade, and its angles and rates about its hinges.

    Attributes
    ----------
    cosine, sine : lanes
        Of the azimuth psi_k.
    beta, beta_rate, xi, xi_rate : lanes
        Flap and lag [rad, rad/s].
    """

    cosine: Any
    sine: Any
    beta: Any
    beta_rate: Any
    xi: Any
    xi_rate: Any


class Basis(NamedTuple):
    """Directions and hinges of a blade, eqs. (2.1) and (2.2); vectors have components along (y, t, u).

    Attributes
    ----------
    cosine, sine : lanes
        Of the azimuth of y: psi_k less the lag.
    cos_flap : lanes
    span, normal : Vector
        d and n.
    lag_hinge, flap_hinge : Vector
        e_L e_y, from the hub centre to the lag hinge, and e_F y, from there to the flap hinge [m].
    """

    cosine: Any
    sine: Any
    cos_flap: Any
    span: Any
    normal: Any
    lag_hinge: Any
    flap_hinge: Any


class Motion(NamedTuple):
    """Angular velocities [rad/s], along (y, t, u) with the factor G, eq. (2.3).

    Attributes
    ----------
    hub, arm, blade : Vector
        om_h, om_l, om_b: of the rotating hub, of the arm between the hinges, of the blade.
    spin, lag_rate, flap_rate : Vector
        Omega, xi' and beta' along the axes that they turn about.
    body : Vector
        om.
    """

    hub: Any
    arm: Any
    blade: Any
    spin: Any
    lag_rate: Any
    flap_rate: Any
    body: Any


class Accelerations(NamedTuple):
    """a_F and a_s of eq. (2.6): a_F + s a_s along the blade [m/s^2], without beta'', xi'' and that of the hub."""

    hinge: Any
    slope: Any


class ForceMoment(NamedTuple):
    """Six-vector of section 5.1: a force, and the moment about the hub centre or about the c.g."""

    force: Any
    moment: Any


class HingeMoments(NamedTuple):
    """Q_beta, Q_xi [N m] and 1 / A_2 of eq. (3.1)."""

    flap: Any
    lag: Any
    inverse_lag_inertia: Any


@kernel
def blade_basis(blade, pose):
    """Directions and hinges of a blade."""
    cos_lag, sin_lag = cosine_sine(pose.xi)
    cos_flap, sin_flap = cosine_sine(pose.beta)
    return Basis(
        cosine=pose.cosine * cos_lag + pose.sine * sin_lag,
        sine=pose.sine * cos_lag - pose.cosine * sin_lag,
        cos_flap=cos_flap,
        span=Vector(cos_flap, ZERO, sin_flap),
        normal=Vector(-sin_flap, ZERO, cos_flap),
        lag_hinge=Vector(blade.lag_hinge_offset * cos_lag, blade.lag_hinge_offset * sin_lag, ZERO),
        flap_hinge=Vector(blade.flap_hinge_offset, ZERO, ZERO),
    )


@kernel
def to_blade(blade, basis, vector):
    """Components along (y, t, u) of a vector in hub axes."""
    c, s, sense = basis.cosine, basis.sine, blade.sense
    return Vector(sense * s * vector.y - c * vector.x, s * vector.x + sense * c * vector.y, -vector.z)


@kernel
def to_body(blade, basis, vector):
    """Body components of a vector along (y, t, u)."""
    c, s, sense = basis.cosine, basis.sine, blade.sense
    x = s * vector.y - c * vector.x
    y = sense * (s * vector.x + c * vector.y)
    return blade.axes @ Vector(x, y, -vector.z)


@kernel
def blade_motion(blade, basis, pose, omega):
    """Angular velocities of a blade; `omega` is that of the body in hub axes [rad/s]."""
    body = to_blade(blade, basis, omega) * blade.sense
    spin = Vector(ZERO, ZERO, blade.rotor_speed)
    lag_rate = Vector(ZERO, ZERO, pose.xi_rate)
    flap_rate = Vector(ZERO, -pose.beta_rate, ZERO)
    hub = body + spin
    arm = hub - lag_rate
    return Motion(hub, arm, arm + flap_rate, spin, lag_rate, flap_rate, body)


@kernel
def section_flow(blade, basis, motion, hub_velocity, induced, gradient):
    """Flow along the blade, eqs. (2.4) and (4.2).

    Parameters
    ----------
    hub_velocity : Vector
        V_hub: of the hub relative to the air, hub axes [m/s].
    induced, gradient : lanes
        Induced velocity at the hub, downwards positive [m/s], and its slope along the radius [1/s].
    """
    hinge = (
        to_blade(blade, basis, hub_velocity) + cross(motion.hub, basis.lag_hinge) + cross(motion.arm, basis.flap_hinge)
    )
    slope = cross(motion.blade, basis.span)
    cos_flap = basis.cos_flap
    return SectionFlow(
        u_t_hinge=hinge.y,
        u_t_slope=slope.y,
        u_p_hinge=dot(basis.normal, hinge) + cos_flap * (induced + blade.hinge_offset * gradient),
        u_p_slope=dot(basis.normal, slope) + cos_flap * gradient,
    )


@kernel
def blade_accelerations(basis, motion):
    """Accelerations along the blade, eqs. (2.5) and (2.6)."""
    gamma_h = cross(motion.body, motion.spin)
    gamma_l = gamma_h - cross(motion.hub, motion.lag_rate)
    gamma_b = gamma_l + cross(motion.arm, motion.flap_rate)
    hinge = (
        cross(gamma_h, basis.lag_hinge)
        + cross(motion.hub, cross(motion.hub, basis.lag_hinge))
        + cross(gamma_l, basis.flap_hinge)
        + cross(motion.arm, cross(motion.arm, basis.flap_hinge))
    )
    slope = cross(gamma_b, basis.span) + cross(motion.blade, cross(motion.blade, basis.span))
    return Accelerations(hinge, slope)


@kernel
def hinge_moments(blade, basis, pose, loads, a_0, a_s):
    """Moments that accelerate flap and lag, eq. (3.1), and the inertia about the lag hinge, eq. (3.2).

    Parameters
    ----------
    loads : AirLoads
    a_0, a_s : Vector
        Known acceleration of the flap hinge [m/s^2], and its slope along the blade [1/s^2].
    """
    cos_flap, e_f = basis.cos_flap, blade.flap_hinge_offset
    k1 = e_f * blade.mass + cos_flap * blade.first_moment
    k2 = e_f * blade.first_moment + cos_flap * blade.second_moment
    flap = (
        loads.normal_moment
        - blade.flap_spring * (pose.beta - blade.flap_rest)
        - blade.first_moment * dot(basis.normal, a_0)
        - blade.second_moment * dot(basis.normal, a_s)
    )
    lag = (
        k1 * a_0.y
        + k2 * a_s.y
        - (e_f * loads.forward_force + cos_flap * loads.forward_moment)
        - blade.lag_spring * (pose.xi - blade.lag_rest)
        - blade.lag_damping * pose.xi_rate
    )
    lag_inertia = e_f * (k1 + cos_flap * blade.first_moment) + cos_flap * cos_flap * blade.second_moment
    return HingeMoments(flap, lag, 1.0 / lag_inertia)


class Damper(NamedTuple):
    """Axial lag damper: its force [N], and its elongation by flap, lag and pitch [m/rad]."""

    force: Any
    by_flap: Any
    by_lag: Any
    by_pitch: Any


@kernel
def axial_damper(blade, basis, pose, pitch, pitch_rate):
    """Axial lag damper of a blade, eqs. (3.7) and (3.8).

    Parameters
    ----------
    pitch, pitch_rate : lanes
        At the hinge [rad, rad/s].
    """
    a, b, c, d, r = blade.damper_a, blade.damper_b, blade.damper_c, blade.damper_d, blade.damper_r
    cos_lag, sin_lag = cosine_sine(pose.xi - blade.lag_rest)
    cos_pitch, sin_pitch = cosine_sine(pitch)
    cos_flap, sin_flap = basis.cos_flap, basis.span.z
    along, across = b * cos_lag + d * sin_lag, d * cos_lag - b * sin_lag  # of the end on the blade
    back, down = r * cos_pitch, r * sin_pitch  # of the end on the hub
    x = c + (a * sin_flap + along * cos_flap)
    y = across - back
    z = a * cos_flap - along * sin_flap - down
    inverse_length = inverse_root(x * x + y * y + z * z + TINY)
    by_flap = rounded((z * c + x * down) * inverse_length)
    by_lag = rounded((across * (x * cos_flap - z * sin_flap) - along * y) * inverse_length)
    by_pitch = rounded((y * down - z * back) * inverse_length)
    force = rounded(blade.damper_damping * (by_flap * pose.beta_rate + by_lag * pose.xi_rate + by_pitch * pitch_rate))
    return Damper(force, by_flap, by_lag, by_pitch)


@kernel
def with_axial_damper(blade, basis, pose, moments, pitch, pitch_rate):
    """Hinge moments with those of an axial lag damper, eq. (3.9); the parameters are those of `axial_damper`."""
    damper = axial_damper(blade, basis, pose, pitch, pitch_rate)
    flap, lag = moments.flap - damper.by_flap * damper.force, moments.lag - damper.by_lag * damper.force
    return HingeMoments(flap, lag, moments.inverse_lag_inertia)


@kernel
def with_lag_stops(blade, pose, moments):
    """Hinge moments with those of the lag stops, eq. (3.13): they push, and never pull.

    Parameters
    ----------
    moments : HingeMoments
    """
    spring, damping = blade.lag_stop_spring, blade.lag_stop_damping
    behind, ahead = pose.xi - blade.lag_stop_last, blade.lag_stop_first - pose.xi
    force_behind = maximum(spring * behind + damping * pose.xi_rate, 0.0)
    force_ahead = maximum(spring * ahead - damping * pose.xi_rate, 0.0)
    stops = select(ahead > 0.0, force_ahead, 0.0) - select(behind > 0.0, force_behind, 0.0)
    return HingeMoments(moments.flap, moments.lag + stops, moments.inverse_lag_inertia)


@kernel
def hinge_columns(blade, basis):
    """c_beta and c_xi of eq. (5.3), about the hub: loads that unit accelerations of flap and lag take off the hub."""
    cos_flap, e_f = basis.cos_flap, blade.flap_hinge_offset
    k1 = e_f * blade.mass + cos_flap * blade.first_moment
    k2 = e_f * blade.first_moment + cos_flap * blade.hub_second_moment
    hinge = basis.lag_hinge + basis.flap_hinge
    forward = Vector(ZERO, 1.0, ZERO)  # t
    flap_axis = Vector(ZERO, -1.0, ZERO)
    flap, lag = basis.normal * blade.first_moment, forward * k1
    return (
        ForceMoment(flap, cross(hinge, flap) + flap_axis * blade.hub_second_moment),
        ForceMoment(-lag, -(cross(hinge, lag) + cross(basis.span, forward) * k2)),
    )


@kernel
def known_loads(blade, basis, loads, a_0, a_s):
    """P and N of eq. (5.4): loads of a blade on the hub, without those of the accelerations that are sought.

    Parameters
    ----------
    loads : AirLoads
    a_0, a_s : Vector
        See `hinge_moments`.
    """
    hinge = basis.lag_hinge + basis.flap_hinge
    forward = Vector(ZERO, 1.0, ZERO)  # t
    force = (
        basis.normal * loads.normal_force
        + forward * loads.forward_force
        - (a_0 * blade.mass + a_s * blade.first_moment)
    )
    first_moment = (
        basis.normal * loads.normal_moment
        + forward * loads.forward_moment
        - (a_0 * blade.first_moment + a_s * blade.hub_second_moment)
    )
    return ForceMoment(force, cross(hinge, force) + cross(basis.span, first_moment))


@kernel
def with_outward_force(basis, loads, outward_force):
    """Loads on the hub with those of a force along the span, whose line goes through both hinges."""
    force = basis.span * outward_force
    return ForceMoment(loads.force + force, loads.moment + cross(basis.lag_hinge + basis.flap_hinge, force))


@kernel
def about_cg(blade, basis, loads):
    """Body components of a six-vector about the hub centre, moved to the c.g."""
    force = to_body(blade, basis, loads.force)
    return ForceMoment(force, to_body(blade, basis, loads.moment * blade.sense) + cross(blade.hub, force))


@kernel
def locked_inertia(blade, basis):
    """First moment s and the elements xx, yy, zz, xy, yz, zx of E, eq. (5.5), of a blade with locked hinges."""
    h = blade.hub + to_body(blade, basis, basis.lag_hinge + basis.flap_hinge)
    d = to_body(blade, basis, basis.span)
    first = h * blade.mass + d * blade.first_moment
    along = h * blade.first_moment + d * blade.hub_second_moment
    second = (
        h.x * first.x + d.x * along.x,
        h.y * first.y + d.y * along.y,
        h.z * first.z + d.z * along.z,
        h.x * first.y + d.x * along.y,
        h.y * first.z + d.y * along.z,
        h.z * first.x + d.z * along.x,
    )
    return first, second


@kernel
def paper_moment(blade, basis, pose, loads):
    """Moment on the hub in the paper's reading without its inertial part, and the flap axis (theory.md section 9)."""
    lift = basis.cos_flap * loads.normal_force
    hinge = basis.lag_hinge + basis.flap_hinge
    moment = Vector(
        hinge.y * lift - basis.span.z * loads.forward_moment,
        -(hinge.x * lift) - loads.normal_moment - blade.flap_spring * (pose.beta - blade.flap_rest),
        ZERO,
    )
    flap_axis = Vector(ZERO, -1.0, ZERO)
    return to_body(blade, basis, moment * blade.sense), to_body(blade, basis, flap_axis * blade.sense)
