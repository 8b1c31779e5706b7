"""Change the model and the analyses in small ways, and see whether a test fails at each.

    ./run python -m pip install --target build/mutate cosmic-ray==8.7.0
    ./run python tools/robustness/mutate.py [MODULE ...] [--mutants 20] [--seed 1]

A mutant is a copy of the package with one change that cosmic-ray makes: another of + - * /, of the comparisons, of
`and` and `or`; a number one more or less; a sign lost, a condition turned round; a loop that does not run. Of all that
are possible in a module a sample is drawn, the same for the same seed; `--mutants 0` takes them all. The tests of the
module (MODULES below) run on each, up to the first that fails: the mutant is killed. Those that no test fails at are
printed; each either changes nothing that can be observed, or marks what these tests do not see.

Kernels run as plain Python here (NUMBA_DISABLE_JIT): what is executed is what was changed, and the tests are those that
are quick that way. Analyses run on the compiled model, which no mutant changes. cosmic-ray is not among the
requirements, for nothing but this needs it; the folder above keeps it apart from what the package runs with.

The exit code is 1 if the tests of a module fail already without a change.
"""

import argparse
import contextlib
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any, NamedTuple

ROOT = Path(__file__).resolve().parents[2]
TOOL = ROOT / "build" / "mutate"
LIMIT = 5.0  # a mutant that takes so many times what the tests need unchanged is one that does not end
GRACE = 20.0  # s that are added to it, for a machine that becomes busy

REFERENCE = tuple(
    f"test_dynamics.py::test_derivative_and_loads_equal_the_plain_reference[{name}]"
    for name in ("tilted_shafts", "four_and_five_blades", "paper_and_odd_blades", "high_reynolds")
)
MODULES: dict[str, tuple[str, ...]] = {
    "model/section": REFERENCE,
    "model/blade": REFERENCE,
    "model/dynamics": (
        *REFERENCE,
        "test_two_loop.py::test_balance_equals_the_plain_reference[tilted-True]",
        "test_two_loop.py::test_balance_equals_the_plain_reference[four and five blades-False]",
    ),
    "model/inflow": (*REFERENCE, "test_inflow.py"),
    "model/multiblade": (*REFERENCE, "test_dynamics.py::test_multiblade_transform_is_one_to_one"),
    "model/airfoil": ("test_airfoil.py", "test_edges.py::test_stall_begins_where_lift_stops_to_grow"),
    "model/frames": ("test_frames.py",),
    "model/wind": ("test_wind.py", "-k", "not sbs and not flight and not pushes and not shakes"),
    "model/working_state": ("test_working_state.py",),
    "model/ground": ("test_working_state.py",),
    "model/trigonometry": ("test_trigonometry.py",),
    "model/integrate": ("test_integrate.py", "-k", "kutta or figure_3 or tsitouras_s or tsitouras_c or ends_before"),
    "model/exponential": ("test_integrate.py", "-k", "krogstads or coefficients or linear_part"),
    "model/average": ("test_linear.py::test_average_is_the_mean_over_the_azimuths",),
    "model/linear": ("test_linear.py::test_jacobian_is_the_difference_of_the_outputs",),
    "model/fuselage": REFERENCE,
    "model/duct": REFERENCE,
    "flight/trim_point": ("test_trim.py",),
    "analysis/linearize": ("test_linearize.py",),
    "analysis/linear_model": ("test_linearize.py",),
    "analysis/differences": ("test_linearize.py",),
    "analysis/kinematics": ("test_linearize.py",),
    "analysis/trim_problem": ("test_trim.py", "test_two_loop.py"),
    "analysis/modes": ("test_modes.py",),
    "analysis/trim": ("test_trim.py", "test_trim_search.py", "test_two_loop.py"),
    "analysis/trim_guess": ("test_trim_search.py",),
    "analysis/trim_search": ("test_trim_search.py", "test_trim.py"),
    "analysis/newton": ("test_newton.py",),
    "analysis/floquet": ("test_floquet.py",),
}
ARITHMETIC, COMPARISONS = ("Add", "Sub", "Mul", "Div"), ("Lt", "LtE", "Gt", "GtE", "Eq", "NotEq")
OPERATORS = (
    *(f"ReplaceBinaryOperator_{a}_{b}" for a in ARITHMETIC for b in ARITHMETIC if a != b),
    *(f"ReplaceComparisonOperator_{a}_{b}" for a in COMPARISONS for b in COMPARISONS if a != b),
    *("ReplaceUnaryOperator_Delete_USub", "ReplaceUnaryOperator_Delete_Not", "AddNot", "NumberReplacer"),
    *("ReplaceTrueWithFalse", "ReplaceFalseWithTrue", "ReplaceAndWithOr", "ReplaceOrWithAnd"),
    *("ReplaceBreakWithContinue", "ReplaceContinueWithBreak", "ZeroIterationForLoop"),
)


