"""Recorded flight of a log: its aircraft, options, events and states."""

import math
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sbs_sim import checks
from sbs_sim.aircraft import Aircraft
from sbs_sim.content import ByContent
from sbs_sim.errors import RecordingError
from sbs_sim.flight.records import Event
from sbs_sim.flight.stitched_file import decoded
from sbs_sim.flight.stitched_simulation import STITCHED
from sbs_sim.model.gust_table import GustTable
from sbs_sim.model.state import SPEED
from sbs_sim.model.wind import Wind
from sbs_sim.recording.flight_metadata import AIRCRAFT_FILE, AIRFOIL_FOLDER, STITCHED_FILE
from sbs_sim.recording.flight_topics import alike
from sbs_sim.recording.log import Log, Topic
from sbs_sim.recording.mcap_file import RECOVERY

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]

OPTIONS = {"tick": float, "azimuth_step": float, "lead_lag": bool, "cyclic_inflow": bool, "method": str}
GROUND = "ground_altitude"  # an option too; older logs have none
FOREIGN = (
    "the log holds no flight of sbs_sim that can be flown again: aircraft and options are missing, which no topic has."
    " The simulator writes them into logs of its own (parameter `record`); `ros2 bag` cannot record them"
)
WIND_VECTORS = ("velocity", "gust", "turbulence_intensity")
WIND_NUMBERS = ("gust_delay", "gust_duration", "turbulence_length", "turbulence_airspeed", "turbulence_direction")
NEWER_NUMBERS = (
    *("turbulence_lateral_length", "turbulence_vertical_length", "turbulence_span", "gust_length", "gust_direction"),
    *("gust_distance", "reference_height", "roughness_length", "profile_exponent"),
)
WIND_WORDS = ("turbulence_model", "turbulence_extent", "gust_shape", "wind_profile")
DRIVE_FIELDS = {SPEED: "speed"}  # of DriveState, where they are not called as the state is
EVENT_COUNTS = ("wind_step", "wind_ticks", "drive")  # older logs have none of them
MAX_STATE_TIME = 10**17  # ns, three years of flight
MAX_STATE_GAP = 1e4  # s without a state; to fly through a damaged time would take for ever


@dataclass(frozen=True, eq=False)
class RecordedFlight(ByContent):
    """A recorded flight.

    Attributes
    ----------
    aircraft : Aircraft
    options : dict
        Those of `Simulation`; "model" is the stitched model that flew, if one did.
    events : tuple of Event
        Everything that acted on the flight, the start first.
    steps : ndarray of int, shape (n,)
        Integration step of each recorded state.
    states : ndarray, shape (n, size)
        Simulation states.
    step_size : float
        [s]
    versions : dict of str to str
        Of everything that decides a result.
    topics : dict of str to str
        Names of the recorded topics by their role: `state`, `events`, ...
    folder : TemporaryDirectory
        Holds the files of the aircraft as long as the flight is there.
    """

    aircraft: Aircraft
    options: dict[str, Any]
    events: tuple[Event, ...]
    steps: IntArray
    states: Array
    step_size: float
    versions: dict[str, str]
    topics: dict[str, str]
    folder: "tempfile.TemporaryDirectory[str]" = field(repr=False, compare=False)


def flight_of(log: Log) -> RecordedFlight:
    """Flight that a log holds.

    Raises
    ------
    RecordingError
        The log is not one of this package's, or lacks a part.
    """
    log = log.flight()
    if log.recordings > 1:
        raise RecordingError(alike(log.path, log.recordings))
    if not {"simulation", "versions"} <= log.metadata.keys():
        raise RecordingError(FOREIGN)
    try:
        simulation, recorded = log.metadata["simulation"], log.metadata["versions"]
        folder = tempfile.TemporaryDirectory(prefix="sbs_sim-")
        aircraft = _aircraft(log.attachments, Path(folder.name))
        if aircraft.parameter_hash != simulation["parameter_hash"]:
            raise RecordingError("the aircraft in the log is not the one that was flown: its hash differs")
        if not len(log["events"].time) or not len(log["state"].time):
            raise RecordingError("the log holds no flight of sbs_sim: it has no events or no states")
        if (starts := int(np.sum(log["events"]["kind"] == "start"))) > 1:  # older logs, of which others made one
            raise RecordingError(f"{log.path} has {starts} starts of a flight on {log['events'].name}: one, but twice?")
        step_size = checks.number("step_size", float(simulation["step_size"]), 1e-8, 1.0, "s", RecordingError)
        steps, states = _states(log, aircraft, step_size)
        if not len(steps):
            raise RecordingError("the log holds no states")
        events = _events(log, aircraft)
        if np.diff(steps, prepend=events[0].step).max() * step_size > MAX_STATE_GAP:
            raise RecordingError(f"the log has no states for more than {MAX_STATE_GAP:g} s of its flight")
        options = {name: _option(simulation[name], kind) for name, kind in OPTIONS.items()}
        options[GROUND] = float(simulation.get(GROUND, "-inf"))
        if simulation.get("model") == STITCHED:
            options["model"] = decoded(log.attachments[STITCHED_FILE], "in the log")
        return RecordedFlight(aircraft, options, events, steps, states, step_size, dict(recorded), log.roles, folder)
    except KeyError as error:
        raise RecordingError(f"the log holds no flight of sbs_sim: {error.args[0]} is missing") from None
    except (ValueError, IndexError, TypeError, OverflowError) as error:  # of our names, but with other contents
        raise RecordingError(f"the flight in the log is invalid: {' '.join(str(error).split())}") from None


