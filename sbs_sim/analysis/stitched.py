"""Stitch trims and linear models of many airspeeds to one nonlinear model (theory.md section 10)."""

from __future__ import annotations  # `help` then shows types by their names

import itertools
import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sbs_sim import checks
from sbs_sim.aircraft import Aircraft
from sbs_sim.analysis.differences import CONTROL_STEP, difference_steps, used_states
from sbs_sim.analysis.kinematics import kinematics
from sbs_sim.analysis.linear_model import settle
from sbs_sim.analysis.linearize import linearize_trim
from sbs_sim.analysis.trim import solve_trim
from sbs_sim.concurrency.parallel import Execution, compute
from sbs_sim.errors import LinearizationError, SbsError
from sbs_sim.flight.engine import points_engine
from sbs_sim.flight.simulate import simulate
from sbs_sim.flight.stitched import MOTION_NAMES, StitchedModel
from sbs_sim.flight.stitched_simulation import simulate_stitched
from sbs_sim.flight.trim_point import Fidelity, TrimCondition, TrimPoint
from sbs_sim.flight.two_blades import has_two_blades
from sbs_sim.model import state as S
from sbs_sim.model.average import azimuths
from sbs_sim.model.frames import down_of, euler_to_quaternion, rotation_matrix
from sbs_sim.model.linear import SPECIFIC_FORCE_SIZE
from sbs_sim.model.solve import product, solve

Array = NDArray[np.float64]

KEPT = {"all": True, "body": False}
BODY = [S.LINEAR_BODY_NAMES.index(name) for name in MOTION_NAMES]
MAX_ANCHORS = 200
RESPONSES = {"heave": "w", "roll": "p", "pitch": "q", "yaw": "r"}
PULSE, PULSE_SHARE = math.radians(0.5), 0.02  # rad; of the range of what is no angle
PULSE_TIMES, RESPONSE_TIME, TICK = (0.1, 0.4, 0.7), 1.0, 0.01  # s


class LocalModel(NamedTuple):
    """x' = A x + B u of a stitched model for small departures from a state, in still air.

    Attributes
    ----------
    a : ndarray, shape (n, n)
    b : ndarray, shape (n, m)
        By the pilot controls.
    state_names : tuple of str, length n
        The body's in the paper's order, then those that are kept.
    control_names : tuple of str, length m
    """

    a: Array
    b: Array
    state_names: tuple[str, ...]
    control_names: tuple[str, ...]


class Anchor(NamedTuple):
    """A steady flight with its linear model: rows of `StitchedModel` at one anchor.

    Attributes
    ----------
    point : TrimPoint
    trim, trim_slope : ndarray, shape (3 + n_z,)
    matrix : ndarray, shape (6 + n_kept, n_z)
    output, output_slope : ndarray, shape (n_outputs,)
    output_matrix : ndarray, shape (n_outputs, n_z)
    fastest : float
    """

    point: TrimPoint
    trim: Array
    trim_slope: Array
    matrix: Array
    output: Array
    output_slope: Array
    output_matrix: Array
    fastest: float


