"""State feedback: its design, and what becomes of it with the complete model, sampling and delay.

The design sees a continuous model of low order. What flies is a compensator that runs once a tick on a plant of many
more states, whose controls are held for a tick and may come some ticks late: `closed_loop_poles` and `margins` are
exact for that, since both sides are taken in discrete time.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm, solve_continuous_are

from sbs_sim.content import ByContent
from sbs_sim.errors import PilotError

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complexfloating]

MIN_FREQUENCY = 0.02  # rad/s
FREQUENCIES = 800  # from there to half the sampling rate
AROUND_A_POLE = np.linspace(-4.0, 4.0, 33)  # in units of its distance from the imaginary axis
DELAY_POLE_RADIUS = 1e-9  # discrete-time poles closer to the origin are pure delays
BATCH = 200  # frequencies that are computed together


@dataclass(frozen=True, eq=False)
class Plant(ByContent):
    """x' = a x + b u, y = c x.

    Attributes
    ----------
    a : ndarray, shape (n, n)
    b : ndarray, shape (n, m)
    c : ndarray, shape (k, n)
    """

    a: Array
    b: Array
    c: Array


@dataclass(frozen=True, eq=False)
class Compensator(ByContent):
    """Once a tick: u = c s + d y, then s becomes a s + b y. The signs are those that fly: no minus outside.

    Attributes
    ----------
    a : ndarray, shape (l, l)
    b : ndarray, shape (l, k)
    c : ndarray, shape (m, l)
    d : ndarray, shape (m, k)
    """

    a: Array
    b: Array
    c: Array
    d: Array

    def at(self, w: Array, tick: float) -> ComplexArray:
        """Response at frequencies [rad/s] with a tick [s], shape (len(w), m, k)."""
        inner = np.exp(1j * w * tick)[:, None, None] * np.eye(len(self.a)) - self.a
        through = np.linalg.solve(inner, np.broadcast_to(self.b, (len(w), *self.b.shape)))
        return np.asarray(self.d + self.c @ through)


@dataclass(frozen=True)
class Margin:
    """How much a loop can be wrong at one input before it is unstable, the loops at the other inputs closed.

    The disk margin takes errors of gain and phase at once (Seiler, Packard, Gahinet, An introduction to disk margins,
    IEEE Control Systems Magazine 40(5), 2020): 1 / max |S - 1/2| with the sensitivity S.

    Attributes
    ----------
    disk : float
        2 is the most there can be, 0 is unstable.
    frequency : float
        Where it is least [rad/s].
    gain_low, gain_high : float
        Factors at which the loop becomes unstable with its phase right; 0 and infinity where there is none.
    phase : float
        Lag or lead at which it becomes unstable with its gain right [rad]; infinity where the gain never crosses one.
    """

    disk: float
    frequency: float
    gain_low: float
    gain_high: float
    phase: float


def lqr(a: Array, b: Array, state_limits: Array, control_limits: Array) -> tuple[Array, ComplexArray, Array]:
    """Gains K of u = -K x that minimise the integral of the sum of (x_i / limit_i)^2 and (u_j / limit_j)^2.

    The weights are Bryson's rule (Bryson and Ho, Applied Optimal Control, section 5.2): a limit is the departure that
    costs as much as any other at its limit.

    Parameters
    ----------
    a : ndarray, shape (n, n)
    b : ndarray, shape (n, m)
    state_limits : ndarray, shape (n,)
        In the units of the states; infinity is a state that costs nothing.
    control_limits : ndarray, shape (m,)

    Returns
    -------
    gains : ndarray, shape (m, n)
    poles : ndarray of complex, shape (n,)
        Of a - b K, slowest first [rad/s].
    cost : ndarray, shape (n, n)
        x^T cost x is the integral from a state x on.

    Raises
    ------
    PilotError
        The controls do not reach everything that must be stabilised.
    """
    try:
        cost = solve_continuous_are(a, b, np.diag(state_limits**-2.0), np.diag(control_limits**-2.0))
    except (np.linalg.LinAlgError, ValueError):
        raise PilotError("no gains: the controls cannot stabilise this model") from None
    gains = (control_limits**2.0)[:, None] * (b.T @ cost)
    poles = slowest_first(np.linalg.eigvals(a - b @ gains))
    if not np.all(poles.real < 0.0):
        raise PilotError("no gains: the controls cannot stabilise this model")
    return gains, poles, cost


def slowest_first(poles: ComplexArray) -> ComplexArray:
    """Poles in the order of their magnitude, pairs with the negative imaginary part first."""
    return poles[np.lexsort((poles.imag, np.round(np.abs(poles), 9)))]


def sampled(plant: Plant, tick: float) -> tuple[Array, Array]:
    """Exact a and b from tick to tick for controls that are held between (zero-order hold)."""
    n, m = plant.b.shape
    both = expm(tick * np.block([[plant.a, plant.b], [np.zeros((m, n + m))]]))
    return both[:n, :n], both[:n, n:]


def closed_loop(plant: Plant, compensator: Compensator, tick: float, delay: int) -> Array:
    """Matrix that takes the loop from tick to tick: states of the plant, of the compensator, controls on their way.

    Parameters
    ----------
    plant, compensator
    tick : float
        [s]
    delay : int
        Ticks between a measurement and the controls that it gives, at least 0.
    """
    a, b = sampled(plant, tick)
    n, m = b.shape
    states = len(compensator.a)
    now = np.hstack([compensator.d @ plant.c, compensator.c])  # controls that are computed at this tick
    matrix = np.zeros((n + states + delay * m,) * 2)
    matrix[:n, :n] = a
    matrix[n : n + states, : n + states] = np.hstack([compensator.b @ plant.c, compensator.a])
    if delay == 0:
        matrix[:n, : n + states] += b @ now
        return matrix
    first, last = n + states, n + states + (delay - 1) * m
    matrix[:n, last:] = b
    matrix[first : first + m, : n + states] = now
    for row in range(first + m, last + m, m):
        matrix[row : row + m, row - m : row] = np.eye(m)
    return matrix


def closed_loop_poles(plant: Plant, compensator: Compensator, tick: float, delay: int) -> ComplexArray:
    """Poles of the loop as those of continuous time, log(z) / tick [rad/s], slowest first, without pure delays."""
    z = np.linalg.eigvals(closed_loop(plant, compensator, tick, delay)).astype(complex)
    return slowest_first(np.log(z[np.abs(z) > DELAY_POLE_RADIUS]) / tick)


def margins(plant: Plant, compensator: Compensator, tick: float, delay: int) -> tuple[Margin, ...]:
    """Margins at every control, and as the last one the disk margin for errors at all of them at once.

    The last is the bound 1 / max ||S - 1/2||, which holds for errors that differ from control to control.
    """
    stable = bool(np.all(np.abs(np.linalg.eigvals(closed_loop(plant, compensator, tick, delay))) < 1.0))
    w = frequencies(plant, tick)
    loops = loop_gain(plant, compensator, tick, delay, w)
    inputs = loops.shape[1]
    sensitivity = np.linalg.inv(np.eye(inputs) + loops)
    found = []
    for i in range(inputs):
        s = sensitivity[:, i, i]
        disk, worst = _least(np.abs(s - 0.5), w, stable)
        found.append(Margin(disk, worst, *reached(1.0 / s - 1.0)))
    size = np.linalg.norm(sensitivity - 0.5 * np.eye(inputs), ord=2, axis=(1, 2))
    disk, worst = _least(size, w, stable)
    return (*found, Margin(disk, worst, *disk_gains(disk), disk_phase(disk)))


def disk_gains(disk: float) -> tuple[float, float]:
    """Factors between which the gain may lie for a disk margin, with the phase right."""
    return (2.0 - disk) / (2.0 + disk), (2.0 + disk) / (2.0 - disk) if disk < 2.0 else math.inf


def disk_phase(disk: float) -> float:
    """Phase error that a disk margin allows with the gain right [rad]."""
    return 2.0 * math.atan(disk / 2.0)


def frequencies(plant: Plant, tick: float) -> Array:
    """Where to look [rad/s]: evenly over the logarithm, and closely around the poles of the plant."""
    highest = math.pi / tick
    w = np.geomspace(MIN_FREQUENCY, highest, FREQUENCIES)
    poles = np.linalg.eigvals(plant.a)
    for pole in poles[poles.imag > MIN_FREQUENCY]:
        w = np.concatenate([w, pole.imag + AROUND_A_POLE * abs(pole.real)])
    return np.unique(w[(w >= MIN_FREQUENCY) & (w < highest)])


def loop_gain(plant: Plant, compensator: Compensator, tick: float, delay: int, w: Array) -> ComplexArray:
    """Loop broken at the controls, L(exp(i w tick)) of the feedback u = -L u, shape (len(w), m, m)."""
    a, b = sampled(plant, tick)
    result = []
    for part in np.array_split(w, math.ceil(len(w) / BATCH)):
        z = np.exp(1j * part * tick)[:, None, None]
        response = plant.c @ np.linalg.solve(z * np.eye(len(a)) - a, np.broadcast_to(b, (len(part), *b.shape)))
        result.append(-compensator.at(part, tick) @ response * z ** (-delay))
    return np.concatenate(result)


def _least(size: Array, w: Array, stable: bool) -> tuple[float, float]:
    index = int(np.argmax(size))
    return (1.0 / float(size[index]) if stable else 0.0), float(w[index])


def reached(loop: ComplexArray) -> tuple[float, float, float]:
    """Gain factors and phase at which a loop reaches -1, by linear interpolation between the frequencies."""
    before, after = loop[:-1], loop[1:]
    crossing = before.imag * after.imag < 0.0
    share = before.imag[crossing] / (before.imag[crossing] - after.imag[crossing])
    real = before.real[crossing] + share * (after.real - before.real)[crossing]
    factors = -1.0 / real[real < 0.0]
    one = (np.abs(before) - 1.0) * (np.abs(after) - 1.0) < 0.0
    first, second = np.abs(before[one]) - 1.0, np.abs(after[one]) - 1.0
    at_one = before[one] + first / (first - second) * (after[one] - before[one])
    return (
        float(factors[factors < 1.0].max(initial=0.0)),
        float(factors[factors > 1.0].min(initial=math.inf)),
        float(np.abs(np.angle(-at_one)).min(initial=math.inf)),
    )
