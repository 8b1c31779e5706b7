"""Real processes and a real DDS participant for the tests of the nodes; everything stays on loopback."""

import collections
import contextlib
import fcntl
import os
import pty
import select
import signal
import subprocess
import sys
import tempfile
import termios
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import rclpy
from rclpy.action import ActionClient
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile

from sbs_msgs.msg import Controls, Swashplate, SwashplateArray
from sbs_sim.model.state import CONTROL_NAMES, SWASHPLATE_NAMES
from sbs_sim.nodes.confinement import keep_to_this_machine

EXECUTABLES = Path(__file__).resolve().parents[2] / "install" / "sbs_sim" / "lib" / "sbs_sim"
LAST_DOMAIN = 101  # the ports of later ones are those that Linux gives to anybody
HELD_DOMAINS = 25
os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
keep_to_this_machine()
MEASURED = "COVERAGE_PROCESS_CONFIG" in os.environ  # tools/robustness/coverage_report.py
PATIENCE = 120.0  # s of wall time; generous, for machines that are busy; DDS alone takes 20 to miss a killed process
# s that one look at the topics takes. Always the same: when it changes rclpy begins anew with the first topic, and the
# last ones get nothing while there is more than can be taken.
LOOK = 0.01


def _domains() -> Iterator[int]:
    """DDS domains that no other test run on this machine has now: each is locked until so many later ones are."""
    held: collections.deque[tuple[int, Any]] = collections.deque()
    while True:
        for i in range(LAST_DOMAIN):
            domain = 1 + (37 * os.getpid() + i) % LAST_DOMAIN
            if (lock := _locked(domain)) is not None:
                break
        else:  # all are taken, a good part of them by this process
            domain, lock = held.popleft()
        held.append((domain, lock))
        yield domain
        if len(held) > HELD_DOMAINS:
            held.popleft()[1].close()


def _locked(domain: int) -> Any:
    """Open file that holds the lock of a domain; None if another has it."""
    file = (Path(tempfile.gettempdir()) / f"sbs_sim-domain-{domain}.lock").open("w")
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        file.close()
        return None
    return file


DOMAINS = _domains()


def environment(domain: int, folder: Path | None = None) -> dict[str, str]:
    """Environment of a process in a DDS domain of its own on this machine, its logs in a folder."""
    own = {"ROS_DOMAIN_ID": str(domain)}
    return {**os.environ, **own, **({"SBS_SIM_BAGS": str(folder / "bags")} if folder else {})}


class Process:
    """A running executable with its output in a file, in a folder that also takes what it writes under a plain name."""

    def __init__(
        self,
        name: str,
        domain: int,
        folder: Path,
        parameters: dict[str, Any],
        remaps: Sequence[str] = (),
        arguments: Sequence[str] = (),
    ) -> None:
        self.log = folder / f"{name}-{time.monotonic_ns()}.log"
        command = [sys.executable, str(EXECUTABLES / name), *arguments, "--ros-args"]
        for key, value in parameters.items():
            command += ["-p", f"{key}:={value}"]
        for remap in remaps:
            command += ["-r", remap]
        with self.log.open("w") as out:
            self._popen = subprocess.Popen(
                command, stdout=out, stderr=subprocess.STDOUT, env=environment(domain, folder), cwd=folder
            )
        self.pid = self._popen.pid

    @property
    def output(self) -> str:
        """What it has printed so far."""
        return self.log.read_text()

    def catches(self, number: signal.Signals) -> bool:
        """True if it has a handler for a signal, which Python has for SIGINT alone (Linux, proc(5))."""
        status = Path(f"/proc/{self.pid}/status").read_text()
        caught = int(status.split("SigCgt:")[1].split()[0], 16)
        return bool(caught >> (number - 1) & 1)

    @property
    def running(self) -> bool:
        """True while it has not ended."""
        return self._popen.poll() is None

    def wait(self) -> int:
        """Exit code, once it has ended."""
        return self._popen.wait(PATIENCE)

    def interrupt(self, number: int = signal.SIGINT) -> int:
        """Ctrl-C; the exit code."""
        self._popen.send_signal(number)
        return self.wait()

    def kill(self) -> None:
        """End it whatever it does."""
        if self.running:
            self._popen.kill()
            self._popen.wait(PATIENCE)

    def end_gently(self) -> None:
        """Give it ten seconds to end itself: what is killed cannot tell what it has executed."""
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._popen.send_signal(signal.SIGINT)
            self._popen.wait(10.0)


