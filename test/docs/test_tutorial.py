"""docs/tutorial.md: what can be tried without a running simulator works as it stands there."""

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
TEXT = (ROOT / "docs" / "tutorial.md").read_text()
EXECUTABLES = ROOT / "install" / "sbs_sim" / "lib" / "sbs_sim"
PYTHON = re.findall(r"```python\n(.*?)```", TEXT, re.DOTALL)
COMMANDS = [
    line for block in re.findall(r"```sh\n(.*?)```", TEXT, re.DOTALL) for line in block.splitlines() if line.strip()
]


@pytest.fixture
def folder(tmp_path):
    """A folder to write in that has the logs."""
    (tmp_path / "bags").symlink_to(ROOT / "bags")
    return tmp_path


def test_there_is_something_to_try():
    assert len(PYTHON) >= 5
    assert len(COMMANDS) >= 5


def test_the_python_blocks_run_one_after_the_other(folder):
    result = subprocess.run(
        [sys.executable, "-c", "\n".join(PYTHON)], cwd=folder, capture_output=True, text=True, timeout=120, check=False
    )
    assert result.returncode == 0, result.stderr
    assert "38 states: u w q theta v p phi r\n" in result.stdout
    printed = dict(re.findall(r"^(.*): .* doubles in (.*) s$", result.stdout, re.MULTILINE))
    reported = re.search(r"a phugoid and a Dutch roll that grow, doubling in (\S+) and (\S+) s", TEXT)
    assert printed == {"phugoid": reported[1], "Dutch roll": reported[2]}
    north, height = re.search(r"after 8 s at north (\S+) m, height (\S+) m", result.stdout).groups()
    assert float(north) == pytest.approx(2.0, abs=0.1)
    assert float(height) == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize("line", COMMANDS)
def test_the_commands_run(folder, line):
    script, name, *arguments = shlex.split(line)
    assert script == "./run"
    result = subprocess.run(
        [sys.executable, EXECUTABLES / name, *arguments],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert result.returncode == 0, result.stderr
    assert result.stdout


def test_executables_that_it_names_exist():
    names = set(re.findall(r"\./run ([a-z_]+)", TEXT)) - {"build", "shell", "python", "test"}
    assert names
    assert [name for name in sorted(names) if not (EXECUTABLES / name).exists()] == []


def test_its_links_lead_somewhere():
    for target in re.findall(r"\]\(([^)#]+)\)", TEXT):
        assert (ROOT / "docs" / target).exists(), target
