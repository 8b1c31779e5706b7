"""Node `frames`: the aircraft as ROS tools want to see it, for RViz and others.

Publishes `robot_description` (a URDF made from the aircraft file), `joint_states` (azimuth, lag, flap and pitch of each
blade) and the frames map, odom, base_link, those of hubs, blades and sensors on `/tf` and `/tf_static`. Subscribes
`odom`, `rotors`, `events`, of a simulator or of a log that is played. A node of its own: a flight that nobody looks at
this way pays nothing.
"""

import importlib
import math
import sys
from typing import Any

import numpy as np
from builtin_interfaces.msg import Time
from geometry_msgs.msg import TransformStamped
from nav_msgs.msg import Odometry
from numpy.typing import NDArray
from rclpy.qos import QoSProfile
from sensor_msgs.msg import JointState
from std_msgs.msg import String

from sbs_msgs.msg import FlightEvent, RotorStateArray
from sbs_sim.aircraft import Aircraft
from sbs_sim.errors import SimulationError
from sbs_sim.nodes.component import Component
from sbs_sim.nodes.conversions import FRAME_ODOM, to_seconds
from sbs_sim.nodes.odometry_views import transform, transform_of
from sbs_sim.nodes.parameters import Parameter, declare
from sbs_sim.nodes.pilot_node import NEWEST_QOS
from sbs_sim.nodes.process import run
from sbs_sim.nodes.qos import EVENT_QOS, LATCHED_QOS, STATE_QOS
from sbs_sim.nodes.rejections import Rejections
from sbs_sim.output.robot import FIXED, Joint, joint_angles, joints, sensor_joints, urdf
from sbs_sim.sensors.settings import SETTINGS, checked

Array = NDArray[np.float64]


def _tf_message() -> Any:
    """Type of `/tf`; None without the package tf2_msgs, which an installed ROS has and no wheel brings."""
    try:
        return importlib.import_module("tf2_msgs.msg").TFMessage
    except ModuleNotFoundError:
        return None


TFMessage = _tf_message()
FRAME_MAP = "map"
NO_TF = "no /tf: the package tf2_msgs is not installed; robot_description and joint_states are published"
IMU_POSITION = "imu.position"
PARAMETERS = {
    "aircraft": Parameter("sbs", "Aircraft: a name in config/aircraft, or the path of a file"),
    "rate": Parameter(
        100.0,
        "Highest rate of frames and joint states, in simulation time [Hz]; viewers turn a rotor the short way from one"
        " to the next, so that one with more than half a turn between them seems to turn backwards",
        0.1,
        1000.0,
    ),
    "frame_prefix": Parameter("", "Before the names of all frames but map on /tf, for several aircraft: left/"),
    IMU_POSITION: Parameter(
        SETTINGS[IMU_POSITION].default, "As that of the simulator, for imu_link. " + SETTINGS[IMU_POSITION].description
    ),
    "joint_frames": Parameter(
        True,
        "Publish the frames of hubs, blades and sensors; false where robot_state_publisher makes them of joint_states",
    ),
}


