"""What sensors measure and how they err, against closed forms, published numbers and the motion itself."""

import math

import numpy as np
import pytest

from sbs_sim import Aircraft, trim
from sbs_sim.errors import SimulationError
from sbs_sim.flight.records import Snapshot
from sbs_sim.flight.simulation import Simulation
from sbs_sim.flight.trimmed_state import trimmed_state
from sbs_sim.model.frames import euler_to_quaternion, rotation_matrix
from sbs_sim.sensors.errors import ErrorModel, Errors
from sbs_sim.sensors.geodesy import ECCENTRICITY_SQUARED, SEMI_MAJOR_AXIS, Origin, earth_fixed, geodetic
from sbs_sim.sensors.settings import NAMES, SETTINGS, checked
from sbs_sim.sensors.suite import Clock, SensorSuite, turned
from sbs_sim.sensors.truth import range_down, specific_force, specific_force_at, static_pressure

GRAVITY = 9.80665
CLOCK = Clock(step_size=0.0025, steps=4)  # ticks of 0.01 s
MANY = 20_000  # axes of one sensor: an ensemble
SIGMAS = 5.0


@pytest.fixture(scope="module")
def sbs():
    return Aircraft.load("sbs")


def instant(aircraft, step=0, position=(0.0, 0.0, 0.0), euler=(0.0, 0.0, 0.0), rates=(0.0, 0.0, 0.0), **changes):
    """Snapshot of an aircraft at rest; `euler` is heading, pitch, roll."""
    state = np.zeros(aircraft.layout.size)
    state[:3], state[3:7], state[10:13] = position, euler_to_quaternion(*euler), rates
    empty = np.zeros((len(aircraft.rotors), 3))
    given = {"acceleration": np.zeros(3), "wind": np.zeros(3), "derivative": np.zeros(len(state))}
    return Snapshot(
        step, step * CLOCK.step_size, state, swashplate=empty, azimuth=empty[:, 0], loads=empty, **(given | changes)
    )


def taken(aircraft, values, ticks, ground=-math.inf):
    """Measurements of a flight at rest, in order."""
    suite = SensorSuite(aircraft, values, CLOCK, ground)
    return [found for i in range(ticks) for found in suite.take(instant(aircraft, i * CLOCK.steps))]


# ------------------------------------------------------------------------------------------------------- errors


@pytest.mark.parametrize("rate", [1.0, 400.0])
def test_white_noise_has_one_density_at_every_rate(rate):
    """Its mean over a time t has the variance N^2 / t, however many samples make it."""
    count, density = 20, 0.3
    errors = Errors([ErrorModel(noise=density)] * MANY, rate, seed=1, sensor=0)
    samples = np.array([errors.measured(np.zeros(MANY), i) for i in range(count)])
    spread = SIGMAS * math.sqrt(2.0 / MANY)
    assert samples.mean(axis=0).var() == pytest.approx(density**2 * rate / count, rel=spread)
    assert samples[0].var() == pytest.approx(errors.variances[0], rel=spread)
    assert np.mean(samples[0] * samples[1]) == pytest.approx(0.0, abs=SIGMAS / math.sqrt(MANY) * errors.variances[0])


@pytest.mark.parametrize("rate", [2.0, 20.0])
def test_a_wandering_bias_is_a_stationary_gauss_markov_process(rate):
    """Variance s^2 from the first sample on, autocorrelation s^2 exp(-lag / T), at any rate."""
    spread, lag, time = 0.2, 1.5, 2.0
    errors = Errors([ErrorModel(instability=spread, correlation_time=time)] * MANY, rate, seed=2, sensor=0)
    count = round(lag * rate)
    first, *_, last = [errors.measured(np.zeros(MANY), i) for i in range(count + 1)]
    for samples in (first, last):
        assert samples.var() == pytest.approx(spread**2, rel=SIGMAS * math.sqrt(2.0 / MANY))
        assert samples.mean() == pytest.approx(0.0, abs=SIGMAS * spread / math.sqrt(MANY))
    expected = math.exp(-lag / time)
    assert np.mean(first * last) / spread**2 == pytest.approx(expected, abs=SIGMAS * math.sqrt(2.0 / MANY))


