"""Moments of the mass of a blade whose sections do not balance on the pitch axis (theory.md section 2.6)."""

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from sbs_sim.aircraft.description import Rotor

Array = NDArray[np.float64]

# A linear mass times squares of linear offsets and of the sines of linear twist, between two knots: exact to rounding.
POINTS, WEIGHTS = np.polynomial.legendre.leggauss(10)


class BladeMoments(NamedTuple):
    """Integrals of the mass about the point p* of the pitch axis, over or under the flap hinge, at zero pitch.

    Attributes
    ----------
    height : float
        Of p* over the flap hinge along the blade's normal [m].
    first, second : float
        Along the span [kg m, kg m^2].
    chord_first, normal_first : float
        Along the chord, towards the leading edge, and normal to it, up [kg m].
    chord_product, normal_product : float
        Of these with the span [kg m^2].
    chord_second, mixed_second, normal_second : float
        [kg m^2]
    """

    height: float
    first: float
    second: float
    chord_first: float
    normal_first: float
    chord_product: float
    normal_product: float
    chord_second: float
    mixed_second: float
    normal_second: float

    def matrix(self) -> Array:
        """Second moments along span, chord and normal, shape (3, 3)."""
        return np.array(
            [
                [self.second, self.chord_product, self.normal_product],
                [self.chord_product, self.chord_second, self.mixed_second],
                [self.normal_product, self.mixed_second, self.normal_second],
            ]
        )

    def vector(self) -> Array:
        """First moments along span, chord and normal, shape (3,)."""
        return np.array([self.first, self.chord_first, self.normal_first])


def blade_moments(rotor: "Rotor") -> BladeMoments:
    """Moments of a blade of a rotor.

    Where the file gives a blade's mass by its integrals, the mass per length is the parabola that has them.
    """
    span, mass = _masses(rotor)
    offset, twist = rotor.centre_at(span / rotor.blade_length), rotor.twist_at(span / rotor.blade_length)
    along, up = offset * np.cos(twist), offset * np.sin(twist)
    shift, height = inward_shift(rotor), -rotor.undersling * math.cos(rotor.flap_rest)
    total, first, second = rotor.blade_mass, rotor.first_moment, rotor.second_moment
    outboard = span + shift
    return BladeMoments(
        height=height,
        first=first + shift * total,
        second=second + shift * (2.0 * first + shift * total),
        chord_first=float(mass @ along),
        normal_first=float(mass @ up),
        chord_product=float(mass @ (outboard * along)),
        normal_product=float(mass @ (outboard * up)),
        chord_second=float(mass @ (along * along)),
        mixed_second=float(mass @ (along * up)),
        normal_second=float(mass @ (up * up)),
    )


def inward_shift(rotor: "Rotor") -> float:
    """By how much an undersling moves a blade outboard along its span, negative with precone [m]."""
    return -rotor.undersling * math.sin(rotor.flap_rest)


def _masses(rotor: "Rotor") -> tuple[Array, Array]:
    """Distances from the flap hinge [m] and masses [kg] that give the integrals over the blade."""
    length, radius = rotor.blade_length, rotor.radius
    tables = (rotor.mass_stations, rotor.centre_stations, rotor.twist_stations)
    inner = [table * radius - rotor.hinge_offset for table in tables if table is not None]
    knots = np.unique(np.concatenate([[0.0, length], *(part[(part > 0.0) & (part < length)] for part in inner)]))
    half = np.diff(knots)[:, None] / 2.0
    span = (knots[:-1, None] + half * (POINTS + 1.0)).ravel()
    width = (half * WEIGHTS).ravel()
    if rotor.mass_stations is not None and rotor.mass_values is not None:
        density = np.interp((rotor.hinge_offset + span) / radius, rotor.mass_stations, rotor.mass_values)
        return np.append(span, length), np.append(width * density, rotor.tip_mass)
    share = 1.0 / (np.arange(3)[:, None] + np.arange(3) + 1.0)  # integrals of powers from 0 to 1
    integrals = [rotor.blade_mass, rotor.first_moment / length, rotor.second_moment / length**2]
    a, b, c = np.linalg.solve(share, integrals) / length
    x = span / length
    return span, width * (a + x * (b + x * c))