def complete_until(log: Log) -> float:
    """Time up to which the log holds every command of its flight [s]; infinite if it holds all that were recorded.

    The messages of a topic are numbered. Events that are missing between others are found by that; some that are
    missing behind the last one may have been wherever a damaged log lacks the messages that follow upon them.
    """
    events, states = log["events"], log["state"]
    after_gap = np.flatnonzero(np.diff(events.sequence, prepend=0) != 1)
    if len(after_gap):
        last_known = events.time[after_gap[0] - 1] if after_gap[0] else 0.0
        return float(states.time[states.time < last_known].max(initial=0.0))
    if log.complete and log.metadata.get(RECOVERY, {}).get("complete") != "false":
        return math.inf
    holes: list[float] = []
    for topic in [log[name] for name in ("state", "status") if name in log]:
        is_hole = (np.diff(topic.sequence) != 1) & (topic.time[1:] > events.time[-1])
        holes += topic.time[:-1][is_hole].tolist()
    return min(holes, default=math.inf)


def _option(text: str, kind: type) -> Any:
    if kind is bool:
        return text == "True"
    return text if kind is str else kind(text)


def _aircraft(files: Mapping[str, bytes], folder: Path) -> Aircraft:
    """Aircraft of the attached files, which are laid into a folder."""
    (folder / AIRCRAFT_FILE).write_bytes(files[AIRCRAFT_FILE])
    for name, content in files.items():
        if not name.startswith(f"{AIRFOIL_FOLDER}/"):
            continue
        try:
            if Path(name).suffix != ".csv":
                raise ValueError("not a .csv file")
            (folder / Path(name).name).write_bytes(content)  # nowhere else, whatever a log calls it
        except (OSError, ValueError) as error:
            reason = getattr(error, "strerror", None) or error
            raise RecordingError(f"the log has an attachment {name[:60]!r} that cannot be used: {reason}") from None
    return Aircraft.load(folder / AIRCRAFT_FILE)


def _events(log: Log, aircraft: Aircraft) -> tuple[Event, ...]:
    """Events in their order."""
    topic = log["events"]
    found = []
    for i, kind in enumerate(topic["kind"]):
        swashplate, state = (np.array(topic[name][i], dtype=float) for name in ("swashplate", "state"))
        found.append(
            Event(
                int(topic["step"][i]),
                str(kind),
                swashplate.reshape(len(aircraft.rows), -1) if swashplate.size else None,
                state if state.size else None,
                _wind(topic, i) if kind in ("start", "wind") else None,
                **{name: int(topic[name][i]) for name in EVENT_COUNTS if name in topic},
                failure=float(topic["failure"][i]) if "failure" in topic else 0.0,
            )
        )
    return tuple(found)


def _wind(topic: Topic, i: int) -> Wind:
    fields: dict[str, Any] = {
        name: tuple(float(topic[f"wind.{name}.{axis}"][i]) for axis in "xyz") for name in WIND_VECTORS
    }
    fields |= {name: float(topic[f"wind.{name}"][i]) for name in WIND_NUMBERS}
    if "wind.gust_length" in topic:
        fields |= _newer_wind(topic, i)
    elif fields["gust_duration"] == 0.0:  # older logs may name the peak of a gust that there was not
        fields["gust"] = (0.0, 0.0, 0.0)
    return Wind(**fields, turbulence_seed=int(topic["wind.turbulence_seed"][i]))


