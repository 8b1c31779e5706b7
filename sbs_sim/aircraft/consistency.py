"""Relations between several values of an aircraft that physics demands and no JSON schema can express."""

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from sbs_sim import checks
from sbs_sim.aircraft.blade_mass import MIN_BLADE_MASS
from sbs_sim.aircraft.blade_offsets import blade_moments
from sbs_sim.aircraft.description import CONTACT, STAND_AXES, TRIMMED_CONTROLS, Array, MixingSchedule, Range, Rotor
from sbs_sim.aircraft.part_consistency import part_problems
from sbs_sim.model.airfoil import FINEST_DEG, MAX_HALF, NUMBER_NAMES, common_half
from sbs_sim.model.descent import POWER_FACTOR
from sbs_sim.model.separation import STALL_LAGS
from sbs_sim.model.state import CONTROL_NAMES, EULER_NAMES, SWASHPLATE_NAMES
from sbs_sim.model.unsteady_airfoil import STATION

if TYPE_CHECKING:
    from sbs_sim.aircraft import Aircraft


# Names of what trims, flights and sweeps give beside states and controls.
RESERVED_NAMES = frozenset(
    {*EULER_NAMES, *SWASHPLATE_NAMES, "time", "thrust", "torque", "power", "state", "controls", "swashplate", "pitch"}
    | {"roll", "heading", "airspeed", "climb_rate", "turn_rate", "residual", "acceleration", "warnings"}
    | {"contact_force", "contact_depth"}
) - {*CONTROL_NAMES}
MAX_SWEEP_DEG = 60.0
MIN_LENGTH = 1e-6  # m, of a damper
STOP_FREQUENCY = 6.0  # per revolution, of a blade on a lag stop: the default step has 25 a revolution
TABLES = (("chord", "chord"), ("twist_deg", "twist"), ("quarter_chord", "quarter"), ("chordwise_cg", "centre"))
REQUIRED_TABLES = ("chord", "twist_deg")
LINE, TABLE = ("root", "tip"), ("stations", "values")  # the two ways to give values along the blade


def table_problems(rotors: Sequence[Rotor]) -> list[str]:
    """What is wrong with the values along the blades, which are checked before the mean chord is needed."""
    problems = [
        f"rotors[{i}].{key}{problem}"
        for i, rotor in enumerate(rotors)
        for key, name in TABLES
        if (key in REQUIRED_TABLES) or any(getattr(rotor, f"{name}_{part}") is not None for part in (*LINE, *TABLE))
        for problem in _table_problems(**{part: getattr(rotor, f"{name}_{part}") for part in (*LINE, *TABLE)})
    ] + [
        f"rotors[{i}].outboard_airfoils{problem}"
        for i, rotor in enumerate(rotors)
        for problem in _airfoil_problems(rotor.outboard_stations, rotor.outboard_airfoils)
    ]
    return problems + [
        f"rotors[{i}].mass_distribution{p}" for i, rotor in enumerate(rotors) for p in _mass_problems(rotor)
    ]


def _airfoil_problems(stations: Array | None, values: tuple[str, ...] | None) -> list[str]:
    if stations is None and values is None:
        return []
    if stations is None or values is None:
        return [f".{TABLE[0] if stations is None else TABLE[1]}: missing key"]
    if len(stations) != len(values):
        return [f".values: allowed are {len(stations)} names, one of each station, not {len(values)}"]
    if not np.all(np.diff(stations) > 0):
        return [f".stations = {stations.tolist()}: allowed are increasing numbers"]
    return []


