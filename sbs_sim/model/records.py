"""What the compiled model knows of aircraft, and its memory: records with names, lane by lane.

A record holds values of n aircraft side by side, see `sbs_sim.lanes.memory`. What belongs to blades has `width` lanes:
n where the lanes are flights, more where a single flight has its blades for lanes.
"""

import math
from collections.abc import Sequence
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]
LANES, VECTOR, MATRIX, WHOLE = (), (3,), (3, 3), None
LINE = 64  # bytes of a cache line
QUAD = 4  # blades that are summed up first, see `sbs_sim.lanes.memory`

AIR = {"density": LANES, "inverse_viscosity": LANES, "gravity": LANES, "plate_areas": VECTOR}
# the rigid part: the fuselage without blades (`complete` coupling), or the whole aircraft (`paper`); about the c.g.
BODY = {"mass": LANES, "first_moment": VECTOR, "inertia": MATRIX}
SWITCHES = {"lead_lag": WHOLE, "cyclic_inflow": WHOLE, "complete_coupling": WHOLE, "complete_hub_moment": WHOLE}
ROTOR = {
    "speed": LANES,  # Omega
    "radius": LANES,  # R
    "sense": LANES,  # G, +1 counter-clockwise seen from above
    "hub": VECTOR,
    "axes": MATRIX,  # hub axes as columns in body components
    "duct": LANES,  # a_w
    "inverse_tip_speed": LANES,
    "load_scale": LANES,  # of C_T: 1 / (rho pi R^2 (Omega R)^2), 0 in vacuum
    "inverse_blades": LANES,  # 1 / N_b
    "blades": WHOLE,  # N_b
    "harmonics": WHOLE,
    "first_quad": WHOLE,
    "quads": WHOLE,
    "flap": WHOLE,  # places of the first coordinate in the state
    "flap_rate": WHOLE,
    "lag": WHOLE,
    "lag_rate": WHOLE,
    "inflow": WHOLE,
}
BLADE = {
    "speed": LANES,
    "sense": LANES,
    "radius": LANES,
    "hub": VECTOR,
    "axes": MATRIX,
    "hinge": LANES,  # e_0
    "lag_hinge": LANES,  # e_L = e_0 - e_F
    "flap_hinge": LANES,  # e_F
    "mass": LANES,  # m_b
    "first": LANES,  # S_1
    "second": LANES,  # A_1 in the equations of the blade
    "second_hub": LANES,  # A_1 in the loads on the hub
    "inverse_second": LANES,  # 0 for what fills up a quad
    "flap_spring": LANES,
    "lag_spring": LANES,
    "lag_damping": LANES,
    "pitch_flap": LANES,
    "pitch_lag": LANES,
    "cos_phase": LANES,  # of the swashplate
    "sin_phase": LANES,
    "cos_place": LANES,  # of the azimuth behind the first blade
    "sin_place": LANES,
    "alternation": LANES,  # of the differential coordinate: +1, -1 from blade to blade, 0 where there is none
    "lead_lag": LANES,  # 1, or 0 where the blade does not lag and for what fills up a quad
    "first_angle": LANES,  # of the airfoil table [rad]
    "inverse_step": LANES,
    "columns": LANES,  # cells of the table along the angle
    "first_row": LANES,
    "least_reynolds": LANES,
    "largest_reynolds": LANES,
    "quad": WHOLE,
    "begins": WHOLE,  # 1 for the first of a quad, 0 for those that follow it
    "elements": WHOLE,
    "harmonics": WHOLE,
}
ELEMENT = {
    "span": LANES,  # from the flap hinge [m]
    "chord": LANES,
    "half_area": LANES,  # c ds / 2 [m^2]
    "lift_share": LANES,
    "twist": LANES,
}
# sums over the blades of a quad, in the order in which they are added up
SUMS = {
    "thrust": LANES,
    "sine_moment": LANES,
    "cosine_moment": LANES,
    "mass": LANES,
    "first_moment": VECTOR,
    "second_moment": (6,),  # Int x x, y y, z z, x y, y z, z x dm
    "force": VECTOR,  # of the known loads, what the hinges take off subtracted
    "moment": VECTOR,
    "triangle": (21,),  # what the hinges take off the mass matrix, lower triangle row by row
}
HARMONIC = {"flap_cosine": LANES, "flap_sine": LANES, "lag_cosine": LANES, "lag_sine": LANES}
MEANS = {"flap": LANES, "lag": LANES, "flap_differential": LANES, "lag_differential": LANES}
HUB = {"force": VECTOR, "moment": VECTOR, "paper": VECTOR}  # paper: the moment in the paper's reading
# what is kept of a blade until the body's accelerations are known
TERMS = {
    "cosine": LANES,
    "sine": LANES,
    "flap_force": VECTOR,  # c_beta
    "flap_arm": VECTOR,
    "lag_force": VECTOR,  # c_xi
    "lag_arm": VECTOR,
    "flap_moment": LANES,  # Q_beta
    "lag_moment": LANES,
    "inverse_a2": LANES,
    "force": VECTOR,  # b_k
    "moment": VECTOR,
    "flap_acceleration": LANES,
    "lag_acceleration": LANES,
    "paper_moment": VECTOR,
    "flap_axis": VECTOR,
    "ut0": LANES,
    "ut1": LANES,
    "up0": LANES,
    "up1": LANES,
    "pitch": LANES,
}
STRIP = {"speed": LANES, "reynolds": LANES, "fraction": LANES, "row": LANES}
LOADS = {"thrust": LANES, "torque": LANES, "force": VECTOR, "moment": VECTOR}  # body axes, about the hub centre
THRUST, TORQUE, FORCE, MOMENT = 0, 1, 2, 5  # the same as columns
LOAD_SIZE = 8


