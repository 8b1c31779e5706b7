"""Monte Carlo: many flights of an aircraft through turbulence, each with its own gusts and scattered parameters."""

import csv
import io
import math
from collections.abc import Mapping
from dataclasses import asdict, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sbs_sim import checks
from sbs_sim.aircraft import Aircraft
from sbs_sim.aircraft.paths import unit_of
from sbs_sim.analysis.batch import Batch, Case, percentiles
from sbs_sim.errors import BatchError
from sbs_sim.flight.controller import Controller
from sbs_sim.flight.trim_point import LIMITS, TrimCondition
from sbs_sim.model import state as S
from sbs_sim.model.frames import quaternion_to_euler
from sbs_sim.model.noise import normal
from sbs_sim.model.wind import Wind

Array = NDArray[np.float64]

OUTPUTS = ("state", "power")  # of a batch, that `quantities` needs
SHARES = (5.0, 25.0, 50.0, 75.0, 95.0)  # per cent
MAX_FLIGHTS = 1_000_000
MIN_AIRSPEED = 5.0  # m/s, at which the field passes in hover


def gust_cases(
    aircraft: Aircraft,
    flights: int,
    condition: TrimCondition | Mapping[str, Any],
    *,
    turbulence: float,
    length: float = 50.0,
    seed: int = 0,
    spread: Mapping[str, float] | None = None,
    air: Mapping[str, Any] | None = None,
    controller: Controller | None = None,
) -> list[Case]:
    """Flights with the controls of their trims, or a controller, each through Dryden turbulence of its own.

    Parameters
    ----------
    aircraft : Aircraft
    flights : int
    condition : TrimCondition or mapping
        In which each flight's aircraft is trimmed; a mapping holds arguments of `sbs_sim.trim`, see `Case`.
    turbulence : float
        Standard deviation of each component [m/s].
    length : float
        Dryden length scale [m]. The field passes with the airspeed, with 5 m/s at least.
    seed : int
        Flight i is the same for the same seed, whatever the number of flights.
    spread : mapping of str to float, optional
        Paths for `Aircraft.with_values`, and standard deviations relative to the value there: that of a flight is
        normally distributed around it.
    air : mapping of str to object, optional
        Further fields of the `Wind` of every flight, or others in place of those: {"turbulence_extent": "field"}.
    controller : Controller, optional
        Flies each of them, in place of the controls of the trims; the errors of its sensors have a seed of each flight.

    Returns
    -------
    list of Case

    Raises
    ------
    BatchError
        A number out of range, or a value that cannot be scattered.
    SbsError
        A path that does not exist, or turbulence out of range.
    """
    checks.instance("aircraft", aircraft, Aircraft, BatchError)
    if not isinstance(condition, TrimCondition):
        checks.instance("condition", condition, Mapping, BatchError)
    flights = checks.integer("flights", flights, 1, MAX_FLIGHTS, BatchError)
    seed = checks.integer("seed", seed, 0, 2**64 - 1, BatchError)
    spread = {} if spread is None else spread
    checks.instance("spread", spread, Mapping, BatchError)
    centres = {path: (_centre(aircraft, path), _checked_share(path, share)) for path, share in spread.items()}
    checks.instance("air", {} if air is None else air, Mapping, BatchError)
    others = dict(air or {})
    unknown = [name for name in others if name not in Wind.__dataclass_fields__]
    if unknown:
        raise BatchError(f"air: {checks.shown(unknown[0])}: allowed are {', '.join(Wind.__dataclass_fields__)}")
    given = asdict(condition) if isinstance(condition, TrimCondition) else dict(condition)
    most, unit = LIMITS["airspeed"]
    airspeed = checks.number("airspeed", given.get("airspeed", 0.0), -most, most, unit, BatchError)
    cases = []
    for i in range(flights):
        source = np.random.PCG64(np.random.SeedSequence([seed, i]))
        fields = {
            "turbulence_intensity": (turbulence, turbulence, turbulence),
            "turbulence_length": length,
            "turbulence_airspeed": max(abs(airspeed), MIN_AIRSPEED),
            "turbulence_direction": given.get("sideslip", 0.0),
            "turbulence_seed": source.random_raw() >> 1,
        }
        wind = Wind(**fields | others)
        numbers = normal(source, -(-len(centres) // 2)).ravel().tolist()
        scattered = zip(centres.items(), numbers, strict=False)
        changes = {path: mean * (1.0 + share * number) for (path, (mean, share)), number in scattered}
        start = condition if isinstance(condition, TrimCondition) else given
        flown = None
        if controller is not None:
            flown = replace(controller, sensors=replace(controller.sensors, seed=source.random_raw() >> 1))
        cases.append(Case(aircraft, start, flown, wind, changes))
    return cases


def _centre(aircraft: Aircraft, path: str) -> float:
    """Value of the file around which a path's values lie."""
    found = aircraft.value(path)
    every = found if isinstance(found, list) else [found]
    if any(isinstance(value, bool) or not isinstance(value, int | float) for value in every) or len(set(every)) != 1:
        raise BatchError(f"spread of {path}: its value {found!r} must be one number, or the same one for every rotor")
    if every[0] == 0.0:
        raise BatchError(f"spread of {path}: it is relative to its value, which is zero")
    return float(every[0])


def _checked_share(path: str, share: float) -> float:
    return checks.number(f"spread of {path}", share, 0.0, 1.0, "", BatchError)


def quantities(batch: Batch) -> dict[str, Array]:
    """What a person wants to see of flights, by name with its unit, angles in degrees; shape (n_flights, n_rows)."""
    x = batch["north"], batch["east"], -batch["down"]
    places = dict(zip(("north [m]", "east [m]", "height [m]"), x, strict=True))
    speeds = {f"{name} [m/s]": batch[name] for name in "uvw"}
    rates = {f"{name} [deg/s]": np.degrees(batch[name]) for name in "pqr"}
    attitude = batch["state"][:, :, S.ATTITUDE : S.ATTITUDE + 4]
    flown = ~np.isnan(attitude[:, :, 0])
    angles = np.full((*flown.shape, 3), math.nan)
    angles[flown] = np.reshape([quaternion_to_euler(quaternion) for quaternion in attitude[flown]], (-1, 3))
    angles[:, :, ::2] = np.unwrap(angles[:, :, ::2], axis=1)  # yaw and roll, over 180 deg
    named = {f"{name} [deg]": np.degrees(angles[:, :, k]) for name, k in (("roll", 2), ("pitch", 1), ("yaw", 0))}
    power = np.where(flown, np.nansum(batch["power"], axis=2), math.nan)
    return {**places, **named, **speeds, **rates, "power [W]": power}


def batch_to_dict(batch: Batch) -> dict[str, Any]:
    """Flights with what was scattered, and the percentiles over time, for JSON."""
    flights = [
        {"seed": case.wind.turbulence_seed, "changes": dict(case.changes), "warnings": warnings, "error": error}
        for case, warnings, error in zip(batch.cases, batch.warnings, batch.errors, strict=True)
    ]
    found = {name: percentiles(values, SHARES) for name, values in quantities(batch).items()}
    return {
        "aircraft": batch.cases[0].aircraft.name,
        "parameter_hash": batch.cases[0].aircraft.parameter_hash,
        "flights": flights,
        "time": batch.time,
        "shares": SHARES,
        "percentiles": found,
    }


def batch_to_csv(batch: Batch) -> str:
    """Table of flights: seed, what was scattered, the last that was flown of every quantity, warnings, error."""
    flown = quantities(batch)
    ends = (~np.isnan(batch["state"]).all(axis=2)).sum(axis=1) - 1
    paths = list(batch.cases[0].changes)
    file = io.StringIO()
    writer = csv.writer(file, lineterminator="\n")
    units = [f"{path} [{unit_of(path)}]" if unit_of(path) else path for path in paths]
    writer.writerow(["flight", "seed", *units, "time [s]", *flown, "warnings", "error"])
    for i, (case, end) in enumerate(zip(batch.cases, ends, strict=True)):
        last = [batch.time[end], *(values[i, end] for values in flown.values())] if end >= 0 else []
        numbers = [*(case.changes[path] for path in paths), *last]
        cells = [repr(float(number)) for number in numbers] + [""] * (1 + len(flown) - len(last))
        warnings = "; ".join(batch.warnings[i])
        writer.writerow([i, case.wind.turbulence_seed, *cells, warnings, batch.errors[i] or ""])
    return file.getvalue()
