"""A few hundred malformed and extreme inputs for every fuzz target; `tools/robustness/fuzz.py` has thousands."""

import contextlib
import datetime
import math
import sys
from pathlib import Path

import fuzz_targets
import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

from sbs_sim import Aircraft, Simulation, linearize, simulate, sweep, trim
from sbs_sim.analysis.batch import Case, simulate_batch
from sbs_sim.analysis.monte_carlo import gust_cases
from sbs_sim.errors import AircraftError, RecordingError, SbsError
from sbs_sim.model.wind import Wind
from sbs_sim.pilot.joystick import JoystickFile
from sbs_sim.pilot.piloted_flight import simulate_with_pilot
from sbs_sim.recording import LogWriter, qos_profiles, read
from sbs_sim.recording.plot import plot
from sbs_sim.recording.recorded_flight import flight_of

INPUTS = 15  # per target and unit of its share
# The same ones each time, and no search for a smaller one: the first that fails says enough, and chance is the tool's.
FEW = settings(
    derandomize=True,
    database=None,
    deadline=None,
    phases=[Phase.generate],
    suppress_health_check=list(HealthCheck),
)


@pytest.mark.parametrize("target", fuzz_targets.FUZZ_TARGETS, ids=lambda target: target.name)
def test_invalid_input_is_taken_or_refused_in_good_order(target):
    push(target)


def push(target):
    settings(FEW, max_examples=max(5, round(INPUTS * target.share)))(given(target.inputs)(target.check))()


# --- what was found -------------------------------------------------------------------------------------------------


def refusal(function, *arguments, **options):
    with pytest.raises(SbsError) as caught:
        function(*arguments, **options)
    assert "\n" not in str(caught.value)
    return str(caught.value)


AN_AIRCRAFT = "allowed are objects of the class Aircraft"
AN_AIRCRAFT_OF_A_NAME = f"aircraft = 'sbs': {AN_AIRCRAFT}"
WRONG_TYPES = {
    "name for an aircraft": (lambda ac: trim("sbs"), AN_AIRCRAFT_OF_A_NAME),
    "of linearize": (lambda ac: linearize("sbs"), f"aircraft = 'sbs': {AN_AIRCRAFT}"),
    "of sweep": (lambda ac: sweep(None, "airspeed", [0.0]), f"aircraft = None: {AN_AIRCRAFT}"),
    "of simulate": (lambda ac: simulate(1, None, [0.0] * 4, 0.1), f"aircraft = 1: {AN_AIRCRAFT}"),
    "of Simulation": (lambda ac: Simulation([], [], []), f"aircraft = []: {AN_AIRCRAFT}"),
    "number for a file": (lambda ac: Aircraft.load(3), "aircraft = 3: allowed are paths"),
    "text for a number": (lambda ac: trim(ac, "15"), "airspeed = '15': allowed are -100 to 100 m/s"),
    "truth for a number": (lambda ac: trim(ac, True), "airspeed = True: allowed are -100 to 100 m/s"),
    "list for a number": (lambda ac: trim(ac, [1.0]), "airspeed = [1.0]: allowed are -100 to 100 m/s"),
    "nothing for a number": (lambda ac: trim(ac, 0.0, None), "climb_rate = None: allowed are -50 to 50 m/s"),
    "word for a flag": (lambda ac: trim(ac, lead_lag="no"), "lead_lag = 'no': allowed are True and False"),
    "number for a method": (lambda ac: trim(ac, method=1), "method = 1: allowed are newton, two_loop"),
    "array for a method": (
        lambda ac: linearize(ac, method=np.zeros(2)),
        "method = array([0., 0.]): allowed are averaged, paper",
    ),
    "text for a step": (lambda ac: linearize(ac, step_scale="1"), "step_scale = '1': allowed are 0.001 to 10"),
    "number for a point": (lambda ac: linearize(ac, point=1), "point = 1: allowed are objects of the class TrimPoint"),
    "texts for values": (lambda ac: sweep(ac, "airspeed", ["1"]), "values = ['1']: allowed are numbers"),
    "number for a parameter": (lambda ac: sweep(ac, 1, [1.0]), "parameter = 1: allowed are objects of the class str"),
    "text for a wind": (lambda ac: Wind(velocity="abc"), "velocity.x = 'a': allowed are -100 to 100 m/s"),
    "number for a wind": (lambda ac: Wind(gust=3), "gust = 3: allowed are 3 values, north, east, down [m/s]"),
    "text for a flight of a batch": (
        lambda ac: simulate_batch(["sbs"], 0.1),
        "cases[0] = 'sbs': allowed are objects of the class Case",
    ),
    "name for the aircraft of a batch": (
        lambda ac: simulate_batch([Case("sbs", {})], 0.1),
        f"cases[0].{AN_AIRCRAFT_OF_A_NAME}",
    ),
    "text for the time of a batch": (
        lambda ac: simulate_batch([Case(ac, {})], "1"),
        "duration = '1': allowed are 0 to 1e+06 s",
    ),
    "flights beyond all bounds": (
        lambda ac: gust_cases(ac, 10**9, {}, turbulence=1.0),
        "flights = 1000000000: allowed are integers from 1 to 1000000",
    ),
    "number for a pilot": (
        lambda ac: simulate_with_pilot(ac, None, 3, 0.1),
        "pilot = 3: allowed are functions of time and state",
    ),
    "number for the file of a model": (lambda ac: linearize(ac).save(3), "path = 3: allowed are paths"),
    "number for a path": (lambda ac: ac.value(3), "path = 3: allowed are keys like body.mass"),
    "control characters in a path": (
        lambda ac: ac.value("body\x85"),
        "path = 'body\\x85': allowed are keys like body.mass",
    ),
}


