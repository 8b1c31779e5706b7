"""Records bags/hover_step.mcap, a hover with a step of each control: `./run python tools/make_hover_step.py`."""

import math
import os
import signal
import subprocess
import sys
from pathlib import Path

import rclpy
from rclpy.node import Node

from sbs_msgs.msg import Controls, SimulationStatus
from sbs_sim import Aircraft, trim
from sbs_sim.model.state import CONTROL_NAMES

ROOT = Path(__file__).resolve().parent.parent
LOG = ROOT / "bags" / "hover_step.mcap"
SIMULATOR = ROOT / "install" / "sbs_sim" / "lib" / "sbs_sim" / "simulator"
FIRST, LENGTH, PERIOD, END = 0.5, 0.3, 0.8, 4.0  # s: begin of the first step, length of each, between them, of the log
STEP_DEG = 0.5


def main() -> None:
    """Fly and record."""
    LOG.parent.mkdir(exist_ok=True)
    LOG.unlink(missing_ok=True)
    os.environ.setdefault("ROS_DOMAIN_ID", "101")
    hover = trim(Aircraft.load("sbs")).controls
    rclpy.init()
    pilot = Pilot(hover)
    command = [sys.executable, str(SIMULATOR), "--ros-args", "-p", f"record:={LOG}", "-p", "real_time_factor:=0.5"]
    simulator = subprocess.Popen(command)
    while pilot.time < END:
        rclpy.spin_once(pilot, timeout_sec=1.0)
    simulator.send_signal(signal.SIGINT)
    simulator.wait(20)
    rclpy.shutdown()
    print(f"{LOG}: {LOG.stat().st_size / 1e6:.2f} MB")


class Pilot(Node):
    """Moves the controls by simulation time."""

    def __init__(self, hover: object) -> None:
        super().__init__("pilot")
        self.time = 0.0
        self._hover = hover
        self._output = self.create_publisher(Controls, "controls", 1)
        self.create_subscription(SimulationStatus, "status", self._on_status, 10)

    def _on_status(self, status: SimulationStatus) -> None:
        self.time = status.sim_time
        values = dict(zip(CONTROL_NAMES, self._hover, strict=True))
        which, since = divmod(max(0.0, self.time - FIRST), PERIOD)
        if self.time >= FIRST and since < LENGTH and which < len(CONTROL_NAMES):
            values[CONTROL_NAMES[int(which)]] += math.radians(STEP_DEG)
        self._output.publish(Controls(**values))


if __name__ == "__main__":
    main()
