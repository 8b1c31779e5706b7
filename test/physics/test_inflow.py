"""Dynamic inflow by itself, against the matrices of Peters and HaQuang (theory.md section 6)."""

import numba
import numpy as np
import pytest
from helpers import build

from sbs_sim.lanes import Vector, as_lanes, as_records, rounded
from sbs_sim.model.inflow import Inflow, disc_flow, inflow_matrix, inflow_rates

MASS = np.array([8 / (3 * np.pi), 16 / (45 * np.pi), 16 / (45 * np.pi)])  # order 0, s, c
SPEED, DUCT = 287.0, 0.8


@pytest.fixture(scope="module")
def rotors():
    """Records of two rotors that turn clockwise and counter-clockwise, in one lane."""
    found = build(every_rotor={"duct_expansion": DUCT}).model().rotors.copy()
    found["inflow_speed"] = SPEED
    return found


@numba.njit
def _rates(rotors, number, given, cyclic, out):
    rotor = as_records(rotors)[number]
    v, result = as_lanes(given, rotor), as_lanes(out, rotor)
    flow = disc_flow(v[0], Vector(v[3], v[4], v[5]), rotor.sense)
    rates = inflow_rates(rotor, Inflow(v[0], v[2], v[1]), flow, Inflow(v[6], v[8], v[7]), cyclic)
    result[0], result[1], result[2] = rounded(rates.uniform), rounded(rates.sine), rounded(rates.cosine)


def rates_of(rotors, sense, lambdas, mu, loads, cyclic):
    """Rates of the inflow; all in the order 0, s, c."""
    out = np.empty((3, 1))
    _rates(rotors, number_of(rotors, sense), np.array([*lambdas, *mu, *loads])[:, np.newaxis], cyclic, out)
    return out[:, 0]


def matrix_of(rotors, sense, lambda0, mu, cyclic):
    out = np.empty((3, 3, 1))
    inflow_matrix(rotors, number_of(rotors, sense), np.array([[lambda0]]), np.array(mu)[:, np.newaxis], cyclic, out)
    return out[:, :, 0]


def number_of(rotors, sense):
    return int(np.flatnonzero(rotors["sense"][:, 0] == sense)[0])


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
def test_rates_are_those_of_the_gain_matrix(rotors, mu, sense):
    """M lambda' / Omega + V Lt^-1 lambda = (C_T, m_s, m_c)."""
    lambdas, loads = np.array([0.05, 0.012, -0.02]), np.array([0.004, 0.0007, -0.0004])
    total, cyclic, skew = flows(lambdas[0], mu)
    gain = gains(np.arctan2(-sense * mu[1], mu[0]), skew, DUCT)
    drain = np.diag([total, cyclic, cyclic]) @ np.linalg.inv(gain)
    found = rates_of(rotors, sense, lambdas, mu, loads, 1)
    assert found == pytest.approx(SPEED * (loads - drain @ lambdas) / MASS, rel=1e-6)
    matrix = matrix_of(rotors, sense, lambdas[0], mu, 1)
    np.testing.assert_allclose(matrix, -SPEED * drain / MASS[:, None], rtol=1e-6, atol=1e-6)


def test_uniform_inflow_alone_is_momentum_theorys(rotors):
    lambda0, mu, thrust = 0.05, (0.1, 0.05, -0.02), 0.004
    total, *_ = flows(lambda0, mu)
    expected = SPEED * (thrust - total * lambda0 / (2 * DUCT**2)) / MASS[0]
    found = rates_of(rotors, 1.0, (lambda0, 0.3, 0.2), mu, (thrust, 0.1, 0.1), 0)
    assert found == pytest.approx([expected, 0.0, 0.0], rel=1e-6)


def test_least_flow_is_a_hundred_thousandth_of_the_tip_speed(rotors):
    """Where nothing goes through the disc: V_T = 1e-5, and lambda' = Omega C_T / M, for lambda0 = mu = 0."""
    expected = -SPEED * 1e-5 / (2 * DUCT**2) / MASS[0]
    found = matrix_of(rotors, 1.0, 0.0, (0.0, 0.0, 0.0), 0)
    np.testing.assert_allclose(found, np.diag([expected, 0.0, 0.0]), rtol=1e-9, atol=1e-300)
