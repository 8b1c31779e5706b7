"""Frames and attitude, against rotations of another make."""

import math

import numba
import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from sbs_sim.lanes import Vector, as_lanes, as_records
from sbs_sim.model.frames import (
    ONE,
    Quaternion,
    euler_angles,
    euler_to_quaternion,
    hub_axes,
    quaternion_rates,
    quaternion_to_euler,
    rotation,
    rotation_matrix,
    to_body,
)


@numba.njit
def _attitude(like, given, out):
    records = as_records(like)
    v, found = as_lanes(given, records), as_lanes(out, records)
    attitude = Quaternion(v[0], v[1], v[2], v[3])
    matrix = rotation(attitude)
    for i, row in enumerate((matrix.x, matrix.y, matrix.z)):
        found[3 * i], found[3 * i + 1], found[3 * i + 2] = row.x, row.y, row.z
    found[9], found[10], found[11], found[12] = quaternion_rates(attitude, Vector(v[4], v[5], v[6]))


def attitude(quaternion, rates=(0.0, 0.0, 0.0)):
    """What compiled code makes of an attitude: R_NB, shape (3, 3), and the quaternion's rates, shape (4,)."""
    out = np.empty((13, 1))
    _attitude(ONE, np.array([*quaternion, *rates])[:, np.newaxis], out)
    return out[:9, 0].reshape(3, 3), out[9:, 0]


ANGLE = st.floats(-math.pi, math.pi)
PITCH = st.floats(-math.pi / 2 + 1e-3, math.pi / 2 - 1e-3)
COMPONENT = st.floats(-10.0, 10.0)
VECTOR = st.tuples(COMPONENT, COMPONENT, COMPONENT)


def body_to_earth(yaw, pitch, roll):
    """Yaw, then pitch, then roll, each about the axis as turned by those before."""
    return Rotation.from_euler("ZYX", [yaw, pitch, roll])


def wxyz(rotation):
    return rotation.as_quat(scalar_first=True)


@given(ANGLE, PITCH, ANGLE)
def test_euler_angles_to_quaternion(yaw, pitch, roll):
    ours, other = euler_to_quaternion(yaw, pitch, roll), wxyz(body_to_earth(yaw, pitch, roll))
    # a quaternion and its negative are one attitude
    assert abs(ours @ other) == pytest.approx(1.0, abs=1e-14)
    assert np.linalg.norm(ours) == pytest.approx(1.0, abs=1e-15)


@given(ANGLE, PITCH, ANGLE)
def test_quaternion_to_euler_angles_and_back(yaw, pitch, roll):
    found = quaternion_to_euler(euler_to_quaternion(yaw, pitch, roll))
    assert found[1] == pytest.approx(pitch, abs=1e-9)
    for angle, expected in ((found[0], yaw), (found[2], roll)):
        assert math.remainder(angle - expected, 2 * math.pi) == pytest.approx(0.0, abs=1e-9)
    negative = quaternion_to_euler(-euler_to_quaternion(yaw, pitch, roll))
    assert negative == pytest.approx(found, abs=1e-12)


@pytest.mark.parametrize("pitch", [math.pi / 2, -math.pi / 2])
def test_euler_angles_of_an_aircraft_that_points_straight_up_or_down(pitch):
    """Yaw and roll are one turn then; the angles must be finite and describe the same attitude."""
    quaternion = euler_to_quaternion(0.3, pitch, 0.1)
    angles = quaternion_to_euler(quaternion)
    assert angles[1] == pytest.approx(pitch, abs=1e-6)
    nose = rotation_matrix(quaternion)[:, 0]
    np.testing.assert_allclose(body_to_earth(*angles).apply([1.0, 0.0, 0.0]), nose, atol=1e-6)


def test_signs_of_the_euler_angles():
    """Nose to the east, up, right side down."""
    east = rotation_matrix(euler_to_quaternion(math.pi / 2, 0.0, 0.0)) @ [1.0, 0.0, 0.0]
    np.testing.assert_allclose(east, [0.0, 1.0, 0.0], atol=1e-15)
    nose = rotation_matrix(euler_to_quaternion(0.0, 0.1, 0.0)) @ [1.0, 0.0, 0.0]
    np.testing.assert_allclose(nose, [math.cos(0.1), 0.0, -math.sin(0.1)], atol=1e-15)
    right = rotation_matrix(euler_to_quaternion(0.0, 0.0, 0.1)) @ [0.0, 1.0, 0.0]
    np.testing.assert_allclose(right, [0.0, math.cos(0.1), math.sin(0.1)], atol=1e-15)


