"""Air that is not the same everywhere: what is added to the wind at the c.g., at each rotor and at each part.

Turbulence as a field in space, wind that grows with height, fronts of gusts that the aircraft flies through, and the
rotation of the air that military specifications make of turbulence. `add_air` samples all of it where the aircraft is
at a stage of a step (theory.md section 7.8). It works flight by flight with plain numbers, so that its bits do not
depend on the number of lanes.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sbs_sim.lanes import Vector, as_lanes, as_quads, as_records, transposed, zeros_like
from sbs_sim.model import state as S
from sbs_sim.model.air_elements import pose_of, set_blades, set_element_sites, turn_elements
from sbs_sim.model.air_field import WEIGHTS, sampled, sampled_value
from sbs_sim.model.air_rows import ALONG_X, ALONG_Y, CG_ROWS, PART_ROWS
from sbs_sim.model.frames import rotation
from sbs_sim.model.kernel import entry, kernel
from sbs_sim.model.real_functions import cosine_of_turn, logarithm, power_of, sine_of_turn
from sbs_sim.model.records import GUST_ROWS, Model, Space, aligned, no_space, state_size
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
ELEMENTS = 25  # 1 where the air is sampled at every blade element
SPACE_SIZE = 26

UNIFORM, LOGARITHMIC, POWER = range(3)  # profiles
NO_FRONT, ONE_MINUS_COSINE, RAMP = range(3)  # shapes of gusts over distance
AT_POINT, BY_NORTH, BY_EAST, BY_DOWN = range(4)  # velocity at a point, and its derivatives
FOUND = 4
SITE_ROWS, PART_SITE_ROWS = 9, 3  # offset, and the hub's x and y axis; offset


def make_space(parameters: Array, grids: Array, table: Array) -> Space:
    """Air of one flight; memory comes with `joined_spaces`."""
    return no_space(1)._replace(parameters=parameters[:, np.newaxis], grids=grids, tables=table)


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
    parts, elements = len(model.surfaces) + len(model.fuselages), (0, 0)
    if any(space.parameters[ELEMENTS, 0] for space in spaces):
        elements = len(model.blades), model.elements.shape[1]
    mass = model.blades["mass"]
    flights = np.where(mass > 0.0, np.minimum(np.arange(mass.shape[-1]), n - 1), -1).reshape(-1, mass.shape[-1])
    sites = aligned((SITE_ROWS * len(model.rotors) + PART_SITE_ROWS * (parts + 2), n), float)
    return Space(
        parameters,
        grids[0] if len(grids) == 1 else np.concatenate(grids),
        tables[0] if len(tables) == 1 else np.concatenate(tables),
        sites,
        aligned((FOUND + WEIGHTS, 4), float),
        aligned((*elements, 3, mass.shape[-1]), float),
        flights.astype(np.int64),
        aligned((state_size(model) + 1, n), float),
        aligned((len(model.rotors), n), float),
    )


@entry
def air_in_space(model, x, psi, wind, time, space, out):
    """`add_air` for one instant at the beginning of a tick."""
    add_air(model, x, psi, wind, time, 0.0, space, out)


@kernel
def add_air(model, x, psi, wind, time, fraction, space, out):
    """Add to the velocity of the air at the c.g. what belongs to its position, and set what differs elsewhere.

    Parameters
    ----------
    model : Model
    x : ndarray, shape (size, n)
        Simulation states.
    psi : ndarray, shape (n_rotors, n)
        Azimuths of the rotors, see `sbs_sim.model.dynamics.derivative` [rad].
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
    if space.elements.shape[0] > 0:
        set_elements(model, x, psi, time, space, out)


@kernel
def set_elements(model, x, psi, time, space, out):
    """Set the air at every blade element."""
    set_blades(model, x, psi, space)
    for r in range(space.elements.shape[0]):
        basis = pose_of(model, space, r)
        set_element_sites(model, space, r, basis)
        for i in range(space.elements.shape[1]):
            for lane in range(space.elements.shape[3]):
                sample_element(x, time, space, space.elements[r, i], lane, space.flights[r, lane])
        turn_elements(model, space, out, r, basis)


