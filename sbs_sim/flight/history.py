"""Histories of a flight by name."""

from __future__ import annotations  # `help` then shows types by their names

from collections.abc import Iterable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from sbs_sim.aircraft import Aircraft
from sbs_sim.flight.records import Rows, Snapshot
from sbs_sim.flight.validity import flight_warnings
from sbs_sim.model import records as R
from sbs_sim.model import state as S
from sbs_sim.model.contact import DEPTH
from sbs_sim.model.frames import euler_angles, to_body

Array = NDArray[np.float64]


class History(dict[str, Array]):
    """Histories of a flight by name, see `simulate`.

    Attributes
    ----------
    warnings : tuple of str
        Where the model does not hold, and what the aircraft's actuators would not do, a line each; as `status` has
        them of a live flight. Looked for ten times a second.
    """

    def __init__(self, histories: Mapping[str, Array], warnings: Iterable[str] = ()) -> None:
        super().__init__(histories)
        self.warnings = tuple(warnings)

    def __missing__(self, name: str) -> Array:
        raise KeyError(f"no {name!r}: there are {', '.join(self)}")

    def __repr__(self) -> str:
        time = self["time"]
        note = f", {len(self.warnings)} warnings" if self.warnings else ""
        return f"<flight of {time[-1] - time[0]:g} s, {len(time)} rows of {', '.join(self)}{note}>"


def history(
    aircraft: Aircraft, snapshots: Sequence[Snapshot], given: Sequence[Array], warnings: Iterable[str] = ()
) -> History:
    """History, see `simulate`, of snapshots and as many pilot controls, each (n_controls,), with more warnings."""
    rows = Rows.of(snapshots)
    working = np.empty(0) if rows.working is None else rows.working
    lines = (*flight_warnings(aircraft, working), *warnings)
    return History(named_histories(aircraft, [(rows, np.array(given))], True), lines)


def named_histories(aircraft: Aircraft, blocks: Sequence[tuple[Rows, Array]], loaded: bool) -> dict[str, Array]:
    """Histories by name of blocks of rows and their pilot controls; not loaded leaves accelerations and loads out."""
    states = np.concatenate([rows.state for rows, _ in blocks])
    named = {name: states[:, i] for i, name in enumerate(aircraft.layout.names)}
    named |= dict(zip(S.EULER_NAMES, euler_angles(states[:, S.ATTITUDE : S.VELOCITY]).T, strict=True))
    flown = named | {
        "time": np.concatenate([rows.time for rows, _ in blocks]),
        "state": states,
        "controls": np.concatenate([given for _, given in blocks]),
        "swashplate": np.concatenate([rows.swashplate for rows, _ in blocks]),
    }
    if not loaded:
        return flown
    loads = np.concatenate([rows.loads for rows, _ in blocks])
    wind = np.concatenate([rows.wind for rows, _ in blocks])
    attitude, velocity = states[:, S.ATTITUDE : S.VELOCITY], states[:, S.VELOCITY : S.RATES]
    speeds = aircraft.rotor_speeds(states)
    if aircraft.has_contact:
        contact = np.concatenate([rows.contact for rows, _ in blocks if rows.contact is not None])
        flown |= {"contact_force": contact[..., :DEPTH], "contact_depth": contact[..., DEPTH]}
    return flown | {
        "acceleration": np.concatenate([rows.acceleration for rows, _ in blocks]),
        "thrust": loads[:, :, R.THRUST],
        "torque": loads[:, :, R.TORQUE],
        "power": loads[:, :, R.TORQUE] * speeds,
        S.AIRSPEED: np.linalg.norm(velocity - to_body(attitude, wind), axis=1),
    }
