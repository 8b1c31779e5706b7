"""Arrays to messages and back.

Inside, position and attitude are NED and vectors FRD; `odom` alone is in the axes of REP 103 (ENU, FLU). The comments
in the interface definitions say which field is in which frame.
"""

import array
import dataclasses
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from builtin_interfaces.msg import Time
from geometry_msgs.msg import Point, Quaternion, Vector3
from nav_msgs.msg import Odometry
from numpy.typing import NDArray

from sbs_msgs.msg import (
    BodyState,
    ContactState,
    Controls,
    DriveCommand,
    DriveState,
    FlightEvent,
    GustPoint,
    Inflow,
    InflowArray,
    RotorState,
    RotorStateArray,
    ScheduledControl,
    SectionState,
    ShedWake,
    SimulationStatus,
    SurfaceCommand,
    Swashplate,
    SwashplateArray,
    WorkingState,
)
from sbs_msgs.msg import Wind as WindMessage
from sbs_msgs.srv import SetWind
from sbs_sim import checks
from sbs_sim.aircraft import Aircraft
from sbs_sim.aircraft.description import Rotor
from sbs_sim.errors import SimulationError
from sbs_sim.flight import validity
from sbs_sim.flight.gust_file import gust_table
from sbs_sim.flight.records import Event, Snapshot
from sbs_sim.model import records as R
from sbs_sim.model import state as S
from sbs_sim.model.contact import CONTACT_SIZE, DEPTH
from sbs_sim.model.frames import quaternion_to_euler, rotation_matrix
from sbs_sim.model.gust_table import GustTable
from sbs_sim.model.multiblade import blade_matrix
from sbs_sim.model.state import harmonic_count
from sbs_sim.model.wind import FIELDS, MAX_WIND, MIN_TURBULENCE_AIRSPEED, RANGES, RATES, Wind, field_of
from sbs_sim.recording.recorded_flight import DRIVE_FIELDS

Array = NDArray[np.float64]

FRAME_NED = "ned"
FRAME_BODY = "base_link_frd"
FRAME_ODOM = "odom"
FRAME_BASE = "base_link"
BLADE_FIELDS = ("flap", "flap_rate", "lag", "lag_rate", "blade_flap", "blade_lag")
HALF = math.sqrt(0.5)
MAX_VALUE = 1e9  # of any number of a flight that can be shown


