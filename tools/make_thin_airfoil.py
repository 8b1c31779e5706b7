"""Generate config/airfoils/thin_2pi.csv, the airfoil of small-angle theories.

    python tools/make_thin_airfoil.py [output.csv]

needs only this package. Lift is 2 pi sin alpha all round, as a thin airfoil has it without separation, so that lift
along the shaft is 2 pi (U_T^2 theta - U_P U_T) of a small pitch theta at any inflow; drag is 0.01.
"""

import sys
from pathlib import Path

import numpy as np

from sbs_sim.model.airfoil import AirfoilTable, write_table

OUTPUT = Path(__file__).resolve().parent.parent / "config" / "airfoils" / "thin_2pi.csv"
REYNOLDS = np.array([1e5, 1e7])
STEPS = 360  # of half a circle
DRAG = 0.01

COMMENTS = [
    "Thin airfoil that never stalls, made by tools/make_thin_airfoil.py from closed formulas:",
    "cl = 2 pi sin alpha, cd = 0.01. For comparison with small-angle theories, not for aircraft.",
    "Licence: Apache-2.0, as the package.",
]


def make_table() -> AirfoilTable:
    """Return the airfoil, the same at both Reynolds numbers."""
    alpha = np.arange(-STEPS, STEPS + 1) * (np.pi / STEPS)
    lift = np.tile(2.0 * np.pi * np.sin(alpha), (len(REYNOLDS), 1))
    lift[:, [0, -1]] = 0.0
    return AirfoilTable("thin_2pi", REYNOLDS, alpha, lift, np.full_like(lift, DRAG))


if __name__ == "__main__":
    write_table(sys.argv[1] if len(sys.argv) > 1 else OUTPUT, make_table(), COMMENTS)
