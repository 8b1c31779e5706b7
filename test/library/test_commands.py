"""The executables trim, linearize and sweep as real processes: what they print, write, and end with."""

import csv
import json
import math
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import psutil
import pytest
from terminal import on_a_terminal

from sbs_sim import Aircraft, linearize, trim
from sbs_sim.output.warnings_text import joined

EXECUTABLES = Path(__file__).resolve().parents[2] / "install" / "sbs_sim" / "lib" / "sbs_sim"
PATIENCE = 60.0  # s, generous, for machines that are busy


def command(name, *arguments):
    return [sys.executable, str(EXECUTABLES / name), *map(str, arguments)]


def call(name, *arguments, **options):
    return subprocess.run(
        command(name, *arguments), capture_output=True, text=True, timeout=PATIENCE, check=False, **options
    )


def output(name, *arguments, **options):
    """What a call prints that is to succeed without a word on stderr."""
    result = call(name, *arguments, **options)
    assert (result.returncode, result.stderr) == (0, "")
    return result.stdout


def failure(name, *arguments, **options):
    """The one line on stderr of a call that is to fail."""
    result = call(name, *arguments, **options)
    assert (result.returncode, result.stdout) == (1, "")
    assert result.stderr.count("\n") == 1
    return result.stderr.rstrip("\n")


def row(text, label):
    """Numbers behind a label, which is at the beginning of a line."""
    line = next(line for line in text.splitlines() if line.startswith(label))
    return [float(number) for number in re.findall(r"[-+]?\d+\.?\d*(?:e[-+]\d+)?", line.removeprefix(label))]


def columns_end_alike(lines):
    """True for a table whose numbers stand below each other at the right."""
    ends = [[match.end() for match in re.finditer(r"\S+", line)][-1] for line in lines]
    return len(set(ends)) == 1


# -- trim ------------------------------------------------------------------------------------------------------------


def test_trim_prints_the_trim(sbs, tmp_path):
    text = output(
        *("trim", "--airspeed", 12, "--turn-rate-deg", 20, "--sideslip-deg", 5, "--climb-rate", 1),
        *("--no-cyclic-inflow", "--azimuth-count", 6, "--json", tmp_path / "trim.json"),
    )
    condition = {"climb_rate": 1.0, "sideslip": math.radians(5), "turn_rate": math.radians(20)}
    point = trim(sbs, 12.0, **condition, cyclic_inflow=False, azimuth_count=6)
    assert text.startswith("trim of sbs: airspeed 12 m/s, climb 1 m/s, sideslip 5 deg, turn 20 deg/s\n")
    assert "with lead-lag, without cyclic inflow, 6 azimuths; Newton, " in text
    assert f"{point.iterations} iterations, residual {point.residual:.1e}" in text
    assert row(text, "pitch [deg]") == [round(math.degrees(point.pitch), 4)]
    assert row(text, "roll [deg]") == [round(math.degrees(point.roll), 4)]
    assert row(text, "differential_longitudinal_cyclic [deg]")[0] == round(math.degrees(point.controls[3]), 4)
    assert row(text, "thrust [N]") == pytest.approx(point.thrust, abs=1e-3)
    assert row(text, "torque [N m]") == pytest.approx(point.torque, abs=1e-4)
    assert row(text, "power [W]") == pytest.approx(point.power, abs=1e-2)
    state = dict(zip(point.state_names, point.state, strict=True))
    assert row(text, "flap a1 [deg]") == pytest.approx(np.degrees([state["a1(1)"], state["a1(2)"]]), abs=1e-4)
    assert row(text, "inflow lambda0 [1]") == pytest.approx([state["lambda0(1)"], state["lambda0(2)"]], abs=1e-6)
    assert json.loads((tmp_path / "trim.json").read_text()) == point.to_dict()
    rotors = text[text.index("rotors") : text.index("\n\npower")].splitlines()
    assert columns_end_alike(rotors)
    assert "-0.0000 " not in text


