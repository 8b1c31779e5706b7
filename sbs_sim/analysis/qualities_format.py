"""How flying qualities are written: on the terminal and as HTML."""

import math
from collections.abc import Sequence
from html import escape

from sbs_sim.analysis.html import document, plain_table, text_of
from sbs_sim.analysis.plots import Drawing
from sbs_sim.analysis.qualities import Qualities, Quality
from sbs_sim.analysis.quality_limits import CURVE, OSCILLATION, RANGE, Limit, Scale, limits

MARK = "*"  # of a boundary that was not read in the standard
SMALLEST = 0.001  # that is written
WORSE = {4: ">3"}


def number(value: float) -> str:
    """Number with a few digits; a dash for none."""
    if math.isnan(value):
        return "-"
    if math.isinf(value):
        return "inf"
    return "<0.001" if 0.0 < abs(value) < SMALLEST else f"{value:.3g}"


def headings(report: Qualities) -> list[str]:
    """Of the table of a scale."""
    return ["", "unit", "level 1", "level 2", *(f"{point.airspeed:g} m/s" for point in report.points)]


def table(report: Qualities, scale: int) -> list[list[str]]:
    """Rows of the table of a scale under `headings`: values with their levels in brackets."""
    rows = []
    for row in report.rows(scale).values():
        one = next(quality for quality in row if quality is not None)
        unit = "" if one.unit == "1" else one.unit
        rows.append([one.title, unit, *_limits(row, report.scales[scale]), *(_cell(quality) for quality in row)])
    return rows


def both_headings(report: Qualities) -> list[str]:
    """Of the table of two reports beside each other."""
    return ["", "unit", "level 1", "level 2", "flown", *headings(report)[4:]]


def both_table(bare: Qualities, controlled: Qualities, scale: int) -> list[list[str]]:
    """Rows under `both_headings`: each quality of the bare aircraft, and below it of the controlled one."""
    known = {who: report.rows(scale) for who, report in (("bare", bare), ("controlled", controlled))}
    written = {
        who: dict(zip(known[who], table(report, scale), strict=True))
        for who, report in (("bare", bare), ("controlled", controlled))
    }
    rows = []
    for name in dict.fromkeys([*known["bare"], *known["controlled"]]):
        for who, own in written.items():
            if name in own:
                title, unit, first, second, *cells = own[name]
                rows.append([title, unit, first, second, who, *cells])
    return rows


def _cell(quality: Quality | None) -> str:
    if quality is None:
        return ""
    value = number(quality.value)
    return f"{value} ({WORSE.get(quality.level, quality.level)})" if quality.level else value


def _limits(row: Sequence[Quality | None], scale: Scale) -> list[str]:
    """What levels 1 and 2 ask for, of this size; of several flights in their order."""
    names = dict.fromkeys(quality.limit for quality in row if quality is not None and quality.limit)
    found = [limits().by_name[name] for name in names]
    power = next(quality.scaled_by for quality in row if quality is not None)
    if not found:
        return ["", ""]
    mark = "" if all(limit.is_read for limit in found) else MARK
    texts = [dict.fromkeys(_limit(limit, level, power, scale) for limit in found) for level in (0, 1)]
    return [" / ".join(text) + mark for text in texts]


def _limit(limit: Limit, level: int, power: int, scale: Scale) -> str:
    """What a level asks for; of modes the name of the boundary, which has several parts."""
    factor = scale.speed_up**power
    if level >= len(limit.levels):
        return "not limited"
    if limit.kind == CURVE:
        ends = [f"{number(limit.least_at(level + 1, angle) * factor)} at {angle:g}" for angle in limit.angles]
        return f">= {' to '.join(ends)} deg"
    if limit.kind == RANGE:
        asked = [
            f"{'>=' if name == 'least' else '<='} {number(value * factor)}"
            for name, value in limit.levels[level].items()
            if math.isfinite(value)
        ]
        return ", ".join(asked) or "any"
    if limit.kind == OSCILLATION:
        return "see below"
    time = limit.levels[level]
    return "no growth" if math.isinf(time) else f"double >= {number(time * factor)}"


