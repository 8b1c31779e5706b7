"""Flights and their logs: real processes, real DDS, real files."""

import datetime
import itertools
import math
import os
import signal
import subprocess
import sys
import textwrap
import time
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from ruamel.yaml import YAML

rclpy = pytest.importorskip("rclpy")

from geometry_msgs.msg import Point, Vector3  # noqa: E402
from recorded_flights import HOVER_STEP, STATE_TOPICS, assert_identical, fly, replay, wiggle  # noqa: E402
from ros_harness import (  # noqa: E402
    DOMAINS,
    controls_message,
    swashplate_message,
    world,
)
from rosgraph_msgs.msg import Clock  # noqa: E402
from std_srvs.srv import SetBool  # noqa: E402

from sbs_msgs.msg import (  # noqa: E402
    BodyState,
    Controls,
    FlightEvent,
    SimulationStatus,
    TrimPoint,
)
from sbs_msgs.srv import Record, Reset, SetWind, Step, Trim  # noqa: E402
from sbs_sim import Aircraft, trim  # noqa: E402
from sbs_sim.cockpit.recorded_snapshots import RecordedSnapshots  # noqa: E402
from sbs_sim.nodes.what_if import fly_with  # noqa: E402
from sbs_sim.recording import read, recover  # noqa: E402
from sbs_sim.recording.plot import flight_figure  # noqa: E402
from sbs_sim.recording.recorded_flight import complete_until, flight_of  # noqa: E402
from sbs_sim.recording.source import Source  # noqa: E402
from sbs_sim.recording.summary import read_summary  # noqa: E402
from sbs_sim.recording.verification import verify  # noqa: E402

# -- what is recorded ------------------------------------------------------------------------------------------------


def test_log_holds_what_was_published(tmp_path, hover):
    """Every message that a subscriber got is there with equal values; accepted commands and results are too."""
    received = {}

    def act(made):
        for topic, kind in STATE_TOPICS.items():
            received[topic] = made.client.watch(topic, kind)
        received["trim_point"] = made.client.watch("trim_point", TrimPoint)
        wiggle(made, hover)
        made.client.publish("controls", Controls(collective=math.nan))  # refused: not recorded
        assert made.client.call(Trim, "trim", airspeed=5.0).success
        made.client.until(lambda: received["trim_point"], "the latched trim")
        made.client.call(SetBool, "pause", data=True)
        made.client.spin(0.3)

    log = read(fly(tmp_path, act))
    assert log.complete
    for topic in ("state", "odom"):
        stamps = log[topic].time_ns.tolist()
        assert len(stamps) == len(set(stamps))
    by_time = {stamp: i for i, stamp in enumerate(log["state"].time_ns.tolist())}
    assert len(received["state"]) > 20
    for message in received["state"]:
        i = by_time[message.header.stamp.sec * 10**9 + message.header.stamp.nanosec]
        assert log["state"]["position.z"][i] == message.position.z
        assert log["state"]["attitude.w"][i] == message.attitude.w
        assert log["rotors"]["rotors[1].flap"].shape == (len(log["rotors"].time_ns), 3)
    assert log["trim_point"]["condition.airspeed"].tolist() == [5.0]
    assert np.isfinite(log["controls"]["collective"]).all()
    assert len(log["swashplate"].time_ns) > 5
    assert {"/status", "/diagnostics", "/clock", "/inflow", "/events"} <= set(log.topics)
    assert log["state"].units["velocity.x"] == "m/s"
    assert set(log["events"]["kind"]) == {"start", "swashplate"}
    assert log.metadata["simulation"]["aircraft"] == "sbs"
    assert "aircraft.yaml" in log.attachments


def test_another_reader_reads_every_message(tmp_path, hover):
    """rosbags, which shares nothing with this package."""
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import Stores, get_typestore

    path = fly(tmp_path, lambda made: wiggle(made, hover))
    log = read(path)
    counts = dict.fromkeys(log.topics, 0)
    heights = []
    with AnyReader([path], default_typestore=get_typestore(Stores.ROS2_JAZZY)) as reader:
        for connection, _, data in reader.messages():
            message = reader.deserialize(data, connection.msgtype)
            counts[connection.topic] += 1
            if connection.topic == "/state":
                heights.append(message.position.z)
    assert counts == {topic: len(log[topic].time_ns) for topic in log.topics}
    np.testing.assert_array_equal(heights, log["state"]["position.z"])


