"""Poles of a linear model: a map with the modes named, and a table."""

import io
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray

from sbs_sim.output.plot_labels import name_poles

STABLE, UNSTABLE = "#0072B2", "#D55E00"
TEXT_SIZE = 7.0  # points
MAX_NAME_LENGTH = 32  # letters of a name in the map
BODY_POLE_RADIUS = 8.0  # rad/s: the poles of the body lie within, those of the rotors without
# names of modes come from whoever publishes them: a $ begins no formula
SETTINGS = {
    "text.parse_math": False,
    "svg.fonttype": "none",
    "svg.hashsalt": "sbs_sim",
    "font.size": 8.0,
    "font.family": "sans-serif",
}


@dataclass(frozen=True)
class Pole:
    """A real pole, or a conjugate pair, with the name of its mode.

    Attributes
    ----------
    value : complex
        [rad/s], of a pair the one with the positive imaginary part.
    """

    name: str
    value: complex

    @property
    def damping(self) -> float:
        """Damping ratio; 0 at the origin."""
        return -self.value.real / abs(self.value) if self.value else 0.0

    @property
    def time(self) -> float:
        """Time to half (positive) or to double the amplitude (negative) [s]; infinite if neither happens."""
        return -math.log(2.0) / self.value.real if self.value.real else math.inf


def pole_page(poles: Sequence[Pole], title: str) -> str:
    """Map and table as HTML.

    Parameters
    ----------
    poles : sequence of Pole
        Slowest first; they are numbered in this order.
    title : str
        What was linearized.
    """
    figure = pole_figure(poles)
    with rc_context(SETTINGS), io.StringIO() as stream:  # type: ignore[arg-type]
        figure.savefig(stream, format="svg", metadata={"Date": None})
        text = stream.getvalue()
    svg = text[text.index("<svg") :].replace("<svg ", '<svg style="width:100%;height:auto" ', 1)
    return f'<div style="font:11px sans-serif;padding:4px 8px"><b>{escape(title)}</b>{svg}{_table(poles)}</div>'


def pole_figure(poles: Sequence[Pole]) -> Figure:
    """All poles by number, and those near the origin by name, upper half of the complex plane."""
    numbered = {f"{i} {pole.name}": pole.value for i, pole in enumerate(poles, 1)}
    names = {name: value for name, value in numbered.items() if abs(value) <= BODY_POLE_RADIUS}
    numbers = {name.split()[0]: value for name, value in numbered.items()}
    with rc_context(SETTINGS):  # type: ignore[arg-type]
        figure = Figure(figsize=(3.5, 4.4), layout="constrained")
        canvas = FigureCanvasAgg(figure)
        near, wide = figure.subplots(2, 1)
        _draw(near, list(names.values()), f"within {BODY_POLE_RADIUS:g} rad/s")
        _draw(wide, list(numbers.values()), "all")
        wide.set_xlabel("real part [1/s]")
        canvas.draw()  # settles the layout, which the places of the names depend on
        name_poles(near, {_short(name): value for name, value in names.items()}, _array(names), TEXT_SIZE)
        name_poles(wide, numbers, _array(numbers), TEXT_SIZE, _ranges)
    return figure


def _array(poles: Mapping[str, complex]) -> NDArray[np.complex128]:
    return np.array(list(poles.values()), dtype=complex)


def _short(name: str) -> str:
    """A name that fits; the table has all of it."""
    return name if len(name) <= MAX_NAME_LENGTH else f"{name[:MAX_NAME_LENGTH]}…"


def _draw(axes: Axes, poles: Sequence[complex], title: str) -> None:
    """Crosses."""
    axes.axvline(0.0, color="#9aa3ab", linewidth=0.8)
    axes.grid(color="#e3e6e9", linewidth=0.6)
    axes.set_axisbelow(True)
    axes.set_ylabel("imaginary part [rad/s]")
    axes.set_title(title, fontsize=8, loc="left")
    for value in poles:
        colour = UNSTABLE if value.real > 0 else STABLE
        axes.plot(value.real, value.imag, "x", color=colour, markersize=5, markeredgewidth=1.3)
    axes.margins(0.2, 0.22)


def _ranges(names: Sequence[str]) -> str:
    """Numbers, those that follow each other as a range."""
    runs: list[list[int]] = []
    for number in sorted(int(name) for name in names):
        if runs and number == runs[-1][-1] + 1:
            runs[-1].append(number)
        else:
            runs.append([number])
    return ", ".join(str(run[0]) if len(run) == 1 else f"{run[0]}–{run[-1]}" for run in runs)


def _table(poles: Sequence[Pole]) -> str:
    head = "".join(
        f'<th style="text-align:{side};font-weight:normal;color:#5c6670;padding:1px 3px">{text}</th>'
        for side, text in (
            ("right", ""),
            ("left", "mode"),
            ("right", "ω<sub>n</sub> [rad/s]"),
            ("right", "ζ [1]"),
            ("right", "T<sub>½</sub>, <i>T<sub>2</sub></i> [s]"),
        )
    )
    return (
        '<table style="border-collapse:collapse;width:100%;font-variant-numeric:tabular-nums">'
        f"<tr>{head}</tr>{''.join(_row(number, pole) for number, pole in enumerate(poles, 1))}</table>"
    )


def _row(number: int, pole: Pole) -> str:
    time = f"{pole.time:.3g}" if pole.time >= 0 else f"<i>{-pole.time:.3g}</i>"
    colour = UNSTABLE if pole.value.real > 0 else "inherit"
    cells = [f"{abs(pole.value):.3g}", f"{pole.damping:.2f}", time if math.isfinite(pole.time) else "–"]
    numbers = "".join(f'<td style="text-align:right;padding:1px 3px">{cell}</td>' for cell in cells)
    return (
        f'<tr style="border-top:1px solid #e3e6e9;color:{colour}"><td style="text-align:right">{number}</td>'
        f'<td style="padding:1px 3px">{escape(pole.name)}</td>{numbers}</tr>'
    )
