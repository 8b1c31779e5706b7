"""Trim: equilibrium, momentum theory, signs, what the paper prints, and honest failure (theory.md 8 and 9)."""

import math

import numpy as np
import pytest
from helpers import Model, aircraft_data, build, linear_airfoil, mirrored_data

from sbs_sim import simulate, trim
from sbs_sim.aircraft import Aircraft
from sbs_sim.analysis.trim_guess import MomentumTheory
from sbs_sim.analysis.trim_problem import TrimProblem
from sbs_sim.errors import TrimError
from sbs_sim.flight.trim_point import Fidelity, TrimCondition
from sbs_sim.flight.trimmed_state import trimmed_state
from sbs_sim.model import records as R
from sbs_sim.model import state as S

G, RHO = 9.80665, 1.225
CONDITIONS = {
    "hover": {},
    "10 m/s": {"airspeed": 10.0},
    "20 m/s": {"airspeed": 20.0},
    "backward": {"airspeed": -8.0},
    "right": {"airspeed": 8.0, "sideslip": math.pi / 2},
    "oblique": {"airspeed": 10.0, "sideslip": -0.4},
    "climb": {"climb_rate": 3.0},
    "descent": {"climb_rate": -2.0},
    "climb at 12 m/s": {"airspeed": 12.0, "climb_rate": 2.0},
    "descent at 12 m/s": {"airspeed": 12.0, "climb_rate": -2.0},
    "turn": {"airspeed": 10.0, "turn_rate": 0.3},
    "left turn in a climb": {"airspeed": 10.0, "climb_rate": 1.0, "turn_rate": -0.3},
}
# Where Newton's method does not get from hover, nor by quarters of the path that are not halved where they fail, nor by
# guesses that do not follow the line through the two trims before.
FAR = {"airspeed": -20.0, "sideslip": 0.5, "turn_rate": 1.0}


def tip_speed(rotor):
    """Return Omega R [m/s]."""
    return rotor.speed * rotor.radius


def disc_area(rotor):
    """Return the area of a disc [m^2]."""
    return math.pi * rotor.radius**2


def test_the_differential_coordinates_of_four_blades_have_no_mean():
    """They change sign with every blade: loads of twice per revolution move them, and leave no mean."""
    four = build(every_rotor={"blades": 4, "blade_mass": 0.12, "chord": {"root": 0.038, "tip": 0.038}})
    point = trim(four, 20.0)
    differential = [value for name, value in zip(point.state_names, point.state, strict=True) if "d(" in name]
    assert len(differential) == 2 * 2 * 2
    np.testing.assert_allclose(differential, 0.0, atol=1e-9)


# -- equilibrium ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("fidelity", [(False, False), (True, True)])
@pytest.mark.parametrize("name", ["hover", "oblique", "left turn in a climb"])
def test_jacobian_of_the_equations_is_their_difference(sbs, name, fidelity):
    """All unknowns, away from the solution; as many azimuths as the Jacobian takes at most."""
    problem, condition = TrimProblem(sbs, Fidelity(*fidelity, 4)), TrimCondition(**CONDITIONS[name])
    guess = MomentumTheory(problem).guess(condition)
    unknowns = guess + 0.02 * np.random.default_rng(1).standard_normal(len(guess))
    found, step = problem.jacobian(condition, unknowns), 1e-6
    for i in range(len(unknowns)):
        moved = step * np.eye(len(unknowns))[i]
        sides = [problem.residual(condition, unknowns + sign * moved) for sign in (1, -1)]
        expected = (sides[0] - sides[1]) / (2 * step)
        np.testing.assert_allclose(found[:, i], expected, rtol=1e-4, atol=1e-5 * np.abs(expected).max(), err_msg=str(i))


