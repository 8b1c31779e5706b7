"""Feed malformed and extreme inputs to every fuzz target and print the findings.

    ./run python tools/robustness/fuzz.py [--inputs 20000] [--seed 1] [--no-nodes] [--coverage-guided 60]

Malformed and extreme inputs for the Python functions, the readers of aircraft, airfoil and log files, the command
lines, and over real DDS for the topics, services, parameters and the action of a running simulator. Each must be taken
or refused in one line, within a few seconds; nothing may be written outside the folder; afterwards the memory and the
open files of the simulator must not have grown, the aircraft must still fly, and the logs of it all must be flown again
bit for bit.
`--coverage-guided` spends as many seconds on each of the readers of YAML and MCAP with atheris, if that is installed.

The exit code is 1 if something is wrong; each finding is printed with the input that led to it.
"""

import argparse
import contextlib
import os
import socket
import subprocess
import sys
import tempfile
import time
import traceback
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from hypothesis import HealthCheck, Phase, given, seed, settings

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "test" / "support"), str(ROOT / "tools")]

import fuzz_targets  # noqa: E402

from sbs_sim import checks  # noqa: E402

SLOWEST = 60.0  # s that one input may take on a busy machine
GROWTH = 30e6  # bytes that the simulator may grow by: caches, queues
MAGIC = b"\x89MCAP"
BATCH = 500  # inputs between looks at the clock


class Finding:
    """Something wrong, with the first input that led to it."""

    def __init__(self, error: BaseException, value: Any) -> None:
        self.count, self.value = 0, value
        self.text = "".join(traceback.format_exception(error)[-4:])


def main() -> int:
    """Do what the command line asks for; the exit code."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--inputs", type=int, default=20_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--no-nodes", action="store_true", help="leave the running simulator out")
    parser.add_argument(
        "--coverage-guided", type=float, default=0.0, metavar="SECONDS", help="with atheris, per reader"
    )
    arguments = parser.parse_args()
    with contextlib.ExitStack() as stack:
        live = None if arguments.no_nodes else stack.enter_context(_running())
        every = [
            *fuzz_targets.FUZZ_TARGETS,
            *((*live.targets(), *live.pilots.targets(), *live.page.targets()) if live else ()),
        ]
        whole = sum(target.share for target in every)
        wrong = sum(
            _push(target, max(5, round(arguments.inputs * target.share / whole)), arguments.seed) for target in every
        )
        if live:
            wrong += _check_afterwards(live)
    for reader in ("yaml", "mcap") if arguments.coverage_guided else ():
        wrong += _guided(reader, arguments.coverage_guided, arguments.seed)
    print(f"{wrong} wrong" if wrong else "nothing wrong")
    return 1 if wrong else 0


def _push(target: fuzz_targets.FuzzTarget, count: int, number: int) -> int:
    """Feed a target `count` inputs and print a line; the number of different findings."""
    findings: dict[tuple[Any, ...], Finding] = {}
    taken = [0, 0.0]
    begin = time.monotonic()

    def push(value: Any) -> None:
        start = time.monotonic()
        try:
            target.check(value)
            took = time.monotonic() - start
            assert took < SLOWEST, f"took {took:.0f} s"
        except Exception as error:
            places = [(frame.filename, frame.lineno) for frame in traceback.extract_tb(error.__traceback__)]
            finding = findings.setdefault((type(error), *places[-2:]), Finding(error, value))
            finding.count += 1
        taken[0] += 1
        taken[1] = max(taken[1], time.monotonic() - start)

    quiet = settings(
        max_examples=count,
        deadline=None,
        database=None,
        phases=[Phase.generate],
        suppress_health_check=list(HealthCheck),
    )
    # in batches of other seeds: what hypothesis has tried before it does not try again, and small spaces come to an end
    for batch in range(20):
        if taken[0] < count:
            seed(1000 * number + batch)(quiet(given(target.inputs)(push)))()
    seconds = time.monotonic() - begin
    print(
        f"{target.name:24} {taken[0]:6} inputs  {seconds:6.1f} s  slowest {taken[1]:6.3f} s  {len(findings)} wrong",
        flush=True,
    )
    for finding in findings.values():
        print(f"  {finding.count} times, first by {checks.shown(finding.value)}\n{finding.text}", flush=True)
    return len(findings)


# --- a running simulator --------------------------------------------------------------------------------------------


@contextlib.contextmanager
def _running() -> Iterator[Any]:
    """A client of a simulator with all its components."""
    import node_fuzz_targets
    from ros_harness import DOMAINS, world

    domain = next(DOMAINS)
    with tempfile.TemporaryDirectory() as name, world(domain, Path(name)) as made, contextlib.ExitStack() as stack:
        process = made.start("simulator", record=Path(name) / "fuzz.mcap")
        live = node_fuzz_targets.Live(domain, process)
        live.log = Path(name) / "fuzz.mcap"
        live.pilots = stack.enter_context(contextlib.closing(node_fuzz_targets.Pilots(made)))
        live.page = stack.enter_context(contextlib.closing(_page(made)))
        for target in live.targets():  # what is loaded with the first use is no leak
            _quietly(target, 50)
        live.before = live.memory()
        try:
            yield live
        finally:
            live.close()


def _page(made: Any) -> Any:
    """A client of a cockpit that flies the simulator."""
    import node_fuzz_targets

    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    cockpit = made.start("cockpit", arguments=["--attach", "--port", str(port)])
    made.client.until(lambda: node_fuzz_targets.served(port), "the page")
    return node_fuzz_targets.Page(port, lambda: cockpit.running)


def _quietly(target: fuzz_targets.FuzzTarget, count: int) -> None:
    with contextlib.redirect_stdout(open(os.devnull, "w")):
        _push(target, count, 99)


def _check_afterwards(live: Any) -> int:
    """Flies, has not grown, and its logs are whole; the number of things wrong."""
    return sum(
        _held(name, check)
        for name, check in (
            ("flies", live.check_alive),
            ("pilots", live.pilots.check_alive),
            ("page", live.page.check_alive),
            ("grown", lambda: _grown(live)),
            ("log", lambda: _log(live)),
        )
    )


def _held(name: str, check: Callable[[], None]) -> int:
    try:
        check()
    except Exception:
        print(f"{name}: {traceback.format_exc()}")
        return 1
    return 0


def _grown(live: Any) -> None:
    (memory, files), (memory_now, files_now) = live.before, live.memory()
    print(f"simulator: memory {memory / 1e6:.1f} to {memory_now / 1e6:.1f} MB, open files {files} to {files_now}")
    assert memory_now - memory < GROWTH
    assert files_now <= files + 2


def _log(live: Any) -> None:
    """The simulator ends, and everything that it accepted gives the same states again, in whichever log it is."""
    import soak

    assert live.process.interrupt() == 0, live.process.output
    files = (path for path in live.log.parent.rglob("*") if path.is_file())  # a request may name a log as it likes
    logs = [path for path in files if _begins_with(path, MAGIC)]
    assert live.log in logs
    text, good = soak.verified(logs)
    print(text)
    assert good


def _begins_with(path: Path, magic: bytes) -> bool:
    with path.open("rb") as file:
        return file.read(len(magic)) == magic


# --- guided by coverage ---------------------------------------------------------------------------------------------

GUIDED = """
import importlib, pkgutil, sys
import atheris
import sbs_sim.model
for module in pkgutil.iter_modules(sbs_sim.model.__path__, "sbs_sim.model."):
    importlib.import_module(module.name)  # before: what is instrumented cannot be compiled
