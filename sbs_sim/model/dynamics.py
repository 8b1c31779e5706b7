"""The derivative of the complete state (theory.md sections 2 to 7).

Body and blades are one multibody system (`complete` coupling). Its mass matrix has the shape of an arrow: every
blade's two hinge equations hold that blade's beta'', xi'' and the six accelerations of the body, nothing else. The
blades are eliminated exactly, a 6x6 system for the body remains, and the blades follow. In the `paper` coupling
the blades do not feel the hub's acceleration, and the same sums give the loads directly.

The unknowns of the body are the specific force of the c.g. (acceleration minus gravity, so that gravity appears in
one place only and free fall is exact) and the angular acceleration.

The same equations serve one flight, whose blades are the lanes, and as many flights as there are lanes: what differs
is in the types of the arrays, see `sbs_sim.lanes.memory`.
"""

from typing import Any, NamedTuple

from sbs_sim.lanes import (
    Matrix,
    Vector,
    add_record,
    add_to_quads,
    as_lanes,
    as_records,
    copy_record,
    cross,
    dot,
    rounded,
    spread,
    transposed,
)
from sbs_sim.model.blade import (
    Pose,
    about_cg,
    blade_accelerations,
    blade_basis,
    blade_motion,
    couplings,
    hinge_moments,
    known_loads,
    locked_inertia,
    paper_moment,
    section_flow,
    to_blade,
)
from sbs_sim.model.duct import duct_thrust
from sbs_sim.model.frames import quaternion_rates, rotation
from sbs_sim.model.fuselage import plate_drag
from sbs_sim.model.inflow import disc_flow, inflow_rates
from sbs_sim.model.kernel import entry, kernel
from sbs_sim.model.multiblade import add_accelerations, add_rotation_terms, blade_angle, set_accelerations
from sbs_sim.model.section import section_loads
from sbs_sim.model.trigonometry import cosine_sine


class Aircraft(NamedTuple):
    """`Model` and `Work` as lanes: see `sbs_sim.model.records` for their parts."""

    switches: Any
    air: Any
    body: Any
    rotors: Any
    blades: Any
    places: Any
    elements: Any
    knots: Any
    table: Any


class Memory(NamedTuple):
    """`Work` as lanes."""

    state: Any
    terms: Any
    sums: Any
    means: Any
    hubs: Any
    totals: Any
    harmonics: Any
    vector: Any
    flow: Any
    strip: Any
    loads: Any
    span: Any


class Flight(NamedTuple):
    """How the body moves.

    Attributes
    ----------
    to_earth : Matrix
        R_NB.
    air : Vector
        Velocity relative to the air, body axes [m/s].
    velocity, rates : Vector
        U [m/s] and om [rad/s].
    gravity : Vector
        Body axes [m/s^2].
    """

    to_earth: Any
    air: Any
    velocity: Any
    rates: Any
    gravity: Any


@entry
def derivative(model, x, swash, psi, wind, work, dx, with_loads):
    """Time derivative of the simulation state; loads are left in `work.loads` if they are asked for.

    Parameters
    ----------
    model : Model
    x : ndarray, shape (size, n)
        Simulation state, see `sbs_sim.model.state`.
    swash : ndarray, shape (3 n_rotors, n)
        Collective, lateral and longitudinal cyclic pitch of each rotor [rad].
    psi : ndarray, shape (n_rotors, n)
        Azimuth of the first blade of each rotor, 0 aft, growing with the rotation [rad].
    wind : ndarray, shape (3, n)
        Velocity of the air over ground, NED [m/s].
    work : Work
        `work.vector` holds the specific force of the c.g. [m/s^2] and om' [rad/s^2] afterwards.
    dx : ndarray, shape (size, n)
        Output.
    with_loads : bool
    """
    aircraft, memory = in_lanes(model), memory_in_lanes(work)
    like = aircraft.air[0]
    given, out = as_lanes(x, like), as_lanes(dx, like)
    for i in range(given.shape[0]):
        memory.state[i] = given[i]
    evaluate(aircraft, memory, as_lanes(swash, like), as_lanes(psi, like), as_lanes(wind, like), out, with_loads)


@kernel
def in_lanes(model):
    """A model as records of lanes."""
    blades = as_records(model.blades)
    return Aircraft(
        as_records(model.switches),
        as_records(model.air),
        as_records(model.body),
        as_records(model.rotors),
        blades,
        model.places,
        as_records(model.elements),
        as_lanes(model.knots, blades),
        model.table,
    )


