"""The standard atmosphere against the printed tables of the standard, and aircraft files with an altitude."""

import math

import numpy as np
import pytest
from helpers import aircraft_data
from scipy.integrate import solve_ivp

from sbs_sim.aircraft import Aircraft
from sbs_sim.aircraft.atmosphere import standard_air
from sbs_sim.errors import AircraftError

# ISO 2533:1975, tables over the geopotential altitude, and U.S. Standard Atmosphere, 1976, tables I and III: H [m],
# T [K], p [Pa], rho [kg/m^3], a [m/s]
PRINTED = [
    (0, 288.150, 101325, 1.22500, 340.294),
    (1000, 281.650, 89874.6, 1.11164, 336.434),
    (5000, 255.650, 54019.9, 0.736116, 320.529),
    (11000, 216.650, 22632.0, 0.363918, 295.069),
    (15000, 216.650, 12044.6, 0.193674, 295.069),
    (20000, 216.650, 5474.87, 0.0880347, 295.069),
]


@pytest.mark.parametrize("row", PRINTED, ids=lambda row: f"{row[0]}m")
def test_the_air_is_that_of_the_printed_tables(row):
    air = standard_air(row[0])
    found = (air.temperature, air.pressure, air.density, air.speed_of_sound)
    np.testing.assert_allclose(found, row[1:], rtol=5e-6)


@pytest.mark.parametrize(("altitude", "printed"), [(0.0, 1.7894e-5), (11000.0, 1.4216e-5)])
def test_the_dynamic_viscosity_is_that_of_the_printed_tables(altitude, printed):
    air = standard_air(altitude)
    assert air.kinematic_viscosity * air.density == pytest.approx(printed, abs=0.6e-9)


def test_the_pressure_carries_the_air_above_it():
    """dp/dH = -rho g of the hydrostatic equation, integrated numerically across the tropopause."""
    solution = solve_ivp(
        lambda height, p: [-p[0] * 9.80665 / (287.05287 * max(288.15 - 0.0065 * height, 216.65))],
        (0, 18000),
        [101325.0],
        rtol=1e-10,
        atol=1e-6,
        max_step=500,
    )
    assert standard_air(18000.0).pressure == pytest.approx(solution.y[0, -1], rel=1e-7)


def test_warm_air_is_thin_at_the_same_pressure():
    standard, warm = standard_air(2000.0), standard_air(2000.0, 25.0)
    assert warm.pressure == standard.pressure
    assert warm.density / standard.density == pytest.approx(275.15 / 300.15, rel=1e-12)
    assert warm.speed_of_sound / standard.speed_of_sound == pytest.approx(math.sqrt(300.15 / 275.15), rel=1e-12)


def with_environment(**environment):
    data = aircraft_data()
    data["environment"] = {"gravity": 9.80665, **environment}
    return data


def test_an_altitude_in_the_file_is_the_air_of_the_model():
    aircraft = Aircraft.from_dict(with_environment(altitude=1500.0, temperature_offset=-10.0))
    air, found = standard_air(1500.0, -10.0), aircraft.environment
    assert (found.air_density, found.kinematic_viscosity) == (air.density, air.kinematic_viscosity)
    assert found.speed_of_sound == air.speed_of_sound
    assert aircraft.model().air["density"][0, 0] == air.density
    given = {"air_density": air.density, "kinematic_viscosity": air.kinematic_viscosity}
    assert Aircraft.from_dict(with_environment(**given)).parameter_hash == aircraft.parameter_hash


def test_an_altitude_replaces_the_values_of_the_air(sbs):
    high = sbs.with_value("environment.altitude", 3000.0)
    assert high.environment.air_density == standard_air(3000.0).density
    assert high.environment.gravity == sbs.environment.gravity
    assert high.with_value("body.mass", 20.0).environment == high.environment


@pytest.mark.parametrize(
    ("environment", "message"),
    [
        (
            {"altitude": 0.0, "air_density": 1.2},
            "environment.air_density = 1.2: allowed is to leave the key out where the file has environment.altitude",
        ),
        (
            {"air_density": 1.2, "kinematic_viscosity": 1.5e-5, "temperature_offset": 5.0},
            "environment.temperature_offset = 5.0: allowed is to leave the key out where the file has no"
            " environment.altitude",
        ),
        ({"air_density": 1.2}, "environment.kinematic_viscosity: missing key"),
        ({"altitude": 25000.0}, "environment.altitude = 25000.0: allowed is <= 20000.0"),
    ],
)
def test_the_air_is_given_in_one_way(environment, message):
    with pytest.raises(AircraftError) as caught:
        Aircraft.from_dict(with_environment(**environment))
    assert str(caught.value) == message
