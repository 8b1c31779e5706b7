"""Blades: kinematics, and the terms of their flap and lag equations (theory.md sections 2 to 5).

A blade is worked out in its own basis (y, t, u): y along the line from lag to flap hinge, t along the motion, u up
along the shaft. For a counter-clockwise rotor this basis is right-handed; for a clockwise one it is left-handed,
and angular velocities and moments are then stored with the factor G = -1. In that convention every formula below
is the one of a counter-clockwise rotor, and mirrored aircraft are mirrored exactly.

The blades of a rotor go by in blocks, as lanes of vector instructions: every loop here runs over the lanes of one
block, whose values lie side by side in the rows of `Work.blade`.
"""

from sbs_sim.model import params as P
from sbs_sim.model.kernel import kernel
from sbs_sim.model.trigonometry import cosine_sine

LANES = P.LANES


@kernel
def blade_motion(p, j, row, induced, flow, rates):
    """Hinge angles as sines and cosines, and the velocity of the sections relative to the air, of a block of blades.

    Parameters
    ----------
    p : Params
    j : int
        Rotor.
    row : ndarray, shape (BLADE_SIZE,)
        One block of `Work.blade`; the rows COSINE to INFLOW_GRADIENT are read, COS_FLAP to UP1 written.
    induced : float
        Induced velocity at the hub centre, downwards positive [m/s].
    flow, rates : tuple of 3 floats
        Velocity of the hub relative to the air [m/s], body rates [rad/s]; hub axes.
    """
    rotor = p.rotor[j]
    omega, sense, hinge = rotor[P.SPEED], rotor[P.SENSE], rotor[P.HINGE]
    e_l, e_f = rotor[P.LAG_HINGE], rotor[P.FLAP_HINGE]
    for i in range(LANES):
        cx, sx = cosine_sine(row[P.LAG_ANGLE + i])
        cb, sb = cosine_sine(row[P.FLAP_ANGLE + i])
        cosine, sine = row[P.COSINE + i], row[P.SINE + i]
        c = cosine * cx + sine * sx  # azimuth of y: lag moves the blade back
        s = sine * cx - cosine * sx
        v1, v2, v3 = _to_blade(c, s, sense, flow)
        r1, r2, r3 = _to_blade(c, s, sense, rates)
        o1, o2, o3 = sense * r1, sense * r2, sense * r3
        wh3 = o3 + omega
        wl3 = wh3 - row[P.LAG_RATE + i]
        # velocity of the section at s relative to the air: hinge plus s times (w_b x d); n = (-sb, 0, cb)
        vf1 = v1 - e_l * wh3 * sx
        vf3 = v3 + e_l * (o1 * sx - o2 * cx) - e_f * o2
        gradient = row[P.INFLOW_GRADIENT + i]
        row[P.UT0 + i] = v2 + e_l * wh3 * cx + e_f * wl3
        row[P.UT1 + i] = wl3 * cb - o1 * sb
        row[P.UP0 + i] = cb * vf3 - sb * vf1 + cb * (induced + hinge * gradient)
        row[P.UP1 + i] = row[P.FLAP_RATE + i] - o2 + cb * gradient
        row[P.COS_LAG + i], row[P.SIN_LAG + i] = cx, sx
        row[P.COS_FLAP + i], row[P.SIN_FLAP + i] = cb, sb
        row[P.COS_SPAN + i], row[P.SIN_SPAN + i] = c, s


