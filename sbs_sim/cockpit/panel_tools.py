"""What the panels of the page have in common: callbacks of users, notifications, speeds."""

from collections.abc import Callable
from typing import Any

from viser import ViserServer

Answer = tuple[bool, str]  # whether it was done, and what is to be said

NOTIFICATION_TIME = 8.0  # s that a notice is shown
REAL_TIME_FACTORS = ("0.01", "0.05", "0.1", "0.25", "0.5", "1", "2", "as fast as possible")


def by_user(act: Callable[[], None]) -> Callable[[Any], None]:
    """Callback that acts on what a user did, not on values that the program sets."""

    def callback(event: Any) -> None:
        if event.client is not None:
            act()

    return callback


def notify(server: ViserServer, title: str, text: str) -> None:
    """Show every client what was rejected."""
    for client in server.get_clients().values():
        client.add_notification(title, text, color="orange", auto_close_seconds=NOTIFICATION_TIME)
