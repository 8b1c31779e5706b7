"""Data and memory of the compiled model: records with named fields, lane by lane.

A record holds values of n aircraft side by side, see `sbs_sim.lanes.memory`. What belongs to blades has `width` lanes:
n where the lanes are flights, more where a single flight has its blades for lanes.
"""

import math
from collections.abc import Sequence
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sbs_sim.lanes.bundles import bundled
from sbs_sim.model.state import BODY_SIZE, CONTACT_STATES, ROW, UNSEEN_NAMES, WAKE_NAMES

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]
LANES, VECTOR, MATRIX, INTEGER = (), (3,), (3, 3), None
LINE = 64  # bytes of a cache line
OTHERS, WASH_ROWS = 3, 4  # of `Work.wash`: row of the flow through the disc, and all rows
NOISE, LOAD, RING_ROWS = range(3)  # of `Work.ring`: rows, and how many there are
QUAD = 4  # blades that are summed first, see `sbs_sim.lanes.memory`

AIR = {"density": LANES, "gravity": LANES, "plate_areas": VECTOR}
# the rigid part, about the c.g.: the fuselage without blades (`complete` coupling), or all of the aircraft (`paper`)
BODY = {
    "mass": LANES,
    "first_moment": VECTOR,
    "inertia": MATRIX,
    # of a stand, along and about the axes of the body; 1 for what is free, 0 for what is locked
    "free": VECTOR,
    "free_turn": VECTOR,
    "stand_mass": VECTOR,
    "spring": VECTOR,
    "turn_spring": VECTOR,
    "damping": VECTOR,
    "turn_damping": VECTOR,
}
SWITCHES = {
    "lead_lag": INTEGER,
    "cyclic_inflow": INTEGER,
    "complete_coupling": INTEGER,
    "complete_hub_moment": INTEGER,
    "axial_dampers": INTEGER,  # 1 where a rotor has them
    "lag_stops": INTEGER,
    "offsets": INTEGER,  # 1 where quarter chord or mass of a blade are not on the pitch axis
    "section_options": INTEGER,  # 1 where a rotor has oblique drag, 2 where one has Prandtl's tip loss
    "stand": INTEGER,
    "scheduled": INTEGER,  # 1 where shares in swashplate angles change with the airspeed
    "ducts": INTEGER,  # 1 where a rotor has one with a fixed exit
    "teetering": INTEGER,  # 1 where a rotor is
    "wash": INTEGER,  # 1 where something adds to the inflow of a rotor, see `sbs_sim.model.dynamics.set_wash`
    "unsteady_airfoil": INTEGER,  # 1 where a rotor has one
    "section_states": INTEGER,  # of a section: 0, 1 of late separation, or 4 with vortices
    "late_stall": INTEGER,  # 1 where they are met, 0 for steady sections
    "ground_effect": INTEGER,  # see `sbs_sim.model.ground_effect`
    "interference": INTEGER,  # 1 where rotors meet the wash of one another
    "ring": INTEGER,  # 1 where the thrust of a rotor fluctuates in the vortex ring
    "contact": INTEGER,  # 1 for an aircraft that can stand on the ground
}
# the ground: a plane
GROUND = {
    "down": VECTOR,  # unit vector into it, NED
    "first": VECTOR,  # unit vectors along it
    "second": VECTOR,
    "depth": LANES,  # of the plane below the origin, along `down`
    "reach": LANES,  # height of the c.g. from which on no point that could touch it does [m]
}
# a point that touches it: see `sbs_sim.model.contact`
CONTACT = {
    "position": VECTOR,  # from the c.g.
    "rolling": VECTOR,  # direction in which a wheel rolls
    "stiffness": LANES,
    "damping": LANES,
    "inverse_onset": LANES,  # 1/m
    "side_stiffness": LANES,
    "side_damping": LANES,
    "friction": LANES,
    "rolling_friction": LANES,
    "is_wheel": INTEGER,
    "state": INTEGER,  # index of the first of its two deflections
}
ROTOR = {
    "rotor_speed": LANES,  # Omega; 0 where a drive turns the rotor, whose speed is a state
    "inflow_speed": LANES,  # Omega of the file: the scale of the inflow ratios
    "gear": LANES,  # speed over that of the drive; 0 without one
    "radius": LANES,  # R
    "sense": LANES,  # G, +1 counter-clockwise seen from above
    "hub": VECTOR,
    "axes": MATRIX,  # hub axes as columns in body components
    "duct_expansion": LANES,  # a_w, of a duct with a fixed exit its exit area over that of the disc
    "duct_turning": LANES,  # t
    "ram_recovery": LANES,
    "inverse_lip_stall": LANES,  # 0 where the lip never stalls
    "lip_arm": LANES,  # height above the disc at which the ram drag acts [m]
    "momentum_scale": LANES,  # pi R^2 (Omega R)^2 [m^4/s^2]
    "inverse_tip_speed": LANES,
    "coefficient_scale": LANES,  # of C_T: 1 / (rho pi R^2 (Omega R)^2), 0 in vacuum
    "inverse_blades": LANES,  # 1 / N_b
    "flap_rest": LANES,  # the coning of a teetering rotor
    "ring_unsteadiness": LANES,  # standard deviation of the thrust in the vortex ring over its mean
    "ring_gain": LANES,  # inflow of the blades over the thrust coefficient that it takes, over kappa_i
    "teetering": INTEGER,
    "measured_descent": INTEGER,  # 1 where the inflow in descent is that of measurements
    "duct": INTEGER,  # 1 for a duct with a fixed exit
    "blades": INTEGER,  # N_b
    "harmonics": INTEGER,
    "first_quad": INTEGER,
    "quads": INTEGER,
    "flap": INTEGER,  # indices in the state of the first coordinate
    "flap_rate": INTEGER,
    "lag": INTEGER,
    "lag_rate": INTEGER,
    "inflow": INTEGER,
    "wake": INTEGER,  # -1 without an unsteady airfoil
    "drive": INTEGER,  # index of the drive, -1 without one
}
BLADE = {
    "rotor_speed": LANES,
    "inflow_speed": LANES,  # kappa_i Omega of the file
    "duct_turning": LANES,  # t
    "sense": LANES,
    "radius": LANES,
    "hub": VECTOR,
    "axes": MATRIX,
    "hinge_offset": LANES,  # e_0
    "lag_hinge_offset": LANES,  # e_L = e_0 - e_F
    "flap_hinge_offset": LANES,  # e_F
    "mass": LANES,  # m_b
    "first_moment": LANES,  # S_1
    "second_moment": LANES,  # A_1 in the equations of the blade
    "hub_second_moment": LANES,  # A_1 in the loads on the hub
    "inverse_second_moment": LANES,  # 0 for what fills up a quad
    "flap_spring": LANES,
    "lag_spring": LANES,
    "flap_rest": LANES,  # angles at which the springs exert no moment
    "lag_rest": LANES,
    "lag_damping": LANES,
    "damper_damping": LANES,  # of an axial damper [N s/m]
    "damper_a": LANES,  # its linkage [m]
    "damper_b": LANES,
    "damper_c": LANES,
    "damper_d": LANES,
    "damper_r": LANES,
    "lag_stop_first": LANES,  # angles beyond which the blade meets the stops [rad]
    "lag_stop_last": LANES,
    "lag_stop_spring": LANES,
    "lag_stop_damping": LANES,
    "axis_height": LANES,  # of the pitch axis along n over the flap hinge
    "chord_first": LANES,  # moments of the mass at zero pitch: along the chord, and normal to it
    "normal_first": LANES,
    "chord_product": LANES,
    "normal_product": LANES,
    "chord_second": LANES,
    "mixed_second": LANES,
    "normal_second": LANES,
    "pitch_flap_coupling": LANES,
    "pitch_lag_coupling": LANES,
    "cos_phase": LANES,  # of the swashplate
    "sin_phase": LANES,
    "cos_azimuth_offset": LANES,  # of the azimuth behind the first blade
    "sin_azimuth_offset": LANES,
    "alternation": LANES,  # of the differential coordinate: +1, -1 from blade to blade, 0 where there is none
    "lead_lag": LANES,  # 1, or 0 where the blade does not lag and for what fills up a quad
    "tip_blades": LANES,  # N_b of a rotor with Prandtl's tip loss, else 0
    "element_width": LANES,  # over R
    "wake_span": LANES,  # of the section whose circulation follows the flow, from the flap hinge [m]
    "wake_pitch": LANES,  # its twist, less the angle without lift [rad]
    "inverse_wake_radius": LANES,  # 1/m
    "tip_speed": LANES,  # Omega R of the file
    "inverse_wake_speed": LANES,  # 1 / (Omega R)
    "inverse_sound_speed": LANES,
    "wake_slow_share": LANES,  # A_1, A_2 of the indicial function; 0 without an unsteady airfoil
    "wake_fast_share": LANES,
    "wake_slow_rate": LANES,  # 2 b_1 / c, 2 b_2 / c [1/m]; 0 also for what fills up a quad
    "wake_fast_rate": LANES,
    "late_stall": LANES,  # 1 for late separation
    "stall_vortex": LANES,  # 1 for a vortex with it, whose times are in semi-chords
    "inverse_pressure_lag": LANES,
    "inverse_vortex_lag": LANES,
    "vortex_passage": LANES,
    "oblique_drag": LANES,  # 1 for drag along the local flow, the one along the span included
    "first_alpha": LANES,  # of the airfoil table [rad]
    "inverse_alpha_step": LANES,
    "alpha_cells": LANES,  # cells of the table along the angle
    "min_number": LANES,
    "max_number": LANES,
    "quad": INTEGER,
    "starts_quad": INTEGER,  # 1 for the first of a quad, 0 for those that follow it
    "elements": INTEGER,
    "harmonics": INTEGER,
    "separation_first": INTEGER,  # row of the first section among those of `Work.separation`, and of each kind there
    "separation_stride": INTEGER,  # rows from a section to the next
}
DRIVE = {
    "speed": LANES,  # of the first rotor in the file [rad/s]
    "inertia": LANES,  # I_t
    "momentum": VECTOR,  # I_t a, body axes
    "drag": LANES,  # torque of the stopped engine, over the speed [N m s]
    "max_torque": LANES,
    "max_power": LANES,
    "inverse_lag": LANES,  # 1/s
    "throttle": LANES,
    "set_point": LANES,  # rad/s
    "proportional_gain": LANES,
    "integral_gain": LANES,  # 1/s
    "torque_constant": LANES,  # N m / A
    "inverse_torque_constant": LANES,
    "conductance": LANES,  # 1 / Ohm
    "full_voltage": LANES,
    "voltage_drop": LANES,  # from the full battery to the empty one
    "inverse_capacity": LANES,  # 1 / (A s)
    "engine": INTEGER,  # see `sbs_sim.model.drive`
    "free_wheel": INTEGER,
    "speed_index": INTEGER,  # in the state; -1 where the drive has none
    "torque_index": INTEGER,
    "governor_index": INTEGER,
    "unseen_index": INTEGER,
    "command_index": INTEGER,  # of throttle and set point behind the swashplate angles; -1 where no control acts
}
# a drive at work: column of its speed in the mass matrix, inertia, torques, acceleration
SHAFT = {"force": VECTOR, "moment": VECTOR, "inverse_inertia": LANES, "torque": LANES, "acceleration": LANES}
# a share in an angle of a swashplate that changes with the airspeed, see `sbs_sim.model.dynamics.set_commands`
SCHEDULE = {
    "first": LANES,  # factor, or angle [rad], up to the first airspeed
    "target": INTEGER,  # index of the angle among the commands
    "source": INTEGER,  # of the control that the factor is of; -1 for an angle
}
# two rotors, of which one (the target) meets the wash of the other: see `sbs_sim.model.interference`
PAIR = {
    "flow_scale": LANES,  # mean induced velocity over the tip speed of the target for lambda0 of the source
    "blade_scale": LANES,  # times kappa_i of the source over that of the target
    "cells": LANES,  # of the table along each component of the skew
    "first_row": LANES,  # of the table
    "source": INTEGER,
    "target": INTEGER,
}
ELEMENT = {
    "span": LANES,  # from the flap hinge [m]
    "chord": LANES,
    "half_area": LANES,  # c ds / 2 [m^2]
    "lift_factor": LANES,
    "twist": LANES,
    "first_row": LANES,  # of the airfoil table
    "airfoil": LANES,  # number of the airfoil from the root outwards
    "number_scale": LANES,  # of the airfoil table over the airspeed: c / nu of Reynolds numbers, 1 / a of Mach numbers
    "separation_rate": LANES,  # of the lag of separation over the airspeed [1/m]
    "inverse_semi_chord": LANES,  # 1/m
    "offset_along": LANES,  # of the quarter chord from the pitch axis at zero pitch, and normal to it
    "offset_up": LANES,
    "cos_sweep": LANES,
    "sin_sweep": LANES,
}
# parts with tables in `shapes`: see `sbs_sim.model.surfaces`
SURFACE = {
    "position": VECTOR,  # from the c.g.
    "down": VECTOR,  # unit vector against the lift
    "half_area": LANES,  # half of the area, times the factor of the dynamic pressure
    "incidence": LANES,
    "wash_down": LANES,  # at the first point of its curve
    "wash_aft": LANES,
    "first_alpha": LANES,  # [rad]
    "inverse_alpha_step": LANES,
    "alpha_cells": LANES,
    "first_row": LANES,
    "rotor": INTEGER,  # whose wash it meets, -1 for none
    "is_scheduled": INTEGER,
    "command_index": INTEGER,  # of its incidence behind the swashplate angles; -1 where no control acts
}
FUSELAGE = {
    "position": VECTOR,
    "wash_down": LANES,
    "wash_aft": LANES,
    "first_alpha": LANES,
    "inverse_alpha_step": LANES,
    "alpha_cells": LANES,
    "first_beta": LANES,
    "inverse_beta_step": LANES,
    "beta_cells": LANES,
    "first_row": LANES,
    "rotor": INTEGER,
}
# sums over the blades of a quad, in the order of `sbs_sim.model.dynamics.add_to_sums`
SUMS = {
    "thrust": LANES,
    "sine_moment": LANES,  # of air loads about the hub, times the sine of the azimuth
    "cosine_moment": LANES,
    "mass": LANES,
    "first_moment": VECTOR,
    "second_moment": (6,),  # Int x x, y y, z z, x y, y z, z x dm
    "force": VECTOR,  # known loads b_k less c Q / A of the hinges, eq. (5.8)
    "moment": VECTOR,
    # sum of c c^T / A over the hinges, eq. (5.8): force by force, moment by force, moment by moment
    "hinge_mass": (6,),  # xx, yy, zz, xy, yz, zx
    "hinge_coupling": MATRIX,
    "hinge_inertia": (6,),
}
HARMONIC = {"flap_cosine": LANES, "flap_sine": LANES, "lag_cosine": LANES, "lag_sine": LANES}
# of a teetering rotor: the sums of c_beta, of c_beta / A_1 and of Q_beta / A_1
CONING = {"force": VECTOR, "moment": VECTOR, "force_share": VECTOR, "moment_share": VECTOR, "flap": LANES}
CONING |= {"inverse": LANES}  # sum of 1 / A_1, of blades with offsets
MEANS = {"flap": LANES, "lag": LANES, "flap_differential": LANES, "lag_differential": LANES}
# loads on the hub without those of the locked blades, about the c.g., and the moment in the paper's reading
HUB = {"force": VECTOR, "moment": VECTOR, "paper_moment": VECTOR, "pitch_power": LANES}
# terms of a blade that are kept until the body's accelerations are known
TERMS = {
    "cosine": LANES,
    "sine": LANES,
    "flap_column_force": VECTOR,  # c_beta
    "flap_column_moment": VECTOR,
    "lag_column_force": VECTOR,  # c_xi
    "lag_column_moment": VECTOR,
    "flap_moment": LANES,  # Q_beta
    "lag_moment": LANES,  # Q_xi
    "inverse_lag_inertia": LANES,  # 1 / A_2, 0 where the blade does not lag
    "known_force": VECTOR,  # b_k
    "known_moment": VECTOR,
    "flap_acceleration": LANES,
    "lag_acceleration": LANES,
    "paper_moment": VECTOR,
    "flap_axis": VECTOR,
    "u_t_hinge": LANES,
    "u_t_slope": LANES,
    "u_p_hinge": LANES,
    "u_p_slope": LANES,
    "pitch": LANES,
    "outward_force": LANES,  # along the span, of oblique drag
    "wake_gradient": LANES,  # of the wash of the wake along the radius [1/s]
    "slow_rate": LANES,  # of the parts of the circulation
    "fast_rate": LANES,
}
# of a blade with offsets, beside TERMS, see `sbs_sim.model.offset`; c_beta, Q_beta and A_1 are without what lag takes
PITCHING = {
    "slope": LANES,  # of the pitch over the azimuth
    "column_force": VECTOR,  # of pitch
    "column_moment": VECTOR,
    "moment": LANES,  # about the pitch axis
    "flap_coupling": LANES,  # inertia of flap with pitch, of lag with pitch, of pitch
    "lag_coupling": LANES,
    "inertia": LANES,
    "lag_share": LANES,  # xi'' that a unit of beta'' takes
    "inverse_flap_inertia": LANES,
}
# sums over the blades of a quad of what a turn of the shaft does by their pitch, see `sbs_sim.model.drive.add_pitching`
PITCH_SUMS = {
    "force": VECTOR,  # columns, the hinges eliminated
    "moment": VECTOR,
    "inertia": LANES,
    "torque": LANES,
    "coning": LANES,
    "locked_force": VECTOR,  # with locked hinges
    "locked_moment": VECTOR,
    "locked_inertia": LANES,
}
STRIP = {"airspeed": LANES, "number": LANES, "fraction": LANES, "row": LANES, "tip_factor": LANES}
ACCELERATION = {"specific_force": VECTOR, "angular": VECTOR}  # a_g and om', body axes
LOADS = {"thrust": LANES, "torque": LANES, "force": VECTOR, "moment": VECTOR}  # body axes, about the hub centre
THRUST, TORQUE, FORCE, MOMENT = 0, 1, 2, 5  # the same as columns
LOAD_SIZE = 8
GUST_ROWS = 9  # of the air of each rotor, behind that of the c.g., see `sbs_sim.model.air`


