"""Node `control_mixer`: pilot controls to the swashplates of all rotors (paper section 2.1.1).

Subscribes `controls`, publishes `swashplate` and `diagnostics`. Ranges and rates are those of the aircraft file.
"""

import sys
from collections.abc import Callable

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.parameter import Parameter as ROSParameter

from sbs_msgs.msg import Controls, Swashplate, SwashplateArray
from sbs_sim.aircraft import Aircraft
from sbs_sim.errors import SbsError
from sbs_sim.mixer import Mixer
from sbs_sim.model.state import SWASHPLATE_NAMES
from sbs_sim.nodes.conversions import FRAME_BODY, controls_array, to_time
from sbs_sim.nodes.host import (
    COMMAND_QOS,
    COMPLAINT_PERIOD,
    HEALTH_PERIOD,
    STATE_QOS,
    Parameter,
    declare,
    diagnostic,
    run,
)

PARAMETERS = {
    "aircraft": Parameter("sbs", "Aircraft: a name in config/aircraft, or the path of a file"),
}
RAMP_PERIOD = 0.01  # s of wall time between outputs while a swashplate is still on its way


class ControlMixer(Node):
    """See the module.

    Parameters
    ----------
    now : callable, optional
        Simulation time [s]; from /clock if not given. In the simulator's own process it spares the messages.
    aircraft : Aircraft, optional
        The simulator's; that of the node's own parameter if not given.
    """

    def __init__(self, now: Callable[[], float] | None = None, aircraft: Aircraft | None = None) -> None:
        # the simulator owns time: rates are those of simulated time, and a pause holds the swashplates
        clock_topic = ROSParameter("use_sim_time", value=now is None)
        super().__init__("control_mixer", parameter_overrides=[clock_topic])
        self._now = now or (lambda: self.get_clock().now().nanoseconds * 1e-9)
        if aircraft is None:
            aircraft = Aircraft.load(declare(self, PARAMETERS)["aircraft"])
        self._mixer = Mixer(aircraft)
        self._rejected = 0
        self._last_problem = ""
        self._said: tuple[str, ...] = ()
        self._output = self.create_publisher(SwashplateArray, "swashplate", COMMAND_QOS)
        self._health = self.create_publisher(DiagnosticArray, "diagnostics", STATE_QOS)
        self.create_subscription(Controls, "controls", self._on_controls, COMMAND_QOS)
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self._ramp = self.create_timer(RAMP_PERIOD, self._move, clock=steady, autostart=False)
        self.create_timer(HEALTH_PERIOD, self._publish_health, clock=steady)

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
        now = self._now()
        angles = self._mixer.move(now)
        message = SwashplateArray()
        message.header.stamp = to_time(now)
        message.header.frame_id = FRAME_BODY
        message.rotors = [Swashplate(**dict(zip(SWASHPLATE_NAMES, row, strict=True))) for row in angles.tolist()]
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
        message.header.stamp = to_time(self._now())
        self._health.publish(message)


def main(args: list[str] | None = None) -> None:
    """Entry point of the executable `control_mixer`."""
    sys.exit(run(lambda: [ControlMixer()], args))