def test_trim_of_changed_aircraft_by_the_other_method():
    text = output(
        *("trim", "--aircraft", "sbs_paper", "--method", "two_loop"),
        *("--set", "body.mass=22.5", "--set", "rotors.twist_deg.tip=-4", "--set", "options.hub_moment=complete"),
    )
    assert "trim of sbs_paper: " in text
    assert re.search(r"two loops, \d+ outer and \d+ inner iterations, residual", text)
    assert sum(row(text, "thrust [N]")) == pytest.approx(22.5 * 9.80665, rel=1e-3)


def test_changes_are_checked_together():
    changes = ("--set", "rotors.radius=0.40", "--set", "rotors.blade_cg=0.18", "--set", "body.inertia[0][1]=0.02")
    text = output("trim", *changes)
    craft = Aircraft.load("sbs").with_values(
        {"rotors.radius": 0.4, "rotors.blade_cg": 0.18, "body.inertia[0][1]": 0.02}
    )
    assert row(text, "power of all rotors") == [round(trim(craft).power.sum(), 2)]
    assert re.search(r"^goes into \[W\] induced [\d.]+, profile [\d.]+, fuselage 0.0, other -?0.0$", text, re.MULTILINE)


def test_trim_names_what_is_beyond_its_limits():
    text = output("trim", "--set", "controls.collective.range_deg=[0, 8]")
    assert "beyond its limits: collective = 8.545 deg: allowed are 0 to 8 deg\n" in text


def test_commands_say_where_the_model_does_not_hold(tmp_path):
    """A descent into the rotors' own wake."""
    line = "outside the model's validity: MR1, MR2: vortex ring state, where momentum theory does not hold\n"
    file = tmp_path / "a.json"
    for name, *arguments in (["trim"], ["linearize"]):
        assert line in output(name, *arguments, "--climb-rate", -7, "--json", file)
        assert "vortex ring" in json.loads(file.read_text())["warnings"][0]
        assert "validity" not in output(name, *arguments)
    text = output("sweep", "climb_rate", "--values", -7, 0, "--trims-only", "--csv", tmp_path / "a.csv")
    assert text.count("validity") == 1
    assert re.search(r"^climb_rate -7: outside the model's validity: MR1, MR2: vortex ring state, [^;]*$", text, re.M)
    assert [bool(line["warnings"]) for line in csv.DictReader((tmp_path / "a.csv").open())] == [True, False]


def test_trim_says_which_way_the_controls_go():
    """Of this aircraft, whose fourth control turns the nose to the right."""
    file = Path(__file__).resolve().parents[1] / "data" / "tandem.yaml"
    for aircraft, yaw in ((file, "nose right"), (file.with_name("tail_rotor.yaml"), "nose left")):
        text = output("trim", "--aircraft", aircraft)
        assert re.search(r"^collective \[deg\] .* heave: up$", text, re.MULTILINE)
        assert re.search(r"^lateral_cyclic \[deg\] .* roll: rolls right$", text, re.MULTILINE)
        assert re.search(r"^longitudinal_cyclic \[deg\] .* pitch: nose down$", text, re.MULTILINE)
        assert re.search(rf"^differential_longitudinal_cyclic \[deg\] .* yaw: {yaw}$", text, re.MULTILINE)


def test_trim_of_a_file_with_unequal_rotors():
    file = Path(__file__).resolve().parents[1] / "data" / "tandem.yaml"
    text = output("trim", "--aircraft", file)
    assert len(row(text, "flap a1 [deg]")) == 2
    assert len(row(text, "flap a2 [deg]")) == 1  # of the rotor with five blades only


# -- linearize -------------------------------------------------------------------------------------------------------


def test_an_aircraft_without_a_period_is_refused_before_the_work():
    refused = call("linearize", "--aircraft", "quadrotor", "--floquet")
    assert (refused.returncode, refused.stdout) == (1, "")
    allowed = "allowed are all rotors on one drive, or no drives"
    assert refused.stderr == f"rotors whose speeds are their own have no common period: {allowed}\n"


