"""Plots of a recorded flight."""

import html.parser
from pathlib import Path

import pytest

from sbs_sim.errors import ExportError
from sbs_sim.recording import read
from sbs_sim.recording.plot import flight_figure, plot

LOG = Path(__file__).resolve().parent.parent / "bags" / "hover_step.mcap"


@pytest.fixture(scope="module")
def log():
    return read(LOG)


def test_every_panel_has_its_unit_and_its_curves(log):
    figure = flight_figure(log)
    labels = [axes.get_ylabel() for axes in figure.axes]
    assert len(labels) == 10
    for axes in figure.axes:
        assert "[" in axes.get_ylabel()
        assert len(axes.lines) >= 2
    assert figure.axes[-1].get_xlabel() == "simulation time [s]"
    (height,) = (line for line in figure.axes[0].lines if line.get_label() == "height")
    assert height.get_ydata()[-1] == -log["state"]["position.z"][-1]


def test_nothing_is_cut_off(log):
    figure = flight_figure(log)
    figure.canvas.draw()
    canvas = figure.bbox
    for axes in figure.axes:
        for text in [*axes.get_xticklabels(), axes.yaxis.label, *axes.get_legend().get_texts()]:
            box = text.get_window_extent()
            assert box.x0 >= canvas.x0 - 1
            assert box.x1 <= canvas.x1 + 1


@pytest.mark.parametrize("suffix", [".png", ".svg", ".html"])
def test_files(log, tmp_path, suffix):
    first, again = (plot(log, tmp_path / f"{name}{suffix}").read_bytes() for name in "ab")
    assert first == again
    if suffix == ".html":
        text = first.decode()
        html.parser.HTMLParser().feed(text)
        assert text.count("<svg") == 1
        assert "parameter_hash" in text


def test_the_suffix_may_be_in_capitals(log, tmp_path):
    assert plot(log, tmp_path / "a.PNG").read_bytes().startswith(b"\x89PNG")
    assert "<html" in plot(log, tmp_path / "a.Html").read_text()


def test_what_cannot_be_drawn_is_named(log, tmp_path):
    with pytest.raises(ExportError, match=r"allowed are names that end in \.png, \.svg, \.html"):
        plot(log, tmp_path / "a.pdf")
    with pytest.raises(ExportError, match="cannot be written: there is no folder"):
        plot(log, tmp_path / "none" / "a.png")
    assert list(tmp_path.iterdir()) == []
