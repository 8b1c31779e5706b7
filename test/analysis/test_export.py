"""Linear models and trims as files and for other programs: everything arrives, what cannot be written is reported."""

import json
import math
import os
import subprocess
import sys

import numpy as np
import pytest
import scipy.io

from sbs_sim import linearize, trim
from sbs_sim.errors import ExportError
from sbs_sim.model.state import CONTROL_NAMES
from sbs_sim.output.files import write
from sbs_sim.output.json_text import plain, to_json


@pytest.fixture(scope="module", params=["averaged", "paper"])
def model(request, sbs):
    return linearize(sbs, airspeed=10.0, method=request.param)


MATRICES = ("a", "b", "c", "d", "steps", "spread", "kinematics", "poles")
NAMES = ("state_names", "state_units", "control_names", "control_units", "output_names", "output_units")


# -- files -----------------------------------------------------------------------------------------------------------


def test_npz_round_trip(model, tmp_path):
    model.save(tmp_path / "model.npz")
    with np.load(tmp_path / "model.npz") as file:
        data = dict(file)
    for name in MATRICES:
        assert np.array_equal(data[name], getattr(model, name))
    for name in NAMES:
        assert tuple(data[name]) == getattr(model, name)
    assert data["method"] == model.method
    assert data["azimuth_spread"] == model.azimuth_spread
    assert data["parameter_hash"] == model.parameter_hash
    assert data["trim.condition.airspeed"] == 10.0
    for name in ("controls", "swashplate", "state", "thrust", "torque", "power", "pitch", "roll", "residual"):
        assert np.array_equal(data[f"trim.{name}"], getattr(model.trim, name))
    assert tuple(data["trim.state_names"]) == model.trim.state_names
    assert data["trim.beyond_limits"].tolist() == []
    assert tuple(data["mode_names"]) == tuple(mode.name for mode in model.modes)
    assert data["mode_poles"].tolist() == [mode.pole for mode in model.modes]
    assert data["mode_participation"].shape == (len(model.modes), 38)
    blocks = {name.removeprefix("blocks."): value for name, value in data.items() if name.startswith("blocks.")}
    assert blocks.keys() == model.blocks.keys()
    assert all(np.array_equal(value, model.blocks[name]) for name, value in blocks.items())


def test_mat_round_trip(model, tmp_path):
    model.save(tmp_path / "model.mat")
    data = scipy.io.loadmat(tmp_path / "model.mat", simplify_cells=True)
    for name in MATRICES:
        assert np.array_equal(data[name], getattr(model, name))
    for name in NAMES:
        assert tuple(data[name]) == getattr(model, name)
    assert data["trim"]["condition"]["airspeed"] == 10.0
    assert np.array_equal(data["trim"]["state"], model.trim.state)
    assert tuple(data["mode_names"]) == tuple(mode.name for mode in model.modes)
    if model.method == "paper":
        assert np.array_equal(data["blocks"]["A_B_lambda"], model.blocks["A_B-lambda"])
        assert len(data["blocks"]) == len(model.blocks)


def test_json_round_trip(model, tmp_path):
    model.save(tmp_path / "model.json")
    data = json.loads((tmp_path / "model.json").read_text(), parse_constant=pytest.fail)
    for name in MATRICES[:-1]:
        assert data[name] == getattr(model, name).tolist()
    for name in NAMES:
        assert tuple(data[name]) == getattr(model, name)
    assert [complex(pole["real"], pole["imag"]) for pole in data["poles"]] == model.poles.tolist()
    for stored, mode in zip(data["modes"], model.modes, strict=True):
        assert (stored["name"], complex(stored["real"], stored["imag"])) == (mode.name, mode.pole)
        assert stored["participation"] == mode.participation.tolist()
        for name in ("period", "time_to_half", "time_to_double"):
            time = getattr(mode, name)
            assert stored[name] == (time if math.isfinite(time) else None)
    assert {name: np.array(block).tolist() for name, block in model.blocks.items()} == data["blocks"]
    assert data == model.to_dict()


def test_a_reduced_model_can_be_saved(model, tmp_path):
    reduced = model.quasi_static()
    for suffix in (".npz", ".mat", ".json"):
        reduced.save(tmp_path / f"model{suffix}")
    assert np.array_equal(np.load(tmp_path / "model.npz")["a"], reduced.a)


def test_the_suffix_may_be_in_capitals_and_the_path_a_text(model, tmp_path):
    model.save(f"{tmp_path}/MODEL.NPZ")
    assert np.array_equal(np.load(tmp_path / "MODEL.NPZ")["a"], model.a)


def test_an_older_file_is_replaced(model, tmp_path):
    path = tmp_path / "model.json"
    path.write_text("x" * 10_000_000)
    model.save(path)
    assert json.loads(path.read_text())["method"] == model.method


REFUSED = {
    "unknown suffix": ("model.csv", "allowed are names that end in .npz, .mat, .json"),
    "no suffix": ("model", "allowed are names that end in .npz, .mat, .json"),
    "no folder": ("nowhere/model.npz", "cannot be written: there is no folder "),
    "a file for a folder": ("file.json/model.npz", "cannot be written: Not a directory"),
    "a folder for a file": ("folder.json", "cannot be written: Is a directory"),
    "a name too long": ("n" * 300 + ".mat", "cannot be written: File name too long"),
    "a name of two lines": ("a\x85b.x", "allowed are names that end in "),
    "a name that cannot be": ("a\0b.mat", "cannot be written: embedded null byte"),
}


