"""What must not change while the aircraft flies: momentum, energy, symmetry (theory.md sections 1, 3 and 5)."""

import numpy as np
import pytest
from helpers import (
    POLAR,
    TEST_STAND,
    VACUUM,
    WEIGHTLESS_VACUUM,
    Model,
    aircraft_data,
    build,
    heading_matrix,
    mirrored_data,
    mirrored_state,
    mirrored_swash,
    turned_state,
    unit,
)
from plain_model import energy, first_moment, mass_points, momentum, multiblade_matrix, rotation_matrix

from sbs_sim.aircraft import Aircraft
from sbs_sim.model import records as R
from sbs_sim.model import state as S

G = 9.80665
# The hinges of Table 6 are frictionless; springs and offsets of their own make every coupling term count.
ROTORS = {
    "table_6": [{}, {}],
    "tilted_four_and_five_blades": [
        {
            "shaft_direction": unit(0.1, -0.2, -1.0),
            "blades": 4,
            "flap_hinge_offset": 0.03,
            "lag_spring": 20.0,
        },
        {"shaft_direction": unit(-0.2, 0.3, -0.9), "blades": 5, "speed_rpm": 2100.0, "lag_damping": 0.3},
    ],
    "tail_rotor": [
        {},
        {},
        {
            "hub": [-1.2, 0.1, -0.2],
            "shaft_direction": [0.0, 1.0, 0.0],
            "speed_rpm": 3600.0,
            "blade_mass": 0.05,
        },
    ],
}


def vacuum_model(name, gravity, lead_lag=True):
    """Return an aircraft in vacuum; one blade element, since nothing acts on it."""
    aircraft = build(environment={**VACUUM, "gravity": gravity}, options={"elements": 1}, rotors=ROTORS[name])
    return Model(aircraft, lead_lag)


def tumbling_state(model, seed):
    """Return a state that tumbles at 2 rad/s with blades that flap and lag by some 5 deg."""
    rng = np.random.default_rng(seed)
    layout, n = model.layout, model.layout.blade_count
    x = model.state(rng.normal(scale=5.0, size=3), rng.normal(scale=2.0, size=3))
    x[S.POSITION : S.ATTITUDE] = rng.normal(scale=10.0, size=3)
    x[S.ATTITUDE : S.VELOCITY] = unit(*rng.normal(size=4))
    for block, scale in ((0, 0.05), (1, 5.0), (2, 0.05), (3, 5.0)):
        first = S.BODY_SIZE + block * n
        x[first : first + n] = rng.normal(scale=scale, size=n)
    if not model.lead_lag:
        for j in range(len(model.speeds)):
            x[layout.lag(j)] = x[layout.lag_rate(j)] = 0.0
    return x


# -- momentum (section 5) ------------------------------------------------------------------------------------


def momentum_errors(name, gravity, lead_lag, step_deg, revolutions=20, seed=0):
    """Return the largest relative errors of linear and angular momentum and of the mass centre's path.

    In vacuum weight alone acts, at the centre of mass: with p and h at the start, p + m g t and
    h + (M t + p t^2/2) x g, where M is the first moment about the inertial origin, M + p t + m g t^2/2.
    """
    model = vacuum_model(name, gravity, lead_lag)
    aircraft, psi = model.aircraft, np.linspace(0.3, 1.1, len(model.speeds))
    x = tumbling_state(model, seed)
    weight = np.array([0.0, 0.0, gravity])
    mass = aircraft.body.mass
    p0, h0 = momentum(aircraft, x, psi)
    m0 = first_moment(aircraft, x, psi)
    # natural scales: a blade's momentum in its rotor, a rotor's angular momentum
    rotor = aircraft.rotors[0]
    p_scale = rotor.blade_mass * rotor.speed * rotor.radius
    h_scale = rotor.blades * rotor.blade_mass * rotor.radius**2 / 3 * rotor.speed
    h = np.radians(step_deg) / model.speeds.max()
    steps = round(360 / step_deg)
    errors, start = np.zeros(3), x
    for lap in range(1, revolutions + 1):
        x = model.fly(x, steps, h, psi0=psi, first_step=(lap - 1) * steps)
        t, now = lap * steps * h, model.azimuth(lap * steps, h, psi)
        p, angular = momentum(aircraft, x, now)
        centre = first_moment(aircraft, x, now)
        expected_h = h0 + np.cross(m0 * t + p0 * t**2 / 2, weight)
        found = [
            np.linalg.norm(p - p0 - mass * weight * t) / p_scale,
            np.linalg.norm(angular - expected_h) / h_scale,
            np.linalg.norm(centre - m0 - p0 * t - mass * weight * t**2 / 2) / mass,
        ]
        errors = np.maximum(errors, found)
    # otherwise there is nothing to conserve
    flaps = slice(S.BODY_SIZE, S.BODY_SIZE + model.layout.blade_count)
    assert np.abs(x[flaps] - start[flaps]).max() > 0.02
    assert np.linalg.norm(x[S.RATES : S.BODY_SIZE] - start[S.RATES : S.BODY_SIZE]) > 0.02
    return errors


