"""Sticks without ROS: shaping, keys, joystick files and messages, and the augmentation against its model."""

import math
from pathlib import Path

import numpy as np
import pytest
from helpers import aircraft_data

from sbs_sim import Aircraft, linearize, simulate
from sbs_sim.config_file import config_folder
from sbs_sim.errors import PilotError
from sbs_sim.flight.trimmed_state import trimmed_state
from sbs_sim.model import state as S
from sbs_sim.pilot.augmentation import FED_BACK, StickPilot, augmentation
from sbs_sim.pilot.feedback import Compensator, Plant, closed_loop
from sbs_sim.pilot.hover_hold import DELAY, FILTER_TIME, TICK
from sbs_sim.pilot.joystick import Joystick, JoystickFile
from sbs_sim.pilot.piloted_flight import simulate_with_pilot
from sbs_sim.pilot.sticks import RETURN_TIME, KeySticks, keys_of, shaped

CONFIG = (config_folder() / "joystick.yaml").read_text()
DATA = Path(__file__).resolve().parents[1] / "data"
PADS = ("gamepad", "xbox", "playstation", "transmitter")
FULL = np.radians([3.0, 2.0, 2.0, 3.0])


@pytest.fixture(scope="module")
def model(sbs):
    return linearize(sbs)


@pytest.fixture(scope="module")
def found(model):
    return augmentation(model)


@pytest.fixture
def pilot(found, model):
    made = StickPilot(found, FULL)
    made.take_over(model.trim.controls, model.trim.pitch, model.trim.roll)
    return made


# --- shaping and keys -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("expo", [0.0, 0.4, 1.0])
def test_ends_middle_and_dead_zone_of_a_stick(expo):
    assert shaped(1.0, 0.1, expo) == 1.0
    assert shaped(-1.0, 0.1, expo) == -1.0
    assert shaped(1.7, 0.1, expo) == 1.0
    assert shaped(0.1, 0.1, expo) == 0.0
    assert shaped(-0.05, 0.1, expo) == 0.0
    values = [shaped(x, 0.1, expo) for x in np.linspace(-1.0, 1.0, 201)]
    assert np.all(np.diff(values) >= 0.0)
    np.testing.assert_allclose(values, -np.array(values[::-1]), atol=1e-15)


def test_the_slope_in_the_middle_is_one_less_expo():
    for expo in (0.0, 0.3, 1.0):
        assert shaped(1e-4, 0.0, expo) / 1e-4 == pytest.approx(1.0 - expo, abs=1e-6)


def test_keys_of_a_terminal():
    assert keys_of(b"wg \x1b[A\x1bOD\x1b[Bq") == ["w", "g", " ", "up", "left", "down", "q"]
    assert keys_of(b"") == []
    assert keys_of(b"\x1b[Z\x1b[") == []


@pytest.mark.parametrize(
    ("key", "control", "sense"),
    [
        ("w", "collective", 1),
        ("s", "collective", -1),
        ("a", "differential_longitudinal_cyclic", 1),  # positive turns the nose to the left
        ("d", "differential_longitudinal_cyclic", -1),
        ("up", "longitudinal_cyclic", 1),  # a push
        ("k", "longitudinal_cyclic", -1),
        ("right", "lateral_cyclic", 1),
        ("j", "lateral_cyclic", -1),
    ],
)
def test_a_key_moves_its_stick(key, control, sense):
    keys = KeySticks()
    assert keys.press(key)
    expected = np.zeros(4)
    expected[S.CONTROL_NAMES.index(control)] = 0.1 * sense
    np.testing.assert_allclose(keys.position, expected)
    for _ in range(30):
        keys.press(key)
    assert np.abs(keys.position).max() == 1.0


def test_sticks_go_back_but_for_the_collective():
    keys = KeySticks()
    for key in "waik":
        keys.press(key)
    keys.press("l")
    keys.relax(RETURN_TIME)
    assert keys.position[0] == pytest.approx(0.1)
    assert keys.position[1] == pytest.approx(0.1 / math.e)
    keys.centre()
    np.testing.assert_array_equal(keys.position, 0.0)
    assert not keys.press("z")


# --- joystick ---------------------------------------------------------------------------------------------------


def message(pad, **sticks):
    """Axes and buttons of a pad; left and forward are positive, as joy has it, on a transmitter negative."""
    places = {"gamepad": (0, 1, 2, 3), "xbox": (0, 1, 3, 4), "playstation": (0, 1, 3, 4)}
    axes, buttons = [0.0] * 8, [0] * 15
    if pad == "transmitter":
        # channels aileron, elevator, throttle, rudder: up and right are positive, and joy changes every sign
        order = dict(zip(("roll", "push", "up", "yaw"), range(4), strict=True))
        for name, value in sticks.items():
            axes[order[name]] = -value if name != "yaw" else value
        return axes, buttons
    left_x, left_y, right_x, right_y = places[pad]
    for name, value in sticks.items():
        place = {"yaw": left_x, "up": left_y, "roll": right_x, "push": right_y}[name]
        axes[place] = -value if name == "roll" else value
    return axes, buttons


