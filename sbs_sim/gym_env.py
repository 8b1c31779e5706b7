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
from sbs_sim.flight.mixer import Mixer
from sbs_sim.flight.simulation import Simulation
from sbs_sim.flight.trim_point import TrimPoint
from sbs_sim.flight.trimmed_state import trimmed_state
from sbs_sim.model import state as S
from sbs_sim.model.frames import quaternion_to_euler
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
ACTIONS = 4
DEPARTURES = {"position": 1.0, "heading": math.radians(20.0), "velocity": 0.3, "rates": 0.1}  # at the start, uniform
COSTS = {"position": 0.5, "heading": math.radians(10.0), "velocity": 1.0}  # that halve the reward [m, rad, m/s]
MAX_DISTANCE = 5.0  # m from the origin
MAX_TILT = math.radians(60.0)  # rad


@functools.lru_cache(maxsize=8)
def _hover(aircraft: Aircraft) -> TrimPoint:
    return trim(aircraft)


def _aircraft(aircraft: str | Aircraft) -> Aircraft:
    return Aircraft.load(aircraft) if isinstance(aircraft, str) else aircraft


class _Flight:
    """One aircraft: what both environments have in common."""

    def __init__(self, aircraft: Aircraft) -> None:
        self.aircraft, self.hover = aircraft, _hover(aircraft)
        self.axes = aircraft.axis_controls
        low, high = np.array(list(aircraft.control_ranges.values())).T
        self._low, self._high = low, high
        self.simulation = Simulation(aircraft, trimmed_state(aircraft, self.hover), self.hover.swashplate, tick=PERIOD)
        self.mixer = Mixer(aircraft)

    def restart(self, random: np.random.Generator) -> None:
        """Begin near the origin; the time of the simulation goes on, so that flights stay side by side."""
        spread = {name: random.uniform(-size, size, 3) for name, size in DEPARTURES.items()}
        state = trimmed_state(self.aircraft, self.hover, spread["position"], float(spread["heading"][0]))
        state[S.VELOCITY : S.RATES] += spread["velocity"]
        state[S.RATES : S.BODY_SIZE] += spread["rates"]
        self.simulation.reset(state, self.hover.swashplate)
        self.mixer = Mixer(self.aircraft)
        self.mixer.set_position(self.hover.swashplate)
        self.mixer.set_target(self.hover.controls)
        self.mixer.move(self.simulation.time)

    def command(self, action: Any) -> None:
        """Let an action act, shape (4,): departures of the controls over AUTHORITY."""
        values = np.asarray(action, dtype=float)
        if values.shape != (ACTIONS,) or not np.all(np.isfinite(values)):
            raise SimulationError(f"action = {checks.shown(values.tolist())}: allowed are {ACTIONS} finite numbers")
        controls = self.hover.controls.copy()
        controls[self.axes] += AUTHORITY * np.clip(values, -1.0, 1.0)
        self.mixer.set_target(np.clip(controls, self._low, self._high))
        self.simulation.set_swashplate(self.mixer.move(self.simulation.time))

    def observation(self) -> NDArray[np.float32]:
        """Observation, shape (12,)."""
        body = self.simulation.state[: S.BODY_SIZE]
        heading, pitch, roll = quaternion_to_euler(body[S.ATTITUDE : S.VELOCITY])
        north, east, down = body[: S.ATTITUDE]
        c, s = math.cos(heading), math.sin(heading)
        values = [c * north + s * east, c * east - s * north, down]
        values += [heading, pitch - self.hover.pitch, roll - self.hover.roll, *body[S.VELOCITY :]]
        bounds = np.array(list(OBSERVED.values()))
        return np.clip(values, -bounds, bounds).astype(np.float32)

    def reward(self) -> float:
        """From 0 to 1: one over one more than the sum of the squares of the departures over COSTS."""
        body = self.simulation.state[: S.BODY_SIZE]
        heading = quaternion_to_euler(body[S.ATTITUDE : S.VELOCITY])[0]
        parts = {"position": body[: S.ATTITUDE], "heading": np.array([heading]), "velocity": body[S.VELOCITY : S.RATES]}
        return 1.0 / (1.0 + sum(float(np.sum(np.square(parts[name] / size))) for name, size in COSTS.items()))

    def lost(self) -> bool:
        """True where the flight has departed too far for another step."""
        body = self.simulation.state[: S.BODY_SIZE]
        _, pitch, roll = quaternion_to_euler(body[S.ATTITUDE : S.VELOCITY])
        return bool(np.linalg.norm(body[: S.ATTITUDE]) > MAX_DISTANCE or max(abs(pitch), abs(roll)) > MAX_TILT)