@pytest.mark.parametrize("condition", [*CONDITIONS.values(), FAR], ids=[*CONDITIONS, "far"])
def test_averaged_derivative_vanishes(sbs, condition):
    """Averaged here over the 12 azimuths of the trim; what moves steadily is position and heading alone."""
    point = trim(sbs, **condition)
    model, x = Model(sbs), trimmed_state(sbs, point)
    mean = np.mean([model.derivative(x, point.swashplate, np.full(2, 2 * math.pi * k / 36)) for k in range(12)], axis=0)
    speed, climb = condition.get("airspeed", 0.0), condition.get("climb_rate", 0.0)
    slip, turn = condition.get("sideslip", 0.0), condition.get("turn_rate", 0.0)
    track = [speed * math.cos(slip), speed * math.sin(slip), -climb]
    np.testing.assert_allclose(mean[: S.ATTITUDE], track, atol=1e-10)
    # the quaternion (w, x, y, z) of an attitude that turns about down: half the rate times (-z, -y, x, w)
    w, i, j, k = x[S.ATTITUDE : S.VELOCITY]
    np.testing.assert_allclose(mean[S.ATTITUDE : S.VELOCITY], turn / 2 * np.array([-k, -j, i, w]), atol=1e-10)
    np.testing.assert_allclose(mean[S.VELOCITY : S.BODY_SIZE], 0, atol=1e-8)
    np.testing.assert_allclose(mean[S.BODY_SIZE :] / model.speeds[0] ** 2, 0, atol=1e-9)
    assert point.residual < 1e-9
    assert point.beyond_limits == ()


def test_hover_is_held(sbs, hover):
    """Ten seconds without a hand on the controls, the unstable modes included: below 1e-6 m/s and rad/s."""
    flight = simulate(sbs, hover, hover.controls, 10.0)
    assert max(np.abs(flight[name]).max() for name in "uvwpqr") < 1e-6
    assert max(np.abs(flight[name]).max() for name in ("north", "east", "down")) < 1e-5


def test_hover_of_the_papers_reading_is_held(sbs_paper, paper_hover):
    flight = simulate(sbs_paper, paper_hover, paper_hover.controls, 5.0)
    assert max(np.abs(flight[name]).max() for name in "uvwpqr") < 1e-6


@pytest.mark.parametrize("name", sorted(set(CONDITIONS) - {"hover"}))
def test_trimmed_flight_stays_for_a_second(sbs, name):
    """The averages are zero; what is left is the vibration, and the little it moves the mean."""
    point = trim(sbs, **CONDITIONS[name])
    flight = simulate(sbs, point, point.controls, 1.0)
    for axis, allowed in zip("uvwpqr", (0.1, 0.05, 0.1, 0.05, 0.02, 0.02), strict=True):
        assert np.abs(flight[axis] - flight[axis][0]).max() < allowed
    turned = CONDITIONS[name].get("turn_rate", 0.0)
    heading = math.atan2(
        2 * (flight["qw"][-1] * flight["qz"][-1] + flight["qx"][-1] * flight["qy"][-1]),
        1 - 2 * (flight["qy"][-1] ** 2 + flight["qz"][-1] ** 2),
    )
    assert heading == pytest.approx(turned, abs=0.01)


def test_trim_in_wind_drifts_with_it(sbs):
    """Trimmed relative to the air: over ground the hover moves with the steady wind."""
    from sbs_sim.model.wind import Wind

    point = trim(sbs)
    flight = simulate(sbs, point, point.controls, 1.0, wind=Wind(velocity=(3.0, -4.0, 0.5)))
    end = [flight[name][-1] for name in ("north", "east", "down")]
    np.testing.assert_allclose(end, [3.0, -4.0, 0.5], atol=1e-6)


def test_more_azimuths_change_little(sbs):
    """N_c = 12 and 24 at 15 m/s: controls and attitude to 1e-4 deg, power to 1e-6."""
    few, many = (trim(sbs, 15.0, azimuth_count=count) for count in (12, 24))
    np.testing.assert_allclose(np.degrees(few.controls), np.degrees(many.controls), atol=1e-4)
    assert math.degrees(few.pitch) == pytest.approx(math.degrees(many.pitch), abs=1e-4)
    np.testing.assert_allclose(few.power, many.power, rtol=1e-6)


def test_one_azimuth_is_enough_in_hover(sbs, hover):
    """Three blades in hover see no azimuth."""
    np.testing.assert_allclose(trim(sbs, azimuth_count=1).controls, hover.controls, atol=1e-9)


# -- balance of forces, momentum theory, power ---------------------------------------------------------------


