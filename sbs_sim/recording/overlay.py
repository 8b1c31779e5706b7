"""Time histories of several flights over one another: logs, a log flown again, a linear model for its inputs."""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from sbs_sim.aircraft import Aircraft
from sbs_sim.content import ByContent
from sbs_sim.errors import RecordingError, SbsError
from sbs_sim.flight.records import Rows
from sbs_sim.flight.refly import refly, rescaled, started
from sbs_sim.model import records as R
from sbs_sim.model import state as S
from sbs_sim.model.frames import euler_angles
from sbs_sim.output.plot_style import COLOURS, DASHES
from sbs_sim.recording.recorded_flight import RecordedFlight
from sbs_sim.versions import versions

Array = NDArray[np.float64]
Curves = Mapping[str, tuple[Array, Array]]  # name to time and values

SIMULATION_TIME = "simulation time [s]"
WIDTH, PANEL_HEIGHT = 8.0, 1.7  # in
TITLE_HEIGHT = 0.22  # in, of each flight
STILL = 1e-6  # what an axis covers at least
# Fixed, so that the same log gives the same bytes; text stays text.
SETTINGS: Any = {"svg.hashsalt": "sbs_sim", "svg.fonttype": "none", "font.size": 9.0}
SAID: dict[str, Callable[[str], str]] = {  # where flights differ in them, and how
    "aircraft": str,
    "parameter_hash": lambda text: f"parameters {text[:8]}",
    "step_size": lambda text: f"step {1e3 * float(text):.4g} ms",
    "method": lambda text: f"method {text}",
    "sbs_sim": lambda text: f"version {text}",
    "model_sources": lambda text: f"model {text[:8]}",
}
EARTH = ("yaw", "north", "east", "height")  # what a linear model knows nothing of
BEYOND = 3.0  # times the range of the first flight, which is all that others may ask of an axis


@dataclass(frozen=True, eq=False)
class Flown(ByContent):
    """A flight to draw.

    Attributes
    ----------
    name : str
        What it is, in a few words.
    panels : mapping of str to Curves
        By label with unit.
    facts : mapping of str to str
        Aircraft, options and versions.
    axis : str
        Label of the time.
    """

    name: str
    panels: Mapping[str, Curves]
    facts: Mapping[str, str]
    axis: str = SIMULATION_TIME


def flown_again(flight: RecordedFlight, changes: Mapping[str, Any] | None = None, azimuth_step: float = 0.0) -> Flown:
    """Fly the events of a recorded flight again, perhaps with a changed aircraft or another step.

    Parameters
    ----------
    flight : RecordedFlight
    changes : mapping of str to value, optional
        See `Aircraft.with_values`.
    azimuth_step : float
        [rad] of the fastest rotor; 0 takes that of the log.

    Raises
    ------
    SbsError
        A change or a step that is not possible.
    """
    aircraft = flight.aircraft.with_values(dict(changes)) if changes else flight.aircraft
    options = flight.options | ({"azimuth_step": azimuth_step} if azimuth_step else {})
    own = started(aircraft, flight.events, **options)
    factor = flight.step_size / own.step_size
    snapshots = []
    name = "flown again"
    try:
        for snapshot in refly(
            aircraft, rescaled(flight.events, factor), round(int(flight.steps[-1]) * factor), **options
        ):
            snapshots.append(snapshot)
    except SbsError as error:
        name += f" until {error}"
    rows = Rows.of(snapshots)
    if changes:
        name += " with " + ", ".join(f"{path}={value}" for path, value in changes.items())
    facts = {
        "aircraft": aircraft.name,
        "parameter_hash": aircraft.parameter_hash,
        "step_size": repr(own.step_size),
        "method": str(own.options["method"]),
        **versions(),
    }
    power = rows.loads[:, :, R.TORQUE] * aircraft.rotor_speeds(rows.state)
    return Flown(name, state_panels(aircraft, rows.time, rows.state, power), facts)


def state_panels(aircraft: Aircraft, time: Array, states: Array, power: Array | None = None) -> dict[str, Curves]:
    """Panels of simulation states, shape (n, size), as those of a log are called."""
    layout, rotors = aircraft.layout, range(len(aircraft.rotors))

    def curves(names: Sequence[str], values: Array, factor: float = 1.0) -> Curves:
        return {name: (time, factor * column) for name, column in zip(names, values.T, strict=True)}

    def of_rotors(names: Sequence[str], part: Any, factor: float) -> Curves:
        found: dict[str, tuple[Array, Array]] = {}
        for j in rotors:
            values = states[:, part(j)]
            found |= curves([f"{name} ({j + 1})" for name in names[: values.shape[1]]], values[:, : len(names)], factor)
        return found

    degrees = float(np.degrees(1.0))
    angles = np.unwrap(euler_angles(states[:, S.ATTITUDE : S.VELOCITY]), axis=0)
    panels = {
        "position [m]": curves(("north", "east", "height"), states[:, :3] * [1.0, 1.0, -1.0]),
        "velocity [m/s]": curves("uvw", states[:, S.VELOCITY : S.RATES]),
        "attitude [deg]": curves(("yaw", "pitch", "roll"), angles, degrees),
        "rates [deg/s]": curves("pqr", states[:, S.RATES : S.BODY_SIZE], degrees),
        "flap [deg]": of_rotors(("a0", "a1", "b1"), layout.flap, degrees),
        "lag [deg]": of_rotors(("xi0", "xic", "xis"), layout.lag, degrees),
        "inflow [1]": of_rotors(("lambda0", "lambdas", "lambdac"), layout.inflow, 1.0),
    }
    if power is not None:
        panels["power [W]"] = curves([f"power ({j + 1})" for j in rotors], power)
    return panels


