"""Command `plot`: a recorded flight over time."""

import argparse
import sys
from pathlib import Path

from sbs_sim.commands.common import execute
from sbs_sim.terminal.command_line import Parser


def main() -> None:
    """Draw what the command line names."""
    sys.exit(execute(make_parser(), _work))


def make_parser() -> Parser:
    """Command line of `plot`."""
    parser = Parser(
        "plot",
        example="plot bags/hover_step.mcap --out hover_step.html",
        description="Draw a recorded flight over time.",
    )
    parser.add_argument("file", type=Path, help="MCAP log")
    parser.add_argument(
        "--out",
        type=Path,
        action="append",
        metavar="FILE",
        help=".png, .svg or .html; may be repeated (default: the log's name with .png)",
    )
    parser.add_argument(
        "--flight", type=int, metavar="NUMBER", help="which flight of a file with several flights, from 1"
    )
    return parser


def _work(arguments: argparse.Namespace) -> None:
    from sbs_sim.output.files import check_target
    from sbs_sim.recording import read
    from sbs_sim.recording.plot import SUFFIXES, plot

    targets = arguments.out or [Path(f"{arguments.file.stem or 'log'}.png")]  # "." has no name
    for path in targets:
        check_target(path, SUFFIXES)
    log = read(arguments.file).flight(arguments.flight)
    if not log.complete:
        print(f"{arguments.file} is not complete: {'; '.join(log.reasons)}", file=sys.stderr)
    for path in targets:
        print(f"written: {plot(log, path)}")
