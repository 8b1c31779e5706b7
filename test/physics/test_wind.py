"""Wind: gust, turbulence, and flight in moving air."""

import dataclasses
import itertools
import math

import numpy as np
import pytest
from helpers import wind_velocity
from scipy.linalg import expm
from scipy.signal import welch

from sbs_sim import Simulation
from sbs_sim.errors import SimulationError
from sbs_sim.flight.simulate import simulate
from sbs_sim.flight.trimmed_state import trimmed_state
from sbs_sim.model.frames import rotation_matrix
from sbs_sim.model.state import VELOCITY
from sbs_sim.model.wind import TURBULENCE_FROM, TURBULENCE_TO, WIND_SIZE, Wind, WindField, _noise_of_step


def turbulence(wind, tick, count):
    """Turbulence at the ends of `count` ticks, shape (count, 3)."""
    field = WindField(wind, 0.0, tick)
    return np.array([field.next_tick()[TURBULENCE_TO : TURBULENCE_TO + 3].copy() for _ in range(count)])


# -- steady wind and gust ----------------------------------------------------------------------------


def test_no_wind_by_default():
    array = WindField(Wind(), 0.0, 0.01).next_tick()
    assert array.shape == (WIND_SIZE,)
    np.testing.assert_array_equal(wind_velocity(array, 0.0), 0.0)


def test_the_gust_has_the_shape_the_peak_and_the_integral_of_one_minus_cosine():
    wind = Wind(velocity=(1.0, 2.0, 3.0), gust=(8.0, -4.0, 0.5), gust_delay=2.0, gust_duration=3.0)
    array = WindField(wind, 10.0, 0.01).next_tick()
    steady, peak = np.array(wind.velocity), np.array(wind.gust)
    for before_or_after in (0.0, 11.999999, 15.000001, 1000.0):
        np.testing.assert_array_equal(wind_velocity(array, before_or_after), steady)
    for share, part in ((0.0, 0.0), (1 / 6, 0.25), (0.25, 0.5), (0.5, 1.0), (0.75, 0.5), (1.0, 0.0)):
        np.testing.assert_allclose(wind_velocity(array, 12 + 3 * share), steady + part * peak, atol=1e-12)
    times = np.linspace(11.0, 16.0, 5001)
    speeds = np.array([wind_velocity(array, time) for time in times]) - steady
    # the trapezoidal rule is exact for whole periods
    np.testing.assert_allclose(speeds.sum(axis=0) * 0.001, peak * 3.0 / 2, rtol=1e-9)
    assert np.abs(speeds).max() == pytest.approx(8.0)
    # it begins and ends without a jump and without a kink
    assert np.abs(np.diff(speeds[:, 0])).max() == pytest.approx(8 / 2 * 2 * math.pi / 3 * 0.001, rel=1e-3)
    assert np.abs(np.diff(speeds[:, 0], 2)).max() <= 8 / 2 * (2 * math.pi / 3 * 0.001) ** 2 * 1.001


def test_a_gust_without_a_delay_begins_at_once():
    array = WindField(Wind(gust=(8.0, 0.0, 0.0), gust_duration=2.0), 10.0, 0.01).next_tick()
    np.testing.assert_allclose(
        [wind_velocity(array, 10.0 + t)[0] for t in (0.0, 0.5, 1.0, 2.0)], [0.0, 4.0, 8.0, 0.0], atol=1e-12
    )


def test_a_gust_that_takes_no_time_is_refused():
    """It would not be felt."""
    line = "gust_duration = 0, gust_length = 0: allowed is one of them above 0 for a gust"
    for over_distance in ({}, {"gust_shape": "ramp"}, {"gust_distance": 5.0}):
        with pytest.raises(SimulationError, match=f"^{line}$"):
            Wind(gust=(8.0, 0.0, 0.0), **over_distance)
    assert Wind(gust_duration=0.0).gust == (0.0, 0.0, 0.0)


def test_a_gust_pushes_the_aircraft(sbs, hover):
    wind = Wind(gust=(0.0, 5.0, 0.0), gust_delay=0.2, gust_duration=0.5)
    flight = simulate(sbs, hover, hover.controls, 1.0, wind=wind)
    calm = simulate(sbs, hover, hover.controls, 1.0)
    before = flight["time"] <= 0.2 + 1e-9
    np.testing.assert_array_equal(flight["state"][before], calm["state"][before])
    assert flight["v"][-1] > 0.05
    assert abs(calm["v"][-1]) < 1e-9


# -- turbulence --------------------------------------------------------------------------------------

