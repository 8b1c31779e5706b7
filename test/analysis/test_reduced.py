"""Reduced models against their bounds and limits, their files, and frequency responses as files."""

import csv
import json
import math
import re
import shutil
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import control
import numpy as np
import pytest
from scipy.io import loadmat

from sbs_sim import linearize
from sbs_sim.analysis.bode_plots import save_responses
from sbs_sim.analysis.export import c_header
from sbs_sim.analysis.reduced import (
    WEIGHTS,
    Reduction,
    _Split,
    balanced,
    kept_sets,
    mismatches,
    reductions,
    residualised,
    suggested,
    unnoticed,
)
from sbs_sim.errors import ExportError, LinearizationError

LINEARIZE = Path(__file__).resolve().parents[2] / "install" / "sbs_sim" / "lib" / "sbs_sim" / "linearize"


@pytest.fixture(scope="module")
def model(sbs):
    return linearize(sbs, airspeed=10.0)


def responses(model, frequencies):
    shifted = 1j * frequencies[:, None, None] * np.eye(len(model.a)) - model.a
    return model.c @ np.linalg.solve(shifted, np.repeat(model.b[None], len(frequencies), 0).astype(complex)) + model.d


def test_sets_are_those_of_the_literature(model):
    """8 to 18 states for two rotors: body, mean inflow, tilt of the planes, all inflow, tilt and inflow."""
    assert {name: len(states) for name, states in kept_sets(model).items()} == {
        "body": 8,
        "uniform inflow": 10,
        "flap": 12,
        "inflow": 14,
        "flap and inflow": 18,
    }


def test_states_without_cyclic_inflow_have_fewer_sets(sbs):
    assert "inflow" not in kept_sets(linearize(sbs, cyclic_inflow=False))


@pytest.mark.parametrize("name", ["body", "flap", "flap and inflow"])
def test_residualised_models_settle_alike(model, name):
    """Without an input that changes, x' = 0 has the same outputs by controls: the gains at zero frequency are equal."""
    reduced = residualised(model, name)
    still = [own.d - own.c @ np.linalg.solve(own.a, own.b) for own in (model, reduced)]
    np.testing.assert_allclose(still[1], still[0], rtol=1e-6, atol=1e-6 * np.abs(still[0]).max())


def test_body_is_the_quasi_static_model(model):
    np.testing.assert_array_equal(residualised(model, "body").a, model.quasi_static().a)


def test_all_states_are_the_model_itself(model):
    frequencies = np.geomspace(0.01, 300.0, 30)
    full, same = (responses(own, frequencies) for own in (model, balanced(model, len(model.a))))
    assert (np.abs(same - full) <= 1e-5 * np.abs(full) + 1e-6 * np.abs(full).max(axis=0)).all()
    assert max(own.cost for own in mismatches(model, balanced(model, len(model.a)))) < 1e-6


@pytest.mark.parametrize("order", [6, 8, 14, 20])
def test_truncation_keeps_within_its_bound(model, order):
    """Twice the sum of what is left out (K. Glover, Int. J. Control 39 (6), 1984), of the largest singular value."""
    reduced = balanced(model, order)
    unstable = int((model.poles.real > 0.0).sum())
    bound = 2.0 * reduced.hankel[order - unstable :].sum()
    frequencies = np.geomspace(0.001, 1000.0, 200)
    weights = np.array([WEIGHTS.get(name, 0.0) for name in model.output_names])[:, None]
    errors = weights * (responses(model, frequencies) - responses(reduced, frequencies))
    assert 0.0 < np.linalg.norm(errors, 2, axis=(1, 2)).max() <= bound * (1.0 + 1e-6)


def test_unstable_poles_stay(model):
    grow = model.poles[model.poles.real > 0.0]
    kept = balanced(model, 8).poles
    assert len(grow) == (kept.real > 0.0).sum()
    for pole in grow:
        assert np.abs(kept - pole).min() < 1e-6


def test_hankel_value_of_a_first_order_lag():
    """That of g / (s + a) is g / 2a."""
    lag = SimpleNamespace(
        a=np.array([[-2.0]]), b=np.array([[3.0]]), c=np.array([[1.0]]), steps=np.array([0.7]), output_names=("u",)
    )
    assert _Split.of(lag).hankel == pytest.approx([0.75])


