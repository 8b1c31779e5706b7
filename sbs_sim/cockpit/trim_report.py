"""What was answered, as HTML. Texts of files, messages and services are no markup: all of them are escaped here."""

import math
from dataclasses import dataclass
from html import escape

import numpy as np
from numpy.typing import NDArray

from sbs_sim.aircraft import Aircraft
from sbs_sim.cockpit.control_labels import axes_of, control_label
from sbs_sim.content import ByContent
from sbs_sim.flight.records import Snapshot
from sbs_sim.flight.trim_point import TrimCondition
from sbs_sim.model import state as S
from sbs_sim.model.frames import quaternion_to_euler

Array = NDArray[np.float64]

STEADY_ANGLE, STEADY_RATE = math.radians(2.0), math.radians(2.0)  # departures that the eye would not call unsteady
FAINT, WARNING = "color:#5c6670", "color:#D55E00"


@dataclass(frozen=True, eq=False)
class TrimResult(ByContent):
    """A trim that a service has found.

    Attributes
    ----------
    condition : TrimCondition
    controls : ndarray, shape (4,)
        Of the axes heave, roll, pitch and yaw [rad].
    pitch, roll : float
        [rad]
    thrust : float
        Sum of all rotors [N].
    power : float
        Sum of all rotors [W].
    notes : tuple of str
        What is beyond its limits, and where the model does not hold.
    """

    condition: TrimCondition
    controls: Array
    pitch: float
    roll: float
    thrust: float
    power: float
    notes: tuple[str, ...]


def line(text: str, style: str = "") -> str:
    """A text as a paragraph."""
    return f'<div style="font:12px sans-serif;padding:4px 10px;{style}">{escape(text)}</div>' if text else ""


def condition_words(condition: TrimCondition) -> str:
    """A condition in short: "10 m/s, climb 1 m/s"."""
    parts = [f"{condition.airspeed + 0.0:g} m/s"]
    for value, unit, name in (
        (condition.climb_rate, "m/s", "climb"),
        (math.degrees(condition.sideslip), "deg", "sideslip"),
        (math.degrees(condition.turn_rate), "deg/s", "turn"),
    ):
        if value:
            parts.append(f"{name} {value:.3g} {unit}")
    return ", ".join(parts)


def trim_page(trimmed: TrimResult, snapshot: Snapshot, aircraft: Aircraft) -> str:
    """A trim beside the flight as it is, and whether the flight is in it."""
    _, pitch, roll = quaternion_to_euler(snapshot.state[S.ATTITUDE : S.VELOCITY])
    axes = axes_of(aircraft)
    names = [control_label(aircraft.controls[i].name).lower() for i in axes]
    rows = [
        *zip(names, trimmed.controls[: len(axes)], aircraft.unmix(snapshot.swashplate)[axes], strict=True),
        ("pitch", trimmed.pitch, pitch),
        ("roll", trimmed.roll, roll),
    ]
    cells = "".join(_row(name, _degrees(ours), _degrees(now), "deg") for name, ours, now in rows)
    cells += _row("thrust", f"{trimmed.thrust:.1f}", "", "N") + _row("power", f"{trimmed.power:.0f}", "", "W")
    head = f'<tr style="{FAINT}"><td></td>{_cell("trim")}{_cell("now")}<td></td></tr>'
    title = f"<b>Trim at {escape(condition_words(trimmed.condition))}</b>"
    return (
        f'<div style="font:12px sans-serif;padding:4px 10px">{title}'
        f'<table style="border-collapse:collapse;font-variant-numeric:tabular-nums">{head}{cells}</table></div>'
        + "".join(line(text, WARNING) for text in (*unsteady(trimmed, snapshot), *trimmed.notes))
    )


def model_page(trimmed: TrimResult, snapshot: Snapshot) -> str:
    """What was linearized, and whether the flight is there."""
    return line(f"Linear model at {condition_words(trimmed.condition)}: see Modes") + "".join(
        line(text, WARNING) for text in (*unsteady(trimmed, snapshot), *trimmed.notes)
    )


def unsteady(trimmed: TrimResult, snapshot: Snapshot) -> list[str]:
    """In what a flight is not in its trim, one line or none: airspeed, climb, sideslip and turn are alike."""
    _, pitch, roll = quaternion_to_euler(snapshot.state[S.ATTITUDE : S.VELOCITY])
    turn = trimmed.condition.turn_rate  # of the heading; Stevens and Lewis, eq. (1.4-4)
    rates = turn * np.array(
        [
            -math.sin(trimmed.pitch),
            math.cos(trimmed.pitch) * math.sin(trimmed.roll),
            math.cos(trimmed.pitch) * math.cos(trimmed.roll),
        ]
    )
    apart = [
        f"{name} {_degrees(now, 1)} deg instead of {_degrees(steady, 1)}"
        for name, now, steady in (("pitch", pitch, trimmed.pitch), ("roll", roll, trimmed.roll))
        if not abs(math.remainder(now - steady, 2 * math.pi)) <= STEADY_ANGLE
    ]
    apart += [
        f"{name} {_degrees(now, 1)} deg/s instead of {_degrees(steady, 1)}"
        for name, now, steady in zip("pqr", snapshot.state[S.RATES : S.RATES + 3], rates, strict=True)
        if not abs(now - steady) <= STEADY_RATE
    ]
    return [f"The flight is not in this trim: {', '.join(apart)}."] if apart else []


def _degrees(value: float, digits: int = 2) -> str:
    """An angle in degrees, without a minus before zeros."""
    return f"{round(math.degrees(value), digits) + 0.0:.{digits}f}"


def _row(name: str, trim: str, now: str, unit: str) -> str:
    cells = f'{_cell(trim)}{_cell(now)}<td style="{FAINT};padding-left:4px">{unit}</td>'
    return f'<tr><td style="{FAINT}">{name}</td>{cells}</tr>'


def _cell(text: str) -> str:
    return f'<td style="text-align:right;padding-left:12px">{text}</td>'
