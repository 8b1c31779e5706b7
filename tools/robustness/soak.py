"""Fly for hours, answer for minutes, and see that nothing grows and nothing is lost.

    ./run python tools/robustness/soak.py [--hours 8] [--minutes 20] [--out build/soak]

First hours of simulated flight as fast as every tick can be published: tools/hover_controller.py holds hover in
turbulence, step by step. Then minutes of real time in which eight clients call every service at random. Memory and
open files of the simulator are taken all along and drawn (memory.svg); no request may stay without an answer, and the
logs must be flown again bit for bit. The exit code is 1 if something of that does not hold.

A flight of hours makes a log of about 50 MB an hour in the folder, and the clients begin and end others; all are
verified, and deleted if they come again.
"""

import argparse
import contextlib
import json
import random
import sys
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np
import psutil

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "test" / "support"), str(ROOT / "tools")]

from geometry_msgs.msg import Point, Vector3  # noqa: E402
from hover_controller import HoverLaw  # noqa: E402
from ros_harness import DOMAINS, Client, World, controls_message, world  # noqa: E402
from std_srvs.srv import SetBool  # noqa: E402

from sbs_msgs.msg import BodyState, Controls, SimulationStatus, SwashplateArray  # noqa: E402
from sbs_msgs.srv import Linearize, Record, Reset, SetWind, Step, Trim  # noqa: E402
from sbs_sim import Aircraft  # noqa: E402
from sbs_sim.errors import SbsError  # noqa: E402
from sbs_sim.model.frames import quaternion_to_euler  # noqa: E402
from sbs_sim.nodes.qos import SERVICE_QOS  # noqa: E402
from sbs_sim.recording import read  # noqa: E402
from sbs_sim.recording.recorded_flight import flight_of  # noqa: E402
from sbs_sim.recording.verification import verify  # noqa: E402

TURBULENCE = Vector3(x=1.5, y=1.5, z=0.8)  # m/s, moderate air near the ground
WARM = 0.2  # share of the time after which the memory must not grow any more
GROWTH = 0.05  # of it
CLIENTS = 8
RATE = 12.5  # Hz, of states and controls in the long flight: each of them is published, recorded and answered
PATIENCE = 60.0  # s for an answer while seven others ask


class Watch(threading.Thread):
    """Takes memory and open files of a process until stopped."""

    def __init__(self, pid: int, seconds: float) -> None:
        super().__init__(daemon=True)
        self._process, self._period = psutil.Process(pid), max(0.2, min(30.0, seconds / 400))
        self._end = threading.Event()
        self.rows: list[tuple[float, float, int]] = []
        self.start()

    def run(self) -> None:
        """Take a row now and then."""
        begin = time.monotonic()
        while not self._end.wait(self._period):
            memory = self._process.memory_info().rss / 1e6
            self.rows.append((time.monotonic() - begin, memory, self._process.num_fds()))

    def stop(self) -> np.ndarray:
        """All rows: time [s], memory [MB], open files."""
        self._end.set()
        self.join()
        return np.array(self.rows)


