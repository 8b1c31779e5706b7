"""Where the power of the engines goes, term by term (theory.md section 5.11).

Every term is the product of its own forces and velocities; none is what is left of the others. It is evaluated at
recorded states, outside of the flight.
"""

from typing import Any, NamedTuple

from sbs_sim.lanes import (
    ZERO,
    Vector,
    add_to_quads,
    as_lanes,
    as_records,
    cross,
    dot,
    rounded,
    select,
    spread,
    transposed,
    zeros_like,
)
from sbs_sim.model import state as S
from sbs_sim.model.air_rows import (
    AT_HUB,
    free_gust_along_blade,
    gust_along_blade,
    gust_of_blade,
    gust_of_part,
    gust_of_rotor,
    in_space,
    offset_with_gust_gradients,
    span_with_gust_gradients,
)
from sbs_sim.model.blade import (
    ForceMoment,
    HingeMoments,
    axial_damper,
    blade_accelerations,
    blade_basis,
    blade_motion,
    to_blade,
    with_lag_stops,
)
from sbs_sim.model.contact import contact_load
from sbs_sim.model.drive import ACCELERATIONS, AZIMUTHS, NONE, shaft_torque, transmission_loads
from sbs_sim.model.duct import sheltered
from sbs_sim.model.dynamics import (
    along,
    blade_pose,
    body_loads,
    body_motion,
    duct_load,
    hub_motion,
    in_lanes,
    induced_velocity,
    load_of_fuselage,
    load_of_surface,
    mass_matrix,
    memory_in_lanes,
    met_by_offsets,
    pitch_motion,
    pitch_rate,
    rates_of_inflow,
    separation_of,
    stand_loads,
    times,
    velocity_of_inflow,
    wash_of_blade,
    with_rotors,
)
from sbs_sim.model.element_gusts import element_gusts, in_elements
from sbs_sim.model.fuselage import plate_drag
from sbs_sim.model.inflow import INVERSE_INERTIA, INVERSE_MASS, Inflow
from sbs_sim.model.kernel import entry, kernel
from sbs_sim.model.offset import (
    Field,
    axis_point,
    freedoms,
    known_field,
    of_mass,
    offset_flow,
    pitched_mass,
    turned,
)
from sbs_sim.model.records import LANES, NOISE
from sbs_sim.model.section import SectionFlow, section_loads
from sbs_sim.model.section_options import optional_loads, span_flow

SUPPLY = ("engine", "actuators")
POWER_TERMS = (
    *SUPPLY,
    "induced",
    "interference",
    "profile",
    "fuselage",
    "surfaces",
    "duct",
    "wind",
    "gravity",
    "kinetic_body",
    "kinetic_blades",
    "kinetic_drives",
    "springs",
    "dampers",
    "friction",
    "contact",
    "apparent_mass",
    "support",
)
(
    ENGINE,
    ACTUATORS,
    INDUCED,
    INTERFERENCE,
    PROFILE,
    FUSELAGE,
    SURFACES,
    DUCT,
    WIND,
    GRAVITY,
    KINETIC_BODY,
    KINETIC_BLADES,
    KINETIC_DRIVES,
    SPRINGS,
    DAMPERS,
    FRICTION,
    CONTACT,
    APPARENT_MASS,
    SUPPORT,
) = range(len(POWER_TERMS))
# sums over the blades of a quad, in the order of `blade_powers`
BLADE_POWERS = dict.fromkeys(
    ("inflow", "wash", "profile", "carried", "wind", "gravity", "kinetic", "springs", "dampers", "actuators"), LANES
)


class Bodies(NamedTuple):
    """What moves and what accelerates.

    Attributes
    ----------
    flight : Flight
    air : Vector
        Velocity of the air at the c.g. [m/s], body axes.
    acceleration : Vector
        Inertial acceleration of the c.g. [m/s^2], body axes.
    angular : Vector
        om' [rad/s^2].
    """

    flight: Any
    air: Any
    acceleration: Any
    angular: Any


