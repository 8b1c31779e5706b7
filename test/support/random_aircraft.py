"""Random helicopters with the proportions of real ones, and flights for them."""

import math
from typing import Any

import numpy as np

from sbs_sim import Aircraft
from sbs_sim.errors import AircraftError

KINDS = ("conventional", "tandem", "side_by_side", "quadrotor", "coaxial")
GRAVITY, DENSITY = 9.80665, 1.225


def random_flights(seed: int, i: int) -> tuple[str, Aircraft, dict[str, dict[str, float]]]:
    """Kind, aircraft and flights, arguments of `trim` by names, of number i of a fleet."""
    kind, rng = KINDS[i % len(KINDS)], np.random.default_rng([seed, i])
    aircraft = Aircraft.from_dict(random_data(kind, rng))
    return kind, aircraft, random_conditions(aircraft, rng)


def random_data(kind: str, rng: np.random.Generator) -> dict[str, Any]:
    """Mapping of an aircraft file of a kind, drawn again until it is physically possible."""
    while True:
        data = _drawn(kind, rng)
        try:
            Aircraft.from_dict(data)
        except AircraftError:
            continue
        return data


def _drawn(kind: str, rng: np.random.Generator) -> dict[str, Any]:
    mass = _log_uniform(rng, 0.5, 2e4)
    count = {"conventional": 1, "quadrotor": 4}.get(kind, 2)
    loading = 30.0 * mass**0.2 * _log_uniform(rng, 0.6, 3.0)  # N/m^2: 20 to 600
    radius = math.sqrt(mass * GRAVITY / (loading * count * math.pi))
    tip_speed = min(230.0, _log_uniform(rng, 90.0, 180.0) * mass**0.05)
    density = DENSITY * rng.uniform(0.7, 1.0)
    main = _rotor(rng, "main", mass * GRAVITY / count, radius, tip_speed, density)
    rotors = globals()[f"_{kind}"](rng, main, mass, density)
    area = count * math.pi * radius**2
    plates = area * np.array(
        [_log_uniform(rng, 0.004, 0.03), _log_uniform(rng, 0.02, 0.1), _log_uniform(rng, 0.02, 0.2)]
    )
    return {
        "name": kind,
        "environment": {"air_density": density, "kinematic_viscosity": 1.6e-5, "gravity": GRAVITY},
        "body": {"mass": mass, "inertia": _inertia(rng, mass, rotors), "flat_plate_areas": plates.tolist()},
        "options": {"coupling": "complete", "hub_moment": "complete", "flap_inertia": "hinge_to_tip", "elements": 20},
        "controls": {
            "collective": {"range_deg": [-5.0, 35.0]},
            "lateral_cyclic": {"range_deg": [-15.0, 15.0]},
            "longitudinal_cyclic": {"range_deg": [-15.0, 15.0]},
            "differential_longitudinal_cyclic": {"range_deg": [-25.0, 30.0]},
        },
        "rotors": rotors,
    }


def _log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    return float(math.exp(rng.uniform(math.log(low), math.log(high))))


