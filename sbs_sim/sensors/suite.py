"""The sensors of a flight: when each measures, what, and when its measurement arrives.

All is counted by integration steps, so the same flight with the same seed gives the same measurements, at any pace of
the clock and whatever else is published.
"""

from __future__ import annotations

import collections
import functools
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sbs_sim.aircraft import Aircraft
from sbs_sim.errors import SimulationError
from sbs_sim.flight.records import Snapshot
from sbs_sim.model import state as S
from sbs_sim.sensors import truth
from sbs_sim.sensors.batteries import Batteries
from sbs_sim.sensors.errors import ErrorModel, Errors
from sbs_sim.sensors.geodesy import Origin
from sbs_sim.sensors.settings import NAMES, checked, error_model

Array = NDArray[np.float64]
Measured = Callable[[Array], Array]
Look = Callable[[Snapshot, Measured], Array]

ON_GRID = 1e-6  # of a tick, that a time may be beside a multiple


class Clock(NamedTuple):
    """How a flight is handed out: integration step [s], and steps from one snapshot to the next."""

    step_size: float
    steps: int

    @property
    def tick(self) -> float:
        """From one snapshot to the next [s]."""
        return self.step_size * self.steps

    def ticks(self, time: float) -> int | None:
        """Ticks in a time [s]; None if it is no multiple."""
        count = round(time / self.tick)
        return count if abs(time - count * self.tick) <= ON_GRID * self.tick else None


class Measurement(NamedTuple):
    """What a sensor measured.

    Attributes
    ----------
    sensor : str
        One of `sbs_sim.sensors.settings.NAMES`.
    time : float
        Of the measurement [s].
    values : ndarray
        imu: angular velocity [rad/s], specific force [m/s^2], body axes, attitude as a quaternion from body to earth
        axes, shape (10,). gnss: latitude, longitude [deg], height above the ellipsoid [m]. pressure: [Pa], shape (1,).
        magnetic: body axes [T]. range: [m], shape (1,), -inf below the least distance and inf beyond the largest.
        battery: of every one its number, voltage without load [V], current that it gives [A], charge left [A h] and
        that when full [A h], shape (n, 5).
    variances : ndarray
        Of the numbers that have errors, in order, see `ErrorModel.variance`: imu angular velocity, specific force,
        attitude about body axes; gnss north, east, down [m^2]; battery the voltage.
    """

    sensor: str
    time: float
    values: Array
    variances: Array


class SensorSuite:
    """The sensors of an aircraft that are on.

    Parameters
    ----------
    aircraft : Aircraft
    values : mapping of str to object
        By names of `sbs_sim.sensors.settings.SETTINGS`.
    clock : Clock
    ground_altitude : float
        Height of the ground above the origin [m]; -inf for none.

    Raises
    ------
    SimulationError
        A value out of range, a rate or a latency that the clock does not have, a battery where there is none, a
        magnetic field that is not given.
    """

    def __init__(self, aircraft: Aircraft, values: Mapping[str, Any], clock: Clock, ground_altitude: float) -> None:
        known = checked(values)
        self._sensors = [
            _Sensor(name, number, known, clock, *MAKERS[name](aircraft, known, ground_altitude))
            for number, name in enumerate(NAMES)
            if known[f"{name}.rate"]
        ]

    @property
    def names(self) -> tuple[str, ...]:
        """Of those that are on."""
        return tuple(sensor.name for sensor in self._sensors)

    def take(self, now: Snapshot) -> list[Measurement]:
        """Measurements that arrive with a snapshot, the next in time.

        A snapshot of a time that has been before measures nothing.
        """
        return [measurement for sensor in self._sensors for measurement in sensor.take(now)]


class _Sensor:
    """One sensor with its clock, its errors and what is on its way."""

    def __init__(
        self,
        name: str,
        number: int,
        values: Mapping[str, Any],
        clock: Clock,
        axes: Sequence[ErrorModel],
        look: Look,
    ) -> None:
        self.name, self._look = name, look
        rate, latency = values[f"{name}.rate"], values[f"{name}.latency"]
        period, delay = clock.ticks(1.0 / rate), clock.ticks(latency)
        if not period:
            highest = f"{1.0 / clock.tick:.10g} Hz"
            raise SimulationError(
                f"parameter {name}.rate = {rate:g}: allowed are {highest} over an integer (publish_rate)"
            )
        if delay is None:
            raise SimulationError(
                f"parameter {name}.latency = {latency:g}: allowed are multiples of {clock.tick:g} s (publish_rate)"
            )
        self._period, self._delay = period * clock.steps, delay * clock.steps
        self._errors = Errors(axes, 1.0 / (period * clock.tick), values["sensors.seed"], number)
        self._last = -1  # number of the last sample
        self._waiting: collections.deque[tuple[int, Measurement]] = collections.deque()

    def take(self, now: Snapshot) -> list[Measurement]:
        index = now.step // self._period
        if index > self._last:
            self._last = index
            values = self._look(now, functools.partial(self._errors.measured, index=index))
            measurement = Measurement(self.name, now.time, values, self._errors.variances)
            self._waiting.append((now.step + self._delay, measurement))
        arrived = []
        while self._waiting and self._waiting[0][0] <= now.step:
            arrived.append(self._waiting.popleft()[1])
        return arrived


