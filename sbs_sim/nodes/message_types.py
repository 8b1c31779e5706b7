"""Message types: their installed definitions, and whether recorded messages agree with them."""

import importlib
import re
from pathlib import Path
from typing import Any

from ament_index_python.packages import get_package_share_directory, get_packages_with_prefixes
from mcap.records import Channel, Schema

from sbs_sim.errors import SbsError
from sbs_sim.recording import message_definition
from sbs_sim.recording.cdr import Fit
from sbs_sim.recording.definitions import parse, short_name

EMPTY = "structure_needs_at_least_one_member"
MESSAGE_TYPE = re.compile(r"(?P<package>[a-z][a-z0-9_]*)/(msg/)?(?P<name>[A-Z][A-Za-z0-9]*)")


def installed_type(channel: Channel, schema: Schema | None) -> Any:
    """Class of a channel's messages.

    Raises
    ------
    SbsError
        They are no ROS 2 messages, or their type is not installed or not the one that was recorded.
    """
    if schema is None or channel.message_encoding != "cdr":
        raise SbsError(f"its messages are no ROS 2 messages but {channel.message_encoding or 'of no known kind'}")
    kind = installed_class(schema.name)
    if kind is None:
        raise SbsError(f"{schema.name} is not installed")
    if schema.encoding == "ros2msg" and schema.data:
        recorded = _fields(schema.name, schema.data.decode(errors="replace"))
        installed = _fields(schema.name, message_definition(schema.name, definition_file))
        if any(recorded.get(name) != fields for name, fields in installed.items()):
            raise SbsError(f"{schema.name} is installed with other fields than were recorded")
    return kind


def fit_of(schema: Schema | None) -> Fit:
    """Check of messages against the installed definition of their type."""
    name = "" if schema is None else schema.name
    return Fit(parse(name, message_definition(name, definition_file)), short_name(name))


def installed_class(type_name: str) -> Any:
    """Class of a message type, None if ROS has none of that name: to import is to execute, so nothing else is."""
    found = MESSAGE_TYPE.fullmatch(type_name)
    if found is None or found["package"] not in get_packages_with_prefixes():
        return None
    try:
        kind = getattr(importlib.import_module(f"{found['package']}.msg"), found["name"])
    except (ImportError, AttributeError):
        return None
    return kind if hasattr(kind, "get_fields_and_field_types") else None


def _fields(type_name: str, text: str) -> dict[str, list[tuple[str, str, int | None]]]:
    """What decides how a message is written, by type; some writers name the byte that an empty message has."""
    return {
        kind: [(field.name, field.type, field.count) for field in fields if field.name != EMPTY]
        for kind, fields in parse(type_name, text).items()
    }


def definition_file(package: str, name: str) -> Path:
    """Path of an installed interface definition.

    Raises
    ------
    LookupError
        The package is not installed.
    """
    return Path(get_package_share_directory(package)) / name
