"""ArduPilot's interface with a stand-in that speaks it from its description: packets, servos, lock-step."""

import json
import math
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import pytest
from autopilot import EXAMPLE, Autopilot, HoverPilot, packet, parameters, plate, transverse
from scipy.integrate import trapezoid

pytest.importorskip("rclpy")

from ros_harness import DOMAINS, EXECUTABLES, world

from sbs_msgs.msg import BodyState, ServoFrame
from sbs_sim import Aircraft, trim
from sbs_sim.ardupilot.bridge import Bridge
from sbs_sim.ardupilot.parameters import FREQUENCIES, parameter_lines, velocity_loop
from sbs_sim.ardupilot.protocol import servo_frame, state_line
from sbs_sim.ardupilot.servos import Head, Output, Servos
from sbs_sim.errors import ArduPilotError
from sbs_sim.flight.contact import state_on_ground
from sbs_sim.flight.records import Motion
from sbs_sim.flight.simulation import Simulation
from sbs_sim.flight.trimmed_state import trimmed_state
from sbs_sim.lockstep import LockstepLoop
from sbs_sim.model import state as S
from sbs_sim.model.frames import rotation_matrix
from sbs_sim.model.wind import Wind
from sbs_sim.recording import read
from sbs_sim.recording.recorded_flight import flight_of
from sbs_sim.recording.verification import verify
from sbs_sim.sensors.batteries import Batteries
from sbs_sim.sensors.truth import range_down, specific_force

ELECTRIC = Path(__file__).resolve().parents[1] / "data" / "electric.yaml"
REST = [1250] * 6 + [0] * 10  # blades at zero pitch


# -- packets -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("channels", [16, 32])
def test_packets_of_both_sizes_are_read(channels):
    pulses = list(range(1000, 1000 + channels))
    frame = servo_frame(packet(2**32 - 1, pulses, rate=800))
    assert (frame.rate, frame.count, list(frame.pulses)) == (800, 2**32 - 1, pulses)


@pytest.mark.parametrize(
    ("data", "text"),
    [
        (b"", "packet of 0 bytes: allowed are 40 and 72"),
        (packet(1, [1500] * 16)[:-1], "packet with magic number 18458 of 39 bytes: allowed are 40"),
        (packet(1, [1500] * 32) + b"x", "packet with magic number 29569 of 73 bytes: allowed are 72"),
        (b"\0" * 40, "packet with magic number 0: allowed are 18458 and 29569"),
    ],
)
def test_what_is_no_packet_is_refused_with_what_is_allowed(data, text):
    with pytest.raises(ArduPilotError, match=text):
        servo_frame(data)


# -- servos ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["h1", "h3_120", "h3_140", "h4_90", "h4_45"])
def test_a_plate_gives_back_what_ardupilot_mixes_into_its_servos(kind):
    """Blade pitch is the travel times the gain; a full output of roll or pitch is 0.45 of the travel."""
    craft = Aircraft.load("sbs")
    pulses = plate(kind, 0.3, -0.4, 0.5)
    head = Head("MR1", tuple(range(1, len(pulses) + 1)), kind, (math.radians(-8.0), math.radians(24.0)), 1, -1)
    angles = np.degrees(Servos(craft, [head]).angles([*pulses, *[0] * (16 - len(pulses))]))
    assert angles[0] == pytest.approx([8.0, 32.0 * 0.45 * 0.3, 32.0 * 0.45 * 0.4], abs=0.04)  # a pulse is 0.032 deg
    assert np.array_equal(angles[1], np.zeros(3))  # no servo moves it


def test_a_servo_without_a_pulse_leaves_its_plate_at_rest_and_angles_stay_within_their_ranges():
    craft = Aircraft.load("sbs")
    servos = Servos.load(craft, str(EXAMPLE))
    assert np.array_equal(servos.angles([0, *REST[1:]])[0], np.zeros(3))
    high = servos.angles([2200] * 16)
    assert np.degrees(high[:, 0]) == pytest.approx([20.0, 20.0])  # 24 deg is beyond the range of the collective
    with pytest.raises(ArduPilotError, match=r"packet with 4 channels: allowed are at least 6"):
        servos.angles([1500] * 4)


