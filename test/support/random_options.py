"""Random aircraft with every kind of key that an aircraft file may have: those of `random_aircraft` and options on top.

One to eight rotors of three to seven blades. Each option is drawn by itself, so that any two of them meet in some
aircraft of a fleet.
"""

import copy
import math
from typing import Any

import numpy as np
from random_aircraft import GRAVITY, KINDS, random_conditions, random_data

from sbs_sim import Aircraft
from sbs_sim.aircraft.atmosphere import standard_air
from sbs_sim.errors import AircraftError

ALL_KINDS = (*KINDS, "single", "compound", "multirotor", "stand")
CALM = 0.5  # share of an option that is drawn
MOST_BLADES, FEWEST_BLADES = 7, 3
WASH = {"skew_deg": [0.0, 40.0, 80.0], "down": [1.5, 1.8, 0.4], "aft": [0.0, 0.5, 0.2]}
RENAMED = {"collective": "lever", "lateral_cyclic": "stick", "longitudinal_cyclic": "push"}
HELD = {"vane": {"range_deg": [-5.0, 5.0], "held_deg": 1.0}}


def equipped_flights(seed: int, i: int) -> tuple[str, Aircraft, dict[str, dict[str, float]]]:
    """Kind, aircraft and flights, arguments of `trim` by names, of number i of a fleet."""
    kind, rng = ALL_KINDS[i % len(ALL_KINDS)], np.random.default_rng([seed, i, 17])
    aircraft = Aircraft.from_dict(equipped_data(kind, rng))
    return kind, aircraft, {"rest": {}} if aircraft.body.is_stand else random_conditions(aircraft, rng)


def equipped_data(kind: str, rng: np.random.Generator) -> dict[str, Any]:
    """Mapping of an aircraft file of a kind, drawn again until it is physically possible."""
    while True:
        data = _based(kind, rng)
        for rotor in data["rotors"]:
            _vary_rotor(rotor, rng)
        _share_blades(data["rotors"], rng)
        for option in (_air, _surfaces, _fuselage, _controls, _drives):
            if rng.random() < CALM:
                option(data, rng)
        try:
            Aircraft.from_dict(data)
        except AircraftError:
            continue
        return data


def _based(kind: str, rng: np.random.Generator) -> dict[str, Any]:
    """An aircraft of `random_aircraft`, or what follows from one."""
    if kind in KINDS:
        return random_data(kind, rng)
    base = {"compound": "conventional", "multirotor": "quadrotor", "single": "conventional"}
    data = random_data(base.get(kind, str(rng.choice(KINDS))), rng)
    data["name"] = kind
    if kind == "single":
        data["rotors"] = data["rotors"][:1]
    elif kind == "compound":
        _add_propeller(data, rng)
    elif kind == "multirotor":
        _arrange_in_a_ring(data, int(rng.integers(5, 9)), rng)
    else:
        _put_on_a_stand(data, rng)
    return data


def _add_propeller(data: dict[str, Any], rng: np.random.Generator) -> None:
    """A third rotor that pushes, by a control that trims hold."""
    tail = copy.deepcopy(data["rotors"][1])
    reach = 0.4 * data["rotors"][0]["radius"]
    tail |= {"name": "propeller", "hub": [-reach, 0.0, 0.1 * reach], "shaft_direction": [1.0, 0.0, 0.0]}
    tail["mixing"] = {"collective": {"push": 1.0}, "lateral_cyclic": {}, "longitudinal_cyclic": {}}
    data["controls"]["push"] = {"range_deg": [-5.0, 30.0], "held_deg": float(rng.uniform(0.0, 8.0))}
    data["rotors"].append(tail)


