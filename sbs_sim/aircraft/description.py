"""What an aircraft file describes: one declared field for each value.

A declaration holds type, range, unit, symbol, meaning and default of a value; range, unit and default are those of the
file. The attributes are in SI units and radians; docs/reference/aircraft.md lists them all. To add a value see
`sbs_sim.aircraft.declaration`.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sbs_sim.aircraft.atmosphere import MAX_ALTITUDE, MIN_ALTITUDE, standard_air
from sbs_sim.aircraft.blade_mass import MIN_BLADE_MASS, with_blade_mass
from sbs_sim.aircraft.declaration import (
    array,
    choice,
    converter,
    declared,
    frozen,
    integer,
    interval,
    left_out,
    list_schema,
    mapping_schema,
    named_schema,
    number,
    number_schema,
    part,
    parts,
    series,
    string,
)
from sbs_sim.content import ByContent
from sbs_sim.model.separation import OYE_LAG, STALL_LAGS
from sbs_sim.model.state import (
    COMMAND_NAMES,
    CONTROL_AXES,
    CONTROL_NAMES,
    DEFLECTIONS,
    ENGINE_TORQUE,
    GOVERNOR,
    SPEED,
    SWASHPLATE_NAMES,
)
from sbs_sim.model.unsteady_airfoil import RATES, STATION

Array = NDArray[np.float64]
Range = tuple[float, float]

MAX_ROTORS, MAX_CONTROLS, MAX_SURFACES, MAX_CONTACTS = 16, 16, 32, 32
MAX_CONTROL = 1e6  # of a control that is no angle, in its unit
TRIMMED_CONTROLS = 4  # that a trim finds
MAX_BLADES = 20
INCIDENCE = "incidence"  # of a surface, as pilot controls command it
STAND_AXES = tuple(DEFLECTIONS)


@dataclass(frozen=True)
class Environment:
    """Air and gravity."""

    air_density: float = number(
        "Air density; 0 is vacuum; follows from `altitude` where the file has that",
        0,
        100,
        "kg/m^3",
        symbol=r"\rho",
        model_field="density",
        is_derivable=True,
    )
    kinematic_viscosity: float = number(
        "Kinematic viscosity of the air; follows from `altitude` where the file has that",
        1e-9,
        1,
        "m^2/s",
        symbol=r"\nu",
        is_derivable=True,
    )
    gravity: float = number("Acceleration of gravity", 0, 100, "m/s^2", symbol="g", model_field="gravity")
    speed_of_sound: float = number(
        "Speed of sound, for airfoil tables over the Mach number and the warning of high Mach numbers; follows from "
        "`altitude` where the file has that",
        1,
        10000,
        "m/s",
        default=340.3,  # ISO 2533, standard atmosphere, at sea level
        is_physics=False,  # counts in the hash of aircraft that have such a table
    )
    altitude: float | None = number(
        "Pressure altitude in the standard atmosphere, instead of density, viscosity and speed of sound",
        MIN_ALTITUDE,
        MAX_ALTITUDE,
        "m",
        symbol="H",
        default=None,
        is_physics=False,  # the density and the viscosity that follow are
    )
    temperature_offset: float = number(
        "Temperature above that of the standard atmosphere at the same pressure",
        -60,
        60,
        "K",
        symbol=r"\Delta T",
        default=0.0,
        is_physics=False,
    )


# Keys of the environment of which a file has the first three or the last two.
GIVEN_AIR, STANDARD_AIR = ("air_density", "kinematic_viscosity", "speed_of_sound"), ("altitude", "temperature_offset")
AIR_RULES = {
    "if": {"required": ["altitude"]},
    "then": {"properties": {key: left_out("where the file has environment.altitude") for key in GIVEN_AIR}},
    "else": {
        "required": ["air_density", "kinematic_viscosity"],
        "properties": {"temperature_offset": left_out("where the file has no environment.altitude")},
    },
}


def _with_air(data: Mapping[str, Any]) -> Mapping[str, Any]:
    """Mapping of the environment with the air of its altitude."""
    if "altitude" not in data:
        return data
    air = standard_air(float(data["altitude"]), float(data.get("temperature_offset", 0.0)))
    return {**data, **{key: getattr(air, key.removeprefix("air_")) for key in GIVEN_AIR}}


@dataclass(frozen=True, eq=False)
class Wash(ByContent):
    """Wash of a rotor where a part of the body is: factors of its mean induced velocity over the skew of its wake."""

    rotor: str = string("Name of the rotor whose wash the part meets; empty for none", may_be_empty=True, default="")
    skew: Array = series(
        "Angles of the wake to the shaft, aft positive, increasing", -180, 180, "deg", symbol=r"\chi", default=[0.0]
    )
    down: Array = series(
        "Velocity down along the shaft over the mean induced velocity, for each angle",
        -10,
        10,
        "1",
        symbol="k_z",
        default=[1.0],
    )
    aft: Array = series(
        "Velocity aft across the shaft over the mean induced velocity, for each angle, or one for all",
        -10,
        10,
        "1",
        symbol="k_x",
        default=[0.0],
    )


@dataclass(frozen=True, eq=False)
class Schedule(ByContent):
    """Incidence of a surface over the airspeed, straight between the points and level outside."""

    airspeed: Array = series("Airspeeds, increasing", 0, 1000, "m/s")
    incidence: Array = series("Incidence to be added at each of them", -90, 90, "deg", symbol="i")


@dataclass(frozen=True, eq=False)
class Polar(ByContent):
    """Coefficients of a surface over the angle of attack, in place of a straight lift curve and its stall."""

    angle_deg: Array = series("Angles of attack in degrees, from -90 to 90 or -180 to 180", -180, 180, "1")
    lift: Array = series("Lift coefficients", -10, 10, "1")
    drag: Array = series("Drag coefficients", 0, 10, "1")


def _incidence_mixing() -> Any:
    """Field with the incidence over the pilot controls, as `_mixing` has the angles of a swashplate."""
    schema = mapping_schema({INCIDENCE: named_schema(number_schema(-10, 10))}, [INCIDENCE])

    def factors(rows: dict[str, dict[str, float]]) -> dict[str, dict[str, float]]:
        return {name: {key: float(value) for key, value in row.items()} for name, row in rows.items()}

    text = (
        "Incidence that pilot controls add to that of the file: sum of factor x control, in rad per rad, or per unit of"
        " a control that is no angle; without it no control acts on the surface"
    )
    return declared(text, schema, factors, unit="rad/rad", default={})


@dataclass(frozen=True, eq=False)
class Surface(ByContent):
    """One lifting surface.

    `position` has the shape (3,).
    """

    name: str = string("Name of the surface", is_physics=False)
    position: Array = array(
        "Middle of the quarter-chord line from the c.g., body axes", -100, 100, "m", shape=(3,), symbol=r"\mathbf r_s"
    )
    dihedral: float = number(
        "Angle of the span to the horizontal, right tip up: 0 lifts up, 90 is a fin", -180, 180, "deg", symbol=r"\Gamma"
    )
    incidence: float = number("Incidence, leading edge up", -90, 90, "deg", symbol="i", default=0.0)
    area: float = number("Area of the surface", 0, 1e4, "m^2", symbol="S", above_minimum=True)
    aspect_ratio: float = number("Aspect ratio", 0.1, 100, "1", symbol="A")
    lift_slope: float | None = number(
        "Slope of the lift curve; from the aspect ratio by Helmbold where left out", 0.1, 10, "1/rad", default=None
    )
    zero_lift_angle: float = number("Angle of attack without lift", -30, 30, "deg", symbol=r"\alpha_0", default=0.0)
    max_lift: float = number("Largest lift coefficient, at which the surface stalls", 0.05, 4, "1", default=1.0)
    zero_lift_drag: float = number("Drag coefficient without lift", 0, 2, "1", symbol="C_{D0}", default=0.01)
    span_efficiency: float = number("Span efficiency in the induced drag", 0.1, 2, "1", symbol="e", default=1.0)
    dynamic_pressure: float = number(
        "Dynamic pressure at the surface over that of its motion", 0, 2, "1", symbol=r"\eta", default=1.0
    )
    schedule: Schedule = part("Incidence over the airspeed", Schedule, default={})
    polar: Polar = part("Coefficients over the angle of attack", Polar, default={})
    wash: Wash = part("Wash of a rotor", Wash, default={})
    mixing: dict[str, dict[str, float]] = _incidence_mixing()
    incidence_range: Range = interval(
        "Range of the incidence that pilot controls add", -90, 90, "deg", default=[-90, 90], is_physics=False
    )
    incidence_rate: float = number(
        "Fastest motion of that incidence", 0, 1e6, "deg/s", above_minimum=True, default=1e6, is_physics=False
    )

    @property
    def slope(self) -> float:
        """Slope of the lift curve [1/rad]: the given one, or Helmbold's of the aspect ratio (theory.md section 5.8)."""
        if self.lift_slope is not None:
            return self.lift_slope
        ratio = self.aspect_ratio
        return 2.0 * math.pi * ratio / (2.0 + math.sqrt(ratio * ratio + 4.0))


