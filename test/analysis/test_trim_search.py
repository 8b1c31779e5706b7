"""Where trims are looked for: momentum theory, guesses of the user, paths; and what is reported where all fail."""

import math
from dataclasses import astuple
from pathlib import Path

import numpy as np
import pytest
from helpers import VACUUM, WEIGHTLESS_VACUUM, aircraft_data, build
from random_aircraft import random_flights

from sbs_sim import linearize, sweep, trim
from sbs_sim.aircraft import Aircraft
from sbs_sim.analysis.trim_guess import MomentumTheory
from sbs_sim.analysis.trim_problem import TrimProblem
from sbs_sim.analysis.trim_search import STALLED, _Search
from sbs_sim.errors import TrimError
from sbs_sim.flight.trim_point import Fidelity, TrimCondition
from sbs_sim.model import state as S

DATA = Path(__file__).resolve().parents[1] / "data"
G, RHO = 9.80665, 1.225
HOVER = TrimCondition()


def quadrotor():
    """Return four rotors at the corners of a c.g. that is not in the middle, flown by their collectives alone."""
    rotors = []
    for end, side in ((1, 1), (1, -1), (-1, -1), (-1, 1)):
        collective = {"collective": 1.0, "lateral_cyclic": -side, "longitudinal_cyclic": -end}
        collective["differential_longitudinal_cyclic"] = end * side
        mixing = {"collective": collective, "lateral_cyclic": {}, "longitudinal_cyclic": {}}
        rotors.append({"hub": [0.7 * end + 0.03, 0.6 * side + 0.02, -0.1], "rotation": end * side, "mixing": mixing})
    return build(rotors=rotors, body={"mass": 40.0})


def coaxial():
    """Return two rotors on one shaft, yawed by their torques."""
    own = {"lateral_cyclic": {"lateral_cyclic": 1.0}, "longitudinal_cyclic": {"longitudinal_cyclic": 1.0}}
    rotors = []
    for height, turn in ((0.3, 1), (0.15, -1)):
        mixing = {"collective": {"collective": 1.0, "differential_longitudinal_cyclic": turn}, **own}
        rotors.append({"hub": [0.02, 0.01, -height], "rotation": turn, "mixing": mixing})
    return build(rotors=rotors)


AIRCRAFT = {
    "side by side": build,
    "paper": lambda: build("sbs_paper"),
    "tail rotor": lambda: Aircraft.load(DATA / "tail_rotor.yaml"),
    "UH-60A": lambda: Aircraft.load(DATA / "uh60a.yaml"),
    "tandem": lambda: Aircraft.load(DATA / "tandem.yaml"),
    "quadrotor": quadrotor,
    "coaxial": coaxial,
}


@pytest.fixture(scope="module")
def uh60a():
    return AIRCRAFT["UH-60A"]()


# -- momentum and blade-element theory -----------------------------------------------------------------------


@pytest.mark.parametrize("name", AIRCRAFT)
def test_the_first_guess_is_a_hover_but_for_details(name):
    """Twist, mixing, shafts, torques and arms are in it: a quarter of a degree, 2 % of thrust and 4 % of torque."""
    aircraft = AIRCRAFT[name]()
    theory, point = MomentumTheory(TrimProblem(aircraft, Fidelity())), trim(aircraft)
    guess, found = theory.guess(HOVER), theory.balance(HOVER)
    expected = np.concatenate([[point.pitch, point.roll], point.controls])
    np.testing.assert_allclose(np.degrees(guess[:6]), np.degrees(expected), atol=0.25)
    np.testing.assert_allclose([rotor.thrust for rotor in found.rotors], point.thrust, rtol=0.02)
    np.testing.assert_allclose([rotor.factors[1] for rotor in found.rotors], point.torque, rtol=0.04)
    names = dict(zip(point.state_names, point.state, strict=True))
    for j, rotor in enumerate(found.rotors):
        assert rotor.inflow == pytest.approx(names[f"lambda0({j + 1})"], rel=0.02)
        assert rotor.flap[0] == pytest.approx(names[f"a0({j + 1})"], abs=math.radians(0.1))
        assert rotor.lag == pytest.approx(names[f"xi0({j + 1})"], rel=0.35)
        assert rotor.flap[1:] == pytest.approx([names[f"{f}1({j + 1})"] for f in "ab"], abs=math.radians(0.5))
    assert point.iterations <= 10


