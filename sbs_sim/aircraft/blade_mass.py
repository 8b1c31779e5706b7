"""Mass, first and second moment of a blade whose mass is distributed along the span (theory.md section 2.5)."""

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

MIN_BLADE_MASS = 1e-12  # kg


def blade_integrals(
    stations: Sequence[float], values: Sequence[float], tip_mass: float, hinge_offset: float, radius: float
) -> tuple[float, float, float]:
    """Integrals of the mass outboard of the flap hinge, eq. (2.9), exact for a mass that is linear between stations.

    Parameters
    ----------
    stations : sequence of float, length n
        Distances from the axis as shares of the radius, in order; one that occurs twice is a step.
    values : sequence of float, length n
        Mass per length [kg/m], constant inboard of the first and outboard of the last station.
    tip_mass : float
        Mass at the tip [kg].
    hinge_offset, radius : float
        Distances of the flap hinge and of the tip from the axis [m].

    Returns
    -------
    mass, first_moment, second_moment : float
        About the flap hinge [kg, kg m, kg m^2].
    """
    length = radius - hinge_offset
    places = [station * radius - hinge_offset for station in stations]  # from the flap hinge
    points = [
        (min(0.0, places[0]), values[0]),
        *zip(places, values, strict=True),
        (max(length, places[-1]), values[-1]),
    ]
    integrals = [tip_mass, tip_mass * length, tip_mass * length**2]
    for (first, at_first), (last, at_last) in pairwise(points):
        start, end = max(first, 0.0), min(last, length)
        if start >= end:
            continue
        slope = (at_last - at_first) / (last - first)
        for place, weight in ((start, 1.0), ((start + end) / 2, 4.0), (end, 1.0)):  # Simpson, exact for a cubic
            mass = (at_first + slope * (place - first)) * weight * (end - start) / 6
            for power in range(3):
                integrals[power] += mass * place**power
    mass, first_moment, second_moment = integrals
    return mass, first_moment, second_moment


def with_blade_mass(data: Mapping[str, Any]) -> Mapping[str, Any]:
    """Mapping of a rotor with mass, c.g. and inertia of its blades from their distribution; zero if it has a fault."""
    if "mass_distribution" not in data:
        return data
    table = data["mass_distribution"]
    stations, values = table.get("stations", ()), table.get("values", ())
    mass, first, second = 0.0, 0.0, 0.0
    if stations and len(stations) == len(values):
        mass, first, second = blade_integrals(
            stations, values, table.get("tip_mass", 0.0), data["hinge_offset"], data["radius"]
        )
    centre = first / mass if mass >= MIN_BLADE_MASS else 0.0
    return {**data, "blade_mass": mass, "blade_cg": centre, "blade_inertia": second}
