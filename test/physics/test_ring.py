"""Unsteadiness of the vortex ring: noise, where it acts, what it does to the thrust, and that flights repeat."""

import math

import numpy as np
import pytest
from helpers import Model, build
from plain_model import plain_derivative, random_state
from scipy.optimize import brentq

from sbs_sim import Simulation, simulate, trim
from sbs_sim.analysis.batch import Case, simulate_batch
from sbs_sim.errors import AircraftError
from sbs_sim.flight.records import Event
from sbs_sim.flight.refly import refly
from sbs_sim.flight.trimmed_state import trimmed_state
from sbs_sim.model import state as S
from sbs_sim.model.descent import measured_axial
from sbs_sim.model.power import POWER_TERMS, SUPPLY
from sbs_sim.model.records import LOAD, NOISE, THRUST
from sbs_sim.model.ring_noise import BLOCK, RingNoise
from sbs_sim.model.wind import Wind

SHARE = 0.2
MEASURED = {"descent": "measured", "induced_power_factor": 1.1}
RING = MEASURED | {"ring_unsteadiness": SHARE}
SPEED = 240.0  # rad/s


@pytest.fixture(scope="module")
def aircraft():
    return build(every_rotor=RING, body={"flat_plate_areas": [0.0, 0.0, 0.0]})


@pytest.fixture(scope="module")
def hover_inflow(aircraft):
    """v_h of momentum theory [m/s]."""
    weight, air = aircraft.body.mass * aircraft.environment.gravity, aircraft.environment.air_density
    return np.sqrt(weight / 2 / (2 * air * np.pi * aircraft.rotors[0].radius ** 2))


@pytest.fixture(scope="module")
def sinking(aircraft, hover_inflow):
    """A descent in the middle of the ring."""
    return trim(aircraft, climb_rate=-1.25 * hover_inflow)


# -- noise -------------------------------------------------------------------------------------------------------------


def test_noise_has_the_autocorrelation_of_its_band_pass():
    """Half power at a period of 20 and one of 50 revolutions, variance 1, zero mean, one rotor not as the other."""
    tick, count = 0.02, 60_000
    made = RingNoise([SPEED, SPEED], 5, tick).ends(0, count - 1)
    ends = SPEED / 20, SPEED / 50
    decay, centre = 0.5 * (ends[0] - ends[1]), math.sqrt(ends[0] * ends[1])
    swing = math.sqrt(centre**2 - decay**2)
    lags = np.arange(40)
    t = lags * tick
    expected = np.exp(-decay * t) * (np.cos(swing * t) - decay / swing * np.sin(swing * t))
    found = np.array([[np.mean(row[: count - lag] * row[lag:]) for lag in lags] for row in made.T])
    error = 1.0 / math.sqrt(decay * tick * count)  # of a mean over so many correlation times
    np.testing.assert_allclose(found, [expected, expected], atol=4 * error)
    assert np.abs(made.mean(axis=0)).max() < error
    assert abs(np.mean(made[:, 0] * made[:, 1])) < 4 * error


def test_noise_depends_on_seed_and_tick_alone():
    noise, other = RingNoise([200.0, 300.0], 5, 0.01), RingNoise([200.0, 300.0], 5, 0.01)
    made = noise.ends(0, 2 * BLOCK + 10)
    for first, count in ((2 * BLOCK - 3, 8), (BLOCK - 1, 1), (BLOCK, 0), (0, 5), (BLOCK - 2, BLOCK + 4)):
        np.testing.assert_array_equal(other.ends(first, count), made[first : first + count + 1])
    assert not np.allclose(RingNoise([200.0, 300.0], 6, 0.01).ends(0, 5), made[:6])


# -- what it does ------------------------------------------------------------------------------------------------------


def noisy(model, x, swash, noise):
    """Return derivative and thrusts at a noise of each rotor."""
    model.engine.work.ring[NOISE] = np.array(noise)[:, None]
    return model.derivative(x, swash), model.loads[:, THRUST].copy()


def test_thrust_follows_the_noise_and_the_mean_inflow_does_not(aircraft, sinking):
    model = Model(aircraft)
    x, swash = trimmed_state(aircraft, sinking), sinking.swashplate
    rates, mean = noisy(model, x, swash, [0.0, 0.0])
    changed, thrusts = noisy(model, x, swash, [1.0, -0.5])
    np.testing.assert_allclose(thrusts / mean, [1.0 - SHARE, 1.0 + 0.5 * SHARE], rtol=0.02)
    places = [aircraft.layout.inflow(j).start for j in range(2)]
    without = (mean - thrusts) / (1.225 * math.pi * 0.505**2 * (SPEED * 0.505) ** 2)
    unforced = 3 * math.pi / 8 * aircraft.rotors[0].speed * without  # what that thrust would do to the inflow
    assert (np.abs(changed[places] - rates[places]) < 0.1 * np.abs(unforced)).all()


@pytest.mark.parametrize(("descent", "along", "acts"), [
    (0.0, 0.0, False), (0.4, 0.0, False), (0.7, 0.0, True), (1.25, 0.8, True), (1.25, 1.0, False), (1.9, 0.0, True),
    (2.05, 0.0, False), (-1.0, 0.0, False),
])  # fmt: skip
def test_it_acts_in_the_ring_alone(aircraft, hover_inflow, descent, along, acts):
    model, tip_speed = Model(aircraft), aircraft.rotors[0].speed * aircraft.rotors[0].radius
    edgewise, sinking = along * hover_inflow, descent * hover_inflow

    def excess(inflow):
        """Of the thrust of a steady inflow [m/s] over that of the hover."""
        return inflow * np.hypot(edgewise, measured_axial(inflow, sinking)[0]) - hover_inflow**2

    x = model.state((edgewise, 0.0, sinking), lambda0=brentq(excess, 1e-3, 50.0) / tip_speed)
    noisy(model, x, None, [0.0, 0.0])
    quiet = model.derivative(x)
    found, _ = noisy(model, x, None, [1.0, 1.0])
    assert (np.abs(model.engine.work.ring[LOAD]).max() > 0.0) == acts
    assert np.array_equal(found, quiet) != acts


