"""Rotors with two blades: periodic flight, Floquet's exponents about it, and rotors alone (theory.md section 8.6)."""

import math

import numpy as np
import pytest
from helpers import WEIGHTLESS_VACUUM, aircraft_data, build, linear_airfoil

from sbs_sim import linearize, simulate, sweep, trim
from sbs_sim.aircraft import Aircraft
from sbs_sim.analysis.floquet import floquet
from sbs_sim.analysis.isolated_rotor import IsolatedRotor
from sbs_sim.analysis.linearize import trim_effects
from sbs_sim.analysis.periodic import common_period
from sbs_sim.errors import AircraftError, LinearizationError, TrimError
from sbs_sim.flight.trim_point import Fidelity
from sbs_sim.flight.trimmed_state import trimmed_state
from sbs_sim.flight.two_blades import substitute, trim_of_substitute
from sbs_sim.model import state as S

BLADES = 3  # of sbs, which together are two


def heavier(blades, **more):
    """Blades of sbs with the mass, springs, dampers and area of its three blades in all."""
    share = BLADES / blades
    values = {"blade_mass": 0.1613, "flap_spring": 162.0, "lag_spring": 0.0, "lag_damping": 0.022}
    chord = {"root": 0.051 * share, "tip": 0.051 * share}
    return {key: value * share for key, value in values.items()} | {"blades": blades, "chord": chord, **more}


@pytest.fixture(scope="module")
def two():
    return build(every_rotor=heavier(2))


@pytest.fixture(scope="module")
def cruise(two):
    return trim(two, 12.0, turn_rate=0.2)


def test_a_trim_is_a_flight_that_repeats(two, cruise):
    """Forty revolutions later the body is as it was, and it has gone the wanted way."""
    period = 2 * math.pi / two.rotors[0].speed
    flight = simulate(two, cruise, cruise.controls, 40 * period, tick=period, azimuth_step=math.radians(5))
    begin, end = flight["state"][0], flight["state"][-1]
    np.testing.assert_allclose(end[S.VELOCITY : S.BODY_SIZE], begin[S.VELOCITY : S.BODY_SIZE], atol=1e-4)
    np.testing.assert_allclose(end[S.BODY_SIZE :], begin[S.BODY_SIZE :], rtol=1e-4, atol=1e-4)
    turned = 0.2 * 40 * period
    way = 12.0 / 0.2 * np.array([math.sin(turned), 1 - math.cos(turned), 0.0])
    np.testing.assert_allclose(end[:3], way, atol=1e-3)
    assert cruise.residual < 1e-9


def test_the_methods_of_integration_agree(two, cruise):
    """Each state of a rotor with two blades is in one of the blocks of the exponential method."""
    ends = [
        simulate(two, cruise, cruise.controls + 0.01, 0.5, method=method, azimuth_step=math.radians(4))["state"][-1]
        for method in ("etd", "rk4")
    ]
    np.testing.assert_allclose(*ends, rtol=1e-5, atol=1e-6)


def test_three_lighter_blades_trim_alike(tmp_path):
    """In hover nothing vibrates: the number of blades of the same mass and area does not count."""
    airfoil = linear_airfoil(tmp_path / "linear.csv")
    points = [trim(build(every_rotor=heavier(blades, airfoil=airfoil))) for blades in (2, 3, 4)]
    for other in points[1:]:
        np.testing.assert_allclose(other.controls, points[0].controls, atol=1e-9)
        np.testing.assert_allclose(other.power, points[0].power, rtol=1e-9)
        assert other["a0(1)"] == pytest.approx(points[0]["a0(1)"], rel=1e-9)


def test_two_rotors_of_two_blades_are_one_of_four(tmp_path):
    """The thrust of a rotor alone in hover, whose blades have half the mass and area."""
    airfoil = linear_airfoil(tmp_path / "linear.csv")
    found = [
        IsolatedRotor(build(rotors=[heavier(blades, airfoil=airfoil)])).steady((0.14, 0.0, 0.0)) for blades in (2, 4)
    ]
    assert found[0].thrust == pytest.approx(found[1].thrust, rel=1e-9)
    assert found[0].torque == pytest.approx(found[1].torque, rel=1e-9)
    assert found[0].residual < 1e-9


