"""Node `simulator`: flies an aircraft in real time.

Publishes `state`, `rotors`, `inflow`, `odom`, `clock`, `status`, `diagnostics`; subscribes `swashplate`; serves
`pause`, `step`, `reset`, `set_wind`, `engine_failure`. The executable brings up the control mixer, the analysis and the
recorder in the same process.
"""

import math
import sys
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from rcl_interfaces.msg import SetParametersResult
from std_srvs.srv import SetBool

from sbs_msgs.msg import SwashplateArray
from sbs_msgs.srv import EngineFailure, Reset, SetWind, Step
from sbs_sim import checks
from sbs_sim.aircraft import Aircraft
from sbs_sim.analysis.trim import TWO_BLADES, trim
from sbs_sim.errors import SbsError, SimulationError, TrimError
from sbs_sim.flight.contact import state_on_ground
from sbs_sim.flight.gust_file import read_gust
from sbs_sim.flight.gust_standards import WIND_AT_20_FT, specified_turbulence
from sbs_sim.flight.simulation import AUTO, AZIMUTH_STEP_DEG, FREE_METHOD, METHOD, METHODS, Simulation
from sbs_sim.flight.stitched import StitchedModel
from sbs_sim.flight.stitched_file import load
from sbs_sim.flight.stitched_simulation import FULL, MODELS, begun, check_aircraft
from sbs_sim.flight.trim_point import TrimPoint
from sbs_sim.flight.trimmed_state import MAX_SPEED, standing_state, trimmed_state
from sbs_sim.flight.validity import slow_rotors
from sbs_sim.flight_loop import FlightLoop
from sbs_sim.model.wind import CHOICES, MAX_WIND, MIN_TURBULENCE_AIRSPEED, RATES, Wind
from sbs_sim.nodes.command_monitor import CommandMonitor
from sbs_sim.nodes.component import Component
from sbs_sim.nodes.control_mixer import ControlMixer
from sbs_sim.nodes.conversions import point_array, prepare_field, swashplate_array, wind_of, wind_words
from sbs_sim.nodes.parameters import DEFAULT_GROUND, MAX_PORT, Parameter, declare, ground_altitude
from sbs_sim.nodes.process import run
from sbs_sim.nodes.qos import COMMAND_QOS, SERVICE_QOS
from sbs_sim.nodes.recorder_node import RecorderNode
from sbs_sim.nodes.sensor_outputs import SENSOR_PARAMETERS, sensor_outputs
from sbs_sim.nodes.signals import note_interruptions
from sbs_sim.nodes.simulator_outputs import SimulatorOutputs
from sbs_sim.output.units import counted

if TYPE_CHECKING:
    from sbs_sim.nodes.foxglove_server import FoxgloveServer

