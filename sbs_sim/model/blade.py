"""One blade: kinematics, section loads and the terms of its flap and lag equations (theory.md sections 2 to 5).

A blade is worked out in its own basis (y, t, u): y along the line from lag to flap hinge, t along the motion, u up
along the shaft. For a counter-clockwise rotor this basis is right-handed; for a clockwise one it is left-handed,
and angular velocities and moments are then stored with the factor G = -1. In that convention every formula below
is the one of a counter-clockwise rotor, and mirrored aircraft are mirrored exactly.
"""

import math

from sbs_sim.model import params as P
from sbs_sim.model.airfoil import clamp, coefficients_at
from sbs_sim.model.arctangent import arctangent2
from sbs_sim.model.kernel import kernel

CHUNK = P.CHUNK
SPEED_ROW, REYNOLDS_ROW, ALPHA_ROW, RE_ROW, LIFT_ROW, DRAG_ROW = (CHUNK * row for row in range(P.STRIP_ROWS))


@kernel
def section_loads(p, j, strip, ut0, ut1, up0, up1, pitch):
    """Sums of the aerodynamic forces along one blade of rotor j (theory.md section 4).

    The velocities relative to the air are linear in the distance s from the flap hinge: u_T = ut0 + ut1 s along the
    motion, u_P = up0 + up1 s along the blade's normal n [m/s]. pitch: angle of the blade root [rad].

    The elements go by in chunks, each in three passes over the rows of `strip`: arithmetic that the compiler turns
    into vector instructions, look-ups that it cannot, and arithmetic again.

    Returns
    -------
    Int dF_n, Int dF_t [N], Int s dF_n, Int s dF_t [N m], n up and t forward.
    """
    fn = ft = mn = mt = 0.0
    for start in range(0, p.element.shape[2], CHUNK):
        count = min(CHUNK, p.element.shape[2] - start)
        _section_flow(p, j, strip, start, count, ut0, ut1, up0, up1, pitch)
        _section_coefficients(p, j, strip, count)
        dfn, dft, dmn, dmt = _section_forces(p, j, strip, start, count, ut0, ut1, up0, up1)
        fn += dfn
        ft += dft
        mn += dmn
        mt += dmt
    return fn, ft, mn, mt


@kernel
def _section_flow(p, j, strip, start, count, ut0, ut1, up0, up1, pitch):
    """Speed, and place in the airfoil table, of every element of a chunk; places are in cells."""
    inverse_viscosity = p.air[P.INVERSE_VISCOSITY]
    n_alpha, n_re = p.grid_index[j, 1], p.grid_index[j, 2]
    alpha0, inverse_step = p.grid[j, 0], p.grid[j, 1]
    for i in range(count):
        s = p.element[j, P.SPAN, start + i]
        ut = ut0 + ut1 * s
        up = up0 + up1 * s
        speed = math.sqrt(ut * ut + up * up)
        alpha = pitch + p.element[j, P.TWIST, start + i] - arctangent2(up, ut)
        strip[SPEED_ROW + i] = speed
        strip[REYNOLDS_ROW + i] = speed * p.element[j, P.CHORD, start + i] * inverse_viscosity
        strip[ALPHA_ROW + i] = clamp((alpha - alpha0) * inverse_step, 1.0 * n_alpha)
        strip[RE_ROW + i] = 0.0
    for k in range(n_re - 1):
        knot, inverse_width = p.grid[j, 2 + k], 1.0 / (p.grid[j, 3 + k] - p.grid[j, 2 + k])
        for i in range(count):
            strip[RE_ROW + i] += clamp((strip[REYNOLDS_ROW + i] - knot) * inverse_width, 1.0)


@kernel
def _section_coefficients(p, j, strip, count):
    """Lift and drag coefficient of every element of a chunk."""
    first_row, n_alpha, n_re = p.grid_index[j, 0], p.grid_index[j, 1], p.grid_index[j, 2]
    for i in range(count):
        cl, cd = coefficients_at(p.cells, first_row, n_alpha, n_re, strip[RE_ROW + i], strip[ALPHA_ROW + i])
        strip[LIFT_ROW + i] = cl
        strip[DRAG_ROW + i] = cd


