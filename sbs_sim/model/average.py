"""The derivative at many states and azimuths, and averages over the azimuth (theory.md section 8; paper eq. [15])."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sbs_sim.model.kernel import entry


def azimuths(passages: Sequence[int], count: int) -> NDArray[np.float64]:
    """Azimuth configurations of eq. [15]: the first blade of each rotor [rad], shape (count, n_rotors).

    `passages` is how often a rotor with its multiblade coordinates is the same again in one revolution.
    """
    return 2.0 * math.pi * np.arange(count)[:, None] / (np.array(passages) * count)


@entry
def averaged_derivative(derivative, model, x, swash, psi, wind, work, tick, dx, loads):
    """Mean of the state derivative, of the specific force and of the rotor loads over azimuth configurations.

    As many of them at once as there are lanes; the sum goes from one to the next in any case.

    Parameters
    ----------
    derivative, model, work, tick : see `sbs_sim.model.integrate.advance`
    x : ndarray, shape (size,)
        Simulation state.
    swash : ndarray, shape (3 n_rotors,)
        [rad]
    psi : ndarray, shape (count, n_rotors)
        [rad]
    wind : ndarray, shape (3,)
        NED [m/s].
    dx : ndarray, shape (size + 3,)
        Output: mean derivative, and mean specific force [m/s^2].
    loads : ndarray, shape (8 n_rotors,)
        Output: mean of `work.load_rows`.
    """
    size, lanes, count = x.size, tick.stage.shape[1], psi.shape[0]
    for i in range(dx.size):
        dx[i] = 0.0
    for i in range(loads.size):
        loads[i] = 0.0
    angles = tick.slopes[1]  # more rows than a rotor has angles
    for lane in range(lanes):
        for i in range(size):
            tick.stage[i, lane] = x[i]
        for i in range(swash.size):
            angles[i, lane] = swash[i]
        for i in range(3):
            tick.wind[i, lane] = wind[i]
    for first in range(0, count, lanes):
        for lane in range(lanes):
            for j in range(psi.shape[1]):
                tick.psi[j, lane] = psi[min(first + lane, count - 1), j]
        derivative(model, tick.stage, angles[: swash.size], tick.psi, tick.wind, work, tick.slopes[0], True)
        for lane in range(min(lanes, count - first)):
            for i in range(size):
                dx[i] += tick.slopes[0, i, lane] / count
            for i in range(3):
                dx[size + i] += work.acceleration_rows[i, lane] / count
            for i in range(loads.size):
                loads[i] += work.load_rows[i, lane] / count
