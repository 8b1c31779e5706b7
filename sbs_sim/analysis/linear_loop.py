"""Loops of a linear model and a linear control law, and how they reject disturbances (theory.md section 9.18).

What is measured may be disturbed; delay and actuators are between the law and the model. The delay is Padé's
approximation of the third order, whose phase is right to 1 deg up to a frequency of 3 over the delay.
"""

from __future__ import annotations  # `help` then shows types by their names

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sbs_sim import checks
from sbs_sim.analysis.frequency_response import MAX_DELAY, Actuator, Transfer
from sbs_sim.analysis.rejection import Rejection, rejection
from sbs_sim.content import ByContent
from sbs_sim.errors import LinearizationError
from sbs_sim.model import state as S
from sbs_sim.model.frames import euler_to_quaternion, rotation_matrix

if TYPE_CHECKING:
    from sbs_sim.analysis.linear_model import LinearModel

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

PATH = ("heading", "forward", "right", "down")
PATH_UNITS = ("rad", "m", "m", "m")
ORDER = 3  # of Padé's approximation
STEP = 1e-6  # rad, of attitudes for the path
DRIFT = 1e-6  # rad/s
POINTS = 400  # of the search for a rejection
LOWEST, HIGHEST = 1e-2, 3.0  # of that search, over slowest and fastest pole


@dataclass(frozen=True, eq=False)
class LinearLaw(ByContent):
    """s' = A s + B z, u = C s + D z: controls u beside those of the trim; z is what is measured, then the commands.

    Attributes
    ----------
    a, b, c, d : ndarray, shape (l, l), (l, k + r), (m, l), (m, k + r)
        The signs are those that fly: no minus outside.
    measured : tuple of str, length k
        Outputs or states of the model, or of `PATH`: departures from the trim, "heading" [rad], and the way "forward",
        "right" and "down" in axes of the trimmed heading [m].
    commands, axes : tuple of str, length r
        Names, and what each commands: "pitch", "roll", "yaw", "heave", or "".
    controls : tuple of str, length m
        Of the model.
    rate_axes : tuple of str
        Axes whose command is answered by a rate, not by an attitude.
    """

    a: Array
    b: Array
    c: Array
    d: Array
    measured: tuple[str, ...]
    commands: tuple[str, ...]
    axes: tuple[str, ...]
    controls: tuple[str, ...]
    rate_axes: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class LinearLoop(ByContent):
    """x' = A x + B r + E d, y = C x + D r of commands r and of disturbances d of what is measured.

    Attributes
    ----------
    a, b, c, d : ndarray, shape (n, n), (n, k), (o, n), (o, k)
    e : ndarray, shape (n, m)
    seen : ndarray, shape (m, n)
        What is measured, without its disturbance.
    state_names, control_names, control_axes, output_names, output_units, measured : tuple of str
        States of the model first; `control_names` are the commands; the outputs are those of the model, `PATH` and the
        controls, behind delay and actuators.
    rate_axes : tuple of str
        As in `LinearLaw`.
    trim : TrimPoint or None
    settled : LinearLoop, optional
        The same with settled rotors and inflow, no delay and no actuators.
    """

    a: Array
    b: Array
    c: Array
    d: Array
    e: Array
    seen: Array
    state_names: tuple[str, ...]
    control_names: tuple[str, ...]
    control_axes: tuple[str, ...]
    output_names: tuple[str, ...]
    output_units: tuple[str, ...]
    measured: tuple[str, ...]
    rate_axes: tuple[str, ...] = ()
    trim: Any = None
    settled: LinearLoop | None = field(default=None, repr=False)

    @cached_property
    def poles(self) -> ComplexArray:
        """Eigenvalues of A [rad/s], slowest first."""
        poles = np.linalg.eigvals(self.a).astype(complex)
        return poles[np.lexsort((poles.imag, np.abs(poles)))]

    @property
    def is_stable(self) -> bool:
        """Whether nothing grows; position and heading may drift."""
        return self.growth < DRIFT

    @property
    def growth(self) -> float:
        """Largest real part of a pole [rad/s]."""
        return float(self.poles.real.max())

    def transfer(self, command: str, output_name: str) -> Transfer:
        """Transfer function of an output.

        Raises
        ------
        LinearizationError
            A name that the loop does not have.
        """
        checks.choice("command", command, self.control_names, LinearizationError)
        checks.choice("output", output_name, self.output_names, LinearizationError)
        column, row = self.control_names.index(command), self.output_names.index(output_name)
        settled = None if self.settled is None else self.settled.transfer(command, output_name)
        return Transfer(self.a, self.b[:, column], self.c[row], float(self.d[row, column]), settled=settled)

    def sensitivity(self, name: str, frequencies: Any) -> ComplexArray:
        """What is measured over the disturbance that is added to it, at frequencies [rad/s], shape (n,).

        Raises
        ------
        LinearizationError
            It is not measured.
        """
        checks.choice("measured", name, self.measured, LinearizationError)
        i = self.measured.index(name)
        asked = np.atleast_1d(checks.array("frequencies", frequencies, LinearizationError))
        return np.asarray(1.0 + Transfer(self.a, self.e[:, i], self.seen[i], 0.0).at(asked))

    def rejection(self, name: str, band: tuple[float, float] | None = None) -> Rejection:
        """Disturbance rejection bandwidth and peak of a measured output.

        Parameters
        ----------
        name : str
            Of what is measured.
        band : (float, float), optional
            Frequencies between which is looked [rad/s]: below it all drifts, beyond it a pilot sees nothing. By default
            from a hundredth of the slowest pole to three times the fastest.

        Raises
        ------
        LinearizationError
            It is not measured.
        """
        speeds = np.abs(self.poles)
        speeds = speeds[speeds > LOWEST * LOWEST]
        low, high = band or (LOWEST * speeds.min(), HIGHEST * speeds.max())
        grid = np.geomspace(low, high, POINTS)

        def left(frequency: float) -> float:
            return float(abs(self.sensitivity(name, [frequency])[0]))

        return rejection(name, grid, np.abs(self.sensitivity(name, grid)), left)


