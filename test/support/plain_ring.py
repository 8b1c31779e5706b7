"""Plain reference of the fluctuation of the thrust in the vortex ring (theory.md section 6.6)."""

from itertools import pairwise

import numpy as np

BEGIN, PEAK, WINDMILL, EDGEWISE = 0.45, 1.25, 2.0, 0.95  # hover inflow velocities


def ring_shares(noise, rotor, descent, edgewise):
    """Return what the thrust lacks of its mean; descent and velocity along the disc in hover inflow velocities."""
    ends = (descent - BEGIN) / (PEAK - BEGIN), (WINDMILL - descent) / (WINDMILL - PEAK)
    rise, fall = (3 * t**2 - 2 * t**3 for t in np.clip(ends, 0.0, 1.0))
    return noise * rotor.ring_unsteadiness * rise * fall * max(0.0, 1.0 - (edgewise / EDGEWISE) ** 2) ** 2


def added_inflow(ac, rotor, missing):
    """Return the part of lambda0 that lowers the thrust coefficient of attached blades by `missing`."""
    length = rotor.radius - rotor.hinge_offset
    edges, table = np.linspace(rotor.root_cutout, length, ac.options.elements + 1), ac.airfoils[rotor.airfoil]
    degrees = np.degrees(table.alpha)
    response = 0.0
    for inner, outer in pairwise(edges):
        s, ds = (inner + outer) / 2, outer - inner
        r, chord = rotor.hinge_offset + s, rotor.chord_root + (rotor.chord_tip - rotor.chord_root) * s / length
        number = rotor.speed * r * chord / ac.environment.kinematic_viscosity
        rows = [[np.interp(angle, degrees, row) for row in table.cl] for angle in (-5, 5)]
        low, high = (np.interp(number, table.numbers, row) for row in rows)
        kept = np.clip((rotor.tip_loss * rotor.radius - rotor.hinge_offset - inner) / ds, 0.0, 1.0)
        response += rotor.blades * chord * ds * r * kept * (high - low) / np.radians(10)
    response /= 2 * np.pi * rotor.radius**3
    return missing / response / rotor.induced_power_factor
