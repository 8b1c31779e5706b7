"""Drives: rotors whose speed is a state, and the engines that turn them (theory.md section 7.6).

The azimuth of a drive is one more coordinate of the multibody system of `sbs_sim.model.dynamics`. Its column in the
mass matrix follows from the sums over the blades of each rotor that are there anyway, and it is eliminated as a hinge
is: the body's equations keep their form. `driven_derivative` is an entry of its own, so that aircraft without drives
execute what they always did.
"""

import math
from typing import Any, NamedTuple

from sbs_sim.lanes import (
    Matrix,
    Vector,
    add_to_quads,
    as_lanes,
    as_records,
    cross,
    dot,
    floor,
    maximum,
    minimum,
    rounded,
    select,
    spread,
    transposed,
)
from sbs_sim.model import state as S
from sbs_sim.model.blade import ForceMoment
from sbs_sim.model.dynamics import (
    body_motion,
    locked_loads,
    memory_in_lanes,
    scaled,
    set_hub_loads,
    set_known_loads,
    set_rates,
    solve_blades,
    solve_coupled_body,
    symmetric,
    symmetric_products,
    times,
    with_rotors,
)
from sbs_sim.model.frames import shaft_down
from sbs_sim.model.kernel import entry, kernel
from sbs_sim.model.offset import inverse_flap_inertia
from sbs_sim.model.teeter import coning_acceleration, hold_coning, inverse_sum, lock_coning

NONE, ENGINE, ELECTRIC = range(3)  # kinds of engines
SPEEDS, AZIMUTHS, ACCELERATIONS = range(3)  # of `Work.turning`
TURN, INVERSE_TURN = 2.0 * math.pi, 1.0 / (2.0 * math.pi)
SLOWEST = 1e-3  # of the speed in the file: below it the largest power does not limit the torque any more


class Turn(NamedTuple):
    """Acceleration of a body like `sbs_sim.model.records.ACCELERATION`: of its c.g. [m/s^2], and angular [rad/s^2]."""

    specific_force: Any
    angular: Any


class Engine(NamedTuple):
    """What the states of a drive give: torque at the shaft [N m], rates of torque, governor and discharge [1/s]."""

    shaft_torque: Any
    torque_rate: Any
    governor_rate: Any
    discharge_rate: Any


@entry
def driven_derivative(model, x, swash, psi, wind, work, dx, with_loads):
    """Time derivative of the state of an aircraft with drives.

    Parameters
    ----------
    model, x, wind, work, dx, with_loads : see `sbs_sim.model.dynamics.derivative`
    swash : ndarray, shape (3 n_rows, n)
        Swashplate angles [rad], and commands to drives, see `sbs_sim.Aircraft.mix`.
    psi : ndarray, shape (n_rotors, n)
        Azimuths of the rotors [rad]; of those with a drive where that of the drive is zero.
    """
    rotors, blades = as_records(work.turning_rotors), as_records(work.turning_blades)
    aircraft, memory = with_rotors(model, rotors, blades), memory_in_lanes(work)
    kept, drives, shafts = as_records(model.rotors), as_records(model.drives), as_records(work.shafts)
    like = aircraft.air[0]
    given, out, turning = as_lanes(x, like), as_lanes(dx, like), as_lanes(work.turning, like)
    for i in range(given.shape[0]):
        memory.state[i] = given[i]
    set_turning(aircraft, memory.state, kept, drives, as_lanes(psi, like), turning)
    flight = body_motion(aircraft, memory.state, as_lanes(wind, like))
    commands = as_lanes(swash, like)
    loads = set_known_loads(aircraft, memory, flight, commands, turning[AZIMUTHS])
    loads = transmission_loads(memory.state, drives, flight, loads)
    if aircraft.switches[0].teetering == 1:
        lock_coning(aircraft, memory)
    if aircraft.switches[0].offsets == 1:
        sum_pitching(aircraft, memory)
    for i in range(drives.shape[0]):
        set_drive_rates(memory.state, drives[i], shafts[i], commands, out)
        eliminate(aircraft, memory, drives, i, shafts[i])
    solve_coupled_body(aircraft, memory, flight, loads)
    solve_blades(aircraft, memory)
    solve_shafts(aircraft, memory, drives, shafts, turning, out)
    turn_blades(aircraft, memory, turning)
    if aircraft.switches[0].teetering == 1:
        hold_coning(aircraft, memory)
    if with_loads:
        set_hub_loads(aircraft, memory)
        add_shaft_loads(aircraft, memory, turning)
    set_rates(aircraft, memory, flight, out)
    add_speeding_terms(aircraft, memory, turning, out)


