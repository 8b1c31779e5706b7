"""Trim: the steady flight in which the averaged derivative vanishes (theory.md section 8).

Newton's method solves all equations together; `sbs_sim.analysis.trim_search` has where it begins. The paper's two
nested loops are there to compare with.
"""

from __future__ import annotations  # `help` then shows types by their names

from dataclasses import replace
from typing import cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sbs_sim import checks
from sbs_sim.aircraft import Aircraft
from sbs_sim.aircraft.model_records import ground_record
from sbs_sim.analysis.newton import MAX_UNKNOWN
from sbs_sim.analysis.periodic import common_period, periodic, periodic_rest
from sbs_sim.analysis.stand import rest
from sbs_sim.analysis.trim_guess import MomentumTheory
from sbs_sim.analysis.trim_problem import UNEQUAL_BLADES, TrimProblem
from sbs_sim.analysis.trim_search import find
from sbs_sim.analysis.two_loop import solve_by_two_loops
from sbs_sim.errors import LinearizationError, TrimError
from sbs_sim.flight.trim_point import Fidelity, StandPoint, TrimCondition, TrimPoint
from sbs_sim.flight.two_blades import (
    has_two_blades,
    of_substitute,
    substitute,
    trim_of_substitute,
    with_two_blades,
)
from sbs_sim.model import state as S
from sbs_sim.model.state import StateLayout

Array = NDArray[np.float64]
Guess = TrimPoint | ArrayLike | tuple[ArrayLike, ArrayLike]

METHODS = ("newton", "two_loop")
TWO_BLADES = "two blades"  # with which a warning begins
MEAN_ONLY = "this is the mean flight of three lighter blades in place of two, and there is no linear model"


def trim(
    aircraft: Aircraft,
    airspeed: float = 0.0,
    climb_rate: float = 0.0,
    sideslip: float = 0.0,
    turn_rate: float = 0.0,
    *,
    lead_lag: bool = True,
    cyclic_inflow: bool = True,
    azimuth_count: int = 12,
    method: str = "newton",
    guess: Guess | None = None,
) -> TrimPoint:
    """Trim an aircraft.

    On a stand this is its deflection and the steady motion of the rotors with the controls at what the file holds them
    at (`controls.NAME.held_deg`), else nearest to 0 in their range; a condition is a steady motion of the whole stand
    along locked axes.

    Of several trims the ordinary one is found: within the ranges of the controls if there is such a one, without
    stalled rotors, on the branch of hover. A guess finds others.

    Parameters
    ----------
    aircraft : Aircraft
    airspeed, climb_rate, sideslip, turn_rate : float
        See `TrimCondition` [m/s, m/s, rad, rad/s].
    lead_lag, cyclic_inflow : bool
        Fidelity of the model.
    azimuth_count : int
        N_c, number of azimuths of the averages, 1 to 1000.
    method : str
        "newton", or "two_loop": the paper's nested loops (section 2.2), which find hover, vertical flight, and of
        `sbs` straight flight up to 1.5 m/s, or without cyclic inflow 15 m/s; elsewhere they fail.
    guess : TrimPoint, array_like or tuple, optional
        Where to begin: a trim of an aircraft with as many rotors and blades; the four controls that trims find [rad, or
        their units]; or a tuple of these and a linear state as in `TrimPoint.state`, of which attitude, flap, lag and
        inflow count. The trim to
        which it leads is taken as it is; if it leads to none, the search goes on as without a guess.

    Returns
    -------
    TrimPoint
        Of an aircraft on a stand a `StandPoint`.

    Raises
    ------
    TrimError
        A value out of range, or no solution: the message says what stops it (rotors that cannot carry the weight, a
        rotor that stalls, a control beyond its range), and with the attributes which equation is left with what.
    """
    checks.instance("aircraft", aircraft, Aircraft, TrimError)
    condition = TrimCondition(airspeed, climb_rate, sideslip, turn_rate)
    fidelity = Fidelity(lead_lag, cyclic_inflow, azimuth_count)
    return solve_trim(aircraft, condition, fidelity, method=method, guess=guess)


