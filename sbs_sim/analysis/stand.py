"""Rest of an aircraft on a stand under given controls, and its linear model about it (theory.md section 8.5)."""

from dataclasses import fields

import numpy as np
from numpy.typing import NDArray

from sbs_sim.aircraft import Aircraft
from sbs_sim.aircraft.description import STAND_AXES
from sbs_sim.analysis.newton import newton
from sbs_sim.analysis.trim_guess import MomentumTheory
from sbs_sim.analysis.trim_problem import BODY_UNKNOWNS, TrimProblem
from sbs_sim.errors import TrimError
from sbs_sim.flight.trim_point import Fidelity, StandPoint, TrimCondition, TrimPoint
from sbs_sim.model import state as S
from sbs_sim.model.frames import quaternion_to_euler

Array = NDArray[np.float64]

INFLOWS = (0.02, 0.05, -0.02, 0.1, -0.05)  # of the tip speed: where the search begins after momentum theory
BALANCED = 1e-8  # scaled acceleration that is left along an axis without a spring
MOTIONS = ("airspeed", "climb_rate", "turn_rate")


class StandProblem(TrimProblem):
    """The equations of rest on a stand.

    Unknowns, shape (n,): along and about x, y, z the deflections of the stand [radii of the first rotor; rotation
    vector in rad], 0 along axes that are locked or have no spring; then those of rotors and drives as in `TrimProblem`.
    Equations are those of `TrimProblem`; an axis without spring has the equation that its deflection is 0.
    """

    def __init__(self, aircraft: Aircraft, fidelity: Fidelity, condition: TrimCondition) -> None:
        super().__init__(aircraft, fidelity)
        self._sprung = (aircraft.body.stand_free > 0.0) & (aircraft.body.stand_spring > 0.0)
        self._velocity = _hub_velocity(aircraft, condition)
        self._controls = aircraft.resting_controls

    def controls(self, unknowns: Array) -> Array:
        """Controls that are held, the others nearest to 0 in their range."""
        return self._controls

    def state(self, condition: TrimCondition, unknowns: Array) -> tuple[Array, Array]:
        """Simulation state and swashplate angles."""
        turn = 0.5 * unknowns[3:BODY_UNKNOWNS]
        angle = float(np.sqrt(turn @ turn))
        x, _ = super().state(TrimCondition(), np.concatenate([np.zeros(BODY_UNKNOWNS), unknowns[BODY_UNKNOWNS:]]))
        x[S.POSITION : S.ATTITUDE] = unknowns[:3] * self.aircraft.rotors[0].radius
        x[S.ATTITUDE] = np.cos(angle)
        x[S.ATTITUDE + 1 : S.VELOCITY] = turn * np.sinc(angle / np.pi)
        x[S.VELOCITY : S.RATES] = self._velocity
        return x, self.aircraft.mix(self._controls)

    def residual(self, condition: TrimCondition, unknowns: Array) -> Array:
        """Scaled residuals; the mean loads are left in `loads`."""
        found = self.accelerations(condition, unknowns)
        found[:BODY_UNKNOWNS][~self._sprung] = unknowns[:BODY_UNKNOWNS][~self._sprung]
        return found

    def accelerations(self, condition: TrimCondition, unknowns: Array) -> Array:
        """Scaled mean rates of all equations, those along axes without a spring included."""
        x, swash = self.state(condition, unknowns)
        rates, self.loads = self.engine.average(x, swash, self._psi)
        return np.asarray(rates[self.equations] / self.scales)

    def start(self, condition: TrimCondition, inflow: float | None) -> Array:
        """Unknowns without deflection, by momentum theory or with an inflow ratio alone."""
        if inflow is None:
            given = self.aircraft.trim_unknowns(self._controls)
            guess = MomentumTheory(self).guess(condition, controls=given)
            return np.concatenate([np.zeros(BODY_UNKNOWNS), guess[-self._places.size :]])
        x = np.zeros(self.layout.size)
        for j in range(len(self.aircraft.rotors)):
            x[self.layout.inflow(j).start] = inflow
        return self.unknowns_of(x)

    def unknowns_of(self, x: Array) -> Array:
        """Unknowns of a simulation state."""
        own = self.unknowns(0.0, 0.0, np.zeros(0), x)[2:]
        turn = x[S.ATTITUDE + 1 : S.VELOCITY]
        half = float(np.sqrt(turn @ turn))
        place = x[S.POSITION : S.ATTITUDE] / self.aircraft.rotors[0].radius
        return np.concatenate([place, 2.0 * turn / np.sinc(np.arcsin(min(half, 1.0)) / np.pi), own])

    def stand_point(self, condition: TrimCondition, unknowns: Array, iterations: int) -> StandPoint:
        """Result of a solution."""
        x, _ = self.state(condition, unknowns)
        heading, pitch, roll = quaternion_to_euler(x[S.ATTITUDE : S.VELOCITY])
        point = self.point(condition, unknowns, "newton", iterations)
        values = {field.name: getattr(point, field.name) for field in fields(TrimPoint)}
        values |= {"pitch": float(pitch), "roll": float(roll), "state": self.layout.to_linear(x)}
        return StandPoint(**values, position=x[S.POSITION : S.ATTITUDE].copy(), heading=float(heading))


def _hub_velocity(aircraft: Aircraft, condition: TrimCondition) -> Array:
    """Velocity in body axes [m/s] of a stand that moves steadily through the air; TrimError where it cannot."""
    velocity, _ = condition.motion(0.0, 0.0)
    free = aircraft.body.stand_free
    may_move = not free[3:].any() and not (free[:3] * velocity).any() and not condition.turn_rate
    for name in MOTIONS:
        if (value := getattr(condition, name)) and not may_move:
            axes = ", ".join(axis for axis, flag in zip(STAND_AXES, free, strict=True) if flag) or "no axis"
            raise TrimError(f"{name} = {value:g}: allowed is 0 on a stand that is free in {axes}")
    return velocity


def rest(
    aircraft: Aircraft, condition: TrimCondition, fidelity: Fidelity, guess: StandPoint | None = None
) -> StandPoint:
    """Deflection of a stand and steady motion of its rotors, whose mean rates vanish.

    Raises
    ------
    TrimError
        A motion that the stand does not allow, no solution, or loads along a free axis without a spring.
    """
    problem, iterations, worst = StandProblem(aircraft, fidelity, condition), 0, None
    starts = [problem.start(condition, inflow) for inflow in (None, *INFLOWS)]
    if guess is not None:
        starts.insert(0, problem.unknowns_of(guess.simulation_state(aircraft.layout)))
    for start in starts:
        found = newton(lambda unknowns: problem.residual(condition, unknowns), start)
        iterations += found.iterations
        if found.converged:
            _check_free_axes(problem, condition, found.values)
            return problem.stand_point(condition, found.values, iterations)
        worst = found.residual if worst is None else worst
    assert worst is not None
    size, equation = float(np.abs(worst).max()), problem.worst_equation(worst)
    text = f"no rest on the stand: the {problem.balance(worst)} is not balanced, residual {size:.3g} in {equation}"
    raise TrimError(text, residual=size, worst_equation=equation)


def _check_free_axes(problem: StandProblem, condition: TrimCondition, unknowns: Array) -> None:
    """Raise TrimError where an axis accelerates, since it is free without a spring."""
    left = problem.accelerations(condition, unknowns)[:BODY_UNKNOWNS]
    for axis, size in zip(STAND_AXES, left.tolist(), strict=True):
        if abs(size) > BALANCED:
            raise TrimError(f"no rest on the stand: {axis} is free without a spring, and has an acceleration")
