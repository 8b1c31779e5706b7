"""Hover hold: position and heading by state feedback, from the linear model of hover to the controls of every tick.

1. Rotors and inflow are taken to have settled (theory.md section 9.2): eight body states are left of 38.
2. Appended are position and heading, their integrals, which find the controls that a steady wind needs, and a lag of
   every control. That lag keeps the feedback away from the lag motion of the blades, at 125 rad/s and hardly damped.
3. Gains by LQR, weighted by Bryson's rule. A new target moves the integrals to where the cost is least, or they would
   have to overshoot it.
4. The result is checked with all 38 states, sampled at every tick, its controls one tick late.
"""

from __future__ import annotations  # `help` then shows types by their names

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sbs_sim import checks
from sbs_sim.aircraft import axis_controls
from sbs_sim.analysis.linear_model import LinearModel, settle
from sbs_sim.content import ByContent
from sbs_sim.errors import AircraftError, PilotError
from sbs_sim.model import state as S
from sbs_sim.model.frames import euler_to_quaternion, quaternion_to_euler, rotation_matrix
from sbs_sim.pilot.feedback import Compensator, ComplexArray, Margin, Plant, closed_loop_poles, lqr, margins

Array = NDArray[np.float64]

TICK = 0.01  # s
DELAY = 1  # ticks between a state and the controls that it gives, for the check
FILTER_TIME = 0.05  # s, lag of every control
HELD = ("forward", "right", "down", "heading")  # departures from the target, along the heading [m, m, m, rad]
MEASURED = S.LINEAR_BODY_NAMES + HELD
INTEGRALS = tuple(f"{name} integral" for name in HELD)
STATES = MEASURED + INTEGRALS + tuple(f"{name} lag" for name in S.CONTROL_NAMES)
LIMITS = {  # departures that cost alike: metres, seconds, radians
    **dict.fromkeys(("u", "v", "w"), 1.0),
    **dict.fromkeys(("p", "q", "r"), math.radians(40.0)),
    **dict.fromkeys(("theta", "phi"), math.radians(10.0)),
    **dict.fromkeys(("forward", "right", "down"), 0.5),
    "heading": math.radians(10.0),
    **dict.fromkeys(("forward integral", "right integral", "down integral"), 1.0),
    "heading integral": math.radians(20.0),
    **dict.fromkeys(("collective", "lateral_cyclic", "longitudinal_cyclic"), math.radians(1.0)),
    "differential_longitudinal_cyclic": math.radians(2.0),
}
LIMIT_RANGE = 1e-4, 1e4  # of any of them
AUTHORITY = math.radians(5.0)  # rad, largest departure of a control from its trim
REACH = 1.5  # m; a target that is farther away counts as this far, which limits attitude and speed on the way
TURN_REACH = math.radians(30.0)  # rad, likewise for the heading
MAX_STATE_INTERVAL = 0.1  # s between two states that integrals go on over
AT_REST = 1e-9  # m/s, rad/s
MAX_STATE_VALUE = 1e9  # of any value of a state that can be flown by: squares and products of them stay numbers


def pilot_axes(axes: Sequence[str], units: Sequence[str]) -> NDArray[np.int64]:
    """Indices of the controls that heave, roll, pitch and yaw, of the axes and units of all, shape (4,).

    Raises
    ------
    PilotError
        No control has one of these axes, or it is no angle.
    """
    try:
        return axis_controls(axes, units)
    except AircraftError as error:
        raise PilotError(str(error)) from None