@kernel
def _section_forces(p, j, strip, start, count, ut0, ut1, up0, up1):
    """Sums of a chunk: forces and first moments about the flap hinge."""
    density = p.air[P.DENSITY]
    fn = ft = mn = mt = 0.0
    for i in range(count):
        s = p.element[j, P.SPAN, start + i]
        ut = ut0 + ut1 * s
        up = up0 + up1 * s
        cl = strip[LIFT_ROW + i] * p.element[j, P.LIFT_FRACTION, start + i]
        cd = strip[DRAG_ROW + i]
        scale = density * p.element[j, P.HALF_AREA, start + i] * strip[SPEED_ROW + i]
        dn = scale * (cl * ut - cd * up)
        dt = -scale * (cl * up + cd * ut)
        fn += dn
        ft += dt
        mn += s * dn
        mt += s * dt
    return fn, ft, mn, mt


@kernel
def blade_terms(
    p,
    j,
    row,
    strip,
    beta,
    beta_rate,
    xi,
    xi_rate,
    cosine,
    sine,
    pitch,
    inflow0,
    inflow1,
    flow,
    rates,
    base,
    hang,
):
    """Fill the work row of one blade of rotor j: hinge moments, couplings and loads without accelerations.

    Parameters
    ----------
    p : Params
    row : ndarray, shape (BLADE_SIZE,)
        Output, in body axes, six-vectors (force, moment) about the c.g.
    strip : ndarray
        `Work.strip`.
    beta, beta_rate, xi, xi_rate : float
        Flap and lag angles [rad] and rates [rad/s] of this blade.
    cosine, sine : float
        Of the blade's azimuth.
    pitch : float
        Section angle at the root [rad].
    inflow0, inflow1 : float
        Induced velocity at the hub centre [m/s] and its gradient along the blade [1/s], downwards positive.
    flow, rates : tuple of 3 floats
        Velocity of the hub relative to the air [m/s], body rates [rad/s]; hub axes.
    base : tuple of 3 floats
        Acceleration of the hub centre that is known before the solution [m/s^2], hub axes.
    hang : tuple of 3 floats
        The part of `base` that acts in the blade equations only, not in the loads on the hub [m/s^2].
    """
    rotor = p.rotor[j]
    omega, sense = rotor[P.SPEED], rotor[P.SENSE]
    e_l, e_f = rotor[P.LAG_HINGE], rotor[P.FLAP_HINGE]
    m_b, s1, a1, a1_hub = rotor[P.BLADE_MASS], rotor[P.S1], rotor[P.A1], rotor[P.A1_HUB]
    cx, sx = math.cos(xi), math.sin(xi)
    cb, sb = math.cos(beta), math.sin(beta)
    c = cosine * cx + sine * sx  # azimuth of y: lag moves the blade back
    s = sine * cx - cosine * sx

    # into the blade's basis: polar vectors as they are, axial ones with the factor G
    v1, v2, v3 = _to_blade(c, s, sense, flow)
    h1, h2, h3 = _to_blade(c, s, sense, base)
    q1, q2, q3 = _to_blade(c, s, sense, hang)
    r1, r2, r3 = _to_blade(c, s, sense, rates)
    o1, o2, o3 = sense * r1, sense * r2, sense * r3
    wh3 = o3 + omega
    wl3 = wh3 - xi_rate
    turn = omega - xi_rate

    # velocity of the section at s relative to the air: hinge plus s times (w_b x d); n = (-sb, 0, cb)
    vf1 = v1 - e_l * wh3 * sx
    vf2 = v2 + e_l * wh3 * cx + e_f * wl3
    vf3 = v3 + e_l * (o1 * sx - o2 * cx) - e_f * o2
    fn, ft, mn, mt = section_loads(
        p,
        j,
        strip,
        vf2,
        wl3 * cb - o1 * sb,
        cb * vf3 - sb * vf1 + cb * (inflow0 + rotor[P.HINGE] * inflow1),
        beta_rate - o2 + cb * inflow1,
        pitch,
    )

    # accelerations without those of hub, beta'', xi'': a(s) = f + s g (theory.md section 2)
    we = o1 * cx + o2 * sx
    wh_squared = o1 * o1 + o2 * o2 + wh3 * wh3
    f1 = e_l * (o1 * we - cx * wh_squared) - e_f * (o2 * o2 + wl3 * wl3)
    f2 = e_l * (o2 * we - sx * wh_squared) + e_f * o1 * o2
    f3 = e_l * (wh3 * we + omega * we) + e_f * (wl3 + turn) * o1
    alpha1 = turn * o2 + beta_rate * wl3
    alpha2 = -turn * o1
    alpha3 = -beta_rate * o1
    w1, w2 = o1, o2 - beta_rate
    wd = w1 * cb + wl3 * sb
    wb_squared = w1 * w1 + w2 * w2 + wl3 * wl3
    g1 = alpha2 * sb + w1 * wd - cb * wb_squared
    g2 = alpha3 * cb - alpha1 * sb + w2 * wd
    g3 = -alpha2 * cb + wl3 * wd - sb * wb_squared

    # hinge moments (theory.md section 3), the hub's known acceleration added to that of the hinge
    k1 = e_f * m_b + cb * s1
    k2 = e_f * s1 + cb * a1
    ff_n = cb * (f3 + h3) - sb * (f1 + h1)
    row[P.FLAP_MOMENT] = mn - rotor[P.FLAP_SPRING] * beta - s1 * ff_n - a1 * (cb * g3 - sb * g1)
    row[P.LAG_MOMENT] = (
        -(e_f * ft + cb * mt) + k1 * (f2 + h2) + k2 * g2 - rotor[P.LAG_SPRING] * xi - rotor[P.LAG_DAMPING] * xi_rate
    )
    row[P.A2] = e_f * (k1 + cb * s1) + cb * cb * a1
    row[P.NORMAL_MOMENT] = rotor[P.HINGE] * fn + mn

    # six-vectors about the hub in the blade's basis; p_F = (p1, p2, 0), d = (cb, 0, sb), f = (0, -1, 0)
    p1, p2 = e_l * cx + e_f, e_l * sx
    k2_hub = e_f * s1 + cb * a1_hub
    _store(
        p,
        j,
        row,
        P.FLAP_COUPLING,
        c,
        s,
        -s1 * sb,
        0.0,
        s1 * cb,
        s1 * p2 * cb,
        -s1 * p1 * cb - a1_hub,
        s1 * p2 * sb,
    )
    _store(p, j, row, P.LAG_COUPLING, c, s, 0.0, -k1, 0.0, k2_hub * sb, 0.0, -k1 * p1 - k2_hub * cb)

    # aerodynamic minus inertial load: with b = h - q the acceleration that the hub itself feels
    b1, b2, b3 = h1 - q1, h2 - q2, h3 - q3
    i1 = m_b * (f1 + b1) + s1 * g1
    i2 = m_b * (f2 + b2) + s1 * g2
    i3 = m_b * (f3 + b3) + s1 * g3
    j1 = s1 * (f1 + b1) + a1_hub * g1
    j2 = s1 * (f2 + b2) + a1_hub * g2
    j3 = s1 * (f3 + b3) + a1_hub * g3
    a_1, a_2, a_3 = -sb * fn, ft, cb * fn
    am1 = p2 * a_3 - sb * mt
    am2 = -p1 * a_3 - mn
    am3 = p1 * a_2 - p2 * a_1 + cb * mt
    _store(
        p,
        j,
        row,
        P.BASE_LOAD,
        c,
        s,
        a_1 - i1,
        a_2 - i2,
        a_3 - i3,
        am1 - (p2 * i3 - sb * j2),
        am2 - (-p1 * i3 + sb * j1 - cb * j3),
        am3 - (p1 * i2 - p2 * i1 + cb * j2),
    )
    if p.switches[P.COMPLETE_HUB_MOMENT] == 0:
        m1, m2, m3 = _to_body(p, j, c, s, sense * am1, sense * (am2 - rotor[P.FLAP_SPRING] * beta), 0.0)
        row[P.PAPER_MOMENT], row[P.PAPER_MOMENT + 1], row[P.PAPER_MOMENT + 2] = m1, m2, m3
        m1, m2, m3 = _to_body(p, j, c, s, 0.0, -sense, 0.0)
        row[P.FLAP_AXIS], row[P.FLAP_AXIS + 1], row[P.FLAP_AXIS + 2] = m1, m2, m3
    return a_3, c, s, p1, p2, cb, sb


