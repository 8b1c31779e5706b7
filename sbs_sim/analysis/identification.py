"""Frequency responses identified from flights: gain and phase with coherence and random error (theory.md section 9.16).

M. B. Tischler, R. K. Remple, Aircraft and Rotorcraft System Identification, 2nd edition, AIAA, 2012, chapters 7 to 10.
J. S. Bendat, A. G. Piersol, Random Data, 4th edition, Wiley, 2010, chapters 7 and 9.
H. Akaike, Some problems in the application of the cross-spectral method, in: Spectral Analysis of Time Series, 1967
(bias under feedback).
"""

from __future__ import annotations  # `help` then shows types by their names

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sbs_sim import checks
from sbs_sim.analysis.frequency_response import FREQUENCIES, FrequencyResponse
from sbs_sim.analysis.spectra import CHIRP_Z, METHODS, TURN, Spectra, merged, spectra, windows_of
from sbs_sim.content import ByContent
from sbs_sim.errors import IdentificationError
from sbs_sim.flight.signals import Signals

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
BoolArray = NDArray[np.bool_]

DIRECT, JOINT = "direct", "joint"
LEAST_COHERENCE = 0.6  # of a frequency at which a response is valid (Tischler and Remple, section 7.5)
WEIGHT_POWER = 4.0  # of the random error, by which windows are weighted
POINTS = 60  # frequencies, if none are asked for
HIGHEST = 0.4  # of half the sampling rate: frequencies beyond are not tried
MAX_WINDOWS, MAX_SIGNALS = 20, 20
SINGULAR = 1e-10  # of spectral matrices: inputs that move alike
DECIBEL = 20.0 / math.log(10.0)


@dataclass(frozen=True, eq=False)
class IdentifiedResponse(ByContent):
    """Response of an output to an input, identified from a flight.

    Attributes
    ----------
    response : FrequencyResponse
        Its phase is continuous over the valid frequencies.
    coherence : ndarray, shape (f,)
        Share of the output's power at each frequency that the input explains once what other inputs explain has been
        taken away: the partial coherence, 0 to 1. With excitations as instruments the one that gives the same random
        error.
    ordinary_coherence : ndarray, shape (f,)
        Of input and output, without regard to other inputs.
    multiple_coherence : ndarray, shape (f,)
        Share of the output's power that all inputs together explain.
    random_error : ndarray, shape (f,)
        Standard deviation of the gain over the gain, which is that of the phase in radians.
    method : str
        "direct": by the input; "joint": by the excitation, joint input-output.
    conditioned_on : tuple of str
        The other inputs, whose effects are taken away.
    windows : tuple of float
        Lengths of the segments, the longest first [s].
    averages : ndarray, shape (f,)
        Independent segments.
    """

    response: FrequencyResponse
    coherence: Array
    ordinary_coherence: Array
    multiple_coherence: Array
    random_error: Array
    method: str
    conditioned_on: tuple[str, ...]
    windows: tuple[float, ...]
    averages: Array

    @property
    def frequencies(self) -> Array:
        """[rad/s], shape (f,)."""
        return self.response.frequencies

    @property
    def valid(self) -> BoolArray:
        """Where the coherence is at least 0.6, shape (f,)."""
        return np.asarray(self.coherence >= LEAST_COHERENCE)  # false for a NaN

    @property
    def valid_range(self) -> tuple[float, float] | None:
        """Ends of the widest range of successive valid frequencies, in octaves [rad/s]; None without any."""
        run = self._longest_run()
        return None if run is None else (float(self.frequencies[run[0]]), float(self.frequencies[run[1]]))

    def _longest_run(self) -> tuple[int, int] | None:
        edges = np.flatnonzero(np.diff(np.concatenate([[False], self.valid, [False]]).astype(int)))
        runs = [(int(first), int(stop) - 1) for first, stop in zip(edges[::2], edges[1::2], strict=True)]
        return max(runs, key=lambda run: self.frequencies[run[1]] / self.frequencies[run[0]], default=None)

    @property
    def gain_error_db(self) -> Array:
        """Random error of the gain [dB], shape (f,)."""
        return np.asarray(DECIBEL * self.random_error)

    @property
    def phase_error_deg(self) -> Array:
        """Random error of the phase [deg], shape (f,)."""
        return np.degrees(self.random_error)

    def departure(self, other: FrequencyResponse) -> tuple[Array, Array]:
        """Gain [dB] and phase [deg], within half a turn, beyond those of a response at the same frequencies."""
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = self.response.response / other.response
            return np.asarray(DECIBEL * np.log(np.abs(ratio))), np.degrees(np.angle(ratio))

    def to_dict(self) -> dict[str, Any]:
        """Names, units and numbers as plain lists for JSON: gains in SI units, phases in rad."""
        return {
            **self.response.to_dict(),
            "coherence": self.coherence.tolist(),
            "ordinary_coherence": self.ordinary_coherence.tolist(),
            "multiple_coherence": self.multiple_coherence.tolist(),
            "random_error": self.random_error.tolist(),
            "averages": self.averages.tolist(),
            "method": self.method,
            "conditioned_on": list(self.conditioned_on),
            "windows": list(self.windows),
        }