def test_a_flight_of_other_topics_is_recorded_like_any(tmp_path, hover):
    """In a namespace, and with topics that are called otherwise: all tools find them by their role."""
    path, heavy = tmp_path / "a.mcap", tmp_path / "heavy.mcap"
    with world(next(DOMAINS), tmp_path) as made:
        client = made.client
        client.watch("/h1/status", SimulationStatus)
        remaps = ["__ns:=/h1", "state:=body/pose", "events:=/ev", "inflow:=air", "rotors:=state"]
        simulator = made.start("simulator", remaps, record=path, components="[simulator, control_mixer, recorder]")
        client.next("/h1/status")
        sent, end = itertools.count(), client.next("/h1/status").sim_time + 0.3

        def flown():
            client.publish("/h1/controls", Controls(collective=hover.controls[0] + 0.001 * (next(sent) % 10)))
            return client.messages["/h1/status"][-1].sim_time > end

        client.until(flown, "0.3 s of flight")
        (sender,) = client.node.get_publishers_info_by_topic("/h1/body/pose")
        assert simulator.interrupt() == 0, simulator.output
    log = read(path)
    names = {"state": "/h1/body/pose", "events": "/ev", "inflow": "/h1/air", "rotors": "/h1/state"}
    assert names.items() <= log.roles.items()
    assert log["state"].type == "sbs_msgs/msg/BodyState"
    assert "rotors[0].flap" in log["rotors"]
    assert len(log["controls"].time) > 5
    assert_identical(path)
    labels = [axes.get_ylabel() for axes in flight_figure(log).axes]
    assert len(labels) == 10
    assert RecordedSnapshots(path).end == pytest.approx(log["state"].time[-1])  # as the cockpit shows it
    found = replay("--with", "body.mass=23", "--output", heavy, path)
    assert found.returncode == 0, found.stderr
    assert names.items() <= read(heavy).roles.items()
    assert_identical(heavy)

    with path.open("rb") as file:  # what other readers learn of the types
        reader = make_reader(file)
        summary = reader.get_summary()
        (bag,) = (record.metadata for record in reader.iter_metadata() if record.name == "rosbag2")
    channels = {channel.topic: channel.metadata for channel in summary.channels.values()}
    version, digest = sender.topic_type_hash.version, bytes(sender.topic_type_hash.value).hex()
    assert channels["/h1/body/pose"]["topic_type_hash"] == f"RIHS{version:02}_{digest}"
    assert all(metadata["topic_type_hash"].startswith("RIHS01_") for metadata in channels.values())
    bag = YAML(typ="safe").load(bag["serialized_metadata"])
    assert bag["ros_distro"] == os.environ.get("ROS_DISTRO", "jazzy")
    hashes = {item["topic_metadata"]["name"]: item["topic_metadata"] for item in bag["topics_with_message_count"]}
    assert hashes["/h1/body/pose"]["type_description_hash"] == channels["/h1/body/pose"]["topic_type_hash"]


def test_default_is_a_file_named_after_time_and_aircraft(tmp_path):
    with world(next(DOMAINS), tmp_path) as made:
        statuses = made.client.watch("status", SimulationStatus)
        simulator = made.start("simulator")
        made.client.next("status")
        assert simulator.interrupt() == 0
    (path,) = (tmp_path / "bags").glob("*.mcap")
    assert path.name.endswith("_sbs.mcap")
    assert statuses[-1].log == str(path)
    assert statuses[-1].log_dropped == 0
    assert read(path).complete


def test_recording_can_be_switched_off(tmp_path):
    for number, parameters in enumerate(({"record": "off"}, {"components": "[simulator]"})):
        folder = tmp_path / str(number)
        folder.mkdir()
        with world(next(DOMAINS), folder) as made:
            statuses = made.client.watch("status", SimulationStatus)
            made.start("simulator", **parameters)
            made.client.next("status")
        assert not list(folder.rglob("*.mcap"))
        assert statuses[-1].log == ""


