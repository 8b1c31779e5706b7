"""The simulation: counting of steps, determinism, what it refuses, faults, and whole flights."""

import dataclasses
import math
import re
from pathlib import Path

import numpy as np
import pytest

from sbs_sim import Aircraft, Case, Simulation, simulate, simulate_batch, trim
from sbs_sim.errors import SimulationError
from sbs_sim.flight.blade_angles import blade_angles
from sbs_sim.flight.trimmed_state import trimmed_state
from sbs_sim.model.frames import quaternion_to_euler, rotation_matrix
from sbs_sim.model.state import ATTITUDE, BODY_SIZE, CONTROL_NAMES, POSITION, RATES, VELOCITY
from sbs_sim.model.wind import Wind
from sbs_sim.pilot.piloted_flight import simulate_with_pilot

DATA = Path(__file__).resolve().parents[1] / "data"
DEG = math.pi / 180


def hovering(sbs, hover, **options):
    return Simulation(sbs, trimmed_state(sbs, hover), hover.swashplate, **options)


def in_vacuum(aircraft, gravity):
    air = dataclasses.replace(aircraft.environment, air_density=0.0, gravity=gravity)
    return dataclasses.replace(aircraft, environment=air)


def at_rest(aircraft):
    state = np.zeros(aircraft.layout.size)
    state[ATTITUDE] = 1.0
    return state


def no_swash(aircraft):
    return np.zeros((len(aircraft.rotors), 3))


def refusal(function, *arguments, **options):
    with pytest.raises(SimulationError) as caught:
        function(*arguments, **options)
    assert "\n" not in str(caught.value)
    return str(caught.value)


# -- steps and time ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("tick", "azimuth_step_deg", "steps"),
    [
        (0.01, 4.8, 30),  # 2400 rpm are 144 deg in 10 ms
        (0.01, 5.0, 29),
        (0.01, 4.9, 30),
        (0.01, 144 / 7, 7),
        (0.01, 36.0, 4),
        (0.01, 35.999, 5),
        (0.001, 5.0, 3),
        (0.02, 4.8, 60),
        (1e-4, 45.0, 1),
        (1.0, 45.0, 320),
    ],
)
def test_a_tick_is_cut_into_the_fewest_steps_that_keep_to_the_azimuth_step(sbs, hover, tick, azimuth_step_deg, steps):
    simulation = hovering(sbs, hover, tick=tick, azimuth_step=azimuth_step_deg * DEG)
    assert simulation.steps_per_tick == steps
    assert simulation.step_size == tick / steps


def test_the_fastest_rotor_sets_the_steps():
    aircraft = Aircraft.load(DATA / "tail_rotor.yaml")  # 2400 and 9000 rpm: 144 and 540 deg in 10 ms
    simulation = Simulation(aircraft, at_rest(aircraft), no_swash(aircraft), azimuth_step=5.0 * DEG)
    assert simulation.steps_per_tick == 108


def test_time_is_the_number_of_steps_times_their_length(sbs, hover):
    simulation = hovering(sbs, hover, tick=0.007)
    assert simulation.step == 0
    assert simulation.time == 0.0
    for tick in range(1, 101):
        simulation.advance()
        assert simulation.step == tick * simulation.steps_per_tick
        assert simulation.time == simulation.step * simulation.step_size
        snapshot = simulation.snapshot()
        assert (snapshot.step, snapshot.time) == (simulation.step, simulation.time)


def test_azimuths_follow_from_the_number_of_the_step():
    aircraft = Aircraft.load(DATA / "tandem.yaml")  # 2400 and 2300 rpm
    simulation = Simulation(in_vacuum(aircraft, 0.0), at_rest(aircraft), no_swash(aircraft))
    for tick in range(1, 51):
        simulation.advance()
        azimuth = simulation.snapshot().azimuth / DEG
        assert (azimuth >= 0).all()
        assert (azimuth < 360).all()
        error = (azimuth - tick * np.array([144.0, 138.0]) + 180) % 360 - 180
        np.testing.assert_allclose(error, 0, atol=1e-9)


# -- determinism -------------------------------------------------------------------------------------

