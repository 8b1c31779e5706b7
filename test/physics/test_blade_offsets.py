"""Blades whose quarter chord and mass are off the pitch axis, and underslung hinges (theory.md sections 2.6 to 4.7).

Their equations are compared with the plain model in test_dynamics; here is what is conserved, and closed forms.
"""

import numpy as np
import pytest
from balances import at_speeds, azimuths, rates_of_totals, totals
from helpers import OFFSET_BLADE, VACUUM, WEIGHTLESS_VACUUM, Model, aircraft_data, unit
from plain_model import first_moment, make_blades, plain_derivative, split_state

from sbs_sim import Aircraft, trim
from sbs_sim.analysis.isolated_rotor import IsolatedRotor
from sbs_sim.errors import AircraftError
from sbs_sim.flight.trim_point import Fidelity
from sbs_sim.flight.validity import blade_warnings
from sbs_sim.model import records as R
from sbs_sim.model import state as S

G = 9.80665
TEETERING = OFFSET_BLADE | {"blades": 2, "hinge_offset": 0.0, "flap_hinge_offset": 0.0, "flap_hinge": "teetering"}
TEETERING |= {"undersling": 0.03, "flap_rest_deg": 3.0}
ROTORS = {
    "hinges of each blade": [
        OFFSET_BLADE | {"shaft_direction": unit(0.1, -0.2, -1.0), "blades": 4},
        OFFSET_BLADE | {"shaft_direction": unit(-0.2, 0.3, -0.9), "blades": 5, "speed_rpm": 2100.0},
        {"hub": [-1.2, 0.1, -0.2], "shaft_direction": [0.0, 1.0, 0.0], "speed_rpm": 3600.0, "blade_mass": 0.05},
    ],
    "teetering, underslung": [
        TEETERING | {"shaft_direction": unit(0.1, -0.2, -1.0)},
        TEETERING | {"shaft_direction": unit(-0.2, 0.3, -0.9), "speed_rpm": 2100.0},
        {"hub": [-1.2, 0.1, -0.2], "shaft_direction": [0.0, 1.0, 0.0], "speed_rpm": 3600.0, "blade_mass": 0.05},
    ],
}
DRIVES = [{"rotors": ["R1", "R3"], "inertia": 0.02, "inertia_axis": [0.0, 0.6, 0.1]}, {"rotors": ["R2"]}]
PSI = np.array([0.3, 0.7, 1.1])
SWASH = np.array([[0.1, 0.12, -0.13], [0.12, -0.1, 0.15], [0.05, 0.0, 0.0]])


def aircraft_of(name, drives=(), gravity=G):
    data = aircraft_data(environment={**VACUUM, "gravity": gravity}, options={"elements": 1}, rotors=ROTORS[name])
    return Aircraft.from_dict(data | ({"drives": list(drives)} if drives else {}))


def tumbling(model, speeds=()):
    """Return a state that tumbles, whose blades flap and lag; teetering ones are at their precone."""
    rng, layout, n = np.random.default_rng(5), model.layout, model.layout.blade_count
    x = model.state(rng.normal(scale=5.0, size=3), rng.normal(scale=1.0, size=3))
    x[S.ATTITUDE : S.VELOCITY] = unit(*rng.normal(size=4))
    for block, scale in ((0, 0.05), (1, 5.0), (2, 0.05), (3, 5.0)):
        first = S.BODY_SIZE + block * n
        x[first : first + n] = rng.normal(scale=scale, size=n)
    for j, rotor in enumerate(model.aircraft.rotors):
        if rotor.is_teetering:
            x[layout.flap(j).start], x[layout.flap_rate(j).start] = rotor.flap_rest, 0.0
    for i, speed in enumerate(speeds):
        x[layout.drive(i)["Omega"]] = speed
    return x


def lag_dampers(model, x, psi):
    """Return the power that the lag dampers take [W]."""
    aircraft, power = at_speeds(model.aircraft, x), 0.0
    state = split_state(aircraft, x[: model.layout.drives_start])
    for rotor, blades in zip(aircraft.rotors, make_blades(aircraft, state, psi), strict=True):
        power += sum(rotor.lag_damping * blade.lag_rate**2 for blade in blades)
    return power