OFF = "off"
# How long a thread keeps the interpreter while the flight waits for it [s]; the 5 ms of Python are half a tick.
SWITCH_INTERVAL = 0.5e-3
WIND_PARAMETERS = (
    *("wind_profile", "reference_height", "roughness_length", "profile_exponent"),
    *("turbulence_model", "turbulence_extent", "turbulence_seed"),
)
CONDITION = ("airspeed", "climb_rate", "sideslip", "turn_rate")
COMPONENTS = ("simulator", "control_mixer", "analysis", "recorder")
PARAMETERS = {
    "aircraft": Parameter("sbs", "Aircraft: a name in config/aircraft, or the path of a file"),
    "components": Parameter(list(COMPONENTS), f"Nodes in this process, of {', '.join(COMPONENTS)}"),
    "airspeed": Parameter(
        0.0, "At the start: horizontal velocity relative to the air, forward positive [m/s]", -100.0, 100.0
    ),
    "climb_rate": Parameter(0.0, "At the start: vertical velocity relative to the air, up positive [m/s]", -50.0, 50.0),
    "sideslip": Parameter(0.0, "At the start: angle from heading to track, right positive [rad]", -math.pi, math.pi),
    "turn_rate": Parameter(0.0, "At the start: rate of the heading, right positive [rad/s]", -3.0, 3.0),
    "heading": Parameter(0.0, "At the start: heading, from north to east [rad]", -math.pi, math.pi),
    "altitude": Parameter(0.0, "At the start: height above the origin [m]", -1e5, 1e5),
    "rotor_speed": Parameter(
        1.0,
        "At the start: speed of the rotors that have a drive over that of the trim; 0 is at rest, for a run-up",
        0.0,
        MAX_SPEED,
    ),
    "on_ground": Parameter(
        False,
        "At the start: stand on the ground with all controls at rest, instead of the trim; needs an aircraft with"
        " ground.contact",
    ),
    "ground_altitude": Parameter(
        DEFAULT_GROUND,
        "Height of the ground above the origin [m]; without a choice that of the aircraft file, if it has one; a rotor"
        " or c.g. that touches it stops the flight until a reset",
        -1e5,
        1e5,
    ),
    "real_time_factor": Parameter(
        1.0, "Simulation time over elapsed time; 0 is as fast as possible", 0.0, 1000.0, fixed=False
    ),
    "publish_rate": Parameter(
        100.0, "Rate of ticks and of the messages on every state topic, in simulation time [Hz]", 1.0, 1e4
    ),
    "method": Parameter(
        AUTO,
        f"Integration method: {', '.join(METHODS)}; auto is {METHOD}, or {FREE_METHOD} for an aircraft with drives",
    ),
    "model": Parameter(
        FULL,
        "Model that flies: full, or stitched, which is made of trims and linear models; see stitched_file",
    ),
    "stitched_file": Parameter(
        "", "Stitched model: a file of the command stitch; empty to stitch one at the start, at stitched_airspeeds"
    ),
    "stitched_airspeeds": Parameter(
        [float(speed) for speed in range(-4, 21, 2)], "Airspeeds of a model that is stitched at the start [m/s]"
    ),
    "stitched_states": Parameter(
        "all", "States of a model that is stitched at the start: all, or body, whose rotors and inflow have settled"
    ),
    "azimuth_step_deg": Parameter(
        AZIMUTH_STEP_DEG, "Largest integration step, as azimuth of the fastest rotor [deg]", 0.01, 45.0
    ),
    "lead_lag": Parameter(True, "Model the lead-lag motion of the blades"),
    "cyclic_inflow": Parameter(True, "Model the sine and cosine parts of the inflow"),
    "command_timeout": Parameter(
        0.5,
        "Age of a command above which a warning is given [s of simulation time]; 0 disables it",
        0.0,
        1e6,
        fixed=False,
    ),
    "record": Parameter(
        "", "Log of the flight: a file, an existing folder, empty for bags/<date>_<time>_<aircraft>.mcap, or off"
    ),
    "wind": Parameter([0.0, 0.0, 0.0], "Steady wind: velocity of the air, north, east, down [m/s]"),
    "wind_profile": Parameter("uniform", "Steady wind over the height: uniform, logarithmic or power"),
    "reference_height": Parameter(6.096, "Height above the ground at which the steady wind is that [m]", 0.1, 1e4),
    "roughness_length": Parameter(0.04572, "Roughness length of the logarithmic profile [m]", 1e-6, 10.0),
    "profile_exponent": Parameter(0.143, "Exponent of the power profile", 0.0, 1.0),
    "turbulence": Parameter(
        "off", "Turbulence at the start: off, or light, moderate, severe of MIL-F-8785C at the height of the start"
    ),
    "turbulence_model": Parameter("dryden", "Spectra of the turbulence: dryden or von_karman"),
    "turbulence_extent": Parameter("point", "Where turbulence acts: point, rates, field or elements, see SetWind"),
    "turbulence_seed": Parameter(0, "Seed of the turbulence, not negative"),
    "foxglove": Parameter(
        False, "Serve the flight to Foxglove and Lichtblick, on this machine alone; needs the package foxglove-sdk"
    ),
    "foxglove_port": Parameter(8765, "Port of that server; 0 takes a free one", 0, MAX_PORT),
    "foxglove_control": Parameter(
        False,
        "Let its clients publish what the nodes of this process subscribe, and call their services; any page of a"
        " browser on this machine is a possible client",
    ),
    "gust_file": Parameter("", "Own gust at the start: CSV file, see SetWind; empty for none"),
    "simulation_interfaces": Parameter(
        False, "Offer the services of the package simulation_interfaces, which must be installed"
    ),
    **SENSOR_PARAMETERS,
}


