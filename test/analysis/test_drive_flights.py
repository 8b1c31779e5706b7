"""Trim, linear models and flights of aircraft with drives (theory.md section 7.6)."""

import math
from pathlib import Path

import numpy as np
import pytest
from helpers import aircraft_data

from sbs_sim import Aircraft, EngineFailure, Simulation, linearize, simulate, trim
from sbs_sim.errors import LinearizationError, SimulationError, TrimError
from sbs_sim.flight.trimmed_state import trimmed_state

ENGINE = {"kind": "engine", "max_torque": 16.0, "lag": 0.1}
GOVERNOR = {"proportional_gain": 5.0, "integral_gain": 2.0}
BELT = {"rotors": ["R1", "R2"], "inertia": 0.02}
NOMINAL = 2400 * math.pi / 30


def belted(every_rotor=None, **drive):
    """Return `sbs` with both rotors on one drive; coarse blades."""
    data = aircraft_data(options={"elements": 8}, every_rotor=every_rotor)
    return Aircraft.from_dict(data | {"drives": [{**BELT, **drive}]})


def constant(speed=1.0):
    """Return the same with rotors of constant speed, a factor on that of the file."""
    return Aircraft.from_dict(aircraft_data(options={"elements": 8}, every_rotor={"speed_rpm": 2400 * speed}))


@pytest.fixture(scope="module")
def governed():
    """Aircraft with engine and governor, and its hover."""
    aircraft = belted(engine=ENGINE, governor=GOVERNOR)
    return aircraft, trim(aircraft)


@pytest.mark.parametrize("set_point", [1.0, 1.04])
def test_governed_hover_is_that_of_rotors_with_this_speed(set_point):
    """The governor's integral settles speed and throttle; inflow ratios keep the scale of the file's speed."""
    aircraft = belted(engine=ENGINE, governor={**GOVERNOR, "set_point": set_point})
    point, same = trim(aircraft), trim(constant(set_point))
    assert point["Omega(1)"] == pytest.approx(set_point * NOMINAL, rel=1e-10)
    np.testing.assert_allclose(point.controls, same.controls, atol=1e-9)
    np.testing.assert_allclose(point.power, same.power, rtol=1e-8)
    assert point["lambda0(1)"] == pytest.approx(set_point * same["lambda0(1)"], rel=1e-7)
    assert point["engine_torque(1)"] == pytest.approx(point.torque.sum(), rel=1e-9)
    assert point["governor(1)"] == pytest.approx(point["engine_torque(1)"] / 16.0, rel=1e-9)


def test_autorotation_is_the_flight_of_a_constant_speed_that_takes_no_torque():
    """Without an engine the speed is an unknown: what it comes to takes no power at constant speed either."""
    point = trim(belted(), airspeed=15.0, climb_rate=-8.0)
    assert 0.9 * NOMINAL < point["Omega(1)"] < 1.2 * NOMINAL
    np.testing.assert_allclose(point.torque, 0.0, atol=1e-6)
    same = trim(constant(point["Omega(1)"] / NOMINAL), airspeed=15.0, climb_rate=-8.0)
    # of second order in the waves of the speed, which three blades make in forward flight
    np.testing.assert_allclose(same.torque, 0.0, atol=1e-4)
    np.testing.assert_allclose(point.controls, same.controls, atol=1e-5)


def test_electric_hover():
    """The motor's equations hold at the trim that is found, though throttle and free-wheel have ends with no slope."""
    aircraft = Aircraft.load(Path(__file__).resolve().parents[1] / "data" / "electric.yaml")
    point = trim(aircraft)
    assert point["Omega(1)"] == pytest.approx(NOMINAL, rel=1e-10)
    current = point["engine_torque(1)"] / 0.15
    assert 50.0 * point["governor(1)"] == pytest.approx(0.15 * NOMINAL + 0.05 * current, rel=1e-9)
    flown = simulate(aircraft, point, point.controls, 1.0, method="rk4")
    amperes = np.mean(flown["engine_torque(1)"]) / 0.15 * point["governor(1)"]
    assert flown["discharge(1)"][-1] == pytest.approx(amperes / (16.0 * 3600.0), rel=1e-3)