@pytest.mark.parametrize("name", ["side by side", "tail rotor", "UH-60A"])
@pytest.mark.parametrize("flight", [{}, {"turn_rate": 0.2}, {"climb_rate": -3.0, "sideslip": 0.3}])
def test_the_first_guess_of_a_forward_flight_is_near_it(name, flight):
    """At a twelfth of the tip speed: attitude and collectives to 2 deg, thrusts and inflow to a tenth."""
    aircraft = AIRCRAFT[name]()
    flight = {"airspeed": aircraft.rotors[0].speed * aircraft.rotors[0].radius / 12, **flight}
    theory, point = MomentumTheory(TrimProblem(aircraft, Fidelity())), trim(aircraft, **flight)
    found = theory.balance(TrimCondition(**flight))
    assert np.degrees([found.pitch, found.roll]) == pytest.approx(np.degrees([point.pitch, point.roll]), abs=2.0)
    names = dict(zip(point.state_names, point.state, strict=True))
    for j, rotor in enumerate(found.rotors):
        assert math.degrees(rotor.collective) == pytest.approx(math.degrees(point.swashplate[j, 0]), abs=2.0)
        if point.thrust[j] > 0.1 * point.thrust.max():
            assert rotor.thrust == pytest.approx(point.thrust[j], rel=0.1)
            assert rotor.inflow == pytest.approx(names[f"lambda0({j + 1})"], rel=0.1)


def test_thrust_is_the_mean_lift_of_the_sections_over_the_azimuth(uh60a):
    """Of a twisted blade that moves along and through its disc, by quadrature; and so is the mean lift coefficient."""
    theory, rotor = MomentumTheory(TrimProblem(uh60a, Fidelity())).rotors[0], uh60a.rotors[0]
    velocity = 25.0 * np.array([1.0, 0.4, 0.0])
    theory.meet(velocity)
    thrust, inflow = 70000.0, 0.02
    pitch = theory.attached(thrust, inflow)
    _, axial = velocity @ np.array([0.99863, 0.0, 0.052336]), velocity @ np.array([0.052336, 0.0, -0.99863])
    span, _, half_area, lifting, twist = rotor.elements(uh60a.options.elements)
    edgewise = math.sqrt(velocity @ velocity - axial**2)
    table = uh60a.airfoils[rotor.airfoil]
    degree = np.argmin(np.abs(table.alpha - math.radians(6.0)))
    slope = table.cl[-1, degree] / table.alpha[degree]  # a symmetric airfoil, at its largest Reynolds number
    lift, pressure = 0.0, 0.0
    for psi in 2 * math.pi * np.arange(12) / 12:
        along = rotor.speed * (rotor.hinge_offset + span) + edgewise * math.sin(psi)
        through = inflow * rotor.speed * rotor.radius + axial
        area = 1.225 * rotor.blades * half_area * lifting / 12
        lift += np.sum(area * slope * (along**2 * (pitch + twist) - along * through))
        pressure += np.sum(area * along**2)
    assert lift == pytest.approx(thrust, rel=1e-4)
    assert theory.mean_lift(thrust) == pytest.approx(thrust / pressure, rel=1e-6)


@pytest.mark.parametrize("density", [1.225, 0.4])
def test_induced_velocity_has_the_closed_forms(density):
    """Hover, climb, descent against the thrust, and edgewise flight at speed (Leishman 2.8, 2.13, 2.14)."""
    aircraft = build(environment={"air_density": density})
    theory = MomentumTheory(TrimProblem(aircraft, Fidelity()))
    rotor, thrust = theory.rotors[0], 101.0
    hover = math.sqrt(thrust / (2 * density * math.pi * aircraft.rotors[0].radius ** 2))
    for axial in (0.0, 3.0, -1.0, -30.0):
        rotor.meet(np.array([0.0, 0.0, -axial]))
        expected = -axial / 2 + math.sqrt(axial**2 / 4 + hover**2)
        assert rotor.induced(thrust)[0] == pytest.approx(expected, rel=1e-6)
        assert rotor.induced(-thrust)[0] == pytest.approx(-axial / 2 - math.sqrt(axial**2 / 4 + hover**2), rel=1e-6)
    rotor.meet(np.array([40.0, 30.0, 0.0]))
    induced = rotor.induced(thrust)[0]
    assert induced * math.hypot(50.0, induced) == pytest.approx(hover**2, rel=1e-6)
    step = 1e-3
    slope = (rotor.induced(thrust + step)[0] - rotor.induced(thrust - step)[0]) / (2 * step)
    assert rotor.induced(thrust)[1] == pytest.approx(slope, rel=1e-6)


