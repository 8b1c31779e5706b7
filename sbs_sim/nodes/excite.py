"""Node `excite`: chirps or multisines on the controls of a flight, from which `identify` finds frequency responses.

Answers every `state` with `excitation`, which the control mixer adds to the controls of whoever flies, and which is in
the log. Ends with the excitation, and when the flight is reset. Subscribes `events`, which have the present controls.
"""

import math
import sys
import threading
import time
from typing import Any

import numpy as np

from sbs_msgs.msg import BodyState, ControlValues, FlightEvent
from sbs_sim.aircraft import Aircraft
from sbs_sim.errors import IdentificationError, SbsError
from sbs_sim.flight.excitation import Chirp, Excitation, Part, multisines
from sbs_sim.model import state as S
from sbs_sim.nodes.component import Component
from sbs_sim.nodes.conversions import to_seconds
from sbs_sim.nodes.parameters import Parameter, declare
from sbs_sim.nodes.pilot_node import NEWEST_QOS, WAITING_PERIOD
from sbs_sim.nodes.process import run
from sbs_sim.nodes.qos import COMMAND_QOS, EVENT_QOS
from sbs_sim.nodes.signals import INTERRUPTED

CHIRP, MULTISINE = "chirp", "multisine"
PARAMETERS = {
    "aircraft": Parameter("sbs", "Aircraft: a name in config/aircraft, or the path of a file"),
    "controls": Parameter(
        ["longitudinal_cyclic"], "Controls, chirps on one after the other, multisines on all at once"
    ),
    "signal": Parameter(CHIRP, f"{CHIRP} or {MULTISINE}"),
    "amplitude_deg": Parameter(0.5, "Largest value [deg, or the unit of a control that is no angle]", 0.0, 1e6),
    "low": Parameter(1.0, "Lowest frequency [rad/s]", 1e-3, 1e3),
    "high": Parameter(20.0, "Highest frequency [rad/s]", 1e-3, 1e3),
    "duration": Parameter(60.0, "Of each chirp [s]", 0.1, 3600.0),
    "period": Parameter(30.0, "Of multisines [s]", 0.1, 3600.0),
    "periods": Parameter(3.0, "How many of them", 1.0, 1000.0),
    "pause": Parameter(3.0, "Before the first signal and between chirps [s]", 0.0, 3600.0),
}
SETTLING_TIME = 0.3  # s of wall time in which the events of the flight so far arrive


class Excite(Component):
    """See the module.

    Parameters
    ----------
    end : Event
        Set when the excitation has ended.

    Attributes
    ----------
    ended, failed : bool
        The excitation has ended: as it should, or early.
    """

    def __init__(self, end: threading.Event) -> None:
        super().__init__("excite")
        settings = declare(self, PARAMETERS)
        self._aircraft = Aircraft.load(settings["aircraft"])
        self._excitation = Excitation(self._aircraft, excitation_parts(self._aircraft, settings))
        self._end, self.ended, self.failed = end, False, False
        self._controls: np.ndarray | None = None
        self._first_event = 0.0
        self._begun: float | None = None
        self._last = -math.inf
        self._output = self.create_publisher(ControlValues, "excitation", COMMAND_QOS)
        self.create_subscription(FlightEvent, "events", self._on_event, EVENT_QOS)
        self.create_subscription(BodyState, "state", self._on_state, NEWEST_QOS)
        self.create_timer(WAITING_PERIOD, self._log_waiting)

    def _on_event(self, message: FlightEvent) -> None:
        if self._begun is not None:
            if message.kind == FlightEvent.RESET and to_seconds(message.header.stamp) >= self._begun:
                self._stop("the flight was reset", failed=True)
            return
        angles = np.array(message.swashplate)
        if len(angles) == S.ROW * len(self._aircraft.rows) and np.isfinite(angles).all():
            self._first_event = self._first_event or time.monotonic()
            self._controls = self._aircraft.unmix(angles)

    def _on_state(self, message: BodyState) -> None:
        now = to_seconds(message.header.stamp)
        if self._end.is_set() or now == self._last:
            return
        if now < self._last:
            self._stop("another flight has begun", failed=True)
            return
        self._last = now
        if self._begun is None and not self._begin(now):
            return
        since = now - (self._begun or 0.0)
        self._publish(message, self._excitation.history(since)[0])
        if since > self._excitation.end:
            self._stop(f"excitation has ended after {since:.4g} s")

    def _begin(self, now: float) -> bool:
        """Begin at a time [s], once the present controls are known and allow it."""
        if self._controls is None or time.monotonic() - self._first_event < SETTLING_TIME:
            return False
        try:
            self._excitation.check(self._controls)
        except SbsError as error:
            self._stop(str(error), failed=True)
            return False
        self._begun = now
        names = ", ".join(self._excitation.control_names)
        self.get_logger().info(f"excitation of {names} for {self._excitation.end:.4g} s of simulation time")
        return True

    def _publish(self, state: BodyState, values: np.ndarray) -> None:
        names = self._excitation.control_names
        chosen = [float(values[self._aircraft.control_names.index(name)]) for name in names]
        message = ControlValues(names=list(names), values=chosen)
        message.header.stamp = state.header.stamp
        self._output.publish(message)

    def _stop(self, why: str, failed: bool = False) -> None:
        self.ended, self.failed = not failed, failed
        log = self.get_logger().error if failed else self.get_logger().info
        log(why)
        self._end.set()

    def finish(self) -> None:
        """Add nothing any more, also after an interruption."""
        if self._begun is not None:
            names = list(self._excitation.control_names)
            self._output.publish(ControlValues(names=names, values=[0.0] * len(names)))

    def _log_waiting(self) -> None:
        if self._begun is None and not self._end.is_set():
            self.get_logger().info(f"waiting for states and controls of a flight of {self._aircraft.name}")


def excitation_parts(aircraft: Aircraft, settings: dict[str, Any]) -> list[Part]:
    """Chirps or multisines of the parameters.

    Raises
    ------
    IdentificationError
        A value out of range, or an unknown control or signal.
    """
    names, kind = list(settings["controls"]), settings["signal"]
    if kind not in (CHIRP, MULTISINE):
        raise IdentificationError(f"parameter signal = {kind!r}: allowed are {CHIRP}, {MULTISINE}")
    for name in names:
        if name not in aircraft.control_names or names.count(name) > 1:
            allowed = ", ".join(aircraft.control_names)
            raise IdentificationError(f"parameter controls = {names}: allowed are {allowed}, each once")
    size = settings["amplitude_deg"]
    is_angle = {control.name: control.is_angle for control in aircraft.controls}
    amplitudes = {name: math.radians(size) if is_angle[name] else size for name in names}
    low, high, pause = settings["low"], settings["high"], settings["pause"]
    if kind == MULTISINE:
        periods = round(settings["periods"])
        return list(multisines(amplitudes, low, high, settings["period"], periods=periods, begin=pause))
    step = settings["duration"] + pause
    return [
        Chirp(name, amplitudes[name], low, high, settings["duration"], begin=pause + i * step)
        for i, name in enumerate(names)
    ]


def main(args: list[str] | None = None) -> None:
    """Excite to the end, or until interrupted."""
    end, nodes = threading.Event(), list[Excite]()

    def make() -> list[Component]:
        nodes.append(Excite(end))
        return list(nodes)

    code = run(make, args, end)
    if nodes and not nodes[0].ended:
        code = 1 if nodes[0].failed else INTERRUPTED
    sys.exit(code)
