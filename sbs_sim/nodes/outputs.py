"""What the simulator publishes: a thread that turns the reports of a flight into messages."""

import threading
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from nav_msgs.msg import Odometry
from rclpy.clock import Clock as SteadyClock
from rclpy.clock import ClockType
from rclpy.node import Node
from rosgraph_msgs.msg import Clock

from sbs_msgs.msg import BodyState, InflowArray, RotorStateArray, SimulationStatus
from sbs_sim.flight_loop import FlightLoop, Report
from sbs_sim.nodes.conversions import StateMessages, to_time
from sbs_sim.nodes.host import HEALTH_PERIOD, STATE_QOS, Refusals, diagnostic


class Outputs:
    """Publishes every report of a flight loop until the last, so that the flight itself never waits for DDS.

    Parameters
    ----------
    node : Node
        Owner of the publishers.
    loop : FlightLoop
    refusals : Refusals
        Commands that the simulator has refused.
    """

    def __init__(self, node: Node, loop: FlightLoop, refusals: Refusals) -> None:
        self._node, self._loop, self._refusals = node, loop, refusals
        self._messages = StateMessages(loop.aircraft)
        self._clock_message, self._status = Clock(), SimulationStatus()
        self._last_report: Report | None = None
        self._state = node.create_publisher(BodyState, "state", STATE_QOS)
        self._rotors = node.create_publisher(RotorStateArray, "rotors", STATE_QOS)
        self._inflow = node.create_publisher(InflowArray, "inflow", STATE_QOS)
        self._odom = node.create_publisher(Odometry, "odom", STATE_QOS)
        self._clock = node.create_publisher(Clock, "/clock", STATE_QOS)
        self._status_topic = node.create_publisher(SimulationStatus, "status", STATE_QOS)
        self._health = node.create_publisher(DiagnosticArray, "diagnostics", STATE_QOS)
        steady = SteadyClock(clock_type=ClockType.STEADY_TIME)
        node.create_timer(HEALTH_PERIOD, self._publish_health, clock=steady)
        self._thread = threading.Thread(target=self._publish_all, name="publisher", daemon=True)
        self._thread.start()

    def join(self) -> None:
        """Wait until the last report of a stopped loop is out."""
        self._thread.join()

    def _publish_all(self) -> None:
        while (report := self._loop.reports.get()) is not None:
            self._say_changes(report)
            self._last_report = report
            stamp = to_time(report.time)
            self._clock_message.clock = stamp
            self._clock.publish(self._clock_message)
            if report.snapshot is not None:
                self._messages.fill(report.snapshot)
                self._state.publish(self._messages.state)
                self._rotors.publish(self._messages.rotors)
                self._inflow.publish(self._messages.inflow)
                self._odom.publish(self._messages.odom)
            self._publish_status(report, stamp)

    def _publish_status(self, report: Report, stamp: Any) -> None:
        status = self._status
        status.header.stamp = stamp
        status.state = SimulationStatus.PLAYING if report.playing else SimulationStatus.PAUSED
        status.sim_time = report.time
        status.real_time_factor = report.real_time_factor
        status.missed_deadlines = report.missed_deadlines
        status.steps = report.step
        status.dropped_messages = report.dropped
        status.rejected_messages = self._refusals.count
        status.fault = report.fault
        self._status_topic.publish(status)

    def _say_changes(self, report: Report) -> None:
        """One log line when a fault or a time-out begins."""
        before, log = self._last_report, self._node.get_logger()
        if report.fault and (before is None or report.fault != before.fault):
            log.error(f"paused: {report.fault}")
        if report.command_timed_out and (before is None or not before.command_timed_out):
            log.warning(f"no command for {self._loop.command_timeout:g} s: holding the last one")

    def _publish_health(self) -> None:
        report = self._last_report
        if report is None:
            return
        problems = []
        if report.fault:
            problems.append((DiagnosticStatus.ERROR, report.fault))
        if report.command_timed_out:
            problems.append((DiagnosticStatus.WARN, "command timed out, holding the last one"))
        if report.dropped:
            problems.append((DiagnosticStatus.WARN, f"{report.dropped} ticks not published"))
        values = {
            "sim_time": f"{report.time:.3f}",
            "real_time_factor": f"{report.real_time_factor:.4f}",
            "missed_deadlines": report.missed_deadlines,
            **self._refusals.values(),
        }
        message = DiagnosticArray(status=[diagnostic("simulator", problems, values)])
        message.header.stamp = to_time(report.time)
        self._health.publish(message)