LawOf = Callable[["LinearModel"], LinearLaw]


def linear_loop(model: LinearModel, law: LinearLaw, delay: float = 0.0, actuator: Actuator | None = None) -> LinearLoop:
    """Close a loop about a linear model.

    Parameters
    ----------
    model : LinearModel
    law : LinearLaw
    delay : float
        From a measurement to the control that it gives [s], 0 to 10.
    actuator : Actuator, optional
        Behind the delay, the same for all controls.

    Raises
    ------
    LinearizationError
        A name that the model does not have, a measured output that a control moves at once, or a delay out of range.
    """
    delay = checks.number("delay", delay, 0.0, MAX_DELAY, "s", LinearizationError)
    loop = _closed(model, law, delay, actuator)
    if len(model.state_names) > len(S.LINEAR_BODY_NAMES) and set(law.measured) <= {*model.output_names, *PATH}:
        return replace(loop, settled=_closed(model.quasi_static(), law, 0.0, None))
    return loop


def _closed(model: LinearModel, law: LinearLaw, delay: float, actuator: Actuator | None) -> LinearLoop:
    for name in law.controls:
        checks.choice("controls", name, model.control_names, LinearizationError)
    used = [model.control_names.index(name) for name in law.controls]
    a, path = _with_path(model)
    size, wide = len(model.a), len(a)
    b = np.vstack([model.b[:, used], np.zeros((len(path), len(used)))])
    rows = dict(zip(model.state_names, np.eye(size, wide), strict=True))
    for name, row, direct in zip(model.output_names, model.c, model.d, strict=True):
        if name not in rows and not direct[used].any():
            rows[name] = np.concatenate([row, np.zeros(len(path))])
    rows |= {name: np.eye(wide)[size + i] for i, name in enumerate(path)}
    for name in law.measured:
        if name in model.output_names and name not in rows:
            raise LinearizationError(f"measured: a control moves {name} at once: allowed are outputs that none does")
        checks.choice("measured", name, tuple(rows), LinearizationError)
    seen = np.array([rows[name] for name in law.measured]).reshape(len(law.measured), wide)
    count, lag = len(law.measured), _series(_delayed(delay), actuator)
    lags = [np.kron(np.eye(len(used)), part) for part in lag]
    (b_seen, b_command), (d_seen, d_command) = (np.split(part, [count], axis=1) for part in (law.b, law.d))
    middle, own = len(lags[0]), len(law.a)
    whole = np.zeros((wide + middle + own,) * 2)
    onto = np.hstack([d_seen @ seen, np.zeros((len(used), middle)), law.c])  # controls by all states, before the lag
    whole[:wide, :wide], whole[:wide, wide : wide + middle] = a, b @ lags[2]
    whole[wide : wide + middle, wide : wide + middle] = lags[0]
    whole[wide + middle :, :wide], whole[wide + middle :, wide + middle :] = b_seen @ seen, law.a
    into = np.vstack([b @ lags[3], lags[1], np.zeros((own, len(used)))])
    whole += into @ onto
    commanded = into @ d_command + np.vstack([np.zeros((wide + middle, len(law.commands))), b_command])
    disturbed = into @ d_seen + np.vstack([np.zeros((wide + middle, count)), b_seen])
    moved = np.hstack([np.zeros((len(used), wide)), lags[2], np.zeros((len(used), own))]) + lags[3] @ onto
    moved_at_once = lags[3] @ d_command
    outputs = np.hstack([model.c, np.zeros((len(model.c), len(whole) - size))]) + model.d[:, used] @ moved
    outputs = np.vstack([outputs, np.eye(len(whole))[size:wide], moved])
    direct = np.vstack([model.d[:, used] @ moved_at_once, np.zeros((len(path), len(law.commands))), moved_at_once])
    units = dict(zip(PATH, PATH_UNITS, strict=True))
    return LinearLoop(
        whole,
        commanded,
        outputs,
        direct,
        disturbed,
        np.hstack([seen, np.zeros((count, middle + own))]),
        (*model.state_names, *path, *(f"lag {i + 1}" for i in range(middle)), *(f"law {i + 1}" for i in range(own))),
        law.commands,
        law.axes,
        (*model.output_names, *path, *law.controls),
        (*model.output_units, *(units[name] for name in path), *(model.control_units[i] for i in used)),
        law.measured,
        law.rate_axes,
        getattr(model, "trim", None),
    )


