"""The entry script ./run: what it answers before, and instead of, setting anything up."""

import os
import re
import shlex
import shutil
import stat
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import pytest

ROOT = Path(__file__).resolve().parents[2]
EXECUTABLES = (
    "simulator control_mixer analysis hover_hold excite frames teleop joystick replay cockpit ardupilot"
    " trim linearize sweep qualities identify performance stitch design batch"
    " reproduce validate gusts plot airfoil aircraft"
)

# What the script itself calls; everything else is taken away from it.
SCRIPT_TOOLS = (
    *("bash", "cat", "chmod", "env", "find", "flock", "getconf", "grep", "mkdir", "nproc"),
    *("readlink", "rm", "sed", "sha256sum", "stat", "touch", "uname"),
)


class Clone:
    """A copy of what ./run reads, with a PATH that holds only what the test puts there."""

    def __init__(self, folder: Path, home: Path, tools: Path):
        self.folder, self.home, self.tools = folder, home, tools
        for path in (folder, home, tools):
            path.mkdir(parents=True)
        for name in ("run", "setup.py", "setup.cfg", "package.xml", "colcon_defaults.yaml"):
            shutil.copy(ROOT / name, folder)
        for name in ("requirements", "msg_defs", "resource"):
            shutil.copytree(ROOT / name, folder / name)
        for name in SCRIPT_TOOLS:
            (tools / name).symlink_to(shutil.which(name))
        for name in ("g++", "cmake", "make"):
            self.fake(name, "exit 0")
        self.fake_python("cpython 3.11", "3.11 True True")

    def fake(self, name, body):
        """Put a shell script into the PATH."""
        path = self.tools / name
        path.unlink(missing_ok=True)
        path.write_text(f"#!{shutil.which('bash')}\n{body}\n")
        path.chmod(path.stat().st_mode | stat.S_IXUSR)

    def fake_python(self, version, probe):
        """Put a python3 into the PATH that answers the script's two questions and fails at all else."""
        self.fake(
            "python3",
            f'case "$*" in *ensurepip*) echo {probe};; *implementation*) echo {version};; *) exit 1;; esac',
        )

    def remove(self, name):
        """Take a tool away."""
        (self.tools / name).unlink()

    def call(self, *arguments, script=None, **environment):
        """Execute ./run; nothing of the environment of the tests themselves reaches it."""
        return subprocess.run(
            [script or self.folder / "run", *arguments],
            env={"PATH": str(self.tools), "HOME": str(self.home), "LC_ALL": "C", **environment},
            cwd=self.home,
            capture_output=True,
            text=True,
            timeout=120,
        )


@pytest.fixture
def clone(tmp_path):
    clone = Clone(tmp_path / "a folder" / "sbs_sim", tmp_path / "home", tmp_path / "tools")
    yield clone
    assert list(clone.home.iterdir()) == [], "something was written outside the folder"


def assert_one_line(result, *parts):
    """Check that the call failed with a single line that holds all parts."""
    assert result.returncode not in (0, 2)
    assert result.stdout == ""
    assert result.stderr.count("\n") == 1, result.stderr
    for part in parts:
        assert part in result.stderr


def test_help_names_the_executables(clone):
    result = clone.call("--help")
    assert result.returncode == 0
    listed = re.findall(r"^  (\w+) +(\w.+)$", result.stdout.partition("\nexecutables:\n")[2], re.MULTILINE)
    assert [name for name, _ in listed] == EXECUTABLES.split()
    assert all(f"./run {command}" in result.stdout for command in ("build", "test", "shell", "python"))


def test_without_arguments_it_says_how_to_call_it(clone):
    result = clone.call()
    assert (result.returncode, result.stdout) == (2, "")
    assert "usage:" in result.stderr


@pytest.mark.parametrize(
    ("name", "meant"),
    [
        ("simulater", "simulator"),
        ("sim", "simulator"),
        ("tirm", "trim"),
        ("buidl", "build"),
        ("hoverhold", "hover_hold"),
        ("simulator.py", ""),
        ("*", ""),
        ("a b", ""),
        ("", ""),
    ],
)
def test_unknown_executable_is_reported_without_building(clone, name, meant):
    result = clone.call(name)
    assert result.returncode == 2
    if name:
        near = f"did you mean {meant}? " if meant else ""
        assert result.stderr == f'run: no executable "{name}"; {near}there are: {EXECUTABLES}\n'
    assert not (clone.folder / ".venv").exists()
    assert not (clone.folder / "log").exists()


