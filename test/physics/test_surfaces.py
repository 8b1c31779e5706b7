"""Lifting surfaces and fuselage tables against closed forms, and what aircraft files with them refuse."""

import copy
import functools
import json
import math

import numpy as np
import pytest
from helpers import Model, aircraft_data, build

from sbs_sim import linearize, simulate, trim
from sbs_sim.aircraft import Aircraft
from sbs_sim.aircraft.surfaces import surface_polar
from sbs_sim.errors import AircraftError
from sbs_sim.flight.mixer import Mixer
from sbs_sim.model.packing import side_by_side

DENSITY = 1.225
PLATE = {"name": "plate", "position": [-2.0, 0.0, 0.0], "dihedral_deg": 0.0, "area": 0.5, "aspect_ratio": 5.0}
SHELL = {
    "reference": [0.0, 0.0, 0.0],
    "alpha_deg": [-90.0, 0.0, 90.0],
    "beta_deg": [-90.0, 0.0, 90.0],
    "drag": {"alpha": [2.0, 0.5, 2.0]},
}
WASH = {"rotor": "R1", "skew_deg": [0.0, 40.0, 80.0], "down": [1.8, 1.4, 0.2], "aft": [0.0, 0.5, 0.1]}


@functools.lru_cache
def models(part):
    """Return the models of a heavy aircraft without and with a part of the body, which is JSON."""
    body = {"mass": 1e6, "inertia": np.diag([1e6, 1e6, 1e6]).tolist(), "flat_plate_areas": [0.0, 0.0, 0.0]}
    return [Model(build("sbs_paper", body={**body, **extra})) for extra in ({}, json.loads(part))]


def loads(part, velocity=(0.0, 0.0, 0.0), rates=(0.0, 0.0, 0.0), lambda0=0.0):
    """Return force and moment about the c.g. of a part of the body alone, from the accelerations it gives."""
    rate = [model.derivative(model.state(velocity, rates, lambda0)) for model in models(json.dumps(part))]
    change = 1e6 * (rate[1] - rate[0])
    return change[7:10], change[10:13]


def surface(**changes):
    return {"surfaces": [{**PLATE, **changes}]}


def test_the_lift_slope_is_helmbolds_with_its_limits():
    """2 pi for the infinite wing, pi A / 2 for the slender one."""
    for ratio, slope in ((100.0, 2 * math.pi * 0.98), (0.1, math.pi * 0.1 / 2)):
        found = build(body=surface(aspect_ratio=ratio, max_lift=0.05)).body.surfaces[0].slope
        assert found == pytest.approx(slope, rel=3e-3)


def test_lift_and_damping_of_a_tailplane():
    """Lift q S a alpha with its arm, and pitch damping -rho V S a l^2 / 2 of the angle that the rate gives."""
    speed, alpha, rate = 30.0, math.radians(3.0), 0.2
    slope = 2 * math.pi * 5 / (2 + math.sqrt(29))
    velocity = (speed * math.cos(alpha), 0.0, speed * math.sin(alpha))
    part = surface(zero_lift_drag=0.0, max_lift=1.2)
    force, moment = loads(part, velocity)
    pressure = 0.5 * DENSITY * speed**2
    lift = pressure * 0.5 * slope * alpha
    drag = pressure * 0.5 * (slope * alpha) ** 2 / (math.pi * 5)
    expected = [lift * math.sin(alpha) - drag * math.cos(alpha), 0.0, -lift * math.cos(alpha) - drag * math.sin(alpha)]
    np.testing.assert_allclose(force, expected, atol=1e-3)
    assert moment[1] == pytest.approx(2.0 * expected[2], rel=1e-5)
    _, moment = loads(part, (speed, 0.0, 0.0), (0.0, rate, 0.0))
    damping = -0.5 * DENSITY * speed * 0.5 * slope * 2.0**2 * rate
    assert moment[1] == pytest.approx(damping, rel=0.01)


def test_a_fin_turns_the_nose_into_the_wind_and_a_dihedral_mixes_both():
    force, moment = loads(surface(dihedral_deg=90.0), (20.0, 2.0, 0.0))
    assert force[1] < 0.0 < moment[2]
    assert abs(force[2]) < 1e-6
    level, _ = loads(surface(), (20.0, 0.0, 2.0))
    tilted, _ = loads(surface(dihedral_deg=90.0), (20.0, 2.0, 0.0))
    assert tilted[1] == pytest.approx(level[2], rel=1e-9)


