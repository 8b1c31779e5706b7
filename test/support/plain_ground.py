"""The ground in the plain reference: contact, and what it takes from the inflow (theory.md, sections 6.3 and 7.7)."""

import numpy as np
from scipy.interpolate import CubicHermiteSpline, PchipInterpolator

#: Prouty's curve: height over the diameter, induced velocity over that far from the ground.
CURVE = np.array([(0.127, 0.627), (0.269, 0.737), (0.459, 0.83), (0.663, 0.901), (0.902, 0.955), (1.2, 1.0)])


def plane(ac):
    """Return unit vectors NED into the ground, along it uphill and to the right of that, and its distance [m]."""
    slope, heading = ac.ground.slope, ac.ground.slope_heading
    toward = np.array([np.cos(heading), np.sin(heading), 0.0])
    up = np.array([0.0, 0.0, -1.0])
    down = np.sin(slope) * toward - np.cos(slope) * up
    uphill = np.cos(slope) * toward + np.sin(slope) * up
    altitude = -1e9 if ac.ground.altitude is None else ac.ground.altitude
    return down, uphill, np.cross(down, uphill), down @ (altitude * up)


def contact(ac, x, attitude):
    """Return force and moment about the c.g., body axes [N, N m], and the rates of the deflections [m/s]."""
    down, uphill, right, distance = plane(ac)
    force, moment, rates = np.zeros(3), np.zeros(3), []
    deflections = x[-2 * len(ac.contact_points) :].reshape(-1, 2)
    for point, (first, second) in zip(ac.contact_points, deflections, strict=True):
        depth = down @ (x[:3] + attitude @ point.position) - distance
        motion = attitude @ (x[7:10] + np.cross(x[10:13], point.position))
        if depth <= 0.0:
            rates += [0.0, 0.0]
            continue
        rates += [uphill @ motion, right @ motion]
        damping = point.damping * min(1.0, depth / point.onset)
        normal = max(0.0, point.stiffness * depth + damping * (down @ motion))
        side_stiffness, side_damping = point.sideways
        held = side_stiffness * (first * uphill + second * right)
        held = held + side_damping * (motion - (motion @ down) * down)
        if point.rolling is None:
            size = np.linalg.norm(held)
            held = held * (min(1.0, point.friction * normal / size) if size > 0.0 else 1.0)
        else:
            ahead = attitude @ point.rolling
            ahead = ahead - (ahead @ down) * down
            ahead = ahead / np.linalg.norm(ahead)
            aside = np.cross(down, ahead)
            most, least = point.friction * normal, point.rolling_friction * normal
            held = np.clip(held @ ahead, -least, least) * ahead + np.clip(held @ aside, -most, most) * aside
        own = attitude.T @ (-normal * down - held)
        force, moment = force + own, moment + np.cross(point.position, own)
    return force, moment, np.array(rates)


def ground_ratio(ac, height, decay):
    """Return the induced velocity at the blades over that far from the ground.

    Parameters
    ----------
    height : float
        Of the hub over the radius.
    decay : float
        Share of the effect that tilt and speed leave.
    """
    if ac.ground.effect == "cheeseman_bennett":
        image = 1.0 / (4.0 * height) ** 2 if height > 0.5 else 0.25 - (height - 0.5)
        return (1.0 - image * decay) ** 1.5
    return 1.0 - (1.0 - measured(height / 2)) * decay


def measured(height):
    """Return the measured ratio at a height over the diameter."""
    knots, values = CURVE.T
    slopes = PchipInterpolator(knots, values).derivative()(knots)
    slopes[0], slopes[-1] = (values[1] - values[0]) / (knots[1] - knots[0]), 0.0
    if height >= knots[-1]:
        return 1.0
    if height < knots[0]:
        return values[0] + slopes[0] * (height - knots[0])
    return float(CubicHermiteSpline(knots, values, slopes)(height))


def ground_washes(ac, state, attitude, hub_velocities):
    """Return what the ground takes from the inflow of every rotor at its blades: lambda0, lambdas, lambdac."""
    down, _, _, distance = plane(ac)
    found = []
    for rotor, inflow, velocity in zip(ac.rotors, state.inflow, hub_velocities, strict=True):
        height = max(0.0, distance - down @ (state.position + attitude @ rotor.hub)) / rotor.radius
        motion, scale = attitude @ velocity, getattr(rotor, "inflow_speed", rotor.speed)
        along = np.linalg.norm(motion - (motion @ down) * down) / (scale * rotor.radius)
        thrust = np.asarray(rotor.shaft_direction) / np.linalg.norm(rotor.shaft_direction)
        tilt = max(0.0, -(attitude @ thrust) @ down)
        decay = tilt / (1.0 + (along / inflow[0]) ** 2)
        found.append((ground_ratio(ac, height, decay) - 1.0) * inflow)
    return found