class Mutant(NamedTuple):
    """One change: cosmic-ray's operator, which of its places, and the line."""

    operator: str
    occurrence: int
    line: int


def main() -> int:
    """Do what the command line asks for; the exit code."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("modules", nargs="*", metavar="MODULE", help=f"of {', '.join(MODULES)}; default: all")
    parser.add_argument("--mutants", type=int, default=20, help="of each module; 0 is all (default: 20)")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--seconds", type=float, default=0.0, help="after which a module gets no further mutants")
    parser.add_argument("--one", action="store_true", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if unknown := [name for name in arguments.modules if name not in MODULES]:
        parser.error(f"no module {unknown[0]}: allowed are {', '.join(MODULES)}")
    if not (TOOL / "cosmic_ray").is_dir():
        print(f"no cosmic-ray: ./run python -m pip install --target {TOOL.relative_to(ROOT)} cosmic-ray==8.7.0")
        return 1
    if arguments.one:
        return _module(arguments.modules[0], arguments.mutants, arguments.seed, arguments.seconds)
    return max(_started(name) for name in arguments.modules or MODULES)


def _started(name: str) -> int:
    """Try the mutants of a module in a process of its own: whether kernels are compiled is settled for a process."""
    environment = {**os.environ, "PYTHONDONTWRITEBYTECODE": "1"}
    if name.startswith("model/"):
        environment["NUMBA_DISABLE_JIT"] = "1"
    options = [argument for argument in sys.argv[1:] if argument not in MODULES]
    return subprocess.run([sys.executable, __file__, name, "--one", *options], env=environment, check=False).returncode


# --- one module -------------------------------------------------------------------------------------------------------


def _module(name: str, count: int, seed: int, seconds: float) -> int:
    """Try mutants of a module and print what came of them; 1 if its tests fail unchanged."""
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder)
        _copy(name, copy)
        target = copy / "sbs_sim" / f"{name}.py"
        source = target.read_text(encoding="utf-8")
        _load_libraries()
        begin = time.monotonic()
        if not _passes(copy, name, 3600.0):
            print(f"{name}: its tests fail unchanged", flush=True)
            return 1
        limit = LIMIT * (time.monotonic() - begin) + GRACE
        every = _mutants(source)
        chosen = random.Random(seed).sample(every, len(every)) if count else every
        survivors, tried = [], 0
        begin = time.monotonic()
        for mutant in chosen[: count or None]:
            if seconds and time.monotonic() - begin > seconds:
                break
            changed = _changed(source, mutant)
            target.write_text(changed, encoding="utf-8")
            tried += 1
            if _passes(copy, name, limit):
                survivors.append(_described(name, source, changed, mutant))
                print(f"  {survivors[-1]}", flush=True)
    killed = tried - len(survivors)
    print(f"{name:22} {len(every):5} possible {tried:4} tried {killed:4} killed {len(survivors):3} survived")
    return 0


def _copy(name: str, copy: Path) -> None:
    """Link the package into a folder, all but the file that is to be changed."""
    package = copy / "sbs_sim"
    package.mkdir()
    (copy / "config").symlink_to(ROOT / "config")
    inner, file = name.split("/")
    for path in (ROOT / "sbs_sim").iterdir():
        if path.name != inner:
            (package / path.name).symlink_to(path)
    (package / inner).mkdir()
    for path in (ROOT / "sbs_sim" / inner).glob("*.py"):
        if path.stem == file:
            (package / inner / path.name).write_bytes(path.read_bytes())
        else:
            (package / inner / path.name).symlink_to(path)


def _load_libraries() -> None:
    """Import what every test needs once; a forked process has it."""
    import hypothesis  # noqa: F401
    import numba  # noqa: F401
    import numpy  # noqa: F401
    import pytest  # noqa: F401
    import scipy.linalg
    import scipy.optimize  # noqa: F401


class _Plainly:
    """Lets entries be given to entries where nothing is compiled and nothing has an address."""

    def pytest_sessionstart(self) -> None:
        import sbs_sim.model.kernel

        if os.environ.get("NUMBA_DISABLE_JIT") == "1":
            sbs_sim.model.kernel.Address = lambda function, *arguments: function  # type: ignore[assignment,misc]


def _passes(copy: Path, name: str, limit: float) -> bool:
    """Whether the tests of a module pass on a copy of the package; a forked process runs them."""
    child = os.fork()
    if child == 0:
        code = 1
        try:
            code = _tests(copy, name)
        finally:
            os._exit(code)
    end = time.monotonic() + limit
    while time.monotonic() < end:
        done, status = os.waitpid(child, os.WNOHANG)
        if done:
            return os.waitstatus_to_exitcode(status) == 0
        time.sleep(0.05)
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    return False


def located(test: str) -> str:
    """A test of `MODULES`, `test_x.py` or `test_x.py::test_y`, with its folder."""
    name, colons, function = test.partition("::")
    (path,) = (ROOT / "test").glob(f"*/{name}")
    return f"{path.relative_to(ROOT)}{colons}{function}"


def _tests(copy: Path, name: str) -> int:
    """Run the tests of a module on a copy; pytest's exit code."""
    import pytest

    os.setsid()
    sys.path.insert(0, str(copy))
    options = ["-x", "-q", "-n", "0", "-p", "no:cacheprovider", "-p", "no:randomly", "-W", "ignore"]
    tests = [f"{ROOT}/{located(part)}" if part.startswith("test_") else part for part in MODULES[name]]
    with open(os.environ.get("MUTATE_OUTPUT", os.devnull), "a") as out:
        os.dup2(out.fileno(), 1)
        os.dup2(out.fileno(), 2)
        with contextlib.redirect_stdout(out):
            code = pytest.main([*options, *tests], plugins=[_Plainly()])
    import sbs_sim

    assert Path(str(sbs_sim.__file__)).parent.parent == copy, sbs_sim.__file__
    return int(code)


