"""Flying qualities of an aircraft over airspeed, from its linear models (theory.md section 9.13).

What is judged is the aircraft as its file describes it, flown by its controls, or with a control law in the loop.
"""

from __future__ import annotations  # `help` then shows types by their names

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sbs_sim import checks
from sbs_sim.aircraft import Aircraft
from sbs_sim.analysis.bandwidth import Bandwidth, bandwidth_of
from sbs_sim.analysis.frequency_response import MAX_DELAY, Actuator, Transfer
from sbs_sim.analysis.linear_loop import PATH, LawOf, LinearLaw, LinearLoop, linear_loop
from sbs_sim.analysis.linear_model import LinearModel
from sbs_sim.analysis.modes import LONGITUDINAL, Mode
from sbs_sim.analysis.quality_limits import ANY, FORWARD, Limits, Scale, limits, scales
from sbs_sim.analysis.quickness import Quickness, of_pulses, of_step
from sbs_sim.analysis.step_response import (
    FirstOrder,
    first_order,
    first_peak,
    off_axis_ratio,
    output_row,
    step_response,
)
from sbs_sim.analysis.sweep import SweepPoint, sweep
from sbs_sim.content import ByContent
from sbs_sim.errors import LinearizationError, SbsError
from sbs_sim.flight.two_blades import has_two_blades
from sbs_sim.model import state as S

Array = NDArray[np.float64]

REPORT_SPEEDS = (0.0, 0.25, 0.5, 0.75, 1.0)  # by default, of the fastest
FASTEST = 20.0 * math.sqrt(16.36 / 2.3)  # m/s at full size: 20 m/s of the side-by-side helicopter
ATTITUDES = {"pitch": "theta", "roll": "phi", "yaw": "psi"}
RATES = {"pitch": "q", "roll": "p", "yaw": "r"}
HEAVE_TIME, COUPLING_TIME, PEAK_TIME, NO_PEAK_TIME = 5.0, 4.0, 3.0, 1.0  # s at full size
QUICK_TIME = 6.0  # s at full size, in which quickness is looked at
FASTEST_POLE = 20.0  # rad/s at full size, of a loop, that is listed
REJECTED = 0.02, 20.0  # rad/s at full size, of disturbances
ANGLES = 26  # at which quickness is compared
STILL = 1e-6  # rad/s, of a pole: position and heading that nothing holds
OWN = 0.2  # share of body and path in such a pole
LATE = 0.1  # s at full size, of a phase delay
NOTHING = 1e-9  # of an attitude or rate by a control, over that on its own axis


@dataclass(frozen=True, eq=False)
class Quality(ByContent):
    """One quality at one airspeed, judged at one scale.

    Attributes
    ----------
    name : str
        Of its boundary, such as "pitch_bandwidth"; of a mode its name and what it is, "phugoid: damping ratio".
    title, unit : str
    value : float
        Of the aircraft, not of full size; not a number where there is none.
    level : int
        1 to 3, 4 for worse than any level that is limited; 0 where nothing is asked for.
    limit : str
        Name of the boundary, see `sbs_sim.analysis.quality_limits.limits`; empty without one.
    scaled_by : int
        Power of a frequency that the value has: 1, of times -1, of numbers 0, of an inverse length 2.
    remark : str
        Why there is no value, or what has to be known of it.
    """

    name: str
    title: str
    unit: str
    value: float
    level: int
    limit: str
    scaled_by: int
    remark: str = ""

    def to_dict(self) -> dict[str, Any]:
        """All by name."""
        return {field.name: getattr(self, field.name) for field in fields(self)}


