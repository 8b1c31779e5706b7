"""Keys of the page: they act on what is shown, a live flight or a log."""

import itertools
from collections.abc import Callable
from typing import Any, Protocol

from viser import ViserServer

from sbs_sim.cockpit.fly_panel import KEYS


class Keyed(Protocol):
    """What keys can ask of what is shown."""

    def go(self) -> None:
        """Pause or resume."""

    def step(self) -> None:
        """Advance by one tick or instant."""

    def restart(self) -> None:
        """Reset, or go to the beginning."""

    def doublet(self) -> None:
        """Disturb a flight."""

    def press(self, key: str) -> None:
        """Move the control of a key a step."""


def add_keys(server: ViserServer, front: Callable[[], Keyed | None]) -> None:
    """Have keys act on what is in front, if there is anything."""

    def add(name: str, act: Callable[[Keyed], None], **keys: Any) -> None:
        def trigger(_: object) -> None:
            if (keyed := front()) is not None:
                act(keyed)

        server.gui.add_command(name, **keys).on_trigger(trigger)

    add("Play or pause", lambda keyed: keyed.go(), hotkey="space")
    add("Step", lambda keyed: keyed.step(), hotkey="N")
    add("Reset, or rewind a log", lambda keyed: keyed.restart(), hotkey="R", modifier="shift")
    add("Doublet", lambda keyed: keyed.doublet(), hotkey="B")
    for key, name in itertools.chain.from_iterable(KEYS):
        add(name, _press(key), hotkey=key)


def _press(key: str) -> Callable[[Keyed], None]:
    return lambda keyed: keyed.press(key)
