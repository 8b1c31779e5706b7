"""Break a running system in many ways and print what happened.

    ./run python tools/robustness/faults.py [NAME ...] [--list]

Real processes over real DDS on loopback: the simulator with its recorder, the control mixer, the analysis and the hover
hold as the controller, each on its own. They are killed one by one and in pairs, sent commands that are late,
doubled, out of order or ten thousand a second, given a host whose clock jumps, readers that do not read, fifty
neighbours, a full disk and a fifth of a processor. A line per fault says what the others did and said; the exit code
is 1 if one went wrong.
"""

import argparse
import contextlib
import itertools
import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
import urllib.request
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import psutil

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "test" / "support"), str(ROOT / "tools")]

from diagnostic_msgs.msg import DiagnosticArray  # noqa: E402
from ros_harness import DOMAINS, EXECUTABLES, World, controls_message, environment, world  # noqa: E402

from sbs_msgs.msg import BodyState, FlightEvent, SimulationStatus, SwashplateArray  # noqa: E402
from sbs_msgs.srv import Trim  # noqa: E402
from sbs_sim import Aircraft, trim  # noqa: E402

PARTS = ("simulator", "control_mixer", "analysis", "hover_hold")
# What the others say in their diagnostics when a part is gone; nobody needs the analysis to fly.
MISSED = {
    "control_mixer": ("simulator", "swashplate has lost its publisher"),
    "hover_hold": ("control_mixer", "controls has lost its publisher"),
    "simulator": ("control_mixer", "no simulator: no node publishes /clock"),
}
LEASE = 40.0  # s: DDS takes 20 to miss somebody who left without a word
PACE = 0.97  # real-time factor that counts as real time
FLOOD = 10_000  # commands a second


class System:
    """Simulator, mixer, analysis and hover hold as processes of their own, with a client that watches."""

    def __init__(self, made: World, parts: tuple[str, ...] = PARTS, **parameters: Any) -> None:
        self.world, self.client = made, made.client
        self.parameters = {"components": "[simulator, recorder]", **parameters}
        self.parts: dict[str, Any] = {}
        self.states = made.client.watch("state", BodyState)
        self.swashplates = made.client.watch("swashplate", SwashplateArray)
        self.health = made.client.watch("diagnostics", DiagnosticArray)
        made.client.watch("status", SimulationStatus)
        self.events = made.client.watch("events", FlightEvent, latched=True)
        for part in parts:
            self.start(part)
        made.client.next("state")

    def start(self, part: str) -> None:
        """Start a part, or start it again."""
        if part == "simulator":
            log = self.world.folder / f"{time.monotonic_ns()}.mcap"
            self.parts[part] = self.world.start(part, **{"record": log, **self.parameters})
            self.parts[part].record = log
        else:
            self.parts[part] = self.world.start(part)

    def status(self) -> Any:
        """The next status."""
        return self.client.next("status")

    def watch(self, seconds: float) -> list[Any]:
        """Statuses of so many seconds."""
        seen = len(self.client.messages["status"])
        self.client.spin(seconds)
        return self.client.messages["status"][seen:]

    def hears(self, name: str, text: str, patience: float = LEASE, since: int | None = None) -> bool:
        """True once a node says something in its diagnostics, from now on or from one of those kept."""
        end = time.monotonic() + patience
        seen = len(self.health) if since is None else since
        while time.monotonic() < end:
            self.client.spin(0.2)
            said = [status.message for array in self.health[seen:] for status in array.status if status.name == name]
            if any(text in line for line in said):
                return True
        return False

    def level(self, name: str) -> bytes:
        """Level of the next diagnostics of a node."""
        found = self.client.next("diagnostics", lambda array: any(status.name == name for status in array.status))
        return next(status.level for status in found.status if status.name == name)

    def flies(self) -> bool:
        """True if commands reach the swashplates and the aircraft stays where it should."""
        before = len(self.swashplates)
        state = self.client.next("state")
        with contextlib.suppress(AssertionError):
            self.client.until(lambda: len(self.swashplates) > before + 20, "commands")
            return bool(np.isfinite(state.position.x))
        return False

    def trims(self) -> bool:
        """True if the analysis answers; what is asked before DDS knows the new one goes to the dead one."""
        asked = self.client.node.create_client(Trim, "trim")
        for _ in range(round(LEASE / 2)):
            answer = asked.call_async(Trim.Request())
            self.client.spin(2.0)
            if answer.done():
                return bool(answer.result().success)
        return False


