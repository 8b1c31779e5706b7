"""The vectors of the model: states, controls, outputs; their names, units and indices.

Everything that reads or writes a state vector (dynamics, trim, linearization, recorder, messages) takes the
indices from here. Two vectors describe the same aircraft:

simulation state, 13 + 4 n_blades + 3 n_rotors values
    position (NED, m) | attitude (unit quaternion w, x, y, z: body FRD to NED) | velocity u, v, w (body, m/s) |
    angular velocity p, q, r (body, rad/s) | flap of all rotors | flap rates | lag | lag rates | inflow
linear state, 8 + 4 n_blades + 3 n_rotors values (38 for two three-bladed rotors; eq. [18] of the paper)
    u w q theta v p phi r | flap | flap rates | lag | lag rates | inflow

Flap and lag are multiblade coordinates (theory.md section 1), inflow is lambda0, lambdas, lambdac per rotor.

Behind the inflow of all rotors follow, of each rotor with an unsteady airfoil, the multiblade coordinates of the slow
and of the fast part of its blades' circulation (theory.md section 4.9), in both states.

Drives stand behind all that (theory.md section 7.6): of each the speed of its first rotor (rad/s), with an engine its
torque (N m), with a governor the integral part of its throttle. Behind these, and not in the linear state, follow of
each drive the azimuth of its first rotor (rad), the share of the battery that is used up, and the share of the engine
that has failed.

Behind these are, of an aircraft that can stand on the ground, the deflections of each of its contact points along the
ground (m), which the linear state does not have either. Last are, of an aircraft with late separation, what
`SECTION_NAMES` says of all sections (theory.md section 4.10), likewise.
"""

import re
from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np
from numpy.typing import NDArray

from sbs_sim.lanes import Vector
from sbs_sim.model import frames
from sbs_sim.model.kernel import kernel

Array = NDArray[np.float64]

POSITION, ATTITUDE, VELOCITY, RATES = 0, 3, 7, 10  # first index of each part of the simulation state
DOWN = POSITION + 2
BODY_SIZE = 13
LINEAR_BODY_SIZE = 8
LINEAR_U, LINEAR_W, LINEAR_Q, LINEAR_THETA, LINEAR_V, LINEAR_P, LINEAR_PHI, LINEAR_R = range(LINEAR_BODY_SIZE)
LINEAR_BODY_NAMES = ("u", "w", "q", "theta", "v", "p", "phi", "r")
LINEAR_BODY_UNITS = ("m/s", "m/s", "rad/s", "rad", "m/s", "rad/s", "rad", "rad/s")
# deflections of a stand along and about the axes, with the velocities that are their rates
DEFLECTIONS = {"x": "u", "y": "v", "z": "w", "roll": "p", "pitch": "q", "yaw": "r"}
CONTROL_NAMES = ("collective", "lateral_cyclic", "longitudinal_cyclic", "differential_longitudinal_cyclic")
CONTROL_AXES = ("heave", "roll", "pitch", "yaw")  # that a pilot moves with them
EULER_NAMES, AIRSPEED = ("psi", "theta", "phi"), "V"  # outputs that follow from a simulation state
SWASHPLATE_NAMES = ("collective", "lateral_cyclic", "longitudinal_cyclic")
COLLECTIVE, LATERAL, LONGITUDINAL = range(3)  # of SWASHPLATE_NAMES
INFLOW_NAMES = ("lambda0", "lambdas", "lambdac")
UNIFORM, SINE, COSINE = range(3)  # of INFLOW_NAMES
WAKE_NAMES = ("wake_slow", "wake_fast")  # parts of the circulation that follow the flow
SPEED, ENGINE_TORQUE, GOVERNOR = DRIVE_NAMES = ("Omega", "engine_torque", "governor")
DRIVE_UNITS = {SPEED: "rad/s", ENGINE_TORQUE: "N m", GOVERNOR: "1"}
UNSEEN_NAMES = ("azimuth", "discharge", "engine_failure")  # of a drive, and not in the linear state
AZIMUTH, DISCHARGE, FAILURE = range(3)  # of UNSEEN_NAMES
CONTACT_NAMES = ("contact_x", "contact_y")  # of a contact point
CONTACT_STATES = len(CONTACT_NAMES)
# of a section in stall: share of the chord that is attached, lift coefficient of the pressure at the leading edge,
# normal force coefficient of the vortex, and its age in semi-chords that the flow went
SECTION_NAMES = ("attached_share", "pressure_lift", "vortex_lift", "vortex_age")
COMMAND_NAMES = ("throttle", "set_point")  # of a drive that pilot controls act on
THROTTLE, SET_POINT = range(2)  # of COMMAND_NAMES
ROW = len(SWASHPLATE_NAMES)  # numbers in a row of commands: a swashplate's, or a drive's and what is left at zero

