"""`simulate`: a whole flight in one call."""

from __future__ import annotations  # `help` then shows types by their names

from collections.abc import Sequence

from numpy.typing import ArrayLike

from sbs_sim.aircraft import Aircraft
from sbs_sim.flight.controller import Controller
from sbs_sim.flight.controls import Commands
from sbs_sim.flight.engine_failure import EngineFailure
from sbs_sim.flight.history import History
from sbs_sim.flight.power_balance import POWER_BALANCE, check_outputs
from sbs_sim.flight.simulation import AUTO, AZIMUTH_STEP
from sbs_sim.flight.sortie import Sortie, fly_together
from sbs_sim.flight.trim_point import TrimPoint
from sbs_sim.model.wind import Wind


def simulate(
    aircraft: Aircraft,
    start: TrimPoint | ArrayLike,
    controls: Commands | Controller,
    duration: float,
    *,
    tick: float = 0.01,
    azimuth_step: float = AZIMUTH_STEP,
    lead_lag: bool = True,
    cyclic_inflow: bool = True,
    method: str = AUTO,
    wind: Wind | None = None,
    ground_altitude: float | None = None,
    actuators: bool = False,
    events: Sequence[EngineFailure] = (),
    outputs: Sequence[str] = (),
) -> History:
    """Fly for a while and return what happened.

    Parameters
    ----------
    aircraft : Aircraft
    start : TrimPoint or ndarray, shape (size,)
        A trim point, flown from the origin heading north, or a simulation state.
    controls : array_like, callable or Controller
        Pilot controls [rad, or their units] in the order of `Aircraft.control_names`: shape (n_controls,) for the whole
        flight, shape (n, n_controls) one row per tick (the last is held), or a function of time [s] that gives
        (n_controls,). A `Controller` puts a control law into the loop: it sees the flight. "controls" of the result are
        then those that act, behind its delay and its lag.
    duration : float
        [s], rounded to whole ticks.
    tick, azimuth_step, lead_lag, cyclic_inflow, method, wind, ground_altitude
        See `Simulation`. A trim point is flown with the velocity of the steady wind added.
    actuators : bool
        False: controls must be within their ranges, and the swashplates follow them at once, as linear models have it;
        steps that their actuators would not follow are in `warnings`. True: the mixer of the live flight is
        between them. It clips controls and angles to their ranges, with a warning, and moves the swashplates at the
        rates of their actuators. A `Controller` always flies through the mixer.
    events : sequence of EngineFailure
        Of aircraft with drives: engines that fail, or run again, on the way.
    outputs : sequence of str
        What else to work out, afterwards, at every row: "power_balance", where the power of the engines goes.

    Returns
    -------
    History
        Mapping of names to arrays, over the n instants between and at the ends of n - 1 ticks: "time" (n,) [s],
        "controls" (n, n_controls), "swashplate" (n, n_rows, 3) [rad], see `Aircraft.mix`, "acceleration" (n, 3)
        [m/s^2], "thrust" [N], "torque" [N m], "power" [W] (n, n_rotors), "state" (n, size) and every name of the
        simulation state (n,), "phi", "theta", "psi" (n,) [rad], roll, pitch and heading, and "V" (n,), the speed
        relative to the air [m/s]. Of an aircraft that stands on the ground "contact_force" (n, n_points, 3), of the
        ground on its contact points, body axes [N], and "contact_depth" (n, n_points), below the surface [m].
        With the output "power_balance" also that, (n, len(POWER_TERMS)), and "power_engine", "power_induced" ... (n,)
        [W] of all terms in `sbs_sim.model.power.POWER_TERMS`: the engines and the actuators of the pitch give what all
        others take (theory.md section 5.11).
        `warnings` says where the model does not hold.

    Raises
    ------
    SimulationError
        See `Simulation`; controls beyond their ranges, naming control, time, value and range, or more rows of them than
        ticks; the flight cannot go on; an unknown output, or one that the coupling of the aircraft does not have.
    """
    check_outputs(outputs)
    sortie = Sortie(
        aircraft,
        start,
        controls,
        duration,
        wind=wind,
        actuators=actuators,
        events=events,
        balanced=POWER_BALANCE in outputs,
        tick=tick,
        azimuth_step=azimuth_step,
        lead_lag=lead_lag,
        cyclic_inflow=cyclic_inflow,
        method=method,
        ground_altitude=ground_altitude,
    )
    fly_together([sortie])
    flown, fault = sortie.result()
    if fault is not None:
        raise fault
    return flown
