"""Periodic linear models, and time-invariant ones of their harmonics (theory.md section 9.14).

The coefficients of x' = A(t) x + B(t) u over a period are written as Fourier series, and so is the state, whose
coefficients change slowly. They follow a time-invariant model (G. W. Hill 1886; N. M. Wereley, S. R. Hall, Frequency
response of linear time periodic systems, 29th IEEE CDC, 1990; R. Lopez, J. V. R. Prasad, J. AHS 62 (1), 2017). What the
model lacks to stand still at the trimmed state is periodic, too; the answer to it is the vibration of a steady flight.
"""

from __future__ import annotations  # `help` then shows types by their names

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sbs_sim import checks
from sbs_sim.aircraft import Aircraft
from sbs_sim.analysis.floquet import Floquet, derivatives, exponents_of, floquet, used_indices
from sbs_sim.analysis.frequency_response import substituted, triangular
from sbs_sim.analysis.linearize import model_outputs
from sbs_sim.analysis.reduced import ReducedModel
from sbs_sim.content import ByContent
from sbs_sim.errors import LinearizationError
from sbs_sim.flight.engine import points_engine
from sbs_sim.flight.trim_point import TrimPoint
from sbs_sim.flight.two_blades import has_two_blades
from sbs_sim.model import records as R
from sbs_sim.model import state as S
from sbs_sim.model.frames import cross_matrix, down_of

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

BODY_RATES = ("p", "q", "r")


@dataclass(frozen=True, eq=False)
class PeriodicModel(ByContent):
    """x' = f(t) + A(t) x + B(t) u, y = g(t) + C(t) x + D(t) u with a period, at m equally spaced instants of it.

    Attributes
    ----------
    period : float
        [s]
    a, b, c, d : ndarray, shape (m, n, n), (m, n, k), (m, o, n), (m, o, k)
    state_names, control_names, output_names : tuple of str
        As in `LinearModel`.
    state_units, control_units, output_units : tuple of str
    rates : ndarray, shape (m, n)
        f: of the states at the state about which is linearized, without a mean; zero for a flight that is periodic.
    values : ndarray, shape (m, o)
        g: outputs there.
    turning : ndarray, shape (m, 6)
        Angular velocity [rad/s] and acceleration [rad/s^2] of the body there.
    """

    period: float
    a: Array
    b: Array
    c: Array
    d: Array
    state_names: tuple[str, ...] = ()
    control_names: tuple[str, ...] = ()
    output_names: tuple[str, ...] = ()
    state_units: tuple[str, ...] = ()
    control_units: tuple[str, ...] = ()
    output_units: tuple[str, ...] = ()
    rates: Array = field(default_factory=lambda: np.empty((0, 0)))
    values: Array = field(default_factory=lambda: np.empty((0, 0)))
    turning: Array = field(default_factory=lambda: np.zeros((1, 6)))

    @property
    def frequency(self) -> float:
        """Of the first harmonic [rad/s]."""
        return 2.0 * math.pi / self.period

    def with_points(self, points: Mapping[str, ArrayLike]) -> PeriodicModel:
        """Model with the specific forces at points of the body among its outputs, as accelerometers there measure them.

        Parameters
        ----------
        points : mapping of str to array_like, shape (3,)
            Positions from the c.g. in body axes [m] by names; outputs are "specific_force_x(name)" and so on.

        Raises
        ------
        LinearizationError
            A position that is not three finite numbers, or a model without the rates of the body.
        """
        found = self
        for name, position in points.items():
            given = checks.array(f"points.{name}", position, LinearizationError)
            if given.shape != (3,):
                raise LinearizationError(f"points.{name}: allowed are three numbers, it has the shape {given.shape}")
            found = found._with_point(name, given)
        return found

    def _with_point(self, name: str, position: Array) -> PeriodicModel:
        """With f + dw/dt x r + w x (w x r) of one point among the outputs, linear about the motion."""
        missing = [rate for rate in BODY_RATES if rate not in self.state_names]
        if missing:
            raise LinearizationError(f"points: allowed are models with the states p, q and r, this has no {missing[0]}")
        turn = [self.state_names.index(rate) for rate in BODY_RATES]
        forces = [self.output_names.index(f"specific_force_{axis}") for axis in "xyz"]
        lever, rates = -cross_matrix(position), self.turning[:, :3]
        c = self.c[:, forces] + lever @ self.a[:, turn]
        c[:, :, turn] += np.array([-cross_matrix(np.cross(w, position)) + cross_matrix(w) @ lever for w in rates])
        values = self.values
        if len(values):
            turned = self.turning[:, 3:] @ lever.T + np.cross(rates, np.cross(rates, position))
            values = np.concatenate([values, values[:, forces] + turned], axis=1)
        return replace(
            self,
            c=np.concatenate([self.c, c], axis=1),
            d=np.concatenate([self.d, self.d[:, forces] + lever @ self.b[:, turn]], axis=1),
            output_names=(*self.output_names, *(f"specific_force_{axis}({name})" for axis in "xyz")),
            output_units=(*self.output_units, *["m/s^2"] * 3),
            values=values,
        )

    @cached_property
    def floquet(self) -> Floquet:
        """Characteristic exponents."""
        return exponents_of(self.a, self.period)

    def harmonic(self, count: int) -> HarmonicModel:
        """Time-invariant model of the mean and this number of harmonics of the states and outputs.

        Raises
        ------
        LinearizationError
            A number below 0, or more than half of what the instants resolve.
        """
        most = (len(self.a) - 1) // 4
        count = checks.integer("harmonics", count, 0, most, LinearizationError)
        order = range(-count, count + 1)
        series = [np.fft.fft(matrices, axis=0) / len(matrices) for matrices in (self.a, self.b, self.c, self.d)]
        a, c = (
            np.block([[found[row - column] for column in order] for row in order]) for found in (series[0], series[2])
        )
        b, d = (np.concatenate([found[row] for row in order]) for found in (series[1], series[3]))
        a -= np.diag(1j * self.frequency * np.repeat(order, self.a.shape[1]))
        still = np.empty(0, complex), np.empty(0, complex)
        if len(self.values):
            parts = [np.fft.fft(values, axis=0) / len(values) for values in (self.rates, self.values)]
            still = np.concatenate([parts[0][row] for row in order]), np.concatenate([parts[1][row] for row in order])
        names = self.state_names, self.control_names, self.output_names
        units = self.state_units, self.control_units, self.output_units
        return HarmonicModel(self.frequency, count, a, b, c, d, *names, *units, *still)


