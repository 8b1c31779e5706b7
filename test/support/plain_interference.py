"""Plain reference of the wash of rotors on one another (theory.md section 6.5).

The tables of influences are the package's; `flow_through` has their values by another way.
"""

from typing import NamedTuple

import numpy as np
from scipy.interpolate import RectBivariateSpline

from sbs_sim.aircraft.interference import CELLS, node_values, pair_of


class Wash(NamedTuple):
    """What others add to the inflow of a rotor, as a part of it."""

    blades: np.ndarray  # lambda0, lambdas, lambdac for the blades
    through: float  # of other rotors, through the disc


def all_washes(ac, inflow, hub_velocities):
    """Return the `Wash` of every rotor; the velocities of the hubs are relative to the air, body axes [m/s]."""
    washes = []
    for i, target in enumerate(ac.rotors):
        blades, through = np.zeros(3), 0.0
        others = range(len(ac.rotors)) if getattr(ac.options, "interference", "none") == "skewed_wake" else ()
        for j in others:
            if j == i:
                continue
            source = ac.rotors[j]
            mean, ahead, right = influence_of(source, target, inflow[j][0], hub_velocities[j])
            velocity = tip_speed(source) * inflow[j][0] / (2 * (source.duct_exit or source.duct_expansion))
            share = velocity / tip_speed(target)
            factor = source.induced_power_factor / target.induced_power_factor
            blades += share * factor * np.array([mean, target.rotation * right, -ahead])
            through += share * mean
        washes.append(Wash(blades, through))
    return washes


def tip_speed(rotor):
    """Return the tip speed that makes velocities of inflow ratios [m/s]."""
    return getattr(rotor, "inflow_speed", rotor.speed) * rotor.radius


def influence_of(source, target, lambda0, velocity):
    """Return mean and slopes of the flow through a disc, from the tables of the aircraft."""
    ahead, right, down = axes_of(source).T
    flow = tip_speed(source) * lambda0 - down @ velocity
    edgewise = np.array([ahead @ velocity, right @ velocity])
    reach = max(0.25 * abs(tip_speed(source) * lambda0), 1e-5 * tip_speed(source))
    size = abs(flow) if abs(flow) >= reach else (flow**2 + reach**2) / (2 * reach)
    total = np.sqrt(edgewise @ edgewise + size**2 + (1e-5 * tip_speed(source)) ** 2)
    x, y = edgewise / (total + size)
    ratio = np.clip(flow / reach, -1.0, 1.0)
    down = 0.5 + 0.75 * ratio - 0.25 * ratio**3
    values = node_values(pair_of(source, target))
    values = down * values[0] + (1.0 - down) * values[1]
    grid = np.linspace(-1, 1, CELLS + 1)
    return [RectBivariateSpline(grid, grid, values[:, :, k])(x, y)[0, 0] for k in range(3)]


def axes_of(rotor):
    """Return the hub axes as columns: those of the body, turned with the shaft from the vertical."""
    up = np.asarray(rotor.shaft_direction, dtype=float) / np.linalg.norm(rotor.shaft_direction)
    axis, cosine = np.cross([0, 0, -1.0], up), -up[2]
    columns = [v * cosine + np.cross(axis, v) + axis * (axis @ v) / (1 + cosine) for v in np.eye(3)]
    return np.stack(columns, axis=1)


def flow_through(hub, axes, radius, along, filaments=4000, rings=12, spokes=24):
    """Return mean and slopes of the flow through a disc in the wake of a unit disc by the law of Biot and Savart.

    A filament that goes on along the wake for ever has the velocity (dl x g) / 2 pi, g = (r/R - e)/(R - r . e), for a
    mean induced velocity of one; the wake is a cylinder.
    """
    angles = 2 * np.pi * (np.arange(filaments) + 0.37) / filaments
    at = np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)
    lengths = np.stack([-np.sin(angles), np.cos(angles), 0 * angles], axis=1) * 2 * np.pi / filaments
    nodes, weights = np.polynomial.legendre.leggauss(rings)
    found = np.zeros(3)
    for share, weight in zip(np.sqrt((nodes + 1) / 2), weights / 2 / spokes, strict=True):
        for phi in 2 * np.pi * np.arange(spokes) / spokes:
            point = hub + radius * share * (np.cos(phi) * axes[:, 0] + np.sin(phi) * axes[:, 1])
            r = point - at
            distance = np.linalg.norm(r, axis=1)
            g = (r / distance[:, None] - along) / (distance - r @ along)[:, None]
            down = np.cross(lengths, g).sum(axis=0) @ axes[:, 2] / (2 * np.pi)
            found += weight * down * np.array([1, 4 * share * np.cos(phi), 4 * share * np.sin(phi)])
    return found