def dtype_of(fields: dict[str, Any], n: int) -> np.dtype[Any]:
    """Structured type of records of n lanes."""
    return _dtype_of(tuple(fields.items()), n)


@cache
def _dtype_of(fields: tuple[tuple[str, Any], ...], n: int) -> np.dtype[Any]:
    return np.dtype([(name, np.int64) if kind is WHOLE else (name, np.float64, (*kind, n)) for name, kind in fields])


def aligned(shape: Any, dtype: Any) -> NDArray[Any]:
    """Zeros that begin where a cache line does."""
    dtype, whole = np.dtype(dtype), shape if isinstance(shape, tuple) else (shape,)
    size = math.prod(whole) * dtype.itemsize
    raw = np.zeros(size + LINE, dtype=np.uint8)
    place: int = raw.__array_interface__["data"][0]
    return np.ndarray(whole, dtype, raw, -place % LINE)


def records(fields: dict[str, Any], shape: Any, n: int) -> NDArray[Any]:
    """Zero records of n lanes."""
    return aligned(shape, dtype_of(fields, n))


class Places(NamedTuple):
    """Where values that belong to rotors stand, by quads: for `sbs_sim.lanes.spread`.

    Attributes
    ----------
    azimuth : ndarray of int64, shape (quads,)
        Number of the rotor.
    swash : ndarray of int64, shape (3, quads)
    flap, flap_rate, lag, lag_rate : ndarray of int64, shape (coordinates, quads)
        Of the state: collective coordinate, cosine and sine of each harmonic, differential coordinate. What a rotor
        does not have is the zero behind the state.
    inflow : ndarray of int64, shape (3, quads)
    """

    azimuth: IntArray
    swash: IntArray
    flap: IntArray
    flap_rate: IntArray
    lag: IntArray
    lag_rate: IntArray
    inflow: IntArray


