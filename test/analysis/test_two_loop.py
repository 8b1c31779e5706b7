"""The paper's two nested trim loops, and the balance of steady flight that they solve (theory.md section 8)."""

import math
import re

import numpy as np
import pytest
from helpers import CALM, Model, aircraft_data, build, unit
from plain_model import make_instant, multiblade_matrix, plain_derivative, random_state, residual

from sbs_sim import trim
from sbs_sim.aircraft import Aircraft
from sbs_sim.analysis import two_loop
from sbs_sim.analysis.trim_guess import MomentumTheory
from sbs_sim.analysis.trim_problem import TrimProblem
from sbs_sim.analysis.two_loop import solve_by_two_loops
from sbs_sim.errors import TrimError
from sbs_sim.flight.trim_point import Fidelity, TrimCondition
from sbs_sim.flight.trimmed_state import trimmed_state
from sbs_sim.model import state as S
from sbs_sim.model.steady import steady_balance

FIDELITIES = [(True, True), (True, False), (False, True), (False, False)]
CONTROLS = ("collective", "lateral_cyclic", "longitudinal_cyclic", "differential_longitudinal_cyclic")
MESSAGE = re.compile(
    r"no trim by two loops: (?P<reason>[a-z ]+) after (?P<outer>\d+) outer and (?P<inner>\d+) inner iterations;"
    r" last change of the flap and lag coordinates (?P<change>\S+), residual (?P<residual>\S+) in (?P<worst>d\(.+\)/dt)"
)


def balance(model, x, swash, psi, wind=CALM):
    """Return the rates of steady flight at an azimuth, shape (size,), and the imbalance, shape (6,)."""
    engine = model.engine
    rates, imbalance = engine.memory(model.layout.size), engine.memory(6)
    steady_balance(engine.model, *map(model.lanes, (x, swash, psi, wind)), engine.work, rates, imbalance)
    return rates[:, 0], imbalance[:, 0]


def mean_balance(model, point, count=12):
    """Return the averages of `balance` at a trim, with the angle between two blades divided by `count`."""
    x, blades = trimmed_state(model.aircraft, point), np.array([rotor.blades for rotor in model.aircraft.rotors])
    found = [balance(model, x, point.swashplate, 2 * np.pi * k / (blades * count)) for k in range(count)]
    return tuple(np.mean(part, axis=0) for part in zip(*found, strict=True))


# -- the balance against the plain reference -----------------------------------------------------------------

UNUSUAL = {
    "hinge_offset": 0.09,
    "flap_hinge_offset": 0.035,
    "lag_spring": 25.0,
    "pitch_lag_coupling": -0.2,
    "duct_expansion": 0.8,
}
TILTED = [{"shaft_direction": unit(0.1, -0.2, -1.0)}, {"shaft_direction": unit(-0.15, 0.3, -0.9)}]
AIRCRAFT = {
    "sbs": {},
    "sbs_paper": {"name": "sbs_paper"},
    "paper coupling only": {"options": {"coupling": "paper"}},
    "tilted": {"every_rotor": UNUSUAL, "rotors": TILTED},
    "tilted, paper": {"name": "sbs_paper", "every_rotor": UNUSUAL, "rotors": TILTED},
    "four and five blades": {"rotors": [{"blades": 4}, {"blades": 5}], "every_rotor": UNUSUAL},
    "six and seven blades": {"rotors": [{"blades": 6}, {"blades": 7}], "every_rotor": {"blade_mass": 0.05}},
}


def held_accelerations(aircraft, coordinates, psi):
    """Return beta'' or xi'' of all blades on constant coordinates: the second derivative of the transform."""
    return [
        rotor.speed**2 * multiblade_matrix(rotor.blades, psi[j], 2) @ coordinates[j]
        for j, rotor in enumerate(aircraft.rotors)
    ]


