"""Node `cockpit`: a page in the browser that shows a flight and flies it.

Subscribes `state`, `rotors`, `inflow`, `events`, `status`, `linear_model`; publishes `controls`; calls `pause`, `step`,
`reset`, `set_wind`, `trim`, `linearize`, and sets the simulator's `real_time_factor`.
"""

import os
import sys
import threading
import time
import traceback
from pathlib import Path

import numpy as np
import rich
from numpy.typing import NDArray
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.serialization import deserialize_message
from viser import ViserServer

from sbs_msgs.msg import BodyState, FlightEvent, InflowArray, LinearModel, RotorStateArray, SimulationStatus
from sbs_sim.aircraft import Aircraft
from sbs_sim.cockpit.gate import guarded
from sbs_sim.cockpit.poles import Pole
from sbs_sim.cockpit.readouts import Status
from sbs_sim.cockpit.view import FRAME_PERIOD, Live, View
from sbs_sim.errors import SbsError
from sbs_sim.model.state import SWASHPLATE_NAMES
from sbs_sim.nodes.conversions import snapshot_of
from sbs_sim.nodes.host import EVENT_QOS, LATCHED_QOS, Component
from sbs_sim.nodes.remote_pilot import RemotePilot

Array = NDArray[np.float64]

# Only the newest matters, and a page that falls behind must not hold up the flight.
NEWEST = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
MESSAGES = {"state": BodyState, "rotors": RotorStateArray, "inflow": InflowArray, "status": SimulationStatus}
LONGEST_LEAD = 0.1  # s of simulation time that rotors are turned on without a message
SILENCE = 3.0  # s without a message of a flight that plays: it is gone
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
        Pause the flight before the page is served: nobody holds its controls yet.
    """

    def __init__(self, host: str, port: int, end: threading.Event, pause: bool) -> None:
        super().__init__("cockpit")
        self._place, self._end, self._pause = (host, port), end, pause
        self._newest: dict[str, bytes] = {}
        self._arrived = 0.0
        self._swashplate: Array | None = None
        self._wind = np.zeros(3)
        self._model: LinearModel | None = None
        self._pilot = RemotePilot(self)
        self._aircraft: Aircraft | None = None
        self._period, self._last = 0.0, 0.0
        self.failed = False
        for name, kind in MESSAGES.items():
            self.create_subscription(kind, name, lambda data, name=name: self._keep(name, data), NEWEST, raw=True)
        self.create_subscription(FlightEvent, "events", self._on_event, EVENT_QOS)
        self.create_subscription(LinearModel, "linear_model", self._on_model, LATCHED_QOS)
        thread = threading.Thread(target=self._show, name="drawing", daemon=True)
        self.workers.append(thread)
        thread.start()

    # ------------------------------------------------------------------------------------------------ what comes in

    def _keep(self, name: str, data: bytes) -> None:
        """Keep a message as it came: only those that are drawn are taken apart."""
        self._newest[name] = data
        if name == "state":
            self._arrived = time.monotonic()

    def _on_event(self, event: FlightEvent) -> None:
        if len(event.swashplate):
            self._swashplate = np.array(event.swashplate).reshape(-1, len(SWASHPLATE_NAMES))
        if event.kind in (FlightEvent.START, FlightEvent.WIND):
            velocity = event.wind.velocity
            self._wind = np.array([velocity.x, velocity.y, velocity.z])

    def _on_model(self, model: LinearModel) -> None:
        self._model = model

    def _live(self) -> Live | None:
        """The flight of the newest messages; None before there is one."""
        newest = {name: deserialize_message(data, MESSAGES[name]) for name, data in dict(self._newest).items()}
        if len(newest) < len(MESSAGES) or self._swashplate is None or self._aircraft is None:
            return None
        told = newest["status"]
        snapshot = snapshot_of(
            self._aircraft, newest["state"], newest["rotors"], newest["inflow"], self._swashplate, self._wind
        )
        playing, age = told.state == SimulationStatus.PLAYING, time.monotonic() - self._arrived
        if playing and age > SILENCE:
            told.fault = told.fault or f"no message of the simulator for {age:.0f} s"
        return Live(snapshot, min(age * told.real_time_factor, LONGEST_LEAD) if playing else 0.0, _status(told))

    # --------------------------------------------------------------------------------------------------- the page

    def _show(self) -> None:
        """Serve the page until the end."""
        os.nice(NICE)  # of this thread and of those that it starts
        try:
            aircraft = self._await_aircraft()
            if aircraft is not None:
                self._draw_all(aircraft)
        except SbsError as error:
            print(" ".join(str(error).split()), file=sys.stderr)
            self.failed = True
        except Exception:
            self.get_logger().error(f"internal error: {traceback.format_exc()}")
            self.failed = True
        finally:
            self._end.set()

    def _await_aircraft(self) -> Aircraft | None:
        """The aircraft that is flown, once the simulator says it."""
        while not self._end.wait(0.05):
            if self._pause:
                self._pause = not self._pilot.pause(True)[0]
            elif (name := self._pilot.aircraft()) is not None:
                return Aircraft.load(name)
        return None

    def _draw_all(self, aircraft: Aircraft) -> None:
        self._aircraft = aircraft
        host, port = self._place
        server = serve(host, port)
        view = View(server, aircraft, self._pilot, self._live, bags())
        print(f"cockpit: http://{host}:{port}", flush=True)
        before = due = time.monotonic()
        while not self._end.is_set():
            model, self._model = self._model, None
            if model is not None:
                view.show_model(*_poles(model))
            now = time.monotonic()
            view.draw(now - before)
            before = now
            due = max(due + FRAME_PERIOD, time.monotonic())
            self._end.wait(due - time.monotonic())
        server.stop()


def _status(told: SimulationStatus) -> Status:
    lost = f"{told.log_dropped} messages not recorded " if told.log_dropped else ""
    return Status(
        told.state == SimulationStatus.PLAYING,
        told.real_time_factor,
        told.missed_deadlines,
        told.fault,
        told.log,
        f"{lost}{told.log_fault}".strip(),
        tuple(told.warnings),
    )


def _poles(model: LinearModel) -> tuple[list[Pole], str]:
    """Poles of a linear model, and what it is about."""
    condition = model.trim.condition
    title = f"Linear model at {condition.airspeed:g} m/s, {model.method}"
    return [Pole(mode.name, complex(mode.real, mode.imag)) for mode in model.modes], title


def serve(host: str, port: int) -> ViserServer:
    """Server of the page, which says nothing of itself, is not to be shared through another machine, and is guarded."""
    rich.get_console().quiet = True  # viser prints through it
    with guarded(host):
        server = ViserServer(host, port, verbose=False)
    server.request_share_url = lambda verbose=True: None  # a page could ask for it
    if server.get_port() != port:  # viser goes on to the next port that is free
        server.stop()
        raise SbsError(f"cannot serve on {host}:{port}: it is in use")
    return server


def bags() -> Path:
    """Folder of the logs."""
    return Path(os.environ.get("SBS_SIM_BAGS") or "bags")