def _newer_wind(topic: Topic, i: int) -> dict[str, Any]:
    """Fields of a wind that older logs do not have."""
    fields: dict[str, Any] = {name: float(topic[f"wind.{name}"][i]) for name in NEWER_NUMBERS}
    fields |= {name: str(topic[f"wind.{name}"][i]) for name in WIND_WORDS if str(topic[f"wind.{name}"][i])}
    fields["gust_origin"] = tuple(float(topic[f"wind.gust_origin.{axis}"][i]) for axis in "xyz")
    over = str(topic["wind.own_gust_over"][i])
    if over:
        rows: list[list[float]] = []
        while (name := f"wind.own_gust[{len(rows)}]") + ".position" in topic:
            row = [float(topic[f"{name}.{part}"][i]) for part in ("position", *(f"velocity.{axis}" for axis in "xyz"))]
            if math.isnan(row[0]):  # another wind has more rows
                break
            rows.append(row)
        table = np.array(rows).reshape(-1, 4)
        fields["own_gust"] = GustTable(over, table[:, 0], table[:, 1:])
    return fields


def _states(log: Log, aircraft: Aircraft, step_size: float) -> tuple[IntArray, Array]:
    """Simulation states where all three topics that make them up were recorded."""
    body, rotors, inflow = log["state"], log["rotors"], log["inflow"]
    for topic in (body, rotors, inflow):
        if np.abs(topic.time_ns).max(initial=0) > MAX_STATE_TIME:
            raise RecordingError(f"topic {topic.name} has a time of more than {MAX_STATE_TIME * 1e-9:g} s")
    where = _together(body, rotors, inflow)
    times = body.time_ns[where[0]]
    layout = aircraft.layout
    states = np.zeros((len(times), layout.size))
    fields = [f"position.{axis}" for axis in "xyz"] + [f"attitude.{axis}" for axis in "wxyz"]
    fields += [f"velocity.{axis}" for axis in "xyz"] + [f"angular_velocity.{axis}" for axis in "xyz"]
    for index, name in enumerate(fields):
        states[:, index] = body[name][where[0]]
    for j in range(len(aircraft.rotors)):
        parts = {"flap": layout.flap, "flap_rate": layout.flap_rate, "lag": layout.lag, "lag_rate": layout.lag_rate}
        for name, slice_of in parts.items():
            states[:, slice_of(j)] = rotors[f"rotors[{j}].{name}"][where[1]]
        for index, name in enumerate(("uniform", "sine", "cosine"), layout.inflow(j).start):
            states[:, index] = inflow[f"rotors[{j}].{name}"][where[2]]
        for i, pair in enumerate(layout.wake_pairs(j)):
            for name, place in zip(("slow", "fast"), pair, strict=True):
                states[:, place] = inflow[f"rotors[{j}].wake[{i}].{name}"][where[2]]
    for i in range(len(layout.drives)):
        for name, place in layout.drive(i).items():
            states[:, place] = rotors[f"drives[{i}].{DRIVE_FIELDS.get(name, name)}"][where[1]]
    for name in layout.section_names:
        for i, place in enumerate(range(layout.size)[layout.section(name)]):
            states[:, place] = inflow[f"sections[{i}].{name}"][where[2]]
    for i in range(layout.contacts):
        for axis, place in zip("xy", range(layout.size)[layout.contact(i)], strict=True):
            states[:, place] = body[f"contacts[{i}].deflection_{axis}"][where[0]]
    return np.round(times * 1e-9 / step_size).astype(np.int64), states


def _together(*topics: Topic) -> list[IntArray]:
    """Where each topic has the messages of the snapshots that all of them have, in the order of time.

    An instant comes several times where there was a reset. In our logs the topics are numbered alike. Where the numbers
    are those of another program, messages of one time belong together in their order, if no topic lacks one.
    """
    common = topics[0].sequence
    for topic in topics[1:]:
        common = np.intersect1d(common, topic.sequence)
    if all((np.diff(topic.sequence) > 0).all() for topic in topics):
        indices = [np.searchsorted(topic.sequence, common) for topic in topics]
        first, *others = (topic.time_ns[index] for topic, index in zip(topics, indices, strict=True))
        if len(common) and all((other == first).all() for other in others) and (np.diff(first) >= 0).all():
            return indices
    times = np.unique(np.concatenate([topic.time_ns for topic in topics]))
    counts = [np.bincount(np.searchsorted(times, topic.time_ns), minlength=len(times)) for topic in topics]
    complete = times[np.all([count == counts[0] for count in counts], axis=0)]
    orders = [np.argsort(topic.time_ns, kind="stable") for topic in topics]
    return [order[np.isin(topic.time_ns[order], complete)] for topic, order in zip(topics, orders, strict=True)]
