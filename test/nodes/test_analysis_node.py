"""The analysis as its clients meet it: real processes, real DDS on loopback, beside a simulator in flight."""

import math
import os
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

rclpy = pytest.importorskip("rclpy")

from action_msgs.msg import GoalStatus  # noqa: E402
from ros_harness import DOMAINS, PATIENCE, Client, world  # noqa: E402

from sbs_msgs.action import Sweep  # noqa: E402
from sbs_msgs.msg import BodyState, LinearModel, SimulationStatus, TrimPoint  # noqa: E402
from sbs_msgs.srv import Linearize, Trim  # noqa: E402
from sbs_sim import Aircraft, Simulation, linearize, trim  # noqa: E402
from sbs_sim.analysis.linear_model import growing_rotor_modes_text  # noqa: E402
from sbs_sim.flight.trim_point import TrimCondition  # noqa: E402
from sbs_sim.flight.trimmed_state import trimmed_state  # noqa: E402
from sbs_sim.flight_loop import FlightLoop  # noqa: E402
from sbs_sim.model import state as S  # noqa: E402
from sbs_sim.nodes.remote_pilot import RemotePilot  # noqa: E402

LONG = [0.02 * i for i in range(1000)]  # values of a sweep of half a minute, and more where others are busy
TURN = {"airspeed": 12.0, "climb_rate": 1.0, "sideslip": 0.1, "turn_rate": 0.2}
WEIGHT = 20.62 * 9.80665  # N


@pytest.fixture(scope="module")
def aircraft():
    return Aircraft.load("sbs")


@pytest.fixture(scope="module")
def flight(tmp_path_factory):
    """A simulator in flight, and a client."""
    with world(next(DOMAINS), tmp_path_factory.mktemp("analysis")) as made:
        made.client.watch("status", SimulationStatus)
        made.simulator = made.start("simulator")
        made.client.next("status")
        yield made


@pytest.fixture
def client(flight):
    """The client; the flight must go on whatever it does."""
    before = flight.client.next("status")
    yield flight.client
    after = flight.client.next("status", lambda m: m.sim_time > before.sim_time)
    assert after.state == SimulationStatus.PLAYING
    assert after.fault == ""


@pytest.fixture
def own_world(tmp_path):
    with world(next(DOMAINS), tmp_path) as made:
        yield made


def check_trim(message, point):
    """Compare every field of a message with a trim of the library."""
    for name in ("airspeed", "climb_rate", "sideslip", "turn_rate"):
        assert getattr(message.condition, name) == getattr(point.condition, name)
    for name in ("lead_lag", "cyclic_inflow", "azimuth_count", "method"):
        assert getattr(message.condition, name) == getattr(point, name)
    for name in ("pitch", "roll", "residual", "iterations", "inner_iterations"):
        assert getattr(message, name) == getattr(point, name)
    assert [getattr(message.controls, name) for name in S.CONTROL_NAMES] == point.controls.tolist()
    assert [[getattr(row, name) for name in S.SWASHPLATE_NAMES] for row in message.swashplate] == (
        point.swashplate.tolist()
    )
    assert tuple(message.state_names) == point.state_names
    np.testing.assert_array_equal(message.state, point.state)
    assert message.thrust == point.thrust.sum()
    assert message.power == point.power.sum()
    assert tuple(message.beyond_limits) == point.beyond_limits
    assert tuple(message.warnings) == point.warnings
    by_name = dict(zip(point.state_names, point.state, strict=True))
    for j, (rotor, inflow) in enumerate(zip(message.rotors, message.inflow, strict=True), 1):
        np.testing.assert_array_equal(rotor.flap, [by_name[f"{name}({j})"] for name in ("a0", "a1", "b1")])
        np.testing.assert_array_equal(rotor.flap_rate, 0.0)
        assert inflow.uniform == by_name[f"lambda0({j})"]
        assert rotor.thrust == pytest.approx(point.thrust[j - 1], rel=1e-12)
        assert rotor.torque == pytest.approx(point.torque[j - 1], rel=1e-12)
        assert rotor.power == pytest.approx(point.power[j - 1], rel=1e-12)
        assert rotor.azimuth == 0.0
        # the first blade is aft: beta = a0 - a1
        assert rotor.blade_flap[0] == pytest.approx(rotor.flap[0] - rotor.flap[1], abs=1e-15)


