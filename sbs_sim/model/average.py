"""Averages of the derivative over the azimuth (theory.md section 8; paper eq. [15])."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sbs_sim.model.dynamics import evaluate
from sbs_sim.model.kernel import entry


def azimuths(blades: Sequence[int], count: int) -> NDArray[np.float64]:
    """Azimuth configurations of eq. [15]: the first blade of each rotor [rad], shape (count, n_rotors)."""
    return 2.0 * math.pi * np.arange(count)[:, None] / (np.array(blades) * count)


@entry
def averaged_derivative(p, x, swash, azimuth_count, still_air, work, dx, loads):
    """Mean of the state derivative and of the rotor loads over azimuth configurations.

    Configuration k of N_c has the first blade of a rotor with N_b blades at 2 pi k / (N_b N_c).

    Parameters
    ----------
    p, x, swash, work : see `sbs_sim.model.dynamics.derivative`
    azimuth_count : int
        N_c.
    still_air : ndarray, shape (3,)
        Wind, NED [m/s].
    dx : ndarray, shape (size,)
        Output: mean derivative.
    loads : ndarray, shape (n_rotors, LOAD_SIZE)
        Output: mean of `work.loads`.
    """
    dx[:] = 0.0
    loads[:, :] = 0.0
    slope = work.stages[0]
    for k in range(azimuth_count):
        for j in range(p.rotor.shape[0]):
            n_blades = p.first_blade[j + 1] - p.first_blade[j]
            work.psi[j] = 2.0 * math.pi * k / (n_blades * azimuth_count)
        evaluate(p, x, swash, work.psi, still_air, work, slope)
        for i in range(dx.size):
            dx[i] += slope[i] / azimuth_count
        for j in range(p.rotor.shape[0]):
            for m in range(loads.shape[1]):
                loads[j, m] += work.loads[j, m] / azimuth_count
