"""What lanes are, in plain Python: the meaning of every operation, and what runs where nothing is compiled.

See the package's docstring for the rules of rounding.
"""

import math
from collections.abc import Callable, Iterator
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

Number = int | float
INVERSE_ROOT = 0x5FE6EB50C7B537A9


def exact_fused(a: float, b: float, c: float) -> float:
    """Return a b + c with one rounding."""
    if not (math.isfinite(a) and math.isfinite(b)):
        return a * b + c
    if not math.isfinite(c):  # however large a b is
        return c
    exact = Fraction(a) * Fraction(b) + Fraction(c)
    if not exact:  # then a b is a number of double precision, and the sum has the sign that IEEE 754 gives it
        return a * b + c
    try:
        return float(exact)
    except OverflowError:
        return math.inf if exact > 0 else -math.inf


fused = getattr(math, "fma", exact_fused)  # of Python 3.13, in hardware


def _width(*widths: int) -> int:
    """Common number of lanes; a single lane goes with any number."""
    wide = set(widths) - {1}
    if len(wide) > 1:
        raise TypeError(f"lanes of different numbers meet: {sorted(wide)}")
    return wide.pop() if wide else 1


class Lanes:
    """n numbers; arithmetic as of one.

    Parameters
    ----------
    values : sequence of float
    """

    __array_ufunc__ = None  # numpy's numbers leave operations with lanes to us
    __slots__ = ("values",)

    def __init__(self, values: Any) -> None:
        self.values: NDArray[np.float64] = np.atleast_1d(np.asarray(values, dtype=np.float64))

    @property
    def n(self) -> int:
        """Number of lanes."""
        return len(self.values)

    def __repr__(self) -> str:
        return f"Lanes({self.values.tolist()})"

    def __mul__(self, other: Any) -> "Product":
        return NotImplemented if _is_other(other) else Product(self, rounded(other))

    def __rmul__(self, other: Any) -> "Product":
        return Product(rounded(other), self)

    def __add__(self, other: Any) -> "Lanes":
        return NotImplemented if _is_other(other) else _sum(self, other, 1.0)

    def __radd__(self, other: Any) -> "Lanes":
        return _sum(rounded(other), self, 1.0)

    def __sub__(self, other: Any) -> "Lanes":
        return NotImplemented if _is_other(other) else _sum(self, other, -1.0)

    def __rsub__(self, other: Any) -> "Lanes":
        return _sum(rounded(other), self, -1.0)

    def __truediv__(self, other: Any) -> "Lanes":
        return _quotient(self, other)

    def __rtruediv__(self, other: Any) -> "Lanes":
        return _quotient(other, self)

    def __neg__(self) -> "Lanes":
        return Lanes(-self.values)

    def __abs__(self) -> "Lanes":
        return Lanes(np.abs(self.values))

    def __lt__(self, other: Any) -> "Mask":
        return Mask(self.values < rounded(other).values)

    def __le__(self, other: Any) -> "Mask":
        return Mask(self.values <= rounded(other).values)

    def __gt__(self, other: Any) -> "Mask":
        return Mask(self.values > rounded(other).values)

    def __ge__(self, other: Any) -> "Mask":
        return Mask(self.values >= rounded(other).values)


class Product:
    """Two lanes that are to be multiplied: what is done with them decides how that is rounded."""

    __array_ufunc__ = None
    __slots__ = ("a", "b")

    def __init__(self, a: Lanes, b: Lanes) -> None:
        self.a, self.b = a, b

    @property
    def n(self) -> int:
        """Number of lanes."""
        return _width(self.a.n, self.b.n)

    def __repr__(self) -> str:
        return f"Product({self.a!r}, {self.b!r})"

    def __mul__(self, other: Any) -> "Product":
        return NotImplemented if _is_other(other) else Product(rounded(self), rounded(other))

    def __rmul__(self, other: Any) -> "Product":
        return Product(rounded(other), rounded(self))

    def __add__(self, other: Any) -> Lanes:
        return NotImplemented if _is_other(other) else _sum(self, other, 1.0)

    def __radd__(self, other: Any) -> Lanes:
        return _sum(rounded(other), self, 1.0)

    def __sub__(self, other: Any) -> Lanes:
        return NotImplemented if _is_other(other) else _sum(self, other, -1.0)

    def __rsub__(self, other: Any) -> Lanes:
        return _sum(rounded(other), self, -1.0)

    def __truediv__(self, other: Any) -> Lanes:
        return _quotient(self, other)

    def __rtruediv__(self, other: Any) -> Lanes:
        return _quotient(other, self)

    def __neg__(self) -> "Product":
        return Product(-self.a, self.b)

    def __abs__(self) -> Lanes:
        return abs(rounded(self))

    def __lt__(self, other: Any) -> "Mask":
        return rounded(self) < other

    def __le__(self, other: Any) -> "Mask":
        return rounded(self) <= other

    def __gt__(self, other: Any) -> "Mask":
        return rounded(self) > other

    def __ge__(self, other: Any) -> "Mask":
        return rounded(self) >= other