@dataclass(frozen=True, eq=False)
class HoverModel(ByContent):
    """What the design takes of a linear model of hover: x' = a x + b u about the trim.

    Attributes
    ----------
    state_names : tuple of str, length n
    a : ndarray, shape (n, n)
    b : ndarray, shape (n, 4)
        By the controls of the four axes.
    controls : ndarray, shape (n_controls,)
        Trimmed pilot controls [rad, or their units].
    pitch, roll : float
        Trimmed attitude [rad].
    axes : ndarray of int64, shape (4,)
        Indices of the controls that heave, roll, pitch and yaw.
    """

    state_names: tuple[str, ...]
    a: Array
    b: Array
    controls: Array
    pitch: float
    roll: float
    axes: NDArray[np.int64]

    @classmethod
    def of(cls, model: LinearModel) -> HoverModel:
        """Take it from a linear model.

        Raises
        ------
        PilotError
            The model is not one of hover, or has no control for one of the axes.
        """
        point, axes = model.trim, pilot_axes(model.control_axes, model.control_units)
        return cls.checked(
            point.condition, model.state_names, model.a, model.b[:, axes], point.controls, point.pitch, point.roll, axes
        )

    @classmethod
    def checked(cls, condition: Any, *values: Any) -> HoverModel:
        """Take the attributes in their order, if the condition of their trim is hover.

        Raises
        ------
        PilotError
            It is another: naming what is not zero.
        """
        for name in ("airspeed", "climb_rate", "turn_rate"):
            if abs(getattr(condition, name)) > AT_REST:
                raise PilotError(f"{name} = {getattr(condition, name):g}: allowed is a model of hover, 0")
        return cls(*values)

    @property
    def axis_trim(self) -> Array:
        """Trimmed controls of the four axes [rad], shape (4,)."""
        return np.asarray(self.controls[self.axes])

    def plant(self) -> Plant:
        """All states, then position and heading; the measured ones are body states, position and heading."""
        n = len(self.state_names)
        a, b = _with_position(self.state_names, self.a, self.b, self.pitch, self.roll)
        measured = [self.state_names.index(name) for name in S.LINEAR_BODY_NAMES] + list(range(n, n + len(HELD)))
        return Plant(a, b, np.eye(n + len(HELD))[measured])


@dataclass(frozen=True, eq=False)
class HoverHoldDesign(ByContent):
    """Gains of the hover hold, and what they give.

    Attributes
    ----------
    model : HoverModel
    gains : ndarray, shape (4, 20)
        K of u = u_trim - K x before the lag; x as `STATES`, SI units and radians.
    anticipation : ndarray, shape (4, 4)
        What the integrals are moved by for a jump of the departures in `HELD`: least cost-to-go.
    poles : ndarray of complex, shape (20,)
        Of the model that the gains were designed for [rad/s].
    complete_poles : ndarray of complex
        With all states of the rotors, sampled, `DELAY` ticks late [rad/s].
    margins : tuple of Margin, length 5
        There, at each control, and at all of them at once.
    """

    model: HoverModel
    gains: Array
    anticipation: Array
    poles: ComplexArray
    complete_poles: ComplexArray
    margins: tuple[Margin, ...]

    @property
    def is_stable(self) -> bool:
        """True if the complete model is stable."""
        return bool(np.all(self.complete_poles.real < 0.0))

    def describe(self) -> list[str]:
        """Gains, poles and margins as lines of text."""
        return _describe(self)


def design(model: HoverModel, limits: Mapping[str, float] | None = None) -> HoverHoldDesign:
    """Design a hover hold.

    Parameters
    ----------
    model : HoverModel
    limits : mapping of str to float, optional
        Departures that cost alike, instead of those in `LIMITS`: a smaller one is held more tightly.

    Raises
    ------
    PilotError
        A limit of an unknown name or not from 0.0001 to 10 000; or a model that this feedback does not stabilise, with
        all states.
    """
    checks.instance("model", model, HoverModel, PilotError)
    wanted = _checked_limits({} if limits is None else limits)
    a, b = design_matrices(model)
    states = np.array([wanted.get(name, math.inf) for name in STATES])
    gains, poles, cost = lqr(a, b, states, np.array([wanted[name] for name in S.CONTROL_NAMES]))
    plant, feedback = model.plant(), compensator(gains)
    found = HoverHoldDesign(
        model,
        gains,
        _anticipation(cost),
        poles,
        closed_loop_poles(plant, feedback, TICK, DELAY),
        margins(plant, feedback, TICK, DELAY),
    )
    if not found.is_stable:
        worst = found.complete_poles[np.argmax(found.complete_poles.real)]
        raise PilotError(
            f"with these gains the complete model has a pole at {worst:.3g} rad/s: allow larger departures"
        )
    return found


