"""Fuzz targets of running nodes, over real DDS; for `test_fuzz.py` and `fuzz.py`."""

import contextlib
import math
import os
import signal
import socket
import time
import urllib.request
from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import psutil
import rclpy
import viser
import zstandard
from fuzz_targets import EXTREMES, FuzzTarget
from geometry_msgs.msg import PoseStamped
from hypothesis import strategies as st
from rcl_interfaces.msg import ParameterValue
from rcl_interfaces.srv import SetParameters, SetParametersAtomically
from rclpy.action import ActionClient
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from ros_harness import PATIENCE, Process, Terminal, World
from sensor_msgs.msg import Joy
from std_srvs.srv import SetBool
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect
from websockets.typing import Subprotocol

from sbs_msgs.action import Sweep
from sbs_msgs.msg import (
    BodyState,
    Controls,
    FlightEvent,
    InflowArray,
    LinearModel,
    RotorStateArray,
    SimulationStatus,
    SwashplateArray,
)
from sbs_msgs.srv import Linearize, Record, Reset, SetWind, Step, Trim
from sbs_sim.model.state import CONTROL_NAMES

SERVICES = {
    "pause": SetBool,
    "step": Step,
    "reset": Reset,
    "set_wind": SetWind,
    "record": Record,
    "trim": Trim,
    "linearize": Linearize,
    "simulator/set_parameters": SetParameters,
    "simulator/set_parameters_atomically": SetParametersAtomically,
    "control_mixer/set_parameters": SetParameters,
    "analysis/set_parameters": SetParameters,
}
TOPICS = {"controls": Controls, "swashplate": SwashplateArray}
PARAMETERS = ("real_time_factor", "command_timeout", "airspeed", "aircraft", "record", "use_sim_time", "nothing", "",
              "turbulence_extent", "turbulence_model", "wind_profile", "gust_file")  # fmt: skip
NUMBERS = st.sampled_from(EXTREMES) | st.floats() | st.floats(-20.0, 20.0)
GUST = "distance [m],north [m/s],east [m/s],down [m/s]\n0,0,0,0\n2,1,-2,3\n"
WORDS = st.sampled_from(
    ["", "newton", "paper", "two_loop", "../x", "airspeed", "body.mass", "x" * 1000, "é\n"]
    + ["field", "elements", "rates", "von_karman", "ramp", "power", "logarithmic", GUST, GUST + "1,,nan"]
)
INTEGERS = {f"{sign}int{bits}": (bits, not sign) for sign in ("", "u") for bits in (8, 16, 32, 64)}


def messages(kind: Any, rate: int = 3) -> Any:
    """Messages of an interface of which one field in `rate` is invalid and the others are as they begin."""

    @st.composite
    def made(draw: Any) -> Any:
        message = kind()
        for name, type_name in kind.get_fields_and_field_types().items():
            if draw(st.integers(0, rate)) == 0:
                with contextlib.suppress(AssertionError):  # what cannot be put into a message cannot be sent
                    setattr(message, name, draw(values(getattr(message, name), type_name, rate)))
        return message

    return made()


def values(present: Any, type_name: str, rate: int) -> Any:
    """Values for a field of a type."""
    if type_name.startswith("sequence<"):
        inner = type_name[9:-1]
        if "/" in inner:
            package, name = inner.split("/")
            kind = getattr(__import__(f"{package}.msg", fromlist=[name]), name)
            return st.lists(messages(kind, rate), max_size=4)
        lengths = st.sampled_from([0, 1, 3, 42, 43, 44, 1000])
        return lengths.flatmap(
            lambda count: st.lists(values(None, inner, rate), min_size=min(count, 4), max_size=min(count, 44))
        )
    if "/" in type_name:
        return messages(type(present), rate)
    if type_name in ("double", "float"):
        return NUMBERS
    if type_name == "boolean":
        return st.booleans()
    if type_name in INTEGERS:
        bits, signed = INTEGERS[type_name]
        low, high = (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1) if signed else (0, 2**bits - 1)
        return st.sampled_from([0, 1, 2, 12, low, high]).filter(lambda value: low <= value <= high)
    return WORDS


