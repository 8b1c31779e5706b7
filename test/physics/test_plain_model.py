"""The plain reference against closed forms, conservation laws and symmetries (theory.md sections 1 to 7)."""

from types import SimpleNamespace

import numpy as np
import plain_model
import pytest
from plain_model import plain_derivative, random_state, split_state, table6_aircraft
from scipy.optimize import brentq

VACUUM = {"air_density": 0.0}
CALM = np.zeros(3)


def blade_derivative(ac, blade_state, rate=(0.0, 0.0, 0.0), lead_lag=True):
    """Return beta'', xi'' of rotor 2's blades, which all have the given flap, flap rate, lag, lag rate."""
    x = np.zeros(13 + 4 * 6 + 6)
    x[3] = 1.0
    x[10:13] = rate
    flap, flap_rate, lag, lag_rate = blade_state
    for start, value in ((13, flap), (19, flap_rate), (25, lag), (31, lag_rate)):
        x[start + 3] = value
    _, loads = plain_derivative(ac, x, np.zeros((2, 3)), np.zeros(2), CALM, lead_lag)
    return loads["flap_acceleration"][1], loads["lag_acceleration"][1]


def slope(function, step=1e-5):
    """Return the central difference of a function of one number at zero."""
    return (function(step) - function(-step)) / (2 * step)


# -- transform and frames (section 1) ------------------------------------------------------------------------


def test_three_blade_accelerations_of_the_coordinates():
    """The printed closed forms of a0'', a1'', b1''."""
    rng = np.random.default_rng(0)
    ac = table6_aircraft()
    x, psi = random_state(ac, rng), np.array([0.3, 1.1])
    dx, loads = plain_derivative(ac, x, rng.normal(scale=0.1, size=(2, 3)), psi, CALM)
    omega = ac.rotors[0].speed
    (_, a1, b1), (_, a1_d, b1_d) = split_state(ac, x).flap[1], split_state(ac, x).flap_rate[1]
    azimuth = psi[1] + 2 * np.pi * np.arange(3) / 3
    flap_dd = loads["flap_acceleration"][1]
    expected = [
        flap_dd.mean(),
        -2 * (flap_dd * np.cos(azimuth)).mean() - 2 * omega * b1_d + omega**2 * a1,
        -2 * (flap_dd * np.sin(azimuth)).mean() + 2 * omega * a1_d + omega**2 * b1,
    ]
    np.testing.assert_allclose(dx[22:25], expected, rtol=1e-10)


@pytest.mark.parametrize("blades", [3, 4, 5, 6, 7])
def test_multiblade_transform_is_one_to_one_and_its_derivatives_are(blades):
    """Square, well conditioned, and d/dpsi agrees with differences."""
    psi = 0.7
    matrix = plain_model.multiblade_matrix(blades, psi)
    assert matrix.shape == (blades, blades)
    assert np.linalg.cond(matrix) < 2
    for order in (1, 2):
        difference = slope(lambda h, n=order: plain_model.multiblade_matrix(blades, psi + h, n - 1))
        np.testing.assert_allclose(plain_model.multiblade_matrix(blades, psi, order), difference, atol=1e-8)


def test_hub_axes_are_the_smallest_rotation():
    """Right-handed, -u is z_hub, and the rotation's axis is horizontal: it has no part along body z."""
    rng = np.random.default_rng(1)
    for _ in range(5):
        u = rng.normal(size=3)
        u /= np.linalg.norm(u)
        x_hub, y_hub = plain_model.hub_axes(u)
        rotation = np.stack([x_hub, y_hub, -u], axis=1)
        np.testing.assert_allclose(rotation.T @ rotation, np.eye(3), atol=1e-12)
        assert np.linalg.det(rotation) > 0
        assert abs(rotation[1, 0] - rotation[0, 1]) < 1e-12  # twice sin(angle) times the axis' body z
        assert abs((np.trace(rotation) - 1) / 2 - -u[2]) < 1e-12
    np.testing.assert_array_equal(plain_model.hub_axes([0, 0, -1.0])[0], [1, 0, 0])


def test_turning_sense_and_advancing_side():
    """Counter-clockwise from above advances on the right, clockwise on the left; both start aft."""
    ac = table6_aircraft()
    for rotor, side in zip(ac.rotors, (-1, 1), strict=True):
        aft = plain_model.make_blade(rotor, 0.0, 0, 0, 0, 0, CALM)
        advancing = plain_model.make_blade(rotor, np.pi / 2, 0, 0, 0, 0, CALM)
        np.testing.assert_allclose(aft.d, [-1, 0, 0], atol=1e-15)
        np.testing.assert_allclose(advancing.d, [0, side, 0], atol=1e-15)
        tip = advancing.velocity(rotor.radius - rotor.hinge_offset, CALM)
        np.testing.assert_allclose(tip, [rotor.speed * rotor.radius, 0, 0], atol=1e-12)
        lagging = plain_model.make_blade(rotor, np.pi / 2, 0, 0, 0.1, 0, CALM)
        assert lagging.d[0] < 0  # against the motion


# -- blade equations: the reduced forms (section 3) ----------------------------------------------------------


def heavy_hub(**rotor):
    """Return Table 6's aircraft in a vacuum with the hub's acceleration neglected, and rotor 2's moments."""
    ac = table6_aircraft(environment={**VACUUM, "gravity": 0.0}, options={"coupling": "paper"}, rotors=rotor)
    r = ac.rotors[1]
    return ac, r, r.blade_mass * r.blade_cg, r.blade_mass * (r.radius - r.hinge_offset) ** 2 / 3


