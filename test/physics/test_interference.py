"""Wash of rotors on one another: closed forms, the law of Biot and Savart, symmetries (theory.md section 6.5)."""

import math

import numpy as np
import pytest
from helpers import Model, aircraft_data, build, mirrored_data, mirrored_state, mirrored_swash, unit
from plain_interference import flow_through
from plain_model import plain_derivative, random_state

from sbs_sim.aircraft import Aircraft
from sbs_sim.aircraft.interference import CELLS, Pair, directions, influence, node_values, pair_of
from sbs_sim.analysis.linearize import linearize
from sbs_sim.analysis.trim import trim
from sbs_sim.errors import AircraftError
from sbs_sim.flight.engine import Engine
from sbs_sim.flight.trimmed_state import trimmed_state
from sbs_sim.flight.validity import warnings
from sbs_sim.model import state as S
from sbs_sim.model import working_state as W
from sbs_sim.model.packing import lane_count, side_by_side
from sbs_sim.model.records import OTHERS

ON, OFF = {"interference": "skewed_wake"}, {"interference": "none"}
CALM = np.zeros(3)


def meeting(*rotors, name="sbs", **changes):
    """Return an aircraft with interference whose rotors have the given changes."""
    return build(name, options=ON, rotors=list(rotors) or None, **changes)


def side(distance):
    """Return changes of two rotors side by side, their axes `distance` diameters apart."""
    return [{"hub": [0.0, sign * distance * 0.505, 0.066]} for sign in (-1.0, 1.0)]


def lying(*hub, radius=1.0, axes=((1, 0, 0), (0, 1, 0), (0, 0, 1)), expansion=1.0):
    """Return the geometry of a disc in a wake, which contracts for an expansion of 1/2."""
    return Pair(tuple(map(float, hub)), tuple(float(x) for row in axes for x in row), radius, expansion)


def along(chi_deg, azimuth=0.0):
    """Return the direction of a wake with a skew; azimuth 0 is flight forward, pi/2 to the right."""
    size = math.tan(math.radians(chi_deg) / 2)
    return directions(np.array([size * math.cos(azimuth)]), np.array([size * math.sin(azimuth)]), False)


def wash_of(aircraft, velocity, lambda0):
    """Return the rows of the wash over lambda0 of all rotors, shape (4, n_rotors)."""
    model = Model(aircraft)
    model.derivative(model.state(velocity, lambda0=lambda0))
    return model.engine.work.wash[..., 0] / lambda0


# -- fast flight: two elliptically loaded spans in the Trefftz plane ---------------------------------------------------


def trefftz(distance):
    """Return mean and lateral slope of 1 - Y / sqrt(Y^2 - 1) over a span, with the weight of an ellipse."""
    x, weights = np.polynomial.legendre.leggauss(60)
    y, weight = np.sin(x * np.pi / 2), np.cos(x * np.pi / 2) ** 2 * weights
    flow = 1.0 - (2 * distance + y) / np.sqrt((2 * distance + y) ** 2 - 1.0)
    return weight @ flow / weight.sum(), weight @ (flow * y) / (weight @ y**2)


@pytest.mark.parametrize(
    ("distance", "change", "slope"), [(1.0, -0.273, None), (1.277, -0.104, 0.1), (2.0, -0.035, 0.019)]
)
def test_edgewise_flow_has_the_wash_of_two_spans_in_the_trefftz_plane(distance, change, slope):
    mean, _, gradient = influence(lying(0.0, 2.0 * distance, 0.0), along(90.0))[0]
    closed_mean, closed_slope = trefftz(distance)
    assert mean == pytest.approx(closed_mean, abs=6e-4)
    assert gradient == pytest.approx(closed_slope, abs=2e-3)
    assert mean == pytest.approx(change, abs=1e-3)
    if slope is not None:
        assert gradient == pytest.approx(slope, abs=1e-3)


