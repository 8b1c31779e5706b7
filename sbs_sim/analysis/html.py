"""What every page of results is made of: one HTML file that holds all and needs nothing else."""

import re
from collections.abc import Callable, Sequence
from html import escape

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


def document(title: str, statement: str, sections: Sequence[tuple[str, str, str]]) -> str:
    """A page.

    Parameters
    ----------
    title : str
        Plain text.
    statement : str
        What it shows, HTML.
    sections : sequence of (str, str, str)
        Key, heading as plain text, content as HTML.
    """
    links = "".join(f'<li><a href="#{key}">{escape(heading)}</a></li>' for key, heading, _ in sections)
    body = "\n".join(
        f'<section id="{key}">\n<h2>{escape(heading)}</h2>\n{content}\n</section>' for key, heading, content in sections
    )
    return f"""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8"/>
<meta name="viewport" content="width=device-width, initial-scale=1"/>
<title>{escape(title)}</title>
<style>{STYLE}</style>
</head>
<body>
<header>
<h1>{escape(title)}</h1>
{statement}
</header>
<nav aria-label="Contents"><ul>{links}</ul></nav>
<main>
{body}
</main>
</body>
</html>
"""


def text_of(text: str) -> str:
    """Escaped; with minus signs, apostrophes, and indices and powers where they belong."""
    if text == "-":
        return "–"
    text = escape(text, quote=False)
    text = re.sub(r"(?<![\w)])-(?=\S)|(?<= )-(?= )", "−", text)
    text = re.sub(r"(?<=[a-z])'(?=s\b)", "’", text)
    text = re.sub(r"(?<=[\w'])_(\w)(?!\w)", r"<sub>\1</sub>", text)
    return re.sub(r"\^(\w)", r"<sup>\1</sup>", text)


def cell(tag: str, text: str, name: str = "", more: str = "", to_html: Callable[[str], str] = text_of) -> str:
    """Cell of a table, of a class and with more attributes."""
    attributes = (f' class="{name}"' if name else "") + (f" {more}" if more else "")
    return f"<{tag}{attributes}>{to_html(text)}</{tag}>"


def plain_table(
    title: str, headings: Sequence[str], rows: Sequence[Sequence[str]], to_html: Callable[[str], str] = text_of
) -> str:
    """Table of texts; columns of numbers are aligned to the right."""
    right = {i for i, value in enumerate(rows[-1]) if re.fullmatch(r"-?[\d.]+\*?", value)}
    body = "\n".join(
        "<tr>"
        + "".join(cell("td", value, "number" if i in right else "", "", to_html) for i, value in enumerate(row))
        + "</tr>"
        for row in rows
    )
    heading = f"<h3>{text_of(title)}</h3>\n" if title else ""
    return (
        f'<div class="block">\n{heading}<div class="scroll"><table>\n<thead><tr>'
        f"{head_row(headings, right)}</tr></thead>\n<tbody>\n{body}\n</tbody></table></div>\n</div>"
    )


def head_row(headings: Sequence[str], right: set[int]) -> str:
    """Headings; an empty one is spanned by the one before."""
    cells, i = [], 0
    while i < len(headings):
        end = next((j for j in range(i + 1, len(headings)) if headings[j]), len(headings))
        span = f' colspan="{end - i}"' if end > i + 1 else ""
        scope = "colgroup" if span else "col"
        name = "number" if i in right and end == i + 1 else "span" if span else ""
        cells.append(cell("th", headings[i], name, f'scope="{scope}"{span}'))
        i = end
    return "".join(cells)
