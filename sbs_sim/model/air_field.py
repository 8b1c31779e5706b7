"""A frozen field of turbulence over the horizontal plane, made from a seed (theory.md section 7.8).

The field is a sum of waves on a few levels. A level is a square of `SIDE` x `SIDE` points that repeats itself, of a
sixteenth of the side of the level before it. Each has the waves of its own band of wave numbers with the energy that
the spectrum has there, so that a few megabytes hold waves from 40 scale lengths down to a quarter of a metre. Between
points the field is a cubic spline, whose first and second derivatives are continuous. Each level is turned by 1 rad
against the one before it: a straight flight then meets no level again in the same order.

J. Mann: Wind field simulation, Probabilistic Engineering Mechanics 13 (4), 1998, makes fields that way; the spectra of
isotropic turbulence in a plane are in B. Etkin: Dynamics of Atmospheric Flight, Wiley 1972, section 13.2.
"""

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from sbs_sim.model.kernel import entry, kernel
from sbs_sim.model.noise import normal
from sbs_sim.model.real_functions import cosine_of_turn, power_of, sine_of_turn

Array = NDArray[np.float64]

SIDE = 256  # points along a side of a level
LOWEST, HIGHEST = 4, 64  # waves along a side that a level has; the first one has them from 1 on
RATIO = 16  # from the side of a level to that of the next
LENGTHS = 40.0  # scale lengths along the side of the first level
SHORTEST = 0.25  # m, wave length that the last level reaches at least
TURN_COSINE, TURN_SINE = 0.5403023058681398, 0.8414709848078965  # of 1 rad, from a level to the next
KARMAN = 1.339  # a of von Karman's spectrum
DRYDEN, VON_KARMAN = "dryden", "von_karman"
CACHED = 8  # fields that are kept for those who ask again


@lru_cache(maxsize=CACHED)
def field_grids(model: str, length: float, vertical_length: float, seed: int) -> tuple[Array, float]:
    """Levels of a field whose components have a standard deviation of 1, and the longest period [m].

    Parameters
    ----------
    model : str
        "dryden" or "von_karman".
    length, vertical_length : float
        Scale lengths of the horizontal components and of the vertical one [m].
    seed : int

    Returns
    -------
    grids : ndarray, shape (levels, SIDE, SIDE, 3)
        Coefficients of the spline at points along north and east: components north, east, down.
    period : float
        Of the first level [m].
    """
    source = np.random.PCG64(np.random.SeedSequence([seed, 2]))
    period = LENGTHS * max(length, vertical_length)
    levels = 1
    while period / RATIO ** (levels - 1) > HIGHEST * SHORTEST:
        levels += 1
    grids = np.empty((levels, SIDE, SIDE, 3))
    waves = _twiddles()
    for level in range(levels):
        noise = normal(source, 3 * (2 * HIGHEST + 1) ** 2).reshape(-1, 3, 2)
        real, imaginary = np.zeros((2, SIDE, SIDE)), np.zeros((2, SIDE, SIDE))
        for component in range(3):
            real[:], imaginary[:] = 0.0, 0.0
            _spectrum(
                *(noise, component, model == VON_KARMAN, length, vertical_length, period / RATIO**level),
                *(1 if level == 0 else LOWEST, waves, real[0], imaginary[0]),
            )
            _transform(real[0], imaginary[0], waves)
            grids[level, :, :, component] = real[0]
    return grids, period


def _twiddles() -> Array:
    """Cosine and sine of the multiples of a full turn over SIDE, shape (SIDE, 2)."""
    waves = np.empty((SIDE, 2))
    _fill_twiddles(waves)
    return waves


@entry
def _fill_twiddles(waves):
    for i in range(waves.shape[0]):
        waves[i, 0], waves[i, 1] = cosine_of_turn(i / waves.shape[0]), sine_of_turn(i / waves.shape[0])


