"""Tells what the cockpit costs the flight: `./run python benchmarks/cockpit.py`.

A simulator in real time alone, with a cockpit that nobody looks at, with a client that takes every picture and draws
none, and with a page in headless Chromium. That page is drawn in software, and so takes the cores that a graphics card
would spare.
"""

import argparse
import contextlib
import math
import os
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec
import psutil
import rclpy
import viser
import zstandard
from rclpy.node import Node
from websockets.sync.client import connect
from websockets.typing import Subprotocol

from sbs_msgs.msg import SimulationStatus
from sbs_msgs.srv import Reset

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "test" / "support"))

import browser  # noqa: E402

EXECUTABLES = ROOT / "install" / "sbs_sim" / "lib" / "sbs_sim"
SETTLING = 3.0  # s before a measurement
BLADES = "/ned1/body/rotor0/blades"  # what every picture of a flight changes
COUNT_FRAMES = """seconds => new Promise(done => {
    const begin = performance.now(); let frames = 0;
    const next = () => performance.now() - begin < 1e3 * seconds
        ? (frames++, requestAnimationFrame(next)) : done(frames / seconds);
    requestAnimationFrame(next);
})"""


CAMERA = {
    "type": "ViewerCameraMessage",
    "wxyz": (1.0, 0.0, 0.0, 0.0),
    "position": (-2.0, 1.2, 1.0),
    "look_at": (0.0, 0.0, 0.0),
    "up_direction": (0.0, 0.0, 1.0),
    "fov": 0.8,
    "near": 0.01,
    "far": 1e3,
    "image_height": 800,
    "image_width": 1280,
}


class Watch(Node):
    """Keeps the latest status of the simulator."""

    def __init__(self) -> None:
        super().__init__("watch")
        self.status: SimulationStatus | None = None
        self.create_subscription(SimulationStatus, "status", self._keep, 1)
        self._reset = self.create_client(Reset, "reset")

    def hover(self) -> None:
        """Put the flight back to its trim, which it leaves within a minute or two."""
        self._reset.wait_for_service(10.0)
        answer = self._reset.call_async(Reset.Request())
        rclpy.spin_until_future_complete(self, answer, timeout_sec=10.0)
        if not answer.done() or not answer.result().success:
            raise RuntimeError("the flight is not put back to its trim")

    def _keep(self, status: SimulationStatus) -> None:
        self.status = status

    def latest(self) -> SimulationStatus:
        """A status that is published from now on."""
        self.status = None
        while self.status is None:
            rclpy.spin_once(self, timeout_sec=1.0)
        return self.status


class Taker:
    """A client in a thread that takes what the cockpit sends, and draws nothing.

    Parameters
    ----------
    port : int
    """

    def __init__(self, port: int) -> None:
        subprotocol = Subprotocol(f"viser-v{viser.__version__}")
        self._client = connect(f"ws://127.0.0.1:{port}", subprotocols=[subprotocol], proxy=None, max_size=None)
        self._client.send(msgspec.msgpack.encode(CAMERA))  # viser counts those who look from somewhere
        self._pictures: list[float] = []
        self._bytes = 0
        self._thread = threading.Thread(target=self._take, daemon=True)

    def __enter__(self) -> "Taker":
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._client.close()
        self._thread.join()

    def _take(self) -> None:
        """Count the windows in which the first rotor's blades turn: one of each picture, which may come in several."""
        for data in self._client:
            self._bytes += len(data) if self._pictures else 0  # not the scene, which comes first
            size = int.from_bytes(data[8:16], "little")
            sent = zstandard.ZstdDecompressor().decompress(data[16 : 16 + size])
            messages = msgspec.msgpack.decode(sent)["messages"]
            if any(one.get("name") == BLADES and "batched_wxyzs" in one.get("updates", {}) for one in messages):
                self._pictures.append(time.monotonic())

    def rate(self) -> float:
        """Pictures per second; not a number where there were none."""
        if len(self._pictures) < 2:
            return math.nan
        return (len(self._pictures) - 1) / (self._pictures[-1] - self._pictures[0])

    def traffic(self) -> float:
        """What came [kB/s]."""
        return 1e-3 * self._bytes / (time.monotonic() - self._pictures[0]) if self._pictures else math.nan


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=20.0, help="wall time of each measurement")
    seconds = parser.parse_args().seconds
    os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
    os.environ.setdefault("ROS_DOMAIN_ID", "96")
    rclpy.init()
    watch = Watch()
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    print(f"{psutil.cpu_count()} cores, load {os.getloadavg()[0]:.1f} at the start")
    print(f"{'':34}{'missed':>8}{'ticks':>7}{'simulator':>11}{'cockpit':>9}")
    with tempfile.TemporaryDirectory() as bags:
        os.environ["SBS_SIM_BAGS"] = bags
        with started("simulator") as simulator:
            row("simulator alone", watch, seconds, simulator, None)
            with started("cockpit", "--attach", "--port", str(port)) as cockpit:
                wait_for_page(port)
                row("with a cockpit", watch, seconds, simulator, cockpit)
                with Taker(port) as taker:
                    row("with a client that does not draw", watch, seconds, simulator, cockpit)
                    print(f"the client gets {taker.rate():.1f} pictures/s, {taker.traffic():.0f} kB/s", flush=True)
                if reason := browser.missing():
                    print(reason)
                else:
                    with browser.page(f"http://127.0.0.1:{port}") as page:
                        row("with a cockpit and its page", watch, seconds, simulator, cockpit)
                        watch.hover()
                        tell_frames(page)
    rclpy.shutdown()


@contextlib.contextmanager
def started(name: str, *arguments: str) -> Iterator[psutil.Process]:
    """An executable, ended at the end."""
    process = subprocess.Popen([sys.executable, str(EXECUTABLES / name), *arguments])
    try:
        yield psutil.Process(process.pid)
    finally:
        process.terminate()
        process.wait(30)


def wait_for_page(port: int) -> None:
    """Wait until the cockpit listens."""
    while True:
        with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", port), 1.0):
            return
        time.sleep(0.1)


def row(name: str, watch: Watch, seconds: float, simulator: psutil.Process, cockpit: psutil.Process | None) -> None:
    """Missed deadlines and processor time, over wall time, of some seconds."""
    watch.hover()
    time.sleep(SETTLING)
    begin = watch.latest()
    processes = [one for one in (simulator, cockpit) if one is not None]
    for one in processes:
        one.cpu_percent()
    time.sleep(seconds)
    used = [f"{one.cpu_percent():.0f} %" for one in processes] + ["-"]
    end = watch.latest()
    missed = end.missed_deadlines - begin.missed_deadlines
    ticks = round((end.sim_time - begin.sim_time) * 100.0)
    print(f"{name:34}{missed:>8}{ticks:>7}{used[0]:>11}{used[1]:>9}", flush=True)


def tell_frames(page: Any) -> None:
    """Frames that the page draws, and pictures that the cockpit sends."""
    received: list[float] = []
    page.on("websocket", lambda socket: socket.on("framereceived", lambda _: received.append(time.monotonic())))
    page.reload()
    page.get_by_role("img", name="artificial horizon").wait_for()
    page.wait_for_timeout(1e3 * SETTLING)
    begin, since = len(received), time.monotonic()
    frames = page.evaluate(COUNT_FRAMES, 5.0)
    rate = (len(received) - begin) / (time.monotonic() - since)
    print(f"the page draws {frames:.0f} frames/s and gets {rate:.0f} messages/s")


if __name__ == "__main__":
    main()
