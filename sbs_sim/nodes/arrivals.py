"""Commands as they arrive: refused, late, out of order, from nobody or from several at once; all of it is told."""

import time
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.serialization import serialize_message

from sbs_sim.errors import SimulationError
from sbs_sim.nodes.host import Log, Refusals
from sbs_sim.nodes.number_fields import check_numbers, scalars

ODD_AGE = 0.5  # s that a stamp may be away from the simulation time without a word
NEW_CLOCK = 0.5  # s of wall time without an accepted command after which earlier stamps are those of another clock
FAINT = 1e-200  # in size: what has come so near to zero has not been an integer
SHOWN = 4  # publishers that are named


class Arrivals(Refusals):
    """Keeps the books of a topic of commands.

    The newest command counts. One that is stamped earlier than the one in force came too late and is refused; one
    without a stamp (zero) is new. What is odd about the others is told in the diagnostics: stamps far from the
    simulation time, several publishers, or none any more.

    Parameters
    ----------
    node : Node
    kind : type
        Of the messages; they have a header.
    name : str
        Of the topic.
    qos : QoSProfile
    log : Log, optional
        Where accepted messages are recorded.
    """

    def __init__(self, node: Node, kind: Any, name: str, qos: QoSProfile, log: Log | None = None) -> None:
        super().__init__(node, name)
        self._log = log
        self._topic = node.resolve_topic_name(name)
        self._channel = log.channel(self._topic, kind, qos, name) if log else 0
        self._heard = False  # at least one publisher has been there
        self.restart()

    def restart(self) -> None:
        """Forget what came before: the flight, and its time, begin anew."""
        self._stamp = 0
        self._accepted_at = 0.0
        self._oddest = 0.0
        self._decaying: frozenset[str] = frozenset()

    def check(self, message: Any) -> None:
        """Raise SimulationError for a command that came too late, or with a number that was none when it was sent."""
        self.check_order(message)
        check_numbers(message, self._decaying)

    def check_order(self, message: Any) -> None:
        """Raise SimulationError for a command that is stamped earlier than the one in force."""
        stamp = _nanoseconds(message)
        if 0 < stamp < self._stamp and time.monotonic() - self._accepted_at < NEW_CLOCK:
            late = (self._stamp - stamp) * 1e-9
            raise SimulationError(f"stamp = {stamp * 1e-9:.3f} s: {late:.3g} s before that of the command in force")

    def accept(self, message: Any, now: float) -> None:
        """Record a command that is taken at a simulation time [s]."""
        self._decaying = frozenset(name for name, value in scalars(message) if 0.0 < abs(value) < FAINT)
        stamp = _nanoseconds(message)
        if stamp:
            self._stamp, self._accepted_at = stamp, time.monotonic()
            age = now - stamp * 1e-9
            if abs(age) > max(ODD_AGE, abs(self._oddest)):
                self._oddest = age
        if self._log is not None:
            self._log.write(self._channel, now, serialize_message(message))

    def problems(self) -> list[tuple[bytes, str]]:
        """What is odd since the last call, for the diagnostics."""
        found = []
        oddest, self._oddest = self._oddest, 0.0
        if oddest > 0.0:
            found.append(f"{self._what} stamped up to {oddest:.3g} s ago")
        elif oddest < 0.0:
            clock = self._node.resolve_topic_name("clock")
            found.append(f"{self._what} stamped up to {-oddest:.3g} s ahead of {clock}, not by use_sim_time")
        senders = self._node.get_publishers_info_by_topic(self._topic)
        if len(senders) > 1:
            names = ", ".join(
                sorted(f"{sender.node_namespace.rstrip('/')}/{sender.node_name}" for sender in senders)[:SHOWN]
            )
            found.append(f"{len(senders)} publishers of {self._what}, the newest command counts: {names}")
        elif not senders and self._heard:
            found.append(f"nobody publishes {self._what} any more, the last ones are held")
        self._heard = self._heard or bool(senders)
        return [(DiagnosticStatus.WARN, text) for text in found]


def _nanoseconds(message: Any) -> int:
    """Stamp of a message [ns]; zero if it has none."""
    stamp = message.header.stamp
    return int(stamp.sec) * 1_000_000_000 + int(stamp.nanosec)
