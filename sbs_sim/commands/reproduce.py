"""`reproduce`: the paper's results computed anew, beside the printed ones."""

import argparse
import textwrap
from typing import TYPE_CHECKING

from sbs_sim.commands.common import execute, print_table
from sbs_sim.terminal.command_line import Parser
from sbs_sim.terminal.progress import progress_bar

if TYPE_CHECKING:
    from sbs_sim.analysis.reproduce import Comparison, Report

WIDTH = 130
SHOWN_SPEEDS = 5  # every so many of the forward speeds are printed


def main() -> int:
    """Executable `reproduce`."""
    return execute(make_parser(), _work)


def make_parser() -> Parser:
    """Command line of `reproduce`."""
    parser = Parser(
        "reproduce",
        example="reproduce --out report",
        description="Compute the paper's Tables 1 to 5, its inflow poles and its trims, and print them beside the"
        " printed values, with their ratios. Remarks give the reasons for differences.",
    )
    parser.add_argument(
        "--aircraft",
        metavar="NAME",
        help="aircraft of the complete model (default: sbs without lag dampers, of which the paper has none)",
    )
    parser.add_argument(
        "--paper-aircraft",
        default="sbs_paper",
        metavar="NAME",
        help="aircraft of the paper's reading (default: sbs_paper)",
    )
    parser.add_argument("--json", metavar="FILE", help="also write everything to this file")
    parser.add_argument(
        "--out", metavar="DIR", help="also write the figures (PNG, SVG) and a page with everything (index.html)"
    )
    return parser


def _work(arguments: argparse.Namespace) -> None:
    from sbs_sim.aircraft import Aircraft
    from sbs_sim.analysis.reproduce import reproduce, undamped_sbs
    from sbs_sim.output.files import check_target, write
    from sbs_sim.output.json_text import to_json

    check_target(arguments.json)
    craft = Aircraft.load(arguments.aircraft) if arguments.aircraft else undamped_sbs()
    paper_craft = Aircraft.load(arguments.paper_aircraft)
    if arguments.out:  # a bad path is refused before the work, not after it
        from sbs_sim.analysis.page import make_folder

        make_folder(arguments.out)
    with progress_bar("model") as progress:
        report = reproduce(craft, paper_craft, progress=progress)
    if arguments.json:
        write(arguments.json, to_json(report.to_dict()))
    _print_report(report)
    if arguments.out:
        from sbs_sim.analysis.page import save_page

        with progress_bar("figure") as progress:
            written = save_page(report, arguments.out, progress=progress)
        print(f"written: {written[-1]} and {len(written) - 1} figures")


def _print_report(report: "Report") -> None:
    """Tables, trim curves, facts, remarks, circumstances."""
    from sbs_sim.analysis.reproduce_format import SOURCES, fact_tables, forward_table

    for name, table in report.tables.items():
        _print_comparison(name, table)
    for heading, headings, rows in (forward_table(report, SHOWN_SPEEDS), *fact_tables(report)):
        _print_wrapped("", heading)
        print_table(headings, rows, left=[i for i in range(len(headings)) if not _is_number(rows[-1][i])])
        print()
    print("Remarks")
    for remark in report.remarks:
        _print_wrapped("- ", remark)
    print()
    print(", ".join(f"{name} {version}" for name, version in report.versions.items()))
    for name, own in report.conditions["aircraft"].items():
        print(f"{SOURCES[name]}: {own['name']}, parameters {report.parameter_hashes[name][:12]}")


def _print_comparison(name: str, table: "Comparison") -> None:
    """One table: print, ours and ratios; the same things computed otherwise; the remarks."""
    from sbs_sim.analysis import reproduce_format as f

    numbers, others = f.notes(table), f.other_names(table)
    main, further, last = [], [], ""
    for group, label, entry in f.rows(table):
        if group != last:
            main.append([table.group_labels[group]] + [""] * 6)
            further.append([table.group_labels[group]] + [""] * len(others))
            last = group
        note = f"[{numbers[entry.remark]}]" if entry.remark and not label.startswith(" ") else ""
        ratios = [f.ratio_text(entry, ours) for ours in (entry.complete, entry.paper_reading)]
        values = [f.value_text(value) for value in (entry.complete, entry.paper_reading)]
        main.append([label, entry.printed.text or "-", values[0], ratios[0], values[1], ratios[1], note])
        if any(other in entry.others for other in others):
            further.append([label, *(f.value_text(entry.others.get(other)) for other in others)])
    print(f.title(name, table))
    print_table(["", *f.HEADINGS, ""], main, left=(0, 1, 2, 4, 6))
    print()
    print_table(["computed otherwise", *(f.OTHERS[other] for other in others)], further, left=range(1 + len(others)))
    print()
    for remark, number in numbers.items():
        _print_wrapped(f"[{number}] ", remark)
    print()


def _is_number(text: str) -> bool:
    try:
        float(text.rstrip("*"))
    except ValueError:
        return False
    return True


def _print_wrapped(mark: str, text: str) -> None:
    print(textwrap.fill(text, WIDTH, initial_indent=mark, subsequent_indent=" " * len(mark)))
