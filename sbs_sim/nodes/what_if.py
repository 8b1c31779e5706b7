"""A recorded flight flown again with a changed aircraft, into a new log."""

import argparse
import sys
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from nav_msgs.msg import Odometry
from rclpy.serialization import serialize_message
from rosgraph_msgs.msg import Clock

from sbs_msgs.msg import BodyState, FlightEvent, InflowArray, RotorStateArray
from sbs_sim.aircraft import Aircraft
from sbs_sim.errors import RecordingError, SbsError
from sbs_sim.flight.refly import refly, rescaled, started
from sbs_sim.nodes.conversions import StateMessages, event_message, to_time
from sbs_sim.nodes.flight_log import FlightLog
from sbs_sim.nodes.qos import EVENT_QOS, STATE_QOS
from sbs_sim.recording.recorded_flight import RecordedFlight
from sbs_sim.terminal.command_line import assignment


def fly_with(
    flight: RecordedFlight,
    changes: Sequence[str],
    last: int,
    output: Path,
    progress: Callable[[float, float], None] | None = None,
) -> tuple[Path, int]:
    """Fly the events of a flight with a changed aircraft into a new log.

    Parameters
    ----------
    flight : RecordedFlight
    changes : sequence of str
        "PATH=VALUE" each, see `Aircraft.with_values`.
    last : int
        Step to end at.
    output : Path
    progress : callable, optional
        Called with the number of steps that have been flown and of all of them; what it raises ends the flight.

    Returns
    -------
    path : Path
    steps : int
        Flown, in those of the recorded flight; fewer than wanted if the changed aircraft ended in a fault.

    Raises
    ------
    SbsError
        A change that is not possible, a log that cannot be written.
    """
    aircraft = changed(flight.aircraft, changes)
    # rotors of another speed have another step
    step_size = started(aircraft, flight.events, **flight.options).step_size
    shorter = flight.step_size / step_size
    events = rescaled(flight.events, shorter)
    simulation = started(aircraft, events, **flight.options)
    log = FlightLog(str(output), simulation, {"with": list(changes)})
    try:
        changed_flight = replace(flight, aircraft=aircraft, events=events)
        steps = _write_flight(changed_flight, round(last * shorter), step_size, log, progress)
    except BaseException:  # an interruption too: half a flight looks like a complete one
        log.discard()
        raise
    log.close()
    if log.fault:
        raise RecordingError(log.fault)
    return log.path, round(steps / shorter)


def changed(aircraft: Aircraft, changes: Sequence[str]) -> Aircraft:
    """Aircraft with changes "PATH=VALUE".

    Raises
    ------
    SbsError
        One is not of that form, or all together are not possible.
    """
    try:
        return aircraft.with_values(dict(map(assignment, changes)))
    except argparse.ArgumentTypeError as error:
        raise SbsError(f"--set {error}") from None


def _write_flight(
    flight: RecordedFlight,
    last: int,
    step_size: float,
    log: FlightLog,
    progress: Callable[[float, float], None] | None,
) -> int:
    """Fly to a step and record; the number of steps that were flown."""
    made = StateMessages(flight.aircraft)
    kinds = {
        "clock": (Clock, STATE_QOS),
        "events": (FlightEvent, EVENT_QOS),
        "state": (BodyState, STATE_QOS),
        "rotors": (RotorStateArray, STATE_QOS),
        "inflow": (InflowArray, STATE_QOS),
        "odom": (Odometry, STATE_QOS),
    }
    names = {role: flight.topics.get(role, f"/{role}") for role in kinds}  # as the recorded flight has them
    channels = {role: log.channel(names[role], kind, qos, role) for role, (kind, qos) in kinds.items()}

    def keep(role: str, message: Any, now: float) -> None:
        log.write(channels[role], now, serialize_message(message), wait=True)

    events = [event for event in flight.events if event.step <= last]
    for event in events:
        keep("events", event_message(event, step_size), event.step * step_size)
    first = flown = flight.events[0].step
    try:
        for snapshot in refly(flight.aircraft, events, last, **flight.options):
            made.fill(snapshot)
            keep("clock", Clock(clock=to_time(snapshot.time)), snapshot.time)
            for role, message in (("state", made.state), ("rotors", made.rotors), ("inflow", made.inflow)):
                keep(role, message, snapshot.time)
            keep("odom", made.odom, snapshot.time)
            flown = snapshot.step
            if progress is not None:
                progress(flown - first, last - first)
    except SbsError as error:
        print(f"the flight ended early: {error}", file=sys.stderr)
    return flown - first