def _rotor(
    rng: np.random.Generator, name: str, thrust: float, radius: float, tip_speed: float, density: float
) -> dict[str, Any]:
    """A rotor whose thrust is 0.04 to 0.13 of what dynamic pressure and blade area give, C_T over solidity."""
    blades = int(rng.integers(3, 7))
    coefficient = thrust / (density * math.pi * radius**2 * tip_speed**2)
    solidity = min(0.3, coefficient / rng.uniform(0.04, 0.13))
    chord = solidity * math.pi * radius / blades
    taper = rng.uniform(0.5, 1.0)
    hinge = radius * rng.uniform(0.02, 0.15)
    length = radius - hinge
    lock = rng.uniform(3.0, 12.0)
    second_moment = density * 5.7 * chord * radius**4 / lock
    blade_mass, speed = 3 * second_moment / length**2, tip_speed / radius
    cg = length * rng.uniform(0.4, 0.55)
    spring = second_moment * speed**2 * (rng.uniform(0.0, 0.4) if rng.random() < 0.6 else 0.0)
    stiffness = (hinge * blade_mass * cg + spring / speed**2) / second_moment  # nu^2 - 1
    lag = math.degrees(math.atan2(lock / 8, stiffness))
    twist = rng.uniform(-20.0, 4.0)
    return {
        "name": name,
        "hub": [0.0, 0.0, 0.0],
        "shaft_direction": [0.0, 0.0, -1.0],
        "rotation": 1 if rng.random() < 0.5 else -1,
        "speed_rpm": speed * 30 / math.pi,
        "radius": radius,
        "blades": blades,
        "blade_mass": blade_mass,
        "blade_cg": cg,
        "hinge_offset": hinge,
        "flap_hinge_offset": hinge * rng.uniform(0.0, 0.5),
        "flap_spring": spring,
        "lag_spring": second_moment * speed**2 * rng.uniform(0.0, 0.3),
        "lag_damping": second_moment * speed * rng.uniform(0.01, 0.1),
        "pitch_flap_coupling": rng.uniform(-0.1, 0.5) if rng.random() < 0.3 else 0.0,
        "pitch_lag_coupling": 0.0,
        "chord": {"root": chord * 2 / (1 + taper), "tip": chord * 2 * taper / (1 + taper)},
        "twist_deg": {"root": twist * -rng.uniform(0.0, 0.8), "tip": twist * rng.uniform(0.2, 1.0)},
        "root_cutout": length * rng.uniform(0.0, 0.15),
        "tip_loss": rng.uniform(0.94, 1.0),
        "swashplate_phase_deg": lag - 90.0 + rng.uniform(-10.0, 10.0),
        "airfoil": "naca0012" if rng.random() < 0.8 else "linear_573",
        "duct_expansion": 0.5 if rng.random() < 0.8 else rng.uniform(0.5, 0.8),
        "collective_range_deg": [-25.0, 45.0],
        "cyclic_range_deg": [-25.0, 25.0],
        "swashplate_rate_deg": 100.0,
        "mixing": {
            "collective": {"collective": 1.0},
            "lateral_cyclic": {"lateral_cyclic": 1.0},
            "longitudinal_cyclic": {"longitudinal_cyclic": 1.0},
        },
    }


def _place(rng: np.random.Generator, rotor: dict[str, Any], x: float, y: float, tilt: tuple[float, float]) -> None:
    """Put a rotor at a place, above the centre of gravity or now and then below, its shaft tilted to x and y [deg]."""
    up = rotor["radius"] * (rng.uniform(0.05, 0.4) if rng.random() < 0.85 else rng.uniform(-0.2, 0.05))
    rotor["hub"] = [x, y, -up]
    rotor["shaft_direction"] = [math.tan(math.radians(tilt[0])), math.tan(math.radians(tilt[1])), -1.0]


def _conventional(rng: np.random.Generator, main: dict[str, Any], mass: float, density: float) -> list[dict[str, Any]]:
    radius, side = main["radius"], main["rotation"]
    shift = rng.uniform(-0.06, 0.06, 2) * radius
    _place(rng, main, shift[0], 0.3 * shift[1], (rng.uniform(-2.0, 6.0), rng.uniform(-3.0, 3.0)))
    ratio = rng.uniform(0.13, 0.25)
    arm = radius * (1.02 + ratio + rng.uniform(0.0, 0.1))
    weight, speed = mass * GRAVITY, main["speed_rpm"] * math.pi / 30
    induced = weight * math.sqrt(weight / (2 * density * math.pi * radius**2))
    blade_area = main["blades"] * (main["chord"]["root"] + main["chord"]["tip"]) / 2 * radius
    profile = density * blade_area * (speed * radius) ** 3 * 0.012 / 8
    thrust = 1.2 * (induced + profile) / speed / arm
    tail = _rotor(rng, "tail", thrust, ratio * radius, speed * radius * rng.uniform(0.8, 1.1), density)
    cant = math.radians(rng.uniform(-5.0, 25.0))
    if rng.random() < 0.2:  # a rotor that pushes with negative collective
        side = -side
    tail["hub"] = [-arm, 0.0, -radius * rng.uniform(-0.05, 0.3)]
    tail["shaft_direction"] = [0.0, side * math.cos(cant), -math.sin(cant)]
    gain = rng.uniform(0.5, 1.5) * (1 if rng.random() < 0.5 else -1)
    tail["mixing"] = {
        "collective": {"differential_longitudinal_cyclic": gain},
        "lateral_cyclic": {},
        "longitudinal_cyclic": {},
    }
    if rng.random() < 0.3:
        tail["mixing"]["collective"]["collective"] = rng.uniform(0.0, 0.6) * (1 if side == main["rotation"] else -1)
    return [main, tail]


