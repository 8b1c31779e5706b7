"""The entry script ./run on a tree that is built: what a shell and Python find there, and what if it is read only."""

import os
import shutil
import signal
import subprocess
import time
from pathlib import Path

import pytest

pytest.importorskip("rclpy")

from ros_harness import DOMAINS

ROOT = Path(__file__).resolve().parents[2]
DISTRIBUTION = os.environ.get("ROS_DISTRO")  # whose wheels ./run has set up
pytestmark = pytest.mark.skipif(
    os.environ.get("SBS_SIM_RUN") != f"private:{ROOT}", reason="the private environment of ./run is not what tests it"
)
# In a mount namespace of its own: what is read only there is so for nobody else.
READ_ONLY = 'mount --bind "$0" "$0" && mount -o remount,bind,ro "$0" && exec "$@"'
UNSHARE = ["unshare", "--mount", *([] if os.geteuid() == 0 else ["--map-root-user"])]


def environment(home, **more):
    """Environment of somebody who has just logged in."""
    return {"PATH": os.defpath, "HOME": str(home), "TERM": "dumb", "LC_ALL": "C", **more}


def call(home, *arguments, prefix=(), **more):
    """Execute ./run in the home of somebody."""
    return subprocess.run(
        [*prefix, str(ROOT / "run"), *arguments],
        env=environment(home, **more),
        cwd=home,
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )


def in_shell(home, command, **more):
    """Standard output of an interactive ./run shell."""
    found = call(home, "shell", "-ic", command, **more)
    assert found.returncode == 0, found.stderr
    return found.stdout.split()


def test_the_shell_finds_ros_whatever_the_users_own_start_up_does(tmp_path):
    """A stand-in for Python before all others on the path, as pyenv has it, another ROS 2, an alias."""
    (tmp_path / "shims").mkdir()
    for name in ("python", "python3"):
        shim = tmp_path / "shims" / name
        shim.write_text("#!/bin/sh\necho the wrong one\nexit 1\n")
        shim.chmod(0o755)
    (tmp_path / "other" / "rclpy").mkdir(parents=True)
    (tmp_path / "other" / "rclpy" / "__init__.py").write_text("raise ImportError('of another Python')")
    (tmp_path / ".bashrc").write_text(
        'export PATH="$HOME/shims:$PATH" PYTHONPATH="$HOME/other:$PYTHONPATH" ROS_DISTRO=humble\n'
        "alias python3=false\npython() { false; }\nexport OWN=kept\n"
    )
    look = "import rclpy, sbs_msgs.msg, os; print(rclpy.__file__, os.environ['OWN'], os.environ['ROS_DISTRO'])"
    for python in ("python", "python3"):
        place, own, distribution = in_shell(tmp_path, f'{python} -c "{look}"')
        assert Path(place).is_relative_to(ROOT / ".venv")
        assert (own, distribution) == ("kept", DISTRIBUTION)


def test_the_shell_has_what_tools_of_ros_ask_for(tmp_path):
    words = "$ROS_DISTRO $ROS_VERSION $ROS_PYTHON_VERSION $ROS_PYTHON_CHECK_FIELDS"
    assert in_shell(tmp_path, f"echo {words}") == [DISTRIBUTION, "2", "3", "1"]
    # and a shell of another folder is no sourced ROS 2
    inner = {"ROS_DISTRO": DISTRIBUTION, "SBS_SIM_RUN": "private:/elsewhere", "ROS_PYTHON_CHECK_FIELDS": "0"}
    code = "import os; print(*map(os.environ.get, ('SBS_SIM_RUN', 'ROS_PYTHON_CHECK_FIELDS')))"
    found = call(tmp_path, "python", "-c", code, **inner)
    assert found.stdout.split() == [f"private:{ROOT}", "0"]


def test_a_tree_that_cannot_be_written_flies_all_the_same(tmp_path):
    """Its logs go where the user is, and the kernels are not compiled again."""
    prefix = [*UNSHARE, "sh", "-c", READ_ONLY, str(ROOT)]
    if subprocess.run([*prefix, "true"], capture_output=True, check=False).returncode:
        pytest.skip("this machine gives processes no mounts of their own")
    refused = call(tmp_path, "python", "-c", f"open({str(ROOT / 'new')!r}, 'w')", prefix=prefix)
    assert "Read-only file system" in refused.stderr
    process = subprocess.Popen(
        [*prefix, str(ROOT / "run"), "simulator"],
        env=environment(tmp_path, ROS_DOMAIN_ID=str(next(DOMAINS))),
        cwd=tmp_path,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        lines = iter(process.stderr.readline, "")
        assert any("recording bags/" in line for line in lines)
        time.sleep(1.0)
        process.send_signal(signal.SIGINT)
        assert process.wait(60) == 0
    finally:
        process.kill()
        process.wait()
        process.stderr.close()
    assert list((tmp_path / "bags").glob("*.mcap"))
    assert list((tmp_path / ".ros" / "log").iterdir())
    here = {path.name for path in (ROOT / "sbs_sim" / "model").glob("__pycache__/kernels-*/*/*.nbc")}
    copied = {path.name for path in (tmp_path / ".cache" / "sbs_sim").glob("kernels-*/*/*.nbc")}
    assert copied
    assert copied <= here  # copied, not compiled: nothing is there that is not here


def test_a_tree_that_cannot_be_written_and_is_not_built_is_reported(tmp_path):
    copy = tmp_path / "sbs_sim"
    copy.mkdir()
    for name in ("run", "setup.py", "setup.cfg", "package.xml", "colcon_defaults.yaml"):
        shutil.copy(ROOT / name, copy)
    shutil.copytree(ROOT / "resource", copy / "resource")
    prefix = [*UNSHARE, "sh", "-c", READ_ONLY, str(copy)]
    if subprocess.run([*prefix, "true"], capture_output=True, check=False).returncode:
        pytest.skip("this machine gives processes no mounts of their own")
    for made in ((), ("log/run", ".cache/tmp", "build")):  # as if it had been built before by somebody else
        for name in made:
            (copy / name).mkdir(parents=True)
        command = [*prefix, str(copy / "run"), "simulator"]
        ended = subprocess.run(command, env=environment(tmp_path), capture_output=True, text=True, check=False)
        assert ended.returncode == 1
        assert ended.stderr.startswith(f"run: cannot write into {copy}, which is not built or has changed since;")
        assert "remedy: clone into a folder of your own" in ended.stderr
        assert ended.stderr.count("\n") == 1
