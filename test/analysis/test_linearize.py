"""Linear models: against the nonlinear model, against each other, and against the symmetries of the aircraft."""

import math

import numpy as np
import pytest
import scipy.linalg
from helpers import Model, aircraft_data, build, mirrored_data

from sbs_sim import Aircraft, linearize, trim
from sbs_sim.analysis.differences import difference_steps, jacobians, used_states
from sbs_sim.analysis.kinematics import kinematics
from sbs_sim.analysis.linear_model import settle
from sbs_sim.errors import LinearizationError, TrimError
from sbs_sim.flight.trimmed_state import trimmed_state
from sbs_sim.model import records as R
from sbs_sim.model import state as S
from sbs_sim.model.frames import rotation_matrix

FIDELITIES = [(False, False), (True, False), (True, True)]
CONTROLS = S.CONTROL_NAMES
MIRROR_BODY = {"v", "p", "phi", "r"}  # change sides in the mirror
MIRROR_CONTROLS = np.array([1.0, -1.0, 1.0, -1.0])


@pytest.fixture(scope="module")
def cruise(sbs):
    return linearize(sbs, airspeed=10.0)


@pytest.fixture(scope="module")
def hover_model(sbs, hover):
    return linearize(sbs, point=hover)


def in_steps(model):
    """A with every state measured in its step, which makes its elements comparable."""
    steps = model.steps[: len(model.state_names)]
    return model.a * steps / steps[:, None]


def relative_difference(one, other):
    return np.linalg.norm(in_steps(one) - in_steps(other)) / np.linalg.norm(in_steps(other))


# -- against the nonlinear model -------------------------------------------------------------------------------------


def body_in_time(model, point, change, seconds, steps):
    """Body states of the averaged nonlinear model after a step of the controls, shape (steps + 1, 8)."""
    aircraft, h = model.aircraft, seconds / steps
    x = trimmed_state(aircraft, point)
    swash = aircraft.mix(point.controls + change)

    def slope(state):
        return model.averaged(state, swash, 6)[0]

    history = [model.layout.to_linear(x)[: S.LINEAR_BODY_SIZE]]
    for _ in range(steps):
        k1 = slope(x)
        k2 = slope(x + 0.5 * h * k1)
        k3 = slope(x + 0.5 * h * k2)
        x = x + h / 6 * (k1 + 2 * k2 + 2 * k3 + slope(x + h * k3))
        x[S.ATTITUDE : S.VELOCITY] /= np.linalg.norm(x[S.ATTITUDE : S.VELOCITY])
        history.append(model.layout.to_linear(x)[: S.LINEAR_BODY_SIZE])
    return np.array(history)


@pytest.mark.parametrize("control", range(4), ids=CONTROLS)
@pytest.mark.parametrize("airspeed", [0.0, 10.0])
def test_linear_response_is_that_of_the_averaged_nonlinear_model(sbs, airspeed, control):
    """Within 2 % of the peak of every body state over 1 s.

    What hardly answers, a lateral state to a longitudinal step, answers to the square of the step: there the peak
    counts as a twentieth of that of its neighbours of the same unit.
    """
    point = trim(sbs, airspeed, azimuth_count=6)
    linear = linearize(sbs, point=point)
    change = np.zeros(4)
    change[control] = math.radians(0.001)
    steps = 1500
    nonlinear = body_in_time(Model(sbs), point, change, 1.0, steps)
    nonlinear -= nonlinear[0]
    n = len(linear.a)
    extended = np.zeros((n + 1, n + 1))
    extended[:n, :n], extended[:n, n] = linear.a, linear.b @ change
    transition, state = scipy.linalg.expm(extended / steps), np.eye(n + 1)[n]
    history = [state]
    for _ in range(steps):
        state = transition @ state
        history.append(state)
    response = np.array(history)[:, : S.LINEAR_BODY_SIZE]
    peaks = np.abs(nonlinear).max(axis=0)
    for unit in set(S.LINEAR_BODY_UNITS):
        alike = [i for i, own in enumerate(S.LINEAR_BODY_UNITS) if own == unit]
        peaks[alike] = np.maximum(peaks[alike], 0.05 * peaks[alike].max())
    peaks = np.maximum(peaks, 1e-9)  # what symmetry keeps still moves by rounding
    worst = (np.abs(response - nonlinear).max(axis=0) / peaks).max()
    assert worst < 0.02


