"""Signals of flights that were measured elsewhere, from a CSV file."""

from __future__ import annotations  # `help` then shows types by their names

import csv
import math
import re
from collections.abc import Collection
from pathlib import Path

import numpy as np

from sbs_sim import checks
from sbs_sim.errors import IdentificationError
from sbs_sim.flight.signals import Signals, interval

TIME = "time"
HEADING = re.compile(r"\s*([^\[\]]+?)\s*(?:\[([^\[\]]*)\])?\s*$")
MAX_BYTES = 1 << 28


def read_signals(path: str | Path, held: Collection[str] = ()) -> Signals:
    """Signals of a CSV file with a heading.

    Parameters
    ----------
    path : str or Path
        The first row has names, with units in brackets: `time [s],elevator [deg],q [deg/s]`; angles in degrees become
        radians. The column `time` is in s, at equal intervals.
    held : collection of str
        Signals that keep each value until the next sample: commands of a computer, but not measured positions.

    Raises
    ------
    IdentificationError
        The file cannot be read, or has no such table: with line and what is allowed.
    """
    path = checks.path("path", path, IdentificationError)
    try:
        if path.stat().st_size > MAX_BYTES:
            raise IdentificationError(f"{path}: allowed are files up to {MAX_BYTES} bytes")
        with path.open(newline="", encoding="utf-8-sig") as file:
            rows = list(csv.reader(file))
    except (OSError, ValueError, csv.Error) as error:
        raise IdentificationError(f"{path}: {getattr(error, 'strerror', None) or error}") from None
    if not rows:
        raise IdentificationError(f"{path} is empty: allowed is a heading with rows of numbers")
    names, units = _headings(path, rows[0])
    table = _numbers(path, rows[1:], len(names))
    time = table[:, names.index(TIME)]
    values, said = {}, {}
    for i, (name, unit) in enumerate(zip(names, units, strict=True)):
        if name != TIME:
            in_degrees = unit.startswith("deg")
            values[name] = np.radians(table[:, i]) if in_degrees else table[:, i]
            said[name] = unit.replace("deg", "rad", 1) if in_degrees else unit
    for name in held:
        checks.choice("held", name, tuple(values), IdentificationError)
    return Signals(interval(time), values, said, frozenset(held), float(time[0]))


def _headings(path: Path, row: list[str]) -> tuple[list[str], list[str]]:
    """Names and units."""
    found = [HEADING.match(text) for text in row]
    for text, match in zip(row, found, strict=True):
        if match is None:
            raise IdentificationError(f"{path}, line 1: {checks.shown(text)}: allowed is a name [unit]")
    names = [match[1] for match in found if match is not None]
    if TIME not in names or len(set(names)) != len(names) or len(names) < 3:
        raise IdentificationError(f"{path}, line 1: allowed are {TIME} [s] and two or more other names, each once")
    return names, [match[2] or "1" for match in found if match is not None]


def _numbers(path: Path, rows: list[list[str]], count: int) -> np.ndarray:
    """Rows of numbers, shape (n, count)."""
    table = []
    for line, row in enumerate(rows, 2):
        if not row:
            continue
        try:
            values = [float(text) for text in row]
        except ValueError:
            values = []
        if len(values) != count or not all(map(math.isfinite, values)):
            raise IdentificationError(f"{path}, line {line}: allowed are {count} finite numbers")
        table.append(values)
    return np.array(table, np.float64).reshape(-1, count)
