"""What 3D views show of an odometry, for viewers that do not take that itself: pose, path, transform."""

from collections import deque
from collections.abc import Iterable

from builtin_interfaces.msg import Time
from geometry_msgs.msg import PoseStamped, TransformStamped
from nav_msgs.msg import Odometry, Path

from sbs_sim.nodes.conversions import set_quaternion, set_vector, to_seconds

PATH_PERIOD = 0.5  # s of simulation time between the poses of a path
PATH_LENGTH = 240  # poses: the last two minutes


def pose_of(message: Odometry) -> PoseStamped:
    """Its pose."""
    return PoseStamped(header=message.header, pose=message.pose.pose)


def transform_of(message: Odometry) -> TransformStamped:
    """Its pose as the transform between its frames."""
    at, turn = message.pose.pose.position, message.pose.pose.orientation
    frames = message.header.frame_id, message.child_frame_id
    return transform(message.header.stamp, *frames, (at.x, at.y, at.z), (turn.w, turn.x, turn.y, turn.z))


def transform(stamp: Time, parent: str, child: str, place: Iterable[float], turn: Iterable[float]) -> TransformStamped:
    """Place [m] and attitude, the quaternion (w, x, y, z), of a frame in another."""
    made = TransformStamped(child_frame_id=child)
    made.header.stamp, made.header.frame_id = stamp, parent
    set_vector(made.transform.translation, [float(part) for part in place])
    set_quaternion(made.transform.rotation, [float(part) for part in turn])
    return made


class PathOf:
    """The way that it has come since somebody has looked; None between two poses of it."""

    def __init__(self) -> None:
        self._poses: deque[PoseStamped] = deque(maxlen=PATH_LENGTH)
        self._last = float("-inf")

    def late(self, message: Odometry) -> Path:
        """Path with this pose, due or not, for who comes late: the flight may be paused."""
        before = self._poses if to_seconds(message.header.stamp) >= self._last else ()
        return Path(header=message.header, poses=[*before, pose_of(message)])

    def __call__(self, message: Odometry) -> Path | None:
        """Path with this pose, if one is due."""
        now = to_seconds(message.header.stamp)
        if now < self._last:  # another flight
            self._poses.clear()
        elif now < self._last + PATH_PERIOD:
            return None
        self._last = now
        self._poses.append(pose_of(message))
        return Path(header=message.header, poses=list(self._poses))
