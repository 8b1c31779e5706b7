"""C81 tables, the format of rotorcraft codes: lift, drag and moment over Mach number and angle of attack.

The first line has a name in 30 characters and six counts of two digits: Mach numbers and angles of lift, drag and
moment. A block of each follows: the Mach numbers, then for each angle a row of the angle and its coefficients. Fields
have seven characters; a line has ten, the first of which is the angle, blank in lines that go on. This is 7X,9F7.0 and
10F7.0/(7X,9F7.0) in Fortran.
"""

from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np

from sbs_sim.aircraft.airfoil_files.polar import (
    AirfoilData,
    Row,
    check_values,
    make_polar,
    parse_number,
    plain,
    to_number,
)
from sbs_sim.errors import AirfoilError
from sbs_sim.model.airfoil import AirfoilTable, Array

NAME_LENGTH, COUNT_WIDTH, COUNTS = 30, 2, 6
WIDTH, PER_LINE = 7, 9  # characters of a field, values in a line behind the angle
DATA_END, CARD_END = 70, 80  # behind the fields a punched card has room for its number
MAX_COUNT = 99  # in two digits


def head_of(line: str) -> tuple[str, list[int]] | None:
    """Name and the six counts of a first line; none if it has none. Counts may touch, and the name may be shorter."""
    name, rest = line[:NAME_LENGTH], line[NAME_LENGTH:]
    ends = [COUNT_WIDTH * k for k in range(COUNTS + 1)]
    touching = [] if rest[ends[-1] :][:1].isdigit() else [rest[first:end].strip() for first, end in pairwise(ends)]
    short = line.rsplit(maxsplit=COUNTS)
    for head, fields in ((name, rest.split()), (name, touching), (short[0] if short else "", short[1:])):
        is_counts = len(fields) == COUNTS and all(field.isascii() and field.isdecimal() for field in fields)
        if is_counts and all(int(field[:9]) > 0 for field in fields[:4]):
            return plain(head).rstrip(" ;"), [int(field[:9]) for field in fields]
    return None


class _Lines:
    """Lines of a C81 table behind the first, read row by row."""

    def __init__(self, path: Path, lines: Sequence[str]):
        self.path, self.lines, self.next = path, lines, 1

    def row(self, count: int, has_angle: bool) -> list[float]:
        """A row with `count` values behind an angle or without one, over as many lines as it takes."""
        found, missing = list[float](), count + has_angle
        while missing:
            if self.next == len(self.lines):
                raise AirfoilError(f"{self.path}:{self.next}: the file ends where {missing} more numbers must follow")
            begins = has_angle and not found
            self.next += 1
            found += _numbers(f"{self.path}:{self.next}", self.lines[self.next - 1], missing, begins)
            missing = count + has_angle - len(found)
        return found

    def block(self, what: str, counts: Sequence[int]) -> "_Block":
        """Block of a coefficient with some Mach numbers and angles."""
        line = self.next + 1
        mach = np.array(self.row(counts[0], has_angle=False))
        self._check_increase(f"Mach numbers of {what}", mach, [line] * len(mach))
        rows, lines = [], []
        for _ in range(counts[1]):
            lines.append(self.next + 1)
            rows.append(self.row(counts[0], has_angle=True))
            for value in rows[-1][1:]:
                check_values(self.path, lines[-1], rows[-1][0], **{what: value})
        angles = np.array([row[0] for row in rows])
        self._check_increase(f"angles of {what}", angles, lines)
        return _Block(mach, angles, np.array([row[1:] for row in rows]).T)

    def _check_increase(self, what: str, values: Array, lines: Sequence[int]) -> None:
        for before, value, line in zip(values[:-1], values[1:], lines[1:], strict=True):
            if value <= before:
                raise AirfoilError(f"{self.path}:{line}: {what}: {value:.10g} must be greater than {before:.10g}")


