"""Node `hover_hold`: keeps place and heading; the worked example of what `linearize` is good for (docs/tutorial.md).

Calls `linearize`, designs the gains and prints them; from then on every `state` is answered by `controls`. Subscribes
`target` (where to go; at first it stays where it is), `events` for resets and `status` for pauses; publishes
`diagnostics`.
"""

import math
import sys
import time

import numpy as np
import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import PoseStamped
from rclpy.clock import Clock, ClockType
from rclpy.qos import QoSProfile, ReliabilityPolicy

from sbs_msgs.msg import BodyState, Controls, FlightEvent, LinearModel, SimulationStatus
from sbs_msgs.srv import Linearize
from sbs_sim.errors import PilotError, SbsError
from sbs_sim.model import state as S
from sbs_sim.model.frames import quaternion_to_euler
from sbs_sim.nodes.conversions import to_seconds
from sbs_sim.nodes.host import (
    COMMAND_QOS,
    EVENT_QOS,
    HEALTH_PERIOD,
    STATE_QOS,
    Component,
    Parameter,
    Refusals,
    declare,
    diagnostic,
    run,
)
from sbs_sim.nodes.pilot_conversions import body_array, controls_message, hover_model, to_target
from sbs_sim.pilot.hover_hold import LIMITS, HoverHold, HoverHoldDesign, design

PARAMETERS = {
    "largest_distance": Parameter(100.0, "Targets farther from the aircraft than this are refused [m]", 0.1, 1e5),
    "patience": Parameter(60.0, "How long to wait for the service linearize [s]", 1.0, 3600.0),
    "position_limit": Parameter(
        LIMITS["forward"],
        "Departure of place that costs like the others at theirs [m]: less is tighter",
        0.05,
        10.0,
    ),
}
STALE = 0.5  # s of wall time without a state
AT_ONCE = 1.0  # s of simulation time that an event may come after states of later
NEWEST_QOS = QoSProfile(depth=1, reliability=ReliabilityPolicy.RELIABLE)  # a queue of states would be a delay
ASKING = 0.2  # s between two looks whether the service is there


class HoverHoldNode(Component):
    """See the module."""

    def __init__(self) -> None:
        super().__init__("hover_hold")
        values = declare(self, PARAMETERS)
        self._largest_distance = values["largest_distance"]
        model = hover_model(self._linearized(values["patience"]))
        found = design(model, dict.fromkeys(("forward", "right", "down"), values["position_limit"]))
        self._say(found)
        self._pilot = HoverHold(found)
        self._position: np.ndarray | None = None
        self._time = 0.0  # of the latest state [s of simulation time]
        self._arrived = time.monotonic()  # when it came [s of wall time]
        self._paused = self._stale = False
        self._refusals, self._bad_states = Refusals(self, "target"), Refusals(self, "state")
        self._output = self.create_publisher(Controls, "controls", COMMAND_QOS)
        self._health = self.create_publisher(DiagnosticArray, "diagnostics", STATE_QOS)
        self.create_subscription(BodyState, "state", self._on_state, NEWEST_QOS)
        self.create_subscription(PoseStamped, "target", self._on_target, COMMAND_QOS)
        self.create_subscription(FlightEvent, "events", self._on_event, EVENT_QOS)
        self.create_subscription(SimulationStatus, "status", self._on_status, STATE_QOS)
        self.create_timer(HEALTH_PERIOD, self._look_after, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def _linearized(self, patience: float) -> LinearModel:
        """Linear model of hover, from the service."""
        client = self.create_client(Linearize, "linearize")
        self.get_logger().info("asking linearize for the model of hover")
        end = time.monotonic() + patience
        while not client.wait_for_service(ASKING):
            if time.monotonic() > end:
                raise PilotError(f"no service linearize within {patience:g} s: is a simulator running?")
        answer = client.call_async(Linearize.Request())
        rclpy.spin_until_future_complete(self, answer, timeout_sec=max(ASKING, end - time.monotonic()))
        if not answer.done():
            raise PilotError(f"no answer of linearize within {patience:g} s")
        self.destroy_client(client)
        if not answer.result().success:
            raise PilotError(f"linearize: {answer.result().message}")
        return answer.result().model

    def _say(self, found: HoverHoldDesign) -> None:
        print("\n".join(found.describe()), flush=True)

    # ----------------------------------------------------------------------------------------------------- inputs

    def _on_state(self, message: BodyState) -> None:
        """Answer a state with controls: the whole of the flying."""
        now, body = to_seconds(message.header.stamp), body_array(message)
        try:
            controls = self._pilot.controls(now, body)
        except SbsError as error:
            self._bad_states.add(error)
            return
        self._output.publish(controls_message(controls, message.header.stamp))
        if self._position is None or now < self._time:
            self.get_logger().info("holding the place where the aircraft is")
        self._time, self._position, self._arrived = now, body[:3], time.monotonic()

    def _on_target(self, message: PoseStamped) -> None:
        try:
            place, heading = to_target(message)
            if self._position is None:
                raise PilotError("no state has come yet")
            distance = float(np.linalg.norm(place - self._position))
            if distance > self._largest_distance:
                raise PilotError(f"distance = {distance:g} m: allowed are 0 to {self._largest_distance:g} m")
            self._pilot.hold(place, heading)
        except SbsError as error:
            self._refusals.add(error)
            return
        north, east, down = place
        text = f"north {north:.2f}, east {east:.2f}, height {-down:.2f} m, heading {math.degrees(heading):.1f} deg"
        self.get_logger().info(f"target: {text}", throttle_duration_sec=1.0)

    def _on_event(self, message: FlightEvent) -> None:
        """After a reset the place is another, and what was wanted before is void; at the start come old events too."""
        if message.kind != FlightEvent.RESET or self._position is None:
            return
        if to_seconds(message.header.stamp) >= self._time - AT_ONCE:
            state = np.array(message.state)
            self._pilot.restart((state[: S.ATTITUDE], quaternion_to_euler(state[S.ATTITUDE : S.VELOCITY])[0]))
            self.get_logger().info("reset: holding the place where the aircraft is put")

    def _on_status(self, message: SimulationStatus) -> None:
        self._paused = message.state == SimulationStatus.PAUSED

    def _look_after(self) -> None:
        """Say once when states stop to come; the simulator holds the last controls then."""
        stale = not self._paused and time.monotonic() - self._arrived > STALE
        if stale and not self._stale:
            self.get_logger().warning(f"no state for {STALE:g} s: the last controls stay")
        self._stale = stale
        problems = [(DiagnosticStatus.WARN, f"no state for {STALE:g} s")] if stale else []
        status = diagnostic("hover_hold", problems, {"paused": self._paused, **self._refusals.values()})
        self._health.publish(DiagnosticArray(status=[status]))


def main(args: list[str] | None = None) -> None:
    """Hold until interrupted."""
    sys.exit(run(lambda: [HoverHoldNode()], args))