def _arrange_in_a_ring(data: dict[str, Any], count: int, rng: np.random.Generator) -> None:
    """Five to eight rotors around the centre of gravity, flown by their collectives."""
    first = data["rotors"][0]
    share = 4.0 / count  # of the disc and of the thrust
    gains, reach = rng.uniform(0.3, 1.0, 3), first["radius"] * rng.uniform(1.1, 1.8)
    data["rotors"] = []
    for k in range(count):
        angle, turn = 2.0 * math.pi * (k + 0.5) / count, 1 if k % 2 else -1
        rotor = copy.deepcopy(first) | {"name": f"r{k + 1}", "rotation": turn, "shaft_direction": [0.0, 0.0, -1.0]}
        x, y = math.cos(angle), math.sin(angle)
        rotor["hub"] = [reach * x, reach * y, first["hub"][2]]
        rotor["chord"] = {end: share * chord for end, chord in rotor["chord"].items()}
        for key in ("blade_mass", "flap_spring", "lag_spring", "lag_damping"):
            rotor[key] *= share
        rotor["mixing"]["collective"] = {
            "collective": 1.0,
            "lateral_cyclic": -y * gains[0],
            "longitudinal_cyclic": -x * gains[1],
            "differential_longitudinal_cyclic": turn * gains[2],
        }
        data["rotors"].append(rotor)


def _put_on_a_stand(data: dict[str, Any], rng: np.random.Generator) -> None:
    """Some axes are free, with a spring or without; the rotors do not turn about them by themselves."""
    axes = ("x", "y", "z", "roll", "pitch", "yaw")
    free = [axis for axis in axes[:5] if rng.random() < CALM]
    mass, radius = data["body"]["mass"], data["rotors"][0]["radius"]
    scale = np.array([mass] * 3 + [mass * radius**2 / 4] * 3) * rng.uniform(0.5, 2.0, 6)
    frequency = data["rotors"][0]["speed_rpm"] * math.pi / 30 * rng.uniform(0.5, 2.0, 6)
    is_free = np.array([axis in free for axis in axes], dtype=float)
    damping = 2.0 * rng.uniform(0.02, 0.2, 6) * scale * frequency
    data["body"]["stand"] = {
        "free": free,
        "mass": (scale * is_free).tolist(),
        "spring": (scale * frequency**2 * is_free).tolist(),
        "damping": (damping * is_free).tolist(),
    }


# --- rotors -------------------------------------------------------------------------------------------------------


def _share_blades(rotors: list[dict[str, Any]], rng: np.random.Generator) -> None:
    """Another number of blades with the same area, mass and stiffness in all; one for all rotors, or for each."""
    common = int(rng.integers(FEWEST_BLADES, MOST_BLADES + 1)) if rng.random() < CALM else 0
    for rotor in rotors:
        blades = common or int(rng.integers(FEWEST_BLADES, MOST_BLADES + 1))
        share = rotor["blades"] / blades
        rotor["blades"] = blades
        chord = rotor["chord"]
        for key in ("root", "tip"):
            if key in chord:
                chord[key] *= share
        if "values" in chord:
            chord["values"] = [share * value for value in chord["values"]]
        for key in ("blade_mass", "blade_inertia", "flap_spring", "lag_spring", "lag_damping"):
            if key in rotor:
                rotor[key] *= share
        if "lag_damper" in rotor:
            rotor["lag_damper"]["damping"] *= share
        for key in ("stiffness", "damping"):
            if "lag_stop" in rotor:
                rotor["lag_stop"][key] *= share
        if rng.random() < 0.1:
            rotor["blade_lag_damping"] = rng.uniform(0.5, 1.5, blades).tolist()


