"""Swashplate angles whose shares of the controls change with the airspeed (theory.md section 4.5)."""

import math

import numpy as np
import pytest
from helpers import Model, aircraft_data

from sbs_sim import Aircraft, linearize, simulate, trim
from sbs_sim.errors import AircraftError
from sbs_sim.flight.mixer import Mixer

AIRSPEED = [0.0, 10.0, 20.0]
FACTORS, OFFSETS_DEG = [0.0, 0.2, 0.1], [0.0, 1.0, 3.0]
SCHEDULE = [
    {"angle": "longitudinal_cyclic", "control": "lateral_cyclic", "airspeed": AIRSPEED, "factor": FACTORS},
    {"angle": "collective", "airspeed": AIRSPEED, "offset_deg": OFFSETS_DEG},
]


def aircraft(schedule=(), options=None):
    """Return `sbs` with coarse blades and a schedule of its second rotor."""
    data = aircraft_data(options={"elements": 8, **(options or {})}, rotors=[{}, {}])
    data["rotors"][1]["schedule"] = list(schedule)
    return Aircraft.from_dict(data)


@pytest.mark.parametrize("airspeed", [0.0, 7.0, 10.0, 16.0, 40.0])
def test_the_model_adds_factors_times_controls_and_angles_at_the_airspeed(airspeed):
    """Straight between the points and level outside: as the same angles without a schedule."""
    scheduled, plain = aircraft(SCHEDULE), aircraft()
    controls = np.array([0.1, 0.05, 0.02, 0.0])
    rows = scheduled.mix(controls)
    assert rows.shape == (3, 3)
    np.testing.assert_array_equal(rows[2], [0.05, 0.0, 0.0])
    expected = plain.mix(controls)
    expected[1, 2] += np.interp(airspeed, AIRSPEED, FACTORS) * 0.05
    expected[1, 0] += math.radians(np.interp(airspeed, AIRSPEED, OFFSETS_DEG))
    np.testing.assert_allclose(scheduled.scheduled(rows, airspeed)[:2], expected, rtol=1e-14)
    velocity = airspeed * np.array([0.6, 0.0, 0.8])
    found, there = Model(scheduled), Model(plain)
    x = found.state(velocity, (0.1, 0.2, 0.3), 0.05)
    same = there.derivative(x, expected)
    np.testing.assert_allclose(found.derivative(x, rows), same, rtol=1e-9, atol=1e-9 * np.abs(same).max())


def test_blades_or_flights_in_the_lanes_give_the_same_bits():
    """As everywhere, see `sbs_sim.lanes`."""
    one, rows, found = aircraft(SCHEDULE), aircraft(SCHEDULE).mix([0.1, 0.05, 0.02, 0.0]), []
    for lanes in ("blades", "points"):
        model = Model(one, lanes=lanes)
        found.append(model.derivative(model.state((12.0, 1.0, 2.0), (0.1, 0.2, 0.3), 0.05), rows).tobytes())
    assert found[0] == found[1]


def test_trim_linear_model_and_flight_agree_and_the_mixer_has_the_same_bits():
    """The trim is that of the fixed rigging at its airspeed; the model feels that the airspeed changes the rigging."""
    scheduled = aircraft(SCHEDULE)
    point = trim(scheduled, 15.0)
    fixed = aircraft_data(options={"elements": 8}, rotors=[{}, {}])
    second = fixed["rotors"][1]
    second["mixing"]["longitudinal_cyclic"] = {**second["mixing"]["longitudinal_cyclic"], "lateral_cyclic": 0.15}
    second["mixing"]["longitudinal_cyclic"] |= {"tilt": 1.0}
    second["mixing"]["collective"] = {**second["mixing"]["collective"], "lift": 1.0}
    second["swashplate_offset_deg"] = {"collective": 2.0}
    for name in ("tilt", "lift"):  # what the schedule moves, as controls
        fixed["controls"][name] = {"range_deg": [-1.0, 1.0], "axis": "none", "held_deg": 0.0}
    fixed = Aircraft.from_dict(fixed)
    same = trim(fixed, 15.0)
    np.testing.assert_allclose(point.controls, same.controls[:4], atol=1e-8)
    model, rigid = linearize(scheduled, point=point), linearize(fixed, point=same)
    np.testing.assert_allclose(model.b, rigid.b[:, :4], atol=1e-5 * np.abs(rigid.b).max())
    by_speed = rigid.b[:, 4:] @ [-0.01 * point["lateral_cyclic"], math.radians(0.2)]
    change = model.a[:, 0] - rigid.a[:, 0]  # of u, with the steps of the differences
    np.testing.assert_allclose(change, by_speed * point["u"] / 15.0, atol=2e-3 * np.abs(by_speed).max())
    mixer = Mixer(scheduled)
    mixer.set_target(point.controls)
    np.testing.assert_array_equal(mixer.move(0.0), point.swashplate)
    flight = simulate(scheduled, point, point.controls, 0.2)
    assert abs(flight["V"][-1] - 15.0) < 0.01


@pytest.mark.parametrize(
    ("entry", "text"),
    [
        (
            {"airspeed": [1.0, 1.0], "offset_deg": [0.0, 0.0]},
            r"schedule\[0\].airspeed: allowed are one or more numbers",
        ),
        ({"airspeed": [0.0, 1.0], "offset_deg": [0.0]}, r"schedule\[0\].offset_deg: allowed is a list of 2"),
        ({"airspeed": [0.0], "factor": [0.0]}, r"schedule\[0\].factor: allowed with a control only"),
        (
            {"control": "knob", "airspeed": [0.0], "factor": [0.0]},
            r"schedule\[0\].control = 'knob': allowed are collective",
        ),
    ],
)
def test_wrong_schedules_are_refused(entry, text):
    """One line that names the key."""
    with pytest.raises(AircraftError, match=text):
        aircraft([{"angle": "collective", **entry}])


def test_hash_of_files_without_a_schedule_stays():
    """An empty list is what older files have."""
    data = aircraft_data()
    kept = Aircraft.from_dict(data).parameter_hash
    for rotor in data["rotors"]:
        rotor["schedule"] = []
    assert Aircraft.from_dict(data).parameter_hash == kept
    assert aircraft(SCHEDULE).parameter_hash != aircraft().parameter_hash