def stitch(
    aircraft: Aircraft,
    airspeeds: ArrayLike,
    *,
    climb_rates: ArrayLike = 0.0,
    states: str | Sequence[str] = "all",
    lead_lag: bool = True,
    cyclic_inflow: bool = True,
    azimuth_count: int = 12,
    workers: int | None = None,
    progress: Callable[..., None] | None = None,
) -> StitchedModel:
    """Trim and linearize at airspeeds, and stitch what that gives to one nonlinear model.

    Parameters
    ----------
    aircraft : Aircraft
    airspeeds : array_like, shape (n_anchors,)
        Rising, at least two [m/s]; negative is backwards.
    climb_rates : array_like, shape (n_rows,) or ()
        Rising [m/s]. With several, every airspeed is trimmed at all of them, and the model goes from one to the other
        by the z-velocity.
    states : str or sequence of str
        What is kept besides the body: "all" states of rotors, inflow and drives; "body" for none, all these have
        settled then; or their names.
    lead_lag, cyclic_inflow, azimuth_count :
        See `sbs_sim.trim`.
    workers : int, optional
        Number of threads, one for each core if not given. The results are the same for any number.
    progress : callable, optional
        Called with the anchor, the number of anchors done and that of all, as each ends.

    Raises
    ------
    LinearizationError
        A value out of range; an aircraft that a stitched model cannot describe; an anchor without a trim, with the
        reason; anchors whose x-velocities do not rise.
    """
    checks.instance("aircraft", aircraft, Aircraft, LinearizationError)
    refuse(aircraft)
    fidelity = Fidelity(lead_lag, cyclic_inflow, azimuth_count)
    speeds, rates = _rising("airspeeds", airspeeds, 2), _rising("climb_rates", np.atleast_1d(climb_rates), 1)
    kept = _kept(aircraft, states, fidelity)
    execution = Execution(workers, progress)
    conditions = [(rate, speed) for rate in rates for speed in speeds]
    found: list[Anchor | str] = [""] * len(conditions)
    done = itertools.count(1)

    def keep(i: int, anchor: Anchor | str) -> None:
        found[i] = anchor
        if progress is not None:
            progress(anchor, next(done), len(conditions))

    calls = [(aircraft, speed, rate, fidelity, kept) for rate, speed in conditions]
    compute(_anchor, calls, keep, execution, execution.threads(LinearizationError))
    anchors = list[Anchor]()
    for (rate, speed), anchor in zip(conditions, found, strict=True):
        if isinstance(anchor, str):
            raise LinearizationError(f"airspeed = {speed:g}, climb_rate = {rate:g}: {anchor}")
        anchors.append(anchor)
    return _joined(aircraft, fidelity, kept, speeds, rates, anchors)


def refuse(aircraft: Aircraft) -> None:
    """Raise LinearizationError for an aircraft that a stitched model cannot describe."""
    if aircraft.body.is_stand:
        raise LinearizationError("body.stand: allowed for a stitched model is an aircraft in flight")
    if has_two_blades(aircraft):
        raise LinearizationError("a rotor with 2 blades: no constant model describes it, and none can be stitched")
    if aircraft.ground.effect != "none":
        raise LinearizationError(f"ground.effect = {aircraft.ground.effect}: allowed for a stitched model is none")
    if aircraft.has_contact:
        raise LinearizationError(f"ground.contact = {aircraft.ground.contact}: allowed for a stitched model is none")
    if any(rotor.ring_unsteadiness > 0.0 for rotor in aircraft.rotors):
        raise LinearizationError("rotors.ring_unsteadiness: allowed for a stitched model is 0, no noise of the thrust")
    if aircraft.drives:
        raise LinearizationError("drives: allowed for a stitched model are rotors of constant speed")


def local_model(model: StitchedModel, state: ArrayLike, swashplate: ArrayLike) -> LocalModel:
    """Linear model of a stitched model about any state in still air, in closed form.

    Parameters
    ----------
    model : StitchedModel
    state : array_like, shape (size,)
        Simulation state.
    swashplate : array_like, shape (n_rows, 3)
        [rad]
    """
    x, aircraft = np.asarray(state, dtype=float), model.aircraft
    by_z = model.by_z(x[S.VELOCITY : S.BODY_SIZE], x[model.places[S.BODY_SIZE :]], np.ravel(swashplate)[model.inputs])
    n, moved = S.LINEAR_BODY_SIZE + len(model.kept), len(MOTION_NAMES) + len(model.kept)
    order = [*BODY, *range(S.LINEAR_BODY_SIZE, n)]
    a, b = np.zeros((n, n)), np.zeros((n, len(model.inputs)))
    a[np.ix_(order, order)], b[order] = by_z[:, :moved], by_z[:, moved:]
    linear = aircraft.layout.to_linear(x)
    rigid = kinematics(linear, np.array(aircraft.body.inertia), aircraft.environment.gravity)
    a[: S.LINEAR_BODY_SIZE, : S.LINEAR_BODY_SIZE] += rigid
    return LocalModel(a, product(b, aircraft.mixing[model.inputs]), model.state_names, aircraft.control_names)


# --- checks -----------------------------------------------------------------------------------------------------


