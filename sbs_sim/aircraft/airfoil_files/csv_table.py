"""CSV files whose header names angle, lift and drag, and Reynolds or Mach number or neither, in any order."""

import re
from collections.abc import Sequence
from itertools import groupby
from pathlib import Path

from sbs_sim.aircraft.airfoil_files.polar import AirfoilData, Row, make_polar, parse_number, plain
from sbs_sim.errors import AirfoilError
from sbs_sim.model.airfoil import AXES, POLAR_COLUMNS

COLUMNS = {
    **dict.fromkeys(("alpha_deg", "alpha", "aoa", "aoa_deg"), "alpha_deg"),
    **{name: name for name in ("cl", "cd", *AXES)},
    "re": "reynolds",
    "ma": "mach",
}
UNIT = re.compile(r"\s*[\[(](.*)[\])]$")  # behind a name


def is_csv(lines: Sequence[str]) -> bool:
    """True if the first line that is no comment names angle, lift and drag."""
    content = _content(lines)
    return bool(content) and set(POLAR_COLUMNS) <= set(_header(content[0][1]))


def read_csv(path: Path, lines: Sequence[str]) -> AirfoilData:
    """Polars of a CSV file: one for each block of rows of the same Reynolds and Mach number, each with its own angles.

    Raises
    ------
    AirfoilError
        One line: file, line, the value and what is allowed.
    """
    (first, head), *content = _content(lines)
    columns = _header(head)
    if "rad" in head.lower():
        raise AirfoilError(f"{path}:{first}: {plain(head)!r} must have angles in degrees")
    rows = [_row(path, line, text, head.count(",") + 1, columns) for line, text in content]
    polars, repeated = [], 0
    for numbers, pairs in groupby(rows, key=lambda row: row[0]):
        block = [row for _, row in pairs]
        polar, left_out = make_polar(path, block[0].line, block, dict(numbers))
        polars.append(polar)
        repeated += left_out
    if not polars:
        raise AirfoilError(f"{path}:{first}: no rows follow the header")
    remarks = (f"{repeated} repeated angles left out",) if repeated else ()
    return AirfoilData("CSV", path.stem, tuple(polars), remarks)


def _content(lines: Sequence[str]) -> list[tuple[int, str]]:
    """Lines that are neither empty nor comments, and their numbers."""
    return [(i, line) for i, line in enumerate(lines, 1) if line.strip() and line.lstrip()[0] not in "#!"]


def _header(line: str) -> dict[str, int]:
    """Numbers of the columns of a header that are known, by their names."""
    names = [UNIT.sub("", field.strip().strip('"')).lower() for field in line.split(",")]
    return {COLUMNS[name]: k for k, name in reversed(list(enumerate(names))) if name in COLUMNS}


def _row(
    path: Path, line: int, text: str, count: int, columns: dict[str, int]
) -> tuple[tuple[tuple[str, float], ...], Row]:
    """Reynolds and Mach number of a row, and the row."""
    fields = text.split(",")
    if len(fields) != count:
        raise AirfoilError(f"{path}:{line}: {len(fields)} values, must be {count}, as in the header")
    found = {name: parse_number(f"{path}:{line}", name, fields[k]) for name, k in columns.items()}
    numbers = tuple((axis, found[axis]) for axis in AXES if axis in found)
    return numbers, Row(line, *(found[name] for name in POLAR_COLUMNS))
