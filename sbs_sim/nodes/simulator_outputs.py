"""What the simulator publishes: a thread that turns the reports of a flight into messages.

Where the flight waits for that anyway (it is stepped, or flies as fast as it can be published), it does so itself.
"""

import contextlib
import math
import threading
import time
import traceback
from functools import partial
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from nav_msgs.msg import Odometry
from rclpy.clock import Clock as SteadyClock
from rclpy.clock import ClockType
from rclpy.node import Node
from rosgraph_msgs.msg import Clock

from sbs_msgs.msg import BodyState, FlightEvent, InflowArray, RotorStateArray, SimulationStatus
from sbs_sim.flight.records import Event
from sbs_sim.flight_loop import FlightLoop, LoopReport
from sbs_sim.nodes.command_monitor import CommandMonitor
from sbs_sim.nodes.conversions import event_message, fill_working_states, to_time
from sbs_sim.nodes.diagnostics import DIAGNOSTICS_PERIOD, diagnostic_status
from sbs_sim.nodes.late_subscribers import LateSubscribers
from sbs_sim.nodes.other_publishers import OtherPublishers
from sbs_sim.nodes.qos import EVENT_QOS, STATE_QOS
from sbs_sim.nodes.recorded_publisher import RecordedPublisher, Viewers
from sbs_sim.nodes.recorder_node import RecorderNode
from sbs_sim.nodes.rejections import WARNING_PERIOD
from sbs_sim.nodes.sensor_outputs import SensorOutputs
from sbs_sim.nodes.state_bytes import StatusBytes, states_of
from sbs_sim.output.units import counted

HEARTBEAT = 1.0  # s of wall time between status and /clock of a flight at rest
PUBLISHING_TIMEOUT = 10.0  # s to publish the remaining reports at the end