@pytest.mark.parametrize("gravity", [0.0, G])
@pytest.mark.parametrize("lead_lag", [True, False])
@pytest.mark.parametrize("name", ROTORS)
def test_momentum_of_a_tumbling_aircraft(name, lead_lag, gravity):
    """Body and blades over 20 revolutions: momentum to 1e-9 of its scale, the mass centre to 1e-9 m."""
    assert np.all(momentum_errors(name, gravity, lead_lag, step_deg=0.25) < 1e-9)


def test_momentum_is_lost_by_the_step_alone():
    """What is left goes with the fourth power of the step, so that the equations themselves lose nothing."""
    coarse, fine = (momentum_errors("tilted_four_and_five_blades", G, True, step, 2)[:2] for step in (4.0, 2.0))
    assert np.all(coarse > 1e-9)
    assert np.all(coarse / fine > 12)


def test_paper_coupling_loses_momentum():
    """The blades of the `paper` coupling do not feel the hub, so that their shares do not add up: not conserved."""
    aircraft = build(environment=WEIGHTLESS_VACUUM, options={"coupling": "paper", "elements": 1})
    model = Model(aircraft)
    x = tumbling_state(model, 0)
    h = np.radians(1.0) / model.speeds[0]
    before = x[S.VELOCITY : S.RATES]
    after = model.fly(x, 360, h)
    linear = [rotation_matrix(s[S.ATTITUDE : S.VELOCITY]) @ s[S.VELOCITY : S.RATES] for s in (x, after)]
    assert np.linalg.norm(linear[1] - linear[0]) > 1e-3 * np.linalg.norm(before)


@pytest.mark.parametrize("name", ROTORS)
def test_free_fall_is_exact(name):
    """With gravity every part falls alike: rates, attitude and blades are those without it, to the last bit."""
    results = []
    for gravity in (0.0, G):
        model = vacuum_model(name, gravity)
        x, h = tumbling_state(model, 3), np.radians(2.0) / model.speeds[0]
        steps = 20 * 180
        results.append(model.fly(x, steps, h))
    floating, falling = results
    moving = np.r_[S.ATTITUDE : S.VELOCITY, S.RATES : model.layout.size]
    np.testing.assert_array_equal(falling[moving], floating[moving])
    t = steps * h
    np.testing.assert_allclose(falling[: S.ATTITUDE] - floating[: S.ATTITUDE], [0, 0, G * t**2 / 2], atol=1e-7)
    down = rotation_matrix(falling[S.ATTITUDE : S.VELOCITY]).T @ [0, 0, G * t]
    np.testing.assert_allclose((falling - floating)[S.VELOCITY : S.RATES], down, atol=1e-7)


# -- energy (sections 3 and 5) -------------------------------------------------------------------------------


def rotating_energy(model, x, azimuth):
    """Return the Jacobi energy of every blade of a rotor on a hub at rest [J], shape (N_b,).

    In axes that turn with the hub, blade along x when undeflected, z up: kinetic energy, minus
    Omega^2/2 Int (x^2 + y^2) dm, plus the springs. Positions are differentiated by hand here.
    """
    rotor, layout = model.aircraft.rotors[0], model.layout
    transform = multiblade_matrix(rotor.blades, azimuth)
    turning = rotor.speed * multiblade_matrix(rotor.blades, azimuth, 1)
    flap, lag = transform @ x[layout.flap(0)], transform @ x[layout.lag(0)]
    flap_rate = transform @ x[layout.flap_rate(0)] + turning @ x[layout.flap(0)]
    lag_rate = transform @ x[layout.lag_rate(0)] + turning @ x[layout.lag(0)]
    e_f, e_l = rotor.flap_hinge_offset, rotor.hinge_offset - rotor.flap_hinge_offset
    total = rotor.flap_spring * flap**2 / 2 + rotor.lag_spring * lag**2 / 2
    for s, mass in mass_points(rotor):
        reach, reach_rate = e_f + s * np.cos(flap), -s * np.sin(flap) * flap_rate
        along, across = e_l + reach * np.cos(lag), reach * np.sin(lag)
        speed_squared = reach_rate**2 + (reach * lag_rate) ** 2 + (s * np.cos(flap) * flap_rate) ** 2
        total = total + mass / 2 * (speed_squared - rotor.speed**2 * (along**2 + across**2))
    return total


