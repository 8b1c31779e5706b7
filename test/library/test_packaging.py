"""The wheel: built as pip builds it, installed into an empty environment beside no more than it says it needs."""

import importlib.metadata
import json
import re
import subprocess
import sys
import sysconfig
import venv
import zipfile
from pathlib import Path
from xml.etree import ElementTree

import pytest
from packaging.requirements import Requirement

import sbs_sim
from sbs_sim import trim

ROOT = Path(__file__).resolve().parents[2]
VERSION = ElementTree.parse(ROOT / "package.xml").findtext("version")
PATIENCE = 120.0  # s, generous, for machines that are busy


def needed(requirements, extra=""):
    """Distributions that requirements stand for, with all that those need."""
    found, waiting = {}, [(Requirement(text), extra) for text in requirements]
    while waiting:
        requirement, wanted = waiting.pop()
        if requirement.marker is not None and not requirement.marker.evaluate({"extra": wanted}):
            continue
        here = importlib.metadata.distribution(requirement.name)
        assert requirement.specifier.contains(here.version, prereleases=True), requirement
        if here.name not in found:
            found[here.name] = here
            waiting += [(Requirement(text), "") for text in here.requires or ()]
    return list(found.values())


def required(wheel):
    """What a wheel says it requires."""
    with zipfile.ZipFile(wheel) as file:
        (metadata,) = (name for name in file.namelist() if name.endswith(".dist-info/METADATA"))
        return importlib.metadata.PathDistribution(zipfile.Path(file, metadata.rpartition("/")[0] + "/")).requires


def link(distributions, folder):
    """Put what distributions have into a folder of modules."""
    for distribution in distributions:
        for top in {str(path).split("/")[0] for path in distribution.files if not str(path).startswith("..")}:
            if not (folder / top).exists():
                (folder / top).symlink_to(distribution.locate_file(top))


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    """A wheel of a copy of the sources: of what git knows, for the folder of the clone has more in it."""
    folder = tmp_path_factory.mktemp("sources")
    for name in (
        "setup.py",
        "setup.cfg",
        "pyproject.toml",
        "package.xml",
        "resource",
        "config",
        "launch",
        "sbs_sim",
        "LICENSE",
    ):
        (folder / name).symlink_to(ROOT / name)
    made = tmp_path_factory.mktemp("wheel")
    command = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation", "--no-index"]
    subprocess.run([*command, "--wheel-dir", made, folder], check=True, capture_output=True, timeout=PATIENCE)
    assert not list(folder.glob("*.egg-info")), "./run would take this for what colcon has installed"
    return next(made.iterdir())


@pytest.fixture(scope="module")
def environment(wheel, tmp_path_factory):
    """An environment with the wheel and what it needs, and nothing else."""
    folder = tmp_path_factory.mktemp("environment") / "env"
    venv.create(folder, symlinks=True)
    python = folder / "bin" / "python"
    before = {path.name for path in (folder / "bin").iterdir()}
    command = [sys.executable, "-m", "pip", "--python", python, "install", "--quiet", "--no-deps", "--no-index", wheel]
    subprocess.run(command, check=True, capture_output=True, timeout=PATIENCE)
    site = Path(sysconfig.get_path("purelib", vars={"base": str(folder)}))
    link(needed(required(wheel)), site)
    return folder, {path.name for path in (folder / "bin").iterdir()} - before


@pytest.fixture(scope="module")
def ros_free(wheel, tmp_path_factory):
    """Folder of what the extra `ros-free` adds."""
    folder = tmp_path_factory.mktemp("extras")
    link(needed(required(wheel), "ros-free"), folder)
    return folder


@pytest.fixture(scope="module")
def logs(wheel, tmp_path_factory):
    """Folder of what the extra `logs` adds."""
    folder = tmp_path_factory.mktemp("logs")
    link(needed(required(wheel), "logs"), folder)
    return folder


def call(environment, *words, **more):
    """A command in the environment, with nothing of this one around it."""
    folder, _ = environment
    clean = {"PATH": f"{folder}/bin:/usr/bin:/bin", "HOME": str(folder), **more}
    return subprocess.run(
        [folder / "bin" / words[0], *map(str, words[1:])],
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=False,
        env=clean,
        cwd=folder,
    )


def test_one_command_gets_into_the_path(environment):
    assert environment[1] == {"sbs-sim"}
    assert call(environment, "sbs-sim", "--version").stdout == f"sbs_sim {VERSION}\n"


def test_it_trims_where_nothing_else_is(environment, sbs, tmp_path):
    """Without the compiler, which would take a minute here; aircraft, airfoils and schema are those of the wheel."""
    file = tmp_path / "trim.json"
    words = ("trim", "--azimuth-count", 1, "--set", "options.elements=2", "--json", file)
    result = call(environment, "sbs-sim", *words, NUMBA_DISABLE_JIT="1")
    assert (result.returncode, result.stderr) == (0, "")
    expected = trim(sbs.with_value("options.elements", 2), azimuth_count=1)
    assert json.loads(file.read_text())["power"] == pytest.approx(expected.power, rel=1e-6)