@dataclass(frozen=True, eq=False)
class AngleTable(ByContent):
    """One coefficient: the sum of what it is over the angle of attack, over sideslip, and over both."""

    alpha: Array = series("For each angle of attack", -1e6, 1e6, "1")
    beta: Array = series("For each angle of sideslip", -1e6, 1e6, "1")
    grid: Array = declared(
        "For each angle of attack a list of those for each angle of sideslip",
        list_schema(list_schema(number_schema(-1e6, 1e6), 0, 100), 0, 100),
        frozen,
        unit="1",
        default=[],
    )


def _table(what: str) -> Any:
    return part(what, AngleTable, default={})


@dataclass(frozen=True, eq=False)
class Fuselage(ByContent):
    """Fuselage by tables of areas and volumes: force and moment over the dynamic pressure.

    `reference` has the shape (3,).
    """

    reference: Array = array(
        "Point from the c.g. to which the tables belong, body axes", -100, 100, "m", shape=(3,), symbol=r"\mathbf r_f"
    )
    alpha_deg: Array = series(
        "Angles of attack of the tables in degrees, from -90 to 90 or -180 to 180", -180, 180, "1"
    )
    beta_deg: Array = series("Angles of sideslip of the tables in degrees, from -90 to 90", -90, 90, "1")
    drag: AngleTable = _table("Drag over the dynamic pressure [m^2]")
    side: AngleTable = _table("Side force to the right over the dynamic pressure [m^2]")
    lift: AngleTable = _table("Lift over the dynamic pressure [m^2]")
    roll: AngleTable = _table("Moment about the flow, right side down, over the dynamic pressure [m^3]")
    pitch: AngleTable = _table("Moment nose up over the dynamic pressure [m^3]")
    yaw: AngleTable = _table("Moment nose right over the dynamic pressure [m^3]")
    wash: Wash = part("Wash of a rotor", Wash, default={})


def _free_axes() -> Any:
    """Field with 1 for the axes of a stand that are named, 0 for the others, shape (6,)."""
    schema = list_schema({"enum": list(STAND_AXES)}, 0, len(STAND_AXES)) | {"uniqueItems": True}
    text = "Axes in which the stand lets the rotors move, the others are locked; all of them is free flight"

    def flags(names: list[str]) -> Array:
        return frozen([1.0 if axis in names else 0.0 for axis in STAND_AXES])

    return declared(text, schema, flags, key="stand.free", default=list(STAND_AXES))


def _of_stand(text: str, unit: str, name: str, symbol: str) -> Any:
    """Field with a value for each axis of a stand."""
    return array(text, 0, 1e9, unit, shape=(6,), key=f"stand.{name}", default=[0.0] * 6, symbol=symbol)


@dataclass(frozen=True, eq=False)
class Body(ByContent):
    """The whole aircraft, blades included."""

    mass: float = number("Mass of the whole aircraft, blades included", 0.001, 1e6, "kg", symbol="m")
    inertia: Array = array(
        "Inertia matrix about the c.g., body axes, blades included",
        -1e9,
        1e9,
        "kg m^2",
        shape=(3, 3),
        symbol=r"\mathbf I",
    )
    flat_plate_areas: Array = array(
        "Equivalent drag areas of the fuselage along x, y, z",
        0,
        1e4,
        "m^2",
        shape=(3,),
        symbol="f_x, f_y, f_z",
        model_field="plate_areas",
    )
    surfaces: tuple[Surface, ...] = parts(
        f"Lifting surfaces, up to {MAX_SURFACES} of them", Surface, 0, MAX_SURFACES, default=[]
    )
    fuselage: Fuselage | None = part("Fuselage by tables, beside the flat plates", Fuselage, default=None)
    stand_free: Array = _free_axes()
    stand_mass: Array = _of_stand(
        "Mass of a stand along x, y, z and inertia about them, in place of the body's, blades extra; 0 where locked",
        "kg, kg m^2",
        "mass",
        r"\mathbf M_s",
    )
    stand_spring: Array = _of_stand(
        "Stiffness of a stand along and about x, y, z, about the rest position at the origin",
        "N/m, N m/rad",
        "spring",
        r"\mathbf K_s",
    )
    stand_damping: Array = _of_stand(
        "Damping of a stand along and about x, y, z", "N s/m, N m s/rad", "damping", r"\mathbf C_s"
    )

    @property
    def is_stand(self) -> bool:
        """The rotors stand on something, and do not fly."""
        return bool((self.stand_free == 0.0).any() or self.stand_mass.any())