def test_rotating_flap_frequency():
    """nu^2 = 1 + e_0 S1/A1 + K/(A1 Omega^2), 1.237 per revolution."""
    ac, r, s1, a1 = heavy_hub()
    stiffness = -slope(lambda h: blade_derivative(ac, (h, 0, 0, 0), lead_lag=False)[0][0]) / r.speed**2
    assert stiffness == pytest.approx(1 + r.hinge_offset * s1 / a1 + r.flap_spring / (a1 * r.speed**2), rel=1e-8)
    assert np.sqrt(stiffness) == pytest.approx(1.237, abs=1e-3)


@pytest.mark.parametrize("lag_spring", [0.0, 40.0])
def test_rotating_lag_frequency(lag_spring):
    """nu^2 = e_L (m_b e_F + S1)/A2 + K/(A2 Omega^2), 0.49 per revolution without a spring.

    A uniform blade, 3/2 e_L / (L + e_F), would have 0.48: the printed centre of gravity is further out.
    """
    ac, r, s1, a1 = heavy_hub(lag_spring=lag_spring)
    e_f, e_l = r.flap_hinge_offset, r.hinge_offset - r.flap_hinge_offset
    a2 = r.blade_mass * e_f**2 + 2 * e_f * s1 + a1
    stiffness = -slope(lambda h: blade_derivative(ac, (0, 0, h, 0))[1][0]) / r.speed**2
    expected = e_l * (r.blade_mass * e_f + s1) / a2 + lag_spring / (a2 * r.speed**2)
    assert stiffness == pytest.approx(expected, rel=1e-8)
    if lag_spring == 0:
        assert np.sqrt(stiffness) == pytest.approx(0.490, abs=1e-3)


@pytest.mark.parametrize("flap", [0.02, -0.2])
def test_coriolis_terms(flap):
    """A1 beta'' = -D_b xi', A2 xi'' = -D_x beta', D_b = -D_x = -2 Omega (A1 cos b + e_F S1) sin b."""
    ac, r, s1, a1 = heavy_hub(flap_hinge_offset=0.03)
    e_f = r.flap_hinge_offset
    a2 = r.blade_mass * e_f**2 + 2 * e_f * s1 * np.cos(flap) + a1 * np.cos(flap) ** 2
    d_b = -2 * r.speed * (a1 * np.cos(flap) + e_f * s1) * np.sin(flap)
    by_lag_rate = slope(lambda h: blade_derivative(ac, (flap, 0, 0, h))[0][0], 1e-3)
    by_flap_rate = slope(lambda h: blade_derivative(ac, (flap, h, 0, 0))[1][0], 1e-3)
    assert a1 * by_lag_rate == pytest.approx(-d_b, rel=1e-7)
    assert a2 * by_flap_rate == pytest.approx(d_b, rel=1e-7)


def test_gyroscopic_flap_forcing():
    """A body rate forces the flap at 1/rev with amplitude 2 Omega (A1 + e_0 S1).

    Nose-up rate presses the advancing blade down; roll to the right lifts what moves to the right.
    """
    ac, r, s1, a1 = heavy_hub()
    amplitude = 2 * r.speed * (a1 + r.hinge_offset * s1)
    azimuth = 2 * np.pi * np.arange(3) / 3
    by_pitch = slope(lambda h: blade_derivative(ac, (0, 0, 0, 0), (0, h, 0), False)[0], 1e-3)
    by_roll = slope(lambda h: blade_derivative(ac, (0, 0, 0, 0), (h, 0, 0), False)[0], 1e-3)
    np.testing.assert_allclose(a1 * by_pitch, -amplitude * np.sin(azimuth), atol=1e-7 * amplitude)
    np.testing.assert_allclose(a1 * by_roll, r.rotation * amplitude * np.cos(azimuth), atol=1e-7 * amplitude)


# -- the coupled system (section 5) --------------------------------------------------------------------------


def tilted_aircraft(blades=(3, 4), **changes):
    """Return an aircraft without any symmetry."""
    shafts = [np.array([0.1, -0.2, -1.0]), np.array([-0.15, 0.3, -0.9])]
    return table6_aircraft(
        environment=changes.get("environment"),
        options={"elements": 6, **changes.get("options", {})},
        rotors={
            "blades": list(blades),
            "shaft_direction": [shaft / np.linalg.norm(shaft) for shaft in shafts],
            "hub": [np.array([0.1, -0.6, 0.07]), np.array([-0.05, 0.7, -0.1])],
            "lag_spring": 20.0,
            "lag_damping": 0.3,
            "flap_hinge_offset": 0.02,
            "speed": [251.0, 230.0],
            **changes.get("rotors", {}),
        },
    )


def rate_along_motion(ac, function, x, dx, psi):
    """Return d/dt of function(x, psi) as the azimuths turn with Omega, by a complex step (no truncation)."""
    step = 1e-30
    speeds = np.array([rotor.speed for rotor in ac.rotors])
    return np.imag(function(x + 1j * step * dx, psi + 1j * step * speeds)) / step


