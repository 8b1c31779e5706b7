"""What the nodes that fly have in common: every `state` is answered by `controls`.

Without states there are no controls, so a pause holds everything; the simulator holds the last controls meanwhile.
"""

import time

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from numpy.typing import NDArray
from rclpy.clock import Clock, ClockType
from rclpy.qos import QoSProfile, ReliabilityPolicy

from sbs_msgs.msg import BodyState, Controls, FlightEvent, SimulationStatus
from sbs_sim.errors import SbsError
from sbs_sim.nodes.component import Component
from sbs_sim.nodes.conversions import body_array, to_seconds, to_time, touching_share
from sbs_sim.nodes.diagnostics import DIAGNOSTICS_PERIOD, diagnostic_status
from sbs_sim.nodes.pilot_conversions import check_event, controls_message
from sbs_sim.nodes.qos import COMMAND_QOS, EVENT_QOS, STATE_QOS
from sbs_sim.nodes.rejections import Rejections

Array = NDArray[np.float64]

STATE_TIMEOUT = 0.5  # s of wall time without a state
WAITING_PERIOD = 3.0  # s of wall time between lines that say what is waited for
MAX_EVENT_DELAY = 1.0  # s of simulation time that an event may come after later states
NEWEST_QOS = QoSProfile(depth=1, reliability=ReliabilityPolicy.RELIABLE)  # a queue of states would be a delay


class PilotNode(Component):
    """A node that flies. Subclasses define `fly`, and `on_event` if resets matter to them; `begin` starts them.

    Attributes
    ----------
    body : ndarray, shape (13,), or None
        The latest state: position, attitude, velocity, rates.
    time : float
        Of the latest state [s of simulation time].
    touching : float or None
        Share of the contact points that touch the ground in the state that is to be answered; None without such points.
    """

    def begin(self) -> None:
        """Make publishers and subscriptions, once everything else is ready."""
        self.body: Array | None = None
        self.time = 0.0
        self.touching: float | None = None
        self._arrived = time.monotonic()
        self._paused = self._stale = self._moves = False
        self._bad_states, self._bad_events = Rejections(self, "state"), Rejections(self, "events")
        self._output = self.create_publisher(Controls, "controls", COMMAND_QOS)
        self._health = self.create_publisher(DiagnosticArray, "diagnostics", STATE_QOS)
        self.create_subscription(FlightEvent, "events", self._on_event, EVENT_QOS)
        self.create_subscription(SimulationStatus, "status", self._on_status, STATE_QOS)
        self.create_subscription(BodyState, "state", self._on_state, NEWEST_QOS)
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(DIAGNOSTICS_PERIOD, self._publish_diagnostics, clock=steady)
        self.create_timer(WAITING_PERIOD, self._log_waiting, clock=steady)

    def controls_for(self, now: float, body: Array) -> Array | None:
        """Controls [rad], shape (4,), for a state; None to publish none. SbsError refuses the state."""
        raise NotImplementedError

    def on_event(self, event: FlightEvent, is_new: bool) -> None:
        """Something acted on the flight: before this node has seen a state, or now (`is_new`)."""

    def waiting_for(self) -> str:
        """What this node waits for before it flies, in words; empty if for nothing."""
        if self._paused and not self._moves:  # a node that joins during a pause gets the paused state
            return "the flight to go on: it is paused"
        if self.body is None or self._stale:
            return f"{self.topic('state')}: is a simulator running there?"
        return ""

    def topic(self, name: str) -> str:
        """Full name of a topic or service, and the domain of the subscription."""
        return f"{self.resolve_topic_name(name)} in ROS_DOMAIN_ID {self.context.get_domain_id()}"

    def problems(self) -> list[str]:
        """Problems for the diagnostics."""
        return []

    def values(self) -> dict[str, object]:
        """Values for the diagnostics."""
        return {}

    def _on_state(self, message: BodyState) -> None:
        now, body = to_seconds(message.header.stamp), body_array(message)
        self.touching = touching_share(message)
        try:
            controls = self.controls_for(now, body)
        except SbsError as error:
            self._bad_states.add(error)
            return
        if controls is not None:
            self._output.publish(controls_message(controls, message.header.stamp))
        self._moves |= self.body is not None and now != self.time
        self.time, self.body, self._arrived = now, body, time.monotonic()

    def _on_event(self, message: FlightEvent) -> None:
        try:
            check_event(message)
        except SbsError as error:
            self._bad_events.add(error)
            return
        self.on_event(
            message, self.body is not None and to_seconds(message.header.stamp) >= self.time - MAX_EVENT_DELAY
        )

    def _on_status(self, message: SimulationStatus) -> None:
        self._paused = message.state == SimulationStatus.PAUSED

    def _log_waiting(self) -> None:
        """Log what this node waits for."""
        if what := self.waiting_for():
            self.get_logger().info(f"waiting for {what}")

    def _publish_diagnostics(self) -> None:
        """Publish diagnostics; log once when states stop."""
        stale = not self._paused and time.monotonic() - self._arrived > STATE_TIMEOUT
        if stale and not self._stale and self.body is not None:
            self.get_logger().warning(f"no state for {STATE_TIMEOUT:g} s: the last controls stay")
        self._stale = stale
        problems = ([f"no state for {STATE_TIMEOUT:g} s"] if stale else []) + self.problems()
        refused = {"rejected_states": self._bad_states.count, "rejected_events": self._bad_events.count}
        values = {"paused": self._paused, **refused, **self.values()}
        status = diagnostic_status(self.get_name(), [(DiagnosticStatus.WARN, text) for text in problems], values)
        message = DiagnosticArray(status=[status])
        message.header.stamp = to_time(self.time)
        self._health.publish(message)