def plain_balance(aircraft, x, swash, psi, wind, lead_lag):
    """Return the imbalance, shape (6,), and the blades' flap and lag accelerations on a body in steady motion.

    The reference's equations, affine in the accelerations, are evaluated with the held ones for the body and solved
    for the blades' own.
    """
    layout = aircraft.layout
    instant = make_instant(aircraft, x, swash, psi, wind, lead_lag)
    om, velocity = x[S.RATES : S.BODY_SIZE], x[S.VELOCITY : S.RATES]
    body = np.concatenate([np.cross(om, velocity), np.zeros(3)])
    rotors = range(len(aircraft.rotors))
    flap = held_accelerations(aircraft, [x[layout.flap(j)] for j in rotors], psi)
    lag = held_accelerations(aircraft, [x[layout.lag(j)] for j in rotors], psi)
    held = [np.concatenate([flap[j], lag[j]]) if lead_lag else flap[j] for j in rotors]
    imbalance = residual(instant, np.concatenate([body, *held]))[:6]

    count = sum(len(part) for part in held)
    constant = residual(instant, np.concatenate([body, np.zeros(count)]))[6:]
    matrix = [residual(instant, np.concatenate([body, column]))[6:] - constant for column in np.eye(count)]
    own = np.linalg.solve(np.stack(matrix, axis=1), -constant)
    return imbalance, np.split(own, np.cumsum([len(part) for part in held])[:-1])


