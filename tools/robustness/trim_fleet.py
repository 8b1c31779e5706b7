"""Random helicopters, and whether `trim` finds every steady flight that they have.

    ./run python tools/robustness/trim_fleet.py [--aircraft 500] [--seed 1] [--starts 20] [--seconds 5] [--workers 2]
    ./run python tools/robustness/trim_fleet.py --equipped

Conventional, tandem, side-by-side, quadrotor and coaxial aircraft (test/support/random_aircraft.py), each in hover,
forward flight and one other; or, equipped, those of tools/robustness/generality.py with every key. What is found must
fulfil the complete equations and fly on for a revolution. What is not found is looked for by another way: least squares
from random attitudes, controls and inflows all over the ranges. The same search after every tenth flight that was found
shows how much it sees. The exit code is 1 if it finds a flight without stalled rotors that `trim` does not, or if
something found is no trim.
"""

import argparse
import collections
import math
import sys
import time
import warnings
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import least_squares

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "test" / "support"))

from random_aircraft import GRAVITY, random_flights  # noqa: E402
from random_options import equipped_flights  # noqa: E402

from sbs_sim import Aircraft, simulate, trim  # noqa: E402
from sbs_sim.analysis import trim_problem  # noqa: E402
from sbs_sim.analysis.trim_guess import MomentumTheory  # noqa: E402
from sbs_sim.analysis.trim_problem import TrimProblem  # noqa: E402
from sbs_sim.analysis.trim_search import STALLED  # noqa: E402
from sbs_sim.errors import TrimError  # noqa: E402
from sbs_sim.flight.trim_point import Fidelity, TrimCondition, TrimPoint  # noqa: E402

SOLVED = 1e-8  # largest scaled residual of a trim
MAX_UNKNOWN = 1.3  # rad; bounds of the least squares
EVALUATIONS = 60
# Velocity gained in a revolution of the slowest rotor, over what a free fall would gain: unstable modes, and vibration
# that is not that of the mean, make up to 0.06 of it.
DEPARTURE = 0.1
PROBE = 10  # one of so many flights that were found is looked for by the other way, too

ORDINARY, BEYOND, STALL, NONE, MISSED, WRONG = (
    "found",
    "found, beyond the controls",
    "found, stalled",
    "none",
    "missed",
    "no trim",
)


@dataclass(frozen=True)
class Outcome:
    """What became of a flight: number of the aircraft, names, one of the words above, what else is to be said."""

    number: int
    kind: str
    flight: str
    word: str
    text: str = ""
    probe: bool | None = None  # whether the other search finds a flight that there is
    milliseconds: float = 0.0


def solve(job: tuple[bool, int, int, int, float]) -> list[Outcome]:
    """All flights of one aircraft."""
    equipped, seed, number, starts, seconds = job
    kind, aircraft, flights = (equipped_flights if equipped else random_flights)(seed, number)
    if aircraft.body.is_stand:  # it does not fly
        return []
    found = []
    for i, (flight, condition) in enumerate(flights.items()):
        other = Other(aircraft, TrimCondition(**condition), (seed, number, i), starts, seconds)
        begin = time.perf_counter()
        try:
            point, error = trim(aircraft, **condition), ""
        except TrimError as failure:
            point, error = None, str(failure)
        spent = 1e3 * (time.perf_counter() - begin)
        if point is None:
            word, text, probe = *_after_failure(other, error), None
        else:
            word, text, probe = _after_success(other, aircraft, point, (number + i) % PROBE == 0)
        found.append(Outcome(number, kind, flight, word, text, probe, spent))
    return found


def _after_failure(other: "Other", error: str) -> tuple[str, str]:
    """What the other search has to say where `trim` finds nothing."""
    found = other.search()
    return (NONE, error) if found is None else (MISSED, f"{other.described(found)}; trim: {error}")