def dtype_of(fields: dict[str, Any], n: int) -> np.dtype[Any]:
    """Structured type of records of n lanes."""
    return _dtype_of(tuple(fields.items()), n)


@cache
def _dtype_of(fields: tuple[tuple[str, Any], ...], n: int) -> np.dtype[Any]:
    return np.dtype([(name, np.int64) if kind is INTEGER else (name, np.float64, (*kind, n)) for name, kind in fields])


def aligned(shape: Any, dtype: Any) -> NDArray[Any]:
    """Zeros that begin at a cache line."""
    dtype, shape = np.dtype(dtype), shape if isinstance(shape, tuple) else (shape,)
    size = math.prod(shape) * dtype.itemsize
    raw = np.zeros(size + LINE, dtype=np.uint8)
    address: int = raw.__array_interface__["data"][0]
    return np.ndarray(shape, dtype, raw, -address % LINE)


def records(fields: dict[str, Any], shape: Any, n: int) -> NDArray[Any]:
    """Zero records of n lanes."""
    return aligned(shape, dtype_of(fields, n))


@bundled
class StateIndices(NamedTuple):
    """Indices of the values of the rotor that each quad belongs to, for `sbs_sim.lanes.spread`.

    Attributes
    ----------
    azimuth : ndarray of int64, shape (quads,)
        Index of the rotor.
    swash : ndarray of int64, shape (3, quads)
        In the order of `sbs_sim.model.state.SWASHPLATE_NAMES`.
    flap, flap_rate, lag, lag_rate : ndarray of int64, shape (coordinates, quads)
        In the state: collective coordinate, cosine and sine of each harmonic, differential coordinate. Those that the
        rotor does not have point to the zero behind the state.
    inflow : ndarray of int64, shape (3, quads)
        In the order of `sbs_sim.model.state.INFLOW_NAMES`.
    wake_slow, wake_fast : ndarray of int64, shape (coordinates, quads)
        As those of flap.
    gust : ndarray of int64, shape (9, quads)
        Among the rows of the air, see `sbs_sim.model.air`.
    """

    azimuth: IntArray
    swash: IntArray
    flap: IntArray
    flap_rate: IntArray
    lag: IntArray
    lag_rate: IntArray
    inflow: IntArray
    wake_slow: IntArray
    wake_fast: IntArray
    gust: IntArray


