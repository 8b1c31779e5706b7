"""Signals of a flight by name at equal intervals, for the identification of what is between them."""

from __future__ import annotations  # `help` then shows types by their names

from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sbs_sim import checks
from sbs_sim.aircraft import Aircraft
from sbs_sim.content import ByContent
from sbs_sim.errors import IdentificationError
from sbs_sim.flight.excitation import Excitation
from sbs_sim.flight.history import History

Array = NDArray[np.float64]

EXCITATION = "excitation_"  # begins the names of what is added to the controls
EVEN = 1e-6  # of an interval, by which samples may be off
MIN_SAMPLES = 64


@dataclass(frozen=True, eq=False)
class Signals(ByContent):
    """Signals at equal intervals.

    Attributes
    ----------
    tick : float
        Between samples [s].
    values : mapping of str to ndarray, shape (n,)
        By name, in SI units and radians.
    units : mapping of str to str
        By name.
    held : frozenset of str
        Names of signals that keep each value until the next sample, as controls do; the others are sampled.
    begin : float
        Time of the first sample [s].

    Raises
    ------
    IdentificationError
        Fewer than 64 samples, signals of unequal lengths, values that are not finite.
    """

    tick: float
    values: Mapping[str, Array]
    units: Mapping[str, str]
    held: frozenset[str] = frozenset()
    begin: float = 0.0

    def __post_init__(self) -> None:
        checks.number("tick", self.tick, 1e-6, 1e3, "s", IdentificationError)
        lengths = sorted({len(values) for values in self.values.values()})
        if len(lengths) != 1 or lengths[0] < MIN_SAMPLES:
            raise IdentificationError(
                f"signals of {', '.join(map(str, lengths)) or 'no'} samples: allowed are equal numbers of at"
                f" least {MIN_SAMPLES}"
            )
        for name, values in self.values.items():
            if not np.isfinite(values).all():
                first = self.begin + self.tick * int(np.flatnonzero(~np.isfinite(values))[0])
                raise IdentificationError(f"{name} at {first:g} s: allowed are finite numbers")

    @property
    def duration(self) -> float:
        """Of the record [s]."""
        return self.tick * len(next(iter(self.values.values())))

    @property
    def excitations(self) -> tuple[str, ...]:
        """Names of what was added to the controls."""
        return tuple(name for name in self.values if name.startswith(EXCITATION))

    @property
    def moving_controls(self) -> tuple[str, ...]:
        """Names of held signals that move, without excitations."""
        return tuple(
            name
            for name, values in self.values.items()
            if name in self.held and not name.startswith(EXCITATION) and np.ptp(values) > 0.0
        )

    def rows(self, names: Collection[str]) -> Array:
        """Some of the signals, shape (len(names), n).

        Raises
        ------
        IdentificationError
            A name that is not there.
        """
        for name in names:
            checks.choice("signal", name, tuple(self.values), IdentificationError)
        return np.array([self.values[name] for name in names]).reshape(len(names), -1)

    def between(self, begin: float | None = None, end: float | None = None) -> Signals:
        """Signals from one time to another [s]; the ends of the record where they are not given.

        Raises
        ------
        IdentificationError
            Times that are not in the record in this order.
        """
        last = self.begin + self.duration
        begin = self.begin if begin is None else begin
        end = last if end is None else end
        if not self.begin - EVEN <= begin < end <= last + self.tick:
            raise IdentificationError(f"from {begin:g} to {end:g} s: allowed are {self.begin:g} to {last:g} s")
        first, stop = (round((time - self.begin) / self.tick) for time in (begin, end))
        cut = {name: values[first:stop] for name, values in self.values.items()}
        return Signals(self.tick, cut, self.units, self.held, self.begin + first * self.tick)

    @classmethod
    def of(cls, aircraft: Aircraft, flown: History, excitation: Excitation | None = None) -> Signals:
        """Signals of a flight in the library: outputs as linear models name them, controls, and excitations.

        Controls are what the swashplates had, with the delays, ranges and rates that were between them and a pilot.

        Parameters
        ----------
        aircraft : Aircraft
        flown : History
            Of `simulate` or `simulate_with_pilot`.
        excitation : Excitation, optional
            What was added to the controls.

        Raises
        ------
        IdentificationError
            See the class.
        """
        values, units = flown_outputs(aircraft, flown)
        for control, row in zip(aircraft.controls, unmixed(aircraft, flown["swashplate"]).T, strict=True):
            values[control.name], units[control.name] = row, control.unit
        held = set(aircraft.control_names)
        if excitation is not None:
            added = excitation.history(flown["time"])
            for name in excitation.control_names:
                i = aircraft.control_names.index(name)
                values[EXCITATION + name], units[EXCITATION + name] = added[:, i], aircraft.controls[i].unit
                held.add(EXCITATION + name)
        return cls(interval(flown["time"]), values, units, frozenset(held), float(flown["time"][0]))


