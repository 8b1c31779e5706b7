"""Gymnasium environment `sbs_sim/Hover-v0`: return to a hover over the origin, heading north.

>>> import gymnasium
>>> import sbs_sim.gym_env
>>> env = gymnasium.make("sbs_sim/Hover-v0", aircraft="sbs")
>>> flights = gymnasium.make_vec("sbs_sim/Hover-v0", num_envs=8)

The full model flies. Every flight begins near the origin with a random departure, and ends at once where it is lost.
`make_vec` flies several side by side in compiled code. Each is what it would be on its own, bit for bit, until it ends
and begins anew: with the azimuths that its rotors then have.

Needs gymnasium, the extra `gym`.
"""

from __future__ import annotations  # `help` then shows types by their names

import functools
import math
from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from sbs_sim import checks
from sbs_sim.aircraft import Aircraft
from sbs_sim.analysis.linearize import linearize
from sbs_sim.analysis.trim import trim
from sbs_sim.errors import SimulationError
from sbs_sim.flight.formation import Formation
from sbs_sim.flight.mixer import Mixers
from sbs_sim.flight.simulation import Simulation
from sbs_sim.flight.trim_point import TrimPoint
from sbs_sim.flight.trimmed_state import trimmed_state
from sbs_sim.model import state as S
from sbs_sim.model.frames import euler_angles
from sbs_sim.model.packing import lane_count
from sbs_sim.pilot.hover_hold import AUTHORITY, HoverHold, HoverHoldDesign, HoverModel, design

Array = NDArray[np.float64]

NAME = "sbs_sim/Hover-v0"
PERIOD = 0.02  # s between two actions, and a tick of the flight
STEPS = 500  # of an episode: 10 s
OBSERVED = {  # name: largest magnitude; m, rad, m/s, rad/s, as the name says in the table of `HoverEnv`
    **dict.fromkeys(("forward", "right", "down"), 100.0),
    **dict.fromkeys(("heading", "pitch", "roll"), 2.0 * math.pi),
    **dict.fromkeys(("u", "v", "w"), 350.0),
    **dict.fromkeys(("p", "q", "r"), 100.0),
}
BOUNDS = np.array(list(OBSERVED.values()))
ACTIONS = 4
DEPARTURES = {"position": 1.0, "heading": math.radians(20.0), "velocity": 0.3, "rates": 0.1}  # at the start, uniform
# Departures that halve the reward: of position [m], heading [rad] and velocity [m/s].
COSTS = np.array([0.5, 0.5, 0.5, math.radians(10.0), 1.0, 1.0, 1.0])
MAX_DISTANCE = 5.0  # m from the origin
MAX_TILT = math.radians(60.0)  # rad


@functools.lru_cache(maxsize=8)
def _hover(aircraft: Aircraft) -> TrimPoint:
    return trim(aircraft)


def _aircraft(aircraft: str | Aircraft) -> Aircraft:
    return Aircraft.load(aircraft) if isinstance(aircraft, str) else aircraft


class _Flight:
    """One aircraft in flight."""

    def __init__(self, aircraft: Aircraft) -> None:
        self.aircraft, self.hover = aircraft, _hover(aircraft)
        self.axes = aircraft.axis_controls
        self.simulation = Simulation(aircraft, trimmed_state(aircraft, self.hover), self.hover.swashplate, tick=PERIOD)

    def restart(self, random: np.random.Generator) -> None:
        """Begin near the origin; the time of the simulation goes on, so that flights stay side by side."""
        spread = {name: random.uniform(-size, size, 3) for name, size in DEPARTURES.items()}
        state = trimmed_state(self.aircraft, self.hover, spread["position"], float(spread["heading"][0]))
        state[S.VELOCITY : S.RATES] += spread["velocity"]
        state[S.RATES : S.BODY_SIZE] += spread["rates"]
        self.simulation.reset(state, self.hover.swashplate)


