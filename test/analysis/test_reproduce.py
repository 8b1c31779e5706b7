"""The paper's results: bounds are those of the paper's printed numbers, or of what any rotor in hover must do."""

import dataclasses
import json
import math
import re
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from helpers import Model, build
from markup import HOSTILE, Elements, shown_as_text

from sbs_sim.analysis.page import PAGE, inline_svg, page_text, save_page
from sbs_sim.analysis.paper_tables import TABLES, Cell, contents, parse_pole, printed_tables
from sbs_sim.analysis.plots import drawings
from sbs_sim.analysis.reproduce import MISMATCH, Entry, reproduce
from sbs_sim.analysis.reproduce_remarks import REMARKS
from sbs_sim.errors import ExportError
from sbs_sim.flight.trimmed_state import trimmed_state

ROOT = Path(__file__).resolve().parents[2]
PATIENCE = 300.0  # s, generous, for machines that are busy
FIGURES = [4, 5, *range(7, 23)]  # of the paper; 1 to 3 and 6 are drawings
BODY_TABLES = ("table1", "table2", "table4")
OMEGA = 2400.0 * 2.0 * math.pi / 60.0  # Table 6


@pytest.fixture(scope="module")
def report():
    return reproduce()


@pytest.fixture(scope="module")
def data(report):
    """The report as JSON has it."""
    return json.loads(json.dumps(report.to_dict(), allow_nan=False))


def call(*arguments, cwd=None):
    command = [str(ROOT / "run"), "reproduce", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=False, cwd=cwd)


@pytest.fixture(scope="module")
def executed(tmp_path_factory):
    """The executable with all that it can write, and the folder with that."""
    folder = tmp_path_factory.mktemp("reproduce")
    return call("--json", folder / "all.json", "--out", folder / "made" / "by it"), folder


@pytest.fixture(scope="module")
def page(executed):
    """Folder with figures and page."""
    return executed[1] / "made" / "by it"


def leaves(data):
    """All entries of the tables with their paths, those of frequencies and dampings too."""
    found = {}

    def walk(path, value):
        if isinstance(value, dict):
            if "paper" in value:
                found[path] = value
            for key, inner in value.items():
                walk(f"{path}.{key}".lstrip("."), inner)

    walk("", {name: data[name] for name in TABLES})
    return found


# -- the claims: rotor and inflow poles ------------------------------------------------------------------------------


@pytest.mark.parametrize("model", ["complete", "paper_reading"])
@pytest.mark.parametrize(
    ("key", "pole"),
    [("collective_flap", 0.0), ("collective_lag", 0.0), ("non_uniform_disc_tilt", 251.0), ("non_uniform_lag", 251.0)],
)
def test_uncoupled_poles_of_the_first_matrix(data, model, key, pole):
    real, imag = data["table5"][key][model]
    assert abs(real) < 1e-6
    assert imag == pytest.approx(pole, rel=0.005, abs=1e-6)


@pytest.mark.parametrize(("key", "pole"), [("coupled_advancing", 256.0), ("coupled_regressing", 247.0)])
def test_coupled_poles_of_the_first_matrix(data, key, pole):
    entry = data["table5"][key]
    for name in ("paper_reading", "paper_reading_at_printed_coning", "complete_at_printed_coning"):
        assert abs(entry[name][0]) < 1e-6
        assert entry[name][1] == pytest.approx(pole, rel=0.005)


def test_coupled_collective_pole_follows_the_coning(data):
    entry = data["table5"]["coupled_collective"]
    assert entry["paper_reading_at_printed_coning"][1] == pytest.approx(4.55, rel=0.005)
    assert entry["paper_reading"][1] == pytest.approx(4.55, rel=0.04)
    coning = data["hover"]["coning_deg"]["paper_reading"]
    proportional = entry["paper_reading"][1] / coning * 0.53
    assert entry["paper_reading_at_printed_coning"][1] == pytest.approx(proportional, rel=1e-3)