def to_time(seconds: float) -> Time:
    """ROS time of a simulation time [s]."""
    nanoseconds = round(seconds * 1e9)
    return Time(sec=nanoseconds // 1_000_000_000, nanosec=nanoseconds % 1_000_000_000)


def to_seconds(time: Time) -> float:
    """Time [s] of a ROS time."""
    return time.sec + 1e-9 * time.nanosec


def axis_controls_message(aircraft: Aircraft, controls: Array) -> Controls:
    """Message, without a stamp, of the pilot controls of the four axes; zeros if an axis has no control."""
    return controls_of(controls[aircraft.axis_controls]) if aircraft.has_axes else Controls()


def controls_of(controls: Array) -> Controls:
    """Message, without a stamp, of the pilot controls of the four axes [rad], shape (4,)."""
    return Controls(**dict(zip(S.CONTROL_NAMES, controls.tolist(), strict=True)))


def controls_array(message: Controls) -> Array:
    """Pilot controls of the four axes [rad], shape (4,)."""
    return np.array([getattr(message, name) for name in S.CONTROL_NAMES])


def swashplate_array(message: SwashplateArray) -> Array:
    """Swashplate angles [rad], shape (n_rows, 3), see `Aircraft.mix`."""
    angles = [[getattr(rotor, name) for name in S.SWASHPLATE_NAMES] for rotor in message.rotors]
    angles += [[*(getattr(drive, name) for name in S.COMMAND_NAMES), 0.0] for drive in message.drives]
    single = [*(surface.incidence for surface in message.surfaces), *(control.value for control in message.scheduled)]
    angles += [[value, 0.0, 0.0] for value in single]
    return np.array(angles, dtype=float).reshape(-1, S.ROW)


def swashplate_messages(angles: Array) -> list[Swashplate]:
    """One message per rotor of swashplate angles [rad], shape (n_rotors, 3)."""
    return [Swashplate(**dict(zip(S.SWASHPLATE_NAMES, row, strict=True))) for row in angles.tolist()]


def command_fields(aircraft: Aircraft, rows: Array) -> dict[str, Any]:
    """Fields `drives`, `surfaces` and `scheduled` of a message, of commands of shape (n_rows, 3).

    All are lists of messages: rclpy writes bytes behind a message that ends in an empty array of float64, which other
    readers of logs refuse.
    """
    first, behind = len(aircraft.rotors), len(aircraft.rotors) + len(aircraft.commanded_drives)
    last = behind + len(aircraft.commanded_surfaces)
    drives = [DriveCommand(**dict(zip(S.COMMAND_NAMES, row, strict=False))) for row in rows[first:behind].tolist()]
    surfaces = [SurfaceCommand(incidence=value) for value in rows[behind:last, 0].tolist()]
    return {
        "drives": drives,
        "surfaces": surfaces,
        "scheduled": [ScheduledControl(value=value) for value in rows[last:, 0].tolist()],
    }


# fields of a request that are those of a wind, and such whose 0 is a default, with what that is
GIVEN = (
    *("turbulence_model", "turbulence_lateral_length", "turbulence_vertical_length", "turbulence_extent"),
    *("gust_shape", "gust_length", "gust_distance", "wind_profile"),
)
DEFAULTED = {
    "turbulence_length": "50 m",
    "turbulence_airspeed": "that of the flow",
    "turbulence_span": "that of the rotors",
    "reference_height": "20 ft",
    "roughness_length": "0.15 ft",
    "profile_exponent": "1/7",
}


def wind_of(request: SetWind.Request, snapshot: Snapshot, aircraft: Aircraft) -> Wind:
    """Wind of a request; what it leaves to the flight and its aircraft comes from the present one.

    Raises
    ------
    SimulationError
        See `Wind`.
    """
    velocity = _triple(request.velocity)
    relative = _ground_velocity(snapshot) - np.array(velocity)
    speed = float(np.hypot(relative[0], relative[1]))
    heading = quaternion_to_euler(snapshot.state[S.ATTITUDE : S.VELOCITY])[0]
    moving = speed >= MIN_TURBULENCE_AIRSPEED
    direction = math.atan2(relative[1], relative[0]) if moving else heading
    north, east, down = snapshot.state[: S.ATTITUDE].tolist()
    span = aircraft.rotor_span if request.turbulence_extent == RATES else 0.0
    defaults: dict[str, Any] = {
        "turbulence_airspeed": min(max(speed, MIN_TURBULENCE_AIRSPEED), MAX_WIND),
        "turbulence_span": span,
    }
    return Wind(
        velocity=velocity,
        gust=_triple(request.gust),
        gust_delay=request.gust_delay,
        gust_duration=request.gust_duration,
        turbulence_intensity=_triple(request.turbulence_intensity),
        turbulence_direction=direction,
        turbulence_seed=request.turbulence_seed,
        gust_direction=direction,
        gust_origin=(north, east, down),
        own_gust=gust_table(request.own_gust_csv, "own_gust_csv") if request.own_gust_csv else None,
        **{name: getattr(request, name) for name in GIVEN},
        **defaults | _not_zero(request),
    )


def _not_zero(request: SetWind.Request) -> dict[str, float]:
    """What a request has in place of defaults."""
    values = {
        name: checks.number(name, getattr(request, name), *RANGES[name], SimulationError, default)
        for name, default in DEFAULTED.items()
    }
    return {name: value for name, value in values.items() if value != 0.0}


def wind_words(wind: Wind) -> str:
    """What blows, in a line: a value that was forgotten, or taken from the flight, shows."""
    parts = []
    if any(wind.velocity):
        parts.append(f"{math.hypot(*wind.velocity):.3g} m/s")
    if any(wind.gust):
        parts.append(f"a gust of {math.hypot(*wind.gust):.3g} m/s")
    if wind.own_gust is not None:
        parts.append(f"an own gust over {wind.own_gust.over}")
    if any(wind.turbulence_intensity):
        most = f"of up to {max(wind.turbulence_intensity):.3g} m/s"
        passing = f"passing at {wind.turbulence_airspeed:.3g} m/s"
        parts.append(f"turbulence ({wind.turbulence_model}, {wind.turbulence_extent}) {most}, {passing}")
    return ", ".join(parts) or "still air"


def prepare_field(request: SetWind.Request) -> None:
    """Make the field of turbulence of a request, which takes some tenths of a second, while the flight goes on.

    Raises
    ------
    SimulationError
        See `Wind`.
    """
    if request.turbulence_extent in FIELDS:
        turbulence: dict[str, Any] = {name: getattr(request, name) for name in GIVEN} | _not_zero(request)
        field_of(
            Wind(
                turbulence_intensity=_triple(request.turbulence_intensity),
                turbulence_seed=request.turbulence_seed,
                **{name: value for name, value in turbulence.items() if name.startswith("turbulence")},
            )
        )


def event_message(event: Event, step_size: float) -> FlightEvent:
    """Message of an event; the step size [s] gives its time."""
    message = FlightEvent(step=event.step, kind=event.kind)
    message.header.stamp = to_time(event.step * step_size)
    if event.swashplate is not None:
        message.swashplate = float64_array(event.swashplate)
    if event.state is not None:
        message.state = float64_array(event.state)
    if event.wind is not None:
        _fill_wind(message.wind, event.wind)
    message.wind_step, message.wind_ticks = event.wind_step, event.wind_ticks
    message.drive, message.failure = event.drive, event.failure
    return message


def _fill_wind(message: WindMessage, wind: Wind) -> None:
    for field in dataclasses.fields(wind):
        value = getattr(wind, field.name)
        if field.name == "own_gust":
            _fill_own_gust(message, value)
        elif isinstance(value, tuple):
            set_vector(getattr(message, field.name), value)
        else:
            setattr(message, field.name, value)


def _fill_own_gust(message: WindMessage, table: GustTable | None) -> None:
    if table is not None:
        message.own_gust_over = table.over
        for position, *velocity in table.rows.tolist():
            message.own_gust.append(GustPoint(position=position))
            set_vector(message.own_gust[-1].velocity, velocity)


def _triple(vector: Vector3 | Point) -> tuple[float, float, float]:
    return vector.x, vector.y, vector.z


def point_array(point: Point | Vector3) -> Array:
    """Components of a point or vector, shape (3,)."""
    return np.array(_triple(point))


def _ground_velocity(snapshot: Snapshot) -> Array:
    """Velocity over ground, NED [m/s], shape (3,)."""
    return rotation_matrix(snapshot.state[S.ATTITUDE : S.VELOCITY]) @ snapshot.state[S.VELOCITY : S.RATES]


def set_vector(target: Vector3 | Point, values: Sequence[float]) -> None:
    """Set the parts x, y, z."""
    target.x, target.y, target.z = values


def float64_array(values: Array) -> array.array:
    """Array for a float64[] field: this type alone is taken without a look at every element."""
    return array.array("d", values.tobytes())


def fill_working_states(status: SimulationStatus, aircraft: Aircraft, snapshot: Snapshot) -> None:
    """Fill in what the rotors are made to do, and what of that is outside the validity of the model."""
    if snapshot.working is None:
        return
    rows = snapshot.working.tolist()  # numbers of Python are much faster to ask for one by one
    status.warnings = validity.warnings(aircraft, rows)
    if len(status.working_states) != len(rows):
        status.working_states = [WorkingState() for _ in rows]
    for rotor, row, message in zip(aircraft.rotors, rows, status.working_states, strict=True):
        state = validity.working_state(row)
        message.advance_ratio, message.descent_ratio = state.advance_ratio, state.descent_ratio
        message.stalled_share, message.reversed_share = state.stalled_share, state.reversed_share
        message.outside_share, message.tip_mach = state.outside_share, validity.tip_mach(aircraft, rotor, row)
        message.inflow_state = validity.INFLOW_STATES.index(state.inflow_state)


class BladeAngles:
    """Flap and lag angles of all blades, as `sbs_sim.flight.blade_angles` gives them; in memory of its own.

    Parameters
    ----------
    aircraft : Aircraft
    """

    def __init__(self, aircraft: Aircraft) -> None:
        blades = aircraft.layout.blades
        self._angles = np.empty((2, sum(blades)))
        self._alike = [_BladesAlike(aircraft, count) for count in dict.fromkeys(blades)]

    def of(self, snapshot: Snapshot) -> Array:
        """Flap and lag [rad], shape (2, blades of all rotors): rotor after rotor, valid until the next call."""
        for alike in self._alike:
            self._angles[:, alike.indices] = alike.of(snapshot)
        return self._angles


class _BladesAlike:
    """Blades of all rotors that have as many: their matrices are filled in together, see `blade_matrix`."""

    def __init__(self, aircraft: Aircraft, count: int) -> None:
        layout = aircraft.layout
        firsts = np.cumsum([0, *layout.blades])
        self._rotors = np.array([j for j, blades in enumerate(layout.blades) if blades == count])
        self.indices = np.array([firsts[j] + k for j in self._rotors for k in range(count)])
        coordinates = [(layout.flap(j), layout.lag(j)) for j in self._rotors.tolist()]
        order = np.arange(layout.size)
        self._coordinates = np.array([np.stack([order[flap], order[lag]], axis=-1) for flap, lag in coordinates])
        self._matrices = np.array([blade_matrix(count, 0.0) for _ in coordinates])
        self._behind = 2 * math.pi * np.arange(count) / count
        self._harmonics = np.arange(1, harmonic_count(count) + 1)
        last = 1 + 2 * len(self._harmonics)
        self._cosines, self._sines = self._matrices[..., 1:last:2], self._matrices[..., 2:last:2]

    def of(self, snapshot: Snapshot) -> Array:
        psi = snapshot.azimuth[self._rotors, np.newaxis] + self._behind
        angles = psi[..., np.newaxis] * self._harmonics
        np.negative(np.cos(angles), out=self._cosines)
        np.negative(np.sin(angles), out=self._sines)
        found: Array = (self._matrices @ snapshot.state[self._coordinates]).reshape(-1, 2)
        return found.T


class StateMessages:
    """The messages of one instant; made once and filled again and again.

    Parameters
    ----------
    aircraft : Aircraft
    """

    def __init__(self, aircraft: Aircraft) -> None:
        self._aircraft = aircraft
        self._layout = aircraft.layout
        self._blades = BladeAngles(aircraft)
        self._firsts = np.cumsum([0, *aircraft.layout.blades]).tolist()
        count = len(aircraft.rotors)
        self.state = BodyState()
        self.state.contacts = [ContactState() for _ in range(self._layout.contacts)]
        self.state.header.frame_id = FRAME_NED
        self.rotors = RotorStateArray(rotors=[_rotor_at_rest(rotor) for rotor in aircraft.rotors])
        self.rotors.drives = [DriveState() for _ in aircraft.drives]
        self.rotors.header.frame_id = FRAME_BODY
        self.inflow = InflowArray(rotors=[Inflow() for _ in range(count)])
        for j, inflow in enumerate(self.inflow.rotors):
            inflow.wake = [ShedWake() for _ in self._layout.wake_pairs(j)]
        self.inflow.sections = [SectionState() for _ in range(self._layout.sections)]
        self.inflow.header.frame_id = FRAME_BODY
        self.odom = Odometry(child_frame_id=FRAME_BASE)
        self.odom.header.frame_id = FRAME_ODOM

    def fill(self, snapshot: Snapshot) -> None:
        """Fill all messages from a snapshot."""
        stamp = to_time(snapshot.time)
        for message in (self.state, self.rotors, self.inflow, self.odom):
            message.header.stamp = stamp
        values = snapshot.state.tolist()
        self._fill_state(values, snapshot.acceleration.tolist())
        if snapshot.contact is not None:
            self._fill_contacts(values, snapshot.contact.tolist())
        self._fill_odom(values)
        for name in self._layout.section_names:
            for section, value in zip(self.inflow.sections, values[self._layout.section(name)], strict=True):
                setattr(section, name, value)
        flaps, lags = self._blades.of(snapshot)
        loads = snapshot.loads.tolist()
        azimuth = snapshot.azimuth.tolist()
        if self._layout.drives:
            self._fill_drives(snapshot.state)
        for j, rotor in enumerate(self.rotors.rotors):
            rotor.azimuth = azimuth[j]
            self._fill_rotor(rotor, j, snapshot.state, loads[j])
            own = slice(self._firsts[j], self._firsts[j + 1])
            rotor.blade_flap, rotor.blade_lag = float64_array(flaps[own]), float64_array(lags[own])
            inflow = self.inflow.rotors[j]
            inflow.uniform, inflow.sine, inflow.cosine = values[self._layout.inflow(j)]
            for wake, (slow, fast) in zip(inflow.wake, self._layout.wake_pairs(j), strict=True):
                wake.slow, wake.fast = values[slow], values[fast]

    def _fill_state(self, values: list[float], acceleration: list[float]) -> None:
        body = self.state
        set_vector(body.position, values[0:3])
        body.attitude.w, body.attitude.x, body.attitude.y, body.attitude.z = values[3:7]
        set_vector(body.velocity, values[7:10])
        set_vector(body.angular_velocity, values[10:13])
        set_vector(body.acceleration, acceleration)

    def _fill_contacts(self, values: list[float], rows: list[list[float]]) -> None:
        for i, (contact, row) in enumerate(zip(self.state.contacts, rows, strict=True)):
            set_vector(contact.force, row[:DEPTH])
            contact.depth = row[DEPTH]
            contact.deflection_x, contact.deflection_y = values[self._layout.contact(i)]

    def _fill_drives(self, state: Array) -> None:
        for i, drive in enumerate(self.rotors.drives):
            for name, place in self._layout.drive(i).items():
                setattr(drive, DRIVE_FIELDS.get(name, name), float(state[place]))
        for rotor, speed in zip(self.rotors.rotors, self._aircraft.rotor_speeds(state).tolist(), strict=True):
            rotor.speed = speed

    def _fill_rotor(self, rotor: RotorState, j: int, state: Array, loads: list[float]) -> None:
        layout = self._layout
        rotor.flap = float64_array(state[layout.flap(j)])
        rotor.flap_rate = float64_array(state[layout.flap_rate(j)])
        rotor.lag = float64_array(state[layout.lag(j)])
        rotor.lag_rate = float64_array(state[layout.lag_rate(j)])
        rotor.thrust, rotor.torque = loads[R.THRUST], loads[R.TORQUE]
        rotor.power = loads[R.TORQUE] * rotor.speed
        set_vector(rotor.hub.force, loads[R.FORCE : R.FORCE + 3])
        set_vector(rotor.hub.torque, loads[R.MOMENT : R.MOMENT + 3])

    def _fill_odom(self, values: list[float]) -> None:
        """The same motion in ENU and FLU: x east, y north, z up; body x forward, y left, z up."""
        north, east, down = values[0:3]
        pose, twist = self.odom.pose.pose, self.odom.twist.twist
        set_vector(pose.position, (east, north, -down))
        set_quaternion(pose.orientation, enu_flu_quaternion(values[3:7]))
        u, v, w, p, q, r = values[7:13]
        set_vector(twist.linear, (u, -v, -w))
        set_vector(twist.angular, (p, -q, -r))


def _rotor_at_rest(rotor: Rotor) -> RotorState:
    """Message of a rotor with a number for every blade."""
    still = {name: float64_array(np.zeros(rotor.blades)) for name in BLADE_FIELDS}
    return RotorState(speed=rotor.speed, **still)


def enu_flu_quaternion(ned_frd: Sequence[float]) -> tuple[float, float, float, float]:
    """Quaternion (w, x, y, z) from FLU to ENU of one from FRD to NED.

    q_ENU<-NED q q_FRD<-FLU with the half turns (0, 1, 1, 0) / sqrt(2) about the bisector of north and east and
    (0, 1, 0, 0) about the body's x axis (REP 103), multiplied out.
    """
    w, x, y, z = ned_frd
    return HALF * (w + z), HALF * (x + y), HALF * (x - y), HALF * (w - z)


def body_array(message: BodyState) -> Array:
    """Position, attitude, velocity and rates, shape (13,): the first part of the simulation state."""
    q, parts = message.attitude, (message.velocity, message.angular_velocity)
    return np.array([*_triple(message.position), q.w, q.x, q.y, q.z, *_triple(parts[0]), *_triple(parts[1])])


def touching_share(message: BodyState) -> float | None:
    """Share of the contact points that touch the ground; None for an aircraft without such points."""
    if not message.contacts:
        return None
    return sum(contact.depth > 0.0 for contact in message.contacts) / len(message.contacts)


def snapshot_of(
    aircraft: Aircraft, body: BodyState, rotors: RotorStateArray, inflow: InflowArray, swashplate: Array, wind: Array
) -> Snapshot:
    """Snapshot that the messages of one instant tell of; its step is 0, since they do not say it.

    Parameters
    ----------
    aircraft : Aircraft
    body : BodyState
    rotors : RotorStateArray
    inflow : InflowArray
    swashplate : ndarray, shape (n_rows, 3)
        [rad]
    wind : ndarray, shape (3,)
        Velocity of the air, NED [m/s].

    Raises
    ------
    SimulationError
        The messages are of an aircraft with other rotors, or have numbers that no flight has.
    """
    layout, count = aircraft.layout, len(aircraft.rotors)
    blades = tuple(len(rotor.flap) for rotor in rotors.rotors)
    sizes = {len(values) for rotor in rotors.rotors for values in (rotor.flap_rate, rotor.lag, rotor.lag_rate)}
    if blades != layout.blades or len(inflow.rotors) != count or not sizes <= set(blades):
        raise SimulationError(f"the flight has rotors with {blades} blades, {aircraft.name} has {layout.blades}")
    if len(rotors.drives) != len(layout.drives):
        drives = f"{len(rotors.drives)} drives, {aircraft.name} has {len(layout.drives)}"
        raise SimulationError(f"the flight has {drives}")
    wakes = [len(rotor.wake) for rotor in inflow.rotors]
    expected = [len(layout.wake_pairs(j)) for j in range(count)]
    if wakes != expected:
        problem = f"{wakes} coordinates of wakes, {aircraft.name} has {expected}"
        raise SimulationError(f"the flight has rotors with {problem}")
    if len(inflow.sections) != layout.sections:
        problem = f"{len(inflow.sections)} sections with separation, {aircraft.name} has {layout.sections}"
        raise SimulationError(f"the flight has {problem}")
    state = np.empty(layout.size)
    for name in layout.section_names:
        state[layout.section(name)] = [getattr(section, name) for section in inflow.sections]
    state[: S.BODY_SIZE] = body_array(body)
    for i, drive in enumerate(rotors.drives):
        for name, place in layout.drive(i).items():
            state[place] = getattr(drive, DRIVE_FIELDS.get(name, name))
    if len(body.contacts) != layout.contacts:
        points = f"{len(body.contacts)} contact points, {aircraft.name} has {layout.contacts}"
        raise SimulationError(f"the flight has {points}")
    contact = np.zeros((layout.contacts, CONTACT_SIZE))
    for i, point in enumerate(body.contacts):
        state[layout.contact(i)] = point.deflection_x, point.deflection_y
        contact[i] = *_triple(point.force), point.depth
    loads = np.zeros((count, R.LOAD_SIZE))
    for j, rotor in enumerate(rotors.rotors):
        state[layout.flap(j)], state[layout.flap_rate(j)] = rotor.flap, rotor.flap_rate
        state[layout.lag(j)], state[layout.lag_rate(j)] = rotor.lag, rotor.lag_rate
        state[layout.inflow(j)] = inflow.rotors[j].uniform, inflow.rotors[j].sine, inflow.rotors[j].cosine
        for wake, pair in zip(inflow.rotors[j].wake, layout.wake_pairs(j), strict=True):
            state[list(pair)] = wake.slow, wake.fast
        loads[j, R.THRUST], loads[j, R.TORQUE] = rotor.thrust, rotor.torque
        loads[j, R.FORCE : R.FORCE + 3] = _triple(rotor.hub.force)
        loads[j, R.MOMENT : R.MOMENT + 3] = _triple(rotor.hub.torque)
    acceleration = np.array(_triple(body.acceleration))
    azimuth = np.array([rotor.azimuth for rotor in rotors.rotors])
    for values in (state, acceleration, azimuth, loads, contact):
        if not np.all(np.abs(values) < MAX_VALUE):  # false for a NaN as well
            raise SimulationError(f"the flight has numbers that are not finite or beyond {MAX_VALUE:g}")
    if not state[S.ATTITUDE : S.VELOCITY].any():
        raise SimulationError("the flight has an attitude of 0: allowed is a quaternion")
    return Snapshot(
        step=0,
        time=to_seconds(body.header.stamp),
        state=state,
        acceleration=acceleration,
        swashplate=swashplate,
        azimuth=azimuth,
        loads=loads,
        wind=wind,
        contact=contact if layout.contacts else None,
    )


def set_quaternion(target: Quaternion, values: Sequence[float]) -> None:
    """Set the parts w, x, y, z."""
    target.w, target.x, target.y, target.z = values