@dataclass(frozen=True, eq=False)
class QualityPoint(ByContent):
    """Flying qualities at one airspeed.

    Attributes
    ----------
    airspeed : float
        [m/s]
    model : LinearModel or None
        None where there is no trim.
    error : str or None
    bandwidths : mapping of str to Bandwidth
        By axis, "pitch", "roll" and "yaw", as far as there are controls.
    heave : tuple of FirstOrder
        Fits of the climb rate for each scale.
    judged : tuple of tuple of Quality
        For each scale.
    quickness : mapping of str to Quickness
        By axis.
    loop : LinearLoop or None
        With the control law; None without one.
    """

    airspeed: float
    model: LinearModel | None
    error: str | None
    bandwidths: dict[str, Bandwidth]
    heave: tuple[FirstOrder | None, ...]
    judged: tuple[tuple[Quality, ...], ...]
    quickness: dict[str, Quickness] = field(default_factory=dict)
    loop: LinearLoop | None = None

    @property
    def seen(self) -> LinearModel | LinearLoop | None:
        """What is judged: the loop, or the model without one."""
        return self.loop or self.model


@dataclass(frozen=True, eq=False)
class Qualities(ByContent):
    """Flying qualities of an aircraft over airspeed.

    Attributes
    ----------
    aircraft, parameter_hash : str
    delay : float
        Of sensors, computers and actuators beside the model [s].
    scales : tuple of Scale
    points : tuple of QualityPoint
    actuator : Actuator, optional
    law : str
        What flies; empty for the controls alone.
    """

    aircraft: str
    parameter_hash: str
    delay: float
    scales: tuple[Scale, ...]
    points: tuple[QualityPoint, ...]
    actuator: Actuator | None = None
    law: str = ""

    def lag(self, point: QualityPoint) -> tuple[float, Actuator | None]:
        """Delay and actuators before what is judged; a loop has them in it."""
        return (self.delay, self.actuator) if point.loop is None else (0.0, None)

    def rows(self, scale: int = 0) -> dict[str, tuple[Quality | None, ...]]:
        """Qualities by name, one for each airspeed; None where there is none."""
        found = [{quality.name: quality for quality in point.judged[scale]} for point in self.points]
        every = list(dict.fromkeys(name for point in found for name in point))
        modes = list(dict.fromkeys(name.partition(":")[0] for name in every))
        names = sorted(every, key=lambda name: _order(name, modes))
        return {name: tuple(point.get(name) for point in found) for name in names}

    def to_dict(self) -> dict[str, Any]:
        """Everything as plain lists and numbers for JSON."""
        known = limits()
        return {
            "aircraft": self.aircraft,
            "parameter_hash": self.parameter_hash,
            "law": self.law,
            "delay": self.delay,
            "actuator": None if self.actuator is None else asdict(self.actuator),
            "standard": known.standard,
            "limits": {
                name: {"paragraph": limit.paragraph, "source": limit.source, "read_from_standard": limit.is_read}
                for name, limit in known.by_name.items()
            },
            "scales": [
                {"name": s.name, "length": s.length, "reference": s.reference, "frequency_factor": s.speed_up}
                for s in self.scales
            ],
            "points": [
                {
                    "airspeed": point.airspeed,
                    "error": point.error,
                    "qualities": [[quality.to_dict() for quality in judged] for judged in point.judged],
                }
                for point in self.points
            ],
        }


Progress = Callable[[SweepPoint, int, int], None]


