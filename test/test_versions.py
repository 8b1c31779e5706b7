"""What decides the bits of a result is named as it is, and a difference of it in one short line."""

import json
import os
import subprocess
import sys

import pytest
from llvmlite import binding

from sbs_sim.versions import differences, in_words, versions

CODE = "import json; from sbs_sim.versions import versions; print(json.dumps(versions()))"


def versions_in(**environment):
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
    here = versions_in()
    assert here["target"] == binding.get_host_cpu_name()
    there = {name for name, has in binding.get_host_cpu_features().items() if has}
    assert set(here["target_features"].split(",")) == there
    assert here["optimisation"] == "O3 vectorized loops"


@pytest.mark.parametrize(
    ("environment", "changed"),
    [
        ({"NUMBA_CPU_NAME": "haswell", "NUMBA_CPU_FEATURES": ""}, {"target": "haswell", "target_features": ""}),
        ({"NUMBA_CPU_NAME": "haswell"}, {"target": "haswell"}),  # keeps the features of the host
        ({"NUMBA_CPU_FEATURES": "+avx,-avx2,+fma"}, {"target_features": "avx,fma"}),
        ({"NUMBA_OPT": "0"}, {"optimisation": "O0 vectorized loops"}),
        ({"NUMBA_LOOP_VECTORIZE": "0", "NUMBA_SLP_VECTORIZE": "1"}, {"optimisation": "O3 vectorized straight lines"}),
        ({"NUMBA_DISABLE_JIT": "1"}, {"target": "interpreter", "target_features": "", "optimisation": ""}),
    ],
)
def test_what_the_environment_sets_is_told(environment, changed):
    assert versions_in(**environment) == {**versions_in(), **changed}


def test_the_same_versions_differ_in_nothing():
    assert differences(versions()) == {}


def test_logs_that_named_the_host_are_compared_by_it():
    recorded = versions()
    recorded["cpu"], recorded["cpu_features"] = recorded.pop("target"), recorded.pop("target_features")
    del recorded["optimisation"]
    assert differences(recorded) == {}
    assert differences({**recorded, "cpu": "another"}) == {"target": ("another", versions()["target"])}


def test_what_is_not_known_differs():
    assert set(differences({})) == set(versions())
    assert in_words("numba", "", "0.68.1") == "other numba: unknown recorded, 0.68.1 here"


def test_many_features_are_told_in_one_short_line():
    many = ",".join(f"feature{i}" for i in range(90))
    line = in_words("target_features", many, "feature1,another")
    assert line == (
        "other target_features: feature0, feature10, feature11 and 86 more only recorded, another only here"
    )
