"""What an aircraft file describes: one declared field for each value.

A declaration holds type, range, unit, symbol, meaning and default of a value; range, unit and default are those of the
file. The attributes are in SI units and radians; docs/reference/aircraft.md lists them all. To add a value see
`sbs_sim.aircraft.declaration`.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sbs_sim.aircraft.declaration import (
    array,
    choice,
    declared,
    frozen,
    integer,
    interval,
    interval_reader,
    list_schema,
    mapping_schema,
    number,
    number_schema,
    part,
    parts,
    string,
)
from sbs_sim.content import ByContent
from sbs_sim.model.state import CONTROL_NAMES, SWASHPLATE_NAMES

Array = NDArray[np.float64]
Range = tuple[float, float]

MAX_ROTORS = 16
STAND_AXES = ("x", "y", "z", "roll", "pitch", "yaw")


@dataclass(frozen=True)
class Environment:
    """Air and gravity."""

    air_density: float = number("Air density; 0 is vacuum", 0, 100, "kg/m^3", symbol=r"\rho", model_field="density")
    kinematic_viscosity: float = number("Kinematic viscosity of the air", 1e-9, 1, "m^2/s", symbol=r"\nu")
    gravity: float = number("Acceleration of gravity", 0, 100, "m/s^2", symbol="g", model_field="gravity")
    speed_of_sound: float = number(
        "Speed of sound, for the warning of high Mach numbers only",
        1,
        10000,
        "m/s",
        default=340.3,  # ISO 2533, standard atmosphere, at sea level
        is_physics=False,
    )


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


def _mixing() -> Any:
    """Field with the swashplate angles over the pilot controls, each factor under the names of both in the file."""
    row = mapping_schema({control: number_schema(-10, 10) for control in CONTROL_NAMES}, [])
    schema = mapping_schema(dict.fromkeys(SWASHPLATE_NAMES, row), list(SWASHPLATE_NAMES))

    def matrix(rows: dict[str, dict[str, float]]) -> Array:
        return frozen([[rows[angle].get(control, 0.0) for control in CONTROL_NAMES] for angle in SWASHPLATE_NAMES])

    text = "Swashplate angles over the pilot controls: angle = sum of factor x control; factors left out are 0"
    return declared(text, schema, matrix, unit="rad/rad")


@dataclass(frozen=True, eq=False)
class Rotor(ByContent):
    """One rotor.

    `rotation` is +1 counter-clockwise seen from above (against the thrust); `hub` and `shaft_direction` have the shape
    (3,), `mixing` has the shape (3, 4): swashplate angles (collective, lateral, longitudinal cyclic) = mixing @ pilot
    controls.
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
    blades: int = integer("Number of blades", 3, 20, symbol="N_b")
    blade_mass: float = number("Mass of a blade", 1e-12, 1e4, "kg", symbol="m_b", model_field="mass")
    blade_cg: float = number("Distance of a blade's c.g. from the flap hinge", 1e-12, 50, "m", symbol="r_G")
    hinge_offset: float = number(
        "Distance of the flap hinge from the axis", 0, 50, "m", symbol="e_0", model_field="hinge_offset"
    )
    flap_hinge_offset: float = number(
        "Distance of the flap hinge from the lag hinge", 0, 50, "m", symbol="e_F", model_field="flap_hinge_offset"
    )
    flap_spring: float = number(
        "Stiffness of the flap hinge", 0, 1e9, "N m/rad", symbol=r"K_\beta", model_field="flap_spring"
    )
    lag_spring: float = number(
        "Stiffness of the lag hinge", 0, 1e9, "N m/rad", symbol=r"K_\xi", model_field="lag_spring"
    )
    lag_damping: float = number(
        "Damping of the lag hinge", 0, 1e9, "N m s/rad", symbol=r"C_\xi", model_field="lag_damping"
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
    chord_root: float = number(
        "Chord at the flap hinge, linear to the tip", 1e-12, 10, "m", key="chord.root", symbol="c"
    )
    chord_tip: float = number("Chord at the tip", 1e-12, 10, "m", key="chord.tip", symbol="c")
    twist_root: float = number("Twist at the flap hinge, linear to the tip", -90, 90, "deg", key="twist_deg.root")
    twist_tip: float = number("Twist at the tip", -90, 90, "deg", key="twist_deg.tip")
    root_cutout: float = number(
        "Distance from the flap hinge to where the blade's profile begins", 0, 50, "m", symbol="r_c"
    )
    tip_loss: float = number(
        "Tip-loss factor: no lift beyond this share of the radius", 0, 1, above_minimum=True, symbol="B"
    )
    swashplate_phase: float = number("Phase of the swashplate against the blades", -360, 360, "deg", symbol=r"\psi_s")
    airfoil: str = string("Airfoil table: a name in config/airfoils, or a path", is_physics=False)  # its table counts
    duct_expansion: float = number(
        "Wake expansion ratio of the duct; 0.5 is an open rotor", 0.25, 2, symbol="a_w", model_field="duct_expansion"
    )
    collective_range: Range = interval("Range of the collective of the swashplate", -90, 90, "deg", is_physics=False)
    cyclic_range: Range = interval("Range of each cyclic of the swashplate", -90, 90, "deg", is_physics=False)
    swashplate_rate: float = number(
        "Fastest motion of each angle of the swashplate", 0, 1e6, "deg/s", above_minimum=True, is_physics=False
    )
    mixing: Array = _mixing()

    @property
    def blade_length(self) -> float:
        """L, from the flap hinge to the tip [m]."""
        return self.radius - self.hinge_offset

    @property
    def first_moment(self) -> float:
        """S1 of a blade about its flap hinge [kg m]."""
        return self.blade_mass * self.blade_cg

    @property
    def second_moment(self) -> float:
        """A1 of a blade about its flap hinge, m_b L^2 / 3 [kg m^2]."""
        return self.blade_mass * (self.blade_length * self.blade_length) / 3

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
        along = span / length
        chord = self.chord_root + along * (self.chord_tip - self.chord_root)
        lift_end = self.tip_loss * self.radius - self.hinge_offset
        lift = np.clip((lift_end - (span - width / 2)) / width, 0.0, 1.0)
        twist = self.twist_root + along * (self.twist_tip - self.twist_root)
        return np.stack([span, chord, chord * width / 2, lift, twist])


def _control_ranges() -> Any:
    """Field with the range of each pilot control by its name."""
    control = mapping_schema({"range_deg": list_schema(number_schema(-90, 90), 2, 2)}, ["range_deg"])
    schema = mapping_schema(dict.fromkeys(CONTROL_NAMES, control), list(CONTROL_NAMES))
    ends = interval_reader("deg")

    def ranges(controls: dict[str, dict[str, list[float]]]) -> dict[str, Range]:
        return {name: ends(controls[name]["range_deg"]) for name in CONTROL_NAMES}

    return declared("Range of each pilot control", schema, ranges, unit="deg", key="controls")


@dataclass(frozen=True, eq=False)
class Description(ByContent):
    """All values of an aircraft file."""

    name: str = string("Name of the aircraft")
    description: str = string("What the aircraft is, in a line", may_be_empty=True, default="")
    environment: Environment = part("Air and gravity", Environment)
    body: Body = part("The whole aircraft, blades included", Body)
    options: Options = part("How the model reads the equations", Options)
    control_ranges: dict[str, Range] = _control_ranges()
    rotors: tuple[Rotor, ...] = parts(f"The rotors, 1 to {MAX_ROTORS} of them", Rotor, 1, MAX_ROTORS)
