"""The hover hold without ROS: its design against python-control, its flights against its linear models."""

import math

import control
import numpy as np
import pytest
from helpers import aircraft_data, mirrored_data
from scipy.linalg import expm

from sbs_sim import Aircraft, linearize
from sbs_sim.errors import PilotError, SimulationError
from sbs_sim.flight.trimmed_state import trimmed_state
from sbs_sim.model import state as S
from sbs_sim.model.frames import euler_to_quaternion
from sbs_sim.model.wind import Wind
from sbs_sim.pilot import hover_hold as H
from sbs_sim.pilot.feedback import Compensator, Plant, closed_loop, closed_loop_poles, disk_gains, lqr, margins
from sbs_sim.pilot.piloted_flight import simulate_with_pilot

SMALL = 0.02  # m, rad: near enough for a linear model
MIRROR = {"v": -1, "p": -1, "phi": -1, "r": -1, "right": -1, "heading": -1, "lateral_cyclic": -1}


@pytest.fixture(scope="module")
def model(sbs):
    return linearize(sbs)


@pytest.fixture(scope="module")
def found(model):
    return H.design(H.HoverModel.of(model))


def pilot_to(found, place=(0.0, 0.0, 0.0), heading=0.0):
    pilot = H.HoverHold(found)
    pilot.hold(place, heading)
    return pilot


def errors(flight, place=(0.0, 0.0, 0.0)):
    return np.stack([flight[name] - value for name, value in zip(("north", "east", "down"), place, strict=True)])


# --- design -----------------------------------------------------------------------------------------------------


