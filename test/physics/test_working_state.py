"""Reports of a flight besides its state, against their definitions: working states of rotors, the lowest point."""

import math

import numpy as np
import plain_model
import pytest
from helpers import Model, build, unit

from sbs_sim.flight import validity
from sbs_sim.model import state as S
from sbs_sim.model import working_state as W
from sbs_sim.model.frames import euler_to_quaternion, hub_axes, rotation_matrix
from sbs_sim.model.ground import lowest_point
from sbs_sim.model.working_state import WORKING_SIZE, working_state

OWN_SHAFTS = [{"shaft_direction": unit(0.1, -0.2, -1.0)}, {"shaft_direction": unit(-0.15, 0.3, -0.9), "blades": 5}]
# What makes every term of a section's place, area and angle count: twist, taper, a root without lift.
BLADES = {"twist_deg": {"root": 9.0, "tip": -4.0}, "chord": {"root": 0.06, "tip": 0.03}, "root_cutout": 0.03}
# Between knots of which no two lie alike, and within the angles that the sections meet.
STALL = np.array([[2e4, 5e4, 1.2e5, 1.9e5], [0.02, 0.16, 0.06, 0.2], [-0.02, -0.13, -0.03, -0.1]])


def working(model):
    """Working states of the last derivative with the angles of STALL, shape (n_rotors, WORKING_SIZE)."""
    engine = model.engine
    blades, ends = engine.model.blades, np.broadcast_to(STALL[0, [0, -1], np.newaxis], (2, STALL.shape[1]))
    rows = np.concatenate([STALL, ends])[..., np.newaxis]
    stall = np.broadcast_to(rows, (len(blades), 1, *rows.shape[:-1], blades["rotor_speed"].shape[-1]))
    known = engine.model._replace(stall=stall.copy())
    out = engine.memory(len(model.speeds), WORKING_SIZE)
    working_state(known, engine.work, out)
    return out[..., 0]


def deepest(model, x):
    """Down coordinate of the lowest point [m]."""
    out = model.engine.memory(1)
    lowest_point(model.engine.model.ground, model.engine.model.rotors, model.lanes(x), out)
    return float(out[0, 0])


def sections(rotor, elements, azimuth, velocity, collective, induced):
    """Area, angle of attack, tangential velocity and speed of the sections of a straight blade in level flight.

    theory.md sections 1 and 4: the blade points along (-cos psi, G sin psi) and moves along (sin psi, G cos psi).
    """
    length = rotor.radius - rotor.hinge_offset
    edges = np.linspace(rotor.root_cutout, length, elements + 1)
    s, ds = (edges[1:] + edges[:-1]) / 2, np.diff(edges)
    r = rotor.hinge_offset + s
    share = s / length
    chord = rotor.chord_root + (rotor.chord_tip - rotor.chord_root) * share
    twist = rotor.twist_root + (rotor.twist_tip - rotor.twist_root) * share
    u_t = rotor.speed * r + velocity[0] * np.sin(azimuth) + rotor.rotation * velocity[1] * np.cos(azimuth)
    u_p = induced - velocity[2]
    return r * ds, collective + twist - np.arctan2(u_p, u_t), u_t, np.hypot(u_t, u_p), chord


@pytest.mark.parametrize(
    ("velocity", "elements"),
    [((50.0, 10.0, 3.0), 13), ((-30.0, 40.0, -4.0), 20), ((10.0, -60.0, 8.0), 33), ((-70.0, -20.0, 0.0), 131)],
)
def test_shares_of_the_disc_are_those_of_its_sections(velocity, elements):
    """Areas of annuli r dr: stalled by the angles at the Reynolds number, reversed by u_T <= 0, or in no table."""
    aircraft = build(every_rotor=BLADES, rotors=[{}, {"blades": 5}], options={"elements": elements})
    model, collective, lambda0 = Model(aircraft), 0.1, 0.02
    azimuths = np.array([0.4, 2.9])
    x = model.state(velocity, lambda0=lambda0)
    model.derivative(x, [[collective, 0.0, 0.0]] * 2, azimuths)
    out = working(model)
    for j, rotor in enumerate(aircraft.rotors):
        area = stalled = turned = outside = 0.0
        for k in range(rotor.blades):
            azimuth = azimuths[j] + 2 * np.pi * k / rotor.blades
            induced = lambda0 * rotor.speed * rotor.radius
            part, alpha, u_t, speed, chord = sections(rotor, elements, azimuth, velocity, collective, induced)
            reynolds = speed * chord / aircraft.environment.kinematic_viscosity
            low, high = np.interp(reynolds, STALL[0], STALL[2]), np.interp(reynolds, STALL[0], STALL[1])
            area += part.sum()
            turned += part[u_t <= 0].sum()
            outside += part[(reynolds < STALL[0, 0]) | (reynolds > STALL[0, -1])].sum()
            stalled += part[(u_t > 0) & ((alpha < low) | (alpha > high))].sum()
        assert stalled > 0.02 * area
        assert turned > 0.02 * area
        assert outside > 0.02 * area
        assert out[j, 4:7] == pytest.approx([stalled / area, turned / area, outside / area], abs=1e-12)