def test_a_single_output_commands_a_number_and_none_is_commanded_twice():
    craft = Aircraft.load("sbs")
    output = Output("MR2", "collective", 7, (0.0, 0.2))
    assert Servos(craft, [], [output]).angles([1500] * 16)[1] == pytest.approx([0.1, 0.0, 0.0])
    with pytest.raises(ArduPilotError, match="MR2 collective: commanded twice"):
        Servos(craft, [], [output, output])
    with pytest.raises(ArduPilotError, match="MR3 collective: unknown, allowed are MR1 collective"):
        Servos(craft, [], [output._replace(owner="MR3")])


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        ("channels: [1, 2, 3]", "channels: [1, 2]", r"heads\[0\].channels .* allowed is a list of at least 3"),
        ("channels: [1, 2, 3]", "channels: [1, 2, 33]", r"heads\[0\].channels\[2\] = 33: allowed is <= 32"),
        ("swashplate: h3_120  ", "swashplate: h4_90  ", "MR1 has 3 channels: allowed for h4_90 are 4"),
        ("rotor: MR2", "rotor: MR9", "MR9 collective: unknown"),
        ("outputs: []", "outputs: [{owner: MR1, name: collective, channel: 1}]", r"outputs\[0\]"),
        ("frame: transverse", "frame: [", "not readable as YAML"),
    ],
)
def test_a_wrong_servo_file_is_refused_with_its_key(tmp_path, old, new, text):
    content = EXAMPLE.read_text()
    assert old in content
    path = tmp_path / "servos.yaml"
    path.write_text(content.replace(old, new))
    with pytest.raises(ArduPilotError, match=text):
        Servos.load(Aircraft.load("sbs"), str(path))


# -- lock-step ---------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def craft():
    return Aircraft.load("sbs").with_values({"ground.contact": "contact", "options.elements": 8})


@pytest.fixture(scope="module")
def lines(craft):
    return parameter_lines(craft, Servos.load(craft, str(EXAMPLE)))


@pytest.fixture
def flight(craft):
    """A flight that waits for an autopilot, and the autopilot."""
    lines = []
    bridge = Bridge(0, lines.append)
    state = state_on_ground(craft, 0.0)
    simulation = Simulation(craft, state, craft.mix(craft.resting_controls), tick=1 / 400, ground_altitude=0.0)
    loop = LockstepLoop(simulation, bridge, Servos.load(craft, str(EXAMPLE)), every=8)
    loop.lines = lines
    reader = threading.Thread(target=lambda: [None for _ in iter(loop.reports.get, None)], daemon=True)
    reader.start()
    loop.start()
    autopilot = Autopilot(bridge.port)
    yield loop, autopilot
    autopilot.close()
    loop.stop()


def test_a_frame_is_a_tick_and_sensors_see_an_aircraft_at_rest(flight):
    _, autopilot = flight
    for i in range(1, 401):
        seen = autopilot.frame(REST)
        assert seen["timestamp"] == pytest.approx(i / 400)
    assert seen["imu"]["accel_body"] == pytest.approx([0.0, 0.0, -9.80665], abs=2e-3)
    assert seen["imu"]["gyro"] == pytest.approx([0.0, 0.0, 0.0], abs=1e-3)
    assert seen["quaternion"] == pytest.approx([1.0, 0.0, 0.0, 0.0], abs=1e-3)
    assert seen["rng_1"] == pytest.approx(-seen["position"][2])
    assert seen["rng_1"] == pytest.approx(0.29, abs=2e-3)  # skids 0.30 m below the c.g., pressed in by 10 mm


def test_what_sensors_see_is_what_a_snapshot_has(flight):
    """Of an aircraft that hangs in its rotors in a wind: the loop has stopped, so its simulation may be looked at."""
    loop, autopilot = flight
    loop.set_wind(lambda now: Wind((3.0, -2.0, 0.0)))
    for _ in range(200):
        seen = autopilot.frame(transverse(0.02, 0.01, 0.0, 0.60))
    loop.stop()
    now = loop._simulation.snapshot()
    assert seen["imu"]["accel_body"] == pytest.approx(specific_force(now, 9.80665), abs=1e-9)
    assert seen["imu"]["gyro"] == now.state[10:13].tolist()
    assert seen["velocity"] == pytest.approx(rotation_matrix(now.state[3:7]) @ now.state[7:10])
    assert seen["velocity_wind"] == [3.0, -2.0, 0.0]
    assert seen["rng_1"] == pytest.approx(range_down(now, 0.0))
    assert "battery" not in seen  # it has none


