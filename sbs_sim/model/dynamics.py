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
    seldom,
    spread,
    sqrt,
    transposed,
    zeros_like,
)
from sbs_sim.model import state as S
from sbs_sim.model.air_rows import (
    AT_HUB,
    gust_of_blade,
    gust_of_part,
    gust_of_rotor,
    in_space,
    offset_with_gust_gradients,
    span_with_gust_gradients,
    with_gust_gradients,
)
from sbs_sim.model.blade import (
    ForceMoment,
    HingeMoments,
    Pose,
    about_cg,
    blade_accelerations,
    blade_basis,
    blade_motion,
    hinge_columns,
    hinge_moments,
    known_loads,
    locked_inertia,
    paper_moment,
    section_flow,
    to_blade,
    with_axial_damper,
    with_lag_stops,
    with_outward_force,
)
from sbs_sim.model.contact import contact_load, set_contact_rates
from sbs_sim.model.duct import duct_flow, duct_thrust, sheltered
from sbs_sim.model.element_gusts import element_gusts, in_elements
from sbs_sim.model.frames import quaternion_rates, rotation, shaft_down
from sbs_sim.model.fuselage import plate_drag
from sbs_sim.model.ground_effect import add_ground_wash
from sbs_sim.model.inflow import INVERSE_MASS, Inflow, inflow_rates, rotor_flow
from sbs_sim.model.interference import add_interference, met_with_wash
from sbs_sim.model.kernel import entry, kernel
from sbs_sim.model.multiblade import add_accelerations, add_rotation_terms, blade_angle, set_accelerations
from sbs_sim.model.offset import (
    PitchMotion,
    blade_equations,
    inverse_flap_inertia,
    inverse_where,
    locked_offset_inertia,
    offset_air_loads,
    offset_flow,
)
from sbs_sim.model.records import LOAD, WASH_ROWS
from sbs_sim.model.ring import add_ring
from sbs_sim.model.section import section_loads
from sbs_sim.model.section_options import optional_loads, span_flow
from sbs_sim.model.separation import Separation
from sbs_sim.model.surfaces import fuselage_load, ramp, rotor_wash, surface_load
from sbs_sim.model.teeter import hold_coning, lock_coning
from sbs_sim.model.trigonometry import cosine_sine
from sbs_sim.model.unsteady_airfoil import (
    offset_with_wake_gradient,
    set_circulation,
    set_circulation_rates,
    span_with_wake_gradient,
    with_wake_gradient,
)


class Aircraft(NamedTuple):
    """`sbs_sim.model.records.Model` as lanes."""

    switches: Any
    air: Any
    body: Any
    rotors: Any
    blades: Any
    indices: Any
    elements: Any
    knots: Any
    table: Any
    surfaces: Any
    fuselages: Any
    ramps: Any
    shapes: Any
    schedules: Any
    bends: Any
    ground: Any
    contacts: Any
    pairs: Any
    influences: Any
    stall: Any


class Memory(NamedTuple):
    """`sbs_sim.model.records.Work` as lanes."""

    state: Any
    terms: Any
    sums: Any
    means: Any
    hubs: Any
    totals: Any
    harmonics: Any
    acceleration: Any
    flow: Any
    strip: Any
    loads: Any
    span: Any
    coning: Any
    coning_change: Any
    wash: Any
    ring: Any
    contact: Any
    commands: Any
    pitching: Any
    pitch_sums: Any
    separation: Any
    separation_rates: Any
    separation_states: Any
    separation_state_rates: Any
    gusts: Any


class Flight(NamedTuple):
    """Motion of the body.

    Attributes
    ----------
    to_earth : Matrix
        R_NB.
    air_velocity : Vector
        Velocity of the c.g. relative to the air, body axes [m/s].
    velocity, omega : Vector
        U [m/s] and om [rad/s], body axes.
    gravity : Vector
        Body axes [m/s^2].
    air : lanes, shape (3,) or (air_rows(...),)
        Velocity of the air, see `derivative`.
    """

    to_earth: Any
    air_velocity: Any
    velocity: Any
    omega: Any
    gravity: Any
    air: Any


