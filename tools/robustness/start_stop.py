"""Start simulators in namespaces and interrupt them at random moments, again and again, and see whether every one ends.

    ./run python tools/robustness/start_stop.py --count 300

Two at a time share a DDS domain, each in a namespace of its own. One that has not ended within --patience seconds of
the interruption is counted; what its threads were doing is printed, by `py-spy` where that is in the path (it sees
machine code too), else by Python itself. The exit code is 1 if there was one.
"""

import argparse
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "test" / "support"))
from ros_harness import DOMAINS, EXECUTABLES, Client, environment

from sbs_msgs.msg import BodyState

SIGNALS = (signal.SIGINT, signal.SIGTERM)
MAX_FLIGHT_TIME = 1.0  # s from the beginning of the flight to the interruption
STARTING = 0.3  # share of those that are interrupted while they start
MAX_START_TIME = 4.0  # s from our first line to the interruption of those
PATIENCE = 60.0  # s until our first line runs


class Simulator:
    """A simulator in a namespace."""

    def __init__(self, number: int, domain: int, folder: Path) -> None:
        self.number = number
        self.log, self.namespace = folder / f"{number}.log", f"/number_{number}"
        command = [sys.executable, str(EXECUTABLES / "simulator"), "--ros-args", "-r", f"__ns:={self.namespace}"]
        # so that SIGABRT prints what every thread does
        own = {**environment(domain, folder / str(number)), "PYTHONFAULTHANDLER": "1"}
        with self.log.open("w") as out:
            self.process = subprocess.Popen(command, stdout=out, stderr=subprocess.STDOUT, env=own, cwd=folder)

    def await_first_line(self) -> None:
        """Wait until it handles signals itself: before that the start is Python's own."""
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end and self.process.poll() is None:
            status = Path(f"/proc/{self.process.pid}/status").read_text()
            if int(status.split("SigCgt:")[1].split()[0], 16) >> (signal.SIGTERM - 1) & 1:
                return
            time.sleep(0.01)

    def dump(self) -> str:
        """What it has printed and what its threads do, once it is known to hang."""
        seen = ""
        if shutil.which("py-spy"):
            command = ["py-spy", "dump", "--native", "--pid", str(self.process.pid)]
            seen = subprocess.run(command, capture_output=True, text=True, check=False).stdout
        self.process.send_signal(signal.SIGABRT)
        self.process.wait()
        return f"{seen}\n{self.log.read_text()}"


def await_moment(chance: random.Random, domain: int, pair: list[Simulator]) -> None:
    """Wait for a random moment of the start, or for one shortly after the first state of the flight."""
    for simulator in pair:
        simulator.await_first_line()
    if chance.random() < STARTING:
        time.sleep(chance.uniform(0.0, MAX_START_TIME))
        return
    client = Client(domain)
    states = client.watch(f"{chance.choice(pair).namespace}/state", BodyState)
    client.until(lambda: states, "a state")
    client.close()
    time.sleep(chance.choice((0.0, 0.0, chance.uniform(0.0, MAX_FLIGHT_TIME))))


def interrupt(chance: random.Random, simulator: Simulator) -> None:
    """Interrupt it, now and then twice."""
    for _ in range(chance.choice((1, 1, 1, 2))):
        simulator.process.send_signal(chance.choice(SIGNALS))
        time.sleep(chance.choice((0.0, 0.0, 0.001, 0.1)))


def main() -> int:
    """Start and stop; 1 if one did not end."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=100, help="simulators to start (default: 100)")
    parser.add_argument("--patience", type=float, default=30.0, help="s until one counts as hanging (default: 30)")
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    chance = random.Random(options.seed)
    hanging, wrong, slowest = 0, 0, 0.0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for first in range(0, options.count, 2):
            domain = next(DOMAINS)
            pair = [Simulator(number, domain, folder) for number in range(first, min(first + 2, options.count))]
            await_moment(chance, domain, pair)
            for simulator in pair:
                interrupt(chance, simulator)
            begin = time.monotonic()
            for simulator in pair:
                try:
                    simulator.process.wait(options.patience)
                except subprocess.TimeoutExpired:
                    hanging += 1
                    print(f"hanging:\n{simulator.dump()}", flush=True)
                    continue
                slowest = max(slowest, time.monotonic() - begin)
                if simulator.process.returncode or "Traceback" in simulator.log.read_text():
                    wrong += 1
                    print(f"exit code {simulator.process.returncode}:\n{simulator.log.read_text()}", flush=True)
                simulator.log.unlink()
                shutil.rmtree(folder / str(simulator.number), ignore_errors=True)
    print(f"{options.count} started, {hanging} did not end, {wrong} ended wrongly; the slowest took {slowest:.1f} s")
    return int(bool(hanging or wrong))


if __name__ == "__main__":
    sys.exit(main())
