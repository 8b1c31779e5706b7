"""The derivative of the state as anybody would write it in numba: the yardstick of the fast kernel's speed.

Written from theory.md, sections 1 to 7, for the `complete` coupling: vectors in body axes with cross products, loops
over rotors, blades and elements, the standard library's sine, cosine and arctangent, a search in the airfoil's
table for every look-up. It shares no line with `sbs_sim.model`, so that it is an oracle as well: its blades are
written out where `plain_model` sums over points of mass, and it is fast enough for hundreds of states.

Nothing here is to be tuned beyond what comes by itself: memory is handed in, the blades are eliminated, and a value
that several lines need is kept.

The state is laid out as in `plain_model`. Vectors of three components are tuples inside compiled code.
"""

import math
from typing import NamedTuple

import numba
import numpy as np
from plain_model import hub_axes

INFLOW_SPEED_FLOOR = 1e-5  # epsilon of (6.3)
BODY_STATES = 13

ROTOR = np.dtype(
    [
        *((name, np.int64) for name in ("blades", "first_blade", "airfoil")),
        *(
            (name, np.float64)
            for name in (
                "speed",
                "radius",
                "sense",
                "hinge_offset",
                "lag_hinge_offset",
                "flap_hinge_offset",
                "blade_mass",
                "first_moment",
                "second_moment",
                "flap_spring",
                "lag_spring",
                "lag_damping",
                "pitch_flap_coupling",
                "pitch_lag_coupling",
                "swashplate_phase",
                "duct_expansion",
            )
        ),
        *((name, np.float64, (3,)) for name in ("hub", "x_hub", "y_hub", "shaft")),
    ]
)
ELEMENT = np.dtype([(name, np.float64) for name in ("span", "chord", "area", "lift", "twist")])
AIRFOIL = np.dtype([("last_interval", np.int64), ("alpha_step", np.float64)])
BODY = np.dtype(
    [
        *((name, np.float64) for name in ("mass", "density", "viscosity", "gravity")),
        ("first_moment", np.float64, (3,)),
        ("inertia", np.float64, (3, 3)),
        ("plates", np.float64, (3,)),
    ]
)
BLADE = np.dtype(
    [
        *((name, np.float64, (6,)) for name in ("flap_column", "lag_column")),
        *((name, np.float64) for name in ("flap_moment", "lag_moment", "lag_inertia")),
    ]
)


class PlainParams(NamedTuple):
    """An aircraft as arrays; SI units, radians, vectors in body axes.

    Attributes
    ----------
    body : ndarray of BODY, shape (1,)
        m_0, s_0 and I_0 of the fuselage (5.10), its drag areas, air and gravity.
    rotor : ndarray of ROTOR, shape (n_rotors,)
        `lag_hinge_offset` is e_L, `first_moment` S1, `second_moment` A1.
    element : ndarray of ELEMENT, shape (n_rotors, n_elements)
        Station s of the middle, chord, chord times width, share kappa of (4.1), twist.
    airfoil : ndarray of AIRFOIL, shape (n_airfoils,)
        Index of the last Reynolds interval, step of the angles, which start at -pi.
    reynolds : ndarray, shape (n_airfoils, max Reynolds numbers)
    cl, cd : ndarray, shape (n_airfoils, max Reynolds numbers, max angles, 4)
        Coefficients of 1, x, x^2, x^3 from each angle to the next, x = 0 to 1.
    """

    body: np.ndarray
    rotor: np.ndarray
    element: np.ndarray
    airfoil: np.ndarray
    reynolds: np.ndarray
    cl: np.ndarray
    cd: np.ndarray


class PlainWork(NamedTuple):
    """Memory of the kernel.

    Attributes
    ----------
    matrix, vector : ndarray, shape (6, 6) and (6,)
        The system (5.6) of the body.
    gain, inflow : ndarray, shape (3, 3) and (3,)
        The system (6.5) of one rotor's inflow.
    blade : ndarray of BLADE, shape (n_blades,)
        c_beta and c_xi of (5.3), Q_beta, Q_xi and A_2 of (3.1).
    cosine, sine : ndarray, shape (n_blades, max harmonics)
        Of n psi_k, n = 1, 2, ...
    """

    matrix: np.ndarray
    vector: np.ndarray
    gain: np.ndarray
    inflow: np.ndarray
    blade: np.ndarray
    cosine: np.ndarray
    sine: np.ndarray


