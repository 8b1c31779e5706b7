"""Bars that show on a terminal how far long work is, and nothing elsewhere."""

import logging
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

COMPILER = "sbs_sim.model.kernel"  # logger of what compiles


def show_compiling() -> None:
    """Show on a terminal when kernels are compiled, for which a person else waits without a word."""
    logger = logging.getLogger(COMPILER)
    if logger.handlers or sys.stderr is None or not sys.stderr.isatty():  # once in a process
        return
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(logging.Formatter("sbs_sim: %(message)s"))
    logger.addHandler(handler)
    logger.setLevel(logging.INFO)


@contextmanager
def progress_bar(unit: str, total: float | None = None) -> Iterator[Callable[..., None] | None]:
    """A function that draws progress as a bar on stderr; its last two arguments are what is done and the total.

    None if stderr is no terminal.

    Parameters
    ----------
    unit : str
        What is counted.
    total : float, optional
        Where it is known from the beginning.
    """
    if not sys.stderr.isatty():
        yield None
        return
    from tqdm import tqdm

    with tqdm(total=total, unit=unit, file=sys.stderr, leave=False) as bar:

        def progress(*arguments: Any) -> None:
            done, known = arguments[-2:]
            bar.update(done - bar.n)  # less than nothing where work begins again
            if known != bar.total:
                bar.total = known
                bar.refresh()  # which else waits for the next tenth of a second

        yield progress
