"""Panel of the live flight: sliders, buttons and keys, which act through a `Pilot`."""

import math
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from viser import ViserServer

from sbs_sim.aircraft import Aircraft
from sbs_sim.analysis.control_effects import ControlEffect
from sbs_sim.cockpit.air_panel import AirPanel
from sbs_sim.cockpit.control_labels import axes_of, control_label
from sbs_sim.cockpit.panel_tools import REAL_TIME_FACTORS, Answer, by_user, notify
from sbs_sim.cockpit.readouts import condition_here
from sbs_sim.cockpit.trim_report import TrimResult, line, model_page, trim_page
from sbs_sim.errors import SbsError
from sbs_sim.flight.records import Snapshot
from sbs_sim.flight.trim_point import TrimCondition
from sbs_sim.model.state import CONTROL_NAMES

Array = NDArray[np.float64]

SLIDER_STEP, KEY_STEP = 0.02, 0.1  # deg
OLD_STATUS, OLDEST_STATUS = 0.5, 5.0  # s in which a status may still be one from before an answer; on a busy machine
LABELS = ("Collective", "Lateral", "Longitudinal", "Differential")  # until there is an aircraft
# Two keys of each stick, with what they do to any aircraft; they lie together, apart from those that move the camera.
KEYS = (
    (("H", "Collective down"), ("Y", "Collective up")),
    (("J", "Roll left"), ("L", "Roll right")),
    (("K", "Pull, nose up"), ("I", "Push, nose down")),
    (("O", "Nose right"), ("U", "Nose left")),
)
UNKNOWN = "effect on this aircraft unknown, because it has no trimmed hover"
PLAY, PAUSE, STEP, RESET = "Play", "Pause", "Step", "Reset"
STAND = "Stand on the ground"
RECORD, END_RECORD = "Record", "End recording"
TRIM, LINEARIZE = "Trim here", "Linearize here"
DOUBLET, TURBULENCE, CALM = "Doublet", "Turbulence", "Calm"
# What moves a trimmed flight within seconds, and leaves some to look: longitudinal cyclic, and gusts of a light wind.
DOUBLET_OF, DOUBLET_SIZE, DOUBLET_LENGTH = 2, math.radians(0.5), 0.25  # index, rad, s of simulation time each way
LIGHT_TURBULENCE = 0.3  # m/s
FIRST_HINT = (
    f"Space plays and pauses. In still air a trimmed flight can stay in place for a minute: {DOUBLET} (B) or"
    f" {TURBULENCE} disturbs it."
)
LOG_SHOWN = "A log is shown: the live flight cannot be controlled from here."
GONE = "No message of the simulator: what is below does nothing."


class Pilot(Protocol):
    """What a page can ask of a flight."""

    def command(self, controls: Array | None) -> None:
        """Hold pilot controls [rad], shape (4,), from now on; None lets go of them."""

    def doublet(self, rest: Array, change: Array, length: float) -> None:
        """Hold controls + change [rad], shape (4,), for a simulation time [s], then - change, then what was held."""

    def pause(self, paused: bool) -> Answer:
        """Pause or resume."""

    def step(self, ticks: int) -> Answer:
        """Fly some ticks while paused."""

    def reset(self, condition: TrimCondition, height: float) -> Answer:
        """Put the aircraft into a trimmed condition at a height above the origin [m]."""

    def stand(self) -> Answer:
        """Put the aircraft onto the ground, with all controls at rest."""

    def set_pace(self, factor: float) -> Answer:
        """Simulation time over wall time; 0 is as fast as possible."""

    def set_wind(self, fields: Mapping[str, Any]) -> Answer:
        """Blow as the service `set_wind` does with these fields, see `AirPanel.fields`."""

    def record(self, on: bool) -> Answer:
        """Begin a log in the default folder, or end the present one."""

    def trim(self, condition: TrimCondition) -> tuple[TrimResult | None, str]:
        """Trim a condition; or why there is no trim."""

    def linearize(self, condition: TrimCondition) -> tuple[TrimResult | None, str]:
        """Linearize about a condition: its trim, or why there is none; the model comes by itself."""


