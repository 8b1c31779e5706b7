"""A pilot for the tools that need a flight to last: holds hover at a position by linear-quadratic state feedback.

    ./run python tools/hover_controller.py [--rate 50] [--name pilot]

The model is `sbs_sim.linearize`, rotors and inflow settled, with position and heading added. The weights are Bryson's:
one over the square of the departure allowed to each state and control (A. E. Bryson, Y.-C. Ho: Applied Optimal Control,
1975).
"""

import argparse
import contextlib
import math
import sys

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_continuous_are

from sbs_sim import Aircraft, linearize

Array = NDArray[np.float64]

BODY = ("u", "w", "q", "theta", "v", "p", "phi", "r")
DEPARTURES = (1.0, 1.0, 1.0, 0.2, 1.0, 1.0, 0.2, 0.5, 1.0, 1.0, 1.0, 0.3)  # BODY, then ahead, right, down, heading
MAX_GAP = 3.0  # m that it hurries for


class HoverLaw:
    """Controls that hold hover at a position, heading north.

    Parameters
    ----------
    aircraft : Aircraft
    position : array_like, shape (3,)
        NED [m].
    """

    def __init__(self, aircraft: Aircraft, position: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> None:
        model = linearize(aircraft).quasi_static(BODY)
        trim = model.trim
        self.trim = trim.controls
        self._position = np.array(position)
        self._pitch, self._roll = trim.pitch, trim.roll
        self._low, self._high = np.array(list(aircraft.control_ranges.values())).T
        a = np.zeros((12, 12))
        a[:8, :8] = model.a
        a[8, BODY.index("u")] = a[9, BODY.index("v")] = a[10, BODY.index("w")] = a[11, BODY.index("r")] = 1.0
        b = np.vstack([model.b, np.zeros((4, 4))])
        q = np.diag(1.0 / np.square(DEPARTURES))
        r = np.eye(4) / math.radians(2.0) ** 2
        self.gain = np.linalg.solve(r, b.T @ solve_continuous_are(a, b, q, r))

    def controls(self, position: Array, euler: Array, velocity: Array, rates: Array) -> Array:
        """Pilot controls [rad], shape (4,).

        Parameters
        ----------
        position : ndarray, shape (3,)
            NED [m].
        euler : ndarray, shape (3,)
            Heading, pitch, roll [rad].
        velocity, rates : ndarray, shape (3,)
            Body axes [m/s, rad/s].
        """
        heading, pitch, roll = euler
        gap = np.clip(position - self._position, -MAX_GAP, MAX_GAP)
        c, s = math.cos(heading), math.sin(heading)
        ahead, right = c * gap[0] + s * gap[1], c * gap[1] - s * gap[0]
        u, v, w = velocity
        p, q, r = rates
        state = np.array([u, w, q, pitch - self._pitch, v, p, roll - self._roll, r, ahead, right, gap[2], heading])
        return np.clip(self.trim - self.gain @ state, self._low, self._high)


def main() -> int:
    """Fly as a node until the end."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rate", type=float, default=50.0, help="[Hz] of simulation time, at most that of the states")
    parser.add_argument("--name", default="pilot")
    arguments = parser.parse_args()
    import rclpy
    from rclpy.executors import ExternalShutdownException

    from sbs_msgs.msg import BodyState, Controls
    from sbs_sim.model.frames import quaternion_to_euler
    from sbs_sim.model.state import CONTROL_NAMES

    rclpy.init()
    node = rclpy.create_node(arguments.name)
    law = HoverLaw(Aircraft.load("sbs"))
    output = node.create_publisher(Controls, "controls", 1)
    last = -math.inf

    def fly(state: BodyState) -> None:
        nonlocal last
        now = state.header.stamp.sec + state.header.stamp.nanosec * 1e-9
        if 0.0 <= now - last < 0.999 / arguments.rate:
            return
        last = now
        q, x, v, w = state.attitude, state.position, state.velocity, state.angular_velocity
        euler = quaternion_to_euler(np.array([q.w, q.x, q.y, q.z]))
        values = law.controls(*map(np.array, ([x.x, x.y, x.z], euler, [v.x, v.y, v.z], [w.x, w.y, w.z])))
        message = Controls(**dict(zip(CONTROL_NAMES, values.tolist(), strict=True)))
        message.header.stamp = state.header.stamp
        output.publish(message)

    node.create_subscription(BodyState, "state", fly, 1)
    with contextlib.suppress(KeyboardInterrupt, ExternalShutdownException):
        rclpy.spin(node)
    return 0


if __name__ == "__main__":
    sys.exit(main())