class Live:
    """A client of a running system that must survive anything.

    Parameters
    ----------
    domain : int
    process : Process
        The simulator with all its components.
    """

    def __init__(self, domain: int, process: Process) -> None:
        self.process = process
        self._context = rclpy.Context()
        rclpy.init(context=self._context, domain_id=domain)
        self.node = Node("invalid", context=self._context)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self.node)
        self.states = self.wrong = 0
        self.status: Any = None
        self.node.create_subscription(BodyState, "state", self._on_state, 10)
        self.node.create_subscription(SimulationStatus, "status", self._on_status, 10)
        self._clients = {name: self.node.create_client(kind, name) for name, kind in SERVICES.items()}
        self._publishers = {
            name: self.node.create_publisher(kind, name, QoSProfile(depth=1)) for name, kind in TOPICS.items()
        }
        self._sweeps = ActionClient(self.node, Sweep, "sweep")
        everything = [*self._clients.values()]
        self.until(lambda: all(client.service_is_ready() for client in everything) and self._sweeps.server_is_ready())
        self.until(lambda: self.status is not None)

    def _on_state(self, message: BodyState) -> None:
        self.states += 1
        q, v, w, p = message.attitude, message.velocity, message.angular_velocity, message.position
        numbers = (q.w, q.x, q.y, q.z, v.x, v.y, v.z, w.x, w.y, w.z, p.x, p.y, p.z)
        self.wrong += not all(map(math.isfinite, numbers))

    def _on_status(self, message: SimulationStatus) -> None:
        self.status = message

    def until(self, condition: Callable[[], Any]) -> None:
        """Receive until a condition holds; the end of the simulator is a failure."""
        end = time.monotonic() + PATIENCE
        while not condition():
            assert self.process.running, f"the simulator has ended:\n{self.process.output[-2000:]}"
            assert time.monotonic() < end, "no answer"
            self._executor.spin_once(timeout_sec=0.05)

    def call(self, name: str, request: Any) -> Any:
        """Answer of a service."""
        future = self._clients[name].call_async(request)
        self.until(future.done)
        return future.result()

    def check_request(self, given: tuple[str, Any]) -> None:
        """A request of any kind is answered; a refusal says why in one line and changes no state."""
        name, request = given
        answer = self.call(name, request)
        results = getattr(answer, "results", None) or [getattr(answer, "result", answer)]
        for result in results:
            text = getattr(result, "message", None) or getattr(result, "reason", "")
            success = getattr(result, "success", None) or getattr(result, "successful", False)
            assert success or text, f"{name} refuses without a word"
            assert len(text.splitlines()) <= 1, text
            assert "internal error" not in text, text
        assert not self.wrong, "a state that is not finite was published"

    def check_message(self, given: tuple[str, Any]) -> None:
        """A message of any kind; the nodes go on."""
        name, message = given
        self._publishers[name].publish(message)
        self._executor.spin_once(timeout_sec=0.0)
        assert self.process.running, self.process.output[-2000:]
        assert not self.wrong

    def check_goal(self, goal: Any) -> None:
        """A goal of any kind ends with a result of one line."""
        sent = self._sweeps.send_goal_async(goal)
        self.until(sent.done)
        if not sent.result().accepted:
            return
        ended = sent.result().get_result_async()
        self.until(ended.done)
        result = ended.result().result
        assert result.message
        assert len(result.message.splitlines()) == 1
        assert "internal error" not in result.message, result.message

    def check_alive(self) -> None:
        """After all that the aircraft can be put into hover and flies."""
        assert self.call("reset", Reset.Request()).success
        self.call("set_wind", SetWind.Request())
        self.call("simulator/set_parameters", SetParameters.Request(parameters=[number("real_time_factor", 1.0)]))
        assert self.call("pause", SetBool.Request(data=False)).success
        before = self.status.steps
        self.until(lambda: self.status.steps > before + 100 and self.status.fault == "")

    def targets(self) -> tuple[FuzzTarget, ...]:
        """The targets of this system."""
        requests = [
            st.tuples(st.just(name), messages(kind.Request)) for name, kind in SERVICES.items() if "param" not in name
        ]
        parameters = st.sampled_from([name for name in SERVICES if "set_param" in name])
        kinds = st.sampled_from([SERVICES["simulator/set_parameters"]])
        goals = messages(Sweep.Goal).map(_short_goal)
        return (
            FuzzTarget(
                "messages over DDS",
                st.one_of(*(st.tuples(st.just(n), messages(k, 2)) for n, k in TOPICS.items())),
                self.check_message,
                3.0,
            ),
            FuzzTarget(
                "raw CDR over DDS",
                st.tuples(st.sampled_from(sorted(TOPICS)), st.binary(max_size=200) | CDR),
                self.check_message,
                3.0,
            ),
            FuzzTarget("requests over DDS", st.one_of(*requests).map(_cheap), self.check_request, 2.0),
            FuzzTarget(
                "parameters over DDS",
                st.tuples(parameters, kinds).flatmap(_parameter_requests),
                self.check_request,
                1.0,
            ),
            FuzzTarget("goals over DDS", goals, self.check_goal, 0.5),
        )

    def memory(self) -> tuple[int, int]:
        """Resident bytes and open files of the simulator."""
        process = psutil.Process(self.process.pid)
        return process.memory_info().rss, process.num_fds()

    def close(self) -> None:
        """Leave the domain."""
        self._executor.shutdown()
        self._sweeps.destroy()
        self.node.destroy_node()
        rclpy.shutdown(context=self._context)