def _pair(rng: np.random.Generator, main: dict[str, Any], density: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """A rotor and another that turns the other way round, like it or of its own."""
    other = {**main, "name": "other", "rotation": -main["rotation"]}
    if rng.random() < 0.3:
        own = _rotor(rng, "other", 1.0, main["radius"], main["speed_rpm"] * math.pi / 30 * main["radius"], density)
        other |= {key: own[key] for key in ("twist_deg", "root_cutout", "tip_loss")}
    return main, other


def _tandem(rng: np.random.Generator, main: dict[str, Any], mass: float, density: float) -> list[dict[str, Any]]:
    front, rear = _pair(rng, main, density)
    reach = main["radius"] * rng.uniform(0.75, 1.3)
    shift = reach * rng.uniform(-0.15, 0.15)
    _place(rng, front, reach + shift, 0.0, (rng.uniform(-2.0, 9.0), 0.0))
    _place(rng, rear, -reach + shift, 0.0, (rng.uniform(-2.0, 6.0), 0.0))
    gain = rng.uniform(0.3, 1.0)
    for rotor, end in ((front, 1.0), (rear, -1.0)):
        rotor["mixing"] = {
            "collective": {"collective": 1.0, "longitudinal_cyclic": -end * gain},
            "lateral_cyclic": {"lateral_cyclic": 1.0, "differential_longitudinal_cyclic": end},
            "longitudinal_cyclic": {"longitudinal_cyclic": rng.uniform(0.0, 0.5)} if rng.random() < 0.3 else {},
        }
    return [front, rear]


def _side_by_side(rng: np.random.Generator, main: dict[str, Any], mass: float, density: float) -> list[dict[str, Any]]:
    left, right = _pair(rng, main, density)
    reach = main["radius"] * rng.uniform(0.6, 1.4)
    differential = rng.random() < 0.5  # roll by differential collective, or by lateral cyclic
    if not differential:
        right = {**left, "name": "other", "rotation": -left["rotation"]}
    shift = np.array([rng.uniform(-0.05, 0.05), rng.uniform(-0.05, 0.05) * differential]) * reach
    tilt, cant = rng.uniform(-2.0, 5.0), rng.uniform(-4.0, 4.0)
    for rotor, side in ((left, -1.0), (right, 1.0)):
        _place(rng, rotor, shift[0], side * reach + shift[1], (tilt, side * cant))
        lateral = {} if differential else {"lateral_cyclic": 1.0}
        collective = {"lateral_cyclic": -side * rng.uniform(0.3, 1.0)} if differential else {}
        rotor["mixing"] = {
            "collective": {"collective": 1.0, **collective},
            "lateral_cyclic": lateral,
            "longitudinal_cyclic": {"longitudinal_cyclic": 1.0, "differential_longitudinal_cyclic": side},
        }
    left["hub"][2] = right["hub"][2]
    return [left, right]


def _quadrotor(rng: np.random.Generator, main: dict[str, Any], mass: float, density: float) -> list[dict[str, Any]]:
    """Four rotors at the corners, flown by their collectives alone; yaw by the torques and a little cant."""
    reach = np.array([rng.uniform(0.8, 1.3), rng.uniform(0.8, 1.3)]) * main["radius"]
    shift = rng.uniform(-0.08, 0.08, 2) * reach
    cant, height = rng.uniform(0.0, 6.0), rng.uniform(-0.2, 0.4) * main["radius"]
    gains = rng.uniform(0.3, 1.0, 3)
    rotors = []
    for i, (end, side) in enumerate(((1, 1), (1, -1), (-1, -1), (-1, 1))):
        rotor = {**main, "name": f"r{i + 1}", "rotation": main["rotation"] * end * side}
        # a rotor that turns counter-clockwise yaws the aircraft to the right: with more of its thrust, canted, too
        turn = rotor["rotation"]
        rotor["hub"] = [end * reach[0] + shift[0], side * reach[1] + shift[1], -height]
        cross = np.array([-side * reach[1], end * reach[0], 0.0])
        lean = math.tan(math.radians(cant)) * turn * cross / np.linalg.norm(cross)
        rotor["shaft_direction"] = [float(lean[0]), float(lean[1]), -1.0]
        rotor["mixing"] = {
            "collective": {
                "collective": 1.0,
                "lateral_cyclic": -side * gains[0],
                "longitudinal_cyclic": -end * gains[1],
                "differential_longitudinal_cyclic": turn * gains[2],
            },
            "lateral_cyclic": {},
            "longitudinal_cyclic": {},
        }
        rotors.append(rotor)
    return rotors


def _coaxial(rng: np.random.Generator, main: dict[str, Any], mass: float, density: float) -> list[dict[str, Any]]:
    upper, lower = _pair(rng, main, density)
    shift = rng.uniform(-0.06, 0.06, 2) * main["radius"]
    _place(rng, upper, shift[0], 0.3 * shift[1], (rng.uniform(-2.0, 5.0), 0.0))
    lower["shaft_direction"] = upper["shaft_direction"]
    lower["hub"] = [*upper["hub"][:2], upper["hub"][2] + main["radius"] * rng.uniform(0.1, 0.25)]
    gain = rng.uniform(0.3, 1.0)
    for rotor in (upper, lower):
        collective = {"collective": 1.0, "differential_longitudinal_cyclic": rotor["rotation"] * gain}
        rotor["mixing"] = {**main["mixing"], "collective": collective}
    return [upper, lower]


def _inertia(rng: np.random.Generator, mass: float, rotors: list[dict[str, Any]]) -> list[list[float]]:
    """Of a block about as large as the rotors' places, and of the blades as points and discs."""
    hubs = np.array([rotor["hub"] for rotor in rotors])
    size = np.abs(hubs).max(axis=0) * rng.uniform(0.3, 0.7) + 0.15 * rotors[0]["radius"]
    inertia = (
        mass / 3 * np.diag([size[1] ** 2 + size[2] ** 2, size[0] ** 2 + size[2] ** 2, size[0] ** 2 + size[1] ** 2])
    )
    for rotor, hub in zip(rotors, hubs, strict=True):
        blades = rotor["blades"] * rotor["blade_mass"]
        hinge = rotor["hinge_offset"]
        second = rotor["blade_mass"] * (rotor["radius"] - hinge) ** 2 / 3
        polar = rotor["blades"] * (rotor["blade_mass"] * (hinge**2 + 2 * hinge * rotor["blade_cg"]) + second)
        shaft = np.array(rotor["shaft_direction"]) / np.linalg.norm(rotor["shaft_direction"])
        inertia += polar / 2 * (np.eye(3) + np.outer(shaft, shaft))
        inertia += blades * (hub @ hub * np.eye(3) - np.outer(hub, hub))
    return ((inertia + inertia.T) / 2).tolist()


def random_conditions(aircraft: Aircraft, rng: np.random.Generator) -> dict[str, dict[str, float]]:
    """Hover, forward flight and one other, of speeds that suit the rotors."""
    first = aircraft.rotors[0]
    tip_speed = first.speed * first.radius
    area = sum(math.pi * rotor.radius**2 for rotor in aircraft.rotors if abs(rotor.shaft_direction[2]) > 0.5)
    induced = math.sqrt(aircraft.body.mass * GRAVITY / (2 * DENSITY * area))
    forward = min(100.0, tip_speed * rng.uniform(0.05, 0.28))
    other: dict[str, dict[str, float]] = {
        "climb": {"climb_rate": min(50.0, induced * rng.uniform(0.2, 1.0))},
        "descent": {"climb_rate": -induced * rng.uniform(0.1, 0.4)},
        "slope": {"airspeed": 0.7 * forward, "climb_rate": induced * rng.uniform(-0.7, 0.7)},
        "sideways": {"airspeed": 0.3 * forward, "sideslip": rng.choice([-1.0, 1.0]) * math.pi / 2},
        "backward": {"airspeed": -0.3 * forward},
        "turn": {"airspeed": 0.6 * forward, "turn_rate": min(3.0, GRAVITY * rng.uniform(-1.0, 1.0) / (0.6 * forward))},
    }
    name = str(rng.choice(sorted(other)))
    return {"hover": {}, "forward": {"airspeed": forward}, name: {k: float(v) for k, v in other[name].items()}}