@entry
def power_rows(derivative, model, states, swash, psi, air, noise, work, sums, dx, out):
    """Power of every term at recorded instants.

    Parameters
    ----------
    derivative : Address
        Of the entry.
    model : Model
        `complete` coupling.
    states, swash, psi, air : ndarray, shapes (rows, size, n), (rows, 3 n_rows, n), (rows, n_rotors, n),
            (rows, 3, n) or (rows, air_rows(...), n)
        As `derivative` takes them.
    noise : ndarray, shape (rows, n_rotors, n), or (rows, 0, n)
        Of the vortex rings, see `Work.ring`.
    work : Work
    sums : structured ndarray BLADE_POWERS, shape (quads,)
        Memory.
    dx : ndarray, shape (size, n)
        Memory.
    out : ndarray, shape (rows, len(POWER_TERMS), n)
        Output [W].
    """
    for row in range(states.shape[0]):
        for j in range(noise.shape[1]):
            for lane in range(noise.shape[2]):
                work.ring[NOISE, j, lane] = noise[row, j, lane]
        derivative(model, states[row], swash[row], psi[row], air[row], work, dx, True)
        aircraft, memory = in_lanes(model), memory_in_lanes(work)
        like = aircraft.air[0]
        angles, turning = as_lanes(psi[row], like), as_lanes(work.turning, like)
        if model.drives.shape[0] > 0:
            aircraft = with_rotors(model, as_records(work.turning_rotors), as_records(work.turning_blades))
            angles = turning[AZIMUTHS]
        commands, wind, rates = as_lanes(swash[row], like), as_lanes(air[row], like), as_lanes(dx, like)
        if aircraft.switches[0].scheduled == 1:
            commands = memory.commands
        terms = as_lanes(out[row], like)
        for i in range(terms.shape[0]):
            terms[i] = zeros_like(like.density)
        flight = body_motion(aircraft, memory.state, wind)
        accelerations = memory.acceleration[0]
        inertial = accelerations.specific_force + flight.gravity
        bodies = Bodies(flight, flight.velocity - flight.air_velocity, inertial, accelerations.angular)
        add_blades(aircraft, memory, bodies, commands, angles, turning, as_records(sums), terms)
        add_inflow(aircraft, memory, rates, terms)
        add_held_engines(aircraft, memory, terms)
        add_body(aircraft, memory, bodies, commands, rates, terms)
        drives = as_records(model.drives)
        for i in range(drives.shape[0]):
            add_drive(memory.state, drives[i], bodies, rates, terms)
        if aircraft.switches[0].stand == 1:
            add_stand(aircraft, memory, drives, bodies, commands, rates, terms)


# --- blades -----------------------------------------------------------------------------------------------------


@kernel
def add_blades(aircraft, memory, bodies, commands, psi, turning, sums, terms):
    """Add the powers of the blades."""
    for r in range(aircraft.blades.shape[0]):
        powers = blade_powers(aircraft, memory, bodies, commands, psi, turning, r)
        add_to_quads(sums, aircraft.blades[r].quad, aircraft.blades[r].starts_quad, "inflow", powers)
    for j in range(aircraft.rotors.shape[0]):
        rotor = aircraft.rotors[j]
        for quad in range(rotor.first_quad, rotor.first_quad + rotor.quads):
            own = sums[quad]
            terms[INDUCED] = terms[INDUCED] + own.inflow
            terms[INTERFERENCE] = terms[INTERFERENCE] + own.wash
            terms[PROFILE] = terms[PROFILE] + own.profile
            terms[DUCT] = terms[DUCT] + own.carried
            terms[WIND] = terms[WIND] + own.wind
            terms[GRAVITY] = terms[GRAVITY] + own.gravity
            terms[KINETIC_BLADES] = terms[KINETIC_BLADES] + own.kinetic
            terms[SPRINGS] = terms[SPRINGS] + own.springs
            terms[DAMPERS] = terms[DAMPERS] + own.dampers
            terms[ACTUATORS] = terms[ACTUATORS] + own.actuators