@pytest.mark.parametrize("seed", range(4))
def test_momentum_and_energy_in_a_vacuum(seed):
    """Weight is the only external load; the drives give torque times speed, the lag dampers take C xi'^2."""
    rng = np.random.default_rng(seed)
    ac = tilted_aircraft(environment=VACUUM)
    x, psi = random_state(ac, rng), rng.uniform(0, 2 * np.pi, size=2)
    dx, loads = plain_derivative(ac, x, np.zeros((2, 3)), psi, CALM)
    weight = np.array([0.0, 0.0, ac.body.mass * ac.environment.gravity])

    p, _ = plain_model.momentum(ac, x, psi)
    p_dot = rate_along_motion(ac, lambda x, psi: plain_model.momentum(ac, x, psi)[0], x, dx, psi)
    h_dot = rate_along_motion(ac, lambda x, psi: plain_model.momentum(ac, x, psi)[1], x, dx, psi)
    mass_moment = plain_model.first_moment(ac, x, psi)
    mass_moment_dot = rate_along_motion(ac, lambda x, psi: plain_model.first_moment(ac, x, psi), x, dx, psi)
    # Loads of 1e4 N and 1e4 N m balance inside.
    np.testing.assert_allclose(mass_moment_dot, p, atol=1e-10)
    np.testing.assert_allclose(p_dot, weight, atol=1e-8)
    gravity = np.array([0.0, 0.0, ac.environment.gravity])
    np.testing.assert_allclose(h_dot, np.cross(mass_moment, gravity), atol=1e-6)

    power = sum(torque * rotor.speed for torque, rotor in zip(loads["torque"], ac.rotors, strict=True))
    state = split_state(ac, x)
    for rotor, blades in zip(ac.rotors, plain_model.make_blades(ac, state, psi), strict=True):
        power -= sum(rotor.lag_damping * blade.lag_rate**2 for blade in blades)
    energy_dot = rate_along_motion(ac, lambda x, psi: plain_model.energy(ac, x, psi), x, dx, psi)
    assert energy_dot == pytest.approx(power, rel=1e-10, abs=1e-6)


def test_momentum_and_energy_in_air():
    """The same laws with the air's force, moment and power added."""
    rng = np.random.default_rng(5)
    ac = tilted_aircraft(rotors={"duct_expansion": 0.7, "lag_damping": 0.0})
    x, psi = random_state(ac, rng), rng.uniform(0, 2 * np.pi, size=2)
    swash, wind = rng.normal(scale=0.1, size=(2, 3)), rng.normal(scale=4.0, size=3)
    dx, loads = plain_derivative(ac, x, swash, psi, wind)
    state, instant = split_state(ac, x), plain_model.make_instant(ac, x, swash, psi, wind)
    force = instant.fuselage_force.copy()
    moment = np.zeros(3)
    power = instant.fuselage_force @ state.velocity
    for j, rotor in enumerate(ac.rotors):
        hub_velocity = state.velocity + np.cross(state.rate, rotor.hub)
        duct = loads["duct"][j] * rotor.shaft_direction
        force += duct
        moment += np.cross(rotor.hub, duct)
        power += duct @ hub_velocity + loads["torque"][j] * rotor.speed
        for blade, elements in zip(instant.blades[j], instant.air_loads[j], strict=True):
            for s, load in elements:
                force += load
                moment += np.cross(rotor.hub + blade.position(s), load)
                power += load @ blade.velocity(s, hub_velocity)
    attitude = plain_model.rotation_matrix(state.quaternion)
    gravity = np.array([0.0, 0.0, ac.environment.gravity])
    p_dot = rate_along_motion(ac, lambda x, psi: plain_model.momentum(ac, x, psi)[0], x, dx, psi)
    h_dot = rate_along_motion(ac, lambda x, psi: plain_model.momentum(ac, x, psi)[1], x, dx, psi)
    energy_dot = rate_along_motion(ac, lambda x, psi: plain_model.energy(ac, x, psi), x, dx, psi)
    np.testing.assert_allclose(p_dot, attitude @ force + ac.body.mass * gravity, atol=1e-8)
    about_origin = attitude @ moment + np.cross(state.position, attitude @ force)
    weight_moment = np.cross(plain_model.first_moment(ac, x, psi), gravity)
    np.testing.assert_allclose(h_dot, about_origin + weight_moment, atol=1e-6)
    assert energy_dot == pytest.approx(power, rel=1e-10)


def test_free_fall_is_exact():
    """In a vacuum weight adds g to every part alike: the motion without it, seen from a falling frame."""
    rng = np.random.default_rng(6)
    x, psi = None, rng.uniform(0, 2 * np.pi, size=2)
    results = []
    for gravity in (0.0, 9.80665):
        ac = tilted_aircraft(environment={**VACUUM, "gravity": gravity})
        x = random_state(ac, rng) if x is None else x
        results.append(plain_derivative(ac, x, np.zeros((2, 3)), psi, CALM)[0])
    difference = results[1] - results[0]
    attitude = plain_model.rotation_matrix(x[3:7])
    np.testing.assert_allclose(difference[7:10], attitude.T @ [0, 0, 9.80665], atol=1e-9)
    difference[7:10] = 0
    np.testing.assert_allclose(difference, 0, atol=1e-8)


def test_undeflected_aircraft_has_the_printed_mass_properties():
    """Fuselage plus undeflected blades: printed mass, centre of gravity at the origin, printed inertia."""
    ac = table6_aircraft()
    rng = np.random.default_rng(2)
    x = np.zeros(43)
    x[3] = 1.0
    velocity, rate = rng.normal(size=3), rng.normal(size=3)

    def angular(velocity, rate):
        state = x.copy()
        state[7:10], state[10:13] = velocity, rate
        return plain_model.momentum(ac, state, np.array([0.4, 1.3]))

    # The blades' spin is taken off by difference.
    p_0, h_0 = angular(CALM, CALM)
    p, h = angular(velocity, rate)
    np.testing.assert_allclose(p - p_0, ac.body.mass * velocity, atol=1e-12)
    np.testing.assert_allclose(h - h_0, ac.body.inertia @ rate, atol=1e-12)
    np.testing.assert_allclose(p_0, 0, atol=1e-12)
    mass, _, inertia = plain_model.body_mass(ac)
    assert mass == pytest.approx(ac.body.mass - 6 * 0.1613)
    assert np.linalg.eigvalsh(inertia).min() > 1