@pytest.mark.parametrize("climb", [-2.0, 0.0, 1.0, 4.0, 8.0])
def test_momentum_theory_in_axial_flight(sbs, climb):
    """Two thrusts carry weight and plate drag, and C_T = 2 lambda0 (lambda0 + mu_climb) (Leishman 2.13)."""
    point = trim(sbs, climb_rate=climb)
    area = sbs.body.flat_plate_areas[2]
    total = sbs.body.mass * G + 0.5 * RHO * area * climb * abs(climb)
    np.testing.assert_allclose(point.thrust, total / 2, rtol=1e-6)
    for j, rotor in enumerate(sbs.rotors):
        coefficient = total / 2 / (RHO * disc_area(rotor) * tip_speed(rotor) ** 2)
        lambda0 = point.state[point.state_names.index(f"lambda0({j + 1})")]
        assert coefficient == pytest.approx(2 * lambda0 * (lambda0 + climb / tip_speed(rotor)), rel=1e-6)
    np.testing.assert_allclose(point.power, point.torque * [rotor.speed for rotor in sbs.rotors], rtol=1e-12)


@pytest.mark.parametrize("climb", [-2.0, 0.0, 5.0])
@pytest.mark.parametrize("exit_area", [0.7, 1.0])
def test_a_duct_with_a_fixed_exit_keeps_mass_momentum_and_energy(exit_area, climb):
    """T = m w for rotor and duct together, and the rotor's power T_r (V + v) is m ((V + w)^2 - V^2) / 2."""
    aircraft = build(every_rotor={"duct": {"exit_area": exit_area}}, body={"flat_plate_areas": [0.0, 0.0, 0.0]})
    point, rotor = trim(aircraft, climb_rate=climb), aircraft.rotors[0]
    through = point.state[point.state_names.index("lambda0(1)")] * tip_speed(rotor) + climb
    mass_flow = RHO * disc_area(rotor) * through
    gained = through / exit_area - climb
    assert mass_flow * gained == pytest.approx(aircraft.body.mass * G / 2, rel=1e-6)
    power = mass_flow * ((climb + gained) ** 2 - climb**2) / 2
    assert point.thrust[0] * through == pytest.approx(power, rel=1e-6)
    if exit_area == 1.0 and climb == 5.0:  # T (V + w/2), w = v = 7.95 m/s by T = rho A (V + v) v
        assert 2 * power == pytest.approx(1815.0, rel=1e-3)


def test_a_duct_in_forward_flight_has_ram_drag_and_lifts_the_nose():
    """All of the flow along the disc is turned: its drag is m V, which acts at the lip."""
    velocity, arm = 10.0, 0.2
    rates = []
    for duct in ({"turning": 0.0}, {"turning": 0.0, "lip_arm": arm}, {}, {"lip_arm": arm}):
        model = Model(build(every_rotor={"duct": {"exit_area": 1.0, **duct}}))
        x = model.state(lambda0=0.05)
        x[S.VELOCITY] = velocity
        rates.append(model.derivative(x, [[0.0, 0.0, 0.0]] * 2))
    rotor = model.aircraft.rotors[0]
    drag = 2 * RHO * disc_area(rotor) * 0.05 * tip_speed(rotor) * velocity
    np.testing.assert_array_equal(rates[1], rates[0])
    moment = rates[3][S.RATES + 1] - rates[2][S.RATES + 1]
    assert moment == pytest.approx(arm * drag / model.aircraft.body.inertia[1, 1], rel=0.3)  # blades turn along
    assert moment > 0.0


@pytest.mark.parametrize(("climb", "factor"), [(0.0, 1.0), (5.0, 1.0), (0.0, 1.15), (5.0, 1.15)])
def test_power_in_axial_flight_is_induced_climb_and_profile(tmp_path, climb, factor):
    """P = T (kappa_i v + V_c) + 3 Int 1/2 rho c cd |V|^3 dr, constant cd; flap and lag of 1 deg change it by 0.1 %.

    Every section's drag dissipates D |V|, and uniform inflow takes T kappa_i v, v by momentum theory (energy balance of
    the blade elements).
    """
    drag = 0.012
    airfoil = linear_airfoil(tmp_path / "plain.csv", drag=drag)
    aircraft = build(every_rotor={"airfoil": airfoil, "induced_power_factor": factor}, options={"elements": 80})
    point, rotor = trim(aircraft, climb_rate=climb), aircraft.rotors[0]
    thrust = point.thrust[0]
    ideal = math.sqrt(thrust / (2 * RHO * disc_area(rotor)) + climb**2 / 4) - climb / 2
    through = factor * ideal + climb
    nodes, weights = np.polynomial.legendre.leggauss(30)
    r = rotor.hinge_offset + (nodes + 1) / 2 * rotor.blade_length
    speed = np.hypot(rotor.speed * r, through)
    profile = 3 * np.sum(weights * rotor.blade_length / 2 * 0.5 * RHO * rotor.chord_root * drag * speed**3)
    assert point.power[0] == pytest.approx(thrust * through + profile, rel=2e-3)
    assert profile < 0.5 * thrust * through


