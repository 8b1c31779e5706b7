"""Each value of an aircraft file is declared once: schema, checks, units, reference and model follow from that."""

import dataclasses
import json
import math
import re
import sys
from pathlib import Path

import numpy as np
import pytest

from sbs_sim.aircraft import Aircraft
from sbs_sim.aircraft.declaration import array, declarations, interval, leaves, number, parts, schema_of
from sbs_sim.aircraft.description import Body, Description, Environment, Options, Rotor
from sbs_sim.aircraft.paths import separate, unit_of
from sbs_sim.errors import AircraftError
from sbs_sim.model import records

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools"))
import make_schema  # noqa: E402
import update_reference as reference  # noqa: E402

RECORDS = (Environment, Body, Options, Rotor, Description)
EVERY = {path: declaration for path, _, declaration in leaves(Description)}


def without_comments(schema):
    """A schema without what only people read."""
    if isinstance(schema, list):
        return [without_comments(item) for item in schema]
    if not isinstance(schema, dict):
        return schema
    comments = [key for key in ("description", "default") if not isinstance(schema.get(key), dict)]
    return {key: without_comments(item) for key, item in schema.items() if key not in comments}


# -- the declarations of the package ----------------------------------------------------------------


def test_the_schema_file_is_that_of_the_declarations():
    assert make_schema.TARGET.read_bytes() == make_schema.text().encode(), "remedy: ./run python tools/make_schema.py"


def test_the_schema_has_types_and_ranges():
    """As written out by hand: each kind of value, and a nested key."""
    schema = without_comments(json.loads(make_schema.text()))
    rotor = schema["properties"]["rotors"]["items"]["properties"]
    assert rotor["lag_damping"] == {"type": "number", "minimum": 0, "maximum": 1e9}
    assert rotor["tip_loss"] == {"type": "number", "exclusiveMinimum": 0, "maximum": 1}
    assert rotor["blades"] == {"type": "integer", "minimum": 2, "maximum": 20}
    assert rotor["rotation"] == {"enum": [1, -1]}
    assert rotor["name"] == {"type": "string", "minLength": 1}
    hundred = {"type": "number", "minimum": -100, "maximum": 100}
    assert rotor["hub"] == {"type": "array", "items": hundred, "minItems": 3, "maxItems": 3}
    angle = {"type": "number", "minimum": -90, "maximum": 90}
    assert rotor["twist_deg"] == {
        "type": "object",
        "properties": {
            "root": angle,
            "tip": angle,
            "stations": {
                "type": "array",
                "items": {"type": "number", "minimum": 0, "maximum": 1},
                "minItems": 2,
                "maxItems": 200,
            },
            "values": {"type": "array", "items": angle, "minItems": 2, "maxItems": 200},
        },
        "required": [],
        "additionalProperties": False,
    }
    environment = schema["properties"]["environment"]
    assert environment["required"] == ["gravity"]
    assert environment["else"]["required"] == ["air_density", "kinematic_viscosity"]
    given = ["air_density", "kinematic_viscosity", "gravity", "speed_of_sound"]
    assert list(environment["properties"]) == [*given, "altitude", "temperature_offset"]


@pytest.mark.parametrize("record", RECORDS)
def test_every_field_is_declared(record):
    assert list(declarations(record)) == [field.name for field in dataclasses.fields(record)]


@pytest.mark.parametrize("path", EVERY)
def test_every_declaration_is_complete(path):
    declaration = EVERY[path]
    has_own_units = path in ("controls", "body.stand.free", "drives.rotors", "drives.free_wheel")
    has_own_units |= path == "rotors.outboard_airfoils.values"
    is_text = (
        has_own_units
        or declaration.schema.get("type") == "string"
        or isinstance(declaration.schema.get("enum", [0])[0], str)
    )
    assert bool(declaration.unit) == (not is_text)
    assert len(declaration.text) > 5
    assert not declaration.text.endswith(".")
    assert declaration.text in declaration.full_schema["description"]


