"""Excitations of a flight from which frequency responses are identified: chirps and multisines on pilot controls.

M. B. Tischler, R. K. Remple, Aircraft and Rotorcraft System Identification, 2nd edition, AIAA, 2012, chapter 5: chirps.
M. R. Schroeder, Synthesis of low-peak-factor signals and binary sequences with low autocorrelation, IEEE Transactions
on Information Theory 16, 1970. E. A. Morelli, Multiple input design for real-time parameter estimation in the frequency
domain, 13th IFAC Symposium on System Identification, 2003: orthogonal multisines.
"""

from __future__ import annotations  # `help` then shows types by their names

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sbs_sim import checks
from sbs_sim.aircraft import Aircraft
from sbs_sim.content import ByContent
from sbs_sim.errors import IdentificationError, SimulationError
from sbs_sim.flight.mixer import ROUNDING, check_controls, check_ranges
from sbs_sim.output.units import counted

Array = NDArray[np.float64]
Pilot = Callable[[float, Array], ArrayLike]

TURN = 2.0 * math.pi
FREQUENCIES = (1e-3, 1e3)  # rad/s
MAX_DURATION = 3600.0  # s
FADED_SHARE = 0.05  # of a chirp, at each end, if nothing else is asked for
FADED_PERIODS = 0.1  # of a multisine, likewise
MAX_HARMONIC = 100_000
CHECKED_TICK = 0.01  # s, between the instants at which an excitation is checked


@dataclass(frozen=True)
class Chirp:
    """A sine whose frequency rises exponentially, so that every octave takes the same time.

    Attributes
    ----------
    control : str
        Of the aircraft.
    amplitude : float
        [rad], or the unit of the control.
    low, high : float
        Frequencies at the begin and at the end [rad/s]; it falls if the first is the higher.
    duration : float
        [s]
    begin : float
        Time before it [s].
    fade : float, optional
        In which the amplitude rises at the begin and falls at the end, like 1 - cos [s]; a twentieth of the duration
        if not given.

    Raises
    ------
    IdentificationError
        A value out of range.
    """

    control: str
    amplitude: float
    low: float
    high: float
    duration: float
    begin: float = 0.0
    fade: float | None = None

    def __post_init__(self) -> None:
        _check_common(self)
        for name in ("low", "high"):
            checks.number(name, getattr(self, name), *FREQUENCIES, "rad/s", IdentificationError)
        if self.low == self.high:
            raise IdentificationError(f"high = {self.high:g}: allowed is another frequency than low")
        cycle = TURN / min(self.low, self.high)
        checks.number("duration", self.duration, cycle, MAX_DURATION, "s", IdentificationError)
        if self.fade is not None:
            checks.number("fade", self.fade, 0.0, 0.5 * self.duration, "s", IdentificationError)

    @property
    def end(self) -> float:
        """Time at which it has ended [s]."""
        return self.begin + self.duration

    @property
    def band(self) -> tuple[float, float]:
        """Lowest and highest frequency [rad/s]."""
        return min(self.low, self.high), max(self.low, self.high)

    def at(self, time: ArrayLike) -> Array:
        """Values at times [s], of their shape; 0 before and after."""
        since = np.asarray(time, float) - self.begin
        growth = math.log(self.high / self.low) / self.duration
        phase = self.low * np.expm1(growth * np.clip(since, 0.0, self.duration)) / growth
        fade = FADED_SHARE * self.duration if self.fade is None else self.fade
        return np.asarray(self.amplitude * _faded(since, self.duration, fade) * np.sin(phase))


