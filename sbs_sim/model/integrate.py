"""Fixed steps in time: Runge-Kutta methods, and the paper's partitioned scheme (theory.md section 7)."""

import math

import numpy as np

from sbs_sim.lanes import all_lanes, any_lane, as_lanes, as_records, floor, maximum, minimum, sqrt
from sbs_sim.model.air import add_air
from sbs_sim.model.contact import give_way
from sbs_sim.model.exponential import begin_exponential_step, exponential_stage
from sbs_sim.model.frames import Quaternion
from sbs_sim.model.ground import lowest_coordinate
from sbs_sim.model.kernel import entry, kernel
from sbs_sim.model.multiblade import add_rotation_terms
from sbs_sim.model.ring import set_ring_noise
from sbs_sim.model.state import BODY_SIZE, CONTACT_STATES, attitude_at, set_attitude
from sbs_sim.model.wind import wind_at

RK4, PARTITIONED, TSIT5, ETD = range(4)
MAX_STAGES = 6
TURN, INVERSE_TURN = 2.0 * math.pi, 1.0 / (2.0 * math.pi)
FLYING = -1  # in place of a failed state


def _tableau(*rows):
    """Butcher's tableau: coefficients of the stages, padded with zeros, and the weights in the last row."""
    table = np.zeros((MAX_STAGES + 1, MAX_STAGES))
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
def advance(derivative, model, x, swash, psi0, first_step, steps, h, wind, method, bounds, work, tick, steps_done,
            failed_state):  # fmt: skip
    """Advance flights by a tick of `steps` steps; each stops at its last plausible state.

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
    wind : ndarray, shape (WIND_SIZE, n), or (WIND_SIZE + 2 n_rotors, n)
        Air of this tick; behind it the noise of the vortex rings at its beginning and at its end.
    method : int
        RK4, PARTITIONED, TSIT5 or ETD.
    bounds : ndarray, shape (size + 1, n)
        Largest magnitude of each state that is still plausible, and the distance of the ground from the
        origin, along `ground.down` [m].
    work : Work
    tick : Tick
        Memory.
    steps_done : ndarray of int64, shape (n,)
        Output: steps made; fewer than `steps` if the next state is not plausible.
    failed_state : ndarray of int64, shape (n,)
        `FLYING` for flights to advance; others stay as they are. Output: index of the state that is beyond its bound
        or not a number, `size` where the aircraft touches the ground.
    """
    for lane in range(failed_state.size):
        steps_done[lane] = 0
    for i in range(steps):
        make_step(
            derivative, model, x, swash, psi0, first_step + i, h, wind, i / steps, 1.0 / steps, method, work, tick,
            i > 0
        )  # fmt: skip
        if all_plausible(model, tick.stage, bounds, failed_state):
            copy_rows(tick.stage, x)
            for lane in range(failed_state.size):
                steps_done[lane] = i + 1
        elif not accept_plausible(model, x, tick, bounds, i, steps_done, failed_state):
            return


@kernel
def make_step(derivative, model, x, swash, psi0, number, h, wind, fraction, share, method, work, tick, goes_on):
    """One step from x; the new state is left in `tick.stage`.

    Air that is not the same everywhere is sampled once for all stages at one time, and, where the step `goes_on` from
    the one before it, for the last stage of that and the first one: they are apart by the third power of the step.
    """
    rotors = as_records(model.rotors)
    state, stage, air = as_lanes(x, rotors), as_lanes(tick.stage, rotors), as_lanes(wind, rotors)
    slopes, psi, blowing = as_lanes(tick.slopes, rotors), as_lanes(tick.psi, rotors), as_lanes(tick.wind, rotors)
    start, tableau, count, time = as_lanes(psi0, rotors), TABLEAUS[method], STAGES[method], number * h
    contacts, size = model.contacts.shape[0], state.shape[0]
    # the deflections of what touches the ground, and separation on sections
    behind = size - CONTACT_STATES * contacts - work.separation_states.shape[0]
    if method == ETD:
        begin_exponential_step(rotors, tick.exponential, state)
    local, sampled = tick.space.parameters.shape[0] > 0, 0.0 if goes_on else -1.0
    for k in range(count):
        ahead = node(tableau[k], k)
        if k == 0 or method != ETD:
            combine(state, slopes, tableau[k], k, h, 0, size, stage)
        set_azimuths(rotors, start, (number + ahead) * h, psi)
        if not local or ahead != sampled:
            wind_at(air, time + ahead * h, fraction + ahead * share, blowing)
            if local:
                add_air(
                    *(model, tick.stage, tick.psi, wind, time + ahead * h, fraction + ahead * share),
                    *(tick.space, tick.wind),
                )
            sampled = ahead
        if work.ring.shape[1] > 0:
            set_ring_noise(model, wind, fraction + ahead * share, work)
        derivative(model, tick.stage, swash, tick.psi, tick.wind, work, tick.slopes[k], False)
        if method == PARTITIONED and k > 0:
            freeze_forcing(as_records(model.switches)[0], rotors, state, stage, slopes[0], slopes[k])
        if method == ETD:
            factors = tableau[k + 1 if k + 1 < count else -1]
            combine(state, slopes, factors, k + 1, h, 0, BODY_SIZE, stage)
            combine(state, slopes, factors, k + 1, h, behind, size, stage)
            exponential_stage(rotors, as_records(model.blades), tick.exponential, slopes[k], k, stage)
    if method != ETD:
        combine(state, slopes, tableau[-1], count, h, 0, size, stage)
    normalize_attitude(stage)
    if contacts > 0:
        give_way(as_records(model.ground)[0], as_records(model.contacts), stage)


