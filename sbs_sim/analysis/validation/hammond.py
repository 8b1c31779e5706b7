"""Ground resonance of a rotor on a hub that gives way in its plane (Hammond)."""

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from sbs_sim.analysis.isolated_rotor import IsolatedRotor
from sbs_sim.analysis.validation.comparison import Aim, Case, Row, compared
from sbs_sim.analysis.validation.published import craft, data
from sbs_sim.flight.trim_point import Fidelity

Array = NDArray[np.float64]

AIM = Aim(share=0.001, why="0.1 % of the eigenvalue's magnitude, whose equations are the same")
BAND_AIM = Aim(share=0.001, why="0.1 % of the rotor speeds at which undamped motion begins or ceases to grow")
ONE_AZIMUTH = Fidelity(azimuth_count=1)  # the coefficients are constant
SEARCH_RPM = (120.0, 340.0, 10.0)  # from, to, step
GROWS = 0.01  # 1/s: what is less is rounding


def case() -> Case:
    """Eigenvalues with all dampers, and bands of rotor speed in which undamped motion grows."""
    published = data("hammond")
    rows = [row for speed, values in published["eigenvalues"].items() for row in _eigenvalue_rows(float(speed), values)]
    rows += _band_rows(published["undamped_unstable_bands_rpm"])
    return Case(
        name="hammond",
        title="Ground resonance of Hammond's rotor",
        source=published["source"],
        statement="Aircraft hammond: a stand that is free along x and y, blades with flap and lag hinges at one place,"
        " in vacuum without weight. Flap takes no part. Eigenvalues of the rotor's matrix in multiblade coordinates.",
        substitutes=(),
        rows=tuple(rows),
    )


def _eigenvalue_rows(speed: float, published: list[list[float]]) -> list[Row]:
    found, rows = eigenvalues({"rotors.speed_rpm": speed}), []
    for real, imaginary in published:
        theirs = complex(real, imaginary)
        ours = found[np.argmin(abs(found - theirs))]
        aim = Aim(absolute=AIM.share * abs(theirs), why=AIM.why)
        where = f"{speed:g} rpm, mode of {imaginary:.2f} rad/s"
        rows.append(compared("growth", where, real, ours.real, "1/s", aim))
        rows.append(compared("frequency", where, imaginary, ours.imag, "rad/s", aim))
    return rows


def eigenvalues(values: dict[str, float | list[float]]) -> NDArray[np.complex128]:
    """Eigenvalues [1/s] of the aircraft hammond with values changed."""
    rotor = IsolatedRotor(craft("hammond").with_values(values), ONE_AZIMUTH)
    matrix = rotor.matrix(rotor.steady((0.0, 0.0, 0.0)), inflow=False)[0]
    return np.linalg.eigvals(matrix).astype(np.complex128)


def _growth(speed: float) -> float:
    """Fastest growth without any damper [1/s]."""
    undamped: dict[str, float | list[float]] = {
        "rotors.lag_damping": 0.0,
        "body.stand.damping": [0.0] * 6,
        "rotors.speed_rpm": float(speed),
    }
    return float(eigenvalues(undamped).real.max()) - GROWS


def _band_rows(published: list[list[float]]) -> list[Row]:
    """Ends of the bands, each from where the growth changes its sign."""
    speeds = np.arange(SEARCH_RPM[0], SEARCH_RPM[1], SEARCH_RPM[2])
    growth = np.array([_growth(speed) for speed in speeds])
    changes = np.flatnonzero(np.sign(growth[1:]) != np.sign(growth[:-1]))
    ends = np.array([brentq(_growth, speeds[i], speeds[i + 1], xtol=1e-2) for i in changes])
    rows = []
    for number, band in enumerate(published, 1):
        for name, end in zip(("begins", "ends"), band, strict=True):
            ours = ends[np.argmin(abs(ends - end))] if len(ends) else np.nan
            rows.append(compared(f"undamped band {number} {name}", "no dampers", end, ours, "rpm", BAND_AIM))
    return rows