def _vary_rotor(rotor: dict[str, Any], rng: np.random.Generator) -> None:
    """Tables along the blade, inertia, rest angles, damper, offsets and airfoil."""
    rotor["chord"], rotor["twist_deg"] = copy.deepcopy(rotor["chord"]), copy.deepcopy(rotor["twist_deg"])
    rotor["mixing"] = copy.deepcopy(rotor["mixing"])
    length, radius = rotor["radius"] - rotor["hinge_offset"], rotor["radius"]
    for key, spread in (("chord", 0.2 * rotor["chord"]["root"]), ("twist_deg", 2.0)):
        if rng.random() < CALM:
            stations = np.array([rotor["hinge_offset"] / radius, *np.sort(rng.uniform(0.3, 0.95, 3)), 1.0])
            values = np.interp(stations, stations[[0, -1]], [rotor[key]["root"], rotor[key]["tip"]])
            values[1:-1] += rng.uniform(-spread, spread, 3)
            rotor[key] = {"stations": stations.tolist(), "values": values.tolist()}
    if rng.random() < CALM:
        least = rotor["blade_mass"] * rotor["blade_cg"] ** 2
        rotor["blade_inertia"] = max(1.01 * least, rotor["blade_mass"] * length**2 / 3 * rng.uniform(0.8, 1.2))
    if rotor["flap_spring"] > 0.0 and rng.random() < CALM:
        rotor["flap_rest_deg"] = float(rng.uniform(0.0, 4.0))
    if rotor["lag_spring"] > 0.0 and rng.random() < CALM:
        rotor["lag_rest_deg"] = float(rng.uniform(-4.0, 4.0))
    if rng.random() < 0.25:  # the linkage of the UH-60A, larger or smaller
        lengths = {"a": 0.0058, "b": 0.0823, "c": 0.306, "d": 0.254, "r": 0.175}
        scale = radius / 8.18
        rotor["lag_damper"] = {key: scale * value for key, value in lengths.items()}
        rotor["lag_damper"]["damping"] = rotor["lag_damping"] / (0.25 * scale) ** 2
        rotor["lag_damping"] = 0.0
    if rng.random() < CALM:
        angles = ("collective", "lateral_cyclic", "longitudinal_cyclic")
        rotor["swashplate_offset_deg"] = {angle: float(rng.uniform(-2.0, 2.0)) for angle in angles}
    if rng.random() < 0.25:
        rotor["airfoil"] = "sc1095r8"
    if rng.random() < 0.25:
        rotor["induced_power_factor"] = float(rng.uniform(1.0, 1.2))
    if rng.random() < 0.15:
        duct = {"exit_area": 0.7, "turning": 0.8, "ram_recovery": 0.9, "lip_arm": 0.1 * radius, "lip_stall": 2.0}
        rotor |= {"duct": duct, "duct_expansion": 0.5}
    if rng.random() < 0.25:
        rotor["pitch_lag_coupling"] = float(rng.uniform(-0.1, 0.1))
    _offset_blades(rotor, rng.spawn(1)[0])  # draws of its own, so that all other options stay


def _offset_blades(rotor: dict[str, Any], rng: np.random.Generator) -> None:
    """Quarter chord and c.g. off the pitch axis, with a swept tip, and stops of the lag hinge."""
    chord = min(rotor["chord"].get("values", [rotor["chord"].get("tip", math.inf)]))
    if rng.random() < 0.25:
        inner, outer = rng.uniform(-0.1, 0.1, 2) * chord
        rotor["quarter_chord"] = {
            "stations": [0.3, 0.9, 1.0],
            "values": [float(inner), float(outer), float(outer - 0.3 * chord * rng.random())],
        }
        rotor["chordwise_cg"] = {"root": float(inner), "tip": float(outer)}
    if rng.random() < 0.25:
        inertia = rotor["blade_mass"] * (rotor["radius"] - rotor["hinge_offset"]) ** 2 / 3
        speed = rotor["speed_rpm"] * math.pi / 30
        ends = [float(rng.uniform(-20.0, -8.0)), float(rng.uniform(8.0, 20.0))]
        rotor["lag_stop"] = {"range_deg": ends, "stiffness": inertia * speed**2, "damping": 0.1 * inertia * speed}


# --- air and body -------------------------------------------------------------------------------------------------


def _air(data: dict[str, Any], rng: np.random.Generator) -> None:
    """Altitude and temperature in place of the density, which stays about what it is."""
    density = data["environment"]["air_density"]
    altitudes = np.linspace(0.0, 4000.0, 81)
    offset = float(rng.uniform(-20.0, 20.0))
    densities = [standard_air(float(altitude), offset).density for altitude in altitudes]
    nearest = float(altitudes[np.argmin(np.abs(np.array(densities) - density))])
    data["environment"] = {"altitude": nearest, "temperature_offset": offset, "gravity": GRAVITY}


