"""Aircraft files: what they hold, what is refused and how it is said, and aircraft of other shapes."""

import copy
import dataclasses
import json
import math
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from helpers import is_finite_model, model_numbers
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from ruamel.yaml import YAML
from scipy.spatial.transform import Rotation

from sbs_sim import Aircraft, simulate, trim, validation
from sbs_sim.aircraft import paths
from sbs_sim.aircraft.declaration import schema_of
from sbs_sim.aircraft.description import Rotor
from sbs_sim.aircraft.paths import unit_of
from sbs_sim.config_file import config_folder
from sbs_sim.errors import AircraftError
from sbs_sim.model.state import CONTROL_NAMES, RATES, VELOCITY

DATA = Path(__file__).resolve().parents[1] / "data"
SHIPPED = sorted(path.stem for path in (config_folder() / "aircraft").glob("*.yaml"))
SBS_TEXT = (config_folder() / "aircraft" / "sbs.yaml").read_text(encoding="utf-8")
SCHEMA = json.loads((config_folder() / "aircraft.schema.json").read_text(encoding="utf-8"))
AIRFOIL_NAMES = ", ".join(sorted(path.stem for path in (config_folder() / "airfoils").glob("*.csv")))
YAML_FILE = YAML(typ="safe", pure=True)


def separate(value):
    """Copy that shares nothing: merge keys make the rotors of the file share lists."""
    if isinstance(value, dict):
        return {key: separate(item) for key, item in value.items()}
    return [separate(item) for item in value] if isinstance(value, list) else value


SBS = separate(YAML_FILE.load(SBS_TEXT))


def sbs_data():
    return copy.deepcopy(SBS)


def put(data, path, value):
    for key, following in pairwise(path):
        data = data[key] if isinstance(key, int) else data.setdefault(key, [] if isinstance(following, int) else {})
    data[path[-1]] = value


def get(data, path):
    for key in path:
        data = data[key]
    return data


def changed(path, value):
    data = sbs_data()
    put(data, path, value)
    return data


def without(*path):
    data = sbs_data()
    del get(data, path[:-1])[path[-1]]
    return data


def refusal(data):
    """The one line that refuses a mapping."""
    with pytest.raises(AircraftError) as caught:
        Aircraft.from_dict(data)
    return str(caught.value)


def refusal_of_text(folder, text):
    """The one line that refuses a file, without the file's name, which must be its beginning."""
    path = folder / "broken.yaml"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(AircraftError) as caught:
        Aircraft.load(path)
    line = str(caught.value)
    assert line.startswith(f"{path}: ")
    assert "\n" not in line
    return line.removeprefix(f"{path}: ")


# -- the aircraft that come with the package --------------------------------------------------------


@pytest.mark.parametrize("name", ["sbs", "sbs_paper"])
def test_values_are_those_of_table_6(name, request):
    """Mazzeo, Pavel, Leali, Giulietti, Table 6; the solidity tells how the printed table is to be read."""
    aircraft = request.getfixturevalue(name)
    assert aircraft.name == name
    assert aircraft.body.mass == 20.62
    assert aircraft.body.inertia.tolist() == [[3.532, -0.001, -0.052], [-0.001, 2.222, 0], [-0.052, 0, 5.342]]
    assert len(aircraft.rotors) == 2
    assert [rotor.hub.tolist() for rotor in aircraft.rotors] == [[0, -0.645, 0.066], [0, 0.645, 0.066]]
    assert [rotor.rotation for rotor in aircraft.rotors] == [-1, 1]
    for rotor in aircraft.rotors:
        assert rotor.blades == 3
        assert rotor.radius == 0.505
        assert rotor.chord_root == rotor.chord_tip == 0.051
        assert rotor.hinge_offset == 0.075
        assert rotor.flap_hinge_offset == 0.0075
        assert rotor.blade_mass == 0.1613
        assert rotor.blade_cg == 0.224
        assert rotor.flap_spring == 162
        assert rotor.lag_spring == 0
        assert rotor.pitch_flap_coupling == rotor.pitch_lag_coupling == 0
        assert rotor.twist_root == rotor.twist_tip == 0
        assert rotor.shaft_direction.tolist() == [0, 0, -1]
        assert rotor.speed == pytest.approx(80 * math.pi, rel=1e-15)  # 2400 rpm
        solidity = rotor.blades * rotor.chord_root / (math.pi * rotor.radius)
        assert solidity == pytest.approx(0.0964, abs=5e-5)


def test_the_two_aircraft_differ_in_what_the_paper_leaves_open_only(sbs, sbs_paper):
    assert (sbs.options.coupling, sbs.options.hub_moment, sbs.options.flap_inertia) == (
        "complete",
        "complete",
        "hinge_to_tip",
    )
    assert (sbs_paper.options.coupling, sbs_paper.options.hub_moment, sbs_paper.options.flap_inertia) == (
        "paper",
        "paper",
        "axis_to_tip",
    )
    for ours, theirs in zip(sbs.rotors, sbs_paper.rotors, strict=True):
        differing = {
            field.name
            for field in dataclasses.fields(Rotor)
            if not np.array_equal(getattr(ours, field.name), getattr(theirs, field.name))
        }
        assert differing == {"swashplate_phase", "airfoil", "lag_damping"}
        assert theirs.lag_damping == 0.0  # Table 6 has no damper
        assert ours.swashplate_phase == pytest.approx(math.radians(-72))
        assert theirs.swashplate_phase == 0
        assert (ours.airfoil, theirs.airfoil) == ("naca0012", "linear_573")
    assert sbs.environment == sbs_paper.environment


def test_degrees_and_revolutions_become_radians():
    data = sbs_data()
    rotor = data["rotors"][0]
    rotor["twist_deg"] = {"root": 12.0, "tip": -3.0}
    rotor["swashplate_phase_deg"] = -45.0
    rotor["swashplate_rate_deg"] = 90.0
    rotor["collective_range_deg"] = [-5.0, 15.0]
    rotor["cyclic_range_deg"] = [-6.0, 7.0]
    rotor["speed_rpm"] = 60.0
    data["controls"]["lateral_cyclic"]["range_deg"] = [-9.0, 10.0]
    aircraft = Aircraft.from_dict(data)
    loaded = aircraft.rotors[0]
    degree = math.pi / 180
    assert loaded.twist_root == pytest.approx(12 * degree, rel=1e-15)
    assert loaded.twist_tip == pytest.approx(-3 * degree, rel=1e-15)
    assert loaded.swashplate_phase == pytest.approx(-45 * degree, rel=1e-15)
    assert loaded.swashplate_rate == pytest.approx(90 * degree, rel=1e-15)
    assert loaded.collective_range == pytest.approx((-5 * degree, 15 * degree), rel=1e-15)
    assert loaded.cyclic_range == pytest.approx((-6 * degree, 7 * degree), rel=1e-15)
    assert loaded.speed == pytest.approx(2 * math.pi, rel=1e-15)
    assert aircraft.control_ranges["lateral_cyclic"] == pytest.approx((-9 * degree, 10 * degree), rel=1e-15)


def test_merge_keys_inherit_and_override(sbs):
    first, second = sbs.rotors
    assert (first.name, second.name) == ("MR1", "MR2")
    assert second.hub[1] == -first.hub[1]
    assert sbs.mixing[3:].tolist() == [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 1]]
    assert sbs.mixing[:3].tolist() == [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, -1]]
    assert second.flap_spring == first.flap_spring == 162


def test_load_takes_names_and_paths(tmp_path, monkeypatch, sbs):
    (tmp_path / "mine.yaml").write_text(SBS_TEXT.replace("name: sbs", "name: mine"))
    assert Aircraft.load(tmp_path / "mine.yaml").name == "mine"
    assert Aircraft.load(str(tmp_path / "mine.yaml")).name == "mine"
    monkeypatch.chdir(tmp_path)
    assert Aircraft.load("mine.yaml").name == "mine"
    assert Aircraft.load("sbs").name == sbs.name


def test_an_aircraft_cannot_be_changed(sbs):
    with pytest.raises(dataclasses.FrozenInstanceError):
        sbs.body.mass = 1.0
    for array in (sbs.body.inertia, sbs.body.flat_plate_areas, sbs.rotors[0].hub, sbs.mixing):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1.0


# -- what follows from the values -------------------------------------------------------------------


def test_fuselage_and_turning_blades_make_up_the_aircraft():
    """Blades as they are at many azimuths of a tilted hub, added to the fuselage, are the printed totals."""
    data = sbs_data()
    data["rotors"][0]["shaft_direction"] = [0.3, -0.4, -1.0]
    data["rotors"][0]["hub"] = [0.2, -0.6, -0.1]
    aircraft = Aircraft.from_dict(data)
    mass, first, inertia = aircraft.fuselage()
    for rotor in aircraft.rotors:
        up = rotor.shaft_direction / np.linalg.norm(rotor.shaft_direction)
        outwards = np.cross(up, [0.0, 1.0, 0.0])
        outwards /= np.linalg.norm(outwards)
        e0, length = rotor.hinge_offset, rotor.blade_length
        # three points with the blade's mass, first and second moment
        points = np.array([0.0, length / 2, length])
        moments = [rotor.blade_mass, rotor.first_moment, rotor.second_moment]
        masses = np.linalg.solve(np.vander(points, increasing=True).T, moments)
        for angle in np.arange(8) * math.pi / 4:
            arm = Rotation.from_rotvec(angle * up).apply(outwards)
            for point, point_mass in zip(points, masses * rotor.blades / 8, strict=True):
                place = rotor.hub + (e0 + point) * arm
                mass += point_mass
                first = first + point_mass * place
                inertia = inertia + point_mass * (place @ place * np.eye(3) - np.outer(place, place))
    assert mass == pytest.approx(aircraft.body.mass, rel=1e-14)
    np.testing.assert_allclose(first, 0.0, atol=1e-14)
    np.testing.assert_allclose(inertia, aircraft.body.inertia, atol=1e-13)


