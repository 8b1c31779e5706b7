"""Messages with their angles in degrees: what changes, what stays, and that others read them by their definition."""

import dataclasses
import math
import re
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from sbs_sim.errors import RecordingError
from sbs_sim.recording.degrees import Degrees

LOG = Path(__file__).resolve().parents[2] / "bags" / "hover_step.mcap"
WITH_ANGLES = {"/state", "/rotors", "/controls", "/swashplate"}


@pytest.fixture(scope="module")
def messages():
    """Schema and some messages of every topic of a log."""
    found = {}
    with LOG.open("rb") as file:
        for schema, channel, message in make_reader(file).iter_messages():
            found.setdefault(channel.topic, (schema, []))[1].append(message.data)
    return {topic: (schema, data[:: max(1, len(data) // 5)]) for topic, (schema, data) in found.items()}


def reader(name, definition):
    """Decoder of another program."""
    store = get_typestore(Stores.EMPTY)
    store.register(get_types_from_msg(definition, name))
    return lambda data: store.deserialize_cdr(data, name)


def numbers(value, name=""):
    """Names and values of all that is in a message."""
    if dataclasses.is_dataclass(value):
        for field in dataclasses.fields(value):
            if field.name != "__msgtype__":
                yield from numbers(getattr(value, field.name), f"{name}.{field.name}")
    elif isinstance(value, list):
        for i, item in enumerate(value):
            yield from numbers(item, f"{name}[{i}]")
    else:
        yield name, value


def without_attitude(message):
    """A message less what was put behind it, if anything was."""
    kept = [one for one in dataclasses.fields(message) if one.name not in ("attitude_deg", "__msgtype__")]
    return dataclasses.make_dataclass("Rest", [one.name for one in kept])(*(getattr(message, one.name) for one in kept))


def test_angles_are_in_degrees_and_nothing_else_changes(messages):
    seen = set()
    for topic, (schema, kept) in messages.items():
        definition = schema.data.decode()
        degrees = Degrees(schema.name, definition)
        if not degrees.angles:
            continue
        before, after = reader(schema.name, definition), reader(degrees.type_name, degrees.definition)
        for data in kept:
            old, new = numbers(before(data)), numbers(without_attitude(after(degrees.convert(data))))
            for (name, value), (shown, turned) in zip(old, new, strict=True):
                if name == shown:
                    assert np.array_equal(turned, value)
                else:
                    seen.add(topic)
                    assert shown.replace("_deg", "") == name
                    assert turned == pytest.approx(np.degrees(value), rel=1e-15)
    assert seen >= WITH_ANGLES


def turn(axis, angle):
    """Matrix of a right-handed turn about an axis."""
    made, (i, j) = np.eye(3), ((1, 2), (2, 0), (0, 1))[axis]
    made[i, i] = made[j, j] = math.cos(angle)
    made[j, i] = math.sin(angle)
    made[i, j] = -made[j, i]
    return made


@pytest.mark.parametrize("contacts", [0, 1, 3])
def test_an_attitude_comes_with_roll_pitch_and_heading(messages, contacts):
    """They turn NED into body axes in the order heading, pitch, roll; what is in front of them stays."""
    schema, kept = messages["/state"]
    definition = schema.data.decode()
    store = get_typestore(Stores.EMPTY)
    store.register(get_types_from_msg(definition, schema.name))
    vector, contact = (store.types[name] for name in ("geometry_msgs/msg/Vector3", "sbs_msgs/msg/ContactState"))
    point = contact(vector(1.0, 2.0, 3.0), 0.1, 0.2, 0.3)
    w, x, y, z = 0.8, 0.2, -0.4, 0.4
    attitude = store.types["geometry_msgs/msg/Quaternion"](x, y, z, w)
    message = dataclasses.replace(
        store.deserialize_cdr(kept[0], schema.name), attitude=attitude, contacts=[point] * contacts
    )

    degrees = Degrees(schema.name, definition)
    converted = degrees.convert(bytes(store.serialize_cdr(message, schema.name)))
    shown = reader(degrees.type_name, degrees.definition)(converted)
    angles = np.radians([shown.attitude_deg.heading, shown.attitude_deg.pitch, shown.attitude_deg.roll])
    turned = turn(2, angles[0]) @ turn(1, angles[1]) @ turn(0, angles[2])
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    np.testing.assert_allclose(turned, np.eye(3) + 2.0 * (w * cross + cross @ cross), atol=1e-14)
    assert [one.depth for one in shown.contacts] == [0.1] * contacts


def test_angles_are_those_that_their_definition_gives_in_radians():
    definition = (
        "# Angle [rad].\nfloat64 angle\nfloat64[2] rates # [rad/s]\n# Angle [rad], speed [m/s].\nfloat64[] mixed\n"
        "geometry_msgs/Vector3 turn # [rad/s]\ngeometry_msgs/Vector3 velocity # [m/s]\nuint8 count # [rad]\n"
        "Inner[] inner\n"
        f"{'=' * 80}\nMSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n"
        f"{'=' * 80}\nMSG: a/Inner\nfloat64 slope # [rad]\n"
    )
    degrees = Degrees("a/msg/B", definition)
    assert degrees.angles == {"angle", "rates", "turn.x", "turn.y", "turn.z", "inner.slope"}
    names = re.findall(r"^\S+ (\w+)", degrees.definition, re.MULTILINE)
    assert names[:7] == ["angle_deg", "rates_deg", "mixed", "turn_deg", "velocity", "count", "inner"]
    assert "MSG: a/InnerDeg\nfloat64 slope_deg # [deg]" in degrees.definition
    assert degrees.type_name == "a/msg/BDeg"


def test_a_message_of_another_type_is_refused():
    degrees = Degrees("a/msg/B", "float64 angle # [rad]\n")
    assert degrees.convert(b"\0\1\0\0" + np.float64(math.pi).tobytes())[4:] == np.float64(180.0).tobytes()
    reversed_ = b"\0\0\0\0" + np.array(math.pi, ">f8").tobytes()
    for data in (b"", reversed_, b"\0\1\0\0\0", b"\0\1\0\0" + bytes(20), b"\0\7\0\0" + bytes(8)):
        with pytest.raises(RecordingError):
            degrees.convert(data)
