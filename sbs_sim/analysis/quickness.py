"""Attitude quickness: how fast moderate changes of an attitude can be made (theory.md section 9.18).

The largest rate on the way over the largest change of the attitude, by the smallest change afterwards, as ADS-33E-PRF
defines them. Here by a linear model: gravity stays where it is in the trim, and controls go as far as their ranges.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sbs_sim.content import ByContent

Array = NDArray[np.float64]

STILL = 0.05  # of the largest rate: there the attitude is reached
SHORTEST, LONGEST, PULSES = 0.02, 0.5, 24  # of pulses over the time that is looked at


@dataclass(frozen=True, eq=False)
class Quickness(ByContent):
    """Quickness over the change of an attitude.

    Attributes
    ----------
    changes : ndarray, shape (n,)
        Smallest change after the first peak, rising [rad].
    values : ndarray, shape (n,)
        Largest rate over largest change [1/s].
    """

    changes: Array
    values: Array

    @property
    def reach(self) -> float:
        """Largest change [rad]; 0 without any."""
        return float(self.changes[-1]) if len(self.changes) else 0.0

    def at(self, change: float) -> float:
        """Quickness of a change [rad], the nearest known beyond both ends; not a number without any."""
        return float(np.interp(change, self.changes, self.values)) if len(self.changes) else math.nan


def of_pulses(attitude: Array, rate: Array, room: float) -> Quickness:
    """Of an aircraft that answers to a step of a control with a rate: pulses with all of the control, of many lengths.

    An attitude is reached where the rate has fallen to a twentieth of its peak, or turns; a pilot holds it from there.

    Parameters
    ----------
    attitude, rate : ndarray, shape (n,)
        After a unit step, at equal steps of time.
    room : float
        Of the control, from its trim to the nearer end of its range.
    """
    count = len(rate) - 1
    lengths = np.unique(np.geomspace(SHORTEST * count, LONGEST * count, PULSES).astype(int))
    found = []
    for length in lengths[lengths > 0]:
        turned, turning = (room * (own - np.concatenate([np.zeros(length), own[:-length]])) for own in (attitude, rate))
        sign = math.copysign(1.0, turning[np.abs(turning).argmax()])
        turned, turning = sign * turned, sign * turning
        peak = float(turning.max())
        begin = max(int(length), int(turning.argmax()))
        after = np.flatnonzero(turning[begin:] <= STILL * peak)
        if peak > 0.0 and len(after) and turned[begin + after[0]] > 0.0:
            change = float(turned[: begin + after[0] + 1].max())
            found.append((change, peak / change))
    return _sorted(found)


def of_step(attitude: Array, rate: Array, room: float) -> Quickness:
    """Of an aircraft that answers to a step of a command with an attitude; the same for all changes.

    Parameters
    ----------
    attitude, rate : ndarray, shape (n,)
        After a unit step, at equal steps of time.
    room : float
        Largest command at which no control reaches the end of its range.
    """
    sign = math.copysign(1.0, attitude[-1])
    turned, turning = sign * attitude, sign * rate
    fastest = int(turning.argmax())
    still = np.flatnonzero(turning[fastest:] <= 0.0)
    first = fastest + int(still[0]) if len(still) else len(turned) - 1
    peak, left = float(turned[first]), float(turned[first:].min())
    if not (peak > 0.0 and left > 0.0 and math.isfinite(room)):
        return _sorted([])
    value = float(turning[: first + 1].max()) / peak
    return _sorted([(1e-3 * room * left, value), (room * left, value)])


def _sorted(found: list[tuple[float, float]]) -> Quickness:
    pairs = np.array(sorted(found)).reshape(-1, 2)
    return Quickness(pairs[:, 0], pairs[:, 1])
