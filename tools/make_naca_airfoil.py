"""Generate config/airfoils/naca0012.csv, the default airfoil, or another symmetric one of four digits, with NeuralFoil.

    pip install neuralfoil==0.3.3
    python tools/make_naca_airfoil.py 0012 [output.csv]

needs no network once installed. NeuralFoil (P. Sharpe, MIT licence) is a neural network trained on XFOIL
polars. The settings and the reasons for them:

- Transition is forced at 10 % of the chord on both sides. A rotor blade meets the turbulent wakes of the
  blades before it and carries dust and seams. With free transition a laminar separation bubble wanders over
  the rear of this airfoil below Re 5e5 and makes the lift slope at small angles vary between 3 and 14 /rad,
  in XFOIL as well: true of a polished model in a quiet wind tunnel, not of a blade.
- The trailing edge is sharp (last coefficient of the thickness polynomial 0.1036), as usual in computation.
- The polar is trusted to 1 deg past maximum lift, or as far as the network's own confidence is above 0.8 where that
  is less, as it is for NACA 0015 at some Reynolds numbers; beyond that it is extended by the formulas of Viterna.

Besides the table the script prints the characteristics of each polar and the error of the interpolation.
"""

import sys
from importlib.metadata import version
from pathlib import Path

import neuralfoil
import numpy as np

from sbs_sim.model.airfoil import AirfoilTable, Array, extend_polar, interpolate, write_table

FOLDER = Path(__file__).resolve().parent.parent / "config" / "airfoils"
REYNOLDS = np.array([5e4, 8e4, 1.2e5, 2e5, 3e5, 4.5e5, 7e5, 1e6])
STEP_DEG = 0.5
STALL_SEARCH_DEG = 20.0  # maximum lift of the attached branch is looked for up to this angle
PAST_STALL_DEG = 1.0
MODEL_SIZE = "xxxlarge"
N_CRIT = 9.0
TRANSITION = 0.1  # forced transition, fraction of chord, both sides
MIN_CONFIDENCE = 0.8
ASPECT_RATIO = 10.0  # blade radius over chord, 0.505 m / 0.051 m, rounded

NEURALFOIL = f"NeuralFoil {version('neuralfoil')}"

COMMENTS = [
    "NACA {digits} with a sharp trailing edge, made by tools/make_naca_airfoil.py.",
    f"Attached flow: {NEURALFOIL}, model size {MODEL_SIZE}, n_crit {N_CRIT:g}, incompressible, transition",
    f"forced at {TRANSITION:g} chord on both sides.",
    f"Stalled flow: Viterna and Corrigan (NASA CP-2230, 1982) from {PAST_STALL_DEG:g} deg past maximum lift,",
    f"or from where NeuralFoil's confidence falls below {MIN_CONFIDENCE:g} where that is less;",
    f"aspect ratio {ASPECT_RATIO:g}, reflected past 90 deg with the lift factor -0.7; linear lift and",
    "constant drag where the reversed airfoil is not stalled.",
    "Licence: Apache-2.0, as the package; NeuralFoil itself is under the MIT licence.",
]


def coordinates(thickness: float, points: int = 150) -> Array:
    """Outline over unit chord, shape (2 points - 1, 2), from the trailing edge over the upper side first."""
    x = (1 - np.cos(np.linspace(0, np.pi, points))) / 2
    y = 5 * thickness * (0.2969 * np.sqrt(x) - 0.1260 * x - 0.3516 * x**2 + 0.2843 * x**3 - 0.1036 * x**4)
    return np.vstack([np.column_stack([x, y])[::-1], np.column_stack([x, -y])[1:]])


def evaluate(thickness: float, reynolds: float, alpha: Array) -> tuple[Array, Array, Array]:
    """Lift, drag and confidence of NeuralFoil at angles [rad], each of the shape of alpha."""
    result = neuralfoil.get_aero_from_coordinates(
        coordinates(thickness),
        alpha=np.degrees(alpha),
        Re=reynolds,
        n_crit=N_CRIT,
        xtr_upper=TRANSITION,
        xtr_lower=TRANSITION,
        model_size=MODEL_SIZE,
    )
    return result["CL"], result["CD"], result["analysis_confidence"]


