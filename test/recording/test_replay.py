"""Logs that are played, recovered and flown again: real processes, real DDS, real files."""

import itertools
import math
import signal
import struct
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import zstandard
from foreign_logs import merge

rclpy = pytest.importorskip("rclpy")

from rclpy.qos import DurabilityPolicy, HistoryPolicy, ReliabilityPolicy  # noqa: E402
from recorded_flights import HOVER_STEP, STATE_TOPICS, assert_identical, fly, replay, wiggle  # noqa: E402
from ros_harness import (  # noqa: E402
    DOMAINS,
    EXECUTABLES,
    PATIENCE,
    environment,
    nanoseconds,
    world,
)
from rosgraph_msgs.msg import Clock  # noqa: E402
from std_msgs.msg import Float64, String  # noqa: E402
from std_srvs.srv import SetBool  # noqa: E402
from terminal import on_a_terminal  # noqa: E402

from sbs_msgs.msg import (  # noqa: E402
    BodyState,
    FlightEvent,
    SwashplateArray,
)
from sbs_sim import Aircraft, trim  # noqa: E402
from sbs_sim.errors import RecordingError  # noqa: E402
from sbs_sim.nodes.log_player import is_shared  # noqa: E402
from sbs_sim.nodes.recorded_qos import recorded_qos  # noqa: E402
from sbs_sim.nodes.what_if import fly_with  # noqa: E402
from sbs_sim.recording import read  # noqa: E402
from sbs_sim.recording.recorded_flight import flight_of  # noqa: E402
from sbs_sim.recording.source import Source  # noqa: E402
from sbs_sim.recording.summary import read_summary  # noqa: E402
from sbs_sim.versions import differences, surroundings  # noqa: E402


@pytest.fixture(scope="module")
def recorded(tmp_path_factory, hover):
    """Log of a second and a half."""
    return fly(tmp_path_factory.mktemp("recorded"), lambda made: wiggle(made, hover, 1.5))


def play(tmp_path, path, *arguments, act=lambda made: None, code=0):
    """Messages that a subscriber gets of a replay, and what it printed."""
    with world(next(DOMAINS), tmp_path) as made:
        received = {topic: made.client.watch(topic, kind) for topic, kind in STATE_TOPICS.items()}
        received["events"] = made.client.watch("events", FlightEvent)
        made.client.watch("swashplate", SwashplateArray)
        made.client.spin(0.2)
        command = [sys.executable, str(EXECUTABLES / "replay"), str(path), *map(str, arguments)]
        process = subprocess.Popen(command, env=environment(made.domain), stderr=subprocess.PIPE, text=True)
        try:
            made.client.until(lambda: received["state"], "a replayed state")
            act(made)
            made.client.until(lambda: process.poll() is not None, "the end of the replay")
            made.client.spin(0.3)
        finally:
            process.kill()
            _, output = process.communicate(timeout=PATIENCE)
        assert process.returncode == code, output
    return received, output


def test_replay_publishes_what_was_recorded(tmp_path, recorded):
    heard = ("--delay", 30, "--topics", *STATE_TOPICS)
    (received, _), log = play(tmp_path, recorded, *heard), read(recorded)
    stamps = [nanoseconds(message) for message in received["state"]]
    assert stamps == log["state"].time_ns.tolist()
    assert received["/clock"]
    assert received["state"][-1].position.z == log["state"]["position.z"][-1]


def test_replay_of_a_part_and_of_some_topics(tmp_path, recorded):
    received, _ = play(tmp_path, recorded, "--start", 0.5, "--end", 1.0, "--delay", 30, "--topics", "state", "/odom")
    stamps = [message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec for message in received["state"]]
    assert min(stamps) >= 0.5
    assert max(stamps) <= 1.0 + 1e-6
    assert received["odom"]
    assert not received["rotors"]
    assert not received["/clock"]


