"""Flies one peer for peers.py in an interpreter that needs neither this package nor ROS: `peer_flight.py jsbsim`.

The first line of its output is JSON: `{"version": ..., "step": ...}` with the step in seconds, or `{"missing": ...}`.
Then every number of steps on its input is flown and answered with the time of the processor [s].
"""

import json
import os
import sys
import time
from collections.abc import Callable
from importlib.metadata import version

HOVER_AT = 60.0  # s, when the script of JSBSim's helicopter has left the ground and holds its place
LOWEST_HEIGHT = 20.0  # ft
ROTORPY_STEP = 0.01  # s, that of rotorpy.environments.Environment
CLIMB_SPEED = 1.01  # of the rotors, over that of hover
Flown = tuple[float, Callable[[int], None]]  # step [s], what flies a number of steps


def main() -> None:
    """Serve until the input ends."""
    name = sys.argv[1]
    answers = os.fdopen(os.dup(1), "w", buffering=1)
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # what the peer says of its flight
    try:
        step, fly = PEERS[name]()
    except ImportError as error:
        print(json.dumps({"missing": str(error)}), file=answers)
        return
    print(json.dumps({"version": version(name), "step": step}), file=answers)
    for line in sys.stdin:
        start = time.process_time()
        fly(int(line))
        print(time.process_time() - start, file=answers)


def jsbsim_flight() -> Flown:
    """The AH-1S of JSBSim's package, brought into hover by the flight test that comes with it, at that one's step."""
    import jsbsim

    model = jsbsim.FGFDMExec(None)
    model.set_debug_level(0)
    model.load_script("scripts/ah1s_flight_test.xml")
    model.run_ic()
    while model.get_sim_time() < HOVER_AT:
        model.run()
    model["simulation/test-variant"] = 0  # later events would change the flight

    def fly(steps: int) -> None:
        for _ in range(steps):
            model.run()
        if not model["position/h-agl-ft"] > LOWEST_HEIGHT:
            raise RuntimeError(f"JSBSim's helicopter is no longer in the air: {model['position/h-agl-ft']} ft")

    return model.get_delta_t(), fly


def rotorpy_flight() -> Flown:
    """The Hummingbird of RotorPy in a climb: in exact hover its adaptive integration takes five times as many steps."""
    import numpy as np
    from rotorpy.vehicles.hummingbird_params import quad_params
    from rotorpy.vehicles.multirotor import Multirotor

    vehicle = Multirotor(quad_params)
    hover = np.full(4, np.sqrt(vehicle.mass * vehicle.g / 4 / vehicle.k_eta))
    at_rest = {name: np.zeros(3) for name in ("x", "v", "w", "wind")}
    state = {**at_rest, "q": np.array([0.0, 0.0, 0.0, 1.0]), "rotor_speeds": hover}
    command = {"cmd_motor_speeds": CLIMB_SPEED * hover}

    def fly(steps: int) -> None:
        nonlocal state
        for _ in range(steps):
            state = vehicle.step(state, command, ROTORPY_STEP)
        if not 0 < state["v"][2] < 100:
            raise RuntimeError(f"RotorPy's quadrotor does not climb: {state['v']} m/s")

    return ROTORPY_STEP, fly


PEERS: dict[str, Callable[[], Flown]] = {"jsbsim": jsbsim_flight, "rotorpy": rotorpy_flight}

if __name__ == "__main__":
    main()
