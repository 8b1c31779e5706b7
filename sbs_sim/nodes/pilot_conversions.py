"""Messages of the pilots: states and targets to arrays, controls to messages.

Positions inside are NED, attitudes FRD to NED; targets may come in the axes of REP 103 too (ENU, FLU).
"""

import math
from collections.abc import Sequence

import numpy as np
from builtin_interfaces.msg import Time
from geometry_msgs.msg import PoseStamped, TwistStamped
from numpy.typing import NDArray

from sbs_msgs.msg import Controls, FlightEvent, LinearModel
from sbs_sim.errors import PilotError
from sbs_sim.model.frames import quaternion_to_euler, rotation_matrix
from sbs_sim.nodes.conversions import (
    FRAME_BASE,
    FRAME_NED,
    FRAME_ODOM,
    controls_array,
    controls_of,
    enu_flu_quaternion,
    point_array,
    to_seconds,
)
from sbs_sim.nodes.number_fields import check_numbers
from sbs_sim.pilot.hover_hold import HoverModel, checked_body, pilot_axes

Array = NDArray[np.float64]

MAX_TILT = math.radians(10.0)  # of a target, of which only the heading can be held


def controls_message(controls: Array, stamp: Time) -> Controls:
    """Message of the pilot controls of the four axes [rad], shape (4,)."""
    message = controls_of(controls)
    message.header.stamp = stamp
    return message


def check_event(message: FlightEvent) -> None:
    """Raise PilotError for an event that no pilot can begin from: numbers that are not finite, half a state."""
    if not np.all(np.isfinite(message.swashplate)):
        raise PilotError(f"swashplate = {list(message.swashplate)}: allowed are finite numbers")
    if message.kind in (FlightEvent.START, FlightEvent.RESET):
        checked_body(to_seconds(message.header.stamp), message.state)


def hover_model(message: LinearModel, control_axes: Sequence[str]) -> HoverModel:
    """What a design takes of a linear model of hover, with the controls of the four axes only.

    Raises
    ------
    PilotError
        The model is not one of hover.
    """
    n, m = len(message.state_names), len(message.control_names)
    axes = pilot_axes(control_axes, message.control_units)
    point = message.trim
    return HoverModel.checked(
        point.condition,
        tuple(message.state_names),
        np.reshape(message.a, (n, n)),
        np.reshape(message.b, (n, m))[:, axes],
        controls_array(point.controls),
        point.pitch,
        point.roll,
        np.arange(len(axes)),
    )


def to_target(message: PoseStamped) -> tuple[Array, float]:
    """Position, NED [m], shape (3,), and heading [rad] of a pose in "ned" (of FRD) or in "odom" (ENU, of FLU).

    Raises
    ------
    PilotError
        Another frame, a number that is not finite, no unit quaternion, or an attitude that cannot be held.
    """
    frame = message.header.frame_id
    if frame not in (FRAME_NED, FRAME_ODOM):
        raise PilotError(f"frame_id = {frame!r}: allowed are {FRAME_NED!r}, {FRAME_ODOM!r}")
    check_numbers(message.pose, error=PilotError)
    point, turn = message.pose.position, message.pose.orientation
    for name, part in (("position", point), ("orientation", turn)):
        for axis in part.get_fields_and_field_types():
            if not math.isfinite(getattr(part, axis)):
                raise PilotError(f"{name}.{axis} = {getattr(part, axis)}: allowed are finite numbers")
    quaternion = (turn.w, turn.x, turn.y, turn.z)
    norm = math.hypot(*quaternion)
    if not 0.99 <= norm <= 1.01:
        raise PilotError(f"orientation has a norm of {norm:g}: allowed is a unit quaternion")
    position = point_array(point)
    if frame == FRAME_ODOM:
        position = np.array([point.y, point.x, -point.z])
        quaternion = enu_flu_quaternion(quaternion)  # the way there is the way back
    unit = np.array(quaternion) / norm
    tilt = math.acos(min(1.0, rotation_matrix(unit)[2, 2]))
    if tilt > MAX_TILT:
        allowed = f"allowed are 0 to {math.degrees(MAX_TILT):g} deg, of an upright aircraft"
        raise PilotError(f"orientation is tilted by {math.degrees(tilt):.1f} deg: {allowed}")
    return position, quaternion_to_euler(unit)[0]


def to_velocity(message: TwistStamped) -> tuple[float, float, float, float]:
    """Velocity along and across the heading and down [m/s], and turn rate [rad/s], of a twist in "base_link".

    That has the axes of REP 103, forward, left, up, level along the heading; it turns to the left.

    Raises
    ------
    PilotError
        Another frame, a number that is not finite, or a rate of roll or pitch, which cannot be followed.
    """
    frame = message.header.frame_id
    if frame != FRAME_BASE:
        raise PilotError(f"frame_id = {frame!r}: allowed is {FRAME_BASE!r}")
    check_numbers(message.twist, error=PilotError)
    linear, angular = message.twist.linear, message.twist.angular
    for name, part in (("linear", linear), ("angular", angular)):
        for axis in part.get_fields_and_field_types():
            if not math.isfinite(getattr(part, axis)):
                raise PilotError(f"{name}.{axis} = {getattr(part, axis)}: allowed are finite numbers")
    for axis in ("x", "y"):
        if getattr(angular, axis) != 0.0:
            raise PilotError(f"angular.{axis} = {getattr(angular, axis):g}: allowed is 0")
    return linear.x, -linear.y, -linear.z, -angular.z