def _tool(made: World, name: str, *arguments: str, **more: str) -> Any:
    """A script of tools/ as a process that ends with the world."""
    process = _Script([sys.executable, str(ROOT / "tools" / name), *arguments], {**environment(made.domain), **more})
    made.processes.append(process)
    return process


class _Script:
    """A process like `ros_harness.Process`, of a script."""

    def __init__(self, command: list[str], variables: dict[str, str]) -> None:
        self.popen = subprocess.Popen(command, env=variables, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        self.pid = self.popen.pid

    @property
    def running(self) -> bool:
        return self.popen.poll() is None

    def kill(self) -> None:
        if self.running:
            self.popen.send_signal(signal.SIGCONT)
            self.popen.kill()
            self.popen.wait()


@contextlib.contextmanager
def system(parts: tuple[str, ...] = PARTS, **parameters: Any) -> Iterator[System]:
    """A system in a domain of its own that ends with the context."""
    with tempfile.TemporaryDirectory() as name, world(next(DOMAINS), Path(name)) as made:
        yield System(made, parts, **parameters)


def replayed(log: Path, *options: str) -> str:
    """What `replay` says of a log."""
    command = [sys.executable, str(EXECUTABLES / "replay"), *options, str(log)]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=900, check=False)
    return (ended.stdout + ended.stderr).strip().splitlines()[-1]


# --- the faults: each returns what happened, and whether that is good ------------------------------------------------


def killed(*victims: str) -> tuple[str, bool]:
    """Kill -9 of parts; the rest goes on and says what is missing; the parts come back and join."""
    with system() as made:
        made.client.until(lambda: len(made.swashplates) > 20, "commands")  # who has not been there is not missed
        made.client.spin(2.0)
        steps = made.status().steps
        for victim in victims:
            made.parts[victim].kill()
        others = [part for part in PARTS if part not in victims]
        listeners = {victim: MISSED[victim] for victim in victims if victim in MISSED and MISSED[victim][0] in others}
        heard = {victim: made.hears(*said) for victim, said in listeners.items()}
        good = all(made.parts[part].running for part in others) and all(heard.values())
        if "simulator" not in victims:
            good = good and made.status().steps > steps
        words = [f"{MISSED[v][0]}: {MISSED[v][1]!r}" for v, yes in heard.items() if yes]
        words += [f"{MISSED[v][0]} does not miss {v}" for v, yes in heard.items() if not yes]
        if "simulator" in victims:
            said = replayed(made.parts["simulator"].record, "--recover")
            words.append(f"log recovered ({said[:13]})")
        for victim in victims:
            made.start(victim)
        joined = made.flies() and made.trims()
        words.append("joined again" if joined else "did not join")
        return "; ".join(words), good and joined


def killed_cockpit() -> tuple[str, bool]:
    """Kill -9 of the cockpit that everybody looks at: the flight does not notice, and another one joins."""
    with system() as made, socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
        free.close()
        cockpit = made.world.start("cockpit", arguments=["--attach", "--port", str(port)])
        made.client.until(lambda: _served(port), "the page")
        cockpit.kill()
        pace = np.median([status.real_time_factor for status in made.watch(8.0)])
        again = made.world.start("cockpit", arguments=["--attach", "--port", str(port)])
        made.client.until(lambda: _served(port), "the page again")
        text = f"the flight goes on, real-time factor {pace:.2f}; another one serves the page"
        return text, made.flies() and pace > PACE and again.running


def _served(port: int) -> bool:
    with contextlib.suppress(OSError), urllib.request.urlopen(f"http://127.0.0.1:{port}", timeout=1.0) as answer:
        return bool(answer.status == 200)
    return False