@pytest.mark.parametrize(("lead_lag", "cyclic_inflow"), FIDELITIES)
def test_matrices_are_differences_of_the_averaged_derivative(sbs, lead_lag, cyclic_inflow):
    """Taken one by one, in the coordinates of the simulation: the quaternion's small angles are the attitude's."""
    fidelity = {"lead_lag": lead_lag, "cyclic_inflow": cyclic_inflow}
    point = trim(sbs, 8.0, 1.0, **fidelity)
    linear = linearize(sbs, point=point)
    model, x = Model(sbs, **fidelity), trimmed_state(sbs, point)
    for name in ("u", "w", "q", "v", "p", "r", "a0(1)", "db1(2)", "lambda0(2)", "xic(1)", "lambdas(1)"):
        if name not in linear.state_names:
            assert "xi" in name or "lambdas" in name
            continue
        column, place = linear.state_names.index(name), sbs.layout.names.index(name)
        slope = model.jacobian(x, point.swashplate, columns=[place], step=linear.steps[column])[:, 0]
        for row, other in enumerate(linear.state_names):
            if other in ("theta", "phi"):
                continue
            expected = slope[sbs.layout.names.index(other)]
            assert linear.a[row, column] == pytest.approx(expected, rel=1e-7, abs=1e-7), (other, name)


def test_control_matrix_is_a_difference_of_trims_loads(sbs, cruise):
    model, x = Model(sbs), trimmed_state(sbs, cruise.trim)
    n = len(cruise.state_names)
    for i in range(4):
        change = np.eye(4)[i] * cruise.steps[n + i]
        sides = [model.averaged(x, sbs.mix(cruise.trim.controls + sign * change)) for sign in (1, -1)]
        slope = (sides[0][0] - sides[1][0]) / (2 * cruise.steps[n + i])
        assert cruise.b[0, i] == pytest.approx(slope[S.VELOCITY], rel=1e-7, abs=1e-8)
        assert cruise.b[5, i] == pytest.approx(slope[S.RATES], rel=1e-7, abs=1e-8)
        thrust = (sides[0][1] - sides[1][1])[:, R.THRUST] / (2 * cruise.steps[n + i])
        rows = [cruise.output_names.index(f"thrust({j})") for j in (1, 2)]
        np.testing.assert_allclose(cruise.d[rows, i], thrust, rtol=1e-7, atol=1e-6)


def test_attitude_columns_are_gravity_and_kinematics(sbs, cruise):
    """Loads do not know the attitude: in these columns A is the rigid body's, to the error of the differences."""
    expected = kinematics(cruise.trim.state, sbs.body.inertia, sbs.environment.gravity)
    for name in ("theta", "phi"):
        column = cruise.state_names.index(name)
        np.testing.assert_allclose(cruise.a[:8, column], expected[:, column], rtol=2e-6, atol=2e-6)
        np.testing.assert_allclose(cruise.a[8:, column], 0.0, atol=1e-2)


def test_steps_follow_from_the_kind_of_the_state(cruise):
    """Flap and lag alike, their rates alike, all inflow alike, whatever rotor and harmonic."""
    kinds = {}
    for name, step in zip(cruise.state_names, cruise.steps, strict=False):
        part = S.part_of(name)
        if part.family != "body":
            kinds.setdefault((part.family == "inflow", part.is_rate), set()).add(step)
    assert len(kinds) == 3
    assert all(len(steps) == 1 for steps in kinds.values())
    assert kinds[False, False] != kinds[False, True]


def test_steps_hardly_matter(sbs, cruise):
    """A third and three times the steps move no pole by more than 0.2 %."""
    for scale in (0.03, 0.3, 3.0):
        other = linearize(sbs, point=cruise.trim, step_scale=scale)
        for mode in cruise.modes:
            change = abs(other.mode(mode.name).pole - mode.pole)
            assert change < 2e-3 * max(abs(mode.pole), 0.5), mode.name