def mirrored(ac):
    """Return the aircraft's image in the plane y = 0."""
    flip = np.array([1.0, -1.0, 1.0])
    body = SimpleNamespace(**{**vars(ac.body), "inertia": np.outer(flip, flip) * ac.body.inertia})
    rotors = [
        SimpleNamespace(
            **{
                **vars(rotor),
                "hub": flip * rotor.hub,
                "shaft_direction": flip * rotor.shaft_direction,
                "rotation": -rotor.rotation,
            }
        )
        for rotor in ac.rotors
    ]
    return SimpleNamespace(**{**vars(ac), "body": body, "rotors": rotors})


@pytest.mark.parametrize("coupling", ["complete", "paper"])
@pytest.mark.parametrize("hub_moment", ["complete", "paper"])
@pytest.mark.parametrize("lead_lag", [True, False])
@pytest.mark.parametrize("cyclic_inflow", [True, False])
def test_mirror_symmetry(coupling, hub_moment, lead_lag, cyclic_inflow):
    """The mirrored aircraft at the mirrored state has the mirrored derivative and loads."""
    rng = np.random.default_rng(3)
    ac = tilted_aircraft(options={"coupling": coupling, "hub_moment": hub_moment})
    x, psi = random_state(ac, rng), rng.uniform(0, 2 * np.pi, size=2)
    swash, wind = rng.normal(scale=0.1, size=(2, 3)), rng.normal(scale=4.0, size=3)
    polar, axial = np.array([1.0, -1.0, 1.0]), np.array([-1.0, 1.0, -1.0])
    flip = np.ones(len(x))
    flip[0:3] = flip[7:10] = polar
    flip[3:7], flip[10:13] = [1, *axial], axial
    dx, loads = plain_derivative(ac, x, swash, psi, wind, lead_lag, cyclic_inflow)
    image, image_loads = plain_derivative(
        mirrored(ac), flip * x, swash * [1, -1, 1], psi, wind * polar, lead_lag, cyclic_inflow
    )
    np.testing.assert_allclose(image, flip * dx, rtol=1e-9, atol=1e-8)
    np.testing.assert_allclose(image_loads["force"], loads["force"] * polar, rtol=1e-9, atol=1e-8)
    np.testing.assert_allclose(image_loads["moment"], loads["moment"] * axial, rtol=1e-9, atol=1e-8)
    np.testing.assert_allclose(image_loads["torque"], loads["torque"], rtol=1e-9, atol=1e-8)


def test_wind_is_relative_and_heading_is_free():
    """Air and aircraft carried along together, and turned together, change nothing the body sees."""
    rng = np.random.default_rng(4)
    ac = tilted_aircraft()
    x, psi = random_state(ac, rng), rng.uniform(0, 2 * np.pi, size=2)
    swash, wind = rng.normal(scale=0.1, size=(2, 3)), rng.normal(scale=4.0, size=3)
    dx, _ = plain_derivative(ac, x, swash, psi, wind)

    attitude = plain_model.rotation_matrix(x[3:7])
    drift = rng.normal(scale=10.0, size=3)
    carried = x.copy()
    carried[7:10] += attitude.T @ drift
    dx_carried, _ = plain_derivative(ac, carried, swash, psi, wind + drift)
    np.testing.assert_allclose(dx_carried[0:3], dx[0:3] + drift, atol=1e-10)
    dx_carried[7:10] += np.cross(x[10:13], attitude.T @ drift)
    np.testing.assert_allclose(dx_carried[3:], dx[3:], rtol=1e-8, atol=1e-7)

    half = 0.4
    turn = np.array([np.cos(half), 0, 0, np.sin(half)])
    turned = x.copy()
    w, v = x[3], x[4:7]
    turned[3] = turn[0] * w - turn[1:] @ v
    turned[4:7] = turn[0] * v + w * turn[1:] + np.cross(turn[1:], v)
    matrix = plain_model.rotation_matrix(turn)
    dx_turned, _ = plain_derivative(ac, turned, swash, psi, matrix @ wind)
    np.testing.assert_allclose(dx_turned[0:3], matrix @ dx[0:3], atol=1e-10)
    np.testing.assert_allclose(dx_turned[7:], dx[7:], rtol=1e-8, atol=1e-7)


def test_attitude_rate():
    """The quaternion's rate turns the matrix with om."""
    rng = np.random.default_rng(11)
    ac = tilted_aircraft()
    x = random_state(ac, rng)
    dx, _ = plain_derivative(ac, x, np.zeros((2, 3)), np.zeros(2), CALM)
    rate = np.imag(plain_model.rotation_matrix(x[3:7] + 1e-30j * dx[3:7])) / 1e-30
    p, q, r = x[10:13]
    spin = np.array([[0, -r, q], [r, 0, -p], [-q, p, 0]])
    np.testing.assert_allclose(rate, plain_model.rotation_matrix(x[3:7]) @ spin, atol=1e-12)


# -- options (section 9) -------------------------------------------------------------------------------------


