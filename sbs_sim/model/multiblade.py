"""Multiblade (Coleman) coordinates of a rotor with three or more blades (theory.md section 1).

beta_k = a0 - sum_n (a_n cos n psi_k + b_n sin n psi_k) + a_d (-1)^k, n = 1 .. (N_b - 1) / 2, with the differential
coordinate a_d for even N_b only: N_b coordinates for N_b blades, one to one. Lag alike.
"""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sbs_sim.model.kernel import kernel

Array = NDArray[np.float64]


def blade_matrix(blades: int, azimuth: float | Array, order: int = 0) -> Array:
    """T with blade angles = T @ coordinates, or its derivative by the azimuth.

    Parameters
    ----------
    blades : int
    azimuth : float or ndarray, shape (...)
        Of the first blade [rad].
    order : int
        0 for T itself, 1 and 2 for its first and second derivative.

    Returns
    -------
    ndarray, shape (..., blades, blades)
    """
    psi = np.asarray(azimuth)[..., None] + 2 * math.pi * np.arange(blades) / blades
    columns: list[NDArray[Any]] = [np.full_like(psi, order == 0)]
    for harmonic in range(1, (blades - 1) // 2 + 1):
        angle = harmonic * psi + order * math.pi / 2
        columns += [-(harmonic**order) * np.cos(angle), -(harmonic**order) * np.sin(angle)]
    if blades % 2 == 0:
        columns.append(np.full_like(psi, order == 0) * (-1.0) ** np.arange(blades))
    return np.stack(columns, axis=-1)


@kernel
def blade_angle(x, angles, rates, n_blades, blade, cosine, sine, speed):
    """Angle [rad] and rate [rad/s] of one blade from the coordinates of its rotor.

    `angles` and `rates` are the places of the first coordinate and its rate in the state x; cosine and sine are
    those of the blade's azimuth, which grows at `speed` [rad/s].
    """
    angle = x[angles]
    rate = x[rates]
    cn, sn = cosine, sine
    for n in range(1, (n_blades - 1) // 2 + 1):
        i = 2 * n - 1
        a, b = x[angles + i], x[angles + i + 1]
        angle -= a * cn + b * sn
        rate += n * speed * (a * sn - b * cn) - x[rates + i] * cn - x[rates + i + 1] * sn
        cn, sn = cn * cosine - sn * sine, sn * cosine + cn * sine
    if n_blades % 2 == 0:
        sign = 1.0 - 2.0 * (blade % 2)
        angle += sign * x[angles + n_blades - 1]
        rate += sign * x[rates + n_blades - 1]
    return angle, rate


@kernel
def add_blade_acceleration(dx, rates, n_blades, blade, cosine, sine, share):
    """Add what one blade gives to the accelerations of the coordinates.

    share: acceleration of the blade [rad/s^2] over the number of blades; cosine and sine are those of its azimuth.
    """
    dx[rates] += share
    cn, sn = cosine, sine
    for n in range(1, (n_blades - 1) // 2 + 1):
        i = rates + 2 * n - 1
        dx[i] -= 2.0 * share * cn
        dx[i + 1] -= 2.0 * share * sn
        cn, sn = cn * cosine - sn * sine, sn * cosine + cn * sine
    if n_blades % 2 == 0:
        dx[rates + n_blades - 1] += (1.0 - 2.0 * (blade % 2)) * share


@kernel
def add_rotation_terms(x, dx, angles, rates, n_blades, speed, factor):
    """Add `factor` times -K1 q' - K0 q (paper eqs. [26], [27]): what the turning of the coordinates gives."""
    for n in range(1, (n_blades - 1) // 2 + 1):
        i = 2 * n - 1
        harmonic = n * speed
        dx[rates + i] += factor * harmonic * (harmonic * x[angles + i] - 2.0 * x[rates + i + 1])
        dx[rates + i + 1] += factor * harmonic * (harmonic * x[angles + i + 1] + 2.0 * x[rates + i])
