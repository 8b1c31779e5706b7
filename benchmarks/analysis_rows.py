"""Times of trim, linearization and sweep, each beside scipy's generic route on the same model."""

import time
from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.optimize import root
from scipy.optimize._numdiff import approx_derivative

from sbs_sim import Aircraft, linearize, trim
from sbs_sim.analysis.differences import difference_steps
from sbs_sim.analysis.floquet import floquet
from sbs_sim.analysis.sweep import sweep
from sbs_sim.analysis.trim_guess import MomentumTheory
from sbs_sim.analysis.trim_problem import TrimProblem
from sbs_sim.flight.engine import Engine
from sbs_sim.flight.trim_point import Fidelity, TrimCondition, TrimPoint
from sbs_sim.model import state as S
from sbs_sim.model.average import azimuths

Row = tuple[str, float, str, str]
Timed = Callable[[Callable[[], Any], int], tuple[float, str]]

SWEEP_SPEEDS = np.linspace(-5.0, 20.0, 41)


def analysis_rows(timed: Timed) -> list[Row]:
    """Rows of the table; `timed` gives the median time of a call [s] and a note."""
    aircraft = Aircraft.load("sbs")
    return [*trim_rows(aircraft, timed), *linearize_rows(aircraft, timed), *sweep_rows(aircraft)]


def trim_rows(aircraft: Aircraft, timed: Timed) -> list[Row]:
    """Newton with continuation, and scipy's hybrid method from the same guess."""
    rows: list[Row] = []
    for name, speed in (("hover", 0.0), ("20 m/s", 20.0)):
        seconds, note = timed(lambda speed=speed: _first_trim(aircraft, speed), 21)
        rows.append((f"trim {name}, the first of an aircraft", 1e3 * seconds, "ms", note))
        seconds, note = timed(lambda speed=speed: trim(aircraft, airspeed=speed), 21)
        rows.append((f"trim {name}, from the hover that is kept", 1e3 * seconds, "ms", note))
        problem, condition = TrimProblem(aircraft, Fidelity()), TrimCondition(speed)
        guess = MomentumTheory(problem).guess(condition)

        def generic(problem: TrimProblem = problem, condition: TrimCondition = condition, guess: Any = guess) -> Any:
            return root(lambda values: problem.residual(condition, values), guess, tol=1e-12)

        seconds, note = timed(generic, 5)
        solution = generic()
        size = np.abs(solution.fun).max()
        rows.append((f"  scipy.optimize.root, {name}", 1e3 * seconds, "ms", f"residual {size:.0e}; {note}"))
    return rows


def _first_trim(aircraft: Aircraft, speed: float) -> TrimPoint:
    """Trim of an aircraft that keeps nothing of earlier ones."""
    aircraft.kept.clear()
    return trim(aircraft, airspeed=speed)


def linearize_rows(aircraft: Aircraft, timed: Timed) -> list[Row]:
    """The compiled differences, the modes, and scipy's differences of the averaged derivative."""
    point = trim(aircraft)
    model = linearize(aircraft, point=point)
    seconds, note = timed(lambda: linearize(aircraft, point=point), 31)
    rows = [("linearize, 12 azimuths", 1e3 * seconds, "ms", f"A, B, C, D and their spread; {note}")]
    seconds, note = timed(lambda: approx_derivative(_rates(aircraft, point), _inputs(point), **_options(aircraft)), 5)
    generic = approx_derivative(_rates(aircraft, point), _inputs(point), **_options(aircraft))
    n = len(model.state_names)
    error = np.abs(generic[:, :n] - model.a).max() / np.abs(model.a).max()
    rows.append(("  scipy approx_derivative", 1e3 * seconds, "ms", f"A and B alone, differ by {error:.0e}; {note}"))
    seconds, note = timed(lambda: linearize(aircraft, point=point).modes, 31)
    rows.append(("linearize and modes", 1e3 * seconds, "ms", note))
    seconds, note = timed(lambda: linearize(aircraft, point=point, method="paper"), 5)
    rows.append(("linearize, the paper's construction", 1e3 * seconds, "ms", note))
    seconds, note = timed(lambda: floquet(aircraft, point), 9)
    rows.append(("Floquet exponents, 48 azimuths", 1e3 * seconds, "ms", note))
    return rows


def _inputs(point: TrimPoint) -> Any:
    return np.concatenate([point.state, point.controls])


def _options(aircraft: Aircraft) -> dict[str, Any]:
    return {"method": "3-point", "abs_step": difference_steps(aircraft)}


def _rates(aircraft: Aircraft, point: TrimPoint) -> Callable[[Any], Any]:
    """Averaged rates of the linear state as a function of states and controls, for a generic differentiator."""
    engine, layout = Engine(aircraft.arranged(True, True, "points")), aircraft.layout
    psi = azimuths(layout.blades, point.azimuth_count)

    def rates(inputs: Any) -> Any:
        x = layout.from_linear(inputs[: layout.linear_size])
        swash = aircraft.mix(inputs[layout.linear_size :])
        dx, _ = engine.average(x, swash, psi)
        u, v, w, p, q, r = dx[S.VELOCITY : S.BODY_SIZE]
        theta, phi = inputs[S.LINEAR_THETA], inputs[S.LINEAR_PHI]
        pitch_rate = inputs[S.LINEAR_Q] * np.cos(phi) - inputs[S.LINEAR_R] * np.sin(phi)
        yaw_part = inputs[S.LINEAR_Q] * np.sin(phi) + inputs[S.LINEAR_R] * np.cos(phi)
        roll_rate = inputs[S.LINEAR_P] + np.tan(theta) * yaw_part
        return np.concatenate([[u, w, q, pitch_rate, v, p, roll_rate, r], dx[S.BODY_SIZE : layout.size]])

    return rates


def sweep_rows(aircraft: Aircraft) -> list[Row]:
    """41 speeds with linear models and modes, on one and on all cores."""
    rows: list[Row] = []
    for workers, name in ((1, "one core"), (None, "all cores")):
        times = []
        for _ in range(3):
            start = time.perf_counter()
            found = sweep(aircraft, "airspeed", SWEEP_SPEEDS, workers=workers)
            for point in found.points:
                assert point.model is not None, point.error
                len(point.model.modes)
            times.append(time.perf_counter() - start)
        rows.append((f"sweep of 41 speeds, {name}", float(np.median(times)), "s", "-5 to 20 m/s, linear models, modes"))
    return rows