class Zero:
    """A number that is known to be zero: what it meets in a sum stays as it is, what it is a factor of is zero too.

    It makes vectors along an axis or in a plane as cheap as their other components.
    """

    __array_ufunc__ = None
    __slots__ = ()

    def __repr__(self) -> str:
        return "ZERO"

    def __mul__(self, other: Any) -> "Zero":
        return self

    __rmul__ = __mul__

    def __add__(self, other: Any) -> Any:
        return other

    __radd__ = __add__

    def __sub__(self, other: Any) -> Any:
        return -other

    def __rsub__(self, other: Any) -> Any:
        return other

    def __neg__(self) -> "Zero":
        return self


ZERO = Zero()


class Mask:
    """n truth values. `if` asks for one: that of `any_lane` or `all_lanes`."""

    __slots__ = ("values",)

    def __init__(self, values: Any) -> None:
        self.values: NDArray[np.bool_] = np.atleast_1d(np.asarray(values, dtype=bool))

    def __bool__(self) -> bool:
        raise TypeError("lanes may differ: any_lane or all_lanes says what is meant")

    def __and__(self, other: "Mask") -> "Mask":
        return Mask(self.values & other.values)

    def __or__(self, other: "Mask") -> "Mask":
        return Mask(self.values | other.values)

    def __invert__(self) -> "Mask":
        return Mask(~self.values)


def zeros_like(value: Any) -> Lanes:
    """Zeros in as many lanes: what a sum of lanes begins with."""
    return Lanes(np.zeros(value.n))


def _is_other(value: Any) -> bool:
    """True for what has the operators of vectors or of zero, not of numbers."""
    return isinstance(value, (Zero, Vector))


def rounded(value: Any) -> Lanes:
    """Lanes of a number, of lanes, or of a product, which is rounded."""
    if isinstance(value, Zero):
        return Lanes(0.0)
    if isinstance(value, Lanes):
        return value
    if isinstance(value, Product):
        with np.errstate(all="ignore"):
            return Lanes(value.a.values * value.b.values)
    return Lanes(float(value))


def _sum(left: Any, right: Any, sign: float) -> Lanes:
    """Sum, or difference for the sign -1, of lanes and products."""
    if isinstance(left, Product):
        return _each(fused, left.a, left.b, Lanes(sign * rounded(right).values))
    if isinstance(right, Product):
        return _each(fused, Lanes(sign * right.a.values), right.b, left)
    with np.errstate(all="ignore"):
        return Lanes(left.values + sign * rounded(right).values)


def _quotient(left: Any, right: Any) -> Lanes:
    with np.errstate(all="ignore"):
        return Lanes(rounded(left).values / rounded(right).values)


def _each(function: Callable[..., float], *arguments: Lanes) -> Lanes:
    """A function of numbers, lane by lane."""
    n = _width(*(argument.n for argument in arguments))
    rows = [np.broadcast_to(argument.values, n).tolist() for argument in arguments]
    return Lanes([function(*column) for column in zip(*rows, strict=True)])


# --- functions --------------------------------------------------------------------------------------------------


def sqrt(x: Any) -> Lanes:
    """Square root, rounded once; NaN below zero."""
    with np.errstate(all="ignore"):
        return Lanes(np.sqrt(rounded(x).values))


def floor(x: Any) -> Lanes:
    """Largest integer that is not greater."""
    return Lanes(np.floor(rounded(x).values))


def minimum(a: Any, b: Any) -> Lanes:
    """Return b where it is less, else a: a where one of the two is NaN."""
    return select(rounded(b) < a, b, a)


def maximum(a: Any, b: Any) -> Lanes:
    """Return b where it is greater, else a: a where one of the two is NaN."""
    return select(rounded(b) > a, b, a)