@kernel
def set_turning(aircraft, x, kept, drives, psi, turning):
    """Set speeds and azimuths of rotors, and the speeds in the records of rotors and blades."""
    for j in range(aircraft.rotors.shape[0]):
        rotor, number = kept[j], kept[j].drive
        speed, azimuth = rotor.rotor_speed + 0.0, psi[j] + 0.0
        if number >= 0:
            speed = speed + rotor.gear * x[drives[number].speed_index]
            azimuth = azimuth + rotor.gear * x[drives[number].unseen_index + S.AZIMUTH]
        turning[SPEEDS, j] = speed
        turning[AZIMUTHS, j] = azimuth - TURN * floor(azimuth * INVERSE_TURN)
        aircraft.rotors[j].rotor_speed = speed
    for r in range(aircraft.blades.shape[0]):
        blade = aircraft.blades[r]
        blade.rotor_speed = spread(turning[SPEEDS], aircraft.indices.azimuth, blade.quad, blade)


@kernel
def transmission_loads(x, drives, flight, loads):
    """Loads on the rigid part with the gyroscopic moments of the transmissions, eq. (7.10)."""
    moment = loads.moment
    for i in range(drives.shape[0]):
        moment = moment - cross(flight.omega, drives[i].momentum * x[drives[i].speed_index])
    return ForceMoment(loads.force, moment)


# --- the engine -------------------------------------------------------------------------------------------------


@kernel
def set_drive_rates(x, drive, shaft, commands, dx):
    """Set the torque on the shaft of a drive, and the rates of its states but for its speed.

    `commands` are the swashplate angles, and behind them throttle and set point of drives that pilot controls act on.
    """
    speed, unseen = x[drive.speed_index] + 0.0, drive.unseen_index
    dx[unseen + S.AZIMUTH] = speed
    dx[unseen + S.DISCHARGE], dx[unseen + S.FAILURE] = 0.0 * speed, 0.0 * speed
    shaft.torque = 0.0 * speed
    if drive.engine == NONE:
        return
    torque = x[drive.torque_index] + 0.0
    set_point, given_throttle = drive.set_point + 0.0 * speed, drive.throttle + 0.0 * speed
    if drive.command_index >= 0:
        set_point = rounded(drive.speed * commands[drive.command_index + 1])
        given_throttle = commands[drive.command_index] + 0.0
    missing = (set_point - speed) / drive.speed
    integral, throttle = 0.0 * speed, given_throttle
    if drive.command_index >= 0:
        throttle = minimum(maximum(throttle, 0.0), 1.0)
    if drive.governor_index >= 0:
        integral = x[drive.governor_index] + 0.0
        wanted = given_throttle + integral + drive.proportional_gain * missing
        throttle = minimum(maximum(wanted, 0.0), 1.0)
        # at an end of the throttle the integral does not grow on
        winds_up = ((wanted > 1.0) & (missing > 0.0)) | ((wanted < 0.0) & (missing < 0.0))
        dx[drive.governor_index] = select(winds_up, 0.0, drive.integral_gain * missing)
    running = minimum(maximum(1.0 - x[unseen + S.FAILURE], 0.0), 1.0)
    if drive.engine == ELECTRIC:
        used = x[unseen + S.DISCHARGE] + 0.0
        running = select(used < 1.0, running, 0.0)
        voltage = rounded(throttle * (drive.full_voltage - used * drive.voltage_drop))
        wanted_torque = rounded(drive.torque_constant * (drive.conductance * (voltage - drive.torque_constant * speed)))
        current = rounded(torque * drive.inverse_torque_constant)
        dx[unseen + S.DISCHARGE] = rounded(throttle * running) * current * drive.inverse_capacity
        most = limit(drive, speed)
        wanted_torque = minimum(maximum(wanted_torque, -most), most)
    else:
        wanted_torque = rounded(throttle * limit(drive, speed))
    if drive.free_wheel == 1:
        wanted_torque = maximum(wanted_torque, 0.0)
    dx[drive.torque_index] = drive.inverse_lag * (running * wanted_torque - torque)
    shaft.torque = shaft_torque(drive, torque, speed)