def test_coupled_companions_are_at_the_rotor_speed_plus_and_minus(data):
    own = {key: data["table5"][f"coupled_{key}"]["complete"][1] for key in ("collective", "advancing", "regressing")}
    assert own["advancing"] == pytest.approx(OMEGA + own["collective"], rel=1e-6)
    assert own["regressing"] == pytest.approx(OMEGA - own["collective"], rel=1e-6)


@pytest.mark.parametrize("model", ["complete", "paper_reading"])
@pytest.mark.parametrize(("key", "pole"), [("uniform", -33.5), ("lateral_longitudinal", -126.0)])
def test_inflow_poles(data, model, key, pole):
    entry = data["inflow_poles"][key]
    assert entry[model] == [pytest.approx(pole, rel=0.005), 0.0]
    assert len(entry[f"{model}_coupled"]) == 2
    assert all(coupled[0] < 1.5 * pole for coupled in entry[f"{model}_coupled"])


def test_only_the_order_of_equation_14_has_the_printed_spectrum(data):
    order = data["facts"]["equation_32"]
    printed = [0.0, 0.0, 4.55, 247.0, 251.0, 251.0, 256.0]
    frequencies = sorted(imag for _, imag in order["as_equation_14"])
    assert frequencies == pytest.approx(printed, rel=0.04)
    assert max(real for real, _ in order["as_equation_14"]) < 1e-6
    assert max(real for real, _ in order["as_printed"]) > 1.0


# -- the claims: body ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("table", ["table1", "table2"])
@pytest.mark.parametrize("model", ["complete", "paper_reading"])
def test_heave(data, table, model):
    assert data[table]["heave"][model] == [pytest.approx(-0.52, rel=0.05), 0.0]


def test_coning_with_lag_of_the_complete_model(data):
    assert data["table3"]["flap_lag"]["a0_deg"]["complete"] == pytest.approx(0.69, rel=0.05)


@pytest.mark.parametrize(
    ("table", "key", "pole"),
    [
        ("table1", "short_period", -7.26),
        ("table1", "roll", -5.84),
        ("table2", "short_period", -15.0),
        ("table2", "roll", -10.72),
    ],
)
def test_fast_poles_of_the_papers_reading(data, table, key, pole):
    assert data[table][key]["paper_reading"] == [pytest.approx(pole, rel=0.03), 0.0]


@pytest.mark.parametrize(
    ("group", "key", "value"),
    [("flap_only", "M_q", -7.2), ("flap_only", "L_p", -5.8), ("flap_lag", "M_q", -15.0), ("flap_lag", "L_p", -10.7)],
)
def test_damping_derivatives_of_the_papers_reading(data, group, key, value):
    assert data["table3"][group][key]["paper_reading"] == pytest.approx(value, rel=0.03)


def test_damping_goes_with_the_airfoil(data):
    """Both airfoils are there for all fast poles and derivatives, and differ as their lift slopes do."""
    entries = [data[table][key] for table in BODY_TABLES for key in ("short_period", "roll")]
    entries += [data["table3"][group][key] for group in ("flap_only", "flap_lag") for key in ("M_q", "L_p")]
    for entry in entries:
        ours, other = (np.ravel(entry[name])[0] for name in ("paper_reading", "paper_reading_naca0012"))
        assert 1.0 < other / ours < 1.11


@pytest.mark.parametrize("table", BODY_TABLES)
@pytest.mark.parametrize("model", ["complete", "paper_reading"])
def test_hubs_damp_pitch_and_roll_alike(data, table, model):
    damping = data["facts"]["hub_damping"][table][model]
    assert damping["pitch"] == pytest.approx(damping["roll"], rel=0.01)
    assert damping["roll"] > 0.0