def test_linearize_prints_modes(sbs, tmp_path):
    text = output("linearize", "--airspeed", 10, "--export", tmp_path / "model.npz", "--json", tmp_path / "model.json")
    model = linearize(sbs, airspeed=10.0)
    assert "method averaged, 38 states, 4 controls\n" in text
    for mode in model.modes:
        values = row(text, f"{mode.name} ")
        assert values[0] == pytest.approx(mode.pole.real, abs=1e-5)
        if mode.is_oscillatory:
            assert values[1] == pytest.approx(mode.pole.imag, abs=1e-5)
        assert values[1 + mode.is_oscillatory] == pytest.approx(mode.frequency, abs=1e-4)
        assert values[2 + mode.is_oscillatory] == pytest.approx(mode.damping, abs=1e-4)
        seconds = min(mode.time_to_half, mode.time_to_double)
        assert values[3 + mode.is_oscillatory] == pytest.approx(seconds, abs=1e-4)
    assert re.search(r"^roll .* p 70%, v 12%, phi 9%$", text, re.MULTILINE)
    assert f"azimuth spread {model.azimuth_spread:.3g}\n" in text
    assert f"parameters {model.parameter_hash}\n" in text
    with np.load(tmp_path / "model.npz") as file:
        assert np.array_equal(file["a"], model.a)
    assert json.loads((tmp_path / "model.json").read_text()) == model.to_dict()


def test_linearize_reports_rotor_modes_that_grow():
    """Lag without a damper, in the settled model too, which has no rotor states; nothing of the body."""
    loose = ("linearize", "--airspeed", 20, "--set", "rotors.lag_damping=0")
    for more in ((), ("--quasi-static",)):
        assert re.search(
            r"^growing rotor modes: \S+ lag, .* at 0\.\d+ ± 125\.\d+i rad/s \(MR1, MR2\)$", output(*loose, *more), re.M
        )
    assert "growing rotor modes: none\n" in output("linearize", "--set", "rotors.lag_damping=0.5")


def test_linearize_prints_what_else_it_is_asked_for(sbs):
    text = output("linearize", "--method", "paper", "--matrices", "--derivatives", "--participation", "--floquet")
    model = linearize(sbs, method="paper")
    assert "method paper, 38 states" in text
    assert row(text[text.index("derivatives") :], "by q ") == pytest.approx(
        [model.derivatives()[f"{symbol}_q"] for symbol in ("X", "Y", "Z", "L'", "M", "N'")], rel=1e-4
    )
    matrices = text[text.index("A [SI, rad]") :]
    printed = [row(matrices[i:], "u ") for i in (m.start() for m in re.finditer(r"A \[SI, rad\]", matrices))]
    assert np.concatenate(printed) == pytest.approx(model.a[0], rel=1e-5, abs=1e-12)
    assert row(matrices[matrices.index("B [SI, rad]") :], "w ") == pytest.approx(model.b[1], rel=1e-5, abs=1e-12)
    assert re.search(r"^heave subsidence +w 9\d\.\d%, lambda0", text, re.MULTILINE)
    floquet = text[text.index("Floquet: period 8.333 ms") :]
    averaged, exponent, difference, relative, multiplier = row(floquet, "heave subsidence")
    assert averaged == pytest.approx(model.mode("heave subsidence").pole.real, rel=1e-3)
    assert abs(averaged - exponent) == pytest.approx(difference, abs=2e-5)
    assert relative == pytest.approx(difference / abs(averaged), rel=0.02)
    assert multiplier == pytest.approx(math.exp(exponent * 8.3333e-3), abs=2e-6)


def test_exponents_of_rotors_with_unequal_speeds():
    """Their common period is long: the fast modes need many instants of it, and some are gone at its end."""
    file = Path(__file__).resolve().parents[1] / "data" / "tail_rotor.yaml"
    text = output("linearize", "--aircraft", file, "--no-lead-lag", "--floquet")
    table = text[text.index("Floquet: period 100 ms") :]
    for name in ("Dutch roll", "short period", "regressing flap, rotor 2", "coning, rotor 1"):
        relative = row(table, f"{name} ")[5]
        assert relative < 1e-5
    assert re.search(r"^uniform inflow, rotor 2 +-532\.\d+ +gone ", table, re.MULTILINE)


