"""Call every service and the action of simulation_interfaces that the simulator offers; print a table of the answers.

    ./run python tools/check_simulation_interfaces.py [CHECKOUT]

Builds the package from a checkout of github.com/ros-simulation/simulation_interfaces into .cache, which takes minutes
the first time; without one it must be installed. Then a real simulator is started and asked, over DDS on this machine.
The exit code is 1 if a result code is not the one that the interface definitions ask for, or if the log of that flight
does not repeat it.
"""

import argparse
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
BUILT = ROOT / ".cache" / "simulation_interfaces"
PACKAGE = "simulation_interfaces"
READY = "SBS_SIM_INTERFACES_READY"  # set in the environment of the second start
WIDTH = 60  # characters of a message in the table
CANCELLED = 1_000_000  # steps of a goal that is cancelled after the first ones


def build(checkout: Path) -> Path:
    """Build the package; its prefix."""
    prefix = BUILT / "install" / PACKAGE
    if not (prefix / "share" / PACKAGE / "package.xml").is_file():
        python = f"-DPython3_EXECUTABLE={sys.executable}"
        command = [sys.executable, "-m", "colcon", "--log-base", str(BUILT / "log"), "build"]
        command += ["--base-paths", str(checkout), "--packages-select", PACKAGE]
        command += ["--build-base", str(BUILT / "build"), "--install-base", str(BUILT / "install")]
        subprocess.run([*command, "--cmake-args", python, "-DBUILD_TESTING=OFF"], check=True, cwd=ROOT)
    return prefix


def start_again(prefix: Path) -> None:
    """Start this program again with the package in the paths, which the loader reads at its start only."""
    packages = next(prefix.glob("lib/python3*/site-packages"))
    found = {"AMENT_PREFIX_PATH": prefix, "PYTHONPATH": packages, "LD_LIBRARY_PATH": prefix / "lib"}
    paths = {name: f"{path}:{os.environ.get(name, '')}" for name, path in found.items()}
    os.execve(sys.executable, [sys.executable, *sys.argv], os.environ | paths | {READY: "1"})


def questions(s: Any, a: Any, m: Any, motion: Any) -> Iterator[tuple[Any, str, dict[str, Any], int]]:
    """Services and actions with their requests in the order of the calls, and the result code that is due."""
    result, state = m.Result, m.SimulationState

    def to(value: int, code: int) -> tuple[Any, str, dict[str, Any], int]:
        return s.SetSimulationState, "set_simulation_state", {"state": state(state=value)}, code

    def of(entity: str, code: int, **flags: Any) -> tuple[Any, str, dict[str, Any], int]:
        return s.SetEntityState, "set_entity_state", {"entity": entity, **flags}, code

    answers, ok = s.SetSimulationState.Response, result.RESULT_OK
    moved = m.EntityState(pose=motion.Pose(), twist=motion.Twist())
    moved.pose.position.x, moved.pose.position.z, moved.pose.orientation.w = 3.0, 20.0, 1.0
    moved.twist.linear.x = 1.5
    bad = m.EntityState()
    bad.pose.orientation.w = 0.0
    yield s.GetSimulatorFeatures, "get_simulator_features", {}, ok
    yield s.GetSimulationState, "get_simulation_state", {}, ok
    yield s.StepSimulation, "step_simulation", {"steps": 5}, result.RESULT_OPERATION_FAILED
    yield to(state.STATE_PLAYING, answers.ALREADY_IN_TARGET_STATE)
    yield to(state.STATE_PAUSED, ok)
    yield s.StepSimulation, "step_simulation", {"steps": 1}, ok
    yield s.StepSimulation, "step_simulation", {"steps": 10}, ok
    yield s.StepSimulation, "step_simulation", {"steps": 0}, result.RESULT_OPERATION_FAILED
    yield a.SimulateSteps, "simulate_steps", {"steps": 20}, ok
    yield a.SimulateSteps, "simulate_steps", {"steps": 0}, result.RESULT_OPERATION_FAILED
    yield a.SimulateSteps, "simulate_steps", {"steps": CANCELLED}, result.RESULT_OPERATION_FAILED
    yield s.GetEntities, "get_entities", {}, ok
    yield s.GetEntities, "get_entities", {"filters": m.EntityFilters(filter="^x")}, ok
    yield s.GetEntities, "get_entities", {"filters": m.EntityFilters(filter="(")}, result.RESULT_OPERATION_FAILED
    yield s.GetEntityInfo, "get_entity_info", {"entity": "sbs"}, ok
    yield s.GetEntityState, "get_entity_state", {"entity": "sbs"}, ok
    yield s.GetEntityState, "get_entity_state", {"entity": "nobody"}, result.RESULT_NOT_FOUND
    yield of("sbs", ok, state=moved, set_pose=True, set_twist=True)
    yield s.GetEntitiesStates, "get_entities_states", {}, ok
    yield of("sbs", s.SetEntityState.Response.INVALID_POSE, state=bad, set_pose=True)
    yield of("sbs", result.RESULT_FEATURE_UNSUPPORTED, set_acceleration=True)
    yield s.ResetSimulation, "reset_simulation", {"scope": 2}, ok
    yield s.ResetSimulation, "reset_simulation", {"scope": 0}, result.RESULT_FEATURE_UNSUPPORTED
    yield to(state.STATE_STOPPED, ok)
    yield s.GetSimulationState, "get_simulation_state", {}, ok
    yield to(state.STATE_PLAYING, ok)
    yield to(state.STATE_NO_WORLD, result.RESULT_FEATURE_UNSUPPORTED)
    yield to(77, answers.INCORRECT_TRANSITION)
    yield to(state.STATE_QUITTING, ok)