@pytest.mark.parametrize("order", [0, 39])
def test_orders_out_of_range_are_refused(model, order):
    least = int((model.poles.real > 0.0).sum())
    with pytest.raises(LinearizationError, match=f"order = {order}: allowed are integers from {least} to 38"):
        balanced(model, order)


def test_unknown_sets_are_refused(model):
    with pytest.raises(LinearizationError, match="name = 'lag': allowed are body, uniform inflow, "):
        residualised(model, "lag")


def test_envelopes_are_narrowest_where_pilots_are():
    """They hold zero error, and are narrower at 2 rad/s than at 0.2 and 20 rad/s."""
    wide, narrow, fast = (unnoticed(np.array([frequency])) for frequency in (0.2, 2.0, 20.0))
    for what in ("gain", "phase"):
        sizes = [float((found[f"upper {what}"] - found[f"lower {what}"])[0]) for found in (wide, narrow, fast)]
        assert sizes[1] < min(sizes[0], sizes[2])
        for found in (wide, narrow, fast):
            assert found[f"lower {what}"][0] < 0.0 < found[f"upper {what}"][0]


def test_suggestion_is_the_smallest_that_stays_unnoticed(sbs):
    """At 20 m/s rotors that settle at once are noticed; the tilt of their planes is what is missing."""
    found = reductions(linearize(sbs, airspeed=20.0), 2.667, orders=(18,))
    best = suggested(found)
    assert isinstance(best, Reduction)
    assert not any(own.is_unnoticed for own in found if own.model.order < best.model.order)
    assert (best.model.name, best.model.order) == ("flap", 12)
    by_name = {own.model.name: own for own in found}
    assert by_name["flap and inflow"].cost < by_name["flap"].cost < by_name["body"].cost
    assert by_name["flap and inflow"].step_error < by_name["flap"].step_error < by_name["body"].step_error
    assert suggested([by_name["body"]]) is None


# -- files -----------------------------------------------------------------------------------------------------------


def test_files_hold_the_model(model, tmp_path):
    reduced = residualised(model, "flap")
    for name in ("m.npz", "m.mat", "m.json"):
        reduced.save(tmp_path / name)
    np.testing.assert_array_equal(np.load(tmp_path / "m.npz")["a"], reduced.a)
    np.testing.assert_array_equal(loadmat(tmp_path / "m.mat")["b"], reduced.b)
    assert json.loads((tmp_path / "m.json").read_text())["state_names"] == list(reduced.state_names)
    theirs = reduced.to_control()
    assert isinstance(theirs, control.StateSpace)
    assert theirs.state_labels == list(reduced.state_names)
    with pytest.raises(ExportError, match=r"allowed are names that end in \.npz, \.mat, \.json, \.h"):
        reduced.save(tmp_path / "m.csv")


def matrix_of(header, name):
    """A matrix read back from a header."""
    body = re.search(rf"sbs_model_{name}\[SBS_MODEL_\w+\]\[SBS_MODEL_\w+\] = {{\n(.*?)\n}};", header, re.DOTALL).group(
        1
    )
    return np.array([[float(value) for value in row.strip(" {},").split(", ")] for row in body.splitlines()])


def test_header_has_every_digit(model, tmp_path):
    model.save(tmp_path / "model.h")
    header = (tmp_path / "model.h").read_text()
    for name in "abcd":
        np.testing.assert_array_equal(matrix_of(header, name), getattr(model, name))
    assert "#define SBS_MODEL_STATES 38" in header
    assert " * 3 theta [rad]" in header


@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")
def test_header_compiles(model, tmp_path):
    residualised(model, "body").save(tmp_path / "model.h")
    (tmp_path / "main.c").write_text(
        '#include <stdio.h>\n#include "model.h"\n'
        'int main(void) { printf("%.17g %d %g %g %g", sbs_model_a[2][3], SBS_MODEL_STATES, sbs_model_b[0][0],'
        " sbs_model_c[0][0], sbs_model_d[0][0]); return 0; }\n"
    )
    program = tmp_path / "main"
    arguments = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-o", program, tmp_path / "main.c"]
    subprocess.run([shutil.which("cc"), *arguments], check=True, timeout=60)
    printed = subprocess.run([program], capture_output=True, text=True, check=True, timeout=10).stdout.split()
    assert float(printed[0]) == residualised(model, "body").a[2, 3]
    assert printed[1] == "8"