# ------------------------------------------------------------------------------------------------------------
# Arrays of an aircraft
# ------------------------------------------------------------------------------------------------------------


def make_params(ac):
    """Return the `PlainParams` of an aircraft.

    Parameters
    ----------
    ac : aircraft
        As `plain_model` takes it; `complete` coupling.
    """
    if ac.options.coupling != "complete":
        raise ValueError(f"coupling = {ac.options.coupling!r}: allowed is 'complete'")
    names = sorted(ac.airfoils)
    tables = [ac.airfoils[name] for name in names]
    air = ac.environment
    mass, first_moment, inertia = fuselage(ac)
    scalars = (mass, air.air_density, air.kinematic_viscosity, air.gravity)
    return PlainParams(
        body=np.array([(*scalars, first_moment, inertia, ac.body.flat_plate_areas)], BODY),
        rotor=rotor_records(ac, names),
        element=np.stack([elements(rotor, ac.options.elements) for rotor in ac.rotors]),
        airfoil=np.array([(len(t.numbers) - 2, 2 * np.pi / (len(t.alpha) - 1)) for t in tables], AIRFOIL),
        reynolds=padded([table.numbers for table in tables]),
        cl=padded([polynomials(table.cl, ac.options.interpolation) for table in tables]),
        cd=padded([polynomials(table.cd, ac.options.interpolation) for table in tables]),
    )


def polynomials(values, interpolation):
    """Return the coefficients of 1, x, x^2, x^3 between angles (section 4.3), shape (n_re, n_alpha - 1, 4)."""
    start, rise = values[:, :-1], np.diff(values)
    before = np.roll(rise, 1, axis=1)
    slope = np.sign(rise) * np.minimum(np.abs(before + rise) / 2, 3 * np.minimum(np.abs(before), np.abs(rise)))
    left = np.where(before * rise > 0, slope, 0.0) if interpolation == "smooth" else rise
    right = np.roll(left, -1, axis=1) if interpolation == "smooth" else rise
    return np.stack([start, left, 3 * rise - 2 * left - right, left + right - 2 * rise], axis=-1)