def _after_success(other: "Other", aircraft: Aircraft, point: TrimPoint, probe: bool) -> tuple[str, str, bool | None]:
    """Whether it is a trim, and whether there is a more ordinary one."""
    unknowns = other.unknowns(point)
    word = other.word(unknowns)
    if fault := _fault(aircraft, point, other.residual(unknowns), word):
        return WRONG, fault, None
    if word == ORDINARY:
        return word, "", other.search() is not None if probe else None
    found = other.search()
    if found is not None and other.word(found) == ORDINARY:
        return MISSED, f"{other.described(found)}; trim: {word}", None
    return word, "", None


def _fault(aircraft: Aircraft, point: TrimPoint, residual: np.ndarray, word: str) -> str:
    """Why a trim is none; empty if it is one.

    Flown are those that can be: stalled ones may last no revolution, controls beyond their ranges are refused.
    """
    left = float(np.abs(residual).max())
    if not left < SOLVED:
        return f"residual {left:.2g}"
    if word == STALL or point.beyond_limits:
        return ""
    duration = math.ceil(100 * 2 * math.pi / min(rotor.speed for rotor in aircraft.rotors)) / 100  # in whole ticks
    # the default method takes the speeds of rotors for constant
    options = {"method": "rk4"} if aircraft.drives else {}
    flown = simulate(aircraft, point, point.controls, duration, **options)
    gained = max(abs(float(flown[axis][-1] - flown[axis][0])) for axis in "uvw")
    share = gained / (GRAVITY * duration)
    return f"it gains {share:.2g} of a free fall" if share > DEPARTURE else ""


class Other:
    """Another search for the same flight: least squares from random starts, with exact slopes."""

    def __init__(
        self, aircraft: Aircraft, condition: TrimCondition, seed: tuple[int, ...], starts: int, seconds: float
    ) -> None:
        self._problem, self._condition = TrimProblem(aircraft, Fidelity()), condition
        self._rng, self._starts, self._seconds = np.random.default_rng(seed), starts, seconds

    def search(self) -> np.ndarray | None:
        """A solution, an ordinary one if it comes to one; None after all starts or when the time is over."""
        found, end = None, time.process_time() + self._seconds
        azimuths, trim_problem.JACOBIAN_AZIMUTHS = trim_problem.JACOBIAN_AZIMUTHS, 12
        try:
            for _ in range(self._starts):
                solution = self._least_squares()
                if solution is not None:
                    found = solution
                    if self.word(found) == ORDINARY:
                        break
                if time.process_time() > end:
                    break
        finally:
            trim_problem.JACOBIAN_AZIMUTHS = azimuths
        return found

    def _least_squares(self) -> np.ndarray | None:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of overflows far from any flight
            found = least_squares(
                self.residual,
                self._random_start(),
                jac=lambda unknowns: np.nan_to_num(self._problem.jacobian(self._condition, unknowns)),
                bounds=(-MAX_UNKNOWN, MAX_UNKNOWN),
                max_nfev=EVALUATIONS,
                **dict.fromkeys(("xtol", "ftol", "gtol"), 1e-14),
            )
        return found.x if np.abs(found.fun).max() < SOLVED else None

    def _random_start(self) -> np.ndarray:
        """Attitude, controls all over their ranges or in the middle of them, coning and inflow."""
        problem, rng, x = self._problem, self._rng, np.zeros(self._problem.layout.size)
        low, high = (
            problem.aircraft.trim_unknowns(end) for end in np.array([*problem.aircraft.control_ranges.values()]).T
        )
        controls = rng.uniform(low, high) * rng.choice([0.4, 1.0])
        for j in range(len(problem.aircraft.rotors)):
            x[problem.layout.flap(j).start] = rng.uniform(0.0, 0.1)
            x[problem.layout.inflow(j).start] = rng.uniform(0.005, 0.1)
        return problem.unknowns(*rng.uniform(-0.2, 0.2, 2), controls, x)

    def residual(self, unknowns: np.ndarray) -> np.ndarray:
        """Scaled residuals, finite."""
        values = self._problem.residual(self._condition, unknowns)
        return np.clip(np.nan_to_num(values, nan=1e3), -1e3, 1e3)

    def unknowns(self, point: TrimPoint) -> np.ndarray:
        """Unknowns of a trim."""
        x = self._problem.layout.from_linear(point.state)
        controls = self._problem.aircraft.trim_unknowns(point.controls)
        return self._problem.unknowns(point.pitch, point.roll, controls, x)

    def word(self, unknowns: np.ndarray) -> str:
        """Whether a solution is an ordinary flight."""
        self._problem.residual(self._condition, unknowns)
        if np.abs(MomentumTheory(self._problem).stall(self._condition, unknowns)).max() > STALLED:
            return STALL
        return BEYOND if self._problem.beyond_limits(unknowns) else ORDINARY

    def described(self, unknowns: np.ndarray) -> str:
        """A solution in words."""
        angles = np.degrees(unknowns[:6]).round(2).tolist()
        return f"{self.word(unknowns)}, pitch, roll and controls {angles} deg"


