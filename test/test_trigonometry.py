"""The branch-free functions of angles against those of the C library."""

import math

import numba
import numpy as np
import pytest

from sbs_sim.model.trigonometry import arctangent2, cosine_sine


@numba.njit
def rotate(angles, out):
    """Cosines and sines of an array."""
    for i in range(angles.size):
        out[0, i], out[1, i] = cosine_sine(angles[i])


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


def test_arctangent():
    angles = np.linspace(-math.pi, math.pi, 10001)[1:-1]
    for radius in (1e-200, 1e-3, 1.0, 1e200):
        found = [arctangent2(radius * math.sin(angle), radius * math.cos(angle)) for angle in angles[::50]]
        np.testing.assert_allclose(found, angles[::50], rtol=0, atol=1e-14)
    assert arctangent2(0.0, 0.0) == 0.0
    assert arctangent2(0.0, -1.0) == pytest.approx(math.pi, abs=1e-15)
