"""The page of the recomputed results: one HTML file that holds all tables and figures and needs nothing else."""

import re
from collections.abc import Callable, Sequence
from html import escape
from pathlib import Path

from sbs_sim.analysis import reproduce_format as f
from sbs_sim.analysis.paper_tables import contents
from sbs_sim.analysis.plots import Drawing, drawings
from sbs_sim.analysis.reproduce import Comparison, Entry, Report
from sbs_sim.errors import ExportError
from sbs_sim.output.files import write

TITLE = "Recomputed results of the side-by-side helicopter"
PAGE = "index.html"
STYLE = """
:root { --ink: #1a1a1a; --faint: #5c5c5c; --rule: #c8c8c8; --off: #b3382c; --paper: #ffffff; --band: #f4f6f9; }
* { box-sizing: border-box; }
body { margin: 0 auto; padding: 2rem 1.25rem 4rem; max-width: 76rem; color: var(--ink); background: var(--paper);
  font: 16px/1.5 Georgia, "Liberation Serif", "Times New Roman", serif; }
h1, h2, h3, table, figcaption, nav, .meta { font-family: "Helvetica Neue", Arial, "Liberation Sans", sans-serif; }
h1 { font-size: 1.7rem; line-height: 1.2; margin: 0 0 0.5rem; }
h2 { font-size: 1.25rem; margin: 2.5rem 0 0.75rem; padding-bottom: 0.25rem; border-bottom: 1px solid var(--rule); }
h3 { font-size: 1rem; margin: 2rem 0 0.5rem; }
p, li { max-width: 46rem; }
nav ul { padding: 0; margin: 1rem 0; list-style: none; display: flex; flex-wrap: wrap; gap: 0.25rem 1.25rem; }
sub, sup { line-height: 0; font-size: 0.75em; }
a { color: #1f5fa8; }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; font-size: 0.82rem; line-height: 1.35; margin: 0.5rem 0;
  font-variant-numeric: tabular-nums; }
th, td { padding: 0.25rem 0.7rem 0.25rem 0; text-align: left; vertical-align: top; white-space: nowrap; }
thead th { border-bottom: 1.5px solid var(--ink); vertical-align: bottom; white-space: normal; font-weight: 600; }
tbody td, tbody th { border-bottom: 1px solid var(--rule); }
tbody th { font-weight: 400; }
tr.sub th { padding-left: 1.1rem; color: var(--faint); }
tr.group th { font-weight: 600; padding-top: 0.7rem; }
td.ratio, th.ratio, td.number, th.number { text-align: right; }
th.ratio, td.ratio { padding-right: 1.2rem; }
th.span { text-align: center; border-left: 0.7rem solid var(--paper); }
td.off { color: var(--off); font-weight: 600; }
td.ours { background: var(--band); padding-left: 0.4rem; }
ol.notes { font-size: 0.85rem; line-height: 1.4; padding-left: 1.6rem; margin: 0.5rem 0 1.5rem; }
.figures { display: grid; max-width: 66rem; grid-template-columns: repeat(2, minmax(0, 1fr)); gap: 1.5rem; }
figure { margin: 0; }
figure.wide { grid-column: 1 / -1; }
figure svg { display: block; width: 100%; height: auto; }
figure svg * { stroke-linejoin: round; stroke-linecap: butt; }
figcaption { font-size: 0.82rem; line-height: 1.4; margin-top: 0.4rem; }
.meta { font-size: 0.8rem; color: var(--faint); overflow-wrap: anywhere; }
@media (max-width: 45rem) { .figures { grid-template-columns: minmax(0, 1fr); } }
@media print {
  @page { size: A4; margin: 15mm; }
  body { max-width: none; padding: 0; font-size: 10pt; }
  nav { display: none; }
  .scroll { overflow: visible; }
  table { font-size: 7.6pt; }
  th, td, th.ratio, td.ratio { padding-right: 0.4rem; }
  ol.notes, figcaption, .meta { font-size: 8pt; }
  h2, h3 { break-after: avoid; }
  .block, tr, figure, ol.notes li { break-inside: avoid; }
  td.ours, .figures svg { print-color-adjust: exact; -webkit-print-color-adjust: exact; }
  a { color: inherit; text-decoration: none; }
}
"""


