"""The notebooks of docs/notebooks: their cells run one after the other, and give what the text says."""

import contextlib
import io
import json
from pathlib import Path

import matplotlib
import numpy as np
import pytest

NOTEBOOKS = Path(__file__).resolve().parents[2] / "docs" / "notebooks"
NAMES = sorted(path.stem for path in NOTEBOOKS.glob("*.ipynb"))


def cells(name):
    return json.loads((NOTEBOOKS / f"{name}.ipynb").read_text(encoding="utf-8"))["cells"]


@pytest.fixture(scope="module")
def run():
    """Executes the code cells of a notebook in one namespace, which it returns with what was printed."""
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    def executed(name):
        names, printed = {}, io.StringIO()
        with contextlib.redirect_stdout(printed):
            for cell in cells(name):
                if cell["cell_type"] == "code":
                    exec(compile("".join(cell["source"]), f"{name} {cell['id']}", "exec"), names)
        plt.close("all")
        return names, printed.getvalue()

    return executed


def test_there_are_three():
    assert NAMES == ["closed_loop", "first_trim", "flying_qualities"]


@pytest.mark.parametrize("name", NAMES)
def test_they_have_no_results_in_them(name):
    """Nothing that is run elsewhere is kept; each begins with its title, and each cell has its own id."""
    found = cells(name)
    assert "".join(found[0]["source"]).startswith("# ")
    assert len({cell["id"] for cell in found}) == len(found)
    assert all(cell["outputs"] == [] for cell in found if cell["cell_type"] == "code")


def test_first_trim(run):
    names, printed = run("first_trim")
    assert names["power"].argmin() not in (0, len(names["power"]) - 1)
    assert names["difference"] < 0.05 * np.ptp(names["flight"]["w"])
    assert "phugoid" in printed


def test_flying_qualities(run):
    names, printed = run("flying_qualities")
    assert names["found"][1] < names["found"][0]
    assert names["best"].model.name == "flap"
    assert (names["shake"][3:] >= 0.0).all()
    assert names["shake"].max() > 0.01
    assert "pitch_quickness" in printed


def test_closed_loop(run):
    names, _ = run("closed_loop")
    assert names["model"].poles.real.max() > 0.1
    assert names["loop"].is_stable
    assert names["augmented"]["pitch_bandwidth"][0].level < names["bare"]["pitch_bandwidth"][0].level
    assert names["hold"].rejection("heading").bandwidth > 0.1
    assert names["away"] < 1.0
    assert np.abs(names["held"]["phi"]).max() < np.abs(names["free"]["phi"]).max()
