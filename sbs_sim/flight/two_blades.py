"""Two-bladed rotors in steady flight: their flap and lag of one per revolution (theory.md section 8.6).

Two blades have a collective and a differential coordinate. In steady flight the differential one moves once per
revolution with the tilt of the disc: no constant coordinates describe it. A rotor of three blades, each with two
thirds of everything that a blade has, gives the same mean loads and has the tilt as constant coordinates: steady flight
is found with it, and turned into the motion of the two blades.
"""

from dataclasses import fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sbs_sim.aircraft import Aircraft
from sbs_sim.aircraft.description import Rotor
from sbs_sim.flight.trim_point import TrimPoint
from sbs_sim.model.state import BODY_SIZE, LINEAR_BODY_SIZE, StateLayout

Array = NDArray[np.float64]

SUBSTITUTES = 3  # blades: as many as there are coordinates up to the first harmonic
SHARE = 2 / SUBSTITUTES
COLLECTIVE, COSINE, SINE = range(SUBSTITUTES)  # coordinates of the substitute
DIFFERENTIAL = 1  # of two blades


class _Substitute(Rotor):
    """Three blades that together are two: they keep the chord, to which airfoils belong, and have less area."""

    def elements(self, count: int) -> Array:
        """See `Rotor.elements`."""
        span, chord, half_area, lifting, twist = super().elements(count)
        return np.stack([span, chord, SHARE * half_area, lifting, twist])


def has_two_blades(aircraft: Aircraft) -> bool:
    """A rotor of the aircraft has two blades."""
    return any(rotor.blades == 2 for rotor in aircraft.rotors)


def substitute(aircraft: Aircraft) -> Aircraft:
    """Aircraft with three lighter blades in place of two; the same if no rotor has two."""
    if not has_two_blades(aircraft):
        return aircraft
    if substitute not in aircraft.kept:
        rotors = tuple(_lighter(rotor) if rotor.blades == 2 else rotor for rotor in aircraft.rotors)
        aircraft.kept[substitute] = replace(aircraft, rotors=rotors)
    made: Aircraft = aircraft.kept[substitute]
    return made


def _lighter(rotor: Rotor) -> Rotor:
    """Substitute of a rotor with two blades; of unequal dampers it has the mean."""
    values: dict[str, Any] = {item.name: getattr(rotor, item.name) for item in fields(Rotor)}
    damping = SHARE * float(rotor.lag_damping_factors.mean())
    shared = ("blade_mass", "flap_spring", "lag_spring", "lag_stop_spring", "lag_stop_damping")
    values |= {name: SHARE * values[name] for name in shared}
    values |= {name: damping * values[name] for name in ("lag_damping", "damper_damping")}
    if rotor.blade_inertia is not None:
        values["blade_inertia"] = SHARE * rotor.blade_inertia
    if rotor.mass_values is not None:
        values |= {"mass_values": SHARE * rotor.mass_values, "tip_mass": SHARE * rotor.tip_mass}
    return _Substitute(**{**values, "blades": SUBSTITUTES, "blade_lag_damping": None})


def at_azimuths(aircraft: Aircraft, state: Array, azimuths: Array, speeds: Array) -> Array:
    """States of an aircraft at azimuths, of a state of its substitute whose coordinates do not change.

    Parameters
    ----------
    aircraft : Aircraft
    state : ndarray, shape (size,) or (linear_size,)
        Simulation or linear state of the substitute.
    azimuths : ndarray, shape (m, n_rotors)
        Of the first blades [rad].
    speeds : ndarray, shape (n_rotors,)
        Of the rotors [rad/s].

    Returns
    -------
    ndarray, shape (m, size) or (m, linear_size)
        beta_k = a_0 - a_1 cos psi_k - b_1 sin psi_k of both blades, lag alike, and their rates.
    """
    layouts = substitute(aircraft).layout, aircraft.layout
    made, parts = _without_two_blades(aircraft, *layouts, state)
    made = np.repeat(made[np.newaxis], len(azimuths), axis=0)
    for j, (angle, _), (own_angle, own_rate) in parts:
        psi, a, b = azimuths[:, j], state[angle + COSINE], state[angle + SINE]
        made[:, own_angle] = state[angle]
        made[:, own_angle + DIFFERENTIAL] = -(a * np.cos(psi) + b * np.sin(psi))
        made[:, own_rate + DIFFERENTIAL] = speeds[j] * (a * np.sin(psi) - b * np.cos(psi))
    return made