def test_figure_of_merit_is_that_of_a_small_rotor(hover, sbs):
    """Ideal power of momentum theory over the power: 0.5 to 0.75 at these Reynolds numbers (Leishman 2.8)."""
    ideal = hover.thrust**1.5 / np.sqrt(2 * RHO * disc_area(sbs.rotors[0]))
    assert np.all((ideal / hover.power > 0.5) & (ideal / hover.power < 0.75))


def test_drag_is_balanced_by_tilt(sbs):
    """At 20 m/s the mean forces along the earth's axes vanish: m g tan(pitch) is plate drag and rotor drag."""
    point = trim(sbs, 20.0)
    plates = 0.5 * RHO * sbs.body.flat_plate_areas[0] * 20.0**2
    tilt_force = sbs.body.mass * G * math.tan(-point.pitch)
    assert tilt_force > plates
    assert tilt_force < 1.3 * plates


def test_bank_of_a_turn(sbs):
    """Coordinated turn: tan(bank) = V Omega_turn / g to 2 %, thrust by 1/cos(bank)."""
    point, level = trim(sbs, 10.0, turn_rate=0.3), trim(sbs, 10.0)
    assert math.tan(point.roll) == pytest.approx(10.0 * 0.3 / G, rel=0.02)
    ratio = point.thrust.sum() / level.thrust.sum()
    assert ratio == pytest.approx(1 / math.cos(point.roll), rel=0.01)
    left = trim(sbs, 10.0, turn_rate=-0.3)
    assert left.roll == pytest.approx(-point.roll, rel=1e-4)  # Ixy = -0.001 is the only asymmetry


# -- signs ---------------------------------------------------------------------------------------------------


def test_forward_flight_takes_nose_down_and_push(sbs, hover):
    """More speed, more nose down; the stick goes forward from hover; nothing to the side; power has a bucket."""
    slow, fast = trim(sbs, 8.0), trim(sbs, 16.0)
    assert hover.pitch > slow.pitch > fast.pitch
    assert slow.controls[2] > hover.controls[2] + math.radians(0.5)
    for point in (slow, fast):
        assert abs(point.roll) < 1e-6
        assert np.abs(point.controls[[1, 3]]).max() < 1e-6
        assert point.controls[0] < hover.controls[0]
    assert fast.power.sum() < hover.power.sum()


def test_backward_flight_is_the_reverse(sbs):
    """Hubs beside the c.g. and flat plates: the aircraft does not know front from back but for its inertia."""
    forward, backward = trim(sbs, 8.0), trim(sbs, -8.0)
    assert backward.pitch == pytest.approx(-forward.pitch, rel=1e-5)
    assert backward.controls[2] == pytest.approx(-forward.controls[2], rel=1e-5)
    assert backward.controls[0] == pytest.approx(forward.controls[0], rel=1e-6)


def test_sideways_flight_takes_the_stick_and_at_speed_the_bank_into_it(sbs):
    """To the right: stick to the right; fast, where the plates' drag rules, right side down. Left: the image.

    Slowly it hangs the other way by up to 0.8 deg: the tilt of lift that the cyclics bring is more than the drag.
    """
    slow, fast = (trim(sbs, speed, sideslip=math.pi / 2) for speed in (4.0, 16.0))
    assert slow.controls[1] > math.radians(1.0)
    assert fast.controls[1] > math.radians(1.0)
    assert abs(slow.roll) < math.radians(1.0)
    assert fast.roll > math.radians(4.0)
    left = trim(sbs, 16.0, sideslip=-math.pi / 2)
    mirror = [1, -1, 1, -1]  # collective and longitudinal keep their side
    np.testing.assert_allclose(left.controls, fast.controls * mirror, atol=1e-5)
    assert left.roll == pytest.approx(-fast.roll, rel=1e-4)
    np.testing.assert_allclose(left.thrust, fast.thrust[::-1], rtol=1e-4)


