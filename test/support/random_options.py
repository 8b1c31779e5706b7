"""Random aircraft with every kind of key that an aircraft file may have: those of `random_aircraft` and options on top.

One to eight rotors of two to seven blades. Each option is drawn by itself, so that any two of them meet in some
aircraft of a fleet.
"""

import copy
import math
from typing import Any

import numpy as np
from random_aircraft import GRAVITY, KINDS, random_conditions, random_data

from sbs_sim import Aircraft
from sbs_sim.aircraft.atmosphere import standard_air
from sbs_sim.aircraft.declaration import schema_of
from sbs_sim.aircraft.description import Description
from sbs_sim.errors import AircraftError

PAPER = "no law is kept where blades and body move as the paper has it"
NEVER_DRAWN = {  # of `schema_keys`
    "description": "text",
    **dict.fromkeys(("options.coupling = paper", "options.hub_moment = paper"), PAPER),
    "options.flap_inertia = axis_to_tip": PAPER,
}
ALL_KINDS = (*KINDS, "single", "compound", "multirotor", "stand")
CALM = 0.5  # share of an option that is drawn
MOST_BLADES, FEWEST_BLADES = 7, 3  # and two, see `_blade_pairs`
MOST_WASHED = 4  # rotors with wash on one another: each pair of them has a table
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
    (newer,) = rng.spawn(1)  # for draws of their own, which leave the others as they are
    (newest,) = newer.spawn(1)
    (latest,) = newest.spawn(1)
    while True:
        data = _based(kind, rng)
        for rotor in data["rotors"]:
            _vary_rotor(rotor, rng)
        _share_blades(data["rotors"], rng)
        for option in (_air, _surfaces, _fuselage, _controls, _drives):
            if rng.random() < CALM:
                option(data, rng)
        for option in NEWER:
            option(data, newer)
        _unsteadiness(data, newest)
        try:
            Aircraft.from_dict(data)
        except AircraftError:
            continue
        _late_stall(data, latest)
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
        _scale_blades(rotor, share)
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


# --- what came later, with draws of its own --------------------------------------------------------------------------


def _blade_pairs(data: dict[str, Any], rng: np.random.Generator) -> None:
    """Rotors of two blades, of which some teeter."""
    if rng.random() > 0.15:
        return
    for rotor in data["rotors"]:
        if rng.random() < 0.7:
            _take_two_blades(rotor, rng)


def _scale_blades(rotor: dict[str, Any], share: float) -> None:
    """Chord, mass and stiffness of each blade, times a share."""
    for key in ("root", "tip", "values"):
        if key in rotor["chord"]:
            rotor["chord"][key] = (share * np.array(rotor["chord"][key])).tolist()
    for key in ("blade_mass", "blade_inertia", "flap_spring", "lag_spring", "lag_damping"):
        if key in rotor:
            rotor[key] *= share
    if "lag_damper" in rotor:
        rotor["lag_damper"]["damping"] *= share
    for key in ("stiffness", "damping"):
        if "lag_stop" in rotor:
            rotor["lag_stop"][key] *= share


def _take_two_blades(rotor: dict[str, Any], rng: np.random.Generator) -> None:
    """Two blades with the area, mass and stiffness of those that there were."""
    share = rotor["blades"] / 2
    rotor["blades"] = 2
    rotor.pop("blade_lag_damping", None)
    _scale_blades(rotor, share)
    if rng.random() < CALM:
        _teeter(rotor, rng)


def _teeter(rotor: dict[str, Any], rng: np.random.Generator) -> None:
    """One flap hinge at the axis, where the lag hinges need springs: without them no torque would reach the blades."""
    rotor |= {"flap_hinge": "teetering", "hinge_offset": 0.0, "flap_hinge_offset": 0.0}
    rotor["flap_rest_deg"] = float(rng.uniform(0.0, 5.0))
    inertia = rotor["blade_mass"] * rotor["radius"] ** 2 / 3
    rotor["lag_spring"] = inertia * (rotor["speed_rpm"] * math.pi / 30) ** 2 * float(rng.uniform(0.3, 2.0))
    rotor.pop("lag_stop", None)
    if rng.random() < CALM:
        rotor["undersling"] = rotor["radius"] * float(rng.uniform(0.0, 0.03))