@pytest.mark.parametrize(("name", "reason"), REFUSED.values(), ids=REFUSED)
def test_a_file_that_cannot_be_written_is_reported_in_one_line(model, tmp_path, name, reason):
    (tmp_path / "file.json").write_text("")
    (tmp_path / "folder.json").mkdir()
    with pytest.raises(ExportError) as caught:
        model.save(tmp_path / name)
    shown = str(tmp_path / name).replace("\0", "\\x00").replace("\x85", "\\x85")
    assert str(caught.value).startswith(f"{shown}: {reason}")
    assert len(str(caught.value).splitlines()) == 1


@pytest.mark.skipif(os.geteuid() == 0, reason="the superuser may write everywhere")
def test_a_folder_that_may_not_be_written_to(model, tmp_path):
    tmp_path.chmod(0o500)
    with pytest.raises(ExportError, match=r"model\.npz: cannot be written: Permission denied"):
        model.save(tmp_path / "model.npz")


def test_a_full_disk_is_reported():
    with pytest.raises(ExportError, match="/dev/full: cannot be written: No space left on device"):
        write("/dev/full", "text")


@pytest.mark.parametrize("before", [None, "old"])
def test_a_file_is_written_completely_or_not_at_all(tmp_path, before):
    """On a disk that takes a part of it only."""
    path = tmp_path / "a.json"
    if before is not None:
        path.write_text(before)
    code = f"""
import resource
from sbs_sim.output.files import write
resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))
write({str(path)!r}, "x" * 2000)
"""
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=False)
    assert found.stderr.splitlines()[-1].endswith(f"ExportError: {path}: cannot be written: File too large")
    assert {item.name: item.read_text() for item in tmp_path.iterdir()} == (
        {} if before is None else {"a.json": before}
    )


def test_a_replaced_file_keeps_its_path_and_its_mode(tmp_path):
    """Whoever linked to it or shared it with a group goes on reading it."""
    path, link = tmp_path / "a.json", tmp_path / "link.json"
    path.write_text("old")
    path.chmod(0o640)
    link.symlink_to(path)
    write(link, "new")
    assert link.is_symlink()
    assert path.read_text() == "new"
    assert path.stat().st_mode & 0o777 == 0o640


# -- python-control --------------------------------------------------------------------------------------------------


def test_python_control_gets_matrices_and_names(model):
    system = model.to_control()
    assert all(np.array_equal(getattr(system, name.upper()), getattr(model, name)) for name in "abcd")
    assert system.state_labels == list(model.state_names)
    assert system.input_labels == list(model.control_names)
    assert system.output_labels == list(model.output_names)


def test_python_control_computes_with_it(model):
    system = model.to_control()
    s = 2.0j
    expected = model.c @ np.linalg.solve(s * np.eye(38) - model.a, model.b) + model.d
    assert system(s) == pytest.approx(expected, rel=1e-9, abs=1e-9 * np.abs(expected).max())
    assert np.sort_complex(system.poles()) == pytest.approx(np.sort_complex(model.poles), rel=1e-6)


def test_without_python_control_the_message_says_how_to_get_it(model, monkeypatch):
    monkeypatch.setitem(sys.modules, "control", None)
    with pytest.raises(ExportError, match="python-control is not installed; remedy: pip install control"):
        model.to_control()


# -- mappings for JSON -----------------------------------------------------------------------------------------------


def test_a_trim_as_a_mapping(sbs):
    point = trim(sbs, airspeed=4.0, turn_rate=0.1, lead_lag=False)
    data = json.loads(to_json(point.to_dict()))
    assert data == point.to_dict()
    assert data["condition"] == {"airspeed": 4.0, "climb_rate": 0.0, "sideslip": 0.0, "turn_rate": 0.1}
    assert data["lead_lag"] is False
    assert data["control_names"] == list(CONTROL_NAMES)
    assert data["controls"] == point.controls.tolist()
    assert data["swashplate"] == point.swashplate.tolist()
    assert dict(zip(data["state_names"], data["state"], strict=True))["u"] == point.state[0]
    assert (data["method"], data["iterations"], data["residual"]) == ("newton", point.iterations, point.residual)


def test_what_json_does_not_know_is_made_plain():
    values = {
        "array": np.array([[1.0, np.nan], [np.inf, 2.0]]),
        "number": np.float64(3.0),
        "whole": np.int64(4),
        "choice": np.bool_(True),
        "pair": (1, -math.inf),
        "pole": 1.0 - 2.0j,
        "poles": np.array([1j]),
        "text": "x",
        "none": None,
    }
    assert json.loads(to_json(values)) == {
        "array": [[1.0, None], [None, 2.0]],
        "number": 3.0,
        "whole": 4,
        "choice": True,
        "pair": [1, None],
        "pole": {"real": 1.0, "imag": -2.0},
        "poles": [{"real": 0.0, "imag": 1.0}],
        "text": "x",
        "none": None,
    }
    assert type(plain(np.float64(1.0))) is float
