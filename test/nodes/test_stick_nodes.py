"""Keyboard and joystick as their users meet them: a real terminal, real messages, a simulator in flight."""

import math
import re
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

rclpy = pytest.importorskip("rclpy")

from ros_harness import DOMAINS, EXECUTABLES, PATIENCE, Terminal, environment, world  # noqa: E402
from sensor_msgs.msg import Joy  # noqa: E402
from std_srvs.srv import SetBool  # noqa: E402

from sbs_msgs.msg import BodyState, Controls, FlightEvent  # noqa: E402
from sbs_msgs.srv import Reset  # noqa: E402
from sbs_sim import Aircraft, trim  # noqa: E402
from sbs_sim.model.state import CONTROL_NAMES  # noqa: E402
from sbs_sim.nodes.qos import EVENT_QOS  # noqa: E402
from sbs_sim.pilot.sticks import shaped  # noqa: E402

TRIM = trim(Aircraft.load("sbs")).controls


def controls_of(message):
    return np.array([getattr(message, name) for name in CONTROL_NAMES])


def near_trim(message):
    """Within what augmentation does in a calm hover."""
    return np.abs(controls_of(message) - TRIM).max() < math.radians(0.2)


@pytest.fixture
def terminal(tmp_path):
    """Function that starts teleop in a terminal."""
    made = []

    def start(*arguments, domain=None):
        made.append(Terminal(domain or next(DOMAINS), tmp_path, *arguments))
        return made[-1]

    yield start
    for item in made:
        item.close()


@pytest.fixture
def flight(tmp_path):
    """A simulator and a client."""
    with world(next(DOMAINS), tmp_path) as made:
        made.client.watch("state", BodyState)
        made.client.watch("controls", Controls)
        made.simulator = made.start("simulator", record="off")
        made.client.next("state")
        yield made


def test_keys_fly_and_ctrl_c_gives_the_terminal_back(flight, terminal):
    client = flight.client
    teleop = terminal("-p", "expo:=0.5", domain=flight.domain)
    teleop.expect("flying, augmentation on")
    assert teleop.hands_over_keys
    client.next("controls", near_trim)

    teleop.type("\x13www")  # Ctrl-S holds up no output, and so no flight; the collective stays
    raised = TRIM[0] + math.radians(3.0) * shaped(0.3, 0.0, 0.5)
    client.next("controls", lambda message: abs(message.collective - raised) < 1e-9)
    client.next("state", lambda state: state.velocity.z < -0.05)

    teleop.type("\x1b[A\x1b[A\x1b[A")  # a push, which goes back by itself, and with augmentation the nose too
    client.next("controls", lambda message: message.longitudinal_cyclic - TRIM[2] > math.radians(0.05))
    client.next("state", lambda state: state.attitude.y < -0.002)

    teleop.type("g")
    teleop.expect("augmentation off")
    teleop.type(" ")
    client.next("controls", lambda message: np.abs(controls_of(message) - TRIM).max() < 1e-4)
    teleop.type("g")

    assert client.call(Reset, "reset", airspeed=5.0).success
    cruise = trim(Aircraft.load("sbs"), airspeed=5.0).controls
    client.next("controls", lambda message: abs(message.longitudinal_cyclic - cruise[2]) < math.radians(0.05))
    client.next("state", lambda state: state.velocity.x > 4.0)
    assert re.search(r"controls +\S+ +\S+ +\S+ +\S+ deg  augmentation on", teleop.output)

    teleop.type("\x03")
    assert teleop.wait() == 0
    assert teleop.modes == teleop.before
    assert "Traceback" not in teleop.output


def test_without_a_flight_keys_and_joystick_say_what_they_wait_for(terminal, tmp_path):
    """For a simulator, then for the end of its pause; the joystick for its own messages, too, while it flies."""
    with world(next(DOMAINS), tmp_path) as made:
        teleop, joystick = terminal(domain=made.domain), made.start("joystick")
        line = f"waiting for /state in ROS_DOMAIN_ID {made.domain}: is a simulator running there?"
        teleop.expect(line)
        made.client.until(lambda: joystick.output.count(line) == 2, "two lines")
        assert "the last controls stay" not in joystick.output  # there were none

        made.client.watch("state", BodyState)
        made.start("simulator", record="off")
        made.client.next("state")
        made.client.until(lambda: "flying, augmentation on" in joystick.output, "the take-over")
        assert made.client.call(SetBool, "pause", data=True).success
        late = made.start("joystick")
        made.client.until(lambda: "waiting for the flight to go on: it is paused" in late.output, "a line of the pause")
        made.client.until(lambda: "waiting for /joy in ROS_DOMAIN_ID" in joystick.output, "a line about joy")


