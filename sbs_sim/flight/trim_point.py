"""A steady flight: its condition, the fidelity of the model, and the trim that was found (theory.md section 8)."""

import math
from collections.abc import Iterator
from dataclasses import asdict, astuple, dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sbs_sim import checks
from sbs_sim.content import ByContent
from sbs_sim.errors import TrimError
from sbs_sim.model import state as S
from sbs_sim.model.elementary import cosine_and_sine
from sbs_sim.model.frames import euler_to_quaternion, rotation_matrix
from sbs_sim.output.json_text import plain
from sbs_sim.output.notebook import trim_html

Array = NDArray[np.float64]

# Largest magnitude of each value of a condition, and its unit.
LIMITS = {
    "airspeed": (100.0, "m/s"),
    "climb_rate": (50.0, "m/s"),
    "sideslip": (math.pi, "rad"),
    "turn_rate": (3.0, "rad/s"),
}
MAX_AZIMUTH_COUNT = 1000
ROTOR_LOADS = ("thrust", "torque", "power", "rotor_speed")


@dataclass(frozen=True)
class TrimCondition:
    """The flight to be trimmed, relative to the air.

    Parameters
    ----------
    airspeed : float
        Horizontal component of the velocity [m/s]; negative is backwards.
    climb_rate : float
        Vertical component, positive up [m/s].
    sideslip : float
        Angle from the heading to the horizontal track, positive to the right [rad]: pi/2 is sideways to the right.
    turn_rate : float
        Rate of the heading, positive to the right [rad/s].

    Raises
    ------
    TrimError
        For a value that is not finite or out of range.
    """

    airspeed: float = 0.0
    climb_rate: float = 0.0
    sideslip: float = 0.0
    turn_rate: float = 0.0

    def __post_init__(self) -> None:
        """Check the ranges."""
        for name, (most, unit) in LIMITS.items():
            value = checks.number(name, getattr(self, name), -most, most, unit, TrimError)
            object.__setattr__(self, name, value)

    def scaled(self, share: float) -> "TrimCondition":
        """Condition on the way from hover (0) to this one (1) and on, as far as there are any."""
        parts = {
            name: min(LIMITS[name][0], max(-LIMITS[name][0], share * getattr(self, name)))
            for name in ("airspeed", "climb_rate", "turn_rate")
        }
        return replace(self, **parts)

    def toward(self, other: "TrimCondition", share: float) -> "TrimCondition":
        """Condition on the way from this one (0) to another (1)."""
        pairs = zip(astuple(self), astuple(other), strict=True)
        return TrimCondition(*(start + share * (end - start) for start, end in pairs))

    @property
    def is_motion(self) -> bool:
        """False in hover."""
        return bool(self.airspeed or self.climb_rate or self.turn_rate)

    def motion(self, pitch: float, roll: float) -> tuple[Array, Array]:
        """Velocity [m/s] and angular velocity [rad/s] in body axes at an attitude [rad], each shape (3,)."""
        forward, right, down, turn = self.along_heading().tolist()
        rows = rotation_matrix(euler_to_quaternion(0.0, pitch, roll))
        return rows[0] * forward + rows[1] * right + rows[2] * down, rows[2] * turn

    def along_heading(self) -> Array:
        """Velocity forward, right and down in axes of the heading [m/s], and its rate [rad/s], shape (4,)."""
        along, across = cosine_and_sine(self.sideslip)
        return np.array([self.airspeed * along, self.airspeed * across, -self.climb_rate, self.turn_rate])


@dataclass(frozen=True)
class Fidelity:
    """What a trim, and all that is derived from it, takes into account.

    Parameters
    ----------
    lead_lag : bool
        False holds the blades at zero lag.
    cyclic_inflow : bool
        False holds the cyclic parts of the inflow at zero.
    azimuth_count : int
        N_c, number of azimuths of the averages, 1 to 1000.

    Raises
    ------
    TrimError
        A value of another kind or out of range.
    """

    lead_lag: bool = True
    cyclic_inflow: bool = True
    azimuth_count: int = 12

    def __post_init__(self) -> None:
        """Check the values."""
        for name in ("lead_lag", "cyclic_inflow"):
            object.__setattr__(self, name, checks.flag(name, getattr(self, name), TrimError))
        count = checks.integer("azimuth_count", self.azimuth_count, 1, MAX_AZIMUTH_COUNT, TrimError)
        object.__setattr__(self, "azimuth_count", count)