class Simulator(Component):
    """See the module. The flight itself begins with `begin`.

    Parameters
    ----------
    parameters : dict of str to Parameter
        Those of `PARAMETERS`, and what else a simulator with another clock has.
    """

    def __init__(self, parameters: dict[str, Parameter] = PARAMETERS) -> None:
        super().__init__("simulator")
        self._values = values = declare(self, parameters)
        self.components = checked_components(values["components"])
        if "recorder" not in self.components and values["record"] not in ("", OFF):
            raise SbsError(f"parameter record = {values['record']!r}: not allowed without the component recorder")
        self.viewers = foxglove_server(values)
        self.aircraft = self._loaded(values)
        self._stitched = stitched_model(values, self.aircraft)
        self._fidelity = {"lead_lag": values["lead_lag"], "cyclic_inflow": values["cyclic_inflow"]}
        simulation = self._start(values)
        self.loop = self._loop_of(simulation, values)
        self.log = RecorderNode(simulation, self.loop, values) if "recorder" in self.components else None
        self._commands = CommandMonitor(self, SwashplateArray, "swashplate", COMMAND_QOS, self.log)
        sensors = sensor_outputs(self, simulation, self.loop, values, self.log)
        self._outputs = SimulatorOutputs(self, self.loop, self._commands, self.log, sensors, self.viewers)
        self.create_subscription(SwashplateArray, "swashplate", self._on_swashplate, COMMAND_QOS)
        self.create_service(SetBool, "pause", self._on_pause, qos_profile=SERVICE_QOS)
        self.create_service(Step, "step", self._on_step, qos_profile=SERVICE_QOS)
        self.create_service(Reset, "reset", self._on_reset, qos_profile=SERVICE_QOS)
        self.create_service(SetWind, "set_wind", self._on_set_wind, qos_profile=SERVICE_QOS)
        self.create_service(EngineFailure, "engine_failure", self._on_engine_failure, qos_profile=SERVICE_QOS)
        if values["simulation_interfaces"]:
            from sbs_sim.nodes.simulation_services import SimulationServices  # here: most do without

            SimulationServices(self, simulation, self.loop)
        self.add_on_set_parameters_callback(self._on_parameters)

    def begin(self) -> None:
        """Begin the flight, and its log.

        Raises
        ------
        RecordingError
            See `RecorderNode.begin`.
        """
        if self.log is not None and self._values["record"] != OFF:
            self.log.begin(self._values["record"])
            self.get_logger().info(f"recording {self.log.path}")
        self.loop.start()

    def _loaded(self, values: dict[str, Any]) -> Aircraft:
        return Aircraft.load(values["aircraft"])

    def _loop_of(self, simulation: Simulation, values: dict[str, Any]) -> FlightLoop:
        return FlightLoop(simulation, values["real_time_factor"], values["command_timeout"])

    def _tick(self, values: dict[str, Any]) -> float:
        """Length of a tick [s]."""
        return 1.0 / float(values["publish_rate"])

    def _start(self, values: dict[str, Any]) -> Simulation:
        """Simulation in trimmed flight at the condition that the parameters name, or of rotors on a stand."""
        self._ground = ground_altitude(self.aircraft, values["ground_altitude"])
        height = values["altitude"] - self._ground
        wind = initial_wind(values, height, self.aircraft)
        condition, position = [values[name] for name in CONDITION], (0.0, 0.0, -values["altitude"])
        start = values["heading"], wind.velocity_at(height), values["rotor_speed"]
        state, controls = self._beginning(condition, position, *start, values["on_ground"])
        options: dict[str, Any] = {"tick": self._tick(values), "wind": wind, "ground_altitude": self._ground}
        if self._stitched is None:
            options |= {"method": values["method"], "azimuth_step": math.radians(values["azimuth_step_deg"])}
            options |= self._fidelity
        simulation = begun(self.aircraft, self._stitched, state, self.aircraft.mix(controls), **options)
        shown = ", ".join(
            f"{control.name} {control.shown(value):.3f} {control.shown_unit}"
            for control, value in zip(self.aircraft.controls, controls.tolist(), strict=True)
        )
        begins = (
            "on its stand" if self.aircraft.body.is_stand else "on the ground" if values["on_ground"] else "trimmed"
        )
        by = simulation.options["method"] if self._stitched is None else stitched_words(self._stitched)
        self.get_logger().info(f"{self.aircraft.name} {begins} with {shown}, flies by {by}")
        return simulation

    def _beginning(
        self,
        condition: Sequence[float],
        position: Any,
        heading: float,
        wind: Any,
        rotor_speed: float,
        on_ground: bool,
    ) -> tuple[Any, Any]:
        """State and pilot controls with which a flight begins: those of the trim, or at rest on the ground."""
        if on_ground:
            return self._standing_on_ground(condition, position, heading, rotor_speed)
        try:
            point = self._trim(*condition)
        except TrimError as error:
            if not self.aircraft.body.is_stand or any(condition):
                raise
            self.get_logger().warning(f"begins with straight blades: {error}")
            state = standing_state(self.aircraft, position, heading, rotor_speed)
            return state, self.aircraft.resting_controls
        return trimmed_state(self.aircraft, point, position, heading, wind, rotor_speed), point.controls

    def _standing_on_ground(
        self, condition: Sequence[float], position: Any, heading: float, rotor_speed: float
    ) -> tuple[Any, Any]:
        """State on the ground, and controls at rest."""
        for name, value in zip((*CONDITION, "height"), (*condition, -position[2]), strict=True):
            if value != 0.0:
                raise SimulationError(f"{name} = {value:g}: allowed is 0 for an aircraft on the ground")
        state = state_on_ground(self.aircraft, self._ground, position[:2], heading, rotor_speed)
        return state, self.aircraft.resting_controls

    def _trim(self, airspeed: float, climb_rate: float, sideslip: float, turn_rate: float) -> TrimPoint:
        """Trim that can be flown: every control within its limits, and no rotor that hardly turns."""
        if self._stitched is not None:
            low, high = float(self._stitched.airspeeds[0]), float(self._stitched.airspeeds[-1])
            checks.number("airspeed of the stitched model", airspeed, low, high, "m/s", SimulationError)
        point = trim(self.aircraft, airspeed, climb_rate, sideslip, turn_rate, **self._fidelity)
        if point.beyond_limits:
            raise TrimError("this flight needs " + "; ".join(point.beyond_limits))
        if slow := [rotor.name for rotor, _ in slow_rotors(self.aircraft, point.rotor_speed)]:
            raise TrimError(f"in this flight nothing turns {', '.join(slow)} fast enough to hold its blades")
        for line in point.warnings:
            if line.startswith(TWO_BLADES):  # the flight does not begin as it goes on; the others are in `status`
                self.get_logger().warning(f"begins with a trim in the mean: {line}")
        return point

    # ----------------------------------------------------------------------------------------------------- inputs

    def _on_swashplate(self, message: SwashplateArray) -> None:
        try:
            self._commands.check(message)
            self.loop.command(swashplate_array(message))
        except SbsError as error:
            self._commands.add(error)
            return
        self._commands.accept(message, self.loop.time)

    def _on_pause(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        done = "paused" if request.data else "playing"
        return self.answer(response, lambda: self.loop.pause(request.data), done, request)

    def _on_step(self, request: Step.Request, response: Step.Response) -> Step.Response:
        def step() -> None:
            response.sim_time = self.loop.step(request.ticks)

        return self.answer(response, step, counted(request.ticks, "tick"), request)

    def _on_reset(self, request: Reset.Request, response: Reset.Response) -> Reset.Response:
        def reset() -> None:
            check_reset(request)
            if request.from_state:
                self.loop.reset(request.state, self.loop.swashplate())
                return
            position = point_array(request.position)
            wind = self.loop.wind().velocity_at(-float(position[2]) - self._ground)
            condition = [getattr(request, name) for name in CONDITION]
            start = request.heading, wind, request.rotor_speed, request.on_ground
            state, controls = self._beginning(condition, position, *start)
            self.loop.reset(state, self.aircraft.mix(controls))

        return self.answer(response, reset, "reset", request)

    def _on_set_wind(self, request: SetWind.Request, response: SetWind.Response) -> SetWind.Response:
        def set_wind() -> None:
            prepare_field(request)
            self.loop.set_wind(lambda now: wind_of(request, now, self.aircraft))

        response = self.answer(response, set_wind, "", request)
        if response.success:
            response.message = f"wind set: {wind_words(self.loop.wind())}"
        return response

    def _on_engine_failure(
        self, request: EngineFailure.Request, response: EngineFailure.Response
    ) -> EngineFailure.Response:
        def fail() -> None:
            share = checks.number("failure", request.failure, 0.0, 1.0, "", SimulationError)
            self.loop.fail_engine(request.drive, share)

        return self.answer(response, fail, f"engine of drive {request.drive} set", request)

    def _on_parameters(self, parameters: list[Any]) -> SetParametersResult:
        """Take over what is set; rclpy has found all that came together to be within its range."""
        try:
            for parameter in parameters:
                if parameter.name == "real_time_factor":
                    self.loop.set_pace(parameter.value)
                elif parameter.name == "command_timeout":
                    self.loop.set_command_timeout(parameter.value)
        except SbsError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def stop(self) -> None:
        """End the flight; waiting callers get an error."""
        self.loop.stop()

    def finish(self) -> None:
        """End the publishing, then the log."""
        self._outputs.join()
        if self.log is not None:
            try:
                self.log.end()
            except SbsError as error:
                self.get_logger().error(str(error))


def foxglove_server(values: dict[str, Any]) -> "FoxgloveServer | None":
    """Server for viewers, if one is wanted.

    Raises
    ------
    SbsError
        Its package is missing, or it cannot serve there.
    """
    if not values["foxglove"]:
        return None
    try:
        from sbs_sim.nodes.foxglove_server import FoxgloveServer  # here: its package is needed for this only
    except ModuleNotFoundError as error:
        if error.name != "foxglove":
            raise
        raise SbsError("parameter foxglove = true: needs the package foxglove-sdk: pip install foxglove-sdk") from None
    return FoxgloveServer(values["foxglove_port"], values["foxglove_control"])


def stitched_model(values: dict[str, Any], aircraft: Aircraft) -> StitchedModel | None:
    """The stitched model that flies, or None for the full one.

    Raises
    ------
    SbsError
        A parameter out of range, a file that cannot be read, a model of another aircraft, an aircraft that a stitched
        model cannot describe.
    """
    checks.choice("parameter model", values["model"], MODELS, SimulationError)
    if values["model"] == FULL:
        if values["stitched_file"]:
            raise SimulationError(
                f"parameter stitched_file = {values['stitched_file']!r}: allowed with model = stitched"
            )
        return None
    if values["method"] not in (AUTO, "rk4"):
        raise SimulationError(f"parameter method = {values['method']!r}: allowed with model = stitched are {AUTO}, rk4")
    if values["stitched_file"]:
        model = load(values["stitched_file"])
        check_aircraft(model, aircraft)
        return model
    from sbs_sim.analysis.stitched import stitch  # here: few need it

    return stitch(
        aircraft,
        list(values["stitched_airspeeds"]),
        states=values["stitched_states"],
        lead_lag=values["lead_lag"],
        cyclic_inflow=values["cyclic_inflow"],
    )


def stitched_words(model: StitchedModel) -> str:
    """What a stitched model is, in a few words."""
    return (
        f"a stitched model of {len(model.state_names)} states, {model.airspeeds[0]:g} to {model.airspeeds[-1]:g} m/s:"
        " without vibration, engines and ground effect"
    )


def check_reset(request: Reset.Request) -> None:
    """Raise SimulationError for a request with a part that would not be used."""
    if not request.from_state:
        if len(request.state):
            raise SimulationError(f"state: {len(request.state)} values, allowed with from_state = true only")
        return
    position = point_array(request.position)
    unused = {name: getattr(request, name) for name in (*CONDITION, "heading")}
    unused |= {f"position.{axis}": float(value) for axis, value in zip("xyz", position, strict=True)}
    if request.on_ground:
        raise SimulationError("on_ground = true: not allowed with from_state = true, the state has its own")
    usual = {"rotor_speed": 1.0}
    for name, value in (unused | {"rotor_speed": request.rotor_speed}).items():
        if value != usual.get(name, 0.0):
            raise SimulationError(f"{name} = {value:g}: not allowed with from_state = true, the state has its own")


def initial_wind(values: dict[str, Any], height: float, aircraft: Aircraft) -> Wind:
    """Wind of the parameters, at a height of the start above the ground [m].

    Raises
    ------
    SbsError
        A value is out of range, or the file of a gust cannot be read.
    """
    velocity, extent, airspeed = tuple(values["wind"]), values["turbulence_extent"], abs(values["airspeed"])
    if len(velocity) != 3 or not all(abs(part) <= MAX_WIND for part in velocity):  # false for a NaN as well
        allowed = f"3 numbers, north, east, down, {-MAX_WIND:g} to {MAX_WIND:g} m/s"
        raise SimulationError(f"parameter wind = {list(velocity)}: allowed are {allowed}")
    checks.choice("parameter turbulence", values["turbulence"], (OFF, *WIND_AT_20_FT), SimulationError)
    model = checks.choice(
        "parameter turbulence_model", values["turbulence_model"], CHOICES["turbulence_model"], SimulationError
    )
    fields = {name: values[name] for name in WIND_PARAMETERS}
    if values["turbulence"] != OFF:
        fields |= specified_turbulence(height, values["turbulence"], model=model)
        passing = airspeed or math.hypot(*velocity[:2])
        fields["turbulence_airspeed"] = min(max(passing, MIN_TURBULENCE_AIRSPEED), MAX_WIND)
        fields["turbulence_direction"] = values["heading"]
    own_gust = read_gust(values["gust_file"]) if values["gust_file"] else None
    try:
        return Wind(
            velocity=velocity,
            turbulence_span=aircraft.rotor_span if extent == RATES else 0.0,
            gust_direction=values["heading"],
            own_gust=own_gust,
            **fields,
        )
    except SimulationError as error:  # all that is left names fields that are parameters, too
        raise SimulationError(f"parameter {error}") from None


def checked_components(names: list[str]) -> tuple[str, ...]:
    """Names of components, if all are known.

    Raises
    ------
    SbsError
        One is unknown, or the simulator itself is not among them.
    """
    if "simulator" not in names or set(names) - set(COMPONENTS):
        others = ", ".join(COMPONENTS[1:])
        raise SbsError(f"parameter components = {list(names)}: allowed are simulator, alone or with {others}")
    return tuple(names)


def nodes_of(make: Callable[[], Simulator], interruptions: list[int]) -> list[Component]:
    """A simulator and the nodes that fly with it in its process, in flight."""
    simulator = make()
    nodes: list[Component] = [simulator]
    if "control_mixer" in simulator.components:
        nodes.append(ControlMixer(simulator.loop, simulator.log))
    if "analysis" in simulator.components:
        # Here: it loads for half a second, and what the simulator refuses need not wait for it.
        from sbs_sim.nodes.analysis import Analysis

        nodes.append(Analysis(simulator.loop, simulator.log))
    if simulator.log is not None:
        nodes.append(simulator.log)
    if simulator.viewers is not None:
        simulator.viewers.serve(nodes)
        nodes.append(simulator.viewers)
    sys.setswitchinterval(SWITCH_INTERVAL)
    note_interruptions(interruptions)  # from now on a log is closed in order
    simulator.begin()  # last: what is loaded meanwhile would make it miss deadlines
    return nodes


def main(args: list[str] | None = None) -> None:
    """Fly until interrupted."""
    interruptions: list[int] = []
    sys.exit(run(lambda: nodes_of(Simulator, interruptions), args, first="simulator", interruptions=interruptions))
