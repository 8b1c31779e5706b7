"""The cockpit: what it draws, in numbers; the page in a real browser with a real simulator behind it."""

import contextlib
import dataclasses
import gzip
import http.client
import io
import itertools
import json
import math
import os
import re
import socket
import subprocess
import sys
import time
from pathlib import Path

import browser
import msgspec
import numpy as np
import pytest
import viser
from hypothesis import given
from hypothesis import strategies as st
from markup import HOSTILE, Elements
from matplotlib.text import Text
from PIL import Image
from ros_harness import DOMAINS, EXECUTABLES, PATIENCE, environment, world
from std_srvs.srv import SetBool
from viser.transforms import SO3
from websockets.datastructures import Headers
from websockets.exceptions import InvalidStatus
from websockets.http11 import Request
from websockets.sync.client import connect
from websockets.typing import Subprotocol

from sbs_msgs.msg import BodyState, FlightEvent, LinearModel, Mode, SimulationStatus
from sbs_msgs.srv import Reset
from sbs_sim import Aircraft, linearize, simulate, trim
from sbs_sim.cockpit import geometry
from sbs_sim.cockpit.access import refusal
from sbs_sim.cockpit.air_panel import FOLDER, NO_GUST, OWN_SIGMA, AirPanel
from sbs_sim.cockpit.charts import PERIOD, WINDOW, ChartHistory, axis_range, body_charts, rotor_charts
from sbs_sim.cockpit.fly_panel import DOUBLET_LENGTH, DOUBLET_OF, DOUBLET_SIZE, KEYS, LIGHT_TURBULENCE, FlyPanel
from sbs_sim.cockpit.poles import BODY_POLE_RADIUS, Pole, pole_figure, pole_page
from sbs_sim.cockpit.readouts import Status, condition_here, readout, source_line
from sbs_sim.cockpit.recorded_snapshots import RecordedSnapshots, list_logs
from sbs_sim.cockpit.scene import COLOURS, Scene, Shown, colour_of
from sbs_sim.cockpit.trim_report import TrimResult, condition_words, model_page, trim_page, unsteady
from sbs_sim.cockpit.view import LiveFlight, View
from sbs_sim.cockpit.viewpoint import CAMERAS, Viewpoint
from sbs_sim.errors import RecordingError, SimulationError
from sbs_sim.flight.gust_standards import specified_turbulence
from sbs_sim.flight.simulation import Simulation
from sbs_sim.flight.trim_point import TrimCondition
from sbs_sim.flight.trimmed_state import trimmed_state
from sbs_sim.model import state as S
from sbs_sim.model.frames import euler_to_quaternion, quaternion_to_euler
from sbs_sim.model.multiblade import blade_matrix
from sbs_sim.model.wind import Wind
from sbs_sim.nodes.cockpit_node import serve
from sbs_sim.nodes.conversions import StateMessages, snapshot_of
from sbs_sim.nodes.qos import LATCHED_QOS
from sbs_sim.recording import read

ROOT = Path(__file__).resolve().parents[2]
HOVER_STEP = ROOT / "bags" / "hover_step.mcap"
AIRCRAFT = Aircraft.load("sbs")
ROTORS = pytest.mark.parametrize("rotor", AIRCRAFT.rotors, ids=lambda rotor: rotor.name)
ANGLES = st.floats(-0.3, 0.3)
SERVED = []  # the server behind `served`


def snapshot_of_flight(airspeed=10.0, wind=(0.0, 0.0, 0.0), heading=0.0, **condition):
    point = trim(AIRCRAFT, airspeed=airspeed, **condition)
    state = trimmed_state(AIRCRAFT, point, (3.0, -4.0, -25.0), heading, wind)
    simulation = Simulation(AIRCRAFT, state, point.swashplate)
    return simulation.snapshot(), point


def craft(name):
    return AIRCRAFT if name == "sbs" else Aircraft.load(ROOT / "test" / "data" / f"{name}.yaml")


def scaled(aircraft, size):
    """Aircraft that is so many times as large, of the same material."""
    rotors = [dataclasses.replace(rotor, hub=size * rotor.hub, radius=size * rotor.radius) for rotor in aircraft.rotors]
    body = dataclasses.replace(aircraft.body, mass=size**3 * aircraft.body.mass)
    return dataclasses.replace(aircraft, body=body, rotors=tuple(rotors))


def tip(rotor, azimuth, flap=0.0, lag=0.0):
    hinges, axes = geometry.blade_poses(rotor, np.array([azimuth]), np.array([flap]), np.array([lag]))
    return hinges[0] + rotor.blade_length * axes[0, :, 0]


# --- blades -----------------------------------------------------------------------------------------------------


@ROTORS
def test_a_blade_at_azimuth_0_points_aft_and_reaches_the_radius(rotor):
    np.testing.assert_allclose(tip(rotor, 0.0), rotor.hub + [-rotor.radius, 0.0, 0.0], atol=1e-12)


@ROTORS
def test_the_inner_blades_retreat(rotor):
    # paper, Figure 1: both rotors' advancing blades, azimuth 90 deg, are the outer ones, and move forward there
    advancing = tip(rotor, math.pi / 2)
    assert abs(advancing[1]) == pytest.approx(abs(rotor.hub[1]) + rotor.radius)
    assert (tip(rotor, math.pi / 2 + 1e-3) - advancing)[0] > 0.0


@ROTORS
@given(azimuth=st.floats(0.0, 6.28), flap=st.floats(0.01, 0.3), lag=st.floats(0.01, 0.3))
def test_flap_is_up_and_lag_against_the_motion(rotor, azimuth, flap, lag):
    rest, motion = tip(rotor, azimuth), tip(rotor, azimuth + 1e-4) - tip(rotor, azimuth)
    assert (tip(rotor, azimuth, flap=flap) - rest)[2] == pytest.approx(-rotor.blade_length * math.sin(flap))
    assert (tip(rotor, azimuth, lag=lag) - rest) @ motion < 0.0


@ROTORS
@given(azimuth=st.floats(0.0, 6.28), flap=ANGLES, lag=ANGLES)
def test_the_axes_of_a_blade_are_a_rotation(rotor, azimuth, flap, lag):
    _, axes = geometry.blade_poses(rotor, np.array([azimuth]), np.array([flap]), np.array([lag]))
    np.testing.assert_allclose(axes[0] @ axes[0].T, np.eye(3), atol=1e-12)
    assert np.linalg.det(axes[0]) == pytest.approx(1.0)


@ROTORS
@given(turn=st.integers(0, 59), coordinates=st.tuples(ANGLES, ANGLES, ANGLES))
def test_the_tips_go_along_the_tip_path(rotor, turn, coordinates):
    path = geometry.tip_path(rotor, np.array(coordinates), 2.0, 60)
    azimuth = 2 * math.pi * turn / 60
    flap = blade_matrix(rotor.blades, azimuth) @ np.array(coordinates)
    for k, own in enumerate(geometry.blade_azimuths(rotor, azimuth)):
        np.testing.assert_allclose(path[(turn + 20 * k) % 60], tip(rotor, own, flap=2.0 * flap[k]), atol=1e-12)


def test_a_disc_that_is_tilted_back_is_high_in_front():
    path = geometry.tip_path(AIRCRAFT.rotors[0], np.array([0.0, math.radians(3.0), 0.0]), 1.0, 60)
    foremost, aftmost = path[path[:, 0].argmax()], path[path[:, 0].argmin()]
    assert foremost[2] < aftmost[2]  # z is down


def test_inflow_over_the_disc():
    # Inflow.msg: lambdac > 0 is more inflow aft (azimuth 0), lambdas > 0 more on the advancing side (pi / 2)
    rotor = AIRCRAFT.rotors[0]
    radius, azimuth = np.full(3, 0.5), np.array([0.0, math.pi / 2, math.pi])
    found = geometry.inflow_velocity(rotor, np.array([0.05, 0.02, 0.01]), radius, azimuth)
    np.testing.assert_allclose(found, 2400 * math.pi / 30 * 0.505 * np.array([0.055, 0.06, 0.045]))


