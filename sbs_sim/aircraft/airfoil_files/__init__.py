"""Airfoil data of other programs: C81, XFOIL, AeroDyn and CSV files as one table over Reynolds or Mach number.

`read_airfoil` gives the polars of a file as they are in it, `import_airfoil` one table of several files, and
`sbs_sim.aircraft.airfoil_files.c81.c81_text` the text of a C81 file.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from sbs_sim.aircraft.airfoil_files.aerodyn import is_aerodyn, is_old_aerodyn, read_aerodyn, read_old_aerodyn
from sbs_sim.aircraft.airfoil_files.c81 import is_c81, read_c81
from sbs_sim.aircraft.airfoil_files.csv_table import is_csv, read_csv
from sbs_sim.aircraft.airfoil_files.polar import AirfoilData, plain
from sbs_sim.aircraft.airfoil_files.table import table_of
from sbs_sim.aircraft.airfoil_files.xfoil import is_xfoil, read_xfoil
from sbs_sim.errors import AirfoilError
from sbs_sim.model.airfoil import AirfoilTable, read_text

READERS = (
    (is_csv, read_csv),
    (is_aerodyn, read_aerodyn),
    (is_old_aerodyn, read_old_aerodyn),
    (is_xfoil, read_xfoil),
    (is_c81, read_c81),
)


class Imported(NamedTuple):
    """Table of some files, the name of the airfoil in the first of them, and in words what was read and done."""

    table: AirfoilTable
    airfoil: str
    remarks: list[str]


def import_airfoil(
    paths: Sequence[str | Path],
    name: str = "",
    *,
    extension: str | None = "viterna",
    aspect_ratio: float = 10.0,
    axis: str | None = None,
) -> Imported:
    """One table of files of one airfoil, see `read_airfoil` and `sbs_sim.aircraft.airfoil_files.table.table_of`.

    Parameters
    ----------
    paths : sequence of str or Path
    name : str
        Name of the table; that of the first file if not given.
    extension, aspect_ratio, axis
        See `table_of`.

    Raises
    ------
    AirfoilError
        One line: file, line, the value and what is allowed.
    """
    files = [Path(path) for path in paths]
    data = [read_airfoil(path) for path in files]
    polars = [polar for one in data for polar in one.polars]
    table, remarks = table_of(name or files[0].stem, polars, extension, aspect_ratio, axis)
    sources = [_source(path, one) for path, one in zip(files, data, strict=True)]
    return Imported(table, data[0].name, [*sources, *remarks])


def _source(path: Path, data: AirfoilData) -> str:
    count = f"{len(data.polars)} polar{'s' if len(data.polars) > 1 else ''}"
    return "; ".join([f"{plain(path.name)}: {data.kind} of {plain(data.name)}, {count}", *data.remarks])


def read_airfoil(path: str | Path) -> AirfoilData:
    """Read a file of a kind that its content tells.

    C81: lift and drag over Mach numbers, which need not be the same for both; moments are left out. XFOIL, XFLR5,
    QBlade, airfoiltools.com: polars at fixed Reynolds and Mach numbers. AeroDyn: the tables of an airfoil file. CSV:
    columns for angle, lift and drag, see `sbs_sim.aircraft.airfoil_files.csv_table`.

    Parameters
    ----------
    path : str or Path

    Raises
    ------
    AirfoilError
        One line: file, line, the value and what is allowed.
    """
    path = Path(path)
    lines = read_text(path, errors="replace").splitlines()  # comments may have any characters
    for is_of_kind, read in READERS:
        if is_of_kind(lines):
            return read(path, lines)
    first = next((line for line in lines if line.strip()), None)
    if first is None:
        raise AirfoilError(f"{path}: the file is empty, must have airfoil data")
    raise AirfoilError(
        f"{path}:1: {plain(first)!r} begins no airfoil file, allowed are C81 tables, polars of XFOIL or XFLR5,"
        " AeroDyn airfoil files, and CSV with the columns alpha_deg, cl and cd"
    )
