"""Diagnostic status of a node."""

from collections.abc import Sequence
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus, KeyValue

DIAGNOSTICS_PERIOD = 1.0  # s of wall time between diagnostics


def diagnostic_status(name: str, problems: Sequence[tuple[bytes, str]], values: dict[str, Any]) -> DiagnosticStatus:
    """One diagnostic status: the worst of the problems gives the level, all of them the message."""
    level = max((level for level, _ in problems), default=DiagnosticStatus.OK)
    return DiagnosticStatus(
        level=level,
        name=name,
        hardware_id="",
        message="; ".join(text for _, text in problems) or "running",
        values=[KeyValue(key=key, value=str(value)) for key, value in values.items()],
    )
