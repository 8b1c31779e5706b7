"""What each rotor is made to do: how far it is from what the model describes (theory.md section 6.1)."""

import math

from sbs_sim.model import params as P
from sbs_sim.model import state as S
from sbs_sim.model.kernel import entry, kernel

# columns of a rotor's row
ADVANCE_RATIO, HOVER_INFLOW, DESCENT, FLOW, STALLED, REVERSED, OUTSIDE = range(7)
WORKING_SIZE = 7

# rows of a rotor's stall angles
REYNOLDS, HIGHEST, LOWEST = range(3)


@entry
def working_state(p, x, stall, work, out):
    """Working state of every rotor at the instant of the last `derivative`.

    Parameters
    ----------
    p : Params
    x : ndarray, shape (size,)
        Simulation state that the derivative was asked for.
    stall : ndarray, shape (n_rotors, 3, n)
        Reynolds numbers, increasing, and the highest and lowest angle of attack [rad] at which the rotor's airfoil is
        not stalled; filled up with copies of the last.
    work : Work
        As the derivative left it.
    out : ndarray, shape (n_rotors, WORKING_SIZE)
        Output: advance ratio; hover inflow ratio of the present thrust, a_w sqrt(2 |C_T|); velocity of the hub against
        the thrust and flow through the disc with it, both over the tip speed; shares of the disc, between flap hinge
        and tip, where sections are stalled, where the flow comes from behind, and where the Reynolds number is outside
        of the airfoil's table, as the blades meet it now.
    """
    for j in range(p.rotor.shape[0]):
        rotor, row = p.rotor[j], out[j]
        scale = rotor[P.INVERSE_TIP_SPEED]
        sense = 1.0 if work.aero[j, 0] >= 0.0 else -1.0  # upside down, all that follows is
        mu_z = work.hub_flow[j, 2] * scale
        row[ADVANCE_RATIO] = math.hypot(work.hub_flow[j, 0], work.hub_flow[j, 1]) * scale
        row[HOVER_INFLOW] = rotor[P.DUCT] * math.sqrt(2.0 * abs(work.aero[j, 0]) * rotor[P.LOAD_SCALE])
        row[DESCENT] = sense * mu_z
        row[FLOW] = sense * (x[S.BODY_SIZE + 4 * p.first_blade[-1] + 3 * j] - mu_z)
        row[STALLED], row[REVERSED], row[OUTSIDE] = _shares(p, j, stall[j], work)


@kernel
def _shares(p, j, stall, work):
    """Shares of the disc of rotor j that are stalled, in reverse flow, and outside of the table, by area."""
    area = stalled = reversed_ = outside = 0.0
    hinge = p.rotor[j, P.HINGE]
    for blade in range(p.first_blade[j + 1] - p.first_blade[j]):
        row, lane = work.blade[p.first_block[j] + blade // P.LANES], blade % P.LANES
        ut0, ut1, up0, up1 = row[P.UT0 + lane], row[P.UT1 + lane], row[P.UP0 + lane], row[P.UP1 + lane]
        for chunk in range(p.element.shape[1]):
            element = p.element[j, chunk]
            for i in range(min(P.CHUNK, p.grid_index[j, 3] - chunk * P.CHUNK)):
                span, chord = element[P.SPAN + i], element[P.CHORD + i]
                part = (hinge + span) * element[P.HALF_AREA + i] / chord
                ut, up = ut0 + ut1 * span, up0 + up1 * span
                area += part
                reynolds = math.sqrt(ut * ut + up * up) * chord * p.air[P.INVERSE_VISCOSITY]
                if not stall[REYNOLDS, 0] <= reynolds <= stall[REYNOLDS, -1]:
                    outside += part
                if ut <= 0.0:
                    reversed_ += part
                else:
                    alpha = row[P.PITCH + lane] + element[P.TWIST + i] - math.atan2(up, ut)
                    low = _between(stall[REYNOLDS], stall[LOWEST], reynolds)
                    high = _between(stall[REYNOLDS], stall[HIGHEST], reynolds)
                    if not low <= alpha <= high:
                        stalled += part
    return stalled / area, reversed_ / area, outside / area


@kernel
def _between(places, values, place):
    """Linear interpolation, constant beyond the ends."""
    if place <= places[0]:
        return values[0]
    for i in range(1, places.size):
        if place <= places[i]:
            return values[i - 1] + (values[i] - values[i - 1]) * (place - places[i - 1]) / (places[i] - places[i - 1])
    return values[-1]
