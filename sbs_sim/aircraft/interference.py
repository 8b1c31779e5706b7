"""Tables of what rotors add to the flow through one another's discs (theory.md section 6.5).

The wake of a rotor is the skewed semi-infinite vortex cylinder of an evenly loaded disc: R. P. Coleman, A. M. Feingold,
C. W. Stempin, NACA ARR L5E10, 1945; W. Castles, J. H. De Leeuw, NACA Report 1184, 1954. In hover it contracts.
"""

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sbs_sim.aircraft.description import Rotor
from sbs_sim.model import records as R
from sbs_sim.model.frames import hub_axes

if TYPE_CHECKING:
    from sbs_sim.aircraft import Aircraft

Array = NDArray[np.float64]

CELLS = 24  # of the grid along each of the two components of the skew, from -1 to 1
RIM_POINTS, SOURCE_POINTS = 48, 64  # on the rim of the disc that meets the wake, and on that of the one that sheds it
RINGS, SPOKES = 4, 16  # inside
NEAR = 1e-3  # R - r . e over R, below which their difference would lose digits
CLOSEST = 1e-9  # radii: of a point to a filament, whose potential is a logarithm
DIGITS = 12  # of geometries that are the same


class Pair(NamedTuple):
    """How a rotor lies to one whose wake it may meet, in hub axes of the latter (z down the wake) and over its radius.

    Attributes
    ----------
    hub : tuple, length 3
    axes : tuple, length 9
        Hub axes as columns, row by row.
    radius : float
    expansion : float
        a_w of the one that sheds the wake.
    """

    hub: tuple[float, ...]
    axes: tuple[float, ...]
    radius: float
    expansion: float


def pair_of(source: Rotor, target: Rotor) -> Pair:
    """Geometry of two rotors."""
    to_source, scale = hub_axes(source.shaft_direction).T, 1.0 / source.radius
    hub = to_source @ (np.asarray(target.hub) - np.asarray(source.hub)) * scale
    axes = to_source @ hub_axes(target.shaft_direction)
    rounded = [tuple((np.round(values.ravel(), DIGITS) + 0.0).tolist()) for values in (hub, axes)]
    return Pair(rounded[0], rounded[1], round(target.radius * scale, DIGITS), source.wake_expansion)


def directions(x: Array, y: Array, is_up: bool) -> Array:
    """Unit vectors along wakes with skews x, y, shape (m, 3): mu_x and mu_y over V_T + |lambda|, lambda up or down."""
    squared = x * x + y * y
    edgewise, axial = -2.0 / (1.0 + squared), (1.0 - squared) / (1.0 + squared)
    return np.stack([edgewise * x, edgewise * y, -axial if is_up else axial], axis=-1)


def influence(pair: Pair, along: Array) -> Array:
    """Mean and gradients of the flow through a disc for a unit of mean induced velocity of the rotor with the wake.

    The flow is the curl of the vector potential of the wake, A = -(1/2 pi) Oint log(R - r . e) dl over the rim that
    sheds it, R = |r|, e along the wake. By Stokes' theorem its mean and its first moments over a disc are integrals of
    A over the rim and over the inside, in which nothing is worse than a logarithm.

    Parameters
    ----------
    pair : Pair
    along : ndarray, shape (m, 3)
        Unit vectors along wakes, hub axes of the source.

    Returns
    -------
    ndarray, shape (m, 3)
        Down through the disc: mean, and slopes forward and to the right over its radius, in its hub axes.
    """
    axes = np.reshape(pair.axes, (3, 3))
    ahead, right = axes[:, 0], axes[:, 1]
    angles = 2.0 * math.pi * np.arange(SOURCE_POINTS) / SOURCE_POINTS
    filaments = np.stack([np.cos(angles), np.sin(angles), 0.0 * angles], axis=-1)
    lengths = np.stack([-np.sin(angles), np.cos(angles)], axis=-1) * (2.0 * math.pi / SOURCE_POINTS)
    phi = 2.0 * math.pi * (np.arange(RIM_POINTS) + 0.5) / RIM_POINTS
    cosine, sine = np.cos(phi), np.sin(phi)
    steps = (np.outer(cosine, right) - np.outer(sine, ahead)) * (2.0 / RIM_POINTS)  # over pi R
    inside, weights = _disc()
    points = np.concatenate([np.outer(cosine, ahead) + np.outer(sine, right), inside @ axes[:, :2].T])
    found = np.empty((len(along), 3))
    for row, own in zip(found, along, strict=True):
        hub, radius = _contracted(pair, own)
        between = (hub + radius * points)[:, None, :] - filaments
        beyond = _beyond(between, own)
        potential = np.log(np.maximum(beyond, CLOSEST)) @ lengths * (-0.5 / math.pi)
        rim = np.einsum("ij,ij->i", potential[:RIM_POINTS], steps[:, :2]) / radius
        mean = weights @ potential[RIM_POINTS:] / radius
        row[:] = rim.sum(), 4.0 * (cosine @ rim - right[:2] @ mean), 4.0 * (sine @ rim + ahead[:2] @ mean)
    return found


def _beyond(between: Array, along: Array) -> Array:
    """R - r . e of vectors r, shape (..., 3); where these are nearly equal, down the wake, |r x e|^2 / (R + r . e)."""
    behind, length = between @ along, np.sqrt(np.einsum("ijk,ijk->ij", between, between))
    beyond: Array = length - behind
    near = beyond < NEAR * length
    across = between[near] - behind[near, np.newaxis] * along
    beyond[near] = np.einsum("ij,ij->i", across, across) / (length[near] + behind[near])
    return beyond