@given(ANGLE, PITCH, ANGLE)
def test_rotation_matrix(yaw, pitch, roll):
    quaternion = euler_to_quaternion(yaw, pitch, roll)
    expected = body_to_earth(yaw, pitch, roll).as_matrix()
    np.testing.assert_allclose(rotation_matrix(quaternion), expected, atol=1e-14)
    np.testing.assert_allclose(attitude(quaternion)[0], expected, atol=1e-14)


@given(ANGLE, PITCH, ANGLE, VECTOR)
def test_quaternion_rates_turn_the_body_at_its_angular_velocity(yaw, pitch, roll, rates):
    quaternion = euler_to_quaternion(yaw, pitch, roll)
    step = 1e-4
    placed = Rotation.from_quat(quaternion, scalar_first=True)

    def turned(sign):
        later = wxyz(placed * Rotation.from_rotvec(sign * step * np.array(rates)))
        return later * math.copysign(1.0, later @ quaternion)

    expected = (turned(1) - turned(-1)) / (2 * step)
    np.testing.assert_allclose(attitude(quaternion, rates)[1], expected, atol=1e-4)


@given(ANGLE, PITCH, ANGLE, VECTOR)
def test_arrays_of_attitudes(yaw, pitch, roll, vector):
    """Vectors seen from the body, and Euler angles, of many attitudes at once."""
    quaternion = euler_to_quaternion(yaw, pitch, roll)
    both = np.array([quaternion, [1.0, 0.0, 0.0, 0.0]])
    seen = to_body(both, np.array([vector, vector]))
    np.testing.assert_allclose(seen, [rotation_matrix(quaternion).T @ vector, vector], atol=1e-13)
    np.testing.assert_allclose(euler_angles(both), [quaternion_to_euler(quaternion), (0, 0, 0)], atol=1e-9)


@given(VECTOR)
def test_hub_axes_are_the_bodys_turned_by_the_smallest_rotation(shaft):
    length = np.linalg.norm(shaft)
    assume(length > 1e-3)
    up = np.array(shaft) / length
    assume(up[2] < 1 - 1e-9)
    axes = hub_axes(shaft)
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-9)
    assert np.linalg.det(axes) == pytest.approx(1.0, abs=1e-9)
    np.testing.assert_allclose(axes[:, 2], -up, atol=1e-9)
    # no rotation is smaller than the angle between "up" and the shaft
    angle = Rotation.from_matrix(axes).magnitude()
    assert angle == pytest.approx(math.atan2(math.hypot(up[0], up[1]), -up[2]), abs=1e-6)


def test_hub_axes_of_known_shafts():
    np.testing.assert_array_equal(hub_axes([0.0, 0.0, -3.0]), np.eye(3))
    # a tail rotor that pushes to the right keeps the body's forward axis
    np.testing.assert_allclose(hub_axes([0.0, 1.0, 0.0]), [[1, 0, 0], [0, 0, -1], [0, 1, 0]], atol=1e-15)
    # a propeller that pulls forwards keeps the body's right axis
    np.testing.assert_allclose(hub_axes([2.0, 0.0, 0.0]), [[0, 0, -1], [0, 1, 0], [1, 0, 0]], atol=1e-15)


@pytest.mark.parametrize("tilt", [0.0, 1e-13, 1e-4, 1e-3, 0.1])
def test_hub_axes_of_a_shaft_that_points_down(tilt):
    axes = hub_axes([math.sin(tilt), 0.0, math.cos(tilt)])
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-7)
    assert np.linalg.det(axes) == pytest.approx(1.0, abs=1e-7)
    np.testing.assert_allclose(axes[:, 2], [-math.sin(tilt), 0.0, -math.cos(tilt)], atol=1e-7)


@pytest.mark.parametrize("angle", [1e-3, 1e-5, 1e-6, 1e-8, 1e-12])
def test_hub_axes_are_orthonormal_close_to_straight_down_and_straight_up(angle):
    for down in (1.0, -1.0):
        shaft = np.array([math.sin(angle), 0.3 * math.sin(angle), down * math.cos(angle)])
        axes = hub_axes(shaft)
        np.testing.assert_allclose(axes.T @ axes, np.eye(3), atol=1e-12)
        np.testing.assert_allclose(axes[:, 2], -shaft / np.linalg.norm(shaft), atol=1e-12)
