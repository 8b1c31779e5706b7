"""Monte Carlo: what is scattered, what is reported of it, and the command `batch`."""

import csv
import io
import json
import math

import numpy as np
import pytest
from test_commands import call, failure, output

from sbs_sim import Case, Controller, Sensors, simulate, simulate_batch
from sbs_sim.analysis.monte_carlo import OUTPUTS, SHARES, batch_to_csv, batch_to_dict, gust_cases, quantities
from sbs_sim.analysis.monte_carlo_plots import SHOWN, batch_figure
from sbs_sim.commands.batch import make_parser
from sbs_sim.commands.common import UsageError
from sbs_sim.commands.controller_arguments import controller
from sbs_sim.errors import AircraftError, BatchError, PilotError, SimulationError
from sbs_sim.flight.trim_point import Fidelity, TrimCondition
from sbs_sim.flight.trimmed_state import trimmed_state
from sbs_sim.model.frames import euler_to_quaternion
from sbs_sim.model.state import ATTITUDE
from sbs_sim.output.json_text import to_json

SPREAD = {"body.mass": 0.05, "rotors.blade_mass": 0.02}


@pytest.fixture(scope="module")
def batch(sbs, hover):
    """Three flights, and one that cannot begin."""
    cases = gust_cases(sbs, 3, {"airspeed": 12.0}, turbulence=1.5, spread=SPREAD)
    light = Case(sbs, hover, changes={"body.mass": 0.1, "rotors.blade_mass": 0.16})
    return simulate_batch([*cases, light], 0.3, every=5, outputs=OUTPUTS)


def test_a_flight_is_the_same_whatever_the_number_of_flights(sbs):
    few = gust_cases(sbs, 3, {"airspeed": 12.0}, turbulence=1.5, seed=4, spread=SPREAD)
    many = gust_cases(sbs, 5, {"airspeed": 12.0}, turbulence=1.5, seed=4, spread=SPREAD)
    other = gust_cases(sbs, 3, {"airspeed": 12.0}, turbulence=1.5, seed=5, spread=SPREAD)
    for one, two, three in zip(few, many, other, strict=False):
        assert (one.wind, one.changes) == (two.wind, two.changes)
        assert one.wind.turbulence_seed != three.wind.turbulence_seed
        assert one.changes["body.mass"] != three.changes["body.mass"]


def test_values_are_scattered_normally_around_those_of_the_file(sbs):
    count = 4000
    cases = gust_cases(sbs, count, {}, turbulence=1.0, spread=SPREAD)
    for path, centre in (("body.mass", sbs.body.mass), ("rotors.blade_mass", sbs.rotors[0].blade_mass)):
        drawn = (np.array([case.changes[path] for case in cases]) / centre - 1.0) / SPREAD[path]
        assert abs(drawn.mean()) < 5.0 / math.sqrt(count)
        assert drawn.std() == pytest.approx(1.0, abs=5.0 / math.sqrt(2 * count))
        assert (abs(drawn) < 1.0).mean() == pytest.approx(math.erf(math.sqrt(0.5)), abs=5 * 0.47 / math.sqrt(count))
    first, second = (np.array([case.changes[path] for case in cases]) for path in SPREAD)
    assert abs(np.corrcoef(first, second)[0, 1]) < 5.0 / math.sqrt(count)
    assert len({case.wind.turbulence_seed for case in cases}) == count


def test_the_command_says_in_how_many_flights_the_model_does_not_hold(tmp_path):
    files = ("--csv", tmp_path / "f.csv", "--json", tmp_path / "f.json")
    text = output("batch", "--flights", 2, "--duration", 0.2, "--climb-rate", -7, "--turbulence", 0, *files)
    line = "vortex ring state, where momentum theory does not hold"
    assert f"outside the model's validity in 2 flights: MR1, MR2: {line}\n" in text
    assert all(row["warnings"].startswith(f"MR1: {line}") for row in csv.DictReader((tmp_path / "f.csv").open()))
    flights = json.loads((tmp_path / "f.json").read_text())["flights"]
    assert all(flight["warnings"][0] == f"MR1: {line}" for flight in flights)


def test_the_field_passes_with_the_airspeed_and_never_stops(sbs):
    fast, hovering = (gust_cases(sbs, 1, {"airspeed": speed}, turbulence=1.0)[0].wind for speed in (-12.0, 0.0))
    assert (fast.turbulence_airspeed, hovering.turbulence_airspeed) == (12.0, 5.0)
    (case,) = gust_cases(sbs, 1, TrimCondition(airspeed=-12.0, sideslip=0.5), turbulence=1.0)
    assert (case.wind.turbulence_airspeed, case.wind.turbulence_direction) == (12.0, 0.5)
    assert case.start == TrimCondition(airspeed=-12.0, sideslip=0.5)


