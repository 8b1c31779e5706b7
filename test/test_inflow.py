"""Dynamic inflow by itself, against the matrices of Peters and HaQuang (theory.md section 6)."""

import numpy as np
import pytest

from sbs_sim.model.inflow import inflow_matrix, inflow_rates

MASS = np.array([8 / (3 * np.pi), 16 / (45 * np.pi), 16 / (45 * np.pi)])  # order 0, s, c
SPEED, DUCT = 287.0, 0.8


def gains(wake, skew, expansion):
    """Lt in the order 0, s, c for a wake turned by an angle from x about the shaft: X = tan(chi / 2) is the skew.

    Turned from the one of a wake along c, where it is that of the paper without any product X_c X_s.
    """
    k = 15 * np.pi / 64
    along = np.array(  # order 0, s, c
        [[2 * expansion**2, 0.0, -k * skew], [0.0, 2 * (1 + skew**2), 0.0], [k * skew, 0.0, 2 * (1 - skew**2)]]
    )
    c, s = np.cos(wake), np.sin(wake)
    turn = np.array([[1.0, 0.0, 0.0], [0.0, c, s], [0.0, -s, c]])
    return turn @ along @ turn.T


def flows(lambda0, mu):
    """V_T, V_m and tan(chi / 2) of the skew angle chi = atan2(mu, lambda)."""
    lam = lambda0 - mu[2]
    edgewise = np.hypot(mu[0], mu[1])
    total = np.hypot(edgewise, lam)
    return total, (edgewise**2 + lam * (lam + lambda0)) / total, np.tan(np.arctan2(edgewise, abs(lam)) / 2)


@pytest.mark.parametrize("sense", [1.0, -1.0])
@pytest.mark.parametrize("mu", [(0.0, 0.0, 0.0), (0.1, 0.05, -0.02), (-0.2, 0.1, 0.08), (0.0, -0.15, 0.03)])
def test_rates_are_those_of_the_gain_matrix(mu, sense):
    """M lambda' / Omega + V Lt^-1 lambda = (C_T, m_s, m_c)."""
    lambdas, loads = np.array([0.05, 0.012, -0.02]), np.array([0.004, 0.0007, -0.0004])
    total, cyclic, skew = flows(lambdas[0], mu)
    gain = gains(np.arctan2(-sense * mu[1], mu[0]), skew, DUCT)
    drain = np.diag([total, cyclic, cyclic]) @ np.linalg.inv(gain)
    rates = inflow_rates(*lambdas, *mu, sense, DUCT, SPEED, *loads, 1)
    assert rates == pytest.approx(SPEED * (loads - drain @ lambdas) / MASS, rel=1e-6)
    matrix = np.empty((3, 3))
    inflow_matrix(lambdas[0], *mu, sense, DUCT, SPEED, 1, matrix)
    np.testing.assert_allclose(matrix, -SPEED * drain / MASS[:, None], rtol=1e-6, atol=1e-6)


def test_uniform_inflow_alone_is_momentum_theorys():
    lambda0, mu, thrust = 0.05, (0.1, 0.05, -0.02), 0.004
    total, *_ = flows(lambda0, mu)
    expected = SPEED * (thrust - total * lambda0 / (2 * DUCT**2)) / MASS[0]
    rates = inflow_rates(lambda0, 0.3, 0.2, *mu, 1.0, DUCT, SPEED, thrust, 0.1, 0.1, 0)
    assert rates == pytest.approx((expected, 0.0, 0.0), rel=1e-6)


def test_least_flow_is_a_hundred_thousandth_of_the_tip_speed():
    """Where nothing goes through the disc: V_T = 1e-5, and lambda' = Omega C_T / M, for lambda0 = mu = 0."""
    out = np.empty((3, 3))
    inflow_matrix(0.0, 0.0, 0.0, 0.0, 1.0, DUCT, SPEED, 0, out)
    expected = -SPEED * 1e-5 / (2 * DUCT**2) / MASS[0]
    np.testing.assert_allclose(out, np.diag([expected, 0.0, 0.0]), rtol=1e-9, atol=1e-300)