_ROTOR_STATE = re.compile(
    r"(?P<rate>d?)(?:[ab](?P<flap>\d+|d)|xi(?P<lag>0|d|\d*[cs]))\((?P<rotor>\d+)\)"
    r"|lambda(?P<inflow>[0sc])\((?P<inflow_rotor>\d+)\)"
    r"|wake_(slow|fast)(?P<wake>0|d|\d*[cs])\((?P<wake_rotor>\d+)\)"
    r"|(?P<drive>Omega|engine_torque|governor)\(\d+\)"
)


def harmonic_count(blades: int) -> int:
    """Harmonics of the multiblade coordinates of a rotor, cosine and sine each."""
    return (blades - 1) // 2


def multiblade_suffixes(blades: int) -> tuple[str, ...]:
    """Names of the coordinates of one rotor: collective, cosine and sine of each harmonic, differential.

    Parameters
    ----------
    blades : int
        Number of blades, at least 2.

    Returns
    -------
    tuple of str, length `blades`
        "0", then ("c", "s"), ("2c", "2s"), ... and "d" last for an even number: ("0", "d") for two blades.
    """
    names = ["0"]
    for harmonic in range(1, harmonic_count(blades) + 1):
        order = "" if harmonic == 1 else str(harmonic)
        names += [f"{order}c", f"{order}s"]
    return tuple(names + ["d"] if blades % 2 == 0 else names)


@dataclass(frozen=True)
class Part:
    """What a linear state belongs to, known from its name.

    Attributes
    ----------
    family : str
        "body", "flap", "lag", "inflow", "wake" or "drive".
    harmonic : int
        0 for body states and collective coordinates, n for the nth harmonic, -1 for the differential coordinate.
    rotor : int
        Index of the rotor, -1 for the body and for drives.
    is_rate : bool
        True for the rate of a flap or lag coordinate.
    """

    family: str
    harmonic: int
    rotor: int
    is_rate: bool = False


@cache
def part_of(name: str) -> Part:
    """Part that a linear state belongs to.

    Parameters
    ----------
    name : str
        One of `StateLayout.linear_names`, or of `DEFLECTIONS`.

    Raises
    ------
    ValueError
        No linear state has this name.
    """
    if name in LINEAR_BODY_NAMES or name in DEFLECTIONS:
        return Part("body", 0, -1)
    match = _ROTOR_STATE.fullmatch(name)
    if match is None:
        raise ValueError(f"no linear state is called {name!r}")
    if match["drive"]:
        return Part("drive", 0, -1)
    rotor = int(match["rotor"] or match["inflow_rotor"] or match["wake_rotor"]) - 1
    if match["inflow"]:
        return Part("inflow", 0 if match["inflow"] == "0" else 1, rotor)
    if match["wake"]:
        return Part("wake", _harmonic(match["wake"]), rotor)
    if match["lag"]:
        return Part("lag", _harmonic(match["lag"]), rotor, bool(match["rate"]))
    return Part("flap", -1 if match["flap"] == "d" else int(match["flap"]), rotor, bool(match["rate"]))


def _harmonic(suffix: str) -> int:
    """Harmonic of a coordinate with one of the names of `multiblade_suffixes`, -1 for the differential one."""
    digits = suffix.rstrip("cs") or "1"
    return -1 if digits == "d" else int(digits)


