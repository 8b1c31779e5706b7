"""Start of a flight: the simulation state of a trim point."""

from __future__ import annotations  # `help` then shows types by their names

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sbs_sim import checks
from sbs_sim.aircraft import Aircraft
from sbs_sim.aircraft.model_records import drive_of
from sbs_sim.errors import SimulationError
from sbs_sim.flight.engine import Engine
from sbs_sim.flight.trim_point import StandPoint, TrimPoint
from sbs_sim.model import state as S
from sbs_sim.model.frames import euler_to_quaternion, quaternion_to_euler, rotation_matrix

Array = NDArray[np.float64]

MAX_SPEED = 1.5  # of rotors at the start, over that of the trim


def trimmed_state(
    aircraft: Aircraft,
    point: TrimPoint,
    position: ArrayLike = (0.0, 0.0, 0.0),
    heading: float = 0.0,
    wind: ArrayLike = (0.0, 0.0, 0.0),
    rotor_speed: float = 1.0,
) -> Array:
    """Simulation state of a trim point.

    Parameters
    ----------
    aircraft : Aircraft
    point : TrimPoint
    position : array_like, shape (3,)
        NED [m].
    heading : float
        From north to east [rad]. On a stand both are on top of those of its rest.
    wind : array_like, shape (3,)
        Steady wind, NED [m/s]; an aircraft is trimmed relative to the air and drifts with it, a stand does not.
    rotor_speed : float
        Speed of rotors that have a drive over that of the trim, 0 to 1.5; see `slowed`.

    Returns
    -------
    ndarray, shape (size,)

    Raises
    ------
    SimulationError
        A trim of an aircraft with other rotors; one that is no rest of a stand for an aircraft on a stand; a heading
        that is not finite or far from a turn; another rotor speed than 1 without drives. Position and velocity are
        checked by `Simulation`.
    """
    if aircraft.body.is_stand and not isinstance(point, StandPoint):
        raise SimulationError("body.stand: allowed on a stand is a start from a trim on it, or give a state")
    if point.state_names != aircraft.layout.linear_names:
        own = ", ".join(str(rotor.blades) for rotor in aircraft.rotors)
        raise SimulationError(
            f"start: a trim with {len(point.state_names)} states: allowed is one of an aircraft with {own} blades, with"
            f" {aircraft.layout.linear_size}"
        )
    heading = checks.number("heading", heading, -4 * math.pi, 4 * math.pi, "rad", SimulationError)
    if isinstance(point, StandPoint):
        state = slowed(aircraft, point.simulation_state(aircraft.layout), rotor_speed)
        return with_steady_separation(aircraft, _displaced(state, position, heading), point.swashplate, wind)
    state = aircraft.layout.from_linear(point.state, heading)
    state[: S.ATTITUDE] = position
    north, east, down = np.asarray(wind, dtype=float).tolist()
    to_earth = rotation_matrix(euler_to_quaternion(heading, point.pitch, point.roll))
    state[S.VELOCITY : S.RATES] += to_earth[0] * north + to_earth[1] * east + to_earth[2] * down
    return with_steady_separation(aircraft, slowed(aircraft, state, rotor_speed), point.swashplate, wind)


def with_steady_separation(aircraft: Aircraft, state: Array, swashplate: Array, wind: ArrayLike) -> Array:
    """Simulation state whose sections have the separation that stays in the flow at the azimuth 0, and no vortex.

    The rates of attached share and pressure are straight lines over these: two of them say where they vanish. Sections
    without flow are attached. The vortex of a stalled section has left it long ago.
    """
    if not aircraft.section_states:
        return state
    engine, layout, found = Engine(aircraft.arranged(True, True, "blades")), aircraft.layout, state.copy()
    given = [engine.lanes([np.ravel(swashplate)]), engine.memory(len(aircraft.rotors))]
    air, out = engine.lanes([np.asarray(wind, dtype=float)]), engine.memory(len(state))

    def rates() -> Array:
        engine.derivative(engine.model, engine.lanes([found]), *given, air, engine.work, out, False)
        return out[:, 0].copy()

    ends = []
    for value in (0.0, 1.0):
        found[layout.sections_start :] = value
        ends.append(rates())
    slope = ends[0] - ends[1]
    settled = np.where(slope > 0.0, ends[0] / np.where(slope > 0.0, slope, 1.0), 1.0)
    found[layout.sections_start :] = 0.0
    for name in ("attached_share", "pressure_lift"):
        found[layout.section(name)] = settled[layout.section(name)]
    if layout.section_states > 1:
        ages, long = layout.section("vortex_age"), max(rotor.vortex_passage for rotor in aircraft.rotors)
        found[ages] = np.where(rates()[ages] > 0.0, long, 0.0)
    return found