def test_the_allan_variance_is_that_of_ieee_952():
    """N^2 / t, and of the Gauss-Markov process 2 s^2 T / t (1 - T / 2 t (3 - 4 exp(-t / T) + exp(-2 t / T)))."""
    density, spread, time, rate, axes = 0.05, 0.2, 1.0, 50.0, 100
    model = ErrorModel(noise=density, instability=spread, correlation_time=time)
    errors, zero = Errors([model] * axes, rate, seed=3, sensor=0), np.zeros(axes)
    samples = np.array([errors.measured(zero, i) for i in range(4000)])
    for t in (0.2, 1.0, 4.0):
        means = samples.reshape(-1, round(t * rate), axes).mean(axis=1)
        found = 0.5 * np.mean(np.diff(means, axis=0) ** 2)
        wander = 3.0 - 4.0 * math.exp(-t / time) + math.exp(-2.0 * t / time)
        expected = density**2 / t + 2.0 * spread**2 * time / t * (1.0 - 0.5 * time / t * wander)
        # the formula has the integral in place of the mean of samples, which differ by 2 % where these are ten
        assert found == pytest.approx(expected, rel=0.02 + SIGMAS * math.sqrt(3.0 / (axes * (len(means) - 1))))


def test_a_bias_stays_for_the_flight_and_differs_between_flights():
    errors = Errors([ErrorModel(bias=0.5)] * MANY, 10.0, seed=3, sensor=0)
    first, later = errors.measured(np.zeros(MANY), 0), errors.measured(np.zeros(MANY), 100)
    np.testing.assert_array_equal(first, later)
    assert first.std() == pytest.approx(0.5, rel=SIGMAS / math.sqrt(2 * MANY))


def test_a_resolution_rounds_what_is_measured():
    errors = Errors([ErrorModel(resolution=0.25), ErrorModel()], 1.0, seed=0, sensor=0)
    np.testing.assert_array_equal(errors.measured(np.array([1.13, 1.13]), 0), [1.25, 1.13])
    assert errors.variances == pytest.approx([0.25**2 / 12.0, 0.0])


def test_samples_that_nobody_takes_change_none_of_the_others():
    model = [ErrorModel(noise=1.0, bias=1.0, instability=1.0, correlation_time=0.3)] * 3
    all_of_them, some = Errors(model, 10.0, seed=4, sensor=1), Errors(model, 10.0, seed=4, sensor=1)
    every = [all_of_them.measured(np.zeros(3), i) for i in range(200)]
    for i in (0, 5, 63, 64, 65, 199):
        np.testing.assert_array_equal(some.measured(np.zeros(3), i), every[i])


# -------------------------------------------------------------------------------------------------- what they see


def test_at_rest_an_accelerometer_shows_minus_g_down(sbs):
    force = specific_force(instant(sbs, euler=(1.0, 0.0, 0.0)), GRAVITY)
    np.testing.assert_allclose(force, [0.0, 0.0, -GRAVITY], atol=1e-14)
    rolled = specific_force(instant(sbs, euler=(0.0, 0.0, math.pi / 2)), GRAVITY)
    np.testing.assert_allclose(rolled, [0.0, -GRAVITY, 0.0], atol=1e-14)


def test_ahead_of_the_cg_a_steady_turn_pulls_inwards():
    """Flat turn at r: the centripetal acceleration of a point ahead is -r^2 x; while r grows, it also moves right."""
    force = specific_force_at([2.0, 0.0, 0.0], np.array([0.0, 0.0, -GRAVITY]), np.array([0.0, 0.0, 0.7]), np.zeros(3))
    np.testing.assert_allclose(force, [-(0.7**2) * 2.0, 0.0, -GRAVITY], atol=1e-14)
    faster = specific_force_at([2.0, 0.0, 0.0], np.zeros(3), np.zeros(3), np.array([0.0, 0.0, 0.3]))
    np.testing.assert_allclose(faster, [0.0, 0.6, 0.0], atol=1e-14)