def test_tables_along_the_blade(sbs):
    """Stations count from the axis, in shares of the radius; two points from hinge to tip are root and tip."""
    hinge = 0.075 / 0.505
    two = sbs.with_values(
        {
            "rotors.chord": {"stations": [hinge, 1.0], "values": [0.06, 0.04]},
            "rotors.twist_deg": {"stations": [hinge, 1.0], "values": [10.0, -4.0]},
        }
    )
    line = sbs.with_values({"rotors.chord": {"root": 0.06, "tip": 0.04}, "rotors.twist_deg": {"root": 10, "tip": -4}})
    np.testing.assert_allclose(two.rotors[0].elements(20), line.rotors[0].elements(20), rtol=1e-13)
    assert two.rotors[0].mean_chord == pytest.approx(0.05, rel=1e-14)
    bent = {"stations": [0.0, 0.5, 0.8], "values": [0.02, 0.06, 0.03]}
    rotor = sbs.with_value("rotors.chord", bent).rotors[0]
    span, chord, *_ = rotor.elements(50)
    radius = (0.075 + span) / 0.505
    expected = np.where(radius < 0.5, 0.02 + 0.08 * radius, np.maximum(0.06 - 0.1 * (radius - 0.5), 0.03))
    np.testing.assert_allclose(chord, expected, rtol=1e-12)
    area = (0.02 + 0.08 * hinge + 0.06) / 2 * (0.5 - hinge) + 0.045 * 0.3 + 0.03 * 0.2
    assert rotor.mean_chord == pytest.approx(area / (1 - hinge), rel=1e-12)
    changed = sbs.with_value("rotors.chord", bent).with_value("rotors.MR1.chord.values[1]", 0.07)
    assert [own.chord_values[1] for own in changed.rotors] == [0.07, 0.06]


def without_blade_mass(rotor):
    return {key: value for key, value in rotor.items() if key not in ("blade_mass", "blade_cg", "blade_inertia")}


HINGE, LENGTH = 0.075, 0.43  # m, of sbs
# Mass per length m(s) over s = 0 at the flap hinge to L, and its integrals [kg, kg m, kg m^2].
DISTRIBUTIONS = {
    "uniform": ({"stations": [0.0, 1.0], "values": [0.4, 0.4]}, [0.4 * LENGTH ** (n + 1) / (n + 1) for n in range(3)]),
    "uniform, given between two stations only": (
        {"stations": [0.5, 0.6], "values": [0.4, 0.4]},
        [0.4 * LENGTH ** (n + 1) / (n + 1) for n in range(3)],
    ),
    "tapered to nothing": (  # m = 0.8 (1 - s / L)
        {"stations": [HINGE / 0.505, 1.0], "values": [0.8, 0.0]},
        [0.8 * LENGTH ** (n + 1) / ((n + 1) * (n + 2)) for n in range(3)],
    ),
    "tip mass": (
        {"stations": [0.0, 1.0], "values": [0.0, 0.0], "tip_mass": 0.05},
        [0.05 * LENGTH**n for n in range(3)],
    ),
    "uniform with a tip mass": (
        {"stations": [0.0, 1.0], "values": [0.4, 0.4], "tip_mass": 0.05},
        [0.4 * LENGTH ** (n + 1) / (n + 1) + 0.05 * LENGTH**n for n in range(3)],
    ),
    "steps, and a root that does not flap": (
        {"stations": [0.0, 0.1, 0.1, 0.5, 0.5, 1.0], "values": [90.0, 90.0, 0.5, 0.5, 0.3, 0.3]},
        [
            (0.5 * (0.2525 - HINGE) ** (n + 1) + 0.3 * (LENGTH ** (n + 1) - (0.2525 - HINGE) ** (n + 1))) / (n + 1)
            for n in range(3)
        ],
    ),
}


@pytest.mark.parametrize("case", DISTRIBUTIONS)
def test_integrals_of_a_distributed_mass(sbs, case):
    table, (mass, first, second) = DISTRIBUTIONS[case]
    aircraft = sbs.with_value("rotors.mass_distribution", table)
    rotor = aircraft.rotors[0]
    assert rotor.blade_mass == pytest.approx(mass, rel=1e-14)
    assert (rotor.first_moment, rotor.second_moment) == pytest.approx((first, second), rel=1e-14)
    given = {"blade_mass": rotor.blade_mass, "blade_cg": rotor.blade_cg, "blade_inertia": rotor.blade_inertia}
    if rotor.first_moment * rotor.blade_cg <= second:  # a point has equal sides, but for rounding
        integrals = sbs.with_values({f"rotors.{key}": value for key, value in given.items()})
        assert integrals.parameter_hash == aircraft.parameter_hash
        assert model_arrays(integrals) == model_arrays(aircraft)


def test_a_distributed_mass_takes_the_place_of_its_integrals(sbs):
    """Of every rotor or of one; its stations may then be changed, and move with the radius."""
    table = {"stations": [0.0, 1.0], "values": [0.4, 0.4]}
    one = sbs.with_value("rotors.MR2.mass_distribution", table)
    assert [rotor.blade_mass for rotor in one.rotors] == [0.1613, pytest.approx(0.172)]
    short = one.with_values({"rotors.MR2.mass_distribution.values[1]": 0.0, "rotors[1].radius": 0.405})
    inner, length = 0.4 * 0.33 / 0.405, 0.33  # 0.4 (1 - r / R) at the hinge
    assert short.rotors[1].blade_mass == pytest.approx(inner * length / 2)
    assert Aircraft.from_dict(one.data).parameter_hash == one.parameter_hash


def test_mass_first_moment_and_inertia_of_a_blade_are_independent(sbs):
    """UH-60A after Howlett, NASA CR-166309: no uniform blade has these three."""
    blade = {"mass": 116.527879853, "first_moment": 385.66081570248, "inertia": 2050.8103068}
    rotor = dataclasses.replace(
        sbs.rotors[0],
        radius=8.177784,
        hinge_offset=0.381,
        flap_hinge_offset=0.0,
        flap_spring=0.0,
        blade_mass=blade["mass"],
        blade_cg=blade["first_moment"] / blade["mass"],
        blade_inertia=blade["inertia"],
    )
    assert (rotor.first_moment, rotor.second_moment) == pytest.approx((blade["first_moment"], blade["inertia"]))
    # 1 + e S / I = 1.07165 as in the report; its lag frequency is the root of the second part
    assert 1 + rotor.hinge_offset * rotor.first_moment / rotor.second_moment == pytest.approx(1.07165, abs=5e-6)
    uniform = dataclasses.replace(rotor, blade_inertia=None).second_moment
    assert uniform == pytest.approx(116.527879853 * 7.796784**2 / 3)


def test_a_given_inertia_counts_in_every_reading(sbs_paper):
    """It takes the place of both choices of options.flap_inertia, in the equations and in the hub loads."""
    assert sbs_paper.options.flap_inertia == "axis_to_tip"
    given = sbs_paper.with_value("rotors.blade_inertia", 0.0123)
    blade = given.model().blades[0]
    assert blade["second_moment"][0] == blade["hub_second_moment"][0] == 0.0123
    assert given.with_value("options.flap_inertia", "hinge_to_tip").model().blades[0]["second_moment"][0] == 0.0123
    assert given.parameter_hash != sbs_paper.parameter_hash


@pytest.mark.parametrize("count", [1, 7, 20])
def test_elements_cover_the_blade(sbs, count):
    rotor = dataclasses.replace(
        sbs.rotors[0],
        root_cutout=0.03,
        tip_loss=0.95,
        chord_root=0.06,
        chord_tip=0.04,
        twist_root=0.2,
        twist_tip=-0.1,
    )
    span, chord, half_area, lift, twist = rotor.elements(count)
    width = (0.43 - 0.03) / count
    np.testing.assert_allclose(span, 0.03 + width * (np.arange(count) + 0.5), rtol=1e-13)
    np.testing.assert_allclose(chord, 0.06 - 0.02 * span / 0.43, rtol=1e-13)
    np.testing.assert_allclose(twist, 0.2 - 0.3 * span / 0.43, atol=1e-13)
    # a trapezium is integrated exactly by its mid-points
    assert 2 * half_area.sum() == pytest.approx(0.4 * (0.06 - 0.02 * 0.23 / 0.43), rel=1e-12)
    # lift ends at 0.95 R, whatever the elements' borders are
    assert lift.sum() * width == pytest.approx(0.95 * 0.505 - 0.075 - 0.03, rel=1e-12)