def test_linearize_with_settled_rotors(sbs):
    text = output("linearize", "--quasi-static", "--no-lead-lag")
    model = linearize(sbs, lead_lag=False).quasi_static()
    assert "8 states, rotors and inflow settled" in text
    assert row(text, "short period")[0] == pytest.approx(model.mode("short period").pole.real, abs=1e-5)


# -- sweep -----------------------------------------------------------------------------------------------------------


def test_sweep_prints_a_table_and_writes_files(sbs, tmp_path):
    files = ("--csv", tmp_path / "s.csv", "--json", tmp_path / "s.json", "--out", tmp_path / "plots")
    text = output("sweep", "airspeed", "-5", "--no-lead-lag", "20", "3", *files)  # options may stand anywhere
    for speed in (-5.0, 7.5, 20.0):
        point = trim(sbs, airspeed=speed, lead_lag=False)
        values = row(text[text.index("\n") :], f"\n{speed:14g}".strip("\n"))
        expected = [*np.degrees([point.pitch, point.roll, *point.controls]), point.power.sum()]
        assert values == pytest.approx(expected, abs=0.06)
    rows = list(csv.DictReader((tmp_path / "s.csv").open()))
    assert [float(line["airspeed [m/s]"]) for line in rows] == [-5.0, 7.5, 20.0]
    assert len(json.loads((tmp_path / "s.json").read_text())["points"]) == 3
    names = ["root_locus.png", "root_locus.svg", "trim.png", "trim.svg"]
    assert sorted(path.name for path in (tmp_path / "plots").iterdir()) == names
    assert all(f"written: {tmp_path / 'plots' / name}\n" in text for name in names)


def test_sweep_takes_degrees_and_reports_failures(sbs):
    text = output("sweep", "sideslip_deg", "--airspeed", 4, "--trims-only", "--values", -90, 200)
    point = trim(sbs, airspeed=4.0, sideslip=-math.pi / 2)
    assert text.startswith("sideslip [deg]  pitch [deg]")
    assert row(text[text.index("\n") + 1 :], "           -90")[1] == pytest.approx(math.degrees(point.roll), abs=1e-3)
    assert "no trim, see below" in text
    assert "sideslip 200: sideslip_deg = 200.0: allowed are -180 to 180 deg\n" in text


def test_a_sweep_without_any_trim_fails():
    result = call("sweep", "body.mass", "0.3", "0.6", "2")
    assert result.returncode == 1
    assert "body.mass 0.3: body.mass = 0.3: allowed is > 0.9678" in result.stdout
    assert result.stderr == "no point of the sweep has a trim\n"


def test_a_bar_is_shown_on_a_terminal_only():
    code, out, shown = on_a_terminal(command("sweep", "airspeed", 0, 5, 3, "--trims-only"))
    assert code == 0
    assert b"0/3 [" in shown
    assert shown.rstrip(b"\r").endswith(b" ")  # and cleared
    assert "/3 [" not in out
    assert len(out.splitlines()) == 4


# -- errors ----------------------------------------------------------------------------------------------------------

