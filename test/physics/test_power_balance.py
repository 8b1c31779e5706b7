"""Where the power of the engines goes: every term from its own forces, and all of them together (theory.md 5.11)."""

import functools
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from aircraft_laws import instant
from balances import balance, totals
from helpers import OFFSET_BLADE, aircraft_data, build, unit
from random_options import equipped_flights

from sbs_sim import Aircraft, Case, simulate, simulate_batch, trim
from sbs_sim.analysis.power import power_shares
from sbs_sim.errors import SimulationError
from sbs_sim.flight.power_balance import power_balance
from sbs_sim.flight.trimmed_state import trimmed_state
from sbs_sim.model import state as S
from sbs_sim.model.power import POWER_TERMS, SUPPLY
from sbs_sim.model.wind import Wind

DATA = Path(__file__).resolve().parents[1] / "data"
CLOSED = 1e-9  # of the hover power
DUCT = {"exit_area": 1.0, "turning": 0.3, "lip_arm": 0.15, "lip_stall": 1.0, "ram_recovery": 0.8}
WIND = Wind(velocity=(-3.0, 2.0, 0.5), gust=(0.0, 4.0, -2.0), gust_duration=0.3)
SIGNS = np.array([1.0 if name in SUPPLY else -1.0 for name in POWER_TERMS])


def missing(found):
    """Return the largest of what is given less what is taken [W], of a flight or of rows of powers."""
    rows = found["power_balance"] if isinstance(found, dict) else found
    return float(np.abs(rows @ SIGNS).max())


OWN = {
    "air": {"interference"},
    "ducts": {"duct"},
    "tails": {"surfaces", "actuators"},
    "drives": {"kinetic_drives"},
    "wakes": {"duct", "interference"},
}
SECTIONS = {"tip_loss_model": "prandtl", "profile_drag": "oblique", "descent": "measured", "induced_power_factor": 1.1}
STALL = {"dynamic_stall": "separation"}
VORTEX = {"dynamic_stall": "leishman_beddoes"}
LATE = {"unsteady_airfoil": "jones"}
AIRCRAFT = {
    "sbs": lambda: Aircraft.load("sbs"),
    "ducts": lambda: build(every_rotor={"duct": DUCT, **LATE}),
    "air": lambda: build(options={"interference": "skewed_wake"}, every_rotor=SECTIONS | LATE | STALL),
    "vortices": lambda: build(every_rotor=SECTIONS | VORTEX),
    "shares": lambda: build(every_rotor={"duct_expansion": 0.8, "induced_power_factor": 1.15}),
    "drives": lambda: Aircraft.load(DATA / "electric.yaml"),
    "tails": lambda: Aircraft.load("uh60a_genhel"),
    "wakes": lambda: build(every_rotor={"duct": DUCT}, options={"interference": "skewed_wake"}),
}


@functools.cache
def hover_power(name):
    return float(trim(AIRCRAFT[name]()).power.sum())


def manoeuvre(aircraft, airspeed, duration=0.4, wind=WIND, **options):
    """Return a flight in wind and a gust in which one control after the other takes a step."""
    point = trim(aircraft, airspeed)
    controls = np.tile(point.controls, (round(duration / 0.01) + 1, 1))
    for k, i in enumerate(aircraft.trimmed_controls):
        low, high = aircraft.controls[i].range
        controls[4 + 4 * k :, i] += math.copysign(0.04 * (high - low), (low + high) / 2 - point.controls[i])
    return simulate(aircraft, point, controls, duration, wind=wind, outputs=["power_balance"], **options)


@pytest.mark.parametrize("name", AIRCRAFT)
def test_the_balance_closes_at_every_tick_of_a_manoeuvre(name):
    flight = manoeuvre(AIRCRAFT[name](), 10.0)
    assert missing(flight) < CLOSED * hover_power(name)
    taken = {term for term in POWER_TERMS if np.abs(flight[f"power_{term}"]).max() > 1e-6 * hover_power(name)}
    assert {"engine", "induced", "profile", "fuselage", "gravity", "kinetic_body", "kinetic_blades"} <= taken
    assert {"apparent_mass", "wind"} <= taken
    assert OWN.get(name, set()) <= taken


FIELD = Wind(velocity=(-3.0, 2.0, 0.5), turbulence_intensity=(2.0, 2.0, 1.5), turbulence_length=5.0,
             turbulence_extent="field")  # fmt: skip
ELEMENTS = replace(FIELD, turbulence_extent="elements")
FRONT = Wind(velocity=(-3.0, 2.0, 0.5), gust=(1.0, 2.0, -4.0), gust_length=4.0, wind_profile="power")
RATES = Wind(turbulence_intensity=(1.0, 1.0, 1.0), turbulence_extent="rates", turbulence_span=2.0)


@pytest.mark.parametrize(("name", "wind"), [("sbs", FIELD), ("air", FIELD), ("wakes", FRONT), ("tails", FIELD),
                                            ("drives", RATES), ("wakes", ELEMENTS)])  # fmt: skip
