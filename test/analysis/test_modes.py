"""Modes: names that follow what takes part, whatever the order and the units of the states."""

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest
from helpers import build

from sbs_sim import Aircraft, linearize, sweep, trim
from sbs_sim.analysis.linear_model import growing_rotor_modes_text
from sbs_sim.analysis.modes import Mode, first_matrix_modes, modes
from sbs_sim.model.state import LINEAR_BODY_NAMES, StateLayout, part_of

BODY_MODES = ["short period", "phugoid", "heave", "roll", "Dutch roll", "spiral"]
PITCH_DIVERGES = ("10 m/s", "20 m/s")  # where M_w > 0
CONDITIONS = {
    "hover": {},
    "hover, uniform inflow": {"cyclic_inflow": False},
    "hover, flap only": {"lead_lag": False, "cyclic_inflow": False},
    "10 m/s": {"airspeed": 10.0},
    "20 m/s": {"airspeed": 20.0},
    "turn": {"airspeed": 10.0, "turn_rate": 0.3},
    "sideways": {"airspeed": 6.0, "sideslip": math.pi / 2},
}


DATA = Path(__file__).resolve().parents[1] / "data"
LONGITUDINAL, LATERAL = {"u", "w", "q", "theta"}, {"v", "p", "phi", "r"}
OF_LONGITUDINAL = ("phugoid", "short period", "heave", "pitch")
OF_LATERAL = ("Dutch roll", "roll", "spiral", "yaw")


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
        wanted = [
            mode.replace("heave", "pitch divergence" if name in PITCH_DIVERGES else "heave subsidence")
            for mode in BODY_MODES
        ]
        assert [found.count(mode) for mode in wanted] == [1] * 6


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


def leading(mode, state_names):
    """States with their shares, the largest first."""
    return sorted(zip(state_names, mode.participation, strict=True), key=lambda item: -item[1])


def halves(mode, state_names):
    """Halves of the body, "longitudinal" and "lateral", that have the leading state or one that comes near to it."""
    shares = dict(leading(mode, state_names))
    largest = {
        half: max(shares[name] for name in names)
        for half, names in (("longitudinal", LONGITUDINAL), ("lateral", LATERAL))
    }
    return {half for half, share in largest.items() if share >= 0.8 * max(largest.values())}


def said_halves(name):
    """Halves of the body that a name speaks of."""
    words = {"longitudinal": OF_LONGITUDINAL, "lateral": OF_LATERAL}
    return {half for half, own in words.items() if any(name.startswith(word) or f"-{word}" in name for word in own)}


@pytest.mark.parametrize("file", ["sbs", "tandem", "tail_rotor"])
def test_names_agree_with_what_takes_part_most(sbs, file):
    """Over the envelope, in strongly coupled flight too: family, rotor and half of the body."""
    aircraft = sbs if file == "sbs" else Aircraft.load(DATA / f"{file}.yaml")
    flights = [{"airspeed": speed} for speed in (-8.0, -4.0, -2.0, 0.0, 2.0, 5.0, 8.0, 15.0, 20.0)]
    flights += [{"climb_rate": rate} for rate in (-1.5, 3.0)]
    flights += [{"airspeed": 10.0, "turn_rate": 0.5}, {"airspeed": 6.0, "sideslip": -math.pi / 2}]
    for flight in flights:
        model = linearize(aircraft, **flight)
        assert len({mode.name for mode in model.modes}) == len(model.modes)
        for mode in model.modes:
            part = part_of(leading(mode, model.state_names)[0][0])
            assert mode.family == part.family, (flight, mode.name)
            if part.family == "body":
                assert mode.rotors == ()
                assert said_halves(mode.name) & halves(mode, model.state_names), (flight, mode.name)
            else:
                assert part.rotor + 1 in mode.rotors, (flight, mode.name)
                assert part.family in mode.name or (part.family == "flap" and "coning" in mode.name)


def test_body_modes_of_a_helicopter_with_a_tail_rotor():
    """In hover what grows is the phugoid, of u and theta before v and phi; with speed v and r are the Dutch roll."""
    aircraft = Aircraft.load(DATA / "tail_rotor.yaml")
    hover = linearize(aircraft)
    growing = [mode for mode in hover.modes if mode.pole.real > 0.0]
    assert [mode.name for mode in growing] == ["phugoid"]
    assert {name for name, _ in leading(growing[0], hover.state_names)[:2]} == {"u", "theta"}
    dutch_roll = hover.mode("Dutch roll")
    assert {name for name, _ in leading(dutch_roll, hover.state_names)[:2]} == {"v", "phi"}
    cruise = linearize(aircraft, airspeed=15.0)
    assert {name for name, _ in leading(cruise.mode("Dutch roll"), cruise.state_names)[:2]} == {"v", "r"}
    assert cruise.mode("Dutch roll").is_oscillatory
    # weathercock stability makes its frequency: the root of N_v U
    stiffness = cruise.derivatives()["N'_v"] * 15.0
    assert cruise.mode("Dutch roll").frequency == pytest.approx(math.sqrt(stiffness), rel=0.1)
    assert leading(cruise.mode("spiral"), cruise.state_names)[0][0] == "phi"
    # flown backward it is unstable like an arrow with its feathers in front
    backward = linearize(aircraft, airspeed=-10.0)
    assert backward.derivatives()["N'_v"] * -10.0 < -1.0
    assert backward.mode("yaw divergence").pole.real > 1.0