def _anticipation(cost: Array) -> Array:
    """Integrals of least cost per departure: where the derivative of x^T cost x by the integrals vanishes."""
    held = slice(len(S.LINEAR_BODY_NAMES), len(MEASURED))
    integrals = slice(len(MEASURED), len(MEASURED) + len(INTEGRALS))
    return -np.asarray(np.linalg.solve(cost[integrals, integrals], cost[integrals, held]), float)


def _checked_limits(changes: Mapping[str, float]) -> dict[str, float]:
    checks.instance("limits", changes, Mapping, PilotError)
    for name, value in changes.items():
        if name not in LIMITS:
            raise PilotError(f"limit {checks.shown(name)}: unknown, allowed are {', '.join(LIMITS)}")
        checks.number(f"limit {name}", value, *LIMIT_RANGE, "", PilotError)
    return {**LIMITS, **changes}


def design_matrices(model: HoverModel) -> tuple[Array, Array]:
    """a, shape (20, 20), and b, shape (20, 4), of what the gains are designed for; the states are `STATES`."""
    body = [model.state_names.index(name) for name in S.LINEAR_BODY_NAMES]
    reduced_a, reduced_b, _, _ = settle(model.a, model.b, body)
    position_a, position_b = _with_position(S.LINEAR_BODY_NAMES, reduced_a, reduced_b, model.pitch, model.roll)
    n, held, m = len(MEASURED), len(HELD), len(S.CONTROL_NAMES)
    a = np.zeros((len(STATES),) * 2)
    a[:n, :n] = position_a
    a[n : n + held, n - held : n] = np.eye(held)
    a[:n, n + held :] = position_b  # what moves the aircraft is the control behind its lag
    a[n + held :, n + held :] = -np.eye(m) / FILTER_TIME
    return a, np.vstack([np.zeros((n + held, m)), np.eye(m) / FILTER_TIME])


def _with_position(names: tuple[str, ...], a: Array, b: Array, pitch: float, roll: float) -> tuple[Array, Array]:
    """Append forward, right, down and heading: their rates near hover (theory.md section 1.1)."""
    n = len(names)
    wide = np.zeros((n + len(HELD),) * 2)
    wide[:n, :n] = a
    wide[n : n + 3, [names.index(name) for name in "uvw"]] = rotation_matrix(euler_to_quaternion(0.0, pitch, roll))
    wide[n + 3, names.index("q")] = math.sin(roll) / math.cos(pitch)
    wide[n + 3, names.index("r")] = math.cos(roll) / math.cos(pitch)
    return wide, np.vstack([b, np.zeros((len(HELD), b.shape[1]))])


def compensator(gains: Array, tick: float = TICK) -> Compensator:
    """What `HoverHold` does within its limits at one heading: integrals, then lags of the four controls."""
    n, held, m = len(MEASURED), len(HELD), len(S.CONTROL_NAMES)
    by_measured, by_integral, by_lag = np.split(gains, [n, n + held], axis=1)
    new = -math.expm1(-tick / FILTER_TIME)  # share of what is commanded that a tick lets through
    onto_controls = np.hstack([-new * by_integral, (1.0 - new) * np.eye(m) - new * by_lag])
    integrate = np.hstack([np.zeros((held, n - held)), tick * np.eye(held)])
    return Compensator(
        a=np.vstack([np.hstack([np.eye(held), np.zeros((held, m))]), onto_controls]),
        b=np.vstack([integrate, -new * by_measured]),
        c=onto_controls,
        d=-new * by_measured,
    )