@entry
def derivative(model, x, swash, psi, wind, work, dx, with_loads):
    """Time derivative of the simulation state; loads are left in `work.loads` if they are asked for.

    Parameters
    ----------
    model : Model
    x : ndarray, shape (size, n)
        Simulation state, see `sbs_sim.model.state`.
    swash : ndarray, shape (3 n_rows, n)
        Collective, lateral and longitudinal cyclic pitch of each rotor [rad]; behind them what else controls command,
        see `sbs_sim.Aircraft.mix`.
    psi : ndarray, shape (n_rotors, n)
        Azimuth of the first blade of each rotor, 0 aft, growing with the rotation [rad].
    wind : ndarray, shape (3, n), or (air_rows(...), n)
        Velocity of the air over ground at the c.g., NED [m/s]; behind it what differs at the rotors and at the parts
        of the body where the air is not the same everywhere, see `sbs_sim.model.air`.
    work : Work
        `work.acceleration` holds the specific force of the c.g. [m/s^2] and om' [rad/s^2] afterwards.
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
    return with_rotors(model, as_records(model.rotors), as_records(model.blades))


@kernel
def with_rotors(model, rotors, blades):
    """A model as records of lanes, with its rotors and blades or others of the same kind."""
    air = as_records(model.air)
    return Aircraft(
        switches=as_records(model.switches),
        air=air,
        body=as_records(model.body),
        rotors=rotors,
        blades=blades,
        indices=model.indices,
        elements=as_records(model.elements),
        knots=as_lanes(model.knots, blades),
        table=model.table,
        surfaces=as_records(model.surfaces),
        fuselages=as_records(model.fuselages),
        ramps=as_lanes(model.ramps, air),
        shapes=model.shapes,
        schedules=as_records(model.schedules),
        bends=as_lanes(model.bends, air),
        ground=as_records(model.ground),
        contacts=as_records(model.contacts),
        pairs=as_records(model.pairs),
        influences=model.influences,
        stall=as_lanes(model.stall, blades),
    )


@kernel
def memory_in_lanes(work):
    """Memory as records of lanes."""
    sums, terms = as_records(work.sums), as_records(work.terms)
    return Memory(
        state=as_lanes(work.state, sums),
        terms=terms,
        sums=sums,
        means=as_records(work.means),
        hubs=as_records(work.hubs),
        totals=as_records(work.totals),
        harmonics=as_records(work.harmonics),
        acceleration=as_records(work.acceleration),
        flow=as_records(work.flow),
        strip=as_records(work.strip),
        loads=as_records(work.loads),
        span=work.span,
        coning=as_records(work.coning),
        coning_change=as_lanes(work.coning_change, sums),
        wash=as_lanes(work.wash, sums),
        ring=as_lanes(work.ring, sums),
        contact=as_lanes(work.contact, sums),
        commands=as_lanes(work.commands, sums),
        pitching=as_records(work.pitching),
        pitch_sums=as_records(work.pitch_sums),
        separation=as_lanes(work.separation, terms),
        separation_rates=as_lanes(work.separation_rates, terms),
        separation_states=as_lanes(work.separation_states, sums),
        separation_state_rates=as_lanes(work.separation_state_rates, sums),
        gusts=as_lanes(work.gusts, as_records(work.terms)),
    )


@kernel
def evaluate(aircraft, memory, swash, psi, wind, dx, with_loads):
    """Set the derivative of `memory.state`."""
    flight = body_motion(aircraft, memory.state, wind)
    loads = set_known_loads(aircraft, memory, flight, swash, psi)
    if aircraft.switches[0].complete_coupling == 1:
        if seldom(aircraft.switches[0].teetering == 1):
            lock_coning(aircraft, memory)
        solve_coupled_body(aircraft, memory, flight, loads)
        solve_blades(aircraft, memory)
        if seldom(aircraft.switches[0].teetering == 1):
            hold_coning(aircraft, memory)
        if with_loads:
            set_hub_loads(aircraft, memory)
    else:
        solve_blades_alone(aircraft, memory)
        set_hub_loads(aircraft, memory)
        solve_body_alone(aircraft, memory, loads)
    set_rates(aircraft, memory, flight, dx)


@kernel
def set_known_loads(aircraft, memory, flight, swash, psi):
    """Set what is known before the accelerations are, of blades and hubs; the loads on the rigid part."""
    commands = swash
    if seldom(aircraft.switches[0].scheduled == 1):
        set_commands(aircraft, memory, flight, swash)
        commands = memory.commands
    set_hub_velocities(aircraft, memory, flight)
    first = memory.state.shape[0] - 1 - memory.separation_states.shape[0]
    for i in range(memory.separation_states.shape[0]):
        memory.separation_states[i] = memory.state[first + i]
    if seldom(aircraft.switches[0].wash == 1):
        set_wash(aircraft, memory)
        if seldom(aircraft.switches[0].ground_effect > 0):
            add_ground_wash(aircraft, memory, flight)
        if seldom(aircraft.switches[0].ring == 1):
            add_ring(aircraft, memory)
    set_blade_terms(aircraft, memory, flight, commands, psi)
    sum_blades(aircraft, memory)
    return body_loads(aircraft, memory, flight, commands)


@kernel
def solve_coupled_body(aircraft, memory, flight, loads):
    """Set specific force and angular acceleration of the body or of a stand, all blades eliminated (`complete`)."""
    if seldom(aircraft.switches[0].stand == 1):
        solve_on_stand(aircraft, memory, flight, loads)
    else:
        solve_with_blades(aircraft, memory, loads)


@kernel
def set_rates(aircraft, memory, flight, dx):
    """Set the rates of body and rotors from the accelerations."""
    set_body_rates(memory, flight, dx)
    if seldom(aircraft.switches[0].stand == 1):
        hold_locked_axes(aircraft, dx)
    if seldom(aircraft.switches[0].contact == 1):
        set_contact_rates(aircraft.contacts, memory.contact, dx)
    set_rotor_rates(aircraft, memory, dx)
    first = memory.state.shape[0] - 1 - memory.separation_states.shape[0]
    for i in range(memory.separation_states.shape[0]):
        dx[first + i] = memory.separation_state_rates[i]


@kernel
def separation_of(aircraft, memory, r):
    """Separation on the sections of a register r of blades."""
    states = aircraft.switches[0].section_states
    kind = memory.separation.shape[0] // states if states > 0 else 0
    return Separation(memory.separation, memory.separation_rates, aircraft.stall[r], kind)


@kernel
def body_motion(aircraft, x, wind):
    """Attitude, velocities and gravity of a state."""
    to_earth = rotation(S.attitude_at(x))
    velocity, omega = S.vector_at(x, S.VELOCITY), S.vector_at(x, S.RATES)
    air_velocity = velocity - transposed(to_earth) @ Vector(wind[0], wind[1], wind[2])
    return Flight(to_earth, air_velocity, velocity, omega, to_earth.z * aircraft.air[0].gravity, wind)


@kernel
def set_commands(aircraft, memory, flight, swash):
    """Set the commands with the shares in swashplate angles that change with the airspeed (theory.md section 4.5)."""
    commands, speed = memory.commands, sqrt(dot(flight.air_velocity, flight.air_velocity))
    for i in range(commands.shape[0]):
        commands[i] = swash[i]
    for k in range(aircraft.schedules.shape[0]):
        schedule = aircraft.schedules[k]
        share = schedule.first + ramp(aircraft.bends[k], 0, 1, speed)
        if schedule.source >= 0:
            share = rounded(share * swash[schedule.source])
        commands[schedule.target] = commands[schedule.target] + share


class HubMotion(NamedTuple):
    """Motion of a hub in hub axes: V_hub [m/s], om [rad/s] and om x (om x r_hub) [m/s^2]."""

    air_velocity: Any
    omega: Any
    centripetal: Any


@kernel
def hub_motion(part, flight):
    """Motion of the hub of a rotor or blade, eq. (2.4)."""
    turning = cross(flight.omega, part.hub)
    to_hub = transposed(part.axes)
    return HubMotion(
        to_hub @ (flight.air_velocity + turning), to_hub @ flight.omega, to_hub @ cross(flight.omega, turning)
    )


@kernel
def set_blade_terms(aircraft, memory, flight, swash, psi):
    """Set the terms of every blade and their sums over quads."""
    air = aircraft.air[0]
    for r in range(memory.span[0], memory.span[1]):
        blade, terms = aircraft.blades[r], memory.terms[r]
        pose = blade_pose(aircraft, memory.state, blade, psi)
        basis = blade_basis(blade, pose)
        hub = hub_motion(blade, flight)
        motion = blade_motion(blade, basis, pose, hub.omega)
        induced, gradient = induced_velocity(aircraft, memory, blade, pose)
        air_velocity = hub.air_velocity
        if seldom(in_space(flight.air)):
            air_velocity = air_velocity - gust_of_blade(aircraft, flight.air, blade, AT_HUB)
        if seldom(aircraft.switches[0].ducts == 1):
            air_velocity = sheltered(blade.duct_turning, air_velocity)
        flow = section_flow(blade, basis, motion, air_velocity, induced, gradient)
        sampled, over_disc = in_elements(memory), flow
        if seldom(in_space(flight.air)):
            over_disc = with_gust_gradients(aircraft, flight.air, blade, basis, flow)
            if not sampled:
                flow = over_disc
        pitch = blade_pitch(aircraft, blade, pose, swash)
        if seldom(aircraft.switches[0].unsteady_airfoil == 1):
            set_circulation(aircraft.indices, memory, blade, terms, pose, over_disc, pitch)
            flow = with_wake_gradient(blade, basis, flow, terms.wake_gradient)
        terms.u_t_hinge, terms.u_t_slope = flow.u_t_hinge, flow.u_t_slope
        terms.u_p_hinge, terms.u_p_slope = flow.u_p_hinge, flow.u_p_slope
        terms.pitch = pitch
        elements = aircraft.elements[blade.elements]
        if seldom(aircraft.switches[0].offsets == 1):
            turning = pitch_motion(aircraft, blade, pose, swash)
            turned = offset_flow(blade, basis, motion, turning.rate, air_velocity, induced, gradient)
            if in_space(flight.air) and not sampled:
                turned = offset_with_gust_gradients(aircraft, flight.air, blade, basis, turned)
            if seldom(aircraft.switches[0].unsteady_airfoil == 1):
                turned = offset_with_wake_gradient(blade, basis, turned, terms.wake_gradient)
            met = met_by_offsets(aircraft, memory, r, basis, turned, pitch)
            at_hub = to_blade(blade, basis, hub.centripetal)
            set_offset_equations(aircraft, memory, r, pose, basis, motion, met, at_hub, pitch, turning)
            continue
        if seldom(sampled):
            along = span_flow(blade, basis, motion, air_velocity, induced, gradient)
            if seldom(aircraft.switches[0].unsteady_airfoil == 1):
                along = span_with_wake_gradient(blade, basis, along, terms.wake_gradient)
            loads, terms.outward_force, _, _ = optional_loads(
                *(air, blade, elements, aircraft.knots[r], aircraft.table, memory.strip, flow, along, pitch),
                induced - air_velocity.z,
                aircraft.switches[0],
                separation_of(aircraft, memory, r),
                element_gusts(memory, blade, basis, r),
            )
        elif seldom(aircraft.switches[0].section_options > 0):
            along = span_flow(blade, basis, motion, air_velocity, induced, gradient)
            if seldom(in_space(flight.air)):
                along = span_with_gust_gradients(aircraft, flight.air, blade, basis, along)
            if seldom(aircraft.switches[0].unsteady_airfoil == 1):
                along = span_with_wake_gradient(blade, basis, along, terms.wake_gradient)
            loads, terms.outward_force, _, _ = optional_loads(
                *(air, blade, elements, aircraft.knots[r], aircraft.table, memory.strip, flow, along, pitch),
                induced - air_velocity.z,
                aircraft.switches[0],
                separation_of(aircraft, memory, r),
                None,
            )
        else:
            loads = section_loads(air, blade, elements, aircraft.knots[r], aircraft.table, memory.strip, flow, pitch)
        # known acceleration of the hub in a_0, for the hinges (theory.md section 3.1) and for the hub loads (5.1)
        if aircraft.switches[0].complete_coupling == 1:
            at_hinges, at_hub = to_blade(blade, basis, hub.centripetal), to_blade(blade, basis, hub.centripetal)
        else:
            gravity = transposed(blade.axes) @ flight.gravity
            at_hinges, at_hub = -to_blade(blade, basis, gravity), Vector(0.0, 0.0, 0.0)
        set_equations(aircraft, memory, r, pose, basis, motion, loads, at_hinges, at_hub, swash, pitch)


@kernel
def met_by_offsets(aircraft, memory, r, basis, flow, pitch):
    """Air loads of a register of blades with offsets; see `sbs_sim.model.offset.offset_air_loads`."""
    blade, air, knots = aircraft.blades[r], aircraft.air[0], aircraft.knots[r]
    elements = aircraft.elements[blade.elements]
    if in_elements(memory):
        gusts = element_gusts(memory, blade, basis, r)
        return offset_air_loads(air, blade, basis, elements, knots, aircraft.table, flow, pitch, gusts)
    return offset_air_loads(air, blade, basis, elements, knots, aircraft.table, flow, pitch, None)


@kernel
def set_wash(aircraft, memory):
    """Set what others add to the inflow of every rotor, from the inflow states and the velocities of the hubs."""
    for j in range(aircraft.rotors.shape[0]):
        for row in range(WASH_ROWS):
            memory.wash[row, j] = zeros_like(aircraft.rotors[j].radius)
    if seldom(aircraft.switches[0].interference == 1):
        add_interference(aircraft, memory)


@kernel
def induced_velocity(aircraft, memory, blade, pose):
    """Induced velocity at the hub [m/s], and its slope along the radius at the azimuth of blades [1/s], eq. (4.2)."""
    inflow, quad, x = aircraft.indices.inflow, blade.quad, memory.state
    lambda0 = spread(x, inflow[S.UNIFORM], quad, blade)
    lambdas, lambdac = spread(x, inflow[S.SINE], quad, blade), spread(x, inflow[S.COSINE], quad, blade)
    if seldom(aircraft.switches[0].wash == 1):
        wash = wash_of_blade(aircraft, memory, blade)
        lambda0, lambdas, lambdac = lambda0 + wash.uniform, lambdas + wash.sine, lambdac + wash.cosine
    return velocity_of_inflow(blade, pose, Inflow(lambda0, lambdac, lambdas))


@kernel
def wash_of_blade(aircraft, memory, blade):
    """What others add to the inflow that blades meet."""
    wash, rotor, quad = memory.wash, aircraft.indices.azimuth, blade.quad
    return Inflow(
        spread(wash[S.UNIFORM], rotor, quad, blade),
        spread(wash[S.COSINE], rotor, quad, blade),
        spread(wash[S.SINE], rotor, quad, blade),
    )


@kernel
def velocity_of_inflow(blade, pose, inflow):
    """Velocity of an inflow at the hub [m/s], and its slope along the radius at the azimuth of blades [1/s]."""
    sine_part = inflow.sine * pose.sine
    gradient = blade.inflow_speed * (inflow.cosine * pose.cosine + sine_part)
    return blade.inflow_speed * blade.radius * inflow.uniform, gradient


@kernel
def blade_pose(aircraft, x, blade, psi):
    """Azimuths, flap and lag of blades, eqs. (1.4), (1.6) and (1.10)."""
    indices = aircraft.indices
    c, s = cosine_sine(spread(psi, indices.azimuth, blade.quad, blade))
    cosine = c * blade.cos_azimuth_offset - s * blade.sin_azimuth_offset
    sine = s * blade.cos_azimuth_offset + c * blade.sin_azimuth_offset
    beta, beta_rate = blade_angle(x, indices.flap, indices.flap_rate, blade, cosine, sine)
    xi, xi_rate = blade_angle(x, indices.lag, indices.lag_rate, blade, cosine, sine)
    return Pose(cosine, sine, beta, beta_rate, xi, xi_rate)


@kernel
def swashplate_azimuth(blade, pose):
    """Cosine and sine of psi_k + psi_s."""
    return (
        pose.cosine * blade.cos_phase - pose.sine * blade.sin_phase,
        pose.sine * blade.cos_phase + pose.cosine * blade.sin_phase,
    )


@kernel
def blade_pitch(aircraft, blade, pose, swash):
    """Pitch of blades at the hinge [rad], eq. (4.8)."""
    angles, quad = aircraft.indices.swash, blade.quad
    cosine, sine = swashplate_azimuth(blade, pose)
    collective = spread(swash, angles[S.COLLECTIVE], quad, blade)
    lateral = spread(swash, angles[S.LATERAL], quad, blade)
    longitudinal = spread(swash, angles[S.LONGITUDINAL], quad, blade)
    return (
        collective
        - blade.sense * lateral * cosine
        - longitudinal * sine
        - blade.pitch_flap_coupling * pose.beta
        - blade.pitch_lag_coupling * pose.xi
    )


@kernel
def pitch_rate(aircraft, blade, pose, swash):
    """Rate of the pitch of blades [rad/s], eq. (4.8) differentiated, with swashplates that do not move."""
    angles, quad = aircraft.indices.swash, blade.quad
    cosine, sine = swashplate_azimuth(blade, pose)
    lateral = spread(swash, angles[S.LATERAL], quad, blade)
    longitudinal = spread(swash, angles[S.LONGITUDINAL], quad, blade)
    by_azimuth = blade.sense * lateral * sine - longitudinal * cosine
    return (
        blade.rotor_speed * by_azimuth
        - blade.pitch_flap_coupling * pose.beta_rate
        - blade.pitch_lag_coupling * pose.xi_rate
    )


@kernel
def pitch_motion(aircraft, blade, pose, swash):
    """Pitch over the azimuth and over time, eq. (4.8) differentiated, with swashplates that do not move."""
    angles, quad = aircraft.indices.swash, blade.quad
    cosine, sine = swashplate_azimuth(blade, pose)
    lateral = blade.sense * spread(swash, angles[S.LATERAL], quad, blade)
    longitudinal = spread(swash, angles[S.LONGITUDINAL], quad, blade)
    slope, curvature = lateral * sine - longitudinal * cosine, lateral * cosine + longitudinal * sine
    speed = blade.rotor_speed
    rate = speed * slope - blade.pitch_flap_coupling * pose.beta_rate - blade.pitch_lag_coupling * pose.xi_rate
    return PitchMotion(slope, curvature, rate, (speed * speed) * curvature)


@kernel
def set_offset_equations(aircraft, memory, r, pose, basis, motion, air_loads, at_hub, pitch, turning):
    """Set what a register r of blades with offsets has in the equations (5.6), and add it to the sums.

    The inertia that flap and lag have in common is taken out of flap: its column, moment and inertia are those that are
    left once lag is eliminated, eq. (3.17).
    """
    blade, terms, own = aircraft.blades[r], memory.terms[r], memory.pitching[r]
    found = blade_equations(blade, basis, motion, pitch, turning, air_loads.load, at_hub)
    moments = HingeMoments(
        found.moments[0] - blade.flap_spring * (pose.beta - blade.flap_rest),
        found.moments[1] - blade.lag_spring * (pose.xi - blade.lag_rest) - blade.lag_damping * pose.xi_rate,
        inverse_where(blade.lead_lag, found.lag_inertia),
    )
    if seldom(aircraft.switches[0].axial_dampers == 1):
        moments = with_axial_damper(blade, basis, pose, moments, pitch, turning.rate)
    if seldom(aircraft.switches[0].lag_stops == 1):
        moments = with_lag_stops(blade, pose, moments)
    inverse_lag_inertia = moments.inverse_lag_inertia
    share = rounded(found.flap_lag * inverse_lag_inertia)
    flap, lag = about_cg(blade, basis, found.flap), about_cg(blade, basis, found.lag)
    flap = ForceMoment(flap.force - scaled(lag.force, share), flap.moment - scaled(lag.moment, share))
    moments = HingeMoments(moments.flap - share * moments.lag, moments.lag, inverse_lag_inertia)
    inverse_flap_inertia = inverse_where(blade.mass, found.flap_inertia - share * found.flap_lag)
    known, column = about_cg(blade, basis, found.known), about_cg(blade, basis, found.pitch)
    set_terms(terms, pose, moments, flap, lag, known, inverse_lag_inertia)
    own.slope, own.column_force, own.column_moment = turning.slope, column.force, column.moment
    own.moment, own.inertia = found.moments[2], found.pitch_inertia
    own.flap_coupling, own.lag_coupling = found.flap_pitch - share * found.lag_pitch, found.lag_pitch
    own.lag_share, own.inverse_flap_inertia = share, inverse_flap_inertia
    thrust = rounded(air_loads.load.force.z)
    root_moment = blade.hinge_offset * air_loads.normal_force + air_loads.normal_moment
    inertia = locked_offset_inertia(blade, basis, pitch)
    add_to_sums(
        memory, blade, pose, thrust, root_moment, inertia, moments, flap, lag, known, inverse_flap_inertia,
        inverse_lag_inertia,
    )  # fmt: skip


@kernel
def set_equations(aircraft, memory, r, pose, basis, motion, loads, at_hinges, at_hub, swash, pitch):
    """Set what a register r of blades has in the equations (5.6), and add it to the sums.

    `at_hinges` and `at_hub` are the known accelerations of the hub [m/s^2] in the moments about the hinges and in the
    loads on the hub.
    """
    blade, terms = aircraft.blades[r], memory.terms[r]
    own = blade_accelerations(basis, motion)
    moments = hinge_moments(blade, basis, pose, loads, own.hinge + at_hinges, own.slope)
    if seldom(aircraft.switches[0].axial_dampers == 1):
        moments = with_axial_damper(blade, basis, pose, moments, pitch, pitch_rate(aircraft, blade, pose, swash))
    if seldom(aircraft.switches[0].lag_stops == 1):
        moments = with_lag_stops(blade, pose, moments)
    flap, lag = hinge_columns(blade, basis)
    flap, lag = about_cg(blade, basis, flap), about_cg(blade, basis, lag)
    on_hub = known_loads(blade, basis, loads, own.hinge + at_hub, own.slope)
    if seldom(aircraft.switches[0].section_options > 0):
        on_hub = with_outward_force(basis, on_hub, terms.outward_force)
    known = about_cg(blade, basis, on_hub)
    inverse_lag_inertia = blade.lead_lag * moments.inverse_lag_inertia
    set_terms(terms, pose, moments, flap, lag, known, inverse_lag_inertia)
    if seldom(aircraft.switches[0].complete_hub_moment == 0):
        terms.paper_moment, terms.flap_axis = paper_moment(blade, basis, pose, loads)
    thrust = rounded(basis.cos_flap * loads.normal_force)
    if seldom(aircraft.switches[0].section_options > 0):
        thrust = thrust + basis.span.z * terms.outward_force
    root_moment = blade.hinge_offset * loads.normal_force + loads.normal_moment  # Int (e_0 + s) dF_n
    inertia, inverse = locked_inertia(blade, basis), blade.inverse_second_moment
    add_to_sums(
        memory, blade, pose, thrust, root_moment, inertia, moments, flap, lag, known, inverse, inverse_lag_inertia
    )


@kernel
def set_terms(terms, pose, moments, flap, lag, known, inverse_lag_inertia):
    """Keep what the accelerations of blades follow from: the columns about the c.g., hinge moments, known loads."""
    terms.cosine, terms.sine = pose.cosine, pose.sine
    terms.flap_column_force, terms.flap_column_moment = flap.force, flap.moment
    terms.lag_column_force, terms.lag_column_moment = lag.force, lag.moment
    terms.flap_moment, terms.lag_moment = moments.flap, moments.lag
    terms.inverse_lag_inertia = inverse_lag_inertia
    terms.known_force, terms.known_moment = known.force, known.moment


@kernel
def add_to_sums(memory, blade, pose, thrust, root_moment, inertia, moments, flap, lag, known, inverse_flap_inertia,
                inverse_lag_inertia):  # fmt: skip
    """Add to the sums over quads what the equations of the body and of the inflow need, in the order of SUMS.

    `flap` and `lag` are c_beta and c_xi about the c.g., `inertia` is that of `locked_inertia`. The hinges are
    eliminated, eq. (5.8).
    """
    first_moment, second_moment = inertia
    flap_acceleration = rounded(inverse_flap_inertia * moments.flap)  # while the body does not accelerate
    lag_acceleration = rounded(inverse_lag_inertia * moments.lag)
    force = known.force - flap.force * flap_acceleration - lag.force * lag_acceleration
    moment = known.moment - flap.moment * flap_acceleration - lag.moment * lag_acceleration
    add_to_quads(
        memory.sums,
        blade.quad,
        blade.starts_quad,
        "thrust",
        (thrust, root_moment * pose.sine, root_moment * pose.cosine, blade.mass, first_moment)
        + second_moment
        + (force, moment)
        + hinge_inertia(flap, lag, inverse_flap_inertia, inverse_lag_inertia),
    )


@kernel
def hinge_inertia(flap, lag, inverse_flap_inertia, inverse_lag_inertia):
    """c_beta c_beta^T / A_1 + c_xi c_xi^T / A_2 of eq. (5.8), block by block, in the order of SUMS."""
    flap_force, flap_moment = scaled(flap.force, inverse_flap_inertia), scaled(flap.moment, inverse_flap_inertia)
    lag_force, lag_moment = scaled(lag.force, inverse_lag_inertia), scaled(lag.moment, inverse_lag_inertia)
    return (
        symmetric_products(flap_force, flap.force, lag_force, lag.force)
        + outer_products(flap_moment, flap.force, lag_moment, lag.force)
        + symmetric_products(flap_moment, flap.moment, lag_moment, lag.moment)
    )


@kernel
def scaled(vector, factor):
    """Vector times a number, rounded."""
    return Vector(factor * vector.x, factor * vector.y, factor * vector.z)


@kernel
def symmetric_products(a, p, b, q):
    """Elements xx, yy, zz, xy, yz, zx of a p^T + b q^T, which is symmetric."""
    return (
        a.x * p.x + b.x * q.x,
        a.y * p.y + b.y * q.y,
        a.z * p.z + b.z * q.z,
        a.y * p.x + b.y * q.x,
        a.z * p.y + b.z * q.y,
        a.z * p.x + b.z * q.x,
    )


@kernel
def outer_products(a, p, b, q):
    """Rows of a p^T + b q^T."""
    return p * a.x + q * b.x, p * a.y + q * b.y, p * a.z + q * b.z


@kernel
def sum_blades(aircraft, memory):
    """Set the sums over each rotor, and over all of them."""
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
def set_hub_velocities(aircraft, memory, flight):
    """Set the velocity of every hub relative to the air, hub axes."""
    for j in range(aircraft.rotors.shape[0]):
        memory.flow[j].velocity = hub_motion(aircraft.rotors[j], flight).air_velocity
        if seldom(in_space(flight.air)):
            memory.flow[j].velocity = memory.flow[j].velocity - gust_of_rotor(flight.air, j)


@kernel
def body_loads(aircraft, memory, flight, swash):
    """Loads on the rigid part: fuselage, surfaces, ducts, ground and gyroscopic terms, first part of eq. (5.7)."""
    air, body, omega = aircraft.air[0], aircraft.body[0], flight.omega
    drag = plate_drag(air.density, air.plate_areas, flight.air_velocity)
    force = drag - cross(omega, cross(omega, body.first_moment))
    moment = -cross(omega, body.inertia @ omega)
    for j in range(aircraft.rotors.shape[0]):
        duct = duct_load(aircraft, memory, j)
        force, moment = force + duct.force, moment + duct.moment
    for i in range(aircraft.surfaces.shape[0]):
        load = load_of_surface(aircraft, memory, flight, swash, i)
        force, moment = force + load.force, moment + load.moment
    for i in range(aircraft.fuselages.shape[0]):
        load = load_of_fuselage(aircraft, memory, flight, i)
        force, moment = force + load.force, moment + load.moment
    if seldom(aircraft.switches[0].contact == 1):
        ground = contact_load(aircraft.ground[0], aircraft.contacts, memory, flight)
        force, moment = force + ground.force, moment + ground.moment
    return ForceMoment(force, moment)


@kernel
def load_of_surface(aircraft, memory, flight, swash, i):
    """Load of the air on a lifting surface about the c.g., body axes."""
    surface, ramps = aircraft.surfaces[i], aircraft.ramps[i]
    wash = wash_at(aircraft, memory, surface, ramps)
    if seldom(in_space(flight.air)):
        wash = wash - gust_of_part(aircraft, flight.air, i)
    density, velocity = aircraft.air[0].density, flight.air_velocity
    return surface_load(density, surface, ramps, aircraft.shapes, swash, velocity, flight.omega, wash)


@kernel
def load_of_fuselage(aircraft, memory, flight, i):
    """Load of the air on a fuselage with tables about the c.g., body axes."""
    number = aircraft.surfaces.shape[0] + i
    fuselage, ramps = aircraft.fuselages[i], aircraft.ramps[number]
    wash = wash_at(aircraft, memory, fuselage, ramps)
    if seldom(in_space(flight.air)):
        wash = wash - gust_of_part(aircraft, flight.air, number)
    return fuselage_load(aircraft.air[0].density, fuselage, aircraft.shapes, flight.air_velocity, flight.omega, wash)


@kernel
def duct_load(aircraft, memory, j):
    """Force and moment about the c.g. of the duct around a rotor, body axes, eq. (5.12) or (6.11)."""
    rotor = aircraft.rotors[j]
    if rotor.duct == 1:
        mu = memory.flow[j].velocity * rotor.inverse_tip_speed
        flow = flow_of_duct(aircraft, memory, j)
        scale = aircraft.air[0].density * rotor.momentum_scale
        drag = scale * flow.mass_flow * rotor.duct_turning
        force = rotor.axes @ Vector(-(drag * mu.x), -(drag * mu.y), -(scale * flow.duct))
        at_lip = rotor.axes @ Vector(-(drag * mu.x), -(drag * mu.y), 0.0)
        moment = cross(rotor.hub, force) + cross(shaft_down(rotor.axes) * -rotor.lip_arm, at_lip)
    else:
        force = rotor.axes @ Vector(0.0, 0.0, -duct_thrust(rotor.duct_expansion, memory.totals[j].thrust))
        moment = cross(rotor.hub, force)
    return ForceMoment(force, moment)


@kernel
def wash_at(aircraft, memory, part, ramps):
    """Velocity relative to the air that the wash of a rotor adds at a surface or fuselage [m/s], body axes."""
    none = 0.0 * aircraft.air[0].density
    wash = Vector(none, none, none)
    if part.rotor >= 0:
        wash = rotor_wash(part, ramps, aircraft.rotors[part.rotor], memory.flow[part.rotor], memory.state)
    return wash


class Symmetric(NamedTuple):
    """Symmetric matrix by its elements."""

    xx: Any
    yy: Any
    zz: Any
    xy: Any
    yz: Any
    zx: Any


@kernel
def symmetric(elements):
    """Symmetric matrix of a field of six lanes, or of a matrix of six elements."""
    return Symmetric(elements[0], elements[1], elements[2], elements[3], elements[4], elements[5])


@kernel
def solve_with_blades(aircraft, memory, loads):
    """Set specific force and angular acceleration of the body, all blades eliminated (`complete`), eq. (5.8)."""
    body, total = aircraft.body[0], memory.totals[aircraft.rotors.shape[0]]
    right = ForceMoment(loads.force + total.force, loads.moment + total.moment)
    m = body.mass + total.mass
    matrix = mass_matrix(body, total, Vector(m, m, m))
    solved = solve_blocks(matrix.force, matrix.coupling, matrix.moment, right)
    set_acceleration(memory, solved.force, solved.moment)


class MassMatrix(NamedTuple):
    """Matrix of eq. (5.8) by its blocks: force by force, moment by force, moment by moment."""

    force: Any
    coupling: Any
    moment: Any


@kernel
def mass_matrix(body, total, mass):
    """Left side of eq. (5.8); `mass` is that of everything along each axis [kg]."""
    s, i = body.first_moment + total.first_moment, body.inertia
    e = symmetric(total.second_moment)
    # the sum of c c^T / A over the hinges, block by block
    h_force, h_coupling, h_moment = symmetric(total.hinge_mass), total.hinge_coupling, symmetric(total.hinge_inertia)
    force_block = Symmetric(
        mass.x - h_force.xx, mass.y - h_force.yy, mass.z - h_force.zz, -h_force.xy, -h_force.yz, -h_force.zx
    )
    coupling_block = Matrix(
        Vector(-h_coupling.x.x, -s.z - h_coupling.x.y, s.y - h_coupling.x.z),
        Vector(s.z - h_coupling.y.x, -h_coupling.y.y, -s.x - h_coupling.y.z),
        Vector(-s.y - h_coupling.z.x, s.x - h_coupling.z.y, -h_coupling.z.z),
    )
    moment_block = Symmetric(
        i.x.x + (e.yy + e.zz) - h_moment.xx,
        i.y.y + (e.zz + e.xx) - h_moment.yy,
        i.z.z + (e.xx + e.yy) - h_moment.zz,
        i.y.x - e.xy - h_moment.xy,
        i.z.y - e.yz - h_moment.yz,
        i.z.x - e.zx - h_moment.zx,
    )
    return MassMatrix(force_block, coupling_block, moment_block)


@kernel
def solve_on_stand(aircraft, memory, flight, loads):
    """Set specific force and angular acceleration of rotors on a stand, eqs. (5.19) to (5.21)."""
    body, total = aircraft.body[0], memory.totals[aircraft.rotors.shape[0]]
    known = flight.gravity - cross(flight.omega, flight.velocity)  # U' is the specific force and this
    matrix = mass_matrix(body, total, body.stand_mass + Vector(total.mass, total.mass, total.mass))
    stand = stand_loads(body, memory.state, flight, known)
    right = ForceMoment(loads.force + total.force + stand.force, loads.moment + total.moment + stand.moment)
    still = Vector(1.0 - body.free.x, 1.0 - body.free.y, 1.0 - body.free.z)
    solved = solve_locked(matrix, right, body.free, body.free_turn, -along(still, known))
    set_acceleration(memory, solved.force, solved.moment)


@kernel
def stand_loads(body, x, flight, known):
    """Springs, dampers and inertial loads of a stand, eq. (5.19); its own weight is balanced at rest."""
    place = transposed(flight.to_earth) @ S.vector_at(x, S.POSITION)
    pull, momentum = along(body.spring, place), along(body.stand_mass, flight.velocity)
    attitude = S.attitude_at(x)
    turn = Vector(attitude.x, attitude.y, attitude.z)
    twist = along(body.turn_spring, turn)
    force = -(pull + along(body.damping, flight.velocity) + along(body.stand_mass, known))
    moment = cross(place, pull) - (twist * attitude.w + cross(twist, turn)) * 2.0
    return ForceMoment(
        force - cross(flight.omega, momentum),
        moment - along(body.turn_damping, flight.omega) - cross(flight.velocity, momentum),
    )


@kernel
def along(factors, vector):
    """Product axis by axis."""
    return Vector(factors.x * vector.x, factors.y * vector.y, factors.z * vector.z)


@kernel
def solve_locked(matrix, right, free, free_turn, given):
    """Solve for the free axes; the locked ones have `given` specific force and no angular acceleration, eq. (5.21)."""
    force = along(free, right.force - times(matrix.force, given)) + given
    moment = along(free_turn, right.moment - matrix.coupling @ given)
    coupling = matrix.coupling
    return solve_blocks(
        free_block(matrix.force, free),
        Matrix(
            along(free, coupling.x) * free_turn.x,
            along(free, coupling.y) * free_turn.y,
            along(free, coupling.z) * free_turn.z,
        ),
        free_block(matrix.moment, free_turn),
        ForceMoment(force, moment),
    )


@kernel
def free_block(block, free):
    """Symmetric matrix with the rows and columns of what is locked replaced by those of the identity."""
    return Symmetric(
        block.xx * free.x + (1.0 - free.x),
        block.yy * free.y + (1.0 - free.y),
        block.zz * free.z + (1.0 - free.z),
        block.xy * (free.x * free.y),
        block.yz * (free.y * free.z),
        block.zx * (free.z * free.x),
    )


@kernel
def hold_locked_axes(aircraft, dx):
    """Keep the velocities of the locked axes of a stand."""
    body = aircraft.body[0]
    S.set_vector(dx, S.VELOCITY, along(body.free, S.vector_at(dx, S.VELOCITY)))
    S.set_vector(dx, S.RATES, along(body.free_turn, S.vector_at(dx, S.RATES)))


@kernel
def set_acceleration(memory, specific_force, angular):
    """Set the acceleration of the body: specific force of the c.g. [m/s^2] and om' [rad/s^2]."""
    acceleration = memory.acceleration[0]
    acceleration.specific_force, acceleration.angular = specific_force, angular


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
    inverse_determinant = 1.0 / (m.xx * xx + m.xy * xy + m.zx * zx)
    return Symmetric(
        rounded(xx * inverse_determinant),
        rounded(yy * inverse_determinant),
        rounded(zz * inverse_determinant),
        rounded(xy * inverse_determinant),
        rounded(yz * inverse_determinant),
        rounded(zx * inverse_determinant),
    )


