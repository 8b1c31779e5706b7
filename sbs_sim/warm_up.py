"""Compile the kernels into their cache, so that no flight waits for the compiler: `python -m sbs_sim.warm_up`."""

import shutil

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


def main() -> None:
    """Do once what users do, which compiles what it takes, and delete the machine code of earlier sources.

    What only the trim by two loops, or a rotor alone, takes is compiled where that is asked for, within some seconds.
    """
    if config.DISABLE_JIT:  # the interpreter would take half an hour, and keep nothing
        return
    aircraft, wind = Aircraft.load("sbs"), Wind(turbulence_intensity=(1.0, 1.0, 1.0))
    hover = trim(aircraft)
    simulate(aircraft, hover, hover.controls, duration=0.01, wind=wind, outputs=[POWER_BALANCE])
    Simulation(aircraft, trimmed_state(aircraft, hover), hover.swashplate).snapshot()
    linearize(aircraft, point=hover, method="paper")
    simulate_batch([Case(aircraft, hover, wind=wind)] * lane_count(), 0.01, workers=1)
    driven = Aircraft.load("quadrotor")  # rotor speeds are states: other kernels
    hover = trim(driven)
    simulate(driven, hover, hover.controls, duration=0.01)
    folder = cache_folder()
    for other in folder.parent.glob("kernels-*") if folder else ():
        if other != folder:
            shutil.rmtree(other, ignore_errors=True)


if __name__ == "__main__":
    main()
