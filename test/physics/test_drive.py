"""Rotors whose speed is a state: against the plain model at given speeds, and by what is conserved (section 7.6)."""

import math

import numpy as np
import pytest
from balances import at_speeds, azimuths, ratios, totals
from helpers import VACUUM, WEIGHTLESS_VACUUM, Model, aircraft_data, unit
from plain_model import plain_derivative

from sbs_sim import Aircraft
from sbs_sim.errors import AircraftError
from sbs_sim.model import records as R
from sbs_sim.model import state as S
from sbs_sim.model.state import StateLayout

# Two drives, gears, tilted shafts, both senses, three to five blades: every coupling term counts.
ROTORS = [
    {"shaft_direction": unit(0.1, -0.2, -1.0), "blades": 4, "flap_hinge_offset": 0.03, "lag_spring": 20.0},
    {"shaft_direction": unit(-0.2, 0.3, -0.9), "blades": 5, "speed_rpm": 2100.0},
    {"hub": [-1.2, 0.1, -0.2], "shaft_direction": [0.0, 1.0, 0.0], "speed_rpm": 3600.0, "blade_mass": 0.05},
]
DRIVES = [{"rotors": ["R1", "R3"], "inertia": 0.02, "inertia_axis": [0.0, 0.6, 0.1]}, {"rotors": ["R2"]}]
PSI = np.array([0.3, 0.7, 1.1])


def driven(drives, rotors, environment=None, damping=0.0, elements=1):
    """Return an aircraft with drives."""
    data = aircraft_data(
        environment=environment,
        options={"elements": elements},
        every_rotor={"lag_damping": damping},
        rotors=rotors,
    )
    return Aircraft.from_dict(data | {"drives": drives})


def tumbling_state(model, speeds, seed=1, angle=0.05, rate=5.0, inflow=0.0):
    """Return a state that tumbles with blades that flap and lag, and drives of given speeds [rad/s]."""
    rng, layout, n = np.random.default_rng(seed), model.layout, model.layout.blade_count
    x = model.state(rng.normal(scale=5.0, size=3), rng.normal(scale=1.0, size=3), inflow)
    x[S.ATTITUDE : S.VELOCITY] = unit(*rng.normal(size=4))
    for block, scale in ((0, angle), (1, rate), (2, angle), (3, rate)):
        first = S.BODY_SIZE + block * n
        x[first : first + n] = rng.normal(scale=scale, size=n)
    for i, speed in enumerate(speeds):
        x[layout.drive(i)["Omega"]] = speed
    return x


@pytest.mark.parametrize("lead_lag", [True, False])
def test_equations_are_those_of_the_plain_model_at_the_same_speeds(lead_lag):
    """Given speeds and their rates, all rates agree; the shaft torques then are what the drives lack, eq. (7.10)."""
    aircraft = driven(DRIVES, ROTORS, damping=0.1, elements=5)
    model = Model(aircraft, lead_lag)
    swash = np.array([[0.1, 0.02, -0.03], [0.12, -0.01, 0.02], [0.05, 0.0, 0.0]])
    x = tumbling_state(model, [230.0, -90.0], seed=3, inflow=0.05)
    if not lead_lag:
        for j in range(3):
            x[model.layout.lag(j)] = x[model.layout.lag_rate(j)] = 0.0
    x[model.layout.drive(0)["azimuth"]], x[model.layout.drive(1)["azimuth"]] = 2.0, -70.0
    dx, layout = model.derivative(x, swash, PSI, wind=[2.0, -3.0, 1.0]), model.layout
    rates = [dx[layout.drive(i)["Omega"]] for i in range(2)]
    size, psi, om_dot = layout.drives_start, azimuths(aircraft, x, PSI), dx[S.RATES : S.BODY_SIZE]
    torques = model.loads[:, R.TORQUE]
    for i, drive in enumerate(aircraft.drives):
        shaft = sum(gear * torques[j] for j, (number, gear) in enumerate(ratios(aircraft)) if number == i)
        assert drive.inertia * (rates[i] + drive.inertia_axis @ om_dot) == pytest.approx(-shaft, abs=1e-8)
    assert np.abs(rates).min() > 1.0
    # the plain model has no transmission
    still = driven([{**DRIVES[0], "inertia": 0.0}, DRIVES[1]], ROTORS, damping=0.1, elements=5)
    model = Model(still, lead_lag)
    dx = model.derivative(x, swash, PSI, wind=[2.0, -3.0, 1.0])
    plain = at_speeds(still, x, [dx[layout.drive(i)["Omega"]] for i in range(2)])
    expected, loads = plain_derivative(plain, x[:size], swash, psi, [2.0, -3.0, 1.0], lead_lag)
    np.testing.assert_allclose(dx[:size], expected, rtol=1e-9, atol=1e-8 * np.abs(expected).max())
    for name, part in (("torque", R.TORQUE), ("thrust", R.THRUST)):
        np.testing.assert_allclose(model.loads[:, part], loads[name], atol=1e-8 * np.abs(model.loads).max())
    np.testing.assert_allclose(model.loads[:, R.FORCE : R.FORCE + 3], loads["force"], rtol=1e-8, atol=1e-7)
    np.testing.assert_allclose(model.loads[:, R.MOMENT : R.MOMENT + 3], loads["moment"], rtol=1e-8, atol=1e-7)