@kernel
def memory_in_lanes(work):
    """Memory as records of lanes."""
    sums = as_records(work.sums)
    return Memory(
        as_lanes(work.state, sums),
        as_records(work.terms),
        sums,
        as_records(work.means),
        as_records(work.hubs),
        as_records(work.totals),
        as_records(work.harmonics),
        as_lanes(work.vector, sums),
        as_records(work.flow),
        as_records(work.strip),
        as_records(work.loads),
        work.span,
    )


@kernel
def evaluate(aircraft, memory, swash, psi, wind, dx, with_loads):
    """What `derivative` does of `memory.state`."""
    flight = body_motion(aircraft, memory.state, wind)
    blade_terms(aircraft, memory, flight, swash, psi)
    add_up(aircraft, memory)
    complete = aircraft.switches[0].complete_coupling == 1
    if complete:
        start_body(aircraft, memory, flight)
        solve_with_blades(aircraft, memory)
        solve_blades(aircraft, memory)
        if with_loads:
            hub_loads(aircraft, memory)
    else:
        start_body(aircraft, memory, flight)
        solve_blades_alone(aircraft, memory)
        hub_loads(aircraft, memory)
        solve_body_alone(aircraft, memory)
    body_rates(memory.state, flight, memory.vector, dx)
    rotor_rates(aircraft, memory, dx)


@kernel
def body_motion(aircraft, x, wind):
    """Attitude, velocities and gravity of a state."""
    to_earth = rotation(x[3], x[4], x[5], x[6])
    velocity, rates = Vector(x[7], x[8], x[9]), Vector(x[10], x[11], x[12])
    air = velocity - transposed(to_earth) @ Vector(wind[0], wind[1], wind[2])
    return Flight(to_earth, air, velocity, rates, to_earth.z * aircraft.air[0].gravity)


@kernel
def hub_motion(part, flight):
    """Velocity of a hub relative to the air, body rates, and the acceleration om x (om x r_hub), in hub axes."""
    spin = cross(flight.rates, part.hub)
    to_hub = transposed(part.axes)
    return to_hub @ (flight.air + spin), to_hub @ flight.rates, to_hub @ cross(flight.rates, spin)


@kernel
def blade_terms(aircraft, memory, flight, swash, psi):
    """What is kept of every blade, and the sums over quads."""
    switches, air = aircraft.switches[0], aircraft.air[0]
    for r in range(memory.span[0], memory.span[1]):
        blade, terms = aircraft.blades[r], memory.terms[r]
        pose = blade_pose(aircraft, memory.state, blade, psi)
        basis = blade_basis(blade, pose)
        velocity, rates, known = hub_motion(blade, flight)
        motion = blade_motion(blade, basis, pose, rates)
        places, quad = aircraft.places, blade.quad
        along = spread(memory.state, places.inflow[1], quad, blade) * pose.sine
        gradient = blade.speed * (spread(memory.state, places.inflow[2], quad, blade) * pose.cosine + along)
        induced = blade.speed * blade.radius * spread(memory.state, places.inflow[0], quad, blade)
        flow = section_flow(blade, basis, motion, velocity, induced, gradient)
        pitch = blade_pitch(aircraft, blade, pose, swash)
        elements = aircraft.elements[blade.elements]
        loads = section_loads(air, blade, elements, aircraft.knots[r], aircraft.table, memory.strip, flow, pitch)
        if switches.complete_coupling == 1:
            acting, felt = to_blade(blade, basis, known), to_blade(blade, basis, known)
        else:
            weight = transposed(blade.axes) @ flight.gravity
            acting, felt = -to_blade(blade, basis, weight), Vector(0.0, 0.0, 0.0)
        keep(aircraft, memory, r, pose, basis, motion, loads, acting, felt)
        terms.ut0, terms.ut1, terms.up0, terms.up1, terms.pitch = flow.t0, flow.t1, flow.p0, flow.p1, pitch


@kernel
def blade_pose(aircraft, x, blade, psi):
    """Azimuths, flap and lag of blades."""
    places = aircraft.places
    c, s = cosine_sine(spread(psi, places.azimuth, blade.quad, blade))
    cosine = c * blade.cos_place - s * blade.sin_place
    sine = s * blade.cos_place + c * blade.sin_place
    beta, beta_rate = blade_angle(x, places.flap, places.flap_rate, blade, cosine, sine)
    xi, xi_rate = blade_angle(x, places.lag, places.lag_rate, blade, cosine, sine)
    return Pose(cosine, sine, beta, beta_rate, xi, xi_rate)


