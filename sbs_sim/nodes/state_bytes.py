"""What is published of every instant, as bytes: numbers go from a snapshot into `templates`, with a few numpy calls.

`SerialisedStates` does the same with ROS's messages, many times slower, where the layout of a ROS release is unknown.
"""

from collections.abc import Callable, Iterator
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from rclpy.serialization import serialize_message

from sbs_msgs.msg import SimulationStatus, WorkingState
from sbs_sim.aircraft import Aircraft
from sbs_sim.flight.records import Snapshot
from sbs_sim.model import records as R
from sbs_sim.model import state as S
from sbs_sim.model.contact import CONTACT_SIZE, DEPTH
from sbs_sim.nodes.conversions import BladeAngles, StateMessages, enu_flu_quaternion, to_time
from sbs_sim.nodes.templates import BYTE, COUNT, DOUBLE, INT, UINT, LayoutError, Template
from sbs_sim.recording.recorded_flight import DRIVE_FIELDS

Array = NDArray[np.float64]

STAMP = {"header.stamp.sec": INT, "header.stamp.nanosec": UINT}
TOPICS = ("state", "rotors", "inflow", "odom")
MAX_STATUS_TEMPLATES = 64  # templates of a status that are kept, one for each of its texts
QUATERNION, XYZ = "wxyz", "xyz"
LOADS = {"thrust": R.THRUST, "torque": R.TORQUE}
LOADS |= {f"hub.force.{axis}": R.FORCE + i for i, axis in enumerate(XYZ)}
LOADS |= {f"hub.torque.{axis}": R.MOMENT + i for i, axis in enumerate(XYZ)}


class States(Protocol):
    """Messages of one instant as bytes."""

    def fill(self, snapshot: Snapshot) -> None:
        """Take an instant."""

    def data(self, topic: str) -> bytes:
        """Message of a topic, one of `TOPICS`, of the last instant."""


class SerialisedStates:
    """By ROS's messages.

    Parameters
    ----------
    aircraft : Aircraft
    """

    def __init__(self, aircraft: Aircraft) -> None:
        self._messages = StateMessages(aircraft)

    def fill(self, snapshot: Snapshot) -> None:
        """See `States`."""
        self._messages.fill(snapshot)

    def data(self, topic: str) -> bytes:
        """See `States`."""
        return bytes(serialize_message(getattr(self._messages, topic)))