def identify(
    signals: Signals,
    inputs: Sequence[str],
    outputs: Sequence[str],
    *,
    references: Sequence[str] = (),
    frequencies: Any = None,
    windows: Sequence[float] | None = None,
    method: str = CHIRP_Z,
) -> dict[tuple[str, str], IdentifiedResponse]:
    """Frequency responses of outputs to inputs.

    All inputs are taken together: each response is that to one input with the others held, whether they move with it
    or not. In a flight with a controller in the loop the inputs move with the noise of the outputs, too, and responses
    by the inputs alone are biased towards minus the inverse of the controller: name the excitations as `references`.

    Parameters
    ----------
    signals : Signals
    inputs, outputs : sequence of str
        Names of signals.
    references : sequence of str
        What was added to the inputs, as many as there are inputs, in any order; none: inputs without feedback.
    frequencies : array_like, optional
        Rising [rad/s]; by default 60 from two cycles in the longest window to 0.4 of half the sampling rate.
    windows : sequence of float, optional
        Lengths of segments [s], whose results are merged at each frequency by their random errors; by default five.
    method : str
        "chirp_z" or "welch".

    Returns
    -------
    dict of (str, str) to IdentifiedResponse
        By input and output.

    Raises
    ------
    IdentificationError
        An unknown name, values out of range, windows that leave too few averages, inputs that do not move or move
        alike.
    """
    checks.instance("signals", signals, Signals, IdentificationError)
    checks.choice("method", method, METHODS, IdentificationError)
    names = checked_names(signals, inputs, outputs, references)
    lengths = _checked_windows(signals, windows, frequencies)
    asked = _checked_frequencies(signals, lengths, frequencies)
    rows = without_trend(signals.rows(names))
    scale = np.array([max(float(np.abs(row).max()), 1e-300) for row in rows])
    every = [spectra(rows / scale[:, None], signals.tick, asked, length, method) for length in lengths]
    factors = hold_factors(signals, names, asked)
    held = factors.conj()[:, :, None] * factors[:, None, :]
    every = [Spectra(one.frequencies, held * one.matrices, one.averages, one.window) for one in every]
    found = {}
    for output in outputs:
        chosen = [names.index(name) for name in (*inputs, *references, output)]
        parts = [_Estimate(one, chosen, len(inputs), bool(references)) for one in every]
        ratio = scale[names.index(output)] / scale[[names.index(name) for name in inputs]]
        for j, name in enumerate(inputs):
            found[name, output] = _composite(signals, parts, every, chosen, j, ratio[j], (*inputs, output))
    return found


def usual_range(signals: Signals) -> tuple[float, float]:
    """Lowest and highest frequency if none are asked for [rad/s]: two cycles in a window to 0.4 of half the rate."""
    return 2.0 * TURN / _checked_windows(signals, None, None)[0], _highest(signals)