def test_slopes_of_a_rotor_are_its_differences(uh60a):
    """Thrust and torque by collective, tilts by both cyclics, as the rotor moves along its disc."""
    rotor = MomentumTheory(TrimProblem(uh60a, Fidelity())).rotors[1]  # with pitch-flap coupling
    rotor.meet(np.array([20.0, 3.0, -2.0]))
    swash, step = [0.3, 0.02, -0.03], 1e-6

    def at(collective, lateral, longitudinal):
        thrust = 4000.0
        for _ in range(40):
            response = rotor.respond(thrust, [collective, lateral, longitudinal], 1.0)
            thrust += response.by_collective * (collective - response.collective)
        return response

    slopes = at(*swash).slopes
    for k in range(3):
        moved = [[angle + sign * step * (i == k) for i, angle in enumerate(swash)] for sign in (1, -1)]
        found = (at(*moved[0]).factors - at(*moved[1]).factors) / (2 * step)
        rows = [0, 1] if k == 0 else [0, 1, 2, 3, 4, 5]  # the tilt's own change with the collective is left out
        np.testing.assert_allclose(slopes[rows, k], found[rows], rtol=1e-4, atol=1e-3)


def test_stall_is_distinguished_from_attached_flow(sbs):
    """At 20 m/s down the same thrust comes from 3.4 deg of collective, and from 80 deg with all sections stalled."""
    problem = TrimProblem(sbs, Fidelity())
    theory, condition = MomentumTheory(problem), TrimCondition(climb_rate=-20.0)
    for guess, stalled in (([math.radians(3.0), 0, 0, 0], False), ([math.radians(75.0), 0, 0, 0], True)):
        point = trim(sbs, climb_rate=-20.0, guess=guess)
        unknowns = problem.unknowns(point.pitch, point.roll, point.controls, sbs.layout.from_linear(point.state))
        assert np.abs(problem.residual(condition, unknowns)).max() < 1e-9
        assert (np.abs(theory.stall(condition, unknowns)).max() > STALLED) == stalled


# -- published numbers ---------------------------------------------------------------------------------------


def test_hover_of_a_uh60a(uh60a):
    """NASA TM-85890, table 4 at 1 kt: pitch 5.05, roll -2.34, root collective 22.25, tail rotor 22.98 deg.

    That model has uniform inflow and flap alone; the airfoil here is another one.
    """
    point = trim(uh60a, 0.514444)
    assert math.degrees(point.pitch) == pytest.approx(5.05, abs=0.3)
    assert math.degrees(point.roll) == pytest.approx(-2.34, abs=0.3)
    assert math.degrees(point.controls[0]) == pytest.approx(22.25, abs=0.5)
    assert math.degrees(point.controls[3]) == pytest.approx(22.98, abs=0.5)
    # the tail rotor pushes against the torque of the main rotor, and carries weight because it is canted
    arm = 9.43864 + 0.48768
    assert point.thrust[1] * math.cos(math.radians(20.0)) * arm == pytest.approx(point.torque[0], rel=0.03)


@pytest.mark.parametrize("speed", [-10.0, 10.0, 20.0, 40.0, 60.0, 75.0])
def test_a_uh60a_flies_at_its_speeds(uh60a, speed):
    point = trim(uh60a, speed)
    assert point.residual < 1e-9
    assert point.beyond_limits == ()


# -- guesses of the user -------------------------------------------------------------------------------------


def test_a_trim_is_a_guess_for_itself_and_for_its_neighbour(sbs):
    point = trim(sbs, 10.0)
    again = trim(sbs, 10.0, guess=point)
    assert again.iterations == 0
    np.testing.assert_array_equal(again.controls, point.controls)
    near = trim(sbs, 11.0, guess=point)
    assert near.iterations < trim(sbs, 11.0).iterations
    np.testing.assert_allclose(near.controls, trim(sbs, 11.0).controls, atol=1e-9)


def test_a_guess_of_another_fidelity_or_of_a_heavier_aircraft_is_one(sbs):
    simple = trim(sbs, 10.0, lead_lag=False, cyclic_inflow=False)
    np.testing.assert_allclose(trim(sbs, 10.0, guess=simple).controls, trim(sbs, 10.0).controls, atol=1e-9)
    heavier = sbs.with_value("body.mass", 25.0)
    np.testing.assert_allclose(trim(heavier, guess=trim(sbs)).controls, trim(heavier).controls, atol=1e-9)