@dataclass(frozen=True)
class Options:
    """How the model reads the equations: see theory.md sections 4, 5 and 9."""

    coupling: str = choice(
        "complete: body and blades are one multibody system; paper: blades on a hub in steady motion",
        ("complete", "paper"),
    )
    hub_moment: str = choice(
        "Moment of the blades about the hub: complete, or as the paper has it", ("complete", "paper")
    )
    flap_inertia: str = choice(
        "Second moment A_1 of a blade: hinge_to_tip is m_b L^2/3, axis_to_tip is m_b R^2/3",
        ("hinge_to_tip", "axis_to_tip"),
    )
    elements: int = integer("Number of elements of each blade", 1, 1000)
    interpolation: str = choice(
        "Interpolation of airfoil tables over the angle of attack: smooth is a monotone cubic",
        ("smooth", "linear"),
        default="linear",  # of files that were written before there was a choice
    )
    interference: str = choice(
        "Wash of the rotors on one another: none, or that of their skewed wakes",
        ("none", "skewed_wake"),
        default="none",
    )

    @property
    def meets_wakes(self) -> bool:
        """True where rotors meet the wakes of one another."""
        return self.interference != "none"


def _mixing() -> Any:
    """Field with the swashplate angles over the pilot controls, each factor under the names of both in the file."""
    row = named_schema(number_schema(-10, 10))
    schema = mapping_schema(dict.fromkeys(SWASHPLATE_NAMES, row), list(SWASHPLATE_NAMES))

    def factors(rows: dict[str, dict[str, float]]) -> dict[str, dict[str, float]]:
        return {angle: {name: float(factor) for name, factor in rows[angle].items()} for angle in SWASHPLATE_NAMES}

    text = (
        "Swashplate angles over the pilot controls: angle = sum of factor x control, in rad per rad, or per unit of a"
        " control that is no angle; factors left out are 0"
    )
    return declared(text, schema, factors, unit="rad/rad")


def _offsets() -> Any:
    """Field with the swashplate angles where all pilot controls are zero."""
    schema = mapping_schema({angle: number_schema(-90, 90) for angle in SWASHPLATE_NAMES}, [])

    def angles(values: dict[str, float]) -> Array:
        return frozen([math.radians(values.get(angle, 0.0)) for angle in SWASHPLATE_NAMES])

    text = "Swashplate angles where all pilot controls are zero; those left out are 0"
    return declared(text, schema, angles, unit="deg", default={})


def _linkage(letter: str, text: str) -> Any:
    """Field with a length of the linkage of the axial lag damper."""
    return number(
        text,
        -50,
        50,
        "m",
        key=f"lag_damper.{letter}",
        symbol=f"h_{letter}",
        model_field=f"damper_{letter}",
        default=0.0,
    )


@dataclass(frozen=True, eq=False)
class MixingSchedule(ByContent):
    """A share in an angle of a swashplate over the airspeed, straight between the points and level outside."""

    angle: str = choice("Angle of the swashplate that changes with the airspeed", SWASHPLATE_NAMES)
    control: str = string(
        "Name of the pilot control whose factor changes; empty where it is the angle itself",
        may_be_empty=True,
        default="",
    )
    airspeed: Array = series("Airspeeds, increasing", 0, 1000, "m/s")
    factor: Array = series(
        "Factor of the control to be added to that of `mixing` at each of them, per rad or unit", -10, 10, "rad/rad"
    )
    offset: Array = series("Angle to be added at each of them, where there is no control", -90, 90, "deg")

    @property
    def values(self) -> Array:
        """Factors, or angles [rad]."""
        return self.factor if self.control else self.offset


MAX_SCHEDULES = 32
MAX_STATIONS, MAX_AIRFOILS = 200, 20

# Keys of a rotor of which a file has the last one, or the others.
BLADE_MASS, DERIVED_FROM = ("blade_mass", "blade_cg", "blade_inertia"), ("mass_distribution",)
MASS_RULES = {
    "if": {"required": list(DERIVED_FROM)},
    "then": {"properties": {key: left_out("where the rotor has mass_distribution") for key in BLADE_MASS}},
    "else": {"required": ["blade_cg", "blade_mass"]},
}


STATION_SYMBOLS = {"chord": "c", "quarter_chord": "x_c", "chordwise_cg": "x_m"}


def _stations(key: str, more: str = "increasing; in place of root and tip") -> Any:
    """Field with the stations of a table along the blade."""
    return declared(
        f"Stations of {key}.values as shares of the radius from the axis, {more}",
        list_schema(number_schema(0, 1), 2, MAX_STATIONS),
        frozen,
        unit="1",
        key=f"{key}.stations",
        symbol=STATION_SYMBOLS.get(key, ""),
        default=None,
        is_physics=key not in DERIVED_FROM,
    )


def _station_values(what: str, minimum: float, maximum: float, unit: str, **more: Any) -> Any:
    """Field with the values of a table along the blade."""
    text = f"{what} at the stations, linear between them, constant beyond the first and the last"
    schema, convert = list_schema(number_schema(minimum, maximum), 2, MAX_STATIONS), converter(unit)
    return declared(
        text, schema, lambda values: frozen([convert(value) for value in values]), unit=unit, default=None, **more
    )