@pytest.mark.parametrize("case", ["exists", "no folder", "name too long"])
def test_a_log_that_cannot_be_made_ends_the_start_with_one_line(tmp_path, case):
    path = tmp_path / {"exists": "a.mcap", "no folder": "none/a.mcap"}.get(case, "a" * 300)
    if case == "exists":
        path.write_bytes(b"")
    with world(next(DOMAINS), tmp_path) as made:
        simulator = made.start("simulator", record=path)
        assert simulator.wait() == 1
        lines = [line for line in simulator.output.splitlines() if not line.startswith("[")]
    assert len(lines) == 1
    assert str(path) in lines[0]


def test_a_full_disk_does_not_stop_the_flight(tmp_path, hover):
    """The log is limited to 64 kB: flight and topics go on, status says what is lost and why."""
    with world(next(DOMAINS), tmp_path) as made:
        made.client.watch("status", SimulationStatus)
        simulator = made.start("simulator", record=tmp_path / "a.mcap")
        made.client.next("status")
        import resource

        resource.prlimit(simulator.pid, resource.RLIMIT_FSIZE, (400_000, 400_000))
        failed = made.client.next("status", lambda message: message.log_fault)
        later = made.client.next("status", lambda message: message.sim_time > failed.sim_time + 0.5)
        assert later.log_dropped > failed.log_dropped
        assert "a.mcap" in failed.log_fault
        assert simulator.interrupt() == 0
    assert len(read(tmp_path / "a.mcap")["state"].time_ns) > 10


def test_a_disk_that_is_full_at_the_very_end_is_reported(tmp_path):
    with world(next(DOMAINS), tmp_path) as made:
        made.client.watch("status", SimulationStatus)
        simulator = made.start("simulator", record=tmp_path / "a.mcap", components="[simulator, recorder]")
        made.client.next("status", lambda message: message.sim_time > 0.5)
        import resource

        size = (tmp_path / "a.mcap").stat().st_size + 500
        resource.prlimit(simulator.pid, resource.RLIMIT_FSIZE, (size, size))
        assert simulator.interrupt() == 0
    assert f"the log ends before the flight: cannot write {tmp_path / 'a.mcap'}: File too large" in simulator.output


def test_a_log_that_is_deleted_or_moved_is_reported(tmp_path, hover):
    """Also while the flight is paused, when nothing but the heartbeat is published, and nothing new is recorded."""
    first, second, moved = (tmp_path / f"{name}.mcap" for name in ("first", "second", "moved"))
    with world(next(DOMAINS), tmp_path) as made:
        client = made.client
        statuses = client.watch("status", SimulationStatus)
        clocks = client.watch("/clock", Clock)
        simulator = made.start("simulator", record=first)
        client.next("status")
        wiggle(made, hover, 0.2)
        assert client.call(SetBool, "pause", data=True).success
        for _ in range(10):
            client.publish("controls", controls_message(hover.controls))
            client.spin(0.02)
        client.spin(2.5)  # until all that is news is written, of the diagnostics too
        beats, ticks, size = len(statuses), len(clocks), first.stat().st_size
        begin = time.monotonic()
        while len(clocks) < ticks + 4:
            client.publish("controls", controls_message(hover.controls))
            client.spin(0.02)
        seconds = time.monotonic() - begin
        assert len(statuses) - beats < 2 * seconds  # ten a second before
        assert {status.sim_time for status in statuses[beats:]} == {statuses[-1].sim_time}
        assert first.stat().st_size == size

        first.unlink()
        fault = f"{first} was deleted while it was written: what was in it is lost"
        assert client.next("status", lambda status: status.log_fault).log_fault == fault
        answer = client.call(Record, "record", record=False)
        assert (answer.success, answer.path) == (False, str(first))
        assert answer.message == f"the log ends before the flight: {fault}"

        assert client.call(Record, "record", record=True, path=str(second)).success
        second.rename(moved)
        client.next("status", lambda status: status.log == str(moved))
        assert client.call(SetBool, "pause", data=False).success
        wiggle(made, hover, 0.3)
        answer = client.call(Record, "record", record=False)
        assert (answer.success, answer.path) == (True, str(moved)), answer.message
        assert simulator.interrupt() == 0, simulator.output
    assert f"the log ends before the flight: {fault}" in simulator.output
    assert_identical(moved)


