"""Scale lengths and intensities of military specifications, and gusts of certification rules."""

import math

import numpy as np
import pytest

from sbs_sim.errors import SimulationError
from sbs_sim.flight.gust_file import gust_table, read_gust
from sbs_sim.flight.gust_standards import certification_gust, intensities, scale_lengths, specified_turbulence
from sbs_sim.model.wind import Wind

FT, KN = 0.3048, 0.514444


@pytest.mark.parametrize(
    ("feet", "horizontal", "vertical"),
    # h / (0.177 + 0.000823 h)^1.2 by hand, 1 at 1000 ft but for rounding of the coefficients
    [(10, 75.7, 10), (100, 505.1, 100), (1000, 1000.0, 1000), (1500, 1375.0, 1375), (2000, 1750, 1750)],
)
def test_lengths_of_both_specifications(feet, horizontal, vertical):
    """MIL-F-8785C, 3.7.3.4: L_w = h, L_u = L_v; MIL-HDBK-1797: 2 L_w = h, L_u = 2 L_v; 1750 ft above 2000 ft."""
    first, second = (np.array(scale_lengths(feet * FT, name)) / FT for name in ("MIL-F-8785C", "MIL-HDBK-1797"))
    np.testing.assert_allclose(first, [horizontal, horizontal, vertical], rtol=2e-3)
    np.testing.assert_allclose(second, first * [1.0, 0.5, 0.5], rtol=1e-12)


def test_heights_below_ten_feet_count_as_ten_feet():
    for height in (-3.0, 0.0, 1.0):
        assert scale_lengths(height) == scale_lengths(10 * FT)
        assert intensities(height) == intensities(10 * FT)


def test_intensities_by_name_by_wind_and_by_probability():
    """0.1 W_20 down, and 1 / (0.177 + 0.000823 h)^0.4 of it across; figure 7 of MIL-F-8785C above 2000 ft."""
    u, v, w = intensities(100 * FT, "light")
    assert (u, w) == (v, pytest.approx(1.5 * KN, rel=1e-5))
    assert u / w == pytest.approx((0.177 + 0.0823) ** -0.4, rel=1e-12)
    assert intensities(100 * FT, wind_at_20ft=7.0)[2] == pytest.approx(0.7)
    for severity, feet_per_second in (("light", 6.7), ("moderate", 10.1), ("severe", 23.6)):
        np.testing.assert_allclose(intensities(7500 * FT, severity), feet_per_second * FT, rtol=1e-12)
    assert intensities(7500 * FT, probability=1e-6)[0] == pytest.approx(30.2 * FT)
    below, above = intensities(1000 * FT, "severe")[2], intensities(2000 * FT, "severe")[2]
    assert intensities(1500 * FT, "severe")[2] == pytest.approx((below + above) / 2)


def test_turbulence_of_the_specification_is_a_wind():
    wind = Wind(**specified_turbulence(30.0, "severe", model="von_karman"), turbulence_extent="field")
    assert wind.turbulence_lengths == scale_lengths(30.0)
    assert specified_turbulence(1000.0, model="von_karman")["turbulence_length"] == pytest.approx(2500 * FT)


def test_gusts_of_the_rules():
    """CS 25.341(a): 17.07 m/s EAS at H = 107 m at sea level; CS 29.341: 30 ft/s."""
    large = certification_gust("cs25", gradient=107.0)
    assert (large["gust"], large["gust_length"]) == ((0.0, 0.0, pytest.approx(-17.07)), 214.0)
    smaller = certification_gust("cs25", gradient=9.0, to="right", speed="VD")
    assert smaller["gust"][1] == pytest.approx(0.5 * 17.07 * (9 / 107) ** (1 / 6))
    high = certification_gust("cs25", gradient=107.0, altitude=4572.0)
    assert high["gust"][2] == pytest.approx(-13.41 / math.sqrt(0.6292), rel=1e-3)  # the density ratio at 15 000 ft
    small = certification_gust("cs23", chord=1.2)
    assert (small["gust"][2], small["gust_length"]) == (pytest.approx(-15.24), pytest.approx(30.0))
    rotorcraft = certification_gust("cs29", gradient=20.0, to="left")
    assert rotorcraft == {"gust": (0.0, pytest.approx(-9.144), 0.0), "gust_length": 20.0, "gust_shape": "ramp"}
    assert Wind(**certification_gust("mil_f_8785c", gradient=5.0, velocity=3.0)).gust == (0.0, 0.0, -3.0)


@pytest.mark.parametrize(
    ("call", "line"),
    [
        (lambda: scale_lengths(math.nan), "height = nan: allowed are -1000 to 24384 m"),
        (lambda: scale_lengths(1.0, "MIL"), "specification = 'MIL': allowed are MIL-F-8785C, MIL-HDBK-1797"),
        (lambda: intensities(1.0, "heavy"), "severity = 'heavy': allowed are light, moderate, severe"),
        (lambda: intensities(1.0, probability=0.5),
         "probability = 0.5: allowed are 0.2, 0.1, 0.01, 0.001, 0.0001, 1e-05, 1e-06"),
        (lambda: certification_gust("cs27", gradient=5.0, to="left"),
         "to = 'left': allowed are up, down with name = 'cs27', whose gusts are vertical"),
        (lambda: certification_gust("cs25", gradient=200.0), "gradient = 200.0: allowed are 9 to 107 m"),
        (lambda: certification_gust("cs23"), "chord: missing, which cs23 needs"),
        (lambda: certification_gust("cs29", gradient=5.0, velocity=3.0),
         "velocity = 3: allowed with mil_f_8785c only, not with name = 'cs29'"),
        (lambda: gust_table("time [s],north [m/s],east [m/s],down [m/s]\n0,0,0,0\n1,nan,0,0", "own.csv"),
         "own.csv, line 3: '1,nan,0,0': allowed are 4 numbers"),
        (lambda: gust_table("time [s],north [m/s],east [m/s],down [m/s]\n\n0,0,0,0\n1,0,0,-200", "own.csv"),
         "own.csv, line 4: down [m/s] = -200.0: allowed are -100 to 100"),
        (lambda: gust_table("distance [m],north [m/s],east [m/s],down [m/s]\n1e7,0,0,0", "own.csv"),
         "own.csv, line 2: distance [m] = 10000000.0: allowed are -1e+06 to 1e+06"),
        (lambda: gust_table("time [s],north [m/s],east [m/s],down [m/s]\n0,0,0,0\n\n0,0,0,1", "own.csv"),
         "own.csv, line 4: time [s] = 0: allowed is more than 0, the one before"),
        (lambda: gust_table("time [s],north [m/s],east [m/s],down [m/s]", "own.csv"),
         "own.csv: own_gust.positions has shape (0,): allowed are 1 to 10000 numbers"),
        (lambda: read_gust("/no/such/file.csv"), "/no/such/file.csv: No such file or directory"),
    ],
)  # fmt: skip
def test_what_no_rule_has_is_refused_in_one_line(call, line):
    with pytest.raises(SimulationError) as caught:
        call()
    assert str(caught.value) == line
