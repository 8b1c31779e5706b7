"""Times the model and the simulator and prints a table: `./run python benchmarks/run.py --help`.

Machines are noisy: every figure is a median, with the spread beside it where there are enough runs.
"""

import argparse
import json
import math
import os
import platform
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import Any

from analysis_rows import analysis_rows
from batch import batch_rows
from model_rows import model_rows
from node_rows import node_rows
from option_rows import option_rows
from peers import peer_rows
from recording import recording_rows
from stitched import stitched_rows

ROOT = Path(__file__).resolve().parent.parent
EXECUTABLES = ROOT / "install" / "sbs_sim" / "lib" / "sbs_sim"
Row = tuple[str, float, str, str]


def main() -> None:
    """Run what the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--json", type=Path, help="also write the figures to this file")
    parser.add_argument(
        "--node", type=float, default=60.0, help="seconds to watch the simulator node, 0 to leave it out"
    )
    parser.add_argument(
        "--memory", type=float, default=0.0, help="minutes to watch the node's memory, 0 to leave it out"
    )
    parser.add_argument("--cold", action="store_true", help="also time a start without caches (half a minute)")
    arguments = parser.parse_args()
    rows: list[Row] = [*model_rows(timed), *option_rows(), *analysis_rows(timed)]
    rows += stitched_rows(timed)
    rows += batch_rows(8, 5.0, 3, len(os.sched_getaffinity(0)))
    rows += [*peer_rows(), *recording_rows(10.0, 2.0), *start_rows(arguments.cold)]
    if arguments.node > 0:
        rows += node_rows(arguments.node, arguments.memory)
    print_table(rows)
    if arguments.json:
        # JSON has no word for the figure of what is not installed.
        present = (row for row in rows if math.isfinite(row[1]))
        figures = {name: {"value": value, "unit": unit, "note": note} for name, value, unit, note in present}
        arguments.json.write_text(json.dumps({"machine": machine(), "figures": figures}, indent=2) + "\n")


def machine() -> dict[str, str]:
    """What the figures belong to."""
    lines = Path("/proc/cpuinfo").read_text().splitlines()
    model = next((line.split(":")[1].strip() for line in lines if line.startswith("model name")), "?")
    packages = {name: version(name) for name in ("numba", "llvmlite", "numpy")}
    load = f"{os.getloadavg()[0]:.2f}"
    return {"cpu": model, "cores": str(os.cpu_count()), "python": platform.python_version(), "load": load, **packages}


def print_table(rows: list[Row]) -> None:
    """Figures in columns, the machine above."""
    print(", ".join(f"{key} {value}" for key, value in machine().items()))
    width = max(len(name) for name, *_ in rows)
    for name, value, unit, note in rows:
        print(f"{name:<{width}}  {value:>10.4g} {unit:<6} {note}")


def timed(work: Callable[[], Any], repeats: int, clock: Callable[[], float] = time.perf_counter) -> tuple[float, str]:
    """Median time of a call [s] by a clock, and the spread of the middle half in per cent."""
    work()
    times = []
    for _ in range(repeats):
        start = clock()
        work()
        times.append(clock() - start)
    low, median, high = statistics.quantiles(times, n=4)
    return median, f"median of {repeats}, middle half within {100 * (high - low) / median:.0f} %"


# --- start ------------------------------------------------------------------------------------------------------


def start_rows(cold: bool) -> list[Row]:
    """Time to start, with warm caches and, if asked for, with none."""
    rows: list[Row] = []
    first = "from sbs_sim import *; trim(Aircraft.load('sbs'))"
    for name, code in (("import sbs_sim", "import sbs_sim"), ("import, load, trim", first)):
        seconds, note = timed(lambda code=code: subprocess.run([sys.executable, "-c", code], check=True), 5)
        rows.append((f"process: {name}", seconds, "s", note))
    command = [sys.executable, str(EXECUTABLES / "trim")]
    seconds, note = timed(lambda: subprocess.run(command, check=True, stdout=subprocess.DEVNULL), 5)
    rows.append(("process: command trim", seconds, "s", note))
    if cold:
        with tempfile.TemporaryDirectory() as folder:
            start = time.perf_counter()
            subprocess.run([sys.executable, "-c", first], check=True, env={**os.environ, "NUMBA_CACHE_DIR": folder})
            rows.append(
                ("process: import, load, trim, cold", time.perf_counter() - start, "s", "compiles what trim needs")
            )
    return rows


if __name__ == "__main__":
    main()