@kernel
def _to_blade(c, s, sense, vector):
    """Components of a vector in hub axes along y, t, u; c and s are those of the azimuth of y."""
    x, y, z = vector
    return sense * s * y - c * x, s * x + sense * c * y, -z


@kernel
def _to_body(p, j, c, s, v1, v2, v3):
    """Components in body axes of a vector given along y, t, u of a blade of rotor j."""
    sense = p.rotor[j, P.SENSE]
    x = s * v2 - c * v1
    y = sense * (s * v1 + c * v2)
    a = p.axes[j]
    return (
        a[0, 0] * x + a[0, 1] * y - a[0, 2] * v3,
        a[1, 0] * x + a[1, 1] * y - a[1, 2] * v3,
        a[2, 0] * x + a[2, 1] * y - a[2, 2] * v3,
    )


@kernel
def _store(p, j, row, at, c, s, f1, f2, f3, m1, m2, m3):
    """Store force and moment about the hub, given in the blade's basis, as a six-vector about the c.g."""
    sense = p.rotor[j, P.SENSE]
    fx, fy, fz = _to_body(p, j, c, s, f1, f2, f3)
    mx, my, mz = _to_body(p, j, c, s, sense * m1, sense * m2, sense * m3)
    hx, hy, hz = p.rotor[j, P.HUB_X], p.rotor[j, P.HUB_Y], p.rotor[j, P.HUB_Z]
    row[at], row[at + 1], row[at + 2] = fx, fy, fz
    row[at + 3] = mx + hy * fz - hz * fy
    row[at + 4] = my + hz * fx - hx * fz
    row[at + 5] = mz + hx * fy - hy * fx