def checked_names(
    signals: Signals, inputs: Sequence[str], outputs: Sequence[str], references: Sequence[str]
) -> tuple[str, ...]:
    """All names of signals, each once; IdentificationError if one is unknown, or does not move but should."""
    for role, names in (("inputs", inputs), ("outputs", outputs), ("references", references)):
        for name in names:
            checks.choice(role, name, tuple(signals.values), IdentificationError)
        if len(set(names)) != len(names) or (not names and role != "references") or len(names) > MAX_SIGNALS:
            raise IdentificationError(f"{role}: allowed are 1 to {MAX_SIGNALS} different names")
    if references and len(references) != len(inputs):
        raise IdentificationError(
            f"references: {len(references)} for {len(inputs)} inputs: allowed is one for each input, or none"
        )
    for name in (*inputs, *references):
        if not np.ptp(signals.values[name]) > 0.0:
            raise IdentificationError(f"{name} does not move: allowed are inputs that were excited")
    return tuple(dict.fromkeys((*inputs, *references, *outputs)))


def _checked_windows(signals: Signals, windows: Sequence[float] | None, frequencies: Any) -> tuple[float, ...]:
    """Lengths of the segments, the longest first."""
    if windows is None:
        asked = None if frequencies is None else np.ravel(frequencies)
        low, high = (TURN / signals.duration, _highest(signals)) if asked is None else (asked[0], asked[-1])
        return windows_of(signals.duration, max(float(low), 1e-9), max(float(high), 1e-9))
    lengths = np.ravel(checks.array("windows", windows, IdentificationError))
    if not 1 <= len(lengths) <= MAX_WINDOWS:
        raise IdentificationError(f"windows: {len(lengths)}: allowed are 1 to {MAX_WINDOWS}")
    for length in lengths.tolist():
        checks.number("windows", length, 16.0 * signals.tick, signals.duration / 1.5, "s", IdentificationError)
    return tuple(sorted(lengths.tolist(), reverse=True))


def _highest(signals: Signals) -> float:
    return HIGHEST * math.pi / signals.tick


def _checked_frequencies(signals: Signals, lengths: Sequence[float], frequencies: Any) -> Array:
    if frequencies is None:
        return np.geomspace(2.0 * TURN / lengths[0], _highest(signals), POINTS)
    asked = np.atleast_1d(checks.array("frequencies", frequencies, IdentificationError))
    for value in asked.ravel().tolist():
        checks.number("frequencies", value, FREQUENCIES[0], math.pi / signals.tick, "rad/s", IdentificationError)
    if asked.ndim != 1 or not len(asked) or not (np.diff(asked) > 0.0).all():
        raise IdentificationError("frequencies: allowed are one or more rising numbers")
    return asked


def without_trend(rows: Array) -> Array:
    """Signals without their means and linear trends."""
    time = np.linspace(-1.0, 1.0, rows.shape[1])
    slopes = (rows @ time) / (time @ time)
    return np.asarray(rows - rows.mean(axis=1, keepdims=True) - slopes[:, None] * time)


def hold_factors(signals: Signals, names: Sequence[str], frequencies: Array) -> ComplexArray:
    """Factors that turn the Fourier transforms of samples of held signals into those of what acts, shape (f, n).

    The transform of a signal that is held from sample to sample is that of its samples times
    (1 - exp(-i omega T)) / (i omega T), half a tick late; it is 1 for signals that are not held.
    """
    angle = frequencies * signals.tick
    hold = (1.0 - np.exp(-1j * angle)) / (1j * angle)
    return np.asarray(np.where([name in signals.held for name in names], hold[:, None], 1.0), np.complex128)


class _Estimate:
    """Responses of one output from one set of spectra, shape (f, inputs); see `IdentifiedResponse`."""

    def __init__(self, found: Spectra | tuple[ComplexArray, Array], chosen: Sequence[int], inputs: int, joint: bool):
        matrices, averages = (found.matrices, found.averages) if isinstance(found, Spectra) else found
        own = matrices[:, chosen][:, :, chosen]
        m = inputs
        x, y = slice(0, m), -1
        r = slice(m, 2 * m) if joint else x
        self.response = np.full((len(own), m), np.nan, complex)
        self.coherence, self.error = np.full((len(own), m), np.nan), np.full((len(own), m), np.nan)
        self.ordinary, self.multiple = np.full((len(own), m), np.nan), np.full(len(own), np.nan)
        there = np.isfinite(own).all(axis=(1, 2))
        self.averages = np.broadcast_to(np.asarray(averages, float), len(own))
        free = self.averages[there] - (m - 1)
        s = own[there]
        power = s[:, y, y].real
        inverse = _inverse(s[:, r, x])
        response = np.einsum("fij,fj->fi", inverse, s[:, r, y])
        linear = np.einsum("fi,fi->f", response, s[:, x, y].conj()).real
        modelled = np.einsum("fi,fij,fj->f", response.conj(), s[:, x, x], response).real
        noise = np.maximum(power - 2.0 * linear + modelled, 0.0)
        spread = np.einsum("fij,fjk,fik->fi", inverse, s[:, r, r], inverse.conj()).real
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = noise[:, None] * spread / np.abs(response) ** 2
            self.coherence[there] = 1.0 / (1.0 + ratio)
            self.error[there] = np.sqrt(ratio / (2.0 * np.where(free > 0.0, free, np.nan)[:, None]))
            by_input = np.einsum("fii->fi", s[:, x, x]).real
            self.ordinary[there] = np.abs(s[:, x, y]) ** 2 / (by_input * power[:, None])
            explained = np.einsum("fi,fij,fj->f", s[:, x, y].conj(), _inverse(s[:, x, x]), s[:, x, y]).real
            self.multiple[there] = np.clip(explained / power, 0.0, 1.0)
        self.response[there] = response