def test_the_printed_poles_of_table_4_break_the_axisymmetry_that_those_of_tables_1_and_2_keep(data):
    implied = {table: data["facts"]["hub_damping"][table]["printed_poles"] for table in BODY_TABLES}
    assert implied["table1"]["pitch_over_roll"] == pytest.approx(1.0, abs=0.01)
    assert implied["table2"]["pitch_over_roll"] == pytest.approx(1.0, abs=0.01)
    assert implied["table4"]["pitch"] == pytest.approx(45.0, rel=0.05)
    assert implied["table4"]["roll"] == pytest.approx(30.0, rel=0.05)


@pytest.mark.parametrize("name", ["complete", "complete_quasi_static", "paper_reading", "paper_reading_full_matrix"])
def test_cyclic_inflow_leaves_heave_alone(data, name):
    assert data["table4"]["heave"][name][0] == pytest.approx(data["table2"]["heave"][name][0], rel=0.01)


def test_lag_hardly_changes_the_damping_of_the_complete_model(data):
    assert abs(data["facts"]["lag_changes_M_q"]["complete"]) < 0.01
    flap, lag = (data["table3"][group]["M_q"]["complete"] for group in ("flap_only", "flap_lag"))
    assert lag / flap - 1.0 == pytest.approx(data["facts"]["lag_changes_M_q"]["complete"], rel=1e-9)


def test_tilt_under_a_pitch_rate_is_that_of_a_held_body(report, sbs):
    """Against the nonlinear model: the averaged rotor settles with the body turning at the rate of Table 3."""
    model = report.models["complete"]["table2"]
    point, nonlinear = model.trim, Model(sbs, True, False)
    x = trimmed_state(sbs, point)
    x[nonlinear.layout.names.index("q")] = 0.01
    rotor = [nonlinear.layout.names.index(name) for name in model.state_names[8:]]
    for _ in range(4):
        dx = nonlinear.averaged(x, point.swashplate)[0][rotor]
        x[rotor] -= np.linalg.solve(nonlinear.jacobian(x, point.swashplate, columns=rotor)[rotor], dx)
    for key in ("a0", "a1", "b1"):
        ours = report.tables["table3"].groups["flap_lag"][f"{key}_deg"].complete
        assert ours == pytest.approx(math.degrees(x[nonlinear.layout.names.index(f"{key}(1)")]), rel=0.01)


def test_forward_flight_of_the_complete_model_is_as_the_text_says(data):
    trims = data["trim_forward"]["complete"]
    assert trims["errors"] == {}
    assert not any(trims["beyond_limits"])
    assert np.all(np.diff(trims["pitch_deg"]) < 0.0)
    assert min(trims["longitudinal_cyclic_deg"][1:]) > 0.0


def test_forward_flight_that_cannot_be_is_said(report, data):
    trims = data["trim_forward"]["paper_reading"]
    missing = [
        speed
        for speed, pitch in zip(data["trim_forward"]["airspeed"], trims["pitch_deg"], strict=True)
        if pitch is None
    ]
    assert [float(speed) for speed in trims["errors"]] == missing
    said = next(remark for remark in report.remarks if remark.startswith("Forward flight"))
    assert f"no trim is found from {min(missing):g} to {max(missing):g} m/s" in said
    figures = [drawing.caption for drawing in drawings(report) if drawing.number in (4, 5)]
    assert all(f"from {min(missing):g} to {max(missing):g} m/s" in caption for caption in figures)


# -- nothing is hidden -----------------------------------------------------------------------------------------------