def test_loads_of_a_rotor_alone_are_those_of_its_motion(tmp_path):
    """With cyclic pitch in a flow mean loads on the hub do not know of the number of blades.

    But for cyclic inflow, which swings with the moment of two blades: it comes and goes twice per revolution.
    """
    airfoil, fidelity = linear_airfoil(tmp_path / "linear.csv"), Fidelity(cyclic_inflow=False)
    rotors = [IsolatedRotor(build(rotors=[heavier(blades, airfoil=airfoil)]), fidelity) for blades in (2, 6)]
    two, six = (rotor.steady((0.14, 0.01, 0.02), 15.0) for rotor in rotors)
    assert two.thrust == pytest.approx(six.thrust, rel=1e-4)
    np.testing.assert_allclose(two.force, six.force, atol=1e-4 * six.thrust)
    np.testing.assert_allclose(two.moment, six.moment, atol=1e-3 * np.abs(six.moment).max())
    again = rotors[0].steady((0.14, 0.01, 0.02), 15.0, start=two)
    np.testing.assert_allclose(again.state, two.state, atol=1e-9)


def test_exponents_in_a_vacuum_are_the_rotating_frequencies():
    """Both blades flap and lag on their own: eqs. (3.5) and (3.6) without coning."""
    aircraft = build(rotors=[heavier(2, lag_damping=0.0, lag_spring=30.0)], environment=WEIGHTLESS_VACUUM)
    rotor, isolated = aircraft.rotors[0], IsolatedRotor(aircraft)
    point = isolated.steady((0.0, 0.0, 0.0))
    found = isolated.exponents(point, inflow=False)
    s1, a1, e_0, e_f = rotor.first_moment, rotor.second_moment, rotor.hinge_offset, rotor.flap_hinge_offset
    a2 = rotor.blade_mass * e_f**2 + 2 * e_f * s1 + a1
    flap = math.sqrt(1 + e_0 * s1 / a1 + rotor.flap_spring / (a1 * rotor.speed**2))
    lag = math.sqrt((e_0 - e_f) * (rotor.blade_mass * e_f + s1) / a2 + rotor.lag_spring / (a2 * rotor.speed**2))
    expected = np.repeat([flap, lag], 2) * rotor.speed
    principal = np.abs(np.angle(np.exp(1j * expected * 2 * math.pi / rotor.speed))) * rotor.speed / (2 * math.pi)
    np.testing.assert_allclose(np.sort(found.imag[found.imag > 0]), np.sort(principal), rtol=1e-5)
    np.testing.assert_allclose(found.real, 0.0, atol=1e-4 * rotor.speed)


def test_floquet_is_the_departure_of_a_flight_in_a_period(two, cruise):
    """Columns of the monodromy matrix against the nonlinear flight, by another method of integration."""
    found = floquet(two, cruise, 96)
    start, names = trimmed_state(two, cruise), cruise.state_names
    for name, step in (("ad(1)", 1e-4), ("dxi0(2)", 1e-2), ("q", 1e-4), ("lambdac(1)", 1e-5), ("w", 1e-3)):
        ends = []
        for sign in (1, -1):
            linear = cruise.state.copy()
            linear[names.index(name)] += sign * step
            state = two.layout.from_linear(linear)
            flight = simulate(
                two, state, cruise.controls, found.period, tick=found.period, azimuth_step=math.radians(2), method="rk4"
            )
            ends.append(two.layout.to_linear(flight["state"][-1]))
        column = (ends[0] - ends[1]) / (2 * step)
        size = np.abs(column).max()
        np.testing.assert_allclose(found.monodromy[:, names.index(name)], column, atol=2e-3 * size)
    assert len(start) == two.layout.size


def test_a_guess_leads_to_its_trim(two, cruise):
    for guess in (cruise, (cruise.controls, cruise.state)):
        again = trim(two, 12.0, turn_rate=0.2, guess=guess)
        np.testing.assert_allclose(again.state, cruise.state, atol=1e-8)


