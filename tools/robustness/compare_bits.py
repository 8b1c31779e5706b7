"""Digests of trims, linear models, flights, batches and sweeps, compiled in several ways: all must be the same.

    ./run python tools/robustness/compare_bits.py
    ./run python tools/robustness/compare_bits.py --ways native generic --aircraft sbs
    ./run python tools/robustness/compare_bits.py --ways native interpreted --small

A way compiles the model anew into a folder of its own, for numba does not ask whether machine code that it finds was
optimised otherwise; ways that differ in the libraries alone (numpy, BLAS) take what "native" has compiled. Ways that
this machine cannot execute are left out. The exit code is 1 if a digest differs, or if a flight in a batch differs from
the flight by itself. Digests of what depends on eigenvalues of LAPACK are shown, and may differ.
"""

import argparse
import contextlib
import hashlib
import itertools
import math
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from llvmlite import binding

from sbs_sim import Aircraft, Case, linearize, simulate, simulate_batch, sweep, trim
from sbs_sim.analysis.floquet import floquet
from sbs_sim.analysis.monte_carlo import gust_cases
from sbs_sim.errors import LinearizationError
from sbs_sim.flight.records import Event
from sbs_sim.flight.refly import refly
from sbs_sim.flight.simulation import AZIMUTH_STEP, METHOD, METHODS, Simulation
from sbs_sim.flight.trimmed_state import trimmed_state
from sbs_sim.model.airfoil import extend_polar
from sbs_sim.model.wind import Wind

ROOT = Path(__file__).resolve().parents[2]
AIRCRAFT = ("sbs", "sbs_paper", *(str(ROOT / f"test/data/{name}.yaml") for name in ("tail_rotor", "tandem", "uh60a")))
SMALL = (str(ROOT / "test/data/tail_rotor.yaml"),)
NO_AVX512, NO_AVX = (
    "X86_V4 AVX512_ICL AVX512_SPR",
    "X86_V3 X86_V4 AVX512_ICL AVX512_SPR",
)  # of what numpy 2.4 dispatches


def compiled_for(name: str, features: str = "", optimisation: str = "3") -> dict[str, str]:
    """Variables that let numba compile anew for a processor."""
    return {OWN: "", "NUMBA_CPU_NAME": name, "NUMBA_CPU_FEATURES": features, "NUMBA_OPT": optimisation}


OWN = "own"  # beside the variables of a way: it is compiled anew
FLAT = {"OPENBLAS_CORETYPE": "Sandybridge", "NPY_DISABLE_CPU_FEATURES": NO_AVX}
# Libraries take other code where the target is another, so that one run shows more.
WAYS: dict[str, dict[str, str]] = {
    "native": {OWN: ""},
    "haswell": {**compiled_for("haswell"), "OPENBLAS_CORETYPE": "Haswell"},
    "x86-64-v3": {**compiled_for("x86-64-v3", "+avx2,+fma", "1"), "NPY_DISABLE_CPU_FEATURES": NO_AVX512},
    "znver4": {**compiled_for("znver4"), "OPENBLAS_CORETYPE": "SkylakeX"},
    "generic": {**compiled_for("x86-64"), **FLAT},
    "plain": {**compiled_for("x86-64", "", "0"), **FLAT},
    "O0": {OWN: "", "NUMBA_OPT": "0"},
    "SLP": {OWN: "", "NUMBA_SLP_VECTORIZE": "1", "NUMBA_OPT": "2"},
    **{f"blas-{kind}": {"OPENBLAS_CORETYPE": kind} for kind in ("Haswell", "SkylakeX", "Zen", "Sandybridge")},
    "numpy-avx2": {"NPY_DISABLE_CPU_FEATURES": NO_AVX512},
    "numpy-sse": {"NPY_DISABLE_CPU_FEATURES": NO_AVX},
    "interpreted": {OWN: "", "NUMBA_DISABLE_JIT": "1"},
}
NEEDS = {
    "haswell": "avx2", "x86-64-v3": "avx2", "znver4": "avx512bf16",
    "blas-Haswell": "avx2", "blas-SkylakeX": "avx512f", "blas-Zen": "avx2", "blas-Sandybridge": "avx",
}  # features, without which a process ends with SIGILL  # fmt: skip
USUAL = tuple(way for way in WAYS if way != "interpreted")
SPEED, SECONDS = 5.0, 0.5  # m/s, s of each flight
PARTITIONED_STEP = math.radians(2.0)  # longer ones leave the plausible in the gust: its error is of first order
HEIGHT, SINKING = 0.6, 2.0  # m, m/s: of the flight that ends on the ground
AIR = Wind(
    velocity=(1.0, -2.0, 0.3), gust=(0.0, 3.0, -1.0), gust_delay=0.1, gust_duration=0.3,
    turbulence_intensity=(1.0, 1.5, 0.5), turbulence_direction=0.3, turbulence_seed=3,
)  # fmt: skip
POLAR = ([-1.0, -0.6, 0.0, 0.6, 1.0], [0.03, 0.01, 0.008, 0.01, 0.03])  # lift and drag
LIBRARIES = ("monodromy", "multipliers", "modes")  # are computed with exponentials of matrices or eigenvalues of LAPACK


