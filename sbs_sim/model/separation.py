"""Point of separation on sections that follows the flow late: stall in motion (theory.md section 4.10).

S. Oye: Dynamic stall simulated as time lag of separation, 4th IEA symposium on the aerodynamics of wind turbines, 1991:
what J. G. Leishman and T. S. Beddoes: A semi-empirical model for dynamic stall, Journal of the American Helicopter
Society 34 (3), 1989, have of separation at the trailing edge, with one time. By choice with their vortex, which the
leading edge sheds. The lift of a section whose flow is attached up to a share f of the chord lies between that of
attached and that of separated flow, M. H. Hansen, M. Gaunaa, H. A. Madsen: A Beddoes-Leishman type dynamic stall model
in state-space and indicial formulations, Riso-R-1354(EN), 2004.
"""

import math
from typing import Any, NamedTuple

from sbs_sim.lanes import maximum, minimum, rounded, select, sqrt, zeros_like
from sbs_sim.model.kernel import kernel
from sbs_sim.model.trigonometry import cosine_sine

NUMBER, SLOPE, NO_LIFT, LEAST, MOST, INVERSE_WIDTH = 0, 5, 6, 7, 8, 9  # rows of `Aircraft.stall_table`
OYE_LAG = 8.0  # times of lags, in semi-chords that the flow goes
# of pressure, separation, vortex and its passage, by default: R. Damiani, G. Hayman: The unsteady aerodynamics module
# for FAST 8, NREL/TP-5000-66347, 2019
STALL_LAGS = (1.7, 3.0, 6.0, 11.0)
LEAST_SHARE = 1e-4  # for the rate of a root
FULL, NONE = math.radians(30.0), math.radians(60.0)  # off the angle without lift: up to here all of it, from here none
SMALL = 1e-3  # lift coefficient


class Separation(NamedTuple):
    """Stall of the sections of blades.

    Attributes
    ----------
    states, rates : lanes, shape (rows,)
        What `sbs_sim.model.state.SECTION_NAMES` says, one kind after the other, and the rates.
    angles : lanes
        `Aircraft.stall_table` of the blades.
    kind : int
        Rows from a state to the next kind of the same section.
    """

    states: Any
    rates: Any
    angles: Any
    kind: Any


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


class AttachedFlow(NamedTuple):
    """Lift of attached flow on an airfoil: slope [1/rad], angle without lift [rad], least and largest coefficient."""

    slope: Any
    no_lift: Any
    least: Any
    most: Any


@kernel
def attached_values(own, number):
    """Lift of attached flow on one airfoil, interpolated over its Reynolds or Mach numbers."""
    knots, widths = own[NUMBER], own[INVERSE_WIDTH]
    slopes, angles, lows, highs = own[SLOPE], own[NO_LIFT], own[LEAST], own[MOST]
    slope, no_lift, least, most = slopes[0] + 0.0, angles[0] + 0.0, lows[0] + 0.0, highs[0] + 0.0
    for i in range(1, knots.shape[0]):
        beyond = number - knots[i - 1]
        above, share = beyond > 0.0, rounded(minimum(beyond * widths[i], 1.0))
        slope = select(above, slopes[i - 1] + share * (slopes[i] - slopes[i - 1]), slope)
        no_lift = select(above, angles[i - 1] + share * (angles[i] - angles[i - 1]), no_lift)
        least = select(above, lows[i - 1] + share * (lows[i] - lows[i - 1]), least)
        most = select(above, highs[i - 1] + share * (highs[i] - highs[i - 1]), most)
    return AttachedFlow(slope, no_lift, least, most)


@kernel
def attached_flow(angles, element, number):
    """Lift of attached flow on an element."""
    found = attached_values(angles[0], number)
    for k in range(1, angles.shape[0]):
        is_outboard, own = element.airfoil >= float(k), attached_values(angles[k], number)
        found = AttachedFlow(
            select(is_outboard, own.slope, found.slope),
            select(is_outboard, own.no_lift, found.no_lift),
            select(is_outboard, own.least, found.least),
            select(is_outboard, own.most, found.most),
        )
    return found


class Late(NamedTuple):
    """What is added to the coefficients of a steady section, along its lift and its drag."""

    lift: Any
    drag: Any


@kernel
def late_coefficients(blade, element, separation, i, section, alpha, steady):
    """Lift and drag beside the `steady` lift of element i, eqs. (4.19) and (4.21); sets the rates of its states."""
    flow = attached_flow(separation.angles, element, section.number)
    angle = alpha - flow.no_lift
    attached = rounded(flow.slope * angle)
    has_lift = abs(attached) > SMALL
    ratio = maximum(steady / select(has_lift, attached, 1.0), 0.0)
    root = minimum(maximum(2.0 * sqrt(ratio) - 1.0, 0.0), 1.0)
    root = select(has_lift, root, 1.0)
    between = attached * (3.0 + root) / (4.0 + 4.0 * root)
    gap = select(root > 0.0, between, attached - steady)
    window = minimum(maximum((NONE - abs(angle)) * (1.0 / (NONE - FULL)), 0.0), 1.0)
    row = blade.separation_first + i * blade.separation_stride
    share = separation.states[row]
    late = share - rounded(root * root)
    rate = -(rounded(section.airspeed * element.separation_rate) * late)
    separation.rates[row] = rate
    lift = rounded(rounded(blade.late_stall * window) * rounded(gap * late))
    if separation.kind == separation.states.shape[0]:
        return Late(lift, zeros_like(lift))
    vortex = vortex_lift(blade, element, separation, row, section.airspeed, flow, rounded(window * attached), rate)
    normal, by_vortex = lift + rounded(window * vortex), blade.stall_vortex > 0.0
    cosine, sine = cosine_sine(alpha)
    return Late(select(by_vortex, rounded(normal * cosine), lift), select(by_vortex, rounded(normal * sine), 0.0))


@kernel
def vortex_lift(blade, element, separation, row, airspeed, flow, attached, share_rate):
    """Normal force coefficient of the vortex over a section; sets its rates, eq. (4.20)."""
    first, second, third = row + separation.kind, row + 2 * separation.kind, row + 3 * separation.kind
    pressure, vortex, age = separation.states[first], separation.states[second], separation.states[third]
    speed = rounded(airspeed * element.inverse_semi_chord)
    quick = rounded(speed * blade.inverse_pressure_lag)
    pressure_rate = quick * (attached - pressure)
    root = sqrt(maximum(separation.states[row], LEAST_SHARE))
    lost = 1.0 - 0.25 * ((1.0 + root) * (1.0 + root))
    growth = pressure_rate * lost - rounded(pressure * share_rate) * (0.25 + 0.25 * root) / root
    sheds, is_young = (pressure > flow.most) | (pressure < flow.least), age < blade.vortex_passage
    feeds = sheds & is_young & (growth * pressure > 0.0)
    separation.rates[first] = pressure_rate
    separation.rates[second] = select(feeds, growth, 0.0) - rounded(speed * blade.inverse_vortex_lag) * vortex
    separation.rates[third] = select(sheds, select(is_young, speed, 0.0), -rounded(quick * age))
    return vortex
