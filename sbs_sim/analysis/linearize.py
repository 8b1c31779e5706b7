"""Linear models: A, B, C, D about a trimmed flight (theory.md section 9; paper section 2.3).

Two constructions of the same matrices. `averaged` takes central differences of the derivative averaged over the
azimuth. `paper` builds them term by term as the paper's eqs. [20] to [34] do, with its blocks by name.
"""

from __future__ import annotations  # `help` then shows types by their names

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sbs_sim import checks
from sbs_sim.aircraft import Aircraft
from sbs_sim.analysis import export
from sbs_sim.analysis.control_effects import ControlEffect, control_effects
from sbs_sim.analysis.modes import Mode, modes
from sbs_sim.analysis.trim import Guess, TrimPoint, trim
from sbs_sim.content import ByContent
from sbs_sim.engine import points_engine
from sbs_sim.errors import LinearizationError
from sbs_sim.model import records as R
from sbs_sim.model import state as S
from sbs_sim.model.average import azimuths
from sbs_sim.model.elementary import cosine_and_sine
from sbs_sim.model.linear import SPECIFIC_FORCE_SIZE, jacobian
from sbs_sim.model.solve import length, product, solve

Array = NDArray[np.float64]

METHODS = ("averaged", "paper")
VELOCITY_STEP, RATE_STEP, ATTITUDE_STEP = 0.05, 0.01, 1e-3  # m/s, rad/s, rad
BLADE_STEP, BLADE_RATE_STEP, INFLOW_STEP, CONTROL_STEP = 1e-4, 1e-2, 1e-4, 1e-4  # rad, rad/s, 1, rad
STEP_SCALES = (1e-3, 10.0)
BODY_STEPS = {
    **dict.fromkeys(("u", "v", "w"), VELOCITY_STEP),
    **dict.fromkeys(("p", "q", "r"), RATE_STEP),
    **dict.fromkeys(("theta", "phi"), ATTITUDE_STEP),
}
FORCES = {"u": "X", "v": "Y", "w": "Z"}  # Padfield's names by the equation
MOMENTS = {"p": "L'", "q": "M", "r": "N'"}
MOTIONS = ("u", "w", "q", "v", "p", "r")
LOADS = {R.THRUST: ("thrust", "N"), R.TORQUE: ("torque", "N m")}
LOADS |= {R.FORCE + i: (f"hub_force_{axis}", "N") for i, axis in enumerate("xyz")}
LOADS |= {R.MOMENT + i: (f"hub_moment_{axis}", "N m") for i, axis in enumerate("xyz")}


