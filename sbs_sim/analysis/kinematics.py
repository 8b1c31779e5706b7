"""What a rigid body adds to a linear model without any load."""

from __future__ import annotations  # `help` then shows types by their names

import numpy as np
from numpy.typing import NDArray

from sbs_sim.model import state as S
from sbs_sim.model.elementary import cosine_and_sine
from sbs_sim.model.frames import cross_matrix
from sbs_sim.model.solve import product, solve

Array = NDArray[np.float64]


def kinematics(state: Array, inertia: Array, gravity: float) -> Array:
    """Terms of a rigid body in A_B-B that are not aerodynamic: turning axes, gravity, attitude, gyroscopic moments.

    Padfield, Helicopter Flight Dynamics, section 4A.2, for any trim: U' = F/m - om x U + g, om' = I^-1 (M - om x I om),
    Euler kinematics.

    Parameters
    ----------
    state : ndarray, shape (n,)
        Trimmed linear state; its first eight are the body's.
    inertia : ndarray, shape (3, 3)
        About the c.g. [kg m^2].
    gravity : float
        [m/s^2]

    Returns
    -------
    ndarray, shape (8, 8)
    """
    u, w, q, theta, v, p, phi, r = np.asarray(state, dtype=float)[: S.LINEAR_BODY_SIZE].tolist()
    g = gravity
    (ct, st), (cp, sp) = cosine_and_sine(theta), cosine_and_sine(phi)
    velocity, rates = np.array([u, v, w]), np.array([p, q, r])
    axis = [S.LINEAR_U, S.LINEAR_V, S.LINEAR_W]
    turn = [S.LINEAR_P, S.LINEAR_Q, S.LINEAR_R]
    a = np.zeros((S.LINEAR_BODY_SIZE, S.LINEAR_BODY_SIZE))
    a[np.ix_(axis, axis)] = -cross_matrix(rates)
    a[np.ix_(axis, turn)] = cross_matrix(velocity)
    a[axis, S.LINEAR_THETA] = -g * ct, -g * sp * st, -g * cp * st
    a[axis, S.LINEAR_PHI] = 0.0, g * cp * ct, -g * sp * ct
    momentum = product(inertia, rates[:, np.newaxis])[:, 0]
    gyroscopic = product(cross_matrix(rates), inertia) - cross_matrix(momentum)
    a[np.ix_(turn, turn)] = -solve(inertia, gyroscopic)
    heading = q * sp + r * cp  # psi' cos theta
    a[S.LINEAR_THETA, [S.LINEAR_Q, S.LINEAR_R]] = cp, -sp
    a[S.LINEAR_THETA, S.LINEAR_PHI] = -heading
    a[S.LINEAR_PHI, turn] = 1.0, sp * st / ct, cp * st / ct
    a[S.LINEAR_PHI, S.LINEAR_THETA] = heading / (ct * ct)
    a[S.LINEAR_PHI, S.LINEAR_PHI] = (q * cp - r * sp) * st / ct
    return a
