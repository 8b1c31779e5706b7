"""Turbulence of military specifications, and gusts of certification rules, as fields of a `Wind`.

`Wind(**specified_turbulence(50.0, "moderate"), turbulence_airspeed=15.0)`.
"""

import math
from typing import Any

import numpy as np

from sbs_sim import checks
from sbs_sim.aircraft.atmosphere import standard_air
from sbs_sim.errors import SimulationError
from sbs_sim.model.air_field import DRYDEN, VON_KARMAN

FOOT, KNOT = 0.3048, 1852.0 / 3600.0
MIL_F_8785C, MIL_HDBK_1797 = "MIL-F-8785C", "MIL-HDBK-1797"
LOWEST, LOW, HIGH = 10.0, 1000.0, 2000.0  # ft: below the first it counts; between the others values are linear
FREE_LENGTHS = {DRYDEN: 1750.0, VON_KARMAN: 2500.0}  # ft, above 2000 ft
WIND_AT_20_FT = {"light": 15.0, "moderate": 30.0, "severe": 45.0}  # kn
PROBABILITIES = {"light": 1e-2, "moderate": 1e-3, "severe": 1e-5}  # of exceedance
# MIL-F-8785C, figure 7, as JSBSim tabulates it: heights [ft], and intensities [ft/s] by probability of exceedance
HEIGHTS = (500, 1750, 3750, 7500, 15000, 25000, 35000, 45000, 55000, 65000, 75000, 80000)
INTENSITIES = {
    2e-1: (3.2, 2.2, 1.5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    1e-1: (4.2, 3.6, 3.3, 1.6, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    1e-2: (6.6, 6.9, 7.4, 6.7, 4.6, 2.7, 0.4, 0.0, 0.0, 0.0, 0.0, 0.0),
    1e-3: (8.6, 9.6, 10.6, 10.1, 8.0, 6.6, 5.0, 4.2, 2.7, 0.0, 0.0, 0.0),
    1e-4: (11.8, 13.0, 16.0, 15.1, 11.6, 9.7, 8.1, 8.2, 7.9, 4.9, 3.2, 2.1),
    1e-5: (15.6, 17.6, 23.0, 23.6, 22.1, 20.0, 16.0, 15.1, 12.1, 7.9, 6.2, 5.1),
    1e-6: (18.7, 21.5, 28.4, 30.2, 30.7, 31.0, 25.2, 23.1, 17.5, 10.7, 8.4, 7.2),
}
MAX_HEIGHT = 24_384.0  # m, 80 000 ft
GUSTS = ("cs23", "cs25", "cs27", "cs29", "mil_f_8785c")
TO = {
    "up": (0, 0, -1),
    "down": (0, 0, 1),
    "left": (0, -1, 0),
    "right": (0, 1, 0),
    "ahead": (1, 0, 0),
    "back": (-1, 0, 0),
}
ROTORCRAFT_GUST = 30.0 * FOOT  # m/s
SMALL_AIRPLANE_GUSTS = {
    "VB": (66.0, 38.0),
    "VC": (50.0, 25.0),
    "VD": (25.0, 12.5),
}  # ft/s up to 20 000 ft, at 50 000 ft
LARGE_AIRPLANE_HEIGHTS, LARGE_AIRPLANE_GUSTS = (0.0, 4572.0, 18288.0), (17.07, 13.41, 6.36)  # m, m/s
LEAST_GRADIENT, MOST_GRADIENT = 9.0, 107.0  # m


def scale_lengths(height: float, specification: str = MIL_F_8785C, model: str = DRYDEN) -> tuple[float, float, float]:
    """Scale lengths L_u, L_v, L_w as the specification defines them [m].

    MIL-F-8785C, sections 3.7.2 and 3.7.3; MIL-HDBK-1797, whose L_v and L_w are half of those. Heights below 10 ft count
    as 10 ft, and between 1000 and 2000 ft the lengths are linear in the height.

    Parameters
    ----------
    height : float
        Above the ground [m].
    specification : str
        "MIL-F-8785C" or "MIL-HDBK-1797".
    model : str
        "dryden" or "von_karman".

    Raises
    ------
    SimulationError
        A value out of range.
    """
    feet = _feet(height)
    checks.choice("specification", specification, (MIL_F_8785C, MIL_HDBK_1797), SimulationError)
    checks.choice("model", model, tuple(FREE_LENGTHS), SimulationError)
    low = min(feet, LOW)
    horizontal, vertical = low / (0.177 + 0.000823 * low) ** 1.2, low
    share = min(max((feet - LOW) / (HIGH - LOW), 0.0), 1.0)
    free = FREE_LENGTHS[model]
    horizontal, vertical = (own + share * (free - own) for own in (horizontal, vertical))
    half = 0.5 if specification == MIL_HDBK_1797 else 1.0
    return horizontal * FOOT, half * horizontal * FOOT, half * vertical * FOOT


def intensities(
    height: float, severity: str = "moderate", *, wind_at_20ft: float | None = None, probability: float | None = None
) -> tuple[float, float, float]:
    """Standard deviations of the components u, v, w [m/s], of both specifications.

    Parameters
    ----------
    height : float
        Above the ground [m].
    severity : str
        "light", "moderate" or "severe": a wind of 15, 30 or 45 kn at 20 ft, and probabilities of exceedance of 1e-2,
        1e-3 and 1e-5.
    wind_at_20ft : float, optional
        [m/s], for heights up to 2000 ft.
    probability : float, optional
        Of exceedance, 2e-1 or 1e-1 to 1e-6, for heights above 1000 ft.

    Raises
    ------
    SimulationError
        A value out of range.
    """
    feet = _feet(height)
    checks.choice("severity", severity, tuple(WIND_AT_20_FT), SimulationError)
    if wind_at_20ft is None:
        wind_at_20ft = WIND_AT_20_FT[severity] * KNOT
    wind = checks.number("wind_at_20ft", wind_at_20ft, 0.0, 100.0, "m/s", SimulationError)
    probability = PROBABILITIES[severity] if probability is None else probability
    if probability not in INTENSITIES:
        allowed = ", ".join(f"{value:g}" for value in INTENSITIES)
        raise SimulationError(f"probability = {checks.shown(probability)}: allowed are {allowed}")
    low = min(feet, LOW)
    vertical = 0.1 * wind
    horizontal = vertical / (0.177 + 0.000823 * low) ** 0.4
    share = min(max((feet - LOW) / (HIGH - LOW), 0.0), 1.0)
    if share > 0.0:
        free = FOOT * float(np.interp(max(feet, HIGH), HEIGHTS, INTENSITIES[probability]))
        horizontal, vertical = (own + share * (free - own) for own in (horizontal, vertical))
    return horizontal, horizontal, vertical


def specified_turbulence(
    height: float,
    severity: str = "moderate",
    *,
    model: str = DRYDEN,
    wind_at_20ft: float | None = None,
    probability: float | None = None,
) -> dict[str, Any]:
    """Turbulence of MIL-F-8785C and MIL-HDBK-1797 at a height above the ground [m], as fields of a `Wind`.

    The spectra of both are the same. See `scale_lengths` and `intensities` for the parameters and for what is raised.
    """
    along, across, down = scale_lengths(height, MIL_F_8785C, model)
    return {
        "turbulence_model": model,
        "turbulence_intensity": intensities(height, severity, wind_at_20ft=wind_at_20ft, probability=probability),
        "turbulence_length": along,
        "turbulence_lateral_length": across,
        "turbulence_vertical_length": down,
    }


def certification_gust(
    name: str,
    *,
    to: str = "up",
    gradient: float | None = None,
    velocity: float | None = None,
    altitude: float = 0.0,
    chord: float | None = None,
    speed: str = "VC",
    alleviation: float = 1.0,
) -> dict[str, Any]:
    """Discrete gust of a rule, as fields of a `Wind` for a gust over distance.

    Parameters
    ----------
    name : str
        "cs25": CS 25.341(a), U / 2 (1 - cos(pi s / H)) over 2 H, with U = U_ref F_g (H / 107 m)^(1/6). "cs23":
        14 CFR 23.333(c) and 23.341 until amendment 63, U / 2 (1 - cos(2 pi s / 25 C)). "cs27", "cs29": CS 27.341 and
        CS 29.341, 30 ft/s at each critical airspeed, hover included, without a shape: here it rises as in MIL-F-8785C
        over a gradient distance that is given. "mil_f_8785c": V / 2 (1 - cos(pi x / d)) up to d, and V from then on, as
        the MathWorks Aerospace Blockset, Discrete Wind Gust Model, gives the model of MIL-F-8785C.
    to : str
        Where the air goes: "up", "down", "left", "right", "ahead", "back", of an aircraft that heads north; CS 27.341
        has vertical gusts only.
    gradient : float
        Gradient distance H or d [m]: 9 to 107 m of "cs25"; not of "cs23".
    velocity : float
        V of "mil_f_8785c" [m/s], which takes it from its turbulence or from the user.
    altitude : float
        Above sea level [m]: the velocities of "cs23" and "cs25" are equivalent airspeeds.
    chord : float
        Mean geometric chord C of "cs23" [m].
    speed : str
        Of "cs23": "VB", "VC" or "VD"; of "cs25" "VC" or "VD", which has half the velocity.
    alleviation : float
        Flight profile alleviation factor F_g of "cs25".

    Raises
    ------
    SimulationError
        A value out of range, one that is missing, or one that the rule does not have.
    """
    checks.choice("name", name, GUSTS, SimulationError)
    checks.choice("to", to, tuple(TO), SimulationError)
    altitude = checks.number("altitude", altitude, 0.0, 15_240.0, "m", SimulationError)
    if name == "cs27" and to not in ("up", "down"):
        raise SimulationError(f"to = {to!r}: allowed are up, down with name = 'cs27', whose gusts are vertical")
    _only(name, "velocity", velocity, ("mil_f_8785c",))
    _only(name, "chord", chord, ("cs23",))
    _only(name, "gradient", gradient, ("cs25", "cs27", "cs29", "mil_f_8785c"))
    shape, size = "ramp", ROTORCRAFT_GUST
    if name == "cs23":
        length = 25.0 * checks.number("chord", chord, 0.01, 100.0, "m", SimulationError)
        checks.choice("speed", speed, tuple(SMALL_AIRPLANE_GUSTS), SimulationError)
        knots = [20_000.0 * FOOT, 50_000.0 * FOOT]
        size = FOOT * float(np.interp(altitude, knots, SMALL_AIRPLANE_GUSTS[speed]))
        shape = "one_minus_cosine"
    elif name == "cs25":
        distance = checks.number("gradient", gradient, LEAST_GRADIENT, MOST_GRADIENT, "m", SimulationError)
        checks.choice("speed", speed, ("VC", "VD"), SimulationError)
        factor = checks.number("alleviation", alleviation, 0.0, 1.0, "", SimulationError)
        reference = float(np.interp(altitude, LARGE_AIRPLANE_HEIGHTS, LARGE_AIRPLANE_GUSTS))
        size = reference * factor * (distance / MOST_GRADIENT) ** (1.0 / 6.0) * (0.5 if speed == "VD" else 1.0)
        length, shape = 2.0 * distance, "one_minus_cosine"
    else:
        length = checks.number("gradient", gradient, 0.1, 1e4, "m", SimulationError)
        if name == "mil_f_8785c":
            size = checks.number("velocity", velocity, 0.0, 100.0, "m/s", SimulationError)
    if shape == "one_minus_cosine":  # equivalent airspeeds
        size *= math.sqrt(standard_air(0.0).density / standard_air(altitude).density)
    gust = tuple(size * part for part in TO[to])
    return {"gust": gust, "gust_length": length, "gust_shape": shape}


def _feet(height: float) -> float:
    """Height in feet; below 10 ft it counts as 10 ft."""
    return max(checks.number("height", height, -1e3, MAX_HEIGHT, "m", SimulationError) / FOOT, LOWEST)


def _only(name: str, field: str, value: float | None, names: tuple[str, ...]) -> None:
    """Raise SimulationError for a value that a rule does not have, and for one that is missing."""
    if value is not None and name not in names:
        raise SimulationError(f"{field} = {value:g}: allowed with {', '.join(names)} only, not with name = {name!r}")
    if value is None and name in names:
        raise SimulationError(f"{field}: missing, which {name} needs")
