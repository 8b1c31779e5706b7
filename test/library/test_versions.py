"""What decides the bits of a result is named as it is, and a difference of it in one short line."""

import json
import os
import shutil
import subprocess
import sys

import pytest
from llvmlite import binding

from sbs_sim.versions import PACKAGE, differences, in_words, source_digest, surroundings, versions

CODE = "import json; from sbs_sim.versions import *; print(json.dumps([versions(), surroundings()]))"


def told_in(**environment):
    """Versions and surroundings of a process."""
    kept = {name: value for name, value in os.environ.items() if not name.startswith("NUMBA_")}
    found = subprocess.run(
        [sys.executable, "-c", CODE],
        env={**kept, **environment},
        capture_output=True,
        text=True,
        check=True,
        timeout=60,
    )
    return json.loads(found.stdout)


def test_the_target_is_the_hosts_unless_the_environment_says_otherwise():
    _, here = told_in()
    assert here["target"] == binding.get_host_cpu_name()
    assert here["optimisation"] == "O3"


@pytest.mark.parametrize(
    ("environment", "changed"),
    [
        ({"NUMBA_CPU_NAME": "haswell", "NUMBA_CPU_FEATURES": ""}, {"target": "haswell"}),
        ({"NUMBA_OPT": "0"}, {"optimisation": "O0"}),
        ({"NUMBA_DISABLE_JIT": "1"}, {"target": "interpreter", "optimisation": ""}),
    ],
)
def test_what_the_environment_sets_is_reported_and_decides_nothing(environment, changed):
    own, around = told_in()
    assert told_in(**environment) == [own, {**around, **changed}]


def test_the_same_versions_differ_in_nothing_wherever_they_are():
    recorded = {**versions(), **surroundings()}
    assert differences(recorded) == {}
    elsewhere = {"target": "another", "machine": "Linux aarch64", "libc": "musl 1.2", "python": "3.14.0"}
    assert differences({**recorded, **elsewhere, "cpu_features": "of an older log"}) == {}


def test_what_is_not_known_differs():
    assert set(differences({})) == set(versions())
    assert in_words("numba", "", "0.68.1") == "other numba: unknown recorded, 0.68.1 here"


# --- the digest of sources --------------------------------------------------------------------------------------

SOURCE = '''
"""Module."""
import math

SPEED: float = 2.0

def double(x):
    """Twice."""
    return 2.0 * x  # a comment
'''


def digest_of(tmp_path, text):
    path = tmp_path / f"{len(list(tmp_path.iterdir()))}.py"
    path.write_text(text)
    return source_digest([path])


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("# a comment", "# another"),
        ('"""Twice."""', '"""Two times."""\n    "and more"'),
        ('"""Module."""', ""),
        ("    return", "\n\n    return"),
        ("2.0 * x ", "(2.00 * (x)) "),
    ],
)
def test_what_only_readers_see_does_not_change_the_digest(tmp_path, old, new):
    assert digest_of(tmp_path, SOURCE.replace(old, new)) == digest_of(tmp_path, SOURCE)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("2.0 * x", "x * 2.0"),
        ("2.0 * x", "2 * x"),
        ("2.0 * x", "2.0000000000000004 * x"),
        ("2.0 * x", "2.0 + x"),
        ("2.0 * x", "-(2.0 * x)"),
        ("SPEED: float = 2.0", "SPEED: float"),
        ("import math", "import cmath as math"),
        ("return 2.0 * x", "return 2.0 * x, None"),
    ],
)
def test_what_is_computed_changes_the_digest(tmp_path, old, new):
    assert digest_of(tmp_path, SOURCE.replace(old, new)) != digest_of(tmp_path, SOURCE)


def test_every_source_of_the_model_is_in_the_digest(tmp_path):
    shutil.copytree(PACKAGE, tmp_path / "sbs_sim", ignore=shutil.ignore_patterns("__pycache__"))
    code = "import sbs_sim.versions as v; v.PACKAGE = v.Path({!r}); print(v.versions()['model_sources'])"

    def digest():
        command = [sys.executable, "-c", code.format(str(tmp_path / "sbs_sim"))]
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()

    assert digest() == versions()["model_sources"]
    for name in ("lanes/compiled.py", "model/dynamics.py"):
        before = digest()
        with (tmp_path / "sbs_sim" / name).open("a") as file:
            file.write("\n\nMORE = 1\n")
        assert digest() != before
