"""The branch-free functions of angles against those of the C library."""

import math
from decimal import Decimal, localcontext

import numba
import numpy as np
import pytest

from sbs_sim.lanes import as_lanes, as_records
from sbs_sim.model import elementary
from sbs_sim.model.frames import ONE
from sbs_sim.model.noise import logarithm, normal
from sbs_sim.model.trigonometry import angle_of, cosine_sine, inverse_root


@numba.njit
def _rotate(angles, like, out):
    records = as_records(like)
    given, found = as_lanes(angles, records), as_lanes(out, records)
    for i in range(given.shape[0]):
        found[0, i], found[1, i] = cosine_sine(given[i])


def rotate(angles, out):
    """Cosines and sines of an array."""
    found = np.empty((2, len(angles), 1))
    _rotate(angles[:, np.newaxis], ONE, found)
    out[:] = found[..., 0]


@numba.njit
def _angles(points, like, out):
    records = as_records(like)
    given, found = as_lanes(points, records), as_lanes(out, records)
    for i in range(found.shape[0]):
        y, x = given[i, 0], given[i, 1]
        found[i] = angle_of(y, x, inverse_root(y * y + x * x))


def angles_of(points, n=1):
    """Angles of points (y, x), as many at once as there are lanes."""
    out = np.empty((len(points) // n, n))
    lanes = np.ascontiguousarray(points.reshape(-1, n, 2).transpose(0, 2, 1))
    _angles(lanes, np.zeros(1, [("lanes", float, (n,))]), out)
    return out.ravel()


@pytest.mark.parametrize(("turns", "error"), [(0.5, 1e-15), (3, 3e-15), (1000, 1e-12)])
def test_cosine_and_sine(turns, error):
    angles = np.concatenate([np.linspace(-turns, turns, 4001) * 2 * math.pi, np.arange(-8, 9) * math.pi / 4])
    out = np.empty((2, angles.size))
    rotate(angles, out)
    np.testing.assert_allclose(out, [np.cos(angles), np.sin(angles)], rtol=0, atol=error)
    np.testing.assert_allclose(np.hypot(*out), 1, rtol=0, atol=1e-15)


def test_small_angles_keep_their_digits():
    angles = np.array([0.0, 1e-300, -1e-12, 1e-5])
    out = np.empty((2, angles.size))
    rotate(angles, out)
    np.testing.assert_allclose(out[1], np.sin(angles), rtol=1e-15)


@pytest.mark.parametrize("angle", [math.nan, math.inf, -math.inf])
def test_what_is_no_angle_gives_nan(angle):
    out = np.empty((2, 1))
    rotate(np.array([angle]), out)
    assert np.isnan(out).all()


@pytest.mark.parametrize("radius", [1e-100, 1e-3, 1.0, 1e100])
def test_angles_of_points(radius):
    angles = np.linspace(-math.pi, math.pi, 10001)[1:-1][:9996]
    points = radius * np.stack([np.sin(angles), np.cos(angles)], axis=1)
    found = angles_of(points)
    np.testing.assert_allclose(found, np.arctan2(*points.T), rtol=4e-16, atol=4e-16)
    # what the quick way of points near the axis gives are the bits of the other one
    for n in (4,):
        np.testing.assert_array_equal(angles_of(points, n), found)


def test_angles_on_the_axes():
    found = angles_of(np.array([[0.0, 2.0], [3.0, 0.0], [0.0, -2.0], [-3.0, 0.0]]))
    np.testing.assert_allclose(found, [0.0, math.pi / 2, math.pi, -math.pi / 2], rtol=2e-16)


# -- once per aircraft or wind -------------------------------------------------------------------------------


@pytest.mark.parametrize("x", [0.0, 1e-300, -1e-9, 0.3, -2.5, 20.0, -700.0])
def test_exponentials_are_rounded_right(x):
    with localcontext() as context:
        context.prec = 400  # 1e-300 beside one
        exact = Decimal(x).exp()
        assert elementary.exponential(x) == float(exact)
        assert elementary.exponential_less_one(x) == pytest.approx(float(exact - 1), rel=1e-15)


@pytest.mark.parametrize("angle", [0.0, 1e-9, 0.7, -math.pi / 2, math.pi, 4.0, -100.3, 1e6])
def test_cosine_and_sine_are_rounded_right(angle):
    cosine, sine = elementary.cosine_and_sine(angle)
    assert cosine == pytest.approx(math.cos(angle), rel=2e-16, abs=0)
    assert sine == pytest.approx(math.sin(angle), rel=2e-16, abs=0)
    assert elementary.cosine_and_sine(math.pi / 3)[0] == 0.5000000000000001  # of the number that stands for 60 deg


# -- noise ---------------------------------------------------------------------------------------------------


@numba.njit
def _logarithms(x, out):
    for i in range(x.size):
        out[i] = logarithm(x[i])


def test_logarithm():
    x = np.concatenate([np.geomspace(2.0**-54, 1.0, 2001), 1 - np.geomspace(1e-16, 0.5, 500), np.geomspace(1, 1e300)])
    out = np.empty(x.size)
    _logarithms(x, out)
    np.testing.assert_allclose(out, np.log(x), rtol=1e-15)


def test_noise_is_normal_and_independent():
    """Moments of the standard normal distribution 0, 1, 0, 3, their spreads sqrt(1, 2, 15, 96) / sqrt(N)."""
    noise = normal(np.random.PCG64(3), 200_000)
    spread = 4 / math.sqrt(noise.size)
    for power, (moment, deviation) in enumerate([(0, 1), (1, 2), (0, 15), (3, 96)], 1):
        assert abs((noise**power).mean() - moment) < spread * math.sqrt(deviation), power
    first, second = noise.T
    for a, b in ((first, second), (first[1:], second[:-1]), (first**2 - 1, second**2 - 1)):
        assert abs((a * b).mean()) < spread * 1.5 * a.std() * b.std()
    # as many beyond four deviations as there should be, 6.3e-5
    assert 6 < (abs(noise) > 4).sum() < 60


def test_noise_goes_on_where_it_ended():
    source = np.random.PCG64(8)
    parts = [normal(source, count) for count in (1, 0, 5, 10)]
    np.testing.assert_array_equal(np.concatenate(parts), normal(np.random.PCG64(8), 16))
