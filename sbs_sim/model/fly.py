"""Many ticks in one call of compiled code, so that flights side by side do not wait for Python."""

from sbs_sim.model.integrate import copy_numbers
from sbs_sim.model.kernel import entry


@entry
def fly(
    advance, derivative, working_state, p, x, psi0, step, steps, h, method, bounds, work, swash, winds, ticks, offset,
    every, loaded, azimuths, air, states, forces, loads, slope, stall, first_look, watch, looks, look_air, working,
):  # fmt: skip
    """Fly ticks one after another, and write down the first of every `every` ones.

    Parameters
    ----------
    advance, derivative, working_state : Address
        Of the entries of these names: the machine code with which flights tick by tick are flown.
    p, x, psi0, steps, h, method, bounds, work :
        See `advance`; x is overwritten.
    step : int
        Number of the step at the start.
    swash : ndarray, shape (ticks, n_rotors, 3), or one more
        Swashplate angles of each tick [rad]; after the last tick of a flight they are those it ends with.
    winds : ndarray, shape (len(swash) or more, WIND_SIZE)
        Air of each tick.
    ticks : int
        How many to fly.
    offset : int
        Ticks from the start until one is to be written down.
    every : int
    loaded : bool
        True writes down forces and loads too, which takes one more derivative.
    azimuths : ndarray, shape (rows, n_rotors)
        [rad]
    air : ndarray, shape (rows, 3)
        Velocity of the air at the times that are written down, NED [m/s].
    states, forces, loads : ndarray, shapes (rows, size), (rows, 3), (rows, n_rotors, LOAD_SIZE)
        Outputs: state, specific force of the c.g. [m/s^2], see `Work`.
    slope : ndarray, shape (size,)
        Memory.
    stall : ndarray, shape (n_rotors, 3, n)
        See `working_state`.
    first_look, watch : int
        Ticks from the start until one whose working states are written down, and from one of these to the next.
    looks, look_air : ndarray, shapes (n_looks, n_rotors), (n_looks, 3)
        Azimuths [rad] and velocity of the air [m/s] there.
    working : ndarray, shape (n_looks, n_rotors, WORKING_SIZE)
        Output: working states.

    Returns
    -------
    step : int
        Number of the last good step.
    culprit : int
        Index of the state that would leave the plausible, -1 if none.
    """
    row = look = 0
    for i in range(swash.shape[0]):
        if i == first_look + look * watch:
            derivative(p, x, swash[i], looks[look], look_air[look], work, slope)
            working_state(p, x, stall, work, working[look])
            look += 1
        if i == offset + row * every:
            copy_numbers(x, states[row])
            if loaded:
                derivative(p, x, swash[i], azimuths[row], air[row], work, slope)
                copy_numbers(work.vector[:3], forces[row])
                for j in range(loads.shape[1]):
                    copy_numbers(work.loads[j], loads[row, j])
            row += 1
        if i == ticks:
            break
        done, culprit = advance(p, x, swash[i], psi0, step, steps, h, winds[i], method, bounds, work)
        step += done
        if culprit >= 0:
            return step, culprit
    return step, -1
