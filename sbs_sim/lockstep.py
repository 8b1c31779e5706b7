"""A flight whose clock is an autopilot's: one tick for each of its frames, and none without."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from sbs_sim.ardupilot.bridge import Bridge, Frame
from sbs_sim.ardupilot.protocol import state_line
from sbs_sim.ardupilot.servos import Servos
from sbs_sim.errors import ArduPilotError, SimulationError
from sbs_sim.flight.simulation import Simulation
from sbs_sim.flight_loop import IDLE_PERIOD, MAIL_POLL_PERIOD, FlightLoop
from sbs_sim.sensors.batteries import Batteries

HEARTBEAT = 0.5  # s of wall time between reports while no frame comes


class LockstepLoop(FlightLoop):
    """Flies a `Simulation` frame by frame of ArduPilot.

    A frame sets the swashplates; then a tick is flown and answered with what the sensors see. When ArduPilot starts
    anew the aircraft is put back to its start, and the fault that a crash was is cleared. While the flight is paused,
    or a fault lasts, frames are not answered, and ArduPilot's time stands still.

    Parameters
    ----------
    simulation : Simulation
        Its tick is a frame.
    bridge : Bridge
    servos : Servos
    every : int
        Ticks from one report to the next.
    real_time_factor : float
        That ArduPilot may reach at most; 0 is what it asks for.
    """

    def __init__(
        self, simulation: Simulation, bridge: Bridge, servos: Servos, every: int = 1, real_time_factor: float = 0.0
    ) -> None:
        super().__init__(simulation, real_time_factor, command_timeout=0.0)
        self._bridge, self._servos, self._every = bridge, servos, every
        self._start = simulation.state.copy(), simulation.swashplate.copy()
        self._start_step = simulation.step
        self._pulses: tuple[int, ...] = ()
        self._left = every
        self._last_tick = self._last_report = 0.0
        batteries = Batteries(simulation.aircraft) if simulation.stitched is None else None  # that has no engines
        self._seen = float(simulation.options["ground_altitude"]), batteries

    @property
    def report_steps(self) -> int:
        """See `FlightLoop`."""
        return self._every * self._simulation.steps_per_tick

    @property
    def pulses(self) -> tuple[int, ...]:
        """The pulses of the last frame [us]; empty before the first."""
        return self._pulses

    def command(self, swashplate: ArrayLike) -> None:
        """Refused: the autopilot commands.

        Raises
        ------
        SimulationError
            Always.
        """
        raise SimulationError("swashplate: ArduPilot flies, no other commands are taken")

    def _wait_until_due(self) -> bool:
        """Take the next frame; false if there is mail to look for, or the pace says to wait."""
        if self._pace and (left := self._last_tick + self._simulation.tick / self._pace - time.monotonic()) > 0.0:
            with self._wake:
                if not self._mailbox and not self._stopping:
                    self._wake.wait(min(left, MAIL_POLL_PERIOD))
            return False
        frame = self._bridge.wait(MAIL_POLL_PERIOD)
        if frame is None:
            if time.monotonic() > self._last_report + HEARTBEAT:
                self._marks.clear()
                self._last_report = time.monotonic()
                self._report(with_snapshot=False)
            return False
        return self._take_frame(frame)

    def _take_frame(self, frame: Frame) -> bool:
        """Command what a frame says; false if it cannot be flown."""
        try:
            if frame.starts:
                self._begin_again()
            if frame.servo.pulses != self._pulses:
                angles = self._servos.angles(frame.servo.pulses)
                self._pulses = frame.servo.pulses
                if not np.array_equal(angles, self._simulation.swashplate):
                    self._commands.append(angles)
        except (ArduPilotError, SimulationError) as error:
            self._bridge.say(str(error))
            return False
        return True

    def _begin_again(self) -> None:
        """Put the aircraft back to its start, unless it is there."""
        self._start_step = self._simulation.step
        self._pulses = ()
        if self._simulation.step or self._fault:
            self._reset(*self._start)
            self._playing = True

    def _rest(self) -> None:
        """While a fault lasts, hear an ArduPilot that starts anew."""
        if not self._fault:
            super()._rest()
            return
        frame = self._bridge.wait(IDLE_PERIOD)
        if frame is not None and frame.starts and self._take_frame(frame):
            self._tick()

    def _tick(self) -> None:
        """One tick and its answer; and a report, if one is due."""
        moved = self._fly()
        self._last_tick = time.monotonic()
        if moved and not self._fault:
            simulation = self._simulation
            now = (simulation.step - self._start_step) * simulation.step_size
            self._bridge.answer(state_line(simulation.motion(), now, *self._seen))
        self._left -= 1
        if self._left <= 0 or self._fault:
            self._left, self._last_report = self._every, self._last_tick
            self._report(moved, patient=self._as_fast_as_read)

    def _run(self) -> None:
        super()._run()
        self._bridge.close()

    def values(self) -> dict[str, Any]:
        """What has come from ArduPilot, for a report."""
        return dict(vars(self._bridge.counts))
