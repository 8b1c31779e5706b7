"""Plain reference of the complete model (theory.md, sections 1 to 7): the yardstick of the fast kernel.

Everything is written for clarity and shares no line with the package. Vectors stand in body axes (FRD) with
cross products, a blade is three point masses, and loops run over rotors, blades, masses and elements. The
unknown accelerations follow from one dense linear system whose matrix is the residual of Newton's and Euler's
equations evaluated at unit accelerations: the residual is affine in them, so that this is exact.

State vector ``x``, flat: ::

    position NED (3) [m], quaternion w x y z, body FRD -> NED (4), velocity U in body axes (3) [m/s],
    body rate om in body axes (3) [rad/s], then over all rotors, N_b each and multiblade:
    flap [rad], flap rate [rad/s], lag [rad], lag rate [rad/s],
    then per rotor lambda0, lambdas, lambdac [-]

Angles in airfoil tables, twist and swashplate phase are radians. ``momentum``, ``first_moment`` and
``energy`` also take complex numbers, so that tests may differentiate them by a complex step to machine
precision.
"""

from itertools import pairwise
from types import SimpleNamespace
from typing import NamedTuple

import numpy as np
from plain_ground import contact, ground_washes
from plain_interference import all_washes
from plain_parts import part_loads
from plain_ring import added_inflow, ring_shares
from scipy.interpolate import CubicHermiteSpline

#: Smooth floor of the inflow's total velocity V_T, in units of the tip speed (theory.md section 6).
INFLOW_SPEED_FLOOR = 1e-5


# ------------------------------------------------------------------------------------------------------------
# Frames and the multiblade transform (theory.md section 1)
# ------------------------------------------------------------------------------------------------------------


def cross(a, b):
    """Return the vector product a x b, shape (3,); ``np.cross`` spends ten times as long on one pair."""
    a0, a1, a2 = a
    b0, b1, b2 = b
    return np.array([a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0])


def rotation_matrix(quaternion):
    """Return the matrix that takes body FRD components to NED.

    Parameters
    ----------
    quaternion : array, shape (4,)
        Unit quaternion w, x, y, z, body FRD -> NED.

    Returns
    -------
    array, shape (3, 3)
    """
    w, x, y, z = quaternion
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def hub_axes(shaft_direction):
    """Return x_hub and y_hub: the smallest rotation that takes body (0, 0, -1) to u, applied to body x and y.

    For u = (0, 0, 1) the smallest rotation is not unique; the half turn about body x is taken.

    Parameters
    ----------
    shaft_direction : array, shape (3,)
        Unit vector u, up along the shaft, body axes.

    Returns
    -------
    x_hub, y_hub : array, shape (3,)
        Unit vectors, body axes.
    """
    up = np.array([0.0, 0.0, -1.0])
    u = np.asarray(shaft_direction, dtype=float)
    cosine = up @ u
    if cosine < -1 + 1e-12:
        return np.array([1.0, 0.0, 0.0]), np.array([0.0, -1.0, 0.0])
    axis = cross(up, u)
    cross_matrix = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    rotation = np.eye(3) + cross_matrix + cross_matrix @ cross_matrix / (1 + cosine)
    return rotation[:, 0], rotation[:, 1]


def blade_azimuths(blades, psi):
    """Return psi_k = psi + 2 pi (k - 1) / N_b for k = 1 .. N_b [rad], shape (N_b,)."""
    return psi + 2 * np.pi * np.arange(blades) / blades


