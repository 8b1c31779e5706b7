"""Linear models with fewer states, and what that costs over frequency and in time (theory.md section 9.15)."""

from __future__ import annotations  # `help` then shows types by their names

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import schur, solve_continuous_lyapunov, solve_sylvester

from sbs_sim import checks
from sbs_sim.analysis import export
from sbs_sim.analysis.frequency_response import Transfer
from sbs_sim.analysis.step_response import output_row, step_response
from sbs_sim.content import ByContent
from sbs_sim.errors import ExportError, LinearizationError
from sbs_sim.model import state as S
from sbs_sim.output.files import check_target, write

if TYPE_CHECKING:
    from sbs_sim.analysis.linear_model import LinearModel

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

WEIGHTS = {**dict.fromkeys(("u", "w", "v"), 1.0), **dict.fromkeys(("q", "theta", "p", "phi", "r"), 10.0)}
BAND = (0.2, 20.0)  # rad/s at full size
POINTS = 80
STEP_TIME = 4.0  # s at full size
RATES = {"heave": "w", "roll": "p", "pitch": "q", "yaw": "r"}
BALANCED = (8, 10, 12, 14, 18)
COST_PHASE = 0.01745  # of the phase in deg beside the gain in dB
# Maximum unnoticeable added dynamics: numerator and denominator, highest power first, and a delay [s].
# MIL-STD-1797A, appendix A, as M. B. Tischler, R. K. Remple, Aircraft and Rotorcraft System Identification, AIAA 2006,
# report it; written down from memory. The quotients agree with the public MATLAB function LoesBound (C. Regan, 2006).
UNNOTICED = {
    "upper gain": ((3.16, 31.61, 22.79), (1.0, 27.14, 1.84), 0.0),
    "lower gain": ((0.095, 9.92, 2.15), (1.0, 11.60, 4.95), 0.0),
    "upper phase": ((68.89, 1100.12, -275.22), (1.0, 39.94, 9.99), 0.0059),
    "lower phase": ((475.32, 184100.0, 29460.0), (1.0, 11.66, 0.039), -0.0072),
}


@dataclass(frozen=True, eq=False)
class ReducedModel(ByContent):
    """x' = A x + B u, y = C x + D u with fewer states than the model that it was made of.

    Attributes
    ----------
    name : str
        What is left: "body", "uniform inflow", "flap", "inflow", "flap and inflow", or "balanced".
    a, b, c, d : ndarray, shape (n, n), (n, m), (o, n), (o, m)
    state_names, state_units : tuple of str
        Those that were kept; "z1" and so on without a unit where they are combinations.
    control_names, control_units, output_names, output_units : tuple of str
        Of the full model.
    hankel : ndarray
        Hankel singular values of the stable part of the full model, falling; empty where none were needed.
    """

    name: str
    a: Array
    b: Array
    c: Array
    d: Array
    state_names: tuple[str, ...]
    state_units: tuple[str, ...]
    control_names: tuple[str, ...]
    control_units: tuple[str, ...]
    output_names: tuple[str, ...]
    output_units: tuple[str, ...]
    hankel: Array

    @property
    def order(self) -> int:
        """Number of states."""
        return len(self.a)

    @property
    def poles(self) -> ComplexArray:
        """Eigenvalues of A [rad/s], slowest first."""
        poles = np.linalg.eigvals(self.a).astype(complex)
        return poles[np.lexsort((poles.imag, np.abs(poles)))]

    def save(self, path: str | Path) -> None:
        """Write the model to a .mat, .npz, .json or .h file.

        Raises
        ------
        ExportError
            Another suffix, or a file that cannot be written.
        """
        path = checks.path("path", path, ExportError)
        check_target(path, export.STATE_SPACE_ENCODERS)
        write(path, export.STATE_SPACE_ENCODERS[path.suffix.lower()](self))

    def to_control(self) -> Any:
        """`control.StateSpace` of python-control with the names of states, inputs and outputs.

        Raises
        ------
        ExportError
            python-control is not installed.
        """
        return export.to_control(self)


# --- reduction --------------------------------------------------------------------------------------------------


def kept_sets(model: LinearModel) -> dict[str, tuple[str, ...]]:
    """States that are kept beside those of the body, by the name of the reduction, as far as the model has them.

    The tilt of the tip-path planes is kept without its rates: so flap regresses with a model of the first order.
    """
    body = tuple(name for name in S.LINEAR_BODY_NAMES if name in model.state_names)
    drives = tuple(name for name in model.state_names if S.part_of(name).family == "drive")
    parts = {name: S.part_of(name) for name in model.state_names}
    inflow = tuple(name for name, part in parts.items() if part.family == "inflow")
    uniform = tuple(name for name in inflow if parts[name].harmonic == 0)
    tilt = tuple(
        name for name, part in parts.items() if part.family == "flap" and part.harmonic == 1 and not part.is_rate
    )
    own = {
        "body": body,
        "uniform inflow": body + uniform,
        "flap": body + tilt,
        "inflow": body + inflow,
        "flap and inflow": body + tilt + inflow,
    }
    found: dict[str, tuple[str, ...]] = {}
    for name, states in own.items():
        if states + drives not in found.values():
            found[name] = states + drives
    return found


