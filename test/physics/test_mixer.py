"""The control mixer: the paper's rule, ranges, rates."""

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sbs_sim import Aircraft
from sbs_sim.errors import SimulationError
from sbs_sim.flight.mixer import Mixer, Mixers
from sbs_sim.model.state import CONTROL_NAMES

DATA = Path(__file__).resolve().parents[1] / "data"
DEG = math.pi / 180


def started(aircraft, controls_deg, time=0.0):
    """A mixer whose swashplates stand at the given controls at the given time."""
    mixer = Mixer(aircraft)
    mixer.set_target(np.array(controls_deg) * DEG)
    mixer.move(time)
    return mixer


def target_of(aircraft, controls_deg):
    return started(aircraft, controls_deg).move(1e9) / DEG


# -- rule and ranges ---------------------------------------------------------------------------------


@pytest.mark.parametrize("controls", [(9, 0, 0, 0), (0, 3, 0, 0), (0, 0, -4, 0), (0, 0, 0, 2), (9, 3, -4, 2)])
def test_the_rule_of_the_paper(sbs, controls):
    """theta0 and A1s to both rotors; B1s - dB1s to the left one, B1s + dB1s to the right one (section 2.1.1)."""
    theta0, a1s, b1s, db1s = controls
    expected = [[theta0, a1s, b1s - db1s], [theta0, a1s, b1s + db1s]]
    np.testing.assert_allclose(target_of(sbs, controls), expected, atol=1e-12)


def test_any_rotor_list_mixes_by_its_file():
    tail_rotor = Aircraft.load(DATA / "tail_rotor.yaml")
    np.testing.assert_allclose(target_of(tail_rotor, (8, 2, -3, 5)), [[8, 2, -3], [5, 0, 0]], atol=1e-12)
    tandem = Aircraft.load(DATA / "tandem.yaml")
    np.testing.assert_allclose(target_of(tandem, (8, 2, -3, 5)), [[11, 7, 0], [5, -3, 0]], atol=1e-12)
    single = dataclasses.replace(tail_rotor, rotors=tail_rotor.rotors[:1])
    np.testing.assert_allclose(target_of(single, (8, 2, -3, 5)), [[8, 2, -3]], atol=1e-12)


def test_what_is_within_the_ranges_is_not_flagged(sbs):
    for controls in ((9, 0, 0, 0), (0, 12, 12, 0), (20, -12, -12, 0), (20, 12, 8, 8)):
        assert started(sbs, controls).saturated == ()


@pytest.mark.parametrize(
    ("controls", "reached", "flags"),
    [
        ((25, 0, 0, 0), [[20, 0, 0], [20, 0, 0]], ("collective at its limit of 20 deg",)),
        ((-1, 0, 0, 0), [[0, 0, 0], [0, 0, 0]], ("collective at its limit of 0 deg",)),
        ((9, -13, 0, 0), [[9, -12, 0], [9, -12, 0]], ("lateral_cyclic at its limit of -12 deg",)),
        ((9, 0, 10, 8), [[9, 0, 2], [9, 0, 16]], ("MR2 longitudinal_cyclic at its limit of 16 deg",)),
        ((9, 0, -10, 8), [[9, 0, -16], [9, 0, -2]], ("MR1 longitudinal_cyclic at its limit of -16 deg",)),
        (
            (21, 0, 80, 80),
            [[20, 0, 0], [20, 0, 16]],
            (
                "collective at its limit of 20 deg",
                "longitudinal_cyclic at its limit of 12 deg",
                "differential_longitudinal_cyclic at its limit of 12 deg",
                "MR2 longitudinal_cyclic at its limit of 16 deg",
            ),
        ),
    ],
)
def test_what_is_beyond_the_ranges_is_clipped_and_flagged(sbs, controls, reached, flags):
    mixer = started(sbs, controls)
    np.testing.assert_allclose(mixer.move(0.0) / DEG, reached, atol=1e-12)
    assert mixer.saturated == flags


def test_flags_go_when_the_controls_come_back(sbs):
    mixer = started(sbs, (25, 0, 0, 0))
    mixer.set_target([9 * DEG, 0, 0, 0])
    assert mixer.saturated == ()


# -- rates -------------------------------------------------------------------------------------------


