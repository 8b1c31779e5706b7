"""Many ticks with a control law in the loop, in one call of compiled code.

The law is machine code of its own, which is called by its address. So whatever law flies, this code is compiled once
for each arrangement of lanes, and a new law takes only its own time to compile.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sbs_sim.flight import measured as M
from sbs_sim.lanes import as_lanes, as_records, maximum, minimum, sqrt, transposed
from sbs_sim.model.air import add_air
from sbs_sim.model.frames import direction, rotation
from sbs_sim.model.integrate import FLYING
from sbs_sim.model.kernel import entry, kernel
from sbs_sim.model.mixing import mix
from sbs_sim.model.state import POSITION, RATES, VELOCITY, attitude_at, vector_at
from sbs_sim.model.trigonometry import angle_of
from sbs_sim.model.wind import wind_at

Array = NDArray[np.float64]

WRONG_CONTROL = -3  # in place of the index of the state that ended a flight


class Loop(NamedTuple):
    """Control laws of flights side by side: numbers, and memory that lasts from tick to tick.

    What a law sees has the flights first, so that its part is one piece of memory; the rest has them last.

    Attributes
    ----------
    period, delay : int
        Ticks from one call of the law to the next, and from a call to the first tick under its controls.
    bias, measured : ndarray, shape (n, COUNT)
    memory, parameters, controls : ndarray, shapes (n, n_memory), (n, n_parameters), (n, n_controls)
        What a law keeps, its numbers, and its latest controls.
    waiting : ndarray, shape (delay + 1, n_controls, n)
        Controls on their way, in a ring.
    lag : ndarray, shape (1, n)
        Share of its way to what is commanded that a control makes in a tick; 1 for controls without lag.
    lagged : ndarray, shape (n_controls, n)
        Controls behind their lags.
    limits : ndarray, shape (n_controls, n)
        Magnitudes beyond which a control cannot be meant.
    low, high : ndarray, shape (n_controls, n)
        Ranges of the controls.
    clipped : ndarray, shape (n_controls, n)
        Memory: controls within their ranges.
    rigging : ndarray, shape (n_rows, n_controls + 1, n)
        See `sbs_sim.model.mixing.mix`.
    row_low, row_high, reach : ndarray, shape (n_rows, n)
        Ranges of what the controls move, and how far that moves in a tick.
    first_reach : ndarray, shape (1, n)
        How far it may move at the first tick: not at all, or anywhere where it is not known where it was.
    wanted, position : ndarray, shape (n_rows, n)
        Memory: where that is to go, and where it is.
    saturated : ndarray of int64, shape (2, n_controls + n_rows, n)
        1 where a control, or what it moves, has been beyond the lower and the upper end of its range.
    wrong : ndarray of int64, shape (n,)
        Tick at which a control was not a number or beyond its limit; -1 if none was.
    now, done : ndarray of int64, shape (n,)
        Memory: step of a tick, and steps made.
    """

    period: int
    delay: int
    bias: Array
    measured: Array
    memory: Array
    parameters: Array
    controls: Array
    waiting: Array
    lag: Array
    lagged: Array
    limits: Array
    low: Array
    high: Array
    clipped: Array
    rigging: Array
    row_low: Array
    row_high: Array
    reach: Array
    first_reach: Array
    wanted: Array
    position: Array
    saturated: NDArray[np.int64]
    wrong: NDArray[np.int64]
    now: NDArray[np.int64]
    rows: Array


@entry
def idle(time, measured, memory, parameters, controls):
    """Law that leaves everything as it is, where another one has been asked outside of compiled code."""


@entry
def sense(model, x, wind, time, tick, loop, noise):
    """Set what the laws of all flights measure at the beginning of a tick.

    Parameters
    ----------
    model, x, tick :
        See `sbs_sim.model.integrate.advance`.
    wind : ndarray, shape (WIND_SIZE, n)
        Air of the tick.
    time : float
        [s]
    loop : Loop
        Its `measured` is overwritten.
    noise : ndarray, shape (COUNT, n)
    """
    set_measured(model, x, wind, time, tick, loop, noise)


@kernel
def set_measured(model, x, wind, time, tick, loop, noise):
    """`sense`."""
    rotors = as_records(model.rotors)
    state, rows, air = as_lanes(x, rotors), as_lanes(loop.rows, rotors), as_lanes(tick.wind, rotors)
    wind_at(as_lanes(wind, rotors), time, 0.0, air)
    if tick.space.parameters.shape[0] > 0:
        add_air(model, x, tick.psi, wind, time, 0.0, tick.space, tick.wind)
    attitude = attitude_at(state)
    w, qx, qy, qz = attitude
    sine = minimum(maximum(2.0 * (w * qy - qz * qx), -1.0), 1.0)
    for i in range(3):
        rows[M.NORTH + i] = state[POSITION + i]
        rows[M.U + i] = state[VELOCITY + i]
        rows[M.P + i] = state[RATES + i]
    rows[M.ROLL] = direction(2.0 * (w * qx + qy * qz), 1.0 - 2.0 * (qx * qx + qy * qy))
    rows[M.PITCH] = angle_of(sine, sqrt(1.0 - sine * sine), 1.0)
    rows[M.HEADING] = direction(2.0 * (w * qz + qx * qy), 1.0 - 2.0 * (qy * qy + qz * qz))
    relative = vector_at(state, VELOCITY) - transposed(rotation(attitude)) @ vector_at(air, 0)
    rows[M.U_AIR], rows[M.V_AIR], rows[M.W_AIR] = relative.x, relative.y, relative.z
    for lane in range(loop.rows.shape[1]):
        for i in range(loop.rows.shape[0]):
            loop.measured[lane, i] = loop.rows[i, lane] + loop.bias[lane, i] + noise[i, lane]


@kernel
def command(model, loop, number, failed, given, swash):
    """Take the controls of the laws to what they move, through delay, lag, ranges and rates.

    Parameters
    ----------
    number : int
        Of the tick.
    failed : ndarray of int64, shape (n,)
        `FLYING` for flights that go on; overwritten for those whose controls are wrong.
    given, swash : ndarray, shapes (n_controls, n), (n_rows, n)
        Outputs: the controls that act, and what they move in this tick.
    """
    rotors, count = as_records(model.rotors), loop.controls.shape[1]
    ring = number % (loop.delay + 1)
    arriving = (number + 1) % (loop.delay + 1)
    for lane in range(failed.size):
        for i in range(count):
            value = loop.controls[lane, i]
            if not abs(value) <= loop.limits[i, lane] and failed[lane] == FLYING:
                failed[lane] = WRONG_CONTROL
                loop.wrong[lane] = number
            loop.waiting[ring, i, lane] = value
            given[i, lane] = loop.waiting[arriving, i, lane]
            if loop.lag[0, lane] < 1.0:
                given[i, lane] = loop.lagged[i, lane] + loop.lag[0, lane] * (given[i, lane] - loop.lagged[i, lane])
            loop.lagged[i, lane] = given[i, lane]
            loop.clipped[i, lane] = within(given[i, lane], loop.low, loop.high, i, i, lane, loop.saturated)
    mix(as_lanes(loop.rigging, rotors), as_lanes(loop.clipped, rotors), 0, as_lanes(loop.wanted, rotors))
    for lane in range(failed.size):
        for i in range(swash.shape[0]):
            target = within(loop.wanted[i, lane], loop.row_low, loop.row_high, i, count + i, lane, loop.saturated)
            before, reach = loop.position[i, lane], loop.reach[i, lane] if number > 0 else loop.first_reach[0, lane]
            if target - before > reach:
                target = before + reach
            elif before - target > reach:
                target = before - reach
            loop.position[i, lane] = target
            swash[i, lane] = target


@kernel
def within(value, low, high, i, name, lane, saturated):
    """A value in its range; it is noted where it was beyond."""
    if value < low[i, lane]:
        if value < low[i, lane] - ROUNDING:
            saturated[0, name, lane] = 1
        return low[i, lane]
    if value > high[i, lane]:
        if value > high[i, lane] + ROUNDING:
            saturated[1, name, lane] = 1
        return high[i, lane]
    return value


ROUNDING = 1e-12  # that a value may be beyond its range


@entry
def fly_controlled(
    law, fly, loop, number, place, begin, end, first, noise, given,
    advance, derivative, working_state, model, x, psi0, step, steps, h, method, bounds, work, tick, failed_state, swash,
    winds, ticks, offset, every, loaded, azimuths, air, states, forces, loads, first_look, watch, looks, look_air,
    working,
):  # fmt: skip
    """Fly ticks one after another under control laws, and record the first of every `every` ones.

    Parameters
    ----------
    law : Address
        law(time, measured, memory, parameters, controls) of one flight; `idle` where `loop.controls` are set already.
    fly : Address
        Of `sbs_sim.model.fly.fly`.
    loop : Loop
    number, first : int
        Tick and step at which the flights are, counted from their start.
    place : ndarray of int64, shape (3,)
        Rows, looks and calls of the laws before; overwritten.
    begin, end : int
        Ticks to fly, of those that `swash` has.
    noise : ndarray, shape (calls of the law, COUNT, n)
        What measurements are wrong by at each of them, beside their bias.
    given : ndarray, shape (len(swash), n_controls, n)
        Output: the controls that act.
    swash : ndarray, shape (ticks or one more, n_rows, n)
        Output here.
    The others :
        See `sbs_sim.model.fly.fly`.
    """
    for i in range(begin, end):
        row, look, now, at = place[0], place[1], first + i * steps, number + i
        if at % loop.period == 0:
            set_measured(model, x, winds[i], now * h, tick, loop, noise[place[2]])
            place[2] += 1
            for lane in range(failed_state.size):
                if failed_state[lane] == FLYING:
                    law(now * h, loop.measured[lane], loop.memory[lane], loop.parameters[lane], loop.controls[lane])
        command(model, loop, at, failed_state, given[i], swash[i])
        flies, records, looked = i < ticks, i == offset + row * every, i == first_look + look * watch
        for lane in range(failed_state.size):
            loop.now[lane] = now
            tick.done[lane] = 0
        fly(
            advance, derivative, working_state, model, x, psi0, loop.now, steps, h, method, bounds, work, tick,
            failed_state, swash[i : i + 1], winds[i : i + 1], 1 if flies else 0, 0 if records else 1, 1, loaded,
            azimuths[row : row + 1], air[row : row + 1], states[row : row + 1], forces[row : row + 1],
            loads[row : row + 1], 0 if looked else 1, 1, looks[look : look + 1], look_air[look : look + 1],
            working[look : look + 1],
        )  # fmt: skip
        place[0] += 1 if records else 0
        place[1] += 1 if looked else 0
        flying = False
        for lane in range(failed_state.size):
            step[lane] += tick.done[lane]
            flying = flying or failed_state[lane] == FLYING
        if not flying:
            return