class Blade(NamedTuple):
    """A register of blades: pose, directions and motions, velocity and acceleration of the hub over ground.

    Attributes
    ----------
    velocity, acceleration : Vector
        Of the hub, along (y, t, u) [m/s], [m/s^2].
    alpha : Vector
        Angular acceleration of hub and shaft [rad/s^2], with the factor G as `Motion`.
    speeding : lanes
        That of the shaft alone.
    gravity : Vector
        Along (y, t, u) [m/s^2].
    met : Vector
        Velocity of the hub relative to the air that the blades meet, hub axes [m/s].
    gust : Vector
        Velocity of the air at the hub less that at the c.g., hub axes [m/s].
    """

    pose: Any
    basis: Any
    motion: Any
    velocity: Any
    acceleration: Any
    alpha: Any
    speeding: Any
    gravity: Any
    met: Any
    gust: Any


@kernel
def zero_vector(like):
    """Vector of zeros."""
    none = zeros_like(like)
    return Vector(none, none, none)


@kernel
def blade_at(aircraft, memory, bodies, psi, turning, r):
    """A register of blades in motion."""
    record, flight = aircraft.blades[r], bodies.flight
    pose = blade_pose(aircraft, memory.state, record, psi)
    basis, hub, to_hub = blade_basis(record, pose), hub_motion(record, flight), transposed(record.axes)
    speeding = zeros_like(pose.beta)
    if turning.shape[1] > 0:
        speeding = spread(turning[ACCELERATIONS], aircraft.indices.azimuth, record.quad, record)
    acceleration = to_hub @ (bodies.acceleration + cross(bodies.angular, record.hub)) + hub.centripetal
    met, gust = hub.air_velocity, zero_vector(pose.beta)
    if in_space(flight.air):
        gust = gust_of_blade(aircraft, flight.air, record, AT_HUB)
        met = met - gust
    if aircraft.switches[0].ducts == 1:
        met = sheltered(record.duct_turning, met)
    return Blade(
        pose=pose,
        basis=basis,
        motion=blade_motion(record, basis, pose, hub.omega),
        velocity=to_blade(record, basis, to_hub @ (flight.velocity + cross(flight.omega, record.hub))),
        acceleration=to_blade(record, basis, acceleration),
        alpha=to_blade(record, basis, to_hub @ bodies.angular) * record.sense + Vector(ZERO, ZERO, speeding),
        speeding=speeding,
        gravity=to_blade(record, basis, to_hub @ flight.gravity),
        met=met,
        gust=gust,
    )


@kernel
def blade_powers(aircraft, memory, bodies, commands, psi, turning, r):
    """Powers of a register of blades, in the order of BLADE_POWERS, eqs. (5.23) to (5.26)."""
    record, terms, flight = aircraft.blades[r], memory.terms[r], bodies.flight
    blade = blade_at(aircraft, memory, bodies, psi, turning, r)
    inflow = inflow_of(aircraft, memory, record, terms, blade)
    if aircraft.switches[0].offsets == 1:
        pitching = pitch_motion(aircraft, record, blade.pose, commands)
        kinetic, gravity = offset_energy(record, terms, blade, pitching, memory.pitching[r].slope)
        air = offset_air_powers(aircraft, memory, flight, r, blade, pitching, inflow)
    else:
        kinetic, gravity = energy_rates(record, terms, blade)
        air = air_powers(aircraft, memory, flight, r, blade, inflow)
    hinges = hinge_powers(aircraft, record, terms, blade, commands)
    to_hub = transposed(record.axes)
    carried = hub_motion(record, flight).air_velocity - blade.gust - blade.met
    carried = -dot(to_blade(record, blade.basis, carried), air.force)
    wind = -dot(to_blade(record, blade.basis, to_hub @ bodies.air + blade.gust), air.force)
    if in_space(flight.air):
        met, free = air.met, air.free
        if not in_elements(memory):
            hinge, slope = gust_along_blade(aircraft, flight.air, record, blade.basis)
            met = dot(hinge, air.force) + dot(slope, air.moment)
            hinge, slope = free_gust_along_blade(aircraft, flight.air, record, blade.basis)
            free = dot(hinge, air.force) + dot(slope, air.moment)
        carried, wind = carried + (free - met), wind - free
    return (
        air.induced,
        air.wash,
        air.profile,
        rounded(carried),
        rounded(wind),
        gravity,
        kinetic,
        hinges.springs,
        hinges.dampers,
        hinges.actuators,
    )


