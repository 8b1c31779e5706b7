"""Node `control_mixer`: pilot controls to the swashplates of all rotors (paper section 2.1.1).

Subscribes `controls`, publishes `swashplate` and `diagnostics`. Ranges and rates are those of the aircraft file.
"""

import sys
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.node import Node

from sbs_msgs.msg import Controls, Swashplate, SwashplateArray
from sbs_sim.aircraft import Aircraft
from sbs_sim.errors import SbsError
from sbs_sim.mixer import Mixer
from sbs_sim.model.state import SWASHPLATE_NAMES
from sbs_sim.nodes.conversions import FRAME_BODY, controls_array
from sbs_sim.nodes.host import COMMAND_QOS, STATE_QOS, Parameter, declare, diagnostic, run

PARAMETERS = {
    "aircraft": Parameter("sbs", "Aircraft: a name in config/aircraft, or the path of a file"),
}
RAMP_PERIOD = 0.01  # s of simulation time between outputs while a swashplate is still on its way
COMPLAINT_PERIOD = 1.0  # s between complaints about bad input


class ControlMixer(Node):
    """See the module."""

    def __init__(self, **options: Any) -> None:
        super().__init__("control_mixer", **options)
        values = declare(self, PARAMETERS)
        self._mixer = Mixer(Aircraft.load(values["aircraft"]))
        self._rejected = 0
        self._last_problem = ""
        self._said: tuple[str, ...] = ()
        self._output = self.create_publisher(SwashplateArray, "swashplate", COMMAND_QOS)
        self._health = self.create_publisher(DiagnosticArray, "diagnostics", STATE_QOS)
        self.create_subscription(Controls, "controls", self._on_controls, COMMAND_QOS)
        self._ramp = self.create_timer(RAMP_PERIOD, self._move)
        self._ramp.cancel()
        self.create_timer(1.0, self._publish_health)

    def _on_controls(self, message: Controls) -> None:
        try:
            self._mixer.set_target(controls_array(message))
        except SbsError as error:
            self._rejected += 1
            self._last_problem = str(error)
            self.get_logger().warning(f"controls rejected: {error}", throttle_duration_sec=COMPLAINT_PERIOD)
            return
        self._move()

    def _move(self) -> None:
        """Go on towards the target and publish; the timer runs while there is a way to go."""
        now = self.get_clock().now()
        angles = self._mixer.move(now.nanoseconds * 1e-9)
        message = SwashplateArray()
        message.header.stamp = now.to_msg()
        message.header.frame_id = FRAME_BODY
        message.rotors = [
            Swashplate(**dict(zip(SWASHPLATE_NAMES, row, strict=True))) for row in angles.tolist()
        ]
        self._output.publish(message)
        if self._mixer.arrived:
            self._ramp.cancel()
        elif self._ramp.is_canceled():
            self._ramp.reset()
        self._say_once()

    def _say_once(self) -> None:
        """One line per limit that is newly reached, not one per message."""
        saturated = self._mixer.saturated
        for text in saturated:
            if text not in self._said:
                self.get_logger().warning(f"clipped: {text}")
        if saturated != self._said:
            self._said = saturated
            self._publish_health()

    def _publish_health(self) -> None:
        problems = [(DiagnosticStatus.WARN, f"clipped: {text}") for text in self._mixer.saturated]
        values = {"rejected_messages": self._rejected, "last_rejection": self._last_problem or "none"}
        message = DiagnosticArray(status=[diagnostic("control_mixer", problems, values)])
        message.header.stamp = self.get_clock().now().to_msg()
        self._health.publish(message)


def main(args: list[str] | None = None) -> None:
    """Entry point of the executable `control_mixer`."""
    sys.exit(run(lambda: [ControlMixer()], args))