def with_sign(size: Any, of: Any) -> Lanes:
    """Magnitude of one with the sign of the other, that of a zero too."""
    return Lanes(np.copysign(rounded(size).values, rounded(of).values))


def inverse_root_guess(x: Any) -> Lanes:
    """1 / sqrt(x) within 3.5 %, from the bits of x: the same on every processor.

    C. Lomont: Fast inverse square root, Purdue University, 2003, whose constant for double precision this is.
    """
    bits = rounded(x).values.view(np.int64)
    return Lanes((np.int64(INVERSE_ROOT) - (bits.view(np.uint64) >> np.uint64(1)).view(np.int64)).view(np.float64))


def select(mask: Any, a: Any, b: Any) -> Lanes:
    """Return a in the lanes where the mask is true, b in the others; the mask may be one truth value."""
    chosen = mask.values if isinstance(mask, Mask) else bool(mask)
    return Lanes(np.where(chosen, rounded(a).values, rounded(b).values))


def any_lane(mask: Mask) -> bool:
    """Return True if one lane is true."""
    return bool(mask.values.any())


def seldom(condition: bool) -> bool:
    """Return a truth value that is expected to be false: the code for the other case is put out of the way."""
    return condition


def all_lanes(mask: Mask) -> bool:
    """Return True if all lanes are true."""
    return bool(mask.values.all())


# --- vectors ----------------------------------------------------------------------------------------------------


class Vector:
    """Three components; a product of a vector and a number stays unrounded like one of two numbers.

    Parameters
    ----------
    x, y, z : number, Lanes, Product or ZERO
        Products are rounded.
    """

    __array_ufunc__ = None
    __slots__ = ("x", "y", "z")

    def __init__(self, x: Any, y: Any, z: Any) -> None:
        self.x, self.y, self.z = (part if isinstance(part, Zero) else rounded(part) for part in (x, y, z))

    @classmethod
    def _of(cls, x: Any, y: Any, z: Any) -> "Vector":
        """Vector of components as they are."""
        made = cls.__new__(cls)
        made.x, made.y, made.z = x, y, z
        return made

    def __repr__(self) -> str:
        return f"Vector({self.x!r}, {self.y!r}, {self.z!r})"

    def __iter__(self) -> Iterator[Any]:
        return iter((self.x, self.y, self.z))

    def __add__(self, other: "Vector") -> "Vector":
        return Vector._of(self.x + other.x, self.y + other.y, self.z + other.z)

    def __sub__(self, other: "Vector") -> "Vector":
        return Vector._of(self.x - other.x, self.y - other.y, self.z - other.z)

    def __neg__(self) -> "Vector":
        return Vector._of(-self.x, -self.y, -self.z)

    def __mul__(self, factor: Any) -> "Vector":
        return Vector._of(self.x * factor, self.y * factor, self.z * factor)

    def __rmul__(self, factor: Any) -> "Vector":
        return Vector._of(factor * self.x, factor * self.y, factor * self.z)


class Matrix:
    """Three rows. `matrix @ vector` sums along the rows, `transposed(matrix) @ vector` along the columns.

    Parameters
    ----------
    x, y, z : Vector
        Rows.
    """

    __slots__ = ("x", "y", "z")

    def __init__(self, x: Vector, y: Vector, z: Vector) -> None:
        self.x, self.y, self.z = (Vector(*(rounded(part) for part in row)) for row in (x, y, z))

    def __matmul__(self, vector: "Vector") -> Vector:
        return Vector._of(dot(self.x, vector), dot(self.y, vector), dot(self.z, vector))


class Transposed:
    """A matrix whose columns are taken for rows."""

    __slots__ = ("matrix",)

    def __init__(self, matrix: Matrix) -> None:
        self.matrix = matrix

    def __matmul__(self, vector: Vector) -> Vector:
        return self.matrix.x * vector.x + self.matrix.y * vector.y + self.matrix.z * vector.z


def transposed(matrix: Matrix) -> Transposed:
    """Matrix with rows and columns exchanged, for `transposed(matrix) @ vector`."""
    return Transposed(matrix)


def dot(a: Vector, b: Vector) -> Any:
    """Scalar product, the first component first."""
    return a.x * b.x + a.y * b.y + a.z * b.z


def cross(a: Vector, b: Vector) -> Vector:
    """Vector product."""
    return Vector._of(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x)