@bundled
class Model(NamedTuple):
    """Aircraft of one structure, as many as there are lanes.

    Attributes
    ----------
    switches, air, body : structured ndarray, shape (1,)
    rotors : structured ndarray, shape (n_rotors,)
    drives : structured ndarray, shape (n_drives,)
    blades : structured ndarray, shape (registers,)
        Blades side by side, or one blade of all flights.
    indices : StateIndices
    elements : structured ndarray, shape (tables, elements)
    knots : ndarray, shape (registers, knots, width)
        Reynolds or Mach numbers of the airfoil tables but for the first and the last; infinite where there are fewer.
    table : ndarray, shape (cells, 16)
        Of every cell of the airfoil tables the coefficients of x^0 to x^3, each for lift and drag and for their slopes
        over the Reynolds or Mach number, see `sbs_sim.model.airfoil.cells`.
    stall : ndarray, shape (registers, airfoils, 10, k, width)
        See `Aircraft.stall_table`.
    surfaces, fuselages : structured ndarray, shapes (surfaces,), (fuselages,)
        Lifting surfaces, and a fuselage with tables or none.
    ramps : ndarray, shape (surfaces + fuselages, points, 5, n)
        Their curves of straight lines, see `sbs_sim.model.surfaces`.
    shapes : ndarray, shape (cells, 16)
        Their coefficients over angles, as `table`.
    schedules : structured ndarray, shape (schedules,)
        What changes swashplate angles with the airspeed.
    bends : ndarray, shape (schedules, points, 2, n)
        Airspeeds [m/s], and the change of the slope of each there.
    ground : structured ndarray, shape (1,)
    contacts : structured ndarray, shape (points,)
        Skids and wheels, where the aircraft stands on the ground.
    pairs : structured ndarray, shape (pairs,)
        Rotors that meet the wash of one another.
    influences : ndarray, shape (cells, 16)
        Their coefficients over the skew of the wake, see `sbs_sim.aircraft.interference`.
    """

    switches: NDArray[Any]
    air: NDArray[Any]
    body: NDArray[Any]
    rotors: NDArray[Any]
    drives: NDArray[Any]
    blades: NDArray[Any]
    indices: StateIndices
    elements: NDArray[Any]
    knots: Array
    table: Array
    stall: Array
    surfaces: NDArray[Any]
    fuselages: NDArray[Any]
    ramps: Array
    shapes: Array
    schedules: NDArray[Any]
    bends: Array
    ground: NDArray[Any]
    contacts: NDArray[Any]
    pairs: NDArray[Any]
    influences: Array