@pytest.mark.parametrize("kind", [list, tuple, np.array])
def test_controls_are_a_guess(uh60a, kind):
    """Collective 15 deg and pedals 10 deg lead to the hover."""
    point = trim(uh60a, guess=kind(np.radians([15.0, 0.0, 0.0, 10.0])))
    np.testing.assert_allclose(point.controls, trim(uh60a).controls, atol=1e-9)


def test_a_guess_chooses_among_trims(sbs):
    """In fast descent momentum theory has the windmill, too: lambda0 = mu/2 - sqrt(mu^2/4 - C_T/2) (theory.md 6.1)."""
    ordinary, rotor = trim(sbs, climb_rate=-20.0), sbs.rotors[0]
    places = [ordinary.state_names.index(f"lambda0({j})") for j in (1, 2)]
    state = ordinary.state.copy()
    state[places] = 0.01
    windmill = trim(sbs, climb_rate=-20.0, guess=(np.zeros(4), state))
    mu = 20.0 / (rotor.speed * rotor.radius)
    thrust = (sbs.body.mass * G - 0.5 * RHO * sbs.body.flat_plate_areas[2] * 20.0**2) / 2
    coefficient = thrust / (RHO * math.pi * rotor.radius**2 * (rotor.speed * rotor.radius) ** 2)
    np.testing.assert_allclose(windmill.state[places], mu / 2 - math.sqrt(mu**2 / 4 - coefficient / 2), rtol=1e-6)
    np.testing.assert_allclose(ordinary.state[places], mu / 2 + math.sqrt(mu**2 / 4 + coefficient / 2), rtol=1e-6)
    assert np.all(windmill.power < 0.0)


def test_a_guess_that_leads_nowhere_does_no_harm(sbs, hover):
    far = trim(sbs, guess=np.radians([80.0, 80.0, -80.0, 80.0]))
    np.testing.assert_allclose(far.controls, hover.controls, atol=1e-9)
    assert far.beyond_limits == ()


def test_the_papers_loops_begin_with_a_guess(sbs, hover):
    guessed = trim(sbs, method="two_loop", guess=hover)
    assert guessed.iterations <= 2
    np.testing.assert_allclose(guessed.controls, hover.controls, atol=1e-7)


def test_linearize_and_sweep_hand_a_guess_on(sbs):
    """The branch in the windmill state tells that it was used."""
    point = trim(sbs, climb_rate=-20.0)
    state = point.state.copy()
    state[[point.state_names.index(f"lambda0({j})") for j in (1, 2)]] = 0.01
    guess = ([0.0, 0.0, 0.0, 0.0], state)
    expected = trim(sbs, climb_rate=-20.0, guess=guess).controls
    np.testing.assert_array_equal(linearize(sbs, climb_rate=-20.0, guess=guess).trim.controls, expected)
    found = sweep(sbs, "climb_rate", [-20.0], guess=guess, linear=False)
    np.testing.assert_array_equal(found.points[0].trim.controls, expected)


@pytest.mark.parametrize(
    ("guess", "message"),
    [
        ([0.1, 0.0, 0.0], "guess has the shape (3,): allowed are 4 numbers, collective the first"),
        ("hover", "guess = 'hover': allowed are numbers"),
        (0.1, "guess has the shape (): allowed are 4 numbers, collective the first"),
        ([0.1, math.nan, 0.0, 0.0], "guess: lateral_cyclic = nan: allowed are -1.5708 to 1.5708 rad"),
        ([2.0, 0.0, 0.0, 0.0], "guess: collective = 2.0: allowed are -1.5708 to 1.5708 rad"),
        (([0.1] * 4, [0.0] * 5), "guess[1] has the shape (5,): allowed are 38 numbers, u the first"),
        (([0.1] * 4, None), "guess[1] = None: allowed are numbers"),
    ],
)
def test_what_is_no_guess_is_refused(sbs, guess, message):
    for call in (trim, linearize, lambda craft, guess: sweep(craft, "airspeed", [0.0], guess=guess)):
        with pytest.raises(TrimError) as error:
            call(sbs, guess=guess)
        assert str(error.value) == message