def test_the_battery_loses_the_charge_that_it_gives():
    """Its voltage falls from 50 to 42 V over a charge of 16 A h, along with the integral of the current."""
    craft = Aircraft.load(str(ELECTRIC))
    point = trim(craft, 0.0)
    simulation = Simulation(
        craft, trimmed_state(craft, point, (0.0, 0.0, 0.0), 0.0), craft.mix(point.controls), tick=1 / 400
    )
    batteries, seen = Batteries(craft), []
    for _ in range(201):
        seen.append(json.loads(state_line(simulation.motion(), simulation.time, 0.0, batteries))["battery"])
        simulation.advance()
    voltage, current = (np.array([one[name] for one in seen]) for name in ("voltage", "current"))
    lost = 16.0 * 3600.0 * (voltage[0] - voltage[-1]) / 8.0
    assert trapezoid(current, dx=1 / 400) == pytest.approx(lost, rel=1e-4)
    # the motor turns at 2400 rpm by 37.7 V of back-EMF: what the rotors take, and its losses, come from the battery
    power = point.power.sum()
    assert voltage[0] * current[0] > power


def test_of_several_batteries_the_weakest_voltage_and_all_the_current_are_shown():
    craft = Aircraft.load("quadrotor")  # four of 16.8 to 14 V and 0.45 A h, one for each motor
    state, rates = np.zeros(craft.layout.size), np.zeros(craft.layout.size)
    state[S.ATTITUDE] = 1.0
    for i, (used, share) in enumerate([(0.1, 1.0), (0.5, 2.0), (0.2, 3.0), (0.0, 4.0)]):
        place = craft.layout.drive(i)["discharge"]
        state[place], rates[place] = used, share / (0.45 * 3600.0)
    seen = json.loads(state_line(Motion(state, np.zeros(3), np.zeros(3), rates), 0.0, 0.0, Batteries(craft)))
    assert seen["battery"] == pytest.approx({"voltage": 15.4, "current": 10.0})


def test_what_is_repeated_is_answered_again_and_not_flown_again(flight):
    loop, autopilot = flight
    first = autopilot.frame(REST)
    assert autopilot.frame(REST, count=autopilot.count) == first
    assert autopilot.frame(REST)["timestamp"] == pytest.approx(2 / 400)
    counts = {"frames": 2, "repeated": 1, "lost": 0, "malformed": 0, "foreign": 0, "starts": 1}
    assert loop.values() == counts


def test_frames_that_are_lost_or_no_packets_do_not_stop_the_flight(flight):
    loop, autopilot = flight
    autopilot.frame(REST)
    for wrong in (b"", b"nothing", b"\xff" * 2000, packet(1, [1500] * 16)[:20]):
        autopilot.send(wrong)
    assert autopilot.frame(REST, count=5)["timestamp"] == pytest.approx(2 / 400)
    counts = loop.values()
    assert (counts["lost"], counts["malformed"]) == (4, 4)
    assert len(loop.lines) == 5  # the start, and each fault once


def test_another_autopilot_is_not_heard_while_one_flies(flight):
    loop, autopilot = flight
    autopilot.frame(REST)
    other = Autopilot(autopilot.address[1])
    other.send(packet(0, [2000] * 16))
    assert other.silent()
    other.close()
    assert autopilot.frame(REST)["timestamp"] == pytest.approx(2 / 400)
    assert loop.values()["foreign"] == 1


def test_a_count_that_goes_back_puts_the_aircraft_back(flight):
    _, autopilot = flight
    start = autopilot.frame(REST)
    for _ in range(400):
        moved = autopilot.frame(transverse(0.0, 0.0, 0.0, 0.62))
    assert moved["position"][2] < start["position"][2] - 0.3
    again = autopilot.frame(REST, count=0)
    assert again["timestamp"] == pytest.approx(1 / 400)
    assert again["position"] == pytest.approx(start["position"], abs=1e-6)


def roll_over(autopilot):
    """Fly until a rotor touches the ground, and no answer comes."""
    for _ in range(4000):
        autopilot.frame(transverse(1.0, 0.0, 0.0, 0.6))


def test_after_a_crash_an_autopilot_that_starts_anew_flies_again(flight):
    _, autopilot = flight
    autopilot.socket.settimeout(1.0)
    with pytest.raises(TimeoutError):
        roll_over(autopilot)
    autopilot.socket.settimeout(20.0)
    assert autopilot.frame(REST, count=0)["timestamp"] == pytest.approx(1 / 400)