# -- the two constructions -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["sbs", "sbs_paper"])
@pytest.mark.parametrize(("lead_lag", "cyclic_inflow"), FIDELITIES)
@pytest.mark.parametrize("airspeed", [0.0, 5.0])
def test_the_papers_construction_gives_the_same_matrices(name, lead_lag, cyclic_inflow, airspeed):
    """Term by term or at once, compiled or not: the difference is the curvature within a step."""
    aircraft = Aircraft.load(name)
    point = trim(aircraft, airspeed, lead_lag=lead_lag, cyclic_inflow=cyclic_inflow)
    averaged, paper = (linearize(aircraft, point=point, method=method) for method in ("averaged", "paper"))
    assert relative_difference(paper, averaged) < 1e-6
    np.testing.assert_allclose(paper.b, averaged.b, rtol=1e-7, atol=1e-7)
    assert paper.state_names == averaged.state_names


def test_the_papers_construction_for_four_blades_in_a_turn():
    aircraft = build(every_rotor={"blades": 4, "blade_mass": 0.12})
    point = trim(aircraft, 8.0, turn_rate=0.4)
    averaged, paper = (linearize(aircraft, point=point, method=method) for method in ("averaged", "paper"))
    assert relative_difference(paper, averaged) < 1e-6


def test_blocks_make_up_the_matrix(sbs, cruise):
    paper = linearize(sbs, point=cruise.trim, method="paper")
    parts = paper.blocks
    order = list(paper.state_names)
    body, inflow = range(8), [i for i, name in enumerate(order) if name.startswith("lambda")]
    rotor = [i for i in range(len(order)) if i not in body and i not in inflow]
    assert (len(body), len(rotor), len(inflow)) == (8, 24, 6)
    for row, rows in (("B", body), ("R", rotor), ("lambda", inflow)):
        for column, columns in (("B", body), ("R", rotor), ("lambda", inflow)):
            np.testing.assert_array_equal(parts[f"A_{row}-{column}"], paper.a[np.ix_(rows, columns)])
    second = parts["A_R_second"].copy()
    second[:, rotor] += parts["A_R_first"]
    np.testing.assert_allclose(second, paper.a[rotor], rtol=1e-12, atol=1e-9)
    second = parts["A_lambda_second"].copy()
    second[:, inflow] += parts["C_lambda"]
    np.testing.assert_allclose(second, paper.a[inflow], rtol=1e-12, atol=1e-9)
    np.testing.assert_allclose(parts["A_quasi_static"], paper.quasi_static().a, rtol=1e-9, atol=1e-9)


def test_constant_matrices_are_those_of_appendix_b(sbs_paper):
    """K0 and K1 from eqs. [26], [27] written out for three blades; C1 at trim is 2 Omega a0 for constant coning."""
    point = trim(sbs_paper, cyclic_inflow=False)
    parts = linearize(sbs_paper, point=point, method="paper").blocks
    omega = sbs_paper.rotors[0].speed
    psi = np.radians([20.0, 140.0, 260.0])
    to_blades = np.stack([np.ones(3), -np.cos(psi), -np.sin(psi)], axis=1)
    k1 = np.linalg.solve(to_blades, 2 * omega * np.stack([0 * psi, np.sin(psi), -np.cos(psi)], axis=1))
    k0 = np.linalg.solve(to_blades, omega**2 * np.stack([0 * psi, np.cos(psi), np.sin(psi)], axis=1))
    for name, expected in (("K1_beta", k1), ("K0_beta", k0), ("K1_xi", k1), ("K0_xi", k0)):
        np.testing.assert_allclose(parts[name][:3, :3], expected, atol=1e-8 * omega**2)
        np.testing.assert_allclose(parts[name][3:, 3:], expected, atol=1e-8 * omega**2)
        assert not parts[name][:3, 3:].any()
    coning = point.state[point.state_names.index("a0(1)")]
    np.testing.assert_allclose(parts["C1_beta"][:3, :3], omega * np.sin(2 * coning) * np.eye(3), atol=1e-3)
    a2_over_a1 = parts["C1_beta"][0, 0] / -parts["C1_xi"][0, 0]
    assert 1.0 < a2_over_a1 < 1.1


