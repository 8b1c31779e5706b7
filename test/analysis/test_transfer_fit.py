"""Fits of transfer functions to frequency responses, and the command `identify`."""

import contextlib
import csv
import json
import math

import numpy as np
import pytest
from test_identification import CHIRP, NATURAL, TICK, TIME, signals, through

from sbs_sim.analysis.frequency_response import FrequencyResponse
from sbs_sim.analysis.identification import identify
from sbs_sim.analysis.transfer_fit import cost, fit_transfer
from sbs_sim.commands import identify as command
from sbs_sim.errors import IdentificationError
from sbs_sim.flight.signal_file import read_signals

ASKED = np.geomspace(0.3, 30.0, 40)


def known(s):
    """A transfer function with a zero, a pair and a real pole, and a delay."""
    return 3.0 * (s + 2.0) / (s**2 + 2.4 * s + 16.0) / (s + 10.0) * np.exp(-0.07 * s)


def response(values, frequencies=ASKED):
    return FrequencyResponse(frequencies, values, np.unwrap(np.angle(values)), "u", "rad", "y", "rad")


def test_a_transfer_function_with_a_delay_is_found():
    found = fit_transfer(response(known(1j * ASKED)), 1, 3)
    assert found.numerator == pytest.approx([3.0, 6.0], rel=1e-6)
    assert found.denominator == pytest.approx([1.0, 12.4, 40.0, 160.0], rel=1e-6)
    assert found.delay == pytest.approx(0.07, rel=1e-6)
    assert found.cost < 1e-9
    assert found.zeros == pytest.approx([-2.0], rel=1e-6)
    assert found.at(ASKED) == pytest.approx(known(1j * ASKED), rel=1e-6)
    held = fit_transfer(response(known(1j * ASKED)), 1, 3, delay=0.07)
    assert held.delay == pytest.approx(0.07)
    assert held.poles[-1] == pytest.approx(-10.0, rel=1e-6)


def test_unstable_poles_and_integrators_are_found():
    s = 1j * ASKED
    found = fit_transfer(response(2.0 * (s + 1.0) / (s * (s - 0.8))), 1, 2, delay=0.0, integrators=1)
    assert found.denominator == pytest.approx([1.0, -0.8, 0.0], abs=1e-6)
    assert found.numerator == pytest.approx([2.0, 2.0], rel=1e-6)


def test_the_cost_is_the_one_of_tischler():
    """One dB off everywhere costs 20 at full coherence, and so do 7.57 deg."""
    ones, full = np.ones(10, complex), np.ones(10)
    weight = (1.58 * (1.0 - math.exp(-1.0))) ** 2
    assert cost(ones * 10.0**0.05, ones, full) == pytest.approx(20.0 * weight, rel=1e-6)
    assert cost(ones * np.exp(1j * np.radians(7.57)), ones, full) == pytest.approx(20.0 * weight, rel=1e-3)
    assert cost(ones * 10.0**0.05, ones, 0.6 * full) / weight == pytest.approx(
        20.0 * (1.0 - math.exp(-0.6)) ** 2 / (1.0 - math.exp(-1.0)) ** 2
    )


def test_a_fit_with_too_few_frequencies_or_too_many_zeros_is_refused():
    with pytest.raises(IdentificationError, match="5 valid frequencies for 6 unknowns"):
        fit_transfer(response(known(1j * ASKED[:5]), ASKED[:5]), 1, 3)
    with pytest.raises(IdentificationError, match="zeros = 3: allowed are integers from 0 to 2"):
        fit_transfer(response(known(1j * ASKED)), 3, 2)


def noisy():
    """Input and output of the second-order system, with noise."""
    driven = CHIRP.at(TIME)
    return driven, through(driven) + 0.02 * np.random.default_rng(2).standard_normal(len(TIME))


def test_a_fit_to_an_identified_response_finds_the_system():
    driven, output = noisy()
    asked = np.geomspace(0.5, 12.0, 30)
    found = identify(signals(u=driven, y=output), ["u"], ["y"], frequencies=asked)["u", "y"]
    fit = fit_transfer(found, 0, 2, delay=0.0)
    assert abs(fit.poles[0]) == pytest.approx(NATURAL, rel=0.02)
    assert -fit.poles[0].real / NATURAL == pytest.approx(0.5, abs=0.02)
    assert fit.cost < 5.0
    assert fit.range == found.valid_range


