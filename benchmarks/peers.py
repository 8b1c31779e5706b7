"""Times flights of this package and of two other simulators in turn: `./run python benchmarks/peers.py --help`.

The notes say what each one computes: the figures are of different models, and none replaces the other. The other two
are no dependencies: they are flown by an interpreter of their own, and where that lacks one its row says how to get it.
"""

import argparse
import json
import math
import os
import statistics
import subprocess
import textwrap
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

from sbs_sim import Aircraft, simulate, trim
from sbs_sim.flight.simulation import METHODS, Simulation
from sbs_sim.flight.trimmed_state import trimmed_state
from sbs_sim.model.integrate import STAGES

ROOT = Path(__file__).resolve().parent.parent
PEERS_PYTHON = ROOT / ".cache" / "peers" / "bin" / "python"
INSTALL = (
    "python3 -m venv .cache/peers && .cache/peers/bin/python -m pip install --no-deps"
    " jsbsim==1.3.3 rotorpy==3.0.0 numpy scipy"
)
OURS = (("rk4", 5.0), ("etd", 14.4))
ROUNDS, SLICE = 11, 0.3  # [s] of the processor that each one flies in a round
TICK = 0.01  # s
# What the other two compute, from their sources: FGRotor.cpp, FGPropagate.h and aircraft/ah1s of JSBSim,
# vehicles/multirotor.py of RotorPy.
PEERS = {
    "jsbsim": (
        "JSBSim, AH-1S",
        "6 degrees of freedom, 13 states of the body, the speed of the rotor, one inflow per rotor; main and tail rotor"
        " in closed form: uniform inflow with a lag, steady flapping, linear lift, no blade elements; one evaluation a"
        " step, Euler and Adams-Bashforth; with its AFCS, in the hover of its own flight test",
    ),
    "rotorpy": (
        "RotorPy, Hummingbird",
        "6 degrees of freedom, 13 states of the body, four motors of first order; thrust by the square of the rotor's"
        " speed, drag and the effect of airspeed by constant coefficients, no inflow, no blades; scipy's RK45 started"
        " anew each step, 8 evaluations; no controller, in a climb",
    ),
}
Row = tuple[str, float, str, str]


@dataclass(frozen=True)
class Flyer:
    """One who takes part: `fly` flies a number of steps [s] and gives the time of the processor [s]."""

    name: str
    step: float
    fly: Callable[[int], float]
    model: str


def main() -> None:
    """Print the rows, the notes below each."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument(
        "--peers-python",
        type=Path,
        default=PEERS_PYTHON,
        help="interpreter that has jsbsim and rotorpy (default: %(default)s)",
    )
    parser.add_argument("--rounds", type=int, default=ROUNDS, help="of which medians are taken (default: %(default)s)")
    given = parser.parse_args()
    if given.rounds < 2:
        parser.error(f"--rounds {given.rounds}: allowed are 2 and more")
    try:
        rows = peer_rows(given.peers_python, given.rounds)
    except RuntimeError as error:
        raise SystemExit(f"peers.py: {error}") from None
    for name, value, unit, note in rows:
        print(f"{name:<51} {value:>9.4g} {unit}")
        print(textwrap.fill(note, 110, initial_indent="    ", subsequent_indent="    ", break_on_hyphens=False))


def peer_rows(python: Path = PEERS_PYTHON, rounds: int = ROUNDS) -> list[Row]:
    """Simulated seconds per second of the processor of each one, and ours over the others', round by round."""
    with ExitStack() as stack:
        flyers, missing = our_flyers(), list[Row]()
        for package in PEERS:
            flyer = stack.enter_context(peer(python, package))
            if flyer is None:
                missing.append((PEERS[package][0], math.nan, "", f"{python} cannot fly it; remedy: {INSTALL}"))
            else:
                flyers.append(flyer)
        rates = flown_in_turn(flyers, rounds)
    rows: list[Row] = []
    for flyer in flyers:
        median, spread = middle(rates[flyer.name])
        note = f"{1e6 * flyer.step / median:.3g} us for a step of {1e3 * flyer.step:.3g} ms; {flyer.model}; {spread}"
        rows.append((flyer.name, median, "x real", note))
    for theirs in flyers[len(OURS) :]:
        for ours in flyers[: len(OURS)]:
            pairs = zip(rates[ours.name], rates[theirs.name], strict=True)
            ratio, spread = middle([one / other for one, other in pairs])
            rows.append((f"  {ours.name} over {theirs.name}", ratio, "x", spread))
    return [*rows, *missing]


