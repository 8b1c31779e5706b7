"""Poles of a linear model: a map with the modes named, and a table."""

import io
import math
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

STABLE, UNSTABLE = "#0072B2", "#D55E00"
NAME_SHIFT = 9  # points
NEAR = 8.0  # rad/s: the poles of the body lie within, those of the rotors without
SETTINGS = {"svg.fonttype": "none", "svg.hashsalt": "sbs_sim", "font.size": 8.0, "font.family": "sans-serif"}


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
    """All poles, and those near the origin, upper half of the complex plane."""
    with rc_context(SETTINGS):  # type: ignore[arg-type]
        figure = Figure(figsize=(3.5, 4.4), layout="constrained")
        FigureCanvasAgg(figure)
        near, wide = figure.subplots(2, 1)
        _draw(near, [(i, pole) for i, pole in enumerate(poles, 1) if abs(pole.value) <= NEAR], True)
        _draw(wide, list(enumerate(poles, 1)), False)
        near.set_title(f"within {NEAR:g} rad/s", fontsize=8, loc="left")
        wide.set_title("all", fontsize=8, loc="left")
        wide.set_xlabel("real part [1/s]")
    return figure


def _draw(axes: Axes, poles: Sequence[tuple[int, Pole]], with_names: bool) -> None:
    """Crosses with their numbers, and with their names where there is room for them."""
    axes.axvline(0.0, color="#9aa3ab", linewidth=0.8)
    axes.grid(color="#e3e6e9", linewidth=0.6)
    axes.set_axisbelow(True)
    axes.set_ylabel("imaginary part [rad/s]")
    places: dict[tuple[float, float], list[tuple[int, Pole]]] = {}
    scale = max((abs(pole.value) for _, pole in poles), default=1.0) or 1.0
    for number, pole in poles:
        colour = UNSTABLE if pole.value.real > 0 else STABLE
        axes.plot(pole.value.real, pole.value.imag, "x", color=colour, markersize=5, markeredgewidth=1.3)
        place = (round(pole.value.real / scale, 1), round(pole.value.imag / scale, 1))
        places.setdefault(place, []).append((number, pole))
    axes.margins(0.14, 0.18)
    middle = sum(axes.get_xlim()) / 2
    for i, together in enumerate(places.values()):
        value = np.mean([pole.value for _, pole in together])
        text = _numbers([number for number, _ in together])
        if with_names:
            text = "\n".join(f"{number} {pole.name}" for number, pole in reversed(together))
        left = bool(value.real > middle)
        axes.annotate(
            text,
            (value.real, value.imag),
            xytext=(-5 if left else 5, 3 + NAME_SHIFT * (i % 2 if with_names else 0)),  # neighbours at two heights
            ha="right" if left else "left",
            textcoords="offset points",
            fontsize=7,
        )


def _numbers(numbers: Sequence[int]) -> str:
    """Numbers, those that follow each other as a range."""
    runs: list[list[int]] = []
    for number in numbers:
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