def test_a_state_that_is_not_finite_is_refused_by_name(sbs, hover):
    state = hover.state.copy()
    state[hover.state_names.index("lambda0(2)")] = math.inf
    with pytest.raises(TrimError, match=r"guess\[1\]: lambda0\(2\) = inf: allowed are -1.5708 to 1.5708 rad"):
        trim(sbs, guess=(hover.controls, state))
    state = hover.state.copy()
    state[hover.state_names.index("u")] = 30.0  # what the condition tells does not count
    np.testing.assert_allclose(trim(sbs, guess=(hover.controls, state)).controls, hover.controls, atol=1e-9)


def test_a_trim_of_other_blades_is_refused(sbs):
    with pytest.raises(TrimError) as error:
        trim(sbs, guess=trim(AIRCRAFT["tandem"]()))
    assert str(error.value) == "guess: allowed is a trim of an aircraft with as many rotors and blades"


# -- what hover does not lead to -----------------------------------------------------------------------------


def test_an_aircraft_too_heavy_to_hover_flies_at_speed():
    """54.6 kg are 0.5 % more than the rotors lift in hover, and at 20 m/s they lift more."""
    aircraft = build(body={"mass": 54.6})
    with pytest.raises(TrimError, match=r"no trim: the rotors cannot carry more than 9\d\.?\d* % of the weight"):
        trim(aircraft)
    point = trim(aircraft, 20.0)
    assert point.residual < 1e-9
    assert point.beyond_limits == ()


def test_a_tail_rotor_too_small_for_hover_is_enough_at_speed(uh60a):
    """With blades of 7 cm it stalls below the torque of hover: reported by name."""
    small = uh60a.with_value("rotors.tail.chord", {"root": 0.07, "tip": 0.07})
    with pytest.raises(TrimError, match=r"cannot carry more than 8\d\.?\d* % of the weight, where tail stalls"):
        trim(small)
    assert trim(small, 30.0).beyond_limits == ()


def test_a_flight_beyond_a_gap_is_found(sbs_paper):
    """From 9 to 13 m/s there is no trim, so no path from hover leads to 30 m/s; one of guesses from 20 m/s does."""
    with pytest.raises(TrimError, match="the path from hover ends at airspeed 8"):
        trim(sbs_paper, 10.0)
    point, followed = trim(sbs_paper, 30.0), trim(sbs_paper, 20.0)
    for speed in (24.0, 27.0, 29.0, 30.0):
        followed = trim(sbs_paper, speed, guess=followed)
    np.testing.assert_allclose(point.controls, followed.controls, atol=1e-9)
    assert point.beyond_limits == ()


WAYS = {
    "hover": (build, {"airspeed": 8.0}, "_from_hover"),
    "the path from hover": (build, {"airspeed": 8.0, "climb_rate": 1.0}, "_along_path"),
    "momentum theory": (build, {"airspeed": 8.0, "turn_rate": 0.4}, "_from_momentum"),
    "a lighter aircraft": (build, {"airspeed": 8.0, "turn_rate": 0.4}, "_from_lighter"),
    "a slower flight": (build, {"airspeed": 20.0, "sideslip": 0.1}, "_from_other_speed"),
    "a faster flight": (AIRCRAFT["paper"], {"airspeed": 14.0}, "_from_other_speed"),
    "level flight, to hover": (AIRCRAFT["UH-60A"], {}, "_from_other_speed"),
    "level flight, to a climb": (AIRCRAFT["tandem"], {"airspeed": -2.0, "climb_rate": 2.0}, "_from_other_speed"),
}


@pytest.mark.parametrize("name", WAYS)
def test_every_way_by_itself_leads_to_the_flight(name):
    make, flight, way = WAYS[name]
    aircraft = make()
    search = _Search(TrimProblem(aircraft, Fidelity()), TrimCondition(**flight))
    if way == "_along_path":
        search._from_hover()
    found, point = getattr(search, way)(), trim(aircraft, **flight)
    np.testing.assert_allclose(found[:6], [point.pitch, point.roll, *point.controls], atol=1e-8)