class _Flights:
    """Flights at the same time: what both environments have in common."""

    def __init__(self, aircraft: Aircraft, count: int) -> None:
        self.each = [_Flight(aircraft) for _ in range(count)]
        self.first = self.each[0]
        self.ended = np.zeros(count, dtype=bool)
        self._trimmed = np.array([0.0, self.first.hover.pitch, self.first.hover.roll])  # heading, pitch, roll
        self._mixers = Mixers(aircraft, count)

    def begin(self, random: Sequence[np.random.Generator]) -> None:
        """Begin all flights at time 0."""
        for flight in self.each:
            flight.simulation.step = 0  # and with it the azimuths of the rotors, and the noise of vortex rings
            flight.simulation.set_wind(flight.simulation.wind)
        for i, own in enumerate(random):
            self.restart(i, own)
        self.ended[:] = False

    def restart(self, i: int, random: np.random.Generator) -> None:
        """Begin one flight near the origin, see `_Flight.restart`."""
        self.each[i].restart(random)
        self._mixers.set_position(i, self.first.hover.swashplate, self.first.simulation.time)

    def command(self, actions: Any) -> Array:
        """Swashplate angles [rad], shape (n, n_rows, 3), of actions, shape (n, 4): departures over AUTHORITY.

        Those of flights that have ended do not act.
        """
        values, acting = np.asarray(actions, dtype=float), ~self.ended
        if values.shape != (len(self.each), ACTIONS) or not np.all(np.isfinite(values[acting])):
            raise SimulationError(f"action = {checks.shown(values.tolist())}: allowed are {ACTIONS} finite numbers")
        departures = np.zeros((len(self.each), len(self.first.hover.controls)))
        departures[:, self.first.axes] = AUTHORITY * np.where(acting[:, np.newaxis], np.clip(values, -1.0, 1.0), 0.0)
        return self._mixers.move(self.first.hover.controls + departures, self.first.simulation.time)

    def outcome(self) -> tuple[NDArray[np.float32], Array, NDArray[np.bool_]]:
        """Observations, shape (n, 12), rewards from 0 to 1, and which flights have departed too far for another step.

        A reward is one over one more than the sum of the squares of the departures over COSTS.
        """
        bodies = np.array([flight.simulation.state[: S.BODY_SIZE] for flight in self.each])
        euler = euler_angles(bodies[:, S.ATTITUDE : S.VELOCITY])
        north, east, down = bodies[:, : S.ATTITUDE].T
        # not those of NumPy, whose bits may depend on the number of flights
        c, s = (np.array([turn(angle) for angle in euler[:, 0].tolist()]) for turn in (math.cos, math.sin))
        seen = np.empty((len(bodies), len(BOUNDS)))
        seen[:, 0], seen[:, 1], seen[:, 2] = c * north + s * east, c * east - s * north, down
        seen[:, 3:6], seen[:, 6:] = euler - self._trimmed, bodies[:, S.VELOCITY :]
        departures = np.concatenate([bodies[:, : S.ATTITUDE], euler[:, :1], bodies[:, S.VELOCITY : S.RATES]], axis=1)
        far = north * north + east * east + down * down > MAX_DISTANCE**2
        far |= (np.abs(euler[:, 1:]) > MAX_TILT).any(axis=1)
        costs = np.square(departures / COSTS)
        rewards = 1.0 / (1.0 + (costs[:, :3].sum(axis=1) + costs[:, 3] + costs[:, 4:].sum(axis=1)))
        return np.clip(seen, -BOUNDS, BOUNDS).astype(np.float32), rewards, far


def _observation_space() -> spaces.Box:
    high = BOUNDS.astype(np.float32)
    return spaces.Box(-high, high, dtype=np.float32)


def _action_space() -> spaces.Box:
    return spaces.Box(-1.0, 1.0, (ACTIONS,), np.float32)