# --- pilots and cockpit -----------------------------------------------------------------------------------------

HEARD = {
    "state": BodyState,
    "events": FlightEvent,
    "status": SimulationStatus,
    "target": PoseStamped,
    "joy": Joy,
    "rotors": RotorStateArray,
    "inflow": InflowArray,
    "linear_model": LinearModel,
}
PILOTS = ("hover_hold", "joystick", "teleop")
ENDING_KEYS = b"q\x03\x04\x1a\x1c"  # and those that a terminal makes signals of


class Pilots:
    """Pilots and a cockpit beside a flight that hear nothing but invalid input, on topics of their own.

    Parameters
    ----------
    made : World
        With a simulator that flies.
    """

    def __init__(self, made: World) -> None:
        self._client, self._folder = made.client, made.folder
        own = [f"{name}:=invalid/{name}" for name in HEARD]
        self.parts: dict[str, Any] = {
            name: made.start(name, remaps=[*own, f"controls:=invalid/{name}"]) for name in PILOTS[:-1]
        }
        with socket.create_server(("127.0.0.1", 0)) as free:
            self.port = free.getsockname()[1]
        arguments = ["--attach", "--port", str(self.port)]
        self.parts["cockpit"] = made.start("cockpit", remaps=own, arguments=arguments)
        words = [word for remap in [*own, "controls:=invalid/teleop"] for word in ("-r", remap)]
        self.parts["teleop"] = Terminal(made.domain, made.folder, *words)
        latched = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self._outputs = {
            name: made.client.node.create_publisher(kind, f"invalid/{name}", latched) for name, kind in HEARD.items()
        }
        self._given = {name: made.client.watch(f"invalid/{name}", Controls) for name in PILOTS}
        self._time = 0
        made.client.until(lambda: all(output.get_subscription_count() for output in self._outputs.values()), "pilots")
        made.client.until(lambda: served(self.port), "the page")
        self.check_alive()

    def check_message(self, given: tuple[str, Any]) -> None:
        """A message of any kind; nobody ends, and nobody commands what is not finite."""
        name, message = given
        self._outputs[name].publish(message)
        self._client.spin(0.002)
        self.check_running()

    def check_keys(self, keys: bytes) -> None:
        """Keys of any kind."""
        self.parts["teleop"].type(bytes(key for key in keys if key not in ENDING_KEYS).decode("latin-1"))
        self.check_running()

    def check_running(self) -> None:
        """All are there and have said nothing of errors of their own."""
        for name, part in self.parts.items():
            assert part.running, f"{name} has ended:\n{part.output[-2000:]}"
        for name, messages in self._given.items():
            values = [getattr(message, field) for message in messages for field in CONTROL_NAMES]
            assert all(map(math.isfinite, values)), f"{name} commands {values}"
            messages.clear()

    def check_alive(self) -> None:
        """After all, those of a sound flight are answered again by every pilot, and the page is served."""
        start = FlightEvent(kind=FlightEvent.START, swashplate=[0.1] * 6, state=[0.0] * 3 + [1.0] + [0.0] * 39)
        self._outputs["events"].publish(start)
        for messages in self._given.values():
            messages.clear()

        def answered() -> bool:
            self._time += 1
            state = BodyState()
            state.header.stamp.sec, state.header.stamp.nanosec = divmod(self._time * 10_000_000, 10**9)
            self._outputs["state"].publish(state)
            self._outputs["joy"].publish(Joy(axes=[0.0] * 8, buttons=[0] * 16))
            return all(self._given.values())

        with contextlib.suppress(AssertionError):
            self._client.until(answered, "every pilot")
        silent = [name for name, messages in self._given.items() if not messages]
        assert not silent, f"{silent} do not answer: {[self.parts[name].output[-1500:] for name in silent]}"
        self.check_running()
        assert served(self.port)
        for name, part in self.parts.items():
            # the web server has "unexpected internal error" for a client that hangs up while its hands are shaken
            assert "]: internal error" not in part.output, f"{name}:\n{part.output[-3000:]}"
            if name in PILOTS:  # the page's server prints what it could not make of a client's messages
                assert "Traceback" not in part.output, f"{name}:\n{part.output[-3000:]}"

    def targets(self) -> tuple[FuzzTarget, ...]:
        """The targets of the pilots, and of the cockpit to messages."""
        kinds = [st.tuples(st.just(name), messages(kind, 4)) for name, kind in HEARD.items()]
        raw = st.tuples(st.sampled_from(sorted(HEARD)), st.binary(max_size=200) | CDR)
        return (
            FuzzTarget("messages to pilots, page", st.one_of(*kinds), self.check_message, 3.0),
            FuzzTarget("raw CDR to pilots, page", raw, self.check_message, 2.0),
            FuzzTarget("keys of teleop", st.binary(max_size=20), self.check_keys, 1.0),
        )

    def close(self) -> None:
        """End the one that the world does not know of."""
        self.parts["teleop"].close()


