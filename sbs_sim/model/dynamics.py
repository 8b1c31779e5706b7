"""The derivative of the complete state (theory.md sections 2 to 7).

Body and blades are one multibody system (`complete` coupling). Its mass matrix has the shape of an arrow: every
blade's two hinge equations hold that blade's beta'', xi'' and the six accelerations of the body, nothing else. The
blades are eliminated exactly, a 6x6 system for the body remains, and the blades follow. In the `paper` coupling
the blades do not feel the hub's acceleration, and the same sums give the loads directly.

The unknowns of the body are the specific force of the c.g. (acceleration minus gravity, so that gravity appears in
one place only and free fall is exact) and the angular acceleration.
"""

from sbs_sim.model import params as P
from sbs_sim.model import state as S
from sbs_sim.model.blade import air_moments, blade_motion, blade_terms, block_inertia, paper_moments
from sbs_sim.model.duct import duct_thrust
from sbs_sim.model.frames import cross, quaternion_rates, rotation_rows
from sbs_sim.model.fuselage import plate_drag
from sbs_sim.model.inflow import inflow_rates
from sbs_sim.model.kernel import entry, kernel
from sbs_sim.model.multiblade import add_block_accelerations, add_rotation_terms, blade_angle
from sbs_sim.model.section import section_loads
from sbs_sim.model.trigonometry import cosine_sine

LANES = P.LANES


@entry
def derivative(p, x, swash, psi, wind, work, dx):
    """Time derivative of the simulation state; the loads of the rotors are left in `work.loads`.

    Parameters
    ----------
    p : Params
    x : ndarray, shape (size,)
        Simulation state, see `sbs_sim.model.state`.
    swash : ndarray, shape (n_rotors, 3)
        Collective, lateral and longitudinal cyclic pitch of each rotor [rad].
    psi : ndarray, shape (n_rotors,)
        Azimuth of the first blade of each rotor, 0 aft, growing with the rotation [rad].
    wind : ndarray, shape (3,)
        Velocity of the air over ground, NED [m/s].
    work : Work
        `work.vector` holds the specific force of the c.g. [m/s^2] and om' [rad/s^2] afterwards.
    dx : ndarray, shape (size,)
        Output.
    """
    evaluate(p, x, swash, psi, wind, work, dx)


@kernel
def evaluate(p, x, swash, psi, wind, work, dx):
    """What `derivative` does, for compiled callers.

    They must not call the entry: its machine code would be in theirs as well, and of equal names the loader takes the
    first that it meets, which may be optimised otherwise. The last bits would then hang on what was loaded first.
    """
    evaluate_rotors(p, x, swash, psi, wind, work, dx, 0, p.rotor.shape[0], True)


@kernel
def evaluate_rotors(p, x, swash, psi, wind, work, dx, first, last, with_loads):
    """What `derivative` does where since the last call only states of the rotors first to last - 1 have changed.

    The blades of the other rotors do not feel that before the body's accelerations are known. `work.loads` is set only
    if it is asked for; the `complete` coupling does not need it.
    """
    rot, om, g = _known_terms(p, x, swash, psi, wind, work, first, last)
    if p.switches[P.COMPLETE_COUPLING] == 1:
        _solve_with_blades(p, work)
        _solve_blades(p, work)
        if with_loads:
            _hub_loads(p, work)
    else:
        _solve_blades_alone(p, work)
        _hub_loads(p, work)
        _solve_body_alone(p, work)
    _body_rates(x, rot, om, g, work.vector, dx)
    _rotor_rates(p, x, work, dx)


