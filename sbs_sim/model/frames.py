"""Frames and attitude: earth NED, body FRD, hub axes (theory.md section 1).

Euler angles are yaw, pitch, roll (psi, theta, phi), applied in that order. A quaternion is (w, x, y, z) and
takes body components to earth components; R_NB is the same as a matrix.
"""

from __future__ import annotations  # `help` then shows types by their names

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sbs_sim.model.kernel import kernel

Array = NDArray[np.float64]


def euler_to_quaternion(yaw: float, pitch: float, roll: float) -> Array:
    """Quaternion (w, x, y, z), body to earth, of Euler angles [rad] (Stevens and Lewis, section 1.3)."""
    cy, sy = math.cos(yaw / 2), math.sin(yaw / 2)
    cp, sp = math.cos(pitch / 2), math.sin(pitch / 2)
    cr, sr = math.cos(roll / 2), math.sin(roll / 2)
    return np.array(
        [
            cr * cp * cy + sr * sp * sy,
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
        ]
    )


def quaternion_to_euler(quaternion: ArrayLike) -> tuple[float, float, float]:
    """Yaw, pitch, roll [rad] of a unit quaternion (w, x, y, z); pitch within +-pi/2."""
    w, x, y, z = (float(value) for value in np.asarray(quaternion))
    yaw = math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    pitch = math.asin(max(-1.0, min(1.0, 2 * (w * y - z * x))))
    roll = math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    return yaw, pitch, roll


def euler_angles(quaternions: Array) -> Array:
    """Yaw, pitch, roll [rad], shape (n, 3), of unit quaternions (w, x, y, z), shape (n, 4); pitch within +-pi/2."""
    w, x, y, z = np.asarray(quaternions).T
    yaw = np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    pitch = np.arcsin(np.clip(2 * (w * y - z * x), -1.0, 1.0))
    roll = np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    return np.stack([yaw, pitch, roll], axis=1)


def to_body(quaternions: Array, vectors: Array) -> Array:
    """Body components of vectors in earth components, both (n, 3), at attitudes (w, x, y, z), (n, 4)."""
    w, axis = quaternions[:, :1], -quaternions[:, 1:]  # the conjugate turns back
    turned = 2.0 * np.cross(axis, vectors)
    return np.asarray(vectors + w * turned + np.cross(axis, turned))


def rotation_matrix(quaternion: ArrayLike) -> Array:
    """R_NB, shape (3, 3), of a unit quaternion (w, x, y, z): earth components = R_NB @ body components."""
    w, x, y, z = np.asarray(quaternion, dtype=float)
    return np.array(rotation_rows(w, x, y, z)).reshape(3, 3)


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
    up = np.array([0.0, 0.0, -1.0])
    shaft = np.asarray(shaft_direction, dtype=float)
    shaft = shaft / np.linalg.norm(shaft)
    cosine = float(up @ shaft)
    axis = np.cross(up, shaft)
    sine_squared = float(axis @ axis)
    if sine_squared == 0.0:  # straight down, every half turn is as small as the other: take the one about x
        return np.eye(3) if cosine > 0 else np.diag([1.0, -1.0, -1.0])
    skew = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    # (1 - cos) / sin^2 instead of 1 / (1 + cos): the latter loses its digits near a shaft that points down
    return np.eye(3) + skew + (1 - cosine) / sine_squared * (skew @ skew)


@kernel
def rotation_rows(w, x, y, z):
    """Nine elements of R_NB, row by row, of a unit quaternion."""
    return (
        1 - 2 * (y * y + z * z),
        2 * (x * y - w * z),
        2 * (x * z + w * y),
        2 * (x * y + w * z),
        1 - 2 * (x * x + z * z),
        2 * (y * z - w * x),
        2 * (x * z - w * y),
        2 * (y * z + w * x),
        1 - 2 * (x * x + y * y),
    )


@kernel
def quaternion_rates(w, x, y, z, p, q, r):
    """Time derivative of the attitude quaternion for body rates p, q, r [rad/s]."""
    return (
        0.5 * (-x * p - y * q - z * r),
        0.5 * (w * p + y * r - z * q),
        0.5 * (w * q + z * p - x * r),
        0.5 * (w * r + x * q - y * p),
    )


@kernel
def cross(ax, ay, az, bx, by, bz):
    """Vector product of two triples."""
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