STORM = Wind(
    velocity=(3.0, -1.0, 0.0),
    gust=(0.0, 4.0, 1.0),
    gust_delay=0.1,
    gust_duration=0.3,
    turbulence_intensity=(1.0, 1.0, 0.5),
    turbulence_seed=42,
)


def fly(simulation, ticks, look_at=()):
    """Advance with moving swashplates, with snapshots after some of the ticks; the state at the end."""
    still = simulation.swashplate
    for tick in range(ticks):
        simulation.set_swashplate(still + 0.01 * math.sin(0.3 * tick))
        simulation.advance()
        if tick in look_at:
            simulation.snapshot()
    return simulation.state.copy()


def fly_still(simulation, ticks):
    """Advance with swashplates a little above where they were; the state at the end."""
    simulation.set_swashplate(simulation.swashplate + 0.01)
    for _ in range(ticks):
        simulation.advance()
    return simulation.state


@pytest.mark.parametrize("wind", [Wind(), STORM], ids=["calm", "storm"])
def test_equal_flights_are_equal_to_the_last_bit(sbs, hover, wind):
    first = fly(hovering(sbs, hover, wind=wind), 60)
    assert np.abs(first[VELOCITY:RATES]).max() > 0.01
    np.testing.assert_array_equal(fly(hovering(sbs, hover, wind=wind), 60), first)
    looked_at = fly(hovering(sbs, hover, wind=wind), 60, look_at=range(0, 60, 7))
    np.testing.assert_array_equal(looked_at, first)
    others = [hovering(sbs, hover, wind=wind) for _ in range(2)]
    ends = [fly(simulation, 30) for simulation in others]  # one after the other, in turns
    np.testing.assert_array_equal(*ends)


def test_length_of_ticks_changes_nothing_but_rounding(sbs, hover):
    short = fly_still(hovering(sbs, hover, tick=0.01, azimuth_step=4.8 * DEG), 60)
    long = fly_still(hovering(sbs, hover, tick=0.02, azimuth_step=4.8 * DEG), 30)
    np.testing.assert_allclose(long, short, atol=1e-9)


def test_a_flight_goes_on_from_its_own_state(sbs, hover):
    """A state alone, at a whole number of revolutions, tells all that is to come."""
    tick = 0.025  # one revolution
    whole, part = hovering(sbs, hover, tick=tick), hovering(sbs, hover, tick=tick)
    for simulation in (whole, part):
        simulation.set_swashplate(hover.swashplate + 0.005)
        for _ in range(8):
            simulation.advance()
    rest = Simulation(sbs, part.state, part.swashplate, tick=tick)
    for simulation in (whole, rest):
        for _ in range(8):
            simulation.advance()
    np.testing.assert_allclose(rest.state, whole.state, atol=1e-11)


# -- what is refused ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("option", "value", "line"),
    [
        ("tick", 0.0, "tick = 0.0: allowed are 0.0001 to 1 s"),
        ("tick", 1.1, "tick = 1.1: allowed are 0.0001 to 1 s"),
        ("tick", math.nan, "tick = nan: allowed are 0.0001 to 1 s"),
        ("azimuth_step", 0.0, "azimuth_step = 0.0: allowed are 0.000174533 to 0.785398 rad"),
        ("azimuth_step", 60 * DEG, "azimuth_step = 1.0471975511965976: allowed are 0.000174533 to 0.785398 rad"),
        ("azimuth_step", math.nan, "azimuth_step = nan: allowed are 0.000174533 to 0.785398 rad"),
        ("method", "euler", "method = 'euler': allowed are auto, etd, rk4, tsit5, partitioned"),
    ],
)
def test_bad_options_are_refused(sbs, hover, option, value, line):
    assert refusal(hovering, sbs, hover, **{option: value}) == line