def without_place(panels: Mapping[str, Curves]) -> dict[str, Curves]:
    """Panels without position and heading, of a flight that has none."""
    left = {
        label: {name: pair for name, pair in curves.items() if name not in EARTH} for label, curves in panels.items()
    }
    return {label: curves for label, curves in left.items() if curves}


# --- drawing ----------------------------------------------------------------------------------------------------


def panel_rows(count: int, above: float = 0.0) -> tuple[Figure, list[Axes]]:
    """Figure with panels below one another; `above` is room for a title [in]."""
    figure = Figure(figsize=(WIDTH, PANEL_HEIGHT * count + 0.6 + above), layout="constrained")
    FigureCanvasAgg(figure)
    return figure, list(figure.subplots(count, 1, sharex=True, squeeze=False)[:, 0])


def finish(
    axes: Axes, label: str, curves: Collection[tuple[Array, Array]], legend: Collection[Any] | None = None
) -> None:
    """Scale, label, grid and legend of a panel."""
    largest = max([STILL, *(float(np.abs(values[np.isfinite(values)]).max(initial=0.0)) for _, values in curves)])
    low, high = axes.get_ylim()
    if 0.5 * high - 0.5 * low < 0.5e-3 * largest:  # rounding is no signal; of numbers whose difference may not be one
        middle = 0.5 * low + 0.5 * high
        axes.set_ylim(middle - 0.05 * largest, middle + 0.05 * largest)
    axes.set_ylabel(label)
    axes.grid(color="#dddddd", linewidth=0.6)
    shown = {} if legend is None else {"handles": list(legend)}
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False, fontsize=8, **shown)


def overlay_figure(flights: Sequence[Flown]) -> Figure:
    """Flights over one another: colours for quantities, dashes for flights, which the title names.

    Raises
    ------
    RecordingError
        More than four flights, different axes of time, or nothing in common.
    """
    if len(flights) > len(DASHES):
        raise RecordingError(f"{len(flights)} flights over one another: allowed are {len(DASHES)}")
    if len({flown.axis for flown in flights}) > 1:
        told = "; ".join(f"{flown.name}: {flown.axis}" for flown in flights)
        raise RecordingError(f"the flights have no common time: {told}")
    labels = [label for label in flights[0].panels if any(label in other.panels for other in flights[1:])]
    if not labels:
        raise RecordingError(f"{flights[0].name} and the others have no quantity in common")
    with rc_context(SETTINGS):
        figure, rows = panel_rows(len(labels), TITLE_HEIGHT * len(flights))
        for axes, label in zip(rows, labels, strict=True):
            _draw_over(axes, label, [flown.panels.get(label, {}) for flown in flights])
        rows[-1].set_xlabel(flights[0].axis)
        dashes: Any = DASHES[: len(flights)]
        lines = [Line2D([], [], color="0.2", linestyle=dash) for dash in dashes]
        names = [described(flown, flights) for flown in flights]
        legend = figure.legend(lines, names, loc="outside upper left", frameon=False, fontsize=9)
        for text in legend.get_texts():
            text.set_parse_math(False)  # names of files are no markup
    return figure


def described(flown: Flown, flights: Sequence[Flown]) -> str:
    """Name of a flight, with what differs between them."""
    differ = [name for name in SAID if len({other.facts[name] for other in flights if name in other.facts}) > 1]
    told = [SAID[name](flown.facts[name]) for name in differ if name in flown.facts]
    return f"{flown.name} ({', '.join(told)})" if told else flown.name


def _draw_over(axes: Axes, label: str, found: Sequence[Curves]) -> None:
    names = list(dict.fromkeys(name for curves in found for name in curves))
    colours = {name: COLOURS[i % len(COLOURS)] for i, name in enumerate(names)}
    for curves, dash in zip(found, DASHES, strict=False):
        for name, (time, values) in curves.items():
            axes.plot(time, values, color=colours[name], linestyle=dash, linewidth=1.2)
    own = np.concatenate([np.empty(0), *(values[np.isfinite(values)] for _, values in found[0].values())])
    if len(own):  # what leaves the first flight far behind would flatten it
        room = BEYOND * max(float(np.ptp(own)), STILL)
        bottom, top = axes.get_ylim()
        axes.set_ylim(max(bottom, float(own.min()) - room), min(top, float(own.max()) + room))
    handles = [Line2D([], [], color=colours[name], label=name) for name in names]
    finish(axes, label, [pair for curves in found for pair in curves.values()], handles)


# --- how far they are apart -------------------------------------------------------------------------------------


def apart(one: Flown, other: Flown) -> dict[str, tuple[str, float, float]]:
    """Largest difference of each panel: the quantity, how much, in the unit of the label, and when [s].

    The other flight is taken between its instants at those of the first.
    """
    found = {}
    for label, curves in one.panels.items():
        worst = ("", -1.0, 0.0)
        for name, (time, values) in curves.items():
            if name not in other.panels.get(label, {}):
                continue
            at, theirs = other.panels[label][name]
            inside = (time >= at.min()) & (time <= at.max())
            order = np.argsort(at, kind="stable")
            off = np.abs(values[inside] - np.interp(time[inside], at[order], theirs[order]))
            if np.isfinite(off).any() and (most := float(np.nanmax(off))) > worst[1]:
                worst = (name, most, float(time[inside][int(np.nanargmax(off))]))
        if worst[0]:
            found[label] = worst
    return found
