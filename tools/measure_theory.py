"""Measure the numbers of docs/theory.md: what each open choice changes, and how good the methods are.

    ./run python tools/measure_theory.py [text]

prints one row for each choice whose name holds the text, all without it: hover (collective, coning, shaft power of all
rotors, derivatives and body poles with rotors and inflow settled), 15 m/s (pitch, longitudinal cyclic, power, Dutch
roll) and the speed, in steps of 0.5 m/s up to 30 m/s, at which a control of the forward trim first leaves its range.
Then one block for each method whose name holds the text.
"""

import math
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from sbs_sim import Aircraft, linearize, simulate, trim
from sbs_sim.analysis.floquet import floquet
from sbs_sim.analysis.reproduce import undamped_sbs
from sbs_sim.analysis.trim_guess import MomentumTheory
from sbs_sim.analysis.trim_problem import TrimProblem
from sbs_sim.analysis.two_loop import _TwoLoops
from sbs_sim.errors import TrimError
from sbs_sim.flight.trim_point import Fidelity, TrimCondition

FORWARD, FASTEST, STEP = 15.0, 30.0, 0.5  # m/s
ONLY_FLAP = {"lead_lag": False, "cyclic_inflow": False}
WITHOUT_CYCLIC_INFLOW = {"cyclic_inflow": False}
HUBS_ABOVE = {"rotors[0].hub": [0.0, -0.645, -0.066], "rotors[1].hub": [0.0, 0.645, -0.066]}
OTHER_SIGN = [[3.532, 0.001, 0.052], [0.001, 2.222, 0.0], [0.052, 0.0, 5.342]]
LOOSE = {"options.coupling": "paper"}

# name, aircraft, changes of its file, fidelity; a change is to be compared with the same aircraft and fidelity without
CHOICES: list[tuple[str, str, dict[str, Any], dict[str, bool]]] = [
    ("sbs", "sbs", {}, {}),
    ("blade_cg from the axis (0.149)", "sbs", {"rotors.blade_cg": 0.149}, {}),
    ("blade_cg of a uniform blade (0.215)", "sbs", {"rotors.blade_cg": 0.215}, {}),
    ("rotation swapped", "sbs", {"rotors[0].rotation": 1, "rotors[1].rotation": -1}, {}),
    ("swashplate_phase_deg 0", "sbs", {"rotors.swashplate_phase_deg": 0.0}, {}),
    ("swashplate_phase_deg -60", "sbs", {"rotors.swashplate_phase_deg": -60.0}, {}),
    ("airfoil linear_573", "sbs", {"rotors.airfoil": "linear_573"}, {}),
    ("root_cutout 0.05", "sbs", {"rotors.root_cutout": 0.05}, {}),
    ("tip_loss 0.97", "sbs", {"rotors.tip_loss": 0.97}, {}),
    ("elements 10", "sbs", {"options.elements": 10}, {}),
    ("elements 80", "sbs", {"options.elements": 80}, {}),
    ("lag_damping 0.5", "sbs", {"rotors.lag_damping": 0.5}, {}),
    ("flat_plate_areas 0", "sbs", {"body.flat_plate_areas": [0.0, 0.0, 0.0]}, {}),
    ("flat_plate_areas doubled", "sbs", {"body.flat_plate_areas": [0.16, 0.30, 0.60]}, {}),
    ("duct_expansion 0.6", "sbs", {"rotors.duct_expansion": 0.6}, {}),
    ("duct_expansion 1", "sbs", {"rotors.duct_expansion": 1.0}, {}),
    ("inertia, products of the other sign", "sbs", {"body.inertia": OTHER_SIGN}, {}),
    ("air_density 1.2", "sbs", {"environment.air_density": 1.2}, {}),
    ("coupling paper", "sbs", LOOSE, {}),
    ("sbs, flap and lag", "sbs", {}, WITHOUT_CYCLIC_INFLOW),
    ("sbs, only flap", "sbs", {}, ONLY_FLAP),
    ("only flap, swashplate_phase_deg 0", "sbs", {"rotors.swashplate_phase_deg": 0.0}, ONLY_FLAP),
    ("only flap, hubs above the c.g.", "sbs", HUBS_ABOVE, ONLY_FLAP),
    ("only flap, coupling paper", "sbs", LOOSE, ONLY_FLAP),
    ("only flap, flap_inertia axis_to_tip", "sbs", {**LOOSE, "options.flap_inertia": "axis_to_tip"}, ONLY_FLAP),
    ("only flap, hub_moment paper", "sbs", {**LOOSE, "options.hub_moment": "paper"}, ONLY_FLAP),
    ("sbs_paper, only flap", "sbs_paper", {}, ONLY_FLAP),
    ("sbs_paper, flap and lag", "sbs_paper", {}, WITHOUT_CYCLIC_INFLOW),
    ("sbs_paper", "sbs_paper", {}, {}),
    ("sbs_paper, only flap, hubs above", "sbs_paper", HUBS_ABOVE, ONLY_FLAP),
    ("sbs_paper, only flap, naca0012", "sbs_paper", {"rotors.airfoil": "naca0012"}, ONLY_FLAP),
    ("sbs_paper, flap and lag, naca0012", "sbs_paper", {"rotors.airfoil": "naca0012"}, WITHOUT_CYCLIC_INFLOW),
]


