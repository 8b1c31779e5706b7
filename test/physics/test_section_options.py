"""Prandtl's tip loss and drag along the local flow, against closed forms and the plain reference."""

import numpy as np
import pytest
from helpers import Model, build, write_airfoil
from plain_model import prandtl, random_state
from test_dynamics import largest_error, stand

from sbs_sim.lanes import as_quads
from sbs_sim.model import records as R
from sbs_sim.model.kernel import entry
from sbs_sim.model.section_options import mean_factor, tip_series

OPTIONS = {
    "tip loss": {"tip_loss_model": "prandtl"},
    "oblique drag": {"profile_drag": "oblique"},
    "both": {"tip_loss_model": "prandtl", "profile_drag": "oblique", "induced_power_factor": 1.1},
    "of one rotor": [{"tip_loss_model": "prandtl"}, {"profile_drag": "oblique"}],
}
WEIGHTLESS = {"gravity": 0.0}
FROM_THE_AXIS = {"hinge_offset": 1e-4, "flap_hinge_offset": 1e-4, "twist_deg": {"root": 0.0, "tip": 0.0}}


@pytest.mark.parametrize("name", OPTIONS)
def test_derivative_and_loads_equal_the_plain_reference(name):
    options = OPTIONS[name]
    changes = {"rotors": options} if isinstance(options, list) else {"every_rotor": options}
    aircraft, rng = build(**changes), np.random.default_rng(3)
    for size in (0.1, 1.0):
        x = random_state(aircraft, rng, size)
        case = x, rng.normal(scale=0.1, size=(2, 3)), rng.uniform(0, 6, 2), rng.normal(scale=8.0, size=3)
        assert largest_error(aircraft, case) < 1e-12


@pytest.fixture(scope="module")
def airfoils(tmp_path_factory):
    """Folder with a section of drag alone, and one with a lift slope of 2 pi and no drag."""
    folder = tmp_path_factory.mktemp("airfoils")
    write_airfoil(folder / "drag.csv", lambda _: 0.0, lambda _: 0.01)
    write_airfoil(folder / "lift.csv", lambda alpha: 2 * np.pi * np.sin(alpha), lambda _: 1e-6)
    return folder


def thrust_of(folder, lambda0, **rotor):
    """Thrust of one rotor in hover with an inflow that is given, by its loads."""
    values = {"airfoil": "lift", **FROM_THE_AXIS, **rotor}
    model = Model(stand(environment=WEIGHTLESS, folder=folder, options={"elements": 80}, **values), lead_lag=False)
    return model.averaged(model.state(lambda0=lambda0), [[0.2, 0.0, 0.0]])[1][0, R.THRUST]


@pytest.mark.parametrize(("blades", "lambda0"), [(4, 0.03), (3, 0.02)])
def test_few_blades_lose_the_tip_of_prandtl(airfoils, blades, lambda0):
    """The lift that is missing is that of 1 - B = 2 ln 2 lambda / (N_b sqrt(1 + lambda^2)): Int arcsin e^-f df."""
    thrust = thrust_of(airfoils, lambda0, blades=blades, tip_loss_model="prandtl")
    lost = 1.0 - 2.0 * np.log(2.0) * lambda0 / (blades * np.hypot(1.0, lambda0))
    assert thrust == pytest.approx(thrust_of(airfoils, lambda0, blades=blades, tip_loss=lost), rel=2e-3)
    assert thrust < 0.98 * thrust_of(airfoils, lambda0, blades=blades)


@pytest.mark.parametrize("lambda0", [0.06, 0.12])
def test_thrust_with_prandtls_factor_is_that_of_the_integral(airfoils, lambda0):
    rotor = stand(folder=airfoils, airfoil="lift", **FROM_THE_AXIS).rotors[0]
    r = 1e-4 / rotor.radius + (1 - 1e-4 / rotor.radius) * (np.arange(20000) + 0.5) / 20000
    u_t, u_p = rotor.speed * rotor.radius * r, rotor.speed * rotor.radius * lambda0
    lift = 2 * np.pi * np.sin(0.2 - np.arctan2(u_p, u_t)) * np.hypot(u_t, u_p) * u_t * prandtl(rotor, r, lambda0)
    expected = 0.5 * 1.225 * rotor.blades * rotor.chord_root * rotor.radius * lift.mean()
    assert thrust_of(airfoils, lambda0, tip_loss_model="prandtl") == pytest.approx(expected, rel=1e-3)


