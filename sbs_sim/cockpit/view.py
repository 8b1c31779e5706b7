"""The page: a server, its scene and panels, and one `draw` that shows what there is, live or from a log."""

import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from viser import ViserServer

from sbs_sim.aircraft import Aircraft
from sbs_sim.analysis.control_effects import ControlEffect
from sbs_sim.cockpit.charts import ChartColumn, body_charts, rotor_charts
from sbs_sim.cockpit.fly_panel import GONE, LOG_SHOWN, FlyPanel, Pilot
from sbs_sim.cockpit.keys import Keyed, add_keys
from sbs_sim.cockpit.log_panel import LogPanel
from sbs_sim.cockpit.panel_tools import Answer
from sbs_sim.cockpit.poles import Pole, pole_page
from sbs_sim.cockpit.readouts import Status, readout, source_line
from sbs_sim.cockpit.recorded_snapshots import RecordedSnapshots, list_logs
from sbs_sim.cockpit.scene import COLOURS, MOMENT, PATH, THRUST, Scene, Shown
from sbs_sim.cockpit.viewpoint import ViewPanel, Viewpoint
from sbs_sim.errors import SbsError
from sbs_sim.flight.records import Snapshot

Array = NDArray[np.float64]

OVER_TIME = "over simulation time [s]"
FRAME_PERIOD = 1.0 / 30.0  # s
READOUT_EVERY, CHARTS_EVERY = 3, 6  # frames
PANEL_WIDTH = 308  # pixels


NO_FLIGHT = (
    '<div style="font:12px sans-serif;padding:10px">No simulator is running. Start <b>./run simulator</b>:'
    " its flight appears here. <b>Logs</b> can be viewed without it.</div>"
)
NO_MODEL = (
    '<div style="font:12px sans-serif;padding:10px">No linear model yet: <b>Linearize here</b> computes one.</div>'
)


@dataclass(frozen=True)
class LiveFlight:
    """What a simulator flies.

    Attributes
    ----------
    aircraft : Aircraft
    effects : sequence of ControlEffect
        Of its controls; none of them if they are not known.
    ground : float
        Height of the ground above the origin [m].
    pace : float
        Real-time factor that is asked for; 0 is as fast as possible.
    """

    aircraft: Aircraft
    effects: Sequence[ControlEffect]
    ground: float
    pace: float


@dataclass(frozen=True)
class LiveState:
    """A flight as it is right now.

    Attributes
    ----------
    snapshot : Snapshot
    lead : float
        Simulation time since the snapshot [s].
    status : Status
    gone : bool
        The simulator says nothing any more.
    """

    snapshot: Snapshot
    lead: float
    status: Status
    gone: bool = False


