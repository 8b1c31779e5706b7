"""Exponential, power, sine and cosine of a number, rounded right: the same on every machine.

The mathematical libraries of systems differ in the last bit. What is worked out once, when an aircraft or a wind is
made, comes from here; lanes have `sbs_sim.model.trigonometry`.
"""

from decimal import Context, Decimal
from functools import lru_cache

DIGITS = Context(prec=50)  # of the arithmetic; a number of double precision has 17
TURN = Decimal("6.28318530717958647692528676655900576839433879875021164194989")


@lru_cache(maxsize=1024)
def exponential(x: float) -> float:
    """e^x."""
    return float(DIGITS.exp(Decimal(x)))


@lru_cache(maxsize=1024)
def exponential_less_one(x: float) -> float:
    """e^x - 1, with all digits where x is small."""
    return float(DIGITS.subtract(DIGITS.exp(Decimal(x)), 1))


@lru_cache(maxsize=1024)
def natural_logarithm(x: float) -> float:
    """Natural logarithm of a number above zero."""
    return float(DIGITS.ln(Decimal(x)))


@lru_cache(maxsize=1024)
def power(base: float, exponent: float) -> float:
    """Power of a number above zero."""
    return float(DIGITS.power(Decimal(base), Decimal(exponent)))


@lru_cache(maxsize=1024)
def cosine_and_sine(angle: float) -> tuple[float, float]:
    """Cosine and sine of an angle [rad] of up to a million turns."""
    exact = Decimal(angle)
    turns = DIGITS.divide(exact, TURN).to_integral_value()
    x = DIGITS.subtract(exact, DIGITS.multiply(turns, TURN))
    negative_square = DIGITS.minus(DIGITS.multiply(x, x))
    sums, term = [Decimal(1), x], [Decimal(1), x]
    for n in range(1, 30):
        for part in (0, 1):
            term[part] = DIGITS.divide(
                DIGITS.multiply(term[part], negative_square), (2 * n - 1 + part) * (2 * n + part)
            )
            sums[part] = DIGITS.add(sums[part], term[part])
    return float(sums[0]), float(sums[1])