def test_elements_have_the_mean_of_prandtls_factor():
    """Two points of Gauss against 2000: within 1 % of the lift of the outermost of 20 elements."""
    rotor = build(every_rotor={"blades": 3}).rotors[0]
    outer = np.linspace(0.95, 1.0, 2001)[:-1] + 0.0125e-3
    middle, gauss = 0.975, 0.025 / np.sqrt(3.0)
    mean = prandtl(rotor, outer, 0.06).mean()
    assert prandtl(rotor, np.array([middle - gauss, middle + gauss]), 0.06).mean() == pytest.approx(mean, rel=0.02)


@entry
def mean_factors(given, out):
    """Mean factors, shape (n, 4), of outer decays and of the ratios of the inner ones to them, (n, 2, 4)."""
    decays, found = as_quads(given), as_quads(out)
    for i in range(out.shape[0]):
        found[i] = mean_factor(decays[i, 0], decays[i, 1], tip_series(decays[i, 1]))


@pytest.mark.parametrize("ratio", [0.0, 0.1, 0.6, 1.0])
def test_the_mean_of_two_decays_is_that_of_the_arccosines(ratio):
    outer = np.concatenate([np.geomspace(1e-18, 1.0, 4000), 0.05 + np.linspace(-1e-9, 1e-9, 8)]).reshape(-1, 4)
    decays, out = np.stack([outer, np.full_like(outer, ratio)], axis=1), np.empty_like(outer)
    mean_factors(decays, out)
    exact = np.arccos(np.stack([outer, ratio * outer])).mean(axis=0) * 2 / np.pi
    np.testing.assert_allclose(out, exact, rtol=0, atol=4e-16)
    assert (out[outer < 5e-17] == 1.0).all()


def profile_power(folder, mu, **rotor):
    """Power of torque and force along the disc over that in hover, of sections with nothing but drag."""
    values = {"airfoil": "drag", **FROM_THE_AXIS, **rotor}
    aircraft = stand(environment=WEIGHTLESS, folder=folder, options={"elements": 80}, **values)
    model, one = Model(aircraft, lead_lag=False), aircraft.rotors[0]
    velocity = mu * one.speed * one.radius
    loads = model.averaged(model.state((velocity, 0.0, 0.0)), [[0.0, 0.0, 0.0]], 72)[1][0]
    air, tip = aircraft.environment.air_density, one.speed * one.radius
    hover = one.blades * one.chord_root * 0.01 * air * one.radius * tip**3 / 8
    return (abs(loads[R.TORQUE]) * one.speed - loads[R.FORCE] * velocity) / hover


def exact_power(mu, along):
    """4 <Int (u_T^2 + along u_R^2)^(3/2) dr>, reverse flow included: W. Johnson, Helicopter Theory, section 5-12."""
    r, psi = (np.arange(800) + 0.5) / 800, (np.arange(720) + 0.5) * 2 * np.pi / 720
    u_t, u_r = r[:, None] + mu * np.sin(psi), along * mu * np.cos(psi)
    return 4 * np.mean((u_t**2 + u_r**2) ** 1.5)


@pytest.mark.parametrize("mu", [0.0, 0.1, 0.2, 0.35])
def test_profile_power_over_the_advance_ratio(airfoils, mu):
    """Glauert's 1 + 4.65 mu^2 with the flow along the span, 1 + 3 mu^2 + 3/8 mu^4 and reverse flow without."""
    oblique, section = profile_power(airfoils, mu, profile_drag="oblique"), profile_power(airfoils, mu)
    assert oblique == pytest.approx(exact_power(mu, 1.0), rel=5e-4)
    assert section == pytest.approx(exact_power(mu, 0.0), rel=5e-4)
    assert oblique == pytest.approx(1 + 4.65 * mu**2, rel=0.015)
    assert section == pytest.approx(1 + 3 * mu**2, rel=0.01)
