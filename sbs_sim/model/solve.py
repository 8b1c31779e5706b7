"""Small systems of linear equations, solved the same to the last bit on every machine, which libraries do not.

Gaussian elimination with partial pivoting (G. H. Golub, C. F. Van Loan: Matrix computations, section 3.4).
"""

import math

import numpy as np
from numpy.typing import NDArray

from sbs_sim.model.kernel import entry, kernel

Array = NDArray[np.float64]

MAX_SWEEPS, ORTHOGONAL = 40, 1e-15  # of Jacobi rotations; cosine of two columns that need no rotation


def solve(matrix: Array, right: Array) -> Array:
    """Solution y of matrix @ y = right.

    Parameters
    ----------
    matrix : ndarray, shape (n, n)
    right : ndarray, shape (n,) or (n, m)

    Returns
    -------
    ndarray of the shape of `right`

    Raises
    ------
    numpy.linalg.LinAlgError
        The matrix is singular, or not finite.
    """
    left = np.array(matrix, dtype=float, order="C")
    sides = np.array(right, dtype=float, order="C").reshape(len(left), math.prod(np.shape(right)[1:]))
    if not eliminate(left, sides):
        raise np.linalg.LinAlgError("Singular matrix")
    return sides.reshape(np.shape(right))


@entry
def eliminate(matrix, sides):
    """Overwrite `sides`, shape (n, m), with the solution; the matrix too is overwritten. False if it is singular."""
    n = matrix.shape[0]
    for k in range(n):
        pivot = k
        for i in range(k + 1, n):
            if abs(matrix[i, k]) > abs(matrix[pivot, k]):
                pivot = i
        if not abs(matrix[pivot, k]) > 0.0:  # zero, or not a number
            return False
        for j in range(n):
            matrix[k, j], matrix[pivot, j] = matrix[pivot, j], matrix[k, j]
        for j in range(sides.shape[1]):
            sides[k, j], sides[pivot, j] = sides[pivot, j], sides[k, j]
        inverse = 1.0 / matrix[k, k]
        for i in range(k + 1, n):
            factor = matrix[i, k] * inverse
            if factor != 0.0:
                for j in range(k + 1, n):
                    matrix[i, j] -= factor * matrix[k, j]
                for j in range(sides.shape[1]):
                    sides[i, j] -= factor * sides[k, j]
    for k in range(n - 1, -1, -1):
        inverse = 1.0 / matrix[k, k]
        for j in range(sides.shape[1]):
            for i in range(k + 1, n):
                sides[k, j] -= matrix[k, i] * sides[i, j]
            sides[k, j] *= inverse
    return True


def product(left: Array, right: Array) -> Array:
    """The matrix left @ right, (n, k) times (k, m): every element the sum in order of rounded products.

    For small matrices; what BLAS adds up first is the processor's choice.
    """
    total = np.zeros((len(left), right.shape[1]))
    for column, row in zip(left.T, right, strict=True):
        total += column[:, np.newaxis] * row
    return total


def length(vector: Array) -> float:
    """Euclidean length, the squares summed in order."""
    total = 0.0
    for part in vector.tolist():
        total += part * part
    return math.sqrt(total)


def smallest(matrix: Array, right: Array, share: float) -> Array:
    """Least-squares solution y of matrix @ y = right of minimum length; the matrix may be singular.

    Parameters
    ----------
    matrix : ndarray, shape (n, m)
    right : ndarray, shape (n,)
    share : float
        Singular values below this share of the largest are taken for zero.

    Returns
    -------
    ndarray, shape (m,)
    """
    columns = np.array(matrix.T, dtype=float, order="C")
    solution = np.zeros(len(columns))
    least_squares(columns, np.eye(len(columns)), np.array(right, dtype=float), share, solution)
    return solution


@entry
def least_squares(columns, turns, right, share, solution):
    """Fill `solution` by one-sided Jacobi rotations (Golub and Van Loan, section 8.6.3); the others are overwritten.

    `columns` (m, n) has the matrix by its columns, which the rotations make orthogonal to one another; `turns` (m, m)
    is the unit matrix.
    """
    m, n = columns.shape
    for _ in range(MAX_SWEEPS):
        turned = False
        for p in range(m):
            for q in range(p + 1, m):
                first, second, both = 0.0, 0.0, 0.0
                for i in range(n):
                    first += columns[p, i] * columns[p, i]
                    second += columns[q, i] * columns[q, i]
                    both += columns[p, i] * columns[q, i]
                if abs(both) > ORTHOGONAL * math.sqrt(first * second):
                    turned = True
                    ratio = (second - first) / (2.0 * both)
                    tangent = math.copysign(1.0 / (abs(ratio) + math.sqrt(1.0 + ratio * ratio)), ratio)
                    cosine = 1.0 / math.sqrt(1.0 + tangent * tangent)
                    rotate(columns, p, q, cosine, cosine * tangent)
                    rotate(turns, p, q, cosine, cosine * tangent)
        if not turned:
            break
    largest = 0.0
    for p in range(m):
        square = 0.0
        for i in range(n):
            square += columns[p, i] * columns[p, i]
        largest = max(largest, square)
    for p in range(m):
        square, along = 0.0, 0.0
        for i in range(n):
            square += columns[p, i] * columns[p, i]
            along += columns[p, i] * right[i]
        if square > share * share * largest:
            for j in range(m):
                solution[j] += turns[p, j] * (along / square)


@kernel
def rotate(rows, p, q, cosine, sine):
    """Turn two rows of a matrix in their plane."""
    for i in range(rows.shape[1]):
        first, second = rows[p, i], rows[q, i]
        rows[p, i] = cosine * first - sine * second
        rows[q, i] = sine * first + cosine * second
