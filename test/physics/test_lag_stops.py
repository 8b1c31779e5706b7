"""Stops of the lag hinge (theory.md section 3.5); its equation is checked against the plain model in test_dynamics."""

import math

import numpy as np
import pytest
from helpers import aircraft_data, build

from sbs_sim import Aircraft, simulate, trim
from sbs_sim.errors import SimulationError
from sbs_sim.model import state as S

STOPS = {"range_deg": [-10.0, 15.0], "stiffness": 23000.0, "damping": 15.0}  # nearly the stiffest and half the damping


@pytest.fixture(scope="module")
def thrown():
    """Return an aircraft whose lag hinges have stops alone, and hover with a blade thrown at them at 60 rad/s."""
    aircraft = build(every_rotor={"lag_stop": STOPS, "lag_damping": 0.0})
    point = trim(aircraft)
    x = aircraft.layout.from_linear(point.state)
    x[aircraft.layout.lag_rate(0)] = [60.0, 0.0, 0.0]
    return aircraft, x, point.controls


@pytest.mark.parametrize("method", ["etd", "rk4", "tsit5"])
def test_the_default_step_is_stable_on_the_stiffest_stops(thrown, method):
    """A stop gives energy back, but never more than it took: no later swing goes farther than the first."""
    aircraft, x, controls = thrown
    flight = simulate(aircraft, x, controls, 0.5, method=method)
    lag = np.degrees(flight["state"][:, aircraft.layout.lag(0).start])
    assert len(lag) == 51
    assert -11.0 < lag.min() < lag.max() < 17.0
    assert np.ptp(lag[40:]) < np.ptp(lag[:11])


def test_short_steps_agree_about_how_far_a_blade_goes_into_a_stop(thrown):
    aircraft, x, controls = thrown
    deepest = []
    for step in (1.0, 0.25):
        flight = simulate(aircraft, x, controls, 0.03, tick=1e-3, azimuth_step=math.radians(step), method="rk4")
        deepest.append(np.degrees(flight["state"][:, aircraft.layout.lag(0).start]).max())
    assert deepest[0] == pytest.approx(deepest[1], abs=0.05)
    assert deepest[1] > STOPS["range_deg"][1] - 5.0


def test_a_run_up_with_a_large_torque_needs_stops():
    """Free lag hinges: the blades fall back at once, and with stops the rotors come to speed."""
    engine = {"kind": "engine", "max_torque": 60.0, "lag": 0.05, "throttle": 1.0}
    drive = {"rotors": ["R1", "R2"], "inertia": 0.05, "engine": engine}
    flights = []
    for stops in ({}, {"lag_stop": STOPS | {"stiffness": 8000.0, "damping": 5.0}}):
        data = aircraft_data(every_rotor={"lag_damping": 0.0, **stops}, body={"stand": {"free": []}})
        data["controls"] = {name: {**control, "held_deg": 2.0} for name, control in data["controls"].items()}
        aircraft = Aircraft.from_dict(data | {"drives": [drive]})
        x = np.zeros(aircraft.layout.size)
        x[S.ATTITUDE] = 1.0
        flights.append((aircraft, x))
    with pytest.raises(SimulationError, match=r"would take xi0\(1\) to"):
        simulate(*flights[0], np.zeros(4), 0.6)
    aircraft, x = flights[1]
    end = simulate(aircraft, x, np.zeros(4), 0.6)["state"][-1]
    assert end[aircraft.layout.drive(0)[S.SPEED]] > 200.0
