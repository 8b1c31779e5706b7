"""Numbers and the artificial horizon at the top of the page, as HTML."""

import math
from dataclasses import dataclass
from html import escape
from pathlib import Path

import numpy as np

from sbs_sim.aircraft import Aircraft
from sbs_sim.flight.records import Snapshot
from sbs_sim.flight.trim_point import TrimCondition
from sbs_sim.model import records as R
from sbs_sim.model import state as S
from sbs_sim.model.frames import quaternion_to_euler, rotation_matrix
from sbs_sim.output.warnings_text import joined

SKY, EARTH, MARK = "#8fbbe0", "#b59a78", "#20262c"
PIXELS_PER_DEGREE = 2.0
MANY = 1e4  # N or W
SLOW = 0.5  # m/s: below, the track says nothing
FLOW_DIGITS, ANGLE_DIGITS = 2, 3  # m/s and rad: what a condition "here" is rounded to


@dataclass(frozen=True)
class Status:
    """How the flight itself is doing.

    Attributes
    ----------
    playing : bool
    real_time_factor : float
        As achieved.
    missed_deadlines : int
    fault : str
    log : str
        Path; empty if nothing is recorded.
    log_state : str
        What is wrong with the recording; empty if nothing is.
    warnings : tuple of str
        Where the model does not hold.
    model : str
        Which model flies if it is not the full one; empty if it is, or not known.
    """

    playing: bool = False
    real_time_factor: float = 0.0
    missed_deadlines: int = 0
    fault: str = ""
    log: str = ""
    log_state: str = ""
    warnings: tuple[str, ...] = ()
    model: str = ""


def condition_here(snapshot: Snapshot) -> TrimCondition:
    """Steady flight that comes nearest to an instant: flow and turn as they are, rounded to what matters.

    Backwards flight has a negative airspeed, so that the sideslip stays within a right angle.
    """
    attitude = snapshot.state[S.ATTITUDE : S.VELOCITY]
    north, east, down = rotation_matrix(attitude) @ snapshot.state[S.VELOCITY : S.RATES] - snapshot.wind
    heading, pitch, roll = quaternion_to_euler(attitude)
    forward = north * math.cos(heading) + east * math.sin(heading)
    right = east * math.cos(heading) - north * math.sin(heading)
    airspeed = math.copysign(math.hypot(forward, right), forward)
    sideslip = math.atan2(right, abs(forward)) * math.copysign(1.0, forward) if abs(airspeed) > SLOW else 0.0
    _, q, r = snapshot.state[S.RATES : S.RATES + 3]
    turn = (q * math.sin(roll) + r * math.cos(roll)) / math.cos(pitch)  # Stevens and Lewis, eq. (1.4-4)
    return TrimCondition(
        round(airspeed if abs(airspeed) > SLOW else forward, FLOW_DIGITS) + 0.0,  # without a minus before a zero
        round(float(-down), FLOW_DIGITS) + 0.0,
        round(sideslip, ANGLE_DIGITS) + 0.0,
        round(turn, ANGLE_DIGITS) + 0.0,
    )


def readout(aircraft: Aircraft, snapshot: Snapshot, status: Status, source: str) -> str:
    """Horizon and numbers of an instant."""
    state = snapshot.state
    to_earth = rotation_matrix(state[S.ATTITUDE : S.VELOCITY])
    ground = to_earth @ state[S.VELOCITY : S.RATES]
    yaw, pitch, roll = quaternion_to_euler(state[S.ATTITUDE : S.VELOCITY])
    speeds = aircraft.rotor_speeds(state).tolist()
    power = sum(float(load[R.TORQUE]) * speed for load, speed in zip(snapshot.loads, speeds, strict=True))
    rows = (
        ("time", f"{snapshot.time:.2f}", "s"),
        ("airspeed", f"{np.linalg.norm(ground - snapshot.wind):.2f}", "m/s"),
        ("ground speed", f"{math.hypot(ground[0], ground[1]):.2f}", "m/s"),
        ("climb", _fixed(-ground[2]), "m/s"),
        ("height", _fixed(-state[S.POSITION + 2]), "m"),
        ("heading", f"{round(math.degrees(yaw), 1) % 360:.1f}", "deg"),
        ("thrust", *_scaled(float(snapshot.loads[:, R.THRUST].sum()), "N", 1)),
        ("power", *_scaled(power, "W", 0)),
    )
    cells = "".join(
        f'<tr style="white-space:nowrap"><td style="color:#5c6670">{name}</td>'
        f'<td style="text-align:right;padding-left:8px">{value}</td>'
        f'<td style="padding-left:4px;color:#5c6670">{unit}</td></tr>'
        for name, value, unit in rows
    )
    return (
        '<div style="font:12px sans-serif;padding:6px 10px 10px 10px;font-variant-numeric:tabular-nums">'
        f'<div style="display:flex;gap:12px;align-items:center">{_horizon(pitch, roll)}'
        f'<table style="border-collapse:collapse;line-height:1.28">{cells}</table></div>'
        f"{_state_line(status, source)}</div>"
    )


