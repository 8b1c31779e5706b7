"""The log of a flight: everything that the nodes of a process publish or accept, into one MCAP file.

The publishers (`sbs_sim.nodes.recorded_publisher`) serialise each message once. Recording one puts it into a queue.
"""

import datetime
import importlib.metadata
import itertools
import os
import re
from pathlib import Path
from typing import Any

from rclpy.qos import QoSProfile

from sbs_sim.errors import RecordingError
from sbs_sim.flight.simulation import Simulation
from sbs_sim.nodes.message_types import definition_file
from sbs_sim.nodes.recorded_qos import offered
from sbs_sim.recording import LogWriter, message_definition, type_hash
from sbs_sim.recording.flight_metadata import simulation_attachments, simulation_metadata
from sbs_sim.versions import surroundings, versions

MAX_NAME_LENGTH = 60  # characters of the aircraft's that go into the file's
RCLPY_OF = {"3": "humble", "4": "iron", "7": "jazzy", "9": "kilted"}  # distributions by the first number of its version
CLOSING_TIMEOUT = 10.0  # s to get the rest of a log onto the disk


class FlightLog:
    """Writes the log of one flight.

    Parameters
    ----------
    record : str
        Where to: the path of a file, or of an existing folder, or empty for the default folder.
    simulation : Simulation
    parameters : dict of str to object
        Of the nodes, for the record.

    Raises
    ------
    RecordingError
        The file cannot be made.
    """

    def __init__(self, record: str, simulation: Simulation, parameters: dict[str, Any]) -> None:
        begin = datetime.datetime.now(datetime.timezone.utc).astimezone()
        self._channels: dict[str, tuple[Any, int]] = {}
        own_versions = versions()
        self._writer = LogWriter(
            log_path(record, simulation.aircraft.name, begin),
            library=f"sbs_sim {own_versions['sbs_sim']}",
            wall_start=round(begin.timestamp() * 1e9),
            metadata={
                "simulation": simulation_metadata(simulation),
                "versions": {**own_versions, **surroundings()},
                "parameters": {name: repr(value) for name, value in parameters.items()},
            },
            attachments=simulation_attachments(simulation),
            ros_distro=ros_distro(),
        )

    @property
    def path(self) -> Path:
        """Where the log is."""
        return self._writer.path

    @property
    def has_room(self) -> bool:
        """See `LogWriter.has_room`."""
        return self._writer.has_room

    @property
    def dropped(self) -> int:
        """Messages that did not get into the log."""
        return self._writer.dropped

    @property
    def fault(self) -> str:
        """Why the log cannot go on; empty if it can."""
        return self._writer.failed

    def channel(self, topic: str, kind: Any, qos: QoSProfile, role: str) -> int:
        """Channel for the messages of a topic that has a role in the flight."""
        if topic in self._channels:  # several nodes publish it
            known, number = self._channels[topic]
            if known is not kind:
                raise RecordingError(f"topic {topic} cannot be recorded with two types, see the remaps")
            return number
        package, name = kind.__module__.split(".")[0], kind.__name__
        type_name = f"{package}/msg/{name}"
        definition, digest = message_definition(type_name, definition_file), type_hash(type_name, definition_file)
        number = self._writer.add_channel(topic, type_name, definition, offered(qos), digest, role)
        self._channels[topic] = kind, number
        return number

    def write(self, channel: int, time: float, data: bytes, wait: bool = False, essential: bool = False) -> None:
        """Record a serialised message of a simulation time [s]; one that finds no room is counted, not waited for."""
        self._writer.write(channel, round(time * 1e9), data, wait, essential)

    def close(self) -> None:
        """Write the rest and end the file."""
        self._writer.close(CLOSING_TIMEOUT)

    def discard(self) -> None:
        """End the file and delete it."""
        self._writer.discard(CLOSING_TIMEOUT)


def log_path(record: str, aircraft: str, begin: datetime.datetime) -> Path:
    """File of a log: the one that was named, or one named after time and aircraft in a folder.

    Raises
    ------
    RecordingError
        The default folder cannot be made.
    """
    if record and not os.path.isdir(record):  # which says no to names that no file can have, as Path does not
        return Path(record)
    folder = Path(record or os.environ.get("SBS_SIM_BAGS") or "bags")
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise RecordingError(f"{folder}: {error.strerror}") from None
    # the name comes from a file of unknown origin: it must not lead out of the folder
    safe = re.sub(r"[^\w.-]+", "_", aircraft)[:MAX_NAME_LENGTH]
    name = f"{begin:%Y-%m-%d_%H-%M-%S}_{safe}"
    others = (folder / f"{name}_{number}.mcap" for number in itertools.count(2))  # of the same second
    return next(path for path in itertools.chain([folder / f"{name}.mcap"], others) if not os.path.lexists(path))


def ros_distro() -> str:
    """Name of the distribution of ROS 2 that runs; empty where it is not known.

    An installed one says it in the environment. The wheels do not: there rclpy's version does (REP 2000).
    """
    if name := os.environ.get("ROS_DISTRO"):
        return name
    try:
        version = importlib.metadata.version("rclpy")
    except importlib.metadata.PackageNotFoundError:
        return ""
    return RCLPY_OF.get(version.split(".")[0], "")
