"""Node `hover_hold`: holds position and heading; an example of control design with `linearize` (docs/tutorial.md).

Calls `linearize`, designs the gains and prints them. It then answers every `state` with `controls`. Subscribes
`target` (position and heading to hold; at the start those of the aircraft), `events` for resets and `status` for
pauses; publishes `diagnostics`. An aircraft that stands on the ground takes off for a target above it, and lands where
its target is on the ground or below.
"""

import math
import sys
import time

import numpy as np
import rclpy
from geometry_msgs.msg import PoseStamped
from numpy.typing import NDArray

from sbs_msgs.msg import FlightEvent, LinearModel
from sbs_msgs.srv import Linearize
from sbs_sim.errors import PilotError, SbsError
from sbs_sim.model import state as S
from sbs_sim.model.frames import quaternion_to_euler
from sbs_sim.nodes.parameters import Parameter, declare
from sbs_sim.nodes.pilot_conversions import hover_model, to_target
from sbs_sim.nodes.pilot_node import WAITING_PERIOD, PilotNode
from sbs_sim.nodes.process import run
from sbs_sim.nodes.qos import COMMAND_QOS, SERVICE_QOS
from sbs_sim.nodes.rejections import WARNING_PERIOD, Rejections
from sbs_sim.pilot.hover_hold import LIMITS, HoverHold, design
from sbs_sim.pilot.landing import FLYING, Landing

PARAMETERS = {
    "largest_distance": Parameter(100.0, "Targets farther from the aircraft than this are refused [m]", 0.1, 1e5),
    "patience": Parameter(60.0, "How long to wait for the service linearize [s]", 1.0, 3600.0),
    "position_limit": Parameter(
        LIMITS["forward"],
        "Position error with unit cost, as the other errors have at their limits [m]; smaller holds more tightly",
        0.05,
        10.0,
    ),
}
POLL_PERIOD = 0.2  # s between two looks whether the service is there


class HoverHoldNode(PilotNode):
    """See the module."""

    def __init__(self) -> None:
        super().__init__("hover_hold")
        parameters = declare(self, PARAMETERS)
        self._largest_distance = parameters["largest_distance"]
        model = hover_model(*self._linearized(parameters["patience"]))
        found = design(model, dict.fromkeys(("forward", "right", "down"), parameters["position_limit"]))
        print("\n".join(found.describe()), flush=True)
        self._pilot = Landing(HoverHold(found), model.controls, model.axes)
        self._phase = ""
        self._rejections = Rejections(self, "target")
        self.create_subscription(PoseStamped, "target", self._on_target, COMMAND_QOS)
        self.begin()

    def _linearized(self, patience: float) -> tuple[LinearModel, list[str]]:
        """Linear model of hover and the axes of its controls, from the service."""
        client = self.create_client(Linearize, "linearize", qos_profile=SERVICE_QOS)
        self.get_logger().info("asking linearize for the model of hover")
        last_message = time.monotonic()
        end = last_message + patience
        while not client.wait_for_service(POLL_PERIOD):
            now = time.monotonic()
            if now > end:
                raise PilotError(f"no service linearize within {patience:g} s: is a simulator running?")
            if now - last_message > WAITING_PERIOD:
                last_message = now
                flies = self.count_publishers("state") > 0
                whose = "a simulator flies, but no node analysis" if flies else "is a simulator running there?"
                self.get_logger().info(f"waiting for {self.topic('linearize')}: {whose}")
        answer = client.call_async(Linearize.Request())
        while not answer.done():
            left = end - time.monotonic()
            rclpy.spin_until_future_complete(self, answer, timeout_sec=max(POLL_PERIOD, min(left, WAITING_PERIOD)))
            if not answer.done() and left <= 0.0:
                raise PilotError(f"no answer of linearize within {patience:g} s")
            if not answer.done():
                self.get_logger().info(f"waiting for the answer of {self.topic('linearize')}")
        self.destroy_client(client)
        if not answer.result().success:
            raise PilotError(f"linearize: {answer.result().message}")
        return answer.result().model, answer.result().control_axes

    def controls_for(self, now: float, body: NDArray[np.float64]) -> NDArray[np.float64]:
        """Answer a state with controls."""
        is_new = self.body is None or now < self.time
        controls = self._pilot.controls(now, body, self.touching)
        if is_new and self._pilot.phase == FLYING:
            self.get_logger().info("holding the present position")
        elif self._pilot.phase != self._phase:
            self.get_logger().info(self._pilot.phase)
        self._phase = self._pilot.phase
        return controls

    def _on_target(self, message: PoseStamped) -> None:
        try:
            position, heading = to_target(message)
            if self.body is None:
                raise PilotError("no state has come yet")
            distance = float(np.linalg.norm(position - self.body[: S.ATTITUDE]))
            if distance > self._largest_distance:
                raise PilotError(f"distance = {distance:g} m: allowed are 0 to {self._largest_distance:g} m")
            self._pilot.hold(position, heading)
        except SbsError as error:
            self._rejections.add(error)
            return
        north, east, down = position
        text = f"north {north:.2f}, east {east:.2f}, height {-down:.2f} m, heading {math.degrees(heading):.1f} deg"
        self.get_logger().info(f"target: {text}", throttle_duration_sec=WARNING_PERIOD)

    def on_event(self, event: FlightEvent, is_new: bool) -> None:
        """Hold the new position after a reset; the target before it is void."""
        if is_new and event.kind == FlightEvent.RESET:
            state = np.array(event.state)
            self._pilot.restart((state[: S.ATTITUDE], quaternion_to_euler(state[S.ATTITUDE : S.VELOCITY])[0]))
            self.get_logger().info("reset: holding the new position")
            self._phase = FLYING

    def values(self) -> dict[str, object]:
        """Rejected targets."""
        return self._rejections.values()


def main(args: list[str] | None = None) -> None:
    """Hold until interrupted."""
    sys.exit(run(lambda: [HoverHoldNode()], args))