def test_colours_of_values_end_with_those_of_the_ends():
    colours = colour_of(np.array([-1.0, 0.0, 5.0, 10.0, 99.0]), (0.0, 10.0))
    np.testing.assert_array_equal(colours, COLOURS[[0, 0, 4, 8, 8]])


# --- numbers ----------------------------------------------------------------------------------------------------


def test_the_pilot_controls_come_back_from_the_swashplates():
    controls = np.radians([8.0, 1.0, -2.0, 0.5])
    np.testing.assert_allclose(AIRCRAFT.unmix(AIRCRAFT.mix(controls)), controls, atol=1e-14)


@pytest.mark.parametrize("wind", [(0.0, 0.0, 0.0), (4.0, -3.0, 0.5)])
@pytest.mark.parametrize(
    "condition",
    [
        {"airspeed": 15.0},
        {"airspeed": 12.0, "climb_rate": 1.5, "sideslip": 0.2},
        {"airspeed": 10.0, "turn_rate": 0.3},
        {"airspeed": -5.0, "sideslip": 0.1},
        {"airspeed": 0.0, "climb_rate": 1.0},
    ],
    ids=str,
)
def test_the_condition_here_is_the_one_that_was_trimmed(condition, wind):
    snapshot, _ = snapshot_of_flight(wind=wind, heading=2.0, **condition)
    here = condition_here(dataclasses.replace(snapshot, wind=np.array(wind)))
    for name in ("airspeed", "climb_rate", "sideslip", "turn_rate"):
        assert getattr(here, name) == pytest.approx(condition.get(name, 0.0), abs=0.006), name


def test_the_readout_says_what_the_state_says():
    snapshot, point = snapshot_of_flight(airspeed=10.0, heading=math.radians(30.0))
    text = readout(AIRCRAFT, snapshot, Status(True, 0.98, 3, "blade lost", "bags/x.mcap"), "sbs")
    for part in ("25.00", "10.00", "30.0", "0.98 × real time", "missed deadlines 3", "blade lost", "recording x.mcap"):
        assert part in text
    assert point.thrust.sum() == pytest.approx(20.62 * 9.80665, rel=0.05)


def test_the_readout_says_where_the_model_does_not_hold():
    snapshot, _ = snapshot_of_flight()
    status = Status(warnings=("rotor 1 <vortex ring>", "rotor 2 stalled"), model="stitched")
    assert "(stitched model)" in readout(AIRCRAFT, snapshot, status, "sbs")
    assert " model)" not in readout(AIRCRAFT, snapshot, Status(), "sbs")
    text = readout(AIRCRAFT, snapshot, status, "sbs")
    assert "outside the model&#x27;s validity: rotor 1 &lt;vortex ring&gt;" in text
    assert "rotor 2 stalled" in text
    assert "validity" not in readout(AIRCRAFT, snapshot, Status(), "sbs")


def test_the_history_keeps_instants_apart_and_begins_anew_after_a_jump_back():
    snapshot, _ = snapshot_of_flight()
    history = ChartHistory((*body_charts(AIRCRAFT), *rotor_charts(AIRCRAFT)))
    assert len(history.table()) == 0
    for k in range(100):
        history.add(dataclasses.replace(snapshot, time=0.01 * k))
    times = history.table()[:, 0]
    assert np.diff(times[:-1]).min() >= 0.999 * PERIOD
    assert times[-1] == 0.99  # the newest is there in any case: single steps are seen
    history.add(dataclasses.replace(snapshot, time=0.2))
    assert set(history.table()[:, 0]) == {0.2}


@pytest.mark.parametrize("period", [0.01, 0.066, 0.5])
def test_the_history_is_as_long_however_often_it_is_drawn(period):
    snapshot, _ = snapshot_of_flight()
    history = ChartHistory(body_charts(AIRCRAFT))
    for k in range(int(50.0 / period)):
        history.add(dataclasses.replace(snapshot, time=period * k))
    times = history.table()[:, 0]
    assert WINDOW - PERIOD - period <= times[-1] - times[0] <= WINDOW
    assert history.beginning == 0.0


@given(low=st.floats(-1e6, 1e6), span=st.floats(0.0, 1e6), least=st.sampled_from([1e-3, 0.1, 0.5, 1.0, 50.0]))
def test_an_axis_has_numbers_at_both_ends_and_holds_the_curves(low, span, least):
    high = low + span
    bottom, top = axis_range(low, high, least)
    unseen = 1e-8 * (top - bottom)
    assert bottom <= low + unseen
    assert high <= top + unseen
    assert least <= (top - bottom) * (1 + 1e-9)
    # the page numbers every step of 1, 2 or 5 times a power of ten for which there is room: those of the ends are there
    step = min(
        (top - bottom) / count for count in (1, 2, 3) if re.fullmatch(r"[125]\.0+e.*", f"{(top - bottom) / count:.6e}")
    )
    for end in (bottom, top):
        assert end / step == pytest.approx(round(end / step), abs=1e-6)


def test_rounding_does_not_fill_an_axis():
    bottom, top = axis_range(1e5, 1e5 * (1 + 1e-12), 1.0)
    assert 100.0 <= top - bottom <= 300.0
    assert axis_range(-1.9, 1.9, 1.0) == (-2.0, 2.0)
    assert axis_range(0.0, 4.2, 1.0) == (0.0, 6.0)


def test_a_reset_of_a_paused_flight_is_seen():
    snapshot, _ = snapshot_of_flight()
    history = ChartHistory(body_charts(AIRCRAFT))
    history.add(snapshot)
    moved = snapshot.state.copy()
    moved[S.POSITION + 2] = -99.0
    history.add(dataclasses.replace(snapshot, state=moved))
    assert history.table()[-1, -1] == 99.0


def test_charts_have_a_name_for_every_value():
    snapshot, point = snapshot_of_flight()
    for chart in (*body_charts(AIRCRAFT), *rotor_charts(AIRCRAFT)):
        assert len(chart.values(snapshot)) == len(chart.names), chart.title
    controls = next(chart for chart in body_charts(AIRCRAFT) if chart.title == "Controls")
    np.testing.assert_allclose(controls.values(snapshot), np.degrees(point.controls), atol=1e-9)


def test_the_pole_page_names_the_modes_and_shows_their_numbers():
    # a phugoid that doubles in ln 2 / 0.1 = 6.93 s and a roll subsidence that halves in 0.231 s
    page = pole_page([Pole("phugoid", complex(0.1, 0.5)), Pole("roll & co", complex(-3.0, 0.0))], "hover")
    for part in ("phugoid", "roll &amp; co", "-0.20", "6.93", "0.231", "[rad/s]", "hover"):
        assert part in page


@pytest.mark.parametrize(("name", "airspeed"), [("sbs", 0.0), ("sbs", 15.0), ("tandem", 5.0), ("tail_rotor", 8.0)])
def test_no_name_of_a_pole_lies_on_another(name, airspeed):
    model = linearize(craft(name), airspeed=airspeed)
    figure = pole_figure([Pole(mode.name, mode.pole) for mode in model.modes])
    figure.canvas.draw()
    shown = set()
    for axes in figure.axes:
        boxes = [(text.get_text(), Text.get_window_extent(text)) for text in axes.texts]
        for (one, box), (other, further) in itertools.combinations(boxes, 2):
            assert not box.overlaps(further), (one, other)
        for text, box in boxes:
            assert axes.bbox.x0 <= box.x0 < box.x1 <= axes.bbox.x1, text
        shown |= {line for text, _ in boxes for line in text.split("\n")}
    assert {f"{i} {mode.name}" for i, mode in enumerate(model.modes, 1) if abs(mode.pole) <= BODY_POLE_RADIUS} <= shown


