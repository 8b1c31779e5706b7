"""Level flight and hover derivatives of the UH-60A (Hilbert, NASA TM-85890)."""

import math
from typing import Any

from sbs_sim.aircraft import Aircraft
from sbs_sim.analysis.linearize import linearize
from sbs_sim.analysis.trim import trim
from sbs_sim.analysis.validation.comparison import Aim, Case, Row, compared
from sbs_sim.analysis.validation.published import data

KNOT = 0.514444  # m/s
COLLECTIVE_AIM = Aim(absolute=1.0, why="1 deg of root collective: another model of the blade's lift and of the inflow")
TAIL_AIM = Aim(absolute=1.5, why="1.5 deg of tail collective: another hinge, airfoil and flow at the tail")
ATTITUDE_AIM = Aim(absolute=1.5, why="1.5 deg of attitude")
DERIVATIVE_AIM = Aim(share=0.25, why="25 % of a derivative, for another model of rotor and interference")
MOMENTS = {"L_p": ("L'", "N'", "p", "Ixx"), "N_r": ("N'", "L'", "r", "Izz"), "N_v": ("N'", "L'", "v", "Izz")}

REMARKS = (
    "Pitch attitude at 40 and 60 kt: there the wake of the rotor crosses the stabilator, which stands at 34 and 19 deg."
    " Its wash and that on the fuselage are those of NASA CR-166309, not the charts of NASA TM-84281 that the source"
    " uses. Without wash on the fuselage the attitude rises by 0.8 deg, without wash on the stabilator by 1.2 deg at"
    " 40 kt, and without stabilator it is 4.4 and 4.2 deg.",
    "L_p with this program's inflow: its cyclic parts follow the moments of the blades and lower the Lock number that"
    " the disc feels by 1 + a sigma / (16 lambda) = 1.55 (Curtiss). The source has uniform inflow; with that alone, and"
    " without lag, the damping agrees.",
    "Y_v and N_v: the side force of the fuselage in the wash of the hovering rotor, whose tables are used at -90 deg of"
    " angle of attack, far from the wind tunnel's: without it Y_v is -0.035 and N_v 0.017. The rest of N_v is the side"
    " wind on the tail rotor, whose hinged blades with pitch-flap coupling stand for a flexible beam.",
    "The stick of the longitudinal cyclic is not compared: the source has a pitch bias actuator.",
)


def case() -> Case:
    """Trims, and derivatives with this program's inflow and with that of the source."""
    published, craft = data("uh60a"), Aircraft.load("uh60a_tm85890")
    return Case(
        name="uh60a",
        title="UH-60A in level flight",
        source=published["source"],
        statement="Aircraft uh60a_tm85890, level flight at sea level. Derivatives of the body with the rotors settled,"
        " moments over the inertia of the source; once with all states, once with the options of the source: uniform"
        " inflow, no lag.",
        substitutes=(
            "Wash of the rotor, dynamic pressure at the tails, fin and positions: NASA CR-166309 (Howlett 1981).",
            "Lag hinges, springs, dampers and the mass of the blades: the same; the source has no lag.",
            "Tail rotor: blades on hinges at 0.1 m for the flexible beam; density of sea level, which is not printed.",
            "Stabilator: its schedule along the collective of these trims, not of pitch rate and lateral acceleration.",
        ),
        rows=(*_trim_rows(craft, published), *_derivative_rows(craft, published)),
        remarks=REMARKS,
    )


def _trim_rows(craft: Aircraft, published: dict[str, Any]) -> list[Row]:
    rigging, rows = published["rigging"], list[Row]()
    for speed, collective, pedals, pitch in published["level_flight"]:
        point = trim(craft, speed * KNOT)
        root = rigging["C5"] + rigging["C6"] * collective
        tail = rigging["C7"] + rigging["C8"] * (pedals + rigging["SK11"] * collective)
        where = f"{speed:g} kt"
        for name, theirs, ours, aim in (
            ("root collective", math.degrees(root), point.controls[0], COLLECTIVE_AIM),
            ("tail collective", math.degrees(tail), point.controls[3], TAIL_AIM),
            ("pitch attitude", pitch, point.pitch, ATTITUDE_AIM),
        ):
            rows.append(compared(name, where, theirs, math.degrees(ours), "deg", aim))
        if speed == 1:
            roll = math.degrees(point.roll)
            rows.append(compared("roll attitude", where, published["roll_at_1_kt_deg"], roll, "deg", ATTITUDE_AIM))
    return rows


def _derivative_rows(craft: Aircraft, published: dict[str, Any]) -> list[Row]:
    rows = []
    for condition, states, aim in (
        ("options of the source", False, DERIVATIVE_AIM),
        ("all states", True, None),
    ):
        where = f"0.5 kt, {condition}"
        found = _derivatives(craft, 0.5, states, published["inertia_kg_m2"])
        for name, theirs in published["derivatives_at_half_kt"].items():
            rows.append(compared(name, where, theirs, found[name], "1/(m s)" if name == "N_v" else "1/s", aim))
        damping = _derivatives(craft, 20.0, states, published["inertia_kg_m2"])["Z_w"]
        rows.append(compared("Z_w", f"20 kt, {condition}", published["heave_damping_at_20_kt"], damping, "1/s", aim))
    return rows


def _derivatives(craft: Aircraft, speed: float, states: bool, inertia: dict[str, float]) -> dict[str, float]:
    """Derivatives with moments over a moment of inertia, and not after the inverse of the inertia matrix."""
    found = linearize(craft, speed * KNOT, lead_lag=states, cyclic_inflow=states).derivatives()
    moments = {
        name: found[f"{own}_{motion}"] - inertia["Ixz"] / inertia[axis] * found[f"{other}_{motion}"]
        for name, (own, other, motion, axis) in MOMENTS.items()
    }
    return {**found, **moments}