@kernel
def shaft_torque(drive, torque, speed):
    """Torque that an engine of some torque gives to the shaft at a speed [N m], eq. (7.13)."""
    given = torque - drive.drag * speed
    if drive.free_wheel == 1:
        given = maximum(given, 0.0)
    return given


@kernel
def limit(drive, speed):
    """Largest torque of an engine at a speed [N m]."""
    return minimum(drive.max_torque + 0.0 * speed, drive.max_power / maximum(abs(speed), SLOWEST * drive.speed))


# --- the coordinate of the drive --------------------------------------------------------------------------------


@kernel
def turn_of(rotor):
    """What a unit of acceleration of the shaft adds to the acceleration of a rotor's blades, as if of the body: e_j."""
    axis = scaled(shaft_down(rotor.axes), -rotor.sense)
    return Turn(cross(rotor.hub, axis), axis)


@kernel
def column_of(total, turn):
    """J e of a rotor, its hinges eliminated, eq. (7.11)."""
    locked = locked_loads(total, turn)
    force, angular, coupling = turn.specific_force, turn.angular, total.hinge_coupling
    mass, inertia = symmetric(total.hinge_mass), symmetric(total.hinge_inertia)
    return ForceMoment(
        locked.force - times(mass, force) - transposed(coupling) @ angular,
        locked.moment - coupling @ force - times(inertia, angular),
    )


@kernel
def eliminate(aircraft, memory, drives, number, shaft):
    """Take the speed of a drive out of the equations of the body, as eq. (5.8) does with a hinge."""
    drive, every = drives[number], memory.totals[aircraft.rotors.shape[0]]
    force, moment = Vector(0.0, 0.0, 0.0), drive.momentum
    inertia, torque = drive.inertia + 0.0, shaft.torque + 0.0
    for j in range(aircraft.rotors.shape[0]):
        rotor = aircraft.rotors[j]
        if rotor.drive == number:
            total, turn = memory.totals[j], turn_of(rotor)
            column = column_of(total, turn)
            force = force + scaled(column.force, rotor.gear)
            moment = moment + scaled(column.moment, rotor.gear)
            squared = rounded(rotor.gear * rotor.gear)
            inertia = inertia + squared * power(turn, column)
            torque = torque + rotor.gear * power(turn, ForceMoment(total.force, total.moment))
            if aircraft.switches[0].offsets == 1:
                pitching = pitching_of(memory, rotor)
                column = ForceMoment(pitching.force, pitching.moment)
                force = force + scaled(column.force, rotor.gear)
                moment = moment + scaled(column.moment, rotor.gear)
                inertia = inertia + squared * (2.0 * power(turn, column) + pitching.inertia)
                torque = torque + rotor.gear * pitching.torque
    inverse = rounded(1.0 / inertia)
    shaft.force, shaft.moment, shaft.inverse_inertia, shaft.torque = force, moment, inverse, torque
    scaled_force, scaled_moment = scaled(force, inverse), scaled(moment, inverse)
    none = Vector(0.0, 0.0, 0.0)
    masses, moments = every.hinge_mass, every.hinge_inertia
    added = symmetric_products(scaled_force, force, none, none)
    added_inertia = symmetric_products(scaled_moment, moment, none, none)
    add_to(masses, added)
    add_to(moments, added_inertia)
    rows = every.hinge_coupling
    every.hinge_coupling = Matrix(
        rows.x + scaled(force, scaled_moment.x),
        rows.y + scaled(force, scaled_moment.y),
        rows.z + scaled(force, scaled_moment.z),
    )
    every.force = every.force - scaled(scaled_force, torque)
    every.moment = every.moment - scaled(scaled_moment, torque)


