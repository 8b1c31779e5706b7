"""`validate`: published results beside ours."""

import argparse
import sys
import textwrap
from typing import TYPE_CHECKING

from sbs_sim.commands.common import execute, print_table
from sbs_sim.errors import ValidationError
from sbs_sim.terminal.command_line import Parser
from sbs_sim.terminal.progress import progress_bar

if TYPE_CHECKING:
    from sbs_sim.analysis.validation import Report

WIDTH = 130


def main() -> int:
    """Executable `validate`."""
    return execute(make_parser(), _work)


def make_parser() -> Parser:
    """Command line of `validate`."""
    parser = Parser(
        "validate",
        example="validate castles_gray --page validation.html",
        description="Compute what others have measured or published, and print it beside theirs, with the difference,"
        " the aim and whether it is met. An aim that is missed is no error: remarks say why.",
    )
    parser.add_argument("case", nargs="*", help="names of cases (default: all; --list names them)")
    parser.add_argument("--list", action="store_true", help="only name the cases")
    parser.add_argument("--json", metavar="FILE", help="also write everything to this file")
    parser.add_argument("--page", metavar="FILE", help="also write a page with everything (HTML)")
    parser.add_argument("--strict", action="store_true", help="exit with 1 if an aim is missed")
    return parser


def _work(arguments: argparse.Namespace) -> None:
    from sbs_sim.analysis.validation import CASES, validate
    from sbs_sim.analysis.validation.comparison import MISSED
    from sbs_sim.analysis.validation.formats import page_text
    from sbs_sim.output.files import check_target, write
    from sbs_sim.output.json_text import to_json

    if arguments.list:
        print("\n".join(CASES))
        return
    check_target(arguments.json)
    check_target(arguments.page)
    with progress_bar("case") as progress:
        report = validate(arguments.case, progress=progress)
    if arguments.json:
        write(arguments.json, to_json(report.to_dict()))
    if arguments.page:
        write(arguments.page, page_text(report))
    _print_report(report)
    if arguments.strict and report.verdict == MISSED:
        missed = sum(case.count(MISSED) for case in report.cases)
        sys.stdout.flush()
        raise ValidationError(f"{missed} aims are missed")


def _print_report(report: "Report") -> None:
    from sbs_sim.analysis.validation import formats as f

    _print_wrapped("", report.model)
    for case in report.cases:
        print(f"\n{case.title}")
        for label, text in f.paragraphs(case):
            _print_wrapped(f"{label}: ", text)
        print()
        if case.rows:
            print_table(f.HEADINGS, [f.row_cells(row) for row in case.rows], left=f.TEXT_COLUMNS)
        for table in case.tables:
            print_table(f.table_headings(table), f.table_cells(table), left=f.TABLE_TEXT_COLUMNS)
            print()
        for label, text in f.remarks(case):
            _print_wrapped(f"{label}: ", text)
    print()
    print_table(f.SUMMARY_HEADINGS, f.summary_rows(report))


def _print_wrapped(mark: str, text: str) -> None:
    print(textwrap.fill(text, WIDTH, initial_indent=mark, subsequent_indent="  "))