def test_a_long_name_leaves_the_map_its_room():
    axes = pole_figure([Pole("x" * 200, complex(-1.0, 1.0)), Pole("roll", complex(-3.0, 0.0))]).axes[0]
    assert axes.bbox.width > 0.7 * axes.figure.bbox.width


def test_a_trim_is_shown_beside_a_flight_that_is_in_it_without_a_word_more():
    snapshot, point = snapshot_of_flight(airspeed=12.0, turn_rate=0.3)
    here = condition_here(snapshot)
    trimmed = TrimResult(here, point.controls, point.pitch, point.roll, point.thrust.sum(), point.power.sum(), ())
    assert unsteady(trimmed, snapshot) == []
    page = Elements(trim_page(trimmed, snapshot, AIRCRAFT)).text
    assert "Trim at 12 m/s, turn 17.2 deg/s" in page
    collective = f"{math.degrees(point.controls[0]):.2f}"
    assert f"collective{collective}{collective}deg" in page


def test_a_trim_says_where_the_flight_is_not_in_it():
    snapshot, point = snapshot_of_flight(airspeed=0.0)
    state = snapshot.state.copy()
    state[S.ATTITUDE : S.VELOCITY] = euler_to_quaternion(0.0, math.radians(50.0), 0.0)
    state[S.RATES] = math.radians(10.0)
    tilted = dataclasses.replace(snapshot, state=state)
    trimmed = TrimResult(TrimCondition(), point.controls, point.pitch, point.roll, 0.0, 0.0, ("stalled",))
    reported = "The flight is not in this trim: pitch 50.0 deg instead of 0.0, p 10.0 deg/s instead of 0.0."
    for page in (trim_page(trimmed, tilted, AIRCRAFT), model_page(trimmed, tilted)):
        assert reported in page
        assert "stalled" in page


def test_a_hover_is_at_no_airspeed_less_than_nothing():
    snapshot, _ = snapshot_of_flight(airspeed=0.0)
    state = snapshot.state.copy()
    state[S.VELOCITY : S.RATES] = -1e-9
    assert "-0" not in condition_words(condition_here(dataclasses.replace(snapshot, state=state)))


# --- the first minute -------------------------------------------------------------------------------------------


def pitch_of(flight):
    """Pitch over the time of a flight [deg]."""
    attitude = np.stack([flight[name] for name in ("qw", "qx", "qy", "qz")], axis=1)
    return np.degrees([quaternion_to_euler(quaternion)[1] for quaternion in attitude])


def first(flight, happened):
    """Time at which something has happened [s]; infinite if it has not."""
    return float(flight["time"][np.argmax(happened)]) if happened.any() else math.inf


def test_hands_off_in_still_air_a_hover_stays_and_a_cruise_does_not():
    """README and the guide. How long it stays goes with the logarithm of rounding, 0.38 1/s: 67 s here."""
    hover = trim(AIRCRAFT)
    flight = simulate(AIRCRAFT, hover, hover.controls, duration=45.0)
    away = np.linalg.norm([flight[name] for name in ("north", "east", "down")], axis=0)
    assert away.max() < 0.01
    cruise = trim(AIRCRAFT, airspeed=15.0)
    flight = simulate(AIRCRAFT, cruise, cruise.controls, duration=4.0)
    away = np.linalg.norm([flight["north"] - 15.0 * flight["time"], flight["east"], flight["down"]], axis=0)
    assert first(flight, away > 0.01) < 3.0


def test_a_doublet_shows_within_seconds_that_the_hover_is_unstable():
    hover = trim(AIRCRAFT)

    def controls(time):
        change = np.sign(DOUBLET_LENGTH - time) if time < 2 * DOUBLET_LENGTH else 0.0
        return hover.controls + change * DOUBLET_SIZE * np.eye(4)[DOUBLET_OF]

    flight = simulate(AIRCRAFT, hover, controls, duration=6.5)
    pitch = pitch_of(flight)
    assert -4.0 < pitch[flight["time"] < 1.0].min() < -2.0
    assert 5.0 < first(flight, abs(pitch) > 10.0) < 6.0


def test_light_turbulence_shows_it_too():
    hover = trim(AIRCRAFT)
    wind = Wind(turbulence_intensity=(LIGHT_TURBULENCE,) * 3, turbulence_seed=1)
    flight = simulate(AIRCRAFT, hover, hover.controls, duration=8.0, wind=wind)
    assert 2.0 < first(flight, abs(pitch_of(flight)) > 10.0) < 8.0


# --- messages and logs ------------------------------------------------------------------------------------------


def test_a_snapshot_comes_back_from_its_messages():
    snapshot, _ = snapshot_of_flight()
    made = StateMessages(AIRCRAFT)
    made.fill(snapshot)
    again = snapshot_of(AIRCRAFT, made.state, made.rotors, made.inflow, snapshot.swashplate, snapshot.wind)
    for name in ("time", "state", "acceleration", "azimuth", "loads", "swashplate", "wind"):
        np.testing.assert_array_equal(getattr(again, name), getattr(snapshot, name), err_msg=name)


def test_messages_of_another_aircraft_are_refused():
    snapshot, _ = snapshot_of_flight()
    made = StateMessages(AIRCRAFT)
    made.fill(snapshot)
    tandem = Aircraft.load(ROOT / "test" / "data" / "tail_rotor.yaml")
    with pytest.raises(SimulationError, match="blades"):
        snapshot_of(tandem, made.state, made.rotors, made.inflow, snapshot.swashplate, snapshot.wind)


SPOILT = {
    "a NaN": lambda made: setattr(made.state.velocity, "x", math.nan),
    "an attitude of 0": lambda made: setattr(made.state.attitude, "w", 0.0),
    "another number of lag angles": lambda made: setattr(made.rotors.rotors[0], "lag", [0.0]),
    "an infinite inflow": lambda made: setattr(made.inflow.rotors[1], "uniform", math.inf),
}


@pytest.mark.parametrize("spoil", SPOILT.values(), ids=SPOILT)
def test_messages_that_no_flight_has_are_refused(spoil):
    snapshot, _ = snapshot_of_flight(airspeed=0.0)
    made = StateMessages(AIRCRAFT)
    made.fill(snapshot)
    made.state.attitude.x = made.state.attitude.y = made.state.attitude.z = 0.0
    snapshot_of(AIRCRAFT, made.state, made.rotors, made.inflow, snapshot.swashplate, snapshot.wind)
    spoil(made)
    with pytest.raises(SimulationError, match="the flight has"):
        snapshot_of(AIRCRAFT, made.state, made.rotors, made.inflow, snapshot.swashplate, snapshot.wind)


def test_a_recording_gives_what_was_recorded():
    log, recording = read(HOVER_STEP), RecordedSnapshots(HOVER_STEP)
    state, rotors = log["state"], log["rotors"]
    for i in (0, 57, len(state.time) - 1):
        found = recording.at(state.time[i] + 0.004)  # of the 10 ms until the next one
        assert found.time == pytest.approx(state.time[i])
        assert -found.state[S.POSITION + 2] == -state["position.z"][i]
        assert found.state[S.RATES] == state["angular_velocity.x"][i]
        assert found.azimuth[1] == rotors["rotors[1].azimuth"][i]
        assert found.loads[0, 0] == rotors["rotors[0].thrust"][i]
    assert recording.at(-5.0).time == recording.beginning
    assert recording.at(1e9).time == recording.end


def test_a_recording_knows_the_controls_of_every_time():
    # tools/make_hover_step.py: each control is raised by 0.5 deg for 0.3 s, one every 0.8 s from 0.5 s on
    recording = RecordedSnapshots(HOVER_STEP)
    rest = AIRCRAFT.unmix(recording.at(0.3).swashplate)
    for i in range(4):
        step = AIRCRAFT.unmix(recording.at(0.5 + 0.8 * i + 0.2).swashplate) - rest
        np.testing.assert_allclose(np.degrees(step), 0.5 * np.eye(4)[i], atol=1e-6)