@kernel
def blade_terms(p, j, row, rates, base, hang):
    """Hinge moments, couplings and loads without accelerations, of a block of blades.

    Parameters
    ----------
    p, j : see `blade_motion`
    row : ndarray, shape (BLADE_SIZE,)
        One block of `Work.blade`: the rows FLAP_MOMENT to INVERSE_A2, FLAP_COUPLING, LAG_COUPLING and BASE_LOAD are
        written. Lanes without a blade get no mass, and so take no part in sums.
    rates : tuple of 3 floats
        Body rates [rad/s], hub axes.
    base : tuple of 3 floats
        Acceleration of the hub centre that is known before the solution [m/s^2], hub axes.
    hang : tuple of 3 floats
        The part of `base` that acts in the blade equations only, not in the loads on the hub [m/s^2].
    """
    rotor = p.rotor[j]
    omega, sense = rotor[P.SPEED], rotor[P.SENSE]
    e_l, e_f = rotor[P.LAG_HINGE], rotor[P.FLAP_HINGE]
    mass, first, second, a1 = rotor[P.BLADE_MASS], rotor[P.S1], rotor[P.A1_HUB], rotor[P.A1]
    flap_spring, lag_spring, lag_damping = rotor[P.FLAP_SPRING], rotor[P.LAG_SPRING], rotor[P.LAG_DAMPING]
    hub = (rotor[P.HUB_X], rotor[P.HUB_Y], rotor[P.HUB_Z])
    axes = load_axes(p, j)
    for i in range(LANES):
        is_blade = row[P.IS_BLADE + i]
        m_b, s1, a1_hub = mass * is_blade, first * is_blade, second * is_blade
        cx, sx = row[P.COS_LAG + i], row[P.SIN_LAG + i]
        cb, sb = row[P.COS_FLAP + i], row[P.SIN_FLAP + i]
        c, s = row[P.COS_SPAN + i], row[P.SIN_SPAN + i]
        fn, ft, mn, mt = row[P.FORCE_N + i], row[P.FORCE_T + i], row[P.MOMENT_N + i], row[P.MOMENT_T + i]
        beta_rate, xi_rate = row[P.FLAP_RATE + i], row[P.LAG_RATE + i]

        # into the blade's basis: polar vectors as they are, axial ones with the factor G
        h1, h2, h3 = _to_blade(c, s, sense, base)
        q1, q2, q3 = _to_blade(c, s, sense, hang)
        r1, r2, r3 = _to_blade(c, s, sense, rates)
        o1, o2, o3 = sense * r1, sense * r2, sense * r3
        wh3 = o3 + omega
        wl3 = wh3 - xi_rate
        turn = omega - xi_rate

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
        row[P.FLAP_MOMENT + i] = mn - flap_spring * row[P.FLAP_ANGLE + i] - s1 * ff_n - a1 * (cb * g3 - sb * g1)
        row[P.LAG_MOMENT + i] = (
            k1 * (f2 + h2) + k2 * g2 - (e_f * ft + cb * mt) - lag_spring * row[P.LAG_ANGLE + i] - lag_damping * xi_rate
        )
        row[P.INVERSE_A2 + i] = 1.0 / (e_f * (k1 + cb * s1) + cb * cb * a1)

        # six-vectors about the hub in the blade's basis; p_F = (p1, p2, 0), d = (cb, 0, sb), f = (0, -1, 0)
        p1, p2 = e_l * cx + e_f, e_l * sx
        k2_hub = e_f * s1 + cb * a1_hub
        force, moment = (-s1 * sb, 0.0, s1 * cb), (s1 * p2 * cb, -s1 * p1 * cb - a1_hub, s1 * p2 * sb)
        _store(row, P.FLAP_COUPLING + i, axes, hub, sense, c, s, force, moment)
        force, moment = (0.0, -k1, 0.0), (k2_hub * sb, 0.0, -k1 * p1 - k2_hub * cb)
        _store(row, P.LAG_COUPLING + i, axes, hub, sense, c, s, force, moment)

        # aerodynamic minus inertial load: with b = h - q the acceleration that the hub itself feels
        b1, b2, b3 = f1 + h1 - q1, f2 + h2 - q2, f3 + h3 - q3
        i1, i2, i3 = m_b * b1 + s1 * g1, m_b * b2 + s1 * g2, m_b * b3 + s1 * g3
        j1, j2, j3 = s1 * b1 + a1_hub * g1, s1 * b2 + a1_hub * g2, s1 * b3 + a1_hub * g3
        x1, x2, x3 = -sb * fn - i1, ft - i2, cb * fn - i3
        moment = (
            p2 * x3 - sb * (mt - j2),
            -p1 * x3 - mn - sb * j1 + cb * j3,
            p1 * x2 - p2 * x1 + cb * (mt - j2),
        )
        _store(row, P.BASE_LOAD + i, axes, hub, sense, c, s, (x1, x2, x3), moment)


@kernel
def paper_moments(p, j, row):
    """Moments on the hub in the paper's reading, without their inertial part (theory.md section 9)."""
    rotor = p.rotor[j]
    sense, flap_spring, e_l, e_f = rotor[P.SENSE], rotor[P.FLAP_SPRING], rotor[P.LAG_HINGE], rotor[P.FLAP_HINGE]
    axes = load_axes(p, j)
    for i in range(LANES):
        c, s = row[P.COS_SPAN + i], row[P.SIN_SPAN + i]
        lift = row[P.COS_FLAP + i] * row[P.FORCE_N + i]
        p1, p2 = e_l * row[P.COS_LAG + i] + e_f, e_l * row[P.SIN_LAG + i]
        m1 = p2 * lift - row[P.SIN_FLAP + i] * row[P.MOMENT_T + i]
        m2 = -p1 * lift - row[P.MOMENT_N + i] - flap_spring * row[P.FLAP_ANGLE + i]
        x, y, z = _to_body(axes, sense, c, s, (sense * m1, sense * m2, 0.0))
        at = P.PAPER_MOMENT + i
        row[at], row[at + LANES], row[at + 2 * LANES] = x, y, z
        x, y, z = _to_body(axes, sense, c, s, (0.0, -sense, 0.0))
        at = P.FLAP_AXIS + i
        row[at], row[at + LANES], row[at + 2 * LANES] = x, y, z


