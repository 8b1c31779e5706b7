"""The whole test suite with the kernels compiled for other processors than this one.

    ./run python tools/robustness/test_targets.py
    ./run python tools/robustness/test_targets.py --targets haswell generic -- test/recording/test_replay.py

The model's bits are the same for all of them (`compare_bits.py`), so what fails here hangs on a library, or is a
fault of ours. A target is a name that LLVM knows. `NUMBA_CPU_FEATURES` is empty then: the name alone would keep the
features of this machine, and the suite would pass for the wrong reason. The kernels of the target are compiled first,
as the build compiles those of this machine: no flight of a test then waits for the compiler. This machine must be able
to execute what is compiled. The exit code is 1 if a test fails.
"""

import argparse
import os
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
TARGETS = ("haswell",)  # what every x86-64 processor with AVX2 and fused multiplication executes


def main() -> int:
    """Test for one target after the other."""
    parser = argparse.ArgumentParser(description="Run the tests with kernels for other compilation targets.")
    parser.add_argument("--targets", nargs="+", default=TARGETS, help="names that LLVM knows (default: haswell)")
    parser.add_argument("arguments", nargs="*", help="for pytest, after --")
    options = parser.parse_args()
    failed = False
    for target in options.targets:
        environment = {**os.environ, "NUMBA_CPU_NAME": target, "NUMBA_CPU_FEATURES": ""}
        begin = time.monotonic()
        subprocess.run([sys.executable, "-m", "sbs_sim.warm_up"], cwd=ROOT, env=environment, check=True)
        command = [sys.executable, "-m", "pytest", "-q", *options.arguments]
        found = subprocess.run(command, cwd=ROOT, env=environment, stdout=subprocess.PIPE, text=True, check=False)
        last = found.stdout.rstrip().rpartition("\n")[2]
        if found.returncode:
            sys.stderr.write(found.stdout)
            failed = True
        print(f"{target}: {last}, {time.monotonic() - begin:.0f} s in all", flush=True)
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
