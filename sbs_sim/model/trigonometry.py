"""Sine, cosine, roots and angles of lanes, the same to the last bit on every processor.

No library is asked: those of processors and systems round differently. Coefficients are written out for the same
reason.
"""

import math

from sbs_sim.lanes import any_lane, floor, inverse_root_guess, maximum, minimum, rounded, seldom, select, with_sign
from sbs_sim.model.kernel import kernel

# Of z, z^3, z^5 ... of the arcsine for |z| <= sin 22.5 deg: minimax relative error 1.2e-16
# (Remez exchange in 40 digits).
Q0, Q1, Q2, Q3, Q4, Q5, Q6, Q7, Q8, Q9 = (
    0.9999999999999999,
    0.16666666666686117,
    0.07499999995631419,
    0.04464286093772816,
    0.030381777639785515,
    0.02237634988934972,
    0.017289133166969315,
    0.0145554953282403,
    0.008317666053054203,
    0.01898332521705139,
)
# Taylor's: for |t| <= pi/2 the first terms left out are 1e-18 and 3e-17.
S0, S1, S2, S3, S4, S5, S6, S7, S8, S9, S10 = ((-1) ** k / math.factorial(1 + 2 * k) for k in range(11))
C0, C1, C2, C3, C4, C5, C6, C7, C8, C9, C10 = ((-1) ** k / math.factorial(2 * k) for k in range(11))
TURN, INVERSE_TURN, HALF_TURN, QUARTER_TURN = 2.0 * math.pi, 1.0 / (2.0 * math.pi), math.pi, 0.5 * math.pi
EIGHTH = 0.25 * math.pi
TANGENT_EIGHTH = 0.41421356237309503  # tan 22.5 deg
ROOT_HALF = 0.7071067811865476
TINY = 1e-290  # of a squared speed: it keeps roots and quotients finite and changes none that is not zero


@kernel
def inverse_root(d):
    """1 / sqrt(d) for d > 0, within 2e-16: two steps of higher order from a guess that is right to 3.5 %."""
    r = inverse_root_guess(d)
    h = 1.0 - (d * r) * r
    r = r + r * (h * (0.5 + h * (0.375 + h * 0.3125)))
    h = 1.0 - (d * r) * r
    return r + r * (h * (0.5 + h * 0.375))


@kernel
def small_arcsine(z):
    """Arcsine of |z| <= sin 22.5 deg [rad]."""
    q = z * z
    q2 = q * q
    q4 = q2 * q2
    # Estrin's order: fewer operations wait for each other than in Horner's
    low = (Q0 + Q1 * q) + (Q2 + Q3 * q) * q2
    high = ((Q4 + Q5 * q) + (Q6 + Q7 * q) * q2) + q4 * (Q8 + Q9 * q)
    return rounded(z * (low + q4 * high))


@kernel
def angle_of(y, x, inverse_length):
    """Angle of the point (x, y) from the x axis [rad], -pi to pi; the inverse of its distance is known.

    Where all points are within 22.5 deg of the axis that is quick, and gives the same bits.
    """
    if seldom(any_lane(abs(y) > TANGENT_EIGHTH * x)):
        return _any_angle(y, x, inverse_length)
    return small_arcsine(y * inverse_length)


@kernel
def _any_angle(y, x, inverse_length):
    a, b = abs(x), abs(y)
    low, high = minimum(b, a), maximum(b, a)
    beyond = low > TANGENT_EIGHTH * high
    # arcsin of low / length, or 45 deg plus that of what is left
    angle = small_arcsine(select(beyond, (low - high) * ROOT_HALF, low) * inverse_length)
    angle = select(beyond, angle + EIGHTH, angle)
    angle = select(b > a, QUARTER_TURN - angle, angle)
    angle = select(x < 0.0, HALF_TURN - angle, angle)
    return with_sign(angle, y)


@kernel
def cosine_sine(angle):
    """Cosine and sine of an angle [rad], within 1e-15 for a few turns; one turn more costs 2e-16."""
    half = 0.5 * (angle - TURN * floor(angle * INVERSE_TURN + 0.5))
    q = half * half
    s = S5 + q * (S6 + q * (S7 + q * (S8 + q * (S9 + q * S10))))
    s = half * (S0 + q * (S1 + q * (S2 + q * (S3 + q * (S4 + q * s)))))
    c = C5 + q * (C6 + q * (C7 + q * (C8 + q * (C9 + q * C10))))
    c = C0 + q * (C1 + q * (C2 + q * (C3 + q * (C4 + q * c))))
    return 1.0 - (2.0 * s) * s, (2.0 * s) * c