def main() -> int:
    """Compare the ways, or print the digests of this process."""
    parser = argparse.ArgumentParser(description="Compare the bits of results that are compiled in several ways.")
    parser.add_argument("--ways", nargs="+", choices=WAYS, default=list(USUAL))
    parser.add_argument("--aircraft", nargs="+", help="names or files (default: all of the tests)")
    parser.add_argument("--small", action="store_true", help="so little that the interpreter can do it, too")
    parser.add_argument("--most", type=int, help="no more than so many digests of an aircraft (default: all)")
    parser.add_argument("--kept", action="store_true", help='"native" is what the machine code that is kept gives')
    parser.add_argument("--print", action="store_true", help="print the digests of this process")
    options = parser.parse_args()
    names = options.aircraft or (SMALL if options.small else AIRCRAFT)
    if options.print:
        for name in names:
            every = (few if options.small else digests)(Aircraft.load(name))
            for title, found in itertools.islice(every, options.most):
                print(f"{Path(name).stem:11} {title:13} {found}")
        return 0
    arguments = ["--aircraft", *names, *(["--small"] if options.small else [])]
    arguments += [] if options.most is None else ["--most", str(options.most)]
    ways = [way for way in options.ways if NEEDS.get(way, "") in ("", *own_features())]
    with tempfile.TemporaryDirectory() as folder:
        found = {way: _of_process(way, Path(folder), arguments, options.kept) for way in ways}
    return int(_told(found))


def digests(aircraft: Aircraft) -> Iterator[tuple[str, str]]:
    """Titles and digests."""
    point = trim(aircraft, SPEED)
    yield "trim", digest(point.state, point.controls)
    model = linearize(aircraft, point=point)
    yield "A B", digest(model.a, model.b)
    ends = {}
    for name in METHODS:
        step = PARTITIONED_STEP if name == "partitioned" else AZIMUTH_STEP
        flight = simulate(aircraft, point, point.controls, SECONDS, wind=AIR, method=name, azimuth_step=step)
        ends[name] = flight["state"][-1]
        yield name, digest(*(flight[key] for key in ("state", "acceleration", "thrust", "torque", "phi", "V")))
    yield "trim turn", digest(trim(aircraft, SPEED, climb_rate=0.5, sideslip=0.1, turn_rate=0.1).state)
    yield "C D", digest(model.c, model.d)
    yield "kinematics", digest(model.kinematics)
    yield "ground", digest(*_touching(aircraft, point))
    yield "reset", digest(*_reset(aircraft, point))
    batch = simulate_batch([Case(aircraft, point, wind=AIR)] * 3, SECONDS)
    if not np.array_equal(batch["state"][0][-1], ends[METHOD]):
        raise SystemExit(f"{aircraft.name}: a flight in a batch is not the flight by itself")
    yield "batch", digest(batch["state"], batch["thrust"])
    spread = {"body.mass": 0.02, "environment.air_density": 0.05}
    cases = gust_cases(aircraft, 3, {"airspeed": SPEED}, turbulence=1.0, seed=4, spread=spread)
    yield "Monte Carlo", digest(simulate_batch(cases, 0.2)["state"])
    swept = sweep(aircraft, "airspeed", [0.0, 3.0, 6.0], azimuth_count=3)
    yield "sweep", digest(*(one.trim.state for one in swept.points if one.trim is not None))
    yield "polar", digest(*extend_polar(np.radians([-12.0, -6.0, 0.0, 6.0, 12.0]), *POLAR, 11.0))
    with contextlib.suppress(LinearizationError):  # rotors without a common period
        periodic = floquet(aircraft, point, 8)
        yield "monodromy", digest(periodic.monodromy)
        yield "multipliers", digest(periodic.multipliers)
    yield "mode names", names_digest(mode.name for mode in model.modes)
    yield "modes", digest(*(mode.pole for mode in model.modes))