def test_version_and_completion_need_nothing(clone):
    version = ElementTree.parse(clone.folder / "package.xml").findtext("version")
    assert clone.call("--version").stdout == f"sbs_sim {version}\n"
    printed = clone.call("completion").stdout
    path = shlex.split(printed)
    assert path == ["source", str(clone.folder / "config" / "completion.bash")]  # a folder with a blank in its name
    assert not (clone.folder / ".venv").exists()


def test_called_through_a_link(clone, tmp_path):
    link = tmp_path / "link"
    link.symlink_to(clone.folder / "run")
    assert "simulator" in clone.call("--help", script=link).stdout


def test_missing_compiler(clone):
    clone.remove("g++")
    assert_one_line(clone.call("simulator"), "missing: g++;", "apt-get install g++")


def test_everything_that_is_missing_is_in_one_line(clone):
    for name in ("g++", "cmake", "make", "python3"):
        clone.remove(name)
    assert_one_line(clone.call("build"), "missing: g++, cmake, make, python3;", "g++ cmake make python3 python3-venv")


def test_python_without_venv_and_headers(clone):
    clone.fake_python("cpython 3.11", "3.11 False False")
    assert_one_line(clone.call("simulator"), "apt-get install python3.11-venv python3.11-dev")


def test_python_without_wheels(clone):
    clone.fake_python("cpython 3.15", "3.15 True True")
    assert_one_line(clone.call("simulator"), "cpython 3.15", "3.10 to 3.14", "remedy: install one of these")
    clone.fake("python3.14", "exit 0")
    clone.fake("python3.10", "exit 0")
    clone.fake("python3.11", "exit 127")
    assert_one_line(clone.call("simulator"), "remedy: call with PYTHON=python3.14 or PYTHON=python3.10\n")


def test_processor_without_wheels(clone):
    clone.fake("uname", "case $1 in -s) echo Linux;; *) echo aarch64;; esac")
    assert_one_line(clone.call("simulator"), "aarch64", "remedy: install ROS 2 Jazzy")


STRANGE = ("a&b", "a|b", "a'b", "a(b)", "a:b", "a,b", "a;b", 'a"b', "a$b", "a\nb", "a`b", "a#b", "a%b", "a[b]", "Büro")


@pytest.mark.parametrize("name", STRANGE)
def test_a_path_with_which_no_build_succeeds(tmp_path, name):
    """Nothing is set up that would only fail in the end, and an environment that was moved there is not spoilt."""
    clone = Clone(tmp_path / name / "sbs_sim", tmp_path / "home", tmp_path / "tools")
    script = clone.folder / ".venv" / "bin" / "pytest"
    script.parent.mkdir(parents=True)
    script.write_text("#!/before/.venv/bin/python\n")
    result = clone.call("simulator")
    assert result.returncode == 1
    assert "in its name, with which CMake or colcon fails; remedy: move it" in result.stderr
    assert script.read_text() == "#!/before/.venv/bin/python\n"


@pytest.mark.parametrize("name", ["a b", "a+b=c@d~e-f_g.h"])
def test_other_paths_are_taken(tmp_path, name):
    clone = Clone(tmp_path / name / "sbs_sim", tmp_path / "home", tmp_path / "tools")
    clone.remove("g++")  # what is looked for next
    assert_one_line(clone.call("simulator"), "missing: g++;")


@pytest.mark.parametrize("answer", ["exit 1", "echo glibc 2.27"])
def test_c_library_without_wheels(clone, answer):
    clone.fake("getconf", answer)
    assert_one_line(clone.call("simulator"), "glibc 2.28")


def test_without_network_a_half_made_environment_does_not_count(clone):
    pytest.importorskip("ensurepip")
    # As if a first call had been killed while pip was at work.
    leftover = clone.folder / ".venv" / "lib" / "half a package"
    leftover.mkdir(parents=True)
    unreachable = {
        "PYTHON": sys._base_executable,
        "PIP_CONFIG_FILE": os.devnull,
        "PIP_INDEX_URL": "http://127.0.0.1:9/simple",
        "PIP_RETRIES": "0",
    }
    result = clone.call("simulator", **unreachable)
    assert result.returncode == 1
    progress, error = result.stderr.splitlines()
    assert "setting up" in progress
    assert "no network" in error
    assert "remedy: connect" in error
    assert Path(error.rpartition("see ")[2]).read_text()
    assert not leftover.exists()
    # What pip left is not taken for an environment by the next call either.
    assert not (clone.folder / ".venv" / ".run" / "stamp").exists()


def test_every_requirement_is_pinned():
    for path in [*(ROOT / "requirements").glob("*.txt"), ROOT / "docs" / "requirements.txt"]:
        for line in path.read_text().splitlines():
            if line and not line.startswith("#"):
                assert re.fullmatch(r"[\w.-]+==[\w.]+( ; python_version (<|>=) \"3\.\d+\")?", line), line