@pytest.mark.parametrize("signals", [[signal.SIGHUP], [signal.SIGINT, signal.SIGTERM]])
def test_a_log_is_complete_however_its_end_is_asked_for(tmp_path, signals):
    """A terminal that is closed; somebody who is in a hurry."""
    with world(next(DOMAINS), tmp_path) as made:
        made.client.watch("state", BodyState)
        simulator = made.start("simulator", record=tmp_path / "a.mcap", components="[simulator, recorder]")
        made.client.next("state")
        for number in signals:
            os.kill(simulator.pid, number)
        assert simulator.wait() == 0, simulator.output
    assert read(tmp_path / "a.mcap").complete
    assert "Traceback" not in simulator.output


def test_a_log_that_was_just_started_is_complete(tmp_path):
    """Interrupted while all the rest is made: there is a whole log, or none yet."""
    path = tmp_path / "a.mcap"
    with world(next(DOMAINS), tmp_path) as made:
        simulator = made.start("simulator", record=path)
        made.client.until(path.exists, "the log")
        assert simulator.interrupt(signal.SIGTERM) == 0
    assert read(path).complete
    assert "Traceback" not in simulator.output


def test_who_does_not_heed_a_closed_terminal_is_left_alone():
    code = """
        import signal
        from sbs_sim.nodes.signals import when_interrupted
        signal.signal(signal.SIGHUP, signal.SIG_IGN)  # as nohup does
        when_interrupted(print)
        print(signal.getsignal(signal.SIGHUP) == signal.SIG_IGN, signal.getsignal(signal.SIGTERM) == print)
    """
    command = [sys.executable, "-c", textwrap.dedent(code)]
    found = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True)
    assert found.stdout == "True True\n"


def test_interruptions_that_arrive_at_once_end_a_command_without_a_word():
    """Blocked and let go together, as a busy machine delivers Ctrl-C and the closing of a terminal."""
    code = """
        import signal, threading
        from sbs_sim.nodes import replay
        from sbs_sim.nodes.signals import ignore_interruptions, when_interrupted
        both = (signal.SIGINT, signal.SIGTERM)
        when_interrupted(replay._interrupt)
        signal.pthread_sigmask(signal.SIG_BLOCK, both)
        for number in both:  # to this thread: those of libraries do not block them
            signal.pthread_kill(threading.get_ident(), number)
        try:
            signal.pthread_sigmask(signal.SIG_UNBLOCK, both)
        except KeyboardInterrupt:
            ignore_interruptions()
            print("interrupted once", signal.getsignal(signal.SIGTERM) == signal.SIG_IGN)
    """
    command = [sys.executable, "-c", textwrap.dedent(code)]
    found = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True)
    assert (found.stdout, found.stderr) == ("interrupted once True\n", "")


def test_an_interruption_in_a_long_computation_leaves_a_complete_log(tmp_path):
    with world(next(DOMAINS), tmp_path) as made:
        made.client.watch("status", SimulationStatus)
        simulator = made.start("simulator", record=tmp_path / "a.mcap")
        made.client.next("status")
        service = made.client.node.create_client(Trim, "trim")
        made.client.until(service.service_is_ready, "trim")
        service.call_async(Trim.Request(airspeed=95.0, azimuth_count=1000))  # half a minute of arithmetic
        made.client.spin(0.5)
        assert simulator.interrupt() == 0
    assert read(tmp_path / "a.mcap").complete


def test_what_was_recorded_before_a_kill_can_be_read_after_it(tmp_path, hover):
    with world(next(DOMAINS), tmp_path) as made:
        states = made.client.watch("state", BodyState)
        simulator = made.start("simulator", record=tmp_path / "a.mcap")
        made.client.next("state")
        wiggle(made, hover, 1.5)
        os.kill(simulator.pid, signal.SIGKILL)
        simulator.wait()
    last = states[-1].header.stamp.sec + 1e-9 * states[-1].header.stamp.nanosec
    log = read(tmp_path / "a.mcap")
    assert not log.complete
    assert log["state"].time[-1] > last - 0.5
    found = replay("--recover", tmp_path / "a.mcap")
    assert found.returncode == 3
    assert "lost" in found.stdout
    whole = read(tmp_path / "a.recovered.mcap")
    assert whole.complete
    np.testing.assert_array_equal(whole["state"]["position.z"], log["state"]["position.z"])
    assert replay("--verify", tmp_path / "a.recovered.mcap").returncode == 0
    again = replay("--recover", tmp_path / "a.recovered.mcap", "--output", tmp_path / "again.mcap")
    assert again.returncode == 0
    assert "nothing was lost" in again.stdout


