"""Contact with the ground: forces at given states, whether a step resolves it, and where an aircraft stands."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sbs_sim import checks
from sbs_sim.aircraft import Aircraft
from sbs_sim.aircraft.description import CONTACT
from sbs_sim.aircraft.model_records import ground_record
from sbs_sim.errors import SimulationError
from sbs_sim.flight.trimmed_state import slowed
from sbs_sim.model import state as S
from sbs_sim.model.contact import CONTACT_SIZE, contact_forces
from sbs_sim.model.frames import cross_matrix, euler_to_quaternion, rotation_matrix
from sbs_sim.model.integrate import STAGES, TABLEAUS
from sbs_sim.model.records import Model

Array = NDArray[np.float64]

ROUNDING = 1e-9
BISECTIONS = 40
NEWTON_STEPS = 6


def ground_forces(model: Model, states: Array) -> Array | None:
    """Force of the ground on every contact point, body axes [N], and its depth [m], shape (m, n_points, CONTACT_SIZE).

    Parameters
    ----------
    model : Model
        With a single lane.
    states : ndarray, shape (m, size)

    Returns
    -------
    ndarray or None
        None for an aircraft that does not stand on the ground.
    """
    if not len(model.contacts):
        return None
    out = np.zeros((len(states), len(model.contacts), CONTACT_SIZE, 1))
    contact_forces(model, np.ascontiguousarray(states)[..., np.newaxis], out)
    return out[..., 0]


def check_step(aircraft: Aircraft, method: int, step: float) -> None:
    """Raise SimulationError if a step [s] of a method is not stable on the springs and dampers of the contact points.

    All points carry the fuselage without the blades, which follow on their hinges: it is the lightest that there is.
    """
    mass, stiffness, damping = _matrices(aircraft)
    if _is_stable(mass, stiffness, damping, method, step):
        return
    kind, least = ("stiffness", 0.0) if _is_stable(mass, 0.0 * stiffness, damping, method, step) else ("damping", 1.0)
    low, high = 0.0, 1.0
    for _ in range(BISECTIONS):
        share = 0.5 * (low + high)
        scales = (0.0, share) if least else (share, 1.0)
        low, high = (
            (share, high)
            if _is_stable(mass, scales[0] * stiffness, scales[1] * damping, method, step)
            else (low, share)
        )
    points = aircraft.contact_points
    sideways = [point.sideways[1 if least else 0] for point in points]
    largest = max(max(getattr(point, kind), side) for point, side in zip(points, sideways, strict=True))
    unit = "N s/m" if least else "N/m"
    raise SimulationError(
        f"contact_points: {kind} = {largest:g} {unit} is not stable at a step of {1e3 * step:.4g} ms: allowed are up to"
        f" {low * largest:.4g}, or smaller steps"
    )


def _matrices(aircraft: Aircraft) -> tuple[Array, Array, Array]:
    """Mass, stiffness and damping of the fuselage on all its contact points, each shape (6, 6)."""
    if aircraft.options.coupling == "complete":
        mass, first, inertia = aircraft.fuselage()
    else:
        mass, first, inertia = aircraft.body.mass, np.zeros(3), aircraft.body.inertia
    matrix = np.block([[mass * np.eye(3), -cross_matrix(first)], [cross_matrix(first), inertia]])
    stiffness, damping = np.zeros((6, 6)), np.zeros((6, 6))
    for point in aircraft.contact_points:
        motion = np.hstack([np.eye(3), -cross_matrix(point.position)])
        side_stiffness, side_damping = point.sideways
        stiffness += max(point.stiffness, side_stiffness) * (motion.T @ motion)
        damping += max(point.damping, side_damping) * (motion.T @ motion)
    return matrix, stiffness, damping


def _is_stable(mass: Array, stiffness: Any, damping: Any, method: int, step: float) -> bool:
    zero, one = np.zeros((6, 6)), np.eye(6)
    system = np.block([[zero, one], [-np.linalg.solve(mass, stiffness), -np.linalg.solve(mass, damping)]])
    return all(abs(amplification(method, z)) <= 1.0 + ROUNDING for z in step * np.linalg.eigvals(system))


def amplification(method: int, z: complex) -> complex:
    """What a step of a method multiplies the solution of y' = (z / h) y by, of the body."""
    count = int(STAGES[method])
    inner, weights = TABLEAUS[method][:count, :count], TABLEAUS[method][-1][:count]
    return complex(1.0 + z * (weights @ np.linalg.solve(np.eye(count) - z * inner, np.ones(count))))


