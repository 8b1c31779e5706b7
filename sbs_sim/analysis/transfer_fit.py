"""Transfer functions with a delay, fitted to frequency responses (theory.md section 9.17).

M. B. Tischler, R. K. Remple, Aircraft and Rotorcraft System Identification, 2nd edition, AIAA, 2012, chapter 11: cost.
E. C. Levy, Complex-curve fitting, IRE Transactions on Automatic Control 4, 1959; C. K. Sanathanan, J. Koerner, Transfer
function synthesis as a ratio of two complex polynomials, IEEE Transactions on Automatic Control 8, 1963: first guess.
"""

from __future__ import annotations  # `help` then shows types by their names

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sbs_sim import checks
from sbs_sim.analysis.frequency_response import MAX_DELAY, FrequencyResponse
from sbs_sim.analysis.identification import DECIBEL, IdentifiedResponse
from sbs_sim.content import ByContent
from sbs_sim.errors import IdentificationError

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

MAX_ORDER = 12
GAIN_WEIGHT, PHASE_WEIGHT = 1.0, 0.01745  # of (dB)^2 and (deg)^2: 1 dB costs as much as 7.57 deg
COHERENCE_FACTOR = 1.58  # of 1 - exp(-coherence)
SCALE = 20.0
GUESS_DELAYS = (0.0, 0.02, 0.05, 0.1)  # s, from which fits begin
ROUNDS = 8  # of Sanathanan and Koerner
GOOD, USABLE = 50.0, 100.0  # costs below which a fit is good, or good enough for flight dynamics


@dataclass(frozen=True, eq=False)
class TransferFit(ByContent):
    """K (b_m s^m + ... + b_0) / (s^n + ... + a_0) exp(-delay s).

    Attributes
    ----------
    numerator : ndarray, shape (m + 1,)
        Highest power first, in the SI units of output over input.
    denominator : ndarray, shape (n + 1,)
        Highest power first; its first coefficient is 1.
    delay : float
        [s]
    cost : float
        Below 100 a fit is usable, below 50 it can hardly be told from the response in flight.
    range : (float, float)
        Frequencies that were fitted [rad/s].
    points : int
        How many there were.
    input_name, output_name : str
    """

    numerator: Array
    denominator: Array
    delay: float
    cost: float
    range: tuple[float, float]
    points: int
    input_name: str
    output_name: str

    @property
    def poles(self) -> ComplexArray:
        """[rad/s], slowest first."""
        return _sorted_roots(self.denominator)

    @property
    def zeros(self) -> ComplexArray:
        """[rad/s], slowest first."""
        return _sorted_roots(self.numerator)

    def at(self, frequencies: Any) -> ComplexArray:
        """Complex response at frequencies [rad/s]."""
        s = 1j * np.asarray(frequencies, float)
        ratio = np.polyval(self.numerator, s) / np.polyval(self.denominator, s)
        return np.asarray(ratio * np.exp(-s * self.delay), np.complex128)

    def to_dict(self) -> dict[str, Any]:
        """All as plain lists and numbers for JSON."""
        return {
            "input": self.input_name,
            "output": self.output_name,
            "numerator": self.numerator.tolist(),
            "denominator": self.denominator.tolist(),
            "delay": self.delay,
            "cost": self.cost,
            "range": list(self.range),
            "points": self.points,
        }


def _sorted_roots(polynomial: Array) -> ComplexArray:
    roots = np.roots(polynomial).astype(complex)
    return np.asarray(roots[np.lexsort((roots.imag, np.round(np.abs(roots), 9)))])


def cost(fitted: ComplexArray, response: ComplexArray, coherence: Array) -> float:
    """Tischler's cost of a fit, 20 / n times the sum of the weighted squares of dB and deg.

    Parameters
    ----------
    fitted, response : ndarray of complex, shape (n,)
    coherence : ndarray, shape (n,)
    """
    residuals = _residuals(fitted, response, coherence)
    return float(SCALE / len(response) * (residuals @ residuals))


def _residuals(fitted: ComplexArray, response: ComplexArray, coherence: Array) -> Array:
    """Weighted departures of gain and phase, shape (2 n,), the phases within half a turn."""
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = fitted / response
        gain = DECIBEL * np.log(np.maximum(np.abs(ratio), 1e-30))
    phase = np.degrees(np.angle(ratio))
    weight = COHERENCE_FACTOR * (1.0 - np.exp(-coherence))
    return np.concatenate([math.sqrt(GAIN_WEIGHT) * weight * gain, math.sqrt(PHASE_WEIGHT) * weight * phase])


def fit_transfer(
    found: IdentifiedResponse | FrequencyResponse,
    zeros: int,
    poles: int,
    *,
    low: float | None = None,
    high: float | None = None,
    delay: float | None = None,
    integrators: int = 0,
) -> TransferFit:
    """Fit a transfer function with a delay to a response where it is valid.

    Parameters
    ----------
    found : IdentifiedResponse or FrequencyResponse
        Of the latter every frequency counts alike.
    zeros, poles : int
        Orders of numerator and denominator; at most as many zeros as poles.
    low, high : float, optional
        Ends of the frequencies that count [rad/s]; by default of the widest valid range.
    delay : float, optional
        [s]; found by the fit if it is not given.
    integrators : int
        How many of the poles are at the origin.

    Raises
    ------
    IdentificationError
        Orders out of range, or fewer than as many frequencies as unknowns.
    """
    poles = checks.integer("poles", poles, 0, MAX_ORDER, IdentificationError)
    zeros = checks.integer("zeros", zeros, 0, poles, IdentificationError)
    integrators = checks.integer("integrators", integrators, 0, poles, IdentificationError)
    frequencies, response, coherence = _used(found, low, high)
    unknown = zeros + 1 + poles - integrators + (delay is None)
    if len(frequencies) < unknown:
        raise IdentificationError(
            f"{len(frequencies)} valid frequencies for {unknown} unknowns: allowed are at least as many"
        )
    if delay is not None:
        delay = checks.number("delay", delay, 0.0, MAX_DELAY, "s", IdentificationError)
    problem = _Problem(frequencies, response, coherence, zeros, poles, integrators, delay)
    numerator, denominator, late, least = problem.solved()
    described = found.response if isinstance(found, IdentifiedResponse) else found
    ends = float(frequencies[0]), float(frequencies[-1])
    names = described.input_name, described.output_name
    return TransferFit(numerator, denominator, late, least, ends, len(frequencies), *names)


