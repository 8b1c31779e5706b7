"""Constant matrices of the rotors of an aircraft, for the exponential method (theory.md section 7.3)."""

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sbs_sim.flight.engine import points_engine
from sbs_sim.model import state as S
from sbs_sim.model.exponential import coefficients
from sbs_sim.model.packing import lane_count
from sbs_sim.model.records import Exponential, make_exponential

if TYPE_CHECKING:
    from sbs_sim.aircraft import Aircraft
    from sbs_sim.aircraft.description import Rotor

Array = NDArray[np.float64]

LIFT_SLOPE = 2.0 * math.pi  # 1/rad, of a thin airfoil
MAX_LOADING = 0.1  # C_T / sigma at which most rotors stall
ANGLE_STEP, INFLOW_STEP = 1e-4, 1e-5  # rad, of differences; those of rates are the angle's in a radian of rotation


class RotorMatrices(NamedTuple):
    """Coefficients of the exponential method.

    Attributes
    ----------
    blocks : list of list of int
        Places of states that belong together.
    linear : list of ndarray, shape (m, m)
        L of each block: derivatives of their rates by them [1/s].
    coefficients : list of ndarray, shape (10, m, m)
        See `sbs_sim.model.exponential.coefficients`.
    """

    blocks: list[list[int]]
    linear: list[Array]
    coefficients: list[Array]


def rotor_matrices(aircraft: "Aircraft", lead_lag: bool, cyclic_inflow: bool, step: float) -> RotorMatrices:
    """Coefficients of a step [s]; worked out once for an aircraft, read only.

    The rates of a rotor's flap, lag, inflow and wake are linearized where it carries its share of the weight in level
    rest. There the multiblade coordinates of one harmonic depend on one another alone, and not on the azimuth.
    """
    key = RotorMatrices, lead_lag, cyclic_inflow, step
    if key not in aircraft.kept:
        rates, blocks = _rates_by_states(aircraft, lead_lag, cyclic_inflow), _blocks(aircraft)
        linear = [np.ascontiguousarray(rates[np.ix_(block, block)]) for block in blocks]
        found = [coefficients(own, step) for own in linear]
        aircraft.kept[key] = RotorMatrices(blocks, linear, found)
    kept: RotorMatrices = aircraft.kept[key]
    return kept


def arranged(parts: Sequence[RotorMatrices | None]) -> Exponential | None:
    """Coefficients of a single flight, or of as many side by side as there are lanes, with memory; None of none."""
    given = [part for part in parts if part is not None]
    return make_exponential(given[0].blocks, [part.coefficients for part in given], lane_count()) if given else None


def _blocks(aircraft: "Aircraft") -> list[list[int]]:
    """States that belong together: of each harmonic of a rotor with its inflow and wake, and the differential ones."""
    layout, found = aircraft.layout, []
    for j, rotor in enumerate(aircraft.rotors):
        parts = [layout.flap(j).start, layout.flap_rate(j).start, layout.lag(j).start, layout.lag_rate(j).start]
        inflow = layout.inflow(j).start
        parts += list(layout.wake_pairs(j)[0]) if layout.wake_pairs(j) else []
        found.append([*parts, inflow])
        for n in range(1, S.harmonic_count(rotor.blades) + 1):
            block = [part + i for part in parts for i in (2 * n - 1, 2 * n)]
            found.append([*block, inflow + 1, inflow + 2] if n == 1 else block)
        if rotor.blades == 2:
            found.append([inflow + 1, inflow + 2])
        if rotor.blades % 2 == 0:
            found.append([part + rotor.blades - 1 for part in parts])
    return found


def _rates_by_states(aircraft: "Aircraft", lead_lag: bool, cyclic_inflow: bool) -> Array:
    """Derivatives of the rates of the simulation state by the states of rotors, shape (size, size); others are zero."""
    engine, layout = points_engine(aircraft.arranged(lead_lag, cyclic_inflow, "points")), aircraft.layout
    size, rotors = layout.linear_size, len(aircraft.rotors)
    point = np.zeros(size + len(S.SWASHPLATE_NAMES) * rotors)
    steps, offset = np.zeros(len(point)), S.BODY_SIZE - S.LINEAR_BODY_SIZE
    for j, rotor in enumerate(aircraft.rotors):
        inflow, collective = carrying(aircraft, rotor)
        point[layout.inflow(j).start - offset], point[size + len(S.SWASHPLATE_NAMES) * j] = inflow, collective
        for part in (layout.flap(j), layout.lag(j)):
            steps[part.start - offset : part.stop - offset] = ANGLE_STEP
        for part in (layout.flap_rate(j), layout.lag_rate(j)):
            steps[part.start - offset : part.stop - offset] = ANGLE_STEP * rotor.speed
        for part in (layout.inflow(j), layout.wake(j)):
            steps[part.start - offset : part.stop - offset] = INFLOW_STEP
    # controls are the angles of the swashplates, without a constant, and there are no other commands
    swashplates = np.eye(S.ROW * len(aircraft.rows), len(point) - size + 1)
    swashplates[len(point) - size :] = 0.0
    found = engine.jacobian(point, swashplates, steps, layout.linear_owners, np.zeros((1, rotors)))
    linear = np.zeros((layout.size, layout.size))
    first = S.LINEAR_BODY_SIZE
    seen = slice(S.BODY_SIZE, S.BODY_SIZE + size - first)
    linear[seen, seen] = found[0, first:size, first:size].T
    return linear


def carrying(aircraft: "Aircraft", rotor: "Rotor") -> tuple[float, float]:
    """Inflow ratio and collective [rad] with which a rotor carries its share of the weight, up to where it stalls.

    References
    ----------
    W. Johnson: Helicopter Theory, Princeton 1980, sections 2-1 and 2-4: momentum theory, and uniform inflow on blades
    with linear twist, C_T = sigma a / 2 (theta_75 / 3 - lambda / 2).
    """
    environment, tip_speed = aircraft.environment, rotor.speed * rotor.radius
    solidity = rotor.blades * rotor.mean_chord / (math.pi * rotor.radius)
    scale = rotor.radius * tip_speed
    pressure = environment.air_density * math.pi * (scale * scale)  # no power: libraries round it as they like
    share = aircraft.body.mass * environment.gravity / len(aircraft.rotors)
    thrust = min(share / pressure, MAX_LOADING * solidity) if pressure > 0.0 else 0.0
    inflow = math.sqrt(0.5 * thrust)
    collective = 6.0 * thrust / (solidity * LIFT_SLOPE) + 1.5 * inflow - rotor.twist_at(0.75)
    least, most = rotor.collective_range
    return inflow, min(max(collective, least), most)