with atheris.instrument_imports(include=["sbs_sim.aircraft", "sbs_sim.recording", "ruamel.yaml", "mcap"]):
    import fuzz_targets
check = {"yaml": fuzz_targets.check_yaml, "mcap": fuzz_targets.check_reading}[sys.argv[1]]
atheris.Setup([sys.argv[0], *sys.argv[2:]], check)
atheris.Fuzz()
"""


def _guided(reader: str, seconds: float, number: int) -> int:
    """Let atheris search for new ways through a reader, starting from the files that the package has."""
    with tempfile.TemporaryDirectory() as name:
        corpus = Path(name) / "corpus"
        corpus.mkdir()
        for i, content in enumerate(fuzz_targets.YAML_TEXTS if reader == "yaml" else [fuzz_targets.SMALL_LOG]):
            (corpus / str(i)).write_bytes(content)
        (Path(name) / "guided.py").write_text(GUIDED)
        limits = [f"-max_total_time={seconds:.0f}", f"-timeout={SLOWEST:.0f}", "-max_len=300000", "-rss_limit_mb=4096"]
        command = [sys.executable, "guided.py", reader, *limits, f"-seed={number}", str(corpus)]
        paths = os.pathsep.join([str(ROOT / "test" / "support"), str(ROOT), os.environ.get("PYTHONPATH", "")])
        ended = subprocess.run(
            command, cwd=name, env={**os.environ, "PYTHONPATH": paths}, capture_output=True, text=True, check=False
        )
        if "No module named 'atheris'" in ended.stderr:
            print(f"{reader}, guided: atheris is not installed: ./run python -m pip install atheris==3.0.0")
            return 1
        done = [line for line in ended.stderr.splitlines() if "DONE" in line or "cov:" in line]
        print(f"{reader}, guided: {done[-1] if done else ended.stderr[-2000:]}")
        if ended.returncode:
            print(ended.stderr[-4000:])
        return int(ended.returncode != 0)


if __name__ == "__main__":
    sys.exit(main())