def test_blades_or_flights_in_the_lanes_give_the_same_bits():
    """As for the aircraft without drives, see `sbs_sim.lanes`."""
    engine = {"kind": "electric", "max_torque": 8.0, "torque_constant": 0.1, "throttle": 0.5}
    aircraft = driven([{**DRIVES[0], "engine": engine, "governor": GOVERNOR}, DRIVES[1]], ROTORS, elements=5)
    found = []
    for lanes in ("blades", "points"):
        model = Model(aircraft, lanes=lanes)
        x = tumbling_state(model, [230.0, -90.0], inflow=0.05)
        found.append(model.derivative(x, np.full((3, 3), 0.05), PSI).tobytes() + model.loads.tobytes())
    assert found[0] == found[1]


@pytest.mark.parametrize("lead_lag", [True, False])
def test_momentum_and_energy_of_a_tumbling_aircraft(lead_lag):
    """Drives that turn freely in vacuum: momentum and energy to 1e-9, one of them backwards."""
    model = Model(driven(DRIVES, ROTORS, WEIGHTLESS_VACUUM), lead_lag)
    x = tumbling_state(model, [200.0, -150.0])
    if not lead_lag:
        for j in range(3):
            x[model.layout.lag(j)] = x[model.layout.lag_rate(j)] = 0.0
    p, h, total = totals(model.aircraft, x, PSI)
    step, start = math.radians(0.25) / 250.0, x
    x = model.fly(x, 2880, step, psi0=PSI)
    for found, expected in zip(totals(model.aircraft, x, PSI), (p, h, total), strict=True):
        np.testing.assert_allclose(found, expected, atol=1e-9 * max(1.0, np.abs(expected).max()))
    speeds = [model.layout.drive(i)["Omega"] for i in range(2)]
    assert np.abs(x[speeds] - start[speeds]).min() > 0.2


ENGINE = {"kind": "engine", "max_torque": 8.0, "lag": 0.05, "throttle": 1.0}


def test_the_work_of_an_engine_is_the_gain_of_energy_and_its_torque_turns_the_body_back():
    """A single rotor runs up from rest in vacuum: energy gained is torque times angle; the momentum stays zero."""
    drive = {"rotors": ["R1"], "inertia": 0.01, "inertia_axis": [0.0, 0.0, 1.0], "engine": ENGINE}
    model = Model(driven([drive], [{"hub": [0.0, 0.0, 0.0]}], WEIGHTLESS_VACUUM))
    places, x, psi = model.layout.drive(0), model.state(), np.array([0.4])
    x[places["engine_torque"]] = 8.0  # the lag is over: a constant torque
    before = totals(model.aircraft, x, psi)
    x = model.fly(x, 20000, 3.125e-5, psi0=psi)
    p, h, total = totals(model.aircraft, x, psi)
    assert x[places["Omega"]] > 50.0
    assert total - before[2] == pytest.approx(8.0 * x[places["azimuth"]], rel=1e-9)
    np.testing.assert_allclose(h, before[1], atol=1e-9 * 0.05 * x[places["Omega"]])
    np.testing.assert_allclose(p, before[0], atol=1e-9)
    assert x[S.RATES + 2] * model.aircraft.rotors[0].rotation > 0.5  # down is against the rotation about up


