"""Plots of a recorded flight."""

import html.parser
import sys
from pathlib import Path

import numpy as np
import pytest
from foreign_logs import rewrite

from sbs_sim import linearize
from sbs_sim.analysis.linear_flight import linear_flight
from sbs_sim.commands.plot import condition_of, linear_beside, main
from sbs_sim.errors import ExportError, LinearizationError, RecordingError
from sbs_sim.model import state as S
from sbs_sim.model.frames import euler_to_quaternion
from sbs_sim.recording import read
from sbs_sim.recording.overlay import apart, flown_again, overlay_figure
from sbs_sim.recording.plot import flight_figure, flown_of, plot
from sbs_sim.recording.recorded_flight import flight_of

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


# -- over one another ------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def again(log):
    return flown_again(flight_of(log))


def test_a_log_flown_again_lies_on_itself(log, again):
    off = apart(flown_of(log), again)
    assert off.keys() == set(flown_of(log).panels) - {"controls [deg]", "swashplates [deg]"}
    assert all(most <= 1e-6 for _, most, _ in off.values()), off


def test_a_heavier_aircraft_sinks(log):
    """The thrust stays near the weight of the log's for a moment: a share of g, against the lift of the air."""
    heavy = flown_again(flight_of(log), {"body.mass": 1.1 * flight_of(log).aircraft.body.mass})
    time, height = heavy.panels["position [m]"]["height"]
    _, before = flown_of(log).panels["position [m]"]["height"]
    assert heavy.name.startswith("flown again with body.mass=")
    k = int(np.argmin(abs(time - time[0] - 0.1)))
    assert height[k] - np.interp(time[k], *flown_of(log).panels["position [m]"]["height"]) == pytest.approx(
        -0.5 * 9.81 * (0.1 / 1.1) * 0.1**2, rel=0.2
    )
    assert len(before)


def test_the_title_says_which_is_which_and_what_differs(log, again):
    other = flown_again(flight_of(log), azimuth_step=np.radians(3.0))
    figure = overlay_figure([flown_of(log), again, other])
    (legend,) = figure.legends
    texts = [text.get_text() for text in legend.get_texts()]
    assert [text.split(" (")[0] for text in texts] == ["hover_step.mcap", "flown again", "flown again"]
    steps = [float(text.split("step ")[1].split(" ms")[0]) for text in texts]
    assert steps[0] == steps[1] == pytest.approx(1e3 * flight_of(log).step_size, rel=1e-3)
    assert steps[2] != steps[1]
    for axes in figure.axes:
        styles = {line.get_linestyle() for line in axes.lines}
        assert styles >= {"-", "--", "-."}
        assert len({line.get_color() for line in axes.lines}) * 3 == len(axes.lines)


def test_a_linear_model_holds_for_the_begin_of_a_small_step(log):
    linear = linear_beside(log)
    assert "position [m]" not in linear.panels
    assert "yaw" not in linear.panels["attitude [deg]"]
    for label, names in {"rates [deg/s]": "pqr", "velocity [m/s]": "uvw"}.items():
        for name in names:
            time, values = flown_of(log).panels[label][name]
            soon = time < time[0] + 1.5
            ours = np.interp(time[soon], *linear.panels[label][name])
            assert abs(ours - values[soon]).max() < 0.1 * np.ptp(values) + 0.01, name


def test_a_linear_flight_is_that_of_its_poles(sbs):
    model = linearize(sbs)
    pole, vectors = np.linalg.eig(model.a)
    k = int(np.argmax(pole.real))
    start = model.trim.state + 1e-3 * vectors[:, k].real
    held = np.tile(model.trim.controls, (11, 1))
    flown = linear_flight(model, start, held, 0.05)
    expected = model.trim.state + 1e-3 * (vectors[:, k] * np.exp(pole[k] * 0.05 * np.arange(11))[:, None]).real
    assert flown == pytest.approx(expected, abs=1e-12)
    with pytest.raises(LinearizationError, match="have the shapes"):
        linear_flight(model, start[:8], held, 0.05)


@pytest.mark.parametrize(
    ("velocity", "heading", "condition"),
    [
        ((5.0, 0.0, -1.0), 0.3, (5.0, 1.0, 0.0)),
        ((-3.0, 0.0, 0.0), 0.0, (-3.0, 0.0, 0.0)),
        ((0.0, 2.0, 0.0), 1.0, (2.0, 0.0, np.pi / 2)),
    ],
)
def test_the_steady_flight_of_a_state(velocity, heading, condition):
    state = np.zeros(S.BODY_SIZE)
    state[S.ATTITUDE : S.VELOCITY] = euler_to_quaternion(heading, 0.0, 0.0)
    state[S.VELOCITY : S.RATES] = velocity
    found = condition_of(state)
    assert (found.airspeed, found.climb_rate, found.sideslip) == pytest.approx(condition)


def test_flights_without_a_common_time_are_refused(log, again, tmp_path):
    other = read(rewrite(tmp_path / "other.mcap", LOG, lambda now: WALL + now, lambda topic: topic == "/controls"))
    with pytest.raises(RecordingError, match="no common time"):
        overlay_figure([flown_of(log), flown_of(other)])
    with pytest.raises(RecordingError, match="allowed are 4"):
        overlay_figure([again] * 5)


def test_two_logs_and_a_flight_on_a_page(monkeypatch, capsys, tmp_path):
    page = tmp_path / "both.html"
    words = ["plot", str(LOG), str(LOG), "--resimulate", "--set", "body.mass=21", "--out", str(page)]
    monkeypatch.setattr(sys, "argv", words)
    with pytest.raises(SystemExit, match="0"):
        main()
    text = page.read_text()
    html.parser.HTMLParser().feed(text)
    assert text.count("<svg") == 1
    assert "flown again with body.mass=21" in text
    printed = capsys.readouterr().out
    assert "hover_step.mcap: largest difference from hover_step.mcap" in printed
    assert "flown again with body.mass=21: largest difference" in printed
    monkeypatch.setattr(sys, "argv", ["plot", str(LOG), "--set", "body.mass=21"])
    with pytest.raises(SystemExit, match="2"):
        main()
