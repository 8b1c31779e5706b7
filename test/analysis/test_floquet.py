"""Floquet exponents beside the poles of the averaged model."""

import dataclasses
import math

import numpy as np
import pytest
from helpers import TEST_STAND, WEIGHTLESS_VACUUM, build
from scipy.linalg import expm

from sbs_sim import linearize, trim
from sbs_sim.aircraft import Aircraft
from sbs_sim.analysis.floquet import Floquet, _beside, floquet, transition
from sbs_sim.analysis.isolated_rotor import IsolatedRotor
from sbs_sim.analysis.periodic import common_period
from sbs_sim.analysis.validation.hammond import multipliers_of_equations
from sbs_sim.errors import LinearizationError, TrimError
from sbs_sim.flight.trim_point import Fidelity


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


def test_a_rotor_without_one_of_its_lag_dampers(hover):
    """Vacuum, a hub that nothing moves: every blade for itself decays by C / (2 A2), but for the one without a damper.

    The averaged model gives every lag mode the mean of them, which is wrong: it has no mode without damping.
    """
    damping = 0.5
    rotor = {"lag_damping": damping, "blade_lag_damping": [1.0, 1.0, 0.0]}
    aircraft = build(environment=WEIGHTLESS_VACUUM, body=TEST_STAND, every_rotor=rotor)
    still = dataclasses.replace(hover, state=np.zeros_like(hover.state), controls=np.zeros_like(hover.controls))
    found = floquet(aircraft, still, azimuth_count=96)
    own = aircraft.rotors[0]
    assert found.period == pytest.approx(2.0 * math.pi / own.speed)  # a whole revolution
    inertia = own.second_moment + own.flap_hinge_offset * (
        own.blade_mass * own.flap_hinge_offset + 2.0 * own.first_moment
    )
    decay = -damping / (2.0 * inertia)
    damped = np.sort(found.exponents.real[found.exponents.real < 0.25 * decay])
    np.testing.assert_allclose(damped, decay, rtol=1e-3)
    assert len(damped) == 2 * 2 * 2  # pairs of two blades of two rotors
    averaged = found.poles.real[found.poles.real < 0.25 * decay]
    np.testing.assert_allclose(averaged, 2.0 / 3.0 * decay, rtol=0.02)
    assert len(averaged) == 2 * 2 * 3


@pytest.mark.parametrize(("factors", "growth"), [([1.0, 1.0, 1.0, 1.0], -0.3354), ([1.0, 1.0, 1.0, 0.0], 0.3258)])
def test_ground_resonance_without_one_lag_damper(factors, growth):
    """Hammond's case (J. AHS 19 (4), 1974) at 255 rpm: stable with all dampers, unstable without one of them."""
    aircraft = Aircraft.load("hammond").with_value("rotors.blade_lag_damping", factors)
    rotor = IsolatedRotor(aircraft, Fidelity(azimuth_count=1))
    exponents = rotor.exponents(rotor.steady((0.0, 0.0, 0.0)), inflow=False)
    period = 2 * math.pi / rotor.rotor.speed
    theirs, ours = multipliers_of_equations(rotor.rotor.speed, factors), np.exp(exponents * period)
    np.testing.assert_allclose(np.abs(ours[:, None] - theirs).min(axis=0), 0.0, atol=1e-6)
    assert math.log(np.abs(theirs).max()) / period == pytest.approx(growth, abs=1e-4)
    if growth > 0:  # flap, which takes no part, neither grows nor decays
        assert exponents[0].real == pytest.approx(growth, abs=1e-4)
    else:
        assert exponents[0].real == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("count", [7, 6, -8])
def test_exponents_of_a_rotor_need_an_even_count(count):
    rotor = IsolatedRotor(Aircraft.load("hammond"))
    with pytest.raises(TrimError, match=f"azimuth_count = {count}: allowed are even numbers from 8"):
        rotor.exponents(rotor.steady((0.0, 0.0, 0.0)), count)


def test_models_of_unequal_blades_say_that_they_are_averages(sbs):
    aircraft = sbs.with_value("rotors.MR1.blade_lag_damping", [1.0, 0.0, 1.0])
    model = linearize(aircraft)
    line = "MR1: blades with unequal lag dampers: this is a mean over a revolution, stability needs Floquet's method"
    assert model.warnings == (line,)
    assert linearize(sbs).warnings == ()
    assert aircraft.passages == (1, 3)


def test_period_is_common_to_all_rotors():
    slow = [{}, {"speed_rpm": 1600.0}]
    period, passages = common_period(build(rotors=slow))
    assert passages == [3, 2]
    assert period == pytest.approx(60.0 / 1600.0 / 3 * 2)
    with pytest.raises(LinearizationError, match="no common period"):
        common_period(build(rotors=[{}, {"speed_rpm": 2400.0 * math.sqrt(0.5)}]))


def test_periods_are_searched_up_to_sixty_passages():
    _, passages = common_period(build(rotors=[{"speed_rpm": 2440.0}, {"speed_rpm": 2400.0}]))
    assert passages == [61, 60]
    with pytest.raises(LinearizationError, match="of up to 60 of them"):
        common_period(build(rotors=[{"speed_rpm": 2480.0}, {"speed_rpm": 2440.0}]))


def test_transition_is_of_fourth_order():
    """A constant system seen in axes that turn is periodic, and its transition over a turn is known."""
    rate, constant = 3.0, np.array([[-0.5, 2.0], [0.3, 0.2]])
    turning = rate * np.array([[0.0, -1.0], [1.0, 0.0]])
    period = 2.0 * math.pi / rate
    exact, errors = expm((constant - turning) * period), []
    for count in (48, 96, 192):
        axes = [expm(turning * period * i / count) for i in range(count)]
        found = transition(np.array([to @ constant @ to.T for to in axes]), period)
        errors.append(np.abs(found - exact).max())
    np.testing.assert_allclose(np.divide(errors[:-1], errors[1:]), 16.0, rtol=0.1)
    assert errors[-1] < 1e-5


def test_exponents_are_on_the_branch_of_their_poles():
    """Poles up to some turns per period, given in another order than their multipliers."""
    period = 0.7
    poles = np.array([-0.5 + 0j, -1.0 - 3j, -1.0 + 3j, -0.2 - 30j, -0.2 + 30j, 0.1 - 7.5j, 0.1 + 7.5j])
    multipliers, exponents = _beside(poles, np.exp(poles * period)[[3, 1, 6, 0, 2, 5, 4]], period)
    np.testing.assert_allclose(exponents, poles, atol=1e-12)
    np.testing.assert_allclose(multipliers, np.exp(poles * period), atol=1e-12)


def test_differences_are_shares_of_the_poles():
    poles = np.array([0.0, -2.0, 4.0j])
    found = Floquet(1.0, np.eye(3), np.exp(poles), poles * [1.0, 1.01, 1.0 - 0.02j], poles)
    np.testing.assert_allclose(found.difference, [0.0, 0.01, 0.02], rtol=1e-9)


@pytest.mark.parametrize("count", [-2, 0, 7, 13, 1002])
def test_bad_counts_are_named(sbs, hover, count):
    with pytest.raises(LinearizationError, match=f"azimuth_count = {count}: allowed are even numbers from 8 to 1000"):
        floquet(sbs, hover, count)
