"""An aircraft as robotics describes machines: links that joints hold together, and a URDF of them.

Axes are those of REP 103: base_link is FLU (x forward, y left, z up) with its origin in the c.g., a hub has its z axis
along the shaft, a blade its x axis along the span. Joints have the senses of the model: azimuth with the rotation, flap
up, lag against the motion, pitch with the leading edge up.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any
from xml.etree import ElementTree as Xml

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sbs_sim.aircraft import Aircraft
from sbs_sim.aircraft.description import Rotor
from sbs_sim.content import ByContent
from sbs_sim.model.frames import hub_axes

Array = NDArray[np.float64]

BASE = "base_link"
BODY = "body"
IMU, RANGE = "imu_link", "range_link"  # frames of sensors
FIXED, CONTINUOUS, REVOLUTE = "fixed", "continuous", "revolute"  # kinds of joints in URDF
FLU = np.diag([1.0, -1.0, -1.0])  # components in FLU of those in FRD, and back
HALF_TURN = math.pi / 2  # limit of hinges [rad]: none of the model's blades gets there
THICKNESS = 0.12  # of a drawn blade, over its chord
BLADE_COLOUR, DISC_COLOUR, BODY_COLOUR = "0.15 0.15 0.15 1", "0.4 0.6 0.9 0.2", "0.75 0.75 0.75 1"


@dataclass(frozen=True, eq=False)
class Joint(ByContent):
    """What holds a link on another.

    Attributes
    ----------
    name : str
    kind : str
        "fixed", "continuous" or "revolute".
    parent, child : str
        Links, which are frames, too.
    place : ndarray, shape (3,)
        Origin of the child, in axes of the parent [m].
    axes : ndarray, shape (3, 3)
        Axes of the child at a joint angle of zero, as columns in axes of the parent.
    axis : ndarray, shape (3,)
        Unit vector about which the child turns, in its axes; zero if it does not.
    """

    name: str
    kind: str
    parent: str
    child: str
    place: Array
    axes: Array
    axis: Array

    def turned(self, angle: float) -> Array:
        """Axes of the child at a joint angle [rad], as columns in axes of the parent, shape (3, 3)."""
        x, y, z = self.axis
        cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        # Rodrigues' formula; without an axis it is one
        return np.asarray(self.axes @ (np.eye(3) + math.sin(angle) * cross + (1.0 - math.cos(angle)) * cross @ cross))


def joints(aircraft: Aircraft) -> list[Joint]:
    """Joints from the body outwards: of a rotor its hub and azimuth, then lag, flap and pitch of each blade."""
    found = [_fixed("body", BASE, BODY, np.zeros(3), np.eye(3))]
    for rotor in aircraft.rotors:
        found += _rotor_joints(rotor)
    return found


def sensor_joints(imu_position: ArrayLike = (0.0, 0.0, 0.0)) -> list[Joint]:
    """What holds the frames of sensors: the IMU, parallel to base_link, and the beam of the range sensor.

    Parameters
    ----------
    imu_position : array_like, shape (3,)
        Place of the IMU against the c.g.: forward, right, down [m].
    """
    down = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])  # x down, as `sensor_msgs/Range` has its beam
    return [
        _fixed("imu", BASE, IMU, FLU @ np.asarray(imu_position), np.eye(3)),
        _fixed("range", BASE, RANGE, np.zeros(3), down),
    ]


def joint_angles(
    rotor: Rotor, azimuth: float, flap: Sequence[float], lag: Sequence[float], swashplate: Array
) -> list[float]:
    """Angles of the joints of a rotor that turn, in the order of `joints` [rad].

    Parameters
    ----------
    rotor : Rotor
    azimuth : float
        Of the first blade [rad].
    flap, lag : sequence of float
        Of each blade [rad].
    swashplate : ndarray, shape (3,)
        Collective, lateral and longitudinal cyclic of the swashplate [rad]; zeros if it is not known.
    """
    found, (collective, lateral, longitudinal) = [azimuth], swashplate
    for k in range(rotor.blades):
        at = azimuth + 2.0 * math.pi / rotor.blades * k + rotor.swashplate_phase
        # theory.md eq. (4.8), at the hinge
        pitch = collective - rotor.rotation * lateral * math.cos(at) - longitudinal * math.sin(at)
        pitch -= rotor.pitch_flap_coupling * flap[k] + rotor.pitch_lag_coupling * lag[k]
        found += [lag[k], flap[k], float(pitch)]
    return found


def urdf(aircraft: Aircraft, more: Sequence[Joint] = ()) -> str:
    """URDF of an aircraft: what `joints` has and more, with a body, discs and blades to look at.

    Mass and inertia of the whole aircraft, its blades included, are those of the link "body": base_link has none, since
    some readers refuse a root that has. The shape of the body is a box around contact points, with rods to the hubs.
    """
    robot = Xml.Element("robot", name=aircraft.name)
    shown = {BODY: [_inertial(aircraft), _hull(aircraft)]}
    for rotor in aircraft.rotors:
        shown[BODY] += _boom(rotor)
        shown[f"{rotor.name}_hub"] = [_disc(rotor)]
        shown |= {f"{rotor.name}_blade_{k}": [_blade(rotor)] for k in range(1, rotor.blades + 1)}
    every = [*joints(aircraft), *more]
    for name in (BASE, *(joint.child for joint in every)):
        Xml.SubElement(robot, "link", name=name).extend(shown.get(name, ()))
    robot.extend(_joint_element(joint) for joint in every)
    Xml.indent(robot)
    return '<?xml version="1.0"?>\n' + Xml.tostring(robot, encoding="unicode") + "\n"


# ------------------------------------------------------------------------------------------------------- joints


def _fixed(name: str, parent: str, child: str, place: Array, axes: Array) -> Joint:
    return Joint(name, FIXED, parent, child, place, axes, np.zeros(3))


def _rotor_joints(rotor: Rotor) -> list[Joint]:
    name, sense = rotor.name, float(rotor.rotation)
    hub, turning, still = f"{name}_hub", f"{name}_rotor", np.zeros(3)
    axes = FLU @ hub_axes(rotor.shaft_direction) @ FLU
    found = [
        _fixed(hub, BASE, hub, FLU @ np.asarray(rotor.hub), axes),
        Joint(f"{name}_azimuth", CONTINUOUS, hub, turning, still, np.eye(3), np.array([0.0, 0.0, sense])),
    ]
    lag_hinge = rotor.hinge_offset - rotor.flap_hinge_offset
    for k in range(rotor.blades):
        angle = math.pi + sense * 2.0 * math.pi / rotor.blades * k  # azimuth 0 points aft
        cosine, sine = math.cos(angle), math.sin(angle)
        outward = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
        blade = f"{name}_blade_{k + 1}"
        chain = (
            ("lag", turning, f"{blade}_lag", lag_hinge * outward[:, 0], outward, (0.0, 0.0, -sense)),
            ("flap", f"{blade}_lag", f"{blade}_flap", (rotor.flap_hinge_offset, 0.0, 0.0), np.eye(3), (0.0, -1.0, 0.0)),
            ("pitch", f"{blade}_flap", blade, still, np.eye(3), (sense, 0.0, 0.0)),
        )
        found += [
            Joint(f"{blade}_{part}", REVOLUTE, parent, child, np.asarray(place), turned, np.array(axis))
            for part, parent, child, place, turned, axis in chain
        ]
    return found


# --------------------------------------------------------------------------------------------------------- URDF


def _text(values: Any) -> str:
    return " ".join(f"{value + 0.0:.12g}" for value in values)


def _origin(place: Any, axes: Array) -> Xml.Element:
    """Place, and the turns about the fixed axes x, y, z that make the axes of the child."""
    across = math.hypot(axes[0, 0], axes[1, 0])
    pitch = math.atan2(-axes[2, 0], across)
    if across > 1e-9:
        roll, yaw = math.atan2(axes[2, 1], axes[2, 2]), math.atan2(axes[1, 0], axes[0, 0])
    else:  # straight up or down, roll and yaw are one turn
        roll, yaw = 0.0, math.atan2(-axes[0, 1], axes[1, 1])
    return Xml.Element("origin", xyz=_text(place), rpy=_text((roll, pitch, yaw)))


def _joint_element(joint: Joint) -> Xml.Element:
    element = Xml.Element("joint", name=joint.name, type=joint.kind)
    element.append(_origin(joint.place, joint.axes))
    Xml.SubElement(element, "parent", link=joint.parent)
    Xml.SubElement(element, "child", link=joint.child)
    if joint.kind != FIXED:
        Xml.SubElement(element, "axis", xyz=_text(joint.axis))
    if joint.kind == REVOLUTE:
        limit = Xml.SubElement(element, "limit", effort="0", velocity="0")
        limit.set("lower", f"{-HALF_TURN:.9g}")
        limit.set("upper", f"{HALF_TURN:.9g}")
    return element


def _inertial(aircraft: Aircraft) -> Xml.Element:
    element = Xml.Element("inertial")
    Xml.SubElement(element, "mass", value=f"{aircraft.body.mass:.12g}")
    matrix = FLU @ np.asarray(aircraft.body.inertia) @ FLU
    names = {"ixx": (0, 0), "ixy": (0, 1), "ixz": (0, 2), "iyy": (1, 1), "iyz": (1, 2), "izz": (2, 2)}
    Xml.SubElement(element, "inertia", {name: f"{matrix[at] + 0.0:.12g}" for name, at in names.items()})
    return element


def _visual(shape: Xml.Element, place: Any, colour: str, axes: Array | None = None) -> Xml.Element:
    element = Xml.Element("visual")
    element.append(_origin(place, np.eye(3) if axes is None else axes))
    Xml.SubElement(element, "geometry").append(shape)
    material = Xml.SubElement(element, "material", name=f"colour {colour}")
    Xml.SubElement(material, "color", rgba=colour)
    return element


def _hull(aircraft: Aircraft) -> Xml.Element:
    """Box around the c.g. and the contact points."""
    points = np.array([np.zeros(3), *(np.asarray(point.position) for point in aircraft.contact_points)]) @ FLU
    low, high = points.min(axis=0), points.max(axis=0)
    least = 0.2 * max(rotor.radius for rotor in aircraft.rotors)
    return _visual(Xml.Element("box", size=_text(np.maximum(high - low, least))), 0.5 * (low + high), BODY_COLOUR)


def _boom(rotor: Rotor) -> list[Xml.Element]:
    """Rod from the c.g. to a hub."""
    hub = np.asarray(rotor.hub)
    length = float(np.linalg.norm(hub))
    if length == 0.0:
        return []
    shape = Xml.Element("cylinder", radius=_text([0.02 * rotor.radius]), length=_text([length]))
    return [_visual(shape, 0.5 * FLU @ hub, BODY_COLOUR, FLU @ hub_axes(hub) @ FLU)]


def _disc(rotor: Rotor) -> Xml.Element:
    shape = Xml.Element("cylinder", radius=_text([rotor.radius]), length=_text([0.004 * rotor.radius]))
    return _visual(shape, (0.0, 0.0, 0.0), DISC_COLOUR)


def _blade(rotor: Rotor) -> Xml.Element:
    chord = 0.5 * (rotor.chord_at(0.0) + rotor.chord_at(1.0))
    begin, end = rotor.root_cutout, rotor.blade_length
    shape = Xml.Element("box", size=_text((end - begin, chord, THICKNESS * chord)))
    behind = 0.25 * chord * rotor.rotation  # the axis of the blade is the quarter chord
    return _visual(shape, (0.5 * (begin + end), -behind, 0.0), BLADE_COLOUR)