class View:
    """See the module.

    Parameters
    ----------
    server : ViserServer
    pilot : Pilot
    live : callable
        The live flight, None while there is none.
    folder : Path
        Where the logs are.
    """

    def __init__(self, server: ViserServer, pilot: Pilot, live: Callable[[], LiveState | None], folder: Path) -> None:
        self._server, self._pilot, self._live = server, pilot, live
        self._live_flight: LiveFlight | None = None  # live
        self._recording: RecordedSnapshots | None = None
        self._log_time = 0.0
        self._lock = threading.RLock()  # callbacks of the page come in threads of their own
        self._frames = 0
        self._shown = Shown()
        self._scene: Scene | None = None
        self._scenes = 0
        self._columns: list[ChartColumn] = []
        self._viewpoint = Viewpoint(server)
        server.gui.configure_theme(show_logo=False, show_share_button=False, brand_color=(0, 114, 178))
        self._add_main_panel(folder)
        self._add_charts()
        add_keys(server, self._front)

    def _add_main_panel(self, folder: Path) -> None:
        gui = self._server.gui
        gui.set_panel_label("sbs_sim")
        gui.main_panel.dock_right()
        gui.main_panel.set_width(PANEL_WIDTH)
        self._source = gui.add_html(source_line("", False))
        self._readout = gui.add_html("")
        tabs = gui.add_tab_group()
        self._fly: FlyPanel | None = None
        self._fly_tab = tabs.add_tab("Fly")
        with self._fly_tab:
            self._no_flight = gui.add_html(NO_FLIGHT)
        with tabs.add_tab("Logs"):
            self._logs = LogPanel(self._server, lambda: list_logs(folder), self.show)
        with tabs.add_tab("View"):
            ViewPanel(self._server, self._shown, self._viewpoint)
            self._legend = gui.add_html("")

    def _add_charts(self) -> None:
        panel = self._server.gui.add_panel()
        self._tabs = (panel.add_tab("Body"), panel.add_tab("Rotors"))
        with panel.add_tab("Modes"):
            self._modes = self._server.gui.add_html(NO_MODEL)
        panel.dock_left()
        panel.set_width(PANEL_WIDTH)

    def _make_columns(self, aircraft: Aircraft) -> list[ChartColumn]:
        names = ", ".join(f"{j} {rotor.name}" for j, rotor in enumerate(aircraft.rotors, 1))
        columns = []
        for tab, charts, heading in zip(
            self._tabs,
            (body_charts(aircraft), rotor_charts(aircraft)),
            (OVER_TIME, f"{OVER_TIME}; rotors: {names}"),
            strict=True,
        ):
            with tab:
                columns.append(ChartColumn(self._server, charts, heading))
        return columns

    # -------------------------------------------------------------------------------------------------- what to show

    def show_flight(self, flight: LiveFlight) -> None:
        """Offer a live flight, and show it if no log is being shown."""
        with self._lock:
            self._live_flight = flight
            if self._fly is None:
                self._no_flight.remove()
                with self._fly_tab:
                    self._fly = FlyPanel(self._server, self._pilot, self._here, self._back)
            self._fly.use(flight.aircraft, flight.effects, flight.pace)
            self._logs.offer_live(self._recording is None)
            if self._recording is None:
                self._use(flight.aircraft, flight.ground)

    def show(self, path: Path | None) -> Answer:
        """Show a log from its beginning, or the live flight; a log that cannot be shown changes nothing."""
        try:
            recording = None if path is None else RecordedSnapshots(path)
        except SbsError as error:
            return False, str(error)
        with self._lock:
            self._recording = recording
            if recording is None:
                self._logs.enable(None)
                if self._live_flight is not None:
                    self._use(self._live_flight.aircraft, self._live_flight.ground)
                return True, ""
            self._log_time = recording.beginning
            self._use(recording.aircraft, recording.ground)
            self._logs.enable(recording.times)
        note = "" if recording.complete else ", not complete"
        return True, f"{recording.aircraft.name}, {recording.end - recording.beginning:.1f} s{note}"

    def _back(self) -> None:
        """Show the live flight."""
        self._logs.offer_live(True)
        self.show(None)

    def show_wind(self, velocity: Array, turbulence: float, words: Mapping[str, str]) -> None:
        """Show the wind that was set, see `sbs_sim.cockpit.air_panel.AirPanel.show`."""
        if self._fly is not None:
            self._fly.show_wind(velocity, turbulence, words)

    def _front(self) -> Keyed | None:
        """What keys act on."""
        return self._fly if self._recording is None else self._logs

    def show_model(self, poles: list[Pole], title: str) -> None:
        """Show the poles of a linear model."""
        self._modes.content = pole_page(poles, title)

    def _here(self) -> Snapshot | None:
        live = self._live()
        return None if live is None else live.snapshot

    def _use(self, aircraft: Aircraft, ground: float | None) -> None:
        """Draw an aircraft, from now on and without what was before."""
        if self._scene is None or not _same(aircraft, self._scene.aircraft):
            if self._scene is not None:
                self._scene.remove()
            self._scenes += 1
            self._scene = Scene(self._server, aircraft, self._shown, f"/ned{self._scenes}")
            self._viewpoint.use(self._scene.scale)
            for column in self._columns:
                column.remove()
            self._columns = self._make_columns(aircraft)
        self._scene.set_ground(ground)
        self._legend.content = _legend(self._scene)
        self._forget()

    def _forget(self) -> None:
        if self._scene is not None:
            self._scene.clear_trail()
        for column in self._columns:
            column.history.clear()

    # -------------------------------------------------------------------------------------------------------- frames

    def draw(self, elapsed: float) -> None:
        """Draw the next frame.

        Parameters
        ----------
        elapsed : float
            Wall time since the last one [s].
        """
        with self._lock:
            live = self._live()
            shown = live if self._recording is None else self._replayed(self._recording, elapsed)
            self._frames += 1
            if self._frames % READOUT_EVERY == 0:
                if self._fly is not None:  # first: what is said to be live takes the keys
                    gone = live is None or live.gone
                    self._fly.steer(LOG_SHOWN if self._recording is not None else GONE if gone else "")
                log = "" if self._recording is None else self._recording.path.name
                self._source.content = source_line(log, live is not None and not live.gone)
            if shown is None or self._scene is None:
                return
            if not self._server.get_clients():  # no client: only the histories go on
                for column in self._columns:
                    column.history.add(shown.snapshot)
                return
            with self._server.atomic():
                self._draw(shown, self._scene)
            if live is not None and self._fly is not None and self._frames % READOUT_EVERY == 0:
                self._fly.update(live.snapshot.swashplate, live.status.playing, bool(live.status.log))

    def _draw(self, shown: LiveState, scene: Scene) -> None:
        snapshot = shown.snapshot
        scene.draw(snapshot, shown.lead)
        for column in self._columns:
            column.history.add(snapshot)
        if self._frames % READOUT_EVERY == 0:
            source = scene.aircraft.name if self._recording is None else self._recording.path.name
            self._readout.content = readout(scene.aircraft, snapshot, shown.status, source)
        if self._frames % CHARTS_EVERY == 0:
            for column in self._columns:
                column.update()

    def _replayed(self, recording: RecordedSnapshots, elapsed: float) -> LiveState:
        """Instant of a log; the slider and the clock move it."""
        rate = self._logs.speed
        if self._logs.moved:
            self._logs.moved = False
            self._log_time = min(max(float(self._logs.time_slider.value), recording.beginning), recording.end)
            self._forget()
        elif self._logs.playing.value:
            self._log_time = min(self._log_time + rate * elapsed, recording.end)
            if self._frames % READOUT_EVERY == 0:
                self._logs.time_slider.value = round(self._log_time, 2)
        playing = bool(self._logs.playing.value) and self._log_time < recording.end
        return LiveState(recording.at(self._log_time), 0.0, Status(playing, rate if playing else 0.0))


