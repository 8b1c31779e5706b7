"""The paper's printed results, read from config/paper_tables.yaml."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

from sbs_sim.config_file import config_folder

Value = complex | float

TABLES = ("table1", "table2", "table3", "table4", "table5", "inflow_poles", "hover")

# "-7.26", "0.013 ± 0.52i", "± 4.55i"; Table 4 has one without the i
POLE = re.compile(r"(?P<real>-?[\d.]+)?\s*(?:±\s*(?P<imag>[\d.]+)i?)?")


@dataclass(frozen=True)
class Cell:
    """One printed cell.

    Attributes
    ----------
    text : str
        As printed; empty where the paper prints nothing.
    value : complex, float or None
        Its number: complex for a pole, of a pair the one with the positive imaginary part.
    """

    text: str = ""
    value: Value | None = None


@dataclass(frozen=True)
class Row:
    """One printed row.

    Attributes
    ----------
    label : str
        What it is called in print.
    unit : str
    is_pole : bool
    cell : Cell
        The pole or the number.
    columns : mapping of str to Cell
        "frequency" [rad/s] and "damping" where they are printed.
    """

    label: str
    unit: str
    is_pole: bool
    cell: Cell
    columns: Mapping[str, Cell]


@dataclass(frozen=True)
class Table:
    """One printed table: its rows by group and key; tables without groups have one, called ""."""

    title: str
    groups: Mapping[str, Mapping[str, Row]]
    group_labels: Mapping[str, str]


def parse_pole(text: str) -> complex:
    """Number of a printed pole.

    Raises
    ------
    ValueError
        It is none.
    """
    match = POLE.fullmatch(text.strip())
    if not text.strip() or match is None:
        raise ValueError(f"no pole: {text!r}")
    return complex(float(match["real"] or 0.0), float(match["imag"] or 0.0))


@cache
def contents() -> dict[str, Any]:
    """The file as it is."""
    from ruamel.yaml import YAML  # here, because it is slow to import

    return dict(YAML(typ="safe", pure=True).load((config_folder() / "paper_tables.yaml").read_text(encoding="utf-8")))


@cache
def printed_tables() -> dict[str, Table]:
    """Printed tables by the names in `TABLES`."""
    return {name: _table(contents()[name]) for name in TABLES}


def _table(data: Mapping[str, Any]) -> Table:
    groups = data.get("groups", {"": data})
    rows = {key: {name: _row(row) for name, row in group["rows"].items()} for key, group in groups.items()}
    return Table(data["title"], rows, {key: group.get("label", "") for key, group in groups.items()})


def _row(data: Mapping[str, str]) -> Row:
    columns = {name: Cell(data[name], float(data[name])) for name in ("frequency", "damping") if name in data}
    if "pole" in data:
        return Row(data["label"], "rad/s", True, Cell(data["pole"], parse_pole(data["pole"])), columns)
    text = data.get("value", "")
    cell = Cell(data.get("wording", text), float(text)) if text else Cell()
    return Row(data["label"], data["unit"], False, cell, columns)
