"""Texts of files, messages and services are no markup: not of HTML, of Markdown, of formulas, of a terminal."""

import ast
import json
from pathlib import Path

import numpy as np
import pytest
from markup import HOSTILE, Elements, shown_as_text

from sbs_sim import Aircraft, sweep, trim
from sbs_sim.analysis.batch import simulate_batch
from sbs_sim.analysis.monte_carlo import gust_cases
from sbs_sim.analysis.monte_carlo_plots import batch_figure
from sbs_sim.analysis.sweep_plots import save_plots
from sbs_sim.cockpit.poles import Pole, pole_page
from sbs_sim.cockpit.readouts import Status, readout, source_line
from sbs_sim.cockpit.trim_report import TrimResult, line, model_page, trim_page
from sbs_sim.errors import AircraftError
from sbs_sim.flight.simulation import Simulation
from sbs_sim.flight.trim_point import TrimCondition
from sbs_sim.flight.trimmed_state import trimmed_state
from sbs_sim.recording import read
from sbs_sim.recording.plot import plot

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = ROOT / "sbs_sim"
FORMULA = "$\\nonsense{$"


@pytest.fixture(scope="module")
def hostile(tmp_path_factory):
    """The helicopter and its left rotor under such a name."""
    text = (ROOT / "config" / "aircraft" / "sbs.yaml").read_text()
    name = json.dumps(HOSTILE)  # is YAML
    path = tmp_path_factory.mktemp("hostile") / "hostile.yaml"
    path.write_text(text.replace("name: sbs\n", f"name: {name}\n").replace("name: MR1\n", f"name: {name}\n"))
    aircraft = Aircraft.load(path)
    assert (aircraft.name, aircraft.rotors[0].name) == (HOSTILE, HOSTILE)
    return aircraft


@pytest.fixture(scope="module")
def snapshot(hostile):
    point = trim(hostile)
    return Simulation(hostile, trimmed_state(hostile, point), point.swashplate).snapshot()


def test_the_search_would_find_markup():
    assert not shown_as_text(f"<p>{HOSTILE}</p>")
    assert "xss-mark" in Elements(HOSTILE).names
    assert shown_as_text("<p>" + HOSTILE.replace("&", "&amp;").replace("<", "&lt;") + "</p>")


def test_what_the_cockpit_shows_of_others_is_text(hostile, snapshot):
    trimmed = TrimResult(TrimCondition(), np.zeros(4), 0.0, 0.0, 0.0, 0.0, (HOSTILE,))
    for page in (
        readout(hostile, snapshot, Status(), hostile.name),
        *(readout(hostile, snapshot, Status(**{field: HOSTILE}), "sbs") for field in ("fault", "log_state")),
        readout(hostile, snapshot, Status(warnings=(HOSTILE,)), "sbs"),
        source_line(HOSTILE, True),
        line(HOSTILE),
        trim_page(trimmed, snapshot, hostile),
        model_page(trimmed, snapshot),
        pole_page([Pole(HOSTILE, 1j)], "hover"),
        pole_page([Pole("phugoid", 1j)], HOSTILE),
    ):
        assert shown_as_text(page), page
    name = HOSTILE.replace("/", "|")  # of a file
    page = Elements(readout(hostile, snapshot, Status(log=f"bags/{name}"), "sbs"))
    assert f"recording {name}" in page.text
    assert "xss-mark" not in page.names


def test_the_cockpit_has_no_panel_of_markdown():
    for path in [*(PACKAGE / "cockpit").glob("*.py"), *(PACKAGE / "nodes").glob("cockpit*.py")]:
        assert "add_markdown" not in path.read_text(), path


def test_html_on_the_page_is_made_by_functions_that_escape():
    """A name that comes from a file has no way around: f-strings of HTML are in these modules alone."""
    allowed = {"charts", "page_head", "poles", "readouts", "trim_report", "view"}
    for path in (PACKAGE / "cockpit").glob("*.py"):
        tree = ast.parse(path.read_text())
        made = [node for node in ast.walk(tree) if isinstance(node, ast.JoinedStr) and "</" in ast.unparse(node)]
        assert not made or path.stem in allowed, path


def test_a_plot_of_a_flight_shows_names_as_text(tmp_path):
    log = read(ROOT / "bags" / "hover_step.mcap")
    log.path = tmp_path / HOSTILE.replace("/", "|")
    log.metadata["simulation"] |= {"aircraft": HOSTILE, HOSTILE: "x"}
    log.complete, log.reasons = False, (HOSTILE,)
    page = Elements(plot(log, tmp_path / "a.html").read_text())
    assert "xss-mark" not in page.names
    assert page.text.count(HOSTILE) == 3  # why it is not complete, the name of the aircraft, a key
    assert page.text.count(log.path.name) == 3  # title, heading, path
    assert "xss-mark" not in Elements(plot(log, tmp_path / "a.svg").read_text()).names


def test_figures_draw_names_as_they_are(hostile, tmp_path):
    """A formula that cannot be read would end the drawing."""
    formula = hostile.with_value("name", FORMULA).with_value("rotors[0].name", FORMULA)
    found = sweep(formula, f"rotors.{FORMULA}.blade_mass", [0.15, 0.16], workers=1)
    assert [path.suffix for path in save_plots(found, tmp_path)] == [".png", ".svg"] * 2
    batch = simulate_batch(gust_cases(formula, 2, {}, turbulence=1.0), duration=0.02, workers=1)
    assert batch_figure(batch).canvas.print_to_buffer()


@pytest.mark.parametrize("name", ["a\x1b[31mb", "a\nb", "a\u202eb", "\x00"])
@pytest.mark.parametrize("path", ["name", "rotors[1].name"])
def test_names_that_are_no_plain_text_are_refused(sbs, path, name):
    """The first colours a terminal, the second is two lines of an error, the third turns what follows around."""
    with pytest.raises(AircraftError) as refused:
        sbs.with_value(path, name)
    assert f"{path} = {name!r}" in str(refused.value)
    assert "printable" in str(refused.value)
    assert str(refused.value).isprintable()
