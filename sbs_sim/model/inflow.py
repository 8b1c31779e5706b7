"""Dynamic inflow of Peters and HaQuang with three states per rotor (theory.md section 6).

v_i = Omega R [lambda0 + r/R (lambdac cos psi + lambdas sin psi)], positive downwards through the disc.
D. A. Peters, N. HaQuang: Dynamic inflow for practical applications, J. AHS 33 (4), 1988.
"""

import math

from sbs_sim.model.kernel import entry, kernel

APPARENT_MASS = 8.0 / (3.0 * math.pi)
APPARENT_INERTIA = 16.0 / (45.0 * math.pi)
SKEW = 15.0 * math.pi / 64.0
# Total flow through the disc is never less than this share of the tip speed (1.3 mm/s here): it keeps the
# inflow equations finite where the flow through the disc vanishes, and changes the hover flow by 2e-8.
LEAST_FLOW = 1e-5


@kernel
def inflow_rates(lambda0, lambdas, lambdac, mu_x, mu_y, mu_z, sense, duct, speed, thrust, sine, cosine, cyclic):
    """Time derivatives of lambda0, lambdas, lambdac [1/s].

    mu_x, mu_y, mu_z: velocity of the hub relative to the air in hub axes over the tip speed. duct: wake expansion
    ratio a_w. thrust, sine, cosine: C_T and the coefficients m_s, m_c of the aerodynamic moments, where more lift
    aft (psi = 0) gives more inflow aft. cyclic: 0 holds lambdas and lambdac.
    """
    flow, flow_cyclic, xc, xs = _flow(lambda0, mu_x, mu_y, mu_z, sense)
    return _rates(lambda0, lambdas, lambdac, flow, flow_cyclic, xc, xs, duct, speed, thrust, sine, cosine, cyclic)


@entry
def inflow_matrix(lambda0, mu_x, mu_y, mu_z, sense, duct, speed, cyclic, out):
    """C^lambda of lambda' = C^lambda lambda + E^lambda (paper, appendix B): the flow through the disc is held.

    Parameters are those of `inflow_rates`; out, shape (3, 3), is in the order lambda0, lambdas, lambdac [1/s].
    """
    flow, flow_cyclic, xc, xs = _flow(lambda0, mu_x, mu_y, mu_z, sense)
    for i in range(3):
        l0, ls, lc = 1.0 * (i == 0), 1.0 * (i == 1), 1.0 * (i == 2)
        out[0, i], out[1, i], out[2, i] = _rates(
            l0, ls, lc, flow, flow_cyclic, xc, xs, duct, speed, 0.0, 0.0, 0.0, cyclic
        )


@kernel
def _flow(lambda0, mu_x, mu_y, mu_z, sense):
    """V_T, V_m and the skew of the wake along x and y, all of the present flow through the disc."""
    lam = lambda0 - mu_z
    mu_squared = mu_x * mu_x + mu_y * mu_y
    flow = math.sqrt(mu_squared + lam * lam + LEAST_FLOW * LEAST_FLOW)
    flow_cyclic = (mu_squared + lam * (lam + lambda0)) / flow
    denominator = flow + abs(lam)
    return flow, flow_cyclic, mu_x / denominator, -sense * mu_y / denominator


@kernel
def _rates(lambda0, lambdas, lambdac, flow, flow_cyclic, xc, xs, duct, speed, thrust, sine, cosine, cyclic):
    """Rates of the inflow states [1/s], linear in them and in the loads."""
    l11 = 2.0 * duct * duct
    if cyclic == 0:
        return speed * (thrust - flow * lambda0 / l11) / APPARENT_MASS, 0.0, 0.0
    y0, yc, ys = _solve_gain(l11, xc, xs, lambda0, lambdac, lambdas)
    return (
        speed * (thrust - flow * y0) / APPARENT_MASS,
        speed * (sine - flow_cyclic * ys) / APPARENT_INERTIA,
        speed * (cosine - flow_cyclic * yc) / APPARENT_INERTIA,
    )


@kernel
def _solve_gain(l11, xc, xs, b0, bc, bs):
    """Solve Lt y = b in the order (0, c, s), Lt of theory.md section 6, by Cramer's rule."""
    ring = 2.0 * (1.0 + xc * xc + xs * xs)
    a11, a12, a13 = l11, -SKEW * xc, -SKEW * xs
    a21, a22, a23 = SKEW * xc, ring - 4.0 * xc * xc, -4.0 * xc * xs
    a31, a32, a33 = SKEW * xs, a23, ring - 4.0 * xs * xs
    c11 = a22 * a33 - a23 * a32
    c12 = a23 * a31 - a21 * a33
    c13 = a21 * a32 - a22 * a31
    inverse = 1.0 / (a11 * c11 + a12 * c12 + a13 * c13)
    y0 = (b0 * c11 + bc * (a13 * a32 - a12 * a33) + bs * (a12 * a23 - a13 * a22)) * inverse
    yc = (b0 * c12 + bc * (a11 * a33 - a13 * a31) + bs * (a13 * a21 - a11 * a23)) * inverse
    ys = (b0 * c13 + bc * (a12 * a31 - a11 * a32) + bs * (a11 * a22 - a12 * a21)) * inverse
    return y0, yc, ys
