"""Sweeps: the same as single trims, in any number of threads, with failures in their places."""

import csv
import dataclasses
import io
import json
import math
import threading

import numpy as np
import pytest

from sbs_sim import linearize, sweep, trim
from sbs_sim.analysis.export import sweep_to_csv
from sbs_sim.analysis.sweep import CANCELLED
from sbs_sim.analysis.sweep_map import sweep_map
from sbs_sim.analysis.sweep_map_plots import map_figure, save_map
from sbs_sim.analysis.sweep_plots import root_locus_figure, save_plots, trim_figure
from sbs_sim.commands.sweep import main
from sbs_sim.errors import ExportError, SweepError
from sbs_sim.flight.trim_point import TrimCondition
from sbs_sim.model import state as S
from sbs_sim.output.json_text import to_json

SPEEDS = np.linspace(-5.0, 20.0, 11)


@pytest.fixture(scope="module")
def speeds(sbs):
    return sweep(sbs, "airspeed", SPEEDS, workers=2)


@pytest.fixture(scope="module")
def masses(sbs):
    """The first is lighter than its blades, the last too heavy to fly."""
    return sweep(sbs, "body.mass", [0.5, 15.0, 20.62, 26.0, 1000.0], airspeed=5.0, azimuth_count=6)


def same(one, other):
    """True for two trims or models that are equal to the last bit."""
    for field in dataclasses.fields(one):
        a, b = getattr(one, field.name), getattr(other, field.name)
        if dataclasses.is_dataclass(a):
            if not same(a, b):
                return False
        elif not (np.array_equal(a, b) if isinstance(a, np.ndarray) else a == b):
            return False
    return True


# -- what is solved --------------------------------------------------------------------------------------------------


def test_a_sweep_is_what_single_calls_give(sbs, speeds):
    assert speeds.parameter == "airspeed"
    assert [point.value for point in speeds.points] == SPEEDS.tolist()
    assert speeds.failed == ()
    for point in speeds.points:
        assert same(point.trim, trim(sbs, airspeed=point.value))
        assert same(point.model, linearize(sbs, airspeed=point.value))


@pytest.mark.parametrize("workers", [1, 4])
def test_any_number_of_workers_gives_the_same(sbs, speeds, workers):
    other = sweep(sbs, "airspeed", SPEEDS, workers=workers)
    for one, two in zip(speeds.points, other.points, strict=True):
        assert one.value == two.value
        assert same(one.trim, two.trim)
        assert same(one.model, two.model)


@pytest.mark.parametrize("parameter", ["climb_rate", "sideslip", "turn_rate"])
def test_every_condition_can_be_swept(sbs, parameter):
    condition = {"airspeed": 6.0, "climb_rate": 0.5, "sideslip": 0.1, "turn_rate": 0.2}
    others = {name: value for name, value in condition.items() if name != parameter}
    found = sweep(sbs, parameter, [0.3, -0.3], **others, azimuth_count=3, lead_lag=False, linear=False)
    for point in found.points:
        changed = {**condition, parameter: point.value}
        assert same(point.trim, trim(sbs, **changed, azimuth_count=3, lead_lag=False))
        assert point.model is None
        assert point.error is None


@pytest.mark.parametrize("parameter", ["airspeed", "climb_rate", "sideslip", "turn_rate"])
def test_what_is_swept_must_not_be_given_too(sbs, parameter):
    with pytest.raises(SweepError, match=f"^{parameter} = 0.5: not allowed where {parameter} is swept$"):
        sweep(sbs, parameter, [0.0], **{parameter: 0.5})


def test_a_value_of_the_aircraft_can_be_swept(sbs):
    found = sweep(sbs, "rotors.MR1.blade_mass", [0.15, 0.17], cyclic_inflow=False)
    for point in found.points:
        variant = sbs.with_value("rotors[0].blade_mass", point.value)
        assert same(point.trim, trim(variant, cyclic_inflow=False))
        assert point.model.parameter_hash == variant.parameter_hash


def test_the_order_is_that_of_the_values(sbs):
    values = [7.0, -3.0, 7.0, 0.0]
    found = sweep(sbs, "airspeed", values, linear=False, workers=4)
    assert found.values.tolist() == values
    assert [point.trim.condition.airspeed for point in found.points] == values
    assert same(found.points[0].trim, found.points[2].trim)


# -- physics ---------------------------------------------------------------------------------------------------------


