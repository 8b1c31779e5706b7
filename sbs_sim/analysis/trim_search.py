"""Search for a trim, and the reason where there is none (theory.md section 8.2)."""

import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sbs_sim.aircraft import Aircraft
from sbs_sim.aircraft.model_records import MIN_DENSITY, drive_of, gear
from sbs_sim.analysis.newton import newton
from sbs_sim.analysis.trim_guess import MomentumTheory
from sbs_sim.analysis.trim_problem import ATTITUDE_UNKNOWNS, BODY_UNKNOWNS, TrimProblem, largest_torque
from sbs_sim.errors import TrimError
from sbs_sim.flight.trim_point import TrimCondition
from sbs_sim.flight.two_blades import substitute
from sbs_sim.model import records as R

Array = NDArray[np.float64]
Along = Callable[[float], tuple[TrimProblem, TrimCondition]]

FIRST_STEP, SMALLEST_STEP, GROWTH = 0.25, 1.0 / 64.0, 1.5  # of a path, as shares of it
LIGHT = (0.3, 0.1, 0.03)  # of weight and drag: where paths on which they grow begin
FIRST_LOAD, SMALLEST_LOAD = 0.1, 0.005  # steps of theirs
NEARLY = 0.9  # of weight and drag: with less at the end of such a path there is no trim close by
OTHER_SPEEDS = (0.8, 1.3)  # of the one wanted
MIN_POWER_SPEED = 2.5  # hover inflow velocities: about the speed for the least power
MORE_COLLECTIVE = tuple(math.radians(angle) for angle in (1.0, 2.0, 3.0, 4.0, 6.0, 8.0))
STALLED = math.radians(5.0)  # pitch beyond what the thrust would need without stall: of a rotor on a stalled branch
STALLS = math.radians(0.6)  # of one that carries about as much as it can
MAX_LIFT_COEFFICIENT = 1.0  # mean lift coefficient, about what rotors have at most
NO_AUTHORITY = 1e-4  # of the strongest effect of the controls on lift and moments
MOSTLY = 0.9  # share of one balance in what the controls do not change
BALANCES = ("lift", "rolling moment", "pitching moment", "yawing moment")


class _End(NamedTuple):
    """Where a path has ended: share of the way, unknowns there, what failed beyond."""

    share: float
    unknowns: Array
    error: TrimError


class _Hover(NamedTuple):
    """Unknowns of a hover or None, mean loads of the last residual, Newton iterations, and what has failed."""

    unknowns: Array | None
    loads: Array
    iterations: int
    error: TrimError | None


def find(problem: TrimProblem, condition: TrimCondition, guess: Array | None = None) -> tuple[Array, int]:
    """Find a trim: from a guess, from hover, by momentum theory, from a lighter aircraft, from other speeds.

    Of several the first is taken that needs no control beyond its range and on which no rotor is stalled. What lies at
    the end of a path may need more than a control has: it is the branch of ordinary flight.

    Parameters
    ----------
    problem : TrimProblem
    condition : TrimCondition
    guess : ndarray, shape (n,), optional
        Unknowns from which a trim is taken as it is.

    Returns
    -------
    unknowns : ndarray, shape (n,)
    iterations : int
        Of Newton's method, those that led nowhere included.

    Raises
    ------
    TrimError
        No trim; the message says what stops it.
    """
    search = _Search(problem, condition)
    return search.run(guess), search.iterations


