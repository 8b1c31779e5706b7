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

from sbs_sim.lanes import as_quads, floor, rounded, zeros_like
from sbs_sim.model.kernel import entry, kernel
from sbs_sim.model.noise import normal
from sbs_sim.model.real_functions import cosine_of_turn, power_of, sine_of_turn
from sbs_sim.model.records import aligned

Array = NDArray[np.float64]

SIDE = 256  # points along a side of a level
LAST = SIDE - 1
BESIDE = 3  # points behind a side, which are the first ones again: those of a cell are side by side everywhere
# powers of t in the four weights of the uniform cubic B-spline, and in their derivatives
SPLINE = np.array(
    [[1 / 6, 2 / 3, 1 / 6, 0.0], [-0.5, 0.0, 0.5, 0.0], [0.5, -1.0, 0.5, 0.0], [-1 / 6, 0.5, -0.5, 1 / 6]]
)
SPLINE_SLOPES = SPLINE[1:] * np.array([[1.0], [2.0], [3.0]])
LOWEST, HIGHEST = 4, 64  # waves along a side that a level has; the first one has them from 1 on
RATIO = 16  # from the side of a level to that of the next
LENGTHS = 40.0  # scale lengths along the side of the first level
SHORTEST = 0.25  # m, wave length that the last level reaches at least
TURN_COSINE, TURN_SINE = 0.5403023058681398, 0.8414709848078965  # of 1 rad, from a level to the next
MOST_LEVELS = 8  # that there is room for; the longest scale length has five
# rows of the memory of a sample, levels in the columns: cells along both axes, weights of the points of a cell along
# each, and their derivatives
CELL, T, U, T_SLOPE, U_SLOPE, WEIGHTS = 0, 2, 6, 10, 14, 18


def _turns() -> Array:
    """Cosine and sine of the turn of each level, and the side of the first level over its own, shape (3, levels)."""
    found = [(1.0, 0.0, 1.0)]
    for _ in range(MOST_LEVELS - 1):
        c, s, scale = found[-1]
        found.append((c * TURN_COSINE - s * TURN_SINE, s * TURN_COSINE + c * TURN_SINE, scale * RATIO))
    return np.array(found).T.copy()