def test_the_first_target_is_reached_at_once(sbs):
    mixer = Mixer(sbs)
    mixer.set_target(np.array([9, 1, 2, 0]) * DEG)
    np.testing.assert_allclose(mixer.move(123.0) / DEG, [[9, 1, 2], [9, 1, 2]], atol=1e-12)
    assert mixer.arrived


def test_angles_move_at_their_rate_and_arrive_in_time(sbs):
    """120 deg/s: 6 deg of collective take 50 ms, 3 deg of cyclic half of that."""
    mixer = started(sbs, (4, 0, 0, 0), time=5.0)
    mixer.set_target(np.array([10, 0, -3, 0]) * DEG)
    np.testing.assert_allclose(mixer.move(5.0)[0] / DEG, [4, 0, 0], atol=1e-9)
    np.testing.assert_allclose(mixer.move(5.01)[0] / DEG, [5.2, 0, -1.2], atol=1e-9)
    np.testing.assert_allclose(mixer.move(5.024)[0] / DEG, [6.88, 0, -2.88], atol=1e-9)
    np.testing.assert_allclose(mixer.move(5.0255)[0] / DEG, [7.06, 0, -3], atol=1e-9)
    assert not mixer.arrived
    np.testing.assert_allclose(mixer.move(5.0499)[0] / DEG, [9.988, 0, -3], atol=1e-9)
    assert not mixer.arrived
    np.testing.assert_allclose(mixer.move(5.0501)[0] / DEG, [10, 0, -3], atol=1e-12)
    assert mixer.arrived


def test_a_new_target_after_a_long_rest_is_no_leave_to_jump(sbs):
    mixer = started(sbs, (4, 0, 0, 0))
    mixer.move(1.0)
    mixer.set_target(np.array([10, 0, 0, 0]) * DEG)
    assert mixer.move(100.0)[0, 0] / DEG == pytest.approx(5.2)  # 120 deg/s for the 10 ms that an output is held
    assert not mixer.arrived
    assert mixer.move(100.02)[0, 0] / DEG == pytest.approx(7.6)  # on the way all time counts


def test_a_target_that_changes_on_the_way_is_followed_from_there(sbs):
    mixer = started(sbs, (4, 0, 0, 0))
    mixer.set_target(np.array([10, 0, 0, 0]) * DEG)
    assert mixer.move(0.01)[0, 0] / DEG == pytest.approx(5.2)
    mixer.set_target(np.array([4, 0, 0, 0]) * DEG)
    assert mixer.move(0.02)[0, 0] / DEG == pytest.approx(4)


def test_a_target_that_moves_on_is_followed_without_delay(sbs):
    """A stream of targets within reach: the swashplate is where the last command wants it."""
    mixer = started(sbs, (4, 0, 0, 0))
    for i in range(1, 10):
        mixer.set_target(np.array([4 + i, 0, 0, 0]) * DEG)
        assert mixer.move(0.01 * i)[0, 0] / DEG == pytest.approx(4 + i)


def test_rates_are_those_of_each_rotor():
    tail_rotor = Aircraft.load(DATA / "tail_rotor.yaml")  # 120 deg/s in front, 300 deg/s at the tail
    mixer = started(tail_rotor, (4, 0, 0, 0))
    mixer.set_target(np.array([10, 0, 0, 10]) * DEG)
    mixer.move(0.0)
    np.testing.assert_allclose(mixer.move(0.02) / DEG, [[6.4, 0, 0], [6, 0, 0]], atol=1e-9)


def test_time_that_goes_back_moves_nothing(sbs):
    mixer = started(sbs, (4, 0, 0, 0), time=10.0)
    mixer.set_target(np.array([10, 0, 0, 0]) * DEG)
    mixer.move(10.0)
    assert mixer.move(3.0)[0, 0] / DEG == pytest.approx(4)
    assert mixer.move(3.01)[0, 0] / DEG == pytest.approx(5.2)


def test_the_angles_given_out_are_the_callers_own(sbs):
    mixer = started(sbs, (4, 0, 0, 0))
    mixer.move(0.0)[:] = 99.0
    assert mixer.move(0.0)[0, 0] / DEG == pytest.approx(4)


# -- what is refused ---------------------------------------------------------------------------------