def check_model(message, model):
    """Compare every field of a message with a linear model of the library."""
    for name in ("state", "control", "output"):
        assert tuple(getattr(message, f"{name}_names")) == getattr(model, f"{name}_names")
        assert tuple(getattr(message, f"{name}_units")) == getattr(model, f"{name}_units")
    for name in ("a", "b", "c", "d", "steps"):
        matrix = getattr(model, name)
        np.testing.assert_array_equal(np.reshape(getattr(message, name), matrix.shape), matrix)
    for name in ("azimuth_spread", "method", "parameter_hash"):
        assert getattr(message, name) == getattr(model, name)
    check_trim(message.trim, model.trim)
    assert [mode.name for mode in message.modes] == [mode.name for mode in model.modes]
    for got, mode in zip(message.modes, model.modes, strict=True):
        assert complex(got.real, got.imag) == pytest.approx(mode.pole, rel=1e-9, abs=1e-9)
        for name in ("frequency", "damping", "time_to_half", "time_to_double"):
            assert getattr(got, name) == pytest.approx(getattr(mode, name), rel=1e-6)
        np.testing.assert_allclose(got.participation, mode.participation, atol=1e-9)
    blocks = {block.name: np.reshape(block.data, (block.rows, block.columns)) for block in message.blocks}
    assert blocks.keys() == model.blocks.keys()
    for name, matrix in model.blocks.items():
        np.testing.assert_array_equal(blocks[name], matrix)


# --- services ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "request_fields",
    [
        {},
        TURN,
        {"airspeed": -4.0, "lead_lag": False, "azimuth_count": 24},
        {"cyclic_inflow": False},
        {"method": "two_loop"},
        {"airspeed": 50.0},
    ],
)
def test_trim_is_the_librarys(client, aircraft, request_fields):
    expected = trim(aircraft, **request_fields)  # first: it may have to compile
    answer = client.call(Trim, "trim", **request_fields)
    assert answer.success, answer.message
    check_trim(answer.trim, expected)


def test_the_forces_of_a_trimmed_hover_carry_the_weight(client):
    found = client.call(Trim, "trim").trim
    assert found.thrust == pytest.approx(WEIGHT, rel=1e-3)
    for rotor in found.rotors:
        # what the hub takes of the thrust is left when it has carried its blades
        assert rotor.hub.force.z == pytest.approx(-rotor.thrust + 3 * 0.1613 * 9.80665, rel=1e-3)


def test_answers_say_where_the_model_does_not_hold(client):
    ring = [f"{name}: vortex ring state, where momentum theory does not hold" for name in ("MR1", "MR2")]
    found = client.call(Trim, "trim", climb_rate=-7.0)
    assert found.warnings == found.trim.warnings == ring
    found = client.call(Linearize, "linearize", climb_rate=-7.0)
    assert found.warnings == found.model.warnings == found.model.trim.warnings == ring
    goal = client.send_goal(Sweep, "sweep", parameter="climb_rate", values=[0.0, -7.0], linear=False)
    _, result = goal.end()
    assert [point.warnings for point in result.points] == [[], ring]
    assert sorted(feedback.last_warnings for feedback in goal.feedback) == [[], ring]
    assert client.call(Trim, "trim").warnings == client.call(Linearize, "linearize").warnings == []


def test_the_answers_to_the_cockpit_say_so_too(flight):
    page, done = Client(flight.domain, "page"), threading.Event()
    pilot = RemotePilot(page.node)

    def serve():
        while not done.is_set():
            page.spin(0.05)

    server = threading.Thread(target=serve)
    server.start()
    try:
        end = time.monotonic() + PATIENCE
        while pilot.trim(TrimCondition())[0] is None or pilot.linearize(TrimCondition())[0] is None:
            assert time.monotonic() < end
            time.sleep(0.05)  # the services have not been discovered yet
        reported = [ask(TrimCondition(0.0, -7.0)) for ask in (pilot.trim, pilot.linearize)]
    finally:
        done.set()
        server.join()
        page.close()
    for trimmed, text in reported:
        assert text == ""
        assert trimmed.notes == tuple(
            f"outside the model's validity: {name}: vortex ring state, where momentum theory does not hold"
            for name in ("MR1", "MR2")
        )


