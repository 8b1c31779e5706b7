"""Records of the compiled model for one aircraft, each with a single lane; `sbs_sim.model.packing` arranges them."""

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sbs_sim.aircraft.blade_offsets import blade_moments, inward_shift
from sbs_sim.aircraft.commands import scheduled_controls
from sbs_sim.aircraft.declaration import model_values
from sbs_sim.aircraft.description import ENGINES, GROUND_EFFECTS, Body, Drive, Rotor
from sbs_sim.aircraft.interference import records_of
from sbs_sim.aircraft.surfaces import Parts, parts_of, slope_changes
from sbs_sim.model import records as R
from sbs_sim.model.airfoil import DEGREE, AirfoilTable, Grid, cell_grid, cells, common_grid, interpolate
from sbs_sim.model.elementary import cosine_and_sine
from sbs_sim.model.frames import hub_axes
from sbs_sim.model.section_options import NO_TIP_LOSS, TIP_LOSS
from sbs_sim.model.solve import length
from sbs_sim.model.state import (
    ENGINE_TORQUE,
    GOVERNOR,
    ROW,
    SPEED,
    SWASHPLATE_NAMES,
    UNSEEN_NAMES,
    WAKE_NAMES,
    harmonic_count,
)
from sbs_sim.model.unsteady_airfoil import RATES, SHARES, STATION

if TYPE_CHECKING:
    from sbs_sim.aircraft import Aircraft

Array = NDArray[np.float64]
SECONDS_PER_HOUR = 3600.0
NO_GROUND = 1e9  # m, depth of the ground where there is none
REACH = 1.5  # times the distance of the farthest point of contact, so that attitudes within a step may lack unit length
NO_STOP = 1e6  # rad
ATTACHED = math.radians(5.0)  # to either side of which the slope of the lift is that of attached flow
MIN_DENSITY = 1e-12  # kg/m^3, less than at 300 km: below it is vacuum