def _surfaces(data: dict[str, Any], rng: np.random.Generator) -> None:
    """Tailplane and fin, some with a schedule, a table of coefficients or the wash of the first rotor."""
    first = data["rotors"][0]
    radius, arm = first["radius"], first["radius"] * rng.uniform(0.8, 1.2)
    surfaces = []
    for name, dihedral in (("tailplane", rng.uniform(-20.0, 20.0)), ("fin", rng.uniform(70.0, 110.0))):
        surface = {
            "name": name,
            "position": [-arm, 0.0, float(radius * rng.uniform(-0.2, 0.1))],
            "dihedral_deg": float(dihedral),
            "area": float(math.pi * radius**2 * rng.uniform(0.002, 0.02)),
            "aspect_ratio": float(rng.uniform(1.5, 6.0)),
            "incidence_deg": float(rng.uniform(-4.0, 4.0)),
        }
        if rng.random() < CALM:
            tip_speed = first["speed_rpm"] * math.pi / 30 * radius
            surface["schedule"] = {"airspeed": [0.05 * tip_speed, 0.2 * tip_speed], "incidence_deg": [10.0, 0.0]}
        if rng.random() < 0.3:
            surface["polar"] = {
                "angle_deg": [-90.0, -15.0, 0.0, 15.0, 90.0],
                "lift": [0.0, -0.9, 0.0, 0.9, 0.0],
                "drag": [1.2, 0.1, 0.01, 0.1, 1.2],
            }
        if rng.random() < CALM:
            surface["wash"] = {"rotor": first["name"], **copy.deepcopy(WASH)}
        surfaces.append(surface)
    data["body"]["surfaces"] = surfaces


def _fuselage(data: dict[str, Any], rng: np.random.Generator) -> None:
    """Tables of areas and volumes of the size of the flat plates, which are gone."""
    forward, side, down = data["body"]["flat_plate_areas"]
    length = data["rotors"][0]["radius"]
    data["body"]["flat_plate_areas"] = [0.0, 0.0, 0.0]
    fuselage = {
        "reference": (rng.uniform(-0.1, 0.1, 3) * length * [1.0, 0.0, 1.0]).tolist(),
        "alpha_deg": [-90.0, -40.0, 0.0, 40.0, 90.0],
        "beta_deg": [-90.0, -40.0, 0.0, 40.0, 90.0],
        "drag": {
            "alpha": [down, 0.6 * down, forward, 0.6 * down, down],
            "beta": [side, 0.4 * side, 0.0, 0.4 * side, side],
        },
        "side": {"beta": [side, 0.6 * side, 0.0, -0.6 * side, -side]},
        "lift": {"alpha": [0.0, -0.4 * down, 0.0, 0.4 * down, 0.0]},
        "pitch": {"alpha": (0.2 * length * down * np.array([-0.3, -1.0, 0.0, 1.0, 0.3])).tolist()},
        "yaw": {"beta": (0.2 * length * side * np.array([0.3, 1.0, 0.0, -1.0, -0.3])).tolist()},
    }
    if rng.random() < CALM:
        fuselage["roll"] = {"grid": (0.05 * length * side * rng.uniform(-1.0, 1.0, (5, 5))).tolist()}
    if rng.random() < CALM:
        fuselage["wash"] = {"rotor": data["rotors"][0]["name"], **copy.deepcopy(WASH)}
    data["body"]["fuselage"] = fuselage