@dataclass(frozen=True)
class StateLayout:
    """Indices and names of all states of an aircraft.

    Parameters
    ----------
    blades : tuple of int
        Number of blades of each rotor, in the order of the aircraft file.
    drives : tuple of tuple of str
        Of each drive those of `DRIVE_NAMES` that it has.
    contacts : int
        Number of points that can touch the ground.
    wakes : tuple of bool
        Which rotors have an unsteady airfoil; none if empty.
    sections : int
        Sections whose stall has states, and room for those.
    section_states : int
        Of each: the first ones of `SECTION_NAMES`.
    """

    blades: tuple[int, ...]
    drives: tuple[tuple[str, ...], ...] = ()
    contacts: int = 0
    wakes: tuple[bool, ...] = ()
    sections: int = 0
    section_states: int = 0

    @cached_property
    def blade_count(self) -> int:
        """Number of blades of all rotors together."""
        return sum(self.blades)

    @cached_property
    def size(self) -> int:
        """Length of the simulation state."""
        return self.sections_start + self.sections * self.section_states

    @cached_property
    def sections_start(self) -> int:
        """Index of the first state of a section."""
        return self.contacts_start + CONTACT_STATES * self.contacts

    @cached_property
    def contacts_start(self) -> int:
        """Index of the first deflection of a contact point."""
        return self.drives_start + sum(map(len, self.drives)) + len(UNSEEN_NAMES) * len(self.drives)

    @cached_property
    def drives_start(self) -> int:
        """Index of the first state of the drives: the length of the state without them."""
        return self._wakes_start + self._wakes_before(len(self.blades))

    @cached_property
    def linear_size(self) -> int:
        """Length of the linear state: 38 for two three-bladed rotors."""
        return self.contacts_start - len(UNSEEN_NAMES) * len(self.drives) - BODY_SIZE + LINEAR_BODY_SIZE

    def _multiblade(self, block: int, rotor: int) -> slice:
        first = BODY_SIZE + block * self.blade_count + sum(self.blades[:rotor])
        return slice(first, first + self.blades[rotor])

    def flap(self, rotor: int) -> slice:
        """Indices of one rotor's flap coordinates in the simulation state [rad]."""
        return self._multiblade(0, rotor)

    def flap_rate(self, rotor: int) -> slice:
        """Indices of one rotor's flap coordinate rates [rad/s]."""
        return self._multiblade(1, rotor)

    def lag(self, rotor: int) -> slice:
        """Indices of one rotor's lag coordinates [rad], positive against the rotation."""
        return self._multiblade(2, rotor)

    def lag_rate(self, rotor: int) -> slice:
        """Indices of one rotor's lag coordinate rates [rad/s]."""
        return self._multiblade(3, rotor)

    def inflow(self, rotor: int) -> slice:
        """Indices of one rotor's lambda0, lambdas, lambdac in the simulation state."""
        first = BODY_SIZE + 4 * self.blade_count + 3 * rotor
        return slice(first, first + 3)

    @property
    def _wakes_start(self) -> int:
        return BODY_SIZE + 4 * self.blade_count + 3 * len(self.blades)

    def _wakes_before(self, rotor: int) -> int:
        return len(WAKE_NAMES) * sum(
            blades for blades, has_wake in zip(self.blades[:rotor], self.wakes, strict=False) if has_wake
        )

    def wake(self, rotor: int) -> slice:
        """Indices of one rotor's parts of the circulation over the tip speed: slow, then fast; empty without them."""
        first = self._wakes_start + self._wakes_before(rotor)
        return slice(first, self._wakes_start + self._wakes_before(rotor + 1))

    def wake_pairs(self, rotor: int) -> list[tuple[int, int]]:
        """Indices of the slow and the fast part of each multiblade coordinate of `wake`."""
        own = self.wake(rotor)
        middle = (own.start + own.stop) // 2
        return list(zip(range(own.start, middle), range(middle, own.stop), strict=True))

    def drive(self, drive: int) -> dict[str, int]:
        """Indices of one drive's states in the simulation state, by the names that they have without the number."""
        first = self.drives_start + sum(map(len, self.drives[:drive]))
        unseen = self.drives_start + sum(map(len, self.drives)) + len(UNSEEN_NAMES) * drive
        places = {name: first + i for i, name in enumerate(self.drives[drive])}
        return places | {name: unseen + i for i, name in enumerate(UNSEEN_NAMES)}

    def contact(self, point: int) -> slice:
        """Indices of the deflections of one contact point along the ground in the simulation state [m]."""
        first = self.contacts_start + CONTACT_STATES * point
        return slice(first, first + CONTACT_STATES)

    def section(self, name: str) -> slice:
        """Indices of one of `SECTION_NAMES` of all sections in the simulation state; empty where they have none."""
        first = self.sections_start + self.sections * SECTION_NAMES.index(name)
        return slice(first, first + self.sections) if name in self.section_names else slice(first, first)

    @property
    def section_names(self) -> tuple[str, ...]:
        """Those of `SECTION_NAMES` that the sections have."""
        return SECTION_NAMES[: self.section_states]

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the simulation state."""
        body = ("north", "east", "down", "qw", "qx", "qy", "qz", "u", "v", "w", "p", "q", "r")
        unseen = [f"{name}({i + 1})" for i in range(len(self.drives)) for name in UNSEEN_NAMES]
        unseen += [f"{name}({i + 1})" for i in range(self.contacts) for name in CONTACT_NAMES]
        unseen += [f"{name}({i + 1})" for name in self.section_names for i in range(self.sections)]
        return body + self._rotor_names + self._drive_names + tuple(unseen)

    @cached_property
    def linear_names(self) -> tuple[str, ...]:
        """Names of the linear state, in the paper's order."""
        return LINEAR_BODY_NAMES + self._rotor_names + self._drive_names

    def has_name(self, name: str) -> bool:
        """A state or linear state has this name."""
        return name in self.names or name in self.linear_names

    @cached_property
    def linear_units(self) -> tuple[str, ...]:
        """Units of the linear state."""
        angles, rates = ("rad",) * self.blade_count, ("rad/s",) * self.blade_count
        drives = tuple(DRIVE_UNITS[name] for names in self.drives for name in names)
        ratios = ("1",) * (self.drives_start - self.inflow(0).start)
        return LINEAR_BODY_UNITS + angles + rates + angles + rates + ratios + drives

    @cached_property
    def linear_owners(self) -> NDArray[np.int64]:
        """Number of the rotor that each linear state belongs to; that of all rotors for those of the body."""
        rotors = [part_of(name).rotor for name in self.linear_names]
        return np.array([len(self.blades) if rotor < 0 else rotor for rotor in rotors])

    @cached_property
    def _drive_names(self) -> tuple[str, ...]:
        return tuple(f"{name}({i + 1})" for i, names in enumerate(self.drives) for name in names)

    @cached_property
    def _rotor_names(self) -> tuple[str, ...]:
        flap = ("a", "b")
        names: list[str] = []
        for prefix in ("", "d"):
            names += [
                f"{prefix}{_flap_name(suffix, flap)}({rotor + 1})"
                for rotor, blades in enumerate(self.blades)
                for suffix in multiblade_suffixes(blades)
            ]
        for prefix in ("xi", "dxi"):
            names += [
                f"{prefix}{suffix}({rotor + 1})"
                for rotor, blades in enumerate(self.blades)
                for suffix in multiblade_suffixes(blades)
            ]
        names += [f"{name}({rotor + 1})" for rotor in range(len(self.blades)) for name in INFLOW_NAMES]
        names += [
            f"{name}{suffix}({rotor + 1})"
            for rotor, has_wake in enumerate(self.wakes)
            if has_wake
            for name in WAKE_NAMES
            for suffix in multiblade_suffixes(self.blades[rotor])
        ]
        return tuple(names)

    def to_linear(self, state: Array) -> Array:
        """Linear state of a simulation state; position, heading and what drives have unseen are left out.

        Parameters
        ----------
        state : ndarray, shape (size,)

        Returns
        -------
        ndarray, shape (linear_size,)
        """
        u, v, w, p, q, r = state[VELOCITY : VELOCITY + 6]
        _, theta, phi = frames.quaternion_to_euler(state[ATTITUDE : ATTITUDE + 4])
        end = self.linear_size - LINEAR_BODY_SIZE + BODY_SIZE
        return np.concatenate(([u, w, q, theta, v, p, phi, r], state[BODY_SIZE:end]))

    def from_linear(self, linear: Array, heading: float = 0.0) -> Array:
        """Simulation state at the origin with a given heading [rad] of a linear state.

        Parameters
        ----------
        linear : ndarray, shape (linear_size,)
        heading : float
            Yaw angle, positive from north to east [rad].

        Returns
        -------
        ndarray, shape (size,)
        """
        u, w, q, theta, v, p, phi, r = linear[:LINEAR_BODY_SIZE]
        state = np.zeros(self.size)
        state[ATTITUDE : ATTITUDE + 4] = frames.euler_to_quaternion(heading, theta, phi)
        state[VELOCITY : VELOCITY + 6] = u, v, w, p, q, r
        state[BODY_SIZE : self.linear_size - LINEAR_BODY_SIZE + BODY_SIZE] = linear[LINEAR_BODY_SIZE:]
        return state


def _flap_name(suffix: str, letters: tuple[str, str]) -> str:
    """The paper's a0, a1, b1 for suffixes 0, c, s; a2, b2 for 2c, 2s; ad for the differential one."""
    cosine, sine = letters
    if suffix in ("0", "d"):
        return cosine + suffix
    order = suffix[:-1] or "1"
    return (cosine if suffix.endswith("c") else sine) + order


@kernel
def vector_at(x, first):
    """Vector of three successive values, for example of `VELOCITY`."""
    return Vector(x[first], x[first + 1], x[first + 2])


@kernel
def set_vector(x, first, vector):
    """Set three successive values."""
    x[first], x[first + 1], x[first + 2] = vector.x, vector.y, vector.z


@kernel
def attitude_at(x):
    """Attitude of a simulation state."""
    return frames.Quaternion(x[ATTITUDE], x[ATTITUDE + 1], x[ATTITUDE + 2], x[ATTITUDE + 3])


@kernel
def set_attitude(x, quaternion):
    """Set the attitude of a simulation state, or its rate."""
    x[ATTITUDE], x[ATTITUDE + 1], x[ATTITUDE + 2], x[ATTITUDE + 3] = quaternion