def save_page(report: Report, folder: str | Path, *, progress: Callable[[int, int], None] | None = None) -> list[Path]:
    """Write all figures as PNG and SVG, and the page.

    Parameters
    ----------
    report : Report
    folder : str or Path
        Made if there is none.
    progress : callable, optional
        Called with the number of figures done and that of all, as each ends.

    Returns
    -------
    list of Path
        The page is the last.

    Raises
    ------
    ExportError
        Folder or files cannot be written.
    """
    folder = make_folder(folder)
    written, shown = [], {}
    every = drawings(report)
    for done, drawing in enumerate(every, 1):
        for kind, content in drawing.encoded().items():
            written.append(folder / f"{drawing.name}.{kind}")
            write(written[-1], content)
            shown[drawing.name] = content
        if progress is not None:
            progress(done, len(every))
    page = folder / PAGE
    write(page, page_text(report, [(drawing, shown[drawing.name].decode()) for drawing in every]))
    return [*written, page]


def make_folder(folder: str | Path) -> Path:
    """Make a folder, if there is none.

    Raises
    ------
    ExportError
        It cannot be made.
    """
    try:
        Path(folder).mkdir(parents=True, exist_ok=True)
    except (OSError, ValueError) as error:
        raise ExportError(f"{folder}: no folder can be made there: {getattr(error, 'strerror', error)}") from None
    return Path(folder)


def page_text(report: Report, figures: Sequence[tuple[Drawing, str]]) -> str:
    """The page.

    Parameters
    ----------
    report : Report
    figures : sequence of (Drawing, str)
        Each with its SVG.
    """
    sections = [
        ("remarks", "Remarks", _remarks(report)),
        ("tables", "Tables", "\n".join(_comparison(name, table) for name, table in report.tables.items())),
        ("trim", "Trim over forward speed", _forward(report)),
        ("facts", "What explains the differences", "\n".join(_plain_table(*table) for table in f.fact_tables(report))),
        ("figures", "Figures", _figures(figures)),
        ("conditions", "Conditions and versions", _circumstances(report)),
    ]
    links = "".join(f'<li><a href="#{key}">{escape(heading)}</a></li>' for key, heading, _ in sections)
    body = "\n".join(
        f'<section id="{key}">\n<h2>{escape(heading)}</h2>\n{content}\n</section>' for key, heading, content in sections
    )
    return f"""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8"/>
<meta name="viewport" content="width=device-width, initial-scale=1"/>
<title>{TITLE}</title>
<style>{STYLE}</style>
</head>
<body>
<header>
<h1>{TITLE}</h1>
<p>The results that are printed in <cite>{escape(contents()["source"])}</cite>, beside those of this program: of its
complete model, and of the assumptions under which the printed poles come out (the paper’s reading).</p>
</header>
<nav aria-label="Contents"><ul>{links}</ul></nav>
<main>
{body}
</main>
</body>
</html>
"""


def _remarks(report: Report) -> str:
    """Remarks; the names of aircraft in them come from files and are not set like our own words."""
    names = {own["name"] for own in report.conditions["aircraft"].values()}
    pattern = rf"(?<!\w)({'|'.join(re.escape(name) for name in names)})(?!\w)"
    items = [
        "".join(escape(part) if part in names else _text(part) for part in re.split(pattern, text))
        for text in report.remarks
    ]
    return "<ul>" + "".join(f"<li>{item}</li>" for item in items) + "</ul>"


def _text(text: str) -> str:
    """Escaped; with minus signs, apostrophes, and indices and powers where they belong."""
    if text == "-":
        return "–"
    text = escape(text, quote=False)
    text = re.sub(r"(?<![\w)])-(?=\S)|(?<= )-(?= )", "−", text)
    text = re.sub(r"(?<=[a-z])'(?=s\b)", "’", text)
    text = re.sub(r"(?<=[\w'])_(\w)(?!\w)", r"<sub>\1</sub>", text)
    return re.sub(r"\^(\w)", r"<sup>\1</sup>", text)


