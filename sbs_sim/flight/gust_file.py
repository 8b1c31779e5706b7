"""Own gusts as tables in CSV: a head line and one row for each time or distance."""

import csv
import math
from pathlib import Path

import numpy as np

from sbs_sim import checks
from sbs_sim.errors import SimulationError
from sbs_sim.model.gust_table import DISTANCE, MAX_GUST, MAX_POSITION, TIME, GustTable

VELOCITIES = ["north [m/s]", "east [m/s]", "down [m/s]"]
HEADS = {"time [s]": TIME, "distance [m]": DISTANCE}
MAX_SIZE = 2_000_000  # bytes of a file


def read_gust(path: str | Path) -> GustTable:
    """Own gust of a CSV file, see `gust_table`.

    Raises
    ------
    SimulationError
        The file cannot be read, or is no such table; the message names file and line.
    """
    try:
        if (size := Path(path).stat().st_size) > MAX_SIZE:
            raise SimulationError(f"{path} has {size} bytes: allowed are up to {MAX_SIZE}")
        text = Path(path).read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise SimulationError(f"{path}: {getattr(error, 'strerror', None) or error}") from None
    return gust_table(text, str(path))


def gust_table(text: str, name: str = "gust") -> GustTable:
    """Own gust of the text of a table.

    The first line is `time [s],north [m/s],east [m/s],down [m/s]`, or begins with `distance [m]`. Empty lines do not
    count.

    Raises
    ------
    SimulationError
        It is no such table; the message begins with `name` and names the line.
    """
    lines = [(number, [cell.strip() for cell in row]) for number, row in enumerate(csv.reader(text.splitlines()), 1)]
    lines = [(number, row) for number, row in lines if any(row)]
    head = lines[0][1] if lines else []
    if len(head) != 4 or head[0] not in HEADS or head[1:] != VELOCITIES:
        allowed = " or ".join(f"'{first},{','.join(VELOCITIES)}'" for first in HEADS)
        raise SimulationError(f"{name}: the first line is {','.join(head)[:60]!r}: allowed is {allowed}")
    rows: list[list[float]] = []
    for number, row in lines[1:]:
        rows.append(_numbers(row, head, f"{name}, line {number}"))
        if len(rows) > 1 and not rows[-1][0] > rows[-2][0]:
            allowed = f"more than {rows[-2][0]:g}, the one before"
            raise SimulationError(f"{name}, line {number}: {head[0]} = {rows[-1][0]:g}: allowed is {allowed}")
    try:
        table = np.array(rows).reshape(-1, 4)
        return GustTable(HEADS[head[0]], table[:, 0], table[:, 1:])
    except SimulationError as error:
        raise SimulationError(f"{name}: {error}") from None


def _numbers(row: list[str], head: list[str], place: str) -> list[float]:
    try:
        values = [float(cell) for cell in row]
    except ValueError:
        values = []
    if len(values) != 4 or not all(map(math.isfinite, values)):
        raise SimulationError(f"{place}: {','.join(row)[:60]!r}: allowed are 4 numbers")
    for column, value, most in zip(head, values, (MAX_POSITION, *[MAX_GUST] * 3), strict=True):
        checks.number(f"{place}: {column}", value, -most, most, "", SimulationError)
    return values
