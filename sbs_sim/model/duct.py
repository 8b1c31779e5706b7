"""Duct around a rotor (theory.md sections 5.5 and 6.2).

Two models. `duct_thrust` is a fixed share of the rotor's thrust, as in hover (Leishman, Principles of Helicopter
Aerodynamics, chapter 6). `duct_flow` is the control volume of a rotor and a duct with a fixed exit area, in any flight.
"""

from typing import Any, NamedTuple

from sbs_sim.lanes import Vector, maximum, minimum, rounded, sqrt
from sbs_sim.model.inflow import MIN_FLOW
from sbs_sim.model.kernel import kernel

SLOW = 0.25  # flow through the disc over the velocity of the air far away below which the duct's recovery fades


class DuctFlow(NamedTuple):
    """Coefficients of thrust, over rho pi R^2 (Omega R)^2.

    Attributes
    ----------
    rotor : lanes
        Of the rotor, eq. (6.9): what its pressure rise has to be in a steady flow.
    duct : lanes
        Of the duct along the shaft, eq. (6.10).
    mass_flow : lanes
        |lambda|: times the velocity along the disc it is the momentum that the duct turns.
    """

    rotor: Any
    duct: Any
    mass_flow: Any


@kernel
def duct_thrust(expansion, rotor_thrust):
    """Thrust of the duct along the shaft [N]: (2 a_w - 1) T_rotor; none for an open rotor's a_w = 1/2."""
    return (2.0 * expansion - 1.0) * rotor_thrust


@kernel
def sheltered(turning, velocity):
    """Velocity that a rotor meets behind a lip that turns a share of what comes along the disc, hub axes."""
    kept = 1.0 - turning
    return Vector(rounded(kept * velocity.x), rounded(kept * velocity.y), velocity.z)


@kernel
def duct_flow(rotor, lambda0, mu):
    """Thrust of a rotor and of its duct from the flow through both.

    Parameters
    ----------
    rotor : record ROTOR
    lambda0 : lanes
    mu : Vector
        Velocity of the hub relative to the air over the tip speed, hub axes.

    Returns
    -------
    DuctFlow
    """
    through, climb = lambda0 - mu.z, -mu.z
    edgewise_squared = mu.x * mu.x + mu.y * mu.y
    leaving = through / rotor.duct_expansion
    share = rotor.duct_turning * (2.0 - rotor.duct_turning)
    approach = edgewise_squared * rotor.inverse_lip_stall * rotor.inverse_lip_stall
    slope_squared = approach / (through * through + MIN_FLOW * MIN_FLOW)
    recovered = rotor.ram_recovery * share * edgewise_squared / (1.0 + slope_squared * slope_squared)
    # the flow turns over: half of the oncoming dynamic pressure changes its sign over a range of slow flow
    reach = SLOW * sqrt(climb * climb + edgewise_squared + MIN_FLOW * MIN_FLOW)
    x = minimum(maximum(through / reach, -1.0), 1.0)
    sense = x * (1.5 - 0.5 * x * x)
    of_rotor = 0.5 * (leaving * abs(leaving) - sense * (climb * climb + recovered))
    both = abs(through) * (leaving - climb)
    return DuctFlow(of_rotor, both - of_rotor, abs(through))
