"""Build script of the ament_python package sbs_sim; colcon calls it."""

import shutil
import sys
from pathlib import Path
from xml.etree import ElementTree

from setuptools import find_packages, setup

PACKAGE = "sbs_sim"


def config_files():
    """Files of config/. Editors leave hidden files and backups behind; those are not part of the package."""
    paths = (path for path in sorted(Path("config").rglob("*")) if path.is_file())
    return [path for path in paths if not path.name.startswith(".") and not path.name.endswith("~")]


def ament_files():
    """Entries of data_files for an installation of ROS: config/ with its folders goes to share/sbs_sim."""
    entries = {
        "share/ament_index/resource_index/packages": [f"resource/{PACKAGE}"],
        f"share/{PACKAGE}": ["package.xml"],
        f"share/{PACKAGE}/launch": ["launch/fly.launch.py"],
    }
    for path in config_files():
        entries.setdefault(f"share/{PACKAGE}/{path.parent.as_posix()}", []).append(path.as_posix())
    return sorted(entries.items())


# What the library and its commands import; the versions are those of Ubuntu 24.04, for which ROS 2 Jazzy is made. ROS
# itself cannot be named here: its packages are in package.xml.
REQUIREMENTS = ["jsonschema>=4.10", "numba>=0.58", "numpy>=1.26", "ruamel.yaml>=0.17.21", "scipy>=1.11", "tqdm>=4.66"]
PLOTS = ["matplotlib>=3.6"]
LOGS = ["mcap>=1.1", "mcap-ros2-support>=0.5", "zstandard>=0.22"]
# What they are for says the table EXTRAS of sbs_sim/commands/main.py as well, where one of them is missing.
EXTRAS = {
    "plots": PLOTS,  # figures of every command
    "logs": LOGS,  # logs: `plot`, `identify`, `replay --verify`
    "ros-free": PLOTS + LOGS,  # all that works without ROS
    "dask": ["distributed"],  # sweeps and batches on a cluster
    "control": ["control"],  # LinearModel.to_control
    "foxglove": ["foxglove-sdk>=0.30"],  # a server for viewers; needs ROS
    "gym": ["gymnasium>=1.0"],  # sbs_sim.gym_env
    "pandas": ["pandas"],  # to_pandas of a topic
}
# Each with what it is for, which `./run --help` tells.
EXECUTABLES = [
    "simulator = sbs_sim.nodes.executables:simulator",  # fly in real time
    "control_mixer = sbs_sim.nodes.executables:control_mixer",  # pilot controls to swashplates
    "analysis = sbs_sim.nodes.executables:analysis",  # trims, linear models and sweeps as services
    "hover_hold = sbs_sim.nodes.executables:hover_hold",  # hold position and heading
    "excite = sbs_sim.nodes.executables:excite",  # chirps and multisines on the controls
    "frames = sbs_sim.nodes.executables:frames",  # tf, robot_description and joint states, for RViz and others
    "teleop = sbs_sim.nodes.executables:teleop",  # fly by the keyboard
    "joystick = sbs_sim.nodes.executables:joystick",  # fly by a gamepad or transmitter
    "replay = sbs_sim.nodes.executables:replay",  # publish, verify, repair or re-fly a log
    "cockpit = sbs_sim.nodes.executables:cockpit",  # fly in the browser
    "ardupilot = sbs_sim.nodes.executables:ardupilot",  # let ArduPilot fly
    "trim = sbs_sim.commands.trim:main",  # trim an aircraft
    "linearize = sbs_sim.commands.linearize:main",  # linear model of a steady flight, with its modes
    "sweep = sbs_sim.commands.sweep:main",  # trims and modes along one parameter
    "qualities = sbs_sim.commands.qualities:main",  # flying qualities over airspeed, with levels
    "identify = sbs_sim.commands.identify:main",  # frequency responses from a recorded flight
    "performance = sbs_sim.commands.performance:main",  # power, climb, ceiling and envelope in steady flight
    "stitch = sbs_sim.commands.stitch:main",  # one nonlinear model of many linear ones
    "design = sbs_sim.commands.design:main",  # a controller from hover to cruise, with margins and uncertainty
    "batch = sbs_sim.commands.batch:main",  # Monte Carlo: many flights through turbulence
    "reproduce = sbs_sim.commands.reproduce:main",  # the paper's results beside ours
    "validate = sbs_sim.commands.validate:main",  # published results of others beside ours
    "gusts = sbs_sim.commands.gusts:main",  # design the hover hold, and test it in turbulence and gusts
    "plot = sbs_sim.commands.plot:main",  # draw a log over time
    "airfoil = sbs_sim.commands.airfoil:main",  # airfoil data of other programs as a table
    "aircraft = sbs_sim.commands.aircraft:main",  # write an aircraft as a commented file
]
# colcon puts the executables where `ros2 run` finds them, in lib/sbs_sim. A wheel puts all into the PATH, where names
# such as `plot` belong to nobody: it brings one command for all of them.
IS_WHEEL = not {"bdist_wheel", "dist_info", "editable_wheel"}.isdisjoint(sys.argv)
# There is no share/ that all kinds of installation have in common, so a wheel has the configuration as a package.
CONFIG_PACKAGE = {f"{PACKAGE}.config": "config"} if IS_WHEEL and "editable_wheel" not in sys.argv else {}
# What is left of making a wheel must not lie where ./run would take it for what colcon has installed.
WHEEL_FOLDER = Path("build/wheel")


def own_folder():
    """Options that keep what pip has made in a folder of its own; none for colcon, which says where to."""
    if not IS_WHEEL and (sys.argv[1:2] != ["egg_info"] or "--egg-base" in sys.argv):
        return {}
    shutil.rmtree(WHEEL_FOLDER, ignore_errors=True)  # modules that are no more
    WHEEL_FOLDER.mkdir(parents=True)
    return {"egg_info": {"egg_base": str(WHEEL_FOLDER)}, "build": {"build_base": str(WHEEL_FOLDER)}}


setup(
    name=PACKAGE,
    version=ElementTree.parse("package.xml").findtext("version"),
    description="Flight simulator of a side-by-side helicopter on ROS 2",
    maintainer="sbs_sim maintainers",
    maintainer_email="sbs_sim@example.org",
    license="Apache-2.0",
    python_requires=">=3.10",
    # By name, not by exclusion: build/, install/ and .venv/ lie beside the package and hold packages too.
    packages=[*find_packages(include=[PACKAGE, f"{PACKAGE}.*"]), *CONFIG_PACKAGE],
    package_dir=CONFIG_PACKAGE,
    package_data={
        PACKAGE: ["py.typed"],
        **{name: [str(path.relative_to("config")) for path in config_files()] for name in CONFIG_PACKAGE},
    },
    data_files=[] if IS_WHEEL else ament_files(),
    install_requires=REQUIREMENTS,
    extras_require=EXTRAS,
    zip_safe=False,
    options=own_folder(),
    entry_points={"console_scripts": ["sbs-sim = sbs_sim.commands.main:main"] if IS_WHEEL else EXECUTABLES},
)