def test_a_topic_that_somebody_else_publishes_is_not_played(tmp_path):
    """Two clocks, or the commands of a log for the aircraft of a simulator: no message of it is to come."""
    with world(next(DOMAINS), tmp_path) as made:
        made.client.node.create_publisher(Clock, "/clock", 10)
        states = made.client.watch("state", BodyState)
        refused = replay(HOVER_STEP, "--delay", 30, domain=made.domain)  # discovered before that
        made.client.spin(0.3)
        assert refused.returncode == 1
        assert refused.stderr.startswith("another node publishes /clock already: ")
        assert len(refused.stderr.splitlines()) == 1
        assert "--topics" in refused.stderr
        assert "ROS_DOMAIN_ID" in refused.stderr
        assert not states
        others = replay(HOVER_STEP, "--end", 0.1, "--delay", 30, "--topics", "state", domain=made.domain)
        assert others.returncode == 0, others.stderr
        made.client.until(lambda: states, "a replayed state")


def test_what_every_node_publishes_is_nobodys_own():
    assert [is_shared(name) for name in ("/diagnostics", "/h1/diagnostics", "/h1/state", "/clock")] == [
        True,
        True,
        False,
        False,
    ]


def test_replay_can_be_paused(tmp_path, recorded):
    def act(made):
        assert made.client.call(SetBool, "pause", data=True).success
        states = made.client.messages["state"]

        def is_quiet():
            count = len(states)
            made.client.spin(0.5)
            return len(states) == count

        made.client.until(is_quiet, "half a second without states")
        assert made.client.call(SetBool, "pause", data=False).success

    received, _ = play(tmp_path, recorded, "--rate", 0.5, act=act)
    assert received["state"][-1].position.z == read(recorded)["state"]["position.z"][-1]


def test_replay_again_and_again_until_it_is_ended(tmp_path, recorded):
    with world(next(DOMAINS), tmp_path) as made:
        states = made.client.watch("state", BodyState)
        command = [sys.executable, str(EXECUTABLES / "replay"), str(recorded), "--loop", "--rate", "5"]
        process = subprocess.Popen(command, env=environment(made.domain))

        def begins():
            times = [message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec for message in states]
            return sum(later < earlier for earlier, later in itertools.pairwise(times)) >= 2

        try:
            made.client.until(begins, "the log to begin again")
            process.send_signal(signal.SIGINT)
            assert process.wait(PATIENCE) == 0
        finally:
            process.kill()


@pytest.mark.parametrize(
    ("arguments", "unit"),
    [
        (["--verify"], "state"),
        (["--with", "body.mass=21", "--output", "new.mcap"], "step"),
        (["--recover"], "chunk"),
        (["--rate", "100", "--topics", "inflow"], "s/s"),
    ],
    ids=lambda given: given[0] if isinstance(given, list) else "",
)
def test_it_shows_how_far_it_is_on_a_terminal_only(tmp_path, arguments, unit):
    log, domain = tmp_path / "a.mcap", next(DOMAINS)
    log.write_bytes(HOVER_STEP.read_bytes())
    command = [sys.executable, str(EXECUTABLES / "replay"), str(log), *arguments]
    code, out, shown = on_a_terminal(command, cwd=tmp_path, env=environment(domain))
    assert code == 0, shown
    assert "%|" in shown.decode()
    assert unit in shown.decode()
    assert "%|" not in out
    for made in ("new.mcap", "a.recovered.mcap"):
        (tmp_path / made).unlink(missing_ok=True)
    silent = subprocess.run(
        command, cwd=tmp_path, env=environment(domain), capture_output=True, text=True, timeout=PATIENCE, check=True
    )
    assert "%|" not in silent.stderr


