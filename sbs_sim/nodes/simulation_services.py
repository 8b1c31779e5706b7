"""Services and the action of the package simulation_interfaces, by which tools drive any simulator.

They say and do what `pause`, `step` and `reset` do. There is one entity, the aircraft. Simulation time never goes back,
so a reset of the time is refused. Result codes are those of the package; a refusal changes nothing.
"""

import os
import re
import signal
import traceback
from collections.abc import Callable
from typing import Any

from geometry_msgs.msg import Pose, Twist
from rclpy.action.server import ServerGoalHandle

from sbs_sim import checks
from sbs_sim.errors import SbsError, SimulationError
from sbs_sim.flight.simulation import Simulation
from sbs_sim.flight_loop import MAX_STEP_TICKS, FlightLoop
from sbs_sim.model.state import BODY_SIZE
from sbs_sim.nodes.component import Component
from sbs_sim.nodes.conversions import FRAME_ODOM, to_time
from sbs_sim.nodes.entity_state import motion_of, moved
from sbs_sim.nodes.number_fields import check_numbers, hint
from sbs_sim.nodes.qos import SERVICE_QOS
from sbs_sim.nodes.threaded_action import ThreadedActionServer

try:
    from simulation_interfaces import action, msg, srv
except ImportError as error:  # modules are also imported where nobody asks for the services
    action = msg = srv = None
    MISSING = str(error)
else:
    MISSING = ""

MAX_FILTER = 1000  # characters
MAX_ACTION_STEPS = 1_000_000  # of a goal, which others do not wait for and which can be cancelled
FRAMES = ("", "world", FRAME_ODOM)
FEATURES = (
    *("ENTITY_CATEGORIES", "ENTITY_INFO_GETTING", "ENTITY_STATE_GETTING", "ENTITY_STATE_SETTING"),
    *("SIMULATION_RESET", "SIMULATION_RESET_STATE"),
    *("SIMULATION_STATE_GETTING", "SIMULATION_STATE_SETTING", "SIMULATION_STATE_PAUSE"),
    *("STEP_SIMULATION_SINGLE", "STEP_SIMULATION_MULTIPLE", "STEP_SIMULATION_ACTION"),
)
STOPPED, PLAYING, PAUSED, QUITTING = STATES = range(4)  # SimulationState
WORLDS = (4, 5)  # STATE_NO_WORLD, STATE_LOADING_WORLD, which version 1 of the package does not have
ABOUT = "sbs_sim: one aircraft; simulation time goes on through resets; a step is a tick of 1 / publish_rate"


class RefusedError(SimulationError):
    """What is refused, with its result code."""

    def __init__(self, code: int, text: str) -> None:
        super().__init__(text)
        self.code = code