class Model(NamedTuple):
    """Aircraft of one structure, as many as there are lanes.

    Attributes
    ----------
    switches, air, body : structured ndarray, shape (1,)
    rotors : structured ndarray, shape (n_rotors,)
    blades : structured ndarray, shape (registers,)
        Blades side by side, or one blade of all flights.
    places : Places
    elements : structured ndarray, shape (tables, elements)
    knots : ndarray, shape (registers, knots, width)
        Reynolds numbers of the airfoil table but for the first and the last; infinite where there are fewer.
    table : ndarray, shape (cells, 16)
        Of every cell of the airfoil tables the coefficients of x^0 to x^3, each for lift and drag and for their slopes
        over the Reynolds number, see `sbs_sim.model.airfoil.cells`.
    stall : ndarray, shape (registers, 3, k, width)
        Reynolds numbers, increasing, and the highest and lowest angle of attack [rad] at which the airfoil of a blade
        is not stalled; filled up with copies of the last.
    """

    switches: NDArray[Any]
    air: NDArray[Any]
    body: NDArray[Any]
    rotors: NDArray[Any]
    blades: NDArray[Any]
    places: Places
    elements: NDArray[Any]
    knots: Array
    table: Array
    stall: Array


class Work(NamedTuple):
    """Memory of a derivative.

    Attributes
    ----------
    state : ndarray, shape (size + 1, n)
        The state that the derivative is asked for, and a zero.
    terms : structured ndarray, shape (registers,)
    sums, means, hubs : structured ndarray, shape (quads,)
        A register of eight blades writes two of them, where the second may belong to no rotor.
    totals : structured ndarray, shape (n_rotors + 1,)
        Sums over each rotor, and over all.
    harmonics : structured ndarray, shape (harmonics, quads)
    vector : ndarray, shape (6, n)
        Known side of the body's equations; afterwards specific force of the c.g. and om'.
    flow : structured ndarray, shape (n_rotors,)
    strip : structured ndarray, shape (elements,)
    loads : structured ndarray, shape (n_rotors,)
        Loads of the rotors, where they were asked for.
    load_rows : ndarray, shape (8 n_rotors, n)
        The same numbers.
    span : ndarray of int64, shape (2,)
        First register of blades whose terms are worked out, and the one behind the last; those of the others stay what
        they were. All of them, unless somebody sets it for a while.
    """

    state: Array
    terms: NDArray[Any]
    sums: NDArray[Any]
    means: NDArray[Any]
    hubs: NDArray[Any]
    totals: NDArray[Any]
    harmonics: NDArray[Any]
    vector: Array
    flow: NDArray[Any]
    strip: NDArray[Any]
    loads: NDArray[Any]
    load_rows: Array
    span: IntArray


def state_size(model: Model) -> int:
    """Numbers in the state of one aircraft: of the body, of blades by flap, lag and their rates, and of the inflow."""
    return 13 + int(4 * model.rotors["blades"].sum() + 3 * len(model.rotors))


def make_work(model: Model) -> Work:
    """Memory for aircraft of a structure; one for each thread."""
    n = model.air["density"].shape[-1]
    width = model.blades["speed"].shape[-1]
    rotors, quads = model.rotors, model.places.azimuth.size  # those that fill up the last register too
    size = state_size(model)
    load_rows = aligned((LOAD_SIZE * len(rotors), n), float)
    return Work(
        state=aligned((size + 1, n), float),
        terms=records(TERMS, len(model.blades), width),
        sums=records(SUMS, quads, n),
        means=records(MEANS, quads, n),
        hubs=records(HUB, quads, n),
        totals=records(SUMS, len(rotors) + 1, n),
        harmonics=records(HARMONIC, (max(1, int(rotors["harmonics"].max())), quads), n),
        vector=aligned((6, n), float),
        flow=records({"velocity": VECTOR}, len(rotors), n),
        strip=records(STRIP, model.elements.shape[1], width),
        loads=load_rows.reshape(-1).view(dtype_of(LOADS, n)),
        load_rows=load_rows,
        span=np.array([0, len(model.blades)]),
    )


class Exponential(NamedTuple):
    """Coefficients and memory of the exponential method, in blocks of states that belong together.

    A register holds one state of all flights, or several states of a single one.

    Attributes
    ----------
    places, positions : ndarray of int64, shape (k,)
        Of the rotors' states: in the state, and in the blocks.
    sizes, starts : ndarray of int64, shape (blocks,)
        States of each block, and the position of its first one.
    registers : ndarray of int64, shape (blocks + 1,)
        The first of each block.
    matrices : ndarray, shape (10, numbers, width)
        See `sbs_sim.model.exponential.coefficients`; for each register the columns of its block one after the other.
    begin, end : ndarray, shape (positions, n)
        States at the beginning of a step, and at a stage.
    begin_registers, end_registers : ndarray, shape (registers, width)
        The same memory.
    slopes : ndarray, shape (4, positions, n)
        Derivatives at the stages.
    """

    places: IntArray
    positions: IntArray
    sizes: IntArray
    starts: IntArray
    registers: IntArray
    matrices: Array
    begin: Array
    end: Array
    begin_registers: Array
    end_registers: Array
    slopes: Array


