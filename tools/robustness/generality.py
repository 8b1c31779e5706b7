"""Random aircraft with every kind of key: whether each trims and linearizes or says why not, and obeys physics.

    nice -n 19 ./run python tools/robustness/generality.py [--aircraft 500] [--first 0] [--seed 1]

Nine kinds of aircraft with one to eight rotors (test/support/random_options.py) draw from all keys of an aircraft file:
tables along the blade, inertia, rest angles, dampers, surfaces, fuselage, atmosphere, airfoils over the Mach number,
controls of their own, drives, stands. Of each aircraft

- every flight is trimmed and linearized, or refused in one line that names what stops it;
- modes have names of their own, each of the family, the rotor and the drive with the largest participation;
- the derivative of the image in the plane y = 0 is the image of the derivative, to 1e-10;
- in a violent state in wind, momentum and angular momentum change as air and weight demand, and the energy by the
  powers of engines, air, dampers and drives (test/support/balances.py), to 1e-9; in vacuum, too.

The exit code is 1 if one of them fails.
"""

import argparse
import collections
import math
import sys
import time
import traceback
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "test" / "support"))

from aircraft_laws import CONSERVED, MIRROR, balance_errors, mirror_error, mode_faults  # noqa: E402
from random_options import ALL_KINDS, equipped_flights  # noqa: E402

from sbs_sim import Aircraft, linearize, trim  # noqa: E402
from sbs_sim.errors import SbsError  # noqa: E402

TRIMMED, BEYOND, REFUSED, FAULT = "trimmed", "beyond the controls", "refused", "fault"
LONGEST = 600  # characters of a refusal
SOLVED = 1e-8


def examine(seed: int, number: int, counts: collections.Counter, worst: dict[str, float]) -> list[str]:
    """Faults of one aircraft, a line each."""
    kind, aircraft, flights = equipped_flights(seed, number)
    faults = []
    for name, condition in flights.items():
        word, found = _fly(aircraft, condition)
        counts[kind, word] += 1
        faults += [f"{name}: {text}" for text in found]
    errors = {"mirror": mirror_error(aircraft, number), **balance_errors(aircraft, number)}
    for what, error in errors.items():
        worst[what] = max(worst[what], error) if math.isfinite(error) else math.inf
        limit = MIRROR if what == "mirror" else CONSERVED
        if not error < limit:
            faults.append(f"{what}: {error:.2g}")
    return [f"{number} {kind} {text}" for text in faults]


def _fly(aircraft: Aircraft, condition: dict[str, float]) -> tuple[str, list[str]]:
    """What became of a flight, and its faults."""
    try:
        point = trim(aircraft, **condition)
    except SbsError as error:
        text = str(error)
        is_line = "\n" not in text and len(text) < LONGEST
        return REFUSED, [] if is_line else [f"refused in more than a line: {text}"]
    except Exception:  # that is what is looked for
        return FAULT, [traceback.format_exc(limit=-1)]
    if not point.residual < SOLVED:
        return FAULT, [f"residual {point.residual:.2g}"]
    model = linearize(aircraft, point=point)
    if not (np.isfinite(model.a).all() and np.isfinite(model.b).all()):
        return FAULT, ["the linear model is not finite"]
    return BEYOND if point.beyond_limits else TRIMMED, mode_faults(model)


def main() -> int:
    """Examine a fleet and print what became of it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--aircraft", type=int, default=500, help="how many (default: 500)")
    parser.add_argument("--first", type=int, default=0, help="number of the first one (default: 0)")
    parser.add_argument("--seed", type=int, default=1, help="(default: 1)")
    arguments = parser.parse_args()
    counts: collections.Counter[tuple[str, str]] = collections.Counter()
    worst: dict[str, float] = collections.defaultdict(float)
    failed, begin = 0, time.process_time()
    for number in range(arguments.first, arguments.first + arguments.aircraft):
        faults = examine(arguments.seed, number, counts, worst)
        failed += bool(faults)
        for line in faults:
            print(line, flush=True)
    words = (TRIMMED, BEYOND, REFUSED, FAULT)
    print("\n| kind | flights | " + " | ".join(words) + " |\n|" + "---|" * (2 + len(words)))
    for kind in (*ALL_KINDS, "all"):
        row = [sum(counts[k, word] for k in ALL_KINDS if kind in (k, "all")) for word in words]
        print(f"| {kind.replace('_', '-')} | {sum(row)} | " + " | ".join(map(str, row)) + " |")
    print("\nlargest errors: " + ", ".join(f"{what} {error:.1e}" for what, error in worst.items()))
    print(
        f"{failed} of {arguments.aircraft} aircraft with faults, {time.process_time() - begin:.0f} s of processor time"
    )
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