# -- schema and dataclasses -------------------------------------------------------------------------


def schema_leaves(schema, path=()):
    """Paths of all values that the schema knows; a list of mappings stands for its first entry.

    Where the file has names of its own, these are the controls of `sbs`.
    """
    if schema.get("type") == "object":
        known = schema.get("properties", dict.fromkeys(CONTROL_NAMES, schema["additionalProperties"]))
        for key, part in known.items():
            yield from schema_leaves(part, (*path, key))
    elif schema.get("type") == "array" and schema["items"].get("type") == "object":
        yield from schema_leaves(schema["items"], (*path, 0))
    else:
        yield path


# in the place of other keys, or of what sbs does not have: test_atmosphere.py, test_surfaces.py, test_descent.py,
# test_ring.py
ELSEWHERE = ("drives", "stand", "altitude", "temperature_offset", "surfaces", "fuselage", "flap_hinge", "schedule")
ELSEWHERE += ("ground", "contact_points")
ELSEWHERE += ("quarter_chord", "chordwise_cg", "undersling")
ELSEWHERE += ("descent", "ring_unsteadiness", "tip_loss_model", "profile_drag", "unsteady_airfoil", "dynamic_stall")
LEAVES = [
    path
    for path in schema_leaves(SCHEMA)
    if (path[0] != "controls" or path[-1] == "range_deg") and not {*ELSEWHERE} & {*path}
]
OTHER_VALUES = {
    ("name",): "another",
    ("description",): "another",
    ("options", "coupling"): "complete",
    ("options", "interpolation"): "linear",
    ("options", "interference"): "skewed_wake",
    ("options", "hub_moment"): "complete",
    ("options", "flap_inertia"): "hinge_to_tip",
    ("rotors", 0, "name"): "another",
    ("rotors", 0, "airfoil"): "linear_573",
    ("rotors", 0, "rotation"): 1,
    ("rotors", 0, "blades"): 4,
    ("rotors", 0, "shaft_direction"): [0.1, 0.2, -0.9],
    ("rotors", 0, "lag_spring"): 3.0,
    ("rotors", 0, "blade_inertia"): 0.0123,
    ("rotors", 0, "blade_lag_damping"): [1.0, 0.0, 1.0],
    ("rotors", 0, "flap_rest_deg"): 2.0,
    ("rotors", 0, "induced_power_factor"): 1.15,
    ("rotors", 0, "drag_increment"): 0.002,
    ("rotors", 0, "lag_rest_deg"): -7.0,
    ("options", "elements"): 21,
}
OPTIONAL = {
    "speed_of_sound",
    "interpolation",
    "interference",
    "swashplate_offset_deg",
    "schedule",
    "blade_inertia",
    "flap_rest_deg",
    "induced_power_factor",
    "drag_increment",
    "lag_rest_deg",
    "blade_lag_damping",
    "lag_damper",
    "lag_stop",
    "duct",
    "stall_lags",
    "stations",
    "values",
    "tip_mass",
}
NOT_IN_THE_MODEL = {
    "name",
    "description",
    "controls",
    "mixing",
    "swashplate_offset_deg",
    "collective_range_deg",
    "cyclic_range_deg",
}
NOT_IN_THE_MODEL |= {"swashplate_rate_deg", "speed_of_sound"}


def leaf_id(path):
    return ".".join(map(str, path))


def other_value(path, value):
    """Another allowed value."""
    if path in OTHER_VALUES:
        return OTHER_VALUES[path]
    if path[-2:-1] and path[-2] in ("collective", "lateral_cyclic", "longitudinal_cyclic") and value is None:
        return 0.25  # a factor of the mixing that the file leaves out
    if path == ("body", "inertia"):
        return [[3.6, 0.0, -0.05], [0.0, 2.3, 0.0], [-0.05, 0.0, 5.4]]
    if isinstance(value, list):
        return value[1:] + value[:1] if isinstance(value[0], str) else [item * 0.9 + 0.01 for item in value]
    return value * 0.99 if value else 0.01


def flattened(aircraft):
    """All that was read, as plain values that can be compared."""
    return repr(
        {
            "aircraft": {
                field.name: getattr(aircraft, field.name)
                for field in dataclasses.fields(aircraft)
                if field.name != "airfoils"
            },
            "airfoils": sorted(aircraft.airfoils),
        }
    )


def model_arrays(aircraft):
    return repr([(name, array.shape, array.tobytes()) for name, array in model_numbers(aircraft).items()])


@pytest.fixture(scope="module")
def read_as_it_is():
    """What is read of the file in the coupling that allows every option."""
    data = sbs_data()
    data["options"] |= {"coupling": "paper", "hub_moment": "paper", "flap_inertia": "axis_to_tip"}
    aircraft = Aircraft.from_dict(data)
    return data, flattened(aircraft), model_arrays(aircraft)


@pytest.mark.parametrize("path", LEAVES, ids=leaf_id)
def test_every_key_of_the_schema_is_read_and_used(path, read_as_it_is):
    original, everything, arrays = read_as_it_is
    data = copy.deepcopy(original)
    if path == ("options", "coupling"):
        data["options"] |= {"hub_moment": "complete", "flap_inertia": "hinge_to_tip"}
        aircraft = Aircraft.from_dict(data)
        everything, arrays = flattened(aircraft), model_arrays(aircraft)
    try:
        value = get(data, path)
    except KeyError:
        value = None
        assert path[:3] == ("rotors", 0, "mixing") or OPTIONAL & set(path), "a key that sbs.yaml does not show"
    if path[2:3] == ("lag_damper",):
        data["rotors"][0]["lag_damper"] = {"c": 0.02, "d": 0.03}
    if path[2:3] == ("lag_stop",):
        data["rotors"][0]["lag_stop"] = {"range_deg": [-11.0, 14.0], "stiffness": 30.0, "damping": 0.1}
        aircraft, value = Aircraft.from_dict(data), get(data, path)
        everything, arrays = flattened(aircraft), model_arrays(aircraft)
    if path[2:3] == ("duct",):
        data["rotors"][0]["duct"] = {"exit_area": 0.9}
        aircraft, value = Aircraft.from_dict(data), 0.9
        everything, arrays = flattened(aircraft), model_arrays(aircraft)
    if path[2:3] == ("stall_lags",):
        data["rotors"][0]["dynamic_stall"] = "leishman_beddoes"
        aircraft, value = Aircraft.from_dict(data), 5.0
        everything, arrays = flattened(aircraft), model_arrays(aircraft)
    if path[-1] in ("stations", "values", "tip_mass"):
        values = ["linear_573", "naca0012"] * 2 if path[2] == "outboard_airfoils" else [0.05, 0.04, 0.03]
        data["rotors"][0][path[2]] = {"stations": [0.2, 0.6, 1.0], "values": values[:3]}
        if path[2] == "mass_distribution":
            data["rotors"][0] = without_blade_mass(data["rotors"][0])
            data["rotors"][0][path[2]]["tip_mass"] = 0.001
        aircraft, value = Aircraft.from_dict(data), get(data, path)
        everything, arrays = flattened(aircraft), model_arrays(aircraft)
    put(data, path, other_value(path, value))
    aircraft = Aircraft.from_dict(data)
    assert flattened(aircraft) != everything
    if not NOT_IN_THE_MODEL & set(path):
        assert model_arrays(aircraft) != arrays


def test_every_key_is_demanded_but_those_with_a_default_and_factors_of_mixing():
    for path in LEAVES:
        if OPTIONAL & {*path} or "mixing" in path or path[0] in ("description", "controls"):
            continue
        data = sbs_data()
        del get(data, path[:-1])[path[-1]]
        assert refusal(data) == f"{leaf_id(path).replace('.0.', '[0].')}: missing key"
    assert Aircraft.from_dict(without("description")).description == ""
    assert Aircraft.from_dict(without("environment", "speed_of_sound")).environment.speed_of_sound == 340.3


# -- what is refused, and how it is said ------------------------------------------------------------

BODY_KEYS = "mass, inertia, flat_plate_areas, surfaces, fuselage, stand"
TOO_LONG = "x" * 300
R0 = ("rotors", 0)
R1 = ("rotors", 1)

