"""Errors of steps in a field of turbulence and in turbulence at a point: `./run python benchmarks/field_steps.py`.

In a field stages of a step share samples of the air (theory.md section 7.8). One second from a trim at 10 m/s with held
controls, against the finest step.
"""

import math
from typing import Any

import numpy as np

from sbs_sim import Aircraft, Simulation, trim
from sbs_sim.flight.trim_point import TrimPoint
from sbs_sim.flight.trimmed_state import trimmed_state
from sbs_sim.model import state as S
from sbs_sim.model.wind import Wind

AIRSPEED, TICKS = 10.0, 100  # m/s; of 10 ms
GUST = {"turbulence_intensity": (1.0, 1.0, 1.0), "turbulence_airspeed": AIRSPEED}
STEPS = {"etd": (14.4, 7.2, 3.6, 1.8, 0.45), "rk4": (7.2, 3.6, 1.8, 0.45)}  # deg of azimuth


def main() -> None:
    """Print a line for each extent, method and step."""
    aircraft = Aircraft.load("sbs")
    point = trim(aircraft, airspeed=AIRSPEED)
    for extent in ("field", "point"):
        wind = Wind(**GUST, turbulence_extent=extent)  # type: ignore[arg-type]
        for method, steps in STEPS.items():
            flights = [flown(aircraft, point, wind, method, degrees) for degrees in steps]
            reference = flights[-1].state
            for flight in flights[:-1]:
                error = np.abs(flight.state - reference)
                velocity, rates = error[S.VELOCITY : S.RATES].max(), error[S.RATES : S.BODY_SIZE].max()
                step = f"{extent:6} {method:4} {1e3 * flight.step_size:.3f} ms"
                print(f"{step}  {velocity:.1e} m/s  {rates:.1e} rad/s")


def flown(aircraft: Aircraft, point: TrimPoint, wind: Wind, method: str, degrees: float) -> Any:
    """Simulation at its end."""
    options: dict[str, Any] = {"method": method, "azimuth_step": math.radians(degrees)}
    flight = Simulation(aircraft, trimmed_state(aircraft, point), point.swashplate, wind=wind, **options)
    flight.fly(np.repeat(point.swashplate[np.newaxis], TICKS, axis=0), TICKS, TICKS, loaded=False)
    return flight


if __name__ == "__main__":
    main()