@pytest.mark.parametrize(("call", "line"), WRONG_TYPES.values(), ids=WRONG_TYPES)
def test_a_wrong_type_is_refused_like_a_wrong_value(sbs, call, line):
    assert refusal(call, sbs).startswith(line)


def test_numbers_of_other_packages_are_numbers(sbs):
    assert trim(sbs, np.float32(3.0), azimuth_count=np.int64(4), lead_lag=np.bool_(True)).condition.airspeed == 3.0
    assert trim(sbs, np.array(3.0), lead_lag=1).lead_lag is True
    changed = sbs.with_value("rotors.flap_spring", np.float32(3.0))
    assert [rotor.flap_spring for rotor in changed.rotors] == [3.0, 3.0]
    assert type(changed.data["rotors"][0]["flap_spring"]) is float


def test_flown_controls_are_named_by_their_names(sbs, hover):
    controls = [[*hover.controls], [0.1, math.nan, 0.0, 0.0]]
    line = refusal(simulate, sbs, hover, controls, 0.02)
    assert line == "lateral_cyclic = nan: allowed are -1.5708 to 1.5708 rad"
    assert refusal(simulate, sbs, hover, lambda time: "1234", 0.02).startswith("controls = '1234': allowed are numbers")


def billion_laughs(depth):
    lines = ["a0: &a0 [1,1,1,1,1,1,1,1,1,1]"]
    lines += [f"a{i}: &a{i} [{','.join([f'*a{i - 1}'] * 10)}]" for i in range(1, depth)]
    return "\n".join([*lines, f"body: {{mass: *a{depth - 1}}}"])


def test_a_joystick_file_is_read_with_the_same_care(tmp_path):
    path = tmp_path / "joystick.yaml"
    path.write_text(billion_laughs(30))
    line = refusal(JoystickFile.load, str(path), "xbox")
    assert line.startswith(f"{path}: the file has ")
    assert line.endswith("allowed are 10000")


def test_pilots_and_page_survive_invalid_input_and_fly_on(tmp_path):
    """Running nodes: messages, bytes that are none, keys, requests, presses."""
    pytest.importorskip("rclpy")
    pytest.importorskip("viser")
    import node_fuzz_targets
    from ros_harness import DOMAINS, world

    with world(next(DOMAINS), tmp_path) as made:
        made.start("simulator", record="off")
        with contextlib.closing(node_fuzz_targets.Pilots(made)) as pilots:
            page = node_fuzz_targets.Page(pilots.port, lambda: pilots.parts["cockpit"].running)
            for target in (*pilots.targets(), *page.targets()):
                push(target)
            page.close()
            pilots.check_alive()


def test_aliases_of_aliases_are_counted_and_not_gone_through(tmp_path):
    path = tmp_path / "laughs.yaml"
    path.write_text(billion_laughs(30))
    assert "values, aliases counted as what they stand for: allowed are 10000" in refusal(Aircraft.load, path)


def test_a_file_beyond_all_bounds_is_not_read(tmp_path):
    path = tmp_path / "large.yaml"
    with path.open("wb") as file:
        file.truncate(10**11)  # takes no room
    assert refusal(Aircraft.load, path).endswith("the file has more than 262144 bytes")


@pytest.mark.parametrize(
    "value",
    [10**5000, 1j, [np.zeros(2)], float("nan"), [[[[1]]]] * 3000],
    ids=["digits", "complex", "array", "nan", "list"],
)
def test_a_value_that_no_file_could_hold_is_refused(sbs, value):
    refusal(sbs.with_value, "body.mass", value)


def test_no_name_of_an_aircraft_leads_out_of_the_folder_of_logs(tmp_path):
    pytest.importorskip("rclpy")
    from sbs_sim.nodes.flight_log import log_path

    begin = datetime.datetime(2026, 1, 2, 3, 4, 5)
    for name in ("../../x", "/etc/x", "a\0b", "a\nb", "..", "x" * 500, "ж/ж"):
        path = log_path(str(tmp_path), name, begin)
        assert path.parent == tmp_path
        path.touch()  # a name that a file can have
    assert log_path(str(tmp_path), "sbs", begin).name == "2026-01-02_03-04-05_sbs.mcap"