@pytest.mark.parametrize(
    ("name", "value", "bound"),
    [
        ("north", math.nan, "-1e+08 to 1e+08"),
        ("qx", 2.5, "-2 to 2"),
        ("u", 351.0, "-350 to 350"),
        ("r", -math.inf, "-100 to 100"),
        ("b1(2)", 1.6, "-1.5 to 1.5"),
        ("xi0(1)", -2.0, "-1.5 to 1.5"),
        ("da0(1)", 1e6, "-3769.91 to 3769.91"),
        ("lambdas(2)", math.inf, "-1 to 1"),
    ],
)
def test_an_implausible_state_is_refused_by_name(sbs, hover, name, value, bound):
    state = trimmed_state(sbs, hover)
    state[sbs.layout.names.index(name)] = value
    simulation = hovering(sbs, hover)
    before = simulation.state.copy()
    line = f"state {name} = {value}: allowed are {bound}"
    assert refusal(simulation.reset, state, hover.swashplate) == line
    np.testing.assert_array_equal(simulation.state, before)
    assert refusal(Simulation, sbs, state, hover.swashplate) == line


@pytest.mark.parametrize("size", [0, 38, 42, 44])
def test_a_state_of_another_length_is_refused(sbs, hover, size):
    line = f"state has {size} values: allowed are 43"
    assert refusal(hovering(sbs, hover).checked_state, np.zeros(size)) == line


@pytest.mark.parametrize(("quaternion", "norm"), [((0, 0, 0, 0), "0"), ((0, 0.4, 0, 0), "0.4"), ((2,) * 4, "4")])
def test_an_attitude_far_from_a_unit_quaternion_is_refused(sbs, hover, quaternion, norm):
    state = trimmed_state(sbs, hover)
    state[ATTITUDE:VELOCITY] = quaternion
    line = f"state attitude has a norm of {norm}: allowed are 0.5 to 2, a unit quaternion"
    assert refusal(hovering(sbs, hover).checked_state, state) == line


def test_an_attitude_near_a_unit_quaternion_is_normalised(sbs, hover):
    state = trimmed_state(sbs, hover)
    state[ATTITUDE:VELOCITY] = (0.9, 0.0, 1.2, 0.0)
    checked = hovering(sbs, hover).checked_state(state)
    np.testing.assert_allclose(checked[ATTITUDE:VELOCITY], (0.6, 0.0, 0.8, 0.0), rtol=1e-15)
    np.testing.assert_array_equal(checked[VELOCITY:], state[VELOCITY:])
    assert state[ATTITUDE] == 0.9


def test_bad_swashplate_angles_are_refused_and_change_nothing(sbs, hover):
    simulation = hovering(sbs, hover)
    bad = {
        (0, 0): (math.nan, "MR1 collective = nan: allowed are 0 to 0.349066 rad"),
        (1, 0): (-0.01, "MR2 collective = -0.01: allowed are 0 to 0.349066 rad"),
        (1, 2): (0.3, "MR2 longitudinal_cyclic = 0.3: allowed are -0.279253 to 0.279253 rad"),
        (0, 1): (-math.inf, "MR1 lateral_cyclic = -inf: allowed are -0.279253 to 0.279253 rad"),
    }
    for place, (value, line) in bad.items():
        angles = hover.swashplate.copy()
        angles[place] = value
        assert refusal(simulation.set_swashplate, angles) == line
    count = "swashplate has 3 rotors: allowed are 2, those of the aircraft"
    assert refusal(simulation.set_swashplate, np.zeros((3, 3))) == count
    for shape in [(), (6,), (2, 4), (2, 3, 1)]:
        line = f"swashplate has shape {shape}: allowed is (2, 3)"
        assert refusal(simulation.set_swashplate, np.zeros(shape)) == line
    np.testing.assert_array_equal(simulation.swashplate, hover.swashplate)


def test_the_ends_of_the_ranges_are_allowed(sbs, hover):
    simulation = hovering(sbs, hover)
    ends = np.array([[20.0, -16.0, 16.0], [0.0, 16.0, -16.0]]) * DEG
    simulation.set_swashplate(ends)
    np.testing.assert_array_equal(simulation.swashplate, ends)


# -- reset -------------------------------------------------------------------------------------------