@kernel
def blade_pitch(aircraft, blade, pose, swash):
    """Pitch of blades at the hinge [rad], eq. (4.8)."""
    places, quad = aircraft.places, blade.quad
    c = pose.cosine * blade.cos_phase - pose.sine * blade.sin_phase
    s = pose.sine * blade.cos_phase + pose.cosine * blade.sin_phase
    collective = spread(swash, places.swash[0], quad, blade)
    lateral = spread(swash, places.swash[1], quad, blade)
    longitudinal = spread(swash, places.swash[2], quad, blade)
    return (
        collective
        - blade.sense * lateral * c
        - longitudinal * s
        - blade.pitch_flap * pose.beta
        - blade.pitch_lag * pose.xi
    )


@kernel
def keep(aircraft, memory, r, pose, basis, motion, loads, acting, felt):
    """Keep the terms of a register of blades, and add what the body's equations need of them to the sums."""
    blade, terms, switches = aircraft.blades[r], memory.terms[r], aircraft.switches[0]
    own = blade_accelerations(basis, motion)
    flap_moment, lag_moment, inverse_a2 = hinge_moments(blade, basis, pose, loads, own.hinge + acting, own.slope)
    flap_force, flap_arm, lag_force, lag_arm = couplings(blade, basis)
    flap_force, flap_arm = about_cg(blade, basis, flap_force, flap_arm)
    lag_force, lag_arm = about_cg(blade, basis, lag_force, lag_arm)
    force, moment = known_loads(blade, basis, loads, own.hinge + felt, own.slope)
    force, moment = about_cg(blade, basis, force, moment)
    terms.cosine, terms.sine = pose.cosine, pose.sine
    terms.flap_force, terms.flap_arm = flap_force, flap_arm
    terms.lag_force, terms.lag_arm = lag_force, lag_arm
    inverse_a2 = blade.lead_lag * inverse_a2
    terms.flap_moment, terms.lag_moment, terms.inverse_a2 = flap_moment, lag_moment, inverse_a2
    terms.force, terms.moment = force, moment
    if switches.complete_hub_moment == 0:
        terms.paper_moment, terms.flap_axis = paper_moment(blade, basis, pose, loads)
    thrust = basis.cos_flap * loads.normal
    root = blade.hinge * loads.normal + loads.normal_moment
    first, second = locked_inertia(blade, basis)
    flap, lag = rounded(blade.inverse_second * flap_moment), rounded(inverse_a2 * lag_moment)
    xx, yy, zz, xy, yz, zx = second
    p = (flap_force.x, flap_force.y, flap_force.z, flap_arm.x, flap_arm.y, flap_arm.z)
    q = (lag_force.x, lag_force.y, lag_force.z, lag_arm.x, lag_arm.y, lag_arm.z)
    left_force = force - flap_force * flap - lag_force * lag
    left_moment = moment - flap_arm * flap - lag_arm * lag
    add_to_quads(
        memory.sums,
        blade.quad,
        blade.begins,
        "thrust",
        (
            thrust,
            root * pose.sine,
            root * pose.cosine,
            blade.mass,
            first,
            xx,
            yy,
            zz,
            xy,
            yz,
            zx,
            left_force,
            left_moment,
        )
        + triangle(p, q, blade.inverse_second, inverse_a2),
    )


@kernel
def triangle(p, q, flap, lag):
    """Lower triangle of flap p p^T + lag q q^T, row by row."""
    p0, p1, p2, p3, p4, p5 = p
    q0, q1, q2, q3, q4, q5 = q
    a0, a1, a2 = rounded(flap * p0), rounded(flap * p1), rounded(flap * p2)
    a3, a4, a5 = rounded(flap * p3), rounded(flap * p4), rounded(flap * p5)
    b0, b1, b2 = rounded(lag * q0), rounded(lag * q1), rounded(lag * q2)
    b3, b4, b5 = rounded(lag * q3), rounded(lag * q4), rounded(lag * q5)
    return (
        a0 * p0 + b0 * q0,
        a1 * p0 + b1 * q0,
        a1 * p1 + b1 * q1,
        a2 * p0 + b2 * q0,
        a2 * p1 + b2 * q1,
        a2 * p2 + b2 * q2,
        a3 * p0 + b3 * q0,
        a3 * p1 + b3 * q1,
        a3 * p2 + b3 * q2,
        a3 * p3 + b3 * q3,
        a4 * p0 + b4 * q0,
        a4 * p1 + b4 * q1,
        a4 * p2 + b4 * q2,
        a4 * p3 + b4 * q3,
        a4 * p4 + b4 * q4,
        a5 * p0 + b5 * q0,
        a5 * p1 + b5 * q1,
        a5 * p2 + b5 * q2,
        a5 * p3 + b5 * q3,
        a5 * p4 + b5 * q4,
        a5 * p5 + b5 * q5,
    )