@dataclass(frozen=True, eq=False)
class LinearModel(ByContent):
    """x' = A x + B u, y = C x + D u for small departures from a trimmed flight.

    Attributes
    ----------
    a : ndarray, shape (n, n)
    b : ndarray, shape (n, m)
    c : ndarray, shape (o, n)
    d : ndarray, shape (o, m)
    state_names, state_units : tuple of str, length n
        The paper's order, eq. [18]; states that the fidelity leaves out are not there.
    control_names, control_units : tuple of str, length m
        Pilot controls, eq. [19].
    output_names, output_units : tuple of str, length o
        Body states, climb rate, specific force of the c.g. (body axes), loads and power of every rotor (hub forces and
        moments in body axes about the hub).
    steps : ndarray, shape (n + m,)
        Half the distance of the differences, in the units of states and controls.
    trim : TrimPoint
    method : str
        "averaged" or "paper".
    azimuth_spread : float
        Largest departure of A at one azimuth from their mean, Frobenius norms of the matrices in steps, relative: near
        0 a time-invariant model is exact. Not a number where there is one azimuth only.
    spread : ndarray, shape (n, n + m)
        Half the range over the azimuth of each element of A and B.
    parameter_hash : str
        Of the aircraft, see `Aircraft.parameter_hash`.
    blocks : mapping of str to ndarray
        Method `paper` only: its matrices by name, see `sbs_sim.analysis.paper_method`.
    kinematics : ndarray, shape (8, 8)
        What A_B-B has without any load: turning axes, gravity, attitude, gyroscopic moments; see `kinematics`.
    """

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
    steps: Array
    trim: TrimPoint
    method: str
    azimuth_spread: float
    spread: Array
    parameter_hash: str
    kinematics: Array
    blocks: Mapping[str, Array] = field(default_factory=dict)

    @property
    def warnings(self) -> tuple[str, ...]:
        """Where the model does not hold in the flight that it is about, a line each; see `TrimPoint`."""
        return self.trim.warnings

    @cached_property
    def modes(self) -> tuple[Mode, ...]:
        """Modes by name, slowest first."""
        return modes(self.a, self.state_names)

    @property
    def growing_rotor_modes(self) -> tuple[Mode, ...]:
        """Modes of flap, lag and inflow that grow, slowest first: what no pilot can hold."""
        return tuple(mode for mode in self.modes if mode.family != "body" and mode.is_growing)

    @cached_property
    def poles(self) -> NDArray[np.complex128]:
        """All eigenvalues of A [rad/s], shape (n,), both of each pair, slowest first."""
        poles = np.linalg.eigvals(self.a).astype(complex)
        return poles[np.lexsort((poles.imag, np.abs(poles)))]

    def mode(self, name: str) -> Mode:
        """Mode of a name.

        Raises
        ------
        KeyError
            There is none; the message lists those that there are.
        """
        for mode in self.modes:
            if mode.name == name:
                return mode
        raise KeyError(f"no mode {name!r}: there are {', '.join(mode.name for mode in self.modes)}")

    def quasi_static(self, kept: Sequence[str] = S.LINEAR_BODY_NAMES) -> LinearModel:
        """Model in which all states but the kept ones have settled: A_ss - A_sf A_ff^-1 A_fs and so on.

        Parameters
        ----------
        kept : sequence of str
            Names of states; the order of the result is theirs.

        Raises
        ------
        LinearizationError
            A name that the model does not have, or states that do not settle (A_ff is singular).
        """
        missing = [name for name in kept if name not in self.state_names]
        if missing:
            raise LinearizationError(f"kept = {missing[0]}: allowed are {', '.join(self.state_names)}")
        slow = [self.state_names.index(name) for name in kept]
        fast = [i for i in range(len(self.state_names)) if i not in slow]
        reduced_a, reduced_b, by_state, by_control = settle(self.a, self.b, slow)
        controls = np.arange(len(self.control_names)) + len(self.state_names)
        return replace(
            self,
            a=reduced_a,
            b=reduced_b,
            c=self.c[:, slow] + product(self.c[:, fast], by_state),
            d=self.d + product(self.c[:, fast], by_control),
            state_names=tuple(kept),
            state_units=tuple(self.state_units[i] for i in slow),
            steps=self.steps[[*slow, *controls]],
            spread=self.spread[np.ix_(slow, [*slow, *controls])],
        )

    @cached_property
    def control_effects(self) -> tuple[ControlEffect, ...]:
        """Which way more of each control moves the aircraft at once, rotors and inflow settled.

        Raises
        ------
        LinearizationError
            The model has not all states of the body, or its other states do not settle.
        """
        return control_effects(self.quasi_static().b, S.LINEAR_BODY_NAMES, self.control_names)

    def derivatives(self, quasi_static: bool = True) -> dict[str, float]:
        """Stability and control derivatives, normalised as in Padfield, Helicopter Flight Dynamics, section 4A.2.

        Parameters
        ----------
        quasi_static : bool
            Rotors and inflow settled (what a rigid-body model has), or held (the blocks A_B-B and B of the body).

        Returns
        -------
        dict of str to float
            "X_u" ... "N'_r" and "X_collective" ...: force over mass, moments after the inverse inertia matrix (the
            primed ones), SI units and radians, without the terms of turning axes and gravity.
        """
        model = self.quasi_static() if quasi_static else self
        body = [model.state_names.index(name) for name in S.LINEAR_BODY_NAMES]
        loads = model.a[np.ix_(body, body)] - self.kinematics
        found = {}
        for row, equation in enumerate(S.LINEAR_BODY_NAMES):
            symbol = FORCES.get(equation) or MOMENTS.get(equation)
            if symbol is None:
                continue
            for motion in MOTIONS:
                found[f"{symbol}_{motion}"] = float(loads[row, S.LINEAR_BODY_NAMES.index(motion)])
            for column, control in enumerate(model.control_names):
                found[f"{symbol}_{control}"] = float(model.b[body[row], column])
        return found

    def save(self, path: str | Path) -> None:
        """Write the model to a .npz, .mat or .json file, see `sbs_sim.analysis.export.save`.

        Raises
        ------
        ExportError
            Another suffix, or a file that cannot be written.
        """
        export.save(self, path)

    def to_control(self) -> Any:
        """`control.StateSpace` of python-control with the names of states, inputs and outputs.

        Raises
        ------
        ExportError
            python-control is not installed.
        """
        return export.to_control(self)

    def to_dict(self) -> dict[str, Any]:
        """Everything as plain lists and numbers for JSON, see `sbs_sim.analysis.export.model_to_dict`."""
        return export.model_to_dict(self)

    def _repr_html_(self) -> str:
        from sbs_sim.notebook import model_html

        return model_html(self)