def test_the_balance_closes_in_air_that_is_not_the_same_everywhere(name, wind):
    """Each force with the air where it acts: blades, surfaces, fuselages, ducts."""
    flight = manoeuvre(AIRCRAFT[name](), 10.0, 0.2, wind)
    assert missing(flight) < CLOSED * hover_power(name)
    assert np.abs(flight["power_wind"]).max() > 1e-2 * hover_power(name)


@pytest.mark.parametrize("fidelity", [{"lead_lag": False}, {"cyclic_inflow": False}])
def test_the_balance_closes_without_lag_or_cyclic_inflow(fidelity):
    assert missing(manoeuvre(AIRCRAFT["sbs"](), 10.0, 0.2, **fidelity)) < CLOSED * hover_power("sbs")


OFFSETS = OFFSET_BLADE | {"lag_stop": {"range_deg": [-0.5, 0.5], "stiffness": 100.0, "damping": 0.1}}
TEETERING = {
    "blades": 2,
    "hinge_offset": 0.0,
    "flap_hinge_offset": 0.0,
    "flap_hinge": "teetering",
    "flap_rest_deg": 3.0,
}


@pytest.mark.parametrize("drives", [[], [{"rotors": ["R1"], "inertia": 0.02, "inertia_axis": [0.0, 0.6, 0.1]}]])
@pytest.mark.parametrize("kind", ["each", "teetering"])
def test_the_balance_closes_with_blades_off_their_pitch_axis(kind, drives):
    """Swept blades whose mass is beside the axis turn about it: the shaft gives what their swashplate takes."""
    rotor = OFFSETS | (TEETERING if kind == "teetering" else {})
    data = aircraft_data(options={"elements": 5}, every_rotor=rotor)
    data["rotors"][0] |= {"shaft_direction": unit(0.1, -0.2, -1.0)}
    data["rotors"][1] |= {"speed_rpm": 2100.0, "duct": DUCT}
    aircraft = Aircraft.from_dict(data | ({"drives": drives} if drives else {}))
    _, model, x, swash, psi, wind = instant(aircraft, 3)
    if kind == "teetering":  # at its precone
        for j, one in enumerate(aircraft.rotors):
            x[model.layout.flap(j).start], x[model.layout.flap_rate(j).start] = one.flap_rest, 0.0
    rows = power_balance(model.engine, *(np.array([values]) for values in (x, swash, psi, wind)))
    assert missing(rows) < 1e-11 * np.abs(rows).max()
    assert rows[0][POWER_TERMS.index("profile")] > 0.0
    if not drives:  # in a field, too
        flight = simulate(
            aircraft,
            x,
            np.zeros(len(aircraft.control_names)),
            0.02,
            wind=FIELD if kind == "each" else ELEMENTS,
            outputs=["power_balance"],
        )
        assert missing(flight) < 1e-11 * np.abs(flight["power_balance"]).max()


@pytest.mark.parametrize("effect", ["none", "measured"])
def test_the_balance_closes_in_a_touchdown(effect):
    """Skids take what stops the aircraft; near the ground the blades meet less than their own inflow."""
    aircraft = AIRCRAFT["sbs"]().with_values({"ground.contact": "contact", "ground.effect": effect})
    point = trim(aircraft)
    state = trimmed_state(aircraft, point)
    state[S.VELOCITY : S.RATES] = 1.0, 0.5, 0.8
    flight = simulate(aircraft, state, point.controls, 0.3, ground_altitude=-0.35, outputs=["power_balance"])
    assert missing(flight) < CLOSED * hover_power("sbs")
    assert flight["power_contact"].max() > 100.0
    assert (np.abs(flight["power_interference"]).max() > 50.0) == (effect == "measured")


@pytest.mark.parametrize("number", range(10))
def test_terms_of_random_aircraft_are_those_of_the_plain_model(number):
    """Every kind of key and all motions at once: profile, dampers and engines one by one, and the sum."""
    _, aircraft, _ = equipped_flights(6, number)
    _, model, x, swash, psi, wind = instant(aircraft, number)
    rows = power_balance(model.engine, *(np.array([values]) for values in (x, swash, psi, wind)))
    found, scale = dict(zip(POWER_TERMS, rows[0], strict=True)), np.abs(rows).max()
    assert missing(rows) < 1e-11 * scale
    model.derivative(x, swash, psi, wind)
    plain = balance(model, x, swash, psi, wind)
    assert found["profile"] == pytest.approx(plain.drag, abs=1e-10 * scale)
    assert found["dampers"] == pytest.approx(found["actuators"] - plain.dampers, abs=1e-10 * scale)
    assert found["engine"] - found["friction"] == pytest.approx(plain.engines, abs=1e-10 * scale)


