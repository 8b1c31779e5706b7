"""Sine, cosine and four-quadrant arctangent without branches, which the compiler can turn into vector instructions."""

import math

import numpy as np

from sbs_sim.model.kernel import kernel

ARCTANGENT_TERMS = 9


def _arctangent_coefficients(terms: int) -> tuple[float, ...]:
    """Coefficients of z, z^3, z^5 ... of the arctangent for |z| <= u = tan(pi/8).

    The Chebyshev series arctan(u x) = 2 sum (-1)^k r^(2k+1) / (2k+1) T_(2k+1)(x) with r = tan(pi/16) (Mason and
    Handscomb, Chebyshev Polynomials, 2003, section 5.3), cut after `terms` terms and written in powers of z = u x.
    The first term left out bounds the error: 4e-15 for 9 terms.
    """
    r, u = math.tan(math.pi / 16), math.tan(math.pi / 8)
    series = np.zeros(2 * terms)
    for k in range(terms):
        series[2 * k + 1] = 2 * (-1) ** k * r ** (2 * k + 1) / (2 * k + 1)
    powers = np.polynomial.chebyshev.cheb2poly(series)[1::2]
    return tuple(float(c / u ** (2 * k + 1)) for k, c in enumerate(powers))


def _taylor_coefficients(first: int, terms: int) -> tuple[float, ...]:
    """Coefficients of t^first, t^(first + 2) ... of the sine (first = 1) or cosine (0)."""
    return tuple((-1) ** k / math.factorial(first + 2 * k) for k in range(terms))


A0, A1, A2, A3, A4, A5, A6, A7, A8 = _arctangent_coefficients(ARCTANGENT_TERMS)
# For |t| <= pi/2 the first terms left out are 1e-18 and 3e-17.
S0, S1, S2, S3, S4, S5, S6, S7, S8, S9, S10 = _taylor_coefficients(1, 11)
C0, C1, C2, C3, C4, C5, C6, C7, C8, C9, C10 = _taylor_coefficients(0, 11)
MIDDLE = math.tan(math.pi / 8)
TINY = 1e-300
TURN = 2.0 * math.pi


@kernel
def arctangent2(y, x):
    """Angle of the point (x, y) from the x axis [rad], -pi to pi, within 1e-14; 0 at the origin."""
    a, b = abs(x), abs(y)
    low = b if b < a else a
    high = a if b < a else b
    beyond = low > MIDDLE * high
    # arctan t = pi/4 + arctan((t - 1) / (t + 1)), with t = low / high in one division
    above = low - high if beyond else low
    below = low + high if beyond else high + TINY
    z = above / below
    q = z * z
    q2 = q * q
    q4 = q2 * q2
    # Estrin's order: fewer operations wait for each other than in Horner's
    angle = (A4 + q * A5) + q2 * (A6 + q * A7) + q4 * A8
    angle = z * ((A0 + q * A1) + q2 * (A2 + q * A3) + q4 * angle)
    angle = angle + 0.25 * math.pi if beyond else angle
    angle = 0.5 * math.pi - angle if b > a else angle
    angle = math.pi - angle if x < 0.0 else angle
    return -angle if y < 0.0 else angle


@kernel
def cosine_sine(angle):
    """Cosine and sine of an angle [rad], within 1e-15 for a few turns; one turn more costs 2e-16."""
    half = 0.5 * (angle - TURN * np.floor(angle * (1.0 / TURN) + 0.5))
    q = half * half
    s = S5 + q * (S6 + q * (S7 + q * (S8 + q * (S9 + q * S10))))
    s = half * (S0 + q * (S1 + q * (S2 + q * (S3 + q * (S4 + q * s)))))
    c = C5 + q * (C6 + q * (C7 + q * (C8 + q * (C9 + q * C10))))
    c = C0 + q * (C1 + q * (C2 + q * (C3 + q * (C4 + q * c))))
    return 1.0 - 2.0 * s * s, 2.0 * s * c