def qualities(
    aircraft: Aircraft,
    airspeeds: ArrayLike | None = None,
    *,
    delay: float = 0.0,
    scale_length: float | None = None,
    is_rate_command: bool = True,
    actuator: Actuator | None = None,
    law: LinearLaw | LawOf | None = None,
    law_name: str = "a control law",
    workers: int | None = None,
    progress: Progress | None = None,
) -> Qualities:
    """Flying qualities over airspeed, with levels after ADS-33E-PRF.

    Parameters
    ----------
    aircraft : Aircraft
    airspeeds : array_like, optional
        [m/s]; by default five from hover to that which is 20 m/s for a lateral span of 2.3 m, by Froude's scaling.
    delay : float
        Of sensors, computers and actuators beside the model [s], 0 to 10.
    scale_length : float, optional
        Length for the 16.36 m of the UH-60A [m]; by default the lateral span, and beside it the rotor radius.
    is_rate_command : bool
        See `sbs_sim.analysis.bandwidth.bandwidth`.
    actuator : Actuator, optional
        Lag of the actuators, the same for all controls.
    law : LinearLaw or callable, optional
        In the loop, or what gives it for a linear model, such as `sbs_sim.pilot.linear_laws.augmentation_law`. Its
        commands are then what is judged, and it says which of them are answered by a rate.
    law_name : str
        For the report.
    workers : int, optional
        Threads, one for each core by default.
    progress : callable, optional
        See `sbs_sim.sweep`.

    Returns
    -------
    Qualities
        Also of airspeeds without a trim, with their errors.

    Raises
    ------
    LinearizationError
        A value out of range, a stand, or rotors with two blades, which have no constant linear model.
    SweepError
        No airspeeds, or one that is not finite.
    """
    checks.instance("aircraft", aircraft, Aircraft, LinearizationError)
    delay = checks.number("delay", delay, 0.0, MAX_DELAY, "s", LinearizationError)
    chosen = scales(aircraft, scale_length)
    if aircraft.body.is_stand:
        raise LinearizationError("body.stand: flying qualities are those of an aircraft in free flight")
    if has_two_blades(aircraft):
        raise LinearizationError(
            "rotors.blades = 2: flying qualities need a constant linear model: allowed are 3 and more"
        )
    if airspeeds is None:
        airspeeds = default_airspeeds(chosen[0])
    swept = sweep(aircraft, "airspeed", airspeeds, workers=workers, progress=progress)
    task = _Task(aircraft, chosen, delay, is_rate_command, actuator, law)
    points = tuple(task.point(point) for point in swept.points)
    named = law_name if law is not None else ""
    return Qualities(aircraft.name, aircraft.parameter_hash, delay, chosen, points, actuator, named)


def default_airspeeds(scale: Scale) -> list[float]:
    """Five airspeeds from hover, round numbers [m/s]."""
    fastest = max(1.0, round(FASTEST / scale.speed_up))
    return [float(f"{fastest * share:.3g}") for share in REPORT_SPEEDS]


@dataclass(frozen=True, eq=False)
class _Task(ByContent):
    """What is judged, and how."""

    aircraft: Aircraft
    scales: tuple[Scale, ...]
    delay: float
    is_rate_command: bool
    actuator: Actuator | None
    law: LinearLaw | LawOf | None

    def point(self, point: SweepPoint) -> QualityPoint:
        """Judge an airspeed."""
        model = point.model
        if model is None:
            return self._empty(point.value, point.error)
        loop: LinearLoop | None = None
        if self.law is not None:
            try:
                own = self.law if isinstance(self.law, LinearLaw) else self.law(model)
                loop = linear_loop(model, own, self.delay, self.actuator)
            except SbsError as error:
                return self._empty(point.value, str(error))
        lag = (self.delay, self.actuator) if loop is None else (0.0, None)
        seen = model if loop is None else loop
        bandwidths = attitude_bandwidths(seen, lag[0], self.is_rate_command, lag[1])
        judged, heaves, quick = [], [], {}
        for scale in reversed(self.scales):
            view = _View(seen, limits(), scale, lag, self._rooms(model), self.is_rate_command)
            heave, quick = view.heave(), view.quickness()
            heaves.append(heave)
            found = [*view.bandwidths(bandwidths), *view.quick(quick), *view.rejections(), *view.heave_response(heave)]
            judged.append((*found, *view.coupling(), *view.modes()))
        return QualityPoint(
            point.value, model, point.error, bandwidths, tuple(heaves[::-1]), tuple(judged[::-1]), quick, loop
        )

    def _empty(self, value: float, error: str | None) -> QualityPoint:
        count = len(self.scales)
        return QualityPoint(value, None, error, {}, (None,) * count, ((),) * count)

    def _rooms(self, model: LinearModel) -> dict[str, float]:
        """How far each control is from the nearer end of its range."""
        return {
            control.name: max(0.0, min(control.range[1] - value, value - control.range[0]))
            for control, value in zip(self.aircraft.controls, model.trim.controls.tolist(), strict=True)
        }


