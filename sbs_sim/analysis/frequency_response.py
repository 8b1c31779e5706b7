"""Frequency responses of a linear model: gain and phase from a control to an output (theory.md section 9.11)."""

from __future__ import annotations  # `help` then shows types by their names

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sbs_sim import checks
from sbs_sim.content import ByContent
from sbs_sim.errors import LinearizationError
from sbs_sim.flight.trim_point import StandPoint
from sbs_sim.model import state as S

if TYPE_CHECKING:
    from sbs_sim.analysis.linear_model import LinearModel

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

FREQUENCIES = (1e-4, 1e5)  # rad/s, that may be asked for
MAX_DELAY = 10.0  # s
TURN = 2.0 * np.pi
MAX_TURN = np.radians(30.0)  # of the phase from one frequency of a fine grid to the next
FIRST_POINTS, SETTLED_POINTS, MAX_POINTS, MAX_HALVINGS = 100, 200, 5000, 20  # of such grids
FAST = 1e4  # over the fastest pole: there a response is its asymptote
DECIBELS = 20.0


@dataclass(frozen=True, eq=False)
class FrequencyResponse(ByContent):
    """Response of an output to a sinusoidal input.

    Attributes
    ----------
    frequencies : ndarray, shape (n,)
        Rising [rad/s].
    response : ndarray of complex, shape (n,)
        Output over input, in their SI units.
    phase : ndarray, shape (n,)
        Continuous over frequency [rad]. At low frequencies it is that of the body with settled rotors and inflow,
        whose phase ends at -90 deg for each order by which the response falls (-180 deg for an attitude) if the input
        moves the output up at once, and 180 deg above if it moves it down. Where there is no such body, on a stand or
        for states of rotors, the response itself ends so.
    input_name, input_unit, output_name, output_unit : str
    delay : float
        That the response contains beside the model [s].
    """

    frequencies: Array
    response: ComplexArray
    phase: Array
    input_name: str
    input_unit: str
    output_name: str
    output_unit: str
    delay: float = 0.0

    @property
    def gain(self) -> Array:
        """|output| / |input|, shape (n,)."""
        return np.abs(self.response)

    @property
    def gain_db(self) -> Array:
        """Gain in decibels of SI units, shape (n,); -inf where the output does not move."""
        with np.errstate(divide="ignore"):
            return np.asarray(DECIBELS * np.log10(self.gain))

    @property
    def phase_deg(self) -> Array:
        """Phase in degrees, shape (n,)."""
        return np.degrees(self.phase)

    def to_dict(self) -> dict[str, Any]:
        """Names, units and numbers as plain lists for JSON: gains in SI units, phases in rad."""
        return {
            "input": self.input_name,
            "input_unit": self.input_unit,
            "output": self.output_name,
            "output_unit": self.output_unit,
            "delay": self.delay,
            "frequency": self.frequencies.tolist(),
            "gain": self.gain.tolist(),
            "phase": self.phase.tolist(),
        }


def frequency_response(
    model: LinearModel, input_name: str, output_name: str, frequencies: Any = None, delay: float = 0.0
) -> FrequencyResponse:
    """Response of an output or state to a control, C (i omega - A)^-1 B + D times exp(-i omega delay).

    Parameters
    ----------
    model : LinearModel
    input_name : str
        Of a control.
    output_name : str
        Of an output or state.
    frequencies : array_like, optional
        Rising, 1e-4 to 1e5 [rad/s]; by default 200 from a tenth of the slowest to three times the fastest pole.
    delay : float
        Of sensors, computers and the like [s].

    Returns
    -------
    FrequencyResponse

    Raises
    ------
    LinearizationError
        A name that the model does not have, or frequencies or a delay out of range.
    """
    transfer = Transfer.of(model, input_name, output_name, delay)
    if frequencies is None:
        frequencies = default_frequencies(model)
    asked = _checked(frequencies)
    return FrequencyResponse(
        asked,
        transfer.at(asked),
        transfer.phase(asked),
        input_name,
        model.control_units[model.control_names.index(input_name)],
        output_name,
        _output_unit(model, output_name),
        transfer.delay,
    )


def default_frequencies(model: LinearModel, count: int = 200) -> Array:
    """Frequencies that show all poles of a model, shape (count,) [rad/s]."""
    speeds = np.abs(model.poles)
    speeds = speeds[speeds > FREQUENCIES[0]]
    low, high = (speeds.min() / 10.0, 3.0 * speeds.max()) if len(speeds) else (0.1, 10.0)
    return np.geomspace(max(low, FREQUENCIES[0]), min(high, FREQUENCIES[1]), count)


def _checked(frequencies: Any) -> Array:
    asked = np.atleast_1d(checks.array("frequencies", frequencies, LinearizationError))
    least, most = FREQUENCIES
    for value in asked.flat:
        checks.number("frequencies", value, least, most, "rad/s", LinearizationError)
    if asked.ndim != 1 or len(asked) == 0 or not (np.diff(asked) > 0.0).all():
        raise LinearizationError("frequencies: allowed are one or more rising numbers")
    return asked


def _output_unit(model: LinearModel, name: str) -> str:
    if name in model.output_names:
        return model.output_units[model.output_names.index(name)]
    return model.state_units[model.state_names.index(name)]


