"""Start of a flight: the simulation state of a trim point."""

from __future__ import annotations  # `help` then shows types by their names

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sbs_sim import checks
from sbs_sim.aircraft import Aircraft
from sbs_sim.errors import SimulationError
from sbs_sim.flight.trim_point import StandPoint, TrimPoint
from sbs_sim.model import state as S
from sbs_sim.model.frames import euler_to_quaternion, rotation_matrix

Array = NDArray[np.float64]


def trimmed_state(
    aircraft: Aircraft,
    point: TrimPoint,
    position: ArrayLike = (0.0, 0.0, 0.0),
    heading: float = 0.0,
    wind: ArrayLike = (0.0, 0.0, 0.0),
) -> Array:
    """Simulation state of a trim point.

    Parameters
    ----------
    aircraft : Aircraft
    point : TrimPoint
    position : array_like, shape (3,)
        NED [m].
    heading : float
        From north to east [rad].
        On a stand both are those of the rest, and must not be given.
    wind : array_like, shape (3,)
        Steady wind, NED [m/s]; the aircraft is trimmed relative to the air and drifts with it.

    Returns
    -------
    ndarray, shape (size,)

    Raises
    ------
    SimulationError
        A trim of an aircraft with other rotors; one that is no rest of a stand for an aircraft on a stand; a heading
        that is not finite or far from a turn. Position and velocity are checked by `Simulation`.
    """
    if aircraft.body.is_stand and not isinstance(point, StandPoint):
        raise SimulationError("body.stand: allowed on a stand is a start from a trim on it, or give a state")
    if point.state_names != aircraft.layout.linear_names:
        own = ", ".join(str(rotor.blades) for rotor in aircraft.rotors)
        raise SimulationError(
            f"start: a trim with {len(point.state_names)} states: allowed is one of an aircraft with {own} blades, with"
            f" {aircraft.layout.linear_size}"
        )
    if isinstance(point, StandPoint):
        if np.any(position) or heading:
            raise SimulationError("position, heading: allowed is none for a start from the rest of a stand")
        return point.simulation_state(aircraft.layout)
    heading = checks.number("heading", heading, -4 * math.pi, 4 * math.pi, "rad", SimulationError)
    state = aircraft.layout.from_linear(point.state, heading)
    state[: S.ATTITUDE] = position
    north, east, down = np.asarray(wind, dtype=float).tolist()
    to_earth = rotation_matrix(euler_to_quaternion(heading, point.pitch, point.roll))
    state[S.VELOCITY : S.RATES] += to_earth[0] * north + to_earth[1] * east + to_earth[2] * down
    return state