def source_line(log: str, flying: bool) -> str:
    """What the page shows: a live flight, a log of a name, or nothing; and whether a simulator is there.

    Parameters
    ----------
    log : str
        Name of the log that is shown; empty for none.
    flying : bool
        A simulator is there.
    """
    word, colour, more = ("LIVE", "#009E73", "") if flying else ("NO SIMULATOR", "#D55E00", "")
    if log:
        word, colour, more = "LOG", "#0072B2", f"{log}, {'a live flight continues' if flying else 'no simulator'}"
    mark = f"color:white;background:{colour};padding:1px 6px;border-radius:3px"
    return (
        '<div style="font:12px sans-serif;padding:6px 10px 0 10px">'
        f'<b style="{mark}">{word}</b> <span style="color:#5c6670">{escape(more)}</span></div>'
    )


def _fixed(value: float) -> str:
    """Number with two decimals, without a minus before zeros."""
    return f"{round(float(value), 2) + 0.0:.2f}"


def _scaled(value: float, unit: str, digits: int) -> tuple[str, str]:
    """Number and unit, in thousands where there are many."""
    return (f"{value:.{digits}f}", unit) if abs(value) < MANY else (f"{value / 1000.0:.1f}", f"k{unit}")


def _horizon(pitch: float, roll: float) -> str:
    """Artificial horizon: sky, earth, a ladder of 10 deg of pitch, the aircraft's wings."""
    down = max(-90.0, min(90.0, math.degrees(pitch))) * PIXELS_PER_DEGREE
    ladder = "".join(
        f'<line x1="{-length}" x2="{length}" y1="{-step * PIXELS_PER_DEGREE}" y2="{-step * PIXELS_PER_DEGREE}"'
        ' stroke="white" stroke-width="1"/>'
        for step in range(-80, 81, 10)
        if step and (length := 14 if step % 20 == 0 else 9)
    )
    ticks = "".join(
        f'<line x1="0" x2="0" y1="-56" y2="-50" stroke="{MARK}" stroke-width="1" transform="rotate({angle})"/>'
        for angle in (-60, -30, 0, 30, 60)
    )
    return (
        '<svg width="116" height="116" viewBox="-58 -58 116 116" role="img" aria-label="artificial horizon">'
        '<clipPath id="dial"><circle r="50"/></clipPath><g clip-path="url(#dial)">'
        f'<g transform="rotate({-math.degrees(roll):.2f}) translate(0 {down:.2f})">'
        f'<rect x="-100" y="-300" width="200" height="300" fill="{SKY}"/>'
        f'<rect x="-100" y="0" width="200" height="300" fill="{EARTH}"/>'
        f'<line x1="-100" x2="100" y1="0" y2="0" stroke="white" stroke-width="1.5"/>{ladder}</g></g>'
        f'<circle r="50" fill="none" stroke="{MARK}" stroke-width="1"/>{ticks}'
        f'<path d="M-32 0H-12L0 8L12 0H32" fill="none" stroke="{MARK}" stroke-width="2.5"/>'
        f'<path d="M0 -50l-4 8h8z" fill="{MARK}" transform="rotate({-math.degrees(roll):.2f})"/></svg>'
    )


def _state_line(status: Status, source: str) -> str:
    """What flies, how fast, where it is recorded, and what is wrong."""
    doing = f"playing, {status.real_time_factor:.2f} × real time" if status.playing else "paused"
    late = f" · missed deadlines {status.missed_deadlines}" if status.missed_deadlines else ""
    model = f" ({escape(status.model)} model)" if status.model else ""
    lines = [f"<b>{escape(source)}</b>{model} {doing}{late}"]
    if status.log:
        lines.append(f'<span style="color:#5c6670">recording {escape(Path(status.log).name)}</span>')
    outside = (f"outside the model's validity: {text}" for text in joined(status.warnings))
    problems = (status.fault, status.log_state, *outside)
    lines += [f'<span style="color:#D55E00">{escape(text)}</span>' for text in problems if text]
    return f'<div style="margin-top:4px;line-height:1.4">{"<br>".join(lines)}</div>'
