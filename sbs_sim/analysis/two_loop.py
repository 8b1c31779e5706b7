"""Trim by the paper's two nested loops (paper section 2.2, steps (a) to (h); theory.md section 8).

The outer loop settles the blades at every azimuth configuration and averages their multiblade coordinates; the inner
loop balances the body with the blades held on those and lets the inflow follow. In hover and vertical flight that
ends where Newton's method ends. But the outer loop multiplies some departures from the trim by -5 or more, and with
cyclic inflow the inner loop, too, has a gain beyond one from 3 m/s on: the loops find what never excites these. They
stop with an error where the changes grow.
"""

import math

import numpy as np
from numpy.typing import NDArray

from sbs_sim.analysis.newton import Equations, newton
from sbs_sim.analysis.trim_guess import DIGITS
from sbs_sim.analysis.trim_problem import BODY_UNKNOWNS, TrimProblem
from sbs_sim.errors import TrimError
from sbs_sim.flight.trim_point import TrimCondition
from sbs_sim.model.average import azimuths
from sbs_sim.model.solve import solve
from sbs_sim.model.steady import steady_balance

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]

TOLERANCE = 1e-6  # of both loops: largest change of an unknown, relative to its size or to SMALL
SMALL = 0.01  # rad, or inflow over tip speed: what counts as the size of smaller unknowns
RELAXATION = 0.5  # share of the way to the steady inflow
MAX_OUTER_ITERATIONS, MAX_INNER_ITERATIONS = 30, 100
GUESSED = 2  # outer iterations whose changes are those of the first guess: from then on they are to shrink
# What the complete equations may leave where the loops come to rest. The balance of blades that do not vibrate is not
# quite the mean of vibrating ones: 1.5e-3 at 15 m/s. The stalled flights at which the loops may end leave 8e-3 to 0.4.
MAX_RESIDUAL = 3e-3


def solve_by_two_loops(problem: TrimProblem, condition: TrimCondition, start: Array) -> tuple[Array, int, int]:
    """Trim by nested loops from a first guess (a).

    Parameters
    ----------
    problem : TrimProblem
    condition : TrimCondition
    start : ndarray, shape (n,)
        Unknowns in the order of the problem.

    Returns
    -------
    unknowns : ndarray, shape (n,)
    outer, inner : int
        Iterations of the outer loop, and of the inner one in all.

    Raises
    ------
    TrimError
        The loops diverge, do not end, or end where the complete equations are not fulfilled: the message holds the
        iterations, the last change of the flap and lag coordinates, and the complete equations' last residual.
    """
    loops = _TwoLoops(problem, condition, start)
    loops.run()
    return loops.unknowns, loops.outer, loops.inner