def test_what_m_w_makes_diverge_is_pitch(models):
    """Heave is damped (Z_w < 0); with M_w > 0 and speed the angle of attack runs away, as a pilot sees in pitch."""
    for name in PITCH_DIVERGES:
        model = models[name]
        known = model.derivatives()
        assert known["Z_w"] < 0.0 < known["M_w"]
        mode = model.mode("pitch divergence")
        assert not mode.is_oscillatory
        # the short period's determinant Z_w M_q - M_w (U + Z_q) is the product of its two poles
        determinant = known["Z_w"] * known["M_q"] - known["M_w"] * (model.trim.state[0] + known["Z_q"])
        settled = [model.quasi_static().mode(own).pole.real for own in ("pitch divergence", "short period")]
        assert math.prod(settled) == pytest.approx(determinant, rel=0.1)


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


def test_heave_diverges_only_by_itself():
    found = names_of(longitudinal(0.5, z_w=0.3))  # Z_w > 0: it climbs the more, the more it climbs
    assert found["heave divergence"].pole == pytest.approx(0.3)
    found = names_of(longitudinal(0.02, m_q=-2.0, m_w=0.5, u0=20.0))
    assert found["pitch divergence"].pole.real > 1.0
    assert not {"heave divergence", "heave subsidence"} & found.keys()
    # hardly beyond neutral it is still pitch
    found = names_of(longitudinal(0.0, m_q=-2.0, z_w=-0.5, m_w=0.06, u0=20.0))
    assert 0.0 < found["pitch divergence"].pole.real < 0.1


def test_a_nose_that_turns_away_from_the_wind_is_a_yaw_divergence():
    a = longitudinal(0.5)
    a[4, [4, 7]] = -0.2, -15.0  # v: the turning axes
    a[5, 4] = -0.05  # p: less of a dihedral
    a[7, [4, 7]] = -0.4, -1.0  # r: N_v < 0
    found = names_of(a)
    assert found["yaw divergence"].pole.real > 1.0
    assert found["Dutch roll"].pole.real < -2.0
    a[7, 4] = 0.4
    found = names_of(a)
    assert found["Dutch roll"].frequency == pytest.approx(math.sqrt(15.0 * 0.4), rel=0.1)
    assert not any("divergence" in name for name in found)


def test_heave_and_yaw_may_oscillate_together():
    a = longitudinal(0.5)
    a[1, [1, 7]] = -0.5, 0.4
    a[7, [1, 7]] = -0.4, -0.5
    assert names_of(a)["heave-yaw"].pole == pytest.approx(-0.5 + 0.4j)


# -- names of the rotors' modes --------------------------------------------------------------------------------------


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_neutral_mode_neither_halves_nor_doubles(sign):
    """A flap mode without air in between has a damping of rounding: no time is as long as this says."""
    none, some = (Mode("flap", complex(sign * real, 27.8), np.ones(1), np.ones(1)) for real in (1e-15, 1e-3))
    assert (none.time_to_half, none.time_to_double, none.is_growing) == (math.inf, math.inf, False)
    times = some.time_to_double, some.time_to_half
    assert sorted(times) == [pytest.approx(1e3 * math.log(2.0)), math.inf]
    assert math.isfinite(times[0]) is some.is_growing is (sign > 0)


def test_poles_of_a_model_that_does_not_oscillate_are_complex_numbers_too():
    found = modes(np.diag([-1.0, -3.0]), ["u", "w"])
    assert [mode.pole for mode in found] == [-1.0, -3.0]
    assert all(isinstance(mode.pole, complex) for mode in found)


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


def tail_rotor(**changes):
    """The helicopter with a tail rotor, whose tail rotor has other values."""
    aircraft = Aircraft.load(DATA / "tail_rotor.yaml")
    for key, value in changes.items():
        aircraft = aircraft.with_value(f"rotors.tail.{key}", value)
    return aircraft