SIGMA = np.array([1.5, 0.8, 2.0])
LENGTH, AIRSPEED = 40.0, 8.0
TIME = LENGTH / AIRSPEED
TURBULENT = Wind(turbulence_intensity=tuple(SIGMA), turbulence_length=LENGTH, turbulence_airspeed=AIRSPEED)
RATIO = 0.05  # tick over time scale
COUNT = 100_000


@pytest.fixture(scope="module")
def long_sample():
    """5000 time scales of turbulence, shape (COUNT, 3)."""
    return turbulence(dataclasses.replace(TURBULENT, turbulence_seed=7), RATIO * TIME, COUNT)


def correlations(lags):
    """Dryden autocorrelations at lags in units of the time scale: longitudinal, lateral, vertical."""
    along = np.exp(-lags)
    across = np.exp(-lags) * (1 - lags / 2)
    return np.stack([along, across, across], axis=-1)


# Variance of a mean of products over a stretch of S time scales is 2 / S times the integral of the squared
# correlation, 1/2 for exp(-t) and 5/16 for exp(-t) (1 - t/2), times 2 sides.
SPREAD = np.sqrt(2 / (COUNT * RATIO) * np.array([1.0, 0.625, 0.625]))


def test_turbulence_has_the_variance_of_its_intensity(long_sample):
    assert (np.abs(long_sample.var(axis=0) / SIGMA**2 - 1) < 5 * SPREAD).all()
    # the mean of a stretch has the variance 2 / S times the integral of the correlation, 1 and 1/2
    spread_of_mean = np.sqrt(2 / (COUNT * RATIO) * np.array([1.0, 0.5, 0.5]))
    assert (np.abs(long_sample.mean(axis=0) / SIGMA) < 5 * spread_of_mean).all()


def test_turbulence_has_the_correlation_of_dryden(long_sample):
    unit = long_sample / SIGMA
    for lag in (1, 4, 10, 20, 40, 60, 100):
        found = (unit[lag:] * unit[:-lag]).mean(axis=0)
        assert (np.abs(found - correlations(lag * RATIO)) < 5 * SPREAD).all(), lag


def test_the_components_are_independent(long_sample):
    unit = long_sample / SIGMA
    for lag in (0, 5, 20):
        products = unit[lag:].T @ unit[: len(unit) - lag] / (len(unit) - lag)
        assert (np.abs(products - np.diag(np.diag(products))) < 5 * SPREAD.max()).all()


def test_turbulence_has_the_spectrum_of_dryden(long_sample):
    """MIL-F-8785C, section 3.7.2, over the time frequency: one-sided, in (m/s)^2/Hz."""
    tick = RATIO * TIME
    frequency, density = welch(long_sample, fs=1 / tick, nperseg=4096, axis=0)
    x = 2 * math.pi * frequency * TIME
    along = SIGMA[0] ** 2 * 4 * TIME / (1 + x**2)
    across = 2 * TIME * (1 + 3 * x**2) / (1 + x**2) ** 2
    expected = np.stack([along, SIGMA[1] ** 2 * across, SIGMA[2] ** 2 * across], axis=1)
    # below a tenth of the sampling frequency, above which sampling folds the spectrum
    edges = np.geomspace(frequency[3], 0.1 / tick, 9)
    for low, high in itertools.pairwise(edges):
        band = (frequency >= low) & (frequency < high)
        # 2 * COUNT / 4096 half-overlapping windows count as some 1.5 * COUNT / 4096 independent ones
        spread = 1 / math.sqrt(band.sum() * 1.5 * COUNT / 4096)
        ratio = density[band].mean(axis=0) / expected[band].mean(axis=0)
        assert (np.abs(ratio - 1) < 5 * spread + 0.02).all(), (low, ratio)


@pytest.mark.parametrize("ratio", [1e-3, 0.1, 1.0, 10.0])
def test_the_variance_does_not_depend_on_the_tick(ratio):
    """Over many seeds, at the start and some ticks later."""
    seeds = 2000
    first, later = [], []
    for seed in range(seeds):
        sample = turbulence(dataclasses.replace(TURBULENT, turbulence_seed=seed), ratio * TIME, 4)
        first.append(sample[0])
        later.append(sample[-1])
    spread = math.sqrt(2 / seeds)
    for values in (first, later):
        assert (np.abs(np.mean(np.square(values), axis=0) / SIGMA**2 - 1) < 5 * spread).all()
    lag = 3 * ratio
    found = np.mean(np.array(first) * later, axis=0) / SIGMA**2
    assert (np.abs(found - correlations(lag)) < 5 * spread).all()