@kernel
def sample_element(x, time, space, element, lane, flight):
    """Put the velocity of the air of a flight at an element, less that at the c.g., where its position was.

    What fills up a quad, which has no flight, gets that of its neighbour.
    """
    if flight < 0:
        for k in range(3):
            element[k, lane] = element[k, lane - 1]
        return
    found, last = space.found, space.sites.shape[0] - 3
    north, east = x[0, flight] + element[0, lane], x[1, flight] + element[1, lane]
    set_local_air(space, flight, time, north, east, x[2, flight] + element[2, lane], False)
    for k in range(3):
        element[k, lane] = found[AT_POINT, k] - space.sites[last + k, flight]


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
    sites, found, north, east, down = space.sites, space.found, x[0, lane], x[1, lane], x[2, lane]
    p = between(wind, RATES_FROM, RATES_TO, fraction, lane)
    q = between(wind, RATES_FROM + 1, RATES_TO + 1, fraction, lane)
    r = between(wind, RATES_FROM + 2, RATES_TO + 2, fraction, lane)
    for point in range(rotors + parts + 1):  # of which the last is the c.g.
        is_hub = point < rotors
        site, row = site_of(point, rotors), CG_ROWS + row_of(point, rotors)
        a, b, c = sites[site, lane], sites[site + 1, lane], sites[site + 2, lane]
        set_local_air(space, lane, time, north + a, east + b, down + c, is_hub)
        if point == rotors + parts:
            break
        turning = cross_product(p, q, r, a, b, c)
        for i in range(3):
            out[row + i, lane] = found[AT_POINT, i] + turning[i]
        if is_hub:
            for first in range(ALONG_X, ALONG_Y + 1, ALONG_Y - ALONG_X):
                a, b, c = sites[site + first, lane], sites[site + first + 1, lane], sites[site + first + 2, lane]
                turning = cross_product(p, q, r, a, b, c)
                for i in range(3):
                    slope = found[BY_NORTH, i] * a + found[BY_EAST, i] * b
                    out[row + first + i, lane] = (slope + found[BY_DOWN, i] * c) + turning[i]
    last = sites.shape[0] - 3
    for i in range(3):
        out[i, lane] += found[AT_POINT, i]
        sites[last + i, lane] = found[AT_POINT, i]
    for point in range(rotors + parts):
        row = CG_ROWS + row_of(point, rotors)
        for i in range(3):
            out[row + i, lane] -= found[AT_POINT, i]


@kernel
def site_of(point, rotors):
    """First row of `Space.sites` of a rotor, a part, or behind them the c.g."""
    hubs = min(point, rotors)
    return SITE_ROWS * hubs + PART_SITE_ROWS * (point - hubs)


@kernel
def row_of(point, rotors):
    """First row of the air of a rotor or part, behind those of the c.g."""
    hubs = min(point, rotors)
    return GUST_ROWS * hubs + PART_ROWS * (point - hubs)


@kernel
def between(wind, start, end, fraction, lane):
    """Number of a tick that is linear between its ends."""
    return wind[start, lane] + fraction * (wind[end, lane] - wind[start, lane])


@kernel
def cross_product(p, q, r, a, b, c):
    """(p, q, r) x (a, b, c)."""
    return q * c - r * b, r * a - p * c, p * b - q * a


@kernel
def set_local_air(space, lane, time, north, east, down, sloped):
    """Set velocity and derivatives of the air at a position that its tick does not have yet, in `space.found`.

    Velocity NED [m/s], and its derivatives to the north, to the east and downwards, NED each [1/s]; without meaning
    where they are not asked for, by `sloped`.
    """
    parameters, found = space.parameters, space.found
    age = time - parameters[START, lane]
    x = north - parameters[DRIFT, lane] * age
    y = east - parameters[DRIFT + 1, lane] * age
    rows = as_quads(found)
    for k in range(FOUND):
        rows[k] = zeros_like(rows[k])
    if parameters[GRIDS, lane] > 0.0:
        set_field(space, lane, x, y, sloped)
    if parameters[PROFILE, lane] != UNIFORM:
        share, growth = share_of_height(parameters, lane, down)
        for i in range(3):
            found[AT_POINT, i] += share * parameters[DRIFT + i, lane]
            found[BY_DOWN, i] = growth * parameters[DRIFT + i, lane]
    if parameters[FRONT, lane] != NO_FRONT or parameters[ROWS, lane] > 0.0:
        add_gusts(space, lane, x, y)


@kernel
def set_field(space, lane, x, y, sloped):
    """Set what turbulence makes of the air at a place in the field [m], and its derivatives if they are asked for."""
    parameters, found, grids = space.parameters, space.found, as_quads(space.grids)
    rows, memory = as_quads(found), found[FOUND:]
    begin, levels, period = int(parameters[FIRST_GRID, lane]), int(parameters[GRIDS, lane]), parameters[PERIOD, lane]
    count = 1
    if sloped:
        count = BY_DOWN
        rows[AT_POINT], rows[BY_NORTH], rows[BY_EAST] = sampled(grids, begin, levels, period, x, y, memory)
    else:
        rows[AT_POINT] = sampled_value(grids, begin, levels, period, x, y, memory)
    h, v = parameters[HORIZONTAL, lane], parameters[VERTICAL, lane]
    for k in range(count):
        found[k, 0] *= h
        found[k, 1] *= h
        found[k, 2] *= v


@kernel
def add_gusts(space, lane, x, y):
    """Add the gusts over distance at a place in the air [m]."""
    parameters, found = space.parameters, space.found
    c, s = parameters[COSINE, lane], parameters[SINE, lane]
    ahead = (x - parameters[ORIGIN, lane]) * c + (y - parameters[ORIGIN + 1, lane]) * s
    ahead -= parameters[DISTANCE, lane]
    front, steepness = front_share(parameters, lane, ahead)
    own = own_gust(space.tables, int(parameters[FIRST_ROW, lane]), int(parameters[ROWS, lane]), ahead)
    for i in range(3):
        peak = parameters[PEAK + i, lane]
        slope = steepness * peak + own[3 + i]
        found[AT_POINT, i] += front * peak + own[i]
        found[BY_NORTH, i] += c * slope
        found[BY_EAST, i] += s * slope


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
