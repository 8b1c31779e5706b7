"""Counterparts of the paper's Figures 4, 5 and 7 to 22. No window and no global state of matplotlib is used.

Every figure has the complete model and the paper's reading; printed poles, where there are some, are hollow markers.
Colours are those of Okabe and Ito, which the colour-blind can distinguish; lines, markers and hatches differ as well,
so that the figures can be read in grey. Sizes are those of print: a page is 7 inches wide.
"""

import io
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, Literal

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from sbs_sim.analysis.modes import Mode
from sbs_sim.analysis.reproduce import MODES, Comparison, Report
from sbs_sim.analysis.reproduce_format import value_text
from sbs_sim.model.state import part_of

Array = NDArray[np.float64]

STYLE: dict[Any, Any] = {
    "svg.hashsalt": "sbs_sim",  # the same report gives the same file
    "svg.fonttype": "path",
    "font.family": "DejaVu Sans",
    "font.size": 8.5,
    "axes.titlesize": 9.0,
    "axes.labelsize": 8.5,
    "legend.fontsize": 8.0,
    "xtick.labelsize": 8.0,
    "ytick.labelsize": 8.0,
    "mathtext.fontset": "dejavusans",
    "hatch.linewidth": 0.6,
    "axes.unicode_minus": True,
}
FORMATS = {"png": {"Software": None}, "svg": {"Date": None, "Creator": None}}  # and metadata that are left out
DOTS_PER_INCH = 160
WIDE, HALF = 7.0, 3.45  # inches
MIN_ANGLE = 2.0  # deg that an axis covers
BLUE, ORANGE, GREEN, INK, GRID = "#0072B2", "#E69F00", "#009E73", "#1a1a1a", "#dddddd"

LABELS = {
    "complete": "complete model",
    "paper_reading": "paper's reading",
    "paper_reading_uniform_inflow": "paper's reading, uniform inflow",
    "paper": "printed",
}
# Colour, dashes, marker and its size in the trim curves: what lies on top is smaller, so that nothing is hidden.
CURVES: dict[str, tuple[str, Literal["-", "--", "-."], str, float]] = {
    "complete": (BLUE, "-", "o", 5.5),
    "paper_reading": (ORANGE, "--", "s", 4.0),
    "paper_reading_uniform_inflow": (GREEN, "-.", "^", 2.8),
}
POLES = {"paper": ("none", 11.0), "complete": (BLUE, 8.0), "paper_reading": (ORANGE, 4.8)}  # fill, size of markers
HATCHES = {"complete": "", "paper_reading": "////"}
MARKERS = {
    "short_period": ("o", "short period"),
    "phugoid": ("s", "phugoid"),
    "heave": ("^", "heave"),
    "roll": ("D", "roll"),
    "dutch_roll": ("v", "Dutch roll"),
    "spiral": ("P", "spiral"),
}
STATES = {"theta": "θ", "phi": "φ"}
SYMBOLS = {"a0": "$a_0$", "a1": "$a_1$", "b1": "$b_1$", "xi": "ξ"}
SYMBOLS |= {"lambda0": "$λ_0$", "lambdas": "$λ_s$", "lambdac": "$λ_c$"}


@dataclass(frozen=True)
class Drawing:
    """One figure.

    Attributes
    ----------
    number : int
        Of its counterpart in the paper.
    caption : str
    is_wide : bool
        Across the page, or half of it.
    draw : callable
        Makes the figure; to be called within `rc_context(STYLE)`.
    """

    number: int
    caption: str
    is_wide: bool
    draw: Callable[[], Figure]

    @property
    def name(self) -> str:
        """Of its files, without suffix."""
        return f"figure_{self.number:02d}"

    def encoded(self) -> dict[str, bytes]:
        """Contents of the files by their suffix, "png" and "svg"; always the same for the same report."""
        found = {}
        with rc_context(STYLE):
            figure = self.draw()
            for kind, metadata in FORMATS.items():
                file = io.BytesIO()
                figure.savefig(file, format=kind, dpi=DOTS_PER_INCH, metadata=metadata)
                found[kind] = file.getvalue()
        return found