@pytest.mark.parametrize("name", ["10 m/s", "right", "turn"])
def test_mirrored_aircraft_trims_mirrored(name):
    """Exactly, Ixy included: the image of the file flies the image of the condition."""
    condition = CONDITIONS[name]
    data = aircraft_data()
    image = mirrored_data(data)
    for rotor in image["rotors"]:  # the rotor that was MR1 keeps its share of the differential, the other way round
        longitudinal = rotor["mixing"]["longitudinal_cyclic"]
        longitudinal["differential_longitudinal_cyclic"] *= -1.0
    here = trim(Aircraft.from_dict(data), **condition)
    flipped = {key: -value if key in ("sideslip", "turn_rate") else value for key, value in condition.items()}
    there = trim(Aircraft.from_dict(image), **flipped)
    np.testing.assert_allclose(there.controls, here.controls * [1, -1, 1, -1], atol=1e-9)
    np.testing.assert_allclose([there.pitch, there.roll], [here.pitch, -here.roll], atol=1e-9)
    np.testing.assert_allclose(there.power, here.power, rtol=1e-8)


def test_climb_and_descent_move_collective_and_power(sbs, hover):
    up, down = trim(sbs, climb_rate=3.0), trim(sbs, climb_rate=-2.0)
    assert down.controls[0] < hover.controls[0] < up.controls[0]
    assert np.all(down.power < hover.power)
    assert np.all(hover.power < up.power)


# -- fidelity and other aircraft -----------------------------------------------------------------------------


def test_fidelity_hardly_matters_in_hover(sbs, hover):
    """No cyclic load, no cyclic inflow; the lag angle changes the pitch by nothing and the flow by little."""
    for lead_lag in (True, False):
        for cyclic in (True, False):
            point = trim(sbs, lead_lag=lead_lag, cyclic_inflow=cyclic)
            assert point.controls[0] == pytest.approx(hover.controls[0], rel=1e-3)
            names = dict(zip(point.state_names, point.state, strict=True))
            assert (names["xi0(1)"] != 0) == lead_lag
            assert abs(names["lambdac(1)"]) < 1e-10


def test_cyclic_inflow_matters_in_forward_flight(sbs):
    with_it, without = trim(sbs, 10.0), trim(sbs, 10.0, cyclic_inflow=False)
    names = with_it.state_names
    assert with_it.state[names.index("lambdac(1)")] > 0.3 * with_it.state[names.index("lambda0(1)")]
    assert without.state[names.index("lambdac(1)")] == 0.0
    assert np.abs(np.degrees(with_it.controls - without.controls)).max() > 0.3


def test_three_four_and_five_blades_of_one_solidity_hover_alike(tmp_path):
    """Chord, mass and springs times 3/N_b without influence of Reynolds number: the same blade motion in hover."""
    airfoil = linear_airfoil(tmp_path / "plain.csv")
    points = []
    for blades in (3, 4, 5):
        share = 3 / blades
        rotor = {"airfoil": airfoil, "blades": blades, "blade_mass": 0.1613 * share, "flap_spring": 162.0 * share}
        chord = {"root": 0.051 * share, "tip": 0.051 * share}
        points.append(trim(build(every_rotor={**rotor, "chord": chord})))
    for point in points[1:]:
        np.testing.assert_allclose(point.controls, points[0].controls, atol=1e-9)
        np.testing.assert_allclose(point.thrust, points[0].thrust, rtol=1e-8)
        np.testing.assert_allclose(point.power, points[0].power, rtol=1e-8)
        for name in ("a0(1)", "xi0(2)", "lambda0(1)"):
            found, expected = (p.state[p.state_names.index(name)] for p in (point, points[0]))
            assert found == pytest.approx(expected, rel=1e-8)


def test_tandem_trims_with_its_own_mixing():
    """Rotors fore and aft, differential collective as the pitch control: nothing in the trim knows side by side."""
    mixing = {
        "collective": {"collective": 1.0},
        "lateral_cyclic": {"lateral_cyclic": 1.0},
        "longitudinal_cyclic": {},
    }
    front, rear = ({**mixing, "collective": {"collective": 1.0, "longitudinal_cyclic": f}} for f in (-1.0, 1.0))
    for entry, side in ((front, 1.0), (rear, -1.0)):
        entry["lateral_cyclic"] = {"lateral_cyclic": 1.0, "differential_longitudinal_cyclic": side}
    hub = {"rotation": 1}
    aircraft = build(
        rotors=[
            {**hub, "hub": [0.7, 0.0, -0.1], "mixing": front},
            {**hub, "hub": [-0.6, 0.0, -0.1], "rotation": -1, "mixing": rear},
        ]
    )
    point = trim(aircraft)
    # level flight: the thrusts stand in the inverse ratio of their arms
    assert point.thrust[0] / point.thrust[1] == pytest.approx(6.0 / 7.0, rel=0.02)
    assert point.thrust.sum() == pytest.approx(aircraft.body.mass * G, rel=1e-3)
    flight = simulate(aircraft, point, point.controls, 1.0)
    assert max(np.abs(flight[name] - flight[name][0]).max() for name in "uvwpqr") < 1e-3


