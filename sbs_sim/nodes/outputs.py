"""What the simulator publishes: a thread that turns the reports of a flight into messages.

Where the flight waits for that anyway (it is stepped, or flies as fast as it can be published), it does so itself.
"""

import contextlib
import math
import threading
import time
import traceback
from functools import partial
from typing import TYPE_CHECKING, Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from nav_msgs.msg import Odometry
from rclpy.clock import Clock as SteadyClock
from rclpy.clock import ClockType
from rclpy.node import Node
from rosgraph_msgs.msg import Clock

from sbs_msgs.msg import BodyState, FlightEvent, InflowArray, RotorStateArray, SimulationStatus
from sbs_sim.flight.records import Event
from sbs_sim.flight_loop import FlightLoop, Report
from sbs_sim.nodes.arrivals import Arrivals
from sbs_sim.nodes.company import Latecomers, Rivals
from sbs_sim.nodes.conversions import event_message, fill_working_states, to_time
from sbs_sim.nodes.host import COMPLAINT_PERIOD, EVENT_QOS, HEALTH_PERIOD, STATE_QOS, Topic, diagnostic
from sbs_sim.nodes.state_bytes import StatusBytes, states_of

HEARTBEAT = 1.0  # s of wall time between status and /clock of a flight at rest
PUBLISHING_TIME = 10.0  # s for what is still to be published at the end

if TYPE_CHECKING:
    from sbs_sim.nodes.recording import Recording