def test_what_is_no_log_is_reported_in_one_line(tmp_path):
    (tmp_path / "a.mcap").write_bytes(b"nothing")
    assert [path.name for path in list_logs(tmp_path)] == ["a.mcap"]
    assert list_logs(tmp_path / "nowhere") == []
    with pytest.raises(RecordingError, match=r"a\.mcap"):
        RecordedSnapshots(tmp_path / "a.mcap")


def test_euler_angles_of_the_charts():
    snapshot, _ = snapshot_of_flight()
    state = snapshot.state.copy()
    state[S.ATTITUDE : S.VELOCITY] = euler_to_quaternion(math.radians(30), math.radians(20), math.radians(-10))
    attitude = body_charts(AIRCRAFT)[0]
    assert attitude.names == ("roll", "pitch", "yaw")
    np.testing.assert_allclose(attitude.values(dataclasses.replace(snapshot, state=state)), [-10, 20, 30], atol=1e-9)


# --- the executable ---------------------------------------------------------------------------------------------


def free_port():
    with socket.create_server(("127.0.0.1", 0)) as taken:
        return taken.getsockname()[1]


def end_of_cockpit(*arguments, domain=0):
    """Exit code and error lines of a cockpit that cannot start."""
    command = [sys.executable, str(EXECUTABLES / "cockpit"), *arguments]
    ended = subprocess.run(
        command, env=environment(domain), capture_output=True, text=True, timeout=PATIENCE, check=False
    )
    return ended.returncode, ended.stderr.strip().splitlines()


@pytest.mark.parametrize(
    ("arguments", "reported"),
    [
        (["--port", "0"], "--port 0: allowed are 1 to 65535"),
        (["--port", "70000"], "--port 70000: allowed are 1 to 65535"),
        (["--port", "x"], "--port: invalid int value: 'x'"),
        (["--host", ""], "--host is empty"),
        (["--fly"], "--fly"),
        (["--logs"], "--logs: expected one argument"),
        (
            ["--attach", "--ros-args", "-p", "airspeed:=9.0"],
            "-p: parameters go to a simulator that the cockpit starts: not allowed with",
        ),
        (
            ["--logs", ".", "--foxglove"],
            "--foxglove: parameters go to a simulator that the cockpit starts: not allowed",
        ),
    ],
)
def test_a_wrong_command_line_is_reported(arguments, reported):
    code, lines = end_of_cockpit(*arguments)
    assert code == 2
    assert reported in lines[-1]


def test_a_port_that_is_taken_is_reported_in_one_line():
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        code, lines = end_of_cockpit("--port", str(port), domain=next(DOMAINS))
    assert code == 1
    assert len(lines) == 1
    assert f"127.0.0.1:{port}" in lines[0]
    assert "--port" in lines[0]


def test_a_host_that_is_not_this_machine_is_reported_in_one_line():
    code, lines = end_of_cockpit("--host", "192.0.2.1", domain=next(DOMAINS))  # RFC 5737: nobody has it
    assert code == 1
    assert len(lines) == 1
    assert "192.0.2.1" in lines[0]


def test_a_folder_that_is_not_there_is_reported_in_one_line(tmp_path):
    code, lines = end_of_cockpit("--logs", str(tmp_path / "none"), "--port", str(free_port()), domain=next(DOMAINS))
    assert (code, lines) == (1, [f"--logs {tmp_path / 'none'}: allowed is a folder with logs"])


def test_the_page_says_what_it_shows():
    assert "LIVE" in source_line("", True)
    assert "NO SIMULATOR" in source_line("", False)
    for flying, text in ((True, "a live flight continues"), (False, "no simulator")):
        line = source_line("a<b.mcap", flying)
        assert "LOG" in line
        assert f"a&lt;b.mcap, {text}" in line


def test_a_wrong_parameter_of_the_simulator_ends_the_cockpit_with_its_line():
    arguments = ("--port", str(free_port()), "--ros-args", "-p", "aircraft:=nonesuch")
    code, lines = end_of_cockpit(*arguments, domain=next(DOMAINS))
    assert code == 1
    assert any("nonesuch" in line for line in lines)


# --- who may fly ------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def served():
    """Address of a page that is served on this machine."""
    made = serve("127.0.0.1", free_port())
    SERVED[:] = [made]
    try:
        yield f"127.0.0.1:{made.get_port()}"
    finally:
        made.stop()


def greeted(place, **headers):
    """Status with which a WebSocket is answered; its headers are those of viser's page but for those given."""
    subprotocol = Subprotocol(f"viser-v{viser.__version__}")
    options = {"additional_headers": headers, "subprotocols": [subprotocol], "proxy": None, "open_timeout": PATIENCE}
    try:
        with connect(f"ws://{place}", **options) as client:
            client.recv(timeout=PATIENCE)  # what the page shows
            return 101
    except InvalidStatus as refused:
        return refused.response.status_code


@pytest.mark.parametrize(
    "origin",
    ["http://evil.example", "http://127.0.0.1:1", "http://localhost", "null", "http://{}.evil.example", "http://[{}"],
)
def test_pages_of_others_cannot_fly(served, origin):
    assert greeted(served, Origin=origin.format(served)) == 403


def test_the_page_itself_and_programs_can(served):
    assert greeted(served, Origin=f"http://{served}") == 101
    assert greeted(served) == 101  # no browser: those always tell


def test_the_page_has_a_title_and_an_icon_of_its_own(served):
    for encoding in ("identity", "gzip"):
        connection = http.client.HTTPConnection(served, timeout=PATIENCE)
        connection.request("GET", "/", headers={"Accept-Encoding": encoding})
        answer = connection.getresponse()
        body = answer.read()
        assert int(answer.headers["Content-Length"]) == len(body)
        page = (gzip.decompress(body) if encoding == "gzip" else body).decode()
        assert page.count("<title>") == page.count("<title>sbs_sim cockpit</title>") == 1
        assert page.count('rel="icon"') == 1
        assert "viser" not in page[: page.index("</title>")].lower().replace("viser client", "")


@pytest.fixture
def server(served):
    """The server of that page."""
    shown = SERVED[0]
    yield shown
    shown.scene.reset()


@pytest.mark.parametrize("name", ["sbs", "tail_rotor", "tandem"])
@pytest.mark.parametrize("size", [0.1, 1.0, 7.0])
def test_any_aircraft_fills_the_picture_and_its_arrows_go_with_it(server, name, size):
    """Seven times the helicopter has rotors of 3.6 m."""
    aircraft = scaled(craft(name), size)
    scene, viewpoint = Scene(server, aircraft, Shown()), Viewpoint(server)
    viewpoint.use(scene.scale)
    distance = np.linalg.norm(server.initial_camera.position)
    assert 1.5 < distance / geometry.size(aircraft) < 3.0  # in all the view is 75 deg high
    thrust = aircraft.body.mass * aircraft.environment.gravity / len(aircraft.rotors)
    assert 0.2 < thrust / scene.newtons_per_metre / geometry.size(aircraft) < 0.6
    assert 0.5 <= scene.cell / geometry.size(aircraft) * 3.0 <= 20.0
    viewpoint.use(1.0)


CAMERA = {
    "type": "ViewerCameraMessage",
    "wxyz": (1.0, 0.0, 0.0, 0.0),
    "position": (-2.0, 1.2, 1.0),
    "look_at": (0.2, 0.0, 0.1),
    "up_direction": (0.0, 0.0, 1.0),
    "fov": 1.3,
    "near": 0.01,
    "far": 1e3,
}


@contextlib.contextmanager
def looking(width, height):
    """A viewpoint, and a client that looked from somewhere before there was one."""
    server = serve("127.0.0.1", free_port())
    options = {"subprotocols": [Subprotocol(f"viser-v{viser.__version__}")], "proxy": None}
    try:
        with connect(f"ws://127.0.0.1:{server.get_port()}", **options) as client:
            client.send(msgspec.msgpack.encode({**CAMERA, "image_width": width, "image_height": height}))
            end = time.monotonic() + PATIENCE
            while not server.get_clients() and time.monotonic() < end:
                time.sleep(0.01)
            yield Viewpoint(server), next(iter(server.get_clients().values()))
    finally:
        server.stop()


