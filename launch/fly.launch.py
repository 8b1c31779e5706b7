"""Fly: a simulator, frames for viewers, and on request the hover hold and RViz.

ros2 launch sbs_sim fly.launch.py aircraft:=sbs hover_hold:=true rviz:=true; --show-args lists the arguments.
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import FindPackageShare

PACKAGE = "sbs_sim"
# Each with its default and what it is.
TEXTS = {
    "aircraft": ("sbs", "name in config/aircraft, or path of a file"),
    "record": ("", "log: a file, a folder, empty for a name of its own in bags/, or off"),
    "namespace": ("", "of all nodes"),
}
NUMBERS = {
    "airspeed": ("0.0", "at the start [m/s]"),
    "altitude": ("0.0", "at the start, above the origin [m]"),
    "real_time_factor": ("1.0", "simulation time over elapsed time; 0 is as fast as possible"),
}
SWITCHES = {
    "frames": ("true", "publish tf, robot_description and joint_states"),
    "hover_hold": ("false", "hold position and heading"),
    "rviz": ("false", "start RViz with config/layouts/sbs_sim.rviz"),
}


def generate_launch_description() -> LaunchDescription:
    """Arguments and nodes."""
    arguments = [
        DeclareLaunchArgument(name, default_value=default, description=text)
        for name, (default, text) in (TEXTS | NUMBERS).items()
    ]
    arguments += [
        DeclareLaunchArgument(name, default_value=default, description=text, choices=["true", "false"])
        for name, (default, text) in SWITCHES.items()
    ]
    aircraft = {"aircraft": ParameterValue(LaunchConfiguration("aircraft"), value_type=str)}
    flight = aircraft | {"record": ParameterValue(LaunchConfiguration("record"), value_type=str)}
    # as numbers: airspeed:=15 would be an integer, which no parameter of a flight is
    flight |= {name: ParameterValue(LaunchConfiguration(name), value_type=float) for name in NUMBERS}
    layout = PathJoinSubstitution([FindPackageShare(PACKAGE), "config", "layouts", "sbs_sim.rviz"])
    common = {"namespace": LaunchConfiguration("namespace"), "output": "screen"}
    return LaunchDescription([
        *arguments,
        # without a name, which would be that of all nodes in its process
        Node(package=PACKAGE, executable="simulator", parameters=[flight], **common),
        *(
            Node(
                package=PACKAGE, executable=name, parameters=[aircraft],
                condition=IfCondition(LaunchConfiguration(name)), **common,
            )
            for name in ("frames", "hover_hold")
        ),
        Node(
            package="rviz2", executable="rviz2", arguments=["-d", layout],
            condition=IfCondition(LaunchConfiguration("rviz")), **common,
        ),
    ])  # fmt: skip