def _controls(data: dict[str, Any], rng: np.random.Generator) -> None:
    """Names of its own, a lever in per cent, and one more control, which trims hold."""
    low, high = data["controls"]["collective"]["range_deg"]
    names = {name: RENAMED.get(name, name) for name in data["controls"]} | {"push": "push_held"}
    data["controls"] = {names[name]: values for name, values in data["controls"].items()} | copy.deepcopy(HELD)
    data["controls"]["lever"] = {"range": [0.0, 100.0], "unit": "%", "axis": "heave"}
    per_cent = math.radians(high - low) / 100.0
    for rotor in data["rotors"]:
        rotor["mixing"] = {
            angle: {names[name]: factor * (per_cent if name == "collective" else 1.0) for name, factor in row.items()}
            for angle, row in rotor["mixing"].items()
        }
        start = factor_of(rotor, "lever") * math.degrees(1.0 / per_cent) * math.radians(low)
        offsets = rotor.setdefault("swashplate_offset_deg", {})
        offsets["collective"] = offsets.get("collective", 0.0) + start
        rotor["mixing"]["longitudinal_cyclic"]["vane"] = float(rng.uniform(-0.5, 0.5))


def factor_of(rotor: dict[str, Any], control: str) -> float:
    """Factor of a control on the collective of a rotor."""
    return float(rotor["mixing"]["collective"].get(control, 0.0))


# --- drives -------------------------------------------------------------------------------------------------------


def _drives(data: dict[str, Any], rng: np.random.Generator) -> None:
    """One drive for all rotors, or one for each; engine or motor with a governor or at a throttle, or none."""
    rotors = data["rotors"]
    density = data["environment"].get("air_density", 1.1)
    groups = [rotors] if rng.random() < 0.7 else [[rotor] for rotor in rotors]
    weight = data["body"]["mass"] * GRAVITY
    lifting = [rotor for rotor in rotors if abs(rotor["shaft_direction"][2]) > 0.5]
    area = sum(math.pi * rotor["radius"] ** 2 for rotor in lifting)
    induced = weight * math.sqrt(weight / (2.0 * density * area))
    data["drives"] = [_drive(group, 2.0 * induced, len(groups), rng) for group in groups]
    for drive in data["drives"]:
        if "vane" in data["controls"] and "governor" in drive:  # 1 deg is 1 % of the speed
            drive["mixing"] = {"set_point": {"vane": 0.573}}


def _drive(rotors: list[dict[str, Any]], power: float, count: int, rng: np.random.Generator) -> dict[str, Any]:
    """A drive of some rotors with up to several times the power that they share."""
    first = rotors[0]
    speed = first["speed_rpm"] * math.pi / 30
    blades = first["blades"] * first["blade_mass"] * first["radius"] ** 2 / 3
    axis = rng.normal(size=3)
    drive: dict[str, Any] = {
        "rotors": [rotor["name"] for rotor in rotors],
        "inertia": float(blades * rng.uniform(0.05, 0.5)),
        "inertia_axis": (axis / np.linalg.norm(axis) * rng.uniform(0.0, 1.0)).tolist(),
        "free_wheel": bool(rng.random() < CALM),
    }
    kind = str(rng.choice(["engine", "electric", "none"], p=[0.5, 0.4, 0.1]))
    if kind == "none":
        return drive
    torque = power * rng.uniform(1.0, 3.0) / count / speed
    drive["engine"] = {"kind": kind, "max_torque": torque, "lag": float(rng.uniform(0.02, 0.5))}
    drive["engine"]["drag"] = 0.02 * torque * float(rng.random() < CALM)
    if kind == "electric":
        volts = 50.0
        constant = volts * rng.uniform(0.6, 0.85) / speed
        drive["engine"] |= {"torque_constant": constant, "resistance": 0.1 * volts * constant / torque}
        drive["battery"] = {"full_voltage": volts, "empty_voltage": 0.8 * volts, "capacity": 10.0}
    if rng.random() < 0.8:
        gains = rng.uniform(2.0, 8.0, 2)
        drive["governor"] = {"proportional_gain": float(gains[0]), "integral_gain": float(gains[1])}
        drive["governor"]["set_point"] = float(rng.uniform(0.95, 1.05))
        drive["engine"]["throttle"] = 0.3
    else:
        drive["engine"]["throttle"] = float(rng.uniform(0.3, 0.9))
    return drive
