"""Where the power of a flight goes (theory.md section 5.11)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sbs_sim import checks
from sbs_sim.aircraft import Aircraft
from sbs_sim.errors import SimulationError
from sbs_sim.flight.engine import Engine
from sbs_sim.model import records as R
from sbs_sim.model.air import air_in_space
from sbs_sim.model.air_rows import CG_ROWS
from sbs_sim.model.power import BLADE_POWERS, POWER_TERMS, power_rows
from sbs_sim.model.wind import winds_at

Array = NDArray[np.float64]

POWER_BALANCE = "power_balance"


def check_outputs(outputs: Sequence[str]) -> None:
    """Raise SimulationError for outputs that `simulate` does not have."""
    names = [outputs] if isinstance(outputs, str) else outputs
    checks.instance("outputs", names, Sequence, SimulationError)
    for name in names:
        checks.choice("outputs", name, (POWER_BALANCE,), SimulationError)


def check_balance(aircraft: Aircraft) -> None:
    """Raise SimulationError for an aircraft whose equations do not conserve energy."""
    if aircraft.options.coupling != "complete":
        raise SimulationError(
            f"outputs: {POWER_BALANCE!r}: options.coupling = {aircraft.options.coupling!r}: allowed is complete; the"
            " blades of the other coupling do not feel the acceleration of their hub, which does work on them"
        )


def power_balance(
    engine: Engine,
    states: Array,
    swashplates: Array,
    azimuths: Array,
    air: Array,
    noise: Array | None = None,
    times: Array | None = None,
) -> Array:
    """Power of every term at instants of a flight.

    Parameters
    ----------
    engine : Engine
        Of one aircraft with the `complete` coupling, its blades in the lanes: `Simulation.engine`.
    states : ndarray, shape (n, size)
    swashplates : ndarray, shape (n, n_rows, 3)
        [rad]
    azimuths : ndarray, shape (n, n_rotors)
        Of the rotors [rad]; of those with a drive where that of the drive is zero.
    air : ndarray, shape (n, WIND_SIZE), or (n, 3)
        Air of the ticks that begin there, or velocity of the air where it is the same everywhere, NED [m/s].
    noise : ndarray, shape (n, n_rotors), optional
        Of vortex rings whose thrust fluctuates; none without it.
    times : ndarray, shape (n,), optional
        [s]; with the air of ticks.

    Returns
    -------
    ndarray, shape (n, len(POWER_TERMS))
        [W], in the order of `POWER_TERMS`: "engine" and "actuators" are what is given, all others what is taken.
    """
    count, local = len(states), engine.is_local
    velocities = air
    if times is not None:
        velocities = np.zeros((count, CG_ROWS, 1))
        winds_at(_lane(air), np.ascontiguousarray(times), engine.model.air, velocities)
        velocities = velocities[..., 0]
    sums = R.records(BLADE_POWERS, len(engine.work.sums), engine.n)
    found = engine.memory(count, len(POWER_TERMS))
    given = [_lane(states), _lane(swashplates.reshape(count, -1)), _lane(azimuths)]
    rings = _lane(np.zeros((count, engine.work.ring.shape[1])) if noise is None else noise)
    memory = engine.work, sums, engine.tick.slopes[0]
    if not local or times is None:
        power_rows(engine.code.derivative, engine.model, *given, _lane(velocities), rings, *memory, found)
        return np.asarray(found[..., 0])
    for i in range(count):
        one = slice(i, i + 1)
        rows = engine.memory(1, engine.air_rows)
        rows[0, :CG_ROWS, 0] = velocities[i]
        where = engine.model, given[0][i], given[2][i]
        air_in_space(*where, _lane(air[i]), float(times[i]), engine.tick.space, rows[0])
        own = (*(part[one] for part in given), rows, rings[one])
        power_rows(engine.code.derivative, engine.model, *own, *memory, found[one])
    return np.asarray(found[..., 0])


def named_balance(balance: Array) -> dict[str, Array]:
    """Histories by name of a balance (n, len(POWER_TERMS)): all of it, and each term by itself."""
    return {POWER_BALANCE: balance} | {f"power_{name}": balance[:, i] for i, name in enumerate(POWER_TERMS)}


def _lane(values: Array) -> Array:
    """Numbers of a flight as the only lane."""
    return np.ascontiguousarray(values, dtype=float)[..., np.newaxis]