def test_a_heavier_aircraft_needs_more_collective_and_more_power(masses):
    collective, power = masses["collective"][1:4], masses["power"].sum(axis=1)[1:4]
    assert np.all(np.diff(collective) > math.radians(0.5))
    assert np.all(np.diff(power) > 100.0)
    # nearly level: the rotors carry the weight
    assert masses["thrust"].sum(axis=1)[1:4] == pytest.approx(9.80665 * masses.values[1:4], rel=0.01)


def test_thinner_air_needs_more_collective(sbs):
    found = sweep(sbs, "environment.air_density", [1.225, 1.0, 0.8], linear=False)
    assert np.all(np.diff(found["collective"]) > math.radians(0.3))
    assert np.all(np.diff(found["lambda0(1)"]) > 0.0)


def test_the_power_has_its_minimum_in_forward_flight(speeds):
    power = speeds["power"].sum(axis=1)
    best = SPEEDS[np.argmin(power)]
    assert 10.0 < best < 20.0
    assert np.abs(speeds["roll"]).max() < 1e-9  # the aircraft and the flight are symmetric


def test_forwards_and_backwards_are_alike_but_for_the_drag(speeds):
    """The body has the same drag both ways and the aircraft almost the same ends."""
    forwards, backwards = speeds["pitch"][SPEEDS == 5.0], speeds["pitch"][SPEEDS == -5.0]
    assert forwards == pytest.approx(-backwards, rel=1e-3)


# -- failures --------------------------------------------------------------------------------------------------------


def test_failed_points_keep_their_order(masses):
    assert [point.error is None for point in masses.points] == [False, True, True, True, False]
    assert masses.failed == (masses.points[0], masses.points[4])
    assert masses.points[0].error == "body.mass = 0.5: allowed is > 0.9678, the mass of all blades"
    assert masses.points[4].error.startswith("no trim: the rotors cannot carry more than ")
    assert masses.points[4].trim is None
    assert masses.points[4].model is None


def test_arrays_are_nan_where_a_point_failed(masses):
    failed = np.array([True, False, False, False, True])
    for name in ("pitch", "collective", "residual", "iterations", "u", "dxis(2)", "lambdac(1)"):
        assert masses[name].shape == (5,)
        assert np.array_equal(np.isnan(masses[name]), failed)
    for name in ("thrust", "torque", "power"):
        assert masses[name].shape == (5, 2)
        assert np.array_equal(np.isnan(masses[name]).all(axis=1), failed)
    assert masses.poles.shape == (5, 38)
    assert np.array_equal(np.isnan(masses.poles).all(axis=1), failed)
    assert all(np.array_equal(np.isnan(locus), failed) for locus in masses.loci.values())


def test_a_sweep_of_failures_only(sbs):
    found = sweep(sbs, "body.mass", [0.5, 0.6])
    assert len(found.failed) == 2
    assert np.isnan(found["pitch"]).all()
    assert found["thrust"].shape == (2, 0)
    assert found.poles.shape == (2, 0)
    assert found.modes == {}


@pytest.mark.parametrize(
    ("parameter", "values", "options", "line"),
    [
        ("airspeed", [], {}, "values have the shape (0,): allowed is a list of at least one number"),
        ("airspeed", 5.0, {}, "values have the shape (): allowed is a list of at least one number"),
        ("airspeed", [[1.0]], {}, "values have the shape (1, 1): allowed is a list of at least one number"),
        ("airspeed", [0.0, math.nan], {}, "values[1] = nan: allowed are finite numbers"),
        ("airspeed", [-math.inf], {}, "values[0] = -inf: allowed are finite numbers"),
        ("airspeed", ["fast"], {}, "values = ['fast']: allowed are numbers"),
        ("airspeed", [0.0], {"workers": 0}, "workers = 0: allowed are integers from 1 to 256"),
        ("airspeed", [0.0], {"workers": 1.5}, "workers = 1.5: allowed are integers from 1 to 256"),
        (
            "body.weight",
            [0.0],
            {},
            "parameter 'body.weight': allowed are airspeed, climb_rate, sideslip, turn_rate or a path;"
            " body.weight: unknown key, allowed are mass, inertia, flat_plate_areas, surfaces, fuselage, stand",
        ),
    ],
)
def test_what_cannot_be_swept_is_refused(sbs, parameter, values, options, line):
    with pytest.raises(SweepError) as caught:
        sweep(sbs, parameter, values, **options)
    assert str(caught.value) == line


