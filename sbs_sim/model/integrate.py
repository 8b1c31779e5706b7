"""Fixed steps in time: Runge-Kutta methods, and the paper's partitioned scheme (theory.md section 7)."""

import math

import numpy as np

from sbs_sim.lanes import all_lanes, any_lane, as_lanes, as_records, floor, greatest, least, sqrt
from sbs_sim.model.exponential import begin_exponential_step, exponential_stage
from sbs_sim.model.ground import lowest
from sbs_sim.model.kernel import entry, kernel
from sbs_sim.model.multiblade import add_rotation_terms
from sbs_sim.model.state import BODY_SIZE
from sbs_sim.model.wind import wind_at

RK4, PARTITIONED, TSIT5, ETD = range(4)
MOST_STAGES = 6
TURN, INVERSE_TURN = 2.0 * math.pi, 1.0 / (2.0 * math.pi)
FLYING = -1  # no state is to blame for an end


def _tableau(*rows):
    """Butcher's tableau: coefficients of the stages, filled up with zeros, and the weights in the last row."""
    table = np.zeros((MOST_STAGES + 1, MOST_STAGES))
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
TABLEAUS = np.stack([CLASSICAL, CLASSICAL, TSITOURAS, CLASSICAL])
STAGES = np.array([4, 4, 6, 4])


@entry
def advance(derivative, model, x, swash, psi0, first_step, steps, h, wind, method, bounds, work, tick, done, culprit):
    """Advance flights by a tick of `steps` steps; each is left at the last step that was plausible.

    Parameters
    ----------
    derivative : Address
        Of the entry.
    model : Model
    x : ndarray, shape (size, n)
        Simulation states at step `first_step`; overwritten.
    swash : ndarray, shape (3 n_rotors, n)
        Swashplate angles, constant over the tick [rad].
    psi0 : ndarray, shape (n_rotors, n)
        Azimuths at step 0 [rad]; later ones follow from the number of the step.
    first_step, steps : int
    h : float
        Step [s].
    wind : ndarray, shape (WIND_SIZE, n)
        Air of this tick.
    method : int
        RK4, PARTITIONED, TSIT5 or ETD.
    bounds : ndarray, shape (size + 1, n)
        Largest magnitude of each state that is still plausible, and the down coordinate of the ground [m].
    work : Work
    tick : Tick
        Memory.
    done : ndarray of int64, shape (n,)
        Output: steps made; fewer than `steps` if the next one would leave the plausible.
    culprit : ndarray of int64, shape (n,)
        -1 for flights that go on; others stay as they are. Overwritten with the index of the state that would leave the
        plausible, `size` where the aircraft would touch the ground.
    """
    for lane in range(culprit.size):
        done[lane] = 0
    for i in range(steps):
        make_step(
            derivative, model, x, swash, psi0, first_step + i, h, wind, i / steps, 1.0 / steps, method, work, tick
        )
        if all_plausible(model, tick.stage, bounds, culprit):
            copy_rows(tick.stage, x)
            for lane in range(culprit.size):
                done[lane] = i + 1
        elif not take_lanes(model, x, tick, bounds, i, done, culprit):
            return


@kernel
def make_step(derivative, model, x, swash, psi0, number, h, wind, fraction, share, method, work, tick):
    """One step from x; the new state is left in `tick.stage`."""
    rotors = as_records(model.rotors)
    state, stage, air = as_lanes(x, rotors), as_lanes(tick.stage, rotors), as_lanes(wind, rotors)
    slopes, psi, blowing = as_lanes(tick.slopes, rotors), as_lanes(tick.psi, rotors), as_lanes(tick.wind, rotors)
    start, tableau, count, time = as_lanes(psi0, rotors), TABLEAUS[method], STAGES[method], number * h
    if method == ETD:
        begin_exponential_step(rotors, tick.exponential, state)
    for k in range(count):
        ahead = node(tableau[k], k)
        if k == 0 or method != ETD:
            combine(state, slopes, tableau[k], k, h, state.shape[0], stage)
        set_azimuths(rotors, start, (number + ahead) * h, psi)
        wind_at(air, time + ahead * h, fraction + ahead * share, blowing)
        derivative(model, tick.stage, swash, tick.psi, tick.wind, work, tick.slopes[k], False)
        if method == PARTITIONED and k > 0:
            freeze_forcing(as_records(model.switches)[0], rotors, state, stage, slopes[0], slopes[k])
        if method == ETD:
            combine(state, slopes, tableau[k + 1 if k + 1 < count else -1], k + 1, h, BODY_SIZE, stage)
            exponential_stage(rotors, as_records(model.blades), tick.exponential, slopes[k], k, stage)
    if method != ETD:
        combine(state, slopes, tableau[-1], count, h, state.shape[0], stage)
    w, a, b, c = stage[3], stage[4], stage[5], stage[6]
    shrink = 1.0 / sqrt(w * w + a * a + b * b + c * c)
    stage[3], stage[4], stage[5], stage[6] = w * shrink, a * shrink, b * shrink, c * shrink