def test_fast_flight_saves_the_induced_power_that_the_trefftz_plane_has():
    """Of a body without drag at 40 m/s: the change of power over the induced power without interference."""
    body = {"flat_plate_areas": [0.0, 0.0, 0.0]}
    alone, together = (trim(build(body=body, options=options), 40.0) for options in (OFF, ON))
    aircraft = build(body=body)
    tip_speed = aircraft.rotors[0].speed * aircraft.rotors[0].radius
    first = aircraft.layout.linear_names.index("lambda0(1)")
    induced = sum(alone.thrust) * alone.state[first] * tip_speed
    saved = (np.sum(together.power) - np.sum(alone.power)) / induced
    assert saved == pytest.approx(trefftz(0.645 / 0.505)[0], rel=0.1)
    assert np.ptp(together.thrust) == pytest.approx(0.0, abs=1e-6)


# -- hover -------------------------------------------------------------------------------------------------------------


def test_in_hover_rotors_beside_one_another_do_not_meet():
    """The plane of an evenly loaded disc has no flow outside of the disc, since that of an endless cylinder is none."""
    assert np.abs(wash_of(meeting(), (0.0, 0.0, 0.0), 0.057)).max() < 1e-6
    powers = [np.sum(trim(build(options=options), 0.0).power) for options in (OFF, ON)]
    assert powers[1] == pytest.approx(powers[0], rel=1e-6)


@pytest.mark.parametrize("depth", [0.2, 1.0, 4.0])
def test_flow_down_the_axis_of_a_cylinder(depth):
    """1 + z / sqrt(1 + z^2) at the axis, of a wake that does not contract."""
    found = influence(lying(0.0, 0.0, depth, radius=0.1), along(0.0))[0]
    np.testing.assert_allclose(found, [1.0 + depth / math.hypot(1.0, depth), 0.0, 0.0], atol=0.002)


def test_a_wake_carries_its_flow_however_far_it_contracts():
    """Twice the velocity over the share a_w of the area far below, as a larger disc there meets all of it."""
    for expansion in (1.0, 0.75, 0.5):
        below = influence(lying(0.1, 0.0, 60.0, radius=1.2, expansion=expansion), along(0.0))[0, 0]
        assert below * 1.2**2 == pytest.approx(2.0 * expansion, abs=0.001)
    assert influence(lying(0.0, 0.0, -60.0), along(0.0))[0, 0] == pytest.approx(0.0, abs=1e-3)


@pytest.mark.parametrize(("gap", "factor", "tolerance"), [(0.002, math.sqrt(2.0), 0.02), (20.0, 1.281, 0.03)])
def test_coaxial_rotors_have_the_induced_power_of_momentum_theory(gap, factor, tolerance):
    """Leishman, section 2.15: 1.41 in one plane, 1.28 where the lower rotor is in the far wake of the upper one.

    Induced power over that of two rotors alone. Here the mean of the wash counts over all of the lower disc, there the
    two parts of the disc count each; that is the difference of 2 %.
    """
    rotors = [{"hub": [0.0, 0.0, -0.42]}, {"hub": [0.0, 0.0, -0.42 + gap * 0.505]}]
    aircraft = meeting(*rotors, name="coaxial", body={"inertia": np.diag([500.0, 500.0, 1.0]).tolist()})
    found = trim(aircraft, 0.0)
    places = [aircraft.layout.linear_names.index(f"lambda0({j})") for j in (1, 2)]
    model = Model(aircraft)
    x = model.state()
    inflow = found.state[places]
    for j in range(2):
        x[aircraft.layout.inflow(j).start] = inflow[j]
    model.derivative(x)
    through = inflow + model.engine.work.wash[OTHERS, :, 0]
    rotor, density = aircraft.rotors[0], aircraft.environment.air_density
    area, tip_speed = math.pi * rotor.radius**2, rotor.speed * rotor.radius
    alone = (found.thrust**1.5).sum() / math.sqrt(2 * density * area)
    assert (found.thrust * through).sum() * tip_speed / alone == pytest.approx(factor, rel=tolerance)


# -- the law of Biot and Savart ----------------------------------------------------------------------------------------

GEOMETRIES = {
    "beside": (lying(0.0, 2.55, 0.0), 60.0),
    "behind": (lying(-2.2, 0.4, -0.3), 65.0),
    "below": (lying(0.4, 0.3, 0.9, radius=0.8), 25.0),
    "on its side": (lying(-1.6, -0.9, 0.4, radius=0.3, axes=((1, 0, 0), (0, 0, -1), (0, 1, 0))), 70.0),
}