def _rising(name: str, values: ArrayLike, least: int) -> Array:
    """Rising finite numbers, shape (n,)."""
    numbers = checks.array(name, values, LinearizationError)
    if numbers.ndim != 1 or not least <= len(numbers) <= MAX_ANCHORS:
        raise LinearizationError(f"{name} has shape {numbers.shape}: allowed are {least} to {MAX_ANCHORS} numbers")
    if not (np.isfinite(numbers).all() and (np.diff(numbers) > 0.0).all()):
        raise LinearizationError(f"{name} = {checks.shown(numbers.tolist())}: allowed are rising numbers")
    return numbers


def _kept(aircraft: Aircraft, states: str | Sequence[str], fidelity: Fidelity) -> tuple[str, ...]:
    """Names of the states beside the body's, in the order of the linear state."""
    held = [not fidelity.lead_lag, not fidelity.cyclic_inflow]
    names = []
    for name in aircraft.layout.linear_names[S.LINEAR_BODY_SIZE :]:
        part = S.part_of(name)
        if not (held[0] and part.family == "lag") and not (held[1] and part.family == "inflow" and part.harmonic):
            names.append(name)
    if isinstance(states, str):
        checks.choice("states", states, KEPT, LinearizationError)
        return tuple(names) if KEPT[states] else ()
    for name in states:
        if name not in names:
            raise LinearizationError(f"states: {checks.shown(name)}: allowed are {', '.join(names)}")
    return tuple(name for name in names if name in states)


# --- one anchor -------------------------------------------------------------------------------------------------


def _anchor(
    aircraft: Aircraft, airspeed: float, climb_rate: float, fidelity: Fidelity, kept: tuple[str, ...]
) -> Anchor | str:
    """One anchor, or why there is none."""
    try:
        point = solve_trim(aircraft, TrimCondition(airspeed, climb_rate), fidelity)
        return anchor_of(aircraft, point, kept)
    except SbsError as error:
        return str(error)


def anchor_of(aircraft: Aircraft, point: TrimPoint, kept: tuple[str, ...]) -> Anchor:
    """Trim, linear model and slopes along the trims, at one steady flight."""
    used = used_states(point)
    names = [point.state_names[i] for i in used]
    a, by_angles, by_controls, outputs, output_by_angles = _linear(aircraft, point, used)
    body = S.LINEAR_BODY_SIZE
    rigid = kinematics(point.state, np.array(aircraft.body.inertia), aircraft.environment.gravity)
    for column in (S.LINEAR_THETA, S.LINEAR_PHI):  # what has no load is known exactly
        a[:, column], a[:body, column] = 0.0, rigid[:, column]
    slow = [*range(body), *(names.index(name) for name in kept)]
    x_slope, control_slope = _along(aircraft, point, a, by_controls)
    angle_slope = aircraft.mixing @ control_slope
    inputs = used_inputs(aircraft)
    output_slope = outputs @ x_slope + output_by_angles @ angle_slope
    settled_slope = np.delete(x_slope, slow)
    a_slow, b_slow, by_state, by_angle = settle(a, by_angles, slow)
    fast = [i for i in range(len(names)) if i not in slow]
    outputs, output_by_angles = (
        outputs[:, slow] + product(outputs[:, fast], by_state),
        output_by_angles + product(outputs[:, fast], by_angle),
    )
    g = a_slow.copy()
    g[:body, :body] -= rigid
    order = [*BODY, *range(body, len(slow))]
    down, down_slope = _down(point, x_slope)
    state, angles = point.state[used], point.swashplate.ravel()
    loads = _loads(aircraft, point)
    return Anchor(
        point=point,
        trim=np.concatenate([down, state[slow][order], angles[inputs]]),
        trim_slope=np.concatenate([down_slope, x_slope[slow][order], angle_slope[inputs]]),
        matrix=np.hstack([g[np.ix_(order, order)], b_slow[np.ix_(order, inputs)]]),
        output=np.concatenate([loads, state[fast]]),
        output_slope=np.concatenate([output_slope, settled_slope]),
        output_matrix=np.vstack(
            [
                np.hstack([outputs[:, order], output_by_angles[:, inputs]]),
                np.hstack([by_state[:, order], by_angle[:, inputs]]),
            ]
        ),
        fastest=float(np.abs(np.linalg.eigvals(a_slow)).max()),
    )