def test_reset_moves_the_aircraft_and_time_goes_on(sbs, hover):
    simulation = hovering(sbs, hover, wind=STORM)
    fly(simulation, 10)
    azimuth = simulation.snapshot().azimuth
    state = trimmed_state(sbs, hover, position=(10.0, 20.0, -30.0), heading=1.0)
    simulation.reset(state, hover.swashplate)
    np.testing.assert_array_equal(simulation.state, state)
    np.testing.assert_array_equal(simulation.swashplate, hover.swashplate)
    assert simulation.step == 10 * simulation.steps_per_tick
    np.testing.assert_array_equal(simulation.snapshot().azimuth, azimuth)
    assert simulation.wind is STORM
    simulation.advance()
    assert simulation.step == 11 * simulation.steps_per_tick
    state[:] = math.nan  # the simulation has its own copy
    assert np.isfinite(simulation.state).all()


def test_a_reset_is_done_wholly_or_not_at_all(sbs, hover):
    simulation = hovering(sbs, hover)
    before = simulation.state.copy()
    state = trimmed_state(sbs, hover, position=(1.0, 2.0, 3.0))
    refusal(simulation.reset, state, np.full((2, 3), math.nan))
    np.testing.assert_array_equal(simulation.state, before)
    np.testing.assert_array_equal(simulation.swashplate, hover.swashplate)


# -- faults ------------------------------------------------------------------------------------------


def test_a_flight_that_leaves_the_plausible_stops_before(sbs):
    """A fall in vacuum at 100 m/s^2 passes 350 m/s after 3.5 s."""
    aircraft = in_vacuum(sbs, 100.0)
    simulation = Simulation(aircraft, at_rest(aircraft), no_swash(aircraft))
    line = refusal(fly_still, simulation, 400)
    found = re.fullmatch(
        r"step (\d+) \(t = 3\.50\d\d s\) would take w to 350(\.\d+)?: plausible are magnitudes up to 350", line
    )
    assert found, line
    step = int(found[1])
    assert simulation.step == step - 1
    assert simulation.time <= 3.5 < simulation.time + 2 * simulation.step_size
    assert np.isfinite(simulation.state).all()
    w = simulation.state[VELOCITY + 2]
    assert w <= 350.0
    assert w == pytest.approx(100 * simulation.time, rel=1e-9)
    np.testing.assert_array_equal(simulation.checked_state(simulation.state), simulation.state)
    # it stays there until it is reset
    assert refusal(simulation.advance) == line
    assert simulation.step == step - 1
    simulation.reset(at_rest(aircraft), no_swash(aircraft))
    simulation.advance()
    assert simulation.step == step - 1 + simulation.steps_per_tick


def test_an_integration_that_explodes_stops_before(sbs):
    """A flap spring whose frequency is far above that of the steps."""
    rotors = tuple(dataclasses.replace(rotor, flap_spring=1e9) for rotor in sbs.rotors)
    aircraft = dataclasses.replace(sbs, rotors=rotors)
    state = at_rest(aircraft)
    state[aircraft.layout.flap(0).start] = 1e-6
    simulation = Simulation(aircraft, state, no_swash(aircraft), method="rk4")
    line = refusal(fly_still, simulation, 10)
    assert re.match(r"step \d+ \(t = 0\.00\d+ s\) would take (d?[ab][01]\(\d\)|[uvwpqr]) to ", line)
    assert simulation.step < simulation.steps_per_tick
    assert np.isfinite(simulation.state).all()
    np.testing.assert_array_equal(simulation.checked_state(simulation.state), simulation.state)


def test_the_sharpest_allowed_controls_leave_the_state_plausible_or_stop(sbs, hover):
    """A minute of all controls at their ends: whatever happens, the state stays finite."""
    simulation = hovering(sbs, hover)
    simulation.set_swashplate(np.array([[20.0, 16.0, -16.0], [0.0, -16.0, 16.0]]) * DEG)
    try:
        for _ in range(1500):
            simulation.advance()
    except SimulationError:
        assert simulation.step < 1500 * simulation.steps_per_tick
    assert np.abs(simulation.state[RATES:BODY_SIZE]).max() > 0.5
    np.testing.assert_allclose(simulation.checked_state(simulation.state), simulation.state, rtol=1e-12)


# -- snapshots ---------------------------------------------------------------------------------------


