"""Frequency responses from multisines: by whole periods, at the frequencies that they have (theory.md section 9.16).

R. Pintelon, J. Schoukens, System Identification: A Frequency Domain Approach, 2nd edition, Wiley/IEEE, 2012, chapters 2
and 3.
"""

from __future__ import annotations  # `help` then shows types by their names

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sbs_sim import checks
from sbs_sim.analysis.frequency_response import FrequencyResponse
from sbs_sim.analysis.identification import (
    DIRECT,
    JOINT,
    LEAST_COHERENCE,
    IdentifiedResponse,
    checked_names,
    continuous,
    hold_factors,
    without_trend,
)
from sbs_sim.analysis.spectra import TURN
from sbs_sim.content import ByContent
from sbs_sim.errors import IdentificationError
from sbs_sim.flight.signals import Signals

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
IntArray = NDArray[np.int64]

EVEN = 1e-3  # of a tick, by which a period may not be whole ticks
EXCITED = 0.1  # of the largest line of a reference: lines that count
ORTHOGONAL = 0.05  # of a line of one reference, that others may have there
ALIKE = 0.12  # of the size of the references, by which a period may differ from one in the middle
LEAST_PERIODS = 2
NEIGHBOURS = 2  # lines on each side over which the scatter is averaged


@dataclass(frozen=True, eq=False)
class _Column(ByContent):
    """What one reference does at its lines: outputs and inputs over it, and the scatter of their means.

    Attributes
    ----------
    lines : ndarray of int, shape (l,)
        Multiples of one over the period.
    response : ndarray of complex, shape (l, s)
        Of all signals.
    scatter : ndarray of complex, shape (l, s, s)
        Covariances of their means over the periods.
    """

    lines: IntArray
    response: ComplexArray
    scatter: ComplexArray

    def at(self, lines: IntArray) -> tuple[ComplexArray, ComplexArray]:
        """Responses and scatter at lines between the own ones."""
        if len(self.lines) == 1:
            return np.repeat(self.response, len(lines), 0), np.repeat(self.scatter, len(lines), 0)
        right = np.clip(np.searchsorted(self.lines, lines), 1, len(self.lines) - 1)
        left = right - 1
        share = np.clip((lines - self.lines[left]) / (self.lines[right] - self.lines[left]), 0.0, 1.0)
        return _mixed(self.response, left, right, share), _mixed(self.scatter, left, right, share)


def _mixed(values: ComplexArray, left: IntArray, right: IntArray, share: Array) -> ComplexArray:
    share = share.reshape(-1, *(1,) * (values.ndim - 1))
    return np.asarray((1.0 - share) * values[left] + share * values[right])


def identify_periods(
    signals: Signals, inputs: Sequence[str], outputs: Sequence[str], period: float, *, references: Sequence[str] = ()
) -> dict[tuple[str, str], IdentifiedResponse]:
    """Frequency responses of outputs to inputs under multisines, at the harmonics of each input.

    Whole periods have no leakage, and the scatter from one to the next is the random error. The first period is left
    out, and periods in which the excitation is not the same, as where it fades. Each response comes at the
    frequencies of the reference of its input; what other references do there is interpolated between theirs, and
    frequencies that are not between theirs are left out.

    Parameters
    ----------
    signals : Signals
    inputs, outputs : sequence of str
        Names of signals.
    period : float
        Of the multisines [s]: a multiple of the interval of the samples.
    references : sequence of str
        Excitations of the inputs in their order; none: inputs that no controller moves.

    Returns
    -------
    dict of (str, str) to IdentifiedResponse
        By input and output.

    Raises
    ------
    IdentificationError
        An unknown name, another period, fewer than two whole periods, references that share frequencies.
    """
    checks.instance("signals", signals, Signals, IdentificationError)
    names = checked_names(signals, inputs, outputs, references)
    causes = tuple(references) or tuple(inputs)
    periods = _periods(signals, causes, period)
    found = np.fft.rfft(_rows(signals, names, periods))
    columns = _columns(found, [names.index(name) for name in causes], causes)
    count, own_period = len(found), len(periods[0]) * signals.tick
    low, high = max(own.lines[0] for own in columns), min(own.lines[-1] for own in columns)
    result = {}
    for j, name in enumerate(inputs):
        lines = columns[j].lines
        lines = lines[(lines >= low) & (lines <= high)]
        at = TURN * lines / own_period
        held = hold_factors(signals, inputs, at)
        there = [column.at(lines) for column in columns]
        for output in outputs:
            chosen = [names.index(output), *(names.index(own) for own in inputs)]
            response, variance = _solved(there, chosen, held, j)
            result[name, output] = _record(
                signals, (name, output), at, response, variance, count, own_period, inputs, bool(references)
            )
    return result