def _numbers(where: str, line: str, missing: int, has_angle: bool) -> list[float]:
    """Numbers of a line: by its columns, or else those between blanks, of which one line may have all of a row."""
    line = line.expandtabs().rstrip()
    here = min(missing, PER_LINE + has_angle)
    columns, fields = _columns(line, here, has_angle), line.split()
    if columns and all(to_number(field) is not None for field in columns):
        fields = columns
    elif len(fields) not in (here, missing):
        if not columns:
            raise AirfoilError(f"{where}: the line has {len(fields)} numbers, must have {here}")
        fields = columns
    return [parse_number(where, f"field {k}", field) for k, field in enumerate(fields, 1)]


def _columns(line: str, count: int, has_angle: bool) -> list[str]:
    """Fields of a line by its columns; none if there is text where columns are blank."""
    begin = 0 if has_angle else WIDTH
    ends = [begin + WIDTH * k for k in range(count + 1)]
    if line[:begin].strip() or line[ends[-1] : DATA_END].strip() or len(line) > CARD_END:
        return []
    return [line[first:end].strip() for first, end in pairwise(ends)]


class _Block(NamedTuple):
    """Mach numbers, angles [deg], and the coefficient, shape (Mach numbers, angles)."""

    mach: Array
    angles: Array
    values: Array

    def on(self, mach: Array, angles: Array) -> Array:
        """The coefficient at other Mach numbers and angles, linear between its own, and constant beyond them."""
        along = np.array([np.interp(angles, self.angles, row) for row in self.values])
        return np.array([np.interp(mach, self.mach, column) for column in along.T]).T


def is_c81(lines: Sequence[str]) -> bool:
    """True if the first line of a file has the counts of a C81 table."""
    return bool(lines) and head_of(lines[0]) is not None


def read_c81(path: Path, lines: Sequence[str]) -> AirfoilData:
    """Lift and drag on the Mach numbers and angles of both, between which the format is linear; moments are left out.

    Raises
    ------
    AirfoilError
        One line: file, line, the value and what is allowed.
    """
    name, counts = head_of(lines[0]) or ("", [])
    reader = _Lines(path, lines)
    lift, drag = reader.block("cl", counts[:2]), reader.block("cd", counts[2:4])
    low, high = max(lift.angles[0], drag.angles[0]), min(lift.angles[-1], drag.angles[-1])
    mach, angles = np.union1d(lift.mach, drag.mach), np.union1d(lift.angles, drag.angles)
    angles = angles[(angles >= low) & (angles <= high)]
    cl, cd = lift.on(mach, angles), drag.on(mach, angles)
    polars = []
    for number, cl_row, cd_row in zip(mach, cl, cd, strict=True):
        rows = [Row(2, *map(float, values)) for values in zip(angles, cl_row, cd_row, strict=True)]
        polars.append(make_polar(path, 2, rows, {"mach": float(number)})[0])
    remarks = [*(["moments left out"] if any(counts[4:]) else []), *_joined(lift, drag)]
    return AirfoilData("C81 table", name or path.stem, tuple(polars), tuple(remarks))


def _joined(lift: _Block, drag: _Block) -> list[str]:
    """What is done to lift and drag that have not the same Mach numbers and angles."""
    remarks = list[str]()
    if not (np.array_equal(lift.mach, drag.mach) and np.array_equal(lift.angles, drag.angles)):
        remarks.append("lift and drag joined on the Mach numbers and angles of both, linear between them")
    for one, other, name in ((lift, drag, "lift"), (drag, lift, "drag")):
        low, high = one.mach[0], one.mach[-1]
        if other.mach[0] < low or other.mach[-1] > high:
            remarks.append(f"{name} held beyond its Mach numbers {low:g} to {high:g}")
    low, high = max(lift.angles[0], drag.angles[0]), min(lift.angles[-1], drag.angles[-1])
    if min(lift.angles[0], drag.angles[0]) < low or max(lift.angles[-1], drag.angles[-1]) > high:
        remarks.append(f"cut to {low:g} to {high:g} deg, which both lift and drag have")
    return remarks