def test_without_controls_there_is_no_position(sbs):
    mixer = Mixer(sbs)
    assert mixer.arrived
    with pytest.raises(SimulationError, match="the mixer has no controls yet"):
        mixer.move(0.0)


@pytest.mark.parametrize("place", range(4))
@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 1.6, -1e300])
def test_absurd_controls_are_refused_and_change_nothing(sbs, place, value):
    mixer = started(sbs, (4, 1, 0, 0))
    mixer.set_target(np.array([25, 0, 0, 0]) * DEG)
    controls = np.array([9, 0, 0, 0]) * DEG
    controls[place] = value
    with pytest.raises(SimulationError) as caught:
        mixer.set_target(controls)
    assert str(caught.value) == f"{CONTROL_NAMES[place]} = {value}: allowed are -1.5708 to 1.5708 rad"
    assert mixer.saturated == ("collective at its limit of 20 deg",)
    mixer.move(0.0)
    np.testing.assert_allclose(mixer.move(60.0) / DEG, [[20, 0, 0], [20, 0, 0]], atol=1e-12)


@pytest.mark.parametrize("shape", [(), (3,), (5,), (1, 4), (0,)])
def test_controls_of_another_shape_are_refused(sbs, shape):
    with pytest.raises(SimulationError) as caught:
        Mixer(sbs).set_target(np.zeros(shape))
    assert str(caught.value) == f"controls have shape {shape}: allowed is (4,)"


# -- always ------------------------------------------------------------------------------------------

AIRCRAFT = {name: Aircraft.load(DATA / f"{name}.yaml") for name in ("tail_rotor", "tandem")}
AIRCRAFT["sbs"] = Aircraft.load("sbs")
CONTROLS = st.tuples(*[st.floats(-math.pi / 2, math.pi / 2)] * 4)


@settings(max_examples=150, deadline=None)
@given(
    st.sampled_from(sorted(AIRCRAFT)),
    CONTROLS,
    st.lists(st.tuples(st.none() | CONTROLS, st.floats(0.0, 0.2)), max_size=12),
)
def test_output_is_within_the_ranges_and_no_faster_than_the_rates(name, first, moves):
    aircraft = AIRCRAFT[name]
    low, high = np.array(
        [[rotor.collective_range, rotor.cyclic_range, rotor.cyclic_range] for rotor in aircraft.rotors]
    ).transpose(2, 0, 1)
    rates = np.array([[rotor.swashplate_rate] for rotor in aircraft.rotors])
    mixer = Mixer(aircraft)
    mixer.set_target(first)
    time, before, controls = 0.0, mixer.move(0.0), first
    for new_controls, pause in moves:
        if new_controls is not None:
            mixer.set_target(new_controls)
            controls = new_controls
        time += pause
        angles = mixer.move(time)
        assert (angles >= low).all()
        assert (angles <= high).all()
        assert (np.abs(angles - before) <= rates * pause * (1 + 1e-9) + 1e-12).all()
        before = angles
    mixer.move(time)
    ranges = np.array([aircraft.control_ranges[name] for name in CONTROL_NAMES])
    goal = np.clip(aircraft.mix(np.clip(controls, *ranges.T)), low, high)
    np.testing.assert_array_equal(mixer.move(time + 60.0), goal)
    assert mixer.arrived


@settings(max_examples=50, deadline=None)
@given(
    st.sampled_from(sorted(AIRCRAFT)),
    st.tuples(CONTROLS, CONTROLS),
    st.lists(st.tuples(CONTROLS, CONTROLS, st.booleans(), st.floats(0.0, 0.2)), max_size=12),
)
def test_mixers_side_by_side_move_as_mixers_do(name, first, moves):
    aircraft, time = AIRCRAFT[name], 0.0
    alone, together = [started(aircraft, np.array(controls) / DEG) for controls in first], Mixers(aircraft, 2)
    for i, mixer in enumerate(alone):
        together.set_position(i, mixer.position, time)
    for *controls, restarts, pause in moves:
        if restarts:
            alone[1] = started(aircraft, np.zeros(4), time)
            together.set_position(1, alone[1].position, time)
        time += pause
        for mixer, own in zip(alone, controls, strict=True):
            mixer.set_target(own)
        np.testing.assert_array_equal(together.move(np.array(controls), time), [mixer.move(time) for mixer in alone])