# --- what is printed ------------------------------------------------------------------------------------------------


def main() -> int:
    """Solve the fleet and print what became of it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--aircraft", type=int, default=500, help="how many (default: 500)")
    parser.add_argument("--first", type=int, default=0, help="number of the first one (default: 0)")
    parser.add_argument("--seed", type=int, default=1, help="(default: 1)")
    parser.add_argument("--starts", type=int, default=20, help="of the other search (default: 20)")
    parser.add_argument("--seconds", type=float, default=5.0, help="of the other search for a flight (default: 5)")
    parser.add_argument("--equipped", action="store_true", help="aircraft with every key of an aircraft file")
    parser.add_argument("--workers", type=int, default=2, help="processes (default: 2)")
    arguments = parser.parse_args()
    numbers = range(arguments.first, arguments.first + arguments.aircraft)
    jobs = [(arguments.equipped, arguments.seed, number, arguments.starts, arguments.seconds) for number in numbers]
    outcomes: list[Outcome] = []
    with ProcessPoolExecutor(arguments.workers) as pool:
        for found in pool.map(solve, jobs):
            outcomes += found
            for outcome in found:
                if outcome.word in (MISSED, WRONG, NONE):
                    print(
                        f"{outcome.number} {outcome.kind} {outcome.flight}: {outcome.word}; {outcome.text}", flush=True
                    )
    return _print_table(outcomes)


def _print_table(outcomes: list[Outcome]) -> int:
    words = (ORDINARY, BEYOND, STALL, NONE, MISSED, WRONG)
    print("\n| kind | flights | " + " | ".join(words) + " |\n|" + "---|" * (2 + len(words)))
    for kind in (*dict.fromkeys(outcome.kind for outcome in outcomes), "all"):
        counts = collections.Counter(outcome.word for outcome in outcomes if kind in (outcome.kind, "all"))
        row: list[Any] = [kind.replace("_", "-"), counts.total(), *(counts[word] for word in words)]
        print("| " + " | ".join(str(cell) for cell in row) + " |")
    probes = [outcome.probe for outcome in outcomes if outcome.probe is not None]
    print(f"\nthe other search finds {sum(probes)} of {len(probes)} flights that there are")
    for name, chosen in (("found", (ORDINARY,)), ("not found", (NONE, MISSED))):
        times = sorted(outcome.milliseconds for outcome in outcomes if outcome.word in chosen)
        if times:
            print(f"{name}: {times[len(times) // 2]:.3g} ms in the middle, {times[-1]:.3g} ms at most")
    missed = [outcome for outcome in outcomes if outcome.word == MISSED and not outcome.text.startswith(f"{STALL},")]
    wrong = [outcome for outcome in outcomes if outcome.word == WRONG]
    print(f"{len(missed)} missed without stalled rotors, {len(wrong)} found that are no trims")
    return 1 if missed or wrong else 0


if __name__ == "__main__":
    sys.exit(main())
