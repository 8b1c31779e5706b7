"""Motion of an aircraft as other simulators speak of it: pose, twist and acceleration in the axes of the world.

World axes are east, north, up, body axes forward, left, up (REP 103). Twist and acceleration are those of the c.g., in
world axes, as simulation_interfaces asks; `odom` has them in body axes.
"""

from collections.abc import Sequence

import numpy as np
from geometry_msgs.msg import Accel, Point, Pose, Quaternion, Twist, Vector3
from numpy.typing import NDArray

from sbs_sim import checks
from sbs_sim.errors import SimulationError
from sbs_sim.flight.records import Snapshot
from sbs_sim.model import state as S
from sbs_sim.model.frames import rotation_matrix
from sbs_sim.nodes.conversions import enu_flu_quaternion, point_array

Array = NDArray[np.float64]

LEAST_NORM, LARGEST_NORM = 0.5, 2.0  # of a quaternion that is given


def motion_of(snapshot: Snapshot) -> tuple[Pose, Twist, Accel]:
    """Pose, twist and acceleration of a snapshot that has the derivative of the state."""
    state, to_earth = snapshot.state, rotation_matrix(snapshot.state[S.ATTITUDE : S.VELOCITY])
    w, x, y, z = enu_flu_quaternion(state[S.ATTITUDE : S.VELOCITY].tolist())
    position = other_axes(state[: S.ATTITUDE]).tolist()
    pose = Pose(position=Point(**dict(zip("xyz", position, strict=True))), orientation=Quaternion(w=w, x=x, y=y, z=z))
    rates, changes = state[S.RATES : S.BODY_SIZE], snapshot.derivative[S.RATES : S.BODY_SIZE]
    twist = Twist(linear=_world(to_earth @ state[S.VELOCITY : S.RATES]), angular=_world(to_earth @ rates))
    # the turning of the axes adds omega x omega = 0 to the angular one
    return pose, twist, Accel(linear=_world(to_earth @ snapshot.acceleration), angular=_world(to_earth @ changes))


def moved(body: Array, pose: Pose | None = None, twist: Twist | None = None) -> Array:
    """Motion of a body, shape (13,), with another pose or twist; what is not given stays, in world axes.

    Raises
    ------
    SimulationError
        The orientation is no unit quaternion.
    """
    to_earth = rotation_matrix(body[S.ATTITUDE : S.VELOCITY])
    position, attitude = body[: S.ATTITUDE], body[S.ATTITUDE : S.VELOCITY]
    velocity, rates = to_earth @ body[S.VELOCITY : S.RATES], to_earth @ body[S.RATES : S.BODY_SIZE]
    if pose is not None:
        position, attitude = other_axes(point_array(pose.position)), _attitude(pose.orientation)
    if twist is not None:
        velocity, rates = other_axes(point_array(twist.linear)), other_axes(point_array(twist.angular))
    to_body = rotation_matrix(attitude).T
    return np.concatenate([position, attitude, to_body @ velocity, to_body @ rates])


def other_axes(vector: Array) -> Array:
    """A vector of north, east, down in east, north, up, and the other way round."""
    return np.array([vector[1], vector[0], -vector[2]])


def _attitude(orientation: Quaternion) -> Array:
    given: Sequence[float] = (orientation.w, orientation.x, orientation.y, orientation.z)
    norm = float(np.linalg.norm(given))
    checks.number("norm of pose.orientation", norm, LEAST_NORM, LARGEST_NORM, "", SimulationError)
    return np.array(enu_flu_quaternion(given)) / norm  # the half turns are their own inverses


def _world(vector: Array) -> Vector3:
    x, y, z = other_axes(vector).tolist()
    return Vector3(x=x, y=y, z=z)
