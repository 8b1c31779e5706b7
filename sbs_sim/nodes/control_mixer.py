"""Node `control_mixer`: pilot controls to the swashplates of all rotors (paper section 2.1.1).

Subscribes `controls`, `control_values` and `excitation`, publishes `swashplate` and `diagnostics`. Ranges and rates are
those of the aircraft file.
"""

import math
import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from numpy.typing import NDArray
from rclpy.clock import Clock, ClockType
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rosgraph_msgs.msg import Clock as ClockMessage

from sbs_msgs.msg import Controls, ControlValues, FlightEvent, SwashplateArray
from sbs_sim import checks
from sbs_sim.aircraft import Aircraft
from sbs_sim.errors import SbsError, SimulationError
from sbs_sim.flight.mixer import Mixer
from sbs_sim.flight_loop import FlightLoop
from sbs_sim.model.state import SWASHPLATE_NAMES
from sbs_sim.nodes.command_monitor import CommandMonitor
from sbs_sim.nodes.component import Component
from sbs_sim.nodes.conversions import (
    FRAME_BODY,
    command_fields,
    controls_array,
    swashplate_messages,
    to_seconds,
    to_time,
)
from sbs_sim.nodes.diagnostics import DIAGNOSTICS_PERIOD, diagnostic_status
from sbs_sim.nodes.parameters import Parameter, declare
from sbs_sim.nodes.process import run
from sbs_sim.nodes.qos import COMMAND_QOS, EVENT_QOS, STATE_QOS
from sbs_sim.nodes.recorded_publisher import MessageLog, RecordedPublisher
from sbs_sim.nodes.rejections import WARNING_PERIOD

PARAMETERS = {
    "aircraft": Parameter("sbs", "Aircraft: a name in config/aircraft, or the path of a file"),
}
CLOCK_QOS = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)  # as rclpy listens to a clock
EXCITATION_TIMEOUT = 0.5  # s of simulation time after which an excitation that is not renewed ends
RAMP_PERIOD = 0.01  # s of wall time between outputs while a swashplate is still on its way