class HoverHold:
    """The controller in flight: give it every state, it gives the controls.

    Parameters
    ----------
    found : HoverHoldDesign
    """

    def __init__(self, found: HoverHoldDesign) -> None:
        self._gains, self._anticipation = found.gains, found.anticipation
        self._trim, self._axes = found.model.controls, found.model.axes
        self._attitude = np.array([found.model.pitch, found.model.roll])
        self.restart()

    def restart(self, target: tuple[Array, float] | None = None) -> None:
        """Forget integrals and time, and hold another position and heading; those of the next state if not given."""
        self.target = target
        self._wanted: tuple[Array, float] | None = None
        self._integral = np.zeros(len(HELD))  # north, east, down, heading
        self._departure = np.zeros(len(S.CONTROL_NAMES))
        self._time: float | None = None

    def take_over(self, target: tuple[Array, float], heading: float, controls: Array) -> None:
        """Begin anew at a target, NED [m] and heading [rad], with the controls, shape (n_controls,), that are in force.

        The integrals begin where they command these controls to an aircraft at rest at its target.
        """
        self.restart(target)
        self._departure = np.clip(controls[self._axes] - self._trim[self._axes], -AUTHORITY, AUTHORITY)
        n, held = len(MEASURED), len(HELD)
        by_integral, by_lag = self._gains[:, n : n + held], self._gains[:, n + held :]
        integral = -np.asarray(np.linalg.solve(by_integral, self._departure + by_lag @ self._departure), float)
        self._integral = _turned(-heading, integral)

    def hold(self, position: ArrayLike, heading: float) -> None:
        """From the next state on go to a position, NED [m], shape (3,), and a heading, from north to east [rad].

        Raises
        ------
        PilotError
            A number that is not finite.
        """
        self._wanted = checked_target(position, heading)

    def controls(self, time: float, body: ArrayLike) -> Array:
        """Pilot controls, shape (n_controls,), of a state.

        Parameters
        ----------
        time : float
            Of the state [s]; where it goes back, everything begins anew.
        body : array_like
            Simulation state, or its first 13 values: position, attitude, velocity over ground, rates.

        Raises
        ------
        PilotError
            A value that is not finite; nothing has changed then.
        """
        values = checked_body(time, body)
        heading, pitch, roll = quaternion_to_euler(values[S.ATTITUDE : S.VELOCITY])
        if self._time is not None and time < self._time:
            self.restart()
        elapsed = TICK if self._time is None else min(time - self._time, MAX_STATE_INTERVAL)
        self._time = time
        self._aim(values[: S.ATTITUDE], heading)
        error, within = self._error(values[: S.ATTITUDE], heading)
        u, v, w, p, q, r = values[S.VELOCITY : S.BODY_SIZE]
        theta, phi = np.array([pitch, roll]) - self._attitude
        body_states = [u, w, q, theta, v, p, phi, r]
        integral = _turned(heading, self._integral)
        wanted = -self._gains @ np.concatenate([body_states, _turned(heading, error), integral, self._departure])
        clipped = np.clip(wanted, -AUTHORITY, AUTHORITY)
        new = -math.expm1(-elapsed / FILTER_TIME)
        self._departure = self._departure + new * (clipped - self._departure)
        if np.array_equal(wanted, clipped):  # integrals that cannot act would only wind up
            self._integral = self._integral + np.where(within, elapsed * error, 0.0)
        controls = self._trim.copy()
        controls[self._axes] += self._departure
        return controls

    def _aim(self, position: Array, heading: float) -> None:
        """Take over a new target; without any, stay."""
        if self.target is None:
            self.target = (position.copy(), heading)
        if self._wanted is not None:
            before, _ = self._error(position, heading)
            self.target, self._wanted = self._wanted, None
            jump = self._error(position, heading)[0] - before
            self._integral += _turned(-heading, self._anticipation @ _turned(heading, jump))

    def _error(self, position: Array, heading: float) -> tuple[Array, NDArray[np.bool_]]:
        """Departure from the target, north, east, down, heading, cut to what is reached for; and where it was not."""
        assert self.target is not None
        target, course = self.target
        error = position - target
        turn = math.remainder(heading - course, 2.0 * math.pi)
        far = max(1.0, math.hypot(error[0], error[1]) / REACH)
        high, around = max(1.0, abs(error[2]) / REACH), max(1.0, abs(turn) / TURN_REACH)
        share = np.array([far, far, high, around])
        return np.append(error, turn) / share, share == 1.0