def test_a_trim_beyond_the_limits_is_reported(client):
    found = client.call(Trim, "trim", airspeed=50.0)
    assert found.success
    assert "collective = " in found.trim.beyond_limits[0]


@pytest.mark.parametrize(
    "request_fields",
    [{}, TURN, {"lead_lag": False, "cyclic_inflow": False, "azimuth_count": 6}, {"method": "paper", "airspeed": 5.0}],
)
def test_linearize_is_the_librarys(client, aircraft, request_fields):
    answer = client.call(Linearize, "linearize", **request_fields)
    assert answer.success, answer.message
    model = linearize(aircraft, **request_fields)
    assert bool(answer.model.blocks) == (request_fields.get("method") == "paper")
    check_model(answer.model, model)
    growing = growing_rotor_modes_text(model, aircraft)
    assert answer.message == ("linearized" if growing == "none" else f"linearized; growing rotor modes: {growing}")


def test_clients_that_call_at_once_all_get_the_same(flight, client):
    others = [Client(flight.domain) for _ in range(4)]
    try:
        asked = []
        for other in others:
            for kind, name in ((Linearize, "linearize"), (Trim, "trim")):
                service = other.node.create_client(kind, name)
                other.until(service.service_is_ready, name)
                asked.append((other, service))
        futures = [(other, service.call_async(service.srv_type.Request(**TURN))) for other, service in asked]
        answers = [other.until(lambda f=future: f.done() and f.result(), "an answer") for other, future in futures]
    finally:
        for other in others:
            other.close()
    assert all(answer.success for answer in answers)
    assert all(answer.model == answers[0].model for answer in answers[0::2])
    assert all(answer.trim == answers[1].trim for answer in answers[1::2])
    assert answers[0].model.trim == answers[1].trim


@pytest.mark.parametrize(
    ("kind", "name", "request_fields", "said"),
    [
        (Trim, "trim", {"airspeed": math.nan}, "airspeed = nan: allowed are -100 to 100 m/s"),
        (Trim, "trim", {"turn_rate": math.inf}, "turn_rate = inf: allowed are -3 to 3 rad/s"),
        (Trim, "trim", {"azimuth_count": -3}, "azimuth_count = -3: allowed are"),
        (Trim, "trim", {"azimuth_count": 1001}, "1 to 1000"),
        (Trim, "trim", {"method": "guess"}, "method = 'guess': allowed are newton, two_loop"),
        (Trim, "trim", {"method": ""}, "method = '': allowed are newton, two_loop"),
        (Trim, "trim", {"airspeed": 95.0}, "no trim"),
        (Linearize, "linearize", {"climb_rate": math.nan}, "climb_rate = nan: allowed are -50 to 50 m/s"),
        (Linearize, "linearize", {"azimuth_count": 0}, "azimuth_count = 0: allowed are"),
        (Linearize, "linearize", {"method": "newton"}, "method = 'newton': allowed are averaged, paper"),
        (Linearize, "linearize", {"airspeed": 95.0}, "no trim"),
    ],
)
def test_bad_requests_are_refused_and_change_nothing(client, kind, name, request_fields, said):
    trims, models = latched(client)
    before = len(trims), len(models)
    answer = client.call(kind, name, **request_fields)
    assert not answer.success
    assert said in answer.message
    assert "\n" not in answer.message
    empty = kind.Response(success=False, message=answer.message)
    assert answer == empty
    client.spin(0.2)
    assert (len(trims), len(models)) == before


def latched(client):
    """Messages of the latched topics, watched from the first call on."""
    if "trim_point" not in client.messages:
        trims = client.watch("trim_point", TrimPoint, latched=True)
        models = client.watch("linear_model", LinearModel, latched=True)
        # What was published before comes late, but not later than this.
        assert client.call(Trim, "trim", airspeed=1.25).success
        assert client.call(Linearize, "linearize", airspeed=1.25).success
        client.until(lambda: trims and trims[-1].condition.airspeed == 1.25, "the trim")
        client.until(lambda: models and models[-1].trim.condition.airspeed == 1.25, "the model")
    return client.messages["trim_point"], client.messages["linear_model"]