# Typed from the paper, not from the file.
PRINTED = {
    "table1.short_period": [-7.26, 0],
    "table1.phugoid": [0.013, 0.52],
    "table1.phugoid.damping": 0.024,
    "table1.dutch_roll": [0.021, 0.46],
    "table1.dutch_roll.damping": 0.045,
    "table1.spiral.frequency": 0.064,
    "table2.short_period": [-15.0, 0],
    "table2.phugoid": [0.0032, 0.53],
    "table2.phugoid.damping": 0.0059,
    "table2.roll": [-10.72, 0],
    "table2.dutch_roll": [0.0078, 0.50],
    "table2.dutch_roll.damping": 0.016,
    "table2.spiral": [-0.039, 0],
    "table3.flap_only.a0_deg": 0.53,
    "table3.flap_only.a1_deg": -0.0047,
    "table3.flap_only.b1_deg": 0.014,
    "table3.flap_only.M_q": -7.2,
    "table3.flap_only.L_p": -5.8,
    "table3.flap_lag.a0_deg": 0.69,
    "table3.flap_lag.a1_deg": -0.023,
    "table3.flap_lag.b1_deg": 0.013,
    "table3.flap_lag.M_q": -15.0,
    "table3.flap_lag.L_p": -10.7,
    "table4.short_period": [-20.2, 0],
    "table4.phugoid_plus": [0.52, 0],
    "table4.phugoid_minus": [-0.55, 0],
    "table4.heave": [-0.45, 0],
    "table4.roll": [-9.78, 0],
    "table4.dutch_roll": [0.0029, 0.22],
    "table4.dutch_roll.damping": 0.014,
    "table4.spiral": [-0.041, 0],
    "table5.coupled_collective": [0, 4.55],
    "table5.coupled_advancing": [0, 256],
    "table5.coupled_regressing": [0, 247],
    "table5.collective_flap": [0, 0],
    "table5.non_uniform_disc_tilt": [0, 251],
    "table5.collective_lag": [0, 0],
    "table5.non_uniform_lag": [0, 251],
    "inflow_poles.uniform": [-33.5, 0],
    "inflow_poles.lateral_longitudinal": [-126, 0],
    "hover.collective_deg": 10,
    "hover.lateral_cyclic_deg": 0,
    "hover.differential_cyclic_deg": 0,
}


@pytest.mark.parametrize("path", PRINTED)
def test_printed_numbers_are_those_of_the_paper(data, path):
    assert leaves(data)[path]["paper"] == PRINTED[path]


def test_every_cell_of_the_file_is_in_the_report(data):
    """Frequencies and dampings too."""
    found = leaves(data)
    cells = 0
    for name in TABLES:
        groups = contents()[name].get("groups", {"": contents()[name]})
        for group, own in groups.items():
            for key, row in own["rows"].items():
                path = ".".join(part for part in (name, group, key) if part)
                text = row.get("pole", row.get("wording", row.get("value", "")))
                assert found[path]["paper_as_printed"] == text
                cells += 1
                for column in {"frequency", "damping"} & set(row):
                    assert found[f"{path}.{column}"]["paper_as_printed"] == row[column]
                    cells += 1
    assert len(found) == cells
    # 6 + 6 + 7 poles with frequencies and 5 dampings, 10 of Table 3, 7 of Table 5, 2 inflow poles with frequencies, 5
    assert cells == 2 * 19 + 5 + 10 + 7 + 4 + 5


def test_printed_frequencies_are_those_of_the_printed_poles(data):
    """To their rounding: so the file has no slip of the pen."""
    for path, entry in leaves(data).items():
        if path.endswith(".frequency"):
            pole = leaves(data)[path.removesuffix(".frequency")]["paper"]
            assert entry["paper"] == pytest.approx(math.hypot(*pole), rel=0.01), path


def test_every_entry_has_everything(data):
    wanted = {"paper", "complete", "paper_reading", "ratio_complete", "ratio_paper_reading", "remark", "unit", "label"}
    for path, entry in leaves(data).items():
        assert wanted <= set(entry), path
        assert entry["complete"] is not None, path
        assert entry["paper_reading"] is not None, path
        nothing = not np.any(entry["paper"]) if entry["paper"] is not None else True
        assert (entry["ratio_complete"] is None) == nothing, path
        assert (entry["ratio_paper_reading"] is None) == nothing, path
    for table in BODY_TABLES:
        for entry in data[table].values():
            assert {"complete_quasi_static", "paper_reading_full_matrix", "paper_reading_naca0012"} <= set(entry)