# -- progress and cancelling -----------------------------------------------------------------------------------------


def test_progress_comes_in_the_calling_thread(sbs):
    calls = []

    def progress(point, done, total):
        assert threading.current_thread() is threading.main_thread()
        calls.append((point, done, total))

    found = sweep(sbs, "airspeed", [0.0, 5.0, 1e9], linear=False, progress=progress, workers=2)
    assert [call[1:] for call in calls] == [(1, 3), (2, 3), (3, 3)]
    assert {id(call[0]) for call in calls} == {id(point) for point in found.points}


def test_after_cancelling_the_rest_is_cancelled(sbs):
    done = []
    found = sweep(
        sbs,
        "airspeed",
        np.linspace(0.0, 10.0, 200),
        linear=False,
        workers=2,
        progress=lambda point, *_: done.append(point),
        cancelled=lambda: len(done) >= 3,
    )
    solved = [point for point in found.points if point.error is None]
    rest = [point for point in found.points if point.error is not None]
    # those that were being solved are brought to their ends
    assert 3 <= len(solved) <= 20
    assert all(point.error == CANCELLED and point.trim is None and point.model is None for point in rest)
    assert found.values.tolist() == np.linspace(0.0, 10.0, 200).tolist()
    assert sorted(map(id, done)) == sorted(map(id, solved))


def test_a_sweep_that_is_cancelled_from_the_start_ends_at_once(sbs):
    found = sweep(sbs, "airspeed", np.linspace(0.0, 10.0, 500), workers=1, cancelled=lambda: True)
    assert sum(point.error == CANCELLED for point in found.points) > 450


def test_an_exception_of_the_caller_ends_the_sweep(sbs):
    def progress(*_):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        sweep(sbs, "airspeed", np.linspace(0.0, 10.0, 500), progress=progress, workers=2)
    assert not [thread for thread in threading.enumerate() if thread.name.startswith("sweep")]


# -- names and modes -------------------------------------------------------------------------------------------------


def test_every_name_is_that_of_the_trims(speeds):
    for i, point in enumerate(speeds.points):
        assert speeds["pitch"][i] == point.trim.pitch
        assert [speeds[name][i] for name in S.CONTROL_NAMES] == point.trim.controls.tolist()
        assert speeds["power"][i].tolist() == point.trim.power.tolist()
        assert [speeds[name][i] for name in point.trim.state_names] == point.trim.state.tolist()
        assert np.array_equal(speeds.poles[i], point.model.poles)
    assert set(speeds.points[0].trim.state_names) < set(speeds.names)
    units = [
        speeds.unit(name) for name in ("airspeed", "pitch", "torque", "w", "theta", "da1(2)", "xi0(1)", "lambdas(1)")
    ]
    assert units == ["m/s", "rad", "N m", "m/s", "rad", "rad/s", "rad", "1"]
    with pytest.raises(KeyError, match="no 'speed': there are pitch, roll, collective, "):
        speeds["speed"]


def test_loci_follow_the_modes_by_their_names(speeds):
    for i, point in enumerate(speeds.points):
        named = {name: locus[i] for name, locus in speeds.loci.items() if not np.isnan(locus[i])}
        assert named == {mode.name: mode.pole for mode in point.model.modes}
    for name in ("phugoid", "short period", "roll", "spiral", "coning, symmetric", "advancing lag, antisymmetric"):
        locus = speeds.loci[name]
        assert not np.isnan(locus).any()
        # a step of 2.5 m/s moves no such pole far
        assert np.abs(np.diff(locus)).max() < 1.0 + 0.02 * np.abs(locus).max()
    frequencies = [np.nanmedian(np.abs(locus)) for locus in speeds.loci.values()]
    assert frequencies == sorted(frequencies)


def test_points_may_have_unequal_numbers_of_states(sbs):
    found = sweep(sbs, "rotors.blades", [3.0, 4.0], azimuth_count=4)
    assert found.failed == ()
    assert found.poles.shape == (2, 46)
    assert np.isnan(found.poles[0]).sum() == 8
    assert np.array_equal(np.isnan(found["ad(1)"]), [True, False])
    assert np.isnan(found.loci["differential flap, rotor 1"][0])


# -- files and plots -------------------------------------------------------------------------------------------------


