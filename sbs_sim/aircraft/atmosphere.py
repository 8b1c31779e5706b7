"""The standard atmosphere: air at an altitude, for aircraft files that give an altitude and not the air itself.

ISO 2533:1975 and the U.S. Standard Atmosphere, 1976 (NOAA-S/T 76-1562), which agree from -5 to 32 km: the troposphere
with its constant lapse rate, and the isothermal lower stratosphere up to 20 km.
"""

import math
from typing import NamedTuple

from sbs_sim.model.elementary import exponential, power

MIN_ALTITUDE, MAX_ALTITUDE = -5000.0, 20000.0  # geopotential [m]
TROPOPAUSE = 11000.0  # geopotential [m]
TEMPERATURE, PRESSURE = 288.15, 101325.0  # at sea level [K], [Pa]
LAPSE_RATE = -0.0065  # [K/m]
GRAVITY = 9.80665  # of the standard [m/s^2]: the altitude is geopotential
GAS_CONSTANT = 287.05287  # of dry air [J/(kg K)]
HEAT_RATIO = 1.4
SUTHERLAND_FACTOR, SUTHERLAND_TEMPERATURE = 1.458e-6, 110.4  # [kg/(m s sqrt K)], [K]


class Air(NamedTuple):
    """Air at rest: [K], [Pa], [kg/m^3], [m^2/s] and [m/s]."""

    temperature: float
    pressure: float
    density: float
    kinematic_viscosity: float
    speed_of_sound: float


def standard_air(altitude: float, temperature_offset: float = 0.0) -> Air:
    """Air of the standard atmosphere, or of a day that is warmer or colder by the same amount everywhere.

    Parameters
    ----------
    altitude : float
        Pressure altitude, which is the geopotential altitude of the standard day [m], -5 to 20 km.
    temperature_offset : float
        Temperature above that of the standard at this pressure [K].

    Returns
    -------
    Air
        theory.md section 5.7; rounded right, so that an aircraft is the same on every machine.
    """
    standard = TEMPERATURE + LAPSE_RATE * min(altitude, TROPOPAUSE)
    pressure = PRESSURE * power(standard / TEMPERATURE, -GRAVITY / (LAPSE_RATE * GAS_CONSTANT))
    if altitude > TROPOPAUSE:
        pressure *= exponential(-GRAVITY * (altitude - TROPOPAUSE) / (GAS_CONSTANT * standard))
    temperature = standard + temperature_offset
    density = pressure / (GAS_CONSTANT * temperature)
    viscosity = SUTHERLAND_FACTOR * (temperature * math.sqrt(temperature)) / (temperature + SUTHERLAND_TEMPERATURE)
    return Air(temperature, pressure, density, viscosity / density, math.sqrt(HEAT_RATIO * GAS_CONSTANT * temperature))
