"""Node `joystick`: flies with the messages of the ROS package `joy` (sensor_msgs/Joy on `joy`).

config/joystick.yaml assigns the axes and buttons of each pad.
"""

import sys
import time

import numpy as np
from numpy.typing import NDArray
from sensor_msgs.msg import Joy

from sbs_sim.errors import SbsError
from sbs_sim.nodes.parameters import Parameter
from sbs_sim.nodes.process import run
from sbs_sim.nodes.qos import STATE_QOS
from sbs_sim.nodes.rejections import Rejections
from sbs_sim.nodes.stick_node import STICK_PARAMETERS, StickNode
from sbs_sim.pilot.joystick import Joystick, JoystickFile

PARAMETERS = {
    **STICK_PARAMETERS,
    "config": Parameter("", "Joystick file; empty for config/joystick.yaml of the package"),
    "pad": Parameter("gamepad", "Pad of this file: gamepad, xbox, playstation, transmitter"),
}


class JoystickNode(StickNode):
    """See the module."""

    def __init__(self) -> None:
        super().__init__("joystick", PARAMETERS)
        self._file = JoystickFile.load(self.settings["config"], self.settings["pad"])
        self._joystick = Joystick(self._file)
        self.make_pilot(self._file.deflections)
        self._position = np.zeros(len(self._file.deflections))
        self._heard: float | None = None  # wall time of the latest message [s]
        self._silent = False
        self._rejections = Rejections(self, "joy")
        self.create_subscription(Joy, "joy", self._on_joy, STATE_QOS)
        self.begin()

    def _on_joy(self, message: Joy) -> None:
        try:
            reading = self._joystick.read(message.axes, message.buttons)
        except SbsError as error:
            self._rejections.add(error)
            return
        if self._silent or self._heard is None:
            self.get_logger().info("joystick heard")
        self._heard, self._silent = time.monotonic(), False
        self._position = reading.sticks
        self.pilot.move_trim(self._file.trim_step * reading.trim)
        act = {
            "augmentation": self.switch_augmentation,
            "take_trim": self.take_trim,
            "first_trim": self.first_trim,
        }
        for action in reading.actions:
            act[action]()

    def sticks(self) -> NDArray[np.float64]:
        """Sticks of the latest message; in the middle if it is too old."""
        if self._heard is not None and time.monotonic() - self._heard > self._file.timeout and not self._silent:
            self._silent = True
            self._position = np.zeros(len(self._position))
            self.get_logger().warning(f"no joy for {self._file.timeout:g} s: sticks released, the trim is held")
        return self._position

    def waiting_for(self) -> str:
        """What is missing before it flies, and the joystick if it was never heard."""
        if (what := super().waiting_for()) or self._heard is not None:
            return what
        return f"{self.topic('joy')}: ros2 run joy game_controller_node publishes it"

    def problems(self) -> list[str]:
        """A joystick that is silent."""
        return ["no message on joy"] if self._silent or self._heard is None else []

    def values(self) -> dict[str, object]:
        """Rejected messages too."""
        return {**super().values(), **self._rejections.values()}


def main(args: list[str] | None = None) -> None:
    """Fly until interrupted."""
    sys.exit(run(lambda: [JoystickNode()], args))
