"""The airfoil tables of an aircraft's rotors: found, read once, and shared where blades have the same."""

import itertools
from collections.abc import Sequence
from pathlib import Path

from sbs_sim.aircraft.description import Rotor
from sbs_sim.config_file import find_file
from sbs_sim.errors import AircraftError, AirfoilError
from sbs_sim.model.airfoil import AirfoilTable, read_table


def load_tables(
    rotors: Sequence[Rotor], folder: Path, known_rotors: Sequence[Rotor] = (), known_tables: Sequence[AirfoilTable] = ()
) -> tuple[AirfoilTable, ...]:
    """Airfoil table of every rotor; a partial table is extended for the aspect ratio of its blades.

    Parameters
    ----------
    rotors : sequence of Rotor
    folder : Path
        Where relative paths of airfoils start.
    known_rotors, known_tables : sequences of Rotor and AirfoilTable
        Rotors of the same folder and their tables, which are not read again.

    Raises
    ------
    AircraftError, AirfoilError
        A file does not exist or holds no table: one line that names the rotor.
    """
    known = {_section(rotor): table for rotor, table in zip(known_rotors, known_tables, strict=True)}
    tables = []
    for i, rotor in enumerate(rotors):
        section = _section(rotor)
        if section not in known:
            known[section] = _read_table(i, rotor, folder, {name: table for (name, _), table in known.items()})
        tables.append(known[section])
    return tuple(tables)


def _section(rotor: Rotor) -> tuple[str, float]:
    """Airfoil and aspect ratio of a rotor's blades."""
    return rotor.airfoil, rotor.radius / rotor.mean_chord


def _read_table(i: int, rotor: Rotor, folder: Path, known: dict[str, AirfoilTable]) -> AirfoilTable:
    """Table of a rotor: the known one of its airfoil, if that is the same for every blade, else from the file."""
    try:
        path = find_file(rotor.airfoil, "airfoils", ".csv", folder)
    except AircraftError as error:
        raise AircraftError(f"rotors[{i}].{error}") from None
    if rotor.airfoil in known and _covers_circle(path):
        return known[rotor.airfoil]
    try:
        return read_table(path, _section(rotor)[1])
    except AirfoilError as error:
        raise AirfoilError(f"rotors[{i}].airfoil = {rotor.airfoil!r}: {error}") from None


def _covers_circle(path: Path) -> bool:
    """True for a table that begins at -180 deg: it is not extended, and so the aspect ratio does not matter."""
    try:
        with path.open(encoding="utf-8-sig") as file:
            rows = [line for line in itertools.islice(file, 1000) if line.strip() and not line.lstrip().startswith("#")]
        return float(rows[1].split(",")[rows[0].replace(" ", "").split(",").index("alpha_deg")]) == -180.0
    except (OSError, ValueError, IndexError):  # `read_table` reports the fault
        return False
