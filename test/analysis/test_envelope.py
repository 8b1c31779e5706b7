"""Envelope controller: gains, margins, levels and uncertainty from linear models, and flights with it."""

import dataclasses
import math

import control
import numpy as np
import pytest
from test_commands import call

from sbs_sim import Aircraft, linearize, simulate, trim
from sbs_sim.analysis.quality_limits import scales
from sbs_sim.analysis.rejection import rejection
from sbs_sim.commands.controller_arguments import holding
from sbs_sim.errors import AircraftError, PilotError
from sbs_sim.flight import measured as M
from sbs_sim.flight.trim_point import TrimCondition
from sbs_sim.model.frames import euler_to_quaternion
from sbs_sim.model.wind import Wind
from sbs_sim.pilot import envelope_check as E
from sbs_sim.pilot import envelope_law as L
from sbs_sim.pilot.envelope import PERIOD, Condition, Limits, Requirement, actuated, design_envelope, level_plant
from sbs_sim.pilot.envelope_file import check_aircraft, envelope_text, load_envelope, save_envelope
from sbs_sim.pilot.feedback import Compensator, Plant, closed_loop_poles, margins, sampled
from sbs_sim.pilot.loops import ModalPlant, closed_poles, quick_margins, sampled_response

SPEEDS = (0.0, 10.0, 20.0)
TURN = math.radians(12.0)


@pytest.fixture(scope="module")
def models(sbs):
    return [linearize(sbs, airspeed=speed) for speed in SPEEDS]


@pytest.fixture(scope="module")
def found(sbs, models):
    return design_envelope(sbs, models)


# -- loops -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("number", [0, 2])
def test_margins_by_modes_are_those_of_the_loop_itself(found, models, number):
    """Poles, gain, phase and disk margins, with the states themselves at every frequency."""
    condition = Condition.of(models[number])
    plant, feedback = actuated(level_plant(condition), 0.02), found.compensator(SPEEDS[number])
    for delay in (0, 2):
        expected = closed_loop_poles(plant, feedback, PERIOD, delay)
        quick = closed_poles(ModalPlant.of(plant), feedback, PERIOD, delay)
        np.testing.assert_allclose(quick[:12], expected[:12], atol=1e-6)
    slow, quick = margins(plant, feedback, PERIOD, 1), quick_margins(ModalPlant.of(plant), feedback, PERIOD, 1, True)
    for one, other in zip(slow[:4], quick[:4], strict=True):
        assert other.disk == pytest.approx(one.disk, rel=0.01)
        assert other.gain_high == pytest.approx(one.gain_high, rel=0.01)
        assert other.phase == pytest.approx(one.phase, rel=0.01)
    assert quick[4].disk == pytest.approx(slow[4].disk, rel=0.01)


def test_margins_are_those_of_python_control(found, models):
    """Each loop as python-control's discrete system, broken at one control, the others closed."""
    plant, feedback = level_plant(Condition.of(models[1])), found.compensator(SPEEDS[1])
    a, b = sampled(plant, PERIOD)
    aircraft = control.ss(a, b, plant.c, np.zeros((len(plant.c), 4)), PERIOD)
    law = control.ss(feedback.a, feedback.b, feedback.c, feedback.d, PERIOD)
    late = control.ss(np.zeros((4, 4)), np.eye(4), np.eye(4), np.zeros((4, 4)), PERIOD)
    broken = -late * law * aircraft
    for i, own in enumerate(quick_margins(ModalPlant.of(plant), feedback, PERIOD, 1, True)[:4]):
        others = np.delete(np.eye(4), i, axis=1)
        closed = control.feedback(broken, others @ others.T)
        disk, _, _ = control.disk_margins(closed[i, i], np.geomspace(0.05, 0.99 * math.pi / PERIOD, 1000))
        assert own.disk == pytest.approx(float(disk), rel=0.02)


def test_a_loop_ends_at_its_gain_margin(found, models):
    """Stable a little below it, and unstable a little above, up and down."""
    plant, feedback = level_plant(Condition.of(models[2])), found.compensator(SPEEDS[2])
    own = quick_margins(ModalPlant.of(plant), feedback, PERIOD, 1, True)[2]

    def growth(factor):
        change = np.array([1.0, 1.0, factor, 1.0])
        scaled = dataclasses.replace(plant, b=plant.b * change)
        return closed_poles(ModalPlant.of(scaled), feedback, PERIOD, 1).real.max()

    assert growth(0.98 * own.gain_high) < 0.0 < growth(1.02 * own.gain_high)
    assert own.gain_low == 0.0 or growth(1.02 * own.gain_low) < 0.0 < growth(0.98 * own.gain_low)