def remarks(report: Qualities) -> list[str]:
    """What has to be known of the values, each once with the airspeeds it belongs to."""
    found: dict[str, list[str]] = {}
    for point in report.points:
        if point.error is not None:
            found.setdefault(f"no linear model: {point.error}", []).append(f"{point.airspeed:g}")
        for quality in point.judged[0]:
            if quality.remark:
                found.setdefault(f"{quality.title}: {quality.remark}", []).append(f"{point.airspeed:g}")
    return [f"{text} (at {', '.join(speeds)} m/s)" for text, speeds in sorted(found.items())]


def boundaries(report: Qualities) -> list[str]:
    """Where the boundaries that were used come from."""
    used = dict.fromkeys(quality.limit for point in report.points for judged in point.judged for quality in judged)
    lines = []
    for name in used:
        if name:
            limit = limits().by_name[name]
            origin = "from memory of" if limit.is_remembered else "after"
            words = [limit.paragraph, *([_oscillation(limit)] if limit.kind == OSCILLATION else [])]
            read = "read in the standard" if limit.is_read else f"not read in the standard; {origin} {limit.source}"
            agreed = [f"agrees with {limit.checked}"] if limit.checked else []
            lines.append("; ".join([*words, read, *agreed, *([limit.remark] if limit.remark else [])]))
    return lines


def _oscillation(limit: Limit) -> str:
    """Bands of each level in words, at full size."""
    texts = []
    for level, bands in enumerate(limit.levels, 1):
        parts = []
        for band in bands:
            asked = [f"{key.replace('_', ' ')} >= {value:g}" for key, value in band.items() if key != "up_to"]
            where = f"to {band['up_to']:g} rad/s " if "up_to" in band else "beyond "
            parts.append(where + (" and ".join(asked) or "not allowed"))
        texts.append(f"level {level}: {', '.join(parts)}")
    return "; ".join(texts) + " (full size; time to double in s, decay in rad/s)"


def statement(report: Qualities) -> str:
    """What was judged, and after what."""
    late = f", behind {report.delay:g} s of delay" if report.delay else ""
    if report.actuator is not None:
        late += (
            f", by actuators of {report.actuator.frequency:g} rad/s with a damping ratio of {report.actuator.damping:g}"
        )
    flown = "its controls without a controller" if not report.law else f"{report.law}"
    return (
        f"Flying qualities of {report.aircraft}, flown by {flown}{late}. Levels in brackets"
        f" after {limits().standard}; boundaries with {MARK} were not read in the standard itself."
    )


def page_text(report: Qualities, figures: Sequence[tuple[Drawing, str]]) -> str:
    """The page; figures with their inline SVG."""
    sections = [
        (f"scale{i}", f"By {scale.name}", plain_table(scale.text, headings(report), table(report, i), escape_text))
        for i, scale in enumerate(report.scales)
    ]
    drawn = "\n".join(_figure(drawing, svg) for drawing, svg in figures)
    sections += [
        ("remarks", "Remarks", _list(remarks(report))),
        ("figures", "Figures", f'<div class="figures">\n{drawn}\n</div>'),
        ("boundaries", "Boundaries", _list(boundaries(report))),
    ]
    opening = f'<p>{escape(statement(report))}</p>\n<p class="meta">parameters {escape(report.parameter_hash)}</p>'
    return document(f"Flying qualities of {report.aircraft}", opening, sections)


def escape_text(text: str) -> str:
    """Escaped, with signs as they are set."""
    return text_of(text).replace("&gt;=", "≥").replace("&lt;=", "≤")


def _list(lines: Sequence[str]) -> str:
    return "<ul>" + "".join(f"<li>{escape(line)}</li>" for line in lines) + "</ul>"


def _figure(drawing: Drawing, svg: str) -> str:
    caption = f"<b>Figure {drawing.number}.</b> {escape(drawing.caption)}"
    kind = ' class="wide"' if drawing.is_wide else ""
    return f'<figure id="{drawing.name}"{kind}>\n{svg}\n<figcaption>{caption}</figcaption>\n</figure>'
