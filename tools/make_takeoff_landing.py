"""Records bags/takeoff_landing.mcap: `./run python tools/make_takeoff_landing.py`.

The side-by-side helicopter runs on its skids, takes off, hovers in ground effect, turns, moves, lands and stands again,
flown by `hover_hold` in a real simulator.
"""

import json
import math
import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import rclpy
from geometry_msgs.msg import PoseStamped
from rclpy.node import Node

from sbs_msgs.msg import BodyState, Controls
from sbs_msgs.srv import Record
from sbs_sim import Aircraft
from sbs_sim.model.frames import euler_to_quaternion

ROOT = Path(__file__).resolve().parent.parent
LOG = ROOT / "bags" / "takeoff_landing.mcap"
NODES = ROOT / "install" / "sbs_sim" / "lib" / "sbs_sim"
GROUND = {"ground.contact": "contact", "ground.effect": "measured", "ground.altitude": -1.5}
# Seconds of the log, and the target from then on: north, east, down [m], heading [rad]. It stands at down = 1.21.
TARGETS = (
    (0.5, (0.0, 0.0, 0.6), 0.0),
    (7.5, (0.0, 0.0, 0.6), math.pi / 2),
    (12.5, (0.5, 0.5, 0.6), math.pi / 2),
    (16.0, (0.5, 0.5, 1.4), math.pi / 2),
)
END = 25.0
PATIENCE = 120.0  # s of wall time for the linear model


def main() -> None:
    """Fly and record."""
    LOG.parent.mkdir(exist_ok=True)
    LOG.unlink(missing_ok=True)
    os.environ.setdefault("ROS_DOMAIN_ID", "101")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "standing.yaml"
        path.write_text(json.dumps(Aircraft.load("sbs").with_values(GROUND).data), encoding="utf-8")
        options = [f"aircraft:={path}", "on_ground:=true", "record:=off"]
        with Process("simulator", options), Process("hover_hold", []):
            rclpy.init()
            Client().fly()
            rclpy.shutdown()
    print(f"{LOG}: {LOG.stat().st_size / 1e6:.2f} MB")


class Process:
    """A node in a process of its own, interrupted at the end."""

    def __init__(self, name: str, options: list[str]) -> None:
        self._command = [
            sys.executable,
            str(NODES / name),
            "--ros-args",
            *(part for o in options for part in ("-p", o)),
        ]

    def __enter__(self) -> None:
        self._process = subprocess.Popen(self._command)

    def __exit__(self, *_: object) -> None:
        self._process.send_signal(signal.SIGINT)
        self._process.wait(20)


class Client(Node):
    """Gives the targets by simulation time, from the beginning of the log on."""

    def __init__(self) -> None:
        super().__init__("targets")
        self._time, self._is_flown = 0.0, False
        self._target = self.create_publisher(PoseStamped, "target", 1)
        self._record = self.create_client(Record, "record")
        self.create_subscription(BodyState, "state", self._on_state, 10)
        self.create_subscription(Controls, "controls", self._on_controls, 1)

    def fly(self) -> None:
        """Wait for the hover hold, fly and record."""
        end = time.monotonic() + PATIENCE
        while not self._is_flown:
            if time.monotonic() > end:
                raise TimeoutError(f"no controls of hover_hold within {PATIENCE:g} s")
            rclpy.spin_once(self, timeout_sec=1.0)
        self._call(record=True, path=str(LOG))
        begin = self._time
        for seconds, place, heading in TARGETS:
            self._until(begin + seconds)
            self._target.publish(pose(place, heading))
        self._until(begin + END)
        self._call(record=False)

    def _until(self, moment: float) -> None:
        while self._time < moment:
            rclpy.spin_once(self, timeout_sec=1.0)

    def _call(self, **request: object) -> None:
        self._record.wait_for_service()
        answer = self._record.call_async(Record.Request(**request))
        rclpy.spin_until_future_complete(self, answer)
        if not answer.result().success:
            raise RuntimeError(answer.result().message)

    def _on_state(self, message: BodyState) -> None:
        self._time = message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec

    def _on_controls(self, _: Controls) -> None:
        self._is_flown = True


def pose(place: tuple[float, float, float], heading: float) -> PoseStamped:
    """Target at north, east, down [m], with a heading [rad]."""
    message = PoseStamped()
    message.header.frame_id = "ned"
    message.pose.position.x, message.pose.position.y, message.pose.position.z = place
    turn = message.pose.orientation
    turn.w, turn.x, turn.y, turn.z = euler_to_quaternion(heading, 0.0, 0.0).tolist()
    return message


if __name__ == "__main__":
    main()
