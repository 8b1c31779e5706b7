"""Newton's method on equations whose roots are known."""

import math

import numpy as np
import pytest

from sbs_sim.analysis.newton import MAX_UNKNOWN, newton


class Counted:
    """A function of the unknowns that counts its calls."""

    def __init__(self, function):
        self._function, self.calls = function, 0

    def __call__(self, values):
        self.calls += 1
        return np.atleast_1d(self._function(values))


def one(value):
    return np.array([value])


@pytest.mark.parametrize("given", [True, False])
def test_linear_equations_take_one_step(given):
    matrix, root = np.array([[2.0, 1.0, 0.0], [-1.0, 3.0, 0.5], [0.0, 4.0, -2.0]]), np.array([0.3, -0.2, 0.9])
    jacobian = (lambda values: matrix) if given else None
    solution = newton(lambda values: matrix @ (values - root), np.zeros(3), jacobian)
    assert solution.converged
    np.testing.assert_allclose(solution.values, root, atol=1e-11)
    np.testing.assert_allclose(solution.residual, 0.0, atol=1e-11)
    # the differences' rounding, 1e-10 of the slope, leaves something for another step
    assert solution.iterations == 1 if given else solution.iterations <= 2


def test_a_root_is_no_step_away_from_itself():
    solution = newton(lambda values: values - 0.5, one(0.5))
    assert solution.converged
    assert solution.iterations == 0


def test_coupled_equations_are_solved():
    """A circle and a cubic through (0.6, 0.8)."""
    solution = newton(lambda v: np.array([v @ v - 1.0, v[0] ** 3 - v[1] + 0.584]), np.array([0.9, 0.5]))
    assert solution.converged
    np.testing.assert_allclose(solution.values, [0.6, 0.8], atol=1e-10)


def test_steps_that_are_too_long_are_halved():
    """Where the slope is small, Newton's step of an arc tangent leads far beyond its root."""
    solution = newton(lambda values: np.arctan(5.0 * values), one(1.5))
    assert solution.converged
    assert solution.values[0] == pytest.approx(0.0, abs=1e-11)


def test_what_has_no_root_is_not_found():
    """The first step leads to the least of x^2 + 1, where the slope is zero and there is no second one."""
    solution = newton(lambda values: values**2 + 1.0, one(1.0))
    assert not solution.converged
    assert solution.values[0] == pytest.approx(0.0, abs=1e-9)
    assert solution.residual[0] == pytest.approx(1.0)
    assert solution.iterations == 2


def test_roots_beyond_the_allowed_are_not_reached():
    solution = newton(lambda values: values - 2.0, one(0.0))
    assert not solution.converged
    assert 1.5 < solution.values[0] < MAX_UNKNOWN


def test_values_that_are_not_numbers_are_stepped_over():
    """The full step leads to where the equation has no value."""
    solution = newton(lambda values: np.where(values > 0.0, np.log(np.maximum(values, 1e-300) / 0.1), np.nan), one(0.9))
    assert solution.converged
    assert solution.values[0] == pytest.approx(0.1)


def test_a_jacobian_is_kept_while_it_serves():
    jacobian = Counted(lambda values: np.diag(1.0 + 0.02 * values))
    solution = newton(lambda values: values + 0.01 * values**2 - 0.3, one(0.0), jacobian)
    assert solution.converged
    assert solution.values[0] == pytest.approx((math.sqrt(1.0 + 0.04 * 0.3) - 1.0) / 0.02)
    assert jacobian.calls == 1
    assert solution.iterations > 2


def test_a_jacobian_that_serves_badly_is_taken_anew():
    """Newton's steps to a triple root leave (2/3)^3 of the residual, more than is good enough: each wants its own."""
    jacobian = Counted(lambda values: np.diag(3.0 * values**2))
    solution = newton(lambda values: values**3, one(0.9), jacobian)
    assert solution.converged
    assert jacobian.calls == solution.iterations == math.ceil(math.log(1e-11 / 0.9**3) / math.log((2 / 3) ** 3))


def test_a_jacobian_that_has_served_and_does_no_longer_is_taken_anew():
    """A first step along the slope of 1 leaves 5 % of the residual, where the slope is 2.5 and it leads too far."""

    def broken_line(values):
        return np.interp(values, [-1.0, 0.0, 0.005, 0.09, 1.0], [-2.505, -0.005, 0.0075, 0.09, 1.0])

    equations = Counted(broken_line)
    jacobian = Counted(lambda values: np.diag(np.where(values < 0.005, 2.5, 1.0)))
    solution = newton(equations, one(0.1), jacobian)
    assert solution.converged
    assert solution.values[0] == pytest.approx(0.002)
    assert jacobian.calls == 2
    assert equations.calls == 4  # at the start, after the first step, after the vain one, after the last


@pytest.mark.parametrize(("jump", "converged"), [(2e-10, True), (5e-9, False)])
def test_what_rounding_leaves_is_taken_for_a_root_and_no_more(jump, converged):
    """Equations that jump over zero by as much on either side."""
    solution = newton(lambda values: values - 0.3 + np.where(values >= 0.3, jump, -jump), one(0.0))
    assert solution.converged == converged
    assert solution.values[0] == pytest.approx(0.3, abs=1e-8)


def test_a_direction_that_the_equations_leave_open_is_not_gone():
    """An unknown that moves nothing, and two that do the same: the smallest step of all."""
    solution = newton(lambda v: np.array([v[0] - 0.3, 0.0 * v[1]]), np.array([0.0, 0.2]))
    assert solution.converged
    np.testing.assert_allclose(solution.values, [0.3, 0.2], atol=1e-10)
    solution = newton(lambda v: np.array([v[0] + v[1] - 0.3, 2.0 * (v[0] + v[1]) - 0.6]), np.zeros(2))
    assert solution.converged
    np.testing.assert_allclose(solution.values, [0.15, 0.15], atol=1e-10)


def test_open_but_for_rounding_is_open():
    """The slope of an unknown that moves nothing, as differences have it."""
    matrix = np.array([[1.0, 1e-14], [0.0, 3e-15]])
    solution = newton(lambda v: np.array([v[0] - 0.3, 1e-3 * (v[0] - 0.3)]), np.zeros(2), lambda v: matrix)
    assert solution.converged
    assert abs(solution.values[1]) < 1e-10


def test_what_rounding_lessens_again_and_again_is_a_root():
    """Every step leaves nine tenths: far from the tolerance of a hundred times less, no step would be enough."""
    left = Counted(lambda values: 0.0)

    def equations(values):
        left(values)
        return values - 0.3 + 3e-10 * (-0.9) ** left.calls

    solution = newton(equations, one(0.0), lambda values: np.eye(1))
    assert solution.converged
    assert solution.iterations == 2  # the step to the root, and one that leaves nine tenths
    assert left.calls == 3
    assert solution.values[0] == pytest.approx(0.3, abs=1e-9)


@pytest.mark.parametrize(("left", "converged"), [(9e-10, True), (1.1e-9, False)])
def test_what_no_step_lessens_is_a_root_if_it_is_small(left, converged):
    solution = newton(lambda values: np.array([left]), one(0.3), lambda values: np.eye(1))
    assert solution.converged == converged
    assert solution.values[0] == 0.3
    assert solution.iterations == (0 if converged else 1)