@pytest.mark.parametrize(
    ("error", "options", "line"),
    [
        (BatchError, {"flights": 0}, "flights = 0: allowed are integers from 1 to 1000000"),
        (BatchError, {"seed": -1}, "seed = -1: allowed are integers from 0 to 18446744073709551615"),
        (BatchError, {"spread": {"body.mass": 2.0}}, "spread of body.mass = 2.0: allowed are 0 to 1"),
        (BatchError, {"spread": {"body.mass": "x"}}, "spread of body.mass = 'x': allowed are 0 to 1"),
        (BatchError, {"spread": {"rotors.hub": 0.1}}, "spread of rotors.hub: its value "),
        (BatchError, {"spread": {"name": 0.1}}, "spread of name: its value 'sbs' must be one number"),
        (BatchError, {"spread": {"rotors.hub[0]": 0.1}}, "spread of rotors.hub[0]: it is relative to its value, "),
        (AircraftError, {"spread": {"body.mas": 0.1}}, "body.mas: unknown key"),
        (SimulationError, {"turbulence": -1.0}, "turbulence_intensity.x = -1.0: allowed are 0 to 100 m/s"),
        (SimulationError, {"length": math.nan}, "turbulence_length = nan: allowed are 0.1 to 10000 m"),
    ],
)
def test_bad_values_are_refused_in_one_line(sbs, error, options, line):
    with pytest.raises(error) as caught:
        gust_cases(sbs, **{"flights": 1, "condition": {}, "turbulence": 1.0, **options})
    assert str(caught.value).startswith(line)


def test_quantities_are_what_a_person_reads(sbs, hover):
    state = trimmed_state(sbs, hover, position=(3.0, -2.0, -50.0))
    state[ATTITUDE : ATTITUDE + 4] = euler_to_quaternion(*np.radians([170.0, 20.0, -30.0]))
    state[12] = 3.0  # turns through south
    batch = simulate_batch([Case(sbs, state, hover.controls)], 0.2, outputs=OUTPUTS)
    found = {name: values[0] for name, values in quantities(batch).items()}
    start = [found[f"{name} {unit}"][0] for name, unit in (("north", "[m]"), ("east", "[m]"), ("height", "[m]"))]
    assert start == [3.0, -2.0, 50.0]
    angles = [found[f"{name} [deg]"] for name in ("yaw", "pitch", "roll")]
    assert [values[0] for values in angles] == pytest.approx([170.0, 20.0, -30.0])
    assert angles[0][-1] > 185.0  # without a jump
    flight = simulate(sbs, state, hover.controls, 0.2)
    assert found["r [deg/s]"] == pytest.approx(np.degrees(flight["r"]))
    assert found["power [W]"] == pytest.approx(flight["power"].sum(axis=1))


def test_files_hold_the_flights(batch):
    rows = list(csv.DictReader(io.StringIO(batch_to_csv(batch))))
    assert [row["error"] == "" for row in rows] == [True, True, True, False]
    for i, row in enumerate(rows[:3]):
        case = batch.cases[i]
        assert int(row["seed"]) == case.wind.turbulence_seed
        assert float(row["body.mass [kg]"]) == case.changes["body.mass"]
        assert float(row["u [m/s]"]) == batch["u"][i, -1]
        assert float(row["time [s]"]) == pytest.approx(0.3)
    assert rows[3]["u [m/s]"] == ""
    data = json.loads(to_json(batch_to_dict(batch)))
    assert data["shares"] == list(SHARES)
    assert [flight["changes"] for flight in data["flights"]] == [dict(case.changes) for case in batch.cases]
    assert data["percentiles"]["u [m/s]"][2] == pytest.approx(np.median(batch["u"][:3], axis=0))


def test_the_plot_has_a_panel_for_each_quantity(batch):
    figure = batch_figure(batch)
    assert [axes.get_ylabel() for axes in figure.axes] == list(SHOWN)
    assert figure.get_suptitle() == "sbs: 4 flights, 1 ended early"
    median = figure.axes[1].lines[-1]
    assert np.asarray(median.get_ydata()) == pytest.approx(np.median(batch["u"][:3], axis=0))


# -- the command -----------------------------------------------------------------------------------------------------