# -- the command -----------------------------------------------------------------------------------------------------


@pytest.fixture
def table(tmp_path):
    """CSV file with the input in degrees."""
    driven, output = noisy()
    path = tmp_path / "flight.csv"
    with path.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["time [s]", "stick [deg]", "q [rad/s]"])
        writer.writerows(zip(TIME, np.degrees(driven), output, strict=True))
    return path


def run(monkeypatch, *arguments):
    monkeypatch.setattr("sys.argv", ["identify", *map(str, arguments)])
    return command.main()


def test_a_table_of_signals_is_identified(monkeypatch, capsys, tmp_path, table):
    page = tmp_path / "page"
    wanted = ("--response", "stick:q", "--held", "stick", "--low", 0.5, "--high", 12, "--points", 12)
    assert run(monkeypatch, table, *wanted, "--fit", "0/2", "--fit-delay", 0, "--out", page) == 0
    shown = capsys.readouterr().out
    assert "q by stick [rad/s / rad]" in shown
    assert "valid from 0.5 to 12 rad/s" in shown
    assert "zeros none, poles -1." in shown
    with (page / "responses.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 12
    assert float(rows[0]["gain [SI]"]) == pytest.approx(1.0, abs=0.05)
    saved = json.loads((page / "responses.json").read_text())["responses"][0]
    assert saved["fits"][0]["denominator"][2] == pytest.approx(NATURAL**2, rel=0.05)
    assert (page / "index.html").read_text().count("<svg") == 2
    assert {path.suffix for path in page.iterdir()} == {".png", ".svg", ".csv", ".json", ".html"}


def test_a_real_log_is_identified(monkeypatch, capsys):
    """The steps of the controls in it are short: few frequencies are valid, and the printed error says how good."""
    log = "bags/hover_step.mcap"
    assert run(monkeypatch, log, "--low", 5, "--high", 40, "--points", 6, "--windows", 2.5) == 0
    shown = capsys.readouterr().out
    assert shown.startswith("hover_step.mcap, 0 to 4.0")
    for text in ("w by collective", "p by lateral_cyclic", "q by longitudinal_cyclic", "r by differential"):
        assert text in shown


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (("--response", "stick"), "allowed is INPUT:OUTPUT"),
        (("--response", "stick:r"), "outputs = 'r': allowed are stick, q"),
        (("--response", "stick:q", "--linear"), "a CSV file has no aircraft"),
        (("--response", "stick:q", "--from", "50", "--to", "40"), "from 50 to 40 s: allowed are 0 to 90 s"),
        ((), "--response INPUT:OUTPUT is needed"),
    ],
)
def test_what_is_not_there_is_one_line(monkeypatch, capsys, table, arguments, text):
    code = None
    with contextlib.suppress(SystemExit):  # of argparse
        code = run(monkeypatch, table, *arguments)
    assert code in (None, 1)
    assert text in capsys.readouterr().err


@pytest.mark.parametrize(
    ("content", "text"),
    [
        ("", "is empty"),
        ("t,u,y\n0,0,0\n", "line 1: allowed are time"),
        ("time [s],u,y\n0,0,x\n", "line 2: allowed are 3 finite numbers"),
        ("time [s],u,y\n0,0\n", "line 2: allowed are 3 finite numbers"),
        ("time [s],u,y\n" + "".join(f"{i * i},0,0\n" for i in range(80)), "allowed are equal intervals"),
        ("time [s],u,y\n0,0,0\n", "1 samples: allowed are at least 64"),
    ],
)
def test_a_bad_table_is_refused(tmp_path, content, text):
    path = tmp_path / "bad.csv"
    path.write_text(content)
    with pytest.raises(IdentificationError, match=text):
        read_signals(path)


def test_degrees_of_a_table_are_radians(table):
    found = read_signals(table)
    assert found.tick == pytest.approx(TICK)
    assert found.units == {"stick": "rad", "q": "rad/s"}
    assert np.abs(found.values["stick"]).max() == pytest.approx(1.0, abs=0.01)
