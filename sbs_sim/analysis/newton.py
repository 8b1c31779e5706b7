"""Newton's method with central differences and halved steps, for a few dozen unknowns of order one or less.

A Jacobian costs as much as some dozens of residuals, so it is kept as long as it serves.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sbs_sim.concurrency import interruption
from sbs_sim.content import ByContent
from sbs_sim.model.solve import length, smallest, solve

Array = NDArray[np.float64]
Equations = Callable[[Array], Array]

TOLERANCE = 1e-11  # of the largest residual, which is to be scaled to the order of one
MAX_ITERATIONS = 30
DIFFERENCE_STEP = 1e-6
GOOD_ENOUGH = 0.1  # a step that leaves less of the residual is followed by another with the same Jacobian
OPEN = 1e-10  # of the largest singular value: directions in which differences of 1e-6 cannot see a slope
MAX_UNKNOWN = math.pi / 2  # angles and inflow ratios beyond it make no sense


@dataclass(frozen=True, eq=False)
class Solution(ByContent):
    """Where Newton's method has ended.

    Attributes
    ----------
    values, residual : ndarray, shape (n,)
        Unknowns and what is left of the equations there.
    iterations : int
    converged : bool
    """

    values: Array
    residual: Array
    iterations: int
    converged: bool


def newton(equations: Equations, start: Array, jacobian: Equations | None = None) -> Solution:
    """Solve equations(values) = 0 with halved steps where a full one does not lessen the residual.

    Parameters
    ----------
    equations : callable
        Residuals, shape (n,), of the unknowns, shape (n,).
    start : ndarray, shape (n,)
    jacobian : callable, optional
        Derivative of the residuals by the unknowns, shape (n, n), of these; by central differences if not given.
    """
    slope = jacobian or (lambda values: _jacobian(equations, values))
    values, residual, matrix = start, equations(start), None
    for iteration in range(MAX_ITERATIONS):
        interruption.look()
        size = float(np.abs(residual).max())
        if size < TOLERANCE:
            return Solution(values, residual, iteration, True)
        fresh = matrix is None
        if matrix is None:
            matrix = slope(values)
        step = _step(matrix, residual)
        better = _descend(equations, values, step, residual, 8 if fresh else 1)
        if better is None and not fresh:
            matrix = None
            continue
        if better is None:
            if size < 100 * TOLERANCE:  # rounding has stopped it, not the equations
                return Solution(values, residual, iteration, True)
            break
        left = float(np.abs(better[1]).max())
        if left > 0.5 * size and size < 100 * TOLERANCE:  # and rounding again
            return Solution(*better, iteration + 1, True)
        if left > GOOD_ENOUGH * size:
            matrix = None
        values, residual = better
    return Solution(values, residual, iteration + 1, False)


def _step(matrix: Array, residual: Array) -> Array:
    """Newton's step; the smallest of all where the equations leave a direction open, which then moves nothing."""
    try:
        step = solve(matrix, residual)
        if np.abs(step).max() < MAX_UNKNOWN or not np.isfinite(matrix).all():
            return step
    except np.linalg.LinAlgError:
        pass
    return smallest(matrix, residual, OPEN)


def _jacobian(equations: Equations, values: Array) -> Array:
    """Derivative of the residuals by central differences."""
    columns = []
    for i in range(len(values)):
        forward, backward = values.copy(), values.copy()
        forward[i] += DIFFERENCE_STEP
        backward[i] -= DIFFERENCE_STEP
        columns.append((equations(forward) - equations(backward)) / (2 * DIFFERENCE_STEP))
    return np.stack(columns, axis=1)


def _descend(
    equations: Equations, values: Array, step: Array, residual: Array, halvings: int
) -> tuple[Array, Array] | None:
    """Unknowns and residual after the longest of the steps 1, 1/2, 1/4 ... that lessens it; None if none does."""
    size = length(residual)
    for halving in range(halvings):
        candidate = values - step / 2**halving
        if np.abs(candidate).max() < MAX_UNKNOWN:
            new = equations(candidate)
            if length(new) < size:  # false for a NaN as well
                return candidate, new
    return None