@dataclass(frozen=True)
class Multisine:
    """A sum of harmonics of one period with equal amplitudes and the phases of Schroeder, which keep the peak low.

    Attributes
    ----------
    control : str
        Of the aircraft.
    amplitude : float
        Largest value [rad], or the unit of the control.
    harmonics : tuple of int
        Rising multiples of one over the period.
    period : float
        [s]
    periods : int
        How many; the first is for the motion at the begin to die away.
    begin : float
        Time before it [s].
    fade : float, optional
        In which it rises at the begin and falls at the end [s]; a tenth of the period if not given.

    Raises
    ------
    IdentificationError
        A value out of range.
    """

    control: str
    amplitude: float
    harmonics: tuple[int, ...]
    period: float
    periods: int = 3
    begin: float = 0.0
    fade: float | None = None

    def __post_init__(self) -> None:
        _check_common(self)
        checks.number("period", self.period, 1e-2, MAX_DURATION, "s", IdentificationError)
        checks.integer("periods", self.periods, 1, 1000, IdentificationError)
        for harmonic in self.harmonics:
            checks.integer("harmonics", harmonic, 1, MAX_HARMONIC, IdentificationError)
        if not self.harmonics or any(np.diff(self.harmonics) <= 0):
            raise IdentificationError("harmonics: allowed are one or more rising integers")
        if self.fade is not None:
            checks.number("fade", self.fade, 0.0, 0.5 * self.period, "s", IdentificationError)

    @property
    def duration(self) -> float:
        """Of all periods [s]."""
        return self.period * self.periods

    @property
    def end(self) -> float:
        """Time at which it has ended [s]."""
        return self.begin + self.duration

    @property
    def frequencies(self) -> Array:
        """Of the harmonics [rad/s]."""
        found: Array = TURN / self.period * np.array(self.harmonics, np.float64)
        return found

    @property
    def band(self) -> tuple[float, float]:
        """Lowest and highest frequency [rad/s]."""
        return float(self.frequencies[0]), float(self.frequencies[-1])

    @cached_property
    def peak_factor(self) -> float:
        """Half the range over the amplitude of a sine of the same power; 1 for a sine."""
        return float(0.5 * np.ptp(self._sum(self._one_period())) / math.sqrt(len(self.harmonics)))

    @cached_property
    def _largest(self) -> float:
        return float(np.abs(self._sum(self._one_period())).max())

    def at(self, time: ArrayLike) -> Array:
        """Values at times [s], of their shape; 0 before and after."""
        since = np.asarray(time, float) - self.begin
        fade = FADED_PERIODS * self.period if self.fade is None else self.fade
        return np.asarray(self.amplitude / self._largest * _faded(since, self.duration, fade) * self._sum(since))

    def _one_period(self) -> Array:
        count = 16 * self.harmonics[-1]
        return np.asarray(np.arange(count) * (self.period / count), np.float64)

    def _sum(self, since: Array) -> Array:
        count = len(self.harmonics)
        numbers = np.arange(count)
        phases = math.pi * numbers * (numbers + 1) / count  # Schroeder's, for equal powers
        return np.asarray(np.cos(np.multiply.outer(since, self.frequencies) - phases).sum(axis=-1), np.float64)


Part = Chirp | Multisine


def _check_common(part: Part) -> None:
    if not isinstance(part.control, str):
        raise IdentificationError(f"control = {checks.shown(part.control)}: allowed are names")
    checks.number("amplitude", part.amplitude, 0.0, 1e6, "", IdentificationError)
    checks.number("begin", part.begin, 0.0, MAX_DURATION, "s", IdentificationError)


def _faded(since: Array, duration: float, fade: float) -> Array:
    """Factor of the amplitude: 0 outside, rising and falling like 1 - cos within."""
    inside = (since >= 0.0) & (since <= duration)
    if fade == 0.0:
        return inside.astype(float)
    near = np.clip(np.minimum(since, duration - since) / fade, 0.0, 1.0)
    return np.asarray(np.where(inside, 0.5 - 0.5 * np.cos(math.pi * near), 0.0))


def multisines(
    amplitudes: Mapping[str, float], low: float, high: float, period: float, *, periods: int = 3, begin: float = 0.0
) -> tuple[Multisine, ...]:
    """Multisines on several controls at once that share no frequency: the harmonics of a band dealt out in turn.

    Over whole periods they are orthogonal, so that the responses to all controls come from one flight.

    Parameters
    ----------
    amplitudes : mapping of str to float
        By control [rad], or its unit.
    low, high : float
        Of the band [rad/s].
    period, periods, begin
        See `Multisine`.

    Raises
    ------
    IdentificationError
        A value out of range, or fewer than two harmonics for each control in the band.
    """
    low = checks.number("low", low, *FREQUENCIES, "rad/s", IdentificationError)
    high = checks.number("high", high, low, FREQUENCIES[1], "rad/s", IdentificationError)
    period = checks.number("period", period, 1e-2, MAX_DURATION, "s", IdentificationError)
    slack = 1e-9
    every = range(max(1, math.ceil(low * period / TURN - slack)), math.floor(high * period / TURN + slack) + 1)
    if len(every) < 2 * len(amplitudes) or not amplitudes:
        raise IdentificationError(
            f"period = {period:g} s: {low:g} to {high:g} rad/s hold {counted(len(every), 'harmonic')} for"
            f" {counted(len(amplitudes), 'control')}, allowed are two or more for each: take a longer period"
        )
    count = len(amplitudes)
    return tuple(
        Multisine(control, amplitude, tuple(every[i::count]), period, periods, begin)
        for i, (control, amplitude) in enumerate(amplitudes.items())
    )


