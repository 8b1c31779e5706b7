"""Flying qualities: scales, levels, step responses against closed forms and python-control, and some aircraft."""

import dataclasses
import json
import math
import subprocess
import sys
from pathlib import Path

import control
import numpy as np
import pytest
from helpers import build

from sbs_sim import Aircraft, linearize, qualities
from sbs_sim.analysis.modes import Mode
from sbs_sim.analysis.qualities import attitude_transfer, default_airspeeds
from sbs_sim.analysis.qualities_format import both_headings, both_table
from sbs_sim.analysis.quality_limits import Scale, limits, scales
from sbs_sim.analysis.step_response import first_order, first_peak, output_row, step_response, times
from sbs_sim.errors import LinearizationError

QUALITIES = Path(__file__).resolve().parents[2] / "install" / "sbs_sim" / "lib" / "sbs_sim" / "qualities"


@pytest.fixture(scope="module")
def uh60a():
    return Aircraft.load("uh60a_tm85890")


@pytest.fixture(scope="module")
def bare(sbs):
    return qualities(sbs, [0.0, 20.0])


def oscillation(growth, frequency):
    """Mode with a real part and a magnitude of its pole."""
    pole = complex(growth, math.sqrt(frequency**2 - growth**2))
    return Mode("phugoid", pole, np.ones(1, complex), np.ones(1), "body")


def test_the_bare_and_the_controlled_aircraft_beside_each_other(bare):
    """Here the controlled one is the bare one, which at 20 m/s was judged by its pitch bandwidth alone."""
    fast = bare.points[1]
    alone = tuple(tuple(one for one in judged if one.name == "pitch_bandwidth") for judged in fast.judged)
    held = dataclasses.replace(bare, points=(bare.points[0], dataclasses.replace(fast, judged=alone)))
    rows = both_table(bare, held, 0)
    assert {len(row) for row in rows} == {len(both_headings(held))}
    found = {(row[0], row[4]): row[5:] for row in rows}
    assert found["pitch bandwidth", "controlled"] == found["pitch bandwidth", "bare"] == ["- (3)", "- (3)"]
    slow, gone = found["roll bandwidth", "controlled"]
    assert slow == found["roll bandwidth", "bare"][0]
    assert gone == ""
    titles = [row[0] for row in rows]
    assert titles.index("pitch bandwidth") + 1 == titles.index("pitch bandwidth", titles.index("pitch bandwidth") + 1)


# -- scales ----------------------------------------------------------------------------------------------------------


def test_scales_are_by_span_and_by_rotor(sbs, uh60a):
    """Froude: sqrt(16.36 / 2.3) and sqrt(8.178 / 0.505); at full size both are one."""
    assert sbs.rotor_span == pytest.approx(2.0 * (0.645 + 0.505))
    assert [scale.speed_up for scale in scales(sbs)] == pytest.approx([2.667, 4.024], abs=1e-3)
    assert [scale.speed_up for scale in scales(uh60a)] == pytest.approx([1.0], abs=1e-3)
    assert [scale.speed_up for scale in scales(sbs, 4.09)] == pytest.approx([2.0])
    assert default_airspeeds(scales(sbs)[0]) == [0.0, 5.0, 10.0, 15.0, 20.0]


def test_span_takes_rotors_as_they_stand(uh60a):
    """The tail rotor turns about y, but for its cant of 20 deg, and does not reach beyond the main rotor."""
    assert uh60a.rotor_span == pytest.approx(2.0 * uh60a.rotors[0].radius)


def test_low_speed_ends_at_45_kt_of_full_size():
    small = Scale("span", 4.09, 16.36)
    assert limits().flight(23.15 / 2.0 - 0.01, small) == "low_speed"
    assert limits().flight(23.15 / 2.0 + 0.01, small) == "forward"


# -- levels ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("value", "level"), [(1.0, 1), (0.99, 2), (0.5, 2), (0.49, 3), (math.nan, 3)])
def test_levels_of_a_range(value, level):
    assert limits().by_name["pitch_bandwidth"].level_of(value) == level