def test_level_flight_is_looked_for_where_there_is_nothing_slower(sbs):
    """A hover has no share of its speed: flights at 2.5 hover inflow velocities lie beside those at 0.8 and 1.3."""
    problem = TrimProblem(sbs, Fidelity())
    induced = math.sqrt(sbs.body.mass * G / (2 * RHO * 2 * math.pi * sbs.rotors[0].radius ** 2))
    (level,) = _Search(problem, TrimCondition())._other_speeds()
    assert astuple(level) == pytest.approx((2.5 * induced, 0.0, 0.0, 0.0))
    slower, faster = _Search(problem, TrimCondition(15.0, 1.0, 0.2, 0.3))._other_speeds()
    assert astuple(slower) == pytest.approx((12.0, 0.8, 0.2, 0.24))
    assert astuple(faster) == pytest.approx((19.5, 1.3, 0.2, 0.39))
    assert len(_Search(problem, TrimCondition(-3.0))._other_speeds()) == 3


def test_what_was_trimmed_before_changes_no_bit():
    """An aircraft keeps its hovers: those of other fidelity, and those with zeros of other signs, are others."""
    used = build()
    flights = [{}, {"airspeed": 9.0}, {"airspeed": -3.0}, {"airspeed": 5.0, "cyclic_inflow": False}]
    for flight in (*flights, {"airspeed": 3.0, "sideslip": 0.2}, {"climb_rate": 1.0, "azimuth_count": 5}, *flights):
        assert trim(used, **flight) == trim(build(), **flight)


def test_a_hover_that_failed_fails_again_with_the_same_words():
    aircraft, reported = build(body={"mass": 90.0}), []
    for _ in range(2):
        with pytest.raises(TrimError, match="cannot carry more than") as caught:
            trim(aircraft)
        reported.append((str(caught.value), caught.value.residual))
    assert reported[0] == reported[1]


def test_of_two_flights_the_one_within_the_limits_is_found(sbs_paper):
    """At 20 m/s in a turn there is one with 13.4 deg of longitudinal cyclic, and one with 11.9 of 12."""
    point = trim(sbs_paper, 20.0, turn_rate=0.2)
    assert point.beyond_limits == ()
    assert point.residual < 1e-9


# of the first twenty of tools/robustness/trim_fleet.py, whose other search finds none there either
WITHOUT_TRIM = {(4, "hover"), (4, "forward"), (4, "slope"), (5, "turn")}


@pytest.mark.parametrize("kind", range(5))
def test_a_random_fleet_flies(kind):
    """Of each kind: what is not found has no trim, all others are ordinary flights."""
    for i in range(kind, 20, 5):
        _, aircraft, flights = random_flights(1, i)
        for name, condition in flights.items():
            if (i, name) in WITHOUT_TRIM:
                with pytest.raises(TrimError, match=r"no trim: .*the rotors cannot carry more than"):
                    trim(aircraft, **condition)
                continue
            point = trim(aircraft, **condition)
            assert point.residual < 1e-9, (i, name)
            assert point.beyond_limits == (), (i, name)


# -- what is reported ---------------------------------------------------------------------------------------


def share_of(error):
    """Return the share of the weight that a message tells."""
    return float(str(error).split("more than ")[1].split(" %")[0]) / 100


@pytest.mark.parametrize("heavy", [80.0, 400.0, 1500.0])
def test_the_weight_in_the_message_is_what_the_rotors_carry(heavy):
    """An aircraft of that mass hovers, one of 2 % more does not."""
    with pytest.raises(TrimError) as error:
        trim(build(body={"mass": heavy}))
    assert "where R1 and R2 stall" in str(error.value)
    assert "the vertical force is not balanced" in str(error.value)
    mass = heavy * share_of(error.value)
    assert error.value.worst_equation == "d(w)/dt"
    assert error.value.residual == pytest.approx(1 - mass / heavy, abs=1e-3)
    assert trim(build(body={"mass": 0.995 * mass})).thrust.sum() == pytest.approx(0.995 * mass * G, rel=1e-3)
    with pytest.raises(TrimError):
        trim(build(body={"mass": 1.02 * mass}))


def without_differential():
    """Return the side-by-side aircraft whose fourth control moves nothing."""
    data = aircraft_data()
    for rotor in data["rotors"]:
        rotor["mixing"]["longitudinal_cyclic"].pop("differential_longitudinal_cyclic")
    return Aircraft.from_dict(data)


