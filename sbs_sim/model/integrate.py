"""Fixed steps in time: explicit Runge-Kutta methods, and the paper's partitioned scheme (theory.md section 7)."""

import math

import numpy as np

from sbs_sim.model import params as P
from sbs_sim.model import state as S
from sbs_sim.model.dynamics import evaluate_rotors
from sbs_sim.model.ground import lowest
from sbs_sim.model.kernel import entry, kernel
from sbs_sim.model.multiblade import add_rotation_terms
from sbs_sim.model.wind import wind_at

RK4, PARTITIONED, TSIT5 = range(3)
STAGE, FIRST_SLOPE = 0, 1  # rows of Work.stages


def _tableau(*rows):
    """Butcher's tableau: coefficients of the stages, filled up with zeros, and the weights in the last row."""
    table = np.zeros((P.MOST_STAGES + 1, P.MOST_STAGES))
    for i, row in enumerate(rows[:-1]):
        table[i, : len(row)] = row
    table[-1, : len(rows[-1])] = rows[-1]
    return table


CLASSICAL = _tableau((), (1 / 2,), (0, 1 / 2), (0, 0, 1), (1 / 6, 1 / 3, 1 / 3, 1 / 6))
# Ch. Tsitouras: Runge-Kutta pairs of order 5(4) satisfying only the first column simplifying assumption, Computers and
# Mathematics with Applications 62, 2011: the method of order 5.
TSITOURAS = _tableau(
    (),
    (0.161,),
    (-0.008480655492356989, 0.335480655492357),
    (2.8971530571054935, -6.359448489975075, 4.3622954328695815),
    (5.325864828439257, -11.748883564062828, 7.4955393428898365, -0.09249506636175525),
    (5.86145544294642, -12.92096931784711, 8.159367898576159, -0.071584973281401, -0.028269050394068383),
    (0.09646076681806523, 0.01, 0.4798896504144996, 1.379008574103742, -3.290069515436081, 2.324710524099774),
)
TABLEAUS = np.stack([CLASSICAL, CLASSICAL, TSITOURAS])
STAGES = np.array([4, 4, 6])


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
        RK4, PARTITIONED or TSIT5.
    bounds : ndarray, shape (size + 1,)
        Largest magnitude of each state that is still plausible, and the down coordinate of the ground [m].
    work : Work

    Returns
    -------
    done : int
        Steps made; fewer than `steps` if the next one would leave the plausible.
    culprit : int
        Index of the state that would, -1 if none, `size` if the aircraft would touch the ground.
    """
    for i in range(steps):
        fraction = i / steps
        _step(p, x, swash, psi0, first_step + i, h, wind, fraction, 1.0 / steps, method, work)
        new = work.stages[STAGE]
        culprit = _first_implausible(p, new, bounds)
        if culprit >= 0:
            return i, culprit
        copy_numbers(new, x)
    return steps, -1


@kernel
def _step(p, x, swash, psi0, number, h, wind, fraction, share, method, work):
    """One step from x; the new state is left in the stage row."""
    stage, tableau, count = work.stages[STAGE], TABLEAUS[method], STAGES[method]
    time, rotors = number * h, p.rotor.shape[0]
    for k in range(count):
        ahead = _combine(x, work.stages, tableau[k], k, h)
        _azimuths(p, psi0, number, ahead, h, work.psi)
        wind_at(wind, time + ahead * h, fraction + ahead * share, work.wind)
        slope = work.stages[FIRST_SLOPE + k]
        evaluate_rotors(p, stage, swash, work.psi, work.wind, work, slope, 0, rotors, False)
        if method == PARTITIONED and k > 0:
            _freeze_forcing(p, x, stage, work.stages[FIRST_SLOPE], slope)
    _combine(x, work.stages, tableau[-1], count, h)
    norm = 1.0 / math.sqrt(stage[3] ** 2 + stage[4] ** 2 + stage[5] ** 2 + stage[6] ** 2)
    for i in range(S.ATTITUDE, S.ATTITUDE + 4):
        stage[i] *= norm


@kernel
def _combine(x, stages, factors, count, h):
    """Set the stage row to x plus h times a sum of the first slopes; the sum of its factors is returned."""
    stage = stages[STAGE]
    copy_numbers(x, stage)
    ahead = 0.0
    for m in range(count):
        factor = factors[m]
        if factor != 0.0:
            slope = stages[FIRST_SLOPE + m]
            for i in range(x.size):
                stage[i] += h * factor * slope[i]
            ahead += factor
    return ahead


@kernel
def copy_numbers(source, target):
    """Copy numbers one by one: a slice would be allocated."""
    for i in range(source.size):
        target[i] = source[i]


@kernel
def _azimuths(p, psi0, number, ahead, h, psi):
    """Azimuths of all rotors a part of a step after step `number`, within 0 and 2 pi."""
    for j in range(psi0.size):
        angle = psi0[j] + p.rotor[j, P.SPEED] * h * (number + ahead)
        psi[j] = angle - 2.0 * math.pi * np.floor(angle * (0.5 / math.pi))


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
def _first_implausible(p, x, bounds):
    """Index of the first state that is not finite or beyond its bound, `size` for the ground, -1 if there is none."""
    for i in range(x.size):
        if not abs(x[i]) <= bounds[i]:
            return i
    ground = bounds[x.size]
    return x.size if ground < math.inf and lowest(p, x) >= ground else -1
