"""Time history of a linear model for the inputs of a flight."""

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import expm

from sbs_sim import checks
from sbs_sim.analysis.linear_model import LinearModel
from sbs_sim.errors import LinearizationError

Array = NDArray[np.float64]


def linear_flight(model: LinearModel, start: ArrayLike, controls: ArrayLike, tick: float) -> Array:
    """Fly x' = A (x - x0) + B (u - u0) about a trim with controls that are held from tick to tick: exact for these.

    Parameters
    ----------
    model : LinearModel
    start : array_like, shape (n_states,)
        State of the model, not its departure from the trim.
    controls : array_like, shape (n, n_controls)
        From each instant on, in the order of the aircraft [rad, or their units]; the last row moves nothing.
    tick : float
        Between instants [s].

    Returns
    -------
    ndarray, shape (n, n_states)
        States, not departures; what an unstable model leaves of the range of numbers is infinite or none.

    Raises
    ------
    LinearizationError
        Another shape, or a tick out of range.
    """
    tick = checks.number("tick", tick, 1e-6, 1e3, "s", LinearizationError)
    x0, u0 = model.trim.state, model.trim.controls
    first = checks.array("start", start, LinearizationError)
    rows = checks.array("controls", controls, LinearizationError)
    if first.shape != x0.shape or rows.shape[1:] != u0.shape or not len(rows):
        raise LinearizationError(
            f"start, controls have the shapes {first.shape}, {rows.shape}: allowed are {x0.shape}, (n, {len(u0)})"
        )
    n, m = model.b.shape
    both = expm(tick * np.vstack([np.hstack([model.a, model.b]), np.zeros((m, n + m))]))
    step, driven = both[:n, :n], both[:n, n:]
    flown = np.empty((len(rows), n))
    flown[0] = first - x0
    with np.errstate(all="ignore"):  # it may grow beyond all numbers
        for i, moved in enumerate(rows[:-1] - u0):
            flown[i + 1] = step @ flown[i] + driven @ moved
    return flown + x0