@kernel
def add_up(aircraft, memory):
    """Sums over each rotor, and over all of them."""
    rotors = aircraft.rotors.shape[0]
    for j in range(rotors):
        first = aircraft.rotors[j].first_quad
        copy_record(memory.totals, j, memory.sums, first)
        for quad in range(first + 1, first + aircraft.rotors[j].quads):
            add_record(memory.totals, j, memory.sums, quad)
        if j == 0:
            copy_record(memory.totals, rotors, memory.totals, 0)
        else:
            add_record(memory.totals, rotors, memory.totals, j)


@kernel
def start_body(aircraft, memory, flight):
    """Known side of the rigid part and the ducts, first part of eq. (5.7)."""
    air, body, om = aircraft.air[0], aircraft.body[0], flight.rates
    force = plate_drag(air.density, air.plate_areas, flight.air) - cross(om, cross(om, body.first_moment))
    moment = -cross(om, body.inertia @ om)
    for j in range(aircraft.rotors.shape[0]):
        rotor = aircraft.rotors[j]
        duct = rotor.axes @ Vector(0.0, 0.0, -duct_thrust(rotor.duct, memory.totals[j].thrust))
        force = force + duct
        moment = moment + cross(rotor.hub, duct)
        velocity, _, _ = hub_motion(rotor, flight)
        memory.flow[j].velocity = velocity
    set_vector(memory.vector, force, moment)


@kernel
def set_vector(row, force, moment):
    """Six numbers of two vectors."""
    row[0], row[1], row[2] = force.x, force.y, force.z
    row[3], row[4], row[5] = moment.x, moment.y, moment.z


@kernel
def solve_with_blades(aircraft, memory):
    """Specific force and angular acceleration of the body with all blades eliminated (`complete`), eq. (5.8)."""
    body, b = aircraft.body[0], memory.vector
    total = memory.totals[aircraft.rotors.shape[0]]
    b[0], b[1], b[2] = b[0] + total.force.x, b[1] + total.force.y, b[2] + total.force.z
    b[3], b[4], b[5] = b[3] + total.moment.x, b[4] + total.moment.y, b[5] + total.moment.z
    mass, s = body.mass + total.mass, body.first_moment + total.first_moment
    e = total.second_moment
    xx, yy, zz, xy, yz, zx = e[0], e[1], e[2], e[3], e[4], e[5]
    inertia, t = body.inertia, total.triangle
    forces = Symmetric(mass - t[0], mass - t[2], mass - t[5], -t[1], -t[4], -t[3])
    coupling = Matrix(
        Vector(-t[6], -s.z - t[7], s.y - t[8]),
        Vector(s.z - t[10], -t[11], -s.x - t[12]),
        Vector(-s.y - t[15], s.x - t[16], -t[17]),
    )
    moments = Symmetric(
        inertia.x.x + (yy + zz) - t[9],
        inertia.y.y + (zz + xx) - t[14],
        inertia.z.z + (xx + yy) - t[20],
        inertia.y.x - xy - t[13],
        inertia.z.y - yz - t[19],
        inertia.z.x - zx - t[18],
    )
    solve_body(forces, coupling, moments, b)


class Symmetric(NamedTuple):
    """Symmetric matrix by its elements."""

    xx: Any
    yy: Any
    zz: Any
    xy: Any
    yz: Any
    zx: Any


@kernel
def times(matrix, vector):
    """Product of a symmetric matrix and a vector."""
    return Vector(
        matrix.xx * vector.x + matrix.xy * vector.y + matrix.zx * vector.z,
        matrix.xy * vector.x + matrix.yy * vector.y + matrix.yz * vector.z,
        matrix.zx * vector.x + matrix.yz * vector.y + matrix.zz * vector.z,
    )