def _same(one: Aircraft, other: Aircraft) -> bool:
    """Alike, in their names too, which are no part of the hash."""
    names = [[craft.name, *(rotor.name for rotor in craft.rotors)] for craft in (one, other)]
    return one.parameter_hash == other.parameter_hash and names[0] == names[1]


def _legend(scene: Scene) -> str:
    """Scale of the inflow's colours and of the arrows, and of what the ground shows."""
    low, high = scene.inflow_range
    stops = ",".join(f"rgb({r:.0f},{g:.0f},{b:.0f})" for r, g, b in COLOURS)
    arrows = (
        (THRUST, "thrust of a rotor", f"1 m is {scene.newtons_per_metre:.3g} N"),
        (MOMENT, "moment on its hub", f"1 m is {scene.moment_per_metre:.3g} N m"),
        (PATH, "tip path", "flap magnified"),
    )
    lines = "".join(
        f'<div><span style="display:inline-block;width:14px;height:3px;vertical-align:middle;background:rgb{colour}">'
        f'</span>&ensp;{name}, <span style="color:#5c6670">{scale}</span></div>'
        for colour, name, scale in arrows
    )
    return (
        f'<div style="font:12px sans-serif;padding:8px 10px;line-height:1.5">{lines}'
        + "".join(f"<div>{text}</div>" for text in scene.lines)
        + '<div style="margin-top:6px">induced velocity down through the disc [m/s]</div>'
        f'<div style="height:10px;margin:3px 0;background:linear-gradient(to right,{stops})"></div>'
        f'<div style="display:flex;justify-content:space-between"><span>{low:g}</span>'
        f"<span>{(low + high) / 2:g}</span><span>{high:g}</span></div></div>"
    )