def of_substitute(aircraft: Aircraft, state: Array, speeds: Array) -> Array:
    """State of the substitute of one of the aircraft at the azimuth 0 in steady flight: undoes `at_azimuths`."""
    layouts = aircraft.layout, substitute(aircraft).layout
    made, parts = _without_two_blades(aircraft, *layouts, state)
    for j, (angle, rate), (own_angle, _) in parts:
        made[own_angle] = state[angle]
        made[own_angle + COSINE] = -state[angle + DIFFERENTIAL]
        made[own_angle + SINE] = -state[rate + DIFFERENTIAL] / speeds[j]
    return made


def with_two_blades(aircraft: Aircraft, point: TrimPoint) -> TrimPoint:
    """Trim of an aircraft, where the first blades are aft, of a trim of its substitute."""
    speeds = aircraft.rotor_speeds(substitute(aircraft).layout.from_linear(point.state))
    state = at_azimuths(aircraft, point.state, np.zeros((1, len(aircraft.rotors))), speeds)[0]
    return _renamed(aircraft, point, state)


def trim_of_substitute(aircraft: Aircraft, point: TrimPoint) -> TrimPoint:
    """Trim of the substitute of a trim of the aircraft: undoes `with_two_blades`."""
    speeds = aircraft.rotor_speeds(aircraft.layout.from_linear(point.state))
    return _renamed(substitute(aircraft), point, of_substitute(aircraft, point.state, speeds))


def _renamed(aircraft: Aircraft, point: TrimPoint, state: Array) -> TrimPoint:
    names = aircraft.layout.linear_names
    return replace(point, state=state, state_names=names, parameter_hash=aircraft.parameter_hash)


Part = tuple[int, tuple[int, int], tuple[int, int]]


def _without_two_blades(
    aircraft: Aircraft, old: StateLayout, new: StateLayout, state: Array
) -> tuple[Array, list[Part]]:
    """State of one layout in another, flap and lag of two blades left zero; the indices of those.

    Of each such rotor, flap first: its number, and the indices of the first coordinate and its rate, old and new.
    """
    is_linear = len(state) == old.linear_size
    shift = LINEAR_BODY_SIZE - BODY_SIZE if is_linear else 0
    made, found = np.zeros(new.linear_size if is_linear else new.size), []
    made[: BODY_SIZE + shift] = state[: BODY_SIZE + shift]
    made[new.drives_start + shift :] = state[old.drives_start + shift :]
    for j, rotor in enumerate(aircraft.rotors):
        made[_moved(new.inflow(j), shift)] = state[_moved(old.inflow(j), shift)]
        made[_moved(new.wake(j), shift)] = state[_moved(old.wake(j), shift)]
        for angle, rate in (("flap", "flap_rate"), ("lag", "lag_rate")):
            pairs = [(getattr(old, name)(j), getattr(new, name)(j)) for name in (angle, rate)]
            if rotor.blades == 2:
                starts = [(given.start + shift, own.start + shift) for given, own in pairs]
                found.append((j, (starts[0][0], starts[1][0]), (starts[0][1], starts[1][1])))
                continue
            for given, own in pairs:
                made[_moved(own, shift)] = state[_moved(given, shift)]
    return made, found


def _moved(part: slice, shift: int) -> slice:
    return slice(part.start + shift, part.stop + shift)
