"""The compiled code: equal bits in every process."""

import subprocess
import sys
import textwrap

import pytest

CODE = """
    import hashlib
    import sys

    import numpy as np

    from sbs_sim import Aircraft, Simulation, linearize, simulate, trim
    from sbs_sim.model.dynamics import derivative
    from sbs_sim.model import params as P
    from sbs_sim.simulation import trimmed_state

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
            params, x = aircraft.params(), trimmed_state(aircraft, point)
            dx = np.zeros_like(x)
            derivative(params, x, point.swashplate, np.zeros(2), np.zeros(3), P.make_work(params), dx)
            results[what] = dx.tobytes()
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