def test_as_json(masses):
    data = json.loads(to_json(masses.to_dict()))
    assert data["parameter"] == "body.mass"
    assert [point["value"] for point in data["points"]] == masses.values.tolist()
    first, second = data["points"][:2]
    assert first["trim"] is None
    assert first["model"] is None
    assert first["error"] == masses.points[0].error
    assert second["error"] is None
    assert second["trim"]["controls"] == masses.points[1].trim.controls.tolist()
    assert second["model"]["a"] == masses.points[1].model.a.tolist()
    assert "trim" not in second["model"]  # it stands beside it


def test_as_csv(masses):
    import csv

    rows = list(csv.DictReader(sweep_to_csv(masses).splitlines()))
    assert [float(row["body.mass [kg]"]) for row in rows] == masses.values.tolist()
    assert rows[0]["error"] == masses.points[0].error
    assert all(value == "" for name, value in rows[0].items() if name not in ("error", "body.mass [kg]"))
    trimmed = masses.points[2]
    assert float(rows[2]["collective [rad]"]) == trimmed.trim.controls[0]
    assert float(rows[2]["power(2) [W]"]) == trimmed.trim.power[1]
    assert float(rows[2]["da0(1) [rad/s]"]) == trimmed.trim.state[trimmed.trim.state_names.index("da0(1)")]
    phugoid = trimmed.model.mode("phugoid").pole
    assert float(rows[2]["phugoid: real [rad/s]"]) == phugoid.real
    assert float(rows[2]["phugoid: imaginary [rad/s]"]) == phugoid.imag


def test_plots_are_written(speeds, masses, tmp_path):
    for found in (speeds, masses):
        paths = save_plots(found, tmp_path / found.parameter / "plots")
        assert [path.name for path in paths] == ["trim.png", "trim.svg", "root_locus.png", "root_locus.svg"]
        assert all(path.read_bytes()[:4] == b"\x89PNG" for path in paths if path.suffix == ".png")
        assert all(b"</svg>" in path.read_bytes() for path in paths if path.suffix == ".svg")


def test_every_axis_has_a_unit_and_every_mode_its_name(speeds):
    trims, loci = trim_figure(speeds), root_locus_figure(speeds)
    labels = [text for axes in (*trims.axes, *loci.axes) for text in (axes.get_xlabel(), axes.get_ylabel()) if text]
    assert len(labels) == 8 + 4 + 1  # four panels, two panels, the scale of the colours
    assert all(label.endswith("]") and "[" in label for label in labels)
    names = [name for axes in loci.axes for text in axes.texts for name in text.get_text().split("\n")]
    assert sorted(names) == sorted(speeds.modes)


def test_names_of_modes_do_not_cover_each_other(speeds):
    from matplotlib.text import Text

    figure = root_locus_figure(speeds)
    figure.canvas.draw()
    for axes in figure.axes:
        boxes = [Text.get_window_extent(text) for text in axes.texts]
        assert not any(one.overlaps(two) for i, one in enumerate(boxes) for two in boxes[:i])


def test_angles_of_the_flight_are_shown_in_degrees(sbs):
    found = sweep(sbs, "sideslip", [0.0, math.pi / 2], airspeed=3.0, linear=False)
    assert found.shown[0].tolist() == [0.0, 90.0]
    assert found.shown[1] == "deg"
    assert trim_figure(found).axes[0].get_xlabel() == "sideslip [deg]"


def test_of_a_sweep_without_models_there_are_trim_curves_only(sbs, tmp_path):
    found = sweep(sbs, "airspeed", [3.0], linear=False)
    assert [path.name for path in save_plots(found, tmp_path)] == ["trim.png", "trim.svg"]
    assert save_plots(sweep(sbs, "body.mass", [0.5]), tmp_path) == []