def test_every_mismatch_has_a_remark(data):
    off = 0
    for path, entry in leaves(data).items():
        ratios = [entry["ratio_complete"], entry["ratio_paper_reading"]]
        if any(ratio is not None and abs(ratio - 1.0) > MISMATCH for ratio in ratios):
            off += 1
            assert entry["remark"], path
    assert off > 20
    assert MISMATCH == 0.2


def test_remarks_belong_to_entries(report):
    names = {
        ".".join(part for part in (name, group, key) if part)
        for name, table in report.tables.items()
        for group, rows in table.groups.items()
        for key in rows
    }
    assert set(REMARKS) <= names
    kinds = ("reading:", "artefact:", "convention:", "choice:", "misprint:", "unexplained:", "not printed")
    assert all(remark.startswith(kinds) for remark in REMARKS.values())


def test_keys_of_the_json(data, sbs):
    assert set(TABLES) == {"table1", "table2", "table3", "table4", "table5", "inflow_poles", "hover"}
    assert set(data) == {
        *TABLES,
        *("facts", "trim_forward", "remarks", "conditions", "versions", "parameter_hashes", "source"),
    }
    assert set(data["table1"]) == {"short_period", "phugoid", "heave", "roll", "dutch_roll", "spiral"}
    assert set(data["table3"]) == {"flap_only", "flap_lag"}
    assert set(data["parameter_hashes"]) == {"complete", "paper_reading", "paper_reading_naca0012"}
    assert data["parameter_hashes"]["complete"] == sbs.with_value("rotors.lag_damping", 0.0).parameter_hash
    assert data["conditions"]["aircraft"]["paper_reading_naca0012"]["airfoil"] == ["naca0012"]
    assert data["versions"]["numpy"] == np.__version__


# -- entries ---------------------------------------------------------------------------------------------------------


def entry(printed, ours):
    return Entry("x", "rad/s", Cell("as printed", printed), ours, ours)


def test_ratios():
    assert entry(-2.0 + 0j, -1.0 + 0j).ratio_complete == 0.5
    assert entry(-2.0 + 0j, 1.0 + 0j).ratio_complete == -0.5  # an unstable pole for a stable one
    assert entry(3.0 + 4.0j, 0.0 + 10.0j).ratio_complete == 2.0
    assert entry(2.0 + 0j, 3.0 + 4.0j).ratio_complete == 2.5
    assert entry(0.0 + 0j, 1.0 + 0j).ratio_complete is None
    assert entry(None, 1.0).ratio_complete is None


@pytest.mark.parametrize(
    ("printed", "ours", "is_off"),
    [
        (-2.0 + 0j, -2.3 + 0j, False),
        (-2.0 + 0j, -2.5 + 0j, True),
        (-2.0 + 0j, -1.5 + 0j, True),
        (-2.0 + 0j, 2.0 + 0j, True),
        (2.0 + 0j, 0.1 + 2.0j, True),  # of the right size, but a pair
        (0.1 + 2.0j, 2.0 + 0j, True),
        (0.0 + 0j, 1e-9 + 0j, False),
        (0.0 + 0j, 1.0 + 0j, True),
        (0.5, None, True),
        (None, 1.0, False),
    ],
)
def test_what_is_off(printed, ours, is_off):
    assert entry(printed, ours).is_off(ours) is is_off
    assert Entry("x", "1", Cell("", printed), printed, ours).is_mismatch is is_off


@pytest.mark.parametrize(
    ("text", "pole"),
    [
        ("-7.26", -7.26),
        ("0.013 ± 0.52i", 0.013 + 0.52j),
        ("± 4.55i", 4.55j),
        ("0", 0),
        ("0.0029 ± 0.22", 0.0029 + 0.22j),
    ],
)
def test_printed_poles_are_read(text, pole):
    assert parse_pole(text) == pole


