"""Outputs of linear models that follow from the loads of rotors, and how much matrices depend on the azimuth."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sbs_sim.aircraft import Aircraft
from sbs_sim.aircraft.model_records import drive_of, gear
from sbs_sim.flight.trim_point import TrimPoint
from sbs_sim.model import records as R
from sbs_sim.model import state as S
from sbs_sim.model.linear import SPECIFIC_FORCE_SIZE
from sbs_sim.model.solve import length

Array = NDArray[np.float64]

LOADS = {R.THRUST: ("thrust", "N"), R.TORQUE: ("torque", "N m")}
LOADS |= {R.FORCE + i: (f"hub_force_{axis}", "N") for i, axis in enumerate("xyz")}
LOADS |= {R.MOMENT + i: (f"hub_moment_{axis}", "N m") for i, axis in enumerate("xyz")}


def load_outputs(
    aircraft: Aircraft, point: TrimPoint, mean: Array, input_names: Sequence[str]
) -> tuple[list[Array], list[str], list[str]]:
    """Rows by all inputs, names and units of specific force, loads and power.

    Parameters
    ----------
    aircraft : Aircraft
    point : TrimPoint
    mean : ndarray, shape (3 + 8 n_rotors, n_inputs)
        Derivatives of specific force and loads.
    input_names : sequence of str
    """
    rows = [*mean[:SPECIFIC_FORCE_SIZE]]
    names, units = [f"specific_force_{axis}" for axis in "xyz"], ["m/s^2"] * SPECIFIC_FORCE_SIZE
    loads = mean[SPECIFIC_FORCE_SIZE:].reshape(len(aircraft.rotors), R.LOAD_SIZE, mean.shape[1])
    speeds = aircraft.rotor_speeds(aircraft.layout.from_linear(point.state)).tolist()
    for j in range(len(aircraft.rotors)):
        rows += [*loads[j], _power_row(aircraft, point, j, speeds[j] * loads[j, R.TORQUE], input_names)]
        names += [f"{LOADS[i][0]}({j + 1})" for i in range(R.LOAD_SIZE)] + [f"power({j + 1})"]
        units += [LOADS[i][1] for i in range(R.LOAD_SIZE)] + ["W"]
    return rows, names, units


def _power_row(aircraft: Aircraft, point: TrimPoint, rotor: int, at_speed: Array, input_names: Sequence[str]) -> Array:
    """Derivative of the power of a rotor from that at its speed."""
    if (drive := drive_of(aircraft, aircraft.rotors[rotor])) < 0:
        return at_speed
    row = at_speed.copy()
    row[input_names.index(f"{S.SPEED}({drive + 1})")] += gear(aircraft, aircraft.rotors[rotor]) * point.torque[rotor]
    return row


def relative_spread(departures: Array, mean: Array, weights: Array) -> float:
    """See `LinearModel.azimuth_spread`; weights, shape (n, n), measure every state in its step."""
    if len(departures) == 1:
        return math.nan
    squares = ((departures * weights) ** 2).sum(axis=(1, 2))
    return math.sqrt(squares.max()) / length((mean * weights).ravel())