def _imu(aircraft: Aircraft, values: Mapping[str, Any], _: float) -> tuple[list[ErrorModel], Look]:
    axes = [error_model(values, "imu", kind) for kind in ("gyro_", "accel_", "attitude_") for _ in range(3)]
    position, gravity = values["imu.position"], aircraft.environment.gravity

    def look(now: Snapshot, measured: Measured) -> Array:
        rates, rate_changes = now.state[S.RATES : S.BODY_SIZE], now.derivative[S.RATES : S.BODY_SIZE]
        force = truth.specific_force_at(position, truth.specific_force(now, gravity), rates, rate_changes)
        found = measured(np.concatenate([rates, force, np.zeros(3)]))
        return np.concatenate([found[:6], turned(now.state[S.ATTITUDE : S.VELOCITY], found[6:])])

    return axes, look


def _gnss(_: Aircraft, values: Mapping[str, Any], __: float) -> tuple[list[ErrorModel], Look]:
    level, vertical = error_model(values, "gnss"), error_model(values, "gnss", factor=values["gnss.vertical_ratio"])
    origin = Origin(*(values[f"sensors.{name}"] for name in ("latitude_deg", "longitude_deg", "height")))
    return [level, level, vertical], lambda now, measured: np.array(
        origin.geodetic_deg(measured(now.state[: S.ATTITUDE]))
    )


def _pressure(aircraft: Aircraft, values: Mapping[str, Any], _: float) -> tuple[list[ErrorModel], Look]:
    environment = aircraft.environment
    origin = values["sensors.height"] if environment.altitude is None else environment.altitude
    offset = environment.temperature_offset
    return [error_model(values, "pressure")], lambda now, measured: measured(
        np.array([truth.static_pressure(-float(now.state[2]), origin, offset)])
    )


def _magnetic(_: Aircraft, values: Mapping[str, Any], __: float) -> tuple[list[ErrorModel], Look]:
    field = values["magnetic.field"]
    if not any(field):
        raise SimulationError(
            f"parameter magnetic.field = {field}: allowed is a field that is not zero, north, east, down [T]"
        )
    return [error_model(values, "magnetic")] * 3, lambda now, measured: measured(truth.magnetic_field(now, field))


def _range(_: Aircraft, values: Mapping[str, Any], ground_altitude: float) -> tuple[list[ErrorModel], Look]:
    least, most = values["range.limits"]
    if not least < most:
        raise SimulationError(f"parameter range.limits = {[least, most]}: allowed are a smaller and a larger distance")

    def look(now: Snapshot, measured: Measured) -> Array:
        found = float(measured(np.array([truth.range_down(now, ground_altitude)]))[0])
        return np.array([-math.inf if found < least else math.inf if found > most else found])

    return [error_model(values, "range")], look


def _battery(aircraft: Aircraft, values: Mapping[str, Any], _: float) -> tuple[list[ErrorModel], Look]:
    batteries = Batteries(aircraft)
    if not len(batteries):
        raise SimulationError(
            f"parameter battery.rate = {values['battery.rate']:g}: allowed is 0 for an aircraft without a battery"
        )

    def look(now: Snapshot, measured: Measured) -> Array:
        voltage, current = measured(batteries.voltage(now.state)), batteries.current(now.derivative)
        return np.stack([batteries.numbers, voltage, current, batteries.charge(now.state), batteries.capacity], axis=1)

    return [error_model(values, "battery")] * len(batteries), look


def turned(quaternion: Array, error: Array) -> Array:
    """Attitude, as quaternion (w, x, y, z), turned on by a rotation vector of body axes [rad], shape (3,)."""
    angle = float(np.linalg.norm(error))
    if angle == 0.0:
        return quaternion.copy()
    w, x, y, z = quaternion.tolist()
    b, c, d = (math.sin(0.5 * angle) / angle * error).tolist()
    a = math.cos(0.5 * angle)
    return np.array(
        [
            w * a - x * b - y * c - z * d,
            w * b + x * a + y * d - z * c,
            w * c - x * d + y * a + z * b,
            w * d + x * c - y * b + z * a,
        ]
    )


MAKERS: dict[str, Callable[[Aircraft, Mapping[str, Any], float], tuple[list[ErrorModel], Look]]] = {
    "imu": _imu,
    "gnss": _gnss,
    "pressure": _pressure,
    "magnetic": _magnetic,
    "range": _range,
    "battery": _battery,
}