def test_from_any_side_the_air_only_takes_power_and_there_is_none_without_speed():
    """Lift is normal to the flow, drag along it: F . V < 0; forces change continuously over all angles."""
    angles = np.radians(np.arange(-180.0, 180.0, 4.5))
    part = surface(zero_lift_angle_deg=-3.0)
    for angle in angles:
        before, after = (
            np.array([20.0 * math.cos(angle + step), 3.0, 20.0 * math.sin(angle + step)]) for step in (0.0, 1e-4)
        )
        force, _ = loads(part, before)
        assert force @ before < 0.0
        assert np.linalg.norm(loads(part, after)[0] - force) < 1e-4 * 1000.0  # lift slope 520 N/rad
    for part in (surface(), {"fuselage": SHELL}):
        force, moment = loads(part)
        assert not force.any()
        assert not moment.any()
        assert np.abs(loads(part, (1e-9, 0.0, -1e-9))[0]).max() < 1e-6


def test_the_stalled_surface_is_viternas_and_reversed_past_the_right_angle():
    alpha, lift, drag = surface_polar(build(body=surface(max_lift=1.1)).body.surfaces[0])
    assert lift.max() == pytest.approx(1.1)
    assert lift[alpha > math.radians(40)].max() < 1.1
    assert drag[np.argmin(abs(alpha - math.pi / 2))] == pytest.approx(1.11 + 0.018 * 5, rel=1e-9)
    middle = len(alpha) // 2
    at_50, at_130 = middle + 50, middle + 130
    assert lift[at_130] == pytest.approx(-0.7 * lift[at_50], rel=1e-9)
    np.testing.assert_allclose(lift, -lift[::-1], atol=1e-12)


def test_the_incidence_follows_the_airspeed_without_the_wash():
    schedule = {"airspeed": [10.0, 20.0], "incidence_deg": [30.0, -5.0]}
    for speed, incidence in ((5.0, 30.0), (16.0, 9.0), (40.0, -5.0)):
        part = surface(schedule=schedule, max_lift=2.5)
        plain = surface(incidence_deg=incidence, max_lift=2.5)
        np.testing.assert_allclose(
            loads(part, (speed, 0.0, 0.0)), loads(plain, (speed, 0.0, 0.0)), rtol=1e-9, atol=1e-6
        )
    wash = {"rotor": "R1", "down": [3.0]}
    scheduled, fixed = surface(schedule=schedule, wash=wash), surface(incidence_deg=30.0, wash=wash)
    np.testing.assert_allclose(loads(scheduled, lambda0=0.1), loads(fixed, lambda0=0.1), rtol=1e-12)


STABILATOR = {"range_deg": [-20.0, 20.0], "axis": "none", "held_deg": 0.0}


def with_stabilator(**changes):
    """Return an aircraft whose tailplane has its incidence from a control; it begins at 2 deg."""
    data = aircraft_data(rotors=[{}, {}])
    data["controls"]["stabilator"] = STABILATOR
    data["body"] |= surface(incidence_deg=2.0, max_lift=2.0, mixing={"incidence": {"stabilator": 0.5}}, **changes)
    return Aircraft.from_dict(data)


def test_a_control_sets_the_incidence_as_the_file_would():
    """Half of 8 deg more than the file has; loads, trims and linear models follow, and no rotor feels it."""
    aircraft = with_stabilator()
    controls = aircraft.held_controls.copy()
    controls[-1] = math.radians(8.0)
    rows = aircraft.mix(controls)
    assert [row.owner for row in aircraft.rows] == ["R1", "R2", "plate"]
    np.testing.assert_allclose(rows[2], [math.radians(4.0), 0.0, 0.0], rtol=1e-15)
    moved, there = Model(aircraft), Model(build(body=surface(incidence_deg=6.0, max_lift=2.0), rotors=[{}, {}]))
    x = moved.state((25.0, 1.0, 2.0), (0.1, 0.2, 0.3), 0.05)
    np.testing.assert_allclose(moved.derivative(x, rows), there.derivative(x, rows[:2]), rtol=1e-10, atol=1e-9)
    held = aircraft.with_value("controls.stabilator.held_deg", 8.0)
    point, same = trim(held, 15.0), trim(there.aircraft, 15.0)
    np.testing.assert_allclose(point.controls[:4], same.controls, atol=1e-8)
    b = linearize(held, point=point).b[:, -1]
    assert b[2] < -0.1  # leading edge up behind the c.g.: nose down