@kernel
def energy_rates(record, terms, blade):
    """Rate of the kinetic energy, and power that the weight takes, eq. (5.26)."""
    basis, motion = blade.basis, blade.motion
    forward = Vector(ZERO, 1.0, ZERO)  # t
    hinge = blade.velocity + cross(motion.hub, basis.lag_hinge) + cross(motion.arm, basis.flap_hinge)
    slope = cross(motion.blade, basis.span)
    own = blade_accelerations(basis, motion)
    at_hinge = (
        blade.acceleration
        + own.hinge
        + cross(blade.alpha, basis.lag_hinge + basis.flap_hinge)
        - forward * (record.flap_hinge_offset * terms.lag_acceleration)
    )
    along_blade = (
        own.slope
        + cross(blade.alpha, basis.span)
        + basis.normal * terms.flap_acceleration
        - forward * (basis.cos_flap * terms.lag_acceleration)
    )
    first, second = record.first_moment, record.hub_second_moment
    kinetic = (
        record.mass * dot(hinge, at_hinge)
        + first * (dot(hinge, along_blade) + dot(slope, at_hinge))
        + second * dot(slope, along_blade)
    )
    return rounded(kinetic), rounded(-dot(blade.gravity, hinge * record.mass + slope * first))


@kernel
def offset_energy(record, terms, blade, pitching, pitch_slope):
    """The same of a blade with offsets: a rigid body that turns about p* (theory.md section 3.6)."""
    basis, motion = blade.basis, blade.motion
    start, turn = offset_motion(record, blade, blade.velocity, pitching.rate)
    known = known_field(record, basis, motion, pitching, blade.acceleration)
    free, alpha = freedoms(record, basis), blade.alpha
    flap, lag = turned(basis, free.flap), turned(basis, free.lag)
    pitch = turned(basis, free.pitch)
    by_shaft, d, t, n = pitch_slope * blade.speeding, basis.span, Vector(ZERO, 1.0, ZERO), basis.normal
    at_flap, at_lag = terms.flap_acceleration, terms.lag_acceleration
    field = Field(
        known.start + flap.start * at_flap + lag.start * at_lag + cross(alpha, axis_point(record, basis)),
        known.along + flap.along * at_flap + lag.along * at_lag + cross(alpha, d),
        known.chord + flap.chord * at_flap + lag.chord * at_lag + pitch.chord * by_shaft + cross(alpha, t),
        known.normal + flap.normal * at_flap + lag.normal * at_lag + pitch.normal * by_shaft + cross(alpha, n),
    )
    zero = Vector(ZERO, ZERO, ZERO)
    mass = pitched_mass(record, terms.pitch)
    inertial = of_mass(record, basis, mass, field)
    weight = of_mass(record, basis, mass, Field(blade.gravity, zero, zero, zero))
    kinetic = dot(inertial.force, start) + dot(inertial.moment, turn)
    return rounded(kinetic), rounded(-(dot(weight.force, start) + dot(weight.moment, turn)))


@kernel
def offset_motion(record, blade, hub_velocity, pitch_rate):
    """Velocity of p* of a hub that moves with a velocity along (y, t, u) [m/s], and angular velocity of the blade."""
    basis, motion = blade.basis, blade.motion
    hinge = hub_velocity + cross(motion.hub, basis.lag_hinge) + cross(motion.arm, basis.flap_hinge)
    start = hinge + cross(motion.blade, basis.normal) * record.axis_height
    return start, motion.blade + basis.span * pitch_rate