@kernel
def solve_blocks(force_block, coupling, moment_block, right):
    """Solve [force_block, coupling^T; coupling, moment_block] y = right by the Schur complement."""
    inverse = inverted(force_block)
    x, y, z = times(inverse, coupling.x), times(inverse, coupling.y), times(inverse, coupling.z)
    complement = Symmetric(
        moment_block.xx - dot(coupling.x, x),
        moment_block.yy - dot(coupling.y, y),
        moment_block.zz - dot(coupling.z, z),
        moment_block.xy - dot(coupling.x, y),
        moment_block.yz - dot(coupling.y, z),
        moment_block.zx - dot(coupling.z, x),
    )
    gain = Matrix(x, y, z)  # coupling @ inverse
    angular = times(inverted(complement), right.moment - gain @ right.force)
    return ForceMoment(times(inverse, right.force) - transposed(gain) @ angular, angular)


@kernel
def solve_blades(aircraft, memory):
    """Set flap and lag accelerations of every blade from those of the body, eq. (5.9)."""
    body = memory.acceleration[0]
    for r in range(aircraft.blades.shape[0]):
        terms = memory.terms[r]
        flap = (
            terms.flap_moment
            - dot(terms.flap_column_force, body.specific_force)
            - dot(terms.flap_column_moment, body.angular)
        )
        lag = (
            terms.lag_moment
            - dot(terms.lag_column_force, body.specific_force)
            - dot(terms.lag_column_moment, body.angular)
        )
        terms.flap_acceleration = flap * inverse_flap_inertia(aircraft, memory, r)
        terms.lag_acceleration = lag * terms.inverse_lag_inertia