def test_the_substitute_has_the_same_loads(two, cruise):
    """Mean thrust and torque of the periodic flight and of constant coordinates differ by the vibration only."""
    lighter = substitute(two)
    assert lighter.fuselage()[0] == pytest.approx(two.fuselage()[0], rel=1e-12)
    np.testing.assert_allclose(lighter.fuselage()[2], two.fuselage()[2], atol=1e-12)
    mean = trim(lighter, 12.0, turn_rate=0.2)
    np.testing.assert_allclose(cruise.thrust, mean.thrust, rtol=2e-3)
    np.testing.assert_allclose(cruise.power, mean.power, rtol=5e-3)
    assert trim_of_substitute(two, cruise).state_names == mean.state_names


def test_the_substitute_has_the_offsets_and_their_mass():
    """Mean loads of a rotor alone, underslung, with a table of mass: of two blades and of their substitute."""
    table = {"stations": [0.1, 0.6, 1.0], "values": [0.5, 0.4, 0.3], "tip_mass": 0.01}
    offsets = {"quarter_chord": {"root": 0.004, "tip": -0.01}, "chordwise_cg": {"root": 0.006, "tip": 0.002}}
    data = aircraft_data(rotors=[teetering(undersling=0.01, **offsets)])
    rotor = {key: value for key, value in data["rotors"][0].items() if key not in ("blade_mass", "blade_cg")}
    data["rotors"] = [rotor | {"mass_distribution": table}]
    aircraft = Aircraft.from_dict(data)
    np.testing.assert_allclose(substitute(aircraft).fuselage()[1], aircraft.fuselage()[1], atol=1e-12)
    np.testing.assert_allclose(substitute(aircraft).fuselage()[2], aircraft.fuselage()[2], atol=1e-12)
    fidelity = Fidelity(lead_lag=False, cyclic_inflow=False)
    two, three = (IsolatedRotor(craft, fidelity) for craft in (aircraft, substitute(aircraft)))
    two, three = (rotor.steady((0.12, 0.01, 0.02), 10.0) for rotor in (two, three))
    assert two.thrust == pytest.approx(three.thrust, rel=2e-3)
    np.testing.assert_allclose(two.force, three.force, atol=3e-3 * three.thrust)


def test_rotors_of_two_and_more_blades_and_speeds():
    """A common period of three revolutions of the first rotor, which is two of the other."""
    rotors = [
        heavier(2),
        {"blades": 4, "blade_mass": 0.12, "speed_rpm": 1600.0, "radius": 0.7, "chord": {"root": 0.06, "tip": 0.06}},
    ]
    point = trim(build(rotors=rotors), 5.0, lead_lag=False)
    assert point.residual < 1e-9
    with pytest.raises(LinearizationError, match=r"the blade passages of the rotors have no common period"):
        common_period(build(rotors=[heavier(2), {"speed_rpm": 2400.1}]))


def test_without_a_common_period_a_trim_is_the_mean_flight():
    """It says so, and is that of nearly the same speed, whose flight repeats."""
    mean, exact = (trim(build(rotors=[heavier(2), {"speed_rpm": speed}]), 5.0) for speed in (2400.1, 2400.0))
    (said,) = mean.warnings
    assert said.startswith("two blades: the blade passages of the rotors have no common period")
    assert exact.warnings == ()
    np.testing.assert_allclose(mean.power, exact.power, rtol=5e-3)
    np.testing.assert_allclose(mean.controls, exact.controls, atol=math.radians(0.1))


def test_there_is_no_constant_model(two, cruise):
    says = "R1 has 2 blades: no constant model describes them; stability is that of Floquet's method"
    with pytest.raises(LinearizationError, match=says):
        linearize(two)
    with pytest.raises(LinearizationError, match=says):
        linearize(two, point=cruise)
    with pytest.raises(
        LinearizationError, match=r"on a stand is sbs_sim.analysis.isolated_rotor.IsolatedRotor.exponents"
    ):
        linearize(build(rotors=[heavier(2)], body={"stand": {"free": []}}))
    found = sweep(two, "airspeed", [0.0, 5.0], workers=1)
    assert [(point.model, point.error) for point in found.points] == [(None, None)] * 2
    assert [effect.axis for effect in trim_effects(two, trim(two))] == ["heave", "roll", "pitch", "yaw"]


def test_what_a_rotor_alone_with_two_blades_has_not():
    single = build(rotors=[heavier(2)])
    isolated = IsolatedRotor(single, Fidelity(lead_lag=False))
    point = isolated.steady((0.1, 0.0, 0.0))
    with pytest.raises(TrimError, match=r"R1 has 2 blades: no constant matrix describes them"):
        isolated.matrix(point)


