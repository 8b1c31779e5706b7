"""Linear models: A, B, C, D about a trimmed flight (theory.md section 9; paper section 2.3).

Two constructions of the same matrices. `averaged` takes central differences of the derivative averaged over the
azimuth. `paper` builds them term by term as the paper's eqs. [20] to [34] do, with its blocks by name.
"""

from __future__ import annotations  # `help` then shows types by their names

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sbs_sim import checks
from sbs_sim.aircraft import Aircraft
from sbs_sim.analysis.control_effects import ControlEffect
from sbs_sim.analysis.differences import difference_steps, jacobians, used_states
from sbs_sim.analysis.kinematics import kinematics
from sbs_sim.analysis.linear_model import LinearModel
from sbs_sim.analysis.linear_outputs import load_outputs, relative_spread
from sbs_sim.analysis.paper_method import blocks
from sbs_sim.analysis.periodic import in_place_of_a_model
from sbs_sim.analysis.stand_model import StandModel
from sbs_sim.analysis.trim import Guess, trim
from sbs_sim.errors import LinearizationError
from sbs_sim.flight.trim_point import StandPoint, TrimPoint
from sbs_sim.flight.two_blades import has_two_blades, substitute, trim_of_substitute
from sbs_sim.model import state as S
from sbs_sim.model.average import azimuths
from sbs_sim.model.elementary import cosine_and_sine

Array = NDArray[np.float64]

METHODS = ("averaged", "paper")
STEP_SCALES = (1e-3, 10.0)


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
        A value out of range, a trim of another aircraft, a condition together with a trim, or a rotor with two blades.
    """
    _check_options(aircraft, method, step_scale)
    _check_blades(aircraft)
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
    return linearize_trim(aircraft, point, method=method, step_scale=step_scale)


def linearize_trim(
    aircraft: Aircraft, point: TrimPoint, *, method: str = "averaged", step_scale: float = 1.0
) -> LinearModel:
    """Linearize an aircraft about a trim of it; see `linearize`."""
    step_scale = _check_options(aircraft, method, step_scale)
    _check_blades(aircraft)
    checks.instance("point", point, TrimPoint, LinearizationError)
    if method == "paper" and aircraft.drives:
        raise LinearizationError("method = 'paper': allowed with drives is averaged")
    if method == "paper" and any(rotor.duct_exit is not None for rotor in aircraft.rotors):
        raise LinearizationError("method = 'paper': allowed with ducts of a fixed exit is averaged")
    if point.parameter_hash != aircraft.parameter_hash:
        raise LinearizationError("point: allowed is a trim of this aircraft, it is one of another")
    if isinstance(point, StandPoint):
        if method == "paper":
            raise LinearizationError("method = 'paper': allowed on a stand is averaged")
        return StandModel(aircraft, point, step_scale).build()
    model = _averaged(aircraft, point, step_scale)
    if method == "averaged":
        return model
    built = blocks(aircraft, point, difference_steps(aircraft, step_scale))
    return replace(model, method="paper", a=built["A"], b=built["B"], blocks=built)


def _check_options(aircraft: Aircraft, method: str, step_scale: float) -> float:
    """Raise LinearizationError for a value out of range; the factor on all steps as a number."""
    checks.instance("aircraft", aircraft, Aircraft, LinearizationError)
    checks.choice("method", method, METHODS, LinearizationError)
    return checks.number("step_scale", step_scale, *STEP_SCALES, "", LinearizationError)


def trim_effects(aircraft: Aircraft, point: TrimPoint) -> tuple[ControlEffect, ...]:
    """What each control does about a trim of an aircraft; with two blades in the mean over a revolution."""
    if has_two_blades(aircraft):
        aircraft, point = substitute(aircraft), trim_of_substitute(aircraft, point)
    return linearize_trim(aircraft, point).control_effects


def _check_blades(aircraft: Aircraft) -> None:
    for rotor in aircraft.rotors:
        if rotor.blades == 2:
            raise LinearizationError(
                f"{rotor.name} has 2 blades: no constant model describes them; {in_place_of_a_model(aircraft)}"
            )


def _averaged(aircraft: Aircraft, point: TrimPoint, step_scale: float) -> LinearModel:
    """Model by central differences of the averaged derivative."""
    steps = difference_steps(aircraft, step_scale)
    each = jacobians(aircraft, point, azimuths(aircraft.passages, point.azimuth_count), steps)
    mean = each.mean(axis=0)
    used = used_states(point)
    size = len(point.state)
    inputs = np.concatenate([used, size + np.arange(len(aircraft.controls))])
    outputs, names, units = model_outputs(aircraft, point, mean)
    weights = np.zeros((size, size))
    weights[np.ix_(used, used)] = steps[used] / steps[used, None]
    return LinearModel(
        a=mean[np.ix_(used, used)],
        b=mean[used, size:],
        c=outputs[:, used],
        d=outputs[:, size:],
        state_names=tuple(point.state_names[i] for i in used),
        state_units=tuple(aircraft.layout.linear_units[i] for i in used),
        control_names=aircraft.control_names,
        control_units=aircraft.control_units,
        control_axes=tuple(control.axis for control in aircraft.controls),
        output_names=names,
        output_units=units,
        steps=steps[inputs],
        trim=point,
        method="averaged",
        azimuth_spread=relative_spread(each[:, :size, :size] - mean[:size, :size], mean[:size, :size], weights),
        spread=0.5 * np.ptp(each, axis=0)[np.ix_(used, inputs)],
        parameter_hash=aircraft.parameter_hash,
        kinematics=kinematics(point.state, aircraft.body.inertia, aircraft.environment.gravity),
    )


def model_outputs(aircraft: Aircraft, point: TrimPoint, mean: Array) -> tuple[Array, tuple[str, ...], tuple[str, ...]]:
    """Rows of C and D by all states and controls, with names and units."""
    size, inputs = len(point.state), mean.shape[1]
    rows, names, units = load_outputs(aircraft, point, mean[size:], (*point.state_names, *aircraft.control_names))
    body = [*np.eye(inputs)[: S.LINEAR_BODY_SIZE], _climb_row(point, inputs)]
    return (
        np.stack([*body, *rows]),
        (*S.LINEAR_BODY_NAMES, "climb_rate", *names),
        (*S.LINEAR_BODY_UNITS, "m/s", *units),
    )


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