def test_names_cannot_end_a_comment(model):
    reduced = residualised(model, "body")
    names = ("*/ int evil; /*", *reduced.control_names[1:])
    values = {field: getattr(reduced, field) for field in reduced.__dataclass_fields__} | {"control_names": names}
    header = c_header(SimpleNamespace(**values))
    assert "evil" in header
    assert "*/ int" not in header


def test_responses_go_to_files(model, tmp_path):
    found = [
        model.frequency_response("longitudinal_cyclic", name, np.geomspace(0.1, 50.0, 40)) for name in ("theta", "q")
    ]
    written = save_responses(found, tmp_path)
    names = {path.name for path in written}
    assert names == {"bode.png", "bode.svg", "nichols.png", "nichols.svg", "responses.csv", "responses.json"}
    with (tmp_path / "responses.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 80
    assert float(rows[40]["gain [SI]"]) == found[1].gain[0]
    read = json.loads((tmp_path / "responses.json").read_text())["responses"]
    assert read[0]["phase"] == found[0].phase.tolist()
    assert math.isclose(read[1]["frequency"][-1], 50.0)


def linearized(*arguments):
    command = [sys.executable, str(LINEARIZE), *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)


def test_command_prints_responses_and_reductions(tmp_path):
    model = tmp_path / "small.h"
    bode = ("--bode", "longitudinal_cyclic:theta", "--delay", 0.02, "--bode-out", tmp_path / "bode")
    result = linearized("--airspeed", 20, "--reduce", "--reduced-out", model, *bode)
    assert (result.returncode, result.stderr) == (0, "")
    assert "theta [rad] by longitudinal_cyclic [rad]" in result.stdout
    assert re.search(r"^flap +12 .* yes +\S+ +suggested$", result.stdout, re.MULTILINE)
    assert "#define SBS_MODEL_STATES 12" in model.read_text()
    assert len(list((tmp_path / "bode").iterdir())) == 6


def test_command_prints_vibrations(tmp_path):
    """Mean and 3/rev of both rotors, a point, and the sidebands of a response; the model goes to a file."""
    model = tmp_path / "harmonics.mat"
    options = ("--harmonics", 1, "--at", 0.3, 0.0, -0.2, "--harmonics-out", model)
    result = linearized("--airspeed", 20, *options, "--bode", "collective:hub_force_z(1)", "--actuator", 40, 0.7)
    assert (result.returncode, result.stderr) == (0, "")
    assert "harmonic model: 1 harmonics of 753.98 rad/s, 114 states" in result.stdout
    assert re.search(r"^ +unit +mean +3/rev +phase \[deg\]$", result.stdout, re.MULTILINE)
    assert re.search(r"^specific_force_z\(point 1\) +m/s\^2 +-9\.", result.stdout, re.MULTILINE)
    assert "at + 754 rad/s [dB]" in result.stdout
    assert loadmat(model)["a"].shape == (114, 114)


@pytest.mark.parametrize(
    ("arguments", "code", "text"),
    [
        (("--at", 0, 0, 0), 2, "--at needs --harmonics N"),
        (("--harmonics", 200), 1, "harmonics = 200: allowed are integers from 0 to"),
        (("--actuator", 0, 0.7, "--bode", "collective:w"), 1, "actuator.frequency = 0.0: allowed are"),
        (("--bode", "theta"), 2, "--bode 'theta': allowed is CONTROL:OUTPUT"),
        (("--bode-out", "here"), 2, "--bode-out needs --bode CONTROL:OUTPUT"),
        (("--reduced-out", "m.h"), 2, "--reduced-out needs --reduce"),
        (("--reduce", "--reduced-out", "m.csv"), 1, "allowed are names that end in .npz, .mat, .json, .h"),
        (("--bode", "throttle:theta"), 1, "input = 'throttle': allowed are collective, "),
    ],
)
def test_command_refuses_in_one_line(arguments, code, text):
    result = linearized(*arguments)
    assert result.returncode == code
    assert text in result.stderr.splitlines()[-1]