def test_a_motor_that_lacks_voltage_droops():
    """At full throttle torque and speed are on the motor's line, below the set point, and the trim warns of it."""
    aircraft = Aircraft.load(Path(__file__).resolve().parents[1] / "data" / "electric.yaml")
    point = trim(aircraft.with_values({"drives[0].battery.full_voltage": 42.0, "drives[0].engine.resistance": 0.2}))
    speed, torque = point["Omega(1)"], point["engine_torque(1)"]
    assert pytest.approx(0.15 * speed + 0.2 * torque / 0.15, rel=1e-9) == 42.0
    assert point.warnings[-1] == f"drive 1: throttle at its end, speed {1 - speed / NOMINAL:.1%} below its set point"
    assert trim(aircraft).warnings == ()


def test_what_cannot_hover_has_no_trim():
    """Without an engine hover is refused with a reason."""
    with pytest.raises(TrimError, match="no trim"):
        trim(belted())


def test_linear_model_has_the_speed_as_a_state(governed):
    """Engine and governor as declared; rotors slow down by more collective; no mode without a name."""
    aircraft, point = governed
    model = linearize(aircraft, point=point)
    speed, torque, governor = (model.state_names.index(f"{name}(1)") for name in ("Omega", "engine_torque", "governor"))
    assert model.state_names[-3:] == ("Omega(1)", "engine_torque(1)", "governor(1)")
    assert model.a[torque, torque] == pytest.approx(-10.0, rel=1e-6)
    assert model.a[torque, governor] == pytest.approx(160.0, rel=1e-6)
    assert model.a[torque, speed] == pytest.approx(-5.0 * 160.0 / NOMINAL, rel=1e-6)
    assert model.a[governor, speed] == pytest.approx(-2.0 / NOMINAL, rel=1e-6)
    assert model.a[speed, torque] > 0.0 > model.a[speed, speed]
    assert model.b[speed, 0] < 0.0
    power = model.output_names.index("power(1)")
    torques = model.output_names.index("torque(1)")
    expected = NOMINAL * model.c[torques, speed] + point.torque[0]
    assert model.c[power, speed] == pytest.approx(expected, rel=1e-9)
    assert {mode.name for mode in model.modes if mode.family == "drive"} >= {"governor", "rotor speed"}


def test_linear_model_follows_the_flight(governed):
    """A step of a tenth of a degree of collective: speed, torque and sink within 2 % of what they change by."""
    aircraft, point = governed
    model, step = linearize(aircraft, point=point), np.array([math.radians(0.1), 0.0, 0.0, 0.0])
    flown = simulate(aircraft, point, point.controls + step, 0.5, method="rk4", tick=0.005)
    names = ("Omega(1)", "engine_torque(1)", "w")
    x = np.zeros(len(model.a))
    for _ in range(5000):  # Heun's method is enough for steps of 0.1 ms
        rate = model.a @ x + model.b @ step
        x = x + 1e-4 * (rate + 0.5e-4 * (model.a @ rate))
    for name in names:
        change = flown[name][-1] - flown[name][0]
        assert x[model.state_names.index(name)] == pytest.approx(change, rel=0.02)


def test_run_up_from_rest_and_autorotation_to_the_ground():
    """Rotors at rest are brought to their set point; without its engine the aircraft sinks, and the air turns them."""
    aircraft = belted({"lag_spring": 30.0, "lag_damping": 0.3}, engine={**ENGINE, "max_torque": 8.0}, governor=GOVERNOR)
    x = np.zeros(aircraft.layout.size)
    x[2], x[3] = -200.0, 1.0
    events = [EngineFailure(3.5)]
    flown = simulate(aircraft, x, np.zeros(4), 5.0, method="rk4", events=events, tick=0.02)
    speed, at = flown["Omega(1)"], round(3.5 / 0.02)
    assert speed[0] == 0.0
    assert speed[at] == pytest.approx(NOMINAL, rel=0.05)
    assert flown["engine_torque(1)"][-1] < 1e-4
    assert (np.diff(speed[at + 20 :]) > 0.0).all()  # flat blades in a fall: the air drives them
    assert flown["power"][-1].sum() < 0.0
    assert flown.warnings
    np.testing.assert_allclose(flown["power"], flown["torque"] * speed[:, None], rtol=1e-12, atol=1e-9)
    with pytest.raises(SimulationError, match="ground contact"):
        simulate(aircraft, flown["state"][-1], np.zeros(4), 60.0, method="rk4", ground_altitude=-50.0)