def fixed_hub(coupling, **rotor):
    """Return one weightless rotor in vacuum on a hub that its loads do not move.

    Masses and springs are a billionth, which leaves the motion of the blades as it is, on the heavy body.
    """
    values = {"flap_spring": 162.0, "lag_spring": 0.0, "lag_damping": 0.0, "blade_mass": 0.1613, **rotor}
    values |= {key: values[key] * 1e-9 for key in ("flap_spring", "lag_spring", "blade_mass")}
    return build(
        environment=WEIGHTLESS_VACUUM,
        body=TEST_STAND,
        options={"elements": 1, "coupling": coupling},
        rotors=[{"hub": [0.0, 0.0, 0.0], **values}],
    )


SPRUNG = {"flap_hinge_offset": 0.04, "lag_spring": 30.0, "rotation": -1}


@pytest.mark.parametrize(("coupling", "rotor"), [("complete", {}), ("complete", SPRUNG), ("paper", SPRUNG)], ids=str)
def test_rotating_energy_of_a_blade_on_a_fixed_hub(coupling, rotor):
    """Large flap and lag, 100 revolutions: to 1e-8 of the energy of the vibration, blade by blade."""
    model = Model(fixed_hub(coupling, **rotor))
    layout = model.layout
    rest = rotating_energy(model, model.state(), 0.0)
    x = model.state()
    x[layout.flap(0)], x[layout.flap_rate(0)] = [0.1, 0.05, -0.08], [5.0, -10.0, 8.0]
    x[layout.lag(0)], x[layout.lag_rate(0)] = [0.05, -0.1, 0.15], [-8.0, 3.0, 6.0]
    start = rotating_energy(model, x, 0.0)
    assert np.all(start - rest > 0.02 * np.abs(rest))
    steps = 2400  # the error goes with the fifth power of the step: RK4 damps by its sixth
    h = 2 * np.pi / steps / model.speeds[0]
    worst = 0.0
    for lap in range(100):
        x = model.fly(x, steps, h, first_step=lap * steps)
        now = rotating_energy(model, x, model.azimuth((lap + 1) * steps, h)[0])
        worst = max(worst, np.abs((now - start) / (start - rest)).max())
    assert worst < 1e-8


def test_drives_and_dampers_account_for_the_energy():
    """In vacuum the total energy changes by torque times speed of the drives and C xi'^2 of the dampers.

    The work is integrated over a revolution by Simpson's rule from the compiled torques.
    """
    model = vacuum_model("tilted_four_and_five_blades", G)
    aircraft, layout = model.aircraft, model.layout
    x, h, steps = tumbling_state(model, 4), np.radians(0.5) / model.speeds[0], 720
    start, powers = energy(aircraft, x, np.zeros(2)), []
    for i in range(steps + 1):
        psi = model.azimuth(i, h)
        model.derivative(x, psi=psi)
        power = model.loads[:, R.TORQUE] @ model.speeds
        for j, rotor in enumerate(aircraft.rotors):
            rates = multiblade_matrix(rotor.blades, psi[j]) @ x[layout.lag_rate(j)]
            rates += rotor.speed * multiblade_matrix(rotor.blades, psi[j], 1) @ x[layout.lag(j)]
            power -= rotor.lag_damping * rates @ rates
        powers.append(power)
        if i < steps:
            x = model.fly(x, 1, h, first_step=i)
    powers = np.array(powers)
    work = h / 3 * (powers[0] + powers[-1] + 4 * powers[1:-1:2].sum() + 2 * powers[2:-1:2].sum())
    change = energy(aircraft, x, model.azimuth(steps, h)) - start
    assert np.abs(powers).max() * steps * h > 1.0
    assert change == pytest.approx(work, abs=1e-8 * np.abs(powers).max() * steps * h)


