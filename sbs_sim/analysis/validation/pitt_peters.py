"""Dynamic inflow in hover: eigenvalues with the loads of the blades held (Pitt and Peters)."""

import numpy as np

from sbs_sim.analysis.validation.comparison import Aim, Case, compared
from sbs_sim.analysis.validation.published import craft, data
from sbs_sim.flight.engine import points_engine
from sbs_sim.model.inflow import inflow_matrix

INFLOWS = (0.03, 0.06)  # v0, of the tip speed
STEP = 1e-6
AIM = Aim(share=0.001, why="0.1 % of the eigenvalues, whose closed form is exact")


def case() -> Case:
    """Eigenvalues over the inflow ratio."""
    published, rows = data("pitt_peters"), []
    for v0 in INFLOWS:
        values = np.sort(np.linalg.eigvals(eigenmatrix(v0)).real)[::-1] / v0
        for name, key, ours in (
            ("uniform inflow", "uniform_per_inflow", values[0]),
            ("cyclic inflow, first", "cyclic_per_inflow", values[1]),
            ("cyclic inflow, second", "cyclic_per_inflow", values[2]),
        ):
            rows.append(compared(name, f"v0 = {v0:g}", published[key], ours, "Omega v0", AIM))
    return Case(
        name="pitt_peters",
        title="Eigenvalues of the inflow in hover",
        source=published["source"],
        statement="Inflow equations of a rotor of the aircraft sbs alone, thrust and moments of its blades held at"
        " those that keep the inflow ratio v0; differences of the rates by the three inflow states.",
        substitutes=(),
        rows=tuple(rows),
    )


def eigenmatrix(v0: float) -> np.ndarray:
    """Derivative of the inflow's rates over Omega by its states about uniform inflow, shape (3, 3)."""
    columns = [(_rates(v0, i, STEP) - _rates(v0, i, -STEP)) / (2.0 * STEP) for i in range(3)]
    return np.stack(columns, axis=1)


def _rates(v0: float, index: int, step: float) -> np.ndarray:
    """What the inflow itself gives to its rates, over Omega: the loads that are held fall out of the differences."""
    sbs = craft("sbs")
    engine = points_engine(sbs.arranged(True, True, "points"))
    states = np.array([v0, 0.0, 0.0])
    states[index] += step
    out = engine.memory(3, 3)
    inflow_matrix(engine.model.rotors, 0, engine.lanes([states[:1]]), engine.memory(3), 1, out)
    return np.asarray(out[..., 0] @ states / sbs.rotors[0].speed)