def _section_problems(aircraft: "Aircraft", i: int) -> list[str]:
    """Tables along a blade must fit together: one axis, and angles of one step."""
    tables, names = aircraft.sections[i], aircraft.rotors[i].airfoil_names
    axis = aircraft.number_axis(i)
    for k, (table, name) in enumerate(zip(tables, names, strict=True)):
        if table.axis != axis and len(table.numbers) > 1:
            own, allowed = NUMBER_NAMES[table.axis], NUMBER_NAMES[axis]
            where = f"rotors[{i}].outboard_airfoils.values[{k - 1}] = {name!r}"
            return [f"{where}: is over the {own}, allowed are tables over the {allowed} as the one inboard"]
    if common_half(tables) > max(MAX_HALF, *(table.half for table in tables)):
        allowed = f"tables whose angles are multiples of one step of {FINEST_DEG:g} deg or more"
        return [f"rotors[{i}].outboard_airfoils.values = {list(names[1:])}: allowed are {allowed}"]
    return []


def _table_problems(**parts: Any) -> list[str]:
    given = [part for part, value in parts.items() if value is not None]
    if not given:
        return [": missing key"]
    kinds = [kind for kind in (LINE, TABLE) if set(kind) & set(given)]
    if len(kinds) > 1:
        return [f": has {', '.join(given)}, allowed are root and tip, or stations and values"]
    if missing := [part for part in kinds[0] if part not in given]:
        return [f".{missing[0]}: missing key"]
    if kinds[0] == LINE:
        return []
    if problems := _station_problems(parts["stations"], parts["values"]):
        return problems
    if not np.all(np.diff(parts["stations"]) > 0):
        return [f".stations = {parts['stations'].tolist()}: allowed are increasing numbers"]
    return []


def _station_problems(stations: Array | None, values: Array | None) -> list[str]:
    """A part of a table that is not there, or parts of two lengths."""
    if stations is None or values is None:
        return [".stations: missing key" if stations is None else ".values: missing key"]
    if len(stations) != len(values):
        return [f".values: allowed are {len(stations)} numbers, one of each station, not {len(values)}"]
    return []


def _mass_problems(rotor: Rotor) -> list[str]:
    """What is wrong with the mass along the blades."""
    stations, values = rotor.mass_stations, rotor.mass_values
    if stations is None and rotor.blade_mass > 0.0:  # the file gives the integrals
        return []
    if problems := _station_problems(stations, values):
        return problems
    assert stations is not None and values is not None, "checked above"  # noqa: PT018
    if not np.all(np.diff(stations) >= 0):
        return [f".stations = {stations.tolist()}: allowed are numbers in order"]
    if rotor.blade_mass < MIN_BLADE_MASS and rotor.hinge_offset < rotor.radius:
        return [f".values = {checks.shown(values.tolist())}: allowed is some mass between flap hinge and tip"]
    return []


def consistency_problems(aircraft: "Aircraft") -> list[str]:
    """All violated relations between the values of an aircraft, each as "path = value: what is allowed"."""
    problems = _inertia_problems("body.inertia", aircraft.body.inertia)
    options = aircraft.options
    if options.coupling == "complete":
        for key, value in (("hub_moment", options.hub_moment), ("flap_inertia", options.flap_inertia)):
            if value in ("paper", "axis_to_tip"):
                problems.append(f"options.{key} = {value!r}: allowed with options.coupling = paper only")
    problems += _control_problems(aircraft)
    problems += part_problems(aircraft)
    problems += _contact_problems(aircraft)
    for i, rotor in enumerate(aircraft.rotors):
        problems += [f"rotors[{i}].{problem}" for problem in _rotor_problems(rotor)]
        problems += _section_problems(aircraft, i)
        problems += [f"rotors[{i}].{problem}" for problem in _lag_stop_problems(aircraft, rotor)]
        problems += [f"rotors[{i}].{problem}" for problem in _offset_problems(aircraft, rotor)]
    names = [rotor.name for rotor in aircraft.rotors]
    surfaces = [surface.name for surface in aircraft.body.surfaces]
    named = [("name", aircraft.name), *((f"rotors[{i}].name", name) for i, name in enumerate(names))]
    for path, name in (*named, *((f"body.surfaces[{i}].name", name) for i, name in enumerate(surfaces))):
        if not name.isprintable():  # names appear in terminals and web pages
            problems.append(f"{path} = {name!r}: allowed are printable characters")
    problems += [f"rotors[{i}].name = {name!r}: used twice" for i, name in enumerate(names) if name in names[:i]]
    problems += [
        f"body.surfaces[{i}].name = {name!r}: used twice" for i, name in enumerate(surfaces) if name in surfaces[:i]
    ]
    problems += _drive_problems(aircraft, names)
    problems += [
        f"rotors[{i}].{p}" for i, rotor in enumerate(aircraft.rotors) for p in _teeter_problems(aircraft, rotor)
    ]
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


