"""Measured descent: the line itself, its ends, the velocity along the disc, and what follows for flights."""

import numpy as np
import pytest
from helpers import Model, aircraft_data, build
from plain_model import plain_derivative, random_state

from sbs_sim import Aircraft, linearize, trim
from sbs_sim.model.descent import WINDMILL, measured_axial
from sbs_sim.model.inflow import inflow_matrix

# W. Castles, R. B. Gray, NACA TN 2474, Fig. 12: rate of descent and induced velocity over v_h
DESCENT = np.array([0.0, 0.4, 0.8, 1.2, 1.5, 1.6, 1.8, 2.0, 2.4])
INFLOW = np.array([1.1, 1.41, 1.8, 2.24, 2.5, 2.28, 1.68, 1.37, 0.95])
FACTOR = 1.1
MEASURED = {"descent": "measured", "induced_power_factor": FACTOR}
NO_DRAG = {"flat_plate_areas": [0.0, 0.0, 0.0]}
MASS = 8 / (3 * np.pi)


@pytest.fixture(scope="module")
def aircraft():
    return build(every_rotor=MEASURED, body=NO_DRAG)


@pytest.fixture(scope="module")
def hover_inflow(aircraft):
    """v_h of momentum theory [m/s]."""
    weight, air = aircraft.body.mass * aircraft.environment.gravity, aircraft.environment.air_density
    return np.sqrt(weight / 2 / (2 * air * np.pi * aircraft.rotors[0].radius ** 2))


def flows(rotors, lambda0, mu):
    """V_T of inflow ratios and velocities over the tip speed, shapes (n,) and (3, n), by C^lambda."""
    found = np.empty(np.shape(lambda0))
    out = np.empty((3, 3, 1))
    for i, value in enumerate(lambda0):
        inflow_matrix(rotors, 0, np.array([[value]]), np.ascontiguousarray(mu[:, i : i + 1]), 0, out)
        found[i] = -out[0, 0, 0] * MASS / 2 / rotors["inflow_speed"][0, 0]
    return found


def test_measured_line_is_met_to_the_windmill(aircraft):
    """Within 5 % of the faired line, straight between its points, over its full length, and on its points."""
    x = np.linspace(0.0, 2.779, 400)
    lambda0 = np.full(x.shape, 0.05)
    flow = flows(aircraft.model().rotors, lambda0, np.array([0 * x, 0 * x, 0.05 * x])) / lambda0  # (v_h / v)^2
    descent, inflow = x / np.sqrt(flow), FACTOR / np.sqrt(flow)
    assert descent[-1] == pytest.approx(2.4, abs=2e-3)
    assert (np.diff(descent) > 0).all()
    np.testing.assert_allclose(inflow, np.interp(descent, DESCENT, INFLOW), rtol=0.05)
    np.testing.assert_allclose(np.interp(DESCENT, descent, inflow), INFLOW, rtol=5e-3)
    # ideal autorotation: no flow through the disc
    assert np.interp(0.0, descent - inflow, descent) == pytest.approx(1.77, abs=0.02)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_climb_and_windmill_are_momentum_theorys_with_the_same_slope(aircraft, sign):
    """V_T = |lambda0 - mu_z| outside, value and slope continuous at both ends; a negative thrust turns all over."""
    rotors, lambda0 = aircraft.model().rotors, 0.04
    x = np.array([-3.0, -0.1, 0.0, WINDMILL, 9.0, 50.0])
    mu = np.array([0 * x, 0 * x, sign * lambda0 * x])
    found = flows(rotors, np.full(6, sign * lambda0), mu)
    np.testing.assert_allclose(found, lambda0 * np.abs(1 - x), rtol=1e-6)
    step = 1e-4
    for end, slope in ((0.0, -1.0), (WINDMILL, 1.0)):
        around = end + step * np.array([-1.0, 0.0, 1.0])
        mu = np.array([0 * around, 0 * around, sign * lambda0 * around])
        rises = np.diff(flows(rotors, np.full(3, sign * lambda0), mu)) / (lambda0 * step)
        np.testing.assert_allclose(rises, slope, atol=1e-3)


def test_velocity_along_the_disc_leads_back_to_momentum_theory(aircraft):
    rotors, x = aircraft.model().rotors, np.linspace(0.0, 8.0, 41)
    lambda0 = np.full(x.shape, 0.03)
    edge = 3.0 * lambda0
    found = flows(rotors, lambda0, np.array([0.6 * edge, 0.8 * edge, x * lambda0]))
    glauert = np.hypot(edge, lambda0 - x * lambda0)
    np.testing.assert_allclose(np.sqrt(glauert / found)[x <= 2.0], 1.0, rtol=0.02)  # v at one thrust
    np.testing.assert_allclose(np.sqrt(glauert / found), 1.0, rtol=0.06)


