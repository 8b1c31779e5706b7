"""The same bits for every compilation target, level of optimisation and library: a trim, its linear model, a flight.

`tools/robustness/compare_bits.py` compares more, in more ways; docs/robustness.md has its last result.
"""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np

from sbs_sim import Simulation, simulate
from sbs_sim.analysis.kinematics import kinematics
from sbs_sim.analysis.newton import newton
from sbs_sim.flight.trimmed_state import trimmed_state
from sbs_sim.model.airfoil import extend_polar
from sbs_sim.model.elementary import cosine_and_sine
from sbs_sim.model.frames import euler_angles, quaternion_to_euler
from sbs_sim.model.solve import length, product
from sbs_sim.model.wind import Wind

ROOT = Path(__file__).resolve().parents[2]
TOOL = ROOT / "tools" / "robustness" / "compare_bits.py"


# ways that every processor has; another target and optimisation: recording/test_replay.py
WAYS = ("native", "blas-Sandybridge", "numpy-sse")


def test_trims_linear_models_and_flights_have_the_same_bits_in_other_ways():
    """The flight goes through wind, a gust and turbulence."""
    environment = {name: value for name, value in os.environ.items() if not name.startswith(("NUMBA_", "OPENBLAS_"))}
    found = subprocess.run(
        [sys.executable, TOOL, "--kept", "--aircraft", "sbs", "--most", "3", "--ways", *WAYS],
        env=environment, capture_output=True, text=True, check=False, timeout=300,
    )  # fmt: skip
    assert found.returncode == 0, found.stdout + found.stderr
    lines = found.stdout.splitlines()
    assert lines[-1] == f"the same in {len(WAYS)} ways: {', '.join(WAYS)}"
    assert [line.split()[1] for line in lines if line.startswith("sbs ")] == ["trim", "A", "etd"] * len(WAYS)


def test_reported_azimuths_are_those_that_are_flown(sbs, hover):
    simulation = Simulation(sbs, trimmed_state(sbs, hover), hover.swashplate)
    simulation.step = 10_000_003  # some days, so that every rounding shows
    simulation.set_wind(Wind())
    for _ in range(20):
        simulation.advance()
        # the last stage of a step stands where the next one begins
        reported = simulation.azimuths(np.array([simulation.step]))[0]
        assert reported.tobytes() == simulation.engine.tick.psi[:, 0].tobytes()
    every = simulation.azimuths(np.arange(200_000, dtype=np.int64) * 1009)
    assert every.min() >= 0.0
    assert every.max() <= 2.0 * np.pi


def test_angles_reported_together_are_those_of_one_attitude(sbs, hover):
    flown = simulate(sbs, hover, hover.controls, 0.2, wind=Wind(gust=(5.0, 3.0, 2.0), gust_duration=0.2))
    attitudes = flown["state"][:, 3:7]
    angles = np.stack([flown["psi"], flown["theta"], flown["phi"]], axis=1)
    assert angles.tobytes() == np.array([quaternion_to_euler(one) for one in attitudes]).tobytes()
    assert euler_angles(np.empty((0, 4))).shape == (0, 3)


def test_lengths_and_products_are_summed_in_order():
    vector = np.array([1.0, 1e-8, 1e-8, 1e-8])
    total = ((1.0 + 1e-8 * 1e-8) + 1e-8 * 1e-8) + 1e-8 * 1e-8
    assert length(vector) == np.sqrt(total)
    assert np.isnan(length(np.array([1.0, np.nan])))
    assert length(np.full(3, 1e200)) == np.inf
    rng = np.random.default_rng(1)
    left, right = rng.normal(size=(3, 5)), rng.normal(size=(5, 2))
    expected = np.zeros((3, 2))
    for i in range(3):
        for j in range(2):
            for k in range(5):
                expected[i, j] += left[i, k] * right[k, j]
    assert product(left, right).tobytes() == expected.tobytes()
    assert product(np.empty((2, 0)), np.empty((0, 3))).tolist() == [[0.0] * 3] * 2


def refuse(*_, **__):
    raise AssertionError("what rounds as the processor likes it")


def test_no_library_decides_the_bits_of_trims_linear_models_and_polars(sbs, hover, monkeypatch):
    """Neither BLAS and LAPACK nor the sines of numpy and of the system are asked."""
    for name in ("norm", "lstsq", "solve", "inv", "eig", "eigvals", "svd"):
        monkeypatch.setattr(np.linalg, name, refuse)
    for name in ("sin", "cos", "arctan2", "arcsin", "interp", "power"):
        monkeypatch.setattr(np, name, refuse)
    assert newton(lambda x: x * x - 2.0, np.array([1.0])).converged
    alpha, cl, cd = extend_polar(np.radians([-10.0, 0.0, 10.0]), [-1.0, 0.0, 1.0], [0.02, 0.01, 0.03], 10.0)
    assert len(alpha) == len(cl) == len(cd) == 37
    matrix = kinematics(hover.state, sbs.body.inertia, 9.81)
    ct, _ = cosine_and_sine(float(hover.state[3]))
    assert matrix[0, 3] == -9.81 * ct
