"""Contours of a map over two parameters. No window and no global state of matplotlib is used."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray

from sbs_sim.analysis.sweep import CONDITIONS
from sbs_sim.analysis.sweep_map import GROWTH, MARGIN, SweepMap
from sbs_sim.analysis.sweep_plots import save_figures
from sbs_sim.output.plot_labels import PLAIN
from sbs_sim.output.units import label

Array = NDArray[np.float64]

LEVELS, COLUMNS = 12, 3
PANEL = (4.3, 3.4)  # in
INK, MARK = "0.25", "#D55E00"
BORDERS = {MARGIN: 0.0, GROWTH: 0.0}  # level that is drawn thick: end of a control, stability


def save_map(found: SweepMap, folder: str | Path) -> list[Path]:
    """Write the map as PNG and SVG; see `save_plots`."""
    return save_figures({"map": map_figure(found)}, folder)


def map_figure(found: SweepMap) -> Figure:
    """Contours of every quantity; hatched where the model does not hold, crosses where there is no trim."""
    shown = {name: part for name, part in found.quantities.items() if np.isfinite(part[0]).sum() > 3}
    rows = -(-(len(shown) or 1) // COLUMNS)
    figure = Figure(figsize=(PANEL[0] * COLUMNS, PANEL[1] * rows + 0.5), layout="constrained")
    FigureCanvasAgg(figure)
    panels = figure.subplots(rows, COLUMNS, squeeze=False).ravel()
    for axes, (name, (values, unit)) in zip(panels, shown.items(), strict=False):
        _contours(axes, found, name, values, unit)
    for axes in panels[len(shown) :]:
        axes.set_axis_off()
    handles = [
        Patch(facecolor="none", edgecolor=INK, hatch="////", label="outside the model's validity, or beyond a limit"),
        Line2D([], [], color=MARK, marker="x", linestyle="none", label="no trim"),
        Line2D([], [], color=MARK, label="end of a control; stability"),
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles), frameon=False)
    return figure


def _contours(axes: Axes, found: SweepMap, name: str, values: Array, unit: str) -> None:
    (x, _), (y, _) = found.axes
    masked = np.ma.masked_invalid(values)
    if np.ptp(masked.compressed()) > 0.0:
        drawn = axes.contourf(x, y, masked, LEVELS, cmap="cividis")
        axes.figure.colorbar(drawn, ax=axes)
    if name in BORDERS and masked.min() < BORDERS[name] < masked.max():
        axes.contour(x, y, masked, [BORDERS[name]], colors=MARK, linewidths=1.6)
    if found.doubtful.any():
        axes.contourf(x, y, found.doubtful.astype(float), [0.5, 1.5], colors="none", hatches=["////"])
    places = np.argwhere(found.missing)
    axes.plot(x[places[:, 1]], y[places[:, 0]], "x", color=MARK, clip_on=False)
    axes.set_title(label(name.replace("_", " "), unit), fontsize=10)
    axes.set_xlabel(_axis_label(found, 0), **PLAIN)
    axes.set_ylabel(_axis_label(found, 1), **PLAIN)
    axes.set_xlim(min(x), max(x))
    axes.set_ylim(min(y), max(y))


def _axis_label(found: SweepMap, which: int) -> str:
    name, unit = (found.parameter, found.other)[which], found.axes[which][1]
    return label(name.replace("_", " ") if name in CONDITIONS else name, unit)
