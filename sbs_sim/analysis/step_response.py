"""Answers of a linear model to a step of a control, and what criteria read in them (theory.md section 9.13)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sbs_sim.content import ByContent

if TYPE_CHECKING:
    from sbs_sim.analysis.frequency_response import Actuator
    from sbs_sim.analysis.linear_loop import LinearLoop
    from sbs_sim.analysis.linear_model import LinearModel
    from sbs_sim.analysis.reduced import ReducedModel

Array = NDArray[np.float64]

SAMPLES = 400  # of a response
GOOD_FIT = (0.97, 1.03)
SLOWEST = 100.0  # time constant over the length of the response: beyond that it is a ramp


@dataclass(frozen=True, eq=False)
class FirstOrder(ByContent):
    """Fit of gain (1 - exp(-(t - delay) / time_constant)), zero before the delay.

    Attributes
    ----------
    gain : float
        Of the output by a unit step.
    time_constant, delay : float
        [s]
    determination : float
        Variance of the fit over that of the response; 1 for a perfect one.
    is_ramp : bool
        Whether the response does not settle; the time constant is then that of the end of the search.
    """

    gain: float
    time_constant: float
    delay: float
    determination: float
    is_ramp: bool = False

    @property
    def is_good(self) -> bool:
        """Whether ADS-33E-PRF takes the response for one of the first order."""
        return GOOD_FIT[0] <= self.determination <= GOOD_FIT[1]

    def at(self, times: Array) -> Array:
        """The fit."""
        return self.gain * _rise(times, self.time_constant, self.delay)


def step_response(
    model: LinearModel | LinearLoop | ReducedModel,
    input_name: str,
    outputs: Array,
    duration: float,
    delay: float = 0.0,
    actuator: Actuator | None = None,
) -> Array:
    """Outputs after a unit step of a control at time zero, all else held.

    Parameters
    ----------
    model : LinearModel, LinearLoop or ReducedModel
    input_name : str
        Of a control.
    outputs : ndarray, shape (o, n + m)
        Rows of them by states and controls, see `output_row`.
    duration : float
        [s]
    delay : float
        By which everything is late [s].
    actuator : Actuator, optional
        Between the control and the model.

    Returns
    -------
    ndarray, shape (o, 401)
        At times from 0 to the duration.
    """
    from scipy.linalg import expm

    size, column = len(model.a), model.control_names.index(input_name)
    lag = 0 if actuator is None else 2
    extended = np.zeros((size + lag + 1, size + lag + 1))  # the last is the step, that at `size` moves the model
    extended[:size, :size], extended[:size, size] = model.a, model.b[:, column]
    if actuator is not None:
        extended[size : size + 2, size:] = actuator.matrix
    step = duration / SAMPLES
    forward = expm(extended * step)
    states = np.zeros((SAMPLES + 1, size + lag + 1))
    states[:, -1] = 1.0
    first = math.ceil(delay / step - 1e-9)
    if first > SAMPLES:
        return np.zeros((len(outputs), SAMPLES + 1))
    states[first] = expm(extended * (first * step - delay))[:, -1]
    for i in range(first, SAMPLES):
        states[i + 1] = forward @ states[i]
    found = np.column_stack([outputs[:, :size], outputs[:, size + column]]) @ states[:, : size + 1].T
    found[:, :first] = 0.0
    return np.asarray(found)


def times(duration: float) -> Array:
    """Of a response, shape (401,) [s]."""
    return np.linspace(0.0, duration, SAMPLES + 1)


def output_row(model: LinearModel | LinearLoop | ReducedModel, name: str) -> Array:
    """Row of an output by states and controls, shape (n + m,)."""
    i = model.output_names.index(name)
    return np.concatenate([model.c[i], model.d[i]])


def first_order(response: Array, duration: float) -> FirstOrder:
    """Fit of a response to a unit step by a first-order lag behind a delay, in the sense of least squares.

    Parameters
    ----------
    response : ndarray, shape (401,)
    duration : float
        [s]

    Returns
    -------
    FirstOrder
        A time constant of 100 durations means a ramp.
    """
    from scipy.optimize import least_squares

    at = times(duration)
    scale = float(np.abs(response).max())
    if scale == 0.0:
        return FirstOrder(0.0, math.nan, math.nan, math.nan)
    wanted = response / scale

    def residuals(values: Array) -> Array:
        shape = _rise(at, math.exp(values[0]), values[1])
        return np.asarray(_gain(wanted, shape) * shape - wanted)

    low, high = [math.log(1e-4 * duration), 0.0], [math.log(SLOWEST * duration), 0.9 * duration]
    starts = [(math.log(share * duration), 0.01 * duration) for share in (0.01, 0.1, 1.0, 10.0)]
    best = min((least_squares(residuals, start, bounds=(low, high)) for start in starts), key=lambda found: found.cost)
    shape = _rise(at, math.exp(best.x[0]), best.x[1])
    gain = _gain(wanted, shape)
    spread = float(np.sum((wanted - wanted.mean()) ** 2))
    fitted = float(np.sum((gain * shape - wanted.mean()) ** 2))
    is_ramp = bool(best.x[0] > high[0] - 0.01)
    return FirstOrder(gain * scale, math.exp(best.x[0]), float(best.x[1]), fitted / spread, is_ramp)


def _gain(wanted: Array, shape: Array) -> float:
    """Gain with the least squares."""
    square = float(shape @ shape)
    return float(wanted @ shape) / square if square > 0.0 else 0.0


def _rise(at: Array, time_constant: float, delay: float) -> Array:
    return -np.expm1(-np.maximum(at - delay, 0.0) / time_constant)


def off_axis_ratio(off: Array, on: Array) -> float:
    """Peak of the other axis over the axis of the control at the end; not a number where that does not move."""
    return float(np.abs(off).max() / abs(on[-1])) if on[-1] != 0.0 else math.nan


def first_peak(response: Array, duration: float, otherwise_at: float) -> float:
    """First peak of the magnitude of a response, or its value at a time [s] if there is none until the end."""
    size = np.abs(response)
    inner = np.flatnonzero((size[1:-1] > size[:-2]) & (size[1:-1] >= size[2:])) + 1
    return float(response[inner[0]]) if len(inner) else float(np.interp(otherwise_at, times(duration), response))