class Met(NamedTuple):
    """Induced velocity at the hub [m/s] and its slope along the radius [1/s], and what of both is wash."""

    induced: Any
    gradient: Any
    wash: Any
    wash_gradient: Any


@kernel
def inflow_of(aircraft, memory, record, own, blade):
    """What blades with terms `own` meet of the inflow, with the wash of the wake that they shed."""
    induced, gradient = induced_velocity(aircraft, memory, record, blade.pose)
    at_blades = rounded(gradient)
    if aircraft.switches[0].unsteady_airfoil == 1:
        at_blades = at_blades + own.wake_gradient
    wash, wash_gradient = zeros_like(blade.pose.beta), zeros_like(blade.pose.beta)
    if aircraft.switches[0].wash == 1:
        at_hub, slope = velocity_of_inflow(record, blade.pose, wash_of_blade(aircraft, memory, record))
        wash, wash_gradient = rounded(at_hub), rounded(slope)
    return Met(rounded(induced), at_blades, wash, wash_gradient)


class AirPowers(NamedTuple):
    """What the air takes of blades, eq. (5.24) [W]; Int dF [N] and Int s dF [N m] of it on them, along (y, t, u).

    `met` and `free`: see `sbs_sim.model.section_options.GustPowers`; zero where the air is not sampled at elements.
    """

    induced: Any
    wash: Any
    profile: Any
    force: Any
    moment: Any
    met: Any
    free: Any


@kernel
def air_powers(aircraft, memory, flight, r, blade, inflow):
    """What the air takes of blades by the forces and the flow of their sections, eq. (5.24)."""
    record, terms, basis = aircraft.blades[r], memory.terms[r], blade.basis
    flow = SectionFlow(terms.u_t_hinge, terms.u_t_slope, terms.u_p_hinge, terms.u_p_slope)
    elements, air = aircraft.elements[record.elements], aircraft.air[0]
    outward = outward_moment = outward_profile = zeros_like(terms.pitch)
    met = free = zeros_like(terms.pitch)
    if in_elements(memory):
        along_span = span_flow(record, basis, blade.motion, blade.met, inflow.induced, inflow.gradient)
        loads, outward, outward_moment, of_gusts = optional_loads(
            *(air, record, elements, aircraft.knots[r], aircraft.table, memory.strip, flow, along_span, terms.pitch),
            inflow.induced - blade.met.z,
            aircraft.switches[0],
            separation_of(aircraft, memory, r),
            element_gusts(memory, record, basis, r),
        )
        outward_profile = rounded(along_span.hinge * outward + along_span.slope * outward_moment)
        met, free = of_gusts.met, of_gusts.free
    elif aircraft.switches[0].section_options > 0:
        along_span = span_flow(record, basis, blade.motion, blade.met, inflow.induced, inflow.gradient)
        if in_space(flight.air):
            along_span = span_with_gust_gradients(aircraft, flight.air, record, basis, along_span)
        loads, outward, outward_moment, _ = optional_loads(
            *(air, record, elements, aircraft.knots[r], aircraft.table, memory.strip, flow, along_span, terms.pitch),
            inflow.induced - blade.met.z,
            aircraft.switches[0],
            separation_of(aircraft, memory, r),
            None,
        )
        outward_profile = rounded(along_span.hinge * outward + along_span.slope * outward_moment)
    else:
        loads = section_loads(air, record, elements, aircraft.knots[r], aircraft.table, memory.strip, flow, terms.pitch)
    profile = (flow.u_t_hinge * loads.forward_force + flow.u_t_slope * loads.forward_moment) + (
        flow.u_p_hinge * loads.normal_force + flow.u_p_slope * loads.normal_moment
    )
    cos_flap, sin_flap = basis.cos_flap, basis.span.z
    normal_root = rounded(record.hinge_offset * loads.normal_force) + loads.normal_moment
    outward_root = rounded(record.hinge_offset * outward) + outward_moment
    lift = rounded(cos_flap * loads.normal_force + sin_flap * outward)
    moment = rounded(cos_flap * normal_root + sin_flap * outward_root)
    forward = Vector(ZERO, 1.0, ZERO)
    force = basis.normal * loads.normal_force + forward * loads.forward_force + basis.span * outward
    arms = basis.normal * loads.normal_moment + forward * loads.forward_moment + basis.span * outward_moment
    profile = rounded(met - (profile + outward_profile))
    return powers_of(inflow, lift, moment, profile, force, arms, met, free)