@pytest.mark.parametrize("name", GEOMETRIES)
def test_influence_is_the_flow_by_the_law_of_biot_and_savart(name):
    pair, chi = GEOMETRIES[name]
    direction = along(chi, 0.3)[0]
    expected = flow_through(np.array(pair.hub), np.reshape(pair.axes, (3, 3)), pair.radius, direction)
    np.testing.assert_allclose(influence(pair, direction[None])[0], expected, atol=0.02)


@pytest.mark.parametrize("chi", [20.0, 60.0, 85.0])
def test_equal_power_either_way_in_reversed_flow(chi):
    """Reverse-flow theorem: A_i g_ij(e) = A_j g_ji(-e) of evenly loaded discs, here of two sizes and heights."""
    hub, radius, direction = np.array([0.6, 1.0, 0.6]), 0.7, along(chi, 0.8)
    there = influence(lying(*hub, radius=radius), direction)[0, 0] * radius**2
    back = influence(lying(*(-hub / radius), radius=1.0 / radius), -direction)[0, 0]
    assert there == pytest.approx(back, abs=2e-3)


# -- tables and kernel -------------------------------------------------------------------------------------------------


def test_tables_follow_the_influence_between_their_nodes():
    aircraft = meeting(name="tandem")
    source, target = aircraft.rotors[:2]
    tip_speed, lambda0 = source.speed * source.radius, 0.02
    for x, y in np.array([(0.5, 0.1), (0.7, -0.3), (-0.2, 0.6)]) + 0.45 * 2.0 / CELLS:
        direction = directions(np.array([x]), np.array([y]), False)[0]
        edgewise = direction * lambda0 * tip_speed / direction[2]
        rows = wash_of(aircraft, (-edgewise[0], -edgewise[1], 0.0), lambda0)
        expected = influence(pair_of(source, target), direction[None])[0]
        found = [rows[OTHERS, 1], -rows[S.COSINE, 1], rows[S.SINE, 1] * target.rotation]
        # shafts of tandem stand upright, or the skew would be another one
        np.testing.assert_allclose(found, expected, atol=0.01)


def test_wash_and_its_slope_are_continuous():
    """Along a line through cells and over the rim of the table, in steps of 1/40 of a cell."""
    model = Model(meeting())
    speeds, x = np.linspace(1.0, 60.0, 4000), model.state(lambda0=0.02)
    found = []
    for speed in speeds[::4]:
        x[S.VELOCITY : S.VELOCITY + 3] = 0.4 * speed, 0.9 * speed, 1.1  # climbs turn to descents on the way
        model.derivative(x)
        found.append(model.engine.work.wash[:, 0, 0].copy())
    changes = np.diff(found, axis=0)
    turns = np.abs(np.diff(changes, axis=0)).max(axis=0)
    assert (turns < 0.1 * np.abs(changes).max(axis=0)).all()


@pytest.mark.parametrize("edgewise", [0.0, 0.05])
def test_a_wake_turns_over_without_a_jump(edgewise):
    """Two rotors one above the other sink at a constant inflow, from wakes below through no flow to wakes above."""
    aircraft, lambda0 = build("coaxial", options=ON), 0.05
    upper, lower = aircraft.rotors
    inflow = lambda0 * upper.speed * upper.radius
    sinking = np.linspace(0.6, 1.4, 401)
    model, found = Model(aircraft), []
    for ratio in sinking:
        model.derivative(model.state((edgewise * inflow, 0.0, ratio * inflow), lambda0=lambda0))
        found.append(model.engine.work.wash[OTHERS, :, 0] / lambda0)
    changes = np.diff(found, axis=0)
    turns = np.abs(np.diff(changes, axis=0)).max(axis=0)
    assert (turns < 0.1 * np.abs(changes).max(axis=0)).all()
    if edgewise == 0.0:  # outside of a quarter of the inflow the wakes that they were
        there, back = pair_of(upper, lower), pair_of(lower, upper)
        for row, down in ((found[0], 1.0), (found[-1], -1.0)):
            expected = [influence(pair, np.array([[0.0, 0.0, down]]))[0, 0] for pair in (back, there)]
            np.testing.assert_allclose(row, expected, atol=2e-3)


