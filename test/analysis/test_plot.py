"""Plots of a recorded flight."""

import html.parser
import sys
from pathlib import Path

import numpy as np
import pytest
from foreign_logs import rewrite

from sbs_sim.commands.plot import main
from sbs_sim.errors import ExportError
from sbs_sim.recording import read
from sbs_sim.recording.plot import flight_figure, plot

LOG = Path(__file__).resolve().parents[2] / "bags" / "hover_step.mcap"


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


WALL = 1_800_000_000 * 10**9  # ns since 1970


def curves(log):
    """Times and values of all curves by their names, and the name of the axis."""
    figure = flight_figure(log)
    lines = {line.get_label(): line.get_data() for axes in figure.axes for line in axes.lines}
    return lines, figure.axes[-1].get_xlabel()


def test_a_log_of_another_recorder_is_drawn_over_simulation_time(log, tmp_path):
    """It has written down when messages came, at half the pace; their stamps tell when they were flown.

    Controls and swashplates are stamped by others: theirs follows from when they came.
    """
    other = read(rewrite(tmp_path / "other.mcap", LOG, lambda now: WALL + 2 * now + 3_000_000))
    found, axis = curves(other)
    expected, _ = curves(log)
    assert axis == "simulation time [s]"
    assert found.keys() == expected.keys()
    for name, (times, values) in expected.items():
        np.testing.assert_allclose(found[name][0], times, atol=1e-5, err_msg=name)
        np.testing.assert_array_equal(found[name][1], values)


def test_where_nothing_is_stamped_time_begins_with_the_first_message(tmp_path):
    path = rewrite(tmp_path / "other.mcap", LOG, lambda now: WALL + now, lambda topic: topic == "/controls")
    found, axis = curves(read(path))
    assert axis == "time since the first message [s]"
    times, _ = found["collective"]
    assert times[0] == 0.0
    assert times[-1] == pytest.approx(np.ptp(read(path)["controls"].time))


def test_a_flight_that_is_not_there_is_one_line(monkeypatch, capsys, tmp_path):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", ["plot", str(LOG), "--flight", "2"])
    with pytest.raises(SystemExit, match="1"):
        main()
    assert capsys.readouterr().err == f"{LOG}: flight 2: allowed are 1 to 1\n"
    assert list(tmp_path.iterdir()) == []
