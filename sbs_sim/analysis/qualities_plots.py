"""Plots and page of flying qualities. No window and no global state of matplotlib is used."""

import math
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sbs_sim.analysis.linear_loop import LinearLoop
from sbs_sim.analysis.linear_model import LinearModel
from sbs_sim.analysis.page import PAGE, inline_drawing, make_folder, save_drawings
from sbs_sim.analysis.plots import GRID, INK, Drawing
from sbs_sim.analysis.qualities import (
    ATTITUDES,
    FASTEST_POLE,
    HEAVE_TIME,
    Qualities,
    attitude_transfer,
    control_of,
    loop_modes,
)
from sbs_sim.analysis.qualities_format import page_text
from sbs_sim.analysis.quality_limits import FORWARD, LOW_SPEED, Limit, Scale, limits
from sbs_sim.analysis.step_response import output_row, step_response, times
from sbs_sim.output.files import write
from sbs_sim.output.json_text import to_json
from sbs_sim.output.plot_style import COLOURS, DASHES

WIDE = 10.0  # inches
LEVEL_DASHES = ("-", "--", ":")
REJECTED = -3.0  # dB
BODE = (0.1, 100.0)  # rad/s at full size
JSON = "qualities.json"


def save_qualities(
    report: Qualities, folder: str | Path, *, progress: Callable[[int, int], None] | None = None
) -> list[Path]:
    """Write all figures as PNG and SVG, all numbers as JSON, and the page, which is the last of the paths.

    Raises
    ------
    ExportError
        Folder or files cannot be written.
    """
    folder = make_folder(folder)
    written, drawn = save_drawings(drawings(report), folder, progress)
    shown = [(drawing, inline_drawing(drawing, svg)) for drawing, svg in drawn]
    written += [folder / JSON, folder / PAGE]
    write(written[-2], to_json(report.to_dict()))
    write(written[-1], page_text(report, shown))
    return written


def drawings(report: Qualities) -> list[Drawing]:
    """All figures."""
    captions: list[tuple[str, Callable[[Qualities], Figure]]] = [
        ("Bandwidth and phase delay with the boundaries at each scale", bandwidth_figure),
        ("Modes of the body with the boundaries of oscillations at each scale, seen at full size", modes_figure),
        ("Climb rate after a step of collective, and its fit by a lag of the first order", heave_figure),
        ("Attitude about the other axis over that about the axis of the control", coupling_figure),
        ("Bode plots of the attitudes by their controls", bode_figure),
        ("Nichols plots of the attitudes by their controls, with the phase of the bandwidth", nichols_figure),
        ("Quickness of moderate changes of the attitudes with the boundaries at each scale", quickness_figure),
    ]
    if any(point.loop is not None for point in report.points):
        captions.append(("What is measured over a disturbance that is added to it", rejection_figure))
    return [Drawing(number, caption, True, partial(draw, report)) for number, (caption, draw) in enumerate(captions, 1)]


def _figure(width: float, height: float) -> Figure:
    return Figure(figsize=(width, height), layout="constrained")


def _grid(axes: Axes) -> None:
    axes.grid(True, color=GRID, linewidth=0.6)
    axes.set_axisbelow(True)


def _boundary(axes: Axes, limit: Limit | None, power: int, scale: Scale, i: int, *, across: bool) -> None:
    """Lines of the levels of a range, of this size."""
    for level, asked in enumerate(limit.levels if limit else (), 1):
        for value in asked.values():
            if math.isfinite(value):
                line = axes.axhline if across else axes.axvline
                text = f"level {level}, {scale.name}"
                line(value * scale.speed_up**power, color=COLOURS[3 + i], linestyle=LEVEL_DASHES[level - 1], label=text)


