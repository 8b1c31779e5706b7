"""Flights with a pilot in the loop, as fast as they compute: the mixer and the simulation as the nodes run them."""

from __future__ import annotations  # `help` then shows types by their names

import collections
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sbs_sim import checks
from sbs_sim.aircraft import Aircraft
from sbs_sim.errors import PilotError
from sbs_sim.flight.history import History, history
from sbs_sim.flight.mixer import Mixer
from sbs_sim.flight.stitched import StitchedModel
from sbs_sim.flight.stitched_simulation import begun
from sbs_sim.flight.trim_point import TrimPoint
from sbs_sim.flight.trimmed_state import trimmed_state
from sbs_sim.model.wind import Wind

Array = NDArray[np.float64]

MAX_DELAY = 100  # ticks


def simulate_with_pilot(
    aircraft: Aircraft,
    start: TrimPoint | ArrayLike,
    pilot: Callable[[float, Array], ArrayLike],
    duration: float,
    *,
    wind: Wind | None = None,
    delay: int = 0,
    model: StitchedModel | None = None,
    **options: Any,
) -> History:
    """Fly for a while with a pilot who sees every state.

    Parameters
    ----------
    aircraft : Aircraft
    start : TrimPoint or ndarray, shape (size,)
        A trim point, flown from the origin heading north without a motion over ground in `wind`, or a simulation state.
    pilot : callable
        Takes time [s] and simulation state, shape (size,), and gives the pilot controls, shape (n_controls,); ranges
        and rates are those of the mixer.
    duration : float
        [s], rounded to whole ticks.
    wind : Wind, optional
    delay : int
        Ticks between a state and the controls that it gives, 0 to 100. Before them there are those of the trim point,
        or of a state the first ones that the pilot gives.
    model : StitchedModel, optional
        A stitched model of the aircraft, which then flies in place of the full one.
    **options
        See `Simulation`, with a stitched model `StitchedSimulation`.

    Returns
    -------
    History
        See `simulate`; "controls" are those of the pilot, and `warnings` has what the mixer clipped, too.

    Raises
    ------
    PilotError
        An aircraft that is none, a delay or a duration out of range, another number of controls.
    SimulationError
        See `Simulation`, `Mixer.set_target`.
    """
    checks.instance("aircraft", aircraft, Aircraft, PilotError)
    delay = checks.integer("delay", delay, 0, MAX_DELAY, PilotError)
    duration = checks.number("duration", duration, 0.0, 1e6, "s", PilotError)
    if not callable(pilot):
        raise PilotError(f"pilot = {checks.shown(pilot)}: allowed are functions of time and state")
    mixer = Mixer(aircraft)
    waiting: collections.deque[Array] = collections.deque()
    if isinstance(start, TrimPoint):
        state = trimmed_state(aircraft, start)
        mixer.set_position(start.swashplate)
        waiting.extend([start.controls] * delay)
    else:
        state = checks.array("start", start, PilotError)
    given = [_asked(aircraft, pilot, 0.0, state)]
    mixer.set_target(given[0])
    simulation = begun(aircraft, model, state, mixer.move(0.0), wind=wind, **options)
    snapshots, clipped = [], dict.fromkeys(() if model is None else model.warnings)
    for tick in range(round(duration / simulation.tick) + 1):
        if tick > 0:
            simulation.advance()
            given.append(_asked(aircraft, pilot, simulation.time, simulation.state))
        waiting.append(given[-1])
        mixer.set_target(waiting.popleft() if len(waiting) > delay else waiting[0])
        clipped |= dict.fromkeys(f"clipped: {text}" for text in mixer.saturated)
        simulation.set_swashplate(mixer.move(simulation.time))
        snapshots.append(simulation.snapshot())
    return history(aircraft, snapshots, given, clipped)


def _asked(aircraft: Aircraft, pilot: Callable[[float, Array], ArrayLike], time: float, state: Array) -> Array:
    """Controls that a pilot gives, shape (n_controls,); the mixer checks their values."""
    controls = checks.array("controls", pilot(time, state), PilotError)
    if controls.shape != (len(aircraft.controls),):
        raise PilotError(f"controls = {checks.shown(controls.tolist())}: allowed are {len(aircraft.controls)} numbers")
    return controls