def test_events_are_those_of_the_simulation_bit_for_bit(governed):
    """`simulate` with an event is the same as ticks one by one with `fail_engine` between two of them."""
    aircraft, point = governed
    events = [EngineFailure(0.12, share=0.5), EngineFailure(0.3)]
    flown = simulate(aircraft, point, point.controls, 0.5, method="tsit5", events=events)
    state = trimmed_state(aircraft, point)
    simulation = Simulation(aircraft, state, point.swashplate, method="tsit5")
    for tick in range(50):
        np.testing.assert_array_equal(simulation.snapshot().loads[:, 0], flown["thrust"][tick])
        np.testing.assert_array_equal(simulation.snapshot().azimuth, simulation.snapshot().azimuth % (2 * math.pi))
        if tick in (12, 30):
            simulation.fail_engine(1, 0.5 if tick == 12 else 1.0)
        simulation.advance()
    np.testing.assert_array_equal(simulation.state, flown["state"][-1])
    speed = flown["Omega(1)"]
    assert speed[0] > speed[29] > speed[-1]


def test_the_default_method_is_one_that_can_fly_it(governed):
    """tsit5 with drives, etd without; the options, which logs have, say which."""
    aircraft, point = governed
    default = simulate(aircraft, point, point.controls, 0.05)
    np.testing.assert_array_equal(
        default["state"], simulate(aircraft, point, point.controls, 0.05, method="tsit5")["state"]
    )
    start = trimmed_state(aircraft, point)
    assert Simulation(aircraft, start, point.swashplate).options["method"] == "tsit5"
    kept = constant()
    hover = trim(kept)
    assert Simulation(kept, trimmed_state(kept, hover), hover.swashplate).options["method"] == "etd"
    with pytest.raises(SimulationError, match="method = 'euler': allowed are auto, etd"):
        simulate(aircraft, point, point.controls, 0.1, method="euler")


def test_azimuths_are_those_of_the_drive(governed):
    """At a governed speed they grow as those of rotors of constant speed do."""
    aircraft, point = governed
    simulation = Simulation(aircraft, trimmed_state(aircraft, point), point.swashplate, method="rk4")
    kept = Simulation(constant(), trimmed_state(constant(), trim(constant())), point.swashplate)
    for _ in range(3):
        simulation.advance()
        kept.advance()
    np.testing.assert_allclose(simulation.snapshot().azimuth, kept.snapshot().azimuth, atol=1e-6)


def test_what_is_not_possible_is_refused(governed):
    """With one clear line."""
    aircraft, point = governed
    for method in ("etd", "partitioned"):
        with pytest.raises(
            SimulationError, match=f"method of an aircraft with drives = '{method}': allowed are rk4, tsit5"
        ):
            simulate(aircraft, point, point.controls, 0.1, method=method)
    with pytest.raises(TrimError, match="two_loop"):
        trim(aircraft, method="two_loop")
    with pytest.raises(LinearizationError, match="paper"):
        linearize(aircraft, point=point, method="paper")
    with pytest.raises(SimulationError, match="engine of drive 2: allowed are 1"):
        simulate(aircraft, point, point.controls, 0.1, method="rk4", events=[EngineFailure(0.0, 2)])
    with pytest.raises(SimulationError, match="share = 2"):
        EngineFailure(0.0, share=2)
    kept = constant()
    with pytest.raises(SimulationError, match="the aircraft has none"):
        simulate(kept, trim(kept), np.zeros(4), 0.1, events=[EngineFailure(0.0)])
