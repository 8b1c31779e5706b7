"""`qualities`: flying qualities of an aircraft over airspeed, with levels."""

import argparse
import textwrap
from typing import TYPE_CHECKING

from sbs_sim.commands.common import (
    UsageError,
    actuator,
    add_actuator_argument,
    add_aircraft_arguments,
    aircraft,
    execute,
    print_table,
)
from sbs_sim.terminal.command_line import Parser
from sbs_sim.terminal.progress import progress_bar

if TYPE_CHECKING:
    from sbs_sim.aircraft import Aircraft
    from sbs_sim.analysis.linear_loop import LawOf
    from sbs_sim.analysis.qualities import Qualities

WIDTH = 130
CONTROLLERS = {"augmentation": "the augmentation", "hover-hold": "the hover hold"}


def main() -> int:
    """Executable `qualities`."""
    return execute(make_parser(), _work)


def make_parser() -> Parser:
    """Command line of `qualities`."""
    parser = Parser(
        "qualities",
        example="qualities --airspeeds 0 5 10 15 20 --delay 0.02 --out qualities",
        description="Judge the flying qualities of an aircraft over airspeed from its linear models: bandwidth and"
        " phase delay of the attitudes, heave, coupling, modes, with the levels of ADS-33E-PRF for its size.",
    )
    add_aircraft_arguments(parser)
    group = parser.add_argument_group("flying qualities")
    group.add_argument(
        "--airspeeds",
        nargs="+",
        type=float,
        metavar="V",
        help="in m/s (default: five from hover, to 20 m/s for a lateral span of 2.3 m, by Froude's scaling)",
    )
    group.add_argument(
        "--delay",
        type=float,
        default=0.0,
        metavar="X",
        help="of sensors, computers and actuators beside the model [s] (default: 0)",
    )
    add_actuator_argument(group)
    group.add_argument(
        "--scale-length",
        type=float,
        metavar="L",
        help="length of the aircraft for the 16.36 m of the UH-60A's rotor [m]: frequencies of the boundaries scale"
        " with sqrt(16.36 / L) (default: the lateral span, and beside it the rotor radius for 8.178 m)",
    )
    group.add_argument(
        "--attitude-command",
        action="store_true",
        help="a step of a control commands an attitude: the bandwidth is that of the phase alone",
    )
    group.add_argument(
        "--controller",
        metavar="NAME|FILE",
        help="close the loop with a controller: augmentation, whose sticks command attitudes, or hover-hold, designed"
        " at each airspeed; or the envelope controller of a file of `design`, with attitudes commanded",
    )
    group.add_argument(
        "--bare", action="store_true", help="with --controller: the aircraft without it in the same table, row by row"
    )
    group.add_argument("--workers", type=int, metavar="N", help="threads (default: one for each core)")
    group = parser.add_argument_group("output")
    group.add_argument("--json", metavar="FILE", help="also write everything to this file")
    group.add_argument("--out", metavar="DIR", help="also write the figures (PNG, SVG) and a page (index.html)")
    return parser


def _work(arguments: argparse.Namespace) -> None:
    from sbs_sim.analysis import qualities_format as f
    from sbs_sim.output.files import check_target, write
    from sbs_sim.output.json_text import to_json

    check_target(arguments.json)
    law = _law(arguments.controller)
    if arguments.bare and law is None:
        raise UsageError("--bare: allowed with --controller")
    craft = aircraft(arguments)
    if arguments.out:  # a bad path is refused before the work, not after it
        from sbs_sim.analysis.page import make_folder

        make_folder(arguments.out)
    report = _judged(arguments, craft, law)
    bare = _judged(arguments, craft, None) if arguments.bare else None
    if arguments.json:
        write(arguments.json, to_json(report.to_dict()))
    _print_wrapped("", f.statement(report))
    for i, scale in enumerate(report.scales):
        print(f"\nby {scale.text}")
        if bare is not None:
            print_table(f.both_headings(report), f.both_table(bare, report, i), left=(0, 1, 4))
        else:
            print_table(f.headings(report), f.table(report, i), left=(0, 1))
    for title, lines in (("remarks", f.remarks(report)), ("boundaries", f.boundaries(report))):
        print(f"\n{title}")
        for line in lines:
            _print_wrapped("- ", line)
    if arguments.out:
        from sbs_sim.analysis.qualities_plots import save_qualities

        with progress_bar("figure") as progress:
            written = save_qualities(report, arguments.out, progress=progress)
        print(f"\nwritten: {written[-1]} and {len(written) - 1} files")


def _judged(arguments: argparse.Namespace, craft: "Aircraft", law: "LawOf | None") -> "Qualities":
    """With a law, or without any."""
    from sbs_sim.analysis.qualities import qualities

    with progress_bar("airspeed") as progress:
        return qualities(
            craft,
            arguments.airspeeds,
            delay=arguments.delay,
            scale_length=arguments.scale_length,
            actuator=actuator(arguments),
            law=law,
            law_name=CONTROLLERS.get(arguments.controller, "the envelope controller"),
            is_rate_command=not arguments.attitude_command,
            workers=arguments.workers,
            progress=progress,
        )


def _law(name: str | None) -> "LawOf | None":
    """Of a controller."""
    if name is None:
        return None
    from sbs_sim.pilot.linear_laws import attitude_law, augmentation_law, hover_hold_law

    if name in CONTROLLERS:
        return augmentation_law if name == "augmentation" else hover_hold_law
    from sbs_sim.pilot.envelope_file import load_envelope

    found = load_envelope(name)
    return lambda model: attitude_law(model, found)


def _print_wrapped(mark: str, text: str) -> None:
    print(textwrap.fill(text, WIDTH, initial_indent=mark, subsequent_indent=" " * len(mark)))