@entry
def _spectrum(noise, component, karman, length, vertical_length, period, lowest, waves, real, imaginary):
    """Amplitudes of the waves of a level, for one component.

    A wave along the unit vector e has the amplitude sqrt(A) e z_1 + sqrt(B) t z_2 in the plane, t across e, and
    sqrt(C) z_3 downwards, with complex normal numbers z.
    """
    side, number = real.shape[0], 0
    step = 6.283185307179586 / period
    for m in range(-HIGHEST, HIGHEST + 1):
        for n in range(-HIGHEST, HIGHEST + 1):
            waves_along = m * m + n * n
            own = noise[number]
            number += 1
            if waves_along < lowest * lowest or waves_along >= HIGHEST * HIGHEST:
                continue
            size = math.sqrt(float(waves_along))
            east, north = n / size, m / size
            along, across, _ = plane_spectra(karman, length, step * size)
            _, _, down = plane_spectra(karman, vertical_length, step * size)
            a, b, c = math.sqrt(along) * step, math.sqrt(across) * step, math.sqrt(down) * step
            if component == 0:
                first, second, third = a * north, -(b * east), 0.0
            elif component == 1:
                first, second, third = a * east, b * north, 0.0
            else:
                first, second, third = 0.0, 0.0, c
            i, j = m % side, n % side
            # of the spline through values that are a wave
            gain = 9.0 / ((2.0 + waves[i, 0]) * (2.0 + waves[j, 0]))
            real[i, j] = gain * ((first * own[0, 0] + second * own[1, 0]) + third * own[2, 0])
            imaginary[i, j] = gain * ((first * own[0, 1] + second * own[1, 1]) + third * own[2, 1])


@kernel
def plane_spectra(karman, length, wave_number):
    """Two-dimensional spectra A, B, C [m^2] of turbulence of variance 1 at a wave number [rad/m], eq. (7.24).

    Of the components along the wave, across it in the plane, and across the plane; over the complete plane each pair
    (A + B) / 2 and C have the integral 1.
    """
    scale = KARMAN * length if karman else length
    square = scale * scale * wave_number * wave_number
    q = 1.0 + square
    if karman:
        along = scale * scale / (6.0 * 3.141592653589793) * power_of(q, -4.0 / 3.0)
        down = 8.0 / 3.0 * along * square / q
    else:
        along = scale * scale / (4.0 * 3.141592653589793) / (q * math.sqrt(q))
        down = 3.0 * along * square / q
    return along, along + down, down


@entry
def _transform(real, imaginary, waves):
    """Sum of all waves at every point, in place and transposed: a Fourier transform along each axis."""
    side = real.shape[0]
    for _ in range(2):
        transform_columns(real, imaginary, waves)
        for i in range(side):
            for j in range(i):
                real[i, j], real[j, i] = real[j, i], real[i, j]
                imaginary[i, j], imaginary[j, i] = imaginary[j, i], imaginary[i, j]


