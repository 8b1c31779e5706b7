"""First guess of the speeds of rotors whose drives pilot controls act on (theory.md section 8.2).

Such a rotor is one of constant speed with a collective that stands in for the command: a change of the command moves
the thrust by 2 T / Omega times the change of the steady speed, and so does the collective that it is taken for.
"""

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sbs_sim.aircraft import Aircraft
from sbs_sim.aircraft.description import Drive
from sbs_sim.aircraft.model_records import drive_of, gear
from sbs_sim.model import state as S

if TYPE_CHECKING:
    from sbs_sim.analysis.trim_guess import MomentumRotor, Response

Array = NDArray[np.float64]

STEPS = 8  # of Newton's method for the thrust at a collective
SLOWEST, FASTEST = 0.2, 3.0  # speed of a guess over that of the file
LEAST = 0.02  # of the thrust that carries the rotor's share of the weight


class Nominal(NamedTuple):
    """A rotor in hover at the speed of the file: thrust [N], torque [N m], slope of thrust by collective [N/rad]."""

    thrust: float
    torque: float
    by_collective: float


def stand_in(aircraft: Aircraft, rotors: "list[MomentumRotor]") -> tuple[Nominal, ...]:
    """Give the collectives of rotors the effect of the commands to their drives; what they do in hover."""
    pairs = zip(rotors, aircraft.rotors, strict=True)
    nominal = tuple(_nominal(aircraft, theory, rotor.swashplate_offset) for theory, rotor in pairs)
    for row, i in enumerate(aircraft.commanded_drives, len(rotors)):
        drive, own = aircraft.drives[i], _driven(aircraft, i)
        if _is_held(aircraft, i):
            continue
        torque = _torque(aircraft, i, nominal)
        speed = aircraft.drive_speed(i)
        place = S.SET_POINT if drive.has_governor else S.THROTTLE
        commands = aircraft.trim_rigging[S.ROW * row + place].copy()
        commands[-1] -= 1.0 if drive.has_governor else steady_throttle(drive, speed, torque)
        for j in own:
            hover = nominal[j]
            by_speed = 2.0 * hover.thrust / speed / hover.by_collective
            rigging = rotors[j].rigging.copy()
            rigging[0] += by_speed * _speed_slope(drive, speed, torque) * commands
            rotors[j].rigging = rigging
    return nominal


def set_drives(aircraft: Aircraft, nominal: tuple[Nominal, ...], responses: "tuple[Response, ...]", x: Array) -> None:
    """Set speed, torque and governor of the commanded drives in a simulation state, by the thrusts of their rotors."""
    for i in aircraft.commanded_drives:
        if _is_held(aircraft, i):  # it begins as one without commands
            continue
        drive, places, speed = aircraft.drives[i], aircraft.layout.drive(i), aircraft.drive_speed(i)
        j = _driven(aircraft, i)[0]
        ratio = responses[j].thrust / nominal[j].thrust if nominal[j].thrust > 0.0 else 1.0
        share = min(max(math.sqrt(max(ratio, 0.0)), SLOWEST), FASTEST)
        x[places[S.SPEED]] = share * speed
        torque = min(share**2 * _torque(aircraft, i, nominal), drive.max_torque)
        x[places[S.ENGINE_TORQUE]] = torque
        if drive.has_governor:
            x[places[S.GOVERNOR]] = steady_throttle(drive, share * speed, torque) - drive.throttle


def _is_held(aircraft: Aircraft, drive: int) -> bool:
    """No control that a trim finds acts on a drive: its rotors are controlled by their collectives."""
    first = S.ROW * (len(aircraft.rotors) + aircraft.commanded_drives.index(drive))
    return not aircraft.trim_rigging[first : first + S.ROW, :-1].any()


def _driven(aircraft: Aircraft, drive: int) -> list[int]:
    """Indices of the rotors of a drive."""
    return [j for j, rotor in enumerate(aircraft.rotors) if drive_of(aircraft, rotor) == drive]


def _torque(aircraft: Aircraft, drive: int, nominal: tuple[Nominal, ...]) -> float:
    """Torque that the rotors of a drive take in hover at the speed of the file [N m]."""
    return sum(gear(aircraft, aircraft.rotors[j]) * nominal[j].torque for j in _driven(aircraft, drive))


def steady_throttle(drive: Drive, speed: float, torque: float) -> float:
    """Throttle at which an engine gives a torque [N m] at a speed [rad/s], eqs. (7.13) and (7.15)."""
    if drive.engine == "engine":
        return torque / min(drive.max_torque, drive.max_power / speed)
    voltage = drive.torque_constant * speed + drive.resistance * torque / drive.torque_constant
    return voltage / drive.full_voltage if drive.full_voltage > 0.0 else 1.0


def _speed_slope(drive: Drive, speed: float, torque: float) -> float:
    """Change of the steady speed by the command [rad/s], where the torque of rotors grows with the speed squared."""
    if drive.has_governor:
        return speed
    taken = 2.0 * torque / speed
    if drive.engine == "engine":
        return drive.max_torque / taken
    stiffness = drive.torque_constant / drive.resistance
    return stiffness * drive.full_voltage / (stiffness * drive.torque_constant + taken)


def _nominal(aircraft: Aircraft, theory: "MomentumRotor", offset: Array) -> Nominal:
    """A rotor in hover at the speed and with the collective of the file, by Newton's method for its thrust."""
    theory.meet(np.zeros(3))
    share = aircraft.body.mass * aircraft.environment.gravity / len(aircraft.rotors)
    least = max(LEAST * share, 1e-9)
    thrust = max(share, least)
    found = theory.respond(thrust, [0.0, 0.0, 0.0], least)
    for _ in range(STEPS):
        found = theory.respond(thrust, [0.0, 0.0, 0.0], least)
        thrust = max(thrust + found.by_collective * (float(offset[0]) - found.collective), least)
    return Nominal(thrust, float(found.factors[1]), found.by_collective)
