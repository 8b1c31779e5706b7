"""A pilot who asks a simulator over ROS: the calls behind the buttons of the cockpit."""

import dataclasses
import threading
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rcl_interfaces.srv import GetParameters, SetParameters
from rclpy.node import Node
from rclpy.parameter import Parameter, parameter_value_to_python
from std_srvs.srv import SetBool

from sbs_msgs.msg import Controls, TrimPoint
from sbs_msgs.srv import Linearize, Record, Reset, SetWind, Step, Trim
from sbs_sim.cockpit.trim_report import TrimResult
from sbs_sim.flight.trim_point import TrimCondition
from sbs_sim.model.state import CONTROL_NAMES
from sbs_sim.nodes.conversions import controls_of
from sbs_sim.nodes.qos import COMMAND_QOS, SERVICE_QOS

Array = NDArray[np.float64]
Answer = tuple[bool, str]

SERVICE_TIMEOUT = 10.0  # s for an answer
ANALYSIS_TIMEOUT = 60.0  # s for a trim or a linear model
COMMAND_PERIOD = 0.1  # s between commands that hold the controls
SETTINGS = {"aircraft": str, "ground_altitude": float, "real_time_factor": float}
SERVICES = {
    "pause": SetBool,
    "step": Step,
    "reset": Reset,
    "set_wind": SetWind,
    "record": Record,
    "trim": Trim,
    "linearize": Linearize,
    "simulator/set_parameters": SetParameters,
    "simulator/get_parameters": GetParameters,
}


@dataclasses.dataclass
class _Doublet:
    """Controls for one length of time after the other, those for afterwards, and what was held before."""

    controls: tuple[Array, Array]
    rest: Array
    length: float
    before: Controls | None
    begin: float | None = None
    part: int = -1