@pytest.mark.parametrize("lead_lag", [True, False])
@pytest.mark.parametrize("name", AIRCRAFT)
def test_balance_equals_the_plain_reference(name, lead_lag):
    """At a random state, coordinate rates included, in wind; force and moment to 1e-12 of what balances inside."""
    aircraft = build(**AIRCRAFT[name])
    model, layout, rng = Model(aircraft, lead_lag), aircraft.layout, np.random.default_rng(5)
    x, swash = random_state(aircraft, rng, 1.0), rng.normal(scale=0.1, size=(2, 3))
    psi, wind = rng.uniform(0, 2 * np.pi, 2), rng.normal(scale=4.0, size=3)
    rates, imbalance = balance(model, x, swash, psi, wind)

    expected, own = plain_balance(aircraft, x, swash, psi, wind, lead_lag)
    centrifugal = sum(r.blades * r.blade_mass * r.speed**2 * r.radius for r in aircraft.rotors)
    np.testing.assert_allclose(imbalance, expected, atol=1e-12 * centrifugal)
    for j, rotor in enumerate(aircraft.rotors):
        transform, turned = (multiblade_matrix(rotor.blades, psi[j], order) for order in (0, 1))
        coordinates = ((layout.flap, layout.flap_rate), (layout.lag, layout.lag_rate))[: 1 + lead_lag]
        for part, (angle, rate) in enumerate(coordinates):
            blades = own[j][part * rotor.blades : (part + 1) * rotor.blades]
            held = held_accelerations(aircraft, [x[angle(i)] for i in range(2)], psi)[j]
            rest = blades - 2 * rotor.speed * turned @ x[rate(j)] - held
            np.testing.assert_allclose(rates[rate(j)], np.linalg.solve(transform, rest), atol=1e-10 * rotor.speed**2)

    complete, _ = plain_derivative(aircraft, x, swash, psi, wind, lead_lag)
    first_inflow = layout.inflow(0).start
    np.testing.assert_allclose(rates[first_inflow:], complete[first_inflow:], rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(rates[: S.VELOCITY], complete[: S.VELOCITY], atol=1e-12)  # position and attitude go on
    np.testing.assert_allclose(rates[S.VELOCITY : S.BODY_SIZE], 0, atol=1e-14)


# -- the balance at Newton's trims ---------------------------------------------------------------------------


@pytest.mark.parametrize("fixtures", [("sbs", "hover"), ("sbs_paper", "paper_hover")])
def test_blades_of_a_hover_are_the_held_ones(fixtures, request):
    """Where no coordinate accelerates, the complete derivative gives the same loads at every azimuth."""
    aircraft, point = (request.getfixturevalue(name) for name in fixtures)
    model, x = Model(aircraft), trimmed_state(aircraft, point)
    for psi in (0.0, 0.4, 1.7):
        model.derivative(x, point.swashplate, [psi, psi])
        expected, blades = model.loads.copy(), model.engine.work.terms.copy()
        balance(model, x, point.swashplate, [psi, psi])
        np.testing.assert_allclose(model.loads, expected, atol=1e-7)
        for name in (
            "flap_acceleration",
            "lag_acceleration",
            "flap_moment",
            "lag_moment",
            "known_force",
            "known_moment",
        ):
            np.testing.assert_allclose(model.engine.work.terms[name], blades[name], atol=1e-6, err_msg=name)


@pytest.mark.parametrize(("lead_lag", "cyclic_inflow"), FIDELITIES)
@pytest.mark.parametrize("name", ["sbs", "sbs_paper"])
def test_balance_vanishes_in_hover(name, lead_lag, cyclic_inflow):
    """To the tolerance of Newton's method: nothing vibrates."""
    aircraft = build(name)
    model = Model(aircraft, lead_lag, cyclic_inflow)
    rates, imbalance = mean_balance(model, trim(aircraft, lead_lag=lead_lag, cyclic_inflow=cyclic_inflow))
    np.testing.assert_allclose(imbalance, 0, atol=1e-7)
    np.testing.assert_allclose(rates[S.BODY_SIZE :] / model.speeds[0] ** 2, 0, atol=1e-11)


@pytest.mark.parametrize(
    ("name", "cyclic_inflow", "condition"),
    [
        ("sbs", True, {"airspeed": 10.0}),
        ("sbs", True, {"airspeed": 10.0, "turn_rate": 0.3}),
        ("sbs", False, {"airspeed": 10.0, "turn_rate": 0.3}),
        ("sbs_paper", False, {"airspeed": 10.0}),
        ("sbs_paper", False, {"airspeed": 10.0, "turn_rate": 0.3}),
    ],
)
def test_balance_vanishes_at_trims_but_for_products_of_vibrations(name, cyclic_inflow, condition):
    """The masses that vibrate are a percent of the whole, their angles a percent: 1e-4 of weight, weight times R."""
    aircraft = build(name)
    model = Model(aircraft, cyclic_inflow=cyclic_inflow)
    rates, imbalance = mean_balance(model, trim(aircraft, cyclic_inflow=cyclic_inflow, **condition))
    weight = aircraft.body.mass * aircraft.environment.gravity
    np.testing.assert_allclose(imbalance[:3] / weight, 0, atol=1e-4)
    np.testing.assert_allclose(imbalance[3:] / (weight * aircraft.rotors[0].radius), 0, atol=1e-4)
    np.testing.assert_allclose(rates[S.BODY_SIZE :] / model.speeds[0] ** 2, 0, atol=1e-6)


# -- two loops and Newton's method ---------------------------------------------------------------------------

# The loops stop at changes of 1e-6 of 0.01 rad, or of an inflow of 0.06; the inner loop lessens its error to 0.7 at
# each turn, so that some three times the last change are left.
AGREEMENT = 2e-7


def assert_same_trim(found, expected, agreement=AGREEMENT):
    """Controls, attitude and rotor states agree [rad, inflow over tip speed], loads to what that makes of them."""
    np.testing.assert_allclose(found.controls, expected.controls, atol=agreement)
    np.testing.assert_allclose([found.pitch, found.roll], [expected.pitch, expected.roll], atol=agreement)
    np.testing.assert_allclose(found.state[8:], expected.state[8:], atol=agreement)
    np.testing.assert_allclose(found.thrust, expected.thrust, rtol=100 * agreement)
    np.testing.assert_allclose(found.power, expected.power, rtol=100 * agreement)


@pytest.mark.parametrize(("lead_lag", "cyclic_inflow"), FIDELITIES)
@pytest.mark.parametrize("name", ["sbs", "sbs_paper"])
def test_hover_is_newtons(name, lead_lag, cyclic_inflow):
    fidelity = {"lead_lag": lead_lag, "cyclic_inflow": cyclic_inflow}
    aircraft = build(name)
    found, expected = trim(aircraft, method="two_loop", **fidelity), trim(aircraft, **fidelity)
    assert_same_trim(found, expected)
    assert (found.method, expected.method) == ("two_loop", "newton")
    assert expected.inner_iterations == 0
    assert found.iterations <= 5
    assert found.iterations <= found.inner_iterations <= 8
    assert found.residual < 1e-8  # momentum theory, from which the loops start, has the right inflow
    assert found.beyond_limits == ()


@pytest.mark.parametrize("climb", [-2.0, 2.0, 5.0])
def test_vertical_flight_is_newtons(sbs, hover, climb):
    """Momentum theory has the right inflow; from that of hover the inner loop halves, roughly, the error in it."""
    found, expected = trim(sbs, climb_rate=climb, method="two_loop"), trim(sbs, climb_rate=climb)
    assert_same_trim(found, expected)
    assert found.iterations <= 5
    assert found.inner_iterations <= 8
    if abs(climb) < 3.0:  # farther from hover the gain of -5 may meet more than rounding
        found = trim(sbs, climb_rate=climb, method="two_loop", guess=hover)
        assert_same_trim(found, expected)
        assert 20 < found.inner_iterations < 50


@pytest.mark.parametrize("rotors", [[{"blades": 4}, {"blades": 4}], [{"blades": 5}, {"blades": 5}]])
def test_hover_of_other_blade_numbers_is_newtons(rotors):
    aircraft = build(every_rotor={"blade_mass": 0.08}, rotors=rotors)
    assert_same_trim(trim(aircraft, method="two_loop"), trim(aircraft))


def test_number_of_azimuths_does_not_matter_in_hover(sbs, hover):
    for count in (1, np.int64(5)):
        found = trim(sbs, method="two_loop", azimuth_count=count)
        np.testing.assert_allclose(found.controls, hover.controls, atol=AGREEMENT)
        assert found.azimuth_count == count


@pytest.mark.parametrize("lead_lag", [True, False])
def test_forward_flight_without_cyclic_inflow_is_nearly_newtons(sbs, lead_lag):
    """At 10 m/s the azimuths settle 4e-4 rad apart; a hundredth of that, a product of vibrations, is the difference."""
    fidelity = {"lead_lag": lead_lag, "cyclic_inflow": False}
    found, expected = trim(sbs, 10.0, method="two_loop", **fidelity), trim(sbs, 10.0, **fidelity)
    assert_same_trim(found, expected, 2e-5)
    assert expected.residual < 1e-9 < 1e-5 < found.residual < 1e-3


def test_residual_is_that_of_the_complete_equations(sbs):
    """Recomputed from the averaged derivative: accelerations over gravity, rotors over Omega^2 and Omega."""
    point = trim(sbs, 10.0, cyclic_inflow=False, method="two_loop")
    model = Model(sbs, cyclic_inflow=False)
    rates, layout = model.averaged(trimmed_state(sbs, point), point.swashplate)[0], sbs.layout
    speed, inflow = model.speeds[0], layout.inflow(0).start
    accelerations = [*range(layout.flap_rate(0).start, layout.flap_rate(1).stop)]
    accelerations += range(layout.lag_rate(0).start, layout.lag_rate(1).stop)
    scaled = [*rates[S.VELOCITY : S.BODY_SIZE] / 9.80665, *rates[accelerations] / speed**2, *rates[inflow:] / speed]
    assert point.residual == pytest.approx(np.abs(scaled).max(), rel=1e-9)


# -- honest failure ------------------------------------------------------------------------------------------


def failure_of(error, aircraft):
    """Return the parts of a failure's message, checked against its attributes."""
    parts = MESSAGE.fullmatch(str(error))
    assert parts, str(error)
    assert f"{error.residual:.3g}" == parts["residual"]
    assert error.worst_equation == parts["worst"]
    assert parts["worst"][2:-4] in aircraft.layout.names
    return parts


@pytest.mark.parametrize("name", ["sbs", "sbs_paper"])
@pytest.mark.parametrize(
    "condition",
    [{"airspeed": 10.0}, {"airspeed": 20.0}, {"airspeed": 10.0, "turn_rate": 0.3}, {"airspeed": 4.0, "sideslip": 1.5}],
)
def test_flight_away_from_hover_fails_and_says_how(name, condition):
    """Loops are done, the complete equations are far from fulfilled: the coordinates still change by much, or stay."""
    aircraft = build(name)
    with pytest.raises(TrimError) as error:
        trim(aircraft, method="two_loop", **condition)
    parts = failure_of(error.value, aircraft)
    assert int(parts["outer"]) >= 1
    assert int(parts["inner"]) >= 1
    assert float(parts["change"]) > 0.1 or parts["reason"] == "the loops come to rest off trim"
    assert error.value.residual > 10 * two_loop.MAX_RESIDUAL


def test_newton_finds_what_the_loops_do_not(sbs):
    """The flight is there, so that the failure is the loops' own; nothing falls back on Newton's method."""
    assert trim(sbs, 10.0).residual < 1e-9
    with pytest.raises(TrimError, match="by two loops"):
        trim(sbs, 10.0, method="two_loop")


def test_outer_loop_drives_away_from_a_hover_that_is_not_symmetric(sbs, hover):
    """From the trim itself with a thousandth of a radian of lateral cyclic: each turn multiplies it by some -5."""
    problem = TrimProblem(sbs, Fidelity())
    start = np.concatenate([[hover.pitch, hover.roll], hover.controls, np.zeros(len(problem.equations) - 6)])
    x = trimmed_state(sbs, hover)
    start[problem.coordinates] = np.concatenate([np.r_[x[sbs.layout.flap(j)], x[sbs.layout.lag(j)]] for j in range(2)])
    start[problem.inflow] = x[sbs.layout.inflow(0).start :]
    assert solve_by_two_loops(problem, TrimCondition(), start)[1] <= 2
    start[2 + CONTROLS.index("lateral_cyclic")] += 1e-3
    with pytest.raises(TrimError, match="the outer loop diverges"):
        solve_by_two_loops(problem, TrimCondition(), start)


@pytest.mark.parametrize(
    ("limit", "value", "condition", "reason"),
    [
        ("MAX_OUTER_ITERATIONS", 2, {}, "the outer loop does not end"),
        ("MAX_INNER_ITERATIONS", 3, {"climb_rate": 2.0, "guess": [0.15, 0.0, 0.0, 0.0]}, "the inner loop does not end"),
        ("MAX_RESIDUAL", 1e-4, {"airspeed": 10.0, "cyclic_inflow": False}, "the loops come to rest off trim"),
    ],
)
def test_every_end_is_reported(sbs, monkeypatch, limit, value, condition, reason):
    monkeypatch.setattr(two_loop, limit, value)
    with pytest.raises(TrimError) as error:
        trim(sbs, method="two_loop", **condition)
    assert failure_of(error.value, sbs)["reason"] == reason


def test_a_control_that_does_nothing_is_missed_where_it_is_needed():
    """A differential that no swashplate follows: straight flight of a symmetric aircraft needs none, others do."""
    data = aircraft_data()
    for rotor in data["rotors"]:
        rotor["mixing"]["longitudinal_cyclic"].pop("differential_longitudinal_cyclic")
    aircraft = Aircraft.from_dict(data)
    np.testing.assert_allclose(trim(aircraft, method="two_loop").controls, trim(aircraft).controls, atol=1e-7)
    with pytest.raises(TrimError) as error:
        trim(aircraft, 5.0, sideslip=1.0, method="two_loop")
    assert failure_of(error.value, aircraft)["reason"] == "no controls balance the body"


def test_what_cannot_hover_is_a_failure():
    aircraft = build(body={"mass": 400.0})
    with pytest.raises(TrimError) as error:
        trim(aircraft, method="two_loop")
    failure_of(error.value, aircraft)


def test_numbers_that_are_not_finite_are_a_failure(sbs):
    problem = TrimProblem(sbs, Fidelity())
    start = MomentumTheory(problem).guess(TrimCondition())
    start[2] = math.nan
    with pytest.raises(TrimError) as error:
        solve_by_two_loops(problem, TrimCondition(), start)
    assert failure_of(error.value, sbs)["reason"] == "the blades find no steady motion"


# -- arguments -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("method", ["x", "", "Newton", None])
def test_unknown_method_is_refused(sbs, method):
    with pytest.raises(TrimError) as error:
        trim(sbs, method=method)
    assert str(error.value) == f"method = {method!r}: allowed are newton, two_loop"
    assert error.value.residual is None
    assert error.value.worst_equation is None


@pytest.mark.parametrize("count", [0, 1001, -3, 2.5, 12.0, math.nan, math.inf, True, "12", None])
def test_number_of_azimuths_is_an_integer(sbs, count):
    with pytest.raises(TrimError) as error:
        trim(sbs, azimuth_count=count)
    assert str(error.value) == f"azimuth_count = {count!r}: allowed are integers from 1 to 1000"


@pytest.mark.parametrize("method", ["newton", "two_loop"])
@pytest.mark.parametrize("name", ["airspeed", "climb_rate", "sideslip", "turn_rate"])
def test_condition_that_is_no_number_is_refused(sbs, name, method):
    with pytest.raises(TrimError, match=rf"^{name} = nan: allowed are -"):
        trim(sbs, method=method, **{name: math.nan})


@pytest.mark.parametrize(("body", "condition"), [({}, {"airspeed": 70.0}), ({"mass": 400.0}, {})])
def test_newtons_failure_holds_its_residual(body, condition):
    """On the way from hover, and in hover."""
    aircraft = build(body=body)
    with pytest.raises(TrimError) as error:
        trim(aircraft, **condition)
    assert f"residual {error.value.residual:.3g} in {error.value.worst_equation}" in str(error.value)
