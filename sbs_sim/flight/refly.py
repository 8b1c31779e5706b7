"""Fly a flight again from its events, to the last bit."""

from __future__ import annotations  # `help` then shows types by their names

import collections
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

from sbs_sim.aircraft import Aircraft
from sbs_sim.errors import SimulationError
from sbs_sim.flight.records import Event, Snapshot
from sbs_sim.flight.simulation import Simulation
from sbs_sim.flight.stitched_simulation import begun

STITCHED_OPTIONS = ("tick", "ground_altitude")  # the others are those of the model


def started(aircraft: Aircraft, events: Sequence[Event], **options: Any) -> Simulation:
    """Simulation at the start of a flight, also of one that had flown before its log began.

    Parameters
    ----------
    aircraft : Aircraft
    events : sequence of Event
        The first is the start.
    **options :
        Those of `Simulation` but for the wind; "model" is a stitched one that flew, or None.

    Raises
    ------
    SimulationError
        The events do not begin with a start, or one that is not possible.
    """
    start = events[0] if events else None
    if start is None or start.kind != "start" or start.state is None or start.swashplate is None:
        raise SimulationError("events: the first must be the start of the flight")
    model = options.pop("model", None)
    if model is not None:
        options = {name: options[name] for name in STITCHED_OPTIONS if name in options}
    simulation = begun(aircraft, model, start.state, start.swashplate, wind=start.wind, **options)
    simulation.resume_from(start)
    return simulation


def rescaled(events: Sequence[Event], factor: float) -> tuple[Event, ...]:
    """Events of a flight whose steps are shorter by a factor: what acted acts at the same time."""
    return tuple(
        replace(event, step=round(event.step * factor), wind_step=round(event.wind_step * factor)) for event in events
    )


def refly(aircraft: Aircraft, events: Sequence[Event], last_step: int, **options: Any) -> Iterator[Snapshot]:
    """Fly a flight again from the events of the first one.

    Parameters
    ----------
    aircraft : Aircraft
    events : sequence of Event
        In the order in which they acted; the first is the start.
    last_step : int
        Where to end.
    **options :
        Those of `Simulation` but for the wind.

    Yields
    ------
    Snapshot
        At the start, after every tick and after every reset.

    Raises
    ------
    SimulationError
        The events do not begin with a start, or the flight cannot go on and no reset follows.
    """
    simulation, waiting = started(aircraft, events, **options), collections.deque(events[1:])
    yield simulation.snapshot()
    fault: SimulationError | None = None
    while simulation.step < last_step or (waiting and waiting[0].step <= simulation.step):
        while waiting and waiting[0].step <= simulation.step:
            event = waiting.popleft()
            simulation.act(event)
            if event.kind == "reset":
                fault = None
                yield simulation.snapshot()
        if fault is not None:
            raise fault
        if simulation.step >= last_step:
            return
        try:
            simulation.advance()
        except SimulationError as error:
            fault = error
        yield simulation.snapshot()