def test_a_plant_by_its_modes(models):
    plant = level_plant(Condition.of(models[1]))
    a, b = sampled(plant, PERIOD)
    w = np.array([0.3, 5.0, 60.0])
    z = np.exp(1j * w * PERIOD)[:, None, None]
    expected = plant.c @ np.linalg.solve(z * np.eye(len(a)) - a, np.broadcast_to(b, (3, *b.shape)))
    np.testing.assert_allclose(sampled_response(ModalPlant.of(plant), PERIOD, w), expected, rtol=1e-7, atol=1e-9)


def test_positions_follow_from_velocity_and_heading(sbs, models):
    """The rows of position against differences of the motion itself."""
    condition, step = Condition.of(models[1]), 1e-6
    plant = condition.plant()
    n = len(condition.state_names)
    body = np.zeros(n + 4)
    body[[condition.state_names.index(name) for name in ("u", "w", "theta", "phi")]] = 0.4, -0.3, 0.2, 0.1
    body[n + 3] = 0.5  # heading

    def velocity(share):
        yaw, pitch, roll = share * body[n + 3], condition.pitch + share * 0.2, condition.roll + share * 0.1
        own = condition.velocity + share * np.array([0.4, 0.0, -0.3])
        from sbs_sim.model.frames import rotation_matrix

        return rotation_matrix(euler_to_quaternion(yaw, pitch, roll)) @ own

    expected = (velocity(step) - velocity(-step)) / (2.0 * step)
    np.testing.assert_allclose((plant.a @ body)[n : n + 3], expected, atol=1e-8)


def test_the_law_is_differentiated(found):
    """Its inner gains are those of the design, through the share of the lag that a tick lets through."""
    feedback, gains = found.compensator(0.0), found.gains[0]
    new = -math.expm1(-PERIOD / 0.05)
    np.testing.assert_allclose(feedback.d[:, M.Q], -new * gains.fed_back[:, 1], atol=1e-6)
    np.testing.assert_allclose(feedback.d[:, M.HEADING], -new * gains.fed_back[:, 6], atol=1e-6)
    by_speed = -new * gains.fed_back[:, 2] * -gains.outer[0] / found.gravity
    assert feedback.d[2, M.U] == pytest.approx(by_speed[2], rel=1e-3)


# -- qualities -------------------------------------------------------------------------------------------------------


def test_bandwidth_and_phase_delay_of_a_known_response():
    """Of second order behind a delay: the phase is known in closed form."""
    w, own, damping, late = np.geomspace(0.05, 300.0, 4000), 4.0, 0.6, 0.05
    response = own**2 / (own**2 - w**2 + 2j * damping * own * w) * np.exp(-1j * w * late)

    def phase(x):
        return -math.atan2(2.0 * damping * own * x, own**2 - x**2) - x * late

    bandwidth, delay = E.attitude_bandwidth(w, response)
    assert phase(bandwidth) == pytest.approx(-0.75 * math.pi, abs=1e-3)
    crossing = next(x for x in w if phase(x) < -math.pi)
    assert delay == pytest.approx((-math.pi - phase(2.0 * crossing)) / (2.0 * crossing), rel=0.01)


@pytest.mark.parametrize("is_exact", [True, False])
def test_rejection_of_an_integrator(is_exact):
    """S = s / (s + k) takes 3 dB off up to k / sqrt(10^0.3 - 1), and has no peak."""
    w, k = np.geomspace(0.01, 100.0, 240), 2.5

    def left(x):
        return abs(1j * x / (1j * x + k))

    found = rejection("pitch", w, left(w), left if is_exact else None)
    assert found.bandwidth == pytest.approx(k / math.sqrt(10.0**0.3 - 1.0), rel=1e-9 if is_exact else 5e-4)
    assert found.peak == pytest.approx(0.0, abs=0.01)
    assert found.peak_frequency == pytest.approx(100.0, rel=0.01)
    assert math.isnan(rejection("pitch", w[w > 3.0], left(w[w > 3.0])).bandwidth)