def trusted_polar(thickness: float, reynolds: float, step_deg: float) -> tuple[Array, Array, Array]:
    """Angles [rad], lift and drag up to the join with Viterna on both sides, exactly odd and even."""
    fine = np.radians(np.arange(0, STALL_SEARCH_DEG + STEP_DEG, STEP_DEG))
    join_deg = np.degrees(fine[np.argmax(evaluate(thickness, reynolds, fine)[0])]) + PAST_STALL_DEG
    alpha = np.arange(round(join_deg / step_deg) + 1) * np.radians(step_deg)
    cl, cd, confidence = evaluate(thickness, reynolds, alpha)
    trusted = int(np.argmin(np.append(confidence >= MIN_CONFIDENCE, False)))
    alpha, cl, cd = alpha[:trusted], cl[:trusted], cd[:trusted]
    cl[0] = 0.0
    return (
        np.concatenate([-alpha[:0:-1], alpha]),
        np.concatenate([-cl[:0:-1], cl]),
        np.concatenate([cd[:0:-1], cd]),
    )


def make_table(digits: str, reynolds: Array = REYNOLDS, step_deg: float = STEP_DEG) -> AirfoilTable:
    """Return the airfoil at all Reynolds numbers."""
    thickness = thickness_of(digits)
    polars = [extend_polar(*trusted_polar(thickness, re, step_deg), ASPECT_RATIO) for re in reynolds]
    cl, cd = np.array([polar[1] for polar in polars]), np.array([polar[2] for polar in polars])
    return AirfoilTable(f"naca{digits}", np.asarray(reynolds), polars[0][0], cl, cd)


def thickness_of(digits: str) -> float:
    """Thickness over chord of a symmetric airfoil of four digits."""
    if len(digits) != 4 or not digits.isdecimal() or not digits.startswith("00"):
        raise SystemExit(f"{digits!r}: allowed are symmetric airfoils of four digits, as 0012")
    return int(digits) / 100


def report(table: AirfoilTable) -> None:
    """Print the characteristics of each polar."""
    thickness = thickness_of(table.name.removeprefix("naca"))
    print("Slope [1/rad] over 0..2 and 0..8 deg, maximum lift, least drag, join with Viterna, least confidence")
    print("       Re    0-2    0-8  cl_max  [deg]   cd_min  join     cl      cd  confidence")
    for reynolds in table.numbers:
        alpha, cl, cd = (values[len(values) // 2 :] for values in trusted_polar(thickness, reynolds, STEP_DEG))
        slopes = [_slope(alpha, cl, np.radians(limit)) for limit in (2.0, 8.0)]
        best = np.argmax(cl)
        stall = f"{cl[best]:6.3f} {np.degrees(alpha[best]):6.1f}  {cd.min():.5f}"
        join = f"{np.degrees(alpha[-1]):4.1f}  {cl[-1]:.3f}  {cd[-1]:.4f}"
        confidence = evaluate(thickness, reynolds, alpha)[2].min()
        print(f"{reynolds:9.0f}  {slopes[0]:5.2f}  {slopes[1]:5.2f}  {stall}  {join}  {confidence:10.2f}")


def _slope(alpha: Array, cl: Array, limit: float) -> float:
    """Least-squares slope through zero up to an angle."""
    within = alpha <= limit + 1e-9
    return float(alpha[within] @ cl[within] / (alpha[within] @ alpha[within]))


def report_interpolation(digits: str) -> None:
    """Print how far bilinear interpolation is from NeuralFoil between the grid points, in attached flow."""
    alpha = np.radians(np.linspace(0, 10, 401))
    between = np.sqrt(REYNOLDS[:-1] * REYNOLDS[1:])
    for step_deg in (1.0, 0.5, 0.25):
        table = make_table(digits, step_deg=step_deg)
        print(f"step {step_deg:4.2f} deg, 0..10 deg: in angle", _errors(digits, table, REYNOLDS, alpha))
    print("step 0.50 deg, half way between Reynolds numbers:", _errors(digits, make_table(digits), between, alpha))


def _errors(digits: str, table: AirfoilTable, reynolds: Array, alpha: Array) -> str:
    """Largest error of cl and relative error of cd over all Reynolds numbers."""
    worst_cl = worst_cd = 0.0
    for re in reynolds:
        cl, cd, _ = evaluate(thickness_of(digits), re, alpha)
        table_cl, table_cd = interpolate(table, re, alpha)
        worst_cl = max(worst_cl, np.abs(table_cl - cl).max())
        worst_cd = max(worst_cd, np.abs(table_cd / cd - 1).max())
    return f"cl {worst_cl:.5f}, cd {100 * worst_cd:.2f} %"


if __name__ == "__main__":
    chosen, *output = sys.argv[1:] or ["0012"]
    airfoil = make_table(chosen)
    comments = [comment.format(digits=chosen) for comment in COMMENTS]
    write_table(output[0] if output else FOLDER / f"{airfoil.name}.csv", airfoil, comments)
    report(airfoil)
    report_interpolation(chosen)
