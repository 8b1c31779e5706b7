"""Blades: kinematics, and the terms of their flap and lag equations (theory.md sections 2 to 5).

A blade is worked out in its own basis (y, t, u): y along the line from lag to flap hinge, t along the motion, u up
along the shaft. For a counter-clockwise rotor this basis is right-handed; for a clockwise one it is left-handed, and
angular velocities and moments are then stored with the factor G = -1. In that convention every formula below is the one
of a counter-clockwise rotor, and mirrored aircraft are mirrored exactly.
"""

from typing import Any, NamedTuple

from sbs_sim.lanes import ZERO, Vector, cross, dot
from sbs_sim.model.kernel import kernel
from sbs_sim.model.section import SectionFlow
from sbs_sim.model.trigonometry import cosine_sine


class Pose(NamedTuple):
    """Where a blade is, and how fast it moves about its hinges.

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
    """Directions of a blade; vectors have components along (y, t, u).

    Attributes
    ----------
    cosine, sine : lanes
        Of the azimuth of y: psi_k less the lag.
    cos_flap : lanes
    span, normal : Vector
        d and n.
    lag_arm, flap_arm : Vector
        From the axis to the lag hinge, and on to the flap hinge [m].
    """

    cosine: Any
    sine: Any
    cos_flap: Any
    span: Any
    normal: Any
    lag_arm: Any
    flap_arm: Any


class Motion(NamedTuple):
    """Angular velocities of hub, lag arm and blade [rad/s], eq. (2.3), and what turns them: Omega, xi', beta'."""

    hub: Any
    arm: Any
    blade: Any
    spin: Any
    lag_rate: Any
    flap_rate: Any
    rates: Any


class Accelerations(NamedTuple):
    """a_F and a_s of eq. (2.6): along the blade a_F + s a_s [m/s^2], without beta'', xi'' and what the hub adds."""

    hinge: Any
    slope: Any


@kernel
def blade_basis(blade, pose):
    """Directions of eq. (2.1)."""
    cos_lag, sin_lag = cosine_sine(pose.xi)
    cb, sb = cosine_sine(pose.beta)
    return Basis(
        pose.cosine * cos_lag + pose.sine * sin_lag,
        pose.sine * cos_lag - pose.cosine * sin_lag,
        cb,
        Vector(cb, ZERO, sb),
        Vector(-sb, ZERO, cb),
        Vector(blade.lag_hinge * cos_lag, blade.lag_hinge * sin_lag, ZERO),
        Vector(blade.flap_hinge, ZERO, ZERO),
    )


@kernel
def to_blade(blade, basis, hub):
    """Components along (y, t, u) of a vector in hub axes."""
    c, s, sense = basis.cosine, basis.sine, blade.sense
    return Vector(sense * s * hub.y - c * hub.x, s * hub.x + sense * c * hub.y, -hub.z)


@kernel
def to_body(blade, basis, vector):
    """Body components of a vector along (y, t, u)."""
    c, s, sense = basis.cosine, basis.sine, blade.sense
    x = s * vector.y - c * vector.x
    y = sense * (s * vector.x + c * vector.y)
    return blade.axes @ Vector(x, y, -vector.z)


@kernel
def blade_motion(blade, basis, pose, rates):
    """Angular velocities; `rates` are those of the body in hub axes [rad/s]."""
    own = to_blade(blade, basis, rates) * blade.sense
    spin = Vector(ZERO, ZERO, blade.speed)
    lag_rate = Vector(ZERO, ZERO, pose.xi_rate)
    flap_rate = Vector(ZERO, -pose.beta_rate, ZERO)
    hub = own + spin
    arm = hub - lag_rate
    return Motion(hub, arm, arm + flap_rate, spin, lag_rate, flap_rate, own)


@kernel
def section_flow(blade, basis, motion, air, induced, gradient):
    """Flow along the blade, eqs. (2.4) and (4.2).

    Parameters
    ----------
    air : Vector
        Velocity of the hub relative to the air, hub axes [m/s].
    induced, gradient : lanes
        Induced velocity at the hub, downwards positive [m/s], and its slope along the blade [1/s].
    """
    hinge = to_blade(blade, basis, air) + cross(motion.hub, basis.lag_arm) + cross(motion.arm, basis.flap_arm)
    along = cross(motion.blade, basis.span)
    cb = basis.cos_flap
    return SectionFlow(
        hinge.y,
        along.y,
        dot(basis.normal, hinge) + cb * (induced + blade.hinge * gradient),
        dot(basis.normal, along) + cb * gradient,
    )


@kernel
def blade_accelerations(basis, motion):
    """Eqs. (2.5) and (2.6)."""
    of_hub = cross(motion.rates, motion.spin)
    of_arm = of_hub - cross(motion.hub, motion.lag_rate)
    of_blade = of_arm + cross(motion.arm, motion.flap_rate)
    hinge = (
        cross(of_hub, basis.lag_arm)
        + cross(motion.hub, cross(motion.hub, basis.lag_arm))
        + cross(of_arm, basis.flap_arm)
        + cross(motion.arm, cross(motion.arm, basis.flap_arm))
    )
    slope = cross(of_blade, basis.span) + cross(motion.blade, cross(motion.blade, basis.span))
    return Accelerations(hinge, slope)


@kernel
def hinge_moments(blade, basis, pose, loads, hinge, slope):
    """Q_beta and Q_xi of eq. (3.1), and 1 / A_2; hinge and slope are a_0 and a_s."""
    cb, e_f = basis.cos_flap, blade.flap_hinge
    k1 = e_f * blade.mass + cb * blade.first
    k2 = e_f * blade.first + cb * blade.second
    flap = (
        loads.normal_moment
        - blade.flap_spring * pose.beta
        - blade.first * dot(basis.normal, hinge)
        - blade.second * dot(basis.normal, slope)
    )
    lag = (
        k1 * hinge.y
        + k2 * slope.y
        - (e_f * loads.forward + cb * loads.forward_moment)
        - blade.lag_spring * pose.xi
        - blade.lag_damping * pose.xi_rate
    )
    return flap, lag, 1.0 / (e_f * (k1 + cb * blade.first) + cb * cb * blade.second)


@kernel
def couplings(blade, basis):
    """Force and moment about the hub that unit accelerations of flap and lag take, c_beta and c_xi of eq. (5.3)."""
    cb, e_f = basis.cos_flap, blade.flap_hinge
    k1 = e_f * blade.mass + cb * blade.first
    k2 = e_f * blade.first + cb * blade.second_hub
    hinge = basis.lag_arm + basis.flap_arm
    motion = Vector(ZERO, 1.0, ZERO)
    flap_axis = Vector(ZERO, -1.0, ZERO)
    flap, lag = basis.normal * blade.first, motion * k1
    return (
        flap,
        cross(hinge, flap) + flap_axis * blade.second_hub,
        -lag,
        -(cross(hinge, lag) + cross(basis.span, motion) * k2),
    )


@kernel
def known_loads(blade, basis, loads, hinge, slope):
    """Force and moment on the hub without accelerations that are sought, P and N of eq. (5.4)."""
    arm = basis.lag_arm + basis.flap_arm
    motion = Vector(ZERO, 1.0, ZERO)
    force = basis.normal * loads.normal + motion * loads.forward - (hinge * blade.mass + slope * blade.first)
    along = (
        basis.normal * loads.normal_moment
        + motion * loads.forward_moment
        - (hinge * blade.first + slope * blade.second_hub)
    )
    return force, cross(arm, force) + cross(basis.span, along)


@kernel
def about_cg(blade, basis, force, moment):
    """Body components of a force at the hub, and of the moment about the c.g."""
    at_hub = to_body(blade, basis, force)
    return at_hub, to_body(blade, basis, moment * blade.sense) + cross(blade.hub, at_hub)


@kernel
def locked_inertia(blade, basis):
    """First moment s and the six elements xx, yy, zz, xy, yz, zx of E of a blade that is locked, eq. (5.5)."""
    h = blade.hub + to_body(blade, basis, basis.lag_arm + basis.flap_arm)
    d = to_body(blade, basis, basis.span)
    s = h * blade.mass + d * blade.first
    u = h * blade.first + d * blade.second_hub
    second = (
        h.x * s.x + d.x * u.x,
        h.y * s.y + d.y * u.y,
        h.z * s.z + d.z * u.z,
        h.x * s.y + d.x * u.y,
        h.y * s.z + d.y * u.z,
        h.z * s.x + d.z * u.x,
    )
    return s, second


@kernel
def paper_moment(blade, basis, pose, loads):
    """Moment on the hub in the paper's reading without its inertial part, and the flap axis (theory.md section 9)."""
    lift = basis.cos_flap * loads.normal
    arm = basis.lag_arm + basis.flap_arm
    moment = Vector(
        arm.y * lift - basis.span.z * loads.forward_moment,
        -(arm.x * lift) - loads.normal_moment - blade.flap_spring * pose.beta,
        ZERO,
    )
    axis = Vector(ZERO, -1.0, ZERO)
    return to_body(blade, basis, moment * blade.sense), to_body(blade, basis, axis * blade.sense)
