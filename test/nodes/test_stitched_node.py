"""The simulator with a stitched model: real processes, real DDS on loopback, a log that repeats bit for bit."""

import subprocess
import sys

import numpy as np
import pytest

rclpy = pytest.importorskip("rclpy")

from diagnostic_msgs.msg import DiagnosticArray  # noqa: E402
from geometry_msgs.msg import Vector3  # noqa: E402
from ros_harness import DOMAINS, EXECUTABLES, controls_message, environment, world  # noqa: E402

from sbs_msgs.msg import BodyState, SimulationStatus  # noqa: E402
from sbs_msgs.srv import EngineFailure, Reset, SetWind  # noqa: E402
from sbs_sim import Aircraft, trim  # noqa: E402
from sbs_sim.analysis.stitched import stitch  # noqa: E402
from sbs_sim.errors import SbsError  # noqa: E402
from sbs_sim.flight.stitched_file import save  # noqa: E402
from sbs_sim.flight.stitched_simulation import simulate_stitched  # noqa: E402
from sbs_sim.nodes.simulator import PARAMETERS, stitched_model  # noqa: E402
from sbs_sim.nodes.what_if import fly_with  # noqa: E402
from sbs_sim.recording import read  # noqa: E402
from sbs_sim.recording.recorded_flight import flight_of  # noqa: E402
from sbs_sim.recording.verification import verify  # noqa: E402

VALUES = {name: parameter.default for name, parameter in PARAMETERS.items()}


@pytest.fixture(scope="module")
def aircraft():
    return Aircraft.load("sbs")


@pytest.fixture(scope="module")
def made(aircraft, tmp_path_factory):
    """A stitched model, and its file."""
    path = tmp_path_factory.mktemp("stitched") / "model.npz"
    model = stitch(aircraft, [0.0, 2.0, 4.0, 6.0], states="body")
    save(model, path)
    return model, path


def test_a_flight_of_a_stitched_model(aircraft, made, tmp_path):
    """It flies from the trim, says what it is, refuses what it cannot do, and its log repeats it bit for bit."""
    model, path = made
    log_path = tmp_path / "flight.mcap"
    point = trim(aircraft, 4.0)
    pulse = point.controls + np.radians([0.0, 0.3, 0.2, 0.0])
    options = {"model": "stitched", "stitched_file": str(path), "airspeed": 4.0, "record": str(log_path)}
    with world(next(DOMAINS), tmp_path) as running:
        client = running.client
        states, health = client.watch("state", BodyState), client.watch("diagnostics", DiagnosticArray)
        client.watch("status", SimulationStatus)
        simulator = running.start("simulator", real_time_factor=5.0, command_timeout=0.0, **options)
        assert client.next("status").model == "stitched"
        client.publish_until(
            "controls", controls_message(pulse), "state", lambda state: state.angular_velocity.x > 0.01
        )
        refused = client.call(EngineFailure, "engine_failure", drive=1, failure=1.0)
        assert not refused.success
        assert "no engines" in refused.message
        profile = {"wind_profile": "logarithmic", "reference_height": 6.0, "roughness_length": 0.1}
        refused = client.call(SetWind, "set_wind", velocity=Vector3(x=3.0), **profile)
        assert not refused.success
        assert "same everywhere" in refused.message
        refused = client.call(Reset, "reset", airspeed=20.0)
        assert not refused.success
        assert "airspeed of the stitched model = 20.0: allowed are 0 to 6 m/s" in refused.message
        assert client.call(Reset, "reset", airspeed=2.0).success

        def said():
            values = [item for message in health for item in message.status[0].values]
            return [item.value for item in values if item.key == "model"]

        client.until(said, "diagnostics of the simulator")
        assert set(said()) == {"stitched"}
        assert len(states) > 10
        simulator.interrupt()
    flight = flight_of(read(log_path))
    assert flight.options["model"] == model
    assert verify(flight).identical
    verdict = subprocess.run(
        [sys.executable, EXECUTABLES / "replay", "--verify", log_path],
        check=True, capture_output=True, text=True, env=environment(0),
    )  # fmt: skip
    assert "identical" in verdict.stdout
    assert "stitched model" in verdict.stdout
    with pytest.raises(SbsError, match="stitched model"):
        fly_with(flight, ["body.mass=21"], int(flight.steps[-1]), tmp_path / "changed.mcap")
    # what was flown before the first command is what the library flies
    held = next(event for event in flight.events if event.kind != "start").step
    own = simulate_stitched(model, point, point.controls, 1.0)["state"]
    count = min(int(np.count_nonzero(flight.steps <= held)), len(own))
    assert flight.states[:count, 3:] == pytest.approx(own[:count, 3:], abs=1e-9)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"model": "linear"}, "parameter model = 'linear': allowed are full, stitched"),
        ({"stitched_file": "model.npz"}, "allowed with model = stitched"),
        ({"model": "stitched", "method": "etd"}, "parameter method = 'etd'"),
        ({"model": "stitched", "stitched_file": "none.npz"}, "cannot be read"),
        ({"model": "stitched", "stitched_airspeeds": [2.0]}, "airspeeds has shape"),
    ],
)
def test_wrong_parameters_are_refused(aircraft, values, message):
    with pytest.raises(SbsError, match=message):
        stitched_model(VALUES | values, aircraft)


def test_a_file_of_another_aircraft_is_refused(aircraft, made):
    with pytest.raises(SbsError, match="another aircraft"):
        stitched_model(
            VALUES | {"model": "stitched", "stitched_file": str(made[1])}, aircraft.with_value("body.mass", 21.0)
        )


def test_it_is_stitched_at_the_start_without_a_file(aircraft):
    values = VALUES | {"model": "stitched", "stitched_airspeeds": [0.0, 3.0], "stitched_states": "body"}
    assert stitched_model(values, aircraft) == stitch(aircraft, [0.0, 3.0], states="body")
    assert stitched_model(VALUES, aircraft) is None