@pytest.mark.parametrize("text", ["", "fast", "1 2", "±"])
def test_what_is_no_pole_is_refused(text):
    with pytest.raises(ValueError, match="no pole"):
        parse_pole(text)


def test_other_aircraft_are_said_to_be_others(report):
    craft = build("sbs", body={"mass": 22.0})
    changed = reproduce(craft)
    assert changed.remarks[0].startswith("Not the paper's aircraft: sbs.")
    heavier, usual = (own.tables["hover"].groups[""]["collective_deg"] for own in (changed, report))
    assert heavier.complete > 1.03 * usual.complete
    assert heavier.paper_reading == usual.paper_reading


def test_progress_is_reported():
    seen = []
    reproduce(progress=lambda done, total: seen.append((done, total)))
    assert [done for done, _ in seen] == list(range(1, len(seen) + 1))
    assert {total for _, total in seen} == {len(seen)}


# -- figures and page ------------------------------------------------------------------------------------------------


class Page(HTMLParser):
    """Elements of a page: whether all are closed in order, ids, links, texts of tables."""

    VOID = frozenset({"meta", "link", "br", "img", "hr"})

    def __init__(self, text):
        super().__init__()
        self.open, self.ids, self.links, self.elements, self.cells = [], [], [], [], []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attributes):
        self.handle_startendtag(tag, attributes)
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attributes):
        own = dict(attributes)
        assert len(own) == len(attributes), "an attribute is given twice"
        self.elements.append((tag, own))
        self.ids += [own["id"]] if "id" in own else []
        self.links += [value for key, value in own.items() if key in ("href", "src", "xlink:href")]

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, text):
        if self.open and self.open[-1] in ("td", "th"):
            self.cells.append(text.replace("−", "-"))


@pytest.fixture(scope="module")
def parsed(page):
    found = Page((page / PAGE).read_text(encoding="utf-8"))
    assert found.open == []
    return found


def test_figures_are_those_of_the_paper(report):
    assert [drawing.number for drawing in drawings(report)] == FIGURES


def test_all_figures_are_written(page):
    names = {f"figure_{number:02d}.{kind}" for number in FIGURES for kind in ("png", "svg")}
    assert {path.name for path in page.iterdir()} == names | {PAGE}
    for name in names:
        content = (page / name).read_bytes()
        assert content.startswith(b"\x89PNG") if name.endswith("png") else b"</svg>" in content


def test_page_holds_all_figures(parsed):
    figures = [own["id"] for tag, own in parsed.elements if tag == "figure"]
    assert figures == [f"figure_{number:02d}" for number in FIGURES]
    svgs = [own for tag, own in parsed.elements if tag == "svg"]
    assert [own["aria-label"].split(".")[0] for own in svgs] == [f"Figure {number}" for number in FIGURES]


def test_page_needs_nothing_else(page, parsed):
    assert all(link.startswith("#") for link in parsed.links)
    assert len(set(parsed.ids)) == len(parsed.ids)
    assert {link[1:] for link in parsed.links} <= set(parsed.ids)
    text = (page / PAGE).read_text(encoding="utf-8")
    assert set(re.findall(r"url\(([^)]*)\)", text)) <= {f"#{name}" for name in parsed.ids}
    assert not {"script", "link", "iframe", "object"} & {tag for tag, _ in parsed.elements}
    assert "@media print" in text
    assert text.startswith("<!DOCTYPE html>\n<html lang=")


def test_page_holds_every_printed_text_and_remark(report, parsed, page):
    for name, table in printed_tables().items():
        for rows in table.groups.values():
            for row in rows.values():
                texts = [row.cell.text, *(cell.text for cell in row.columns.values())]
                assert all(text in parsed.cells for text in texts if text), (name, row.label)
    text = (page / PAGE).read_text(encoding="utf-8")
    listed = re.findall(r"<li\b", text)
    shown = sum(len({entry.remark for entry in table.entries()} - {""}) for table in report.tables.values())
    contents_of_the_page = 6
    assert len(listed) == shown + len(report.remarks) + contents_of_the_page


