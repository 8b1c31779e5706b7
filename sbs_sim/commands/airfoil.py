"""`airfoil`: airfoil data of other programs as a table of ours, or as a C81 table."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from sbs_sim.commands.common import UsageError, execute, print_table
from sbs_sim.terminal.command_line import Parser

if TYPE_CHECKING:
    from sbs_sim.model.airfoil import AirfoilTable

EXTENSIONS = ("viterna", "montgomerie", "plate", "hold", "none")
SUFFIXES = (".csv", ".c81")
ASPECT_RATIO = 10.0


def main() -> int:
    """Executable `airfoil`."""
    return execute(make_parser(), _work)


def make_parser() -> Parser:
    """Command line of `airfoil`."""
    parser = Parser(
        "airfoil",
        example="airfoil config/airfoils/naca0015.csv --reynolds 300000 --out naca0015.c81",
        description="Read airfoil data, say what is in it, and write it as a table that aircraft files take (CSV), or"
        " as a C81 table. Several files are polars of one airfoil at several Reynolds or at several Mach numbers.",
    )
    parser.add_argument("file", nargs="+", type=Path, help="C81 table, XFOIL or XFLR5 polar, AeroDyn file, or CSV")
    parser.add_argument("--out", type=Path, metavar="FILE", help=".csv or .c81 to write (default: none)")
    parser.add_argument(
        "--extend",
        choices=EXTENSIONS,
        default=EXTENSIONS[0],
        help="how polars that end near stall go on to 180 deg (default: viterna); with none they are extended when an"
        " aircraft is loaded, for the aspect ratio of its blades",
    )
    parser.add_argument(
        "--aspect-ratio",
        type=float,
        default=ASPECT_RATIO,
        metavar="X",
        help="length of the blade over its chord, for the extension (default: 10)",
    )
    parser.add_argument(
        "--over",
        choices=("reynolds", "mach"),
        help="what the table is over, where both numbers vary from file to file (default: the one that varies)",
    )
    parser.add_argument(
        "--reynolds", type=float, metavar="X", help="take the table at this Reynolds number only, as C81 tables need it"
    )
    return parser


def _work(arguments: argparse.Namespace) -> None:
    from sbs_sim.aircraft.airfoil_files import import_airfoil
    from sbs_sim.aircraft.airfoil_files.table import at_reynolds
    from sbs_sim.output.files import check_target, write

    if not 0.0 < arguments.aspect_ratio < float("inf"):
        raise UsageError(f"--aspect-ratio {arguments.aspect_ratio:g}: allowed is a number greater than 0")
    check_target(arguments.out, SUFFIXES)
    table, airfoil, notes = import_airfoil(
        arguments.file,
        arguments.out.stem if arguments.out else "",
        extension=None if arguments.extend == "none" else arguments.extend,
        aspect_ratio=arguments.aspect_ratio,
        axis=arguments.over,
    )
    if arguments.reynolds is not None:
        table = at_reynolds(table, arguments.reynolds)
        notes.append(f"taken at Reynolds number {arguments.reynolds:g}")
    text = _text(table, airfoil, arguments, notes) if arguments.out else None
    print("\n".join(notes))
    _print_summary(table)
    if text is not None:
        write(arguments.out, text)
        print(f"written: {arguments.out}")


def _text(table: "AirfoilTable", name: str, arguments: argparse.Namespace, notes: list[str]) -> str:
    """Content of the file to write, which can be read; adds to the notes what is lost in it."""
    from sbs_sim.aircraft.airfoil_files.c81 import c81_text
    from sbs_sim.errors import AirfoilError
    from sbs_sim.model.airfoil import parse_table, table_text

    if arguments.out.suffix.lower() == ".c81":
        text, (lift, drag) = c81_text(table, name)
        notes.append(f"between the angles of the C81 table lift is off by up to {lift:.2g}, drag by up to {drag:.2g}")
        return text
    text = table_text(table, ["Made by `sbs-sim airfoil`.", *notes])
    try:
        parse_table(arguments.out, text, arguments.aspect_ratio)
    except AirfoilError as error:
        raise AirfoilError(f"not written, for no aircraft could read it: {error}") from None
    return text


def _print_summary(table: "AirfoilTable") -> None:
    """Characteristics of each polar."""
    import numpy as np

    from sbs_sim.model.airfoil import NUMBER_NAMES, stall_angles

    degrees = np.degrees(table.alpha)
    highest, lowest = (np.degrees(angles) for angles in stall_angles(table))
    print(f"{len(table.numbers)} x {len(degrees)}: {degrees[0]:g} to {degrees[-1]:g} deg")
    rows = list[list[str]]()
    for i, number in enumerate(table.numbers):
        attached = np.abs(degrees) <= max(5.0, float(np.abs(degrees[np.abs(degrees) > 0]).min()))
        slope, zero = np.polyfit(table.alpha[attached], table.cl[i, attached], 1)
        peak = float(np.interp(highest[i], degrees, table.cl[i]))
        without_lift = round(float(np.degrees(-zero / slope)), 2) + 0.0 if slope else 0.0
        shown = f"{number:g}" if number or len(table.numbers) > 1 else "all"
        cells = [shown, f"{slope:.3f}", f"{without_lift:.2f}", f"{peak:.3f}"]
        rows.append([*cells, f"{highest[i]:.4g}", f"{lowest[i]:.4g}", f"{table.cd[i].min():.5f}"])
    headings = [NUMBER_NAMES[table.axis], "slope [1/rad]", "no lift [deg]", "cl at stall", "stall [deg]", "below [deg]"]
    print_table([*headings, "least cd"], rows)
