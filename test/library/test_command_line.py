"""Help, versions, suggestions, completion, and the words of the command lines, of every executable."""

import ast
import importlib
import math
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools"))
import make_completion  # noqa: E402
import update_reference as reference  # noqa: E402

import sbs_sim  # noqa: E402
from sbs_sim import Aircraft  # noqa: E402
from sbs_sim.commands import gusts as gusts_command  # noqa: E402
from sbs_sim.commands import sweep as sweep_command  # noqa: E402
from sbs_sim.commands.main import EXECUTABLES  # noqa: E402
from sbs_sim.errors import SweepError  # noqa: E402
from sbs_sim.flight.gust_file import read_gust  # noqa: E402
from sbs_sim.nodes import usage  # noqa: E402
from sbs_sim.nodes.endpoints import endpoints  # noqa: E402
from sbs_sim.pilot.hover_hold import LIMITS  # noqa: E402
from sbs_sim.terminal.command_line import suggestion  # noqa: E402

INSTALLED = ROOT / "install" / "sbs_sim" / "lib" / "sbs_sim"
PATIENCE = 60.0  # s, generous, for machines that are busy
NAMES = list(reference.executables())
NODES = [name for name in NAMES if name in usage.EXAMPLES]


def call(*words):
    command = [sys.executable, *map(str, words)]
    return subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=False)


# -- help ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", NODES)
def test_help_of_a_node_says_what_it_does_and_lists_topics_services_and_parameters(name):
    """Everything that the reference has of it, which is read from the same sources."""
    text = usage.text(name)
    docstring = ast.get_docstring(ast.parse((ROOT / "sbs_sim" / "nodes" / f"{name}.py").read_text()))
    assert docstring.splitlines()[0] in text
    own = [item for item in endpoints() if set(item.nodes) & set(usage.WITH.get(name, (name,)))]
    for item in own:
        assert re.search(rf"^  {item.name} +{item.type}$", text, re.MULTILINE), item
    assert len(own) >= (0 if name in ("replay", "cockpit") else 3)
    module = importlib.import_module(f"sbs_sim.nodes.{name}")
    for key, parameter in getattr(module, "PARAMETERS", {}).items():
        assert re.search(rf"^  {key} \(default: ", text, re.MULTILINE)
        assert parameter.description.split()[0] in text
    assert "./run " in text


@pytest.mark.parametrize(("name", "option"), [("simulator", "--help"), ("replay", "-h"), ("trim", "--help")])
def test_help_is_printed_and_nothing_begins(name, option, tmp_path):
    command = [sys.executable, INSTALLED / name, option]
    result = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, cwd=tmp_path, check=False)
    assert (result.returncode, result.stderr) == (0, "")
    assert result.stdout.startswith("usage: ")
    assert "example: ./run " in result.stdout
    assert list(tmp_path.iterdir()) == []


def test_examples_are_such_that_the_executables_take_them():
    """Those of nodes; test_guide.py has those of the pages, and the same check."""
    from test_guide import check

    for name in NAMES:
        parser = reference.parser_of(reference.executables()[name])
        text = usage.EXAMPLES[name] if parser is None else parser.epilog.rpartition("./run ")[2]
        words = shlex.split(text)
        assert words[0] == name
        check([word for word in words if not word.startswith("aircraft:=/path")])


@pytest.mark.parametrize("name", ["simulator", "cockpit", "sweep"])
def test_every_executable_knows_its_version(name):
    result = call(INSTALLED / name, "--version")
    assert (result.returncode, result.stdout, result.stderr) == (0, f"sbs_sim {sbs_sim.__version__}\n", "")


# -- suggestions -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("words", "code", "line"),
    [
        (("trim", "--airsped", "5"), 2, "trim: error: unrecognized arguments: --airsped 5; did you mean --airspeed?"),
        (("sweep", "airspeed", "0", "1", "2", "--trim-only=x"), 2, "did you mean --trims-only?"),
        (("cockpit", "--prt", "8"), 2, "cockpit: error: unrecognized arguments: --prt 8; did you mean --port?"),
        (("trim", "--wings"), 2, "trim: error: unrecognized arguments: --wings"),
        (
            ("simulator", "--airspeed=5"),
            2,
            "unknown argument --airspeed=5: parameters are given as --ros-args -p airspeed:=value",
        ),
        (("simulator", "--air-sped", "5"), 2, "parameters are given as --ros-args -p airspeed:=value"),
        (("teleop", "wings"), 2, "unknown argument wings: parameters are given as --ros-args -p name:=value"),
        (("analysis", "--ros-args", "-p", "aircarft:=sbs"), 1, "allowed are aircraft; did you mean aircraft?"),
        (("sweep", "speed", "0", "1", "2"), 1, "turn_rate_deg or a path; did you mean airspeed?; speed: unknown key, "),
        (("sweep", "body.mas", "0", "1", "2"), 1, "did you mean body.mass?; body.mas: unknown key, "),
    ],
)
def test_a_mistyped_name_is_reported_with_similar_names(words, code, line):
    result = call(INSTALLED / words[0], *words[1:])
    assert (result.returncode, result.stdout) == (code, "")
    assert line in result.stderr.splitlines()[-1]
    assert result.stderr.endswith(f"{line}\n") or line.endswith(", ")


