"""Cubic polynomials between points, of given or of monotone slopes.

F. N. Fritsch, R. E. Carlson: Monotone piecewise cubic interpolation, SIAM J. Numer. Anal. 17 (2), 1980.
"""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def bounded_slopes(before: Array, width_before: Array, after: Array, width: Array) -> Array:
    """Slopes at points between two intervals, with which the curve rises or falls wherever the points do.

    That of the parabola through three points, but not more than three times the smaller slope beside it: section 4 of
    Fritsch and Carlson. Zero at a maximum or minimum.

    Parameters
    ----------
    before, after : ndarray
        Slopes of the lines to the point and from it.
    width_before, width : ndarray
        Of their intervals.
    """
    limit = 3.0 * np.minimum(np.abs(before), np.abs(after))
    mean = (width * before + width_before * after) / (width_before + width)
    limited = np.where(np.abs(mean) > limit, np.copysign(limit, mean), mean)
    return np.where(before * after > 0.0, limited, 0.0)


def pieces(x: Array, y: Array, slope: Array) -> Array:
    """Coefficients of (x - x_k)^0 to ^3 from each point to the next, shape (n - 1, 4), of values and slopes (n,)."""
    width = np.diff(x)
    secant = np.diff(y) / width
    square = (3.0 * secant - 2.0 * slope[:-1] - slope[1:]) / width
    cube = (slope[:-1] + slope[1:] - 2.0 * secant) / (width * width)
    return np.stack([y[:-1], slope[:-1], square, cube], axis=1)
