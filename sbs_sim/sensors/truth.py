"""What perfect sensors measure of an instant. Body axes are forward, right, down; earth axes are north, east, down."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sbs_sim.aircraft.atmosphere import LAPSE_RATE, MAX_ALTITUDE, MIN_ALTITUDE, TEMPERATURE, TROPOPAUSE, standard_air
from sbs_sim.flight.records import Snapshot
from sbs_sim.model import state as S
from sbs_sim.model.frames import rotation_matrix

Array = NDArray[np.float64]

NEWTON_STEPS = 6


def specific_force(now: Snapshot, gravity: float) -> Array:
    """What an accelerometer at the c.g. measures, body axes [m/s^2]: (0, 0, -gravity) at rest."""
    down: Array = rotation_matrix(now.state[S.ATTITUDE : S.VELOCITY])[2]
    return now.acceleration - gravity * down


def specific_force_at(position: ArrayLike, force: Array, rates: Array, angular_acceleration: Array) -> Array:
    """The same at a position against the c.g. [m] of a rigid body that turns.

    Acceleration of a point of a rigid body, e.g. H. Goldstein, Classical Mechanics, section 4.10:
    a + alpha x r + omega x (omega x r).
    """
    arm = np.asarray(position, dtype=float)
    return np.asarray(force + np.cross(angular_acceleration, arm) + np.cross(rates, np.cross(rates, arm)))


def magnetic_field(now: Snapshot, field: ArrayLike) -> Array:
    """A field of earth axes in body axes, in its unit."""
    return np.asarray(rotation_matrix(now.state[S.ATTITUDE : S.VELOCITY]).T @ np.asarray(field, dtype=float))


def range_down(now: Snapshot, ground_altitude: float) -> float:
    """Distance from the c.g. to the level of the ground along the body's z-axis [m]; inf where it looks elsewhere.

    Parameters
    ----------
    now : Snapshot
    ground_altitude : float
        Height of the ground above the origin [m]; -inf for none.
    """
    down = float(rotation_matrix(now.state[S.ATTITUDE : S.VELOCITY])[2, 2])
    return range_along(down, -float(now.state[2]) - ground_altitude)


def range_along(down: float, height: float) -> float:
    """Distance from a height [m] to the ground along a direction with a part downwards; inf where it looks up."""
    return max(0.0, height) / down if down > 0.0 else math.inf


def static_pressure(height: float, origin_altitude: float, temperature_offset: float) -> float:
    """Pressure of the air [Pa] at a height above the origin [m], see `pressure_altitude`."""
    return standard_air(pressure_altitude(height, origin_altitude, temperature_offset), temperature_offset).pressure


def pressure_altitude(height: float, origin_altitude: float, temperature_offset: float) -> float:
    """Pressure altitude [m] at a height above the origin [m], within the range of the standard atmosphere.

    On a day that is warmer than the standard by dT at every pressure, a layer dH of pressure altitude is
    dh = dH (1 + dT / T(H)) thick: the hydrostatic equation with the same pressures on both days. With the constant
    lapse rate L of the troposphere, h = H - H0 + dT / L ln(T(H) / T(H0)); above, T is constant.
    The height counts as geopotential.
    """

    def temperature(altitude: float) -> float:
        return TEMPERATURE + LAPSE_RATE * min(altitude, TROPOPAUSE)

    def thickness(altitude: float) -> float:
        """Of the layer from sea level of the standard to a pressure altitude [m]."""
        warmer = math.log(temperature(altitude) / TEMPERATURE) / LAPSE_RATE
        warmer += max(0.0, altitude - TROPOPAUSE) / temperature(altitude)
        return altitude + temperature_offset * warmer

    altitude, wanted = origin_altitude + height, thickness(origin_altitude) + height
    for _ in range(NEWTON_STEPS if temperature_offset else 0):
        altitude = min(max(altitude, MIN_ALTITUDE), MAX_ALTITUDE)
        altitude -= (thickness(altitude) - wanted) / (1.0 + temperature_offset / temperature(altitude))
    return min(max(altitude, MIN_ALTITUDE), MAX_ALTITUDE)