def test_an_aircraft_with_a_stabilator_flies_by_every_method_and_its_actuator_has_a_rate():
    aircraft = with_stabilator(incidence_rate_deg=10.0, incidence_range_deg=[-3.0, 3.0])
    point = trim(aircraft, 15.0)
    step = point.controls + [0.0, 0.0, 0.0, 0.0, math.radians(10.0)]
    flights = [simulate(aircraft, point, step, 0.3, method=name, actuators=True) for name in ("etd", "rk4")]
    np.testing.assert_allclose(flights[0]["q"], flights[1]["q"], atol=1e-5)
    assert flights[0]["q"][-1] < -0.01
    angles = np.degrees(flights[0]["swashplate"][:, 2, 0])
    np.testing.assert_allclose(np.diff(angles[1:]), 0.1, atol=1e-12)
    assert "clipped: plate incidence at its limit of 3 deg" in flights[0].warnings
    mixer = Mixer(aircraft)
    mixer.set_target(point.controls)
    np.testing.assert_array_equal(mixer.move(0.0), aircraft.mix(point.controls))


def test_the_wash_of_a_hovering_rotor_presses_the_tailplane_down():
    """In hover the skew is 0: the air comes down with 1.8 times the induced velocity, broadside on."""
    rotor = build().rotors[0]
    induced = 0.06 * rotor.speed * rotor.radius
    force, moment = loads(surface(wash=WASH), lambda0=0.06)
    down = 0.5 * DENSITY * (1.8 * induced) ** 2 * 0.5 * (1.11 + 0.018 * 5)
    assert force[2] == pytest.approx(down, rel=1e-6)
    assert moment[1] == pytest.approx(2.0 * down, rel=1e-6)


def test_the_wash_is_interpolated_over_the_skew_of_the_wake():
    rotor = build().rotors[0]
    induced = 0.05 * rotor.speed * rotor.radius
    skew = math.radians(60.0)  # between 40 and 80 deg: down 0.8, aft 0.3
    speed = induced * math.tan(skew)
    washed, _ = loads(surface(wash=WASH), (speed, 0.0, 0.0), lambda0=0.05)
    still, _ = loads(surface(), (speed + 0.3 * induced, 0.0, -0.8 * induced))
    np.testing.assert_allclose(washed, still, rtol=1e-9, atol=1e-6)


def test_a_fuselage_has_the_loads_of_its_tables():
    tables = {
        **SHELL,
        "lift": {"alpha": [0.0, 0.2, 0.0]},
        "pitch": {"alpha": [-1.0, 0.3, 1.0]},
        "side": {"beta": [1.0, 0.0, -1.0]},
        "yaw": {"grid": [[-0.4, 0.0, 0.4]] * 3},
    }
    pressure = 0.5 * DENSITY * 20.0**2
    force, moment = loads({"fuselage": tables}, (20.0, 0.0, 0.0))
    np.testing.assert_allclose(force, [-0.5 * pressure, 0.0, -0.2 * pressure], atol=1e-6)
    np.testing.assert_allclose(moment, [0.0, 0.3 * pressure, 0.0], atol=1e-6)
    # at 45 deg of sideslip half of the tables' ends, in the axes of the flow
    force, moment = loads({"fuselage": tables}, (20.0 * math.sqrt(0.5), 20.0 * math.sqrt(0.5), 0.0))
    across = np.array([-math.sqrt(0.5), math.sqrt(0.5), 0.0])
    assert force @ across == pytest.approx(-0.5 * pressure, rel=1e-9)
    assert moment[2] == pytest.approx(0.2 * pressure, rel=1e-9)
    # from behind the lift changes its sign, the drag only its direction
    force, _ = loads({"fuselage": tables}, (-20.0, 0.0, 0.0))
    np.testing.assert_allclose(force, [0.5 * pressure, 0.0, -0.2 * pressure], atol=1e-6)


