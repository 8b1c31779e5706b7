"""Pilot controls of an aircraft's own: names, number, units, held ones, axes, constants of the rigging."""

import math

import numpy as np
import pytest
from helpers import PITCH_PER_INCH, renamed_data

from sbs_sim import Aircraft, linearize, simulate, trim
from sbs_sim.commands.gusts import _figures
from sbs_sim.errors import AircraftError, PilotError, SimulationError
from sbs_sim.flight.mixer import Mixer
from sbs_sim.pilot.augmentation import augmentation
from sbs_sim.pilot.hover_hold import HoverHold, HoverModel, design
from sbs_sim.pilot.piloted_flight import simulate_with_pilot


@pytest.fixture(scope="module")
def sbs():
    return Aircraft.load("sbs")


@pytest.fixture(scope="module")
def renamed():
    return Aircraft.from_dict(renamed_data())


def test_order_and_axes_are_those_of_the_file(renamed):
    assert renamed.control_names == ("pedal", "stick_forward", "stick_right", "lever", "trimmer")
    assert renamed.control_units == ("rad", "rad", "rad", "in", "rad")
    assert renamed.trimmed_controls.tolist() == [0, 1, 2, 3]
    with pytest.raises(AircraftError, match=r"axis = heave: sticks and controllers need an angle"):
        _ = renamed.axis_controls


def test_the_swashplate_is_mixing_times_controls_and_a_constant(renamed):
    angles = renamed.mix([0.01, 0.02, 0.03, 5.0, 0.004])
    offset = math.radians(1.0)
    np.testing.assert_allclose(angles[0], [offset + 5 * PITCH_PER_INCH, 0.03 + 0.004 - math.radians(0.5), 0.02 - 0.01])
    np.testing.assert_allclose(angles[1], [offset + 5 * PITCH_PER_INCH, 0.03 - 0.004 + math.radians(0.5), 0.02 + 0.01])


def test_the_trim_is_that_of_the_same_swashplates(sbs, renamed):
    """What is held and the constants cancel here, so that the same helicopter has the same trim by other controls."""
    ours, theirs = trim(renamed, 12.0, climb_rate=1.0), trim(sbs, 12.0, climb_rate=1.0)
    np.testing.assert_allclose(ours.swashplate, theirs.swashplate, atol=1e-9)
    np.testing.assert_allclose(ours.state, theirs.state, atol=1e-7)
    named = dict(zip(ours.control_names, ours.controls, strict=True))
    assert named["lever"] * PITCH_PER_INCH + math.radians(1.0) == pytest.approx(theirs["collective"], abs=1e-9)
    assert named["pedal"] == pytest.approx(theirs["differential_longitudinal_cyclic"], abs=1e-9)
    assert named["trimmer"] == math.radians(0.5)
    assert ours["lever"] == named["lever"]
    again = trim(renamed, 12.0, climb_rate=1.0, guess=ours)
    np.testing.assert_allclose(again.controls, ours.controls, atol=1e-9)
    np.testing.assert_allclose(renamed.unmix(ours.swashplate), ours.controls, atol=1e-12)


def test_b_has_a_column_for_each_control(sbs, renamed):
    ours, theirs = linearize(renamed), linearize(sbs)
    assert ours.control_names == renamed.control_names
    column = dict(zip(ours.control_names, ours.b.T, strict=True))
    scale = np.abs(theirs.b).max()
    np.testing.assert_allclose(column["lever"], PITCH_PER_INCH * theirs.b[:, 0], atol=1e-6 * scale)
    np.testing.assert_allclose(column["stick_right"], theirs.b[:, 1], atol=1e-6 * scale)
    effects = {effect.control: effect for effect in ours.control_effects}
    assert (effects["lever"].axis, effects["pedal"].axis, effects["stick_right"].axis) == ("heave", "yaw", "roll")
    assert effects["lever"].words == "up"


def test_a_flight_takes_all_controls(renamed):
    hover = trim(renamed)
    flight = simulate(renamed, hover, hover.controls, 0.2)
    assert flight["controls"].shape[1] == 5
    assert np.abs(flight["state"][-1, :3]).max() < 1e-3
    with pytest.raises(SimulationError, match=r"controls have shape \(4,\): allowed are \(5,\) and \(n, 5\)"):
        simulate(renamed, hover, hover.controls[:4], 0.2)
    with pytest.raises(SimulationError, match=r"lever = 11: allowed are 0 to 10 in$"):
        simulate(renamed, hover, [0.0, 0.0, 0.0, 11.0, 0.0], 0.2)


