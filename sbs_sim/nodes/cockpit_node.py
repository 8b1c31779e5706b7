"""Node `cockpit`: a page in the browser that shows and controls a flight.

Subscribes `state`, `rotors`, `inflow`, `events`, `status`, `linear_model`; publishes `controls`; calls `pause`, `step`,
`reset`, `set_wind`, `trim`, `linearize`, and sets the simulator's `real_time_factor`.
"""

import contextlib
import logging
import math
import os
import sys
import threading
import time
import traceback
from pathlib import Path
from typing import Any

import numpy as np
import rich
from numpy.typing import NDArray
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.serialization import deserialize_message
from viser import ViserServer

from sbs_msgs.msg import BodyState, FlightEvent, InflowArray, LinearModel, RotorStateArray, SimulationStatus
from sbs_sim.aircraft import Aircraft
from sbs_sim.analysis.control_effects import ControlEffect
from sbs_sim.analysis.linearize import trim_effects
from sbs_sim.analysis.trim import trim
from sbs_sim.cockpit.access import access_check
from sbs_sim.cockpit.air_panel import SHOWN
from sbs_sim.cockpit.poles import Pole
from sbs_sim.cockpit.readouts import Status
from sbs_sim.cockpit.trim_report import condition_words
from sbs_sim.cockpit.view import FRAME_PERIOD, LiveFlight, LiveState, View
from sbs_sim.errors import SbsError, SimulationError
from sbs_sim.flight.stitched_simulation import FULL
from sbs_sim.model.state import SWASHPLATE_NAMES
from sbs_sim.nodes.component import Component
from sbs_sim.nodes.conversions import snapshot_of, to_seconds
from sbs_sim.nodes.parameters import ground_altitude
from sbs_sim.nodes.qos import EVENT_QOS, LATCHED_QOS
from sbs_sim.nodes.rejections import WARNING_PERIOD
from sbs_sim.nodes.remote_pilot import RemotePilot
from sbs_sim.output.units import counted

Array = NDArray[np.float64]

# Only the newest matters, and a page that falls behind must not delay the flight.
NEWEST = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
MESSAGES = {"state": BodyState, "rotors": RotorStateArray, "inflow": InflowArray, "status": SimulationStatus}
MAX_EXTRAPOLATION = 0.1  # s of simulation time that rotors are turned on without a message
MESSAGE_TIMEOUT = 3.0  # s without a message after which the flight counts as lost
MAX_FRAME_INTERVAL = 0.2  # s between two pictures
POLL_PERIOD = 0.1  # s between looks for a simulator
NICE = 5  # the flight comes before its picture