def test_the_latest_results_wait_for_a_late_subscriber(flight, client):
    for speed in (3.0, 6.0):
        point = client.call(Trim, "trim", airspeed=speed).trim
        model = client.call(Linearize, "linearize", airspeed=speed + 1.0).model
    assert not client.call(Trim, "trim", airspeed=math.nan).success
    late = Client(flight.domain)
    try:
        trims = late.watch("trim_point", TrimPoint, latched=True)
        models = late.watch("linear_model", LinearModel, latched=True)
        late.until(lambda: trims and models, "latched messages")
        late.spin(0.2)
    finally:
        late.close()
    assert trims == [point]
    assert models == [model]


# --- sweeps -----------------------------------------------------------------------------------------------------


def test_a_sweep_reports_every_point_and_goes_on_where_there_is_no_trim(client, aircraft):
    values = [0.0, 5.0, 95.0, 10.0]
    goal = client.send_goal(Sweep, "sweep", values=values, climb_rate=0.5, azimuth_count=6)
    status, result = goal.end()
    assert status == GoalStatus.STATUS_SUCCEEDED
    assert result.success
    assert result.message == "3 of 4 points have a result"
    assert [point.value for point in result.points] == values
    assert [point.success for point in result.points] == [True, True, False, True]
    assert "no trim" in result.points[2].message
    for point in result.points:
        if point.success:
            model = linearize(aircraft, airspeed=point.value, climb_rate=0.5, azimuth_count=6)
            check_model(point.model, model)
            assert point.trim == point.model.trim
        else:
            assert point.trim == TrimPoint()
            assert point.model == LinearModel()
    client.until(lambda: len(goal.feedback) == 4, "feedback")
    assert [feedback.done for feedback in goal.feedback] == [1, 2, 3, 4]
    assert {feedback.total for feedback in goal.feedback} == {4}
    assert {feedback.last_value for feedback in goal.feedback} == set(values)
    failed = [feedback for feedback in goal.feedback if not feedback.last_success]
    assert [(feedback.last_value, feedback.last_message) for feedback in failed] == [(95.0, result.points[2].message)]


def test_a_sweep_of_another_parameter_without_models(client, aircraft):
    goal = client.send_goal(Sweep, "sweep", parameter="turn_rate", values=[0.0, 0.3], airspeed=8.0, linear=False)
    status, result = goal.end()
    assert status == GoalStatus.STATUS_SUCCEEDED
    check_trim(result.points[1].trim, trim(aircraft, airspeed=8.0, turn_rate=0.3))
    assert result.points[1].model == LinearModel()


def test_a_sweep_of_a_value_of_the_aircraft_file(client, aircraft):
    goal = client.send_goal(Sweep, "sweep", parameter="rotors.speed_rpm", values=[2500.0])
    _, result = goal.end()
    assert result.success, result.message
    other = aircraft.with_value("rotors.speed_rpm", 2500.0)
    check_model(result.points[0].model, linearize(other))
    assert result.points[0].trim.rotors[0].speed == other.rotors[0].speed != aircraft.rotors[0].speed


def test_a_sweep_is_cancelled_promptly_and_others_are_served_meanwhile(client):
    goal = client.send_goal(Sweep, "sweep", values=LONG)
    client.until(lambda: len(goal.feedback) >= 3, "feedback")
    assert client.call(Trim, "trim").success
    assert client.call(Linearize, "linearize").success
    begin = time.monotonic()
    assert len(goal.cancel().goals_canceling) == 1
    status, result = goal.end()
    assert time.monotonic() - begin < 20.0  # it would go on for half a minute
    assert status == GoalStatus.STATUS_CANCELED
    assert not result.success
    visited = sum(point.message != "cancelled" for point in result.points)
    assert 3 <= visited < len(LONG)
    assert result.message == f"cancelled after {visited} of {len(LONG)} points"
    assert [point.value for point in result.points] == LONG
    # the next one begins at once
    assert client.send_goal(Sweep, "sweep", values=[1.0]).end()[0] == GoalStatus.STATUS_SUCCEEDED


def test_there_is_one_sweep_at_a_time(client):
    first = client.send_goal(Sweep, "sweep", values=LONG)
    status, result = client.send_goal(Sweep, "sweep", values=[1.0]).end()
    assert status == GoalStatus.STATUS_ABORTED
    assert result.message == "another sweep is under way: cancel it, or wait for its end"
    first.cancel()
    assert first.end()[0] == GoalStatus.STATUS_CANCELED