def served(port: int) -> bool:
    """True if the page of the cockpit is there."""
    with contextlib.suppress(OSError), urllib.request.urlopen(f"http://127.0.0.1:{port}", timeout=5.0) as answer:
        return bool(answer.status == 200)
    return False


class Page:
    """What a client can send to the page of a cockpit that flies: HTTP, WebSocket, anything.

    Parameters
    ----------
    port : int
    running : callable
        False once the cockpit has ended.
    """

    def __init__(self, port: int, running: Callable[[], bool]) -> None:
        self._port, self._running = port, running
        self._socket = self.connect()
        self._parts = sorted(self._known())

    def connect(self, **headers: str) -> Any:
        """A connection like that of the page."""
        return connect(
            f"ws://127.0.0.1:{self._port}",
            subprotocols=[Subprotocol(f"viser-v{viser.__version__}")],
            additional_headers=headers,
            max_size=None,
            ping_interval=None,  # while the other targets have their turn nobody reads
        )

    def _known(self) -> set[str]:
        """Names of all that can be pressed or moved, from what a new page is sent."""
        found: set[str] = set()
        end = time.monotonic() + 3.0
        while time.monotonic() < end:
            with contextlib.suppress(TimeoutError):
                data = self._socket.recv(timeout=0.5)
                size = int.from_bytes(data[8:16], "little")
                reported = msgspec.msgpack.decode(zstandard.decompress(data[16 : 16 + size]))
                found |= {item["uuid"] for item in reported["messages"] if "uuid" in item}
        return found

    def check_request(self, data: bytes) -> None:
        """Bytes of any kind, some of them HTTP."""
        with socket.create_connection(("127.0.0.1", self._port), 5.0) as client:
            client.sendall(data)
            client.shutdown(socket.SHUT_WR)
            client.settimeout(5.0)
            answer = b""
            with contextlib.suppress(OSError):
                while part := client.recv(65536):
                    answer += part
        assert b"root:" not in answer
        self.check_alive()

    def check_press(self, given: tuple[int, str, Any]) -> None:
        """What a page sends, with invalid values in it."""
        place, kind, value = given
        part = self._parts[place % len(self._parts)]
        message: Any = {"type": kind, "uuid": part, "updates": {"value": value}}
        if kind == "raw":
            data = value if isinstance(value, bytes) else b""
        else:
            data = msgspec.msgpack.encode(message if kind == "GuiUpdateMessage" else {"type": kind, "uuid": part})
        try:
            self._socket.send(data)
            with contextlib.suppress(TimeoutError):
                while self._socket.recv(timeout=0.0):
                    pass
        except ConnectionClosed:  # what cannot be read closes the connection, of this page alone
            self._socket = self.connect()
        self.check_alive()

    def check_alive(self) -> None:
        """The cockpit is there and serves others."""
        assert self._running(), "the cockpit has ended"
        assert served(self._port)

    def targets(self) -> tuple[FuzzTarget, ...]:
        """The targets of the page."""
        paths = st.sampled_from(
            [b"/", b"/../../../../etc/passwd", b"/%2e%2e/%2e%2e/etc/passwd", b"//etc/passwd", b"/\\.."]
        )
        http = st.builds(
            lambda method, path, rest: method + b" " + path + b" HTTP/1.1\r\nHost: x\r\n" + rest + b"\r\n\r\n",
            st.sampled_from([b"GET", b"POST", b"X" * 9000]),
            paths | st.binary(max_size=30),
            st.sampled_from([b"", b"Upgrade: websocket", b"Content-Length: 99999999999"]) | st.binary(max_size=50),
        )
        kinds = st.sampled_from(["GuiUpdateMessage"] * 4 + ["CommandTriggerMessage", "NoSuchMessage", "raw"])
        plain = st.none() | st.booleans() | NUMBERS | WORDS | st.binary(max_size=30) | st.lists(NUMBERS, max_size=3)
        return (
            FuzzTarget("requests to the page", http | st.binary(max_size=200), self.check_request, 1.0),
            FuzzTarget("presses on the page", st.tuples(st.integers(0, 200), kinds, plain), self.check_press, 1.0),
        )

    def close(self) -> None:
        """Leave."""
        self._socket.close()