@pytest.mark.parametrize("collective", [0.15, -0.15])
def test_velocities_of_a_rotor_are_along_its_thrust(collective):
    """Hover inflow is that of T = rho pi R^2 v^2 / (2 a_w^2); of a thrust that points down, all signs turn round."""
    aircraft = build(rotors=OWN_SHAFTS)
    model, lambda0 = Model(aircraft), 0.01
    velocity, rates = np.array([12.0, -7.0, 4.0]), np.array([0.5, -0.3, 0.8])
    x = model.state(velocity, rates, lambda0=lambda0)
    model.derivative(x, [[collective, 0.0, 0.0]] * 2)
    out = working(model)
    _, loads = plain_model.plain_derivative(
        aircraft, x, np.array([[collective, 0.0, 0.0]] * 2), np.zeros(2), np.zeros(3)
    )
    for j, rotor in enumerate(aircraft.rotors):
        tip = rotor.speed * rotor.radius
        hub = velocity + np.cross(rates, rotor.hub)
        along = float(hub @ rotor.shaft_direction)
        sign = np.sign(loads["thrust"][j])
        assert sign == np.sign(collective)
        edgewise = np.linalg.norm(hub - along * np.array(rotor.shaft_direction)) / tip
        thrust = abs(loads["thrust"][j]) / (aircraft.environment.air_density * np.pi * rotor.radius**2 * tip**2)
        expected = [edgewise, rotor.duct_expansion * np.sqrt(2 * thrust), -sign * along / tip]
        assert out[j, :3] == pytest.approx(expected, rel=1e-9)
        assert out[j, 3] == pytest.approx(sign * (lambda0 + along / tip), rel=1e-9)


@pytest.mark.parametrize("seed", range(4))
def test_the_lowest_point_is_that_of_all_rims(seed):
    aircraft = build(rotors=OWN_SHAFTS)
    model, rng = Model(aircraft), np.random.default_rng(seed)
    attitude = euler_to_quaternion(*rng.uniform(-3, 3, 3))
    x = model.state()
    x[S.POSITION : S.ATTITUDE], x[S.ATTITUDE : S.VELOCITY] = rng.normal(scale=30.0, size=3), attitude
    angle = np.linspace(0, 2 * np.pi, 100_001)
    points = [np.zeros((1, 3))]
    for rotor in aircraft.rotors:
        axes = hub_axes(rotor.shaft_direction)
        circle = np.outer(np.cos(angle), axes[:, 0]) + np.outer(np.sin(angle), axes[:, 1])
        points.append(np.array(rotor.hub) + rotor.radius * circle)
    down = x[2] + np.concatenate(points) @ rotation_matrix(attitude)[2]
    assert deepest(model, x) == pytest.approx(down.max(), abs=1e-8)


def test_the_lowest_point_is_the_centre_of_gravity_under_high_rotors():
    model = Model(build(rotors=[{"hub": [0.0, -0.645, -0.2]}, {"hub": [0.0, 0.645, -0.2]}]))
    x = model.state()
    x[2] = -7.0
    assert deepest(model, x) == -7.0


def test_the_lines_of_a_flight_are_those_of_its_instants(sbs):
    """Also of instants at the limits and beyond, and of what is no number."""
    rng, shape = np.random.default_rng(1), (3000, len(sbs.rotors))
    rows = np.zeros((*shape, W.WORKING_SIZE))
    rows[..., W.ADVANCE_RATIO] = rng.choice([0.0, 0.1, 0.4, 0.41], shape)
    rows[..., W.HOVER_INFLOW] = rng.choice([0.001, 0.05, 0.1], shape)
    rows[..., W.DESCENT] = rng.choice([-1.0, 0.44, 0.45, 0.46, 1.6], shape) * rows[..., W.HOVER_INFLOW]
    rows[..., W.FLOW] = rng.choice([-1.0, 1.0], shape)
    for column in (W.STALLED, W.REVERSED, W.OUTSIDE):
        rows[..., column] = rng.choice([0.0, 0.1, 0.11, math.nan], shape, p=[0.7, 0.2, 0.05, 0.05])
    quiet = 0
    for row in rows:
        expected = validity.warnings(sbs, row)
        quiet += not expected
        assert list(validity.flight_warnings(sbs, row[np.newaxis])) == expected
    assert 100 < quiet < 2900
    assert list(validity.flight_warnings(sbs, rows[:0])) == []
