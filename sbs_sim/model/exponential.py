"""Exponential Runge-Kutta steps: the stiff linear part of a rotor is solved exactly (theory.md section 7.3).

y' = L y + n(y, t) with a constant matrix L for each block of coupled states of a rotor. L changes the error of a
step only: the method is of fourth order for any L.
S. Krogstad: Generalized integrating factor methods for stiff PDEs, Journal of Computational Physics 203, 2005, section
3.2 (ETDRK4-B). In the derivatives of the stages it is a Runge-Kutta method whose coefficients are matrices; L = 0 gives
the classical method, which the body has.
"""

import numpy as np
from numpy.typing import NDArray

from sbs_sim.lanes import as_lanes
from sbs_sim.model.kernel import entry, kernel
from sbs_sim.model.solve import product

Array = NDArray[np.float64]

TERMS = 16  # of Taylor's series
MAX_NORM = 0.5  # row sum norm up to which it is used: the last term is then below the last bit


@kernel
def begin_exponential_step(rotors, parts, state):
    """Copy the rotors' states at the beginning of a step in the order of the blocks."""
    begin = as_lanes(parts.begin, rotors)
    for i in range(parts.states.size):
        begin[parts.block_positions[i]] = state[parts.states[i]]


@kernel
def exponential_stage(rotors, blades, parts, slope, k, stage):
    """Set the rotors' states at the stage after stage k; after the last stage that is the new state.

    Parameters
    ----------
    rotors, blades : records ROTOR, BLADE
        With as many lanes as there are flights, and as a register has.
    parts : Exponential
        Holds the derivatives of the stages before.
    slope : lanes, shape (size,)
        Derivative at stage k.
    k : int
    stage : lanes, shape (size,)
        Output.
    """
    slopes, end = as_lanes(parts.slopes, rotors), as_lanes(parts.end, rotors)
    begin_registers, end_registers = as_lanes(parts.begin_registers, blades), as_lanes(parts.end_registers, blades)
    matrices = as_lanes(parts.matrices, blades)
    for i in range(parts.states.size):
        slopes[k, parts.block_positions[i]] = slope[parts.states[i]]
    element = 0  # of the matrices
    for block in range(parts.sizes.size):
        first = parts.starts[block]
        for register in range(parts.registers[block], parts.registers[block + 1]):
            total = begin_registers[register]
            for m in range(k + 1):
                matrix, slope_m = matrices[k * (k + 1) // 2 + m], slopes[m]
                for j in range(parts.sizes[block]):
                    total = total + matrix[element + j] * slope_m[first + j]
            end_registers[register] = total
            element += parts.sizes[block]
    for i in range(parts.states.size):
        stage[parts.states[i]] = end[parts.block_positions[i]]


def coefficients(linear: Array, h: float) -> Array:
    """Coefficients of a step, eq. (7.3) solved for the derivatives f_1 to f_4 of the stages.

    With d_i = f_i - f_1 - L (y_i - y_1): the stages are y_2 = y_1 + a1 f_1, y_3 = y_1 + b1 f_1 + b2 f_2,
    y_4 = y_1 + c1 f_1 + c2 f_2 + c3 f_3, and the new state is y_1 + new1 f_1 + new2 f_2 + new3 f_3 + new4 f_4.

    Parameters
    ----------
    linear : ndarray, shape (m, m)
        L [1/s].
    h : float
        Step [s].

    Returns
    -------
    ndarray, shape (10, m, m)
        Row by row as in Butcher's tableau [s], those of the second stage first, those of the new state last.
    """
    z, one = 0.5 * h * linear, np.eye(len(linear))
    doublings = 0
    while np.abs(z).sum(axis=1).max() > MAX_NORM:
        z, doublings = 0.5 * z, doublings + 1
    phi, half = np.zeros((4, *z.shape)), np.zeros((4, *z.shape))
    set_phi_functions(np.ascontiguousarray(z), doublings, phi, half)
    a1, first_order = 0.5 * h * half[1], h * phi[1]  # of f_1, where L explains all
    b2, c3 = h * half[2], 2.0 * h * phi[2]  # of d_2 and d_3
    inner, new4 = h * (2.0 * phi[2] - 4.0 * phi[3]), h * (4.0 * phi[3] - phi[2])  # of d_2 and d_3, of d_4
    # f_1 + L (y_i - y_1) in terms of the derivatives: what is subtracted from f_2, f_3, f_4
    b1 = a1 - product(b2, half[0])
    third1, third2 = one + product(linear, b1), product(linear, b2)
    c1, c2 = first_order - product(c3, third1), -product(c3, third2)
    fourth1, fourth2, fourth3 = one + product(linear, c1), product(linear, c2), product(linear, c3)
    new1 = first_order - product(inner, half[0] + third1) - product(new4, fourth1)
    new2 = inner - product(inner, third2) - product(new4, fourth2)
    new3 = inner - product(new4, fourth3)
    return np.stack([a1, b1, b2, c1, c2, c3, new1, new2, new3, new4])


@entry
def set_phi_functions(z, doublings, phi, half):
    """Fill phi with phi_0 .. phi_3 of 2^(doublings + 1) z, and `half` with those of 2^doublings z.

    phi_3 is a series, the others follow from phi_k = 1/k! + z phi_k+1, and those of 2 z from those of z: N. J. Higham,
    Functions of Matrices, SIAM 2008, section 10.7.4; M. Hochbruck, A. Ostermann, Exponential integrators, Acta
    Numerica 19, 2010, section 2.
    """
    m = z.shape[0]
    for term in range(TERMS, -1, -1):  # Horner: phi_3 = 1/3! (1 + z/4 (1 + z/5 (...)))
        set_product(z, phi[3], half[0])
        share = 1.0 / (term + 3.0) if term else 1.0 / 6.0
        for i in range(m):
            for j in range(m):
                phi[3, i, j] = share * (half[0, i, j] + (1.0 if i == j else 0.0))
    for k in range(2, -1, -1):
        set_product(z, phi[k + 1], phi[k])
        for i in range(m):
            phi[k, i, i] += 0.5 if k == 2 else 1.0
    for _ in range(doublings + 1):
        for k in range(4):
            for i in range(m):
                for j in range(m):
                    half[k, i, j] = phi[k, i, j]
        for k in range(4):
            set_product(half[0], half[k], phi[k])
        for i in range(m):
            for j in range(m):
                phi[1, i, j] = 0.5 * (phi[1, i, j] + half[1, i, j])
                phi[2, i, j] = 0.25 * (phi[2, i, j] + half[1, i, j] + half[2, i, j])
                phi[3, i, j] = 0.125 * (phi[3, i, j] + 0.5 * half[1, i, j] + half[2, i, j] + half[3, i, j])


@kernel
def set_product(left, right, out):
    """Product of two square matrices."""
    for i in range(left.shape[0]):
        for j in range(left.shape[0]):
            out[i, j] = 0.0
        for k in range(left.shape[0]):
            factor = left[i, k]
            for j in range(left.shape[0]):
                out[i, j] += factor * right[k, j]