FAILURES = {
    "unknown aircraft": (
        ("trim", "--aircraft", "sb"),
        "aircraft = 'sb': allowed are a file's path or one of caradonna_tung, ",
    ),
    "unknown key": (("trim", "--set", "body.mas=1"), "body.mas: unknown key, allowed are mass, inertia, "),
    "bad value": (("linearize", "--set", "body.mass=heavy"), "body.mass = 'heavy': allowed is a number"),
    "not finite": (("trim", "--set", "body.mass=NaN"), "body.mass = nan: allowed is a finite number"),
    "no number": (("trim", "--airspeed", "nan"), "airspeed = nan: allowed are -100 to 100 m/s"),
    "infinite": (("trim", "--airspeed", "-inf"), "airspeed = -inf: allowed are -100 to 100 m/s"),
    "an exponent": (("trim", "--climb-rate", "-6e1"), "climb_rate = -60.0: allowed are -50 to 50 m/s"),
    "degrees": (("trim", "--sideslip-deg", "200"), "sideslip_deg = 200.0: allowed are -180 to 180 deg"),
    "degrees by time": (
        ("trim", "--turn-rate-deg", "-2e2"),
        "turn_rate_deg = -200.0: allowed are -171.887 to 171.887 deg/s",
    ),
    "no trim": (("linearize", "--airspeed", "90"), "no trim: the path from hover ends at airspeed "),
    "a guess out of range": (
        ("sweep", "airspeed", "1", "2", "2", "--guess-deg", "5", "0", "-3", "99"),
        "guess_deg: differential_longitudinal_cyclic = 99.0: allowed are -90 to 90 deg",
    ),
    "a guess that is no number": (
        ("trim", "--guess-deg", "5", "0", "nan", "1"),
        "guess_deg: longitudinal_cyclic = nan: allowed are -90 to 90 deg",
    ),
    "azimuths": (("trim", "--azimuth-count", "0"), "azimuth_count = 0: allowed are integers from 1 to 1000"),
    "unknown parameter": (("sweep", "body.mas", "1", "2", "2"), "parameter 'body.mas': allowed are airspeed, "),
    "unknown limit": (("gusts", "--limit", "wings=1"), "limit 'wings': unknown, allowed are u, v, w, "),
    "no turbulence": (("gusts", "--turbulence", "-1"), "turbulence_intensity.x = -1.0: allowed are 0 to 100 m/s"),
    "height of a severity": (
        ("gusts", "--severity", "light", "--height", "1e9"),
        "height = 1000000000.0: allowed are -1000 to 24384 m",
    ),
    "no gust file": (("gusts", "--gust-file", "nothing.csv"), "nothing.csv: No such file or directory"),
    "gradient of a rule": (
        ("gusts", "--rule", "cs25", "--gradient", "200"),
        "gradient = 200.0: allowed are 9 to 107 m",
    ),
    "workers": (("sweep", "airspeed", "1", "2", "2", "--workers", "0"), "workers = 0: allowed are integers "),
}


@pytest.mark.parametrize(("arguments", "line"), FAILURES.values(), ids=FAILURES)
def test_an_error_is_one_line(arguments, line):
    assert failure(*arguments).startswith(line)


def test_a_file_that_cannot_be_written_is_reported_before_the_work():
    for arguments in (("trim", "--json"), ("linearize", "--export"), ("sweep", "airspeed", "0", "1", "1", "--csv")):
        result = call(*arguments, "/nowhere/file.json")
        assert result.returncode == 1
        assert result.stdout == ""
        assert result.stderr == "/nowhere/file.json: cannot be written: there is no folder /nowhere\n"


MISUSES = {
    "unknown option": ("trim", "--speed", "5"),
    "no number": ("trim", "--airspeed", "fast"),
    "unknown method": ("linearize", "--method", "best"),
    "no assignment": ("trim", "--set", "body.mass"),
    "no range": ("sweep", "airspeed"),
    "half a guess": ("trim", "--guess-deg", "5", "0"),
    "half a range": ("sweep", "airspeed", "0", "5"),
    "count": ("sweep", "airspeed", "0", "5", "2.5"),
    "no points": ("sweep", "airspeed", "0", "5", "0"),
    "range and values": ("sweep", "airspeed", "0", "5", "2", "--values", "1"),
    "no limit": ("gusts", "--limit", "forward"),
    "delay": ("gusts", "--delay", "101"),
    "gusts that never come": ("gusts", "--wind", "0", "--rule", "cs29", "--gradient", "20"),
    "no time": ("gusts", "--duration", "0.5"),
    "angle in radians": ("sweep", "sideslip", "0", "1", "2"),
    "swept and given": ("sweep", "airspeed", "0", "5", "2", "--airspeed", "0"),
    "angle swept and given": ("sweep", "sideslip_deg", "0", "5", "2", "--sideslip-deg", "1"),
}