class SimulatorOutputs:
    """Publishes every report of a flight loop until the last, so that the flight itself never waits for DDS.

    Parameters
    ----------
    node : Node
        Owner of the publishers.
    loop : FlightLoop
    commands : CommandMonitor
        The commands of the simulator.
    log : RecorderNode, optional
        Where everything that is published is recorded.
    sensors : SensorOutputs, optional
        None if all are off.
    viewers : Viewers, optional
        Who shows it.
    """

    def __init__(
        self,
        node: Node,
        loop: FlightLoop,
        commands: CommandMonitor,
        log: RecorderNode | None = None,
        sensors: SensorOutputs | None = None,
        viewers: Viewers | None = None,
    ) -> None:
        self._node, self._loop, self._commands, self._log = node, loop, commands, log
        self._sensors, self._viewers = sensors, viewers
        self._reported_log_fault = ""
        self._started = False  # the start of the flight has been published
        self._states = states = states_of(loop.aircraft, node.get_logger().warning)
        self._status_bytes = StatusBytes(node.get_logger().warning)
        self._clock_message, self._status = Clock(), SimulationStatus()
        self._last_report: LoopReport | None = None
        self._warned: list[str] = []
        self._last_content: tuple[Any, ...] = ()  # status content that may change while the aircraft does not move
        self._last_publication = -math.inf
        self._of_snapshots = (
            (RecordedPublisher(node, BodyState, "state", STATE_QOS, log, viewers), partial(states.data, "state")),
            (
                RecordedPublisher(node, RotorStateArray, "rotors", STATE_QOS, log, viewers),
                partial(states.data, "rotors"),
            ),
            (RecordedPublisher(node, InflowArray, "inflow", STATE_QOS, log, viewers), partial(states.data, "inflow")),
            (RecordedPublisher(node, Odometry, "odom", STATE_QOS, log, viewers), partial(states.data, "odom")),
        )
        self._clock = RecordedPublisher(node, Clock, "clock", STATE_QOS, log, viewers)
        self._events = RecordedPublisher(node, FlightEvent, "events", EVENT_QOS, log, viewers)
        self._status_topic = RecordedPublisher(node, SimulationStatus, "status", STATE_QOS, log, viewers)
        # not for viewers: other nodes publish it too, and they hear all of them
        self._health = RecordedPublisher(node, DiagnosticArray, "diagnostics", STATE_QOS, log)
        own = (self._clock, *(topic for topic, _ in self._of_snapshots), self._events, self._status_topic)
        self._other_publishers, self._last_other_publishers = OtherPublishers(node, [topic.name for topic in own]), ""
        self._late_subscribers = LateSubscribers(self._of_snapshots)
        steady = SteadyClock(clock_type=ClockType.STEADY_TIME)
        node.create_timer(DIAGNOSTICS_PERIOD, self._publish_health, clock=steady)
        loop.read_by(self._take)
        self._thread = threading.Thread(target=self._publish_all, name="publisher", daemon=True)
        self._thread.start()

    def join(self) -> None:
        """Wait until the last report of a stopped loop is out, if the log does not hold it up for good."""
        self._thread.join(PUBLISHING_TIMEOUT)

    def _publish_all(self) -> None:
        while (report := self._loop.reports.get()) is not None:
            self._process(report)
            self._loop.reports.task_done()

    def _take(self, report: LoopReport) -> bool:
        """Publish in the flight's thread, unless the log would block it: a blocked flight could not be stopped."""
        if self._log is not None and not self._log.has_room:
            return False
        self._process(report)
        return True

    def _process(self, report: LoopReport) -> None:
        """Publish a report if it is due. An internal error ends neither the flight nor the publishing."""
        try:
            self._log_changes(report)
            self._last_report = report
            self._fill_status(report)
            self._late_subscribers.update(paused=not report.playing)
            if self._is_due(report):
                with contextlib.nullcontext() if self._log is None else self._log.instant():
                    self._publish(report)
        except Exception:
            self._node.get_logger().error(
                f"internal error: {traceback.format_exc()}", throttle_duration_sec=WARNING_PERIOD
            )

    def _publish(self, report: LoopReport) -> None:
        """Publish and record the content of a report."""
        # as fast as possible, the flight waits for the log rather than lose messages
        now, wait = report.time, self._loop.pace == 0.0
        self._clock_message.clock = to_time(now)
        if self._viewers is not None:
            self._viewers.set_time(round(now * 1e9))
        self._clock.publish(self._clock_message, now, wait)
        for event in report.events:
            self._publish_event(event, now, wait)
        if report.snapshot is not None:
            self._states.fill(report.snapshot)
            for topic, data in self._of_snapshots:
                (topic.record_bytes if report.repeated else topic.publish_bytes)(data(), now, wait)
            if self._sensors is not None:
                self._sensors.publish(report.snapshot, wait)
        self._status_topic.publish_bytes(self._status_bytes.data(self._status), now, wait)

    def _publish_event(self, event: Event, now: float, wait: bool) -> None:
        """Publish and record an event: replay needs every one."""
        message = event_message(event, self._loop.step_size)
        if event.kind == FlightEvent.START and self._log is not None:
            self._log.open_at_start()
        if event.kind == FlightEvent.START and self._started:
            # a log has started in mid-flight: subscribers must not see another start
            self._events.record(message, now, wait, essential=True)
        else:
            self._events.publish(message, now, wait, essential=True)
        self._started = True

    def _is_due(self, report: LoopReport) -> bool:
        """True if a report has changed, or the next heartbeat is due."""
        now, status = time.monotonic(), self._status
        counts = status.missed_deadlines, status.dropped_messages, status.rejected_messages, status.log_dropped
        content = (report.playing, report.step, counts, status.fault, status.log, status.log_fault)
        moved = report.snapshot is not None or bool(report.events)
        if not moved and content == self._last_content and now < self._last_publication + HEARTBEAT:
            return False
        self._last_content, self._last_publication = content, now
        return True

    def _fill_status(self, report: LoopReport) -> None:
        status = self._status
        status.header.stamp = to_time(report.time)
        status.state = SimulationStatus.PLAYING if report.playing else SimulationStatus.PAUSED
        status.sim_time = report.time
        status.real_time_factor = report.real_time_factor
        status.missed_deadlines = report.missed_deadlines
        status.steps = report.step
        status.dropped_messages = report.dropped
        status.rejected_messages = self._commands.count
        status.fault = report.fault
        status.model = self._loop.model
        if report.snapshot is not None:
            fill_working_states(status, self._loop.aircraft, report.snapshot)
            if (model := self._loop.stitched) is not None:
                status.warnings = model.warnings_at(report.snapshot.state, report.snapshot.wind)
        if self._log is not None:
            status.log, status.log_dropped, status.log_fault = self._log.path, self._log.dropped, self._log.fault

    def _log_changes(self, report: LoopReport) -> None:
        """One log line when a fault, a time-out or a departure from what the model describes begins."""
        before, log = self._last_report, self._node.get_logger()
        if report.fault and (before is None or report.fault != before.fault):
            log.error(f"paused: {report.fault}")
        self.report_log_fault()
        if report.command_timed_out and (before is None or not before.command_timed_out):
            log.warning(f"no command for {self._loop.command_timeout:g} s: holding the last one")

        for line in self._status.warnings:
            if line not in self._warned:
                log.warning(f"outside the model's validity: {line}", throttle_duration_sec=WARNING_PERIOD)
        self._warned = list(self._status.warnings)

    def report_log_fault(self) -> None:
        """One log line when the recording has failed."""
        if self._log is not None and (fault := self._log.fault) and fault != self._reported_log_fault:
            self._reported_log_fault = fault
            self._node.get_logger().error(f"the log ends before the flight: {fault}")

    def _find_other_publishers(self) -> str:
        """Other publishers of the same topics; one log line when they change."""
        others = self._other_publishers.describe()
        if others and others != self._last_other_publishers:
            self._node.get_logger().warning(others)
        self._last_other_publishers = others
        return others

    def _publish_health(self) -> None:
        report = self._last_report
        if report is None:
            return
        problems = []
        if report.fault:
            problems.append((DiagnosticStatus.ERROR, report.fault))
        if others := self._find_other_publishers():
            problems.append((DiagnosticStatus.WARN, others))
        if report.command_timed_out:
            problems.append((DiagnosticStatus.WARN, "command timed out, holding the last one"))
        problems += [(DiagnosticStatus.WARN, f"outside the model's validity: {line}") for line in self._status.warnings]
        if self._log is not None and (self._log.fault or self._log.dropped):
            lost = f"{counted(self._log.dropped, 'message')} not recorded {self._log.fault}"
            problems.append((DiagnosticStatus.WARN, lost.strip()))
        if report.dropped:
            problems.append((DiagnosticStatus.WARN, f"{counted(report.dropped, 'tick')} not published"))
        problems += self._commands.problems()
        values = {
            "sim_time": f"{report.time:.3f}",
            "real_time_factor": f"{report.real_time_factor:.4f}",
            "missed_deadlines": report.missed_deadlines,
            "method": self._loop.method,
            "model": self._loop.model,
            **self._commands.values(),
        }
        message = DiagnosticArray(status=[diagnostic_status("simulator", problems, values)])
        message.header.stamp = to_time(report.time)
        self._health.publish(message, report.time)