@dataclass(frozen=True, eq=False)
class Excitation(ByContent):
    """What is added to the pilot controls of an aircraft during a flight.

    Attributes
    ----------
    aircraft : Aircraft
    parts : tuple of Chirp or Multisine
        Several of one control are added up.

    Raises
    ------
    IdentificationError
        None, or a control that the aircraft does not have.
    """

    aircraft: Aircraft
    parts: tuple[Part, ...]

    def __init__(self, aircraft: Aircraft, parts: Sequence[Part]) -> None:
        checks.instance("aircraft", aircraft, Aircraft, IdentificationError)
        object.__setattr__(self, "aircraft", aircraft)
        object.__setattr__(self, "parts", tuple(parts))
        if not self.parts:
            raise IdentificationError("parts: allowed are one or more chirps or multisines")
        for part in self.parts:
            if not isinstance(part, Chirp | Multisine):
                raise IdentificationError(f"parts: {checks.shown(part)}: allowed are chirps and multisines")
            checks.choice("control", part.control, aircraft.control_names, IdentificationError)

    @property
    def control_names(self) -> tuple[str, ...]:
        """Controls that it acts on, in the order of the aircraft."""
        own = {part.control for part in self.parts}
        return tuple(name for name in self.aircraft.control_names if name in own)

    @property
    def end(self) -> float:
        """Time at which all parts have ended [s]."""
        return max(part.end for part in self.parts)

    @property
    def band(self) -> tuple[float, float]:
        """Lowest and highest frequency of all parts [rad/s]."""
        bands = [part.band for part in self.parts]
        return min(low for low, _ in bands), max(high for _, high in bands)

    def history(self, times: ArrayLike) -> Array:
        """What is added to the controls at times [s], shape (n, n_controls)."""
        times = np.atleast_1d(np.asarray(times, float))
        found = np.zeros((len(times), len(self.aircraft.controls)))
        for part in self.parts:
            found[:, self.aircraft.control_names.index(part.control)] += part.at(times)
        return found

    def around(self, controls: ArrayLike) -> Callable[[float], Array]:
        """Controls over time for `simulate`: some, shape (n_controls,), with the excitation added.

        Raises
        ------
        IdentificationError
            See `check`.
        """
        base = checks.array("controls", controls, IdentificationError)
        self.check(base)
        return lambda time: base + self.history(time)[0]

    def with_pilot(self, pilot: Pilot) -> Pilot:
        """A pilot for `simulate_with_pilot`: another one's controls with the excitation added."""
        return lambda time, state: np.asarray(pilot(time, state), float) + self.history(time)[0]

    def check(self, controls: ArrayLike) -> None:
        """Check that the aircraft can follow, with controls of the trim, shape (n_controls,).

        Raises
        ------
        IdentificationError
            A control beyond its range, or a swashplate beyond its range or faster than its actuator, with value, time
            and what is allowed.
        """
        try:
            self._check(checks.array("controls", controls, IdentificationError))
        except SimulationError as error:
            raise IdentificationError(f"excitation: {error}") from None

    def _check(self, base: Array) -> None:
        check_controls(self.aircraft, base)
        first = min(part.begin for part in self.parts)
        times = np.arange(first, self.end + CHECKED_TICK, CHECKED_TICK)
        given = base + self.history(times)
        low, high = np.array([control.range for control in self.aircraft.controls]).T
        beyond = np.maximum(given - high, low - given).max(axis=1)
        if beyond.max() > 0.0:
            worst = int(beyond.argmax())
            check_ranges(self.aircraft, given[worst], f"at {times[worst]:.4g} s: ")
        angles = np.array([self.aircraft.mix(row) for row in given])
        self._check_angles(times, angles)
        self._check_rates(times, angles)

    def _check_angles(self, times: Array, angles: Array) -> None:
        for i, row in enumerate(self.aircraft.rows):
            low, high = np.array(row.ranges).T
            beyond = np.maximum(angles[:, i] - high, low - angles[:, i])
            if beyond.max() > ROUNDING:
                at, which = np.unravel_index(int(beyond.argmax()), beyond.shape)
                limits = f"{row.shown(low[which])} to {row.shown(high[which])}"
                raise IdentificationError(
                    f"excitation: at {times[at]:.4g} s: {row.owner} {row.names[which]} ="
                    f" {row.shown(angles[at, i, which])}: allowed are {limits}"
                )

    def _check_rates(self, times: Array, angles: Array) -> None:
        rates = np.abs(np.diff(angles, axis=0)) / CHECKED_TICK
        for i, row in enumerate(self.aircraft.rows):
            fastest = rates[:, i].max(axis=1)
            if fastest.max(initial=0.0) > row.rate * (1.0 + 1e-9):
                at = int(fastest.argmax())
                raise IdentificationError(
                    f"excitation: at {times[at]:.4g} s: {row.owner} moves at {row.shown(fastest[at])}/s: its actuator"
                    f" allows {row.shown(row.rate)}/s; a smaller amplitude or a lower frequency is followed"
                )
