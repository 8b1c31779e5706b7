"""Aircraft of the repository made of rotors of `sbs`: trims, symmetries, and what each control does."""

import math
import re
from pathlib import Path

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


PAGE = Path(__file__).resolve().parents[2] / "docs/howto/ducts.md"


def test_ducted_trims_are_those_of_the_page():
    """The paper's aircraft with its ducts on beside that without, and the ends of the bracket of `turning`."""
    ducted = Aircraft.load("sbs_ducted")
    columns = [Aircraft.load("sbs"), *(ducted.with_value("rotors.duct.turning", share) for share in (0.0, 0.5, 1.0))]
    assert ducted == columns[2]
    rows = re.findall(r"^\| (\d+) m/s \| pitch, power \| (.+) \|$", PAGE.read_text(), flags=re.MULTILINE)
    assert [int(speed) for speed, _ in rows] == [0, 5, 10, 15, 20]
    for speed, cells in rows:
        for aircraft, cell in zip(columns, cells.split(" | "), strict=True):
            point = trim(aircraft, float(speed))
            pitch, power = (float(number) for number in re.findall(r"-?\d+\.?\d*", cell))
            assert math.degrees(point.pitch) == pytest.approx(pitch, abs=0.06)
            assert point.power.sum() == pytest.approx(power, abs=0.6)
            assert point.beyond_limits == ()


def test_ducts_turn_what_the_page_says():
    """Ram drag of all of the flow at 0.8 hover inflows of the open rotor; the phugoid decays with ducts."""
    ducted, open_ = Aircraft.load("sbs_ducted"), Aircraft.load("sbs")
    hover, rotor = trim(ducted), ducted.rotors[0]
    area, weight = math.pi * rotor.radius**2, ducted.body.mass * ducted.environment.gravity
    through = hover["lambda0(1)"] * rotor.speed * rotor.radius
    speed = 0.8 * math.sqrt(weight / 2 / (2 * ducted.environment.air_density * area))
    drag = 2 * ducted.environment.air_density * area * through * speed
    assert speed == pytest.approx(5.7, abs=0.05)
    assert drag / weight == pytest.approx(0.57, abs=0.01)
    assert linearize(ducted).mode("phugoid").pole.real < 0.0 < linearize(open_).mode("phugoid").pole.real
