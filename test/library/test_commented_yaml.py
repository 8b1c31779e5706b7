"""Aircraft written as commented files: read again they are the same, and each declared key says what it is."""

import subprocess
import sys

import pytest
from helpers import renamed_data

from sbs_sim import Aircraft
from sbs_sim.aircraft.commented_yaml import commented_yaml
from sbs_sim.config_file import config_folder

NAMES = sorted(path.stem for path in (config_folder() / "aircraft").glob("*.yaml"))


def lines_of(text):
    return {line.strip().removeprefix("- ").partition(":")[0]: line for line in text.splitlines() if "#" in line}


@pytest.mark.parametrize("name", NAMES)
def test_an_aircraft_that_is_written_and_read_is_the_same(name, tmp_path):
    aircraft = Aircraft.load(name)
    path = tmp_path / "again.yaml"
    path.write_text(commented_yaml(aircraft), encoding="utf-8")
    again = Aircraft.load(path)
    assert again == aircraft
    assert again.parameter_hash == aircraft.parameter_hash


def test_each_key_has_its_unit_and_meaning():
    lines = lines_of(commented_yaml(Aircraft.load("sbs")))
    assert lines["mass"].endswith("# Mass of the whole aircraft, blades included [kg]")
    assert lines["swashplate_phase_deg"].endswith("[deg]")
    assert lines["speed_rpm"].split("#")[0].split() == ["speed_rpm:", "2400.0"]


def test_names_of_the_files_own_and_changes_are_kept(tmp_path):
    aircraft = Aircraft.from_dict(renamed_data()).with_value("body.mass", 25.0)
    path = tmp_path / "again.yaml"
    path.write_text(commented_yaml(aircraft), encoding="utf-8")
    again = Aircraft.load(path)
    assert again.control_names == aircraft.control_names
    assert again.body.mass == 25.0
    assert again.parameter_hash == aircraft.parameter_hash


def test_an_airfoil_beside_the_file_is_found_from_another_folder(tmp_path):
    own = config_folder() / "airfoils" / "naca0012.csv"
    (tmp_path / "section.csv").write_bytes(own.read_bytes())
    data = dict(Aircraft.load("sbs").data)
    data["rotors"] = [{**rotor, "airfoil": "section.csv"} for rotor in data["rotors"]]
    aircraft = Aircraft.from_dict(data, tmp_path)
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    (elsewhere / "again.yaml").write_text(commented_yaml(aircraft), encoding="utf-8")
    assert Aircraft.load(elsewhere / "again.yaml").parameter_hash == aircraft.parameter_hash


def test_the_command_writes_a_variant(tmp_path):
    path = tmp_path / "heavy.yaml"
    command = [sys.executable, "-m", "sbs_sim", "aircraft", "--set", "body.mass=25", "--out", str(path)]
    found = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True)
    assert found.stdout == f"written: {path}\n"
    assert Aircraft.load(path).body.mass == 25.0
    wrong = subprocess.run(
        [*command[:-1], str(tmp_path / "x.txt")], capture_output=True, text=True, timeout=60, check=False
    )
    assert wrong.returncode == 1
    assert len(wrong.stderr.splitlines()) == 1