@kernel
def offset_air_powers(aircraft, memory, flight, r, blade, pitching, inflow):
    """The same of blades with offsets."""
    record, basis, pitch, rate = aircraft.blades[r], blade.basis, memory.terms[r].pitch, pitching.rate
    flow = offset_flow(record, basis, blade.motion, rate, blade.met, inflow.induced, inflow.gradient)
    if in_space(flight.air) and not in_elements(memory):
        flow = offset_with_gust_gradients(aircraft, flight.air, record, basis, flow)
    loads = met_by_offsets(aircraft, memory, r, basis, flow, pitch)
    force = loads.load.force
    start, turn = offset_motion(record, blade, to_blade(record, basis, blade.met), rate)
    span_part = basis.span.z * loads.span_moment
    moment = rounded(record.hinge_offset * force.z + (basis.cos_flap * loads.normal_moment + span_part))
    through = rounded(inflow.induced * force.z + inflow.gradient * moment)
    profile = -(dot(force, start) + dot(loads.load.moment, turn)) - through
    arms = (
        basis.span * loads.span_moment
        + Vector(ZERO, 1.0, ZERO) * loads.forward_moment
        + basis.normal * loads.normal_moment
    )
    profile = profile + loads.given
    if in_space(flight.air) and not in_elements(memory):
        hinge, slope = gust_along_blade(aircraft, flight.air, record, basis)
        profile = profile + (dot(hinge, force) + dot(slope, arms))
    return powers_of(
        inflow, rounded(force.z), moment, rounded(profile), force, arms, loads.given + 0.0, loads.given_free + 0.0
    )


@kernel
def powers_of(inflow, lift, moment, profile, force, arms, met, free):
    """Powers by the force along the shaft, and by its moment about it."""
    wash = rounded(inflow.wash * lift + inflow.wash_gradient * moment)
    induced = (inflow.induced - inflow.wash) * lift + (inflow.gradient - inflow.wash_gradient) * moment
    force = Vector(rounded(force.x), rounded(force.y), rounded(force.z))
    arms = Vector(rounded(arms.x), rounded(arms.y), rounded(arms.z))
    return AirPowers(rounded(induced), wash, profile, force, arms, met, free)


class HingePowers(NamedTuple):
    """Power that springs store, that dampers take, and that actuators of the pitch give, eq. (5.25) [W]."""

    springs: Any
    dampers: Any
    actuators: Any


@kernel
def hinge_powers(aircraft, record, terms, blade, commands):
    """Powers at the hinges, eq. (5.25)."""
    pose = blade.pose
    springs = rounded(
        record.flap_spring * (pose.beta - record.flap_rest) * pose.beta_rate
        + record.lag_spring * (pose.xi - record.lag_rest) * pose.xi_rate
    )
    dampers = rounded(record.lag_damping * pose.xi_rate * pose.xi_rate)
    actuators = zeros_like(pose.beta)
    if aircraft.switches[0].axial_dampers == 1:
        rate = pitch_rate(aircraft, record, pose, commands)
        damper = axial_damper(record, blade.basis, pose, terms.pitch, rate)
        elongation = damper.by_flap * pose.beta_rate + damper.by_lag * pose.xi_rate + damper.by_pitch * rate
        dampers = rounded(dampers + damper.force * elongation)
        actuators = rounded(damper.force * damper.by_pitch * rate)
    if aircraft.switches[0].lag_stops == 1:
        zero = zeros_like(pose.beta)
        stops = with_lag_stops(record, pose, HingeMoments(zero, zero, zero)).lag * record.lead_lag
        springs = rounded(springs - stops * pose.xi_rate)
    return HingePowers(springs, dampers, actuators)