def drawings(report: Report) -> list[Drawing]:
    """All figures of a report, in the paper's order."""
    found = [*_trim_drawings(report), *_pole_drawings(report), *_body_drawings(report), *_rotor_drawings(report)]
    return sorted(found, key=lambda drawing: drawing.number)


def _figure(width: float, height: float) -> Figure:
    return Figure(figsize=(width, height), layout="constrained")


def _grid(axes: Axes) -> None:
    axes.grid(True, color=GRID, linewidth=0.6)
    axes.set_axisbelow(True)


# --- trim over forward speed: Figures 4 and 5 -------------------------------------------------------------------


def _trim_drawings(report: Report) -> list[Drawing]:
    attitude = {"pitch_deg": "pitch attitude [deg]", "roll_deg": "roll attitude [deg]"}
    controls = {
        "collective_deg": "collective [deg]",
        "longitudinal_cyclic_deg": "longitudinal cyclic [deg]",
        "lateral_cyclic_deg": "lateral cyclic [deg]",
        "differential_longitudinal_cyclic_deg": "differential cyclic [deg]",
    }
    gap = _gap_text(report)
    return [
        Drawing(4, f"Trim attitude over forward speed. {gap}", True, partial(_trim_figure, report, attitude, 2.75)),
        Drawing(5, f"Trim controls over forward speed. {gap}", True, partial(_trim_figure, report, controls, 4.9)),
    ]


def _gap_text(report: Report) -> str:
    """What a reader has to know of trims that there are not, or that cannot be flown."""
    said = []
    for name, curve in report.trim_curves().items():
        failed = [float(speed) for speed in curve["errors"]]
        if failed:
            said.append(f"No trim is found of the {LABELS[name]} from {min(failed):g} to {max(failed):g} m/s (shaded).")
    return " ".join([*said, "Hollow markers: controls beyond their limits."])