def used_inputs(aircraft: Aircraft) -> NDArray[np.int64]:
    """Indices in the raveled swashplate angles of those that are commands."""
    names = [name for row in aircraft.rows for name in (*row.names, *[""] * (S.ROW - len(row.names)))]
    return np.array([i for i, name in enumerate(names) if name], dtype=np.int64)


def _linear(aircraft: Aircraft, point: TrimPoint, used: NDArray[np.int64]) -> tuple[Array, Array, Array, Array, Array]:
    """A, and derivatives by swashplate angles and pilot controls, and those of the loads by states and angles.

    Those by the angles are made to give those by the controls to the last bit but for rounding: the differences of both
    have errors of their own.
    """
    rows, size = S.ROW * len(aircraft.rows), len(point.state)
    steps = difference_steps(aircraft)
    inputs = used_inputs(aircraft)
    angle_steps = np.where(np.isin(np.arange(rows), inputs), _angle_steps(aircraft), 0.0)
    allowed = np.zeros(size, dtype=bool)
    allowed[used] = True
    all_steps = np.concatenate([np.where(allowed, steps[:size], 0.0), angle_steps, steps[size:]])
    rigging = np.hstack([np.eye(rows), aircraft.mixing, np.zeros((rows, 1))])
    at = np.concatenate([point.state, point.swashplate.ravel(), np.zeros(len(aircraft.controls))])
    engine = points_engine(aircraft.arranged(point.lead_lag, point.cyclic_inflow, "points"))
    psi = azimuths(aircraft.passages, point.azimuth_count)
    each = engine.jacobian(at, rigging, all_steps, aircraft.layout.linear_owners, psi).transpose(0, 2, 1)
    mean = each.mean(axis=0)
    loads = slice(size + SPECIFIC_FORCE_SIZE, None)
    angles, controls = slice(size, size + rows), slice(size + rows, None)
    inverse = np.linalg.pinv(aircraft.mixing)
    by_angles, load_by_angles = (
        mean[part, angles] + (mean[part, controls] - mean[part, angles] @ aircraft.mixing) @ inverse
        for part in (used, loads)
    )
    return mean[np.ix_(used, used)], by_angles, mean[used, controls], mean[loads][:, used], load_by_angles


def _angle_steps(aircraft: Aircraft) -> Array:
    """Steps of the differences by swashplate angles: as for a control, of what is no angle by its range."""
    widths = [
        1.0 if row.unit == "rad" else (high - low) or 1.0 for row in aircraft.rows for low, high in _padded(row.ranges)
    ]
    return CONTROL_STEP * np.array(widths)


def _padded(ranges: tuple[tuple[float, float], ...]) -> tuple[tuple[float, float], ...]:
    return (*ranges, *[(0.0, 0.0)] * (S.ROW - len(ranges)))


def _loads(aircraft: Aircraft, point: TrimPoint) -> Array:
    """Mean loads of all rotors, shape (8 n_rotors,)."""
    engine = points_engine(aircraft.arranged(point.lead_lag, point.cyclic_inflow, "points"))
    state = aircraft.layout.from_linear(point.state)
    return engine.average(state, point.swashplate, azimuths(aircraft.passages, point.azimuth_count))[1].ravel()


def _down(point: TrimPoint, slope: Array) -> tuple[Array, Array]:
    """Direction down in body axes, and its derivative along the trims."""
    theta, phi = point.pitch, point.roll
    st, ct, sp, cp = math.sin(theta), math.cos(theta), math.sin(phi), math.cos(phi)
    by_theta, by_phi = np.array([-ct, -sp * st, -cp * st]), np.array([0.0, cp * ct, -sp * ct])
    down = down_of(euler_to_quaternion(0.0, theta, phi)[np.newaxis])[0]
    return down, by_theta * slope[S.LINEAR_THETA] + by_phi * slope[S.LINEAR_PHI]


