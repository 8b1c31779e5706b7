"""Random aircraft with every kind of key: whether each trims and linearizes or says why not, and obeys physics.

    nice -n 19 ./run python tools/robustness/generality.py [--aircraft 500] [--first 0] [--seed 1]

Nine kinds of aircraft with one to eight rotors of two to seven blades (test/support/random_options.py) draw from all
keys of an aircraft file and all choices; `random_options.NEVER_DRAWN` names the few that are left out, and why. Of each
aircraft

- every flight is trimmed and linearized, or refused in one line that names what stops it; two blades have Floquet's
  exponents in place of a linear model, where their rotors have a common period;
- modes have names of their own, each of the family, the rotor and the drive with the largest participation;
- the derivative of the image in the plane y = 0 is the image of the derivative, to 1e-10;
- in a violent state in wind the rates of the inflow are those of the plain model, to 1e-9;
- there momentum and angular momentum change as air, weight and ground demand, and the energy by the powers of engines,
  air, ground, dampers and drives (test/support/balances.py), to 1e-9; in vacuum, too.

The exit code is 1 if one of them fails.
"""

import argparse
import collections
import math
import re
import sys
import time
import traceback
from pathlib import Path
from typing import NamedTuple

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "test" / "support"))

from aircraft_laws import CONSERVED, MIRROR, balance_errors, inflow_error, mirror_error, mode_faults  # noqa: E402
from random_options import ALL_KINDS, drawn_keys, equipped_flights, schema_keys  # noqa: E402

from sbs_sim import Aircraft, linearize, trim  # noqa: E402
from sbs_sim.analysis.floquet import Floquet, floquet  # noqa: E402
from sbs_sim.errors import LinearizationError, SbsError  # noqa: E402
from sbs_sim.flight.trim_point import TrimPoint  # noqa: E402
from sbs_sim.flight.two_blades import has_two_blades  # noqa: E402

TRIMMED, BEYOND, REFUSED, FAULT = "trimmed", "beyond the controls", "refused", "fault"
LONGEST = 600  # characters of a refusal
MOST_REASONS = 12  # that are printed
FLOQUET_COUNT = 24  # azimuths
KEYS = schema_keys()
SOLVED = 1e-8


class Fleet(NamedTuple):
    """What became of the aircraft: flights by kind and outcome, reasons of refusals, largest errors, keys."""

    counts: collections.Counter[tuple[str, str]]
    reasons: collections.Counter[str]
    worst: dict[str, float]
    keys: set[str]


def examine(seed: int, number: int, fleet: Fleet) -> list[str]:
    """Faults of one aircraft, a line each."""
    kind, aircraft, flights = equipped_flights(seed, number)
    faults, worst = [], fleet.worst
    fleet.keys.update(drawn_keys(dict(aircraft.data), KEYS))
    for name, condition in flights.items():
        word, found = _fly(aircraft, condition, fleet.reasons)
        fleet.counts[kind, word] += 1
        faults += [f"{name}: {text}" for text in found]
    errors = {"mirror": mirror_error(aircraft, number), "inflow": inflow_error(aircraft, number)}
    errors |= balance_errors(aircraft, number)
    for what, error in errors.items():
        worst[what] = max(worst[what], error) if math.isfinite(error) else math.inf
        limit = MIRROR if what == "mirror" else CONSERVED
        if not error < limit:
            faults.append(f"{what}: {error:.2g}")
    return [f"{number} {kind} {text}" for text in faults]


def _fly(aircraft: Aircraft, condition: dict[str, float], reasons: collections.Counter[str]) -> tuple[str, list[str]]:
    """What became of a flight, and its faults."""
    try:
        point = trim(aircraft, **condition)
    except SbsError as error:
        text = str(error)
        reasons[_kind_of(text, [rotor.name for rotor in aircraft.rotors])] += 1
        is_line = "\n" not in text and len(text) < LONGEST
        return REFUSED, [] if is_line else [f"refused in more than a line: {text}"]
    except Exception:  # that is what is looked for
        return FAULT, [traceback.format_exc(limit=-1)]
    if not point.residual < SOLVED:
        return FAULT, [f"residual {point.residual:.2g}"]
    word = BEYOND if point.beyond_limits else TRIMMED
    if has_two_blades(aircraft):  # no constant matrix
        return word, _floquet_faults(aircraft, point)
    model = linearize(aircraft, point=point)
    if not (np.isfinite(model.a).all() and np.isfinite(model.b).all()):
        return FAULT, ["the linear model is not finite"]
    return word, mode_faults(model)


def _floquet_faults(aircraft: Aircraft, point: TrimPoint) -> list[str]:
    """Of the exponents of a flight with two blades, where its rotors have a common period, and of the refusals."""
    for refused in (lambda: linearize(aircraft, point=point), lambda: floquet(aircraft, point, FLOQUET_COUNT)):
        try:
            found = refused()
        except LinearizationError:
            continue
        if not isinstance(found, Floquet) or not np.isfinite(found.exponents).all():
            return ["a linear model of two blades that is none"]
    return []


def _kind_of(text: str, rotors: list[str]) -> str:
    """First reason of a refusal, without its numbers and names."""
    first = text.partition(";")[0]
    for name in rotors:
        first = re.sub(rf"\b{re.escape(name)}\b", "ROTOR", first)
    return re.sub(r"-?\d[\d.e+-]*", "N", first)


def main() -> int:
    """Examine a fleet and print what became of it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--aircraft", type=int, default=500, help="how many (default: 500)")
    parser.add_argument("--first", type=int, default=0, help="number of the first one (default: 0)")
    parser.add_argument("--seed", type=int, default=1, help="(default: 1)")
    arguments = parser.parse_args()
    fleet = Fleet(collections.Counter(), collections.Counter(), collections.defaultdict(float), set())
    failed, begin = 0, time.process_time()
    for number in range(arguments.first, arguments.first + arguments.aircraft):
        faults = examine(arguments.seed, number, fleet)
        failed += bool(faults)
        for line in faults:
            print(line, flush=True)
    words = (TRIMMED, BEYOND, REFUSED, FAULT)
    print("\n| kind | flights | " + " | ".join(words) + " |\n|" + "---|" * (2 + len(words)))
    for kind in (*ALL_KINDS, "all"):
        row = [sum(fleet.counts[k, word] for k in ALL_KINDS if kind in (k, "all")) for word in words]
        print(f"| {kind.replace('_', '-')} | {sum(row)} | " + " | ".join(map(str, row)) + " |")
    print("\nlargest errors: " + ", ".join(f"{what} {error:.1e}" for what, error in fleet.worst.items()))
    print("keys not drawn: " + ", ".join(sorted(KEYS - fleet.keys)))
    for reason, count in fleet.reasons.most_common(MOST_REASONS):
        print(f"{count} refused: {reason}")
    print(
        f"{failed} of {arguments.aircraft} aircraft with faults, {time.process_time() - begin:.0f} s of processor time"
    )
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