def test_what_a_sweep_suggests_it_takes(sbs):
    """The library's name of an angle is none of the command's, which has degrees."""
    with pytest.raises(SweepError) as caught:
        sweep_command._check_parameter(sbs, "speed", "speed")
    for name in re.search(r"allowed are ([\w, ]+) or a path", str(caught.value))[1].split(", "):
        sweep_command._check_parameter(sbs, name, name)
    assert call(INSTALLED / "sweep", "turn_rate_deg", "0", "1", "1", "--trims-only").returncode == 0


def test_recovery_is_not_suggested_where_there_is_nothing_to_recover(tmp_path):
    page = ROOT / "README.md"
    result = call(INSTALLED / "replay", page)
    assert (result.returncode, result.stdout) == (1, "")
    assert "--recover" not in result.stderr
    assert "the first bytes are not those of an MCAP file" in result.stderr
    cut = tmp_path / "cut.mcap"
    cut.write_bytes((ROOT / "bags" / "hover_step.mcap").read_bytes()[:-200_000])
    said = call(INSTALLED / "replay", cut).stderr
    assert "--recover" in said
    assert call(*shlex.split(f"{INSTALLED}/{re.search('`(.*)`', said)[1]}")).returncode == 3  # it saves what is there


def test_nothing_is_suggested_where_nothing_is_near():
    assert suggestion("wings", ["--airspeed", "--json"]) == ""
    assert suggestion("--jsn", ["--airspeed", "--json"]) == "; did you mean --json?"


# -- words -----------------------------------------------------------------------------------------------------------


def test_older_spellings_work_and_are_not_documented(tmp_path):
    """test_recorder.py flies with them."""
    linear, replayed = (reference.parser_of(reference.executables()[name]) for name in ("linearize", "replay"))
    assert linear.parse_args(["--export", "a.npz"]) == linear.parse_args(["--out", "a.npz"])
    older = replayed.parse_args(["x.mcap", "--with", "a=1", "--with", "b=2", "--output", "y"])
    assert older == replayed.parse_args(["x.mcap", "--set", "a=1", "--set", "b=2", "--out", "y"])
    assert older.changes == ["a=1", "b=2"]
    for parser, old in ((linear, "--export"), (replayed, "--with"), (replayed, "--output")):
        assert old not in parser.format_help()


@pytest.mark.parametrize(("column", "lasts"), [("time [s]", 2.0), ("distance [m]", 0.5)])
def test_an_own_gust_is_flown_alone_after_the_integrals_have_settled(tmp_path, column, lasts):
    """At 11 s, when a wind of 4 m/s has taken 44 m over the aircraft; the turbulence is without it."""
    file = tmp_path / "gust.csv"
    file.write_text(f"{column},north [m/s],east [m/s],down [m/s]\n-1,0,0,0\n0,0,0,3\n2,0,0,0\n")
    arguments = gusts_command.make_parser().parse_args(["--gust-file", str(file)])
    airs = gusts_command._airs(arguments, Aircraft.load("sbs"))
    assert [name for name, (air, *_) in airs.items() if air.own_gust is not None] == ["own gust"]
    air, settling, duration = airs["own gust"]
    assert (air.own_gust, air.velocity) == (read_gust(file), (-4.0, 0.0, 0.0))
    assert not any(air.turbulence_intensity)
    assert (air.gust_delay, air.gust_distance, settling, duration) == (11.0, 44.0, 10.0, 1.0 + lasts + 12.0)


def test_limits_are_typed_in_degrees():
    parser = gusts_command.make_parser()
    limits = dict(parser.parse_args(["--limit", "heading_deg=5", "--limit", "forward=0.3"]).limit)
    assert limits == {"heading": math.radians(5.0), "forward": 0.3}
    assert set(limits) <= set(LIMITS)