class Cockpit(Component):
    """See the module.

    Parameters
    ----------
    host : str
    port : int
        Where the page is served.
    end : threading.Event
        Set when there is nothing to show any more.
    pause : bool
        Wait for a flight and pause it before the page is served: no pilot has its controls yet. Else the page is served
        at once, and flights come and go.
    folder : Path
        Where the logs are.
    """

    def __init__(self, host: str, port: int, end: threading.Event, pause: bool, folder: Path) -> None:
        super().__init__("cockpit")
        self._address, self._end, self._pause, self._folder = (host, port), end, pause, folder
        self._newest: dict[str, bytes] = {}
        self._arrived = 0.0
        self._swashplate: Array | None = None
        self._wind = np.zeros(3)
        self._model: LinearModel | None = None
        self._pilot = RemotePilot(self)
        self._aircraft: Aircraft | None = None
        self._found: LiveFlight | None = None  # flight of another simulator
        self._told_wind: tuple[Array, float, dict[str, str]] | None = None
        self.failed = False
        for name, kind in MESSAGES.items():
            self.create_subscription(kind, name, lambda data, name=name: self._keep(name, data), NEWEST, raw=True)
        self.create_subscription(FlightEvent, "events", self._on_event, EVENT_QOS)
        self.create_subscription(LinearModel, "linear_model", self._on_model, LATCHED_QOS)
        for thread in os.listdir("/proc/self/task"):  # the kernel knows priorities of threads alone; others inherit
            os.setpriority(os.PRIO_PROCESS, int(thread), NICE)
        for name, work in (("drawing", self._show), ("monitor", self._monitor)):
            self.workers.append(threading.Thread(target=work, name=name, daemon=True))
        for worker in self.workers:
            worker.start()

    # ------------------------------------------------------------------------------------------------ what comes in

    def _keep(self, name: str, data: bytes) -> None:
        """Keep a message as it came: only those that are drawn are taken apart."""
        self._newest[name] = data
        self._arrived = time.monotonic()  # status comes while the flight is paused, too
        if name == "state" and self._pilot.follows_time:
            with contextlib.suppress(SbsError):  # reported where it is drawn
                self._pilot.tick(to_seconds(_message(data, BodyState).header.stamp))

    def _on_event(self, event: FlightEvent) -> None:
        angles, velocity = np.array(event.swashplate), event.wind.velocity
        if len(angles) and not len(angles) % len(SWASHPLATE_NAMES) and np.isfinite(angles).all():
            self._swashplate = angles.reshape(-1, len(SWASHPLATE_NAMES))
        wind = np.array([velocity.x, velocity.y, velocity.z])
        if event.kind in (FlightEvent.START, FlightEvent.WIND) and np.isfinite(wind).all():
            self._wind = wind
            part = event.wind.turbulence_intensity
            turbulence = max(part.x, part.y, part.z)
            words = {name: getattr(event.wind, name) for name in SHOWN}
            self._told_wind = (wind, turbulence if math.isfinite(turbulence) else 0.0, words)

    def _on_model(self, model: LinearModel) -> None:
        self._model = model

    def _live(self) -> LiveState | None:
        """The flight of the newest messages; None before there is one, or while they cannot be drawn."""
        aircraft, swashplate = self._aircraft, self._swashplate
        try:
            newest = {name: _message(data, MESSAGES[name]) for name, data in dict(self._newest).items()}
            if len(newest) < len(MESSAGES) or swashplate is None or aircraft is None:
                return None
            status = newest["status"]
            # those of the next simulator are refused here, until its aircraft is known
            snapshot = snapshot_of(
                aircraft, newest["state"], newest["rotors"], newest["inflow"], swashplate, self._wind
            )
            _check_status(status)
        except SbsError as error:
            self.get_logger().warning(f"not drawn: {error}", throttle_duration_sec=WARNING_PERIOD)
            return None
        if len(swashplate) != len(aircraft.rows):
            return None
        playing, age = status.state == SimulationStatus.PLAYING, time.monotonic() - self._arrived
        if gone := age > MESSAGE_TIMEOUT:
            status.fault = status.fault or f"no message of the simulator for {age:.0f} s"
        lead = min(age * status.real_time_factor, MAX_EXTRAPOLATION) if playing else 0.0
        return LiveState(snapshot, lead, _status(status), gone)

    # --------------------------------------------------------------------------------------------------- the page

    def _show(self) -> None:
        """Serve the page until the end."""
        try:
            if not self._pause or self._await_pause():
                self._draw_all()
        except SbsError as error:
            print(" ".join(str(error).split()), file=sys.stderr)
            self.failed = True
        except Exception:
            self.get_logger().error(f"internal error: {traceback.format_exc()}")
            self.failed = True
        finally:
            self._end.set()

    def _await_pause(self) -> bool:
        """Wait until the flight is paused and its aircraft is known; false at the end."""
        while not self._end.wait(0.05):
            if self._pause:
                self._pause = not self._pilot.pause(True)[0]
            elif self._found is not None:
                return True
        return False

    def _monitor(self) -> None:
        """Find out what is flown whenever a simulator is discovered."""
        known = False
        while not self._end.wait(POLL_PERIOD):
            if time.monotonic() - self._arrived > MESSAGE_TIMEOUT:
                known = False
            elif not known and (settings := self._pilot.settings()) is not None:
                known = True
                try:
                    aircraft = Aircraft.load(settings["aircraft"])
                    ground = ground_altitude(aircraft, settings["ground_altitude"])
                    self._found = LiveFlight(aircraft, self._effects(aircraft), ground, settings["real_time_factor"])
                except SbsError as error:
                    self.get_logger().error(f"the simulator's aircraft cannot be shown: {error}")

    def _effects(self, aircraft: Aircraft) -> tuple[ControlEffect, ...]:
        """What the controls of an aircraft do in hover; nothing for one that has no hover."""
        try:
            return trim_effects(aircraft, trim(aircraft))
        except SbsError as error:
            self.get_logger().warning(f"the effects of the keys on {aircraft.name} are unknown: {error}")
            return ()

    def _draw_all(self) -> None:
        host, port = self._address
        server = serve(host, port)
        view = View(server, self._pilot, self._live, self._folder)
        print(f"cockpit: http://{host}:{port}", flush=True)
        before = due = time.monotonic()
        while not self._end.is_set():
            now = time.monotonic()
            try:
                self._draw(view, now - before)
            except Exception:  # the end of the page would be that of the flight
                text = f"internal error: {traceback.format_exc()}"
                self.get_logger().error(text, throttle_duration_sec=WARNING_PERIOD)
            before, drawn = now, time.monotonic()
            # where drawing is slow, on a busy machine, it takes half of the time at most
            due = max(due + FRAME_PERIOD, drawn + min(drawn - now, MAX_FRAME_INTERVAL))
            self._end.wait(due - time.monotonic())
        server.stop()

    def _draw(self, view: View, elapsed: float) -> None:
        found, self._found = self._found, None
        if found is not None:
            self._aircraft = found.aircraft
            view.show_flight(found)
        wind = self._told_wind
        if wind is not None and self._aircraft is not None:
            self._told_wind = None
            view.show_wind(*wind)
        model, self._model = self._model, None
        if model is not None:
            poles, title = _poles(model)
            if all(np.isfinite(pole.value) for pole in poles):
                view.show_model(poles, title)
        view.draw(elapsed)


