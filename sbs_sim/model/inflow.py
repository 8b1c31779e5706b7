"""Dynamic inflow of Peters and HaQuang with three states per rotor (theory.md section 6).

v_i = Omega R [lambda0 + r/R (lambdac cos psi + lambdas sin psi)], positive downwards through the disc.
D. A. Peters, N. HaQuang: Dynamic inflow for practical applications, J. AHS 33 (4), 1988.
"""

import math
from typing import Any, NamedTuple

from sbs_sim.lanes import Vector, as_lanes, as_records, cross, dot, select, sqrt
from sbs_sim.model.descent import measured_flow
from sbs_sim.model.kernel import entry, kernel
from sbs_sim.model.state import COSINE, SINE, UNIFORM, vector_at

INVERSE_MASS = 3.0 * math.pi / 8.0  # 1 / M_0, of the apparent mass
INVERSE_INERTIA = 45.0 * math.pi / 16.0  # 1 / M_1
SKEW = 15.0 * math.pi / 64.0
# Total flow through the disc is never less than this share of the tip speed (1.3 mm/s here): it keeps the
# inflow equations finite where the flow through the disc vanishes, and changes the hover flow by 2e-8.
MIN_FLOW = 1e-5


class Inflow(NamedTuple):
    """A value for each inflow state: of lambda0, lambdac, lambdas, or of what drives them."""

    uniform: Any
    cosine: Any
    sine: Any


class DiscFlow(NamedTuple):
    """Flow through a disc, over the tip speed.

    Attributes
    ----------
    uniform, cyclic : lanes
        V_T and V_m of eq. (6.3).
    skew_cosine, skew_sine : lanes
        X_c and X_s of eq. (6.4): the skew of the wake.
    """

    uniform: Any
    cyclic: Any
    skew_cosine: Any
    skew_sine: Any


@kernel
def rotor_flow(rotor, lambda0, mu):
    """Flow through the disc of a rotor; mu is the hub's velocity relative to the air over the tip speed, hub axes."""
    if rotor.measured_descent == 1:
        axial, growth = measured_flow(lambda0, mu.z)
        return flow_of(axial, growth, mu, rotor.sense)
    return disc_flow(lambda0, mu, rotor.sense)


@kernel
def disc_flow(lambda0, mu, sense):
    """Flow through a disc by momentum theory; mu as for `rotor_flow`."""
    through = lambda0 - mu.z
    return flow_of(through, through + lambda0, mu, sense)


@kernel
def flow_of(through, growth, mu, sense):
    """Flow through a disc of its axial part and of the sum of that and of lambda0 times its slope by lambda0."""
    edgewise_squared = mu.x * mu.x + mu.y * mu.y
    total = sqrt(edgewise_squared + through * through + MIN_FLOW * MIN_FLOW)
    cyclic = (edgewise_squared + through * growth) / total
    inverse = 1.0 / (total + abs(through))
    return DiscFlow(total, cyclic, mu.x * inverse, -(sense * mu.y * inverse))


@kernel
def inflow_rates(rotor, inflow, flow, loads, cyclic):
    """Time derivatives of the inflow [1/s], eq. (6.1), linear in the inflow and in the loads.

    Parameters
    ----------
    rotor : record ROTOR
    inflow : Inflow
    flow : DiscFlow
    loads : Inflow
        C_T, m_c and m_s of eq. (6.2): more lift aft (psi = 0) gives more inflow aft.
    cyclic : int
        0 holds lambdac and lambdas.

    Returns
    -------
    Inflow
    """
    uniform_gain = 2.0 * rotor.duct_expansion * rotor.duct_expansion
    driven = solve_gain(uniform_gain, flow.skew_cosine, flow.skew_sine, inflow)
    # without its cyclic parts the uniform inflow follows Glauert's single equation
    uniform = select(cyclic == 1, driven.uniform, inflow.uniform / uniform_gain)
    inverse_inertia = rotor.inflow_speed * INVERSE_INERTIA
    return Inflow(
        rotor.inflow_speed * INVERSE_MASS * (loads.uniform - flow.uniform * uniform),
        select(cyclic == 1, inverse_inertia * (loads.cosine - flow.cyclic * driven.cosine), 0.0),
        select(cyclic == 1, inverse_inertia * (loads.sine - flow.cyclic * driven.sine), 0.0),
    )


@kernel
def solve_gain(uniform_gain, skew_cosine, skew_sine, inflow):
    """Solve Lt y = inflow, Lt of eq. (6.5), by Cramer's rule."""
    right = Vector(inflow.uniform, inflow.cosine, inflow.sine)
    across = 2.0 * (1.0 + skew_cosine * skew_cosine + skew_sine * skew_sine)
    mixed = -4.0 * skew_cosine * skew_sine
    first = Vector(uniform_gain, SKEW * skew_cosine, SKEW * skew_sine)  # columns of Lt
    second = Vector(-SKEW * skew_cosine, across - 4.0 * skew_cosine * skew_cosine, mixed)
    third = Vector(-SKEW * skew_sine, mixed, across - 4.0 * skew_sine * skew_sine)
    minors = cross(second, third)
    inverse = 1.0 / dot(first, minors)
    return Inflow(
        dot(right, minors) * inverse,
        dot(right, cross(third, first)) * inverse,
        dot(right, cross(first, second)) * inverse,
    )


@entry
def inflow_matrix(rotors, number, lambda0, mu, cyclic, out):
    """C^lambda of lambda' = C^lambda lambda + E^lambda (paper, appendix B): the flow through the disc is held.

    Parameters
    ----------
    rotors : structured ndarray ROTOR, shape (n_rotors,)
    number : int
        Of the rotor.
    lambda0 : ndarray, shape (1, n)
    mu : ndarray, shape (3, n)
        Velocity of the hub relative to the air over the tip speed, hub axes.
    cyclic : int
        0 holds lambdas and lambdac.
    out : ndarray, shape (3, 3, n)
        Output in the order lambda0, lambdas, lambdac [1/s].
    """
    rotor = as_records(rotors)[number]
    velocity, matrix = as_lanes(mu, rotor), as_lanes(out, rotor)
    uniform = as_lanes(lambda0, rotor)[0]
    flow = rotor_flow(rotor, uniform, vector_at(velocity, 0))
    none = Inflow(0.0, 0.0, 0.0)
    for i in range(3):
        unit = Inflow(1.0 * (i == UNIFORM), 1.0 * (i == COSINE), 1.0 * (i == SINE))
        rates = inflow_rates(rotor, unit, flow, none, cyclic)
        matrix[UNIFORM, i], matrix[SINE, i], matrix[COSINE, i] = rates.uniform, rates.sine, rates.cosine