def test_a_control_that_moves_nothing_stays_and_is_missed_where_it_is_needed(sbs):
    """Straight flight of a symmetric aircraft needs no yawing moment; sideways flight does."""
    aircraft = without_differential()
    for speed in (0.0, 15.0):
        point = trim(aircraft, speed)
        assert abs(point.controls[3]) < 1e-9
        np.testing.assert_allclose(point.controls, trim(sbs, speed).controls, atol=1e-8)
    with pytest.raises(TrimError, match="no trim: no control sets the yawing moment; the path from hover ends at"):
        trim(aircraft, 5.0, sideslip=1.0)


def test_two_controls_that_do_the_same_are_one_too_many(sbs):
    """The differential is a second collective: straight flight is the same, shared between the two."""
    data = aircraft_data()
    for rotor in data["rotors"]:
        rotor["mixing"]["longitudinal_cyclic"].pop("differential_longitudinal_cyclic")
        rotor["mixing"]["collective"]["differential_longitudinal_cyclic"] = 1.0
    point = trim(Aircraft.from_dict(data), 10.0)
    np.testing.assert_allclose(point.swashplate, trim(sbs, 10.0).swashplate, atol=1e-8)


def test_without_air_there_is_nothing_to_trim_with():
    with pytest.raises(TrimError, match="no trim: there is no air to carry the weight; "):
        trim(build(environment=VACUUM))
    assert trim(build(environment=WEIGHTLESS_VACUUM)).residual < 1e-9


@pytest.mark.parametrize("condition", [{"airspeed": 70.0}, {"climb_rate": 45.0}])
def test_beyond_the_reach_of_the_rotors_all_that_stops_them_is_reported(sbs, condition):
    """How far the path from hover leads, what it takes there, and what is left."""
    with pytest.raises(TrimError) as error:
        trim(sbs, **condition)
    text = str(error.value)
    assert text.startswith("no trim: the path from hover ends at airspeed ")
    assert ", with collective = " in text
    assert text.endswith(f" is not balanced, residual {error.value.residual:.3g} in {error.value.worst_equation}")


def test_what_no_weight_makes_possible_is_reported_by_momentum_theory(uh60a):
    """The drag of the main rotor's blades alone is too much for a tail rotor with blades of 2 cm.

    It would need the thrust of the right one with a twelfth of its blade area: a lift coefficient above 3.
    """
    with pytest.raises(TrimError) as error:
        trim(uh60a.with_value("rotors.tail.chord", {"root": 0.02, "tip": 0.02}))
    text = str(error.value)
    assert text.startswith("no trim: by momentum theory it takes a mean lift coefficient of ")
    assert " of tail; the " in text
    assert " of main" not in text.split(";")[0]
    assert float(text.split("coefficient of ")[1].split(" ")[0]) > 3.0


@pytest.mark.parametrize(
    ("engine", "most"),
    [
        ({"kind": "engine", "max_torque": 3.0}, 3.0),
        ({"kind": "engine", "max_torque": 30.0, "max_power": 500.0}, 500.0 / (80 * math.pi)),
        ({"kind": "none"}, 0.0),
    ],
)
def test_a_drive_that_is_too_weak_is_reported_with_what_the_rotors_take(sbs, engine, most):
    """The torque at constant speed beside the largest of the drive; a strong one trims."""
    governor = {"integral_gain": 2.0, "proportional_gain": 2.0}
    data = aircraft_data() | {"drives": [{"rotors": ["R1", "R2"], "engine": engine, "governor": governor}]}
    with pytest.raises(TrimError) as error:
        trim(Aircraft.from_dict(data))
    taken = trim(sbs).torque.sum()
    message = f"no trim: drive 1 gives up to {most:.3g} N m, its rotors take {taken:.3g} N m at the speed of the file; "
    assert message in str(error.value)
    data["drives"][0]["engine"] = {"kind": "engine", "max_torque": 1.2 * taken}
    assert trim(Aircraft.from_dict(data)).torque.sum() == pytest.approx(taken, rel=1e-3)


def test_every_equation_has_words(sbs):
    problem = TrimProblem(sbs, Fidelity())
    words = [problem.balance(row) for row in np.eye(len(problem.equations))]
    body = ["force ahead", "force to the right", "vertical force", "rolling moment", "pitching moment", "yawing moment"]
    assert words[:6] == body
    assert set(words[6:]) == {f"{part} of {name}" for part in ("flap", "lag", "inflow") for name in ("MR1", "MR2")}
    places = [list(sbs.layout.names).index(name) for name in ("u", "v", "w", "p", "q", "r")]
    assert list(problem.equations[:6]) == places == list(range(S.VELOCITY, S.BODY_SIZE))
