"""Charts of performance, and their page. No window and no global state of matplotlib is used."""

import math
from collections.abc import Callable, Sequence
from functools import partial
from html import escape
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from sbs_sim.analysis.html import document, plain_table
from sbs_sim.analysis.page import PAGE, inline_drawing, make_folder, save_drawings
from sbs_sim.analysis.performance import Boundary, Performance, State
from sbs_sim.analysis.plots import GRID, Drawing
from sbs_sim.output.files import write
from sbs_sim.output.plot_style import COLOURS

Array = NDArray[np.float64]

CSV = "performance.csv"
SIZE = (5.0, 3.6)  # inches
MARKERS = {"power": "o", "stall": "s", "controls": "^", "no trim": "x"}


def save_performance(report: Performance, folder: str | Path) -> list[Path]:
    """Write all charts as PNG and SVG, all numbers as CSV, and the page, which is the last of the paths.

    Raises
    ------
    ExportError
        Folder or files cannot be written.
    """
    folder = make_folder(folder)
    written, drawn = save_drawings(drawings(report), folder)
    shown = [(drawing, inline_drawing(drawing, svg)) for drawing, svg in drawn]
    written += [folder / CSV, folder / PAGE]
    write(written[-2], report.to_csv())
    write(written[-1], page_text(report, shown))
    return written


def drawings(report: Performance) -> list[Drawing]:
    """All charts that there are."""
    charts: list[tuple[str, Callable[[Performance], Figure]]] = [
        ("Power in level flight, with the airspeeds of best endurance and best range", power_figure),
        ("Highest climb rate, with what stops it", climb_figure),
    ]
    if len(report.masses):
        charts.append(("Ceiling of hover over the mass, with what stops it", ceiling_figure))
    if len(report.altitudes):
        charts.append(("Highest airspeed over the altitude, with what stops it", envelope_figure))
    if len(report.masses) > 1:
        charts.append(("Power in level flight over airspeed and mass; crosses cannot be flown", map_figure))
    return [
        Drawing(number, caption, False, partial(draw, report)) for number, (caption, draw) in enumerate(charts, start=1)
    ]


def power_figure(report: Performance) -> Figure:
    """Power over airspeed, and the tangent from the origin."""
    figure, axes = _axes("airspeed [m/s]", "power [W]")
    v = report.airspeeds
    power = np.array([state.power for state in report.level])
    axes.plot(v, power, color=COLOURS[0], marker=".")
    for state, speed in zip(report.level, v, strict=True):
        if state.limit in MARKERS and math.isfinite(state.power):
            axes.plot(speed, state.power, color=COLOURS[1], marker=MARKERS[state.limit], linestyle="none")
    if report.endurance is not None:
        axes.plot(*report.endurance, color=COLOURS[2], marker="v", linestyle="none", label="best endurance")
    if report.range is not None:
        speed, least = report.range
        axes.plot(speed, least, color=COLOURS[3], marker="D", linestyle="none", label="best range")
        end = float(v[-1])
        axes.plot([0.0, end], [0.0, least / speed * end], color=COLOURS[3], linewidth=0.8, linestyle="--")
    if math.isfinite(report.available):
        axes.axhline(report.available, color="0.4", linestyle=":", label="available")
    axes.set_ylim(bottom=0.0)
    _legend(axes)
    return figure


def climb_figure(report: Performance) -> Figure:
    """Highest climb rate over airspeed."""
    figure, axes = _axes("airspeed [m/s]", "climb rate [m/s]")
    _boundaries(axes, report.airspeeds, report.climbs)
    return figure


def ceiling_figure(report: Performance) -> Figure:
    """Hover ceiling over mass."""
    figure, axes = _axes("mass [kg]", "density altitude [m]")
    _boundaries(axes, report.masses, report.ceilings)
    return figure


def envelope_figure(report: Performance) -> Figure:
    """Highest airspeed at each altitude, which goes up."""
    figure, axes = _axes("airspeed [m/s]", "altitude [m]")
    _boundaries(axes, report.altitudes, report.fastest, upright=True)
    axes.set_xlim(left=0.0)
    return figure