def test_a_snapshot_is_a_copy(sbs, hover):
    simulation = hovering(sbs, hover)
    snapshot = simulation.snapshot()
    kept = {field.name: np.copy(getattr(snapshot, field.name)) for field in dataclasses.fields(snapshot)}
    fly(simulation, 5)
    simulation.snapshot()
    for name, value in kept.items():
        np.testing.assert_array_equal(getattr(snapshot, name), value)


def test_accelerations_are_those_of_the_centre_of_gravity(sbs, hover):
    """None in hover, gravity in free fall, in body axes, even while the aircraft turns."""
    np.testing.assert_allclose(hovering(sbs, hover).snapshot().acceleration, 0, atol=1e-8)
    # blades without mass, for turning makes them flap, and their motion would move the body
    light = tuple(dataclasses.replace(rotor, blade_mass=1e-9, flap_spring=0.0) for rotor in sbs.rotors)
    aircraft = in_vacuum(dataclasses.replace(sbs, rotors=light), 9.81)
    state = at_rest(aircraft)
    state[ATTITUDE:VELOCITY] = (math.cos(0.2), math.sin(0.2), 0.0, 0.0)  # rolled by 0.4 rad
    state[VELOCITY:BODY_SIZE] = (5.0, 1.0, 2.0, 0.1, 0.2, 0.3)
    acceleration = Simulation(aircraft, state, no_swash(aircraft)).snapshot().acceleration
    np.testing.assert_allclose(acceleration, 9.81 * np.array([0, math.sin(0.4), math.cos(0.4)]), atol=1e-8)


def test_blade_angles_are_those_of_the_multiblade_coordinates(sbs, hover):
    """beta_k = a0 - a1 cos psi_k - b1 sin psi_k (theory.md section 1)."""
    state = trimmed_state(sbs, hover)
    state[sbs.layout.flap(1)] = 0.03, 0.02, -0.01
    state[sbs.layout.lag(1)] = 0.01, -0.02, 0.004
    simulation = Simulation(sbs, state, hover.swashplate)
    simulation.advance()
    snapshot = simulation.snapshot()
    flap, lag = blade_angles(sbs, snapshot)[1]
    azimuth = snapshot.azimuth[1] + 2 * math.pi * np.arange(3) / 3
    for angles, place in ((flap, sbs.layout.flap(1)), (lag, sbs.layout.lag(1))):
        a0, a1, b1 = snapshot.state[place]
        np.testing.assert_allclose(angles, a0 - a1 * np.cos(azimuth) - b1 * np.sin(azimuth), atol=1e-15)


def test_trimmed_state_has_position_heading_and_wind(sbs, hover):
    state = trimmed_state(sbs, hover, position=(1.0, 2.0, -3.0), heading=math.pi / 2, wind=(4.0, 5.0, 6.0))
    np.testing.assert_array_equal(state[POSITION:ATTITUDE], (1.0, 2.0, -3.0))
    np.testing.assert_allclose(state[ATTITUDE:VELOCITY], (math.sqrt(0.5), 0, 0, math.sqrt(0.5)), atol=1e-6)
    # heading east, wind from the west comes from behind, and wind to the north comes from the right
    np.testing.assert_allclose(state[VELOCITY:RATES], (5.0, -4.0, 6.0), atol=1e-5)


@pytest.mark.parametrize(("option", "still"), [("lead_lag", "lag"), ("cyclic_inflow", "lambda")])
def test_fidelity_is_passed_on(sbs, hover, option, still):
    simulation = hovering(sbs, hover, **{option: False})
    names = np.array(sbs.layout.names)
    prefix = {"lag": ("xi", "dxi"), "lambda": ("lambdas", "lambdac")}[still]
    places = [i for i, name in enumerate(names) if name.startswith(prefix)]
    simulation.state[places] = 0.0
    simulation.set_swashplate(hover.swashplate + [0.0, 0.02, 0.03])
    simulation.advance()
    np.testing.assert_array_equal(simulation.state[places], 0.0)
    full = hovering(sbs, hover)
    full.state[places] = 0.0
    full.set_swashplate(hover.swashplate + [0.0, 0.02, 0.03])
    full.advance()
    assert (full.state[places] != 0.0).all()