class SimulationServices:
    """Serves them, on a node.

    Parameters
    ----------
    node : Component
    simulation : Simulation
        At its start, to which a reset returns.
    loop : FlightLoop
        That flies it.

    Raises
    ------
    SimulationError
        The package is not installed.
    """

    def __init__(self, node: Component, simulation: Simulation, loop: FlightLoop) -> None:
        if MISSING:
            raise SimulationError(
                "parameter simulation_interfaces = true: allowed where the package of that name is installed: "
                + MISSING
            )
        self._node, self._simulation, self._loop = node, simulation, loop
        self._start = simulation.state.copy(), simulation.swashplate.copy()
        self._stopped_at: tuple[int, int] | None = None  # step and resets while it is stopped
        self._serve(srv.GetSimulatorFeatures, "get_simulator_features", self._features)
        self._serve(srv.GetSimulationState, "get_simulation_state", self._get_state)
        self._serve(srv.SetSimulationState, "set_simulation_state", self._set_state)
        self._serve(srv.StepSimulation, "step_simulation", self._step)
        self._serve(srv.ResetSimulation, "reset_simulation", self._reset)
        self._serve(srv.GetEntities, "get_entities", self._entities)
        self._serve(srv.GetEntitiesStates, "get_entities_states", self._entities_states)
        self._serve(srv.GetEntityInfo, "get_entity_info", self._entity_info)
        self._serve(srv.GetEntityState, "get_entity_state", self._entity_state)
        self._serve(srv.SetEntityState, "set_entity_state", self._set_entity_state)
        ThreadedActionServer(node, action.SimulateSteps, "simulate_steps", self._simulate_steps, _is_ok)

    def _serve(self, kind: Any, name: str, act: Callable[[Any, Any], None]) -> None:
        def answer(request: Any, response: Any) -> Any:
            code, text = self._outcome(act, request, response)
            if hasattr(response, "result"):
                response.result.result, response.result.error_message = code, text
            return response

        self._node.create_service(kind, name, answer, qos_profile=SERVICE_QOS)

    def _outcome(self, act: Callable[[Any, Any], None], request: Any, response: Any) -> tuple[int, str]:
        """Carry out a request; its result code and what is wrong."""
        try:
            check_numbers(request)
            act(request, response)
        except SbsError as error:
            return getattr(error, "code", msg.Result.RESULT_OPERATION_FAILED), f"{error}{hint(request)}"
        except Exception as error:  # an internal error must not end the flight
            self._node.get_logger().error(f"internal error: {traceback.format_exc()}")
            return msg.Result.RESULT_OPERATION_FAILED, f"internal error, see the log: {error!r}"
        return msg.Result.RESULT_OK, ""

    # --------------------------------------------------------------------------------------------- the simulation

    def _features(self, _: Any, response: Any) -> None:
        response.features.features = [getattr(msg.SimulatorFeatures, name) for name in FEATURES]
        response.features.custom_info = ABOUT

    @property
    def _state(self) -> int:
        if self._loop.playing:
            return PLAYING
        stopped = self._stopped_at == (self._simulation.step, self._loop.resets)
        return STOPPED if stopped else PAUSED

    def _get_state(self, _: Any, response: Any) -> None:
        response.state.state = self._state

    def _set_state(self, request: Any, _: Any) -> None:
        wanted = request.state.state
        if wanted in WORLDS:
            raise RefusedError(msg.Result.RESULT_FEATURE_UNSUPPORTED, f"state = {wanted}: the world cannot be unloaded")
        if wanted not in STATES:
            allowed = f"state = {wanted}: allowed are 0 (stopped), 1 (playing), 2 (paused) and 3 (quitting)"
            raise RefusedError(srv.SetSimulationState.Response.INCORRECT_TRANSITION, allowed)
        if wanted == self._state:
            raise RefusedError(
                srv.SetSimulationState.Response.ALREADY_IN_TARGET_STATE, f"state = {wanted}: it is so already"
            )
        if wanted == QUITTING:
            os.kill(os.getpid(), signal.SIGINT)  # as Ctrl-C: the answer goes out, and a log is closed in order
            return
        try:
            self._loop.pause(wanted != PLAYING)
        except SimulationError as error:
            raise RefusedError(srv.SetSimulationState.Response.STATE_TRANSITION_ERROR, str(error)) from None
        if wanted == STOPPED:
            self._loop.reset(*self._start)
            self._stopped_at = self._simulation.step, self._loop.resets
        else:
            self._stopped_at = None

    def _step(self, request: Any, _: Any) -> None:
        self._loop.step(checks.integer("steps", request.steps, 1, MAX_STEP_TICKS, SimulationError))

    def _simulate_steps(self, goal: ServerGoalHandle) -> Any:
        """Fly step by step as a goal asks for, and tell of each; in a thread of its own."""
        done = 0

        def fly(request: Any, _: Any) -> None:
            nonlocal done
            steps = checks.integer("steps", request.steps, 1, MAX_ACTION_STEPS, SimulationError)
            while done < steps and not goal.is_cancel_requested:
                self._loop.step(1)
                done += 1
                told = action.SimulateSteps.Feedback(completed_steps=done, remaining_steps=steps - done)
                goal.publish_feedback(told)
            if done < steps:
                raise SimulationError("cancelled")

        result = action.SimulateSteps.Result()
        code, text = self._outcome(fly, goal.request, result)
        told = f"{text}, after {done} of {goal.request.steps} steps" if done and text else text
        result.result.result, result.result.error_message = code, told
        return result

    def _reset(self, request: Any, _: Any) -> None:
        if request.scope != srv.ResetSimulation.Request.SCOPE_STATE:
            raise RefusedError(
                msg.Result.RESULT_FEATURE_UNSUPPORTED,
                f"scope = {request.scope}: allowed is 2 (SCOPE_STATE): time goes on, and nothing can be spawned",
            )
        self._loop.reset(*self._start)

    # ------------------------------------------------------------------------------------------------ the entity

    @property
    def _name(self) -> str:
        return str(self._loop.aircraft.name)

    def _check(self, entity: str) -> None:
        if entity != self._name:
            raise RefusedError(msg.Result.RESULT_NOT_FOUND, f"entity = {checks.shown(entity)}: allowed is {self._name}")

    def _entities(self, request: Any, response: Any) -> None:
        response.entities = [self._name] if is_meant(request.filters, self._name) else []

    def _entities_states(self, request: Any, response: Any) -> None:
        self._entities(request, response)
        response.states = [self._present() for _ in response.entities]

    def _entity_info(self, request: Any, response: Any) -> None:
        self._check(request.entity)
        response.info.category.category = msg.EntityCategory.CATEGORY_ROBOT
        response.info.description = f"rotorcraft with {len(self._loop.aircraft.rotors)} rotors"

    def _entity_state(self, request: Any, response: Any) -> None:
        self._check(request.entity)
        response.state = self._present()

    def _present(self) -> Any:
        """State of the aircraft now."""
        now = self._loop.call(self._simulation.snapshot)
        pose, twist, acceleration = motion_of(now)
        state = msg.EntityState(pose=pose, twist=twist, acceleration=acceleration)
        state.header.frame_id, state.header.stamp = FRAME_ODOM, to_time(now.time)
        return state

    def _set_entity_state(self, request: Any, _: Any) -> None:
        self._check(request.entity)
        frame = request.state.header.frame_id
        if frame not in FRAMES:
            raise SimulationError(f"state.header.frame_id = {checks.shown(frame)}: allowed are world and {FRAME_ODOM}")
        if getattr(request, "set_acceleration", False):  # before version 2.1, all is set, but for the acceleration
            raise RefusedError(
                msg.Result.RESULT_FEATURE_UNSUPPORTED,
                "set_acceleration = true: allowed is false, accelerations follow from forces",
            )
        pose = request.state.pose if getattr(request, "set_pose", True) else None
        twist = request.state.twist if getattr(request, "set_twist", True) else None
        if pose is not None or twist is not None:
            self._loop.change_state(lambda state: self._moved(state, pose, twist))

    def _moved(self, state: Any, pose: Pose | None, twist: Twist | None) -> Any:
        """State after a change of its body; rotors and inflow stay."""
        if pose is not None:
            try:
                state[:BODY_SIZE] = moved(state[:BODY_SIZE], pose)
                state = self._simulation.checked_state(state)
            except SimulationError as error:
                raise RefusedError(srv.SetEntityState.Response.INVALID_POSE, str(error)) from None
        if twist is not None:
            state[:BODY_SIZE] = moved(state[:BODY_SIZE], twist=twist)
        return state