@kernel
def solve_blades_alone(aircraft, memory):
    """Set flap and lag accelerations of every blade on a hub that does not accelerate (`paper`)."""
    for r in range(aircraft.blades.shape[0]):
        blade, terms = aircraft.blades[r], memory.terms[r]
        terms.flap_acceleration = terms.flap_moment * blade.inverse_second_moment
        terms.lag_acceleration = terms.lag_moment * terms.inverse_lag_inertia


@kernel
def set_hub_loads(aircraft, memory):
    """Set thrust, shaft torque, force and moment of each rotor on its hub (theory.md section 5.5)."""
    sum_hub_loads(aircraft, memory)
    switches = aircraft.switches[0]
    for j in range(aircraft.rotors.shape[0]):
        rotor, loads, total = aircraft.rotors[j], memory.loads[j], memory.totals[j]
        force, moment, paper = Vector(0.0, 0.0, 0.0), Vector(0.0, 0.0, 0.0), Vector(0.0, 0.0, 0.0)
        for quad in range(rotor.first_quad, rotor.first_quad + rotor.quads):
            part = memory.hubs[quad]
            force, moment, paper = force + part.force, moment + part.moment, paper + part.paper_moment
        if switches.complete_coupling == 1:
            locked = locked_loads(total, memory.acceleration[0])
            force, moment = force - locked.force, moment - locked.moment
        moment = moment - cross(rotor.hub, force)
        down = shaft_down(rotor.axes)
        axial = dot(down, moment)
        if seldom(switches.complete_hub_moment == 0):  # across the shaft the paper's reading (theory.md section 9)
            moment = down * axial + paper
            axial = dot(down, moment)
        loads.thrust, loads.torque = total.thrust, rotor.sense * axial
        loads.force, loads.moment = force, moment
        if seldom(switches.offsets == 1):
            for quad in range(rotor.first_quad, rotor.first_quad + rotor.quads):
                loads.torque = loads.torque - memory.hubs[quad].pitch_power


