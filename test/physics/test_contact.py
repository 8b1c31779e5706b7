"""Contact with the ground against closed forms, the balance of energy, and the limits of the steps."""

import math

import numpy as np
import pytest
from helpers import aircraft_data

from sbs_sim import Aircraft, simulate
from sbs_sim.errors import AircraftError, SimulationError
from sbs_sim.flight.contact import amplification, state_on_ground
from sbs_sim.flight.simulation import METHODS, Simulation
from sbs_sim.flight.sortie import Sortie, fly_together
from sbs_sim.model import state as S
from sbs_sim.model.frames import rotation_matrix
from sbs_sim.model.integrate import RK4

G, MASS, HEIGHT, HALF_TRACK, MU = 9.80665, 20.62, 0.30, 0.25, 0.6
STILL = np.zeros(4)
VACUUM = {"air_density": 0.0}


def standing(ground=None, environment=VACUUM, **point):
    """The side-by-side helicopter on its skids, with other ground, air and contact points."""
    data = aircraft_data(options={"elements": 6}, environment=environment)
    data["ground"] = {"contact": "contact", "altitude": 0.0, **(ground or {})}
    data["contact_points"] = [one | point for one in data["contact_points"]]
    return Aircraft.from_dict(data)


def above(aircraft, height, **states):
    """State of an aircraft that heads north, level, with the c.g. at a height above the origin."""
    state = np.zeros(aircraft.layout.size)
    state[S.DOWN], state[S.ATTITUDE] = -height, 1.0
    for name, value in states.items():
        state[aircraft.layout.names.index(name)] = value
    return state


def steep(tangent, heading_deg=0.0):
    """Ground that rises by a tangent."""
    return {"slope_deg": math.degrees(math.atan(tangent)), "slope_heading_deg": heading_deg}


@pytest.mark.parametrize("method", ["etd", "rk4", "tsit5"])
def test_a_drop_bounces_and_settles_as_a_mass_on_springs(method):
    """Undamped: the period 2 pi sqrt(m / k), and every bounce as high as the first; damped: the depth m g / k."""
    aircraft = standing(damping=0.0)
    stiffness = 4 * aircraft.contact_points[0].stiffness
    settled = HEIGHT - MASS * G / stiffness
    flight = simulate(aircraft, above(aircraft, settled + 0.002), STILL, 2.5, tick=0.005, method=method)
    height = -flight["down"] - settled
    rising = np.flatnonzero((height[:-1] < 0.0) & (height[1:] >= 0.0))
    times = (rising - height[rising] / (height[rising + 1] - height[rising])) * 0.005
    assert np.diff(times).mean() == pytest.approx(2 * math.pi / math.sqrt(stiffness / MASS), rel=1e-3)
    assert np.abs(height).max() == pytest.approx(0.002, rel=0.02)
    aircraft = standing()
    flight = simulate(aircraft, above(aircraft, HEIGHT + 0.05), STILL, 4.0, method=method)
    np.testing.assert_allclose(flight["contact_depth"][-1], HEIGHT - settled, rtol=1e-3)
    force = flight["contact_force"][-200:].sum(axis=1).mean(axis=0)  # the blades of a vacuum go on flapping
    np.testing.assert_allclose(force, [0.0, 0.0, -MASS * G], rtol=1e-4, atol=1e-6)
    assert flight["contact_force"][..., 2].max() <= 0.0, "the ground never pulls"
    assert (flight["contact_force"][flight["contact_depth"] < 0.0] == 0.0).all()


@pytest.mark.parametrize("heading_deg", [0.0, 130.0])
def test_friction_holds_up_to_its_limit_without_creep_and_slides_beyond_it(heading_deg):
    """On a slope of nearly mu nothing moves for 10 s; on a steeper one it slides with g (sin - mu cos)."""
    aircraft = standing(steep(0.97 * MU, heading_deg))
    start = state_on_ground(aircraft, 0.0, heading=math.radians(heading_deg))
    flight = simulate(aircraft, start, STILL, 12.0)
    np.testing.assert_allclose(flight["state"][300:, :3] - flight["state"][-1, :3], 0.0, atol=1e-6)
    aircraft = standing(steep(1.1 * MU, heading_deg))
    flight = simulate(aircraft, state_on_ground(aircraft, 0.0, heading=math.radians(heading_deg)), STILL, 3.0)
    slope = math.atan(1.1 * MU)
    slides = G * (math.sin(slope) - MU * math.cos(slope))
    assert flight["u"][100] - flight["u"][300] == pytest.approx(2.0 * slides, rel=1e-3)


