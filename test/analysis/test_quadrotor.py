"""The quadrotor: pilot controls act on the throttles of four motors (theory.md section 7.6)."""

import math

import numpy as np
import pytest

from sbs_sim import Aircraft, EngineFailure, Simulation, linearize, simulate, trim
from sbs_sim.errors import SimulationError
from sbs_sim.flight.mixer import Mixer
from sbs_sim.flight.trimmed_state import trimmed_state
from sbs_sim.model import state as S

SPEEDS = [f"Omega({i})" for i in (1, 2, 3, 4)]
FRONT_RIGHT, FRONT_LEFT, REAR_LEFT, REAR_RIGHT = range(4)
COUNTER_CLOCKWISE = [FRONT_RIGHT, REAR_LEFT]
ACROSS = [FRONT_LEFT, FRONT_RIGHT, REAR_RIGHT, REAR_LEFT]  # rotors in the mirror
STEP = math.radians(0.2)


@pytest.fixture(scope="module")
def quadrotor():
    """Aircraft and its hover."""
    aircraft = Aircraft.load("quadrotor")
    return aircraft, trim(aircraft)


def speeds(point):
    """Speeds of the four rotors [rad/s]."""
    return np.array([point[name] for name in SPEEDS])


def test_hover_balances_thrusts_torques_and_voltages(quadrotor):
    """A quarter of the weight each; what the motor gives is what the rotor takes, by eq. (7.15) from the throttle."""
    aircraft, hover = quadrotor
    assert hover.beyond_limits == ()
    np.testing.assert_allclose(hover.thrust, aircraft.body.mass * 9.80665 / 4, rtol=1e-9)
    torque, throttle = np.array([hover[f"engine_torque({i})"] for i in (1, 2, 3, 4)]), hover.swashplate[4:, S.THROTTLE]
    np.testing.assert_allclose(torque, hover.torque, rtol=1e-9)
    np.testing.assert_allclose(16.8 * throttle, 0.00398 * speeds(hover) + 0.07 * torque / 0.00398, rtol=1e-9)
    np.testing.assert_allclose([hover.pitch, hover.roll, *hover.controls[1:]], 0.0, atol=1e-10)
    np.testing.assert_allclose(speeds(hover), speeds(hover)[0], rtol=1e-10)
    # the identified thrust of 1.562522e-6 N s^2 takes 1086 rad/s; nothing here is fitted to it
    assert speeds(hover)[0] == pytest.approx(math.sqrt(0.752 * 9.80665 / 4 / 1.562522e-6), rel=0.06)


@pytest.mark.parametrize("airspeed", [5.0, 12.0])
def test_forward_flight_is_its_own_mirror_image(quadrotor, airspeed):
    """The speeds of the left are those of the right; it leans ahead, and the rear turns faster."""
    point = trim(quadrotor[0], airspeed=airspeed)
    found = speeds(point)
    np.testing.assert_allclose(found, found[ACROSS], rtol=1e-10)
    np.testing.assert_allclose([point.roll, point["roll_stick"], point["yaw_stick"]], 0.0, atol=1e-10)
    assert point.pitch < 0.0 < point["pitch_stick"]
    assert found[REAR_LEFT] > found[FRONT_LEFT]


def test_sideways_flight_to_both_sides(quadrotor):
    """To the left it is the mirror image of that to the right."""
    right, left = (trim(quadrotor[0], airspeed=4.0, sideslip=side * math.pi / 2) for side in (1.0, -1.0))
    np.testing.assert_allclose(speeds(left), speeds(right)[ACROSS], rtol=1e-10)
    np.testing.assert_allclose(left.controls, right.controls * [1.0, -1.0, 1.0, -1.0], atol=1e-10)
    assert right.roll > 0.01
    assert left.roll == pytest.approx(-right.roll, abs=1e-10)


def flown(aircraft, hover, control, tick=0.005):
    """Fly a fifth of a second with a little more of one control."""
    step = STEP * np.eye(4)[control]
    return simulate(aircraft, hover, hover.controls + step, 0.2, method="rk4", tick=tick)


def test_each_stick_moves_the_aircraft_its_way(quadrotor):
    """Yaw is by torques: rotors that turn counter-clockwise turn the nose right where they speed up."""
    aircraft, hover = quadrotor
    up, right, down, yaw = (flown(aircraft, hover, control) for control in range(4))
    assert up["w"][-1] < -0.01
    assert right["p"][-1] > 0.01
    assert down["q"][-1] < -0.01
    assert yaw["r"][-1] > 0.01
    change = np.array([yaw[name][-1] - yaw[name][0] for name in SPEEDS])
    assert (change[COUNTER_CLOCKWISE] > 1.0).all()
    assert (change[[FRONT_LEFT, REAR_RIGHT]] < -1.0).all()
    for name in ("p", "q"):
        assert abs(yaw[name][-1]) < 1e-2 * yaw["r"][-1]


