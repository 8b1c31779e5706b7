"""Floquet check of a time-invariant model (theory.md section 9).

In multiblade coordinates the model linearized about a trimmed state is periodic with the passage of the blades. The
eigenvalues of its monodromy matrix over one passage are exp(exponent x period); averaging over the azimuth is fair
where the exponents are the poles of the averaged model. (G. Floquet 1883; D. A. Peters, K. H. Hohenemser, Application
of the Floquet transition matrix to problems of lifting rotor stability, J. AHS 16 (2), 1971.)
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import matrix_balance
from scipy.optimize import linear_sum_assignment

from sbs_sim.aircraft import Aircraft
from sbs_sim.analysis.differences import difference_steps, jacobians, used_states
from sbs_sim.analysis.periodic import Period, common_period, flown_period
from sbs_sim.content import ByContent
from sbs_sim.errors import LinearizationError
from sbs_sim.flight.trim_point import Fidelity, TrimPoint
from sbs_sim.flight.two_blades import has_two_blades
from sbs_sim.model import state as S

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

AZIMUTH_COUNTS = (8, 1000)
FIRST_COUNT = 48
TOLERANCE = 1e-5  # of exponents, or of 1 rad/s
SHARE = 3.0  # difference of two results over the error of the finer: 15 where A is smooth, 3 with the kinks of tables
GONE = 1e-13  # of a multiplier: what decays further in a period leaves no exponent
TAYLOR_DEGREE, TAYLOR_REACH = 12, 0.4  # a multiple of three; 1-norm


@dataclass(frozen=True, eq=False)
class Floquet(ByContent):
    """Characteristic exponents beside the poles of the averaged model.

    Attributes
    ----------
    period : float
        Of the periodic model [s].
    monodromy : ndarray, shape (n, n)
        Transition over one period.
    multipliers : ndarray of complex, shape (n,)
        Eigenvalues of the monodromy matrix.
    exponents : ndarray of complex, shape (n,)
        log(multiplier) / period [rad/s], on the branch next to the pole of the averaged model.
    poles : ndarray of complex, shape (n,)
        Of the averaged model [rad/s], slowest first, each beside its exponent.
    azimuth_count : int
        Number of instants at which the model was linearized.
    error : ndarray, shape (n,)
        Estimate of the error of each exponent by the steps in time [rad/s], from the same with half of the instants;
        not a number for what decays so far in a period that no exponent is left.
    """

    period: float
    monodromy: Array
    multipliers: ComplexArray
    exponents: ComplexArray
    poles: ComplexArray
    azimuth_count: int = 0
    error: Array | None = None

    @property
    def is_settled(self) -> bool:
        """Whether the estimated errors are below 1e-5 of the exponents, or of 1 rad/s."""
        if self.error is None or np.isnan(self.error).all():
            return False
        return bool(np.nanmax(self.error / np.maximum(np.abs(self.exponents), 1.0)) <= TOLERANCE)

    @property
    def difference(self) -> Array:
        """|exponent - pole| / |pole|, shape (n,)."""
        return np.abs(self.exponents - self.poles) / np.maximum(np.abs(self.poles), np.finfo(float).tiny)


def checked_period(aircraft: Aircraft) -> tuple[float, list[int]]:
    """Common period as `common_period` has it, of an aircraft to which Floquet's method applies.

    Raises
    ------
    LinearizationError
        A stand, drives that do not join all rotors, or rotors whose blade passages have no common period.
    """
    if aircraft.body.is_stand:
        raise LinearizationError("body.stand: allowed is none; IsolatedRotor.exponents has those of a rotor on a stand")
    return common_period(aircraft)


def floquet(aircraft: Aircraft, point: TrimPoint, azimuth_count: int | None = None) -> Floquet:
    """Integrate the periodic linear model over one period.

    Parameters
    ----------
    aircraft : Aircraft
    point : TrimPoint
        The mean state about which is linearized; with two blades the motion over a revolution that it begins.
    azimuth_count : int, optional
        Number of instants of one period at which the model is linearized, even, 8 to 1000; two make a step. By default
        48, doubled up to 768 until the estimated errors of the exponents are below 1e-5 of them or of 1 rad/s.

    Returns
    -------
    Floquet

    Raises
    ------
    LinearizationError
        A count out of range, rotors whose blade passages have no common period, drives that do not join all rotors, or
        a stand.
    """
    checked_period(aircraft)
    least, most = AZIMUTH_COUNTS
    if azimuth_count is not None and (not least <= azimuth_count <= most or azimuth_count % 2):
        raise LinearizationError(f"azimuth_count = {azimuth_count}: allowed are even numbers from {least} to {most}")
    used = used_indices(aircraft, point)
    names = [point.state_names[i] for i in used]
    count, every = azimuth_count or FIRST_COUNT, np.empty(0)
    while True:
        every, states, period = derivatives(aircraft, point, count, every)
        a = every[:, used][:, :, used]
        if aircraft.drives and states is not None:
            a = _at_equal_azimuths(aircraft, a, states[:, used], names, period)
        found = exponents_of(a, period)
        if azimuth_count is not None or found.is_settled or 2 * count > most:
            return found
        count *= 2


def used_indices(aircraft: Aircraft, point: TrimPoint) -> NDArray[np.int64]:
    """Indices in the linear state of those that fidelity and locked hinges leave."""
    return np.array([i for i in used_states(point) if point.state_names[i] not in aircraft.locked_names])


def derivatives(
    aircraft: Aircraft, point: TrimPoint, count: int, half: Array | None = None
) -> tuple[Array, Array | None, float]:
    """Derivatives at instants of one period.

    Parameters
    ----------
    aircraft : Aircraft
    point : TrimPoint
    count : int
        Number of instants.
    half : ndarray, optional
        What is known of every second one; not used if empty, or if the aircraft has rotors with two blades.

    Returns
    -------
    derivatives : ndarray, shape (count, linear_size + 3 + 8 n_rotors, linear_size + n_controls)
        See `sbs_sim.analysis.differences.jacobians`.
    states : ndarray, shape (count, linear_size), optional
        Linear states of the periodic flight of two blades; None where the trim has them.
    period : float
        [s]
    """
    period = flown_period(aircraft, point)
    psi, steps = (period * np.arange(count) / count)[:, None] * point.rotor_speed, difference_steps(aircraft)
    if has_two_blades(aircraft):
        psi, states = _orbit(aircraft, point, psi, period)
        return jacobians(aircraft, point, psi, steps, states), states, period
    if half is None or not len(half):
        return jacobians(aircraft, point, psi, steps), None, period
    new = jacobians(aircraft, point, psi[1::2], steps)
    return np.stack([half, new], axis=1).reshape(count, *new.shape[1:]), None, period


def exponents_of(a: Array, period: float) -> Floquet:
    """Characteristic exponents of a periodic matrix.

    Parameters
    ----------
    a : ndarray, shape (m, n, n)
        At m equally spaced instants of a period, m even.
    period : float
        [s]
    """
    monodromy = transition(a, period)
    multipliers = np.linalg.eigvals(monodromy).astype(complex)
    poles = np.linalg.eigvals(a.mean(axis=0)).astype(complex)
    poles = poles[np.lexsort((poles.imag, np.abs(poles)))]
    multipliers, exponents = _beside(poles, multipliers, period)
    error = np.full(len(poles), np.nan)
    if len(a) % 4 == 0:
        coarse = np.linalg.eigvals(transition(a[0::2], period)).astype(complex)
        error = np.abs(_beside(exponents, coarse, period)[1] - exponents) / SHARE
        error[np.abs(multipliers) < GONE] = np.nan
    return Floquet(period, monodromy, multipliers, exponents, poles, len(a), error)


def _orbit(aircraft: Aircraft, point: TrimPoint, psi: Array, time: float) -> tuple[Array, Array]:
    """Azimuths (count, n_rotors) and linear states (count, linear_size) of the periodic flight of two blades.

    `psi` are the azimuths at constant speed, `time` is the period [s].
    """
    period = Period(aircraft, Fidelity(point.lead_lag, point.cyclic_inflow), instants=len(psi))
    way = period.orbit(aircraft.layout.from_linear(point.state), point.swashplate, time)
    if aircraft.drives:
        psi = np.array([aircraft.turned(np.zeros(len(aircraft.rotors)), state) for state in way])
    return psi, np.array([aircraft.layout.to_linear(state) for state in way])


def _at_equal_azimuths(aircraft: Aircraft, a: Array, states: Array, names: list[str], period: float) -> Array:
    """Matrices, shape (m, n, n), of departures compared at equal azimuths of the drive (theory.md section 9.7).

    A departure that turns faster is ahead on the periodic motion. The rates of that follow from its states by Fourier's
    series.
    """
    count, speed = len(states), names.index(f"{S.SPEED}(1)")
    order = 2j * math.pi / period * np.fft.fftfreq(count, 1.0 / count)
    order[count // 2] = 0.0
    rates = np.fft.ifft(np.fft.fft(states, axis=0) * order[:, np.newaxis], axis=0).real
    changed = a.copy()
    changed[:, :, speed] -= rates / states[:, speed, np.newaxis]
    return changed


def transition(a: Array, period: float) -> Array:
    """Transition matrix over a period of x' = A(t) x with the instants of a.

    Magnus' series to the fourth order with Simpson's rule, exact for a constant A (S. Blanes, F. Casas, J. A. Oteo,
    J. Ros, The Magnus expansion and some of its applications, Physics Reports 470, 2009, section 5.3).
    """
    h = 2.0 * period / len(a)
    first, middle = a[0::2], a[1::2]
    last = np.roll(first, -1, axis=0)
    mean = h / 6.0 * (first + 4.0 * middle + last)
    x = np.eye(a.shape[1])
    for step in _exponentials(mean - h * h / 12.0 * (first @ last - last @ first)):
        x = step @ x
    return x


def _exponentials(matrices: Array) -> Array:
    """Exponentials of similar matrices, shape (m, n, n), all at once.

    Balanced by units of the states and scaled by a power of two, Taylor's polynomial, and squared (C. Moler, C. Van
    Loan, Nineteen dubious ways to compute the exponential of a matrix, SIAM Review 45 (1), 2003, method 3). What the
    polynomial leaves out is below rounding: TAYLOR_REACH^13 / 13! < 1e-15.
    """
    _, (units, _) = matrix_balance(np.abs(matrices).max(axis=0), permute=False, separate=True)
    balanced = matrices * (units / units[:, None])
    size = float(np.abs(balanced).sum(axis=1).max())
    squarings = max(0, math.ceil(math.log2(size / TAYLOR_REACH))) if size > 0.0 else 0
    x = balanced / 2.0**squarings
    x2 = x @ x
    powers = np.eye(x.shape[1]), x, x2
    x3 = x2 @ x
    result = x3 / math.factorial(TAYLOR_DEGREE)
    for low in range(TAYLOR_DEGREE - 3, -1, -3):  # M. S. Paterson, L. J. Stockmeyer, SIAM J. Comput. 2 (1), 1973
        result += sum(power / math.factorial(low + i) for i, power in enumerate(powers))
        result = result @ x3 if low else result
    for _ in range(squarings):
        result = result @ result
    return np.asarray(result * (units[:, None] / units))


def _beside(poles: ComplexArray, multipliers: ComplexArray, period: float) -> tuple[ComplexArray, ComplexArray]:
    """Multipliers and exponents in the order of the poles; a logarithm has many branches, the nearest is taken."""
    principal = np.log(np.where(multipliers == 0.0, np.finfo(float).tiny, multipliers)) / period
    turn = 2.0 * math.pi / period
    branch = np.round((poles[:, None].imag - principal.imag) / turn)
    exponents = principal + 1j * turn * branch
    _, order = linear_sum_assignment(np.abs(exponents - poles[:, None]))
    return multipliers[order], exponents[np.arange(len(poles)), order]