@dataclass(frozen=True, eq=False)
class HarmonicModel(ByContent):
    """Time-invariant model of the Fourier coefficients of the states of a periodic one.

    Attributes
    ----------
    frequency : float
        Of the first harmonic [rad/s].
    count : int
        Number h of harmonics.
    hill : ndarray of complex, shape ((2h + 1) n, (2h + 1) n)
        State matrix of the coefficients X_-h ... X_h of exp(i m frequency t).
    hill_b, hill_c, hill_d : ndarray of complex
        The same for B, C and D, whose inputs have no harmonics.
    state_names, control_names, output_names : tuple of str
        Of the periodic model.
    state_units, control_units, output_units : tuple of str
        Likewise.
    rates, values : ndarray of complex, shape ((2h + 1) n,), ((2h + 1) o,)
        Coefficients of those of the periodic model; empty if it has none.
    """

    frequency: float
    count: int
    hill: ComplexArray
    hill_b: ComplexArray
    hill_c: ComplexArray
    hill_d: ComplexArray
    state_names: tuple[str, ...]
    control_names: tuple[str, ...]
    output_names: tuple[str, ...]
    state_units: tuple[str, ...] = ()
    control_units: tuple[str, ...] = ()
    output_units: tuple[str, ...] = ()
    rates: ComplexArray = field(default_factory=lambda: np.empty(0, complex))
    values: ComplexArray = field(default_factory=lambda: np.empty(0, complex))

    @cached_property
    def poles(self) -> ComplexArray:
        """All eigenvalues [rad/s], shape ((2h + 1) n,): characteristic exponents and those shifted by harmonics."""
        return np.linalg.eigvals(self.hill).astype(complex)

    def exponents(self, poles: ComplexArray) -> ComplexArray:
        """Of all eigenvalues those next to some poles, such as those of the averaged model, one for each [rad/s]."""
        from scipy.optimize import linear_sum_assignment

        _, chosen = linear_sum_assignment(np.abs(np.asarray(poles)[:, None] - self.poles))
        return np.asarray(self.poles[chosen])

    def response(self, input_name: str, output_name: str, harmonic: int, frequencies: Any) -> ComplexArray:
        """Amplitude of an output at a frequency plus a number of harmonics, for a control at that frequency.

        Parameters
        ----------
        input_name, output_name : str
        harmonic : int
            -h to h; 0 is the output at the frequency of the control.
        frequencies : array_like
            Of the control [rad/s].

        Returns
        -------
        ndarray of complex, shape (m,)
            Output over control in SI units.

        Raises
        ------
        LinearizationError
            A name that the model does not have, or a harmonic out of range.
        """
        checks.choice("input", input_name, self.control_names, LinearizationError)
        row = self._row(output_name, harmonic)
        asked = np.atleast_1d(checks.array("frequencies", frequencies, LinearizationError))
        column = self.control_names.index(input_name)
        triangle, ahead, behind = self._triangular
        states = substituted(triangle, np.asarray(ahead @ self.hill_b[:, column]), 1j * asked.astype(complex))
        return np.asarray((self.hill_c[row] @ behind) @ states + self.hill_d[row, column])

    def _row(self, output_name: str, harmonic: int) -> int:
        """Of an amplitude in the outputs."""
        checks.choice("output", output_name, self.output_names, LinearizationError)
        harmonic = checks.integer("harmonic", harmonic, -self.count, self.count, LinearizationError)
        return (harmonic + self.count) * len(self.output_names) + self.output_names.index(output_name)

    @cached_property
    def _triangular(self) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
        return triangular(self.hill)

    @cached_property
    def steady(self) -> ComplexArray:
        """Outputs in the trimmed flight with all controls held: mean, and complex amplitudes, shape (h + 1, o).

        y(t) = mean + sum of Re(amplitude of harmonic k exp(i k frequency t)), t = 0 at the azimuth 0 of all rotors.

        Raises
        ------
        LinearizationError
            The periodic model has no values about which it is linear.
        """
        return self._one_sided(self.values + self.hill_c @ self._steady_states)

    @cached_property
    def steady_states(self) -> ComplexArray:
        """The same of the states' departures from the trim, shape (h + 1, n); with them a periodic flight begins."""
        return self._one_sided(self._steady_states)

    @cached_property
    def _steady_states(self) -> ComplexArray:
        if not len(self.values):
            raise LinearizationError("steady: allowed are models with the values about which they are linear")
        return np.asarray(np.linalg.solve(self.hill, -self.rates))

    def _one_sided(self, coefficients: ComplexArray) -> ComplexArray:
        """Mean and complex amplitudes of coefficients from -h to h."""
        found = coefficients.reshape(2 * self.count + 1, -1)[self.count :].copy()
        found[1:] *= 2.0
        return found

    @property
    def state_space(self) -> ReducedModel:
        """The model in real numbers with names and units, which can be saved and be given to python-control."""

        def repeated(units: tuple[str, ...]) -> tuple[str, ...]:
            return units * (2 * self.count + 1)

        names = self.names, repeated(self.state_units), self.control_names, self.control_units
        outputs = self.harmonic_outputs, repeated(self.output_units)
        return ReducedModel("harmonics", self.a, self.b, self.c, self.d, *names, *outputs, np.empty(0))

    # --- real coefficients ------------------------------------------------------------------------------------------

    @cached_property
    def a(self) -> Array:
        """State matrix of the mean and of the coefficients of cosine and sine of each harmonic, in `names`."""
        return self._real(_to_complex(self.count, self._size), self.hill)

    @cached_property
    def b(self) -> Array:
        """Input matrix of the same, shape ((2h + 1) n, k)."""
        return np.asarray(np.linalg.solve(_to_complex(self.count, self._size), self.hill_b).real)

    @cached_property
    def c(self) -> Array:
        """Outputs: mean, cosine and sine of each harmonic, shape ((2h + 1) o, (2h + 1) n)."""
        states, outputs = _to_complex(self.count, self._size), _to_complex(self.count, self._outputs)
        return np.asarray(np.linalg.solve(outputs, self.hill_c @ states).real)

    @cached_property
    def d(self) -> Array:
        """Feedthrough, shape ((2h + 1) o, k)."""
        return np.asarray(np.linalg.solve(_to_complex(self.count, self._outputs), self.hill_d).real)

    @property
    def names(self) -> tuple[str, ...]:
        """Of the states of `a`: "u", "u[1c]", "u[1s]" and so on, all states of a coefficient together."""
        return harmonic_names(self.state_names, self.count)

    @property
    def harmonic_outputs(self) -> tuple[str, ...]:
        """Of the outputs of `c`, as in `names`."""
        return harmonic_names(self.output_names, self.count)

    def value(self, coefficients: Array, time: float) -> Array:
        """States or outputs at a time from their coefficients as `a` and `c` have them, shape (n,)."""
        parts = np.asarray(coefficients).reshape(2 * self.count + 1, -1)
        angles = self.frequency * time * np.arange(1, self.count + 1)
        weights = np.concatenate([[1.0], np.column_stack([np.cos(angles), np.sin(angles)]).ravel()])
        return np.asarray(weights @ parts)

    @property
    def _size(self) -> int:
        return len(self.hill) // (2 * self.count + 1)

    @property
    def _outputs(self) -> int:
        return len(self.hill_c) // (2 * self.count + 1)

    @staticmethod
    def _real(to_complex: ComplexArray, matrix: ComplexArray) -> Array:
        return np.asarray(np.linalg.solve(to_complex, matrix @ to_complex).real)