def test_paper_hub_moment_in_a_vacuum():
    """In the plane only K b f, and with lag -(m_b L^2/3) b'' f; along the shaft as complete."""
    rng = np.random.default_rng(12)
    for lead_lag in (False, True):
        pair = [
            tilted_aircraft(environment=VACUUM, options={"coupling": "paper", "hub_moment": reading})
            for reading in ("complete", "paper")
        ]
        x, psi = random_state(pair[0], rng), rng.uniform(0, 2 * np.pi, size=2)
        _, complete = plain_derivative(pair[0], x, np.zeros((2, 3)), psi, CALM, lead_lag)
        _, paper = plain_derivative(pair[1], x, np.zeros((2, 3)), psi, CALM, lead_lag)
        np.testing.assert_allclose(paper["force"], complete["force"], rtol=1e-12)
        np.testing.assert_allclose(paper["torque"], complete["torque"], rtol=1e-9)
        blades = plain_model.make_blades(pair[1], split_state(pair[1], x, lead_lag), psi)
        for j, rotor in enumerate(pair[1].rotors):
            in_plane = np.zeros(3)
            for k, blade in enumerate(blades[j]):
                inertia = rotor.blade_mass * (rotor.radius - rotor.hinge_offset) ** 2 / 3
                in_plane += rotor.flap_spring * blade.flap * blade.f
                in_plane -= lead_lag * inertia * paper["flap_acceleration"][j][k] * blade.f
            u = rotor.shaft_direction
            np.testing.assert_allclose(paper["moment"][j] - u * (u @ paper["moment"][j]), in_plane, atol=1e-8)


def test_paper_coupling_carries_the_total_mass():
    """The body equations as printed, with total mass and inertia; the hub loads hold no weight."""
    rng = np.random.default_rng(14)
    ac = tilted_aircraft(options={"coupling": "paper"}, rotors={"duct_expansion": 0.7})
    x, psi = random_state(ac, rng), rng.uniform(0, 2 * np.pi, size=2)
    swash, wind = rng.normal(scale=0.1, size=(2, 3)), rng.normal(scale=4.0, size=3)
    dx, loads = plain_derivative(ac, x, swash, psi, wind)
    om, instant = x[10:13], plain_model.make_instant(ac, x, swash, psi, wind)
    force, moment = instant.fuselage_force + ac.body.mass * instant.gravity, np.zeros(3)
    for j, rotor in enumerate(ac.rotors):
        hub_force = loads["force"][j] + loads["duct"][j] * rotor.shaft_direction
        force = force + hub_force
        moment = moment + loads["moment"][j] + np.cross(rotor.hub, hub_force)
        # The blades' accelerations as seen with the hub at rest but turning with the body.
        expected = sum(load for elements in instant.air_loads[j] for _, load in elements)
        for k, blade in enumerate(instant.blades[j]):
            accelerations = loads["flap_acceleration"][j][k], loads["lag_acceleration"][j][k]
            a_g = blade.acceleration(rotor.blade_cg, np.zeros(3), np.zeros(3), *accelerations)
            expected = expected - rotor.blade_mass * a_g
        np.testing.assert_allclose(loads["force"][j], expected, rtol=1e-9, atol=1e-9)
    acceleration = dx[7:10] + np.cross(om, x[7:10])
    np.testing.assert_allclose(ac.body.mass * acceleration, force, rtol=1e-9, atol=1e-8)
    euler = ac.body.inertia @ dx[10:13] + np.cross(om, ac.body.inertia @ om)
    np.testing.assert_allclose(euler, moment, rtol=1e-9, atol=1e-8)


def test_lag_and_cyclic_inflow_off_ignore_what_the_state_holds():
    """Switched off, the states are held: no rate, and no effect of their values."""
    rng = np.random.default_rng(13)
    ac = tilted_aircraft()
    x, psi, swash = random_state(ac, rng), np.zeros(2), rng.normal(scale=0.1, size=(2, 3))
    dx, _ = plain_derivative(ac, x, swash, psi, CALM, False, False)
    blades = 7
    lag = slice(13 + 2 * blades, 13 + 4 * blades)
    cyclic = [-5, -4, -2, -1]
    np.testing.assert_array_equal(dx[lag], 0)
    np.testing.assert_array_equal(dx[cyclic], 0)
    x[lag], x[cyclic] = 0, 0
    again, _ = plain_derivative(ac, x, swash, psi, CALM, False, False)
    np.testing.assert_array_equal(again, dx)


# -- air loads (section 4) -----------------------------------------------------------------------------------


def test_airfoil_table():
    """Bilinear between nodes, clamped in Reynolds number, periodic in alpha."""
    alpha = np.radians(np.array([-180.0, -90.0, 0.0, 90.0, 180.0]))
    table = SimpleNamespace(
        numbers=np.array([1e5, 3e5]),
        alpha=alpha,
        cl=np.array([[0, -1, 0, 1, 0], [0, -2, 0, 2, 0]]),
        cd=np.array([[0, 1, 0, 1, 0], [0, 3, 0, 3, 0]]),
    )
    expected = (0.5 * 1.5, 0.5 * 2)
    for angle in (np.pi / 4, np.pi / 4 + 2 * np.pi, np.pi / 4 - 4 * np.pi):
        np.testing.assert_allclose(plain_model.airfoil_coefficients(table, 2e5, angle, "linear"), expected, rtol=1e-12)
    np.testing.assert_allclose(plain_model.airfoil_coefficients(table, 1.0, np.pi / 2, "linear"), (1, 1))
    np.testing.assert_allclose(plain_model.airfoil_coefficients(table, 1e9, -np.pi / 2, "linear"), (-2, 3))