def test_the_mixer_clips_in_the_units_of_the_file(renamed):
    mixer = Mixer(renamed)
    mixer.set_target([0.0, 0.0, 0.0, 11.0, 0.0])
    assert mixer.saturated[0] == "lever at its limit of 10 in"
    with pytest.raises(SimulationError, match="lever = nan"):
        mixer.set_target([0.0, 0.0, 0.0, math.nan, 0.0])


def with_angles(data):
    """The lever as an angle, so that sticks and controllers can move it."""
    data["controls"]["lever"] = {"range_deg": [0.0, 20.0], "axis": "heave"}
    for rotor in data["rotors"]:
        rotor["mixing"]["collective"] = {"lever": 1.0}
    return Aircraft.from_dict(data)


def test_a_controller_holds_hover_by_controls_of_other_names(sbs):
    aircraft = with_angles(renamed_data())
    ours, theirs = (design(HoverModel.of(linearize(one))) for one in (aircraft, sbs))
    np.testing.assert_allclose(ours.gains, theirs.gains, rtol=1e-4, atol=1e-4 * np.abs(theirs.gains).max())
    hover = trim(aircraft)
    state = np.array([0.3, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, *hover.condition.motion(0.0, 0.0)[0], 0.0, 0.0, 0.0])
    pilot = HoverHold(ours)
    assert pilot.controls(0.0, state).shape == (5,)
    flight = simulate_with_pilot(aircraft, hover, HoverHold(ours).controls, 0.5)
    assert np.abs(flight["state"][-1, :3]).max() < 0.01
    figures = _figures(aircraft, flight, 0.0)
    assert figures["std_lever"] == flight["controls"][:, aircraft.control_names.index("lever")].std()
    assert list(figures)[-4:] == ["std_lever", "std_stick_right", "std_stick_forward", "std_pedal"]
    assert augmentation(linearize(aircraft)).senses.tolist() == augmentation(linearize(sbs)).senses.tolist()


def test_a_controller_says_which_axis_has_no_control(renamed):
    with pytest.raises(PilotError, match="axis = heave: sticks and controllers need an angle"):
        HoverModel.of(linearize(renamed))


FAULTS = {
    "no range": ({"pedal": {}}, "controls.pedal: allowed is range_deg for an angle, or range with unit"),
    "two ranges": ({"pedal": {"range": [0, 1], "range_deg": [0, 1]}}, "controls.pedal: allowed is range_deg"),
    "no unit": ({"lever": {"range": [0, 1]}}, "controls.lever.unit = '': allowed is the unit"),
    "order of the ends": ({"pedal": {"range_deg": [2, 1]}}, "controls.pedal.range_deg = [2, 1]: allowed is a lower"),
    "held outside": (
        {"trimmer": {"range_deg": [-3, 3], "held_deg": 4}},
        "controls.trimmer.held_deg = 4: allowed are -3 to 3",
    ),
    "held in another unit": (
        {"trimmer": {"range_deg": [-3, 3], "held": 0.0}},
        "controls.trimmer.held: not allowed with range_deg",
    ),
    "five that trims find": ({"trimmer": {"range_deg": [-3, 3]}}, "controls: allowed are 4 that trims find"),
    "one axis twice": ({"pedal": {"range_deg": [-3, 3], "axis": "roll"}}, "controls: axis = roll: used twice"),
    "name of a state": ({"theta": {"range_deg": [-3, 3], "held_deg": 0}}, "controls.theta: allowed is a name that no"),
    "name": ({"A b": {"range_deg": [-3, 3], "held_deg": 0}}, "allowed is a name of lower-case letters"),
    "axis": (
        {"pedal": {"range_deg": [-3, 3], "axis": "spin"}},
        "controls.pedal.axis = 'spin': allowed is one of heave",
    ),
}


@pytest.mark.parametrize(("change", "message"), FAULTS.values(), ids=FAULTS)
def test_what_no_controls_can_be_is_refused(change, message):
    data = renamed_data()
    data["controls"] |= change
    with pytest.raises(AircraftError) as refused:
        Aircraft.from_dict(data)
    assert message in str(refused.value)
    assert "\n" not in str(refused.value)


def test_a_control_that_the_file_does_not_have_is_not_mixed():
    data = renamed_data()
    data["rotors"][1]["mixing"]["collective"]["throttle"] = 1.0
    with pytest.raises(AircraftError, match=r"rotors\[1\].mixing.collective.throttle: unknown key, allowed are pedal"):
        Aircraft.from_dict(data)


def test_values_of_controls_can_be_set_by_path(renamed):
    assert renamed.with_value("controls.trimmer.held_deg", 1.0).held_controls[4] == math.radians(1.0)
    assert renamed.with_value("rotors.R1.mixing.collective.lever", 0.02).mixing[0, 3] == 0.02
    assert renamed.with_value("controls.trimmer.held_deg", 1.0).parameter_hash != renamed.parameter_hash