# -- flown again -----------------------------------------------------------------------------------------------------


def turbulence(seed):
    return {"turbulence_intensity": Vector3(x=1.0, y=1.0, z=0.5), "turbulence_seed": seed}


def test_hover_with_control_steps_comes_again_bit_for_bit(tmp_path, hover):
    assert_identical(fly(tmp_path, lambda made: wiggle(made, hover, 1.0)))


def test_forward_flight_in_turbulence_comes_again_bit_for_bit(tmp_path, hover):
    def act(made):
        assert made.client.call(SetWind, "set_wind", **turbulence(5)).success
        wiggle(made, trim(Aircraft.load("sbs"), 10.0), 1.0)

    assert_identical(fly(tmp_path, act, airspeed=10.0))


def test_pause_steps_resets_and_wind_come_again_bit_for_bit(tmp_path, hover):
    def act(made):
        client = made.client
        wiggle(made, hover, 0.3)
        assert client.call(SetBool, "pause", data=True).success
        assert client.call(Step, "step", ticks=7).success
        assert client.call(SetWind, "set_wind", velocity=Vector3(x=3.0), **turbulence(9)).success
        assert client.call(Reset, "reset", airspeed=6.0, heading=1.0).success
        assert client.call(Reset, "reset", climb_rate=1.0).success  # twice at one instant
        assert client.call(Step, "step", ticks=3).success
        assert client.call(SetBool, "pause", data=False).success
        wiggle(made, hover, 0.3)

    assert_identical(fly(tmp_path, act))


# -- recording in flight -----------------------------------------------------------------------------------------------


def test_logs_started_in_mid_flight_are_repeated_bit_for_bit(tmp_path, hover):
    """Turbulence and a gust have started before the log; the azimuths are arbitrary."""
    first, second = tmp_path / "first.mcap", tmp_path / "second.mcap"
    with world(next(DOMAINS), tmp_path) as made:
        client = made.client
        client.watch("status", SimulationStatus)
        events = client.watch("events", FlightEvent, latched=True)
        simulator = made.start("simulator", record="off")
        assert client.next("status").log == ""
        gust = {"gust": Vector3(z=2.0), "gust_delay": 0.2, "gust_duration": 5.0}
        assert client.call(SetWind, "set_wind", **gust, **turbulence(3)).success
        wiggle(made, hover, 0.4)
        answer = client.call(Record, "record", record=True, path=str(first))
        assert (answer.success, answer.path) == (True, str(first)), answer.message
        assert client.next("status", lambda status: status.log).log == str(first)
        wiggle(made, hover, 0.5)
        ended = client.call(Record, "record", record=False)
        assert (ended.success, ended.path) == (True, str(first)), ended.message
        assert read(first).complete  # as soon as it is said to have ended
        client.next("status", lambda status: not status.log)
        wiggle(made, hover, 0.2)
        assert client.call(Record, "record", record=True, path=str(second)).success
        wiggle(made, hover, 0.4)
        assert simulator.interrupt() == 0, simulator.output
    assert [event.kind for event in events].count("start") == 1  # for everybody else the flight has started once
    for path in (first, second):
        log = read(path)
        assert log.complete
        assert log["events"]["kind"][0] == "start"
        assert log["events"]["step"][0] > 0
        assert log["events"]["wind_ticks"][0] > 20
        assert log["state"].time[0] == pytest.approx(log["events"].time[0])
        assert "swashplate" in log["events"]["kind"]
        assert_identical(path)
    assert read(second)["state"].time[0] > read(first)["state"].time[-1]


def test_logs_that_end_at_the_step_of_their_start_are_repeated(tmp_path):
    """Each with its own start and states, though what is published before them is still on its way."""
    with world(next(DOMAINS), tmp_path) as made:
        made.client.watch("status", SimulationStatus)
        made.start("simulator", record="off")
        made.client.next("status")
        assert made.client.call(SetBool, "pause", data=True).success
        steps = made.client.node.create_client(Step, "step")
        made.client.until(steps.service_is_ready, "step")
        for number in range(6):
            path = str(tmp_path / f"{number}.mcap")
            flown = steps.call_async(Step.Request(ticks=100))
            answer = made.client.call(Record, "record", record=True, path=path)
            assert (answer.success, answer.path) == (True, path), answer.message
            assert made.client.call(Record, "record", record=False).success
            made.client.until(flown.done, "the steps")
    for number in range(6):
        log = read(tmp_path / f"{number}.mcap")
        assert log.complete
        assert log["events"]["kind"][0] == "start"
        assert list(log["events"]["kind"]).count("start") == 1
        assert log["state"].time[0] == log["events"].time[0]
        assert verify(flight_of(log)).identical


