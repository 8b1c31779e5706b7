"""Air that is not the same everywhere: rotors against the plain model, spectra against closed forms."""

import math
from dataclasses import replace

import numpy as np
import pytest
from helpers import CALM, Model, build
from plain_model import plain_derivative, random_state
from scipy.interpolate import pade
from scipy.linalg import expm, solve_continuous_lyapunov
from scipy.special import binom, kv

from sbs_sim import Aircraft, Case, Simulation, simulate, simulate_batch, trim
from sbs_sim.errors import SimulationError
from sbs_sim.flight.trimmed_state import trimmed_state
from sbs_sim.model import turbulence as T
from sbs_sim.model.air import air_in_space, joined_spaces
from sbs_sim.model.air_field import LENGTHS, WEIGHTS, field_grids, sample_field
from sbs_sim.model.air_rows import air_rows
from sbs_sim.model.frames import hub_axes, rotation_matrix
from sbs_sim.model.gust_table import GustTable
from sbs_sim.model.state import ATTITUDE, VELOCITY
from sbs_sim.model.wind import RATES_FROM, TURBULENCE_FROM, Wind, WindField


@pytest.fixture(scope="module")
def cruise(sbs):
    """Trim at 10 m/s."""
    return trim(sbs, 10.0)


# -- rotors in air that changes from place to place ----------------------------------------------------------


def rows_of(model, wind, local_air):
    """Rows of the air of velocities at the hubs and their gradients in body axes, see `plain_derivative`."""
    rows = [np.asarray(wind, dtype=float)]
    for rotor, (gust, slope) in zip(model.aircraft.rotors, local_air, strict=True):
        axes = hub_axes(rotor.shaft_direction)
        rows += [axes.T @ gust, axes.T @ slope @ axes[:, 0], axes.T @ slope @ axes[:, 1]]
    rows.append(np.zeros(air_rows(model.engine.model) - 3 - 9 * len(local_air)))
    return np.concatenate(rows)


@pytest.mark.parametrize("name", ["sbs", "sbs_paper"])
def test_rotors_meet_the_air_of_their_own_places(name):
    """Velocities at the hubs and gradients over the discs, as the plain model has them element by element."""
    aircraft, rng = Aircraft.load(name), np.random.default_rng(3)
    model = Model(aircraft)
    x, psi = random_state(aircraft, rng), np.array([0.3, 1.1])
    swash, wind = rng.normal(scale=0.1, size=(2, 3)), rng.normal(size=3)
    local_air = [(rng.normal(scale=3.0, size=3), rng.normal(scale=2.0, size=(3, 3))) for _ in range(2)]
    expected, _ = plain_derivative(aircraft, x, swash, psi, wind, local_air=local_air)
    found = model.derivative(x, swash, psi, rows_of(model, wind, local_air))
    scale = np.abs(expected).max()
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-11 * scale)
    calm = model.derivative(x, swash, psi, wind)
    assert np.abs(calm - expected)[VELOCITY:].max() > 1e-2 * scale
    nothing = rows_of(model, wind, [(np.zeros(3), np.zeros((3, 3)))] * 2)
    np.testing.assert_array_equal(model.derivative(x, swash, psi, nothing), calm)


def test_a_lateral_gradient_of_a_vertical_gust_is_a_roll_rate_of_the_opposite_sign():
    """W_z = g y is what p = -g is for air loads and inflow, with hubs and blades in the plane of the c.g.

    Inertia takes part in the roll rate alone: what the same state does in vacuum is taken off.
    """
    gradient, velocity, psi, found = 0.9, (8.0, 1.0, -2.0), np.array([0.4, 1.3]), []
    swash = [[0.15, 0.02, -0.03], [0.13, -0.01, 0.02]]
    for density in (1.225, 0.0):
        air = {"air_density": density, "kinematic_viscosity": 1.5e-5, "gravity": 9.81}
        aircraft = build(rotors=[{"hub": [0.02, -0.645, 0.0]}, {"hub": [0.0, 0.66, 0.0]}], environment=air)
        model, slope = Model(aircraft), np.zeros((3, 3))
        slope[2, 1] = gradient
        rows = rows_of(model, np.zeros(3), [(slope @ rotor.hub, slope) for rotor in aircraft.rotors])
        turning, level = (model.state(velocity, (p, 0.0, 0.0), 0.06) for p in (-gradient, 0.0))
        cases = (turning, CALM), (level, rows), (level, CALM)
        found.append([model.derivative(x, swash, psi, wind) for x, wind in cases])
    turning, gust, calm = np.subtract(*found)
    np.testing.assert_allclose(gust, turning, rtol=1e-9, atol=1e-11 * np.abs(turning).max())
    for j in range(2):
        inflow = aircraft.layout.inflow(j)
        np.testing.assert_allclose(found[0][1][inflow], found[0][0][inflow], rtol=1e-9)
        assert np.abs(gust - calm)[inflow].max() > 1e-2 * np.abs(calm[inflow]).max()
    left, right = ((gust - calm)[aircraft.layout.flap_rate(j).start] for j in range(2))
    assert right < 0.0 < left, "air that sinks on the right lifts the blades there less"