def state_on_ground(
    aircraft: Aircraft,
    ground_altitude: float,
    position: ArrayLike = (0.0, 0.0),
    heading: float = 0.0,
    rotor_speed: float = 1.0,
) -> Array:
    """Simulation state of an aircraft that stands on the ground, its blades straight, its rotors without thrust.

    Its springs carry the weight. Where some of them would have to pull, as on a slope on which it tips over, and where
    it would slide, the flight goes on from there.

    Parameters
    ----------
    aircraft : Aircraft
    ground_altitude : float
        Height of the ground above the origin [m].
    position : array_like, shape (2,)
        North and east [m].
    heading : float
        From north to east [rad].
    rotor_speed : float
        Speed of rotors that have a drive over that of the file, 0 to 1.5; 0 is at rest.

    Returns
    -------
    ndarray, shape (size,)

    Raises
    ------
    SimulationError
        An aircraft that does not stand on the ground; a number out of range.
    """
    if not aircraft.has_contact:
        raise SimulationError(f"ground.contact = {aircraft.ground.contact!r}: allowed on the ground is {CONTACT!r}")
    altitude = checks.number("ground_altitude", ground_altitude, -1e8, 1e8, "m", SimulationError)
    heading = checks.number("heading", heading, -4 * math.pi, 4 * math.pi, "rad", SimulationError)
    north, east = checks.array("position", position, SimulationError).tolist()
    ground = ground_record(aircraft, altitude)[0]
    down, depth = ground["down"][:, 0], float(ground["depth"][0])
    ahead = np.array([math.cos(heading), math.sin(heading), 0.0])
    ahead -= down * (ahead @ down)
    ahead /= math.sqrt(ahead @ ahead)
    level = np.stack([ahead, np.cross(down, ahead), down], axis=1)  # to NED of axes along the ground
    weight = aircraft.body.mass * aircraft.environment.gravity * level[2]
    height, roll, pitch, shares = _rest(aircraft, weight)
    tilt = rotation_matrix(euler_to_quaternion(0.0, pitch, roll))
    to_earth = level @ tilt
    state = np.zeros(aircraft.layout.size)
    state[:3] = north, east, (depth - height - down[0] * north - down[1] * east) / down[2]
    state[S.ATTITUDE : S.VELOCITY] = _quaternion(to_earth)
    along = level[:, :2] @ weight[:2]  # NED
    for i, (point, share) in enumerate(zip(aircraft.contact_points, shares.tolist(), strict=True)):
        for k, axis in enumerate(("first", "second")):
            state[aircraft.layout.contact(i).start + k] = share * (ground[axis][:, 0] @ along) / point.sideways[0]
    for i in range(len(aircraft.drives)):
        state[aircraft.layout.drive(i)[S.SPEED]] = aircraft.drive_speed(i)
    return slowed(aircraft, state, rotor_speed)


def _rest(aircraft: Aircraft, weight: Array) -> tuple[float, float, float, Array]:
    """Height of the c.g. [m], roll and pitch [rad] against the ground, and each point's share of the force along it."""
    points = aircraft.contact_points
    positions = np.array([point.position for point in points])
    sideways = np.array([point.sideways[0] for point in points])
    carrying = np.ones(len(points), dtype=bool)
    height, roll, pitch = float(positions[:, 2].max()), 0.0, 0.0
    for _ in points:
        k = np.where(carrying, [point.stiffness for point in points], 0.0)
        shares = np.where(carrying, sideways, 0.0) / sideways[carrying].sum()
        for _ in range(NEWTON_STEPS):
            x, y, z = rotation_matrix(euler_to_quaternion(0.0, pitch, roll)) @ positions.T
            depth = z - height
            rows = np.stack([-np.ones(len(points)), y, -x])  # of the depth by height, roll and pitch
            # forces across the ground, and moments about the axes along it, vanish
            missing = np.array([-weight[2], weight[1] * (shares @ z), -weight[0] * (shares @ z)]) - rows @ (k * depth)
            change = np.linalg.lstsq((rows * k) @ rows.T, missing, rcond=1e-12)[0]
            height, roll, pitch = height + change[0], roll + change[1], pitch + change[2]
        if (depth[carrying] >= 0.0).all():
            break
        carrying &= depth > 0.0
    return float(height), float(roll), float(pitch), shares


def _quaternion(to_earth: Array) -> Array:
    """Attitude of a matrix that takes body axes to NED."""
    heading = math.atan2(to_earth[1, 0], to_earth[0, 0])
    pitch = -math.asin(min(1.0, max(-1.0, to_earth[2, 0])))
    return euler_to_quaternion(heading, pitch, math.atan2(to_earth[2, 1], to_earth[2, 2]))
