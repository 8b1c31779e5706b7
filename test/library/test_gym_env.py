"""The environment of Gymnasium: by its own checks, beside flights of its own, and against doing nothing."""

import dataclasses

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from sbs_sim import Aircraft
from sbs_sim.errors import SimulationError
from sbs_sim.gym_env import ACTIONS, NAME, STEPS, HoverBaseline
from sbs_sim.model import state as S

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
    flown = [flights.step(row)[:2] for row in actions]
    together, rewards = [first, *(seen for seen, _ in flown)], np.array([given for _, given in flown])
    own = env.unwrapped
    for i in range(3):
        start, steps = own.reset(seed=7 + i)[0], [own.step(row[i])[:2] for row in actions]
        np.testing.assert_array_equal(np.array(together)[:, i], [start, *(seen for seen, _ in steps)])
        np.testing.assert_array_equal(rewards[:, i], [given for _, given in steps])
    _, rewards, lost, over, _ = flights.step(actions[0])  # all have been truncated: they begin anew
    assert not rewards.any()
    assert not (lost | over).any()
    assert np.all(np.abs(flights.flights[0].simulation.state[:3]) <= 1.0)


def test_a_fault_of_a_flight_is_its_own(env):
    flights = gymnasium.make_vec(NAME, num_envs=3, vectorization_mode="vector_entry_point")
    flights.reset(seed=7)
    flights.flights[1].simulation.state[S.RATES] = 1e3
    actions = np.zeros((3, ACTIONS), dtype=np.float32)
    _, rewards, lost, _, _ = flights.step(actions)
    assert lost.tolist() == [False, True, False]
    assert rewards[1] == 0.0
    actions[1] = np.nan  # does not act
    begun, rewards, lost, _, _ = flights.step(actions)
    assert not lost.any()
    assert rewards[1] == 0.0
    assert np.all(np.abs(begun[1, :3]) <= 2.0)
    seen, rewards, lost, _, _ = flights.step(np.zeros_like(actions))
    assert not lost.any()
    assert rewards.all()
    env.reset(seed=9)
    np.testing.assert_array_equal(seen[2], [env.unwrapped.step(NOTHING)[0] for _ in range(3)][-1])
    assert len({flight.simulation.time for flight in flights.flights}) == 1


def test_a_seed_gives_the_same_flight_again_where_thrust_fluctuates():
    sbs = Aircraft.load("sbs")
    rotors = tuple(dataclasses.replace(rotor, descent="measured", ring_unsteadiness=0.2) for rotor in sbs.rotors)
    own = gymnasium.make(NAME, aircraft=dataclasses.replace(sbs, rotors=rotors)).unwrapped
    seen = []
    for _ in range(2):
        own.reset(seed=0)
        own.flight.simulation.state[S.VELOCITY + 2] += 4.0
        seen.append([own.step(NOTHING)[0] for _ in range(3)])
    np.testing.assert_array_equal(seen[0], seen[1])


def test_actions_that_are_none_are_refused(env):
    env.reset(seed=0)
    with pytest.raises(SimulationError, match="action"):
        env.unwrapped.step(np.full(ACTIONS, np.nan))
    with pytest.raises(SimulationError, match="action"):
        env.unwrapped.step(np.zeros(3))
    flights = gymnasium.make_vec(NAME, num_envs=2, vectorization_mode="vector_entry_point")
    flights.reset(seed=0)
    with pytest.raises(SimulationError, match="action"):
        flights.step(NOTHING)
