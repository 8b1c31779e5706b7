"""Blades whose quarter chord or mass is not on the pitch axis (theory.md sections 2.6, 3.6 and 4.7).

Such a blade is a rigid body that hangs from flap, lag and pitch. It is worked out about the point p* of its pitch axis,
in the directions d, t, n of its span, its motion and its normal. Every freedom moves it by a velocity of p* and a turn;
moments, inertias and columns are what the loads do on these motions.
"""

from typing import Any, NamedTuple

from sbs_sim.lanes import ZERO, Vector, cross, dot, rounded, select, zeros_like
from sbs_sim.model.blade import ForceMoment, blade_accelerations, to_blade, to_body
from sbs_sim.model.element_gusts import free_gust_at, gust_at
from sbs_sim.model.kernel import kernel
from sbs_sim.model.section import DEGREE, table_cell, table_row
from sbs_sim.model.trigonometry import TINY, angle_of, cosine_sine, inverse_root


class PitchMotion(NamedTuple):
    """Pitch of a blade with swashplates that do not move.

    Attributes
    ----------
    slope, curvature : lanes
        First and second derivative by the azimuth.
    rate : lanes
        [rad/s]
    acceleration : lanes
        [rad/s^2], without that of flap, lag and shaft.
    """

    slope: Any
    curvature: Any
    rate: Any
    acceleration: Any


class Freedom(NamedTuple):
    """What a unit rate of flap, lag or pitch is for the blade: velocity of p*, and turn."""

    start: Any
    turn: Any


class Freedoms(NamedTuple):
    """Of flap, lag and pitch."""

    flap: Any
    lag: Any
    pitch: Any


class Mass(NamedTuple):
    """First and second moments of the blade about p* along t and n, at its pitch, eq. (2.12); those along d are given.

    Attributes
    ----------
    first_t, first_n : lanes
        [kg m]
    dt, dn, tt, tn, nn : lanes
        [kg m^2]
    """

    first_t: Any
    first_n: Any
    dt: Any
    dn: Any
    tt: Any
    tn: Any
    nn: Any


class Field(NamedTuple):
    """Acceleration of the points of a blade: at p* [m/s^2], and its slopes along d, t and n [1/s^2]."""

    start: Any
    along: Any
    chord: Any
    normal: Any


class Flow(NamedTuple):
    """Velocity of a blade in the air, components along d, t and n, eq. (4.11).

    Attributes
    ----------
    start, slope : Vector
        At p* [m/s], and per distance along the span [1/s].
    turn : Vector
        Angular velocity of the blade, pitch included [rad/s].
    """

    start: Any
    slope: Any
    turn: Any


class AirLoads(NamedTuple):
    """Air loads of a blade: six-vector about p*, along (y, t, u); Int dF_n, Int s dF_n, Int s dF_d, Int s dF_t.

    `given` and `given_free` are forces times the velocity of the air at elements less that at the hub [W].
    """

    load: Any
    normal_force: Any
    normal_moment: Any
    span_moment: Any
    forward_moment: Any
    given: Any
    given_free: Any


class Equations(NamedTuple):
    """A blade in eq. (5.6).

    Attributes
    ----------
    known, flap, lag, pitch : ForceMoment
        Known loads and the columns of the freedoms, six-vectors about the hub, along (y, t, u).
    moments : tuple of 3 lanes
        Q_beta, Q_xi without springs and dampers, and the moment about the pitch axis [N m].
    flap_inertia, flap_lag, lag_inertia, flap_pitch, lag_pitch, pitch_inertia : lanes
        A of eq. (3.15) [kg m^2].
    """

    known: Any
    flap: Any
    lag: Any
    pitch: Any
    moments: Any
    flap_inertia: Any
    flap_lag: Any
    lag_inertia: Any
    flap_pitch: Any
    lag_pitch: Any
    pitch_inertia: Any


@kernel
def along_motion():
    """T in the basis (y, t, u)."""
    return Vector(ZERO, 1.0, ZERO)


