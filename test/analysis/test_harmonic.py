"""Periodic models, their harmonics, and the adaptive number of instants of Floquet's method."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.optimize import brentq

from sbs_sim import linearize, simulate, trim
from sbs_sim.analysis.floquet import floquet
from sbs_sim.analysis.harmonic import PeriodicModel, periodic_model
from sbs_sim.errors import LinearizationError
from sbs_sim.flight.engine import points_engine
from sbs_sim.model import records as R
from sbs_sim.model import state as S

# Characteristic values of Mathieu's equation y'' + (a - 2 q cos 2t) y = 0 for q = 1: a_0, b_1, a_1, b_2, a_2
# (M. Abramowitz, I. A. Stegun, Handbook of Mathematical Functions, 1964, chapter 20), and whether their solutions have
# the period pi (1) or 2 pi (-1).
MATHIEU = ((-0.45513860, 1), (-0.11024882, -1), (1.85910807, -1), (3.91702477, 1), (4.37130098, 1))


def mathieu(value, q=1.0, count=256):
    times = math.pi * np.arange(count) / count
    a = np.zeros((count, 2, 2))
    a[:, 0, 1], a[:, 1, 0] = 1.0, -(value - 2.0 * q * np.cos(2.0 * times))
    return PeriodicModel(math.pi, a, np.zeros((count, 2, 1)), np.zeros((count, 1, 2)), np.zeros((count, 1, 1)))


@pytest.fixture(scope="module")
def cruise(sbs):
    return trim(sbs, 20.0)


@pytest.fixture(scope="module")
def periodic(sbs, cruise):
    return periodic_model(sbs, cruise, 192)


@pytest.mark.parametrize(("value", "sign"), MATHIEU)
def test_mathieu_by_transition_and_by_harmonics(value, sign):
    """The mean of both multipliers, cosh(exponent period), passes 1 or -1 at a characteristic value."""

    def by_transition(a):
        return mathieu(a).floquet.multipliers.sum().real / 2.0 - sign

    def by_harmonics(a):
        poles = mathieu(a).harmonic(8).poles
        exponent = poles[np.abs(poles.imag).argmin()]
        return np.cosh(exponent * math.pi).real - sign

    assert brentq(by_transition, value - 0.05, value + 0.05, xtol=1e-12) == pytest.approx(value, abs=1e-7)
    assert brentq(by_harmonics, value - 0.05, value + 0.05, xtol=1e-12) == pytest.approx(value, abs=1e-8)


def test_harmonics_converge_to_the_exponents(periodic):
    exponents = periodic.floquet.exponents
    errors = [np.abs(periodic.harmonic(n).exponents(exponents) - exponents).max() for n in (0, 1, 2)]
    assert errors[0] > 0.05
    assert errors[1] < 1e-3 * errors[0]
    assert errors[2] < 1e-3 * errors[0]


def test_every_exponent_is_there_once_for_each_harmonic(periodic):
    """Poles of the model of harmonics are exponents + i k frequency; the outermost are cut off."""
    model = periodic.harmonic(3)
    for shift in (-1, 0, 1):
        wanted = periodic.floquet.exponents + 1j * shift * periodic.frequency
        assert np.abs(model.exponents(wanted) - wanted).max() < 2e-3


def test_real_coefficients_have_the_same_poles(periodic):
    model = periodic.harmonic(1)
    size = len(periodic.state_names)
    assert model.a.shape == (3 * size, 3 * size)
    assert model.names[size] == f"{periodic.state_names[0]}[1c]"
    ours = np.linalg.eigvals(model.a)
    assert max(np.abs(ours - pole).min() for pole in model.poles) < 1e-6 * np.abs(model.poles).max()


def test_without_harmonics_it_is_the_averaged_model(sbs, periodic, cruise):
    model = periodic.harmonic(0)
    averaged = linearize(sbs, point=cruise)
    np.testing.assert_allclose(model.a, periodic.a.mean(axis=0), atol=1e-9)
    np.testing.assert_allclose(model.a, averaged.a, rtol=1e-3, atol=1e-2 * np.abs(averaged.a).max())
    assert model.output_names == averaged.output_names


def rocking(times):
    """A periodic system of two states with one control, of frequency 3 rad/s."""
    wave, other = np.cos(3.0 * times), np.sin(6.0 * times)
    a = np.zeros((*np.shape(times), 2, 2))
    a[..., 0, 1], a[..., 1, 0], a[..., 1, 1] = 1.0, -4.0 - 0.8 * wave, -0.6 + 0.3 * other
    b = np.zeros((*np.shape(times), 2, 1))
    b[..., 1, 0] = 1.0 + 0.5 * wave
    return a, b


@pytest.fixture(scope="module")
def rocking_model():
    period = 2.0 * math.pi / 3.0
    a, b = rocking(period * np.arange(64) / 64)
    c = np.zeros((64, 1, 2))
    c[:, 0, 0] = 1.0 + np.sin(2.0 * math.pi * np.arange(64) / 64)
    return PeriodicModel(period, a, b, c, np.zeros((64, 1, 1)), ("x", "v"), ("push",), ("seen",))


def test_coefficients_give_the_motion(rocking_model):
    """A step of the control: the time-invariant model, put together again, is the periodic one."""
    model, duration = rocking_model.harmonic(6), 4.0

    def slopes(time, state):
        a, b = rocking(np.asarray(time))
        return a @ state + b[:, 0]

    truth = solve_ivp(slopes, (0.0, duration), [0.0, 0.0], rtol=1e-10, atol=1e-12).y[:, -1]
    extended = np.zeros((len(model.a) + 1,) * 2)
    extended[:-1, :-1], extended[:-1, -1] = model.a, model.b[:, 0]
    coefficients = expm(extended * duration)[:-1, -1]
    np.testing.assert_allclose(model.value(coefficients, duration), truth, rtol=1e-6)
    seen = model.value(model.c @ coefficients + model.d[:, 0], duration)
    assert seen[0] == pytest.approx(truth[0] * (1.0 + math.sin(3.0 * duration)), rel=1e-5)


def test_response_has_the_sidebands(rocking_model):
    """The forced motion under exp(i w t) is a sum of exponentials of w + k times the frequency."""
    model, frequency = rocking_model.harmonic(6), 1.3
    amplitudes = {n: model.response("push", "seen", n, [frequency])[0] for n in range(-6, 7)}

    def slopes(time, state):
        a, b = rocking(np.asarray(time))
        return a @ state + b[:, 0] * np.exp(1j * frequency * time)

    end = 60.0
    truth = solve_ivp(slopes, (0.0, end), [0j, 0j], rtol=1e-9, atol=1e-11).y[0, -1] * (1.0 + math.sin(3.0 * end))
    ours = sum(value * np.exp(1j * (frequency + 3.0 * n) * end) for n, value in amplitudes.items())
    assert ours == pytest.approx(truth, rel=1e-4)


@pytest.mark.parametrize("count", [-1, 16])
def test_more_harmonics_than_instants_resolve_are_refused(rocking_model, count):
    with pytest.raises(LinearizationError, match=f"harmonics = {count}: allowed are integers from 0 to 15"):
        rocking_model.harmonic(count)


def test_instants_are_as_many_as_the_error_needs(sbs, cruise, hover):
    """The estimate is above the error; hover, which does not change with the azimuth, needs few."""
    assert floquet(sbs, hover).azimuth_count == 48
    found, fine = floquet(sbs, cruise), floquet(sbs, cruise, 768)
    assert found.azimuth_count > 48
    assert found.is_settled
    assert np.abs(found.exponents - fine.exponents).max() < found.error.max() < 1e-4


# -- vibrations ------------------------------------------------------------------------------------------------------

SEAT = np.array([0.3, 0.1, -0.2])
LOAD_NAMES = [f"hub_{kind}_{axis}({rotor})" for rotor in (1, 2) for kind in ("force", "moment") for axis in "xyz"]
FORCE_NAMES = [f"specific_force_{axis}{where}" for where in ("", "(seat)") for axis in "xyz"]
TICKS = 16  # of a period


@pytest.fixture(scope="module")
def seated(periodic):
    return periodic.with_points({"seat": SEAT}).harmonic(2)


def flown(aircraft, point, start, controls, periods, period):
    """Hub loads and specific forces of the nonlinear model over the last of some periods, with its times."""
    tick = period / TICKS
    flight = simulate(
        aircraft, start, controls, periods * period, tick=tick, method="rk4", azimuth_step=np.radians(4.0)
    )
    engine, rows = points_engine(aircraft.arranged(True, True, "points")), []
    last = slice(-TICKS - 1, -1)
    for state, own, time in zip(flight["state"][last], flight["controls"][last], flight["time"][last], strict=True):
        rates, loads = engine.average(state, aircraft.mix(own), (point.rotor_speed * time)[np.newaxis])
        turn, turning = state[S.RATES : S.RATES + 3], rates[S.RATES : S.RATES + 3]
        seat = rates[-3:] + np.cross(turning, SEAT) + np.cross(turn, np.cross(turn, SEAT))
        rows.append([*loads[:, [R.FORCE, R.FORCE + 1, R.FORCE + 2, R.MOMENT, R.MOMENT + 1, R.MOMENT + 2]].ravel()])
        rows[-1] += [*rates[-3:], *seat]
    return np.array(rows), flight["time"][last]


def amplitude(rows, times, frequency):
    """Complex amplitude of a frequency over a period."""
    return 2.0 * np.mean(rows * np.exp(-1j * frequency * times)[:, None], axis=0)


def assert_alike(ours, theirs, tolerance, least):
    """Amplitudes and phases of what is not small beside the largest of its kind: forces, moments, specific forces."""
    names = np.array([*LOAD_NAMES, *FORCE_NAMES])
    for kind in ("hub_force", "hub_moment", "specific_force"):
        own = np.char.startswith(names, kind)
        large = np.abs(theirs[own]) > least * np.abs(theirs[own]).max()
        assert large.sum() >= 2
        wrong = np.abs(ours[own] - theirs[own]) / np.abs(theirs[own])
        assert wrong[large].max() < tolerance, dict(zip(names[own][large], wrong[large], strict=True))


@pytest.fixture(scope="module")
def settled_flight(sbs, cruise, seated):
    """The nonlinear model in the vibrations of its steady flight, controls held."""
    start = sbs.layout.from_linear(cruise.state + seated.steady_states.sum(axis=0).real)
    period = 2.0 * math.pi / seated.frequency
    return start, period, flown(sbs, cruise, start, cruise.controls, 30, period)


def columns(model):
    return [model.output_names.index(name) for name in (*LOAD_NAMES, *FORCE_NAMES)]


def test_steady_vibrations_are_those_of_the_nonlinear_model(seated, settled_flight):
    """Hub loads and accelerations at 3/rev, after a quarter of a second in which controls were held."""
    _, _, (rows, times) = settled_flight
    theirs = amplitude(rows, times, seated.frequency)
    assert_alike(seated.steady[1, columns(seated)], theirs, 0.01, 0.02)


@pytest.mark.parametrize("control", [0, 1])
def test_a_small_input_changes_the_vibrations_as_in_the_nonlinear_model(sbs, cruise, seated, settled_flight, control):
    """A step of 0.001 rad: what it adds at 3/rev after a quarter of a second, to 5 %, amplitude and phase together."""
    start, period, (without, times) = settled_flight
    moved = cruise.controls.copy()
    moved[control] += 1e-3
    rows, _ = flown(sbs, cruise, start, moved, 30, period)
    theirs = amplitude(rows - without, times, seated.frequency)
    size = len(seated.a)
    extended = np.zeros((size + 1, size + 1))
    extended[:size, :size], extended[:size, size] = seated.a, seated.b[:, control] * 1e-3
    state, forward = expm(extended * times[0])[:, size], expm(extended * (period / TICKS))
    ours = []
    for time in times:
        ours.append(seated.value(seated.c @ state[:size] + seated.d[:, control] * 1e-3, time)[columns(seated)])
        state = forward @ state
    assert_alike(amplitude(np.array(ours), times, seated.frequency), theirs, 0.05, 0.1)


def test_triangular_responses_are_those_of_the_equations(seated):
    frequencies = np.array([0.3, 7.0, 300.0, 755.0])
    row = seated.output_names.index("specific_force_z(seat)")
    for order in (-1, 0, 1):
        found = seated.response("collective", "specific_force_z(seat)", order, frequencies)
        for value, frequency in zip(found, frequencies, strict=True):
            state = np.linalg.solve(1j * frequency * np.eye(len(seated.hill)) - seated.hill, seated.hill_b[:, 0])
            at = (order + 2) * len(seated.output_names) + row
            assert value == pytest.approx(seated.hill_c[at] @ state + seated.hill_d[at, 0], rel=1e-7)


def test_the_centre_of_gravity_is_a_point(periodic):
    model = periodic.with_points({"here": (0.0, 0.0, 0.0)})
    names = model.output_names
    for axis in "xyz":
        own, there = (names.index(f"specific_force_{axis}{where}") for where in ("", "(here)"))
        np.testing.assert_array_equal(model.c[:, there], model.c[:, own])
        np.testing.assert_array_equal(model.values[:, there], model.values[:, own])


def test_a_turn_presses_outwards(sbs):
    """In a steady turn a point ahead of the c.g. has the centripetal acceleration of the turn more."""
    point = trim(sbs, 10.0, turn_rate=0.4)
    model = periodic_model(sbs, point, 48).with_points({"nose": (1.0, 0.0, 0.0)})
    rate = point.state[[S.LINEAR_P, S.LINEAR_Q, S.LINEAR_R]]
    names = model.output_names
    more = [
        model.values[:, names.index(f"specific_force_{axis}(nose)")].mean()
        - model.values[:, names.index(f"specific_force_{axis}")].mean()
        for axis in "xyz"
    ]
    np.testing.assert_allclose(more, np.cross(rate, np.cross(rate, [1.0, 0.0, 0.0])), atol=1e-5)


def test_points_are_checked(rocking_model, periodic):
    with pytest.raises(LinearizationError, match=r"points\.seat: allowed are three numbers, it has the shape \(2,\)"):
        periodic.with_points({"seat": (1.0, 2.0)})
    with pytest.raises(LinearizationError, match="allowed are models with the states p, q and r, this has no p"):
        rocking_model.with_points({"seat": (1.0, 2.0, 3.0)})
    with pytest.raises(LinearizationError, match="steady: allowed are models with the values"):
        _ = rocking_model.harmonic(1).steady


def test_harmonics_can_be_saved(seated, tmp_path):
    seated.state_space.save(tmp_path / "harmonics.npz")
    read = np.load(tmp_path / "harmonics.npz")
    np.testing.assert_array_equal(read["a"], seated.a)
    theirs = seated.state_space.to_control()
    assert theirs.nstates == len(seated.names)
    assert "specific_force_z(seat)[1c]" in seated.harmonic_outputs
