"""Bode and Nichols plots of frequency responses, and their numbers as CSV and JSON. No window is used."""

import csv
import io
from collections.abc import Sequence
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sbs_sim.analysis.frequency_response import FrequencyResponse
from sbs_sim.analysis.plots import GRID, INK
from sbs_sim.analysis.sweep_plots import save_figures
from sbs_sim.output.files import write
from sbs_sim.output.json_text import to_json
from sbs_sim.output.plot_style import COLOURS

WIDE = 7.0  # inches
NEUTRAL = -180.0  # deg


def save_responses(responses: Sequence[FrequencyResponse], folder: str | Path) -> list[Path]:
    """Write Bode and Nichols plots (PNG, SVG) of all responses together, and their numbers as CSV and JSON.

    Parameters
    ----------
    responses : sequence of FrequencyResponse
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
    written = save_figures({"bode": bode_figure(responses), "nichols": nichols_figure(responses)}, folder)
    texts = {"responses.csv": responses_to_csv(responses), "responses.json": to_json(responses_to_dict(responses))}
    for name, text in texts.items():
        written.append(Path(folder) / name)
        write(written[-1], text)
    return written


def responses_to_dict(responses: Sequence[FrequencyResponse]) -> dict[str, object]:
    """All numbers as plain lists, see `FrequencyResponse.to_dict`."""
    return {"responses": [response.to_dict() for response in responses]}


def responses_to_csv(responses: Sequence[FrequencyResponse]) -> str:
    """Table with a row for each frequency of each response: SI units, phases in rad."""
    file = io.StringIO()
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(["input", "output", "frequency [rad/s]", "gain [SI]", "phase [rad]"])
    for response in responses:
        for row in zip(response.frequencies, response.gain, response.phase, strict=True):
            writer.writerow([response.input_name, response.output_name, *(repr(float(value)) for value in row)])
    return file.getvalue()


def bode_figure(responses: Sequence[FrequencyResponse]) -> Figure:
    """Gain in dB of SI units, and phase in deg, over frequency."""
    figure = Figure(figsize=(WIDE, 6.0), layout="constrained")
    gain, phase = figure.subplots(2, 1, sharex=True)
    for i, response in enumerate(responses):
        colour = COLOURS[i % len(COLOURS)]
        gain.semilogx(response.frequencies, response.gain_db, color=colour, label=response_name(response))
        phase.semilogx(response.frequencies, response.phase_deg, color=colour)
    gain.set_ylabel("gain [dB]")
    phase.set_ylabel("phase [deg]")
    phase.set_xlabel("frequency [rad/s]")
    legend(gain)
    grids(gain, phase)
    return figure


def nichols_figure(responses: Sequence[FrequencyResponse]) -> Figure:
    """Gain over phase."""
    figure = Figure(figsize=(WIDE, 5.0), layout="constrained")
    axes = figure.subplots()
    for i, response in enumerate(responses):
        axes.plot(response.phase_deg, response.gain_db, color=COLOURS[i % len(COLOURS)], label=response_name(response))
    axes.axvline(NEUTRAL, color=INK, linewidth=0.8)
    axes.set_xlabel("phase [deg]")
    axes.set_ylabel("gain [dB]")
    legend(axes)
    grids(axes)
    return figure


def response_name(response: FrequencyResponse) -> str:
    """Output by input with their units."""
    return f"{response.output_name} by {response.input_name} [{response.output_unit} / {response.input_unit}]"


def legend(axes: Axes) -> None:
    """Legend in which names are plain texts: some come from files."""
    for text in axes.legend(fontsize=8).get_texts():
        text.set_parse_math(False)


def grids(*every: Axes) -> None:
    """Lines behind the curves."""
    for axes in every:
        axes.grid(True, which="major", color=GRID, linewidth=0.6)
        axes.set_axisbelow(True)