def test_sticks_of_another_aircraft_say_why_they_do_not_fly(tmp_path):
    with world(next(DOMAINS), tmp_path) as made:
        events = made.client.node.create_publisher(FlightEvent, "events", EVENT_QOS)
        state = [0.0, 0.0, -10.0, 1.0] + [0.0] * 50
        events.publish(FlightEvent(kind=FlightEvent.START, swashplate=[0.1] * 9, state=state))
        joystick = made.start("joystick")
        line = "waiting for another flight: the aircraft of this one has 3 rotors, sbs has 2; see aircraft:="
        made.client.until(lambda: line in joystick.output, line)


def test_q_ends_it_without_a_flight(terminal):
    teleop = terminal()
    teleop.expect("augmentation on, off")
    teleop.type("wq")
    assert teleop.wait() == 0
    assert teleop.modes == teleop.before


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_a_signal_while_it_starts_gives_the_terminal_back(terminal, number):
    teleop = terminal()
    end = time.monotonic() + PATIENCE
    while not teleop.hands_over_keys:
        assert time.monotonic() < end, teleop.output
        time.sleep(0.01)
    teleop.signal(number)
    assert teleop.wait() == 0
    assert teleop.modes == teleop.before


@pytest.mark.parametrize(
    ("parameter", "line"),
    [
        ("aircraft:=zeppelin", "aircraft = 'zeppelin': allowed are a file's path or one of"),
        ("expo:=.nan", "parameter expo = nan: allowed are 0 to 1"),
        ("cyclic_deg:=50", "parameter cyclic_deg = 50.0: allowed are 0.1 to 20"),
    ],
)
def test_an_error_at_the_start_gives_the_terminal_back(terminal, parameter, line):
    teleop = terminal("-p", parameter)
    assert teleop.wait() == 1
    time.sleep(0.3)  # for the reader of its output
    assert teleop.modes == teleop.before
    assert line in teleop.output
    assert "Traceback" not in teleop.output


def test_without_a_terminal_it_says_so(tmp_path):
    result = subprocess.run(
        [sys.executable, str(EXECUTABLES / "teleop")],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        env=environment(next(DOMAINS), tmp_path),
        timeout=PATIENCE,
        check=False,
    )
    assert result.returncode == 1
    assert result.stderr == (
        "the standard input is no terminal: teleop reads keys from one; a joystick flies without\n"
    )


class Pad:
    """A gamepad of game_controller_node."""

    def __init__(self, client):
        self._client = client
        self.axes, self.buttons = [0.0] * 6, [0] * 15

    def send_until(self, topic, condition):
        """Send like the driver, 20 times a second, until a message meets a condition."""
        return self._client.publish_until("joy", Joy(axes=self.axes, buttons=self.buttons), topic, condition)

    def press(self, button, topic, condition):
        """Press and release a button."""
        self.buttons[button] = 1
        found = self.send_until(topic, condition)
        self.buttons[button] = 0
        self.send_until(topic, lambda _: True)
        return found


def test_a_joystick_flies_and_when_it_is_silent_the_trim_is_held(flight):
    client = flight.client
    node = flight.start("joystick", augmentation="false")
    client.next("controls", near_trim)
    pad = Pad(client)
    pad.send_until("controls", near_trim)

    pad.axes[3] = 0.5  # right stick forward: a push
    pushed = TRIM[2] + math.radians(2.0) * shaped(0.5, 0.03, 0.4)
    pad.send_until("controls", lambda message: abs(message.longitudinal_cyclic - pushed) < 1e-7)
    pad.axes[3] = 0.0

    pad.press(10, "controls", lambda message: abs(message.collective - TRIM[0] - math.radians(0.05)) < 1e-9)
    pad.press(3, "controls", lambda message: abs(message.collective - TRIM[0]) < 1e-9)  # back to the first trim
    pad.press(0, "controls", lambda _: "augmentation on" in node.output)

    pad.axes[3] = 1.0
    pad.send_until("controls", lambda message: message.longitudinal_cyclic - TRIM[2] > math.radians(1.0))
    client.until(lambda: "no joy for 0.5 s: sticks released, the trim is held" in node.output, "a warning")
    assert client.call(Reset, "reset").success
    client.next("controls", near_trim)

    client.publish("joy", Joy(axes=[0.0], buttons=[0]))
    client.until(lambda: "joy rejected: axes has 1 values: the pad needs axes[1]" in node.output, "a refusal")
    client.publish("joy", Joy(axes=[math.nan] * 6, buttons=[0] * 15))
    client.next("controls", near_trim)
    assert node.interrupt() == 0
    assert "Traceback" not in node.output


def test_a_wrong_joystick_file_is_one_line(tmp_path):
    path = tmp_path / "pad.yaml"
    path.write_text("expo: 2\n")
    with world(next(DOMAINS), tmp_path) as made:
        node = made.start("joystick", config=str(path))
        assert node.wait() == 1
        assert node.output.startswith(f"{path}: dead_zone, deflection_deg, trim_step_deg, timeout, pads: missing key")
        assert node.output.count("\n") == 1