# --- tables -----------------------------------------------------------------------------------------------------


def _comparison(name: str, table: Comparison) -> str:
    """One table with everything that was computed for it, and its remarks."""
    numbers, others = f.notes(table), f.other_names(table)
    frequencies = any("frequency" in entry.columns for entry in table.entries())
    headings = ["", "paper", *(["frequency"] if frequencies else []), *f.HEADINGS[1:]]
    headings += [*(f.OTHERS[other] for other in others), "remark"]
    ends = {i for i, heading in enumerate(headings) if heading == "ratio"}
    head = "".join(
        _cell("th", heading, "ratio" if i in ends else "", 'scope="col"') for i, heading in enumerate(headings)
    )
    rows, last = [], ""
    for group, label, entry in f.rows(table):
        if group != last:
            rows.append(_group_row(table.group_labels[group], len(headings)))
            last = group
        cells = [*_printed_cells(label, entry, frequencies), *_our_cells(entry, others)]
        note = "" if label.startswith(" ") else _note(entry, numbers, name)  # that of a damping is with its pole
        kind = ' class="sub"' if label.startswith(" ") else ""
        rows.append(f"<tr{kind}>{''.join(cells)}<td>{note}</td></tr>")
    notes = "".join(f'<li id="{name}-{number}">{_text(remark)}</li>' for remark, number in numbers.items())
    listed = f'<ol class="notes">{notes}</ol>' if notes else ""
    title = _text(f.title(name, table))
    return (
        f'<div class="block">\n<h3 id="{name}">{title}</h3>\n<div class="scroll"><table>\n<thead><tr>{head}</tr>'
        "</thead>\n<tbody>\n" + "\n".join(rows) + f"\n</tbody></table></div>\n</div>\n{listed}"
    )


def _group_row(label: str, width: int) -> str:
    return f'<tr class="group"><th scope="rowgroup" colspan="{width}">{_text(label)}</th></tr>'


def _printed_cells(label: str, entry: Entry, frequencies: bool) -> list[str]:
    """Name, what is printed, and the frequency that is printed beside a pole."""
    cells = [_cell("th", label.strip(), "", 'scope="row"'), _cell("td", entry.printed.text or "-")]
    if frequencies:
        cells.append(_cell("td", entry.columns["frequency"].printed.text if "frequency" in entry.columns else ""))
    return cells


def _our_cells(entry: Entry, others: Sequence[str]) -> list[str]:
    """Ours with their ratios, and the further values."""
    cells = []
    for ours in (entry.complete, entry.paper_reading):
        off = " off" if entry.is_off(ours) else ""
        cells += [_cell("td", f.value_text(ours), "ours"), _cell("td", f.ratio_text(entry, ours), f"ratio{off}")]
    return cells + [_cell("td", f.value_text(entry.others[other]) if other in entry.others else "") for other in others]


def _note(entry: Entry, numbers: dict[str, int], table: str) -> str:
    """Link to the remark."""
    number = numbers.get(entry.remark)
    return f'<a href="#{table}-{number}">{number}</a>' if number else ""


def _cell(tag: str, text: str, name: str = "", more: str = "", to_html: Callable[[str], str] = _text) -> str:
    attributes = (f' class="{name}"' if name else "") + (f" {more}" if more else "")
    return f"<{tag}{attributes}>{to_html(text)}</{tag}>"


def _plain_table(
    title: str, headings: Sequence[str], rows: Sequence[Sequence[str]], to_html: Callable[[str], str] = _text
) -> str:
    """Table of texts; columns of numbers stand at the right."""
    right = {i for i, cell in enumerate(rows[-1]) if re.fullmatch(r"-?[\d.]+\*?", cell)}
    body = "\n".join(
        "<tr>"
        + "".join(_cell("td", cell, "number" if i in right else "", "", to_html) for i, cell in enumerate(row))
        + "</tr>"
        for row in rows
    )
    return (
        f'<div class="block">\n<h3>{_text(title)}</h3>\n<div class="scroll"><table>\n<thead><tr>'
        f"{_head(headings, right)}</tr></thead>\n<tbody>\n{body}\n</tbody></table></div>\n</div>"
    )