@pytest.mark.parametrize("method", ["rk4", "etd"])
def test_the_imu_agrees_with_the_path_of_its_place(sbs, method):
    """Second differences of where the IMU is, in an upset flight, are what it measures, less gravity."""
    arm, tick = np.array([0.8, -0.4, 0.3]), 2e-4
    point = trim(sbs)
    start = trimmed_state(sbs, point, (0.0, 0.0, 0.0), 0.3)
    start[10:13] = 0.4, -0.3, 0.5
    flight = Simulation(sbs, start, sbs.mix(point.controls), tick=tick, method=method)
    values = {"imu.rate": 1.0 / tick, "imu.position": arm.tolist()}
    suite = SensorSuite(sbs, values, Clock(flight.step_size, flight.steps_per_tick), -math.inf)
    places, found, attitudes = [], [], []
    for _ in range(9):
        now = flight.snapshot()
        attitudes.append(rotation_matrix(now.state[3:7]))
        places.append(now.state[:3] + attitudes[-1] @ arm)
        found.append(suite.take(now)[0].values)
        flight.advance()
    path = np.array(places)
    accelerations = (path[2:] - 2.0 * path[1:-1] + path[:-2]) / tick**2 - [0.0, 0.0, GRAVITY]
    for i, acceleration in enumerate(accelerations, start=1):
        np.testing.assert_allclose(found[i][3:6], attitudes[i].T @ acceleration, atol=0.02)
    np.testing.assert_array_equal(found[0][:3], start[10:13])


def test_pressure_is_that_of_the_standard_atmosphere():
    """US Standard Atmosphere 1976, table I: sea level, and 1,000 m and 11,000 m of geopotential altitude."""
    for height, pressure in ((0.0, 101325.0), (1000.0, 89874.6), (11000.0, 22632.1)):
        assert static_pressure(height, 0.0, 0.0) == pytest.approx(pressure, rel=1e-5)
    assert static_pressure(400.0, 600.0, 0.0) == static_pressure(1000.0, 0.0, 0.0)


@pytest.mark.parametrize("offset", [-20.0, 25.0])
@pytest.mark.parametrize("height", [1500.0, 12500.0])
def test_on_another_day_the_air_carries_its_weight(offset, height):
    """dp/dh = -p g / (R T) with the temperature of that day, the standard's at this pressure plus an offset."""
    low, high = (static_pressure(height + step, 0.0, offset) for step in (-0.5, 0.5))
    pressure = 0.5 * (low + high)
    if pressure > 22632.06:  # troposphere: the standard's pressure altitude, inverted
        standard = 288.15 * (pressure / 101325.0) ** (0.0065 * 287.05287 / GRAVITY)
    else:
        standard = 216.65
    assert high - low == pytest.approx(-pressure * GRAVITY / (287.05287 * (standard + offset)), rel=1e-5)


def test_the_ellipsoid_is_that_of_wgs_84():
    """Polar radius and squared eccentricity, NIMA TR8350.2, tables 3.1 and 3.3; the way back."""
    np.testing.assert_allclose(earth_fixed(math.pi / 2, 0.0, 0.0), [0.0, 0.0, 6356752.3142], atol=1e-4)
    np.testing.assert_allclose(earth_fixed(0.0, math.pi / 2, 10.0), [0.0, SEMI_MAJOR_AXIS + 10.0, 0.0], atol=1e-8)
    assert pytest.approx(6.69437999014e-3, rel=1e-11) == ECCENTRICITY_SQUARED
    for place in ((0.9, -2.0, 1234.5), (-1.5, 3.0, -50.0), (0.0, 0.0, 2e4)):
        latitude, longitude, height = geodetic(earth_fixed(*place))
        assert (latitude, longitude) == pytest.approx(place[:2], abs=1e-13)
        assert height == pytest.approx(place[2], abs=1e-8)