GOVERNED = {
    "rotors": ["R1", "R2"],
    "inertia": 0.02,
    "engine": {"kind": "engine", "max_torque": 20.0, "lag": 0.1, "throttle": 0.3},
    "governor": {"proportional_gain": 3.0, "integral_gain": 3.0},
}


def driven(*drives, **changes):
    return Aircraft.from_dict(aircraft_data(**changes) | {"drives": list(drives)})


def test_a_drive_makes_the_period_an_unknown(two):
    """The governor holds the mean speed, and a heavy transmission keeps it within a revolution: the flight repeats."""
    point = trim(driven(GOVERNED, every_rotor=heavier(2)), 12.0)
    np.testing.assert_allclose(point.rotor_speed, two.rotors[0].speed, rtol=1e-4)
    np.testing.assert_allclose(point.power, trim(two, 12.0).power, rtol=1e-5)
    period = 2 * math.pi / point.rotor_speed[0]
    aircraft = driven(GOVERNED, every_rotor=heavier(2))
    flight = simulate(aircraft, point, point.controls, 20 * period, tick=period, azimuth_step=math.radians(4))
    changes = flight["state"][-1] - flight["state"][0]
    azimuth = aircraft.layout.drive(0)["azimuth"]
    assert changes[azimuth] == pytest.approx(20 * 2 * math.pi, rel=1e-8)
    np.testing.assert_allclose(np.delete(changes, azimuth)[S.VELOCITY :], 0.0, atol=1e-4)


def test_floquet_compares_departures_at_equal_azimuths():
    """Columns of the monodromy matrix against flights until the shaft is where it began."""
    aircraft = driven(GOVERNED, every_rotor=heavier(2))
    point = trim(aircraft, 12.0)
    found, names, count = floquet(aircraft, point, 96), point.state_names, 128
    flown = {"tick": found.period / count, "azimuth_step": math.radians(2), "method": "rk4"}
    cycle = simulate(aircraft, point, point.controls, found.period, **flown)["state"]
    rate = aircraft.layout.to_linear(cycle[1]) - aircraft.layout.to_linear(cycle[count - 1])
    rate *= count / (2 * found.period)
    azimuth, speed = aircraft.layout.drive(0)["azimuth"], point["Omega(1)"]
    for name, step in (("Omega(1)", 0.05), ("ad(1)", 1e-4), ("u", 1e-2)):
        ends = []
        for sign in (1, -1):
            linear = point.state.copy()
            linear[names.index(name)] += sign * step
            start = aircraft.layout.from_linear(linear)
            state = simulate(aircraft, start, point.controls, found.period, **flown)["state"][-1]
            ends.append(aircraft.layout.to_linear(state) - rate * (state[azimuth] - cycle[-1][azimuth]) / speed)
        column = (ends[0] - ends[1]) / (2 * step)
        place = names.index(name)
        np.testing.assert_allclose(found.monodromy[:, place], column, atol=5e-3 * np.abs(column).max())
    assert not any(np.abs(found.multipliers - 1.0) < 1e-6)


def test_floquet_of_rotors_with_a_drive_is_near_their_averaged_model():
    aircraft = driven(GOVERNED, every_rotor=heavier(3))
    found = floquet(aircraft, trim(aircraft, 5.0))
    assert len(found.poles) == aircraft.layout.linear_size
    slow = np.abs(found.poles) < 30.0
    np.testing.assert_allclose(found.exponents[slow], found.poles[slow], rtol=5e-3)