def _drive_problems(aircraft: "Aircraft", names: list[str]) -> list[str]:
    problems, joined = [], list[str]()
    if aircraft.drives and aircraft.options.coupling != "complete":
        problems.append(f"options.coupling = {aircraft.options.coupling!r}: allowed with drives is complete")
    for i, drive in enumerate(aircraft.drives):
        for name in drive.rotors:
            if name not in names:
                problems.append(f"drives[{i}].rotors = {name!r}: allowed are {', '.join(names)}")
            if name in joined:
                problems.append(f"drives[{i}].rotors = {name!r}: driven twice")
            joined.append(name)
        if (length := float(np.linalg.norm(drive.inertia_axis))) > 1 + 1e-9:
            problems.append(f"drives[{i}].inertia_axis has the length {length:g}: allowed is up to 1")
        if drive.engine != "none" and drive.max_torque == 0:
            problems.append(f"drives[{i}].engine.max_torque = 0: allowed with an engine is > 0")
        if drive.mixing and drive.engine == "none":
            problems.append(f"drives[{i}].mixing: not allowed without an engine")
        if drive.mixing.get("set_point") and not drive.has_governor:
            problems.append(f"drives[{i}].mixing.set_point: not allowed without a governor")
        if drive.empty_voltage > drive.full_voltage:
            problems.append(
                f"drives[{i}].battery.empty_voltage = {drive.empty_voltage:g}: allowed is up to"
                f" {drive.full_voltage:g}, the full_voltage"
            )
        if drive.proportional_gain > 0 and drive.integral_gain == 0:
            problems.append(f"drives[{i}].governor.integral_gain = 0: allowed with a proportional_gain is > 0")
    return problems


def _contact_problems(aircraft: "Aircraft") -> list[str]:
    """Of the points that touch the ground."""
    points, problems = aircraft.contact_points, []
    names = [point.name for point in points]
    problems += [
        f"contact_points: name = {name}: used twice" for name in sorted({n for n in names if names.count(n) > 1})
    ]
    for i, point in enumerate(points):
        if point.rolling is not None and np.linalg.norm(point.rolling) < MIN_LENGTH:
            problems.append(
                f"contact_points[{i}].rolling = {point.rolling.tolist()}: allowed is a vector that is not zero"
            )
    if aircraft.has_contact and not points:
        problems.append(f"ground.contact = {CONTACT!r}: allowed with contact_points only")
    if aircraft.has_contact and aircraft.body.is_stand:
        problems.append(f"ground.contact = {CONTACT!r}: not allowed on a stand")
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


