"""URDF of aircraft, read as the format says, against the blade kinematics of theory.md sections 1 and 2."""

import math
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from sbs_sim import Aircraft
from sbs_sim.cockpit.geometry import blade_azimuths, blade_poses
from sbs_sim.output.robot import BASE, CONTINUOUS, FIXED, joint_angles, joints, sensor_joints, urdf

DATA = Path(__file__).resolve().parents[1] / "data"
AIRCRAFT = ("sbs", "uh60a_tm85890", "quadrotor", str(DATA / "tail_rotor.yaml"), str(DATA / "tandem.yaml"))
SBS = Aircraft.load("sbs")
FLU = np.diag([1.0, -1.0, -1.0])


def turn(axis, angle):
    """Rotation matrix about x, y or z."""
    cosine, sine = math.cos(angle), math.sin(angle)
    found, (i, j) = np.eye(3), ((1, 2), (2, 0), (0, 1))[axis]
    found[i, i] = found[j, j] = cosine
    found[i, j], found[j, i] = -sine, sine
    return found


def numbers(text):
    return np.array([float(word) for word in text.split()])


def link_poses(text, angles):
    """Place and axes of every link in base_link, from the URDF alone: rpy are turns about fixed x, y, z."""
    poses, waiting = {BASE: (np.zeros(3), np.eye(3))}, list(ElementTree.fromstring(text).iter("joint"))
    while waiting:
        joint = waiting.pop(0)
        parent = joint.find("parent").get("link")
        if parent not in poses:
            waiting.append(joint)
            continue
        roll, pitch, yaw = numbers(joint.find("origin").get("rpy"))
        axes = turn(2, yaw) @ turn(1, pitch) @ turn(0, roll)
        if joint.get("type") != FIXED:
            axis = numbers(joint.find("axis").get("xyz"))
            (which,) = np.flatnonzero(axis)
            axes = axes @ turn(int(which), axis[which] * angles[joint.get("name")])
        place, own = poses[parent]
        poses[joint.find("child").get("link")] = place + own @ numbers(joint.find("origin").get("xyz")), own @ axes
    return poses


def random_angles(aircraft, rng):
    """Angles of each rotor, as for `joint_angles`."""
    return [
        (rng.uniform(0.0, 2 * math.pi), rng.normal(0.0, 0.1, rotor.blades), rng.normal(0.0, 0.1, rotor.blades))
        for rotor in aircraft.rotors
    ]


@pytest.mark.parametrize("name", AIRCRAFT)
def test_blades_are_where_the_theory_has_them(name):
    aircraft, rng = Aircraft.load(name), np.random.default_rng(4)
    given = random_angles(aircraft, rng)
    names = [joint.name for joint in joints(aircraft) if joint.kind != FIXED]
    values = [
        angle
        for rotor, one in zip(aircraft.rotors, given, strict=True)
        for angle in joint_angles(rotor, *one, np.zeros(3))
    ]
    poses = link_poses(urdf(aircraft), dict(zip(names, values, strict=True)))
    for rotor, (azimuth, flap, lag) in zip(aircraft.rotors, given, strict=True):
        hinges, axes = blade_poses(rotor, blade_azimuths(rotor, azimuth), flap, lag)
        for k in range(rotor.blades):
            place, own = poses[f"{rotor.name}_blade_{k + 1}_flap"]
            np.testing.assert_allclose(place, FLU @ hinges[k], atol=1e-9 * rotor.radius)
            np.testing.assert_allclose(own[:, 0], FLU @ axes[k][:, 0], atol=1e-9)  # along the span
            np.testing.assert_allclose(own[:, 2], FLU @ axes[k][:, 2], atol=1e-9)  # normal to the blade
            # the blade itself has the same origin and span: pitch turns it about that
            pitched, turned = poses[f"{rotor.name}_blade_{k + 1}"]
            np.testing.assert_allclose(pitched, place, atol=1e-12)
            np.testing.assert_allclose(turned[:, 0], own[:, 0], atol=1e-12)


def test_joints_have_the_frames_of_the_urdf():
    aircraft = Aircraft.load("sbs")
    angle = 0.3
    poses = link_poses(urdf(aircraft), dict.fromkeys((joint.name for joint in joints(aircraft)), angle))
    found = {BASE: (np.zeros(3), np.eye(3))}
    for joint in joints(aircraft):
        place, own = found[joint.parent]
        found[joint.child] = place + own @ joint.place, own @ joint.turned(0.0 if joint.kind == FIXED else angle)
    assert found.keys() == poses.keys()
    for name, (place, own) in found.items():
        np.testing.assert_allclose(place, poses[name][0], atol=1e-10)
        np.testing.assert_allclose(own, poses[name][1], atol=1e-10)