class HoverEnv(gymnasium.Env):
    """One flight.

    Observation, shape (12,), float32: the position of the aircraft from the origin, forward, right and down along its
    heading [m]; heading, and pitch and roll from those of the trim [rad]; velocity u, v, w over ground [m/s] and rates
    p, q, r [rad/s] in body axes.

    Action, shape (4,), -1 to 1: departures of the controls that heave, roll, pitch and yaw from the trim, over 5 deg.
    The mixer limits the rates of swashplates.

    Reward of a step: 1 / (1 + c), c the sum of the squares of position over 0.5 m, heading over 10 deg and velocity
    over 1 m/s. A flight is lost, `terminated`, 5 m from the origin, beyond 60 deg of pitch or roll, or at a fault; its
    last reward is 0. `gymnasium.make` truncates it after 500 steps of 0.02 s.

    Parameters
    ----------
    aircraft : str or Aircraft
        One with controls for four axes.
    """

    metadata: dict[str, Any] = {"render_modes": []}  # noqa: RUF012 - as the base class has it

    def __init__(self, aircraft: str | Aircraft = "sbs") -> None:
        self._flights = _Flights(_aircraft(aircraft), 1)
        self.flight = self._flights.first
        self.observation_space, self.action_space = _observation_space(), _action_space()

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Begin a flight; the same seed gives the same one."""
        super().reset(seed=seed)
        self._flights.begin([self.np_random])
        return self._flights.outcome()[0][0], {}

    def step(self, action: Any) -> tuple[NDArray[np.float32], float, bool, bool, dict[str, Any]]:
        """Fly for 0.02 s."""
        simulation, fault = self.flight.simulation, {}
        simulation.swashplate = self._flights.command(np.asarray(action)[np.newaxis])[0]
        try:
            simulation.advance()
        except SimulationError as error:
            fault = {"fault": str(error)}
        observations, rewards, far = self._flights.outcome()
        lost = bool(fault or far[0])
        return observations[0], 0.0 if lost else float(rewards[0]), lost, False, fault


class HoverVectorEnv(gymnasium.vector.VectorEnv):
    """Several flights of `HoverEnv` side by side in compiled code.

    A flight that has ended begins anew with the next step, whose action does not act and whose reward is 0.

    Parameters
    ----------
    num_envs : int
    aircraft : str or Aircraft
    max_episode_steps : int
    """

    metadata: dict[str, Any] = {"autoreset_mode": gymnasium.vector.AutoresetMode.NEXT_STEP}  # noqa: RUF012 - as the base class has it

    def __init__(self, num_envs: int = 1, aircraft: str | Aircraft = "sbs", max_episode_steps: int = STEPS) -> None:
        self.num_envs = checks.integer("num_envs", num_envs, 1, 100_000, SimulationError)
        self._flights = _Flights(_aircraft(aircraft), self.num_envs)
        self.flights, self._limit = self._flights.each, max_episode_steps
        self.single_observation_space, self.single_action_space = _observation_space(), _action_space()
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._random = [np.random.default_rng() for _ in self.flights]
        self._steps = np.zeros(num_envs, dtype=int)
        simulations, lanes = [flight.simulation for flight in self.flights], lane_count()
        groups = [slice(i, i + lanes) for i in range(0, self.num_envs, lanes)]
        self._together = [(group, Formation(simulations[group])) for group in groups]

    def reset(
        self, *, seed: int | list[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Begin all flights; with a number as the seed they have this one and those after it."""
        seeds = (
            list(seed) if isinstance(seed, list) else [None if seed is None else seed + i for i in range(self.num_envs)]
        )
        for i, own in enumerate(seeds):
            if own is not None:
                self._random[i] = gymnasium.utils.seeding.np_random(own)[0]
        self._flights.begin(self._random)
        self._steps[:] = 0
        return self._flights.outcome()[0], {}

    def step(
        self, actions: Any
    ) -> tuple[NDArray[np.float32], Array, NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]:
        """Fly for 0.02 s."""
        begun, swashplates = self._flights.ended, self._flights.command(actions)
        faults = np.concatenate([formation.advance(swashplates[group]) for group, formation in self._together])
        for i in np.flatnonzero(begun).tolist():
            self._flights.restart(i, self._random[i])
        observations, rewards, far = self._flights.outcome()
        lost = ~begun & (faults | far)
        self._steps = np.where(begun, 0, self._steps + 1)
        over = (self._steps >= self._limit) & ~lost
        self._flights.ended = lost | over
        return observations, np.where(begun | lost, 0.0, rewards), lost, over, {}


class HoverBaseline:
    """The hover hold of the library as a policy: an action for the state of a flight.

    Parameters
    ----------
    flight : _Flight
        `HoverEnv.flight`, or one of `HoverVectorEnv.flights`.
    """

    def __init__(self, flight: _Flight) -> None:
        self._flight = flight
        self._pilot = HoverHold(_baseline_design(flight.aircraft))
        self.restart()

    def restart(self) -> None:
        """Begin a flight: hold the origin, heading north."""
        self._pilot.restart((np.zeros(3), 0.0))

    def __call__(self) -> NDArray[np.float32]:
        """Action for the present state, shape (4,)."""
        flight = self._flight
        controls = self._pilot.controls(flight.simulation.time, flight.simulation.state)
        return np.clip((controls - flight.hover.controls)[flight.axes] / AUTHORITY, -1.0, 1.0).astype(np.float32)


@functools.lru_cache(maxsize=8)
def _baseline_design(aircraft: Aircraft) -> HoverHoldDesign:
    return design(HoverModel.of(linearize(aircraft)))


if NAME not in gymnasium.registry:
    gymnasium.register(NAME, HoverEnv, max_episode_steps=STEPS, vector_entry_point=HoverVectorEnv)