def test_derivative_equals_the_plain_reference(aircraft):
    aircraft = aircraft.with_value("options.elements", 6)
    model, rng = Model(aircraft), np.random.default_rng(7)
    acting = 0
    for descent in (-3.0, 6.0, 9.0, 11.0):
        x = random_state(aircraft, rng, 0.3)
        x[7:10] = rng.normal(0.0, 1.0), rng.normal(0.0, 1.0), descent
        x[3:7] = 1.0, 0.0, 0.0, 0.0
        for j in range(2):
            x[aircraft.layout.inflow(j).start] = 0.07
        swash, psi, wind = rng.normal(scale=0.1, size=(2, 3)), rng.uniform(0, 6, 2), np.zeros(3)
        noise = rng.normal(size=2)
        expected, _ = plain_derivative(aircraft, x, swash, psi, wind, ring_noise=noise)
        model.engine.work.ring[NOISE] = noise[:, None]
        found = model.derivative(x, swash, psi, wind)
        scale = np.maximum(np.abs(expected), 1e-3 * np.abs(expected).max())
        assert (np.abs(found - expected) / scale).max() < 1e-7
        acting += np.abs(model.engine.work.ring[LOAD]).max() > 1e-5
    assert acting >= 2


def test_a_rotor_on_a_stand_fluctuates_as_much_as_its_file_says(aircraft, hover_inflow, sinking):
    """Locked in a wind from below of 1.25 v_h: standard deviation of the thrust over its mean."""
    values = {"body.stand.free": [], "options.elements": 8}
    stand, state = aircraft.with_values(values), trimmed_state(aircraft, sinking)
    state[S.VELOCITY : S.RATES] = 0.0
    wind = Wind(velocity=(0.0, 0.0, -1.25 * hover_inflow), turbulence_seed=3)
    flight = simulate(stand, state, sinking.controls, 30.0, wind=wind, azimuth_step=math.radians(30))
    thrust = flight["thrust"][100:]
    assert thrust.std() / thrust.mean() == pytest.approx(SHARE, rel=0.2)
    assert abs(np.corrcoef(thrust.T)[0, 1]) < 0.4


def test_the_balance_of_power_closes_with_it(aircraft, sinking):
    flight = simulate(aircraft, sinking, sinking.controls, 0.3, outputs=["power_balance"])
    signs = np.array([1.0 if term in SUPPLY else -1.0 for term in POWER_TERMS])
    assert np.abs(flight["power_balance"] @ signs).max() < 1e-9 * 2143
    assert np.abs(flight["power_interference"]).max() > 10.0


# -- flights -----------------------------------------------------------------------------------------------------------


def test_equal_seeds_repeat_alone_and_side_by_side(aircraft, sinking):
    winds = [Wind(turbulence_seed=seed) for seed in (1, 2, 1, 3, 4)]  # more than half of the lanes: together
    still = build(every_rotor=MEASURED, body={"flat_plate_areas": [0.0, 0.0, 0.0]})
    cases = [*(Case(aircraft, sinking, wind=wind) for wind in winds), Case(still, sinking)]
    batch = simulate_batch(cases, 0.2, workers=1)
    for number, case in enumerate(cases):
        alone = simulate(case.aircraft, sinking, sinking.controls, 0.2, wind=case.wind)
        np.testing.assert_array_equal(batch["state"][number], alone["state"])
    assert np.array_equal(batch["state"][0], batch["state"][2])
    assert not np.array_equal(batch["state"][0], batch["state"][1])


def test_mixed_models_of_descent_keep_their_own_side_by_side(sinking):
    """Equal in structure but for the law of their inflow."""
    measured = build(every_rotor=MEASURED)
    cases = [Case(one, sinking) for one in (measured, measured.with_value("rotors.descent", "momentum"))] * 5
    batch = simulate_batch(cases, 0.1, workers=1)
    for number, case in enumerate(cases[:2]):
        alone = simulate(case.aircraft, sinking, sinking.controls, 0.1)
        np.testing.assert_array_equal(batch["state"][number], alone["state"])


def test_a_log_that_begins_in_mid_flight_repeats_and_a_wind_of_the_same_seed_does_not_disturb(aircraft, sinking):
    one = Simulation(aircraft, trimmed_state(aircraft, sinking), sinking.swashplate)
    for tick in range(40):
        if tick == 20:
            beginning = one.beginning()
        if tick == 30:
            one.set_wind(Wind(gust=(0.0, 0.0, 1.0), gust_duration=1e3))  # which hardly blows yet
            wind = Event(one.step, "wind", wind=one.wind)
        one.advance()
    *_, last = refly(aircraft, [beginning, wind], one.step)
    np.testing.assert_array_equal(last.state, one.state)
    np.testing.assert_array_equal(last.loads, one.snapshot().loads)
    without = simulate(aircraft, sinking, sinking.controls, 0.4)
    assert np.abs(without["state"][40] - one.state).max() < 1e-3


def test_words(sinking, hover_inflow):
    with pytest.raises(AircraftError, match=r"ring_unsteadiness = 0\.2: allowed is 0, without descent = measured"):
        build(every_rotor={"ring_unsteadiness": 0.2})
    assert sinking.warnings == ()
    still = trim(build(every_rotor=MEASURED), climb_rate=-1.25 * hover_inflow)
    assert "whose unsteadiness is missing" in still.warnings[0]
