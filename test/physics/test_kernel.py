"""The compiled code: equal bits in every process."""

import os
import subprocess
import sys
import textwrap

import pytest
from terminal import on_a_terminal

CODE = """
    import hashlib
    import sys

    import numpy as np

    from sbs_sim import Aircraft, Simulation, linearize, simulate, trim
    from sbs_sim.flight.engine import Engine
    from sbs_sim.model.average import azimuths
    from sbs_sim.flight.trimmed_state import trimmed_state

    aircraft = Aircraft.load("sbs")
    flat = trim(Aircraft.load("sbs_paper")) if "other" in sys.argv else None
    point = trim(aircraft, airspeed=8.0)
    results = {}
    for what in sys.argv[1:]:
        if what == "simulate":
            results[what] = simulate(aircraft, point, point.controls + 0.01, duration=0.1)["state"].tobytes()
        elif what == "ticks":
            simulation = Simulation(aircraft, trimmed_state(aircraft, point), aircraft.mix(point.controls + 0.01))
            states = [simulation.state.copy()]
            for _ in range(10):
                simulation.advance()
                states.append(simulation.state.copy())
            results["simulate"] = np.array(states).tobytes()
        elif what == "linearize":
            results[what] = linearize(aircraft, point=point).a.tobytes()
        elif what == "derivative":
            engine, x = Engine(aircraft.arranged(True, True, "blades")), trimmed_state(aircraft, point)
            rates, _ = engine.average(x, point.swashplate, azimuths(aircraft.layout.blades, 1))
            results[what] = rates.tobytes()
    for what in sorted(results):
        print(what, hashlib.sha256(results[what]).hexdigest())
"""
ORDERS = [
    ("simulate", "linearize", "derivative"),
    ("derivative", "linearize", "simulate"),
    ("linearize", "derivative", "simulate", "other"),
    ("derivative", "linearize", "ticks"),  # the same flight, without the call that takes many ticks at once
]


def digests(order):
    code = textwrap.dedent(CODE)
    found = subprocess.run(
        [sys.executable, "-c", code, *order], capture_output=True, text=True, timeout=120, check=True
    )
    return found.stdout


@pytest.mark.parametrize("order", ORDERS[1:])
def test_bits_do_not_depend_on_what_was_loaded_first(order):
    """A log is flown again by a process that loads other parts of the model, in another order."""
    assert digests(order) == digests(ORDERS[0])


PLAIN = """
    import math
    import numba
    from sbs_sim import Aircraft, Case, linearize, simulate, simulate_batch, sweep, trim
    from sbs_sim.flight import formation
    from sbs_sim.model.wind import Wind

    small = Aircraft.load("sbs").with_value("options.elements", 2)
    rough = {"azimuth_count": 1}
    point = trim(small, **rough)
    air = Wind(velocity=(1.0, 0.0, 0.0), turbulence_intensity=(1.0, 1.0, 1.0))
    step = {"tick": 0.002, "azimuth_step": 0.5}
    flights = [simulate(small, point, point.controls, 0.004, wind=air, method=m, **step) for m in ("rk4", "tsit5")]
    batch = simulate_batch([Case(small, point, wind=air)], 0.004, every=2, **step)
    found = sweep(small, "airspeed", [0.0], linear=False, **rough)
    model = linearize(small, point=point)
    numbers = [
        *(value for flight in flights for value in flight["state"][-1]),
        *batch["state"][0, -1],
        *found.points[0].trim.state,
        *model.a.ravel(),
        *model.b.ravel(),
    ]
    assert numba.config.DISABLE_JIT == (not hasattr(formation.fly, "overloads"))
    print(batch.errors, found.points[0].error, flights[0].warnings)
    print(*map(repr, map(float, numbers)))
"""


def test_everything_works_without_the_compiler_too():
    """NUMBA_DISABLE_JIT is how one steps through the model: the same numbers but for rounding."""
    reported, numbers = [], []
    for disabled in ("0", "1"):
        environment = {**os.environ, "NUMBA_DISABLE_JIT": disabled}
        code = textwrap.dedent(PLAIN)
        run = subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, timeout=300, check=False, env=environment
        )
        assert run.returncode == 0, run.stderr
        line, values = run.stdout.splitlines()
        reported.append(line)
        numbers.append([float(value) for value in values.split()])
    assert reported == ["(None,) None ()"] * 2
    assert len(numbers[0]) > 1000
    assert numbers[1] == pytest.approx(numbers[0], rel=1e-6, abs=1e-6)


COMPILING = """
    import numpy as np
    from sbs_sim.model.kernel import entry
    from sbs_sim.terminal.progress import show_compiling

    show_compiling()

    @entry
    def double(x):
        for i in range(x.shape[0]):
            x[i] *= 2.0

    values = np.ones(2)
    double(values)
    double(np.ones((2, 2))[0])
    print(values.tolist())
"""


def test_who_waits_for_the_compiler_is_told_so_once(tmp_path):
    """A person at a terminal alone: programs that read stderr see nothing of it."""
    path = tmp_path / "compiling.py"
    path.write_text(textwrap.dedent(COMPILING), encoding="utf-8")
    folder = tmp_path / "cache"
    folder.mkdir(mode=0o700)
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(folder)}
    code, out, shown = on_a_terminal([sys.executable, str(path)], env=environment)
    assert (code, out) == (0, "[2.0, 2.0]\n")
    assert shown.count(b"sbs_sim: compiling for this kind of aircraft, once") == 1
    again = on_a_terminal([sys.executable, str(path)], env=environment)
    assert again == (0, out, b"")
    os.truncate(path, 0)
    path.write_text(textwrap.dedent(COMPILING) + "\n", encoding="utf-8")
    piped = subprocess.run([sys.executable, str(path)], env=environment, capture_output=True, text=True, check=True)
    assert (piped.stdout, piped.stderr) == (out, "")
