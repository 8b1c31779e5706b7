"""Sweeps and batches on a dask cluster of separate processes, one of which is killed half way."""

import os
import signal
import socket
import subprocess
import sys
import textwrap

import numpy as np
import pytest
from test_commands import output

from sbs_sim import Aircraft, Case, simulate_batch, sweep
from sbs_sim.concurrency.cluster import _call, _versions
from sbs_sim.errors import ClusterError
from sbs_sim.model.wind import Wind

distributed = pytest.importorskip("distributed")


@pytest.fixture(scope="module")
def cluster():
    """Two workers on loopback; one that dies comes again."""
    options = {"n_workers": 2, "threads_per_worker": 1, "processes": True}
    with distributed.LocalCluster(host="127.0.0.1", dashboard_address=None, silence_logs=50, **options) as cluster:
        yield cluster


@pytest.fixture(scope="module")
def address(cluster):
    return cluster.scheduler_address


@pytest.fixture
def custom(tmp_path, sbs):
    """An aircraft whose airfoil is a file beside it, which is read anew where the aspect ratio changes."""
    rows = ["reynolds,alpha_deg,cl,cd"]
    rows += [f"{re},{a},{0.1 * a},{0.01 + 1e-4 * a * a}" for re in (1e5, 1e6) for a in range(-12, 13)]
    (tmp_path / "short.csv").write_text("\n".join(rows) + "\n")
    rotors = [{**rotor, "airfoil": "short"} for rotor in sbs.data["rotors"]]
    return Aircraft.from_dict({**sbs.data, "rotors": rotors}, tmp_path)


def workers_of(address):
    with distributed.Client(address, set_as_default=False) as client:
        return client.run(os.getpid)


def assert_same(one, other):
    for here, there in zip(one.points, other.points, strict=True):
        assert (here.value, here.error) == (there.value, there.error)
        if here.model is not None:
            assert here.trim.state.tobytes() == there.trim.state.tobytes()
            assert here.model.a.tobytes() == there.model.a.tobytes()


def test_a_sweep_is_the_same_when_a_worker_is_killed_half_way(sbs, address):
    values = [*np.linspace(-4.0, 20.0, 15), 500.0]  # the last has no trim
    victims = list(workers_of(address).values())
    reported = []

    def progress(point, done, total):
        reported.append((done, total))
        if done == 4:
            os.kill(victims[0], signal.SIGKILL)

    far = sweep(sbs, "airspeed", values, dask=address, progress=progress)
    assert reported == [(i + 1, 16) for i in range(16)]
    assert len(far.failed) == 1
    assert_same(far, sweep(sbs, "airspeed", values))
    assert victims[0] not in workers_of(address).values()


def test_a_batch_is_the_same_and_needs_no_files_of_the_aircraft(custom, cluster):
    cases = [
        Case(
            custom,
            {"airspeed": 12.0},
            wind=Wind(turbulence_intensity=(1.5, 1.5, 1.5), turbulence_seed=i),
            changes={"body.mass": 20.0 + i, "rotors.chord.root": 0.05 + 0.001 * i},
        )
        for i in range(3)
    ]
    cases.append(Case(custom, {"airspeed": 12.0}, lambda time: np.full(4, 0.01 * time), changes={"body.mass": 0.0}))
    cases.append(Case(custom, {"airspeed": 12.0}, lambda time: np.full(4, 0.01 * time)))
    with distributed.Client(cluster, set_as_default=False) as client:
        far = simulate_batch(cases, 0.2, dask=client)
        assert client.status == "running"  # it is the caller's
    here = simulate_batch(cases, 0.2)
    assert here.errors == far.errors
    assert here.failed == (3,)
    for name, values in here.histories.items():
        assert values.tobytes() == far.histories[name].tobytes()


def test_a_sweep_on_a_cluster_can_be_cancelled(sbs, address):
    reported = []
    found = sweep(
        sbs,
        "airspeed",
        np.linspace(0.0, 20.0, 40),
        dask=address,
        progress=lambda point, *_: reported.append(point.value),
        cancelled=lambda: len(reported) >= 2,
    )
    assert 2 <= len(reported) < 40
    assert [point.value for point in found.points if point.error is None] == sorted(reported)
    assert {point.error for point in found.points} == {None, "cancelled"}


def test_commands_print_the_same_with_a_cluster(address):
    for call in (
        ("sweep", "airspeed", 0, 4, 2, "--azimuth-count", 3, "--trims-only"),
        ("batch", "--flights", 3, "--duration", 0.2, "--azimuth-count", 3, "--spread", "body.mass=0.05"),
    ):
        assert output(*call, "--dask", address) == output(*call)


@pytest.mark.parametrize(
    ("other", "said"),
    [
        ({"numba": "0.1"}, "numba: 0.1 where it is asked, {numba} here"),
        ({"sources": "0"}, "sources: 0 where it is asked, {sources} here"),
    ],
)
def test_a_worker_with_other_versions_is_refused_by_name(address, other, said):
    with distributed.Client(address, set_as_default=False) as client:
        error = client.submit(_call, {**_versions(), **other}, b"", b"", b"", pure=False).exception()
    assert isinstance(error, ClusterError)
    assert str(error).startswith("dask: worker tcp://127.0.0.1:")
    assert f" would give other bits: other {said.format(**_versions())}" in str(error)
    assert len(str(error)) < 240


def test_an_address_where_nobody_answers_is_reported_in_one_line(sbs):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))  # it does not listen
        address = f"tcp://127.0.0.1:{taken.getsockname()[1]}"
        for wrong in (address, "invalid", "", 3):
            with pytest.raises(ClusterError) as caught:
                sweep(sbs, "airspeed", [0.0], dask=wrong)
            assert str(caught.value) == f"dask = {wrong!r}: no scheduler answers there; allowed are tcp://HOST:PORT"


def test_without_dask_there_is_one_line():
    code = """
        import sys
        sys.modules["distributed"] = None  # what an import finds that is not installed
        from sbs_sim import Aircraft, sweep
        from sbs_sim.errors import ClusterError
        try:
            sweep(Aircraft.load("sbs"), "airspeed", [0.0], dask="tcp://127.0.0.1:8786")
        except ClusterError as error:
            print(error)
    """
    found = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(code)], capture_output=True, text=True, timeout=120, check=True
    )
    assert found.stdout.startswith("dask = 'tcp://127.0.0.1:8786': needs dask.distributed: pip install distributed (")
    assert found.stdout.count("\n") == 1
