"""Frequency responses of a linear model: gain and phase from a control to an output (theory.md section 9.11)."""

from __future__ import annotations  # `help` then shows types by their names

from dataclasses import asdict, dataclass, replace
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
DAMPINGS = (0.05, 10.0)  # of actuators


@dataclass(frozen=True)
class Actuator:
    """Lag of actuators between a control and the pitch of the blades, 1 / (s^2 + 2 damping s + 1), s in `frequency`.

    Attributes
    ----------
    frequency : float
        Natural frequency, 1e-4 to 1e5 [rad/s].
    damping : float
        Ratio, 0.05 to 10.

    Raises
    ------
    LinearizationError
        A value out of range.
    """

    frequency: float
    damping: float = 0.7

    def __post_init__(self) -> None:
        checks.number("actuator.frequency", self.frequency, *FREQUENCIES, "rad/s", LinearizationError)
        checks.number("actuator.damping", self.damping, *DAMPINGS, "", LinearizationError)

    def at(self, frequencies: Array) -> ComplexArray:
        """Complex response at frequencies [rad/s]; its phase falls from 0 to -180 deg."""
        s = 1j * frequencies / self.frequency
        return np.asarray(1.0 / (s * s + 2.0 * self.damping * s + 1.0))

    @property
    def matrix(self) -> Array:
        """Rates of deflection and its speed by these and by the command, shape (2, 3)."""
        square = self.frequency**2
        return np.array([[0.0, 1.0, 0.0], [-square, -2.0 * self.damping * self.frequency, square]])


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
    actuator : Actuator, optional
        Likewise.
    """

    frequencies: Array
    response: ComplexArray
    phase: Array
    input_name: str
    input_unit: str
    output_name: str
    output_unit: str
    delay: float = 0.0
    actuator: Actuator | None = None

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
            "actuator": None if self.actuator is None else asdict(self.actuator),
            "frequency": self.frequencies.tolist(),
            "gain": self.gain.tolist(),
            "phase": self.phase.tolist(),
        }


def frequency_response(
    model: LinearModel,
    input_name: str,
    output_name: str,
    frequencies: Any = None,
    delay: float = 0.0,
    actuator: Actuator | None = None,
) -> FrequencyResponse:
    """Response of an output or state to a control, C (i omega - A)^-1 B + D times exp(-i omega delay) and an actuator.

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
    actuator : Actuator, optional
        Between the control and the model.

    Returns
    -------
    FrequencyResponse

    Raises
    ------
    LinearizationError
        A name that the model does not have, or frequencies or a delay out of range.
    """
    transfer = Transfer.of(model, input_name, output_name, delay, actuator)
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
        actuator,
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
    """One element of a transfer matrix, C (s - A)^-1 B + D, behind a delay and an actuator.

    Attributes
    ----------
    a : ndarray, shape (n, n)
    b, c : ndarray, shape (n,)
    d, delay : float
    settled : Transfer, optional
        The same with settled rotors and inflow, which says on which turn the phase is; None: the response itself.
    actuator : Actuator, optional
    """

    a: Array
    b: Array
    c: Array
    d: float
    delay: float = 0.0
    settled: Transfer | None = None
    actuator: Actuator | None = None

    @classmethod
    def of(
        cls,
        model: LinearModel,
        input_name: str,
        output_name: str,
        delay: float = 0.0,
        actuator: Actuator | None = None,
    ) -> Transfer:
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
        transfer = replace(cls._element(model, input_name, output_name, delay), actuator=actuator)
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
        lag = 1.0 if self.actuator is None else self.actuator.at(frequencies)
        return np.asarray(self._undelayed(frequencies) * np.exp(-1j * frequencies * self.delay) * lag)

    def _undelayed(self, frequencies: Array) -> ComplexArray:
        states = substituted(*self._triangular[:2], 1j * np.asarray(frequencies, complex))
        return np.asarray(self._triangular[2] @ states + self.d)

    @cached_property
    def _triangular(self) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
        """A, b and c of the states in which A is triangular."""
        triangle, ahead, behind = triangular(self.a)
        return triangle, np.asarray(ahead @ self.b), np.asarray(self.c @ behind)

    def phase(self, frequencies: Array) -> Array:
        """Continuous phase at rising frequencies [rad], shape (n,); see `FrequencyResponse.phase`."""
        low = min(frequencies[0], 0.1 * _slowest(self.poles, frequencies[0]))
        grid = self._fine_grid(np.union1d(frequencies, low))
        phase = np.unwrap(np.angle(self._undelayed(grid)))
        phase += TURN * (round((self._first_phase(low) - phase[0]) / TURN))
        lag = 0.0 if self.actuator is None else np.angle(self.actuator.at(frequencies))
        return np.asarray(phase[np.searchsorted(grid, frequencies)] - frequencies * self.delay + lag)

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


def triangular(a: ComplexArray | Array) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
    """Schur form T of a balanced matrix, shape (n, n), and L, R with T = L a R and L R = 1."""
    from scipy.linalg import matrix_balance, schur  # here: a trim has no use for it, and it is slow to import

    _, (units, _) = matrix_balance(np.abs(a), permute=False, separate=True)
    triangle, turn = schur(a * (units / units[:, None]), output="complex")
    return triangle, turn.conj().T / units, units[:, None] * turn


def substituted(triangle: ComplexArray, right: ComplexArray, shifts: ComplexArray) -> ComplexArray:
    """Solutions of (shift - triangle) x = right for shifts, shape (n, m): the last first, for all shifts at once."""
    found = np.empty((len(triangle), len(shifts)), complex)
    for i in reversed(range(len(triangle))):
        found[i] = (right[i] + triangle[i, i + 1 :] @ found[i + 1 :]) / (shifts - triangle[i, i])
    return found


def _slowest(poles: ComplexArray, otherwise: float) -> float:
    """Speed of the slowest pole that is not at the origin [rad/s]."""
    speeds = np.abs(poles)
    return float(np.min(speeds[speeds > FREQUENCIES[0]], initial=max(otherwise, FREQUENCIES[0])))