def _with_path(model: LinearModel) -> tuple[Array, tuple[str, ...]]:
    """State matrix with heading and way appended, as far as the model has a body, and their names."""
    size, names = len(model.a), model.state_names
    if not set(S.LINEAR_BODY_NAMES) <= set(names):
        return model.a, ()
    wide = np.zeros((size + len(PATH),) * 2)
    wide[:size, :size] = model.a
    pitch, roll = model.trim.pitch, model.trim.roll
    wide[size, names.index("q")] = math.sin(roll) / math.cos(pitch)
    wide[size, names.index("r")] = math.cos(roll) / math.cos(pitch)
    velocity = model.trim.state[[S.LINEAR_U, S.LINEAR_V, S.LINEAR_W]]

    def over_ground(heading: float, theta: float, phi: float) -> Array:
        return np.asarray(rotation_matrix(euler_to_quaternion(heading, theta, phi)) @ velocity)

    wide[size + 1 :, [names.index(name) for name in "uvw"]] = rotation_matrix(euler_to_quaternion(0.0, pitch, roll))
    for column, change in zip((size, names.index("theta"), names.index("phi")), STEP * np.eye(3), strict=True):
        there = [over_ground(*(np.array([0.0, pitch, roll]) + sign * change)) for sign in (1.0, -1.0)]
        wide[size + 1 :, column] += (there[0] - there[1]) / (2.0 * STEP)
    return wide, PATH


def _delayed(delay: float) -> tuple[Array, Array, Array, Array]:
    """Padé's approximation of a delay [s] with as many zeros as poles; H. Padé 1892."""
    if delay == 0.0:
        return np.zeros((0, 0)), np.zeros((0, 1)), np.zeros((1, 0)), np.ones((1, 1))
    powers = range(ORDER + 1)
    below = [math.comb(ORDER, k) * math.factorial(2 * ORDER - k) / math.factorial(2 * ORDER) for k in powers]
    below = [value / below[ORDER] for value in below]  # of the powers of s times the delay, the highest is 1
    above = [value * (-1.0) ** k for k, value in enumerate(below)]
    a = np.zeros((ORDER, ORDER))
    a[:-1, 1:], a[-1] = np.eye(ORDER - 1), [-value for value in below[:ORDER]]
    end = above[ORDER]
    c = np.array([[over - end * under for over, under in zip(above[:ORDER], below[:ORDER], strict=True)]])
    return a / delay, np.eye(ORDER)[:, -1:] / delay, c, np.array([[end]])


def _series(first: tuple[Array, Array, Array, Array], actuator: Actuator | None) -> tuple[Array, Array, Array, Array]:
    """A delay and then an actuator."""
    if actuator is None:
        return first
    a, b, c, d = first
    size, own = len(a), actuator.matrix
    whole = np.zeros((size + 2, size + 2))
    whole[:size, :size], whole[size:, size:], whole[size:, :size] = a, own[:, :2], own[:, 2:] @ c
    into = np.vstack([b, own[:, 2:] @ d])
    return whole, into, np.hstack([np.zeros((1, size)), [[1.0, 0.0]]]), np.zeros((1, 1))
