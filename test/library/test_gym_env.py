"""The environment of Gymnasium: by its own checks, beside flights of its own, and against doing nothing."""

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from sbs_sim.errors import SimulationError
from sbs_sim.gym_env import ACTIONS, NAME, STEPS, HoverBaseline

NOTHING = np.zeros(ACTIONS, dtype=np.float32)


@pytest.fixture(scope="module")
def env():
    return gymnasium.make(NAME)


def total(env, act, seed):
    env.reset(seed=seed)
    rewards, over, steps = 0.0, False, 0
    while not over:
        _, reward, terminated, truncated, _ = env.step(act())
        rewards, steps, over = rewards + reward, steps + 1, terminated or truncated
    return rewards, steps, terminated


def test_it_passes_the_checks_of_gymnasium(env):
    check_env(env.unwrapped, skip_render_check=True)


def test_the_hover_hold_returns_which_no_action_does_not(env):
    baseline = HoverBaseline(env.unwrapped.flight)
    baseline.restart()
    held, steps, lost = total(env, baseline, 0)
    assert (steps, lost) == (STEPS, False)
    assert np.linalg.norm(env.unwrapped.flight.simulation.state[:3]) < 0.2
    left, _, _ = total(env, lambda: NOTHING, 0)
    assert np.linalg.norm(env.unwrapped.flight.simulation.state[:3]) > 1.0
    assert held > left


def test_flights_side_by_side_are_those_of_one(env):
    """Through ends and new beginnings; the same seed gives the same flight."""
    flights = gymnasium.make_vec(NAME, num_envs=3, vectorization_mode="vector_entry_point", max_episode_steps=20)
    actions = np.random.default_rng(1).uniform(-0.5, 0.5, (20, 3, ACTIONS)).astype(np.float32)
    first, _ = flights.reset(seed=7)
    together = [first, *(flights.step(row)[0] for row in actions)]
    own = env.unwrapped
    for i in range(3):
        alone = [own.reset(seed=7 + i)[0], *(own.step(row[i])[0] for row in actions)]
        np.testing.assert_array_equal(np.array(together)[:, i], alone)
    _, rewards, lost, over, _ = flights.step(actions[0])  # all have been truncated: they begin anew
    assert not rewards.any()
    assert not (lost | over).any()
    assert np.all(np.abs(flights.flights[0].simulation.state[:3]) <= 1.0)


def test_actions_that_are_none_are_refused(env):
    env.reset(seed=0)
    with pytest.raises(SimulationError, match="action"):
        env.unwrapped.step(np.full(ACTIONS, np.nan))
    with pytest.raises(SimulationError, match="action"):
        env.unwrapped.step(np.zeros(3))