@kernel
def air_moments(p, j, row):
    """Thrust [N] and the sine and cosine moments [N m] that drive the inflow, of a block of blades."""
    hinge = p.rotor[j, P.HINGE]
    thrust = sine_moment = cosine_moment = 0.0
    for i in range(LANES):
        moment = hinge * row[P.FORCE_N + i] + row[P.MOMENT_N + i]
        thrust += row[P.COS_FLAP + i] * row[P.FORCE_N + i]
        sine_moment += moment * row[P.SINE + i]
        cosine_moment += moment * row[P.COSINE + i]
    return thrust, sine_moment, cosine_moment


@kernel
def block_inertia(p, j, row):
    """Mass, first moment x y z, and Int x x, y y, z z, x y, y z, z x dm, about the c.g., of a block of blades."""
    rotor = p.rotor[j]
    mass, first, second = rotor[P.BLADE_MASS], rotor[P.S1], rotor[P.A1_HUB]
    hub_x, hub_y, hub_z = rotor[P.HUB_X], rotor[P.HUB_Y], rotor[P.HUB_Z]
    sense, e_l, e_f = rotor[P.SENSE], rotor[P.LAG_HINGE], rotor[P.FLAP_HINGE]
    axes = load_axes(p, j)
    m = x = y = z = xx = yy = zz = xy = yz = zx = 0.0
    for i in range(LANES):
        is_blade = row[P.IS_BLADE + i]
        m_b, s1, a1 = mass * is_blade, first * is_blade, second * is_blade
        c, s, cb, sb = row[P.COS_SPAN + i], row[P.SIN_SPAN + i], row[P.COS_FLAP + i], row[P.SIN_FLAP + i]
        hinge = (e_l * row[P.COS_LAG + i] + e_f, e_l * row[P.SIN_LAG + i], 0.0)
        fx, fy, fz = _to_body(axes, sense, c, s, hinge)
        dx, dy, dz = _to_body(axes, sense, c, s, (cb, 0.0, sb))
        fx, fy, fz = fx + hub_x, fy + hub_y, fz + hub_z
        m += m_b
        x += m_b * fx + s1 * dx
        y += m_b * fy + s1 * dy
        z += m_b * fz + s1 * dz
        xx += fx * (m_b * fx + 2.0 * s1 * dx) + a1 * dx * dx
        yy += fy * (m_b * fy + 2.0 * s1 * dy) + a1 * dy * dy
        zz += fz * (m_b * fz + 2.0 * s1 * dz) + a1 * dz * dz
        xy += m_b * fx * fy + s1 * (fx * dy + fy * dx) + a1 * dx * dy
        yz += m_b * fy * fz + s1 * (fy * dz + fz * dy) + a1 * dy * dz
        zx += m_b * fz * fx + s1 * (fz * dx + fx * dz) + a1 * dz * dx
    return m, x, y, z, xx, yy, zz, xy, yz, zx


@kernel
def load_axes(p, j):
    """Hub axes of rotor j as nine numbers, row by row: loads that the compiler need not repeat."""
    a = p.axes[j]
    return a[0, 0], a[0, 1], a[0, 2], a[1, 0], a[1, 1], a[1, 2], a[2, 0], a[2, 1], a[2, 2]


@kernel
def _to_blade(c, s, sense, vector):
    """Components of a vector in hub axes along y, t, u; c and s are those of the azimuth of y."""
    x, y, z = vector
    return sense * s * y - c * x, s * x + sense * c * y, -z


@kernel
def _to_body(axes, sense, c, s, vector):
    """Components in body axes of a vector given along y, t, u of a blade."""
    a00, a01, a02, a10, a11, a12, a20, a21, a22 = axes
    v1, v2, v3 = vector
    x = s * v2 - c * v1
    y = sense * (s * v1 + c * v2)
    return a00 * x + a01 * y - a02 * v3, a10 * x + a11 * y - a12 * v3, a20 * x + a21 * y - a22 * v3


@kernel
def _store(row, at, axes, hub, sense, c, s, force, moment):
    """Store force and moment about the hub, given in the blade's basis, as a six-vector about the c.g."""
    m1, m2, m3 = moment
    fx, fy, fz = _to_body(axes, sense, c, s, force)
    mx, my, mz = _to_body(axes, sense, c, s, (sense * m1, sense * m2, sense * m3))
    hx, hy, hz = hub
    row[at], row[at + LANES], row[at + 2 * LANES] = fx, fy, fz
    row[at + 3 * LANES] = mx + hy * fz - hz * fy
    row[at + 4 * LANES] = my + hz * fx - hx * fz
    row[at + 5 * LANES] = mz + hx * fy - hy * fx