def _is_ok(result: Any) -> bool:
    return bool(result.result.result == msg.Result.RESULT_OK)


def is_meant(filters: Any, name: str) -> bool:
    """Whether the aircraft is among what filters ask for.

    Raises
    ------
    SimulationError
        A filter that cannot be applied.
    """
    if filters.tags.tags:
        raise RefusedError(msg.Result.RESULT_FEATURE_UNSUPPORTED, "filters.tags: there are no tags")
    if filters.bounds.type != msg.Bounds.TYPE_EMPTY:
        raise RefusedError(msg.Result.RESULT_FEATURE_UNSUPPORTED, "filters.bounds: bounds are not looked at")
    categories = [one.category for one in filters.categories]
    if categories and msg.EntityCategory.CATEGORY_ROBOT not in categories:
        return False
    text = filters.filter
    if len(text) > MAX_FILTER:
        raise SimulationError(f"filters.filter has {len(text)} characters: allowed are {MAX_FILTER}")
    if "[:" in text or "[." in text or "[=" in text:  # which Python reads otherwise
        raise RefusedError(
            msg.Result.RESULT_FEATURE_UNSUPPORTED, f"filters.filter = {checks.shown(text)}: no named classes"
        )
    try:
        return re.search(text, name) is not None
    except (re.error, RecursionError, OverflowError, MemoryError) as error:
        raise SimulationError(f"filters.filter = {checks.shown(text)}: {error}") from None
