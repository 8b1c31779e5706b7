"""How a loop rejects a disturbance that is added to what it measures (theory.md section 9.18).

J. A. Blanken and others, Proposed ADS-33 guidance; T. Berger and others, Handling-qualities criteria for the rejection
of disturbances, 2016.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

HALF_POWER = 10.0 ** (-3.0 / 20.0)


@dataclass(frozen=True)
class Rejection:
    """Bandwidth and peak.

    Attributes
    ----------
    output_name : str
    bandwidth : float
        Lowest frequency at which what is left of the disturbance rises through -3 dB [rad/s]; not a number where it is
        nowhere below.
    peak : float
        Largest disturbed output over the disturbance [dB].
    peak_frequency : float
        [rad/s]
    """

    output_name: str
    bandwidth: float
    peak: float
    peak_frequency: float

    @property
    def remark(self) -> str:
        """Why there is no bandwidth; empty if there is one."""
        return "" if self.bandwidth == self.bandwidth else "a slow disturbance is not reduced by 3 dB"


def rejection(name: str, frequencies: Array, left: Array, exact: Callable[[float], float] | None = None) -> Rejection:
    """Bandwidth and peak of what is left of a disturbance.

    Parameters
    ----------
    name : str
        Of what is measured.
    frequencies : ndarray, shape (n,)
        Rising [rad/s].
    left : ndarray, shape (n,)
        Magnitude of the disturbed output over the disturbance there.
    exact : callable, optional
        Gives it at any frequency: both are then exact to rounding. Without it the bandwidth is interpolated, decibels
        over the logarithm of the frequency, and the peak is that of the given frequencies.
    """
    rises = np.flatnonzero((left[:-1] < HALF_POWER) & (left[1:] >= HALF_POWER))
    top, w = int(left.argmax()), np.log(frequencies)
    bandwidth = math.nan if not len(rises) else _crossing(w, left, int(rises[0]), exact)
    peak, at = float(left[top]), float(w[top])
    if exact is not None:
        peak, at = _summit(exact, float(w[max(top - 1, 0)]), float(w[min(top + 1, len(w) - 1)]), peak, at)
    return Rejection(name, bandwidth, 20.0 * math.log10(peak), math.exp(at))


def _crossing(w: Array, left: Array, i: int, exact: Callable[[float], float] | None) -> float:
    """Frequency at which -3 dB are crossed behind a logarithm of the frequency, number i [rad/s]."""
    if exact is None:
        low, high = np.log(np.maximum(left[i : i + 2], np.finfo(float).tiny))
        return math.exp(float(w[i] + (math.log(HALF_POWER) - low) / (high - low) * (w[i + 1] - w[i])))
    from scipy.optimize import brentq

    return math.exp(brentq(lambda at: exact(math.exp(at)) - HALF_POWER, w[i], w[i + 1], xtol=1e-12))


def _summit(exact: Callable[[float], float], low: float, high: float, peak: float, at: float) -> tuple[float, float]:
    """Largest magnitude between two logarithms of the frequency, at least the known one, and where it is."""
    from scipy.optimize import minimize_scalar

    best = minimize_scalar(lambda x: -exact(math.exp(x)), bounds=(low, high), method="bounded", options={"xatol": 1e-9})
    return max((peak, at), (-float(best.fun), float(best.x)))