class ControlMixer(Component):
    """See the module.

    Parameters
    ----------
    loop : FlightLoop, optional
        The flight, if it is in the same process: the mixer then knows the time, the swashplate angles and
        resets. Else time comes from `clock` of its namespace, and the swashplate angles from the events of the
        flight; until one comes, they are taken to be at the first target.
    log : MessageLog, optional
        Where accepted controls and the diagnostics are recorded.
    """

    def __init__(self, loop: FlightLoop | None = None, log: MessageLog | None = None) -> None:
        super().__init__("control_mixer")
        self._loop = loop
        self._mixer = Mixer(Aircraft.load(declare(self, PARAMETERS)["aircraft"]) if loop is None else loop.aircraft)
        self._resets = 0
        self._moved_at = -1.0
        self._last_seen: dict[str, float] = {}
        self._output = self.create_publisher(SwashplateArray, "swashplate", COMMAND_QOS)
        self._health = RecordedPublisher(self, DiagnosticArray, "diagnostics", STATE_QOS, log)
        self._commands = CommandMonitor(self, Controls, "controls", COMMAND_QOS, log)
        self._by_name = CommandMonitor(self, ControlValues, "control_values", COMMAND_QOS, log)
        self._added_by = CommandMonitor(self, ControlValues, "excitation", COMMAND_QOS, log)
        self._values: NDArray[np.float64] | None = None  # of all controls, as they were commanded last
        self._added: NDArray[np.float64] | None = None  # to them, by an excitation
        self._added_at = 0.0  # s
        self.create_subscription(Controls, "controls", self._on_controls, COMMAND_QOS)
        self.create_subscription(ControlValues, "control_values", self._on_values, COMMAND_QOS)
        self.create_subscription(ControlValues, "excitation", self._on_excitation, COMMAND_QOS)
        if loop is None:
            # The simulator owns time: rates are those of simulated time, and a pause holds the swashplates. Not by
            # use_sim_time, which listens to the one /clock of all namespaces.
            self._clock_time = 0.0
            self._time = self.create_subscription(ClockMessage, "clock", self._on_clock, CLOCK_QOS)
            self.create_subscription(FlightEvent, "events", self._on_event, EVENT_QOS)
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self._ramp = self.create_timer(RAMP_PERIOD, self._continue, clock=steady, autostart=False)
        self.create_timer(DIAGNOSTICS_PERIOD, self._publish_health, clock=steady)

    def _now(self) -> float:
        """Simulation time [s]."""
        return self._clock_time if self._loop is None else self._loop.time

    def _on_clock(self, message: ClockMessage) -> None:
        self._clock_time = to_seconds(message.clock)

    def _follow_resets(self) -> bool:
        """Forget what was commanded before a reset; true if there was one."""
        if self._loop is None or self._resets == self._loop.resets:
            return False
        self._resets = self._loop.resets
        self._forget()
        return True

    def _forget(self) -> None:
        """What was commanded is void."""
        self._mixer.forget()
        self._values = self._added = None

    def _on_event(self, message: FlightEvent) -> None:
        """What was commanded before the aircraft was put somewhere is void."""
        if message.kind in (FlightEvent.START, FlightEvent.RESET):
            self._commands.restart()
            self._by_name.restart()
            self._added_by.restart()
            angles = np.array(message.swashplate).reshape(-1, len(SWASHPLATE_NAMES))
            self._forget()
            if len(angles) == len(self._mixer.aircraft.rows):  # else it is another aircraft's
                self._mixer.set_position(angles)

    def _on_controls(self, message: Controls) -> None:
        """The four axes; controls without an axis stay."""
        self._take(self._commands, message, lambda: self._mixer.aircraft.axis_controls, controls_array(message))

    def _on_values(self, message: ControlValues) -> None:
        """Controls by name; the others stay."""
        self._take(self._by_name, message, lambda: self._indices(message), np.array(message.values))

    def _indices(self, message: ControlValues) -> list[int]:
        """Indices of the named controls."""
        names = self._mixer.aircraft.control_names
        for name in message.names:
            if name not in names:
                raise SimulationError(f"names: {checks.shown(name)}: allowed are {', '.join(names)}")
        if len(message.names) != len(set(message.names)) or len(message.names) != len(message.values):
            counts = f"{len(message.names)} names, {len(message.values)} values"
            raise SimulationError(f"{counts}: allowed is one value for each name")
        return [names.index(name) for name in message.names]

    def _present(self) -> NDArray[np.float64]:
        """All controls as they were commanded, or as the swashplates show."""
        if self._values is not None:
            return self._values.copy()
        angles = self._loop.swashplate() if self._loop is not None else self._mixer.position
        return self._mixer.aircraft.held_controls.copy() if angles is None else self._mixer.aircraft.unmix(angles)

    def _take(
        self, monitor: CommandMonitor, message: Any, indices: Callable[[], Any], values: NDArray[np.float64]
    ) -> None:
        """Take over some of the controls."""
        self._follow_resets()
        try:
            monitor.check(message)
            wanted = self._present()
            wanted[indices()] = values
            self._aim(wanted, self._added_now())
        except SbsError as error:
            monitor.add(error)
            return
        self._values = wanted
        monitor.accept(message, self._now())
        self._move()

    def _on_excitation(self, message: ControlValues) -> None:
        """What is added to the controls, from whomever they come; nothing to those that are not named."""
        self._follow_resets()
        try:
            self._added_by.check(message)
            base, added = self._present(), np.zeros(len(self._mixer.aircraft.controls))
            added[self._indices(message)] = np.array(message.values)
            self._aim(base, added)
        except SbsError as error:
            self._added_by.add(error)
            return
        self._values, self._added, self._added_at = base, added, self._now()
        self._added_by.accept(message, self._now())
        self._move()

    def _added_now(self) -> NDArray[np.float64] | float:
        """What the excitation adds to the controls; nothing once it is too old."""
        if self._added is not None and self._now() - self._added_at > EXCITATION_TIMEOUT:
            self._added = None
        return 0.0 if self._added is None else self._added

    def _aim(self, controls: NDArray[np.float64], added: NDArray[np.float64] | float) -> None:
        """Set the target; the swashplates begin where they are."""
        self._mixer.set_target(controls + added)
        if self._loop is not None and self._mixer.rests:
            self._mixer.set_position(self._loop.swashplate())

    def _end_excitation(self) -> None:
        """Back to the controls alone where an excitation has stopped without its end."""
        if self._added is not None and self._values is not None and np.ndim(self._added_now()) == 0:
            self._aim(self._values, 0.0)
            self._move()

    def _continue(self) -> None:
        """Move by timer while there is a way to go; a pause or a reset ends it."""
        if self._follow_resets():
            self._ramp.cancel()
        elif self._now() != self._moved_at:
            self._move()

    def _move(self) -> None:
        """Go towards the target and publish."""
        now = self._moved_at = self._now()
        angles = self._mixer.move(now)
        aircraft = self._mixer.aircraft
        message = SwashplateArray(**command_fields(aircraft, angles))
        message.header.stamp = to_time(now)
        message.header.frame_id = FRAME_BODY
        message.rotors = swashplate_messages(angles[: len(aircraft.rotors)])
        self._output.publish(message)
        if self._mixer.arrived:
            self._ramp.cancel()
        elif self._ramp.is_canceled():
            self._ramp.reset()
        self._warn_once()

    def _warn_once(self) -> None:
        """One line when a limit is reached; again only after it has been left for a while."""
        now = time.monotonic()
        for text in self._mixer.saturated:
            if now - self._last_seen.get(text, -math.inf) > WARNING_PERIOD:
                self.get_logger().warning(f"clipped: {text}")
                self._publish_health()
            self._last_seen[text] = now

    def _publish_health(self) -> None:
        self._follow_resets()
        self._end_excitation()
        problems = [(DiagnosticStatus.WARN, f"clipped: {text}") for text in self._mixer.saturated]
        problems += self._commands.problems() + self._by_name.problems() + self._added_by.problems()
        if self._loop is None and not self.count_publishers(self._time.topic_name):
            problems.append((DiagnosticStatus.WARN, f"no simulator: no node publishes {self._time.topic_name}"))
        values = {"rate_limited": not self._mixer.arrived, **self._commands.values_with(self._by_name, self._added_by)}
        message = DiagnosticArray(status=[diagnostic_status("control_mixer", problems, values)])
        message.header.stamp = to_time(self._now())
        self._health.publish(message, self._now())


def main(args: list[str] | None = None) -> None:
    """Mix until interrupted."""
    sys.exit(run(lambda: [ControlMixer()], args))
