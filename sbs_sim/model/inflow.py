"""Dynamic inflow of Peters and HaQuang with three states per rotor (theory.md section 6).

v_i = Omega R [lambda0 + r/R (lambdac cos psi + lambdas sin psi)], positive downwards through the disc.
D. A. Peters, N. HaQuang: Dynamic inflow for practical applications, J. AHS 33 (4), 1988.
"""

import math
from typing import Any, NamedTuple

from sbs_sim.lanes import Vector, as_lanes, as_records, cross, dot, select, sqrt
from sbs_sim.model.kernel import entry, kernel

INVERSE_MASS = 3.0 * math.pi / 8.0  # 1 / M_0, of the apparent mass
INVERSE_INERTIA = 45.0 * math.pi / 16.0  # 1 / M_1
SKEW = 15.0 * math.pi / 64.0
# Total flow through the disc is never less than this share of the tip speed (1.3 mm/s here): it keeps the
# inflow equations finite where the flow through the disc vanishes, and changes the hover flow by 2e-8.
LEAST_FLOW = 1e-5


class DiscFlow(NamedTuple):
    """V_T, V_m of eq. (6.3), and the skew of the wake along x and y, of the present flow through the disc."""

    total: Any
    cyclic: Any
    skew_x: Any
    skew_y: Any


@kernel
def disc_flow(lambda0, mu, sense):
    """Flow through a disc; mu is the velocity of the hub relative to the air over the tip speed, hub axes."""
    through = lambda0 - mu.z
    edgewise = mu.x * mu.x + mu.y * mu.y
    total = sqrt(edgewise + through * through + LEAST_FLOW * LEAST_FLOW)
    cyclic = (edgewise + through * (through + lambda0)) / total
    inverse = 1.0 / (total + abs(through))
    return DiscFlow(total, cyclic, mu.x * inverse, -(sense * mu.y * inverse))


@kernel
def inflow_rates(rotor, inflow, flow, loads, cyclic):
    """Time derivatives of lambda0, lambdac, lambdas [1/s], eq. (6.1), linear in the inflow and in the loads.

    Parameters
    ----------
    rotor : record ROTOR
    inflow : Vector
        lambda0, lambdac, lambdas.
    flow : DiscFlow
    loads : Vector
        C_T and the coefficients m_c, m_s of the aerodynamic moments, where more lift aft (psi = 0) gives more inflow
        aft.
    cyclic : int
        0 holds lambdac and lambdas.
    """
    uniform_gain = 2.0 * rotor.duct * rotor.duct
    driven = solve_gain(uniform_gain, flow.skew_x, flow.skew_y, inflow)
    # without its cyclic parts the uniform inflow follows Glauert's single equation
    uniform = select(cyclic == 1, driven.x, inflow.x / uniform_gain)
    inertia = rotor.speed * INVERSE_INERTIA
    return Vector(
        rotor.speed * INVERSE_MASS * (loads.x - flow.total * uniform),
        select(cyclic == 1, inertia * (loads.y - flow.cyclic * driven.y), 0.0),
        select(cyclic == 1, inertia * (loads.z - flow.cyclic * driven.z), 0.0),
    )


@kernel
def solve_gain(uniform_gain, skew_x, skew_y, b):
    """Solve Lt y = b in the order (0, c, s), Lt of theory.md section 6, by Cramer's rule."""
    ring = 2.0 * (1.0 + skew_x * skew_x + skew_y * skew_y)
    mixed = -4.0 * skew_x * skew_y
    first = Vector(uniform_gain, SKEW * skew_x, SKEW * skew_y)
    second = Vector(-SKEW * skew_x, ring - 4.0 * skew_x * skew_x, mixed)
    third = Vector(-SKEW * skew_y, mixed, ring - 4.0 * skew_y * skew_y)
    minors = cross(second, third)
    inverse = 1.0 / dot(first, minors)
    return Vector(
        dot(b, minors) * inverse, dot(b, cross(third, first)) * inverse, dot(b, cross(first, second)) * inverse
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
    flow = disc_flow(uniform, Vector(velocity[0], velocity[1], velocity[2]), rotor.sense)
    none = Vector(0.0, 0.0, 0.0)
    for i in range(3):
        unit = Vector(1.0 * (i == 0), 1.0 * (i == 2), 1.0 * (i == 1))
        rates = inflow_rates(rotor, unit, flow, none, cyclic)
        matrix[0, i], matrix[1, i], matrix[2, i] = rates.x, rates.z, rates.y
