"""Trim: the steady flight in which the averaged derivative vanishes (theory.md section 8).

Newton's method solves all equations together, from hover or along a path of conditions from hover. The paper's two
nested loops are there to compare with.
"""

import numpy as np
from numpy.typing import NDArray

from sbs_sim import checks
from sbs_sim.aircraft import Aircraft
from sbs_sim.analysis.newton import newton
from sbs_sim.analysis.trim_problem import TrimCondition, TrimPoint, TrimProblem
from sbs_sim.analysis.two_loop import solve_by_two_loops
from sbs_sim.errors import TrimError

Array = NDArray[np.float64]

METHODS = ("newton", "two_loop")
LARGEST_AZIMUTH_COUNT = 1000
IDLE_LOADINGS = (0.01, 0.1, 1.0)  # disc loadings to try on rotors that do not lift, as shares of that of those that do
SMALLEST_PATH_STEP = 1.0 / 64.0


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
) -> TrimPoint:
    """Trim an aircraft.

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

    Returns
    -------
    TrimPoint

    Raises
    ------
    TrimError
        A value out of range, or no solution: message and attributes hold the last residual and its worst equation.
    """
    checks.instance("aircraft", aircraft, Aircraft, TrimError)
    condition = TrimCondition(airspeed, climb_rate, sideslip, turn_rate)
    lead_lag = checks.flag("lead_lag", lead_lag, TrimError)
    cyclic_inflow = checks.flag("cyclic_inflow", cyclic_inflow, TrimError)
    azimuth_count = checks.whole("azimuth_count", azimuth_count, 1, LARGEST_AZIMUTH_COUNT, TrimError)
    checks.choice("method", method, METHODS, TrimError)
    problem = TrimProblem(aircraft, lead_lag, cyclic_inflow, azimuth_count)
    if method == "two_loop":
        unknowns, outer, inner = solve_by_two_loops(problem, condition, problem.first_guess(IDLE_LOADINGS[0]))
        return problem.point(condition, unknowns, method, outer, inner)
    unknowns, iterations = _follow_path(problem, condition)
    return problem.point(condition, unknowns, method, iterations)


def _follow_path(problem: TrimProblem, condition: TrimCondition) -> tuple[Array, int]:
    """Solve directly from hover, else along conditions between hover and the one wanted.

    A direct solution beyond the limits of the controls may lie on another branch (a stalled rotor can carry the
    aircraft too), so it counts only where the path, which keeps to the branch of hover, ends.
    """
    hover, iterations = _hover(problem, condition.scaled(0.0))
    direct = None
    try:
        direct, more = _newton(problem, condition, hover)
        iterations += more
        if not problem.beyond_limits(direct):
            return direct, iterations
    except TrimError:
        pass
    try:
        solution, more = _walk(problem, condition, hover)
    except TrimError:
        if direct is None:
            raise
        return direct, iterations
    return solution, iterations + more


def _hover(problem: TrimProblem, condition: TrimCondition) -> tuple[Array, int]:
    """Solve hover from several guesses until one leads to a flight within the limits; else the first that was found."""
    found: list[tuple[Array, int]] = []
    failure: TrimError | None = None
    for idle in IDLE_LOADINGS:
        try:
            found.append(_newton(problem, condition, problem.first_guess(idle)))
        except TrimError as error:
            failure = failure or error
            continue
        if not problem.beyond_limits(found[-1][0]):
            return found[-1]
    if found:
        return found[0]
    raise failure or TrimError("no guess for hover")


def _walk(problem: TrimProblem, condition: TrimCondition, hover: Array) -> tuple[Array, int]:
    """Solve conditions between hover and the one wanted, each from the line through the two before."""
    done, last, step = 0.0, 0.0, 0.25
    before = solution = hover
    iterations = 0
    while done < 1.0:
        share = min(1.0, done + step)
        guess = solution if done == last else solution + (solution - before) * (share - done) / (done - last)
        try:
            found, more = _newton(problem, condition.scaled(share), guess)
        except TrimError as error:
            step /= 2
            if step < SMALLEST_PATH_STEP:
                reached = condition.scaled(done)
                raise TrimError(
                    f"{error}; the path from hover ends at airspeed {reached.airspeed:.3g} m/s,"
                    f" climb_rate {reached.climb_rate:.3g} m/s, turn_rate {reached.turn_rate:.3g} rad/s",
                    residual=error.residual,
                    worst_equation=error.worst_equation,
                ) from None
            continue
        before, solution, last, done = solution, found, done, share
        iterations += more
        step *= 1.5
    return solution, iterations


def _newton(problem: TrimProblem, condition: TrimCondition, start: Array) -> tuple[Array, int]:
    """Solve one condition from a guess; TrimError if that fails."""
    solution = newton(
        lambda unknowns: problem.residual(condition, unknowns),
        start,
        lambda unknowns: problem.jacobian(condition, unknowns),
    )
    if solution.converged:
        return solution.values, solution.iterations
    size, worst = float(np.abs(solution.residual).max()), problem.worst_equation(solution.residual)
    raise TrimError(
        f"no trim after {solution.iterations} Newton iterations: residual {size:.3g} in {worst}",
        residual=size,
        worst_equation=worst,
    )