@dataclass(frozen=True, eq=False)
class Transfer(ByContent):
    """One element of a transfer matrix, C (s - A)^-1 B + D, behind a delay.

    Attributes
    ----------
    a : ndarray, shape (n, n)
    b, c : ndarray, shape (n,)
    d, delay : float
    settled : Transfer, optional
        The same with settled rotors and inflow, which says on which turn the phase is; None: the response itself.
    """

    a: Array
    b: Array
    c: Array
    d: float
    delay: float = 0.0
    settled: Transfer | None = None

    @classmethod
    def of(cls, model: LinearModel, input_name: str, output_name: str, delay: float = 0.0) -> Transfer:
        """From a control to an output or state of a model.

        Raises
        ------
        LinearizationError
            A name that the model does not have, or a delay out of range.
        """
        checks.choice("input", input_name, model.control_names, LinearizationError)
        names = tuple(dict.fromkeys((*model.output_names, *model.state_names)))
        checks.choice("output", output_name, names, LinearizationError)
        delay = checks.number("delay", delay, 0.0, MAX_DELAY, "s", LinearizationError)
        transfer = cls._element(model, input_name, output_name, delay)
        flies = not isinstance(model.trim, StandPoint) and set(S.LINEAR_BODY_NAMES) <= set(model.state_names)
        if not flies or output_name not in model.output_names:
            return transfer
        if len(model.state_names) == len(S.LINEAR_BODY_NAMES):
            return replace(transfer, settled=transfer)
        return replace(transfer, settled=cls._element(model.quasi_static(), input_name, output_name, delay))

    @classmethod
    def _element(cls, model: LinearModel, input_name: str, output_name: str, delay: float) -> Transfer:
        column = model.control_names.index(input_name)
        if output_name in model.output_names:
            row = model.output_names.index(output_name)
            return cls(model.a, model.b[:, column], model.c[row], float(model.d[row, column]), delay)
        unit = np.eye(len(model.a))[model.state_names.index(output_name)]
        return cls(model.a, model.b[:, column], unit, 0.0, delay)

    @cached_property
    def poles(self) -> ComplexArray:
        """Eigenvalues of A [rad/s], shape (n,)."""
        return np.linalg.eigvals(self.a).astype(complex)

    def at(self, frequencies: Array) -> ComplexArray:
        """Complex response at frequencies [rad/s], shape (n,)."""
        return np.asarray(self._undelayed(frequencies) * np.exp(-1j * frequencies * self.delay))

    def _undelayed(self, frequencies: Array) -> ComplexArray:
        shifted = 1j * frequencies[:, None, None] * np.eye(len(self.a)) - self.a
        states = np.linalg.solve(shifted, self.b.astype(complex)[None, :, None])[..., 0]
        return np.asarray(states @ self.c + self.d)

    def phase(self, frequencies: Array) -> Array:
        """Continuous phase at rising frequencies [rad], shape (n,); see `FrequencyResponse.phase`."""
        low = min(frequencies[0], 0.1 * _slowest(self.poles, frequencies[0]))
        grid = self._fine_grid(np.union1d(frequencies, low))
        phase = np.unwrap(np.angle(self._undelayed(grid)))
        phase += TURN * (round((self._first_phase(low) - phase[0]) / TURN))
        return np.asarray(phase[np.searchsorted(grid, frequencies)] - frequencies * self.delay)

    def _first_phase(self, low: float) -> float:
        """Phase at a low frequency, on the turn that the end of the response with settled rotors says [rad]."""
        settled = self.settled or self
        high = FAST * max(abs(settled.poles).max(), low)
        grid = settled._fine_grid(np.geomspace(low, high, SETTLED_POINTS))
        phase = np.unwrap(np.angle(settled._undelayed(grid)))
        return float(phase[0] + TURN * round((settled._end(high) - phase[-1]) / TURN))

    @cached_property
    def starts_down(self) -> bool:
        """Whether the input moves the output down at once, rotors and inflow settled (as they are, without a body)."""
        transfer = self.settled or self
        high = FAST * max(abs(transfer.poles).max(), FREQUENCIES[0])
        return bool(np.cos(np.angle(transfer._undelayed(np.array([high])))[0] - transfer._fall(high)) < 0.0)

    def _end(self, high: float) -> float:
        """Phase at a frequency far above all poles [rad]."""
        return self._fall(high) + (0.5 * TURN if self.starts_down else 0.0)

    def _fall(self, high: float) -> float:
        """-90 deg for each order by which the response falls far above all poles [rad]."""
        first, second = np.abs(self._undelayed(np.array([0.5 * high, high])))
        return -0.25 * TURN * round(float(np.log2(first / second))) if second > 0.0 else 0.0

    def _fine_grid(self, frequencies: Array) -> Array:
        """Frequencies with as many between them as the phase needs to be followed from each to the next."""
        grid = np.asarray(frequencies, float)
        grid = np.union1d(grid, np.geomspace(grid[0], grid[-1], FIRST_POINTS))
        resonances = np.abs(self.poles.imag)
        grid = np.union1d(grid, resonances[(resonances > grid[0]) & (resonances < grid[-1])])
        for _ in range(MAX_HALVINGS):
            turn = np.abs(np.diff(np.unwrap(np.angle(self._undelayed(grid)))))
            steep = turn > MAX_TURN
            if not steep.any() or len(grid) + steep.sum() > MAX_POINTS:
                break
            grid = np.union1d(grid, np.sqrt(grid[:-1] * grid[1:])[steep])
        return grid


def _slowest(poles: ComplexArray, otherwise: float) -> float:
    """Speed of the slowest pole that is not at the origin [rad/s]."""
    speeds = np.abs(poles)
    return float(np.min(speeds[speeds > FREQUENCIES[0]], initial=max(otherwise, FREQUENCIES[0])))
