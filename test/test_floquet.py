"""Floquet exponents beside the poles of the averaged model."""

import math

import numpy as np
import pytest
from helpers import build

from sbs_sim import linearize, trim
from sbs_sim.analysis.floquet import common_period, floquet
from sbs_sim.errors import LinearizationError


@pytest.mark.parametrize(("lead_lag", "cyclic_inflow"), [(False, False), (True, False), (True, True)])
def test_hover_has_the_poles_of_the_averaged_model(sbs, lead_lag, cyclic_inflow):
    point = trim(sbs, lead_lag=lead_lag, cyclic_inflow=cyclic_inflow)
    found = floquet(sbs, point)
    assert found.difference.max() < 1e-9  # the model does not change with the azimuth


def test_forward_flight_has_them_nearly(sbs):
    """What averaging costs at 10 m/s: below 1e-3 of the pole, or of 1 rad/s for the slow ones."""
    found = floquet(sbs, trim(sbs, 10.0))
    distance = np.abs(found.exponents - found.poles)
    assert (distance / np.maximum(np.abs(found.poles), 1.0)).max() < 1e-3
    assert distance.max() > 1e-6  # it is a check of something


def test_poles_are_those_of_the_linear_model(sbs):
    """Twelve instants of one passage are the twelve configurations of the averages."""
    point = trim(sbs, 10.0)
    poles = floquet(sbs, point, azimuth_count=12).poles
    np.testing.assert_allclose(poles, linearize(sbs, point=point).poles, rtol=1e-9, atol=1e-9)


def test_determinant_is_the_integral_of_the_trace(sbs):
    """Liouville: det of the monodromy is exp of the mean trace times the period."""
    found = floquet(sbs, trim(sbs, 10.0), azimuth_count=96)
    sign, logarithm = np.linalg.slogdet(found.monodromy)
    assert sign == 1.0
    assert logarithm == pytest.approx(found.poles.sum().real * found.period, rel=1e-4)


def test_half_the_step_changes_nothing(sbs):
    point = trim(sbs, 10.0)
    coarse, fine = floquet(sbs, point, 48), floquet(sbs, point, 96)
    np.testing.assert_allclose(coarse.exponents, fine.exponents, rtol=1e-4, atol=1e-5)  # kinks of the airfoil table


def test_differential_coordinates_change_sign_with_every_blade():
    """Four blades: the model repeats itself after two of them, and hover has the averaged model's poles."""
    aircraft = build(every_rotor={"blades": 4, "blade_mass": 0.12, "chord": {"root": 0.038, "tip": 0.038}})
    found = floquet(aircraft, trim(aircraft), azimuth_count=96)
    assert found.period == pytest.approx(math.pi / aircraft.rotors[0].speed)
    assert found.difference.max() < 1e-9


def test_period_is_common_to_all_rotors():
    slow = [{}, {"speed_rpm": 1600.0}]
    period, passages = common_period(build(rotors=slow))
    assert passages == [3, 2]
    assert period == pytest.approx(60.0 / 1600.0 / 3 * 2)
    with pytest.raises(LinearizationError, match="no common period"):
        common_period(build(rotors=[{}, {"speed_rpm": 2400.0 * math.sqrt(0.5)}]))


@pytest.mark.parametrize("count", [-2, 0, 7, 13, 1002])
def test_bad_counts_are_named(sbs, hover, count):
    with pytest.raises(LinearizationError, match=f"azimuth_count = {count}: allowed are even numbers from 8 to 1000"):
        floquet(sbs, hover, count)
