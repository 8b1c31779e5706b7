"""Batches: every flight that of `simulate`, whatever flies beside it, and Monte Carlo on top of them."""

import dataclasses
import math
import threading
from pathlib import Path

import numpy as np
import pytest
from helpers import build

from sbs_sim import Aircraft, Case, simulate, simulate_batch, trim
from sbs_sim.analysis.batch import CANCELLED, GROUPS, simulate_cases
from sbs_sim.errors import BatchError, SimulationError
from sbs_sim.flight.trim_point import Fidelity, TrimCondition
from sbs_sim.model.state import ATTITUDE
from sbs_sim.model.wind import Wind

TANDEM = Path(__file__).resolve().parents[1] / "data" / "tandem.yaml"
GUSTS = Wind(turbulence_intensity=(1.5, 1.0, 0.5), gust=(0.0, 3.0, 0.0), gust_delay=0.05, gust_duration=0.2)
DURATION = 0.3


def gusts(seed):
    return dataclasses.replace(GUSTS, turbulence_seed=seed)


@pytest.fixture(scope="module")
def tandem():
    return Aircraft.load(TANDEM)


@pytest.fixture(scope="module")
def cases(sbs, sbs_paper, tandem):
    """Other aircraft, starts, controls and winds in each, of unequal shapes."""
    cruise = trim(sbs, airspeed=12.0)
    heavy = sbs.with_value("body.mass", 24.0)
    state = simulate(sbs, cruise, cruise.controls, 0.05)["state"][-1]
    rows = cruise.controls + 0.01 * np.sin(np.arange(10))[:, np.newaxis]
    return [
        Case(sbs, cruise),
        Case(sbs, cruise, wind=gusts(1)),
        Case(heavy, cruise, rows, gusts(2)),
        Case(tandem, trim(tandem), wind=gusts(3)),
        Case(sbs, state, lambda time: cruise.controls + 0.02 * math.sin(20.0 * time), gusts(4)),
        Case(sbs_paper, trim(sbs_paper), wind=gusts(5)),
    ]


def single(case, **options):
    """The flight on its own."""
    controls = case.start.controls if case.controls is None else case.controls
    return simulate(case.aircraft, case.start, controls, DURATION, wind=case.wind, **options)


def assert_same(batch, i, flight, every):
    for name in GROUPS:
        expected = flight[name][::every]
        found = batch[name][i]
        if name == "state":
            places = [batch.state_names.index(own) for own in batch.cases[i].aircraft.layout.names]
            assert np.isnan(np.delete(found, places, axis=1)).all()
            found = found[:, places]
        assert found.shape == expected.shape
        assert found.tobytes() == expected.tobytes(), name


# -- the same as single flights --------------------------------------------------------------------------------------