REFUSED = {
    "unknown key at the top": (("colour",), "red", "colour: unknown key, allowed are name, description, "),
    "unknown key": (("body", "colour"), "red", f"body.colour: unknown key, allowed are {BODY_KEYS}"),
    "unknown nested key": (
        (*R1, "chord", "middle"),
        0.05,
        "rotors[1].chord.middle: unknown key, allowed are root, tip, stations, values",
    ),
    "unknown control in a mixing": (
        (*R1, "mixing", "collective", "pedal"),
        1.0,
        "rotors[1].mixing.collective.pedal: unknown key, allowed are " + ", ".join(CONTROL_NAMES),
    ),
    "unknown key that is a number": (("body", 3), 1, f"body.3: unknown key, allowed are {BODY_KEYS}"),
    "unknown key of two lines": (("body", "a\nb"), 1, f"body.'a\\nb': unknown key, allowed are {BODY_KEYS}"),
    "text for a number": (("body", "mass"), "20.62", "body.mass = '20.62': allowed is a number"),
    "bool for a number": (("body", "mass"), True, "body.mass = True: allowed is a number"),
    "nothing for a number": (("body", "mass"), None, "body.mass = None: allowed is a number"),
    "list for a number": (("body", "mass"), [20.62], "body.mass = [20.62]: allowed is a number"),
    "number for a list": ((*R0, "hub"), 1.0, "rotors[0].hub = 1.0: allowed is a list"),
    "number for a mapping": (("body",), 1.0, "body = 1.0: allowed is a mapping of keys to values"),
    "number for a text": (("name",), 7, "name = 7: allowed is a text"),
    "empty text": (("name",), "", "name = '': allowed is a text that is not empty"),
    "short list": ((*R1, "hub"), [0.0, 1.0], "rotors[1].hub = [0.0, 1.0]: allowed is a list of at least 3"),
    "long list": ((*R0, "hub"), [0, 1, 2, 3], "rotors[0].hub = [0, 1, 2, 3]: allowed is a list of at most 3"),
    "short row of the inertia": (
        ("body", "inertia", 1),
        [0.0, 1.0],
        "body.inertia[1] = [0.0, 1.0]: allowed is a list of at least 3",
    ),
    "text in a list": (
        ("body", "inertia", 1, 1),
        "2.2",
        "body.inertia[1][1] = '2.2': allowed is a number",
    ),
    "no mass": (("body", "mass"), 0.0, "body.mass = 0.0: allowed is >= 0.001"),
    "negative mass": (("body", "mass"), -20.62, "body.mass = -20.62: allowed is >= 0.001"),
    "mass that is not a number": (("body", "mass"), math.nan, "body.mass = nan: allowed is a finite number"),
    "infinite mass": (("body", "mass"), math.inf, "body.mass = inf: allowed is <= 1000000.0"),
    "inertia that is not a number": (
        ("body", "inertia", 0, 2),
        math.nan,
        "body.inertia[0][2] = nan: allowed is a finite number",
    ),
    "inertia too great for a float": (
        ("body", "inertia", 0, 0),
        10**400,
        "body.inertia[0][0] = 1" + "0" * 56 + "...: allowed is <= 1000000000.0",
    ),
    "twist of minus infinity": (
        (*R0, "twist_deg", "tip"),
        -math.inf,
        "rotors[0].twist_deg.tip = -inf: allowed is >= -90",
    ),
    "inertia not symmetric": (
        ("body", "inertia", 0, 1),
        0.5,
        "body.inertia = [[3.532, 0.5, -0.052], [-0.001, 2.222, 0.0], [-0.052, 0.0, 5.342]]:"
        " allowed is a symmetric matrix",
    ),
    "inertia not positive definite": (
        ("body", "inertia", 1, 1),
        -2.222,
        "body.inertia = [[3.532, -0.001, -0.052], [-0.001, -2.222, 0.0], [-0.052, 0.0, 5.342]]:"
        " allowed is a positive definite matrix",
    ),
    "inertia of no body": (
        ("body", "inertia", 2, 2),
        6.0,
        "body.inertia = [[3.532, -0.001, -0.052], [-0.001, 2.222, 0.0], [-0.052, 0.0, 6.0]]:"
        " allowed are principal moments of which none exceeds the sum of the others",
    ),
    "hinge beyond the radius": (
        (*R0, "hinge_offset"),
        0.6,
        "rotors[0].hinge_offset = 0.6: allowed is < 0.505, the radius",
    ),
    "hinge at the tip": (
        (*R0, "hinge_offset"),
        0.505,
        "rotors[0].hinge_offset = 0.505: allowed is < 0.505, the radius",
    ),
    "flap hinge further from the lag hinge than from the axis": (
        (*R1, "flap_hinge_offset"),
        0.08,
        "rotors[1].flap_hinge_offset = 0.08: allowed is <= 0.075, the hinge_offset",
    ),
    "profile that begins beyond the tip": (
        (*R1, "root_cutout"),
        0.5,
        "rotors[1].root_cutout = 0.5: allowed is < 0.43, from the flap hinge to the tip",
    ),
    "no blades": ((*R0, "blades"), 0, "rotors[0].blades = 0: allowed is >= 2"),
    "one blade": ((*R0, "blades"), 1, "rotors[0].blades = 1: allowed is >= 2"),
    "three and a half blades": ((*R0, "blades"), 3.5, "rotors[0].blades = 3.5: allowed is an integer"),
    "blade whose mass is too far out": (
        (*R0, "blade_cg"),
        0.25,
        "rotors[0].blade_cg = 0.25: allowed is <= 0.248261, L/sqrt(3): the blade's second moment is m_b L^2/3",
    ),
    "inertia less than that of a point mass": (
        (*R0, "blade_inertia"),
        0.008,
        "rotors[0].blade_inertia = 0.008: allowed is >= 0.00809339, blade_mass blade_cg^2",
    ),
    "factors of dampers of another number of blades": (
        (*R0, "blade_lag_damping"),
        [1.0, 0.0],
        "rotors[0].blade_lag_damping = [1.0, 0.0]: allowed is a list of 3, one of each blade",
    ),
    "two ways to give the chord": (
        (*R0, "chord", "stations"),
        [0.0, 1.0],
        "rotors[0].chord: has root, tip, stations, allowed are root and tip, or stations and values",
    ),
    "airfoils of two lengths": (
        (*R0, "outboard_airfoils"),
        {"stations": [0.5, 0.8], "values": ["naca0015"]},
        "rotors[0].outboard_airfoils.values: allowed are 2 names, one of each station, not 1",
    ),
    "airfoils that do not follow one another": (
        (*R1, "outboard_airfoils"),
        {"stations": [0.8, 0.5], "values": ["naca0015", "naca0012"]},
        "rotors[1].outboard_airfoils.stations = [0.8, 0.5]: allowed are increasing numbers",
    ),
    "airfoils without stations": (
        (*R1, "outboard_airfoils"),
        {"values": ["naca0015"]},
        "rotors[1].outboard_airfoils.stations: missing key",
    ),
    "airfoils over both axes": (
        (*R1, "outboard_airfoils"),
        {"stations": [0.8], "values": ["sc1095r8"]},
        "rotors[1].outboard_airfoils.values[0] = 'sc1095r8': is over the Mach number, allowed are tables over the"
        " Reynolds number as the one inboard",
    ),
    "a table without values": ((*R1, "chord"), {"stations": [0.0, 1.0]}, "rotors[1].chord.values: missing key"),
    "no twist": ((*R0, "twist_deg"), {}, "rotors[0].twist_deg: missing key"),
    "a table of two lengths": (
        (*R1, "chord"),
        {"stations": [0.0, 1.0], "values": [0.05, 0.05, 0.04]},
        "rotors[1].chord.values: allowed are 2 numbers, one of each station, not 3",
    ),
    "stations that do not increase": (
        (*R0, "twist_deg"),
        {"stations": [0.0, 0.5, 0.5], "values": [0.0, 1.0, 2.0]},
        "rotors[0].twist_deg.stations = [0.0, 0.5, 0.5]: allowed are increasing numbers",
    ),
    "duct without an exit": (
        (*R0, "duct"),
        {"turning": 0.5},
        "rotors[0].duct.exit_area: missing; allowed is 0.25 to 4",
    ),
    "a measured descent without its power factor": (
        (*R0, "descent"),
        "measured",
        "rotors[0].induced_power_factor = 1.0: allowed is 1.1, with descent = measured",
    ),
    "a measured descent of a duct": (
        R1,
        {**sbs_data()["rotors"][1], "duct_expansion": 0.7, "induced_power_factor": 1.1, "descent": "measured"},
        "rotors[1].descent = measured: allowed is momentum, of a rotor with a duct",
    ),
    "a distributed mass beside its integral": (
        (*R0, "mass_distribution"),
        {"stations": [0.0, 1.0], "values": [0.4, 0.4]},
        "rotors[0].blade_cg = 0.224: allowed is to leave the key out where the rotor has mass_distribution; "
        "rotors[0].blade_mass = 0.1613: allowed is to leave the key out where the rotor has mass_distribution",
    ),
    "a distribution without mass": (
        R0,
        {**without_blade_mass(sbs_data()["rotors"][0]), "mass_distribution": {"stations": [0, 1], "values": [0, 0]}},
        "rotors[0].mass_distribution.values = [0.0, 0.0]: allowed is some mass between flap hinge and tip",
    ),
    "only a tip mass": (
        R0,
        {**without_blade_mass(sbs_data()["rotors"][0]), "mass_distribution": {"tip_mass": 0.1}},
        "rotors[0].mass_distribution.stations: missing key",
    ),
    "stations of mass out of order": (
        R0,
        {**without_blade_mass(sbs_data()["rotors"][0]), "mass_distribution": {"stations": [1, 0.5], "values": [1, 1]}},
        "rotors[0].mass_distribution.stations = [1.0, 0.5]: allowed are numbers in order",
    ),
    "damper without a length": (
        (*R0, "lag_damper"),
        {"damping": 5.0},
        "rotors[0].lag_damper.damping = 5.0: allowed is 0 where both ends of the damper are in one place",
    ),
    "quarter chord without a tip": ((*R0, "quarter_chord"), {"root": 0.01}, "rotors[0].quarter_chord.tip: missing key"),
    "table of the c.g. with a value too many": (
        (*R0, "chordwise_cg"),
        {"stations": [0.2, 1.0], "values": [0.0, 0.01, 0.02]},
        "rotors[0].chordwise_cg.values: allowed are 2 numbers, one of each station, not 3",
    ),
    "c.g. that no blade has": (
        R0,
        {
            **sbs_data()["rotors"][0],
            "blade_inertia": 0.0082,  # nearly all of it at the c.g.
            "chordwise_cg": {"stations": [0.9, 1.0], "values": [0.0, 0.3]},
        },
        "rotors[0].chordwise_cg: no blade of this mass, c.g. and inertia has it; allowed with mass_distribution",
    ),
    "sweep of 80 degrees": (
        (*R0, "quarter_chord"),
        {"stations": [0.2, 0.9, 0.91, 1.0], "values": [0.0, 0.0, -0.03, -0.03]},
        "rotors[0].quarter_chord: a sweep of 80.4 deg: allowed are up to 60",
    ),
    "undersling of a hinge of each blade": (
        (*R0, "undersling"),
        0.02,
        "rotors[0].undersling = 0.02: allowed is 0 where flap_hinge is not teetering",
    ),
    "lag stops on one side": (
        (*R0, "lag_stop"),
        {"range_deg": [1.0, 9.0], "stiffness": 30.0},
        "rotors[0].lag_stop.range_deg = [1.0, 9.0]: allowed are a negative and a positive end",
    ),
    "lag stops too stiff for the default step": (
        (*R0, "lag_stop"),
        {"range_deg": [-9.0, 9.0], "stiffness": 1e6},
        "rotors[0].lag_stop.stiffness = 1e+06: allowed is > 0 and up to 23859.5, 6 per revolution on the inertia"
        " that lag moves, 0.0104925 kg m^2",
    ),
    "lag stops without a range": ((*R0, "lag_stop"), {"stiffness": 9.0}, "rotors[0].lag_stop.range_deg: missing key"),
    "lag stops that creep back": (
        (*R0, "lag_stop"),
        {"range_deg": [-9.0, 9.0], "stiffness": 1000.0, "damping": 10.0},
        "rotors[0].lag_stop.damping = 10: allowed is up to 6.47843, at which a stop does not swing",
    ),
    "no rotors": (("rotors",), [], "rotors = []: allowed is a list of at least 1"),
    "sense of rotation": ((*R0, "rotation"), 2, "rotors[0].rotation = 2: allowed is one of 1, -1"),
    "sense of rotation that is a bool": (
        (*R0, "rotation"),
        True,
        "rotors[0].rotation = True: allowed is one of 1, -1",
    ),
    "shaft without direction": (
        (*R0, "shaft_direction"),
        [0, 0, 0],
        "rotors[0].shaft_direction = [0.0, 0.0, 0.0]: allowed is a vector that is not zero",
    ),
    "unknown airfoil": (
        (*R1, "airfoil"),
        "naca9999",
        f"rotors[1].airfoil = 'naca9999': allowed are a file's path or one of {AIRFOIL_NAMES}",
    ),
    "airfoil with a name that no file can have": (
        (*R1, "airfoil"),
        TOO_LONG,
        f"rotors[1].airfoil = '{TOO_LONG}': allowed are a file's path or one of {AIRFOIL_NAMES}",
    ),
    "rotors of one name": ((*R1, "name"), "MR1", "rotors[1].name = 'MR1': used twice"),
    "blades heavier than the aircraft": (
        ("body", "mass"),
        0.9,
        "body.mass = 0.9: allowed is > 0.9678, the mass of all blades",
    ),
    "blades with more inertia than the aircraft": (
        (*R1, "blade_mass"),
        3.0,
        "body.inertia without the blades = [[-0.933117, -0.001, -0.052], [-0.001, 1.702423, 0.36253],"
        " [-0.052, 0.36253, 0.43993]]: allowed is a positive definite matrix",
    ),
    "ends of a control's range swapped": (
        ("controls", "collective", "range_deg"),
        [20.0, 0.0],
        "controls.collective.range_deg = [20, 0]: allowed is a lower end below the upper one",
    ),
    "ends of a collective's range swapped": (
        (*R1, "collective_range_deg"),
        [20.0, 0.0],
        "rotors[1].collective_range_deg = [20, 0]: allowed is a lower end below the upper one",
    ),
    "ends of a cyclic's range swapped": (
        (*R1, "cyclic_range_deg"),
        [1.0, -1.0],
        "rotors[1].cyclic_range_deg = [1, -1]: allowed is a lower end below the upper one",
    ),
    "no rate": ((*R0, "swashplate_rate_deg"), 0, "rotors[0].swashplate_rate_deg = 0: allowed is > 0"),
    "unknown coupling": (
        ("options", "coupling"),
        "both",
        "options.coupling = 'both': allowed is one of complete, paper",
    ),
    "the paper's hub moment in the complete coupling": (
        ("options", "hub_moment"),
        "paper",
        "options.hub_moment = 'paper': allowed with options.coupling = paper only",
    ),
    "the paper's inertia in the complete coupling": (
        ("options", "flap_inertia"),
        "axis_to_tip",
        "options.flap_inertia = 'axis_to_tip': allowed with options.coupling = paper only",
    ),
}