def symbols_of_the_theory():
    """Symbols by the keys of the table of docs/theory.md."""
    block = (ROOT / "docs/theory.md").read_text(encoding="utf-8").split("\n## Symbols\n")[1].split("\n## ")[0]
    found = {}
    for row in re.findall(r"^\|(.+)\|$", block, flags=re.MULTILINE)[2:]:
        symbols, _, keys, _ = row.split("|")
        for key in re.findall(r"`([\w.]+)`", keys):
            found[key] = set(re.findall(r"\$([^$=]+?)(?:=[^$]*)?\$", symbols))
    return found


def named(path):
    """What a table may call a path: "body.stand.mass", "stand.mass", "mass"; then "body.stand", "stand" and so on."""
    parts = path.split(".")
    return [".".join(parts[i:j]) for j in range(len(parts), 0, -1) for i in range(j)]


def test_the_symbols_are_those_of_the_theory():
    known = symbols_of_the_theory()
    assert known["lag_damping"] >= {r"C_\xi"}
    for path, declaration in EVERY.items():
        key = next((found for found in named(path) if found in known), "")
        symbols = set(declaration.symbol.split(", ")) - {""}
        assert symbols <= known.get(key, set()), path
        assert symbols or key in ("", "flap_inertia"), f"{path}: the theory has {known.get(key)}"


@pytest.mark.parametrize("name", ["sbs", "sbs_paper"])
def test_the_model_holds_the_declared_values(name, request):
    aircraft = request.getfixturevalue(name)
    model = aircraft.model()
    held = set()
    blade_of = np.cumsum([0, *(rotor.blades for rotor in aircraft.rotors)])
    pairs = [(model.air[0], records.AIR, part) for part in (aircraft.environment, aircraft.body)]
    for j, rotor in enumerate(aircraft.rotors):
        pairs += [(model.rotors[j], records.ROTOR, rotor), (model.blades[blade_of[j]], records.BLADE, rotor)]
    for record, fields, part in pairs:
        for attribute, declaration in declarations(type(part)).items():
            if declaration.model_field in fields:
                assert np.array_equal(record[declaration.model_field][..., 0], getattr(part, attribute))
                held.add(declaration.model_field)
    declared = {item.model_field for record in RECORDS for item in declarations(record).values()} - {""}
    assert held == declared


def test_gravity_has_the_unit_of_all_accelerations():
    assert unit_of("environment.gravity") == "m/s^2"


# -- one more value ---------------------------------------------------------------------------------


@dataclasses.dataclass(frozen=True, eq=False)
class StoppedRotor(Rotor):
    """A rotor with lag stops: four more declarations, and nothing else."""

    lag_stop: float = number("Lag angle at which the stop begins", 0, 90, "deg", symbol=r"\xi_s", default=90)
    stop_spring: float = number("Stiffness of the lag stop", 0, 1e6, "N m/rad", key="stop.spring", default=0.0)
    stop_axis: np.ndarray = array("Axis of the stop", -1, 1, "1", shape=(3,), default=[0, 0, 1])
    stop_range: tuple[float, float] = interval("Travel of the stop", -10, 10, "deg", default=[-1, 1], is_physics=False)


@dataclasses.dataclass(frozen=True, eq=False)
class StoppedAircraft(Aircraft):
    """An aircraft of such rotors."""

    rotors: tuple[StoppedRotor, ...] = parts("Rotors with lag stops", StoppedRotor, 1, 16)


@pytest.fixture(scope="module")
def stopped(sbs):
    return StoppedAircraft.from_dict(separate(sbs.data))