# -- numbers of the paper (section 9) ------------------------------------------------------------------------


def test_coning_and_collective_of_the_paper(hover, paper_hover):
    """Coning 0.69 deg to 5 % by the complete model; collective 8.4 to 10 deg, by airfoil."""
    coning = math.degrees(hover.state[hover.state_names.index("a0(1)")])
    assert coning == pytest.approx(0.69, rel=0.05)
    for point in (hover, paper_hover):
        assert 8.4 < math.degrees(point.controls[0]) < 10.0
    # the reading's own coning, section 9
    assert math.degrees(paper_hover.state[8]) == pytest.approx(0.54, abs=0.01)


def test_coning_by_the_flap_equation(sbs, hover):
    """A1 nu^2 Omega^2 a0 = (lift of a blade) x (its arm about the hinge) - S1 g (section 3), to 3 %.

    The arm is that of the load r^2 theta0 - r R lambda0 of an untwisted blade, whose lift slope cancels.
    """
    rotor = sbs.rotors[0]
    nu_squared = 1 + rotor.hinge_offset * rotor.first_moment / rotor.second_moment
    nu_squared += rotor.flap_spring / (rotor.second_moment * rotor.speed**2)
    lambda0 = hover.state[hover.state_names.index("lambda0(1)")]
    r = np.linspace(rotor.hinge_offset, rotor.radius, 2001)
    load = r**2 * hover.controls[0] - r * rotor.radius * lambda0
    arm = np.sum(load * (r - rotor.hinge_offset)) / np.sum(load)
    moment = hover.thrust[0] / rotor.blades * arm - rotor.first_moment * G
    coning = moment / (rotor.second_moment * nu_squared * rotor.speed**2)
    assert hover.state[hover.state_names.index("a0(1)")] == pytest.approx(coning, rel=0.03)


def test_inflow_poles_of_the_trimmed_hover(sbs, hover):
    """The closed forms at the trim's lambda0: 33.5 and 126 1/s to 0.5 % (section 9)."""
    lambda0, omega = hover.state[hover.state_names.index("lambda0(1)")], sbs.rotors[0].speed
    assert 3 * math.pi / 8 * 2 * lambda0 * omega == pytest.approx(33.5, rel=5e-3)
    assert 45 * math.pi / 16 * lambda0 * omega == pytest.approx(126.0, rel=5e-3)


def reduced_heave(aircraft, point, lead_lag, cyclic_inflow):
    """Return the quasi-static heave derivative w' by w [1/s]: A_ss - A_sf A_ff^-1 A_fs, steps of section 9."""
    model = Model(aircraft, lead_lag, cyclic_inflow)
    layout, x = aircraft.layout, trimmed_state(aircraft, point)
    angles, rates, inflows = [], [], []
    for j in range(len(aircraft.rotors)):
        for angle, rate in ((layout.flap(j), layout.flap_rate(j)), (layout.lag(j), layout.lag_rate(j)))[: 1 + lead_lag]:
            angles += range(angle.start, angle.stop)
            rates += range(rate.start, rate.stop)
        start = layout.inflow(j).start
        inflows += range(start, start + (3 if cyclic_inflow else 1))
    heave = S.VELOCITY + 2
    places = [heave, *angles, *rates, *inflows]
    steps = [0.05, *[1e-4] * len(angles), *[1e-2] * len(rates), *[1e-4] * len(inflows)]
    a = model.jacobian(x, point.swashplate, 12, places, places, steps)
    return a[0, 0] - a[0, 1:] @ np.linalg.solve(a[1:, 1:], a[1:, 0])


def test_heave_damping_of_the_paper(sbs):
    """-0.52 1/s in Tables 1 and 2: to 5 % by the complete model, without and with lag; cyclic inflow: 1 %."""
    damping = {}
    for lead_lag, cyclic in ((False, False), (True, False), (True, True)):
        point = trim(sbs, lead_lag=lead_lag, cyclic_inflow=cyclic)
        damping[lead_lag, cyclic] = reduced_heave(sbs, point, lead_lag, cyclic)
    assert damping[False, False] == pytest.approx(-0.52, rel=0.05)
    assert damping[True, False] == pytest.approx(-0.52, rel=0.05)
    assert damping[True, True] == pytest.approx(damping[True, False], rel=0.01)