def bandwidth_figure(report: Qualities) -> Figure:
    """Phase delay over bandwidth, an axes for each attitude."""
    figure = _figure(WIDE, 3.6)
    for axes, axis in zip(figure.subplots(1, 3), ATTITUDES, strict=True):
        own = [(point.airspeed, point.bandwidths[axis]) for point in report.points if axis in point.bandwidths]
        there = [(speed, found) for speed, found in own if not math.isnan(found.bandwidth)]
        axes.plot(
            [found.bandwidth for _, found in there],
            [0.0 if math.isnan(found.phase_delay) else found.phase_delay for _, found in there],
            color=COLOURS[0],
            marker="o",
            linestyle="none",
        )
        for speed, found in there:
            late = 0.0 if math.isnan(found.phase_delay) else found.phase_delay
            axes.annotate(f"{speed:g}", (found.bandwidth, late), xytext=(4, 4), textcoords="offset points")
        for i, scale in enumerate(report.scales):
            for flight in dict.fromkeys(limits().flight(point.airspeed, scale) for point in report.points):
                _boundary(axes, limits().find(f"{axis}_bandwidth", flight), 1, scale, i, across=False)
        without = [f"{speed:g}" for speed, found in own if math.isnan(found.bandwidth)]
        if without:
            axes.set_title(f"{axis}; none at {', '.join(without)} m/s")
        else:
            axes.set_title(axis if own else f"{axis}: no control moves it")
        axes.set_xlabel("bandwidth [rad/s]")
        axes.set_ylabel("phase delay [s]")
        axes.set_xlim(left=0.0)
        delays = [found.phase_delay for _, found in there if not math.isnan(found.phase_delay)]
        axes.set_ylim(min(0.0, *delays, 0.0), max(1.4 * max(delays, default=0.0), 0.02))
        _legend(axes)
        _grid(axes)
    return figure


def _legend(axes: Axes) -> None:
    """Each label once."""
    handles, labels = axes.get_legend_handles_labels()
    once = dict(zip(labels, handles, strict=True))
    if once:
        axes.legend(once.values(), once.keys(), fontsize=7)


def quickness_figure(report: Qualities) -> Figure:
    """Quickness over the change of each attitude."""
    figure = _figure(WIDE, 3.6)
    for axes, axis in zip(figure.subplots(1, 3), ATTITUDES, strict=True):
        widest = 0.0
        for i, scale in enumerate(report.scales):
            flights = dict.fromkeys(limits().flight(point.airspeed, scale) for point in report.points)
            limit = next((found for flight in flights if (found := limits().find(f"{axis}_quickness", flight))), None)
            for level, points in enumerate(() if limit is None else limit.levels, 1):
                angles, values = np.array(points).T
                label, widest = f"level {level}, {scale.name}", max(widest, angles[-1])
                axes.plot(
                    angles,
                    values * scale.speed_up,
                    color=COLOURS[3 + i],
                    linestyle=LEVEL_DASHES[level - 1],
                    label=label,
                )
        for i, point in enumerate(report.points):
            own = point.quickness.get(axis)
            if own is not None and len(own.values):
                label = f"{point.airspeed:g} m/s"
                axes.plot(np.degrees(own.changes), own.values, color=COLOURS[i % 3], marker=".", label=label)
        axes.set_title(axis)
        axes.set_xlabel("smallest change [deg]")
        axes.set_ylabel("quickness [1/s]")
        axes.set_xlim(0.0, 1.1 * widest or None)
        axes.set_ylim(bottom=0.0)
        _legend(axes)
        _grid(axes)
    return figure


def rejection_figure(report: Qualities) -> Figure:
    """Gain from a disturbance to the disturbed measurement, an axes for each attitude."""
    figure = _figure(WIDE, 3.6)
    low, high = (frequency * report.scales[0].speed_up for frequency in BODE)
    frequencies = np.geomspace(0.1 * low, high, 240)
    for axes, (axis, attitude) in zip(figure.subplots(1, 3), ATTITUDES.items(), strict=True):
        measured = "heading" if axis == "yaw" else attitude
        for i, point in enumerate(report.points):
            if point.loop is not None and measured in point.loop.measured:
                gain = 20.0 * np.log10(np.abs(point.loop.sensitivity(measured, frequencies)))
                axes.semilogx(frequencies, gain, color=COLOURS[i % len(COLOURS)], label=f"{point.airspeed:g} m/s")
        axes.axhline(REJECTED, color=INK, linewidth=0.8, linestyle=":")
        axes.set_title(axis)
        axes.set_xlabel("frequency [rad/s]")
        axes.set_ylabel("gain [dB]")
        _legend(axes)
        _grid(axes)
    return figure