def linearize(
    aircraft: Aircraft,
    airspeed: float | None = None,
    climb_rate: float | None = None,
    sideslip: float | None = None,
    turn_rate: float | None = None,
    *,
    lead_lag: bool | None = None,
    cyclic_inflow: bool | None = None,
    azimuth_count: int | None = None,
    method: str = "averaged",
    step_scale: float = 1.0,
    point: TrimPoint | None = None,
    guess: Guess | None = None,
) -> LinearModel:
    """Linearize an aircraft about a trimmed flight.

    Parameters
    ----------
    aircraft, airspeed, climb_rate, sideslip, turn_rate, lead_lag, cyclic_inflow, azimuth_count, guess :
        See `sbs_sim.trim`, which has the defaults.
    method : str
        "averaged" or "paper".
    step_scale : float
        Factor on all steps of the differences, 0.001 to 10.
    point : TrimPoint, optional
        A trim of this aircraft to linearize about. Condition, fidelity and azimuth count are then its own, and must
        not be given beside it.

    Returns
    -------
    LinearModel

    Raises
    ------
    TrimError
        See `sbs_sim.trim`.
    LinearizationError
        A value out of range, a trim of another aircraft, or a condition together with a trim.
    """
    checks.instance("aircraft", aircraft, Aircraft, LinearizationError)
    checks.choice("method", method, METHODS, LinearizationError)
    step_scale = checks.number("step_scale", step_scale, *STEP_SCALES, "", LinearizationError)
    given: dict[str, Any] = {
        "airspeed": airspeed,
        "climb_rate": climb_rate,
        "sideslip": sideslip,
        "turn_rate": turn_rate,
        "lead_lag": lead_lag,
        "cyclic_inflow": cyclic_inflow,
        "azimuth_count": azimuth_count,
        "guess": guess,
    }
    given = {name: value for name, value in given.items() if value is not None}
    if point is None:
        point = trim(aircraft, **given)
    elif given:
        name, value = next(iter(given.items()))
        raise LinearizationError(f"{name} = {checks.shown(value)}: not allowed with a point, which has its own")
    checks.instance("point", point, TrimPoint, LinearizationError)
    if point.parameter_hash != aircraft.parameter_hash:
        raise LinearizationError("point: allowed is a trim of this aircraft, it is one of another")
    model = _averaged(aircraft, point, step_scale)
    if method == "averaged":
        return model
    from sbs_sim.analysis.paper_method import blocks

    built = blocks(aircraft, point, difference_steps(aircraft, step_scale))
    return replace(model, method="paper", a=built["A"], b=built["B"], blocks=built)


def growing_rotor_modes_text(model: LinearModel, aircraft: Aircraft) -> str:
    """Rotor modes of a linear model that grow, with their poles and the names of the rotors; "none" without any."""
    said = []
    for mode in model.growing_rotor_modes:
        imaginary = f" ± {mode.pole.imag:.5g}i" if mode.is_oscillatory else ""
        names = ", ".join(aircraft.rotors[number - 1].name for number in mode.rotors)
        said.append(f"{mode.name} at {mode.pole.real:.3g}{imaginary} rad/s ({names})")
    return "; ".join(said) or "none"


def settle(a: Array, b: Array, slow: Sequence[int]) -> tuple[Array, Array, Array, Array]:
    """Take it that all states but the slow ones have settled (theory.md eq. 9.3).

    Parameters
    ----------
    a : ndarray, shape (n, n)
    b : ndarray, shape (n, m)
    slow : sequence of int
        Places of the s states that are kept, in the order of the result.

    Returns
    -------
    a, b : ndarray, shape (s, s) and (s, m)
        Of the slow states alone.
    by_state, by_control : ndarray, shape (n - s, s) and (n - s, m)
        The settled states are by_state @ slow states + by_control @ controls.

    Raises
    ------
    LinearizationError
        They do not settle: their matrix is singular.
    """
    fast = [i for i in range(len(a)) if i not in slow]
    try:
        settled = -solve(a[np.ix_(fast, fast)], np.hstack([a[fast][:, slow], b[fast]]))
    except np.linalg.LinAlgError:
        raise LinearizationError("the states that are not kept do not settle: their matrix is singular") from None
    by_state, by_control = settled[:, : len(slow)], settled[:, len(slow) :]
    coupling = a[np.ix_(slow, fast)]
    reduced = a[np.ix_(slow, slow)] + product(coupling, by_state)
    return reduced, b[slow] + product(coupling, by_control), by_state, by_control


