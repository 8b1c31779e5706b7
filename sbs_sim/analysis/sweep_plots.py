"""Plots of a sweep: trim curves and root loci. No window and no global state of matplotlib is used.

Colours are those of Okabe and Ito, and cividis, which people see alike who do not see all colours; lines also differ in
their dashes.
"""

import io
from collections.abc import Mapping, Sequence
from itertools import cycle
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from numpy.typing import NDArray

from sbs_sim.analysis.modes import Mode
from sbs_sim.analysis.sweep import CONDITIONS, Sweep
from sbs_sim.errors import ExportError
from sbs_sim.model.state import part_of
from sbs_sim.output.files import write
from sbs_sim.output.plot_labels import PLAIN, name_poles
from sbs_sim.output.plot_style import COLOURS, DASHES
from sbs_sim.output.units import RPM, label, shown

Array = NDArray[np.float64]

FORMATS = ("png", "svg")
DOTS_PER_INCH = 150
MIN_ANGLE, MIN_SHARE = 1.0, 0.05  # that an axis covers: deg, share of the largest value


def save_plots(sweep: Sweep, folder: str | Path) -> list[Path]:
    """Write the trim curves and, where there are linear models, the root loci as PNG and SVG.

    Parameters
    ----------
    sweep : Sweep
    folder : str or Path
        Made if there is none.

    Returns
    -------
    list of Path

    Raises
    ------
    ExportError
        Folder or files cannot be written.
    """
    figures = {}
    if any(point.trim for point in sweep.points):
        figures["trim"] = trim_figure(sweep)
    if sweep.modes:
        figures["root_locus"] = root_locus_figure(sweep)
    return save_figures(figures, folder)


def save_figures(figures: Mapping[str, Figure], folder: str | Path) -> list[Path]:
    """Write figures by name as PNG and SVG; see `save_plots`."""
    try:
        Path(folder).mkdir(parents=True, exist_ok=True)
    except (OSError, ValueError) as error:
        raise ExportError(f"{folder}: no folder can be made there: {getattr(error, 'strerror', error)}") from None
    written = []
    for name, figure in figures.items():
        for kind in FORMATS:
            written.append(Path(folder) / f"{name}.{kind}")
            write(written[-1], _drawn(figure, kind))
    return written


def _drawn(figure: Figure, kind: str) -> bytes:
    file = io.BytesIO()
    # the same sweep gives the same file
    metadata = {"Date": None} if kind == "svg" else None
    figure.savefig(file, format=kind, dpi=DOTS_PER_INCH, metadata=metadata)
    return file.getvalue()


def _parameter_label(sweep: Sweep) -> str:
    unit = sweep.shown[1]
    name = sweep.parameter.replace("_", " ") if sweep.parameter in CONDITIONS else sweep.parameter
    return f"{name} [{unit}]"


# --- trim curves ------------------------------------------------------------------------------------------------


def trim_figure(sweep: Sweep) -> Figure:
    """Attitude, controls, thrust, power and free rotor speeds over the parameter; a cross marks where no trim is."""
    rows = 3 if sweep.has_free_speeds else 2
    figure = Figure(figsize=(10.0, 3.75 * rows), layout="constrained")
    FigureCanvasAgg(figure)
    (attitude, controls), (thrust, power), *more = figure.subplots(rows, 2)
    _curves(attitude, sweep, {name: np.degrees(sweep[name]) for name in ("pitch", "roll")}, "attitude [deg]", MIN_ANGLE)
    units = set(sweep.controls.values())
    common = len(units) == 1  # else each curve has its own
    names = {name: name.replace("_", " ") for name in sweep.controls}
    curves = {
        names[name] if common else label(names[name], unit): shown(sweep[name], unit)[0]
        for name, unit in sweep.controls.items()
    }
    heading = label("pilot controls", units.pop()) if common else "pilot controls"
    _curves(controls, sweep, curves, heading, MIN_ANGLE)
    _curves(thrust, sweep, _by_rotor(sweep["thrust"]), "thrust [N]", MIN_SHARE * _largest(sweep["thrust"]))
    powers = _by_rotor(sweep["power"])
    if len(powers) > 1:
        powers["all rotors"] = sweep["power"].sum(axis=1)
    _curves(power, sweep, powers, "shaft power [W]", MIN_SHARE * _largest(sweep["power"]))
    for speed, unused in more:
        unused.set_axis_off()
        speeds = sweep["rotor_speed"] * RPM
        _curves(speed, sweep, _by_rotor(speeds), "rotor speed [rpm]", MIN_SHARE * _largest(speeds))
    return figure


