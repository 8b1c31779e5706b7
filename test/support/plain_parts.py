"""Plain reference of lifting surfaces and of a fuselage with tables (theory.md, sections 5.8 and 5.9)."""

from itertools import pairwise

import numpy as np
from scipy.interpolate import CubicHermiteSpline


def part_loads(ac, air_velocity, rate, inflow):
    """Return force [N] and moment about the origin [N m] of surfaces and fuselage, body axes.

    Parameters
    ----------
    ac : aircraft
    air_velocity, rate : array, shape (3,)
        Of the origin relative to the air [m/s], and of the body [rad/s].
    inflow : list of array, shape (3,)
        lambda0, lambdas, lambdac of each rotor.
    """
    force, moment = np.zeros(3), np.zeros(3)
    for part in getattr(ac.body, "surfaces", ()):
        own = air_velocity + np.cross(rate, part.position)
        one = surface_force(ac, part, own, own + wash(ac, part.wash, air_velocity, rate, inflow))
        force, moment = force + one, moment + np.cross(part.position, one)
    part = getattr(ac.body, "fuselage", None)
    if part is not None:
        own = air_velocity + np.cross(rate, part.reference)
        one, couple = fuselage_load(ac, part, own + wash(ac, part.wash, air_velocity, rate, inflow))
        force, moment = force + one, moment + couple + np.cross(part.reference, one)
    return force, moment


def wash(ac, part, air_velocity, rate, inflow):
    """Return the velocity [m/s] that the induced velocity of a rotor takes off that of the air, body axes."""
    if not part.rotor:
        return np.zeros(3)
    j = [rotor.name for rotor in ac.rotors].index(part.rotor)
    rotor = ac.rotors[j]
    up = np.asarray(rotor.shaft_direction, dtype=float) / np.linalg.norm(rotor.shaft_direction)
    # the axis ahead: x turned with the shaft from the vertical
    axis, cosine = np.cross([0, 0, -1.0], up), -up[2]
    turned = np.array([1.0, 0, 0])
    ahead = turned * cosine + np.cross(axis, turned) + axis * (axis @ turned) / (1 + cosine)
    velocity = air_velocity + np.cross(rate, rotor.hub)
    induced = getattr(rotor, "inflow_speed", rotor.speed) * rotor.radius * inflow[j][0]
    skew = np.arctan2(velocity @ ahead, abs(induced + velocity @ up))
    aft = np.broadcast_to(part.aft, np.shape(part.skew))
    return induced * (np.interp(skew, part.skew, aft) * ahead + np.interp(skew, part.skew, part.down) * up)


def surface_force(ac, surface, own, local):
    """Return the force [N] of a surface; `own` is the velocity without the wash of a rotor."""
    gamma = surface.dihedral
    up = np.array([0.0, -np.sin(gamma), -np.cos(gamma)])
    incidence = surface.incidence
    if len(surface.schedule.airspeed):
        incidence += np.interp(np.linalg.norm(own), surface.schedule.airspeed, surface.schedule.incidence)
    flow = np.array([local[0], 0, 0]) + up * (up @ local)  # without the part along the span
    alpha = np.arctan2(-up @ local, local[0]) + incidence
    lift, drag = surface_coefficients(surface, alpha)
    across = up * local[0] - np.array([1.0, 0, 0]) * (up @ local)  # normal to the flow, as long
    pressure = 0.5 * ac.environment.air_density * surface.dynamic_pressure * surface.area * np.linalg.norm(flow)
    return pressure * (lift * across - drag * flow)


def surface_coefficients(surface, alpha):
    """Return lift and drag coefficient, smooth between whole degrees."""
    degrees = np.degrees((alpha + np.pi) % (2 * np.pi) - np.pi)
    first = int(np.floor(degrees))
    near = [coefficients_at(surface, (first + k + 180) % 360 - 180) for k in (-1, 0, 1, 2)]
    return [smooth(values, degrees - first) for values in np.transpose(near)]


def smooth(values, x):
    """Return the monotone cubic between the middle two of four values at equal steps."""
    rises = np.diff(values)
    slopes = []
    for before, after in pairwise(rises):
        mean = (before + after) / 2
        least = 3 * min(abs(before), abs(after))
        slopes.append(0.0 if before * after <= 0 else np.clip(mean, -least, least))
    return CubicHermiteSpline([0, 1], values[1:3], slopes)(x)