def difference_steps(aircraft: Aircraft, scale: float = 1.0) -> Array:
    """Steps of the central differences for all linear states and the controls, shape (linear_size + 4,)."""
    steps = [_state_step(name) for name in aircraft.layout.linear_names]
    return scale * np.array(steps + [CONTROL_STEP] * len(S.CONTROL_NAMES))


def _state_step(name: str) -> float:
    part = S.part_of(name)
    if part.family == "body":
        return BODY_STEPS[name]
    if part.family == "inflow":
        return INFLOW_STEP
    return BLADE_RATE_STEP if part.is_rate else BLADE_STEP


def used_states(point: TrimPoint) -> NDArray[np.int64]:
    """Places in the linear state of those that the fidelity of a trim has."""
    parts = [S.part_of(name) for name in point.state_names]
    used = [
        i
        for i, part in enumerate(parts)
        if (point.lead_lag or part.family != "lag")
        and (point.cyclic_inflow or part.family != "inflow" or part.harmonic == 0)
    ]
    return np.array(used)


def jacobians(aircraft: Aircraft, point: TrimPoint, psi: Array, steps: Array) -> Array:
    """Derivatives of all outputs of `sbs_sim.model.linear` by states and controls, at each azimuth.

    Parameters
    ----------
    aircraft : Aircraft
    point : TrimPoint
    psi : ndarray, shape (n_azimuths, n_rotors)
        [rad]
    steps : ndarray, shape (linear_size + 4,)

    Returns
    -------
    ndarray, shape (n_azimuths, linear_size + 3 + 8 n_rotors, linear_size + 4)
        Columns of states that the fidelity leaves out are zero.
    """
    engine = points_engine(aircraft.arranged(point.lead_lag, point.cyclic_inflow, "points"))
    inputs = np.concatenate([point.state, point.controls])
    outputs = len(point.state) + SPECIFIC_FORCE_SIZE + R.LOAD_SIZE * engine.rotors
    used = np.zeros(len(inputs), dtype=bool)
    used[used_states(point)] = used[len(point.state) :] = True
    result = np.zeros((len(psi), len(inputs), outputs))
    jacobian(
        *(
            engine.code.derivative,
            engine.model,
            inputs,
            aircraft.mixing,
            np.where(used, steps, 0.0),
            np.append(aircraft.layout.linear_owners, np.full(len(S.CONTROL_NAMES), engine.rotors)),
            psi,
            engine.work,
            engine.tick,
        ),
        *(engine.memory(len(inputs)), np.zeros((2, outputs)), np.zeros(engine.n, dtype=np.int64), result),
    )
    return result.transpose(0, 2, 1)


def _averaged(aircraft: Aircraft, point: TrimPoint, step_scale: float) -> LinearModel:
    """Model by central differences of the averaged derivative."""
    steps = difference_steps(aircraft, step_scale)
    each = jacobians(aircraft, point, azimuths(aircraft.layout.blades, point.azimuth_count), steps)
    mean = each.mean(axis=0)
    used = used_states(point)
    size = len(point.state)
    inputs = np.concatenate([used, size + np.arange(len(S.CONTROL_NAMES))])
    outputs, names, units = _outputs(aircraft, point, mean)
    weights = np.zeros((size, size))
    weights[np.ix_(used, used)] = steps[used] / steps[used, None]
    return LinearModel(
        a=mean[np.ix_(used, used)],
        b=mean[used, size:],
        c=outputs[:, used],
        d=outputs[:, size:],
        state_names=tuple(point.state_names[i] for i in used),
        state_units=tuple(aircraft.layout.linear_units[i] for i in used),
        control_names=S.CONTROL_NAMES,
        control_units=("rad",) * len(S.CONTROL_NAMES),
        output_names=names,
        output_units=units,
        steps=steps[inputs],
        trim=point,
        method="averaged",
        azimuth_spread=_relative_spread(each[:, :size, :size] - mean[:size, :size], mean[:size, :size], weights),
        spread=0.5 * np.ptp(each, axis=0)[np.ix_(used, inputs)],
        parameter_hash=aircraft.parameter_hash,
        kinematics=kinematics(point.state, aircraft.body.inertia, aircraft.environment.gravity),
    )


def _relative_spread(departures: Array, mean: Array, weights: Array) -> float:
    """See `LinearModel.azimuth_spread`; weights, shape (n, n), measure every state in its step."""
    if len(departures) == 1:
        return math.nan
    squares = ((departures * weights) ** 2).sum(axis=(1, 2))
    return math.sqrt(squares.max()) / length((mean * weights).ravel())


