"""Aircraft of the repository made of rotors of `sbs`: trims, symmetries, and what each control does."""

import numpy as np
import pytest

from sbs_sim import Aircraft, linearize, trim


@pytest.mark.parametrize("name", ["tandem", "coaxial"])
def test_two_equal_rotors_share_the_weight_and_their_torques_cancel(name):
    aircraft = Aircraft.load(name)
    hover = trim(aircraft)
    weight = aircraft.body.mass * aircraft.environment.gravity
    np.testing.assert_allclose(hover.thrust, weight / 2, rtol=1e-6)
    np.testing.assert_allclose(hover.torque[0], hover.torque[1], rtol=1e-6)
    np.testing.assert_allclose([hover.pitch, hover.roll, hover["pedal"]], 0.0, atol=1e-6)
    assert hover.beyond_limits == ()


@pytest.mark.parametrize("name", ["tandem", "coaxial"])
def test_each_control_moves_the_axis_of_its_stick(name):
    model = linearize(Aircraft.load(name))
    axes = [(effect.axis, effect.words.partition(",")[0]) for effect in model.control_effects]
    assert axes == [("heave", "up"), ("roll", "rolls right"), ("pitch", "nose down"), ("yaw", "nose left")]
    assert model.growing_rotor_modes == ()


@pytest.mark.parametrize("name", ["tandem", "coaxial"])
def test_it_flies_forward_within_its_ranges(name):
    cruise = trim(Aircraft.load(name), 12.0)
    assert cruise.beyond_limits == ()
    assert cruise.pitch < 0.0
    assert cruise.power.sum() < trim(Aircraft.load(name)).power.sum()