def test_rotors_on_drives_of_their_own_trim_in_the_mean():
    """And every other way in says what there is: a flight goes on nearly as its trim."""
    aircraft = driven(*(GOVERNED | {"rotors": [name]} for name in ("R1", "R2")), every_rotor=heavier(2))
    period = (
        "rotors whose speeds are their own have no common period: allowed are all rotors on one drive, or no drives"
    )
    point = trim(aircraft, 5.0)
    mean = "this is the mean flight of three lighter blades in place of two, and there is no linear model"
    assert point.warnings == (f"two blades: {period}; {mean}",)
    left = "so that Floquet's method does not apply either; there are `trim` in the mean and `simulate`"
    with pytest.raises(
        LinearizationError, match=f"R1 has 2 blades: no constant model describes them; {period}, {left}"
    ):
        linearize(aircraft, point=point)
    with pytest.raises(LinearizationError, match=period):
        floquet(aircraft, point)
    (swept,) = sweep(aircraft, "airspeed", [5.0], workers=1).points
    assert (swept.model, swept.error, swept.warnings) == (None, None, point.warnings)
    flight = simulate(aircraft, point, point.controls, 0.3)
    np.testing.assert_allclose(flight["V"], 5.0, atol=0.2)
    np.testing.assert_allclose(flight["Omega(1)"], aircraft.drive_speed(0), rtol=0.02)


def test_a_weak_engine_of_two_blades_is_the_reason():
    """The search for the reason takes the substitute, too."""
    weak = {**GOVERNED, "engine": {**GOVERNED["engine"], "max_torque": 5.0}, "governor": {}}
    with pytest.raises(TrimError, match=r"no trim: drive 1 gives up to 1\.5 N m, its rotors take 8\.27 N m"):
        trim(driven(weak, every_rotor=heavier(2)))


def test_two_blades_autorotate_as_four():
    """Without cyclic inflow the speed at which no torque is left does not know of the number of blades."""
    found = []
    for blades in (2, 4):
        aircraft = driven({"rotors": ["R1"], "inertia": 0.5}, rotors=[heavier(blades, airfoil="thin_2pi")])
        isolated = IsolatedRotor(aircraft, Fidelity(lead_lag=False, cyclic_inflow=False))
        found.append(isolated.steady((0.03, 0.0, 0.0), 6.0, -8.0))
    assert abs(found[0].torque) < 1e-4
    assert found[0].speed == pytest.approx(found[1].speed, rel=2e-3)
    assert found[0].thrust == pytest.approx(found[1].thrust, rel=5e-3)


SPRUNG = {"free": ["x", "y", "roll"], "mass": [9.0, 9.0, 0.0, 1.0, 0.0, 0.0]}
SPRUNG |= {"spring": [9e4, 9e4, 0.0, 9e3, 0.0, 0.0], "damping": [200.0, 200.0, 0.0, 20.0, 0.0, 0.0]}


def test_two_blades_on_a_stand_that_gives_way():
    """The trim is a motion that repeats, its deflection that of the mean load on the springs."""
    data = aircraft_data(rotors=[heavier(2)], body={"stand": SPRUNG})
    for name, angle in (("collective", 8.0), ("longitudinal_cyclic", 2.0), ("lateral_cyclic", 1.0)):
        data["controls"][name]["held_deg"] = angle
    aircraft = Aircraft.from_dict(data)
    point = trim(aircraft)
    period = math.pi * 2 / aircraft.rotors[0].speed
    flight = simulate(aircraft, point, point.controls, 10 * period, tick=period / 64, azimuth_step=math.radians(3))
    states = flight["state"]
    np.testing.assert_allclose(states[-1], states[0], atol=2e-5)
    place, load = states[-65:-1, S.POSITION + 1].mean(), IsolatedRotor(aircraft).steady(point.swashplate[0]).force[1]
    assert place == pytest.approx(load / 9e4, rel=2e-2)
    assert np.abs(states[-65:, S.POSITION + 1]).max() > 1e-6


def test_a_stand_resonates_with_two_blades_as_with_three():
    """Exponents of both rotors: modes of the stand, but for what its loads of two per revolution couple."""
    stand = {"free": ["x", "y"], "mass": [9.0, 9.0, 0, 0, 0, 0], "spring": [9e4, 9e4, 0, 0, 0, 0]}
    stand["damping"] = [20.0, 20.0, 0, 0, 0, 0]
    found = []
    for blades in (2, 3):
        rotor = IsolatedRotor(build(rotors=[heavier(blades)], body={"stand": stand}))
        exponents = rotor.exponents(rotor.steady((0.1, 0.01, 0.02)), 96)
        found.append(exponents[exponents.imag > 0.0][:2])
    np.testing.assert_allclose(found[0].real, found[1].real, rtol=0.05)
    np.testing.assert_allclose(found[0].imag, found[1].imag, rtol=0.05)