def test_a_place_near_the_origin_lies_along_the_radii_of_curvature():
    """Meridian a (1 - e^2) / W^3, prime vertical a / W with W^2 = 1 - e^2 sin^2 (any textbook of geodesy)."""
    latitude, distance = 45.0, 100.0
    w = math.sqrt(1.0 - ECCENTRICITY_SQUARED * math.sin(math.radians(latitude)) ** 2)
    north_radius = SEMI_MAJOR_AXIS * (1.0 - ECCENTRICITY_SQUARED) / w**3
    east_radius = SEMI_MAJOR_AXIS / w * math.cos(math.radians(latitude))
    north, east, up = Origin(latitude, 8.0, 500.0).geodetic_deg([distance, distance, -30.0])
    # the curvature of the parallels turns 100 m east into less than a millimetre south
    assert math.radians(north - latitude) * (north_radius + 500.0) == pytest.approx(distance, abs=2e-3)
    assert math.radians(east - 8.0) * (east_radius + 500.0 * math.cos(math.radians(latitude))) == pytest.approx(
        distance, abs=2e-2
    )
    assert up == pytest.approx(530.0 + distance**2 / SEMI_MAJOR_AXIS, abs=1e-4)


def test_the_range_finder_looks_along_the_body(sbs):
    high = instant(sbs, position=(5.0, 5.0, -10.0), euler=(2.0, 0.0, math.radians(60.0)))
    assert range_down(high, 0.0) == pytest.approx(20.0)
    assert range_down(high, 4.0) == pytest.approx(12.0)
    assert range_down(instant(sbs, position=(0.0, 0.0, -10.0), euler=(0.0, 0.0, math.pi)), 0.0) == math.inf
    for limits, seen in (([1.0, 15.0], math.inf), ([25.0, 30.0], -math.inf), ([1.0, 30.0], 20.0)):
        suite = SensorSuite(sbs, {"range.rate": 100.0, "range.limits": limits}, CLOCK, 0.0)
        assert suite.take(high)[0].values == pytest.approx([seen])
    assert math.isinf(SensorSuite(sbs, {"range.rate": 100.0}, CLOCK, -math.inf).take(high)[0].values[0])


def test_a_compass_turns_with_the_body(sbs):
    suite = SensorSuite(sbs, {"magnetic.rate": 100.0, "magnetic.field": [2e-5, 0.0, 4e-5]}, CLOCK, 0.0)
    east = instant(sbs, euler=(math.pi / 2, 0.0, 0.0))
    np.testing.assert_allclose(suite.take(east)[0].values, [0.0, -2e-5, 4e-5], atol=1e-20)


def test_an_attitude_error_turns_about_the_body(sbs):
    attitude = instant(sbs, euler=(0.4, 0.2, -0.1)).state[3:7]
    expected = rotation_matrix(attitude) @ rotation_matrix(euler_to_quaternion(0.0, 0.0, 0.05))
    np.testing.assert_allclose(rotation_matrix(turned(attitude, np.array([0.05, 0.0, 0.0]))), expected, atol=1e-14)


def test_what_a_battery_gives_is_what_it_loses():
    quadrotor = Aircraft.load("quadrotor")
    point = trim(quadrotor)
    start = trimmed_state(quadrotor, point, (0.0, 0.0, 0.0), 0.0)
    flight = Simulation(quadrotor, start, quadrotor.mix(point.controls), tick=0.01)
    suite = SensorSuite(quadrotor, {"battery.rate": 100.0}, Clock(flight.step_size, flight.steps_per_tick), -math.inf)
    rows = []
    for _ in range(21):
        rows.append(suite.take(flight.snapshot())[0].values)
        flight.advance()
    _, voltage, current, charge, capacity = np.moveaxis(np.array(rows), -1, 0)
    lost = (charge[0] - charge[-1]) * 3600.0
    assert np.all(lost > 0.0)
    given = 0.01 * np.sum(0.5 * (current[1:] + current[:-1]), axis=0)
    np.testing.assert_allclose(given, lost, rtol=1e-4)
    np.testing.assert_allclose(voltage, 14.0 + 2.8 * charge / capacity, rtol=1e-12)


# ------------------------------------------------------------------------------------------------------ the suite


