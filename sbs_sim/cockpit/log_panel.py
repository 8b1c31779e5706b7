"""Panel of the logs: choice of a log, and its playback."""

import math
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from viser import ViserServer

from sbs_sim.cockpit.panel_tools import NOTIFICATION_TIME, REAL_TIME_FACTORS, Answer, by_user, notify
from sbs_sim.cockpit.trim_report import line

Array = NDArray[np.float64]

TIME_STEP = 0.01  # s
LIVE, NOTHING = "live", "choose a log"
FLIES_ALONE = "The keys of the controls act on a live flight only, not on a log."


class LogPanel:
    """Selection of a log, and its playback.

    Parameters
    ----------
    server : ViserServer
    list_logs : callable
        Paths that can be chosen.
    choose : callable
        Takes a path, or None for the live flight; what to say if it cannot be shown.
    """

    def __init__(
        self,
        server: ViserServer,
        list_logs: Callable[[], Sequence[Path]],
        choose: Callable[[Path | None], Answer],
    ) -> None:
        self._server, self._list, self._choose = server, list_logs, choose
        self._first = NOTHING
        self._paths: dict[str, Path] = {}
        gui = server.gui
        self._pick = gui.add_dropdown("Source", [self._first, *self._names()])
        self._pick.on_update(by_user(self._on_pick))
        gui.add_button("Refresh the list").on_click(lambda _: self._refresh())
        self._times = np.zeros(1)
        self.playing = gui.add_checkbox("Play", True)
        self.rate = gui.add_dropdown("Speed ×", REAL_TIME_FACTORS[:-1], initial_value="1")
        self.time_slider = gui.add_slider("Time [s]", 0.0, 1.0, TIME_STEP, 0.0)
        self._last_notification = -math.inf
        self.moved = False
        self.time_slider.on_update(by_user(self._on_time))
        self.message = gui.add_html("")
        self.enable(None)

    def _names(self) -> list[str]:
        self._paths = {path.name: path for path in self._list()}
        return list(self._paths)

    def _refresh(self) -> None:
        chosen = self._pick.value
        self._pick.options = (self._first, *self._names())
        if chosen in self._pick.options:
            self._pick.value = chosen

    def offer_live(self, chosen: bool) -> None:
        """Offer a live flight, and say that it is shown if it is."""
        if self._first != LIVE:
            self._first = LIVE
            self._refresh()
        if chosen:
            self._pick.value = LIVE

    def _on_pick(self) -> None:
        done, message = self._choose(self._paths.get(self._pick.value))
        self.message.content = line(message)
        if not done:
            notify(self._server, "Log refused", message)

    def _on_time(self) -> None:
        self.moved = math.isfinite(self.time_slider.value)

    @property
    def speed(self) -> float:
        """Recorded time over wall time; 1 for what is none of those to choose from."""
        return float(self.rate.value) if self.rate.value in REAL_TIME_FACTORS[:-1] else 1.0

    def enable(self, times: Array | None) -> None:
        """Offer the controls of a log with instants [s], or of none."""
        for handle in (self.playing, self.rate, self.time_slider):
            handle.disabled = times is None
        if times is not None:
            self._times = times
            self.time_slider.min, self.time_slider.max = float(times[0]), max(float(times[-1]), float(times[0]) + 0.01)
            self.playing.value = True

    def _move(self, seconds: float) -> None:
        """Go to a time [s]."""
        self.time_slider.value = seconds
        self.moved = True

    def go(self) -> None:
        """Pause or resume; start again if the end is reached."""
        at_end = self.time_slider.value >= self._times[-1] - TIME_STEP
        if at_end:
            self._move(float(self._times[0]))
        self.playing.value = at_end or not self.playing.value

    def step(self) -> None:
        """Go to the next instant."""
        self.playing.value = False
        after = self._times[self._times > self.time_slider.value + 0.5 * TIME_STEP]
        self._move(float(after[0]) if len(after) else float(self._times[-1]))

    def restart(self) -> None:
        """Go to the beginning."""
        self._move(float(self._times[0]))

    def press(self, key: str) -> None:
        """Nothing: a log is flown."""
        self._notify_once(FLIES_ALONE)

    def doublet(self) -> None:
        """Nothing: a log is flown."""
        self._notify_once(FLIES_ALONE)

    def _notify_once(self, text: str) -> None:
        """Notify, but not at every key."""
        now = time.monotonic()
        if now - self._last_notification > NOTIFICATION_TIME:
            self._last_notification = now
            notify(self._server, "Not flown", text)
