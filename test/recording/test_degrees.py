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


def test_angles_are_in_degrees_and_nothing_else_changes(messages):
    seen = set()
    for topic, (schema, kept) in messages.items():
        definition = schema.data.decode()
        degrees = Degrees(schema.name, definition)
        if not degrees.angles:
            continue
        before, after = reader(schema.name, definition), reader(degrees.type_name, degrees.definition)
        for data in kept:
            old, new = numbers(before(data)), numbers(after(degrees.convert(data)))
            for (name, value), (shown, turned) in zip(old, new, strict=True):
                if name == shown:
                    assert np.array_equal(turned, value)
                else:
                    seen.add(topic)
                    assert shown.replace("_deg", "") == name
                    assert turned == pytest.approx(np.degrees(value), rel=1e-15)
    assert seen >= WITH_ANGLES


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
    for data in (b"", b"\0\1\0\0\0", b"\0\1\0\0" + bytes(20), b"\0\7\0\0" + bytes(8)):
        with pytest.raises(RecordingError):
            degrees.convert(data)