@dataclass(frozen=True, eq=False)
class Rotor(ByContent):
    """One rotor.

    `rotation` is +1 counter-clockwise seen from above (against the thrust); `hub` and `shaft_direction` have the shape
    (3,), `swashplate_offset` has the shape (3,) for collective, lateral and longitudinal cyclic; `mixing` holds the
    factors of each of them by the names of the pilot controls, see `Aircraft.mixing`.
    """

    name: str = string("Name of the rotor", is_physics=False)
    hub: Array = array(
        "Hub centre from the c.g., body axes", -100, 100, "m", shape=(3,), symbol=r"\mathbf r_{hub}", model_field="hub"
    )
    shaft_direction: Array = array(
        "Direction of thrust along the shaft, body axes, any length", -1e3, 1e3, "1", shape=(3,), symbol=r"\mathbf u"
    )
    rotation: int = choice(
        "Sense of rotation, +1 counter-clockwise seen from above", (1, -1), symbol="G", model_field="sense"
    )
    speed: float = number("Rotor speed", 1, 100000, "rpm", symbol=r"\Omega", model_field="rotor_speed")
    radius: float = number("Rotor radius", 0.01, 50, "m", symbol="R", model_field="radius")
    blades: int = integer("Number of blades", 2, MAX_BLADES, symbol="N_b")
    blade_mass: float = number(
        "Mass of a blade; follows from `mass_distribution` where the file has that",
        MIN_BLADE_MASS,
        1e4,
        "kg",
        symbol="m_b",
        model_field="mass",
        is_derivable=True,
    )
    blade_cg: float = number(
        "Distance of a blade's c.g. from the flap hinge; follows from `mass_distribution` where the file has that",
        1e-12,
        50,
        "m",
        symbol="r_G",
        is_derivable=True,
    )
    blade_inertia: float | None = number(
        "Second moment of a blade about the flap hinge; of a uniform blade by options.flap_inertia if left out; follows"
        " from `mass_distribution` where the file has that",
        1e-12,
        1e9,
        "kg m^2",
        symbol="A_1",
        default=None,
    )
    mass_stations: Array | None = _stations(
        "mass_distribution",
        "in order, one that occurs twice is a step; in place of blade_mass, blade_cg and blade_inertia",
    )
    mass_values: Array | None = _station_values(
        "Mass of a blade per length", 0, 1e5, "kg/m", key="mass_distribution.values", is_physics=False
    )
    tip_mass: float = number(
        "Mass at the tip of a blade, beside that of the stations",
        0,
        1e4,
        "kg",
        key="mass_distribution.tip_mass",
        default=0.0,
        is_physics=False,  # the integrals that follow are
    )
    hinge_offset: float = number(
        "Distance of the flap hinge from the axis", 0, 50, "m", symbol="e_0", model_field="hinge_offset"
    )
    flap_hinge_offset: float = number(
        "Distance of the flap hinge from the lag hinge", 0, 50, "m", symbol="e_F", model_field="flap_hinge_offset"
    )
    flap_hinge: str = choice(
        "each: a flap hinge of each blade; teetering: one for both blades of a rotor, at the axis, their coning is"
        " flap_rest_deg",
        ("each", "teetering"),
        default="each",
    )
    undersling: float = number(
        "Height of a teetering hinge over the point where the pitch axes of the blades meet",
        -5,
        5,
        "m",
        symbol="h_u",
        default=0.0,
    )
    flap_spring: float = number(
        "Stiffness of the flap hinge", 0, 1e9, "N m/rad", symbol=r"K_\beta", model_field="flap_spring"
    )
    lag_spring: float = number(
        "Stiffness of the lag hinge", 0, 1e9, "N m/rad", symbol=r"K_\xi", model_field="lag_spring"
    )
    flap_rest: float = number(
        "Flap angle at which the flap spring exerts no moment: the precone of a hingeless blade",
        -45,
        45,
        "deg",
        symbol=r"\beta_0",
        model_field="flap_rest",
        default=0.0,
    )
    lag_rest: float = number(
        "Lag angle at which the lag spring exerts no moment",
        -45,
        45,
        "deg",
        symbol=r"\xi_0",
        model_field="lag_rest",
        default=0.0,
    )
    lag_damping: float = number(
        "Damping of the lag hinge", 0, 1e9, "N m s/rad", symbol=r"C_\xi", model_field="lag_damping"
    )
    blade_lag_damping: Array | None = declared(
        "Factor on the lag damping of each blade, the first blade first; all 1 if left out",
        list_schema(number_schema(0, 100), 1, MAX_BLADES),
        frozen,
        unit="1",
        default=None,
    )
    damper_damping: float = number(
        "Force of an axial lag damper over its rate",
        0,
        1e9,
        "N s/m",
        key="lag_damper.damping",
        symbol="C_d",
        model_field="damper_damping",
        default=0.0,
    )
    damper_a: float = _linkage(
        "a", "Linkage of the axial lag damper: its end on the blade, above the blade's axis, at zero flap"
    )
    damper_b: float = _linkage("b", "Linkage: the same end, along the span from the hinges at the rest angle of lag")
    damper_c: float = _linkage("c", "Linkage: its end on the hub, inboard of the hinges")
    damper_d: float = _linkage("d", "Linkage: its end on the blade, ahead of the hinges against lag")
    damper_r: float = _linkage("r", "Linkage: lever of the end on the hub, which turns with the pitch")
    lag_stops: Range | None = interval(
        "Lag angles between which no stop touches the blade, leading is negative; without it there are no stops",
        -85,
        85,
        "deg",
        key="lag_stop.range_deg",
        symbol=r"\xi_1, \xi_2",
        default=None,
    )
    lag_stop_spring: float = number(
        "Stiffness of the lag stops",
        0,
        1e9,
        "N m/rad",
        key="lag_stop.stiffness",
        symbol="K_s",
        model_field="lag_stop_spring",
        default=0.0,
    )
    lag_stop_damping: float = number(
        "Damping of the lag stops",
        0,
        1e9,
        "N m s/rad",
        key="lag_stop.damping",
        symbol="C_s",
        model_field="lag_stop_damping",
        default=0.0,
    )
    pitch_flap_coupling: float = number(
        "Blade pitch taken off per flap angle",
        -10,
        10,
        "rad/rad",
        symbol=r"K_{t\beta}",
        model_field="pitch_flap_coupling",
    )
    pitch_lag_coupling: float = number(
        "Blade pitch taken off per lag angle", -10, 10, "rad/rad", symbol=r"K_{t\xi}", model_field="pitch_lag_coupling"
    )
    chord_root: float | None = number(
        "Chord at the flap hinge, linear to the tip", 1e-12, 10, "m", key="chord.root", symbol="c", default=None
    )
    chord_tip: float | None = number("Chord at the tip", 1e-12, 10, "m", key="chord.tip", symbol="c", default=None)
    chord_stations: Array | None = _stations("chord")
    chord_values: Array | None = _station_values("Chord", 1e-12, 10, "m", key="chord.values", symbol="c")
    twist_root: float | None = number(
        "Twist at the flap hinge, linear to the tip", -90, 90, "deg", key="twist_deg.root", default=None
    )
    twist_tip: float | None = number("Twist at the tip", -90, 90, "deg", key="twist_deg.tip", default=None)
    twist_stations: Array | None = _stations("twist_deg")
    twist_values: Array | None = _station_values("Twist", -90, 90, "deg", key="twist_deg.values")
    quarter_root: float | None = number(
        "Offset of the quarter chord at the flap hinge, ahead of the pitch axis, linear to the tip; 0 if left out",
        -10,
        10,
        "m",
        key="quarter_chord.root",
        symbol="x_c",
        default=None,
    )
    quarter_tip: float | None = number(
        "Offset of the quarter chord at the tip", -10, 10, "m", key="quarter_chord.tip", symbol="x_c", default=None
    )
    quarter_stations: Array | None = _stations("quarter_chord")
    quarter_values: Array | None = _station_values(
        "Offset of the quarter chord", -10, 10, "m", key="quarter_chord.values", symbol="x_c"
    )
    centre_root: float | None = number(
        "Offset of the sections' centres of gravity at the flap hinge, ahead of the pitch axis, linear to the tip; 0"
        " if left out",
        -10,
        10,
        "m",
        key="chordwise_cg.root",
        symbol="x_m",
        default=None,
    )
    centre_tip: float | None = number(
        "Offset of the centre of gravity at the tip", -10, 10, "m", key="chordwise_cg.tip", symbol="x_m", default=None
    )
    centre_stations: Array | None = _stations("chordwise_cg")
    centre_values: Array | None = _station_values(
        "Offset of the sections' centres of gravity", -10, 10, "m", key="chordwise_cg.values", symbol="x_m"
    )
    root_cutout: float = number(
        "Distance from the flap hinge to where the blade's profile begins", 0, 50, "m", symbol="r_c"
    )
    tip_loss: float = number(
        "Tip-loss factor: no lift beyond this share of the radius", 0, 1, above_minimum=True, symbol="B"
    )
    tip_loss_model: str = choice(
        "factor: lift as far as tip_loss; prandtl: lift of the elements times Prandtl's factor of the flow through the"
        " disc and the number of blades, with a tip_loss of 1",
        ("factor", "prandtl"),
        default="factor",
    )
    profile_drag: str = choice(
        "section: drag of the flow across the span; oblique: drag along the flow with its part along the span",
        ("section", "oblique"),
        default="section",
    )
    unsteady_airfoil: str = choice(
        "steady: lift follows the flow at once; jones: circulation follows it by the indicial function of a thin"
        " airfoil, of a rotor with three or more blades",
        ("steady", "jones"),
        default="steady",
    )
    dynamic_stall: str = choice(
        "none: stall by the table at once; separation: the point of separation follows the flow late, in flights;"
        " leishman_beddoes: with the vortex that the leading edge sheds; trims and linear models have the table",
        ("none", "separation", "leishman_beddoes"),
        default="none",
    )
    pressure_lag: float = number(
        "Time in which the pressure at the leading edge follows the flow, in semi-chords that this goes; with"
        " dynamic_stall = leishman_beddoes, as the three below",
        0.5,
        50,
        key="stall_lags.pressure",
        symbol="T_p",
        default=STALL_LAGS[0],
    )
    boundary_lag: float = number(
        "Time in which the separation follows that pressure",
        0,
        100,
        key="stall_lags.separation",
        symbol="T_f",
        default=STALL_LAGS[1],
    )
    vortex_lag: float = number(
        "Time in which the lift of the vortex decays",
        0.5,
        100,
        key="stall_lags.vortex",
        symbol="T_v",
        default=STALL_LAGS[2],
    )
    vortex_passage: float = number(
        "Time in which the vortex passes over the chord",
        0,
        100,
        key="stall_lags.passage",
        symbol="T_{vl}",
        default=STALL_LAGS[3],
    )
    swashplate_phase: float = number("Phase of the swashplate against the blades", -360, 360, "deg", symbol=r"\psi_s")
    airfoil: str = string("Airfoil table: a name in config/airfoils, or a path", is_physics=False)  # its table counts
    drag_increment: float = number(
        "Drag that is added to all airfoil tables of the rotor: of rough surfaces, slots and trim tabs",
        0,
        1,
        symbol=r"\Delta c_d",
        default=0.0,
        is_physics=False,  # the tables that it is added to count
    )
    outboard_stations: Array | None = declared(
        "Where other airfoils begin, as shares of the radius from the axis, increasing",
        list_schema(number_schema(0, 1), 1, MAX_AIRFOILS),
        frozen,
        unit="1",
        key="outboard_airfoils.stations",
        default=None,
    )
    outboard_airfoils: tuple[str, ...] | None = declared(
        "Airfoil tables outboard of each of these, as `airfoil`, each up to the next, without blending",
        list_schema({"type": "string", "minLength": 1}, 1, MAX_AIRFOILS),
        tuple,
        key="outboard_airfoils.values",
        default=None,
        is_physics=False,
    )
    duct_expansion: float = number(
        "Wake expansion ratio of the duct; 0.5 is an open rotor", 0.25, 2, symbol="a_w", model_field="duct_expansion"
    )
    duct_exit: float | None = number(
        "Exit area over that of the disc of a duct with a fixed exit; without it there is no such duct",
        0.25,
        4,
        key="duct.exit_area",
        symbol="a_w",
        default=None,
    )
    duct_turning: float = number(
        "Share of the velocity along the disc that the lip turns into the duct",
        0,
        1,
        key="duct.turning",
        symbol="t",
        default=1.0,
    )
    ram_recovery: float = number(
        "Share of the dynamic pressure of what the lip turns that is not lost there",
        0,
        1,
        key="duct.ram_recovery",
        symbol=r"\eta_r",
        model_field="ram_recovery",
        default=1.0,
    )
    lip_arm: float = number(
        "Height above the disc at which the ram drag acts",
        -50,
        50,
        "m",
        key="duct.lip_arm",
        symbol="h_l",
        model_field="lip_arm",
        default=0.0,
    )
    lip_stall: float | None = number(
        "Velocity along the disc over the flow through it at which the stalled lip recovers half; without it, it never"
        " stalls",
        0.01,
        1000,
        key="duct.lip_stall",
        symbol="s_l",
        default=None,
    )
    induced_power_factor: float = number(
        "Induced velocity at the blades over that of momentum theory: 1.1 to 1.2 for the tip loss and the uneven inflow"
        " of a real rotor, 1 for the ideal one",
        1,
        2,
        symbol=r"\kappa_i",
        default=1.0,
    )
    descent: str = choice(
        "momentum: momentum theory in all flight; measured: inflow of vortex ring, turbulent wake and windmill as"
        " measured, of an open rotor with an induced_power_factor of 1.1, which the measurement has in hover",
        ("momentum", "measured"),
        default="momentum",
    )
    ring_unsteadiness: float = number(
        "Standard deviation of the thrust in the middle of the vortex ring over its mean, with descent = measured: a"
        " seeded noise in flights in time; 0.2 is what was measured, 0 is the mean alone",
        0,
        0.5,
        symbol="s_r",
        model_field="ring_unsteadiness",
        default=0.0,
    )
    collective_range: Range = interval("Range of the collective of the swashplate", -90, 90, "deg", is_physics=False)
    cyclic_range: Range = interval("Range of each cyclic of the swashplate", -90, 90, "deg", is_physics=False)
    swashplate_rate: float = number(
        "Fastest motion of each angle of the swashplate", 0, 1e6, "deg/s", above_minimum=True, is_physics=False
    )
    mixing: dict[str, dict[str, float]] = _mixing()
    swashplate_offset: Array = _offsets()
    schedule: tuple[MixingSchedule, ...] = parts(
        "Shares in the swashplate angles that change with the airspeed", MixingSchedule, 0, MAX_SCHEDULES, default=[]
    )

    @property
    def wake_expansion(self) -> float:
        """a_w: area of the wake far behind over that of the disc, in hover."""
        return self.duct_expansion if self.duct_exit is None else self.duct_exit

    @property
    def blade_length(self) -> float:
        """L, from the flap hinge to the tip [m]."""
        return self.radius - self.hinge_offset

    def chord_at(self, share: Any) -> Any:
        """Chord [m] at shares of the length from the flap hinge to the tip, a number or an array."""
        return self._along(share, self.chord_root, self.chord_tip, self.chord_stations, self.chord_values)

    def twist_at(self, share: Any) -> Any:
        """Twist [rad] at shares of the length from the flap hinge to the tip, a number or an array."""
        return self._along(share, self.twist_root, self.twist_tip, self.twist_stations, self.twist_values)

    def _along(
        self, share: Any, root: float | None, tip: float | None, stations: Array | None, values: Array | None
    ) -> Any:
        """Value of a table over the radius, or of a line from the hinge to the tip."""
        if stations is not None and values is not None:
            return np.interp((self.hinge_offset + share * self.blade_length) / self.radius, stations, values)
        assert root is not None and tip is not None, "checked with the file"  # noqa: PT018
        return root + share * (tip - root)

    def quarter_at(self, share: Any) -> Any:
        """Offset of the quarter chord ahead of the pitch axis [m], as `chord_at`."""
        ends = self.quarter_root or 0.0, self.quarter_tip or 0.0
        return self._along(share, *ends, self.quarter_stations, self.quarter_values)

    def centre_at(self, share: Any) -> Any:
        """Offset of the sections' centres of gravity ahead of the pitch axis [m], as `chord_at`."""
        ends = self.centre_root or 0.0, self.centre_tip or 0.0
        return self._along(share, *ends, self.centre_stations, self.centre_values)

    def sweep_at(self, share: Any) -> Any:
        """Sweep of the quarter-chord line [rad], aft positive; of a table the slope of its line there."""
        length = self.blade_length
        if self.quarter_stations is None or self.quarter_values is None:
            slope = ((self.quarter_tip or 0.0) - (self.quarter_root or 0.0)) / length
            return np.full(np.shape(share), -math.atan(slope))
        places = self.quarter_stations * self.radius
        slopes = np.concatenate([[0.0], np.diff(self.quarter_values) / np.diff(places), [0.0]])
        radius = self.hinge_offset + np.asarray(share) * length
        return -np.arctan(slopes[np.searchsorted(places, radius, side="right")])

    @property
    def has_offsets(self) -> bool:
        """Quarter chord or mass of its blades are not on a pitch axis through the flap hinge."""
        given = (self.quarter_root, self.quarter_stations, self.centre_root, self.centre_stations)
        return self.undersling != 0.0 or any(value is not None for value in given)

    @property
    def airfoil_names(self) -> tuple[str, ...]:
        """Airfoil tables from the root outwards, as the file names them."""
        return (self.airfoil, *(self.outboard_airfoils or ()))

    def airfoil_at(self, span: Any) -> NDArray[np.int64]:
        """Number in `airfoil_names` of the airfoil at distances from the flap hinge [m], a number or an array."""
        stations = np.zeros(0) if self.outboard_stations is None else self.outboard_stations
        return np.searchsorted(stations, (self.hinge_offset + np.asarray(span)) / self.radius, side="right")

    @property
    def reach(self) -> float:
        """Half the extent in y of the circle of the tips, whose axis may be tilted [m]."""
        shaft = self.shaft_direction / np.linalg.norm(self.shaft_direction)
        return float(self.radius * math.sqrt(max(0.0, 1.0 - float(shaft[1]) ** 2)))

    @property
    def mean_chord(self) -> float:
        """Mean chord from the flap hinge to the tip [m]."""
        if self.chord_stations is None:
            return float(0.5 * (self.chord_at(0.0) + self.chord_at(1.0)))
        inner = (self.chord_stations * self.radius - self.hinge_offset) / self.blade_length
        knots = np.array([0.0, *inner[(inner > 0.0) & (inner < 1.0)], 1.0])
        chords = self.chord_at(knots)
        return float(np.sum(np.diff(knots) * (chords[1:] + chords[:-1])) / 2)

    @property
    def first_moment(self) -> float:
        """S1 of a blade about its flap hinge [kg m]."""
        return self.blade_mass * self.blade_cg

    @property
    def second_moment(self) -> float:
        """A1 of a blade about its flap hinge, m_b L^2 / 3 unless the file has it [kg m^2]."""
        if self.blade_inertia is not None:
            return self.blade_inertia
        return self.blade_mass * (self.blade_length * self.blade_length) / 3

    @property
    def lag_inertia(self) -> float:
        """A2 of a blade about its lag hinge without flap [kg m^2]."""
        e_f = self.flap_hinge_offset
        return self.blade_mass * e_f**2 + 2.0 * e_f * self.first_moment + self.second_moment

    @property
    def is_teetering(self) -> bool:
        """Its blades have one flap hinge."""
        return self.flap_hinge == "teetering"

    @property
    def has_wake_states(self) -> bool:
        """Circulation of its blades follows the flow late."""
        return self.unsteady_airfoil != "steady"

    @property
    def wake_rate(self) -> float:
        """Rate at which the fast part of that circulation follows the flow in hover [1/s]."""
        radius = STATION * self.radius
        chord = float(self.chord_at((radius - self.hinge_offset) / self.blade_length))
        return 2.0 * max(RATES) * radius * self.speed / chord if self.has_wake_states else 0.0

    @property
    def has_late_separation(self) -> bool:
        """Separation on its sections follows the flow late."""
        return self.dynamic_stall != "none"

    @property
    def has_stall_vortex(self) -> bool:
        """The leading edge of its sections sheds a vortex."""
        return self.dynamic_stall == "leishman_beddoes"

    @property
    def stall_rate(self) -> float:
        """Rate of the quickest state of a section in hover [1/s], of its pressure or its vortex; 0 without one."""
        if not self.has_stall_vortex:
            return 0.0
        stations = np.linspace(0.0, self.blade_length, 101)
        velocity = (self.hinge_offset + stations) * self.speed
        fastest = float((2.0 * velocity / self.chord_at(stations / self.blade_length)).max())
        return fastest / min(self.pressure_lag, self.vortex_lag)

    @property
    def stall_lags(self) -> tuple[float, ...]:
        """Times of pressure, separation, vortex and its passage, in semi-chords."""
        return self.pressure_lag, self.boundary_lag, self.vortex_lag, self.vortex_passage

    @property
    def separation_lag(self) -> float:
        """Time in which the point of separation follows the flow, in semi-chords."""
        return self.pressure_lag + self.boundary_lag if self.has_stall_vortex else OYE_LAG

    @property
    def lag_damping_factors(self) -> Array:
        """Factor on the lag damping of each blade, shape (blades,)."""
        return np.ones(self.blades) if self.blade_lag_damping is None else self.blade_lag_damping

    @property
    def has_equal_blades(self) -> bool:
        """All blades are alike, so that the rotor is the same again after the passage of one."""
        return bool(np.all(self.lag_damping_factors == self.lag_damping_factors[0]))

    def elements(self, count: int) -> Array:
        """Blade elements at their mid-points (theory.md section 4).

        Parameters
        ----------
        count : int

        Returns
        -------
        ndarray, shape (params.ELEMENT_ROWS, count)
            Distance from the flap hinge [m], chord [m], c ds / 2 [m^2], share that carries lift, twist [rad].
        """
        length = self.blade_length
        width = (length - self.root_cutout) / count
        span = self.root_cutout + width * (np.arange(count) + 0.5)
        chord = self.chord_at(span / length)
        lift_end = self.tip_loss * self.radius - self.hinge_offset
        lift = np.clip((lift_end - (span - width / 2)) / width, 0.0, 1.0)
        return np.stack([span, chord, chord * width / 2, lift, self.twist_at(span / length)])