class StateBytes:
    """By templates: the same bytes, but for those in gaps, which ROS leaves to chance.

    The numbers of an instant are put into `_source`, and copied from there to their indices in a template.

    Parameters
    ----------
    aircraft : Aircraft

    Raises
    ------
    LayoutError
        See `Template`.
    """

    def __init__(self, aircraft: Aircraft) -> None:
        layout, count = aircraft.layout, len(aircraft.rotors)
        self._size, self._count = layout.size, count
        self._blades = BladeAngles(aircraft)
        self._aircraft, self._speeds = aircraft, np.array([rotor.speed for rotor in aircraft.rotors])
        sizes = {"state": layout.size, "acceleration": 3, "azimuth": count, "loads": R.LOAD_SIZE * count}
        sizes |= {
            "power": count,
            "speed": count,
            "quaternion": 4,
            "flap": layout.blade_count,
            "lag": layout.blade_count,
            "contact": CONTACT_SIZE * layout.contacts,
        }
        ends = np.cumsum(list(sizes.values()))
        parts = zip(sizes.items(), ends.tolist(), strict=True)
        self._parts = {name: slice(end - size, end) for (name, size), end in parts}
        self._source = np.zeros(int(ends[-1]))
        messages = StateMessages(aircraft)
        fields = {topic: dict(getattr(self, f"_{topic}_fields")(aircraft)) for topic in TOPICS}
        self._templates = {
            topic: Template(getattr(messages, topic), {**STAMP, **dict.fromkeys(fields[topic], DOUBLE)})
            for topic in TOPICS
        }
        self._writes = [_Write(self._templates[topic], fields[topic]) for topic in TOPICS]

    def fill(self, snapshot: Snapshot) -> None:
        """See `States`."""
        source, parts, state = self._source, self._parts, snapshot.state
        source[parts["state"]] = state
        source[parts["acceleration"]] = snapshot.acceleration
        source[parts["azimuth"]] = snapshot.azimuth
        source[parts["loads"]] = snapshot.loads.ravel()
        if self._aircraft.drives:
            self._speeds = source[parts["speed"]] = self._aircraft.rotor_speeds(state)
        np.multiply(snapshot.loads[:, R.TORQUE], self._speeds, out=source[parts["power"]])
        source[parts["quaternion"]] = enu_flu_quaternion(state[S.ATTITUDE : S.VELOCITY].tolist())
        source[parts["flap"]], source[parts["lag"]] = self._blades.of(snapshot)
        if snapshot.contact is not None:
            source[parts["contact"]] = snapshot.contact.ravel()
        stamp = to_time(snapshot.time)
        for write in self._writes:
            write(source, stamp)

    def data(self, topic: str) -> bytes:
        """See `States`."""
        return self._templates[topic].data()

    # ----------------------------------------- fields of the messages, with their indices in the source and their signs

    def _at(self, part: str, index: int = 0) -> int:
        return int(self._parts[part].start) + index

    def _vector(self, name: str, first: int, axes: str = XYZ) -> Iterator[tuple[str, tuple[int, float]]]:
        for i, axis in enumerate(axes):
            yield f"{name}.{axis}", (first + i, 1.0)

    def _state_fields(self, aircraft: Aircraft) -> Iterator[tuple[str, tuple[int, float]]]:
        yield from self._vector("position", 0)
        yield from self._vector("attitude", S.ATTITUDE, QUATERNION)
        yield from self._vector("velocity", S.VELOCITY)
        yield from self._vector("angular_velocity", S.RATES)
        yield from self._vector("acceleration", self._at("acceleration"))
        for i in range(aircraft.layout.contacts):
            first, own = self._at("contact", CONTACT_SIZE * i), f"contacts[{i}]."
            yield from self._vector(f"{own}force", first)
            yield f"{own}depth", (first + DEPTH, 1.0)
            for k, axis in enumerate("xy"):
                yield f"{own}deflection_{axis}", (aircraft.layout.contact(i).start + k, 1.0)

    def _rotors_fields(self, aircraft: Aircraft) -> Iterator[tuple[str, tuple[int, float]]]:
        first_blade, layout = 0, aircraft.layout
        for i in range(len(layout.drives)):
            for name, at in layout.drive(i).items():
                yield f"drives[{i}].{DRIVE_FIELDS.get(name, name)}", (at, 1.0)
        for j, rotor in enumerate(aircraft.rotors):
            own = f"rotors[{j}]."
            if layout.drives:
                yield f"{own}speed", (self._at("speed", j), 1.0)
            yield f"{own}azimuth", (self._at("azimuth", j), 1.0)
            yield f"{own}power", (self._at("power", j), 1.0)
            for name, column in LOADS.items():
                yield own + name, (self._at("loads", R.LOAD_SIZE * j + column), 1.0)
            for k in range(rotor.blades):
                for name in ("flap", "flap_rate", "lag", "lag_rate"):
                    yield f"{own}{name}[{k}]", (getattr(aircraft.layout, name)(j).start + k, 1.0)
                for name in ("flap", "lag"):
                    yield f"{own}blade_{name}[{k}]", (self._at(name, first_blade + k), 1.0)
            first_blade += rotor.blades

    def _inflow_fields(self, aircraft: Aircraft) -> Iterator[tuple[str, tuple[int, float]]]:
        for j in range(self._count):
            for i, name in enumerate(("uniform", "sine", "cosine")):
                yield f"rotors[{j}].{name}", (aircraft.layout.inflow(j).start + i, 1.0)
            for i, (slow, fast) in enumerate(aircraft.layout.wake_pairs(j)):
                yield f"rotors[{j}].wake[{i}].slow", (slow, 1.0)
                yield f"rotors[{j}].wake[{i}].fast", (fast, 1.0)
        for name in aircraft.layout.section_names:
            for i, place in enumerate(range(aircraft.layout.size)[aircraft.layout.section(name)]):
                yield f"sections[{i}].{name}", (place, 1.0)

    def _odom_fields(self, _: Aircraft) -> Iterator[tuple[str, tuple[int, float]]]:
        """NED to ENU, FRD to FLU, as `StateMessages` has it."""
        for axis, index, sign in (("x", 1, 1.0), ("y", 0, 1.0), ("z", 2, -1.0)):
            yield f"pose.pose.position.{axis}", (index, sign)
        yield from self._vector("pose.pose.orientation", self._at("quaternion"), QUATERNION)
        for i, (axis, sign) in enumerate((("x", 1.0), ("y", -1.0), ("z", -1.0))):
            yield f"twist.twist.linear.{axis}", (S.VELOCITY + i, sign)
            yield f"twist.twist.angular.{axis}", (S.RATES + i, sign)


