"""Node `analysis`: trims, linear models and sweeps as services and an action.

Serves `trim`, `linearize` and the action `sweep`; publishes the latest results of the services on `trim_point` and
`linear_model`, also for late subscribers. Requests are answered in turn, within milliseconds; a sweep has a thread of
its own.
"""

import contextlib
import sys
import threading
from collections.abc import Callable
from typing import Any

import scipy.optimize  # noqa: F401  # now: in mid flight the first linearization would hold the interpreter to load it
from rclpy.action.server import ServerGoalHandle

from sbs_msgs.action import Sweep
from sbs_msgs.msg import LinearModel, TrimPoint
from sbs_msgs.srv import Linearize, Trim
from sbs_sim.aircraft import Aircraft
from sbs_sim.analysis.linear_model import growing_rotor_modes_text
from sbs_sim.analysis.linearize import linearize, linearize_trim
from sbs_sim.analysis.sweep import SweepPoint, sweep_flights
from sbs_sim.analysis.trim import solve_trim
from sbs_sim.concurrency.parallel import Execution
from sbs_sim.errors import SbsError
from sbs_sim.flight.trim_point import Fidelity, TrimCondition
from sbs_sim.flight_loop import FlightLoop
from sbs_sim.nodes.analysis_conversions import model_message, sweep_messages, trim_message
from sbs_sim.nodes.component import Component
from sbs_sim.nodes.conversions import float64_array
from sbs_sim.nodes.parameters import Parameter, declare
from sbs_sim.nodes.process import run
from sbs_sim.nodes.qos import LATCHED_QOS, SERVICE_QOS
from sbs_sim.nodes.recorded_publisher import MessageLog, RecordedPublisher
from sbs_sim.nodes.threaded_action import ThreadedActionServer

PARAMETERS = {
    "aircraft": Parameter("sbs", "Aircraft: a name in config/aircraft, or the path of a file"),
}
MAX_POINTS = 1000  # of a sweep; its result is one message, some 50 kB for each of them
SWEEP_LOCK_TIMEOUT = 2.0  # s that a sweep waits for the end of the one before, which may just have been cancelled


class Analysis(Component):
    """See the module.

    Parameters
    ----------
    loop : FlightLoop, optional
        The flight, if it is in the same process: its aircraft is the one; else a parameter names it.
    log : MessageLog, optional
        Where results are recorded.
    """

    def __init__(self, loop: FlightLoop | None = None, log: MessageLog | None = None) -> None:
        super().__init__("analysis")
        self._loop = loop
        self._aircraft = Aircraft.load(declare(self, PARAMETERS)["aircraft"]) if loop is None else loop.aircraft
        self._sweep_workers = None if loop is None else 1  # the other cores fly
        self._ending = threading.Event()
        self._turn = threading.Lock()
        with contextlib.suppress(SbsError):  # load now what the first caller would have to wait for
            model_message(self._aircraft, linearize(self._aircraft))
        self._trim_point = RecordedPublisher(self, TrimPoint, "trim_point", LATCHED_QOS, log)
        self._linear_model = RecordedPublisher(self, LinearModel, "linear_model", LATCHED_QOS, log)
        self.create_service(Trim, "trim", self._on_trim, qos_profile=SERVICE_QOS)
        self.create_service(Linearize, "linearize", self._on_linearize, qos_profile=SERVICE_QOS)
        ThreadedActionServer(self, Sweep, "sweep", self._sweep)

    def stop(self) -> None:
        """End a sweep after the point that it is at."""
        self._ending.set()

    def _now(self) -> float:
        """Simulation time [s]; 0 where nothing flies."""
        return 0.0 if self._loop is None else self._loop.time

    def _on_trim(self, request: Trim.Request, response: Trim.Response) -> Trim.Response:
        def act() -> None:
            point = solve_trim(self._aircraft, *_flight(request), method=request.method)
            response.trim, response.warnings = trim_message(self._aircraft, point), point.warnings
            response.control_names, response.control_values = point.control_names, float64_array(point.controls)
            self._trim_point.publish(response.trim, self._now())

        return self.answer(response, act, "trimmed", request)

    def _on_linearize(self, request: Linearize.Request, response: Linearize.Response) -> Linearize.Response:
        def act() -> None:
            point = solve_trim(self._aircraft, *_flight(request))
            model = linearize_trim(self._aircraft, point, method=request.method)
            response.model, response.warnings = model_message(self._aircraft, model), model.warnings
            response.control_axes = model.control_axes
            self._linear_model.publish(response.model, self._now())
            if model.growing_rotor_modes:
                done.append(f"growing rotor modes: {growing_rotor_modes_text(model, self._aircraft)}")

        done = ["linearized"]
        response = self.answer(response, act, done[0], request)
        if response.success:
            response.message = "; ".join(done)
        return response

    def _sweep(self, goal: ServerGoalHandle) -> Sweep.Result:
        """Sweep as a goal asks for; in a thread of its own."""
        result = Sweep.Result()
        visited = 0

        def tell(point: SweepPoint, _: int, total: int) -> None:
            nonlocal visited
            visited += 1
            goal.publish_feedback(_feedback(point, visited, total))

        def act() -> None:
            if not self._turn.acquire(timeout=SWEEP_LOCK_TIMEOUT):
                raise SbsError("another sweep is under way: cancel it, or wait for its end")
            try:
                result.points = self._points(goal, tell)
            finally:
                self._turn.release()

        self.answer(result, act, "", goal.request)
        if result.success:
            total, found = len(result.points), sum(point.success for point in result.points)
            result.success = visited == total
            result.message = f"{found} of {total} points have a result"
            if visited < total:
                result.message = f"cancelled after {visited} of {total} points"
        return result

    def _points(self, goal: ServerGoalHandle, tell: Callable[[SweepPoint, int, int], None]) -> list[Any]:
        request = goal.request
        if len(request.values) > MAX_POINTS:
            raise SbsError(f"values: {len(request.values)} of them, allowed are 1 to {MAX_POINTS}")
        swept = sweep_flights(
            self._aircraft,
            request.parameter,
            request.values.tolist(),
            *_flight(request),
            Execution(
                self._sweep_workers,
                progress=tell,
                cancelled=lambda: goal.is_cancel_requested or self._ending.is_set(),
            ),
            linear=request.linear,
        )
        return sweep_messages(self._aircraft, swept)


def _flight(request: Any) -> tuple[TrimCondition, Fidelity]:
    """Flight condition and fidelity of a request."""
    condition = TrimCondition(request.airspeed, request.climb_rate, request.sideslip, request.turn_rate)
    return condition, Fidelity(request.lead_lag, request.cyclic_inflow, request.azimuth_count)


def _feedback(point: SweepPoint, done: int, total: int) -> Sweep.Feedback:
    return Sweep.Feedback(
        done=done,
        total=total,
        last_value=point.value,
        last_success=point.error is None,
        last_message=point.error or "",
        last_warnings=point.warnings,
    )


def main(args: list[str] | None = None) -> None:
    """Serve until interrupted."""
    sys.exit(run(lambda: [Analysis()], args))