@pytest.mark.parametrize(
    ("arguments", "code", "text"),
    [
        (["nothing.mcap"], 1, "nothing.mcap"),
        (["--rate", "0", "x.mcap"], 2, "--rate 0.0: allowed are 0.001 to 1000"),
        (["--start", "3", "--end", "1", "x.mcap"], 2, "--start 3.0"),
        (["--end", "nan", "x.mcap"], 2, "--end nan"),
        (["x.mcap", "--output", "y.mcap"], 2, "--output: allowed with --recover and --with"),
        (["--verify", "nothing.mcap"], 1, "nothing.mcap"),
        (["--recover", "nothing.mcap"], 1, "nothing.mcap"),
        (["--verify", "--recover", "x.mcap"], 2, "not allowed with"),
        (["x.mcap", "--verify", "--rate", "3"], 2, "--rate: not allowed with --verify"),
        (["x.mcap", "--recover", "--loop"], 2, "--loop: not allowed with --recover"),
        (["x.mcap", "--with", "body.mass=23", "--topics", "state"], 2, "--topics: not allowed with --with"),
        (["x.mcap", "--with", "body.mass=23", "--end", "-1"], 2, "--end -1.0: allowed is 0 or more"),
    ],
)
def test_bad_arguments_are_named(arguments, code, text):
    found = replay(*arguments)
    assert found.returncode == code
    assert text in found.stderr
    assert "Traceback" not in found.stderr


INTERRUPTIONS = [(0.5, signal.SIGINT, signal.SIGTERM), (2.0, signal.SIGHUP, signal.SIGINT)]


@pytest.mark.parametrize(("seconds", "first", "second"), INTERRUPTIONS)
def test_an_interrupted_command_leaves_nothing_and_says_nothing(tmp_path, recorded, seconds, first, second):
    """Whatever it is at, the machine decides what that is; and whoever is in a hurry."""
    for number, mode in enumerate((["--with", "body.mass=23"], ["--recover"], ["--verify"])):
        output = tmp_path / f"{number}.mcap"
        extra = [] if mode == ["--verify"] else ["--output", str(output)]
        command = [sys.executable, str(EXECUTABLES / "replay"), str(recorded), *mode, *extra]
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        time.sleep(seconds)
        process.send_signal(first)
        process.send_signal(second)
        printed, _ = process.communicate(timeout=PATIENCE)
        if process.returncode == 130:
            assert printed == ""
            assert not output.exists()
        else:  # it had ended, or Python itself had only just started
            assert process.returncode in (0, -first, -second)


def test_a_flight_that_did_not_fit_on_the_disk_is_an_error(tmp_path, recorded):
    command = [sys.executable, str(EXECUTABLES / "replay"), "--with", "body.mass=23", str(recorded)]
    limit = Path(recorded).stat().st_size * 2 // 3

    def limited():
        import resource

        resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))

    output = tmp_path / "heavy.mcap"
    command += ["--output", str(output)]
    found = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=False, preexec_fn=limited)
    assert found.returncode == 1
    assert found.stderr == f"cannot write {output}: File too large\n"
    assert found.stdout == ""


