"""Random errors of a sensor: white noise, a bias for the flight, a bias that wanders, resolution.

Sources: IEEE Std 952-1997, annexes B and C (white noise as random walk of the integral, first-order Gauss-Markov
process); both are discretised exactly, so that their statistics do not depend on the rate.
"""

from __future__ import annotations  # `help` then shows types by their names

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sbs_sim.model.noise import normal

Array = NDArray[np.float64]

STREAM = 13  # number of a seed, beside those of turbulence and controllers
BLOCK = 64  # samples whose random numbers are drawn together


@dataclass(frozen=True)
class ErrorModel:
    """Errors of one axis of a sensor, in its unit.

    Attributes
    ----------
    noise : float
        Density N of the white noise [unit/sqrt(Hz)], one-sided with the sampling rate as band: a sample has the
        standard deviation N sqrt(rate), its mean over a time t N / sqrt(t).
    bias : float
        Standard deviation of the error that stays for the flight.
    instability : float
        Standard deviation of the bias that wanders, a stationary first-order Gauss-Markov process.
    correlation_time : float
        Of that [s]: its autocorrelation is instability^2 exp(-|lag| / correlation_time).
    resolution : float
        What is measured is rounded to multiples of it; 0 for none.
    """

    noise: float = 0.0
    bias: float = 0.0
    instability: float = 0.0
    correlation_time: float = 300.0
    resolution: float = 0.0

    def variance(self, rate: float) -> float:
        """Variance of a measurement at a rate [Hz], over all flights; rounding counts as uniform noise."""
        return self.noise**2 * rate + self.bias**2 + self.instability**2 + self.resolution**2 / 12.0

    @property
    def is_random(self) -> bool:
        """True if random numbers are needed."""
        return bool(self.noise or self.bias or self.instability)


class Errors:
    """Errors of all axes of a sensor in one flight.

    Sample number i is the same whether or not those before it were asked for.

    Parameters
    ----------
    axes : sequence of ErrorModel
    rate : float
        Samples per second [Hz].
    seed, sensor : int
        The same numbers for the same errors; sensors of one seed are independent.

    Attributes
    ----------
    variances : ndarray, shape (n,)
        See `ErrorModel.variance`.
    """

    def __init__(self, axes: Sequence[ErrorModel], rate: float, seed: int, sensor: int) -> None:
        self.variances = np.array([axis.variance(rate) for axis in axes])
        self._random = any(axis.is_random for axis in axes)
        self._resolution = np.array([axis.resolution for axis in axes])
        self._white = np.array([axis.noise * math.sqrt(rate) for axis in axes])
        steps = np.array([1.0 / (rate * axis.correlation_time) for axis in axes])
        spread = np.array([axis.instability for axis in axes])
        self._decay, self._kick = np.exp(-steps), spread * np.sqrt(-np.expm1(-2.0 * steps))
        self._source = np.random.PCG64(np.random.SeedSequence([seed, STREAM, sensor]))
        self._next, self._drawn = 0, np.empty((0, len(axes), 2))
        first = normal(self._source, len(axes)) if self._random else np.zeros((len(axes), 2))
        self._bias = np.array([axis.bias for axis in axes]) * first[:, 0]
        self._wander = spread * first[:, 1]

    def measured(self, truth: Array, index: int) -> Array:
        """What is measured of a truth, shape (n,), by sample `index`, which is later than those before."""
        values = truth
        if self._random:
            while self._next <= index:
                white = self._advance()
            values = truth + (self._bias + self._wander + white)
        if self._resolution.any():
            steps = np.where(self._resolution > 0.0, self._resolution, 1.0)
            values = np.where(self._resolution > 0.0, steps * np.rint(values / steps), values)
        return values

    def _advance(self) -> Array:
        """White noise of the next sample, to which the wandering bias goes on."""
        place = self._next % BLOCK
        if place == 0:
            self._drawn = normal(self._source, BLOCK * len(self._bias)).reshape(BLOCK, -1, 2)
        if self._next:  # the first is drawn from the stationary distribution
            self._wander = self._decay * self._wander + self._kick * self._drawn[place, :, 1]
        self._next += 1
        return self._white * self._drawn[place, :, 0]