def stamps() -> tuple[str, bool]:
    """Commands that are late, doubled, out of order, of another clock."""
    controls = trim(Aircraft.load("sbs")).controls
    with system(("simulator", "control_mixer")) as made:
        client = made.client

        def send(stamp: int) -> None:
            message = controls_message(controls)
            message.header.stamp.sec, message.header.stamp.nanosec = stamp // 10**9, stamp % 10**9
            client.publish("controls", message)
            client.spin(0.03)

        def now() -> int:
            return made.states[-1].header.stamp.sec * 10**9 + made.states[-1].header.stamp.nanosec

        client.spin(2.0)
        said, good = [], True
        for name, age, text in (
            ("stale", 1.0, "controls stamped up to "),
            ("future", -1.7e9, "controls stamped up to 1.7e+09 s ahead"),
        ):
            before = len(made.health)
            for _ in range(60):
                send(now() - round(age * 1e9))
            heard = made.hears("control_mixer", text, 3.0, before)
            said.append(f"{name}: taken, {'reported' if heard else 'NOT reported'}")
            good = good and heard
            client.spin(1.0)  # a clock of its own again
        before = _rejected(made)
        message = controls_message(controls)
        for _ in range(50):
            client.publish("controls", message)
            client.spin(0.01)
        same = _rejected(made) - before
        last = now()
        send(last)
        for i in range(10):
            send(last - 10**6 * (i + 1))
        late = _rejected(made) - before - same
        said.append(f"doubled: {same} refused; out of order: {late} of 10 refused")
        return "; ".join(said), good and same == 0 and late >= 5


def _rejected(made: System) -> int:
    made.client.spin(1.5)
    found = [s for array in made.health for s in array.status if s.name == "control_mixer"][-1]
    return next(int(pair.value) for pair in found.values if pair.key == "rejected_messages")


