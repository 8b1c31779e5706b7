"""How a comparison with published results is written: on the terminal, as HTML, as Markdown."""

import math
from collections.abc import Sequence
from html import escape

from sbs_sim.analysis.html import document, plain_table, text_of
from sbs_sim.analysis.validation.comparison import MET, MISSED, Case, Report, Row, Table, spread

TITLE = "Published results beside ours"
HEADINGS = ("", "at", "unit", "published", "ours", "difference", "in %", "aim", "")
SUMMARY_HEADINGS = ("case", "aims met", "aims missed", "compared only", "median difference", "worst difference")
TEXT_COLUMNS, TABLE_TEXT_COLUMNS = (0, 1, 2, 8), (0, 1)
DIGITS = 4


def number(value: float) -> str:
    """Number with a few digits; a dash for none."""
    return "-" if math.isnan(value) else f"{value:.{DIGITS}g}"


def percent(share: float) -> str:
    """Share in per cent; a dash for none."""
    return "-" if math.isnan(share) else f"{100.0 * share:.3g} %"


def row_cells(row: Row) -> list[str]:
    """Cells of a row under `HEADINGS`."""
    signed = "-" if math.isnan(row.relative_difference) else f"{100.0 * row.relative_difference:+.2f}"
    aim = "" if row.aim is None else number(row.allowed)
    verdict = row.verdict if row.aim else ""
    note = "; ".join(part for part in (verdict, row.remark) if part)
    values = [number(row.published), number(row.ours), number(row.difference)]
    return [row.quantity, row.condition, "" if row.unit == "1" else row.unit, *values, signed, aim, note]


def table_headings(table: Table) -> tuple[str, ...]:
    """Headings of values without published ones."""
    return (table.title, "unit", *table.conditions)


def table_cells(table: Table) -> list[list[str]]:
    """Cells of all rows under `table_headings`."""
    return [[name, "" if unit == "1" else unit, *map(number, values)] for name, unit, values in table.rows]


def summary_rows(report: Report) -> list[list[str]]:
    """Cells of every case, and of all together, under `SUMMARY_HEADINGS`."""
    rows = [_summary(case.title, [case]) for case in report.cases]
    return [*rows, _summary("all cases", report.cases)] if len(rows) > 1 else rows


def _summary(title: str, cases: Sequence[Case]) -> list[str]:
    rows = [row for case in cases for row in case.rows]
    counts = [sum(row.verdict == verdict for row in rows) for verdict in (MET, MISSED)]
    return [title, *map(str, counts), str(len(rows) - sum(counts)), *map(percent, spread(rows))]


def aims(case: Case) -> list[str]:
    """Where the aims of a case come from, each once."""
    return list(dict.fromkeys(row.aim.why for row in case.rows if row.aim and row.aim.why))


def paragraphs(case: Case) -> list[tuple[str, str]]:
    """What is printed around the table of a case: labels and texts."""
    return [
        ("Source", case.source),
        ("Model", case.statement),
        *(("Substitute", text) for text in case.substitutes),
        *(("Aim", text) for text in aims(case)),
    ]


def remarks(case: Case) -> list[tuple[str, str]]:
    """What is printed below the table of a case."""
    return [("Remark", text) for text in case.remarks]


# --- HTML and Markdown ------------------------------------------------------------------------------------------


def page_text(report: Report) -> str:
    """One HTML page with everything."""
    summary = plain_table("Cases", SUMMARY_HEADINGS, summary_rows(report))
    sections = [("summary", "Summary", summary), *((case.name, case.title, _case_html(case)) for case in report.cases)]
    return document(TITLE, f"<p>{text_of(report.model)}</p>", sections)


def _case_html(case: Case) -> str:
    tables = [plain_table("", HEADINGS, [row_cells(row) for row in case.rows])] if case.rows else []
    tables += [plain_table("", table_headings(table), table_cells(table)) for table in case.tables]
    return "\n".join([_list(paragraphs(case)), *tables, _list(remarks(case))])


def _list(entries: Sequence[tuple[str, str]]) -> str:
    items = "".join(f"<li><b>{escape(label)}:</b> {text_of(text)}</li>" for label, text in entries)
    return f"<ul>{items}</ul>" if items else ""


def markdown(report: Report) -> str:
    """The page of the documentation."""
    parts = [f"# {TITLE}\n\n{report.model}\n", _markdown_table(SUMMARY_HEADINGS, summary_rows(report))]
    for case in report.cases:
        parts += [f"## {case.title}\n", _markdown_list(paragraphs(case))]
        parts += [_markdown_table(HEADINGS, [row_cells(row) for row in case.rows])] if case.rows else []
        parts += [_markdown_table(table_headings(table), table_cells(table)) for table in case.tables]
        parts += [_markdown_list(remarks(case))]
    return "\n".join(part for part in parts if part)


def _markdown_table(headings: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    table = [headings, ["---"] * len(headings), *rows]
    return "".join("| " + " | ".join(cell.replace("|", "\\|") for cell in row) + " |\n" for row in table)


def _markdown_list(entries: Sequence[tuple[str, str]]) -> str:
    return "".join(f"- **{label}**: {text}\n" for label, text in entries)