class _Search:
    """The search for one trim: what was tried, and where it has ended."""

    def __init__(self, problem: TrimProblem, condition: TrimCondition, theory: MomentumTheory | None = None) -> None:
        self.iterations = 0
        self._problem, self._condition = problem, condition
        self._theory = theory or MomentumTheory(problem)
        self._is_hover = not condition.is_motion
        self._hover: Array | None = None
        self._error: TrimError | None = None
        self._path: _End | None = None
        self._load: _End | None = None

    def run(self, guess: Array | None) -> Array:
        """The trim; TrimError if there is none."""
        found = None if guess is None else self._newton(self._problem, self._condition, guess)
        if found is not None:
            return found
        best: tuple[tuple[bool, bool], Array] | None = None
        for attempt, follows in (
            (self._from_hover, False),
            (self._along_path, True),
            (self._from_momentum, False),
            (self._from_lighter, True),
            (self._from_other_speed, True),
            (self._beyond_ends, True),
        ):
            found = attempt()
            if found is None:
                continue
            stalled, beyond = self._is_stalled(found), bool(self._problem.beyond_limits(found))
            if not stalled and (follows or not beyond):
                return found
            if best is None or (stalled, beyond) < best[0]:
                best = (stalled, beyond), found
        if best is None:
            raise self._failure()
        return best[1]

    def _newton(self, problem: TrimProblem, condition: TrimCondition, start: Array) -> Array | None:
        """Solution from a guess; None, and the error kept, if there is none."""
        try:
            return self._solve(problem, condition, start)
        except TrimError as error:
            self._error = self._error or error
            return None

    def _solve(self, problem: TrimProblem, condition: TrimCondition, start: Array) -> Array:
        solution = newton(
            lambda unknowns: problem.residual(condition, unknowns),
            start,
            lambda unknowns: problem.jacobian(condition, unknowns),
        )
        self.iterations += solution.iterations
        if not solution.converged:
            raise _left(problem, solution.residual)
        return solution.values

    def _from_hover(self) -> Array | None:
        """Hover by momentum theory, and from it the flight at once."""
        known, problem, hover = self._problem.aircraft.kept, self._problem, self._condition.scaled(0.0)
        # by its text, in which zeros have signs: no bit depends on what was looked for before
        key = problem.fidelity, repr(hover)
        if key not in known:
            known[key] = self._hovering(hover)
        self._hover, problem.loads, iterations, error = known[key]
        self.iterations += iterations
        self._error = self._error or error
        if self._hover is None or self._is_hover:
            return self._hover
        return self._newton(problem, self._condition, self._hover)

    def _hovering(self, hover: TrimCondition) -> _Hover:
        search = _Search(self._problem, hover, self._theory)
        found = search._newton(self._problem, hover, self._theory.guess(hover))
        return _Hover(found, self._problem.loads, search.iterations, search._error)

    def _along_path(self) -> Array | None:
        """Flights between hover and the one wanted: that stays on the branch of hover."""
        if self._hover is None or self._is_hover:
            return None
        found = self._walk(lambda share: (self._problem, self._condition.scaled(share)), 0.0, self._hover)
        self._path = found if isinstance(found, _End) else None
        return None if isinstance(found, _End) else found

    def _from_momentum(self) -> Array | None:
        """The flight by momentum theory, for what does not hover."""
        if self._is_hover:
            return None
        return self._newton(self._problem, self._condition, self._theory.guess(self._condition))

    def _from_lighter(self) -> Array | None:
        """The same flight with growing weight and drag, in turns at the same bank."""
        for share in LIGHT:
            lighter, flight = self._loaded(share)
            start = self._newton(lighter, flight, self._theory.guess(flight, share))
            if start is None:
                continue
            found = self._walk(self._loaded, share, start, FIRST_LOAD, SMALLEST_LOAD)
            self._load = found if isinstance(found, _End) else None
            return None if isinstance(found, _End) else found
        return None

    def _from_other_speed(self) -> Array | None:
        """Slower and faster flights by momentum theory, and from them to the one wanted."""
        if self._load and self._load.share < NEARLY:
            return None
        for start in self._other_speeds():
            other = self._newton(self._problem, start, self._theory.guess(start))
            if other is None:
                continue
            along = partial(self._between, start)
            found = self._walk(along, 0.0, other, FIRST_LOAD, SMALLEST_LOAD)
            if not isinstance(found, _End):
                return found
        return None

    def _beyond_ends(self) -> Array | None:
        """From the ends of the paths with more lift: where sections stall one after the other, it has notches."""
        lift = self._theory.lift(self._condition)
        for end in filter(None, (self._load, self._path)):
            for angle in MORE_COLLECTIVE:
                start = end.unknowns.copy()
                start[ATTITUDE_UNKNOWNS:BODY_UNKNOWNS] += angle * lift
                found = self._newton(self._problem, self._condition, start)
                if found is not None and not self._is_stalled(found):
                    return found
        return None

    def _other_speeds(self) -> list[TrimCondition]:
        """Flights at shares of the speed, and level flight with little power for one that is slow."""
        flight, level = self._condition, MIN_POWER_SPEED * self._theory.hover_inflow
        speeds = [flight.scaled(share) for share in OTHER_SPEEDS] if flight.is_motion else []
        if abs(flight.airspeed) < 0.5 * level:
            speeds.append(TrimCondition(math.copysign(level, flight.airspeed), 0.0, flight.sideslip, 0.0))
        return speeds

    def _between(self, start: TrimCondition, share: float) -> tuple[TrimProblem, TrimCondition]:
        return self._problem, start.toward(self._condition, share)

    def _loaded(self, share: float) -> tuple[TrimProblem, TrimCondition]:
        """The aircraft with a share of its weight and drag, and the flight in which that means the same attitude."""
        turn_rate = share * self._condition.turn_rate
        return self._problem.lighter(share), replace(self._condition, turn_rate=turn_rate)

    def _walk(
        self, along: Along, done: float, start: Array, step: float = FIRST_STEP, smallest: float = SMALLEST_STEP
    ) -> "Array | _End":
        """Solve what lies between a share and 1, each from the line through the two before."""
        last, before, solution = done, start, start
        while done < 1.0:
            share = min(1.0, done + step)
            guess = solution if done == last else solution + (solution - before) * (share - done) / (done - last)
            try:
                found = self._solve(*along(share), guess)
            except TrimError as error:
                step /= 2
                if step < smallest:
                    return _End(done, solution, error)
                continue
            before, solution, last, done = solution, found, done, share
            step *= GROWTH
        return solution

    def _is_stalled(self, unknowns: Array) -> bool:
        return bool(np.abs(self._theory.stall(self._condition, unknowns)).max() > STALLED)

    # --- the reason where there is none ----------------------------------------------------------------------------

    def _failure(self) -> TrimError:
        """What stops the trim, in one line: what is missing, how far the paths lead, what is left."""
        error, reasons = self._error, [*self._missing(), *self._weak_drives()]
        if self._path:
            error, at = self._path.error, self._condition.scaled(self._path.share)
            text = (
                f"the path from hover ends at airspeed {at.airspeed:.3g} m/s, climb_rate {at.climb_rate:.3g} m/s,"
                f" turn_rate {at.turn_rate:.3g} rad/s"
            )
            reasons.append(text + self._strain(at, self._path.unknowns))
        if self._load:
            error = _left(self._problem, self._problem.residual(self._condition, self._load.unknowns))
            what = "the weight" if self._is_hover else "weight and drag in this flight"
            text = f"the rotors cannot carry more than {100 * self._load.share:.3g} % of {what}"
            reasons.append(text + self._strain(self._condition, self._load.unknowns))
        text = "; ".join([*(reasons or self._by_momentum()), str(error)])
        assert error is not None
        return TrimError(f"no trim: {text}", residual=error.residual, worst_equation=error.worst_equation)

    def _by_momentum(self) -> list[str]:
        """What the flight takes by momentum theory that no rotor and no control has."""
        thrusts = [rotor.thrust for rotor in self._theory.balance(self._condition).rotors]
        pairs = zip(self._problem.aircraft.rotors, self._theory.rotors, thrusts, strict=True)
        lifts = {rotor.name: theory.mean_lift(thrust) for rotor, theory, thrust in pairs}
        takes = [
            f"a mean lift coefficient of {abs(lift):.2g} of {name}"
            for name, lift in lifts.items()
            if abs(lift) > MAX_LIFT_COEFFICIENT
        ]
        takes = takes or list(self._problem.beyond_limits(self._theory.guess(self._condition)))
        return [f"by momentum theory it takes {' and '.join(takes)}"] if takes else []

    def _missing(self) -> list[str]:
        """What the aircraft has not got: air, or controls that set lift and moments apart from each other."""
        if self._problem.aircraft.environment.air_density < MIN_DENSITY:
            return ["there is no air to carry the weight"]
        effects, sizes, _ = np.linalg.svd(self._theory.balance(self._condition).authority)
        if sizes[-1] > NO_AUTHORITY * sizes[0]:
            return []
        aircraft, weakest = self._problem.aircraft, np.abs(effects[:, -1])
        if len(aircraft.rotors) == 1 and not aircraft.drives and not aircraft.commanded_surfaces:
            return ["a rotor alone has nothing against its torque, so it does not fly: body.stand holds its hub"]
        if weakest.max() < MOSTLY:
            return ["the controls do not set lift, rolling, pitching and yawing moment apart from each other"]
        return [f"no control sets the {BALANCES[int(np.argmax(weakest))]}"]

    def _weak_drives(self) -> list[str]:
        """Drives that do not give the torque that the flight takes with the speeds of the file."""
        aircraft = self._problem.aircraft
        if not aircraft.drives:
            return []
        fixed = substitute(Aircraft.from_dict({**aircraft.data, "drives": []}, aircraft.folder))
        kept = TrimProblem(fixed, self._problem.fidelity)
        try:
            unknowns, _ = find(kept, self._condition)
        except TrimError:
            return []  # it is not the drives
        kept.residual(self._condition, unknowns)
        torques = kept.loads[:, R.TORQUE].tolist()
        found = []
        for i, drive in enumerate(aircraft.drives):
            pairs = zip(aircraft.rotors, torques, strict=True)
            taken = sum(gear(aircraft, rotor) * torque for rotor, torque in pairs if drive_of(aircraft, rotor) == i)
            most = largest_torque(drive, aircraft.drive_speed(i))
            if taken > most:
                rotors = f"its rotors take {taken:.3g} N m at the speed of the file"
                found.append(f"drive {i + 1} gives up to {most:.3g} N m, {rotors}")
        return found

    def _strain(self, condition: TrimCondition, unknowns: Array) -> str:
        """What is at its limit there: rotors that stall, and controls beyond their ranges."""
        self._problem.residual(condition, unknowns)
        excess = np.abs(self._theory.stall(condition, unknowns))
        names = [
            rotor.name for rotor, angle in zip(self._problem.aircraft.rotors, excess, strict=True) if angle > STALLS
        ]
        text = f", where {' and '.join(names)} {'stalls' if len(names) == 1 else 'stall'}" if names else ""
        beyond = self._problem.beyond_limits(unknowns)
        controls = [entry for entry in beyond if entry.startswith(self._problem.aircraft.control_names)]
        return text + "".join(f", with {entry}" for entry in controls or beyond)


def _left(problem: TrimProblem, residual: Array) -> TrimError:
    """The largest residual, and what is not in balance."""
    size, worst = float(np.abs(residual).max()), problem.worst_equation(residual)
    text = f"the {problem.balance(residual)} is not balanced, residual {size:.3g} in {worst}"
    return TrimError(text, residual=size, worst_equation=worst)
