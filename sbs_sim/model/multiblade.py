"""Multiblade (Coleman) coordinates of a rotor (theory.md section 1).

beta_k = a0 - sum_n (a_n cos n psi_k + b_n sin n psi_k) + a_d (-1)^k, n = 1 .. (N_b - 1) / 2, with the differential
coordinate a_d for even N_b only: N_b coordinates for N_b blades, one to one. Lag alike.
"""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sbs_sim.lanes import add_to_quads, spread
from sbs_sim.model.kernel import kernel
from sbs_sim.model.state import harmonic_count

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
    for harmonic in range(1, harmonic_count(blades) + 1):
        angle = harmonic * psi + order * math.pi / 2
        columns += [-(harmonic**order) * np.cos(angle), -(harmonic**order) * np.sin(angle)]
    if blades % 2 == 0:
        columns.append(np.full_like(psi, order == 0) * (-1.0) ** np.arange(blades))
    return np.stack(columns, axis=-1)


@kernel
def blade_angle(x, angles, rates, blade, cosine, sine):
    """Angle [rad] and rate [rad/s] of blades from the multiblade coordinates of their rotors, eqs. (1.6) and (1.10).

    Parameters
    ----------
    x : lanes, shape (size + 1,)
        State, and a zero.
    angles, rates : ndarray of int64, shape (coordinates, quads)
        See `sbs_sim.model.records.StateIndices`.
    blade : record BLADE
    cosine, sine : lanes
        Of the azimuths of the blades.
    """
    quad, last = blade.quad, angles.shape[0] - 1
    angle, rate = spread(x, angles[0], quad, blade), spread(x, rates[0], quad, blade)
    cn, sn = cosine, sine
    for n in range(1, blade.harmonics + 1):
        a, b = spread(x, angles[2 * n - 1], quad, blade), spread(x, angles[2 * n], quad, blade)
        a_rate, b_rate = spread(x, rates[2 * n - 1], quad, blade), spread(x, rates[2 * n], quad, blade)
        angle = angle - a * cn - b * sn
        rate = rate + n * blade.rotor_speed * (a * sn - b * cn) - a_rate * cn - b_rate * sn
        cn, sn = cn * cosine - sn * sine, sn * cosine + cn * sine
    return (
        angle + blade.alternation * spread(x, angles[last], quad, blade),
        rate + blade.alternation * spread(x, rates[last], quad, blade),
    )


@kernel
def blade_value(x, coordinates, blade, cosine, sine):
    """Value of blades from the multiblade coordinates of their rotors; see `blade_angle`."""
    quad, last = blade.quad, coordinates.shape[0] - 1
    value, cn, sn = spread(x, coordinates[0], quad, blade), cosine, sine
    for n in range(1, blade.harmonics + 1):
        a, b = spread(x, coordinates[2 * n - 1], quad, blade), spread(x, coordinates[2 * n], quad, blade)
        value = value - a * cn - b * sn
        cn, sn = cn * cosine - sn * sine, sn * cosine + cn * sine
    return value + blade.alternation * spread(x, coordinates[last], quad, blade)


@kernel
def add_accelerations(blade, terms, means, harmonics):
    """Add the accelerations of blades to the sums over their quads that the means of eq. (1.9) are made of."""
    add_values(blade, terms, terms.flap_acceleration, terms.lag_acceleration, means, harmonics)


@kernel
def add_values(blade, terms, flap, lag, means, harmonics):
    """Add two values of blades to the sums over their quads that their coordinates are made of."""
    add_to_quads(
        means, blade.quad, blade.starts_quad, "flap", (flap, lag, flap * blade.alternation, lag * blade.alternation)
    )
    cosine, sine = terms.cosine, terms.sine
    cn, sn = cosine, sine
    for n in range(1, blade.harmonics + 1):
        add_to_quads(
            harmonics[n - 1], blade.quad, blade.starts_quad, "flap_cosine", (flap * cn, flap * sn, lag * cn, lag * sn)
        )
        cn, sn = cn * cosine - sn * sine, sn * cosine + cn * sine


@kernel
def set_accelerations(rotor, means, harmonics, dx):
    """Set the accelerations of the coordinates of a rotor without the terms of their rotation, eq. (1.9)."""
    set_coordinates(rotor, means, harmonics, dx, rotor.flap_rate, rotor.lag_rate)


@kernel
def set_coordinates(rotor, means, harmonics, dx, first, second):
    """Set the coordinates of two values of the blades of a rotor, from two indices on."""
    share = rotor.inverse_blades
    flap = lag = flap_differential = lag_differential = 0.0
    for quad in range(rotor.first_quad, rotor.first_quad + rotor.quads):
        own = means[quad]
        flap, lag = flap + own.flap, lag + own.lag
        flap_differential = flap_differential + own.flap_differential
        lag_differential = lag_differential + own.lag_differential
    dx[first], dx[second] = share * flap, share * lag
    last = rotor.blades - 1
    if rotor.blades % 2 == 0:
        dx[first + last], dx[second + last] = share * flap_differential, share * lag_differential
    twice = -2.0 * share
    for n in range(1, rotor.harmonics + 1):
        flap_cosine = flap_sine = lag_cosine = lag_sine = 0.0
        for quad in range(rotor.first_quad, rotor.first_quad + rotor.quads):
            part = harmonics[n - 1, quad]
            flap_cosine, flap_sine = flap_cosine + part.flap_cosine, flap_sine + part.flap_sine
            lag_cosine, lag_sine = lag_cosine + part.lag_cosine, lag_sine + part.lag_sine
        i = 2 * n - 1
        dx[first + i], dx[first + i + 1] = twice * flap_cosine, twice * flap_sine
        dx[second + i], dx[second + i + 1] = twice * lag_cosine, twice * lag_sine


@kernel
def add_first_rotation_terms(rotor, x, dx, coordinates):
    """Add the terms of the rotating coordinates to the first derivatives of those from an index on."""
    for n in range(1, rotor.harmonics + 1):
        i = coordinates + 2 * n - 1
        harmonic = n * rotor.rotor_speed
        a, b = x[i], x[i + 1]
        dx[i], dx[i + 1] = dx[i] - harmonic * b, dx[i + 1] + harmonic * a


@kernel
def add_rotation_terms(rotor, x, dx, angles, rates, factor):
    """Add `factor` times -K1 q' - K0 q (paper eqs. [26], [27]): the terms of the rotating coordinates.

    `angles` and `rates` are the indices of the first coordinate and of its rate in the state.
    """
    for n in range(1, rotor.harmonics + 1):
        i = 2 * n - 1
        harmonic = n * rotor.rotor_speed
        a, b = x[angles + i], x[angles + i + 1]
        a_rate, b_rate = x[rates + i], x[rates + i + 1]
        dx[rates + i] = dx[rates + i] + factor * harmonic * (harmonic * a - 2.0 * b_rate)
        dx[rates + i + 1] = dx[rates + i + 1] + factor * harmonic * (harmonic * b + 2.0 * a_rate)
