"""Point of separation on sections that follows the flow late: stall in motion (theory.md section 4.10).

S. Oye: Dynamic stall simulated as time lag of separation, 4th IEA symposium on the aerodynamics of wind turbines, 1991:
what J. G. Leishman and T. S. Beddoes (1989) have of separation at the trailing edge, with one time. The lift of a
section whose flow is attached up to a share f of the chord lies between that of attached and that of separated flow,
M. H. Hansen, M. Gaunaa, H. A. Madsen: A Beddoes-Leishman type dynamic stall model in state-space and indicial
formulations, Riso-R-1354(EN), 2004.
"""

import math
from typing import Any, NamedTuple

from sbs_sim.lanes import maximum, minimum, rounded, select, sqrt
from sbs_sim.model.kernel import kernel

LAG = 4.0  # chords that the flow goes in the time of the lag
SLOPE, NO_LIFT = 5, 6  # rows of `Aircraft.stall_table`: of lift in attached flow [1/rad], and angle without lift [rad]
NUMBER = 0
FULL, NONE = math.radians(30.0), math.radians(60.0)  # off the angle without lift: up to here all of it, from here none
SMALL = 1e-3  # lift coefficient


class Separation(NamedTuple):
    """Attached shares of the chord of the sections of blades, their rates [1/s], and the angles of their airfoils."""

    shares: Any
    rates: Any
    angles: Any


@kernel
def way_to(knots, i, x):
    """Share of the way from the knot before i to it, from 0 to 1."""
    width = knots[i] - knots[i - 1]
    return minimum(maximum((x - knots[i - 1]) / select(width > 0.0, width, 1.0), 0.0), 1.0)


@kernel
def interpolated(knots, values, x):
    """Linear interpolation, constant beyond the ends."""
    found = values[0] + 0.0
    for i in range(1, knots.shape[0]):
        found = select(x > knots[i - 1], values[i - 1] + way_to(knots, i, x) * (values[i] - values[i - 1]), found)
    return found


@kernel
def attached_values(own, number):
    """Slope and angle without lift of an airfoil, interpolated together."""
    knots, slopes, angles = own[NUMBER], own[SLOPE], own[NO_LIFT]
    slope, no_lift = slopes[0] + 0.0, angles[0] + 0.0
    for i in range(1, knots.shape[0]):
        above, share = number > knots[i - 1], way_to(knots, i, number)
        slope = select(above, slopes[i - 1] + share * (slopes[i] - slopes[i - 1]), slope)
        no_lift = select(above, angles[i - 1] + share * (angles[i] - angles[i - 1]), no_lift)
    return slope, no_lift


@kernel
def attached_flow(angles, element, number):
    """Slope of lift in attached flow [1/rad] and angle without lift [rad] of an element."""
    slope, no_lift = attached_values(angles[0], number)
    for k in range(1, angles.shape[0]):
        is_outboard = element.airfoil >= float(k)
        own_slope, own_angle = attached_values(angles[k], number)
        slope, no_lift = select(is_outboard, own_slope, slope), select(is_outboard, own_angle, no_lift)
    return slope, no_lift


@kernel
def late_lift(blade, element, separation, i, number, airspeed, alpha, steady):
    """Lift coefficient beside the `steady` one, eq. (4.19); sets the rate of the share of element i, eq. (4.18)."""
    slope, no_lift = attached_flow(separation.angles, element, number)
    angle = alpha - no_lift
    attached = rounded(slope * angle)
    has_lift = abs(attached) > SMALL
    ratio = maximum(steady / select(has_lift, attached, 1.0), 0.0)
    root = minimum(maximum(2.0 * sqrt(ratio) - 1.0, 0.0), 1.0)
    root = select(has_lift, root, 1.0)
    share = rounded(root * root)
    between = attached * (3.0 + root) / (4.0 + 4.0 * root)
    gap = select(root > 0.0, between, attached - steady)
    window = minimum(maximum((NONE - abs(angle)) * (1.0 / (NONE - FULL)), 0.0), 1.0)
    row = blade.separation_first + i * blade.separation_stride
    late = separation.shares[row] - share
    separation.rates[row] = -(rounded(airspeed * element.separation_rate) * late)
    return rounded(blade.late_stall * window) * rounded(gap * late)
