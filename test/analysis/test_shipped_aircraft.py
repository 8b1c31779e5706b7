"""Aircraft of the repository made of rotors of `sbs`: trims, symmetries, and what each control does."""

import numpy as np
import pytest

from sbs_sim import Aircraft, linearize, sweep, trim
from sbs_sim.analysis.export import sweep_to_csv
from sbs_sim.analysis.sweep_plots import trim_figure


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


def test_a_rotor_that_nothing_drives_is_reported():
    """An autogiro in still air: its rotor all but stands, and no blade is held by centrifugal force."""
    still = trim(Aircraft.load("pca2"))
    (line,) = (line for line in still.warnings if "too slowly" in line)
    assert line.startswith("rotor: turns at ")
    assert line.endswith(" of 140 rpm, too slowly to hold its blades")
    assert not any("too slowly" in line for line in trim(Aircraft.load("pca2"), 30.0).warnings)


def test_a_sweep_shows_the_speed_of_a_free_rotor():
    """An autogiro turns the faster the faster it flies, and its CSV and table say so."""
    found = sweep(Aircraft.load("pca2"), "airspeed", [20.0, 30.0, 40.0], linear=False)
    speeds = found["rotor_speed"][:, 0]
    assert found.has_free_speeds
    assert (np.diff(speeds) > 0.0).all()
    np.testing.assert_allclose(speeds, found["Omega(1)"], rtol=1e-12)
    header = sweep_to_csv(found).partition("\n")[0]
    assert "rotor_speed(1) [rad/s]" in header
    assert len(trim_figure(found).axes) == 6
    fixed = sweep(Aircraft.load("tandem"), "airspeed", [0.0], linear=False)
    assert not fixed.has_free_speeds
    assert fixed["rotor_speed"].tolist() == [[rotor.speed for rotor in Aircraft.load("tandem").rotors]]