# -- whole flights -----------------------------------------------------------------------------------


# -- controls and what they may be -----------------------------------------------------------------------------------


def beyond(hover, name, degrees):
    controls = hover.controls.copy()
    controls[CONTROL_NAMES.index(name)] = math.radians(degrees)
    return controls


RANGES = {"collective": "0 to 0.349066 rad (0 to 20 deg)"}
RANGES |= dict.fromkeys(CONTROL_NAMES[1:], "-0.20944 to 0.20944 rad (-12 to 12 deg)")


@pytest.mark.parametrize("name", CONTROL_NAMES)
@pytest.mark.parametrize("sign", [-1, 1])
def test_controls_beyond_their_ranges_are_refused_however_they_are_given(sbs, hover, name, sign):
    """As the mixer names and limits them: 12 deg of cyclics are within the 16 deg of the swashplate."""
    low, high = sbs.control_ranges[name]
    limit = math.degrees(high if sign > 0 else low)
    good, bad = beyond(hover, name, limit), beyond(hover, name, limit + sign * 0.1)
    assert len(simulate(sbs, hover, good, 0.01)["time"]) == 2
    allowed = re.escape(f"{name} = {bad[CONTROL_NAMES.index(name)]:.6g}: allowed are {RANGES[name]}")
    rows = np.array([good, good, bad])
    for controls, time in ((bad, 0), (rows, 0.02), (lambda t: good if t < 0.025 else bad, 0.03)):
        with pytest.raises(SimulationError, match=f"^controls at {time} s: {allowed}$"):
            simulate(sbs, hover, controls, 0.05)


def test_a_step_that_no_actuator_follows_is_flown_and_reported(sbs, hover):
    """120 deg/s are 1.2 deg in a tick of 0.01 s."""
    step = np.array([0.0, 0.0, 1.0, 0.0])
    within, beyond = (hover.controls + math.radians(size) * step for size in (1.19, 1.21))
    assert simulate(sbs, hover, within, 0.02).warnings == ()
    reported = tuple(
        f"{name}: longitudinal_cyclic is moved faster than its actuator moves, 120 deg/s" for name in ("MR1", "MR2")
    )
    flight = simulate(sbs, hover, beyond, 0.02)
    assert flight.warnings == reported
    assert flight["swashplate"][0].tolist() == sbs.mix(beyond).tolist()  # at once, as linear models have it
    assert simulate(sbs, hover, np.array([hover.controls, beyond]), 0.02).warnings == reported
    state = trimmed_state(sbs, hover)  # whose swashplate angles are not known
    assert simulate(sbs, state, beyond, 0.02).warnings == ()
    assert simulate(sbs, state, lambda t: hover.controls if t < 0.015 else beyond, 0.02).warnings == reported
    assert simulate_batch([Case(sbs, hover, beyond)], 0.02).warnings == (reported,)


def test_actuators_are_those_of_the_live_flight(sbs, hover):
    """The mixer's: excess is clipped and reported, the swashplates take their time; bit for bit as with a pilot."""
    wanted = beyond(hover, "longitudinal_cyclic", 15.0)
    flight = simulate(sbs, hover, wanted, 0.3, actuators=True)
    assert flight.warnings == ("clipped: longitudinal_cyclic at its limit of 12 deg",)
    expected = np.minimum(120.0 * flight["time"], 12.0)
    np.testing.assert_allclose(np.degrees(flight["swashplate"][:, 0, 2]), expected, atol=1e-9)
    live = simulate_with_pilot(sbs, hover, lambda time, state: wanted, 0.3)
    for name, values in live.items():
        assert flight[name].tobytes() == values.tobytes(), name
    assert live.warnings == flight.warnings
    batch = simulate_batch([Case(sbs, hover, wanted)], 0.3, actuators=True, outputs=["state"])
    assert batch["state"][0].tobytes() == flight["state"].tobytes()
    slow = lambda time: hover.controls + [0.0, 0.01 * math.sin(3.0 * time), 0.0, 0.0]  # noqa: E731
    both = [simulate(sbs, hover, slow, 0.3, actuators=on)["state"].tobytes() for on in (False, True)]
    assert both[0] == both[1]  # what they can follow is the same with them


