"""Trims and rate matrices of the UH-60A as the GenHel class of models describes it, without published ones beside."""

import math
from collections.abc import Sequence

from sbs_sim.aircraft import Aircraft
from sbs_sim.analysis.linear_model import FORCES, MOMENTS, MOTIONS, LinearModel
from sbs_sim.analysis.linearize import linearize
from sbs_sim.analysis.validation.comparison import Case, Table
from sbs_sim.analysis.validation.published import craft, data
from sbs_sim.analysis.validation.uh60a import KNOT

KILOWATT = 1000.0
RATES = ("p", "q", "r")


def case() -> Case:
    """Both over the airspeed."""
    published, helicopter = data("uh60a_genhel"), craft("uh60a_genhel")
    models = {f"{speed} kt": linearize(helicopter, speed * KNOT) for speed in published["airspeeds_kt"]}
    conditions, found = tuple(models), list(models.values())
    return Case(
        name="uh60a_genhel",
        title="UH-60A of the GenHel class over its speeds",
        source=published["source"],
        statement="Aircraft uh60a_genhel, level flight at sea level without augmentation, 10 elements of a blade."
        " Computed without published data beside, to be compared outside with another model of the same parameters."
        " Derivatives of the body with rotors and inflow settled: forces over mass, moments after the inverse inertia"
        " matrix, without turning axes and gravity.",
        substitutes=(
            "Controls: angles of the swashplate and collective of the tail rotor, without the mixing unit.",
            "Stabilator: its schedule along the collective of level flight, not of pitch rate or acceleration.",
            "Tail rotor: blades on hinges, for Bailey's theory; the other differences are in the aircraft file.",
        ),
        rows=(),
        tables=(
            Table("Trims", conditions, tuple(_trim_rows(helicopter, found))),
            Table("Rate matrices", conditions, tuple(_derivative_rows(found))),
        ),
    )


def _trim_rows(helicopter: Aircraft, models: Sequence[LinearModel]) -> list[tuple[str, str, tuple[float, ...]]]:
    """Attitude, controls, and power of each rotor and of both."""
    points = [model.trim for model in models]
    angles = {"pitch attitude": [point.pitch for point in points], "roll attitude": [point.roll for point in points]}
    angles |= {name: [point[name] for point in points] for name in helicopter.control_names}
    rows = [(name, "deg", tuple(map(math.degrees, values))) for name, values in angles.items()]
    for j, rotor in enumerate(helicopter.rotors):
        rows.append((f"power, {rotor.name}", "kW", tuple(float(point.power[j]) / KILOWATT for point in points)))
    return [*rows, ("power", "kW", tuple(float(point.power.sum()) / KILOWATT for point in points))]


def _derivative_rows(models: Sequence[LinearModel]) -> list[tuple[str, str, tuple[float, ...]]]:
    """Six forces and moments by six velocities and rates."""
    found = [model.derivatives() for model in models]
    rows = []
    for equation, symbol in (*FORCES.items(), *MOMENTS.items()):
        for motion in MOTIONS:
            name = f"{symbol}_{motion}"
            rows.append((name, _unit(equation in RATES, motion in RATES), tuple(values[name] for values in found)))
    return rows


def _unit(is_moment: bool, by_rate: bool) -> str:
    """Of a force over mass or a moment over inertia, by a velocity or a rate."""
    if is_moment == by_rate:
        return "1/s"
    return "rad/(m s)" if is_moment else "m/(rad s)"
