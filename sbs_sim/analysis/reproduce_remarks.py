"""Why the recomputed results differ from the printed ones (theory.md section 9).

A remark begins with the kind of reason: "reading" (comes out under the paper's assumptions only), "artefact" (of the
way in which the paper computed or printed it; no physical model has it), "convention", "choice" (the paper leaves it
open), "misprint", "unexplained". The numbers in them are those of `sbs` and `sbs_paper`.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

SECTION = "section 9"
UNEXPLAINED = "unexplained: more than 20 % off, and the reason is not known"

_FAST = (
    "reading: the printed damping needs the paper's flap inertia and hub moment, and the quasi-static matrix; the"
    f" complete model has 0.55 to 0.7 of it ({SECTION})"
)
_FAST_LAG = (
    "reading: lag doubles the damping only through the inertial term that the paper's hub moment takes in with lag, and"
    f" only in the quasi-static matrix; in the complete model lag changes it by under 1 % ({SECTION})"
)
_PHUGOID = (
    "unexplained: its frequency ω goes with the root of g M_u / -M_q, in which the hub moment cancels while M_q alone"
    " grows with the flap inertia, so the complete model's is faster; its growth goes with ω^2 / (-2 M_q) + X_u / 2. In"
    f" the paper's reading some 15 % of the frequency remain ({SECTION})"
)
_DUTCH_ROLL = (
    "unexplained: its frequency ω goes with the root of g L'_v / -L'_p, in which the hub moment cancels while L'_p"
    " alone grows with the flap inertia, so the complete model's is faster; its growth goes with ω^2 / (-2 L'_p). In"
    f" the paper's reading some 15 % of the frequency remain, and with lag 45 % of the growth ({SECTION})"
)
_SPIRAL = (
    "unexplained: a slow pole, nearly N'_r - L'_r N'_v / L'_v, two small terms of one size; it moves with the share of"
    " the thrust that the ducts take, which the paper does not print (none here)"
)
_TWO_CONINGS = (
    "artefact: the paper prints two conings, without and with lag, for one weight to carry; in both models lag changes"
    f" it by under 0.1 %. 0.69 deg goes with the blade's own flap inertia, 0.53 deg with the paper's ({SECTION})"
)
_TILT = "reading: the tilt that the gyroscopic moment gives goes with the flap inertia, which is larger in the paper's"
_TABLE4 = (
    "artefact: Table 4 breaks the axisymmetry that a rotor has in hover: it damps pitch 1.5 times as much as roll,"
    f" which no physical model does; our values are beside it ({SECTION})"
)
_FIRST_MATRIX = (
    "artefact: a pole of the first matrix of eq. [32] alone, which holds no load; the complete system's rotor poles are"
    f" damped and none is at zero ({SECTION})"
)
_CONING_POLE = (
    f"{_FIRST_MATRIX}. It is 2 Ω a_0 √(A_1/A_2), or Ω plus and minus that, and so follows the coning: the printed"
    " one belongs to 0.53 deg, which Table 3 has without lag"
)
_C_LAMBDA = (
    f"artefact: the pole of C^λ alone; with what the loads give back to the inflow the complete system's is"
    f" several times faster ({SECTION})"
)

REMARKS = {
    "table1.short_period": _FAST,
    "table1.roll": _FAST,
    "table1.phugoid": _PHUGOID,
    "table1.dutch_roll": _DUTCH_ROLL,
    "table1.spiral": _SPIRAL,
    "table2.short_period": _FAST_LAG,
    "table2.roll": _FAST_LAG,
    "table2.phugoid": _PHUGOID,
    "table2.dutch_roll": _DUTCH_ROLL,
    "table2.spiral": _SPIRAL,
    "table3.flap_only.a0_deg": _TWO_CONINGS,
    "table3.flap_only.b1_deg": _TILT,
    "table3.flap_only.M_q": f"{_FAST}; printed without its unit",
    "table3.flap_only.L_p": f"{_FAST}; printed without its unit",
    "table3.flap_lag.a0_deg": _TWO_CONINGS,
    "table3.flap_lag.a1_deg": (
        "artefact: lag multiplies a_1 by five in print, but M_q only by two; in both models lag changes a_1 by 2 % or"
        f" less ({SECTION})"
    ),
    "table3.flap_lag.b1_deg": _TILT,
    "table3.flap_lag.M_q": f"{_FAST_LAG}; printed without its unit",
    "table3.flap_lag.L_p": f"{_FAST_LAG}; printed without its unit",
    "table4.short_period": _TABLE4,
    "table4.phugoid_plus": f"{_TABLE4}; here the phugoid stays a pair",
    "table4.phugoid_minus": f"{_TABLE4}; here the phugoid stays a pair",
    "table4.heave": (
        f"artefact: in hover cyclic inflow does not act on heave; in print it does, from -0.52 to -0.45 ({SECTION})"
    ),
    "table4.roll": _TABLE4,
    "table4.dutch_roll": f"{_TABLE4}. Misprint: no i behind 0.22",
    "table4.spiral": _TABLE4,
    "table5.coupled_collective": _CONING_POLE,
    "table5.coupled_advancing": _CONING_POLE,
    "table5.coupled_regressing": _CONING_POLE,
    "table5.collective_flap": _FIRST_MATRIX,
    "table5.non_uniform_disc_tilt": _FIRST_MATRIX,
    "table5.collective_lag": _FIRST_MATRIX,
    "table5.non_uniform_lag": _FIRST_MATRIX,
    "inflow_poles.uniform": _C_LAMBDA,
    "inflow_poles.lateral_longitudinal": _C_LAMBDA,
    "hover.collective_deg": f"choice: the collective goes with the airfoil, which the paper does not name ({SECTION})",
    "hover.longitudinal_cyclic_deg": "not printed for hover",
    "hover.coning_deg": "not printed for hover; see a_0 in Table 3, which a small pitch rate does not change",
}


def remark_on(table: str, group: str, key: str) -> str:
    """Remark on one entry; empty where there is nothing to say."""
    return REMARKS.get(".".join(part for part in (table, group, key) if part), "")


def general_remarks(facts: Mapping[str, Any], flights: Mapping[str, Mapping[str, Any]]) -> tuple[str, ...]:
    """What holds for the whole report.

    Parameters
    ----------
    facts, flights : mapping
        See `sbs_sim.analysis.reproduce.Report`; flights in degrees.
    """
    reading = facts["lambdac_reversed"]["paper_reading"]
    return (
        "Sections without a name are those of docs/theory.md.",
        "Complete: rigid body and blades as one multibody system, poles of its full matrix. The paper's reading: blades"
        " on a steady hub, flap inertia m_b R^2 / 3 and the paper's hub moment, found by trial; it is not the only one"
        " possible and not physically consistent. Its body poles are those of the quasi-static 8-state matrix.",
        "Ratios are ours over print, with the sign for real numbers and of magnitudes where one of the two is a pair;"
        " a star marks what is more than 20 % off, of another kind (a pair for a real pole), or missing.",
        "Convention: the paper prints no sign with its damping, which is positive for the oscillations that grow: it is"
        " Re/|p| of the printed poles, to within their rounding. Ours is given in the same way.",
        "Damping goes with the lift slope of the airfoil, which the paper does not name: NACA 0012 is given beside the"
        f" plain airfoil of the paper's reading ({SECTION}).",
        _axisymmetry(facts["hub_damping"]),
        "Of Table 4, reversing the sign of λ_c in all loads of the paper's reading gives the pattern (a faster short"
        f" period, {_pole(reading, 'short period')}, and a phugoid of two real poles, {_pole(reading, 'phugoid (+)')}"
        f" and {_pole(reading, 'phugoid (-)')} rad/s), but not the numbers, nor the Dutch roll ({SECTION}).",
        "Misprint: the last row of the first matrix of eq. [32] has -K_0, -K_1 under the flap columns, against eq."
        f" [14]; as printed it would have poles with real parts up to"
        f" {_largest_real(facts['equation_32']['as_printed']):.3g} rad/s, and Table 5 needs the order of eq. [14].",
        "Misprint: the paper's section 3.1 calls Table 3 Table 2. Tables 3 and 5 do not fit each other: with the 0.69"
        " deg that Table 3 has with lag, the coupled collective pole would be near 5.9 rad/s, not 4.55.",
        *_forward_flight(flights),
    )


def _axisymmetry(damping: Mapping[str, Any]) -> str:
    """What printed poles say about the hub damping."""
    pairs = [damping[table]["printed_poles"] for table in ("table1", "table2", "table4")]
    said = ", ".join(f"{pair['pitch']:.1f} and {pair['roll']:.1f}" for pair in pairs)
    return (
        "In hover an axisymmetric rotor damps pitch and roll alike. The printed fast poles times the inertias (in roll"
        f" less the share of the rotors' distance) give, for Tables 1, 2 and 4, {said} N m s: Table 4 breaks it"
        f" ({SECTION})."
    )


def _pole(poles: Mapping[str, complex], name: str) -> str:
    return f"{poles[name].real:.3g}" if name in poles else "none"


def _largest_real(poles: list[complex]) -> float:
    return max(pole.real for pole in poles)


def _forward_flight(flights: Mapping[str, Mapping[str, Any]]) -> tuple[str, ...]:
    """Whether the trims over forward speed are as the paper's text says."""
    labels = {
        "complete": "the complete model",
        "paper_reading": "the paper's reading",
        "paper_reading_uniform_inflow": "the paper's reading without cyclic inflow",
    }
    said = []
    for name, label in labels.items():
        flight = flights[name]
        pitch, push = np.array(flight["pitch_deg"]), np.array(flight["longitudinal_cyclic_deg"])
        falls = bool(np.all(np.diff(pitch[~np.isnan(pitch)]) < 0.0))
        way = "falls all the way" if falls else f"rises to {np.nanmax(pitch):.1f} deg before it falls"
        pushed = "a push at all speeds" if np.nanmin(push[1:]) > 0.0 else "not always a push"
        said.append(f"{label}: the nose {way}, longitudinal cyclic is {pushed}{_not_flown(flight)}")
    return (
        "Forward flight, in print nose down with a push: " + "; ".join(said) + ". The paper is silent on the control"
        " phase; without one, as in its reading here, most of the longitudinal control is lost (sections 4 and 9).",
    )


def _not_flown(flight: Mapping[str, Any]) -> str:
    """Where there is no trim, or one that cannot be flown."""
    failed = [float(speed) for speed in flight["errors"]]
    beyond = sum(1 for texts in flight["beyond_limits"] if texts)
    parts = [f", no trim is found from {min(failed):g} to {max(failed):g} m/s"] if failed else []
    parts += [f", controls are beyond their limits at {beyond} speeds"] if beyond else []
    return "".join(parts)