@bundled
class Work(NamedTuple):
    """Memory of a derivative.

    Attributes
    ----------
    state : ndarray, shape (size + 1, n)
        The state whose derivative is taken, and a zero.
    terms : structured ndarray, shape (registers,)
    sums, means, hubs : structured ndarray, shape (quads,)
        A register of eight blades writes two of them, where the second may belong to no rotor.
    totals : structured ndarray, shape (n_rotors + 1,)
        Sums over each rotor, and over all.
    harmonics : structured ndarray, shape (harmonics, quads)
    acceleration : structured ndarray, shape (1,)
        Of the body: specific force of the c.g. [m/s^2] and om' [rad/s^2].
    acceleration_rows : ndarray, shape (6, n)
        The same numbers.
    flow : structured ndarray, shape (n_rotors,)
    strip : structured ndarray, shape (elements,)
    loads : structured ndarray, shape (n_rotors,)
        Loads of the rotors, where they were asked for.
    load_rows : ndarray, shape (8 n_rotors, n)
        The same numbers.
    span : ndarray of int64, shape (2,)
        First register of blades whose terms are computed, and the one behind the last; those of the others are kept.
        All of them, except while Jacobians change the states of one rotor only.
    turning_rotors, turning_blades : structured ndarray, shapes (n_rotors,), (registers,)
        Of an aircraft with drives copies of the model's, for the speeds of the present state; else empty.
    turning : ndarray, shape (3, n_rotors, n)
        There speeds [rad/s], azimuths [rad] and angular accelerations [rad/s^2] of the rotors.
    shafts : structured ndarray, shape (n_drives,)
    coning : structured ndarray, shape (quads,)
        Of an aircraft with teetering rotors, else empty, as the next.
    coning_change : ndarray, shape (n_rotors, n)
    wash : ndarray, shape (4, n_rotors, n)
        What others add to the inflow of each rotor, as a part of it: uniform, sine and cosine part for its blades, over
        kappa_i Omega R, in the order of `sbs_sim.model.state.INFLOW_NAMES`; and what other rotors add to the flow
        through its disc, over Omega R. Of an aircraft without such, empty.
    ring : ndarray, shape (2, n_rotors, n)
        Noise of each rotor's vortex ring, zero but in a flight, and what it takes of the thrust coefficient. Of an
        aircraft whose thrust does not fluctuate, empty.
    contact : ndarray, shape (2, n_points, n)
        Rates of the deflections of what touches the ground [m/s].
    commands : ndarray, shape (3 n_rows, n)
        Swashplate angles at the present airspeed, where they change with it; else empty.
    pitching : structured ndarray, shape (registers,)
        Of blades with offsets, else empty.
    pitch_sums : structured ndarray, shape (quads,)
        Of such blades that a drive turns, else empty.
    separation, separation_rates : ndarray, shape (rows, width)
        What `sbs_sim.model.state.SECTION_NAMES` says of sections with late separation, one kind after the other, and
        the rates; else empty.
    separation_states, separation_state_rates : ndarray, shape (section states, n)
        The same memory.
    gusts : ndarray, shape (registers, elements, 3, width)
        `Space.elements`.
    """

    state: Array
    terms: NDArray[Any]
    sums: NDArray[Any]
    means: NDArray[Any]
    hubs: NDArray[Any]
    totals: NDArray[Any]
    harmonics: NDArray[Any]
    acceleration: NDArray[Any]
    acceleration_rows: Array
    flow: NDArray[Any]
    strip: NDArray[Any]
    loads: NDArray[Any]
    load_rows: Array
    span: IntArray
    turning_rotors: NDArray[Any]
    turning_blades: NDArray[Any]
    turning: Array
    shafts: NDArray[Any]
    coning: NDArray[Any]
    coning_change: Array
    wash: Array
    ring: Array
    contact: Array
    commands: Array
    pitching: NDArray[Any]
    pitch_sums: NDArray[Any]
    separation: Array
    separation_rates: Array
    separation_states: Array
    separation_state_rates: Array
    gusts: Array