@pytest.mark.parametrize(("path", "value", "line"), REFUSED.values(), ids=REFUSED)
def test_a_bad_value_is_refused_in_one_line(path, value, line):
    said = refusal(changed(path, value))
    assert said.startswith(line) if line.endswith(", ") else said == line
    assert "\n" not in said


def test_all_that_is_wrong_is_said_once():
    data = sbs_data()
    del data["body"]["mass"], data["body"]["inertia"]
    data["rotors"][1]["blades"] = 1
    assert refusal(data) == "body.inertia, body.mass: missing key; rotors[1].blades = 1: allowed is >= 2"
    data = sbs_data()
    data["rotors"][0]["hinge_offset"] = 0.6
    data["rotors"][1]["name"] = "MR1"
    assert refusal(data) == (
        "rotors[0].hinge_offset = 0.6: allowed is < 0.505, the radius; rotors[1].name = 'MR1': used twice"
    )


@pytest.mark.parametrize("value", [None, 5, "sbs", [1], True, math.nan])
def test_what_is_no_mapping_is_refused(value):
    assert refusal(value) == f"file = {value!r}: allowed is a mapping of keys to values"


def test_a_mapping_that_contains_itself_is_refused():
    data = sbs_data()
    data["body"]["mass"] = data
    assert refusal(data).startswith("body.mass = {")


NOT_YAML = {
    "key used twice": ("body: 1\nname: x\nbody: 2\n", 'found duplicate key "body"'),
    "bracket left open": ("body: [1, 2\nname: }\n", "line 2"),
    "tab": ("body:\n\tmass: 1\n", "line 2"),
    "anchor that does not exist": ("body: *other\n", "undefined alias 'other'"),
    "two documents": ("a: 1\n---\nb: 2\n", "expected a single document"),
    "number that is none": ("name: !!int abc\n", "'abc'"),
    "bool that is none": ("name: !!bool abc\n", "'abc'"),
    "day that is none": ("name: 2020-13-45\n", "month"),
    "nested without end": ("[" * 1000, "recursion"),
    "Python object": ("name: !!python/object/apply:os.getcwd []\n", "python/object/apply:os.getcwd"),
    "Python name": ("name: !!python/name:os.system\n", "python/name:os.system"),
    "Python module": ("!!python/module:os {}\n", "python/module:os"),
    "binary file": (bytes(range(256)), "can't decode byte 0x80"),
    "zeros": (bytes(100), "unacceptable character"),
}


@pytest.mark.parametrize(("text", "reason"), NOT_YAML.values(), ids=NOT_YAML)
def test_a_file_that_is_not_yaml_is_refused(tmp_path, text, reason):
    line = refusal_of_text(tmp_path, text)
    assert line.startswith("not readable as YAML: ")
    assert reason in line


def test_no_tag_of_a_file_makes_python_do_anything(tmp_path):
    trace = tmp_path / "trace"
    for tag in ("python/object/apply:os.mkdir", "python/object/new:os.mkdir", "python/object:os.mkdir"):
        refusal_of_text(tmp_path, f'name: !!{tag} ["{trace}"]\n')
        assert not trace.exists()


@pytest.mark.parametrize("text", ["", "# nothing but a comment\n", "~\n"])
def test_an_empty_file_is_refused(tmp_path, text):
    assert refusal_of_text(tmp_path, text) == "file = None: allowed is a mapping of keys to values"


def test_a_file_of_another_kind_is_refused(tmp_path):
    assert refusal_of_text(tmp_path, "hello\n") == "file = 'hello': allowed is a mapping of keys to values"
    line = refusal_of_text(tmp_path, "&a [*a]\n")
    assert line.endswith("allowed is a mapping of keys to values")


def test_a_bad_value_in_a_file_is_refused_with_the_file_named(tmp_path):
    text = SBS_TEXT.replace("mass: 20.62", "mass: .nan")
    assert refusal_of_text(tmp_path, text) == "body.mass = nan: allowed is a finite number"