def test_a_slide_ends_after_the_way_that_friction_needs():
    """v^2 / (2 mu g); the force is mu times the weight, against the motion."""
    aircraft, speed = standing(stiffness=2e4, damping=400.0), 2.0
    start = above(aircraft, HEIGHT - MASS * G / 8e4, u=speed * math.cos(0.5), v=speed * math.sin(0.5))
    flight = simulate(aircraft, start, STILL, 2.0)
    way = math.hypot(flight["north"][-1], flight["east"][-1])
    assert way == pytest.approx(speed**2 / (2 * MU * G), rel=0.02)
    to_earth = rotation_matrix(flight["state"][15, S.ATTITUDE : S.VELOCITY])
    force = to_earth @ flight["contact_force"][15].sum(axis=0)
    np.testing.assert_allclose(force[:2], MU * force[2] * np.array([math.cos(0.5), math.sin(0.5)]), rtol=1e-2)
    np.testing.assert_allclose(flight["state"][-1, S.VELOCITY : S.BODY_SIZE], 0.0, atol=1e-3)


def test_a_wheel_rolls_ahead_and_holds_across():
    """Along it the coefficient of rolling friction brakes, across it that of a skid; a brake is a larger one."""
    for rolling in (0.02, 0.3):
        aircraft = standing(rolling=[1.0, 0.0, 0.0], rolling_friction=rolling)
        flight = simulate(aircraft, above(aircraft, HEIGHT - 0.0101, u=5.0), STILL, 1.0)
        assert (flight["u"][40] - flight["u"][-1]) / 0.6 == pytest.approx(rolling * G, rel=2e-3)
    across = standing(steep(0.5, 90.0), rolling=[1.0, 0.0, 0.0])
    flight = simulate(across, state_on_ground(across, 0.0), STILL, 3.0)
    np.testing.assert_allclose(flight["state"][-1, :3], flight["state"][0, :3], atol=5e-3)
    np.testing.assert_allclose(flight["state"][-1, :3], flight["state"][-101, :3], atol=1e-5)
    along = standing(steep(0.5, 0.0), rolling=[1.0, 0.0, 0.0])
    flight = simulate(along, state_on_ground(along, 0.0), STILL, 1.5)
    slope = math.atan(0.5)
    slides = G * (math.sin(slope) - 0.02 * math.cos(slope))
    assert flight["u"][50] - flight["u"][150] == pytest.approx(slides, rel=2e-3)


@pytest.mark.parametrize(("share", "tips"), [(0.97, False), (1.03, True)])
def test_it_tips_over_where_the_weight_passes_the_skid(share, tips):
    """The angle atan(half track / height), by springs that hardly yield; a blade ends the flight."""
    ground = steep(share * HALF_TRACK / HEIGHT, 90.0)
    aircraft = standing(ground, stiffness=4e5, damping=1500.0, friction=3.0)
    start = state_on_ground(aircraft, 0.0)
    if not tips:
        flight = simulate(aircraft, start, STILL, 2.0)
        assert np.abs(flight["phi"] - flight["phi"][0]).max() < 0.01
        return
    with pytest.raises(SimulationError, match=r"ground contact after step \d+ \(t = .*: the ground is at 0 m"):
        simulate(aircraft, start, STILL, 4.0)


def test_dampers_and_friction_only_take_energy():
    """From a drop with a slide and a spin: what the ground gives is never more than its springs had."""
    aircraft = standing()
    start = above(aircraft, HEIGHT + 0.1, u=1.5, v=0.5, r=2.0, p=0.2)
    flight = simulate(aircraft, start, STILL, 1.5, tick=0.0005)
    positions = np.array([point.position for point in aircraft.contact_points])
    states, point = flight["state"], aircraft.contact_points[0]
    motion = states[:, np.newaxis, S.VELOCITY : S.RATES] + np.cross(
        states[:, np.newaxis, S.RATES : S.BODY_SIZE], positions
    )
    power = np.sum(flight["contact_force"] * motion, axis=(1, 2))
    given = np.concatenate([[0.0], np.cumsum(0.5 * (power[1:] + power[:-1])) * 0.0005])
    springs = 0.5 * point.stiffness * np.sum(np.maximum(flight["contact_depth"], 0.0) ** 2, axis=1)
    first = aircraft.layout.contacts_start
    springs = springs + 0.5 * point.stiffness * np.sum(states[:, first:] ** 2, axis=1)
    taken = -given - springs
    assert np.diff(taken).min() > -2e-3, "of the order of the steps' error"
    assert taken[-1] > 0.9 * 0.5 * MASS * 1.5**2