def multiblade_matrix(blades, psi, derivative=0):
    """Return the matrix from multiblade coordinates to blade angles, or its derivative by psi.

    beta_k = a0 - sum_n (a_n cos n psi_k + b_n sin n psi_k) + a_d (-1)^(k-1), coordinates in the order
    a0, a1, b1, a2, b2, ..., and a_d last where N_b is even (theory.md section 1).

    Parameters
    ----------
    blades : int
        Number of blades N_b, 2 or more.
    psi : float
        Azimuth of blade 1 [rad].
    derivative : {0, 1, 2}
        Order of the derivative by psi.

    Returns
    -------
    array, shape (N_b, N_b)
    """
    azimuth = blade_azimuths(blades, psi)
    columns = [np.ones(blades) if derivative == 0 else np.zeros(blades)]
    for n in range(1, (blades - 1) // 2 + 1):
        cosine, sine = np.cos(n * azimuth), np.sin(n * azimuth)
        columns.append(-[cosine, -n * sine, -n * n * cosine][derivative])
        columns.append(-[sine, n * cosine, -n * n * sine][derivative])
    if blades % 2 == 0:
        columns.append((-1.0) ** np.arange(blades) if derivative == 0 else np.zeros(blades))
    return np.stack(columns, axis=1)


def split_state(ac, x, lead_lag=True, cyclic_inflow=True):
    """Split the flat state into named parts, one array per rotor where the part belongs to rotors.

    Lag off and cyclic inflow off are constraints: what the state holds there is replaced by zeros.

    Returns
    -------
    SimpleNamespace
        position (3,) NED, quaternion (4,), velocity (3,) body, rate (3,) body; flap, flap_rate, lag,
        lag_rate: lists of (N_b,) multiblade; inflow: list of (3,) lambda0, lambdas, lambdac; wake: list of (2, N_b)
        multiblade, (2, 0) without unsteady airfoil.
    """
    x = np.asarray(x)
    parts, start = {}, 13
    for name in ("flap", "flap_rate", "lag", "lag_rate"):
        parts[name] = []
        for rotor in ac.rotors:
            values = x[start : start + rotor.blades]
            parts[name].append(values if lead_lag or not name.startswith("lag") else 0 * values)
            start += rotor.blades
    kept = np.array([1.0, 1.0, 1.0]) if cyclic_inflow else np.array([1.0, 0.0, 0.0])
    parts["inflow"] = [x[start + 3 * j : start + 3 * j + 3] * kept for j in range(len(ac.rotors))]
    start += 3 * len(ac.rotors)
    kinds, stall = section_states(ac), np.zeros((0, 0))
    if count := section_count(ac):
        x, stall = x[:-count], x[-count:].reshape(kinds, -1)
    parts["separation"] = [
        [stall[:, section_places(ac, j, k)] for k in range(rotor.blades)] if kinds else None
        for j, rotor in enumerate(ac.rotors)
    ]
    parts["wake"] = []
    for rotor in ac.rotors:
        size = 2 * rotor.blades if has_wake(rotor) else 0
        parts["wake"].append(x[start : start + size].reshape(2, -1))
        start += size
    if stands_on_ground(ac):  # the deflections of its contact points stand behind
        x = x[: len(x) - 2 * len(ac.contact_points)]
    if len(x) != start:
        raise ValueError(f"state of length {len(x)}, expected {start}")
    return SimpleNamespace(position=x[0:3], quaternion=x[3:7], velocity=x[7:10], rate=x[10:13], **parts)


# ------------------------------------------------------------------------------------------------------------
# Mass (theory.md sections 2 and 5)
# ------------------------------------------------------------------------------------------------------------


def flap_inertia(rotor, length=None):
    """Return A1 [kg m^2]: that of the file, or of a uniform blade of a length [m], by default from the flap hinge."""
    if rotor.blade_inertia is not None:
        return rotor.blade_inertia
    return rotor.blade_mass * (rotor.radius - rotor.hinge_offset if length is None else length) ** 2 / 3


def mass_points(rotor, second_moment=None):
    """Return three point masses that carry a blade's m_b, S1 and A1.

    The position of a blade's point is affine in s, so that no other integral of the mass enters.

    Parameters
    ----------
    rotor : rotor of an aircraft
    second_moment : float, optional
        Inertia about the flap hinge [kg m^2] in place of A1 = m_b L^2 / 3.

    Returns
    -------
    list of (float, float)
        Station s from the flap hinge [m] and mass [kg]; of a blade with offsets the stations are those of `Blade.arm`.
    """
    if has_offsets(rotor):
        return offset_mass_points(rotor)
    length = rotor.radius - rotor.hinge_offset
    if second_moment is None:
        second_moment = flap_inertia(rotor)
    stations = np.array([0.0, length / 2, length])
    integrals = [rotor.blade_mass, rotor.blade_mass * rotor.blade_cg, second_moment]
    masses = np.linalg.solve(np.vander(stations, increasing=True).T, integrals)
    return list(zip(stations, masses, strict=True))


def stands_on_ground(ac):
    """Return whether contact points carry it (section 7.7)."""
    return getattr(ac, "has_contact", False)


def has_late_separation(rotor):
    """Return whether separation on its sections follows the flow late (section 4.10)."""
    return getattr(rotor, "dynamic_stall", "none") != "none"


def has_stall_vortex(rotor):
    """Return whether the leading edge of its sections sheds a vortex (section 4.10)."""
    return getattr(rotor, "dynamic_stall", "none") == "leishman_beddoes"


def section_states(ac):
    """Return the number of states of each section (section 4.10)."""
    return 4 if any(map(has_stall_vortex, ac.rotors)) else int(any(map(has_late_separation, ac.rotors)))


def random_sections(ac, rng):
    """Return states of all sections: some attached, some with a vortex that grows or has left."""
    count = section_count(ac) // section_states(ac)
    kinds = [rng.uniform(size=count), rng.normal(scale=2.0, size=count), rng.normal(size=count)]
    return np.concatenate([*kinds, rng.uniform(0, 15, size=count)][: section_states(ac)])


def section_places(ac, j, k):
    """Return where the sections of blade k of rotor j are among those of all, from the root outwards.

    Blades stand in quads of one rotor, two quads beside each other, the sections of these one after the other.
    """
    quad = sum(-(-rotor.blades // 4) for rotor in ac.rotors[:j]) + k // 4
    return (quad // 2 * ac.options.elements + np.arange(ac.options.elements)) * 8 + quad % 2 * 4 + k % 4


def section_count(ac):
    """Return the number of states of late separation, at the end of the state; 0 without it."""
    return 8 * -(-sum(-(-rotor.blades // 4) for rotor in ac.rotors) // 2) * ac.options.elements * section_states(ac)


def attached_line(airfoil, number):
    """Return the slope of the lift of attached flow [1/rad] and the angle without lift [rad]."""
    near = np.abs(airfoil.alpha) < max(np.radians(5.0), 1.5 * np.diff(airfoil.alpha)[len(airfoil.alpha) // 2])
    lines = [np.polyfit(airfoil.alpha[near], cl[near], 1) for cl in airfoil.cl]
    numbers = np.asarray(airfoil.numbers, dtype=float)
    slope = np.interp(number, numbers, [line[0] for line in lines])
    return slope, np.interp(number, numbers, [-line[1] / line[0] for line in lines])


def late_lift(airfoil, number, angle, steady, share):
    """Return what a share of attached chord adds to the lift of a section, and the share that stays there."""
    slope, no_lift = attached_line(airfoil, number)
    attached = slope * (angle - no_lift)
    root = np.clip(2 * np.sqrt(max(steady / attached, 0.0)) - 1, 0, 1) if abs(attached) > 1e-3 else 1.0
    gap = attached * (3 + root) / (4 * (1 + root)) if root > 0 else attached - steady
    return stall_window(angle - no_lift) * gap * (share - root**2), root**2


def stall_window(angle):
    """Return how much of the dynamics of stall is met at an angle off that without lift [rad]."""
    return np.clip((np.radians(60) - abs(angle)) / np.radians(30), 0, 1)


def leishman_beddoes(airfoil, number, alpha, steady, states, lags=(1.7, 3.0, 6.0, 11.0)):
    """Return what the states of a section add to its lift and drag coefficients, and their rates per semi-chord.

    The times are those of pressure, separation, vortex and its passage.
    """
    share, pressure, vortex, age = states
    slope, no_lift = attached_line(airfoil, number)
    window = stall_window(alpha - no_lift)
    attached = window * slope * (alpha - no_lift)
    normal, staying = late_lift(airfoil, number, alpha, steady, share)
    normal = normal + window * vortex
    share_rate, pressure_rate = (staying - share) / (lags[0] + lags[1]), (attached - pressure) / lags[0]
    root = np.sqrt(max(share, 1e-4))
    growth = pressure_rate * (1 - (1 + root) ** 2 / 4) - pressure * share_rate * (1 + root) / (4 * root)
    ends = [
        np.interp(
            number,
            airfoil.numbers,
            [np.interp(end, airfoil.alpha, cl) for end, cl in zip(own, airfoil.cl, strict=True)],
        )
        for own in airfoil.stall[1:3]
    ]
    sheds = pressure > ends[0] or pressure < ends[1]
    feeds = sheds and age < lags[3] and growth * pressure > 0
    rates = [share_rate, pressure_rate, (growth if feeds else 0.0) - vortex / lags[2]]
    rates.append((1.0 if age < lags[3] else 0.0) if sheds else -age / lags[0])
    return normal * np.cos(alpha), normal * np.sin(alpha), rates


def has_wake(rotor):
    """Return whether its circulation follows the flow late (section 4.9)."""
    return getattr(rotor, "unsteady_airfoil", "steady") == "jones"


def has_offsets(rotor):
    """Return whether quarter chord or mass are off the pitch axis, or the axis off the flap hinge."""
    return getattr(rotor, "has_offsets", False)


def undersling_of(rotor):
    """Return by how much the blade's axis passes outboard of the flap hinge and over it [m], eq. (3.12)."""
    return -rotor.undersling * np.sin(rotor.flap_rest), -rotor.undersling * np.cos(rotor.flap_rest)


def offset_mass_points(rotor):
    """Return points (s, along the chord, normal to it) [m] and masses [kg]: a sum over many, piece by piece."""
    length, shift = rotor.radius - rotor.hinge_offset, undersling_of(rotor)[0]
    knots = {0.0, length}
    for name in ("mass", "centre", "twist"):
        stations = getattr(rotor, f"{name}_stations")
        knots |= {s * rotor.radius - rotor.hinge_offset for s in ([] if stations is None else stations)}
    knots = [s for s in sorted(knots) if 0.0 <= s <= length]
    nodes, weights = np.polynomial.legendre.leggauss(7)
    places = [(a + b) / 2 + (b - a) / 2 * x for a, b in pairwise(knots) for x in nodes]
    widths = [(b - a) / 2 * w for a, b in pairwise(knots) for w in weights]
    if rotor.mass_stations is not None:
        masses = [w * along_blade(rotor, "mass", s) for s, w in zip(places, widths, strict=True)]
        places, masses = [*places, length], [*masses, rotor.tip_mass]
    else:  # the parabola with the integrals that the file gives
        powers = [
            [sum(w * s ** (i + k) for s, w in zip(places, widths, strict=True)) for k in range(3)] for i in range(3)
        ]
        integrals = [rotor.blade_mass, rotor.blade_mass * rotor.blade_cg, flap_inertia(rotor)]
        factors = np.linalg.solve(powers, integrals)
        masses = [w * (factors @ [1.0, s, s * s]) for s, w in zip(places, widths, strict=True)]
    points = []
    for s, mass in zip(places, masses, strict=True):
        offset, twist = offset_at(rotor, "centre", s), along_blade(rotor, "twist", s)
        points.append(((s + shift, offset * np.cos(twist), offset * np.sin(twist)), mass))
    return points


def offset_at(rotor, name, s):
    """Return the offset of the quarter chord or of the centre of gravity at a station [m], 0 where none is given."""
    given = getattr(rotor, f"{name}_root"), getattr(rotor, f"{name}_stations")
    return 0.0 if all(value is None for value in given) else along_blade(rotor, name, s)


def stands(ac):
    """Return whether the rotors stand on something (section 5.10)."""
    return getattr(ac.body, "is_stand", False)


def body_mass(ac):
    """Return mass, first moment and inertia, about the body origin, of what the body's equations carry.

    With `complete` coupling that is the fuselage: the printed totals minus the blades, undeflected and
    averaged over azimuth. The printed centre of gravity is the origin, so the fuselage alone has minus the
    blades' first moment. With `paper` coupling it is the printed total.

    Returns
    -------
    mass : float
        [kg]
    first_moment : array, shape (3,)
        [kg m], body axes.
    inertia : array, shape (3, 3)
        [kg m^2], body axes, about the origin.
    """
    if stands(ac):
        return 0.0, np.zeros(3), np.diag(ac.body.stand_mass[3:])
    mass, first_moment, inertia = ac.body.mass, np.zeros(3), np.array(ac.body.inertia, dtype=float)
    if ac.options.coupling == "paper":
        return mass, first_moment, inertia
    for rotor in ac.rotors:
        x_hub, y_hub = hub_axes(rotor.shaft_direction)
        # Four azimuths average second-order harmonics exactly, and the inertia has none higher.
        for azimuth in (0.0, np.pi / 2, np.pi, 3 * np.pi / 2):
            span = -np.cos(azimuth) * x_hub + rotor.rotation * np.sin(azimuth) * y_hub
            for point, point_mass in mass_points(rotor):
                share = point_mass * rotor.blades / 4
                s, along, up = point if isinstance(point, tuple) else (point, 0.0, 0.0)
                up += undersling_of(rotor)[1] if has_offsets(rotor) else 0.0
                ahead = np.sin(azimuth) * x_hub + rotor.rotation * np.cos(azimuth) * y_hub
                r = np.asarray(rotor.hub) + (rotor.hinge_offset + s) * span + along * ahead + up * rotor.shaft_direction
                mass = mass - share
                first_moment = first_moment - share * r
                inertia = inertia - share * (r @ r * np.eye(3) - np.outer(r, r))
    return mass, first_moment, inertia


# ------------------------------------------------------------------------------------------------------------
# Blade kinematics (theory.md section 2)
# ------------------------------------------------------------------------------------------------------------


class Blade(NamedTuple):
    """One blade at one instant: angles [rad], rates [rad/s], then unit vectors and angular velocities."""

    rotor: object
    azimuth: float
    flap: float
    flap_rate: float
    lag: float
    lag_rate: float
    u: np.ndarray
    e_y: np.ndarray
    y: np.ndarray
    t: np.ndarray
    d: np.ndarray
    n: np.ndarray
    f: np.ndarray
    body_rate: np.ndarray
    w_hub: np.ndarray
    w_lag: np.ndarray
    w_blade: np.ndarray
    pitch: tuple = (0.0, 0.0, 0.0, 0.0)  # [rad], its rate, and its first and second derivative by the azimuth

    @property
    def lag_arm(self):
        """Vector from the axis to the lag hinge [m], length e_L = e_0 - e_F."""
        return (self.rotor.hinge_offset - self.rotor.flap_hinge_offset) * self.e_y

    @property
    def flap_arm(self):
        """Vector from the lag hinge to the flap hinge [m], length e_F."""
        return self.rotor.flap_hinge_offset * self.y

    def position(self, s):
        """Return the point at station s [m] relative to the hub [m], body axes."""
        return self.lag_arm + self.flap_arm + self.arm(s)

    def fixed_arm(self, point):
        """Return the part of the way from the flap hinge to a point that does not turn with the pitch [m]."""
        if not isinstance(point, tuple):
            return point * self.d
        return point[0] * self.d + undersling_of(self.rotor)[1] * self.n

    def pitched_arm(self, point):
        """Return the part that does [m]: along the chord of zero twist, and normal to it."""
        if not isinstance(point, tuple):
            return np.zeros(3)
        c, s = np.cos(self.pitch[0]), np.sin(self.pitch[0])
        return (point[1] * c - point[2] * s) * self.t + (point[1] * s + point[2] * c) * self.n

    def arm(self, point):
        """Return the way from the flap hinge to a point [m]: its distance, or with those along and across the chord."""
        return self.fixed_arm(point) + self.pitched_arm(point)

    @property
    def w_pitch(self):
        """Angular velocity of the pitch, leading edge up [rad/s]."""
        return self.rotor.rotation * self.pitch[1] * self.d

    def velocity(self, s, hub_velocity):
        """Return the velocity [m/s] of the point at station s, body axes, in the frame of `hub_velocity`."""
        return (
            hub_velocity
            + cross(self.w_hub, self.lag_arm)
            + cross(self.w_lag, self.flap_arm)
            + cross(self.w_blade, self.arm(s))
            + cross(self.w_pitch, self.pitched_arm(s))
        )

    def acceleration(self, s, hub_acceleration, body_rate_dot, flap_dd, lag_dd):
        """Return the inertial acceleration [m/s^2] of the point at station s, body axes.

        Parameters
        ----------
        s : float
            Station from the flap hinge [m].
        hub_acceleration : array, shape (3,)
            Inertial acceleration of the hub [m/s^2].
        body_rate_dot : array, shape (3,)
            om' [rad/s^2].
        flap_dd, lag_dd : float
            beta'' and xi'' of the blade, in the rotating frame [rad/s^2].
        """
        g, omega = self.rotor.rotation, self.rotor.speed
        alpha_hub = body_rate_dot + cross(self.body_rate, g * omega * self.u) + g * speed_rate(self.rotor) * self.u
        alpha_lag = alpha_hub - g * lag_dd * self.u - g * self.lag_rate * cross(self.w_hub, self.u)
        alpha_blade = alpha_lag + flap_dd * self.f + self.flap_rate * cross(self.w_lag, self.f)
        arm, pitched = self.fixed_arm(s), self.pitched_arm(s)
        w = self.w_blade + self.w_pitch
        pitch_dd = self.pitch[3] * omega**2 + self.pitch[2] * speed_rate(self.rotor)
        pitch_dd -= self.rotor.pitch_flap_coupling * flap_dd + self.rotor.pitch_lag_coupling * lag_dd
        alpha = alpha_blade + g * pitch_dd * self.d + cross(self.w_blade, self.w_pitch)
        return (
            hub_acceleration
            + cross(alpha_hub, self.lag_arm)
            + cross(self.w_hub, cross(self.w_hub, self.lag_arm))
            + cross(alpha_lag, self.flap_arm)
            + cross(self.w_lag, cross(self.w_lag, self.flap_arm))
            + cross(alpha_blade, arm)
            + cross(self.w_blade, cross(self.w_blade, arm))
            + cross(alpha, pitched)
            + cross(w, cross(w, pitched))
        )


def speed_rate(rotor):
    """Return Omega' [rad/s^2], which is given: 0 for rotors that have no such attribute."""
    return getattr(rotor, "speed_rate", 0.0)


def blade_inflow_speed(rotor):
    """Scale of the inflow that the blades meet, which is more than momentum theory says."""
    return rotor.induced_power_factor * inflow_speed(rotor)


def inflow_speed(rotor):
    """Return the speed that makes velocities of inflow ratios [rad/s], where it is not that of the rotor."""
    return getattr(rotor, "inflow_speed", rotor.speed)


def make_blade(rotor, azimuth, flap, flap_rate, lag, lag_rate, body_rate):
    """Return the `Blade` at an azimuth [rad], from angles [rad], their rates and the body rate [rad/s]."""
    g = rotor.rotation
    u = np.asarray(rotor.shaft_direction, dtype=float)
    x_hub, y_hub = hub_axes(u)
    e_y = -np.cos(azimuth) * x_hub + g * np.sin(azimuth) * y_hub
    e_t = np.sin(azimuth) * x_hub + g * np.cos(azimuth) * y_hub
    y = np.cos(lag) * e_y - np.sin(lag) * e_t
    t = np.sin(lag) * e_y + np.cos(lag) * e_t
    d = np.cos(flap) * y + np.sin(flap) * u
    n = -np.sin(flap) * y + np.cos(flap) * u
    f = -g * t
    w_hub = body_rate + g * rotor.speed * u
    w_lag = w_hub - g * lag_rate * u
    w_blade = w_lag + flap_rate * f
    return Blade(
        rotor,
        azimuth,
        flap,
        flap_rate,
        lag,
        lag_rate,
        u,
        e_y,
        y,
        t,
        d,
        n,
        f,
        body_rate,
        w_hub,
        w_lag,
        w_blade,
    )


def make_blades(ac, state, psi, swash=None):
    """Return, per rotor, the list of its `Blade`s, from the split state, azimuths psi and swashplate angles [rad]."""
    rotors = []
    swash = np.zeros((len(ac.rotors), 3)) if swash is None else swash
    for j, rotor in enumerate(ac.rotors):
        transform = multiblade_matrix(rotor.blades, psi[j])
        transform_dot = rotor.speed * multiblade_matrix(rotor.blades, psi[j], 1)
        flap, lag = transform @ state.flap[j], transform @ state.lag[j]
        flap_rate = transform @ state.flap_rate[j] + transform_dot @ state.flap[j]
        lag_rate = transform @ state.lag_rate[j] + transform_dot @ state.lag[j]
        azimuths = blade_azimuths(rotor.blades, psi[j])
        own = [
            make_blade(rotor, azimuths[k], flap[k], flap_rate[k], lag[k], lag_rate[k], state.rate)
            for k in range(rotor.blades)
        ]
        rotors.append([blade._replace(pitch=pitch_of(blade, swash[j])) for blade in own])
    return rotors


def pitch_of(blade, swash):
    """Return pitch [rad], its rate [rad/s], and its derivatives by the azimuth."""
    swing, g = blade.azimuth + blade.rotor.swashplate_phase, blade.rotor.rotation
    slope = swash[1] * g * np.sin(swing) - swash[2] * np.cos(swing)
    return (*hinge_pitch(blade, swash), slope, swash[1] * g * np.cos(swing) + swash[2] * np.sin(swing))


# ------------------------------------------------------------------------------------------------------------
# Air loads (theory.md sections 4 and 5)
# ------------------------------------------------------------------------------------------------------------


def airfoil_coefficients(airfoil, number, alpha, interpolation):
    """Return cl, cd: linear in Reynolds or Mach number (clamped), periodic and "linear" or "smooth" in alpha [rad].

    The table's cl and cd have shape (number of Reynolds or Mach numbers, number of angles).
    """
    numbers = np.asarray(airfoil.numbers, dtype=float)
    table_alpha = np.asarray(airfoil.alpha, dtype=float)
    alpha = (alpha - table_alpha[0]) % (2 * np.pi) + table_alpha[0]
    along = {"linear": np.interp, "smooth": monotone_cubic}[interpolation]
    cl_of_number = [along(alpha, table_alpha, row) for row in airfoil.cl]
    cd_of_number = [along(alpha, table_alpha, row) for row in airfoil.cd]
    return np.interp(number, numbers, cl_of_number), np.interp(number, numbers, cd_of_number)


def monotone_cubic(x, knots, values):
    """Return the value at x of the cubic Hermite interpolant of periodic values (section 4.4)."""
    count = len(knots) - 1
    j = min(int(np.searchsorted(knots, x, side="right")) - 1, count - 1)
    widths = [knots[(j + i) % count + 1] - knots[(j + i) % count] for i in (-1, 0, 1)]
    rises = [values[(j + i) % count + 1] - values[(j + i) % count] for i in (-1, 0, 1)]
    slopes = [limited_slope(*rises[i : i + 2], *widths[i : i + 2]) for i in (0, 1)]
    return CubicHermiteSpline(knots[j : j + 2], values[j : j + 2], slopes)(x)


def limited_slope(rise, next_rise, width, next_width):
    """Return the middle slope of the parabola through three points: none at a turn, at most thrice that of a side."""
    if rise * next_rise <= 0:
        return 0.0
    before, after = rise / width, next_rise / next_width
    parabola = before + (after - before) * width / (width + next_width)
    return np.sign(parabola) * min(abs(parabola), 3 * abs(before), 3 * abs(after))


def along_blade(rotor, name, s):
    """Return the chord [m] or twist [rad] at the station s from the flap hinge [m] (section 4.1)."""
    stations, values = getattr(rotor, f"{name}_stations"), getattr(rotor, f"{name}_values")
    if stations is None:
        root, tip = getattr(rotor, f"{name}_root"), getattr(rotor, f"{name}_tip")
        return root + (tip - root) * s / (rotor.radius - rotor.hinge_offset)
    share = min(max((rotor.hinge_offset + s) / rotor.radius, stations[0]), stations[-1])
    points = pairwise(zip(stations, values, strict=True))
    (inner, first), (outer, last) = next(pair for pair in points if share <= pair[1][0])
    return first + (last - first) * (share - inner) / (outer - inner)


def airfoil_at(ac, rotor, radius):
    """Return the airfoil table at a share of the radius: the last one that begins inboard of it.

    Tables of an aircraft belong to its rotors, with the drag that each adds; without rotors of their own to names.
    """
    stations = getattr(rotor, "outboard_stations", None)
    inboard = 0 if stations is None else sum(radius >= station for station in stations)
    if hasattr(ac, "sections"):
        return ac.sections[[one.name for one in ac.rotors].index(rotor.name)][inboard]
    return ac.airfoils[(rotor.airfoil, *(getattr(rotor, "outboard_airfoils", None) or ()))[inboard]]


def hinge_pitch(blade, swash):
    """Return the pitch at the hinge [rad] and its rate [rad/s] while the swashplate stands still (section 4.5)."""
    rotor, swing = blade.rotor, blade.azimuth + blade.rotor.swashplate_phase
    pitch = swash[0] - swash[1] * rotor.rotation * np.cos(swing) - swash[2] * np.sin(swing)
    rate = rotor.speed * (swash[1] * rotor.rotation * np.sin(swing) - swash[2] * np.cos(swing))
    return (
        pitch - rotor.pitch_flap_coupling * blade.flap - rotor.pitch_lag_coupling * blade.lag,
        rate - rotor.pitch_flap_coupling * blade.flap_rate - rotor.pitch_lag_coupling * blade.lag_rate,
    )


def circulation(ac, blade, swash, inflow, air_velocity_hub, parts, air_gradient=None):
    """Return the rates [1/s] of the two parts of a blade's circulation, and the wash of its wake at the tip [m/s].

    `parts`, shape (2,), are those of the blade itself; the other parameters are those of `blade_air_loads`.
    """
    rotor = blade.rotor
    s, tip_speed = 0.75 * rotor.radius - rotor.hinge_offset, inflow_speed(rotor) * rotor.radius
    velocity = blade.velocity(s, air_velocity_hub)
    if air_gradient is not None:
        velocity = velocity - air_gradient @ blade.position(s)
    cyclic = inflow[2] * np.cos(blade.azimuth) + inflow[1] * np.sin(blade.azimuth)
    u_t = velocity @ blade.t
    u_p = velocity @ blade.n + blade_inflow_speed(rotor) * rotor.radius * (inflow[0] + 0.75 * cyclic) * np.cos(
        blade.flap
    )
    airfoil = airfoil_at(ac, rotor, 0.75)
    lift = airfoil.cl[len(airfoil.numbers) // 2]
    near = np.abs(airfoil.alpha) < 0.35
    no_lift = np.interp(0.0, lift[near], airfoil.alpha[near])
    angle = hinge_pitch(blade, swash)[0] + along_blade(rotor, "twist", s) - no_lift
    across = (u_t * np.sin(angle) - u_p * np.cos(angle)) / tip_speed
    speed = np.hypot(u_t, u_p)
    speed *= max(1.0 - (speed / ac.environment.speed_of_sound) ** 2, 0.19)
    late = across - parts
    rates = 2.0 * speed / along_blade(rotor, "chord", s) * np.array([0.0455, 0.3]) * late
    return rates, tip_speed * np.array([0.165, 0.335]) @ late / 0.75


def blade_air_loads(ac, blade, swash, inflow, air_velocity_hub, air_gradient=None, wake=0.0, stall=None, rates=None):
    """Return the aerodynamic force of every element of a blade.

    Parameters
    ----------
    ac : aircraft
    blade : Blade
    swash : array, shape (3,)
        theta0, A1s, B1s of the rotor [rad].
    inflow : array, shape (3,)
        lambda0, lambdas, lambdac [-].
    air_velocity_hub : array, shape (3,)
        Velocity of the hub relative to the undisturbed air [m/s], body axes.
    air_gradient : array, shape (3, 3), or None
        Change of the air's velocity per metre from the hub within the disc [1/s], body axes: velocity = it @ position.
    wake : float
        Wash of the blade's wake at the tip [m/s], which grows along the radius.
    stall : array, shape (states, elements), optional
        Of its sections, of late separation: attached shares of the chord, and with a vortex three more.
    rates : list, optional
        Output, with `stall`: their rates [1/s], a list of each section.

    Returns
    -------
    list of (float, array of shape (3,))
        Station s of the element's middle from the flap hinge [m] and its force [N], body axes.
    """
    rotor, air = blade.rotor, ac.environment
    length = rotor.radius - rotor.hinge_offset
    edges = np.linspace(rotor.root_cutout, length, ac.options.elements + 1)
    lambda0, lambdas, lambdac = inflow
    loads = []
    for inner, outer in pairwise(edges):
        s, ds = (inner + outer) / 2, outer - inner
        chord = along_blade(rotor, "chord", s)
        pitch = hinge_pitch(blade, swash)[0] + along_blade(rotor, "twist", s)
        point = s
        if has_offsets(rotor):
            offset, twist = offset_at(rotor, "quarter", s), along_blade(rotor, "twist", s)
            point = (s + undersling_of(rotor)[0], offset * np.cos(twist), offset * np.sin(twist))
        velocity = blade.velocity(point, air_velocity_hub)
        if air_gradient is not None:
            velocity = velocity - air_gradient @ blade.position(point)
        cyclic = lambdac * np.cos(blade.azimuth) + lambdas * np.sin(blade.azimuth)
        induced = (
            blade_inflow_speed(rotor)
            * rotor.radius
            * (lambda0 + (rotor.hinge_offset + span_of(point)) / rotor.radius * cyclic)
        ) + wake * (rotor.hinge_offset + span_of(point)) / rotor.radius
        if has_offsets(rotor):
            loads.append((point, swept_force(ac, blade, inner, outer, pitch, velocity + induced * blade.u)))
            continue
        u_t = velocity @ blade.t
        u_p = velocity @ blade.n + induced * np.cos(blade.flap)
        # The section sees the flow across the span only: |V| is the speed in the plane of t and n.
        speed = np.hypot(u_t, u_p)
        airfoil = airfoil_at(ac, rotor, (rotor.hinge_offset + s) / rotor.radius)
        number = speed / air.speed_of_sound if airfoil.axis == "mach" else speed * chord / air.kinematic_viscosity
        alpha = pitch - np.arctan2(u_p, u_t)
        cl, cd = airfoil_coefficients(airfoil, number, alpha, ac.options.interpolation)
        states, late_drag = None if stall is None else stall[:, len(loads)], 0.0
        if states is not None and has_stall_vortex(rotor):
            late, late_drag, own = leishman_beddoes(airfoil, number, alpha, cl, states, rotor.stall_lags)
            cl = cl + late
            rates.append(2 * speed / chord * np.array(own))
        elif states is not None and has_late_separation(rotor):
            late, staying = late_lift(airfoil, number, alpha, cl, states[0])
            cl = cl + late
            rates.append([speed / (4 * chord) * (staying - states[0]), *np.zeros(len(states) - 1)])
        elif states is not None:
            rates.append(np.zeros(len(states)))
        lifting_edge = rotor.tip_loss * rotor.radius - rotor.hinge_offset
        cl = cl * np.clip((lifting_edge - inner) / ds, 0.0, 1.0)
        if rotor.tip_loss_model == "prandtl":
            through = blade_inflow_speed(rotor) * rotor.radius * lambda0 + blade.u @ air_velocity_hub
            points = rotor.hinge_offset + s + ds / np.sqrt(12) * np.array([-1.0, 1.0])  # Gauss
            cl = cl * prandtl(rotor, points / rotor.radius, through / (rotor.speed * rotor.radius)).mean()
        u_r = velocity @ blade.d + induced * np.sin(blade.flap) if rotor.profile_drag == "oblique" else 0.0
        pressure = 0.5 * air.air_density * chord * ds
        force = pressure * speed * cl * (u_t * blade.n - u_p * blade.t)
        oblique = np.hypot(speed, u_r)
        force = force - pressure * oblique * cd * (u_p * blade.n + u_t * blade.t + u_r * blade.d)
        force = force - pressure * speed * late_drag * (u_p * blade.n + u_t * blade.t)
        loads.append((s, force))
    return loads


def span_of(point):
    """Return the distance of a point from the flap hinge along the span [m]."""
    return point[0] if isinstance(point, tuple) else point


def swept_force(ac, blade, inner, outer, pitch, velocity):
    """Return the force [N] of an element from inner to outer, whose section lies across its quarter-chord line.

    `velocity` is that of the quarter chord relative to the air there, the induced one included; the angle of attack is
    that between it and the chord, in the plane across the line.
    """
    rotor, air = blade.rotor, ac.environment
    s, ds, step = (inner + outer) / 2, outer - inner, 1e-7
    length = rotor.radius - rotor.hinge_offset
    slope = (offset_at(rotor, "quarter", s + step) - offset_at(rotor, "quarter", s - step)) / (2 * step)
    if rotor.quarter_stations is None:  # exactly
        slope = (offset_at(rotor, "quarter", length) - offset_at(rotor, "quarter", 0.0)) / length
    else:
        places = rotor.quarter_stations * rotor.radius - rotor.hinge_offset
        pieces = zip(pairwise(places), pairwise(rotor.quarter_values), strict=True)
        slope = sum((d - c) / (b - a) for (a, b), (c, d) in pieces if a <= s < b)
    chord_line = np.cos(pitch) * blade.t + np.sin(pitch) * blade.n
    up = np.cos(pitch) * blade.n - np.sin(pitch) * blade.t
    tangent = (blade.d + slope * chord_line) / np.sqrt(1 + slope**2)
    across = (chord_line - slope * blade.d) / np.sqrt(1 + slope**2)
    assert abs(tangent @ across) < 1e-12
    u_across, u_up = velocity @ across, velocity @ up
    speed = np.hypot(u_across, u_up)
    chord = along_blade(rotor, "chord", s)
    airfoil = airfoil_at(ac, rotor, (rotor.hinge_offset + s) / rotor.radius)
    cl, cd = airfoil_coefficients(
        airfoil,
        speed / air.speed_of_sound
        if airfoil.axis == "mach"
        else speed * chord / np.sqrt(1 + slope**2) / air.kinematic_viscosity,
        -np.arctan2(u_up, u_across),
        ac.options.interpolation,
    )
    cl = cl * np.clip((rotor.tip_loss * rotor.radius - rotor.hinge_offset - inner) / ds, 0.0, 1.0)
    pressure = 0.5 * air.air_density * chord * speed * ds
    return pressure * ((cl * u_across - cd * u_up) * up - (cl * u_up + cd * u_across) * across)


def prandtl(rotor, share, inflow):
    """Prandtl's tip loss at shares of the radius, for a flow through the disc over the tip speed."""
    distance = 2 * np.pi * abs(inflow) / np.sqrt(1 + inflow**2) / rotor.blades  # of the vortex sheets
    return 2 / np.pi * np.arccos(np.exp(-np.pi * (1 - share) / distance))


def flat_plate_force(ac, air_velocity):
    """Return the fuselage's force [N] at the origin from its velocity relative to the air [m/s]."""
    areas = np.asarray(ac.body.flat_plate_areas, dtype=float)
    return -0.5 * ac.environment.air_density * areas * np.abs(air_velocity) * air_velocity


# ------------------------------------------------------------------------------------------------------------
# Inflow (theory.md section 6)
# ------------------------------------------------------------------------------------------------------------


#: Castles and Gray, NACA TN 2474, Fig. 12: rate of descent and induced velocity over that of momentum theory in hover.
CASTLES_GRAY = np.array(
    [[0, 1.1], [0.4, 1.41], [0.8, 1.8], [1.2, 2.24], [1.5, 2.5], [1.6, 2.28], [1.8, 1.68], [2, 1.37], [2.4, 0.95]]
)
WINDMILL = 8.0  # rate of descent over the induced velocity from which on momentum theory holds again


def measured_flow(lambda0, mu_z):
    """Return the axial flow of the measured line, and its slope by lambda0."""
    inflow = CASTLES_GRAY[:, 1] / CASTLES_GRAY[0, 1]
    x = np.append(CASTLES_GRAY[:, 0] / inflow, WINDMILL)
    y = np.append(inflow**-2.0, WINDMILL - 1.0)
    rises = np.diff(y) / np.diff(x)
    slopes = np.gradient(y, x)  # of parabolas
    bounds = 3.0 * np.minimum(np.abs(rises[1:]), np.abs(rises[:-1])) * (rises[1:] * rises[:-1] > 0)
    slopes[1:-1] = np.clip(slopes[1:-1], -bounds, bounds)
    slopes[[0, -1]] = -1.0, 1.0
    curve, at = CubicHermiteSpline(x, y, slopes), mu_z / lambda0
    return lambda0 * curve(at), curve(at) - at * curve(at, 1)


def axial_flow(rotor, lambda0, mu_z):
    """Return the axial flow through a disc, over the tip speed, and its slope by lambda0."""
    if rotor.descent == "measured" and 0.0 < mu_z / (lambda0 or np.inf) < WINDMILL:
        return measured_flow(lambda0, mu_z)
    return lambda0 - mu_z, 1.0


def ring_of(ac, rotor, lambda0, air_velocity_hub, through, noise):
    """Return what the noise of a vortex ring takes of the thrust coefficient, and the part of lambda0 that takes it."""
    tip_speed = inflow_speed(rotor) * rotor.radius
    u = np.asarray(rotor.shaft_direction, dtype=float)
    mu_z = -u @ air_velocity_hub / tip_speed - through
    edgewise = np.linalg.norm(air_velocity_hub - (u @ air_velocity_hub) * u) / tip_speed
    total = np.hypot(edgewise, axial_flow(rotor, lambda0, mu_z)[0])
    if getattr(rotor, "ring_unsteadiness", 0.0) == 0.0 or lambda0 * total <= 0.0:
        return 0.0, 0.0
    hover = np.sqrt(lambda0 * total)  # sqrt(C_T / 2) of the steady inflow
    missing = 2 * hover**2 * ring_shares(noise, rotor, mu_z / hover, edgewise / hover)
    return missing, added_inflow(ac, rotor, missing)


def inflow_rate(ac, rotor, blades, air_loads, inflow, air_velocity_hub, cyclic_inflow, through=0.0, missing=0.0):
    """Return d/dt of lambda0, lambdas, lambdac [1/s], Peters and HaQuang's three states.

    Without cyclic inflow the equation left is momentum theory's, M00 lambda0'/Omega + V_T lambda0 / L00 =
    C_T: the cyclic states are taken out of the gain matrix Lt itself. (Setting them to zero after its
    inversion would leave (Lt^-1)00, which vanishes at high advance ratio.)

    Parameters
    ----------
    ac : aircraft
    rotor : rotor of the aircraft
    blades : list of Blade
    air_loads : list over blades of lists of (s, force)
    inflow : array, shape (3,)
        lambda0, lambdas, lambdac [-].
    air_velocity_hub : array, shape (3,)
        [m/s], body axes.
    cyclic_inflow : bool
    through : float
        What other rotors add to the flow through the disc, over the tip speed.
    missing : float
        What the noise of the vortex ring takes of the thrust coefficient.

    Returns
    -------
    array, shape (3,)
    """
    g, omega, radius = rotor.rotation, inflow_speed(rotor), rotor.radius
    tip_speed = omega * radius
    u = np.asarray(rotor.shaft_direction, dtype=float)
    x_hub, y_hub = hub_axes(u)

    force_scale = ac.environment.air_density * np.pi * radius**2 * tip_speed**2
    if force_scale == 0:  # a vacuum: no loads, and coefficients without a meaning
        force_scale = 1.0
    thrust = moment_c = moment_s = 0.0
    for blade, elements in zip(blades, air_loads, strict=True):
        for s, force in elements:
            r = rotor.hinge_offset + span_of(s)
            thrust += u @ force
            moment_c += r * (blade.n @ force) * np.cos(blade.azimuth)
            moment_s += r * (blade.n @ force) * np.sin(blade.azimuth)
    coefficients = np.array([thrust, moment_c / radius, moment_s / radius]) / force_scale

    met = met_velocity(rotor, air_velocity_hub)
    mu_x, mu_y = x_hub @ met / tip_speed, y_hub @ met / tip_speed
    mu_z = -u @ air_velocity_hub / tip_speed - through
    lambda0 = inflow[0]
    mu2 = mu_x**2 + mu_y**2
    lam, slope = axial_flow(rotor, lambda0, mu_z)
    coefficients[0] += missing
    v_t = np.sqrt(mu2 + lam**2 + INFLOW_SPEED_FLOOR**2)
    v_m = (mu2 + lam * (lam + lambda0 * slope)) / v_t
    x_c = mu_x / (v_t + abs(lam))
    x_s = -g * mu_y / (v_t + abs(lam))
    x2 = x_c**2 + x_s**2
    k = 15 * np.pi / 64
    gain = np.array(  # order 0, c, s
        [
            [2 * (rotor.duct_exit or rotor.duct_expansion) ** 2, -k * x_c, -k * x_s],
            [k * x_c, 2 * (1 + x2) - 4 * x_c**2, -4 * x_c * x_s],
            [k * x_s, -4 * x_c * x_s, 2 * (1 + x2) - 4 * x_s**2],
        ]
    )
    mass = np.array([8 / (3 * np.pi), 16 / (45 * np.pi), 16 / (45 * np.pi)])
    lambdas_0cs = np.array([lambda0, inflow[2], inflow[1]])
    drain = np.array([v_t, v_m, v_m]) * np.linalg.solve(gain, lambdas_0cs)
    if not cyclic_inflow:
        drain[0] = v_t * lambda0 / gain[0, 0]
    if rotor.duct_exit is not None:
        met_by_duct = air_velocity_hub + tip_speed * through * u
        drain[0] = duct_pressures(ac, rotor, lambda0, met_by_duct)[0] / force_scale
    rate_0, rate_c, rate_s = omega * (coefficients - drain) / mass
    return np.array([rate_0, rate_s * cyclic_inflow, rate_c * cyclic_inflow])


# ------------------------------------------------------------------------------------------------------------
# The coupled system (theory.md sections 3 and 5)
# ------------------------------------------------------------------------------------------------------------


class Instant(NamedTuple):
    """All that the equations need besides the accelerations."""

    ac: object
    lead_lag: bool
    body_mass: tuple  # mass, first moment, inertia of `body_mass`
    gravity: np.ndarray  # body axes [m/s^2]
    body_rate: np.ndarray  # [rad/s]
    fuselage_force: np.ndarray  # aerodynamic, of plates, surfaces and tables [N]
    fuselage_moment: np.ndarray  # about the origin [N m]
    blades: list  # over rotors of lists of Blade
    air_loads: list  # over rotors, over blades, of lists of (s, force)
    pitches: list  # over rotors, over blades, of pairs: pitch at the hinge [rad] and its rate [rad/s]
    state: object  # `split_state`
    hub_velocities: list  # over rotors, relative to the air, body axes [m/s]
    washes: list  # over rotors, see `plain_interference`
    wake_rates: list  # over rotors, of arrays (N_b, 2), of the blades' parts of the circulation [1/s]
    wake_washes: list  # over rotors, of lists over blades: wash of the blade's wake at the tip [m/s]
    missing: list  # over rotors, of the thrust coefficient in a vortex ring
    separation_rates: list  # over rotors, over blades, of lists over sections [1/s]
    conings: list  # over rotors, of pairs: mean flap angle [rad] and rate [rad/s]


def unpack(instant, unknowns):
    """Split the unknowns into a_O (3,), om' (3,), and lists over rotors of beta'' and xi'' (N_b,), per blade.

    a_O = U' + om x U is the inertial acceleration of the body origin.
    """
    flap_dd, lag_dd, start = [], [], 6
    for rotor in instant.ac.rotors:
        flap_dd.append(unknowns[start : start + rotor.blades])
        start += rotor.blades
        if instant.lead_lag:
            lag_dd.append(unknowns[start : start + rotor.blades])
            start += rotor.blades
        else:
            lag_dd.append(np.zeros(rotor.blades))
    return unknowns[0:3], unknowns[3:6], flap_dd, lag_dd


def hub_motion(instant, rotor, origin_acceleration, body_rate_dot):
    """Return the hub's linear and the body's angular acceleration as the blades see them.

    `paper` coupling neglects both, the hub's centripetal acceleration included.
    """
    if instant.ac.options.coupling == "paper":
        return np.zeros(3), np.zeros(3)
    r, om = np.asarray(rotor.hub, dtype=float), instant.body_rate
    return origin_acceleration + cross(body_rate_dot, r) + cross(om, cross(om, r)), body_rate_dot


def hub_loads(instant, j, origin_acceleration, body_rate_dot, flap_dd, lag_dd):
    """Return force [N] and moment about the hub [N m] of rotor j's blades on the body, body axes.

    Sum over the blades' mass of dF + g dm - a dm; the blades' weight is left out with `paper` coupling, where
    the body's equations carry the total weight. The duct is not part of it.

    Returns
    -------
    force, moment : array, shape (3,)
    """
    ac, rotor = instant.ac, instant.ac.rotors[j]
    hub_acceleration, alpha = hub_motion(instant, rotor, origin_acceleration, body_rate_dot)
    weight = np.zeros(3) if ac.options.coupling == "paper" else instant.gravity
    force, moment, paper_moment = np.zeros(3), np.zeros(3), np.zeros(3)
    for k, blade in enumerate(instant.blades[j]):
        for s, element_force in instant.air_loads[j][k]:
            force += element_force
            moment += cross(blade.position(s), element_force)
            paper_moment += cross(blade.position(s), element_force)
        for s, point_mass in mass_points(rotor):
            a = blade.acceleration(s, hub_acceleration, alpha, flap_dd[k], lag_dd[k])
            force += point_mass * (weight - a)
            moment += cross(blade.position(s), point_mass * (weight - a))
        paper_moment += rotor.flap_spring * (blade.flap - rotor.flap_rest) * blade.f
        if instant.lead_lag:
            paper_moment -= flap_inertia(rotor) * flap_dd[k] * blade.f
    if ac.options.hub_moment == "paper":
        u = np.asarray(rotor.shaft_direction, dtype=float)
        moment = paper_moment - u * (u @ paper_moment) + u * (u @ moment)
    return force, moment


def aerodynamic_thrust(instant, j):
    """Return u . (sum of the aerodynamic force of rotor j's blades) [N]."""
    u = np.asarray(instant.ac.rotors[j].shaft_direction, dtype=float)
    return sum(u @ force for elements in instant.air_loads[j] for _, force in elements)


def duct_pressures(ac, rotor, lambda0, air_velocity_hub):
    """Return thrusts [N] of the rotor and of the duct along u, and the mass flow [kg/s] through both.

    Bernoulli from far upstream to the rotor, and from the rotor to the exit, where the pressure is that of the air: the
    rotor's pressure rise is the rise of the dynamic pressure and what is lost at the lip. Rotor and duct together have
    the thrust of the momentum.
    """
    density, area = ac.environment.air_density, np.pi * rotor.radius**2
    u = np.asarray(rotor.shaft_direction, dtype=float)
    climb = u @ air_velocity_hub
    edgewise = np.linalg.norm(air_velocity_hub - climb * u)
    through = inflow_speed(rotor) * rotor.radius * lambda0 + climb
    leaving = through / rotor.duct_exit
    turned = edgewise**2 - ((1 - rotor.duct_turning) * edgewise) ** 2
    slow = INFLOW_SPEED_FLOOR * inflow_speed(rotor) * rotor.radius
    steepness = 0.0 if rotor.lip_stall is None else edgewise / (rotor.lip_stall * np.hypot(through, slow))
    oncoming = climb**2 + rotor.ram_recovery * turned / (1 + steepness**4)
    share = np.clip(through / (0.25 * np.hypot(np.hypot(climb, edgewise), slow)), -1, 1)
    rise = density / 2 * (leaving * abs(leaving) - share * (3 - share**2) / 2 * oncoming)
    mass_flow = density * area * abs(through)
    return area * rise, mass_flow * (leaving - climb) - area * rise, mass_flow


def fixed_exit_load(instant, j):
    """Return force [N] and moment [N m] about the origin of a duct with a fixed exit: thrust and ram drag."""
    ac, rotor = instant.ac, instant.ac.rotors[j]
    u, hub = (np.asarray(values, dtype=float) for values in (rotor.shaft_direction, rotor.hub))
    met_by_duct = instant.hub_velocities[j] + inflow_speed(rotor) * rotor.radius * instant.washes[j].through * u
    _, thrust, mass_flow = duct_pressures(ac, rotor, instant.state.inflow[j][0], met_by_duct)
    along = instant.hub_velocities[j] - u * (u @ instant.hub_velocities[j])
    drag = -mass_flow * rotor.duct_turning * along
    return thrust * u + drag, cross(hub, thrust * u) + cross(hub + rotor.lip_arm * u, drag)


def met_velocity(rotor, air_velocity_hub):
    """Return the hub's velocity [m/s] in the air behind the lip of a duct."""
    if rotor.duct_exit is None:
        return air_velocity_hub
    u = np.asarray(rotor.shaft_direction, dtype=float)
    along = air_velocity_hub - u * (u @ air_velocity_hub)
    return air_velocity_hub - rotor.duct_turning * along


def duct_load(instant, j):
    """Return the duct's force [N] and moment [N m] about the origin.

    Without a fixed exit it is (2 a_w - 1) times the rotor's thrust at the hub along u.
    """
    rotor = instant.ac.rotors[j]
    if rotor.duct_exit is not None:
        return fixed_exit_load(instant, j)
    force = (2 * rotor.duct_expansion - 1) * aerodynamic_thrust(instant, j) * np.asarray(rotor.shaft_direction, float)
    return force, cross(np.asarray(rotor.hub, dtype=float), force)


def hinge_residuals(instant, j, k, origin_acceleration, body_rate_dot, flap_dd, lag_dd):
    """Return a blade's moments [N m] left about the flap hinge along f and the lag hinge along -G u.

    Both hinges carry their springs, the lag hinge its damper; a positive moment raises the angle.
    """
    ac, rotor, blade = instant.ac, instant.ac.rotors[j], instant.blades[j][k]
    hub_acceleration, alpha = hub_motion(instant, rotor, origin_acceleration, body_rate_dot)
    inertia = flap_inertia(rotor, rotor.radius) if ac.options.flap_inertia == "axis_to_tip" else None
    loads = list(instant.air_loads[j][k])
    for s, point_mass in mass_points(rotor, inertia):
        a = blade.acceleration(s, hub_acceleration, alpha, flap_dd, lag_dd)
        loads.append((s, point_mass * (instant.gravity - a)))
    about_flap, about_lag, feather = np.zeros(3), np.zeros(3), 0.0
    for s, load in loads:
        about_flap += cross(blade.arm(s), load)
        about_lag += cross(blade.flap_arm + blade.arm(s), load)
        feather += rotor.rotation * blade.d @ cross(blade.pitched_arm(s), load)
    flap = blade.f @ about_flap - rotor.flap_spring * (blade.flap - rotor.flap_rest)
    lag = -rotor.rotation * blade.u @ about_lag - rotor.lag_spring * (blade.lag - rotor.lag_rest)
    flap_damper, lag_damper = damper_moments(rotor, blade, instant.pitches[j][k])
    lag += lag_stop_moment(rotor, blade)
    flap, lag = flap - rotor.pitch_flap_coupling * feather, lag - rotor.pitch_lag_coupling * feather
    factor = 1.0 if rotor.blade_lag_damping is None else rotor.blade_lag_damping[k]
    return flap + factor * flap_damper, lag + factor * (lag_damper - rotor.lag_damping * blade.lag_rate)


def lag_stop_moment(rotor, blade):
    """Return the moment [N m] of the lag stops that raises the lag angle: spring and damper, that never pull."""
    if getattr(rotor, "lag_stops", None) is None:
        return 0.0
    for sign, end in zip((1.0, -1.0), reversed(rotor.lag_stops), strict=True):
        beyond, rate = sign * (blade.lag - end), sign * blade.lag_rate
        if beyond > 0:
            return -sign * max(0.0, rotor.lag_stop_spring * beyond + rotor.lag_stop_damping * rate)
    return 0.0


def feather_moment(instant, j, k, origin_acceleration, body_rate_dot, flap_dd, lag_dd):
    """Return the moment [N m] of air, weight and inertia about a blade's pitch axis, leading edge up."""
    rotor, blade = instant.ac.rotors[j], instant.blades[j][k]
    hub_acceleration, alpha = hub_motion(instant, rotor, origin_acceleration, body_rate_dot)
    loads = list(instant.air_loads[j][k])
    for s, point_mass in mass_points(rotor):
        loads.append(
            (s, point_mass * (instant.gravity - blade.acceleration(s, hub_acceleration, alpha, flap_dd, lag_dd)))
        )
    return sum(rotor.rotation * blade.d @ cross(blade.pitched_arm(s), load) for s, load in loads)


def damper_length(rotor, flap, lag, pitch):
    """Return the length of the axial lag damper [m], from the places of its ends.

    In axes that do not flap, lag or pitch, with their origin at the hinges: outboard, ahead, up. The end on the blade
    is turned by lag about the last axis and then by flap about the second.
    """
    lag = lag - rotor.lag_rest
    outboard = rotor.damper_b * np.cos(lag) + rotor.damper_d * np.sin(lag)
    ahead = rotor.damper_d * np.cos(lag) - rotor.damper_b * np.sin(lag)
    x = outboard * np.cos(flap) + rotor.damper_a * np.sin(flap) + rotor.damper_c
    y = ahead - rotor.damper_r * np.cos(pitch)
    z = rotor.damper_a * np.cos(flap) - outboard * np.sin(flap) - rotor.damper_r * np.sin(pitch)
    return np.sqrt(x**2 + y**2 + z**2)


def damper_moments(rotor, blade, pitch):
    """Return the moments [N m] of the axial damper that raise flap and lag: force times length by angle.

    `pitch` is a pair, the angle at the hinge [rad] and its rate [rad/s]; a complex step differentiates.
    """
    if rotor.damper_damping == 0:
        return 0.0, 0.0
    angles, rates = np.array([blade.flap, blade.lag, pitch[0]]), np.array([blade.flap_rate, blade.lag_rate, pitch[1]])
    by_angle = np.array([damper_length(rotor, *(angles + 1e-30j * unit)).imag / 1e-30 for unit in np.eye(3)])
    force = -rotor.damper_damping * (by_angle @ rates)
    return by_angle[0] * force, by_angle[1] * force


def residual(instant, unknowns):
    """Return what is left of all equations of motion at given accelerations: zero at the solution.

    Parameters
    ----------
    instant : Instant
    unknowns : array, shape (n,)
        a_O = U' + om x U (3) [m/s^2], om' (3) [rad/s^2], then per rotor beta'' (N_b) and, with lag, xi''
        (N_b) of the blades in the rotating frame [rad/s^2].

    Returns
    -------
    array, shape (n,)
        Force (3) [N], moment about the origin (3) [N m], then per rotor the hinge moments in the unknowns'
        order.
    """
    ac, om, g = instant.ac, instant.body_rate, instant.gravity
    origin_acceleration, body_rate_dot, flap_dd, lag_dd = unpack(instant, unknowns)
    mass, about_origin, inertia = instant.body_mass
    force = instant.fuselage_force + mass * (g - origin_acceleration)
    force = force - cross(body_rate_dot, about_origin) - cross(om, cross(om, about_origin))
    moment = cross(about_origin, g - origin_acceleration) - inertia @ body_rate_dot
    moment = moment - cross(om, inertia @ om) + instant.fuselage_moment
    hinges = []
    for j, rotor in enumerate(ac.rotors):
        hub_force, hub_moment = hub_loads(instant, j, origin_acceleration, body_rate_dot, flap_dd[j], lag_dd[j])
        duct_force, duct_moment = duct_load(instant, j)
        force = force + hub_force + duct_force
        moment = moment + hub_moment + cross(np.asarray(rotor.hub, dtype=float), hub_force) + duct_moment
        pairs = [
            hinge_residuals(instant, j, k, origin_acceleration, body_rate_dot, flap_dd[j][k], lag_dd[j][k])
            for k in range(rotor.blades)
        ]
        if getattr(rotor, "flap_hinge", "each") == "teetering":  # one hinge: equal and opposite, and the coning given
            speed, (coning, rate) = inflow_speed(rotor), instant.conings[j]
            wanted = speed**2 * (rotor.flap_rest - coning) - 2 * speed * rate
            hinges += [pairs[0][0] - pairs[1][0], (flap_dd[j][0] + flap_dd[j][1]) / 2 - wanted]
        else:
            hinges += [flap for flap, _ in pairs]
        if instant.lead_lag:
            hinges += [lag for _, lag in pairs]
    if stands(ac):
        force, moment = on_stand(instant, force, moment, origin_acceleration, body_rate_dot)
    return np.concatenate([force, moment, hinges])


def on_stand(instant, force, moment, origin_acceleration, body_rate_dot):
    """Return what is left of the equations of a stand: of a locked axis its acceleration, else loads and inertia.

    The kinetic energy of the mass is (M v) v / 2; the springs have the energy (K r) r / 2 + 2 (K q) q, where r is the
    deflection in axes of the body and q the vector part of the attitude.
    """
    body, state = instant.ac.body, instant.state
    v, om, w, q = state.velocity, state.rate, state.quaternion[0], state.quaternion[1:]
    r = rotation_matrix(state.quaternion).T @ state.position
    velocity_rate = origin_acceleration - cross(om, v)
    masses, springs, dampers = body.stand_mass[:3], body.stand_spring, body.stand_damping
    force = force - masses * velocity_rate - cross(om, masses * v) - springs[:3] * r - dampers[:3] * v
    moment = moment - cross(v, masses * v) + cross(r, springs[:3] * r) - dampers[3:] * om
    moment = moment - 2 * (w * springs[3:] * q + cross(springs[3:] * q, q))
    return (
        np.where(body.stand_free[:3] > 0, force, velocity_rate),
        np.where(body.stand_free[3:] > 0, moment, body_rate_dot),
    )


def solve_accelerations(instant):
    """Return the unknown accelerations; the residual, affine in them, gives its matrix column by column."""
    per_blade = 2 if instant.lead_lag else 1
    count = 6 + per_blade * sum(rotor.blades for rotor in instant.ac.rotors)
    constant = residual(instant, np.zeros(count))
    matrix = np.stack([residual(instant, unit) - constant for unit in np.eye(count)], axis=1)
    unknowns = np.linalg.solve(matrix, -constant)
    # A second pass takes off the rounding of the columns, which are differences of large centrifugal loads.
    return unknowns - np.linalg.solve(matrix, residual(instant, unknowns))


def make_instant(ac, x, swash, psi, wind, lead_lag=True, cyclic_inflow=True, local_air=None, ring_noise=None):
    """Return the `Instant` of a state; arguments as in `plain_derivative`."""
    state = split_state(ac, x, lead_lag, cyclic_inflow)
    attitude = rotation_matrix(state.quaternion)
    air_velocity = state.velocity - attitude.T @ np.asarray(wind, dtype=float)
    blades = make_blades(ac, state, psi, swash)
    part_force, part_moment = part_loads(ac, air_velocity, state.rate, state.inflow)
    hub_velocities = [air_velocity + cross(state.rate, np.asarray(rotor.hub, dtype=float)) for rotor in ac.rotors]
    gradients = [None] * len(ac.rotors)
    if local_air is not None:
        hub_velocities = [own - gust for own, (gust, _) in zip(hub_velocities, local_air, strict=True)]
        gradients = [disc_gradient(rotor, slope) for rotor, (_, slope) in zip(ac.rotors, local_air, strict=True)]
    washes = all_washes(ac, state.inflow, hub_velocities)
    if getattr(getattr(ac, "ground", None), "effect", "none") != "none":
        taken = ground_washes(ac, state, attitude, hub_velocities)
        washes = [wash._replace(blades=wash.blades + own) for wash, own in zip(washes, taken, strict=True)]
    if stands_on_ground(ac):
        ground = contact(ac, np.asarray(x)[: len(x) - section_count(ac)], attitude)
        part_force, part_moment = part_force + ground[0], part_moment + ground[1]
    missing = [0.0] * len(ac.rotors)
    if ring_noise is not None:
        for j, (rotor, noise) in enumerate(zip(ac.rotors, ring_noise, strict=True)):
            missing[j], added = ring_of(ac, rotor, state.inflow[j][0], hub_velocities[j], washes[j].through, noise)
            washes[j] = washes[j]._replace(blades=washes[j].blades + np.array([added, 0.0, 0.0]))
    air_loads, wake_rates, wake_washes, separation_rates = [], [], [], []
    for j, rotor in enumerate(ac.rotors):
        met, inflow = met_velocity(rotor, hub_velocities[j]), state.inflow[j] + washes[j].blades
        given, wakes = (swash[j], inflow, met), [(np.zeros(0), 0.0)] * rotor.blades
        if has_wake(rotor):
            parts = multiblade_matrix(rotor.blades, psi[j]) @ state.wake[j].T
            pairs = zip(blades[j], parts, strict=True)
            wakes = [circulation(ac, blade, *given, own, gradients[j]) for blade, own in pairs]
        wake_rates.append(np.array([rates for rates, _ in wakes]))
        wake_washes.append([wash for _, wash in wakes])
        stall, rates = state.separation[j] or [None] * rotor.blades, [[] for _ in range(rotor.blades)]
        rows = zip(blades[j], wakes, stall, rates, strict=True)
        air_loads.append(
            [blade_air_loads(ac, blade, *given, gradients[j], wash, own, out) for blade, (_, wash), own, out in rows]
        )
        separation_rates.append(rates)
    return Instant(
        ac=ac,
        lead_lag=lead_lag,
        body_mass=body_mass(ac),
        gravity=attitude.T @ np.array([0.0, 0.0, ac.environment.gravity]),
        body_rate=state.rate,
        fuselage_force=flat_plate_force(ac, air_velocity) + part_force,
        fuselage_moment=part_moment,
        blades=blades,
        air_loads=air_loads,
        pitches=[[hinge_pitch(blade, swash[j]) for blade in own] for j, own in enumerate(blades)],
        state=state,
        hub_velocities=hub_velocities,
        washes=washes,
        wake_rates=wake_rates,
        wake_washes=wake_washes,
        missing=missing,
        separation_rates=separation_rates,
        conings=[(flap[0], rate[0]) for flap, rate in zip(state.flap, state.flap_rate, strict=True)],
    )


def disc_gradient(rotor, slope):
    """Part of a gradient of the air's velocity (body axes) that is within the disc: nothing changes along the shaft."""
    u = np.asarray(rotor.shaft_direction, dtype=float)
    within = slope - np.outer(slope @ u, u)
    return np.stack([met_velocity(rotor, column) for column in within.T], axis=1)


def plain_derivative(ac, x, swash, psi, wind, lead_lag=True, cyclic_inflow=True, local_air=None, ring_noise=None):
    """Return the derivative of the state and the rotors' loads.

    Parameters
    ----------
    ac : aircraft
    x : array, shape (n,)
        State, laid out as this module's docstring says.
    swash : array, shape (n_rotors, 3)
        theta0, A1s, B1s per rotor [rad].
    psi : array, shape (n_rotors,)
        Azimuth of each rotor's first blade [rad].
    wind : array, shape (3,)
        Velocity of the air, NED [m/s].
    lead_lag, cyclic_inflow : bool
        Off: xi and its derivatives, or lambdas and lambdac, are zero as a constraint.
    local_air : list of (array of shape (3,), array of shape (3, 3)), or None
        For each rotor the velocity of the air at the hub less that at the c.g. [m/s], and its gradient [1/s], body
        axes.
    ring_noise : array of shape (n_rotors,), or None
        Of vortex rings, of variance 1.

    Returns
    -------
    dx : array, shape (n,)
        Derivative of the state by time.
    loads : dict of array
        ``thrust`` (n_rotors,) [N], u . aerodynamic force of the blades, without the duct; ``torque``
        (n_rotors,) [N m], what the drive gives to the rotor, -G u . moment; ``force`` and ``moment``
        (n_rotors, 3) [N, N m], of the blades on the body, body axes, about the hub, with the blades' weight
        in `complete` coupling and without the duct; ``duct`` (n_rotors,) [N], along u; ``flap_acceleration``
        and ``lag_acceleration``, lists of (N_b,) [rad/s^2], of the blades in the rotating frame.
    """
    state = split_state(ac, x, lead_lag, cyclic_inflow)
    instant = make_instant(ac, x, swash, psi, wind, lead_lag, cyclic_inflow, local_air, ring_noise)
    attitude = rotation_matrix(state.quaternion)
    om = state.rate
    origin_acceleration, body_rate_dot, flap_dd, lag_dd = unpack(instant, solve_accelerations(instant))

    w, vector = state.quaternion[0], state.quaternion[1:]
    quaternion_rate = 0.5 * np.concatenate([[-vector @ om], w * om + cross(vector, om)])

    flap_rates, flap_accelerations, lag_rates, lag_accelerations, inflow_rates, wake_rates = [], [], [], [], [], []
    loads = {"thrust": [], "torque": [], "force": [], "moment": [], "duct": []}
    for j, rotor in enumerate(ac.rotors):
        transform = multiblade_matrix(rotor.blades, psi[j])
        transform_d = rotor.speed * multiblade_matrix(rotor.blades, psi[j], 1)
        transform_dd = rotor.speed**2 * multiblade_matrix(rotor.blades, psi[j], 2)
        for coordinates, rates, accelerations, rate_list, acceleration_list in (
            (state.flap[j], state.flap_rate[j], flap_dd[j], flap_rates, flap_accelerations),
            (state.lag[j], state.lag_rate[j], lag_dd[j], lag_rates, lag_accelerations),
        ):
            rate_list.append(rates)
            rest = accelerations - 2 * transform_d @ rates - transform_dd @ coordinates
            rest = rest - speed_rate(rotor) * multiblade_matrix(rotor.blades, psi[j], 1) @ coordinates
            acceleration_list.append(np.linalg.solve(transform, rest))
        inflow_rates.append(
            inflow_rate(
                ac,
                rotor,
                instant.blades[j],
                instant.air_loads[j],
                state.inflow[j],
                instant.hub_velocities[j],
                cyclic_inflow,
                instant.washes[j].through,
                instant.missing[j],
            )
        )
        if has_wake(rotor):
            own = instant.wake_rates[j] - transform_d @ state.wake[j].T
            wake_rates.append(np.linalg.solve(transform, own).T.ravel())
        force, moment = hub_loads(instant, j, origin_acceleration, body_rate_dot, flap_dd[j], lag_dd[j])
        u = np.asarray(rotor.shaft_direction, dtype=float)
        loads["thrust"].append(aerodynamic_thrust(instant, j))
        torque = -rotor.rotation * u @ moment
        if has_offsets(rotor):  # the shaft pitches the blades as it turns them
            for k, blade in enumerate(instant.blades[j]):
                motion = origin_acceleration, body_rate_dot, flap_dd[j][k], lag_dd[j][k]
                torque -= blade.pitch[2] * feather_moment(instant, j, k, *motion)
        loads["torque"].append(torque)
        loads["force"].append(force)
        loads["moment"].append(moment)
        loads["duct"].append(u @ duct_load(instant, j)[0])
    dx = np.concatenate(
        [
            attitude @ state.velocity,
            quaternion_rate,
            origin_acceleration - cross(om, state.velocity),
            body_rate_dot,
            *flap_rates,
            *flap_accelerations,
            *lag_rates,
            *lag_accelerations,
            *inflow_rates,
            *wake_rates,
            *section_rates(ac, instant.separation_rates),
        ]
    )
    loads = {name: np.array(values) for name, values in loads.items()}
    return dx, {**loads, "flap_acceleration": flap_dd, "lag_acceleration": lag_dd}


# ------------------------------------------------------------------------------------------------------------
# Integrals of the motion
# ------------------------------------------------------------------------------------------------------------


def section_rates(ac, rates):
    """Return the rates of all sections in their places; empty without late separation."""
    if not section_count(ac):
        return []
    found = np.zeros((section_states(ac), section_count(ac) // section_states(ac)))
    for j, of_rotor in enumerate(rates):
        for k, own in enumerate(of_rotor):
            found[:, section_places(ac, j, k)] = np.transpose(own)
    return [found.ravel()]


def _blade_points(ac, state, psi, swash=None):
    """Yield each point's position from the body origin [m], inertial velocity [m/s] and mass [kg]."""
    for j, blades in enumerate(make_blades(ac, state, psi, swash)):
        hub = np.asarray(ac.rotors[j].hub, dtype=float)
        hub_velocity = state.velocity + cross(state.rate, hub)
        for blade in blades:
            for s, point_mass in mass_points(ac.rotors[j]):
                yield hub + blade.position(s), blade.velocity(s, hub_velocity), point_mass


def first_moment(ac, x, psi, swash=None):
    """Return the first moment of fuselage and blades about the inertial origin [kg m], NED, shape (3,)."""
    state = split_state(ac, x)
    mass, about_origin, _ = body_mass(ac)
    for position, _, point_mass in _blade_points(ac, state, psi, swash):
        mass, about_origin = mass + point_mass, about_origin + point_mass * position
    return mass * state.position + rotation_matrix(state.quaternion) @ about_origin


def momentum(ac, x, psi, swash=None):
    """Return linear and angular momentum of fuselage and blades; for `complete` coupling.

    Parameters
    ----------
    ac : aircraft
    x : array, shape (n,)
    psi : array, shape (n_rotors,)

    Returns
    -------
    p : array, shape (3,)
        Linear momentum, NED [kg m/s].
    h : array, shape (3,)
        Angular momentum about the inertial origin, NED [kg m^2/s].
    """
    state = split_state(ac, x)
    mass, about_origin, inertia = body_mass(ac)
    linear = mass * state.velocity + cross(state.rate, about_origin)
    angular = cross(about_origin, state.velocity) + inertia @ state.rate
    for position, velocity, point_mass in _blade_points(ac, state, psi, swash):
        linear = linear + point_mass * velocity
        angular = angular + cross(position, point_mass * velocity)
    attitude = rotation_matrix(state.quaternion)
    p = attitude @ linear
    return p, cross(state.position, p) + attitude @ angular


def energy(ac, x, psi, swash=None):
    """Return kinetic energy plus that of weight and springs [J]; for `complete` coupling.

    Each drive adds torque times speed, the lag dampers take C xi'^2, and the air its share.
    """
    state = split_state(ac, x)
    mass, about_origin, inertia = body_mass(ac)
    v, om = state.velocity, state.rate
    total = 0.5 * mass * v @ v + v @ cross(om, about_origin) + 0.5 * om @ inertia @ om
    for _, velocity, point_mass in _blade_points(ac, state, psi, swash):
        total = total + 0.5 * point_mass * velocity @ velocity
    for rotor, blades in zip(ac.rotors, make_blades(ac, state, psi), strict=True):
        for blade in blades:
            flap, lag = blade.flap - rotor.flap_rest, blade.lag - rotor.lag_rest
            total = total + 0.5 * (rotor.flap_spring * flap**2 + rotor.lag_spring * lag**2)
    if stands(ac):
        r = rotation_matrix(state.quaternion).T @ state.position
        q, springs = state.quaternion[1:], ac.body.stand_spring
        total = total + 0.5 * (ac.body.stand_mass[:3] * v @ v + springs[:3] * r @ r) + 2 * springs[3:] * q @ q
    return total - ac.environment.gravity * first_moment(ac, x, psi, swash)[2]


# ------------------------------------------------------------------------------------------------------------
# An aircraft to test with
# ------------------------------------------------------------------------------------------------------------


def smooth_airfoil(lift_slope=5.73):
    """Return an airfoil table of simple shape: cl ~ sin 2 alpha, cd ~ sin^2 alpha, slowly varying with Re."""
    reynolds = np.array([2.5e4, 1e5, 3e5, 6e5])
    alpha = np.radians(np.linspace(-180.0, 180.0, 361))
    growth = (reynolds / 3e5)[:, None] ** 0.05
    cl = growth * lift_slope / 2 * np.sin(2 * alpha)
    cd = 0.0105 / growth**5 + 1.2 * np.sin(alpha) ** 2
    return SimpleNamespace(axis="reynolds", numbers=reynolds, alpha=alpha, cl=cl, cd=cd)


def table6_aircraft(environment=None, body=None, options=None, rotors=None):
    """Return the paper's aircraft (its Table 6) as nested namespaces, with changes.

    Parameters
    ----------
    environment, body, options : dict, optional
        Attributes to change.
    rotors : dict, optional
        Attributes to change; a list or tuple of two has one value for each rotor.

    Returns
    -------
    SimpleNamespace
        With the attributes of `sbs_sim.aircraft.Aircraft` that the model reads.
    """
    rotor = {
        "shaft_direction": np.array([0.0, 0.0, -1.0]),
        "speed": 2400 * 2 * np.pi / 60,
        "radius": 0.505,
        "blades": 3,
        "blade_mass": 0.1613,
        "blade_cg": 0.224,
        "blade_inertia": None,
        "hinge_offset": 0.075,
        "flap_hinge_offset": 0.0075,
        "flap_spring": 162.0,
        "lag_spring": 0.0,
        "flap_rest": 0.0,
        "lag_rest": 0.0,
        "lag_damping": 0.0,
        "blade_lag_damping": None,
        **dict.fromkeys((f"damper_{name}" for name in ("damping", "a", "b", "c", "d", "r")), 0.0),
        "pitch_flap_coupling": 0.0,
        "pitch_lag_coupling": 0.0,
        "chord_root": 0.051,
        "chord_tip": 0.051,
        **dict.fromkeys(("chord_stations", "chord_values", "twist_stations", "twist_values")),
        "twist_root": 0.0,
        "twist_tip": 0.0,
        "root_cutout": 0.0,
        "tip_loss": 1.0,
        "tip_loss_model": "factor",
        "profile_drag": "section",
        "swashplate_phase": np.radians(-72.0),
        "airfoil": "smooth",
        "duct_expansion": 0.5,
        "induced_power_factor": 1.0,
        "descent": "momentum",
        "duct_exit": None,
        "duct_turning": 1.0,
        "ram_recovery": 1.0,
        "lip_arm": 0.0,
        "lip_stall": None,
    }
    each = [
        {**rotor, "name": "MR1", "hub": np.array([0.0, -0.645, 0.066]), "rotation": -1},
        {**rotor, "name": "MR2", "hub": np.array([0.0, 0.645, 0.066]), "rotation": 1},
    ]
    for name, value in (rotors or {}).items():
        for j in range(2):
            each[j][name] = value[j] if isinstance(value, list | tuple) else value
    return SimpleNamespace(
        environment=SimpleNamespace(
            **{
                "air_density": 1.225,
                "kinematic_viscosity": 1.46e-5,
                "gravity": 9.80665,
                **(environment or {}),
            }
        ),
        body=SimpleNamespace(
            **{
                "mass": 20.62,
                "inertia": np.array([[3.532, -0.001, -0.052], [-0.001, 2.222, 0.0], [-0.052, 0.0, 5.342]]),
                "flat_plate_areas": np.array([0.08, 0.15, 0.30]),
                **(body or {}),
            }
        ),
        options=SimpleNamespace(
            **{
                "coupling": "complete",
                "hub_moment": "complete",
                "flap_inertia": "hinge_to_tip",
                "elements": 20,
                "interpolation": "linear",
                **(options or {}),
            }
        ),
        rotors=tuple(SimpleNamespace(**values) for values in each),
        airfoils={"smooth": smooth_airfoil()},
    )


def random_state(ac, rng, size=1.0):
    """Return a random state of unlikely violence: 20 m/s, 2 rad/s, flap and lag of 0.1 rad, times `size`."""
    quaternion = rng.normal(size=4)
    count = sum(rotor.blades for rotor in ac.rotors)
    inflow = [np.array([0.06, 0.0, 0.0]) + size * rng.normal(scale=0.02, size=3) for _ in ac.rotors]
    return np.concatenate(
        [
            size * rng.normal(scale=50.0, size=3),
            quaternion / np.linalg.norm(quaternion),
            size * rng.normal(scale=20.0, size=3),
            size * rng.normal(scale=2.0, size=3),
            size * rng.normal(scale=0.1, size=count),
            size * rng.normal(scale=10.0, size=count),
            size * rng.normal(scale=0.1, size=count),
            size * rng.normal(scale=10.0, size=count),
            *inflow,
            *(size * rng.normal(scale=0.05, size=2 * rotor.blades) for rotor in ac.rotors if has_wake(rotor)),
            *([random_sections(ac, rng)] if section_count(ac) else []),
        ]
    )