class Terminal:
    """The executable `teleop` in a terminal of its own."""

    def __init__(self, domain: int, folder: Path, *arguments: str) -> None:
        self._user, self._side = pty.openpty()
        self.before = termios.tcgetattr(self._side)
        side = self._side
        self._popen = subprocess.Popen(
            [sys.executable, str(EXECUTABLES / "teleop"), "--ros-args", *arguments],
            stdin=side,
            stdout=side,
            stderr=side,
            env=environment(domain, folder),
            start_new_session=True,
            preexec_fn=lambda: fcntl.ioctl(side, termios.TIOCSCTTY, 0),  # so that Ctrl-C comes from it
        )
        self.output = ""
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self) -> None:
        with contextlib.suppress(OSError):
            while True:
                if select.select([self._user], [], [], 0.1)[0]:
                    self.output += os.read(self._user, 4096).decode(errors="replace")

    def type(self, keys: str) -> None:
        """Type keys."""
        os.write(self._user, keys.encode())

    def signal(self, number: int) -> None:
        """Send a signal."""
        self._popen.send_signal(number)

    def wait(self) -> int:
        """Exit code, once it has ended."""
        return self._popen.wait(PATIENCE)

    def expect(self, text: str) -> None:
        """Wait until something has been printed."""
        end = time.monotonic() + PATIENCE
        while text not in self.output:
            assert time.monotonic() < end, self.output
            assert self._popen.poll() is None, self.output
            time.sleep(0.05)

    @property
    def modes(self) -> Any:
        """Modes of the terminal."""
        return termios.tcgetattr(self._side)

    @property
    def hands_over_keys(self) -> bool:
        """True if keys come at once and are not shown."""
        return not self.modes[3] & (termios.ICANON | termios.ECHO)

    @property
    def running(self) -> bool:
        """True while it has not ended."""
        return self._popen.poll() is None

    def close(self) -> None:
        """End it whatever it does."""
        if self._popen.poll() is None:
            self._popen.kill()
            self._popen.wait(PATIENCE)


