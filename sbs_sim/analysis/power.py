"""Where the power of a trimmed flight goes (theory.md section 5.11)."""

from __future__ import annotations  # `help` then shows types by their names

import numpy as np

from sbs_sim.aircraft import Aircraft
from sbs_sim.errors import SimulationError
from sbs_sim.flight.engine import Engine
from sbs_sim.flight.power_balance import check_balance, power_balance
from sbs_sim.flight.trim_point import TrimPoint
from sbs_sim.flight.trimmed_state import trimmed_state
from sbs_sim.flight.two_blades import has_two_blades
from sbs_sim.model.average import azimuths
from sbs_sim.model.power import POWER_TERMS


def power_shares(aircraft: Aircraft, point: TrimPoint) -> dict[str, float]:
    """Where the power of a trim goes: the mean of every term over the azimuths of the trim.

    Parameters
    ----------
    aircraft : Aircraft
    point : TrimPoint

    Returns
    -------
    dict of str to float
        [W] by the names of `POWER_TERMS`: "engine" and "actuators" are given, all others taken. What the vibration of
        body and blades stores and gives back in a revolution has a mean of its own here, since the trim holds the
        states that vibrate: up to some 0.5 % of the power.

    Raises
    ------
    SimulationError
        The aircraft has another coupling than `complete`, or rotors with two blades, whose trim is a motion and no
        state.
    """
    check_balance(aircraft)
    if has_two_blades(aircraft):
        raise SimulationError("power of a trim: allowed are three or more blades; `simulate` has that of two")
    engine = Engine(aircraft.arranged(point.lead_lag, point.cyclic_inflow, "blades"))
    angles = azimuths(aircraft.passages, point.azimuth_count)
    state, count = trimmed_state(aircraft, point), len(angles)
    instants = np.tile(state, (count, 1)), np.tile(point.swashplate, (count, 1, 1)), angles, np.zeros((count, 3))
    means = power_balance(engine, *instants).mean(axis=0)
    return dict(zip(POWER_TERMS, means.tolist(), strict=True))
