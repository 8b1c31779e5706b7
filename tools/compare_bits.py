"""Digests of trims, linear models, flights and batches, compiled in several ways: all must be the same.

    ./run python tools/compare_bits.py [--ways host haswell plain]

Every way compiles the model anew for another target or with another optimisation, and lets numpy and BLAS take other
code. The exit code is 1 if a digest differs, or if a flight in a batch differs from the flight by itself.
"""

import argparse
import hashlib
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np

from sbs_sim import Aircraft, Case, linearize, simulate, simulate_batch, trim
from sbs_sim.model.wind import Wind

ROOT = Path(__file__).resolve().parents[1]
AIRCRAFT = ("sbs", "sbs_paper", *(str(ROOT / f"test/data/{name}.yaml") for name in ("tail_rotor", "tandem", "uh60a")))
AVX2 = {"OPENBLAS_CORETYPE": "Haswell", "NPY_DISABLE_CPU_FEATURES": "AVX512F AVX512CD AVX512_SKX"}
WAYS: dict[str, dict[str, str]] = {
    "host": {},
    "haswell": {"NUMBA_CPU_NAME": "haswell", "NUMBA_CPU_FEATURES": "", **AVX2},
    "plain": {"NUMBA_CPU_NAME": "x86-64-v3", "NUMBA_CPU_FEATURES": "+avx2,+fma", "NUMBA_OPT": "1", **AVX2},
}
SPEED, SECONDS = 5.0, 0.5  # m/s, s of each flight
AIR = Wind(turbulence_intensity=(1.0, 1.0, 1.0), turbulence_seed=3)


def main() -> int:
    """Compare the ways, or print the digests of this process."""
    parser = argparse.ArgumentParser(description="Compare the bits of results that are compiled in several ways.")
    parser.add_argument("--ways", nargs="+", choices=WAYS, default=list(WAYS))
    parser.add_argument("--print", action="store_true", help="print the digests of this process")
    options = parser.parse_args()
    if options.print:
        for name in AIRCRAFT:
            print(Path(name).stem, *digests(Aircraft.load(name)))
        return 0
    found = {way: _of_process(WAYS[way]) for way in options.ways}
    for way, text in found.items():
        print(f"{way}:\n{text}", end="")
    return int(len(set(found.values())) != 1)


def digests(aircraft: Aircraft) -> list[str]:
    """Of a trim, its linear model, flights by two methods, and a batch of the first of them."""
    point = trim(aircraft, SPEED)
    model = linearize(aircraft, point=point)
    flights = [simulate(aircraft, point, point.controls, SECONDS, wind=AIR, method=name) for name in ("rk4", "tsit5")]
    batch = simulate_batch([Case(aircraft, point, wind=AIR)] * 3, SECONDS)
    if not np.array_equal(batch["state"][0][-1], flights[0]["state"][-1]):
        raise SystemExit(f"{aircraft.name}: a flight in a batch is not the flight by itself")
    return [
        digest(point.state, point.controls),
        digest(model.a, model.b),
        digest(*(flight["state"] for flight in flights)),
        digest(batch["state"]),
    ]


def digest(*arrays: Any) -> str:
    """Of the bytes of arrays, 12 hexadecimal digits."""
    return hashlib.sha256(b"".join(np.ascontiguousarray(array).tobytes() for array in arrays)).hexdigest()[:12]


def _of_process(variables: dict[str, str]) -> str:
    command = [sys.executable, __file__, "--print"]
    return subprocess.run(
        command, env={**os.environ, **variables}, stdout=subprocess.PIPE, text=True, check=True
    ).stdout


if __name__ == "__main__":
    sys.exit(main())
