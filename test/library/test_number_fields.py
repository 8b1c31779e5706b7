"""Integers where a message wants floats: rclpy sends their bytes, and the field is named."""

import math

import numpy as np
import pytest

rclpy = pytest.importorskip("rclpy")

from geometry_msgs.msg import Vector3  # noqa: E402
from rclpy.serialization import deserialize_message, serialize_message  # noqa: E402
from ros_harness import DOMAINS, swashplate_message, world  # noqa: E402
from sensor_msgs.msg import Joy  # noqa: E402

from sbs_msgs.action import Sweep  # noqa: E402
from sbs_msgs.msg import Controls  # noqa: E402
from sbs_msgs.srv import Linearize, Reset, SetWind, Trim  # noqa: E402
from sbs_sim.errors import SbsError  # noqa: E402
from sbs_sim.nodes.command_monitor import CommandMonitor  # noqa: E402
from sbs_sim.nodes.number_fields import check_numbers, scalars  # noqa: E402
from sbs_sim.nodes.pilot_conversions import to_target  # noqa: E402
from sbs_sim.nodes.qos import COMMAND_QOS  # noqa: E402

FAINT = 5e-324  # an integer of one digit, to CPython until 3.11; later ones have some units of that
HINT = r"an integer in a float field\?"


@pytest.mark.parametrize("value", [5, True, 2**40, np.int64(5), np.int32(7)])
def test_what_rclpy_sends_for_an_integer_is_refused_by_name(value):
    """As a user's process does it, which looks at no type; the wheels' messages take what they get."""
    message = Vector3()
    message._check_fields = False
    message.x = value
    arrived = deserialize_message(serialize_message(message), Vector3)
    request = SetWind.Request(velocity=arrived)
    with pytest.raises(SbsError, match=rf"^velocity\.x = .*{HINT}"):
        check_numbers(request)


def spoilt(message, name):
    """Message with an integer's bytes in a field, by its path."""
    *path, last = name.split(".")
    part = message
    for step in path:
        part = getattr(part, step)
    setattr(part, last, FAINT)
    return message


def every_scalar():
    kinds = (Controls, Reset.Request, SetWind.Request, Trim.Request, Linearize.Request, Sweep.Goal)
    return [(kind, name) for kind in kinds for name, _ in scalars(kind())]


@pytest.mark.parametrize(("kind", "name"), every_scalar())
def test_every_field_is_looked_at(kind, name):
    check_numbers(kind())
    with pytest.raises(SbsError, match=rf"^{name} = 5e-324: allowed are 0 and .*{HINT}"):
        check_numbers(spoilt(kind(), name))


def test_there_are_fields_to_look_at():
    found = {(kind.__name__, name) for kind, name in every_scalar()}
    assert {("Controls", "collective"), ("Reset_Request", "position.z"), ("Sweep_Goal", "airspeed")} <= found
    names = [name for name, _ in scalars(swashplate_message([[0.1, 0.0, 0.0]] * 2))]
    assert names[0] == "rotors[0].collective"
    assert len(names) == 6


def test_a_target_is_looked_at():
    from geometry_msgs.msg import PoseStamped

    target = PoseStamped()
    target.header.frame_id, target.pose.orientation.w = "ned", 1.0
    to_target(target)
    with pytest.raises(SbsError, match=rf"^position\.y = 5e-324: .*{HINT}"):
        to_target(spoilt(target, "pose.position.y"))


def test_arrays_are_converted_by_rclpy():
    """So there is nothing to be refused: the axes of a joystick, the values of a sweep, a state."""
    for kind, field in ((Joy, "axes"), (Sweep.Goal, "values"), (Reset.Request, "state")):
        message = kind()
        message._check_fields = False
        setattr(message, field, [1, 2])
        assert list(getattr(deserialize_message(serialize_message(message), kind), field)) == [1.0, 2.0]


def test_a_command_that_fades_away_is_no_integer(tmp_path):
    """The output of a filter passes the smallest numbers on its way to zero, or stays among them for good."""
    with world(next(DOMAINS), tmp_path) as made:
        arrivals = CommandMonitor(made.client.node, Controls, "controls", COMMAND_QOS)
        value = 0.1
        for _ in range(2000):
            value *= 0.5
            command = Controls(collective=value, lateral_cyclic=max(value, FAINT))
            arrivals.check(command)
            arrivals.accept(command, 0.0)
        assert value == 0.0
        arrivals.check(Controls(lateral_cyclic=3 * FAINT))
        with pytest.raises(SbsError, match=rf"^longitudinal_cyclic = .*{HINT}"):
            arrivals.check(Controls(longitudinal_cyclic=FAINT))
        arrivals.restart()
        with pytest.raises(SbsError, match=HINT):
            arrivals.check(Controls(lateral_cyclic=FAINT))


def test_a_service_answers_with_the_cause(tmp_path):
    with world(next(DOMAINS), tmp_path) as made:
        made.start("simulator", components="[simulator]", record="off")
        reported = made.client.call(SetWind, "set_wind", velocity=Vector3(y=FAINT))
        assert not reported.success
        assert reported.message.startswith("velocity.y = 5e-324: allowed are 0 and ")
        assert "an integer in a float field?" in reported.message
        reported = made.client.call(SetWind, "set_wind", velocity=Vector3(y=math.nan))  # a negative one
        assert reported.message.startswith(
            "velocity.y = nan: allowed are -100 to 100 m/s; an integer in a float field?"
        )
        assert made.client.call(SetWind, "set_wind", velocity=Vector3(y=0.5)).success