def changed(name: str, changes: Mapping[str, Any]) -> Aircraft:
    """Aircraft of a file with other values; `sbs` without lag dampers, as the paper's."""
    aircraft = undamped_sbs() if name == "sbs" else Aircraft.load(name)
    for path, value in changes.items():
        aircraft = aircraft.with_value(path, value)
    return aircraft


def hover_row(aircraft: Aircraft, fidelity: Mapping[str, bool]) -> str:
    """Hover: trim, derivatives and poles."""
    point = trim(aircraft, **fidelity)
    model = linearize(aircraft, point=point)
    slopes, settled = model.derivatives(), model.quasi_static()
    coning = math.degrees(point.state[point.state_names.index("a0(1)")])
    text = f"{math.degrees(point.controls[0]):6.2f} {coning:6.3f} {point.power.sum():5.0f}"
    text += "".join(f" {slopes[name]:7.3f}" for name in ("Z_w", "M_q", "L'_p"))
    for control in ("M_longitudinal_cyclic", "N'_differential_longitudinal_cyclic"):
        text += f" {slopes[control]:6.1f}"
    for mode in ("phugoid", "Dutch roll"):
        pole = next((m.pole for m in settled.modes if m.name.startswith(mode)), math.nan)
        text += f" {pole.real:7.3f}{pole.imag:+.3f}i"
    return text


def forward_row(aircraft: Aircraft, fidelity: Mapping[str, bool]) -> str:
    """Forward flight: trim and its limit."""
    try:
        point = trim(aircraft, airspeed=FORWARD, **fidelity)
        pair = next((m.pole for m in linearize(aircraft, point=point).modes if m.name == "Dutch roll"), math.nan)
        text = f"{math.degrees(point.pitch):6.2f} {math.degrees(point.controls[2]):6.2f} {point.power.sum():5.0f}"
        text += f" {pair.real:6.3f}{pair.imag:+.3f}i"
    except TrimError:
        text = f"{'no trim':33s}"
    speed = 0.0
    while speed <= FASTEST:
        try:
            if trim(aircraft, airspeed=speed, **fidelity).beyond_limits:
                return f"{text} {speed:6.1f}"
        except TrimError:
            return f"{text} {speed:6.1f}"
        speed += STEP
    return f"{text}      -"


# --- methods --------------------------------------------------------------------------------------------------------


def stepping() -> None:
    """Error of a quarter of a second after stick steps, by method and azimuth step."""
    aircraft = undamped_sbs()
    point = trim(aircraft)
    controls = point.controls + np.radians([1.0, 1.0, 2.0, 1.0])

    def flown(method: str, degrees: float) -> Any:
        flight = simulate(aircraft, point, controls, 0.25, tick=0.05, azimuth_step=math.radians(degrees), method=method)
        return flight["state"][-1]

    exact = flown("rk4", 0.1)
    for method in ("rk4", "partitioned"):
        errors = [float(np.abs(flown(method, degrees) - exact).max()) for degrees in (5.0, 2.5, 1.25, 0.625)]
        print(f"  {method:12s} largest error of a state at 5, 2.5, 1.25, 0.625 deg:", *(f"{e:.1e}" for e in errors))


