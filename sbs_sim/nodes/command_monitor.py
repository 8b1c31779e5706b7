"""Monitor of a command topic: checks commands, records those that are accepted, reports problems in the diagnostics."""

import time
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.serialization import serialize_message

from sbs_sim.errors import SimulationError
from sbs_sim.nodes.number_fields import check_numbers, scalars
from sbs_sim.nodes.recorded_publisher import MessageLog
from sbs_sim.nodes.rejections import Rejections

MAX_STAMP_OFFSET = 0.5  # s between a stamp and the simulation time; a larger offset is reported
# After this wall time without an accepted command [s], an earlier stamp is taken for one of another clock.
CLOCK_RESET_TIME = 0.5
DECAYED = 1e-200  # magnitude; a value that decays to zero passes below this, an integer in a float field does not
MAX_LISTED = 4  # publishers named in a message


class CommandMonitor(Rejections):
    """Checks and records the commands of a topic.

    The newest command is in force. A command with an earlier stamp than that is late and is rejected. A command without
    a stamp (zero) is accepted. Diagnostics report stamps far from the simulation time, several publishers, and the loss
    of the last publisher.

    Parameters
    ----------
    node : Node
    kind : type
        Of the messages; they have a header.
    name : str
        Of the topic.
    qos : QoSProfile
    log : MessageLog, optional
        Where accepted messages are recorded.
    """

    def __init__(self, node: Node, kind: Any, name: str, qos: QoSProfile, log: MessageLog | None = None) -> None:
        super().__init__(node, name)
        self._log = log
        self._topic = node.resolve_topic_name(name)
        self._channel = log.channel(self._topic, kind, qos, name) if log else 0
        self._had_publisher = False  # the topic has had a publisher
        self.restart()

    def restart(self) -> None:
        """Forget earlier commands: a new flight starts, and its time with it."""
        self._stamp = 0
        self._accepted_at = 0.0
        self._max_stamp_offset = 0.0
        self._decaying: frozenset[str] = frozenset()

    def check(self, message: Any) -> None:
        """Raise SimulationError for a late command, or for one with an integer in a float field."""
        self.check_order(message)
        check_numbers(message, self._decaying)

    def check_order(self, message: Any) -> None:
        """Raise SimulationError for a command that is stamped earlier than the one in force."""
        stamp = _nanoseconds(message)
        if 0 < stamp < self._stamp and time.monotonic() - self._accepted_at < CLOCK_RESET_TIME:
            late = (self._stamp - stamp) * 1e-9
            raise SimulationError(f"stamp = {stamp * 1e-9:.3f} s: {late:.3g} s before that of the command in force")

    def accept(self, message: Any, now: float) -> None:
        """Record a command that is taken at a simulation time [s]."""
        self._decaying = frozenset(name for name, value in scalars(message) if 0.0 < abs(value) < DECAYED)
        stamp = _nanoseconds(message)
        if stamp:
            self._stamp, self._accepted_at = stamp, time.monotonic()
            age = now - stamp * 1e-9
            if abs(age) > max(MAX_STAMP_OFFSET, abs(self._max_stamp_offset)):
                self._max_stamp_offset = age
        if self._log is not None:
            self._log.write(self._channel, now, serialize_message(message))

    def problems(self) -> list[tuple[bytes, str]]:
        """Problems since the last call, for the diagnostics."""
        found = []
        offset, self._max_stamp_offset = self._max_stamp_offset, 0.0
        if offset > 0.0:
            found.append(f"{self._what} stamped up to {offset:.3g} s ago")
        elif offset < 0.0:
            clock = self._node.resolve_topic_name("clock")
            found.append(f"{self._what} stamped up to {-offset:.3g} s ahead of {clock}, not by use_sim_time")
        senders = self._node.get_publishers_info_by_topic(self._topic)
        if len(senders) > 1:
            names = ", ".join(
                sorted(f"{sender.node_namespace.rstrip('/')}/{sender.node_name}" for sender in senders)[:MAX_LISTED]
            )
            found.append(f"{len(senders)} publishers of {self._what}, the newest command counts: {names}")
        elif not senders and self._had_publisher:
            found.append(f"{self._what} has lost its publisher, the last command is held")
        self._had_publisher = self._had_publisher or bool(senders)
        return [(DiagnosticStatus.WARN, text) for text in found]


def _nanoseconds(message: Any) -> int:
    """Stamp of a message [ns]; zero if it has none."""
    stamp = message.header.stamp
    return int(stamp.sec) * 1_000_000_000 + int(stamp.nanosec)