def flood() -> tuple[str, bool]:
    """Ten thousand commands a second for five seconds."""
    with system(("simulator",), components="[simulator, control_mixer, analysis, recorder]") as made:
        before = made.watch(2.0)[-1]
        memory = psutil.Process(made.parts["simulator"].pid).memory_info().rss
        flooder = _tool(made.world, "faults.py", "--flood", "5")
        during = made.watch(7.0)
        flooder.kill()
        pace = min(status.real_time_factor for status in during[len(during) // 3 : -len(during) // 4])
        made.client.spin(2.0)
        after = made.watch(3.0)[-1]
        grown = (psutil.Process(made.parts["simulator"].pid).memory_info().rss - memory) / 1e6
        verdict = made.parts["simulator"].interrupt()
        log = replayed(made.parts["simulator"].record, "--verify")
        text = (
            f"real-time factor {pace:.2f} meanwhile, {after.real_time_factor:.2f} afterwards; memory {grown:+.1f} MB;"
        )
        text += f" {after.missed_deadlines - before.missed_deadlines} deadlines missed; log {log}"
        return text, verdict == 0 and after.real_time_factor > PACE and grown < 30 and log.startswith("identical")


def two_controllers() -> tuple[str, bool]:
    """Two pilots on one topic."""
    with system() as made:
        made.world.start("hover_hold", remaps=["__node:=copilot"])
        heard = made.hears(
            "control_mixer", "2 publishers of controls, the newest command counts: /copilot, /hover_hold"
        )
        return (
            "reported with their names" if heard else "NOT reported"
        ) + "; the flight goes on", heard and made.flies()


CLOCK = """
#define _GNU_SOURCE
#include <dlfcn.h>
#include <pthread.h>
#include <semaphore.h>
#include <time.h>
#include <sys/time.h>
static int (*real)(clockid_t, struct timespec *);
static long offset(void) {  /* an hour on after 6 s, two hours back after 9 s */
    static time_t begin; struct timespec now;
    if (!real) real = dlsym(RTLD_NEXT, "clock_gettime");
    real(CLOCK_MONOTONIC, &now); if (!begin) begin = now.tv_sec;
    return now.tv_sec - begin < 6 ? 0 : now.tv_sec - begin < 9 ? 3600 : -3600;
}
int clock_gettime(clockid_t id, struct timespec *t) {
    long jump = offset(); int r = real(id, t); if (id == CLOCK_REALTIME) t->tv_sec += jump; return r;
}
int gettimeofday(struct timeval *t, void *z) {
    struct timespec now; clock_gettime(CLOCK_REALTIME, &now);
    t->tv_sec = now.tv_sec; t->tv_usec = now.tv_nsec / 1000; return 0;
}
static const struct timespec *kernels(const struct timespec *t, struct timespec *mine) {
    *mine = *t; if (t->tv_sec > 1000000000) mine->tv_sec -= offset(); return mine;
}
int pthread_cond_timedwait(pthread_cond_t *c, pthread_mutex_t *m, const struct timespec *t) {
    static int (*wait)(pthread_cond_t *, pthread_mutex_t *, const struct timespec *); struct timespec mine;
    if (!wait) wait = dlvsym(RTLD_NEXT, "pthread_cond_timedwait", "GLIBC_2.3.2");
    return wait(c, m, kernels(t, &mine));
}
int sem_timedwait(sem_t *s, const struct timespec *t) {
    static int (*wait)(sem_t *, const struct timespec *); struct timespec mine;
    if (!wait) wait = dlsym(RTLD_NEXT, "sem_timedwait");
    return wait(s, kernels(t, &mine));
}
time_t time(time_t *t) {
    struct timespec now; clock_gettime(CLOCK_REALTIME, &now); if (t) *t = now.tv_sec; return now.tv_sec;
}
"""


def clock_jumps() -> tuple[str, bool]:
    """The host's time of day jumps by hours while the system flies."""
    with tempfile.TemporaryDirectory() as name:
        source, library = Path(name) / "clock.c", Path(name) / "clock.so"
        source.write_text(CLOCK)
        subprocess.run(["gcc", "-shared", "-fPIC", "-O1", "-o", str(library), str(source), "-ldl"], check=True)
        os.environ["LD_PRELOAD"] = str(library)
        try:
            made_system = system()
            made = made_system.__enter__()
        finally:
            del os.environ["LD_PRELOAD"]
        try:
            during = made.watch(14.0)
            stamps_seen = [s.header.stamp.sec + 1e-9 * s.header.stamp.nanosec for s in made.states]
            largest = float(np.diff(stamps_seen).max())
            good = made.flies() and made.parts["simulator"].interrupt() == 0
            log = replayed(made.parts["simulator"].record, "--verify")
            pace = np.median([status.real_time_factor for status in during])
        finally:
            made_system.__exit__(None, None, None)
        text = f"simulation time went on, largest step {largest:.3f} s, real-time factor {pace:.2f}; log {log}"
        return text, good and log.startswith("identical") and pace > PACE


def reader_that_does_not_read() -> tuple[str, bool]:
    """A subscriber of every topic that is stopped."""
    with system() as made:
        reader = _tool(made.world, "faults.py", "--neighbours", "1")
        made.client.spin(3.0)
        os.kill(reader.pid, signal.SIGSTOP)
        process = psutil.Process(made.parts["simulator"].pid)
        made.client.spin(3.0)
        memory = process.memory_info().rss
        during = made.watch(20.0)
        grown = (process.memory_info().rss - memory) / 1e6
        pace = np.median([status.real_time_factor for status in during])
        dropped = during[-1].dropped_messages - during[0].dropped_messages
        text = f"real-time factor {pace:.2f}, memory {grown:+.1f} MB, {dropped} ticks not published"
        return text, pace > PACE and grown < 10 and made.flies()


def neighbours() -> tuple[str, bool]:
    """Fifty other nodes are discovered and leave."""
    with system() as made:
        before = made.watch(3.0)[-1]
        others = [_tool(made.world, "faults.py", "--neighbours", "10") for _ in range(5)]
        made.client.until(lambda: len(made.client.node.get_node_names()) >= 50, "the neighbours")
        during = made.watch(10.0)
        for other in others:
            other.kill()
        after = made.watch(5.0)[-1]
        pace = np.median([status.real_time_factor for status in during])
        missed = after.missed_deadlines - before.missed_deadlines
        return f"real-time factor {pace:.2f}, {missed} deadlines missed", made.flies() and after.real_time_factor > PACE


def full_disk() -> tuple[str, bool]:
    """The log's disk has room for a megabyte."""
    with tempfile.TemporaryDirectory() as name, tempfile.TemporaryDirectory() as rest:
        disk = ["mount", "-t", "tmpfs", "-o", "size=1m", "none", name]
        if subprocess.run(disk, check=False, stderr=subprocess.DEVNULL).returncode:
            return "not tried: mount is not allowed here", True
        try:
            with system(record=f"{name}/full.mcap") as made:
                statuses = made.client.messages["status"]
                made.client.until(lambda: any(status.log_fault for status in statuses[-1:]), "the end of the disk")
                status = made.watch(3.0)[-1]
                heard = made.hears("simulator", "No space left on device", 5.0)
                good = made.flies() and heard and status.real_time_factor > PACE
                made.parts["simulator"].interrupt()
            shutil.copy(f"{name}/full.mcap", rest)
        finally:
            subprocess.run(["umount", name], check=True)
        said = replayed(Path(rest) / "full.mcap", "--recover")
    why = status.log_fault.rpartition(": ")[2]
    return f"the flight goes on; status and diagnostics: {why!r}; log recovered ({said[:13]})", good


def starved(share: float = 0.2) -> tuple[str, bool]:
    """The simulator gets a fifth of a processor: stopped and continued twenty times a second."""
    with system() as made:
        pid, stop = made.parts["simulator"].pid, threading.Event()

        def starve() -> None:
            while not stop.is_set():
                os.kill(pid, signal.SIGSTOP)
                time.sleep(0.05 * (1 - share))
                os.kill(pid, signal.SIGCONT)
                time.sleep(0.05 * share)

        starver = threading.Thread(target=starve)
        starver.start()
        made.client.spin(5.0)
        during = made.watch(15.0)
        stop.set()
        starver.join()
        pace = np.median([status.real_time_factor for status in during])
        missed = during[-1].missed_deadlines - during[0].missed_deadlines
        after = made.watch(6.0)[-1]
        ended = made.parts["simulator"].interrupt()
        log = replayed(made.parts["simulator"].record, "--verify")
        text = (
            f"real-time factor {pace:.2f} reported, {missed} deadlines missed, {after.real_time_factor:.2f} afterwards;"
        )
        text += f" log {log}"
        return text, ended == 0 and pace < 0.95 and missed > 0 and after.real_time_factor > PACE and log.startswith(
            "identical"
        )


Fault = Callable[[], tuple[str, bool]]
FAULTS: dict[str, Fault] = {
    **{f"kill {part}": (lambda part=part: killed(part)) for part in PARTS},
    **{f"kill {one} and {two}": (lambda a=one, b=two: killed(a, b)) for one, two in itertools.combinations(PARTS, 2)},
    "kill cockpit": killed_cockpit,
    "stamps": stamps,
    "flood": flood,
    "two controllers": two_controllers,
    "clock jumps": clock_jumps,
    "reader that does not read": reader_that_does_not_read,
    "50 neighbours": neighbours,
    "full disk": full_disk,
    "a fifth of a processor": starved,
}


# --- what runs as a process of its own --------------------------------------------------------------------------------


def send_flood(seconds: float) -> None:
    """Publish as many commands as are wanted; prints how many there were."""
    import rclpy

    from sbs_msgs.msg import Controls

    rclpy.init()
    node = rclpy.create_node("flood")
    output = node.create_publisher(Controls, "controls", 1)
    base, begin, sent = trim(Aircraft.load("sbs")).controls, time.monotonic(), 0
    while (now := time.monotonic() - begin) < seconds:
        while sent < now * FLOOD:
            sent += 1
            output.publish(controls_message(base + [1e-5 * (sent % 2), 0, 0, 0]))
        time.sleep(1e-4)
    print(sent / seconds)


def be_neighbours(count: int) -> None:
    """Nodes with a subscription of every topic, until killed."""
    import rclpy
    from rclpy.executors import SingleThreadedExecutor

    rclpy.init()
    executor = SingleThreadedExecutor()
    for i in range(count):
        node = rclpy.create_node(f"neighbour_{os.getpid()}_{i}")
        for topic, kind in (("state", BodyState), ("status", SimulationStatus), ("swashplate", SwashplateArray)):
            node.create_subscription(kind, topic if i == 0 else f"own_{i}_{topic}", lambda _: None, 10)
        executor.add_node(node)
    executor.spin()


def main() -> int:
    """Do what the command line asks for; the exit code."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help="faults to try, all if none is given")
    parser.add_argument("--list", action="store_true", help="print their names")
    parser.add_argument("--flood", type=float, help=argparse.SUPPRESS)
    parser.add_argument("--neighbours", type=int, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.flood or arguments.neighbours:
        send_flood(arguments.flood) if arguments.flood else be_neighbours(arguments.neighbours)
        return 0
    if arguments.list or set(arguments.names) - set(FAULTS):
        print("\n".join(FAULTS))
        return 0 if arguments.list else 2
    wrong = 0
    for name in arguments.names or FAULTS:
        try:
            text, good = FAULTS[name]()
        except Exception as error:
            text, good = f"{error!r}", False
        wrong += not good
        print(f"{name:36} {'good ' if good else 'WRONG'}  {text}", flush=True)
    print(f"{wrong} wrong" if wrong else "nothing wrong")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
