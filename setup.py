"""Build script of the ament_python package sbs_sim; colcon calls it."""

import shutil
import sys
from pathlib import Path
from xml.etree import ElementTree

from setuptools import find_packages, setup

PACKAGE = "sbs_sim"


def config_files():
    """List config/** as data_files entries that keep the sub-folders under share/sbs_sim."""
    entries = {}
    for path in sorted(Path("config").rglob("*")):
        # Editors leave hidden files and backups behind; those are not part of the package.
        if path.is_file() and not path.name.startswith(".") and not path.name.endswith("~"):
            entries.setdefault(f"share/{PACKAGE}/{path.parent.as_posix()}", []).append(path.as_posix())
    return sorted(entries.items())


# What the library and its commands import; the versions are those of Ubuntu 24.04, for which ROS 2 Jazzy is made. ROS
# itself cannot be named here: its packages are in package.xml.
REQUIREMENTS = [
    "jsonschema>=4.10",
    "matplotlib>=3.6",
    "mcap>=1.1",
    "mcap-ros2-support>=0.5",
    "numba>=0.58",
    "numpy>=1.26",
    "ruamel.yaml>=0.17.21",
    "scipy>=1.11",
    "tqdm>=4.66",
    "zstandard>=0.22",
]
# Each with what it is for, which `./run --help` tells.
EXECUTABLES = [
    "simulator = sbs_sim.nodes.executables:simulator",  # fly in real time
    "control_mixer = sbs_sim.nodes.executables:control_mixer",  # pilot controls to swashplates
    "analysis = sbs_sim.nodes.executables:analysis",  # trims, linear models and sweeps as services
    "hover_hold = sbs_sim.nodes.executables:hover_hold",  # hold position and heading
    "teleop = sbs_sim.nodes.executables:teleop",  # fly by the keyboard
    "joystick = sbs_sim.nodes.executables:joystick",  # fly by a gamepad or transmitter
    "replay = sbs_sim.nodes.executables:replay",  # publish, verify, repair or re-fly a log
    "cockpit = sbs_sim.nodes.executables:cockpit",  # fly in the browser
    "trim = sbs_sim.commands.trim:main",  # trim an aircraft
    "linearize = sbs_sim.commands.linearize:main",  # linear model of a steady flight, with its modes
    "sweep = sbs_sim.commands.sweep:main",  # trims and modes along one parameter
    "qualities = sbs_sim.commands.qualities:main",  # flying qualities over airspeed, with levels
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
    packages=find_packages(include=[PACKAGE, f"{PACKAGE}.*"]),
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{PACKAGE}"]),
        (f"share/{PACKAGE}", ["package.xml"]),
        *config_files(),
    ],
    install_requires=REQUIREMENTS,
    extras_require={
        "dask": ["distributed"],  # sweeps and batches on a cluster
        "control": ["control"],  # LinearModel.to_control
        "pandas": ["pandas"],  # to_pandas of a topic
    },
    zip_safe=False,
    options=own_folder(),
    entry_points={"console_scripts": ["sbs-sim = sbs_sim.commands.main:main"] if IS_WHEEL else EXECUTABLES},
)