def separation_count(model: Model) -> int:
    """States of sections with room for late separation: those of all blades, in eights of two quads."""
    quads = int(sum(-(-int(blades) // QUAD) for blades in model.rotors["blades"]))
    sections = -(-quads // 2) * 2 * QUAD * model.elements.shape[1]
    return int(model.switches["section_states"][0]) * sections


def state_size(model: Model) -> int:
    """Numbers in the state of one aircraft: of body, flap, lag and their rates, inflow, wakes, drives, contact."""
    drives = sum(int((model.drives[name] >= 0).sum()) for name in ("speed_index", "torque_index", "governor_index"))
    unseen = len(UNSEEN_NAMES) * len(model.drives)
    contacts = CONTACT_STATES * len(model.contacts)
    wakes = len(WAKE_NAMES) * int(model.rotors["blades"][model.rotors["wake"] >= 0].sum())
    rotors = int(4 * model.rotors["blades"].sum() + 3 * len(model.rotors)) + wakes
    return BODY_SIZE + rotors + drives + unseen + contacts + separation_count(model)


def make_work(model: Model) -> Work:
    """Memory for aircraft of a structure; one for each thread."""
    n = model.air["density"].shape[-1]
    width = model.blades["rotor_speed"].shape[-1]
    rotors, quads = model.rotors, model.indices.azimuth.size  # those that fill up the last register too
    size = state_size(model)
    acceleration_rows = aligned((6, n), float)
    load_rows = aligned((LOAD_SIZE * len(rotors), n), float)
    turning = len(model.drives) > 0
    separations = aligned((separation_count(model), n), float), aligned((separation_count(model), n), float)
    teetering, offsets = (bool(model.switches[name][0]) for name in ("teetering", "offsets"))
    return Work(
        state=aligned((size + 1, n), float),
        terms=records(TERMS, len(model.blades), width),
        sums=records(SUMS, quads, n),
        means=records(MEANS, quads, n),
        hubs=records(HUB, quads, n),
        totals=records(SUMS, len(rotors) + 1, n),
        harmonics=records(HARMONIC, (max(1, int(rotors["harmonics"].max())), quads), n),
        acceleration=acceleration_rows.reshape(-1).view(dtype_of(ACCELERATION, n)),
        acceleration_rows=acceleration_rows,
        flow=records({"velocity": VECTOR}, len(rotors), n),
        strip=records(STRIP, model.elements.shape[1], width),
        loads=load_rows.reshape(-1).view(dtype_of(LOADS, n)),
        load_rows=load_rows,
        span=np.array([0, len(model.blades)]),
        turning_rotors=_copied(rotors if turning else rotors[:0]),
        turning_blades=_copied(model.blades if turning else model.blades[:0]),
        turning=aligned((3, len(rotors) if turning else 0, n), float),
        shafts=records(SHAFT, len(model.drives), n),
        coning=records(CONING, quads if teetering else 0, n),
        coning_change=aligned((len(rotors) if teetering else 0, n), float),
        wash=aligned((WASH_ROWS, len(rotors) if model.switches["wash"][0] else 0, n), float),
        ring=aligned((RING_ROWS, len(rotors) if model.switches["ring"][0] else 0, n), float),
        contact=aligned((CONTACT_STATES, len(model.contacts), n), float),
        commands=aligned((_command_count(model), n), float),
        pitching=records(PITCHING, len(model.blades) if offsets else 0, width),
        pitch_sums=records(PITCH_SUMS, quads if offsets and turning else 0, n),
        separation=separations[0].reshape(-1, width),
        separation_rates=separations[1].reshape(-1, width),
        separation_states=separations[0],
        separation_state_rates=separations[1],
        gusts=aligned((0, 0, 3, width), float),
    )


def _command_count(model: Model) -> int:
    """Numbers that controls command, where a schedule needs memory for them; the scheduled controls are the last."""
    return int(max(model.schedules["source"].max(), _last_command(model))) + ROW if len(model.schedules) else 0


def _last_command(model: Model) -> int:
    """Index of the last row of commands but for those of scheduled controls."""
    others = [*model.drives["command_index"].tolist(), *model.surfaces["command_index"].tolist()]
    return max([ROW * (len(model.rotors) - 1), *others])


def _copied(array: NDArray[Any]) -> NDArray[Any]:
    made = aligned(array.shape, array.dtype)
    made[:] = array
    return made


@bundled
class Exponential(NamedTuple):
    """Coefficients and memory of the exponential method, in blocks of coupled states.

    A register holds one state of all flights, or several states of a single one.

    Attributes
    ----------
    states, block_positions : ndarray of int64, shape (k,)
        Indices of the rotors' states in the simulation state, and in the blocks.
    sizes, starts : ndarray of int64, shape (blocks,)
        Number of states of each block, and the position of its first one.
    registers : ndarray of int64, shape (blocks + 1,)
        First register of each block.
    matrices : ndarray, shape (10, numbers, width)
        See `sbs_sim.model.exponential.coefficients`; for each register the columns of its block one after the other.
    begin, end : ndarray, shape (positions, n)
        States at the beginning of a step, and at a stage.
    begin_registers, end_registers : ndarray, shape (registers, width)
        The same memory.
    slopes : ndarray, shape (4, positions, n)
        Derivatives at the stages.
    """

    states: IntArray
    block_positions: IntArray
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
        Indices of the states of each block.
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
        states=_joined(blocks),
        block_positions=_joined(within),
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
    """Columns of all blocks, cut into registers of `each` states of every flight."""
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


@bundled
class Space(NamedTuple):
    """Air that is not the same everywhere, see `sbs_sim.model.air`; of air that is, all is empty.

    Attributes
    ----------
    parameters : ndarray, shape (SPACE_SIZE, n)
    grids : ndarray, shape (m, SIDE + BESIDE, SIDE + BESIDE, 4)
        Turbulence, see `sbs_sim.model.air_field`; each flight has some of them, in order.
    tables : ndarray, shape (m, 4)
        Own gusts: distance [m], and velocity there, NED [m/s]; each flight has some rows of them.
    sites : ndarray, shape (rows, n)
        Memory: where hubs and parts are, and how the hubs' axes lie, NED; behind them the c.g., zeros, and the velocity
        of its air [m/s].
    found : ndarray, shape (FOUND + WEIGHTS, 4)
        Memory: velocity and derivatives at a point, and what `sbs_sim.model.air_field` weighs those around it by.
    elements : ndarray, shape (registers, elements, 3, width)
        Memory: where blade elements are, NED, and then their air, see `sbs_sim.model.air_rows.ElementGusts`. Empty
        where the air is not sampled there.
    flights : ndarray of int64, shape (registers, width)
        Number of the flight that a blade belongs to; -1 for what fills up a quad.
    state, azimuths : ndarray, shapes (size + 1, n), (n_rotors, n)
        Memory: state with a zero behind it, azimuths of the rotors [rad].
    """

    parameters: Array
    grids: Array
    tables: Array
    sites: Array
    found: Array
    elements: Array
    flights: IntArray
    state: Array
    azimuths: Array


def no_space(n: int) -> Space:
    """Air that is the same everywhere, of n flights."""
    nothing, none = aligned((0, n), float), np.zeros((0, 4))
    elements, flights = np.zeros((0, 0, 3, n)), np.zeros((0, n), dtype=np.int64)
    return Space(nothing, none.reshape(0, 1, 1, 4), none, nothing, none, elements, flights, nothing, nothing)


@bundled
class Tick(NamedTuple):
    """Memory of a tick.

    Attributes
    ----------
    stage : ndarray, shape (size, n)
        State at a stage of a step.
    slopes : ndarray, shape (6, size, n)
        Derivatives at its stages.
    psi : ndarray, shape (n_rotors, n)
    wind : ndarray, shape (3, n), or (air_rows(...), n)
    space : Space
    lowest_point : ndarray, shape (1, n)
        Down coordinate of the lowest point of the aircraft [m].
    last : ndarray, shape (size, n)
        The state that was not plausible and ended a flight.
    done : ndarray of int64, shape (n,)
        Steps made in the tick.
    exponential : Exponential
        Without blocks for other methods.
    """

    stage: Array
    slopes: Array
    psi: Array
    wind: Array
    space: Space
    lowest_point: Array
    last: Array
    done: IntArray
    exponential: Exponential


def make_tick(work: Work, stages: int, exponential: Exponential) -> Tick:
    """Memory of a tick, for a method with that number of stages."""
    size, n = work.state.shape[0] - 1, work.state.shape[1]
    rotors = len(work.flow)
    return Tick(
        stage=aligned((size, n), float),
        slopes=aligned((stages, size, n), float),
        psi=aligned((rotors, n), float),
        wind=aligned((3, n), float),
        space=no_space(n),
        lowest_point=aligned((1, n), float),
        last=aligned((size, n), float),
        done=np.zeros(n, dtype=np.int64),
        exponential=exponential,
    )