def test_a_value_that_is_left_out_has_its_default_and_the_hash_stays(stopped, sbs):
    rotor = stopped.rotors[0]
    assert (rotor.lag_stop, rotor.stop_spring) == (math.radians(90), 0.0)
    assert rotor.stop_axis.tolist() == [0.0, 0.0, 1.0]
    assert rotor.stop_range == pytest.approx((-math.pi / 180, math.pi / 180))
    assert stopped.parameter_hash == sbs.parameter_hash
    assert stopped.with_value("rotors.stop_range_deg", [-2, 2]).parameter_hash == sbs.parameter_hash


def test_one_declaration_adds_a_value_to_files_checks_and_changes(stopped, sbs):
    data = separate(sbs.data)
    data["rotors"][0] |= {"lag_stop_deg": 12, "stop": {"spring": 300}}
    aircraft = StoppedAircraft.from_dict(data)
    assert aircraft.rotors[0].lag_stop == math.radians(12)
    assert aircraft.rotors[0].stop_spring == 300.0
    assert aircraft.parameter_hash != sbs.parameter_hash
    assert stopped.with_value("rotors.stop_axis", [0, 1, 0]).parameter_hash != sbs.parameter_hash
    changed = stopped.with_value("rotors.MR1.lag_stop_deg", 12).with_value("rotors[0].stop", {"spring": 300})
    assert changed.rotors == aircraft.rotors
    assert changed.value("rotors.MR1.lag_stop_deg") == 12
    with pytest.raises(AircraftError, match=r"^rotors\[1\]\.lag_stop_deg = 120: allowed is <= 90$"):
        stopped.with_value("rotors[1].lag_stop_deg", 120)
    assert stopped.value("rotors.MR1.stop.spring") is None
    assert stopped.with_value("rotors.MR1.stop.spring", 300).rotors[0].stop_spring == 300.0
    with pytest.raises(
        AircraftError, match=r"^rotors\[0\]\.stop_range_deg\[1\]: rotors\[0\]\.stop_range_deg is left out"
    ):
        stopped.with_value("rotors[0].stop_range_deg[1]", 2)
    with pytest.raises(AircraftError, match=r"^rotors\[0\]\.stop\.spring = nan: allowed is a finite number$"):
        stopped.with_value("rotors[0].stop.spring", math.nan)
    with pytest.raises(AircraftError, match=r"^rotors\.lag_stop_deg: allowed are \[0\] to \[1\], MR1, "):
        sbs.with_value("rotors.lag_stop_deg", 12)


def test_one_declaration_adds_a_value_to_schema_units_and_reference():
    schema = schema_of(StoppedAircraft)["properties"]["rotors"]["items"]
    assert schema["properties"]["lag_stop_deg"] == {
        "type": "number",
        "minimum": 0,
        "maximum": 90,
        "default": 90,
        "description": "Lag angle at which the stop begins [deg]",
    }
    assert not {"lag_stop_deg", "stop", "stop_range_deg"} & set(schema["required"])
    assert unit_of("rotors.MR1.lag_stop_deg", StoppedAircraft) == "deg"
    assert unit_of("rotors[0].stop.spring", StoppedAircraft) == "N m/rad"
    assert unit_of("rotors.lag_stop_deg") == ""
    assert (
        r"| `rotors.lag_stop_deg` | $\xi_s$ | 0 to 90 | deg → rad | `90` | `lag_stop` |"
        " Lag angle at which the stop begins |\n"
    ) in reference.aircraft(StoppedAircraft)


def test_a_value_without_a_default_is_required(sbs):
    rotor = dataclasses.make_dataclass(
        "Rotor2", [("stop_mass", float, number("Mass of the stop", 0, 1, "kg"))], bases=(Rotor,), frozen=True, eq=False
    )
    field = ("rotors", tuple, parts("Rotors", rotor, 1, 16))
    aircraft = dataclasses.make_dataclass("Aircraft2", [field], bases=(Aircraft,), frozen=True, eq=False)
    with pytest.raises(AircraftError, match=r"^rotors\[0\]\.stop_mass: missing key; rotors\[1\]\.stop_mass: missing"):
        aircraft.from_dict(separate(sbs.data))