def test_the_command_prints_percentiles_and_writes_files(tmp_path):
    text = output(
        *("batch", "--flights", 4, "--duration", 0.3, "--airspeed", 12, "--seed", 3, "--azimuth-count", 3),
        *("--spread", "body.mass=0.05", "--json", tmp_path / "b.json", "--csv", tmp_path / "b.csv", "--out", tmp_path),
    )
    data = json.loads((tmp_path / "b.json").read_text())
    lines = text.splitlines()
    assert lines[0] == "4 flights of sbs, 4 of them over 0.3 s"
    headings = [" ".join(part.split()) for part in lines[1].strip().split("%")]
    assert headings == ["start, 50", *(f"end, {share:g}" for share in SHARES), ""]
    row = next(line for line in lines if line.startswith("u [m/s]")).removeprefix("u [m/s]").split()
    found = data["percentiles"]["u [m/s]"]
    assert [float(cell) for cell in row] == pytest.approx([found[2][0], *(part[-1] for part in found)], abs=5e-4)
    assert len((tmp_path / "b.csv").read_text().splitlines()) == 5
    assert lines[-2:] == [f"written: {tmp_path / 'batch'}.{kind}" for kind in ("png", "svg")]
    assert (tmp_path / "batch.png").read_bytes().startswith(b"\x89PNG")


def test_flights_of_which_none_begins_are_reported_with_their_reasons(tmp_path):
    table, file = tmp_path / "a.csv", tmp_path / "a.json"
    ended = call("batch", "--flights", 2, "--duration", 0.1, "--airspeed", 99, "--csv", table, "--json", file)
    assert ended.returncode == 1
    assert ended.stderr == "no flight came to its end\n"
    assert ended.stdout.count("no trim") == 2
    assert "nan" not in ended.stdout
    assert table.read_text().count("no trim") == 2
    assert all("no trim" in flight["error"] for flight in json.loads(file.read_text())["flights"])


def test_the_command_says_what_is_wrong_in_one_line():
    assert failure("batch", "--flights", 0) == "flights = 0: allowed are integers from 1 to 1000000"
    assert failure("batch", "--workers", 2, "--dask", "x").startswith("workers = 2: not allowed with dask")


# -- with a controller -----------------------------------------------------------------------------------------------

OWN = """
import sbs_sim

def still(time, measured, memory, parameters, controls):
    pass

held = sbs_sim.Controller(still)

def make(aircraft):
    return sbs_sim.Controller(still, [aircraft.body.mass])

wrong = 3
"""


def test_a_controller_flies_what_tumbles_without_one(tmp_path):
    """Hands off nearly all have turned over by then; with the controller all stay where they are."""
    words = ("batch", "--flights", 8, "--duration", 6, "--turbulence", 1.5, "--json", tmp_path / "f.json")
    output(*words, "--controller", "design", "--spread", "body.mass=0.05", "--noise", "p=0.01", "--lag", 0.03)
    data = json.loads((tmp_path / "f.json").read_text())
    assert [flight["error"] for flight in data["flights"]] == [None] * 8
    assert np.abs(data["percentiles"]["roll [deg]"]).max() < 10.0
    for name in ("north [m]", "east [m]", "height [m]"):
        assert np.abs(data["percentiles"][name]).max() < 1.5
    output(*words)
    data = json.loads((tmp_path / "f.json").read_text())
    assert np.abs(data["percentiles"]["roll [deg]"][-1]).max() > 45.0


def chosen(sbs, *words):
    """The controller that a command line selects."""
    arguments = make_parser().parse_args([str(word) for word in words])
    return controller(arguments, sbs, TrimCondition(), Fidelity())


def test_a_controller_from_a_file_of_python(sbs, tmp_path):
    file = tmp_path / "own.py"
    file.write_text(OWN)
    held = chosen(sbs, "--controller", f"{file}:held", "--delay", 0.02, "--noise", "p=0.1")
    assert (held.delay, held.lag, held.sensors.noise) == (0.02, 0.0, {"p": 0.1})
    made = chosen(sbs, "--controller", f"{file}:make")
    assert made.parameters.tolist() == [sbs.body.mass]
    for name, text in (
        ("wrong", "TypeError: 'int'"),
        ("none", "AttributeError"),
        ("", "allowed are design"),
    ):
        with pytest.raises(PilotError, match=text):
            chosen(sbs, "--controller", f"{file}:{name}")
    with pytest.raises(PilotError, match=r"controller = .x.: allowed are design, FILE\.yaml and FILE\.py:NAME"):
        chosen(sbs, "--controller", "x")
    with pytest.raises(UsageError, match="allowed with --controller"):
        chosen(sbs, "--lag", 0.1)
    assert chosen(sbs) is None


def test_the_errors_of_sensors_belong_to_flights(sbs):
    def still(time, measured, memory, parameters, controls):
        pass

    own = Controller(still, sensors=Sensors(noise={"p": 0.1}))
    cases = gust_cases(sbs, 3, {}, turbulence=1.0, controller=own)
    plain = gust_cases(sbs, 3, {}, turbulence=1.0)
    assert len({case.controls.sensors.seed for case in cases}) == 3
    assert [case.wind for case in cases] == [case.wind for case in plain]
