"""Circulation that follows the flow late, against Theodorsen, Wagner, the plain reference and the model without it."""

import math

import numpy as np
import pytest
from helpers import Model, aircraft_data, build, write_airfoil
from plain_model import random_state
from scipy.integrate import trapezoid
from scipy.special import hankel2
from test_dynamics import largest_error, stand

from sbs_sim import Aircraft, linearize, simulate, trim
from sbs_sim.errors import AircraftError, SimulationError
from sbs_sim.flight.validity import blade_warnings
from sbs_sim.model import records as R
from sbs_sim.model import state as S
from sbs_sim.model.state import part_of

JONES = {"unsteady_airfoil": "jones"}
OPTIONS = {
    "both": {"every_rotor": JONES},
    "one rotor": {"rotors": [{}, JONES]},
    "four blades": {"every_rotor": {**JONES, "blades": 4}},
    "offsets": {"every_rotor": {**JONES, "quarter_chord": {"root": 0.005, "tip": -0.004}}},
    "sections": {"every_rotor": {**JONES, "profile_drag": "oblique", "tip_loss_model": "prandtl"}},
}
FAST_AIR = {"gravity": 0.0, "speed_of_sound": 1000.0}  # m/s, the largest: M^2 is 0.01 at three quarters of the radius
STEP = 1e-6


@pytest.mark.parametrize("name", OPTIONS)
def test_derivative_and_loads_equal_the_plain_reference(name):
    aircraft, rng = build(**OPTIONS[name]), np.random.default_rng(5)
    for size in (0.1, 1.0):
        x = random_state(aircraft, rng, size)
        case = x, rng.normal(scale=0.1, size=(2, 3)), rng.uniform(0, 6, 2), rng.normal(scale=8.0, size=3)
        assert largest_error(aircraft, case) < 1e-12


class Section:
    """Thrust of a rotor with rigid blades after changes of its pitch, in air that does not move: a thin airfoil.

    Attributes
    ----------
    a, b, c, d : ndarray, shapes (2, 2), (2,), (2,), ()
        z' = a z + b theta of the collective parts of the circulation, and thrust = c z + d theta.
    semi_chords : float
        That the section at three quarters of the radius goes in a second.
    """

    def __init__(self, folder):
        write_airfoil(folder / "lift.csv", lambda alpha: 2 * np.pi * np.sin(alpha), lambda _: 1e-6)
        aircraft = stand(environment=FAST_AIR, folder=folder, airfoil="lift", **JONES)
        self._model, rotor = Model(aircraft, lead_lag=False), aircraft.rotors[0]
        places = [pair[0] for pair in aircraft.layout.wake_pairs(0)[:1]], [aircraft.layout.wake_pairs(0)[0][1]]
        self._places = [places[0][0], places[1][0]]
        by_pitch, by_state = self._change(pitch=STEP), [self._change(place=place) for place in self._places]
        self.a = np.stack([rates for rates, _ in by_state], axis=1)
        self.c = np.array([thrust for _, thrust in by_state])
        self.b, self.d = by_pitch
        speed = 0.75 * rotor.speed * rotor.radius
        compressed = 1.0 - (speed / aircraft.environment.speed_of_sound) ** 2
        self.semi_chords = compressed * 2.0 * speed / rotor.chord_root

    def _change(self, pitch=0.0, place=None):
        """Rates of the collective parts, and thrust, over a small change."""
        found = []
        for sign in (1.0, -1.0):
            x = self._model.state()
            if place is not None:
                x[place] = sign * STEP
            rates = self._model.derivative(x, [[sign * pitch, 0.0, 0.0]])
            found.append(np.append(rates[self._places], self._model.loads[0, R.THRUST]))
        slopes = (found[0] - found[1]) / (2.0 * STEP)
        return slopes[:2], slopes[2]

    def response(self, k):
        """Thrust over that of pitch that changes slowly, at a reduced frequency."""
        inside = np.linalg.solve(1j * k * self.semi_chords * np.eye(2) - self.a, self.b)
        settled = self.d - self.c @ np.linalg.solve(self.a, self.b)
        return (self.d + self.c @ inside) / settled

    def step(self, s):
        """Thrust after a step of pitch over the settled one, s semi-chords later."""
        poles, vectors = np.linalg.eig(self.a)
        settled = -np.linalg.solve(self.a, self.b)
        grown = vectors @ np.diag(np.exp(poles * s / self.semi_chords)) @ np.linalg.solve(vectors, -settled) + settled
        return (self.d + self.c @ grown) / (self.d + self.c @ settled)


@pytest.fixture(scope="module")
def section(tmp_path_factory):
    """A thin airfoil."""
    return Section(tmp_path_factory.mktemp("section"))


def theodorsen(k):
    """C(k) by Hankel functions: T. Theodorsen, NACA report 496, 1935."""
    return hankel2(1, k) / (hankel2(1, k) + 1j * hankel2(0, k))


def wagner(s):
    """Lift after a step of the angle of attack, by the integral of C(k): I. E. Garrick, NACA report 629, 1938."""
    k = np.geomspace(1e-7, 400.0, 100001)
    return 0.5 + 2.0 / np.pi * trapezoid((theodorsen(k).real - 0.5) * np.sin(k * s), np.log(k))


@pytest.mark.parametrize("k", [0.01, 0.05, 0.1, 0.2, 0.4, 1.0, 3.0])
def test_lift_of_an_oscillation_is_that_of_theodorsen(section, k):
    """Two terms of Jones leave 0.015 of the lift of the same slow pitch."""
    assert abs(section.response(k) - theodorsen(k)) < 0.015