def modes_figure(report: Qualities) -> Figure:
    """Poles of the body at full size, an axes for each scale."""
    figure = _figure(WIDE, 4.5)
    panels = np.atleast_1d(figure.subplots(1, len(report.scales)))
    for axes, scale in zip(panels, report.scales, strict=True):
        for i, point in enumerate(report.points):
            if point.seen is None:
                continue
            poles = np.array(_poles(point.seen, scale)) / scale.speed_up
            colour = COLOURS[i % len(COLOURS)]
            axes.plot(poles.real, poles.imag, "o", color=colour, label=f"{point.airspeed:g} m/s", markersize=4)
        top = max(1.5, 1.05 * max(axes.get_ylim()[1], 0.0))
        _oscillation_boundaries(axes, top, scale, report)
        axes.axvline(0.0, color=INK, linewidth=0.8)
        axes.set_xlim(max(-4.0, axes.get_xlim()[0]), axes.get_xlim()[1])
        axes.set_ylim(-0.05, top)
        axes.set_xlabel("real part at full size [rad/s]")
        axes.set_ylabel("imaginary part at full size [rad/s]")
        axes.set_title(f"by {scale.name}")
        _legend(axes)
        _grid(axes)
    return figure


def _oscillation_boundaries(axes: Axes, top: float, scale: Scale, report: Qualities) -> None:
    """Curves on which a level of the oscillations ends."""
    frequencies = np.linspace(1e-3, 1.5 * top, 800)
    flights = {limits().flight(point.airspeed, scale) for point in report.points}
    shown = [("oscillation", COLOURS[3], LOW_SPEED), ("lateral_oscillation", COLOURS[5], FORWARD)]
    for name, colour, flight in shown:
        limit = limits().by_name[name]
        if flight == FORWARD and FORWARD not in flights:
            continue
        for level in range(1, len(limit.levels) + 1):
            growth = np.array([limit.most_growth(level, frequency) for frequency in frequencies])
            inside = np.isfinite(growth) & (np.abs(growth) <= frequencies)
            imaginary = np.sqrt(np.maximum(frequencies**2 - np.where(inside, growth, 0.0) ** 2, 0.0))
            text = f"level {level}, {name.replace('_', ' ')}"
            x, y = np.where(inside, growth, np.nan), np.where(inside, imaginary, np.nan)
            axes.plot(x, y, color=colour, linestyle=LEVEL_DASHES[level - 1], linewidth=1.0, label=text)


def heave_figure(report: Qualities) -> Figure:
    """Climb rates and fits, with the first of the scales."""
    figure = _figure(WIDE, 3.6)
    axes, constants = figure.subplots(1, 2)
    scale = report.scales[0]
    duration = HEAVE_TIME / scale.speed_up
    at = times(duration)
    for i, point in enumerate(report.points):
        fit = point.heave[0]
        collective = None if point.seen is None else control_of(point.seen, "heave")
        if point.seen is None or fit is None or collective is None:
            continue
        row = output_row(point.seen, "climb_rate")[np.newaxis]
        found = step_response(point.seen, collective, row, duration, *report.lag(point))[0]
        colour = COLOURS[i % len(COLOURS)]
        axes.plot(at, found, color=colour, label=f"{point.airspeed:g} m/s")
        axes.plot(at, fit.at(at), color=colour, linestyle=":")
    axes.set_xlabel("time [s]")
    axes.set_ylabel("climb rate by collective, SI")
    _legend(axes)
    _grid(axes)
    for i, scale in enumerate(report.scales):
        fits = [(point.airspeed, point.heave[i]) for point in report.points]
        own = [(speed, fit.time_constant) for speed, fit in fits if fit is not None and not fit.is_ramp]
        constants.plot(*zip(*own, strict=True) if own else ([], []), marker="o", color=COLOURS[i], label=scale.name)
        _boundary(constants, limits().find("heave_time_constant", LOW_SPEED), -1, scale, i, across=True)
    constants.set_xlabel("airspeed [m/s]")
    constants.set_ylabel("time constant of heave [s]")
    _legend(constants)
    _grid(constants)
    return figure