def check_height(aircraft: Aircraft) -> None:
    """Raise TrimError for an aircraft that would reach into the ground: trims are at the origin."""
    if aircraft.ground.altitude is None:
        return
    points = [rotor.hub for rotor in aircraft.rotors]
    points += [point.position for point in aircraft.contact_points if aircraft.has_contact]
    down = ground_record(aircraft, 0.0)["down"][0, :, 0]
    lowest = max(0.0, *(float(down @ point) for point in points)) / float(down[2])
    if -aircraft.ground.altitude <= lowest:
        raise TrimError(
            f"ground.altitude = {aircraft.ground.altitude:g}: allowed for trims, whose aircraft is at the origin, is"
            f" below {-lowest:g}"
        )


def solve_trim(
    aircraft: Aircraft,
    condition: TrimCondition,
    fidelity: Fidelity,
    *,
    method: str = "newton",
    guess: Guess | None = None,
) -> TrimPoint:
    """Trim an aircraft in a flight condition; see `trim`."""
    checks.instance("aircraft", aircraft, Aircraft, TrimError)
    checks.choice("method", method, METHODS, TrimError)
    if method == "two_loop" and (aircraft.drives or aircraft.body.is_stand):
        raise TrimError(f"method = 'two_loop': allowed {'with drives' if aircraft.drives else 'on a stand'} is newton")
    if aircraft.body.is_stand:
        return _rest(aircraft, condition, fidelity, _rest_guess(guess))
    check_height(aircraft)
    problem = TrimProblem(substitute(aircraft), fidelity)
    start = (
        None if guess is None else _start(problem, condition, _of_substitute(aircraft, checked_guess(aircraft, guess)))
    )
    if method == "two_loop":
        start = MomentumTheory(problem).guess(condition) if start is None else start
        unknowns, outer, inner = solve_by_two_loops(problem, condition, start)
        return _own(aircraft, problem.point(condition, unknowns, method, outer, inner))
    unknowns, iterations = find(problem, condition, start)
    return _own(aircraft, problem.point(condition, unknowns, method, iterations))


def _rest(aircraft: Aircraft, condition: TrimCondition, fidelity: Fidelity, guess: StandPoint | None) -> StandPoint:
    """Rest on a stand; with two blades the periodic motion near that of the substitute."""
    if not has_two_blades(aircraft):
        return rest(aircraft, condition, fidelity, guess)
    if guess is not None:
        guess = cast(StandPoint, trim_of_substitute(aircraft, guess))
    return cast(StandPoint, _own(aircraft, rest(substitute(aircraft), condition, fidelity, guess)))


def _own(aircraft: Aircraft, point: TrimPoint) -> TrimPoint:
    """Trim of an aircraft, of that of its substitute; with two blades the periodic motion near it, if there is one."""
    if not has_two_blades(aircraft):
        return point
    warned = [
        f"{rotor.name}: {UNEQUAL_BLADES}"
        for rotor in aircraft.rotors
        if rotor.blades == 2 and not rotor.has_equal_blades
    ]
    point = with_two_blades(aircraft, point)
    try:
        common_period(aircraft)
    except LinearizationError as error:
        return replace(point, warnings=(*point.warnings, *warned, f"{TWO_BLADES}: {error}; {MEAN_ONLY}"))
    point = replace(point, warnings=(*point.warnings, *warned))
    return periodic_rest(aircraft, point) if isinstance(point, StandPoint) else periodic(aircraft, point)


