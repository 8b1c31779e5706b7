"""Relations between values of surfaces and fuselage that no JSON schema can express."""

import math
from typing import TYPE_CHECKING

import numpy as np

from sbs_sim.aircraft.description import Array, Fuselage, Polar, Schedule, Surface, Wash
from sbs_sim.aircraft.surfaces import COEFFICIENTS, MIN_STEP_DEG, grid_step

if TYPE_CHECKING:
    from sbs_sim.aircraft import Aircraft

MAX_STALL_DEG = 60.0


def part_problems(aircraft: "Aircraft") -> list[str]:
    """All violated relations between the values of surfaces and fuselage, each as "path = value: what is allowed"."""
    names = [rotor.name for rotor in aircraft.rotors]
    problems = []
    for i, surface in enumerate(aircraft.body.surfaces):
        found = [
            *_wash_problems(surface.wash, names),
            *_schedule_problems(surface.schedule),
            *_polar_problems(surface.polar),
            *_stall_problems(surface),
            *_range_problems(surface),
        ]
        problems += [f"body.surfaces[{i}].{problem}" for problem in found]
    fuselage = aircraft.body.fuselage
    if fuselage is not None:
        found = [*_wash_problems(fuselage.wash, names), *_fuselage_problems(fuselage)]
        problems += [f"body.fuselage.{problem}" for problem in found]
    return problems


def _wash_problems(wash: Wash, rotors: list[str]) -> list[str]:
    count = len(wash.skew)
    problems = _order_problems("wash.skew_deg", wash.skew, 1)
    if wash.rotor and wash.rotor not in rotors:
        problems.append(f"wash.rotor = {wash.rotor!r}: allowed is one of {', '.join(rotors)}")
    if len(wash.down) != count:
        problems.append(f"wash.down: allowed is a list of {count}, the number of wash.skew_deg")
    if len(wash.aft) not in (1, count):
        problems.append(f"wash.aft: allowed is a list of one, or of {count}, the number of wash.skew_deg")
    return problems


def _schedule_problems(schedule: Schedule) -> list[str]:
    count = len(schedule.airspeed)
    problems = _order_problems("schedule.airspeed", schedule.airspeed, 0)
    if len(schedule.incidence) != count:
        problems.append(f"schedule.incidence_deg: allowed is a list of {count}, the number of schedule.airspeed")
    return problems


def _polar_problems(polar: Polar) -> list[str]:
    count = len(polar.angle_deg)
    problems = _order_problems("polar.angle_deg", polar.angle_deg, 0)
    problems += [
        f"polar.{name}: allowed is a list of {count}, the number of polar.angle_deg"
        for name in ("lift", "drag")
        if len(getattr(polar, name)) != count
    ]
    if count and not problems:
        problems += _end_problems("polar.angle_deg", polar.angle_deg)
        if not problems and polar.angle_deg[-1] == 180.0:
            problems += [
                f"polar.{name}: allowed are equal values at -180 and 180 deg"
                for name in ("lift", "drag")
                if getattr(polar, name)[0] != getattr(polar, name)[-1]
            ]
    return problems


def _stall_problems(surface: Surface) -> list[str]:
    if len(surface.polar.angle_deg):
        return []
    stall = math.degrees(surface.max_lift / surface.slope + abs(surface.zero_lift_angle))
    if stall <= MAX_STALL_DEG:
        return []
    limit = (math.radians(MAX_STALL_DEG) - abs(surface.zero_lift_angle)) * surface.slope
    return [f"max_lift = {surface.max_lift}: allowed is <= {limit:.3g}, for a stall at no more than 60 deg"]


def _range_problems(surface: Surface) -> list[str]:
    low, high = (round(math.degrees(value), 9) for value in surface.incidence_range)
    if low <= 0.0 <= high:
        return []
    return [f"incidence_range_deg = [{low:g}, {high:g}]: allowed is a range with zero in it"]


def _fuselage_problems(fuselage: Fuselage) -> list[str]:
    problems = _order_problems("alpha_deg", fuselage.alpha_deg, 3) + _order_problems("beta_deg", fuselage.beta_deg, 3)
    if problems:
        return problems
    problems = _end_problems("alpha_deg", fuselage.alpha_deg)
    if (fuselage.beta_deg[0], fuselage.beta_deg[-1]) != (-90.0, 90.0):
        problems.append("beta_deg: allowed are angles from -90 to 90")
    for name, angles in (("alpha_deg", fuselage.alpha_deg), ("beta_deg", fuselage.beta_deg)):
        if grid_step(angles) < MIN_STEP_DEG:
            problems.append(f"{name}: allowed are multiples of one step of {MIN_STEP_DEG} deg or more that divides 90")
    shape = (len(fuselage.alpha_deg), len(fuselage.beta_deg))
    for name in (name for pair in COEFFICIENTS for name in pair):
        table = getattr(fuselage, name)
        problems += [
            f"{name}.{key}: allowed is a list of {count}, the number of {key}_deg, or none"
            for key, count in zip(("alpha", "beta"), shape, strict=True)
            if len(getattr(table, key)) not in (0, count)
        ]
        if len(table.grid) and table.grid.shape != shape:
            problems.append(f"{name}.grid: allowed are {shape[0]} lists of {shape[1]}, as alpha_deg and beta_deg have")
        elif fuselage.alpha_deg[-1] == 180.0 and not _is_periodic(table.alpha, table.grid):
            problems.append(f"{name}: allowed are equal values at -180 and 180 deg")
    return problems


def _is_periodic(*tables: Array) -> bool:
    return all(np.array_equal(table[0], table[-1]) for table in tables if len(table))


def _order_problems(path: str, values: Array, least: int) -> list[str]:
    if len(values) < least:
        return [f"{path}: allowed is a list of at least {least}"]
    return [] if (np.diff(values) > 0.0).all() else [f"{path}: allowed are numbers that increase"]


def _end_problems(path: str, angles: Array) -> list[str]:
    ends = (angles[0], angles[-1])
    return (
        []
        if ends in ((-90.0, 90.0), (-180.0, 180.0))
        else [f"{path}: allowed are angles from -90 to 90 or -180 to 180"]
    )