@pytest.mark.parametrize("name", ["tiltrotor", "", "tiltrotor.yaml", "/nowhere/tiltrotor.yaml", ".", TOO_LONG])
def test_a_missing_file_is_refused_with_the_names_that_exist(name):
    with pytest.raises(AircraftError) as caught:
        Aircraft.load(name)
    assert str(caught.value) == f"aircraft = {name!r}: allowed are a file's path or one of {', '.join(SHIPPED)}"


# -- airfoils ---------------------------------------------------------------------------------------

POLAR = "reynolds,alpha_deg,cl,cd\n" + "".join(
    f"{reynolds},{alpha},{0.1 * alpha},0.01\n" for reynolds in (1e4, 1e6) for alpha in range(-10, 11, 2)
)


def test_a_broken_airfoil_is_refused_with_its_key_file_and_line(tmp_path):
    (tmp_path / "wing.csv").write_text(POLAR.replace("0.01\n", "-0.01\n", 1))
    line = refusal_of_text(tmp_path, SBS_TEXT.replace("airfoil: naca0012", "airfoil: wing"))
    assert line == f"rotors[0].airfoil = 'wing': {tmp_path}/wing.csv:2: cd -0.01 must be greater than 0"


def test_an_airfoil_is_looked_for_beside_its_aircraft(tmp_path, monkeypatch):
    home, elsewhere = tmp_path / "home", tmp_path / "elsewhere"
    home.mkdir()
    elsewhere.mkdir()
    (home / "wing.csv").write_text(POLAR)
    (elsewhere / "wing.csv").write_text("not a table\n")
    (home / "mine.yaml").write_text(SBS_TEXT.replace("airfoil: naca0012", "airfoil: wing.csv"))
    monkeypatch.chdir(elsewhere)
    table = Aircraft.load(home / "mine.yaml").airfoils["wing.csv"]
    assert table.name == "wing"
    assert table.cl.max() > 0.99
    (home / "mine.yaml").write_text(SBS_TEXT.replace("airfoil: naca0012", f"airfoil: {home}/wing.csv"))
    assert Aircraft.load(home / "mine.yaml").rotors[0].airfoil == f"{home}/wing.csv"


# -- fuzz -------------------------------------------------------------------------------------------


def all_paths(data, path=()):
    """Path of every value, mappings and lists included."""
    if path:
        yield path
    items = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ()
    for key, value in items:
        yield from all_paths(value, (*path, key))


SCALARS = (
    st.none()
    | st.booleans()
    | st.integers()
    | st.integers(min_value=-(10**400), max_value=10**400)
    | st.floats()
    | st.text(max_size=5)
    | st.dates()
    | st.sampled_from([0, 1, -1, 3, 1e-300, 1e300, 5e-324, "naca0012", "complete", "paper"])
)
KEYS = st.text(max_size=5) | st.sampled_from(["mass", "root", "name", "hub"]) | st.integers() | st.none()
VALUES = st.recursive(
    SCALARS,
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(KEYS, inner, max_size=3),
    max_leaves=6,
)
CHANGES = st.lists(
    st.tuples(
        st.sampled_from(list(all_paths(SBS))),
        st.sampled_from(["set", "set", "set", "delete", "add", "double"]),
        KEYS,
        VALUES,
    ),
    min_size=1,
    max_size=3,
)


def mutate(data, change):
    """Apply one change where its place still exists."""
    path, action, key, value = change
    try:
        parent = get(data, path[:-1])
        if action == "set":
            parent[path[-1]] = value
        elif action == "delete":
            del parent[path[-1]]
        elif action == "add" and isinstance(parent, dict):
            parent[key] = value
        elif isinstance(parent, list):
            parent.append(parent[path[-1]])
    except (KeyError, IndexError, TypeError):
        pass


def line_or_aircraft(function, *arguments):
    """What a call returns, or the line with which it refuses; any other exception is an error."""
    try:
        return function(*arguments)
    except AircraftError as error:
        return str(error)