@kernel
def sum_hub_loads(aircraft, memory):
    """Set the sums over quads of eq. (5.1) without J_k, about the c.g., and of the moment in the paper's reading."""
    for r in range(aircraft.blades.shape[0]):
        blade, terms = aircraft.blades[r], memory.terms[r]
        flap, lag = terms.flap_acceleration, terms.lag_acceleration
        force = terms.known_force - terms.flap_column_force * flap - terms.lag_column_force * lag
        moment = terms.known_moment - terms.flap_column_moment * flap - terms.lag_column_moment * lag
        add_to_quads(memory.hubs, blade.quad, blade.starts_quad, "force", (force, moment))
        if seldom(aircraft.switches[0].complete_hub_moment == 0):
            inertial = blade.lead_lag * blade.hub_second_moment * flap
            paper = terms.paper_moment - terms.flap_axis * inertial
            add_to_quads(memory.hubs, blade.quad, blade.starts_quad, "paper_moment", (paper,))
        if seldom(aircraft.switches[0].offsets == 1):
            power = pitch_power(memory, r)
            add_to_quads(memory.hubs, blade.quad, blade.starts_quad, "pitch_power", (power,))


@kernel
def pitch_power(memory, r):
    """Power of the moment about the pitch axis on the blades' pitch, over that of the shaft's turn, eq. (3.18)."""
    terms, own, body = memory.terms[r], memory.pitching[r], memory.acceleration[0]
    moment = (
        own.moment
        - own.flap_coupling * terms.flap_acceleration
        - own.lag_coupling * terms.lag_acceleration
        - dot(own.column_force, body.specific_force)
        - dot(own.column_moment, body.angular)
    )
    return rounded(own.slope * moment)


