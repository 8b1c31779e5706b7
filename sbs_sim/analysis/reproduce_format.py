"""How the recomputed results are written, for the terminal and for the page alike."""

import math
from collections.abc import Iterator, Mapping
from typing import Any

from sbs_sim.analysis.paper_tables import Value
from sbs_sim.analysis.reproduce import AIRSPEEDS, Comparison, Entry, Report

DIGITS = 4
HEADINGS = ("paper", "complete", "ratio", "paper's reading", "ratio")
OTHERS = {  # further values of an entry
    "complete_quasi_static": "complete, quasi-static",
    "paper_reading_full_matrix": "paper's reading, full matrix",
    "paper_reading_naca0012": "paper's reading, NACA 0012",
    "complete_at_printed_coning": "complete, at 0.53 deg",
    "paper_reading_at_printed_coning": "paper's reading, at 0.53 deg",
    "complete_coupled": "complete, whole system",
    "paper_reading_coupled": "paper's reading, whole system",
}
SOURCES = {
    "complete": "complete",
    "paper_reading": "paper's reading",
    "paper_reading_naca0012": "paper's reading, NACA 0012",
    "paper_reading_uniform_inflow": "paper's reading, uniform inflow",
    "printed_poles": "printed poles imply",
}

FLIGHTS = {"complete": "complete", "paper_reading": "reading", "paper_reading_uniform_inflow": "uniform inflow"}


def value_text(value: Any) -> str:
    """Number, pole, or several of them; a dash where there is none."""
    if value is None:
        return "-"
    if isinstance(value, list | tuple):
        return ", ".join(value_text(item) for item in value) or "-"
    if not isinstance(value, complex):
        return _number(value)
    if value.imag == 0.0:
        return _number(value.real)
    return f"{_number(value.real)} ± {_number(value.imag)}i" if value.real else f"± {_number(value.imag)}i"


def _number(value: float) -> str:
    if math.isnan(value):
        return "-"
    if abs(value) < 1e-9:
        return "0"
    return f"{value:.{DIGITS}g}"


def ratio_text(entry: Entry, ours: Value | None) -> str:
    """Ratio with a star where the value is off; a dash where nothing, or zero, is printed."""
    ratio = entry.ratio(ours)
    text = "-" if ratio is None else f"{ratio:.3f}"
    return f"{text}*" if entry.is_off(ours) else text


def rows(comparison: Comparison) -> Iterator[tuple[str, str, Entry]]:
    """Rows to show as group's key, label and entry: each entry, and its damping where that is printed.

    The printed frequencies are the magnitudes of the poles, which the ratios are of.
    """
    for group, entries in comparison.groups.items():
        for entry in entries.values():
            yield group, _label(entry), entry
            if "damping" in entry.columns:
                yield group, "  damping Re/|p|", entry.columns["damping"]


def _label(entry: Entry) -> str:
    return f"{entry.label} [{entry.unit}]" if entry.unit not in ("", "rad/s") else entry.label


def notes(comparison: Comparison) -> dict[str, int]:
    """Numbers of the remarks, in the order of the entries."""
    found: dict[str, int] = {}
    for entry in comparison.entries():
        if entry.remark:
            found.setdefault(entry.remark, len(found) + 1)
    return found


def other_names(comparison: Comparison) -> list[str]:
    """Names of the further values that the entries of a table have."""
    names = {name for entry in comparison.entries() for name in entry.others}
    return [name for name in OTHERS if name in names]


def title(name: str, comparison: Comparison) -> str:
    """Heading of a table."""
    number = f"Table {name.removeprefix('table')}: " if name.startswith("table") else ""
    unit = " [rad/s]" if any(entry.unit == "rad/s" for entry in comparison.entries()) else ""
    return f"{number}{comparison.title}{unit}"


# Title, headings, rows; an empty heading is spanned by the one before.
Printable = tuple[str, list[str], list[list[str]]]


def fact_tables(report: Report) -> list[Printable]:
    """Facts that explain the differences."""
    facts = report.facts
    damping = [
        [f"Table {table.removeprefix('table')}", SOURCES[source], *(f"{value:.4g}" for value in own.values())]
        for table, sources in facts["hub_damping"].items()
        for source, own in sources.items()
    ]
    order = {"as_printed": "in the order of print", "as_equation_14": "in the order of eq. [14]"}
    return [
        (
            "Damping of the hub moments, all rotors, quasi-static [N m s]",
            ["fidelity of", "source", "roll", "pitch", "pitch/roll"],
            damping,
        ),
        (
            "First matrix of eq. [32], of one rotor: poles [rad/s]",
            ["its last row", "poles"],
            [[label, value_text(facts["equation_32"][name])] for name, label in order.items()],
        ),
        (
            "Table 4 with the sign of λ_c reversed in all loads: quasi-static body poles [rad/s]",
            ["mode", *(SOURCES[name] for name in facts["lambdac_reversed"])],
            _by_mode(facts["lambdac_reversed"]),
        ),
        (
            "Rotor poles of the complete system, where Table 5 has those of a part of it [rad/s]",
            ["mode", *(SOURCES[name] for name in facts["rotor_poles"])],
            _by_mode(facts["rotor_poles"]),
        ),
    ]


def _by_mode(poles: Mapping[str, Mapping[str, complex]]) -> list[list[str]]:
    names = list(dict.fromkeys(name for own in poles.values() for name in own))
    return [[name, *(value_text(own.get(name)) for own in poles.values())] for name in names]


def forward_table(report: Report, every: int) -> Printable:
    """Trims over forward speed, one of every so many."""
    curves = report.trim_curves()
    angles = {"pitch": "pitch_deg", "collective": "collective_deg", "push": "longitudinal_cyclic_deg"}
    headings = ["airspeed"]
    found = [["m/s", *angles, *angles, *angles]]
    for source in curves:
        headings += [FLIGHTS[source], "", ""]
    for i in range(0, len(AIRSPEEDS), every):
        row = [f"{AIRSPEEDS[i]:g}"]
        for curve in curves.values():
            star = "*" if curve["beyond_limits"][i] else ""
            row += [_angle(curve[name][i], star) for name in angles.values()]
        found.append(row)
    title = (
        "Trim over forward speed: pitch attitude, collective and longitudinal cyclic (a push is positive) [deg]; a star"
        " is beyond the limits of a control, a dash no trim"
    )
    return title, headings, found


def _angle(value: float, star: str) -> str:
    return "-" if math.isnan(value) else f"{round(value, 2) + 0.0:.2f}{star}"