def check_ranks(aircraft):
    """Cyclic modes of every rotor are at |nu - n| and nu + n of its own revolutions, nu by its collective modes."""
    model = linearize(aircraft)
    for number, rotor in enumerate(aircraft.rotors, 1):
        for family, collective in (("flap", "coning"), ("lag", "collective lag")):
            own = {mode.name: mode for mode in model.modes if (mode.family, mode.rotors) == (family, (number,))}
            assert len(own) == 1 + 2 * ((rotor.blades - 1) // 2) + (rotor.blades % 2 == 0)
            nu = abs(own[f"{collective}, rotor {number}"].pole) / rotor.speed
            for n in range(1, (rotor.blades - 1) // 2 + 1):
                suffix = f"{family} {n}" if n > 1 else family
                slow, fast = (own[f"{way} {suffix}, rotor {number}"] for way in ("regressing", "advancing"))
                # the hub takes part in the first harmonic, whose frequency it moves
                assert abs(fast.pole) / rotor.speed == pytest.approx(nu + n, rel=0.12)
                assert abs(slow.pole) / rotor.speed == pytest.approx(abs(nu - n), abs=0.12 * (nu + n))
                assert fast.pole.imag > slow.pole.imag
    return model


def test_rotor_modes_are_ranked_within_their_own_rotor():
    """The main rotor's advancing lag is slower than the regressing one of the tail rotor, which turns faster."""
    model = check_ranks(tail_rotor())
    main, tail = model.mode("advancing lag, rotor 1"), model.mode("regressing lag, rotor 2")
    assert main.pole.imag == pytest.approx(399.2, abs=0.5)  # 1.59 of its 251.3 rad/s
    assert tail.pole.imag == pytest.approx(498.2, abs=0.5)  # 0.53 of its 942.5 rad/s


@pytest.mark.parametrize("blades", [3, 4, 5])
@pytest.mark.parametrize("rotation", [1, -1])
def test_rotor_modes_of_a_tail_rotor_of_any_speed(blades, rotation):
    """Slower too, where its regressing flap is beyond one per revolution (nu > 2), and where poles of both cross."""
    large = {"radius": 0.25, "hub": [-1.2, 0.0, -0.1], "chord.root": 0.04, "chord.tip": 0.04}  # holds at 2000 rpm too
    for rpm in (1500.0, 2000.0, 2400.0, 5000.0):
        check_ranks(tail_rotor(blades=blades, rotation=rotation, speed_rpm=rpm, **large))
    for rpm in (4000.0, 7190.0, 9000.0):
        check_ranks(tail_rotor(blades=blades, rotation=rotation, speed_rpm=rpm))


def test_loci_follow_the_rotors():
    """The tail rotor's poles go with its speed through the main rotor's, which stay."""
    found = sweep(tail_rotor(), "rotors.tail.speed_rpm", np.linspace(6000.0, 9000.0, 9), workers=1)
    main, tail = found.loci["advancing lag, rotor 1"].imag, found.loci["regressing lag, rotor 2"].imag
    np.testing.assert_allclose(main, main[0], rtol=1e-3)
    np.testing.assert_allclose(tail / found.values, tail[0] / found.values[0], rtol=0.02)
    assert tail[0] < main[0] < tail[-1]


def test_growing_rotor_modes_are_reported(sbs):
    """Lag without a damper grows somewhere at speed, with one nowhere; what grows of the body is not a rotor's."""
    loose, damped = (linearize(sbs.with_value("rotors.lag_damping", value), airspeed=15.0) for value in (0.0, 0.5))
    assert any(mode.pole.real > 0.0 for mode in damped.modes)
    assert damped.growing_rotor_modes == ()
    assert growing_rotor_modes_text(damped, sbs) == "none"
    growing = [mode for mode in loose.modes if mode.pole.real > 0.0 and "lag" in mode.name]
    assert list(loose.growing_rotor_modes) == growing != []
    text = growing_rotor_modes_text(loose, sbs)
    assert text == f"{growing[0].name} at {growing[0].pole.real:.3g} ± {growing[0].pole.imag:.5g}i rad/s (MR1, MR2)"
    assert loose.to_dict()["growing_rotor_modes"] == [growing[0].name]
    # pitch that follows lag drives it, in the rotor without a damper
    driven = sbs.with_value("rotors.lag_damping", 0.0).with_value("rotors.MR1.lag_damping", 0.5)
    own = linearize(driven.with_value("rotors.MR2.pitch_lag_coupling", 0.3))
    assert [mode.rotors for mode in own.growing_rotor_modes] == [(2,)]
    assert growing_rotor_modes_text(own, driven).endswith(" rad/s (MR2)")


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


def test_a_regressing_flap_that_does_not_oscillate_is_distinguished_from_the_advancing_one():
    """Rotating at one per revolution it stands still in fixed axes: two real poles that differ by unequal springs."""
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


@pytest.mark.parametrize("name", ["north", "a0", "lambda0", "xi1(1)", "psi", ""])
def test_unknown_states_are_refused(name):
    with pytest.raises(ValueError, match="no linear state is called"):
        modes(np.zeros((1, 1)), [name])


def test_wrong_shape_is_refused():
    with pytest.raises(ValueError, match="2 state names for a matrix of shape"):
        modes(np.zeros((3, 3)), ["u", "w"])


def test_rotors_with_as_many_states_of_other_kinds_are_not_alike():
    """Six blades have as many states as four with the two of an unsteady airfoil each."""
    layout = StateLayout(blades=(6, 4), wakes=(False, True))
    names = layout.linear_names
    parts = [part_of(name) for name in names]
    sizes = [sum(part.rotor == rotor for part in parts) for rotor in (0, 1)]
    assert sizes[0] == sizes[1]
    found = modes(np.diag(-1.0 - np.arange(len(names))), names)
    by_pole = {round(-1.0 - mode.pole.real): mode for mode in found}
    for i, part in enumerate(parts):
        mode = by_pole[i]
        assert mode.family == part.family, names[i]
        assert mode.rotors in ((), (part.rotor + 1,)), names[i]