def azimuths() -> None:
    """Effect of N_c at 15 m/s."""
    aircraft = undamped_sbs()
    exact = linearize(aircraft, FORWARD, azimuth_count=96)
    for count in (1, 2, 3, 6, 12, 24):
        model = linearize(aircraft, FORWARD, azimuth_count=count)
        controls = np.degrees(np.abs(model.trim.controls - exact.trim.controls)).max()
        poles = [abs(model.mode(m.name).pole - m.pole) / abs(m.pole) for m in exact.modes if m.name in BODY_MODES]
        print(f"  N_c {count:2d}: controls {controls:.1e} deg, body poles {max(poles):.1e}")


def differences() -> None:
    """Effect of the step of the central differences on the poles."""
    aircraft = undamped_sbs()
    for speed in (0.0, FORWARD):
        exact = linearize(aircraft, speed)
        for scale in (0.01, 0.1, 3.0):
            poles = linearize(aircraft, speed, step_scale=scale).poles
            change = np.abs(poles - exact.poles) / np.maximum(np.abs(exact.poles), 0.05)
            print(f"  {speed:4.1f} m/s, steps x {scale:4.2f}: poles by up to {change.max():.1e}")


def exponents() -> None:
    """Floquet exponents beside the poles of the averaged model."""
    aircraft = undamped_sbs()
    for speed in (0.0, 5.0, 10.0, 15.0, 20.0, 25.0):
        point = trim(aircraft, speed)
        found, spread = floquet(aircraft, point), linearize(aircraft, point=point).azimuth_spread
        distance = np.abs(found.exponents - found.poles)
        share = (distance / np.maximum(np.abs(found.poles), 1.0)).max()
        print(f"  {speed:4.1f} m/s: azimuth_spread {spread:.1e}, exponents off by {share:.1e} of max(|pole|, 1 rad/s)")


def guesses() -> None:
    """First guess beside the hover that Newton's method finds from it, and steps to flights at speed."""
    data = Path(__file__).resolve().parents[1] / "test" / "data"
    for name in ("sbs", "sbs_paper", *(data / f"{file}.yaml" for file in ("tail_rotor", "tandem", "uh60a"))):
        aircraft = Aircraft.load(name)
        guess = MomentumTheory(TrimProblem(aircraft, Fidelity())).guess(TrimCondition())
        points = [trim(aircraft, speed) for speed in (0.0, 20.0)]
        off = np.degrees(np.abs(guess[2:6] - points[0].controls)).max()
        steps = " and ".join(str(point.iterations) for point in points)
        print(f"  {Path(name).stem:10s} controls off by up to {off:.2f} deg; {steps} steps to hover and to 20 m/s")
    steps = [trim(Aircraft.load("sbs"), speed).iterations for speed in range(1, 26)]
    print(f"  sbs from 1 to 25 m/s: {min(steps)} to {max(steps)} steps in all")


def two_loops() -> None:
    """The paper's nested loops beside Newton's method."""
    aircraft = undamped_sbs()
    cases = [{"airspeed": v} for v in (0.0, 1.0, 2.0, 3.0, 5.0, 10.0, 15.0)]
    cases += [{"climb_rate": v} for v in (-1.0, 3.0)] + [{"airspeed": 5.0, "sideslip": math.pi / 2}]
    for fidelity in ({}, WITHOUT_CYCLIC_INFLOW):
        for case in cases:
            name = f"  {case} {fidelity}"
            right = trim(aircraft, **case, **fidelity)
            try:
                found = trim(aircraft, **case, **fidelity, method="two_loop")
            except TrimError as error:
                print(f"{name}: {error}")
                continue
            off = max(np.abs(found.controls - right.controls).max(), abs(found.pitch - right.pitch))
            counts = f"{found.iterations} outer, {found.inner_iterations} inner"
            print(f"{name}: {counts}, off Newton by {math.degrees(off):.1e} deg, residual {found.residual:.1e}")
            print(f"  {'':{len(name) - 2}s}  Newton: {right.iterations} iterations, residual {right.residual:.1e}")


