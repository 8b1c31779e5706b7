"""What notebooks and `help` show of results: HTML in which no text is markup, names, and types by their names."""

import dataclasses
import pydoc
from html.parser import HTMLParser

import numpy as np
import pytest

import sbs_sim
from sbs_sim import linearize, simulate_batch, sweep, trim
from sbs_sim.analysis.batch import Case
from sbs_sim.model import state as S
from sbs_sim.output.notebook import MAX_ROWS

VICIOUS = "<script>alert(\"1\")</script> & 'x'"


class Page(HTMLParser):
    """Elements and rows of a page; fails on one that is not closed."""

    def __init__(self, text):
        super().__init__()
        self.tags, self.rows, self.text, self._open = set(), [], "", []
        self.feed(text)
        self.close()
        assert self._open == []

    def handle_starttag(self, tag, attributes):
        self.tags.add(tag)
        self._open.append(tag)
        assert [name for name, _ in attributes if name != "style"] == []
        if tag == "tr":
            self.rows.append([])
        elif tag in ("td", "th"):
            self.rows[-1].append("")

    def handle_endtag(self, tag):
        assert self._open.pop() == tag

    def handle_data(self, data):
        self.text += data
        if self._open[-1] in ("td", "th"):
            self.rows[-1][-1] += data


@pytest.fixture(scope="module")
def model(sbs):
    return linearize(sbs, airspeed=10.0)


def test_a_trim_is_shown_with_its_numbers(model):
    page = Page(model.trim._repr_html_())
    shown = {row[0]: row[1] for row in page.rows if len(row) == 2}
    assert float(shown["pitch [deg]"]) == pytest.approx(np.degrees(model.trim.pitch), abs=1e-4)
    assert float(shown["collective [deg]"]) == pytest.approx(np.degrees(model.trim.controls[0]), abs=1e-4)
    assert sum(map(float, shown["power [W]"].split(" + "))) == pytest.approx(model.trim.power.sum(), abs=0.02)
    assert "airspeed 10 m/s" in page.text


def test_a_linear_model_is_shown_with_its_modes(model):
    rows = {row[0]: row[1:] for row in Page(model._repr_html_()).rows}
    for mode in model.modes:
        pole, frequency, damping, *_ = rows[mode.name]
        assert float(pole.split()[0]) == pytest.approx(mode.pole.real, abs=1e-5)
        assert ("±" in pole) == mode.is_oscillatory
        assert (float(frequency), float(damping)) == pytest.approx((mode.frequency, mode.damping), abs=1e-4)


def test_a_sweep_is_shown_with_what_failed(sbs):
    found = sweep(sbs, "sideslip", np.radians([0.0, 90.0, 181.0]), airspeed=3.0)
    heading, *rows = Page(found._repr_html_()).rows
    assert heading[0] == "sideslip [deg]"
    assert [row[0] for row in rows] == ["0", "90", "181"]
    assert float(rows[1][2]) == pytest.approx(np.degrees(found.points[1].trim.roll), abs=1e-3)
    assert rows[0][8].startswith("phugoid") or "phugoid" in rows[0][8]
    assert rows[2][9].startswith("sideslip = 3.159")
    many = dataclasses.replace(found, points=found.points[:1] * (MAX_ROWS + 3))
    rows = Page(many._repr_html_()).rows
    assert len(rows) == MAX_ROWS + 2
    assert rows[1 + MAX_ROWS // 2][0] == "… 3 more …"


def test_no_text_of_theirs_is_markup(model, sbs):
    point = dataclasses.replace(model.trim, warnings=(VICIOUS,), beyond_limits=(VICIOUS,))
    mode = dataclasses.replace(model.modes[0], name=VICIOUS)
    bad = dataclasses.replace(model, trim=point, method=VICIOUS)
    vars(bad)["modes"] = (mode,)
    found = sweep(sbs, "airspeed", [0.0, 200.0], linear=False)
    failed = dataclasses.replace(found.points[1], error=VICIOUS)
    growing = dataclasses.replace(found.points[0], trim=point, model=bad)
    swept = dataclasses.replace(found, parameter=VICIOUS, points=(growing, failed))
    for shown, count in ((point, 2), (bad, 4), (swept, 4)):
        page = Page(shown._repr_html_())
        assert page.tags <= {"p", "table", "thead", "tbody", "tr", "th", "td"}
        assert page.text.count(VICIOUS) >= count


# -- names -----------------------------------------------------------------------------------------------------------


def test_a_trim_knows_its_states_and_more_by_name(sbs):
    point = trim(sbs, airspeed=8.0, climb_rate=2.0, turn_rate=0.3)
    for i, name in enumerate(point.state_names):
        assert point[name] == point.state[i]
    assert (point["theta"], point["phi"], point["psi"]) == pytest.approx((point.pitch, point.roll, 0.0), abs=1e-15)
    assert point["V"] == pytest.approx(np.linalg.norm([point[name] for name in "uvw"]), rel=1e-12)
    assert [point[name] for name in S.CONTROL_NAMES] == point.controls.tolist()
    assert point["power"] is point.power
    assert "theta" in point
    assert "alpha" not in point
    assert set(dict(point)) == set(point) == set(point.keys())
    with pytest.raises(KeyError, match="no 'alpha': there are collective, "):
        point["alpha"]
    found = sweep(sbs, "airspeed", [0.0, 5.0, 200.0], climb_rate=1.0, linear=False)
    assert found["V"][:2] == pytest.approx([1.0, 26**0.5])
    assert np.isnan(found["V"][2])
    assert found["theta"][:2] == pytest.approx([point.trim.pitch for point in found.points[:2]], abs=1e-15)
    assert (found.unit("V"), found.unit("psi")) == ("m/s", "rad")


def test_a_batch_knows_the_attitude_by_name(sbs):
    cases = [Case(sbs, {"airspeed": 6.0, "turn_rate": 0.4}), Case(sbs, {"airspeed": 900.0})]
    batch = simulate_batch(cases, 0.5, every=25, outputs=["state"])
    assert batch["psi"].shape == (2, 3)
    assert batch["psi"][0] == pytest.approx([0.0, 0.1, 0.2], abs=0.01)
    assert np.isnan(batch["theta"][1]).all()
    with pytest.raises(KeyError, match="psi, theta, phi"):
        batch["alpha"]


# -- help ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", sbs_sim.__all__)
def test_help_shows_types_by_their_names(name):
    """A type that numpy takes for arrays is a page long when it is written out."""
    text = pydoc.plain(pydoc.render_doc(getattr(sbs_sim, name)))
    assert "numpy._typing" not in text
    assert "Union[" not in text
    assert max(map(len, text.splitlines())) < 1000