def flown_in_turn(flyers: list[Flyer], rounds: int) -> dict[str, list[float]]:
    """Simulated seconds per second of every flyer and round.

    All fly equally long by the processor's time, in turn: whatever else the machine does meets them alike.
    """
    steps = {}
    for flyer in flyers:
        flyer.fly(20)
        steps[flyer.name] = max(20, round(200 * SLICE / flyer.fly(200)))
    rates: dict[str, list[float]] = {flyer.name: [] for flyer in flyers}
    for _ in range(rounds):
        for flyer in flyers:
            count = steps[flyer.name]
            rates[flyer.name].append(count * flyer.step / flyer.fly(count))
    return rates


def middle(values: list[float]) -> tuple[float, str]:
    """Median, and the spread of the middle half."""
    low, median, high = statistics.quantiles(values, n=4)
    return median, f"median of {len(values)}, middle half within {100 * (high - low) / median:.0f} %"


def our_flyers() -> list[Flyer]:
    """`simulate` from the hover, by each method."""
    aircraft = Aircraft.load("sbs")
    hover = trim(aircraft)
    elements = sum(rotor.blades for rotor in aircraft.rotors) * aircraft.options.elements
    flyers = []
    for method, degrees in OURS:
        options = {"tick": TICK, "azimuth_step": math.radians(degrees), "method": method}
        flight = Simulation(aircraft, trimmed_state(aircraft, hover), hover.swashplate, **options)

        def fly(steps: int, options: dict = options, per_tick: int = flight.steps_per_tick) -> float:
            ticks = -(-steps // per_tick)
            start = time.process_time()
            simulate(aircraft, hover, hover.controls, TICK * ticks, **options)
            return (time.process_time() - start) * steps / (ticks * per_tick)

        model = (
            f"24 degrees of freedom, {aircraft.layout.size} states, of them three of inflow per rotor; {elements} blade"
            f" elements with tables of cl and cd; {STAGES[METHODS[method]]} evaluations a step, loads recorded each"
            f" {TICK:g} s"
        )
        flyers.append(Flyer(f"sbs_sim, {method} {degrees:g} deg", flight.step_size, fly, model))
    return flyers


@contextmanager
def peer(python: Path, package: str) -> Iterator[Flyer | None]:
    """Another simulator in a process of its own, None where the interpreter cannot fly it.

    Raises
    ------
    RuntimeError
        While it flies: its process has ended.
    """
    if not os.access(python, os.X_OK):
        yield None
        return
    # The libraries that ./run puts in its way are those of another environment, and -I keeps PYTHONPATH away.
    environment = {name: value for name, value in os.environ.items() if name != "LD_LIBRARY_PATH"}
    command = [str(python), "-I", str(Path(__file__).with_name("peer_flight.py")), package]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, stdin=pipe, stdout=pipe, text=True, bufsize=1, env=environment) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        questions, answers = process.stdin, process.stdout
        name, model = PEERS[package]

        def fly(steps: int) -> float:
            questions.write(f"{steps}\n")
            if not (answer := answers.readline()):
                raise RuntimeError(f"{name}: its process has ended")
            return float(answer)

        facts = json.loads(answers.readline() or '{"missing": "it ended at once"}')
        yield None if "missing" in facts else Flyer(name, facts["step"], fly, f"version {facts['version']}: {model}")


if __name__ == "__main__":
    main()