@pytest.mark.parametrize("s", [0.5, 1.0, 2.0, 5.0, 10.0, 20.0])
def test_lift_after_a_step_is_that_of_wagner(section, s):
    assert section.step(s) == pytest.approx(wagner(s), abs=0.007)


def test_half_of_the_lift_is_there_at_once(section):
    """The limits of C(k): 1 of what is slow, 1/2 of what is fast."""
    assert section.response(1e-9) == pytest.approx(1.0, abs=1e-6)
    assert section.response(1e9) == pytest.approx(0.5, abs=1e-6)


@pytest.fixture(scope="module")
def late():
    """`sbs` with the option."""
    return Aircraft.load("sbs").with_value("rotors.unsteady_airfoil", "jones")


def test_hover_is_that_without_it(late):
    """Sections whose flow does not change have all of their lift: the least frequency of all."""
    found, expected = trim(late), trim(Aircraft.load("sbs"))
    np.testing.assert_allclose(found.controls, expected.controls, atol=1e-11)
    np.testing.assert_allclose(found.state[: len(expected.state)], expected.state, atol=1e-11)
    np.testing.assert_allclose(found.power, expected.power, rtol=1e-11)


def test_linear_model_has_the_states_and_their_modes(late):
    """Slow poles of the body move little, flap loses damping: |C| < 1 at its frequencies."""
    model, without = linearize(late), linearize(Aircraft.load("sbs"))
    assert len(model.state_names) == len(without.state_names) + 12
    assert [part_of(name).family for name in model.state_names[-12:]] == ["wake"] * 12
    flap = [min(m.pole.real for m in found.modes if m.name.startswith("advancing flap")) for found in (model, without)]
    assert 0.5 < flap[0] / flap[1] < 0.95
    assert sum(mode.family == "wake" for mode in model.modes) >= 6
    # from the flight itself: the rates of the states near the trim
    flown = Model(late)
    x = late.layout.from_linear(model.trim.state)
    rates = [flown.averaged(x + change, model.trim.swashplate)[0] for change in (0.0, _bump(late, 1e-5))]
    column = model.state_names.index("wake_slowc(1)")
    found = (rates[1] - rates[0])[late.layout.wake(0)] / 1e-5
    rows = [model.state_names.index(late.layout.names[i]) for i in range(*late.layout.wake(0).indices(999))]
    np.testing.assert_allclose(found, model.a[rows, column], rtol=1e-3, atol=1.0)


def _bump(aircraft, size):
    change = np.zeros(aircraft.layout.size)
    change[aircraft.layout.wake(0).start + 1] = size
    return change


def test_flights_side_by_side_have_the_same_bits(late):
    """Blades for lanes, and flights for lanes."""
    rng = np.random.default_rng(7)
    case = random_state(late, rng, 0.5), rng.normal(scale=0.1, size=(2, 3)), rng.uniform(0, 6, 2)
    found = [Model(late, lanes=lanes).derivative(*case) for lanes in ("blades", "points")]
    assert (found[0] == found[1]).all()


def test_methods_of_integration_agree(late):
    """A step of the collective, by the exponential method and by one that knows nothing of rotors."""
    point = trim(late)
    found = [simulate(late, point, point.controls + [0.02, 0, 0, 0], 0.1, method=name) for name in ("etd", "tsit5")]
    for name in late.layout.names[-12:]:
        assert found[0][name][-1] == pytest.approx(found[1][name][-1], abs=3e-5)
    assert abs(found[0]["wake_slow0(1)"][-1] - found[0]["wake_slow0(1)"][0]) > 2e-3


def test_long_chords_are_warned_of(late):
    """1.5 times the reduced frequency of one per revolution is left out: 0.067 of `sbs`, 0.132 of twice the chord."""
    chord = late.with_values({"rotors.chord.root": 0.1, "rotors.chord.tip": 0.1}).rotors[0]
    assert blade_warnings(late.rotors[0]) == []
    assert blade_warnings(chord) == ["MR1: reduced frequency above 0.1, without apparent mass"]


@pytest.mark.parametrize(
    ("rotor", "problem"),
    [
        ({"blades": 2}, "unsteady_airfoil = jones: allowed is steady, of a rotor with two blades"),
        ({"root_cutout": 0.31}, "root_cutout = 0.31: allowed is < 0.30375, 0.75 of the radius"),
    ],
)
def test_rotors_that_cannot_have_it(rotor, problem):
    data = aircraft_data()
    for one in data["rotors"]:
        one.update(JONES, **rotor)
    with pytest.raises(AircraftError, match=problem):
        Aircraft.from_dict(data)


@pytest.mark.parametrize("method", ["rk4", "tsit5"])
def test_a_step_that_does_not_hold_the_circulation_is_refused(method):
    """Of very slender blades; the exponential method solves it exactly, and a smaller step holds it."""
    aircraft = build(every_rotor={"unsteady_airfoil": "jones", "chord": {"root": 0.004, "tip": 0.004}, "blades": 5})
    rotor = aircraft.rotors[0]
    assert rotor.wake_rate == pytest.approx(2 * 0.3 * 0.75 * rotor.radius * rotor.speed / 0.004)
    state = np.zeros(aircraft.layout.size)
    state[S.ATTITUDE], state[aircraft.layout.inflow(0).start] = 1.0, 0.05
    with pytest.raises(SimulationError, match=r"R1: unsteady_airfoil = jones, whose .* is not stable at a step of"):
        simulate(aircraft, state, np.zeros(4), 0.01, method=method)
    for more in ({"method": method, "azimuth_step": math.radians(1.0)}, {}):
        assert np.isfinite(simulate(aircraft, state, np.zeros(4), 0.01, **more)["state"]).all()
