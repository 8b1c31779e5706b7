"""Tables, plots and page of identified frequency responses. No window and no global state of matplotlib is used."""

from __future__ import annotations  # `help` then shows types by their names

import csv
import io
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from sbs_sim.analysis.bode_plots import grids, legend, nichols_figure, response_name
from sbs_sim.analysis.frequency_response import FrequencyResponse
from sbs_sim.analysis.html import document, plain_table, text_of
from sbs_sim.analysis.identification import DECIBEL, LEAST_COHERENCE, IdentifiedResponse
from sbs_sim.analysis.page import PAGE, inline_drawing, make_folder, save_drawings
from sbs_sim.analysis.plots import INK, Drawing
from sbs_sim.analysis.transfer_fit import TransferFit
from sbs_sim.content import ByContent
from sbs_sim.output.files import write
from sbs_sim.output.json_text import to_json
from sbs_sim.output.plot_style import COLOURS, DASHES

Array = NDArray[np.float64]

WIDE = 10.0  # inches
CSV, JSON = "responses.csv", "responses.json"
HEADINGS = ("frequency [rad/s]", "gain [dB]", "phase [deg]", "coherence", "error [dB]", "error [deg]")
BESIDE = ("gain beyond [dB]", "phase beyond [deg]")


@dataclass(frozen=True, eq=False)
class Identified(ByContent):
    """An identified response with what is shown beside it.

    Attributes
    ----------
    found : IdentifiedResponse
    model : FrequencyResponse, optional
        Of a linear model at the same frequencies.
    fits : tuple of TransferFit
    """

    found: IdentifiedResponse
    model: FrequencyResponse | None = None
    fits: tuple[TransferFit, ...] = ()

    @property
    def name(self) -> str:
        """Output by input with their units."""
        return response_name(self.found.response)

    def to_dict(self) -> dict[str, Any]:
        """All numbers as plain lists."""
        fits = {"fits": [fit.to_dict() for fit in self.fits]}
        model = {} if self.model is None else {"model": self.model.to_dict()}
        return {**self.found.to_dict(), **fits, **model}


def headings(one: Identified) -> list[str]:
    """Of the table of a response."""
    return [*HEADINGS, *(BESIDE if one.model is not None else ())]


def rows(one: Identified) -> list[list[str]]:
    """A row for each frequency; those that are not valid are in parentheses."""
    found, table = one.found, []
    beside = found.departure(one.model) if one.model is not None else ()
    columns: list[Array] = [found.response.gain_db, found.response.phase_deg, found.coherence]
    columns += [found.gain_error_db, found.phase_error_deg, *beside]
    digits = (2, 1, 3, 2, 1, 2, 1)
    for i, frequency in enumerate(found.frequencies.tolist()):
        cells = [_fixed(float(values[i]), count) for values, count in zip(columns, digits, strict=False)]
        first = f"{frequency:.4g}"
        table.append([first if found.valid[i] else f"({first})", *cells])
    return table


def _fixed(value: float, digits: int) -> str:
    if not np.isfinite(value):
        return "-"
    return f"{round(value, digits) + 0.0:.{digits}f}" if abs(value) < 1e4 else f"{value:.1e}"


def summary(one: Identified) -> str:
    """Method, windows and range of validity in a line."""
    found = one.found
    how = "by the excitations (joint input-output)" if found.method == "joint" else "by the inputs"
    others = f", with {', '.join(found.conditioned_on)} held" if found.conditioned_on else ""
    windows = ", ".join(f"{length:.3g}" for length in found.windows)
    windows = f"windows {windows} s" if len(found.windows) > 1 else f"segments of {windows} s"
    ends = found.valid_range
    valid = "nowhere valid" if ends is None else f"valid from {ends[0]:.3g} to {ends[1]:.3g} rad/s"
    return f"{how}{others}; {windows}; {valid} (coherence from {LEAST_COHERENCE:g})"


def fit_text(fit: TransferFit) -> str:
    """A fit in a line."""
    poles = ", ".join(_root(pole) for pole in fit.poles if pole.imag >= 0.0) or "none"
    zeros = ", ".join(_root(zero) for zero in fit.zeros if zero.imag >= 0.0) or "none"
    lead = f"{fit.numerator[0]:.4g}"
    ends = f"{fit.range[0]:.3g} to {fit.range[1]:.3g} rad/s"
    return (
        f"cost {fit.cost:.3g} over {ends}: leading gain {lead}, zeros {zeros}, poles {poles}, delay {fit.delay:.4g} s"
    )


def _root(root: complex) -> str:
    return f"{root.real:.4g}" + (f" ± {abs(root.imag):.4g}i" if root.imag else "")


def to_csv(every: Sequence[Identified]) -> str:
    """Table with a row for each frequency of each response: SI units, phases in rad."""
    file = io.StringIO()
    writer = csv.writer(file, lineterminator="\n")
    names = ("gain [SI]", "phase [rad]", "coherence", "ordinary coherence", "multiple coherence", "random error")
    writer.writerow(["input", "output", "frequency [rad/s]", *names, "averages"])
    for one in every:
        found, own = one.found, one.found.response
        columns = [own.frequencies, own.gain, own.phase, found.coherence, found.ordinary_coherence]
        columns += [found.multiple_coherence, found.random_error, found.averages]
        for values in zip(*columns, strict=True):
            writer.writerow([own.input_name, own.output_name, *(repr(float(value)) for value in values)])
    return file.getvalue()


