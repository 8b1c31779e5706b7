"""The tests with the ROS 2 wheels of several distributions, each in a fresh clone of what is committed.

    ./run python tools/robustness/test_distributions.py
    ./run python tools/robustness/test_distributions.py --wheels kilted -- test/nodes/test_nodes.py

Without tests of your own those run that use ROS: nodes, logs, cockpit and packaging. For each distribution it prints
what it flew with and the last line of pytest. The exit code is 1 if something does not build or a test fails.
"""

import argparse
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
ROS_TESTS = (
    "test/nodes",
    "test/recording",
    "test/cockpit",
    "test/library/test_run_built.py",
    "test/library/test_robot.py",
)
# of the shell that this was called in, which has one ROS already
OWN = (
    "ROS_",
    "SBS_SIM_",
    "AMENT_",
    "COLCON_",
    "CMAKE_PREFIX",
    "PYTHONPATH",
    "LD_LIBRARY_PATH",
    "FASTRTPS_",
    "FASTDDS_",
)
LOOK = """
import importlib.metadata as packages, os, rclpy
names = [f"ros-{d}{name}" for d in ("", os.environ["ROS_DISTRO"] + "-") for name in ("rclpy", "fastrtps", "fastdds")]
found = {item.metadata["Name"]: item.version for item in packages.distributions()}
print(", ".join(f"{name} {found[name]}" for name in names if name in found) or rclpy.__file__)
"""


def main() -> int:
    """Build and test with one distribution after the other."""
    parser = argparse.ArgumentParser(description="Build and test with the ROS 2 wheels of several distributions.")
    known = sorted(path.stem.removeprefix("ros-") for path in (ROOT / "requirements").glob("ros-*.lock"))
    parser.add_argument("--wheels", nargs="+", default=known, choices=known, help=f"default: {' '.join(known)}")
    parser.add_argument("--folder", type=Path, help="for the clones, which are kept (default: a temporary one)")
    parser.add_argument("tests", nargs="*", default=ROS_TESTS, help="arguments for pytest, after --")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        folder = options.folder or Path(temporary)
        passed = [_tried(wheels, folder / wheels, options.tests) for wheels in options.wheels]
    return int(not all(passed))


def _tried(wheels: str, place: Path, tests: list[str]) -> bool:
    """True if everything holds with the wheels of a distribution; what was seen is printed."""
    environment = {name: value for name, value in os.environ.items() if not name.startswith(OWN)}
    environment["ROS_DISTRO_WHEELS"] = wheels
    begin = time.monotonic()

    def run(*command: str) -> subprocess.CompletedProcess[str]:
        where = place if place.exists() else ROOT
        joined = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
        return subprocess.run(command, cwd=where, env=environment, check=False, **joined)

    if not place.exists():
        run("git", "clone", "--quiet", str(ROOT), str(place))
    built = run("./run", "build")
    if built.returncode:
        print(f"{wheels}: does not build\n{built.stdout}", flush=True)
        return False
    browser = ("--no-deps", "--require-hashes", "-r", "requirements/browser.lock")
    run("./run", "python", "-m", "pip", "install", "--quiet", *browser)  # without it the tests of the page are left out
    versions = run("./run", "python", "-c", LOOK).stdout.strip()
    print(f"{wheels}: {versions}, built after {time.monotonic() - begin:.0f} s", flush=True)
    found = run("./run", "test", "-q", *tests)
    if found.returncode:
        sys.stderr.write(found.stdout)
    print(
        f"{wheels}: {found.stdout.rstrip().rpartition(chr(10))[2]}, {time.monotonic() - begin:.0f} s in all", flush=True
    )
    return found.returncode == 0


if __name__ == "__main__":
    sys.exit(main())