def _largest(values: Array) -> float:
    return float(np.nanmax(np.abs(values)))


def _by_rotor(values: Array) -> dict[str, Array]:
    return {f"rotor {j + 1}": column for j, column in enumerate(values.T)}


def _curves(axes: Axes, sweep: Sweep, curves: dict[str, Array], label: str, least: float) -> None:
    """Draw curves by name over the parameter on an axis that covers at least so much."""
    order = np.argsort(sweep.values, kind="stable")
    shown = sweep.shown[0][order]
    marker = "o" if len(shown) <= 50 else None
    for (name, values), colour, dash in zip(curves.items(), cycle(COLOURS), cycle(DASHES), strict=False):
        axes.plot(shown, values[order], dash, color=colour, marker=marker, markersize=3, linewidth=1.6, label=name)
    missing = [value for value, point in zip(sweep.shown[0], sweep.points, strict=True) if point.trim is None]
    if missing:
        # at the lower edge, whatever the scale
        axes.plot(
            missing, [0.02] * len(missing), "x", color="0.4", transform=axes.get_xaxis_transform(), label="no trim"
        )
    axes.set_xlabel(_parameter_label(sweep), **PLAIN)
    axes.set_ylabel(label)
    low, high = axes.get_ylim()
    if high - low < least:  # or rounding would fill the panel
        axes.set_ylim((low + high - least) / 2, (low + high + least) / 2)
    axes.grid(True, color="0.85", linewidth=0.6)
    axes.legend(fontsize=8, framealpha=0.85)


# --- root loci --------------------------------------------------------------------------------------------------


def root_locus_figure(sweep: Sweep) -> Figure:
    """Poles of the body's modes, and of the rotors' and inflow's, over the upper half plane, with their names."""
    figure = Figure(figsize=(14.0, 7.5), layout="constrained")
    canvas = FigureCanvasAgg(figure)
    panels = figure.subplots(1, 2)
    shares = {name: _body_share(sweep, track) for name, track in sweep.modes.items()}
    chosen = ([name for name in shares if shares[name] > 0.5], [name for name in shares if shares[name] <= 0.5])
    scale = ScalarMappable(Normalize(sweep.shown[0].min(), sweep.shown[0].max()), "cividis")
    for axes, names, title in zip(panels, chosen, ("body", "rotors and inflow"), strict=True):
        for name in names:
            _locus(axes, sweep, sweep.loci[name], scale)
        axes.axvline(0.0, color="0.3", linewidth=0.8)
        axes.set_title(title, fontsize=10)
        axes.set_xlabel("real part [rad/s]")
        axes.set_ylabel("imaginary part [rad/s]")
        axes.grid(True, color="0.85", linewidth=0.6)
        axes.margins(0.12, 0.12)
    figure.colorbar(scale, ax=panels, shrink=0.9, pad=0.01).set_label(_parameter_label(sweep), **PLAIN)
    canvas.draw()  # settles the layout, which the places of the names depend on
    for axes, names in zip(panels, chosen, strict=True):
        _name_loci(axes, {name: sweep.loci[name] for name in names})
    return figure


def _body_share(sweep: Sweep, track: Sequence[Mode | None]) -> float:
    """Median of the participation of the body's states in a mode."""
    shares = []
    for point, mode in zip(sweep.points, track, strict=True):
        if mode is not None and point.model is not None:
            body = [part_of(name).family == "body" for name in point.model.state_names]
            shares.append(float(mode.participation[body].sum()))
    return float(np.median(shares))


def _locus(axes: Axes, sweep: Sweep, poles: NDArray[np.complex128], scale: ScalarMappable) -> None:
    """Draw one locus: a line from value to value, and dots in the colours of the values."""
    shown = sweep.shown[0]
    order = np.argsort(shown, kind="stable")
    axes.plot(poles.real[order], poles.imag[order], color="0.6", linewidth=0.8, zorder=1)
    colours = scale.to_rgba(shown)
    axes.scatter(poles.real, poles.imag, c=colours, s=14, linewidths=0.3, edgecolors="0.2", zorder=2)


def _name_loci(axes: Axes, loci: dict[str, NDArray[np.complex128]]) -> None:
    """Write every name beside the last pole of its locus."""
    every = np.concatenate([*loci.values(), np.empty(0, complex)])
    name_poles(axes, {name: poles[~np.isnan(poles)][-1] for name, poles in loci.items()}, every[~np.isnan(every)])
