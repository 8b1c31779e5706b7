"""Modes: names that follow what takes part, whatever the order and the units of the states."""

import dataclasses
import math

import numpy as np
import pytest
from helpers import build

from sbs_sim import linearize, trim
from sbs_sim.analysis.modes import first_matrix_modes, modes
from sbs_sim.model.state import LINEAR_BODY_NAMES, StateLayout, part_of

BODY_MODES = ["short period", "phugoid", "heave", "roll", "Dutch roll", "spiral"]
CONDITIONS = {
    "hover": {},
    "hover, uniform inflow": {"cyclic_inflow": False},
    "hover, flap only": {"lead_lag": False, "cyclic_inflow": False},
    "10 m/s": {"airspeed": 10.0},
    "20 m/s": {"airspeed": 20.0},
    "turn": {"airspeed": 10.0, "turn_rate": 0.3},
    "sideways": {"airspeed": 6.0, "sideslip": math.pi / 2},
}


@pytest.fixture(scope="module")
def models(sbs):
    return {name: linearize(sbs, **condition) for name, condition in CONDITIONS.items()}


def same(one, other):
    """The same names at the same poles."""
    assert [mode.name for mode in one] == [mode.name for mode in other]
    for here, there in zip(one, other, strict=True):
        assert there.pole == pytest.approx(here.pole, rel=1e-6, abs=1e-6)


# -- invariance ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", CONDITIONS)
def test_order_of_the_states_does_not_matter(models, name):
    model, rng = models[name], np.random.default_rng(3)
    for _ in range(5):
        order = rng.permutation(len(model.state_names))
        shuffled = modes(model.a[np.ix_(order, order)], [model.state_names[i] for i in order])
        same(model.modes, shuffled)
        participation = np.zeros(len(order))
        participation[order] = shuffled[3].participation
        np.testing.assert_allclose(participation, model.modes[3].participation, atol=1e-6)


@pytest.mark.parametrize("name", CONDITIONS)
def test_units_of_the_states_do_not_matter(models, name):
    """Feet and degrees, and far worse."""
    model, rng = models[name], np.random.default_rng(4)
    for _ in range(5):
        scale = 10.0 ** rng.uniform(-3, 3, len(model.state_names))
        same(model.modes, modes(model.a * scale[:, None] / scale, model.state_names))


def test_participation_is_the_sensitivity_of_the_pole(models):
    """V_ki W_ik is d lambda / d a_kk: taken here from poles of changed matrices."""
    model = models["10 m/s"]
    mode = model.mode("Dutch roll")
    sensitivity = []
    for k in range(len(model.state_names)):
        nearest = []
        for change in (1e-5, -1e-5):
            moved = model.a.copy()
            moved[k, k] += change
            poles = np.linalg.eigvals(moved)
            nearest.append(poles[np.abs(poles - mode.pole).argmin()])
        sensitivity.append(abs(nearest[0] - nearest[1]) / 2e-5)
    np.testing.assert_allclose(mode.participation, np.array(sensitivity) / sum(sensitivity), atol=1e-3)


# -- names of the body's modes ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", CONDITIONS)
def test_every_body_mode_is_there_once(models, name):
    found = [mode.name for mode in models[name].modes]
    assert len(set(found)) == len(found)
    if name != "turn":  # where the phugoid may be two real poles
        body = [mode.split(" subsidence")[0].split(" divergence")[0] for mode in found]
        assert [body.count(wanted) for wanted in BODY_MODES] == [1] * 6


@pytest.mark.parametrize("name", ["hover", "hover, uniform inflow", "hover, flap only"])
def test_hover_modes_are_what_the_paper_calls_them(models, name):
    """Paper section 3.1: who takes part in which mode, and which of them oscillate."""
    model = models[name]

    def share(mode, *states):
        return sum(model.mode(mode).participation[model.state_names.index(state)] for state in states)

    assert share("phugoid", "u", "theta") > 0.5
    assert share("Dutch roll", "v", "phi") > 0.5
    assert share("heave subsidence", "w") > 0.9
    assert share("short period", "q") > 0.5
    assert share("roll", "p") > 0.5
    assert share("spiral", "r") > 0.9
    body = ("short period", "phugoid", "heave subsidence", "roll", "Dutch roll", "spiral")
    assert {mode for mode in body if model.mode(mode).is_oscillatory} == {"phugoid", "Dutch roll"}


def test_quasi_static_poles_have_the_names_of_the_full_ones(models):
    for model in models.values():
        reduced = model.quasi_static()
        for mode in reduced.modes:
            assert mode.pole == pytest.approx(model.mode(mode.name).pole, rel=0.25, abs=0.1)