def _control_problems(aircraft: "Aircraft") -> list[str]:
    """Of the pilot controls, and of the names in the mixing."""
    problems = []
    for control in aircraft.controls:
        given, path = aircraft.data["controls"][control.name], f"controls.{control.name}"
        if len({"range_deg", "range"} & given.keys()) != 1:
            problems.append(f"{path}: allowed is range_deg for an angle, or range with unit for any other control")
            continue
        end = "_deg" if control.is_angle else ""
        wrong = {"held", "unit"} if control.is_angle else {"held_deg"}
        problems += [f"{path}.{key}: not allowed with range{end}" for key in sorted(wrong & given.keys())]
        if not control.is_angle and (not control.unit.isprintable() or control.unit in ("", "rad", "deg")):
            problems.append(f"{path}.unit = {control.unit!r}: allowed is the unit of a control that is no angle")
        low, high = (round(control.shown(value), 9) for value in control.range)
        if low > high:
            problems.append(f"{path}.range{end} = [{low:g}, {high:g}]: allowed is a lower end below the upper one")
        if control.held is not None and not control.range[0] <= control.held <= control.range[1]:
            problems.append(f"{path}.held{end} = {given[f'held{end}']:g}: allowed are {low:g} to {high:g}")
        if control.name in RESERVED_NAMES or aircraft.layout.has_name(control.name):
            problems.append(f"{path}: allowed is a name that no state or output has")
    found = [control.name for control in aircraft.controls if control.held is None]
    if len(found) != TRIMMED_CONTROLS and not (aircraft.body.is_stand and len(found) < TRIMMED_CONTROLS):
        words = ", ".join(found) or "none"
        problems.append(f"controls: allowed are {TRIMMED_CONTROLS} that trims find, without held; there are {words}")
    axes = [control.axis for control in aircraft.controls if control.axis]
    problems += [f"controls: axis = {axis}: used twice" for axis in sorted({a for a in axes if axes.count(a) > 1})]
    names = [control.name for control in aircraft.controls]
    for i, rotor in enumerate(aircraft.rotors):
        for angle, factors in rotor.mixing.items():
            unknown = [name for name in factors if name not in names]
            where = ", ".join(f"rotors[{i}].mixing.{angle}.{name}" for name in unknown)
            problems += [f"{where}: unknown key, allowed are {', '.join(names)}"] if unknown else []
    problems += [
        f"rotors[{i}].schedule[{k}].control = {entry.control!r}: allowed are {', '.join(names)}"
        for i, rotor in enumerate(aircraft.rotors)
        for k, entry in enumerate(rotor.schedule)
        if entry.control and entry.control not in names
    ]
    parts = [(f"drives[{i}]", drive.mixing) for i, drive in enumerate(aircraft.drives)]
    parts += [(f"body.surfaces[{i}]", surface.mixing) for i, surface in enumerate(aircraft.body.surfaces)]
    for path, mixing in parts:
        for command, factors in mixing.items():
            unknown = [name for name in factors if name not in names]
            where = ", ".join(f"{path}.mixing.{command}.{name}" for name in unknown)
            problems += [f"{where}: unknown key, allowed are {', '.join(names)}"] if unknown else []
    return problems


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
            rotor.blade_inertia is not None or rotor.blade_cg <= length / math.sqrt(3) or length <= 0,
            "blade_cg",
            f"<= {length / math.sqrt(3):.6g}, L/sqrt(3): the blade's second moment is m_b L^2/3",
        ),
        (
            rotor.blade_inertia is None
            or rotor.mass_stations is not None
            or rotor.blade_inertia >= rotor.first_moment * rotor.blade_cg,
            "blade_inertia",
            f">= {rotor.first_moment * rotor.blade_cg:.6g}, blade_mass blade_cg^2",
        ),
    ]
    relations += [
        (rotor.duct_exit is None or rotor.duct_expansion == 0.5, "duct_expansion", "0.5, with duct.exit_area"),
    ]
    relations += [
        (
            rotor.tip_loss_model == "factor" or rotor.tip_loss == 1.0,
            "tip_loss",
            "1, with tip_loss_model = prandtl",
        ),
    ]
    if rotor.has_wake_states:
        limit = STATION * rotor.radius - rotor.hinge_offset
        begin = f"< {limit:.6g}, {STATION:g} of the radius, with unsteady_airfoil = {rotor.unsteady_airfoil}"
        relations += [
            (rotor.blades > 2, "unsteady_airfoil", "steady, of a rotor with two blades"),
            (rotor.root_cutout < limit, "root_cutout", begin),
        ]
    if rotor.descent == "measured":
        factor = f"{POWER_FACTOR:g}, with descent = measured"
        relations += [
            (rotor.wake_expansion == 0.5 and rotor.duct_exit is None, "descent", "momentum, of a rotor with a duct"),
            (rotor.induced_power_factor == POWER_FACTOR, "induced_power_factor", factor),
        ]
    else:
        relations += [(rotor.ring_unsteadiness == 0.0, "ring_unsteadiness", "0, without descent = measured")]
    factors = rotor.lag_damping_factors
    relations += [
        (len(factors) == rotor.blades, "blade_lag_damping", f"a list of {rotor.blades}, one of each blade"),
    ]
    problems = [
        f"{key} = {_plain(getattr(rotor, key))}: allowed is {text}" for is_met, key, text in relations if not is_met
    ]
    if rotor.damper_damping > 0.0 and _damper_length(rotor) < MIN_LENGTH:
        allowed = "0 where both ends of the damper are in one place"
        problems.append(f"lag_damper.damping = {rotor.damper_damping}: allowed is {allowed}")
    of_duct = (rotor.duct_turning, rotor.ram_recovery, rotor.lip_arm, rotor.lip_stall)
    if rotor.duct_exit is None and of_duct != (1.0, 1.0, 0.0, None):
        problems.append("duct.exit_area: missing; allowed is 0.25 to 4")
    if not rotor.has_stall_vortex and rotor.stall_lags != STALL_LAGS:
        problems.append("stall_lags: allowed only with dynamic_stall = leishman_beddoes")
    for i, entry in enumerate(rotor.schedule):
        problems += [f"schedule[{i}].{problem}" for problem in _schedule_problems(entry)]
    problems += _range_problems("collective_range_deg", rotor.collective_range)
    return problems + _range_problems("cyclic_range_deg", rotor.cyclic_range)