def _sections(data: dict[str, Any], rng: np.random.Generator) -> None:
    """Mass along the span, drag that is added, outboard airfoils, losses at the tip, drag along the span."""
    straight = not any({"quarter_chord", "chordwise_cg", "undersling"} & rotor.keys() for rotor in data["rotors"])
    losses, oblique = straight and rng.random() < 0.25, straight and rng.random() < 0.25
    for rotor in data["rotors"]:
        if rng.random() < 0.25:
            _distribute_mass(rotor, rng)
        if rng.random() < 0.25:
            rotor["drag_increment"] = float(rng.uniform(0.0, 0.005))
        if rng.random() < 0.15:
            rotor["outboard_airfoils"] = {"stations": [float(rng.uniform(0.5, 0.9))], "values": [rotor["airfoil"]]}
            rotor["airfoil"] = "naca0012" if rotor["airfoil"] != "naca0012" else "linear_573"
        if losses and rng.random() < 0.7:
            rotor |= {"tip_loss_model": "prandtl", "tip_loss": 1.0}
        if oblique and rng.random() < 0.7:
            rotor["profile_drag"] = "oblique"
        if rng.random() < 0.25 and "duct" not in rotor and rotor["duct_expansion"] == 0.5:
            rotor |= {"descent": "measured", "induced_power_factor": 1.1}


def _unsteadiness(data: dict[str, Any], rng: np.random.Generator) -> None:
    """Circulation that follows the flow late, and thrust that fluctuates in vortex rings."""
    for rotor in data["rotors"]:
        if rng.random() < 0.2 and rotor["blades"] > 2:
            rotor["unsteady_airfoil"] = "jones"
        if rng.random() < 0.5 and rotor.get("descent") == "measured":
            rotor["ring_unsteadiness"] = float(rng.uniform(0.0, 0.3))


def _late_stall(data: dict[str, Any], rng: np.random.Generator) -> None:
    """Separation that follows the flow late, where no blade has offsets, which goes without it."""
    if any(rotor.has_offsets for rotor in Aircraft.from_dict(data).rotors):
        return
    kinds, first = ["separation", "leishman_beddoes"], int(rng.integers(2))
    for i, rotor in enumerate(data["rotors"]):
        if rng.random() < 0.7:
            rotor["dynamic_stall"] = kinds[(first + i) % 2]
        if rotor.get("dynamic_stall") == "leishman_beddoes":
            times = {"pressure": (1.0, 4.0), "separation": (2.0, 10.0), "vortex": (4.0, 15.0), "passage": (5.0, 15.0)}
            rotor["stall_lags"] = {name: float(rng.uniform(*ends)) for name, ends in times.items()}


def _distribute_mass(rotor: dict[str, Any], rng: np.random.Generator) -> None:
    """Mass and c.g. about those that there were, with a mass at the tip."""
    start = rotor["hinge_offset"] / rotor["radius"]
    mean = rotor.pop("blade_mass") / (rotor["radius"] - rotor["hinge_offset"])
    del rotor["blade_cg"]
    rotor.pop("blade_inertia", None)
    values = (mean * np.array([1.2, 1.0, 0.8]) * rng.uniform(0.9, 1.1, 3)).tolist()
    table = {"stations": [start, 0.5 + 0.5 * start, 1.0], "values": values}
    rotor["mass_distribution"] = table | {"tip_mass": 0.05 * mean * rotor["radius"] * float(rng.random())}


def _ducts(data: dict[str, Any], rng: np.random.Generator) -> None:
    """Other exits, lips and losses of the ducts that there are."""
    for rotor in data["rotors"]:
        if "duct" not in rotor or rng.random() > CALM:
            continue
        low = {
            "exit_area": 0.45,
            "turning": 0.0,
            "ram_recovery": 0.0,
            "lip_arm": -0.2 * rotor["radius"],
            "lip_stall": 0.5,
        }
        high = {
            "exit_area": 1.2,
            "turning": 1.0,
            "ram_recovery": 1.0,
            "lip_arm": 0.4 * rotor["radius"],
            "lip_stall": 5.0,
        }
        keys = [key for key in low if key == "exit_area" or rng.random() < 0.7]
        rotor["duct"] = {key: float(rng.uniform(low[key], high[key])) for key in keys}