def unmixed(aircraft: Aircraft, swashplates: Array) -> Array:
    """Pilot controls, shape (n, n_controls), of swashplate angles [rad], shape (n, n_rows, 3).

    Held ones are among them, unless several controls move the same: then they keep what the aircraft file has.
    """
    departures = swashplates - aircraft.mix(np.zeros(len(aircraft.controls)))
    found, _, rank, _ = np.linalg.lstsq(aircraft.mixing, departures.reshape(len(departures), -1).T, rcond=None)
    if rank == len(aircraft.controls):
        return np.asarray(found.T, np.float64)
    new = np.any(swashplates[1:] != swashplates[:-1], axis=(1, 2))
    first = np.concatenate([[0], np.flatnonzero(new) + 1])
    which = np.concatenate([[0], np.cumsum(new)])
    return np.array([aircraft.unmix(swashplates[i]) for i in first])[which]


def interval(time: Array) -> float:
    """Interval between samples [s].

    Raises
    ------
    IdentificationError
        It is not the same everywhere.
    """
    if len(time) < MIN_SAMPLES:
        raise IdentificationError(f"{len(time)} samples: allowed are at least {MIN_SAMPLES}")
    steps = np.diff(time)
    tick = float((time[-1] - time[0]) / (len(time) - 1))
    uneven = np.flatnonzero(~(np.abs(steps - tick) <= 1e-3 * tick))
    if len(uneven):
        i = int(uneven[0])
        raise IdentificationError(
            f"samples {steps[i]:.6g} s apart at {time[i]:g} s: allowed are equal intervals, here of {tick:.6g} s"
        )
    return tick


def flown_outputs(aircraft: Aircraft, flown: Mapping[str, Array]) -> tuple[dict[str, Array], dict[str, str]]:
    """Outputs of a flight by the names of linear models, and their units.

    Parameters
    ----------
    aircraft : Aircraft
    flown : mapping of str to ndarray
        What `simulate` gives; what needs "acceleration", "thrust", "torque" or "power" is left out without it.
    """
    units = dict(zip(aircraft.layout.linear_names, aircraft.layout.linear_units, strict=True))
    values = {name: np.asarray(flown[name]) for name in units}
    values["psi"], units["psi"] = np.unwrap(flown["psi"]), "rad"
    values["climb_rate"], units["climb_rate"] = _climb_rate(flown), "m/s"
    if "acceleration" in flown:
        for i, axis in enumerate("xyz"):
            name = f"specific_force_{axis}"
            values[name], units[name] = flown["acceleration"][:, i] - _gravity(aircraft, flown)[i], "m/s^2"
    for quantity, unit in (("thrust", "N"), ("torque", "N m"), ("power", "W")):
        for j in range(len(aircraft.rotors) if quantity in flown else 0):
            name = f"{quantity}({j + 1})"
            values[name], units[name] = flown[quantity][:, j], unit
    return values, units


def _climb_rate(flown: Mapping[str, Array]) -> Array:
    """Vertical velocity, up [m/s], shape (n,)."""
    theta, phi = flown["theta"], flown["phi"]
    sideways = flown["v"] * np.sin(phi) + flown["w"] * np.cos(phi)
    return np.asarray(flown["u"] * np.sin(theta) - sideways * np.cos(theta))


def _gravity(aircraft: Aircraft, flown: Mapping[str, Array]) -> Array:
    """Gravity in body axes [m/s^2], shape (3, n)."""
    theta, phi = flown["theta"], flown["phi"]
    return aircraft.environment.gravity * np.array(
        [-np.sin(theta), np.cos(theta) * np.sin(phi), np.cos(theta) * np.cos(phi)]
    )