def _trim_figure(report: Report, quantities: Mapping[str, str], height: float) -> Figure:
    """One panel for each quantity, two in a row."""
    figure = _figure(WIDE, height)
    panels = figure.subplots(len(quantities) // 2, 2, sharex=True, squeeze=False)
    for axes, (key, label) in zip(panels.flat, quantities.items(), strict=True):
        for name, curve in report.trim_curves().items():
            _trim_curve(axes, report.flights[name].values, curve, key, name)
        axes.set_ylabel(label)
        low, high = axes.get_ylim()
        if high - low < MIN_ANGLE:  # or rounding would fill the panel
            middle = round((low + high) / 2, 3)
            axes.set_ylim(middle - 0.55 * MIN_ANGLE, middle + 0.55 * MIN_ANGLE)
        _grid(axes)
    for axes in panels[-1]:
        axes.set_xlabel("airspeed [m/s]")
    handles = [
        Line2D([], [], color=colour, linestyle=dash, marker=marker, markersize=size, label=LABELS[name])
        for name, (colour, dash, marker, size) in CURVES.items()
    ]
    hollow = Line2D([], [], linestyle="", marker="s", markersize=4.5, mec=INK, mfc="white", label="beyond limits")
    figure.legend(handles=[*handles, hollow], loc="outside lower center", ncols=4, frameon=False)
    return figure


def _trim_curve(axes: Axes, speeds: Array, curve: Mapping[str, Sequence[float]], key: str, name: str) -> None:
    """One curve; markers at every other speed, hollow ones at all that cannot be flown, a shade where there is none."""
    colour, dash, marker, size = CURVES[name]
    values = np.array(curve[key], dtype=float)
    beyond = np.array([bool(texts) for texts in curve["beyond_limits"]])
    axes.plot(speeds, values, dash, color=colour, linewidth=0.4 * size)
    shown = ~beyond & (np.arange(len(speeds)) % 2 == 0)
    axes.plot(speeds[shown], values[shown], marker, color=colour, markersize=size)
    axes.plot(speeds[beyond], values[beyond], marker, mec=colour, mfc="white", mew=1.3, markersize=size + 0.6, zorder=3)
    for start, end in _gaps(np.isnan(values)):
        span = (speeds[max(start - 1, 0)], speeds[min(end + 1, len(speeds) - 1)])
        axes.axvspan(*span, fc=to_rgba(colour, 0.12), ec=to_rgba(colour, 0.6), hatch="///", linewidth=0.0, zorder=0)


def _gaps(missing: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First and last index of each run of missing values."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], missing.astype(int), [0]])))
    return [(int(start), int(end) - 1) for start, end in edges.reshape(-1, 2)]


# --- poles: Figures 7, 14 and 15 --------------------------------------------------------------------------------


def _pole_drawings(report: Report) -> list[Drawing]:
    texts = {
        7: ("table1", "dynamic flap and uniform inflow (Table 1)"),
        14: ("table2", "dynamic flap and lead-lag, uniform inflow (Table 2)"),
        15: ("table4", "dynamic flap and lead-lag, non-uniform inflow (Table 4), and the inflow poles"),
    }
    note = (
        "Upper half of the complex plane. Complete model: poles of the full matrix; paper's reading: of the"
        " quasi-static one."
    )
    return [
        Drawing(number, f"Body poles in hover: {text}. {note}", True, partial(_pole_figure, report, table))
        for number, (table, text) in texts.items()
    ]


def _pole_figure(report: Report, name: str) -> Figure:
    """Panels with several scales: all body poles, those near the origin, and for Table 4 the inflow's."""
    table = report.tables[name]
    with_inflow = name == "table4"
    figure = _figure(WIDE, 4.6 if with_inflow else 3.1)
    grid = figure.add_gridspec(2 if with_inflow else 1, 2)
    wide, near = figure.add_subplot(grid[0, 0]), figure.add_subplot(grid[0, 1])
    for axes in (wide, near):
        _draw_poles(axes, table)
        axes.set_xlabel("real part [rad/s]")
        axes.set_ylabel("imaginary part [rad/s]")
    slow = [pole.real for key, _, pole in _poles(table) if key in ("phugoid", "dutch_roll", "spiral")]
    near.set_xlim(1.3 * min(slow), 1.3 * max(slow))
    wide.set_title("all body poles")
    near.set_title("near the origin")
    if with_inflow:
        _draw_inflow(figure.add_subplot(grid[1, :]), report)
    figure.legend(handles=_pole_legend(), loc="outside lower center", ncols=5, frameon=False)
    return figure


def _poles(table: Comparison) -> list[tuple[str, str, complex]]:
    """Mode, source and pole of all entries."""
    found = []
    for key, entry in table.groups[""].items():
        values = {"paper": entry.printed.value, "complete": entry.complete, "paper_reading": entry.paper_reading}
        mode = key.removesuffix("_plus").removesuffix("_minus")
        found += [(mode, source, complex(value)) for source, value in values.items() if value is not None]
    return found


def _draw_poles(axes: Axes, table: Comparison) -> None:
    """Upper half of the plane; the printed poles are the largest, to be seen around ours where they agree."""
    axes.axvline(0.0, color="0.35", linewidth=0.8)
    axes.axhline(0.0, color="0.35", linewidth=0.8)
    for mode, source, pole in _poles(table):
        fill, size = POLES[source]
        axes.plot(pole.real, pole.imag, MARKERS[mode][0], markersize=size, mec=INK, mew=0.1 * size, mfc=fill)
    axes.margins(0.08, 0.14)
    axes.xaxis.set_major_locator(MaxNLocator(6, steps=[1, 2, 5, 10]))
    _grid(axes)


def _pole_legend() -> list[Line2D]:
    """Fill by source, shape by mode."""
    sources = [
        Line2D([], [], linestyle="", marker="o", markersize=size, mec=INK, mfc=fill, label=LABELS[source])
        for source, (fill, size) in POLES.items()
    ]
    modes = [
        Line2D([], [], linestyle="", marker=marker, markersize=6.0, mec=INK, mfc="0.8", label=label)
        for marker, label in MARKERS.values()
    ]
    return [*sources, *modes]


def _draw_inflow(axes: Axes, report: Report) -> None:
    """Inflow poles, one line for each way to compute them: their imaginary parts are nearly zero."""
    rows: dict[str, list[complex]] = {
        "printed": [],
        "$C^λ$ alone, both": [],
        "system, reading": [],
        "system, complete": [],
    }
    for entry in report.tables["inflow_poles"].entries():
        rows["printed"].append(complex(entry.printed.value or 0.0))
        rows["$C^λ$ alone, both"] += [complex(value) for value in (entry.complete, entry.paper_reading) if value]
        for row, name in (("system, reading", "paper_reading_coupled"), ("system, complete", "complete_coupled")):
            poles = entry.others[name]
            rows[row] += list(poles) if isinstance(poles, list) else []
    fills = ("none", GREEN, ORANGE, BLUE)
    for height, (poles, fill) in enumerate(zip(rows.values(), fills, strict=True)):
        real = [pole.real for pole in poles]
        axes.plot(real, [height] * len(real), "h", markersize=8.0, mec=INK, mew=0.8, mfc=fill)
    axes.set_yticks(range(len(rows)), list(rows))
    axes.set_ylim(len(rows) - 0.5, -0.5)
    axes.set_xlabel("real part [rad/s]")
    axes.set_title("inflow poles (real, or nearly so)")
    _grid(axes)


# --- participation: Figures 8 to 13 and 16 to 22 ----------------------------------------------------------------

BODY_FIGURES = {  # number: table, mode, states that take part in it by the paper's text
    8: ("table1", "short_period", ("q", "theta", "u")),
    9: ("table1", "phugoid", ("u", "theta")),
    10: ("table1", "heave", ("w",)),
    11: ("table1", "roll", ("p", "phi", "v")),
    12: ("table1", "dutch_roll", ("v", "phi", "r")),
    13: ("table1", "spiral", ("r", "v")),
    16: ("table4", "short_period", ("lambdac",)),
    17: ("table4", "dutch_roll", ("lambdas", "lambdac")),
    18: ("table4", "phugoid", ("lambdac",)),
    19: ("table4", "roll", ("lambdas", "lambdac")),
}
ROTOR_FIGURES = {  # number: what, modes, what the paper's text says
    20: (
        "coupled",
        ("coupled_collective", "coupled_advancing", "coupled_regressing"),
        "In print a_0 and ξ_0 in the collective mode (here their rates), in the others disc tilts, lag coordinates and"
        " the rates of both.",
    ),
    21: ("flap", ("collective_flap", "non_uniform_disc_tilt"), "In print a_0 alone at the origin, disc tilt at Ω."),
    22: ("lead-lag", ("collective_lag", "non_uniform_lag"), "In print ξ_0 alone at the origin, cyclic lag at Ω."),
}


def _body_drawings(report: Report) -> list[Drawing]:
    found = []
    for number, (table, key, states) in BODY_FIGURES.items():
        inflow = "uniform inflow" if table == "table1" else "lead-lag and non-uniform inflow"
        shares = _shares_text(report, table, key, states)
        caption = (
            f"Participation in the mode “{MARKERS[key][1]}” in hover with {inflow} (full matrices). Taking part in"
            f" print, with the shares here (complete model / paper's reading): {shares}."
        )
        found.append(Drawing(number, caption, False, partial(_body_figure, report, table, key)))
    return found


def _shares_text(report: Report, table: str, key: str, states: Sequence[str]) -> str:
    """States that the paper names, with their shares in both models."""
    shares = []
    for name in ("complete", "paper_reading"):
        model = report.models[name][table]
        mode = _find(model.modes, key)
        shares.append({} if mode is None else _by_quantity(mode, model.state_names))
    labels = {state: STATES.get(state, SYMBOLS.get(state, state)) for state in states}
    said = [f"{label} ({' / '.join(f'{own.get(label, 0.0):.2f}' for own in shares)})" for label in labels.values()]
    return ", ".join(said).replace("$", "")


def _body_figure(report: Report, table: str, key: str) -> Figure:
    """Bars of both models for one mode."""
    figure = _figure(HALF, 2.5)
    axes = figure.subplots()
    bars, labels = {}, {}
    for name in ("complete", "paper_reading"):
        model = report.models[name][table]
        mode = _find(model.modes, key)
        if mode is not None:
            bars[name] = _by_quantity(mode, model.state_names)
            labels[name] = f"{LABELS[name]}, {value_text(mode.pole)} rad/s".replace("-", "−")
    _draw_bars(axes, bars, labels)
    axes.set_title(MARKERS[key][1] if bars else f"{MARKERS[key][1]}: none")
    if bars:
        figure.legend(loc="outside lower center", ncols=1, frameon=False)
    return figure


def _find(modes: Sequence[Mode], key: str) -> Mode | None:
    """Mode with one of the names of a key, of several rotors that of the first."""
    by_name = {mode.name: mode for mode in modes}
    return next((by_name[own] for name in MODES[key] for own in (name, f"{name}, rotor 1") if own in by_name), None)


def _by_quantity(mode: Mode, state_names: Sequence[str]) -> dict[str, float]:
    """Participation by body state, and by coordinate of flap, lag and inflow: all rotors, angles with their rates."""
    found: dict[str, float] = {}
    for name, share in zip(state_names, mode.participation, strict=True):
        part = part_of(name)
        if part.family == "body":
            label = STATES.get(name, name)
        else:
            coordinate = name.partition("(")[0]
            coordinate = coordinate.removeprefix("d") if part.is_rate else coordinate
            label = SYMBOLS.get("xi" if part.family == "lag" else coordinate, coordinate)
        found[label] = found.get(label, 0.0) + float(share)
    return found


def _draw_bars(axes: Axes, bars: Mapping[str, Mapping[str, float]], labels: Mapping[str, str]) -> None:
    """Bars of several models beside each other."""
    states = list(dict.fromkeys(state for own in bars.values() for state in own))
    width = 0.8 / max(len(bars), 1)
    for i, (name, own) in enumerate(bars.items()):
        positions = np.arange(len(states)) + (i - (len(bars) - 1) / 2) * width
        heights = [own.get(state, 0.0) for state in states]
        axes.bar(
            *(positions, heights, width),
            color=POLES[name][0],
            hatch=HATCHES[name],
            edgecolor=INK,
            linewidth=0.5,
            label=labels.get(name),
        )
    axes.set_xticks(range(len(states)), states)
    axes.set_xlim(-0.6, len(states) - 0.4)
    axes.set_ylabel("participation [1]")
    axes.yaxis.set_major_locator(MaxNLocator(5, steps=[1, 2, 5, 10]))
    axes.tick_params(axis="x", length=0)
    axes.grid(True, axis="y", color=GRID, linewidth=0.6)
    axes.set_axisbelow(True)


def _rotor_drawings(report: Report) -> list[Drawing]:
    return [
        Drawing(
            number,
            f"Participation in the {what} modes of one rotor, first matrix of eq. [32] (Table 5); magnitudes of the"
            f" poles: complete model / paper's reading. {said}",
            True,
            partial(_rotor_figure, report, keys),
        )
        for number, (what, keys, said) in ROTOR_FIGURES.items()
    ]


def _rotor_figure(report: Report, keys: Sequence[str]) -> Figure:
    """One panel for each mode."""
    figure = _figure(WIDE, 2.45)
    panels = figure.subplots(1, len(keys), sharey=True, squeeze=False)[0]
    for axes, key in zip(panels, keys, strict=True):
        bars, poles = {}, []
        for name in ("complete", "paper_reading"):
            modes, names = report.rotor_modes[name]
            mode = _find(modes, key)
            if mode is not None:
                first = [i for i, own in enumerate(names) if part_of(own).rotor == 0]
                bars[name] = {_rotor_label(names[i]): float(mode.participation[i]) for i in first}
                poles.append(f"{abs(mode.pole):.4g}")
        _draw_bars(axes, bars, {name: LABELS[name] for name in bars} if axes is panels[0] else {})
        axes.set_title(f"{MODES[key][0]}\n|p| = {' / '.join(poles)} rad/s" if bars else f"{MODES[key][0]}: none")
        if axes is not panels[0]:
            axes.set_ylabel("")
    if panels[0].patches:
        figure.legend(loc="outside lower center", ncols=2, frameon=False)
    return figure


def _rotor_label(name: str) -> str:
    """Symbol of a flap or lag coordinate, with a dot for its rate."""
    coordinate, rate = name.partition("(")[0], part_of(name).is_rate
    coordinate = coordinate.removeprefix("d") if rate else coordinate
    letter, index = ("ξ", coordinate[2:]) if coordinate.startswith("xi") else (coordinate[0], coordinate[1:])
    return f"$\\dot{{{letter}}}_{{{index}}}$" if rate else f"${letter}_{{{index}}}$"