def test_sensors_measure_at_their_rates_and_answer_later(sbs):
    suite = SensorSuite(sbs, {"gnss.rate": 5.0, "gnss.latency": 0.07, "pressure.rate": 50.0}, CLOCK, 0.0)
    assert suite.names == ("gnss", "pressure")
    arrivals = {name: [] for name in suite.names}
    for i in range(60):
        for found in suite.take(instant(sbs, i * CLOCK.steps)):
            arrivals[found.sensor].append((found.time, i * CLOCK.tick))
    np.testing.assert_allclose(arrivals["gnss"], [(0.0, 0.07), (0.2, 0.27), (0.4, 0.47)])
    np.testing.assert_allclose(arrivals["pressure"], [(0.02 * i, 0.02 * i) for i in range(30)])
    assert SensorSuite(sbs, {}, CLOCK, 0.0).names == ()


def test_equal_seeds_give_equal_samples_whatever_else_is_on(sbs):
    noisy = {"pressure.rate": 10.0, "pressure.noise": 2.0, "pressure.bias": 30.0, "pressure.instability": 5.0}
    others = {"imu.rate": 100.0, "imu.gyro_noise": 1e-3, "gnss.rate": 5.0, "gnss.noise": 1.0}

    def pressures(**more):
        return [found.values[0] for found in taken(sbs, noisy | more, 50) if found.sensor == "pressure"]

    alone = pressures(**{"sensors.seed": 7})
    assert alone == pressures(**{"sensors.seed": 7}, **others)
    assert len(set(alone)) == len(alone) == 5
    assert not set(alone) & set(pressures(**{"sensors.seed": 8}))


def test_variances_are_those_of_the_measurements(sbs):
    values = {"gnss.rate": 4.0, "gnss.noise": 0.5, "gnss.bias": 2.0, "gnss.vertical_ratio": 1.5}
    found = taken(sbs, values, 1)[0]
    np.testing.assert_allclose(found.variances, np.array([1.0, 1.0, 2.25]) * (0.5**2 * 4.0 + 2.0**2))


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"imu.rate": -1.0}, "parameter imu.rate = -1.0: allowed are 0 to 10000"),
        ({"imu.rate": math.nan}, "parameter imu.rate = nan: allowed are 0 to 10000"),
        ({"imu.rate": 30.0}, "parameter imu.rate = 30: allowed are 100 Hz over an integer (publish_rate)"),
        ({"gnss.rate": 5.0, "gnss.latency": 0.005}, "parameter gnss.latency = 0.005: allowed are multiples of 0.01 s"),
        ({"imu.gyro_noise": -0.1}, "parameter imu.gyro_noise = -0.1: allowed are 0 to 1e+06"),
        ({"imu.correlation_time": 0.0}, "parameter imu.correlation_time = 0.0: allowed are 0.001 to 1e+06"),
        ({"imu.position": [0.0, 1.0]}, "parameter imu.position = [0.0, 1.0]: allowed are 3 numbers"),
        ({"imu.position": [0.0, math.inf, 0.0]}, "parameter imu.position[1] = inf: allowed are -100 to 100"),
        ({"sensors.latitude_deg": 91.0}, "parameter sensors.latitude_deg = 91.0: allowed are -90 to 90"),
        ({"imu.position": [0.0, 0.0, 101.0]}, "parameter imu.position[2] = 101.0: allowed are -100 to 100"),
        ({"sensors.seed": -1}, "parameter sensors.seed = -1: allowed are integers from 0 to"),
        (
            {"range.rate": 10.0, "range.limits": [5.0, 5.0]},
            "parameter range.limits = [5.0, 5.0]: allowed are a smaller",
        ),
        ({"magnetic.rate": 10.0}, "parameter magnetic.field = [0.0, 0.0, 0.0]: allowed is a field that is not zero"),
        ({"battery.rate": 1.0}, "parameter battery.rate = 1: allowed is 0 for an aircraft without a battery"),
        ({"lidar.rate": 1.0}, "parameter lidar.rate: unknown"),
    ],
)
def test_bad_settings_are_refused(sbs, values, message):
    with pytest.raises(SimulationError) as caught:
        SensorSuite(sbs, values, CLOCK, 0.0)
    assert str(caught.value).startswith(message)


def test_every_default_is_allowed_and_off():
    known = checked({})
    assert set(known) == set(SETTINGS)
    assert [known[f"{name}.rate"] for name in NAMES] == [0.0] * len(NAMES)