def test_a_log_that_begins_while_paused_after_a_fault_comes_again(tmp_path):
    """The flight has ended at the ground within a tick; a reset flies on."""
    path = tmp_path / "late.mcap"
    with world(next(DOMAINS), tmp_path) as made:
        client = made.client
        client.watch("status", SimulationStatus)
        simulator = made.start("simulator", record="off", ground_altitude=-0.6)
        assert client.call(SetWind, "set_wind", velocity=Vector3(z=5.0), **turbulence(4)).success
        client.next("status", lambda status: "ground contact" in status.fault)
        assert client.call(Record, "record", record=True, path=str(path)).success
        assert client.call(Reset, "reset", position=Point(z=-20.0)).success
        assert client.call(SetBool, "pause", data=False).success
        late = client.next("status", lambda status: not status.fault and status.state == SimulationStatus.PLAYING)
        client.next("status", lambda status: status.sim_time > late.sim_time + 0.4)
        assert simulator.interrupt() == 0, simulator.output
    assert_identical(path)


def test_a_log_started_in_mid_flight_flies_with_a_changed_aircraft(tmp_path, hover):
    path, heavy = tmp_path / "mid.mcap", tmp_path / "heavy.mcap"
    with world(next(DOMAINS), tmp_path) as made:
        made.client.watch("status", SimulationStatus)
        made.start("simulator", record="off")
        made.client.next("status", lambda status: status.sim_time > 0.3)
        assert made.client.call(SetWind, "set_wind", velocity=Vector3(x=1.0)).success
        made.client.next("status", lambda status: status.sim_time > 0.5)
        assert made.client.call(Record, "record", record=True, path=str(path)).success
        wiggle(made, hover, 0.5)
        assert made.client.call(Record, "record", record=False).success
    found = replay("--with", "body.mass=22.5", "--output", heavy, "--end", 0.3, path)
    assert found.returncode == 0, found.stderr
    assert "of 0 steps" not in found.stdout
    log, begin = read(heavy), read(path)["state"].time[0]
    assert log["state"].time[0] == begin
    assert log["state"].time[-1] == pytest.approx(begin + 0.3, abs=0.011)
    assert_identical(heavy)

    # rotors that turn more slowly take fewer steps to a tick, and the wind is older than the log
    flight, slow = flight_of(read(path)), tmp_path / "slow.mcap"
    changes = [f"rotors[{j}].speed_rpm=1800" for j in (0, 1)]
    fly_with(flight, changes, int(flight.steps[-1]), slow)
    wind = [read(found)["events"]["wind_step"][0] for found in (path, slow)]
    assert wind[1] * 10 == wind[0] * 8  # steps of 14.4 degrees at most: 10 to a tick at 2400 rpm, 8 at 1800
    assert_identical(slow)


def test_what_cannot_be_recorded_is_refused_in_one_line_and_changes_nothing(tmp_path):
    (tmp_path / "there.mcap").write_bytes(b"mine")
    with world(next(DOMAINS), tmp_path) as made:
        client = made.client
        client.watch("status", SimulationStatus)
        made.start("simulator", record="off")
        client.next("status")

        def refusal(**request):
            answer = client.call(Record, "record", **request)
            assert not answer.success
            assert len(answer.message.splitlines()) == 1
            return answer.message

        assert refusal(record=False) == "record = false: nothing is recorded"
        assert refusal(path="x.mcap") == "path = 'x.mcap': allowed where a log begins, record = true"
        assert "there.mcap: File exists" in refusal(record=True, path=str(tmp_path / "there.mcap"))
        assert (tmp_path / "there.mcap").read_bytes() == b"mine"
        assert "does not exist" in refusal(record=True, path=str(tmp_path / "none" / "a.mcap"))
        assert "Permission denied" in refusal(record=True, path="/sys/a.mcap")
        assert "File name too long" in refusal(record=True, path="a" * 300)
        answer = client.call(Record, "record", record=True, path=str(tmp_path))  # a folder
        assert answer.success
        assert Path(answer.path).parent == tmp_path
        assert refusal(record=True) == f"recording {answer.path} already: record = false ends it"
        assert client.next("status", lambda status: status.log).log == answer.path
    assert set(tmp_path.rglob("*.mcap")) == {tmp_path / "there.mcap", Path(answer.path)}