def control_of(model: LinearModel | LinearLoop, axis: str) -> str | None:
    """First control that a pilot moves for an axis; None without one."""
    return next((name for name, own in zip(model.control_names, model.control_axes, strict=True) if own == axis), None)


def attitude_transfer(
    model: LinearModel | LinearLoop, axis: str, delay: float = 0.0, actuator: Actuator | None = None
) -> Transfer | None:
    """Transfer function from the control of an axis to its attitude: theta, phi, or the heading; None without one."""
    control = control_of(model, axis)
    if control is None:
        return None
    if isinstance(model, LinearLoop):
        return model.transfer(control, "heading" if axis == "yaw" else ATTITUDES[axis])
    if axis != "yaw":
        return Transfer.of(model, control, ATTITUDES[axis], delay, actuator)
    found = _heading(model, Transfer.of(model, control, "q", delay), Transfer.of(model, control, "r", delay))
    return replace(found, actuator=actuator) if np.abs(found.b).any() else None


def _heading(model: LinearModel, pitching: Transfer, yawing: Transfer) -> Transfer:
    """Integral of the rate of the heading, (q sin phi + r cos phi) / cos theta in a straight flight."""
    roll, pitch = model.trim.roll, model.trim.pitch
    row = (math.sin(roll) * pitching.c + math.cos(roll) * yawing.c) / math.cos(pitch)
    size = len(row)
    a = np.zeros((size + 1, size + 1))
    a[:size, :size], a[size, :size] = yawing.a, row
    settled = None
    if yawing.settled is not None and pitching.settled is not None:
        settled = _heading(model, pitching.settled, yawing.settled)
    return Transfer(a, np.append(yawing.b, 0.0), np.eye(size + 1)[size], 0.0, yawing.delay, settled)


def attitude_bandwidths(
    model: LinearModel | LinearLoop, delay: float = 0.0, is_rate_command: bool = True, actuator: Actuator | None = None
) -> dict[str, Bandwidth]:
    """Bandwidths of pitch, roll and heading, of the axes that have a control which moves them."""
    found = {}
    for axis, output in ATTITUDES.items():
        transfer = attitude_transfer(model, axis, delay, actuator)
        if transfer is None:
            continue
        try:
            is_rate = axis in model.rate_axes if isinstance(model, LinearLoop) else is_rate_command
            found[axis] = bandwidth_of(transfer, control_of(model, axis) or "", output, is_rate)
        except LinearizationError:  # the control does not move it
            continue
    return found