class Outputs:
    """Publishes every report of a flight loop until the last, so that the flight itself never waits for DDS.

    Parameters
    ----------
    node : Node
        Owner of the publishers.
    loop : FlightLoop
    arrivals : Arrivals
        The commands of the simulator.
    log : Recording, optional
        Where everything that is published is recorded.
    """

    def __init__(self, node: Node, loop: FlightLoop, arrivals: Arrivals, log: "Recording | None" = None) -> None:
        self._node, self._loop, self._arrivals, self._log = node, loop, arrivals, log
        self._log_fault_said = ""
        self._begun = False  # the start of the flight is published
        self._states = states = states_of(loop.aircraft, node.get_logger().warning)
        self._status_bytes = StatusBytes(node.get_logger().warning)
        self._clock_message, self._status = Clock(), SimulationStatus()
        self._last_report: Report | None = None
        self._warned: list[str] = []
        self._told: tuple[Any, ...] = ()  # what may be new though the aircraft has not moved
        self._told_at = -math.inf
        self._of_snapshots = (
            (Topic(node, BodyState, "state", STATE_QOS, log), partial(states.data, "state")),
            (Topic(node, RotorStateArray, "rotors", STATE_QOS, log), partial(states.data, "rotors")),
            (Topic(node, InflowArray, "inflow", STATE_QOS, log), partial(states.data, "inflow")),
            (Topic(node, Odometry, "odom", STATE_QOS, log), partial(states.data, "odom")),
        )
        self._clock = Topic(node, Clock, "clock", STATE_QOS, log)
        self._events = Topic(node, FlightEvent, "events", EVENT_QOS, log)
        self._status_topic = Topic(node, SimulationStatus, "status", STATE_QOS, log)
        self._health = Topic(node, DiagnosticArray, "diagnostics", STATE_QOS, log)
        own = (self._clock, *(topic for topic, _ in self._of_snapshots), self._events, self._status_topic)
        self._rivals, self._rivals_said = Rivals(node, [topic.name for topic in own]), ""
        self._latecomers = Latecomers(self._of_snapshots)
        steady = SteadyClock(clock_type=ClockType.STEADY_TIME)
        node.create_timer(HEALTH_PERIOD, self._publish_health, clock=steady)
        loop.read_by(self._take)
        self._thread = threading.Thread(target=self._publish_all, name="publisher", daemon=True)
        self._thread.start()

    def join(self) -> None:
        """Wait until the last report of a stopped loop is out, if the log does not hold it up for good."""
        self._thread.join(PUBLISHING_TIME)

    def _publish_all(self) -> None:
        while (report := self._loop.reports.get()) is not None:
            self._tell(report)
            self._loop.reports.task_done()

    def _take(self, report: Report) -> bool:
        """Publish in the flight's thread, if the log will not hold it up: else nobody could stop the flight."""
        if self._log is not None and not self._log.has_room:
            return False
        self._tell(report)
        return True

    def _tell(self, report: Report) -> None:
        """Publish what a report tells, if it is due; an error of ours ends neither the flight nor the publishing."""
        try:
            self._say_changes(report)
            self._last_report = report
            self._fill_status(report)
            self._latecomers.look(paused=not report.playing)
            if self._is_due(report):
                with contextlib.nullcontext() if self._log is None else self._log.instant():
                    self._publish(report)
        except Exception:
            self._node.get_logger().error(
                f"internal error: {traceback.format_exc()}", throttle_duration_sec=COMPLAINT_PERIOD
            )

    def _publish(self, report: Report) -> None:
        """Publish and record all that a report tells."""
        # where nothing hurries the flight, the log may hold it up rather than miss something
        now, wait = report.time, self._loop.pace == 0.0
        self._clock_message.clock = to_time(now)
        self._clock.publish(self._clock_message, now, wait)
        for event in report.events:
            self._tell_event(event, now, wait)
        if report.snapshot is not None:
            self._states.fill(report.snapshot)
            for topic, data in self._of_snapshots:
                (topic.record_bytes if report.repeated else topic.publish_bytes)(data(), now, wait)
        self._status_topic.publish_bytes(self._status_bytes.data(self._status), now, wait)

    def _tell_event(self, event: Event, now: float, wait: bool) -> None:
        """Publish and record an event: no flight can be flown again without it."""
        message = event_message(event, self._loop.step_size)
        if event.kind == FlightEvent.START and self._log is not None:
            self._log.take_start()
        if event.kind == FlightEvent.START and self._begun:
            # that of a log in mid-flight: for everybody else nothing has begun
            self._events.record(message, now, wait, essential=True)
        else:
            self._events.publish(message, now, wait, essential=True)
        self._begun = True

    def _is_due(self, report: Report) -> bool:
        """True if a report has news, or others must be told again that all goes on, and what time it is."""
        now, status = time.monotonic(), self._status
        counts = status.missed_deadlines, status.dropped_messages, status.rejected_messages, status.log_dropped
        told = (report.playing, report.step, counts, status.fault, status.log, status.log_fault)
        moved = report.snapshot is not None or bool(report.events)
        if not moved and told == self._told and now < self._told_at + HEARTBEAT:
            return False
        self._told, self._told_at = told, now
        return True

    def _fill_status(self, report: Report) -> None:
        status = self._status
        status.header.stamp = to_time(report.time)
        status.state = SimulationStatus.PLAYING if report.playing else SimulationStatus.PAUSED
        status.sim_time = report.time
        status.real_time_factor = report.real_time_factor
        status.missed_deadlines = report.missed_deadlines
        status.steps = report.step
        status.dropped_messages = report.dropped
        status.rejected_messages = self._arrivals.count
        status.fault = report.fault
        if report.snapshot is not None:
            fill_working_states(status, self._loop.aircraft, report.snapshot)
        if self._log is not None:
            status.log, status.log_dropped, status.log_fault = self._log.path, self._log.dropped, self._log.fault

    def _say_changes(self, report: Report) -> None:
        """One log line when a fault, a time-out or a departure from what the model describes begins."""
        before, log = self._last_report, self._node.get_logger()
        if report.fault and (before is None or report.fault != before.fault):
            log.error(f"paused: {report.fault}")
        self.say_log_fault()
        if report.command_timed_out and (before is None or not before.command_timed_out):
            log.warning(f"no command for {self._loop.command_timeout:g} s: holding the last one")

        for line in self._status.warnings:
            if line not in self._warned:
                log.warning(f"outside the model's validity: {line}", throttle_duration_sec=COMPLAINT_PERIOD)
        self._warned = list(self._status.warnings)

    def say_log_fault(self) -> None:
        """One log line when the recording has failed."""
        if self._log is not None and (fault := self._log.fault) and fault != self._log_fault_said:
            self._log_fault_said = fault
            self._node.get_logger().error(f"the log ends before the flight: {fault}")

    def _look_for_rivals(self) -> str:
        """Who publishes the same; one log line when that is new."""
        rivals = self._rivals.look()
        if rivals and rivals != self._rivals_said:
            self._node.get_logger().warning(rivals)
        self._rivals_said = rivals
        return rivals

    def _publish_health(self) -> None:
        report = self._last_report
        if report is None:
            return
        problems = []
        if report.fault:
            problems.append((DiagnosticStatus.ERROR, report.fault))
        if rivals := self._look_for_rivals():
            problems.append((DiagnosticStatus.WARN, rivals))
        if report.command_timed_out:
            problems.append((DiagnosticStatus.WARN, "command timed out, holding the last one"))
        problems += [(DiagnosticStatus.WARN, f"outside the model's validity: {line}") for line in self._status.warnings]
        if self._log is not None and (self._log.fault or self._log.dropped):
            lost = f"{self._log.dropped} messages not recorded {self._log.fault}"
            problems.append((DiagnosticStatus.WARN, lost.strip()))
        if report.dropped:
            problems.append((DiagnosticStatus.WARN, f"{report.dropped} ticks not published"))
        problems += self._arrivals.problems()
        values = {
            "sim_time": f"{report.time:.3f}",
            "real_time_factor": f"{report.real_time_factor:.4f}",
            "missed_deadlines": report.missed_deadlines,
            **self._arrivals.values(),
        }
        message = DiagnosticArray(status=[diagnostic("simulator", problems, values)])
        message.header.stamp = to_time(report.time)
        self._health.publish(message, report.time)