def few(aircraft: Aircraft) -> Iterator[tuple[str, str]]:
    """Titles and digests of a tick of a flight from a state that nobody has trimmed, and of a turbulence."""
    state = np.zeros(aircraft.layout.size)
    state[2], state[3], state[7:13] = -10.0, 1.0, [5.0, 0.3, -0.2, 0.1, -0.05, 0.2]
    state[13:] = 0.01 * np.cos(np.arange(len(state) - 13)).round(3)
    flight = simulate(aircraft, state, [0.12, 0.01, 0.02, -0.01], 0.01, wind=AIR)
    yield "rk4", digest(*(flight[key] for key in ("state", "acceleration", "thrust")))


def _touching(aircraft: Aircraft, point: Any) -> list[Any]:
    """States of a flight up to where it touches the ground, and what is said there."""
    state = trimmed_state(aircraft, point)
    state[2], state[9] = -HEIGHT - aircraft.rotors[0].radius, SINKING
    batch = simulate_batch([Case(aircraft, state, point.controls, wind=AIR)], 1.0, ground_altitude=0.0)
    return [batch["state"], np.frombuffer(str(batch.errors).encode(), dtype=np.uint8)]


def _reset(aircraft: Aircraft, point: Any) -> list[Any]:
    """States of a flight that is put elsewhere and gets other air."""
    state, air = trimmed_state(aircraft, point, wind=AIR.velocity), AIR
    elsewhere = trimmed_state(aircraft, point, (1.0, 2.0, -30.0), heading=0.7)
    steps = Simulation(aircraft, state, point.swashplate).steps_per_tick
    events = [
        Event(0, "start", point.swashplate, state, air),
        Event(2 * steps, "reset", 1.01 * point.swashplate, elsewhere),
        Event(5 * steps, "wind", wind=Wind(turbulence_intensity=(2.0, 2.0, 2.0), turbulence_seed=9)),
    ]
    flown = refly(aircraft, events, 20 * steps)
    return [part for one in flown for part in (one.state, one.azimuth, one.wind)]


def digest(*arrays: Any) -> str:
    """Of the bytes of arrays, 12 hexadecimal digits."""
    return hashlib.sha256(b"".join(np.ascontiguousarray(array).tobytes() for array in arrays)).hexdigest()[:12]


def names_digest(names: Iterable[str]) -> str:
    """Of names in their order, 12 hexadecimal digits."""
    return hashlib.sha256("\n".join(names).encode()).hexdigest()[:12]


def own_features() -> set[str]:
    """Of this processor."""
    return {name for name, has in binding.get_host_cpu_features().items() if has}


def _of_process(way: str, folder: Path, arguments: list[str], kept: bool) -> dict[str, str]:
    """Digests by their titles; they are printed as soon as they are there."""
    variables = {"NUMBA_OPT": "3", **WAYS[way]}
    anew = way if variables.pop(OWN, None) is not None else "native"
    if anew != "native" or not kept:
        variables["NUMBA_CACHE_DIR"] = str(folder / anew)
    begin = time.monotonic()
    command = [sys.executable, __file__, "--print", *arguments]
    environment = {**os.environ, **variables}
    text = subprocess.run(command, env=environment, stdout=subprocess.PIPE, text=True, check=True).stdout
    print(f"{way}: {time.monotonic() - begin:.0f} s\n{text}", end="", flush=True)
    return dict(line.rsplit(maxsplit=1) for line in text.splitlines())


def _told(found: dict[str, dict[str, str]]) -> bool:
    """True if something differs that must not; what differs is printed."""
    first, *others = found
    wrong = False
    for way in others:
        for title, own in found[way].items():
            if own != found[first][title]:
                excused = title.endswith(LIBRARIES)
                wrong = wrong or not excused
                print(f"{way} differs from {first}: {title}{' (eigenvalues of LAPACK)' if excused else ''}")
    if not wrong:
        print(f"the same in {len(found)} ways: {', '.join(found)}")
    return wrong


if __name__ == "__main__":
    sys.exit(main())