@pytest.mark.parametrize("drives", [(), DRIVES], ids=["constant speed", "drives"])
@pytest.mark.parametrize("name", ROTORS)
def test_rates_of_momentum_and_energy(name, drives):
    """With cyclic pitch: momentum changes by the weight, energy by what the shafts give less the lag dampers.

    The shafts give what pitches the blades, too; without an engine those of drives give nothing.
    """
    model = Model(aircraft_of(name, drives))
    x = tumbling(model, [230.0, -90.0][: len(drives)])
    dx = model.derivative(x, SWASH, PSI)
    psi, plain = azimuths(model.aircraft, x, PSI), at_speeds(model.aircraft, x)
    p, h, power = rates_of_totals(model.aircraft, x, dx, PSI, SWASH)
    weight = np.array([0.0, 0.0, G])
    np.testing.assert_allclose(p, model.aircraft.body.mass * weight, atol=1e-9 * 1e3)
    first = first_moment(plain, x[: model.layout.drives_start], psi, SWASH)
    np.testing.assert_allclose(h, np.cross(first, weight), atol=1e-9 * 1e3)
    given = 0.0 if drives else model.loads[:, R.TORQUE] @ model.speeds
    if drives:
        dampers = lag_dampers(model, x, psi)
    else:
        dampers = lag_dampers(model, x, PSI)
        assert abs(given) > 1.0
    assert power == pytest.approx(given - dampers, rel=1e-9, abs=1e-7)


@pytest.mark.parametrize("name", ROTORS)
def test_a_flight_keeps_momentum_and_energy(name):
    """Rotors that turn freely, with cyclic pitch: two revolutions by steps of a quarter of a degree."""
    rotors = [rotor | {"lag_damping": 0.0} for rotor in ROTORS[name]]
    data = aircraft_data(environment=WEIGHTLESS_VACUUM, options={"elements": 1}, rotors=rotors) | {"drives": DRIVES}
    model = Model(Aircraft.from_dict(data))
    x = tumbling(model, [200.0, -150.0])
    before, start = totals(model.aircraft, x, PSI, SWASH), x
    x = model.fly(x, 2880, np.radians(0.25) / 250.0, SWASH, PSI)
    for found, expected in zip(totals(model.aircraft, x, PSI, SWASH), before, strict=True):
        np.testing.assert_allclose(found, expected, atol=1e-8 * max(1.0, np.abs(expected).max()))
    speeds = [model.layout.drive(i)["Omega"] for i in range(2)]
    assert np.abs(x[speeds] - start[speeds]).min() > 0.2


# -- closed forms --------------------------------------------------------------------------------------------

THIN = {"hinge_offset": 0.0, "flap_hinge_offset": 0.0, "twist_deg": {"root": 0.0, "tip": 0.0}, "root_cutout": 0.0}


def test_a_blade_with_constant_sweep_is_a_straight_blade_that_lags():
    """All quarter chords on a line through the axis, no pitch: R / cos, c cos, and the azimuth behind by the sweep."""
    sweep, radius, chord = np.radians(25.0), 0.5, 0.05
    rotor = THIN | {"radius": radius, "chord": {"root": chord, "tip": chord}, "swashplate_phase_deg": 0.0}
    line = {"quarter_chord": {"root": 0.0, "tip": -radius * np.tan(sweep)}}
    straight = {"radius": radius / np.cos(sweep), "chord": dict.fromkeys(("root", "tip"), chord * np.cos(sweep))}
    swept = Model(Aircraft.from_dict(aircraft_data(rotors=[rotor | line])))
    other = Model(Aircraft.from_dict(aircraft_data(rotors=[rotor | straight])))
    x = swept.state([14.0, 3.0, 6.0], [0.2, -0.1, 0.3])
    for psi in (0.3, 2.0, 4.4):
        swept.derivative(x, psi=np.array([psi]))
        other.derivative(x, psi=np.array([psi - sweep]))
        assert swept.loads[0, R.THRUST] == pytest.approx(other.loads[0, R.THRUST], rel=1e-9)
    assert abs(swept.loads[0, R.THRUST]) > 1.0


def test_mass_ahead_of_the_pitch_axis_falls_back_to_the_plane():
    """In a vacuum, -beta A_1 nu^2 = theta (Int s x dm + e_0 Int x dm), to first order in the pitch."""
    offset, pitch = 0.006, 1e-3
    changes = {"chordwise_cg": {"root": offset, "tip": offset}, "twist_deg": {"root": 0.0, "tip": 0.0}}
    aircraft = Aircraft.from_dict(aircraft_data(environment=WEIGHTLESS_VACUUM, rotors=[changes]))
    rotor, point = aircraft.rotors[0], IsolatedRotor(aircraft, Fidelity(lead_lag=False)).steady((pitch, 0.0, 0.0))
    stiffness = rotor.second_moment + rotor.hinge_offset * rotor.first_moment + rotor.flap_spring / rotor.speed**2
    expected = -pitch * offset * (rotor.first_moment + rotor.hinge_offset * rotor.blade_mass) / stiffness
    assert point.state[aircraft.layout.flap(0).start] == pytest.approx(expected, rel=1e-3)