def harmonic_names(names: tuple[str, ...], count: int) -> tuple[str, ...]:
    """Names of means, cosines and sines."""
    parts = ["", *(f"[{order}{letter}]" for order in range(1, count + 1) for letter in "cs")]
    return tuple(f"{name}{part}" for part in parts for name in names)


def _to_complex(count: int, size: int) -> ComplexArray:
    """Complex coefficients of -h to h from mean, cosines and sines: X_m = (x_mc - i x_ms) / 2, X_-m its conjugate."""
    found = np.zeros((2 * count + 1, 2 * count + 1), complex)
    found[count, 0] = 1.0
    for order in range(1, count + 1):
        found[count + order, 2 * order - 1 : 2 * order + 1] = 0.5, -0.5j
        found[count - order, 2 * order - 1 : 2 * order + 1] = 0.5, 0.5j
    return np.asarray(np.kron(found, np.eye(size)), complex)


def periodic_model(aircraft: Aircraft, point: TrimPoint, azimuth_count: int | None = None) -> PeriodicModel:
    """Periodic linear model about a trim, with hub loads and specific forces among its outputs.

    Parameters
    ----------
    aircraft : Aircraft
    point : TrimPoint
    azimuth_count : int, optional
        Number of instants of a period, even, 8 to 1000; by default that at which the exponents have settled.

    Raises
    ------
    LinearizationError
        See `sbs_sim.analysis.floquet.floquet`.
    """
    if aircraft.drives and has_two_blades(aircraft):
        raise LinearizationError("drives: allowed with two blades in a periodic model are none: its period would vary")
    count = floquet(aircraft, point, azimuth_count).azimuth_count
    every, states, period = derivatives(aircraft, point, count)
    size, used = len(point.state), used_indices(aircraft, point)
    there = [point] * count if states is None else [replace(point, state=state) for state in states]
    outputs = [model_outputs(aircraft, own, found) for own, found in zip(there, every, strict=True)]
    rows = np.array([found for found, _, _ in outputs])
    psi = (period * np.arange(count) / count)[:, None] * point.rotor_speed
    rates, values = _still(aircraft, there, psi)
    turn = [S.LINEAR_P, S.LINEAR_Q, S.LINEAR_R]
    turning = np.column_stack([np.array([own.state[turn] for own in there]), rates[:, turn]])
    rates = np.zeros_like(rates) if states is not None else rates - rates.mean(axis=0)
    return PeriodicModel(
        period,
        every[:, used][:, :, used],
        every[:, used][:, :, size:],
        rows[:, :, used],
        rows[:, :, size:],
        tuple(point.state_names[i] for i in used),
        aircraft.control_names,
        outputs[0][1],
        tuple(aircraft.layout.linear_units[i] for i in used),
        aircraft.control_units,
        outputs[0][2],
        rates[:, used],
        values,
        turning,
    )


