"""Spectra of several signals at once, by Welch's averages or the chirp-z transform (theory.md section 9.16).

P. D. Welch, The use of fast Fourier transform for the estimation of power spectra, IEEE Transactions on Audio and
Electroacoustics 15, 1967. J. S. Bendat and A. G. Piersol, Random Data, 4th edition, 2010.
"""

from __future__ import annotations  # `help` then shows types by their names

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sbs_sim.content import ByContent

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

WELCH, CHIRP_Z = METHODS = ("welch", "chirp_z")
TAPER = "hann"
OVERLAP = 0.75  # of successive segments
CYCLES = 2.0  # least in a segment, of a frequency that it is used for
FINE = 4  # values of the chirp-z transform for one of the discrete Fourier transform
TURN = 2.0 * math.pi


@dataclass(frozen=True, eq=False)
class Spectra(ByContent):
    """Spectral matrices of signals.

    Attributes
    ----------
    frequencies : ndarray, shape (f,)
        [rad/s]
    matrices : ndarray of complex, shape (f, n, n)
        One-sided densities over frequency in Hz: element i, j is the mean of conj(Z_i) Z_j. Not a number at
        frequencies with less than two cycles in a segment.
    averages : float
        Independent segments that have the variance of the averages of the overlapping ones.
    window : float
        Length of a segment [s].
    """

    frequencies: Array
    matrices: ComplexArray
    averages: float
    window: float


def spectra(
    values: Array, tick: float, frequencies: Array, window: float, method: str = CHIRP_Z, overlap: float = OVERLAP
) -> Spectra:
    """Spectral matrices of signals from overlapping segments with Hann's window.

    Half a window of zeros is put before and behind the record, or the ends of an excitation would only be seen through
    the flanks of windows, where an output that comes later has another weight than its input. Records are to begin and
    end near rest.

    Parameters
    ----------
    values : ndarray, shape (n, samples)
    tick : float
        Between samples [s].
    frequencies : ndarray, shape (f,)
        Rising [rad/s].
    window : float
        Length of a segment [s], from 8 ticks to the whole record.
    method : str
        "welch": at the multiples of one over the window; "chirp_z": at four times as many. Between them the
        matrices are interpolated, which keeps coherences within 0 and 1.
    overlap : float
        Of successive segments, 0 to 0.95 of their length.
    """
    count = min(max(round(window / tick), 8), values.shape[1])
    hop = max(1, round(count * (1.0 - overlap)))
    hertz = frequencies / TURN
    padded = np.pad(values, ((0, 0), (count // 2, count // 2 + hop)))
    grid, found = (_welch if method == WELCH else _chirp_z)(padded, tick, count, hop, hertz)
    matrices = _between(grid, found, hertz)
    matrices[hertz * count * tick < CYCLES * (1.0 - 1e-9)] = np.nan
    return Spectra(frequencies, matrices, averages(values.shape[1], count, hop), count * tick)


def _taper(count: int) -> Array:
    from scipy.signal import get_window  # here: it takes a while, and few need it

    return np.asarray(get_window(TAPER, count))


def _welch(values: Array, tick: float, count: int, hop: int, _: Array) -> tuple[Array, ComplexArray]:
    from scipy.signal import csd

    options = {"fs": 1.0 / tick, "window": TAPER, "nperseg": count, "noverlap": count - hop, "detrend": False}
    grid, found = csd(values[:, None, :], values[None, :, :], **options)
    matrices: ComplexArray = np.moveaxis(np.asarray(found), -1, 0).astype(np.complex128)
    return np.asarray(grid), matrices


def _chirp_z(values: Array, tick: float, count: int, hop: int, hertz: Array) -> tuple[Array, ComplexArray]:
    from scipy.signal import ZoomFFT

    fine = FINE * count * tick  # values for 1 Hz
    first, last = math.floor(hertz[0] * fine), math.ceil(hertz[-1] * fine)
    grid = np.arange(first, last + 2) / fine
    transform = ZoomFFT(count, [grid[0], grid[-1]], len(grid), fs=1.0 / tick, endpoint=True)
    taper, total = _taper(count), np.zeros((len(grid), len(values), len(values)), complex)
    begins = range(0, values.shape[1] - count + 1, hop)
    for begin in begins:
        found = transform(taper * values[:, begin : begin + count])
        total += np.einsum("if,jf->fij", found.conj(), found)
    found = total * (2.0 * tick / (len(begins) * float(taper @ taper)))
    return grid, np.asarray(found, np.complex128)


def _between(grid: Array, found: ComplexArray, hertz: Array) -> ComplexArray:
    """Matrices at frequencies between those of a grid."""
    right = np.clip(np.searchsorted(grid, hertz), 1, len(grid) - 1)
    share = np.clip((hertz - grid[right - 1]) / (grid[right] - grid[right - 1]), 0.0, 1.0)[:, None, None]
    return np.asarray((1.0 - share) * found[right - 1] + share * found[right])


def averages(samples: int, count: int, hop: int) -> float:
    """Independent segments that have the variance of the average of overlapping ones (Welch 1967, for white noise).

    For Hann's window those are 1.89 times as many as fit into the record side by side for an overlap of a half, 2.08
    times for three quarters.

    Parameters
    ----------
    samples, count, hop : int
        Of the record, of a segment, from one segment to the next.
    """
    taper = _taper(count)
    shifts = range(hop, count, hop)
    alike = [float(taper[shift:] @ taper[: count - shift]) / float(taper @ taper) for shift in shifts]
    return samples / hop / (1.0 + 2.0 * sum(value**2 for value in alike))


def windows_of(duration: float, low: float, high: float, count: int = 5) -> tuple[float, ...]:
    """Lengths of segments for a range of frequencies, the longest first [s].

    The longest is a third of the record, or ten cycles of the lowest frequency if that is shorter; the shortest has
    twenty cycles of the highest frequency, and is at least an eighth of the longest.

    Parameters
    ----------
    duration : float
        Of the record [s].
    low, high : float
        [rad/s]
    count : int
        How many.
    """
    longest = min(duration / 3.0, 10.0 * TURN / low)
    shortest = min(max(20.0 * TURN / high, longest / 8.0), longest / 1.5)
    return tuple(float(length) for length in np.geomspace(longest, shortest, count))


def merged(every: Sequence[Spectra], weights: Array) -> tuple[ComplexArray, Array]:
    """Weighted means of matrices of several windows, and of their averages.

    Parameters
    ----------
    every : sequence of Spectra
        Of the same signals and frequencies.
    weights : ndarray, shape (windows, f)
        With the sum 1 at each frequency, or 0 where no window has it.

    Returns
    -------
    matrices : ndarray of complex, shape (f, n, n)
    averages : ndarray, shape (f,)
        Such that the variance is not less than that of the mean: the windows are of the same record.
    """
    total = np.zeros_like(every[0].matrices)
    inverse = np.zeros(weights.shape[1])
    for own, share in zip(every, weights, strict=True):
        total += np.where(share[:, None, None] > 0.0, share[:, None, None] * own.matrices, 0.0)
        inverse += share / own.averages
    missing = weights.sum(axis=0) == 0.0
    total[missing] = np.nan
    with np.errstate(divide="ignore"):
        return total, np.where(missing, np.nan, 1.0 / inverse)