def test_belt_of_mirrored_rotors_leaves_the_body_at_rest():
    """The torques of two rotors that turn against each other cancel out at the body."""
    drive = {"rotors": ["R1", "R2"], "engine": ENGINE}
    data = aircraft_data(environment=WEIGHTLESS_VACUUM, options={"elements": 1})
    data["body"]["inertia"] = [[3.532, 0.0, 0.0], [0.0, 2.222, 0.0], [0.0, 0.0, 5.342]]
    model = Model(Aircraft.from_dict(data | {"drives": [drive]}))
    x = model.fly(model.state(), 2000, 1e-3)
    assert x[model.layout.drive(0)["Omega"]] > 20.0
    np.testing.assert_allclose(x[S.RATES : S.BODY_SIZE], 0.0, atol=1e-12)


@pytest.mark.parametrize("speed", [0.0, -0.1, -250.0, 1e-9])
def test_every_speed_is_finite(speed):
    """At rest, backwards, and driven by the air: no rate is infinite or not a number."""
    model = Model(driven([{"rotors": ["R1", "R2"], "engine": {**ENGINE, "max_power": 1000.0}}], [{}, {}], elements=5))
    x = tumbling_state(model, [speed], angle=0.02, rate=0.5)
    assert np.isfinite(model.derivative(x)).all()
    x[S.BODY_SIZE : model.layout.drives_start] = x[S.RATES : S.BODY_SIZE] = 0.0
    assert np.isfinite(model.derivative(x)).all()


def test_air_from_below_turns_a_rotor_that_is_free():
    """A rotor at a slow speed with a little negative pitch in descent is driven by the air, from rest on."""
    model = Model(driven([{"rotors": ["R1", "R2"]}], [{}, {}], elements=10))
    x, swash = model.state([0.0, 0.0, 12.0]), np.full((2, 3), 0.0)
    swash[:, 0] = math.radians(-4.0)
    assert model.derivative(x, swash)[model.layout.drive(0)["Omega"]] > 0.0
    x[model.layout.drive(0)["Omega"]] = 251.0  # too fast for that descent: drag brakes it
    assert model.derivative(x, -swash)[model.layout.drive(0)["Omega"]] < 0.0


def test_constant_speed_is_the_limit_of_a_heavy_transmission():
    """With a flywheel of 1e9 kg m^2 the blades and the body move as they do at constant speed."""
    free = Model(driven([{"rotors": ["R1", "R2"], "inertia": 1e6}], [{}, {}], elements=5))
    data = aircraft_data(options={"elements": 5}, every_rotor={"lag_damping": 0.0}, rotors=[{}, {}])
    kept = Model(Aircraft.from_dict(data))
    x = tumbling_state(free, [kept.speeds[0]], inflow=0.05)
    size, swash = kept.layout.size, np.full((2, 3), 0.1)
    found, expected = free.derivative(x, swash, PSI[:2]), kept.derivative(x[:size], swash, PSI[:2])
    np.testing.assert_allclose(found[:size], expected, atol=1e-4 * np.abs(expected).max())
    np.testing.assert_allclose(free.loads, kept.loads, atol=1e-4 * np.abs(kept.loads).max())


# -- engine, governor, battery -----------------------------------------------------------------------------------


def engine_rates(speed, torque=5.0, governor=None, **values):
    """Rates of a drive with an engine at a speed over that of the file; torque in N m."""
    engine = {**ENGINE, **values.pop("engine", {})}
    drive = {"rotors": ["R1", "R2"], "engine": engine, **values}
    model = Model(driven([drive], [{}, {}], VACUUM))
    x, places = model.state(), model.layout.drive(0)
    x[places["Omega"]], x[places["engine_torque"]] = speed * model.speeds[0], torque
    for name, value in (governor or {}).items():
        x[places[name]] = value
    dx = model.derivative(x)
    return {name: dx[place] for name, place in places.items()}, model


def test_engine_follows_its_throttle_up_to_torque_and_power():
    """Eq. (7.13): lag, largest torque, largest power, no torque of an engine that has failed."""
    assert engine_rates(1.0)[0]["engine_torque"] == pytest.approx((8.0 - 5.0) / 0.05)
    assert engine_rates(1.0, engine={"throttle": 0.5})[0]["engine_torque"] == pytest.approx((4.0 - 5.0) / 0.05)
    found, model = engine_rates(1.0, engine={"max_power": 1000.0})
    assert found["engine_torque"] == pytest.approx((1000.0 / model.speeds[0] - 5.0) / 0.05)
    assert engine_rates(1.0, governor={"engine_failure": 1.0})[0]["engine_torque"] == pytest.approx(-5.0 / 0.05)


