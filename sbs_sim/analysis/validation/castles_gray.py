"""Hover of a model rotor (Castles and Gray)."""

import math

from sbs_sim.analysis.isolated_rotor import IsolatedRotor
from sbs_sim.analysis.validation.comparison import Aim, Case, Row, compared
from sbs_sim.analysis.validation.published import craft, data
from sbs_sim.flight.trim_point import Fidelity

THRUST_AIM = Aim(share=0.15, absolute=0.0003, why="thrust coefficient: 15 %, or 0.0003 where that is more: its scatter")
TORQUE_AIM = Aim(share=0.15, absolute=0.00002, why="torque coefficient: 15 %, or 0.00002 where that is more")
LEAST_THRUST = 0.001  # C_T from which the torque is judged: below it is a difference of two nearly equal torques
# of the report itself in hover (its Fig. 12), and the tip of few blades
LOSSES = {"rotors.tip_loss_model": "prandtl", "rotors.induced_power_factor": 1.1}
STALLING = 10.0  # deg, collective from which the rows are remarked

REMARKS = (
    "Torque: the momentum of a uniform inflow is the least induced power that a thrust can have. The measured rotor has"
    " an inflow that grows towards the tip, a tip loss and a wake that turns, and its induced power is some 15 to 20 %"
    " more; towards stall the drag of the section grows faster than that of the table, too. An induced power factor, or"
    " an inflow with more radial shapes, would raise the torque.",
    "With losses: at a collective they take a tenth off the thrust, and off the torque with it. At a thrust they give"
    " 10 % more torque and need 0.3 to 0.7 deg more collective: below stall the torques that miss would meet them.",
    "Section: with the table of NACA 0012 in place of NACA 0015 thrust is 1 to 3 % more: two torques more meet and"
    " two thrusts miss their aims, for the excess of thrust makes up for a part of the induced power that is missing.",
    "Thrust at 1200 rpm, 4.91 deg: the measured point lies below the line through its neighbours; at 1600 rpm and"
    " 4.81 deg the same rotor gave 11 % more.",
    "Thrust at 11.99 deg, 13 % more: the blade begins to stall outboard at a Reynolds number of 256 000; the table of"
    " the section stalls later.",
)


def case() -> Case:
    """Thrust and torque over collective at two rotor speeds."""
    published, rows = data("castles_gray"), list[Row]()
    for speed, points in published["runs"].items():
        rows += _run(float(speed), points)
    return Case(
        name="castles_gray",
        title="Hover of the Castles-Gray model rotor",
        source=published["source"],
        statement="Aircraft castles_gray, its rotor alone in hover at the collective of each point, blades flapping"
        " freely. The torque is that less the one at zero collective, as the report has it. Once more with losses:"
        " tip_loss_model: prandtl, and the induced power factor 1.1 that the report has in hover.",
        substitutes=(
            "Blade mass and hinge offset, on which the mean loads in hover hardly depend: 0.5 kg, uniform, 0 m.",
        ),
        rows=tuple(rows),
        remarks=REMARKS,
    )


def _run(speed: float, points: list[tuple[float, float, float | None]]) -> list[Row]:
    rotating = craft("castles_gray").with_value("rotors.speed_rpm", speed)
    rotor, rows = IsolatedRotor(rotating, Fidelity(lead_lag=False)), list[Row]()
    lossy = IsolatedRotor(rotating.with_values(LOSSES), Fidelity(lead_lag=False))
    idle = rotor.steady((0.0, 0.0, 0.0)).torque_coefficient
    lossy_idle = lossy.steady((0.0, 0.0, 0.0)).torque_coefficient
    for collective, thrust, torque in points:
        point = rotor.steady((math.radians(collective), 0.0, 0.0))
        where = f"{speed:g} rpm, {collective:g} deg"
        remark = "towards stall" if collective > STALLING else ""
        rows.append(compared("C_T", where, thrust, point.thrust_coefficient, "1", THRUST_AIM, remark))
        if torque is not None:
            aim = TORQUE_AIM if thrust >= LEAST_THRUST else None
            rows.append(compared("C_Q", where, torque, point.torque_coefficient - idle, "1", aim, remark))
        few = lossy.steady((math.radians(collective), 0.0, 0.0))
        rows.append(compared("C_T", f"{where}, with losses", thrust, few.thrust_coefficient, "1", None, remark))
        if torque is not None:
            found = few.torque_coefficient - lossy_idle
            rows.append(compared("C_Q", f"{where}, with losses", torque, found, "1", None, remark))
    return rows