@pytest.mark.parametrize("name", ["sbs", str(DATA / "tail_rotor.yaml")])
def test_positive_pitch_lifts_leading_edges(name):
    aircraft = Aircraft.load(name)
    for rotor in aircraft.rotors:
        still = np.zeros(rotor.blades)
        angles = joint_angles(rotor, 1.0, still, still, np.array([0.1, 0.0, 0.0]))
        assert angles[3::3] == [pytest.approx(0.1)] * rotor.blades
        names = [joint.name for joint in joints(aircraft) if joint.kind != FIXED and joint.name.startswith(rotor.name)]
        others = {joint.name: 0.0 for joint in joints(aircraft)}
        poses = link_poses(urdf(aircraft), others | dict(zip(names, angles, strict=True)))
        _, axes = blade_poses(rotor, blade_azimuths(rotor, 1.0), still, still)
        for k in range(rotor.blades):
            ahead = FLU @ axes[k][:, 1] * rotor.rotation  # G t times G: where the blade goes
            own = poses[f"{rotor.name}_blade_{k + 1}"][1]
            leading = own[:, 1] * rotor.rotation
            assert leading @ ahead == pytest.approx(math.cos(0.1))
            assert leading @ (FLU @ axes[k][:, 2]) == pytest.approx(math.sin(0.1))


def test_cyclic_and_couplings_turn_blades_as_the_theory_says():
    """Eq. (4.8) at azimuths where each of its parts stands alone."""
    rotor = Aircraft.load("sbs").with_values({"rotors.pitch_flap_coupling": 0.5}).rotors[0]
    still = np.zeros(3)
    beneath, aside = -rotor.swashplate_phase, math.pi / 2 - rotor.swashplate_phase
    assert joint_angles(rotor, beneath, still, still, np.array([0.0, 0.1, 0.0]))[3] == pytest.approx(
        -0.1 * rotor.rotation
    )
    assert joint_angles(rotor, beneath, still, still, np.array([0.0, 0.0, 0.1]))[3] == pytest.approx(0.0, abs=1e-15)
    assert joint_angles(rotor, aside, still, still, np.array([0.0, 0.0, 0.1]))[3] == pytest.approx(-0.1)
    flapped = joint_angles(rotor, 0.0, still + 0.2, still, still)
    assert flapped[3] == pytest.approx(-0.1)


@pytest.mark.parametrize("name", AIRCRAFT)
def test_the_urdf_is_one_tree_with_the_mass_of_the_aircraft(name):
    aircraft = Aircraft.load(name)
    robot = ElementTree.fromstring(urdf(aircraft))
    links = [link.get("name") for link in robot.iter("link")]
    children = [joint.find("child").get("link") for joint in robot.iter("joint")]
    assert sorted(links) == sorted([BASE, *children])
    assert len(set(links)) == len(links)
    assert [float(mass.get("value")) for mass in robot.iter("mass")] == [pytest.approx(aircraft.body.mass)]
    (inertia,) = robot.iter("inertia")
    assert float(inertia.get("ixz")) == pytest.approx(-aircraft.body.inertia[0][2], abs=1e-12)  # z is up
    assert float(inertia.get("iyz")) == pytest.approx(aircraft.body.inertia[1][2], abs=1e-12)  # y and z are turned
    turning = [joint for joint in robot.iter("joint") if joint.get("type") == CONTINUOUS]
    assert len(turning) == len(aircraft.rotors)


def test_frames_of_sensors():
    """The beam of a range sensor is the x axis of its frame (sensor_msgs/Range), and goes down."""
    poses = link_poses(urdf(SBS, sensor_joints([0.3, 0.1, 0.2])), {joint.name: 0.0 for joint in joints(SBS)})
    place, axes = poses["imu_link"]
    np.testing.assert_allclose(place, [0.3, -0.1, -0.2], atol=1e-12)
    np.testing.assert_allclose(axes, np.eye(3), atol=1e-12)
    place, axes = poses["range_link"]
    np.testing.assert_allclose(place, np.zeros(3), atol=1e-12)
    np.testing.assert_allclose(axes[:, 0], [0.0, 0.0, -1.0], atol=1e-9)  # angles have twelve digits in the text
    assert np.linalg.det(axes) == pytest.approx(1.0)


def test_a_shaft_that_points_ahead_has_finite_angles():
    aircraft = Aircraft.load("sbs").with_values({"rotors.shaft_direction": [1.0, 0.0, 0.0]})
    _, axes = link_poses(urdf(aircraft), {joint.name: 0.0 for joint in joints(aircraft)})["MR1_hub"]
    np.testing.assert_allclose(axes[:, 2], [1.0, 0.0, 0.0], atol=1e-9)


def test_names_are_text_and_never_markup():
    name = "<robot name='x'/>&"
    aircraft = Aircraft.load("sbs").with_values({"name": name})
    assert ElementTree.fromstring(urdf(aircraft)).get("name") == name
