"""Time histories: what is kept of each instant, and the charts of it."""

import collections
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from viser import ViserServer, uplot

from sbs_sim.aircraft import Aircraft
from sbs_sim.cockpit.trim_report import line
from sbs_sim.flight.records import Snapshot
from sbs_sim.model import records as R
from sbs_sim.model import state as S
from sbs_sim.model.frames import quaternion_to_euler
from sbs_sim.output.plot_style import COLOURS

Array = NDArray[np.float64]

WINDOW = 20.0  # s of simulation time that the charts show
UNSEEN = 1e-6  # s
PERIOD = 0.04  # s of simulation time between two instants that are kept
AXIS = "#5c6670"
FONT = "10px sans-serif"
HEIGHT = 100  # pixels of a chart
HEAVY = 1e4  # N of weight, beyond which loads are in thousands
STEPS = (1.0, 2.0, 5.0, 10.0)  # of marks on a vertical axis, times a power of ten
MAX_AXIS_STEPS = 3  # between the ends of a vertical axis: so many have room for their numbers
MIN_RELATIVE_SPAN = 1e-3  # that a vertical axis covers, over the largest value: rounding is no signal
SHORT_NAMES = dict(zip(S.CONTROL_NAMES, ("coll", "lat", "lon", "diff"), strict=True))
DEGREES = 180.0 / math.pi


@dataclass(frozen=True)
class Chart:
    """Curves on common axes.

    Attributes
    ----------
    title, unit : str
    names : tuple of str
        One for each curve.
    values : callable
        Of a snapshot, in the order of the names and in the unit.
    digits : int
        Decimals of the numbers beside the title.
    least : float
        What the vertical axis covers at least.
    """

    title: str
    unit: str
    names: tuple[str, ...]
    values: Callable[[Snapshot], Sequence[float]]
    digits: int
    least: float


def body_charts(aircraft: Aircraft) -> tuple[Chart, ...]:
    """Charts of the body and the controls."""

    def attitude(snapshot: Snapshot) -> list[float]:
        yaw, pitch, roll = quaternion_to_euler(snapshot.state[S.ATTITUDE : S.VELOCITY])
        return [roll * DEGREES, pitch * DEGREES, yaw * DEGREES]

    def part(first: int, factor: float) -> Callable[[Snapshot], Sequence[float]]:
        return lambda snapshot: list(factor * snapshot.state[first : first + 3])

    def controls(snapshot: Snapshot) -> list[float]:
        values = aircraft.unmix(snapshot.swashplate).tolist()
        return [control.shown(value) for control, value in zip(aircraft.controls, values, strict=True)]

    def height(snapshot: Snapshot) -> list[float]:
        return [-float(snapshot.state[S.POSITION + 2])]

    def contact(snapshot: Snapshot) -> list[float]:
        rows = np.zeros((aircraft.layout.contacts, 3)) if snapshot.contact is None else snapshot.contact
        return (-rows[:, 2]).tolist()

    units = {control.shown_unit for control in aircraft.controls}
    names = tuple(SHORT_NAMES.get(name, name.replace("_", " ")) for name in aircraft.control_names)
    points = tuple(point.name for point in aircraft.contact_points) if aircraft.has_contact else ()
    return (
        Chart("Attitude", "deg", ("roll", "pitch", "yaw"), attitude, 2, 1.0),
        Chart("Rates", "deg/s", ("p", "q", "r"), part(S.RATES, DEGREES), 2, 1.0),
        Chart("Controls", units.pop() if len(units) == 1 else "", names, controls, 2, 1.0),
        Chart("Velocity, body axes", "m/s", ("u", "v", "w"), part(S.VELOCITY, 1.0), 2, 0.5),
        Chart("Height", "m", ("above origin",), height, 2, 0.5),
        *([Chart("Contact with the ground, up", "N", points, contact, 1, 5.0)] if points else []),
    )


