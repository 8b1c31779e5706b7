"""Signals of a recorded flight, for the identification of frequency responses."""

from __future__ import annotations  # `help` then shows types by their names

import numpy as np
from numpy.typing import NDArray

from sbs_sim.aircraft import Aircraft
from sbs_sim.errors import IdentificationError, RecordingError
from sbs_sim.flight.records import Event
from sbs_sim.flight.signals import EXCITATION, Signals, flown_outputs, interval, unmixed
from sbs_sim.model import state as S
from sbs_sim.model.frames import euler_angles
from sbs_sim.recording.log import Log, Topic
from sbs_sim.recording.recorded_flight import RecordedFlight, flight_of

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]

COMMANDS = ("start", "swashplate", "reset")  # events that set the swashplates
JUMPS = ("reset", "engine_failure")  # events after which the flight is another one


def signals_of_log(log: Log, begin: float | None = None, end: float | None = None) -> tuple[Signals, RecordedFlight]:
    """Signals of a log, and its flight: outputs as linear models name them, controls, and excitations.

    Controls are what the swashplates had: they contain what any controller, the excitation and the actuators did, at
    the ticks at which it acted.

    Parameters
    ----------
    log : Log
    begin, end : float, optional
        Simulation times [s]; the whole flight if not given.

    Raises
    ------
    IdentificationError
        No states in that time, unequal intervals, or a reset or failure on the way: choose a part without.
    RecordingError
        See `flight_of`.
    """
    flown = flight_of(log)
    times: Array = flown.steps.astype(np.float64) * flown.step_size
    first, stop = _chosen(times, begin, end)
    _check_jumps(flown, float(times[first]), float(times[stop - 1]))
    steps, states = flown.steps[first:stop], flown.states[first:stop]
    named = {name: states[:, i] for i, name in enumerate(flown.aircraft.layout.names)}
    named |= dict(zip(S.EULER_NAMES, euler_angles(states[:, S.ATTITUDE : S.VELOCITY]).T, strict=True))
    values, units = flown_outputs(flown.aircraft, named | _loads(log, flown.aircraft, times[first:stop]))
    for control, row in zip(flown.aircraft.controls, _controls(flown, steps).T, strict=True):
        values[control.name], units[control.name] = row, control.unit
    added = _excitations(log, flown.aircraft, times[first:stop])
    values |= added
    units |= {name: units[name.removeprefix(EXCITATION)] for name in added}
    held = frozenset({*flown.aircraft.control_names, *added})
    return Signals(interval(times[first:stop]), values, units, held, float(times[first])), flown


def _chosen(times: Array, begin: float | None, end: float | None) -> tuple[int, int]:
    """First state of a part, and the first behind it."""
    low = -np.inf if begin is None else begin
    high = np.inf if end is None else end
    inside = np.flatnonzero((times >= low) & (times <= high))
    if len(inside) < 2:
        raise IdentificationError(
            f"from {low:g} to {high:g} s: the log has states from {times[0]:g} to {times[-1]:g} s of simulation time"
        )
    return int(inside[0]), int(inside[-1]) + 1


def _check_jumps(flown: RecordedFlight, begin: float, end: float) -> None:
    jumps = [event for event in flown.events if event.kind in JUMPS]
    inside = [event for event in jumps if begin < event.step * flown.step_size < end]
    if inside:
        at, kind = inside[0].step * flown.step_size, inside[0].kind.replace("_", " ")
        raise IdentificationError(
            f"{kind} at {at:.4g} s, from {begin:g} to {end:g} s: allowed is a part without, see --from and --to"
        )


def _controls(flown: RecordedFlight, steps: IntArray) -> Array:
    """Pilot controls, shape (n, n_controls), that the swashplates had from each state on."""
    events: list[Event] = [event for event in flown.events if event.kind in COMMANDS and event.swashplate is not None]
    if not events:
        raise RecordingError("the log has no swashplate")
    at = np.array([event.step for event in events])
    number = np.maximum(np.searchsorted(at, steps, side="right") - 1, 0)
    return unmixed(flown.aircraft, np.array([events[i].swashplate for i in number.tolist()]))


def _loads(log: Log, aircraft: Aircraft, times: Array) -> dict[str, Array]:
    """Acceleration, thrust, torque and power at the times of states, where the log has them all."""
    found: dict[str, Array] = {}
    state, rotors = log["state"], log["rotors"]
    if (where := _at(state, times)) is not None:
        found["acceleration"] = np.stack([state[f"acceleration.{axis}"][where] for axis in "xyz"], axis=1)
    if (where := _at(rotors, times)) is not None:
        for quantity in ("thrust", "torque", "power"):
            rows = [rotors[f"rotors[{j}].{quantity}"][where] for j in range(len(aircraft.rotors))]
            found[quantity] = np.stack(rows, axis=1)
    return found


def _at(topic: Topic, times: Array) -> IntArray | None:
    """Numbers of the messages of some times; None where they are not all there."""
    order = np.argsort(topic.time_ns, kind="stable")
    own, asked = topic.time_ns[order], np.round(times * 1e9).astype(np.int64)
    place = np.minimum(np.searchsorted(own, asked), len(own) - 1)
    return order[place] if bool((np.abs(own[place] - asked) <= 1000).all()) else None


def _excitations(log: Log, aircraft: Aircraft, times: Array) -> dict[str, Array]:
    """What was added to the controls, from each state on; without any there is no such signal."""
    topic = log.get("excitation")
    if topic is None or not len(topic.time_ns):
        return {}
    found: dict[str, Array] = {}
    number = np.searchsorted(topic.time, times + 1e-9, side="right") - 1
    for name in aircraft.control_names:
        values = np.zeros(len(topic.time_ns) + 1)  # the last one: none has come yet
        for i, (names, given) in enumerate(zip(topic["names"], topic["values"], strict=True)):
            listed = list(names)
            values[i] = float(given[listed.index(name)]) if name in listed else 0.0
        if values.any():
            found[EXCITATION + name] = values[number]
    return found