def test_a_flight_to_the_left_is_the_mirror_image_of_one_to_the_right(quadrotor):
    """Rolling and yawing with speeds that change, to rounding."""
    aircraft, hover = quadrotor
    side = np.array([0.0, 0.02, 0.0, 0.01])
    level = hover.controls * [1.0, 0.0, 0.0, 0.0]
    right, left = (simulate(aircraft, hover, level + sign * side, 0.2, method="rk4") for sign in (1.0, -1.0))
    for name, sign in (("u", 1), ("w", 1), ("q", 1), ("v", -1), ("p", -1), ("r", -1), ("phi", -1)):
        np.testing.assert_allclose(left[name], sign * right[name], atol=1e-10)
    assert right["p"][-1] > 0.1
    for i, j in enumerate(ACROSS):
        np.testing.assert_allclose(left[SPEEDS[i]], right[SPEEDS[j]], rtol=1e-10)


def test_linear_model_has_the_speeds_as_states_and_follows_the_flight(quadrotor):
    """The mean over azimuths that all rotors pass together; throttle to speed to climb, within 3 % of the change."""
    aircraft, hover = quadrotor
    model = linearize(aircraft, point=hover)
    assert set(SPEEDS) <= set(model.state_names)
    poles = [mode.pole.real for mode in model.modes if mode.name.startswith("rotor speed")]
    np.testing.assert_allclose(poles, -1.0 / 0.033, rtol=0.1)  # the identified time constant of the speed
    flight = flown(aircraft, hover, 0)
    x, rate = np.zeros(len(model.a)), None
    for _ in range(20000):  # Heun's method with steps of 10 us
        rate = model.a @ x + model.b[:, 0] * STEP
        x = x + 1e-5 * (rate + 0.5e-5 * (model.a @ rate))
    for name in ("w", SPEEDS[0], "engine_torque(3)"):
        change = flight[name][-1] - flight[name][0]
        assert x[model.state_names.index(name)] == pytest.approx(change, rel=0.03)


def test_rows_of_drives_are_mixed_flown_and_checked(quadrotor):
    """Mixer, `Aircraft.mix` and whole flights have the same bits; the ends of the throttle are its limits."""
    aircraft, hover = quadrotor
    assert hover.swashplate.shape == (8, 3)
    np.testing.assert_array_equal(hover.swashplate[:4], 0.0)
    np.testing.assert_array_equal(hover.swashplate[4:, S.SET_POINT :], [[1.0, 0.0]] * 4)
    np.testing.assert_array_equal(aircraft.mix(hover.controls), hover.swashplate)
    np.testing.assert_allclose(aircraft.unmix(hover.swashplate), hover.controls, atol=1e-14)
    mixer = Mixer(aircraft)
    mixer.set_position(hover.swashplate)
    moved = hover.controls + [0.1, 0.02, 0.01, -0.01]
    mixer.set_target(moved)
    np.testing.assert_array_equal(mixer.move(0.01), aircraft.mix(moved))
    mixer.set_target([math.radians(60.0), 0.0, 0.0, math.radians(30.0)])
    assert mixer.saturated == ("drive 1 throttle at its limit of 1", "drive 3 throttle at its limit of 1")
    simulation = Simulation(aircraft, trimmed_state(aircraft, hover), hover.swashplate, method="rk4")
    for wrong, text in ((1.5, "drive 1 throttle = 1.5: allowed are 0 to 1$"), (math.nan, "drive 1 throttle = nan")):
        values = hover.swashplate.copy()
        values[4, 0] = wrong
        with pytest.raises(SimulationError, match=text):
            simulation.set_swashplate(values)
    with pytest.raises(SimulationError, match="swashplate has 4 rotors and drives that controls act on: allowed are 8"):
        simulation.set_swashplate(hover.swashplate[:4])
    controls = hover.controls + np.linspace(0.0, 0.05, 11)[:, None] * [1.0, 0.5, 0.2, -0.3]
    flight = simulate(aircraft, hover, controls, 0.1, method="rk4", actuators=True)
    for row in controls[:10]:
        simulation.set_swashplate(aircraft.mix(row))
        simulation.advance()
    np.testing.assert_array_equal(simulation.state, flight["state"][-1])


def test_an_engine_failure_turns_the_quadrotor_over(quadrotor):
    """Without the motor of the front right it rolls right and noses down."""
    aircraft, hover = quadrotor
    flight = simulate(aircraft, hover, hover.controls, 0.2, method="rk4", events=[EngineFailure(0.0, drive=1)])
    assert flight[SPEEDS[0]][-1] < 0.85 * flight[SPEEDS[0]][0]
    assert flight["p"][-1] > 1.0
    assert flight["q"][-1] < -1.0