@pytest.mark.parametrize(
    "name", ["airfoils/..", "airfoils/../../x.csv", "airfoils/a\0.csv", "airfoils/" + "x" * 300 + ".csv"]
)
def test_no_attachment_of_a_log_leads_out_of_its_folder(tmp_path, name):
    with fuzz_targets.scratch() as folder:
        path = folder / "log.mcap"
        given = {"metadata": fuzz_targets.REAL_METADATA, "attachments": {**fuzz_targets.REAL_FILES, name: b"x"}}
        with fuzz_targets._writer(path, given):
            pass
        with pytest.raises(RecordingError, match=r"that cannot be used|holds no flight"):
            flight_of(read(path))


@pytest.mark.parametrize(
    ("last", "line"),
    [(10**14, "the log has no states for more than 10000 s"), (2**62, "topic /state has a time of more than 1e+08 s")],
)
def test_a_log_with_a_time_beyond_all_bounds_is_not_flown(tmp_path, last, line):
    path = tmp_path / "late.mcap"
    with LogWriter(
        path, library="test", wall_start=0, metadata=fuzz_targets.REAL_METADATA, attachments=fuzz_targets.REAL_FILES
    ) as log:
        for topic, (kind, text, messages) in fuzz_targets.REAL_TOPICS.items():
            channel = log.add_channel(topic, kind, text, qos_profiles())
            for time, data in messages:
                log.write(channel, time, data)
            if topic != "/events":  # a second start would be another fault
                log.write(channel, last, messages[-1][1])
    assert refusal(lambda: flight_of(read(path))).startswith(line)


def test_what_a_log_calls_its_types_and_topics_executes_nothing():
    pytest.importorskip("rclpy")
    from mcap.records import Channel, Schema

    from sbs_sim.errors import SbsError
    from sbs_sim.nodes.message_types import installed_type

    channel = Channel(id=1, topic="/x", message_encoding="cdr", metadata={}, schema_id=1)
    kind = installed_type(channel, Schema(id=1, name="sbs_msgs/msg/Controls", encoding="ros2msg", data=b""))
    assert kind.__name__ == "Controls"
    before = set(sys.modules)
    for name in (
        "",
        "/",
        ".msg/X",
        "../x/msg/X",
        "sbs_msgs/msg/__builtins__",
        "os/path",
        "this/msg/X",
        "sbs_msgs.msg/msg/os",
        "distutils/msg/Distribution",
    ):
        with pytest.raises(SbsError, match="is not installed"):
            installed_type(channel, Schema(id=1, name=name, encoding="ros2msg", data=b""))
    assert set(sys.modules) == before


def test_a_damaged_topic_is_refused_each_time(tmp_path):
    """And never taken for one without messages, of which half a figure would be drawn."""
    path = tmp_path / "damaged.mcap"
    with LogWriter(path, library="test", wall_start=0, metadata=fuzz_targets.REAL_METADATA, attachments={}) as log:
        kind, text, messages = fuzz_targets.REAL_TOPICS["/state"]
        channel = log.add_channel("/state", kind, text, qos_profiles())
        for time, data in messages:
            log.write(channel, time, data[:-40])
    found = read(path)
    for _ in range(2):
        assert refusal(lambda: found["state"]["position.z"]).startswith("topic /state: ")
    assert refusal(plot, found, tmp_path / "a.svg").startswith("topic /state: ")
    assert not (tmp_path / "a.svg").exists()


def test_a_log_without_a_name_is_refused_like_any_other(capsys, monkeypatch, tmp_path):
    from sbs_sim.commands import plot as command

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", ["plot", "."])
    with pytest.raises(SystemExit, match="1"):
        command.main()
    assert capsys.readouterr().err == "cannot read .: a folder without a log (.mcap)\n"


@given(st.text(max_size=5))
@settings(FEW, max_examples=20)
def test_any_text_for_an_aircraft_is_refused_in_one_line(text):
    with pytest.raises(AircraftError) as caught:
        Aircraft.load("no such file" + text)
    assert len(str(caught.value).splitlines()) == 1


def test_the_tool_pushes_through_every_target(monkeypatch, capsys):
    """tools/robustness/fuzz.py itself, with few inputs and without nodes: its table and its exit code."""
    monkeypatch.syspath_prepend(str(Path(__file__).resolve().parents[2] / "tools" / "robustness"))
    import fuzz

    monkeypatch.setattr(sys, "argv", ["fuzz.py", "--inputs", "60", "--no-nodes", "--seed", "3"])
    code, printed = fuzz.main(), capsys.readouterr().out
    assert code == 0, printed
    for target in fuzz_targets.FUZZ_TARGETS:
        assert target.name in printed
    assert "nothing wrong" in printed