@settings(max_examples=250, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(CHANGES)
def test_no_change_of_a_file_gets_more_than_an_aircraft_error(changes):
    data = sbs_data()
    for change in changes:
        mutate(data, change)
    result = line_or_aircraft(Aircraft.from_dict, data)
    if isinstance(result, str):
        assert "\n" not in result
    else:
        assert is_finite_model(result)


NUMBER_PATHS = [path for path in all_paths(SBS) if type(get(SBS, path)) in (int, float)]


@settings(max_examples=150, deadline=None)
@given(st.sampled_from(NUMBER_PATHS), st.floats(allow_nan=False, allow_infinity=False) | st.floats(0, 10))
@example(("environment", "kinematic_viscosity"), 5e-324)
@example(("rotors", 0, "chord", "root"), 5e-324)
@example(("body", "inertia", 0, 0), 1e308)
@example(("environment", "air_density"), 2e-313)
@example(("rotors", 1, "speed_rpm"), 3e-228)
def test_an_aircraft_that_loads_has_a_finite_model(path, value):
    """Every number that passes the checks is one that the model can be made of."""
    with np.errstate(over="raise", invalid="raise", divide="raise"):
        result = line_or_aircraft(Aircraft.from_dict, changed(path, value))
        assert isinstance(result, str) or is_finite_model(result)


@settings(max_examples=80, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.integers(0, len(SBS_TEXT) - 1),
    st.integers(0, 40),
    st.text(max_size=3) | st.sampled_from(["*", "&x ", "!!int ", "{", "]", ":", "- ", "<<: ", "---\n", "\t", "'"]),
)
def test_no_change_of_the_text_gets_more_than_an_aircraft_error(tmp_path, place, length, inserted):
    text = SBS_TEXT[:place] + inserted + SBS_TEXT[place + length :]
    path = tmp_path / "mutant.yaml"
    path.write_text(text, encoding="utf-8", errors="replace")
    result = line_or_aircraft(Aircraft.load, path)
    if isinstance(result, str):
        assert result.startswith(f"{path}: ")
        assert "\n" not in result


# -- single values ----------------------------------------------------------------------------------


def path_text(path):
    return "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in path).lstrip(".")


def same_arrays(one, other):
    return model_arrays(one) == model_arrays(other)


def value_refusal(path, value):
    with pytest.raises(AircraftError) as caught:
        Aircraft.from_dict(sbs_data()).with_value(path, value)
    assert "\n" not in str(caught.value)
    return str(caught.value)


VARIANTS = {
    "body.mass": (("body", "mass"), 25.0),
    "environment.air_density": (("environment", "air_density"), 1.0),
    "options.elements": (("options", "elements"), 30),
    "body.inertia[0][0]": (("body", "inertia", 0, 0), 3.6),
    "body.flat_plate_areas": (("body", "flat_plate_areas"), [0.0, 0.0, 0.1]),
    "rotors[0].blade_mass": (("rotors", 0, "blade_mass"), 0.2),
    "rotors.MR2.hub[2]": (("rotors", 1, "hub", 2), 0.1),
    "rotors[1].chord.tip": (("rotors", 1, "chord", "tip"), 0.04),
    # a key that the file leaves out
    "rotors.MR1.mixing.collective.lateral_cyclic": (("rotors", 0, "mixing", "collective", "lateral_cyclic"), 0.1),
}


@pytest.mark.parametrize(("text", "change"), VARIANTS.items(), ids=VARIANTS)
def test_an_aircraft_with_another_value_is_that_of_the_changed_file(sbs, text, change):
    before = copy.deepcopy(sbs.data)
    variant = sbs.with_value(text, change[1])
    changed_file = Aircraft.from_dict(changed(*change))
    assert same_arrays(variant, changed_file)
    assert variant.data == changed_file.data
    assert variant.parameter_hash != sbs.parameter_hash
    assert variant.value(text) == change[1]
    assert sbs.data == before
    assert sbs.with_value(text, change[1]).with_value("body.mass", 30.0).body.mass == 30.0


def test_a_key_of_the_rotors_is_that_of_every_rotor(sbs):
    variant = sbs.with_value("rotors.twist_deg.tip", -8.0)
    assert [rotor.twist_tip for rotor in variant.rotors] == [math.radians(-8.0)] * 2
    assert variant.value("rotors.twist_deg.tip") == [-8.0, -8.0]
    # the file makes both rotors of one mapping, so that they share what they have in common
    assert [rotor.hub[0] for rotor in sbs.with_value("rotors[1].hub[0]", 0.01).rotors] == [0.0, 0.01]


def test_a_rotor_whose_name_is_a_key_is_found_by_its_index():
    aircraft = Aircraft.from_dict(changed(("rotors", 1, "name"), "radius"))
    assert [rotor.radius for rotor in aircraft.with_value("rotors.radius", 0.6).rotors] == [0.6, 0.6]
    assert [rotor.radius for rotor in aircraft.with_value("rotors[1].radius", 0.6).rotors] == [0.505, 0.6]


@pytest.mark.parametrize(
    "path", [path for path in all_paths(SBS) if type(get(SBS, path)) in (int, float)], ids=path_text
)
def test_every_number_can_be_set_and_has_a_unit(sbs, path):
    value = get(SBS, path)
    assert sbs.value(path_text(path)) == value
    assert sbs.with_value(path_text(path), np.float64(value)).parameter_hash == sbs.parameter_hash
    assert unit_of(path_text(path))


@pytest.mark.parametrize(
    ("path", "unit"),
    [
        ("body.mass", "kg"),
        ("rotors.MR1.hub[0]", "m"),
        ("rotors[0].twist_deg.tip", "deg"),
        ("rotors.speed_rpm", "rpm"),
        ("controls.collective.range_deg[1]", "deg"),
        ("rotors.blades", "1"),
        ("name", ""),
    ],
)
def test_units_of_values(path, unit):
    assert unit_of(path) == unit


@pytest.mark.parametrize(
    ("path", "value"),
    [("body.mass", 25.0), ("rotors.blade_mass", 0.2), ("rotors.radius", 0.55), ("rotors[1].chord.tip", 0.04)],
)
def test_an_airfoil_that_stays_the_same_is_not_read_again(sbs, monkeypatch, path, value):
    monkeypatch.setattr("sbs_sim.aircraft.airfoils.read_table", None)
    assert sbs.with_value(path, value).airfoils["naca0012"] is sbs.airfoils["naca0012"]


def test_a_partial_airfoil_is_extended_for_the_new_blade(tmp_path):
    (tmp_path / "wing.csv").write_text(POLAR)
    data = sbs_data()
    for rotor in data["rotors"]:
        rotor["airfoil"] = "wing"
    aircraft = Aircraft.from_dict(data, tmp_path)
    assert aircraft.with_value("body.mass", 21.0).airfoils["wing"] is aircraft.airfoils["wing"]
    slender = aircraft.with_value("rotors.radius", 1.0)
    for rotor in data["rotors"]:
        rotor["radius"] = 1.0
    assert np.array_equal(slender.airfoils["wing"].cd, Aircraft.from_dict(data, tmp_path).airfoils["wing"].cd)
    assert slender.airfoils["wing"].cd.max() > aircraft.airfoils["wing"].cd.max()


def test_a_partial_airfoil_is_extended_for_the_blades_of_each_rotor(tmp_path):
    """At 90 deg its drag is 1.11 + 0.018 AR: of the one rotor's blades, of the other's, which are more slender."""
    (tmp_path / "wing.csv").write_text(POLAR)
    data = sbs_data()
    for rotor in data["rotors"]:
        rotor["airfoil"] = "wing"
    same = Aircraft.from_dict(data, tmp_path)
    assert same.sections[0][0] is same.sections[1][0]
    data["rotors"][1]["radius"] = 1.0
    for aircraft in (Aircraft.from_dict(data, tmp_path), same.with_value("rotors[1].radius", 1.0)):
        broadside = [table.cd[0, 3 * (len(table.alpha) - 1) // 4] for (table,) in aircraft.sections]
        assert broadside == pytest.approx([1.11 + 0.018 * 0.505 / 0.051, 1.11 + 0.018 * 1.0 / 0.051])
        assert aircraft.parameter_hash == Aircraft.from_dict(data, tmp_path).parameter_hash
        assert list(aircraft.airfoils) == ["wing"]
    # what flies has both: across the wind, with a blade of any pitch, the drag of each
    model = aircraft.model()
    first, columns = model.elements["first_row"][:, 0, 0], int(model.blades["alpha_cells"][0, 0])
    quarter = columns // 12 + columns // 2  # cell that begins at 90 deg, of three turns
    drag = [model.table[int(row) + quarter] for row in first]  # c_02 and c_03: of x^0, and its slope over Re
    assert [row[2] + 1e5 * row[3] for row in drag] == pytest.approx(broadside)
    copied, files = aircraft.files()
    assert [rotor["airfoil"] for rotor in copied["rotors"]] == list(files) * 2


def test_airfoils_along_the_blade_count_and_travel_with_the_aircraft(sbs, tmp_path):
    """The element at the middle of which another airfoil has started is the first that has it; files hold each once."""
    span = {"stations": [0.5, 0.9], "values": ["linear_573", "naca0012"]}
    aircraft = sbs.with_value("rotors[0].outboard_airfoils", span)
    names = [table.name for table in aircraft.sections[0]]
    assert names == ["naca0012", "linear_573", "naca0012"]
    radii = (0.075 + 0.43 * (np.arange(20) + 0.5) / 20) / 0.505
    assert [names[k] for k in aircraft.model().elements["airfoil"][0, :, 0].astype(int)] == [
        "naca0012" if radius < 0.5 or radius >= 0.9 else "linear_573" for radius in radii
    ]
    assert aircraft.parameter_hash != sbs.parameter_hash
    moved = aircraft.with_value("rotors[0].outboard_airfoils.stations", [0.5, 0.8])
    assert moved.parameter_hash != aircraft.parameter_hash
    data, files = aircraft.files()
    assert sorted(files) == ["0_linear_573.csv", "1_naca0012.csv"]
    for name, content in files.items():
        (tmp_path / name).write_bytes(content)
    assert Aircraft.from_dict(data, tmp_path).parameter_hash == aircraft.parameter_hash
    with pytest.raises(AircraftError) as caught:
        sbs.with_value("rotors[1].outboard_airfoils", {"stations": [0.5], "values": ["none"]})
    assert ": rotors[1].outboard_airfoils.values[0] = 'none': allowed are a file's path or" in str(caught.value)


def test_drag_is_added_to_the_tables_of_one_rotor(sbs, tmp_path):
    """At every angle and Reynolds number; lift and the other rotor stay, and files carry it."""
    aircraft = sbs.with_value("rotors[0].drag_increment", 0.002)
    (plain,), (own,), (other,) = *sbs.sections[:1], *aircraft.sections
    np.testing.assert_allclose(own.cd - plain.cd, 0.002, rtol=0, atol=1e-15)
    assert own.cl is plain.cl or np.array_equal(own.cl, plain.cl)
    assert np.array_equal(other.cd, plain.cd)
    assert aircraft.parameter_hash != sbs.parameter_hash
    assert sbs.with_value("rotors[0].drag_increment", 0.0).parameter_hash == sbs.parameter_hash
    data, files = aircraft.files()
    for name, content in files.items():
        (tmp_path / name).write_bytes(content)
    assert Aircraft.from_dict(data, tmp_path).parameter_hash == aircraft.parameter_hash


def test_another_airfoil_is_read(sbs):
    variant = sbs.with_value("rotors.airfoil", "linear_573")
    assert list(variant.airfoils) == ["linear_573"]


def test_an_aircraft_of_a_relative_path_can_be_changed_from_elsewhere(tmp_path, monkeypatch):
    (tmp_path / "wing.csv").write_text(POLAR)
    (tmp_path / "mine.yaml").write_text(SBS_TEXT)
    monkeypatch.chdir(tmp_path)
    aircraft = Aircraft.load("mine.yaml")
    monkeypatch.chdir("/")
    assert list(aircraft.with_value("rotors.airfoil", "wing").airfoils) == ["wing"]


KEYS_OF_BODY = "unknown key, allowed are mass, inertia, flat_plate_areas, surfaces, fuselage, stand"
REFUSED_VALUES = {
    "unknown key": ("body.mas", 1.0, f"body.mas: {KEYS_OF_BODY}"),
    "unknown part": ("bodi.mass", 1.0, "bodi: unknown key, allowed are name, description, environment, "),
    "unknown rotor": ("rotors.MR3.radius", 1.0, "rotors.MR3: allowed are [0] to [1], MR1, MR2, name, hub, "),
    "unknown key of a rotor": ("rotors[1].radios", 1.0, "rotors[1].radios: unknown key, allowed are name, hub, "),
    "index too large": ("rotors[2].radius", 1.0, "rotors[2]: allowed are [0] to [1]"),
    "index of an inertia too large": ("body.inertia[0][3]", 1.0, "body.inertia[0][3]: allowed are [0] to [2]"),
    "key of a list": ("body.inertia.x", 1.0, "body.inertia.x: allowed are [0] to [2]"),
    "index of a mapping": ("body[0]", 1.0, f"body[0]: {KEYS_OF_BODY}"),
    "part of a number": ("body.mass.x", 1.0, "body.mass.x: body.mass is a single value"),
    "no path": ("", 1.0, "path = '': allowed are keys like body.mass"),
    "not a path": ("body..mass", 1.0, "path = 'body..mass': allowed are keys like body.mass"),
    "text for a number": ("body.mass", "x", "body.mass = 'x': allowed is a number"),
    "no number": ("body.mass", math.nan, "body.mass = nan: allowed is a finite number"),
    "lighter than its blades": ("body.mass", 0.5, "body.mass = 0.5: allowed is > 0.9678, the mass of all blades"),
    "blades too heavy": (
        "rotors.blade_mass",
        3.0,
        "rotors.blade_mass = 3.0: body.inertia without the blades = [[-4.942583, -0.001, -0.052],"
        " [-0.001, 1.235867, 0.0], [-0.052, 0.0, -3.9619]]: allowed is a positive definite matrix",
    ),
    "out of range in every rotor": ("rotors.tip_loss", 2, "rotors.tip_loss = 2: allowed is <= 1"),
    "out of range in one rotor": ("rotors.MR2.tip_loss", 2, "rotors.MR2.tip_loss = 2: allowed is <= 1"),
    "one name for all": ("rotors.name", "R", "rotors.name = 'R': used twice"),
    "unknown choice": ("options.coupling", "both", "options.coupling = 'both': allowed is one of complete, paper"),
    "number for a part": ("body", 3, "body = 3: allowed is a mapping of keys to values"),
}


@pytest.mark.parametrize(("path", "value", "line"), REFUSED_VALUES.values(), ids=REFUSED_VALUES)
def test_a_value_that_cannot_be_set_is_refused_in_one_line(path, value, line):
    said = value_refusal(path, value)
    assert said.startswith(line) if line.endswith(", ") or "like" in line else said == line


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.sampled_from([path_text(path) for path in all_paths(SBS)]) | st.text(max_size=8) | st.text("rotbdymas.[]01"),
    VALUES,
)
@example("rotors[99999999999999999999]", 1)
def test_no_value_at_no_path_gets_more_than_an_aircraft_error(sbs, path, value):
    result = line_or_aircraft(sbs.with_value, path, value)
    if not isinstance(result, str):
        assert is_finite_model(result)


# -- aircraft of other shapes -----------------------------------------------------------------------


@pytest.fixture(scope="module")
def tail_rotor():
    return Aircraft.load(DATA / "tail_rotor.yaml")


@pytest.fixture(scope="module")
def tandem():
    return Aircraft.load(DATA / "tandem.yaml")


def steady_second(aircraft, point):
    """Largest change of velocities and angular velocities in a second with the controls of a trim point."""
    flight = simulate(aircraft, point, point.controls, 1.0)
    motion = flight["state"][:, VELOCITY : RATES + 3]
    return np.abs(motion - motion[0]).max()


def answer(aircraft, point, control, name):
    """Change of a state 0.2 s after a step of one control."""
    controls = point.controls.copy()
    controls[CONTROL_NAMES.index(control)] += math.radians(0.5)
    return simulate(aircraft, point, controls, 0.2)[name][-1]


def test_an_aircraft_with_a_tail_rotor_hovers_and_has_pedals(tail_rotor):
    assert tail_rotor.layout.blades == (4, 3)
    assert tail_rotor.layout.size == 13 + 4 * 7 + 3 * 2
    point = trim(tail_rotor)
    assert point.beyond_limits == ()
    assert point.swashplate[1].tolist() == [point.controls[3], 0.0, 0.0]
    # the tail rotor holds against the main rotor's torque, the main rotor's weight and little else
    assert point.thrust[1] * 0.8 == pytest.approx(point.torque[0], rel=0.05)
    assert point.thrust[0] == pytest.approx(9.0 * 9.80665, rel=0.01)
    assert point.thrust[1] > 0
    assert point.roll < 0  # it leans against the push to the right
    assert steady_second(tail_rotor, point) < 1e-4
    assert answer(tail_rotor, point, "differential_longitudinal_cyclic", "r") < -0.05  # more push: nose left
    assert answer(tail_rotor, point, "collective", "w") < -0.05


def test_pedals_work_in_forward_flight(tail_rotor):
    hover, cruise = trim(tail_rotor), trim(tail_rotor, airspeed=10.0)
    assert cruise.pitch < hover.pitch
    assert cruise.torque[0] < hover.torque[0]
    assert cruise.controls[3] < hover.controls[3]  # less torque to hold against


def test_a_tandem_with_three_and_five_blades_hovers(tandem):
    assert tandem.layout.blades == (3, 5)
    assert tandem.layout.size == 13 + 4 * 8 + 3 * 2
    point = trim(tandem)
    assert point.beyond_limits == ()
    collective, _, pitch, _ = point.controls
    assert point.swashplate[:, 0] == pytest.approx([collective - pitch, collective + pitch], abs=1e-15)
    # the shafts lean forward by 0.05, so the body leans back by as much
    assert point.pitch == pytest.approx(0.05, abs=0.005)
    assert point.thrust.sum() == pytest.approx(20.0 * 9.80665, rel=0.01)
    assert point.thrust[0] == pytest.approx(point.thrust[1], rel=0.05)
    assert steady_second(tandem, point) < 1e-4
    # more lift behind: nose down
    assert answer(tandem, point, "longitudinal_cyclic", "q") < -0.05


@pytest.mark.parametrize("blades", [(4, 3), (5, 4), (3, 7)])
def test_rotors_with_unequal_numbers_of_blades_hover(blades):
    data = sbs_data()
    for rotor, count in zip(data["rotors"], blades, strict=True):
        rotor["blades"] = count
        rotor["chord"] = {"root": 0.153 / count, "tip": 0.153 / count}
        rotor["lag_damping"] = 0.2
    aircraft = Aircraft.from_dict(data)
    point = trim(aircraft)
    assert aircraft.layout.blades == blades
    assert len(point.state) == 8 + 4 * sum(blades) + 6
    assert point.thrust == pytest.approx([101.1, 101.1], rel=0.01)  # half the weight each
    assert point.beyond_limits == ()
    assert steady_second(aircraft, point) < 1e-3


def test_the_hash_is_of_the_physics_alone(sbs):
    """Data of an airfoil count; what limits the pilot does not."""
    assert Aircraft.from_dict(copy.deepcopy(sbs.data)).parameter_hash == sbs.parameter_hash
    assert sbs.with_value("rotors.airfoil", "linear_573").parameter_hash != sbs.parameter_hash
    assert sbs.with_value("rotors.MR1.collective_range_deg", [0.0, 15.0]).parameter_hash == sbs.parameter_hash


# -- several values at once -------------------------------------------------------------------------


def test_values_that_are_possible_together_only_are_taken_in_any_order(sbs):
    """A shorter blade needs its c.g. nearer to the hinge: neither may come first."""
    changes = {"rotors.radius": 0.4, "rotors.blade_cg": 0.18}
    with pytest.raises(AircraftError, match="blade_cg"):
        sbs.with_value("rotors.radius", 0.4)
    for order in (changes, dict(reversed(changes.items()))):
        variant = sbs.with_values(order)
        assert [(rotor.radius, rotor.blade_cg) for rotor in variant.rotors] == [(0.4, 0.18)] * 2
    assert sbs.with_values({}) == sbs


def test_of_two_paths_to_one_value_the_later_counts(sbs):
    variant = sbs.with_values({"rotors.radius": 0.6, "rotors.MR2.radius": 0.55})
    assert [rotor.radius for rotor in variant.rotors] == [0.6, 0.55]


@pytest.mark.parametrize(("i", "j"), [(0, 1), (1, 0), (0, 2), (2, 0), (1, 2), (2, 1)])
def test_a_product_of_inertia_is_one_value(sbs, i, j):
    inertia = sbs.with_value(f"body.inertia[{i}][{j}]", 0.07).body.inertia
    expected = sbs.body.inertia.copy()
    expected[i, j] = expected[j, i] = 0.07
    assert np.array_equal(inertia, expected)
    both = {f"body.inertia[{i}][{j}]": 0.07, f"body.inertia[{j}][{i}]": 0.07}
    assert np.array_equal(sbs.with_values(both).body.inertia, expected)
    both[f"body.inertia[{j}][{i}]"] = 0.08
    with pytest.raises(AircraftError, match=r"= 0.07, .* = 0.08: allowed is one value, the inertia is symmetric"):
        sbs.with_values(both)


def test_an_impossible_combination_is_refused_with_all_changes_named(sbs):
    with pytest.raises(AircraftError) as caught:
        sbs.with_values({"rotors.radius": 0.4, "body.mass": 21.0})
    assert str(caught.value).startswith(
        "rotors.radius = 0.4, body.mass = 21.0: rotors[0].blade_cg = 0.224: allowed is <= 0.187639, "
    )
    many = {f"rotors[{i}].hub[{k}]": 0.1 * k for i in range(2) for k in range(3)} | {"body.mass": 0.5}
    with pytest.raises(AircraftError, match=r"and 2 more: body.mass = 0.5: allowed is > 0.9678"):
        sbs.with_values(many)
    with pytest.raises(AircraftError, match="values = 5: allowed are objects of the class Mapping"):
        sbs.with_values(5)


def leaves(data, location=()):
    """Locations of the values in nested mappings and lists."""
    if isinstance(data, dict | list):
        for key, value in data.items() if isinstance(data, dict) else enumerate(data):
            yield from leaves(value, (*location, key))
    else:
        yield location


@pytest.mark.parametrize("name", ["sbs", "uh60a_tm85890", "quadrotor"])
def test_what_was_accepted_is_not_checked_again_and_hides_no_fault(name):
    """A change has the faults that the whole file with it has, at the value, beside it and above it."""
    data = Aircraft.load(name).data
    validator = validation.validator_of(schema_of(Aircraft))
    places = list(leaves(data))[::5]
    places = [*places, *{place[:-1] for place in places if len(place) > 1}]
    found = 0
    for i, place in enumerate(places):
        wrong = (-1.0, "x", None, [], {}, math.nan, [[0.0]], True)[i % 8]
        for changed in (
            paths.replaced(data, place, wrong),
            paths.without(data, place) if isinstance(place[-1], str) else data,
        ):
            faults = validation.problems(changed, validator, data)
            assert faults == validation.problems(copy.deepcopy(changed), validator), place
            found += bool(faults)
    assert found > 20
    assert validation.problems(data, validator, data) == []