def _disc() -> tuple[Array, Array]:
    """Points of a unit disc and their shares in its area."""
    at, weights = np.polynomial.legendre.leggauss(RINGS)
    radius, phi = np.sqrt(0.5 * (at + 1.0)), 2.0 * math.pi * np.arange(SPOKES) / SPOKES
    points = np.stack([np.outer(radius, np.cos(phi)), np.outer(radius, np.sin(phi))], axis=-1)
    return points.reshape(-1, 2), np.repeat(0.5 * weights / SPOKES, SPOKES)


def _contracted(pair: Pair, along: Array) -> tuple[Array, float]:
    """Hub and radius of a disc as they lie in a cylinder when they lie so in a wake that contracts, eq. (6.20)."""
    hub, depth = np.array(pair.hub), pair.hub[2] * along[2]
    if depth <= 0.0:
        return hub, pair.radius
    far = abs(pair.hub[2])
    growth = (1.0 / pair.expansion - 1.0) * far / math.hypot(1.0, far)
    widening = math.sqrt(1.0 + along[2] * along[2] * growth)
    # from the axis of the wake at that depth, which is far away where the wake is nearly level: without dividing by it
    outward = along[2] * hub - pair.hub[2] * along
    return hub + outward * (along[2] * growth / (1.0 + widening)), pair.radius * widening


# -- tables ------------------------------------------------------------------------------------------------


@lru_cache(maxsize=256)
def node_values(pair: Pair) -> Array:
    """`influence` on the grid of the skew, shape (2, CELLS + 1, CELLS + 1, 3): wakes down, and wakes up.

    Mirrored geometries have mirrored values, to the last bit.
    """
    for axis in (1, 0):
        if _mirror(pair, axis) > pair:
            return _mirrored(node_values(_mirror(pair, axis)), axis)
    grid = np.linspace(-1.0, 1.0, CELLS + 1)
    x, y = (values.ravel() for values in np.meshgrid(grid, grid, indexing="ij"))
    down = _on_grid(pair, x, y, False)
    is_level = pair.hub[2] == 0.0 and pair.axes == tuple(np.eye(3).ravel())
    up = down if is_level else _on_grid(pair, x, y, True)  # above a disc the wake does what it does below
    values = np.stack([down, up]).reshape(2, CELLS + 1, CELLS + 1, 3)
    values.flags.writeable = False
    return values


def _mirror(pair: Pair, axis: int) -> Pair:
    signs = np.ones(3)
    signs[axis] = -1.0
    hub, axes = signs * pair.hub + 0.0, np.outer(signs, signs) * np.reshape(pair.axes, (3, 3)) + 0.0
    return pair._replace(hub=tuple(hub.tolist()), axes=tuple(axes.ravel().tolist()))


def _mirrored(values: Array, axis: int) -> Array:
    signs = np.ones(3)
    signs[1 + axis] = -1.0
    mirrored: Array = np.flip(values, 1 + axis) * signs
    return mirrored


def _on_grid(pair: Pair, x: Array, y: Array, is_up: bool) -> Array:
    """Values at skews; those outside of the unit circle, which no wake has, continue the slope at its edge."""
    size = np.hypot(x, y)
    outside, values = size > 1.0, np.empty((len(x), 3))
    values[~outside] = influence(pair, directions(x[~outside], y[~outside], is_up))
    u, v, inner = x[outside] / size[outside], y[outside] / size[outside], 2.0 - size[outside]
    edge = influence(pair, directions(u, v, is_up))
    values[outside] = 2.0 * edge - influence(pair, directions(u * inner, v * inner, is_up))
    return values


@lru_cache(maxsize=256)
def _rows(pair: Pair) -> Array:
    """Bicubic splines through the values, shape (6 CELLS^2, 16): hemisphere, cell, value; powers of x, then of y."""
    from scipy.interpolate import CubicSpline  # here: it takes a quarter of a second, and few aircraft need it

    grid = np.arange(CELLS + 1.0)
    along_y = CubicSpline(grid, node_values(pair), axis=2).c[::-1]  # power of y, cell, hemisphere, node, value
    both = CubicSpline(grid, along_y, axis=3).c[::-1]  # power of x, cell, power of y, cell, hemisphere, value
    rows: Array = np.ascontiguousarray(both.transpose(4, 1, 3, 5, 0, 2)).reshape(-1, 16)
    return rows


def records_of(aircraft: "Aircraft") -> tuple[NDArray[Any], Array]:
    """Records of all pairs of rotors, and their tables one behind the other; none without interference."""
    rotors: Sequence[Rotor] = aircraft.rotors if aircraft.options.meets_wakes else ()
    numbers = [(i, j) for i in range(len(rotors)) for j in range(len(rotors)) if i != j]
    pairs, tables, first = R.records(R.PAIR, len(numbers), 1), dict[Pair, tuple[int, Array]](), 0
    for record, (target, source) in zip(pairs, numbers, strict=True):
        geometry = pair_of(rotors[source], rotors[target])
        if geometry not in tables:
            tables[geometry] = first, _rows(geometry)
            first += len(tables[geometry][1])
        speeds = [rotor.speed * rotor.radius for rotor in (rotors[source], rotors[target])]
        flow_scale = speeds[0] / (speeds[1] * 2.0 * rotors[source].wake_expansion)
        factors = rotors[source].induced_power_factor / rotors[target].induced_power_factor
        values = {
            "flow_scale": flow_scale,
            "blade_scale": flow_scale * factors,
            "cells": CELLS,
            "first_row": tables[geometry][0],
        }
        for name, value in values.items():
            record[name][..., 0] = value
        record["source"], record["target"] = source, target
    table = R.aligned((first, 16), float)
    if first:
        table[:] = np.concatenate([rows for _, rows in tables.values()])
    return pairs, table