def test_a_paused_flight_does_not_answer_and_goes_on_with_the_frame_that_waits(flight):
    loop, autopilot = flight
    autopilot.frame(REST)
    loop.pause(True)
    for _ in range(3):  # as ArduPilot does, which hears nothing
        autopilot.send(packet(autopilot.count + 1, REST))
    assert autopilot.silent()
    loop.pause(False)
    assert autopilot.answer()["timestamp"] == pytest.approx(2 / 400)
    assert autopilot.silent()  # one answer: a second would be taken for that to the next frame


def test_other_commands_are_refused(flight):
    loop, _ = flight
    with pytest.raises(Exception, match="ArduPilot flies"):
        loop.command(np.zeros((2, 3)))


@pytest.mark.parametrize(
    ("outputs", "index", "sign"),
    [((0.2, 0.0, 0.0), 0, 1), ((0.0, 0.1, 0.0), 1, 1), ((0.0, 0.0, 0.5), 2, 1)],
    ids=["roll to the right", "nose up", "nose to the right"],
)
def test_outputs_turn_the_aircraft_as_ardupilot_means_them(craft, flight, outputs, index, sign):
    """Half a second after it is free of the ground."""
    _, autopilot = flight
    lifted = 0.0
    for _ in range(400):
        seen = autopilot.frame(transverse(0.0, 0.0, 0.0, 0.60))
    for _ in range(120):
        lifted = autopilot.frame(transverse(*outputs, 0.60))
    assert sign * (lifted["imu"]["gyro"][index] - seen["imu"]["gyro"][index]) > 0.05


def test_it_takes_off_and_hovers_with_the_gains_of_the_parameter_file(lines, flight):
    _, autopilot = flight
    pilot = HoverPilot(parameters(lines), height=1.5)
    seen = autopilot.frame(REST)
    heights, tilts = [], []
    for i in range(400 * 6):
        seen = autopilot.frame(transverse(*pilot.outputs(seen, 1 / 400)))
        if i > 400 * 5:
            heights.append(-seen["position"][2])
            tilts.append(np.linalg.norm(seen["quaternion"][1:3]))
    assert np.abs(np.array(heights) - 1.5).max() < 0.1
    assert 2.0 * max(tilts) < math.radians(2.0)


# -- parameters --------------------------------------------------------------------------------------------------------


def test_parameters_say_where_the_servos_are_and_what_margins_the_gains_have(lines):
    values = parameters(lines)
    assert [values[f"SERVO{i}_FUNCTION"] for i in range(1, 7)] == [33, 34, 35, 36, 37, 38]
    assert (values["FRAME_CLASS"], values["H_DUAL_MODE"], values["H_SW_TYPE"]) == (11, 1, 3)
    # blade pitch of 0 and 16 deg on a travel from -8 to 24 deg
    assert (values["H_COL_MIN"], values["H_COL_MAX"]) == (1250, 1750)
    margins = [line for line in lines if "margin" in line and "crossover" in line]
    assert len(margins) == 4
    for line in margins:
        decibels, degrees = float(line.split("margin ")[1].split()[0]), float(line.split("margin ")[2].split()[0])
        assert decibels >= 8.0
        assert degrees >= 49.5


def test_the_loops_are_nested_and_no_more_is_planned_than_the_controls_can_do(craft, lines):
    """A loop within another is quicker; some half of what full yaw gives in a quarter of a second is planned."""
    values = parameters(lines)
    crossovers = {
        line.split()[1]: float(line.split("crossover ")[1].split()[0]) for line in lines if "crossover" in line
    }
    assert values["PSC_POSXY_P"] < crossovers["velocity:"] < min(crossovers["p:"], crossovers["q:"])
    assert values["PSC_POSXY_P"] == pytest.approx(0.35 * crossovers["velocity:"], rel=0.01)
    gain = 0.45 * 32.0  # deg of cyclic of a full output
    left, right = (np.radians([10.0, 0.0, sign * gain]) for sign in (1.0, -1.0))
    state = state_on_ground(craft, 0.0)
    state[2] = -20.0
    simulation = Simulation(craft, state, np.array([left, right]), tick=0.25, ground_altitude=0.0)
    simulation.advance()
    reached = abs(math.degrees(simulation.state[12])) / 0.25
    planned = values["ATC_ACCEL_Y_MAX"] / 100.0
    assert 0.4 * reached < planned < reached