def test_a_step_that_the_springs_would_not_survive_is_refused():
    """The message names the largest that is stable: a little less flies, a little more is refused."""
    for kind, unit in (("stiffness", "N/m"), ("damping", "N s/m")):
        with pytest.raises(SimulationError) as refused:
            Simulation(too := standing(**{kind: 5e7}), above(too, 1.0), too.mix(STILL))
        said = str(refused.value)
        assert said.startswith(f"contact_points: {kind} = 5e+07 {unit} is not stable at a step of 1 ms: allowed are up")
        largest = float(said.split("up to ")[1].split(",")[0])
        others = {"damping": 200.0} if kind == "stiffness" else {"stiffness": 5000.0}
        with pytest.raises(SimulationError, match="is not stable"):
            Simulation(too := standing(**{kind: 1.01 * largest}, **others), above(too, 1.0), too.mix(STILL))
        aircraft = standing(**{kind: 0.99 * largest}, **others)
        flight = simulate(aircraft, state_on_ground(aircraft, 0.0), STILL, 0.5)
        assert np.abs(flight["state"][:, S.VELOCITY : S.BODY_SIZE]).max() < 0.1
    # the classical method: exp's series of fourth order
    z = 0.3 - 1.1j
    assert amplification(RK4, z) == pytest.approx(sum(z**k / math.factorial(k) for k in range(5)), rel=1e-14)
    assert all(abs(amplification(method, 1e-3j) - np.exp(1e-3j)) < 1e-12 for method in METHODS.values())


def test_flights_side_by_side_are_those_alone():
    """Other slopes, springs, heights and motions in the lanes: equal bits."""
    cases = [
        (standing(steep(0.1 * i, 40.0 * i), {}, stiffness=4000.0 + 500.0 * i, friction=0.4 + 0.1 * i), 0.02 * i)
        for i in range(3)
    ]
    starts = [above(aircraft, HEIGHT + 0.12 + drop, u=drop) for aircraft, drop in cases]
    sorties = [Sortie(aircraft, start, STILL, 0.4) for (aircraft, _), start in zip(cases, starts, strict=True)]
    fly_together(sorties)
    for (aircraft, _), start, sortie in zip(cases, starts, sorties, strict=True):
        alone, together = simulate(aircraft, start, STILL, 0.4), sortie.result()[0]
        for name in ("state", "contact_force", "contact_depth"):
            np.testing.assert_array_equal(together[name], alone[name])
        assert (alone["contact_depth"][-1] > 0.0).any()


@pytest.mark.parametrize("slope_deg", [0.0, 15.0])
def test_it_stands_where_it_is_put(slope_deg):
    """Weight, friction and springs balance at the start, at any heading and on any slope."""
    aircraft = standing({"slope_deg": slope_deg, "slope_heading_deg": 25.0}, {})
    state = state_on_ground(aircraft, 2.0, (3.0, -4.0), 1.0)
    simulation = Simulation(aircraft, state, aircraft.mix(STILL), ground_altitude=2.0)
    shot = simulation.snapshot()
    to_earth = rotation_matrix(state[S.ATTITUDE : S.VELOCITY])
    force = to_earth @ shot.contact[:, :3].sum(axis=0)
    np.testing.assert_allclose(force, [0.0, 0.0, -MASS * G], atol=0.01)
    moment = np.cross([point.position for point in aircraft.contact_points], shot.contact[:, :3]).sum(axis=0)
    np.testing.assert_allclose(moment, 0.0, atol=0.01)
    np.testing.assert_allclose(state[:2], [3.0, -4.0])


def test_without_contact_sloping_ground_ends_the_flight_where_it_is_touched():
    """The lowest rim of a disc that is parallel to the ground is as far above it as its hub."""
    data = aircraft_data(options={"elements": 6}, environment=VACUUM)
    data["ground"] = steep(0.2, 90.0)
    aircraft = Aircraft.from_dict(data)
    assert aircraft.layout.size == Aircraft.load("sbs").layout.size
    slope = math.atan(0.2)
    for gap in (-0.001, 0.001):
        state = above(aircraft, 0.0)
        state[S.ATTITUDE : S.VELOCITY] = math.cos(slope / 2), -math.sin(slope / 2), 0.0, 0.0
        state[S.DOWN] = -(0.066 + gap) / math.cos(slope)
        if gap < 0.0:
            with pytest.raises(SimulationError, match="the aircraft reaches down"):
                Simulation(aircraft, state, aircraft.mix(STILL), ground_altitude=0.0)
        else:
            Simulation(aircraft, state, aircraft.mix(STILL), ground_altitude=0.0)