def test_where_wakes_roll_up_or_have_no_direction_is_said():
    rolled, none = "where that rolls up", "hardly any flow through the disc"
    lines = trim(meeting(name="tandem"), 15.0).warnings
    assert [line.split(":")[0] for line in lines if rolled in line] == ["R2"]  # the rear one
    assert not any(rolled in line for name in ("coaxial", "sbs") for line in trim(meeting(name=name), 15.0).warnings)
    rows = np.zeros((2, W.WORKING_SIZE))
    rows[:, W.HOVER_INFLOW], rows[:, W.DESCENT] = 0.06, 0.01
    for flow, along, said in ((0.01, 0.0, True), (-0.01, 0.0, True), (0.02, 0.0, False), (0.01, 0.02, False)):
        rows[:, W.FLOW], rows[:, W.ADVANCE_RATIO] = flow, along
        assert any(none in line for line in warnings(meeting(), rows)) == said
        assert not any(none in line for line in warnings(build(options=OFF), rows))


@pytest.mark.parametrize("lanes", ["blades", "points"])
@pytest.mark.parametrize("name", ["sbs", "tilted", "tail rotor", "paper"])
def test_kernel_agrees_with_the_plain_reference(name, lanes):
    tilted = [{"shaft_direction": unit(0.1, -0.2, -1.0)}, {"shaft_direction": unit(-0.15, 0.3, -0.9)}]
    tail = {"hub": [-1.2, 0.05, -0.2], "shaft_direction": [0.0, 1.0, 0.0], "duct_expansion": 0.8, "rotation": 1}
    changes = {"sbs": [], "tilted": tilted, "tail rotor": [{"induced_power_factor": 1.2}, {}, tail], "paper": []}[name]
    aircraft = meeting(*changes, name="sbs_paper" if name == "paper" else "sbs")
    rng = np.random.default_rng(3)
    for _ in range(2):
        x = random_state(aircraft, rng)
        swash, psi = rng.normal(scale=0.1, size=(len(aircraft.rotors), 3)), rng.uniform(0, 6, len(aircraft.rotors))
        expected, _ = plain_derivative(aircraft, x, swash, psi, CALM)
        found = Model(aircraft, lanes=lanes).derivative(x, swash, psi)
        scale = np.maximum(np.abs(expected), 1e-3 * np.abs(expected).max())
        assert (np.abs(found - expected) / scale).max() < 1e-7
        without = Model(build(options=OFF, rotors=changes or None)).derivative(x, swash, psi)
        assert np.abs(found - without).max() > 0.01 or name == "paper"


def test_flights_side_by_side_have_tables_of_their_own():
    near, far = meeting(*side(1.05)), meeting(*side(1.6))
    half = lane_count() // 2
    engine = Engine(side_by_side([near.model(True, True), far.model(True, True)] * half))
    rng = np.random.default_rng(4)
    x, swash, psi = random_state(near, rng), rng.normal(scale=0.1, size=(2, 3)), np.zeros(2)
    given = [engine.lanes([values.ravel()] * 2 * half) for values in (x, swash, psi, CALM)]
    dx = given[0].copy()
    engine.derivative(engine.model, *given, engine.work, dx, True)
    for lane, aircraft in enumerate((near, far)):
        np.testing.assert_array_equal(dx[:, lane], Model(aircraft, lanes="points").derivative(x, swash, psi))


# -- symmetry, sideslip, aircraft --------------------------------------------------------------------------------------


def test_the_mirror_image_flies_the_mirror_image():
    data = aircraft_data(options=ON, rotors=[{"shaft_direction": unit(0.1, -0.1, -1.0)}, {"hub": [0.1, 0.6, 0.1]}])
    aircraft, image = Aircraft.from_dict(data), Aircraft.from_dict(mirrored_data(data))
    rng = np.random.default_rng(5)
    x, swash = random_state(aircraft, rng), rng.normal(scale=0.1, size=(2, 3))
    found = Model(image).derivative(mirrored_state(x), mirrored_swash(swash))
    expected = mirrored_state(Model(aircraft).derivative(x, swash))
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-8)