@entry
def steady_balance(p, x, swash, psi, wind, work, dx, imbalance):
    """What the model gives while the body does not accelerate: for the two loops of trim (theory.md section 8).

    The blades are taken twice. As they move on a hub in steady motion (U' = om' = 0), they give the rates of the
    rotors. Held on constant multiblade coordinates, with the steady accelerations
    beta'' = Omega^2 (a1 cos psi + b1 sin psi), they give the loads on the body. Both averages over the azimuth vanish
    at a trim, but for products of the vibrations of body and blades.

    Parameters
    ----------
    p, x, swash, psi, wind : see `derivative`
    work : Work
        `work.loads` holds the loads of the blades on constant coordinates afterwards, `work.vector` the specific
        force of the c.g. in steady motion, om x U - g [m/s^2], and three zeros.
    dx : ndarray, shape (size,)
        Output: rates of the rotor states, and of position and attitude; U' and om' are zero.
    imbalance : ndarray, shape (6,)
        Output: force [N] and moment about the c.g. [N m], body axes, that are left to accelerate the aircraft.
    """
    rot, om, g = _known_terms(p, x, swash, psi, wind, work, 0, p.rotor.shape[0])
    body = work.vector
    for m in range(6):
        imbalance[m] = body[m]
    turn = cross(om[0], om[1], om[2], x[7], x[8], x[9])
    body[0], body[1], body[2] = turn[0] - g[0], turn[1] - g[1], turn[2] - g[2]
    body[3] = body[4] = body[5] = 0.0
    if p.switches[P.COMPLETE_COUPLING] == 1:
        _solve_blades(p, work)
    else:
        _solve_blades_alone(p, work)
    _body_rates(x, rot, om, g, body, dx)
    _rotor_rates(p, x, work, dx)
    _hold_coordinates(p, x, work)
    _hub_loads(p, work)
    _add_hub_loads(p, work, imbalance)
    _subtract_carried_body(p.body, body, imbalance)


@kernel
def _known_terms(p, x, swash, psi, wind, work, first, last):
    """Work rows of the blades of rotors first to last - 1 and the known part of the body's system.

    Returns rotation, body rates and gravity.
    """
    rot = rotation_rows(x[3], x[4], x[5], x[6])
    om = (x[10], x[11], x[12])
    gravity = p.air[P.GRAVITY]
    g = (gravity * rot[6], gravity * rot[7], gravity * rot[8])
    air = (
        x[7] - (rot[0] * wind[0] + rot[3] * wind[1] + rot[6] * wind[2]),
        x[8] - (rot[1] * wind[0] + rot[4] * wind[1] + rot[7] * wind[2]),
        x[9] - (rot[2] * wind[0] + rot[5] * wind[1] + rot[8] * wind[2]),
    )
    for j in range(first, last):
        _rotor_terms(p, j, x, swash, psi[j], air, om, g, work)
    _start_body_system(p, air, om, work)
    return rot, om, g


@kernel
def _rotor_terms(p, j, x, swash, psi, air, om, g, work):
    """Work rows of the blades of rotor j, and the sums over them that the inflow and the inertia need."""
    rotor = p.rotor[j]
    a = p.axes[j]
    spin = cross(om[0], om[1], om[2], rotor[P.HUB_X], rotor[P.HUB_Y], rotor[P.HUB_Z])
    flow = _to_hub(a, air[0] + spin[0], air[1] + spin[1], air[2] + spin[2])
    rates = _to_hub(a, om[0], om[1], om[2])
    if p.switches[P.COMPLETE_COUPLING] == 1:
        centripetal = cross(om[0], om[1], om[2], spin[0], spin[1], spin[2])
        base = _to_hub(a, centripetal[0], centripetal[1], centripetal[2])
        hang = (0.0, 0.0, 0.0)
    else:
        base = _to_hub(a, -g[0], -g[1], -g[2])
        hang = base
    work.hub_flow[j, 0], work.hub_flow[j, 1], work.hub_flow[j, 2] = flow
    _set_blades(p, j, x, swash[j], psi, work)
    induced = rotor[P.SPEED] * rotor[P.RADIUS] * x[S.BODY_SIZE + 4 * p.first_blade[-1] + 3 * j]
    blades = p.first_blade[j + 1] - p.first_blade[j]
    aero, inertia = work.aero[j], work.rotor_inertia[j]
    aero[:] = 0.0
    inertia[:] = 0.0
    for i in range(p.first_block[j], p.first_block[j + 1]):
        row = work.blade[i]
        blade_motion(p, j, row, induced, flow, rates)
        section_loads(p, j, row, min(LANES, blades), work.strip, work.cell)
        blade_terms(p, j, row, rates, base, hang)
        _add(air_moments(p, j, row), aero)
        _add(block_inertia(p, j, row), inertia)
        if p.switches[P.COMPLETE_HUB_MOMENT] == 0:
            paper_moments(p, j, row)
        blades -= LANES


