"""`aircraft`: an aircraft file with a comment behind each key, changed if wanted, or a URDF."""

import argparse
import sys

from sbs_sim.commands.common import add_aircraft_arguments, aircraft, execute
from sbs_sim.terminal.command_line import Parser


def main() -> int:
    """Executable `aircraft`."""
    return execute(make_parser(), _work)


def make_parser() -> Parser:
    """Command line of `aircraft`."""
    parser = Parser(
        "aircraft",
        example="aircraft --set body.mass=25 --out heavy.yaml",
        description="Write an aircraft as a file in which a comment behind each key has its unit and meaning: a start"
        " for an aircraft of your own, or a variant that keeps what --set changed.",
    )
    add_aircraft_arguments(parser)
    parser.add_argument(
        "--out",
        metavar="FILE",
        help="file to write, .yaml, or .urdf for robotics tools (default: YAML on the terminal)",
    )
    return parser


def _work(arguments: argparse.Namespace) -> None:
    from sbs_sim.aircraft.commented_yaml import commented_yaml
    from sbs_sim.output.files import check_target, write
    from sbs_sim.output.robot import urdf

    check_target(arguments.out, (".yaml", ".yml", ".urdf"))
    convert = urdf if str(arguments.out).lower().endswith(".urdf") else commented_yaml
    text = convert(aircraft(arguments))
    if arguments.out is None:
        sys.stdout.write(text)
    else:
        write(arguments.out, text)
        print(f"written: {arguments.out}")