def c81_text(table: AirfoilTable, name: str) -> tuple[str, tuple[float, float]]:
    """Text of a C81 table, and the largest errors of lift and of drag between the angles that it has.

    A C81 table has at most 99 angles: of more, those are chosen between which straight lines are nearest to the table.
    Coefficients have four decimals, three below -1. Moments are zero.

    Parameters
    ----------
    table : AirfoilTable
        Over the Mach number, or with a single number, which is written for Mach 0 and 1.
    name : str
        Name of the airfoil, of which 30 characters are written, those beyond ASCII as question marks.

    Raises
    ------
    AirfoilError
        A table over several Reynolds numbers, or over more than 99 Mach numbers.
    """
    if table.axis != "mach" and len(table.numbers) > 1:
        found = ", ".join(f"{number:.10g}" for number in table.numbers)
        raise AirfoilError(
            f"{table.name}: a C81 table is over the Mach number, the table has Reynolds numbers {found}: choose one of"
            " them (--reynolds)"
        )
    single = len(table.numbers) == 1
    mach = np.array([0.0, 1.0]) if single else table.numbers
    cl, cd = (np.repeat(values, 2, axis=0) if single else values for values in (table.cl, table.cd))
    if len(mach) > MAX_COUNT or np.any(np.diff(np.round(mach, 4)) <= 0):
        raise AirfoilError(f"{table.name}: Mach numbers must be at most {MAX_COUNT}, 0.0001 apart or more")
    angles = np.rint(table.alpha / np.pi * table.half) * 180 / table.half
    kept, errors = zip(*(_chosen(angles, values) for values in (cl, cd)), strict=True)
    moment = np.array([-180.0, 180.0])
    counts = [len(mach), len(kept[0]), len(mach), len(kept[1]), len(mach), len(moment)]
    head = plain(name).encode("ascii", "replace").decode()[:NAME_LENGTH].ljust(NAME_LENGTH)
    lines = [head + "".join(f"{count:{COUNT_WIDTH}d}" for count in counts)]
    for own, values in zip(kept, (cl, cd), strict=True):
        lines += _block_lines(mach, angles[own], values[:, own])
    lines += _block_lines(mach, moment, np.zeros((len(mach), 2)))
    return "\n".join(lines) + "\n", (errors[0], errors[1])


def _block_lines(mach: Array, angles: Array, values: Array) -> list[str]:
    lines = _row_lines(" " * WIDTH, mach)
    for angle, column in zip(angles, values.T, strict=True):
        lines += _row_lines(f"{angle:{WIDTH}.2f}", column)
    return lines


def _row_lines(head: str, values: Array) -> list[str]:
    fields = [_field(float(value)) for value in values]
    lines = ["".join(fields[k : k + PER_LINE]) for k in range(0, len(fields), PER_LINE)]
    return [f"{' ' * WIDTH if k else head}{line}" for k, line in enumerate(lines)]


def _field(value: float) -> str:
    """Number of seven characters that begins with a blank, so that programs that look for blanks read it, too."""
    for decimals in range(4, -1, -1):
        text = f"{round(value, decimals) + 0.0:.{decimals}f}".replace("-0.", "-.")
        if len(text) < WIDTH:
            return text.rjust(WIDTH)
    raise AirfoilError(f"coefficient {value:.10g} must have at most 6 characters")


def _chosen(angles: Array, values: Array) -> tuple[list[int], float]:
    """At most 99 of the angles, by adding the one with the largest error until there is none, and the error left."""
    kept = [0, int(np.argmin(np.abs(angles))), len(angles) - 1]
    while True:
        guess = np.array([np.interp(angles, angles[kept], row[kept]) for row in values])
        errors = np.abs(guess - values).max(axis=0)
        if len(kept) == min(MAX_COUNT, len(angles)) or errors.max() < 1e-9:
            return kept, float(errors.max())
        kept = sorted({*kept, int(errors.argmax())})