@pytest.mark.parametrize("pad", PADS)
def test_every_pad_has_the_senses_of_the_sticks(pad):
    """Up, right, a push and the nose to the left are positive."""
    joystick = Joystick(JoystickFile.load("", pad))
    for i, name in enumerate(("up", "roll", "push", "yaw")):
        sticks = joystick.read(*message(pad, **{name: 1.0})).sticks
        assert sticks.tolist() == [1.0 if j == i else 0.0 for j in range(4)], name


def test_buttons_act_once_when_they_go_down():
    joystick = Joystick(JoystickFile.load("", "gamepad"))
    axes, buttons = message("gamepad")
    assert joystick.read(axes, buttons).actions == ()
    buttons[0] = buttons[11] = 1
    reading = joystick.read(axes, buttons)
    assert reading.actions == ("augmentation",)
    assert reading.trim.tolist() == [0.0, 0.0, 1.0, 0.0]
    reading = joystick.read(axes, buttons)
    assert reading.actions == ()
    assert not reading.trim.any()


def test_a_button_that_is_held_at_the_start_does_nothing():
    joystick = Joystick(JoystickFile.load("", "gamepad"))
    axes, buttons = message("gamepad")
    buttons[0] = 1
    assert joystick.read(axes, buttons).actions == ()


def test_a_directional_pad_of_axes_trims():
    joystick = Joystick(JoystickFile.load("", "xbox"))
    axes, buttons = message("xbox")
    joystick.read(axes, buttons)
    axes[6] = -1.0  # right
    assert joystick.read(axes, buttons).trim.tolist() == [0.0, 1.0, 0.0, 0.0]
    assert not joystick.read(axes, buttons).trim.any()
    axes[6] = 1.0
    assert joystick.read(axes, buttons).trim.tolist() == [0.0, -1.0, 0.0, 0.0]


@pytest.mark.parametrize(
    ("axes", "buttons", "text"),
    [
        ([0.0, 0.0], [0] * 15, r"axes has 2 values: the pad needs axes\[2\]"),
        ([0.0] * 6, [0] * 4, r"buttons has 4 values: the pad needs buttons\["),
        ([0.0, math.nan, 0.0, 0.0], [0] * 15, r"axes\[1\] = nan: allowed are finite numbers"),
    ],
)
def test_a_message_of_another_pad_is_refused(axes, buttons, text):
    with pytest.raises(PilotError, match=text):
        Joystick(JoystickFile.load("", "gamepad")).read(axes, buttons)


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        ("expo: 0.4", "expo: 1.4", "expo = 1.4: allowed is <= 1"),
        ("expo: 0.4", "expos: 0.4", "expos: unknown key, allowed are dead_zone, expo"),
        ("timeout: 0.5", "timeout: .nan", "timeout = nan: allowed is a finite number"),
        ("dead_zone: 0.03", "dead_zone: wide", "dead_zone = 'wide': allowed is a number"),
        ("sign: 1}", "sign: 2}", "pads.gamepad.axes.collective.sign = 2: allowed is one of 1, -1"),
        ("{plus: 11, minus: 12}", "{plus: 11}", "pads.gamepad.trims.longitudinal_cyclic.minus: missing key"),
        ("{axis: 1, sign: 1}", "{axis: -1, sign: 1}", "pads.gamepad.axes.collective.axis = -1: allowed is >= 0"),
        ("pads:", "pads: [", "not readable as YAML"),
    ],
)
def test_a_wrong_file_is_one_line(tmp_path, old, new, text):
    path = tmp_path / "pad.yaml"
    path.write_text(CONFIG.replace(old, new, 1))
    with pytest.raises(PilotError) as error:
        JoystickFile.load(str(path), "gamepad")
    assert str(error.value).startswith(f"{path}: ")
    assert text in str(error.value)
    assert "\n" not in str(error.value)


def test_a_file_or_pad_that_is_not_there_is_reported(tmp_path):
    with pytest.raises(PilotError, match="there is no such file"):
        JoystickFile.load(str(tmp_path / "none.yaml"), "gamepad")
    with pytest.raises(PilotError, match=f"pad = 'steering wheel': allowed are {', '.join(PADS)}"):
        JoystickFile.load("", "steering wheel")
    assert Path(config_folder() / "joystick.schema.json").is_file()


# --- on any aircraft --------------------------------------------------------------------------------------------


def mirrored_mixing():
    """The default aircraft, every control of which but the collective has the other sign in the file."""
    data = aircraft_data()
    for rotor in data["rotors"]:
        for factors in rotor["mixing"].values():
            factors.update({name: -factor for name, factor in factors.items() if name != "collective"})
    return Aircraft.from_dict(data)


AIRCRAFT = {
    "sbs": lambda: Aircraft.load("sbs"),
    "mirrored mixing": mirrored_mixing,
    "tandem": lambda: Aircraft.load(DATA / "tandem.yaml"),  # its fourth control turns the nose right
    "tail rotor": lambda: Aircraft.load(DATA / "tail_rotor.yaml"),
}
KEYS_AND_MOTIONS = (  # what a key promises: velocity down, rates to the right, up, right
    *(("w", "w", -1), ("s", "w", 1), ("right", "p", 1), ("j", "p", -1)),
    *(("up", "q", -1), ("k", "q", 1), ("a", "r", -1), ("d", "r", 1)),
)


