"""Node `hover_hold`: holds position and heading; an example of control design with `linearize` (docs/tutorial.md).

Calls `linearize`, designs the gains and prints them. It then answers every `state` with `controls`. Subscribes
`target` (position and heading to hold; at the start those of the aircraft), `events` for resets and `status` for
pauses; publishes `diagnostics`. An aircraft that stands on the ground takes off for a target above it, and lands where
its target is on the ground or below. With the parameter `gains`, a file of the command `design`, it flies from hover to
cruise and back: it follows `cmd_vel` too, and holds its position when these commands end.
"""

import math
import sys
import time
from typing import Any

import numpy as np
import rclpy
from geometry_msgs.msg import PoseStamped, TwistStamped
from numpy.typing import NDArray

from sbs_msgs.msg import FlightEvent, LinearModel
from sbs_msgs.srv import Linearize
from sbs_sim.errors import PilotError, SbsError
from sbs_sim.model import state as S
from sbs_sim.model.frames import quaternion_to_euler
from sbs_sim.nodes.parameters import Parameter, declare
from sbs_sim.nodes.pilot_conversions import hover_model, to_target, to_velocity
from sbs_sim.nodes.pilot_node import WAITING_PERIOD, PilotNode
from sbs_sim.nodes.process import run
from sbs_sim.nodes.qos import COMMAND_QOS, SERVICE_QOS
from sbs_sim.nodes.rejections import WARNING_PERIOD, Rejections
from sbs_sim.pilot.envelope_file import load_envelope
from sbs_sim.pilot.envelope_pilot import EnvelopePilot
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
    "gains": Parameter("", "File of the command design: fly from hover to cruise by it; empty for the hover hold"),
    "command_timeout": Parameter(
        1.0,
        "With gains: age of a command on cmd_vel after which the position is held [s of simulation time]",
        0.05,
        3600.0,
    ),
}
POLL_PERIOD = 0.2  # s between two looks whether the service is there


class HoverHoldNode(PilotNode):
    """See the module."""

    def __init__(self) -> None:
        super().__init__("hover_hold")
        parameters = declare(self, PARAMETERS)
        self._largest_distance, self._timeout = parameters["largest_distance"], parameters["command_timeout"]
        self._envelope: EnvelopePilot | None = None
        self._phase, self._followed = "", 0.0
        if parameters["gains"]:
            self._begin_envelope(parameters["gains"])
        else:
            self._begin_hover_hold(parameters)
        self._rejections = Rejections(self, "target")
        self._bad_velocities = Rejections(self, "cmd_vel")
        self.create_subscription(PoseStamped, "target", self._on_target, COMMAND_QOS)
        self.create_subscription(TwistStamped, "cmd_vel", self._on_velocity, COMMAND_QOS)
        self.begin()

    def _begin_envelope(self, path: str) -> None:
        """Fly by the gains of a file."""
        found = load_envelope(path)
        self._envelope, self._axes = EnvelopePilot(found), found.axes
        speeds = f"{found.gains[0].airspeed:g} to {found.gains[-1].airspeed:g} m/s"
        print(f"gains for {found.aircraft} from {path}, {speeds}", flush=True)

    def _begin_hover_hold(self, parameters: dict[str, Any]) -> None:
        """Design the hover hold."""
        model = hover_model(*self._linearized(parameters["patience"]))
        found = design(model, dict.fromkeys(("forward", "right", "down"), parameters["position_limit"]))
        print("\n".join(found.describe()), flush=True)
        self._pilot = Landing(HoverHold(found), model.controls, model.axes)

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
        if self._envelope is not None:
            return self._envelope_controls(self._envelope, now, body, is_new)
        controls = self._pilot.controls(now, body, self.touching)
        if is_new and self._pilot.phase == FLYING:
            self.get_logger().info("holding the present position")
        elif self._pilot.phase != self._phase:
            self.get_logger().info(self._pilot.phase)
        self._phase = self._pilot.phase
        return controls

    def _envelope_controls(
        self, pilot: EnvelopePilot, now: float, body: NDArray[np.float64], is_new: bool
    ) -> NDArray[np.float64]:
        """Controls of the four axes by the gains of a file."""
        if is_new:
            self.get_logger().info("holding the present position")
        elif not pilot.position_hold and now - self._followed > self._timeout:
            pilot.stay()
            self.get_logger().info(f"no cmd_vel for {self._timeout:g} s: holding the present position")
        controls: NDArray[np.float64] = pilot.controls(now, body)[self._axes]
        return controls

    def _on_velocity(self, message: TwistStamped) -> None:
        try:
            velocity = to_velocity(message)
            if self._envelope is None:
                raise PilotError("the hover hold follows targets only: velocities need the parameter gains")
            self._envelope.fly(*velocity)
        except SbsError as error:
            self._bad_velocities.add(error)
            return
        self._followed = self.time
        forward, right, down, turn = velocity
        text = f"forward {forward:.2f}, right {right:.2f}, climb {-down:.2f} m/s, turn {math.degrees(turn):.1f} deg/s"
        self.get_logger().info(f"cmd_vel: {text}", throttle_duration_sec=WARNING_PERIOD)

    def _on_target(self, message: PoseStamped) -> None:
        try:
            position, heading = to_target(message)
            if self.body is None:
                raise PilotError("no state has come yet")
            distance = float(np.linalg.norm(position - self.body[: S.ATTITUDE]))
            if distance > self._largest_distance:
                raise PilotError(f"distance = {distance:g} m: allowed are 0 to {self._largest_distance:g} m")
            (self._envelope or self._pilot).hold(position, heading)
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
            (self._envelope or self._pilot).restart(
                (state[: S.ATTITUDE], quaternion_to_euler(state[S.ATTITUDE : S.VELOCITY])[0])
            )
            self.get_logger().info("reset: holding the new position")
            self._phase = FLYING

    def values(self) -> dict[str, object]:
        """Rejected targets."""
        return self._rejections.values() | {"rejected_velocities": self._bad_velocities.count}


def main(args: list[str] | None = None) -> None:
    """Hold until interrupted."""
    sys.exit(run(lambda: [HoverHoldNode()], args))