STANDS = {
    "all_axes": {"mass": [30.0, 20.0, 10.0, 3.0, 4.0, 6.0], "spring": [900.0, 700.0, 500.0, 60.0, 80.0, 40.0]},
    "gimbal": {"free": ["roll", "pitch"], "mass": [0, 0, 0, 3.0, 4.0, 0], "spring": [0, 0, 0, 60.0, 80.0, 0]},
    "slide": {"free": ["x", "y"], "mass": [30.0, 9.0, 0, 0, 0, 0], "spring": [900.0, 700.0, 0, 0, 0, 0]},
    "mixed": {"free": ["x", "yaw"], "mass": [30.0, 0, 0, 0, 0, 6.0], "spring": [900.0, 0, 0, 0, 0, 40.0]},
}


@pytest.mark.parametrize("name", STANDS)
def test_energy_of_rotors_on_a_stand(name):
    """The rate of the energy is the power of the drives less that of the dampers, with nothing left (section 5.10)."""
    aircraft = build(
        environment=VACUUM,
        options={"elements": 1},
        body={"stand": STANDS[name]},
        rotors=ROTORS["tilted_four_and_five_blades"],
    )
    model = Model(aircraft)
    x, psi = tumbling_state(model, 7), np.array([0.3, 1.1])
    x[S.POSITION : S.ATTITUDE] *= 0.01
    x[S.VELOCITY : S.BODY_SIZE] *= aircraft.body.stand_free  # locked axes are at rest
    rate = model.derivative(x, psi=psi)
    power = model.loads[:, R.TORQUE] @ model.speeds
    for j, rotor in enumerate(aircraft.rotors):
        rates = multiblade_matrix(rotor.blades, psi[j]) @ x[model.layout.lag_rate(j)]
        rates += rotor.speed * multiblade_matrix(rotor.blades, psi[j], 1) @ x[model.layout.lag(j)]
        power -= rotor.lag_damping * rates @ rates
    tiny = 1e-30
    found = energy(aircraft, x + 1j * tiny * rate, psi + 1j * tiny * model.speeds).imag / tiny
    assert np.abs(rate[S.VELOCITY : S.BODY_SIZE])[aircraft.body.stand_free == 0].max(initial=0.0) == 0.0
    assert abs(power) > 1.0
    assert found == pytest.approx(power, rel=1e-10)


def test_dampers_of_a_stand_take_energy():
    """A stand without blades to speak of swings as a damped oscillator in every axis alone."""
    stand = {"mass": [2.0] * 6, "spring": [50.0] * 6, "damping": [0.8] * 6}
    light = {
        "blade_mass": 1e-12,
        "blade_cg": 0.1,
        "flap_spring": 0.0,
        "lag_damping": 0.0,
        "hub": [0.0, 0.0, 0.0],
        "speed_rpm": 30.0,
    }
    model = Model(build(environment=WEIGHTLESS_VACUUM, options={"elements": 1}, body={"stand": stand}, rotors=[light]))
    for axis in range(6):
        x, amplitude, time = model.state(), 1e-4, 0.7
        if axis < 3:
            x[S.POSITION + axis] = amplitude
        else:
            x[S.ATTITUDE + axis - 2] = amplitude / 2
        steps = 400
        x = model.fly(x, steps, time / steps)
        decay = 0.8 / (2 * 2.0)
        frequency = np.sqrt(50.0 / 2.0 - decay**2)
        shape = np.cos(frequency * time) + decay / frequency * np.sin(frequency * time)
        found = x[S.POSITION + axis] if axis < 3 else 2 * x[S.ATTITUDE + axis - 2]
        assert found == pytest.approx(amplitude * np.exp(-decay * time) * shape, rel=1e-5)


# -- symmetry in flight --------------------------------------------------------------------------------------

ONE_SECOND = 2880  # steps of 5 deg at 2400 rpm
STEP = 1.0 / ONE_SECOND
PSI = np.array([0.4, 1.3])


def disturbed(model, hover):
    """Return the hover state in a turn, with every part of the body's motion, and its swashplate angles."""
    x = model.layout.from_linear(hover.state)
    x[S.VELOCITY : S.BODY_SIZE] += [1.5, -0.8, 0.6, 0.15, -0.1, 0.2]
    x[S.ATTITUDE : S.VELOCITY] = unit(1.0, 0.05, -0.03, 0.1)
    return x, hover.swashplate + [[0.01, 0.01, -0.005], [0.0, -0.004, 0.006]]


def differences(found, expected):
    """Return the differences of two states, each over the scale of its group: 10 m, 1, 10 m/s, 1 rad/s, ..."""
    scales = np.ones(len(expected))
    scales[S.POSITION : S.ATTITUDE] = scales[S.VELOCITY : S.RATES] = 10.0
    scales[S.BODY_SIZE :] = 0.1
    return np.abs(found - expected) / scales