@pytest.mark.parametrize(
    ("goal_fields", "said"),
    [
        ({"parameter": "bank", "values": [1.0]}, "allowed are airspeed, climb_rate, sideslip, turn_rate"),
        ({"values": []}, "values"),
        ({"values": [1.0, math.nan]}, "values[1] = nan"),
        ({"values": [1.0], "airspeed": 5.0}, "airspeed = 5.0: not allowed where airspeed is swept"),
        ({"values": [0.0] * 1001}, "values: 1001 of them, allowed are 1 to 1000"),
    ],
)
def test_a_wrong_goal_is_reported_in_one_line(client, goal_fields, said):
    status, result = client.send_goal(Sweep, "sweep", **goal_fields).end()
    assert status == GoalStatus.STATUS_ABORTED
    assert not result.success
    assert said in result.message
    assert "\n" not in result.message
    assert len(result.points) == 0


# --- processes of their own -------------------------------------------------------------------------------------


def test_alone_it_serves_the_aircraft_of_its_parameter(own_world):
    process = own_world.start("analysis", aircraft="sbs_paper")
    answer = own_world.client.call(Linearize, "linearize", method="paper")
    assert answer.success, answer.message
    check_model(answer.model, linearize(Aircraft.load("sbs_paper"), method="paper"))
    assert process.interrupt() == 0
    assert process.output == ""


def test_the_simulator_flies_without_it(own_world):
    process = own_world.start("simulator", components="[simulator, control_mixer]")
    own_world.client.watch("state", BodyState)
    own_world.client.next("state")
    names = [name for name, _ in own_world.client.node.get_service_names_and_types()]
    assert "/reset" in names
    assert "/trim" not in names
    assert process.running


@pytest.mark.parametrize("name", ["simulator", "analysis"])
def test_an_interruption_ends_a_sweep(own_world, name):
    process = own_world.start(name)
    goal = own_world.client.send_goal(Sweep, "sweep", values=LONG)
    own_world.client.until(lambda: goal.feedback, "feedback")
    begin = time.monotonic()
    assert process.interrupt() == 0
    assert time.monotonic() - begin < 20.0
    assert "Traceback" not in process.output
    assert "rror" not in process.output


def test_an_interruption_does_not_wait_for_a_long_computation(own_world):
    process = own_world.start("analysis")
    client = own_world.client
    service = client.node.create_client(Trim, "trim")
    client.until(service.service_is_ready, "trim")
    service.call_async(Trim.Request(airspeed=95.0, azimuth_count=1000))  # half a minute of arithmetic
    client.spin(0.5)
    begin = time.monotonic()
    assert process.interrupt() == 0
    assert time.monotonic() - begin < 20.0
    assert "Traceback" not in process.output


def test_an_error_of_ours_is_reported_and_ends_nothing(monkeypatch, aircraft):
    from sbs_sim.nodes import analysis

    def broken(*_, **__):
        raise RuntimeError("nobody thought of this")

    rclpy.init(domain_id=next(DOMAINS))
    flight = Simulation(aircraft, trimmed_state(aircraft, trim(aircraft)), trim(aircraft).swashplate)
    node = analysis.Analysis(FlightLoop(flight))
    try:
        monkeypatch.setattr(analysis, "linearize_trim", broken)
        answer = node._on_linearize(Linearize.Request(), Linearize.Response())
        assert not answer.success
        assert answer.message == "internal error, see the log: RuntimeError('nobody thought of this')"
        monkeypatch.undo()
        assert node._on_linearize(Linearize.Request(), Linearize.Response()).success
    finally:
        node.destroy_node()
        rclpy.shutdown()


def test_numpy_does_not_take_the_cores_of_the_flight():
    code = "import os, sbs_sim.nodes.executables; print(os.environ['OPENBLAS_NUM_THREADS'])"
    environment = {key: value for key, value in os.environ.items() if key != "OPENBLAS_NUM_THREADS"}
    for given, kept in (({}, "1"), ({"OPENBLAS_NUM_THREADS": "3"}, "3")):
        shown = subprocess.run(
            [sys.executable, "-c", code], env=environment | given, capture_output=True, text=True, check=True
        )
        assert shown.stdout.strip() == kept
