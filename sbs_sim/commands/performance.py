"""`performance`: power, climb, ceiling and envelope of an aircraft in steady flight."""

import argparse
import math

from sbs_sim.commands.common import add_aircraft_arguments, aircraft, execute, print_table
from sbs_sim.terminal.command_line import Parser
from sbs_sim.terminal.progress import progress_bar

AIRSPEEDS, ALTITUDES = (0.0, 3.0, 6.0, 9.0, 12.0, 15.0, 18.0, 21.0, 24.0, 27.0, 30.0), (0.0, 1000.0, 2000.0, 4000.0)
SHARES = (0.8, 1.0, 1.2, 1.4)  # of the mass of the aircraft


def main() -> int:
    """Executable `performance`."""
    return execute(make_parser(), _work)


def make_parser() -> Parser:
    """Command line of `performance`."""
    parser = Parser(
        "performance",
        example="performance --power 3000 --out performance",
        description="Power over airspeed with best endurance and best range, highest climb rate, ceiling of hover over"
        " the mass, highest airspeed over the altitude, and what stops them: power, stall, controls.",
    )
    add_aircraft_arguments(parser)
    group = parser.add_argument_group("charts")
    group.add_argument(
        "--airspeeds",
        nargs="+",
        type=float,
        default=list(AIRSPEEDS),
        metavar="X",
        help="airspeeds, rising [m/s] (default: 0 to 30 by 3)",
    )
    group.add_argument(
        "--masses",
        nargs="*",
        type=float,
        metavar="X",
        help="masses of the ceiling and the map, rising, none to leave them out [kg] (default: 0.8 to 1.4 of the"
        " aircraft's)",
    )
    group.add_argument(
        "--altitudes",
        nargs="*",
        type=float,
        default=list(ALTITUDES),
        metavar="X",
        help="altitudes of the highest airspeed in the standard atmosphere, rising [m] (default: 0 1000 2000 4000)",
    )
    group.add_argument("--power", type=float, metavar="X", help="shaft power of all rotors [W] (default: no limit)")
    group = parser.add_argument_group("fidelity")
    group.add_argument("--no-lead-lag", dest="lead_lag", action="store_false", help="hold the blades at zero lag")
    group.add_argument(
        "--no-cyclic-inflow", dest="cyclic_inflow", action="store_false", help="hold the cyclic inflow at zero"
    )
    group = parser.add_argument_group("work and output")
    group.add_argument("--workers", type=int, metavar="N", help="threads (default: one for each core)")
    group.add_argument("--csv", metavar="FILE", help="write every point of the charts")
    group.add_argument("--out", metavar="DIR", help="write the charts (PNG, SVG), the CSV and a page (index.html)")
    return parser


def _work(arguments: argparse.Namespace) -> None:
    from sbs_sim.analysis.performance import performance
    from sbs_sim.flight.trim_point import Fidelity
    from sbs_sim.output.files import check_target, write

    check_target(arguments.csv)
    craft = aircraft(arguments)
    if arguments.out:  # a bad path is refused before the work, not after it
        from sbs_sim.analysis.page import make_folder

        make_folder(arguments.out)
    masses = arguments.masses
    if masses is None:
        masses = [round(share * craft.body.mass, 3) for share in SHARES]
    with progress_bar(" points") as progress:
        report = performance(
            craft,
            arguments.airspeeds,
            masses,
            arguments.altitudes,
            available=math.inf if arguments.power is None else arguments.power,
            fidelity=Fidelity(arguments.lead_lag, arguments.cyclic_inflow),
            workers=arguments.workers,
            progress=progress,
        )
    from sbs_sim.analysis import performance_plots as p

    print(p.statement(report))
    print()
    print_table(p.LEVEL, p.level_rows(report), left=(3, 5))
    if len(report.masses):
        print()
        print_table(p.CEILING, p.boundary_rows(report.masses, report.ceilings, 0), left=(3,))
    if len(report.altitudes):
        print()
        print_table(p.FASTEST, p.boundary_rows(report.altitudes, report.fastest, 2), left=(3,))
    if arguments.csv:
        write(arguments.csv, report.to_csv())
    if arguments.out:
        written = p.save_performance(report, arguments.out)
        print(f"\nwritten: {written[-1]} and {len(written) - 1} files")
