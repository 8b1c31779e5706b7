"""Exponential Runge-Kutta steps: what is stiff in a rotor is solved exactly (theory.md section 7.3).

y' = L y + n(y, t) with a constant matrix L for each set of states of a rotor that belong together. L changes the error
of a step and nothing else: the method is of fourth order whatever it is.
S. Krogstad: Generalized integrating factor methods for stiff PDEs, Journal of Computational Physics 203, 2005, section
3.2 (ETDRK4-B). In the derivatives of the stages it is a Runge-Kutta method whose coefficients are matrices; L = 0 gives
the classical one, which the body has.
"""

import numpy as np
from numpy.typing import NDArray

from sbs_sim.lanes import as_lanes
from sbs_sim.model.kernel import entry, kernel

Array = NDArray[np.float64]

STAGES = 4
COEFFICIENTS = STAGES * (STAGES + 1) // 2
TERMS = 16  # of Taylor's series
SMALL = 0.5  # row sum norm up to which it is used: the last term is then below the last bit


@kernel
def begin_exponential_step(rotors, parts, state):
    """Take the rotors' states at the beginning of a step into the order of the blocks."""
    begin = as_lanes(parts.begin, rotors)
    for i in range(parts.places.size):
        begin[parts.positions[i]] = state[parts.places[i]]


@kernel
def exponential_stage(rotors, blades, parts, slope, k, stage):
    """Set the rotors' states of the stage that follows stage k, the last one being the new state.

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
    slopes, ending = as_lanes(parts.slopes, rotors), as_lanes(parts.end, rotors)
    matrices, registers = as_lanes(parts.matrices, blades), as_lanes(parts.end_registers, blades)
    begin = as_lanes(parts.begin_registers, blades)
    for i in range(parts.places.size):
        slopes[k, parts.positions[i]] = slope[parts.places[i]]
    number = 0
    for block in range(parts.sizes.size):
        first = parts.starts[block]
        for register in range(parts.registers[block], parts.registers[block + 1]):
            total = begin[register]
            for m in range(k + 1):
                factors, given = matrices[k * (k + 1) // 2 + m], slopes[m]
                for j in range(parts.sizes[block]):
                    total = total + factors[number + j] * given[first + j]
            registers[register] = total
            number += parts.sizes[block]
    for i in range(parts.places.size):
        stage[parts.places[i]] = ending[parts.positions[i]]


def coefficients(linear: Array, h: float) -> Array:
    """Coefficients of a step.

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
    while np.abs(z).sum(axis=1).max() > SMALL:
        z, doublings = 0.5 * z, doublings + 1
    phi, half = np.zeros((4, *z.shape)), np.zeros((4, *z.shape))
    phi_functions(np.ascontiguousarray(z), doublings, phi, half)
    a1, whole = 0.5 * h * half[1], h * phi[1]
    b2, c3 = h * half[2], 2.0 * h * phi[2]
    inner, outer = h * (2.0 * phi[2] - 4.0 * phi[3]), h * (4.0 * phi[3] - phi[2])
    # what of a derivative's difference from the first one L explains: of the second, third and fourth stage
    b1 = a1 - _times(b2, half[0])
    third1, third2 = one + _times(linear, b1), _times(linear, b2)
    c1, c2 = whole - _times(c3, third1), -_times(c3, third2)
    fourth1, fourth2, fourth3 = one + _times(linear, c1), _times(linear, c2), _times(linear, c3)
    new1 = whole - _times(inner, half[0] + third1) - _times(outer, fourth1)
    new2 = inner - _times(inner, third2) - _times(outer, fourth2)
    new3 = inner - _times(outer, fourth3)
    return np.stack([a1, b1, b2, c1, c2, c3, new1, new2, new3, outer])


def _times(left: Array, right: Array) -> Array:
    """Product of two square matrices, to the same bits everywhere."""
    product = np.zeros(left.shape)
    multiply(left, right, product)
    return product


@entry
def phi_functions(z, doublings, phi, half):
    """Fill phi with phi_0 .. phi_3 of 2^(doublings + 1) z, and `half` with those of half of that.

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


@entry
def multiply(left, right, out):
    """Product of two square matrices."""
    set_product(left, right, out)


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
