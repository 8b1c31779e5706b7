"""Averaged residuals of trimmed flight at many sets of unknowns at once (theory.md section 8)."""

from sbs_sim.lanes import Vector, as_lanes, as_records, rounded, transposed
from sbs_sim.model import state as S
from sbs_sim.model.frames import Quaternion, rotation
from sbs_sim.model.kernel import entry, kernel
from sbs_sim.model.linear import next_column, set_pairs, take_columns
from sbs_sim.model.mixing import mix
from sbs_sim.model.trigonometry import cosine_sine

FORWARD_SPEED, RIGHT_SPEED, DOWN_SPEED, TURN_RATE = range(4)  # of the motion of a trim
PITCH, ROLL, CONTROLS = range(3)  # first indices of the parts of the unknowns


@entry
def trim_residuals(derivative, model, unknowns, motion, rotor_indices, equations, scales, rigging, psi, work, tick,
                   inputs, residuals, loads):  # fmt: skip
    """Scaled residuals of the equations of trim, averaged over the azimuth.

    Parameters
    ----------
    derivative, model, work, tick : see `sbs_sim.model.integrate.advance`
    unknowns : ndarray, shape (m, n_unknowns)
        Sets of unknowns: pitch, roll [rad], pilot controls [rad], rotor states.
    motion : ndarray, shape (4,)
        Velocity forward, right and down in axes of the heading [m/s], rate of the heading [rad/s].
    rotor_indices : ndarray of int64
        Indices in the simulation state of the rotor states among the unknowns.
    equations : ndarray of int64, shape (n_equations,)
        Indices in the rate of the simulation state.
    scales : ndarray, shape (n_equations,)
        What each is divided by.
    rigging : ndarray, shape (3 n_rows, n_controls + 1)
    psi : ndarray, shape (count, n_rotors)
        Azimuths [rad].
    inputs : ndarray, shape (n_unknowns, n)
        Memory.
    residuals : ndarray, shape (m, n_equations)
        Output.
    loads : ndarray, shape (m, 8 n_rotors)
        Output: mean loads.
    """
    lanes, azimuths = inputs.shape[1], psi.shape[0]
    count = unknowns.shape[0] * azimuths
    for i in range(unknowns.shape[0]):
        for e in range(equations.size):
            residuals[i, e] = 0.0
        for k in range(loads.shape[1]):
            loads[i, k] = 0.0
    share = 1.0 / azimuths
    for first in range(0, count, lanes):
        for lane in range(lanes):
            number = min(first + lane, count - 1)
            for i in range(inputs.shape[0]):
                inputs[i, lane] = unknowns[number // azimuths, i]
            for j in range(psi.shape[1]):
                tick.psi[j, lane] = psi[number % azimuths, j]
        set_flight(model, inputs, motion, rotor_indices, rigging, tick)
        derivative(
            model, tick.stage, tick.slopes[1, : rigging.shape[0]], tick.psi, tick.wind, work, tick.slopes[0], True
        )
        for lane in range(min(lanes, count - first)):
            i = (first + lane) // azimuths
            for e in range(equations.size):
                residuals[i, e] += share * (tick.slopes[0, equations[e], lane] / scales[e])
            for k in range(loads.shape[1]):
                loads[i, k] += share * work.load_rows[k, lane]


@entry
def trim_sides(derivative, model, unknowns, steps, owners, motion, rotor_indices, equations, scales, rigging, psi, work,
               tick, inputs, columns, residuals):  # fmt: skip
    """Scaled residuals on both sides of every unknown, averaged over the azimuth, as `trim_residuals` has them.

    Parameters
    ----------
    derivative, model, motion, rotor_indices, equations, scales, rigging, psi, work, tick, inputs : see `trim_residuals`
    unknowns, steps : ndarray, shape (n_unknowns,)
        One set of unknowns, and how far the sides are from it.
    owners, columns : see `sbs_sim.model.linear.jacobian`
    residuals : ndarray, shape (2, n_unknowns, n_equations)
        Output: with the step added, and with it subtracted.
    """
    half, rotors, share = inputs.shape[1] // 2, psi.shape[1], 1.0 / psi.shape[0]
    for side in range(2):
        for i in range(unknowns.size):
            for e in range(equations.size):
                residuals[side, i, e] = 0.0
    for first in range(0, psi.shape[0], half):
        azimuths = min(half, psi.shape[0] - first)
        begin = 0
        for owner in range(rotors + 1):
            blades = model.rotors[owner]["blades"] if owner < rotors else 0
            column, first_pass = next_column(steps, owners, owner, 0), True
            while column < unknowns.size:
                count, column = take_columns(steps, owners, owner, column, half // azimuths, columns)
                set_pairs(unknowns, steps, psi, first, azimuths, columns, count, inputs, tick.psi)
                set_flight(model, inputs, motion, rotor_indices, rigging, tick)
                if owner < rotors and not first_pass:
                    work.span[0], work.span[1] = begin, begin + blades
                derivative(
                    model,
                    tick.stage,
                    tick.slopes[1, : rigging.shape[0]],
                    tick.psi,
                    tick.wind,
                    work,
                    tick.slopes[0],
                    False,
                )
                first_pass = False
                for lane in range(2 * count * azimuths):
                    changed = columns[lane // 2 // azimuths]
                    for e in range(equations.size):
                        rate = tick.slopes[0, equations[e], lane]
                        residuals[lane % 2, changed, e] += share * (rate / scales[e])
            work.span[0], work.span[1] = 0, model.blades.size
            begin += blades


@kernel
def set_flight(model, inputs, motion, rotor_indices, rigging, tick):
    """Simulation states, swashplate angles and still air of sets of unknowns."""
    rotors = as_records(model.rotors)
    given, x, swash = as_lanes(inputs, rotors), as_lanes(tick.stage, rotors), as_lanes(tick.slopes, rotors)[1]
    wind = as_lanes(tick.wind, rotors)
    set_steady_flight(given[PITCH], given[ROLL], motion, x)
    for i in range(rotor_indices.size):
        x[rotor_indices[i]] = given[inputs.shape[0] - rotor_indices.size + i]
    set_drives(as_records(model.drives), x)
    mix(rigging, given, CONTROLS, swash)
    for i in range(3):
        wind[i] = 0.0


@kernel
def set_drives(drives, x):
    """Speeds and torques of drives from the unknowns of a trim: 1 + u times the speed, u times the largest torque."""
    for i in range(drives.shape[0]):
        drive = drives[i]
        x[drive.speed_index] = rounded(drive.speed * (1.0 + x[drive.speed_index]))
        if drive.torque_index >= 0:
            x[drive.torque_index] = rounded(drive.max_torque * x[drive.torque_index])


@kernel
def set_steady_flight(pitch, roll, motion, x):
    """State of a body at the origin that heads north; velocities and rates follow its attitude."""
    cp, sp = cosine_sine(0.5 * pitch)
    cr, sr = cosine_sine(0.5 * roll)
    attitude = Quaternion(rounded(cr * cp), rounded(sr * cp), rounded(cr * sp), -rounded(sr * sp))
    to_body = transposed(rotation(attitude))
    velocity = to_body @ Vector(motion[FORWARD_SPEED], motion[RIGHT_SPEED], motion[DOWN_SPEED])
    omega = to_body @ Vector(0.0, 0.0, motion[TURN_RATE])
    for i in range(x.shape[0]):
        x[i] = 0.0
    S.set_attitude(x, attitude)
    S.set_vector(x, S.VELOCITY, velocity)
    S.set_vector(x, S.RATES, omega)
