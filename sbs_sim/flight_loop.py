"""The simulation against the clock: a thread that flies tick after tick and hands out what happened.

The thread spends its time in compiled code without the GIL or asleep. All that others want of the simulation (commands,
reset, wind, pause, step) is put in a mailbox and carried out between two ticks, so a tick is never disturbed.
"""

from __future__ import annotations  # `help` then shows types by their names

import collections
import contextlib
import functools
import math
import queue
import threading
import time
from collections.abc import Callable
from concurrent.futures import Future
from concurrent.futures import TimeoutError as NoAnswerYet  # not the built-in one before Python 3.11
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from sbs_sim import checks
from sbs_sim.aircraft import Aircraft
from sbs_sim.errors import SbsError, SimulationError
from sbs_sim.flight.records import Event, Snapshot
from sbs_sim.flight.simulation import Simulation
from sbs_sim.flight.stitched import StitchedModel
from sbs_sim.flight.stitched_simulation import FULL, STITCHED
from sbs_sim.model.wind import Wind

QUEUE_LENGTH = 100  # snapshots between the flight and their reader: one second at 100 Hz
FAST_LENGTH = 2  # the same if the flight waits for its reader: limits the delay of a controller
MAIL_POLL_PERIOD = 0.05  # s between checks of the mailbox while the flight waits for its reader
MAX_CATCH_UP_TICKS = 10  # a delay of up to this many ticks is caught up; a longer one shifts the schedule
READER_TIMEOUT = 2.0  # s in which a reader takes a report, if there is one
IDLE_PERIOD = 0.1  # s of wall time between reports while paused
RATE_WINDOW = 1.0  # s of wall time over which the real-time factor is measured
MAX_STEP_TICKS = 1_000  # some half a second of wall time for which other services wait


@dataclass(frozen=True)
class LoopReport:
    """State of the loop when it was handed out, with a snapshot if the aircraft has moved.

    Attributes
    ----------
    snapshot : Snapshot or None
    repeated : bool
        The snapshot has been handed out before; it is repeated for a log that starts.
    playing : bool
    step : int
        Integration steps since the start.
    time : float
        Simulation time [s].
    real_time_factor : float
        Simulation time over wall time, of the last second.
    missed_deadlines : int
        Ticks that were ready later than one tick after they were due, and those that real time has lost.
    dropped : int
        Reports that no reader took in time.
    fault : str
        Why the simulation cannot go on; empty if it can.
    command_timed_out : bool
        The last command is older than the time-out and is being held.
    events : tuple of Event
        What acted on the flight since the report before: none is ever lost with a dropped report.
    """

    snapshot: Snapshot | None
    playing: bool
    step: int
    time: float
    real_time_factor: float
    missed_deadlines: int
    dropped: int
    fault: str
    command_timed_out: bool
    events: tuple[Event, ...] = ()
    repeated: bool = False


