"""Trims, linear models and sweeps as HTML, which notebooks show in place of their text. All text is escaped."""

import math
from collections.abc import Iterable, Sequence
from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np

from sbs_sim.output.units import RPM, counted, label, shown
from sbs_sim.output.warnings_text import joined

if TYPE_CHECKING:
    from sbs_sim.analysis.linear_model import LinearModel
    from sbs_sim.analysis.sweep import Sweep, SweepPoint
    from sbs_sim.flight.trim_point import TrimPoint

MAX_ROWS = 100  # of a sweep: half of them from its beginning, half from its end
NUMBERS = "text-align:right;font-variant-numeric:tabular-nums"


def trim_html(point: "TrimPoint") -> str:
    """Attitude, controls and loads of a trim."""
    angles = [("pitch", point.pitch, "rad"), ("roll", point.roll, "rad")]
    angles += list(zip(point.control_names, point.controls.tolist(), point.control_units, strict=True))
    rows = [[label(name, unit), _fixed(shown(value, unit)[0], 4)] for name, value, unit in angles]
    for name, unit, values in (("thrust", "N", point.thrust), ("power", "W", point.power)):
        rows.append([f"{name} [{unit}]", " + ".join(_fixed(value, 2) for value in values)])
    return _paragraph(f"Trim: {_condition(point)}") + _table(["", ""], rows) + _warnings(point)


def model_html(model: "LinearModel") -> str:
    """Modes of a linear model."""
    rows = [
        [
            mode.name,
            _pole(mode.pole),
            _fixed(mode.frequency, 4),
            _fixed(mode.damping, 4),
            _seconds(mode.time_to_half),
            _seconds(mode.time_to_double),
        ]
        for mode in model.modes
    ]
    size = f"{len(model.state_names)} states, {len(model.control_names)} controls, {len(model.output_names)} outputs"
    heading = _paragraph(f"Linear model, {model.method}, {size}: {_condition(model.trim)}")
    columns = ["mode", "pole [rad/s]", "frequency [rad/s]", "damping", "half [s]", "double [s]"]
    return heading + _table(columns, rows) + _warnings(model.trim)


def sweep_html(found: "Sweep") -> str:
    """Trims and growing modes along a sweep."""
    values, unit = found.shown
    columns = [f"{found.parameter} [{unit}]" if unit else found.parameter, "pitch [deg]", "roll [deg]"]
    columns += [label(*control) for control in found.controls.items()]
    rotors = found["rotor_speed"].shape[1] if found.has_free_speeds else 0
    columns += [*(f"rotor {j + 1} [rpm]" for j in range(rotors)), "power [W]", "growing modes", ""]
    numbers = len(columns) - 3
    rows = [_sweep_row(value, point, numbers, rotors) for value, point in zip(values, found.points, strict=True)]
    if len(rows) > MAX_ROWS:
        half = MAX_ROWS // 2
        rows = [*rows[:half], [f"… {len(rows) - 2 * half} more …", *[""] * (len(columns) - 1)], *rows[-half:]]
    failed = f", {len(found.failed)} of them without a result" if found.failed else ""
    heading = _paragraph(f"Sweep of {found.parameter}: {counted(len(found.points), 'point')}{failed}")
    return heading + _table(columns, rows, (len(columns) - 2, len(columns) - 1))


def _sweep_row(value: float, point: "SweepPoint", numbers: int, rotors: int) -> list[str]:
    """Cells of a point, of which so many are numbers of the trim, with the speeds of so many rotors."""
    if point.trim is None:
        return [f"{value:.6g}", *["–"] * numbers, "", point.error or ""]
    controls = zip(point.trim.controls.tolist(), point.trim.control_units, strict=True)
    angles = [*np.degrees([point.trim.pitch, point.trim.roll]), *(shown(angle, unit)[0] for angle, unit in controls)]
    growing = [mode.name for mode in point.model.modes if mode.is_growing] if point.model else []
    remarks = [*([point.error] if point.error else []), *point.trim.beyond_limits, *joined(point.warnings)]
    speeds = point.trim.rotor_speed[:rotors] * RPM
    cells = [*(_fixed(angle, 3) for angle in angles), *(_fixed(speed, 1) for speed in speeds)]
    cells.append(_fixed(point.trim.power.sum(), 1))
    return [f"{value:.6g}", *cells, "; ".join(growing), "; ".join(remarks)]


def _condition(point: "TrimPoint") -> str:
    given = point.condition
    angles = f"sideslip {math.degrees(given.sideslip):g} deg, turn {math.degrees(given.turn_rate):g} deg/s"
    left_out = [
        name for name, there in (("lead-lag", point.lead_lag), ("cyclic inflow", point.cyclic_inflow)) if not there
    ]
    without = f"; without {', '.join(left_out)}" if left_out else ""
    return f"airspeed {given.airspeed:g} m/s, climb {given.climb_rate:g} m/s, {angles}{without}"


def _warnings(point: "TrimPoint") -> str:
    lines = [f"beyond its limits: {line}" for line in point.beyond_limits]
    lines += [f"outside the model's validity: {line}" for line in joined(point.warnings)]
    return "".join(map(_paragraph, lines))


def _pole(pole: complex) -> str:
    return f"{_fixed(pole.real, 5)}" + (f" ± {_fixed(abs(pole.imag), 5)} i" if pole.imag else "")


def _seconds(time: float) -> str:
    return f"{time:.4f}" if math.isfinite(time) else ""


def _fixed(value: Any, digits: int) -> str:
    return f"{round(float(value), digits) + 0.0:.{digits}f}"


def _paragraph(text: str) -> str:
    return f"<p>{escape(text)}</p>"


def _table(headings: Sequence[str], rows: Iterable[Sequence[str]], texts: Sequence[int] = (0,)) -> str:
    """A table with texts in some of its columns and numbers in the others."""
    head = "".join(f"<th>{escape(heading)}</th>" for heading in headings)
    body = "".join(f"<tr>{_cells(row, texts)}</tr>" for row in rows)
    return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"


def _cells(row: Sequence[str], texts: Sequence[int]) -> str:
    styles = ("text-align:left" if i in texts else NUMBERS for i in range(len(row)))
    return "".join(f'<td style="{style}">{escape(cell)}</td>' for style, cell in zip(styles, row, strict=True))