class Frames(Component):
    """See the module."""

    def __init__(self) -> None:
        super().__init__("frames")
        settings = declare(self, PARAMETERS)
        self._aircraft = aircraft = Aircraft.load(settings["aircraft"])
        sensors = sensor_joints(checked({IMU_POSITION: settings[IMU_POSITION]})[IMU_POSITION])
        self._joints = [*joints(aircraft), *sensors]
        self._moving = [joint for joint in self._joints if joint.kind != FIXED]
        self._with_joints, self._prefix = settings["joint_frames"], settings["frame_prefix"]
        self._period, self._last = 1.0 / settings["rate"], {"odom": -math.inf, "rotors": -math.inf}
        self._swash = np.zeros((len(aircraft.rotors), 3))
        self._rejections = {name: Rejections(self, name) for name in ("odom", "rotors", "events")}
        self._states = self.create_publisher(JointState, "joint_states", STATE_QOS)
        self._description = self.create_publisher(String, "robot_description", LATCHED_QOS)
        self._description.publish(String(data=urdf(aircraft, sensors)))
        self._tf = self._tf_publisher("/tf", STATE_QOS)
        self._tf_static = self._tf_publisher("/tf_static", LATCHED_QOS)
        if self._tf_static is None:
            self.get_logger().warning(NO_TF)
        else:
            self._tf_static.publish(TFMessage(transforms=self._fixed()))
        self.create_subscription(FlightEvent, "events", self._on_event, EVENT_QOS)
        self.create_subscription(Odometry, "odom", self._on_odom, NEWEST_QOS)
        self.create_subscription(RotorStateArray, "rotors", self._on_rotors, NEWEST_QOS)

    def _tf_publisher(self, name: str, qos: QoSProfile) -> Any:
        return None if TFMessage is None else self.create_publisher(TFMessage, name, qos)

    def _fixed(self) -> list[TransformStamped]:
        """Frames that do not move: the origin of the map is that of the flight (REP 105)."""
        still = np.zeros(3), (1.0, 0.0, 0.0, 0.0)
        found = [transform(Time(), FRAME_MAP, self._prefix + FRAME_ODOM, *still)]
        own = [joint for joint in self._joints if joint.kind == FIXED] if self._with_joints else []
        return found + [frame_of(joint, 0.0, Time(), self._prefix) for joint in own]

    def _is_due(self, name: str, stamp: Time) -> bool:
        """True if the last message of that kind is a period old; a time that goes back is another flight's."""
        now, last = to_seconds(stamp), self._last[name]
        if last <= now < last + 0.999 * self._period:
            return False
        self._last[name] = now
        return True

    def _on_event(self, message: FlightEvent) -> None:
        angles = np.array(message.swashplate)
        if not len(angles):
            return
        wanted = self._swash.size
        if len(angles) < wanted or not np.isfinite(angles).all():
            what = f"{len(angles)} angles of swashplates, or one that is not finite"
            self._rejections["events"].add(SimulationError(f"{what}; {self._aircraft.name} has {wanted}"))
            return
        self._swash = angles[:wanted].reshape(-1, 3)

    def _on_odom(self, message: Odometry) -> None:
        if self._tf is None or not self._is_due("odom", message.header.stamp):
            return
        moved = transform_of(message)
        at, turn = moved.transform.translation, moved.transform.rotation
        if not np.isfinite((at.x, at.y, at.z, turn.w, turn.x, turn.y, turn.z)).all():
            self._rejections["odom"].add(SimulationError("a number that is not finite"))
            return
        moved.header.frame_id = self._prefix + moved.header.frame_id
        moved.child_frame_id = self._prefix + moved.child_frame_id
        self._tf.publish(TFMessage(transforms=[moved]))

    def _on_rotors(self, message: RotorStateArray) -> None:
        if not self._is_due("rotors", message.header.stamp):
            return
        try:
            angles = angles_of(self._aircraft, message, self._swash)
        except SimulationError as error:
            self._rejections["rotors"].add(error)
            return
        stamp = message.header.stamp
        states = JointState(name=[joint.name for joint in self._moving], position=angles)
        states.header.stamp = stamp
        self._states.publish(states)
        if self._tf is not None and self._with_joints:
            pairs = zip(self._moving, angles, strict=True)
            found = [frame_of(joint, angle, stamp, self._prefix) for joint, angle in pairs]
            self._tf.publish(TFMessage(transforms=found))


def angles_of(aircraft: Aircraft, message: RotorStateArray, swash: Array) -> list[float]:
    """Angles of all joints that turn [rad].

    Raises
    ------
    SimulationError
        The rotors are not those of this aircraft, or an angle is not finite.
    """
    blades = [len(rotor.blade_flap) for rotor in message.rotors]
    wanted = [rotor.blades for rotor in aircraft.rotors]
    if blades != wanted or blades != [len(rotor.blade_lag) for rotor in message.rotors]:
        raise SimulationError(f"the flight has rotors with {blades} blades, {aircraft.name} has {wanted}")
    found = []
    for rotor, seen, angles in zip(aircraft.rotors, message.rotors, swash, strict=True):
        found += joint_angles(rotor, seen.azimuth, seen.blade_flap, seen.blade_lag, angles)
    if not np.isfinite(found).all():
        raise SimulationError("an angle that is not finite")
    return found


def frame_of(joint: Joint, angle: float, stamp: Time, prefix: str = "") -> TransformStamped:
    """Frame of the child of a joint at an angle [rad]; names with a prefix."""
    turn = quaternion_of(joint.turned(angle))
    return transform(stamp, prefix + joint.parent, prefix + joint.child, joint.place, turn)


def quaternion_of(axes: Array) -> tuple[float, float, float, float]:
    """Quaternion (w, x, y, z) of axes that are the columns of a matrix: Shepperd's method, from the largest part."""
    trace, diagonal = float(np.trace(axes)), np.diagonal(axes)
    parts = np.array([trace, *(2.0 * diagonal - trace)])
    largest = int(np.argmax(parts))
    spin = axes - axes.T
    turn, both = np.array([spin[2, 1], spin[0, 2], spin[1, 0]]), axes + axes.T
    found = np.empty(4)
    found[largest] = 1.0 + parts[largest]
    if largest == 0:
        found[1:] = turn
    else:
        i = largest - 1
        found[0] = turn[i]
        for j in (j for j in range(3) if j != i):
            found[1 + j] = both[i, j]
    w, x, y, z = found / np.linalg.norm(found)
    return float(w), float(x), float(y), float(z)


def main(args: list[str] | None = None) -> None:
    """Publish frames until interrupted."""
    sys.exit(run(lambda: [Frames()], args))
