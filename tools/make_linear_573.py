"""Generate config/airfoils/linear_573.csv, the plain airfoil of the paper's reading (theory.md section 9).

    python tools/make_linear_573.py [output.csv]

needs only this package. Lift is 5.73 alpha up to 10.2 deg, then a parabola that becomes level at 12 deg;
drag is 0.0105 (Re / 3e5)^-0.25 + 0.35 alpha^2; beyond 12 deg the formulas of Viterna.
"""

import sys
from pathlib import Path

import numpy as np

from sbs_sim.model.airfoil import AirfoilTable, Array, extend_polar, write_table

OUTPUT = Path(__file__).resolve().parent.parent / "config" / "airfoils" / "linear_573.csv"
REYNOLDS = np.array([2.5e4, 4e4, 6e4, 1e5, 1.5e5, 2.2e5, 3e5, 4.2e5, 6e5])
STEP_DEG = 0.5
SLOPE = 5.73  # [1/rad]
LINEAR_END, STALL = np.radians(10.2), np.radians(12.0)
ASPECT_RATIO = 10.0  # blade radius over chord, 0.505 m / 0.051 m, rounded

COMMENTS = [
    "Plain airfoil with the lift slope 5.73 /rad, made by tools/make_linear_573.py from closed formulas.",
    "Attached flow: cl = 5.73 alpha to 10.2 deg, then a parabola, tangent there and level at 12 deg;",
    "cd = 0.0105 (reynolds / 3e5)^-0.25 + 0.35 alpha^2, alpha in rad.",
    f"Stalled flow: Viterna and Corrigan (NASA CP-2230, 1982) from 12 deg, aspect ratio {ASPECT_RATIO:g},",
    "reflected past 90 deg with the lift factor -0.7; within 12 deg of 180 deg linear lift, constant drag.",
    "Licence: Apache-2.0, as the package.",
]


def attached_lift(alpha: Array) -> Array:
    """Lift coefficient, shape as alpha [rad], up to stall."""
    excess = np.maximum(np.abs(alpha) - LINEAR_END, 0.0)
    return SLOPE * (alpha - np.sign(alpha) * excess**2 / (2 * (STALL - LINEAR_END)))


def attached_drag(reynolds: float, alpha: Array) -> Array:
    """Drag coefficient, shape as alpha [rad], up to stall."""
    return 0.0105 * (reynolds / 3e5) ** -0.25 + 0.35 * alpha**2


def make_table() -> AirfoilTable:
    """Return the airfoil at all Reynolds numbers."""
    steps = round(np.degrees(STALL) / STEP_DEG)
    alpha = np.arange(-steps, steps + 1) * np.radians(STEP_DEG)
    polars = [extend_polar(alpha, attached_lift(alpha), attached_drag(re, alpha), ASPECT_RATIO) for re in REYNOLDS]
    cl, cd = np.array([polar[1] for polar in polars]), np.array([polar[2] for polar in polars])
    return AirfoilTable("linear_573", REYNOLDS, polars[0][0], cl, cd)


if __name__ == "__main__":
    write_table(sys.argv[1] if len(sys.argv) > 1 else OUTPUT, make_table(), COMMENTS)
