"""Central differences of the model by linear states and controls (theory.md section 9)."""

from __future__ import annotations  # `help` then shows types by their names

import numpy as np
from numpy.typing import NDArray

from sbs_sim.aircraft import Aircraft
from sbs_sim.aircraft.description import Control
from sbs_sim.flight.engine import points_engine
from sbs_sim.flight.trim_point import TrimPoint
from sbs_sim.model import state as S

Array = NDArray[np.float64]

VELOCITY_STEP, RATE_STEP, ATTITUDE_STEP = 0.05, 0.01, 1e-3  # m/s, rad/s, rad
BLADE_STEP, BLADE_RATE_STEP, INFLOW_STEP, CONTROL_STEP = 1e-4, 1e-2, 1e-4, 1e-4  # rad, rad/s, 1, rad
DRIVE_STEP = 2e-4  # of speed, largest torque and throttle
BODY_STEPS = {
    **dict.fromkeys(("u", "v", "w"), VELOCITY_STEP),
    **dict.fromkeys(("p", "q", "r"), RATE_STEP),
    **dict.fromkeys(("theta", "phi"), ATTITUDE_STEP),
}


def difference_steps(aircraft: Aircraft, scale: float = 1.0) -> Array:
    """Steps of the central differences for all linear states and the controls, shape (linear_size + n_controls,)."""
    drives = aircraft.layout.drives
    steps = [_state_step(name) for name in aircraft.layout.linear_names if S.part_of(name).family != "drive"]
    steps += [_drive_step(aircraft, i, name) for i, names in enumerate(drives) for name in names]
    return scale * np.array(steps + [CONTROL_STEP * _size(control) for control in aircraft.controls])


def _size(control: Control) -> float:
    """What a step of a control is measured by: 1 rad, or the range of a control that is no angle."""
    low, high = control.range
    return 1.0 if control.is_angle else (high - low) or 1.0


def _drive_step(aircraft: Aircraft, drive: int, name: str) -> float:
    sizes = {S.SPEED: aircraft.drive_speed(drive), S.ENGINE_TORQUE: aircraft.drives[drive].max_torque, S.GOVERNOR: 1.0}
    return DRIVE_STEP * sizes[name]


def _state_step(name: str) -> float:
    part = S.part_of(name)
    if part.family == "body":
        return BODY_STEPS[name]
    if part.family in ("inflow", "wake"):
        return INFLOW_STEP
    return BLADE_RATE_STEP if part.is_rate else BLADE_STEP


def used_states(point: TrimPoint) -> NDArray[np.int64]:
    """Indices in the linear state of those that the fidelity of a trim has."""
    parts = [S.part_of(name) for name in point.state_names]
    used = [
        i
        for i, part in enumerate(parts)
        if (point.lead_lag or part.family != "lag")
        and (point.cyclic_inflow or part.family != "inflow" or part.harmonic == 0)
    ]
    return np.array(used)


def jacobians(aircraft: Aircraft, point: TrimPoint, psi: Array, steps: Array, states: Array | None = None) -> Array:
    """Derivatives of all outputs of `sbs_sim.model.linear` by states and controls, at each azimuth.

    Parameters
    ----------
    aircraft : Aircraft
    point : TrimPoint
    psi : ndarray, shape (n_azimuths, n_rotors)
        [rad]
    steps : ndarray, shape (linear_size + n_controls,)
    states : ndarray, shape (n_azimuths, linear_size), optional
        At each azimuth; that of the trim if not given.

    Returns
    -------
    ndarray, shape (n_azimuths, linear_size + 3 + 8 n_rotors, linear_size + n_controls)
        Columns of states that the fidelity leaves out are zero.
    """
    engine = points_engine(aircraft.arranged(point.lead_lag, point.cyclic_inflow, "points"))
    used = np.zeros(len(point.state) + len(point.controls), dtype=bool)
    used[used_states(point)] = used[len(point.state) :] = True
    steps = np.where(used, steps, 0.0)

    def at(state: Array, azimuths: Array) -> Array:
        inputs = np.concatenate([state, point.controls])
        return engine.jacobian(inputs, aircraft.rigging, steps, aircraft.layout.linear_owners, azimuths)

    if states is None:
        return at(point.state, psi).transpose(0, 2, 1)
    each = [at(state, own[np.newaxis])[0].T for state, own in zip(states, psi, strict=True)]
    return np.array(each)