def _periods(signals: Signals, causes: Sequence[str], period: float) -> list[IntArray]:
    """Samples of the periods that count."""
    period = checks.number("period", period, 16.0 * signals.tick, signals.duration / 2.0, "s", IdentificationError)
    count = round(period / signals.tick)
    if abs(count * signals.tick - period) > EVEN * signals.tick:
        raise IdentificationError(f"period = {period:g} s: allowed are multiples of {signals.tick:g} s")
    rows = signals.rows(causes)
    moved = np.flatnonzero(np.any(rows != rows[:, :1], axis=0))
    first = int(moved[0]) - 1 + count  # one period for the motion at the begin to die away
    begins = range(first, rows.shape[1] - count + 1, count)
    every = [np.arange(begin, begin + count) for begin in begins]
    if len(every) >= LEAST_PERIODS:
        typical = rows[:, every[len(every) // 2 if len(every) > 2 else 0]]
        size = float(np.square(typical - typical.mean(axis=1, keepdims=True)).sum())
        every = [own for own in every if float(np.square(rows[:, own] - typical).sum()) <= ALIKE**2 * size]
    if len(every) < LEAST_PERIODS:
        raise IdentificationError(
            f"period = {period:g} s: {len(every)} periods behind the first: allowed are {LEAST_PERIODS} or more"
        )
    return every


def _rows(signals: Signals, names: Sequence[str], periods: Sequence[IntArray]) -> Array:
    """Signals of each period, shape (periods, signals, samples), without the trend of them all."""
    used = without_trend(signals.rows(names)[:, periods[0][0] : periods[-1][-1] + 1])
    return np.stack([used[:, own - periods[0][0]] for own in periods])


def _columns(found: ComplexArray, causes: Sequence[int], names: Sequence[str]) -> list[_Column]:
    """What each reference does, from the Fourier transforms, shape (periods, signals, lines)."""
    mean = found.mean(axis=0)
    size = np.abs(mean[list(causes)])
    size[:, 0] = 0.0
    columns = []
    for i, cause in enumerate(causes):
        lines = np.flatnonzero(size[i] > EXCITED * size[i].max())
        others = np.delete(size, i, axis=0)[:, lines] / np.delete(size, i, axis=0).max(axis=1, keepdims=True)
        if len(others) and others.max() > ORTHOGONAL:
            raise IdentificationError(
                f"{names[i]} shares frequencies with others: allowed are orthogonal multisines, and references for"
                " inputs that a controller moves"
            )
        over = found[:, :, lines] / mean[cause, lines]
        columns.append(_Column(lines, over.mean(axis=0).T, _scatter(over)))
    return columns


def _scatter(over: ComplexArray) -> ComplexArray:
    """Covariance of the means over the periods, shape (l, s, s), averaged over neighbouring lines."""
    count = len(over)
    departures = over - over.mean(axis=0)
    own = np.einsum("pal,pbl->lab", departures, departures.conj()) / (count * (count - 1))
    padded = np.pad(own, ((NEIGHBOURS, NEIGHBOURS), (0, 0), (0, 0)), mode="edge")
    return np.asarray(sum(padded[i : i + len(own)] for i in range(2 * NEIGHBOURS + 1)) / (2 * NEIGHBOURS + 1))


def _solved(
    there: Sequence[tuple[ComplexArray, ComplexArray]], chosen: Sequence[int], held: ComplexArray, j: int
) -> tuple[ComplexArray, Array]:
    """Response to input j and its variance, shape (l,), of the first of the chosen signals to the others."""
    factors = np.concatenate([np.ones((len(held), 1)), held], axis=1)  # of the output, and of the inputs
    by_cause = np.stack([response[:, chosen] * factors for response, _ in there], axis=2)  # (l, 1 + m, causes)
    inverse = np.linalg.inv(by_cause[:, 1:])  # (l, causes, m)
    response = np.einsum("lc,lcm->lm", by_cause[:, 0], inverse)
    sides = np.concatenate([np.ones((len(response), 1)), -response], axis=1) * factors
    variance = np.zeros(len(response))
    for i, (_, scatter) in enumerate(there):
        own = scatter[:, chosen][:, :, chosen]
        left = np.einsum("la,lab,lb->l", sides, own, sides.conj()).real
        variance += np.abs(inverse[:, i, j]) ** 2 * np.maximum(left, 0.0)
    return response[:, j], variance


def _record(
    signals: Signals,
    names: tuple[str, str],
    at: Array,
    response: ComplexArray,
    variance: Array,
    count: int,
    period: float,
    inputs: Sequence[str],
    joint: bool,
) -> IdentifiedResponse:
    """Result with the coherence that gives the same random error for as many averages as periods."""
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = variance / np.abs(response) ** 2
    coherence = np.asarray(1.0 / (1.0 + count * ratio))
    name, output = names
    phase = continuous(np.angle(response), coherence >= LEAST_COHERENCE)
    units = signals.units[name], signals.units[output]
    return IdentifiedResponse(
        FrequencyResponse(at, response, phase, name, units[0], output, units[1]),
        coherence,
        coherence,
        coherence,
        np.sqrt(0.5 * ratio),
        JOINT if joint else DIRECT,
        tuple(own for own in inputs if own != name),
        (period,),
        np.full(len(at), float(count)),
    )