def test_parts_of_the_body_meet_the_air_of_their_own_places():
    """Surfaces in air that turns with the body meet no flow; a uniform gust at all parts is a gust at the c.g."""
    aircraft = Aircraft.load("uh60a_genhel").with_value("options.elements", 3)
    model = Model(aircraft)
    count, parts = air_rows(model.engine.model), len(model.engine.model.surfaces) + len(model.engine.model.fuselages)
    x, gust = model.state(velocity=(12.0, 2.0, 1.0)), np.array([1.0, -2.0, 3.0])  # too slow for the schedule
    plate = aircraft.body.flat_plate_areas
    assert parts >= 3
    assert not np.any(plate)
    rows = np.zeros(count)
    first = np.r_[3 : 3 + 9 * len(aircraft.rotors) : 9]
    for j, start in enumerate(first):
        rows[start : start + 3] = hub_axes(aircraft.rotors[j].shaft_direction).T @ gust
    rows[count - 3 * parts :] = np.tile(gust, parts)
    wind = rotation_matrix(x[ATTITUDE:VELOCITY]) @ gust
    found, expected = model.derivative(x, wind=rows), model.derivative(x, wind=wind)
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())
    assert np.abs(model.derivative(x) - expected).max() > 1e-3


# -- what the sites of an aircraft meet ----------------------------------------------------------------------


class Sites:
    """Velocities at the c.g. and at the hubs of an aircraft, NED, in a wind."""

    def __init__(self, aircraft, wind, ground=0.0, start=0.0):
        self.model, self.aircraft = aircraft.model(True, True), aircraft
        self.field = WindField(wind, start, 0.01, ground)
        self.space = joined_spaces(self.model, [self.field.space], 1)

    def at(self, state, time=0.0):
        """Velocity at the c.g. (3,), at hubs (n, 3), and their changes along the x and y axes of hubs (n, 2, 3)."""
        rows = np.zeros((air_rows(self.model), 1))
        wind = self.field.next_tick()
        rows[:3, 0] = wind[:3]
        psi = np.zeros((len(self.aircraft.rotors), 1))
        air_in_space(self.model, state[:, np.newaxis].copy(), psi, wind[:, np.newaxis].copy(), time, self.space, rows)
        attitude, count = rotation_matrix(state[ATTITUDE:VELOCITY]), len(self.aircraft.rotors)
        hubs = rows[3 : 3 + 9 * count, 0].reshape(count, 3, 3)
        axes = [attitude @ hub_axes(rotor.shaft_direction) for rotor in self.aircraft.rotors]
        turned = np.array([hub @ own.T for hub, own in zip(hubs, axes, strict=True)])
        return rows[:3, 0], rows[:3, 0] + turned[:, 0], turned[:, 1:]


def placed(aircraft, point, position, heading=0.0):
    return trimmed_state(aircraft, point, position, heading)


def test_rates_turn_the_air_about_the_cg(sbs, hover):
    """Air that turns: velocity om x r at each hub, and om x e along each axis."""
    wind = Wind(turbulence_intensity=(1.0, 1.0, 1.0), turbulence_extent="rates", turbulence_span=2.0)
    sites, state = Sites(sbs, wind), placed(sbs, hover, (3.0, 4.0, -5.0), 0.7)
    cg, hubs, slopes = sites.at(state)
    rates = sites.field._array[RATES_FROM : RATES_FROM + 3]
    attitude = rotation_matrix(state[ATTITUDE:VELOCITY])
    assert np.abs(rates).min() > 1e-3
    for j, rotor in enumerate(sbs.rotors):
        np.testing.assert_allclose(hubs[j] - cg, np.cross(rates, attitude @ np.array(rotor.hub)), atol=1e-12)
        for k in range(2):
            np.testing.assert_allclose(
                slopes[j, k], np.cross(rates, attitude @ hub_axes(rotor.shaft_direction)[:, k]), atol=1e-12
            )