def rotor_charts(aircraft: Aircraft) -> tuple[Chart, ...]:
    """Charts of the rotors; of coordinates the first three, whatever the number of blades."""
    layout, rotors = aircraft.layout, range(len(aircraft.rotors))
    several = len(aircraft.rotors) > 1

    def names(*kinds: str) -> tuple[str, ...]:
        return tuple(f"{kind} ({j + 1})" if several else kind for j in rotors for kind in kinds)

    def coordinates(part: Callable[[int], slice], factor: float) -> Callable[[Snapshot], Sequence[float]]:
        return lambda snapshot: [float(factor * value) for j in rotors for value in snapshot.state[part(j)][:3]]

    heavy = aircraft.body.mass * aircraft.environment.gravity > HEAVY
    factor, kilo = (1e-3, "k") if heavy else (1.0, "")

    def thrust(snapshot: Snapshot) -> list[float]:
        return [factor * float(snapshot.loads[j, R.THRUST]) for j in rotors]

    def power(snapshot: Snapshot) -> list[float]:
        speeds = aircraft.rotor_speeds(snapshot.state).tolist()
        return [factor * float(snapshot.loads[j, R.TORQUE]) * speeds[j] for j in rotors]

    return (
        Chart("Flap", "deg", names("a0", "a1", "b1"), coordinates(layout.flap, DEGREES), 2, 0.1),
        Chart("Lag", "deg", names("ξ0", "ξc", "ξs"), coordinates(layout.lag, DEGREES), 2, 0.1),
        Chart("Inflow, over tip speed", "1", names("λ0", "λs", "λc"), coordinates(layout.inflow, 1.0), 4, 1e-3),
        Chart("Thrust", f"{kilo}N", names("T"), thrust, 3 if heavy else 1, factor * 5.0),
        Chart("Power", f"{kilo}W", names("P"), power, 1 if heavy else 0, factor * 50.0),
    )


class ChartHistory:
    """The charts' values of the last seconds.

    Parameters
    ----------
    charts : sequence of Chart
    """

    def __init__(self, charts: Sequence[Chart]) -> None:
        self._charts = charts
        self._rows: collections.deque[list[float]] = collections.deque()
        self._newest: list[float] = []
        self.beginning = 0.0  # time of the first instant, which may be kept no more [s]

    def add(self, snapshot: Snapshot) -> None:
        """Take an instant, to be kept if it is far enough from the last one; one before that begins anew."""
        if self._rows and snapshot.time < self._rows[-1][0]:
            self._rows.clear()
        self._newest = [snapshot.time, *(value for chart in self._charts for value in chart.values(snapshot))]
        if not self._rows:
            self.beginning = snapshot.time
        elif snapshot.time == self._rows[-1][0]:
            self._rows[-1] = self._newest  # a reset of a paused flight
        if not self._rows or snapshot.time >= self._rows[-1][0] + 0.999 * PERIOD:
            self._rows.append(self._newest)
        while self._rows[0][0] < snapshot.time - WINDOW:
            self._rows.popleft()

    def clear(self) -> None:
        """Forget all."""
        self._rows.clear()
        self._newest = []

    def table(self) -> Array:
        """Time and values of what is kept and of the newest instant, shape (instants, 1 + curves of all charts)."""
        if not self._rows:
            return np.zeros((0, 1 + sum(len(chart.names) for chart in self._charts)))
        return np.array([*self._rows, self._newest])


