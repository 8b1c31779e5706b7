"""Fixed steps in time: classical Runge-Kutta, and the paper's partitioned scheme (theory.md section 7)."""

import math

from sbs_sim.model import params as P
from sbs_sim.model import state as S
from sbs_sim.model.dynamics import evaluate
from sbs_sim.model.kernel import entry, kernel
from sbs_sim.model.multiblade import add_rotation_terms
from sbs_sim.model.wind import wind_at

RK4, PARTITIONED = 0, 1
STAGE, SLOPE, SUM, FIRST = range(4)  # rows of Work.stages


@entry
def advance(p, x, swash, psi0, first_step, steps, h, wind, method, bounds, work):
    """Advance the state by a tick of `steps` steps; it is left at the last step that was plausible.

    Parameters
    ----------
    p : Params
    x : ndarray, shape (size,)
        Simulation state at step `first_step`; overwritten.
    swash : ndarray, shape (n_rotors, 3)
        Swashplate angles, constant over the tick [rad].
    psi0 : ndarray, shape (n_rotors,)
        Azimuths at step 0 [rad]; later ones follow from the number of the step.
    first_step, steps : int
    h : float
        Step [s].
    wind : ndarray, shape (WIND_SIZE,)
        Air of this tick.
    method : int
        RK4 or PARTITIONED.
    bounds : ndarray, shape (size,)
        Largest magnitude of each state that is still plausible.
    work : Work

    Returns
    -------
    done : int
        Steps made; fewer than `steps` if the next one would leave the plausible.
    culprit : int
        Index of the state that would, -1 if none.
    """
    for i in range(steps):
        fraction = i / steps
        _step(p, x, swash, psi0, first_step + i, h, wind, fraction, 1.0 / steps, method, work)
        new = work.stages[STAGE]
        culprit = _first_implausible(new, bounds)
        if culprit >= 0:
            return i, culprit
        _copy(new, x)
    return steps, -1


@kernel
def _step(p, x, swash, psi0, number, h, wind, fraction, share, method, work):
    """One step from x; the new state is left in the stage row."""
    stage, slope, total, first = work.stages[STAGE], work.stages[SLOPE], work.stages[SUM], work.stages[FIRST]
    time = number * h
    _copy(x, stage)
    _copy(x, total)
    for k in range(4):
        ahead = 0.5 * ((k + 1) // 2)  # 0, 1/2, 1/2, 1
        _azimuths(p, psi0, number, ahead, h, work.psi)
        wind_at(wind, time + ahead * h, fraction + ahead * share, work.wind)
        evaluate(p, stage, swash, work.psi, work.wind, work, slope)
        if method == PARTITIONED:
            if k == 0:
                _copy(slope, first)
            else:
                _freeze_forcing(p, x, stage, first, slope)
        weight = h / 3.0 if k == 1 or k == 2 else h / 6.0
        forward = h if k == 2 else 0.5 * h
        for i in range(x.size):
            total[i] += weight * slope[i]
            stage[i] = x[i] + forward * slope[i]
    _copy(total, stage)
    norm = 1.0 / math.sqrt(stage[3] ** 2 + stage[4] ** 2 + stage[5] ** 2 + stage[6] ** 2)
    for i in range(S.ATTITUDE, S.ATTITUDE + 4):
        stage[i] *= norm


@kernel
def _copy(source, target):
    """Copy a state, element by element: a slice would be allocated."""
    for i in range(source.size):
        target[i] = source[i]


@kernel
def _azimuths(p, psi0, number, ahead, h, psi):
    """Azimuths of all rotors a part of a step after step `number`, within 0 and 2 pi."""
    for j in range(psi0.size):
        psi[j] = (psi0[j] + p.rotor[j, P.SPEED] * h * (number + ahead)) % (2.0 * math.pi)


@kernel
def _freeze_forcing(p, x, stage, first, slope):
    """Rotor accelerations of the paper's Figure 3: only K1 q' + K0 q follow the stage.

    The coupling and forcing terms C1, C0, E of eqs. [13] and [14] keep their values of the previous time step,
    that is, what is left of its accelerations without the turning of the coordinates.
    """
    n = p.first_blade[-1]
    for block in (0, 2):  # flap, lag
        angles, rates = S.BODY_SIZE + block * n, S.BODY_SIZE + (block + 1) * n
        for i in range(n):
            slope[rates + i] = first[rates + i]
        if block == 2 and p.switches[P.LEAD_LAG] == 0:
            continue
        for j in range(p.rotor.shape[0]):
            at = p.first_blade[j]
            n_blades = p.first_blade[j + 1] - at
            omega = p.rotor[j, P.SPEED]
            add_rotation_terms(x, slope, angles + at, rates + at, n_blades, omega, -1.0)
            add_rotation_terms(stage, slope, angles + at, rates + at, n_blades, omega, 1.0)


@kernel
def _first_implausible(x, bounds):
    """Index of the first state that is not finite or beyond its bound, -1 if there is none."""
    for i in range(x.size):
        if not abs(x[i]) <= bounds[i]:
            return i
    return -1
