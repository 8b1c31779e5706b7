"""Executable `ardupilot`: a simulator that ArduPilot flies, frame by frame, by its JSON physics interface.

Listens on a UDP port of this machine for ArduPilot in software in the loop (`--model JSON:127.0.0.1`). Each of its
frames sets the servos, is one tick of the simulation, and is answered with what the sensors see: ArduPilot waits for
that, and its SIM_SPEEDUP decides how fast both go. Everything else is as with `simulator`: topics, services, the log.
The aircraft begins on the ground; where its file has contact points, they carry it.
"""

import argparse
import sys
from typing import Any

import rclpy.utilities
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.clock import Clock, ClockType

from sbs_msgs.msg import ServoFrame
from sbs_sim.aircraft import Aircraft
from sbs_sim.aircraft.description import CONTACT
from sbs_sim.ardupilot.bridge import Bridge
from sbs_sim.ardupilot.servos import Servos
from sbs_sim.errors import SbsError
from sbs_sim.flight.simulation import Simulation
from sbs_sim.lockstep import LockstepLoop
from sbs_sim.nodes.conversions import to_time
from sbs_sim.nodes.diagnostics import DIAGNOSTICS_PERIOD, diagnostic_status
from sbs_sim.nodes.parameters import MAX_PORT, Parameter
from sbs_sim.nodes.process import run
from sbs_sim.nodes.qos import STATE_QOS
from sbs_sim.nodes.recorded_publisher import RecordedPublisher
from sbs_sim.nodes.simulator import PARAMETERS as SIMULATOR_PARAMETERS
from sbs_sim.nodes.simulator import Simulator, nodes_of
from sbs_sim.terminal.command_line import Parser

PORT = 9002
WITHOUT = ("command_timeout",)
PARAMETERS = {name: value for name, value in SIMULATOR_PARAMETERS.items() if name not in WITHOUT}
PARAMETERS |= {
    "components": Parameter(["simulator", "analysis", "recorder"], "Nodes in this process, as with `simulator`"),
    "on_ground": Parameter(True, "At the start: stand on the ground; false begins in the trim"),
    "ground_altitude": Parameter(
        0.0, "Height of the ground above the origin, which is ArduPilot's home [m]", -1e5, 1e5
    ),
    "real_time_factor": Parameter(
        0.0, "Largest simulation time over elapsed time; 0 is what ArduPilot asks for", 0.0, 1000.0, fixed=False
    ),
    "publish_rate": Parameter(50.0, "Rate of the messages on every state topic, in simulation time [Hz]", 1.0, 1e4),
    "frame_rate": Parameter(
        400.0, "Frames per second of simulation time, as ArduPilot's SIM_RATE_HZ says [Hz]", 10.0, 1e4
    ),
    "port": Parameter(
        PORT, "UDP port to listen on; ArduPilot's instance i uses 9002 + 10 i; 0 takes a free one", 0, MAX_PORT
    ),
    "servos": Parameter("", "Servo file; empty for the one that comes with the package for the aircraft"),
}


class ArduPilotSimulator(Simulator):
    """See the module."""

    def __init__(self) -> None:
        super().__init__(PARAMETERS)
        self._frames = RecordedPublisher(self, ServoFrame, "autopilot/servos", STATE_QOS, self.log)
        self._bridge_health = self.create_publisher(DiagnosticArray, "diagnostics", STATE_QOS)
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(DIAGNOSTICS_PERIOD, self._publish_health, clock=steady)
        self.get_logger().info(f"waiting for ArduPilot on UDP port {self._bridge.port}")

    def _loaded(self, values: dict[str, Any]) -> Aircraft:
        aircraft = super()._loaded(values)
        if values["on_ground"] and aircraft.contact_points:
            return aircraft.with_value("ground.contact", CONTACT)
        return aircraft

    def _tick(self, values: dict[str, Any]) -> float:
        return 1.0 / float(values["frame_rate"])

    def _loop_of(self, simulation: Simulation, values: dict[str, Any]) -> LockstepLoop:
        servos = Servos.load(self.aircraft, values["servos"])
        self._bridge = Bridge(values["port"], self.get_logger().info)
        every = max(1, round(values["frame_rate"] / values["publish_rate"]))
        self._lockstep = LockstepLoop(simulation, self._bridge, servos, every, values["real_time_factor"])
        return self._lockstep

    def _publish_health(self) -> None:
        """What has come from ArduPilot."""
        counts, time = self._lockstep.values(), self.loop.time
        problems = [] if counts["frames"] else [(DiagnosticStatus.WARN, "no packet of ArduPilot has come")]
        message = DiagnosticArray(status=[diagnostic_status("ardupilot", problems, counts)])
        message.header.stamp = to_time(time)
        self._bridge_health.publish(message)
        if pulses := self._lockstep.pulses:
            frame = ServoFrame(count=self._bridge.newest, pulses=list(pulses))
            frame.header.stamp = to_time(time)
            self._frames.publish(frame, time)


def make_parser() -> Parser:
    """Command line of `ardupilot`."""
    parser = Parser(
        "ardupilot",
        description="Let ArduPilot fly an aircraft, or write its parameters for it.",
        epilog="example: ./run ardupilot --ros-args -p wind:=[4.0,0.0,0.0]",
    )
    parser.add_argument("--parameters", action="store_true", help="print ArduPilot's parameters for the aircraft")
    parser.add_argument("--out", metavar="FILE", help="of --parameters: write them there")
    parser.add_argument("--aircraft", default="sbs", metavar="FILE", help="of --parameters: name or path")
    parser.add_argument("--servos", default="", metavar="FILE", help="of --parameters: servo file")
    return parser


def main(args: list[str] | None = None) -> None:
    """Fly until interrupted, or print the parameters."""
    arguments = sys.argv if args is None else args
    own = rclpy.utilities.remove_ros_args(arguments)[1:]
    options = make_parser().parse_args(own)
    if options.parameters:
        sys.exit(_print_parameters(options))
    interruptions: list[int] = []
    given = [arguments[0], *arguments[1 + len(own) :]]
    sys.exit(
        run(lambda: nodes_of(ArduPilotSimulator, interruptions), given, first="simulator", interruptions=interruptions)
    )


def _print_parameters(options: argparse.Namespace) -> int:
    from sbs_sim.ardupilot.parameters import parameter_lines
    from sbs_sim.output.files import check_target, write

    try:
        aircraft = Aircraft.load(options.aircraft)
        check_target(options.out)
        text = "\n".join(parameter_lines(aircraft, Servos.load(aircraft, options.servos))) + "\n"
        if options.out:
            write(options.out, text)
        else:
            print(text, end="")
    except SbsError as error:
        print(" ".join(str(error).split()), file=sys.stderr)
        return 1
    return 0
