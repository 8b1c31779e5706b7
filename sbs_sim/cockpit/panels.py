"""The controls of the page: sliders, buttons, keys. What they do is done by a `Pilot`."""

import itertools
import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from viser import ViserServer

from sbs_sim.aircraft import Aircraft
from sbs_sim.analysis.control_effects import ControlEffect
from sbs_sim.analysis.trim import TrimCondition
from sbs_sim.cockpit.readouts import condition_here
from sbs_sim.cockpit.scene import Shown
from sbs_sim.cockpit.told import Trimmed, line, model_page, trim_page
from sbs_sim.errors import SbsError
from sbs_sim.model.state import CONTROL_NAMES
from sbs_sim.simulation import Snapshot

Array = NDArray[np.float64]
Answer = tuple[bool, str]  # whether it was done, and what is to be said

SLIDER_STEP, KEY_STEP = 0.02, 0.1  # deg
LARGEST_MAGNIFICATION = 20.0
PACES = ("0.01", "0.05", "0.1", "0.25", "0.5", "1", "2", "as fast as possible")
LABELS = ("Collective", "Lateral", "Longitudinal", "Differential")
# Two keys of each stick, with what they do to any aircraft; they lie together, apart from those that move the camera.
KEYS = (
    (("H", "Collective down"), ("Y", "Collective up")),
    (("J", "Roll left"), ("L", "Roll right")),
    (("K", "Pull, nose up"), ("I", "Push, nose down")),
    (("O", "Nose right"), ("U", "Nose left")),
)
UNKNOWN = "what more of it does to this aircraft is not known, for it has no hover"
LIVE, NOTHING = "live", "choose a log"
PLAY, PAUSE, STEP, RESET = "Play", "Pause", "Step", "Reset"
RECORD, END_RECORD = "Record", "End recording"
TRIM, LINEARIZE = "Trim here", "Linearize here"


class Pilot(Protocol):
    """What a page can ask of a flight."""

    def command(self, controls: Array | None) -> None:
        """Hold pilot controls [rad], shape (4,), from now on; None lets go of them."""

    def pause(self, paused: bool) -> Answer:
        """Pause or go on."""

    def step(self, ticks: int) -> Answer:
        """Fly some ticks while paused."""

    def reset(self, condition: TrimCondition, height: float) -> Answer:
        """Put the aircraft into a trimmed condition at a height above the origin [m]."""

    def set_pace(self, factor: float) -> Answer:
        """Simulation time over wall time; 0 is as fast as possible."""

    def set_wind(self, velocity: Array, turbulence: float) -> Answer:
        """Steady wind, NED [m/s], shape (3,), and standard deviation of turbulence in all directions [m/s]."""

    def record(self, on: bool) -> Answer:
        """Begin a log in the default folder, or end the present one."""

    def trim(self, condition: TrimCondition) -> tuple[Trimmed | None, str]:
        """Trim a condition; or why there is no trim."""

    def linearize(self, condition: TrimCondition) -> tuple[Trimmed | None, str]:
        """Linearize about a condition: its trim, or why there is none; the model comes by itself."""


def _by_user(act: Callable[[], None]) -> Callable[[Any], None]:
    """Callback that acts on what a user did, not on values that the program sets."""

    def callback(event: Any) -> None:
        if event.client is not None:
            act()

    return callback


def _notify(server: ViserServer, title: str, text: str) -> None:
    """Tell everyone who looks at the page what was refused."""
    for client in server.get_clients().values():
        client.add_notification(title, text, color="orange", auto_close_seconds=8.0)


