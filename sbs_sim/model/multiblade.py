"""Multiblade (Coleman) coordinates of a rotor with three or more blades (theory.md section 1).

beta_k = a0 - sum_n (a_n cos n psi_k + b_n sin n psi_k) + a_d (-1)^k, n = 1 .. (N_b - 1) / 2, with the differential
coordinate a_d for even N_b only: N_b coordinates for N_b blades, one to one. Lag alike.
"""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sbs_sim.model import params as P
from sbs_sim.model.kernel import kernel

LANES = P.LANES
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
def add_block_accelerations(dx, flap_rates, lag_rates, n_blades, row, share):
    """Add what the blades of one block give to the accelerations of their rotor's coordinates.

    `flap_rates` and `lag_rates` are the places of the first of them in dx; row: the block's in `Work.blade`; share: 1
    over the number of blades.
    """
    flap, lag = _sums(row, P.IS_BLADE)
    dx[flap_rates] += share * flap
    dx[lag_rates] += share * lag
    for i in range(LANES):
        row[P.COS_N + i], row[P.SIN_N + i] = row[P.COSINE + i], row[P.SINE + i]
    harmonics = (n_blades - 1) // 2
    for n in range(1, harmonics + 1):
        flap, lag = _sums(row, P.COS_N)
        dx[flap_rates + 2 * n - 1] -= 2.0 * share * flap
        dx[lag_rates + 2 * n - 1] -= 2.0 * share * lag
        flap, lag = _sums(row, P.SIN_N)
        dx[flap_rates + 2 * n] -= 2.0 * share * flap
        dx[lag_rates + 2 * n] -= 2.0 * share * lag
        if n < harmonics:
            _next_harmonic(row)
    if n_blades % 2 == 0:
        for i in range(LANES):
            sign = share * row[P.IS_BLADE + i] * (1.0 - 2.0 * (i % 2))
            dx[flap_rates + n_blades - 1] += sign * row[P.FLAP_ACCELERATION + i]
            dx[lag_rates + n_blades - 1] += sign * row[P.LAG_ACCELERATION + i]


@kernel
def _sums(row, weights):
    """Flap and lag accelerations of the blades of a block, each times a weight that stands in a row."""
    flap = lag = 0.0
    for i in range(LANES):
        flap += row[weights + i] * row[P.FLAP_ACCELERATION + i]
        lag += row[weights + i] * row[P.LAG_ACCELERATION + i]
    return flap, lag


@kernel
def _next_harmonic(row):
    """Turn the cosine and sine of n psi into those of (n + 1) psi."""
    for i in range(LANES):
        c, s = row[P.COS_N + i], row[P.SIN_N + i]
        row[P.COS_N + i] = c * row[P.COSINE + i] - s * row[P.SINE + i]
        row[P.SIN_N + i] = s * row[P.COSINE + i] + c * row[P.SINE + i]


@kernel
def add_rotation_terms(x, dx, angles, rates, n_blades, speed, factor):
    """Add `factor` times -K1 q' - K0 q (paper eqs. [26], [27]): what the turning of the coordinates gives."""
    for n in range(1, (n_blades - 1) // 2 + 1):
        i = 2 * n - 1
        harmonic = n * speed
        dx[rates + i] += factor * harmonic * (harmonic * x[angles + i] - 2.0 * x[rates + i + 1])
        dx[rates + i + 1] += factor * harmonic * (harmonic * x[angles + i + 1] + 2.0 * x[rates + i])