def test_what_a_cut_log_is_compared_with_is_said(tmp_path, recorded):
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(Path(recorded).read_bytes()[: Path(recorded).stat().st_size * 3 // 4])
    found = replay("--verify", cut)
    assert found.returncode == 0
    assert "identical" in found.stdout
    assert found.stderr.startswith(f"{cut} is incomplete: ")
    assert len(found.stderr.splitlines()) == 1


def test_a_log_without_states_is_no_flight(tmp_path):
    """As a simulator leaves it that is ended at once."""
    from sbs_sim.flight.simulation import Simulation
    from sbs_sim.flight.trimmed_state import trimmed_state
    from sbs_sim.nodes.flight_log import FlightLog

    aircraft = Aircraft.load("sbs")
    point = trim(aircraft)
    FlightLog(
        str(tmp_path / "a.mcap"), Simulation(aircraft, trimmed_state(aircraft, point), point.swashplate), {}
    ).close()
    found = replay("--verify", tmp_path / "a.mcap")
    assert found.returncode == 1
    assert found.stderr.startswith("the log holds no flight of sbs_sim")
    assert len(found.stderr.splitlines()) == 1


def test_unknown_topics_are_named(recorded):
    found = replay("--topics", "altitude", "--", recorded)
    assert found.returncode == 1
    assert "altitude" in found.stderr
    assert "/state" in found.stderr


def test_a_damaged_log_is_played_up_to_the_damage(tmp_path, recorded):
    """Nothing wrong is published; one line and the exit code tell of it."""
    damaged = tmp_path / "damaged.mcap"
    data = bytearray(Path(recorded).read_bytes())
    with Source(recorded) as source:
        chunks = sorted(read_summary(source).chunks)
    data[chunks[len(chunks) * 2 // 3] + 200] ^= 1
    damaged.write_bytes(data)
    received, output = play(tmp_path, damaged, "--rate", 5, "--delay", 30, "--topics", *STATE_TOPICS, code=1)
    states = read(recorded)["state"]
    expected = dict(zip(states.time_ns.tolist(), states["position.z"].tolist(), strict=True))
    heights = {nanoseconds(message): message.position.z for message in received["state"]}
    assert 10 < len(heights) < len(expected)
    assert heights.items() <= expected.items()
    assert max(heights) < max(expected)
    assert len(output.splitlines()) == 1
    assert f"replay --recover {damaged}" in output


def test_a_log_of_another_writer_is_played(tmp_path):
    """Without checksums, and with topics that cannot be published: those are left out, and named."""
    from mcap.writer import Writer
    from rclpy.serialization import serialize_message

    from sbs_sim.nodes.message_types import definition_file
    from sbs_sim.recording import message_definition

    def publish(writer, topic, type_name, encoding, definition, data):
        schema = writer.register_schema(type_name, "ros2msg", definition.encode()) if type_name else 0
        channel = writer.register_channel(topic, encoding, schema)
        for i in range(20):
            writer.add_message(channel, 1_700_000_000_000_000_000 + i * 20_000_000, data(i), 0)

    path = tmp_path / "other.mcap"
    left_out = {
        "/json": ("", "json", "", "no ROS 2 messages"),
        "/one": ("std_msgs/String", "ros1", "string data", "no ROS 2 messages"),
        "/strange": ("strange_msgs/msg/Thing", "cdr", "int32 thing", "is not installed"),
        "/nameless": ("/", "cdr", "int32 thing", "is not installed"),
        "/bad name": ("std_msgs/msg/Bool", "cdr", "bool data", "ROS does not allow this name"),
        "/flag": ("std_msgs/msg/Bool", "cdr", "float64 data", "installed with other fields"),
    }
    with path.open("wb") as stream:
        writer = Writer(stream, chunk_size=500, enable_crcs=False)
        writer.start("ros2", "somebody")
        definition = message_definition("sbs_msgs/msg/BodyState", definition_file)
        body = BodyState()

        def state(i):
            body.position.z = float(i)
            return serialize_message(body)

        publish(writer, "state", "sbs_msgs/msg/BodyState", "cdr", definition, state)
        for topic, (type_name, encoding, text, _) in left_out.items():
            publish(writer, topic, type_name, encoding, text, lambda i: b"\0\1\0\0\1")
        writer.finish()
    received, output = play(tmp_path, path, "--delay", 30)
    assert [message.position.z for message in received["state"]] == [float(i) for i in range(20)]
    assert "other.mcap has no checksums" in output
    for topic, (*_, why) in left_out.items():
        assert any(f"{topic}: left out" in line and why in line for line in output.splitlines()), output
    assert "Traceback" not in output
    refused = replay("--verify", path)
    assert refused.returncode == 1
    assert "aircraft and options are missing" in refused.stderr
    assert "`ros2 bag` cannot record them" in refused.stderr


def test_a_depth_that_the_log_does_not_know_is_that_of_state_topics():
    """What `ros2 bag record` of rosbag2 0.26.5 writes with Fast DDS, which does not tell it history and depth."""
    qos = recorded_qos(
        "- history: unknown\n  depth: 0\n  reliability: reliable\n  durability: transient_local\n  deadline:\n"
        "    sec: 9223372036\n    nsec: 854775807\n  liveliness: automatic\n"
    )
    assert (qos.history, qos.depth) == (HistoryPolicy.KEEP_LAST, 10)
    assert (qos.reliability, qos.durability) == (ReliabilityPolicy.RELIABLE, DurabilityPolicy.TRANSIENT_LOCAL)
    for depth, kept in ((1, 1), (100, 100)):
        text = f"- {{history: keep_last, depth: {depth}, reliability: reliable, durability: volatile}}"
        assert recorded_qos(text).depth == kept


def test_messages_that_are_none_are_left_out_and_all_others_are_played(tmp_path):
    """Too short, of lengths that cannot be, or refused by ROS: one line for each topic, and the exit code."""
    from mcap.writer import Writer

    from sbs_sim.nodes.message_types import definition_file
    from sbs_sim.recording import message_definition

    def number(i):
        return struct.pack("<4Bd", 0, 1, 0, 0, i)

    messages = {
        "/good": ("Float64", number),
        "/packed": ("Float64", lambda i: zstandard.compress(number(i))),  # as rosbag2 can do with each
        "/short": ("Float64", lambda i: number(i)[:-1]),
        "/long": ("Float64", lambda i: number(i) + (b"\0" if i % 2 else b"")),
        "/text": ("String", lambda i: struct.pack("<4BI", 0, 1, 0, 0, 1000) + b"abc\0"),
    }
    path = tmp_path / "a.mcap"
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start("ros2", "somebody")
        for topic, (name, data) in messages.items():
            kind = f"std_msgs/msg/{name}"
            schema = writer.register_schema(kind, "ros2msg", message_definition(kind, definition_file).encode())
            channel = writer.register_channel(topic, "cdr", schema)
            for i in range(10):
                writer.add_message(channel, i * 10_000_000, data(i), 0)
        writer.finish()
    with world(next(DOMAINS), tmp_path) as made:
        for topic, (name, _) in messages.items():
            made.client.watch(topic, {"Float64": Float64, "String": String}[name])
        found = replay(path, "--delay", 30, domain=made.domain)
        made.client.until(lambda: len(made.client.messages["/packed"]) == 10, "what is good")
        received = {topic: [message.data for message in made.client.messages[topic]] for topic in messages}
    everything = [float(i) for i in range(10)]
    half = everything[::2]
    assert received == {"/good": everything, "/packed": everything, "/short": [], "/long": half, "/text": []}
    assert found.returncode == 1
    lines = found.stderr.splitlines()
    assert len(lines) == 4
    for topic, why in (
        ("/short", "11 bytes"),
        ("/long", "ROS does not publish these 13 bytes"),
        ("/text", "1000 values"),
    ):
        (line,) = (line for line in lines if f"{topic}: messages are left out" in line)
        assert why in line
    counts = "5 of /long, 10 of /short, 10 of /text"
    assert lines[-1] == f"{path}: messages that are not of their type were left out: {counts}"


def test_two_flights_in_one_file_are_listed_and_can_be_chosen(tmp_path, recorded):
    heavy, both = tmp_path / "heavy.mcap", tmp_path / "both.mcap"
    fly_with(flight_of(read(recorded)), ["body.mass=23"], 10**6, heavy)
    merge(both, recorded, heavy)
    titles = [f"{number} is /state started {wall}" for number, wall in enumerate(map(begin, (recorded, heavy)), 1)]
    found = replay(both, domain=next(DOMAINS))
    assert found.returncode == 1
    assert found.stderr == (
        f"{both} holds 2 flights, choose one by --flight NUMBER (in Python of log.flights): {'; '.join(titles)}\n"
    )
    refused = replay("--verify", both)
    assert refused.returncode == 1
    assert "choose one by --flight" in refused.stderr
    assert len(refused.stderr.splitlines()) == 1
    assert replay("--verify", both, "--flight", 2).returncode == 0
    received, output = play(tmp_path, both, "--flight", 2, "--delay", 30, "--rate", 3)
    assert "Traceback" not in output
    heights = [message.position.z for message in received["state"]]
    flown = iter(read(heavy)["state"]["position.z"].tolist())
    assert len(heights) > 50
    assert all(height in flown for height in heights)  # in order; a busy machine may lose some
    twice = merge(tmp_path / "twice.mcap", recorded, recorded)
    with pytest.raises(RecordingError, match=r"twice.mcap has 2 starts of a flight on /events"):
        flight_of(read(twice))


def begin(path):
    return read(path).metadata["recording"]["wall_start"]


def test_names_that_no_file_can_have_are_one_line(tmp_path):
    name = "a" * 300
    for mode in (["--recover"], ["--with", "body.mass=23", "--end", "0.05"]):
        found = replay(*mode, HOVER_STEP, "--output", tmp_path / name)
        assert found.returncode == 1
        assert found.stderr == f"cannot write {tmp_path / name}: File name too long\n"
    found = replay("--recover", name)
    assert found.returncode == 1
    assert found.stderr == f"cannot read {name}: File name too long\n"


def test_a_loop_over_an_instant_is_no_flood(tmp_path, recorded):
    with world(next(DOMAINS), tmp_path) as made:
        states = made.client.watch("state", BodyState)
        part = ["--start", "1", "--end", "1.005", "--loop", "--topics", "state"]
        command = [sys.executable, str(EXECUTABLES / "replay"), str(recorded), *part]
        process = subprocess.Popen(command, env=environment(made.domain))
        try:
            made.client.until(lambda: states, "a state")
            begin, before = time.monotonic(), len(states)
            made.client.until(lambda: len(states) >= before + 20, "20 passes")
            assert time.monotonic() - begin > 0.5  # 1 s, and no less if the machine is slow
        finally:
            process.kill()
            process.wait(PATIENCE)


def test_nothing_to_play_is_an_error(recorded):
    for arguments in (["--start", "1000"], ["--start", "1000", "--loop"], ["--topics", "trim_point", "--"]):
        found = replay(*arguments, recorded, domain=next(DOMAINS))
        assert found.returncode == 1
        assert "there is nothing to play" in found.stderr
        assert len(found.stderr.splitlines()) == 1


def test_the_log_that_comes_along_is_flown_again():
    """Recorded elsewhere, perhaps: the same bits where the versions are the same, else within the tolerance."""
    assert HOVER_STEP.stat().st_size < 1_000_000
    log = read(HOVER_STEP)
    assert log.complete
    for name in ("collective", "lateral_cyclic", "longitudinal_cyclic", "differential_longitudinal_cyclic"):
        assert np.ptp(log["controls"][name]) == pytest.approx(math.radians(0.5), rel=1e-6)
    found = replay("--verify", HOVER_STEP)
    assert found.returncode == 0, found.stdout
    same = not differences(log.metadata["versions"])
    assert found.stdout.startswith(
        f"identical, {len(log['state'].time)} states\n" if same else ("identical", "within the tolerance of 1e-06")
    )


def test_a_log_comes_again_bit_for_bit_for_another_target(tmp_path, hover):
    """With other registers and another optimisation; more of that: tools/robustness/compare_bits.py."""
    path = fly(tmp_path, lambda made: wiggle(made, hover, 0.5), method="rk4")
    target = "haswell" if surroundings()["target"] != "haswell" else "x86-64-v3"
    anew = {"NUMBA_CPU_NAME": target, "NUMBA_CPU_FEATURES": "", "NUMBA_OPT": "1", "NUMBA_CACHE_DIR": str(tmp_path)}
    found = replay("--verify", path, **anew)
    assert found.returncode == 0, found.stdout
    assert found.stdout == f"identical, {len(read(path)['state'].time)} states\n"


def test_commands_act_at_their_time_on_rotors_of_another_speed(tmp_path, hover):
    """Faster rotors take more steps to a tick, and the events are counted in steps."""
    path = fly(tmp_path, lambda made: wiggle(made, hover, 0.5))
    fast = tmp_path / "fast.mcap"
    changes = [f"rotors[{j}].speed_rpm=3000" for j in (0, 1)]
    found = replay("--with", changes[0], "--with", changes[1], "--output", fast, path)
    assert found.returncode == 0, found.stderr
    before, after = read(path), read(fast)
    # 0.01 s are 10 steps of 14.4 deg at most at 2400 rpm, 13 at 3000 rpm
    np.testing.assert_array_equal(after["events"]["step"] / 13, before["events"]["step"] / 10)
    assert after["state"].time[-1] == pytest.approx(before["state"].time[-1])
    assert_identical(fast)