class Pitching(NamedTuple):
    """What a turn of the shaft does by the pitch of the blades of a rotor, eq. (7.17): columns, inertia, torque."""

    force: Any
    moment: Any
    inertia: Any
    torque: Any


@kernel
def sum_pitching(aircraft, memory):
    """Set the sums over quads of what a turn of the shaft does by the pitch of the blades, eq. (7.17)."""
    for r in range(aircraft.blades.shape[0]):
        blade, terms, own = aircraft.blades[r], memory.terms[r], memory.pitching[r]
        slope = own.slope
        flap, lag = rounded(slope * own.flap_coupling), rounded(slope * own.lag_coupling)
        by_flap, by_lag = rounded(flap * own.inverse_flap_inertia), rounded(lag * terms.inverse_lag_inertia)
        locked_force, locked_moment = own.column_force * slope, own.column_moment * slope
        locked_inertia = rounded(rounded(slope * slope) * own.inertia)
        add_to_quads(
            memory.pitch_sums,
            blade.quad,
            blade.starts_quad,
            "force",
            (
                locked_force - terms.flap_column_force * by_flap - terms.lag_column_force * by_lag,
                locked_moment - terms.flap_column_moment * by_flap - terms.lag_column_moment * by_lag,
                locked_inertia - by_flap * flap - by_lag * lag,
                slope * own.moment - by_flap * terms.flap_moment - by_lag * terms.lag_moment,
                by_flap,
                locked_force,
                locked_moment,
                locked_inertia,
            ),
        )


@kernel
def pitching_of(memory, rotor):
    """Sums over a rotor, the coning of a teetering one locked."""
    zero = rounded(0.0 * rotor.gear)
    force, moment, free, torque = Vector(zero, zero, zero), Vector(zero, zero, zero), zero, zero
    for quad in range(rotor.first_quad, rotor.first_quad + rotor.quads):
        own = memory.pitch_sums[quad]
        force, moment = force + own.force, moment + own.moment
        free, torque = free + own.inertia, torque + own.torque
    if rotor.teetering == 1:
        coning, flap = zero, zero
        force_share, moment_share = Vector(zero, zero, zero), Vector(zero, zero, zero)
        for quad in range(rotor.first_quad, rotor.first_quad + rotor.quads):
            locked = memory.coning[quad]
            coning, flap = coning + memory.pitch_sums[quad].coning, flap + locked.flap
            force_share, moment_share = force_share + locked.force_share, moment_share + locked.moment_share
        factor = rounded(coning / inverse_sum(memory, rotor))
        force, moment = force + scaled(force_share, factor), moment + scaled(moment_share, factor)
        free = free + factor * coning
        torque = torque + factor * (flap - rotor.blades * coning_acceleration(rotor, memory.state))
    return Pitching(force, moment, free, torque)


@kernel
def add_to(field, values):
    """Add six numbers to those of a field."""
    field[0], field[1], field[2] = field[0] + values[0], field[1] + values[1], field[2] + values[2]
    field[3], field[4], field[5] = field[3] + values[3], field[4] + values[4], field[5] + values[5]


@kernel
def power(turn, loads):
    """Product of two six-vectors."""
    return rounded(dot(turn.specific_force, loads.force) + dot(turn.angular, loads.moment))


@kernel
def solve_shafts(aircraft, memory, drives, shafts, turning, dx):
    """Set the accelerations of drives and rotors from those of the body, as eq. (5.9) does for a hinge."""
    body = Turn(memory.acceleration[0].specific_force, memory.acceleration[0].angular)
    for i in range(drives.shape[0]):
        shaft = shafts[i]
        rest = shaft.torque - power(body, ForceMoment(shaft.force, shaft.moment))
        shaft.acceleration = rest * shaft.inverse_inertia
        dx[drives[i].speed_index] = shaft.acceleration + 0.0
    for j in range(aircraft.rotors.shape[0]):
        rotor = aircraft.rotors[j]
        turning[ACCELERATIONS, j] = 0.0 * rotor.gear
        if rotor.drive >= 0:
            turning[ACCELERATIONS, j] = rotor.gear * shafts[rotor.drive].acceleration