@kernel
def add_inertia(p, j, total, c, s, p1, p2, cb, sb):
    """Add mass, first and second moments about the c.g. of one deflected blade, body axes, to `total`.

    total: mass, first moment x y z, then Int x x, y y, z z, x y, y z, z x dm.
    """
    m_b, s1, a1 = p.rotor[j, P.BLADE_MASS], p.rotor[j, P.S1], p.rotor[j, P.A1_HUB]
    fx, fy, fz = _to_body(p, j, c, s, p1, p2, 0.0)
    fx += p.rotor[j, P.HUB_X]
    fy += p.rotor[j, P.HUB_Y]
    fz += p.rotor[j, P.HUB_Z]
    dx, dy, dz = _to_body(p, j, c, s, cb, 0.0, sb)
    total[0] += m_b
    total[1] += m_b * fx + s1 * dx
    total[2] += m_b * fy + s1 * dy
    total[3] += m_b * fz + s1 * dz
    total[4] += fx * (m_b * fx + 2.0 * s1 * dx) + a1 * dx * dx
    total[5] += fy * (m_b * fy + 2.0 * s1 * dy) + a1 * dy * dy
    total[6] += fz * (m_b * fz + 2.0 * s1 * dz) + a1 * dz * dz
    total[7] += m_b * fx * fy + s1 * (fx * dy + fy * dx) + a1 * dx * dy
    total[8] += m_b * fy * fz + s1 * (fy * dz + fz * dy) + a1 * dy * dz
    total[9] += m_b * fz * fx + s1 * (fz * dx + fx * dz) + a1 * dz * dx