class FlightLoop:
    """Flies a `Simulation` in a thread of its own.

    Parameters
    ----------
    simulation : Simulation
        Used by the loop alone once it has started.
    real_time_factor : float
        Simulation time over wall time, 0 to 1000; 0 is as fast as reports are taken.
    command_timeout : float
        Age of a command [s of simulation time] beyond which it is reported as timed out; 0 is never.

    Raises
    ------
    SimulationError
        A value out of range.
    """

    def __init__(self, simulation: Simulation, real_time_factor: float = 1.0, command_timeout: float = 0.5) -> None:
        self._simulation = simulation
        self._wake = threading.Condition()
        self.set_pace(real_time_factor)
        self.set_command_timeout(command_timeout)
        self.reports: queue.Queue[LoopReport | None] = queue.Queue(QUEUE_LENGTH)
        self._take: Callable[[LoopReport], bool] | None = None
        self._mailbox: collections.deque[tuple[Callable[[], Any], Future[Any]]] = collections.deque()
        self._thread = threading.Thread(target=self._run, name="flight", daemon=True)
        self._playing = True
        self._stopping = False
        self._fault = ""
        self.resets = 0  # readers compare it: earlier commands are void after a reset
        self._missed = self._dropped = 0
        self._events = [simulation.beginning()]  # not handed out yet
        # At most the newest command. A deque, for it is emptied and filled by two threads and loses nothing.
        self._commands: collections.deque[np.ndarray] = collections.deque(maxlen=1)
        self._command_time: float | None = None
        self._anchor = 0.0  # wall time from which `_ticks_due` counts the ticks that were due
        self._ticks_due = 0
        self._deadline = math.inf  # wall time by which the tick that is flown should be ready
        self._marks: collections.deque[tuple[float, float]] = collections.deque()

    # ------------------------------------------------------------------------------------------- from any thread

    def start(self) -> None:
        """Start to fly."""
        self._thread.start()

    def read_by(self, take: Callable[[LoopReport], bool]) -> None:
        """Let the reader take reports in the flight's own thread when the flight would wait for it anyway.

        That saves waking two threads at every tick. Before the start; the reader then calls `reports.task_done` after
        each report that he has read from the queue, for a report is taken only if there is none before it.

        Parameters
        ----------
        take : callable
            Takes a report; false if it would have to wait for anything, and then the report goes into the queue.
        """
        self._take = take

    def stop(self) -> None:
        """End the thread and wait for it; the last report is None."""
        with self._wake:
            self._stopping = True
            self._wake.notify()
        if self._thread.is_alive():
            self._thread.join()
        patience = READER_TIMEOUT  # none of the reports is lost on a reader that is only slow
        while True:
            try:
                self.reports.put(None, timeout=patience)
                return
            except queue.Full:  # there is no reader any more: the end matters more than the oldest report
                patience = 0.0
                with contextlib.suppress(queue.Empty):
                    self.reports.get_nowait()

    def set_pace(self, real_time_factor: float) -> None:
        """Set the wanted real-time factor, 0 to 1000."""
        pace = checks.number("real_time_factor", real_time_factor, 0.0, 1000.0, "", SimulationError)
        with self._wake:
            self._pace = pace
            self._replan = True
            self._wake.notify()

    def set_command_timeout(self, seconds: float) -> None:
        """Set the age at which a command counts as timed out [s]; 0 is never."""
        self._timeout = checks.number("command_timeout", seconds, 0.0, 1e6, "s", SimulationError)

    def command(self, swashplate: ArrayLike) -> None:
        """Set the swashplate angles of all rotors [rad], shape (n_rotors, 3), from the next tick on.

        Raises
        ------
        SimulationError
            See `Simulation.checked_swashplate`; what was commanded before stays in force.
        """
        self._commands.append(self._simulation.checked_swashplate(swashplate))

    def call(self, function: Callable[[], Any], timeout: float = 10.0) -> Any:
        """Carry out a function in the flight's thread between two ticks and return its result.

        Raises
        ------
        SimulationError
            The loop has ended, or there is no answer in time; a call that has not started by then is cancelled.
        Exception
            Whatever the function raises.
        """
        answer: Future[Any] = Future()
        with self._wake:
            if self._stopping:
                raise SimulationError("the flight has ended")
            self._mailbox.append((function, answer))
            self._wake.notify()
        try:
            return answer.result(timeout)
        except NoAnswerYet:
            if answer.cancel() or not answer.done():
                raise SimulationError(f"the flight did not answer within {timeout:g} s") from None
            return answer.result()

    def pause(self, pause: bool) -> None:
        """Pause or go on; refused while a fault lasts."""
        self.call(lambda: self._set_playing(not pause))

    def step(self, ticks: int) -> float:
        """Fly some ticks while paused and return the simulation time [s] after them."""
        ticks = checks.integer("ticks", ticks, 1, MAX_STEP_TICKS, SimulationError)
        left = ticks
        while left:
            left, time_after = self.call(functools.partial(self._some_ticks, left))
        return float(time_after)

    def reset(self, state: ArrayLike, swashplate: ArrayLike) -> None:
        """Put the aircraft into another state and clear a fault; time goes on."""
        self.call(lambda: self._reset(state, swashplate))

    def change_state(self, make: Callable[[np.ndarray], ArrayLike]) -> None:
        """Put the aircraft into the state that `make` gives for the present one, under the same swashplate angles."""
        self.call(lambda: self._reset(make(self._simulation.state.copy()), self._simulation.swashplate))

    def set_wind(self, make: Callable[[Snapshot], Wind]) -> None:
        """Set the wind that `make` gives for the present instant, from the next tick on."""
        self.call(lambda: self._set_wind(make))

    def fail_engine(self, drive: int, share: float) -> None:
        """Let an engine lose a share of its torque from the next tick on, see `Simulation.fail_engine`."""
        self.call(lambda: self._fail_engine(drive, share))

    def begin_log(self) -> None:
        """Hand out the present as a start, and as a snapshot: what a log that begins now has to begin with."""
        self.call(self._begin_log)

    def wind(self) -> Wind:
        """The wind in force."""
        return self._simulation.wind

    def swashplate(self) -> np.ndarray:
        """The swashplate angles in force [rad], shape (n_rotors, 3)."""
        return self._simulation.swashplate

    @property
    def aircraft(self) -> Aircraft:
        """The aircraft that flies."""
        return self._simulation.aircraft

    @property
    def time(self) -> float:
        """Simulation time [s]."""
        return self._simulation.time

    @property
    def playing(self) -> bool:
        """False while it is paused."""
        return self._playing

    @property
    def report_steps(self) -> int:
        """Integration steps from one report with a snapshot to the next."""
        return self._simulation.steps_per_tick

    @property
    def step_size(self) -> float:
        """Integration step [s]."""
        return self._simulation.step_size

    @property
    def method(self) -> str:
        """Method of integration."""
        return str(self._simulation.options["method"])

    @property
    def stitched(self) -> StitchedModel | None:
        """The stitched model that flies, or None."""
        return self._simulation.stitched

    @property
    def model(self) -> str:
        """Which model flies: "full" or "stitched"."""
        return STITCHED if self._simulation.stitched is not None else FULL

    @property
    def pace(self) -> float:
        """Wanted real-time factor; 0 is as fast as reports are taken."""
        return self._pace

    @property
    def command_timeout(self) -> float:
        """Age at which a command counts as timed out [s]; 0 is never."""
        return self._timeout

    # -------------------------------------------------------------------------------------- in the flight's thread

    def _run(self) -> None:
        self._report()
        while not self._stopping:
            self._empty_mailbox()
            if not self._playing:
                self._rest()
            elif self._wait_until_due():
                self._tick()
        for _, answer in self._mailbox:
            if answer.set_running_or_notify_cancel():
                answer.set_exception(SimulationError("the flight has ended"))

    def _empty_mailbox(self) -> None:
        while self._mailbox and not self._stopping:
            function, answer = self._mailbox.popleft()
            if not answer.set_running_or_notify_cancel():
                continue  # its caller has given up
            try:
                answer.set_result(function())
            except Exception as error:
                answer.set_exception(error)

    def _rest(self) -> None:
        """Wait for mail while paused, and show that the loop is alive."""
        with self._wake:
            if not self._mailbox and not self._stopping:
                self._wake.wait(IDLE_PERIOD)
        if not self._mailbox and not self._stopping:
            self._marks.clear()
            self._report(with_snapshot=False)

    def _wait_until_due(self) -> bool:
        """Sleep until the next tick is due; false if mail, another pace or the end came first."""
        with self._wake:
            pace, replan, self._replan = self._pace, self._replan, False
        if pace == 0.0:
            self._deadline = math.inf
            return self._wait_for_reader()
        now = time.monotonic()
        period = self._simulation.tick / pace
        late = now - self._anchor - self._ticks_due * period
        if replan or late > MAX_CATCH_UP_TICKS * period:
            # too late to catch up: all ticks of the delay have missed their deadline
            self._missed += 0 if replan else int(late / period)
            self._anchor, self._ticks_due = now, 0
        due = self._anchor + self._ticks_due * period
        while (left := due - time.monotonic()) > 0:
            with self._wake:
                if self._mailbox or self._stopping or self._replan:
                    return False
                self._wake.wait(min(left, RATE_WINDOW))
        self._deadline = due + period
        return True

    def _wait_for_reader(self) -> bool:
        """Wait until few reports are left to read; false if that takes long, for there may be mail."""
        if self._take is not None:
            return self._all_is_read()
        with self.reports.not_full:
            return self.reports.not_full.wait_for(lambda: len(self.reports.queue) < FAST_LENGTH, MAIL_POLL_PERIOD)

    def _all_is_read(self) -> bool:
        """Wait until all reports in the queue have been read; false if that takes long."""
        reports = self.reports
        if not reports.unfinished_tasks:
            return True
        with reports.all_tasks_done:
            return reports.all_tasks_done.wait_for(lambda: not reports.unfinished_tasks, MAIL_POLL_PERIOD)

    def _tick(self) -> None:
        """One tick, with its deadline looked after."""
        moved = self._fly()
        self._ticks_due += 1
        if time.monotonic() > self._deadline:
            self._missed += 1
        self._report(moved, patient=self._as_fast_as_read)

    def _fly(self) -> bool:
        """Take the newest command and fly one tick; false if a fault came before its first step. A fault pauses."""
        simulation, before = self._simulation, self._simulation.step
        with contextlib.suppress(IndexError):  # there is none
            simulation.swashplate = self._commands.pop()  # checked when it came
            self._command_time = simulation.time
            self._events.append(Event(simulation.step, "swashplate", swashplate=simulation.swashplate))
        try:
            simulation.advance()
        except SbsError as error:
            self._fault = str(error)
            self._playing = False
        return simulation.step > before

    def _some_ticks(self, most: int) -> tuple[int, float]:
        """Fly ticks one by one until others wait for an answer; how many are left, and the simulation time [s]."""
        if self._playing:
            raise SimulationError("the simulation is playing: step is allowed while it is paused")
        left = most
        while left and not self._stopping and (left == most or not self._mailbox):
            self._check_fault()
            self._report(self._fly(), patient=True)
            left -= 1
        self._check_fault()
        return left, self._simulation.time

    def _set_playing(self, playing: bool) -> None:
        if playing:
            self._check_fault()
            if not self._playing:
                self._replan = True
                self._marks.clear()
        self._playing = playing
        self._report(with_snapshot=False, patient=self._as_fast_as_read)

    def _check_fault(self) -> None:
        if self._fault:
            raise SimulationError(f"the simulation has stopped, reset it first: {self._fault}")

    def _set_wind(self, make: Callable[[Snapshot], Wind]) -> None:
        simulation = self._simulation
        simulation.set_wind(make(simulation.snapshot()))
        self._events.append(Event(simulation.step, "wind", wind=simulation.wind))

    def _fail_engine(self, drive: int, share: float) -> None:
        self._simulation.fail_engine(drive, share)
        self._events.append(Event(self._simulation.step, "engine_failure", drive=drive, failure=share))

    def _reset(self, state: ArrayLike, swashplate: ArrayLike) -> None:
        simulation = self._simulation
        simulation.reset(state, swashplate)
        reset = Event(simulation.step, "reset", swashplate=simulation.swashplate, state=simulation.state.copy())
        self._events.append(reset)
        self.resets += 1
        self._fault = ""
        self._commands.clear()
        self._command_time = None
        self._report(patient=self._as_fast_as_read)

    def _begin_log(self) -> None:
        self._events.append(self._simulation.beginning())
        self._report(repeated=True, patient=self._as_fast_as_read)

    @property
    def _as_fast_as_read(self) -> bool:
        return self._pace == 0.0

    def _report(self, with_snapshot: bool = True, patient: bool = False, repeated: bool = False) -> None:
        """Hand out the present state; a patient report waits for its reader, another is dropped if there is none."""
        simulation = self._simulation
        age = 0.0 if self._command_time is None else simulation.time - self._command_time
        report = LoopReport(
            snapshot=simulation.snapshot() if with_snapshot else None,
            playing=self._playing,
            step=simulation.step,
            time=simulation.time,
            real_time_factor=self._measure_pace(),
            missed_deadlines=self._missed,
            dropped=self._dropped,
            fault=self._fault,
            command_timed_out=self._timeout > 0.0 and age > self._timeout + 1e-9,
            events=tuple(self._events),
            repeated=repeated,
        )
        if patient and self._take is not None and self._all_is_read() and self._take(report):
            self._events.clear()
            return
        while True:
            try:
                self.reports.put(report, block=patient, timeout=0.1)
                self._events.clear()
                return
            except queue.Full:
                if not patient or self._stopping:
                    self._dropped += 1
                    return

    def _measure_pace(self) -> float:
        """Simulation time over wall time since the oldest mark of the last second."""
        if not self._playing:
            return 0.0
        now = time.monotonic()
        self._marks.append((now, self._simulation.time))
        while now - self._marks[0][0] > RATE_WINDOW:
            self._marks.popleft()
        wall, flown = self._marks[0]
        return (self._simulation.time - flown) / (now - wall) if now > wall else 0.0