class FlyPanel:
    """Controls, clock, place and wind of a live flight.

    Parameters
    ----------
    server : ViserServer
    pilot : Pilot
    here : callable
        The flight right now, None before there is one.
    """

    def __init__(self, server: ViserServer, pilot: Pilot, here: Callable[[], Snapshot | None]) -> None:
        self._server, self._pilot, self._here = server, pilot, here
        self._paused = False
        self._recording = False
        self._holding = False
        self._aircraft: Aircraft | None = None
        self._ranges = np.tile((-1.0, 1.0), (len(CONTROL_NAMES), 1))  # deg, until there is an aircraft
        self._senses = np.ones(len(CONTROL_NAMES))  # of the controls, in what their keys are to do
        self._add_clock()
        self._add_controls()
        self._add_reset()
        self._add_analysis()
        self._add_wind()
        self._add_keys()

    def use(self, aircraft: Aircraft, effects: Sequence[ControlEffect]) -> None:
        """Fly an aircraft from now on, whose controls have these effects; none of them if they are not known."""
        self._aircraft = aircraft
        self._ranges = np.degrees([aircraft.control_ranges[name] for name in CONTROL_NAMES])
        self._release()
        for slider, (low, high) in zip(self.sliders, self._ranges.tolist(), strict=True):
            slider.min, slider.max = low, high
            slider.value = float(np.clip(slider.value, low, high))
        self._senses = np.array([effect.sense for effect in effects] or [1.0] * len(CONTROL_NAMES))
        said = [f"more of it, in hover: {effect.words}" for effect in effects] or [UNKNOWN] * len(CONTROL_NAMES)
        for slider, words, ((less, _), (more, _)) in zip(self.sliders, said, KEYS, strict=True):
            slider.hint = f"{words}. Keys {less}, {more}"

    # ------------------------------------------------------------------------------------------------------- parts

    def _add_clock(self) -> None:
        gui = self._server.gui
        self._clock = gui.add_button_group("Flight", (PAUSE, STEP, RESET))
        self._clock.on_click(lambda event: self._on_clock(event.target.value))
        self._pace = gui.add_dropdown("Real time ×", PACES, initial_value="1")
        self._pace.on_update(_by_user(self._on_pace))
        self._record = gui.add_button(RECORD, hint="begins a log of the flight as it is now, or ends the present one")
        self._record.on_click(lambda _: self._say("Recording", self._pilot.record(not self._recording)))

    def _add_controls(self) -> None:
        gui = self._server.gui
        with gui.add_folder("Controls [deg]"):
            self.sliders = []
            for i, label in enumerate(LABELS):
                low, high = self._ranges[i]
                slider = gui.add_slider(label, low, high, SLIDER_STEP, float(np.clip(0.0, low, high)))
                slider.on_update(_by_user(self._on_slider))
                self.sliders.append(slider)
            self._hold = gui.add_checkbox("Hold", False, hint="the page keeps commanding; untick to let others fly")
            self._hold.on_update(_by_user(self._on_hold))

    def _add_reset(self) -> None:
        gui = self._server.gui
        with gui.add_folder("Reset to a trimmed flight", expand_by_default=False):
            self._airspeed = gui.add_number("Airspeed [m/s]", 0.0, min=-100.0, max=100.0, step=0.5)
            self._climb = gui.add_number("Climb [m/s]", 0.0, min=-50.0, max=50.0, step=0.1)
            self._sideslip = gui.add_number("Sideslip [deg]", 0.0, min=-180.0, max=180.0, step=1.0)
            self._turn = gui.add_number("Turn [deg/s]", 0.0, min=-170.0, max=170.0, step=1.0)
            self._height = gui.add_number("Height [m]", 10.0, min=-1e5, max=1e5, step=1.0)

    def _add_analysis(self) -> None:
        gui = self._server.gui
        buttons = gui.add_button_group("Analyse", (TRIM, LINEARIZE))
        buttons.on_click(lambda event: self._on_analysis(event.target.value))
        self._result = gui.add_html("")

    def _add_wind(self) -> None:
        gui = self._server.gui
        with gui.add_folder("Wind, where the air goes to", expand_by_default=False):
            self._wind = [
                gui.add_number(f"{name} [m/s]", 0.0, min=-100.0, max=100.0, step=0.5)
                for name in ("North", "East", "Down")
            ]
            self._turbulence = gui.add_number("Turbulence, σ [m/s]", 0.0, min=0.0, max=20.0, step=0.1)
            gui.add_button("Set wind").on_click(lambda _: self._on_wind())

    def _add_keys(self) -> None:
        add = self._server.gui.add_command
        add("Pause or go on", hotkey="space").on_trigger(lambda _: self._on_clock(PAUSE))
        add("Step", hotkey="N").on_trigger(lambda _: self._on_clock(STEP))
        add("Reset", hotkey="R", modifier="shift").on_trigger(lambda _: self._on_clock(RESET))
        for key, name in itertools.chain.from_iterable(KEYS):
            add(name, hotkey=key).on_trigger(lambda _, key=key: self.press(key))

    # ----------------------------------------------------------------------------------------------------- actions

    def _say(self, what: str, answer: Answer) -> None:
        """Tell what was refused."""
        done, message = answer
        if not done:
            _notify(self._server, f"{what} refused", message)

    def _on_clock(self, button: str) -> None:
        if button in (PLAY, PAUSE):
            self._say(button, self._pilot.pause(not self._paused))
        elif button == STEP:
            self._say(button, self._pilot.step(1))
        elif button == RESET:
            self._release()
            self._say(button, self._pilot.reset(self._condition(), self._height.value))

    def _condition(self) -> TrimCondition:
        sideslip, turn = math.radians(self._sideslip.value), math.radians(self._turn.value)
        return TrimCondition(self._airspeed.value, self._climb.value, sideslip, turn)

    def _on_pace(self) -> None:
        if self._pace.value in PACES:
            factor = 0.0 if self._pace.value == PACES[-1] else float(self._pace.value)
            self._say("Real-time factor", self._pilot.set_pace(factor))

    def _on_slider(self) -> None:
        values = np.array([slider.value for slider in self.sliders])
        if not np.isfinite(values).all():  # what is no page of ours may send anything
            self._say("Controls", (False, f"{values.tolist()} deg: allowed are finite numbers"))
            return
        self._holding = True
        self._hold.value = True
        self._pilot.command(np.radians(values))

    def _on_hold(self) -> None:
        if self._hold.value:
            self._on_slider()
        else:
            self._release()

    def _release(self) -> None:
        self._holding = False
        self._hold.value = False
        self._pilot.command(None)

    def press(self, key: str) -> None:
        """Move the control of a key a step, the way that the key says whatever the sign of this aircraft's control."""
        for slider, sense, bounds, ((less, _), (more, _)) in zip(
            self.sliders, self._senses, self._ranges, KEYS, strict=True
        ):
            if key in (less, more):
                change = KEY_STEP * sense * (1.0 if key == more else -1.0)
                slider.value = float(np.clip(slider.value + change, *bounds))
                self._on_slider()

    def _on_analysis(self, button: str) -> None:
        snapshot, aircraft = self._here(), self._aircraft
        if snapshot is None or aircraft is None:
            return
        try:
            condition = condition_here(snapshot)
        except SbsError as error:
            self._say(button, (False, str(error)))
            return
        if button == TRIM:
            trimmed, message = self._pilot.trim(condition)
            self._result.content = trim_page(trimmed, snapshot, aircraft) if trimmed else ""
        else:
            trimmed, message = self._pilot.linearize(condition)
            self._result.content = model_page(trimmed, snapshot) if trimmed else ""
        self._say(button, (trimmed is not None, message))

    def _on_wind(self) -> None:
        velocity = np.array([number.value for number in self._wind])
        self._say("Wind", self._pilot.set_wind(velocity, self._turbulence.value))

    # ------------------------------------------------------------------------------------------------------ update

    def update(self, swashplate: Array, playing: bool, recording: bool) -> None:
        """Follow the flight: the swashplate angles that are in force [rad], unless this page commands the controls."""
        if self._recording != recording:
            self._recording = recording
            self._record.label = END_RECORD if recording else RECORD
        if self._paused == playing:
            self._paused = not playing
            self._clock.options = (PAUSE if playing else PLAY, STEP, RESET)
        if self._holding or self._aircraft is None:
            return
        controls = self._aircraft.unmix(swashplate)
        for slider, value in zip(self.sliders, np.degrees(controls), strict=True):
            rounded = round(float(value), 3)
            if not abs(slider.value - rounded) <= 0.5 * SLIDER_STEP:  # true for a NaN as well
                slider.value = rounded