@pytest.mark.parametrize("ratio", [0.01, 0.1, 1.0, 10.0])
def test_noise_of_a_step_keeps_the_stationary_covariance(ratio):
    """Its covariance Q solves P = F P F^T + Q, with F the transition of z1' = -z1, z2' = z1 - z2 over the step."""
    n11, n21, n22 = _noise_of_step(ratio)
    factor = np.array([[n11, 0.0], [n21, n22]])
    stationary = np.array([[0.5, 0.25], [0.25, 0.25]])
    transition = expm(ratio * np.array([[-1.0, 0.0], [1.0, -1.0]]))
    expected = stationary - transition @ stationary @ transition.T
    np.testing.assert_allclose(factor @ factor.T, expected, rtol=1e-9, atol=1e-15)


@pytest.mark.parametrize(("length", "airspeed", "tick"), [(1e4, 0.1, 1e-4), (1e4, 0.1, 0.01), (1e3, 10, 1e-4)])
def test_a_tick_may_be_tiny_beside_the_time_scale(length, airspeed, tick):
    wind = Wind(turbulence_intensity=(1, 1, 1), turbulence_length=length, turbulence_airspeed=airspeed)
    count = 2000
    steps = np.diff(turbulence(wind, tick, count), axis=0)
    # twice one minus the correlations, to first order in the lag
    expected = np.array([2.0, 3.0, 3.0]) * tick * airspeed / length
    np.testing.assert_allclose(np.square(steps).mean(axis=0), expected, rtol=5 * math.sqrt(2 / count))


def test_a_tick_may_be_long_beside_the_time_scale():
    wind = Wind(turbulence_intensity=(1, 1, 1), turbulence_length=0.1, turbulence_airspeed=100.0)
    sample = turbulence(wind, 1.0, 2000)
    np.testing.assert_allclose(sample.var(axis=0), 1.0, rtol=5 * math.sqrt(2 / 2000))


def test_equal_seeds_give_equal_fields_and_others_do_not():
    wind = dataclasses.replace(TURBULENT, turbulence_seed=3)
    field = turbulence(wind, 0.01, 50)
    np.testing.assert_array_equal(field, turbulence(wind, 0.01, 50))
    other = turbulence(dataclasses.replace(wind, turbulence_seed=4), 0.01, 50)
    assert (np.abs(field - other).min(axis=0) > 0).all()
    assert np.ptp(field, axis=0).min() > 0


def test_ticks_ahead_are_those_one_by_one():
    wind = dataclasses.replace(TURBULENT, turbulence_seed=5, velocity=(1.0, 2.0, 3.0), gust=(0, 1, 0), gust_duration=3)
    field = WindField(wind, 2.0, 0.01)
    one_by_one = np.array([field.next_tick().copy() for _ in range(40)])
    field = WindField(wind, 2.0, 0.01)
    blocks = [field.next_ticks(7), field.next_tick().copy()[np.newaxis], field.next_ticks(0), field.next_ticks(32)]
    np.testing.assert_array_equal(np.concatenate(blocks), one_by_one)


def test_the_largest_seed_works():
    wind = dataclasses.replace(TURBULENT, turbulence_seed=2**64 - 1)
    assert np.isfinite(turbulence(wind, 0.01, 3)).all()


def test_the_longitudinal_component_has_its_direction():
    along = Wind(turbulence_intensity=(1, 0, 0), turbulence_direction=0.6, turbulence_seed=1)
    sample = turbulence(along, 0.1, 200)
    np.testing.assert_allclose(sample[:, 1], sample[:, 0] * math.tan(0.6), atol=1e-12)
    assert np.ptp(sample[:, 0]) > 1
    np.testing.assert_array_equal(sample[:, 2], 0)
    across = Wind(turbulence_intensity=(0, 1, 0), turbulence_direction=0.6, turbulence_seed=1)
    sample = turbulence(across, 0.1, 200)
    np.testing.assert_allclose(sample[:, 0], -sample[:, 1] * math.tan(0.6), atol=1e-12)
    assert np.ptp(sample[:, 1]) > 1


def test_turbulence_is_continuous_and_linear_within_a_tick():
    field = WindField(TURBULENT, 0.0, 0.05)
    end = None
    for _ in range(20):
        array = field.next_tick()
        start, finish = wind_velocity(array, 0.0, 0.0), wind_velocity(array, 0.0, 1.0)
        if end is not None:
            np.testing.assert_allclose(start, end, rtol=1e-13)
        np.testing.assert_allclose(wind_velocity(array, 0.0, 0.25), 0.75 * start + 0.25 * finish, rtol=1e-12)
        np.testing.assert_array_equal(start, array[TURBULENCE_FROM : TURBULENCE_FROM + 3])
        end = finish


