"""Angles of single blades at an instant of a flight."""

from __future__ import annotations  # `help` then shows types by their names

import numpy as np
from numpy.typing import NDArray

from sbs_sim.aircraft import Aircraft
from sbs_sim.flight.records import Snapshot
from sbs_sim.model.multiblade import blade_matrix

Array = NDArray[np.float64]


def blade_angles(aircraft: Aircraft, snapshot: Snapshot) -> list[tuple[Array, Array]]:
    """Flap and lag angle of every blade [rad] as one pair of arrays, each shape (blades,), per rotor."""
    layout = aircraft.layout
    pairs = []
    for j, rotor in enumerate(aircraft.rotors):
        matrix = blade_matrix(rotor.blades, snapshot.azimuth[j])
        pairs.append((matrix @ snapshot.state[layout.flap(j)], matrix @ snapshot.state[layout.lag(j)]))
    return pairs