def test_margins_and_levels_of_the_design(sbs, found):
    asked = Requirement()
    for one in E.nominal(found, sbs, SPEEDS):
        assert one.growth < 0.0
        assert min(one.gain_up.min(), one.gain_down.min()) >= asked.gain_db
        assert math.degrees(one.phase.min()) >= asked.phase_deg
        assert max(one.levels.values()) <= 2
        assert one.levels["pitch bandwidth"] == 1
        assert one.rejection[:2].min() > 1.0


def test_more_margin_costs_bandwidth(sbs, models, found):
    careful = design_envelope(sbs, models[:1], requirement=Requirement(9.0, 52.0))
    few, many = E.nominal(careful, sbs, [0.0])[0], E.nominal(found, sbs, [0.0])[0]
    assert min(few.gain_up.min(), few.gain_down.min()) >= 9.0
    assert few.bandwidth.min() < many.bandwidth.min()
    with pytest.raises(PilotError, match="no gains at 0 m/s keep the margins: the nearest have"):
        design_envelope(sbs, models[:1], requirement=Requirement(40.0, 80.0))


def test_uncertain_aircraft(sbs, found):
    spread = E.Uncertainty()
    one = E.sample(found, sbs, [10.0], spread, 3, seed=2)
    again = E.sample(found, sbs, [10.0], spread, 5, seed=2)
    np.testing.assert_array_equal(one.values("phase"), again.values("phase")[:3])
    assert len(set(again.values("growth").ravel())) == 5
    assert again.stable.tolist() == [1.0]
    # what does not differ has the margins of the design
    same = E.sample(found, sbs, [10.0], E.Uncertainty(0.0, 0.0, 0.0, 0.0, 0.0, 0.0), 1)
    np.testing.assert_allclose(same.values("phase")[0, 0], E.nominal(found, sbs, [10.0])[0].phase, rtol=1e-9)
    with pytest.raises(PilotError, match="mass = -1"):
        E.Uncertainty(mass=-1.0)


# -- flights ---------------------------------------------------------------------------------------------------------


def test_it_flies_to_cruise_turns_and_returns(sbs, found):
    """20 m/s, a turn by 90 deg with little sideslip, back to a hover; in wind and turbulence."""
    rows = [
        *([1.0, L.VELOCITY, 20.0, 0.0, 0.0, 0.0], [20.0, L.VELOCITY, 20.0, 0.0, 0.0, TURN]),
        *([27.5, L.VELOCITY, 20.0, 0.0, 0.0, 0.0], [31.0, L.VELOCITY, 0.0, 0.0, 0.0, 0.0]),
    ]
    still = simulate(sbs, trim(sbs), found.controller(rows, delay=0.01), 50.0)
    at = {second: 100 * second for second in (18, 26, 50)}
    assert np.hypot(still["u"], still["w"])[at[18]] == pytest.approx(20.0, abs=0.3)
    assert math.degrees(still["phi"][at[26]]) == pytest.approx(math.degrees(math.atan(20.0 * TURN / 9.81)), abs=2.0)
    assert abs(still["v"][at[26]] / 20.0) < math.radians(4.0)
    assert math.degrees(still["psi"][at[50]]) == pytest.approx(90.0, abs=5.0)
    assert np.abs(still["down"]).max() < 0.5
    assert abs(still["u"][at[50]]) < 0.2
    wind = Wind(velocity=(3.0, 2.0, 0.0), turbulence_intensity=(1.5, 1.5, 1.5), turbulence_seed=1)
    gusts = simulate(sbs, trim(sbs), found.controller(rows, delay=0.01), 50.0, wind=wind)
    assert np.abs(gusts["down"]).max() < 1.5
    assert abs(gusts["u"][at[50]]) < 0.6
    assert abs(math.degrees(gusts["phi"][at[50]])) < 5.0


def test_it_goes_to_a_position_and_takes_attitudes(sbs, found):
    goal = [0.0, L.POSITION, 6.0, -4.0, -3.0, math.radians(60.0)]
    flight = simulate(sbs, trim(sbs), found.controller(goal), 25.0)
    end = [flight[name][-1] for name in ("north", "east", "down", "psi")]
    assert end == pytest.approx([6.0, -4.0, -3.0, math.radians(60.0)], abs=0.05)
    lean = [0.0, L.ATTITUDE, math.radians(8.0), math.radians(-5.0), 0.0, 0.0]
    flight = simulate(sbs, trim(sbs), found.controller(lean), 1.5)
    assert math.degrees(flight["phi"][-1]) == pytest.approx(8.0, abs=1.0)
    assert math.degrees(flight["theta"][-1]) == pytest.approx(-5.0, abs=1.0)


