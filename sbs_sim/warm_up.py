"""Compile the kernels into their cache, so that no flight waits for the compiler: `python -m sbs_sim.warm_up`."""

import shutil
import subprocess
import sys

from numba import config

from sbs_sim.aircraft import Aircraft
from sbs_sim.analysis.batch import Case, simulate_batch
from sbs_sim.analysis.linearize import linearize
from sbs_sim.analysis.trim import trim
from sbs_sim.flight.power_balance import POWER_BALANCE
from sbs_sim.flight.simulate import simulate
from sbs_sim.flight.simulation import Simulation
from sbs_sim.flight.trimmed_state import trimmed_state
from sbs_sim.model.kernel_cache import cache_folder
from sbs_sim.model.packing import lane_count
from sbs_sim.model.wind import Wind

DRIVEN = "driven"  # argument of the second process


def main() -> int:
    """Do once what users do, which compiles what it takes, and delete the machine code of earlier sources.

    What only the trim by two loops, or a rotor alone, takes is compiled where that is asked for, within some seconds.
    Kernels of rotor speeds that are states are others; a second process compiles them, on a second core.

    Returns
    -------
    int
        0, or the code that the second process ended with.
    """
    if config.DISABLE_JIT:  # the interpreter would take half an hour, and keep nothing
        return 0
    if sys.argv[1:] == [DRIVEN]:
        _use_driven_rotors()
        return 0
    with subprocess.Popen([sys.executable, "-m", "sbs_sim.warm_up", DRIVEN]) as beside:
        _use_constant_speeds()
    folder = cache_folder()
    for other in folder.parent.glob("kernels-*") if folder else ():
        if other != folder:
            shutil.rmtree(other, ignore_errors=True)
    return beside.returncode


def _use_constant_speeds() -> None:
    aircraft, wind = Aircraft.load("sbs"), Wind(turbulence_intensity=(1.0, 1.0, 1.0))
    hover = trim(aircraft)
    simulate(aircraft, hover, hover.controls, duration=0.01, wind=wind, outputs=[POWER_BALANCE])
    simulation = Simulation(aircraft, trimmed_state(aircraft, hover), hover.swashplate)
    simulation.snapshot()
    simulation.set_wind(Wind(turbulence_intensity=(1.0, 1.0, 1.0), turbulence_extent="field"))  # a flight would stand
    simulation.snapshot()
    simulation.advance()
    linearize(aircraft, point=hover, method="paper")
    simulate_batch([Case(aircraft, hover, wind=wind)] * lane_count(), 0.01, workers=1)


def _use_driven_rotors() -> None:
    driven = Aircraft.load("quadrotor")
    hover = trim(driven)
    simulate(driven, hover, hover.controls, duration=0.01)


if __name__ == "__main__":
    sys.exit(main())