# --- rotors -----------------------------------------------------------------------------------------------------


@kernel
def add_inflow(aircraft, memory, rates, terms):
    """Add what wakes carry away and what accelerates the air of the inflow, less what the blades give, eq. (5.27)."""
    for j in range(aircraft.rotors.shape[0]):
        rotor, total, x = aircraft.rotors[j], memory.totals[j], memory.state
        uniform, sine, cosine = rotor.inflow + S.UNIFORM, rotor.inflow + S.SINE, rotor.inflow + S.COSINE
        # power of the loads on the disc that the inflow's equations know
        given = rotor.inflow_speed * (
            rotor.radius * x[uniform] * total.thrust + (x[cosine] * total.cosine_moment + x[sine] * total.sine_moment)
        )
        none = zeros_like(x[uniform])
        free = rates_of_inflow(aircraft, memory, j, Inflow(none, none, none))
        scale = aircraft.air[0].density * rotor.momentum_scale * rotor.radius
        mass, inertia = scale * (1.0 / INVERSE_MASS), scale * (1.0 / INVERSE_INERTIA)
        wake = -(mass * x[uniform] * free.uniform + inertia * (x[cosine] * free.cosine + x[sine] * free.sine))
        stored = mass * x[uniform] * rates[uniform] + inertia * (x[cosine] * rates[cosine] + x[sine] * rates[sine])
        terms[INDUCED] = terms[INDUCED] + (wake - given)
        terms[APPARENT_MASS] = terms[APPARENT_MASS] + stored


@kernel
def add_held_engines(aircraft, memory, terms):
    """Add what holds the speed of the rotors without a drive."""
    for j in range(aircraft.rotors.shape[0]):
        rotor = aircraft.rotors[j]
        if rotor.drive < 0:
            terms[ENGINE] = terms[ENGINE] + memory.loads[j].torque * rotor.rotor_speed


@kernel
def add_drive(x, drive, bodies, rates, terms):
    """Add what an engine gives to its shaft, its friction, and what speeds the transmission up, eq. (5.29)."""
    speed, change = x[drive.speed_index], rates[drive.speed_index]
    omega, angular = bodies.flight.omega, bodies.angular
    terms[KINETIC_DRIVES] = (
        terms[KINETIC_DRIVES]
        + drive.inertia * speed * change
        + (change * dot(drive.momentum, omega) + speed * dot(drive.momentum, angular))
    )
    if drive.engine != NONE:
        torque = x[drive.torque_index]
        turns = shaft_torque(drive, torque, speed)
        # behind an open free-wheel the engine turns for itself
        is_open = turns > torque - drive.drag * speed
        terms[ENGINE] = terms[ENGINE] + select(is_open, 0.0, torque * speed)
        terms[FRICTION] = terms[FRICTION] + select(is_open, 0.0, drive.drag * speed * speed)


# --- body -------------------------------------------------------------------------------------------------------


