"""`reproduce`: the paper's results computed anew, beside the printed ones."""

import argparse
import sys
import textwrap
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from sbs_sim.commands.common import execute, print_table

if TYPE_CHECKING:
    from sbs_sim.analysis.reproduce import Comparison, Report

WIDTH = 130
SHOWN_SPEEDS = 5  # every so many of the forward speeds are printed


def main() -> int:
    """Executable `reproduce`."""
    return execute(_parser(), _work)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="reproduce",
        description="Compute the paper's Tables 1 to 5, its inflow poles and its hover, and print them beside the printed"
        " values, with their ratios; remarks say why something differs.",
    )
    parser.add_argument("--aircraft", default="sbs", metavar="NAME", help="the complete model (default: sbs)")
    parser.add_argument(
        "--paper-aircraft", default="sbs_paper", metavar="NAME", help="the paper's reading (default: sbs_paper)"
    )
    parser.add_argument("--json", metavar="FILE", help="also write everything to this file")
    parser.add_argument(
        "--out", metavar="DIR", help="also write the figures (PNG, SVG) and a page with everything (index.html)"
    )
    return parser


def _work(arguments: argparse.Namespace) -> None:
    from sbs_sim.aircraft import Aircraft
    from sbs_sim.analysis.export import to_json, write
    from sbs_sim.analysis.reproduce import reproduce

    craft, paper_craft = Aircraft.load(arguments.aircraft), Aircraft.load(arguments.paper_aircraft)
    with _progress_bar() as progress:
        report = reproduce(craft, paper_craft, progress=progress)
    sys.stdout.reconfigure(errors="replace")  # type: ignore[union-attr]  # a terminal without ± prints the rest
    _print_report(report)
    if arguments.json:
        write(arguments.json, to_json(report.to_dict()))
    if arguments.out:
        from sbs_sim.analysis.page import save_page

        written = save_page(report, arguments.out)
        print(f"written: {len(written)} files, {written[-1]}")


@contextmanager
def _progress_bar() -> Iterator[Callable[[int, int], None] | None]:
    """A bar on stderr where that is a terminal."""
    if not sys.stderr.isatty():
        yield None
        return
    from tqdm import tqdm

    with tqdm(unit="model", file=sys.stderr, leave=False) as bar:

        def progress(done: int, total: int) -> None:
            bar.total = total
            bar.update(done - bar.n)

        yield progress


def _print_report(report: "Report") -> None:
    from sbs_sim.analysis.reproduce_format import SOURCES, fact_tables, forward_rows

    for name, table in report.tables.items():
        _print_comparison(name, table)
    trims = report.to_dict()["trim_forward"]
    print(f"Trim over forward speed [deg]; in print: {trims['paper'].partition(',')[0]} ...")
    labels = [f"{name} {SOURCES[source]}" for source in report.flights for name in ("pitch", "collective", "longitudinal")]
    for label in labels:
        assert label
    _print_forward(report)
    for heading, headings, rows in fact_tables(report.facts):
        print(heading)
        print_table(headings, rows, left=(0, 1) if headings[1] == "" else tuple(range(len(headings))))
        print()
    print("Remarks")
    for remark in report.remarks:
        _print_wrapped("- ", remark)
    print()
    print(", ".join(f"{name} {version}" for name, version in report.versions.items()))
    for name, value in report.parameter_hashes.items():
        print(f"{SOURCES[name]}: {report.conditions['aircraft'][name]['name']}, parameters {value[:12]}")
    assert forward_rows


def _print_wrapped(mark: str, text: str) -> None:
    print(textwrap.fill(text, WIDTH, initial_indent=mark, subsequent_indent=" " * len(mark)))
