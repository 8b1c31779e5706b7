"""Motion of the air: steady wind, 1-cosine gust, Dryden turbulence.

Compiled code sees one flat array per tick: `wind_at` evaluates it at any time within the tick, turbulence being
linear between the tick's ends.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sbs_sim import checks
from sbs_sim.errors import SimulationError
from sbs_sim.lanes import any_lane, as_lanes, as_records, select, zeros_like
from sbs_sim.model.elementary import cosine_and_sine, exponential, exponential_less_one
from sbs_sim.model.kernel import entry, kernel
from sbs_sim.model.noise import normal
from sbs_sim.model.trigonometry import TURN, cosine_sine

Array = NDArray[np.float64]

# columns of the wind of one tick
STEADY, GUST, GUST_START, GUST_DURATION, TURBULENCE_FROM, TURBULENCE_TO = 0, 3, 6, 7, 8, 11
WIND_SIZE = 14
BLOCK = 10_000  # ticks by which turbulence is advanced at once
MAX_WIND = 100.0  # m/s; the strongest wind measured at the ground is 113 m/s
RANGES = {
    "gust_delay": (0.0, 1e6, "s"),
    "gust_duration": (0.0, 1e6, "s"),
    "turbulence_length": (0.1, 1e4, "m"),
    "turbulence_airspeed": (0.1, MAX_WIND, "m/s"),
    "turbulence_direction": (-10.0, 10.0, "rad"),
}


@kernel
def wind_at(wind, time, fraction, out):
    """Velocity of the air, NED [m/s], at a time [s] that lies `fraction` of the way through the tick.

    The gust is peak / 2 (1 - cos(2 pi (t - start) / duration)) (EASA CS-25.341 with time instead of distance).
    """
    since, duration = time - wind[GUST_START], wind[GUST_DURATION]
    blowing = (duration > 0.0) & (since >= 0.0) & (since <= duration)
    share = zeros_like(since)
    if any_lane(blowing):
        cosine, _ = cosine_sine(TURN * since / select(blowing, duration, 1.0))
        share = select(blowing, 0.5 - 0.5 * cosine, 0.0)
    for i in range(3):
        start, end = wind[TURBULENCE_FROM + i], wind[TURBULENCE_TO + i]
        out[i] = wind[STEADY + i] + share * wind[GUST + i] + start + fraction * (end - start)


@entry
def winds_at(winds, times, like, out):
    """Velocity of the air at the beginnings of ticks, see `wind_at`.

    Parameters
    ----------
    winds : ndarray, shape (m, WIND_SIZE, n)
    times : ndarray, shape (m,)
        [s]
    like : structured ndarray
        Records of n lanes.
    out : ndarray, shape (m, 3, n)
        Output, NED [m/s].
    """
    records = as_records(like)
    air, velocities = as_lanes(winds, records), as_lanes(out, records)
    for i in range(times.size):
        wind_at(air[i], times[i], 0.0, velocities[i])


@dataclass(frozen=True)
class Wind:
    """Motion of the air from now on.

    Parameters
    ----------
    velocity : tuple of 3 floats
        Steady wind, NED, where the air goes to [m/s].
    gust : tuple of 3 floats
        Peak of the 1-cosine gust, NED [m/s].
    gust_delay, gust_duration : float
        Start after now and length [s]; a gust has a length above 0.
    turbulence_intensity : tuple of 3 floats
        Standard deviation of the Dryden turbulence along the direction in which the field passes, across it and
        vertically [m/s].
    turbulence_length : float
        Dryden length scale of all three components [m].
    turbulence_airspeed : float
        Speed at which the frozen field passes the aircraft [m/s].
    turbulence_direction : float
        Heading of the longitudinal component, from north to east [rad].
    turbulence_seed : int
        Seed of the noise: equal seeds give equal turbulence.

    Raises
    ------
    SimulationError
        For a value that is not finite or out of range, naming field, value and range; for a gust that takes no time.
    """

    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    gust: tuple[float, float, float] = (0.0, 0.0, 0.0)
    gust_delay: float = 0.0
    gust_duration: float = 0.0
    turbulence_intensity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    turbulence_length: float = 50.0
    turbulence_airspeed: float = 10.0
    turbulence_direction: float = 0.0
    turbulence_seed: int = 0

    def __post_init__(self) -> None:
        """Check every field, and make plain numbers of them, so that equal winds are equal."""
        for name in ("velocity", "gust", "turbulence_intensity"):
            minimum = 0.0 if name == "turbulence_intensity" else -MAX_WIND
            values = getattr(self, name)
            if not isinstance(values, Sequence | np.ndarray) or len(values) != 3:
                allowed = "allowed are 3 values, north, east, down [m/s]"
                raise SimulationError(f"{name} = {checks.shown(values)}: {allowed}")
            numbers = [
                checks.number(f"{name}.{axis}", value, minimum, MAX_WIND, "m/s", SimulationError)
                for axis, value in zip("xyz", values, strict=True)
            ]
            object.__setattr__(self, name, tuple(numbers))
        for name, (minimum, maximum, unit) in RANGES.items():
            object.__setattr__(
                self, name, checks.number(name, getattr(self, name), minimum, maximum, unit, SimulationError)
            )
        if any(self.gust) and not self.gust_duration > 0.0:
            raise SimulationError("gust_duration = 0: allowed is a length above 0 for a gust")
        seed = checks.integer("turbulence_seed", self.turbulence_seed, 0, 2**64 - 1, SimulationError)
        object.__setattr__(self, "turbulence_seed", seed)


class WindField:
    """A `Wind` in time: gives the flat array of each tick, in order.

    Parameters
    ----------
    wind : Wind
    start : float
        Simulation time of the first tick [s].
    tick : float
        Length of a tick [s].

    Attributes
    ----------
    ticks : int
        How many ticks were asked for.
    """

    def __init__(self, wind: Wind, start: float, tick: float) -> None:
        self.wind = wind
        self.ticks = 0
        self._array = np.zeros(WIND_SIZE)
        self._array[STEADY : STEADY + 3] = wind.velocity
        self._array[GUST : GUST + 3] = wind.gust
        self._array[GUST_START] = start + wind.gust_delay
        self._array[GUST_DURATION] = wind.gust_duration
        self._turbulence = DrydenTurbulence(wind, tick) if any(wind.turbulence_intensity) else None

    def next_tick(self) -> Array:
        """Array of the next tick, shape (WIND_SIZE,); the same memory at every call."""
        if self._turbulence is not None:
            self._array[:] = self.next_ticks(1)[0]
        else:
            self.ticks += 1
        return self._array

    def tick_number(self, number: int) -> Array:
        """Array of the tick of a number, 1 for the first; none of those before it may have been asked for."""
        if self._turbulence is not None:
            while self.ticks < number - 1:
                self.next_ticks(min(number - 1 - self.ticks, BLOCK))
        self.ticks = number - 1
        return self.next_tick()

    def next_ticks(self, count: int) -> Array:
        """Arrays of the next ticks, shape (count, WIND_SIZE): what `next_tick` gives one by one, bit for bit."""
        self.ticks += count
        rows = np.tile(self._array, (count, 1))
        if self._turbulence is not None:
            ends = self._turbulence.advance(count)
            rows[:, TURBULENCE_FROM : TURBULENCE_FROM + 3] = ends[:-1]
            rows[:, TURBULENCE_TO : TURBULENCE_TO + 3] = ends[1:]
        return rows


class DrydenTurbulence:
    """Dryden turbulence as filtered noise, sampled exactly at every tick (MIL-F-8785C, section 3.7).

    Longitudinal: H(s) = sigma sqrt(2 T) / (1 + T s); lateral and vertical: H(s) = sigma sqrt(T) (1 + sqrt(3) T s) /
    (1 + T s)^2 with T = L / V, driven by white noise of unit two-sided density. Both are discretised exactly, so the
    variance is sigma^2 for any tick.
    """

    def __init__(self, wind: Wind, tick: float) -> None:
        ratio = tick * wind.turbulence_airspeed / wind.turbulence_length
        self._noise = np.random.PCG64(wind.turbulence_seed)
        decay = exponential(-ratio)
        spread = math.sqrt(0.5 * (1.0 - decay * decay))
        direction = cosine_and_sine(wind.turbulence_direction)
        sigma = (float(value) for value in wind.turbulence_intensity)
        self._filter = (decay, ratio, spread, *_noise_of_step(ratio), *direction, *sigma)
        # The field is already there when the flight begins: start from its stationary distribution. In units of T,
        # z1' = -z1 + n and z2' = -z2 + z1 have the covariance (1/2, 1/4; 1/4, 1/4).
        along, *first = normal(self._noise, 3)
        z1, z2 = math.sqrt(0.5) * first[0], math.sqrt(0.125) * (first[0] + first[1])
        self._states = np.array([math.sqrt(0.5) * along[0], *z1, *z2])

    def advance(self, count: int) -> Array:
        """Go on by some ticks; velocity of the air now and after each of them, NED [m/s], shape (count + 1, 3)."""
        velocities = np.empty((count + 1, 3))
        _filtered(self._filter, normal(self._noise, 3 * count).reshape(-1, 2, 3), self._states, velocities)
        return velocities


@entry
def _filtered(constants, noise, states, velocities):
    """Filter the noise of `DrydenTurbulence.advance`, which goes on from `states` and changes them.

    z1 and z2 are the states of 1/(1 + T s) and 1/(1 + T s)^2 in units of time T, of the lateral and the vertical
    component; the longitudinal one has z1 alone.
    """
    decay, ratio, spread, n11, n21, n22, cosine, sine, sigma_x, sigma_y, sigma_z = constants
    along, y1, z1, y2, z2 = states[0], states[1], states[2], states[3], states[4]
    root2, root3 = math.sqrt(2.0), math.sqrt(3.0)
    for i in range(len(velocities)):
        # (1 + sqrt(3) s) / (1 + s)^2 = sqrt(3) / (1 + s) + (1 - sqrt(3)) / (1 + s)^2
        u = sigma_x * (root2 * along)
        v = sigma_y * (root3 * y1 + (1.0 - root3) * y2)
        velocities[i, 0] = cosine * u - sine * v
        velocities[i, 1] = sine * u + cosine * v
        velocities[i, 2] = sigma_z * (root3 * z1 + (1.0 - root3) * z2)
        if i == len(noise):
            break
        first, second = noise[i, 0], noise[i, 1]
        y2 = decay * (ratio * y1 + y2) + n21 * first[0] + n22 * second[0]
        z2 = decay * (ratio * z1 + z2) + n21 * first[1] + n22 * second[1]
        y1 = decay * y1 + n11 * first[0]
        z1 = decay * z1 + n11 * first[1]
        along = decay * along + spread * first[2]
    states[0], states[1], states[2], states[3], states[4] = along, y1, z1, y2, z2


def _noise_of_step(ratio: float) -> tuple[float, float, float]:
    """Cholesky factor (11, 21, 22) of the covariance that noise adds to z1, z2 in a step of length `ratio`.

    That is the integral of exp(-2 s) (1, s; s, s^2) over the step. For a short step the last diagonal element is
    lost in rounding and is set to zero then.
    """
    decay = exponential(-2.0 * ratio)
    first = -exponential_less_one(-2.0 * ratio) / 2.0
    mixed = (1.0 - decay * (1.0 + 2.0 * ratio)) / 4.0
    second = (1.0 - decay * (1.0 + 2.0 * ratio + 2.0 * (ratio * ratio))) / 4.0
    rest = max(0.0, second - mixed * mixed / first)
    return math.sqrt(first), mixed / math.sqrt(first), math.sqrt(rest)