def residualised(model: LinearModel, name: str) -> ReducedModel:
    """Model in which all states but those of a set have settled.

    Parameters
    ----------
    model : LinearModel
        Full.
    name : str
        One of `kept_sets`.

    Raises
    ------
    LinearizationError
        Another name, or states that do not settle.
    """
    sets = kept_sets(model)
    checks.choice("name", name, tuple(sets), LinearizationError)
    left = model.quasi_static(sets[name])
    return ReducedModel(
        name, left.a, left.b, left.c, left.d, left.state_names, left.state_units, *_ends(model), np.empty(0)
    )


def balanced(model: LinearModel, order: int) -> ReducedModel:
    """Truncated model: of the balanced stable part those states that matter most, and all of the unstable part.

    Parameters
    ----------
    model : LinearModel
        Full.
    order : int
        Number of states that are kept.

    Returns
    -------
    ReducedModel
        The error of the transfer from all controls to the states of the body, measured in 1 m/s and 0.1 rad or rad/s,
        is at most twice the sum of the truncated Hankel singular values.

    Raises
    ------
    LinearizationError
        An order below the number of unstable poles, or above that of the states.
    """
    parts = _Split.of(model)
    order = checks.integer("order", order, len(parts.rest), len(model.a), LinearizationError)
    count = min(order - len(parts.rest), len(parts.hankel))
    right, left = parts.balancing(count)
    a = _diagonal(left.T @ parts.stable @ right, parts.rest)
    b = np.vstack([left.T @ parts.b_stable, parts.b_rest])
    c = np.hstack([parts.c_stable @ right, parts.c_rest])
    names = tuple(f"z{i + 1}" for i in range(len(a)))
    return ReducedModel("balanced", a, b, c, model.d, names, ("1",) * len(a), *_ends(model), np.asarray(parts.hankel))


def _ends(model: LinearModel) -> tuple[tuple[str, ...], tuple[str, ...], tuple[str, ...], tuple[str, ...]]:
    return model.control_names, model.control_units, model.output_names, model.output_units


def _diagonal(first: Array, second: Array) -> Array:
    size = len(first)
    found = np.zeros((size + len(second),) * 2)
    found[:size, :size], found[size:, size:] = first, second
    return found


@dataclass(frozen=True, eq=False)
class _Split(ByContent):
    """Stable part and the rest of a model, without coupling, and the Gramians' roots of the stable part."""

    stable: Array
    rest: Array
    b_stable: Array
    b_rest: Array
    c_stable: Array
    c_rest: Array
    reach: Array
    sight: Array
    left: Array
    hankel: Array
    right: Array

    @classmethod
    def of(cls, model: LinearModel) -> _Split:
        """Of a model, whose states are measured in their steps."""
        units = model.steps[: len(model.a)]
        a, b, c = model.a * units / units[:, None], model.b / units[:, None], model.c * units
        triangle, turn, count = schur(a, output="real", sort="lhp")
        b, c = turn.T @ b, c @ turn
        stable, rest = triangle[:count, :count], triangle[count:, count:]
        shear = solve_sylvester(stable, -rest, -triangle[:count, count:])
        b_stable, c_rest = b[:count] - shear @ b[count:], c[:, :count] @ shear + c[:, count:]
        weighed = np.array([WEIGHTS.get(name, 0.0) for name in model.output_names])[:, None] * c[:, :count]
        reach = _root(solve_continuous_lyapunov(stable, -b_stable @ b_stable.T))
        sight = _root(solve_continuous_lyapunov(stable.T, -weighed.T @ weighed))
        left, hankel, right = np.linalg.svd(sight.T @ reach)
        return cls(stable, rest, b_stable, b[count:], c[:, :count], c_rest, reach, sight, left, hankel, right)

    def balancing(self, count: int) -> tuple[Array, Array]:
        """Columns of the balanced states in the states, and rows of those in these."""
        root = 1.0 / np.sqrt(self.hankel[:count])
        return self.reach @ self.right[:count].T * root, self.sight @ self.left[:, :count] * root


def _root(gramian: Array) -> Array:
    """Factor of a symmetric matrix that has no negative eigenvalues but for rounding."""
    values, vectors = np.linalg.eigh(0.5 * (gramian + gramian.T))
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))


# --- what it costs ----------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Mismatch(ByContent):
    """Response of a reduced model over that of the full one.

    Attributes
    ----------
    input_name, output_name : str
    frequencies, gain_db, phase_deg : ndarray, shape (n,)
        [rad/s]; gain of the ratio [dB], its phase [deg].
    is_unnoticed : ndarray of bool, shape (n,)
        Whether both are within the envelopes of maximum unnoticeable added dynamics.
    step_error : float
        Largest difference of the responses to a step over the largest response of the full one.
    """

    input_name: str
    output_name: str
    frequencies: Array
    gain_db: Array
    phase_deg: Array
    is_unnoticed: NDArray[np.bool_]
    step_error: float

    @property
    def cost(self) -> float:
        """20 / n times the sum of squares, of gain in dB and of phase in deg by 0.01745; up to 100 is a good fit."""
        squares = self.gain_db**2 + COST_PHASE * self.phase_deg**2
        return 20.0 * float(squares.mean())


