"""Flap-lag stability in hover of blades on central springs (Ormiston and Hodges)."""

import math

import numpy as np
from scipy.optimize import brentq

from sbs_sim.analysis.isolated_rotor import IsolatedRotor
from sbs_sim.analysis.validation.comparison import Aim, Case, Row, compared
from sbs_sim.analysis.validation.published import craft, data
from sbs_sim.flight.trim_point import Fidelity

AIM = Aim(share=0.01, why="1 % of the pitch, which small angles leave out")
SEARCH = (math.radians(6.0), math.radians(20.0))
LIFT_SLOPE, SOLIDITY, STATION = 2.0 * math.pi, 0.05, 0.75
ONE_AZIMUTH = Fidelity(azimuth_count=1)  # the coefficients are constant


def case() -> Case:
    """Pitch at which the lag mode begins to grow, with this program's inflow and with that of the source."""
    published, rows = data("ormiston_hodges"), list[Row]()
    for flap, lag, theirs in published["critical_pitch"]:
        for name, of_source, aim in (("inflow of the source", True, AIM), ("momentum inflow", False, None)):
            where = f"p = {flap:g}, lag {lag:g} per rev, {name}"
            ours = critical_pitch(flap, lag, of_source=of_source)
            rows.append(compared("critical pitch", where, theirs, math.degrees(ours), "deg", aim))
    return Case(
        name="ormiston_hodges",
        title="Flap-lag stability of Ormiston and Hodges",
        source=published["source"],
        statement="Aircraft ormiston_hodges in hover, inflow held. The source has the uniform inflow of the section at"
        " 3/4 of the radius; a vertical speed makes the flow through our disc the same. With momentum theory of the"
        " whole disc it is less, and the rows are not judged.",
        substitutes=(
            "Section: cl = 2 pi sin alpha and cd = 0.01, whose lift is that of the source's linear theory.",
            "Size, speed and number of blades, which have no part in it.",
        ),
        rows=tuple(rows),
    )


def critical_pitch(flap: float, lag: float, *, of_source: bool) -> float:
    """Least collective [rad] at which a mode grows; NaN if there is none.

    Parameters
    ----------
    flap, lag : float
        Rotating frequencies per revolution.
    of_source : bool
        Inflow of the source in place of momentum theory.
    """
    aircraft = craft("ormiston_hodges")
    blade = aircraft.rotors[0]
    stiffness = blade.blade_mass * blade.radius**2 / 3.0 * blade.speed**2
    springs = {"rotors.flap_spring": (flap**2 - 1.0) * stiffness, "rotors.lag_spring": lag**2 * stiffness}
    rotor = IsolatedRotor(aircraft.with_values(springs), ONE_AZIMUTH)

    def growth(pitch: float) -> float:
        climb = _climb_rate(rotor, pitch) if of_source else 0.0
        point = rotor.steady((pitch, 0.0, 0.0), climb_rate=climb)
        matrix = rotor.matrix(point, inflow=False)[0]
        return float(np.linalg.eigvals(matrix).real.max())

    if growth(SEARCH[0]) > 0.0 or growth(SEARCH[1]) < 0.0:
        return math.nan
    return float(brentq(growth, *SEARCH, xtol=1e-5))


def _climb_rate(rotor: IsolatedRotor, pitch: float) -> float:
    """Vertical speed [m/s] with which the flow through the disc is that of the source."""
    tip_speed = rotor.rotor.speed * rotor.rotor.radius
    start = LIFT_SLOPE * SOLIDITY / 16.0
    wanted = start * (math.sqrt(1.0 + 2.0 * STATION * pitch / start) - 1.0)

    def excess(climb: float) -> float:
        point = rotor.steady((pitch, 0.0, 0.0), climb_rate=climb)
        return float(point.state[rotor.layout.inflow(0).start]) + climb / tip_speed - wanted

    return float(brentq(excess, 0.0, 0.05 * tip_speed, xtol=1e-4))
