"""Node `teleop`: flies with the keys that are pressed in its terminal."""

import contextlib
import math
import os
import select
import signal
import sys
import termios
import threading
import time
import tty
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sbs_sim.errors import PilotError
from sbs_sim.model import state as S
from sbs_sim.nodes.parameters import Parameter
from sbs_sim.nodes.process import SHUTDOWN_POLL_PERIOD, run
from sbs_sim.nodes.stick_node import STICK_PARAMETERS, StickNode
from sbs_sim.pilot.sticks import KeySticks, keys_of, shaped

PARAMETERS = {
    **STICK_PARAMETERS,
    "expo": Parameter(0.3, "Exponential response of the sticks: 0 linear, 1 cubic", 0.0, 1.0),
    "collective_deg": Parameter(3.0, "Change of the collective from its trim at full stick [deg]", 0.1, 20.0),
    "cyclic_deg": Parameter(2.0, "Change of the cyclics from their trim at full stick [deg]", 0.1, 20.0),
    "differential_deg": Parameter(
        3.0, "Change of the differential cyclic from its trim at full stick [deg]", 0.1, 20.0
    ),
}
HELP = """w s  collective up, down           arrows or i k j l  cyclic: push, pull, left, right
a d  nose left, right              space  sticks to the middle
t    take this as the trim         r      back to the first trim
g    augmentation on, off          q      end"""
LINE_PERIOD = 0.2  # s between two lines of the state


class Teleop(StickNode):
    """See the module.

    Parameters
    ----------
    end : Event
        Set when the user wants to end.
    restore : callable
        Makes the terminal as it was.
    """

    def __init__(self, end: threading.Event, restore: Callable[[], None]) -> None:
        super().__init__("teleop", PARAMETERS)
        degrees = [self.settings[name] for name in ("collective_deg", "cyclic_deg", "cyclic_deg", "differential_deg")]
        self.make_pilot(np.radians(degrees))
        self._keys = KeySticks()
        self._lock = threading.Lock()  # keys come in a thread of their own
        self._relaxed = self._shown = time.monotonic()
        self._end, self._ending, self._restore = end, threading.Event(), restore
        self._waiting: list[str] = []
        print(HELP, flush=True)
        self.begin()
        self.workers.append(threading.Thread(target=self._listen, name="keys", daemon=True))
        self.workers[-1].start()

    def stop(self) -> None:
        """End the reading of keys."""
        self._ending.set()
        self._restore()

    def released(self) -> None:
        """Sticks to the middle."""
        self._keys.centre()

    def sticks(self) -> NDArray[np.float64]:
        """Sticks as the keys have left them."""
        now = time.monotonic()
        self._keys.relax(now - self._relaxed)
        self._relaxed = now
        with self._lock:
            keys, self._waiting = self._waiting, []
        for key in keys:
            self._press(key)
        return np.array([shaped(value, 0.0, self.settings["expo"]) for value in self._keys.position])

    def controls_for(self, now: float, body: NDArray[np.float64]) -> NDArray[np.float64] | None:
        """Fly, and show how."""
        controls = super().controls_for(now, body)
        if controls is not None and time.monotonic() - self._shown > LINE_PERIOD:
            self._shown = time.monotonic()
            angles = " ".join(f"{math.degrees(value):6.2f}" for value in controls)
            speed, height = float(np.linalg.norm(body[S.VELOCITY : S.RATES])), -body[2]
            line = f"controls {angles} deg  augmentation {self.switch:3}  {speed:5.1f} m/s  height {height:6.1f} m"
            print(f"\r{line}", end="", flush=True)
        return controls

    def _press(self, key: str) -> None:
        """Carry out a key, in the node's thread."""
        act = {" ": self._keys.centre, "g": self.switch_augmentation, "t": self._take_trim, "r": self.first_trim}
        if not self._keys.press(key) and key in act:
            act[key]()

    def _take_trim(self) -> None:
        self.take_trim()
        self._keys.centre()

    def _listen(self) -> None:
        """Read keys until the end."""
        number = sys.stdin.fileno()
        while not self._ending.is_set():
            if not select.select([number], [], [], SHUTDOWN_POLL_PERIOD)[0]:
                continue
            data = os.read(number, 256)
            keys = keys_of(data)
            if not data or "q" in keys:  # no data: the terminal is gone
                self._end.set()
                return
            with self._lock:
                self._waiting += keys


@contextlib.contextmanager
def keys_at_once() -> Iterator[Callable[[], None]]:
    """Terminal that hands over every key and does not show it; afterwards as it was, whatever happens.

    Yields
    ------
    callable
        Restores it ahead of time.

    Raises
    ------
    PilotError
        The standard input is no terminal.
    """
    if not sys.stdin.isatty():
        raise PilotError("the standard input is no terminal: teleop reads keys from one; a joystick flies without")
    number = sys.stdin.fileno()
    before = termios.tcgetattr(number)

    def restore() -> None:
        with contextlib.suppress(termios.error):  # it has been closed
            termios.tcsetattr(number, termios.TCSADRAIN, before)

    def leave(*_: Any) -> None:
        restore()
        os._exit(0)

    try:
        # what `run` does with them begins only when the node is there
        for name in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            signal.signal(name, leave)
        tty.setcbreak(number)
        modes = termios.tcgetattr(number)
        modes[0] &= ~termios.IXON  # or Ctrl-S would hold up the output, and with it the flight
        termios.tcsetattr(number, termios.TCSANOW, modes)
        yield restore
    finally:
        restore()
        with contextlib.suppress(OSError):
            print(flush=True)


def main(args: list[str] | None = None) -> None:
    """Fly until interrupted."""
    end = threading.Event()
    try:
        with keys_at_once() as restore:
            code = run(lambda: [Teleop(end, restore)], args, end)
    except PilotError as error:
        print(error, file=sys.stderr)
        code = 1
    sys.exit(code)