def _along(aircraft: Aircraft, point: TrimPoint, a: Array, by_controls: Array) -> tuple[Array, Array]:
    """Derivatives of states and pilot controls by the x-velocity along the trims of one climb rate.

    The implicit function theorem: A x' + B c' = 0, where u, v, w follow from airspeed and attitude, and u' = 1.
    """
    slow = list(range(S.LINEAR_BODY_SIZE))
    a_body, b_body, by_state, by_control = settle(a, by_controls, slow)
    trimmed = aircraft.trimmed_controls
    motion = np.zeros((S.LINEAR_BODY_SIZE, 3))  # by airspeed, pitch, roll
    velocities = [S.LINEAR_U, S.LINEAR_V, S.LINEAR_W]
    to_earth = rotation_matrix(euler_to_quaternion(0.0, point.pitch, point.roll))
    velocity = point.state[velocities]
    pitch_axis = np.array([0.0, math.cos(point.roll), -math.sin(point.roll)])
    motion[velocities, 0] = to_earth[0]
    motion[velocities, 1] = np.cross(velocity, pitch_axis)
    motion[velocities, 2] = np.cross(velocity, [1.0, 0.0, 0.0])
    motion[S.LINEAR_THETA, 1] = motion[S.LINEAR_PHI, 2] = 1.0
    equations = np.vstack(
        [
            np.hstack([a_body[BODY] @ motion, b_body[BODY][:, trimmed]]),
            np.append(motion[S.LINEAR_U], np.zeros(len(trimmed))),
        ]
    )
    try:
        found = solve(equations, np.append(np.zeros(len(BODY)), 1.0))
    except np.linalg.LinAlgError:
        raise LinearizationError(
            "the trims near this one do not follow from it: their equations are singular"
        ) from None
    controls = np.zeros(len(aircraft.controls))
    controls[trimmed] = found[3:]
    body = motion @ found[:3]
    slope = np.zeros(len(a))
    slope[slow] = body
    slope[S.LINEAR_BODY_SIZE :] = by_state @ body + by_control @ controls
    return slope, controls


# --- all together -----------------------------------------------------------------------------------------------


def _joined(
    aircraft: Aircraft,
    fidelity: Fidelity,
    kept: tuple[str, ...],
    airspeeds: Array,
    climb_rates: Array,
    anchors: list[Anchor],
) -> StitchedModel:
    """Model of the anchors of all rows, one row after the other."""
    shape = len(climb_rates), len(airspeeds)

    def stacked(name: str) -> Any:
        values = np.array([getattr(anchor, name) for anchor in anchors])
        return values.reshape(*shape, *values.shape[1:])

    model = StitchedModel(
        aircraft=aircraft,
        parameter_hash=aircraft.parameter_hash,
        lead_lag=fidelity.lead_lag,
        cyclic_inflow=fidelity.cyclic_inflow,
        azimuth_count=fidelity.azimuth_count,
        kept=kept,
        inputs=used_inputs(aircraft),
        airspeeds=airspeeds,
        climb_rates=climb_rates,
        trims=stacked("trim"),
        trim_slopes=stacked("trim_slope"),
        matrices=stacked("matrix"),
        output_trims=stacked("output"),
        output_slopes=stacked("output_slope"),
        output_matrices=stacked("output_matrix"),
        residuals=np.array([anchor.point.residual for anchor in anchors]).reshape(shape),
        fastest=max(anchor.fastest for anchor in anchors),
        warnings=_warnings(anchors),
    )
    for rate, row in zip(climb_rates, model.speeds, strict=True):
        if not (np.diff(row) > 0.0).all():
            raise LinearizationError(
                f"airspeeds = {checks.shown(airspeeds.tolist())}: allowed are such whose x-velocities in trim rise; at"
                f" climb_rate = {rate:g} m/s they are {checks.shown(np.round(row, 3).tolist())}"
            )
    return model


def _warnings(anchors: list[Anchor]) -> tuple[str, ...]:
    """What the trims warn of, each line once, with the first airspeed at which it is so."""
    lines = dict[str, None]()
    for anchor in anchors:
        condition = anchor.point.condition
        for text in (*anchor.point.warnings, *(f"beyond limits: {line}" for line in anchor.point.beyond_limits)):
            lines[f"at {condition.airspeed:g} m/s, climb {condition.climb_rate:g} m/s: {text}"] = None
    return tuple(lines)


# --- how good it is ---------------------------------------------------------------------------------------------