def _observation_space() -> spaces.Box:
    high = np.array(list(OBSERVED.values()), dtype=np.float32)
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
        self.flight = _Flight(_aircraft(aircraft))
        self.observation_space, self.action_space = _observation_space(), _action_space()

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Begin a flight; the same seed gives the same one."""
        super().reset(seed=seed)
        self.flight.simulation.step = 0  # and with it the azimuths of the rotors
        self.flight.restart(self.np_random)
        return self.flight.observation(), {}

    def step(self, action: Any) -> tuple[NDArray[np.float32], float, bool, bool, dict[str, Any]]:
        """Fly for 0.02 s."""
        self.flight.command(action)
        try:
            self.flight.simulation.advance()
        except SimulationError as error:
            return self.flight.observation(), 0.0, True, False, {"fault": str(error)}
        lost = self.flight.lost()
        return self.flight.observation(), 0.0 if lost else self.flight.reward(), lost, False, {}


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
        loaded = _aircraft(aircraft)
        self.num_envs = checks.integer("num_envs", num_envs, 1, 100_000, SimulationError)
        self.flights = [_Flight(loaded) for _ in range(self.num_envs)]
        self._limit = max_episode_steps
        self.single_observation_space, self.single_action_space = _observation_space(), _action_space()
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._random = [np.random.default_rng() for _ in self.flights]
        self._steps, self._ended = np.zeros(num_envs, dtype=int), np.zeros(num_envs, dtype=bool)
        self._together: list[tuple[list[int], Formation]] = []
        self._arrange()

    def _arrange(self) -> None:
        lanes = lane_count()
        groups = [list(range(begin, min(begin + lanes, self.num_envs))) for begin in range(0, self.num_envs, lanes)]
        self._together = [(group, Formation([self.flights[i].simulation for i in group])) for group in groups]

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
            self.flights[i].simulation.step = 0
        for i in range(self.num_envs):
            self.flights[i].restart(self._random[i])
        self._steps[:], self._ended[:] = 0, False
        return self._observations(), {}

    def step(
        self, actions: Any
    ) -> tuple[NDArray[np.float32], Array, NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]:
        """Fly for 0.02 s."""
        begun, rewards, faults = self._ended.copy(), np.zeros(self.num_envs), np.zeros(self.num_envs, dtype=bool)
        for i, flight in enumerate(self.flights):
            if not begun[i]:
                flight.command(actions[i])
        for group, formation in self._together:
            swashplates = [self.flights[i].simulation.swashplate[np.newaxis] for i in group]
            flown = formation.fly(swashplates, 1, 1, False)
            faults[group] = [one.fault is not None for one in flown]
        if faults.any():
            self._mend(faults)
        for i, flight in enumerate(self.flights):
            if begun[i]:
                flight.restart(self._random[i])
        lost = np.array(
            [not new and (bad or own.lost()) for new, bad, own in zip(begun, faults, self.flights, strict=True)]
        )
        for i in np.flatnonzero(~begun & ~lost).tolist():
            rewards[i] = self.flights[i].reward()
        self._steps = np.where(begun, 0, self._steps + 1)
        over = (self._steps >= self._limit) & ~lost
        self._ended = lost | over
        return self._observations(), rewards, lost, over, {}

    def _mend(self, faults: NDArray[np.bool_]) -> None:
        """Let flights that stopped short of a step go on beside the others."""
        step = max(flight.simulation.step for flight in self.flights)
        for i in np.flatnonzero(faults).tolist():
            self.flights[i].simulation.step = step
        self._arrange()

    def _observations(self) -> NDArray[np.float32]:
        return np.stack([flight.observation() for flight in self.flights])


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