def test_inflow_gain_is_glauerts_in_hover(sbs, hover):
    """Paper section 3.1: 33.5 and 126 rad/s are (3 pi/8) 2 lambda0 Omega and (45 pi/16) lambda0 Omega."""
    gain = linearize(sbs, point=hover, method="paper").blocks["C_lambda"]
    through = hover.state[hover.state_names.index("lambda0(1)")] * sbs.rotors[0].speed
    expected = -np.array([0.75 * math.pi, 45 * math.pi / 16, 45 * math.pi / 16]) * through
    np.testing.assert_allclose(gain, np.diag(np.tile(expected, 2)), atol=1e-3)


# -- symmetry and limits ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("condition", [{}, {"airspeed": 10.0}, {"airspeed": 8.0, "sideslip": 0.3, "turn_rate": 0.2}])
def test_mirrored_aircraft_has_the_mirrored_matrices(condition):
    """Rotors exchanged, signs turned: A and B are the images of each other."""
    data = aircraft_data()
    image = mirrored_data(data)
    for rotor in image["rotors"]:
        rotor["mixing"]["longitudinal_cyclic"]["differential_longitudinal_cyclic"] *= -1.0
    flipped = {key: -value if key in ("sideslip", "turn_rate") else value for key, value in condition.items()}
    here = linearize(Aircraft.from_dict(data), **condition)
    there = linearize(Aircraft.from_dict(image), **flipped)
    signs = np.array([-1.0 if name in MIRROR_BODY else 1.0 for name in here.state_names])
    size = np.abs(here.a).max()
    np.testing.assert_allclose(there.a, here.a * signs[:, None] * signs, rtol=1e-6, atol=1e-9 * size)
    np.testing.assert_allclose(there.b, here.b * signs[:, None] * MIRROR_CONTROLS, rtol=1e-6, atol=1e-6)


def test_symmetric_hover_separates_longitudinal_from_lateral():
    """Without the products of inertia and with mirrored rotors nothing lateral answers to what is longitudinal."""
    aircraft = build(body={"inertia": [[3.532, 0.0, -0.052], [0.0, 2.222, 0.0], [-0.052, 0.0, 5.342]]})
    model = linearize(aircraft).quasi_static()
    lateral = [name in MIRROR_BODY for name in model.state_names]
    sides = np.array([-1.0 if side else 1.0 for side in lateral])
    mixed = model.a[np.outer(sides, sides) < 0]
    assert np.abs(mixed).max() < 1e-6
    assert np.abs(model.b[np.outer(sides, MIRROR_CONTROLS) < 0]).max() < 1e-4


def test_hover_does_not_know_the_azimuth_and_forward_flight_does(hover_model, cruise):
    assert hover_model.azimuth_spread < 1e-6
    assert cruise.azimuth_spread > 1e-3
    assert cruise.spread.shape == (38, 42)


def test_hub_moments_damp_pitch_and_roll_alike(hover_model):
    """An axisymmetric rotor: dM/dq = dL/dp about the hub, with everything but the body settled."""
    settled = hover_model.quasi_static()
    damping = {}
    for output, motion in (("hub_moment_y", "q"), ("hub_moment_x", "p")):
        rows = [settled.output_names.index(f"{output}({j})") for j in (1, 2)]
        damping[motion] = settled.c[rows, settled.state_names.index(motion)].sum()
    assert damping["q"] < 0.0
    assert damping["p"] == pytest.approx(damping["q"], rel=0.01)


# -- what the model says of itself -----------------------------------------------------------------------------------


def test_states_are_the_papers(hover_model):
    assert hover_model.a.shape == (38, 38)
    assert hover_model.b.shape == (38, 4)
    assert hover_model.state_names[:8] == ("u", "w", "q", "theta", "v", "p", "phi", "r")
    assert hover_model.control_names == CONTROLS
    assert len(hover_model.state_units) == 38
    assert len(hover_model.steps) == 42