def save_identified(
    every: Sequence[Identified],
    folder: str | Path,
    title: str,
    statement: str,
    *,
    progress: Callable[[int, int], None] | None = None,
) -> list[Path]:
    """Write Bode plots with coherence, Nichols plots, CSV, JSON and the page, which is the last of the paths.

    Parameters
    ----------
    every : sequence of Identified
    folder : str or Path
        Made if there is none.
    title, statement : str
        Of the page; plain text.
    progress : callable, optional
        Called with the number of figures done and that of all, as each ends.

    Raises
    ------
    ExportError
        Folder or files cannot be written.
    """
    folder = make_folder(folder)
    written, drawn = save_drawings(drawings(every), folder, progress)
    shown = [_shown(drawing, inline_drawing(drawing, svg)) for drawing, svg in drawn]
    texts = {CSV: to_csv(every), JSON: to_json({"responses": [one.to_dict() for one in every]})}
    texts[PAGE] = _page(every, shown, title, statement)
    for name, text in texts.items():
        written.append(folder / name)
        write(written[-1], text)
    return written


def _shown(drawing: Drawing, svg: str) -> str:
    caption = f"<b>Figure {drawing.number}.</b> {escape(drawing.caption)}"
    return f'<figure id="{drawing.name}" class="wide">\n{svg}\n<figcaption>{caption}</figcaption>\n</figure>'


def _page(every: Sequence[Identified], figures: Sequence[str], title: str, statement: str) -> str:
    sections = []
    for i, one in enumerate(every):
        fits = "".join(f"<p>{escape(fit_text(fit))}</p>" for fit in one.fits)
        table = plain_table(summary(one), headings(one), rows(one), text_of)
        sections.append((f"response{i}", one.name, fits + table))
    drawn = "\n".join(figures)
    sections.append(("figures", "Figures", f'<div class="figures">\n{drawn}\n</div>'))
    return document(title, f"<p>{escape(statement)}</p>", sections)


def drawings(every: Sequence[Identified]) -> list[Drawing]:
    """A Bode plot with coherence for each response, and the Nichols plot of all."""
    texts = [f"{one.name}: gain, phase with twice their random errors, coherence" for one in every]
    found = [
        Drawing(number, text, True, partial(bode_figure, one))
        for number, (text, one) in enumerate(zip(texts, every, strict=True), 1)
    ]
    return [
        *found,
        Drawing(len(found) + 1, "Nichols plot of the valid frequencies", True, partial(nichols_of_valid, every)),
    ]


def bode_figure(one: Identified) -> Figure:
    """Gain, phase and coherence over frequency; what is not valid is pale."""
    figure = Figure(figsize=(WIDE, 7.0), layout="constrained")
    gain, phase, coherence = figure.subplots(3, 1, sharex=True, height_ratios=(3, 3, 2))
    found, valid = one.found, one.found.valid
    at, colour = found.frequencies, COLOURS[0]
    for axes, values, error in (
        (gain, found.response.gain_db, found.gain_error_db),
        (phase, found.response.phase_deg, found.phase_error_deg),
    ):
        bars = 2.0 * error[valid]
        options = {"color": colour, "linestyle": "none", "marker": "o", "markersize": 3.5, "capsize": 2.0}
        axes.errorbar(at[valid], values[valid], yerr=bars, label="identified", **options)
        _beside(axes, one, axes is phase)
        axes.set_xscale("log")
    gain.set_ylabel("gain [dB]")
    phase.set_ylabel("phase [deg]")
    coherence.semilogx(at, found.coherence, color=colour, label="partial" if found.conditioned_on else "coherence")
    if found.conditioned_on:
        coherence.semilogx(at, found.ordinary_coherence, color=COLOURS[1], linestyle=DASHES[1], label="ordinary")
        coherence.semilogx(at, found.multiple_coherence, color=COLOURS[2], linestyle=DASHES[2], label="multiple")
    coherence.axhline(LEAST_COHERENCE, color=INK, linewidth=0.8)
    coherence.set_ylim(0.0, 1.02)
    coherence.set_ylabel("coherence")
    coherence.set_xlabel("frequency [rad/s]")
    gain.set_title(one.name, parse_math=False)
    legend(gain)
    legend(coherence)
    grids(gain, phase, coherence)
    return figure


def _beside(axes: Axes, one: Identified, is_phase: bool) -> None:
    """Lines of the linear model and of fits, on the turn of the identified phase."""
    valid = one.found.valid
    curves: list[tuple[str, Array, NDArray[np.complex128]]] = []
    if one.model is not None:
        curves.append(("linear model", one.model.frequencies, one.model.response))
    curves += [(f"fit, cost {fit.cost:.3g}", one.found.frequencies, fit.at(one.found.frequencies)) for fit in one.fits]
    for i, (label, at, response) in enumerate(curves, 1):
        values = DECIBEL * np.log(np.maximum(np.abs(response), 1e-300))
        if is_phase:
            values = np.degrees(np.unwrap(np.angle(response)))
            if valid.any():
                middle = int(np.flatnonzero(valid)[len(np.flatnonzero(valid)) // 2])
                values = values + 360.0 * round((one.found.response.phase_deg[middle] - values[middle]) / 360.0)
        axes.plot(at, values, color=COLOURS[i % len(COLOURS)], linestyle=DASHES[i % len(DASHES)], label=label)


def nichols_of_valid(every: Sequence[Identified]) -> Figure:
    """Nichols plot of the valid frequencies."""
    return nichols_figure([_part(one.found.response, one.found.valid) for one in every])


def _part(response: FrequencyResponse, chosen: NDArray[np.bool_]) -> FrequencyResponse:
    values = {name: getattr(response, name)[chosen] for name in ("frequencies", "response", "phase")}
    return replace(response, **values)