def test_it_reads_logs_and_draws_them(environment, logs, ros_free, tmp_path):
    log, picture = ROOT / "bags" / "hover_step.mcap", tmp_path / "log.svg"
    words = ("sbs-sim", "plot", log, "--out", picture)
    refused = call(environment, *words, NUMBA_DISABLE_JIT="1")
    assert (refused.returncode, refused.stdout) == (1, "")
    assert refused.stderr.count("\n") == 1
    assert "remedy: python3 -m pip install 'sbs-sim[" in refused.stderr
    logs_alone = call(environment, *words, NUMBA_DISABLE_JIT="1", PYTHONPATH=logs)
    assert (logs_alone.returncode, logs_alone.stdout) == (1, "")
    assert logs_alone.stderr.count("\n") == 1
    assert "remedy: python3 -m pip install 'sbs-sim[plots]'" in logs_alone.stderr
    result = call(environment, *words, NUMBA_DISABLE_JIT="1", PYTHONPATH=ros_free)
    assert (result.returncode, result.stderr) == (0, "")
    assert picture.read_text().startswith("<?xml")


def test_it_recovers_logs_without_ros(environment, ros_free, tmp_path):
    recover = ("replay", ROOT / "bags" / "hover_step.mcap", "--recover", "--out", tmp_path)
    result = call(environment, "sbs-sim", *recover, NUMBA_DISABLE_JIT="1", PYTHONPATH=ros_free)
    assert (result.returncode, result.stderr) == (0, "")
    assert "nothing was lost" in result.stdout
    refused = call(environment, "sbs-sim", *recover[:2], NUMBA_DISABLE_JIT="1", PYTHONPATH=ros_free)
    assert refused.stderr.startswith("replay needs ROS 2")


def test_its_types_are_for_others(environment):
    code = (
        "import sbs_sim, pathlib; place = pathlib.Path(sbs_sim.__file__).parent;"
        "print(sbs_sim.__version__, (place / 'py.typed').is_file())"
    )
    assert call(environment, "python", "-c", code).stdout.split() == [VERSION, "True"]


def test_what_needs_ros_says_so_in_one_line(environment):
    for words in (("simulator",), ("cockpit", "--help")):
        result = call(environment, "sbs-sim", *words, NUMBA_DISABLE_JIT="1")
        assert (result.returncode, result.stdout) == (1, "")
        assert result.stderr.count("\n") == 1
        assert f"{words[0]} needs ROS 2" in result.stderr


def test_everything_that_is_shipped_is_found_there(environment):
    code = (
        "import sbs_sim, sys; from sbs_sim.config_file import config_folder; place = config_folder();"
        "print(place); print(sbs_sim.__file__); [sbs_sim.Aircraft.load(name) for name in ('sbs', 'sbs_paper')];"
        "print('rclpy' in sys.modules, len(list(place.rglob('*.*'))))"
    )
    place, package, counted = call(environment, "python", "-c", code, NUMBA_DISABLE_JIT="1").stdout.splitlines()
    assert all(Path(found).is_relative_to(environment[0]) for found in (place, package))
    shipped = [path for path in (ROOT / "config").rglob("*.*") if not path.name.endswith("~")]
    assert Path(place).parent == Path(package).parent
    assert counted == f"False {len(shipped)}"
    printed = call(environment, "sbs-sim", "completion").stdout
    assert Path(printed.removeprefix("source ").strip()).read_text() == (ROOT / "config/completion.bash").read_text()


def test_a_refusal_is_one_line_there_too(environment):
    result = call(environment, "python", "-m", "sbs_sim", "trim", "--aircraft", "nothing")
    shipped = ", ".join(sorted(path.stem for path in (ROOT / "config/aircraft").glob("*.yaml")))
    assert result.stderr == f"aircraft = 'nothing': allowed are a file's path or one of {shipped}\n"


def test_every_file_names_the_version_of_the_ros_package():
    text = {name: (ROOT / name).read_text() for name in ("msg_defs/package.xml", "CITATION.cff", "CHANGELOG.md")}
    assert re.findall(r"<version>(.*)</version>", text["msg_defs/package.xml"]) == [VERSION]
    assert re.findall(r"^version: (.*)$", text["CITATION.cff"], re.MULTILINE) == [VERSION]
    assert re.search(r"^## (\S+) - \d{4}-\d\d-\d\d$", text["CHANGELOG.md"], re.MULTILINE)[1] == VERSION
    assert sbs_sim.__version__ == VERSION
