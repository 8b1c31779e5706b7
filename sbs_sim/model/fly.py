"""Many ticks in one call of compiled code, so that flights side by side do not wait for Python."""

from sbs_sim.model.air import add_air
from sbs_sim.model.integrate import FLYING, copy_rows
from sbs_sim.model.kernel import entry
from sbs_sim.model.ring import set_ring_noise


@entry
def fly(
    advance, derivative, working_state, model, x, psi0, step, steps, h, method, bounds, work, tick, failed_state, swash,
    winds, ticks, offset, every, loaded, azimuths, air, states, forces, loads, first_look, watch, looks, look_air,
    working,
):  # fmt: skip
    """Fly ticks one after another, and record the first of every `every` ones.

    Parameters
    ----------
    advance, derivative, working_state : Address
        Of the entries.
    model, x, psi0, steps, h, method, bounds, work, tick :
        See `advance`; x is overwritten.
    step : ndarray of int64, shape (n,)
        Number of the step at the start; overwritten with that of the last good step of each flight.
    failed_state : ndarray of int64, shape (n,)
        See `advance`.
    swash : ndarray, shape (ticks, 3 n_rotors, n), or one more
        Swashplate angles of each tick [rad]; after the last tick of a flight they are those it ends with.
    winds : ndarray, shape (len(swash) or more, WIND_SIZE, n), or (..., WIND_SIZE + 2 n_rotors, n)
        Air of each tick; behind it the noise of vortex rings, see `Simulation.air_ahead`.
    ticks : int
        Number of ticks to fly.
    offset : int
        Ticks from the start to the first that is recorded.
    every : int
    loaded : bool
        True records forces and loads too, which takes one more derivative.
    azimuths : ndarray, shape (rows, n_rotors, n)
        [rad]
    air : ndarray, shape (rows, 3, n)
        Velocity of the air at the recorded times, NED [m/s]. Of air that is not the same everywhere the rows of
        `sbs_sim.model.air`, overwritten with what is added where the aircraft is.
    states, forces, loads : ndarray, shapes (rows, size, n), (rows, 3, n), (rows, 8 n_rotors, n)
        Outputs: state, specific force of the c.g. [m/s^2], and see `Work`. Rows after the end of a flight have no
        meaning.
    first_look, watch : int
        Ticks from the start to the first of which working states are recorded, and from one of these to the next.
    looks, look_air : ndarray, shapes (n_looks, n_rotors, n), (n_looks, 3, n)
        Azimuths [rad] and velocity of the air [m/s] there, as `air`.
    working : ndarray, shape (n_looks, n_rotors, WORKING_SIZE, n)
        Output: working states.
    """
    row, look, first = 0, 0, step[0]
    steps_done = tick.done
    for i in range(swash.shape[0]):
        if work.ring.shape[1] > 0:
            set_ring_noise(model, winds[i], 0.0, work)
        if i == first_look + look * watch:
            if tick.space.parameters.shape[0] > 0:
                add_air(model, x, looks[look], winds[i], (first + i * steps) * h, 0.0, tick.space, look_air[look])
            derivative(model, x, swash[i], looks[look], look_air[look], work, tick.slopes[0], False)
            working_state(model, work, working[look])
            look += 1
        if i == offset + row * every:
            copy_rows(x, states[row])
            if loaded:
                if tick.space.parameters.shape[0] > 0:
                    add_air(model, x, azimuths[row], winds[i], (first + i * steps) * h, 0.0, tick.space, air[row])
                derivative(model, x, swash[i], azimuths[row], air[row], work, tick.slopes[0], True)
                copy_rows(work.acceleration_rows[:3], forces[row])
                copy_rows(work.load_rows, loads[row])
            row += 1
        if i == ticks:
            return
        advance(derivative, model, x, swash[i], psi0, first + i * steps, steps, h, winds[i], method, bounds, work, tick,
                steps_done, failed_state)  # fmt: skip
        flying = False
        for lane in range(failed_state.size):
            step[lane] += steps_done[lane]
            flying = flying or failed_state[lane] == FLYING
        if not flying:
            return
