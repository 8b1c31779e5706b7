"""Where the parts of an aircraft are: plain arrays in body axes (FRD, from the c.g., m)."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sbs_sim.aircraft import Aircraft
from sbs_sim.aircraft.description import Rotor
from sbs_sim.content import ByContent
from sbs_sim.model.frames import hub_axes
from sbs_sim.model.multiblade import blade_matrix

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]

THICKNESS = 0.12  # of a drawn blade, over its chord
QUARTER = 0.25  # of the chord lies ahead of the blade's axis


@dataclass(frozen=True, eq=False)
class Mesh(ByContent):
    """Triangles.

    Attributes
    ----------
    vertices : ndarray, shape (n, 3)
    faces : ndarray of int, shape (m, 3)
    """

    vertices: Array
    faces: IntArray


# --- blades -----------------------------------------------------------------------------------------------------


def blade_poses(rotor: Rotor, azimuth: Array, flap: Array, lag: Array) -> tuple[Array, Array]:
    """Flap hinges and axes of blades (theory.md eqs. 1.5, 2.1, 2.2).

    Parameters
    ----------
    rotor : Rotor
    azimuth, flap, lag : ndarray, shape (n,)
        Of each blade [rad].

    Returns
    -------
    hinges : ndarray, shape (n, 3)
        From the c.g., body axes [m].
    axes : ndarray, shape (n, 3, 3)
        Columns d (along the span), G t (t is the direction of motion) and n (normal to the blade), body axes: a
        right-handed system, since d x n = -G t.
    """
    hub = hub_axes(rotor.shaft_direction)
    up = np.array([0.0, 0.0, -1.0])  # in hub axes
    zero, sense = np.zeros_like(azimuth), rotor.rotation
    radial = np.stack([-np.cos(azimuth), sense * np.sin(azimuth), zero], axis=1)
    motion = np.stack([np.sin(azimuth), sense * np.cos(azimuth), zero], axis=1)
    sine, cosine = np.sin(lag)[:, None], np.cos(lag)[:, None]
    arm, ahead = cosine * radial - sine * motion, sine * radial + cosine * motion
    sine, cosine = np.sin(flap)[:, None], np.cos(flap)[:, None]
    span, normal = cosine * arm + sine * up, -sine * arm + cosine * up
    lag_hinge = rotor.hinge_offset - rotor.flap_hinge_offset
    hinges = rotor.hub + (lag_hinge * radial + rotor.flap_hinge_offset * arm) @ hub.T
    axes = hub @ np.stack([span, sense * ahead, normal], axis=2)
    return hinges, axes


def blade_azimuths(rotor: Rotor, azimuth: float) -> Array:
    """Azimuth of every blade [rad], shape (blades,), of that of the first (theory.md eq. 1.4)."""
    return azimuth + 2 * math.pi / rotor.blades * np.arange(rotor.blades, dtype=float)


def tip_path(rotor: Rotor, flap: Array, magnification: float, count: int) -> Array:
    """Closed curve on which the tips go, lag left out.

    Parameters
    ----------
    rotor : Rotor
    flap : ndarray, shape (blades,)
        Multiblade coordinates [rad].
    magnification : float
        Of the flap angle.
    count : int
        Points of the curve.

    Returns
    -------
    ndarray, shape (count + 1, 3)
        Body axes, from the c.g. [m].
    """
    azimuth = np.linspace(0.0, 2 * math.pi, count + 1)
    # the first row of T is the blade at the azimuth itself; the differential coordinate has no path of its own
    rows = blade_matrix(rotor.blades, azimuth)[:, 0, :]
    if rotor.blades % 2 == 0:
        rows[:, -1] = 0.0
    hinges, axes = blade_poses(rotor, azimuth, magnification * (rows @ flap), np.zeros_like(azimuth))
    return hinges + rotor.blade_length * axes[:, :, 0]


def blade_mesh(rotor: Rotor) -> Mesh:
    """Blade along x from its flap hinge, its motion along y times the sense of rotation, its upper side along z."""
    ends = []
    for along, chord in ((rotor.root_cutout, rotor.chord_at(0.0)), (rotor.blade_length, rotor.chord_at(1.0))):
        lead, trail = QUARTER * chord * rotor.rotation, -(1 - QUARTER) * chord * rotor.rotation
        half = 0.5 * THICKNESS * chord
        ends += [[along, lead, 0.0], [along, lead - 0.4 * (lead - trail), half]]
        ends += [[along, trail, 0.0], [along, lead - 0.4 * (lead - trail), -half]]
    sides = [face for i in range(4) for face in ([i, (i + 1) % 4, 4 + i], [(i + 1) % 4, 4 + (i + 1) % 4, 4 + i])]
    caps = [[0, 2, 1], [0, 3, 2], [4, 5, 6], [4, 6, 7]]
    return Mesh(np.array(ends), np.array(sides + caps))


# --- the rest of the aircraft -----------------------------------------------------------------------------------


def sector_mesh(inner: float, outer: float, width: float) -> Mesh:
    """Part of a flat ring in the xy plane, `width` rad wide, about the x axis."""
    angle = np.linspace(-0.5 * width, 0.5 * width, 4)
    circle = np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=1)
    first = np.arange(3)
    faces = [np.column_stack([first, first + 4, first + 5]), np.column_stack([first, first + 5, first + 1])]
    return Mesh(np.concatenate([inner * circle, outer * circle]), np.concatenate(faces))


def size(aircraft: Aircraft) -> float:
    """Distance from the c.g. to the furthest tip [m]."""
    return max(float(np.linalg.norm(rotor.hub)) + rotor.radius for rotor in aircraft.rotors)


def inflow_cells(rings: int, sectors: int) -> tuple[Array, Array]:
    """Edges of rings over the radius, shape (rings + 1,), and azimuths of the middles of the sectors [rad]."""
    return np.linspace(0.1, 1.0, rings + 1), 2 * math.pi / sectors * np.arange(sectors, dtype=float)


def inflow_velocity(rotor: Rotor, inflow: Array, radius: Array, azimuth: Array) -> Array:
    """Induced velocity down through the disc [m/s] (theory.md section 4.2, Inflow.msg).

    Parameters
    ----------
    rotor : Rotor
    inflow : ndarray, shape (3,)
        lambda0, lambdas, lambdac.
    radius, azimuth : ndarray of one shape
        Over R, and in rad.
    """
    uniform, sine, cosine = inflow
    speed = rotor.induced_power_factor * rotor.speed
    return speed * rotor.radius * (uniform + radius * (sine * np.sin(azimuth) + cosine * np.cos(azimuth)))