def _head(headings: Sequence[str], right: set[int]) -> str:
    """Headings; an empty one is spanned by the one before."""
    cells, i = [], 0
    while i < len(headings):
        end = next((j for j in range(i + 1, len(headings)) if headings[j]), len(headings))
        span = f' colspan="{end - i}"' if end > i + 1 else ""
        scope = "colgroup" if span else "col"
        name = "number" if i in right and end == i + 1 else "span" if span else ""
        cells.append(_cell("th", headings[i], name, f'scope="{scope}"{span}'))
        i = end
    return "".join(cells)


def _forward(report: Report) -> str:
    statement = escape(contents()["trim_forward"]["statement"])
    return f"<p>In print: “{statement}”.</p>\n{_plain_table(*f.forward_table(report, 1))}"


# --- figures ----------------------------------------------------------------------------------------------------


def _figures(figures: Sequence[tuple[Drawing, str]]) -> str:
    return '<div class="figures">\n' + "\n".join(_figure(drawing, svg) for drawing, svg in figures) + "\n</div>"


def _figure(drawing: Drawing, svg: str) -> str:
    caption = f"<b>Figure {drawing.number}.</b> {_text(drawing.caption)}"
    kind = ' class="wide"' if drawing.is_wide else ""
    label = escape(f"Figure {drawing.number}. {drawing.caption}", quote=True)
    inline = inline_svg(svg, drawing.name, label)
    return f'<figure id="{drawing.name}"{kind}>\n{inline}\n<figcaption>{caption}</figcaption>\n</figure>'


def inline_svg(svg: str, name: str, label: str) -> str:
    """SVG file as an element of a page: without its prologue and metadata, and with names of its own.

    Parameters
    ----------
    svg : str
        As matplotlib writes it.
    name : str
        Goes before every id, as figures beside each other have ids alike.
    label : str
        What those hear who do not see it; escaped.
    """
    svg = svg[svg.index("<svg") :]
    svg = re.sub(r' (width|height)="[\d.]+pt"', "", svg, count=2)  # those of the page and of the view box count
    # a style element would act on the whole page; STYLE has what it says
    svg = re.sub(r"\s*<metadata>.*?</metadata>|\s*<style .*?</style>", "", svg, flags=re.DOTALL)
    svg = re.sub(r'\bid="', f'id="{name}-', svg)
    svg = re.sub(r'href="#', f'href="#{name}-', svg)
    svg = re.sub(r"url\(#", f"url(#{name}-", svg)
    return svg.replace("<svg ", f'<svg role="img" aria-label="{label}" ', 1).strip()


# --- circumstances ----------------------------------------------------------------------------------------------


def _circumstances(report: Report) -> str:
    given = report.conditions
    rows = [
        [
            f.SOURCES[name],
            own["name"],
            ", ".join(own["airfoil"]),
            f"{own['trim_residual']:.1e}",
            report.parameter_hashes[name],
        ]
        for name, own in given["aircraft"].items()
    ]
    headings = ["", "aircraft", "airfoil", "largest trim residual", "hash of its parameters"]
    fidelity = "; ".join(
        f"Table {table.removeprefix('table')}: lead-lag {_switch(own['lead_lag'])},"
        f" cyclic inflow {_switch(own['cyclic_inflow'])}"
        for table, own in given["fidelity"].items()
    )
    versions = ", ".join(f"{name} {version}" for name, version in report.versions.items())
    return (
        f"<p>Hover, averages over {given['azimuth_count']} azimuths. {fidelity}.</p>\n"
        + _plain_table("Aircraft", headings, rows, escape)  # names of files are not set like ours
        + f'\n<p class="meta">{escape(versions)}</p>'
    )


def _switch(is_on: bool) -> str:
    return "on" if is_on else "off"
