"""The page of the recomputed results: one HTML file that holds all tables and figures and needs nothing else."""

import re
from collections.abc import Callable, Sequence
from html import escape
from pathlib import Path

from sbs_sim.analysis import reproduce_format as f
from sbs_sim.analysis.html import cell, document, plain_table, text_of
from sbs_sim.analysis.paper_tables import contents
from sbs_sim.analysis.plots import Drawing, drawings
from sbs_sim.analysis.reproduce import Comparison, Entry, Report
from sbs_sim.errors import ExportError
from sbs_sim.output.files import write

TITLE = "Recomputed results of the side-by-side helicopter"
PAGE = "index.html"


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
    written, shown = save_drawings(drawings(report), folder, progress)
    page = folder / PAGE
    write(page, page_text(report, shown))
    return [*written, page]


def save_drawings(
    drawings: Sequence[Drawing], folder: Path, progress: Callable[[int, int], None] | None = None
) -> tuple[list[Path], list[tuple[Drawing, str]]]:
    """Write figures as PNG and SVG into a folder that there is; the files, and each drawing with its SVG.

    Raises
    ------
    ExportError
        A file cannot be written.
    """
    written, shown = [], []
    for done, drawing in enumerate(drawings, 1):
        encoded = drawing.encoded()
        for kind, content in encoded.items():
            written.append(folder / f"{drawing.name}.{kind}")
            write(written[-1], content)
        shown.append((drawing, encoded["svg"].decode()))
        if progress is not None:
            progress(done, len(drawings))
    return written, shown


def inline_drawing(drawing: Drawing, svg: str) -> str:
    """SVG of a drawing as an element of a page, with its caption as what those hear who do not see it."""
    return inline_svg(svg, drawing.name, escape(drawing.caption, quote=True))


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
        ("facts", "What explains the differences", "\n".join(plain_table(*table) for table in f.fact_tables(report))),
        ("figures", "Figures", _figures(figures)),
        ("conditions", "Conditions and versions", _circumstances(report)),
    ]
    statement = (
        f"<p>The results that are printed in <cite>{escape(contents()['source'])}</cite>, beside those of this program:"
        " of its\ncomplete model, and of the assumptions under which the printed poles come out (the paper’s"
        " reading).</p>"
    )
    return document(TITLE, statement, sections)


def _remarks(report: Report) -> str:
    """Remarks; the names of aircraft in them come from files and are not set like our own words."""
    names = {own["name"] for own in report.conditions["aircraft"].values()}
    pattern = rf"(?<!\w)({'|'.join(re.escape(name) for name in names)})(?!\w)"
    items = [
        "".join(escape(part) if part in names else text_of(part) for part in re.split(pattern, text))
        for text in report.remarks
    ]
    return "<ul>" + "".join(f"<li>{item}</li>" for item in items) + "</ul>"


# --- tables -----------------------------------------------------------------------------------------------------


def _comparison(name: str, table: Comparison) -> str:
    """One table with everything that was computed for it, and its remarks."""
    numbers, others = f.notes(table), f.other_names(table)
    frequencies = any("frequency" in entry.columns for entry in table.entries())
    headings = ["", "paper", *(["frequency"] if frequencies else []), *f.HEADINGS[1:]]
    headings += [*(f.OTHERS[other] for other in others), "remark"]
    ends = {i for i, heading in enumerate(headings) if heading == "ratio"}
    head = "".join(
        cell("th", heading, "ratio" if i in ends else "", 'scope="col"') for i, heading in enumerate(headings)
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
    notes = "".join(f'<li id="{name}-{number}">{text_of(remark)}</li>' for remark, number in numbers.items())
    listed = f'<ol class="notes">{notes}</ol>' if notes else ""
    title = text_of(f.title(name, table))
    return (
        f'<div class="block">\n<h3 id="{name}">{title}</h3>\n<div class="scroll"><table>\n<thead><tr>{head}</tr>'
        "</thead>\n<tbody>\n" + "\n".join(rows) + f"\n</tbody></table></div>\n</div>\n{listed}"
    )


def _group_row(label: str, width: int) -> str:
    return f'<tr class="group"><th scope="rowgroup" colspan="{width}">{text_of(label)}</th></tr>'


def _printed_cells(label: str, entry: Entry, frequencies: bool) -> list[str]:
    """Name, what is printed, and the frequency that is printed beside a pole."""
    cells = [cell("th", label.strip(), "", 'scope="row"'), cell("td", entry.printed.text or "-")]
    if frequencies:
        cells.append(cell("td", entry.columns["frequency"].printed.text if "frequency" in entry.columns else ""))
    return cells


def _our_cells(entry: Entry, others: Sequence[str]) -> list[str]:
    """Ours with their ratios, and the further values."""
    cells = []
    for ours in (entry.complete, entry.paper_reading):
        off = " off" if entry.is_off(ours) else ""
        cells += [cell("td", f.value_text(ours), "ours"), cell("td", f.ratio_text(entry, ours), f"ratio{off}")]
    return cells + [cell("td", f.value_text(entry.others[other]) if other in entry.others else "") for other in others]


def _note(entry: Entry, numbers: dict[str, int], table: str) -> str:
    """Link to the remark."""
    number = numbers.get(entry.remark)
    return f'<a href="#{table}-{number}">{number}</a>' if number else ""


def _forward(report: Report) -> str:
    statement = escape(contents()["trim_forward"]["statement"])
    return f"<p>In print: “{statement}”.</p>\n{plain_table(*f.forward_table(report, 1))}"


# --- figures ----------------------------------------------------------------------------------------------------


def _figures(figures: Sequence[tuple[Drawing, str]]) -> str:
    return '<div class="figures">\n' + "\n".join(_figure(drawing, svg) for drawing, svg in figures) + "\n</div>"


def _figure(drawing: Drawing, svg: str) -> str:
    caption = f"<b>Figure {drawing.number}.</b> {text_of(drawing.caption)}"
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
        + plain_table("Aircraft", headings, rows, escape)  # names of files are not set like ours
        + f'\n<p class="meta">{escape(versions)}</p>'
    )


def _switch(is_on: bool) -> str:
    return "on" if is_on else "off"