@kernel
def normalize_attitude(x):
    """Give the quaternion of a state unit length."""
    q = attitude_at(x)
    scale = 1.0 / sqrt(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z)
    set_attitude(x, Quaternion(q.w * scale, q.x * scale, q.y * scale, q.z * scale))


@kernel
def node(factors, count):
    """Time of a stage within its step, as a fraction of the step."""
    ahead = 0.0
    for m in range(count):
        ahead += factors[m]
    return ahead


@kernel
def combine(state, slopes, factors, count, h, first, end, stage):
    """Set the states of a stage from `first` to `end` to the state plus h times the sum of factors times slopes."""
    for i in range(first, end):
        stage[i] = state[i]
    for m in range(count):
        factor = factors[m]
        if factor != 0.0:
            step, slope = h * factor, slopes[m]
            for i in range(first, end):
                stage[i] = stage[i] + step * slope[i]


@kernel
def set_azimuths(rotors, start, time, psi):
    """Set the azimuths of all rotors a time after step 0 [s], from 0 to 2 pi."""
    for j in range(rotors.shape[0]):
        angle = start[j] + rotors[j].rotor_speed * time
        # the full turns are rounded too: the remainder may exceed an end by the last bit of the angle
        psi[j] = minimum(maximum(angle - TURN * floor(angle * INVERSE_TURN), 0.0), TURN)


@entry
def azimuths_at(rotors, start, times, out):
    """Azimuths of all rotors at some times.

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
    """Copy an array element by element: a slice would allocate."""
    for i in range(source.shape[0]):
        for lane in range(source.shape[1]):
            target[i, lane] = source[i, lane]


@kernel
def freeze_forcing(switches, rotors, state, stage, first_slope, slope):
    """Rotor accelerations of the paper's Figure 3: only K1 q' + K0 q follow the stage.

    The coupling and forcing terms C1, C0, E of eqs. [13] and [14] keep their values of the previous time step: its
    accelerations less the terms of the rotating coordinates.
    """
    for j in range(rotors.shape[0]):
        rotor = rotors[j]
        for i in range(rotor.blades):
            slope[rotor.flap_rate + i] = first_slope[rotor.flap_rate + i]
            slope[rotor.lag_rate + i] = first_slope[rotor.lag_rate + i]
        lead_lag = 1.0 * switches.lead_lag
        add_rotation_terms(rotor, state, slope, rotor.flap, rotor.flap_rate, -1.0)
        add_rotation_terms(rotor, stage, slope, rotor.flap, rotor.flap_rate, 1.0)
        add_rotation_terms(rotor, state, slope, rotor.lag, rotor.lag_rate, -lead_lag)
        add_rotation_terms(rotor, stage, slope, rotor.lag, rotor.lag_rate, lead_lag)


@kernel
def all_plausible(model, x, bounds, failed_state):
    """True if all flights go on, no state is beyond its bound or not a number, and no aircraft touches the ground."""
    for lane in range(failed_state.size):
        if failed_state[lane] != FLYING:
            return False
    rotors = as_records(model.rotors)
    state, bound = as_lanes(x, rotors), as_lanes(bounds, rotors)
    plausible = abs(state[0]) <= bound[0]
    for i in range(1, x.shape[0]):
        plausible = plausible & (abs(state[i]) <= bound[i])
    ground = bound[x.shape[0]]
    if any_lane(ground < math.inf):
        plausible = plausible & (lowest_coordinate(as_records(model.ground)[0], rotors, state) < ground)
    return all_lanes(plausible)


@kernel
def accept_plausible(model, x, tick, bounds, step, steps_done, failed_state):
    """Accept the new states that are plausible, and name the failed state of the others; False if no flight goes on."""
    size, any_flying = x.shape[0], False
    rotors = as_records(model.rotors)
    ground = as_records(model.ground)[0]
    as_lanes(tick.lowest_point, rotors)[0] = lowest_coordinate(ground, rotors, as_lanes(tick.stage, rotors))
    for lane in range(failed_state.size):
        if failed_state[lane] != FLYING:
            continue
        failed_state[lane] = first_failed_state(tick, bounds, lane)
        if failed_state[lane] == FLYING:
            any_flying = True
            steps_done[lane] = step + 1
            for i in range(size):
                x[i, lane] = tick.stage[i, lane]
        else:
            for i in range(size):
                tick.last[i, lane] = tick.stage[i, lane]
    return any_flying


@kernel
def first_failed_state(tick, bounds, lane):
    """Index of the first state of a flight that is not plausible, `size` for the ground, else `FLYING`."""
    size = tick.stage.shape[0]
    for i in range(size):
        if not abs(tick.stage[i, lane]) <= bounds[i, lane]:
            return i
    return size if tick.lowest_point[0, lane] >= bounds[size, lane] else FLYING
