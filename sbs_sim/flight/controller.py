"""Controllers of flights: a control law with its numbers, its sensors, and how late it acts."""

from __future__ import annotations  # `help` then shows types by their names

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numba.core.dispatcher import Dispatcher
from numpy.typing import ArrayLike, NDArray

from sbs_sim import checks
from sbs_sim.content import ByContent
from sbs_sim.errors import SimulationError
from sbs_sim.flight import measured as M
from sbs_sim.flight.controlled import idle
from sbs_sim.model.kernel import address
from sbs_sim.model.noise import normal

Array = NDArray[np.float64]
Law = Callable[[float, Array, Array, Array, Array], None]

MAX_TIME = 10.0  # s, of a period and a delay
MAX_LAG = 100.0  # s
MAX_ERROR = 1e6  # of a sensor, in its unit
MAX_NUMBERS = 100_000  # of memory and of parameters
NOISE_STREAM, BIAS_STREAM = 11, 12  # numbers of a seed, beside those of turbulence
ON_GRID = 1e-6  # of a tick, that a time may be beside a multiple


@dataclass(frozen=True, eq=False)
class Sensors(ByContent):
    """Errors of what a control law measures.

    Parameters
    ----------
    noise : mapping of str to float
        By names of `sbs_sim.flight.measured.NAMES`, standard deviations of what differs from one measurement to the
        next, in their units: {"p": 0.002}.
    bias : mapping of str to float
        Standard deviations of errors that stay for a whole flight.
    seed : int
        The same for the same errors.

    Raises
    ------
    SimulationError
        An unknown name, or a number out of range.
    """

    noise: Mapping[str, float] = field(default_factory=dict)
    bias: Mapping[str, float] = field(default_factory=dict)
    seed: int = 0

    def __post_init__(self) -> None:
        for name in ("noise", "bias"):
            checks.instance(name, getattr(self, name), Mapping, SimulationError)
            for sensor, value in getattr(self, name).items():
                if sensor not in M.NAMES:
                    raise SimulationError(f"{name} of {checks.shown(sensor)}: allowed are {', '.join(M.NAMES)}")
                checks.number(f"{name} of {sensor}", value, 0.0, MAX_ERROR, "", SimulationError)
        checks.integer("seed", self.seed, 0, 2**63 - 1, SimulationError)

    def errors(self) -> SensorErrors:
        """Random numbers of one flight, from its beginning."""
        return SensorErrors(self)