def _teeter_problems(aircraft: "Aircraft", rotor: Rotor) -> list[str]:
    """What a teetering rotor cannot be."""
    if not rotor.is_teetering:
        return []
    relations = [
        (rotor.blades == 2, f"blades are {rotor.blades}: allowed are 2"),
        (rotor.hinge_offset == 0.0, f"hinge_offset is {rotor.hinge_offset:g}: allowed is 0, the hinge is at the axis"),
        (aircraft.options.coupling == "complete", "options.coupling is paper: allowed is complete"),
    ]
    return [f"flap_hinge = 'teetering', {text}" for is_met, text in relations if not is_met]


def _offset_problems(aircraft: "Aircraft", rotor: Rotor) -> list[str]:
    """Offsets from the pitch axis that no blade, or no equation here, can have."""
    if not rotor.has_offsets or rotor.hinge_offset >= rotor.radius:
        return []
    if aircraft.options.coupling != "complete":
        return [f"options.coupling = {aircraft.options.coupling!r}: allowed with offsets of the blade is complete"]
    problems = []
    if any(one.tip_loss_model != "factor" or one.profile_drag != "section" for one in aircraft.rotors):
        allowed = "allowed where a rotor of the aircraft has offsets of its blades are factor and section"
        problems.append(f"tip_loss_model, profile_drag: {allowed}")
    if aircraft.section_states:
        problems.append("dynamic_stall: allowed where a rotor of the aircraft has offsets of its blades is none")
    if rotor.undersling and not rotor.is_teetering:
        problems.append(f"undersling = {rotor.undersling:g}: allowed is 0 where flap_hinge is not teetering")
    stations = np.unique(np.concatenate([[0.0, 1.0], *([] if rotor.quarter_stations is None else [_inner(rotor)])]))
    sweep = math.degrees(float(np.abs(rotor.sweep_at((stations[1:] + stations[:-1]) / 2.0)).max()))
    if sweep > MAX_SWEEP_DEG:
        problems.append(f"quarter_chord: a sweep of {sweep:.3g} deg: allowed are up to {MAX_SWEEP_DEG:g}")
    moments = blade_moments(rotor)
    first = moments.vector()
    about_centre = moments.matrix() - np.outer(first, first) / rotor.blade_mass
    if np.linalg.eigvalsh(about_centre).min() < -1e-9 * moments.second:
        problems.append("chordwise_cg: no blade of this mass, c.g. and inertia has it; allowed with mass_distribution")
    return problems