def coefficients_at(surface, degrees):
    """Return lift and drag coefficient at a whole number of degrees."""
    polar = surface.polar
    if len(polar.angle_deg):
        last = polar.angle_deg[-1]
        inside = degrees if abs(degrees) <= last else np.sign(degrees) * 180 - degrees
        sign = 1 if inside == degrees else -1
        return sign * np.interp(inside, polar.angle_deg, polar.lift), np.interp(inside, polar.angle_deg, polar.drag)
    ratio = surface.aspect_ratio
    slope = surface.lift_slope or 2 * np.pi * ratio / (2 + np.sqrt(ratio**2 + 4))
    zero = np.degrees(surface.zero_lift_angle)
    stall = np.degrees(surface.max_lift / slope)
    high, low = np.ceil(zero + stall), np.floor(zero - stall)
    attached = surface.max_lift**2 / (np.pi * ratio * surface.span_efficiency) + surface.zero_lift_drag
    if low <= degrees <= high:
        lift = np.clip(slope * np.radians(degrees - zero), -surface.max_lift, surface.max_lift)
        return lift, surface.zero_lift_drag + lift**2 / (np.pi * ratio * surface.span_efficiency)
    stall_angle = np.radians(high if degrees > 0 else -low)
    folded = np.radians(min(abs(degrees), 180 - abs(degrees)))
    angle = max(folded, stall_angle)
    plate = 1.11 + 0.018 * min(ratio, 50)
    s, c = np.sin(stall_angle), np.cos(stall_angle)
    lift = plate * np.sin(angle) * np.cos(angle)
    lift += (surface.max_lift - plate * s * c) * s / c**2 * np.cos(angle) ** 2 / np.sin(angle)
    drag = plate * np.sin(angle) ** 2 + (attached - plate * s**2) / c * np.cos(angle)
    if abs(degrees) > 90:
        lift *= -0.7 * folded / angle
    return np.sign(degrees) * lift, drag


def fuselage_load(ac, fuselage, local):
    """Return force [N] and moment about the reference point [N m] of a fuselage."""
    u, v, w = local
    alpha, beta = np.degrees(np.arctan2(w, u)), np.degrees(np.arctan2(v, np.hypot(u, w)))
    if not local.any():  # no flow has no direction, and no load
        return np.zeros(3), np.zeros(3)
    ahead = local / np.linalg.norm(local)
    plane = np.hypot(u, w)
    down = np.array([-w, 0.0, u]) / plane if plane else np.array([0.0, 0.0, 1.0])
    right = np.cross(down, ahead)
    pressure = 0.5 * ac.environment.air_density * (local @ local)
    areas = {name: area(fuselage, name, alpha, beta) for name in ("drag", "side", "lift", "roll", "pitch", "yaw")}
    force = areas["side"] * right - areas["drag"] * ahead - areas["lift"] * down
    moment = areas["roll"] * ahead + areas["pitch"] * right + areas["yaw"] * down
    return pressure * force, pressure * moment


def area(fuselage, name, alpha, beta):
    """Return an area or a volume: smooth along alpha and linear along beta between the steps of the angles."""
    steps = [float(np.gcd.reduce(np.rint(angles).astype(int))) for angles in (fuselage.alpha_deg, fuselage.beta_deg)]
    first, line = (int(np.floor(value / step)) for value, step in zip((alpha, beta), steps, strict=True))
    ends = []
    for across in (line, line + 1):
        near = [
            area_at(fuselage, name, (first + k) * steps[0], np.clip(across * steps[1], -90, 90)) for k in (-1, 0, 1, 2)
        ]
        ends.append(smooth(near, alpha / steps[0] - first))
    share = beta / steps[1] - line
    return ends[0] * (1 - share) + ends[1] * share


def area_at(fuselage, name, alpha, beta):
    """Return an area or a volume where angles of attack and of sideslip cross."""
    alpha = (alpha + 180) % 360 - 180
    last, sign = fuselage.alpha_deg[-1], 1
    if abs(alpha) > last:
        alpha, sign = np.copysign(180, alpha) - alpha, -1 if name == "lift" else 1
    table, value = getattr(fuselage, name), 0.0
    if len(table.alpha):
        value += np.interp(alpha, fuselage.alpha_deg, table.alpha)
    if len(table.beta):
        value += np.interp(beta, fuselage.beta_deg, table.beta)
    if len(table.grid):
        value += np.interp(alpha, fuselage.alpha_deg, [np.interp(beta, fuselage.beta_deg, row) for row in table.grid])
    return sign * value