@kernel
def locked_loads(total, body):
    """J x of eq. (5.6) about the c.g.: what accelerates the blades of a rotor, their hinges locked, with the body."""
    force, turn = body.specific_force, body.angular
    s, e = total.first_moment, symmetric(total.second_moment)
    moment = cross(s, force) + Vector(
        (e.yy + e.zz) * turn.x - e.xy * turn.y - e.zx * turn.z,
        (e.zz + e.xx) * turn.y - e.xy * turn.x - e.yz * turn.z,
        (e.xx + e.yy) * turn.z - e.zx * turn.x - e.yz * turn.y,
    )
    return ForceMoment(force * total.mass + cross(turn, s), moment)


@kernel
def solve_body_alone(aircraft, memory, loads):
    """Set specific force and angular acceleration of the rigid aircraft under the hub loads (`paper`), eq. (5.11)."""
    body, total = aircraft.body[0], with_hub_loads(aircraft, memory, loads)
    i = body.inertia
    inertia = Symmetric(i.x.x, i.y.y, i.z.z, i.y.x, i.z.y, i.z.x)
    set_acceleration(memory, total.force * (1.0 / body.mass), times(inverted(inertia), total.moment))


@kernel
def with_hub_loads(aircraft, memory, loads):
    """Loads about the c.g. with those of the rotors on their hubs added."""
    force, moment = loads.force, loads.moment
    for j in range(aircraft.rotors.shape[0]):
        hub, of_rotor = aircraft.rotors[j].hub, memory.loads[j]
        force = force + of_rotor.force
        moment = moment + (of_rotor.moment + cross(hub, of_rotor.force))
    return ForceMoment(force, moment)