def longitudinal(m_u, m_q=-4.0, z_w=-0.5, m_w=0.0, u0=0.0):
    """State matrix of u, w, q, theta and of a plain lateral part, in LINEAR_BODY_NAMES order."""
    a = np.zeros((8, 8))
    a[0, [0, 3]] = -0.03, -9.81
    a[1, [1, 2]] = z_w, u0
    a[2, [0, 1, 2]] = m_u, m_w, m_q
    a[3, 2] = 1.0
    a[4, [4, 6]] = -0.03, 9.81  # v
    a[5, [4, 5]] = -0.5, -4.0  # p
    a[6, 5] = 1.0
    a[7, 7] = -0.1
    return a


def names_of(a):
    return {mode.name: mode for mode in modes(a, LINEAR_BODY_NAMES)}


def test_phugoid_of_two_real_poles_keeps_its_name():
    """With M_u < 0 it diverges in one of two real poles, as in the paper's Table 4."""
    pair, real = names_of(longitudinal(0.5)), names_of(longitudinal(-0.1))
    assert pair["phugoid"].is_oscillatory
    assert real["phugoid (+)"].pole.real > 0.0 > real["phugoid (-)"].pole.real
    for found in (pair, real):
        assert found["heave subsidence"].pole == pytest.approx(-0.5)
        assert found["short period"].pole.real < -3.0


def test_dutch_roll_of_two_real_poles_keeps_its_name():
    a = longitudinal(0.5)
    assert names_of(a)["Dutch roll"].is_oscillatory
    a[5, 4] = 0.1  # L_v of the other sign
    real = names_of(a)
    assert real["Dutch roll (+)"].pole.real > 0.0 > real["Dutch roll (-)"].pole.real
    assert real["spiral"].pole == pytest.approx(-0.1)
    assert real["roll"].pole.real < -3.0


def test_short_period_of_forward_flight_is_a_pair():
    """With M_w < 0 and speed, w and q oscillate together and heave has no pole of its own."""
    found = names_of(longitudinal(0.02, m_q=-2.0, m_w=-0.5, u0=20.0))
    assert found["short period"].is_oscillatory
    assert found["short period"].frequency > 2.0
    assert "heave subsidence" not in found
    assert found["phugoid"].frequency < 1.0
    real = names_of(longitudinal(0.02, m_q=-9.0, m_w=-0.01, u0=20.0))
    assert not real["short period"].is_oscillatory
    assert "heave subsidence" in real


# -- names of the rotors' modes --------------------------------------------------------------------------------------


def test_rotor_modes_have_the_frequencies_of_their_names(sbs, models):
    """At nu - 1, nu, nu + 1 per revolution: flap 1.237, lag 0.490 (theory.md section 3), and damping by the air."""
    omega = sbs.rotors[0].speed
    model = models["hover"]
    for kind in ("symmetric", "antisymmetric"):
        for name, expected in (
            ("regressing flap", 0.237),
            ("coning", 1.237),
            ("advancing flap", 2.237),
            ("collective lag", 0.490),
            ("regressing lag", 0.510),
            ("advancing lag", 1.490),
        ):
            found = model.mode(f"{name}, {kind}")
            assert found.pole.imag / omega == pytest.approx(expected, abs=0.08), name
            family = "lag" if "lag" in name else "flap"
            share = sum(
                share
                for share, state in zip(found.participation, model.state_names, strict=True)
                if part_of(state).family == family
            )
            assert share > 0.7
    inflow = [mode for mode in model.modes if "inflow" in mode.name]
    assert sum(1 + mode.is_oscillatory for mode in inflow) == 6


@pytest.mark.parametrize(
    "condition",
    [{"airspeed": 10.0, "sideslip": 0.5}, {"airspeed": 15.0, "turn_rate": 0.5}, {"airspeed": 18.0, "sideslip": 0.8}],
)
def test_regressing_is_slow_and_advancing_fast_whoever_has_the_mode(sbs, condition):
    """Also where some modes are one rotor's and others are both rotors'."""
    omega = sbs.rotors[0].speed
    found = [mode for mode in linearize(sbs, **condition).modes if "lag" in mode.name or "flap" in mode.name]
    assert sum("advancing" in mode.name for mode in found) == sum("regressing" in mode.name for mode in found) == 4
    for mode in found:
        assert ("advancing" not in mode.name) or mode.pole.imag > omega
        assert ("regressing" not in mode.name) or mode.pole.imag < omega


