"""Induced velocity of an open rotor in descent, as measured (theory.md section 6.4).

Momentum theory has no answer between the hover and the windmill. Here the flow V of v V = v_h^2 is taken from
measurements: over the induced velocity v it is a function of the rate of descent over v, which is single-valued, so
that the dynamic inflow stays explicit in its states.
"""

import numpy as np

from sbs_sim.lanes import any_lane, maximum, minimum, rounded, select, table_row, zeros_like
from sbs_sim.model.cubics import bounded_slopes, pieces
from sbs_sim.model.kernel import kernel
from sbs_sim.model.trigonometry import TINY

# W. Castles, R. B. Gray, NACA TN 2474 (1951), Fig. 12, faired line for the rotor with constant chord and no twist:
# rate of descent and mean induced velocity, both over v_h. In hover it has the factor by which the induced power of
# that rotor exceeds the ideal one; the blades get it from `induced_power_factor`, and the law below is free of it.
MEASURED_DESCENT = (0.0, 0.4, 0.8, 1.2, 1.5, 1.6, 1.8, 2.0, 2.4)
MEASURED_INFLOW = (1.1, 1.41, 1.8, 2.24, 2.5, 2.28, 1.68, 1.37, 0.95)
POWER_FACTOR = MEASURED_INFLOW[0]
# Rate of descent over v from which on momentum theory's windmill holds: 3.0 hover inflow velocities. Sooner, and the
# rate of descent would hardly grow from the end of the line to there.
WINDMILL = 8.0


def _curve() -> tuple[tuple[float, ...], tuple[tuple[float, float, float, float], ...]]:
    """Knots in V_d / v, and between them coefficients of (V_d / v - knot)^0 to ^3 of V / v."""
    inflow = np.array(MEASURED_INFLOW) / POWER_FACTOR
    x = np.append(np.array(MEASURED_DESCENT) / inflow, WINDMILL)
    y = np.append(1.0 / inflow**2, WINDMILL - 1.0)
    width = np.diff(x)
    rise = np.diff(y) / width
    inner = bounded_slopes(rise[:-1], width[:-1], rise[1:], width[1:])
    slope = np.array([-1.0, *inner, 1.0])  # of momentum theory at both ends
    return tuple(x.tolist()), tuple(map(tuple, pieces(x, y, slope).tolist()))


KNOTS, PIECES = _curve()
# Value and slope of the pieces by the power of what is beyond their knots; two zeros make a row of a table.
ROWS = np.array([[a, b, 0, 0, b, 2 * c, 0, 0, c, 3 * d, 0, 0, d, 0, 0, 0] for a, b, c, d in PIECES])
DEGREE = 3


@kernel
def measured_flow(lambda0, descent):
    """Axial flow through a disc and the sum of it and of lambda0 times its slope by lambda0, eq. (6.16).

    Parameters
    ----------
    lambda0 : lanes
    descent : lanes
        mu_z: velocity of the hub down along the shaft over the tip speed.
    """
    through = lambda0 - descent
    ratio = rounded(descent * lambda0) / (lambda0 * lambda0 + TINY)
    descends = (ratio > 0.0) & (ratio < WINDMILL)
    if not any_lane(descends):
        return through, through + lambda0
    x = minimum(maximum(ratio, 0.0), WINDMILL)
    piece = start = zeros_like(x)
    for k in range(1, len(PIECES)):
        begins = x >= KNOTS[k]
        piece, start = select(begins, 1.0 * k, piece), select(begins, KNOTS[k], start)
    y = x - start
    value, slope, _, _ = table_row(ROWS, piece, y, DEGREE)
    axial = select(descends, lambda0 * value, through)
    return axial, select(descends, lambda0 * (2.0 * value - x * slope), through + lambda0)


def measured_axial(inflow: float, descent: float) -> tuple[float, float]:
    """Axial flow V and V + v dV/dv of an induced velocity v > 0, all in one unit, as `measured_flow` has them."""
    x = descent / inflow
    if not 0.0 < x < WINDMILL:
        return inflow - descent, 2.0 * inflow - descent
    k = int(np.searchsorted(KNOTS, x, side="right")) - 1
    a, b, c, d = PIECES[k]
    y = x - KNOTS[k]
    value, slope = a + y * (b + y * (c + y * d)), b + y * (2.0 * c + 3.0 * d * y)
    return inflow * value, inflow * (2.0 * value - x * slope)