class SensorErrors:
    """Random errors of the sensors of one flight, in order.

    Attributes
    ----------
    bias : ndarray, shape (COUNT,)
    """

    def __init__(self, sensors: Sensors) -> None:
        self._noise = np.array([sensors.noise.get(name, 0.0) for name in M.NAMES])
        source = np.random.PCG64(np.random.SeedSequence([sensors.seed, BIAS_STREAM]))
        scale = np.array([sensors.bias.get(name, 0.0) for name in M.NAMES])
        self.bias = np.zeros(M.COUNT)
        if scale.any():
            self.bias = scale * normal(source, -(-M.COUNT // 2)).ravel()[: M.COUNT]
        self._source = np.random.PCG64(np.random.SeedSequence([sensors.seed, NOISE_STREAM]))

    def next(self, count: int) -> Array:
        """Noise of so many measurements, shape (count, COUNT)."""
        if not (count and self._noise.any()):
            return np.zeros((count, M.COUNT))
        pairs = -(-M.COUNT // 2)  # for each measurement, so that it does not matter how many come at a time
        return self._noise * normal(self._source, count * pairs).reshape(count, 2 * pairs)[:, : M.COUNT]


@dataclass(frozen=True, eq=False)
class Controller(ByContent):
    """A control law in the loop of a flight, in place of its controls.

    The controls that it gives are clipped to their ranges and move swashplates, surfaces and drives at the rates of
    their actuators, as in a live flight.

    Parameters
    ----------
    law : callable
        law(time, measured, memory, parameters, controls) sets `controls` and may change `memory`; it returns nothing. A
        function of Python, or one that numba compiles, `numba.njit(law)`, which is fast: all flights then stay in
        compiled code. Time [s]; the others are arrays of one axis: what is measured, see `sbs_sim.flight.measured`,
        what the law keeps from one call to the next, its numbers, and the pilot controls in the order of
        `Aircraft.control_names` [rad, or their units], which at a call are those of the call before.
    parameters : array_like, shape (n_parameters,)
        Gains, targets: numbers that may differ from flight to flight.
    memory : array_like, shape (n_memory,)
        What the law keeps, at the start of a flight.
    period, delay : float
        From one call of the law to the next, and from a measurement to the controls that it gives [s]: multiples of the
        tick of the flight, 0 to 10. A period of 0 is one tick. Until the first controls arrive those of the start act.
    lag : float
        Time constant of a lag of first order of every control [s], 0 for none: the actuators of the flight.
    sensors : Sensors
    initial : array_like, shape (n_controls,), optional
        Controls before the first call: those of the trim point if not given. A flight from a state needs them.

    Raises
    ------
    SimulationError
        A value out of range, or a law that cannot be called.
    """

    law: Law
    parameters: ArrayLike = ()
    memory: ArrayLike = ()
    period: float = 0.0
    delay: float = 0.0
    lag: float = 0.0
    sensors: Sensors = field(default_factory=Sensors)
    initial: ArrayLike | None = None

    def __post_init__(self) -> None:
        if not callable(self.law):
            raise SimulationError(f"law = {checks.shown(self.law)}: allowed are functions")
        for name in ("parameters", "memory"):
            values = checks.array(name, getattr(self, name), SimulationError)
            if values.ndim != 1 or len(values) > MAX_NUMBERS or not np.all(np.isfinite(values)):
                raise SimulationError(
                    f"{name} have shape {values.shape}: allowed are up to {MAX_NUMBERS} finite numbers, of one axis"
                )
            object.__setattr__(self, name, values)
        for name in ("period", "delay"):
            checks.number(name, getattr(self, name), 0.0, MAX_TIME, "s", SimulationError)
        checks.number("lag", self.lag, 0.0, MAX_LAG, "s", SimulationError)
        checks.instance("sensors", self.sensors, Sensors, SimulationError)

    @property
    def is_compiled(self) -> bool:
        """True for a law that numba compiles."""
        return isinstance(self.law, Dispatcher)

    def ticks(self, name: str, tick: float) -> int:
        """The period or the delay in ticks of a length [s].

        Raises
        ------
        SimulationError
            It is no multiple of the tick.
        """
        value = float(getattr(self, name))
        count = round(value / tick)
        if abs(value - count * tick) > ON_GRID * tick:
            raise SimulationError(f"{name} = {value:g} s: allowed are multiples of the tick, {tick:g} s")
        return max(1, count) if name == "period" else count

    def lag_share(self, tick: float) -> float:
        """Share of the way to what is commanded that a control makes in a tick [s]; 1 without a lag."""
        return 1.0 if self.lag == 0.0 else -math.expm1(-tick / self.lag)

    def code(self) -> Any:
        """Address of the machine code of the law; that of one that does nothing for a law of Python.

        Raises
        ------
        SimulationError
            numba cannot compile it, or it returns something.
        """
        return law_address(self.law if self.is_compiled else idle)


def law_address(law: Any) -> Any:
    """Address of a law that numba compiles; it must outlive every flight, and does."""
    if law not in _addresses:
        numbers = np.zeros(1)
        try:
            found = address(law, 0.0, numbers, numbers, numbers, numbers)
        except Exception as error:  # whatever is wrong with it, and numba has many words for that
            text = " ".join(str(error).split())
            raise SimulationError(f"law {_name(law)}: numba cannot compile it: {text[:400]}") from error
        if hasattr(found, "signature") and str(found.signature().return_type) != "none":
            raise SimulationError(f"law {_name(law)} returns something: allowed is a law that sets `controls`")
        _addresses[law] = found
    return _addresses[law]


def _name(law: Any) -> str:
    return getattr(law, "__name__", checks.shown(law))


_addresses: dict[Any, Any] = {}