class RemotePilot:
    """See `sbs_sim.cockpit.fly_panel.Pilot`. The calls wait for their answers; do not use them in ROS callbacks.

    Parameters
    ----------
    node : Node
        Spun by another thread.
    """

    def __init__(self, node: Node) -> None:
        self._clients = {
            name: node.create_client(kind, name, qos_profile=SERVICE_QOS) for name, kind in SERVICES.items()
        }
        self._output = node.create_publisher(Controls, "controls", COMMAND_QOS)
        self._held: Controls | None = None
        self._doublet: _Doublet | None = None
        node.create_timer(COMMAND_PERIOD, self._hold)

    def _call(self, name: str, request: Any, patience: float = SERVICE_TIMEOUT) -> Any:
        """Response of a service; None if there is none in time."""
        client = self._clients[name]
        if not client.service_is_ready():
            return None
        answered = threading.Event()
        future = client.call_async(request)
        future.add_done_callback(lambda _: answered.set())
        if not answered.wait(patience):
            client.remove_pending_request(future)
            return None
        return future.result()

    def _ask(self, name: str, request: Any, patience: float = SERVICE_TIMEOUT) -> Answer:
        response = self._call(name, request, patience)
        return (False, f"no answer of {name}") if response is None else (response.success, response.message)

    def _hold(self) -> None:
        """Publish again what is held, so that it does not count as old."""
        if self._held is not None:
            self._output.publish(self._held)

    def settings(self) -> dict[str, Any] | None:
        """Parameters of the simulator that the page shows, by name; None while it does not answer."""
        response = self._call("simulator/get_parameters", GetParameters.Request(names=list(SETTINGS)))
        if response is None or len(response.values) != len(SETTINGS):
            return None
        values = [parameter_value_to_python(value) for value in response.values]
        known = all(isinstance(value, kind) for value, kind in zip(values, SETTINGS.values(), strict=True))
        return dict(zip(SETTINGS, values, strict=True)) if known else None

    def command(self, controls: Array | None) -> None:
        """Hold the controls of the four axes [rad], shape (4,), from now on; None lets go of them."""
        self._doublet = None
        self._held = None if controls is None else controls_of(controls)
        self._hold()

    def doublet(self, rest: Array, change: Array, length: float) -> None:
        """Hold controls + change [rad], shape (4,), for a simulation time [s], then - change, then what was held."""
        self._doublet = _Doublet((rest + change, rest - change), rest, length, self._held)

    @property
    def follows_time(self) -> bool:
        """Simulation time is wanted by `tick`."""
        return self._doublet is not None

    def tick(self, now: float) -> None:
        """Simulation time has come to this [s]."""
        doublet = self._doublet
        if doublet is None:
            return
        if doublet.begin is None or now < doublet.begin:
            doublet.begin = now
        part = int((now - doublet.begin) / doublet.length + 1e-6)
        if part == doublet.part:
            return
        doublet.part = part
        if part < len(doublet.controls):
            self._held = controls_of(doublet.controls[part])
            self._hold()
        else:
            self._doublet = None
            self._output.publish(controls_of(doublet.rest))
            self._held = doublet.before

    def pause(self, paused: bool) -> Answer:
        """Pause or resume."""
        return self._ask("pause", SetBool.Request(data=paused))

    def step(self, ticks: int) -> Answer:
        """Fly some ticks while paused."""
        return self._ask("step", Step.Request(ticks=ticks))

    def reset(self, condition: TrimCondition, height: float) -> Answer:
        """Put the aircraft into a trimmed condition at a height above the origin [m]."""
        request = Reset.Request(**_condition(condition))
        request.position.z = -float(height)
        return self._ask("reset", request, ANALYSIS_TIMEOUT)

    def stand(self) -> Answer:
        """Put the aircraft onto the ground, with all controls at rest."""
        return self._ask("reset", Reset.Request(on_ground=True), ANALYSIS_TIMEOUT)

    def set_pace(self, factor: float) -> Answer:
        """Simulation time over wall time; 0 is as fast as possible."""
        parameter = Parameter("real_time_factor", value=float(factor)).to_parameter_msg()
        response = self._call("simulator/set_parameters", SetParameters.Request(parameters=[parameter]))
        if response is None:
            return False, "no answer of simulator/set_parameters"
        return response.results[0].successful, response.results[0].reason

    def set_wind(self, fields: Mapping[str, Any]) -> Answer:
        """Ask for a wind."""
        request = SetWind.Request()
        for name, value in fields.items():
            if isinstance(value, tuple):
                part = getattr(request, name)
                part.x, part.y, part.z = value
            else:
                setattr(request, name, value)
        return self._ask("set_wind", request)

    def record(self, on: bool) -> Answer:
        """Begin a log in the default folder, or end the present one."""
        return self._ask("record", Record.Request(record=on))

    def trim(self, condition: TrimCondition) -> tuple[TrimResult | None, str]:
        """Trim a condition."""
        response = self._call("trim", Trim.Request(**_condition(condition)), ANALYSIS_TIMEOUT)
        return _trimmed(condition, response, "trim", lambda: response.trim)

    def linearize(self, condition: TrimCondition) -> tuple[TrimResult | None, str]:
        """Linearize about a condition: its trim; the model comes by `linear_model`."""
        response = self._call("linearize", Linearize.Request(**_condition(condition)), ANALYSIS_TIMEOUT)
        return _trimmed(condition, response, "linearize", lambda: response.model.trim)


def _trimmed(
    condition: TrimCondition, response: Any, name: str, point_of: Callable[[], TrimPoint]
) -> tuple[TrimResult | None, str]:
    """Trim of an answer, or why there is none."""
    if response is None:
        return None, f"no answer of {name}: is there an analysis node?"
    if not response.success:
        return None, response.message
    point = point_of()
    controls = np.array([getattr(point.controls, name) for name in CONTROL_NAMES])
    notes = (*point.beyond_limits, *(f"outside the model's validity: {text}" for text in response.warnings))
    return TrimResult(condition, controls, point.pitch, point.roll, point.thrust, point.power, notes), ""


def _condition(condition: TrimCondition) -> dict[str, float]:
    """Fields of a request."""
    return {name: float(value) for name, value in dataclasses.asdict(condition).items()}