def test_states_that_the_fidelity_leaves_out_are_not_there(sbs):
    for lead_lag, cyclic_inflow, size in ((False, False, 22), (True, False, 34), (False, True, 26), (True, True, 38)):
        model = linearize(sbs, lead_lag=lead_lag, cyclic_inflow=cyclic_inflow)
        assert model.a.shape == (size, size)
        assert any("xi" in name for name in model.state_names) == lead_lag
        assert ("lambdac(2)" in model.state_names) == cyclic_inflow
        assert np.linalg.matrix_rank(model.a) == size


@pytest.mark.parametrize("blades", [[3, 4], [5, 5]])
def test_size_is_eight_and_the_sum_over_the_rotors(blades):
    chords = [0.153 / n for n in blades]
    rotors = [
        {"blades": n, "blade_mass": 0.1613 * 3 / n, "chord": {"root": chord, "tip": chord}}
        for n, chord in zip(blades, chords, strict=True)
    ]
    model = linearize(build(rotors=rotors))
    assert len(model.state_names) == 8 + sum(4 * n + 3 for n in blades)
    assert model.mode("heave subsidence").pole.real == pytest.approx(-0.51, abs=0.05)


def test_outputs_follow_from_the_states(sbs, cruise):
    x, model = trimmed_state(sbs, cruise.trim), Model(sbs)
    rows = {name: cruise.output_names.index(name) for name in ("w", "climb_rate", "specific_force_z", "power(1)")}
    np.testing.assert_array_equal(cruise.c[rows["w"]], np.eye(38)[1])
    assert cruise.c[rows["climb_rate"], 1] == pytest.approx(-math.cos(cruise.trim.pitch) * math.cos(cruise.trim.roll))
    step = 0.05
    up, down = (model.averaged(x + sign * step * np.eye(len(x))[9], cruise.trim.swashplate) for sign in (1, -1))
    rotor = sbs.rotors[0]
    power = rotor.speed * (up[1] - down[1])[0, R.TORQUE] / (2 * step)
    assert cruise.c[rows["power(1)"], 1] == pytest.approx(power, rel=1e-6)
    assert cruise.c[rows["specific_force_z"], 1] == pytest.approx((up[0] - down[0])[9] / (2 * step), rel=1e-6)
    assert len(cruise.output_units) == len(cruise.output_names) == len(cruise.c) == len(cruise.d)


def test_climb_rate_in_a_turn_is_that_of_the_velocity_turned_to_the_earth(sbs):
    model = linearize(sbs, airspeed=10.0, climb_rate=1.0, turn_rate=0.3)
    row = model.c[model.output_names.index("climb_rate")]

    def climb_rate(linear):
        x = sbs.layout.from_linear(linear)
        return -(rotation_matrix(x[S.ATTITUDE : S.VELOCITY]) @ x[S.VELOCITY : S.RATES])[2]

    state, step = model.trim.state, 1e-5
    assert climb_rate(state) == pytest.approx(1.0)
    for i in range(len(state)):
        moved = step * np.eye(len(state))[i]
        slope = (climb_rate(state + moved) - climb_rate(state - moved)) / (2 * step)
        assert row[i] == pytest.approx(slope, abs=1e-8), model.state_names[i]


def test_what_the_fidelity_leaves_out_has_empty_columns(sbs):
    point = trim(sbs, lead_lag=False, cyclic_inflow=False)
    found = jacobians(sbs, point, np.zeros((1, 2)), difference_steps(sbs))[0]
    out = np.delete(np.arange(len(point.state)), used_states(point))
    assert {point.state_names[i] for i in out} >= {"xi0(1)", "dxic(2)", "lambdas(1)"}
    np.testing.assert_array_equal(found[:, out], 0.0)