def make_exponential(
    blocks: Sequence[Sequence[int]], coefficients: Sequence[Sequence[Array]], width: int
) -> Exponential:
    """Coefficients of flights side by side, `width` of them, or of a single one.

    Parameters
    ----------
    blocks : sequence of sequences of int
        Places of states that belong together.
    coefficients : sequence of sequences of ndarray, shape (10, m, m)
        Of each flight and each block.
    width : int
        Lanes of a register.
    """
    n = len(coefficients)
    each = width // n  # states in a register
    sizes = np.array([len(block) for block in blocks], dtype=np.int64)
    registers = np.cumsum([0, *(-(-sizes // each))]).astype(np.int64)
    starts = registers[:-1] * each
    within = [start + np.arange(size) for start, size in zip(starts, sizes, strict=True)]
    padded = int(registers[-1]) * each
    begin, end = aligned((padded, n), float), aligned((padded, n), float)
    return Exponential(
        places=_joined(blocks),
        positions=_joined(within),
        sizes=sizes,
        starts=starts,
        registers=registers,
        matrices=_by_registers(coefficients, each),
        begin=begin,
        end=end,
        begin_registers=begin.reshape(-1, width),
        end_registers=end.reshape(-1, width),
        slopes=aligned((4, padded, n), float),
    )


def _joined(parts: Sequence[Any]) -> IntArray:
    return np.concatenate([np.zeros(0, dtype=np.int64), *parts]).astype(np.int64)


def _by_registers(coefficients: Sequence[Sequence[Array]], each: int) -> Array:
    """Columns of all blocks, cut into registers of so many states of each flight."""
    found = []
    for own in zip(*coefficients, strict=True):
        columns = np.stack(own, axis=-1).transpose(0, 2, 1, 3)  # coefficient, column, row, flight
        count, m, _, n = columns.shape
        rows = np.zeros((count, m, -(-m // each) * each, n))
        rows[:, :, :m] = columns
        found.append(rows.reshape(count, m, -1, each * n).transpose(0, 2, 1, 3).reshape(count, -1, each * n))
    made = aligned((10, sum(part.shape[1] for part in found), each * len(coefficients)), float)
    if found:
        made[:] = np.concatenate(found, axis=1)
    return made


class Tick(NamedTuple):
    """Memory of a tick.

    Attributes
    ----------
    stage : ndarray, shape (size, n)
        State at a stage of a step.
    slopes : ndarray, shape (6, size, n)
        Derivatives at its stages.
    psi : ndarray, shape (n_rotors, n)
    wind : ndarray, shape (3, n)
    deepest : ndarray, shape (1, n)
        Down coordinate of the lowest point [m].
    last : ndarray, shape (size, n)
        The state that ended a flight.
    done : ndarray of int64, shape (n,)
        Steps of the tick.
    exponential : Exponential
        Without blocks for other methods.
    """

    stage: Array
    slopes: Array
    psi: Array
    wind: Array
    deepest: Array
    last: Array
    done: IntArray
    exponential: Exponential


def make_tick(work: Work, stages: int, exponential: Exponential) -> Tick:
    """Memory of ticks of a method with so many stages."""
    size, n = work.state.shape[0] - 1, work.state.shape[1]
    rotors = len(work.flow)
    return Tick(
        stage=aligned((size, n), float),
        slopes=aligned((stages, size, n), float),
        psi=aligned((rotors, n), float),
        wind=aligned((3, n), float),
        deepest=aligned((1, n), float),
        last=aligned((size, n), float),
        done=np.zeros(n, dtype=np.int64),
        exponential=exponential,
    )