def _schedules(data: dict[str, Any], rng: np.random.Generator) -> None:
    """Shares in swashplate angles that change with the airspeed: of a control, or of none."""
    for rotor in data["rotors"]:
        if rng.random() > 0.15:
            continue
        tip_speed = rotor["speed_rpm"] * math.pi / 30 * rotor["radius"]
        speeds = (tip_speed * np.array([0.02, 0.1, 0.25])).tolist()
        angle = str(rng.choice(["collective", "lateral_cyclic", "longitudinal_cyclic"]))
        angles = {"angle": angle, "airspeed": speeds, "offset_deg": rng.uniform(-1.0, 1.0, 3).tolist()}
        control = str(rng.choice(sorted(data["controls"])))
        size = _size(data["controls"][control])
        factors = {
            "angle": angle,
            "control": control,
            "airspeed": speeds,
            "factor": rng.uniform(-size, size, 3).tolist(),
        }
        rotor["schedule"] = [angles, factors] if rng.random() < CALM else [factors]


def _pilot(data: dict[str, Any], rng: np.random.Generator) -> None:
    """Axes of the sticks, a held control that is no angle, and a speed of sound."""
    if rng.random() < 0.25:
        names = [name for name, control in data["controls"].items() if "axis" not in control]
        axes = rng.permutation(["roll", "pitch", "yaw", "none", "none", "none"]).tolist()
        for name, axis in zip(names, axes, strict=False):
            data["controls"][name]["axis"] = axis
    if rng.random() < 0.25:
        data["controls"]["trim_wheel"] = {
            "range": [-10.0, 10.0],
            "unit": "clicks",
            "held": float(rng.uniform(-2.0, 2.0)),
        }
        data["rotors"][0]["mixing"]["longitudinal_cyclic"]["trim_wheel"] = 2e-3
    if rng.random() < 0.25 and "altitude" not in data["environment"]:
        data["environment"]["speed_of_sound"] = float(rng.uniform(300.0, 360.0))


def _size(control: dict[str, Any]) -> float:
    """Factor of a control on an angle that is a fifth of it, or some degrees over its range."""
    return 0.2 if "range_deg" in control else 1e-3


def _moving_surfaces(data: dict[str, Any], rng: np.random.Generator) -> None:
    """Controls that move surfaces, and coefficients of their own."""
    for surface in data["body"].get("surfaces", ()):
        if rng.random() < CALM:
            control = str(rng.choice(sorted(data["controls"])))
            size = _size(data["controls"][control])
            surface["mixing"] = {"incidence": {control: float(rng.uniform(-size, size))}}
            surface |= {"incidence_range_deg": [-20.0, 20.0], "incidence_rate_deg": 60.0}
        if rng.random() < CALM and "polar" not in surface:
            ends = {"zero_lift_angle_deg": (-4.0, 4.0), "lift_slope": (2.0, 6.0), "max_lift": (0.8, 1.4)}
            ends |= {"zero_lift_drag": (0.005, 0.02), "span_efficiency": (0.7, 1.0), "dynamic_pressure": (0.6, 1.0)}
            surface |= {key: float(rng.uniform(*pair)) for key, pair in ends.items() if rng.random() < 0.7}


def _tables(data: dict[str, Any], rng: np.random.Generator) -> None:
    """Tables of the fuselage over both angles, and the offsets of the blades in the other of their two ways."""
    fuselage = data["body"].get("fuselage")
    if fuselage and rng.random() < CALM:
        area = max(fuselage["drag"]["alpha"])
        for name in ("drag", "side", "lift", "roll", "pitch", "yaw"):
            scale = 0.1 * area * (1.0 if name in ("drag", "side", "lift") else data["rotors"][0]["radius"])
            for key, shape in (("alpha", 5), ("beta", 5), ("grid", (5, 5))):
                if rng.random() < 0.4:
                    fuselage.setdefault(name, {})[key] = (scale * rng.uniform(0.0, 1.0, shape)).tolist()
    for rotor in data["rotors"]:
        if "quarter_chord" in rotor and rng.random() < CALM:
            inner, outer = rotor["quarter_chord"]["values"][::2]
            rotor["quarter_chord"] = {"root": inner, "tip": outer}
            rotor["chordwise_cg"] = {"stations": [0.2, 0.8, 1.0], "values": [inner, inner, outer]}


def _ground(data: dict[str, Any], rng: np.random.Generator) -> None:
    """A ground below, level or not, with its effect, and with points that touch it."""
    if rng.random() > 0.3:
        return
    radius, weight = data["rotors"][0]["radius"], data["body"]["mass"] * GRAVITY
    ground: dict[str, Any] = {"effect": str(rng.choice(["none", "cheeseman_bennett", "measured"]))}
    lowest = max(0.0, *(rotor["hub"][2] for rotor in data["rotors"]))
    if rng.random() < CALM and "stand" not in data["body"]:
        ground["contact"] = "contact"
        data["contact_points"] = _legs(radius, weight, lowest + 0.1 * radius, rng)
        lowest += 0.1 * radius
    if rng.random() < 0.4:
        ground |= {"slope_deg": float(rng.uniform(0.0, 8.0)), "slope_heading_deg": float(rng.uniform(-180.0, 180.0))}
    data["ground"] = ground | {"altitude": -lowest - radius * float(rng.uniform(0.5, 3.0))}


