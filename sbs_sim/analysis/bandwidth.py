"""Bandwidth and phase delay of an attitude, as ADS-33E-PRF, figure 4, defines them (theory.md section 9.12).

US Army Aviation and Missile Command, Aeronautical Design Standard 33E-PRF, 2000.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sbs_sim.analysis.frequency_response import Actuator, Transfer
from sbs_sim.content import ByContent
from sbs_sim.errors import LinearizationError

if TYPE_CHECKING:
    from sbs_sim.analysis.linear_model import LinearModel

Array = NDArray[np.float64]

CROSSING = -math.pi  # rad, of the neutral stability
MARGIN = math.pi / 4.0  # rad of phase to it at the phase bandwidth
GAIN_MARGIN = 10.0 ** (6.0 / 20.0)  # of the gain bandwidth: 6 dB
POINTS = 800  # of the search
LOWEST, WIDEST = 0.01, 3.0  # of the search over the slowest and fastest pole of the body
HIGHEST = 3.0  # over the fastest pole of all
STILL = 1e-9  # of the fastest pole of the body: what rounding makes of an integrator


@dataclass(frozen=True, eq=False)
class Bandwidth(ByContent):
    """Bandwidth of the response of an attitude or rate to a control.

    Attributes
    ----------
    input_name, output_name : str
    sign : int
        1 if more of the control raises the output at once, -1 if it lowers it; the phase is that of sign times output.
    crossing : float
        Frequency omega_180 at which the phase falls through -180 deg [rad/s]; not a number where it does not.
    phase_bandwidth : float
        Frequency at which the phase falls through -135 deg [rad/s]; not a number where it is never above.
    gain_bandwidth : float
        Highest frequency below the crossing at which the gain is 6 dB above that at the crossing [rad/s].
    phase_delay : float
        Fall of the phase from omega_180 to twice that, over twice omega_180 [s].
    highest_phase : float
        Of the phases above the growing modes of the body [rad].
    is_rate_command : bool
        Says which bandwidth counts: for rate responses the lower of both, for attitude responses that of the phase.
    """

    input_name: str
    output_name: str
    sign: int
    crossing: float
    phase_bandwidth: float
    gain_bandwidth: float
    phase_delay: float
    highest_phase: float
    is_rate_command: bool

    @property
    def bandwidth(self) -> float:
        """What counts [rad/s]; not a number if there is none."""
        if not self.is_rate_command or math.isnan(self.phase_bandwidth) or math.isnan(self.crossing):
            return self.phase_bandwidth
        return min(self.phase_bandwidth, self.gain_bandwidth) if self.gain_bandwidth > 0.0 else math.nan

    @property
    def remark(self) -> str:
        """Why there is no bandwidth or no phase delay; empty if there are both."""
        highest = f"the phase is {math.degrees(self.highest_phase):.0f} deg at most"
        if math.isnan(self.phase_bandwidth):
            return f"no bandwidth: {highest}, never above -135 deg"
        if math.isnan(self.crossing):
            return "no phase delay: the phase does not fall to -180 deg"
        if math.isnan(self.bandwidth):
            return "no bandwidth: the gain is nowhere 6 dB above that where the phase is -180 deg"
        if self.is_rate_command and self.gain_bandwidth < self.phase_bandwidth:
            return "limited by the gain: a pilot who uses it all comes close to an oscillation of his own making"
        return ""


def bandwidth(
    model: LinearModel,
    input_name: str,
    output_name: str,
    delay: float = 0.0,
    is_rate_command: bool = True,
    actuator: Actuator | None = None,
) -> Bandwidth:
    """Bandwidth and phase delay of a linear model.

    Parameters
    ----------
    model : LinearModel
    input_name, output_name : str
        A control, and the attitude that it commands ("theta", "phi"); see `frequency_response`.
    delay : float
        Of sensors, computers and the like [s].
    is_rate_command : bool
        The aircraft answers to a step by a rate, as without augmentation; else by an attitude.
    actuator : Actuator, optional
        Between the control and the model.

    Returns
    -------
    Bandwidth

    Raises
    ------
    LinearizationError
        A name that the model does not have, a delay out of range, or an output that the control does not move.
    """
    transfer = Transfer.of(model, input_name, output_name, delay, actuator)
    return bandwidth_of(transfer, input_name, output_name, is_rate_command)


def bandwidth_of(transfer: Transfer, input_name: str, output_name: str, is_rate_command: bool = True) -> Bandwidth:
    """Bandwidth and phase delay of a transfer function; see `bandwidth`."""
    grid, top = _search(transfer)
    if not np.abs(transfer.at(grid)).max() > 0.0:
        raise LinearizationError(f"{output_name}: {input_name} does not move it")
    offset = -math.pi if transfer.starts_down else 0.0
    phase = transfer.phase(grid) + offset

    def phase_at(frequency: float) -> float:
        """Beside the nearest frequency of the grid, from which the phase turns by less than half a turn."""
        near = int(np.abs(grid - frequency).argmin())
        here, there = transfer.at(np.array([frequency, grid[near]]))
        return float(phase[near] + np.angle(here / there))

    def falls_through(level: float, end: int) -> float:
        """Highest frequency of a part of the grid at which the phase falls through a level."""
        falls = np.flatnonzero((phase[:end] > level) & (phase[1 : end + 1] <= level))
        return _root(phase_at, level, grid[falls[-1]], grid[falls[-1] + 1]) if len(falls) else math.nan

    beyond = np.flatnonzero(phase[top:] <= CROSSING)
    is_above = phase[top] > CROSSING
    end = len(grid) - 1 if is_above and not len(beyond) else top + int(beyond[0]) if is_above else top
    crossing = falls_through(CROSSING, end)
    below = end if math.isnan(crossing) else min(end, int(np.searchsorted(grid, crossing)))
    return Bandwidth(
        input_name,
        output_name,
        -1 if transfer.starts_down else 1,
        crossing,
        falls_through(CROSSING + MARGIN, below),
        math.nan if math.isnan(crossing) else _gain_bandwidth(transfer, grid, crossing),
        math.nan
        if math.isnan(crossing)
        else (CROSSING - offset - float(transfer.phase(np.array([2.0 * crossing]))[0])) / (2.0 * crossing),
        float(phase[: top + 1].max()),
        is_rate_command,
    )


def _search(transfer: Transfer) -> tuple[Array, int]:
    """Frequencies of the search, and how many of them are those of the body."""
    of_body = transfer.poles if transfer.settled is None else transfer.settled.poles
    speeds = np.abs(of_body)
    moving = speeds > STILL * speeds.max()  # else an integrator
    growing = speeds[(of_body.real > 0.0) & moving]
    slowest = float(growing.max()) if len(growing) else LOWEST * float(speeds[moving].min())
    fastest = WIDEST * float(speeds.max())
    last = max(HIGHEST * float(np.abs(transfer.poles).max()), fastest)
    if transfer.delay > 0.0:  # which alone turns the phase by half a turn
        turned = math.pi / transfer.delay
        slowest = slowest if len(growing) else min(slowest, LOWEST * turned)
        fastest, last = max(fastest, turned), max(last, HIGHEST * turned)
    if transfer.actuator is not None:
        fastest, last = max(fastest, transfer.actuator.frequency), max(last, HIGHEST * transfer.actuator.frequency)
    grid = np.geomspace(slowest, last, POINTS)
    return grid, min(int(np.searchsorted(grid, fastest)), POINTS - 2)


def _root(function: Callable[[float], float], level: float, low: float, high: float) -> float:
    """Frequency between two at which a function has a value."""
    from scipy.optimize import brentq  # here: it takes a quarter of a second, and few need it

    return float(brentq(lambda frequency: function(frequency) - level, low, high, xtol=1e-12, rtol=1e-12))


def _gain_bandwidth(transfer: Transfer, grid: Array, crossing: float) -> float:
    """Highest frequency below the crossing at which the gain is 6 dB above that there; not a number without any."""

    def gain_at(frequency: float) -> float:
        return float(abs(transfer.at(np.array([frequency]))[0]))

    level = GAIN_MARGIN * gain_at(crossing)
    below = grid[grid < crossing]
    above = np.flatnonzero(np.abs(transfer.at(below)) >= level)
    if not len(above):
        return math.nan
    last = above[-1]
    return _root(gain_at, level, below[last], below[last + 1] if last + 1 < len(below) else crossing)
