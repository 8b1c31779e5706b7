"""Boundaries of flying-quality levels of config/flying_qualities.yaml, and Froude scaling (theory.md section 9.13).

The boundaries are those of rotorcraft of full size. A smaller one is judged by its motion seen at full size: with the
same gravity, times scale with the square root of a length (W. Froude).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from sbs_sim import checks
from sbs_sim.config_file import config_folder, read_yaml
from sbs_sim.errors import LinearizationError

if TYPE_CHECKING:
    from sbs_sim.aircraft import Aircraft
    from sbs_sim.analysis.modes import Mode

FILE = "flying_qualities.yaml"
LENGTHS = (0.01, 1000.0)  # m
LOW_SPEED, FORWARD, ANY = "low_speed", "forward", "any"
RANGE, OSCILLATION, DIVERGENCE, CURVE = "range", "oscillation", "divergence", "curve"
ALIKE = 1e-3  # of two scales


@dataclass(frozen=True)
class Limit:
    """Boundaries of one quality at full size.

    Attributes
    ----------
    name, kind, paragraph, flight, remark : str
        `kind` is "range", "oscillation", "divergence" or "curve"; `flight` is "low_speed", "forward" or "any".
    levels : tuple
        What each level asks for: a mapping with "least" or "most" (range), a tuple of bands (oscillation),
        the shortest time to double [s] (divergence), or pairs of an angle [deg] and the least value there (curve).
    source : str
        Where the boundary is reported.
    is_read : bool
        Whether it was read in the standard itself.
    checked : str
        What public text or data it agrees with; empty for none.
    is_remembered : bool
        Whether it was written down from memory of its source.
    """

    name: str
    kind: str
    paragraph: str
    flight: str
    levels: tuple[Any, ...]
    source: str
    is_read: bool
    remark: str
    checked: str = ""
    is_remembered: bool = True

    @property
    def angles(self) -> tuple[float, float]:
        """Smallest and largest angle of a curve [deg]."""
        return self.levels[0][0][0], self.levels[0][-1][0]

    def least_at(self, level: int, angle: float) -> float:
        """What a level asks for at an angle of a curve [deg]."""
        points = self.levels[level - 1]
        angles, values = zip(*points, strict=True)
        return float(np.interp(angle, angles, values))

    def level_at(self, angle: float, value: float) -> int:
        """Level of a value of full size at an angle [deg], 1 to 3; 3 for not a number."""
        for level in range(1, len(self.levels) + 1):
            if value >= self.least_at(level, angle):
                return level
        return len(self.levels) + 1

    def level_of(self, value: float) -> int:
        """Level of a value of full size, 1 to 3; 3 for not a number."""
        for number, limits in enumerate(self.levels, 1):
            if limits.get("least", -math.inf) <= value <= limits.get("most", math.inf):
                return number
        return len(self.levels) + 1

    def level_of_mode(self, mode: Mode, speed_up: float) -> int:
        """Level of a mode, 1 to 3, and 4 for worse than those that are limited.

        Parameters
        ----------
        mode : Mode
        speed_up : float
            Of its frequencies over those of full size.
        """
        if self.kind == DIVERGENCE:
            time = mode.time_to_double * speed_up
            return next((number for number, least in enumerate(self.levels, 1) if time >= least), len(self.levels) + 1)
        frequency, growth = mode.frequency / speed_up, mode.pole.real / speed_up
        for number, bands in enumerate(self.levels, 1):
            band = next(band for band in bands if frequency <= band.get("up_to", math.inf))
            if growth <= _most_growth(band, frequency):
                return number
        return len(self.levels) + 1

    def most_growth(self, level: int, frequency: float) -> float:
        """Largest real part of an oscillation of a frequency that a level allows, at full size [rad/s]."""
        band = next(band for band in self.levels[level - 1] if frequency <= band.get("up_to", math.inf))
        return _most_growth(band, frequency)

    @property
    def text(self) -> str:
        """What levels 1 and 2 ask for, of a range, at full size."""
        return ", ".join(f"{name} {value:g}" for limits in self.levels for name, value in limits.items())


def _most_growth(band: Mapping[str, float], frequency: float) -> float:
    """Largest real part that a band allows; minus infinity where it allows nothing."""
    found = []
    if "damping" in band:
        found.append(-band["damping"] * frequency)
    if "decay" in band:
        found.append(-band["decay"])
    if "time_to_double" in band:
        found.append(math.log(2.0) / band["time_to_double"])
    return min(found, default=-math.inf)


@dataclass(frozen=True)
class Limits:
    """All boundaries.

    Attributes
    ----------
    standard : str
    reference : str
        Aircraft of full size.
    span, radius, low_speed : float
        Its lateral span and rotor radius [m], and where its low speed ends [m/s].
    by_name : mapping of str to Limit
    """

    standard: str
    reference: str
    span: float
    radius: float
    low_speed: float
    by_name: Mapping[str, Limit]

    def flight(self, airspeed: float, scale: Scale) -> str:
        """Whether an airspeed [m/s] is "low_speed" or "forward"; speeds scale as the square root of a length."""
        return LOW_SPEED if abs(airspeed) * scale.speed_up <= self.low_speed else FORWARD

    def find(self, name: str, flight: str) -> Limit | None:
        """Boundary of a quality in a kind of flight, if there is one."""
        for key in (name, f"{name}_{flight}"):
            if key in self.by_name and self.by_name[key].flight in (flight, ANY):
                return self.by_name[key]
        return None


@cache
def limits() -> Limits:
    """The boundaries of config/flying_qualities.yaml."""
    read = read_yaml(config_folder() / FILE)
    found = {
        name: Limit(
            name,
            entry["kind"],
            entry["paragraph"],
            entry["flight"],
            tuple(entry["levels"]),
            " ".join(read["sources"][entry["source"]].split()),
            entry["read_from_standard"],
            " ".join(entry["remark"].split()),
            " ".join(read["sources"][entry["checked"]].split()) if "checked" in entry else "",
            entry.get("remembered", True),
        )
        for name, entry in read["limits"].items()
    }
    own = read["reference"]
    return Limits(
        " ".join(read["standard"].split()),
        own["aircraft"],
        own["lateral_span"],
        own["rotor_radius"],
        own["low_speed"],
        found,
    )


@dataclass(frozen=True)
class Scale:
    """Froude scaling to full size.

    Attributes
    ----------
    name : str
        What the lengths are of.
    length, reference : float
        Of the aircraft and at full size [m].
    """

    name: str
    length: float
    reference: float

    @property
    def speed_up(self) -> float:
        """Frequencies of the aircraft over those of full size, sqrt(reference / length); times are its inverse."""
        return math.sqrt(self.reference / self.length)

    @property
    def text(self) -> str:
        """What is compared, with the factor."""
        return f"{self.name} {self.length:.4g} m for {self.reference:.4g} m: frequencies x {self.speed_up:.3g}"


def scales(aircraft: Aircraft, scale_length: float | None = None) -> tuple[Scale, ...]:
    """Scales by which an aircraft is judged: by its lateral span, and by rotor radius where that is another one.

    Parameters
    ----------
    aircraft : Aircraft
    scale_length : float, optional
        That stands for the lateral span of the UH-60A [m], 0.01 to 1000; then it is the only scale.

    Raises
    ------
    LinearizationError
        A length out of range.
    """
    known = limits()
    if scale_length is not None:
        length = checks.number("scale_length", scale_length, *LENGTHS, "m", LinearizationError)
        return (Scale("length", length, known.span),)
    span = Scale("lateral span", aircraft.rotor_span, known.span)
    radius = Scale("rotor radius", max(rotor.radius for rotor in aircraft.rotors), known.radius)
    return (span,) if abs(span.speed_up / radius.speed_up - 1.0) < ALIKE else (span, radius)
