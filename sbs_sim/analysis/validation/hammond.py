"""Ground resonance of a rotor on a hub that gives way in its plane (Hammond)."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from sbs_sim.analysis.isolated_rotor import IsolatedRotor
from sbs_sim.analysis.validation.comparison import Aim, Case, Row, compared
from sbs_sim.analysis.validation.published import craft, data
from sbs_sim.flight.trim_point import Fidelity

Array = NDArray[np.float64]

AIM = Aim(share=0.001, why="0.1 % of the eigenvalue's magnitude, whose equations are the same")
FLOQUET_AIM = Aim(absolute=0.001, why="0.001 1/s of the growth with one damper out, whose equations are the same")
BAND_AIM = Aim(share=0.001, why="0.1 % of the rotor speeds at which undamped motion begins or ceases to grow")
ONE_AZIMUTH = Fidelity(azimuth_count=1)  # the coefficients are constant
SEARCH_RPM = (120.0, 340.0, 10.0)  # from, to, step
GROWS = 0.01  # 1/s: what is less is rounding
ONE_OUT = (1.0, 1.0, 1.0, 0.0)  # shares of the lag dampers that work
EXACT = 1e-9  # of the integration of the equations


def case() -> Case:
    """Eigenvalues with all dampers, growth without one, and bands of rotor speed in which undamped motion grows."""
    published = data("hammond")
    rows = [row for speed, values in published["eigenvalues"].items() for row in _eigenvalue_rows(float(speed), values)]
    rows += [_floquet_row(float(speed), ONE_OUT) for speed in published["one_damper_out_rpm"]]
    rows += _band_rows(published["undamped_unstable_bands_rpm"])
    return Case(
        name="hammond",
        title="Ground resonance of Hammond's rotor",
        source=published["source"],
        statement="Aircraft hammond: a stand that is free along x and y, blades with flap and lag hinges at one place,"
        " in vacuum without weight. Flap takes no part. Eigenvalues of the rotor's matrix in multiblade coordinates."
        " With one damper out the matrix is periodic: growth by Floquet's method over a revolution.",
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


def _floquet_row(speed: float, dampers: Sequence[float]) -> Row:
    """Growth of the least stable motion by both Floquet's methods."""
    turn_rate = speed * math.pi / 30.0
    theirs = multipliers_of_equations(turn_rate, dampers)
    ours = multipliers({"rotors.speed_rpm": speed, "rotors.blade_lag_damping": list(dampers)})
    largest = theirs[np.argmax(abs(theirs))]
    nearest = ours[np.argmin(abs(ours - largest))]
    growth, own = (math.log(abs(value)) * turn_rate / (2.0 * math.pi) for value in (largest, nearest))
    return compared("growth", f"{speed:g} rpm, one damper out", growth, own, "1/s", FLOQUET_AIM)


def multipliers(values: dict[str, float | list[float]]) -> NDArray[np.complex128]:
    """Floquet multipliers over a revolution of the aircraft hammond with values changed; flap has its own."""
    rotor = IsolatedRotor(craft("hammond").with_values(values), ONE_AZIMUTH)
    exponents = rotor.exponents(rotor.steady((0.0, 0.0, 0.0)), inflow=False)
    return np.asarray(np.exp(exponents * 2.0 * math.pi / rotor.rotor.speed))


def multipliers_of_equations(speed: float, dampers: Sequence[float]) -> NDArray[np.complex128]:
    """Floquet multipliers of Hammond's equations: a hub that moves along x and y, and blades that lag.

    Parameters
    ----------
    speed : float
        Of the rotor [rad/s].
    dampers : sequence of floats
        For each blade the share of its damper that works.

    Returns
    -------
    ndarray of complex, shape (12,)
    """
    own = data("hammond")["parameters"]
    count, first, inertia = own["blades"], own["blade_first_moment"], own["blade_inertia"]
    mass = np.diag([*(hub + count * own["blade_mass"] for hub in own["hub_mass"]), *[inertia] * count])
    damping = np.diag([*own["hub_damping"], *(own["lag_damping"] * np.array(dampers))])
    stiffness = np.diag([*own["hub_stiffness"], *[speed**2 * own["hinge_offset"] * first] * count])
    size = len(mass)

    def rates(time: float, flat: Array) -> Array:
        psi = speed * time + np.arange(count) * 2.0 * math.pi / count
        sine, cosine = first * np.sin(psi), first * np.cos(psi)
        m, c, k = mass.copy(), damping.copy(), stiffness.copy()
        m[0, 2:] = m[2:, 0] = -sine
        m[1, 2:] = m[2:, 1] = cosine
        c[:2, 2:] = -2.0 * speed * np.array([cosine, sine])
        k[:2, 2:] = speed**2 * np.array([sine, -cosine])
        place, velocity = np.split(flat.reshape(2 * size, 2 * size), 2)
        return np.concatenate([velocity, np.linalg.solve(m, -c @ velocity - k @ place)]).ravel()

    revolution = (0.0, 2.0 * math.pi / speed)
    flown = solve_ivp(rates, revolution, np.eye(2 * size).ravel(), method="DOP853", rtol=EXACT, atol=EXACT)
    return np.linalg.eigvals(flown.y[:, -1].reshape(2 * size, 2 * size)).astype(np.complex128)


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