@kernel
def transform_columns(real, imaginary, waves):
    """Transform all columns (Cooley and Tukey, radix 2)."""
    side, j = real.shape[0], 0
    for i in range(1, side):
        bit = side >> 1
        while j & bit:
            j ^= bit
            bit >>= 1
        j ^= bit
        if i < j:
            for k in range(side):
                real[i, k], real[j, k] = real[j, k], real[i, k]
                imaginary[i, k], imaginary[j, k] = imaginary[j, k], imaginary[i, k]
    width = 1
    while width < side:
        for start in range(0, side, 2 * width):
            for number in range(width):
                c, s = waves[number * (side // (2 * width)), 0], waves[number * (side // (2 * width)), 1]
                first, second = start + number, start + number + width
                for k in range(side):
                    x, y = real[second, k], imaginary[second, k]
                    u, v = c * x - s * y, c * y + s * x
                    real[second, k], imaginary[second, k] = real[first, k] - u, imaginary[first, k] - v
                    real[first, k], imaginary[first, k] = real[first, k] + u, imaginary[first, k] + v
        width *= 2


@kernel
def sampled(grids, first, levels, period, x, y):
    """Velocity at a point, and its derivatives.

    Parameters
    ----------
    grids : ndarray, shape (m, SIDE, SIDE, 3)
    first, levels : int
        Levels that belong to the field.
    period : float
        Of the first of them [m].
    x, y : float
        Towards north and east in the field [m].

    Returns
    -------
    tuple of 9 floats
        Components north, east, down, and their derivatives to the north and to the east [1/m].
    """
    n = e = d = n_x = e_x = d_x = n_y = e_y = d_y = 0.0
    side, c, s = period, 1.0, 0.0
    for level in range(first, first + levels):
        found = sampled_level(grids, level, side, c * x + s * y, c * y - s * x)
        a, b, down, a_x, b_x, down_x, a_y, b_y, down_y = found
        n += c * a - s * b
        e += s * a + c * b
        d += down
        # of the components to the north and to the east, by the axes of the level
        p, q = c * a_x - s * b_x, c * a_y - s * b_y
        n_x += c * p - s * q
        n_y += s * p + c * q
        p, q = s * a_x + c * b_x, s * a_y + c * b_y
        e_x += c * p - s * q
        e_y += s * p + c * q
        d_x += c * down_x - s * down_y
        d_y += s * down_x + c * down_y
        side, c, s = side / RATIO, c * TURN_COSINE - s * TURN_SINE, s * TURN_COSINE + c * TURN_SINE
    return n, e, d, n_x, e_x, d_x, n_y, e_y, d_y


@kernel
def sampled_level(grids, level, side, x, y):
    """Velocity and derivatives of a level along its own axes, at a point in these; `side` is its period [m]."""
    n = e = d = n_x = e_x = d_x = n_y = e_y = d_y = 0.0
    u, v = SIDE * (x / side - math.floor(x / side)), SIDE * (y / side - math.floor(y / side))
    i, j = int(u), int(v)
    per_cell = SIDE / side
    a, b = spline(u - i), spline(v - j)
    a_x, b_y = spline_slopes(u - i), spline_slopes(v - j)
    for k in range(4):
        row = (i + k - 1) & (SIDE - 1)
        r0 = r1 = r2 = s0 = s1 = s2 = 0.0
        for m in range(4):
            column = (j + m - 1) & (SIDE - 1)
            w, slope = b[m], b_y[m]
            r0 += w * grids[level, row, column, 0]
            r1 += w * grids[level, row, column, 1]
            r2 += w * grids[level, row, column, 2]
            s0 += slope * grids[level, row, column, 0]
            s1 += slope * grids[level, row, column, 1]
            s2 += slope * grids[level, row, column, 2]
        n += a[k] * r0
        e += a[k] * r1
        d += a[k] * r2
        n_x += per_cell * (a_x[k] * r0)
        e_x += per_cell * (a_x[k] * r1)
        d_x += per_cell * (a_x[k] * r2)
        n_y += per_cell * (a[k] * s0)
        e_y += per_cell * (a[k] * s1)
        d_y += per_cell * (a[k] * s2)
    return n, e, d, n_x, e_x, d_x, n_y, e_y, d_y


@kernel
def spline(t):
    """Weights of four points around a point at t from 0 to 1 behind the second: the uniform cubic B-spline."""
    r = 1.0 - t
    square, cube = t * t, t * t * t
    return (
        r * r * r / 6.0,
        2.0 / 3.0 - square + 0.5 * cube,
        2.0 / 3.0 - r * r + 0.5 * (r * r * r),
        cube / 6.0,
    )


@kernel
def spline_slopes(t):
    """Derivatives of `spline`."""
    r = 1.0 - t
    return -0.5 * (r * r), -2.0 * t + 1.5 * (t * t), 2.0 * r - 1.5 * (r * r), 0.5 * (t * t)


@entry
def sample_field(grids, period, points, out):
    """Components of a field at points, shape (m, 2) to (m, 9), see `sampled`."""
    for i in range(points.shape[0]):
        found = sampled(grids, 0, grids.shape[0], period, points[i, 0], points[i, 1])
        for k in range(9):
            out[i, k] = found[k]