@kernel
def freedoms(blade, basis):
    """Motions of the blade by unit rates of flap, lag and pitch; flap and lag take pitch with them, eq. (3.14)."""
    d, t = basis.span, along_motion()
    return Freedoms(
        flap=Freedom(d * -blade.axis_height, -t - d * blade.pitch_flap_coupling),
        lag=Freedom(
            t * (blade.axis_height * d.z - blade.flap_hinge_offset),
            Vector(ZERO, ZERO, -1.0) - d * blade.pitch_lag_coupling,
        ),
        pitch=Freedom(Vector(ZERO, ZERO, ZERO), d),
    )


@kernel
def work(freedom, load):
    """Power of a six-vector about p* on a unit rate."""
    return rounded(dot(freedom.start, load.force) + dot(freedom.turn, load.moment))


@kernel
def pitched_mass(blade, pitch):
    """Moments of the mass about p*, eq. (2.12)."""
    c, s = cosine_sine(pitch)
    cc, ss, cs = c * c, s * s, rounded(c * s)
    chord, mixed, normal = blade.chord_second, blade.mixed_second, blade.normal_second
    return Mass(
        first_t=blade.chord_first * c - blade.normal_first * s,
        first_n=blade.chord_first * s + blade.normal_first * c,
        dt=blade.chord_product * c - blade.normal_product * s,
        dn=blade.chord_product * s + blade.normal_product * c,
        tt=chord * rounded(cc) - 2.0 * mixed * cs + normal * rounded(ss),
        tn=(chord - normal) * cs + mixed * (cc - ss),
        nn=chord * rounded(ss) + 2.0 * mixed * cs + normal * rounded(cc),
    )


@kernel
def turned(basis, freedom):
    """Field of accelerations of a unit acceleration of a freedom."""
    turn = freedom.turn
    return Field(freedom.start, cross(turn, basis.span), cross(turn, along_motion()), cross(turn, basis.normal))


@kernel
def known_field(blade, basis, motion, pitch_motion, at_hub):
    """Accelerations of the blade's points without those that are sought, eq. (2.13)."""
    own = blade_accelerations(basis, motion)
    d, t, n = basis.span, along_motion(), basis.normal
    arm = cross(motion.body, motion.spin) - cross(motion.hub, motion.lag_rate)
    without_pitch = arm + cross(motion.arm, motion.flap_rate)
    omega = motion.blade
    at_axis = cross(without_pitch, n) + cross(omega, cross(omega, n))
    rate = d * pitch_motion.rate
    gamma = without_pitch + cross(omega, rate) + d * pitch_motion.acceleration
    omega = omega + rate
    return Field(
        start=own.hinge + at_hub + at_axis * blade.axis_height,
        along=own.slope,
        chord=cross(gamma, t) + cross(omega, cross(omega, t)),
        normal=cross(gamma, n) + cross(omega, cross(omega, n)),
    )


@kernel
def of_mass(blade, basis, mass, field):
    """Six-vector about p* that accelerates the mass of a blade."""
    start, along, chord, normal = field
    s_1, a_1 = blade.first_moment, blade.hub_second_moment
    force = start * blade.mass + along * s_1 + chord * mass.first_t + normal * mass.first_n
    by_d = start * s_1 + along * a_1 + chord * mass.dt + normal * mass.dn
    by_t = start * mass.first_t + along * mass.dt + chord * mass.tt + normal * mass.tn
    by_n = start * mass.first_n + along * mass.dn + chord * mass.tn + normal * mass.nn
    moment = cross(basis.span, by_d) + cross(along_motion(), by_t) + cross(basis.normal, by_n)
    return ForceMoment(force, moment)


@kernel
def axis_point(blade, basis):
    """p*, from the hub centre [m]."""
    return basis.lag_hinge + basis.flap_hinge + basis.normal * blade.axis_height


@kernel
def about_hub(blade, basis, load):
    """Six-vector about p*, moved to the hub centre."""
    return ForceMoment(load.force, load.moment + cross(axis_point(blade, basis), load.force))