def test_each_rotor_meets_the_field_where_it_is_and_the_field_drifts_with_the_wind(sbs, hover):
    wind = Wind(velocity=(3.0, -1.0, 0.0), turbulence_intensity=(1.0, 1.0, 0.5), turbulence_extent="field")
    sites, state = Sites(sbs, wind, start=2.0), placed(sbs, hover, (30.0, 4.0, -5.0), 0.7)
    grids, period = field_grids("dryden", 50.0, 50.0, 0)
    attitude, time = rotation_matrix(state[ATTITUDE:VELOCITY]), 7.0
    cg, hubs, slopes = sites.at(state, time)
    places = [state[:3], *(state[:3] + attitude @ np.array(rotor.hub) for rotor in sbs.rotors)]
    points = np.array(places)[:, :2] - 5.0 * np.array([3.0, -1.0])
    found = sampled_at(grids, period, points)
    scale = np.array([1.0, 1.0, 0.5])
    np.testing.assert_allclose([cg, *hubs], np.array(wind.velocity) + scale * found[:, 0], atol=1e-12)
    north, east = scale * found[1:, 1], scale * found[1:, 2]
    for j, rotor in enumerate(sbs.rotors):
        for k in range(2):
            axis = attitude @ hub_axes(rotor.shaft_direction)[:, k]
            np.testing.assert_allclose(slopes[j, k], north[j] * axis[0] + east[j] * axis[1], atol=1e-12)
    assert np.abs(hubs[0] - hubs[1]).max() > 0.01


@pytest.mark.parametrize("shape", ["one_minus_cosine", "ramp"])
def test_a_front_is_met_by_one_rotor_after_the_other(sbs, hover, shape):
    """U / 2 (1 - cos(pi s / H)), at each hub by its own distance s into the gust."""
    rise, peak = 5.0, np.array([0.0, 0.0, 4.0])
    wind = Wind(
        velocity=(-2.0, 0.0, 0.0), gust=tuple(peak), gust_shape=shape, gust_direction=0.5, gust_distance=1.5,
        gust_length=2 * rise if shape == "one_minus_cosine" else rise, gust_origin=(10.0, 20.0, 0.0),
    )  # fmt: skip
    sites, along = Sites(sbs, wind), np.array([math.cos(0.5), math.sin(0.5), 0.0])
    for ahead in (-3.0, 0.4, 2.5, 6.0, 9.0, 14.0):
        position = np.array([10.0, 20.0, -30.0]) + (1.5 + ahead) * along
        state, time = placed(sbs, hover, position - np.array([2.0, 0.0, 0.0]) * 3.0, 0.9), 3.0
        _, hubs, slopes = sites.at(state, time)
        attitude = rotation_matrix(state[ATTITUDE:VELOCITY])
        for j, rotor in enumerate(sbs.rotors):
            s = ahead + attitude @ np.array(rotor.hub) @ along
            inside, end = s > 0.0, 2 * rise if shape == "one_minus_cosine" else rise
            share = (
                0.5 - 0.5 * math.cos(math.pi * s / rise) if inside and s < end else float(inside and shape == "ramp")
            )
            np.testing.assert_allclose(hubs[j], np.array(wind.velocity) + share * peak, atol=1e-12)
            slope = 0.5 * math.pi / rise * math.sin(math.pi * s / rise) if inside and s < end else 0.0
            for k in range(2):
                axis = attitude @ hub_axes(rotor.shaft_direction)[:, k]
                np.testing.assert_allclose(slopes[j, k], slope * (axis @ along) * peak, atol=1e-12)


def test_an_own_gust_over_distance_is_linear_between_its_rows(sbs, hover):
    table = GustTable("distance", [0.0, 4.0, 10.0], [[0.0, 0.0, 1.0], [2.0, 0.0, 3.0], [2.0, -1.0, 0.0]])
    sites = Sites(sbs, Wind(own_gust=table, gust_direction=math.pi / 2))
    for east in (-5.0, 1.0, 4.0, 7.0, 30.0):
        cg, _, _ = sites.at(placed(sbs, hover, (3.0, east, -1.0)))
        np.testing.assert_allclose(
            cg, [np.interp(east, table.positions, row) for row in table.velocities.T], atol=1e-12
        )


