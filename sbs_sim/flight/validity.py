"""Where the model is outside what it describes, in words (theory.md section 6.1)."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sbs_sim.aircraft import Aircraft
from sbs_sim.aircraft.description import Rotor
from sbs_sim.model import working_state as W
from sbs_sim.model.airfoil import NUMBER_NAMES
from sbs_sim.model.ground_effect import CURVE, LEAST_HEIGHT
from sbs_sim.model.interference import TURNING
from sbs_sim.model.ring import RING_BEGIN, RING_EDGEWISE, WINDMILL_BEGIN
from sbs_sim.model.unsteady_airfoil import STATION

Array = NDArray[np.float64]

# Beyond this the inflow over the disc is no longer linear along and across it, and the retreating blade is stalled.
MAX_ADVANCE_RATIO = 0.4
STALL = "stall on more than"  # words of the warning
MAX_STALLED = 0.1  # of the disc; the sections know nothing of dynamic stall, or at most of late separation
# Reduced frequency of one per revolution at three quarters of the radius: the lift of pitch rate and apparent mass,
# which is ahead of the flow, is 1.5 of it in the lift of a cyclic pitch (theory.md section 4.9).
MAX_REDUCED_FREQUENCY = 0.1
MAX_REVERSED = 0.1  # of the disc; reached at an advance ratio of 0.63, where the circle of reverse flow has mu^2 / 4
# Of airfoil tables over the Reynolds number, which have no Mach number. By the rule of Prandtl and Glauert (J. D.
# Anderson: Fundamentals of aerodynamics, section 11.4) a section lifts 1 / sqrt(1 - M^2) of what it does in
# incompressible flow: 11 % more at this one.
MAX_TIP_MACH = 0.44
INCOMPRESSIBLE = "where incompressible section data do not hold"
MAX_OUTSIDE = 0.1  # of the disc, with Reynolds or Mach numbers that the airfoil's table does not have
# Of the chord: farther off the pitch axis, the lift or the mass of sections has a moment about it that twists a real
# blade by a degree or more, and here it meets a rigid one. A c.g. behind the quarter chord lets elastic pitch and flap
# diverge or flutter together; W. Johnson: Helicopter theory, on pitch-flap flutter.
MAX_OFFSET = 0.1
MAX_TAIL_HEAVY = 0.01
OFFSET_POINTS = 101  # along the blade
# Momentum theory in descent, in hover inflow velocities: the vortex ring state begins and ends where the motion of a
# helicopter in it becomes unstable, W. Johnson: Model for vortex ring state influence on rotorcraft flight dynamics,
# NASA/TP-2005-213477; up to twice the hover inflow there is no stream tube, J. G. Leishman: Principles of helicopter
# aerodynamics, 2nd ed., section 2.13. For open rotors; a duct moves these limits.
RING_DESCENT = (RING_BEGIN, 1.5)
# Heights of a hub above the ground, over the radius, below which the ground effect of a choice is not known.
LEAST_HEIGHTS = {"cheeseman_bennett": LEAST_HEIGHT, "measured": 2.0 * float(CURVE[0, 0])}
# A hub behind that of a rotor with a swept wake, over the radius of that: beyond three quarters of its diameter from
# the front the wake rolls up, and a cylinder gives less and less of the flow; H. H. Heyson, NACA TN 3691, 1956.
MAX_BEHIND = 0.5
MIN_SPEED = 0.2  # of a rotor's own below which it hardly turns: centrifugal force is 4 % of what it is then
MARGIN = 1e-9  # for rounding
MIN_INFLOW = 0.002  # hover inflow ratio below which a rotor carries nothing, and has none of these states

NORMAL, UNLOADED, VORTEX_RING, TURBULENT_WAKE, WINDMILL = INFLOW_STATES = (
    "normal",
    "unloaded",
    "vortex ring",
    "turbulent wake",
    "windmill",
)


@dataclass(frozen=True)
class WorkingState:
    """What a rotor is made to do at an instant.

    Attributes
    ----------
    advance_ratio : float
        Velocity of the hub along the disc, relative to the air, over the tip speed.
    descent_ratio : float
        Velocity of the hub against the thrust, relative to the air, over the hover inflow velocity of the present
        thrust; negative in a climb, zero if the rotor is unloaded.
    stalled_share, reversed_share, outside_share : float
        Of the disc between flap hinge and tip: where sections are stalled, where the flow comes from behind, and where
        the Reynolds or Mach number is not in the airfoil's table; as the blades meet it at this instant.
    inflow_state : str
        One of `INFLOW_STATES`.
    """

    advance_ratio: float
    descent_ratio: float
    stalled_share: float
    reversed_share: float
    outside_share: float
    inflow_state: str


def working_state(row: Array | Sequence[float]) -> WorkingState:
    """Working state of a rotor.

    Parameters
    ----------
    row : ndarray or sequence of float, shape (WORKING_SIZE,)
        Of `sbs_sim.model.working_state`.
    """
    hover = float(row[W.HOVER_INFLOW])
    loaded = hover >= MIN_INFLOW
    descent = float(row[W.DESCENT]) / hover if loaded else 0.0
    edgewise = float(row[W.ADVANCE_RATIO]) / hover if loaded else 0.0
    state = inflow_state(descent, edgewise, float(row[W.FLOW]) >= 0.0) if loaded else UNLOADED
    return WorkingState(
        advance_ratio=float(row[W.ADVANCE_RATIO]),
        descent_ratio=descent,
        stalled_share=float(row[W.STALLED]),
        reversed_share=float(row[W.REVERSED]),
        outside_share=float(row[W.OUTSIDE]),
        inflow_state=state,
    )


def tip_mach(aircraft: Aircraft, rotor: Rotor, row: Array | Sequence[float]) -> float:
    """Mach number of the advancing tip: tip speed and velocity along the disc over the speed of sound.

    Parameters
    ----------
    aircraft : Aircraft
    rotor : Rotor
    row : ndarray or sequence of float, shape (WORKING_SIZE,)
        Of `sbs_sim.model.working_state`.
    """
    advancing = rotor.speed * rotor.radius * (1.0 + float(row[W.ADVANCE_RATIO]))
    return advancing / aircraft.environment.speed_of_sound


def inflow_state(descent: float, edgewise: float, with_thrust: bool) -> str:
    """Name of the state of a loaded rotor's inflow.

    Parameters
    ----------
    descent : float
        Velocity against the thrust over the hover inflow velocity.
    edgewise : float
        Velocity along the disc over the same.
    with_thrust : bool
        The air goes through the disc as the thrust pushes it.
    """
    first, last = RING_DESCENT
    # an ellipse over both velocities
    width = math.sqrt(max(0.0, 1.0 - (edgewise / RING_EDGEWISE) ** 2))
    middle, half = (first + last) / 2, (last - first) / 2 * width
    if width == 0.0:
        return NORMAL if with_thrust else WINDMILL
    if abs(descent - middle) <= half:
        return VORTEX_RING
    if descent < middle:
        return NORMAL
    # Air that still goes through with the thrust solves the equations up to any descent, but air does not do that.
    return TURBULENT_WAKE if with_thrust or descent < WINDMILL_BEGIN else WINDMILL


def warnings(aircraft: Aircraft, rows: Array | Sequence[Sequence[float]]) -> list[str]:
    """What is outside the validity of the model, a line each; none of them if all is well.

    Parameters
    ----------
    aircraft : Aircraft
    rows : ndarray or sequences of float, shape (n_rotors, WORKING_SIZE)
        Of `sbs_sim.model.working_state`.
    """
    found = []
    for j, (rotor, row) in enumerate(zip(aircraft.rotors, rows, strict=True)):
        found += blade_warnings(rotor)
        state = working_state(row)
        if rotor.descent == "measured":
            if state.inflow_state == VORTEX_RING and rotor.ring_unsteadiness == 0.0:
                found.append(f"{rotor.name}: {VORTEX_RING} state, whose unsteadiness is missing")
        elif state.inflow_state in (VORTEX_RING, TURBULENT_WAKE):
            found.append(f"{rotor.name}: {state.inflow_state} state, where momentum theory does not hold")
        if state.advance_ratio > MAX_ADVANCE_RATIO:
            found.append(f"{rotor.name}: advance ratio above {MAX_ADVANCE_RATIO:g}")
        if state.stalled_share > MAX_STALLED:
            missing = "what a vortex does of its dynamics" if rotor.has_late_separation else "its dynamics"
            missing = "the pitching moment of its dynamics" if rotor.has_stall_vortex else missing
            found.append(f"{rotor.name}: {STALL} {MAX_STALLED:.0%} of the disc, without {missing}")
        if (least := LEAST_HEIGHTS.get(aircraft.ground.effect)) and float(row[W.HEIGHT]) < least:
            found.append(f"{rotor.name}: below {least:g} radii above the ground, where the ground effect is not known")
        if float(row[W.BEHIND]) > MAX_BEHIND:
            found.append(f"{rotor.name}: in the wake of a rotor ahead where that rolls up, without its roll-up")
        if aircraft.options.meets_wakes and _has_no_wake(row):
            found.append(
                f"{rotor.name}: hardly any flow through the disc, whose wake for other rotors has no direction"
            )
        if state.reversed_share > MAX_REVERSED:
            found.append(f"{rotor.name}: reverse flow on more than {MAX_REVERSED:.0%} of the disc")
        if aircraft.number_axis(j) != "mach" and tip_mach(aircraft, rotor, row) > MAX_TIP_MACH:
            found.append(f"{rotor.name}: tip Mach number above {MAX_TIP_MACH:g}, {INCOMPRESSIBLE}")
        if state.outside_share > MAX_OUTSIDE:
            known = f"{NUMBER_NAMES[aircraft.number_axis(j)]} outside {_known_numbers(aircraft, j)},"
            found.append(f"{rotor.name}: {known} on more than {MAX_OUTSIDE:.0%} of the disc")
    return found


def _has_no_wake(row: Array | Sequence[float]) -> bool:
    """True for a loaded rotor through whose disc, and along it, hardly any air flows."""
    hover = float(row[W.HOVER_INFLOW])
    flow, along = abs(float(row[W.FLOW])), float(row[W.ADVANCE_RATIO])
    return hover >= MIN_INFLOW and max(flow, along) < TURNING * hover


def blade_warnings(rotor: Rotor) -> list[str]:
    """Offsets of blades that would bend them (theory.md section 3.6), chords too long for their unsteady airfoils."""
    found = []
    if rotor.has_wake_states and _reduced_frequency(rotor) > MAX_REDUCED_FREQUENCY:
        found.append(f"{rotor.name}: reduced frequency above {MAX_REDUCED_FREQUENCY:g}, without apparent mass")
    if not rotor.has_offsets:
        return found
    share = np.linspace(rotor.root_cutout / rotor.blade_length, 1.0, OFFSET_POINTS)
    chord, quarter, centre = rotor.chord_at(share), rotor.quarter_at(share), rotor.centre_at(share)
    if float((np.maximum(np.abs(quarter), np.abs(centre)) / chord).max()) > MAX_OFFSET:
        found.append(f"{rotor.name}: sections more than {MAX_OFFSET:g} chords off the pitch axis, without torsion")
    if float(np.mean(share * (quarter - centre) / chord) / np.mean(share)) > MAX_TAIL_HEAVY:
        found.append(f"{rotor.name}: blades heavy behind the quarter chord, without flutter of elastic pitch")
    return found


def _reduced_frequency(rotor: Rotor) -> float:
    """Of one per revolution, at the section whose circulation is a state."""
    radius = STATION * rotor.radius
    return float(rotor.chord_at((radius - rotor.hinge_offset) / rotor.blade_length)) / (2.0 * radius)


def slow_rotors(aircraft: Aircraft, speeds: Array) -> list[tuple[Rotor, float]]:
    """Rotors that hardly turn, so that centrifugal force does not hold their blades, with their speeds [rad/s].

    Parameters
    ----------
    aircraft : Aircraft
    speeds : ndarray, shape (n_rotors,)
        [rad/s]
    """
    pairs = zip(aircraft.rotors, speeds.tolist(), strict=True)
    return [(rotor, speed) for rotor, speed in pairs if abs(speed) < MIN_SPEED * rotor.speed]


def _known_numbers(aircraft: Aircraft, rotor: int) -> str:
    """Reynolds or Mach numbers of the airfoil tables of a rotor in words."""
    ranges = dict.fromkeys(table.range for table in aircraft.sections[rotor] if len(table.numbers) > 1)
    if len(ranges) != 1:
        return "those of the airfoil tables"
    ((low, high),) = ranges
    return f"{low:g} to {high:g}, those of the airfoil table"


def flight_warnings(aircraft: Aircraft, working: Array) -> Iterator[str]:
    """What is outside the validity of the model at some instants, each line once, in the order in which they begin.

    Parameters
    ----------
    aircraft : Aircraft
    working : ndarray, shape (n, n_rotors, WORKING_SIZE)
    """
    exceeding = working[~_is_quiet(aircraft, working)] if len(working) else working
    return iter(dict.fromkeys(line for rows in exceeding for line in warnings(aircraft, rows)))


def _is_quiet(aircraft: Aircraft, working: Array) -> NDArray[np.bool_]:
    """Instants of which `warnings` surely says nothing, shape (n,); most are, and words take long."""
    sound = aircraft.environment.speed_of_sound
    tips = np.array([rotor.speed * rotor.radius for rotor in aircraft.rotors])
    limits = np.array(
        [math.inf if aircraft.number_axis(j) == "mach" else MAX_TIP_MACH for j in range(len(aircraft.rotors))]
    )
    quiet = (
        (working[..., W.ADVANCE_RATIO] <= MAX_ADVANCE_RATIO)
        & (working[..., W.STALLED] <= MAX_STALLED)
        & (working[..., W.REVERSED] <= MAX_REVERSED)
        & (working[..., W.OUTSIDE] <= MAX_OUTSIDE)
        & (working[..., W.HEIGHT] >= LEAST_HEIGHTS.get(aircraft.ground.effect, -math.inf))
        & (working[..., W.BEHIND] <= MAX_BEHIND)
        & (tips * (1.0 + working[..., W.ADVANCE_RATIO]) / sound <= limits)
        # no vortex ring before its slowest descent, and nothing beyond it
        & (working[..., W.DESCENT] < RING_DESCENT[0] * (1.0 - MARGIN) * working[..., W.HOVER_INFLOW])
    )
    return np.asarray(quiet.all(axis=1) & (not any(blade_warnings(rotor) for rotor in aircraft.rotors)))