@kernel
def blade_equations(blade, basis, motion, pitch, pitch_motion, air_load, at_hub):
    """Columns, inertias and known loads of a blade, eqs. (3.15) and (3.16).

    Parameters
    ----------
    pitch : lanes
        At the hinge [rad].
    pitch_motion : PitchMotion
    air_load : ForceMoment
        About p*.
    at_hub : Vector
        Known acceleration of the hub [m/s^2].
    """
    mass, free = pitched_mass(blade, pitch), freedoms(blade, basis)
    flap = of_mass(blade, basis, mass, turned(basis, free.flap))
    lag = of_mass(blade, basis, mass, turned(basis, free.lag))
    turning = of_mass(blade, basis, mass, turned(basis, free.pitch))
    inertial = of_mass(blade, basis, mass, known_field(blade, basis, motion, pitch_motion, at_hub))
    known = ForceMoment(air_load.force - inertial.force, air_load.moment - inertial.moment)
    return Equations(
        known=about_hub(blade, basis, known),
        flap=about_hub(blade, basis, flap),
        lag=about_hub(blade, basis, lag),
        pitch=about_hub(blade, basis, turning),
        moments=(work(free.flap, known), work(free.lag, known), work(free.pitch, known)),
        flap_inertia=work(free.flap, flap),
        flap_lag=work(free.flap, lag),
        lag_inertia=work(free.lag, lag),
        flap_pitch=work(free.flap, turning),
        lag_pitch=work(free.lag, turning),
        pitch_inertia=work(free.pitch, turning),
    )


@kernel
def locked_offset_inertia(blade, basis, pitch):
    """First moment and the elements of E, eq. (5.5), about the c.g., of a blade with locked hinges."""
    mass = pitched_mass(blade, pitch)
    h = blade.hub + to_body(blade, basis, axis_point(blade, basis))
    d, t, n = (
        to_body(blade, basis, basis.span),
        to_body(blade, basis, along_motion()),
        to_body(blade, basis, basis.normal),
    )
    s_1 = blade.first_moment
    first = h * blade.mass + d * s_1 + t * mass.first_t + n * mass.first_n
    by_d = h * s_1 + d * blade.hub_second_moment + t * mass.dt + n * mass.dn
    by_t = h * mass.first_t + d * mass.dt + t * mass.tt + n * mass.tn
    by_n = h * mass.first_n + d * mass.dn + t * mass.tn + n * mass.nn
    second = (
        h.x * first.x + d.x * by_d.x + t.x * by_t.x + n.x * by_n.x,
        h.y * first.y + d.y * by_d.y + t.y * by_t.y + n.y * by_n.y,
        h.z * first.z + d.z * by_d.z + t.z * by_t.z + n.z * by_n.z,
        h.x * first.y + d.x * by_d.y + t.x * by_t.y + n.x * by_n.y,
        h.y * first.z + d.y * by_d.z + t.y * by_t.z + n.y * by_n.z,
        h.z * first.x + d.z * by_d.x + t.z * by_t.x + n.z * by_n.x,
    )
    return first, second


@kernel
def offset_flow(blade, basis, motion, pitch_rate, hub_velocity, induced, gradient):
    """Flow along the blade, eq. (4.11); arguments as in `sbs_sim.model.blade.section_flow`."""
    d, n = basis.span, basis.normal
    omega = motion.blade
    hinge = (
        to_blade(blade, basis, hub_velocity) + cross(motion.hub, basis.lag_hinge) + cross(motion.arm, basis.flap_hinge)
    )
    at_hinge = induced + blade.hinge_offset * gradient
    start = hinge + cross(omega, n) * blade.axis_height + Vector(ZERO, ZERO, at_hinge)
    slope = cross(omega, d) + Vector(ZERO, ZERO, gradient)
    return Flow(
        start=Vector(dot(d, start), start.y, dot(n, start)),
        slope=Vector(dot(d, slope), slope.y, dot(n, slope)),
        turn=Vector(dot(d, omega) + pitch_rate, omega.y, dot(n, omega)),
    )


