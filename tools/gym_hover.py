"""Score and speed of the environment sbs_sim/Hover-v0: the hover hold, no action, and random ones.

    ./run python tools/gym_hover.py [--episodes 20] [--flights 32]

Scores are sums of rewards of an episode, 500 at most: mean and range over episodes of the seeds 0, 1, 2 ...
"""

import argparse
import time
from collections.abc import Callable

import gymnasium
import numpy as np

from sbs_sim.gym_env import ACTIONS, NAME, HoverBaseline


def score(act: Callable[[], np.ndarray], begin: Callable[[], None], env: gymnasium.Env, episodes: int) -> list[float]:
    """Sums of rewards of episodes."""
    sums = []
    for seed in range(episodes):
        env.reset(seed=seed)
        begin()
        total, over = 0.0, False
        while not over:
            _, reward, terminated, truncated, _ = env.step(act())
            total, over = total + float(reward), terminated or truncated
        sums.append(total)
    return sums


def speed(flights: int, steps: int = 200) -> float:
    """Steps a second of all flights together."""
    env = gymnasium.make_vec(NAME, num_envs=flights, vectorization_mode="vector_entry_point")
    env.reset(seed=0)
    actions = np.zeros((flights, ACTIONS), dtype=np.float32)
    env.step(actions)
    begin = time.perf_counter()
    for _ in range(steps):
        env.step(actions)
    return flights * steps / (time.perf_counter() - begin)


def main() -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--episodes", type=int, default=20)
    parser.add_argument("--flights", type=int, default=32)
    arguments = parser.parse_args()
    env = gymnasium.make(NAME)
    baseline = HoverBaseline(env.unwrapped.flight)  # type: ignore[attr-defined]
    random = np.random.default_rng(0)
    policies = {
        "hover hold": (baseline, baseline.restart),
        "no action": (lambda: np.zeros(ACTIONS, dtype=np.float32), lambda: None),
        "random": (lambda: random.uniform(-1.0, 1.0, ACTIONS).astype(np.float32), lambda: None),
    }
    for name, (act, begin) in policies.items():
        found = score(act, begin, env, arguments.episodes)
        print(f"{name:12} {np.mean(found):7.1f}  {min(found):7.1f} to {max(found):.1f}")
    for flights in (1, arguments.flights):
        print(f"{flights} flight{'s' * (flights > 1)}: {speed(flights):.0f} steps/s, real time is {50 * flights}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