def is_flat(rows: np.ndarray) -> tuple[bool, str]:
    """Memory and files at the end against those once all is loaded; medians, for caches come and go."""
    late = rows[rows[:, 0] > WARM * rows[-1, 0]]
    part = max(1, len(late) // 10)
    first, last = (np.median(piece[:, 1:], axis=0) for piece in (late[:part], late[-part:]))
    text = f"memory {first[0]:.1f} to {last[0]:.1f} MB, open files {first[1]:.0f} to {last[1]:.0f}"
    return last[0] <= first[0] * (1 + GROWTH) and last[1] <= first[1] + 1, text


def fly(made: World, hours: float, log: Path) -> tuple[list[str], bool, np.ndarray]:
    """Hold hover for hours of simulated time; what happened, whether that is good, and the memory."""
    simulator = made.start("simulator", real_time_factor=0.0, publish_rate=RATE, record=log)
    client = made.client
    client.watch("state", BodyState)
    client.next("state")
    assert client.call(SetBool, "pause", data=True).success
    assert client.call(Reset, "reset").success
    assert client.call(SetWind, "set_wind", turbulence_intensity=TURBULENCE, turbulence_seed=1).success
    watch, begin = Watch(simulator.pid, hours * 3600 / 4), time.monotonic()
    flown, farthest, fault = _hold(made, hours * 3600)
    seconds, rows = time.monotonic() - begin, watch.stop()
    client.watch("status", SimulationStatus)
    status = client.next("status")
    flat, text = is_flat(rows)
    ended = simulator.interrupt()
    words = [f"{flown / 3600:.3f} h flown in {seconds:.0f} s, {farthest:.1f} m from the target at most", text]
    words += [f"{status.log_dropped} messages not recorded, {status.dropped_messages} ticks not published", fault]
    good = flat and ended == 0 and not fault and farthest < 20.0
    return [word for word in words if word], good and status.log_dropped == status.dropped_messages == 0, rows


def _hold(made: World, seconds: float) -> tuple[float, float, str]:
    """Hold hover step by step, every command in force before the next, so that no load on the machine comes between.

    Returns the time flown [s], the largest distance from the target along an axis [m], and why it ended early.
    """
    client, law = made.client, HoverLaw(Aircraft.load("sbs"))
    steps = client.node.create_client(Step, "step")
    pilot = client.node.create_publisher(Controls, "controls", 1)
    states, plates = client.messages["state"], client.watch("swashplate", SwashplateArray)
    request, time_now, farthest = Step.Request(ticks=1), 0.0, 0.0
    first: float | None = None
    with contextlib.suppress(KeyboardInterrupt):  # what has been flown by then is printed
        while first is None or time_now - first < seconds:
            state = states[-1]
            del states[:-1]
            position = point(state.position)
            farthest = max(farthest, float(np.abs(position).max()))
            q = state.attitude
            euler = quaternion_to_euler(np.array([q.w, q.x, q.y, q.z]))
            message = controls_message(
                law.controls(position, euler, point(state.velocity), point(state.angular_velocity))
            )
            message.header.stamp = state.header.stamp
            pilot.publish(message)
            client.until(lambda since=state: plates and stamp(plates[-1]) > stamp(since) - 1e-6, "its swashplate")
            del plates[:-1]
            answer = steps.call_async(request)
            client.until(answer.done, "a step")
            if not answer.result().success:
                return time_now, farthest, answer.result().message
            time_now = answer.result().sim_time
            first = time_now if first is None else first
            client.until(lambda flown=time_now: stamp(states[-1]) > flown - 1e-6, "its state")
    return time_now, farthest, ""


def point(vector: Any) -> np.ndarray:
    """Components of a vector, shape (3,)."""
    return np.array([vector.x, vector.y, vector.z])


def stamp(message: Any) -> float:
    """Time of a message [s]."""
    return float(message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec)


def requests(chance: random.Random) -> tuple[str, Any, dict[str, Any]]:
    """A service with a request, right or wrong."""
    wild = chance.choice([0.0, 5.0, -3.0, 12.0, 1e9, float("nan")])
    return chance.choice(
        [
            ("trim", Trim, {"airspeed": wild}),
            ("trim", Trim, {"climb_rate": wild / 10, "azimuth_count": chance.choice([4, 12, 0])}),
            ("linearize", Linearize, {"airspeed": wild, "method": chance.choice(["averaged", "paper", "x"])}),
            ("reset", Reset, {"airspeed": wild, "position": Point(z=-10.0)}),
            ("reset", Reset, {"from_state": True, "state": [wild] * chance.choice([3, 43])}),
            ("set_wind", SetWind, {"velocity": Vector3(x=wild), "turbulence_intensity": TURBULENCE}),
            ("set_wind", SetWind, {}),
            ("pause", SetBool, {"data": chance.random() < 0.5}),
            ("step", Step, {"ticks": chance.choice([0, 1, 5, 50, 5000])}),
            ("record", Record, {"record": chance.random() < 0.5, "path": chance.choice(["", "/nowhere/a.mcap"])}),
        ]
    )


class Caller(threading.Thread):
    """A client that calls services until the end and counts."""

    def __init__(self, domain: int, seed: int, end: float) -> None:
        super().__init__()
        self._client, self._chance, self._end = Client(domain, f"caller_{seed}"), random.Random(seed), end
        self.calls, self.missed, self.slowest, self.reported = 0, 0, 0.0, ""

    def run(self) -> None:
        """Call."""
        ends = {}
        while time.monotonic() < self._end:
            name, kind, fields = requests(self._chance)
            if name not in ends:
                ends[name] = self._client.node.create_client(kind, name, qos_profile=SERVICE_QOS)
                self._client.until(ends[name].service_is_ready, name)
            begin = time.monotonic()
            answer = ends[name].call_async(kind.Request(**fields))
            while not answer.done() and time.monotonic() - begin < PATIENCE:
                self._client._executor.spin_once(timeout_sec=0.05)
            self.calls += 1
            self.slowest = max(self.slowest, time.monotonic() - begin)
            if not answer.done():
                self.missed += 1
                self.reported = f"{name} {fields}"
            elif "internal error" in answer.result().message:
                self.missed += 1
                self.reported = answer.result().message
        self._client.close()


def call(made: World, minutes: float, log: Path) -> tuple[list[str], bool, np.ndarray]:
    """Eight clients call every service in real time; what happened, whether that is good, and the memory."""
    simulator = made.start("simulator", record=log)
    made.client.watch("state", BodyState)
    made.client.next("state")
    end = time.monotonic() + minutes * 60
    watch = Watch(simulator.pid, minutes * 60)
    callers = [Caller(made.domain, seed, end) for seed in range(CLIENTS)]
    for caller in callers:
        caller.start()
    for caller in callers:
        caller.join()
    rows = watch.stop()
    flat, text = is_flat(rows)
    assert made.client.call(Reset, "reset").success
    ended = simulator.interrupt()
    calls, missed = sum(caller.calls for caller in callers), sum(caller.missed for caller in callers)
    slowest = max(caller.slowest for caller in callers)
    words = [f"{calls} requests of {CLIENTS} clients, {missed} without an answer, slowest {slowest:.2f} s", text]
    words += [caller.reported for caller in callers if caller.reported][:3]
    return words, flat and missed == 0 and ended == 0, rows


def verified(logs: list[Path]) -> tuple[str, bool]:
    """What flying the logs again says of them, and whether all come again bit for bit; then they are deleted."""
    size, states, wrong = 0.0, 0, []
    for log in logs:
        size += log.stat().st_size / 1e6
        try:
            found = verify(flight_of(read(log)))
        except SbsError as error:
            wrong.append(f"{log.name}: {error}")
            continue
        states += found.states
        if found.identical:
            log.unlink()
        else:
            wrong.append(f"{log.name}: {found.first}")
    text = f"{len(logs)} logs of {size:.1f} MB, {len(wrong)} not flown again bit for bit, {states} states"
    return "; ".join([text, *wrong[:3]]), not wrong


def draw(parts: dict[str, np.ndarray], path: Path) -> None:
    """Memory and open files over time."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8, 2.4 * len(parts)), layout="constrained")
    FigureCanvasAgg(figure)
    for axes, (name, rows) in zip(np.atleast_1d(figure.subplots(len(parts), 1)), parts.items(), strict=True):
        axes.plot(rows[:, 0] / 60, rows[:, 1], label="memory [MB]")
        axes.plot(rows[:, 0] / 60, rows[:, 2], label="open files")
        axes.set(title=name, xlabel="wall time [min]", ylim=(0, None))
        axes.legend()
    figure.savefig(path)


def main() -> int:
    """Do what the command line asks for; the exit code."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--hours", type=float, default=8.0, help="of simulated flight; 0 leaves it out")
    parser.add_argument("--minutes", type=float, default=20.0, help="of services; 0 leaves them out")
    parser.add_argument("--out", type=Path, default=ROOT / "build" / "soak")
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    wrong, parts = 0, {}
    for name, part, amount in (("flight", fly, arguments.hours), ("services", call, arguments.minutes)):
        if not amount:
            continue
        log = arguments.out / f"{name}.mcap"
        log.unlink(missing_ok=True)
        with world(next(DOMAINS), arguments.out) as made:
            words, good, parts[name] = part(made, amount, log)
        text, whole = verified([log, *(arguments.out / "bags").glob("*.mcap")])
        good = good and whole
        print(f"{name}: {'good' if good else 'WRONG'}: {'; '.join(words)}; {text}", flush=True)
        wrong += not good
    draw(parts, arguments.out / "memory.svg")
    (arguments.out / "memory.json").write_text(json.dumps({name: rows.tolist() for name, rows in parts.items()}))
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
