"""A standard output or error output that nobody reads: nothing waits for it, and nothing of a flight is lost."""

import contextlib
import fcntl
import io
import os
import select
import signal
import subprocess
import sys
import threading
import time

import pytest

rclpy = pytest.importorskip("rclpy")

from ros_harness import DOMAINS, EXECUTABLES, PATIENCE, controls_message, environment, world  # noqa: E402
from std_srvs.srv import SetBool  # noqa: E402

from sbs_msgs.msg import BodyState, Controls  # noqa: E402
from sbs_sim.nodes.standard_streams import NonBlockingWriter  # noqa: E402
from sbs_sim.recording import read  # noqa: E402

WARNING = "controls rejected: "


@contextlib.contextmanager
def full_pipe():
    """Write end of a pipe without any room, and the read end."""
    reader, writer = os.pipe()
    fcntl.fcntl(writer, fcntl.F_SETPIPE_SZ, 4096)
    os.set_blocking(writer, False)
    with contextlib.suppress(BlockingIOError):
        while True:
            os.write(writer, b"x" * 512)
    os.set_blocking(writer, True)  # as whoever starts a process has it
    try:
        yield reader, writer
    finally:
        os.close(reader)
        os.close(writer)


def test_a_flight_does_not_wait_for_who_reads_its_errors(tmp_path):
    """From the first line on there is no room: the flight, its services, its pilot and its end do not mind."""
    with world(next(DOMAINS), tmp_path) as made, full_pipe() as (_, stuck):
        own = {**environment(made.domain, tmp_path), "ROS_LOG_DIR": str(tmp_path / "ros")}

        def start(name):
            command = [sys.executable, str(EXECUTABLES / name)]
            return subprocess.Popen(command, stdout=stuck, stderr=stuck, env=own, cwd=tmp_path)

        processes = [start("simulator"), start("hover_hold")]
        try:
            client = made.client
            client.watch("state", BodyState)
            client.watch("controls", Controls)
            client.next("state")
            client.next("controls")  # the pilot has printed its design
            for _ in range(3):
                client.publish("controls", controls_message([float("nan"), 0, 0, 0]))
                client.spin(0.1)
            assert client.call(SetBool, "pause", data=True).success
            for process in reversed(processes):
                process.send_signal(signal.SIGINT)
                assert process.wait(PATIENCE / 2) == 0
        finally:
            for process in processes:
                process.kill()
                process.wait()
        lines = "".join(path.read_text() for path in (tmp_path / "ros").glob("*.log"))
        assert "trimmed with" in lines
        assert WARNING in lines
        (path,) = (tmp_path / "bags").glob("*.mcap")
        assert read(path).complete


def test_a_reader_who_is_slow_gets_all_and_one_who_is_gone_disturbs_nobody():
    lines = [f"line {number}\n" for number in range(2000)]  # several times as much as there is room for
    reader, writer = os.pipe()
    fcntl.fcntl(writer, fcntl.F_SETPIPE_SZ, 4096)
    os.set_blocking(writer, False)
    read_slowly = []

    def work():
        with os.fdopen(reader, "rb", buffering=0) as source:
            while data := source.read(4096):
                read_slowly.append(data)
                time.sleep(0.002)

    thread = threading.Thread(target=work)
    thread.start()
    stream = io.TextIOWrapper(io.BufferedWriter(NonBlockingWriter(writer)), line_buffering=True)
    for line in lines:
        print(line, end="", file=stream)
    os.close(writer)
    thread.join()
    assert b"".join(read_slowly).decode() == "".join(lines)
    reader, writer = os.pipe()
    os.close(reader)
    stream = io.TextIOWrapper(io.BufferedWriter(NonBlockingWriter(writer)), line_buffering=True)
    print("nobody hears this", file=stream)
    os.close(writer)


PRINTS = """
import os, signal
from sbs_sim.nodes.executables import _end_at_once_when_interrupted as begin
begin()
print("said")
print("told", file=__import__("sys").stderr)
os.write(1, b"and more")
"""


@pytest.mark.parametrize("mode", ["pipe", "file", "closed", "terminal"])
def test_what_is_read_arrives_completely_and_the_output_of_others_keeps_its_flags(tmp_path, mode):
    command = [sys.executable, "-c", PRINTS]
    if mode == "closed":
        ended = subprocess.run(["sh", "-c", 'exec "$0" "$@" >&- 2>&-', *command], check=False)
        assert ended.returncode in (0, 1)  # the plain write has nowhere to go
        return
    if mode == "terminal":
        reader, writer = os.openpty()
    elif mode == "file":
        writer = os.open(tmp_path / "out", os.O_WRONLY | os.O_CREAT)
        reader = os.open(tmp_path / "out", os.O_RDONLY)
    else:
        reader, writer = os.pipe()
    assert subprocess.run(command, stdout=writer, stderr=writer, check=False).returncode == 0
    assert os.get_blocking(writer)
    expected, seen = b"said\ntold\nand more", b""
    # a terminal hands on what was written line by line
    while len(seen) < len(expected) and select.select([reader], [], [], PATIENCE)[0]:
        if not (part := os.read(reader, 1000)):
            break
        seen += part.replace(b"\r", b"")
    assert seen == expected
    os.close(reader)
    os.close(writer)
