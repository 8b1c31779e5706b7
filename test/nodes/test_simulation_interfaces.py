"""Services of simulation_interfaces: the motion of an entity in axes of the world, and a simulator without the package.

The services themselves need that package: tools/check_simulation_interfaces.py calls each of them.
"""

import importlib.util
import math
import subprocess
import sys

import numpy as np
import pytest

rclpy = pytest.importorskip("rclpy")

from geometry_msgs.msg import Pose, Quaternion, Twist, Vector3  # noqa: E402
from ros_harness import DOMAINS, EXECUTABLES, environment  # noqa: E402
from test_sensors import instant  # noqa: E402

from sbs_sim import Aircraft  # noqa: E402
from sbs_sim.errors import SimulationError  # noqa: E402
from sbs_sim.model.frames import rotation_matrix  # noqa: E402
from sbs_sim.nodes.entity_state import motion_of, moved  # noqa: E402


@pytest.fixture(scope="module")
def sbs():
    return Aircraft.load("sbs")


def xyz(message):
    return [message.x, message.y, message.z]


def rotated(quaternion, vector):
    return rotation_matrix([quaternion.w, quaternion.x, quaternion.y, quaternion.z]) @ vector


@pytest.mark.skipif(importlib.util.find_spec("simulation_interfaces") is not None, reason="the package is installed")
def test_without_the_package_the_simulator_says_so_in_one_line(tmp_path):
    command = [sys.executable, str(EXECUTABLES / "simulator"), "--ros-args", "-p", "record:=off"]
    command += ["-p", "simulation_interfaces:=true"]
    own = environment(next(DOMAINS), tmp_path)
    done = subprocess.run(command, env=own, cwd=tmp_path, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 1
    said = "parameter simulation_interfaces = true: allowed where the package of that name is installed"
    assert said in done.stderr.splitlines()[-1]


def test_the_motion_of_an_entity_is_in_world_axes(sbs):
    """Heading east and climbing, turning right: it flies along x, and turns about -z."""
    now = instant(sbs, position=(1.0, 2.0, -3.0), euler=(math.pi / 2, 0.0, 0.0), rates=(0.0, 0.0, 0.4))
    now.state[7:10] = 5.0, 0.0, -1.0
    now.acceleration[:] = 0.0, 2.0, 0.0  # to the right, south
    pose, twist, acceleration = motion_of(now)
    assert xyz(pose.position) == [2.0, 1.0, 3.0]
    np.testing.assert_allclose(rotated(pose.orientation, [1.0, 0.0, 0.0]), [1.0, 0.0, 0.0], atol=1e-14)
    np.testing.assert_allclose(xyz(twist.linear), [5.0, 0.0, 1.0], atol=1e-14)
    np.testing.assert_allclose(xyz(twist.angular), [0.0, 0.0, -0.4], atol=1e-14)
    np.testing.assert_allclose(xyz(acceleration.linear), [0.0, -2.0, 0.0], atol=1e-14)


def test_what_is_told_of_a_motion_makes_the_same_motion(sbs):
    now = instant(sbs, position=(1.0, 2.0, -3.0), euler=(0.7, 0.2, -0.3), rates=(0.1, 0.2, 0.4))
    now.state[7:10] = 5.0, 0.5, -1.0
    pose, twist, _ = motion_of(now)
    np.testing.assert_allclose(moved(instant(sbs).state[:13], pose, twist), now.state[:13], atol=1e-14)
    east = moved(now.state[:13], pose=Pose(orientation=Quaternion(w=1.0)))  # the body's x-axis along the world's
    np.testing.assert_allclose(rotation_matrix(east[3:7])[:, 0], [0.0, 1.0, 0.0], atol=1e-14)
    kept = rotation_matrix(east[3:7]) @ east[7:10], rotation_matrix(now.state[3:7]) @ now.state[7:10]
    np.testing.assert_allclose(*kept, atol=1e-14)
    still = moved(now.state[:13], twist=Twist(linear=Vector3(x=1.0)))
    np.testing.assert_allclose(rotation_matrix(still[3:7]) @ still[7:10], [0.0, 1.0, 0.0], atol=1e-14)


@pytest.mark.parametrize("w", [0.0, math.nan, 5.0])
def test_an_orientation_that_is_none_is_refused(sbs, w):
    with pytest.raises(SimulationError, match=r"norm of pose.orientation = .*: allowed are 0.5 to 2"):
        moved(instant(sbs).state[:13], pose=Pose(orientation=Quaternion(w=w)))
