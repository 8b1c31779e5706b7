"""Counter of rejected messages."""

import time
from typing import Any

from rclpy.node import Node

WARNING_PERIOD = 1.0  # s between warnings about bad input


class Rejections:
    """Counts the messages that a node has rejected, and logs the reason at most once a second.

    Parameters
    ----------
    node : Node
    what : str
        Name of the messages.

    Attributes
    ----------
    count : int
    """

    def __init__(self, node: Node, what: str) -> None:
        self._node, self._what = node, what
        self.count = 0
        self._last, self._at = "none", 0.0  # reason, and when it came

    def add(self, reason: Exception) -> None:
        """Count one."""
        self.count += 1
        self._last, self._at = str(reason), time.monotonic()
        log = self._node.get_logger()
        log.warning(f"{self._what} rejected: {reason}", throttle_duration_sec=WARNING_PERIOD)

    def values(self) -> dict[str, Any]:
        """Values for the diagnostics."""
        return {"rejected_messages": self.count, "last_rejection": self._last}

    def values_with(self, *others: "Rejections") -> dict[str, Any]:
        """Values for the diagnostics of several topics together."""
        latest = max((self, *others), key=lambda one: one._at)
        return {"rejected_messages": sum(one.count for one in (self, *others)), "last_rejection": latest._last}