def test_rotors_of_nearly_one_speed_keep_the_names():
    model = linearize(build(rotors=[{"speed_rpm": 2395.0}, {}]))
    for mode in model.modes:
        assert ("advancing" not in mode.name) or mode.pole.imag > 300.0
        assert ("regressing" not in mode.name) or mode.pole.imag < 200.0


def test_one_rotor_of_its_own_has_its_number(sbs):
    """A slower rotor does not move with the other one."""
    aircraft = build(rotors=[{}, {"speed_rpm": 2000.0}])
    found = {mode.name for mode in linearize(aircraft).modes}
    assert {"coning, rotor 1", "coning, rotor 2", "advancing lag, rotor 2"} <= found


@pytest.mark.parametrize(("blades", "extra"), [(4, "differential"), (5, "regressing flap 2")])
def test_more_blades_have_more_modes(blades, extra):
    chord = 0.153 / blades
    aircraft = build(
        every_rotor={"blades": blades, "blade_mass": 0.4839 / blades, "chord": {"root": chord, "tip": chord}}
    )
    found = linearize(aircraft).modes
    assert any(extra in mode.name for mode in found)
    assert sum(1 + mode.is_oscillatory for mode in found) == 8 + 2 * (4 * blades + 3)


def test_heavily_damped_flap_keeps_its_name():
    """A rotor matrix whose coning has two real poles and whose regressing flap has too."""
    names = ("a0(1)", "da0(1)", "a1(1)", "b1(1)", "da1(1)", "db1(1)")
    omega, damping = 1.0, 4.0
    a = np.zeros((6, 6))
    a[0, 1], a[1, 0], a[1, 1] = 1.0, -1.0, -damping
    # rotating b'' = -b - damping b' seen in fixed axes: theory.md section 1
    a[2, 4] = a[3, 5] = 1.0
    a[4] = [0, 0, omega**2 - 1.0, -damping * omega, -damping, -2 * omega]
    a[5] = [0, 0, damping * omega, omega**2 - 1.0, 2 * omega, -damping]
    found = {mode.name: mode for mode in modes(a, names)}
    rotating = np.sort(np.roots([1.0, damping, 1.0]))
    assert found["coning (-)"].pole.real == pytest.approx(rotating[0])
    assert found["coning (+)"].pole.real == pytest.approx(rotating[1])
    assert sum("flap" in name for name in found) == 2


def test_a_regressing_flap_that_does_not_oscillate_is_told_from_the_advancing_one():
    """Rotating at one per revolution it stands still in fixed axes: two real poles, told apart by unequal springs."""
    omega, damping, unequal = 1.0, 0.5, 0.1
    stiffness = 1.0 + damping**2 / 4.0  # so that the damped frequency is one per revolution
    a = np.zeros((4, 4))
    a[0, 2] = a[1, 3] = 1.0
    a[2] = [omega**2 - stiffness + unequal, -damping * omega, -damping, -2 * omega]
    a[3] = [damping * omega, omega**2 - stiffness - unequal, 2 * omega, -damping]
    assert sum(abs(np.linalg.eigvals(a).imag) < 1e-9) == 2
    found = modes(a, ("a1(1)", "b1(1)", "da1(1)", "db1(1)"))
    assert sorted(mode.name for mode in found) == ["advancing flap", "regressing flap (+)", "regressing flap (-)"]


def test_more_than_two_modes_of_a_name_are_numbered_slowest_first():
    """The inflows of three rotors that all act on each other belong to none of them."""
    coupled = np.array([[0.0, 0.5, 0.2], [0.5, 0.0, 0.4], [0.2, 0.4, 0.0]]) - 2.0 * np.eye(3)
    found = modes(coupled, [f"lambda0({rotor})" for rotor in (1, 2, 3)])
    assert [mode.name for mode in found] == [f"uniform inflow {number}" for number in (1, 2, 3)]
    np.testing.assert_allclose([mode.pole.real for mode in found], np.sort(np.linalg.eigvalsh(coupled))[::-1])


def test_first_matrix_has_the_names_of_table_5(sbs_paper):
    point = trim(sbs_paper, cyclic_inflow=False)
    model = linearize(sbs_paper, point=point, method="paper")
    rotor = [name for name in model.state_names if part_of(name).family in ("flap", "lag")]
    found = {mode.name: mode for mode in first_matrix_modes(model.blocks["A_R_first"], rotor)}
    omega = sbs_paper.rotors[0].speed
    for j in (1, 2):
        slow = found[f"coupled collective, rotor {j}"].pole.imag
        assert found[f"coupled advancing, rotor {j}"].pole.imag == pytest.approx(omega + slow, rel=1e-9)
        assert found[f"coupled regressing, rotor {j}"].pole.imag == pytest.approx(omega - slow, rel=1e-9)
        for name in ("non-uniform disc tilt", "non-uniform lag"):
            assert found[f"{name}, rotor {j}"].pole.imag == pytest.approx(omega, rel=1e-9)
        for name in ("collective flap", "collective lag"):
            assert abs(found[f"{name}, rotor {j}"].pole) < 1e-6
    assert sum(1 + mode.is_oscillatory for mode in found.values()) == 24 - 4 + 4