@pytest.mark.parametrize(
    ("profile", "share"),
    [
        ("logarithmic", lambda h: math.log(h / 0.03) / math.log(10 / 0.03) if h > 0.03 else 0.0),
        ("power", lambda h: (h / 10) ** 0.2 if h > 0 else 0.0),
    ],
)
def test_the_wind_grows_with_the_height(sbs, hover, profile, share):
    wind = Wind(
        velocity=(6.0, -3.0, 0.5), wind_profile=profile, reference_height=10.0, roughness_length=0.03,
        profile_exponent=0.2,
    )  # fmt: skip
    sites = Sites(sbs, wind, ground=100.0)
    for height in (-1.0, 0.02, 0.5, 2.0, 10.0, 300.0):
        cg, hubs, _ = sites.at(placed(sbs, hover, (1.0, 2.0, -100.0 - height)))
        np.testing.assert_allclose(cg, share(height) * np.array(wind.velocity), rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(wind.velocity_at(height), cg, rtol=1e-12, atol=1e-12)
        above = share(height + -(sbs.rotors[0].hub[2]))
        np.testing.assert_allclose(hubs[0], above * np.array(wind.velocity), rtol=2e-2 if height > 0.5 else 1.0)


# -- the field: spectra of isotropic turbulence in a plane ---------------------------------------------------

LENGTH, SPAN = 20.0, 1.3


def lateral_spectra(omega, d, length):
    """Two-sided cross-spectra over the wave number along of u, v, w at points d apart across, of variance 1.

    From the correlation exp(-r / L) of Dryden's turbulence: the two-dimensional spectra of eq. (7.24), integrated
    over the wave number across with cos(k d) (Gradshteyn and Ryzhik 3.773.6: modified Bessel functions).
    """
    q, b = np.sqrt(1 + (length * omega) ** 2), d / length
    x = b * q
    k1, k2 = (x * kv(1, x), x**2 * kv(2, x)) if d else (np.ones_like(q), 2 * np.ones_like(q))
    # integrals of (q^2 + y^2)^(-3/2) cos(b y) and of (q^2 + y^2)^(-5/2) cos(b y)
    three, five = 2 / q**2 * k1, 2 / (3 * q**4) * k2
    a_all, c_all = three, 3 * (three - five)  # 4 pi / L times A and C
    # with the shares of the wave along x and along y of A and B = A + C: k_x^2 / k^2 C = 3 l^2 Om^2 five
    w = c_all
    u = a_all + 3 * (three - five - (length * omega) ** 2 * five)
    v = a_all + 3 * (length * omega) ** 2 * five
    return length / (4 * np.pi) * np.array([u, v, w])


def sampled_at(grids, period, points):
    """Velocity at points, its derivatives to the north and to the east, and the velocity alone, (n, 4, 3)."""
    out = np.full((len(points), 4, 4), np.nan)
    sample_field(grids, period, np.ascontiguousarray(points), np.zeros((WEIGHTS, 4)), out)
    assert not out[..., 3].any()
    return out[..., :3]


def measured_spectra(model, d, seeds=16):
    """Cross-spectra of u, v, w along lines of flight d apart through fields of several seeds, and the wave numbers."""
    count, step, found = 8192, LENGTHS * LENGTH / 8192, []  # waves that are shorter hardly fold down
    window = np.hanning(count)
    for seed in range(seeds):
        grids, period = field_grids(model, LENGTH, LENGTH, seed)
        total = 0.0
        for line in range(2):
            amplitudes = []
            for side in (0.0, d):
                points = np.column_stack([np.arange(count) * step, np.full(count, 0.5 * line * period + side)])
                out = sampled_at(grids, period, points)[:, 0]
                amplitudes.append(np.fft.rfft(out * window[:, np.newaxis], axis=0))
            total = total + (amplitudes[0].conj() * amplitudes[1]).real
        found.append(total.T / 2 * step / (2 * np.pi * (window**2).sum()))
    return 2 * np.pi * np.fft.rfftfreq(count, step), np.array(found)


BANDS = ((8, 20), (20, 50), (50, 120), (120, 300), (300, 600))


def assert_spectra(found, expected, alone):
    """Sums over bands are within the confidence limits of the mean over the seeds, 4 standard errors, and 2 %."""
    for low, high in BANDS:
        sums, wanted = found[:, :, low:high].sum(axis=2), expected[:, low:high].sum(axis=1)
        error = 4 * sums.std(axis=0, ddof=1) / math.sqrt(len(sums))
        assert (np.abs(sums.mean(axis=0) - wanted) < error + 0.02 * alone[:, low:high].sum(axis=1)).all(), (low, high)
        assert (error < 0.35 * alone[:, low:high].sum(axis=1)).all()


@pytest.mark.parametrize("d", [0.0, SPAN, 10.0])
def test_the_field_has_the_cross_spectra_of_isotropic_turbulence(d):
    """Between two lines of flight, as between two rotors."""
    omega, found = measured_spectra("dryden", d)
    assert_spectra(found, lateral_spectra(omega, d, LENGTH), lateral_spectra(omega, 0.0, LENGTH))


def test_the_field_of_von_karman_has_his_spectra():
    """One-dimensional spectra along and across the flight."""
    omega, found = measured_spectra("von_karman", 0.0)
    x = (1.339 * LENGTH * omega) ** 2
    along = LENGTH / np.pi / (1 + x) ** (5 / 6)
    across = LENGTH / (2 * np.pi) * (1 + 8 / 3 * x) / (1 + x) ** (11 / 6)
    expected = np.array([along, across, across])
    assert_spectra(found, expected, expected)


def test_the_difference_between_two_rotors_has_its_variance():
    """2 sigma^2 (1 - g(d)), with g = exp(-r / L) (1 - r / (2 L)): the roll gust, of the shortest waves."""
    rng, values = np.random.default_rng(1), []
    for seed in range(20):
        grids, period = field_grids("dryden", 50.0, 50.0, seed)
        points = rng.uniform(0, period, (5000, 2))
        left, right = sampled_at(grids, period, points), sampled_at(grids, period, points + [0.0, SPAN])
        values.append(((left - right)[:, 0] ** 2).mean(axis=0))
    f = math.exp(-SPAN / 50)
    expected = 2 * (1 - np.array([f * (1 - SPAN / 100), f, f * (1 - SPAN / 100)]))
    np.testing.assert_allclose(np.mean(values, axis=0), expected, rtol=0.04)


def test_the_field_is_smooth_and_the_same_for_a_seed():
    grids, period = field_grids("dryden", 3.0, 2.0, 5)
    assert period == 120.0
    assert grids.nbytes < 2**23
    points = np.random.default_rng(0).uniform(-500, 500, (200, 2))
    here = sampled_at(grids, period, points)
    np.testing.assert_array_equal(here[:, 3], here[:, 0])  # the velocity alone, for elements of blades
    there = sampled_at(grids[:1], period, points + [period, -2 * period])  # the first level repeats itself
    np.testing.assert_allclose(there, sampled_at(grids[:1], period, points), atol=1e-9)
    for axis in range(2):
        step = 1e-5 * np.eye(2)[axis]
        change = sampled_at(grids, period, points + step) - sampled_at(grids, period, points - step)
        np.testing.assert_allclose(change[:, 0] / 2e-5, here[:, 1 + axis], atol=1e-5)
    field_grids.cache_clear()
    np.testing.assert_array_equal(field_grids("dryden", 3.0, 2.0, 5)[0], grids)
    assert np.abs(field_grids("dryden", 3.0, 2.0, 6)[0] - grids).max() > 0.1


# -- filters -------------------------------------------------------------------------------------------------


def test_campbells_coefficients_are_the_pade_approximant():
    series = [binom(-5 / 6, k) for k in range(6)]
    top, bottom = pade(series, 3, 2)
    numerator, denominator = T.PADE
    np.testing.assert_allclose(np.array(numerator) / numerator[0], top.coef[::-1], rtol=1e-10)
    np.testing.assert_allclose(np.array(denominator) / denominator[0], bottom.coef[::-1], rtol=1e-10)


def transfer(part, ratio, omega):
    """Density of velocity and rate of a discretised component over the frequency in steps, two-sided."""
    a, s = np.array(part.transition), np.array(part.factor)
    found = []
    for w in omega:
        gain = np.linalg.solve(np.exp(1j * w) * np.eye(len(a)) - a, s)
        found.append([(np.abs(np.array(row) @ gain) ** 2).sum() for row in (part.velocity, part.rate)])
    return np.array(found).T * ratio


@pytest.mark.parametrize("karman", [False, True])
@pytest.mark.parametrize("along", [False, True])
def test_filters_have_the_spectra_of_the_specification(karman, along):
    """Exact in discrete time, where the tick is short beside the waves; Campbell's filter is within 10 %."""
    sigma, length, airspeed, span, tick = 1.7, 30.0, 12.0, 2.0, 0.002
    lag = T.PITCH_LAG * span
    part = T.component(karman, along, sigma, length, airspeed, lag, tick)
    wave = np.geomspace(0.02, 20.0, 20) / length  # rad/m
    found = transfer(part, 1.0, wave * airspeed * tick) * tick * airspeed
    scale = 1.339 if karman else 1.0
    x = (scale * length * wave) ** 2
    exponents = (5 / 6, 11 / 6) if karman else (1, 2)
    if along:
        expected = 2 * sigma**2 * length / (1 + x) ** exponents[0]
    else:
        expected = sigma**2 * length * (1 + (8 / 3 if karman else 3) * x) / (1 + x) ** exponents[1]
    tolerance = 0.1 if karman else 2e-3
    np.testing.assert_allclose(found[0], expected, rtol=tolerance)
    # what sampling folds down from above its frequency is the same at all of these
    rates = expected * wave**2 / (1 + (lag * wave) ** 2)
    np.testing.assert_allclose(found[1], rates, rtol=tolerance, atol=2e-5 * rates.max())


def test_a_step_is_exact_however_long_it_is():
    rng = np.random.default_rng(2)
    a = rng.normal(size=(4, 4)) - 4 * np.eye(4)
    drive = np.diag([0.0, 0.0, 0.0, 1.0])
    stationary = solve_continuous_lyapunov(a, -drive)
    for step in (1e-4, 0.1, 3.0):
        transition, noise = T.exact_step(a, drive, step)
        np.testing.assert_allclose(transition, expm(step * a), rtol=1e-10, atol=1e-14)
        expected = stationary - expm(step * a) @ stationary @ expm(step * a).T
        np.testing.assert_allclose(noise, expected, rtol=1e-7, atol=1e-12)


SIGMAS, LENGTHS_OF = (1.5, 1.2, 0.8), (40.0, 40.0, 10.0)


@pytest.fixture(scope="module")
def long_sample():
    """Turbulence with rates, 8000 scale lengths of the vertical component: velocities and rates."""
    filtered = T.FilteredTurbulence("dryden", SIGMAS, LENGTHS_OF, 8.0, 0.0, 2.0, 3, 0.05)
    return filtered.advance(200_000)


def test_velocities_and_rates_have_their_variances(long_sample):
    """Of p_g: 0.8 sigma_w^2 / L_w (pi L_w / 4 b)^(1/3) pi^2 / (8 b), the integral of the specification's spectrum."""
    velocities, rates = long_sample
    np.testing.assert_allclose(velocities.var(axis=0), np.square(SIGMAS), rtol=0.1)
    span, length, sigma = 2.0, LENGTHS_OF[2], SIGMAS[2]
    wave = np.linspace(0, 2000, 2_000_001)
    density = 0.8 * (math.pi * length / (4 * span)) ** (1 / 3) / (1 + (4 * span * wave / math.pi) ** 2)
    expected = sigma**2 / length * np.trapezoid(density, wave)
    assert T.roll_variance(sigma, length, span) == pytest.approx(expected, rel=1e-3)
    # its correlation is exp(-pi V t / 4 b)
    spread = math.sqrt(2 / (200_000 * 0.05) * 4 * span / math.pi / 8.0)
    assert abs(rates[:, 0].var() / expected - 1) < 5 * spread
    lag = 10
    decay = math.exp(-lag * 0.05 * math.pi * 8.0 / (4 * span))
    found = (rates[lag:, 0] * rates[:-lag, 0]).mean() / expected
    assert abs(found - decay) < 5 * spread


def test_rates_follow_the_velocities_as_a_frozen_field_makes_them(long_sample):
    """Air that rises ahead turns nose up: q = -dw/dx, r = dv/dx, with d/dx = d/dt / V, filtered over 4 b / pi."""
    velocities, rates = long_sample
    size, tick = 2000, 0.05
    omega = 2 * math.pi * np.arange(1, 40) / (size * tick)
    for axis, own, sign, lag in ((2, 1, -1, 4 / math.pi), (1, 2, 1, 3 / math.pi)):
        parts = [
            np.fft.rfft(values[: size * 100].reshape(100, size) * np.hanning(size), axis=1)[:, 1:40]
            for values in (velocities[:, axis], rates[:, own])
        ]
        found = (parts[0].conj() * parts[1]).sum(axis=0) / (np.abs(parts[0]) ** 2).sum(axis=0)
        expected = sign * 1j * omega / 8.0 / (1 + 1j * omega * lag * 2.0 / 8.0)
        np.testing.assert_allclose(found[2:], expected[2:], atol=0.03 * np.abs(expected).max())


def test_filtered_turbulence_starts_stationary_and_goes_on_bit_for_bit():
    for karman in (False, True):
        for i in range(3):
            part = T.component(karman, i == 0, SIGMAS[i], LENGTHS_OF[i], 8.0, 2.0, 0.05)
            a, s, start = (np.array(getattr(part, name)) for name in ("transition", "factor", "start"))
            np.testing.assert_allclose(a @ start @ start.T @ a.T + s @ s.T, start @ start.T, rtol=1e-9, atol=1e-12)
            variance = np.sum((np.array(part.velocity) @ start) ** 2)
            # Campbell's filters have less of the shortest waves
            assert variance == pytest.approx(SIGMAS[i] ** 2, rel=0.03 if karman else 1e-9)
    together = T.FilteredTurbulence("von_karman", SIGMAS, LENGTHS_OF, 8.0, 0.3, 2.0, 1, 0.05)
    apart = T.FilteredTurbulence("von_karman", SIGMAS, LENGTHS_OF, 8.0, 0.3, 2.0, 1, 0.05)
    first, second = apart.advance(7), apart.advance(23)
    for own, start, rest in zip(together.advance(30), first, second, strict=True):
        np.testing.assert_array_equal(np.concatenate([start[:-1], rest]), own)


# -- own gusts over time -------------------------------------------------------------------------------------


def test_an_own_gust_over_time_begins_after_its_delay():
    table = GustTable.of(lambda t: (math.sin(t), 0.0, 2.0), 3.0, 0.5)
    field = WindField(Wind(velocity=(1.0, 0.0, 0.0), own_gust=table, gust_delay=1.0), 5.0, 0.25)
    starts = field.next_ticks(20)[:, TURBULENCE_FROM : TURBULENCE_FROM + 3]
    ages = np.arange(20) * 0.25 - 1.0
    expected = np.where(ages >= 0, np.interp(ages, table.positions, np.sin(table.positions)), 0.0)
    np.testing.assert_allclose(starts[:, 0], expected, atol=1e-14)
    np.testing.assert_allclose(starts[:, 2], np.where(ages >= 0, 2.0, 0.0), atol=1e-14)


# -- flights -------------------------------------------------------------------------------------------------

LOCAL = [
    Wind(turbulence_intensity=(1, 1, 1), turbulence_model="von_karman", turbulence_vertical_length=10.0),
    Wind(turbulence_intensity=(1, 1, 1), turbulence_extent="rates", turbulence_span=2.0),
    Wind(velocity=(2.0, 1.0, 0.0), turbulence_intensity=(1, 1, 0.5), turbulence_extent="field", turbulence_seed=4),
    Wind(turbulence_intensity=(1, 1, 1), turbulence_extent="elements", gust=(0, 0, 2.0), gust_length=4.0),
    Wind(velocity=(3.0, 0.0, 0.0), wind_profile="logarithmic"),
    Wind(gust=(0, 0, 3.0), gust_length=4.0, gust_distance=1.0),
    Wind(own_gust=GustTable("distance", [0.0, 2.0], [[0, 0, 0], [0, 0, 2.0]])),
]


def test_a_flight_is_the_same_tick_by_tick_in_one_call_and_side_by_side(sbs, cruise):
    batch = simulate_batch([Case(sbs, cruise, wind=wind) for wind in LOCAL], 0.4, ground_altitude=-20.0)
    assert batch.errors == (None,) * len(LOCAL)
    for wind, found in zip(LOCAL, batch["state"], strict=True):
        alone = simulate(sbs, cruise, cruise.controls, 0.4, wind=wind, ground_altitude=-20.0)
        np.testing.assert_array_equal(alone["state"], found)
        flight = Simulation(
            sbs, trimmed_state(sbs, cruise, wind=wind.velocity_at(20.0)), cruise.swashplate, wind=wind,
            ground_altitude=-20.0,
        )  # fmt: skip
        for _ in range(40):
            flight.advance()
        np.testing.assert_array_equal(flight.state, found[-1])
        now = flight.snapshot()
        np.testing.assert_array_equal(now.acceleration, alone["acceleration"][-1])
        flight.set_wind(Wind())
        assert np.array_equal(flight.snapshot().wind, np.zeros(3))


def test_a_gust_on_one_side_rolls_the_aircraft(sbs, hover):
    """Air that rises to the right lifts the right rotor: the aircraft rolls to the left, p < 0."""
    rising = GustTable("distance", [-2.0, 2.0], [[0, 0, 1.0], [0, 0, -1.0]])
    flight = simulate(sbs, hover, hover.controls, 0.2, wind=Wind(own_gust=rising, gust_direction=math.pi / 2))
    assert flight["p"][-1] < -0.05
    calm = simulate(sbs, hover, hover.controls, 0.2)
    assert abs(flight["w"][-1] - calm["w"][-1]) < 0.02


def test_air_at_blade_elements_is_that_of_rotors_where_it_is_linear(sbs, cruise):
    """Uniform air gives the same bits; a roll gust dw/dy differs by what flap lifts the blades out of their disc."""
    for table, heading, least in (
        (GustTable("distance", [0.0], [[1.0, -2.0, 1.5]]), 0.0, 0.0),
        (GustTable("distance", [-50.0, 50.0], [[0, 0, 5.0], [0, 0, -5.0]]), math.pi / 2, 1e-3),
        (GustTable("distance", [-50.0, 50.0], [[5.0, 0, 5.0], [-5.0, 0, -5.0]]), 0.0, 1e-3),
    ):
        air = Wind(own_gust=table, gust_direction=heading, turbulence_extent="field")
        rotors = simulate(sbs, cruise, cruise.controls, 0.1, wind=air)
        elements = simulate(sbs, cruise, cruise.controls, 0.1, wind=replace(air, turbulence_extent="elements"))
        difference = np.abs(rotors["state"] - elements["state"]).max()
        assert (difference == 0.0) == (least == 0.0)
        assert difference < 1e-6
        if least:
            calm = simulate(sbs, cruise, cruise.controls, 0.1, wind=Wind())
            assert np.abs(calm["state"][-1] - elements["state"][-1]).max() > least


@pytest.mark.parametrize(
    ("fields", "line"),
    [
        ({"turbulence_model": "gauss"}, "turbulence_model = 'gauss': allowed are dryden, von_karman"),
        ({"turbulence_extent": "both"}, "turbulence_extent = 'both': allowed are point, rates, field, elements"),
        (
            {"turbulence_extent": "rates"},
            "turbulence_span = 0: allowed is a span above 0 with turbulence_extent = 'rates'",
        ),
        (
            {"turbulence_extent": "field", "turbulence_intensity": (1, 2, 1)},
            "turbulence_intensity.y = 2: allowed is 1 m/s, that of x, with turbulence_extent = 'field', which is"
            " isotropic in the plane",
        ),
        (
            {"turbulence_extent": "field", "turbulence_lateral_length": 3.0},
            "turbulence_lateral_length = 3: allowed is 50 m, turbulence_length, with turbulence_extent = 'field',"
            " which is isotropic in the plane",
        ),
        (
            {"turbulence_vertical_length": 0.01},
            "turbulence_vertical_length = 0.01: allowed are 0, which is turbulence_length, and 0.1 to 10000 m",
        ),
        ({"turbulence_lateral_length": -1},
         "turbulence_lateral_length = -1: allowed are 0, which is turbulence_length, and 0.1 to 10000 m"),
        ({"turbulence_span": 1e-12}, "turbulence_span = 1e-12: allowed are 0, which is none, and 0.01 to 1000 m"),
        ({"gust_length": 1e-12}, "gust_length = 1e-12: allowed are 0, which is a gust over time, and 0.1 to 1e+06 m"),
        ({"gust": (1, 0, 0), "gust_duration": 1, "gust_length": 2},
         "gust_length = 2: allowed is 0 with gust_duration = 1 s"),
        ({"gust": (1, 0, 0), "gust_duration": 1, "gust_shape": "ramp"},
         "gust_shape = 'ramp': allowed is one_minus_cosine with a gust_duration, over time"),
        ({"gust_origin": (0, 0, math.nan)}, "gust_origin.z = nan: allowed are -1e+08 to 1e+08 m"),
        ({"wind_profile": "logarithmic", "roughness_length": 7.0},
         "roughness_length = 7: allowed is less than reference_height = 6.096 m"),
        ({"own_gust": [1]}, "own_gust = [1]: allowed are objects of the class GustTable"),
    ],
)  # fmt: skip
def test_winds_that_contradict_themselves_are_refused(fields, line):
    with pytest.raises(SimulationError) as caught:
        Wind(**fields)
    assert str(caught.value) == line


@pytest.mark.parametrize(
    ("values", "line"),
    [
        (("height", [0], [[0, 0, 0]]), "own_gust.over = 'height': allowed are time, distance"),
        (("time", [0, 1], [[0, 0, 0]]),
         "own_gust.velocities has shape (1, 3): allowed is (2, 3), north, east, down at each position"),
        (("time", [0, 0], [[0, 0, 0]] * 2), "own_gust.positions[1] = 0: allowed is more than 0, the one before"),
        (("time", [0, 1], [[0, 0, 0], [0, math.nan, 0]]),
         "own_gust.velocities[1].y = nan: allowed are -100 to 100 m/s"),
        (("distance", [0, math.inf], [[0, 0, 0]] * 2),
         "own_gust.positions[1] = inf: allowed are -1e+06 to 1e+06 m"),
    ],
)  # fmt: skip
def test_own_gusts_that_cannot_be_flown_are_refused(values, line):
    with pytest.raises(SimulationError) as caught:
        GustTable(*values)
    assert str(caught.value) == line