def test_mirrored_pairs_have_mirrored_tables():
    left, right = meeting().rotors
    there, back = node_values(pair_of(left, right)), node_values(pair_of(right, left))
    np.testing.assert_array_equal(there, np.flip(back, 2) * [1.0, 1.0, -1.0])


def test_a_canted_rotor_in_the_plane_of_symmetry_has_mirrored_tables():
    """Of both senses of the cant, on one hub."""
    axes = np.array([[1.0, 0.0, 0.0], [0.0, 0.6, -0.8], [0.0, 0.8, 0.6]])
    there, back = (node_values(lying(-1.4, 0.0, 0.1, radius=0.2, axes=one)) for one in (axes, axes.T))
    np.testing.assert_array_equal(there, np.flip(back, 2) * [1.0, 1.0, -1.0])


def test_the_tables_of_symmetric_places_are_symmetric():
    """No rounding is enlarged where a disc is near a filament or a wake nearly level."""
    values = node_values(lying(-1.7, 0.0, -0.12, axes=((0.99, 0, 0.141), (0, 1, 0), (-0.141, 0, 0.99)), expansion=0.5))
    np.testing.assert_allclose(values, np.flip(values, 2) * [1.0, 1.0, -1.0], atol=1e-13)


def test_a_nearly_level_wake_meets_what_a_level_one_meets():
    """Its axis at the depth of the disc is far away, and the hub's way from it is no difference of such lengths."""
    pair = lying(-1.4321, 0.3, 0.4, expansion=0.5)
    level, nearly = (influence(pair, np.array([[-1.0, 0.0, slope]])) for slope in (0.0, 1e-14))
    np.testing.assert_allclose(nearly, level, atol=1e-10)


def test_a_symmetric_aircraft_flies_straight():
    found = trim(meeting(), 15.0)
    assert found.roll == pytest.approx(0.0, abs=1e-9)
    assert np.ptp(found.power) == pytest.approx(0.0, abs=1e-6)


def test_sideslip_puts_one_rotor_into_the_wake_of_the_other():
    """To the right at 10 m/s: the left rotor is behind, in up to twice the induced velocity, the other in none."""
    rows = wash_of(meeting(), (0.0, 10.0, 0.0), 0.02)
    assert 0.7 < rows[OTHERS, 0] < 2.0
    assert -0.1 < rows[OTHERS, 1] < 0.0
    forward = wash_of(meeting(), (10.0, 0.0, 0.0), 0.02)
    assert forward[OTHERS, 0] == forward[OTHERS, 1]


@pytest.mark.parametrize("name", ["coaxial", "tandem"])
def test_trims_are_found_from_hover_to_20_m_per_s(name):
    """The lower rotor, and the rear one, need more power than without interference."""
    alone, together = (build(name, options=options) for options in (OFF, ON))
    for speed in (0.0, 5.0, 10.0, 20.0):
        assert np.sum(trim(together, speed).power) > np.sum(trim(alone, speed).power) - 0.5


def test_linear_model_and_trim_have_the_wash():
    """The inflow of one rotor in the rates of the other, as differences of the averaged derivative say."""
    aircraft = meeting()
    linear, layout = linearize(aircraft, airspeed=15.0), aircraft.layout
    x, swash = trimmed_state(aircraft, linear.trim), linear.trim.swashplate
    place, step, model = layout.inflow(1).start, 1e-6, Model(aircraft)
    sides = []
    for sign in (1.0, -1.0):
        x[place] += sign * step
        sides.append(model.averaged(x, swash)[0])
        x[place] -= sign * step
    expected = (sides[0] - sides[1])[S.BODY_SIZE :] / (2 * step)
    found = linear.a[S.LINEAR_BODY_SIZE :, place - S.BODY_SIZE + S.LINEAR_BODY_SIZE]
    np.testing.assert_allclose(found, expected, atol=1e-5 * np.abs(expected).max())


def test_unknown_models_are_refused():
    with pytest.raises(AircraftError, match=r"options\.interference = 'vortex': allowed is one of none, skewed_wake"):
        build(options={"interference": "vortex"})