@pytest.mark.parametrize("name", AIRCRAFT)
def test_keys_sticks_and_trims_do_what_they_say_on_any_aircraft(name):
    """In flight: up, right, nose down, nose left, whatever the signs of its mixing."""
    aircraft = AIRCRAFT[name]()
    model = linearize(aircraft)
    pilot = StickPilot(augmentation(model), FULL)
    pilot.augmented = False
    body = trimmed_state(aircraft, model.trim)
    for key, motion, sense in KEYS_AND_MOTIONS:
        pilot.take_over(model.trim.controls, model.trim.pitch, model.trim.roll)
        keys = KeySticks()
        keys.press(key)
        pilot.sticks = keys.position
        by_stick = pilot.controls(0.0, body)
        assert sense * simulate(aircraft, model.trim, by_stick, 0.06)[motion][-1] > 0.0, key
        pilot.sticks = np.zeros(4)
        pilot.move_trim(FULL * keys.position)  # a press of a trim button moves the trim the same way
        np.testing.assert_allclose(pilot.controls(0.0, body), by_stick)


def test_augmentation_damps_every_aircraft():
    """Its own gains have the signs of the aircraft: yaw rates of the tandem are held as those of others."""
    for make in AIRCRAFT.values():
        aircraft = make()
        model = linearize(aircraft)
        pilot = StickPilot(augmentation(model), FULL)
        pilot.take_over(model.trim.controls, model.trim.pitch, model.trim.roll)
        start = trimmed_state(aircraft, model.trim)
        start[S.RATES + 2] = 0.2
        free = simulate(aircraft, start, model.trim.controls, 0.5)["r"][-1]
        assert simulate_with_pilot(aircraft, start, pilot.controls, 0.5, delay=DELAY)["r"][-1] < free - 0.01


# --- augmentation -----------------------------------------------------------------------------------------------


def test_the_augmented_hover_is_stable_with_all_states(found):
    assert np.all(found.poles.real < 0.0)
    assert all(margin.disk > 0.5 for margin in found.margins)


def test_without_augmentation_the_controls_are_trim_and_sticks(pilot, model):
    pilot.augmented = False
    pilot.sticks = np.array([0.5, -0.5, 1.0, 0.0])
    body = trimmed_state_with_rates()
    np.testing.assert_allclose(pilot.controls(0.0, body), model.trim.controls + FULL * [0.5, -0.5, 1.0, 0.0])


def trimmed_state_with_rates():
    return np.array([0.0, 0.0, 0.0, 1.0, *[0.0] * 6, 0.3, -0.2, 0.1])


def test_it_damps_every_rate(pilot):
    """Signs of Controls.msg: against a roll to the right goes left cyclic, against nose up a push, nose right left."""
    for rate, control, sense in ((10, 1, -1), (11, 2, 1), (12, 3, 1)):
        body = np.array([0.0, 0.0, 0.0, 1.0, *[0.0] * 9])
        body[rate] = 0.3
        pilot.take_over(np.zeros(4), 0.0, 0.0)
        assert sense * pilot.controls(0.0, body)[control] > 0.0


def test_a_disturbed_flight_decays_as_the_linear_model_says(sbs, model, found, pilot):
    """From a roll rate, in the nonlinear model beside the 38 states sampled."""
    start = trimmed_state(sbs, model.trim)
    start[S.RATES] = 0.02
    flight = simulate_with_pilot(sbs, start, pilot.controls, 3.0, delay=DELAY)
    places = [model.state_names.index(name) for name in FED_BACK]
    new = -math.expm1(-TICK / FILTER_TIME)
    onto = (1.0 - new) * np.eye(4) - new * found.lag_gains
    feedback = Compensator(onto, -new * found.gains, onto, -new * found.gains)
    matrix = closed_loop(Plant(model.a, model.b, np.eye(38)[places]), feedback, TICK, DELAY)
    x = np.zeros(len(matrix))
    x[model.state_names.index("p")] = 0.02
    expected = [x]
    for _ in flight["time"][1:]:
        expected.append(matrix @ expected[-1])
    rolls = np.array(expected)[:, model.state_names.index("phi")]
    np.testing.assert_allclose(2.0 * flight["qx"], rolls, atol=0.03 * np.abs(rolls).max())
    assert abs(flight["p"][-1]) < 0.1 * 0.02


def test_without_it_the_same_flight_grows(sbs, model, pilot):
    start = trimmed_state(sbs, model.trim)
    start[S.RATES] = 0.02
    pilot.augmented = False
    flight = simulate_with_pilot(sbs, start, pilot.controls, 8.0)
    roll = np.abs(flight["qx"])
    assert roll[600:].max() > 2.0 * roll[100:300].max()


def test_a_state_that_is_not_finite_is_refused(pilot):
    with pytest.raises(PilotError, match=r"allowed are -1e.09 to 1e.09"):
        pilot.controls(0.0, np.full(13, math.nan))