@pytest.mark.parametrize("name", ["sbs", "sbs_paper"])
def test_mirrored_flights_are_mirrored(name, hover):
    """One second in wind, mirrored in the plane y = 0: 1e-10, though the motion is unstable."""
    data = aircraft_data(name)
    here = Model(Aircraft.from_dict(data))
    there = Model(Aircraft.from_dict(mirrored_data(data)))
    wind = np.array([2.0, -1.0, 0.5])
    x, swash = disturbed(here, hover)
    flown = here.fly(x, ONE_SECOND, STEP, swash, PSI, wind=wind)
    image = there.fly(mirrored_state(x), ONE_SECOND, STEP, mirrored_swash(swash), PSI, wind=wind * POLAR)
    assert np.abs(flown - x)[S.VELOCITY : S.RATES].max() > 0.5
    assert differences(image, mirrored_state(flown)).max() < 1e-10


def test_side_by_side_rotors_are_images_of_each_other(hover):
    """The aircraft is its own image (but for Ixy = -0.001): a symmetric flight stays symmetric to 1e-10."""
    inertia = [[3.532, 0.0, -0.052], [0.0, 2.222, 0.0], [-0.052, 0.0, 5.342]]
    model = Model(build(body={"inertia": inertia}))
    layout = model.layout
    x = layout.from_linear(hover.state)
    x[S.VELOCITY : S.RATES] += [2.0, 0.0, 1.0]
    x[S.RATES + 1] = 0.3
    x = model.fly(x, ONE_SECOND, STEP, hover.swashplate + [0.01, 0.0, 0.01])
    assert abs(x[S.VELOCITY]) > 0.5
    for part in (layout.flap, layout.flap_rate, layout.lag, layout.lag_rate, layout.inflow):
        np.testing.assert_allclose(x[part(0)], x[part(1)], atol=1e-10)
    sideways = [1, S.ATTITUDE + 1, S.ATTITUDE + 3, S.VELOCITY + 1, S.RATES, S.RATES + 2]
    np.testing.assert_allclose(x[sideways], 0, atol=1e-10)


@pytest.mark.parametrize("heading", [0.7, np.pi, -2.5])
def test_flights_in_another_heading_are_the_same_in_body_axes(sbs, hover, heading):
    """One second, turned with its wind and started elsewhere: position turned, everything else the same."""
    model = Model(sbs)
    x, swash = disturbed(model, hover)
    wind, start = np.array([2.0, -1.0, 0.5]), np.array([100.0, -50.0, -30.0])
    flown = model.fly(x, ONE_SECOND, STEP, swash, PSI, wind=wind)
    begin = turned_state(x, heading)
    begin[: S.ATTITUDE] += start
    found = model.fly(begin, ONE_SECOND, STEP, swash, PSI, wind=heading_matrix(heading) @ wind)
    found[: S.ATTITUDE] -= start
    expected = turned_state(flown, heading)
    assert differences(found, expected).max() < 1e-10


def test_place_changes_nothing(sbs, hover):
    """To the last bit."""
    model = Model(sbs)
    x, swash = disturbed(model, hover)
    flown = model.fly(x, 500, STEP, swash, PSI)
    x[: S.ATTITUDE] = [5000.0, -300.0, -1000.0]
    np.testing.assert_array_equal(model.fly(x, 500, STEP, swash, PSI)[S.ATTITUDE :], flown[S.ATTITUDE :])


def test_steady_wind_carries_the_aircraft_along(sbs, hover):
    """In air that moves steadily the flight relative to it is that of still air."""
    model = Model(sbs)
    x, swash = disturbed(model, hover)
    wind = np.array([4.0, -6.0, 1.0])
    still = model.fly(x, ONE_SECOND, STEP, swash, PSI)
    carried = x.copy()
    carried[S.VELOCITY : S.RATES] += rotation_matrix(x[S.ATTITUDE : S.VELOCITY]).T @ wind
    found = model.fly(carried, ONE_SECOND, STEP, swash, PSI, wind=wind)
    expected = still.copy()
    expected[: S.ATTITUDE] += wind
    expected[S.VELOCITY : S.RATES] += rotation_matrix(still[S.ATTITUDE : S.VELOCITY]).T @ wind
    # the step's error is not that of still air: body axes turn, the wind's components with them
    assert differences(found, expected).max() < 1e-8
