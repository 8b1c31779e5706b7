"""Compile every kernel into its cache, so that no flight waits for the compiler: `python -m sbs_sim.warm_up`."""

import shutil

from numba import config

from sbs_sim.aircraft import Aircraft
from sbs_sim.analysis.linearize import linearize
from sbs_sim.analysis.trim import trim
from sbs_sim.model.kernel_cache import cache_folder
from sbs_sim.model.wind import Wind
from sbs_sim.simulation import Simulation, simulate, trimmed_state


def main() -> None:
    """Use every entry once, which compiles it, and delete the machine code of earlier sources."""
    if config.DISABLE_JIT:  # the interpreter would take half an hour, and keep nothing
        return
    aircraft = Aircraft.load("sbs")
    hover = trim(aircraft)
    simulate(aircraft, hover, hover.controls, duration=0.01, wind=Wind(turbulence_intensity=(1.0, 1.0, 1.0)))
    Simulation(aircraft, trimmed_state(aircraft, hover), hover.swashplate).snapshot()
    linearize(aircraft, point=hover, method="paper")
    trim(aircraft, method="two_loop")
    folder = cache_folder()
    for other in folder.parent.glob("kernels-*") if folder else ():
        if other != folder:
            shutil.rmtree(other, ignore_errors=True)


if __name__ == "__main__":
    main()
