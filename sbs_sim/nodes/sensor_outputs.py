"""Topics of the sensors: measurements of `sbs_sim.sensors` as sensor_msgs, in the axes of REP 103 and REP 145.

Body axes forward, left, up; earth axes east, north, up. Covariances are the variances of the errors, see
`sbs_sim.sensors.errors.ErrorModel.variance`; a sensor without errors has zeros, which sensor_msgs calls unknown.
"""

import math
from collections.abc import Callable, Mapping
from typing import Any

from rclpy.node import Node
from sensor_msgs.msg import BatteryState, FluidPressure, Imu, MagneticField, NavSatFix, NavSatStatus, Range

from sbs_sim.errors import SimulationError
from sbs_sim.flight.records import Snapshot
from sbs_sim.flight.simulation import Simulation
from sbs_sim.flight_loop import FlightLoop
from sbs_sim.nodes.conversions import FRAME_BASE, enu_flu_quaternion, set_quaternion, set_vector, to_time
from sbs_sim.nodes.parameters import Parameter
from sbs_sim.nodes.qos import STATE_QOS
from sbs_sim.nodes.recorded_publisher import MessageLog, RecordedPublisher
from sbs_sim.output.robot import IMU, RANGE
from sbs_sim.sensors.settings import SETTINGS, Setting
from sbs_sim.sensors.suite import Clock, Measurement, SensorSuite

TOPICS = {
    "imu": ("imu/data", Imu),
    "gnss": ("fix", NavSatFix),
    "pressure": ("pressure", FluidPressure),
    "magnetic": ("imu/mag", MagneticField),
    "range": ("range", Range),
    "battery": ("battery_state", BatteryState),
}


def parameter_of(setting: Setting) -> Parameter:
    """Parameter of a node for a setting; ranges of lists and of integers are checked by the library."""
    ranged = isinstance(setting.default, float)
    ends = (setting.least, setting.most) if ranged else (None, None)
    return Parameter(setting.default, setting.description, *ends)


SENSOR_PARAMETERS = {name: parameter_of(setting) for name, setting in SETTINGS.items()}


class SensorOutputs:
    """Publishes what the sensors measure.

    Parameters
    ----------
    node : Node
        Owner of the publishers.
    suite : SensorSuite
    values : mapping of str to object
        Parameters of the node.
    log : MessageLog, optional
        Where everything that is published is recorded.
    """

    def __init__(self, node: Node, suite: SensorSuite, values: Mapping[str, Any], log: MessageLog | None) -> None:
        self._suite = suite
        self._limits = values["range.limits"]
        self._publishers = {
            name: RecordedPublisher(node, TOPICS[name][1], TOPICS[name][0], STATE_QOS, log) for name in suite.names
        }

    def publish(self, snapshot: Snapshot, wait: bool) -> None:
        """Publish what arrives with a snapshot."""
        for measurement in self._suite.take(snapshot):
            publisher = self._publishers[measurement.sensor]
            for message in self._messages(measurement):
                message.header.stamp = to_time(measurement.time)
                publisher.publish(message, snapshot.time, wait)

    def _messages(self, measurement: Measurement) -> list[Any]:
        if measurement.sensor == "battery":
            return battery_messages(measurement)
        if measurement.sensor == "range":
            return [range_message(measurement, *self._limits)]
        return [CONVERSIONS[measurement.sensor](measurement)]


def sensor_outputs(
    node: Node, simulation: Simulation, loop: FlightLoop, values: Mapping[str, Any], log: MessageLog | None
) -> SensorOutputs | None:
    """Topics of the sensors that are on; None if all are off.

    Raises
    ------
    SimulationError
        See `SensorSuite`.
    """
    own = {name: values[name] for name in SETTINGS}
    if simulation.stitched is not None and own["battery.rate"]:
        raise SimulationError(
            f"parameter battery.rate = {own['battery.rate']:g}: allowed is 0 with model = stitched, without engines"
        )
    clock, ground = Clock(simulation.step_size, loop.report_steps), simulation.options["ground_altitude"]
    suite = SensorSuite(simulation.aircraft, own, clock, ground)
    return SensorOutputs(node, suite, own, log) if suite.names else None


