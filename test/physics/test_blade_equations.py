"""Blade accelerations of the plain reference against Lagrange's equations (theory.md section 3)."""

import numpy as np
import plain_model
import pytest
from lagrangian import blade_accelerations

TOLERANCE = 1e-9


def odd_aircraft(rng, blades=3, **options):
    """Return an aircraft with every feature of hinge, spring, damper and shaft in play."""
    shafts = []
    for _ in range(2):
        shaft = np.array([0.0, 0.0, -1.0]) + rng.normal(scale=0.3, size=3)
        shafts.append(shaft / np.linalg.norm(shaft))
    return plain_model.table6_aircraft(
        options={"elements": 5, **options},
        rotors={
            "blades": blades,
            "shaft_direction": shafts,
            "hub": [rng.normal(scale=0.6, size=3) for _ in range(2)],
            "hinge_offset": 0.09,
            "flap_hinge_offset": 0.035,
            "blade_inertia": [0.0121, None],
            "lag_spring": 25.0,
            "flap_rest": 0.05,
            "lag_rest": [-0.12, 0.08],
            "lag_damping": 0.4,
            "pitch_flap_coupling": 0.3,
            "pitch_lag_coupling": -0.2,
            "twist_root": 0.1,
            "twist_tip": -0.05,
            "duct_expansion": 0.8,
        },
    )


def largest_error(ac, rng, lead_lag=True):
    """Return the largest relative difference of beta'' or xi'' over all blades of one random state."""
    x = plain_model.random_state(ac, rng)
    psi = rng.uniform(0, 2 * np.pi, size=2)
    swash = rng.normal(scale=0.1, size=(2, 3))
    wind = rng.normal(scale=5.0, size=3)
    dx, loads = plain_model.plain_derivative(ac, x, swash, psi, wind, lead_lag)
    state = plain_model.split_state(ac, x, lead_lag)
    instant = plain_model.make_instant(ac, x, swash, psi, wind, lead_lag)
    om, om_dot = state.rate, dx[10:13]
    origin_acceleration = dx[7:10] + np.cross(om, state.velocity)
    worst = 0.0
    for j, rotor in enumerate(ac.rotors):
        if ac.options.coupling == "paper":
            # The reading neglects the hub's acceleration: a body that moves so that the hub has none.
            om_dot = np.zeros(3)
            origin_acceleration = -np.cross(om, np.cross(om, rotor.hub))
        to_axis = ac.options.flap_inertia == "axis_to_tip"
        inertia = plain_model.flap_inertia(rotor, rotor.radius) if to_axis else None
        for k, blade in enumerate(instant.blades[j]):
            expected = blade_accelerations(
                rotor,
                (*plain_model.hub_axes(rotor.shaft_direction), np.asarray(rotor.shaft_direction)),
                (blade.flap, blade.lag),
                (blade.flap_rate, blade.lag_rate),
                blade.azimuth,
                (state.velocity, origin_acceleration, om, om_dot),
                instant.gravity,
                instant.air_loads[j][k],
                inertia,
                lead_lag,
            )
            found = loads["flap_acceleration"][j][k], loads["lag_acceleration"][j][k]
            worst = max(worst, np.abs(np.subtract(found, expected)).max() / np.abs(expected).max())
    return worst


@pytest.mark.parametrize("coupling", ["complete", "paper"])
@pytest.mark.parametrize("flap_inertia", ["hinge_to_tip", "axis_to_tip"])
@pytest.mark.parametrize("lead_lag", [True, False])
def test_blade_accelerations_follow_lagrange(coupling, flap_inertia, lead_lag):
    """Both senses of rotation, a moving body, tilted shafts, air loads, springs and a damper."""
    rng = np.random.default_rng(7)
    for _ in range(3):
        ac = odd_aircraft(rng, coupling=coupling, flap_inertia=flap_inertia)
        assert {rotor.rotation for rotor in ac.rotors} == {1, -1}
        assert largest_error(ac, rng, lead_lag) < TOLERANCE


def test_blade_accelerations_follow_lagrange_for_other_blade_counts():
    """Two blades, and four, five and six, whose multiblade transforms have more than three coordinates."""
    rng = np.random.default_rng(8)
    for blades in ([4, 5], [3, 6], [2, 2]):
        assert largest_error(odd_aircraft(rng, blades=blades), rng) < TOLERANCE


def test_blade_accelerations_follow_lagrange_on_the_papers_aircraft():
    """Table 6 as printed, at the size of a real manoeuvre."""
    rng = np.random.default_rng(9)
    ac = plain_model.table6_aircraft(options={"elements": 5})
    assert max(largest_error(ac, rng) for _ in range(3)) < TOLERANCE