def test_the_one_command_has_every_executable_with_the_same_words():
    described = re.findall(r'"(\w+) = ([\w.]+:\w+)",  # (.+)', (ROOT / "setup.py").read_text())
    assert {name: (target, text) for name, target, text in described} == {
        name: (target, text.removesuffix(" (ROS 2)")) for name, (target, text) in EXECUTABLES.items()
    }


@pytest.mark.parametrize(
    ("words", "code", "out", "error"),
    [
        (("--version",), 0, f"sbs_sim {sbs_sim.__version__}\n", ""),
        (("trim", "--version"), 0, f"sbs_sim {sbs_sim.__version__}\n", ""),
        (("simulator", "--version"), 0, f"sbs_sim {sbs_sim.__version__}\n", ""),
        (("tirm",), 2, "", "sbs-sim: no 'tirm'; did you mean trim?\n"),
        ((), 2, "", "usage: sbs-sim NAME"),
        (("trim", "--help"), 0, "usage: sbs-sim trim ", ""),
        (("sweep", "--help"), 0, "usage: sbs-sim sweep PARAMETER", ""),
        (("simulator", "--fast"), 2, "", "unknown argument --fast"),
        (("trim", "--airspeed", "900"), 1, "", "airspeed = 900.0: allowed are -100 to 100 m/s\n"),
    ],
)
def test_the_one_command(words, code, out, error):
    result = call("-m", "sbs_sim", *words)
    assert result.returncode == code
    assert result.stdout.startswith(out)
    assert result.stderr.startswith(error)
    assert bool(result.stdout) == bool(out)
    assert bool(result.stderr) == bool(error)


# -- completion ------------------------------------------------------------------------------------------------------

COMPLETE = """
source {file}
compopt() {{ :; }}  # which bash has only while it completes
cd {folder}
while IFS=$'\\t' read -r -a COMP_WORDS; do
    COMP_CWORD=$((${{#COMP_WORDS[@]}} - 1))
    [[ ${{COMP_WORDS[COMP_CWORD]}} == . ]] && COMP_WORDS[COMP_CWORD]=''
    if [[ ${{COMP_WORDS[0]}} == sbs-sim ]]; then _sbs_sim; else _sbs_sim_run; fi
    echo "${{COMPREPLY[*]}}"
done
"""
COMPLETED = {
    "./run tri": ["trim"],
    "./run si": ["simulator"],
    "./run com": ["completion"],
    "./run trim --me": ["--method"],
    "./run trim --method .": ["newton", "two_loop"],
    "./run linearize --exp": [],  # an older spelling
    "./run trim --aircraft sbs_": ["sbs_ducted", "sbs_paper"],
    "./run trim --set body.mas": ["body.mass="],
    "./run batch --airspeed 5 --spread rotors.blade_m": ["rotors.blade_mass="],
    "./run sweep turn": ["turn_rate_deg"],
    "./run sweep rotors.chord.": [
        "rotors.chord.root",
        "rotors.chord.tip",
        "rotors.chord.stations",
        "rotors.chord.values",
    ],
    "./run simulator --ros-args -p azi": ["azimuth_step_deg:="],
    "./run cockpit --ros-args -p alt": ["altitude:="],
    "./run hover_hold --ros-args -p pat": ["patience:="],
    "./run simulator --ros-args -r a:=b --par": ["--params-file"],
    "sbs-sim linear": ["linearize"],
    "sbs-sim sweep --tr": ["--trims-only"],
    "run tri": [],  # of somebody else
    "/nowhere/run tri": [],
}


def test_the_completion_is_up_to_date():
    assert make_completion.TARGET.read_text() == make_completion.text(), "remedy: ./run python tools/make_completion.py"


def test_bash_completes():
    lines = "".join("\t".join(words.split()) + "\n" for words in COMPLETED)
    script = COMPLETE.format(file=shlex.quote(str(make_completion.TARGET)), folder=shlex.quote(str(ROOT)))
    result = subprocess.run(
        ["bash", "--norc", "-c", script], input=lines, capture_output=True, text=True, timeout=PATIENCE, check=False
    )
    assert result.stderr == ""
    found = [line.split() for line in result.stdout.splitlines()]
    assert dict(zip(COMPLETED, found, strict=True)) == COMPLETED


def test_completed_paths_are_those_of_the_aircraft(sbs):
    """Every path that is offered has a value or is a key that may be left out."""
    offered = re.search(r"_sbs_sim_paths='(.*)'", make_completion.TARGET.read_text())[1].split()
    assert len(offered) > 40
    for path in offered:
        sbs.value(path)
    assert {"body.mass", "rotors.radius", "controls.collective.range_deg", "rotors.twist_deg.tip"} <= set(offered)
    assert isinstance(sbs, Aircraft)