@pytest.mark.parametrize(
    ("growth", "frequency", "level"),
    [
        (0.039, 0.4, 1),  # a damping ratio of -0.0975 at 0.4 rad/s
        (0.041, 0.4, 2),
        (0.06, 0.4, 3),  # doubles in 11.6 s
        (0.15, 0.4, 4),  # in 4.6 s
        (-0.001, 0.8, 1),
        (0.001, 0.9, 3),
        (0.001, 1.3, 4),
        (-0.36 * 2.0, 2.0, 1),
        (-0.34 * 2.0, 2.0, 2),
    ],
)
@pytest.mark.parametrize("speed_up", [1.0, 2.667])
def test_levels_of_oscillations(growth, frequency, level, speed_up):
    mode = oscillation(growth * speed_up, frequency * speed_up)
    assert limits().by_name["oscillation"].level_of_mode(mode, speed_up) == level


@pytest.mark.parametrize(("time", "level"), [(math.inf, 1), (20.5, 1), (19.5, 2), (11.5, 3), (3.9, 4)])
def test_levels_of_the_spiral(time, level):
    mode = Mode("spiral", complex(math.log(2.0) / time, 0.0), np.ones(1, complex), np.ones(1), "body")
    assert limits().by_name["spiral"].level_of_mode(mode, 1.0) == level


def test_every_boundary_says_where_it_is_from():
    for limit in limits().by_name.values():
        assert limit.source
        assert limit.paragraph
        assert limit.is_read is False  # to be changed by whoever has read it in the standard


# -- step responses --------------------------------------------------------------------------------------------------


def test_step_response_is_that_of_python_control(sbs):
    model = linearize(sbs, airspeed=10.0)
    names = ("theta", "phi", "climb_rate", "thrust(1)")
    rows = np.array([output_row(model, name) for name in names])
    ours = step_response(model, "lateral_cyclic", rows, 2.0)
    theirs = control.step_response(model.to_control(), times(2.0), input_indices=1, squeeze=False).outputs[:, 0]
    for row, name in zip(ours, names, strict=True):
        expected = theirs[model.output_names.index(name)]
        np.testing.assert_allclose(row, expected, atol=1e-6 * np.abs(expected).max())


@pytest.mark.parametrize("delay", [0.0, 0.1, 0.1234])
def test_a_delay_moves_the_response(sbs, delay):
    model = linearize(sbs)
    row = output_row(model, "climb_rate")[np.newaxis]
    late = step_response(model, "collective", row, 2.0, delay)[0]
    for i in (30, 100, 400):
        plain = step_response(model, "collective", row, times(2.0)[i] - delay)[0]
        assert late[i] == pytest.approx(plain[-1], rel=1e-9)
    assert not late[times(2.0) < delay].any()


@pytest.mark.parametrize(("gain", "constant", "delay"), [(3.0, 1.2, 0.15), (-40.0, 4.0, 0.0), (1.0, 0.2, 0.3)])
def test_fit_of_the_first_order_finds_its_own(gain, constant, delay):
    at = times(5.0)
    response = gain * (1.0 - np.exp(-np.maximum(at - delay, 0.0) / constant))
    found = first_order(response, 5.0)
    assert (found.gain, found.time_constant) == pytest.approx((gain, constant), rel=1e-4)
    assert found.delay == pytest.approx(delay, abs=1e-4)
    assert found.determination == pytest.approx(1.0, abs=1e-6)
    assert found.is_good


def test_a_ramp_is_one():
    found = first_order(2.0 * times(5.0), 5.0)
    assert found.is_ramp


def test_first_peak_or_what_stands_for_it():
    at = times(3.0)
    assert first_peak(np.sin(2.0 * at), 3.0, 1.0) == pytest.approx(1.0, abs=1e-4)
    assert first_peak(-at, 3.0, 1.0) == pytest.approx(-1.0)


# -- aircraft --------------------------------------------------------------------------------------------------------


def test_heading_is_the_integral_of_the_yaw_rate(uh60a):
    model = linearize(uh60a)
    frequencies = np.geomspace(0.1, 20.0, 30)
    roll, pitch = model.trim.roll, model.trim.pitch
    rates = [model.frequency_response("pedal", name, frequencies).response for name in ("q", "r")]
    expected = (math.sin(roll) * rates[0] + math.cos(roll) * rates[1]) / (1j * frequencies * math.cos(pitch))
    found = attitude_transfer(model, "yaw").at(frequencies)
    np.testing.assert_allclose(found, expected, rtol=1e-9)