def checked_target(position: ArrayLike, heading: float) -> tuple[Array, float]:
    """Position, NED [m], shape (3,), and heading [rad] of a target, if they are finite.

    Raises
    ------
    PilotError
        They are not.
    """
    target = checks.array("position", position, PilotError)
    if target.shape != (3,) or not np.all(np.abs(target) <= MAX_STATE_VALUE):
        raise PilotError(
            f"position = {checks.shown(target.tolist())}: allowed are 3 numbers up to {MAX_STATE_VALUE:g} m"
        )
    return target, checks.number("heading", heading, -MAX_STATE_VALUE, MAX_STATE_VALUE, "rad", PilotError)


def checked_body(time: float, body: ArrayLike) -> Array:
    """Position, attitude, velocity and rates, shape (13,): the first part of a simulation state, if it is finite.

    Raises
    ------
    PilotError
        It is not, or the time [s] is not.
    """
    values = checks.array("state", body, PilotError)
    if values.ndim != 1 or len(values) < S.BODY_SIZE:
        raise PilotError(f"state has the shape {values.shape}: allowed are {S.BODY_SIZE} numbers or more")
    values = values[: S.BODY_SIZE]
    checks.number("time", time, -MAX_STATE_VALUE, MAX_STATE_VALUE, "s", PilotError)
    if not np.all(np.abs(values) <= MAX_STATE_VALUE):  # false for a NaN as well
        raise PilotError(
            f"state {values.tolist()} at {time:g} s: allowed are -{MAX_STATE_VALUE:g} to {MAX_STATE_VALUE:g}"
        )
    if not values[S.ATTITUDE : S.VELOCITY].any():
        raise PilotError("state: attitude = 0: allowed is a quaternion")
    return values


def _turned(heading: float, values: Array) -> Array:
    """North, east, down and a fourth value as forward, right, down and the same; the way back with -heading."""
    c, s = math.cos(heading), math.sin(heading)
    return np.array([c * values[0] + s * values[1], c * values[1] - s * values[0], values[2], values[3]])


# --- in words ---------------------------------------------------------------------------------------------------


def _describe(found: HoverHoldDesign) -> list[str]:
    lines = ["gains, u = u_trim - K x [SI units, rad]", f"{'':24}" + "".join(f"{n[:13]:>14}" for n in _SHORT)]
    for name, column in zip(STATES, found.gains.T, strict=True):
        if not name.endswith(" lag"):
            lines.append(f"{name:24}" + "".join(f"{value:14.4f}" for value in column))
    lines.append("poles of the design [rad/s]: " + _poles(found.poles))
    slow = found.complete_poles[: len(found.poles)]
    n = len(found.model.state_names)
    lines.append(f"slowest with all {n} states, sampled, {DELAY} tick late: " + _poles(slow))
    lines.append(f"{'margins there':24}{'disk':>8}{'at rad/s':>10}{'gain':>18}{'phase deg':>11}")
    for name, margin in zip((*S.CONTROL_NAMES, "all at once"), found.margins, strict=True):
        gain = f"{margin.gain_low:.2f} to {margin.gain_high:.2f}"
        lines.append(
            f"{name[:23]:24}{margin.disk:8.2f}{margin.frequency:10.2f}{gain:>18}{math.degrees(margin.phase):11.1f}"
        )
    return lines


_SHORT = ("collective", "lateral", "longitudinal", "differential")


def _poles(poles: ComplexArray) -> str:
    """Each pair once."""
    return ", ".join(
        f"{pole.real:.2f}" + (f" +- {pole.imag:.2f}i" if pole.imag > 1e-9 else "")
        for pole in poles
        if pole.imag > -1e-9
    )
