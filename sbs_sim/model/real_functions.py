"""Functions of plain numbers in compiled code, the same to the last bit on every machine.

Lanes have `sbs_sim.model.trigonometry`, numbers outside of compiled code `sbs_sim.model.elementary`.
"""

import math

from sbs_sim.model.kernel import kernel

LOG_2 = 0.6931471805599453
LOG_2_HIGH, LOG_2_LOW = 0.693147180369123816490, 1.90821492927058770002e-10  # the first with 32 bits
ROOT_HALF = 0.7071067811865476
TERMS = 12  # of the series of the logarithm, whose next one is 1e-19
EXPONENTIAL_TERMS = 14  # of that of the exponential up to half of log 2: the next one is 1e-19
QUARTER = 1.5707963267948966  # turn [rad]
SINE_TERMS = 9  # up to a quarter turn: the next one is 1e-17


@kernel
def logarithm(x):
    """Natural logarithm of a number above 0: of what is left of it near 1, 2 artanh((m - 1) / (m + 1))."""
    m, exponent = math.frexp(x)
    if m < ROOT_HALF:
        m, exponent = 2.0 * m, exponent - 1
    s = (m - 1.0) / (m + 1.0)
    q, series = s * s, 0.0
    for k in range(TERMS, -1, -1):
        series = series * q + 1.0 / (2 * k + 1)
    return exponent * LOG_2 + 2.0 * s * series


@kernel
def exponential_of(x):
    """e^x for |x| up to 700: its series for what is left of x beside multiples of log 2."""
    count = math.floor(x / LOG_2 + 0.5)
    rest = (x - count * LOG_2_HIGH) - count * LOG_2_LOW
    series = 1.0
    for k in range(EXPONENTIAL_TERMS, 0, -1):
        series = 1.0 + series * rest / k
    return math.ldexp(series, int(count))


@kernel
def power_of(base, exponent):
    """Power of a number above 0."""
    return exponential_of(exponent * logarithm(base))


@kernel
def sine_of_turn(turns):
    """Sine of an angle in turns."""
    quarters = 4.0 * (turns - math.floor(turns))  # 0 to 4
    if quarters > 3.0:
        return odd_series(quarters - 4.0)
    if quarters > 1.0:
        return odd_series(2.0 - quarters)
    return odd_series(quarters)


@kernel
def cosine_of_turn(turns):
    """Cosine of an angle in turns."""
    return sine_of_turn(turns + 0.25)


@kernel
def odd_series(quarters):
    """Sine of up to a quarter turn to either side: x - x^3 / 3! + x^5 / 5! - ..."""
    x = QUARTER * quarters
    square, series = x * x, 1.0
    for k in range(SINE_TERMS, 0, -1):
        series = 1.0 - series * square / (2 * k * (2 * k + 1))
    return x * series
