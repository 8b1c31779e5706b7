"""Polars of XFOIL, in the formats of XFOIL itself, XFLR5, QBlade and airfoiltools.com."""

import re
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

from sbs_sim.aircraft.airfoil_files.polar import AirfoilData, Polar, Row, make_polar, parse_number, parse_row, plain
from sbs_sim.errors import AirfoilError

TITLE = re.compile(r"Calculated polar for|^Xfoil polar\.")
NAME = re.compile(r"(?:Calculated polar for\s*:|^Airfoil,)(.*)")
VERSION = re.compile(r"xfoil|xflr5|qblade", re.IGNORECASE)  # the line above the title of the next polar
COLUMNS = re.compile(r"\s*alpha[\s,]+CL[\s,]+CD\b", re.IGNORECASE)
MACH = re.compile(r"\bMach\s*[=,]\s*([^\s,]+)")
# Re = 1.000 e 6, or Reynolds number,1000000
REYNOLDS = re.compile(r"\b(?:Re\s*=|Reynolds number,)\s*([^\s,]+?)(?:\s*e\s*([^\s,]+))?(?:[\s,]|$)")


def is_xfoil(lines: Sequence[str]) -> bool:
    """True if a file has a title of such a polar."""
    return any(TITLE.search(line) for line in lines)


def read_xfoil(path: Path, lines: Sequence[str]) -> AirfoilData:
    """One polar, or several one behind the other, at fixed Reynolds and Mach numbers.

    Raises
    ------
    AirfoilError
        One line: file, line, the value and what is allowed.
    """
    starts = [i for i, line in enumerate(lines) if TITLE.search(line)]
    found = [_read_polar(path, lines, first, end) for first, end in pairwise([*starts, len(lines)])]
    polars, repeated = zip(*found, strict=True)
    names = [match[1] for line in lines if (match := NAME.search(line))]
    remarks = (f"{sum(repeated)} repeated angles left out",) if sum(repeated) else ()
    return AirfoilData("XFOIL polar", plain(names[0] if names else "") or path.stem, polars, remarks)


def _read_polar(path: Path, lines: Sequence[str], first: int, end: int) -> tuple[Polar, int]:
    """Polar of the lines from its title on, and the number of its angles that are repeated."""
    head = next((i for i in range(first, end) if COLUMNS.match(lines[i])), end)
    if head == end:
        raise AirfoilError(f"{path}:{first + 1}: a line with alpha, CL and CD must follow the title of the polar")
    numbers = dict[str, float]()
    for i in range(first, head):
        if "~" in lines[i]:
            raise AirfoilError(f"{path}:{i + 1}: {plain(lines[i])!r} must be fixed Reynolds and Mach numbers")
        numbers |= _numbers(path, i + 1, lines[i])
    if "reynolds" not in numbers:
        raise AirfoilError(f"{path}:{head + 1}: a line with Re = or Reynolds number must be above the polar")
    return make_polar(path, head + 1, _rows(path, lines, head + 1, end), numbers)


def _numbers(path: Path, line: int, text: str) -> dict[str, float]:
    """Reynolds and Mach number of a line above the polar, if it has them."""
    numbers = dict[str, float]()
    if match := REYNOLDS.search(text):
        exponent = match[2] or "0"
        numbers["reynolds"] = parse_number(f"{path}:{line}", "Re", f"{match[1]}e{exponent}" if match[2] else match[1])
    if match := MACH.search(text):
        numbers["mach"] = parse_number(f"{path}:{line}", "Mach", match[1])
    return numbers


def _rows(path: Path, lines: Sequence[str], first: int, end: int) -> list[Row]:
    rows = list[Row]()
    for i in range(first, end):
        if VERSION.search(lines[i]):
            break
        if lines[i].strip() and not set(lines[i].strip()) <= set("- ,"):
            rows.append(parse_row(path, i + 1, lines[i].replace(",", " ").split()))
    return rows