def test_plots_that_cannot_be_written_are_reported_in_one_line(speeds, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(ExportError, match="file: no folder can be made there: File exists"):
        save_plots(speeds, tmp_path / "file")


# -- maps ------------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def chart(sbs):
    """Masses up to one that is too heavy to fly."""
    return sweep_map(sbs, ("airspeed", [0.0, 8.0, 16.0]), ("body.mass", [18.0, 24.0, 900.0]), linear=True)


def test_a_map_is_what_single_calls_give(sbs, chart):
    heavy = sbs.with_value("body.mass", 24.0)
    model = linearize(heavy, airspeed=8.0)
    found = {name: values[1, 1] for name, (values, _) in chart.quantities.items()}
    assert found["power"] == model.trim.power.sum()
    assert found["growth"] == model.poles.real.max()
    assert found["pitch"] == np.degrees(model.trim.pitch)
    ends = [(one.range, value) for one, value in zip(heavy.controls, model.trim.controls, strict=True)]
    margins = [min(value - low, high - value) / (high - low) for (low, high), value in ends]
    assert found["control margin"] == pytest.approx(100.0 * min(margins))
    assert chart.missing.tolist() == [[False] * 3, [False] * 3, [True] * 3]
    assert not chart.doubtful[2].any()


def test_any_two_parameters_span_a_map(sbs):
    """An oblique way through the map is another order of the same points; with both of the aircraft, too."""
    one = sweep_map(sbs, ("airspeed", [2.0, 6.0]), ("climb_rate", [1.0, 0.0]))
    other = sweep_map(sbs, ("climb_rate", [1.0, 0.0]), ("airspeed", [2.0, 6.0]))
    assert np.array_equal(one.quantities["power"][0], other.quantities["power"][0].T)
    assert "growth" not in one.quantities
    both = sweep_map(
        sbs, ("body.mass", [18.0, 22.0]), ("environment.air_density", [1.1, 1.225]), TrimCondition(airspeed=5.0)
    )
    changed = sbs.with_values({"body.mass": 22.0, "environment.air_density": 1.1})
    assert both.quantities["power"][0][0, 1] == trim(changed, airspeed=5.0).power.sum()


def test_a_map_shows_where_it_cannot_be_flown(chart, tmp_path):
    figure = map_figure(chart)
    assert [axes.get_title() for axes in figure.axes if axes.get_title()] == [
        "power [W]",
        "control margin [%]",
        "pitch [deg]",
        "roll [deg]",
        *(f"{name.replace('_', ' ')} [deg]" for name in chart.ranges),
        "growth [1/s]",
    ]
    first = figure.axes[0]
    assert (first.get_xlabel(), first.get_ylabel()) == ("airspeed [m/s]", "body.mass [kg]")
    crosses = next(line for line in first.lines if line.get_marker() == "x")
    assert crosses.get_xydata().tolist() == [[0.0, 900.0], [8.0, 900.0], [16.0, 900.0]]
    assert {path.name for path in save_map(chart, tmp_path)} == {"map.png", "map.svg"}
    rows = list(csv.DictReader(io.StringIO(chart.to_csv())))
    assert len(rows) == 9
    assert float(rows[4]["power [W]"]) == chart.quantities["power"][0][1, 1]
    assert rows[8]["power [W]"] == ""
    assert rows[8]["error"]


@pytest.mark.parametrize(
    ("first", "second", "message"),
    [
        (("airspeed", [0.0, 1.0]), ("airspeed", [0.0, 1.0]), "another one than the first"),
        (("airspeed", [0.0]), ("body.mass", [18.0, 20.0]), "airspeed = .*two or more rising or falling"),
        (("airspeed", [0.0, 1.0]), ("body.mas", [18.0, 20.0]), "parameter 'body.mas'"),
        (("turn_rate", [0.0, 1.0]), ("body.mass", [18.0, 20.0, 19.0]), "body.mass = .*rising or falling"),
    ],
)
def test_what_is_no_map_is_refused(sbs, first, second, message):
    with pytest.raises(SweepError, match=message):
        sweep_map(sbs, first, second)


def test_the_command_prints_a_map(sbs, monkeypatch, capsys):
    monkeypatch.setattr("sbs_sim.commands.common._behave_on_a_terminal", lambda: None)
    words = ["sweep", "airspeed", "0", "8", "2", "--over", "body.mass", "18", "24", "2", "--trims-only"]
    monkeypatch.setattr("sys.argv", words)
    assert main() == 0
    printed = capsys.readouterr().out.splitlines()
    start = printed.index("power [W]")
    assert printed[start + 1].split() == ["body.mass", "[kg]", "\\", "airspeed", "[m/s]", "0", "8"]
    power = trim(sbs.with_value("body.mass", 24.0), airspeed=8.0).power.sum()
    assert printed[start + 3].split() == ["24", *printed[start + 3].split()[1:2], f"{power:.0f}"]
    monkeypatch.setattr("sys.argv", [*words, "--guess-deg", "1", "1", "1", "1"])
    with pytest.raises(SystemExit, match="2"):
        main()
