"""Frames and attitude: earth NED, body FRD, hub axes (theory.md section 1).

Euler angles are yaw, pitch, roll (psi, theta, phi), applied in that order. A quaternion is (w, x, y, z) and
takes body components to earth components; R_NB is the same as a matrix.
"""

from __future__ import annotations  # `help` then shows types by their names

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sbs_sim.lanes import Matrix, Vector, as_lanes, as_records, cross, dot, maximum, minimum, sqrt
from sbs_sim.model.kernel import entry, kernel
from sbs_sim.model.trigonometry import TINY, angle_of, cosine_sine, inverse_root

Array = NDArray[np.float64]


ONE = np.zeros(1, [("lanes", float, (1,))])  # record of a single lane


def cross_matrix(vector: Array) -> Array:
    """Matrix of the cross product from the left, shape (3, 3)."""
    x, y, z = vector.tolist()
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def euler_to_quaternion(yaw: float, pitch: float, roll: float) -> Array:
    """Quaternion (w, x, y, z), body to earth, of Euler angles [rad] (Stevens and Lewis, section 1.3)."""
    quaternion = np.empty((4, 1))
    _quaternion_of(np.array([[yaw], [pitch], [roll]], dtype=float), ONE, quaternion)
    return quaternion[:, 0]


@entry
def _quaternion_of(angles, like, out):
    """Quaternions, shape (4, n), of yaw, pitch and roll, (3, n); `like` are records of n lanes."""
    records = as_records(like)
    given, quaternion = as_lanes(angles, records), as_lanes(out, records)
    cy, sy = cosine_sine(0.5 * given[0])
    cp, sp = cosine_sine(0.5 * given[1])
    cr, sr = cosine_sine(0.5 * given[2])
    quaternion[0], quaternion[1] = cr * cp * cy + sr * sp * sy, sr * cp * cy - cr * sp * sy
    quaternion[2], quaternion[3] = cr * sp * cy + sr * cp * sy, cr * cp * sy - sr * sp * cy


def quaternion_to_euler(quaternion: ArrayLike) -> tuple[float, float, float]:
    """Yaw, pitch, roll [rad] of a unit quaternion (w, x, y, z); pitch within +-pi/2."""
    yaw, pitch, roll = euler_angles(np.array(quaternion, dtype=float).reshape(1, 4))[0].tolist()
    return yaw, pitch, roll


@entry
def _angles_of(quaternions, like, out):
    """Yaw, pitch and roll, shape (m, 3, n), of quaternions, (m, 4, n); `like` are records of n lanes."""
    records = as_records(like)
    given, angles = as_lanes(quaternions, records), as_lanes(out, records)
    for i in range(given.shape[0]):
        w, x, y, z = given[i, 0], given[i, 1], given[i, 2], given[i, 3]
        sine = minimum(maximum(2.0 * (w * y - z * x), -1.0), 1.0)
        angles[i, 0] = direction(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
        angles[i, 1] = angle_of(sine, sqrt(1.0 - sine * sine), 1.0)
        angles[i, 2] = direction(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))


@kernel
def direction(y, x):
    """Angle of the point (x, y) from the x axis [rad]; 0 at the origin."""
    return angle_of(y, x, inverse_root(x * x + y * y + TINY))


def euler_angles(quaternions: Array) -> Array:
    """Yaw, pitch, roll [rad], shape (n, 3), of unit quaternions (w, x, y, z), shape (n, 4); pitch within +-pi/2."""
    given = np.array(quaternions, dtype=float, order="C").reshape(-1, 4)
    angles = np.empty((len(given), 3))
    _angles_of(given[..., np.newaxis], ONE, angles[..., np.newaxis])
    return angles


def down_of(quaternions: Array) -> Array:
    """Body components of the direction down, shape (n, 3), at attitudes (w, x, y, z), (n, 4)."""
    w, x, y, z = quaternions.T
    return np.stack([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)], axis=1)


def to_body(quaternions: Array, vectors: Array) -> Array:
    """Body components of vectors in earth components, both (n, 3), at attitudes (w, x, y, z), (n, 4)."""
    w, axis = quaternions[:, :1], -quaternions[:, 1:]  # the conjugate turns back
    turned = 2.0 * np.cross(axis, vectors)
    return np.asarray(vectors + w * turned + np.cross(axis, turned))


def rotation_matrix(quaternion: ArrayLike) -> Array:
    """R_NB, shape (3, 3), of a unit quaternion (w, x, y, z): earth components = R_NB @ body components."""
    w, x, y, z = np.asarray(quaternion, dtype=float)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def hub_axes(shaft_direction: ArrayLike) -> Array:
    """Hub axes in body components for a shaft that points along `shaft_direction`.

    The axes are the body's own, turned by the smallest rotation that takes "up", (0, 0, -1), to the shaft, so
    that a tail rotor's forward axis is the body's and small incidences tilt the hub about body axes.

    Parameters
    ----------
    shaft_direction : array_like, shape (3,)
        The up vector u of the hub, along which thrust acts; any length but zero.

    Returns
    -------
    ndarray, shape (3, 3)
        Columns x_h, y_h, z_h = -u in body components.
    """
    x, y, z = (float(value) for value in np.asarray(shaft_direction, dtype=float))
    length = math.sqrt(x * x + y * y + z * z)
    x, y, z = x / length, y / length, z / length
    # the axis up x shaft has no part along z, and its length is the sine
    axis_x, axis_y, cosine = y, -x, -z
    sine_squared = axis_x * axis_x + axis_y * axis_y
    if sine_squared == 0.0:  # straight down, every half turn is as small as the other: take the one about x
        return np.eye(3) if cosine > 0 else np.diag([1.0, -1.0, -1.0])
    # (1 - cos) / sin^2 instead of 1 / (1 + cos): the latter loses its digits near a shaft that points down
    share = (1.0 - cosine) / sine_squared
    xx, yy, xy = -(axis_y * axis_y) * share, -(axis_x * axis_x) * share, axis_x * axis_y * share
    return np.array([[1.0 + xx, xy, axis_y], [xy, 1.0 + yy, -axis_x], [-axis_y, axis_x, 1.0 - sine_squared * share]])


class Quaternion(NamedTuple):
    """Attitude, body to earth; the vector part is x, y, z."""

    w: Any
    x: Any
    y: Any
    z: Any


@kernel
def rotation(attitude):
    """R_NB of a unit quaternion, eq. (1.1): `R_NB @ body` has earth axes, `transposed(R_NB) @ earth` body axes."""
    w, x, y, z = attitude
    return Matrix(
        Vector(1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)),
        Vector(2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)),
        Vector(2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)),
    )


@kernel
def quaternion_rates(attitude, omega):
    """Time derivative of the attitude quaternion for the body's angular velocity [rad/s], eq. (1.2)."""
    vector = Vector(attitude.x, attitude.y, attitude.z)
    turning = omega * attitude.w + cross(vector, omega)
    return Quaternion(-0.5 * dot(vector, omega), 0.5 * turning.x, 0.5 * turning.y, 0.5 * turning.z)


@kernel
def shaft_down(hub_axes):
    """z_h in body axes: the unit vector along the shaft against the thrust, third column of the hub axes."""
    return Vector(hub_axes.x.z, hub_axes.y.z, hub_axes.z.z)