def _displaced(state: Array, position: ArrayLike, heading: float) -> Array:
    """State of a stand that is put somewhere else, and turned about the vertical."""
    moved = state.copy()
    moved[: S.ATTITUDE] += np.asarray(position, dtype=np.float64)
    if heading:
        own, pitch, roll = quaternion_to_euler(state[S.ATTITUDE : S.VELOCITY])
        moved[S.ATTITUDE : S.VELOCITY] = euler_to_quaternion(own + heading, pitch, roll)
    return moved


def standing_state(
    aircraft: Aircraft, position: ArrayLike = (0.0, 0.0, 0.0), heading: float = 0.0, rotor_speed: float = 1.0
) -> Array:
    """Simulation state of an aircraft on a stand that does not move: blades straight, without inflow.

    Rotors that have a drive turn at the speed of the file times `rotor_speed`, their engines give no torque.

    Raises
    ------
    SimulationError
        See `trimmed_state`.
    """
    heading = checks.number("heading", heading, -4 * math.pi, 4 * math.pi, "rad", SimulationError)
    state = np.zeros(aircraft.layout.size)
    state[: S.ATTITUDE] = position
    state[S.ATTITUDE : S.VELOCITY] = euler_to_quaternion(heading, 0.0, 0.0)
    state[aircraft.layout.section("attached_share")] = 1.0
    for i in range(len(aircraft.drives)):
        state[aircraft.layout.drive(i)[S.SPEED]] = aircraft.drive_speed(i)
    return slowed(aircraft, state, rotor_speed)


def slowed(aircraft: Aircraft, state: Array, rotor_speed: float) -> Array:
    """Simulation state whose rotors on drives turn at a share of their speed; 0 is at rest.

    Flap, lag and inflow of these rotors, torque and governor are the same share of what they were: rotors at rest have
    straight blades, no inflow, and an engine that gives no torque yet. So is the deflection of a stand. 1 gives back
    every bit.

    Raises
    ------
    SimulationError
        A share out of range, or another one than 1 of an aircraft without drives.
    """
    share = checks.number("rotor_speed", rotor_speed, 0.0, MAX_SPEED, "", SimulationError)
    if share == 1.0:
        return state
    if not aircraft.drives:
        raise SimulationError(
            f"rotor_speed = {share:g}: allowed is 1 for rotors without drives, whose speed is constant"
        )
    changed, layout = state.copy(), aircraft.layout
    if aircraft.body.is_stand:
        _slacken(changed, share)
    for j, rotor in enumerate(aircraft.rotors):
        if drive_of(aircraft, rotor) >= 0:
            for part in (layout.flap(j), layout.flap_rate(j), layout.lag(j), layout.lag_rate(j), layout.inflow(j)):
                changed[part] *= share
            changed[layout.wake(j)] *= share
    for i, drive in enumerate(aircraft.drives):
        changed[[layout.drive(i)[name] for name in drive.state_names]] *= share
    return changed


def _slacken(state: Array, share: float) -> None:
    """Leave a share of the deflection of a stand."""
    state[: S.ATTITUDE] *= share
    angles = np.array(quaternion_to_euler(state[S.ATTITUDE : S.VELOCITY])) * share
    state[S.ATTITUDE : S.VELOCITY] = euler_to_quaternion(*angles.tolist())
