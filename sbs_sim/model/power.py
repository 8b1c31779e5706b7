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
from sbs_sim.model.blade import (
    ForceMoment,
    axial_damper,
    blade_accelerations,
    blade_basis,
    blade_motion,
    to_blade,
)
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
    mass_matrix,
    memory_in_lanes,
    pitch_rate,
    rates_of_inflow,
    stand_loads,
    times,
    wash_at,
    with_rotors,
)
from sbs_sim.model.fuselage import plate_drag
from sbs_sim.model.inflow import INVERSE_INERTIA, INVERSE_MASS, Inflow
from sbs_sim.model.kernel import entry, kernel
from sbs_sim.model.records import LANES
from sbs_sim.model.section import SectionFlow, section_loads
from sbs_sim.model.surfaces import fuselage_load, surface_load

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
def power_rows(derivative, model, states, swash, psi, air, work, sums, dx, out):
    """Power of every term at recorded instants.

    Parameters
    ----------
    derivative : Address
        Of the entry.
    model : Model
        `complete` coupling.
    states, swash, psi, air : ndarray, shapes (rows, size, n), (rows, 3 n_rows, n), (rows, n_rotors, n), (rows, 3, n)
        As `derivative` takes them.
    work : Work
    sums : structured ndarray BLADE_POWERS, shape (quads,)
        Memory.
    dx : ndarray, shape (size, n)
        Memory.
    out : ndarray, shape (rows, len(POWER_TERMS), n)
        Output [W].
    """
    for row in range(states.shape[0]):
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


@kernel
def blade_powers(aircraft, memory, bodies, commands, psi, turning, r):
    """Powers of a register of blades, in the order of BLADE_POWERS, eqs. (5.23) to (5.26)."""
    blade, terms, flight = aircraft.blades[r], memory.terms[r], bodies.flight
    pose = blade_pose(aircraft, memory.state, blade, psi)
    basis = blade_basis(blade, pose)
    hub = hub_motion(blade, flight)
    motion = blade_motion(blade, basis, pose, hub.omega)
    to_hub = transposed(blade.axes)
    forward = Vector(ZERO, 1.0, ZERO)  # t
    # velocity and acceleration over ground at the flap hinge, and their slopes along the blade
    ground = to_hub @ (flight.velocity + cross(flight.omega, blade.hub))
    hinge = to_blade(blade, basis, ground) + cross(motion.hub, basis.lag_hinge) + cross(motion.arm, basis.flap_hinge)
    slope = cross(motion.blade, basis.span)
    own = blade_accelerations(basis, motion)
    speeding = zeros_like(pose.beta)
    if turning.shape[1] > 0:
        speeding = spread(turning[ACCELERATIONS], aircraft.indices.azimuth, blade.quad, blade)
    alpha = to_blade(blade, basis, to_hub @ bodies.angular) * blade.sense + Vector(ZERO, ZERO, speeding)
    hub_acceleration = to_hub @ (bodies.acceleration + cross(bodies.angular, blade.hub)) + hub.centripetal
    hinge_acceleration = (
        to_blade(blade, basis, hub_acceleration)
        + own.hinge
        + cross(alpha, basis.lag_hinge + basis.flap_hinge)
        - forward * (blade.flap_hinge_offset * terms.lag_acceleration)
    )
    slope_acceleration = (
        own.slope
        + cross(alpha, basis.span)
        + basis.normal * terms.flap_acceleration
        - forward * (basis.cos_flap * terms.lag_acceleration)
    )
    first, second = blade.first_moment, blade.hub_second_moment
    kinetic = (
        blade.mass * dot(hinge, hinge_acceleration)
        + first * (dot(hinge, slope_acceleration) + dot(slope, hinge_acceleration))
        + second * dot(slope, slope_acceleration)
    )
    gravity = -dot(to_blade(blade, basis, to_hub @ flight.gravity), hinge * blade.mass + slope * first)
    springs = (
        blade.flap_spring * (pose.beta - blade.flap_rest) * pose.beta_rate
        + blade.lag_spring * (pose.xi - blade.lag_rest) * pose.xi_rate
    )
    dampers = rounded(blade.lag_damping * pose.xi_rate * pose.xi_rate)
    actuators = zeros_like(pose.beta)
    if aircraft.switches[0].axial_dampers == 1:
        rate = pitch_rate(aircraft, blade, pose, commands)
        damper = axial_damper(blade, basis, pose, terms.pitch, rate)
        elongation = damper.by_flap * pose.beta_rate + damper.by_lag * pose.xi_rate + damper.by_pitch * rate
        dampers = rounded(dampers + damper.force * elongation)
        actuators = rounded(damper.force * damper.by_pitch * rate)
    flow = SectionFlow(terms.u_t_hinge, terms.u_t_slope, terms.u_p_hinge, terms.u_p_slope)
    elements, air = aircraft.elements[blade.elements], aircraft.air[0]
    loads = section_loads(air, blade, elements, aircraft.knots[r], aircraft.table, memory.strip, flow, terms.pitch)
    profile = -(
        (flow.u_t_hinge * loads.forward_force + flow.u_t_slope * loads.forward_moment)
        + (flow.u_p_hinge * loads.normal_force + flow.u_p_slope * loads.normal_moment)
    )
    induced, gradient = induced_velocity(aircraft, memory, blade, pose)
    wash, wash_gradient = zeros_like(pose.beta), zeros_like(pose.beta)
    if aircraft.switches[0].wash == 1:
        wash, wash_gradient = wash_velocity(aircraft, memory, blade, pose)
    lift = basis.cos_flap * loads.normal_force
    root_moment = basis.cos_flap * (blade.hinge_offset * loads.normal_force + loads.normal_moment)
    force = basis.normal * loads.normal_force + forward * loads.forward_force
    blowing = -dot(to_blade(blade, basis, to_hub @ bodies.air), force)
    carried = zeros_like(pose.beta)
    if aircraft.switches[0].ducts == 1:
        with_duct = hub.air_velocity - sheltered(blade.duct_turning, hub.air_velocity)
        carried = -dot(to_blade(blade, basis, with_duct), force)
    return (
        (induced - wash) * lift + (gradient - wash_gradient) * root_moment,
        wash * lift + wash_gradient * root_moment,
        profile,
        carried,
        blowing,
        gravity,
        kinetic,
        springs,
        dampers,
        actuators,
    )