def map_figure(report: Performance) -> Figure:
    """Power over airspeed and mass as contours."""
    figure, axes = _axes("airspeed [m/s]", "mass [kg]")
    power = np.array([[state.power for state in states] for states in report.map])
    flown = np.ma.masked_invalid(power)
    if np.count_nonzero(np.isfinite(power)) > 3:
        drawn = axes.contourf(report.airspeeds, report.masses, flown, 12, cmap="cividis")
        figure.colorbar(drawn, ax=axes, label="power [W]")
    for mass, states in zip(report.masses, report.map, strict=True):
        beyond = [v for v, state in zip(report.airspeeds, states, strict=True) if state.limit]
        axes.plot(beyond, [mass] * len(beyond), "x", color=COLOURS[1])
    return figure


def _axes(x: str, y: str) -> tuple[Figure, Axes]:
    figure = Figure(figsize=SIZE, layout="constrained")
    axes = figure.add_subplot()
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    axes.grid(True, color=GRID, linewidth=0.6)
    return figure, axes


def _boundaries(axes: Axes, over: Array, ends: Sequence[Boundary], upright: bool = False) -> None:
    """A curve with a mark for what stops each point."""
    values = np.array([end.value for end in ends])
    pair = (values, over) if upright else (over, values)
    axes.plot(*pair, color=COLOURS[0])
    for limit, marker in MARKERS.items():
        chosen = np.array([end.limit == limit for end in ends]) & np.isfinite(values)
        if chosen.any():
            axes.plot(pair[0][chosen], pair[1][chosen], color=COLOURS[0], marker=marker, linestyle="none", label=limit)
    _legend(axes)


def _legend(axes: Axes) -> None:
    if axes.get_legend_handles_labels()[0]:
        axes.legend(framealpha=0.85)


# --- the page ---------------------------------------------------------------------------------------------------


def statement(report: Performance) -> str:
    """What is shown, and the two airspeeds, in a sentence each."""
    there = f"{report.available:g} W of shaft power" if math.isfinite(report.available) else "no limit of power"
    parts = [f"{report.name} in steady flight, with {there}."]
    for name, found in (("Best endurance", report.endurance), ("Best range", report.range)):
        parts.append(
            f"{name}: {found[0]:.2f} m/s with {found[1]:.0f} W." if found else f"{name}: not within these airspeeds."
        )
    return " ".join(parts)


def level_rows(report: Performance) -> list[list[str]]:
    """Airspeed, power, power over airspeed, highest climb rate and what stops it, as texts."""
    rows = []
    for v, state, climb in zip(report.airspeeds, report.level, report.climbs, strict=True):
        per_way = _number(state.power / v, 1) if v > 0.0 else "-"
        rows.append(
            [f"{v:g}", _number(state.power, 0), per_way, _stop(state), _number(climb.value, 2), climb.limit or "-"]
        )
    return rows


LEVEL = ("airspeed [m/s]", "power [W]", "power/airspeed [N]", "level flight", "climb rate [m/s]", "stopped by")


def boundary_rows(over: Array, ends: Sequence[Boundary], digits: int) -> list[list[str]]:
    """Values, boundaries and what stops them, as texts."""
    return [
        [f"{value:g}", _number(end.value, digits), _number(end.power, 0), end.limit or "-"]
        for value, end in zip(over, ends, strict=True)
    ]


CEILING = ("mass [kg]", "hover ceiling [m]", "power [W]", "stopped by")
FASTEST = ("altitude [m]", "highest airspeed [m/s]", "power [W]", "stopped by")


def page_text(report: Performance, figures: Sequence[tuple[Drawing, str]]) -> str:
    """The page; figures with their inline SVG."""
    drawn = "\n".join(
        f'<figure id="{drawing.name}">\n{svg}\n<figcaption><b>Figure {drawing.number}.</b> {escape(drawing.caption)}'
        "</figcaption>\n</figure>"
        for drawing, svg in figures
    )
    sections = [
        ("charts", "Charts", f'<div class="figures">\n{drawn}\n</div>'),
        ("level", "Level flight and climb", plain_table("", LEVEL, level_rows(report))),
    ]
    if len(report.masses):
        rows = boundary_rows(report.masses, report.ceilings, 0)
        sections.append(("ceiling", "Ceiling of hover", plain_table("", CEILING, rows)))
    if len(report.altitudes):
        rows = boundary_rows(report.altitudes, report.fastest, 2)
        sections.append(("fastest", "Highest airspeed", plain_table("", FASTEST, rows)))
    return document(f"Performance of {report.name}", f"<p>{escape(statement(report))}</p>", sections)


def _number(value: float, digits: int) -> str:
    return f"{value:.{digits}f}" if math.isfinite(value) else "-"


def _stop(state: State) -> str:
    return state.limit or "can be flown"
