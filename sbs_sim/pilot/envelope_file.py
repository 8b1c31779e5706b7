"""Files of envelope controllers: YAML with the gains of every airspeed."""

from __future__ import annotations  # `help` then shows types by their names

from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sbs_sim import checks
from sbs_sim.aircraft import Aircraft
from sbs_sim.config_file import UnreadableError, read_yaml
from sbs_sim.errors import PilotError
from sbs_sim.output.files import write
from sbs_sim.pilot import envelope_law as L
from sbs_sim.pilot.envelope import Envelope, Gains, Limits

Array = NDArray[np.float64]

KIND = "sbs_sim envelope controller, 1"
SHAPES = {
    "controls": None,
    "fed_back": (L.AXIS_COUNT, L.FED_BACK),
    "integrals": (L.AXIS_COUNT, L.INTEGRALS),
    "lagged": (L.AXIS_COUNT, L.AXIS_COUNT),
    "outer": (L.OUTER_GAINS,),
}
SUFFIXES = (".yaml", ".yml")
MAX_SPEEDS, MAX_DELAY = 200, 50


def save_envelope(found: Envelope, path: str | Path) -> None:
    """Write a controller to a YAML file.

    Raises
    ------
    ExportError
        It cannot be written.
    """
    write(path, envelope_text(found))


def envelope_text(found: Envelope) -> str:
    """Content of such a file."""
    lines = [
        f"# Envelope controller of {found.aircraft}, made by `design`. SI units, rad. u = trim - gains x errors.",
        f"kind: {KIND}",
        f"aircraft: {found.aircraft}",
        f"parameter_hash: {found.parameter_hash}",
        f"control_names: [{', '.join(found.control_names)}]",
        f"axes: {found.axes.tolist()}  # indices of the controls that heave, roll, pitch and yaw",
        f"ranges: {found.ranges.tolist()}",
        f"gravity: {found.gravity!r}",
        f"length: {found.length!r}  # square root of the aircraft's span over 2.3 m",
        f"delay: {found.delay}  # ticks of 0.01 s for which the gains are",
        f"lag: {found.lag!r}  # of the actuators, likewise [s]",
        "limits:",
        *(f"  {name}: {value!r}" for name, value in asdict(found.limits).items()),
        "gains:",
    ]
    for gains in found.gains:
        lines += [f"  - airspeed: {gains.airspeed!r}", f"    pitch: {gains.pitch!r}", f"    roll: {gains.roll!r}"]
        for name in SHAPES:
            values = getattr(gains, name)
            if values.ndim == 1:
                lines.append(f"    {name}: {values.tolist()}")
            else:
                lines += [f"    {name}:", *(f"      - {row}" for row in values.tolist())]
    return "\n".join(lines) + "\n"


def load_envelope(path: str | Path) -> Envelope:
    """Read a controller from a file.

    Raises
    ------
    PilotError
        It cannot be read, or something in it is wrong: in one line.
    """
    try:
        content = read_yaml(Path(path))
    except UnreadableError as error:
        raise PilotError(f"{path}: {error}") from None
    try:
        return _envelope(content)
    except PilotError as error:
        raise PilotError(f"{path}: {error}") from None


def _envelope(content: Any) -> Envelope:
    if not isinstance(content, dict) or content.get("kind") != KIND:
        raise PilotError(f"kind: allowed is {KIND!r}")
    names = _value(content, "control_names")
    if not (isinstance(names, list) and names and all(isinstance(name, str) for name in names)):
        raise PilotError("control_names: allowed are names")
    count = len(names)
    axes = _numbers(content, "axes", (L.AXIS_COUNT,))
    if not all(value in range(count) for value in axes.tolist()):
        raise PilotError(f"axes = {axes.tolist()}: allowed are 0 to {count - 1}")
    blocks = _value(content, "gains")
    if not (isinstance(blocks, list) and 1 <= len(blocks) <= MAX_SPEEDS):
        raise PilotError(f"gains: allowed are 1 to {MAX_SPEEDS} airspeeds")
    gains = [_gains(block, count, f"gains[{i}]") for i, block in enumerate(blocks)]
    speeds = [one.airspeed for one in gains]
    if sorted(set(speeds)) != speeds:
        raise PilotError(f"gains: airspeeds {speeds}: allowed are rising ones")
    own = _value(content, "limits")
    if not isinstance(own, dict) or set(own) != {part.name for part in fields(Limits)}:
        raise PilotError(f"limits: allowed are {', '.join(part.name for part in fields(Limits))}")
    return Envelope(
        str(_value(content, "aircraft")),
        str(_value(content, "parameter_hash")),
        tuple(names),
        axes.astype(np.int64),
        _numbers(content, "ranges", (count, 2)),
        _number(content, "gravity"),
        _number(content, "length"),
        Limits(**{name: checks.number(name, value, 0.0, 1e6, "", PilotError) for name, value in own.items()}),
        tuple(gains),
        checks.integer("delay", _value(content, "delay"), 0, MAX_DELAY, PilotError),
        _number(content, "lag"),
    )


def _gains(block: Any, count: int, where: str) -> Gains:
    if not isinstance(block, dict):
        raise PilotError(f"{where}: allowed is a mapping")
    try:
        found: dict[str, Any] = {name: _numbers(block, name, shape or (count,)) for name, shape in SHAPES.items()}
        found |= {name: _number(block, name) for name in ("airspeed", "pitch", "roll")}
    except PilotError as error:
        raise PilotError(f"{where}.{error}") from None
    return Gains(**found)


def _value(content: dict[str, Any], name: str) -> Any:
    if name not in content:
        raise PilotError(f"{name}: missing")
    return content[name]


def _number(content: dict[str, Any], name: str) -> float:
    return checks.number(name, _value(content, name), -1e9, 1e9, "", PilotError)


def _numbers(content: dict[str, Any], name: str, shape: tuple[int, ...]) -> Array:
    values = checks.array(name, _value(content, name), PilotError)
    if values.shape != shape or not np.all(np.isfinite(values)):
        raise PilotError(f"{name} has shape {values.shape}: allowed are finite numbers of shape {shape}")
    return values


def check_aircraft(found: Envelope, aircraft: Aircraft) -> None:
    """Raise PilotError for an aircraft whose controls are not those of a controller."""
    if tuple(aircraft.control_names) != found.control_names:
        own = ", ".join(aircraft.control_names)
        raise PilotError(f"controller of {', '.join(found.control_names)}: {aircraft.name} has {own}")