def _message(data: bytes, kind: Any) -> Any:
    """Message of its bytes, which come from any sender."""
    try:
        return deserialize_message(data, kind)
    except Exception as error:  # rclpy has errors of several kinds for that
        raise SimulationError(f"no {kind.__name__}: {' '.join(str(error).split())}") from None


def _check_status(status: SimulationStatus) -> None:
    if not math.isfinite(status.real_time_factor):
        raise SimulationError(f"real_time_factor = {status.real_time_factor}: allowed are finite numbers")


def _status(status: SimulationStatus) -> Status:
    lost = f"{counted(status.log_dropped, 'message')} not recorded " if status.log_dropped else ""
    return Status(
        status.state == SimulationStatus.PLAYING,
        status.real_time_factor,
        status.missed_deadlines,
        status.fault,
        status.log,
        f"{lost}{status.log_fault}".strip(),
        tuple(status.warnings),
        "" if status.model == FULL else status.model,
    )


def _poles(model: LinearModel) -> tuple[list[Pole], str]:
    """Poles of a linear model, and what it is about."""
    title = f"Linear model at {condition_words(model.trim.condition)}, {model.method}"
    return [Pole(mode.name, complex(mode.real, mode.imag)) for mode in model.modes], title


def serve(host: str, port: int) -> ViserServer:
    """Server of the page, which says nothing of itself, is not to be shared through another machine, and is guarded."""
    rich.get_console().quiet = True  # viser prints through it
    # what is no request at all, such as a look whether the port is open, is no error of ours with pages of traceback
    logging.getLogger("websockets.server").addFilter(lambda record: record.getMessage() != "opening handshake failed")
    with access_check(host):
        server = ViserServer(host, port, verbose=False)
    server.request_share_url = lambda verbose=True: None  # a page could ask for it
    if server.get_port() != port:  # viser goes on to the next port that is free
        server.stop()
        raise SbsError(f"cannot serve on {host}:{port}: it is in use")
    return server