class _TwoLoops:
    """State of the loops: the unknowns, and what an error says about them.

    Equations and unknowns of the problem have the same order: accelerations of the body and attitude with controls,
    accelerations of the multiblade coordinates and these, inflow rates and inflow. So each block is solved for the
    unknowns with the same indices, with all others held.
    """

    def __init__(self, problem: TrimProblem, condition: TrimCondition, start: Array) -> None:
        self.unknowns = start.round(DIGITS)  # without rounding errors, which the outer loop multiplies
        self.outer = self.inner = 0
        self.change = math.inf
        self._problem, self._condition = problem, condition
        self._body = np.arange(BODY_UNKNOWNS)
        self._coordinates, self._inflow = problem.coordinates, problem.inflow
        self._azimuths = azimuths(problem.aircraft.passages, problem.fidelity.azimuth_count)
        self._inverse_inertia = solve(problem.aircraft.body.inertia, np.eye(3))

    def run(self) -> None:
        """Iterate until the coordinates do not change any more."""
        while True:
            self.outer += 1
            before, last_change = self.unknowns, self.change
            self._settle_blades()
            self.change = _relative_change(before[self._coordinates], self.unknowns[self._coordinates])
            if self.outer > GUESSED and self.change > last_change:
                raise self._failure("the outer loop diverges")
            self._balance_body()
            if self.change < TOLERANCE:
                break
            if self.outer == MAX_OUTER_ITERATIONS:
                raise self._failure("the outer loop does not end")
        if not np.abs(self._problem.residual(self._condition, self.unknowns)).max() < MAX_RESIDUAL:
            raise self._failure("the loops come to rest off trim")

    def _settle_blades(self) -> None:
        """(b) to (d): coordinates whose accelerations vanish, azimuth by azimuth, and their mean."""
        found = []
        for psi in self._azimuths:

            def at_azimuth(unknowns: Array, psi: Array = psi) -> Array:
                return self._steady_residuals(unknowns, psi[np.newaxis])[0]

            found.append(self._solved(at_azimuth, self._coordinates, "the blades find no steady motion"))
        self.unknowns = np.mean(found, axis=0)

    def _balance_body(self) -> None:
        """(e) to (h): attitude, controls and inflow at held coordinates."""
        for _ in range(MAX_INNER_ITERATIONS):
            before = self.unknowns
            self.inner += 1
            self.unknowns = self._solved(self._mean_residual, self._body, "no controls balance the body")
            steady = self._solved(self._mean_residual, self._inflow, "there is no steady inflow")
            self.unknowns = self.unknowns + RELAXATION * (steady - self.unknowns)
            if _relative_change(before, self.unknowns) < TOLERANCE:
                return
        raise self._failure("the inner loop does not end")

    def _solved(self, residual: Equations, block: IntArray, otherwise: str) -> Array:
        """Unknowns with those of one block such that its equations are fulfilled; Newton's method."""

        def equations(values: Array) -> Array:
            moved = self.unknowns.copy()
            moved[block] = values
            return residual(moved)[block]

        solution = newton(equations, self.unknowns[block])
        if not solution.converged:
            raise self._failure(otherwise)
        solved = self.unknowns.copy()
        solved[block] = solution.values
        return solved

    def _mean_residual(self, unknowns: Array) -> Array:
        """Mean of `_steady_residuals` over the configurations (f)."""
        return np.asarray(np.mean(self._steady_residuals(unknowns, self._azimuths), axis=0))

    def _steady_residuals(self, unknowns: Array, psi: Array) -> Array:
        """Scaled residuals of steady flight at azimuths, shape (k, n): the body's as accelerations of a rigid one."""
        problem, engine = self._problem, self._problem.engine
        x, swash = problem.state(self._condition, unknowns)
        states, angles, still_air = engine.lanes([x]), engine.lanes([swash.ravel()]), engine.memory(3)
        rates, imbalance = np.empty((len(psi), len(x))), np.empty((len(psi), 6))
        for first in range(0, len(psi), engine.n):
            part, left = psi[first : first + engine.n], engine.memory(6)
            places, slopes = engine.lanes(list(part)), engine.tick.slopes[0]
            steady_balance(engine.model, states, angles, places, still_air, engine.work, slopes, left)
            rates[first : first + len(part)] = slopes[:, : len(part)].T
            imbalance[first : first + len(part)] = left[:, : len(part)].T
        residuals = rates[:, problem.equations]
        residuals[:, :3] = imbalance[:, :3] / problem.aircraft.body.mass
        residuals[:, 3:6] = (self._inverse_inertia * imbalance[:, np.newaxis, 3:]).sum(axis=2)
        return residuals / problem.scales

    def _failure(self, reason: str) -> TrimError:
        residual = self._problem.residual(self._condition, self.unknowns)
        size, worst = float(np.abs(residual).max()), self._problem.worst_equation(residual)
        return TrimError(
            f"no trim by two loops: {reason} after {self.outer} outer and {self.inner} inner iterations;"
            f" last change of the flap and lag coordinates {self.change:.3g}, residual {size:.3g} in {worst}",
            residual=size,
            worst_equation=worst,
        )


def _relative_change(before: Array, after: Array) -> float:
    return float(np.max(np.abs(after - before) / np.maximum(np.abs(after), SMALL)))