def unnoticed(frequencies: Array) -> dict[str, Array]:
    """Envelopes at frequencies of full size, gains in dB and phases in deg, by the names "upper gain" and so on."""
    found = {}
    for name, (above, below, delay) in UNNOTICED.items():
        s = 1j * frequencies
        value = np.polyval(above, s) / np.polyval(below, s) * np.exp(s * delay)
        found[name] = 20.0 * np.log10(np.abs(value)) if "gain" in name else np.degrees(np.angle(value))
    return found


def mismatches(model: LinearModel, reduced: ReducedModel, speed_up: float = 1.0) -> tuple[Mismatch, ...]:
    """Errors of a reduced model from each control to the rate about its axis, or along it.

    Parameters
    ----------
    model : LinearModel
        Full.
    reduced : ReducedModel
    speed_up : float
        Frequencies of the aircraft over those of full size, see `sbs_sim.analysis.quality_limits.Scale`: the band
        is 0.2 to 20 rad/s of full size, a step is followed for 4 s.
    """
    frequencies = np.geomspace(*BAND, POINTS) * speed_up
    envelopes = unnoticed(frequencies / speed_up)
    found = []
    for control, axis in zip(model.control_names, model.control_axes, strict=True):
        if axis in RATES and RATES[axis] in model.output_names:
            found.append(_mismatch(model, reduced, control, RATES[axis], frequencies, envelopes, speed_up))
    return tuple(found)


def _mismatch(
    model: LinearModel,
    reduced: ReducedModel,
    control: str,
    output: str,
    frequencies: Array,
    envelopes: dict[str, Array],
    speed_up: float,
) -> Mismatch:
    full, less = (_transfer(own, control, output).at(frequencies) for own in (model, reduced))
    with np.errstate(divide="ignore", invalid="ignore"):
        gain, phase = 20.0 * np.log10(np.abs(less / full)), np.degrees(np.angle(less / full))
    inside = (envelopes["lower gain"] <= gain) & (gain <= envelopes["upper gain"])
    inside &= (envelopes["lower phase"] <= phase) & (phase <= envelopes["upper phase"])
    duration = STEP_TIME / speed_up
    steps = [step_response(own, control, output_row(own, output)[np.newaxis], duration)[0] for own in (model, reduced)]
    size = float(np.abs(steps[0]).max())
    error = float(np.abs(steps[1] - steps[0]).max()) / size if size > 0.0 else math.nan
    return Mismatch(control, output, frequencies, gain, phase, inside, error)


def _transfer(model: LinearModel | ReducedModel, control: str, output: str) -> Transfer:
    row, column = model.output_names.index(output), model.control_names.index(control)
    return Transfer(model.a, model.b[:, column], model.c[row], float(model.d[row, column]))


@dataclass(frozen=True, eq=False)
class Reduction(ByContent):
    """A reduced model with its errors.

    Attributes
    ----------
    model : ReducedModel
    mismatches : tuple of Mismatch
    """

    model: ReducedModel
    mismatches: tuple[Mismatch, ...]

    @property
    def band(self) -> tuple[float, float]:
        """Of the frequencies at full size [rad/s]."""
        return BAND

    @property
    def worst_gain(self) -> float:
        """Largest error of the gain [dB]."""
        return max((float(np.abs(own.gain_db).max()) for own in self.mismatches), default=math.nan)

    @property
    def worst_phase(self) -> float:
        """Largest error of the phase [deg]."""
        return max((float(np.abs(own.phase_deg).max()) for own in self.mismatches), default=math.nan)

    @property
    def cost(self) -> float:
        """Largest of the mismatches' costs."""
        return max((own.cost for own in self.mismatches), default=math.nan)

    @property
    def is_unnoticed(self) -> bool:
        """Whether all mismatches are within the envelopes over the band."""
        return all(bool(own.is_unnoticed.all()) for own in self.mismatches)

    @property
    def step_error(self) -> float:
        """Largest of the mismatches' errors in time."""
        return max((own.step_error for own in self.mismatches), default=math.nan)


def reductions(model: LinearModel, speed_up: float = 1.0, orders: Sequence[int] = BALANCED) -> tuple[Reduction, ...]:
    """Reduced models of all kinds with their errors, the smallest first; see `mismatches`.

    Raises
    ------
    LinearizationError
        States that do not settle.
    """
    least = len(_Split.of(model).rest)
    models = [residualised(model, name) for name in kept_sets(model)]
    models += [balanced(model, order) for order in orders if least <= order < len(model.a)]
    found = [Reduction(own, mismatches(model, own, speed_up)) for own in models]
    return tuple(sorted(found, key=lambda own: own.model.order))


def suggested(found: Sequence[Reduction]) -> Reduction | None:
    """Of several reductions the one of the smallest order whose errors stay unnoticed, the cheaper of equal ones."""
    good = [own for own in found if own.is_unnoticed]
    return min(good, key=lambda own: (own.model.order, own.cost), default=None)
