"""Ground effect against the published points, forward flight, and rotors that have the same inflow without it."""

import math

import numpy as np
import plain_ground
import pytest
from helpers import CALM, Model, aircraft_data
from plain_model import plain_derivative

from sbs_sim import Aircraft, linearize, trim
from sbs_sim.flight.contact import state_on_ground
from sbs_sim.flight.trimmed_state import trimmed_state
from sbs_sim.model import state as S
from sbs_sim.model.frames import euler_to_quaternion, rotation_matrix

HUB, RADIUS = 0.066, 0.505  # m, of sbs: its hubs are below the c.g.
CHEESEMAN_BENNETT = {0.5: 1.333, 1.0: 1.0667, 2.0: 1.0159}  # height over radius: thrust ratio at equal power
PROUTY = {0.127: 0.627, 0.269: 0.737, 0.459: 0.83, 0.663: 0.901, 0.902: 0.955, 1.2: 1.0}  # over diameter: velocity


def above_ground(effect, height, slope_deg=0.0, **every_rotor):
    """The side-by-side helicopter whose c.g. is at a height above the ground below the origin [m]."""
    data = aircraft_data(options={"elements": 6}, every_rotor=every_rotor)
    data["ground"] = {"effect": effect, "altitude": -height, "slope_deg": slope_deg}
    return Aircraft.from_dict(data)


@pytest.fixture(scope="module")
def far():
    """Hover without ground."""
    return trim(Aircraft.from_dict(aircraft_data(options={"elements": 6})))


def same_flight(near, far):
    """Two trims are one and the same."""
    for name in ("controls", "power", "thrust", "state"):
        np.testing.assert_allclose(getattr(near, name), getattr(far, name), rtol=2e-8, atol=1e-9)


@pytest.mark.parametrize(("height", "ratio"), PROUTY.items())
def test_hover_meets_every_point_of_the_measured_curve(far, height, ratio):
    """The blades feel that share of the induced velocity: rotors with 1 / share times of it hover as without ground."""
    near = trim(above_ground("measured", HUB + height * 2 * RADIUS + 1e-12, induced_power_factor=1.0 / ratio))
    same_flight(near, far)
    near = trim(above_ground("measured", HUB + height * 2 * RADIUS + 1e-12))
    saved = far.thrust * (1.0 - ratio) * far["lambda0(1)"] * 2400.0 * math.pi / 30.0 * RADIUS
    np.testing.assert_allclose(far.power - near.power, saved, rtol=0.03, atol=0.02)


@pytest.mark.parametrize(("height", "ratio"), CHEESEMAN_BENNETT.items())
def test_hover_meets_cheeseman_and_bennett(far, height, ratio):
    """Thrust at equal induced power: T v is the same with v over sqrt(T), so that it has the exponent -2/3 of v."""
    share = ratio ** (-3.0 / 2.0)
    assert plain_ground.ground_ratio(above_ground("cheeseman_bennett", 1.0), height, 1.0) == pytest.approx(
        share, rel=1e-3
    )
    exact = (1.0 - 1.0 / (4.0 * height) ** 2) ** 1.5
    same_flight(trim(above_ground("cheeseman_bennett", HUB + height * RADIUS, induced_power_factor=1.0 / exact)), far)


@pytest.mark.parametrize("effect", ["cheeseman_bennett", "measured"])
@pytest.mark.parametrize("airspeed", [3.0, 8.0, 15.0])
def test_the_effect_decays_with_the_speed(effect, airspeed):
    """By 1 / (1 + (V / v_i)^2), and with the tilt: the induced velocity is that of the flight without ground."""
    free = trim(Aircraft.from_dict(aircraft_data(options={"elements": 6})), airspeed)
    tip_speed, height = 2400.0 * math.pi / 30.0 * RADIUS, 0.6
    to_earth = rotation_matrix(euler_to_quaternion(0.0, free.pitch, free.roll))
    decay = to_earth[2, 2] / (1.0 + (airspeed / (free["lambda0(1)"] * tip_speed)) ** 2)
    hub = to_earth[2] @ np.array([0.0, 0.645, HUB])
    craft = above_ground(effect, height + hub)
    share = plain_ground.ground_ratio(craft, height / RADIUS, decay)
    same_flight(trim(above_ground(effect, height + hub, induced_power_factor=1.0 / share), airspeed), free)
    if airspeed == 3.0:
        assert share < 0.95
    else:
        assert share > 0.96


def test_there_is_none_far_from_the_ground(far):
    """The measured curve ends at 1.2 diameters; the image fades."""
    same = trim(above_ground("measured", HUB + 1.2 * 2 * RADIUS + 1e-9))
    np.testing.assert_allclose(same.controls, far.controls, rtol=1e-11, atol=1e-12)
    assert trim(above_ground("cheeseman_bennett", 20.0)).power.sum() == pytest.approx(far.power.sum(), rel=1e-4)
    for effect in ("measured", "cheeseman_bennett"):
        without = Aircraft.from_dict(aircraft_data(options={"elements": 6}) | {"ground": {"effect": effect}})
        np.testing.assert_allclose(trim(without).controls, far.controls, rtol=1e-11, atol=1e-12)