def ask(client: Any, kind: Any, name: str, request: dict[str, Any]) -> Any:
    """Response of a service, or result of a goal, whose feedback must count every step."""
    if not hasattr(kind, "Goal"):
        return client.call(kind, name, **request)
    goal, steps = client.send_goal(kind, name, **request), request["steps"]
    if steps == CANCELLED:
        client.until(lambda: goal.feedback, "feedback of a goal")
        goal.cancel()
    _, result = goal.end()
    client.spin(0.5)
    told = [(one.completed_steps, one.remaining_steps) for one in goal.feedback]
    assert told == [(done, steps - done) for done in range(1, len(told) + 1)], told
    assert steps == CANCELLED or len(told) == steps, told
    return result


def content(response: Any) -> str:
    """What a response holds beside its result, in a few words."""
    if hasattr(response, "features"):
        return f"features {list(response.features.features)}"
    if hasattr(response, "states"):
        return f"{list(response.entities)}, {where(response.states[0])}"
    if hasattr(response, "entities"):
        return f"entities {list(response.entities)}"
    if hasattr(response, "info"):
        return f"category {response.info.category.category}, {response.info.description}"
    if hasattr(response, "state"):
        state = response.state
        return where(state) if hasattr(state, "pose") else f"state {state.state}"
    return ""


def where(state: Any) -> str:
    """Place, velocity and time of an entity."""
    place, velocity, stamp = state.pose.position, state.twist.linear, state.header.stamp
    at = ", ".join(f"{value + 0.0:.2f}" for value in (place.x, place.y, place.z))
    moves = ", ".join(f"{value:.2f}" for value in (velocity.x, velocity.y, velocity.z))
    return f"{state.header.frame_id}: at ({at}) m with ({moves}) m/s, time {stamp.sec + 1e-9 * stamp.nanosec:.2f} s"


def asked(request: dict[str, Any]) -> str:
    """A request in a few words."""
    words = []
    for name, value in request.items():
        shown = getattr(value, "state", getattr(value, "filter", value))
        words.append(f"{name} {shown}" if isinstance(shown, int | str) else name)
    return ", ".join(words)


def main() -> int:
    """Build, ask, print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("checkout", nargs="?", type=Path, help="of simulation_interfaces; without, it is installed")
    options = parser.parse_args()
    if options.checkout is not None and READY not in os.environ:
        start_again(build(options.checkout.resolve()))
    sys.path.insert(0, str(ROOT / "test" / "support"))
    import simulation_interfaces.action as a
    import simulation_interfaces.msg as m
    import simulation_interfaces.srv as s
    from ament_index_python.packages import get_package_share_path
    from geometry_msgs import msg as motion
    from ros_harness import DOMAINS, world

    from sbs_sim.recording import read
    from sbs_sim.recording.recorded_flight import flight_of
    from sbs_sim.recording.verification import verify

    text = (get_package_share_path(PACKAGE) / "package.xml").read_text(encoding="utf-8")
    print(f"simulation_interfaces {text.split('<version>')[1].split('<')[0]}\n")
    print("| service | request | result | due | answer |\n|---|---|---|---|---|")
    wrong = 0
    with tempfile.TemporaryDirectory() as folder, world(next(DOMAINS), Path(folder)) as made:
        log = Path(folder) / "flight.mcap"
        simulator = made.start("simulator", record=log, simulation_interfaces=True, altitude=10.0)
        for kind, name, request, due in questions(s, a, m, motion):
            response = ask(made.client, kind, name, request)
            code = response.result.result if hasattr(response, "result") else due
            said = response.result.error_message[:WIDTH] if hasattr(response, "result") else ""
            wrong += code != due
            print(f"| `{name}` | {asked(request)} | {code} | {due} | {said or content(response)} |")
        code = simulator.wait()
        print(f"\nexit code of the simulator: {code}")
        same = verify(flight_of(read(log))).identical
        print(f"its log repeats bit for bit: {'yes' if same else 'no'}")
        wrong += code != 0 or not same
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