def test_who_looks_keeps_the_view_of_an_aircraft_of_another_size():
    with looking(1280, 800) as (viewpoint, client):
        position, look_at = client.camera.position.copy(), client.camera.look_at.copy()
        viewpoint.use(4.0)
        np.testing.assert_allclose(client.camera.position, 4.0 * position)
        np.testing.assert_allclose(client.camera.look_at, 4.0 * look_at)
        viewpoint.use(1.0)
        np.testing.assert_allclose(client.camera.position, position)


@pytest.mark.parametrize(("width", "factor"), [(1280, 1.0), (720, 1.0), (400, 1.8)])
def test_a_narrow_picture_is_taken_from_further_away(width, factor):
    with looking(width, 800) as (viewpoint, client):
        viewpoint.set_camera(client, "left")
        np.testing.assert_allclose(client.camera.position, factor * np.array(CAMERAS["left"]), rtol=1e-6)
        np.testing.assert_allclose(client.camera.look_at, 0.0, atol=1e-12)


@pytest.mark.parametrize(
    ("ground", "shown", "reported"),
    [
        (None, (True, False), ["height of the origin: lines 1 m and 10 m apart"]),
        (0.0, (False, True), ["ground, at the origin's height: lines 1 m and 10 m apart"]),
        (
            -100.0,
            (True, True),
            [
                "height of the origin: lines 1 m and 10 m apart",
                "ground, 100 m below the origin: lines 10 m and 100 m apart",
            ],
        ),
    ],
)
def test_the_ground_is_drawn_where_it_is(server, ground, shown, reported):
    scene = Scene(server, AIRCRAFT, Shown())
    scene.set_ground(ground)
    level, plane = (server.scene.get_handle_by_name(f"/ned/earth/{name}") for name in ("level", "ground"))
    assert (level.visible, plane.visible) == shown
    assert plane.plane_opacity == 1.0
    assert level.plane_opacity == 0.0  # one sees, and flies, through it
    if ground is not None:
        assert plane.position[2] == -ground
    assert scene.lines == reported


def test_sloping_ground_is_drawn_as_it_rises(server):
    """To the east: what is drawn upon the plane at 10 m east is higher by 10 tan(slope), and so ends the plumb line."""
    aircraft = AIRCRAFT.with_values({"ground.slope_deg": 20.0, "ground.slope_heading_deg": 90.0})
    scene = Scene(server, aircraft, Shown())
    scene.set_ground(-5.0)
    plane = server.scene.get_handle_by_name("/ned/earth/ground")
    turned = SO3(np.array(plane.wxyz)).as_matrix()
    slope = math.radians(20.0)
    np.testing.assert_allclose(turned[:, 2], [0.0, -math.sin(slope), -math.cos(slope)], atol=1e-12)  # its upper side
    snapshot, _ = snapshot_of_flight()
    scene.draw(snapshot)
    line = server.scene.get_handle_by_name("/ned/height")
    _, east, down = snapshot.state[:3]
    assert line.points[0][1][2] == pytest.approx(-down + 5.0 - east * math.tan(slope), rel=1e-6)


@pytest.mark.parametrize(("name", "ducts"), [("sbs", 2), ("tail_rotor", 0), ("tandem", 0)])
def test_ducts_are_drawn_where_there_are_some(server, name, ducts):
    def drawn(aircraft):
        scene = Scene(server, aircraft, Shown())
        names = [f"/ned/body/rotor{j}/duct" for j in range(len(aircraft.rotors))]
        found = sum(server.scene.get_handle_by_name(one) is not None for one in names)
        scene.remove()
        return found

    assert drawn(craft(name)) == ducts
    assert drawn(craft(name).with_value("rotors.duct_expansion", 0.7)) == 2


def test_an_aircraft_after_another_is_drawn_under_names_of_its_own(tmp_path):
    """A node that is made again under its name keeps its pose in browsers: a hover was tilted like the log before."""
    server = serve("127.0.0.1", free_port())
    try:
        view = View(server, Commanded(), lambda: None, tmp_path)
        for i, name in enumerate(("sbs", "tandem", "sbs"), 1):
            view.show_flight(LiveFlight(craft(name), (), -100.0, 1.0))
            roots = [j for j in range(5) if server.scene.get_handle_by_name(f"/ned{j}/body") is not None]
            assert roots == [i]
    finally:
        server.stop()


def test_the_plumb_line_ends_at_the_ground(server):
    snapshot, _ = snapshot_of_flight()  # 25 m above the origin
    scene = Scene(server, AIRCRAFT, Shown())
    line = server.scene.get_handle_by_name("/ned/height")
    for ground, length in ((None, 25.0), (-100.0, 125.0), (10.0, 15.0)):
        scene.set_ground(ground)
        scene.draw(snapshot)
        np.testing.assert_allclose(line.points[0], [[0.0, 0.0, 0.0], [0.0, 0.0, length]])


@pytest.mark.parametrize(
    ("host", "status"),
    [
        ("127.0.0.1:8080", 200),
        ("localhost:8080", 200),  # a tunnel
        ("[::1]:8080", 200),
        ("192.168.1.7:8080", 200),
        ("evil.example:8080", 403),  # a name that leads here: DNS rebinding
        ("127.0.0.1.evil.example", 403),
        ("[:", 403),
        ("", 403),
    ],
)
def test_the_page_is_there_for_names_of_this_machine_alone(served, host, status):
    connection = http.client.HTTPConnection(served, timeout=PATIENCE)
    connection.request("GET", "/", headers={"Host": host})
    answer = connection.getresponse()
    assert answer.status == status
    if status == 200:
        assert answer.headers["Content-Security-Policy"] == "frame-ancestors 'self'"


def test_a_name_that_was_asked_for_is_one_of_this_machine():
    def asked(name, host):
        return refusal(Request("/", Headers({"Host": name})), host)

    assert not asked("cockpit.example:8080", "cockpit.example")
    assert asked("other.example:8080", "cockpit.example")
    assert not asked(f"{socket.gethostname()}:8080", "0.0.0.0")


def test_the_wind_that_blows_is_shown_but_where_somebody_sets_another():
    """What was asked for comes back late from a busy simulator, and must not undo what has been chosen since."""
    server = viser.ViserServer(host="127.0.0.1", port=free_port(), verbose=False)
    try:
        panel = AirPanel(server, ask=lambda: None, refuse=lambda text: None)
        chosen = {"turbulence_model": "dryden", "turbulence_extent": "field", "wind_profile": "power"}
        panel.show(np.array([3.0, 0.0, 0.0]), 0.5, chosen)
        asked = panel.fields()
        assert asked["velocity"] == (3.0, 0.0, 0.0)
        assert asked["turbulence_intensity"] == (0.5, 0.5, 0.5)
        assert {name: asked[name] for name in chosen} == chosen
        panel.set_turbulence(0.0)  # as a button does, before the wind comes that was asked for
        panel.show(np.array([4.0, 0.0, 0.0]), 0.5, chosen | {"wind_profile": "uniform"})
        asked = panel.fields()
        assert asked["turbulence_intensity"] == (0.0, 0.0, 0.0)
        assert asked["velocity"] == (4.0, 0.0, 0.0)
        assert asked["wind_profile"] == "uniform"
        panel.show(np.zeros(3), 0.5, chosen)  # the choice was asked for: the next wind is shown again
        assert panel.fields()["turbulence_intensity"] == (0.5, 0.5, 0.5)
    finally:
        server.stop()