@pytest.mark.parametrize("effect", ["cheeseman_bennett", "measured"])
def test_it_is_smooth_in_height(effect):
    """Value and slope have no steps at the points of the curve, below the lowest and at the end of the image's law."""
    craft, heights = above_ground(effect, 1.0), np.linspace(0.05, 2.6, 1021)
    ratios = np.array([plain_ground.ground_ratio(craft, height, 1.0) for height in heights])
    assert (np.diff(ratios) >= 0.0).all()
    assert np.abs(np.diff(ratios, 2)).max() < 5e-5, "2.5e-3 squared times the curvature; a bend would be its slope"


@pytest.mark.parametrize("effect", ["cheeseman_bennett", "measured"])
def test_the_ground_holds_a_hover_up(effect):
    """Sinking gives thrust: the derivative of w' by the height is that by the inflow, times the slope of the share."""
    height = 0.7
    aircraft = above_ground(effect, HUB + height)
    model = linearize(aircraft)
    point, names = model.trim, model.state_names
    share = plain_ground.ground_ratio(aircraft, height / RADIUS, 1.0)
    step = 1e-4
    slope = np.diff([plain_ground.ground_ratio(aircraft, (height + s) / RADIUS, 1.0) for s in (-step, step)])[0]
    slope /= 2.0 * step
    row = names.index("w")
    by_height = sum(
        model.a[row, names.index(f"lambda{part}({j})")] * point[f"lambda{part}({j})"] * slope / share
        for j in (1, 2)
        for part in "0sc"
    )
    flying, start = Model(aircraft), trimmed_state(aircraft, point)
    rates = []
    for move in (-1e-4, 1e-4):
        moved = start.copy()
        moved[S.DOWN] += move
        rates.append(flying.averaged(moved, point.swashplate)[0][S.VELOCITY + 2])
    by_down = (rates[1] - rates[0]) / 2e-4
    assert by_down == pytest.approx(-by_height, rel=0.01)
    assert by_down < -0.03, "1/s^2: below it, it is accelerated up, at once; more follows when the blades have risen"


@pytest.mark.parametrize("effect", ["cheeseman_bennett", "measured"])
@pytest.mark.parametrize("seed", range(3))
def test_the_derivative_with_ground_is_that_of_the_plain_reference(effect, seed):
    """Ground effect, contact of skids and wheels on a slope, and the rates of their deflections, in violent states."""
    rng = np.random.default_rng(seed)
    data = aircraft_data(options={"elements": 4})
    data["ground"] = {"effect": effect, "contact": "contact", "altitude": 2.0, "slope_deg": 12.0}
    data["ground"]["slope_heading_deg"] = 50.0
    data["contact_points"][1] |= {"rolling": [1.0, 0.3, 0.1], "rolling_friction": 0.2}
    data["contact_points"][2] |= {"side_stiffness": 2000.0, "side_damping": 10.0, "onset": 0.02}
    aircraft = Aircraft.from_dict(data)
    x = state_on_ground(aircraft, 2.0, rng.normal(size=2), rng.uniform(-3, 3))
    x[S.DOWN] += 0.01 - 0.2 * (seed == 2)
    x[S.VELOCITY : S.BODY_SIZE] = rng.normal(scale=0.5, size=6)
    x[S.BODY_SIZE : aircraft.layout.inflow(0).start] = rng.normal(scale=0.05, size=24)
    for j in range(2):
        x[aircraft.layout.inflow(j)] = np.array([0.05, 0.0, 0.0]) + rng.normal(scale=0.01, size=3)
    x[aircraft.layout.contacts_start :] = rng.normal(scale=0.003, size=8)
    swash, psi = rng.normal(scale=0.1, size=(2, 3)), rng.uniform(0, 6, size=2)
    wind = CALM if seed else np.array([2.0, -1.0, 0.5])
    expected, _ = plain_derivative(aircraft, x, swash, psi, wind)
    found, seen = Model(aircraft).derivative(x, swash, psi, wind), aircraft.layout.contacts_start
    np.testing.assert_allclose(found[:seen], expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())
    _, _, rates = plain_ground.contact(aircraft, x, rotation_matrix(x[S.ATTITUDE : S.VELOCITY]))
    np.testing.assert_allclose(found[seen:], rates, rtol=1e-9, atol=1e-12)
    assert rates.any() == (seed != 2)


@pytest.mark.parametrize(("effect", "height"), [("cheeseman_bennett", 0.5), ("measured", 0.254)])
def test_heights_that_were_not_measured_are_said(effect, height):
    """A line for each rotor, in trims."""
    for share, count in ((0.98, 2), (1.02, 0)):
        point = trim(above_ground(effect, HUB + share * height * RADIUS))
        lines = [line for line in point.warnings if "ground effect" in line]
        assert len(lines) == count
        if lines:
            assert f"below {height:g} radii above the ground, where the ground effect is not known" in lines[0]
