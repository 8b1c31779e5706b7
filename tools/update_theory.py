"""Write the tables of docs/theory.md section 9.10 anew: the paper's printed numbers beside recomputed ones.

    ./run python tools/update_theory.py

replaces the text between the two `reproduction` comments of the page; all else stays as it is. That takes some ten
seconds.
"""

import math
import re
from collections.abc import Mapping
from pathlib import Path
from string import ascii_lowercase
from typing import Any

import numpy as np

from sbs_sim.analysis.reproduce import Comparison, Entry, Report, reproduce
from sbs_sim.analysis.reproduce_remarks import SECTION
from sbs_sim.analysis.sweep import Sweep

PAGE = Path(__file__).resolve().parent.parent / "docs" / "theory.md"
BEGIN, END = "<!-- reproduction: begin -->", "<!-- reproduction: end -->"
# the further value of each entry that is worth a column, and the heading of that
FURTHER = {
    "table5": ("paper_reading_at_printed_coning", "reading at 0.53 deg"),
    "inflow_poles": ("complete_coupled", "whole `sbs`"),
}
OTHERWISE = ("paper_reading_naca0012", "reading, NACA 0012")
NAMES = {"table1": "Table 1", "table2": "Table 2", "table3": "Table 3", "table4": "Table 4", "table5": "Table 5"}
SPEEDS = (0.0, 5.0, 10.0, 15.0, 20.0, 25.0)  # m/s
NOTHING = 1e-6  # what is smaller is rounding

INTRODUCTION = (
    "`sbs` is the complete model (poles of the full matrix; without lag dampers, of which the paper names none),"
    " reading the paper's reading `sbs_paper` (poles of the quasi-static matrix). Frequencies and damping ratios"
    " follow from the poles and are left out. A ratio in bold is more than a fifth off, or compares a real pole"
    " with a pair; the letters are the notes below."
)


class Notes:
    """Remarks by letter, each written once."""

    def __init__(self) -> None:
        self._letters: dict[str, str] = {}

    def letter(self, remark: str) -> str:
        """Letter of a remark, empty for none."""
        count = len(self._letters)
        following = ascii_lowercase[count % 26] * (count // 26 + 1)
        return self._letters.setdefault(remark.replace(f" ({SECTION})", ""), following) if remark else ""

    def lines(self) -> list[str]:
        """All remarks as a list."""
        return [f"- ({letter}) {remark}." for remark, letter in self._letters.items()]


def number(value: Any) -> str:
    """A number, a pole as the paper prints it, or several."""
    if value is None:
        return "none"
    if isinstance(value, list | tuple):
        return ", ".join(dict.fromkeys(number(item) for item in value))
    pole = complex(value)
    real, imag = (0.0 if abs(part) < NOTHING else part for part in (pole.real, abs(pole.imag)))
    if not imag:
        return f"{real:.3g}"
    return f"{real:.3g} ± {imag:.3g}i" if real else f"± {imag:.4g}i"


def ratio(entry: Entry, ours: Any) -> str:
    """Ours over print, bold where it is far off."""
    value = entry.ratio(ours)
    text = "" if value is None else f"{value:.2f}"
    return f"**{text or 'off'}**" if entry.is_off(ours) else text


def row(entry: Entry, label: str, further: str, notes: Notes) -> str:
    """One line of a table."""
    cells = [f"{label} [{entry.unit}]", entry.printed.text or "not printed"]
    for ours in (entry.complete, entry.paper_reading):
        cells += [number(ours), ratio(entry, ours)]
    cells += [number(entry.others[further]) if further in entry.others else "", notes.letter(entry.remark)]
    return "| " + " | ".join(cells) + " |"


def table(name: str, comparison: Comparison, notes: Notes) -> list[str]:
    """One printed table."""
    further, heading = FURTHER.get(name, OTHERWISE)
    title = f"{NAMES[name]}: {comparison.title}" if name in NAMES else comparison.title
    lines = [f"**{title}**", "", f"| | paper | `sbs` | ratio | reading | ratio | {heading} | |", "|---" * 8 + "|"]
    for group, entries in comparison.groups.items():
        before = f"{comparison.group_labels[group]}: " if comparison.group_labels.get(group) else ""
        lines += [row(entry, before + entry.label, further, notes) for entry in entries.values()]
    return [*lines, ""]


def forward_flight(flights: Mapping[str, Sweep]) -> list[str]:
    """Trims over the forward speed."""
    lines = [
        "**Forward flight** (pitch attitude and longitudinal cyclic in deg; the text of the paper: nose down, push)"
    ]
    lines += ["", "| | " + " | ".join(f"{speed:g} m/s" for speed in SPEEDS) + " |", "|---" * (len(SPEEDS) + 1) + "|"]
    for name, flight in flights.items():
        cells = [trimmed(flight, int(np.flatnonzero(flight.values == speed)[0])) for speed in SPEEDS]
        lines.append(f"| {LABELS.get(name, name)} | " + " | ".join(cells) + " |")
    return [*lines, ""]


def trimmed(flight: Sweep, index: int) -> str:
    """Pitch and longitudinal cyclic of one trim [deg], and whether controls are beyond their limits."""
    point = flight.points[index].trim
    if point is None:
        return "no trim"
    angles = (round(math.degrees(flight[name][index]), 1) + 0.0 for name in ("pitch", "longitudinal_cyclic"))
    return ", ".join(f"{angle:.1f}" for angle in angles) + (" (beyond limits)" if point.beyond_limits else "")


LABELS = {
    "complete": "`sbs`",
    "paper_reading": "reading",
    "paper_reading_uniform_inflow": "reading, uniform inflow",
}


def markdown(report: Report) -> str:
    """Everything between the comments."""
    notes = Notes()
    lines = [INTRODUCTION, ""]
    for name, comparison in report.tables.items():
        lines += table(name, comparison, notes)
    lines += forward_flight(report.flights)
    return "\n".join([*lines, "Notes:", "", *notes.lines()])


def main() -> None:
    """Update the page."""
    page = PAGE.read_text(encoding="utf-8")
    if page.count(BEGIN) != 1 or page.count(END) != 1:
        raise SystemExit(f"{PAGE}: {BEGIN} and {END} must occur there once each")
    inside = f"{BEGIN}\n\n{markdown(reproduce())}\n\n{END}"
    PAGE.write_text(re.sub(f"{BEGIN}.*{END}", lambda _: inside, page, flags=re.DOTALL), encoding="utf-8")


if __name__ == "__main__":
    main()
