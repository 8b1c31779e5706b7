"""Steps per second of the environment sbs_sim/Hover-v0, one flight and several: `./run python benchmarks/gym_rows.py`.

They take turns, and a row has the median of its rounds. Needs gymnasium.
"""

import argparse
import statistics
import time
from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np

from sbs_sim.gym_env import ACTIONS, NAME, PERIOD

Row = tuple[str, float, str, str]


def alone(env: Any, steps: int) -> float:
    """Steps per second of one flight, which begins anew where it ends."""
    env.reset(seed=0)
    action, begin = np.zeros(ACTIONS, dtype=np.float32), time.perf_counter()
    for _ in range(steps):
        _, _, terminated, truncated, _ = env.step(action)
        if terminated or truncated:
            env.reset()
    return steps / (time.perf_counter() - begin)


def together(env: Any, steps: int) -> float:
    """Steps per second of all flights of a vector."""
    env.reset(seed=0)
    actions, begin = np.zeros(env.action_space.shape, dtype=np.float32), time.perf_counter()
    count = -(-steps // env.num_envs)
    for _ in range(count):
        env.step(actions)
    return count * env.num_envs / (time.perf_counter() - begin)


def gym_rows(counts: list[int], rounds: int, steps: int) -> list[Row]:
    """Rows of the table."""
    ways: dict[str, tuple[Callable[[Any, int], float], Any]] = {"make": (alone, gymnasium.make(NAME))}
    for n in counts:
        env = gymnasium.make_vec(NAME, num_envs=n, vectorization_mode="vector_entry_point")
        ways[f"make_vec, {n}"] = together, env
    rates: dict[str, list[float]] = {name: [] for name in ways}
    for i in range(rounds + 1):
        for name, (way, env) in ways.items():
            rate = way(env, steps)
            if i > 0:  # the first round loads and compiles
                rates[name].append(rate)
    rows = []
    for name, found in rates.items():
        ratio = statistics.median(rate / one for rate, one in zip(found, rates["make"], strict=True))
        rate = statistics.median(found)
        note = f"{rate * PERIOD:.0f} x real time, {ratio:.2f} x make; {min(found):.0f} to {max(found):.0f}"
        rows.append((f"{NAME}, {name}", rate, "steps/s", note))
    return rows


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--flights", type=int, nargs="+", default=[1, 8, 32, 128], help="(default: 1 8 32 128)")
    parser.add_argument("--rounds", type=int, default=9, help="of which medians are taken (default: 9)")
    parser.add_argument("--steps", type=int, default=512, help="of a round, of all flights (default: 512)")
    given = parser.parse_args()
    for name, value, unit, note in gym_rows(given.flights, given.rounds, given.steps):
        print(f"{name:32} {value:8.0f} {unit:9} {note}")


if __name__ == "__main__":
    main()