@kernel
def add_body(aircraft, memory, bodies, commands, rates, terms):
    """Add the powers of the rigid part and of the air loads on it, eq. (5.28)."""
    air, body, flight = aircraft.air[0], aircraft.body[0], bodies.flight
    velocity, omega = flight.velocity, flight.omega
    change, angular = S.vector_at(rates, S.VELOCITY), S.vector_at(rates, S.RATES)
    s_0, momentum = body.first_moment, along(body.stand_mass, change) + change * body.mass
    terms[KINETIC_BODY] = (
        dot(velocity, momentum)
        + (dot(change, cross(omega, s_0)) + dot(velocity, cross(angular, s_0)))
        + dot(omega, body.inertia @ angular)
    )
    weight = dot(flight.gravity, velocity * body.mass + cross(omega, s_0))
    terms[GRAVITY] = terms[GRAVITY] - weight
    drag = plate_drag(air.density, air.plate_areas, flight.air_velocity)
    terms[FUSELAGE] = terms[FUSELAGE] - dot(drag, flight.air_velocity)
    terms[WIND] = terms[WIND] - dot(drag, bodies.air)
    surfaces = aircraft.surfaces.shape[0]
    for i in range(surfaces):
        load = load_of_surface(aircraft, memory, flight, commands, i)
        add_load(bodies, part_gust(aircraft, flight, i), load, SURFACES, terms)
    for i in range(aircraft.fuselages.shape[0]):
        load = load_of_fuselage(aircraft, memory, flight, i)
        add_load(bodies, part_gust(aircraft, flight, surfaces + i), load, FUSELAGE, terms)
    for j in range(aircraft.rotors.shape[0]):
        gust = zero_vector(flight.velocity.x)
        if in_space(flight.air):
            gust = aircraft.rotors[j].axes @ gust_of_rotor(flight.air, j)
        add_load(bodies, gust, duct_load(aircraft, memory, j), DUCT, terms)
    if aircraft.switches[0].contact == 1:
        load = contact_load(aircraft.ground[0], aircraft.contacts, memory, flight)
        terms[CONTACT] = -(dot(load.force, velocity) + dot(load.moment, omega))


@kernel
def part_gust(aircraft, flight, i):
    """Velocity of the air at a surface or fuselage less that at the c.g., body axes [m/s]."""
    gust = zero_vector(flight.velocity.x)
    if in_space(flight.air):
        gust = gust_of_part(aircraft, flight.air, i)
    return gust


@kernel
def add_load(bodies, gust, load, term, terms):
    """Add what an air load on the body takes, of the motion through the air where it acts and of that of the air."""
    taken = dot(load.force, bodies.flight.air_velocity - gust) + dot(load.moment, bodies.flight.omega)
    terms[term] = terms[term] - taken
    terms[WIND] = terms[WIND] - dot(load.force, bodies.air + gust)


@kernel
def add_stand(aircraft, memory, drives, bodies, commands, rates, terms):
    """Add springs and dampers of a stand, and what moves its locked axes, eq. (5.30)."""
    body, flight, x = aircraft.body[0], bodies.flight, memory.state
    velocity, omega = flight.velocity, flight.omega
    place = transposed(flight.to_earth) @ S.vector_at(x, S.POSITION)
    attitude, turning = S.vector_at(x, S.ATTITUDE + 1), S.vector_at(rates, S.ATTITUDE + 1)
    stretch = dot(along(body.spring, place), velocity - cross(omega, place))
    terms[SPRINGS] = terms[SPRINGS] + stretch + 4.0 * dot(along(body.turn_spring, attitude), turning)
    damped = dot(along(body.damping, velocity), velocity) + dot(along(body.turn_damping, omega), omega)
    terms[DAMPERS] = terms[DAMPERS] + damped
    # the reaction of what is locked: what the equations of the body lack there
    known, total = flight.gravity - cross(omega, velocity), memory.totals[aircraft.rotors.shape[0]]
    loads = transmission_loads(x, drives, flight, body_loads(aircraft, memory, flight, commands))
    stand = stand_loads(body, x, flight, known)
    matrix = mass_matrix(body, total, body.stand_mass + Vector(total.mass, total.mass, total.mass))
    force, turn = memory.acceleration[0].specific_force, memory.acceleration[0].angular
    coupling = matrix.coupling
    needed = ForceMoment(
        times(matrix.force, force) + transposed(coupling) @ turn - (loads.force + total.force + stand.force),
        coupling @ force + times(matrix.moment, turn) - (loads.moment + total.moment + stand.moment),
    )
    still = Vector(1.0 - body.free.x, 1.0 - body.free.y, 1.0 - body.free.z)
    still_turn = Vector(1.0 - body.free_turn.x, 1.0 - body.free_turn.y, 1.0 - body.free_turn.z)
    terms[SUPPORT] = -(dot(along(still, needed.force), velocity) + dot(along(still_turn, needed.moment), omega))