@kernel
def inverted(m):
    """Inverse of a symmetric positive definite matrix, by its cofactors."""
    xx, xy, zx = m.yy * m.zz - m.yz * m.yz, m.yz * m.zx - m.xy * m.zz, m.xy * m.yz - m.yy * m.zx
    yy, zz, yz = m.zz * m.xx - m.zx * m.zx, m.xx * m.yy - m.xy * m.xy, m.xy * m.zx - m.xx * m.yz
    share = 1.0 / (m.xx * xx + m.xy * xy + m.zx * zx)
    return Symmetric(
        rounded(xx * share),
        rounded(yy * share),
        rounded(zz * share),
        rounded(xy * share),
        rounded(yz * share),
        rounded(zx * share),
    )


@kernel
def solve_body(forces, coupling, moments, b):
    """Solve [forces, coupling^T; coupling, moments] y = b for y, which overwrites b, by the Schur complement."""
    force, moment = Vector(b[0], b[1], b[2]), Vector(b[3], b[4], b[5])
    flexible = inverted(forces)
    x, y, z = times(flexible, coupling.x), times(flexible, coupling.y), times(flexible, coupling.z)
    left = Symmetric(
        moments.xx - dot(coupling.x, x),
        moments.yy - dot(coupling.y, y),
        moments.zz - dot(coupling.z, z),
        moments.xy - dot(coupling.x, y),
        moments.yz - dot(coupling.y, z),
        moments.zx - dot(coupling.z, x),
    )
    shares = Matrix(x, y, z)  # coupling @ flexible
    turn = times(inverted(left), moment - shares @ force)
    set_vector(b, times(flexible, force) - transposed(shares) @ turn, turn)


@kernel
def solve_blades(aircraft, memory):
    """Flap and lag accelerations of every blade once those of the body are known, eq. (5.9)."""
    b = memory.vector
    force, moment = Vector(b[0], b[1], b[2]), Vector(b[3], b[4], b[5])
    for r in range(aircraft.blades.shape[0]):
        blade, terms = aircraft.blades[r], memory.terms[r]
        flap = terms.flap_moment - dot(terms.flap_force, force) - dot(terms.flap_arm, moment)
        lag = terms.lag_moment - dot(terms.lag_force, force) - dot(terms.lag_arm, moment)
        terms.flap_acceleration = flap * blade.inverse_second
        terms.lag_acceleration = lag * terms.inverse_a2


@kernel
def solve_blades_alone(aircraft, memory):
    """Flap and lag accelerations of every blade on a hub that does not accelerate (`paper`)."""
    for r in range(aircraft.blades.shape[0]):
        blade, terms = aircraft.blades[r], memory.terms[r]
        terms.flap_acceleration = terms.flap_moment * blade.inverse_second
        terms.lag_acceleration = terms.lag_moment * terms.inverse_a2


@kernel
def hub_loads(aircraft, memory):
    """Thrust, shaft torque, force and moment of each rotor on its hub (theory.md section 5.5)."""
    switches, b = aircraft.switches[0], memory.vector
    for r in range(aircraft.blades.shape[0]):
        blade, terms = aircraft.blades[r], memory.terms[r]
        flap, lag = terms.flap_acceleration, terms.lag_acceleration
        force = terms.force - terms.flap_force * flap - terms.lag_force * lag
        moment = terms.moment - terms.flap_arm * flap - terms.lag_arm * lag
        add_to_quads(memory.hubs, blade.quad, blade.begins, "force", (force, moment))
        if switches.complete_hub_moment == 0:
            inertial = blade.lead_lag * blade.second_hub * flap
            add_to_quads(
                memory.hubs, blade.quad, blade.begins, "paper", (terms.paper_moment - terms.flap_axis * inertial,)
            )
    for j in range(aircraft.rotors.shape[0]):
        rotor, out, total = aircraft.rotors[j], memory.loads[j], memory.totals[j]
        force, moment, paper = Vector(0.0, 0.0, 0.0), Vector(0.0, 0.0, 0.0), Vector(0.0, 0.0, 0.0)
        for quad in range(rotor.first_quad, rotor.first_quad + rotor.quads):
            hub = memory.hubs[quad]
            force, moment, paper = force + hub.force, moment + hub.moment, paper + hub.paper
        if switches.complete_coupling == 1:
            carried, turned = carried_blades(total, Vector(b[0], b[1], b[2]), Vector(b[3], b[4], b[5]))
            force, moment = force - carried, moment - turned
        moment = moment - cross(rotor.hub, force)
        shaft = Vector(rotor.axes.x.z, rotor.axes.y.z, rotor.axes.z.z)  # z_h, against the thrust
        axial = dot(shaft, moment)
        if switches.complete_hub_moment == 0:  # across the shaft the paper's reading (theory.md section 9)
            moment = shaft * axial + paper
            axial = dot(shaft, moment)
        out.thrust, out.torque = total.thrust, rotor.sense * axial
        out.force, out.moment = force, moment