def test_a_flight_as_fast_as_it_goes_comes_again_and_nothing_is_left_out(tmp_path, hover):
    path = fly(tmp_path, lambda made: wiggle(made, hover, 0.5), real_time_factor=0.0)
    assert_identical(path)
    log = read(path)
    *ticks, last = np.diff(log["state"].time_ns)
    assert set(ticks) == {10_000_000}
    assert 0 < last <= 10_000_000  # on a fast machine it reaches the ground, which ends it within a tick
    assert log["status"]["log_dropped"][-1] == 0


def test_a_flight_under_load_comes_again_bit_for_bit(tmp_path, hover):
    def act(made):
        burners = [
            subprocess.Popen([sys.executable, "-c", "while True: pass"], stdout=subprocess.DEVNULL)
            for _ in range(2 * (os.cpu_count() or 1))
        ]
        try:
            wiggle(made, hover, 1.0)
        finally:
            for burner in burners:
                burner.kill()
                burner.wait()

    assert_identical(fly(tmp_path, act))


def test_commands_past_the_mixer_come_again(tmp_path, hover):
    def act(made):
        for i in range(10):
            made.client.publish("swashplate", swashplate_message(hover.swashplate + 0.002 * i))
            made.client.spin(0.03)

    path = fly(tmp_path, act, components="[simulator, recorder]")
    assert_identical(path)
    assert len(read(path)["swashplate"].time_ns) >= 5