@kernel
def _add(values, total):
    """Add a tuple to an array."""
    for i in range(len(values)):
        total[i] += values[i]


@kernel
def _set_blades(p, j, x, swash, psi, work):
    """Azimuth, flap, lag, pitch and inflow gradient of the blades of rotor j in their work rows."""
    rotor = p.rotor[j]
    all_blades, first = p.first_blade[-1], p.first_blade[j]
    n_blades = p.first_blade[j + 1] - first
    flap, flap_rate = S.BODY_SIZE + first, S.BODY_SIZE + all_blades + first
    lag, lag_rate = S.BODY_SIZE + 2 * all_blades + first, S.BODY_SIZE + 3 * all_blades + first
    inflow = S.BODY_SIZE + 4 * all_blades + 3 * j
    omega = rotor[P.SPEED]
    scale = omega * p.switches[P.CYCLIC_INFLOW]
    lambdas, lambdac = scale * x[inflow + 1], scale * x[inflow + 2]
    cosine, sine = cosine_sine(psi)
    for k in range(n_blades):
        row, i = work.blade[p.first_block[j] + k // LANES], k % LANES
        beta, beta_rate = blade_angle(x, flap, flap_rate, n_blades, k, cosine, sine, omega)
        xi = xi_rate = 0.0
        if p.switches[P.LEAD_LAG] == 1:
            xi, xi_rate = blade_angle(x, lag, lag_rate, n_blades, k, cosine, sine, omega)
        pitch = _pitch(rotor, swash, cosine, sine) - rotor[P.PITCH_FLAP] * beta - rotor[P.PITCH_LAG] * xi
        row[P.COSINE + i], row[P.SINE + i] = cosine, sine
        row[P.FLAP_ANGLE + i], row[P.FLAP_RATE + i] = beta, beta_rate
        row[P.LAG_ANGLE + i], row[P.LAG_RATE + i] = xi, xi_rate
        row[P.PITCH + i], row[P.INFLOW_GRADIENT + i] = pitch, lambdac * cosine + lambdas * sine
        cosine, sine = (
            cosine * rotor[P.COS_SPACING] - sine * rotor[P.SIN_SPACING],
            sine * rotor[P.COS_SPACING] + cosine * rotor[P.SIN_SPACING],
        )


@kernel
def _to_hub(a, x, y, z):
    """Components in hub axes of a vector in body axes."""
    return (
        a[0, 0] * x + a[1, 0] * y + a[2, 0] * z,
        a[0, 1] * x + a[1, 1] * y + a[2, 1] * z,
        a[0, 2] * x + a[1, 2] * y + a[2, 2] * z,
    )


@kernel
def _pitch(rotor, swash, cosine, sine):
    """Pitch of a blade at the hinge [rad]: theta0 - A1s G cos(psi + phase) - B1s sin(psi + phase)."""
    c = cosine * rotor[P.COS_PHASE] - sine * rotor[P.SIN_PHASE]
    s = sine * rotor[P.COS_PHASE] + cosine * rotor[P.SIN_PHASE]
    return swash[0] - rotor[P.SENSE] * swash[1] * c - swash[2] * s


@kernel
def _start_body_system(p, air, om, work):
    """Right-hand side of the rigid part and the ducts: external loads minus what the rotation takes."""
    b = work.vector
    body = p.body
    fx, fy, fz = plate_drag(
        p.air[P.DENSITY], p.air[P.PLATE_X], p.air[P.PLATE_Y], p.air[P.PLATE_Z], air[0], air[1], air[2]
    )
    sx, sy, sz = body[P.FIRST_MOMENT], body[P.FIRST_MOMENT + 1], body[P.FIRST_MOMENT + 2]
    t = cross(om[0], om[1], om[2], sx, sy, sz)
    t = cross(om[0], om[1], om[2], t[0], t[1], t[2])
    i = P.INERTIA
    hx = body[i] * om[0] + body[i + 1] * om[1] + body[i + 2] * om[2]
    hy = body[i + 3] * om[0] + body[i + 4] * om[1] + body[i + 5] * om[2]
    hz = body[i + 6] * om[0] + body[i + 7] * om[1] + body[i + 8] * om[2]
    gyro = cross(om[0], om[1], om[2], hx, hy, hz)
    b[0], b[1], b[2] = fx - t[0], fy - t[1], fz - t[2]
    b[3], b[4], b[5] = -gyro[0], -gyro[1], -gyro[2]
    for j in range(p.rotor.shape[0]):
        a = p.axes[j]
        thrust = duct_thrust(p.rotor[j, P.DUCT], work.aero[j, 0])
        fx, fy, fz = -a[0, 2] * thrust, -a[1, 2] * thrust, -a[2, 2] * thrust
        hx, hy, hz = p.rotor[j, P.HUB_X], p.rotor[j, P.HUB_Y], p.rotor[j, P.HUB_Z]
        m = cross(hx, hy, hz, fx, fy, fz)
        b[0] += fx
        b[1] += fy
        b[2] += fz
        b[3] += m[0]
        b[4] += m[1]
        b[5] += m[2]


@kernel
def _solve_with_blades(p, work):
    """Specific force and angular acceleration of the body with all blades eliminated (`complete`)."""
    k, b = work.matrix, work.vector
    _rigid_matrix(p, work)
    for j in range(p.rotor.shape[0]):
        inverse_a1 = 1.0 / p.rotor[j, P.A1]
        for block in range(p.first_block[j], p.first_block[j + 1]):
            _eliminate(k, b, work.blade[block], inverse_a1, 1.0 * p.switches[P.LEAD_LAG])
    _solve_symmetric(k, b)


@kernel
def _eliminate(k, b, row, inverse_a1, lead_lag):
    """Take the hinge coordinates of a block of blades out of the body's system; only the lower triangle is kept."""
    b0 = b1 = b2 = b3 = b4 = b5 = 0.0
    k00 = k10 = k11 = k20 = k21 = k22 = k30 = k31 = k32 = k33 = 0.0
    k40 = k41 = k42 = k43 = k44 = k50 = k51 = k52 = k53 = k54 = k55 = 0.0
    for i in range(LANES):
        f0, f1, f2, f3, f4, f5 = _six(row, P.FLAP_COUPLING + i)
        g0, g1, g2, g3, g4, g5 = _six(row, P.LAG_COUPLING + i)
        h0, h1, h2, h3, h4, h5 = _six(row, P.BASE_LOAD + i)
        inverse_a2 = lead_lag * row[P.INVERSE_A2 + i]
        flap, lag = inverse_a1 * row[P.FLAP_MOMENT + i], inverse_a2 * row[P.LAG_MOMENT + i]
        b0 += h0 - f0 * flap - g0 * lag
        b1 += h1 - f1 * flap - g1 * lag
        b2 += h2 - f2 * flap - g2 * lag
        b3 += h3 - f3 * flap - g3 * lag
        b4 += h4 - f4 * flap - g4 * lag
        b5 += h5 - f5 * flap - g5 * lag
        d0, d1, d2, d3, d4, d5 = (
            f0 * inverse_a1,
            f1 * inverse_a1,
            f2 * inverse_a1,
            f3 * inverse_a1,
            f4 * inverse_a1,
            f5 * inverse_a1,
        )
        e0, e1, e2, e3, e4, e5 = (
            g0 * inverse_a2,
            g1 * inverse_a2,
            g2 * inverse_a2,
            g3 * inverse_a2,
            g4 * inverse_a2,
            g5 * inverse_a2,
        )
        k00 += d0 * f0 + e0 * g0
        k10 += d1 * f0 + e1 * g0
        k11 += d1 * f1 + e1 * g1
        k20 += d2 * f0 + e2 * g0
        k21 += d2 * f1 + e2 * g1
        k22 += d2 * f2 + e2 * g2
        k30 += d3 * f0 + e3 * g0
        k31 += d3 * f1 + e3 * g1
        k32 += d3 * f2 + e3 * g2
        k33 += d3 * f3 + e3 * g3
        k40 += d4 * f0 + e4 * g0
        k41 += d4 * f1 + e4 * g1
        k42 += d4 * f2 + e4 * g2
        k43 += d4 * f3 + e4 * g3
        k44 += d4 * f4 + e4 * g4
        k50 += d5 * f0 + e5 * g0
        k51 += d5 * f1 + e5 * g1
        k52 += d5 * f2 + e5 * g2
        k53 += d5 * f3 + e5 * g3
        k54 += d5 * f4 + e5 * g4
        k55 += d5 * f5 + e5 * g5
    b[0] += b0
    b[1] += b1
    b[2] += b2
    b[3] += b3
    b[4] += b4
    b[5] += b5
    k[0, 0] = k[0, 0] - k00
    k[1, 0], k[1, 1] = k[1, 0] - k10, k[1, 1] - k11
    k[2, 0], k[2, 1], k[2, 2] = k[2, 0] - k20, k[2, 1] - k21, k[2, 2] - k22
    k[3, 0], k[3, 1], k[3, 2], k[3, 3] = k[3, 0] - k30, k[3, 1] - k31, k[3, 2] - k32, k[3, 3] - k33
    k[4, 0], k[4, 1], k[4, 2], k[4, 3], k[4, 4] = (
        k[4, 0] - k40,
        k[4, 1] - k41,
        k[4, 2] - k42,
        k[4, 3] - k43,
        k[4, 4] - k44,
    )
    k[5, 0], k[5, 1], k[5, 2], k[5, 3], k[5, 4], k[5, 5] = (
        k[5, 0] - k50,
        k[5, 1] - k51,
        k[5, 2] - k52,
        k[5, 3] - k53,
        k[5, 4] - k54,
        k[5, 5] - k55,
    )


@kernel
def _six(row, at):
    """A six-vector of one lane."""
    return (
        row[at],
        row[at + LANES],
        row[at + 2 * LANES],
        row[at + 3 * LANES],
        row[at + 4 * LANES],
        row[at + 5 * LANES],
    )


@kernel
def _rigid_matrix(p, work):
    """Mass matrix of the rigid part and all blades as if locked, about the c.g.; lower triangle."""
    k = work.matrix
    k[:, :] = 0.0
    body = p.body
    mass = body[P.MASS]
    sx, sy, sz = body[P.FIRST_MOMENT], body[P.FIRST_MOMENT + 1], body[P.FIRST_MOMENT + 2]
    xx = yy = zz = xy = yz = zx = 0.0
    for j in range(p.rotor.shape[0]):
        t = work.rotor_inertia[j]
        mass += t[0]
        sx += t[1]
        sy += t[2]
        sz += t[3]
        xx += t[4]
        yy += t[5]
        zz += t[6]
        xy += t[7]
        yz += t[8]
        zx += t[9]
    k[0, 0] = k[1, 1] = k[2, 2] = mass
    k[3, 1], k[3, 2] = -sz, sy
    k[4, 0], k[4, 2] = sz, -sx
    k[5, 0], k[5, 1] = -sy, sx
    i = P.INERTIA
    k[3, 3] = body[i] + yy + zz
    k[4, 3] = body[i + 3] - xy
    k[4, 4] = body[i + 4] + zz + xx
    k[5, 3] = body[i + 6] - zx
    k[5, 4] = body[i + 7] - yz
    k[5, 5] = body[i + 8] + xx + yy


@kernel
def _solve_symmetric(k, b):
    """Solve k x = b in place for a symmetric positive definite k by L D L^T; only its lower triangle is used."""
    for n in range(6):
        k[n, n] = 1.0 / k[n, n]
        for m in range(n + 1, 6):
            factor = k[m, n] * k[n, n]
            b[m] -= factor * b[n]
            for i in range(n + 1, m + 1):
                k[m, i] -= factor * k[i, n]
    for m in range(5, -1, -1):
        for i in range(m + 1, 6):
            b[m] -= k[i, m] * b[i]
        b[m] *= k[m, m]


@kernel
def _solve_blades(p, work):
    """Flap and lag accelerations of every blade under the body's motion (`complete`)."""
    b = work.vector
    b0, b1, b2, b3, b4, b5 = b[0], b[1], b[2], b[3], b[4], b[5]
    for j in range(p.rotor.shape[0]):
        inverse_a1, lead_lag = 1.0 / p.rotor[j, P.A1], 1.0 * p.switches[P.LEAD_LAG]
        for block in range(p.first_block[j], p.first_block[j + 1]):
            row = work.blade[block]
            for i in range(LANES):
                f, g = P.FLAP_COUPLING + i, P.LAG_COUPLING + i
                flap = row[P.FLAP_MOMENT + i] - row[f] * b0 - row[f + LANES] * b1 - row[f + 2 * LANES] * b2
                flap -= row[f + 3 * LANES] * b3 + row[f + 4 * LANES] * b4 + row[f + 5 * LANES] * b5
                lag = row[P.LAG_MOMENT + i] - row[g] * b0 - row[g + LANES] * b1 - row[g + 2 * LANES] * b2
                lag -= row[g + 3 * LANES] * b3 + row[g + 4 * LANES] * b4 + row[g + 5 * LANES] * b5
                row[P.FLAP_ACCELERATION + i] = flap * inverse_a1
                row[P.LAG_ACCELERATION + i] = lag * row[P.INVERSE_A2 + i] * lead_lag


@kernel
def _solve_blades_alone(p, work):
    """Flap and lag accelerations of every blade on a hub that does not accelerate (`paper`)."""
    for j in range(p.rotor.shape[0]):
        inverse_a1, lead_lag = 1.0 / p.rotor[j, P.A1], 1.0 * p.switches[P.LEAD_LAG]
        for block in range(p.first_block[j], p.first_block[j + 1]):
            row = work.blade[block]
            for i in range(LANES):
                row[P.FLAP_ACCELERATION + i] = row[P.FLAP_MOMENT + i] * inverse_a1
                row[P.LAG_ACCELERATION + i] = row[P.LAG_MOMENT + i] * row[P.INVERSE_A2 + i] * lead_lag


@kernel
def _hold_coordinates(p, x, work):
    """Accelerations of the blades in the rotating frame on multiblade coordinates that do not change."""
    all_blades = p.first_blade[-1]
    for j in range(p.rotor.shape[0]):
        first = p.first_blade[j]
        n_blades = p.first_blade[j + 1] - first
        flap, lag, omega = S.BODY_SIZE + first, S.BODY_SIZE + 2 * all_blades + first, p.rotor[j, P.SPEED]
        for k in range(n_blades):
            row, i = work.blade[p.first_block[j] + k // LANES], k % LANES
            c, s = row[P.COSINE + i], row[P.SINE + i]
            held = _steady_acceleration(x, lag, n_blades, c, s, omega) * p.switches[P.LEAD_LAG]
            row[P.FLAP_ACCELERATION + i] = _steady_acceleration(x, flap, n_blades, c, s, omega)
            row[P.LAG_ACCELERATION + i] = held


@kernel
def _steady_acceleration(x, angles, n_blades, cosine, sine, speed):
    """Acceleration of a blade on constant coordinates: sum of (n Omega)^2 (a_n cos n psi + b_n sin n psi)."""
    acceleration = 0.0
    cn, sn = cosine, sine
    for n in range(1, (n_blades - 1) // 2 + 1):
        i = angles + 2 * n - 1
        harmonic = n * speed
        acceleration += harmonic * harmonic * (x[i] * cn + x[i + 1] * sn)
        cn, sn = cn * cosine - sn * sine, sn * cosine + cn * sine
    return acceleration


@kernel
def _hub_loads(p, work):
    """Force and moment of each rotor on its hub, thrust and shaft torque, into `work.loads`."""
    complete = p.switches[P.COMPLETE_COUPLING] == 1
    b = work.vector
    for j in range(p.rotor.shape[0]):
        out = work.loads[j]
        out[:] = 0.0
        for block in range(p.first_block[j], p.first_block[j + 1]):
            _add_blade_loads(work.blade[block], out)
        if complete:
            _subtract_carried_blades(work.rotor_inertia[j], b, out)
        hx, hy, hz = p.rotor[j, P.HUB_X], p.rotor[j, P.HUB_Y], p.rotor[j, P.HUB_Z]
        arm = cross(hx, hy, hz, out[P.FORCE], out[P.FORCE + 1], out[P.FORCE + 2])
        for m in range(3):
            out[P.MOMENT + m] -= arm[m]
        if p.switches[P.COMPLETE_HUB_MOMENT] == 0:
            _paper_hub_moment(p, j, work)
        a = p.axes[j]
        axial = a[0, 2] * out[P.MOMENT] + a[1, 2] * out[P.MOMENT + 1] + a[2, 2] * out[P.MOMENT + 2]
        out[P.THRUST] = work.aero[j, 0]
        out[P.TORQUE] = p.rotor[j, P.SENSE] * axial


@kernel
def _add_blade_loads(row, out):
    """Add the loads of a block of blades on their hub, about the c.g."""
    for m in range(6):
        load = 0.0
        for i in range(LANES):
            at = m * LANES + i
            load += (
                row[P.BASE_LOAD + at]
                - row[P.FLAP_COUPLING + at] * row[P.FLAP_ACCELERATION + i]
                - row[P.LAG_COUPLING + at] * row[P.LAG_ACCELERATION + i]
            )
        out[P.FORCE + m] += load


@kernel
def _subtract_carried_blades(t, b, out):
    """Take from a rotor's load what accelerates its blades along with the body, about the c.g."""
    f = cross(b[3], b[4], b[5], t[1], t[2], t[3])
    m = cross(t[1], t[2], t[3], b[0], b[1], b[2])
    out[P.FORCE] -= t[0] * b[0] + f[0]
    out[P.FORCE + 1] -= t[0] * b[1] + f[1]
    out[P.FORCE + 2] -= t[0] * b[2] + f[2]
    out[P.MOMENT] -= m[0] + (t[5] + t[6]) * b[3] - t[7] * b[4] - t[9] * b[5]
    out[P.MOMENT + 1] -= m[1] + (t[6] + t[4]) * b[4] - t[7] * b[3] - t[8] * b[5]
    out[P.MOMENT + 2] -= m[2] + (t[4] + t[5]) * b[5] - t[9] * b[3] - t[8] * b[4]


@kernel
def _paper_hub_moment(p, j, work):
    """Replace the moment across the shaft by the paper's reading (theory.md section 9)."""
    out = work.loads[j]
    a = p.axes[j]
    axial = a[0, 2] * out[P.MOMENT] + a[1, 2] * out[P.MOMENT + 1] + a[2, 2] * out[P.MOMENT + 2]
    inertia = p.rotor[j, P.A1_HUB] * p.switches[P.LEAD_LAG]
    for m in range(3):
        out[P.MOMENT + m] = axial * a[m, 2]
    for k in range(p.first_blade[j + 1] - p.first_blade[j]):
        row, i = work.blade[p.first_block[j] + k // LANES], k % LANES
        for m in range(3):
            inertial = inertia * row[P.FLAP_ACCELERATION + i] * row[P.FLAP_AXIS + m * LANES + i]
            out[P.MOMENT + m] += row[P.PAPER_MOMENT + m * LANES + i] - inertial


@kernel
def _add_hub_loads(p, work, b):
    """Add the loads of all rotors on their hubs, about the c.g., to a six-vector."""
    for j in range(p.rotor.shape[0]):
        out = work.loads[j]
        hx, hy, hz = p.rotor[j, P.HUB_X], p.rotor[j, P.HUB_Y], p.rotor[j, P.HUB_Z]
        arm = cross(hx, hy, hz, out[P.FORCE], out[P.FORCE + 1], out[P.FORCE + 2])
        for m in range(3):
            b[m] += out[P.FORCE + m]
            b[3 + m] += out[P.MOMENT + m] + arm[m]


@kernel
def _subtract_carried_body(body, acceleration, b):
    """Take from a six-vector what gives the rigid part a specific force without angular acceleration."""
    ax, ay, az = acceleration[0], acceleration[1], acceleration[2]
    m = cross(body[P.FIRST_MOMENT], body[P.FIRST_MOMENT + 1], body[P.FIRST_MOMENT + 2], ax, ay, az)
    for i in range(3):
        b[i] -= body[P.MASS] * acceleration[i]
        b[3 + i] -= m[i]


@kernel
def _solve_body_alone(p, work):
    """Specific force and angular acceleration of the rigid aircraft under the hub loads (`paper`)."""
    k, b = work.matrix, work.vector
    _add_hub_loads(p, work, b)
    k[:, :] = 0.0
    i = P.INERTIA
    k[0, 0] = k[1, 1] = k[2, 2] = p.body[P.MASS]
    for m in range(3):
        for n in range(m + 1):
            k[3 + m, 3 + n] = p.body[i + 3 * m + n]
    _solve_symmetric(k, b)


@kernel
def _body_rates(x, rot, om, g, acceleration, dx):
    """Rates of position, attitude, velocity and angular velocity (theory.md section 5)."""
    u, v, w = x[7], x[8], x[9]
    dx[0] = rot[0] * u + rot[1] * v + rot[2] * w
    dx[1] = rot[3] * u + rot[4] * v + rot[5] * w
    dx[2] = rot[6] * u + rot[7] * v + rot[8] * w
    dx[3], dx[4], dx[5], dx[6] = quaternion_rates(x[3], x[4], x[5], x[6], om[0], om[1], om[2])
    turn = cross(om[0], om[1], om[2], u, v, w)
    dx[7] = acceleration[0] + g[0] - turn[0]
    dx[8] = acceleration[1] + g[1] - turn[1]
    dx[9] = acceleration[2] + g[2] - turn[2]
    dx[10], dx[11], dx[12] = acceleration[3], acceleration[4], acceleration[5]


@kernel
def _rotor_rates(p, x, work, dx):
    """Rates of the multiblade coordinates (paper eqs. [13], [14]) and of the inflow."""
    all_blades = p.first_blade[-1]
    lead_lag = p.switches[P.LEAD_LAG]
    flaps, flap_rates = S.BODY_SIZE, S.BODY_SIZE + all_blades
    lags, lag_rates = S.BODY_SIZE + 2 * all_blades, S.BODY_SIZE + 3 * all_blades
    for i in range(all_blades):
        dx[flaps + i] = x[flap_rates + i]
        dx[flap_rates + i] = 0.0
        dx[lags + i] = lead_lag * x[lag_rates + i]
        dx[lag_rates + i] = 0.0
    for j in range(p.rotor.shape[0]):
        first = p.first_blade[j]
        n_blades = p.first_blade[j + 1] - first
        omega, share = p.rotor[j, P.SPEED], p.rotor[j, P.INVERSE_BLADES]
        for block in range(p.first_block[j], p.first_block[j + 1]):
            add_block_accelerations(dx, flap_rates + first, lag_rates + first, n_blades, work.blade[block], share)
        add_rotation_terms(x, dx, flaps + first, flap_rates + first, n_blades, omega, 1.0)
        add_rotation_terms(x, dx, lags + first, lag_rates + first, n_blades, omega, 1.0 * lead_lag)
        _inflow(p, j, x, work, dx)


@kernel
def _inflow(p, j, x, work, dx):
    """Inflow rates of rotor j from the sums of its blades."""
    rotor = p.rotor[j]
    at = S.BODY_SIZE + 4 * p.first_blade[-1] + 3 * j
    inverse_tip, scale = rotor[P.INVERSE_TIP_SPEED], rotor[P.LOAD_SCALE]
    flow = work.hub_flow[j]
    dx[at], dx[at + 1], dx[at + 2] = inflow_rates(
        x[at],
        x[at + 1],
        x[at + 2],
        flow[0] * inverse_tip,
        flow[1] * inverse_tip,
        flow[2] * inverse_tip,
        rotor[P.SENSE],
        rotor[P.DUCT],
        rotor[P.SPEED],
        work.aero[j, 0] * scale,
        work.aero[j, 1] * scale / rotor[P.RADIUS],
        work.aero[j, 2] * scale / rotor[P.RADIUS],
        p.switches[P.CYCLIC_INFLOW],
    )
