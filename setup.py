"""Build script of the ament_python package sbs_sim; colcon calls it."""

from pathlib import Path

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


setup(
    name=PACKAGE,
    version="0.1.0",
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
    install_requires=["setuptools"],
    extras_require={"dask": ["distributed"]},  # sweeps and batches on a cluster
    zip_safe=False,
    entry_points={
        "console_scripts": [
            "simulator = sbs_sim.nodes.executables:simulator",
            "control_mixer = sbs_sim.nodes.executables:control_mixer",
            "analysis = sbs_sim.nodes.executables:analysis",
            "hover_hold = sbs_sim.nodes.executables:hover_hold",
            "teleop = sbs_sim.nodes.executables:teleop",
            "joystick = sbs_sim.nodes.executables:joystick",
            "replay = sbs_sim.nodes.executables:replay",
            "cockpit = sbs_sim.nodes.executables:cockpit",
            "trim = sbs_sim.commands.trim:main",
            "linearize = sbs_sim.commands.linearize:main",
            "sweep = sbs_sim.commands.sweep:main",
            "batch = sbs_sim.commands.batch:main",
            "reproduce = sbs_sim.commands.reproduce:main",
            "gusts = sbs_sim.commands.gusts:main",
            "plot = sbs_sim.commands.plot:main",
        ],
    },
)
