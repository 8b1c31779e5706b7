"""Motion of the air: steady wind, gusts, turbulence.

Compiled code sees one flat array per tick: `wind_at` evaluates it at any time within the tick, turbulence being
linear between the tick's ends. What is not the same at every point is added by `sbs_sim.model.air`.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sbs_sim import checks
from sbs_sim.errors import SimulationError
from sbs_sim.lanes import any_lane, as_lanes, as_records, select, zeros_like
from sbs_sim.model import air
from sbs_sim.model.air_field import DRYDEN, VON_KARMAN, field_grids
from sbs_sim.model.elementary import cosine_and_sine, exponential, exponential_less_one, natural_logarithm, power
from sbs_sim.model.gust_table import DISTANCE, TIME, GustTable
from sbs_sim.model.kernel import entry, kernel
from sbs_sim.model.noise import normal
from sbs_sim.model.records import Space
from sbs_sim.model.trigonometry import TURN, cosine_sine
from sbs_sim.model.turbulence import FilteredTurbulence
from sbs_sim.model.wind_columns import (
    GUST,
    GUST_DURATION,
    GUST_START,
    RATES_FROM,
    RATES_TO,
    STEADY,
    TURBULENCE_FROM,
    TURBULENCE_TO,
    WIND_SIZE,
)

Array = NDArray[np.float64]

BLOCK = 10_000  # ticks by which turbulence is advanced at once
MIN_TURBULENCE_AIRSPEED = 1.0  # m/s, at which a frozen field passes where there is neither wind nor flight
MAX_WIND = 100.0  # m/s; the strongest wind measured at the ground is 113 m/s
# m, passed in a millisecond at the highest speed: what is shorter falls between steps of integration
LEAST_LENGTH = 0.1
RANGES = {
    "gust_delay": (0.0, 1e6, "s"),
    "gust_duration": (0.0, 1e6, "s"),
    "turbulence_length": (LEAST_LENGTH, 1e4, "m"),
    "turbulence_airspeed": (0.1, MAX_WIND, "m/s"),
    "turbulence_direction": (-10.0, 10.0, "rad"),
    "turbulence_lateral_length": (LEAST_LENGTH, 1e4, "m"),
    "turbulence_vertical_length": (LEAST_LENGTH, 1e4, "m"),
    "turbulence_span": (0.01, 1e3, "m"),  # the least radius of a rotor
    "gust_length": (LEAST_LENGTH, 1e6, "m"),
    "gust_distance": (-1e6, 1e6, "m"),
    "gust_direction": (-10.0, 10.0, "rad"),
    "reference_height": (0.1, 1e4, "m"),
    "roughness_length": (1e-6, 10.0, "m"),
    "profile_exponent": (0.0, 1.0, ""),
}
ZEROS = {  # what 0 means, where it is below the range
    "turbulence_lateral_length": "turbulence_length",
    "turbulence_vertical_length": "turbulence_length",
    "turbulence_span": "none",
    "gust_length": "a gust over time",
}
POINT, RATES, FIELD, ELEMENTS = "point", "rates", "field", "elements"
FIELDS = (FIELD, ELEMENTS)
CHOICES = {
    "turbulence_model": (DRYDEN, VON_KARMAN),
    "turbulence_extent": (POINT, RATES, FIELD, ELEMENTS),
    "gust_shape": ("one_minus_cosine", "ramp"),
    "wind_profile": ("uniform", "logarithmic", "power"),
}
VECTOR_RANGES = {"turbulence_intensity": (0.0, MAX_WIND, "m/s"), "gust_origin": (-1e8, 1e8, "m")}


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
        Standard deviation of the turbulence along the direction in which the field passes, across it and vertically
        [m/s].
    turbulence_length : float
        Scale length of all three components [m], or of the first.
    turbulence_airspeed : float
        Speed at which the frozen field passes the aircraft [m/s].
    turbulence_direction : float
        Heading of the longitudinal component, from north to east [rad].
    turbulence_seed : int
        Seed of the noise: equal seeds give equal turbulence, and equal fluctuations of the thrust in vortex rings.
    turbulence_model : str
        "dryden" or "von_karman".
    turbulence_lateral_length, turbulence_vertical_length : float
        Scale lengths of the other components, L_v and L_w of MIL-F-8785C [m]; 0 is `turbulence_length`.
    turbulence_extent : str
        "point": turbulence is the same everywhere on the aircraft. "rates": the air also turns, with p_g, q_g and r_g
        of MIL-F-8785C. "field": turbulence is a frozen field over the horizontal plane that drifts with the steady
        wind; each rotor, surface and fuselage meets it where it is, and each disc its gradients. The speed of passing
        and its direction are then those of the flight itself. "elements": the same, and each blade element meets that
        field, and any other air that is not the same everywhere, where it is; it takes several times as long.
    turbulence_span : float
        Span b of the rates [m].
    gust_shape : str
        Of a gust over distance: "one_minus_cosine" rises and falls, "ramp" rises and stays.
    gust_length : float
        Over distance: length in which it rises and falls, or rises [m]; 0 is a gust over time.
    gust_direction : float
        Heading along which the aircraft flies into a gust over distance, also an own one [rad].
    gust_distance : float
        From `gust_origin` to its beginning along that heading [m].
    gust_origin : tuple of 3 floats
        NED [m]. The gust drifts from there with the steady wind.
    own_gust : GustTable or None
        A gust of one's own; over time it begins after `gust_delay`.
    wind_profile : str
        "uniform", or "logarithmic" or "power": the steady wind is that at `reference_height`, and changes with the
        height above the ground of the flight, above the origin where there is none.
    reference_height : float
        [m]; 20 ft by default.
    roughness_length : float
        Of the logarithmic profile [m]; by default 0.15 ft, of MIL-F-8785C for terminal flight phases.
    profile_exponent : float
        Of the power profile.

    Raises
    ------
    SimulationError
        For a value that is not finite or out of range, naming field, value and range; for a gust that takes no time;
        for values that exclude each other.
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
    turbulence_model: str = DRYDEN
    turbulence_lateral_length: float = 0.0
    turbulence_vertical_length: float = 0.0
    turbulence_extent: str = POINT
    turbulence_span: float = 0.0
    gust_shape: str = "one_minus_cosine"
    gust_length: float = 0.0
    gust_direction: float = 0.0
    gust_distance: float = 0.0
    gust_origin: tuple[float, float, float] = (0.0, 0.0, 0.0)
    own_gust: GustTable | None = None
    wind_profile: str = "uniform"
    reference_height: float = 6.096
    roughness_length: float = 0.04572
    profile_exponent: float = 1.0 / 7.0

    def __post_init__(self) -> None:
        """Check every field, and make plain numbers of them, so that equal winds are equal."""
        for name in ("velocity", "gust", "turbulence_intensity", "gust_origin"):
            minimum, maximum, unit = VECTOR_RANGES.get(name, (-MAX_WIND, MAX_WIND, "m/s"))
            values = getattr(self, name)
            if not isinstance(values, Sequence | np.ndarray) or len(values) != 3:
                allowed = f"allowed are 3 values, north, east, down [{unit}]"
                raise SimulationError(f"{name} = {checks.shown(values)}: {allowed}")
            numbers = [
                checks.number(f"{name}.{axis}", value, minimum, maximum, unit, SimulationError)
                for axis, value in zip("xyz", values, strict=True)
            ]
            object.__setattr__(self, name, tuple(numbers))
        for name, bounds in RANGES.items():
            value = checks.number(name, getattr(self, name), *bounds, SimulationError, ZEROS.get(name, ""))
            object.__setattr__(self, name, value)
        for name, allowed_words in CHOICES.items():
            checks.choice(name, getattr(self, name), allowed_words, SimulationError)
        if self.own_gust is not None:
            checks.instance("own_gust", self.own_gust, GustTable, SimulationError)
        seed = checks.integer("turbulence_seed", self.turbulence_seed, 0, 2**64 - 1, SimulationError)
        object.__setattr__(self, "turbulence_seed", seed)
        self._check_gust()
        self._check_turbulence()
        if self.wind_profile == "logarithmic" and not self.roughness_length < self.reference_height:
            allowed = f"less than reference_height = {self.reference_height:g} m"
            raise SimulationError(f"roughness_length = {self.roughness_length:g}: allowed is {allowed}")

    def _check_gust(self) -> None:
        """Raise SimulationError for a gust that is neither over time nor over distance, or both."""
        if any(self.gust) and not (self.gust_duration > 0.0 or self.gust_length > 0.0):
            raise SimulationError("gust_duration = 0, gust_length = 0: allowed is one of them above 0 for a gust")
        if self.gust_duration > 0.0 and self.gust_length > 0.0:
            raise SimulationError(
                f"gust_length = {self.gust_length:g}: allowed is 0 with gust_duration = {self.gust_duration:g} s"
            )
        if self.gust_shape == "ramp" and self.gust_duration > 0.0:
            raise SimulationError("gust_shape = 'ramp': allowed is one_minus_cosine with a gust_duration, over time")

    def _check_turbulence(self) -> None:
        """Raise SimulationError for what an extent of turbulence does not go with."""
        if self.turbulence_extent == RATES and not self.turbulence_span > 0.0:
            raise SimulationError("turbulence_span = 0: allowed is a span above 0 with turbulence_extent = 'rates'")
        if self.turbulence_extent in FIELDS:
            along, across, _ = self.turbulence_intensity
            if along != across:
                raise SimulationError(
                    f"turbulence_intensity.y = {across:g}: allowed is {along:g} m/s, that of x, with"
                    f" turbulence_extent = {self.turbulence_extent!r}, which is isotropic in the plane"
                )
            length, lateral, _ = self.turbulence_lengths
            if length != lateral:
                raise SimulationError(
                    f"turbulence_lateral_length = {lateral:g}: allowed is {length:g} m, turbulence_length, with"
                    f" turbulence_extent = {self.turbulence_extent!r}, which is isotropic in the plane"
                )

    @property
    def turbulence_lengths(self) -> tuple[float, float, float]:
        """Scale lengths along, across and down [m]."""
        length = self.turbulence_length
        return length, self.turbulence_lateral_length or length, self.turbulence_vertical_length or length

    @property
    def is_local(self) -> bool:
        """True where the air is not the same at every point of the aircraft or of its way."""
        turbulent = any(self.turbulence_intensity) and self.turbulence_extent != POINT
        front = any(self.gust) and self.gust_length > 0.0
        own = self.own_gust is not None and self.own_gust.over == DISTANCE
        return turbulent or front or own or (self.wind_profile != "uniform" and any(self.velocity))

    def velocity_at(self, height: float) -> tuple[float, float, float]:
        """Steady wind at a height above the ground, NED [m/s]."""
        share = profile_share(self, height)
        north, east, down = self.velocity
        return share * north, share * east, share * down


def profile_share(wind: Wind, height: float) -> float:
    """Steady wind at a height above the ground [m] over that at the reference height."""
    if wind.wind_profile == "uniform":
        return 1.0
    if wind.wind_profile == "logarithmic":
        if height <= wind.roughness_length:
            return 0.0
        ratio, reference = height / wind.roughness_length, wind.reference_height / wind.roughness_length
        return natural_logarithm(ratio) / natural_logarithm(reference)
    return power(height / wind.reference_height, wind.profile_exponent) if height > 0.0 else 0.0


class WindField:
    """A `Wind` in time: gives the flat array of each tick, in order.

    Parameters
    ----------
    wind : Wind
    start : float
        Simulation time of the first tick [s].
    tick : float
        Length of a tick [s].
    ground : float
        Height of the ground above the origin [m], from which heights in a profile count.

    Attributes
    ----------
    ticks : int
        How many ticks were asked for.
    space : Space or None
        What is not the same everywhere.
    """

    def __init__(self, wind: Wind, start: float, tick: float, ground: float = 0.0) -> None:
        self.wind = wind
        self.ticks = 0
        self._tick = tick
        self._array = np.zeros(WIND_SIZE)
        self._array[STEADY : STEADY + 3] = wind.velocity
        self._array[GUST : GUST + 3] = wind.gust
        self._array[GUST_START] = start + wind.gust_delay
        self._array[GUST_DURATION] = wind.gust_duration
        self._turbulence = self._filtered = None
        self._own = wind.own_gust if wind.own_gust is not None and wind.own_gust.over == TIME else None
        if any(wind.turbulence_intensity) and wind.turbulence_extent not in FIELDS:
            alike = len(set(wind.turbulence_lengths)) == 1
            if alike and wind.turbulence_model == DRYDEN and wind.turbulence_extent == POINT:
                self._turbulence = DrydenTurbulence(wind, tick)
            else:
                self._filtered = _filtered_turbulence(wind, tick)
        self.space = _space(wind, start, ground) if wind.is_local else None
        self._changes = self._turbulence is not None or self._filtered is not None or self._own is not None

    def next_tick(self) -> Array:
        """Array of the next tick, shape (WIND_SIZE,); the same memory at every call."""
        if self._changes:
            self._array[:] = self.next_ticks(1)[0]
        else:
            self.ticks += 1
        return self._array

    def tick_number(self, number: int) -> Array:
        """Array of the tick of a number, 1 for the first; none of those before it may have been asked for."""
        if self._turbulence is not None or self._filtered is not None:
            while self.ticks < number - 1:
                self.next_ticks(min(number - 1 - self.ticks, BLOCK))
        self.ticks = number - 1
        return self.next_tick()

    def next_ticks(self, count: int) -> Array:
        """Arrays of the next ticks, shape (count, WIND_SIZE): what `next_tick` gives one by one, bit for bit."""
        before = self.ticks
        self.ticks += count
        rows = np.tile(self._array, (count, 1))
        if not self._changes:
            return rows
        ends, rates = np.zeros((count + 1, 3)), np.zeros((count + 1, 3))
        if self._turbulence is not None:
            ends = self._turbulence.advance(count)
        elif self._filtered is not None:
            ends, rates = self._filtered.advance(count)
        if self._own is not None:
            ages = np.multiply(np.arange(before, self.ticks + 1), self._tick, dtype=float) - self.wind.gust_delay
            ends = ends + np.where(ages[:, np.newaxis] >= 0.0, self._own.at(ages), 0.0)
        rows[:, TURBULENCE_FROM : TURBULENCE_FROM + 3] = ends[:-1]
        rows[:, TURBULENCE_TO : TURBULENCE_TO + 3] = ends[1:]
        rows[:, RATES_FROM : RATES_FROM + 3] = rates[:-1]
        rows[:, RATES_TO : RATES_TO + 3] = rates[1:]
        return rows


def _filtered_turbulence(wind: Wind, tick: float) -> FilteredTurbulence:
    return FilteredTurbulence(
        wind.turbulence_model,
        wind.turbulence_intensity,
        wind.turbulence_lengths,
        wind.turbulence_airspeed,
        wind.turbulence_direction,
        wind.turbulence_span if wind.turbulence_extent == RATES else 0.0,
        wind.turbulence_seed,
        tick,
    )


def field_of(wind: Wind) -> tuple[Array, float] | None:
    """Levels of the field of a wind and its period, see `field_grids`; None where it has no field."""
    if wind.turbulence_extent not in FIELDS or not any(wind.turbulence_intensity):
        return None
    length, _, vertical = wind.turbulence_lengths
    return field_grids(wind.turbulence_model, length, vertical, wind.turbulence_seed)


def _space(wind: Wind, start: float, ground: float) -> Space:
    """What of a wind is not the same everywhere."""
    values = np.zeros(air.SPACE_SIZE)
    values[air.START] = start
    values[air.DRIFT : air.DRIFT + 3] = wind.velocity
    grids = np.zeros((0, 1, 1, 4))
    field = field_of(wind)
    if field is not None:
        grids, values[air.PERIOD] = field
        values[air.GRIDS] = len(grids)
        values[air.HORIZONTAL], values[air.VERTICAL] = wind.turbulence_intensity[0], wind.turbulence_intensity[2]
    values[air.ELEMENTS] = wind.turbulence_extent == ELEMENTS
    values[air.PROFILE] = CHOICES["wind_profile"].index(wind.wind_profile)
    values[air.GROUND], values[air.REFERENCE_HEIGHT] = ground, wind.reference_height
    values[air.SHAPE] = wind.roughness_length if wind.wind_profile == "logarithmic" else wind.profile_exponent
    if wind.gust_length > 0.0:
        values[air.FRONT] = 1 + CHOICES["gust_shape"].index(wind.gust_shape)
    values[air.PEAK : air.PEAK + 3], values[air.LENGTH] = wind.gust, wind.gust_length
    values[air.COSINE], values[air.SINE] = cosine_and_sine(wind.gust_direction)
    values[air.ORIGIN : air.ORIGIN + 2], values[air.DISTANCE] = wind.gust_origin[:2], wind.gust_distance
    table = np.zeros((0, 4))
    if wind.own_gust is not None and wind.own_gust.over == DISTANCE:
        table = wind.own_gust.rows
        values[air.ROWS] = len(table)
    return air.make_space(values, grids, table)


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