@pytest.mark.parametrize("arguments", MISUSES.values(), ids=MISUSES)
def test_a_wrong_command_line_is_reported_with_the_usage(arguments):
    result = call(*arguments)
    assert (result.returncode, result.stdout) == (2, "")
    assert result.stderr.startswith(f"usage: {arguments[0]} ")
    assert result.stderr.splitlines()[-1].startswith(f"{arguments[0]}: error: ")


@pytest.mark.parametrize("name", ["trim", "linearize", "sweep"])
def test_help_names_units_and_needs_nothing_slow(name):
    text = output(name, "--help")
    assert text.startswith(f"usage: {name} ")
    assert all(unit in text for unit in ("[m/s]", "[deg]", "[deg/s]", "PATH=VALUE"))
    code = f"import sys, sbs_sim.commands.{name} as c; c.make_parser().format_help(); print('numpy' in sys.modules)"
    assert subprocess.check_output([sys.executable, "-c", code], text=True) == "False\n"


def test_trim_imports_no_more_than_it_needs():
    """Beside what numba imports by itself; nor does it load machine code of steps in time."""
    output("trim")  # compiles what is not in the cache yet, which takes all of numba
    code = (
        "import sys; sys.argv = ['trim']; import sbs_sim.commands.trim as c; c.main()\n"
        "slow = ('matplotlib', 'control', 'tqdm', 'scipy.optimize', 'scipy.io', 'scipy.linalg', 'rclpy')\n"
        "from sbs_sim.model.integrate import advance\n"
        "print('slow:', [name for name in slow if name in sys.modules] + list(advance.overloads))"
    )
    assert subprocess.check_output([sys.executable, "-c", code], text=True).endswith("slow: []\n")


# -- interrupts and broken pipes -------------------------------------------------------------------------------------


def wait_for(condition):
    end = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.01)


def test_ctrl_c_while_modules_are_loaded():
    with subprocess.Popen(command("trim"), stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        wait_for(lambda: "numpy" in Path(f"/proc/{process.pid}/maps").read_text())
        process.send_signal(signal.SIGINT)
        out, error = process.communicate(timeout=PATIENCE)
    assert (process.returncode, out, error) == (130, b"", b"")


def test_ctrl_c_while_a_sweep_is_on_its_way():
    with subprocess.Popen(
        command("sweep", "airspeed", 0, 20, 5000), stdout=subprocess.PIPE, stderr=subprocess.PIPE
    ) as process:
        watched = psutil.Process(process.pid)
        # the sweep's threads have done half a second of work
        wait_for(lambda: sum(thread.user_time > 0.3 for thread in watched.threads()) > 1)
        process.send_signal(signal.SIGINT)
        out, error = process.communicate(timeout=PATIENCE)
    assert (process.returncode, out, error) == (130, b"", b"")


def test_a_reader_that_goes_away_is_no_error():
    text = " ".join(command("linearize", "--matrices"))
    result = subprocess.run(
        ["bash", "-c", f"{text} | head -1"], capture_output=True, text=True, timeout=PATIENCE, check=True
    )
    assert result.stdout.startswith("linear model of sbs: ")
    assert result.stderr == ""


def test_an_output_that_is_full_is_reported():
    with Path("/dev/full").open("w") as full:
        result = subprocess.run(
            command("trim"), stdout=full, stderr=subprocess.PIPE, text=True, timeout=PATIENCE, check=False
        )
    assert result.returncode == 1
    assert result.stderr == "cannot write the output: No space left on device\n"


def test_warnings_of_several_rotors_are_one_line():
    lines = ["MR1: stall", "MR1: tip Mach number", "MR2: stall", "clipped: pedal at its limit", "no name"]
    assert joined(lines) == ["MR1, MR2: stall", "MR1: tip Mach number", "clipped: pedal at its limit", "no name"]
    assert joined(()) == []