def level_state(ac, lambda0=0.0, velocity=(0.0, 0.0, 0.0)):
    """Return a level state with flat discs and a uniform inflow."""
    x = np.zeros(13 + 4 * sum(rotor.blades for rotor in ac.rotors) + 3 * len(ac.rotors))
    x[3], x[7:10] = 1.0, velocity
    x[[-6, -3]] = lambda0
    return x


def test_thrust_and_torque_by_quadrature():
    """Twisted, tapered blades in hover against blade element integrals."""
    ac = table6_aircraft(
        options={"elements": 400, "coupling": "paper"},
        rotors={
            "twist_root": 0.08,
            "twist_tip": -0.02,
            "chord_root": 0.06,
            "chord_tip": 0.04,
            "lag_spring": 5.0,
        },
    )
    theta0, lambda0 = 0.15, 0.05
    swash = np.tile([theta0, 0.0, 0.0], (2, 1))
    _, loads = plain_derivative(ac, level_state(ac, lambda0), swash, np.zeros(2), CALM, lead_lag=False)
    rotor = ac.rotors[0]
    length = rotor.radius - rotor.hinge_offset
    nodes, weights = np.polynomial.legendre.leggauss(200)
    s, weights = (nodes + 1) * length / 2, weights * length / 2
    u_t, u_p = rotor.speed * (rotor.hinge_offset + s), rotor.speed * rotor.radius * lambda0
    speed, angle = np.hypot(u_t, u_p), np.arctan2(u_p, u_t)
    chord = 0.06 - 0.02 * s / length
    coefficients = [
        plain_model.airfoil_coefficients(ac.airfoils["smooth"], re, alpha, "linear")
        for re, alpha in zip(speed * chord / 1.46e-5, theta0 + 0.08 - 0.1 * s / length - angle, strict=True)
    ]
    cl, cd = np.transpose(coefficients)
    pressure = 0.5 * 1.225 * speed**2 * chord * weights
    thrust = 3 * np.sum(pressure * (cl * np.cos(angle) - cd * np.sin(angle)))
    drag = pressure * (cl * np.sin(angle) + cd * np.cos(angle))
    torque = 3 * np.sum(drag * (rotor.hinge_offset + s))
    np.testing.assert_allclose(loads["thrust"], thrust, rtol=1e-4)
    np.testing.assert_allclose(loads["torque"], torque, rtol=1e-4)
    # Blades that accelerate upwards in flap keep that share of the lift from the hub.
    kept = [
        rotor.blade_mass * rotor.blade_cg * np.sum(flap_dd)
        for rotor, flap_dd in zip(ac.rotors, loads["flap_acceleration"], strict=True)
    ]
    np.testing.assert_allclose(-loads["force"][:, 2], loads["thrust"] - kept, rtol=1e-9)


def test_swashplate_signs():
    """The pitch is theta0 - A1s G cos(psi + phase) - B1s sin(psi + phase), less the couplings."""
    swash, ratios = [0.1, 0.02, 0.03], {"pitch_flap_coupling": 0.5, "pitch_lag_coupling": -0.4}
    for phase in (0.0, -1.2):
        ac = table6_aircraft(rotors={"swashplate_phase": phase, **ratios}, options={"elements": 1})
        for rotor in ac.rotors:
            for azimuth in (0.3, 2.0):
                # Without inflow the section moves along t alone: the pitch is the angle of attack. Lag
                # enters by its coupling only, so that this stays so.
                blade = plain_model.make_blade(rotor, azimuth, 0.04, 0, 0, 0, CALM)._replace(lag=0.03)
                [(s, force)] = plain_model.blade_air_loads(ac, blade, swash, np.zeros(3), CALM)
                swing = azimuth + phase
                pitch = 0.1 - 0.02 * rotor.rotation * np.cos(swing) - 0.03 * np.sin(swing) - 0.02 + 0.012
                speed = blade.velocity(s, CALM) @ blade.t
                reynolds = speed * rotor.chord_root / ac.environment.kinematic_viscosity
                cl, cd = plain_model.airfoil_coefficients(ac.airfoils["smooth"], reynolds, pitch, "linear")
                assert (force @ blade.n) / -(force @ blade.t) == pytest.approx(cl / cd, rel=1e-9)


def test_sections_see_the_inflow():
    """Inflow lambda0 + r/R (lambdac cos psi + lambdas sin psi), by cos b; lift stands across the flow."""
    ac = table6_aircraft(options={"elements": 1})
    lift_only = plain_model.smooth_airfoil()
    lift_only.cd = 0 * lift_only.cd
    ac.airfoils = {"smooth": lift_only}
    lambda0, lambdas, lambdac = 0.05, 0.02, -0.03
    for rotor in ac.rotors:
        for azimuth, flap in ((0.4, 0.0), (2.1, 0.3), (4.0, -0.3)):
            blade = plain_model.make_blade(rotor, azimuth, flap, 0, 0, 0, CALM)
            inflow = np.array([lambda0, lambdas, lambdac])
            [(s, force)] = plain_model.blade_air_loads(ac, blade, [0.3, 0, 0], inflow, CALM)
            share = (rotor.hinge_offset + s) / rotor.radius
            flow = lambda0 + share * (lambdac * np.cos(azimuth) + lambdas * np.sin(azimuth))
            u_p = rotor.speed * rotor.radius * flow * np.cos(flap)
            u_t = rotor.speed * (rotor.hinge_offset + s * np.cos(flap))
            assert force @ blade.n > 0
            assert -(force @ blade.t) / (force @ blade.n) == pytest.approx(u_p / u_t, rel=1e-10)