def test_an_underslung_rotor_leaves_its_hub_at_rest():
    """Where the hinge is at the c.g. of both blades, flapping in a vacuum exerts no force in the plane of the hub."""
    forces = []
    for height in (0.0, None):
        rotor = {"blades": 2, "hinge_offset": 0.0, "flap_hinge_offset": 0.0, "flap_hinge": "teetering"}
        rotor |= {"flap_spring": 0.0, "flap_rest_deg": 4.0, "blade_cg": 0.25}
        rotor["undersling"] = 0.25 * np.sin(np.radians(4.0)) if height is None else height
        aircraft = Aircraft.from_dict(
            aircraft_data(environment=WEIGHTLESS_VACUUM, rotors=[rotor], body={"stand": {"free": []}})
        )
        model = Model(aircraft, lead_lag=False)
        x = model.state()
        x[model.layout.flap(0)] = [aircraft.rotors[0].flap_rest, 0.08]
        model.derivative(x, psi=np.array([0.7]))
        forces.append(np.abs(model.loads[0, R.FORCE : R.FORCE + 2]).max())
    assert forces[0] > 10.0
    assert forces[1] < 1e-9 * forces[0]


def test_a_distribution_of_mass_has_its_own_moments():
    """A table of mass with a step and a tip mass, and offsets by tables, against the plain model."""
    data = aircraft_data(rotors=[OFFSET_BLADE, OFFSET_BLADE], options={"elements": 5})
    for rotor in data["rotors"]:
        for key in ("blade_mass", "blade_cg"):
            del rotor[key]
        rotor["mass_distribution"] = {
            "stations": [0.2, 0.6, 0.6, 1.0],
            "values": [0.5, 0.4, 0.3, 0.2],
            "tip_mass": 0.01,
        }
    aircraft = Aircraft.from_dict(data)
    model = Model(aircraft)
    x, found = tumbling(model), []
    found = model.derivative(x, SWASH[:2], PSI[:2])
    expected, loads = plain_derivative(aircraft, x, SWASH[:2], PSI[:2], np.zeros(3))
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())
    np.testing.assert_allclose(model.loads[:, R.TORQUE], loads["torque"], atol=1e-9 * np.abs(model.loads).max())


def test_blades_or_flights_in_the_lanes_give_the_same_bits():
    for name in ROTORS:
        found = []
        for lanes in ("blades", "points"):
            model = Model(aircraft_of(name, DRIVES), lanes=lanes)
            x = tumbling(model, [230.0, -90.0])
            found.append(model.derivative(x, SWASH, PSI).tobytes() + model.loads.tobytes())
        assert found[0] == found[1]


def test_blades_that_would_twist_or_flutter_are_said():
    far = {"quarter_chord": {"stations": [0.9, 1.0], "values": [0.0, -0.03]}}
    heavy = {"chordwise_cg": {"root": -0.003, "tip": -0.003}}
    fine = {"quarter_chord": {"root": 0.002, "tip": 0.002}, "chordwise_cg": {"root": 0.003, "tip": 0.003}}
    for changes, words in ((far, "without torsion"), (heavy, "without flutter"), (fine, "")):
        said = blade_warnings(Aircraft.from_dict(aircraft_data(rotors=[changes])).rotors[0])
        assert [words in line for line in said] == ([True] if words else [])
    assert any("without torsion" in line for line in trim(Aircraft.from_dict(aircraft_data(every_rotor=far))).warnings)


@pytest.mark.parametrize("option", [{"tip_loss_model": "prandtl"}, {"profile_drag": "oblique"}])
def test_no_rotor_beside_offsets_has_options_of_sections(option):
    """All blades of the aircraft meet the air as those with offsets do, which know neither."""
    offsets = {"quarter_chord": {"root": 0.0, "tip": 0.01}}
    for rotors in ([offsets | option, {}], [offsets, option]):
        with pytest.raises(AircraftError, match="where a rotor of the aircraft has offsets of its blades are factor"):
            Aircraft.from_dict(aircraft_data(rotors=rotors))


def test_paper_coupling_has_no_offsets():
    with pytest.raises(
        AircraftError, match=r"options\.coupling = 'paper': allowed with offsets of the blade is complete"
    ):
        Aircraft.from_dict(aircraft_data("sbs_paper", rotors=[{"quarter_chord": {"root": 0.0, "tip": 0.01}}]))