def test_bare_side_by_side_has_no_pitch_bandwidth_and_says_so(bare):
    for i in (0, 1):
        for quality in bare.rows(i)["pitch_bandwidth"]:
            assert math.isnan(quality.value)
            assert quality.level == 3
            assert quality.remark.startswith("no bandwidth: the phase is -1")


def test_heave_in_hover_is_that_of_its_mode(sbs, bare):
    """Heave does not couple in hover: the time constant is that of the subsidence, behind the lag of the inflow."""
    mode = bare.points[0].model.mode("heave subsidence")
    rows = bare.rows(0)
    assert rows["heave_time_constant"][0].value == pytest.approx(-1.0 / mode.pole.real, rel=0.05)
    assert rows["heave_delay"][0].value < 0.02


def test_symmetry_leaves_no_coupling(bare):
    for name in ("roll_from_pitch", "pitch_from_roll", "yaw_from_collective"):
        for quality in bare.rows(0)[name]:
            assert quality.value == pytest.approx(0.0, abs=2e-3)


def test_values_do_not_depend_on_the_scale_where_they_must_not(bare):
    """Poles and bandwidths are the aircraft's own; only their levels are of a scale."""
    for name in ("roll_bandwidth", "pitch_phase_delay", "phugoid: damping ratio", "spiral: time to half (-: double)"):
        by_span, by_rotor = ([quality.value for quality in bare.rows(i)[name]] for i in (0, 1))
        np.testing.assert_array_equal(by_span, by_rotor)


def test_hover_oscillation_grows_too_fast(bare):
    """It doubles in 1.8 s, which is 4.8 s at full size by the span: worse than level 3; by the rotor 7.3 s."""
    assert [bare.rows(i)["phugoid: damping ratio"][0].level for i in (0, 1)] == [4, 3]


def test_delay_costs_bandwidth(uh60a):
    plain, late = (qualities(uh60a, [0.0], delay=delay).rows() for delay in (0.0, 0.05))
    assert late["roll_bandwidth"][0].value < plain["roll_bandwidth"][0].value
    gained = late["roll_phase_delay"][0].value - plain["roll_phase_delay"][0].value
    assert gained == pytest.approx(0.025, abs=0.01)  # half of the delay, where the rest of the phase were straight


@pytest.mark.parametrize(
    ("given", "text"),
    [
        ({"delay": -1.0}, "delay = -1.0: allowed are 0 to 10 s"),
        ({"scale_length": 0.0}, "scale_length = 0.0: allowed are 0.01 to 1000 m"),
    ],
)
def test_bad_values_are_named(sbs, given, text):
    with pytest.raises(LinearizationError) as caught:
        qualities(sbs, [0.0], **given)
    assert str(caught.value) == text


def test_stands_and_two_blades_are_refused():
    with pytest.raises(LinearizationError, match=r"body\.stand"):
        qualities(Aircraft.load("castles_gray"), [0.0])
    with pytest.raises(LinearizationError, match=r"rotors\.blades = 2"):
        qualities(build(every_rotor={"blades": 2}), [0.0])


def test_what_cannot_be_trimmed_is_a_remark(sbs):
    found = qualities(sbs, [0.0, 190.0])
    assert found.points[1].error
    assert found.rows()["pitch_bandwidth"][1] is None


def test_command_writes_a_page_and_json(tmp_path):
    arguments = ["--airspeeds", "10", "--delay", "0.02", "--out", str(tmp_path)]
    result = subprocess.run(
        [sys.executable, str(QUALITIES), *arguments], capture_output=True, text=True, timeout=120, check=False
    )
    assert (result.returncode, result.stderr) == (0, "")
    assert "by lateral span 2.3 m for 16.36 m: frequencies x 2.67" in result.stdout
    assert "by rotor radius 0.505 m for 8.178 m: frequencies x 4.02" in result.stdout
    assert "no bandwidth: the phase is -1" in result.stdout
    page = (tmp_path / "index.html").read_text()
    assert page.count("<svg") == 7
    assert "not read in the standard" in page
    read = json.loads((tmp_path / "qualities.json").read_text())
    assert read["delay"] == 0.02
    assert [point["airspeed"] for point in read["points"]] == [10.0]
    assert all((tmp_path / f"figure_0{number}.png").stat().st_size > 10000 for number in range(1, 8))