def test_rows_of_controls_that_would_not_be_flown_are_refused(sbs, hover):
    rows = np.tile(hover.controls, (12, 1))
    assert len(simulate(sbs, hover, rows[:11], 0.1)["time"]) == 11
    line = r"controls have 12 rows: allowed are up to 11, one for each tick of 0.01 s and the end"
    with pytest.raises(SimulationError, match=f"^{line}$"):
        simulate(sbs, hover, rows, 0.1)
    assert simulate_batch([Case(sbs, hover, rows)], 0.1).errors == (line,)


def test_a_trim_of_an_aircraft_with_other_rotors_is_refused(sbs, hover):
    tandem = Aircraft.load(Path(__file__).resolve().parents[1] / "data" / "tandem.yaml")
    line = "start: a trim with 38 states: allowed is one of an aircraft with 3, 5 blades, with 46"
    with pytest.raises(SimulationError, match=f"^{line}$"):
        simulate(tandem, hover, hover.controls, 0.1)
    assert simulate_batch([Case(tandem, hover)], 0.1).errors == (line,)


def test_attitude_and_airspeed_are_found_by_name(sbs):
    """In a turn in steady wind: angles as by their definition, and the speed relative to the air."""
    point = trim(sbs, airspeed=8.0, turn_rate=0.5)
    wind = Wind(velocity=(4.0, -3.0, 1.0))
    flight = simulate(sbs, point, point.controls, 1.0, wind=wind)
    for i in range(0, 101, 10):
        expected = quaternion_to_euler(flight["state"][i, ATTITUDE:VELOCITY])
        assert [flight[name][i] for name in ("psi", "theta", "phi")] == pytest.approx(expected, abs=1e-15)
        to_earth = rotation_matrix(flight["state"][i, ATTITUDE:VELOCITY])
        air = to_earth @ flight["state"][i, VELOCITY:RATES] - wind.velocity
        assert flight["V"][i] == pytest.approx(np.linalg.norm(air), rel=1e-12)
    assert flight["V"][0] == pytest.approx(8.0, rel=1e-9)
    assert flight["psi"][-1] == pytest.approx(0.5, abs=0.02)
    with pytest.raises(KeyError, match="no 'alpha': there are north, east, "):
        flight["alpha"]
    assert repr(flight).startswith("<flight of 1 s, 101 rows of north, east, ")


def test_histories_of_a_flight_are_found_by_name(sbs, hover):
    flight = simulate(sbs, hover, hover.controls, 0.2)
    assert set(flight) == set(sbs.layout.names) | {
        "time",
        "state",
        "controls",
        "swashplate",
        "acceleration",
        "thrust",
        "torque",
        "power",
        "psi",
        "theta",
        "phi",
        "V",
    }
    shapes = {"state": (21, 43), "controls": (21, 4), "swashplate": (21, 2, 3), "acceleration": (21, 3)}
    shapes |= {"thrust": (21, 2), "torque": (21, 2), "power": (21, 2)}
    for name, values in flight.items():
        assert values.shape == shapes.get(name, (21,)), name
    np.testing.assert_allclose(flight["time"], np.arange(21) * 0.01, atol=1e-15)
    for i, name in enumerate(sbs.layout.names):
        np.testing.assert_array_equal(flight[name], flight["state"][:, i])
    np.testing.assert_allclose(flight["thrust"], np.broadcast_to(hover.thrust, (21, 2)), rtol=1e-6)
    np.testing.assert_allclose(flight["power"], np.broadcast_to(hover.power, (21, 2)), rtol=1e-6)
    np.testing.assert_array_equal(flight["state"][0], trimmed_state(sbs, hover))