# --- mutants ----------------------------------------------------------------------------------------------------------


def _mutants(source: str) -> list[Mutant]:
    """All changes that are possible in a source."""
    sys.path.append(str(TOOL))
    from cosmic_ray.ast import ast_nodes, get_ast
    from cosmic_ray.plugins import get_operator

    nodes = list(ast_nodes(get_ast(source)))
    found = []
    for operator in OPERATORS:
        change = get_operator(f"core/{operator}")()
        places = [place for node in nodes for place in change.mutation_positions(node)]
        found += [Mutant(operator, i, place[0][0]) for i, place in enumerate(places)]
    return found


def _changed(source: str, mutant: Mutant) -> str:
    """Return the source with one change."""
    from cosmic_ray.mutating import mutate_code
    from cosmic_ray.plugins import get_operator

    changed: Any = mutate_code(source, get_operator(f"core/{mutant.operator}")(), mutant.occurrence)
    return str(changed)


def _described(name: str, source: str, changed: str, mutant: Mutant) -> str:
    """File, line, and the line before and after."""
    pairs = zip(source.splitlines(), changed.splitlines(), strict=False)
    place, before, after = next((i, a.strip(), b.strip()) for i, (a, b) in enumerate(pairs, 1) if a != b)
    return f"{name}.py:{place}: {before}  ->  {after}"


if __name__ == "__main__":
    sys.exit(main())