def test_slender_blades_with_an_unsteady_airfoil_beside_two_blades():
    """Their circulation follows within a small part of a step of the flapping, so the steps are shorter."""
    slender = {"unsteady_airfoil": "jones", "chord": {"root": 0.005, "tip": 0.005}, "blades": 5}
    aircraft = build(rotors=[heavier(2), slender], body={"stand": {"free": []}})
    assert trim(aircraft).residual < 1e-9


def test_a_damper_may_be_missing(two):
    """Unequal blades: the period is a revolution in any case, and a trim says so."""
    uneven = two.with_value("rotors.blade_lag_damping", [1.0, 0.0])
    point = trim(uneven, 8.0)
    assert point.residual < 1e-9
    assert any("unequal lag dampers" in line for line in point.warnings)


def teetering(**more):
    hinges = {"hinge_offset": 0.0, "flap_hinge_offset": 0.0, "flap_hinge": "teetering"}
    return heavier(2, **hinges, **{"flap_spring": 0.0, "lag_spring": 400.0, "flap_rest_deg": 2.0, **more})


@pytest.mark.parametrize("spring", [0.0, 40.0])
def test_a_teetering_rotor_flaps_at_one_per_revolution(spring):
    """Without a spring exactly; with one the root of 1 + K / (A_1 Omega^2). Coning is no state of its stability."""
    changes = {"flap_spring": spring, "lag_damping": 0.0, "flap_rest_deg": 0.0}
    aircraft = build(rotors=[teetering(**changes)], environment=WEIGHTLESS_VACUUM)
    isolated, speed = IsolatedRotor(aircraft, Fidelity(lead_lag=False)), aircraft.rotors[0].speed
    found = isolated.exponents(isolated.steady((0.0, 0.0, 0.0)), inflow=False)
    assert len(found) == 2
    turns = math.sqrt(1 + spring / (aircraft.rotors[0].second_moment * speed**2)) - 1
    np.testing.assert_allclose(np.abs(found.imag), turns * speed, atol=2e-4 * speed)
    np.testing.assert_allclose(found.real, 0.0, atol=1e-4 * speed)


def test_a_teetering_helicopter_flies_its_trim():
    """The coning is the precone, no spring or hinge offset tilts the hub, and the flight repeats."""
    aircraft = build(every_rotor=teetering(), rotors=[{"hub": [0, -0.645, -0.3]}, {"hub": [0, 0.645, -0.3]}])
    point = trim(aircraft, 10.0, lead_lag=False)
    assert point["a0(1)"] == pytest.approx(math.radians(2.0), abs=1e-9)
    period = 2 * math.pi / aircraft.rotors[0].speed
    flight = simulate(aircraft, point, point.controls, 20 * period, tick=period, azimuth_step=0.1, lead_lag=False)
    np.testing.assert_allclose(
        flight["state"][-1][S.VELOCITY :], flight["state"][0][S.VELOCITY :], rtol=1e-3, atol=1e-3
    )
    names = {name for name in point.state_names if not name.startswith(("xi", "dxi"))}
    assert len(floquet(aircraft, point).exponents) == len(names - {"a0(1)", "a0(2)", "da0(1)", "da0(2)"})


def test_a_teetering_hub_feels_no_moment_of_flapping():
    """Of a rotor without spring, offset, precone and lag the hub has no moment across the shaft, whatever its flap."""
    aircraft = build(rotors=[teetering(flap_rest_deg=0.0)], environment={"gravity": 0.0})
    point = IsolatedRotor(aircraft, Fidelity(lead_lag=False)).steady((0.12, 0.02, 0.03), 10.0)
    assert np.abs(point.moment[:2]).max() < 2e-2 * abs(point.moment[2])


def test_teetering_rotors_that_are_none():
    for changes, says in (
        ({"blades": 3}, "flap_hinge = 'teetering', blades are 3: allowed are 2"),
        ({"hinge_offset": 0.01}, "'teetering', hinge_offset is 0.01: allowed is 0, the hinge is at the axis"),
    ):
        with pytest.raises(AircraftError, match=says):
            build(rotors=[teetering() | changes])
    with pytest.raises(AircraftError, match=r"'teetering', options\.coupling is paper: allowed is complete"):
        build(rotors=[teetering()], options={"coupling": "paper"})