# -- what is refused ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("field", "value", "line"),
    [
        ("velocity", (0, math.nan, 0), "velocity.y = nan: allowed are -100 to 100 m/s"),
        ("velocity", (0, 0, -101.0), "velocity.z = -101.0: allowed are -100 to 100 m/s"),
        ("velocity", (1.0, 2.0), "velocity = (1.0, 2.0): allowed are 3 values, north, east, down [m/s]"),
        ("gust", (math.inf, 0, 0), "gust.x = inf: allowed are -100 to 100 m/s"),
        ("gust", 5.0, "gust = 5.0: allowed are 3 values, north, east, down [m/s]"),
        ("gust_delay", -0.1, "gust_delay = -0.1: allowed are 0 to 1e+06 s"),
        ("gust_duration", math.nan, "gust_duration = nan: allowed are 0 to 1e+06 s"),
        ("turbulence_intensity", (1, -1, 1), "turbulence_intensity.y = -1: allowed are 0 to 100 m/s"),
        ("turbulence_length", 0.0, "turbulence_length = 0.0: allowed are 0.1 to 10000 m"),
        ("turbulence_airspeed", 0.0, "turbulence_airspeed = 0.0: allowed are 0.1 to 100 m/s"),
        ("turbulence_direction", 11.0, "turbulence_direction = 11.0: allowed are -10 to 10 rad"),
        ("turbulence_seed", -1, "turbulence_seed = -1: allowed are integers from 0 to 18446744073709551615"),
        (
            "turbulence_seed",
            2**64,
            f"turbulence_seed = {2**64}: allowed are integers from 0 to 18446744073709551615",
        ),
        ("turbulence_seed", 1.5, "turbulence_seed = 1.5: allowed are integers from 0 to 18446744073709551615"),
    ],
)
def test_a_bad_value_is_refused_in_one_line(field, value, line):
    with pytest.raises(SimulationError) as caught:
        Wind(**{field: value})
    assert str(caught.value) == line


# -- flight in moving air ----------------------------------------------------------------------------


@pytest.mark.parametrize("heading", [0.0, 2.1])
def test_flight_in_steady_wind_is_flight_in_calm_air_seen_from_elsewhere(sbs, hover, heading):
    """Galilei: the same controls give the same motion relative to the air, whatever the air does steadily."""
    velocity = np.array([8.0, -5.0, 2.0])
    calm = Simulation(sbs, trimmed_state(sbs, hover, heading=heading), hover.swashplate)
    windy = Simulation(
        sbs,
        trimmed_state(sbs, hover, heading=heading, wind=velocity),
        hover.swashplate,
        wind=Wind(velocity=tuple(velocity)),
    )
    for tick in range(200):
        swashplate = hover.swashplate + 0.01 * math.sin(0.1 * tick) * np.array([[1, -2, 1], [-1, 1, 2]])
        for flight in (calm, windy):
            flight.set_swashplate(swashplate)
            flight.advance()
    relative = windy.state.copy()
    relative[:3] -= velocity * windy.time
    to_earth = rotation_matrix(windy.state[3:7])
    relative[VELOCITY : VELOCITY + 3] -= to_earth.T @ velocity
    np.testing.assert_allclose(relative, calm.state, atol=1e-9)
    assert np.abs(calm.state[VELOCITY : VELOCITY + 6]).max() > 0.1  # something has happened
    here, there = calm.snapshot(), windy.snapshot()
    np.testing.assert_allclose(there.loads, here.loads, rtol=1e-7, atol=1e-7)
    np.testing.assert_allclose(there.acceleration, here.acceleration, atol=1e-7)
    np.testing.assert_array_equal(there.wind, velocity)


def test_turbulence_shakes_the_aircraft_the_same_way_for_the_same_seed(sbs, hover):
    def flight(seed):
        wind = Wind(turbulence_intensity=(1.0, 1.0, 1.0), turbulence_seed=seed)
        return simulate(sbs, hover, hover.controls, 0.5, wind=wind)["state"]

    first = flight(1)
    assert np.abs(first[-1, VELOCITY : VELOCITY + 3]).max() > 1e-3
    np.testing.assert_array_equal(first, flight(1))
    assert np.abs(first[-1] - flight(2)[-1]).max() > 1e-3
