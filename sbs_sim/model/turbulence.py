"""Turbulence as filtered noise with scale lengths of its own for each component, and the rotation of the air.

Dryden's spectra, or rational approximations to von Karman's, of MIL-F-8785C and MIL-HDBK-1797 (theory.md section 7.4).
Both specifications have the same spectra: what MIL-HDBK-1797 calls L_v and L_w is half of what MIL-F-8785C does, and
here. All filters are sampled exactly at every tick, whatever its length.

C. W. Campbell: Monte Carlo turbulence simulation using rational approximations to von Karman spectra, AIAA Journal 24
(1), 1986: (1 + s)^(-5/6) by its Pade approximant of orders 2 and 3.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sbs_sim.model.air_field import KARMAN, VON_KARMAN
from sbs_sim.model.elementary import cosine_and_sine, exponential, power
from sbs_sim.model.kernel import entry
from sbs_sim.model.noise import normal
from sbs_sim.model.solve import product

Array = NDArray[np.float64]

Polynomials = tuple[tuple[float, ...], tuple[float, ...]]  # numerator and denominator: coefficients of 1, s, s^2, ...

PADE: Polynomials = (60.0, 52.0, 91.0 / 12.0), (60.0, 102.0, 561.0 / 12.0, 935.0 / 216.0)
DRYDEN_ALONG: Polynomials = (math.sqrt(2.0),), (1.0, 1.0)
DRYDEN_ACROSS: Polynomials = (1.0, math.sqrt(3.0)), (1.0, 2.0, 1.0)
STATES = 5  # at most, of a component
NUMBERS = 3 * STATES + 1  # normal numbers of a tick: of the components, and of the roll rate
SMALL = 0.25  # norm of a step for whose exponential a series is used
SERIES = 16  # its terms, whose next one is 1e-24
DOUBLINGS = 80  # from a step to the stationary state; fewer where that is reached
PITCH_LAG, ROLL_LAG, YAW_LAG = 4.0 / math.pi, 4.0 / math.pi, 3.0 / math.pi  # spans


class Component(NamedTuple):
    """A component in discrete time: states x <- transition x + factor noise, velocity and rate by rows."""

    transition: Array
    factor: Array
    start: Array
    velocity: Array
    rate: Array


class FilteredTurbulence:
    """Turbulence at ticks.

    Parameters
    ----------
    model : str
        "dryden" or "von_karman".
    sigmas, lengths : tuple of 3 floats
        Standard deviations [m/s] and scale lengths [m] along the direction of passing, across it, and down.
    airspeed : float
        Speed of passing [m/s].
    direction : float
        Heading of the first component [rad].
    span : float
        b of the rates p_g, q_g, r_g [m]; 0 for none.
    seed : int
    tick : float
        [s]
    """

    def __init__(
        self,
        model: str,
        sigmas: tuple[float, float, float],
        lengths: tuple[float, float, float],
        airspeed: float,
        direction: float,
        span: float,
        seed: int,
        tick: float,
    ) -> None:
        self._noise = np.random.PCG64(np.random.SeedSequence([seed, 1]))
        karman = model == VON_KARMAN
        parts = [
            component(karman, i == 0, sigmas[i], lengths[i], airspeed, lag * span, tick)
            for i, lag in enumerate((0.0, YAW_LAG, PITCH_LAG))
        ]
        self._arrays = tuple(np.array([_padded(getattr(part, name)) for part in parts]) for name in Component._fields)
        roll, decay = 0.0, 0.0
        if span > 0.0:
            roll = math.sqrt(roll_variance(sigmas[2], lengths[2], span))
            decay = exponential(-tick * airspeed / (ROLL_LAG * span))
        cosine, sine = cosine_and_sine(direction)
        self._roll = np.array([roll, decay, roll * math.sqrt(1.0 - decay * decay), cosine, sine])
        numbers = normal(self._noise, NUMBERS // 2).ravel()
        self._states = np.zeros(NUMBERS)
        _start(self._arrays[2], roll, numbers, self._states)

    def advance(self, count: int) -> tuple[Array, Array]:
        """Go on by some ticks; velocity [m/s] and angular velocity [rad/s] of the air, NED, (count + 1, 3) each."""
        velocities, rates = np.empty((count + 1, 3)), np.empty((count + 1, 3))
        numbers = normal(self._noise, count * NUMBERS // 2).reshape(count, NUMBERS)
        transition, factor, _, velocity, rate = self._arrays
        _advance(transition, factor, velocity, rate, self._roll, numbers, self._states, velocities, rates)
        return velocities, rates


def roll_variance(sigma: float, length: float, span: float) -> float:
    """Variance of p_g [rad^2/s^2]: the integral of its spectrum in MIL-F-8785C, section 3.7.2."""
    share = power(math.pi * length / (4.0 * span), 1.0 / 3.0)
    return 0.8 * sigma * sigma / length * share * (math.pi * math.pi / (8.0 * span))


def component(
    karman: bool, along: bool, sigma: float, length: float, airspeed: float, lag: float, tick: float
) -> Component:
    """Filter of a component in discrete time.

    Parameters
    ----------
    karman, along : bool
    sigma, length : float
        [m/s], [m]
    airspeed : float
        [m/s]
    lag : float
        Length of the filter of its rate [m]; 0 for no rate.
    tick : float
        [s]
    """
    if karman:
        scale = KARMAN * length
        numerator, denominator = PADE
        gain = sigma * math.sqrt((2.0 if along else 1.0) / KARMAN)
        if not along:
            numerator = _polynomial_product(numerator, (1.0, math.sqrt(8.0 / 3.0)))
            denominator = _polynomial_product(denominator, (1.0, 1.0))
    else:
        scale, gain = length, sigma
        numerator, denominator = DRYDEN_ALONG if along else DRYDEN_ACROSS
    return discretised(numerator, denominator, gain, scale, lag, tick * airspeed / scale)


def discretised(
    numerator: tuple[float, ...], denominator: tuple[float, ...], gain: float, scale: float, lag: float, step: float
) -> Component:
    """Filter driven by white noise of unit density, in steps of time in units of scale / airspeed.

    Its rate is (s / V) / (1 + lag s / V) of the velocity, by one more state that lags behind the velocity.
    """
    order = len(denominator) - 1
    size = order + 1 if lag > 0.0 else order
    a = np.eye(size, k=1)
    a[order - 1 :] = 0.0
    a[order - 1, :order] = -np.array(denominator[:-1]) / denominator[-1]
    velocity, rate = np.zeros(size), np.zeros(size)
    velocity[: len(numerator)] = np.array(numerator) / denominator[-1]
    if lag > 0.0:
        share = scale / lag
        a[order, :order], a[order, order] = share * velocity[:order], -share
        rate[:order], rate[order] = velocity[:order] / lag, -1.0 / lag
    drive = np.zeros((size, size))
    drive[order - 1, order - 1] = 1.0
    transition, noise = exact_step(a, drive, step)
    start = _stationary(transition, noise)
    return Component(transition, _cholesky(noise), _cholesky(start), gain * velocity, gain * rate)


def exact_step(a: Array, drive: Array, step: float) -> tuple[Array, Array]:
    """Transition exp(a h) over a step h, and the covariance that noise of density `drive` adds in it.

    From a series for a small step, doubled as often as it takes. C. F. Van Loan: Computing integrals involving the
    matrix exponential, IEEE Transactions on Automatic Control 23 (3), 1978, gives the covariance as a product.
    """
    size = len(a)
    norm, halvings = step * float(np.abs(a).sum(axis=1).max()), 0
    while norm > SMALL:
        norm, halvings = 0.5 * norm, halvings + 1
    h = step / 2.0**halvings
    block = np.block([[-h * a, h * drive], [np.zeros((size, size)), h * a.T]])
    power_of_block = total = np.eye(2 * size)
    for k in range(1, SERIES):
        power_of_block = product(power_of_block, block) / k
        total = total + power_of_block
    transition = total[size:, size:].T
    noise = product(transition, total[:size, size:])
    for _ in range(halvings):
        transition, noise = _doubled(transition, noise)
    return transition, noise


def _stationary(transition: Array, noise: Array) -> Array:
    for _ in range(DOUBLINGS):
        if np.abs(transition).max() < 1e-20:
            break
        transition, noise = _doubled(transition, noise)
    return noise


def _doubled(transition: Array, noise: Array) -> tuple[Array, Array]:
    more = product(product(transition, noise), transition.T)
    return product(transition, transition), noise + more


def _cholesky(matrix: Array) -> Array:
    """Lower factor of a symmetric matrix; what is lost in rounding of its diagonal counts as zero."""
    size = len(matrix)
    factor = np.zeros((size, size))
    for i in range(size):
        for j in range(i + 1):
            rest = matrix[i, j]
            for k in range(j):
                rest -= factor[i, k] * factor[j, k]
            if i == j:
                factor[i, i] = math.sqrt(max(0.0, rest))
            elif factor[j, j] > 0.0:
                factor[i, j] = rest / factor[j, j]
    return factor


def _polynomial_product(a: tuple[float, ...], b: tuple[float, ...]) -> tuple[float, ...]:
    """Coefficients of the product of two polynomials."""
    found = [0.0] * (len(a) + len(b) - 1)
    for i, x in enumerate(a):
        for j, y in enumerate(b):
            found[i + j] += x * y
    return tuple(found)


def _padded(values: Array) -> Array:
    """Numbers with zeros for the states that are not there."""
    return np.pad(values, [(0, STATES - size) for size in values.shape])


@entry
def _start(starts, roll, numbers, states):
    """Set the states to what they are when the field has long been there."""
    for c in range(3):
        for i in range(STATES):
            total = 0.0
            for j in range(STATES):
                total += starts[c, i, j] * numbers[c * STATES + j]
            states[c * STATES + i] = total
    states[3 * STATES] = roll * numbers[3 * STATES]


@entry
def _advance(transition, factor, velocity, rate, roll, numbers, states, velocities, rates):
    """Filter the noise of `FilteredTurbulence.advance`, which goes on from `states` and changes them."""
    size = transition.shape[1]
    _, decay, spread, cosine, sine = roll[0], roll[1], roll[2], roll[3], roll[4]
    for tick in range(velocities.shape[0]):
        u = v = w = along_v = along_w = 0.0
        for i in range(size):
            u += velocity[0, i] * states[i]
            v += velocity[1, i] * states[size + i]
            w += velocity[2, i] * states[2 * size + i]
            along_v += rate[1, i] * states[size + i]
            along_w += rate[2, i] * states[2 * size + i]
        # what passes first has been met last: d/dx of the field is d/dt over V
        p, q, r = states[3 * size], -along_w, along_v
        velocities[tick, 0], velocities[tick, 1] = cosine * u - sine * v, sine * u + cosine * v
        velocities[tick, 2] = w
        rates[tick, 0], rates[tick, 1], rates[tick, 2] = cosine * p - sine * q, sine * p + cosine * q, r
        if tick == numbers.shape[0]:
            break
        for c in range(3):
            first = c * size
            for i in range(size - 1, -1, -1):
                total = 0.0
                for j in range(size):
                    total += transition[c, i, j] * states[first + j]
                for j in range(i + 1):
                    total += factor[c, i, j] * numbers[tick, first + j]
                numbers[tick, first + i] = total
            for i in range(size):
                states[first + i] = numbers[tick, first + i]
        states[3 * size] = decay * states[3 * size] + spread * numbers[tick, 3 * size]
