"""Equality and hash by content: of everything that holds arrays, and of what it is made of."""

import copy
import dataclasses
import importlib
import math
import pkgutil

import numpy as np
import pytest

import sbs_sim
from sbs_sim import Aircraft, Case, linearize, simulate_batch, sweep, trim
from sbs_sim.analysis.floquet import floquet
from sbs_sim.content import ByContent
from sbs_sim.flight.simulation import Simulation
from sbs_sim.flight.trimmed_state import trimmed_state
from sbs_sim.model.wind import Wind
from sbs_sim.pilot.hover_hold import HoverModel, design


def made(aircraft):
    """One of each kind of public record with arrays, of an aircraft."""
    point = trim(aircraft)
    model = linearize(aircraft, point=point)
    cases = [Case(aircraft, point, lambda time: point.controls, changes={"body.mass": 21.0})]
    simulation = Simulation(aircraft, trimmed_state(aircraft, point), point.swashplate)
    return {
        "aircraft": aircraft,
        "body": aircraft.body,
        "rotor": aircraft.rotors[0],
        "airfoil": aircraft.airfoils["naca0012"],
        "trim": point,
        "model": model,
        "mode": model.modes[0],
        "one azimuth": linearize(aircraft, azimuth_count=1),  # its spread is no number
        "paper": linearize(aircraft, method="paper"),
        "sweep": sweep(aircraft, "airspeed", [0.0, 200.0]),
        "floquet": floquet(aircraft, point, 8),
        "wind": Wind(velocity=[1, 2, 3], gust_duration=np.float64(2)),
        "case": Case(aircraft, trimmed_state(aircraft, point), point.controls, changes={"body.inertia": np.eye(3)}),
        "snapshot": simulation.snapshot(),
        "event": simulation.beginning(),
        "batch": dataclasses.replace(simulate_batch(cases, 0.02), cases=()),  # functions are not made twice
        "design": design(HoverModel.of(model)),
    }


@pytest.fixture(scope="module")
def twice():
    """The same from two readings of the same file."""
    return made(Aircraft.load("sbs")), made(Aircraft.load("sbs"))


def test_what_is_made_twice_is_equal_and_has_one_hash(twice):
    for name in twice[0]:
        one, other = (records[name] for records in twice)
        assert one is not other
        assert one == other, name
        assert hash(one) == hash(other), name
        assert len({one, other}) == 1


def test_one_other_number_makes_them_unequal(twice):
    """The last bit of the last element of any array field."""
    count = 0
    for name, record in twice[0].items():
        for field in dataclasses.fields(record):
            value = getattr(record, field.name)
            if isinstance(value, np.ndarray) and value.size and field.compare:
                changed = value.copy()
                changed.flat[-1] = np.nextafter(changed.flat[-1].real, math.inf)
                other = dataclasses.replace(record, **{field.name: changed})
                assert record != other, (name, field.name)
                count += 1
    assert count > 40


def test_others_are_unequal(sbs, twice):
    heavy = sbs.with_value("body.mass", 21.0)
    assert sbs != heavy
    assert sbs != "sbs"
    assert trim(sbs) != trim(heavy)
    assert trim(sbs) != trim(sbs, airspeed=1e-9)
    assert sbs.rotors[0] != sbs.rotors[1]
    assert twice[0]["trim"] != twice[0]["model"]
    assert Wind() != Wind(turbulence_seed=1)
    assert Wind(velocity=(1.0, 0.0, 0.0)) == Wind(velocity=np.array([1, 0, 0]))
    assert Case(sbs, {"airspeed": 1.0}) == Case(sbs, {"airspeed": 1.0})
    assert Case(sbs, {"airspeed": 1.0}) != Case(sbs, {"airspeed": 1.0, "lead_lag": False})


def test_zeros_numbers_and_shapes():
    @dataclasses.dataclass(frozen=True, eq=False)
    class Record(ByContent):
        value: object
        free: int = dataclasses.field(default=0, compare=False)

    equal = [
        (np.array([0.0, np.nan]), np.array([-0.0, -np.nan])),
        (np.array([1, 2]), np.array([1.0, 2.0])),
        ([1, (2.0, "x")], (1, [2, "x"])),
        ({"a": np.ones(2), "b": 1}, {"b": 1.0, "a": np.ones(2)}),
        (math.nan, math.nan),
        (np.array([1j]), np.array([1j])),
    ]
    for one, other in equal:
        assert Record(one) == Record(other, free=1)
        assert hash(Record(one)) == hash(Record(other, free=1))
    unequal = [
        (np.ones(2), np.ones((2, 1))),
        (np.ones(2), [1.0, 1.0]),
        (np.array([1.0, np.nan]), np.array([1.0, 2.0])),
        ({"a": 1}, {"a": 1, "b": 1}),
        ([1], [1, 2]),
        (np.array(["a"]), np.array(["b"])),
    ]
    for one, other in unequal:
        assert Record(one) != Record(other)


def test_a_copy_is_equal(sbs, hover):
    assert copy.deepcopy(hover) == hover
    assert copy.copy(sbs) == sbs


def test_every_record_with_arrays_compares_by_content():
    """Where Python's own comparison would raise."""
    kinds = {
        kind
        for module in pkgutil.walk_packages(sbs_sim.__path__, "sbs_sim.")
        for kind in vars(importlib.import_module(module.name)).values()
        if isinstance(kind, type) and dataclasses.is_dataclass(kind) and kind.__module__.startswith("sbs_sim")
    }
    held = {kind for kind in kinds if any("rray" in str(field.type) for field in dataclasses.fields(kind))}
    found = {kind for kind in held if kind.__dataclass_params__.frozen}
    assert [kind for kind in found if not issubclass(kind, ByContent)] == []
    assert {"TrimPoint", "Rotor", "Body", "Event", "HoverHoldDesign"} <= {kind.__name__ for kind in found}