def test_first_matrix_of_rotors_of_two_speeds_has_the_names_of_each():
    aircraft = build("sbs_paper", rotors=[{}, {"speed_rpm": 2000.0}])
    model = linearize(aircraft, cyclic_inflow=False, method="paper")
    rotor = [name for name in model.state_names if part_of(name).family in ("flap", "lag")]
    found = {mode.name: mode for mode in first_matrix_modes(model.blocks["A_R_first"], rotor)}
    for j, own in enumerate(aircraft.rotors, 1):
        for name in ("non-uniform disc tilt", "non-uniform lag"):
            mode = found[f"{name}, rotor {j}"]
            assert mode.pole.imag == pytest.approx(own.speed, rel=1e-9)
            others = [i for i, state in enumerate(rotor) if part_of(state).rotor != j - 1]
            np.testing.assert_array_equal(mode.participation[others], 0.0)


def test_first_matrix_names_do_not_depend_on_order_and_units(sbs_paper):
    point = trim(sbs_paper, cyclic_inflow=False)
    model = linearize(sbs_paper, point=point, method="paper")
    rotor = [name for name in model.state_names if part_of(name).family in ("flap", "lag")]
    a, rng = model.blocks["A_R_first"], np.random.default_rng(5)
    expected = sorted((mode.name, round(mode.pole.imag, 4)) for mode in first_matrix_modes(a, rotor))
    for _ in range(5):
        order = rng.permutation(len(rotor))
        scale = 10.0 ** rng.uniform(-2, 2, len(rotor))
        changed = (a * scale[:, None] / scale)[np.ix_(order, order)]
        found = first_matrix_modes(changed, [rotor[i] for i in order])
        assert sorted((mode.name, round(mode.pole.imag, 4)) for mode in found) == expected


# -- figures of a mode -----------------------------------------------------------------------------------------------


def test_figures_of_a_mode():
    a = longitudinal(0.5)
    found = names_of(a)
    phugoid, heave = found["phugoid"], found["heave subsidence"]
    assert phugoid.frequency == pytest.approx(abs(phugoid.pole))
    assert phugoid.damping == pytest.approx(-phugoid.pole.real / abs(phugoid.pole))
    assert phugoid.period == pytest.approx(2 * math.pi / phugoid.pole.imag)
    assert heave.damping == 1.0
    assert heave.period == math.inf
    assert heave.time_to_half == pytest.approx(math.log(2) / 0.5)
    assert heave.time_to_double == math.inf
    growing = dataclasses.replace(heave, pole=0.5 + 0j)
    assert growing.time_to_double == pytest.approx(math.log(2) / 0.5)
    assert growing.time_to_half == math.inf
    still = dataclasses.replace(heave, pole=0j)
    assert still.time_to_half == still.time_to_double == still.period == math.inf
    assert still.damping == 0.0
    np.testing.assert_allclose(a @ phugoid.vector, phugoid.pole * phugoid.vector, atol=1e-9)
    assert np.abs(phugoid.vector).max() == pytest.approx(1.0)
    assert phugoid.participation.sum() == pytest.approx(1.0)


def test_every_linear_state_is_known():
    for blades in ((3,), (4, 5), (3, 3, 8)):
        layout = StateLayout(blades)
        parts = [part_of(name) for name in layout.linear_names]
        for rotor, count in enumerate(blades):
            for family, rate in (("flap", False), ("flap", True), ("lag", False), ("lag", True)):
                own = [part for part in parts if (part.family, part.rotor, part.is_rate) == (family, rotor, rate)]
                assert len(own) == count
            inflow = [part.harmonic for part in parts if (part.family, part.rotor) == ("inflow", rotor)]
            assert inflow == [0, 1, 1]


@pytest.mark.parametrize("name", ["x", "a0", "lambda0", "xi1(1)", "psi", ""])
def test_unknown_states_are_refused(name):
    with pytest.raises(ValueError, match="no linear state is called"):
        modes(np.zeros((1, 1)), [name])


def test_wrong_shape_is_refused():
    with pytest.raises(ValueError, match="2 state names for a matrix of shape"):
        modes(np.zeros((3, 3)), ["u", "w"])
