"""Jacobians of the model in the coordinates of the linear state (theory.md section 9).

The inputs are the linear state and the pilot controls; the outputs are the rates of the linear state, the specific
force of the c.g. (what accelerometers there would show) and the loads of the rotors.
"""

import math

from sbs_sim.model import params as P
from sbs_sim.model import state as S
from sbs_sim.model.dynamics import evaluate_rotors
from sbs_sim.model.kernel import entry, kernel

SPECIFIC_FORCE_SIZE = 3


@entry
def jacobian(p, point, mixing, steps, psi, still_air, work, swash, out):
    """Central differences about one point at given azimuths.

    Parameters
    ----------
    p : Params
    point : ndarray, shape (n + 4,)
        Linear state and pilot controls; perturbed on the way and left as it was.
    mixing : ndarray, shape (n_rotors, 3, 4)
        Swashplate angles of each rotor = mixing @ controls.
    steps : ndarray, shape (n + 4,)
        Half the distance of each pair of evaluations; 0 leaves a column alone.
    psi : ndarray, shape (n_azimuths, n_rotors)
        Azimuth of the first blade of each rotor [rad].
    still_air : ndarray, shape (3,)
        Wind, NED [m/s].
    work : Work
    swash : ndarray, shape (n_rotors, 3)
        Memory.
    out : ndarray, shape (n_azimuths, n + 4, n + 3 + 8 n_rotors)
        Output: the transposed Jacobian at each azimuth; columns without a step stay as they are.
    """
    for k in range(psi.shape[0]):
        for j in range(psi.shape[1]):
            work.psi[j] = psi[k, j]
        # the states of a rotor one after the other: what the blades of the others do is then worked out once
        for rotor in range(-1, psi.shape[1]):
            if rotor >= 0:
                _evaluate(p, point, mixing, still_air, work, swash, -1)
            for i in range(point.size):
                if steps[i] != 0.0 and _rotor_of(p, i) == rotor:
                    _difference(p, point, i, mixing, steps[i], still_air, work, swash, rotor, out[k, i])


@kernel
def _difference(p, point, i, mixing, step, still_air, work, swash, rotor, row):
    """Central difference of the outputs by element i of the point, which belongs to a rotor, or to none (-1)."""
    middle = point[i]
    for m in range(row.size):
        row[m] = 0.0
    for side in range(2):
        sign = 1.0 - 2.0 * side
        point[i] = middle + sign * step
        _evaluate(p, point, mixing, still_air, work, swash, rotor)
        _add_outputs(p, point, work, sign / (2.0 * step), row)
    point[i] = middle


@kernel
def _evaluate(p, point, mixing, still_air, work, swash, rotor):
    """Derivative at a point of which only states of one rotor have changed, or any (-1)."""
    _set_up(p, point, mixing, work.stages[1], swash)
    first = max(rotor, 0)
    last = p.rotor.shape[0] if rotor < 0 else rotor + 1
    evaluate_rotors(p, work.stages[1], swash, work.psi, still_air, work, work.stages[0], first, last, True)


@kernel
def _rotor_of(p, i):
    """Rotor that an element of the point is a state of, -1 for those of the body and controls."""
    blades, rotors = p.first_blade[-1], p.rotor.shape[0]
    place = i - S.LINEAR_BODY_SIZE
    if place < 0 or place >= 4 * blades + 3 * rotors:
        return -1
    if place >= 4 * blades:
        return (place - 4 * blades) // 3
    for j in range(rotors):
        if place % blades < p.first_blade[j + 1]:
            return j
    return -1


@kernel
def _set_up(p, point, mixing, x, swash):
    """Simulation state at the origin, heading north, and swashplate angles of a point."""
    half_pitch, half_roll = 0.5 * point[S.LINEAR_THETA], 0.5 * point[S.LINEAR_PHI]
    cp, sp = math.cos(half_pitch), math.sin(half_pitch)
    cr, sr = math.cos(half_roll), math.sin(half_roll)
    x[0] = x[1] = x[2] = 0.0
    x[3], x[4], x[5], x[6] = cr * cp, sr * cp, cr * sp, -sr * sp
    x[7], x[8], x[9] = point[S.LINEAR_U], point[S.LINEAR_V], point[S.LINEAR_W]
    x[10], x[11], x[12] = point[S.LINEAR_P], point[S.LINEAR_Q], point[S.LINEAR_R]
    for i in range(S.BODY_SIZE, x.size):
        x[i] = point[i - S.BODY_SIZE + S.LINEAR_BODY_SIZE]
    controls = point.size - mixing.shape[2]
    for j in range(swash.shape[0]):
        for m in range(swash.shape[1]):
            swash[j, m] = 0.0
            for n in range(mixing.shape[2]):
                swash[j, m] += mixing[j, m, n] * point[controls + n]


@kernel
def _add_outputs(p, point, work, factor, row):
    """Add `factor` times the outputs of the last derivative."""
    dx = work.stages[0]
    theta, phi = point[S.LINEAR_THETA], point[S.LINEAR_PHI]
    q, r = point[S.LINEAR_Q], point[S.LINEAR_R]
    row[S.LINEAR_U] += factor * dx[7]
    row[S.LINEAR_V] += factor * dx[8]
    row[S.LINEAR_W] += factor * dx[9]
    row[S.LINEAR_P] += factor * dx[10]
    row[S.LINEAR_Q] += factor * dx[11]
    row[S.LINEAR_R] += factor * dx[12]
    # Euler kinematics, e.g. Stevens and Lewis, Aircraft Control and Simulation, section 1.4
    yaw_part = q * math.sin(phi) + r * math.cos(phi)
    row[S.LINEAR_THETA] += factor * (q * math.cos(phi) - r * math.sin(phi))
    row[S.LINEAR_PHI] += factor * (point[S.LINEAR_P] + math.tan(theta) * yaw_part)
    n = dx.size - S.BODY_SIZE + S.LINEAR_BODY_SIZE
    for i in range(S.LINEAR_BODY_SIZE, n):
        row[i] += factor * dx[i - S.LINEAR_BODY_SIZE + S.BODY_SIZE]
    for i in range(SPECIFIC_FORCE_SIZE):
        row[n + i] += factor * work.vector[i]
    n += SPECIFIC_FORCE_SIZE
    for j in range(work.loads.shape[0]):
        for i in range(P.LOAD_SIZE):
            row[n + j * P.LOAD_SIZE + i] += factor * work.loads[j, i]