@kernel
def turn_blades(aircraft, memory, turning):
    """Add to the flap and lag accelerations of blades what the acceleration of their shaft takes off."""
    for r in range(aircraft.blades.shape[0]):
        blade, terms = aircraft.blades[r], memory.terms[r]
        turn = turn_of(blade)
        acceleration = spread(turning[ACCELERATIONS], aircraft.indices.azimuth, blade.quad, blade)
        flap = power(turn, ForceMoment(terms.flap_column_force, terms.flap_column_moment))
        lag = power(turn, ForceMoment(terms.lag_column_force, terms.lag_column_moment))
        if aircraft.switches[0].offsets == 1:
            own = memory.pitching[r]
            flap, lag = flap + own.slope * own.flap_coupling, lag + own.slope * own.lag_coupling
        flap_share, lag_share = (
            rounded(flap * inverse_flap_inertia(aircraft, memory, r)),
            rounded(lag * terms.inverse_lag_inertia),
        )
        terms.flap_acceleration = terms.flap_acceleration - flap_share * acceleration
        terms.lag_acceleration = terms.lag_acceleration - lag_share * acceleration


@kernel
def add_shaft_loads(aircraft, memory, turning):
    """Add to the loads on hubs what accelerates the blades, their hinges locked, with their shaft."""
    for j in range(aircraft.rotors.shape[0]):
        rotor, loads, acceleration = aircraft.rotors[j], memory.loads[j], turning[ACCELERATIONS, j]
        locked = locked_loads(memory.totals[j], turn_of(rotor))
        if aircraft.switches[0].offsets == 1:
            locked = add_pitching(memory, rotor, loads, locked, acceleration)
        moment = scaled(locked.moment - cross(rotor.hub, locked.force), acceleration)
        loads.force = loads.force - scaled(locked.force, acceleration)
        loads.moment = loads.moment - moment
        loads.torque = loads.torque - rotor.sense * dot(shaft_down(rotor.axes), moment)


@kernel
def add_pitching(memory, rotor, loads, locked, acceleration):
    """Locked loads with those of the pitch that a turn of the shaft gives; its part of the torque is added."""
    inertia = rounded(0.0 * acceleration)
    force, moment = Vector(inertia, inertia, inertia), Vector(inertia, inertia, inertia)
    for quad in range(rotor.first_quad, rotor.first_quad + rotor.quads):
        own = memory.pitch_sums[quad]
        force, moment = force + own.locked_force, moment + own.locked_moment
        inertia = inertia + own.locked_inertia
    loads.torque = loads.torque + acceleration * (power(turn_of(rotor), ForceMoment(force, moment)) + inertia)
    return ForceMoment(locked.force + force, locked.moment + moment)


@kernel
def add_speeding_terms(aircraft, memory, turning, dx):
    """Add -Omega' T^-1 T' q to the accelerations of the multiblade coordinates, eq. (7.12)."""
    lead_lag = 1.0 * aircraft.switches[0].lead_lag
    for j in range(aircraft.rotors.shape[0]):
        rotor, acceleration = aircraft.rotors[j], turning[ACCELERATIONS, j]
        add_speeding(rotor, memory.state, dx, rotor.flap, rotor.flap_rate, acceleration)
        add_speeding(rotor, memory.state, dx, rotor.lag, rotor.lag_rate, rounded(lead_lag * acceleration))


@kernel
def add_speeding(rotor, x, dx, angles, rates, acceleration):
    """The same for flap or for lag, of which `angles` and `rates` are the first indices in the state."""
    for n in range(1, rotor.harmonics + 1):
        i = 2 * n - 1
        turning = rounded(n * acceleration)
        dx[rates + i] = dx[rates + i] - turning * x[angles + i + 1]
        dx[rates + i + 1] = dx[rates + i + 1] + turning * x[angles + i]
