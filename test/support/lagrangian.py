"""Flap and lag accelerations of one blade from Lagrange's equations: a check on theory.md section 3.

Only the position of the blade's points enters, r(t, beta, xi) + s e(t, beta, xi), on a hub whose motion is
prescribed. Kinetic energy, its derivatives and the generalized forces follow by symbolic differentiation; no
angular velocity and no cross product of the model is used. The mass enters by its integrals m_b, S1, A1.
"""

from functools import cache

import numpy as np
import sympy as sp
from plain_model import flap_inertia


def _cross_matrix(vector):
    a, b, c = vector
    return sp.Matrix([[0, -c, b], [c, 0, -a], [-b, a, 0]])


@cache
def _equations():
    """Return a compiled function of the instant that gives mass matrix, forces and the points' Jacobians.

    Inertial axes are the body axes of the instant t = 0. The body's motion is a Taylor series to second order
    in t, which holds all that Lagrange's equations see at t = 0.
    """
    t, beta, xi, beta_d, xi_d = sp.symbols("t beta xi beta_d xi_d")
    psi, speed, g = sp.symbols("psi Omega G")
    e_0, e_f, m, s_1, a_1 = sp.symbols("e_0 e_F m S_1 A_1")
    k_beta, k_xi, beta_0, xi_0, c_xi = sp.symbols("K_beta K_xi beta_0 xi_0 C_xi")
    velocity, acceleration, rate, rate_dot, hub, x_hub, y_hub, up, gravity = (
        sp.Matrix(sp.symbols(f"{name}:3")) for name in ("v", "a", "w", "wd", "h", "xh", "yh", "u", "g")
    )

    turn = _cross_matrix(rate)
    attitude = sp.eye(3) + turn * t + (_cross_matrix(rate_dot) + turn * turn) * t**2 / 2
    origin = velocity * t + acceleration * t**2 / 2
    azimuth = psi + speed * t

    # Lag takes the blade back to azimuth - xi about the hinge; flap lifts it out of the plane.
    def radial(angle):
        return -sp.cos(angle) * x_hub + g * sp.sin(angle) * y_hub

    lagged = radial(azimuth - xi)
    hinge = origin + attitude * (hub + (e_0 - e_f) * radial(azimuth) + e_f * lagged)
    span = attitude * (sp.cos(beta) * lagged + sp.sin(beta) * up)

    def rate_of(vector):
        return vector.diff(t) + vector.diff(beta) * beta_d + vector.diff(xi) * xi_d

    hinge_d, span_d = rate_of(hinge), rate_of(span)
    kinetic = (m * hinge_d.dot(hinge_d) + 2 * s_1 * hinge_d.dot(span_d) + a_1 * span_d.dot(span_d)) / 2
    potential = (k_beta * (beta - beta_0) ** 2 + k_xi * (xi - xi_0) ** 2) / 2 - gravity.dot(m * hinge + s_1 * span)

    angles, rates = (beta, xi), (beta_d, xi_d)
    now = {t: 0}
    mass = sp.Matrix(2, 2, lambda i, j: kinetic.diff(rates[i], rates[j])).subs(now)
    force = []
    for angle, angle_rate in zip(angles, rates, strict=True):
        generalized = kinetic.diff(angle_rate)
        rest = generalized.diff(t) + sum(
            generalized.diff(other) * other_rate for other, other_rate in zip(angles, rates, strict=True)
        )
        damping = -c_xi * xi_d if angle is xi else 0
        force.append((-rest + kinetic.diff(angle) - potential.diff(angle) + damping).subs(now))
    jacobians = [part.diff(angle).subs(now) for part in (hinge, span) for angle in angles]
    arguments = [
        *(beta, xi, beta_d, xi_d, psi, speed, g, e_0, e_f, m, s_1, a_1, k_beta, k_xi, beta_0, xi_0, c_xi),
        *(velocity, acceleration, rate, rate_dot, hub, x_hub, y_hub, up, gravity),
    ]
    return sp.lambdify(arguments, [mass, sp.Matrix(force), *jacobians], modules="numpy", cse=True)


def blade_accelerations(
    rotor, hub_frame, angles, rates, psi, body, gravity, elements=(), second_moment=None, lead_lag=True
):
    """Return beta'' and xi'' of one blade, in the rotating frame [rad/s^2].

    Parameters
    ----------
    rotor : rotor of an aircraft
        See `plain_model`.
    hub_frame : tuple of three arrays, shape (3,)
        x_hub, y_hub, u in body axes.
    angles, rates : tuple of two floats
        beta, xi [rad] and their rates in the rotating frame [rad/s].
    psi : float
        The blade's azimuth [rad].
    body : tuple of four arrays, shape (3,)
        U [m/s], U' + om x U [m/s^2], om [rad/s], om' [rad/s^2], body axes.
    gravity : array, shape (3,)
        Body axes [m/s^2].
    elements : iterable of (float, array of shape (3,))
        Stations from the flap hinge [m] and external forces there [N], body axes.
    second_moment : float, optional
        In place of A1 of the rotor [kg m^2].
    lead_lag : bool
        Off: xi'' is zero as a constraint.

    Returns
    -------
    tuple of two floats
    """
    inertia = flap_inertia(rotor) if second_moment is None else second_moment
    mass, force, *jacobians = _equations()(
        *angles,
        *rates,
        psi,
        rotor.speed,
        rotor.rotation,
        rotor.hinge_offset,
        rotor.flap_hinge_offset,
        rotor.blade_mass,
        rotor.blade_mass * rotor.blade_cg,
        inertia,
        rotor.flap_spring,
        rotor.lag_spring,
        rotor.flap_rest,
        rotor.lag_rest,
        rotor.lag_damping,
        *body,
        rotor.hub,
        *hub_frame,
        gravity,
    )
    hinge_by_flap, hinge_by_lag, span_by_flap, span_by_lag = (np.ravel(part) for part in jacobians)
    force = np.ravel(force)
    for s, load in elements:
        force[0] += load @ (hinge_by_flap + s * span_by_flap)
        force[1] += load @ (hinge_by_lag + s * span_by_lag)
    if not lead_lag:
        return force[0] / mass[0, 0], 0.0
    return tuple(np.linalg.solve(mass, force))