def make_work(ac):
    """Return the `PlainWork` of an aircraft."""
    blades = sum(rotor.blades for rotor in ac.rotors)
    harmonics = max((rotor.blades - 1) // 2 for rotor in ac.rotors)
    return PlainWork(
        matrix=np.zeros((6, 6)),
        vector=np.zeros(6),
        gain=np.zeros((3, 3)),
        inflow=np.zeros(3),
        blade=np.zeros(blades, BLADE),
        cosine=np.zeros((blades, harmonics)),
        sine=np.zeros((blades, harmonics)),
    )


def padded(arrays):
    """Return arrays of one dimension and different sizes as one, filled up with zeros."""
    shape = np.max([array.shape for array in arrays], axis=0)
    result = np.zeros((len(arrays), *shape))
    for row, array in zip(result, arrays, strict=True):
        row[tuple(slice(size) for size in array.shape)] = array
    return result


def rotor_records(ac, airfoil_names):
    """Return the `ROTOR` records of an aircraft."""
    records = np.zeros(len(ac.rotors), ROTOR)
    first = 0
    for record, rotor in zip(records, ac.rotors, strict=True):
        for name in ROTOR.names:
            if hasattr(rotor, name) and name != "airfoil":
                record[name] = getattr(rotor, name)
        record["first_blade"], record["airfoil"] = first, airfoil_names.index(rotor.airfoil)
        record["sense"] = rotor.rotation
        record["lag_hinge_offset"] = rotor.hinge_offset - rotor.flap_hinge_offset
        record["first_moment"] = rotor.blade_mass * rotor.blade_cg
        record["second_moment"] = rotor.blade_mass * (rotor.radius - rotor.hinge_offset) ** 2 / 3
        record["shaft"] = rotor.shaft_direction
        record["x_hub"], record["y_hub"] = hub_axes(rotor.shaft_direction)
        first += rotor.blades
    return records


def elements(rotor, count):
    """Return the `ELEMENT` records of a rotor's blades (section 4.1)."""
    length = rotor.radius - rotor.hinge_offset
    width = (length - rotor.root_cutout) / count
    s = rotor.root_cutout + (np.arange(count) + 0.5) * width
    chord = rotor.chord_root + (rotor.chord_tip - rotor.chord_root) * s / length
    twist = rotor.twist_root + (rotor.twist_tip - rotor.twist_root) * s / length
    lifting = (rotor.tip_loss * rotor.radius - rotor.hinge_offset - (s - width / 2)) / width
    columns = zip(s, chord, chord * width, np.clip(lifting, 0, 1), twist, strict=True)
    return np.array(list(columns), ELEMENT)


def fuselage(ac):
    """Return mass [kg], first moment [kg m] and inertia [kg m^2] of the aircraft without its blades (5.10)."""
    mass, first_moment, inertia = ac.body.mass, np.zeros(3), np.array(ac.body.inertia, dtype=float)
    for rotor in ac.rotors:
        e_0, r, blades_mass = rotor.hinge_offset, np.asarray(rotor.hub, dtype=float), rotor.blades * rotor.blade_mass
        a_1 = rotor.blade_mass * (rotor.radius - e_0) ** 2 / 3
        polar = rotor.blades * (rotor.blade_mass * (e_0**2 + 2 * e_0 * rotor.blade_cg) + a_1)
        u = np.asarray(rotor.shaft_direction, dtype=float)
        mass -= blades_mass
        first_moment -= blades_mass * r
        inertia -= polar * (np.eye(3) + np.outer(u, u)) / 2 + blades_mass * (r @ r * np.eye(3) - np.outer(r, r))
    return mass, first_moment, inertia


# ------------------------------------------------------------------------------------------------------------
# Vectors and linear systems
# ------------------------------------------------------------------------------------------------------------

compiled = numba.njit(fastmath=True, nogil=True)


@compiled
def vector(a):
    """The first three values of an array."""
    return a[0], a[1], a[2]


@compiled
def scaled(x, a):
    return x * a[0], x * a[1], x * a[2]


@compiled
def add(a, b):
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@compiled
def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@compiled
def cross(a, b):
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@compiled
def combined(x, a, y, b):
    """X times vector a plus y times vector b."""
    return x * a[0] + y * b[0], x * a[1] + y * b[1], x * a[2] + y * b[2]


@compiled
def solve(a, b):
    """Solve a x = b in place by Gauss's elimination.

    Without a choice of pivots: (5.6) is positive definite, and (6.5) adds (k X)^2 / (2 a_w^2) to 2 (1 - X^2).
    """
    n = b.size
    for i in range(n):
        for row in range(i + 1, n):
            factor = a[row, i] / a[i, i]
            for column in range(i + 1, n):
                a[row, column] -= factor * a[i, column]
            b[row] -= factor * b[i]
    for i in range(n - 1, -1, -1):
        for column in range(i + 1, n):
            b[i] -= a[i, column] * b[column]
        b[i] /= a[i, i]


# ------------------------------------------------------------------------------------------------------------
# The derivative
# ------------------------------------------------------------------------------------------------------------


@compiled
def plain_rates(p, x, swash, psi, wind, lead_lag, cyclic_inflow, work, dx):
    """Derivative of the state by time.

    Parameters
    ----------
    p : PlainParams
    x : ndarray, shape (size,)
    swash : ndarray, shape (n_rotors, 3)
        theta0, A1s, B1s of each rotor [rad].
    psi : ndarray, shape (n_rotors,)
        Azimuth of each rotor's first blade [rad].
    wind : ndarray, shape (3,)
        Velocity of the air, NED [m/s].
    lead_lag, cyclic_inflow : bool
        Off: xi and its derivatives, or lambdas and lambdac, are zero.
    work : PlainWork
    dx : ndarray, shape (size,)
        Output.
    """
    north, east, down = rotation_rows(x)
    g = scaled(p.body[0].gravity, down)
    U, om = (x[7], x[8], x[9]), (x[10], x[11], x[12])
    air = add(U, scaled(-1.0, combined_three(wind, north, east, down)))
    dx[:] = 0.0
    start_body(p.body[0], om, air, work.matrix, work.vector)
    for j in range(p.rotor.size):
        rotor_terms(p, j, x, swash, psi[j], om, air, lead_lag, cyclic_inflow, work, dx)
    solve(work.matrix, work.vector)
    body_rates(x, U, om, g, north, east, down, work.vector, dx)
    for j in range(p.rotor.size):
        rotor_accelerations(p.rotor[j], x, lead_lag, work, dx)


@compiled
def combined_three(x, a, b, c):
    """The sum of three vectors, each times one component of x."""
    return add(combined(x[0], a, x[1], b), scaled(x[2], c))


@compiled
def rotation_rows(x):
    """The rows of R_NB (1.1): north, east and down in body axes."""
    w, i, j, k = x[3], x[4], x[5], x[6]
    north = (1 - 2 * (j * j + k * k), 2 * (i * j - w * k), 2 * (i * k + w * j))
    east = (2 * (i * j + w * k), 1 - 2 * (i * i + k * k), 2 * (j * k - w * i))
    down = (2 * (i * k - w * j), 2 * (j * k + w * i), 1 - 2 * (i * i + j * j))
    return north, east, down


@compiled
def start_body(body, om, air, J, b):
    """The fuselage's share of the system (5.6, 5.7)."""
    s, inertia = vector(body.first_moment), body.inertia
    momentum = combined_three(om, vector(inertia[0]), vector(inertia[1]), vector(inertia[2]))
    centrifugal, gyroscopic = cross(om, cross(om, s)), cross(om, momentum)
    J[:, :] = 0.0
    add_mass(J, body.mass, s)
    for i in range(3):
        drag = -body.density / 2 * body.plates[i] * abs(air[i]) * air[i]
        b[i], b[3 + i] = drag - centrifugal[i], -gyroscopic[i]
        for k in range(3):
            J[3 + i, 3 + k] = inertia[i, k]


@compiled
def add_mass(J, m, s):
    """Mass and first moment of the matrix of (5.5)."""
    J[0, 0] += m
    J[1, 1] += m
    J[2, 2] += m
    J[3, 1] -= s[2]
    J[3, 2] += s[1]
    J[4, 0] += s[2]
    J[4, 2] -= s[0]
    J[5, 0] -= s[1]
    J[5, 1] += s[0]
    J[1, 3] -= s[2]
    J[2, 3] += s[1]
    J[0, 4] += s[2]
    J[2, 4] -= s[0]
    J[0, 5] -= s[1]
    J[1, 5] += s[0]


@compiled
def rotor_terms(p, j, x, swash, psi, om, air, lead_lag, cyclic_inflow, work, dx):
    """All of a rotor's blades in the body's system, its duct, and the rates of its inflow."""
    r = p.rotor[j]
    hub, u = vector(r.hub), vector(r.shaft)
    flow = add(air, cross(om, hub))
    inflow = x.size - 3 * p.rotor.size + 3 * j
    lambda0 = x[inflow]
    lambdas, lambdac = (x[inflow + 1], x[inflow + 2]) if cyclic_inflow else (0.0, 0.0)
    thrust = moment_c = moment_s = 0.0
    for k in range(r.blades):
        lift, moment, cosine, sine = blade_terms(
            p, j, k, x, swash, psi, om, flow, lambda0, lambdas, lambdac, lead_lag, work
        )
        thrust += lift
        moment_c += moment * cosine
        moment_s += moment * sine
    duct = scaled((2 * r.duct_expansion - 1) * thrust, u)
    add_load(work.vector, duct, cross(hub, duct))
    inflow_rates(r, p.body[0].density, flow, lambda0, lambdas, lambdac, thrust, moment_c, moment_s, cyclic_inflow, work)
    dx[inflow], dx[inflow + 1], dx[inflow + 2] = work.inflow[0], work.inflow[2], work.inflow[1]


@compiled
def add_load(b, force, moment):
    for i in range(3):
        b[i] += force[i]
        b[3 + i] += moment[i]


@compiled
def blade_angle(r, i, k, x, angles, rates, work):
    """Angle and rate of a blade from multiblade coordinates (1.6, 1.10)."""
    angle, rate = x[angles], x[rates]
    for n in range(1, (r.blades - 1) // 2 + 1):
        c, s = work.cosine[i, n - 1], work.sine[i, n - 1]
        a, b = x[angles + 2 * n - 1], x[angles + 2 * n]
        angle -= a * c + b * s
        rate += n * r.speed * (a * s - b * c) - x[rates + 2 * n - 1] * c - x[rates + 2 * n] * s
    if r.blades % 2 == 0:
        sign = 1.0 - 2.0 * (k % 2)
        angle += sign * x[angles + r.blades - 1]
        rate += sign * x[rates + r.blades - 1]
    return angle, rate


@compiled
def blade_terms(p, j, k, x, swash, psi, om, flow, lambda0, lambdas, lambdac, lead_lag, work):
    """One blade in the system (5.6), its hinges eliminated; lift along the shaft and its moment about the axis.

    Returns
    -------
    thrust : float
        [N], along the shaft.
    moment : float
        Of (6.2): the integral of (e_0 + s) dF_n [N m].
    cosine, sine : float
        Of the blade's azimuth.
    """
    r = p.rotor[j]
    i = r.first_blade + k
    G, omega, e_L, e_F = r.sense, r.speed, r.lag_hinge_offset, r.flap_hinge_offset
    m_b, S_1, A_1 = r.blade_mass, r.first_moment, r.second_moment
    hub, u = vector(r.hub), vector(r.shaft)

    # Angles (1.4, 1.6) and directions (1.5, 2.1)
    azimuth = psi + 2 * math.pi * k / r.blades
    for n in range(1, (r.blades - 1) // 2 + 1):
        work.cosine[i, n - 1], work.sine[i, n - 1] = math.cos(n * azimuth), math.sin(n * azimuth)
    cosine, sine = work.cosine[i, 0], work.sine[i, 0]
    blades, flap = work.blade.size, BODY_STATES + r.first_blade
    beta, beta_rate = blade_angle(r, i, k, x, flap, flap + blades, work)
    xi = xi_rate = 0.0
    if lead_lag:
        xi, xi_rate = blade_angle(r, i, k, x, flap + 2 * blades, flap + 3 * blades, work)
    cb, sb, cx, sx = math.cos(beta), math.sin(beta), math.cos(xi), math.sin(xi)
    e_y = combined(-cosine, vector(r.x_hub), G * sine, vector(r.y_hub))
    e_t = combined(sine, vector(r.x_hub), G * cosine, vector(r.y_hub))
    y, t = combined(cx, e_y, -sx, e_t), combined(sx, e_y, cx, e_t)
    d, n, f = combined(cb, y, sb, u), combined(-sb, y, cb, u), scaled(-G, t)
    lag_arm, flap_arm = scaled(e_L, e_y), scaled(e_F, y)
    p_F = add(lag_arm, flap_arm)

    # Velocities (2.3, 2.4) and accelerations (2.5, 2.6)
    w_h = add(om, scaled(G * omega, u))
    w_l = add(w_h, scaled(-G * xi_rate, u))
    w_b = add(w_l, scaled(beta_rate, f))
    V_h, V_l, V_s = cross(w_h, lag_arm), cross(w_l, flap_arm), cross(w_b, d)
    V_F = add(flow, add(V_h, V_l))
    gamma_h = scaled(G * omega, cross(om, u))
    gamma_l = add(gamma_h, scaled(-G * xi_rate, cross(w_h, u)))
    gamma_b = add(gamma_l, scaled(beta_rate, cross(w_l, f)))
    a_lag = add(cross(gamma_h, lag_arm), cross(w_h, V_h))
    a_flap = add(cross(gamma_l, flap_arm), cross(w_l, V_l))
    a_0 = add(add(a_lag, a_flap), cross(om, cross(om, hub)))
    a_s = add(cross(gamma_b, d), cross(w_b, V_s))

    # Air loads (4.2, 4.8); both components of the flow are linear in s
    swing = azimuth + r.swashplate_phase
    pitch = swash[j, 0] - swash[j, 1] * G * math.cos(swing) - swash[j, 2] * math.sin(swing)
    pitch -= r.pitch_flap_coupling * beta + r.pitch_lag_coupling * xi
    gradient = omega * (lambdac * cosine + lambdas * sine)
    at_hinge = omega * r.radius * lambda0 + gradient * r.hinge_offset
    u_P, u_P_slope = dot(V_F, n) + cb * at_hinge, dot(V_s, n) + cb * gradient
    F_n, F_t, M_n, M_t = section_loads(p, j, pitch, dot(V_F, t), dot(V_s, t), u_P, u_P_slope)

    # Moments about the hinges (3.1, 3.2)
    k_1, k_2 = m_b * e_F + S_1 * cb, S_1 * e_F + A_1 * cb
    A_2 = m_b * e_F * e_F + 2 * e_F * S_1 * cb + A_1 * cb * cb
    Q_beta = M_n - r.flap_spring * beta - S_1 * dot(n, a_0) - A_1 * dot(n, a_s)
    Q_xi = k_1 * dot(t, a_0) + k_2 * dot(t, a_s) - e_F * F_t - cb * M_t
    Q_xi -= r.lag_spring * xi + r.lag_damping * xi_rate

    # Loads on the body (5.4), the blade's locked inertia (5.5), and its hinges (5.3, 5.8)
    h = add(hub, p_F)
    first, second = combined(m_b, a_0, S_1, a_s), combined(S_1, a_0, A_1, a_s)
    force = add(combined(F_n, n, F_t, t), scaled(-1.0, first))
    moment = add(cross(h, force), cross(d, add(combined(M_n, n, M_t, t), scaled(-1.0, second))))
    add_load(work.vector, force, moment)
    add_mass(work.matrix, m_b, combined(m_b, h, S_1, d))
    add_inertia(work.matrix, m_b, S_1, A_1, h, d)
    blade = work.blade[i]
    store(blade.flap_column, scaled(S_1, n), add(scaled(S_1, cross(h, n)), scaled(A_1, f)))
    eliminate(work.matrix, work.vector, blade.flap_column, Q_beta, A_1)
    blade.flap_moment = Q_beta
    if lead_lag:
        store(blade.lag_column, scaled(-k_1, t), combined(-k_1, cross(h, t), -k_2, cross(d, t)))
        eliminate(work.matrix, work.vector, blade.lag_column, Q_xi, A_2)
        blade.lag_moment, blade.lag_inertia = Q_xi, A_2
    return cb * F_n, r.hinge_offset * F_n + M_n, cosine, sine


@compiled
def cubic(c, x):
    return c[0] + x * (c[1] + x * (c[2] + x * c[3]))


@compiled
def section_loads(p, j, pitch, u_T, u_T_slope, u_P, u_P_slope):
    """Integrals of dF_n, dF_t [N], s dF_n and s dF_t [N m] along a blade (4.4, 4.5).

    Lift and drag are cubic in the angle, which is periodic, and linear in the Reynolds number, which is clamped.
    """
    density, viscosity = p.body[0].density, p.body[0].viscosity
    foil = p.rotor[j].airfoil
    step, last = p.airfoil[foil].alpha_step, p.airfoil[foil].last_interval
    F_n = F_t = M_n = M_t = 0.0
    for e in range(p.element.shape[1]):
        element = p.element[j, e]
        s = element.span
        tangential, normal = u_T + s * u_T_slope, u_P + s * u_P_slope
        speed = math.sqrt(tangential * tangential + normal * normal)
        reynolds = speed * element.chord / viscosity
        angle = pitch + element.twist - math.atan2(normal, tangential) + math.pi
        angle -= 2 * math.pi * math.floor(angle / (2 * math.pi))
        a = int(angle / step)
        x = angle / step - a
        i = 0
        while i < last and reynolds > p.reynolds[foil, i + 1]:
            i += 1
        low, high = p.reynolds[foil, i], p.reynolds[foil, i + 1]
        y = min(max((reynolds - low) / (high - low), 0.0), 1.0)
        cl_low, cl_high = cubic(p.cl[foil, i, a], x), cubic(p.cl[foil, i + 1, a], x)
        cd_low, cd_high = cubic(p.cd[foil, i, a], x), cubic(p.cd[foil, i + 1, a], x)
        cl = element.lift * (cl_low * (1 - y) + cl_high * y)
        cd = cd_low * (1 - y) + cd_high * y
        pressure = density / 2 * element.area * speed
        dF_n = pressure * (cl * tangential - cd * normal)
        dF_t = -pressure * (cl * normal + cd * tangential)
        F_n += dF_n
        F_t += dF_t
        M_n += s * dF_n
        M_t += s * dF_t
    return F_n, F_t, M_n, M_t


@compiled
def add_inertia(J, m, S_1, A_1, h, d):
    """The second moments of (5.5)."""
    trace = m * dot(h, h) + 2 * S_1 * dot(h, d) + A_1 * dot(d, d)
    for row in range(3):
        J[3 + row, 3 + row] += trace
        for column in range(3):
            J[3 + row, 3 + column] -= (
                m * h[row] * h[column] + S_1 * (h[row] * d[column] + d[row] * h[column]) + A_1 * d[row] * d[column]
            )


@compiled
def store(column, force, moment):
    for i in range(3):
        column[i], column[3 + i] = force[i], moment[i]


@compiled
def eliminate(J, b, column, moment, inertia):
    """Take a hinge out of the body's system (5.8)."""
    for row in range(6):
        factor = column[row] / inertia
        b[row] -= factor * moment
        for i in range(6):
            J[row, i] -= factor * column[i]


@compiled
def inflow_rates(r, density, flow, lambda0, lambdas, lambdac, thrust, moment_c, moment_s, cyclic_inflow, work):
    """Rates of lambda0, lambdac, lambdas into `work.inflow` (section 6)."""
    tip_speed = r.speed * r.radius
    scale = density * math.pi * r.radius**2 * tip_speed**2
    per_force = 1 / scale if scale > 0 else 0.0
    C_T = thrust * per_force
    m_c, m_s = moment_c * per_force / r.radius, moment_s * per_force / r.radius
    mu_x, mu_y = dot(vector(r.x_hub), flow) / tip_speed, dot(vector(r.y_hub), flow) / tip_speed
    lam = lambda0 + dot(vector(r.shaft), flow) / tip_speed
    mu2 = mu_x * mu_x + mu_y * mu_y
    V_T = math.sqrt(mu2 + lam * lam + INFLOW_SPEED_FLOOR**2)
    M_0, M_1 = 8 / (3 * math.pi), 16 / (45 * math.pi)
    L, rates = work.gain, work.inflow
    L[0, 0] = 2 * r.duct_expansion**2
    if not cyclic_inflow:
        rates[0], rates[1], rates[2] = r.speed * (C_T - V_T * lambda0 / L[0, 0]) / M_0, 0.0, 0.0
        return
    V_m = (mu2 + lam * (lam + lambda0)) / V_T
    X_c, X_s = mu_x / (V_T + abs(lam)), -r.sense * mu_y / (V_T + abs(lam))
    k, ring = 15 * math.pi / 64, 2 * (1 + X_c * X_c + X_s * X_s)
    L[0, 1], L[0, 2], L[1, 0], L[2, 0] = -k * X_c, -k * X_s, k * X_c, k * X_s
    L[1, 1], L[2, 2] = ring - 4 * X_c * X_c, ring - 4 * X_s * X_s
    L[1, 2] = L[2, 1] = -4 * X_c * X_s
    rates[0], rates[1], rates[2] = lambda0, lambdac, lambdas
    solve(L, rates)
    rates[0] = r.speed * (C_T - V_T * rates[0]) / M_0
    rates[1] = r.speed * (m_c - V_m * rates[1]) / M_1
    rates[2] = r.speed * (m_s - V_m * rates[2]) / M_1


@compiled
def body_rates(x, U, om, g, north, east, down, solution, dx):
    """Rates of position, attitude (1.2) and motion (5.13)."""
    w, i, j, k = x[3], x[4], x[5], x[6]
    p, q, r = om
    dx[0], dx[1], dx[2] = dot(north, U), dot(east, U), dot(down, U)
    dx[3] = (-i * p - j * q - k * r) / 2
    dx[4] = (w * p + j * r - k * q) / 2
    dx[5] = (w * q + k * p - i * r) / 2
    dx[6] = (w * r + i * q - j * p) / 2
    turn = cross(om, U)
    for m in range(3):
        dx[7 + m] = solution[m] + g[m] - turn[m]
        dx[10 + m] = solution[3 + m]


@compiled
def rotor_accelerations(r, x, lead_lag, work, dx):
    """Accelerations of a rotor's blades (5.9) and the rates of its multiblade coordinates."""
    blades, flap = work.blade.size, BODY_STATES + r.first_blade
    for k in range(r.blades):
        i = r.first_blade + k
        blade = work.blade[i]
        flap_dd, lag_dd = blade.flap_moment, blade.lag_moment
        for m in range(6):
            flap_dd -= blade.flap_column[m] * work.vector[m]
            lag_dd -= blade.lag_column[m] * work.vector[m]
        add_to_coordinates(r, k, flap_dd / r.second_moment, flap + blades, work.cosine, work.sine, dx)
        if lead_lag:
            add_to_coordinates(r, k, lag_dd / blade.lag_inertia, flap + 3 * blades, work.cosine, work.sine, dx)
    coordinate_rates(r, x, flap, flap + blades, dx)
    if lead_lag:
        coordinate_rates(r, x, flap + 2 * blades, flap + 3 * blades, dx)


@compiled
def add_to_coordinates(r, k, acceleration, rates, cosine, sine, dx):
    """A blade's share of the means in (1.9)."""
    share, i = acceleration / r.blades, r.first_blade + k
    dx[rates] += share
    for n in range(1, (r.blades - 1) // 2 + 1):
        dx[rates + 2 * n - 1] -= 2 * share * cosine[i, n - 1]
        dx[rates + 2 * n] -= 2 * share * sine[i, n - 1]
    if r.blades % 2 == 0:
        dx[rates + r.blades - 1] += (1.0 - 2.0 * (k % 2)) * share


@compiled
def coordinate_rates(r, x, angles, rates, dx):
    """Rates of the angles, and the terms of the rotation in (1.9)."""
    for m in range(r.blades):
        dx[angles + m] = x[rates + m]
    for n in range(1, (r.blades - 1) // 2 + 1):
        a, b, turn = 2 * n - 1, 2 * n, n * r.speed
        dx[rates + a] += turn * turn * x[angles + a] - 2 * turn * x[rates + b]
        dx[rates + b] += turn * turn * x[angles + b] + 2 * turn * x[rates + a]


@compiled
def mean_rates(p, x, swash, azimuth_count, wind, lead_lag, cyclic_inflow, work, psi, slope, dx):
    """Mean of `plain_rates` over azimuths 2 pi k / (N_b N_c), the quantity of `averaged_derivative`.

    psi, shape (n_rotors,), and slope, shape (size,), are memory; the others as in `plain_rates`.
    """
    dx[:] = 0.0
    for k in range(azimuth_count):
        for j in range(p.rotor.size):
            psi[j] = 2 * math.pi * k / (p.rotor[j].blades * azimuth_count)
        plain_rates(p, x, swash, psi, wind, lead_lag, cyclic_inflow, work, slope)
        for i in range(dx.size):
            dx[i] += slope[i] / azimuth_count