def imu_message(measurement: Measurement) -> Imu:
    """Angular velocity, specific force and attitude."""
    p, q, r, x, y, z, *attitude = measurement.values.tolist()
    message = Imu()
    message.header.frame_id = IMU
    set_vector(message.angular_velocity, (p, -q, -r))
    set_vector(message.linear_acceleration, (x, -y, -z))
    set_quaternion(message.orientation, enu_flu_quaternion(attitude))
    message.angular_velocity_covariance = _diagonal(measurement.variances[:3])
    message.linear_acceleration_covariance = _diagonal(measurement.variances[3:6])
    message.orientation_covariance = _diagonal(measurement.variances[6:])
    return message


def fix_message(measurement: Measurement) -> NavSatFix:
    """Place by satellites."""
    message = NavSatFix()
    message.header.frame_id = FRAME_BASE
    message.status.status, message.status.service = NavSatStatus.STATUS_FIX, NavSatStatus.SERVICE_GPS
    message.latitude, message.longitude, message.altitude = measurement.values.tolist()
    north, east, down = measurement.variances
    message.position_covariance = _diagonal([east, north, down])
    known = (
        NavSatFix.COVARIANCE_TYPE_DIAGONAL_KNOWN if measurement.variances.any() else NavSatFix.COVARIANCE_TYPE_UNKNOWN
    )
    message.position_covariance_type = known
    return message


def pressure_message(measurement: Measurement) -> FluidPressure:
    """Static pressure."""
    message = FluidPressure(fluid_pressure=float(measurement.values[0]), variance=float(measurement.variances[0]))
    message.header.frame_id = FRAME_BASE
    return message


def magnetic_message(measurement: Measurement) -> MagneticField:
    """Magnetic field in the axes of the body."""
    message = MagneticField()
    message.header.frame_id = FRAME_BASE
    x, y, z = measurement.values.tolist()
    set_vector(message.magnetic_field, (x, -y, -z))
    message.magnetic_field_covariance = _diagonal(measurement.variances)
    return message


def range_message(measurement: Measurement, least: float, most: float) -> Range:
    """Distance to the ground; infinite beyond the limits, as REP 117 has it."""
    message = Range(radiation_type=Range.INFRARED, field_of_view=0.0, min_range=least, max_range=most)
    message.header.frame_id = RANGE
    message.range = float(measurement.values[0])
    if hasattr(message, "variance"):  # Humble has none
        message.variance = float(measurement.variances[0])
    return message


def battery_messages(measurement: Measurement) -> list[BatteryState]:
    """One message for each battery; what is not known is NaN, as sensor_msgs asks."""
    found = []
    for number, voltage, current, charge, capacity in measurement.values.tolist():
        message = BatteryState(
            voltage=voltage,
            current=-current,  # negative while it discharges
            charge=charge,
            capacity=capacity,
            design_capacity=capacity,
            percentage=min(max(charge / capacity, 0.0), 1.0),
            temperature=math.nan,
            present=True,
            location=f"drive {number:.0f}",
        )
        gives = current > 0.0
        message.power_supply_status = (
            BatteryState.POWER_SUPPLY_STATUS_DISCHARGING if gives else BatteryState.POWER_SUPPLY_STATUS_NOT_CHARGING
        )
        message.power_supply_health = BatteryState.POWER_SUPPLY_HEALTH_GOOD
        message.power_supply_technology = BatteryState.POWER_SUPPLY_TECHNOLOGY_UNKNOWN
        found.append(message)
    return found


CONVERSIONS: dict[str, Callable[[Measurement], Any]] = {
    "imu": imu_message,
    "gnss": fix_message,
    "pressure": pressure_message,
    "magnetic": magnetic_message,
}


def _diagonal(variances: Any) -> list[float]:
    """Covariance matrix, row by row, of independent errors; its axes may point either way."""
    found = [0.0] * 9
    found[::4] = [float(value) for value in variances]
    return found