# -- what cannot be trimmed ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("condition", "message"),
    [
        ({"airspeed": 250.0}, "airspeed = 250.0: allowed are -100 to 100 m/s"),
        ({"airspeed": math.nan}, "airspeed = nan: allowed are -100 to 100 m/s"),
        ({"climb_rate": -math.inf}, "climb_rate = -inf: allowed are -50 to 50 m/s"),
        ({"sideslip": 4.0}, "sideslip = 4.0: allowed are -3.14159 to 3.14159 rad"),
        ({"turn_rate": 9.0}, "turn_rate = 9.0: allowed are -3 to 3 rad/s"),
        ({"azimuth_count": 0}, "azimuth_count = 0: allowed are integers from 1 to 1000"),
    ],
)
def test_absurd_condition_is_named_with_its_range(sbs, condition, message):
    with pytest.raises(TrimError) as error:
        trim(sbs, **condition)
    assert str(error.value) == message


@pytest.mark.parametrize("condition", [{"airspeed": 70.0}, {"climb_rate": 45.0}])
def test_unreachable_condition_fails_with_its_worst_equation(sbs, condition):
    """One line: residual, the equation it is in, and how far the path from hover came."""
    with pytest.raises(TrimError) as error:
        trim(sbs, **condition)
    text = str(error.value)
    assert "\n" not in text
    assert "residual" in text
    assert any(f"d({name})/dt" in text for name in sbs.layout.names)
    assert "the path from hover ends at airspeed" in text


def test_too_heavy_to_hover_fails():
    with pytest.raises(TrimError, match=r"residual .* in d\(.*\)/dt"):
        trim(build(body={"mass": 400.0}))


def test_trim_beyond_the_limits_says_what_and_where():
    """Narrow ranges: the trim is still found, and named with value and range in degrees."""
    data = aircraft_data()
    data["controls"]["collective"]["range_deg"] = [0.0, 5.0]
    data["rotors"][1]["collective_range_deg"] = [0.0, 6.0]
    point = trim(Aircraft.from_dict(data))
    degrees = math.degrees(point.controls[0])
    assert point.beyond_limits == (
        f"collective = {degrees:.3f} deg: allowed are 0 to 5 deg",
        f"R2 collective = {degrees:.3f} deg: allowed are 0 to 6 deg",
    )


def test_steep_descent_keeps_to_the_branch_of_hover(sbs):
    """At 20 m/s down Newton from hover lands on a stalled branch at 80 deg; the path from hover leads to 3.42 deg."""
    point = trim(sbs, climb_rate=-20.0)
    assert point.beyond_limits == ()
    assert math.degrees(point.controls[0]) == pytest.approx(3.42, abs=0.01)


def test_loads_of_a_trim_are_those_of_its_state(sbs):
    """Thrust, torque and power are averages over the azimuth at the trimmed state."""
    point = trim(sbs, 12.0)
    loads = Model(sbs).averaged(trimmed_state(sbs, point), point.swashplate)[1]
    np.testing.assert_allclose(point.thrust, loads[:, R.THRUST], rtol=1e-9)
    np.testing.assert_allclose(point.torque, loads[:, R.TORQUE], rtol=1e-9)


def test_a_small_rotor_that_points_sideways_does_not_mislead_the_trim(sbs, hover):
    """Without controls of its own it only drags: the hover is that of the others, on the attached branch."""
    data = aircraft_data()
    side = {"shaft_direction": [0.0, 1.0, 0.0], "hub": [-1.2, 0.0, 0.0], "radius": 0.12, "hinge_offset": 0.02}
    side |= {"blade_mass": 0.01, "blade_cg": 0.05, "flap_hinge_offset": 0.0, "flap_spring": 20.0, "name": "tail"}
    data["rotors"].append({**data["rotors"][0], **side, "mixing": {angle: {} for angle in data["rotors"][0]["mixing"]}})
    point = trim(Aircraft.from_dict(data))
    assert point.beyond_limits == ()
    assert point.controls[0] == pytest.approx(hover.controls[0], abs=math.radians(0.5))
