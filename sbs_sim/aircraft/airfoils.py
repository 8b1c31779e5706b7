"""The airfoil tables of an aircraft's rotors: found, read once, and shared where sections are the same."""

import itertools
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from sbs_sim.aircraft.description import Rotor
from sbs_sim.config_file import find_file
from sbs_sim.errors import AircraftError, AirfoilError
from sbs_sim.model.airfoil import AirfoilTable, read_table

Tables = tuple[AirfoilTable, ...]


def load_tables(
    rotors: Sequence[Rotor], folder: Path, known_rotors: Sequence[Rotor] = (), known_tables: Sequence[Tables] = ()
) -> tuple[Tables, ...]:
    """Airfoil tables of every rotor, root first; a partial table is extended for the aspect ratio of its blades.

    Parameters
    ----------
    rotors : sequence of Rotor
    folder : Path
        Where relative paths of airfoils start.
    known_rotors, known_tables : sequences of Rotor and of their tables
        Rotors of the same folder and their tables, which are not read again.

    Raises
    ------
    AircraftError, AirfoilError
        A file does not exist or holds no table: one line that names the rotor.
    """
    known = {
        (name, *_options(rotor)): table
        for rotor, tables in zip(known_rotors, known_tables, strict=True)
        for name, table in zip(rotor.airfoil_names, tables, strict=True)
    }
    found = []
    for i, rotor in enumerate(rotors):
        for k, name in enumerate(rotor.airfoil_names):
            aspect_ratio, drag = _options(rotor)
            if (name, aspect_ratio, drag) not in known:
                key = f"rotors[{i}].outboard_airfoils.values[{k - 1}]" if k else f"rotors[{i}].airfoil"
                others = {other: table for (other, _, added), table in known.items() if added == drag}
                known[name, aspect_ratio, drag] = _read_table(key, name, aspect_ratio, drag, folder, others)
        found.append(tuple(known[(name, *_options(rotor))] for name in rotor.airfoil_names))
    return tuple(found)


def _options(rotor: Rotor) -> tuple[float, float]:
    """What a table depends on beside its file: aspect ratio of the blades, and drag that is added."""
    return rotor.radius / rotor.mean_chord, rotor.drag_increment


def _read_table(
    key: str, name: str, aspect_ratio: float, drag: float, folder: Path, known: dict[str, AirfoilTable]
) -> AirfoilTable:
    """Table of an airfoil: the known one, if that is the same for every blade, else from the file."""
    try:
        path = find_file(name, "airfoils", ".csv", folder)
    except AircraftError as error:
        raise AircraftError(f"{key}{str(error).removeprefix('airfoil')}") from None
    if name in known and _covers_circle(path):
        return known[name]
    try:
        table = read_table(path, aspect_ratio)
        return replace(table, cd=table.cd + drag) if drag else table
    except AirfoilError as error:
        other = "" if path.suffix == ".csv" else "; the command airfoil makes tables of C81, XFOIL and AeroDyn files"
        raise AirfoilError(f"{key} = {name!r}: {error}{other}") from None


def _covers_circle(path: Path) -> bool:
    """True for a table that begins at -180 deg: it is not extended, and so the aspect ratio does not matter."""
    try:
        with path.open(encoding="utf-8-sig") as file:
            rows = [line for line in itertools.islice(file, 1000) if line.strip() and not line.lstrip().startswith("#")]
        return float(rows[1].split(",")[rows[0].replace(" ", "").split(",").index("alpha_deg")]) == -180.0
    except (OSError, ValueError, IndexError):  # `read_table` reports the fault
        return False