@pytest.mark.parametrize(
    ("path", "value"),
    [
        *((f"ground.{key}", value) for key, value in {"altitude": 1.0, "slope_deg": 5.0}.items()),
        *((f"contact_points.left_front.{key}", 0.2) for key in ("stiffness", "damping", "onset", "friction")),
        *((f"contact_points.left_front.{key}", 0.2) for key in ("side_stiffness", "side_damping")),
        ("contact_points.left_front.position[0]", 0.2),
        ("contact_points.left_front.rolling", [1.0, 0.0, 0.0]),
    ],
)
def test_every_key_is_read_and_used(path, value):
    """In the model and in the hash; without contact those of points are in neither."""
    aircraft, other = standing(), standing().with_value(path, value)
    assert other.parameter_hash != aircraft.parameter_hash
    parts = [(model.ground.tobytes(), model.contacts.tobytes()) for model in (aircraft.model(), other.model())]
    assert parts[0] != parts[1]
    if path.startswith("contact_points"):
        free = [one.with_value("ground.contact", "end_flight") for one in (aircraft, other)]
        assert free[0].parameter_hash == free[1].parameter_hash
        assert [len(one.model().contacts) for one in free] == [0, 0]


def test_what_cannot_stand_is_refused(sbs):
    """One line each, naming the field."""
    data = aircraft_data()
    for change, problem in (
        (
            {"contact_points": [], "ground": {"contact": "contact"}},
            "ground.contact = 'contact': allowed with contact_points",
        ),
        ({"ground": {"contact": "contact"}, "stand": {}}, "ground.contact = 'contact': not allowed on a stand"),
        ({"contact_points": [data["contact_points"][0]] * 2}, "contact_points: name = left_front: used twice"),
        (
            {"contact_points": [data["contact_points"][0] | {"rolling": [0.0, 0.0, 0.0]}]},
            r"contact_points\[0\].rolling = \[0.0, 0.0, 0.0\]: allowed is a vector that is not zero",
        ),
    ):
        other = aircraft_data() | change
        if other.pop("stand", None) is not None:
            other["body"] = other["body"] | {"stand": {"free": []}}
        with pytest.raises(AircraftError, match=problem):
            Aircraft.from_dict(other)
    with pytest.raises(SimulationError, match=r"ground\.contact = 'end_flight': allowed on the ground is 'contact'"):
        state_on_ground(sbs, 0.0)


def test_undamped_lag_grows_on_the_skids():
    """Ground resonance: the regressing lag mode takes energy from the rotation as the hub yields; dampers stop it."""
    growth = {}
    for damping in (0.0, 0.022):
        data = aircraft_data(options={"elements": 6}, every_rotor={"lag_damping": damping})
        data["ground"] = {"contact": "contact", "altitude": 0.0}
        aircraft = Aircraft.from_dict(data)
        start = state_on_ground(aircraft, 0.0)
        start[S.RATES] = 0.3
        flight = simulate(aircraft, start, STILL, 6.0, tick=0.005)
        lag = np.hypot(flight["xic(1)"], flight["xis(1)"])
        growth[damping] = math.log(lag[-200:].max() / lag[400:600].max()) / 4.0
        if damping == 0.0:
            rates = flight["p"][600:] * np.hanning(len(flight["p"]) - 600)
            spectrum = np.abs(np.fft.rfft(rates))
            found = 2 * math.pi * np.fft.rfftfreq(len(rates), 0.005)[spectrum.argmax()]
            rotor = aircraft.rotors[0]
            static = rotor.first_moment * (rotor.hinge_offset - rotor.flap_hinge_offset) / rotor.second_moment
            assert found == pytest.approx(rotor.speed * (1.0 - math.sqrt(static)), rel=0.06), "Omega less that of lag"
    assert growth[0.0] > 0.2
    assert growth[0.022] < -0.2


def test_rotors_run_up_from_rest_on_the_skids():
    """A drive brings two rotors to speed; their torques cancel, so that the aircraft stays where it stands."""
    data = aircraft_data(options={"elements": 6}, every_rotor={"lag_spring": 60.0, "lag_damping": 0.3})
    data["ground"] = {"contact": "contact", "altitude": 0.0}
    engine, governor = {"kind": "engine", "max_torque": 16.0, "lag": 0.05}, {"integral_gain": 2.0}
    data["drives"] = [{"rotors": ["R1", "R2"], "engine": engine, "governor": {"proportional_gain": 5.0} | governor}]
    aircraft = Aircraft.from_dict(data)
    start = state_on_ground(aircraft, 0.0, (1.0, 2.0), 0.5, rotor_speed=0.0)
    flight = simulate(aircraft, start, STILL, 3.0)
    assert flight["Omega(1)"][0] == 0.0
    assert flight["Omega(1)"][-1] > 0.98 * aircraft.drive_speed(0)
    np.testing.assert_allclose(flight["state"][:, :7] - start[:7], 0.0, atol=1e-4)
    assert flight["contact_force"][-1, :, 2].sum() == pytest.approx(-MASS * G, rel=1e-2)