def _still(aircraft: Aircraft, points: list[TrimPoint], psi: Array) -> tuple[Array, Array]:
    """Rates of the linear state (m, linear_size) and outputs (m, o) at states and azimuths, shape (m, n_rotors)."""
    first, layout = points[0], aircraft.layout
    engine = points_engine(aircraft.arranged(first.lead_lag, first.cyclic_inflow, "points"))
    rates, values = np.zeros((len(points), len(first.state))), []
    for row, (point, at) in enumerate(zip(points, psi, strict=True)):
        state = layout.from_linear(point.state)
        slopes, loads = engine.average(state, point.swashplate, at[np.newaxis])
        u, v, w, p, q, r = slopes[S.VELOCITY : S.VELOCITY + 6]
        rates[row, : S.LINEAR_BODY_SIZE] = [u, w, q, 0.0, v, p, 0.0, r]  # the attitude is steady
        end = layout.linear_size - S.LINEAR_BODY_SIZE
        rates[row, S.LINEAR_BODY_SIZE :] = slopes[S.BODY_SIZE : S.BODY_SIZE + end]
        power = loads[:, R.TORQUE] * aircraft.rotor_speeds(state)
        climb = -float(down_of(state[np.newaxis, S.ATTITUDE : S.VELOCITY])[0] @ state[S.VELOCITY : S.RATES])
        rotors = np.column_stack([loads, power]).ravel()
        values.append(np.concatenate([point.state[: S.LINEAR_BODY_SIZE], [climb], slopes[-3:], rotors]))
    return rates, np.array(values)