@pytest.mark.parametrize(("workers", "every"), [(1, 1), (2, 7), (4, 3)])
def test_every_flight_is_the_single_one_to_the_last_bit(cases, workers, every):
    batch = simulate_batch(cases, DURATION, workers=workers, every=every)
    assert batch.errors == (None,) * len(cases)
    assert batch["state"].shape == (len(cases), 30 // every + 1, len(batch.state_names))
    for i, case in enumerate(cases):
        assert_same(batch, i, single(case), every)
    assert batch.time == pytest.approx(0.01 * every * np.arange(30 // every + 1), abs=1e-12)


def test_changes_of_a_case_are_checked_together(sbs, hover):
    changes = {"rotors.radius": 0.4, "rotors.blade_cg": 0.18, "body.inertia[0][2]": -0.03}
    batch = simulate_batch([Case(sbs, {}, changes=changes)], 0.02, outputs=["state"])
    assert batch.errors == (None,)
    craft = sbs.with_values(changes)
    point = trim(craft)
    assert batch["state"][0].tobytes() == simulate(craft, point, point.controls, 0.02)["state"].tobytes()


@pytest.mark.parametrize("options", [{"lead_lag": False, "cyclic_inflow": False}, {"method": "partitioned"}])
def test_options_are_those_of_single_flights(cases, options):
    options = {**options, "azimuth_step": 0.2, "tick": 0.02}
    batch = simulate_batch(cases[:2], DURATION, **options)
    for i in range(2):
        assert_same(batch, i, single(cases[i], **options), 1)


def test_a_flight_longer_than_a_block_is_the_single_one(sbs, hover):
    """Its ticks are shorter, so that there are many."""
    wind = gusts(6)
    batch = simulate_batch([Case(sbs, hover, wind=wind)], 0.2101, tick=1e-4, azimuth_step=0.5, every=300)
    flight = simulate(sbs, hover, hover.controls, 0.2101, tick=1e-4, azimuth_step=0.5, wind=wind)
    assert len(flight["time"]) == 2102
    assert_same(batch, 0, flight, 300)


@pytest.mark.parametrize("failing", [(0,), (3, 7)])
def test_a_flight_that_ended_in_an_earlier_block_disturbs_no_other(sbs, hover, failing):
    """Wherever it flew beside them: the first tells the others no time, and none how many rows there are."""
    sinking = hover.controls - [0.08, 0.0, 0.0, 0.0]
    cases = [Case(sbs, hover, sinking if i in failing else None, gusts(i)) for i in range(8)]
    options = {"every": 7, "ground_altitude": -2.0}
    batch = simulate_batch(cases, 1.7, workers=1, **options)
    assert batch.failed == failing
    for i in failing:
        assert "ground contact" in batch.errors[i]
        assert 1 < np.isfinite(batch["u"][i]).sum() < len(batch.time) // 1.4  # before the end of the first block
    for i in set(range(8)) - set(failing):
        flight = simulate(sbs, hover, hover.controls, 1.7, wind=gusts(i), ground_altitude=-2.0)
        np.testing.assert_array_equal(batch["state"][i], flight["state"][::7])
        np.testing.assert_array_equal(batch["thrust"][i], flight["thrust"][::7])


def test_changes_and_trims_are_made_for_each_flight(sbs):
    case = Case(sbs, {"airspeed": 9.0}, wind=gusts(7), changes={"body.mass": 22.0, "rotors.blade_mass": 0.17})
    batch = simulate_batch([case], DURATION, lead_lag=False)
    variant = sbs.with_value("body.mass", 22.0).with_value("rotors.blade_mass", 0.17)
    point = trim(variant, airspeed=9.0, lead_lag=False)
    assert_same(batch, 0, simulate(variant, point, point.controls, DURATION, wind=gusts(7), lead_lag=False), 1)


def test_conditions_are_trimmed_with_the_fidelity_of_the_batch(sbs):
    """A condition as an object gives the bits of its arguments, and averages over as many azimuths."""
    arguments, condition = {"airspeed": 9.0, "sideslip": 0.1}, TrimCondition(airspeed=9.0, sideslip=0.1)
    few, standard = Fidelity(azimuth_count=3), Fidelity()
    each = [
        simulate_cases([Case(sbs, start)], 0.02, fidelity, outputs=["state"])["state"].tobytes()
        for fidelity in (few, standard)
        for start in (arguments, condition)
    ]
    assert (each[0], each[2]) == (each[1], each[3])
    assert each[0] != each[2]
    assert (
        each[0] == simulate_batch([Case(sbs, arguments)], 0.02, azimuth_count=3, outputs=["state"])["state"].tobytes()
    )


def test_only_what_was_asked_for_is_kept(cases):
    batch = simulate_batch(cases[:2], DURATION, outputs=["w", "power"], every=10)
    assert set(batch.histories) == {"w", "power"}
    assert batch["w"].shape == (2, 4)
    assert batch["w"][1].tobytes() == single(cases[1])["w"][::10].tobytes()
    with pytest.raises(KeyError, match="no 'u': there are w, power"):
        batch["u"]


# -- failures --------------------------------------------------------------------------------------------------------


def test_a_flight_that_fails_ends_with_its_reason_and_disturbs_no_other(sbs, cases, hover):
    stone = build(environment={"air_density": 0.0, "gravity": 99.0})  # 350 m/s after 3.54 s
    rest = np.zeros(stone.layout.size)
    rest[ATTITUDE] = 1.0
    steps = np.tile(hover.controls, (30, 1))
    steps[12:, 0] = 1.0  # beyond its range from tick 12 on
    wrong = [
        Case(stone, rest, np.zeros(4)),
        Case(sbs, hover, steps),
        Case(sbs, {"airspeed": 500.0}),
        Case(sbs, hover, changes={"body.mass": 0.1}),
        Case(sbs, np.full(51, np.nan), hover.controls),
        Case(sbs, hover, changes={"rotors.blades": 4}),
        Case(sbs, single(cases[0])["state"][-1]),
    ]
    options = {"tick": 0.1, "outputs": ["state"]}
    batch = simulate_batch([cases[0], *wrong, cases[1]], 4.0, **options)
    assert batch.failed == tuple(range(1, 8))
    alone = simulate_batch([cases[0], cases[1]], 4.0, **options)
    assert np.array_equal(batch["state"][[0, -1]], alone["state"])
    with pytest.raises(SimulationError) as caught:
        simulate(stone, rest, np.zeros(4), 4.0, tick=0.1)
    assert batch.errors[1] == str(caught.value)
    assert np.isnan(batch["w"][1]).tolist() == [i > 35 for i in range(41)]
    assert "collective = " in batch.errors[2]
    assert np.isnan(batch["u"][2]).tolist() == [i >= 12 for i in range(41)]
    for i, text in ((3, "airspeed"), (4, "body.mass = 0.1"), (5, "state "), (6, "rotors.blades"), (7, "controls: ")):
        assert text in batch.errors[i], batch.errors[i]
        assert "\n" not in batch.errors[i]
        assert np.isnan(batch["state"][i]).all()


@pytest.mark.parametrize(
    ("options", "line"),
    [
        ({"duration": -1.0}, "duration = -1.0: allowed are 0 to 1e+06 s"),
        ({"duration": math.nan}, "duration = nan: allowed are 0 to 1e+06 s"),
        ({"tick": 0.0}, "tick = 0.0: allowed are 0.0001 to 1 s"),
        ({"every": 0}, "every = 0: allowed are integers from 1 to 10000000000"),
        ({"workers": 0}, "workers = 0: allowed are integers from 1 to 256"),
        (
            {"speed": 1},
            "speed: unknown option, allowed are tick, azimuth_step, method, ground_altitude, actuators, lead_lag,"
            " cyclic_inflow, azimuth_count",
        ),
        ({"workers": 2, "dask": "x"}, "workers = 2: not allowed with dask, whose workers are those of the cluster"),
        ({"duration": 1e6}, "the histories of 1 flights with 100000001 rows take "),
    ],
)
def test_bad_values_are_refused_in_one_line(sbs, hover, options, line):
    with pytest.raises(BatchError) as caught:
        simulate_batch([Case(sbs, hover)], **{"duration": 1.0, **options})
    assert str(caught.value).startswith(line)
    assert "\n" not in str(caught.value)


def test_no_flights_and_unknown_outputs_are_refused(sbs, hover):
    with pytest.raises(BatchError, match="cases: allowed is at least one flight"):
        simulate_batch([], 1.0)
    with pytest.raises(BatchError, match="outputs: 'U': allowed are state, controls, "):
        simulate_batch([Case(sbs, hover)], 1.0, outputs=["U"])


def test_progress_is_reported_and_a_batch_can_be_cancelled(sbs, hover):
    reported = []
    batch = simulate_batch(
        [Case(sbs, hover)] * 40,
        DURATION,
        workers=1,
        progress=lambda i, done, total: reported.append((i, done, total, threading.current_thread())),
        cancelled=lambda: len(reported) >= 2,
    )
    ended = [i for i, *_ in reported]
    assert 2 <= len(reported) < 40
    assert reported == [(i, k + 1, 40, threading.main_thread()) for k, i in enumerate(ended)]
    assert [error is None for error in batch.errors] == [i in ended for i in range(40)]
    assert set(batch.errors) == {None, CANCELLED}


def test_percentiles_are_those_of_the_flights_in_the_air(cases):
    batch = simulate_batch([*cases[:3], Case(cases[0].aircraft, {"airspeed": 500.0})], DURATION, outputs=["v"])
    found = batch.percentiles("v", (0.0, 50.0, 100.0))
    assert found.shape == (3, 31)
    assert np.array_equal(found, np.sort(batch["v"][:3], axis=0))