def test_the_same_report_gives_the_same_files(report):
    drawing = next(drawing for drawing in drawings(report) if drawing.number == 4)  # has a hatch and clips
    first, second = drawing.encoded(), drawing.encoded()
    assert first == second
    assert b"<dc:date>" not in first["svg"]


def test_figures_leave_no_trace_in_matplotlib(report):
    """No window, no style, no figure kept."""
    import matplotlib

    for drawing in drawings(report):
        drawing.draw()
    drawing.encoded()
    assert "matplotlib.pyplot" not in sys.modules or not sys.modules["matplotlib.pyplot"].get_fignums()
    assert matplotlib.rcParams["svg.hashsalt"] is None


def test_ids_of_an_svg_become_its_own():
    svg = '<?xml version="1.0"?>\n<svg width="1"><metadata>x</metadata><style type="text/css">*{}</style>'
    svg += '<g id="a"/><use xlink:href="#a"/><path clip-path="url(#a)"/></svg>\n'
    expected = '<svg role="img" aria-label="L" width="1"><g id="f-a"/><use xlink:href="#f-a"/>'
    assert inline_svg(svg, "f", "L") == expected + '<path clip-path="url(#f-a)"/></svg>'


def test_page_without_figures(report):
    assert Page(page_text(report, [])).open == []


def test_names_of_aircraft_are_set_as_they_are(report):
    own = {**report.conditions["aircraft"]["paper_reading"], "name": HOSTILE, "airfoil": [HOSTILE]}
    conditions = {**report.conditions, "aircraft": {**report.conditions["aircraft"], "paper_reading": own}}
    remarks = (f"Not the paper's aircraft: {HOSTILE}. a_0", *report.remarks)
    page = page_text(dataclasses.replace(report, conditions=conditions, remarks=remarks), [])
    assert shown_as_text(page)
    assert Elements(page).text.count(HOSTILE) == 3
    assert "a<sub>0</sub>" in page  # our own words are set


def test_a_folder_that_cannot_be_is_one_line(report, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(ExportError, match="no folder can be made there"):
        save_page(report, tmp_path / "file" / "folder")


# -- the executable --------------------------------------------------------------------------------------------------


def test_run_reproduce(executed, data):
    result, folder = executed
    assert (result.returncode, result.stderr) == (0, "")
    lines = result.stdout.splitlines()
    assert max(map(len, lines)) <= 130
    for text in ("Table 1: ", "Table 5: ", "Inflow poles", "Hover trim", "Remarks", "Damping of the hub moments"):
        assert any(line.startswith(text) for line in lines), text
    row = next(line for line in lines if line.startswith("Short period"))
    assert row.split()[2:] == ["-7.26", "-4.008", "0.552*", "-7.297", "1.005", "[1]"]
    assert json.loads((folder / "all.json").read_text()) == data
    reported = f"written: {folder / 'made' / 'by it' / PAGE} and {2 * len(FIGURES)} figures"
    assert lines[-1] == reported


def test_without_a_folder_nothing_is_drawn(tmp_path):
    result = call("--aircraft", "sbs_paper", cwd=tmp_path)
    assert (result.returncode, result.stderr) == (0, "")
    assert "Not the paper's aircraft: sbs_paper." in result.stdout
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("option", ["--json", "--out"])
def test_a_bad_path_is_one_line(tmp_path, option):
    (tmp_path / "file").write_text("")
    result = call(option, tmp_path / "file" / "deeper")
    assert (result.returncode, result.stdout) == (1, "")
    assert result.stderr.count("\n") == 1
    assert "deeper" in result.stderr


def test_an_aircraft_that_there_is_not_is_one_line():
    result = call("--paper-aircraft", "helicopter")
    assert (result.returncode, result.stdout) == (1, "")
    assert result.stderr.count("\n") == 1
    assert "'helicopter'" in result.stderr