def test_a_gain_beyond_the_critical_one_has_no_margins():
    """Past a phase of -270 deg the last crossover looks good again, and the loop is unstable."""
    s = 1j * FREQUENCIES
    gravity = 9.80665
    for quickness in (8.0, 12.0):
        tilt = 1.0 / (1.0 + s / quickness) / (1.0 + s / 125.0) ** 3 * np.exp(-0.0075 * s)
        loop = velocity_loop([tilt * gravity / (s + 0.05)], gravity)
        assert loop.crossover < quickness
        assert loop.gain_margin < 10.0  # the largest gain that keeps 8 dB


def test_values_have_the_names_of_older_and_newer_firmware(lines):
    values = parameters(lines)
    assert values["PSC_NE_POS_P"] == values["PSC_POSXY_P"]
    assert values["PSC_NE_VEL_FLTE"] == values["PSC_VELXY_FLTE"]
    assert values["PSC_D_ACC_I"] == pytest.approx(0.1 * values["PSC_ACCZ_I"], rel=1e-4)
    assert values["ATC_ACC_Y_MAX"] == pytest.approx(0.01 * values["ATC_ACCEL_Y_MAX"], rel=1e-4)  # deg, not centidegrees


def test_an_aircraft_with_a_battery_gets_a_monitor(lines):
    electric = Aircraft.load(str(ELECTRIC))
    servos = Servos.load(electric, str(EXAMPLE))
    values = parameters(parameter_lines(electric, servos))
    assert (values["BATT_MONITOR"], values["BATT_CAPACITY"]) == (4, 16000)
    assert "BATT_MONITOR" not in parameters(lines)


def test_parameters_of_a_head_that_turns_the_wrong_way_are_refused(craft):
    servos = Servos.load(craft, str(EXAMPLE))
    wrong = [head._replace(longitudinal_sign=1) for head in servos.heads]
    with pytest.raises(ArduPilotError, match="turns q the wrong way"):
        parameter_lines(craft, Servos(craft, wrong, frame="transverse"))
    with pytest.raises(ArduPilotError, match="left one first"):
        parameter_lines(craft, Servos(craft, servos.heads[::-1], frame="transverse"))


# -- the executable ----------------------------------------------------------------------------------------------------


def test_the_executable_flies_publishes_and_records_what_replays_bit_for_bit(tmp_path):
    with world(next(DOMAINS), tmp_path) as made:
        states, servos = made.client.watch("state", BodyState), made.client.watch("autopilot/servos", ServoFrame)
        log = tmp_path / "flight.mcap"
        process = made.start("ardupilot", port=0, record=log, components="[simulator, recorder]")
        made.client.until(lambda: "waiting for ArduPilot on UDP port" in process.output, "it listens")
        port = int(process.output.split("UDP port ")[1].split()[0])
        made.client.until(lambda: f"recording {log}" in process.output, "the flight begins")
        autopilot = Autopilot(port)
        for i in range(200):
            seen = autopilot.frame(transverse(0.0, 0.0, 0.0, 0.4 + 0.001 * i))
        last = transverse(0.0, 0.0, 0.0, 0.4 + 0.001 * 199)
        made.client.until(lambda: servos and list(servos[-1].pulses) == last, "the last frame")
        made.client.until(lambda: states[-1].header.stamp.nanosec >= 4e8, "states of the flight")
        assert states[-1].position.z == pytest.approx(seen["position"][2], abs=0.05)
        assert autopilot.frame(REST, count=0)["timestamp"] == pytest.approx(1 / 400)  # it starts anew
        autopilot.close()
        assert process.interrupt() == 0
    flight = flight_of(read(log))
    assert next(event.kind for event in flight.events) == "start"
    assert "reset" in {event.kind for event in flight.events}
    assert verify(flight).identical


def test_parameters_are_printed_without_a_flight(tmp_path):
    def printed(*words):
        command = [sys.executable, str(EXECUTABLES / "ardupilot"), "--parameters", *words]
        return subprocess.run(command, capture_output=True, text=True, check=False, cwd=tmp_path)

    assert parameters(printed().stdout.splitlines())["FRAME_CLASS"] == 11
    refused = printed("--aircraft", "pca2")
    assert (refused.returncode, refused.stdout) == (1, "")
    assert "no servo file of pca2: allowed are sbs" in refused.stderr
