"""What rows of commands are to the plain model, worked out from the file (theory.md section 4.5)."""

from dataclasses import replace

import numpy as np


def plain_commands(aircraft, rows, airspeed):
    """Return the angles of the swashplates (n_rotors, 3) [rad] and the surfaces with the incidence that they have.

    Parameters
    ----------
    aircraft : Aircraft
    rows : array, shape (n_rows, 3)
        Swashplates, drives and surfaces that controls act on, and the controls whose factors change with the airspeed.
    airspeed : float
        [m/s]
    """
    rows = np.asarray(rows, dtype=float)
    angles, first = rows[: len(aircraft.rotors)].copy(), len(aircraft.rotors)
    first += sum(bool(drive.mixing) for drive in aircraft.drives)
    surfaces = []
    for surface in aircraft.body.surfaces:
        if surface.mixing:
            surface, first = replace(surface, incidence=surface.incidence + rows[first, 0]), first + 1
        surfaces.append(surface)
    used = {entry.control for rotor in aircraft.rotors for entry in rotor.schedule}
    values = dict(zip([c.name for c in aircraft.controls if c.name in used], rows[first:, 0], strict=True))
    for j, rotor in enumerate(aircraft.rotors):
        for entry in rotor.schedule:
            k = ["collective", "lateral_cyclic", "longitudinal_cyclic"].index(entry.angle)
            if entry.control:
                angles[j, k] += values[entry.control] * np.interp(airspeed, entry.airspeed, entry.factor)
            else:
                angles[j, k] += np.interp(airspeed, entry.airspeed, entry.offset)
    return angles, tuple(surfaces)