class FlyPanel:
    """Controls, clock, position and wind of a live flight.

    Parameters
    ----------
    server : ViserServer
    pilot : Pilot
    here : callable
        The flight right now, None before there is one.
    back : callable
        Shows it in place of a log.
    """

    def __init__(
        self, server: ViserServer, pilot: Pilot, here: Callable[[], Snapshot | None], back: Callable[[], None]
    ) -> None:
        self._server, self._pilot, self._here = server, pilot, here
        self._paused = False
        self._answered = -math.inf  # when a pause was answered [s]
        self._awaited = False  # until a status is as it was answered
        self._recording = False
        self._holding = False
        self._steerable = True
        self._turbulent = False
        self._aircraft: Aircraft | None = None
        self._ranges = np.tile((-1.0, 1.0), (len(CONTROL_NAMES), 1))  # deg, until there is an aircraft
        self._senses = np.ones(len(CONTROL_NAMES))  # of the controls, in what their keys are to do
        self._words = [UNKNOWN] * len(CONTROL_NAMES)
        self._labels, self._axes = list(LABELS), np.arange(len(CONTROL_NAMES))
        self._note = server.gui.add_html("", visible=False)
        self._back = server.gui.add_button("Show the live flight", visible=False)
        self._back.on_click(lambda _: back())
        self._all = server.gui.add_folder(None)
        with self._all:
            self._add_clock()
            self._add_disturbances()
            self._controls = server.gui.add_folder("Controls [deg]")
            self._add_analysis()
            self._add_reset()
            self._air = AirPanel(server, self._on_wind, lambda text: self._say("Own gust", (False, text)))
            self._record = server.gui.add_button(
                RECORD, hint="starts a log of the flight from now on, or ends the current one"
            )
            self._record.on_click(lambda _: self._on_record())
        self._add_controls()

    def use(self, aircraft: Aircraft, effects: Sequence[ControlEffect], pace: float = 1.0) -> None:
        """Fly an aircraft from now on.

        Parameters
        ----------
        aircraft : Aircraft
        effects : sequence of ControlEffect
            Of its controls; none of them if they are not known.
        pace : float
            Real-time factor as it is.
        """
        self._aircraft = aircraft
        axes = self._axes = axes_of(aircraft)
        self._senses = np.array([effects[i].sense for i in axes] if effects else [1.0] * len(axes))
        self._words = [f"an increase, in hover: {effects[i].words}" if effects else UNKNOWN for i in axes]
        self._ranges = np.degrees([aircraft.controls[i].range for i in axes])
        self._labels = [control_label(aircraft.controls[i].name) for i in axes]
        self._release()
        for handle in (*self.sliders, self._hold):
            handle.remove()
        self._add_controls()
        self._stand.visible = aircraft.has_contact
        self._show_pace(pace)

    def steer(self, note: str) -> None:
        """Let the flight be steered if there is nothing to note; else say that instead."""
        if self._steerable != (not note) or (note and self._note.content != line(note)):
            self._steerable = not note
            self._note.content, self._note.visible = line(note), bool(note)
            self._all.visible = note != LOG_SHOWN  # not for a flight that only hesitates: its open folders would close
            self._back.visible = note == LOG_SHOWN

    # ------------------------------------------------------------------------------------------------------- parts

    def _add_clock(self) -> None:
        gui = self._server.gui
        self._clock = gui.add_button_group("Flight", (PAUSE, STEP, RESET))
        self._clock.on_click(lambda event: self._on_clock(event.target.value))
        self._pace = gui.add_dropdown("Real time ×", REAL_TIME_FACTORS, initial_value="1")
        self._pace.on_update(by_user(self._on_pace))

    def _add_disturbances(self) -> None:
        gui = self._server.gui
        self._hint = gui.add_html(line(FIRST_HINT))
        self._disturb = gui.add_button_group(
            "Disturb",
            (DOUBLET, TURBULENCE),
            hint=f"doublet of {math.degrees(DOUBLET_SIZE):g} deg longitudinal cyclic in {2 * DOUBLET_LENGTH:g} s;"
            f" Dryden turbulence of {LIGHT_TURBULENCE:g} m/s",
        )
        self._disturb.on_click(lambda event: self._on_disturb(event.target.value))

    def _add_controls(self) -> None:
        gui = self._server.gui
        with self._controls:
            self.sliders = []
            for i, label in enumerate(self._labels):
                low, high = (float(end) for end in self._ranges[i])
                marks = tuple(
                    (value, f"{value:g}") for value in sorted({low, high} | ({0.0} if low < 0.0 < high else set()))
                )
                start = float(np.clip(0.0, low, high))
                (less, _), (more, _) = KEYS[i]
                hint = f"{self._words[i]}. Keys {less}, {more}"
                slider = gui.add_slider(label, low, high, SLIDER_STEP, start, hint=hint, marks=marks)
                slider.on_update(by_user(self._on_slider))
                self.sliders.append(slider)
            self._hold = gui.add_checkbox(
                "Hold", False, hint="this page keeps sending these controls; untick it to let another pilot fly"
            )
            self._hold.on_update(by_user(self._on_hold))

    def _add_reset(self) -> None:
        gui = self._server.gui
        with gui.add_folder("Reset to a trimmed flight", expand_by_default=False):
            self._airspeed = gui.add_number("Airspeed [m/s]", 0.0, min=-100.0, max=100.0, step=0.5)
            self._climb = gui.add_number("Climb [m/s]", 0.0, min=-50.0, max=50.0, step=0.1)
            self._sideslip = gui.add_number("Sideslip [deg]", 0.0, min=-180.0, max=180.0, step=1.0)
            self._turn = gui.add_number("Turn [deg/s]", 0.0, min=-170.0, max=170.0, step=1.0)
            self._height = gui.add_number("Height [m]", 10.0, min=-1e5, max=1e5, step=1.0)
        self._stand = gui.add_button(STAND, visible=False, hint="on its skids or wheels, with all controls at rest")
        self._stand.on_click(lambda _: self._on_stand())

    def _add_analysis(self) -> None:
        gui = self._server.gui
        buttons = gui.add_button_group("Analyse", (TRIM, LINEARIZE))
        buttons.on_click(lambda event: self._on_analysis(event.target.value))
        self._result = gui.add_html("")

    # ----------------------------------------------------------------------------------------------------- actions

    def _say(self, what: str, answer: Answer) -> None:
        """Notify the user of a refusal."""
        done, message = answer
        if not done:
            notify(self._server, f"{what} refused", message)

    def go(self) -> None:
        """Pause or resume."""
        if self._steerable:
            wanted = not self._paused
            answer = self._pilot.pause(wanted)
            self._say(PAUSE if wanted else PLAY, answer)
            if answer[0]:  # the next key may come before the next status
                self._answered, self._awaited = time.monotonic(), True
                self._show_clock(not wanted)

    def step(self) -> None:
        """Fly a tick."""
        if self._steerable:
            self._say(STEP, self._pilot.step(1))

    def restart(self) -> None:
        """Put the aircraft into the trimmed flight that the page has."""
        if self._steerable:
            self._release()
            self._try(RESET, lambda: self._pilot.reset(self._condition(), self._height.value))

    def _on_stand(self) -> None:
        if self._steerable:
            self._release()
            self._say(STAND, self._pilot.stand())

    def press(self, key: str) -> None:
        """Move the control of a key a step, the way that the key says whatever the sign of this aircraft's control."""
        if not self._steerable:
            return
        for slider, sense, bounds, ((less, _), (more, _)) in zip(
            self.sliders, self._senses, self._ranges, KEYS[: len(self.sliders)], strict=True
        ):
            if key in (less, more):
                change = KEY_STEP * sense * (1.0 if key == more else -1.0)
                slider.value = float(np.clip(slider.value + change, *bounds))
                self._on_slider()

    def doublet(self) -> None:
        """Move the longitudinal cyclic to and fro."""
        if (
            self._steerable
            and self._aircraft is not None
            and len(self._axes)
            and (snapshot := self._here()) is not None
        ):
            self._hint.visible = False
            held = np.radians([slider.value for slider in self.sliders])
            rest = held if self._holding else self._aircraft.unmix(snapshot.swashplate)[self._axes]
            push = DOUBLET_SIZE * self._senses[DOUBLET_OF] * np.eye(len(CONTROL_NAMES))[DOUBLET_OF]
            self._pilot.doublet(rest, push, DOUBLET_LENGTH)

    def _try(self, what: str, ask: Callable[[], Answer]) -> None:
        """Ask for what may be refused before it is sent."""
        try:
            answer = ask()
        except SbsError as error:
            answer = (False, str(error))
        self._say(what, answer)

    def _on_clock(self, button: str) -> None:
        act = {PLAY: self.go, PAUSE: self.go, STEP: self.step, RESET: self.restart}.get(button)
        if act is not None:  # what is no page of ours may send anything
            act()

    def _on_disturb(self, button: str) -> None:
        if button == DOUBLET:
            self.doublet()
        elif button in (TURBULENCE, CALM) and self._steerable:
            self._hint.visible = False
            self._air.set_turbulence(LIGHT_TURBULENCE if button == TURBULENCE else 0.0)
            self._on_wind()

    def _on_record(self) -> None:
        if self._steerable:
            self._say("Recording", self._pilot.record(not self._recording))

    def _condition(self) -> TrimCondition:
        sideslip, turn = math.radians(self._sideslip.value), math.radians(self._turn.value)
        return TrimCondition(self._airspeed.value, self._climb.value, sideslip, turn)

    def _show_pace(self, pace: float) -> None:
        """Choose the real-time factor that is in force; one that the page does not offer joins the others."""
        name = REAL_TIME_FACTORS[-1] if pace == 0.0 else f"{pace:g}"
        self._pace.options = REAL_TIME_FACTORS if name in REAL_TIME_FACTORS else (name, *REAL_TIME_FACTORS)
        self._pace.value = name

    def _on_pace(self) -> None:
        if self._pace.value in self._pace.options and self._steerable:
            factor = 0.0 if self._pace.value == REAL_TIME_FACTORS[-1] else float(self._pace.value)
            self._say("Real-time factor", self._pilot.set_pace(factor))

    def _on_slider(self) -> None:
        if not self._steerable:
            return
        self._hint.visible = False
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
        if self._steerable:
            self._try("Wind", lambda: self._pilot.set_wind(self._air.fields()))

    # ------------------------------------------------------------------------------------------------------ update

    def show_wind(self, velocity: Array, turbulence: float, words: Mapping[str, str]) -> None:
        """The wind that was set, see `AirPanel.show`."""
        self._air.show(velocity, turbulence, words)
        if self._turbulent != (turbulence > 0.0):
            self._turbulent = turbulence > 0.0
            self._disturb.options = (DOUBLET, CALM if self._turbulent else TURBULENCE)

    def _show_clock(self, playing: bool) -> None:
        self._paused = not playing
        self._clock.options = (PAUSE if playing else PLAY, STEP, RESET)

    def update(self, swashplate: Array, playing: bool, recording: bool) -> None:
        """Follow the flight: the swashplate angles that are in force [rad], unless this page commands the controls."""
        if self._recording != recording:
            self._recording = recording
            self._record.label = END_RECORD if recording else RECORD
        if self._paused != playing:
            self._awaited = False
        elif time.monotonic() - self._answered > (OLDEST_STATUS if self._awaited else OLD_STATUS):
            self._show_clock(playing)
        if self._holding or self._aircraft is None:
            return
        controls = self._aircraft.unmix(swashplate)[self._axes]
        for slider, value in zip(self.sliders, np.degrees(controls), strict=True):
            rounded = round(float(value), 3)
            if not abs(slider.value - rounded) <= 0.5 * SLIDER_STEP:  # true for a NaN as well
                slider.value = rounded