@pytest.mark.parametrize("edgewise", [0.0, 0.02, 0.1])
def test_steady_thrust_grows_with_the_inflow_everywhere(aircraft, edgewise):
    """So that every steady inflow is the only one, and dynamic inflow returns to it: also where Glauert's does not."""
    rotors, lambda0 = aircraft.model().rotors, np.linspace(1e-3, 0.3, 400)
    mu = np.array([0 * lambda0 + edgewise, 0 * lambda0, 0 * lambda0 + 0.06])
    thrust = 2.0 * lambda0 * flows(rotors, lambda0, mu)
    assert (np.diff(thrust) > 0).all()


def test_derivative_equals_the_plain_reference(aircraft):
    model, rng = Model(aircraft), np.random.default_rng(5)
    for descent in (-3.0, 2.0, 5.0, 9.0, 11.5, 14.0, 19.0, 40.0):
        x = random_state(aircraft, rng, 0.3)
        x[7:10] = rng.normal(0.0, 2.0), rng.normal(0.0, 2.0), descent
        x[3:7] = 1.0, 0.0, 0.0, 0.0
        swash, psi, wind = rng.normal(scale=0.1, size=(2, 3)), rng.uniform(0, 6, 2), np.zeros(3)
        expected, _ = plain_derivative(aircraft, x, swash, psi, wind)
        found = model.derivative(x, swash, psi, wind)
        at = slice(model.layout.inflow(0).start, None)
        np.testing.assert_allclose(found[at], expected[at], rtol=1e-9, atol=1e-9)


def test_python_and_compiled_law_are_one(aircraft):
    rotors = aircraft.model().rotors
    for x in (-1.0, 0.2, 0.5, 0.63, 1.0, 2.0, 5.0, 12.0):
        axial, growth = measured_axial(0.05, 0.05 * x)
        found = flows(rotors, [0.05], np.array([[0.0], [0.0], [0.05 * x]]))
        assert abs(axial) == pytest.approx(found[0], rel=1e-6)
        ahead, behind = measured_axial(0.05 + 1e-6, 0.05 * x)[0], measured_axial(0.05 - 1e-6, 0.05 * x)[0]
        assert growth == pytest.approx(axial + 0.05 * (ahead - behind) / 2e-6, rel=1e-4, abs=1e-6)


@pytest.mark.parametrize(("descent", "sign"), [(0.35, -1), (0.8, 1), (1.0, 1), (1.15, 1), (1.7, -1), (2.2, -1)])
def test_heave_diverges_where_the_line_is_steeper_than_one(aircraft, hover_inflow, descent, sign):
    """Thrust damping turns over between 0.65 and 1.31 v_h on the line; Johnson's ring spans 0.45 to 1.5."""
    model = linearize(aircraft, climb_rate=-descent * hover_inflow)
    heave = [mode for mode in model.modes if mode.name.startswith("heave")]
    assert len(heave) == 1
    assert np.sign(heave[0].pole.real) == sign


def test_power_in_descent_is_that_of_the_line(aircraft, hover_inflow):
    """P = T (v - V_d) + P_0, P_0 hardly changing with it: from 1 to 2 v_h by the difference of v - V_d of the line."""
    powers = {}
    for descent in (0.8, 1.6, 2.0):
        point = trim(aircraft, climb_rate=-descent * hover_inflow)
        powers[descent] = float(np.sum(point.power))
    weight = aircraft.body.mass * aircraft.environment.gravity
    flow = dict(zip(DESCENT, INFLOW - DESCENT, strict=True))
    for first, last in ((0.8, 1.6), (1.6, 2.0)):
        drop = weight * hover_inflow * (flow[first] - flow[last])
        assert powers[first] - powers[last] == pytest.approx(drop, rel=0.06)


@pytest.mark.parametrize("descent", [1.9, 2.1])
def test_vertical_autorotation_feeds_the_profile_power(aircraft, hover_inflow, descent):
    """A free rotor: T (V_d - v) is its profile power, found from drag alone, at v of the line for its thrust."""
    drives = [{"rotors": ["R1", "R2"]}]
    data = aircraft_data(every_rotor={**MEASURED, "airfoil": "thin_2pi"}, body=NO_DRAG)
    free = Aircraft.from_dict({**data, "drives": drives})
    point = trim(free, climb_rate=-descent * hover_inflow)
    rotor, speed = free.rotors[0], float(point.rotor_speed[0])
    assert abs(point.power).max() < 1e-6 * 2300
    v = float(np.interp(descent, DESCENT, INFLOW)) * hover_inflow
    span, _, half_area, _, _ = rotor.elements(free.options.elements)
    profile = 3 * np.sum(1.225 * half_area * 0.01 * (speed * (rotor.hinge_offset + span)) ** 3)
    thrust = free.body.mass * free.environment.gravity / 2
    assert thrust * (descent * hover_inflow - v) == pytest.approx(profile, rel=0.1)
