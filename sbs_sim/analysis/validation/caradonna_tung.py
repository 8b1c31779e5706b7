"""Hover of two rigid blades (Caradonna and Tung)."""

import math

from sbs_sim.analysis.isolated_rotor import IsolatedRotor, RotorPoint
from sbs_sim.analysis.validation.comparison import Aim, Case, Row, compared
from sbs_sim.analysis.validation.published import craft, data
from sbs_sim.flight.trim_point import Fidelity

AIM = Aim(share=0.08, why="thrust coefficient with losses: 8 %")
HOVER = Fidelity(lead_lag=False, azimuth_count=1)  # nothing changes over the azimuth
CLOSE = 1e-5  # of the tip-loss factor

REMARKS = (
    "Thrust: two blades of aspect ratio 6 fly close above the tip vortices of each other, which take lift off the outer"
    " third of the blade and put inflow there. Momentum of the disc has neither; the usual factors bring the mean of"
    " it, and are too small at the least collective. A section with a lift slope of 5.73 leaves 17, 6 and 6 %. Inflow"
    " that varies along the radius, by rings or by a wake, would move it. The table has no Mach number: at 0.33, that"
    " of 3/4 of the radius, it would raise the slope by 6 %.",
)


def case() -> Case:
    """Thrust over collective, without losses and with them."""
    published, rows = data("caradonna_tung"), list[Row]()
    for speed, points in published["runs"].items():
        for collective, thrust in points:
            where = f"{speed:g} rpm, {collective:g} deg"
            ideal, lossy = hover(float(speed), collective), with_losses(float(speed), collective)
            rows.append(compared("C_T", f"{where}, without losses", thrust, ideal.thrust_coefficient, "1"))
            rows.append(compared("C_T", f"{where}, with losses", thrust, lossy.thrust_coefficient, "1", AIM))
            few = with_prandtl(float(speed), collective).thrust_coefficient
            rows.append(compared("C_T", f"{where}, with Prandtl's tip loss", thrust, few, "1"))
    return Case(
        name="caradonna_tung",
        title="Hover of the Caradonna-Tung model rotor",
        source=published["source"],
        statement="Aircraft caradonna_tung, its rotor alone in hover at the collective of each point. Once with the"
        " options of all cases; once with losses: induced power factor 1.15, tip loss B = 1 - sqrt(C_T) / N_b with the"
        " two blades of the report (J. G. Leishman, Principles of Helicopter Aerodynamics, chapters 2 and 3). Once with"
        " tip_loss_model: prandtl and the same induced power factor.",
        substitutes=(
            "Blades: springs of 1e5 N m/rad hold them within 0.1 deg of the precone; their mass is chosen. Stiffer"
            " springs change the thrust by 0.01 %.",
        ),
        rows=tuple(rows),
        remarks=REMARKS,
    )


def hover(speed: float, collective: float, tip_loss: float = 1.0, induced_power_factor: float = 1.0) -> RotorPoint:
    """Hover at a rotor speed in rpm and a collective in degrees."""
    values = {
        "rotors.speed_rpm": speed,
        "rotors.tip_loss": tip_loss,
        "rotors.induced_power_factor": induced_power_factor,
    }
    rotor = IsolatedRotor(craft("caradonna_tung").with_values(values), HOVER)
    return rotor.steady((math.radians(collective), 0.0, 0.0))


def with_prandtl(speed: float, collective: float) -> RotorPoint:
    """The same with the induced power factor and Prandtl's tip loss."""
    values = {
        "rotors.speed_rpm": speed,
        "rotors.tip_loss_model": "prandtl",
        "rotors.induced_power_factor": data("caradonna_tung")["induced_power_factor"],
    }
    rotor = IsolatedRotor(craft("caradonna_tung").with_values(values), HOVER)
    return rotor.steady((math.radians(collective), 0.0, 0.0))


def with_losses(speed: float, collective: float) -> RotorPoint:
    """The same with induced power factor and tip loss, B = 1 - sqrt(C_T) / N_b."""
    published, tip_loss, before = data("caradonna_tung"), 1.0, 0.0
    while abs(tip_loss - before) > CLOSE:
        point = hover(speed, collective, tip_loss, published["induced_power_factor"])
        before, tip_loss = tip_loss, 1.0 - math.sqrt(point.thrust_coefficient) / published["blades"]
    return point