def test_quasi_static_model_is_the_settled_rotor(sbs, hover, hover_model):
    """M_q with the rotors brought to rest by Newton's method at two pitch rates."""
    model, x = Model(sbs), trimmed_state(sbs, hover)
    rates = []
    for rate in (0.005, -0.005):
        moved = x.copy()
        moved[S.RATES + 1] = rate
        rates.append(model.averaged(model.settle(moved, hover.swashplate), hover.swashplate)[0][S.RATES + 1])
    expected = (rates[0] - rates[1]) / 0.01
    assert hover_model.derivatives()["M_q"] == pytest.approx(expected, rel=1e-3)


def test_quasi_static_outputs_are_those_of_the_settled_states(cruise):
    """For any body states and controls: the others follow from zero rates, and rates and outputs from all of them."""
    kept = ("q", "theta", "w", "phi", "r")
    reduced = cruise.quasi_static(kept)
    rng, names = np.random.default_rng(2), list(cruise.state_names)
    slow = [names.index(name) for name in kept]
    fast = [i for i in range(len(names)) if i not in slow]
    x, u = np.zeros(len(names)), rng.standard_normal(4)
    x[slow] = rng.standard_normal(len(kept))
    x[fast] = -np.linalg.solve(cruise.a[np.ix_(fast, fast)], cruise.a[fast] @ x + cruise.b[fast] @ u)
    rates, outputs = (cruise.a @ x + cruise.b @ u)[slow], cruise.c @ x + cruise.d @ u
    found_rates, found_outputs = (m @ x[slow] + n @ u for m, n in ((reduced.a, reduced.b), (reduced.c, reduced.d)))
    np.testing.assert_allclose(found_rates, rates, rtol=1e-9, atol=1e-9 * np.abs(rates).max())
    np.testing.assert_allclose(found_outputs, outputs, rtol=1e-9, atol=1e-9 * np.abs(outputs).max())
    assert reduced.state_names == kept
    assert reduced.state_units == ("rad/s", "rad", "m/s", "rad", "rad/s")


def test_derivatives_are_without_kinematics(sbs, cruise):
    found = cruise.derivatives()
    settled = cruise.quasi_static()
    u, w = cruise.trim.state[:2]
    names = settled.state_names
    assert found["Z_q"] == pytest.approx(settled.a[1, names.index("q")] - u)
    assert found["X_q"] == pytest.approx(settled.a[0, names.index("q")] + w)
    assert found["Y_r"] == pytest.approx(settled.a[4, names.index("r")] + u)
    assert found["M_longitudinal_cyclic"] == settled.b[2, 2] < 0.0  # a push lowers the nose
    held = cruise.derivatives(quasi_static=False)
    assert found["Z_w"] < held["Z_w"] < 0.0  # blades that are held in flap still swing freely: they carry little
    assert len(found) == 6 * (6 + 4)


def test_kinematics_are_the_derivative_of_the_rigid_body():
    """Against differences of the rigid body's equations at a state with everything in it."""
    rng = np.random.default_rng(1)
    inertia = np.array([[3.5, -0.1, -0.3], [-0.1, 2.2, 0.2], [-0.3, 0.2, 5.3]])
    state = rng.normal(size=8)

    def rates(values):
        u, w, q, theta, v, p, phi, r = values
        om = np.array([p, q, r])
        down = np.array([-math.sin(theta), math.sin(phi) * math.cos(theta), math.cos(phi) * math.cos(theta)])
        forward = 9.81 * down - np.cross(om, [u, v, w])
        turn = -np.linalg.solve(inertia, np.cross(om, inertia @ om))
        attitude = (
            q * math.cos(phi) - r * math.sin(phi),
            p + math.tan(theta) * (q * math.sin(phi) + r * math.cos(phi)),
        )
        return np.array([forward[0], forward[2], turn[1], attitude[0], forward[1], turn[0], attitude[1], turn[2]])

    expected = np.stack([(rates(state + 1e-6 * e) - rates(state - 1e-6 * e)) / 2e-6 for e in np.eye(8)], axis=1)
    np.testing.assert_allclose(kinematics(state, inertia, 9.81), expected, atol=1e-7)


