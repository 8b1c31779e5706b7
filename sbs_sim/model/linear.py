"""Outputs of the model as functions of linear states and controls, and their differences (theory.md section 9)."""

from sbs_sim.lanes import Vector, as_lanes, as_records
from sbs_sim.model import state as S
from sbs_sim.model.frames import Quaternion
from sbs_sim.model.kernel import entry, kernel
from sbs_sim.model.mixing import mix
from sbs_sim.model.trigonometry import cosine_sine

SPECIFIC_FORCE_SIZE = 3


@entry
def jacobian(derivative, model, point, rigging, steps, owners, psi, work, tick, inputs, values, columns, out):
    """Central differences about one point at given azimuths, as many evaluations at once as there are lanes.

    Two lanes are the two sides of a column at an azimuth. What belongs to a rotor changes nothing about the blades of
    the others, whose terms are kept from one column to the next.

    Parameters
    ----------
    derivative, model, work, tick : see `sbs_sim.model.integrate.advance`; the lanes are states of one aircraft
    point : ndarray, shape (m,)
        Linear state and pilot controls.
    rigging : ndarray, shape (3 n_rows, n_controls + 1)
        Swashplate angles = rigging @ (controls, 1).
    steps : ndarray, shape (m,)
        Half the distance of each pair of evaluations; 0 leaves a column alone.
    owners : ndarray of int64, shape (m,)
        Number of the rotor that an input belongs to; n_rotors for those of the body and for controls.
    psi : ndarray, shape (n_azimuths, n_rotors)
        Azimuth of the first blade of each rotor [rad].
    inputs : ndarray, shape (m, n)
        Memory.
    values : ndarray, shape (2, k)
        Memory, for the outputs of a pair.
    columns : ndarray of int64, shape (n,)
        Memory.
    out : ndarray, shape (n_azimuths, m, k), k = n_linear + 3 + 8 n_rotors
        Output: the transposed Jacobian at each azimuth; columns without a step stay as they are.
    """
    half, rotors = inputs.shape[1] // 2, psi.shape[1]
    for first in range(0, psi.shape[0], half):
        azimuths = min(half, psi.shape[0] - first)
        begin = 0
        for owner in range(rotors + 1):
            blades = model.rotors[owner]["blades"] if owner < rotors else 0
            column, first_pass = next_column(steps, owners, owner, 0), True
            while column < point.size:
                count, column = take_columns(steps, owners, owner, column, half // azimuths, columns)
                set_pairs(point, steps, psi, first, azimuths, columns, count, inputs, tick.psi)
                if owner < rotors and not first_pass:
                    work.span[0], work.span[1] = begin, begin + blades
                evaluate_inputs(derivative, model, inputs, rigging, work, tick)
                first_pass = False
                for pair in range(count * azimuths):
                    k, changed = first + pair % azimuths, columns[pair // azimuths]
                    gather_outputs(tick, work, 2 * pair, values[0])
                    gather_outputs(tick, work, 2 * pair + 1, values[1])
                    for i in range(values.shape[1]):
                        out[k, changed, i] = (values[0, i] - values[1, i]) / (2.0 * steps[changed])
            work.span[0], work.span[1] = 0, model.blades.size
            begin += blades


@kernel
def next_column(steps, owners, owner, column):
    """The first input from `column` on that has an owner and a step; their number where there is none."""
    while column < steps.size and (steps[column] == 0.0 or owners[column] != owner):
        column += 1
    return column


@kernel
def take_columns(steps, owners, owner, column, most, columns):
    """Set `columns` to those of an owner from `column` on, at most so many; their number, and the next column."""
    count = 0
    while count < most and column < steps.size:
        columns[count] = column
        count += 1
        column = next_column(steps, owners, owner, column + 1)
    return count, column


@kernel
def set_pairs(point, steps, psi, first, azimuths, columns, count, inputs, lane_psi):
    """Inputs of pairs of lanes: one column after the other, each at all azimuths from `first` on; the last repeats.

    The azimuth of a lane does not depend on the columns.
    """
    for lane in range(inputs.shape[1]):
        pair = lane // 2
        column = columns[min(pair // azimuths, count - 1)]
        for i in range(point.size):
            inputs[i, lane] = point[i]
        inputs[column, lane] = point[column] + (1.0 - 2.0 * (lane % 2)) * steps[column]
        for j in range(psi.shape[1]):
            lane_psi[j, lane] = psi[first + pair % azimuths, j]


@kernel
def evaluate_inputs(derivative, model, inputs, rigging, work, tick):
    """Derivative and loads at linear states and controls, heading north at the origin in still air."""
    rotors = as_records(model.rotors)
    point, x, dx = as_lanes(inputs, rotors), as_lanes(tick.stage, rotors), as_lanes(tick.slopes, rotors)
    wind, swash = as_lanes(tick.wind, rotors), dx[1]
    unseen = len(S.UNSEEN_NAMES) * model.drives.shape[0] + S.CONTACT_STATES * model.contacts.shape[0]
    unseen += work.separation_states.shape[0]
    set_state(point, x, x.shape[0] - unseen)
    for i in range(3):
        wind[i] = 0.0
    mix(rigging, point, point.shape[0] - (rigging.shape[1] - 1), swash)
    angles = tick.slopes[1, : rigging.shape[0]]
    derivative(model, tick.stage, angles, tick.psi, tick.wind, work, tick.slopes[0], True)
    linear_rates(point, dx[0], dx[2])


@kernel
def set_state(point, x, seen):
    """Simulation state at the origin, heading north, of a linear state; states from `seen` on are zero."""
    cp, sp = cosine_sine(0.5 * point[S.LINEAR_THETA])
    cr, sr = cosine_sine(0.5 * point[S.LINEAR_PHI])
    S.set_vector(x, S.POSITION, Vector(0.0, 0.0, 0.0))
    S.set_attitude(x, Quaternion(cr * cp, sr * cp, cr * sp, -(sr * sp)))
    S.set_vector(x, S.VELOCITY, Vector(point[S.LINEAR_U], point[S.LINEAR_V], point[S.LINEAR_W]))
    S.set_vector(x, S.RATES, Vector(point[S.LINEAR_P], point[S.LINEAR_Q], point[S.LINEAR_R]))
    for i in range(S.BODY_SIZE, seen):
        x[i] = point[i - S.BODY_SIZE + S.LINEAR_BODY_SIZE]
    for i in range(seen, x.shape[0]):
        x[i] = 0.0


@kernel
def linear_rates(point, dx, out):
    """Rates of the linear state from those of the simulation state."""
    ct, st = cosine_sine(point[S.LINEAR_THETA])
    cp, sp = cosine_sine(point[S.LINEAR_PHI])
    q, r = point[S.LINEAR_Q], point[S.LINEAR_R]
    velocity_rate, angular_acceleration = S.vector_at(dx, S.VELOCITY), S.vector_at(dx, S.RATES)
    out[S.LINEAR_U], out[S.LINEAR_V], out[S.LINEAR_W] = velocity_rate.x, velocity_rate.y, velocity_rate.z
    out[S.LINEAR_P], out[S.LINEAR_Q] = angular_acceleration.x, angular_acceleration.y
    out[S.LINEAR_R] = angular_acceleration.z
    # Euler kinematics, e.g. Stevens and Lewis, Aircraft Control and Simulation, section 1.4
    out[S.LINEAR_THETA] = q * cp - r * sp
    out[S.LINEAR_PHI] = point[S.LINEAR_P] + st / ct * (q * sp + r * cp)
    for i in range(S.BODY_SIZE, dx.shape[0]):
        out[i - S.BODY_SIZE + S.LINEAR_BODY_SIZE] = dx[i]


@kernel
def gather_outputs(tick, work, lane, row):
    """Outputs of one lane: linear rates, specific force, loads."""
    size = row.size - SPECIFIC_FORCE_SIZE - work.load_rows.shape[0]
    for i in range(size):
        row[i] = tick.slopes[2, i, lane]
    for i in range(SPECIFIC_FORCE_SIZE):
        row[size + i] = work.acceleration_rows[i, lane]
    for i in range(work.load_rows.shape[0]):
        row[size + SPECIFIC_FORCE_SIZE + i] = work.load_rows[i, lane]