def _used(
    found: IdentifiedResponse | FrequencyResponse, low: float | None, high: float | None
) -> tuple[Array, ComplexArray, Array]:
    """Frequencies, responses and coherences that count."""
    if isinstance(found, FrequencyResponse):
        described, coherence, ends = found, np.ones(len(found.frequencies)), (0.0, math.inf)
    else:
        described, coherence = found.response, found.coherence
        ends = found.valid_range or (math.inf, math.inf)
    low = ends[0] if low is None else low
    high = ends[1] if high is None else high
    inside = (described.frequencies >= low * (1.0 - 1e-9)) & (described.frequencies <= high * (1.0 + 1e-9))
    inside &= np.isfinite(described.response) & (np.abs(described.response) > 0.0) & np.isfinite(coherence)
    if isinstance(found, IdentifiedResponse):
        inside &= found.valid
    return described.frequencies[inside], described.response[inside], coherence[inside]


class _Problem:
    """A fit: frequencies in units of their middle, unknown coefficients of both polynomials and the delay."""

    def __init__(
        self,
        frequencies: Array,
        response: ComplexArray,
        coherence: Array,
        zeros: int,
        poles: int,
        integrators: int,
        delay: float | None,
    ) -> None:
        self._unit = math.sqrt(float(frequencies[0] * frequencies[-1]))
        self._size = float(np.exp(np.log(np.abs(response)).mean()))
        self._s = 1j * frequencies / self._unit
        self._response, self._coherence = response / self._size, coherence
        self._zeros, self._poles, self._integrators = zeros, poles, integrators
        self._delay = None if delay is None else delay * self._unit

    def solved(self) -> tuple[Array, Array, float, float]:
        """Polynomials and delay in SI units, and the cost, of the best of several beginnings."""
        from scipy.optimize import least_squares  # here: it takes a while, and few need it

        delays = [late * self._unit for late in GUESS_DELAYS] if self._delay is None else [self._delay]
        best = None
        for late in delays:
            guess = self._guess(late)
            low = np.full(len(guess), -np.inf)
            if self._delay is None:
                guess, low = np.append(guess, late), np.append(low, 0.0)
                guess[-1] = max(guess[-1], 1e-6)
            found = least_squares(self._departures, guess, bounds=(low, np.inf), x_scale="jac", max_nfev=400)
            if best is None or found.cost < best.cost:
                best = found
        assert best is not None
        numerator, denominator, late = self._parts(best.x)
        powers = self._unit ** np.arange(self._poles, -1.0, -1.0)
        own = self._unit ** np.arange(self._zeros, -1.0, -1.0)
        scale = self._unit**self._poles
        least = 2.0 * float(best.cost) * SCALE / len(self._response)
        return self._size * numerator / own * scale, denominator / powers * scale, late / self._unit, least

    def _parts(self, unknowns: Array) -> tuple[Array, Array, float]:
        """Numerator, denominator and delay."""
        numerator = unknowns[: self._zeros + 1]
        free = self._poles - self._integrators
        own = unknowns[self._zeros + 1 : self._zeros + 1 + free]
        denominator = np.concatenate([[1.0], own, np.zeros(self._integrators)])
        return numerator, denominator, float(unknowns[-1]) if self._delay is None else self._delay

    def _departures(self, unknowns: Array) -> Array:
        numerator, denominator, late = self._parts(unknowns)
        below = np.polyval(denominator, self._s)
        below = np.where(np.abs(below) > 1e-12, below, 1e-12)
        fitted = np.polyval(numerator, self._s) / below * np.exp(-self._s * late)
        return _residuals(fitted, self._response, self._coherence)

    def _guess(self, late: float) -> Array:
        """Coefficients by linear least squares, each round weighted with the denominator of the last one."""
        response = self._response * np.exp(self._s * late)
        weight = np.sqrt(self._coherence) / np.abs(response)
        above = self._s[:, None] ** np.arange(self._zeros, -1, -1)
        below = self._s[:, None] ** np.arange(self._poles - 1, self._integrators - 1, -1)
        wanted = response * self._s**self._poles
        found = np.zeros(above.shape[1] + below.shape[1])
        scale = np.ones(len(self._s))
        for _ in range(ROUNDS):
            rows = np.hstack([above, -response[:, None] * below]) * (weight * scale)[:, None]
            right = wanted * weight * scale
            found = np.linalg.lstsq(np.vstack([rows.real, rows.imag]), np.concatenate([right.real, right.imag]))[0]
            polynomial = np.concatenate([[1.0], found[self._zeros + 1 :], np.zeros(self._integrators)])
            scale = 1.0 / np.maximum(np.abs(np.polyval(polynomial, self._s)), 1e-9)
        return np.asarray(found, np.float64)