def _outputs(aircraft: Aircraft, point: TrimPoint, mean: Array) -> tuple[Array, tuple[str, ...], tuple[str, ...]]:
    """Rows of C and D by all states and controls, with names and units."""
    size, inputs = len(point.state), mean.shape[1]
    rows = [*np.eye(inputs)[: S.LINEAR_BODY_SIZE], _climb_row(point, inputs), *mean[size : size + SPECIFIC_FORCE_SIZE]]
    names = [*S.LINEAR_BODY_NAMES, "climb_rate", *(f"specific_force_{axis}" for axis in "xyz")]
    units = [*S.LINEAR_BODY_UNITS, "m/s", *("m/s^2",) * SPECIFIC_FORCE_SIZE]
    loads = mean[size + SPECIFIC_FORCE_SIZE :].reshape(len(aircraft.rotors), R.LOAD_SIZE, inputs)
    for j, rotor in enumerate(aircraft.rotors):
        rows += [*loads[j], rotor.speed * loads[j, R.TORQUE]]
        names += [f"{LOADS[i][0]}({j + 1})" for i in range(R.LOAD_SIZE)] + [f"power({j + 1})"]
        units += [LOADS[i][1] for i in range(R.LOAD_SIZE)] + ["W"]
    return np.stack(rows), tuple(names), tuple(units)


def _climb_row(point: TrimPoint, inputs: int) -> Array:
    """Derivative of the climb rate u sin theta - (v sin phi + w cos phi) cos theta."""
    u, w, _, theta, v, _, phi, _ = point.state[: S.LINEAR_BODY_SIZE].tolist()
    row = np.zeros(inputs)
    (ct, st), (cp, sp) = cosine_and_sine(theta), cosine_and_sine(phi)
    row[S.LINEAR_U] = st
    row[S.LINEAR_V] = -sp * ct
    row[S.LINEAR_W] = -cp * ct
    row[S.LINEAR_THETA] = u * ct + (v * sp + w * cp) * st
    row[S.LINEAR_PHI] = (w * sp - v * cp) * ct
    return row


def kinematics(state: Array, inertia: Array, gravity: float) -> Array:
    """Terms of a rigid body in A_B-B that are not aerodynamic: turning axes, gravity, attitude, gyroscopic moments.

    Padfield, Helicopter Flight Dynamics, section 4A.2, for any trim: U' = F/m - om x U + g, om' = I^-1 (M - om x I om),
    Euler kinematics.

    Parameters
    ----------
    state : ndarray, shape (n,)
        Trimmed linear state; its first eight are the body's.
    inertia : ndarray, shape (3, 3)
        About the c.g. [kg m^2].
    gravity : float
        [m/s^2]

    Returns
    -------
    ndarray, shape (8, 8)
    """
    u, w, q, theta, v, p, phi, r = np.asarray(state, dtype=float)[: S.LINEAR_BODY_SIZE].tolist()
    g = gravity
    (ct, st), (cp, sp) = cosine_and_sine(theta), cosine_and_sine(phi)
    velocity, rates = np.array([u, v, w]), np.array([p, q, r])
    axis = [S.LINEAR_U, S.LINEAR_V, S.LINEAR_W]
    turn = [S.LINEAR_P, S.LINEAR_Q, S.LINEAR_R]
    a = np.zeros((S.LINEAR_BODY_SIZE, S.LINEAR_BODY_SIZE))
    a[np.ix_(axis, axis)] = -_cross(rates)
    a[np.ix_(axis, turn)] = _cross(velocity)
    a[axis, S.LINEAR_THETA] = -g * ct, -g * sp * st, -g * cp * st
    a[axis, S.LINEAR_PHI] = 0.0, g * cp * ct, -g * sp * ct
    momentum = product(inertia, rates[:, np.newaxis])[:, 0]
    gyroscopic = product(_cross(rates), inertia) - _cross(momentum)
    a[np.ix_(turn, turn)] = -solve(inertia, gyroscopic)
    heading = q * sp + r * cp  # psi' cos theta
    a[S.LINEAR_THETA, [S.LINEAR_Q, S.LINEAR_R]] = cp, -sp
    a[S.LINEAR_THETA, S.LINEAR_PHI] = -heading
    a[S.LINEAR_PHI, turn] = 1.0, sp * st / ct, cp * st / ct
    a[S.LINEAR_PHI, S.LINEAR_THETA] = heading / (ct * ct)
    a[S.LINEAR_PHI, S.LINEAR_PHI] = (q * cp - r * sp) * st / ct
    return a


def _cross(vector: Array) -> Array:
    """Matrix of the cross product from the left."""
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
