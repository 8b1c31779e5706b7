"""Numbers of the sensors: what each means, its default and its range. All sensors are off by default."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from sbs_sim import checks
from sbs_sim.errors import SimulationError
from sbs_sim.sensors.errors import ErrorModel

NAMES = ("imu", "gnss", "pressure", "magnetic", "range", "battery")
MAX_RATE = 1e4  # Hz
MAX_ERROR = 1e6  # in the unit of a sensor
CORRELATION_TIME = 300.0  # s


@dataclass(frozen=True)
class Setting:
    """A number, or some, of the sensors.

    Attributes
    ----------
    default : object
    description : str
        With its unit.
    least, most : float
        Range, ends included; of each number of a list.
    """

    default: Any
    description: str
    least: float
    most: float


def _of_axis(prefix: str, what: str, unit: str, resolution: bool = True) -> dict[str, Setting]:
    """Errors of an axis, see `ErrorModel`."""
    found = {
        "noise": Setting(0.0, f"Density of the white noise of {what} [{unit}/sqrt(Hz)]", 0.0, MAX_ERROR),
        "bias": Setting(0.0, f"Standard deviation of the bias of {what}, one for a flight [{unit}]", 0.0, MAX_ERROR),
        "instability": Setting(0.0, f"Standard deviation of the wandering bias of {what} [{unit}]", 0.0, MAX_ERROR),
    }
    if resolution:
        found["resolution"] = Setting(0.0, f"Step to which {what} is rounded; 0 is none [{unit}]", 0.0, MAX_ERROR)
    return {f"{prefix}{name}": setting for name, setting in found.items()}


def _of_sensor(name: str, topic: str, *axes: dict[str, Setting], **others: Setting) -> dict[str, Setting]:
    """Settings of a sensor, with its name before each."""
    common = {
        "rate": Setting(0.0, f"Rate of `{topic}` [Hz], publish_rate over an integer; 0 is off", 0.0, MAX_RATE),
        "latency": Setting(0.0, "Time from a measurement to its message [s], a multiple of a tick", 0.0, 10.0),
        "correlation_time": Setting(CORRELATION_TIME, "Correlation time of the wandering bias [s]", 1e-3, 1e6),
    }
    own = {key: setting for part in (common, *axes, others) for key, setting in part.items()}
    return {f"{name}.{key}": setting for key, setting in own.items()}


SETTINGS: dict[str, Setting] = {
    "sensors.seed": Setting(0, "Seed of all errors of sensors", 0, 2**63 - 1),
    "sensors.latitude_deg": Setting(0.0, "Latitude of the origin, WGS 84 [deg]", -90.0, 90.0),
    "sensors.longitude_deg": Setting(0.0, "Longitude of the origin, WGS 84 [deg]", -180.0, 180.0),
    "sensors.height": Setting(
        0.0,
        "Height of the origin above the ellipsoid [m]; its pressure altitude too, unless the aircraft file has"
        " environment.altitude",
        -5000.0,
        20000.0,
    ),
    **_of_sensor(
        "imu",
        "imu/data",
        _of_axis("gyro_", "the angular velocity", "rad/s"),
        _of_axis("accel_", "the specific force", "m/s^2"),
        _of_axis("attitude_", "the attitude, about each body axis,", "rad", resolution=False),
        position=Setting([0.0, 0.0, 0.0], "Place against the c.g.: forward, right, down [m]", -100.0, 100.0),
    ),
    **_of_sensor(
        "gnss",
        "fix",
        _of_axis("", "the position, north and east", "m", resolution=False),
        vertical_ratio=Setting(1.5, "Errors of the height over those of north and east", 0.0, 100.0),
    ),
    **_of_sensor("pressure", "pressure", _of_axis("", "the static pressure", "Pa")),
    **_of_sensor(
        "magnetic",
        "imu/mag",
        _of_axis("", "the magnetic field", "T"),
        field=Setting([0.0, 0.0, 0.0], "Magnetic field at the place of the flight: north, east, down [T]", -1.0, 1.0),
    ),
    **_of_sensor(
        "range",
        "range",
        _of_axis("", "the distance", "m"),
        limits=Setting([0.0, 100.0], "Least and largest distance that is measured [m]", 0.0, 1e5),
    ),
    **_of_sensor("battery", "battery_state", _of_axis("", "the voltage", "V")),
}


def checked(values: Mapping[str, Any]) -> dict[str, Any]:
    """The settings, with defaults where none is given.

    Raises
    ------
    SimulationError
        An unknown name, or a value out of its range.
    """
    for name in values:
        if name not in SETTINGS:
            raise SimulationError(f"parameter {name}: unknown, allowed are {', '.join(SETTINGS)}")
    return {name: _checked_one(name, values.get(name, setting.default)) for name, setting in SETTINGS.items()}


def _checked_one(name: str, value: Any) -> Any:
    setting = SETTINGS[name]
    what = f"parameter {name}"
    if isinstance(setting.default, int):
        return checks.integer(what, value, 0, 2**63 - 1, SimulationError)
    if isinstance(setting.default, float):
        return checks.number(what, value, setting.least, setting.most, "", SimulationError)
    numbers = checks.array(what, value, SimulationError).tolist()
    count = len(setting.default)
    if not isinstance(numbers, list) or len(numbers) != count:
        raise SimulationError(f"{what} = {checks.shown(value)}: allowed are {count} numbers")
    for i, number in enumerate(numbers):
        checks.number(f"{what}[{i}]", number, setting.least, setting.most, "", SimulationError)
    return numbers


def error_model(values: Mapping[str, Any], sensor: str, axis: str = "", factor: float = 1.0) -> ErrorModel:
    """Errors of an axis of a sensor, all of them times a factor."""
    parts = {
        name: factor * float(values.get(f"{sensor}.{axis}{name}", 0.0))
        for name in ("noise", "bias", "instability", "resolution")
    }
    return ErrorModel(**parts, correlation_time=float(values[f"{sensor}.correlation_time"]))
