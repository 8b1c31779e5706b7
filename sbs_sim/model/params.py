"""What the compiled model knows of an aircraft: one tuple of flat arrays.

Rows and columns have names here; `Aircraft.params` fills them. Compiled code reads them by these constants,
which the compiler folds.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]

# air: columns
DENSITY, INVERSE_VISCOSITY, GRAVITY, PLATE_X, PLATE_Y, PLATE_Z = range(6)
AIR_SIZE = 6

# switches: columns; all 0 or 1
LEAD_LAG, CYCLIC_INFLOW, COMPLETE_COUPLING, COMPLETE_HUB_MOMENT = range(4)
SWITCH_COUNT = 4

# body: mass [kg], first moment about the c.g. [kg m], inertia row by row [kg m^2]
MASS, FIRST_MOMENT, INERTIA = 0, 1, 4
BODY_SIZE = 13

# rotor: columns, SI units
(
    SPEED,  # Omega
    RADIUS,  # R
    SENSE,  # G, +1 counter-clockwise seen from above
    HINGE,  # e_0
    LAG_HINGE,  # e_L = e_0 - e_F
    FLAP_HINGE,  # e_F
    BLADE_MASS,  # m_b
    S1,  # m_b r_G
    A1,  # second moment of the blade in the blade equations
    A1_HUB,  # second moment of the blade in the hub loads
    FLAP_SPRING,
    LAG_SPRING,
    LAG_DAMPING,
    PITCH_FLAP,
    PITCH_LAG,
    COS_PHASE,  # swashplate phase
    SIN_PHASE,
    DUCT,  # a_w
    HUB_X,
    HUB_Y,
    HUB_Z,
    COS_SPACING,  # angle between neighbouring blades, 2 pi / N_b
    SIN_SPACING,
    INVERSE_BLADES,  # 1 / N_b
    INVERSE_TIP_SPEED,
    LOAD_SCALE,  # of C_T: 1 / (rho pi R^2 (Omega R)^2), 0 in vacuum
) = range(26)
ROTOR_SIZE = 26

# Blades are worked on in blocks of one rotor, as lanes of vector registers; their elements in chunks, and a blade is
# filled up with elements without area to whole registers. Reynolds numbers are placed in a table some knots at a time.
LANES = 4
CHUNK = 64
REGISTER = 8
STRIP_ROWS = 6
KNOT_GROUP = 8

# element: rows of a chunk of elements along a blade, CHUNK values each
SPAN, CHORD, HALF_AREA, LIFT_FRACTION, TWIST = range(0, 5 * CHUNK, CHUNK)
ELEMENT_SIZE = 5 * CHUNK

# of a Runge-Kutta method
MOST_STAGES = 6

# loads: columns of one rotor's outputs; forces and moments in body axes about the hub centre
THRUST, TORQUE, FORCE, MOMENT = 0, 1, 2, 5
LOAD_SIZE = 8


class Params(NamedTuple):
    """The aircraft as arrays, with its fidelity switches.

    Attributes
    ----------
    air : ndarray, shape (AIR_SIZE,)
    body : ndarray, shape (BODY_SIZE,)
        The rigid part: the fuselage without blades (`complete` coupling) or the whole aircraft (`paper`).
    switches : ndarray of int64, shape (SWITCH_COUNT,)
    first_blade, first_block : ndarray of int64, shape (n_rotors + 1,)
        Index of each rotor's first blade and block of blades among all; the last entry is their number.
    rotor : ndarray, shape (n_rotors, ROTOR_SIZE)
    axes : ndarray, shape (n_rotors, 3, 3)
        Hub axes as columns in body components.
    element : ndarray, shape (n_rotors, n_chunks, ELEMENT_SIZE)
        Distance from the flap hinge [m], chord [m], c ds / 2 [m^2], lift fraction (tip loss), twist [rad].
    cells : ndarray, shape (n_cells, 8)
        Bilinear coefficients of every airfoil table cell, see `sbs_sim.model.airfoil.cells`.
    grid_index : ndarray of int64, shape (n_rotors, 4)
        First row in `cells`, the number of cells along angle and Reynolds number of the rotor's airfoil, and the number
        of elements of a blade, filled up to whole registers.
    grid : ndarray, shape (n_rotors, 2 + 2 n)
        First angle [rad], inverse angle step [1/rad], then of each Reynolds cell the inverse width and, after those of
        all cells, the lower knot over the width; zeros fill up whole groups of KNOT_GROUP.
    """

    air: Array
    body: Array
    switches: IntArray
    first_blade: IntArray
    first_block: IntArray
    rotor: Array
    axes: Array
    element: Array
    cells: Array
    grid_index: IntArray
    grid: Array


# blade: rows of the work of a block of blades, LANES values each; six-vectors are force and moment, body axes, about
# the c.g., and take six rows
(
    IS_BLADE,  # 1 in lanes with a blade, 0 in those that fill up a block; set once
    COSINE,  # of the azimuth
    SINE,
    FLAP_ANGLE,
    FLAP_RATE,
    LAG_ANGLE,
    LAG_RATE,
    PITCH,  # at the root
    INFLOW_GRADIENT,  # of the induced velocity along the blade [1/s]
    COS_FLAP,
    SIN_FLAP,
    COS_LAG,
    SIN_LAG,
    COS_SPAN,  # of the azimuth of the line from lag to flap hinge
    SIN_SPAN,
    UT0,  # velocity of the sections relative to the air, see `sbs_sim.model.section`
    UT1,
    UP0,
    UP1,
    FORCE_N,
    FORCE_T,
    MOMENT_N,
    MOMENT_T,
    FLAP_MOMENT,  # about the hinges, without accelerations
    LAG_MOMENT,
    INVERSE_A2,
    FLAP_ACCELERATION,
    LAG_ACCELERATION,
    COS_N,  # of a multiple of the azimuth
    SIN_N,
) = range(0, 30 * LANES, LANES)
FLAP_COUPLING, LAG_COUPLING, BASE_LOAD = range(30 * LANES, 48 * LANES, 6 * LANES)  # of unit beta'', xi''; without them
PAPER_MOMENT = 48 * LANES  # moment about the hub in the paper's reading without its inertial part, body axes
FLAP_AXIS = 51 * LANES  # unit vector f, body axes
BLADE_SIZE = 54 * LANES

# inertia: columns of the mass, first moment and six second moments of one rotor's blades about the c.g.
INERTIA_SIZE = 10


class Work(NamedTuple):
    """Memory of the compiled model, made once by `make_work`; nothing in it outlives a call but the outputs.

    Attributes
    ----------
    blade : ndarray, shape (n_blocks, BLADE_SIZE)
    rotor_inertia : ndarray, shape (n_rotors, INERTIA_SIZE)
    loads : ndarray, shape (n_rotors, LOAD_SIZE)
        Output: thrust [N], torque [N m], hub force [N] and moment [N m] of the last derivative.
    aero : ndarray, shape (n_rotors, 3)
        Thrust [N] and the sine and cosine moments [N m] that drive the inflow.
    hub_flow : ndarray, shape (n_rotors, 3)
        Velocity of the hub relative to the air in hub axes [m/s].
    matrix : ndarray, shape (6, 6)
    vector : ndarray, shape (6,)
        Linear system of the body; after the solution: specific force of the c.g. [m/s^2], om' [rad/s^2].
    stages : ndarray, shape (1 + MOST_STAGES, state size)
        State at a stage of a step, and the derivatives at its stages.
    psi : ndarray, shape (n_rotors,)
        Azimuths of a stage [rad].
    wind : ndarray, shape (3,)
        Wind of a stage, NED [m/s].
    strip : ndarray, shape (LANES, STRIP_ROWS * CHUNK)
        Section values along each blade of a block, row by row.
    cell : ndarray of int32, shape (LANES, CHUNK)
        Rows of `Params.cells`.
    """

    blade: Array
    rotor_inertia: Array
    loads: Array
    aero: Array
    hub_flow: Array
    matrix: Array
    vector: Array
    stages: Array
    psi: Array
    wind: Array
    strip: Array
    cell: NDArray[np.int32]


def make_work(params: Params) -> Work:
    """Work arrays for an aircraft; one set per thread."""
    rotors = len(params.rotor)
    blades = int(params.first_blade[-1])
    size = 13 + 4 * blades + 3 * rotors
    return Work(
        blade=_make_blades(params),
        rotor_inertia=np.zeros((rotors, INERTIA_SIZE)),
        loads=np.zeros((rotors, LOAD_SIZE)),
        aero=np.zeros((rotors, 3)),
        hub_flow=np.zeros((rotors, 3)),
        matrix=np.zeros((6, 6)),
        vector=np.zeros(6),
        stages=np.zeros((1 + MOST_STAGES, size)),
        psi=np.zeros(rotors),
        wind=np.zeros(3),
        strip=np.zeros((LANES, STRIP_ROWS * CHUNK)),
        cell=np.zeros((LANES, CHUNK), dtype=np.int32),
    )


def _make_blades(params: Params) -> Array:
    """Work rows of all blocks, with what is constant in them."""
    work = np.zeros((int(params.first_block[-1]), BLADE_SIZE))
    for j in range(len(params.rotor)):
        lanes = work[params.first_block[j] : params.first_block[j + 1], IS_BLADE : IS_BLADE + LANES].ravel()
        lanes[: params.first_blade[j + 1] - params.first_blade[j]] = 1.0
        work[params.first_block[j] : params.first_block[j + 1], IS_BLADE : IS_BLADE + LANES] = lanes.reshape(-1, LANES)
    return work