def test_hash_is_that_of_the_physics(sbs, hover_model):
    assert hover_model.parameter_hash == Aircraft.load("sbs").parameter_hash
    assert hover_model.parameter_hash != build(body={"mass": 20.63}).parameter_hash
    assert hover_model.parameter_hash == build().parameter_hash  # names of rotors are not physics


# -- bad input -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "error", "text"),
    [
        ({"method": "exact"}, LinearizationError, "method = 'exact': allowed are averaged, paper"),
        ({"step_scale": 0.0}, LinearizationError, "step_scale = 0.0: allowed are 0.001 to 10"),
        ({"step_scale": math.nan}, LinearizationError, "step_scale = nan"),
        ({"azimuth_count": -3}, TrimError, "azimuth_count = -3: allowed are integers from 1 to 1000"),
        ({"airspeed": math.nan}, TrimError, "airspeed = nan"),
        ({"airspeed": 80.0}, TrimError, "residual"),
    ],
)
def test_bad_requests_are_named(sbs, arguments, error, text):
    with pytest.raises(error, match=text):
        linearize(sbs, **arguments)


def test_a_trim_of_another_aircraft_is_refused(sbs, hover):
    with pytest.raises(LinearizationError, match="it is one of another"):
        linearize(build(body={"mass": 30.0}), point=hover)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("airspeed", 15.0),
        ("airspeed", 0.0),
        ("climb_rate", 1.0),
        ("sideslip", 0.1),
        ("turn_rate", 0.1),
        ("lead_lag", False),
        ("cyclic_inflow", True),
        ("azimuth_count", 12),
    ],
)
def test_a_condition_beside_a_point_is_refused(sbs, hover, name, value):
    """The point has its own, and one of the two would not count."""
    with pytest.raises(LinearizationError) as caught:
        linearize(sbs, point=hover, **{name: value})
    assert str(caught.value) == f"{name} = {value}: not allowed with a point, which has its own"
    assert linearize(sbs, point=hover, method="paper", step_scale=0.5).method == "paper"


def test_one_azimuth_says_nothing_of_the_spread(sbs):
    assert math.isnan(linearize(sbs, azimuth_count=1).azimuth_spread)


def test_what_is_not_there_is_named(hover_model):
    with pytest.raises(KeyError, match="no mode 'flutter': there are spiral"):
        hover_model.mode("flutter")
    with pytest.raises(LinearizationError, match="kept = psi"):
        hover_model.quasi_static(["u", "psi"])


def test_settled_states_are_those_of_the_zero_rates():
    """Of x' = -2 x + 3 y + u, y' = 4 x - 5 y + 7 u with y = (4 x + 7 u) / 5 there is x' = 0.4 x + 5.2 u left."""
    a, b, by_state, by_control = settle(np.array([[-2.0, 3.0], [4.0, -5.0]]), np.array([[1.0], [7.0]]), [0])
    assert [float(part.item()) for part in (a, b, by_state, by_control)] == pytest.approx([0.4, 5.2, 0.8, 1.4])


def test_states_that_integrate_do_not_settle():
    with pytest.raises(LinearizationError, match="do not settle: their matrix is singular"):
        settle(np.array([[-1.0, 1.0], [1.0, 0.0]]), np.ones((2, 1)), [0])


# -- lag dampers of the aircraft that flies by default ---------------------------------------------------------------


def slowest_decay(aircraft):
    """Largest real part of a rotor mode from 0 to 20 m/s [1/s]."""
    rotor = ("flap", "lag", "coning", "inflow")
    return max(
        mode.pole.real
        for speed in np.arange(0.0, 20.1, 2.5)
        for mode in linearize(aircraft, airspeed=speed).modes
        if any(word in mode.name for word in rotor)
    )


def test_the_lag_dampers_are_the_least_with_which_every_rotor_mode_decays(sbs):
    assert slowest_decay(sbs) < -1.0
    assert slowest_decay(sbs.with_value("rotors.lag_damping", 0.98 * sbs.rotors[0].lag_damping)) > -1.0
    assert slowest_decay(sbs.with_value("rotors.lag_damping", 0.0)) > 0.0  # the paper's: it grows
