"""Air that is not the same everywhere: what is added to the wind at the c.g., at each rotor and at each part.

Turbulence as a field in space, wind that grows with height, fronts of gusts that the aircraft flies through, and the
rotation of the air that military specifications make of turbulence. `add_air` samples all of it where the aircraft is
at a stage of a step (theory.md section 7.8). It works flight by flight with plain numbers, so that its bits do not
depend on the number of lanes.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sbs_sim.lanes import Vector, as_lanes, as_records, transposed
from sbs_sim.model import state as S
from sbs_sim.model.air_field import sampled
from sbs_sim.model.air_rows import ALONG_X, ALONG_Y, CG_ROWS, PART_ROWS
from sbs_sim.model.frames import rotation
from sbs_sim.model.kernel import entry, kernel
from sbs_sim.model.real_functions import cosine_of_turn, logarithm, power_of, sine_of_turn
from sbs_sim.model.records import GUST_ROWS, Model, Space, aligned
from sbs_sim.model.state import attitude_at
from sbs_sim.model.wind_columns import RATES_FROM, RATES_TO

Array = NDArray[np.float64]

# parameters of a flight
START = 0  # when the wind was set [s]
DRIFT = 1  # velocity of the frozen field: the steady wind, NED [m/s]
FIRST_GRID, GRIDS, PERIOD = 4, 5, 6  # of the turbulence; longest period [m]
HORIZONTAL, VERTICAL = 7, 8  # its standard deviations [m/s]
PROFILE, GROUND, REFERENCE_HEIGHT, SHAPE = 9, 10, 11, 12  # kind, heights [m], roughness length [m] or exponent
FRONT, PEAK, LENGTH = 13, 14, 17  # shape of the gust, velocity NED [m/s], length [m]
COSINE, SINE, ORIGIN, DISTANCE = 18, 19, 20, 22  # of the direction of flight through it; north, east, ahead [m]
FIRST_ROW, ROWS = 23, 24  # of the own gust over distance
SPACE_SIZE = 25

UNIFORM, LOGARITHMIC, POWER = range(3)  # profiles
NO_FRONT, ONE_MINUS_COSINE, RAMP = range(3)  # shapes of gusts over distance
SITE_ROWS, PART_SITE_ROWS = 9, 3  # offset, and the hub's x and y axis; offset


def make_space(parameters: Array, grids: Array, table: Array) -> Space:
    """Air of one flight; memory comes with `joined_spaces`."""
    return Space(parameters[:, np.newaxis], grids, table, np.zeros((0, 1)))


def joined_spaces(model: Model, spaces: Sequence[Space], n: int) -> Space:
    """Air of flights side by side; what is missing are copies of the last."""
    filled = [*spaces, *[spaces[-1]] * (n - len(spaces))]
    parameters = aligned((SPACE_SIZE, n), float)
    grids: list[Array] = []
    tables: list[Array] = []
    for lane, space in enumerate(filled):
        parameters[:, lane] = space.parameters[:, 0]
        for name, kept, own in ((FIRST_GRID, grids, space.grids), (FIRST_ROW, tables, space.tables)):
            known = [part is own for part in kept]
            before = kept[: known.index(True)] if any(known) else kept
            parameters[name, lane] = sum(len(part) for part in before)
            if not any(known):
                kept.append(own)
    parts = len(model.surfaces) + len(model.fuselages)
    sites = aligned((SITE_ROWS * len(model.rotors) + PART_SITE_ROWS * parts, n), float)
    return Space(
        parameters,
        grids[0] if len(grids) == 1 else np.concatenate(grids),
        tables[0] if len(tables) == 1 else np.concatenate(tables),
        sites,
    )


@entry
def air_in_space(model, x, wind, time, space, out):
    """`add_air` for one instant at the beginning of a tick."""
    add_air(model, x, wind, time, 0.0, space, out)


@kernel
def add_air(model, x, wind, time, fraction, space, out):
    """Add to the velocity of the air at the c.g. what belongs to its position, and set what differs elsewhere.

    Parameters
    ----------
    model : Model
    x : ndarray, shape (size, n)
        Simulation states.
    wind : ndarray, shape (WIND_SIZE, n)
        Air of the tick.
    time, fraction : float
        Time [s], which lies so far through the tick.
    space : Space
    out : ndarray, shape (air_rows(model), n)
        In its first three rows what `wind_at` gives.
    """
    rotors, parts = as_records(model.rotors), model.surfaces.shape[0] + model.fuselages.shape[0]
    set_sites(model, x, space.sites)
    for lane in range(out.shape[1]):
        add_air_of_flight(rotors.shape[0], parts, x, wind, time, fraction, space, lane, out)
    turn_rows(model, x, out)


@kernel
def set_sites(model, x, sites):
    """Set where hubs and parts are from the c.g., and the x and y axes of the hubs, NED."""
    rotors = as_records(model.rotors)
    surfaces, fuselages = as_records(model.surfaces), as_records(model.fuselages)
    to_earth, out = rotation(attitude_at(as_lanes(x, rotors))), as_lanes(sites, rotors)
    for j in range(rotors.shape[0]):
        axes, first = rotors[j].axes, SITE_ROWS * j
        S.set_vector(out, first, to_earth @ rotors[j].hub)
        S.set_vector(out, first + ALONG_X, to_earth @ Vector(axes.x.x, axes.y.x, axes.z.x))
        S.set_vector(out, first + ALONG_Y, to_earth @ Vector(axes.x.y, axes.y.y, axes.z.y))
    first = SITE_ROWS * rotors.shape[0]
    for i in range(surfaces.shape[0]):
        S.set_vector(out, first + PART_SITE_ROWS * i, to_earth @ surfaces[i].position)
    first += PART_SITE_ROWS * surfaces.shape[0]
    for i in range(fuselages.shape[0]):
        S.set_vector(out, first + PART_SITE_ROWS * i, to_earth @ fuselages[i].position)


@kernel
def turn_rows(model, x, out):
    """Turn what was set in earth axes into the axes of hubs and of the body."""
    rotors = as_records(model.rotors)
    to_body, rows = transposed(rotation(attitude_at(as_lanes(x, rotors)))), as_lanes(out, rotors)
    for j in range(rotors.shape[0]):
        to_hub = transposed(rotors[j].axes)
        for k in range(GUST_ROWS // 3):
            first = CG_ROWS + GUST_ROWS * j + 3 * k
            S.set_vector(rows, first, to_hub @ (to_body @ S.vector_at(rows, first)))
    first = CG_ROWS + GUST_ROWS * rotors.shape[0]
    for i in range(model.surfaces.shape[0] + model.fuselages.shape[0]):
        S.set_vector(rows, first + PART_ROWS * i, to_body @ S.vector_at(rows, first + PART_ROWS * i))


@kernel
def add_air_of_flight(rotors, parts, x, wind, time, fraction, space, lane, out):
    """`add_air` of one flight, in earth axes."""
    sites, north, east, down = space.sites, x[0, lane], x[1, lane], x[2, lane]
    p = between(wind, RATES_FROM, RATES_TO, fraction, lane)
    q = between(wind, RATES_FROM + 1, RATES_TO + 1, fraction, lane)
    r = between(wind, RATES_FROM + 2, RATES_TO + 2, fraction, lane)
    here = local_air(space, lane, time, north, east, down)
    for i in range(3):
        out[i, lane] += here[i]
    for j in range(rotors):
        site, row = SITE_ROWS * j, CG_ROWS + GUST_ROWS * j
        a, b, c = sites[site, lane], sites[site + 1, lane], sites[site + 2, lane]
        there = local_air(space, lane, time, north + a, east + b, down + c)
        turning = cross_product(p, q, r, a, b, c)
        for i in range(3):
            out[row + i, lane] = (there[i] - here[i]) + turning[i]
        for first in (ALONG_X, ALONG_Y):
            a, b, c = sites[site + first, lane], sites[site + first + 1, lane], sites[site + first + 2, lane]
            turning = cross_product(p, q, r, a, b, c)
            for i in range(3):
                slope = (there[3 + i] * a + there[6 + i] * b) + there[9 + i] * c
                out[row + first + i, lane] = slope + turning[i]
    for k in range(parts):
        site, row = SITE_ROWS * rotors + PART_SITE_ROWS * k, CG_ROWS + GUST_ROWS * rotors + PART_ROWS * k
        a, b, c = sites[site, lane], sites[site + 1, lane], sites[site + 2, lane]
        there = local_air(space, lane, time, north + a, east + b, down + c)
        turning = cross_product(p, q, r, a, b, c)
        for i in range(3):
            out[row + i, lane] = (there[i] - here[i]) + turning[i]


@kernel
def between(wind, start, end, fraction, lane):
    """Number of a tick that is linear between its ends."""
    return wind[start, lane] + fraction * (wind[end, lane] - wind[start, lane])


@kernel
def cross_product(p, q, r, a, b, c):
    """(p, q, r) x (a, b, c)."""
    return q * c - r * b, r * a - p * c, p * b - q * a


@kernel
def local_air(space, lane, time, north, east, down):
    """Velocity of the air at a position that its tick does not have yet, and its derivatives.

    Returns
    -------
    tuple of 12 floats
        Velocity NED [m/s], and its derivatives to the north, to the east and downwards, NED each [1/s].
    """
    parameters = space.parameters
    age = time - parameters[START, lane]
    x = north - parameters[DRIFT, lane] * age
    y = east - parameters[DRIFT + 1, lane] * age
    field = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    if parameters[GRIDS, lane] > 0.0:
        field = sampled(space.grids, int(parameters[FIRST_GRID, lane]), int(parameters[GRIDS, lane]),
                        parameters[PERIOD, lane], x, y)  # fmt: skip
    h, v = parameters[HORIZONTAL, lane], parameters[VERTICAL, lane]
    share, growth = share_of_height(parameters, lane, down)
    ahead = (x - parameters[ORIGIN, lane]) * parameters[COSINE, lane]
    ahead += (y - parameters[ORIGIN + 1, lane]) * parameters[SINE, lane]
    ahead -= parameters[DISTANCE, lane]
    front, steepness = front_share(parameters, lane, ahead)
    own = own_gust(space.tables, int(parameters[FIRST_ROW, lane]), int(parameters[ROWS, lane]), ahead)
    w_n, s_n = total_gust(parameters, lane, 0, front, steepness, own[0], own[3])
    w_e, s_e = total_gust(parameters, lane, 1, front, steepness, own[1], own[4])
    w_d, s_d = total_gust(parameters, lane, 2, front, steepness, own[2], own[5])
    c, s = parameters[COSINE, lane], parameters[SINE, lane]
    u_n, u_e, u_d = parameters[DRIFT, lane], parameters[DRIFT + 1, lane], parameters[DRIFT + 2, lane]
    return (
        h * field[0] + w_n + share * u_n,
        h * field[1] + w_e + share * u_e,
        v * field[2] + w_d + share * u_d,
        h * field[3] + c * s_n,
        h * field[4] + c * s_e,
        v * field[5] + c * s_d,
        h * field[6] + s * s_n,
        h * field[7] + s * s_e,
        v * field[8] + s * s_d,
        growth * u_n,
        growth * u_e,
        growth * u_d,
    )


@kernel
def total_gust(parameters, lane, axis, front, steepness, own, own_slope):
    """Velocity of gusts over distance along an axis, and its slope."""
    peak = parameters[PEAK + axis, lane]
    return front * peak + own, steepness * peak + own_slope


@kernel
def share_of_height(parameters, lane, down):
    """Steady wind at a height over that at the reference height, less 1, and its derivative downwards [1/m]."""
    kind = parameters[PROFILE, lane]
    if kind == UNIFORM:
        return 0.0, 0.0
    height, reference = -down - parameters[GROUND, lane], parameters[REFERENCE_HEIGHT, lane]
    shape = parameters[SHAPE, lane]
    if kind == LOGARITHMIC:
        if height <= shape:
            return -1.0, 0.0
        scale = 1.0 / logarithm(reference / shape)
        return logarithm(height / shape) * scale - 1.0, -scale / height
    if height <= 0.0:
        return -1.0, 0.0
    share = power_of(height / reference, shape)
    return share - 1.0, -shape * share / height


@kernel
def front_share(parameters, lane, ahead):
    """Share of the peak of a gust at a distance into it [m], and its slope [1/m]."""
    kind, length = parameters[FRONT, lane], parameters[LENGTH, lane]
    if kind == NO_FRONT or ahead <= 0.0:
        return 0.0, 0.0
    turns = ahead / length if kind == ONE_MINUS_COSINE else 0.5 * ahead / length
    if ahead >= length:
        return (0.0, 0.0) if kind == ONE_MINUS_COSINE else (1.0, 0.0)
    per_metre = turns / ahead
    return 0.5 - 0.5 * cosine_of_turn(turns), 3.141592653589793 * per_metre * sine_of_turn(turns)


@kernel
def own_gust(tables, first, rows, ahead):
    """Velocity of an own gust at a distance into it, NED [m/s], and its slope [1/s]: linear, constant at the ends."""
    if rows == 0:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    last = first + rows - 1
    if not ahead > tables[first, 0]:
        return tables[first, 1], tables[first, 2], tables[first, 3], 0.0, 0.0, 0.0
    if ahead >= tables[last, 0]:
        return tables[last, 1], tables[last, 2], tables[last, 3], 0.0, 0.0, 0.0
    low, high = first, last
    while high - low > 1:
        middle = (low + high) // 2
        if tables[middle, 0] <= ahead:
            low = middle
        else:
            high = middle
    width, into = tables[high, 0] - tables[low, 0], ahead - tables[low, 0]
    n = (tables[high, 1] - tables[low, 1]) / width
    e = (tables[high, 2] - tables[low, 2]) / width
    d = (tables[high, 3] - tables[low, 3]) / width
    return tables[low, 1] + into * n, tables[low, 2] + into * e, tables[low, 3] + into * d, n, e, d