def test_free_wheel_gives_no_braking_torque():
    """The drag of a failed engine brakes rotors without a free-wheel only."""
    rates = {
        wheel: engine_rates(1.0, torque=0.0, free_wheel=wheel, engine={"drag": 2.0, "throttle": 0.0})[0]["Omega"]
        for wheel in (True, False)
    }
    assert rates[True] == pytest.approx(0.0, abs=1e-9)
    assert rates[False] < -1.0


GOVERNOR = {"proportional_gain": 4.0, "integral_gain": 3.0}


def test_governor():
    """Eq. (7.14): throttle by the missing speed and its integral, which stops at the ends of the throttle."""
    throttle = 0.2 + 0.1 + 4.0 * 0.02
    found = governed(0.98, 0.1)
    assert found["engine_torque"] == pytest.approx((throttle * 8.0 - 5.0) / 0.05)
    assert found["governor"] == pytest.approx(3.0 * 0.02)
    assert governed(0.5, 0.1)["governor"] == 0.0
    assert governed(1.5, 0.1)["governor"] == 0.0


def governed(speed, integral):
    """Rates of a drive with a governor whose throttle begins at 0.2."""
    drive = {"rotors": ["R1", "R2"], "engine": {**ENGINE, "throttle": 0.2}, "governor": GOVERNOR}
    model = Model(driven([drive], [{}, {}], VACUUM))
    x, places = model.state(), model.layout.drive(0)
    x[places["Omega"]], x[places["engine_torque"]] = speed * model.speeds[0], 5.0
    x[places["governor"]] = integral
    dx = model.derivative(x)
    return {name: dx[place] for name, place in places.items()}


def commanded(command, speed=0.98, **drive):
    """Rates of a drive whose throttle and set point are commanded, (throttle, set point)."""
    mixing = {"throttle": {"collective": 1.0}}
    drive = {"rotors": ["R1", "R2"], "engine": {**ENGINE, "throttle": 0.2}, "mixing": mixing, **drive}
    model = Model(driven([drive], [{}, {}], VACUUM))
    x, places = model.state(), model.layout.drive(0)
    x[places["Omega"]], x[places["engine_torque"]] = speed * model.speeds[0], 5.0
    dx = model.derivative(x, np.array([[0.0] * 3, [0.0] * 3, [*command, 0.0]]))
    return {name: dx[place] for name, place in places.items()}


@pytest.mark.parametrize(("command", "throttle"), [(0.3, 0.3), (-0.1, 0.0), (1.2, 1.0)])
def test_controls_set_the_throttle_of_an_engine_without_governor(command, throttle):
    """Eq. (7.16): in place of that of the file, between 0 and 1."""
    assert commanded((command, 1.0))["engine_torque"] == pytest.approx((throttle * 8.0 - 5.0) / 0.05)


def test_controls_set_the_speed_of_a_governor_and_where_it_begins():
    """Eq. (7.16) in (7.14)."""
    mixing = {"throttle": {"collective": 0.5}, "set_point": {"collective": 0.1}}
    found = commanded((0.3, 1.05), governor=GOVERNOR, mixing=mixing)
    assert found["engine_torque"] == pytest.approx(((0.3 + 4.0 * 0.07) * 8.0 - 5.0) / 0.05)
    assert found["governor"] == pytest.approx(3.0 * 0.07)


def test_controls_are_mixed_to_commands_behind_the_swashplates():
    """Factors times controls and what the file has without them; only drives with a mixing have a row."""
    mixing = {"throttle": {"collective": 0.5}, "set_point": {"lateral_cyclic": 0.1}}
    first = {"rotors": ["R1"], "engine": ENGINE}
    second = {"rotors": ["R2"], "engine": {**ENGINE, "throttle": 0.2}, "governor": GOVERNOR, "mixing": mixing}
    aircraft = driven([first, second], [{}, {}])
    assert [row.owner for row in aircraft.rows] == ["R1", "R2", "drive 2"]
    np.testing.assert_allclose(aircraft.mix([0.1, 0.2, 0.0, 0.0])[2], [0.2 + 0.05, 1.0 + 0.02, 0.0], rtol=1e-15)
    assert driven([first, {**second, "mixing": {}}], [{}, {}]).mix([0.1, 0.2, 0.0, 0.0]).shape == (2, 3)