@kernel
def wash_velocity(aircraft, memory, blade, pose):
    """What the wash adds to `induced_velocity`."""
    wash, rotor, quad = memory.wash, aircraft.indices.azimuth, blade.quad
    sine_part = spread(wash[S.SINE], rotor, quad, blade) * pose.sine
    gradient = blade.inflow_speed * (spread(wash[S.COSINE], rotor, quad, blade) * pose.cosine + sine_part)
    return rounded(blade.inflow_speed * blade.radius * spread(wash[S.UNIFORM], rotor, quad, blade)), rounded(gradient)


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
        free = rates_of_inflow(aircraft, memory, j, Inflow(0.0, 0.0, 0.0))
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
        surface, ramps = aircraft.surfaces[i], aircraft.ramps[i]
        wash = wash_at(aircraft, memory, surface, ramps)
        load = surface_load(air.density, surface, ramps, aircraft.shapes, commands, flight.air_velocity, omega, wash)
        add_load(bodies, load, SURFACES, terms)
    for i in range(aircraft.fuselages.shape[0]):
        fuselage, ramps = aircraft.fuselages[i], aircraft.ramps[surfaces + i]
        wash = wash_at(aircraft, memory, fuselage, ramps)
        add_load(
            bodies,
            fuselage_load(air.density, fuselage, aircraft.shapes, flight.air_velocity, omega, wash),
            FUSELAGE,
            terms,
        )
    for j in range(aircraft.rotors.shape[0]):
        add_load(bodies, duct_load(aircraft, memory, j), DUCT, terms)


@kernel
def add_load(bodies, load, term, terms):
    """Add what an air load on the body takes, of the motion relative to the air and of that of the air."""
    taken = dot(load.force, bodies.flight.air_velocity) + dot(load.moment, bodies.flight.omega)
    terms[term] = terms[term] - taken
    terms[WIND] = terms[WIND] - dot(load.force, bodies.air)


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