def _legs(radius: float, weight: float, down: float, rng: np.random.Generator) -> list[dict[str, Any]]:
    """Three or four points, skids or wheels."""
    count, points = int(rng.integers(3, 5)), []
    stiffness = weight / (count * 0.02 * radius)
    for k in range(count):
        angle = 2.0 * math.pi * (k + 0.5) / count
        point: dict[str, Any] = {
            "name": f"leg {k + 1}",
            "position": [0.4 * radius * math.cos(angle), 0.3 * radius * math.sin(angle), down],
            "stiffness": stiffness,
            "damping": 0.3 * math.sqrt(stiffness * weight / GRAVITY / count),
            "friction": float(rng.uniform(0.3, 1.0)),
        }
        if rng.random() < CALM:
            point |= {"rolling": [1.0, 0.0, 0.0], "rolling_friction": 0.03}
        if rng.random() < CALM:
            point |= {
                "side_stiffness": 0.5 * stiffness,
                "side_damping": 0.4 * point["damping"],
                "onset": 0.002 * radius,
            }
        points.append(point)
    return points


def _options(data: dict[str, Any], rng: np.random.Generator) -> None:
    """Interpolation, number of elements, wash of the rotors on one another, and what limits and moves engines."""
    options = data["options"]
    if rng.random() < CALM:
        options["interpolation"] = "smooth"
    if rng.random() < 0.25:
        options["elements"] = int(rng.integers(8, 40))
    if 1 < len(data["rotors"]) <= MOST_WASHED and rng.random() < 0.25:
        options["interference"] = "skewed_wake"
    for drive in data.get("drives", ()):
        engine = drive.get("engine", {})
        if engine and rng.random() < 0.25:
            speeds = {rotor["name"]: rotor["speed_rpm"] for rotor in data["rotors"]}
            engine["max_power"] = (
                engine["max_torque"] * speeds[drive["rotors"][0]] * math.pi / 30 * rng.uniform(0.8, 1.2)
            )
        if engine and rng.random() < 0.25:
            control = str(rng.choice(sorted(data["controls"])))
            factor = _size(data["controls"][control]) * float(rng.uniform(-1.0, 1.0))
            drive.setdefault("mixing", {})["throttle"] = {control: factor}


NEWER = _blade_pairs, _sections, _ducts, _schedules, _moving_surfaces, _tables, _ground, _options, _pilot

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


# --- which keys there are -----------------------------------------------------------------------------------------


def schema_keys(schema: dict[str, Any] | None = None, path: str = "") -> set[str]:
    """Paths of all keys and choices of an aircraft file, lists without their numbers, names of one's own as *."""
    schema = schema_of(Description) if schema is None else schema
    if "items" in schema and "properties" in schema["items"]:
        return schema_keys(schema["items"], path)
    found = {f"{path} = {value}" for value in schema.get("enum", ()) if value != schema.get("default")}
    named = schema.get("additionalProperties")
    children = schema.get("properties", {}) | ({"*": named} if isinstance(named, dict) else {})
    for key, child in children.items():
        found |= schema_keys(child, f"{path}.{key}".removeprefix("."))
    return found or {path}


def drawn_keys(data: Any, known: set[str], path: str = "") -> set[str]:
    """Those of `schema_keys` that are in a mapping of an aircraft file."""
    if isinstance(data, dict):
        return set().union(*(drawn_keys(value, known, _child(path, key, known)) for key, value in data.items()))
    if isinstance(data, list) and data and isinstance(data[0], dict):
        return set().union(*(drawn_keys(item, known, path) for item in data))
    values = data if isinstance(data, list) else [data]
    return {path, *(f"{path} = {value}" for value in values)} & known


def _child(path: str, key: str, known: set[str]) -> str:
    """Path of a key, or of any name where the file has names of its own."""
    own, any_name = (f"{path}.{name}".removeprefix(".") for name in (key, "*"))
    return (
        any_name if any(one == any_name or one.startswith((f"{any_name}.", f"{any_name} ")) for one in known) else own
    )