def test_electric_motor():
    """Eq. (7.15): torque by the voltage that back-EMF leaves, and the charge that the battery gives."""
    battery = {"full_voltage": 50.0, "empty_voltage": 40.0, "capacity": 10.0}
    motor = {"kind": "electric", "torque_constant": 0.15, "resistance": 0.2, "throttle": 0.9, "max_torque": 100.0}
    values = {"engine": motor, "battery": battery}
    found, model = engine_rates(1.0, torque=3.0, governor={"discharge": 0.25}, **values)
    current = (0.9 * 47.5 - 0.15 * model.speeds[0]) / 0.2
    assert current > 10.0
    assert found["engine_torque"] == pytest.approx((0.15 * current - 3.0) / 0.05)
    assert found["discharge"] == pytest.approx(0.9 * (3.0 / 0.15) / (10.0 * 3600.0))
    empty, _ = engine_rates(1.0, torque=3.0, governor={"discharge": 1.0}, **values)
    assert (empty["engine_torque"], empty["discharge"]) == (pytest.approx(-3.0 / 0.05), 0.0)


# -- names and files -----------------------------------------------------------------------------------------------


def test_layout():
    """States of drives stand behind all others, what linear models have of them first."""
    layout = StateLayout((3, 3), (("Omega", "engine_torque", "governor"), ("Omega",)))
    plain = StateLayout((3, 3))
    assert layout.names[: plain.size] == plain.names
    seen = ("Omega(1)", "engine_torque(1)", "governor(1)", "Omega(2)")
    assert layout.linear_names == plain.linear_names + seen
    assert layout.names[plain.size : plain.size + 4] == seen
    assert layout.names[plain.size + 4 :] == tuple(
        f"{name}({i})" for i in (1, 2) for name in ("azimuth", "discharge", "engine_failure")
    )
    assert layout.drive(1) == {
        name: layout.names.index(f"{name}(2)") for name in ("Omega", "azimuth", "discharge", "engine_failure")
    }
    assert len(layout.linear_units) == layout.linear_size == len(layout.linear_names)
    state = np.arange(float(layout.size))
    state[S.ATTITUDE : S.VELOCITY] = unit(1.0, 0.1, 0.2, 0.0)
    back = layout.from_linear(layout.to_linear(state))
    np.testing.assert_array_equal(back[S.BODY_SIZE : plain.size + 4], state[S.BODY_SIZE : plain.size + 4])
    assert (back[plain.size + 4 :] == 0.0).all()


@pytest.mark.parametrize(
    ("drives", "text"),
    [
        ([{"rotors": ["MR9"]}], r"drives\[0\].rotors = 'MR9': allowed are R1, R2"),
        ([{"rotors": ["R1"]}, {"rotors": ["R1"]}], r"drives\[1\].rotors = 'R1': driven twice"),
        ([{"rotors": ["R1"], "inertia_axis": [1, 1, 0]}], "inertia_axis has the length 1.41421: allowed is up to 1"),
        ([{"rotors": ["R1"], "governor": {"proportional_gain": 1}}], "integral_gain = 0"),
        ([{"rotors": ["R1"], "battery": {"full_voltage": 10, "empty_voltage": 20}}], "empty_voltage = 20"),
        ([{"rotors": ["R1"], "engine": {"kind": "steam"}}], "drives.*engine.kind"),
        (
            [{"rotors": ["R1"], "mixing": {"throttle": {"collective": 1}}}],
            r"drives\[0\].mixing: not allowed without an",
        ),
        (
            [{"rotors": ["R1"], "engine": ENGINE, "mixing": {"set_point": {"collective": 1}}}],
            r"drives\[0\].mixing.set_point: not allowed without a governor",
        ),
        (
            [{"rotors": ["R1"], "engine": ENGINE, "mixing": {"throttle": {"stick": 1}}}],
            r"drives\[0\].mixing.throttle.stick: unknown key, allowed are collective",
        ),
        ([{"rotors": ["R1"], "engine": {"kind": "electric"}}], r"drives\[0\].engine.max_torque = 0"),
    ],
)
def test_wrong_drives_are_refused(drives, text):
    """One line that names the key."""
    with pytest.raises(AircraftError, match=text):
        driven(drives, [{}, {}])


def test_hash_of_files_without_drives_stays(sbs):
    """An empty list is what older files have; a drive makes another aircraft."""
    data = aircraft_data()
    assert Aircraft.from_dict(data | {"drives": []}).parameter_hash == Aircraft.from_dict(data).parameter_hash
    assert driven([{"rotors": ["R1"]}], [{}, {}]).parameter_hash != driven([], [{}, {}]).parameter_hash
    belt = [driven([{"rotors": names}], [{}, {}]).parameter_hash for names in (["R1"], ["R1", "R2"])]
    assert belt[0] != belt[1]
