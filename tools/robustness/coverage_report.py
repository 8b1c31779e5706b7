"""Measure which lines and branches of the package the tests execute, and name those that they do not.

    ./run python tools/robustness/coverage_report.py [--nodes] [--lines] [TEST ...]

TEST are files of the folder test; without any they are all but those that start ROS nodes, which `--nodes` adds. The
executables that tests start are measured too, but for those that a test kills; what it leaves running is interrupted.
Compiled kernels do not show: what numba compiled, Python does not execute. So the quick tests of mutate.py run first
with the kernels as plain Python (NUMBA_DISABLE_JIT), and both count together; a kernel that only a flight executes is
then still named, although it is tested. `--lines` names the lines and the branches, as LINE->LINE, that were not
executed.

A table by folder is printed, and kept with everything else in build/coverage. Exit code 1 if a test fails.
"""

import argparse
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import mutate

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / "build" / "coverage"
# Two names of one file: colcon's symlink install, and the sources.
SETTINGS = f"""
[run]
branch = True
source_pkgs = sbs_sim
parallel = True
patch = subprocess
sigterm = True
data_file = {FOLDER}/data
disable_warnings = no-data-collected, module-not-measured, module-not-imported, couldnt-parse
[paths]
sources =
    {ROOT}/sbs_sim
    */sbs_sim
[report]
exclude_also =
    if TYPE_CHECKING:
    raise NotImplementedError
"""


def main() -> int:
    """Do what the command line asks for; the exit code."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("tests", nargs="*", metavar="TEST")
    parser.add_argument("--nodes", action="store_true", help="also the tests that start ROS nodes")
    parser.add_argument("--lines", action="store_true", help="name what was not executed")
    parser.add_argument("--only-report", action="store_true", help="of the last measurement")
    arguments = parser.parse_args()
    FOLDER.mkdir(parents=True, exist_ok=True)
    (FOLDER / "settings").write_text(SETTINGS)
    code = 0
    if not arguments.only_report:
        _coverage("erase")
        tests = [mutate.located(Path(test).name) for test in arguments.tests] or _files(arguments.nodes)
        for plain in _plain_tests():
            code |= _tests(plain, {"NUMBA_DISABLE_JIT": "1"})
        for test in tests:  # one by one: who interrupts it, and asks for --only-report, keeps what was measured
            code |= _tests([test], {})
    _coverage("combine", "--keep", "--quiet")
    _coverage("json", "--quiet", "-o", str(FOLDER / "report.json"))
    _print(json.loads((FOLDER / "report.json").read_text())["files"], arguments.lines)
    return code


def _files(nodes: bool) -> list[str]:
    """Files of tests, without those that start nodes unless they are asked for."""
    files = sorted((ROOT / "test").glob("*/test_*.py"))
    return [
        str(path.relative_to(ROOT)) for path in files if nodes or "ros_harness" not in path.read_text(encoding="utf-8")
    ]


def _plain_tests() -> list[list[str]]:
    """The tests of the model's modules in mutate.py: in one run those that are selected by nothing but names."""
    chosen = [tests for name, tests in mutate.MODULES.items() if name.startswith("model/")]
    selected = [[mutate.located(test[0]), *test[1:]] for test in chosen if "-k" in test]
    return [sorted({mutate.located(test) for tests in chosen if "-k" not in tests for test in tests}), *selected]


def _tests(tests: list[str], environment: dict[str, str]) -> int:
    """Run tests under measurement; pytest's exit code."""
    command = ["run", "-m", "pytest", "-q", "-n", "0", "-p", "no:cacheprovider", *tests]
    return _coverage(*command, **environment)


def _coverage(*arguments: str, **environment: str) -> int:
    settings = FOLDER / "settings"
    command = [sys.executable, "-m", "coverage", arguments[0], f"--rcfile={settings}", *arguments[1:]]
    return subprocess.run(command, cwd=ROOT, env={**os.environ, **environment}, check=False).returncode


def _print(files: dict[str, Any], lines: bool) -> None:
    """Print the table by folder, and what of each file was not executed."""
    folders: dict[str, list[int]] = {}
    for name, file in sorted(files.items()):
        summary = file["summary"]
        folder = str(Path(name).parent)
        row = folders.setdefault(folder, [0, 0, 0, 0])
        keys = ("covered_lines", "num_statements", "covered_branches", "num_branches")
        for i, key in enumerate(keys):
            row[i] += summary[key]
        if lines and (file["missing_lines"] or file["missing_branches"]):
            alone = [f"{a}->{b}" for a, b in file["missing_branches"] if a not in file["missing_lines"]]
            print(f"{name}: {' '.join([*_ranges(file['missing_lines']), *alone])}")
    for folder, row in [*folders.items(), ("all", [sum(column) for column in zip(*folders.values(), strict=True)])]:
        share = 100 * (row[0] + row[2]) / max(1, row[1] + row[3])
        print(f"{folder:24} lines {row[0]:5} of {row[1]:5}  branches {row[2]:4} of {row[3]:4}  {share:5.1f} %")


def _ranges(lines: list[int]) -> list[str]:
    """Lines with those that follow each other as FIRST-LAST."""
    runs: list[list[int]] = []
    for line in lines:
        if runs and line == runs[-1][1] + 1:
            runs[-1][1] = line
        else:
            runs.append([line, line])
    return [str(first) if first == last else f"{first}-{last}" for first, last in runs]


if __name__ == "__main__":
    sys.exit(main())
