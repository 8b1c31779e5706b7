"""Plots of recorded flights over time: attitude, rates, velocity, controls, rotor coordinates, inflow."""

import io
from collections.abc import Callable, Mapping, Sequence
from html import escape
from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from sbs_sim.errors import RecordingError
from sbs_sim.model.frames import quaternion_to_euler
from sbs_sim.model.state import CONTROL_NAMES, SWASHPLATE_NAMES
from sbs_sim.output.files import check_target, write
from sbs_sim.output.plot_style import COLOURS, DASHES
from sbs_sim.recording.log import Log, Topic
from sbs_sim.recording.overlay import SETTINGS, SIMULATION_TIME, Curves, Flown, finish, overlay_figure, panel_rows

Array = NDArray[np.float64]

SUFFIXES = (".png", ".svg", ".html")
SAME = 1e-6  # s between stamp and log time where the log is in simulation time
STAMPED = ("state", "rotors", "inflow", "status")  # topics of the simulator, whose stamps are simulation times
PAGE = """<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>{title}</title>
<style>body {{ font-family: sans-serif; margin: 2em auto; max-width: 60em; }} svg {{ width: 100%; height: auto; }}
td {{ padding-right: 1.5em; vertical-align: top; }}</style></head>
<body><h1>{title}</h1><table>{rows}</table>
{figure}
</body></html>
"""


def plot(log: Log, path: str | Path, beside: Sequence[Flown] = ()) -> Path:
    """Draw a flight into a file, and others over it.

    Parameters
    ----------
    log : Log
    path : path-like
        .png, .svg or .html.
    beside : sequence of Flown
        Drawn over it, see `overlay_figure`.

    Raises
    ------
    RecordingError
        Nothing to draw.
    ExportError
        Another suffix, or a file that cannot be written.
    """
    target = Path(path)
    check_target(target, SUFFIXES)
    figure = overlay_figure([flown_of(log), *beside]) if beside else flight_figure(log)
    suffix = target.suffix.lower()
    kind = "png" if suffix == ".png" else "svg"
    with rc_context(SETTINGS), io.BytesIO() as stream:
        figure.savefig(stream, format=kind, dpi=150, metadata={"Date": None} if kind == "svg" else None)
        data = stream.getvalue()
    write(target, _page(log, beside, data.decode()) if suffix == ".html" else data)
    return target


def flown_of(log: Log) -> Flown:
    """What is drawn of a log.

    Raises
    ------
    RecordingError
        Nothing is.
    """
    panels = {label: curves for label, make in PANELS.items() if (curves := _curves(log, label, make))}
    if not panels:
        raise RecordingError(f"{log.path}: nothing to draw, there are {', '.join(log.topics) or 'no topics'}")
    facts = log.metadata.get("simulation", {}) | log.metadata.get("versions", {})
    return Flown(log.path.name, panels, facts, _axis(log)[1])


def flight_figure(log: Log) -> Figure:
    """Panels over a common time axis, one for each kind of quantity that the log holds.

    Raises
    ------
    RecordingError
        It holds none of them.
    """
    flown = flown_of(log)
    with rc_context(SETTINGS):
        figure, rows = panel_rows(len(flown.panels))
        for axes, (label, curves) in zip(rows, flown.panels.items(), strict=True):
            _draw(axes, label, curves)
        rows[-1].set_xlabel(flown.axis)
    return figure


def _curves(log: Log, label: str, make: Callable[[Log], Curves]) -> Curves:
    try:
        curves = make(log)
        for name, (time, values) in curves.items():
            if values.shape != time.shape:
                raise ValueError(f"{name} is not a number in every message")
    except (LookupError, TypeError, ValueError) as error:  # topics of our names with other fields
        raise RecordingError(f"{log.path}: {label} cannot be drawn: {' '.join(str(error).split())}") from None
    return curves


def _draw(axes: Axes, label: str, curves: Curves) -> None:
    for i, (name, (time, values)) in enumerate(curves.items()):
        axes.plot(
            time, values, color=COLOURS[i % len(COLOURS)], linestyle=DASHES[i % len(DASHES)], linewidth=1.2, label=name
        )
    finish(axes, label, curves.values())


# --- time ---------------------------------------------------------------------------------------------------------


def _axis(log: Log) -> tuple[Callable[[Array], Array] | None, str]:
    """Function from the log's time to that of the figure [s], None where that is the same; and the name of the axis.

    Other programs write messages down with the time of day at which they came; the stamps of the states tell what time
    it was in the flight.
    """
    known = _known(log)
    if known is None:
        begin = min((float(topic.time.min()) for topic in log.values() if len(topic.time)), default=0.0)
        return (lambda time: time - begin), "time since the first message [s]"
    times, stamps = known
    if np.abs(stamps - times).max() < SAME:
        return None, SIMULATION_TIME
    order = np.argsort(times, kind="stable")
    return (lambda time: np.interp(time, times[order], stamps[order])), SIMULATION_TIME


def _known(log: Log) -> tuple[Array, Array] | None:
    """Log times of what the simulator published with the simulation times in their stamps [s]."""
    for role in STAMPED:
        found = _topic(log, role)
        if found is not None and (stamps := found.stamp) is not None and stamps.any():
            return found.time, stamps
    return None