@kernel
def set_body_rates(memory, flight, dx):
    """Set the rates of position, attitude, velocity and angular velocity (theory.md section 5.6)."""
    acceleration = memory.acceleration[0]
    S.set_vector(dx, S.POSITION, flight.to_earth @ flight.velocity)
    S.set_attitude(dx, quaternion_rates(S.attitude_at(memory.state), flight.omega))
    velocity_rate = acceleration.specific_force + flight.gravity - cross(flight.omega, flight.velocity)
    S.set_vector(dx, S.VELOCITY, velocity_rate)
    S.set_vector(dx, S.RATES, acceleration.angular)


@kernel
def set_rotor_rates(aircraft, memory, dx):
    """Set the rates of the multiblade coordinates (paper eqs. [13], [14]) and of the inflow."""
    x, lead_lag = memory.state, aircraft.switches[0].lead_lag
    if seldom(aircraft.switches[0].offsets == 1):
        add_lag_of_flap(aircraft, memory, -1.0)
    for r in range(aircraft.blades.shape[0]):
        add_accelerations(aircraft.blades[r], memory.terms[r], memory.means, memory.harmonics)
    for j in range(aircraft.rotors.shape[0]):
        rotor = aircraft.rotors[j]
        for i in range(rotor.blades):
            dx[rotor.flap + i], dx[rotor.lag + i] = x[rotor.flap_rate + i], lead_lag * x[rotor.lag_rate + i]
        set_accelerations(rotor, memory.means, memory.harmonics, dx)
        add_rotation_terms(rotor, x, dx, rotor.flap, rotor.flap_rate, 1.0)
        add_rotation_terms(rotor, x, dx, rotor.lag, rotor.lag_rate, 1.0 * lead_lag)
        set_inflow_rates(aircraft, memory, j, dx)
    if seldom(aircraft.switches[0].unsteady_airfoil == 1):
        set_circulation_rates(aircraft, memory, dx)