class ChartColumn:
    """Charts below each other.

    Parameters
    ----------
    server : ViserServer
    charts : sequence of Chart
    heading : str
        Their title.
    """

    def __init__(self, server: ViserServer, charts: Sequence[Chart], heading: str = "") -> None:
        self._charts = charts
        self.history = ChartHistory(charts)
        self._heading = server.gui.add_html(line(heading, "font-size:11px;padding:2px 8px"))
        self._captions, self._plots = [], []
        self._updates = 0
        for chart in charts:
            self._captions.append(server.gui.add_html(_caption(chart, None)))
            self._plots.append(_plot(server, chart))

    def update(self) -> None:
        """Draw what the history holds."""
        table = self.history.table()
        if not len(table):
            return
        left = max(self.history.beginning, float(table[-1, 0]) - WINDOW)
        # A row more at both ends, in which no curve goes on: the axis covers as much time at any time. In a tab that
        # was hidden the page makes its axis anew only where the ends change: they do, by nothing that could be seen.
        self._updates += 1
        time = np.array([left, *table[:, 0], left + WINDOW + UNSEEN * (self._updates % 2)])
        column = 1
        for chart, caption, plot in zip(self._charts, self._captions, self._plots, strict=True):
            curves = table[:, column : column + len(chart.names)]
            column += len(chart.names)
            caption.content = _caption(chart, curves[-1])
            # nothing but the data is changed: other properties make the page build its charts anew
            low, high = axis_range(float(curves.min()), float(curves.max()), chart.least)
            limits = np.full(len(time), low)
            limits[-1] = high
            plot.data = (time, *(np.array([curve[0], *curve, math.nan]) for curve in curves.T), limits)

    def remove(self) -> None:
        """Take the charts off the page."""
        for handle in (self._heading, *self._captions, *self._plots):
            handle.remove()


def axis_range(low: float, high: float, least: float) -> tuple[float, float]:
    """Limits of a vertical axis at marks, of which at least two are numbered; rounding does not fill it.

    Parameters
    ----------
    low, high : float
        Of the values.
    least : float
        What it covers at least.
    """
    margin = max(0.0, 0.5 * (least - (high - low)), 0.5 * (MIN_RELATIVE_SPAN * max(abs(low), abs(high)) - (high - low)))
    low, high = low - margin, high + margin
    power = 10.0 ** math.floor(math.log10((high - low) / MAX_AXIS_STEPS))
    for step in (power * factor for factor in (*STEPS, 20.0)):
        first, last = math.floor(low / step + 1e-9), math.ceil(high / step - 1e-9)
        if last - first <= MAX_AXIS_STEPS:
            break
    return first * step, last * step


def _caption(chart: Chart, values: Array | None) -> str:
    """Title, unit, and the names of the curves in their colours with their latest values."""
    parts = []
    for i, name in enumerate(chart.names):
        number = "" if values is None else f" {round(values[i], chart.digits) + 0.0:.{chart.digits}f}"
        parts.append(f'<span style="color:{COLOURS[i % len(COLOURS)]};white-space:nowrap">{name}{number}</span>')
    style = "font:11px sans-serif;padding:2px 8px 0 8px;margin-bottom:-8px;line-height:1.3"
    return (
        f'<div style="{style};font-variant-numeric:tabular-nums">'
        f"<b>{chart.title}</b> [{chart.unit}]&ensp;{'&ensp;'.join(parts)}</div>"
    )


def _plot(server: ViserServer, chart: Chart) -> Any:
    grid = {"stroke": "#e3e6e9", "width": 1.0}
    axis: dict[str, Any] = {"stroke": AXIS, "font": FONT, "grid": grid, "ticks": {"show": False}}
    series: list[uplot.Series] = [{"label": "t [s]"}]
    for i, name in enumerate(chart.names):
        series.append({"label": name, "stroke": COLOURS[i % len(COLOURS)], "width": 1.2, "points": {"show": False}})
    # what nobody sees holds the vertical axis to the limits that it is given
    series.append({"label": "limits", "width": 0.0, "stroke": "transparent", "points": {"show": False}})
    nothing = np.array([0.0, math.nan])  # not first: the page would take it for the least value
    return server.gui.add_uplot(
        (np.array([0.0, WINDOW]), *(nothing for _ in chart.names), np.array([0.0, chart.least])),
        tuple(series),
        scales={"x": {"time": False}, "y": {"range": {"min": {"pad": 0.0}, "max": {"pad": 0.0}}}},
        axes=({**axis, "size": 22.0, "space": 60.0}, {**axis, "size": 46.0, "space": 22.0}),
        legend={"show": False},
        cursor={"show": False},
        height=HEIGHT,
        padding=(9, 10, 0, 0),
    )