@kernel
def offset_air_loads(air, blade, basis, elements, knots, table, flow, pitch, gusts):
    """Air loads of blades whose quarter chord is not straight or not on the pitch axis, eqs. (4.12) and (4.13).

    Parameters
    ----------
    air, blade : records AIR, BLADE
    elements : records ELEMENT, shape (elements,)
    knots, table : see `sbs_sim.model.section.section_loads`
    flow : Flow
    pitch : lanes
        Angle of the blade's root [rad].
    gusts : ElementGusts or None
        What the air at the elements differs by from that at the hub.

    Returns
    -------
    AirLoads
    """
    cos_pitch, sin_pitch = cosine_sine(pitch)
    zero = zeros_like(pitch)
    force_d = force_t = force_n = moment_d = moment_t = moment_n = normal_moment = span_moment = forward_moment = zero
    given = given_free = zero
    for i in range(elements.shape[0]):
        element = elements[i]
        s = element.span
        ahead = element.offset_along * cos_pitch - element.offset_up * sin_pitch  # of the pitch axis
        above = element.offset_along * sin_pitch + element.offset_up * cos_pitch
        u_d = flow.start.x + flow.slope.x * s + (flow.turn.y * above - flow.turn.z * ahead)
        u_t = flow.start.y + flow.slope.y * s - flow.turn.x * above
        u_n = flow.start.z + flow.slope.z * s + flow.turn.x * ahead
        if gusts is not None:
            gust = gust_at(gusts, i)
            u_d, u_t, u_n = u_d - gust.x, u_t - gust.y, u_n - gust.z
        c, sine = cosine_sine(pitch + element.twist)
        # in the plane across the quarter-chord line: along the chord, and normal to it
        u_chord = rounded(element.cos_sweep * (u_t * c + u_n * sine)) + element.sin_sweep * u_d
        u_up = u_n * c - u_t * sine
        squared = u_chord * u_chord + u_up * u_up + TINY
        inverse_airspeed = inverse_root(squared)
        airspeed = squared * inverse_airspeed
        alpha = -angle_of(u_up, u_chord, inverse_airspeed)
        cell = table_cell(blade, element.first_row, knots, airspeed * element.number_scale, alpha)
        lift, lift_slope, drag, drag_slope = table_row(table, cell.row, cell.fraction, DEGREE)
        scale = (air.density * element.half_area) * airspeed
        lift_gain = (lift + lift_slope * cell.number) * (scale * element.lift_factor)
        drag_gain = (drag + drag_slope * cell.number) * scale
        up = lift_gain * u_chord - drag_gain * u_up
        forward = -(lift_gain * u_up + drag_gain * u_chord)
        along_chord = rounded(element.cos_sweep * forward)
        f_d = rounded(element.sin_sweep * forward)
        f_t, f_n = along_chord * c - up * sine, along_chord * sine + up * c
        force_d, force_t, force_n = force_d + f_d, force_t + f_t, force_n + f_n
        moment_d = moment_d + (ahead * f_n - above * f_t)
        moment_t = moment_t + (above * f_d - s * f_n)
        moment_n = moment_n + (s * f_t - ahead * f_d)
        normal_moment, span_moment = normal_moment + s * f_n, span_moment + s * f_d
        forward_moment = forward_moment + s * f_t
        if gusts is not None:
            load = Vector(f_d, rounded(f_t), rounded(f_n))
            given = given + dot(load, gust_at(gusts, i))
            given_free = given_free + dot(load, free_gust_at(gusts, i))
    d, t, n = basis.span, along_motion(), basis.normal
    return AirLoads(
        ForceMoment(d * force_d + t * force_t + n * force_n, d * moment_d + t * moment_t + n * moment_n),
        force_n,
        normal_moment,
        span_moment,
        forward_moment,
        given,
        given_free,
    )


@kernel
def inverse_flap_inertia(aircraft, memory, r):
    """1 / A_1 of a register r of blades, 0 for what fills up a quad."""
    if aircraft.switches[0].offsets == 1:
        return memory.pitching[r].inverse_flap_inertia
    return aircraft.blades[r].inverse_second_moment


@kernel
def inverse_where(is_there, value):
    """1 / value where something is, else 0."""
    return select(is_there > 0.0, 1.0 / value, 0.0)