ENGINES = ("none", "engine", "electric")


def _drive_mixing() -> Any:
    """Field with the commands to a drive over the pilot controls, as `_mixing` has those to a swashplate."""
    row = named_schema(number_schema(-100, 100))
    schema = mapping_schema(dict.fromkeys(COMMAND_NAMES, row), [])

    def factors(rows: dict[str, dict[str, float]]) -> dict[str, dict[str, float]]:
        if not rows:
            return {}
        return {name: {key: float(value) for key, value in rows.get(name, {}).items()} for name in COMMAND_NAMES}

    text = (
        "What pilot controls add to `engine.throttle` and, of a governor, to `set_point`: sum of factor x control, per"
        " rad or per unit of a control that is no angle; without it no control acts on the drive"
    )
    return declared(text, schema, factors, unit="1/rad", default={})


@dataclass(frozen=True, eq=False)
class Drive(ByContent):
    """A drive: rotors that turn together, and what turns them. All torques are at the speed of its first rotor."""

    rotors: tuple[str, ...] = declared(
        "Names of the rotors that it joins, whose gear ratios are those of their speeds; torques and inertia of the"
        " drive are at the speed of the first",
        list_schema({"type": "string", "minLength": 1}, 1, MAX_ROTORS),
        tuple,
    )
    inertia: float = number(
        "Moment of inertia of engine and transmission, without the blades", 0, 1e6, "kg m^2", symbol="I_t", default=0
    )
    inertia_axis: Array = array(
        "Axis about which that inertia turns, body axes, after the right hand; shorter than 1 where parts of it turn"
        " against each other, 0 where they cancel out",
        -1,
        1,
        "1",
        shape=(3,),
        symbol=r"\mathbf a_t",
        default=[0, 0, 0],
    )
    free_wheel: bool = declared(
        "A one-way clutch: the rotors may turn faster than the engine, which then gives no torque",
        {"type": "boolean"},
        bool,
        default=True,
    )
    engine: str = choice(
        "none: the rotors turn freely; engine: torque by throttle; electric: motor, battery and controller",
        ENGINES,
        key="engine.kind",
        default="none",
    )
    max_torque: float = number(
        "Largest torque of the engine", 0, 1e7, "N m", key="engine.max_torque", symbol=r"Q_{max}", default=0
    )
    max_power: float = number(
        "Largest power of the engine", 0, 1e9, "W", key="engine.max_power", symbol=r"P_{max}", default=1e9
    )
    lag: float = number(
        "Time constant with which the torque of the engine follows",
        0.001,
        100,
        "s",
        key="engine.lag",
        symbol=r"\tau_e",
        default=0.1,
    )
    drag: float = number(
        "Torque that the engine takes at the speed of the file, in proportion to the speed",
        0,
        1e7,
        "N m",
        key="engine.drag",
        symbol="Q_0",
        default=0,
    )
    throttle: float = number(
        "Throttle of an engine without governor, or where its governor begins",
        0,
        1,
        key="engine.throttle",
        symbol=r"\delta_0",
        default=0,
    )
    torque_constant: float = number(
        "Torque of the motor over its current",
        1e-6,
        1e6,
        "N m/A",
        key="engine.torque_constant",
        symbol="k_t",
        default=1,
    )
    resistance: float = number(
        "Resistance of motor, controller and battery",
        1e-6,
        1e6,
        "Ohm",
        key="engine.resistance",
        symbol=r"R_e",
        default=0.1,
    )
    full_voltage: float = number(
        "Voltage of the full battery without load", 0, 1e5, "V", key="battery.full_voltage", symbol="V_1", default=50
    )
    empty_voltage: float = number(
        "Voltage of the empty battery without load", 0, 1e5, "V", key="battery.empty_voltage", symbol="V_0", default=50
    )
    capacity: float = number(
        "Charge of the full battery", 1e-6, 1e6, "A h", key="battery.capacity", symbol="C_b", default=1e6
    )
    set_point: float = number(
        "Speed that the governor holds, over that of the file", 0.1, 2, key="governor.set_point", default=1
    )
    proportional_gain: float = number(
        "Throttle per share of the speed that is missing",
        0,
        1e4,
        key="governor.proportional_gain",
        symbol="k_P",
        default=0,
    )
    integral_gain: float = number(
        "Its integral over time: throttle per second and share of the speed that is missing; 0 is no governor",
        0,
        1e4,
        "1/s",
        key="governor.integral_gain",
        symbol="k_I",
        default=0,
    )
    mixing: dict[str, dict[str, float]] = _drive_mixing()

    @property
    def has_governor(self) -> bool:
        """An engine whose throttle a governor sets."""
        return self.engine != "none" and self.integral_gain > 0

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of its states that linear models have, see `StateLayout`."""
        engine = (ENGINE_TORQUE,) if self.engine != "none" else ()
        return (SPEED, *engine, *((GOVERNOR,) if self.has_governor else ()))


@dataclass(frozen=True)
class Control:
    """A pilot control.

    Attributes
    ----------
    name : str
    range : (float, float)
        [rad], or in its own unit if it is no angle.
    unit : str
        "rad" for an angle, else as in the file.
    axis : str
        Of `CONTROL_AXES`: what a pilot moves the aircraft about or along with it; empty if no stick is connected to it.
    held : float or None
        Value that it keeps in trims and where nothing commands it; None for a control that a trim finds.
    """

    name: str
    range: Range
    unit: str
    axis: str
    held: float | None

    @property
    def is_angle(self) -> bool:
        """It is in radians."""
        return self.unit == "rad"

    @property
    def shown_unit(self) -> str:
        """Unit in which a person reads it: "deg" for an angle."""
        return "deg" if self.is_angle else self.unit

    @property
    def limit(self) -> float:
        """No command may be larger: a right angle [rad], or `MAX_CONTROL`."""
        return math.pi / 2 if self.is_angle else MAX_CONTROL

    def shown(self, value: float) -> float:
        """Value in `shown_unit`."""
        return math.degrees(value) if self.is_angle else value


def _controls() -> Any:
    """Field with the pilot controls by their names."""
    angle, plain = number_schema(-90, 90), number_schema(-MAX_CONTROL, MAX_CONTROL)
    keys = {
        "range_deg": list_schema(angle, 2, 2),
        "range": list_schema(plain, 2, 2),
        "unit": {"type": "string", "minLength": 1},
        "axis": {"enum": [*CONTROL_AXES, "none"]},
        "held_deg": angle,
        "held": plain,
    }
    schema = named_schema(mapping_schema(keys, []), maxProperties=MAX_CONTROLS)

    def controls(values: dict[str, dict[str, Any]]) -> tuple[Control, ...]:
        names = [*(name for name in CONTROL_NAMES if name in values), *(n for n in values if n not in CONTROL_NAMES)]
        return tuple(_control(name, values[name]) for name in names)

    text = (
        "Pilot controls by name: range_deg of an angle, else range and its unit; axis that a pilot moves with it"
        " (heave, roll, pitch, yaw, none); held_deg or held of a control that trims do not change"
    )
    return declared(text, schema, controls)


def _control(name: str, values: dict[str, Any]) -> Control:
    axis = values.get("axis", dict(zip(CONTROL_NAMES, CONTROL_AXES, strict=True)).get(name, "none"))
    is_angle = "range_deg" in values
    convert = math.radians if is_angle else float
    low, high = values["range_deg" if is_angle else "range"] if is_angle or "range" in values else (0.0, 0.0)
    held = values.get("held_deg" if is_angle else "held")
    return Control(
        name=name,
        range=(convert(low), convert(high)),
        unit="rad" if is_angle else values.get("unit", ""),
        axis="" if axis == "none" else axis,
        held=None if held is None else convert(held),
    )


END_FLIGHT, CONTACT = "end_flight", "contact"
GROUND_EFFECTS = ("none", "cheeseman_bennett", "measured")


@dataclass(frozen=True)
class Ground:
    """The ground: a plane below the origin."""

    contact: str = choice(
        "end_flight: an aircraft whose c.g. or rotor touches the ground flies no further; contact: its contact points"
        " carry it, and only its c.g. and rotors end the flight",
        (END_FLIGHT, CONTACT),
        default=END_FLIGHT,
    )
    effect: str = choice(
        "Ground effect on the induced velocity of each rotor: none; cheeseman_bennett: a source and its image, at half"
        " a radius above the ground and more; measured: Prouty's curve, from 0.127 to 1.2 diameters",
        GROUND_EFFECTS,
        symbol="k_g",
        default=GROUND_EFFECTS[0],
    )
    altitude: float | None = number(
        "Height of the ground above the origin, where trims are and flights begin; without it there is none for trims,"
        " and for flights the one that is asked for",
        -1e5,
        1e5,
        "m",
        symbol="h_g",
        default=None,
    )
    slope: float = number("Angle of the ground to the horizontal", 0, 60, "deg", symbol=r"\sigma", default=0.0)
    slope_heading: float = number(
        "Heading in which the ground rises, from north to east", -360, 360, "deg", symbol=r"\psi_\sigma", default=0.0
    )


@dataclass(frozen=True, eq=False)
class ContactPoint(ByContent):
    """A point of a skid or a wheel that touches the ground.

    `position` and `rolling` have the shape (3,).
    """

    name: str = string("Name of the point", is_physics=False)
    position: Array = array(
        "Lowest point of the unloaded skid or wheel from the c.g., body axes",
        -100,
        100,
        "m",
        shape=(3,),
        symbol=r"\mathbf r_c",
        model_field="position",
    )
    stiffness: float = number(
        "Stiffness across the ground", 0, 1e9, "N/m", symbol="k_c", above_minimum=True, model_field="stiffness"
    )
    damping: float = number(
        "Damping across the ground, from `onset` on", 0, 1e8, "N s/m", symbol="c_c", model_field="damping"
    )
    onset: float = number(
        "Depth at which that damping is complete; it grows from zero at the surface",
        1e-6,
        10,
        "m",
        symbol=r"\delta_0",
        default=0.005,
    )
    side_stiffness: float | None = number(
        "Stiffness along the ground, as long as the point does not slide; that across it if left out",
        0,
        1e9,
        "N/m",
        symbol="k_s",
        above_minimum=True,
        default=None,
    )
    side_damping: float | None = number(
        "Damping along the ground, as long as the point does not slide; that across it if left out",
        0,
        1e8,
        "N s/m",
        symbol="c_s",
        default=None,
    )
    friction: float = number("Coefficient of friction", 0, 10, "1", symbol=r"\mu", model_field="friction")
    rolling: Array | None = array(
        "Direction in which a wheel rolls, body axes, any length; without it the point is a skid's",
        -1e3,
        1e3,
        "1",
        shape=(3,),
        symbol=r"\mathbf e_r",
        default=None,
    )
    rolling_friction: float = number(
        "Coefficient of friction of a wheel in that direction; that of its brakes while they are on",
        0,
        10,
        "1",
        symbol=r"\mu_r",
        model_field="rolling_friction",
        default=0.02,
    )

    @property
    def sideways(self) -> tuple[float, float]:
        """Stiffness [N/m] and damping [N s/m] along the ground."""
        return (
            self.stiffness if self.side_stiffness is None else self.side_stiffness,
            self.damping if self.side_damping is None else self.side_damping,
        )


@dataclass(frozen=True, eq=False)
class Description(ByContent):
    """All values of an aircraft file."""

    name: str = string("Name of the aircraft")
    description: str = string("What the aircraft is, in a line", may_be_empty=True, default="")
    environment: Environment = part("Air and gravity", Environment, AIR_RULES, _with_air)
    body: Body = part("The whole aircraft, blades included", Body)
    options: Options = part("How the model reads the equations", Options)
    controls: tuple[Control, ...] = _controls()
    rotors: tuple[Rotor, ...] = parts(
        f"The rotors, 1 to {MAX_ROTORS} of them", Rotor, 1, MAX_ROTORS, rules=MASS_RULES, complete=with_blade_mass
    )
    ground: Ground = part("The ground", Ground, default={})
    contact_points: tuple[ContactPoint, ...] = parts(
        f"Points of skids and wheels that touch the ground, up to {MAX_CONTACTS} of them, see ground.contact",
        ContactPoint,
        0,
        MAX_CONTACTS,
        default=[],
    )
    drives: tuple[Drive, ...] = parts(
        "Drives, which make the speeds of their rotors states of the model; without one a rotor keeps its speed",
        Drive,
        0,
        MAX_ROTORS,
        default=[],
    )