class _Write:
    """Numbers of a source to their indices in a template, and the stamp.

    Parameters
    ----------
    template : Template
    fields : dict of str to (int, float)
        Of every field its index in the source and its sign.
    """

    def __init__(self, template: Template, fields: dict[str, tuple[int, float]]) -> None:
        indices = template.indices(list(fields))
        order = np.argsort(indices)
        self._indices = indices[order]
        self._from = np.array([index for index, _ in fields.values()], dtype=np.int64)[order]
        signs = np.array([sign for _, sign in fields.values()])[order]
        self._signs = None if (signs == 1.0).all() else signs
        self._numbers, self._seconds, self._rest = (template.view(kind) for kind in (DOUBLE, INT, UINT))
        self._second, self._nanosecond = (int(template.indices([name])[0]) for name in STAMP)

    def __call__(self, source: Array, stamp: Any) -> None:
        values = source[self._from]
        if self._signs is not None:
            values *= self._signs
        self._numbers[self._indices] = values
        self._seconds[self._second], self._rest[self._nanosecond] = stamp.sec, stamp.nanosec


def states_of(aircraft: Aircraft, warn: Callable[[str], Any]) -> States:
    """Bytes by templates; by ROS's messages, with a warning, where the layout differs."""
    try:
        return StateBytes(aircraft)
    except LayoutError as error:
        warn(f"messages are serialised one by one, which is slow: {error}")
        return SerialisedStates(aircraft)


NUMBERS = ("sim_time", "real_time_factor")
COUNTS = ("missed_deadlines", "steps", "dropped_messages", "rejected_messages", "log_dropped")
WORKING = tuple(name for name, kind in WorkingState.get_fields_and_field_types().items() if kind == "double")


class StatusBytes:
    """Bytes of a status: a template for each of its texts, the lengths of which move all that follows.

    Parameters
    ----------
    warn : callable
        Takes the line that says why templates cannot be used, if so.
    """

    def __init__(self, warn: Callable[[str], Any]) -> None:
        self._warn = warn
        self._known: dict[Any, _StatusTemplate] = {}
        self._refused = False

    def data(self, status: SimulationStatus) -> bytes:
        """The bytes of a status."""
        if self._refused:
            return bytes(serialize_message(status))
        texts = status.fault, status.log, status.log_fault, status.model, *status.warnings, len(status.working_states)
        template = self._known.get(texts)
        if template is None:
            try:
                template = _StatusTemplate(status)
            except LayoutError as error:
                self._warn(f"messages are serialised one by one, which is slow: {error}")
                self._refused = True
                return bytes(serialize_message(status))
            if len(self._known) >= MAX_STATUS_TEMPLATES:
                self._known.clear()
            self._known[texts] = template
        return template.data(status)


class _StatusTemplate:
    """Template of a status with certain texts."""

    def __init__(self, status: SimulationStatus) -> None:
        rotors = range(len(status.working_states))
        doubles = [*NUMBERS, *(f"working_states[{j}].{name}" for j in rotors for name in WORKING)]
        letters = ["state", *(f"working_states[{j}].inflow_state" for j in rotors)]
        fields = {**STAMP, **dict.fromkeys(doubles, DOUBLE), **dict.fromkeys(COUNTS, COUNT)}
        self._template = template = Template(status, {**fields, **dict.fromkeys(letters, BYTE)})
        self._doubles, self._counts = template.indices(doubles), template.indices(COUNTS)
        self._letters, self._stamp = template.indices(letters), template.indices(list(STAMP))

    def data(self, status: SimulationStatus) -> bytes:
        template, states, stamp = self._template, status.working_states, status.header.stamp
        numbers = [status.sim_time, status.real_time_factor]
        for state in states:
            numbers += [getattr(state, name) for name in WORKING]
        template.view(DOUBLE)[self._doubles] = numbers
        template.view(COUNT)[self._counts] = [getattr(status, name) for name in COUNTS]
        template.view(BYTE)[self._letters] = [status.state, *(state.inflow_state for state in states)]
        template.view(INT)[self._stamp[0]], template.view(UINT)[self._stamp[1]] = stamp.sec, stamp.nanosec
        return template.data()