@kernel
def carried_blades(total, force, turn):
    """Force and moment about the c.g. that accelerate the locked blades of a rotor along with the body, J x."""
    s, e = total.first_moment, total.second_moment
    xx, yy, zz, xy, yz, zx = e[0], e[1], e[2], e[3], e[4], e[5]
    moment = cross(s, force) + Vector(
        (yy + zz) * turn.x - xy * turn.y - zx * turn.z,
        (zz + xx) * turn.y - xy * turn.x - yz * turn.z,
        (xx + yy) * turn.z - zx * turn.x - yz * turn.y,
    )
    return force * total.mass + cross(turn, s), moment


@kernel
def solve_body_alone(aircraft, memory):
    """Specific force and angular acceleration of the rigid aircraft under the hub loads (`paper`)."""
    body, b = aircraft.body[0], memory.vector
    force, moment = Vector(b[0], b[1], b[2]), Vector(b[3], b[4], b[5])
    for j in range(aircraft.rotors.shape[0]):
        rotor, out = aircraft.rotors[j], memory.loads[j]
        force = force + out.force
        moment = moment + (out.moment + cross(rotor.hub, out.force))
    turn = times(inverse_of(body.inertia), moment)
    set_vector(b, force * (1.0 / body.mass), turn)


@kernel
def inverse_of(matrix):
    """Inverse of a symmetric matrix that is given by rows."""
    rows = Symmetric(matrix.x.x, matrix.y.y, matrix.z.z, matrix.y.x, matrix.z.y, matrix.z.x)
    return inverted(rows)


@kernel
def body_rates(x, flight, acceleration, dx):
    """Rates of position, attitude, velocity and angular velocity (theory.md section 5.6)."""
    position = flight.to_earth @ flight.velocity
    dx[0], dx[1], dx[2] = position.x, position.y, position.z
    dx[3], dx[4], dx[5], dx[6] = quaternion_rates(x[3], x[4], x[5], x[6], flight.rates)
    specific = Vector(acceleration[0], acceleration[1], acceleration[2])
    velocity = specific + flight.gravity - cross(flight.rates, flight.velocity)
    dx[7], dx[8], dx[9] = velocity.x, velocity.y, velocity.z
    dx[10], dx[11], dx[12] = acceleration[3], acceleration[4], acceleration[5]


@kernel
def rotor_rates(aircraft, memory, dx):
    """Rates of the multiblade coordinates (paper eqs. [13], [14]) and of the inflow."""
    x, lead_lag = memory.state, aircraft.switches[0].lead_lag
    for r in range(aircraft.blades.shape[0]):
        add_accelerations(aircraft.blades[r], memory.terms[r], memory.means, memory.harmonics)
    for j in range(aircraft.rotors.shape[0]):
        rotor = aircraft.rotors[j]
        for i in range(rotor.blades):
            dx[rotor.flap + i], dx[rotor.lag + i] = x[rotor.flap_rate + i], lead_lag * x[rotor.lag_rate + i]
        set_accelerations(rotor, memory.means, memory.harmonics, dx)
        add_rotation_terms(rotor, x, dx, rotor.flap, rotor.flap_rate, 1.0)
        add_rotation_terms(rotor, x, dx, rotor.lag, rotor.lag_rate, 1.0 * lead_lag)
        set_inflow(aircraft, memory, j, dx)


@kernel
def set_inflow(aircraft, memory, j, dx):
    """Inflow rates of a rotor from the sums of its blades."""
    rotor, total, x = aircraft.rotors[j], memory.totals[j], memory.state
    at, scale = rotor.inflow, rotor.load_scale
    lambda0, lambdas, lambdac = x[at], x[at + 1], x[at + 2]
    mu = memory.flow[j].velocity * rotor.inverse_tip_speed
    moments = scale / rotor.radius
    loads = Vector(total.thrust * scale, total.cosine_moment * moments, total.sine_moment * moments)
    flow = disc_flow(lambda0, mu, rotor.sense)
    rates = inflow_rates(rotor, Vector(lambda0, lambdac, lambdas), flow, loads, aircraft.switches[0].cyclic_inflow)
    dx[at], dx[at + 1], dx[at + 2] = rates.x, rates.z, rates.y