def test_what_is_stored_is_the_change_of_the_energy():
    """Kinetic energy, that of the weight and of the springs against the plain model's energy at both ends."""
    aircraft = Aircraft.from_dict(
        dict(Aircraft.load("sbs").data) | {"drives": [{"rotors": ["MR1", "MR2"], "inertia": 0.02}]}
    )
    point = trim(AIRCRAFT["sbs"]())
    state = np.concatenate([simulate(AIRCRAFT["sbs"](), point, point.controls, 0.0)["state"][0], np.zeros(4)])
    state[aircraft.layout.drive(0)["Omega"]] = aircraft.drive_speed(0)
    flight = simulate(aircraft, state, point.controls, 0.1, tick=5e-4, outputs=["power_balance"])
    stored = sum(flight[f"power_{name}"] for name in ("gravity", "springs", "kinetic_body", "kinetic_blades"))
    stored = stored + flight["power_kinetic_drives"]
    first, last = (totals(aircraft, flight["state"][i], np.zeros(2))[2] for i in (0, -1))
    work = np.trapezoid(stored, flight["time"])
    assert abs(last - first) > 50.0  # J: the rotors run down
    assert work == pytest.approx(last - first, rel=1e-5)


@pytest.mark.parametrize("climb", [0.0, 4.0])
def test_induced_power_is_thrust_times_induced_velocity(climb):
    """Momentum theory; the induced power factor multiplies it (Leishman, section 2.8)."""
    for factor in (1.0, 1.15):
        aircraft = build(every_rotor={"induced_power_factor": factor})
        point, rotor = trim(aircraft, climb_rate=climb), aircraft.rotors[0]
        flight = simulate(aircraft, point, point.controls, 0.1, outputs=["power_balance"])
        thrust, area = point.thrust.sum() / 2, math.pi * rotor.radius**2
        induced = math.sqrt(climb**2 / 4 + thrust / (2 * aircraft.environment.air_density * area)) - climb / 2
        assert flight["power_induced"][-1] == pytest.approx(2 * factor * thrust * induced, rel=1e-3)
        weight = aircraft.body.mass * aircraft.environment.gravity
        assert flight["power_gravity"][-1] == pytest.approx(weight * climb, rel=1e-3, abs=0.1)
        drag = 0.5 * aircraft.environment.air_density * aircraft.body.flat_plate_areas[2] * climb**3
        assert flight["power_fuselage"][-1] == pytest.approx(drag, rel=1e-3, abs=1e-3)


def test_a_duct_gives_what_its_thrust_climbs_with():
    """With a fixed exit rotor and duct take m ((V + w)^2 - V^2) / 2 and no more: 1815 W for the paper's aircraft.

    Climb of 5 m/s, a_w = 1, without drag of the fuselage: T = rho A (V + v) v, theory.md section 6.2.
    """
    aircraft = build(every_rotor={"duct": {"exit_area": 1.0}}, body={"flat_plate_areas": [0.0, 0.0, 0.0]})
    point = trim(aircraft, climb_rate=5.0)
    flight = simulate(aircraft, point, point.controls, 0.05, outputs=["power_balance"])
    powers = {name: flight[f"power_{name}"][0] for name in POWER_TERMS}
    assert powers["induced"] + powers["duct"] + powers["gravity"] == pytest.approx(1815.0, rel=2e-3)
    assert powers["duct"] < 0.0


def test_the_blades_of_the_other_coupling_do_not_conserve_energy():
    paper = Aircraft.load("sbs_paper")
    with pytest.raises(SimulationError, match=r"options.coupling = 'paper': allowed is complete"):
        simulate(paper, trim(paper), trim(paper).controls, 0.01, outputs=["power_balance"])


@pytest.mark.parametrize("outputs", ["power", ["power_balance", "x"], 3])
def test_other_outputs_are_refused(outputs):
    aircraft = AIRCRAFT["sbs"]()
    with pytest.raises(SimulationError, match=r"^outputs = .*: allowed are"):
        simulate(aircraft, trim(aircraft), trim(aircraft).controls, 0.01, outputs=outputs)


def test_the_power_of_a_trim_is_that_of_its_flight():
    """Over whole revolutions; what a trim leaves out is the vibration of the body."""
    aircraft = AIRCRAFT["ducts"]()
    point = trim(aircraft, 10.0, climb_rate=2.0)
    shares = power_shares(aircraft, point)
    flight = simulate(aircraft, point, point.controls, 0.025 * 4, tick=0.025 / 12, outputs=["power_balance"])
    flown = dict(zip(POWER_TERMS, flight["power_balance"][:-1].mean(axis=0), strict=True))
    assert shares["engine"] == pytest.approx(point.power.sum(), rel=1e-9)
    for name in ("induced", "profile", "fuselage", "duct", "gravity"):
        assert shares[name] == pytest.approx(flown[name], abs=2e-3 * shares["engine"])
    assert shares["gravity"] == pytest.approx(2.0 * aircraft.body.mass * aircraft.environment.gravity, rel=1e-3)


def test_a_batch_has_the_balance_of_each_flight():
    aircraft = AIRCRAFT["sbs"]()
    point = trim(aircraft)
    found = simulate_batch([Case(aircraft, point)] * 2, 0.03, outputs=["power_balance"])
    alone = simulate(aircraft, point, point.controls, 0.03, outputs=["power_balance"])
    for flown in found["power_balance"]:
        np.testing.assert_array_equal(flown, alone["power_balance"])
