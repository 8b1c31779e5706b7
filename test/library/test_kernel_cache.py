"""Where compiled kernels are kept: nothing is taken from a folder that others can write into."""

import os
import pickle
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from numba.core.caching import UserProvidedCacheLocator

from sbs_sim.model import kernel_cache
from sbs_sim.model.ground import lowest_point
from sbs_sim.model.kernel_cache import refusal

ROOT = Path(__file__).resolve().parents[2]
STRANGER = 12345
ROOT_ONLY = pytest.mark.skipif(os.geteuid() != 0, reason="only root can give files away")
# The smallest kernel: it is compiled within a second.
CODE = """
import numpy as np
from sbs_sim import Aircraft
from sbs_sim.model.ground import lowest_point
state = np.zeros(49)
state[2:4] = -30.0, 1.0
out = np.zeros((1, 1))
model = Aircraft.load("sbs").model()
lowest_point(model.ground, model.rotors, state[:, np.newaxis], out)
print(out[0, 0])
"""

RESULT = "-29.934\n"  # the rotor planes are 0.066 m below the centre of gravity
LINE = lowest_point.py_func.__code__.co_firstlineno
INDEX = f"ground.lowest_point-{LINE}.py{sys.version_info[0]}{sys.version_info[1]}.nbi"


class Bomb:
    """What is pickled here makes a file when it is unpickled."""

    def __init__(self, mark):
        self.mark = mark

    def __reduce__(self):
        return Path.touch, (self.mark,)


@pytest.fixture
def folder(tmp_path):
    """Folder of this user alone with a file in a folder in it, as numba has them."""
    made = tmp_path / "cache"
    (made / "model_x").mkdir(parents=True, mode=0o700)
    made.chmod(0o755)
    (made / "model_x").chmod(0o755)
    (made / "model_x" / "a.nbi").touch(mode=0o600)
    return made


def test_a_folder_of_ones_own_is_trusted(folder):
    assert refusal(folder, folder.parents) == ""


@pytest.mark.parametrize("part", ["", "model_x", "model_x/a.nbi"])
@pytest.mark.parametrize(("bits", "who"), [(0o020, "group "), (0o002, "everybody")])
def test_what_others_may_write_is_not(folder, part, bits, who):
    place = folder / part
    place.chmod(place.stat().st_mode | bits)
    found = refusal(folder, folder.parents)
    assert found.startswith(f"{place}: {who}")
    assert "\n" not in found


@pytest.mark.parametrize("part", ["model_x", "model_x/a.nbi"])
def test_where_others_do_not_get_in_modes_do_not_matter(folder, part):
    (folder / part).chmod(0o777)
    folder.chmod(0o700)
    assert refusal(folder, folder.parents) == ""


@ROOT_ONLY
@pytest.mark.parametrize("part", ["", "model_x", "model_x/a.nbi"])
def test_what_belongs_to_others_is_not(folder, part):
    folder.chmod(0o700)
    os.chown(folder / part, STRANGER, -1)
    assert refusal(folder, folder.parents).startswith(f"{folder / part}: user {STRANGER} may write")


def test_a_folder_in_which_it_could_be_exchanged_is_not(folder):
    folder.parent.chmod(0o777)
    assert refusal(folder, folder.parents).startswith(f"{folder.parent}: everybody")
    folder.parent.chmod(0o1777)  # as /tmp: others cannot rename what is ours
    assert refusal(folder, folder.parents) == ""


def test_who_may_change_the_sources_is_trusted_with_the_folder_beside_them(folder):
    folder.parent.chmod(0o775)
    assert refusal(folder, [folder.parent]).startswith(f"{folder.parent}: group")
    assert refusal(folder, [folder.parent], [folder.parent]) == ""
    folder.chmod(0o777)
    assert refusal(folder, [folder.parent], [folder.parent]).startswith(f"{folder}: everybody")


# --- whole processes --------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def package(tmp_path_factory):
    """Folder with a copy of the package, which keeps nothing yet."""
    place = tmp_path_factory.mktemp("package")
    shutil.copytree(ROOT / "sbs_sim", place / "sbs_sim", ignore=shutil.ignore_patterns("__pycache__"))
    (place / "config").symlink_to(ROOT / "config")
    return place


def plant(place, mark, mode):
    """A folder of kernels as a stranger would make it, each index of it with a surprise."""
    folder = place / f"kernels-{kernel_cache.source_digest()}"
    source = mark.parent / "sbs_sim" / "model" / "ground.py"
    subfolder = folder / UserProvidedCacheLocator.get_suitable_cache_subpath(str(source))
    subfolder.mkdir(parents=True)
    (subfolder / INDEX).write_bytes(pickle.dumps(Bomb(mark)))
    folder.chmod(mode)


def run_with(package, chosen, home):
    """Result of a process of the copy with these folders for caches."""
    started = start_with(package, chosen, home, CODE)
    output, errors = started.communicate()
    return subprocess.CompletedProcess(started.args, started.returncode, output, errors)


def start_with(package, chosen, home, code):
    """A process of the copy with these folders for caches."""
    folders = {"NUMBA_CACHE_DIR": str(chosen), "XDG_CACHE_HOME": str(home), "TMPDIR": str(package)}
    return subprocess.Popen(
        [sys.executable, "-c", code],
        env={**os.environ, **folders, "PYTHONPATH": f"{package}:{os.environ.get('PYTHONPATH', '')}"},
        cwd=package,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def test_of_processes_that_need_the_same_at_once_one_compiles(package, tmp_path):
    code = CODE + "print(sum(lowest_point.stats.cache_misses.values()))"
    started = [start_with(package, tmp_path / "chosen", tmp_path / "home", code) for _ in range(4)]
    outputs = [process.communicate() for process in started]
    assert [output.splitlines()[0] + "\n" for output, _ in outputs] == [RESULT] * 4, outputs
    assert sorted(int(output.splitlines()[1]) for output, _ in outputs) == [0, 0, 0, 1]


@pytest.mark.parametrize("mode", [0o700, 0o777])
def test_what_a_stranger_has_put_there_is_not_executed(package, tmp_path, mode):
    mark = package / f"executed_{mode:o}"
    chosen, home = tmp_path / "chosen", tmp_path / "home"
    plant(chosen / "sbs_sim", mark, mode)
    result = run_with(package, chosen, home)
    assert mark.exists() == (mode == 0o700), result.stderr  # in a folder of ones own it is: the surprise is one
    if mode == 0o777:
        assert result.stdout == RESULT
        (line,) = result.stderr.splitlines()
        assert f"{chosen}/sbs_sim/kernels-" in line
        assert "kept in " in line


def test_without_a_folder_to_trust_every_process_compiles_and_says_so(package, tmp_path):
    mark = package / "executed"
    chosen, home = tmp_path / "chosen", tmp_path / "home"
    beside = package / "sbs_sim" / "model" / "__pycache__"
    for folder in beside.glob("kernels-*"):
        shutil.rmtree(folder)
    for place in (chosen / "sbs_sim", home / "sbs_sim", beside):
        plant(place, mark, 0o777)
    result = run_with(package, chosen, home)
    assert result.stdout == RESULT, result.stderr
    (line,) = result.stderr.splitlines()
    assert "compiled anew by every process" in line
    assert line.count("everybody may write there") == 3
    assert "NUMBA_CACHE_DIR" in line
    assert not mark.exists()
    assert not list(package.glob("sbs_sim-*"))  # the folder for temporary files is everybody's