def test_a_changed_log_is_found_out(tmp_path, hover):
    """Another command in the middle: the first difference is reported, and the exit code."""
    flight = flight_of(read(fly(tmp_path, lambda made: wiggle(made, hover, 0.5))))
    assert verify(flight).identical
    state = flight.states[len(flight.states) // 2]
    state[7] = np.nextafter(state[7], 1e9)  # one bit of u
    found = verify(flight)
    assert not found.identical
    assert found.first == found.largest
    assert found.first.state == "u"
    assert found.first.step == flight.steps[len(flight.states) // 2]


def test_the_same_commands_on_a_changed_aircraft(tmp_path, hover):
    """Heavier: it sinks. The new log is one like any other."""
    path = fly(tmp_path, lambda made: wiggle(made, hover, 0.5))
    heavy = tmp_path / "heavy.mcap"
    changes = ("--with", "rotors.radius=0.40", "--with", "rotors.blade_cg=0.18", "--with", "body.inertia[0][1]=0.01")
    found = replay("--with", "body.mass=23", *changes, "--output", heavy, path)
    assert found.returncode == 0, found.stderr
    assert read(heavy)["state"]["velocity.z"][-1] > read(path)["state"]["velocity.z"][-1] + 0.3
    assert_identical(heavy)
    wrong = replay("--with", "body.weight=23", "--output", tmp_path / "b.mcap", path)
    assert wrong.returncode == 1
    assert len(wrong.stderr.splitlines()) == 1
    assert not (tmp_path / "b.mcap").exists()


def without_chunks(tmp_path, lost):
    """Copy of the log that comes along in which some chunks are damaged."""
    data = bytearray(HOVER_STEP.read_bytes())
    with Source(HOVER_STEP) as source:
        chunks = sorted(read_summary(source).chunks)
    for place in chunks[lost]:
        data[place + 200] ^= 1
    path = tmp_path / f"{lost.start}.mcap"
    path.write_bytes(data)
    return path


def acted(log):
    """Times at which the events of a log began to act [s]."""
    return log["events"]["step"] * float(log.metadata["simulation"]["step_size"])


@pytest.mark.parametrize("count", [1, 3])
def test_where_a_log_begins_to_lack_commands(tmp_path, count):
    whole = read(HOVER_STEP)
    assert complete_until(whole) == math.inf
    for first in range(1, 35, 5):
        log = read(without_chunks(tmp_path, slice(first, first + count)))
        lost = np.setdiff1d(acted(whole), acted(log))
        if lost.size:
            assert lost.min() - 0.1 < complete_until(log) < lost.min() + 1e-9
        else:
            assert complete_until(log) == math.inf


def numbered_log(path, events, states):
    """Log of events by number and time [ns], and of states by number, one each 10 ms."""
    from mcap.writer import Writer

    with path.open("wb") as stream:
        writer = Writer(stream, chunk_size=500)
        writer.start("ros2", "somebody")
        schema = writer.register_schema("std_msgs/msg/Float64", "ros2msg", b"float64 data")
        times = {"/events": events, "/state": {number: (number - 1) * 10_000_000 for number in states}}
        for topic, kept in times.items():
            channel = writer.register_channel(topic, "cdr", schema)
            for number, now in kept.items():
                writer.add_message(channel, now, bytes(12), now, number)
        writer.finish()
    return path


AT_ONCE_AND_LATER = {1: 0, 2: 200_000_000}
LEFT_OUT = [*range(1, 31), *range(41, 51)]  # 0.30 to 0.39 s
LACKING = {
    "states": (AT_ONCE_AND_LATER, LEFT_OUT, math.inf, 0.29),
    "states before the last event": (AT_ONCE_AND_LATER, [*range(1, 11), *range(15, 51)], math.inf, math.inf),
    "the end": (AT_ONCE_AND_LATER, range(1, 31), math.inf, math.inf),
    "an event": ({1: 0, 2: 200_000_000, 4: 300_000_000}, range(1, 51), 0.19, 0.19),
}


@pytest.mark.parametrize(("events", "states", "undamaged", "damaged"), LACKING.values(), ids=LACKING)
def test_commands_may_have_been_lost_behind_the_last_one(tmp_path, events, states, undamaged, damaged):
    """Only in a damaged log: states alone are left out too where the disk is slow."""
    path = numbered_log(tmp_path / "a.mcap", events, states)
    assert complete_until(read(path)) == pytest.approx(undamaged)
    cut = tmp_path / "cut.mcap"
    with Source(path) as source:
        end = read_summary(source).start
    cut.write_bytes(path.read_bytes()[: end - 5])  # in the end of the data
    assert not recover(cut, tmp_path / "cut.recovered.mcap").complete
    for log in (read(cut), read(tmp_path / "cut.recovered.mcap")):
        assert complete_until(log) == pytest.approx(damaged)


def test_a_changed_aircraft_is_not_flown_without_commands_that_were_lost(tmp_path):
    path, output = without_chunks(tmp_path, slice(20, 21)), tmp_path / "heavy.mcap"
    recover(path, tmp_path / "recovered.mcap")
    for log in (path, tmp_path / "recovered.mcap"):
        found = replay("--with", "body.mass=23", "--output", output, log)
        end = f"{complete_until(read(log)):.3f}"
        assert found.returncode == 1
        assert found.stderr == f"{log} lacks commands after {end} s: --end {end} flies those before\n"
        assert not output.exists()
    part = replay("--with", "body.mass=23", "--output", output, "--end", end, path)
    assert part.returncode == 0, part.stderr
    flown, whole = read(output), acted(read(HOVER_STEP))
    np.testing.assert_array_equal(acted(flown), whole[whole <= float(end) + 1e-6])
    assert flown["state"].time[-1] == pytest.approx(float(end))


def test_a_log_of_somebody_else_is_no_flight(tmp_path):
    other = tmp_path / "other.mcap"
    from mcap.writer import Writer

    with other.open("wb") as stream:
        writer = Writer(stream)
        writer.start("ros2", "somebody")
        writer.finish()
    found = replay("--verify", other)
    assert found.returncode == 1
    assert "no flight of sbs_sim" in found.stderr


def test_two_logs_of_a_second_have_two_names(tmp_path):
    from sbs_sim.nodes.flight_log import log_path

    begin = datetime.datetime(2024, 5, 6, 7, 8, 9)
    names = []
    for _ in range(3):
        path = log_path(str(tmp_path), "sbs", begin)
        path.write_bytes(b"")
        names.append(path.name)
    assert names == [f"2024-05-06_07-08-09_sbs{end}.mcap" for end in ("", "_2", "_3")]
