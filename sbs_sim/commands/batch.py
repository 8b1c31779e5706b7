"""`batch`: Monte Carlo flights through turbulence, as a table of percentiles, a plot and files."""

import argparse
from collections import Counter
from typing import TYPE_CHECKING

from sbs_sim.commands.air_arguments import add_air_arguments, air_fields
from sbs_sim.commands.common import (
    OUTSIDE,
    add_flight_arguments,
    add_worker_arguments,
    aircraft,
    execute,
    execution,
    fixed,
    flight,
    print_table,
)
from sbs_sim.commands.controller_arguments import add_controller_arguments, controller
from sbs_sim.errors import BatchError
from sbs_sim.terminal.command_line import Parser, assignment
from sbs_sim.terminal.progress import progress_bar

if TYPE_CHECKING:
    from sbs_sim.analysis.batch import Batch

HELD_DURATION, CONTROLLED_DURATION = 3.0, 20.0  # s; hands off, an unstable aircraft tumbles after some seconds
LISTED = 10  # flights that ended early, with their reasons


def main() -> int:
    """Executable `batch`."""
    return execute(make_parser(), _work)


def make_parser() -> Parser:
    """Command line of `batch`."""
    parser = Parser(
        "batch",
        example="batch --flights 1000 --controller design --turbulence 1.5 --spread body.mass=0.05 --csv flights.csv",
        description="Fly many flights through turbulence: each flight starts in trim and has its own turbulence. A"
        " controller flies them, or the controls of the trim are held. Runs on all cores or on a cluster.",
    )
    group = parser.add_argument_group("flights")
    group.add_argument("--flights", type=int, default=1000, metavar="N", help="number of flights (default: 1000)")
    group.add_argument(
        "--duration",
        type=float,
        metavar="X",
        help="duration of each flight [s] (default: 20 with a controller, 3 without one)",
    )
    group.add_argument(
        "--turbulence",
        type=float,
        default=1.5,
        metavar="X",
        help="standard deviation of the turbulence [m/s] (default: 1.5)",
    )
    group.add_argument("--length", type=float, default=50.0, metavar="X", help="Dryden scale length [m] (default: 50)")
    add_air_arguments(group)
    group.add_argument("--seed", type=int, default=0, metavar="N", help="seed of all random numbers (default: 0)")
    group.add_argument(
        "--spread",
        action="append",
        default=[],
        type=assignment,
        metavar="PATH=SHARE",
        help="scatter a value of the aircraft file: body.mass=0.05 gives a standard deviation of 5 %%; may be repeated",
    )
    add_flight_arguments(parser)
    add_controller_arguments(parser)
    group = parser.add_argument_group("work and output")
    add_worker_arguments(group)
    group.add_argument(
        "--every", type=float, default=0.1, metavar="X", help="time between recorded rows [s] (default: 0.1)"
    )
    group.add_argument("--out", metavar="DIR", help="write a plot as PNG and SVG into this folder")
    group.add_argument("--csv", metavar="FILE", help="write a table of flights")
    group.add_argument("--json", metavar="FILE", help="write the values of all flights and the percentiles over time")
    return parser


def _work(arguments: argparse.Namespace) -> None:
    from sbs_sim.analysis.batch import simulate_cases
    from sbs_sim.analysis.monte_carlo import OUTPUTS, batch_to_csv, batch_to_dict, gust_cases
    from sbs_sim.output.files import check_target, write
    from sbs_sim.output.json_text import to_json

    check_target(arguments.csv)
    check_target(arguments.json)
    if not 0.01 <= arguments.every <= 1e6:
        raise BatchError(f"--every {arguments.every:g}: allowed are 0.01 to 1e+06 s")
    condition, fidelity = flight(arguments)
    craft = aircraft(arguments)
    flown = controller(arguments, craft, condition, fidelity)
    cases = gust_cases(
        craft,
        arguments.flights,
        condition,
        turbulence=arguments.turbulence,
        length=arguments.length,
        seed=arguments.seed,
        spread=dict(arguments.spread),
        air=air_fields(arguments, craft),
        controller=flown,
    )
    duration = arguments.duration
    if duration is None:
        duration = HELD_DURATION if flown is None else CONTROLLED_DURATION
    with progress_bar(" flights", len(cases)) as progress:
        batch = simulate_cases(
            cases,
            duration,
            fidelity,
            execution(arguments, progress),
            every=round(100 * arguments.every),
            outputs=OUTPUTS,
        )
    _print_batch(batch)
    if arguments.csv:
        write(arguments.csv, batch_to_csv(batch))
    if arguments.json:
        write(arguments.json, to_json(batch_to_dict(batch)))
    if arguments.out:
        from sbs_sim.analysis.monte_carlo_plots import batch_figure
        from sbs_sim.analysis.sweep_plots import save_figures

        for path in save_figures({"batch": batch_figure(batch)}, arguments.out):
            print(f"written: {path}")
    if len(batch.failed) == len(batch.cases):
        raise BatchError("no flight came to its end")


def _print_batch(batch: "Batch") -> None:
    """Percentiles at the start and at the end, and the flights that ended before."""
    from sbs_sim.analysis.batch import percentiles
    from sbs_sim.analysis.monte_carlo import SHARES, quantities
    from sbs_sim.output.units import counted
    from sbs_sim.output.warnings_text import joined

    whole = len(batch.cases) - len(batch.failed)
    flights = counted(len(batch.cases), "flight")
    print(f"{flights} of {batch.cases[0].aircraft.name}, {whole} of them over {batch.time[-1]:g} s")
    rows = []
    for name, values in quantities(batch).items() if whole else ():
        found = percentiles(values, SHARES)
        rows.append([name, *(fixed(value, 3) for value in (found[2, 0], *found[:, -1]))])
    if rows:
        print_table(["", "start, 50 %", *(f"end, {share:g} %" for share in SHARES)], rows)
    for text, count in Counter(line for lines in batch.warnings for line in joined(lines)).most_common():
        print(f"{OUTSIDE} in {counted(count, 'flight')}: {text}")
    for i in batch.failed[:LISTED]:
        print(f"flight {i} (seed {batch.cases[i].wind.turbulence_seed}): {batch.errors[i]}")
    if len(batch.failed) > LISTED:
        print(f"and {len(batch.failed) - LISTED} more flights that ended early")