def test_controls_may_be_constant_rows_or_a_function(sbs, hover):
    rows = hover.controls + 0.01 * np.sin(np.arange(11))[:, None] * [0.5, 1.0, -1.0, 0.5]
    by_rows = simulate(sbs, hover, rows, 0.1)
    by_function = simulate(sbs, hover, lambda time: rows[round(time / 0.01)], 0.1)
    for name in by_rows:
        np.testing.assert_array_equal(by_rows[name], by_function[name])
    np.testing.assert_array_equal(by_rows["controls"], rows)
    np.testing.assert_array_equal(by_rows["swashplate"], [sbs.mix(row) for row in rows])
    # row i is in force during tick i, so the first difference of the rows shows after it
    constant = simulate(sbs, hover, rows[0], 0.1)
    np.testing.assert_array_equal(constant["state"][:2], by_rows["state"][:2])
    assert (constant["state"][2] != by_rows["state"][2]).any()
    held = simulate(sbs, hover, rows[:3], 0.1)
    np.testing.assert_array_equal(held["controls"][3:], np.broadcast_to(rows[2], (8, 4)))
    np.testing.assert_array_equal(held["state"][:4], by_rows["state"][:4])
    as_list = simulate(sbs, hover, rows[0].tolist(), 0.1)
    np.testing.assert_array_equal(as_list["state"], constant["state"])


def test_a_flight_is_what_the_simulation_does(sbs, hover):
    flight = simulate(sbs, hover, hover.controls + [0.01, 0, 0, 0], 0.1, wind=STORM, method="partitioned")
    simulation = Simulation(
        sbs,
        trimmed_state(sbs, hover, wind=STORM.velocity),
        sbs.mix(hover.controls + [0.01, 0, 0, 0]),
        wind=STORM,
        method="partitioned",
    )
    for _ in range(10):
        simulation.advance()
    np.testing.assert_array_equal(flight["state"][-1], simulation.state)


def test_a_flight_may_start_from_a_state(sbs, hover):
    state = trimmed_state(sbs, hover, position=(5.0, 6.0, -7.0), heading=1.0)
    flight = simulate(sbs, state, hover.controls, 0.1)
    np.testing.assert_array_equal(flight["state"][0], state)
    np.testing.assert_allclose(flight["state"][-1], state, atol=1e-8)


@pytest.mark.parametrize(("duration", "ticks"), [(0.0, 0), (0.01, 1), (0.014, 1), (0.016, 2), (0.1, 10), (0.29, 29)])
def test_durations_are_integer_numbers_of_ticks(sbs, hover, duration, ticks):
    assert len(simulate(sbs, hover, hover.controls, duration)["time"]) == ticks + 1


@pytest.mark.parametrize("duration", [-0.01, math.nan, math.inf, 2e6])
def test_bad_durations_are_refused(sbs, hover, duration):
    line = f"duration = {duration}: allowed are 0 to 1e+06 s"
    assert refusal(simulate, sbs, hover, hover.controls, duration) == line


@pytest.mark.parametrize("shape", [(), (3,), (5,), (0,), (0, 4), (4, 3), (2, 2, 4)])
def test_controls_of_another_shape_are_refused(sbs, hover, shape):
    line = f"controls have shape {shape}: allowed are (4,) and (n, 4)"
    assert refusal(simulate, sbs, hover, np.zeros(shape), 0.1) == line


def test_bad_values_from_a_function_of_time_are_refused(sbs, hover):
    assert refusal(simulate, sbs, hover, lambda _: [0.1, 0.0, 0.0], 0.1) == (
        "controls have shape (3,): allowed is (4,)"
    )

    def late(time):
        return hover.controls if time < 0.05 else hover.controls * math.nan

    assert refusal(simulate, sbs, hover, late, 0.1).startswith("collective = nan: allowed are -1.5708 to 1.5708 rad")


@pytest.mark.parametrize("i", range(4), ids=CONTROL_NAMES)
def test_controls_beyond_the_ranges_are_refused(sbs, hover, i):
    controls = hover.controls.copy()
    controls[i] = 1.0
    assert " = " in refusal(simulate, sbs, hover, controls, 0.1)


def test_a_flight_with_bad_options_is_refused(sbs, hover):
    assert refusal(simulate, sbs, hover, hover.controls, 0.1, tick=0.0).startswith("tick = 0.0: ")
    assert refusal(simulate, sbs, hover, hover.controls, 0.1, method="euler").startswith("method = 'euler': ")
    assert refusal(simulate, sbs, np.zeros(43), hover.controls, 0.1).startswith("state attitude ")