def _inverse(matrices: ComplexArray) -> ComplexArray:
    """Inverses of spectral matrices.

    Raises
    ------
    IdentificationError
        Inputs that cannot be distinguished at any frequency.
    """
    size = np.sqrt(np.abs(np.einsum("fii->fi", matrices)))
    size = np.where(size > 0.0, size, 1.0)
    scaled = matrices / (size[:, :, None] * size[:, None, :])
    weak = np.linalg.svd(scaled, compute_uv=False)
    singular = ~(weak[:, -1] > SINGULAR * weak[:, 0])
    if singular.all():
        raise IdentificationError("the inputs move alike, or by feedback alone: their effects cannot be distinguished")
    scaled[singular] = np.nan
    found = np.full_like(scaled, np.nan)
    found[~singular] = np.linalg.inv(scaled[~singular])
    return np.asarray(found / (size[:, :, None] * size[:, None, :]))


def _composite(
    signals: Signals,
    parts: Sequence[_Estimate],
    every: Sequence[Spectra],
    chosen: Sequence[int],
    j: int,
    ratio: float,
    names: Sequence[str],
) -> IdentifiedResponse:
    """One response from all windows: spectra merged with weights of each window's random error to the power -4."""
    inputs = len(names) - 1
    joint = len(chosen) > inputs + 1
    if len(parts) == 1:
        one = parts[0]
    else:
        weights = _weights(np.array([part.error[:, j] for part in parts]))
        one = _Estimate(merged(every, weights), chosen, inputs, joint)
    response = np.asarray(ratio * one.response[:, j], complex)
    name, output = names[j], names[-1]
    phase = continuous(np.angle(response), one.coherence[:, j] >= LEAST_COHERENCE)
    return IdentifiedResponse(
        FrequencyResponse(
            every[0].frequencies, response, phase, name, signals.units[name], output, signals.units[output]
        ),
        one.coherence[:, j],
        one.ordinary[:, j],
        one.multiple,
        one.error[:, j],
        JOINT if joint else DIRECT,
        tuple(own for own in names[:-1] if own != name),
        tuple(own.window for own in every),
        np.array(one.averages),
    )


def _weights(errors: Array) -> Array:
    """Weights of windows, shape (windows, f): their random error over the least to the power -4, with the sum 1."""
    usable = np.isfinite(errors)
    least = np.min(np.where(usable, errors, np.inf), axis=0)
    floor = np.where(np.isfinite(least) & (least > 0.0), least, 1.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        weights = np.where(usable, (np.maximum(errors, floor) / floor) ** -WEIGHT_POWER, 0.0)
    total = weights.sum(axis=0)
    return np.asarray(weights / np.where(total > 0.0, total, 1.0))


def continuous(angle: Array, valid: BoolArray) -> Array:
    """Phase that is continuous over the valid frequencies, beginning there between -270 and 90 deg [rad]."""
    phase = np.array(angle)
    use = valid & np.isfinite(angle)
    if use.any():
        unwrapped = np.unwrap(angle[use])
        turns = math.floor((unwrapped[0] + 0.75 * TURN) / TURN)
        phase[use] = unwrapped - turns * TURN
    return phase