class Client:
    """A node of the test: keeps the messages of every topic that it is asked to watch."""

    def __init__(self, domain: int, name: str = "test_client") -> None:
        self._context = rclpy.Context()
        rclpy.init(context=self._context, domain_id=domain)
        self.node = Node(name, context=self._context)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self.node)
        self.messages: dict[str, list[Any]] = {}
        self._publishers: dict[str, Any] = {}
        self._action_clients: dict[str, ActionClient] = {}

    def watch(self, topic: str, kind: type, latched: bool = False) -> list[Any]:
        """List that fills with the messages of a topic, with the last one from before if that is latched."""
        kept = self.messages.setdefault(topic, [])
        profile = QoSProfile(depth=1000)
        if latched:
            profile.durability = DurabilityPolicy.TRANSIENT_LOCAL
        self.node.create_subscription(kind, topic, kept.append, profile)
        return kept

    def spin(self, seconds: float) -> None:
        """Receive for a while of wall time."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self._executor.spin_once(timeout_sec=LOOK)

    def until(self, condition: Callable[[], Any], what: str) -> Any:
        """Receive until a condition holds, and return its value."""
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end:
            if value := condition():
                return value
            self._executor.spin_once(timeout_sec=LOOK)
        raise AssertionError(f"waited {PATIENCE:g} s in vain for {what}")

    def next(self, topic: str, condition: Callable[[Any], Any] = lambda _: True) -> Any:
        """First message of a watched topic that arrives from now on and meets a condition."""
        kept = self.messages[topic]
        seen = len(kept)

        def found() -> Any:
            nonlocal seen
            while seen < len(kept):
                seen += 1
                if condition(kept[seen - 1]):
                    return kept[seen - 1]
            return None

        return self.until(found, f"a message on {topic}")

    def call(self, kind: type, name: str, **request: Any) -> Any:
        """Response of a service."""
        client = self.node.create_client(kind, name)
        self.until(client.service_is_ready, f"service {name}")
        future = client.call_async(kind.Request(**request))
        self.until(future.done, f"an answer of {name}")
        self.node.destroy_client(client)
        return future.result()

    def send_goal(self, kind: type, name: str, **goal: Any) -> "Goal":
        """Goal of an action, once it is accepted."""
        if name not in self._action_clients:
            self._action_clients[name] = ActionClient(self.node, kind, name)
        actions = self._action_clients[name]
        self.until(actions.server_is_ready, f"action {name}")
        return Goal(self, actions, kind.Goal(**goal))

    def publish(self, topic: str, message: Any) -> None:
        """Publish, once somebody listens."""
        if topic not in self._publishers:
            publisher = self.node.create_publisher(type(message), topic, QoSProfile(depth=1))
            self._publishers[topic] = publisher
            self.until(publisher.get_subscription_count, f"a subscriber of {topic}")
        self._publishers[topic].publish(message)

    def publish_until(self, topic: str, message: Any, watched: str, condition: Callable[[Any], Any]) -> Any:
        """Publish like a pilot, again and again, until a message that meets a condition arrives."""
        kept = self.messages[watched]
        seen = len(kept)
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end:
            self.publish(topic, message)
            self.spin(0.02)
            for found in kept[seen:]:
                if condition(found):
                    return found
            seen = len(kept)
        raise AssertionError(f"waited {PATIENCE:g} s in vain for a message on {watched}")

    def close(self) -> None:
        """Leave the domain."""
        self._executor.shutdown()
        for actions in self._action_clients.values():
            actions.destroy()
        self.node.destroy_node()
        rclpy.shutdown(context=self._context)


class Goal:
    """A goal of an action: its feedback, its end, its cancellation."""

    def __init__(self, client: Client, actions: ActionClient, goal: Any) -> None:
        self._client = client
        self.feedback: list[Any] = []
        sent = actions.send_goal_async(goal, lambda message: self.feedback.append(message.feedback))
        client.until(sent.done, "the acceptance of a goal")
        self._handle = sent.result()
        assert self._handle.accepted
        self._result = self._handle.get_result_async()

    def cancel(self) -> Any:
        """Ask for its end; the response."""
        asked = self._handle.cancel_goal_async()
        self._client.until(asked.done, "the answer to a cancel request")
        return asked.result()

    def end(self) -> tuple[int, Any]:
        """Status and result, once it has ended."""
        self._client.until(self._result.done, "the end of a goal")
        answer = self._result.result()
        return answer.status, answer.result


class World:
    """A DDS domain with processes and one client."""

    def __init__(self, domain: int, folder: Path) -> None:
        self.domain, self.folder = domain, folder
        self.client = Client(domain)
        self.processes: list[Process] = []

    def start(self, name: str, remaps: Sequence[str] = (), arguments: Sequence[str] = (), **parameters: Any) -> Process:
        """Start an executable with arguments of its own and with parameters."""
        process = Process(name, self.domain, self.folder, parameters, remaps, arguments)
        self.processes.append(process)
        return process

    def set_parameter(self, node: str, name: str, value: Any) -> Any:
        """Set a parameter of a node; its SetParametersResult."""
        from rcl_interfaces.srv import SetParameters

        parameter = Parameter(name, value=value).to_parameter_msg()
        return self.client.call(SetParameters, f"{node}/set_parameters", parameters=[parameter]).results[0]


@contextlib.contextmanager
def world(domain: int, folder: Path) -> Iterator[World]:
    """A world whose processes end with it."""
    made = World(domain, folder)
    try:
        yield made
    finally:
        for process in made.processes:
            if MEASURED:
                process.end_gently()
            process.kill()
        made.client.close()


def nanoseconds(message: Any) -> int:
    """Time of a message with a header [ns]."""
    return message.header.stamp.sec * 10**9 + message.header.stamp.nanosec


def controls_message(values: Any) -> Controls:
    """Message of pilot controls [rad], shape (4,)."""
    return Controls(**{name: float(value) for name, value in zip(CONTROL_NAMES, values, strict=True)})


def swashplate_message(rows: Any) -> SwashplateArray:
    """Message of swashplate angles [rad], shape (n_rotors, 3)."""
    return SwashplateArray(
        rotors=[
            Swashplate(**{name: float(value) for name, value in zip(SWASHPLATE_NAMES, row, strict=True)})
            for row in rows
        ]
    )