CDR = st.builds(
    lambda head, length, rest: head + length.to_bytes(4, "little") * 3 + rest,
    st.sampled_from([b"\0\1\0\0", b"\0\0\0\0", b"\0\3\0\0", b"\xff\xff\xff\xff"]),
    st.sampled_from([0, 1, 2, 2**16, 2**28, 2**31 - 1, 2**32 - 1]),
    st.binary(max_size=100),
)


def number(name: str, value: Any) -> Any:
    """Message of a parameter."""
    return rclpy.parameter.Parameter(name, value=value).to_parameter_msg()


@st.composite
def parameter_messages(draw: Any) -> Any:
    """A parameter of any name with a value of any type."""
    message = number("x", 0.0)
    message.name = draw(st.sampled_from(PARAMETERS) | WORDS)
    message.value = draw(messages(ParameterValue, 2))
    message.value.type = draw(st.sampled_from([0, 1, 2, 3, 3, 3, 3, 4, 8, 9]))
    if message.value.type == 3:
        message.value.double_value = draw(NUMBERS)
    return message


def _parameter_requests(given: tuple[str, Any]) -> Any:
    name, _ = given
    return st.tuples(
        st.just(name), st.lists(parameter_messages(), min_size=1, max_size=3).map(SERVICES[name].Request._of_list)
    )


for _kind in (SetParameters, SetParametersAtomically):
    _kind.Request._of_list = staticmethod(lambda parameters, kind=_kind: kind.Request(parameters=parameters))


def _cheap(given: tuple[str, Any]) -> tuple[str, Any]:
    """What would be right and take minutes asks for less."""
    name, request = given
    if name == "step" and 5 < request.ticks <= 1000:
        request.ticks = 5
    if hasattr(request, "azimuth_count") and request.azimuth_count > 12:
        request.azimuth_count = 2**31 - 1
    return name, request


def _short_goal(goal: Any) -> Any:
    goal.linear = False
    if goal.azimuth_count > 12:
        goal.azimuth_count = 2**31 - 1
    goal.values = goal.values[:3]
    return goal


def hung(process: Process, folder: Path) -> str:
    """Where the threads of a process stand, for a report."""
    os.kill(process.pid, signal.SIGABRT)
    time.sleep(0.5)
    return process.output[-3000:]


def bits(message: BodyState) -> bytes:
    """A state as bytes."""
    p, q, v, w = message.position, message.attitude, message.velocity, message.angular_velocity
    return np.array([p.x, p.y, p.z, q.w, q.x, q.y, q.z, v.x, v.y, v.z, w.x, w.y, w.z]).tobytes()