@dataclass(frozen=True, eq=False)
class TrimPoint(ByContent):
    """A trimmed flight.

    Attributes
    ----------
    condition : TrimCondition
    lead_lag, cyclic_inflow : bool
        Fidelity.
    azimuth_count : int
        N_c of the averages.
    controls : ndarray, shape (n_controls,)
        Collective, lateral, longitudinal, differential longitudinal cyclic [rad].
    swashplate : ndarray, shape (n_rows, 3)
        Angles of each rotor [rad], see `Aircraft.mix`.
    pitch, roll : float
        [rad]
    state : ndarray, shape (n,)
        Linear state, 38 for two three-bladed rotors; names in `state_names`.
    state_names : tuple of str
    thrust, torque, power : ndarray, shape (n_rotors,)
        Mean aerodynamic thrust along the shaft [N], shaft torque [N m], shaft power [W].
    rotor_speed : ndarray, shape (n_rotors,)
        Speed of the rotors [rad/s]: that of the file, or with drives that of the trim.
    residual : float
        Largest scaled residual of the complete equations, whatever the method: accelerations over gravity, rotor and
        inflow rates over those of one revolution.
    method : str
        "newton" or "two_loop".
    iterations : int
        Newton iterations in all, or iterations of the outer loop.
    inner_iterations : int
        Iterations of the inner loop in all; 0 with Newton's method.
    beyond_limits : tuple of str
        Controls and swashplate angles that the trim needs beyond their range; empty if it can be flown.
    warnings : tuple of str
        Where the model does not hold, a line each: vortex ring, stall, Mach and Reynolds numbers ...; empty if it does.
    parameter_hash : str
        Of the aircraft, see `Aircraft.parameter_hash`.
    """

    condition: TrimCondition
    lead_lag: bool
    cyclic_inflow: bool
    azimuth_count: int
    controls: Array
    control_names: tuple[str, ...]
    control_units: tuple[str, ...]
    swashplate: Array
    pitch: float
    roll: float
    state: Array
    state_names: tuple[str, ...]
    thrust: Array
    torque: Array
    power: Array
    rotor_speed: Array
    residual: float
    method: str
    iterations: int
    inner_iterations: int
    beyond_limits: tuple[str, ...]
    warnings: tuple[str, ...]
    parameter_hash: str

    def to_dict(self) -> dict[str, Any]:
        """Everything as plain lists and numbers for JSON, by the names of the attributes."""
        return dict(plain(self.contents()))

    def contents(self) -> dict[str, Any]:
        """Everything by name, the condition as a mapping."""
        values = {field.name: getattr(self, field.name) for field in fields(self)}
        return {**values, "condition": asdict(self.condition)}

    def keys(self) -> tuple[str, ...]:
        """What `point[name]` knows."""
        return (*self.control_names, *ROTOR_LOADS, "psi", S.AIRSPEED, *self.state_names)

    def __iter__(self) -> Iterator[str]:
        return iter(self.keys())

    def __contains__(self, name: object) -> bool:
        return name in self.keys()

    def __getitem__(self, name: str) -> Any:
        """Value of a name.

        Parameters
        ----------
        name : str
            A state, "theta" and "phi" among them; a control [rad]; "psi", the heading, which is 0 [rad]; "V", the speed
            relative to the air [m/s]; "thrust" [N], "torque" [N m], "power" [W], "rotor_speed" [rad/s].

        Returns
        -------
        float, of thrust, torque, power and rotor speed ndarray of shape (n_rotors,)

        Raises
        ------
        KeyError
            There is none; the message lists those that there are.
        """
        if name in self.state_names:
            return float(self.state[self.state_names.index(name)])
        if name in self.control_names:
            return float(self.controls[self.control_names.index(name)])
        if name in ROTOR_LOADS:
            return getattr(self, name)
        if name == S.AIRSPEED:
            return math.hypot(self.condition.airspeed, self.condition.climb_rate)
        if name == "psi":
            return 0.0
        raise KeyError(f"no {name!r}: there are {', '.join(self)}")

    def _repr_html_(self) -> str:
        return trim_html(self)


@dataclass(frozen=True, eq=False)
class StandPoint(TrimPoint):
    """Rest of an aircraft on a stand under given controls.

    Attributes
    ----------
    position : ndarray, shape (3,)
        Deflection of the stand, NED [m].
    heading : float
        Its angle about the vertical, from north to east [rad]; those of pitch and roll are `pitch` and `roll`.
    """

    position: Array
    heading: float

    def __getitem__(self, name: str) -> Any:
        """Value of a name, see `TrimPoint`; "psi" is the heading."""
        return self.heading if name == "psi" else super().__getitem__(name)

    def simulation_state(self, layout: S.StateLayout) -> Array:
        """Simulation state, shape (size,)."""
        state = layout.from_linear(self.state, self.heading)
        state[S.POSITION : S.ATTITUDE] = self.position
        return state