TURN_COSINES, TURN_SINES, SCALES = _turns()
TURN_COSINES_OF_FOUR, TURN_SINES_OF_FOUR, SCALES_OF_FOUR = _turns().reshape(3, -1, 4)
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
    grids : ndarray, shape (levels, SIDE + BESIDE, SIDE + BESIDE, 4)
        Coefficients of the spline at points along the axes of each level: components north, east, down, and 0, which
        makes a register of them. The last ones of an axis are the first ones again.
    period : float
        Of the first level [m].
    """
    source = np.random.PCG64(np.random.SeedSequence([seed, 2]))
    period = LENGTHS * max(length, vertical_length)
    levels = 1
    while period / RATIO ** (levels - 1) > HIGHEST * SHORTEST:
        levels += 1
    grids = aligned((levels, SIDE + BESIDE, SIDE + BESIDE, 4), float)
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
            grids[level, :SIDE, :SIDE, component] = real[0]
        grids[level, SIDE:] = grids[level, :BESIDE]
        grids[level, :, SIDE:] = grids[level, :, :BESIDE]
        _turn(grids[level], TURN_COSINES[level], TURN_SINES[level])
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
def _turn(grid, c, s):
    """Components along the axes of a level as those to the north and to the east."""
    for i in range(grid.shape[0]):
        for j in range(grid.shape[1]):
            a, b = grid[i, j, 0], grid[i, j, 1]
            grid[i, j, 0], grid[i, j, 1] = c * a - s * b, s * a + c * b


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
def sampled(grids, first, levels, period, x, y, memory):
    """Velocity at a point, and its derivatives.

    Parameters
    ----------
    grids : quads, shape (m, SIDE + BESIDE, SIDE + BESIDE)
    first, levels : int
        Levels that belong to the field.
    period : float
        Of the first of them [m].
    x, y : float
        Towards north and east in the field [m].
    memory : ndarray, shape (WEIGHTS, 4)

    Returns
    -------
    tuple of 3 lanes
        Components north, east, down (and 0), and their derivatives to the north and to the east [1/m].
    """
    value = zeros_like(grids[0, 0, 0])
    by_north, by_east = value, value
    for begin in range(0, levels, 4):
        set_weights(begin, period, x, y, memory, True)
        for k in range(min(4, levels - begin)):
            i, j, grid = cell(memory[CELL, k]), cell(memory[CELL + 1, k]), grids[first + begin + k]
            along = across = zeros_like(value)
            for m in range(4):
                row = grid[i + m]
                g0, g1, g2, g3 = row[j], row[j + 1], row[j + 2], row[j + 3]
                own = (memory[U, k] * g0 + memory[U + 1, k] * g1) + (memory[U + 2, k] * g2 + memory[U + 3, k] * g3)
                slope = (memory[U_SLOPE, k] * g0 + memory[U_SLOPE + 1, k] * g1) + (
                    memory[U_SLOPE + 2, k] * g2 + memory[U_SLOPE + 3, k] * g3
                )
                value = value + memory[T + m, k] * own
                along = along + memory[T_SLOPE + m, k] * own
                across = across + memory[T + m, k] * slope
            per_cell = SIDE / period * SCALES[begin + k]
            p, q = TURN_COSINES[begin + k] * per_cell, TURN_SINES[begin + k] * per_cell
            by_north = by_north + p * along
            by_north = by_north - q * across
            by_east = by_east + q * along
            by_east = by_east + p * across
    return value, by_north, by_east


@kernel
def sampled_value(grids, first, levels, period, x, y, memory):
    """Velocity alone, see `sampled`."""
    value = zeros_like(grids[0, 0, 0])
    for begin in range(0, levels, 4):
        set_weights(begin, period, x, y, memory, False)
        for k in range(min(4, levels - begin)):
            i, j, grid = cell(memory[CELL, k]), cell(memory[CELL + 1, k]), grids[first + begin + k]
            u0, u1, u2, u3 = memory[U, k], memory[U + 1, k], memory[U + 2, k], memory[U + 3, k]
            for m in range(4):
                row = grid[i + m]
                own = (u0 * row[j] + u1 * row[j + 1]) + (u2 * row[j + 2] + u3 * row[j + 3])
                value = value + memory[T + m, k] * own
    return value


@kernel
def set_weights(begin, period, x, y, memory, sloped):
    """Set cells and weights of a point on four levels at once, the levels in the lanes: those of CELL, T, U and slopes.

    The uniform cubic B-spline weighs four points along each axis of a level by how far the point is in its cell.
    """
    quads, group, per_cell = as_quads(memory), begin // 4, SIDE / period
    c, s = as_quads(TURN_COSINES_OF_FOUR)[group], as_quads(TURN_SINES_OF_FOUR)[group]
    scale = rounded(as_quads(SCALES_OF_FOUR)[group] * per_cell)
    p = rounded((rounded(c * x) + rounded(s * y)) * scale)
    q = rounded((rounded(c * y) - rounded(s * x)) * scale)
    whole_p, whole_q = floor(p), floor(q)
    quads[CELL], quads[CELL + 1] = whole_p, whole_q
    t, u = p - whole_p, q - whole_q
    for k in range(4):
        quads[T + k] = SPLINE[0, k] + t * (SPLINE[1, k] + t * (SPLINE[2, k] + t * SPLINE[3, k]))
        quads[U + k] = SPLINE[0, k] + u * (SPLINE[1, k] + u * (SPLINE[2, k] + u * SPLINE[3, k]))
        if sloped:
            quads[T_SLOPE + k] = SPLINE_SLOPES[0, k] + t * (SPLINE_SLOPES[1, k] + t * SPLINE_SLOPES[2, k])
            quads[U_SLOPE + k] = SPLINE_SLOPES[0, k] + u * (SPLINE_SLOPES[1, k] + u * SPLINE_SLOPES[2, k])


@kernel
def cell(whole):
    """First of the four points around a position in a cell of a number: within the side, and three more behind it."""
    return (int(whole) - 1) & LAST


@entry
def sample_field(grids, period, points, memory, out):
    """Components of a field at points, and their derivatives to the north and to the east, see `sampled`.

    Parameters
    ----------
    grids : ndarray, shape (m, SIDE + BESIDE, SIDE + BESIDE, 4)
    period : float
        [m]
    points : ndarray, shape (n, 2)
        [m]
    memory : ndarray, shape (WEIGHTS, 4)
    out : ndarray, shape (n, 4, 4)
        Output: velocity, derivatives, and the velocity once more, as it is without them.
    """
    levels, found = as_quads(grids), as_quads(out)
    for i in range(points.shape[0]):
        x, y = points[i, 0], points[i, 1]
        own = sampled(levels, 0, grids.shape[0], period, x, y, memory)
        alone = sampled_value(levels, 0, grids.shape[0], period, x, y, memory)
        found[i, 0], found[i, 1], found[i, 2], found[i, 3] = own[0], own[1], own[2], alone