class _View:
    """A linear model seen at a scale."""

    def __init__(
        self,
        model: LinearModel | LinearLoop,
        known: Limits,
        scale: Scale,
        lag: tuple[float, Actuator | None],
        rooms: Mapping[str, float],
        is_rate_command: bool,
    ) -> None:
        self.model, self.known, self.scale, self.lag, self.rooms = model, known, scale, lag, rooms
        self.is_rate_command = is_rate_command
        self.flight = known.flight(model.trim.condition.airspeed, scale)

    def judged(self, name: str, title: str, unit: str, value: float, power: int, remark: str = "") -> Quality:
        """A quality with its level."""
        limit = self.known.find(name, self.flight)
        full_size = value / self.scale.speed_up**power
        level = 0 if limit is None else limit.level_of(full_size)
        return Quality(name, title, unit, value, level, "" if limit is None else limit.name, power, remark)

    def bandwidths(self, found: dict[str, Bandwidth]) -> list[Quality]:
        """Bandwidth and phase delay of the axes."""
        rows = []
        for axis in ATTITUDES:
            if axis not in found:
                rows.append(self._unjudged(f"{axis}_bandwidth", f"{axis} bandwidth", "rad/s", 1, "no control moves it"))
                continue
            own = found[axis]
            rows.append(self.judged(f"{axis}_bandwidth", f"{axis} bandwidth", "rad/s", own.bandwidth, 1, own.remark))
            late = own.phase_delay * self.scale.speed_up > LATE
            remark = f"beyond {LATE} s at full size, where the standard asks for more bandwidth" if late else ""
            rows.append(self.judged(f"{axis}_phase_delay", f"{axis} phase delay", "s", own.phase_delay, -1, remark))
        return rows

    def _unjudged(self, name: str, title: str, unit: str, power: int, remark: str) -> Quality:
        return Quality(name, title, unit, math.nan, 0, "", power, remark)

    def quickness(self) -> dict[str, Quickness]:
        """Of the axes that have a control which moves them."""
        found = {}
        duration = QUICK_TIME / self.scale.speed_up
        for axis in ATTITUDES:
            control = control_of(self.model, axis)
            if control is None:
                continue
            turned, turning, room = self._turned(axis, control, duration)
            if np.abs(turned).max() <= NOTHING * duration:
                continue
            is_rate = self.is_rate_command
            if isinstance(self.model, LinearLoop):
                is_rate = axis in self.model.rate_axes
            found[axis] = of_pulses(turned, turning, room) if is_rate else of_step(turned, turning, room)
        return found

    def _turned(self, axis: str, control: str, duration: float) -> tuple[Array, Array, float]:
        """Attitude and its rate after a unit step, and how far the step may go."""
        outputs = [*ATTITUDES.values(), *RATES.values()]
        own = ["theta", "phi", "q", "p", "r"]
        steps = step_response(
            self.model, control, np.array([output_row(self.model, name) for name in own]), duration, *self.lag
        )
        values = dict(zip(own, steps, strict=True))
        room = self.rooms.get(control, math.inf)
        if isinstance(self.model, LinearLoop):
            moved = [name for name in self.rooms if name in self.model.output_names]
            rows = np.array([output_row(self.model, name) for name in moved])
            most = np.abs(step_response(self.model, control, rows, duration)).max(axis=1)
            room = min((self.rooms[name] / value for name, value in zip(moved, most, strict=True) if value > 0.0))
        if axis != "yaw":
            return values[outputs[0] if axis == "pitch" else outputs[1]], values[RATES[axis]], room
        roll, pitch = self.model.trim.roll, self.model.trim.pitch
        rate = (math.sin(roll) * values["q"] + math.cos(roll) * values["r"]) / math.cos(pitch)
        step = duration / (len(rate) - 1)
        turned = np.concatenate([[0.0], np.cumsum(0.5 * step * (rate[1:] + rate[:-1]))])
        return turned, rate, room

    def quick(self, found: Mapping[str, Quickness]) -> list[Quality]:
        """Quickness of the smallest change with a boundary; the level is the worst of all changes that are reached."""
        rows = []
        for axis in ATTITUDES:
            name, title = f"{axis}_quickness", f"{axis} quickness"
            limit = self.known.find(name, self.flight)
            if axis not in found:
                rows.append(self._unjudged(name, title, "1/s", 1, "no control moves it"))
                continue
            own = found[axis]
            smallest, largest = limit.angles if limit is not None else (10.0, 10.0)
            value, reach = own.at(math.radians(smallest)), math.degrees(own.reach)
            remark = f"of a change of {smallest:g} deg; {reach:.0f} deg are reached within the range of the control"
            if not len(own.values):
                remark = "an attitude that a pulse leaves is not steady"
            level = 0
            if limit is not None:
                angles = np.linspace(smallest, max(smallest, min(largest, reach)), ANGLES)
                full = [own.at(math.radians(angle)) / self.scale.speed_up for angle in angles]
                level = max(limit.level_at(angle, one) for angle, one in zip(angles.tolist(), full, strict=True))
            key = "" if limit is None else limit.name
            rows.append(Quality(name, title, "1/s", value, level, key, 1, remark))
        return rows

    def rejections(self) -> list[Quality]:
        """Disturbance rejection bandwidth and peak of the attitudes that a law feeds back; none without one."""
        if not isinstance(self.model, LinearLoop):
            return []
        rows = []
        for axis, attitude in ATTITUDES.items():
            measured = "heading" if axis == "yaw" else attitude
            names = [f"{axis}_rejection_{what}" for what in ("bandwidth", "peak")]
            titles = [name.replace("_", " ") for name in names]
            if measured not in self.model.measured:
                remark = "the attitude is not fed back"
                rows += [self._unjudged(names[0], titles[0], "rad/s", 1, remark)]
                rows += [self._unjudged(names[1], titles[1], "dB", 0, remark)]
                continue
            low, high = (frequency * self.scale.speed_up for frequency in REJECTED)
            found = self.model.rejection(measured, (low, high))
            where = f"at {found.peak_frequency:.3g} rad/s"
            if not self.model.is_stable:
                where += f"; the loop is not stable, it doubles in {math.log(2.0) / self.model.growth:.3g} s"
            rows.append(self.judged(names[0], titles[0], "rad/s", found.bandwidth, 1, found.remark))
            rows.append(self.judged(names[1], titles[1], "dB", found.peak, 0, where))
        return rows

    def heave(self) -> FirstOrder | None:
        """Fit of the climb rate after a step of collective; None without one."""
        collective = control_of(self.model, "heave")
        if collective is None:
            return None
        duration = HEAVE_TIME / self.scale.speed_up
        row = output_row(self.model, "climb_rate")[np.newaxis]
        return first_order(step_response(self.model, collective, row, duration, *self.lag)[0], duration)

    def heave_response(self, fit: FirstOrder | None) -> list[Quality]:
        """Time constant and delay."""
        names = (("heave_time_constant", "heave time constant"), ("heave_delay", "heave delay"))
        if fit is None:
            return [self._unjudged(name, title, "s", -1, "no control moves it") for name, title in names]
        remark = "" if fit.is_good else f"no first-order response: coefficient of determination {fit.determination:.2f}"
        if fit.is_ramp:
            remark = "it does not settle: a ramp"
        values = fit.time_constant, fit.delay
        return [
            self.judged(name, title, "s", value, -1, remark) for (name, title), value in zip(names, values, strict=True)
        ]

    def coupling(self) -> list[Quality]:
        """Roll from pitch, pitch from roll, yaw from collective."""
        rows = [
            self._attitudes("roll_from_pitch", "roll from pitch", "pitch", ("theta", "phi")),
            self._attitudes("pitch_from_roll", "pitch from roll", "roll", ("phi", "theta")),
        ]
        return [*rows, self._yaw_from_collective()]

    def _attitudes(self, name: str, title: str, axis: str, outputs: tuple[str, str]) -> Quality:
        control, duration = control_of(self.model, axis), COUPLING_TIME / self.scale.speed_up
        if control is None:
            return self._unjudged(name, title, "1", 0, f"no control of {axis}")
        rows = np.array([output_row(self.model, output) for output in outputs])
        on, off = step_response(self.model, control, rows, duration, *self.lag)
        return self.judged(name, title, "1", _cleaned(off_axis_ratio(off, on)), 0)

    def _yaw_from_collective(self) -> Quality:
        name, title, unit = "yaw_from_collective", "yaw from collective", "deg/m"
        collective, duration = control_of(self.model, "heave"), PEAK_TIME / self.scale.speed_up
        if collective is None:
            return self._unjudged(name, title, unit, 2, "no control of heave")
        rows = np.array([output_row(self.model, "r"), output_row(self.model, "climb_rate")])
        yaw, climb = step_response(self.model, collective, rows, duration, *self.lag)
        peak = first_peak(yaw, duration, NO_PEAK_TIME / self.scale.speed_up)
        ratio = abs(math.degrees(peak) / climb[-1]) if climb[-1] != 0.0 else math.nan
        return self.judged(name, title, unit, _cleaned(ratio), 2)

    def modes(self) -> list[Quality]:
        """Frequency, damping and time to half or double of the modes of the body."""
        rows = []
        if isinstance(self.model, LinearLoop):
            for mode in loop_modes(self.model, FASTEST_POLE * self.scale.speed_up):
                rows += self._mode(mode)
            return rows
        for mode in self.model.modes:
            if mode.family == "body":
                rows += self._mode(mode)
        return rows

    def _mode(self, mode: Mode) -> list[Quality]:
        name = "oscillation" if mode.is_oscillatory else "divergence"
        if self.flight == FORWARD and mode.is_oscillatory and not _is_longitudinal(mode, self.model):
            name = "lateral_oscillation"
        if self.flight == FORWARD and mode.name.startswith("spiral"):
            name = "spiral"
        limit = self.known.find(name, self.flight) or self.known.find(name, ANY)
        level = 0 if limit is None else limit.level_of_mode(mode, self.scale.speed_up)
        own, key = "" if limit is None else limit.name, mode.name
        time = -mode.time_to_double if mode.is_growing else mode.time_to_half
        last = self._row(f"{key}: time to half (-: double)", "s", time, -1)
        if not mode.is_oscillatory:
            return [Quality(last.name, last.title, "s", time, level, own, -1)]
        return [
            Quality(f"{key}: damping ratio", f"{key}: damping ratio", "1", mode.damping, level, own, 0),
            self._row(f"{key}: frequency", "rad/s", mode.frequency, 1),
            last,
        ]

    @staticmethod
    def _row(title: str, unit: str, value: float, power: int) -> Quality:
        return Quality(title, title, unit, value, 0, "", power)