def coupling_figure(report: Qualities) -> Figure:
    """Ratios over airspeed."""
    figure = _figure(WIDE, 3.4)
    names = {"roll_from_pitch": "roll from pitch", "pitch_from_roll": "pitch from roll"}
    attitudes, yaw = figure.subplots(1, 2)
    speeds = [point.airspeed for point in report.points]
    for i, scale in enumerate(report.scales):
        rows = report.rows(i)
        for j, (name, title) in enumerate(names.items()):
            values = [math.nan if quality is None else quality.value for quality in rows.get(name, ())]
            if values:
                text = f"{title}, {scale.name}"
                attitudes.plot(speeds, values, color=COLOURS[j], linestyle=DASHES[i], marker="o", label=text)
        values = [math.nan if quality is None else quality.value for quality in rows.get("yaw_from_collective", ())]
        if values:
            yaw.plot(speeds, values, color=COLOURS[i], marker="o", label=scale.name)
        _boundary(yaw, limits().find("yaw_from_collective", LOW_SPEED), 2, scale, i, across=True)
    _boundary(attitudes, limits().find("roll_from_pitch", LOW_SPEED), 0, Scale("all scales", 1.0, 1.0), 0, across=True)
    for axes, text in ((attitudes, "other attitude over commanded one"), (yaw, "yaw rate over climb rate [deg/m]")):
        axes.set_xlabel("airspeed [m/s]")
        axes.set_ylabel(text)
        axes.set_ylim(bottom=0.0)
        _legend(axes)
        _grid(axes)
    return figure


def bode_figure(report: Qualities) -> Figure:
    """Gain and phase of the attitudes."""
    figure = _figure(WIDE, 5.0)
    grid = figure.subplots(2, 3, sharex=True)
    for column, axis in enumerate(ATTITUDES):
        gain, phase = grid[0][column], grid[1][column]
        for i, (speed, frequencies, response, angle) in enumerate(_responses(report, axis)):
            colour = COLOURS[i % len(COLOURS)]
            gain.semilogx(frequencies, 20.0 * np.log10(np.abs(response)), color=colour, label=f"{speed:g} m/s")
            phase.semilogx(frequencies, np.degrees(angle), color=colour)
        for angle_deg, dashes in ((-135.0, "--"), (-180.0, "-")):
            phase.axhline(angle_deg, color=INK, linestyle=dashes, linewidth=0.8)
        gain.set_title(axis)
        gain.set_ylabel("gain [dB]")
        phase.set_ylabel("phase [deg]")
        phase.set_xlabel("frequency [rad/s]")
        _legend(gain)
        for axes in (gain, phase):
            _grid(axes)
    return figure


def nichols_figure(report: Qualities) -> Figure:
    """Gain over phase of the attitudes."""
    figure = _figure(WIDE, 3.6)
    for axes, axis in zip(figure.subplots(1, 3), ATTITUDES, strict=True):
        for i, (speed, _, response, angle) in enumerate(_responses(report, axis)):
            gain = 20.0 * np.log10(np.abs(response))
            axes.plot(np.degrees(angle), gain, color=COLOURS[i % len(COLOURS)], label=f"{speed:g} m/s")
        for angle_deg, dashes in ((-135.0, "--"), (-180.0, "-")):
            axes.axvline(angle_deg, color=INK, linestyle=dashes, linewidth=0.8)
        axes.set_title(axis)
        axes.set_xlabel("phase [deg]")
        axes.set_ylabel("gain [dB]")
        _legend(axes)
        _grid(axes)
    return figure


def _responses(report: Qualities, axis: str) -> list[tuple[float, np.ndarray, np.ndarray, np.ndarray]]:
    """Airspeed, frequencies, response and phase of an attitude that its control moves up at once."""
    found = []
    low, high = (frequency * report.scales[0].speed_up for frequency in BODE)
    frequencies = np.geomspace(low, high, 240)
    for point in report.points:
        if point.seen is None or axis not in point.bandwidths:
            continue
        transfer = attitude_transfer(point.seen, axis, *report.lag(point))
        if transfer is None:
            continue
        turned = -math.pi if transfer.starts_down else 0.0
        found.append((point.airspeed, frequencies, transfer.at(frequencies), transfer.phase(frequencies) + turned))
    return found


def _poles(seen: LinearModel | LinearLoop, scale: Scale) -> list[complex]:
    """Of the body, or of a loop."""
    if isinstance(seen, LinearLoop):
        return [mode.pole for mode in loop_modes(seen, FASTEST_POLE * scale.speed_up)]
    return [mode.pole for mode in seen.modes if mode.family == "body"]
