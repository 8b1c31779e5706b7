"""Places on the earth: WGS 84, and the plane that touches it at the origin of a flight.

Source of the ellipsoid: NIMA TR8350.2, Department of Defense World Geodetic System 1984, third edition, table 3.1 and
eqs. (4-14), (4-15). The way back: B. R. Bowring, Transformation from spatial to geographical coordinates, Survey
Review 23 (181), 1976, iterated.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

SEMI_MAJOR_AXIS = 6378137.0  # a [m]
FLATTENING = 1.0 / 298.257223563
SEMI_MINOR_AXIS = SEMI_MAJOR_AXIS * (1.0 - FLATTENING)
ECCENTRICITY_SQUARED = FLATTENING * (2.0 - FLATTENING)  # e^2
SECOND_SQUARED = ECCENTRICITY_SQUARED / (1.0 - ECCENTRICITY_SQUARED)  # e'^2
ITERATIONS = 4  # two have converged to rounding near the ground


def earth_fixed(latitude: float, longitude: float, height: float) -> Array:
    """Earth-centred, earth-fixed coordinates [m], shape (3,), of a place [rad, rad, m above the ellipsoid]."""
    sine, cosine = math.sin(latitude), math.cos(latitude)
    normal = SEMI_MAJOR_AXIS / math.sqrt(1.0 - ECCENTRICITY_SQUARED * sine * sine)
    across = (normal + height) * cosine
    along = (normal * (1.0 - ECCENTRICITY_SQUARED) + height) * sine
    return np.array([across * math.cos(longitude), across * math.sin(longitude), along])


def geodetic(place: ArrayLike) -> tuple[float, float, float]:
    """Latitude, longitude [rad] and height [m] of earth-fixed coordinates [m]; not for places near the centre."""
    x, y, z = np.asarray(place, dtype=float).tolist()
    across = math.hypot(x, y)
    reduced = math.atan2(z * SEMI_MAJOR_AXIS, across * SEMI_MINOR_AXIS)
    latitude = 0.0
    for _ in range(ITERATIONS):
        up = z + SECOND_SQUARED * SEMI_MINOR_AXIS * math.sin(reduced) ** 3
        out = across - ECCENTRICITY_SQUARED * SEMI_MAJOR_AXIS * math.cos(reduced) ** 3
        latitude = math.atan2(up, out)
        reduced = math.atan2((1.0 - FLATTENING) * math.sin(latitude), math.cos(latitude))
    sine, cosine = math.sin(latitude), math.cos(latitude)
    height = across * cosine + z * sine - SEMI_MAJOR_AXIS * math.sqrt(1.0 - ECCENTRICITY_SQUARED * sine * sine)
    return latitude, math.atan2(y, x), height


class Origin:
    """Where the origin of a flight is: its north, east and down are those of the ellipsoid there.

    The world of a flight is flat, the plane that touches there. So the height above the ellipsoid grows with the
    distance from the origin: 0.08 m at 1 km, 7.8 m at 10 km.

    Parameters
    ----------
    latitude_deg, longitude_deg : float
        [deg]
    height : float
        Above the ellipsoid [m].
    """

    def __init__(self, latitude_deg: float, longitude_deg: float, height: float) -> None:
        latitude, longitude = math.radians(latitude_deg), math.radians(longitude_deg)
        s, c = math.sin(latitude), math.cos(latitude)
        sl, cl = math.sin(longitude), math.cos(longitude)
        self._place = earth_fixed(latitude, longitude, height)
        self._axes = np.array([[-s * cl, -sl, -c * cl], [-s * sl, cl, -c * sl], [c, 0.0, -s]])  # north, east, down

    def geodetic_deg(self, position: ArrayLike) -> tuple[float, float, float]:
        """Latitude, longitude [deg] and height above the ellipsoid [m] of a position north, east, down [m]."""
        latitude, longitude, height = geodetic(self._place + self._axes @ np.asarray(position, dtype=float))
        return math.degrees(latitude), math.degrees(longitude), height
