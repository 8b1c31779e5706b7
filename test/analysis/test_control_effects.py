"""Which way the controls move an aircraft: what the linear model says of them is what they do in flight."""

import math
from pathlib import Path

import numpy as np
import pytest
from helpers import aircraft_data

from sbs_sim import Aircraft, linearize, simulate
from sbs_sim.analysis.control_effects import control_effects
from sbs_sim.errors import LinearizationError
from sbs_sim.model.state import CONTROL_NAMES, LINEAR_BODY_NAMES

DATA = Path(__file__).resolve().parents[1] / "data"
FILES = {"sbs": "sbs", "tandem": DATA / "tandem.yaml", "tail rotor": DATA / "tail_rotor.yaml"}
STATES = {"heave": "w", "roll": "p", "pitch": "q", "yaw": "r", "surge": "u", "sway": "v"}
EXPECTED = ("heave", "roll", "pitch", "yaw")
WORDS = {
    "sbs": ["up", "rolls right", "nose down", "nose left, also rolls right"],
    "tandem": ["up", "rolls right", "nose down", "nose right"],
    "tail rotor": ["up", "rolls right", "nose down", "nose left"],
}


@pytest.mark.parametrize("name", FILES)
def test_controls_move_the_aircraft_as_it_is_said(name):
    """A step of each control from hover, in the nonlinear model, before the aircraft has gone far."""
    aircraft = Aircraft.load(FILES[name])
    model = linearize(aircraft)
    effects = model.control_effects
    assert [effect.control for effect in effects] == list(CONTROL_NAMES)
    assert [effect.axis for effect in effects] == list(EXPECTED)
    assert [effect.words for effect in effects] == WORDS[name]
    for i, effect in enumerate(effects):
        controls = model.trim.controls.copy()
        controls[i] += math.radians(0.2)
        flight = simulate(aircraft, model.trim, controls, 0.06)
        change = flight[STATES[effect.axis]][-1]
        assert math.copysign(1.0, change) == math.copysign(1.0, effect.acceleration)
        # the rotors take some time to follow, and damp what begins
        assert 0.3 < change / (effect.acceleration * math.radians(0.2) * 0.06) < 1.4


@pytest.mark.parametrize("speed", [-4.0, 12.0])
def test_they_do_so_in_forward_and_backward_flight(speed):
    for name in WORDS:
        found = linearize(Aircraft.load(FILES[name]), airspeed=speed).control_effects
        assert [effect.words.split(",")[0] for effect in found] == [words.split(",")[0] for words in WORDS[name]]


@pytest.mark.parametrize(("control", "opposite"), [(1, "rolls left"), (2, "nose up"), (3, "nose right")])
def test_the_mixing_decides(control, opposite):
    """One control of `sbs` with the other sign in the file."""
    data = aircraft_data()
    for rotor in data["rotors"]:
        for factors in rotor["mixing"].values():
            if CONTROL_NAMES[control] in factors:
                factors[CONTROL_NAMES[control]] *= -1.0
    found = linearize(Aircraft.from_dict(data)).control_effects
    assert [effect.sense for effect in found] == [-1.0 if i == control else 1.0 for i in range(4)]
    assert found[control].words.split(",")[0] == opposite


def test_a_control_that_hardly_moves_its_axis_is_named_after_what_it_moves():
    b = np.zeros((8, 4))
    places = {name: LINEAR_BODY_NAMES.index(name) for name in LINEAR_BODY_NAMES}
    b[places["w"], 0], b[places["p"], 1], b[places["q"], 2] = -90.0, 80.0, -150.0
    b[places["r"]] = 10.0, 40.0, 0.0, 0.5  # the fourth does next to nothing to yaw
    b[places["u"], 3] = 12.0  # but pushes, as a propeller does
    collective, lateral, _, fourth = control_effects(b, LINEAR_BODY_NAMES)
    assert (fourth.axis, fourth.words, fourth.acceleration, fourth.sense) == ("surge", "forward", 12.0, 1.0)
    assert (collective.axis, collective.sense) == ("heave", 1.0)
    assert lateral.words == "rolls right"
    b[:, 3] = 0.0
    fourth = control_effects(b, LINEAR_BODY_NAMES)[3]
    assert (fourth.axis, fourth.words, fourth.sense) == ("yaw", "nothing", 1.0)


def test_a_model_without_the_body_has_no_effects(sbs):
    rotors = linearize(sbs).quasi_static(["a0(1)", "da0(1)", "w"])
    with pytest.raises(LinearizationError, match="kept = u: allowed are"):
        _ = rotors.control_effects