def test_tip_loss_and_root_cutout():
    """Outside B R no lift but drag; a part of an element counts by its share; none inside the cutout."""
    states = {}
    for name, rotor in {
        "full": {},
        "tip_loss": {"tip_loss": 0.95},
        "cutout": {"root_cutout": 0.1},
        "none": {"tip_loss": 0.0},
    }.items():
        ac = table6_aircraft(rotors=rotor, options={"elements": 10})
        blade = plain_model.make_blade(ac.rotors[1], 0.4, 0, 0, 0, 0, CALM)
        states[name] = plain_model.blade_air_loads(ac, blade, [0.1, 0, 0], np.zeros(3), CALM)
    lift = {name: np.array([blade.n @ force for _, force in loads]) for name, loads in states.items()}
    drag = {name: np.array([blade.t @ force for _, force in loads]) for name, loads in states.items()}
    share = lift["tip_loss"] / lift["full"]
    np.testing.assert_allclose(share[:-1], 1)
    assert share[-1] == pytest.approx(1 - 0.05 * 0.505 / 0.043)
    np.testing.assert_allclose(drag["tip_loss"], drag["full"])
    np.testing.assert_allclose(lift["none"], 0, atol=1e-12)
    assert states["cutout"][0][0] == pytest.approx(0.1 + 0.033 / 2)


def test_flat_plates_oppose_the_motion():
    """X = -1/2 rho f |u| u on each axis."""
    ac = table6_aircraft()
    np.testing.assert_allclose(
        plain_model.flat_plate_force(ac, np.array([10.0, -2.0, 3.0])),
        -0.5 * 1.225 * np.array([0.08 * 100, -0.15 * 4, 0.30 * 9]),
    )


# -- inflow (section 6) --------------------------------------------------------------------------------------


def inflow_slope(ac, inflow, velocity, rotor=1):
    """Return the (3, 3) derivative of the unloaded inflow equation by lambda0, lambdas, lambdac [1/s]."""

    def rate(inflow):
        return plain_model.inflow_rate(ac, ac.rotors[rotor], [], [], inflow, np.asarray(velocity, float), True)

    return np.stack([slope(lambda h, e=e: rate(inflow + h * e), 1e-6) for e in np.eye(3)], axis=1)


def test_inflow_poles_of_hover():
    """At lambda0 = 0.0566 (3 pi/8) 2 lambda0 Omega = 33.5 and (45 pi/16) lambda0 Omega = 126 rad/s."""
    ac = table6_aircraft()
    lambda0, omega = 0.0566, ac.rotors[1].speed
    matrix = inflow_slope(ac, np.array([lambda0, 0.0, 0.0]), CALM)
    uniform, cyclic = 3 * np.pi / 8 * 2 * lambda0 * omega, 45 * np.pi / 16 * lambda0 * omega
    # V_T grows with lambda0, which doubles the slope of the uniform inflow; the paper's 33.5 holds V_T.
    np.testing.assert_allclose(matrix, -np.diag([2 * uniform, cyclic, cyclic]), rtol=1e-5, atol=1e-5)
    assert uniform == pytest.approx(33.5, rel=5e-3)
    assert cyclic == pytest.approx(126, rel=5e-3)


@pytest.mark.parametrize("expansion", [0.5, 0.7, 1.0])
def test_steady_inflow_of_hover_is_momentum_theory(expansion):
    """T = 2 rho A v^2 of an open rotor; with a duct T_rotor + T_duct = 2 a_w T_rotor = rho A v^2 / a_w."""
    ac = table6_aircraft(rotors={"duct_expansion": expansion}, options={"coupling": "paper", "elements": 10})
    swash = np.tile([0.15, 0.0, 0.0], (2, 1))

    def rate(lambda0):
        return plain_derivative(ac, level_state(ac, lambda0), swash, np.zeros(2), CALM)

    lambda0 = brentq(lambda lambda0: rate(lambda0)[0][-3], 0.0, 0.3, xtol=1e-12)
    _, loads = rate(lambda0)
    rotor = ac.rotors[1]
    v = lambda0 * rotor.speed * rotor.radius
    total = loads["thrust"][1] + loads["duct"][1]
    assert loads["thrust"][1] > 10
    assert total == pytest.approx(1.225 * np.pi * rotor.radius**2 * v**2 / expansion, rel=1e-6)


def steady_gains(velocity, rotor):
    """Return steady lambdas, lambdac per lambda0 where the lift has no moment, at an air velocity [m/s]."""
    lambda0 = 0.03
    ac, inflow, velocity = table6_aircraft(), np.array([lambda0, 0.0, 0.0]), np.asarray(velocity, dtype=float)
    rate = plain_model.inflow_rate(ac, ac.rotors[rotor], [], [], inflow, velocity, True)
    matrix = inflow_slope(ac, inflow, velocity, rotor)[1:, 1:]  # the cyclic equations are linear in these two
    return np.linalg.solve(matrix, -rate[1:]) / lambda0


def test_inflow_grows_down_wake():
    """Forward flight: more inflow aft. To the right: more on the left, whichever way the rotor turns."""
    for index, rotation in ((0, -1), (1, 1)):
        lambdas, lambdac = steady_gains([15.0, 0.0, 0.0], index)
        assert lambdac > 0.3
        assert abs(lambdas) < 1e-6
        lambdas, lambdac = steady_gains([0.0, 15.0, 0.0], index)
        assert rotation * lambdas < -0.3  # psi = 90 deg is on the right for G = +1
        assert abs(lambdac) < 1e-6