def test_a_gust_from_a_file_begins_when_the_panel_says():
    """It does with and without a shape beside it, and no field is shown that acts on nothing."""
    server = viser.ViserServer(host="127.0.0.1", port=free_port(), verbose=False)
    refused = []
    try:
        panel = AirPanel(server, ask=lambda: None, refuse=refused.append)
        numbers = {one.label: one for one in vars(panel).values() if hasattr(one, "label")}
        begin, length = numbers["Begins after [s or m]"], numbers["Length [s or m]"]
        assert (begin.visible, length.visible) == (False, False)
        begin.value = 4.0
        assert not {"gust_delay", "gust_distance"} & panel.fields().keys()
        for head, name in (("time [s]", "gust_delay"), ("distance [m]", "gust_distance")):
            panel.take_file("own.csv", f"{head},north [m/s],east [m/s],down [m/s]\n0,0,0,0\n1,1,2,3\n".encode())
            assert panel.fields()[name] == 4.0
            assert (begin.visible, length.visible) == (True, False)
        numbers["Shape"].value = "1-cosine over time"
        assert panel.fields() | {"gust_delay": 4.0, "gust_distance": 4.0} == panel.fields()
        assert length.visible
        assert not refused
        assert (numbers["Turbulence, σ [m/s]"].visible, numbers["At height [m]"].visible) == (True, False)
        numbers["Intensity"].value = "MIL-F-8785C, light"
        assert (numbers["Turbulence, σ [m/s]"].visible, numbers["At height [m]"].visible) == (False, True)
    finally:
        server.stop()


# --- in a browser -----------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def flying(tmp_path_factory):
    """World with a cockpit that has started its own simulator; its process and its address."""
    with world(next(DOMAINS), tmp_path_factory.mktemp("cockpit")) as made:
        (made.folder / "bags").mkdir()
        (made.folder / "bags" / "hover_step.mcap").write_bytes(HOVER_STEP.read_bytes())
        port = free_port()
        process = made.start("cockpit", arguments=["--port", str(port)])
        made.client.watch("state", BodyState)
        made.client.watch("status", SimulationStatus)
        made.client.watch("events", FlightEvent, latched=True)
        address = f"http://127.0.0.1:{port}"
        made.client.until(lambda: f"cockpit: {address}" in process.output or not process.running, "the address")
        assert process.running, process.output
        yield made, process, address


@pytest.fixture(scope="module")
def page(flying):
    if reason := browser.missing():
        if os.environ.get("CI"):
            pytest.fail(reason)
        pytest.skip(reason)
    with browser.page(flying[2], scale=0.25) as opened:  # few points: software draws them
        yield opened


def button(page, name):
    return page.get_by_role("button", name=name, exact=True)


def test_the_flight_waits_paused_for_its_pilot(flying):
    made, _, _ = flying
    # Not by a state: the few of the start may have been published before this client was known.
    start = made.client.until(lambda: made.client.messages["events"], "the start")[0]
    assert start.kind == FlightEvent.START
    assert -start.state[2] == pytest.approx(10.0, abs=0.1)
    paused = made.client.next("status", lambda status: status.state == SimulationStatus.PAUSED)
    made.client.spin(0.5)
    assert made.client.next("status").steps == paused.steps


def test_a_second_simulator_is_refused_and_a_second_cockpit_can_join(flying):
    made, _, _ = flying
    code, lines = end_of_cockpit("--port", str(free_port()), domain=made.domain)
    assert code == 1
    assert "--attach" in lines[-1]
    joined = made.start("cockpit", arguments=["--attach", "--port", str(free_port())])
    made.client.until(lambda: "cockpit: http" in joined.output or not joined.running, "the second address")
    assert joined.interrupt() == 0, joined.output


class Commanded:
    """A pilot of a page that keeps its commands."""

    def __init__(self):
        self.controls = None

    def command(self, controls):
        self.controls = controls


@pytest.mark.parametrize("file", ["sbs", ROOT / "test/data/tandem.yaml", ROOT / "test/data/tail_rotor.yaml"])
def test_keys_of_the_page_do_what_they_say_on_any_aircraft(file):
    """And the hints of the sliders tell what more of a control does, which is the other way on the tandem."""
    aircraft = Aircraft.load(file)
    model = linearize(aircraft)
    server, pilot = serve("127.0.0.1", free_port()), Commanded()
    try:
        panel = FlyPanel(server, pilot, lambda: None, lambda: None)
        panel.use(aircraft, model.control_effects)
        promised = {"Y": ("w", -1), "H": ("w", 1), "L": ("p", 1), "J": ("p", -1)}
        promised |= {"I": ("q", -1), "K": ("q", 1), "U": ("r", -1), "O": ("r", 1)}
        assert sorted(promised) == sorted(key for keys in KEYS for key, _ in keys)
        for key, (motion, sense) in promised.items():
            panel.use(aircraft, model.control_effects)  # lets go
            assert pilot.controls is None
            panel.update(model.trim.swashplate, True, True)  # sliders where the flight has its controls
            panel.press(key)
            change = pilot.controls - model.trim.controls
            moved = simulate(aircraft, model.trim, model.trim.controls + 3.0 * change, 0.06)[motion][-1]
            assert sense * moved > 0.0, key
        hints = [slider.hint for slider in panel.sliders]
        said = [effect.words for effect in model.control_effects]
        assert hints == [
            f"an increase, in hover: {words}. Keys {less}, {more}"
            for words, ((less, _), (more, _)) in zip(said, KEYS, strict=True)
        ]
        panel.use(aircraft, ())
        assert all("unknown" in slider.hint for slider in panel.sliders)
    finally:
        server.stop()


def test_it_listens_on_this_machine_alone(flying):
    _, _, address = flying
    port = int(address.rpartition(":")[2])
    listening = [line.split()[1] for line in Path("/proc/net/tcp").read_text().splitlines()[1:] if " 0A " in line]
    assert [place for place in listening if int(place.split(":")[1], 16) == port] == [f"0100007F:{port:04X}"]


