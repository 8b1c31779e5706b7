"""The topics of the sensors: a real simulator, whose messages are what the library measures of the same flight."""

import math
from pathlib import Path

import numpy as np
import pytest

rclpy = pytest.importorskip("rclpy")

from ros_harness import DOMAINS, nanoseconds, world  # noqa: E402
from sensor_msgs.msg import BatteryState, FluidPressure, Imu, MagneticField, NavSatFix, Range  # noqa: E402
from std_srvs.srv import SetBool  # noqa: E402

from sbs_msgs.srv import Step  # noqa: E402
from sbs_sim import Aircraft, trim  # noqa: E402
from sbs_sim.flight.simulation import Simulation  # noqa: E402
from sbs_sim.flight.trimmed_state import trimmed_state  # noqa: E402
from sbs_sim.recording import read  # noqa: E402
from sbs_sim.recording.recorded_flight import flight_of  # noqa: E402
from sbs_sim.recording.verification import verify  # noqa: E402
from sbs_sim.sensors.suite import Clock, SensorSuite  # noqa: E402

ELECTRIC = Path(__file__).resolve().parents[1] / "data" / "electric.yaml"
TOPICS = {
    "imu": ("imu/data", Imu),
    "gnss": ("fix", NavSatFix),
    "pressure": ("pressure", FluidPressure),
    "magnetic": ("imu/mag", MagneticField),
    "range": ("range", Range),
    "battery": ("battery_state", BatteryState),
}
VALUES = {
    "imu.rate": 100.0,
    "imu.gyro_noise": 1e-3,
    "imu.accel_bias": 0.05,
    "imu.attitude_noise": 1e-3,
    "imu.position": [0.5, 0.1, -0.2],
    "sensors.seed": 7,
    "sensors.latitude_deg": 47.0,
    "sensors.height": 400.0,
    "gnss.rate": 20.0,
    "gnss.noise": 0.3,
    "gnss.latency": 0.02,
    "pressure.rate": 50.0,
    "pressure.resolution": 2.0,
    "magnetic.rate": 50.0,
    "magnetic.field": [2e-5, 1e-6, 4e-5],
    "range.rate": 25.0,
    "range.noise": 0.01,
    "battery.rate": 10.0,
    "battery.noise": 0.01,
}
TICKS = 20


def wanted():
    """What the library measures in the first ticks of the same flight."""
    aircraft = Aircraft.load(str(ELECTRIC))
    point = trim(aircraft)
    state = trimmed_state(aircraft, point, (0.0, 0.0, -20.0))
    simulation = Simulation(aircraft, state, aircraft.mix(point.controls), ground_altitude=0.0)
    suite = SensorSuite(aircraft, VALUES, Clock(simulation.step_size, simulation.steps_per_tick), 0.0)
    found = {name: [] for name in TOPICS}
    for _ in range(TICKS + 1):
        for one in suite.take(simulation.snapshot()):
            found[one.sensor].append(one)
        simulation.advance()
    return found


def vector(message):
    return [message.x, message.y, message.z]


def test_the_topics_are_what_the_library_measures(tmp_path):
    """In hover, recorded: values, axes, covariances, stamps."""
    log = tmp_path / "flight.mcap"
    with world(next(DOMAINS), tmp_path) as running:
        simulator = running.start(
            "simulator",
            aircraft=str(ELECTRIC), components="[simulator, recorder]", altitude=20.0, ground_altitude=0.0,
            record=str(log), real_time_factor=0.001, **VALUES,
        )  # fmt: skip
        client = running.client
        received = {name: client.watch(topic, kind) for name, (topic, kind) in TOPICS.items()}
        assert client.call(SetBool, "pause", data=True).success
        while client.call(Step, "step", ticks=1).sim_time < TICKS * 0.01 - 1e-6:
            pass
        client.until(lambda: received["imu"] and nanoseconds(received["imu"][-1]) >= 200_000_000, "the last sample")
        simulator.interrupt()
    found = wanted()
    recorded = read(log)
    for name, (topic, _) in TOPICS.items():
        expected = {round(one.time * 1e9): one for one in found[name]}
        assert received[name], name
        for message in received[name]:
            check(name, message, expected[nanoseconds(message)])
        assert len(recorded[f"/{topic}"].time) == len(found[name]), name
    assert verify(flight_of(recorded)).identical


def check(name, message, one):
    """A message against a measurement: FLU of FRD, ENU of NED."""
    values, variances = one.values, one.variances
    if name == "imu":
        assert message.header.frame_id == "imu_link"
        assert vector(message.angular_velocity) == pytest.approx([values[0], -values[1], -values[2]], abs=1e-12)
        assert vector(message.linear_acceleration) == pytest.approx([values[3], -values[4], -values[5]], abs=1e-9)
        assert message.linear_acceleration.z == pytest.approx(9.8, abs=1.0)
        assert message.angular_velocity_covariance[0] == pytest.approx(1e-6 * 100.0)
        assert message.linear_acceleration_covariance[8] == pytest.approx(0.05**2)
        # level and heading north: in ENU a quarter turn left of east
        turn = message.orientation
        assert [turn.w, turn.z] == pytest.approx([math.sqrt(0.5)] * 2, abs=0.05)
    elif name == "gnss":
        assert [message.latitude, message.longitude, message.altitude] == pytest.approx(values.tolist(), abs=1e-9)
        assert message.altitude == pytest.approx(420.0, abs=15.0)
        assert np.diag(np.reshape(message.position_covariance, (3, 3))) == pytest.approx(variances)
    elif name == "pressure":
        assert message.fluid_pressure == values[0]
        assert message.variance == pytest.approx(4.0 / 12.0)
    elif name == "magnetic":
        assert vector(message.magnetic_field) == pytest.approx([values[0], -values[1], -values[2]], abs=1e-15)
        assert message.magnetic_field.z < 0.0  # the field points down
    elif name == "range":
        assert message.range == pytest.approx(values[0], rel=1e-6)
        assert message.range == pytest.approx(20.0, abs=0.5)
    else:
        number, voltage, current, charge, capacity = values[0]
        assert (message.location, message.voltage) == (f"drive {number:.0f}", pytest.approx(voltage, rel=1e-6))
        assert message.current == pytest.approx(-current, rel=1e-5)
        assert [message.charge, message.capacity] == pytest.approx([charge, capacity], rel=1e-6)
        assert message.power_supply_status == BatteryState.POWER_SUPPLY_STATUS_DISCHARGING


def test_a_wrong_rate_ends_the_start_with_its_name(tmp_path):
    with world(next(DOMAINS), tmp_path) as running:
        simulator = running.start("simulator", record="off", **{"imu.rate": 30.0})
        assert simulator.wait() == 1
        assert "parameter imu.rate = 30: allowed are 100 Hz over an integer (publish_rate)" in simulator.output