def test_gain_matrix_turns_with_the_wind():
    """The cyclic part of an axisymmetric rotor's gain has no preferred direction but the wake's."""
    size = [np.hypot(*steady_gains([15 * np.cos(a), 15 * np.sin(a), 0.0], 1)) for a in np.linspace(0, 6, 7)]
    np.testing.assert_allclose(size, size[0], rtol=1e-6)


def test_cyclic_gain_along_and_across_the_wake():
    """2 (1 - X^2) along the wake and 2 (1 + X^2) across it, for any direction of the wind."""
    ac, lambda0, speed = table6_aircraft(), 0.03, 15.0
    omega, tip_speed = ac.rotors[1].speed, ac.rotors[1].speed * ac.rotors[1].radius
    mu = speed / tip_speed
    v_t = np.hypot(mu, lambda0)
    v_m = (mu**2 + 2 * lambda0**2) / v_t
    x = mu / (v_t + lambda0)
    k = 15 * np.pi / 64
    along = 2 * (1 - x**2) + 2 * (k * x) ** 2  # the uniform state, held still, adds its share
    expected = -omega * v_m * 45 * np.pi / 16 * np.array([1 / along, 1 / (2 * (1 + x**2))])
    for direction in np.linspace(0, 6, 5):
        velocity = [speed * np.cos(direction), speed * np.sin(direction), 0.0]
        cyclic = inflow_slope(ac, np.array([lambda0, 0.0, 0.0]), velocity)[1:, 1:]
        np.testing.assert_allclose(np.linalg.eigvals(cyclic).min(), expected.min(), rtol=1e-5)
        np.testing.assert_allclose(np.linalg.eigvals(cyclic).max(), expected.max(), rtol=1e-5)
        across = np.array([np.cos(direction), np.sin(direction)])  # of the wake's (-sin, cos), in order s, c
        np.testing.assert_allclose(cyclic @ across, expected[1] * across, rtol=1e-4, atol=1e-3)


def test_climb_carries_the_wake_away():
    """Axial flight: V_T = lambda0 + climb speed, which drains the uniform inflow."""
    ac, lambda0, climb = table6_aircraft(), 0.05, 4.0
    rotor = ac.rotors[0]
    velocity = np.array([0.0, 0.0, -climb])
    rate = plain_model.inflow_rate(ac, rotor, [], [], np.array([lambda0, 0, 0]), velocity, True)
    v_t = lambda0 + climb / (rotor.speed * rotor.radius)
    assert rate[0] == pytest.approx(-rotor.speed * 3 * np.pi / 8 * 2 * v_t * lambda0, rel=1e-6)


def test_uniform_inflow_alone_is_glauerts():
    """Without cyclic inflow the steady thrust is C_T = 2 lambda0 V_T at any advance ratio."""
    ac, lambda0 = table6_aircraft(), 0.02
    rotor = ac.rotors[1]
    velocity = np.array([20.0, 5.0, -1.0])
    rate = plain_model.inflow_rate(ac, rotor, [], [], np.array([lambda0, 0, 0]), velocity, False)
    mu = velocity / (rotor.speed * rotor.radius)
    v_t = np.sqrt(mu[0] ** 2 + mu[1] ** 2 + (lambda0 - mu[2]) ** 2)
    assert rate[0] == pytest.approx(-rotor.speed * 3 * np.pi / 8 * 2 * v_t * lambda0, rel=1e-6)


def test_inflow_moments_act_where_the_lift_is():
    """More lift aft raises lambdac, more on the advancing side lambdas."""
    ac = table6_aircraft()
    rotor = ac.rotors[1]
    for azimuth, sign_s, sign_c in ((0.0, 0, 1), (np.pi / 2, 1, 0), (np.pi, 0, -1)):
        blade = plain_model.make_blade(rotor, azimuth, 0, 0, 0, 0, CALM)
        loads = [[(0.3, 10.0 * blade.n)]]
        rate = plain_model.inflow_rate(ac, rotor, [blade], loads, np.zeros(3), CALM, True)
        np.testing.assert_array_equal(np.sign(np.round(rate, 9)), [1, sign_s, sign_c])
        # m_c = Int r dF_n cos psi / (rho pi R^3 (Omega R)^2), r from the axis.
        r, tip_speed = rotor.hinge_offset + 0.3, rotor.speed * rotor.radius
        moment = r * 10.0 / (1.225 * np.pi * rotor.radius**3 * tip_speed**2)
        expected = rotor.speed * 45 * np.pi / 16 * moment * np.array([sign_s, sign_c])
        np.testing.assert_allclose(rate[1:], expected, atol=1e-9)


def test_inflow_is_finite_everywhere():
    """No inflow, hover, descent through the wake, climb, edgewise: finite rates."""
    ac = table6_aircraft()
    for lambda0 in (0.0, 1e-8, 0.05, -0.05):
        for velocity in ([0, 0, 0], [0, 0, 6.35], [0, 0, -5], [20, 0, 0], [1e-9, 1e-9, 0]):
            rate = plain_model.inflow_rate(
                ac,
                ac.rotors[0],
                [],
                [],
                np.array([lambda0, 0.01, -0.01]),
                np.array(velocity, dtype=float),
                True,
            )
            assert np.all(np.isfinite(rate))