def _of_substitute(
    aircraft: Aircraft, guess: TrimPoint | tuple[Array, Array | None]
) -> TrimPoint | tuple[Array, Array | None]:
    """Checked guess for the substitute of an aircraft."""
    if isinstance(guess, TrimPoint):
        return trim_of_substitute(aircraft, guess) if has_two_blades(aircraft) else guess
    controls, state = guess
    if state is None or not has_two_blades(aircraft):
        return guess
    speeds = aircraft.rotor_speeds(aircraft.layout.from_linear(state))
    return controls, of_substitute(aircraft, state, speeds)


def _rest_guess(guess: Guess | None) -> StandPoint | None:
    """A rest to begin with; its controls do not count."""
    if guess is not None and not isinstance(guess, StandPoint):
        raise TrimError("guess: allowed on a stand is a trim on it")
    return guess


def checked_guess(aircraft: Aircraft, guess: Guess) -> TrimPoint | tuple[Array, Array | None]:
    """A trim, or the unknown controls of a trim, shape (4,), and a linear state, shape (n,), or None.

    Raises
    ------
    TrimError
        A guess that is none, has another shape or a value out of range.
    """
    layout = aircraft.layout
    if isinstance(guess, TrimPoint):
        if guess.state_names != layout.linear_names:
            raise TrimError("guess: allowed is a trim of an aircraft with as many rotors and blades")
        if guess.control_names != aircraft.control_names:
            raise TrimError(f"guess: allowed is a trim with the controls {', '.join(aircraft.control_names)}")
        return guess
    if isinstance(guess, tuple) and len(guess) == 2:
        controls, state = guess
        return (
            _controls("guess[0]", controls, aircraft),
            _angles("guess[1]", state, layout.linear_names, _guessed(layout)),
        )
    return _controls("guess", guess, aircraft), None


def _controls(what: str, values: ArrayLike, aircraft: Aircraft) -> Array:
    """Unknowns of the controls that a trim finds."""
    names = tuple(aircraft.controls[i].name for i in aircraft.trimmed_controls)
    found = _named(what, values, names)
    for i, value in zip(aircraft.trimmed_controls, found.tolist(), strict=True):
        control = aircraft.controls[i]
        checks.number(f"{what}: {control.name}", value, -control.limit, control.limit, control.unit, TrimError)
    return np.asarray(found / aircraft.trim_scales)


def _guessed(layout: StateLayout) -> tuple[str, ...]:
    """Names of the linear state that a guess tells."""
    names = layout.linear_names
    parts = {name: S.part_of(name) for name in names[S.LINEAR_BODY_SIZE :]}
    rotors = [name for name, part in parts.items() if not part.is_rate and part.family != "drive"]
    return (names[S.LINEAR_THETA], names[S.LINEAR_PHI], *rotors)


def _angles(what: str, values: ArrayLike, names: tuple[str, ...], checked: tuple[str, ...]) -> Array:
    """Values by names, of which some are checked."""
    found = _named(what, values, names)
    for name, value in zip(names, found.tolist(), strict=True):
        if name in checked:
            checks.number(f"{what}: {name}", value, -MAX_UNKNOWN, MAX_UNKNOWN, "rad", TrimError)
    return found


def _named(what: str, values: ArrayLike, names: tuple[str, ...]) -> Array:
    """As many values as there are names."""
    found = checks.array(what, values, TrimError)
    if found.shape != (len(names),):
        raise TrimError(f"{what} has the shape {found.shape}: allowed are {len(names)} numbers, {names[0]} the first")
    return found


def _start(problem: TrimProblem, condition: TrimCondition, guess: TrimPoint | tuple[Array, Array | None]) -> Array:
    """Unknowns of a checked guess."""
    if isinstance(guess, TrimPoint):
        controls, state = problem.aircraft.trim_unknowns(guess.controls), guess.state
    else:
        controls, given = guess
        if given is None:
            return MomentumTheory(problem).guess(condition, controls=controls)
        state = given
    x = problem.layout.from_linear(state)
    return problem.unknowns(float(state[S.LINEAR_THETA]), float(state[S.LINEAR_PHI]), controls, x)