def _time(log: Log, role: str) -> Array:
    """Times of a topic [s]: of the simulator's the stamps, of others when they came, however those are stamped."""
    topic = log[role]
    convert, axis = _axis(log)
    if convert is None:
        return topic.time
    if role in STAMPED and axis == SIMULATION_TIME and topic.stamp is not None and topic.stamp.any():
        return topic.stamp
    return convert(topic.time)


# --- what a panel shows -----------------------------------------------------------------------------------------


def _topic(log: Log, name: str) -> Topic | None:
    return log.get(name)


def _fields(log: Log, topic: str, names: Mapping[str, str], factor: float = 1.0) -> dict[str, tuple[Array, Array]]:
    """Curves of fields by the name that they are shown with."""
    found = _topic(log, topic)
    if found is None or not len(found.time):
        return {}
    time = _time(log, topic)
    return {shown: (time, factor * found[field]) for shown, field in names.items() if field in found}


def _attitude(log: Log) -> Curves:
    state = _topic(log, "state")
    if state is None or not len(state.time):
        return {}
    quaternions = np.stack([state[f"attitude.{axis}"] for axis in "wxyz"], axis=1)
    angles = np.degrees([quaternion_to_euler(quaternion) for quaternion in quaternions])
    angles[:, 0] = np.degrees(np.unwrap(np.radians(angles[:, 0])))
    names = ("yaw", "pitch", "roll")
    time = _time(log, "state")
    return {name: (time, angles[:, i]) for i, name in enumerate(names)}


def _vector(topic: str, field: str, names: str, factor: float = 1.0) -> Callable[[Log], Curves]:
    return lambda log: _fields(
        log, topic, {name: f"{field}.{axis}" for name, axis in zip(names, "xyz", strict=True)}, factor
    )


def _height(log: Log) -> Curves:
    return {
        **_fields(log, "state", {"north": "position.x", "east": "position.y"}),
        **_fields(log, "state", {"height": "position.z"}, -1.0),
    }


def _controls(log: Log) -> Curves:
    names = {name.replace("_", " "): name for name in CONTROL_NAMES}
    return _fields(log, "controls", names, np.degrees(1.0))


def _swashplate(log: Log) -> Curves:
    return _of_rotors(log, "swashplate", {name: name for name in SWASHPLATE_NAMES}, np.degrees(1.0))


def _of_rotors(log: Log, topic: str, fields: Mapping[str, str], factor: float) -> Curves:
    found = _topic(log, topic)
    if found is None:
        return {}
    rotors = sorted({name.split("]")[0] + "]" for name in found if name.startswith("rotors[")})
    names = {
        f"{shown.replace('_', ' ')} ({j + 1})": f"{rotor}.{field}"
        for j, rotor in enumerate(rotors)
        for shown, field in fields.items()
    }
    return _fields(log, topic, names, factor)


def _coordinates(field: str, names: tuple[str, ...]) -> Callable[[Log], Curves]:
    """Multiblade coordinates of all rotors [deg]."""

    def curves(log: Log) -> Curves:
        whole = _of_rotors(log, "rotors", {field: field}, np.degrees(1.0))
        found = {}
        for shown, (time, values) in whole.items():
            for i, name in enumerate(names[: values.shape[1]] if values.ndim == 2 else ()):
                found[f"{name} {shown[shown.index('(') :]}"] = (time, values[:, i])
        return found

    return curves


def _contact(log: Log) -> Curves:
    """Force of the ground on every contact point against body z."""
    points = sum(name.startswith("contacts[") and name.endswith("].force.z") for name in _topic(log, "state") or ())
    return _fields(log, "state", {f"point {i + 1}": f"contacts[{i}].force.z" for i in range(points)}, -1.0)


PANELS: dict[str, Callable[[Log], Curves]] = {
    "position [m]": _height,
    "velocity [m/s]": _vector("state", "velocity", "uvw"),
    "attitude [deg]": _attitude,
    "rates [deg/s]": _vector("state", "angular_velocity", "pqr", np.degrees(1.0)),
    "controls [deg]": _controls,
    "swashplates [deg]": _swashplate,
    "flap [deg]": _coordinates("flap", ("a0", "a1", "b1")),
    "lag [deg]": _coordinates("lag", ("xi0", "xic", "xis")),
    "inflow [1]": lambda log: _of_rotors(
        log, "inflow", {"lambda0": "uniform", "lambdas": "sine", "lambdac": "cosine"}, 1.0
    ),
    "power [W]": lambda log: _of_rotors(log, "rotors", {"power": "power"}, 1.0),
    "contact, up [N]": _contact,
}


def _page(log: Log, beside: Sequence[Flown], svg: str) -> str:
    facts = {"log": str(log.path), "complete": "yes" if log.complete else "; ".join(log.reasons)}
    facts |= log.metadata.get("simulation", {})
    rows = "".join(f"<tr><td>{escape(key)}</td><td>{escape(value)}</td></tr>" for key, value in facts.items())
    for other in beside:
        told = "".join(f"<tr><td>{escape(key)}</td><td>{escape(value)}</td></tr>" for key, value in other.facts.items())
        rows += f'<tr><th colspan="2">{escape(other.name)}</th></tr>{told}'
    title = " and ".join([log.path.name, *(other.name for other in beside)])
    return PAGE.format(title=escape(title), rows=rows, figure=svg[svg.index("<svg") :])