def _inner(rotor: Rotor) -> Array:
    """Stations of the quarter chord as shares of the length from the flap hinge, those on the blade."""
    assert rotor.quarter_stations is not None, "checked before"
    shares = (rotor.quarter_stations * rotor.radius - rotor.hinge_offset) / rotor.blade_length
    return np.asarray(shares[(shares > 0.0) & (shares < 1.0)])


def _lag_stop_problems(aircraft: "Aircraft", rotor: Rotor) -> list[str]:
    """Stops must leave the blade room, and be soft enough for the default step (theory.md section 3.5)."""
    spring, damping = rotor.lag_stop_spring, rotor.lag_stop_damping
    if rotor.lag_stops is None:
        return ["lag_stop.range_deg: missing key"] if spring or damping else []
    if not rotor.lag_stops[0] < 0.0 < rotor.lag_stops[1]:
        shown = [round(math.degrees(end), 9) for end in rotor.lag_stops]
        return [f"lag_stop.range_deg = {shown}: allowed are a negative and a positive end"]
    inertia = _moved_by_lag(aircraft, rotor)
    most = inertia * (STOP_FREQUENCY * rotor.speed) ** 2
    if not 0.0 < spring <= most:
        text = f"{STOP_FREQUENCY:g} per revolution on the inertia that lag moves, {inertia:.6g} kg m^2"
        return [f"lag_stop.stiffness = {spring:g}: allowed is > 0 and up to {most:.6g}, {text}"]
    most = 2.0 * math.sqrt(spring * inertia)
    if damping > most * (1 + 1e-9):
        return [f"lag_stop.damping = {damping:g}: allowed is up to {most:.6g}, at which a stop does not swing"]
    return []


def _moved_by_lag(aircraft: "Aircraft", rotor: Rotor) -> float:
    """Inertia that all blades together move about their lag hinges, with a drive that gives way [kg m^2]."""
    e_l, e_f = rotor.hinge_offset - rotor.flap_hinge_offset, rotor.flap_hinge_offset
    inertia, moment = rotor.lag_inertia, e_l * (rotor.blade_mass * e_f + rotor.first_moment)
    for drive in aircraft.drives:
        if rotor.name in drive.rotors:
            driven = [one for one in aircraft.rotors if one.name in drive.rotors]
            first = next((one for one in driven if one.name == drive.rotors[0]), rotor)
            blades = sum(one.blades * (one.speed / first.speed) ** 2 for one in driven)
            about_axis = rotor.blade_mass * e_l**2 + 2.0 * moment + inertia
            inertia -= (inertia + moment) ** 2 / (about_axis + drive.inertia / blades)
    return float(inertia)


def _schedule_problems(entry: MixingSchedule) -> list[str]:
    used, unused = ("factor", "offset_deg") if entry.control else ("offset_deg", "factor")
    given = {"factor": entry.factor, "offset_deg": entry.offset}
    if not len(entry.airspeed) or not (np.diff(entry.airspeed) > 0.0).all():
        return ["airspeed: allowed are one or more numbers that increase"]
    if len(given[unused]):
        return [f"{unused}: allowed {'without' if entry.control else 'with'} a control only"]
    if len(given[used]) != len(entry.airspeed):
        return [f"{used}: allowed is a list of {len(entry.airspeed)}, the number of airspeed"]
    return []


def _damper_length(rotor: Rotor) -> float:
    """Length of the axial lag damper without flap and pitch, at the rest angle of lag [m], eq. (3.7)."""
    return math.hypot(rotor.damper_b + rotor.damper_c, rotor.damper_d - rotor.damper_r, rotor.damper_a)


def _plain(value: Any) -> str:
    return str(value.tolist() if isinstance(value, np.ndarray) else value)