def loop_modes(loop: LinearLoop, fastest: float) -> list[Mode]:
    """Poles of a loop up to a frequency [rad/s] in which body or path take part, slowest first, by their number."""
    values, vectors = np.linalg.eig(loop.a)
    shares = np.abs(vectors * np.linalg.inv(vectors).T)
    shares /= shares.sum(axis=0)
    own = np.array([name in (*S.LINEAR_BODY_NAMES, *PATH) for name in loop.state_names])
    order = [i for i in np.argsort(np.abs(values)) if values[i].imag >= 0.0]
    kept = [i for i in order if STILL < abs(values[i]) <= fastest and shares[own, i].sum() >= OWN]
    return [
        Mode(f"loop {number}", complex(values[i]), vectors[:, i].astype(complex), shares[:, i], "body")
        for number, i in enumerate(kept, 1)
    ]


def _is_longitudinal(mode: Mode, model: LinearModel | LinearLoop) -> bool:
    """Whether more of a mode is in u, w, q and theta than in the other states of the body."""
    shares = dict(zip(model.state_names, mode.participation.tolist(), strict=True))
    own = sum(shares.get(name, 0.0) for name in LONGITUDINAL)
    return own >= 0.5 * sum(shares.get(name, 0.0) for name in S.LINEAR_BODY_NAMES)


def _cleaned(ratio: float) -> float:
    """Zero for what only rounding gives."""
    return 0.0 if abs(ratio) < NOTHING else ratio


def _order(name: str, mode_names: Sequence[str]) -> tuple[int, int]:
    """Attitudes first, then heave, coupling and modes, these in the order in which they are found."""
    if ":" in name:
        return 3, mode_names.index(name.partition(":")[0])
    if name.startswith("heave_"):
        return 1, 0
    return (2, 0) if "_from_" in name else (0, 0)