def test_it_flies_the_uh60a():
    """With its own names of controls, three times the size, a tail rotor and a trim that leans."""
    aircraft = Aircraft.load("uh60a_tm85890")
    speeds = [0.0, 20.0]
    found = E.design(aircraft, speeds)
    assert found.control_names == ("collective", "lateral_cyclic", "longitudinal_cyclic", "pedal")
    rows = [[1.0, L.VELOCITY, 15.0, 0.0, 0.0, 0.0], [25.0, L.VELOCITY, 0.0, 0.0, 0.0, 0.0]]
    flight = simulate(aircraft, trim(aircraft), found.controller(rows, delay=0.01), 45.0)
    assert flight["u"][2400] == pytest.approx(15.0, abs=1.0)
    assert abs(flight["u"][-1]) < 0.5
    assert np.abs(flight["down"]).max() < 2.0


# -- files and the command -------------------------------------------------------------------------------------------


def test_a_file_holds_the_controller(sbs, found, tmp_path):
    path = tmp_path / "gains.yaml"
    save_envelope(found, path)
    assert load_envelope(path) == found
    for old, new, text in (
        ("axes: [0, 1, 2, 3]", "axes: [0, 1, 2, 9]", r"axes = \[0.0, 1.0, 2.0, 9.0\]: allowed are 0 to 3"),
        ("kind: sbs", "kind: x", "kind: allowed is"),
        ("  acceleration: 1.5", "  acceleration: -1", "acceleration = -1: allowed are 0 to"),
        ("  - airspeed: 10.0", "  - airspeed: 30.0", "allowed are rising ones"),
        ("    pitch: ", "    pitch: x", r"gains\[0\].pitch"),
    ):
        changed = envelope_text(found).replace(old, new, 1)
        assert changed != envelope_text(found), old
        path.write_text(changed)
        with pytest.raises(PilotError, match=text):
            load_envelope(path)
    with pytest.raises(PilotError, match="not readable"):
        load_envelope(tmp_path / "none.yaml")
    with pytest.raises(PilotError, match="tandem has collective, lateral_stick"):
        check_aircraft(found, Aircraft.load("tandem"))


def test_the_command_prints_margins_and_writes_gains(sbs, tmp_path):
    file = tmp_path / "own.yaml"
    words = ("--airspeeds", 0, 10, "--samples", 2, "--workers", 1, "--out", file, "--limit", "tilt_deg=20")
    ended = call("design", "sbs", *words)
    assert ended.returncode == 0, ended.stderr
    own = load_envelope(file)
    assert own.limits == dataclasses.replace(Limits(), tilt_deg=20.0)
    text = ended.stdout
    assert "margins with one loop broken" in text
    assert "2 uncertain aircraft at each airspeed (mass 0.05" in text
    assert text.count("10 m/s") == 3


def test_what_cannot_be_designed(sbs):
    with pytest.raises((PilotError, AircraftError), match="axis"):
        E.design(sbs.with_value("controls.collective.axis", "none"), [0.0])
    with pytest.raises(PilotError, match=r"airspeeds \[10.0, 0.0\]: allowed are one or more rising ones"):
        E.design(sbs, [10.0, 0.0])


def test_a_flight_condition_goes_on():
    assert holding(TrimCondition()) == [0.0, L.POSITION, 0.0, 0.0, 0.0, 0.0]
    assert holding(TrimCondition(airspeed=9.0, climb_rate=1.0)) == [0.0, L.VELOCITY, 9.0, 0.0, -1.0, 0.0]


def test_scales_say_the_size(sbs):
    assert scales(sbs)[0].speed_up == pytest.approx(2.67, abs=0.01)


def test_a_compensator_at_frequencies():
    """1 / (z - 0.5) by hand."""
    own = Compensator(np.array([[0.5]]), np.array([[1.0]]), np.array([[1.0]]), np.array([[0.0]]))
    w = np.array([1.0, 10.0])
    np.testing.assert_allclose(own.at(w, 0.01)[:, 0, 0], 1.0 / (np.exp(0.01j * w) - 0.5))
    assert isinstance(Plant(own.a, own.b, own.c), Plant)
