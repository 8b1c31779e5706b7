"""Airfoil files of AeroDyn, the aerodynamics of OpenFAST: of version 15 and later, and of versions 13 and 14."""

import re
from collections.abc import Sequence
from pathlib import Path

from sbs_sim.aircraft.airfoil_files.polar import (
    AirfoilData,
    Polar,
    Row,
    make_polar,
    parse_number,
    parse_row,
    plain,
    to_number,
)
from sbs_sim.errors import AirfoilError

TABLE = re.compile(r"^\s*\S+\s+NumAlf\b", re.IGNORECASE)
OLD_TABLES = "number of airfoil tables in this file"
MILLION = 1e6
MAX_ROWS = 10_000


def is_aerodyn(lines: Sequence[str]) -> bool:
    """True if a file has a table of AeroDyn 15."""
    return any(TABLE.match(line) for line in lines)


def is_old_aerodyn(lines: Sequence[str]) -> bool:
    """True if a file has the count of tables of AeroDyn 13 and 14."""
    return any(OLD_TABLES in line.lower() for line in lines)


def read_aerodyn(path: Path, lines: Sequence[str]) -> AirfoilData:
    """Tables of AeroDyn 15: a value, then its name, and behind NumAlf the rows. Re is in millions.

    Tables over a control setting, such as a flap angle, are refused.

    Raises
    ------
    AirfoilError
        One line: file, line, the value and what is allowed.
    """
    polars, count, repeated = list[Polar](), None, 0
    numbers, settings, i = dict[str, float](), dict[str, int](), 0
    while i < len(lines):
        i += 1
        value, label = _labelled(lines[i - 1])
        if label == "numtabs":
            count = _whole(path, i, "NumTabs", value)
        elif label == "re":
            numbers = _reynolds(path, i, value)
        elif label in ("userprop", "ctrl"):
            settings.setdefault(value, i)
        elif label == "numalf":
            rows, end = _rows(path, lines, i, _whole(path, i, "NumAlf", value))
            polar, left_out = make_polar(path, i, rows, numbers)
            polars.append(polar)
            repeated, i = repeated + left_out, end
    if len(settings) > 1:
        line = list(settings.values())[1]
        raise AirfoilError(f"{path}:{line}: control setting {plain(list(settings)[1])} must be that of the first table")
    if count is not None and count != len(polars):
        raise AirfoilError(f"{path}:{len(lines)}: the file has {len(polars)} tables, must have {count}, its NumTabs")
    if not polars:
        raise AirfoilError(f"{path}:{len(lines)}: the file has no table, must have one behind a line with NumAlf")
    remarks = (f"{repeated} repeated angles left out",) if repeated else ()
    return AirfoilData("AeroDyn airfoil file", path.stem, tuple(polars), remarks)


def _labelled(line: str) -> tuple[str, str]:
    """Value and name of a line, the name in small letters; comments begin with an exclamation mark."""
    fields = line.split()
    if len(fields) < 2 or line.lstrip().startswith("!"):
        return "", ""
    return fields[0], fields[1].lower()


def _reynolds(path: Path, line: int, value: str) -> dict[str, float]:
    """Reynolds number of a table; 0 is none, as in tables that hold for all."""
    millions = parse_number(f"{path}:{line}", "Re", value)
    return {"reynolds": millions * MILLION} if millions else {}


def _whole(path: Path, line: int, what: str, text: str) -> int:
    if not (text.isascii() and text.isdecimal() and 1 <= int(text[:9]) <= MAX_ROWS):
        raise AirfoilError(f"{path}:{line}: {what} {plain(text)!r} must be an integer from 1 to {MAX_ROWS}")
    return int(text)


def _rows(path: Path, lines: Sequence[str], first: int, count: int) -> tuple[list[Row], int]:
    """Rows of a table, and the index of the line behind it."""
    rows, i = list[Row](), first
    while len(rows) < count:
        if i == len(lines):
            raise AirfoilError(f"{path}:{i}: the table ends after {len(rows)} lines, must have {count}, its NumAlf")
        i += 1
        if lines[i - 1].strip() and not lines[i - 1].lstrip().startswith("!"):
            rows.append(parse_row(path, i, lines[i - 1].split()))
    return rows, i


def read_old_aerodyn(path: Path, lines: Sequence[str]) -> AirfoilData:
    """The one table of an airfoil file of AeroDyn 13 or 14; the rows follow a header of values with their meaning.

    Raises
    ------
    AirfoilError
        Several tables, or a row that is none.
    """
    head = next(i for i, line in enumerate(lines) if OLD_TABLES in line.lower())
    if _whole(path, head + 1, "number of tables", lines[head].split()[0]) != 1:
        raise AirfoilError(f"{path}:{head + 1}: {plain(lines[head])!r}, allowed is one table")
    numbers, rows = dict[str, float](), list[Row]()
    for i in range(head + 1, len(lines)):
        fields = lines[i].split()
        if "reynolds number" in lines[i].lower() and not rows:
            numbers = _reynolds(path, i + 1, fields[0])
        elif fields[:1] == ["EOT"]:
            break
        elif (rows and fields) or (len(fields) > 2 and None not in map(to_number, fields[:3])):
            rows.append(parse_row(path, i + 1, fields))
    polar, repeated = make_polar(path, head + 1, rows, numbers)
    remarks = (f"{repeated} repeated angles left out",) if repeated else ()
    return AirfoilData("AeroDyn 13 or 14 airfoil file", path.stem, (polar,), remarks)