@kernel
def node(factors, count):
    """Where a stage is in its step, as a share of it."""
    ahead = 0.0
    for m in range(count):
        ahead += factors[m]
    return ahead


@kernel
def combine(state, slopes, factors, count, h, size, stage):
    """Set so many states of the stage to the state plus h times a sum of the first slopes."""
    for i in range(size):
        stage[i] = state[i]
    for m in range(count):
        factor = factors[m]
        if factor != 0.0:
            step, slope = h * factor, slopes[m]
            for i in range(size):
                stage[i] = stage[i] + step * slope[i]


@kernel
def set_azimuths(rotors, start, time, psi):
    """Azimuths of all rotors a time after step 0, within 0 and 2 pi."""
    for j in range(rotors.shape[0]):
        angle = start[j] + rotors[j].speed * time
        # the whole turns are rounded too: what is left may be beyond an end by a last bit of the angle
        psi[j] = least(greatest(angle - TURN * floor(angle * INVERSE_TURN), 0.0), TURN)


@entry
def azimuths_at(rotors, start, times, out):
    """What `set_azimuths` gives at some times.

    Parameters
    ----------
    rotors : structured ndarray, shape (n_rotors,)
    start : ndarray, shape (n_rotors, n)
        Azimuths at step 0 [rad].
    times : ndarray, shape (m,)
        Since step 0 [s].
    out : ndarray, shape (m, n_rotors, n)
        Output [rad].
    """
    records = as_records(rotors)
    first, found = as_lanes(start, records), as_lanes(out, records)
    for i in range(times.size):
        set_azimuths(records, first, times[i], found[i])


@kernel
def copy_rows(source, target):
    """Copy numbers one by one: a slice would be allocated."""
    for i in range(source.shape[0]):
        for lane in range(source.shape[1]):
            target[i, lane] = source[i, lane]


@kernel
def freeze_forcing(switches, rotors, state, stage, first, slope):
    """Rotor accelerations of the paper's Figure 3: only K1 q' + K0 q follow the stage.

    The coupling and forcing terms C1, C0, E of eqs. [13] and [14] keep their values of the previous time step,
    that is, what is left of its accelerations without the turning of the coordinates.
    """
    for j in range(rotors.shape[0]):
        rotor = rotors[j]
        for i in range(rotor.blades):
            slope[rotor.flap_rate + i] = first[rotor.flap_rate + i]
            slope[rotor.lag_rate + i] = first[rotor.lag_rate + i]
        lags = 1.0 * switches.lead_lag
        add_rotation_terms(rotor, state, slope, rotor.flap, rotor.flap_rate, -1.0)
        add_rotation_terms(rotor, stage, slope, rotor.flap, rotor.flap_rate, 1.0)
        add_rotation_terms(rotor, state, slope, rotor.lag, rotor.lag_rate, -lags)
        add_rotation_terms(rotor, stage, slope, rotor.lag, rotor.lag_rate, lags)


@kernel
def all_plausible(model, x, bounds, culprit):
    """True if all flights go on and no state is beyond its bound, or not a number, and nobody touches the ground."""
    for lane in range(culprit.size):
        if culprit[lane] != FLYING:
            return False
    rotors = as_records(model.rotors)
    state, bound = as_lanes(x, rotors), as_lanes(bounds, rotors)
    fine = abs(state[0]) <= bound[0]
    for i in range(1, x.shape[0]):
        fine = fine & (abs(state[i]) <= bound[i])
    ground = bound[x.shape[0]]
    if any_lane(ground < math.inf):
        fine = fine & (lowest(rotors, state) < ground)
    return all_lanes(fine)


@kernel
def take_lanes(model, x, tick, bounds, step, done, culprit):
    """Take over the new states of the flights that go on, and say why others do not; False if none goes on."""
    size, flying = x.shape[0], False
    rotors = as_records(model.rotors)
    deepest = as_lanes(tick.deepest, rotors)
    deepest[0] = lowest(rotors, as_lanes(tick.stage, rotors))
    for lane in range(culprit.size):
        if culprit[lane] != FLYING:
            continue
        for i in range(size):
            if not abs(tick.stage[i, lane]) <= bounds[i, lane]:
                culprit[lane] = i
                break
        if culprit[lane] == FLYING and tick.deepest[0, lane] >= bounds[size, lane]:
            culprit[lane] = size
        if culprit[lane] == FLYING:
            flying = True
            done[lane] = step + 1
            for i in range(size):
                x[i, lane] = tick.stage[i, lane]
        else:
            for i in range(size):
                tick.last[i, lane] = tick.stage[i, lane]
    return flying
