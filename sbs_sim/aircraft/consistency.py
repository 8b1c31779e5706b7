"""Relations between several values of an aircraft that physics demands and no JSON schema can express."""

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from sbs_sim.aircraft.description import STAND_AXES, Array, Range, Rotor

if TYPE_CHECKING:
    from sbs_sim.aircraft import Aircraft


def consistency_problems(aircraft: "Aircraft") -> list[str]:
    """All violated relations between the values of an aircraft, each as "path = value: what is allowed"."""
    problems = _inertia_problems("body.inertia", aircraft.body.inertia)
    options = aircraft.options
    if options.coupling == "complete":
        for key, value in (("hub_moment", options.hub_moment), ("flap_inertia", options.flap_inertia)):
            if value in ("paper", "axis_to_tip"):
                problems.append(f"options.{key} = {value!r}: allowed with options.coupling = paper only")
    for name, limits in aircraft.control_ranges.items():
        problems += _range_problems(f"controls.{name}.range_deg", limits)
    for i, rotor in enumerate(aircraft.rotors):
        problems += [f"rotors[{i}].{problem}" for problem in _rotor_problems(rotor)]
    names = [rotor.name for rotor in aircraft.rotors]
    for path, name in (("name", aircraft.name), *((f"rotors[{i}].name", name) for i, name in enumerate(names))):
        if not name.isprintable():  # names appear in terminals and web pages
            problems.append(f"{path} = {name!r}: allowed are printable characters")
    problems += [f"rotors[{i}].name = {name!r}: used twice" for i, name in enumerate(names) if name in names[:i]]
    if problems:
        return problems
    if aircraft.body.is_stand:  # in place of a body
        return _stand_problems(aircraft)
    mass, _, inertia = aircraft.fuselage()
    if mass <= 0:
        blades = aircraft.body.mass - mass
        return [f"body.mass = {aircraft.body.mass}: allowed is > {blades:g}, the mass of all blades"]
    return _inertia_problems("body.inertia without the blades", inertia)


def _stand_problems(aircraft: "Aircraft") -> list[str]:
    """What a stand cannot be."""
    body, options = aircraft.body, aircraft.options
    problems = []
    if options.coupling != "complete":
        problems.append(f"options.coupling = {options.coupling!r}: allowed on a stand is complete only")
    for i, axis in enumerate(STAND_AXES):
        if body.stand_free[i] and body.stand_mass[i] <= 0:
            problems.append(f"body.stand.mass[{i}] = {body.stand_mass[i]:g}: allowed is > 0, since {axis} is free")
        if not body.stand_free[i]:
            for key, values in (("spring", body.stand_spring), ("damping", body.stand_damping)):
                if values[i]:
                    problems.append(f"body.stand.{key}[{i}] = {values[i]:g}: allowed is 0, since {axis} is locked")
    return problems


def _inertia_problems(path: str, inertia: Array) -> list[str]:
    shown = inertia.round(6).tolist()
    if not np.allclose(inertia, inertia.T, rtol=0, atol=1e-12 * abs(inertia).max()):
        return [f"{path} = {shown}: allowed is a symmetric matrix"]
    moments = np.linalg.eigvalsh(inertia)
    if moments[0] <= 0:
        return [f"{path} = {shown}: allowed is a positive definite matrix"]
    if moments[2] > (moments[0] + moments[1]) * (1 + 1e-9):
        return [f"{path} = {shown}: allowed are principal moments of which none exceeds the sum of the others"]
    return []


def _range_problems(path: str, limits: Range) -> list[str]:
    low, high = (round(math.degrees(value), 9) for value in limits)
    return [] if low <= high else [f"{path} = [{low:g}, {high:g}]: allowed is a lower end below the upper one"]


def _rotor_problems(rotor: Rotor) -> list[str]:
    length = rotor.blade_length
    relations = [
        (np.linalg.norm(rotor.shaft_direction) > 1e-6, "shaft_direction", "a vector that is not zero"),
        (rotor.hinge_offset < rotor.radius, "hinge_offset", f"< {rotor.radius:g}, the radius"),
        (
            rotor.flap_hinge_offset <= rotor.hinge_offset,
            "flap_hinge_offset",
            f"<= {rotor.hinge_offset:g}, the hinge_offset",
        ),
        (
            rotor.root_cutout < length or length <= 0,
            "root_cutout",
            f"< {length:g}, from the flap hinge to the tip",
        ),
        (
            rotor.blade_cg <= length / math.sqrt(3) or length <= 0,
            "blade_cg",
            f"<= {length / math.sqrt(3):.6g}, L/sqrt(3): the blade's second moment is m_b L^2/3",
        ),
    ]
    problems = [
        f"{key} = {_plain(getattr(rotor, key))}: allowed is {text}" for is_met, key, text in relations if not is_met
    ]
    problems += _range_problems("collective_range_deg", rotor.collective_range)
    return problems + _range_problems("cyclic_range_deg", rotor.cyclic_range)


def _plain(value: Any) -> str:
    return str(value.tolist() if isinstance(value, np.ndarray) else value)