def test_the_gains_are_those_of_python_control(found):
    a, b = H.design_matrices(found.model)
    weights = np.diag([H.LIMITS.get(name, math.inf) ** -2 for name in H.STATES])
    efforts = np.diag([H.LIMITS[name] ** -2 for name in S.CONTROL_NAMES])
    gains, _, poles = control.lqr(a, b, weights, efforts)
    np.testing.assert_allclose(found.gains, gains, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(np.sort_complex(found.poles), np.sort_complex(poles), rtol=1e-6)


def test_a_double_integrator_has_its_textbook_gains():
    """X'' = u with unit weights: K = (1, sqrt 3) (Anderson and Moore, Optimal Control, section 3.2)."""
    gains, poles, cost = lqr(np.array([[0.0, 1.0], [0.0, 0.0]]), np.array([[0.0], [1.0]]), np.ones(2), np.ones(1))
    np.testing.assert_allclose(gains, [[1.0, math.sqrt(3.0)]], rtol=1e-12)
    np.testing.assert_allclose(poles, [-math.sqrt(3) / 2 - 0.5j, -math.sqrt(3) / 2 + 0.5j], rtol=1e-12)
    np.testing.assert_allclose(cost, [[math.sqrt(3.0), 1.0], [1.0, math.sqrt(3.0)]], rtol=1e-12)


def test_what_no_control_reaches_is_reported():
    with pytest.raises(PilotError, match="cannot stabilise"):
        lqr(np.diag([1.0, -1.0]), np.array([[0.0], [1.0]]), np.ones(2), np.ones(1))


def test_the_slow_poles_are_those_of_the_design(found):
    """With the rotors, sampling and a tick of delay; what is faster than 2 rad/s is changed by them."""
    slow = found.poles[np.abs(found.poles) < 1.8]
    assert len(slow) >= 8
    for pole in slow:
        assert np.abs(found.complete_poles - pole).min() < 0.05 * abs(pole)


def test_it_is_stable_with_all_states_and_has_margins(found):
    """6 dB and 30 deg are customary (MIL-F-9490D, section 3.1.3.6): at each control, and in the lead-lag too."""
    assert found.is_stable
    # the place, integrals and lags, controls on their way: all but the four lags, of which a delayed control is a copy
    assert len(found.complete_poles) == 38 + 4 + 8
    for margin in found.margins[:-1]:
        assert margin.gain_low < 0.5
        assert margin.gain_high > 2.0
        assert margin.phase > math.radians(30.0)
    low, high = disk_gains(found.margins[-1].disk)
    assert low < 0.6 < 1.7 < high


def test_without_the_lag_yaw_feedback_reaches_the_lag_motion_of_the_blades(sbs):
    """The same design on the body alone, without the four lags: its yaw margin is gone, at 125 rad/s.

    On blades without lag dampers, for which the lag was made.
    """
    found = H.design(H.HoverModel.of(linearize(sbs.with_value("rotors.lag_damping", 0.0))))
    a, _ = H.design_matrices(found.model)
    held = len(H.MEASURED) + len(H.INTEGRALS)
    limits = np.array([H.LIMITS[name] for name in H.STATES[:held]])
    gains, _, _ = lqr(a[:held, :held], a[:held, held:], limits, np.array([H.LIMITS[name] for name in S.CONTROL_NAMES]))
    by_measured, by_integral = np.split(gains, [len(H.MEASURED)], axis=1)
    integrate = np.hstack([np.zeros((4, 8)), H.TICK * np.eye(4)])
    bare = Compensator(np.eye(4), integrate, -by_integral, -by_measured)
    yaw = margins(found.model.plant(), bare, H.TICK, H.DELAY)[3]
    assert yaw.disk < 0.5 * found.margins[3].disk
    assert yaw.frequency == pytest.approx(125.0, abs=5.0)


@pytest.mark.parametrize("which", range(4))
def test_the_loop_becomes_unstable_at_its_gain_margins(found, which):
    plant, own = found.model.plant(), H.compensator(found.gains)

    def stable(factor):
        change = np.ones(4)
        change[which] = factor
        b = plant.b * change  # the error is between the control and the aircraft
        return np.abs(np.linalg.eigvals(closed_loop(Plant(plant.a, b, plant.c), own, H.TICK, H.DELAY))).max() < 1.0

    margin = found.margins[which]
    assert stable(0.99 * margin.gain_high)
    assert not stable(1.01 * margin.gain_high)
    if margin.gain_low > 1e-3:
        assert stable(1.01 * margin.gain_low)
        assert not stable(0.99 * margin.gain_low)


def test_margins_of_a_known_loop():
    """Hold and L(z) = (k T / (z - 1)): -1 is reached at k T = 2; python-control has its phase and disk margin."""
    tick, gain = 0.1, 5.0
    plant = Plant(np.zeros((1, 1)), np.ones((1, 1)), np.ones((1, 1)))
    own = Compensator(np.zeros((0, 0)), np.zeros((0, 1)), np.zeros((1, 0)), -gain * np.ones((1, 1)))
    margin, all_at_once = margins(plant, own, tick, 0)
    loop = control.tf([gain * tick], [1.0, -1.0], tick)
    _, phase, *_ = control.margin(loop)
    assert margin.phase == pytest.approx(math.radians(phase), rel=1e-3)
    assert margin.gain_low == 0.0
    assert margin.gain_high == math.inf or margin.gain_high == pytest.approx(2.0 / (gain * tick), rel=1e-2)
    disk, _, _ = control.disk_margins(loop, np.geomspace(0.05, math.pi / tick, 2000))
    assert margin.disk == pytest.approx(float(disk), rel=1e-3)
    assert all_at_once.disk == pytest.approx(margin.disk, rel=1e-12)


@pytest.mark.parametrize("delay", [0, 1, 3])
def test_a_delay_is_that_many_ticks(delay):
    """An integrator with a gain: z^(d + 1) - z^d + k T = 0."""
    plant = Plant(np.zeros((1, 1)), np.ones((1, 1)), np.ones((1, 1)))
    own = Compensator(np.zeros((0, 0)), np.zeros((0, 1)), np.zeros((1, 0)), np.array([[-2.0]]))
    polynomial = np.zeros(delay + 2)
    polynomial[0], polynomial[1], polynomial[-1] = 1.0, -1.0, polynomial[-1] + 0.1 * 2.0
    if delay == 0:
        polynomial = np.array([1.0, -0.8])
    expected = np.log(np.roots(polynomial).astype(complex)) / 0.1
    np.testing.assert_allclose(
        np.sort_complex(closed_loop_poles(plant, own, 0.1, delay)), np.sort_complex(expected), atol=1e-9
    )


def test_the_mirrored_aircraft_has_the_mirrored_gains(found):
    image = H.design(H.HoverModel.of(linearize(Aircraft.from_dict(mirrored_data(aircraft_data())))))
    by_state = np.array([MIRROR.get(name.split(" ")[0], 1) for name in H.STATES])
    by_control = np.array([MIRROR.get(name, 1) for name in S.CONTROL_NAMES])
    np.testing.assert_allclose(image.gains, by_control[:, None] * found.gains * by_state, atol=1e-6)


def test_a_smaller_limit_holds_more_tightly(model, found):
    tight = H.design(H.HoverModel.of(model), {"forward": 0.25})
    forward = H.STATES.index("forward")
    assert tight.gains[2, forward] > 1.5 * found.gains[2, forward]


@pytest.mark.parametrize(
    ("limits", "text"),
    [
        ({"forwards": 1.0}, "limit .forwards.: unknown, allowed are u, v, w"),
        ({"forward": 0.0}, "limit forward = 0.0: allowed are 0.0001 to 10000"),
        ({"u": math.nan}, "limit u = nan: allowed are 0.0001 to 10000"),
        ({"heading": 1e-4, "r": 1e-3}, "the complete model has a pole at"),
    ],
)
def test_limits_that_give_no_design_are_refused(model, limits, text):
    with pytest.raises(PilotError, match=text):
        H.design(H.HoverModel.of(model), limits)


def test_only_a_model_of_hover_is_taken(sbs):
    with pytest.raises(PilotError, match="airspeed = 5: allowed is a model of hover"):
        H.HoverModel.of(linearize(sbs, airspeed=5.0))


def test_the_description_holds_gains_poles_and_margins(found):
    text = "\n".join(found.describe())
    assert f"{found.gains[2, H.STATES.index('forward')]:.4f}" in text
    assert f"{found.margins[-1].disk:.2f}" in text
    assert "with all 38 states" in text


# --- flights ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("held", range(4))
def test_a_small_departure_decays_as_the_linear_models_say(sbs, model, found, held):
    """The nonlinear aircraft beside the 38 states sampled (to 2 % of the departure), and the design (to 10 %)."""
    target = np.zeros(4)
    target[held] = SMALL
    flight = simulate_with_pilot(sbs, model.trim, pilot_to(found, target[:3], target[3]).controls, 5.0, delay=H.DELAY)
    quaternion = flight["qz"] * 2.0
    flown = np.vstack([errors(flight), quaternion])[held] - target[held]
    n = len(found.model.state_names)
    start = np.concatenate([np.zeros(n), -target, found.anticipation @ -target, np.zeros(8)])
    matrix = closed_loop(found.model.plant(), H.compensator(found.gains), H.TICK, H.DELAY)
    complete = [start]
    for _ in flight["time"][1:]:
        complete.append(matrix @ complete[-1])
    np.testing.assert_allclose(flown, np.array(complete)[:, n + held], atol=0.02 * SMALL)
    a, b = H.design_matrices(found.model)
    start = np.concatenate([np.zeros(8), -target, found.anticipation @ -target, np.zeros(4)])
    designed = [(expm(time * (a - b @ found.gains)) @ start)[8 + held] for time in flight["time"][::20]]
    np.testing.assert_allclose(flown[::20], designed, atol=0.1 * SMALL)


def test_the_slowest_decay_of_a_flight_is_the_slowest_pole(sbs, model, found):
    """Height: its poles are real, and after 6 s the slowest of them is alone."""
    flight = simulate_with_pilot(sbs, model.trim, pilot_to(found, (0.0, 0.0, SMALL)).controls, 9.0)
    left = np.abs(flight["down"] - SMALL)
    rate = -np.log(left[-1] / left[700]) / 2.0
    slowest = np.abs(found.complete_poles[np.abs(found.complete_poles.imag) < 1e-6]).min()
    assert rate == pytest.approx(slowest, rel=0.1)


def test_a_step_of_the_target_is_reached(sbs, model, found):
    """Beyond its reach too, with a turn, and without flying far over it."""
    place = np.array([3.0, -2.0, -1.0])
    flight = simulate_with_pilot(sbs, model.trim, pilot_to(found, place, 1.0).controls, 14.0)
    left = np.linalg.norm(errors(flight, place), axis=0)
    assert left[-1] < 0.03
    assert left[-1] < left[-300] < left[-600]
    heading = 2.0 * math.atan2(flight["qz"][-1], flight["qw"][-1])
    assert heading == pytest.approx(1.0, abs=0.01)
    for name, value in zip(("north", "east", "down"), place, strict=True):
        assert np.max(flight[name] / value) < 1.15
    assert np.hypot(flight["u"], flight["v"]).max() < 2.0


def test_integrals_trim_a_steady_wind(sbs, model, found):
    """The place is held again without an error, with other controls than in still air."""
    flight = simulate_with_pilot(
        sbs, model.trim, H.HoverHold(found).controls, 16.0, wind=Wind(velocity=(-3.0, 2.0, 0.0))
    )
    assert np.linalg.norm(errors(flight), axis=0)[-1] < 2e-3
    assert np.linalg.norm(errors(flight), axis=0).max() > 0.1
    change = np.abs(flight["controls"][-1] - model.trim.controls)
    assert change.max() > math.radians(0.5)


def test_every_heading_is_like_north(sbs, model, found):
    """Wind, aircraft and target turned together give the flight turned."""
    turn = 2.0
    c, s = math.cos(turn), math.sin(turn)
    start, wind = trimmed_state(sbs, model.trim), Wind(velocity=(-3.0, 1.0, 0.0))
    north = simulate_with_pilot(sbs, start, pilot_to(found, (0.5, 0.2, 0.0)).controls, 2.0, wind=wind)
    wind = Wind(velocity=(-3.0 * c - 1.0 * s, -3.0 * s + 1.0 * c, 0.0))
    start = trimmed_state(sbs, model.trim, heading=turn)
    place = (0.5 * c - 0.2 * s, 0.5 * s + 0.2 * c, 0.0)
    turned = simulate_with_pilot(sbs, start, pilot_to(found, place, turn).controls, 2.0, wind=wind)
    np.testing.assert_allclose(turned["controls"], north["controls"], atol=1e-9)
    np.testing.assert_allclose(turned["north"] * c + turned["east"] * s, north["north"], atol=1e-9)


def test_turbulence_and_a_gust_leave_it_at_its_position(sbs, model, found):
    air = Wind(
        velocity=(-4.0, 0.0, 0.0),
        turbulence_intensity=(1.5, 1.5, 1.5),
        turbulence_airspeed=4.0,
        gust=(0.0, 4.0, 2.0),
        gust_delay=4.0,
        gust_duration=2.0,
        turbulence_seed=3,
    )
    flight = simulate_with_pilot(sbs, model.trim, H.HoverHold(found).controls, 10.0, wind=air, delay=1)
    assert np.linalg.norm(errors(flight), axis=0).max() < 1.5
    assert np.abs(flight["controls"] - model.trim.controls).max() <= H.AUTHORITY


def test_its_authority_is_never_exceeded(found):
    """Nor do integrals wind up meanwhile: back at its place it asks for no more than the lag remembers."""
    pilot = pilot_to(found)
    body = np.array([*[0.0] * 3, *euler_to_quaternion(0.0, 0.6, -0.6), 8.0, 5.0, 3.0, 1.0, -1.0, 0.5])
    for i in range(500):
        given = pilot.controls(0.01 * i, body)
        assert np.abs(given - found.model.controls).max() <= H.AUTHORITY + 1e-12
    at_rest = np.array([*[0.0] * 3, *euler_to_quaternion(0.0, found.model.pitch, found.model.roll), *[0.0] * 6])
    for i in range(500, 600):
        given = pilot.controls(0.01 * i, at_rest)
    np.testing.assert_allclose(given, found.model.controls, atol=1e-6)


def test_when_time_goes_back_it_stays_where_it_is_then(found):
    pilot = pilot_to(found, (1.0, 2.0, 3.0))
    body = np.array([*[0.0] * 3, 1.0, *[0.0] * 9])
    pilot.controls(10.0, body)
    body[:3] = 5.0, 6.0, 7.0
    np.testing.assert_allclose(pilot.controls(0.0, body), found.model.controls, atol=1e-12)
    np.testing.assert_array_equal(pilot.target[0], [5.0, 6.0, 7.0])


def test_a_repeated_instant_changes_nothing(found):
    pilot = pilot_to(found, (1.0, 0.0, 0.0))
    body = np.array([*[0.0] * 3, 1.0, *[0.0] * 9])
    first = pilot.controls(1.0, body)
    np.testing.assert_array_equal(pilot.controls(1.0, body), first)


def test_what_is_not_finite_is_refused_and_changes_nothing(found):
    pilot = pilot_to(found)
    body = np.array([*[0.0] * 3, 1.0, *[0.0] * 9])
    before = pilot.controls(0.0, body)
    with pytest.raises(PilotError, match=r"allowed are -1e.09 to 1e.09"):
        pilot.controls(0.0, np.where(np.arange(13) == 9, np.nan, body))
    with pytest.raises(PilotError, match=r"allowed are 3 numbers up to 1e.09 m"):
        pilot.hold((0.0, math.inf, 0.0), 0.0)
    np.testing.assert_array_equal(pilot.controls(0.0, body), before)


def test_the_first_controls_of_a_pilot_are_treated_like_all_others(sbs, model):
    """Beyond the range of the collective they are clipped, beyond reason refused by their name."""
    highest = sbs.control_ranges["collective"][1]
    # of a state alone the positions of the swashplates are given
    for start in (model.trim, trimmed_state(sbs, model.trim)):
        flights = [
            simulate_with_pilot(sbs, start, lambda t, x, c=c: [c, 0.0, 0.0, 0.0], 0.05)
            for c in (highest, highest + 0.3)
        ]
        np.testing.assert_array_equal(flights[1]["state"], flights[0]["state"])
    for value in (math.nan, 2.0):
        with pytest.raises(SimulationError, match=f"^collective = {value}: allowed are"):
            simulate_with_pilot(sbs, model.trim, lambda t, x, c=value: [c, 0.0, 0.0, 0.0], 0.05)


def test_a_delay_out_of_range_is_refused(sbs, model, found):
    with pytest.raises(PilotError, match="delay = -1: allowed are integers from 0 to 100"):
        simulate_with_pilot(sbs, model.trim, H.HoverHold(found).controls, 1.0, delay=-1)