def test_the_page_draws_the_aircraft(page):
    canvas = page.locator("canvas").first
    picture = Image.open(io.BytesIO(canvas.screenshot())).convert("RGB")
    middle = np.asarray(picture).astype(int)[:, picture.width // 4 : 3 * picture.width // 4]
    assert len(np.unique(middle.reshape(-1, 3), axis=0)) > 200
    # the first blades are the only thing that is orange
    red, green, blue = middle[..., 0], middle[..., 1], middle[..., 2]
    assert ((red > 150) & (green > 60) & (green < 0.85 * red) & (blue < 0.5 * red)).sum() > 20
    # What follows looks at words alone, and drawing in software takes the cores on which the flight waits.
    page.set_viewport_size({"width": 1024, "height": 480})


def reset(made, page):
    button(page, "Reset").click()
    made.client.next("events", lambda event: event.kind == FlightEvent.RESET)


def test_a_slider_moves_the_aircraft_and_reset_brings_it_back(flying, page):
    made, _, _ = flying
    button(page, "Play").click()
    made.client.next("state")
    slider = page.get_by_role("slider").first  # collective
    slider.focus()
    for _ in range(30):
        slider.press("ArrowRight")
    climbing = made.client.next("state", lambda state: -state.position.z > 10.5)
    assert climbing.velocity.z < 0.0
    reset(made, page)
    made.client.next("state", lambda state: abs(-state.position.z - 10.0) < 0.1 and abs(state.velocity.z) < 0.1)


def test_keys_fly(flying, page):
    made, _, _ = flying
    page.locator("body").press("l")
    pushed = made.client.next("events", lambda event: event.kind == FlightEvent.SWASHPLATE)
    made.client.next("events", lambda event: event.swashplate[1] > math.radians(0.05))
    assert len(pushed.swashplate) == 6
    reset(made, page)


def pick(page, label, option):
    page.get_by_label(label).click()
    page.get_by_role("option", name=option, exact=True).click()


CLICKS = {
    "a tab": lambda page: page.get_by_role("tab", name="Rotors").click(),
    "another tab": lambda page: page.get_by_role("tab", name="Body").click(),
    "a button": lambda page: button(page, "Reset").click(),
    "a list": lambda page: pick(page, "Real time", "0.5"),
    "the list again": lambda page: pick(page, "Real time", "1"),
    "a box": lambda page: page.get_by_label("Hold").click(),
    "the box again": lambda page: page.get_by_label("Hold").click(),
}


SHOWN = {SimulationStatus.PLAYING: "Pause", SimulationStatus.PAUSED: "Play"}


def test_space_pauses_and_goes_on_whatever_was_clicked_last(flying, page):
    made, _, _ = flying
    state = made.client.next("status").state
    for what, click in CLICKS.items():
        click(page)
        button(page, SHOWN[state]).wait_for()
        page.wait_for_timeout(100)
        page.keyboard.press("Space")
        state = SimulationStatus.PLAYING + SimulationStatus.PAUSED - state
        made.client.until(lambda state=state: made.client.messages["status"][-1].state == state, f"space after {what}")
    if state == SimulationStatus.PLAYING:
        page.keyboard.press("Space")
    made.client.next("status", lambda status: status.state == SimulationStatus.PAUSED)


def test_keys_typed_into_a_box_are_its_own_until_return(flying, page):
    made, _, _ = flying
    collective = page.get_by_role("slider").first
    box = collective.locator("xpath=following::input[not(@type='hidden')][1]")
    box.fill("8.6")
    box.press("Space")
    made.client.spin(0.3)
    assert made.client.next("status").state == SimulationStatus.PAUSED
    box.press("Enter")
    page.keyboard.press("Space")
    made.client.next("status", lambda status: status.state == SimulationStatus.PLAYING)
    reset(made, page)


def longitudinal_moves(events):
    """Longitudinal cyclic where it arrives [deg], and when [s], one after the other."""
    found = []
    for event in events:
        if event.kind == FlightEvent.SWASHPLATE:
            cyclic = math.degrees(AIRCRAFT.unmix(np.reshape(event.swashplate, (2, 3)))[2])
            level = round(2 * cyclic) / 2
            if abs(cyclic - level) < 0.01 and (not found or found[-1][0] != level):
                found.append((level, event.header.stamp.sec + 1e-9 * event.header.stamp.nanosec))
    return found


def test_a_doublet_goes_there_and_back_and_the_controls_are_as_before(flying, page):
    """A quarter of a second to either side; a busy machine, which reads states late, may try again."""
    made, _, _ = flying
    events = made.client.messages["events"]
    pick(page, "Real time", "0.25")
    if button(page, "Play").count():
        button(page, "Play").click()
    for tries in range(5):
        seen = len(events)
        button(page, "Doublet").click()
        made.client.until(
            lambda seen=seen: [level for level, _ in longitudinal_moves(events[seen:])][-3:] == [0.5, -0.5, 0.0],
            "the doublet",
        )
        lengths = np.diff([time for _, time in longitudinal_moves(events[seen:])[-3:]])
        if np.allclose(lengths, 0.25, atol=0.1) or tries == 4:
            break
        reset(made, page)
    np.testing.assert_allclose(lengths, 0.25, atol=0.1)
    pick(page, "Real time", "1")
    made.client.next("state", lambda state: abs(state.angular_velocity.y) > math.radians(1.0))
    reset(made, page)


def test_a_button_makes_the_air_turbulent_and_calm_again(flying, page):
    made, _, _ = flying
    for name, intensity in (("Turbulence", 0.3), ("Calm", 0.0)):
        button(page, name).click()
        wind = made.client.next("events", lambda event: event.kind == FlightEvent.WIND).wind
        assert wind.turbulence_intensity.x == wind.turbulence_intensity.z == pytest.approx(intensity)
    button(page, "Turbulence").wait_for(timeout=1e3 * PATIENCE)


def enter(page, label, value):
    """Type a number until the page keeps it: it may be drawing the field anew."""
    field = page.get_by_label(label)
    for _ in range(20):
        field.fill(value)
        field.press("Tab")
        page.wait_for_timeout(200)
        if field.input_value() == value:
            return
    raise AssertionError(f"{label}: {field.input_value()}")


def unfold(page, folder):
    """Open a folder and wait until it is: a list opened while its folder still unfolds stays hidden (Mantine)."""
    page.get_by_text(folder, exact=True).click()
    page.wait_for_timeout(50)
    page.wait_for_function("!document.querySelector('[style*=\"will-change: height\"]')")


def test_the_page_sets_what_moving_air_can_do(flying, page):
    """Kinds of turbulence, that of a specification, a gust over distance, and an own gust from a file."""
    made, _, _ = flying
    unfold(page, FOLDER)
    for label, option in (("Extent", "field"), ("Spectrum", "von_karman"), ("Profile", "power"),
                          ("Intensity", "MIL-F-8785C, light")):  # fmt: skip
        pick(page, label, option)
    unfold(page, "Gust")
    pick(page, "Shape", "ramp over distance")
    for label, value in (("Gust down [m/s]", "2"), ("Length [s or m]", "7")):
        enter(page, label, value)
    upload = page.locator("input[type=file]")
    upload.set_input_files({"name": "bad.csv", "mimeType": "text/csv", "buffer": b"no gust"})
    page.get_by_text("the first line is 'no gust'").first.wait_for(timeout=1e3 * PATIENCE)
    table = b"time [s],north [m/s],east [m/s],down [m/s]\n0,0,0,0\n1,1,2,3\n"
    upload.set_input_files({"name": "gust.csv", "mimeType": "text/csv", "buffer": table})
    page.get_by_text("own gust: 2 rows over time").wait_for(timeout=1e3 * PATIENCE)
    button(page, "Set wind").click()
    wind = made.client.next("events", lambda event: event.kind == FlightEvent.WIND).wind
    given = wind.turbulence_extent, wind.turbulence_model, wind.wind_profile, wind.gust_shape
    assert given == ("field", "von_karman", "power", "ramp")
    assert (wind.gust.z, wind.gust_length, wind.gust_duration) == (2.0, 7.0, 0.0)
    specified = specified_turbulence(30.0, "light", model="von_karman")
    assert wind.turbulence_length == specified["turbulence_length"]
    assert wind.turbulence_intensity.z == specified["turbulence_intensity"][2]
    assert [(point.position, point.velocity.z) for point in wind.own_gust] == [(0.0, 0.0), (1.0, 3.0)]
    for label, option in (("Extent", "point"), ("Spectrum", "dryden"), ("Profile", "uniform"),
                          ("Intensity", OWN_SIGMA), ("Shape", NO_GUST)):  # fmt: skip
        pick(page, label, option)
    button(page, "Remove the file").click()
    button(page, "Set wind").click()
    calm = made.client.next("events", lambda event: event.kind == FlightEvent.WIND).wind
    assert calm.turbulence_extent == "point"
    assert not any((calm.gust.z, calm.turbulence_intensity.z, len(calm.own_gust)))
    page.get_by_text(FOLDER).click()


def test_charts_cover_twenty_seconds(page):
    page.get_by_text("over simulation time").first.wait_for(timeout=1e3 * PATIENCE)
    spans = page.evaluate(
        "Object.values(window.__viserTestpoints.uplots).map(({chart: {scales: {x}}}) => x.max - x.min)"
    )
    assert len(spans) >= len(body_charts(AIRCRAFT))  # those of tabs that were seen
    np.testing.assert_allclose(spans, 20.0, atol=1e-3)


def test_on_a_phone_the_picture_is_above_the_panel(page):
    before = page.viewport_size
    page.set_viewport_size({"width": 390, "height": 844})
    sheet = page.locator('div[style*="max-height: 60%"]')
    sheet.wait_for(timeout=1e3 * PATIENCE)
    page.wait_for_timeout(500)
    picture, panel = page.locator("canvas[data-engine]").bounding_box(), sheet.bounding_box()
    assert picture["height"] > 250
    assert picture["y"] + picture["height"] <= panel["y"] + 1
    assert (panel["x"], panel["width"]) == (0, 390)
    assert sheet.locator(".mantine-ScrollArea-viewport").evaluate("(part) => part.scrollWidth") <= 390
    assert button(page, "Doublet").is_visible()
    page.set_viewport_size(before)
    page.get_by_role("tab", name="Modes").wait_for(timeout=1e3 * PATIENCE)


def test_a_button_ends_the_log_and_begins_another(flying, page):
    made, _, _ = flying
    first = made.client.next("status", lambda status: status.log).log
    button(page, "End recording").click()
    made.client.next("status", lambda status: not status.log)
    assert read(first).complete
    button(page, "Record").click()
    second = made.client.next("status", lambda status: status.log).log
    assert second != first
    button(page, "End recording").wait_for(timeout=1e3 * PATIENCE)


def test_linearize_here_shows_the_modes(flying, page):
    """From the hover that the flight began with: hands off it wanders, in time to where there is no trim.

    The page may have a state of before the reset for an instant: once more then.
    """
    from playwright.sync_api import TimeoutError as TooLate

    made, _, _ = flying
    for _ in range(4):
        reset(made, page)
        page.wait_for_timeout(500)
        button(page, "Linearize here").click()
        page.get_by_role("tab", name="Modes").click()
        with contextlib.suppress(TooLate):
            page.get_by_text("phugoid").first.wait_for(timeout=5e2 * PATIENCE)
            break
    else:
        raise AssertionError("no modes of a hover were shown")
    page.get_by_role("tab", name="Body").click()


def choose(page, source, text):
    """Pick a source and wait for what it shows; a click on a list that is being drawn again is lost: once more then."""
    from playwright.sync_api import TimeoutError as TooLate

    for _ in range(4):
        page.get_by_label("Source").click()
        with contextlib.suppress(TooLate):
            page.get_by_role("option", name=source).click(timeout=1e4)
            page.get_by_text(text).first.wait_for(timeout=5e2 * PATIENCE)
            return
    raise AssertionError(f"{source} was picked in vain")


def test_a_log_is_replayed_in_the_same_view(page):
    page.get_by_role("tab", name="Logs").click()
    choose(page, "hover_step.mcap", "hover_step.mcap paused")  # at its end after four seconds
    times = page.get_by_role("row", name="time").first.inner_text().split()
    assert float(times[1]) == pytest.approx(RecordedSnapshots(HOVER_STEP).end, abs=0.02)


def test_in_the_view_of_a_log_keys_move_the_log_and_not_the_hidden_flight(flying, page):
    made, _, _ = flying
    assert made.client.call(Reset, "reset").success  # nobody holds it: it may have ended, which pauses it
    made.client.call(SetBool, "pause", data=False)
    made.client.spin(0.5)
    before, state = len(made.client.messages["events"]), made.client.next("status").state
    page.keyboard.press("y")
    page.get_by_text("Not flown").wait_for(timeout=1e3 * PATIENCE)
    page.keyboard.press("b")
    playing = page.get_by_text("hover_step.mcap playing")
    for _ in range(5):  # a page that is drawn slowly may miss the four seconds of the log
        page.keyboard.press("Space")  # from the beginning, for it is at its end
        end = time.monotonic() + 5.0
        while not playing.count() and time.monotonic() < end:
            page.wait_for_timeout(50)
        if playing.count():
            break
    assert playing.count()
    page.keyboard.press("Shift+R")
    page.keyboard.press("n")
    page.get_by_text("hover_step.mcap paused").wait_for(timeout=1e3 * PATIENCE)
    page.get_by_role("tab", name="Fly").click()
    page.get_by_text("the live flight cannot be controlled").wait_for(timeout=1e3 * PATIENCE)
    assert page.get_by_role("slider").count() == 0
    made.client.spin(0.5)
    assert len(made.client.messages["events"]) == before
    assert made.client.next("status").state == state

    button(page, "Show the live flight").click()
    page.get_by_text("LIVE", exact=True).first.wait_for(timeout=1e3 * PATIENCE)
    page.get_by_role("slider").first.wait_for(timeout=1e3 * PATIENCE)

    def steered():
        page.keyboard.press("y")  # without an effect while the page waits for messages of a slow simulator
        made.client.spin(0.5)
        return any(event.kind == FlightEvent.SWASHPLATE for event in made.client.messages["events"][before:])

    made.client.until(steered, "a key that moves the controls")
    page.get_by_role("tab", name="Logs").click()
    choose(page, "hover_step.mcap", "hover_step.mcap paused")


def test_a_log_that_is_none_is_refused_and_the_view_stays(flying, page):
    made, _, _ = flying
    (made.folder / "bags" / "broken.mcap").write_bytes(b"nothing")
    button(page, "Refresh the list").click()
    choose(page, "broken.mcap", "Log refused")
    assert page.get_by_text("hover_step.mcap paused").count() == 1


def hostile_aircraft(folder):
    """File of the helicopter under a name that would be markup."""
    text = (ROOT / "config" / "aircraft" / "sbs.yaml").read_text()
    path = folder / "hostile.yaml"
    path.write_text(text.replace("name: sbs\n", f"name: {json.dumps(HOSTILE)}\n"))
    return path


# The last one with the page, which it takes to another cockpit: two that draw at once would starve each other.
def test_logs_are_shown_without_a_simulator_and_a_live_flight_when_there_is_one(tmp_path, page):
    logs = tmp_path / "mine"
    logs.mkdir()
    (logs / "hover_step.mcap").write_bytes(HOVER_STEP.read_bytes())
    with world(next(DOMAINS), tmp_path) as made:
        port = free_port()
        cockpit = made.start("cockpit", arguments=["--logs", str(logs), "--port", str(port)])
        made.client.until(lambda: "cockpit: http" in cockpit.output or not cockpit.running, "the address")
        page.goto(f"http://127.0.0.1:{port}")

        def shown(text):
            page.get_by_text(text).first.wait_for(timeout=1e3 * PATIENCE)

        shown("NO SIMULATOR")
        shown("No simulator is running")
        page.get_by_role("tab", name="Logs").click()
        choose(page, "hover_step.mcap", "hover_step.mcap, no simulator")
        shown("hover_step.mcap paused")  # at its end
        path = logs / f"{HOSTILE.replace('/', '|')}.mcap"
        simulator = made.start("simulator", aircraft=hostile_aircraft(tmp_path), record=f"'{path}'")
        shown("hover_step.mcap, a live flight continues")
        choose(page, "live", "LIVE")
        shown(f"{HOSTILE} playing")
        simulator.interrupt()
        shown("NO SIMULATOR")

        # texts of others are no markup: of the log's file, of the aircraft in it, of the message of whoever publishes
        button(page, "Refresh the list").click()
        choose(page, path.name, f"{path.name} paused")
        shown(f"{HOSTILE}, ")
        (logs / f"broken {path.name}").write_bytes(b"nothing")
        button(page, "Refresh the list").click()
        choose(page, f"broken {path.name}", "Log refused")
        model = LinearModel(method=HOSTILE)
        model.modes = [Mode(name=HOSTILE, real=-0.1, imag=0.5)]
        made.client.node.create_publisher(LinearModel, "linear_model", LATCHED_QOS).publish(model)
        page.get_by_role("tab", name="Modes").click()
        shown(f"Linear model at 0 m/s, {HOSTILE}")
        assert page.locator("xss-mark, #xss, a[href*=xss], code, strong, em").count() == 0
        assert cockpit.interrupt() == 0, cockpit.output


def test_its_end_is_the_simulators_end(flying):
    made, process, _ = flying
    children = Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split()
    assert children
    assert process.interrupt() == 0, process.output
    deadline = time.monotonic() + PATIENCE
    while any(Path(f"/proc/{child}").exists() for child in children) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not any(Path(f"/proc/{child}").exists() for child in children)
    logs = list((made.folder / "bags").glob("*_sbs*.mcap"))
    assert logs
    assert all(read(log).complete for log in logs)