def outer_gains() -> None:
    """Gains of the outer loop about Newton's solution, for symmetric and antisymmetric departures."""
    aircraft = undamped_sbs()
    for fidelity, speed in (({}, 0.0), ({}, 2.0), (WITHOUT_CYCLIC_INFLOW, 0.0), (WITHOUT_CYCLIC_INFLOW, FORWARD)):
        point = trim(aircraft, speed, **fidelity)
        problem = TrimProblem(aircraft, Fidelity(True, not fidelity, point.azimuth_count))
        names = list(point.state_names)
        rotor_states = [point.state[names.index(name)] for name in _rotor_names(names, problem)]
        start = np.concatenate([[point.pitch, point.roll], point.controls, rotor_states])
        half = len(problem.coordinates) // 2

        def mapped(change: Any, start: Any = start, problem: TrimProblem = problem, point: Any = point) -> Any:
            moved = start.copy()
            moved[problem.coordinates] += change
            loops = _TwoLoops(problem, point.condition, moved)
            loops._balance_body()
            loops._settle_blades()
            return loops.unknowns[problem.coordinates]

        for kind, sign in (("symmetric", 1.0), ("antisymmetric", -1.0)):
            steps = 1e-4 * np.hstack([np.eye(half), sign * np.eye(half)])
            gains = np.linalg.eigvals([(mapped(step) - mapped(-step))[:half] / 2e-4 for step in steps])
            print(f"  {speed:4.1f} m/s {fidelity}, {kind}: {gains[np.abs(gains).argmax()]:.2f}")


def _rotor_names(names: list[str], problem: TrimProblem) -> list[str]:
    """Names of the rotor states in the order of the unknowns of trim."""
    return [problem.layout.names[place] for place in problem._places]


def couplings() -> None:
    """Poles of the paper's coupling beside those of the complete one, in hover."""
    complete = linearize(undamped_sbs())
    loose = linearize(changed("sbs", LOOSE))
    for name, wanted in (("body", True), ("rotors", False)):
        change = {
            mode.name: abs(loose.mode(mode.name).pole - mode.pole) / abs(mode.pole)
            for mode in complete.modes
            if (mode.name in BODY_MODES) == wanted
        }
        worst = sorted(change, key=lambda mode: -change[mode])[:3]
        print(f"  {name}:", *(f"{mode} {100 * change[mode]:.2f} %;" for mode in worst))


def lag_damping() -> None:
    """Right-most lag mode by damper and speed."""
    for damper in (0.0, 0.022, 0.1, 0.5):
        aircraft = changed("sbs", {"rotors.lag_damping": damper})
        for speed in (0.0, FORWARD, 20.0, 25.0):
            lag = [mode for mode in linearize(aircraft, speed).modes if " lag" in mode.name]
            worst = max(lag, key=lambda mode: mode.pole.real)
            print(f"  {damper:.3f} N m s, {speed:4.1f} m/s: {worst.name} {worst.pole:.3f}")


def constructions() -> None:
    """Largest difference of A by both methods, states in their steps, over its largest element."""
    for name in ("sbs", "sbs_paper"):
        for speed in (0.0, FORWARD):
            one, other = (linearize(changed(name, {}), speed, method=method).a for method in ("averaged", "paper"))
            steps = linearize(changed(name, {}), speed).steps[: len(one)]
            scale = steps / steps[:, None]
            print(f"  {name}, {speed:4.1f} m/s: {np.abs((one - other) * scale).max() / np.abs(one * scale).max():.1e}")


BODY_MODES = ("short period", "phugoid", "heave subsidence", "roll", "Dutch roll", "spiral")
METHODS: dict[str, Callable[[], None]] = {
    "stepping": stepping,
    "azimuth count": azimuths,
    "difference steps": differences,
    "floquet": exponents,
    "first guess": guesses,
    "two loops": two_loops,
    "outer gains": outer_gains,
    "coupling": couplings,
    "lag damping": lag_damping,
    "constructions": constructions,
}


def main(text: str = "") -> None:
    """Print the rows and blocks."""
    chosen = [choice for choice in CHOICES if text in choice[0]]
    if chosen:
        print(
            " " * 36 + "coll[d] a0[d] P[W]     Z_w     M_q    L'_p   M_B1s N'_dB1s  phugoid        Dutch roll", end=""
        )
        print("    pitch[d] B1s[d] P[W]  Dutch roll     limit")
    for name, file, changes, fidelity in chosen:
        aircraft = changed(file, changes)
        print(f"{name:36s} {hover_row(aircraft, fidelity)} | {forward_row(aircraft, fidelity)}", flush=True)
    for name, method in METHODS.items():
        if text in name:
            print(f"\n{name}")
            method()


if __name__ == "__main__":
    main(*sys.argv[1:2])