class LogPanel:
    """Choice of a log, and its playing.

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
        self._pick.on_update(_by_user(self._on_pick))
        gui.add_button("Look for new logs").on_click(lambda _: self._refresh())
        self.playing = gui.add_checkbox("Play", True)
        self.rate = gui.add_dropdown("Speed ×", PACES[:-1], initial_value="1")
        self.place = gui.add_slider("Time [s]", 0.0, 1.0, 0.01, 0.0)
        self.moved = False
        self.place.on_update(_by_user(self._on_place))
        self.message = gui.add_html("")
        self.enable(False)

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
            _notify(self._server, "Log refused", message)

    def _on_place(self) -> None:
        self.moved = math.isfinite(self.place.value)

    @property
    def speed(self) -> float:
        """Recorded time over wall time; 1 for what is none of those to choose from."""
        return float(self.rate.value) if self.rate.value in PACES[:-1] else 1.0

    def enable(self, there: bool, beginning: float = 0.0, end: float = 1.0) -> None:
        """Offer the controls of a log from a beginning to an end [s]."""
        for handle in (self.playing, self.rate, self.place):
            handle.disabled = not there
        if there:
            self.place.min, self.place.max = beginning, max(end, beginning + 0.01)


class ViewPanel:
    """What is shown, how large, from where.

    Parameters
    ----------
    server : ViserServer
    shown : Shown
        Changed in place.
    """

    def __init__(self, server: ViserServer, shown: Shown) -> None:
        gui = server.gui
        magnification = gui.add_slider(
            "Flap, lag ×",
            1.0,
            LARGEST_MAGNIFICATION,
            0.5,
            shown.magnification,
            hint="flap and lag angles are drawn that much larger",
        )
        magnification.on_update(lambda _: _magnify(shown, magnification.value))
        for field, label in (
            ("ducts", "Ducts"),
            ("paths", "Tip paths"),
            ("arrows", "Thrust and hub moments"),
            ("inflow", "Inflow"),
            ("trail", "Trail"),
        ):
            box = gui.add_checkbox(label, getattr(shown, field))
            box.on_update(lambda _, field=field, box=box: setattr(shown, field, box.value))
        cameras = gui.add_button_group("From", tuple(CAMERAS))
        cameras.on_click(lambda event: place_camera(event.client, CAMERAS[event.target.value]))


def _magnify(shown: Shown, value: float) -> None:
    if 1.0 <= value <= LARGEST_MAGNIFICATION:  # false for a NaN as well
        shown.magnification = value


CAMERAS = {"behind": (-2.0, 1.2, 1.0), "left": (0.0, 2.6, 0.3), "above": (-0.01, 0.0, 3.0), "front": (2.2, 0.7, 0.6)}


def place_camera(client: Any, position: tuple[float, float, float]) -> None:
    """Look at the aircraft from a place, in the viewer's axes [m]: north, west, up."""
    if client is not None:
        client.camera.position = position
        client.camera.look_at = (0.0, 0.0, 0.0)