def test_flights_side_by_side_have_surfaces_of_their_own():
    first = build(body={**surface(wash=WASH), "fuselage": SHELL})
    other = first.with_values({"body.surfaces.plate.max_lift": 0.4, "body.fuselage.drag.alpha": [1.0, 2.0, 1.0]})
    both = side_by_side([first.model(), other.model()])
    offset = len(first.model().shapes)
    for i, aircraft in enumerate((first, other)):
        own = aircraft.model()
        rows = both.surfaces["first_row"][0, i]
        np.testing.assert_array_equal(both.shapes[i * offset : (i + 1) * offset], own.shapes)
        assert rows == own.surfaces["first_row"][0, 0] + i * offset
        assert both.fuselages["first_row"][0, i] == own.fuselages["first_row"][0, 0] + i * offset


def test_every_key_of_a_part_counts_for_the_aircraft_and_its_model():
    base = build(body={**surface(wash=WASH), "fuselage": SHELL})
    for path, value in {
        "position": [-1.0, 0.0, 0.0],
        "dihedral_deg": 5.0,
        "incidence_deg": 1.0,
        "area": 0.4,
        "aspect_ratio": 4.0,
        "lift_slope": 3.0,
        "zero_lift_angle_deg": 2.0,
        "max_lift": 0.9,
        "zero_lift_drag": 0.02,
        "span_efficiency": 0.7,
        "dynamic_pressure": 0.8,
        "wash.down": [1.0, 1.4, 0.2],
        "wash.aft": [0.1],
        "wash.rotor": "R2",
    }.items():
        changed = base.with_value(f"body.surfaces.plate.{path}", value)
        assert changed.parameter_hash != base.parameter_hash, path
        parts = [(model.surfaces, model.ramps, model.shapes) for model in (changed.model(), base.model())]
        assert any(a.tobytes() != b.tobytes() for a, b in zip(*parts, strict=True)), path


def test_without_parts_a_model_holds_none_of_them(sbs):
    model = sbs.model()
    assert [len(part) for part in (model.surfaces, model.fuselages, model.ramps, model.shapes)] == [0, 0, 0, 0]


REFUSED = {
    "wash.rotor = 'R9': allowed is one of R1, R2": {"wash": {"rotor": "R9"}},
    "wash.down: allowed is a list of 2, the number of wash.skew_deg": {"wash": {"skew_deg": [0.0, 10.0]}},
    "wash.skew_deg: allowed are numbers that increase": {"wash": {"skew_deg": [9.0, 3.0], "down": [1.0, 1.0]}},
    "schedule.incidence_deg: allowed is a list of 1, the number of schedule.airspeed": {
        "schedule": {"airspeed": [3.0]}
    },
    "polar.angle_deg: allowed are angles from -90 to 90 or -180 to 180": {
        "polar": {"angle_deg": [-20.0, 20.0], "lift": [-1.0, 1.0], "drag": [0.1, 0.1]}
    },
    "max_lift = 2.0: allowed is <= 1.55, for a stall at no more than 60 deg": {"max_lift": 2.0, "aspect_ratio": 1.0},
}


@pytest.mark.parametrize("message", REFUSED)
def test_a_surface_that_is_not_possible_is_refused(message):
    with pytest.raises(AircraftError) as caught:
        build(body=surface(**REFUSED[message]))
    assert str(caught.value) == f"body.surfaces[0].{message}"


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"alpha_deg": [-80.0, 0.0, 80.0]}, "alpha_deg: allowed are angles from -90 to 90 or -180 to 180"),
        (
            {"beta_deg": [-90.0, 0.1, 90.0]},
            "beta_deg: allowed are multiples of one step of 0.5 deg or more that divides 90",
        ),
        ({"drag": {"alpha": [1.0]}}, "drag.alpha: allowed is a list of 3, the number of alpha_deg, or none"),
        ({"yaw": {"grid": [[1.0, 2.0]]}}, "yaw.grid: allowed are 3 lists of 3, as alpha_deg and beta_deg have"),
    ],
)
def test_a_fuselage_that_is_not_possible_is_refused(changes, message):
    data = aircraft_data(body={"fuselage": {**copy.deepcopy(SHELL), **changes}})
    with pytest.raises(AircraftError) as caught:
        Aircraft.from_dict(data)
    assert str(caught.value) == f"body.fuselage.{message}"
