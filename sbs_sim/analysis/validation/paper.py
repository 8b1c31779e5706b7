"""The paper of the aircraft `sbs`, as `./run reproduce` compares it."""

from collections.abc import Iterator, Mapping

from sbs_sim.analysis.paper_tables import Value, contents
from sbs_sim.analysis.reproduce import MISMATCH, NEARLY_ZERO, Comparison, Entry, reproduce
from sbs_sim.analysis.reproduce_format import notes
from sbs_sim.analysis.validation.comparison import Aim, Case, Row, compared

AIM = Aim(
    share=MISMATCH, why="20 % of a printed number, as in reproduce; real poles with their sign, pairs by magnitude"
)
ZERO_AIM = Aim(absolute=NEARLY_ZERO, why="0.05 deg or rad/s of a printed zero, as in reproduce")
OTHER_KIND = Aim(why="a pair is no real pole: missed at any distance")


def case() -> Case:
    """Tables 1 to 5, inflow poles and hover, by the paper's reading and by the complete model."""
    report = reproduce()
    rows = [row for name, table in report.tables.items() for row in _rows(_source(name, table), table)]
    return Case(
        name="paper",
        title="Side-by-side helicopter of the paper",
        source=contents()["source"],
        statement="What the command reproduce computes: hover, once with sbs_paper, the paper's reading, and once with"
        " sbs without lag dampers, the complete model. Both are judged; the paper's reading is the one that has the"
        " assumptions of the paper.",
        substitutes=(
            "Airfoil, flap inertia about the axis, hub moment and swashplate phase, which the paper leaves open.",
        ),
        rows=tuple(rows),
        remarks=tuple(_remarks(report.tables)),
    )


def _source(name: str, table: Comparison) -> str:
    return f"Table {name.removeprefix('table')}" if name.startswith("table") else table.title


def _rows(source: str, table: Comparison) -> Iterator[Row]:
    """Rows of every printed number, and of the dampings that are printed with poles."""
    for group, entries in table.groups.items():
        where = f"{source}, {table.group_labels[group].lower()}" if table.group_labels.get(group) else source
        for entry in entries.values():
            yield from _both(entry.label, where, entry)
            if "damping" in entry.columns:
                yield from _both(f"{entry.label}, Re / magnitude", where, entry.columns["damping"])


def _both(quantity: str, where: str, entry: Entry) -> Iterator[Row]:
    if entry.printed.value is None:
        return
    for name, ours in (("paper's reading", entry.paper_reading), ("complete", entry.complete)):
        theirs, own = _number(entry.printed.value, ours), _number(ours, entry.printed.value)
        yield compared(quantity, f"{where}, {name}", theirs, own, entry.unit, _aim(entry, ours))


def _number(value: Value | None, other: Value | None) -> float:
    """Real part of a value; of a pole its magnitude where it or the other one is a pair; NaN for none."""
    if value is None:
        return float("nan")
    return complex(value).real if _is_real(value) and _is_real(other) else abs(value)


def _is_real(value: Value | None) -> bool:
    return value is None or complex(value).imag == 0.0


def _aim(entry: Entry, ours: Value | None) -> Aim:
    if not entry.printed.value:
        return ZERO_AIM
    return AIM if _is_real(ours) == _is_real(entry.printed.value) else OTHER_KIND


def _remarks(tables: Mapping[str, Comparison]) -> Iterator[str]:
    """Remarks of reproduce on what is off, each once, with the entries that it is about."""
    about: dict[str, list[str]] = {}
    for name, table in tables.items():
        for remark in notes(table):
            labels = [own.label for own in table.entries() if own.remark == remark and own.is_mismatch]
            if labels:
                about.setdefault(remark, []).append(f"{_source(name, table)}, {', '.join(dict.fromkeys(labels))}")
    for remark, places in about.items():
        yield f"{'; '.join(places)}: {remark}."