@kernel
def flow_of_disc(aircraft, memory, j):
    """Flow through a disc; the wash of other rotors is part of the air that comes to it."""
    rotor, uniform = aircraft.rotors[j], memory.state[aircraft.rotors[j].inflow + S.UNIFORM]
    mu = memory.flow[j].velocity * rotor.inverse_tip_speed
    if seldom(aircraft.switches[0].wash == 1):
        met = sheltered(rotor.duct_turning, met_with_wash(memory, j, mu))
        flow = rotor_flow(rotor, uniform, met)
    elif seldom(aircraft.switches[0].ducts == 1):
        flow = rotor_flow(rotor, uniform, sheltered(rotor.duct_turning, mu))
    else:
        flow = rotor_flow(rotor, uniform, mu)
    return flow


@kernel
def flow_of_duct(aircraft, memory, j):
    """Thrusts of a rotor and of its duct; the wash of other rotors is part of the air that comes to them."""
    rotor, uniform = aircraft.rotors[j], memory.state[aircraft.rotors[j].inflow + S.UNIFORM]
    mu = memory.flow[j].velocity * rotor.inverse_tip_speed
    if seldom(aircraft.switches[0].wash == 1):
        flow = duct_flow(rotor, uniform, met_with_wash(memory, j, mu))
    else:
        flow = duct_flow(rotor, uniform, mu)
    return flow


@kernel
def add_lag_of_flap(aircraft, memory, factor):
    """Add `factor` times the share of lag in flap: -1 makes xi'' of what is left of it in eq. (3.17), 1 undoes that."""
    for r in range(aircraft.blades.shape[0]):
        terms, own = memory.terms[r], memory.pitching[r]
        change = rounded(own.lag_share * terms.flap_acceleration)
        terms.lag_acceleration = terms.lag_acceleration + factor * change


@kernel
def set_inflow_rates(aircraft, memory, j, dx):
    """Set the inflow rates of a rotor from the sums over its blades, eqs. (6.1) and (6.2)."""
    rotor, total = aircraft.rotors[j], memory.totals[j]
    scale = rotor.coefficient_scale
    moment_scale = scale / rotor.radius
    loads = Inflow(
        rounded(total.thrust * scale),
        rounded(total.cosine_moment * moment_scale),
        rounded(total.sine_moment * moment_scale),
    )
    rates = rates_of_inflow(aircraft, memory, j, loads)
    uniform, sine, cosine = rotor.inflow + S.UNIFORM, rotor.inflow + S.SINE, rotor.inflow + S.COSINE
    dx[uniform], dx[cosine], dx[sine] = rates.uniform, rates.cosine, rates.sine


@kernel
def rates_of_inflow(aircraft, memory, j, loads):
    """Rates of the inflow of a rotor [1/s] under given loads on its disc, eq. (6.1)."""
    rotor, x = aircraft.rotors[j], memory.state
    states = Inflow(x[rotor.inflow + S.UNIFORM], x[rotor.inflow + S.COSINE], x[rotor.inflow + S.SINE])
    flow = flow_of_disc(aircraft, memory, j)
    if seldom(aircraft.switches[0].ring == 1):  # the mean inflow is that of the mean thrust
        loads = Inflow(loads.uniform + memory.ring[LOAD, j], loads.cosine, loads.sine)
    rates = inflow_rates(rotor, states, flow, loads, aircraft.switches[0].cyclic_inflow)
    uniform = rounded(rates.uniform)
    if rotor.duct == 1:
        missing = loads.uniform - flow_of_duct(aircraft, memory, j).rotor
        uniform = rounded(rotor.inflow_speed * INVERSE_MASS * missing)
    return Inflow(uniform, rates.cosine, rates.sine)