def model_of(aircraft: "Aircraft") -> R.Model:
    """Records of an aircraft with lag and cyclic inflow (theory.md section 7)."""
    grids = [common_grid(tables) for tables in aircraft.sections]
    table, first_rows = _packed_tables(aircraft, grids)
    most = max(len(grid.knots) for grid in grids) - 2
    blades = R.records(R.BLADE, aircraft.layout.blade_count, 1)
    knots = R.aligned((len(blades), most, 1), float)
    quads = np.cumsum([0, *(-(-rotor.blades // R.QUAD) for rotor in aircraft.rotors)])
    number = 0
    pairs, influences = records_of(aircraft)
    for j, rotor in enumerate(aircraft.rotors):
        for k in range(rotor.blades):
            _set(blades[number], _blade_values(aircraft, rotor, k, grids[j]))
            blades[number]["quad"], blades[number]["starts_quad"] = quads[j] + k // R.QUAD, k % R.QUAD == 0
            blades[number]["elements"], blades[number]["harmonics"] = j, harmonic_count(rotor.blades)
            octet, lane = divmod(R.QUAD * int(quads[j]) + k, 2 * R.QUAD)
            blades[number]["separation_first"] = octet * aircraft.options.elements * 2 * R.QUAD + lane
            blades[number]["separation_stride"] = 2 * R.QUAD
            inner = grids[j].knots[1:-1]
            knots[number, :, 0] = np.concatenate([inner, np.full(most - len(inner), np.inf)])
            number += 1
    return R.Model(
        switches=_switches(aircraft),
        air=_air(aircraft),
        body=_body(aircraft),
        rotors=_rotors(aircraft, quads),
        drives=_drives(aircraft),
        blades=blades,
        indices=_state_indices(aircraft, quads),
        elements=_elements(aircraft, first_rows),
        knots=knots,
        table=table,
        stall=_stall(aircraft),
        **_parts(aircraft)._asdict(),
        **_schedules(aircraft),
        ground=ground_record(aircraft, aircraft.ground.altitude),
        contacts=_contacts(aircraft),
        pairs=pairs,
        influences=influences,
    )


def _packed_tables(aircraft: "Aircraft", grids: list[Grid]) -> tuple[Array, list[list[int]]]:
    """Cells of all airfoils, each once on each grid, and where those of each airfoil of each rotor begin."""
    parts, found = dict[tuple[AirfoilTable, Grid], Array](), list[list[tuple[AirfoilTable, Grid]]]()
    for grid, tables in zip(grids, aircraft.sections, strict=True):
        found.append([(table, grid) for table in tables])
        for table in tables:
            if (table, grid) not in parts:
                parts[table, grid] = cells(table, aircraft.options.interpolation, grid)
    starts = dict(zip(parts, np.cumsum([0, *map(len, parts.values())])[:-1].tolist(), strict=True))
    packed = R.aligned((sum(map(len, parts.values())), 4 * (DEGREE + 1)), float)
    packed[:] = np.concatenate(list(parts.values()))
    return packed, [[starts[key] for key in keys] for keys in found]


def _parts(aircraft: "Aircraft") -> Parts:
    """Surfaces and fuselage, and where the commands to surfaces are."""
    parts = parts_of(aircraft.body, aircraft.rotors)
    parts.surfaces["command_index"] = -1
    first = len(aircraft.rotors) + len(aircraft.commanded_drives)
    for row, i in enumerate(aircraft.commanded_surfaces, first):
        parts.surfaces["command_index"][i] = ROW * row
    return parts


def _schedules(aircraft: "Aircraft") -> dict[str, NDArray[Any]]:
    """What changes swashplate angles with the airspeed."""
    entries = [(j, entry) for j, rotor in enumerate(aircraft.rotors) for entry in rotor.schedule]
    points = max((len(entry.airspeed) for _, entry in entries), default=0)
    schedules, bends = R.records(R.SCHEDULE, len(entries), 1), R.aligned((len(entries), points, 2, 1), float)
    names = scheduled_controls(aircraft)
    first = len(aircraft.rows) - len(names)
    for k, (j, entry) in enumerate(entries):
        schedules[k]["first"][..., 0] = entry.values[0]
        schedules[k]["target"] = ROW * j + SWASHPLATE_NAMES.index(entry.angle)
        schedules[k]["source"] = ROW * (first + names.index(entry.control)) if entry.control else -1
        bends[k, : len(entry.airspeed), 0, 0] = entry.airspeed
        bends[k, : len(entry.airspeed), 1, 0] = slope_changes(entry.airspeed, entry.values)
    return {"schedules": schedules, "bends": bends}


def ground_record(aircraft: "Aircraft", altitude: float | None) -> NDArray[Any]:
    """Record of the ground at a height above the origin [m], or far below where there is none."""
    ground, record = aircraft.ground, R.records(R.GROUND, 1, 1)
    slope, heading = cosine_and_sine(ground.slope), cosine_and_sine(ground.slope_heading)
    down = np.array([-0.0 + slope[1] * heading[0], slope[1] * heading[1], slope[0]])
    up_slope = np.array([slope[0] * heading[0], slope[0] * heading[1], -slope[1]])
    values = {
        "down": down,
        "first": up_slope,
        "second": np.array([-heading[1], heading[0], 0.0]),
        "depth": NO_GROUND if altitude is None or altitude == -math.inf else -altitude * slope[0],
        "reach": REACH * max((length(point.position) for point in aircraft.contact_points), default=0.0),
    }
    _set(record[0], values)
    return record


def _contacts(aircraft: "Aircraft") -> NDArray[Any]:
    points = aircraft.contact_points if aircraft.has_contact else ()
    contacts = R.records(R.CONTACT, len(points), 1)
    for i, point in enumerate(points):
        stiffness, damping = point.sideways
        rolling = np.array([1.0, 0.0, 0.0]) if point.rolling is None else point.rolling / length(point.rolling)
        values = {
            **model_values(point, R.CONTACT),
            "rolling": rolling,
            "inverse_onset": 1.0 / point.onset,
            "side_stiffness": stiffness,
            "side_damping": damping,
        }
        _set(contacts[i], values)
        contacts[i]["is_wheel"], contacts[i]["state"] = point.rolling is not None, aircraft.layout.contact(i).start
    return contacts


def _stall(aircraft: "Aircraft") -> Array:
    angles = aircraft.stall_table
    stall = R.aligned((aircraft.layout.blade_count, *angles.shape[1:], 1), float)
    stall[..., 0] = np.repeat(angles, [rotor.blades for rotor in aircraft.rotors], axis=0)
    return stall


def with_fidelity(model: R.Model, lead_lag: bool, cyclic_inflow: bool) -> R.Model:
    """Model in which blades lag or not, and the inflow has its cyclic parts or not."""
    switches, blades, indices = model.switches.copy(), model.blades, model.indices
    switches["lead_lag"], switches["cyclic_inflow"] = lead_lag, cyclic_inflow
    zero = R.state_size(model)  # its index behind the state
    if not lead_lag:
        blades = R.aligned(blades.shape, blades.dtype)
        blades[:] = model.blades
        blades["lead_lag"] = 0.0
        indices = indices._replace(lag=np.full_like(indices.lag, zero), lag_rate=np.full_like(indices.lag_rate, zero))
    if not cyclic_inflow:
        indices = indices._replace(inflow=indices.inflow.copy())
        indices.inflow[1:] = zero
    return model._replace(switches=switches, blades=blades, indices=indices)


def with_steady_sections(model: R.Model) -> R.Model:
    """Model whose sections have the separation of the flow at the instant: for trims and linear models."""
    switches = model.switches.copy()
    switches["late_stall"] = 0
    return model._replace(switches=switches)


def _set(record: Any, values: dict[str, Any]) -> None:
    """Set fields of a record with a single lane."""
    for name, value in values.items():
        record[name][..., 0] = value


def _switches(aircraft: "Aircraft") -> NDArray[Any]:
    switches = R.records(R.SWITCHES, 1, 1)
    switches["lead_lag"] = switches["cyclic_inflow"] = 1
    switches["complete_coupling"] = aircraft.options.coupling == "complete"
    switches["axial_dampers"] = any(rotor.damper_damping > 0.0 for rotor in aircraft.rotors)
    switches["lag_stops"] = any(rotor.lag_stops is not None for rotor in aircraft.rotors)
    switches["offsets"] = any(rotor.has_offsets for rotor in aircraft.rotors)
    switches["complete_hub_moment"] = aircraft.options.hub_moment == "complete"
    if any(rotor.tip_loss_model == "prandtl" for rotor in aircraft.rotors):
        switches["section_options"] = TIP_LOSS
    elif aircraft.section_states or any(rotor.profile_drag == "oblique" for rotor in aircraft.rotors):
        switches["section_options"] = NO_TIP_LOSS
    switches["stand"] = aircraft.body.is_stand
    switches["scheduled"] = any(rotor.schedule for rotor in aircraft.rotors)
    switches["section_states"], switches["late_stall"] = aircraft.section_states, aircraft.section_states > 0
    switches["unsteady_airfoil"] = any(rotor.has_wake_states for rotor in aircraft.rotors)
    switches["ducts"] = any(rotor.duct_exit is not None for rotor in aircraft.rotors)
    switches["contact"] = aircraft.has_contact
    switches["ground_effect"] = GROUND_EFFECTS.index(aircraft.ground.effect)
    switches["teetering"] = any(rotor.is_teetering for rotor in aircraft.rotors)
    switches["interference"] = aircraft.options.meets_wakes
    switches["ring"] = any(rotor.ring_unsteadiness > 0.0 for rotor in aircraft.rotors)
    switches["wash"] = (switches["ground_effect"] > 0) | (switches["interference"] > 0) | (switches["ring"] > 0)
    return switches


def _air(aircraft: "Aircraft") -> NDArray[Any]:
    air, environment = R.records(R.AIR, 1, 1), aircraft.environment
    values = {**model_values(environment, R.AIR), **model_values(aircraft.body, R.AIR)}
    _set(air[0], values)
    return air


def _body(aircraft: "Aircraft") -> NDArray[Any]:
    body = R.records(R.BODY, 1, 1)
    complete = aircraft.options.coupling == "complete"
    if aircraft.body.is_stand:
        _set(body[0], _stand(aircraft.body))
        return body
    parts = aircraft.fuselage() if complete else (aircraft.body.mass, np.zeros(3), aircraft.body.inertia)
    _set(body[0], dict(zip(("mass", "first_moment", "inertia"), parts, strict=True)))
    return body


def _stand(body: Body) -> dict[str, Any]:
    """Values of a body that is a stand: its inertia is the fuselage's, its mass has a direction."""
    return {
        "inertia": np.diag(body.stand_mass[3:]),
        "free": body.stand_free[:3],
        "free_turn": body.stand_free[3:],
        "stand_mass": body.stand_mass[:3],
        "spring": body.stand_spring[:3],
        "turn_spring": body.stand_spring[3:],
        "damping": body.stand_damping[:3],
        "turn_damping": body.stand_damping[3:],
    }


def second_moment(aircraft: "Aircraft", rotor: Rotor) -> float:
    """A_1 in the equations of a blade [kg m^2]."""
    to_axis = aircraft.options.flap_inertia == "axis_to_tip" and rotor.blade_inertia is None
    return rotor.blade_mass * (rotor.radius * rotor.radius) / 3 if to_axis else rotor.second_moment


def _blade_values(aircraft: "Aircraft", rotor: Rotor, number: int, grid: Grid) -> dict[str, Any]:
    """Values of a blade's record except the integers."""
    columns, first_angle, inverse_step = cell_grid(grid)
    cos_phase, sin_phase = cosine_and_sine(rotor.swashplate_phase)
    cos_azimuth_offset, sin_azimuth_offset = cosine_and_sine(2.0 * math.pi * number / rotor.blades)
    inertia, factor = second_moment(aircraft, rotor), float(rotor.lag_damping_factors[number])
    return {
        **model_values(rotor, R.BLADE),
        "lag_damping": factor * rotor.lag_damping,
        "damper_damping": factor * rotor.damper_damping,
        **_lag_stops(rotor),
        "rotor_speed": _kept_speed(aircraft, rotor),
        "inflow_speed": rotor.induced_power_factor * rotor.speed,
        "duct_turning": _turning(rotor),
        "axes": hub_axes(rotor.shaft_direction),
        "lag_hinge_offset": rotor.hinge_offset - rotor.flap_hinge_offset,
        **_offset_values(rotor, inertia),
        "cos_phase": cos_phase,
        "sin_phase": sin_phase,
        "cos_azimuth_offset": cos_azimuth_offset,
        "sin_azimuth_offset": sin_azimuth_offset,
        "alternation": (1.0 - 2.0 * (number % 2)) if rotor.blades % 2 == 0 else 0.0,
        "lead_lag": 1.0,
        "tip_blades": rotor.blades if rotor.tip_loss_model == "prandtl" else 0,
        "element_width": (rotor.blade_length - rotor.root_cutout) / aircraft.options.elements / rotor.radius,
        "late_stall": rotor.has_late_separation,
        "stall_vortex": rotor.has_stall_vortex,
        "inverse_pressure_lag": 1.0 / rotor.pressure_lag,
        "inverse_vortex_lag": 1.0 / rotor.vortex_lag,
        "vortex_passage": rotor.vortex_passage,
        "oblique_drag": rotor.profile_drag == "oblique",
        **_wake_values(aircraft, rotor),
        "first_alpha": first_angle,
        "inverse_alpha_step": inverse_step,
        "alpha_cells": columns,
        "min_number": grid.range[0],
        "max_number": grid.range[1],
    }


def _wake_values(aircraft: "Aircraft", rotor: Rotor) -> dict[str, float]:
    """Values of the section whose circulation follows the flow (theory.md section 4.9)."""
    if not rotor.has_wake_states:
        return {}
    span = STATION * rotor.radius - rotor.hinge_offset
    share = span / rotor.blade_length
    table = aircraft.table_at(aircraft.rotors.index(rotor), STATION)
    by_chord = 2.0 / float(rotor.chord_at(share))
    return {
        "wake_span": span,
        "wake_pitch": float(rotor.twist_at(share)) - table.zero_lift_angle,
        "inverse_wake_radius": 1.0 / (STATION * rotor.radius),
        "tip_speed": rotor.speed * rotor.radius,
        "inverse_wake_speed": 1.0 / (rotor.speed * rotor.radius),
        "inverse_sound_speed": 1.0 / aircraft.environment.speed_of_sound,
        "wake_slow_share": SHARES[0],
        "wake_fast_share": SHARES[1],
        "wake_slow_rate": by_chord * RATES[0],
        "wake_fast_rate": by_chord * RATES[1],
    }


def _offset_values(rotor: Rotor, inertia: float) -> dict[str, float]:
    """Moments of a blade's mass; those across the span are of blades with offsets."""
    values = {
        "first_moment": rotor.first_moment,
        "second_moment": inertia,
        "hub_second_moment": rotor.second_moment,
        "inverse_second_moment": 1.0 / inertia,
    }
    if not rotor.has_offsets:
        return values
    moments = blade_moments(rotor)._asdict()
    first, second, height = (moments.pop(name) for name in ("first", "second", "height"))
    values |= {"first_moment": first, "second_moment": second, "hub_second_moment": second}
    return values | {"inverse_second_moment": 1.0 / second, "axis_height": height} | moments


def _lag_stops(rotor: Rotor) -> dict[str, float]:
    """Where the stops of a blade are, and what they are made of; without them it never comes there."""
    first, last = rotor.lag_stops or (-NO_STOP, NO_STOP)
    return {"lag_stop_first": first, "lag_stop_last": last}


def _rotors(aircraft: "Aircraft", quads: NDArray[np.int64]) -> NDArray[Any]:
    rotors, layout, density = (
        R.records(R.ROTOR, len(aircraft.rotors), 1),
        aircraft.layout,
        aircraft.environment.air_density,
    )
    for j, rotor in enumerate(aircraft.rotors):
        tip_speed = rotor.speed * rotor.radius
        # in vacuum the coefficients are zero, not zero over zero
        pressure = density * math.pi * (rotor.radius * rotor.radius) * (tip_speed * tip_speed)
        values = {
            **model_values(rotor, R.ROTOR),
            "rotor_speed": _kept_speed(aircraft, rotor),
            "inflow_speed": rotor.speed,
            "gear": gear(aircraft, rotor),
            "axes": hub_axes(rotor.shaft_direction),
            "inverse_tip_speed": 1.0 / tip_speed,
            "coefficient_scale": 1.0 / pressure if density > MIN_DENSITY else 0.0,
            "inverse_blades": 1.0 / rotor.blades,
            "duct_expansion": rotor.wake_expansion,
            "duct_turning": _turning(rotor),
            "inverse_lip_stall": 0.0 if rotor.lip_stall is None else 1.0 / rotor.lip_stall,
            "momentum_scale": math.pi * (rotor.radius * rotor.radius) * (tip_speed * tip_speed),
            "ring_gain": ring_gain(aircraft, j) if rotor.ring_unsteadiness > 0.0 else 0.0,
        }
        _set(rotors[j], values)
        integers = {
            "blades": rotor.blades,
            "harmonics": harmonic_count(rotor.blades),
            "teetering": rotor.is_teetering,
            "measured_descent": rotor.descent == "measured",
            "duct": rotor.duct_exit is not None,
            "first_quad": quads[j],
            "quads": quads[j + 1] - quads[j],
            "flap": layout.flap(j).start,
            "flap_rate": layout.flap_rate(j).start,
            "lag": layout.lag(j).start,
            "lag_rate": layout.lag_rate(j).start,
            "inflow": layout.inflow(j).start,
            "wake": layout.wake(j).start if rotor.has_wake_states else -1,
            "drive": drive_of(aircraft, rotor),
        }
        for name, value in integers.items():
            rotors[j][name] = value
    return rotors


def ring_gain(aircraft: "Aircraft", number: int) -> float:
    """Uniform inflow that lowers the thrust coefficient of a rotor by one, over kappa_i, eq. (6.24)."""
    rotor, table = aircraft.rotors[number], aircraft.sections[number][-1]
    span, chord, half_area, lift_factor, _ = rotor.elements(aircraft.options.elements)
    radius = rotor.hinge_offset + span
    numbers = number_scale(aircraft, number, chord) * (rotor.speed * radius)
    lift, _ = interpolate(table, numbers, np.full(len(span), ATTACHED), aircraft.options.interpolation)
    other, _ = interpolate(table, numbers, np.full(len(span), -ATTACHED), aircraft.options.interpolation)
    slope = (lift - other) / (2.0 * ATTACHED)
    response = rotor.blades * float((half_area * radius * slope * lift_factor).sum()) / (math.pi * rotor.radius**3)
    return 1.0 / (response * rotor.induced_power_factor)


def drive_of(aircraft: "Aircraft", rotor: Rotor) -> int:
    """Index of the drive of a rotor, -1 for one whose speed is constant."""
    return next((i for i, drive in enumerate(aircraft.drives) if rotor.name in drive.rotors), -1)


def first_rotor(aircraft: "Aircraft", drive: Drive) -> Rotor:
    """Rotor at whose speed torques and inertia of a drive are."""
    return next(rotor for rotor in aircraft.rotors if rotor.name == drive.rotors[0])


def gear(aircraft: "Aircraft", rotor: Rotor) -> float:
    """Speed of a rotor over that of its drive; 0 without one."""
    number = drive_of(aircraft, rotor)
    return 0.0 if number < 0 else rotor.speed / first_rotor(aircraft, aircraft.drives[number]).speed


def _kept_speed(aircraft: "Aircraft", rotor: Rotor) -> float:
    """Speed of a rotor that does not change; 0 for one whose speed is a state."""
    return rotor.speed if drive_of(aircraft, rotor) < 0 else 0.0


def _turning(rotor: Rotor) -> float:
    """Share of the velocity along the disc that a duct turns; 0 without one."""
    return 0.0 if rotor.duct_exit is None else rotor.duct_turning


def _drives(aircraft: "Aircraft") -> NDArray[Any]:
    drives = R.records(R.DRIVE, len(aircraft.drives), 1)
    for i, drive in enumerate(aircraft.drives):
        speed, places = first_rotor(aircraft, drive).speed, aircraft.layout.drive(i)
        values = {
            "speed": speed,
            "inertia": drive.inertia,
            "momentum": drive.inertia * drive.inertia_axis,
            "drag": drive.drag / speed if drive.engine != "none" else 0.0,
            "max_torque": drive.max_torque,
            "max_power": drive.max_power,
            "inverse_lag": 1.0 / drive.lag,
            "throttle": drive.throttle,
            "set_point": drive.set_point * speed,
            "proportional_gain": drive.proportional_gain,
            "integral_gain": drive.integral_gain,
            "torque_constant": drive.torque_constant,
            "inverse_torque_constant": 1.0 / drive.torque_constant,
            "conductance": 1.0 / drive.resistance,
            "full_voltage": drive.full_voltage,
            "voltage_drop": drive.full_voltage - drive.empty_voltage,
            "inverse_capacity": 1.0 / (SECONDS_PER_HOUR * drive.capacity),
        }
        _set(drives[i], values)
        drives[i]["engine"], drives[i]["free_wheel"] = ENGINES.index(drive.engine), drive.free_wheel
        for field, name in (("speed", SPEED), ("torque", ENGINE_TORQUE), ("governor", GOVERNOR)):
            drives[i][f"{field}_index"] = places.get(name, -1)
        drives[i]["unseen_index"] = places[UNSEEN_NAMES[0]]
        commanded = aircraft.commanded_drives
        row = len(aircraft.rotors) + commanded.index(i) if i in commanded else -1
        drives[i]["command_index"] = ROW * row if row >= 0 else -1
    return drives


def _state_indices(aircraft: "Aircraft", quads: NDArray[np.int64]) -> R.StateIndices:
    """See `StateIndices`; the zero stands behind the state."""
    layout, zero = aircraft.layout, aircraft.layout.size
    harmonics = max(harmonic_count(rotor.blades) for rotor in aircraft.rotors)
    number = np.concatenate([np.full(quads[j + 1] - quads[j], j) for j in range(len(aircraft.rotors))])
    first = {
        name: [getattr(layout, name)(j).start for j in number] for name in ("flap", "flap_rate", "lag", "lag_rate")
    }
    for k, name in enumerate(WAKE_NAMES):
        wakes = [(layout.wake(j).start, layout.blades[j], aircraft.rotors[j].has_wake_states) for j in number]
        first[name] = [start + k * blades if has_wake else -1 for start, blades, has_wake in wakes]
    found = {}
    for name, starts in first.items():
        places = np.full((2 * harmonics + 2, len(number)), zero, dtype=np.int64)
        for quad, (start, j) in enumerate(zip(starts, number, strict=True)):
            if start < 0:
                continue
            blades = aircraft.rotors[j].blades
            turning = 1 + 2 * harmonic_count(blades)
            places[:turning, quad] = start + np.arange(turning)
            if blades % 2 == 0:
                places[-1, quad] = start + blades - 1
        found[name] = places
    inflow = np.array([layout.inflow(j).start for j in number])
    return R.StateIndices(
        azimuth=number.astype(np.int64),
        swash=(3 * number + np.arange(3)[:, None]).astype(np.int64),
        inflow=(inflow + np.arange(3)[:, None]).astype(np.int64),
        gust=(3 + R.GUST_ROWS * number + np.arange(R.GUST_ROWS)[:, None]).astype(np.int64),
        **found,
    )


def _elements(aircraft: "Aircraft", first_rows: list[list[int]]) -> NDArray[Any]:
    count = aircraft.options.elements
    elements = R.records(R.ELEMENT, (len(aircraft.rotors), count), 1)
    for j, rotor in enumerate(aircraft.rotors):
        for name, values in zip(R.ELEMENT, rotor.elements(count), strict=False):
            elements[name][j, :, 0] = values
        elements["number_scale"][j] = number_scale(aircraft, j, elements["chord"][j])
        airfoil = rotor.airfoil_at(elements["span"][j])
        elements["airfoil"][j], elements["first_row"][j] = airfoil, np.array(first_rows[j])[airfoil]
        elements["cos_sweep"][j] = 1.0
        if rotor.has_late_separation:
            elements["separation_rate"][j] = 2.0 / (rotor.separation_lag * elements["chord"][j])
        if rotor.has_stall_vortex:
            elements["inverse_semi_chord"][j] = 2.0 / elements["chord"][j]
        if rotor.has_offsets:
            _set_offsets(aircraft, j, elements[j])
    return elements


def _set_offsets(aircraft: "Aircraft", rotor: int, elements: NDArray[Any]) -> None:
    """Set where the quarter chord of elements is, and its sweep; Reynolds numbers are those of the chord across it."""
    own, span = aircraft.rotors[rotor], elements["span"][..., 0].copy()
    share = span / own.blade_length
    offset, sweep, twist = own.quarter_at(share), own.sweep_at(share), own.twist_at(share)
    elements["offset_along"][..., 0], elements["offset_up"][..., 0] = offset * np.cos(twist), offset * np.sin(twist)
    elements["cos_sweep"][..., 0], elements["sin_sweep"][..., 0] = np.cos(sweep), np.sin(sweep)
    if aircraft.number_axis(rotor) != "mach":
        elements["number_scale"] *= elements["cos_sweep"]
    elements["span"][..., 0] = span + inward_shift(own)


def number_scale(aircraft: "Aircraft", rotor: int, chord: Any) -> Any:
    """Reynolds or Mach number, whichever the rotor's airfoil table is over, of a section over its airspeed [s/m]."""
    environment = aircraft.environment
    if aircraft.number_axis(rotor) == "mach":
        return 1.0 / environment.speed_of_sound
    return chord * (1.0 / environment.kinematic_viscosity)