def errors_between(model: StitchedModel, workers: int | None = None) -> list[dict[str, float]]:
    """Differences from the full model halfway between the anchors, in every row of climb.

    Returns
    -------
    list of dict
        By name: "airspeed", "climb_rate" [m/s]; "acceleration" [m/s^2] and "angular_acceleration" [rad/s^2], the
        largest that the stitched model has in its own trim there; "attitude_deg" and "control_deg" [deg], the
        largest differences of pitch, roll and swashplate angles from the trim of the full model; "derivatives", of A
        and B of the body with all else settled from those of the full model, over the norm of these, in Frobenius
        norms; and "heave_response" ... of the controls with an axis: largest difference of w, p, q or r in 1 s from
        that of the full model, over the range of the latter, where that control moves by half a degree (or a fiftieth
        of its range) up for 0.3 s and down for 0.3 s.
    """
    middles = [(float(rate), float(speed)) for rate in model.climb_rates for speed in _middles(model.airspeeds)]
    found: list[Any] = [None] * len(middles)

    def keep(i: int, one: Any) -> None:
        found[i] = one

    calls = [(model.aircraft, model, speed, rate) for rate, speed in middles]
    execution = Execution(workers)
    compute(_errors_at, calls, keep, execution, execution.threads(LinearizationError))
    return [one for one in found if one]


def _middles(values: Array) -> Array:
    return np.asarray(0.5 * (values[1:] + values[:-1]))


def _errors_at(aircraft: Aircraft, model: StitchedModel, airspeed: float, climb_rate: float) -> dict[str, float]:
    """Differences at one flight; empty where the full model has no trim."""
    fidelity = Fidelity(model.lead_lag, model.cyclic_inflow, model.azimuth_count)
    try:
        point = solve_trim(aircraft, TrimCondition(airspeed, climb_rate), fidelity)
        full = linearize_trim(aircraft, point).quasi_static()
    except SbsError:
        return {}
    state, swash = model.trim(airspeed, climb_rate)
    rates, linear = model.rates(state, swash)[0], aircraft.layout.to_linear(state)
    own = local_model(model, state, swash)
    a, b, _, _ = settle(own.a, own.b, list(range(S.LINEAR_BODY_SIZE)))
    difference, whole = np.hstack([a - full.a, b - full.b]), np.hstack([full.a, full.b])
    attitude = [S.LINEAR_THETA, S.LINEAR_PHI]
    return {
        "airspeed": airspeed,
        "climb_rate": climb_rate,
        "acceleration": float(np.abs(rates[S.VELOCITY : S.RATES]).max()),
        "angular_acceleration": float(np.abs(rates[S.RATES : S.BODY_SIZE]).max()),
        "attitude_deg": math.degrees(np.abs(linear[attitude] - point.state[attitude]).max()),
        "control_deg": math.degrees(np.abs(swash - point.swashplate).max()),
        "derivatives": float(np.linalg.norm(difference) / np.linalg.norm(whole)),
        **_responses(model, point),
    }


def _responses(model: StitchedModel, point: TrimPoint) -> dict[str, float]:
    """See `errors_between`; without controls that have no room to move."""
    found = {}
    for i, control in enumerate(model.aircraft.controls):
        moved = RESPONSES.get(control.axis)
        low, high = control.range
        size = PULSE if control.is_angle else PULSE_SHARE * (high - low)
        if moved is None or not low <= point.controls[i] - size <= point.controls[i] + size <= high:
            continue
        commands = np.tile(point.controls, (round(RESPONSE_TIME / TICK) + 1, 1))
        begin, middle, end = (round(time / TICK) for time in PULSE_TIMES)
        commands[begin:middle, i] += size
        commands[middle:end, i] -= size
        options: dict[str, Any] = {"lead_lag": model.lead_lag, "cyclic_inflow": model.cyclic_inflow}
        try:
            full = simulate(model.aircraft, point, commands, RESPONSE_TIME, tick=TICK, **options)
            own = simulate_stitched(model, point, commands, RESPONSE_TIME, tick=TICK)
        except SbsError:  # swashplates at their limits
            continue
        found[f"{control.axis}_response"] = float(np.abs(full[moved] - own[moved]).max() / np.ptp(full[moved]))
    return found
